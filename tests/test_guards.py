"""What cannot be right is refused before a run or raised after it; the stability limits are the engines' own."""

from dataclasses import replace
from importlib import import_module

import mujoco
import numpy as np
import pytest

from models.core.errors import InputError, Refused, RunFailed
from models.core.signals import Smooth
from models.core.time_series import write_time_series
from models.engines import exudyn as exudyn_engine
from models.engines import protocol, stability
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE
from models.engines.protocol import build, check_balance, check_trajectory
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from validation.cases import guards
from validation.hard_cases import setups

LIMITED = [
    (engine, name)
    for engine, names in CATALOGUE.items()
    for name in names
    if stability.step_matrix(name, 1e-3, stability.linearised_matrices(setups.vehicle().vehicle)) is not None
]


def measured(engine: str, integrator: str, geometry: str, steps: int, guided: bool) -> np.ndarray:
    """What five steps of the engine do to each of the states, column by column, without gravity."""
    base, push = setups.vehicle("asymmetric_twin", geometry, g=0.0), 1e-6
    if guided:
        pitch = Smooth(np.zeros((8, 1)), 1e-3, derivatives=2, degree=5)
        base = setups.guided_vehicle(base, setups.static_forces(base, 9, 1e-3), pitch)
    columns = []
    for i in range(8):
        start = replace(base, initial=push * np.eye(8)[i])
        model = import_module(f"models.engines.{engine}").build(start, Settings(integrator, 1e-3, steps * 1e-3))
        columns.append(model.run().states[-1] / push)
    return np.array(columns).T


@pytest.mark.grounds("native")
@pytest.mark.parametrize("geometry", ["exact", "linear"])
@pytest.mark.parametrize(("engine", "integrator"), LIMITED)
def test_step_matrix_is_what_the_engine_does(engine, integrator, geometry):
    linear = stability.linearised_matrices(setups.vehicle("asymmetric_twin").vehicle)
    matrix = stability.step_matrix(integrator, 1e-3, linear)
    power = np.linalg.matrix_power(matrix, 5)
    if integrator == "VelocityVerlet":  # it begins with the acceleration of the start
        power = power @ np.vstack([np.eye(8), stability.first_order(linear)[4:]])
    found = measured(engine, integrator, geometry, 5, guided=False)
    assert np.abs(power[:8] - found).max() < 1e-10 * max(1.0, np.abs(found).max())


@pytest.mark.grounds("native")
@pytest.mark.parametrize(("engine", "integrator"), [("reference", "RK4"), ("mujoco", "RK4"), ("mujoco", "Euler")])
def test_step_matrix_of_the_guided_vehicle(engine, integrator):
    base = setups.vehicle("asymmetric_twin").without_tyres()
    matrix = stability.step_matrix(integrator, 1e-3, stability.linearised_matrices(base.vehicle, (3,)))
    found = measured(engine, integrator, "linear", 5, guided=True)[np.ix_([0, 1, 2, 4, 5, 6], [0, 1, 2, 4, 5, 6])]
    assert np.abs(np.linalg.matrix_power(matrix, 5) - found).max() < 1e-10


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize(
    ("integrator", "limit"),
    [
        ("RK44", 2.785293563405282 / 690.8),  # real root of |R(z)| = 1 over the fastest pole
        ("ExplicitEuler", 2 / 690.8),
        ("ExplicitMidpoint", 2 / 690.8),
        ("RK33", 2.512745326618 / 690.8),
    ],
)
def test_limits_are_the_textbook_ones(integrator, limit):
    linear = stability.linearised_matrices(setups.vehicle().vehicle)
    assert stability.longest_stable_step(integrator, 0.1, 1000.0, linear) == pytest.approx(limit, rel=2e-4)


@pytest.mark.parametrize(("engine", "integrator"), LIMITED)
def test_the_limit_separates_decay_from_growth(engine, integrator):
    assembly = setups.vehicle()
    pushed = replace(assembly, initial=assembly.initial + 1e-6)
    linear = stability.linearised_matrices(assembly.vehicle)
    limit = stability.longest_stable_step(integrator, 0.1, 300.0, linear)
    below, above = (float(f"{limit * part:.3g}") for part in (0.97, 1.03))
    end = setups.unchecked_run(engine, pushed, below, 400 * below, integrator).states[-1]
    assert np.abs(end - assembly.initial).max() < 1e-4
    try:
        grown = setups.unchecked_run(engine, pushed, above, 400 * above, integrator).states
    except RunFailed:
        return
    distance = np.abs(grown - assembly.initial).max(axis=1)
    assert distance.max() > 1e3 * distance[0]


def test_the_refusal_names_limit_and_pole():
    with pytest.raises(Refused, match=r"step 0\.005 s .* limit 0\.00403 s of RK44 .* -690\.8 1/s"):
        setups.run("exudyn", setups.vehicle(), 5e-3, 2.0)


@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_a_free_vehicle_may_run_for_an_hour(engine):
    """Its double zero eigenvalues must not be taken for growth."""
    base = setups.vehicle()
    free = setups.driven_by_forces(base, setups.static_forces(base, 10, 1.0))
    stability.check_step(engine, free, setups.run_settings(engine, 1e-3, 3600.0))


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_a_first_order_step_may_feed_a_weakly_damped_mode_a_little(engine):
    base = setups.vehicle(d1=0.0, d2=0.0, d3=10.0, d4=10.0)
    name = {"exudyn": "ExplicitEuler", "mujoco": "Euler"}[engine]
    stability.check_step(engine, base, setups.run_settings(engine, 1e-6, 1.0, name))


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    return guards.measure(True, tmp_path_factory.mktemp("guards"))


