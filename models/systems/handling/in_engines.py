"""A manoeuvre in an engine, and what is read of it: tyres, energies, motion in the vehicle's own axes."""

from dataclasses import dataclass

import numpy as np

from models.core.errors import RunFailed
from models.core.resolved import check_resolved
from models.engines.free_vehicle import Driven, FreeModel, free_model
from models.engines.spatial_protocol import SpatialRun
from models.multibody import forces as at
from models.multibody import kernel
from models.multibody.numbers import GRAVITY, Handling
from models.tyre.bristles import SLOW
from models.vehicles.free_vehicle import SWAY, chassis_of
from models.vehicles.spatial import FREEDOMS
from models.vehicles.spatial_linear import mass

LIMIT = 2.78
"""Step times rate up to which the classical Runge-Kutta method damps what is damped."""

UPRIGHT = 0.5
"""Roll and pitch (rad) beyond which the car turns over: its suspension moves along the upright of the road's plane."""


@dataclass(frozen=True, eq=False)
class Drive:
    """A run (times, positions, rates) and its reports: tyres (m, w, REPORTED) and ledgers (m, LEDGER) of ``forces``."""

    handling: Handling
    run: SpatialRun
    tyres: np.ndarray
    ledger: np.ndarray

    @property
    def path(self) -> np.ndarray:
        """(m, 3): x, y (m) of the chassis' place on the road, and yaw (rad)."""
        return self.run.positions[:, :3]

    def velocity(self) -> np.ndarray:
        """(m, 3): velocities ahead and to the left (m/s) below the chassis' centre, yaw rate (rad/s)."""
        yaw, rates = self.run.positions[:, 2], self.run.rates
        place = chassis_of(self.handling.given).position
        ahead = np.cos(yaw) * rates[:, 0] + np.sin(yaw) * rates[:, 1] - rates[:, 2] * place[1]
        aside = np.cos(yaw) * rates[:, 1] - np.sin(yaw) * rates[:, 0] + rates[:, 2] * place[0]
        return np.column_stack([ahead, aside, rates[:, 2]])

    def lateral_acceleration(self) -> np.ndarray:
        """(m,) m/s^2 along the vehicle's left, of the place below the chassis' centre."""
        ahead, aside, turning = self.velocity().T
        return np.gradient(aside, self.run.times) + ahead * turning


def build(engine: str, handling: Handling) -> FreeModel:
    """The vehicle in "exudyn" or "mujoco"."""
    return free_model(engine, driven_by(handling))


def driven_by(handling: Handling) -> Driven:
    """What an engine builds: the bodies, and the compiled forces with their table."""
    return Driven(handling.vehicle, handling.gravity, handling.numbers, kernel.forces, kernel.set_forces)


def driven(engine: str, handling: Handling, speed: float, duration: float, step: float = 1e-3) -> Drive:
    """Drive from straight rolling at a speed (m/s) for a duration (s); RunFailed where it does not end well."""
    try:
        run = build(engine, handling).run(*handling.straight(speed), duration, step)
    except RunFailed as error:  # a car on its roof is soon no state that an engine can march
        if error.state is not None:
            _check_upright(handling, np.array([error.time]), error.state[None], engine)
        raise
    return read(handling, run, engine)


def read(handling: Handling, run: SpatialRun, engine: str = "") -> Drive:
    """Reports of a run; RunFailed where a tyre's force is not finite, or the step cannot follow."""
    count, tyres = len(run.times), len(handling.vehicle.tyres)
    report, ledger = np.empty((count, tyres, at.REPORTED)), np.empty((count, at.LEDGER))
    kernel.reports(
        handling.numbers,
        run.times,
        np.ascontiguousarray(run.positions),
        np.ascontiguousarray(run.rates),
        report,
        ledger,
    )
    if not np.isfinite(report).all():
        raise RunFailed(engine, "a tyre's force is not finite: use a smaller step")
    _check_upright(handling, run.times, run.positions, engine)
    _check_step(handling, run, report, engine)
    check_resolved(engine, run.times, run.positions, run.rates, mass(handling.vehicle))
    return Drive(handling, run, report, ledger)


