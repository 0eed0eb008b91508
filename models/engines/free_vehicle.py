"""A free vehicle in an engine: the code that all engines share.

The engine has the bodies, their joints and weights, and the springs that it is handed; all other forces come from one
compiled kernel of (numbers, time, positions, rates, forces), the last three pointers to doubles in the order of the
vehicle's coordinates, as those of ``models.multibody.forces`` and ``models.multibody.cut_kernel`` are. Both engines
march by the classical Runge-Kutta method.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from models.core.errors import InputError
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.native_parts import (
    BodyLoad,
    Connection,
    Coupling,
    DryFriction,
    GroundSpring,
    LineSpring,
    NativePart,
    TurningSpring,
    joint_parts,
)
from models.engines.protocol import check_trajectory, settings_of
from models.vehicles.spatial import SpatialVehicle

if TYPE_CHECKING:
    from models.multibody.plain.march import Acceleration

ENGINES = ("exudyn", "mujoco")


@dataclass(frozen=True, eq=False)
class LoadedVehicle:
    """A free vehicle with the forces on it, from which an engine builds its model. vehicle : every body directly before
    those that it carries; gravity (3,) in m/s^2.

    numbers : table of doubles that the kernel reads; kernel : compiled function that adds to the forces, None where the
    engine computes all forces itself and calls nothing back; block : compiled function of (address, time, n) that
    clears and fills the forces of a block f, q, v (n,) and numbers; parts, ground_springs, line_springs,
    turning_springs : springs, dampers, mounts and bars that the engine itself computes, in addition to the kernel's
    forces; frictions, couplings, connections : along its coordinates, between them, and between points of bodies, as
    the engine has them: explicit integrators of Exudyn ignore the latter two; body_loads : forces that turn with
    bodies.
    """

    vehicle: SpatialVehicle
    gravity: np.ndarray
    numbers: np.ndarray
    kernel: Any
    block: Any
    parts: tuple[NativePart, ...] = ()
    ground_springs: tuple[GroundSpring, ...] = ()
    line_springs: tuple[LineSpring, ...] = ()
    frictions: tuple[DryFriction, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    connections: tuple[Connection, ...] = ()
    turning_springs: tuple[TurningSpring, ...] = ()
    body_loads: tuple[BodyLoad, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates of the vehicle."""
        return len(self.vehicle.coordinates())

    @property
    def tied(self) -> bool:
        """Whether the vehicle has constraints between coordinates or bodies."""
        return bool(self.couplings or self.connections)

    @property
    def has_kernel(self) -> bool:
        """Whether a compiled kernel adds forces to those that the engine itself computes."""
        return self.kernel is not None


class FreeModel(ABC):
    """A free vehicle built in one engine; ``settings`` are needed for ``run`` only."""

    ENGINE: ClassVar[str]

    driven: LoadedVehicle
    size: int
    settings: Settings | None
    step: float

    @property
    def numbers(self) -> np.ndarray:
        """The table that the compiled forces read; values written into it are used from then on."""
        return self.driven.numbers

    @contextmanager
    def at_step(self, time_step: float) -> Iterator[None]:
        """Context in which a caller can march the engine in steps of ``time_step`` (s)."""
        self.step = time_step
        yield

    def compiled(self) -> Any:
        """The handle with which compiled code can call the engine; None where the engine has none."""
        return None

    @abstractmethod
    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), from positions and rates (n,)."""

    @abstractmethod
    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""

    @abstractmethod
    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Positions and rates (steps + 1, 2 n) at every step, from initial positions and rates (n,); RunFailed where
        the engine stops."""

    def run(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> Trajectory:
        """Trajectory from positions and rates (n,), or from rest in the design position, with states at every step.

        RunFailed unless all of it is finite and sane.
        """
        settings, rest = settings_of(self.ENGINE, self.settings), np.zeros(self.size)
        steps, step = settings.steps, settings.step
        states = self.march(rest if q is None else q, rest if v is None else v, steps, step)
        times = step * np.arange(steps + 1)
        check_trajectory(self.ENGINE, times, states, steps * step)
        return Trajectory(times, states, counts={"steps": steps, "force calls": 4 * steps})


class PlainModel(FreeModel):
    """The independent reference: equations of a vehicle in plain Python, integrated with numpy; it has no table of
    numbers."""

    def __init__(
        self,
        engine: str,
        acceleration_function: "Acceleration",
        coordinate_count: int,
        run_settings: Settings | None = None,
    ) -> None:
        """acceleration_function : function that gives accelerations (n,) at a time (s), positions and rates (n,);
        engine : name of a run."""
        self.ENGINE = engine  # type: ignore[misc]
        self.equations, self.size, self.settings = acceleration_function, coordinate_count, run_settings

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), from positions and rates (n,)."""
        return self.equations(time, q, v)

    def plan(self) -> dict[str, int]:
        """Counts of built items: coordinates, and no native items or callbacks."""
        return {"degrees of freedom": self.size, "native items": 0, "callbacks": 0}

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Positions and rates (steps + 1, 2 n) at every step, from initial positions and rates (n,); not finite after a
        failure."""
        from models.multibody.plain.march import march

        return march(self.equations, q, v, steps, step)


def free_model(engine: str, loaded_vehicle: LoadedVehicle, run_settings: Settings | None = None) -> FreeModel:
    """The free vehicle in "exudyn" or "mujoco"; ``run_settings`` are needed for runs, not for single steps."""
    if engine not in ENGINES:
        raise InputError("", "engine", engine, "no such engine", ENGINES)
    model: FreeModel = getattr(_engine_module(engine), f"Free{engine.capitalize()}")(loaded_vehicle, run_settings)
    return model


def native_elements_and_joints(engine: str, loaded_vehicle: LoadedVehicle) -> tuple[tuple[str, ...], int]:
    """Names of the springs, mounts and bars that a built model of an engine itself computes, and the number of its
    joints.

    Counted in the model; it is built without its callback, for which numba would compile.
    """
    elements_and_joints: tuple[tuple[str, ...], int] = _engine_module(engine).native_elements_and_joints(loaded_vehicle)
    return elements_and_joints


def native_share(
    vehicle: SpatialVehicle, native_parts: Mapping[str, tuple[NativePart, ...]] | None = None
) -> tuple[tuple[str, str], ...]:
    """Lines of a plan, heading and text, on the joints and springs that each engine computes natively, and on why
    others are not native, counted in built models. The vehicle's springs act along axes that turn with their carrier's
    heading.

    Such springs act along axes that turn with the carrier only, while both their ends roll and pitch relative to it.
    Elements along coordinates are native. native_parts : further parts of each engine, of springs that keep to other
    bodies.
    """
    along, bars, lines = joint_parts(vehicle), len(vehicle.bars), []
    count = len(vehicle.springs) + len(along)
    for engine in ENGINES:
        parts = (*along, *(native_parts or {}).get(engine, ()))
        names, joints = native_elements_and_joints(
            engine, LoadedVehicle(vehicle, np.zeros(3), np.zeros(1), None, None, parts)
        )
        told = f"{engine}: bodies and {joints} joints, {len(names)} of {count} springs and {bars} bars"
        lines.append(("native", told))
    why = "their axes turn with the carrier alone, beside which both their ends roll and pitch: no element has that"
    return (*lines, *([("shared", f"springs, mounts and bars: {why}")] if vehicle.springs or bars else []))


def _engine_module(engine: str) -> Any:
    """Module with the free vehicle of "exudyn" or "mujoco"."""
    return import_module(f"models.engines.free_vehicle_{engine}")
