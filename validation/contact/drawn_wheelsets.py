"""Wheelsets with random parameters, and critical speeds of wheelsets by every implementation."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.optimize import brentq

from models.rail.eigenvalues import free_wheelset, largest_growth_rate
from models.rail.linear import LOWEST_SPEED, critical_speed_or_reason
from models.rail.wheelset import CHOSEN_WHEELSET, GRAVITY, Wheelset
from models.systems.wheelset.of_scene import IMPLEMENTATION_MODULES, equations_class

CriticalSpeeds = dict[str, dict[str, float | None]]
"""Wheelset -> implementation -> critical speed (m/s); None where there is none."""
SEED = 2026
DRAWN_COUNT = 6
"""Number of wheelsets with random parameters."""
PARAMETER_RANGES = {
    "mass": (800.0, 2000.0),
    "spin_inertia": (50.0, 200.0),
    "yaw_inertia": (500.0, 1500.0),
    "radius": (0.35, 0.55),
    "half_gauge": (0.7, 0.8),
    "conicity": (0.02, 0.3),
    "head_radius": (0.15, 0.4),
    "load": (6e4, 2e5),
    "half_spacing": (0.8, 1.2),
    "stiffness_x": (1e5, 3e6),
    "stiffness_y": (1e5, 3e6),
    "stiffness_z": (3e5, 2e6),
    "damping_x": (5e2, 1e4),
    "damping_y": (5e2, 1e4),
    "damping_z": (1e3, 2e4),
    "friction": (0.1, 0.5),
}
STIFF_WHEELSET = CHOSEN_WHEELSET.changed(stiffness_x=1e8, stiffness_y=1e8, damping_x=1e5, damping_y=1e5)
HEAVY_WHEELSET = free_wheelset(CHOSEN_WHEELSET).changed(mass=1e4, yaw_inertia=3e4)
"""Wheelset stable at every speed, by its stiff suspension; wheelset without suspension, so heavy that it is unstable
even at 1 m/s."""
HALF_BRACKET, LOWER_SPEEDS = 0.02, 5
"""Half width of the interval about a known critical speed in which an engine's is searched, divided by the speed;
number of lower speeds that are tried."""


def drawn_wheelsets() -> dict[str, Wheelset]:
    """Name -> wheelset with random parameters, uniform in the logarithm over PARAMETER_RANGES."""
    draw, wheelsets = np.random.default_rng(SEED), dict[str, Wheelset]()
    while len(wheelsets) < DRAWN_COUNT:
        values = {key: float(np.exp(draw.uniform(*np.log(ends)))) for key, ends in PARAMETER_RANGES.items()}
        if values["load"] > 1.5 * GRAVITY * values["mass"]:
            wheelsets[f"drawn {len(wheelsets) + 1}"] = CHOSEN_WHEELSET.changed(**values)
    return wheelsets


def critical_speeds(wheelset: Wheelset, search_nearby: bool) -> dict[str, float | None]:
    """Implementation -> critical speed (m/s) of a wheelset; None where there is none. With ``search_nearby`` the
    engines search near the reference's critical speed."""
    speeds: dict[str, float | None] = {}
    for engine in IMPLEMENTATION_MODULES:
        of, first = partial(largest_growth_rate, equations_class(engine)), speeds.get("reference")
        speeds[engine] = (
            _critical_speed_near(partial(of, wheelset), first)
            if search_nearby and first
            else critical_speed_or_reason(wheelset, of)[0]
        )
    return speeds


def _critical_speed_near(growth_rate_at_speed: Callable[[float], float], speed: float) -> float:
    """Critical speed (m/s) at which ``growth_rate_at_speed`` (1/s) crosses zero, within HALF_BRACKET of ``speed``. If
    there is none in this interval, a lower speed with growth, or the interval's upper end."""
    low, high = (1.0 - HALF_BRACKET) * speed, (1.0 + HALF_BRACKET) * speed
    for below in np.geomspace(LOWEST_SPEED, low, LOWER_SPEEDS):
        if growth_rate_at_speed(float(below)) >= 0.0:
            return float(below)
    return (
        high
        if growth_rate_at_speed(high) < 0.0
        else float(brentq(growth_rate_at_speed, low, high, xtol=1e-12 * speed, rtol=1e-12))
    )
