"""The Manchester contact benchmark: contact positions, angles and forces of both wheels, compared with CONTACT and with
second methods."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.profile_files import read_profile
from models.contact.wheel_on_rail import TrackGeometry, WheelAndRail, WheelsetGeometry, rail_in_track
from models.rail.contact_table import WheelsetPlacement
from models.systems.wheel_rail.run import run
from models.systems.wheel_rail.scene import LateralPositions
from validation.cases.contact_profiles import RAIL_FILE, WHEEL_FILE
from validation.common.grounds import allowing_breaches
from validation.common.rows import Observed, Row, System, Table, not_run
from validation.common.scenes import data_folder
from validation.contact.manchester_references import (
    PUBLISHED_CONTACT,
    SCENE,
    contact_of,
    exact_on_contact_plane,
    first_touch,
    patch_forces,
    placement_at,
    wheel_sums,
)

TITLE = "The Manchester contact benchmark, cases A"
SYSTEM: System = "contact"
POSITION_TOLERANCE, FORCE_TOLERANCE = 0.3, 2.0
"""Tolerances asked for, of contact positions (mm) and of forces (%)."""
QUICK_LATERAL_SHIFTS = (1.0, 6.5)
"""Lateral displacements (mm) of case A-2 in a quick run."""
PROFILE_FILE_SHIFTS = (0.0, 2.0, 5.0, 6.0, 6.5, 10.0)
"""Lateral displacements (mm) at which the built-in profiles are compared with the benchmark's files."""
PUBLISHED_REASON = (
    "CONTACT's reference output of case A-2.2, exact theory on one plane, cells of 0.2 mm; the bound asked for"
)
FIRST_COLUMN_OF_WHEEL = {"right": 2, "left": 5}
"""First column of each wheel in the published table."""


