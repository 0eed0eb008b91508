"""Advance of a braked vehicle by controller samples, with the commands to its valves, chambers and steering in between.

All of it is one generator, which as compiled code goes on within a microsecond: what it works on is given to it once
and not in every sample. Compiled, it holds that by one reference: kept by their values, some fifty arrays take the
compiler 18 s, and 140 s where a vehicle on its suspension is in MuJoCo.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.experimental import structref

from models.brake.advance import AT_REST, FINE, advance
from models.brake.brake import WheelBrakes
from models.brake.plane_records import REPORT_SIZE, PlaneMotion
from models.brake.plane_step import copy_row
from models.brake.pressure import AirState, BrakeChambers, advance_by_pressures, advance_by_valves
from models.machine.compiled import closure_with_unique_name, inlined, njit


class RecordedRow(NamedTuple):
    """A recorded row of a braking run and its fields, which are views of the row.

    time (1,): s; state (2, n): positions and rates; turning, pressure, torque (W,): rad/s, bar, N m; report (7, W):
    see ``PlaneMotion``.
    """

    all_values: np.ndarray
    time: np.ndarray
    state: np.ndarray
    turning: np.ndarray
    pressure: np.ndarray
    torque: np.ndarray
    report: np.ndarray

    def motion(self, accelerations: np.ndarray) -> PlaneMotion:
        """``PlaneMotion`` of this row's state, with the given accelerations (2 + U,)."""
        return PlaneMotion(self.state, self.turning, accelerations, self.report)


def empty_row(coordinate_count: int, wheel_count: int) -> RecordedRow:
    """A ``RecordedRow`` of zeros for these numbers of coordinates and wheels."""
    shapes = ((1,), (2, coordinate_count), *((wheel_count,),) * 3, (REPORT_SIZE, wheel_count))
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    block = np.zeros(ends[-1])
    columns = np.split(block, ends[:-1])
    return RecordedRow(block, *(column.reshape(shape) for column, shape in zip(columns, shapes, strict=True)))


def rows_in_one(row_blocks: list[np.ndarray], layout_row: RecordedRow) -> RecordedRow:
    """``RecordedRow`` whose fields hold many rows each, from blocks of rows laid out as ``layout_row``: every field has
    an additional first axis, over the rows.
    """
    ends = np.cumsum([field.size for field in layout_row[1:]])
    block = np.concatenate(row_blocks)
    columns = np.split(block, ends[:-1], axis=1)
    return RecordedRow(
        block,
        *(
            np.ascontiguousarray(column).reshape(-1, *field.shape)
            for column, field in zip(columns, layout_row[1:], strict=True)
        ),
    )


class BrakeCommands(NamedTuple):
    """Commands that stay constant over the next ``sample_generator`` (1,) samples: states of the valves (W,), pressures
    (W,) in bar, of which the first is NaN where valve states apply instead, and steer angles (W,) in rad.
    """

    samples: np.ndarray
    valves: np.ndarray
    pressures: np.ndarray
    steer: np.ndarray


class SampleRecord(NamedTuple):
    """Record of the samples: now (k,), the present state as numbers of which the first is the time (s); rows (m, k),
    states at earlier samples, of which the first ``uncollected_count`` (1,) are filled and not yet collected; end_time
    (s): the run ends with the first sample that ends then or later.
    """

    present_row: np.ndarray
    rows: np.ndarray
    uncollected_count: np.ndarray
    end_time: float


class BrakeSystem(NamedTuple):
    """Brakes and their pressures; torques (n + 1, W) in N m: at the ends of the n steps of a sample."""

    air: AirState
    chambers: BrakeChambers
    brakes: WheelBrakes
    torques: np.ndarray


class BrakingRun(NamedTuple):
    """All data of a braking run that its samples need; sampling_period : duration (s); vehicle_parts: further arguments
    of ``advance``, after the steer angles.
    """

    commands: BrakeCommands
    record: SampleRecord
    sampling_period: float
    braking: BrakeSystem
    vehicle_motion: PlaneMotion
    vehicle_parts: tuple[Any, ...]


@structref.register
class BrakingRunReferenceType(types.StructRef):
    """Type of a ``BrakingRunReference`` for the compiler numba."""


class BrakingRunReference(structref.StructRefProxy):
    """A ``BrakingRun`` that compiled code refers to by its address."""


structref.define_proxy(BrakingRunReference, BrakingRunReferenceType, BrakingRun._fields)


