"""Runs of a bicycle on tyres in an engine, or rolling without slip: motion, tyre forces, energy and work; and
eigenvalues of the motion linearised in an engine.
"""

import time

import numpy as np
from scipy.integrate import cumulative_simpson

from models.bicycle.four_bodies import FALLEN_LEAN, LEAN, STEER, YAW, BicycleRide, Y, straight_rolling
from models.bicycle.ideal_rolling import IdealBicycle
from models.bicycle.rolling_tyres import RollingBicycle
from models.core.assumptions import Assumption, with_assumptions
from models.core.discretisation import RunSeries, not_estimated, step_errors, with_stated_errors
from models.core.errors import RunFailed
from models.core.result import Channel, Result, result
from models.engines.assembly import Settings
from models.engines.free_vehicle import FreeModel, free_model
from models.multibody.forces import DISSIPATED, FX, FY, POTENTIAL, PRESS, STEER_POWER
from models.systems.bicycle.scene import BicycleScene

REFERENCE_ENGINE = "reference"
UNIT_OF_COORDINATE = {"x": "m", "y": "m", "yaw": "rad", "height": "m", "lean": "rad", "pitch": "rad"}
UNIT_OF_COORDINATE |= {"rear_angle": "rad", "steer": "rad", "front_angle": "rad"}
"""Channels of the bicycle's coordinates with their units, in the order of ``models.bicycle.four_bodies``. Each has a
second channel for its rate, whose name ends in _rate.
"""
LATERAL_COORDINATES = [Y, YAW, LEAN, STEER]
LINEARISATION_STEP = 1e-7
"""Displacement (m, rad, m/s, rad/s) of a state in the central differences that linearise. With a larger one the stiff
bristles of the tyres begin to slide.
"""
CHANNELS_WITH_ERROR = ("lean", "steer", "yaw")
"""Channels whose discretisation error is stated in the result."""
LARGEST_UNACCOUNTED_ENERGY_SHARE = 1e-3
"""Largest share of the energy that a run may leave unaccounted for. Below 0.1 m/s the equations of the tyres are stiff,
and long steps lose more.
"""
LARGEST_ROW_SPACING = 0.01
"""Largest time (s) between recorded rows."""
LEAN_AT_GROUND_CONTACT = 1.0
"""Lean angle (rad) beyond which the frame or the pedals touch the ground."""


def run(scene: BicycleScene, engine: str, *, error: bool = False) -> Result:
    """Run a bicycle scene in "exudyn", "mujoco" or "reference"; the result's detail is the ``BicycleRide``. Raises
    RunFailed.

    error : whether the error of the time steps is estimated, by further runs in longer steps.
    """
    start_time = time.process_time()
    ride = run_with_ideal_rolling(scene) if engine == REFERENCE_ENGINE else run_on_tyres(scene, engine, scene.run.step)
    seconds = time.process_time() - start_time
    channels = dict[str, Channel]()
    for i, (name, unit) in enumerate(UNIT_OF_COORDINATE.items()):
        channels[name] = Channel("time", ride.positions[:, i], unit)
        channels[f"{name}_rate"] = Channel("time", ride.rates[:, i], f"{unit}/s")
    encoder = scene.control.encoder_gain * ride.positions[:, STEER]
    channels["encoder"] = Channel("time", encoder, "rad", "steer angle as the encoder tells it")
    channels |= {"energy": Channel("time", ride.energy, "J"), "work": Channel("time", ride.work, "J")}
    axes = {"time": Channel("time", ride.times, "s")}
    if ride.tyres is not None:
        for name, column in (("load", PRESS), ("fx", FX), ("fy", FY)):
            channels[name] = Channel(("time", "wheel"), ride.tyres[:, :, column], "N")
        axes["wheel"] = Channel("wheel", ["rear", "front"])
    counts = {"steps": ride.steps}
    labelled = result(scene, channels, axes, engine=engine, counts=counts, seconds=seconds, detail=ride)
    with_assumptions(labelled, bicycle_assumptions(scene))
    if not error:
        return labelled
    return (
        not_estimated(labelled, "its steps are kept to a tolerance")
        if engine == REFERENCE_ENGINE
        else _with_step_error(labelled, scene)
    )


def bicycle_assumptions(scene: BicycleScene) -> list[Assumption]:
    """Assumption of a bicycle run that only the wheels touch the ground, with its limits of the lean angle (rad)."""
    return [
        Assumption(
            "upright",
            "no part but the wheels touches the ground",
            "start with a smaller lean rate, or nearer the speeds at which the bicycle steadies itself",
            lambda run: {"bicycle": run["lean"]},
            "rad",
            -LEAN_AT_GROUND_CONTACT,
            LEAN_AT_GROUND_CONTACT,
        )
    ]


