"""Where a held wheelset touches its rails, and with which forces, at every lateral displacement: both wheels."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.wheel_on_rail import DEEP
from models.core.errors import InputError, RunFailed
from models.core.tables import write_table
from models.machine.seconds import cost
from models.rail.contact_table import Contact, Place, Placed, rolling_radius_difference
from models.systems.wheel_rail.plan import case_text
from models.systems.wheel_rail.scene import WheelRailScene

SYSTEM = "wheel-rail"
Progress = Callable[[str, float], None]
WHEELS = ("right", "left")
FLANGE = 0.8
"""Contact angle (rad) from which on a patch is called one of the flange."""
TOO_DEEP = ("distance", "load")
"""What the theories complain of where the contact grows out of its surroundings."""
COLUMNS: dict[str, tuple[str, Callable[[Place], float]]] = {
    "on_rail": ("mm", lambda p: 1e3 * (p.y - p.top)),
    "in_track": ("mm", lambda p: 1e3 * p.y),
    "on_wheel": ("mm", lambda p: 1e3 * p.wheel_centre),
    "ahead": ("mm", lambda p: 1e3 * p.x),
    "angle": ("deg", lambda p: float(np.degrees(-p.centre_angle))),
    "normal": ("kN", lambda p: 1e-3 * p.normal),
    "peak": ("MPa", lambda p: 1e-6 * p.peak),
    "area": ("mm^2", lambda p: 1e6 * p.area),
    "half_length": ("mm", lambda p: 5e2 * p.length),
    "half_width": ("mm", lambda p: 5e2 * p.width),
    "rolling_radius": ("mm", lambda p: 1e3 * p.rolling_radius),
    "touch_on_rail": ("mm", lambda p: 1e3 * (p.touch_y - p.top)),
    "touch_on_wheel": ("mm", lambda p: 1e3 * p.wheel_y),
    "touch_angle": ("deg", lambda p: float(np.degrees(-p.angle))),
    "fx": ("kN", lambda p: 1e-3 * p.fx),
    "fy": ("kN", lambda p: 1e-3 * p.fy),
    "mz": ("N m", lambda p: p.mz),
    "mz_on_rail": ("mm", lambda p: 1e3 * (p.touch_y - p.top)),
    "mz_ahead": ("mm", lambda p: 1e3 * p.touch_x),
    "xi_x": ("-", lambda p: p.xi_x),
    "xi_y": ("-", lambda p: p.xi_y),
    "spin": ("1/m", lambda p: p.spin),
    "approach": ("um", lambda p: 1e6 * p.approach),
}
"""Unit and value of every column of a patch."""


def run(scene: WheelRailScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Every case at every position; saves a CSV of patches for each case and wheel, one of positions, a figure."""
    from studies.manchester_figure import figure

    found: dict[str, list[Placed]] = {}
    failed: dict[str, str] = {}
    table: list[str] = []
    for k, (name, case) in enumerate(scene.cases.items()):
        contact, shifts, marks = scene.contact(case), scene.positions.values(), [time.perf_counter()]
        found[name] = []
        for i, shift in enumerate(shifts):
            progress(f"{name} at {1e3 * shift:g} mm", (k + i / shifts.size) / len(scene.cases))
            _try(contact, float(shift), case.yaw, name, found[name], failed)
            marks.append(time.perf_counter())
        table += [
            f"  {name}: {case_text(case.yaw, case.friction)}; {cost(np.diff(marks))} a position",
            *_table(found[name]),
        ]
        _save(name, found[name], folder)
    if any(found.values()):
        figure(
            scene.title,
            {name: (scene.cases[name], placed) for name, placed in found.items()},
            folder / "manchester.png",
        )
    answer = {name: [_answer(one) for one in placed] for name, placed in found.items()}
    return {"scene": scene.title, "folder": str(folder), "failed": failed, "answer": answer, "table": [*table, *NOTES]}


def _try(contact: Contact, shift: float, yaw: float, name: str, found: list[Placed], failed: dict[str, str]) -> None:
    """One position; what prevents it is told, and the others go on."""
    try:
        found.append(contact.at(shift, yaw * shift))
    except (InputError, RunFailed) as error:
        deep = isinstance(error, InputError) and error.place in TOO_DEEP
        failed[f"{name}, {1e3 * shift:g} mm"] = (
            f"a load of {contact.load:g} N presses wheel and rail more than {1e3 * DEEP:g} mm into each other"
            if deep
            else str(error)
        )