@allowing_breaches("the benchmark takes elastic steel, as its codes do", "elastic")
def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on case A-2 compared with the published results; a full run also has case A-1 at every mm, searches, profile
    files, and computing times."""
    published = (
        PUBLISHED_CONTACT[np.isin(PUBLISHED_CONTACT[:, 0], QUICK_LATERAL_SHIFTS)] if quick else PUBLISHED_CONTACT
    )
    placed, position_seconds = _timed_positions("A-2", published[:, 0])
    rows = [row for wheel in FIRST_COLUMN_OF_WHEEL for row in _published_rows(wheel, placed, published)]
    rows.append(
        Observed(
            "manchester.two_patches",
            SYSTEM,
            "patches on the right wheel at a shift of 5 mm, case A-1",
            float(len(placement_at("A-1", 5e-3).right)),
            "",
        ).within(2.0, 0.0, "the gauge corner takes over from the head", "published")
    )
    data: dict[str, Any] = {
        "A-2": [_table_of_patches(placement) for placement in placed],
        "published": published.tolist(),
    }
    if not quick:
        static, each_still = _timed_positions("A-1", PUBLISHED_CONTACT[::2, 0])
        data["A-1"] = [_table_of_patches(placement) for placement in static]
        rows += [
            *_first_contact_rows(static),
            *_load_share_rows(placed[10]),
            *_profile_file_rows(placed),
            _wheel_load_row(static),
            _free_axle_row(placed[0]),
            *_computing_time_rows({"A-1": each_still, "A-2": position_seconds}),
        ]
    return rows, data


def _timed_positions(benchmark_case: str, lateral_shifts: np.ndarray) -> tuple[list[WheelsetPlacement], float]:
    """Contacts of the wheelset at every lateral displacement (mm), and the processor time (s) per displacement.
    Wall time would count other cases that run at the same time."""
    positions = LateralPositions(
        start=1e-3 * float(lateral_shifts[0]), stop=1e-3 * float(lateral_shifts[-1]), count=len(lateral_shifts)
    )
    placed_run = run(SCENE.model_copy(update={"positions": positions}), case=benchmark_case)
    return placed_run.detail.placements, placed_run.seconds / len(lateral_shifts)


def _published_rows(
    wheel_side: str, wheelset_placements: list[WheelsetPlacement], published_results: np.ndarray
) -> list[Row]:
    """Rows: contact position, force and peak pressure of one wheel compared with the published results."""
    published_sums = published_results[:, FIRST_COLUMN_OF_WHEEL[wheel_side] : FIRST_COLUMN_OF_WHEEL[wheel_side] + 3]
    off = np.abs(np.array([wheel_sums(position, wheel_side) for position in wheelset_placements]) - published_sums)
    patch, _, _ = off.max(axis=0).tolist()
    _, force, peak = (100.0 * off / published_sums).max(axis=0).tolist()
    rows = [
        Observed(
            f"manchester.places.{wheel_side}",
            SYSTEM,
            f"largest difference of the {wheel_side} wheel's mean place of contact",
            patch,
            "mm",
        ).at_most(POSITION_TOLERANCE, PUBLISHED_REASON, "published"),
        Observed(
            f"manchester.forces.{wheel_side}",
            SYSTEM,
            f"largest difference of the {wheel_side} wheel's normal force",
            force,
            "%",
        ).at_most(FORCE_TOLERANCE, PUBLISHED_REASON, "published"),
        Observed(
            f"manchester.peaks.{wheel_side}",
            SYSTEM,
            f"largest difference of the {wheel_side} wheel's largest pressure",
            peak,
            "%",
        ).beside(0.0, "CONTACT's cells of 0.2 mm; a flange's patch has four of them"),
    ]
    if wheel_side == "right":
        why = "CONTACT's input, which another code found; on the flange its wheels do not stand equally low"
        roll = np.abs(np.array([1e3 * position.roll for position in wheelset_placements]) - published_results[:, 1])
        rows.append(
            Observed("manchester.roll", SYSTEM, "largest difference of the roll", float(roll.max()), "mrad").beside(
                0.0, why
            )
        )
    return rows


def _first_contact_rows(wheelset_placements: list[WheelsetPlacement]) -> list[Row]:
    """Rows: first contact points compared with a search over surface points, and contact compared with its mirror
    image."""
    contact, gaps = contact_of("A-1"), []
    for position in wheelset_placements:
        for sign, patches_of_wheel in ((1.0, position.right), (-1.0, position.left)):
            for patch in patches_of_wheel:
                y, u, angle = first_touch(contact.side, position, sign, patch.wheel_y)
                gaps.append((1e3 * abs(y - patch.touch_y), 1e3 * abs(u - patch.wheel_y), abs(angle - patch.angle)))
    first, two = contact.at(4e-3, 3e-3), contact.at(-4e-3, -3e-3)
    mirror = max(
        abs(a / b - 1.0)
        for wheels in ((first.right, two.left), (first.left, two.right))
        for x, y in zip(*wheels, strict=True)
        for a, b in ((x.y, y.y), (x.normal, y.normal))
    )
    why = "search over points of the wheel's surface, straight between points of both profiles"
    asked, corner = f"{why}; the bound asked for", f"{why}, as far as an angle changes in 0.3 mm of the gauge corner"
    found_facts = (
        ("rail", "first touch on the rail, case A-1", "mm", POSITION_TOLERANCE, asked),
        ("wheel", "first touch on the wheel, case A-1", "mm", POSITION_TOLERANCE, asked),
        ("angle", "angle there", "rad", 0.02, corner),
    )
    return [
        *(
            Observed(f"manchester.search.{name}", SYSTEM, f"largest difference of {what}", float(gap), unit).at_most(
                bound, why, "closed form"
            )
            for (name, what, unit, bound, why), gap in zip(found_facts, np.max(gaps, axis=0), strict=True)
        ),
        Observed(
            "manchester.mirror",
            SYSTEM,
            "largest difference if the wheelset is shifted and turned the other way and the wheels are exchanged",
            mirror,
            "",
        ).at_most(1e-9, "the track is symmetric", "none"),
    ]


def _free_axle_row(wheelset_placement: WheelsetPlacement) -> Row:
    """Row: the axle turns freely, so that the creep forces of each wheel must have no moment about the axle in the
    middle of the track."""
    moments = [
        sum(p.fx * p.rolling_radius - p.mz * np.sin(p.angle) for p in wheel)
        for wheel in (wheelset_placement.right, wheelset_placement.left)
    ]
    most = SCENE.cases["A-2"].friction * SCENE.wheelset.load * wheelset_placement.right[0].rolling_radius
    return Observed(
        "manchester.axle",
        SYSTEM,
        "moment of a wheel's creep forces about the axle without shift, case A-2",
        float(np.abs(moments).max() / most),
        "mu N R",
    ).at_most(
        1e-3,
        "patches that have grown together lean by some mrad, which leaves a part of their levers out",
        "closed form",
    )


def _load_share_rows(wheelset_placement: WheelsetPlacement) -> list[Row]:
    """Rows: shares of the wheel load on two patches at a displacement of 5 mm, in case A-2."""
    forces = [patch.normal for patch in wheelset_placement.right]
    total = sum(forces)
    contact = contact_of("A-2")
    alone, (mean, _, plane) = (
        patch_forces(contact, wheelset_placement),
        exact_on_contact_plane(contact, wheelset_placement),
    )
    far = {
        name: 100.0 * max(abs(a - b) for a, b in zip(forces, other_contact, strict=True)) / total
        for name, other_contact in (("apart", alone), ("one plane", plane))
    }
    return [
        Observed(
            "manchester.split.apart",
            SYSTEM,
            "error of the shares of two patches at 5 mm in the wheel's force",
            far["apart"],
            "%",
        ).at_most(FORCE_TOLERANCE, "each on a half-space of its own that the other's resultant sinks", "closed form"),
        Observed(
            "manchester.split.plane",
            SYSTEM,
            "error of the shares of two patches at 5 mm on the same plane",
            far["one plane"],
            "%",
        ).at_most(FORCE_TOLERANCE, "exact theory on CONTACT's plane, lowered as the wheel is", "native"),
        Observed("manchester.split.mean", SYSTEM, "mean place at 5 mm on CONTACT's own plane", mean, "mm").beside(
            float(PUBLISHED_CONTACT[10, 2]), "CONTACT lays more on the smaller patch; 4 um of shift do the same"
        ),
    ]


def _wheel_load_row(static_placements: list[WheelsetPlacement]) -> Row:
    """Row: vertical forces of each wheel's patches add up to the wheel load."""
    off = max(
        abs(sum(patch.vertical for patch in wheel) / SCENE.wheelset.load - 1.0)
        for placement in static_placements
        for wheel in (placement.right, placement.left)
    )
    return Observed(
        "manchester.load",
        SYSTEM,
        "difference of the vertical sum of a wheel's normal forces from its load, case A-1",
        off,
        "",
    ).at_most(1e-5, "patches share the load to the precision of the shares", "none")