def run_on_tyres(
    scene: BicycleScene, engine: str, time_step: float, duration: float | None = None, steps_per_row: int | None = None
) -> BicycleRide:
    """Run the bicycle on its tyres in an engine with a step (s). The work is summed over all steps. Recorded rows are
    ``steps_per_row`` steps apart, by default at most LARGEST_ROW_SPACING (s); the last row is the end of the run.
    """
    rolling, run = scene.bicycle_on_tyres(), scene.run
    model = free_model(
        engine, rolling.driven, Settings("RK4", time_step, run.duration if duration is None else duration)
    )
    path = model.run(*straight_rolling(rolling.bicycle, run.speed, run.lean_rate))
    fallen = np.abs(path.positions[:, LEAN]) > FALLEN_LEAN
    if fallen.any():
        raise RunFailed(engine, "the bicycle has fallen over", float(path.times[np.argmax(fallen)]))
    tyres, ledger = rolling.report(path.positions, path.rates)
    work = cumulative_simpson(ledger[:, DISSIPATED] + ledger[:, STEER_POWER], x=path.times, initial=0.0)
    step_count = len(path.times) - 1
    kept_rows = slice(None, None, steps_per_row or _steps_between_rows(step_count, time_step))
    plain, q, v = IdealBicycle(rolling.bicycle), path.positions[kept_rows], path.rates[kept_rows]
    motion = [plain.energy(*row) for row in zip(q, v, strict=True)]
    ride = BicycleRide(
        path.times[kept_rows],
        q,
        v,
        motion + ledger[kept_rows, POTENTIAL],
        work[kept_rows],
        step_count,
        tyres[kept_rows],
    )
    if not ride.unaccounted() < LARGEST_UNACCOUNTED_ENERGY_SHARE:
        why = (
            f"{ride.unaccounted():.2g} of the energy is unaccounted for: shorten run.step, {time_step:g} s is too long"
        )
        raise RunFailed(engine, why, float(path.times[-1]))
    return ride


def _steps_between_rows(step_count: int, time_step: float) -> int:
    """Returns the largest number of steps between recorded rows such that rows are at most LARGEST_ROW_SPACING (s) and
    a twentieth of the run apart, and the last row is the end of the run.

    step_count : number of steps of the run; time_step : their length (s).
    """
    most_steps = max(1, min(int(LARGEST_ROW_SPACING / time_step * (1.0 + 1e-9)), step_count // 20))
    return next(stride for stride in range(most_steps, 0, -1) if step_count % stride == 0)


def run_with_ideal_rolling(scene: BicycleScene) -> BicycleRide:
    """Run the bicycle with wheels that roll without slip; recorded rows are about LARGEST_ROW_SPACING (s) apart."""
    rolling, run = scene.bicycle_on_tyres(), scene.run
    bicycle = IdealBicycle(rolling.bicycle, rolling.control)
    rows = max(3, round(run.duration / LARGEST_ROW_SPACING) + 1)
    return bicycle.run(bicycle.upright(run.speed, run.lean_rate), run.duration, rows)


def _with_step_error(run_result: Result, scene: BicycleScene) -> Result:
    """Returns the result with the error that its finite time steps cause, estimated by runs in longer steps."""
    ride, engine, duration = run_result.detail, run_result.data.attrs["engine"], scene.run.duration
    stride = _steps_between_rows(
        ride.steps, scene.run.step
    )  # in steps of any length: rows of longer ones are among these rows

    def series(ride: BicycleRide) -> RunSeries:
        columns = {name: ride.positions[:, list(UNIT_OF_COORDINATE).index(name)] for name in CHANNELS_WITH_ERROR}
        return RunSeries(ride.times, {name: values for name, values in columns.items() if np.abs(values).max() > 1e-12})

    def rerun(step_factor: float, run_share: float) -> RunSeries:
        step = step_factor * scene.run.step
        step_count = int(run_share * duration / step * (1.0 + 1e-9))
        if step_factor > 1.0 and step_count < 2 * stride:
            raise RunFailed(engine, f"steps of {step:g} s are too long for {run_share * duration:g} s")
        step_count = max(step_count, 2 * stride)
        return series(run_on_tyres(scene, engine, step, step_count * step, stride))

    estimates, method_text = step_errors(series(ride), rerun, 4.0, scene.run.step)
    return with_stated_errors(run_result, estimates, method_text)


def lateral_matrix(free_model: FreeModel, rolling_bicycle: RollingBicycle, speed: float) -> np.ndarray:
    """State matrix (8, 8) of an engine's model, linearised about straight upright rolling at a speed (m/s). The state
    is lateral position (m), yaw, lean and steer (rad), then their rates.
    """
    q, v = straight_rolling(rolling_bicycle.bicycle, speed)
    matrix = np.eye(8, 8, 4)
    for j in range(8):
        ends = []
        for displacement in (LINEARISATION_STEP, -LINEARISATION_STEP):
            state = np.array([q, v])
            state[j // 4, LATERAL_COORDINATES[j % 4]] += displacement
            ends.append(free_model.acceleration(0.0, *state)[LATERAL_COORDINATES])
        matrix[4:, j] = np.subtract(*ends) / (2.0 * LINEARISATION_STEP)
    return matrix


def engine_eigenvalues(engine: str, rolling_bicycle: RollingBicycle, speed: float) -> np.ndarray:
    """Eigenvalues (4,) in 1/s of the bicycle on its tyres in an engine: the nearest to each eigenvalue of the linear
    (Whipple) equations, in the same order.

    The other four eigenvalues are not returned. Two of them belong to the tyres and decay far faster; lateral position
    and yaw give a double zero.
    """
    values = np.linalg.eigvals(lateral_matrix(free_model(engine, rolling_bicycle.driven), rolling_bicycle, speed))
    kept_rows = np.sort(np.argsort(np.abs(values))[2:])  # without the double zero
    wanted = rolling_bicycle.bicycle.eigenvalues(speed, rolling_bicycle.control)
    return np.array([values[kept_rows][np.argmin(np.abs(values[kept_rows] - value))] for value in wanted])
