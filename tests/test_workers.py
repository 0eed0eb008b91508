"""Jobs that repeat have the same bits by 1 worker and by 2, and whoever computes them is asked for in one place."""

import os
import signal
from contextlib import suppress
from functools import partial

import numpy as np
import pytest
from mortal_job import Mortal

from models.core.errors import InputError
from models.ensemble.runner import PathBlocks, run_paths, values_in_order
from models.ensemble.workers import Crew, process_pool
from models.identification.fit import fit
from models.identification.problem import FitClock, IdentificationProblem, IdentifiedParameter, measured_channel
from models.identification.uncertainty import likelihood_profile, uncertainty
from models.systems.braking.stops import StopEnsemble
from models.systems.ride.nonlinear import CopiesJob, RunSampling
from studies.command.asked import load_scene
from studies.command.crew import crew_changes_by_options
from validation.ride.in_engines import vehicle_and_road


def stops():
    scene = load_scene("braking_ensemble", ["procedures.straight.speed=2.0"])
    return StopEnsemble(scene.table(), scene.file, scene.folder, "straight", 0.01, 1)


def copies():
    vehicle, road = vehicle_and_road("quarter_car")
    return CopiesJob(vehicle, road, (15.0, 20.0, 25.0), RunSampling(copies=8, lasting=0.5, seed=4))


@pytest.fixture(scope="module")
def pool():
    with process_pool(2) as executor:
        yield executor


@pytest.mark.parametrize(("make", "paths"), [(stops, 4), (copies, 3)])
def test_two_workers_give_the_bits_of_this_process(make, paths, pool):
    alone = run_paths(make(), paths, path_blocks=PathBlocks(1))
    shared = run_paths(make(), paths, executor=pool, path_blocks=PathBlocks(1))
    assert set(alone) == set(shared) and all(np.array_equal(alone[name], shared[name]) for name in alone)
    scattered = alone["distance" if "distance" in alone else "moments"]
    assert len({values.tobytes() for values in scattered}) == paths  # paths that were mixed up would be seen


def straight(values):
    """A model that is linear in its parameters."""
    times = np.linspace(0.0, 1.0, 200)
    return {"y": (times, values[0] + values[1] * times)}


def test_profiles_of_a_fit_are_the_same_by_two_workers(pool):
    times, random = np.linspace(0.0, 1.0, 200), np.random.default_rng(5)
    clock = FitClock(times)
    channel = measured_channel("y", "-", (times, 1.0 + 2.0 * times + 0.1 * random.standard_normal(200)), clock)
    known = uncertainty(
        fit(
            IdentificationProblem(
                straight, [IdentifiedParameter("a", 0.5), IdentifiedParameter("b", 1.0)], [channel], clock
            )
        )
    )
    shared = list(values_in_order(partial(likelihood_profile, known), iter([0, 1]), pool))
    assert [k for k, _ in shared] == [0, 1]
    for k, made in shared:
        alone = likelihood_profile(known, k)
        assert np.array_equal(made.values, alone.values) and np.array_equal(made.misfit_rise, alone.misfit_rise)
    assert not np.array_equal(shared[0][1].misfit_rise, shared[1][1].misfit_rise)


def test_an_interrupt_between_blocks_and_a_resume_give_the_same_bits(tmp_path):
    def stop(state):
        if state.done >= 2:
            raise KeyboardInterrupt

    alone = run_paths(stops(), 4, path_blocks=PathBlocks(1))
    with pytest.raises(KeyboardInterrupt):
        run_paths(stops(), 4, tmp_path, path_blocks=PathBlocks(1), report_progress=stop)
    assert len(list(tmp_path.glob("block*.npz"))) == 2
    resumed = run_paths(stops(), 4, tmp_path, path_blocks=PathBlocks(1))
    assert all(np.array_equal(alone[name], resumed[name]) for name in alone)


@pytest.mark.parametrize(
    ("asked", "crew"),
    [
        ((), Crew(min(2, os.cpu_count() or 1))),
        (("workers=5",), Crew(5)),
        (('cluster="tcp://a:1"',), Crew(min(2, os.cpu_count() or 1), "tcp://a:1")),
    ],
)
def test_a_scene_asks_for_its_crew_and_no_result_depends_on_it(asked, crew):
    scene = load_scene("study_road", asked)
    assert Crew.of(scene) == crew and scene.table() == load_scene("study_road", ()).table()


def test_workers_and_a_cluster_are_not_asked_for_together():
    with pytest.raises(InputError, match=r"^--workers = 3: .*leave one out"):
        crew_changes_by_options(3, "tcp://a:1")
    with pytest.raises(InputError, match=r"workers = 0"):
        load_scene("study_road", ["workers=0"])


@pytest.mark.full
@pytest.mark.parametrize(("workers", "kills"), [(1, 4), (2, 20), (5, 4)])
def test_workers_killed_at_random_moments_change_nothing(workers, kills, tmp_path):
    draw, killed = np.random.default_rng(workers), list[int]()
    due = set(draw.choice(np.arange(1, 200), kills, replace=False).tolist())

    def kill(state):
        seen = [int(path.name) for path in tmp_path.iterdir() if int(path.name) not in killed]
        for process in draw.permutation(seen).tolist() if state.done in due else []:
            with suppress(ProcessLookupError):  # of a pool that has gone
                os.kill(process, signal.SIGKILL)
                killed.append(process)
                return

    with process_pool(workers) as executor:
        found = run_paths(Mortal(tmp_path), 200, executor=executor, path_blocks=PathBlocks(1), report_progress=kill)[
            "x"
        ]
    assert 2 * len(killed) >= kills and np.array_equal(found, np.sqrt(np.arange(200)))
