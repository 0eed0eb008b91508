"""Stated errors of a stop's motion and stopping distance by the length of the time steps, where they can be estimated.

The controller's sample time belongs to the scene; only the number of steps within a sample is reduced. While the
valves of two runs switch alike, the error falls with the step (Richardson). In other steps a controller may switch
valves at other samples. From there on the runs differ at random, and no error is estimated; ensembles of stops give
their statistics. Whether the controller would switch otherwise in shorter steps is tested by its commands to signals
that differ from the run's as those in longer steps do, in the opposite direction.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from models.core.discretisation import (
    LEAST_ORDER,
    ONE_ROUNDING,
    Estimate,
    estimate_rescaled,
    not_estimated,
    reference_size,
    with_stated_errors,
)
from models.core.errors import InputError, RunFailed
from models.core.result import Result
from models.systems.braking.march import BrakingPath
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import StopHistory

LARGEST_ORDER, CAREFUL_ORDER = 1.5, 1.0
"""Largest order of convergence that is assumed (order 2 is lowered by kinks of brakes and friction tables), and the
order that is assumed where two runs do not show any.
"""
COARSE_WINDOW, FINE_WINDOW = 0.4, 0.3
"""Shares of a stop that are repeated with a quarter of the steps per sample, and with two steps where the sample has a
single one.
"""
LONGEST_REPEATED_RUN = 1.1
"""Longest duration of a repeated run, divided by that of the stop."""
EQUAL_PRESSURE_SHARE = 0.01
"""Largest rms difference of the pressures of two runs, divided by the size of the pressures, at which the controller
has acted alike in both.
"""
STOPPING_DISTANCE = "stopping distance"
UNIT_OF_CHANNEL = {"x": "m", "y": "m", "yaw": "rad", "speed": "m/s", "hitch": "rad", STOPPING_DISTANCE: "m"}
"""Channels whose error is stated, with their units."""
LEAST_CHANNEL_SIZES = {"y": 0.1, "yaw": 0.01, "hitch": 0.01}
"""Least size (m, rad) by which the error of a channel is divided, for vehicles that hardly leave their course."""
STANDSTILL_NOTE = "the vehicle stands at once"
SINGLE_RUN_NOTE = "what stands behind the port answers one run alone"
SINGLE_STEP_NOTE = "one step to a sample leaves no longer ones, and in shorter ones the controller may act otherwise"
SUBSTEPS_REMEDY = "raise run.substeps, or see the scatter of many stops, study braking_ensemble"
LONGER_STEPS_NOTE = f"the controller acts otherwise in longer steps: {SUBSTEPS_REMEDY}"
SHORTER_STEPS_NOTE = f"the controller may act otherwise in shorter steps: {SUBSTEPS_REMEDY}"
"""Reasons why no error is estimated. Measured: of 40 random stops whose commands differ in longer steps, the difference
missed the error of the stopping distance by more than a factor of 3 in 8, and was more than 10 times as large in 13. Of
81 stops whose commands agree, 23 were near to switching otherwise; among them were 11 of the 12 whose true pressures,
in 25 times as many steps, differ."""


class RepeatedRuns(NamedTuple):
    """Functions that repeat a stop. repeat_stop : runs the stop with a number of steps per sample, up to a time (s);
    raises InputError or RunFailed. commands_for_speeds : returns the controller's commands to angular speeds of wheels
    (n - 1, W) in rad/s and speeds of the vehicle (n - 1,) in m/s at the samples of a run.
    """

    repeat_stop: Callable[[int, float], BrakingPath]
    commands_for_speeds: Callable[[BrakingPath, np.ndarray, np.ndarray], np.ndarray]


MotionChannels = dict[str, np.ndarray]


def with_error(run_result: Result, scene: BrakingScene, repeated_runs: RepeatedRuns) -> Result:
    """Returns the result of a stop with the errors of its motion and stopping distance, or with the reason why none is
    estimated.

    Raises RunFailed, whose ``partial`` is the result, where the error of a channel is too large for it to be used.
    """
    path, steps = run_result.detail, scene.run.substeps
    if len(path.times) <= 2:
        return not_estimated(run_result, STANDSTILL_NOTE)
    loop = pressures_are_controlled(scene, path)
    if not can_be_repeated(scene) or (loop and steps == 1):
        return not_estimated(run_result, SINGLE_STEP_NOTE if can_be_repeated(scene) else SINGLE_RUN_NOTE)
    try:
        paths = _runs_in_other_steps(path, steps, repeated_runs.repeat_stop)
    except (InputError, RunFailed) as error:
        return not_estimated(run_result, f"other steps end the run: {error}")
    step = scene.run.sample / steps
    if steps == 1:
        return with_stated_errors(run_result, _errors_by_half_step(path, paths[0], step), "a part in half the step")
    if loop and not same_commands(path, paths[0]):
        return not_estimated(run_result, LONGER_STEPS_NOTE)
    if loop and commands_change_nearby(path, paths[0], repeated_runs):
        return not_estimated(run_result, SHORTER_STEPS_NOTE)
    estimates = _errors_by_longer_steps(path, steps, paths, step)
    if rests_on_springs(scene):
        estimates.pop(STOPPING_DISTANCE, None)
    return with_stated_errors(run_result, estimates, "runs in longer steps")


def rests_on_springs(scene: BrakingScene) -> bool:
    """Whether the vehicle comes to rest on springs of its tyres or axles. It may rock on for a second with some time
    steps and not with others, so that the time of the stop and some centimetres of its distance do not converge.
    """
    return scene.relaxation is not None or scene.vehicle.file is not None


def can_be_repeated(scene: BrakingScene) -> bool:
    """Whether a stop of the scene can be repeated. It cannot where a client connects to the port once, a log is
    replayed, or the run keeps to real time.
    """
    port = scene.port
    return port is None or (not (port.command or port.port or port.replay) and port.pace == "simulated")


def pressures_are_controlled(scene: BrakingScene, braking_path: BrakingPath) -> bool:
    """Whether a controller in the loop, or a client at the port, released brakes in a run, so that pressures fall."""
    without_controller = scene.measured is not None or (scene.port is None and scene.controller.kind == "none")
    return not without_controller and bool((np.diff(braking_path.pressures, axis=0) < 0.0).any())


def same_commands(braking_path: BrakingPath, other_braking_path: BrakingPath) -> bool:
    """Whether the controller acted alike in two runs: the rms difference of pressures, divided by their size, is at
    most EQUAL_PRESSURE_SHARE.
    """
    pressures = _columns_at(braking_path.times, other_braking_path, other_braking_path.pressures)
    return _rms(pressures - braking_path.pressures) <= EQUAL_PRESSURE_SHARE * reference_size(braking_path.pressures)


def commands_change_nearby(
    braking_path: BrakingPath, path_in_longer_steps: BrakingPath, repeated_runs: RepeatedRuns
) -> bool:
    """Whether the controller's commands change if the signals of a run are shifted by as much as longer steps shift
    them, in the opposite direction.

    Valve commands change if any state differs, pressures if they differ by more than EQUAL_PRESSURE_SHARE.
    """
    path_times, speeds = (
        braking_path.times[:-1],
        [np.hypot(run.states[:, 1, 0], run.states[:, 1, 1]) for run in (braking_path, path_in_longer_steps)],
    )
    turning, speed = braking_path.turning[:-1], speeds[0][:-1]
    shifted = 2.0 * turning - _columns_at(path_times, path_in_longer_steps, path_in_longer_steps.turning)
    faster = np.maximum(2.0 * speed - np.interp(path_times, path_in_longer_steps.times, speeds[1]), 0.0)
    plain_commands, shifted_commands = (
        repeated_runs.commands_for_speeds(braking_path, *signals) for signals in ((turning, speed), (shifted, faster))
    )
    if plain_commands.dtype.kind == "i":
        return not np.array_equal(plain_commands, shifted_commands)
    return _rms(plain_commands - shifted_commands) > EQUAL_PRESSURE_SHARE * reference_size(plain_commands)


def motion_channels(braking_path: BrakingPath, times: np.ndarray) -> MotionChannels:
    """Position, yaw, speed and hitch angle of a run at times (n,) in s; constant after the end of the run."""
    positions, rates = braking_path.states[:, 0], braking_path.states[:, 1]
    motion = {
        "x": positions[:, 0],
        "y": positions[:, 1],
        "yaw": positions[:, 2],
        "speed": np.hypot(rates[:, 0], rates[:, 1]),
    }
    if "heading_1" in braking_path.coordinates:
        motion["hitch"] = positions[:, 3] - positions[:, 2]
    return {name: np.interp(times, braking_path.times, values) for name, values in motion.items()}


def motion_and_distance(braking_path: BrakingPath, times: np.ndarray) -> MotionChannels:
    """Channels of the motion at times (n,) in s, and the stopping distance (1,) in m if the vehicle comes to rest."""
    return motion_channels(braking_path, times) | (
        {STOPPING_DISTANCE: StopHistory(braking_path).distance_travelled[-1:]} if braking_path.ended_at_rest else {}
    )


def _runs_in_other_steps(
    braking_path: BrakingPath, steps_per_sample: int, repeat_stop: Callable[[int, float], BrakingPath]
) -> list[BrakingPath]:
    """Repeat a stop with half as many steps per sample and, over its first part and if commands stay alike, with a
    quarter. A stop with a single step per sample is repeated with two over its first part.
    """
    end_time = float(braking_path.times[-1])
    if steps_per_sample == 1:
        return [repeat_stop(2, FINE_WINDOW * end_time)]
    first = repeat_stop(
        steps_per_sample // 2, LONGEST_REPEATED_RUN * end_time if braking_path.ended_at_rest else end_time
    )
    return (
        [first, repeat_stop(steps_per_sample // 4, COARSE_WINDOW * end_time)]
        if steps_per_sample >= 4 and same_commands(braking_path, first)
        else [first]
    )


def _errors_by_longer_steps(
    braking_path: BrakingPath, steps_per_sample: int, runs_in_longer_steps: list[BrakingPath], time_step: float
) -> dict[str, Estimate]:
    """Estimate errors by runs with half and a quarter of the steps per sample. The error of the stopping distance is at
    least the error of x.

    time_step : time step of the stop (s).
    """
    fine, coarse, counts = (
        motion_and_distance(braking_path, braking_path.times),
        motion_and_distance(runs_in_longer_steps[0], braking_path.times),
        [steps_per_sample, steps_per_sample // 2, steps_per_sample // 4],
    )
    compared_times = braking_path.times[braking_path.times <= runs_in_longer_steps[-1].times[-1]]
    channels_of_runs = [motion_channels(run, compared_times) for run in (braking_path, *runs_in_longer_steps)]
    estimates = dict[str, Estimate]()
    for name in [name for name in fine if name in coarse]:
        order = CAREFUL_ORDER
        if len(runs_in_longer_steps) > 1 and name != STOPPING_DISTANCE:
            gaps = [_rms(first[name] - finer[name]) for first, finer in itertools.pairwise(channels_of_runs)]
            order = observed_order_of_stop(gaps[0], gaps[1], counts)
        least_error = 0.0
        if name == STOPPING_DISTANCE:
            order, least_error = estimates["x"].order, estimates["x"].error
        error = _rms(fine[name] - coarse[name]) / ((counts[0] / counts[1]) ** order - 1.0)
        estimates[name] = _estimate_of_channel(name, fine[name], max(error, least_error), order, time_step)
    return estimates


def observed_order_of_stop(fine_difference: float, coarse_difference: float, steps_per_sample: list[int]) -> float:
    """Observed order of convergence of a stop, at most LARGEST_ORDER, from the differences of three runs whose steps
    per sample are ``steps_per_sample``: between the two finer and between the two coarser ones.
    """
    if not (fine_difference > 0.0 and coarse_difference > 0.0):
        return CAREFUL_ORDER
    orders = np.linspace(LEAST_ORDER, LARGEST_ORDER, 61)
    errors = [float(count) ** -orders for count in steps_per_sample]
    ratios = np.log((errors[2] - errors[1]) / (errors[1] - errors[0]))
    return float(orders[np.argmin(np.abs(ratios - math.log(coarse_difference / fine_difference)))])


def _errors_by_half_step(
    braking_path: BrakingPath, other_braking_path: BrakingPath, time_step: float
) -> dict[str, Estimate]:
    """Estimate errors by a run with twice as many steps over the first part of a stop. The relative error of this part
    is assumed for the entire stop.

    time_step : time step of the stop (s).
    """
    in_part = braking_path.times <= other_braking_path.times[-1]
    fine, finer, estimates = (
        motion_channels(braking_path, braking_path.times),
        motion_channels(other_braking_path, braking_path.times[in_part]),
        {},
    )
    for name, values in fine.items():
        size, size_in_part = _size_of_channel(name, values), _size_of_channel(name, values[in_part], FINE_WINDOW)
        error = _rms(values[in_part] - finer[name]) * 2.0**CAREFUL_ORDER / (2.0**CAREFUL_ORDER - 1.0)
        estimates[name] = _estimate_of_channel(
            name, values, error * size / size_in_part if size_in_part > 0.0 else 0.0, CAREFUL_ORDER, time_step
        )
    return estimates


def _columns_at(times: np.ndarray, braking_path: BrakingPath, sampled_columns: np.ndarray) -> np.ndarray:
    """Interpolates columns (n, W) of a run linearly at times (m,) in s."""
    return np.column_stack([np.interp(times, braking_path.times, column) for column in sampled_columns.T])


def _size_of_channel(channel_name: str, channel_values: np.ndarray, run_share: float = 1.0) -> float:
    """Size of a channel by which its error is divided, at least LEAST_CHANNEL_SIZES; ``run_share`` is the share of the
    run that the values cover.
    """
    return max(reference_size(channel_values), run_share * LEAST_CHANNEL_SIZES.get(channel_name, 0.0))


def _estimate_of_channel(
    channel_name: str, channel_values: np.ndarray, channel_error: float, convergence_order: float, time_step: float
) -> Estimate:
    rounding = ONE_ROUNDING * float(np.abs(channel_values).max(initial=0.0)) * math.sqrt(len(channel_values))
    return estimate_rescaled(
        Estimate(max(channel_error, rounding), UNIT_OF_CHANNEL[channel_name], 0.0, convergence_order, time_step),
        _size_of_channel(channel_name, channel_values),
        time_step,
    )


def _rms(values: np.ndarray) -> float:
    """Root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))
