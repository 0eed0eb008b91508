"""Bare rides and contacts go where those that were written for that alone go, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from validation.absence import bare_rides
from validation.absence.bare_rides import copy_runs, ride_runs
from validation.absence.hand_built_contact import contact_jobs
from validation.absence.hand_built_ride import Car


def jobs(engine):
    return copy_runs(20) if engine == "reference" else ride_runs(engine, 20)


@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_the_written_car_moves_as_the_bare_one(engine):
    ours, theirs = (job() for job in jobs(engine))
    assert np.abs(ours).max() > 1e-4, "m: it does move"
    assert np.abs(ours - theirs).max() < 1e-14  # 0 in Exudyn, 4e-16 where forces are summed in another order


@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_another_wheel_is_seen(engine, monkeypatch):
    right = Car.of
    monkeypatch.setattr(bare_rides.Car, "of", lambda vehicle: replace(right(vehicle), wheel=32.0))  # of 31.9 kg
    ours, theirs = (job() for job in jobs(engine))
    assert np.abs(ours - theirs).max() > 1e-8


def test_the_written_contact_bears_what_the_bare_one_does():
    ours, theirs = (job() for job in contact_jobs())
    assert np.abs(ours).max() > 1e3
    assert ours == pytest.approx(theirs, rel=1e-13)