def _check_upright(h: Handling, times: np.ndarray, positions: np.ndarray, engine: str) -> None:
    """Refuse a run whose car turns over: what follows is no car's motion."""
    leans = [h.vehicle.coordinates().index((SWAY, turn)) for turn in ("rx", "ry")]
    over = (np.abs(positions[:, leans]) > UPRIGHT).any(axis=1)
    if over.any():
        raise RunFailed(
            engine,
            f"the car turns over: it leans by more than {UPRIGHT} rad; drive more slowly or steer less",
            float(times[np.argmax(over)]),
        )


def _check_step(h: Handling, run: SpatialRun, report: np.ndarray, engine: str) -> None:
    """Bristles that hold damp a wheel at C / u, u the speed of the tread: refuse a step that lets it swing up."""
    step = float(run.times[1] - run.times[0])
    for i, tyre in enumerate(h.vehicle.tyres):
        n, own = h.numbers[int(h.numbers[at.OF_TYRES]) + at.PER_TYRE * i :], report[:, i]
        stiffness = 8.0 / 3.0 * n[at.RADIUS] * own[:, at.PRESS] / n[at.VERTICAL] * n[at.HALF_WIDTH] * n[at.BRISTLES]
        lightness = 1.0 / h.vehicle.body(tyre.body).mass
        if n[at.ROTOR] >= 0.0:
            lightness += tyre.point[2] ** 2 / h.tyres.spin_inertia
        holds = np.hypot(own[:, at.FX], own[:, at.FY]) < 0.95 * n[at.GRIP] * own[:, at.PRESS]
        damped = holds * stiffness * lightness / np.maximum(np.abs(own[:, at.TREAD]), SLOW)
        if step * damped.max() > LIMIT:
            row = int(np.argmax(step * damped > LIMIT))
            raise RunFailed(
                engine,
                f"tyre {tyre.name!r}, at {own[row, at.TREAD]:.3g} m/s, damps its wheel faster than "
                f"steps of {step:g} s can follow; use at most {0.9 * LIMIT / damped.max():.2g} s, "
                "or end the run before",
                float(run.times[row]),
            )


def energy(drive: Drive) -> np.ndarray:
    """(m,) J: kinetic energy, weights, springs and tyres, by the rigid bodies' own velocities."""
    h, run = drive.handling, drive.run
    motion = np.array([_bodies(h, q, v) for q, v in zip(run.positions, run.rates, strict=True)])
    return motion + drive.ledger[:, at.POTENTIAL]


def unaccounted(drive: Drive) -> np.ndarray:
    """(m,) J: energy less what it was at the start and less what was put in and taken out since, by Simpson's rule.

    Rows lie at every second step: the middle one of three belongs to the rule.
    """
    ledger, times = drive.ledger, drive.run.times
    power = ledger[:, at.DISSIPATED] + ledger[:, at.TORQUE_POWER] + ledger[:, at.STEER_POWER]
    power = power + drive.tyres[:, :, at.POWER].sum(axis=1)
    step = times[1] - times[0]
    work = np.cumsum(step / 3.0 * (power[:-2:2] + 4.0 * power[1:-1:2] + power[2::2]))
    held = energy(drive)[::2]
    return held[1:] - held[0] - work


def _bodies(h: Handling, q: np.ndarray, v: np.ndarray) -> float:
    """Kinetic energy and that of weights (J), body by body from the outermost parent: written without any engine."""
    frames: dict[str | None, tuple] = {None: (np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))}
    total, i = 0.0, 0
    for body in h.vehicle.bodies:
        p, R, u, w, origin = frames[body.parent]
        arm = R @ np.subtract(body.position, origin)
        p, u = p + arm, u + np.cross(w, arm)
        for freedom in (freedom for freedom in FREEDOMS if freedom in body.freedoms):
            axis = R[:, FREEDOMS.index(freedom) % 3]
            if freedom in "xyz":
                p, u = p + axis * q[i], u + axis * v[i] + np.cross(w, axis * q[i])
            else:
                w = w + axis * v[i]
                R = _turned(axis, q[i]) @ R
            i += 1
        frames[body.name] = (p, R, u, w, np.array(body.position))
        spin = R.T @ w
        total += 0.5 * body.mass * u @ u + 0.5 * spin @ np.array(body.inertia) @ spin - body.mass * h.gravity @ p
    return float(total)


def _turned(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about an axis (Rodrigues)."""
    across = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across


def friction_distance(speed: float, mu: float) -> float:
    """Distance (m) in which sliding friction alone stops: v^2 / (2 mu g)."""
    return speed**2 / (2.0 * mu * GRAVITY)
