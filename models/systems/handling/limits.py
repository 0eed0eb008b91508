"""Limits beyond which a handling run fails: turnover of car or trailer, jackknife, and time steps that are too long for
the tyres.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from models.core.errors import RunFailed
from models.multibody import forces as at
from models.multibody.numbers import Handling
from models.tyre.bristles import FADING_SPEED
from models.vehicles.free_vehicle import SWAY, wheel_spin_inertia
from models.vehicles.spatial import Freedom, hitch_of

if TYPE_CHECKING:
    from models.systems.handling.run import SimulatedDrive

STABILITY_LIMIT = 2.78
"""Stability limit of the classical Runge-Kutta method on the negative real axis: step times decay rate."""
TURNOVER_ANGLE, JACKKNIFE_ANGLE = 0.5, 1.57
"""Roll or pitch (rad) beyond which a car or trailer counts as turned over, as its suspension moves along the normal of
the road's plane; and yaw (rad) of a towed body relative to its towing vehicle beyond which a train jackknifes.
"""


def check_upright(handling_model: Handling, times: np.ndarray, positions: np.ndarray, engine: str) -> None:
    """Raise RunFailed where the car turns over or the train jackknifes, as the model is invalid from then on.

    positions (m, n) : coordinates of the vehicle at the times (m,) in s.
    """
    for body, freedoms, largest_angle, failure in _rotation_bounds(handling_model):
        columns = [
            i
            for i, (name, freedom) in enumerate(handling_model.vehicle.coordinates())
            if name == body and freedom in freedoms
        ]
        exceeds = (np.abs(positions[:, columns]) > largest_angle).any(axis=1)
        if exceeds.any():
            raise RunFailed(engine, f"{failure}; drive more slowly or steer less", float(times[np.argmax(exceeds)]))


def _rotation_bounds(handling_model: Handling) -> Iterator[tuple[str, tuple[Freedom, ...], float, str]]:
    """Yields the limits of rotation of the car and of each towed body: name of the body, its rotational freedoms, the
    largest angle (rad), and text on what exceeding it means.
    """
    yield SWAY, ("rx", "ry"), TURNOVER_ANGLE, f"the car turns over: it leans by more than {TURNOVER_ANGLE} rad"
    for name in handling_model.vehicle.towed:
        lean_text = f"by more than {{}} rad beside what tows it: {name!r}"
        yield (
            hitch_of(name),
            ("rx", "ry"),
            TURNOVER_ANGLE,
            f"a trailer turns over: it leans {lean_text.format(TURNOVER_ANGLE)}",
        )
        yield (
            hitch_of(name),
            ("rz",),
            JACKKNIFE_ANGLE,
            f"the train jackknifes: a trailer turns {lean_text.format(JACKKNIFE_ANGLE)}",
        )


def check_step(simulated_drive: "SimulatedDrive", engine: str) -> None:
    """Raise RunFailed for a time step that is too long for the tyres. Sticking bristles damp a wheel with C / u (C the
    slip stiffness, u the speed of the tread), and steps above the stability limit let the wheel oscillate.
    """
    h, run_times = simulated_drive.handling, simulated_drive.run.times
    step, force = float(run_times[1] - run_times[0]), np.hypot(simulated_drive["fx"], simulated_drive["fy"])
    for i, tyre in enumerate(h.vehicle.tyres):
        n, load, tread = h.tyre_numbers(i), simulated_drive["load"][:, i], simulated_drive["tread"][:, i]
        stiffness = 8.0 / 3.0 * n[at.RADIUS] * load / n[at.VERTICAL] * n[at.HALF_WIDTH] * n[at.BRISTLES]
        lightness = 1.0 / h.vehicle.body(tyre.body).mass
        if n[at.ROTOR] >= 0.0:
            lightness += tyre.point[2] ** 2 / wheel_spin_inertia(tyre, h.tyres.spin_inertia)
        holds = force[:, i] < 0.95 * n[at.GRIP] * load
        damped = holds * stiffness * lightness / np.maximum(np.abs(tread), FADING_SPEED)
        if step * damped.max() > STABILITY_LIMIT:
            row = int(np.argmax(step * damped > STABILITY_LIMIT))
            raise RunFailed(
                engine,
                f"tyre {tyre.name!r}, at {tread[row]:.3g} m/s, damps its wheel faster than "
                f"steps of {step:g} s can follow; use at most {0.9 * STABILITY_LIMIT / damped.max():.2g} s, "
                "or end the run before",
                float(run_times[row]),
            )
