"""Hub forces that are held, and integrators that pick their own steps under them: closed forms, scenes, refusals."""

import json
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest

from models.core.errors import InputError, Refused
from models.engines.assembly import Settings
from models.engines.cut_vehicle import ENGINES, PLAIN_ENGINE, HubModel
from models.multibody import cut_kernel
from models.multibody.cut_table import HubInputs
from models.systems.hub_forces.measurement import HubForces
from models.systems.hub_forces.plan import check, describe
from models.systems.hub_forces.run import measure, run
from models.systems.hub_forces.scene import build
from validation.absence.hub_forces import BARE_SCENE, write
from validation.spatial.cars import r19, random_wrenches, static_forces
from validation.spatial.hub_inputs import (
    SOLVER_TOLERANCE,
    acceleration_difference_between_rows,
    centre_of_mass_error,
    samples,
    settings,
    trajectory_gap,
)

ON_ROAD = {"title": "t", "system": "hub-forces", "vehicle": {"file": "r19_free"}, "road": {}, "run": {"duration": 0.04}}
OWN_STEPS = {"engines": {"exudyn": {"integrator": "DOPRI5", "tolerance": 1e-9}}}


def scene(**more):
    return build({**ON_ROAD, **more}, "s.toml")


@pytest.mark.grounds("closed form")
def test_held_forces_move_the_centre_of_mass_along_parabolas():
    sizes = {engine: centre_of_mass_error(r19(), engine, "held") for engine in (*ENGINES, PLAIN_ENGINE)}
    assert max(sizes.values()) < 1e-10  # Runge-Kutta 4 in joint coordinates leaves 5e-12 m
    real = HubForces.hub_inputs
    with patch.object(HubForces, "hub_inputs", lambda *given: replace(real(*given), constant_in_step=False)):
        assert centre_of_mass_error(r19(), "reference", "held") > 1e-6  # the last stage of a step reads the next sample


def test_spans_end_where_samples_change_and_the_guide_goes_on():
    hubs = np.repeat([[1.0], [1.0], [2.0], [2.0], [2.0]], 2, axis=0)[:-1]
    hub_inputs = HubInputs(hubs, guide=np.arange(9.0)[:, None] * np.ones(6), constant_in_step=True)
    assert hub_inputs.constant_force_spans() == [(0, 2), (2, 4)]
    part = hub_inputs.in_steps(2, 4)
    assert part.hubs.ravel().tolist() == [2.0] * 5 and part.guide[:, 0].tolist() == [4.0, 5.0, 6.0, 7.0, 8.0]


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize(("engine", "integrator"), [("exudyn", "DOPRI5"), ("reference", "LSODA")])
def test_methods_that_pick_their_steps_read_forces_at_their_times(engine, integrator):
    assert max(centre_of_mass_error(r19(), engine, how, integrator) for how in ("held", "linear")) < 1e-12
    assert trajectory_gap(r19(), engine, integrator) < 1e-7  # the error of Runge-Kutta 4 beside it, 3e-9


@pytest.mark.grounds("plain counterpart")
def test_between_rows_compiled_forces_are_those_of_the_plain_equations():
    assert acceleration_difference_between_rows(r19(), 6) < 1e-12
    nearest = HubModel.__init__

    def blunt(self, *given):
        nearest(self, *given)
        if not self.plain:
            self.model.numbers[cut_kernel.ANY_TIME] = 0.0

    with patch.object(HubModel, "__init__", blunt):
        assert acceleration_difference_between_rows(r19(), 1) > 1e-3


def test_a_run_is_the_same_by_every_route_and_says_what_it_took():
    held = {"forces": {"interpolation": "held"}}
    measured = measure(scene(**held), "mujoco")
    fixed, own = (run(scene(**held, **more), "exudyn", measurement=measured) for more in ({}, OWN_STEPS))
    other = run(scene(**held), "mujoco", measurement=measured)
    apart = [np.abs(each.detail.states - fixed.detail.states).max() for each in (other, own)]
    assert apart[0] < 1e-10 and 0.0 < apart[1] < 1e-4
    assert fixed.counts()["steps"] == 40 and own.counts()["force calls"] > 4 * 40
    assert np.array_equal(own.detail.wrenches[::2].reshape(21, -1), measured.forces.samples)
    with_linear = run(scene(), "exudyn", measurement=replace(measured, scene=scene()))
    assert np.abs(with_linear.detail.states - fixed.detail.states).max() > 1e-4