def _profile_file_rows(wheelset_placements: list[WheelsetPlacement]) -> list[Row]:
    """Rows: contact with the built-in profiles, compared with the benchmark's profile files, in which the rail is
    already inclined."""
    names = {"places": ("mm", POSITION_TOLERANCE, 0), "forces": ("%", FORCE_TOLERANCE, 1)}
    words = "difference between built-in profiles and the benchmark's files, case A-2"
    folder = data_folder()
    if folder is None or not (folder / WHEEL_FILE).is_file():
        reason = "TWINRIG_DATA names no folder with the benchmark's profiles"
        return [not_run(f"manchester.files.{name}", SYSTEM, f"{name}: {words}", reason) for name in names]
    rail = rail_in_track(read_profile(folder / RAIL_FILE, "rail"), TrackGeometry(inclination=0.0))
    side = WheelAndRail(read_profile(folder / WHEEL_FILE, "wheel"), rail, WheelsetGeometry())
    other_contact = replace(contact_of("A-2"), side=side)
    chosen = [
        (placement, other_contact.at(placement.shift, placement.yaw))
        for placement in wheelset_placements
        if round(1e3 * placement.shift, 6) in PROFILE_FILE_SHIFTS
    ]
    pairs = [
        (wheel_sums(placement, wheel), wheel_sums(theirs, wheel))
        for placement, theirs in chosen
        for wheel in FIRST_COLUMN_OF_WHEEL
    ]
    off = [(abs(a[0] - b[0]), 100.0 * abs(a[1] / b[1] - 1.0)) for a, b in pairs]
    return [
        Observed(
            f"manchester.files.{name}",
            SYSTEM,
            f"{name}: largest difference of {words}",
            max(differences[k] for differences in off),
            unit,
        ).at_most(bound, "the bound asked for", "published")
        for name, (unit, bound, k) in names.items()
    ]