def patches(placed: Placed, wheel: str) -> tuple[Place, ...]:
    """The patches of one wheel, the one that carries most first."""
    return tuple(sorted(getattr(placed, wheel), key=lambda place: -place.normal))


def rows(placed: Placed, wheel: str) -> list[dict[str, float]]:
    """Every column of every patch of one wheel."""
    return [{name: value(place) for name, (_, value) in COLUMNS.items()} for place in patches(placed, wheel)]


def _answer(placed: Placed) -> dict[str, Any]:
    return {
        "shift": 1e3 * placed.shift,
        "yaw": 1e3 * placed.yaw,
        "roll": 1e3 * placed.roll,
        "spin_speed": placed.spin_speed,
        "radius_difference": 1e3 * rolling_radius_difference(placed),
        **{wheel: rows(placed, wheel) for wheel in WHEELS},
    }


POSITION = {"shift": "mm", "yaw": "mrad", "roll": "mrad", "spin_speed": "rad/s", "radius_difference": "mm"}
"""Columns of a position, with their units."""


def _save(name: str, found: list[Placed], folder: Path) -> None:
    """A row for each patch and wheel, and a row for each position."""
    if not found:
        return
    answers = [_answer(one) for one in found]
    write_table(
        folder / f"{name}.csv", {key: (unit, np.array([one[key] for one in answers])) for key, unit in POSITION.items()}
    )
    for wheel in WHEELS:
        lines = [
            {"shift": one["shift"], "patch": k, **patch} for one in answers for k, patch in enumerate(one[wheel], 1)
        ]
        units = {"shift": "mm", "patch": "-", **{key: unit for key, (unit, _) in COLUMNS.items()}}
        write_table(
            folder / f"{name}_{wheel}.csv",
            {key: (unit, np.array([line[key] for line in lines])) for key, unit in units.items()},
        )


HEADS = {
    "on_rail": "8.2f",
    "on_wheel": "8.2f",
    "angle": "7.2f",
    "normal": "8.3f",
    "peak": "7.0f",
    "area": "7.1f",
    "half_length": "6.2f",
    "half_width": "6.2f",
    "fx": "7.3f",
    "fy": "7.3f",
}
"""Columns that are printed, and how."""
NOTES = [
    "  centre of pressure: on the rail from its highest point, on the wheel from the taping line, outwards (mm);",
    "  angle of the rail there (deg, down towards the middle); N: normal; Fx, Fy: on the wheel, out (kN); peak (MPa);",
    "  area (mm^2); a, b: half its length and width (mm); dr: rolling radius, right less left (mm)",
]


def _table(found: list[Placed]) -> list[str]:
    """A line for each patch, and what stands out."""
    heads = (
        f"    {'shift':>6} {'wheel':<5}{'rail':>8}{'wheel':>8}{'angle':>7}{'N':>8}{'peak':>7}{'area':>7}{'a':>6}"
        f"{'b':>6}{'Fx':>7}{'Fy':>7}{'dr':>8}"
    )
    lines = [heads]
    for placed in found:
        for wheel in WHEELS:
            for k, patch in enumerate(rows(placed, wheel)):
                lead = f"{1e3 * placed.shift:6.2f} {wheel:<5}" if k == 0 else " " * 12
                values = "".join(f"{patch[key]:{form}}" for key, form in HEADS.items())
                end = f"{1e3 * rolling_radius_difference(placed):8.3f}" if k == 0 and wheel == "right" else ""
                lines.append(f"    {lead}{values}{end}")
    return [*lines, *_remarks(found)]


def _remarks(found: list[Placed]) -> list[str]:
    """Positions with several patches on a wheel, and the first on a flange."""
    several = [
        f"{1e3 * placed.shift:g} ({wheel})" for placed in found for wheel in WHEELS if len(getattr(placed, wheel)) > 1
    ]
    flange = [placed for placed in found for wheel in WHEELS if patches(placed, wheel)[0].angle < -FLANGE]
    lines = [f"    several patches on one wheel at, in mm: {', '.join(several)}"] if several else []
    if flange:
        nearest = min(flange, key=lambda placed: abs(placed.shift))
        lines.append(f"    a flange carries its wheel from {1e3 * nearest.shift:g} mm on; beyond, the wheel climbs it")
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("manchester")