@pytest.mark.parametrize("method", ["kalman", "prescribed"])
def test_what_holds_roll_and_pitch_works_with_both(method):
    more = {"stabilise": {"method": method, "smoothing": 60.0}, "forces": {"interpolation": "held"}}
    measured = measure(scene(**more), "mujoco")
    fixed, own = (run(scene(**more, **each), "exudyn", measurement=measured) for each in ({}, OWN_STEPS))
    assert np.abs(own["pitch"] - fixed["pitch"]).max() < 1e-5
    assert np.abs(own["holding_moment"] - fixed["holding_moment"]).max() < 1e-2 * np.abs(fixed["holding_moment"]).max()


def test_show_says_what_marches_and_how_forces_are_read():
    told = describe(scene(forces={"interpolation": "held"}, **OWN_STEPS))
    assert "six per hub in the frame 'hub', held" in told
    assert "exudyn     DOPRI5 in its place, which picks its own steps to 1e-09, rows every 0.001 s" in told
    assert "effect     held_forces: a march of its own from sample to sample" in told


def test_a_result_says_why_it_has_no_error_and_a_step_that_is_too_long_is_none():
    own = scene(run={"duration": 0.4, "step": 0.04}, forces={"sampling_rate": 25.0}, **OWN_STEPS)
    with pytest.raises(Refused):
        check(own, ("exudyn", "mujoco"))  # Runge-Kutta 4 in the other engine
    check(own, ("exudyn",))
    result = run(own, "exudyn", error=True)
    assert "Runge-Kutta 4 tells it" in result.data.attrs["error"] and len(result.times) == 11
    assert json.loads(result.data.attrs["counts"])["steps"] > 10


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"engines": {"mujoco": {"integrator": "RK4"}}}, r"engines\.mujoco .* no engine with integrators that pick"),
        ({"engines": {"exudyn": {"integrator": "RK44"}}}, r"engines\.exudyn\.integrator .* no integrator of this"),
        ({"forces": {"interpolation": "zero"}}, r"forces\.interpolation"),
    ],
)
def test_what_is_not_offered_is_refused(more, message):
    with pytest.raises(InputError, match=message):
        scene(**more)


def test_an_engine_is_not_asked_for_what_it_lacks():
    forces = samples(r19())
    with pytest.raises(Refused, match="DOPRI5 is not offered: RK4 or DOP853 or Radau or LSODA"):
        HubModel("reference", r19(), forces.hub_inputs(2e-3, 44), Settings("DOPRI5", 2e-3, 0.088))
    with pytest.raises(Refused, match="held forces change within a step"):
        HubModel("mujoco", r19(), replace(shaken_rows(), constant_in_step=True), settings())


def shaken_rows() -> HubInputs:
    """Forces that change at every half step of ``settings``."""
    rows = 2 * settings().steps + 1
    rest, one = static_forces(r19(), rows), random_wrenches(r19(), "hub", has_guide=False)
    return replace(rest, hubs=rest.hubs + np.arange(rows)[:, None] * (one.hubs[0] - rest.hubs[0]) * SOLVER_TOLERANCE)


def test_samples_of_a_file_must_be_held_over_whole_steps(tmp_path):
    write(tmp_path)
    table = BARE_SCENE | {
        "forces": BARE_SCENE["forces"] | {"interpolation": "held"},
        "run": {"duration": 0.018, "step": 1.5e-3},
    }
    own = build(table, "s.toml", tmp_path)
    with pytest.raises(InputError, match=r"run\.step .* must divide the period of 0.002 s over which samples are held"):
        own.measured(own.cut_vehicle())