@njit(cache=True, error_model="numpy")
def reference_to_run(commands, record, sampling_period, braking, vehicle_motion, vehicle_parts):
    """``BrakingRunReference`` to the fields of a ``BrakingRun``."""
    return BrakingRunReference(commands, record, sampling_period, braking, vehicle_motion, vehicle_parts)


go: Callable[..., Any] = advance
"""Placeholder of the function that advances the vehicle by a sample; ``samples_with_step`` replaces it."""


def advance_some_samples(commands, record, sampling_period, braking, vehicle_motion, simulated_time, vehicle_parts):
    """Advance a vehicle from a time (s) on by ``commands.samples`` samples, or until it stops or the run ends; ``go``
    advances each sample. Returns the status of the last sample, and the time (s).
    """
    air, chambers, brakes, torques = braking
    status, step = FINE, sampling_period / (torques.shape[0] - 1)
    for _ in range(commands.samples[0]):
        if math.isnan(commands.pressures[0]):
            advance_by_valves(commands.valves, sampling_period, air, chambers, brakes, torques)
        else:
            advance_by_pressures(commands.pressures, air, brakes, torques)
        status, used = go(vehicle_motion, torques, step, commands.steer, *vehicle_parts)
        simulated_time += used
        if status not in (FINE, AT_REST):
            break
        record.present_row[0] = simulated_time
        copy_row(record.present_row, record.rows[record.uncollected_count[0]])
        record.uncollected_count[0] += 1
        if status == AT_REST or simulated_time >= record.end_time:
            break
    return status, simulated_time


some: Callable[..., Any] = advance_some_samples
"""Placeholder of the function that advances the vehicle by some samples; ``samples_with_step`` replaces it."""


def sample_generator(braking_run):
    """Generator that advances the vehicle of a ``BrakingRun`` or a ``BrakingRunReference`` by ``advance_some_samples``.

    Each time, and first at the start, it gives how the last sample ended, the time (s), the speed of the first unit
    (m/s) and the supply (bar).
    """
    status, simulated_time = FINE, 0.0
    while True:
        rates = braking_run.vehicle_motion.state[1]
        yield status, simulated_time, math.hypot(rates[0], rates[1]), braking_run.braking.air.supply[0]
        status, simulated_time = some(
            braking_run.commands,
            braking_run.record,
            braking_run.sampling_period,
            braking_run.braking,
            braking_run.vehicle_motion,
            simulated_time,
            braking_run.vehicle_parts,
        )


def _function_with_globals(plain_function: Callable[..., Any], **new_globals: Any) -> Callable[..., Any]:
    """A copy of the function with other globals and without closure cells. numba identifies functions by the contents
    of these cells, which differ between processes if they hold compiled functions."""
    return FunctionType(plain_function.__code__, globals() | new_globals, plain_function.__name__)


MoveSamples = Callable[..., Iterator[tuple[int, float, float, float]]]
"""Type of a function that begins the generator ``sample_generator``, from commands, record, sample, braking, motion and
all others of a ``BrakingRun``.
"""


def samples_with_step(step_function: Callable[..., Any]) -> MoveSamples:
    """Generator function ``sample_generator`` that advances its vehicle by the given ``step_function``."""
    march = _function_with_globals(
        sample_generator, some=_function_with_globals(advance_some_samples, go=step_function)
    )

    def begun(commands, record, sampling_period, braking, vehicle_motion, *vehicle_parts):
        return march(BrakingRun(commands, record, sampling_period, braking, vehicle_motion, vehicle_parts))

    return begun


@dataclass(frozen=True)
class CompiledSamples:
    """Compiled version of the generator ``sample_generator``; march takes a ``BrakingRunReference``."""

    march: Callable[[BrakingRunReference], Iterator[tuple[int, float, float, float]]]

    def __call__(self, commands, record, sampling_period, braking, vehicle_motion, *vehicle_parts):
        """Generator of ``sample_generator``, from the fields of a ``BrakingRun``."""
        return self.march(reference_to_run(commands, record, sampling_period, braking, vehicle_motion, vehicle_parts))


def compiled_samples(step_function: Callable[..., Any], cache_name: str) -> CompiledSamples:
    """Compiled samples that advance the vehicle by a compiled step function."""
    compiled_some = inlined(
        closure_with_unique_name(_function_with_globals(advance_some_samples, go=step_function), cache_name)
    )
    return CompiledSamples(
        njit(cache=True, error_model="numpy")(
            closure_with_unique_name(_function_with_globals(sample_generator, some=compiled_some), cache_name)
        )
    )


compiled_plane_samples = compiled_samples(advance, "by_steps")
"""Compiled samples of the vehicle in the plane with the step function ``advance``."""