def test_every_guard_holds(rows):
    assert [(row.id, row.reason) for row in rows[0] if row.status in ("failed", "not run")] == []


def test_past_the_check_short_runs_are_silent(rows):
    """What the check is for: the guard after the run cannot see them."""
    counts = rows[1]["unstable"]
    assert all(both["checked"]["SILENT"] == 0 < both["unchecked"]["SILENT"] for both in counts.values())
    assert len(guards.tables(rows[1])[0].rows) == 6


def test_a_missing_check_fails_the_row(monkeypatch):
    monkeypatch.setattr(protocol, "check_step", lambda *_: None)
    assert guards._unstable_step_rows("exudyn", {}, quick=True)[0].status == "failed"


def test_a_missing_balance_fails_the_row(monkeypatch):
    monkeypatch.setattr(exudyn_engine, "check_balance", lambda *_: None)
    assert set(guards.unchecked_prescribed_pitch_endings().values()) == {"answered"}


@pytest.mark.parametrize(
    ("times", "states", "reason"),
    [
        ([], np.empty((0, 8)), "0 states"),
        ([0.0, 1.0], np.full((2, 8), 2e4), "beyond"),
        ([0.0, 1.0], np.full((2, 8), np.nan), "not a number"),
        ([0.0, 0.5, 0.25], np.zeros((3, 8)), "backwards"),
        ([0.0, 0.5], np.zeros((2, 8)), "stopped at 0.5"),
    ],
)
def test_the_guard_names_what_it_found(times, states, reason):
    with pytest.raises(RunFailed, match=reason):
        check_trajectory("engine", np.array(times), states, 1.0)


def test_a_moment_that_is_no_number_fails_the_run():
    with pytest.raises(RunFailed, match="not a number"):
        check_trajectory(
            "engine", np.array([0.0, 1.0]), np.zeros((2, 8)), 1.0, enforcing_forces=np.array([[0.0], [np.nan]])
        )


def test_a_multiplier_may_be_small_beside_the_inertia_term():
    times = np.linspace(0, 1, 101)
    check_balance("engine", times, np.full((101, 1), 10.0), lambda row: (np.zeros(1), np.full(1, 1000.0)))
    with pytest.raises(RunFailed, match="balance"):
        check_balance("engine", times, np.full((101, 1), 100.0), lambda row: (np.zeros(1), np.full(1, 1000.0)))


@pytest.mark.parametrize("place", ["passive", "control"])
def test_a_foreign_mujoco_callback_is_noticed(place):
    from models.engines.mujoco_callback import table_law

    model = build("mujoco", setups.vehicle(), Settings("RK4", 1e-3, 0.1))
    getattr(mujoco, f"set_mjcb_{place}")(table_law().ctypes)
    try:
        with pytest.raises(RunFailed, match="another callback"):
            model.run()
    finally:
        getattr(mujoco, f"set_mjcb_{place}")(None)


def test_an_interrupt_in_exudyn_is_an_interrupt(monkeypatch):
    """Exudyn turns every exception of a callback into its own; a user who stops a study means all of it."""
    base = setups.vehicle()
    forces = setups.static_forces(base, 102, 1e-3, is_held=False)

    def reader(self, column, scale):
        def read(mbs, t, load):
            raise KeyboardInterrupt

        return read

    monkeypatch.setattr(exudyn_engine.SignalClock, "reader", reader)
    model = build("exudyn", setups.driven_by_forces(base, forces), Settings("RK44", 1e-3, 0.1))
    with pytest.raises(KeyboardInterrupt):
        model.run()


def test_held_forces_beside_a_prescribed_pitch_do_not_hold_the_pitch():
    base = setups.vehicle()
    forces = setups.static_forces(base, 300, 1e-3, noise_deviation=500.0)
    pitch = setups.smooth_pitch(0.02 * np.sin(6.0 * 1e-3 * np.arange(301)), 1e-3)
    assembly = setups.guided_vehicle(base, forces, pitch)
    fine = setups.run("reference", assembly, 1.25e-4, 0.2).states[::8]
    adaptive = setups.run("reference", assembly, 1e-3, 0.2, "DOP853").states
    assert np.abs(fine - adaptive).max() < 1e-6  # RK4 at 1/8 of the step; holding the pitch would give 1e-4


def test_a_start_that_a_prescribed_pitch_would_override_is_refused(tmp_path):
    forces = {"front": ("N", np.full(20, 3825.9)), "rear": ("N", np.full(20, 3825.9))}
    write_time_series(tmp_path / "forces.csv", forces, 0.1)
    write_time_series(tmp_path / "pitch.csv", {"pitch": ("rad", np.zeros(20))}, 0.1)
    held = {"file": "forces.csv", "interpolation": "held"}
    effects = {"wheel_forces": held, "prescribed_pitch": {"file": "pitch.csv"}}
    table = {"title": "", "run": {"duration": 1.0}, "start": {"pitch": 0.1}, "effects": effects}
    with pytest.raises(InputError, match=r"start\.pitch = 0\.1: the pitch is prescribed"):
        assembly_of_scene(build_scene(table, "scene.toml", tmp_path))