def _computing_time_rows(seconds_by_case: dict[str, float]) -> list[Row]:
    """Rows: processor time of a position of both wheels, for each case."""
    why = "geometry, roll, exact normal contact; rolling also the speed of spin"
    return [
        Observed(
            f"manchester.price.{name}",
            SYSTEM,
            f"processor time of a position of both wheels, case {name}, all measured once",
            seconds,
            "s",
        ).beside("-", why)
        for name, seconds in seconds_by_case.items()
    ]


def _table_of_patches(wheelset_placement: WheelsetPlacement) -> dict[str, Any]:
    """Displacement (mm), and for each patch: contact position on rail and wheel (mm), angle (deg), force (kN) and peak
    pressure (MPa)."""
    return {"shift": 1e3 * wheelset_placement.shift} | {
        wheel: [
            [1e3 * p.y, 1e3 * p.wheel_centre, float(np.degrees(-p.centre_angle)), p.normal / 1e3, p.peak / 1e6]
            for p in getattr(wheelset_placement, wheel)
        ]
        for wheel in FIRST_COLUMN_OF_WHEEL
    }


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of every patch at every displacement."""
    heads = (
        "shift [mm]",
        "wheel",
        "in the track [mm]",
        "on the wheel [mm]",
        "angle [deg]",
        "normal force [kN]",
        "largest pressure [MPa]",
    )
    note = "A row for each patch, at its centre of pressure; 10 kN on each wheel, S1002 on UIC 60 at 1:40."
    return [
        Table(
            f"Manchester benchmark, case {name}",
            note,
            heads,
            tuple(
                (f"{position_row['shift']:g}", wheel, *(f"{value:.3f}" for value in patch[:4]), f"{patch[4]:.0f}")
                for position_row in case_data[name]
                for wheel in FIRST_COLUMN_OF_WHEEL
                for patch in position_row[wheel]
            ),
        )
        for name in ("A-1", "A-2")
        if name in case_data
    ]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot contact position and normal force of the right wheel, together with CONTACT's."""
    from models.drawing.figures import BLUE, COLUMN_WIDTH, GREY, add_heading, legend_below, subplots

    published = np.array(case_data["published"])
    figure, axes = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.5))
    for axis, value, column, scale in ((axes[0], 0, 2, 1.0), (axes[1], 3, 3, 1e-3)):
        axis.plot(
            published[:, 0],
            scale * published[:, column],
            "s",
            markersize=8,
            markerfacecolor="none",
            color=GREY,
            label="CONTACT, all patches together",
        )
        points = [
            (position_row["shift"], patch[value])
            for position_row in case_data["A-2"]
            for patch in position_row["right"]
        ]
        axis.plot(*np.array(points).T, "o", markersize=4, color=BLUE, label="every patch here")
        axis.set_xlabel("displacement of the wheelset [mm]")
    axes[0].set_ylabel("place of contact in the track [mm]")
    axes[1].set_ylabel("normal force [kN]")
    legend_below(figure, axes[0])
    add_heading(figure, "Manchester case A-2, right wheel: patches here and by CONTACT")
    return [("Right wheel in case A-2, rolling with yaw: patches here and the reference output of CONTACT.", figure)]
