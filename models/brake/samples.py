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
from models.brake.brake import Brakes
from models.brake.plane_records import REPORT_SIZE, PlaneMotion
from models.brake.plane_step import copy_row
from models.brake.pressure import Air, Chambers, by_pressures, by_valves
from models.machine.compiled import closure_with_unique_name, inlined, njit


class Row(NamedTuple):
    """A recorded row of a braking run and its fields, which are views of the row.

    time (1,): s; state (2, n): positions and rates; turning, pressure, torque (W,): rad/s, bar, N m; report (7, W):
    see ``PlaneMotion``.
    """

    whole: np.ndarray
    time: np.ndarray
    state: np.ndarray
    turning: np.ndarray
    pressure: np.ndarray
    torque: np.ndarray
    report: np.ndarray

    def motion(self, accelerations: np.ndarray) -> PlaneMotion:
        """``PlaneMotion`` of this row's state, with the given accelerations (2 + U,)."""
        return PlaneMotion(self.state, self.turning, accelerations, self.report)


def row(coordinates: int, wheels: int) -> Row:
    """A ``Row`` of zeros for these numbers of coordinates and wheels."""
    shapes = ((1,), (2, coordinates), *((wheels,),) * 3, (REPORT_SIZE, wheels))
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    block = np.zeros(ends[-1])
    columns = np.split(block, ends[:-1])
    return Row(block, *(column.reshape(shape) for column, shape in zip(columns, shapes, strict=True)))


def parts(rows: list[np.ndarray], like: Row) -> Row:
    """``Row`` whose fields hold many rows each, from blocks of rows laid out as ``like``: every field has an additional
    first axis, over the rows.
    """
    ends = np.cumsum([field.size for field in like[1:]])
    block = np.concatenate(rows)
    columns = np.split(block, ends[:-1], axis=1)
    return Row(
        block,
        *(
            np.ascontiguousarray(column).reshape(-1, *field.shape)
            for column, field in zip(columns, like[1:], strict=True)
        ),
    )


class Commands(NamedTuple):
    """Commands that stay constant over the next ``samples`` (1,) samples: states of the valves (W,), pressures (W,) in
    bar, of which the first is NaN where valve states apply instead, and steer angles (W,) in rad.
    """

    samples: np.ndarray
    valves: np.ndarray
    pressures: np.ndarray
    steer: np.ndarray


class Record(NamedTuple):
    """Record of the samples: now (k,), the present state as numbers of which the first is the time (s); rows (m, k),
    states at earlier samples, of which the first ``left`` (1,) are filled and not yet collected; until (s): the run
    ends with the first sample that ends then or later.
    """

    now: np.ndarray
    rows: np.ndarray
    left: np.ndarray
    until: float


class Braking(NamedTuple):
    """Brakes and their pressures; torques (n + 1, W) in N m: at the ends of the n steps of a sample."""

    air: Air
    chambers: Chambers
    brakes: Brakes
    torques: np.ndarray


class Subject(NamedTuple):
    """All data of a braking run that its samples need; sample : duration (s); others: further arguments of ``advance``,
    after the steer angles.
    """

    commands: Commands
    record: Record
    sample: float
    braking: Braking
    motion: PlaneMotion
    others: tuple[Any, ...]


@structref.register
class ReferenceType(types.StructRef):
    """Type of a ``Reference`` for the compiler numba."""


class Reference(structref.StructRefProxy):
    """A ``Subject`` that compiled code refers to by its address."""


structref.define_proxy(Reference, ReferenceType, Subject._fields)


@njit(cache=True, error_model="numpy")
def by_reference(commands, record, sample, braking, motion, vehicle_parts):
    """``Reference`` to the fields of a ``Subject``."""
    return Reference(commands, record, sample, braking, motion, vehicle_parts)


go: Callable[..., Any] = advance
"""Placeholder of the function that advances the vehicle by a sample; ``moved`` replaces it."""


def some_samples(commands, record, sample, braking, motion, simulated_time, vehicle_parts):
    """Advance a vehicle from a time (s) on by ``commands.samples`` samples, or until it stops or the run ends; ``go``
    advances each sample. Returns the status of the last sample, and the time (s).
    """
    air, chambers, brakes, torques = braking
    status, step = FINE, sample / (torques.shape[0] - 1)
    for _ in range(commands.samples[0]):
        if math.isnan(commands.pressures[0]):
            by_valves(commands.valves, sample, air, chambers, brakes, torques)
        else:
            by_pressures(commands.pressures, air, brakes, torques)
        status, used = go(motion, torques, step, commands.steer, *vehicle_parts)
        simulated_time += used
        if status not in (FINE, AT_REST):
            break
        record.now[0] = simulated_time
        copy_row(record.now, record.rows[record.left[0]])
        record.left[0] += 1
        if status == AT_REST or simulated_time >= record.until:
            break
    return status, simulated_time


some: Callable[..., Any] = some_samples
"""Placeholder of the function that advances the vehicle by some samples; ``moved`` replaces it."""


def samples(subject):
    """Generator that advances the vehicle of a ``Subject`` or a ``Reference`` by ``some_samples``.

    Each time, and first at the start, it gives how the last sample ended, the time (s), the speed of the first unit
    (m/s) and the supply (bar).
    """
    status, simulated_time = FINE, 0.0
    while True:
        rates = subject.motion.state[1]
        yield status, simulated_time, math.hypot(rates[0], rates[1]), subject.braking.air.supply[0]
        status, simulated_time = some(
            subject.commands,
            subject.record,
            subject.sample,
            subject.braking,
            subject.motion,
            simulated_time,
            subject.others,
        )


def _with_globals(function: Callable[..., Any], **replacements: Any) -> Callable[..., Any]:
    """A copy of the function with other globals and without closure cells. numba identifies functions by the contents
    of these cells, which differ between processes if they hold compiled functions."""
    return FunctionType(function.__code__, globals() | replacements, function.__name__)


MoveSamples = Callable[..., Iterator[tuple[int, float, float, float]]]
"""Type of a function that begins the generator ``samples``, from commands, record, sample, braking, motion and all
others of a ``Subject``.
"""


def moved(step_function: Callable[..., Any]) -> MoveSamples:
    """Generator function ``samples`` that advances its vehicle by the given ``step_function``."""
    march = _with_globals(samples, some=_with_globals(some_samples, go=step_function))

    def begun(commands, record, sample, braking, motion, *vehicle_parts):
        return march(Subject(commands, record, sample, braking, motion, vehicle_parts))

    return begun


@dataclass(frozen=True)
class CompiledSamples:
    """Compiled version of the generator ``samples``; march takes a ``Reference``."""

    march: Callable[[Reference], Iterator[tuple[int, float, float, float]]]

    def __call__(self, commands, record, sample, braking, motion, *vehicle_parts):
        """Generator of ``samples``, from the fields of a ``Subject``."""
        return self.march(by_reference(commands, record, sample, braking, motion, vehicle_parts))


def compiled(step_function: Callable[..., Any], name: str) -> CompiledSamples:
    """Compiled samples that advance the vehicle by a compiled step function."""
    compiled_some = inlined(closure_with_unique_name(_with_globals(some_samples, go=step_function), name))
    return CompiledSamples(
        njit(cache=True, error_model="numpy")(
            closure_with_unique_name(_with_globals(samples, some=compiled_some), name)
        )
    )


by_steps = compiled(advance, "by_steps")
"""Compiled samples of the vehicle in the plane with the step function ``advance``."""
