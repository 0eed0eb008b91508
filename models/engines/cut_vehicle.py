"""A vehicle cut at its wheels in an engine: what is the same in every one.

In an engine it is a free vehicle (``free_vehicle``), of which springs, hub forces and stabilisers are the compiled
forces of ``models.multibody.cut_kernel``. "reference" solves the written-out equations instead, around the same forces;
"plain" shares nothing with any of them (``models.multibody.plain``), and takes some seconds for each of the run.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.core.errors import Refused, RunFailed
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.free_vehicle import Driven, FreeModel, Plain, built_share, free_model
from models.engines.native_parts import Division, divide
from models.engines.protocol import guard
from models.engines.spatial_protocol import check_divides, check_modes
from models.multibody.cut_kernel import WRENCH, accelerate, joint_forces, march, report, set_joint_forces
from models.multibody.cut_table import Drive, table
from models.vehicles.cut_vehicle import PITCH, CutVehicle
from models.vehicles.spatial_linear import linearise

if TYPE_CHECKING:
    from models.multibody.plain.hubs import PlainHubs

ENGINES = ("reference", "exudyn", "mujoco")
PLAIN = "plain"
"""The independent reference, which runs where it is named."""
Route = Literal["native", "compiled"]
"""Whose the springs, mounts and bars are: the engine's own as far as it has them, or all in the compiled forces."""
UPRIGHT = 1.4
"""rad: a vehicle that pitches farther has tumbled, and its heading and roll become one angle at pi / 2."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HubRun(Trajectory):
    """A run, the chassis' six coordinates first, and its forces.

    elements (m, e): forces of springs, mounts and bars in the chassis' axes, compression positive, N or N m
    wrenches (m, hubs, 6): force (N) and moment (N m) at every hub in the drive's frame
    moments (m, 2): of the stabiliser on roll and pitch, N m
    """

    elements: np.ndarray
    wrenches: np.ndarray
    moments: np.ndarray


class Written(FreeModel):
    """The written-out equations."""

    ENGINE = "reference"

    def __init__(self, driven: Driven) -> None:
        self.driven, self.size, self.settings = driven, driven.size, None

    def plan(self) -> dict[str, int]:
        """What was built: equations alone."""
        return {"degrees of freedom": self.size, "native items": 0, "callbacks": 0}

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from the mass matrix of ``models.multibody.cut_mechanics``."""
        rates = np.empty(len(q))
        accelerate(self.numbers, time, np.ascontiguousarray(q), np.ascontiguousarray(v), rates)
        return rates

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Coordinates and rates (steps + 1, 2 n) by the classical Runge-Kutta method."""
        states = np.empty((steps + 1, 2 * len(q)))
        states[0] = np.concatenate((q, v))
        march(self.numbers, states, step)
        return states


class HubModel:
    """A driven cut vehicle in one engine, to be marched over ``steps`` steps of ``step`` (s) by Runge-Kutta 4.

    ``model`` is the free vehicle there.
    """

    def __init__(
        self, engine: str, vehicle: CutVehicle, drive: Drive, step: float, duration: float, forces: Route = "compiled"
    ) -> None:
        """Refused where the step does not divide the duration or the inputs are not one row per half step.

        forces : "native" leaves springs, mounts and bars to the engine, as far as it has them; the written-out
        equations of the reference are the same either way. An enforced tilt needs them "compiled".
        """
        check_divides(engine, Settings("RK4", step, duration))
        self.engine, self.vehicle, self.step, self.steps = engine, vehicle, step, round(duration / step)
        _check(engine, vehicle, drive, 2 * self.steps + 1)
        check_step(engine, vehicle, step, duration)
        self.numbers, self.size = table(vehicle, drive, step), vehicle.size
        weight = np.array([0.0, 0.0, -vehicle.tree.gravity])
        self.plain = _plain(vehicle, drive, step) if engine == PLAIN else None
        division, numbers = Division((), vehicle.elements), self.numbers
        if forces == "native" and engine not in (PLAIN, "reference"):
            if drive.guide is not None and drive.pull is None:
                raise Refused(engine, 'an enforced tilt needs every force in one place: use forces = "compiled"')
            division = divide(vehicle, engine)
            numbers = table(replace(vehicle, elements=division.shared), drive, step)
        self.division = division
        self.model = self._in_engine(
            Driven(vehicle.tree, weight, numbers, joint_forces, set_joint_forces, division.native)
        )

    def _in_engine(self, driven: Driven) -> FreeModel:
        if self.plain:
            return Plain(self.engine, self.plain.acceleration, self.size)
        return Written(driven) if self.engine == "reference" else free_model(self.engine, driven)

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), coordinates and rates (n,)."""
        return self.model.acceleration(time, q, v)

    def marched(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Coordinates and rates (steps + 1, 2 n) from those at the start, (n,) each; RunFailed where it stops."""
        return self.model.march(q, v, self.steps, self.step)

    def plan(self) -> dict[str, int]:
        """What was built: degrees of freedom, native items, callbacks."""
        return self.model.plan()

    def run(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> HubRun:
        """March from coordinates and rates (n,), or from rest; RunFailed unless the vehicle stays upright."""
        rest = np.zeros(self.size)
        states = self.marched(rest if q is None else q, rest if v is None else v)
        times = self.step * np.arange(len(states))
        guard(self.engine, times, states, self.steps * self.step)
        tumbled = np.abs(states[:, PITCH]) > UPRIGHT
        if tumbled.any():
            at = int(np.argmax(tumbled))
            raise RunFailed(self.engine, f"the vehicle pitches by more than {UPRIGHT} rad", times[at], states[at])
        return self.reported(times, states)

    def reported(self, times: np.ndarray, states: np.ndarray) -> HubRun:
        """A run with the forces of its states."""
        if self.plain:
            inside, wrenches, moments = self.plain.report(times, states)
            return HubRun(times, states, elements=inside, wrenches=wrenches, moments=moments)
        rows, vehicle = len(times), self.vehicle
        inside, moments = np.empty((rows, len(vehicle.elements))), np.empty((rows, 2))
        wrenches = np.empty((rows, len(vehicle.hubs), WRENCH))
        report(self.numbers, times, np.ascontiguousarray(states), inside, wrenches, moments)
        return HubRun(times, states, elements=inside, wrenches=wrenches, moments=moments)

    def forces_at_rest(self, q: np.ndarray) -> np.ndarray:
        """Forces (n,) on all joints (N, N m) by the compiled forces at time 0, at coordinates (n,) without rates."""
        block = np.concatenate((np.zeros(self.size), q, np.zeros(self.size), self.numbers))
        set_joint_forces(block.ctypes.data, 0.0, self.size)
        return block[: self.size].copy()


def _plain(vehicle: CutVehicle, drive: Drive, step: float) -> "PlainHubs":
    from models.multibody.plain.hubs import PlainHubs

    return PlainHubs(vehicle, drive, step)


@dataclass(frozen=True)
class NativeShare:
    """Native elements of a built model: names of the elements that are the engine's own, count of its joints; why
    others are not."""

    elements: tuple[str, ...]
    joints: int
    reasons: dict[str, str]


def native_share(engine: str, vehicle: CutVehicle) -> NativeShare:
    """Parts of a vehicle that "exudyn" or "mujoco" computes by native elements, counted in a model that is built
    without a callback."""
    division = divide(vehicle, engine)
    driven = Driven(vehicle.tree, np.zeros(3), np.zeros(1), None, None, division.native)
    elements, joints = built_share(engine, driven)
    return NativeShare(elements, joints, division.reasons)


def check_step(engine: str, vehicle: CutVehicle, step: float, duration: float) -> None:
    """Refused where a mode of the vehicle on its tyres, which are stiffer than none, would grow at a step (s)."""
    check_modes(engine, linearise(replace(vehicle.whole, side_forces=())), Settings("RK4", step, duration))


def _check(engine: str, vehicle: CutVehicle, drive: Drive, rows: int) -> None:
    width = (2 if drive.road else WRENCH) * len(vehicle.hubs)
    if drive.hubs.shape != (rows, width) or not np.isfinite(drive.hubs).all():
        raise Refused(engine, f"inputs must be {rows} rows (half steps) of {width} finite numbers")
    if drive.guide is not None and (drive.guide.shape != (rows, 6) or not np.isfinite(drive.guide).all()):
        raise Refused(engine, f"a guide must be {rows} rows (half steps) of 6 finite numbers")


build = HubModel
"""A driven cut vehicle in "reference", "plain", "exudyn" or "mujoco"; step and duration in s. Raises Refused."""
