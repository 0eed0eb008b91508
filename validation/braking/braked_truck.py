"""Vehicles in the plane under torques that are given, moved on by the step or an engine: what a truck must do then."""

from collections.abc import Callable
from typing import Any

import numpy as np

from models.brake.advance import AT_REST, FINE, advance
from models.brake.plane_step import LOAD, REPORTED
from models.brake.plane_vehicle import GRAVITY, PAPER, Plane, truck
from models.brake.surfaces import EVEN, Road
from models.core.errors import RunFailed
from models.tyre.magic_formula import surface
from models.tyre.tyre_table import Tables, TyreTable, stacked


class Moving:
    """A vehicle that begins by rolling along x at a speed (m/s), all its tyres alike, its front wheels steered (rad).

    state (2, 2 + U) and turning (W,) are moved in place; rates (2 + U,) and report (W, 7) are those of the last step;
    time : that passed (s); slope : of the tyres (1/rad), see ``advance``; go : that, or an engine's.
    """

    def __init__(
        self,
        plane: Plane,
        tables: Tables,
        speed: float,
        *,
        steer: float = 0.0,
        road: Road = EVEN,
        slope: float = 10.0,
        go: Callable[..., Any] = advance,
    ) -> None:
        self.plane, self.state, self.turning = plane, np.zeros((2, 2 + plane.masses.size)), speed / plane.radius
        self.state[1, 0], self.time = speed, 0.0
        self.rates, self.report = np.zeros(self.state.shape[1]), np.zeros((plane.wheels, REPORTED))
        steered = np.where(plane.place[:, 0] > 0.0, steer, 0.0)
        self._go, self._others = go, (steered, slope, plane, np.zeros(plane.wheels, dtype=int), road, tables.packed)

    @property
    def speed(self) -> float:
        """Of the first unit's centre of mass (m/s)."""
        return float(np.hypot(*self.state[1, :2]))

    def on(self, torques: np.ndarray, step: float) -> tuple[int, float]:
        """Go on by steps (s) between torques (n + 1, W) in N m; how it ended, and the time (s) that passed.

        torques (W,) : stay for one step.
        """
        ends = torques if torques.ndim > 1 else np.tile(torques, (2, 1))
        status, used = self._go(self.state, self.turning, ends, step, *self._others, self.rates, self.report)
        self.time += used
        return status, used


PLANE = truck(PAPER)
ICE = surface("ice")
LOCKS = 1e9
"""Torque (N m) that locks a wheel at once."""


def braked(
    torques: np.ndarray,
    *,
    tables: Tables | None = None,
    speed: float = 10.0,
    until: float = 0.0,
    step: float = 5.5e-3,
    plane: Plane | None = None,
    yaw: float = 0.0,
    duration: float = 200.0,
    side: float = 0.0,
    **more: Any,
) -> Moving:
    """The truck at the end of a stop, or at a speed (m/s) or a time (s) before.

    torques (4,) : N m; yaw, side : rates at the start; more : as of ``Moving``.
    """
    truck = Moving(plane or PLANE, tables or stacked([ICE]), speed, slope=ICE.cornering, **more)
    truck.state[1, 1:], status = (side, yaw), FINE
    while status == FINE and truck.speed > until and truck.time < duration - 1e-9:
        status, _ = truck.on(torques, step)
    if status not in (FINE, AT_REST):
        raise RunFailed("braking", "the truck does not come to its end", truck.time)
    return truck


def constant(mu: float) -> Tables:
    """Friction that is the same at every slip from 0.1 on."""
    flat = np.broadcast_to(np.array([0.0, mu, mu]), (3, 1, 3)).copy()
    nodes = np.array([0.0, 0.1, np.pi / 2.0]), np.array([0.0, 0.1, 1.0]), np.array([1e4])
    g, h = np.ones((3, 3)) * np.array([1.0, 0.0, 0.0]), np.array([[0.0], [mu], [mu]])
    return stacked([TyreTable(*nodes, flat, g, h)])


def transfer_errors(mu: float = 0.4) -> dict[str, float]:
    """Loads of the axles against their closed form, by those at rest, with all wheels locked, the front or the rear.

    Friction mu on a part of the weight slows the whole mass: z = mu F / (m g -+ mu m g h / E) for one axle, and the
    axles' loads change by m z g h / E.
    """
    lift = PAPER.height / PAPER.wheelbase
    light, static = PLANE._replace(spin=np.full(4, 1e-9)), PLANE.static.reshape(2, 2).sum(1)
    slowing = {
        "all wheels": mu * GRAVITY,
        "front wheels": mu * static[0] / (PAPER.mass * (1.0 - mu * lift)),
        "rear wheels": mu * static[1] / (PAPER.mass * (1.0 + mu * lift)),
    }
    torques, errors = {"all wheels": (1e5, 1e5), "front wheels": (1e5, 0.0), "rear wheels": (0.0, 1e5)}, {}
    for name, torque in torques.items():
        slid = braked(np.repeat(torque, 2), tables=constant(mu), plane=light, duration=0.5)
        wanted = static + PAPER.mass * slowing[name] * lift * np.array([1.0, -1.0])
        errors[name] = float(np.abs(slid.report[:, LOAD].reshape(2, 2).sum(1) / wanted - 1.0).max())
    return errors


def sideways_with_locked_front_wheels() -> float:
    """Lateral way (m) of a truck on ice from 10 to 1 m/s whose front wheels are steered by 0.05 rad, but locked."""
    return float(braked(np.array([LOCKS, LOCKS, 0.0, 0.0]), steer=0.05, until=1.0).state[0, 1])
