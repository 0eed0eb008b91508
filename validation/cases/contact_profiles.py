"""Wheel on rail: the built-in profiles, and the contact points over the lateral displacement of the wheelset."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import KDTree

from models.contact.material import MaterialPair
from models.contact.profile_files import read_profile
from models.contact.profiles import ContactProfile
from models.contact.simplified_theory import solve_normal_contact
from models.contact.standard_profiles import s1002_profile, uic60_profile
from models.contact.wheel_on_rail import TrackGeometry, wheel_on_rail
from models.core.errors import InputError
from validation.common.rows import Observed, Row, System, Table, not_run
from validation.common.scenes import data_folder
from validation.contact.contact_shapes import Shape, exact_normal

TITLE = "Rolling contact of profiles: S1002 on UIC 60"
SYSTEM: System = "contact"
WHEEL_FILE, RAIL_FILE = "MBench_S1002_v3.prw", "MBench_UIC60_v3.prr"
PROFILE_TOLERANCE = 2e-5
"""Largest distance (m) allowed between a built-in profile and the benchmark's."""
LATERAL_SHIFTS = np.arange(0.0, 10.1, 0.5)
"""Lateral displacements (mm) of the wheelset."""
QUICK_LATERAL_SHIFTS = np.array([0.0, 4.5, 5.0, 6.0, 6.5])
WHEEL_LOAD = 1e4
"""Vertical load (N) of a wheel; the benchmark has 20 kN on a wheelset."""
EXACT_CELL_COUNT = 40
MATERIAL_PAIR = MaterialPair()
BENCHMARK_SOURCE = (
    "Manchester contact benchmark, case A (Shackleton and Iwnicki, Vehicle Syst. Dyn. 46, 2008, 129-149), "
    "S1002 on UIC 60 at 1:40, gauge 1435 mm, back to back 1360 mm, radius 460 mm"
)
CONTACT_JUMP = {"from": -22.6, "to": -33.4, "peak": 1556.0}
"""Lateral positions (mm) on the right rail between which the benchmark's contact jumps at a displacement of 5 mm, and
its peak pressure there (MPa)."""
FIGURE_LABELS = {"no yaw": "no yaw", "yaw": "yaw of 2.4 mrad per mm of shift"}
FLANGE_CONTACT_SHIFT = 6.5
"""Lateral displacement (mm) from which the benchmark's flange touches the rail."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on the built-in profiles and on the contact points; a full run has every lateral displacement, also with
    yaw."""
    shifts = QUICK_LATERAL_SHIFTS if quick else LATERAL_SHIFTS
    data: dict[str, Any] = {"no yaw": [_right_wheel_contact(float(shift), 0.0, not quick) for shift in shifts]}
    if not quick:
        data["yaw"] = [_right_wheel_contact(float(shift), 2.4e-3 * float(shift), False) for shift in shifts]
    rows = _profile_file_rows() + _contact_point_rows(data["no yaw"])
    return rows + ([] if quick else _benchmark_rows(data["no yaw"])), data


def _right_wheel_contact(lateral_shift: float, yaw: float, with_exact_peak: bool) -> dict[str, Any]:
    """Contact of the right wheel at a lateral displacement (mm) and yaw angle (rad): contact points, their loads, area
    and peak pressure."""
    touches = wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=lateral_shift * 1e-3, yaw=yaw)
    pressed = solve_normal_contact([touch.patch for touch in touches], MATERIAL_PAIR, load=WHEEL_LOAD)
    loads = {id(patch_pressure.patch): patch_pressure.load for patch_pressure in pressed.patches}
    contact_points = [
        {
            "rail": 1e3 * touch.rail_y,
            "wheel": 1e3 * touch.wheel_y,
            "ahead": 1e3 * touch.x,
            "gap": 1e6 * touch.gap,
            "angle": float(np.degrees(-touch.angle)),
            "load": loads.get(id(touch.patch), 0.0),
        }
        for touch in touches
    ]
    contact_facts = {
        "shift": lateral_shift,
        "yaw": yaw,
        "places": contact_points,
        "area": 1e6 * pressed.area,
        "peak": pressed.peak / 1e6,
    }
    heaviest = max(pressed.patches, key=lambda patch_pressure: patch_pressure.load)
    return contact_facts | {
        "exact": _exact_peak(heaviest.patch, heaviest.load, heaviest.box) if with_exact_peak else None
    }


def _exact_peak(contact_patch: Any, patch_load: float, patch_box: tuple[float, float, float, float]) -> float | None:
    """Peak pressure (MPa) of one contact patch under its load, by the exact theory; None if the patch merges with its
    neighbour."""
    x0, x1, y0, y1 = patch_box
    distance = contact_patch.distance
    wide, high = 0.15 * (x1 - x0), 0.3 * (y1 - y0)
    grid = (x0 - wide, x1 + wide, max(y0 - high, distance.y[0]), min(y1 + high, distance.y[-1]))
    try:
        return float(exact_normal(Shape("", distance, patch_load), EXACT_CELL_COUNT, grid).pressure.max() / 1e6)
    except InputError:
        return None


def _profile_file_rows() -> list[Row]:
    """Rows: built-in profiles of wheel and rail compared with the benchmark's files."""
    folder = data_folder()
    if folder is None or not (folder / WHEEL_FILE).is_file():
        reason = "TWINRIG_DATA names no folder with the benchmark's profiles"
        return [
            not_run(
                f"contact_profiles.{name}",
                SYSTEM,
                f"largest difference of the built-in {name} from the benchmark's file",
                reason,
            )
            for name in ("S1002", "UIC60")
        ]
    wheel, rail = read_profile(folder / WHEEL_FILE, "wheel"), read_profile(folder / RAIL_FILE, "rail")
    off = {"S1002": wheel_profile_difference(wheel), "UIC60": rail_profile_distance(rail)}
    return [
        Observed(
            f"contact_profiles.{name}",
            SYSTEM,
            f"largest distance of the built-in {name} from the benchmark's file",
            1e3 * value,
            "mm",
        ).at_most(1e3 * PROFILE_TOLERANCE, "the figure set for the built-in profiles", "published")
        for name, value in off.items()
    ]


def wheel_profile_difference(file_profile: ContactProfile) -> float:
    """Largest difference in height (m) between the built-in S1002 profile and the wheel profile of a file, where both
    are defined."""
    rail_profile = s1002_profile()
    inside = (file_profile.y >= rail_profile.y[0]) & (file_profile.y <= rail_profile.y[-1])
    return float(np.abs(rail_profile.curve(file_profile.y[inside]) - file_profile.z[inside]).max())


def rail_profile_distance(file_profile: ContactProfile) -> float:
    """Largest distance (m) of a file's rail profile from the built-in inclined rail. The file has another origin, so
    the best shift is subtracted first."""
    laid = uic60_profile().turned(TrackGeometry().inclination)
    tree = KDTree(np.column_stack([laid.y, laid.z]))
    points = np.column_stack([file_profile.y, file_profile.z])[file_profile.z < 0.036]

    def largest_distance(lateral_shift: np.ndarray) -> float:
        return float(tree.query(points - lateral_shift)[0].max())

    start = np.array([file_profile.y[np.argmin(file_profile.z)] - laid.y[np.argmin(laid.z)], 0.0])
    return float(minimize(largest_distance, start, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-8}).fun)


def _most_loaded_point(shift_record: dict[str, Any]) -> dict[str, float]:
    """The contact point with the largest normal force."""
    return max(shift_record["places"], key=lambda contact_point: contact_point["load"])


def _contact_point_rows(shift_records: list[dict[str, Any]]) -> list[Row]:
    """Rows: displacement of flange contact, and the jump of the contact point, compared with the benchmark."""
    by = {case["shift"]: case for case in shift_records}
    flange = min(case["shift"] for case in shift_records if _most_loaded_point(case)["angle"] > 45.0)
    at5 = _most_loaded_point(by[5.0])
    return [
        Observed(
            "contact_profiles.flange", SYSTEM, "sideways shift from which the flange carries the wheel", flange, "mm"
        ).within(FLANGE_CONTACT_SHIFT, 0.25, f"{BENCHMARK_SOURCE}; half of its steps", "published"),
        Observed(
            "contact_profiles.jump_from",
            SYSTEM,
            "place of contact on the rail at a shift of 4.5 mm",
            _most_loaded_point(by[4.5])["rail"],
            "mm",
        ).within(CONTACT_JUMP["from"], 1.0, f"{BENCHMARK_SOURCE}; where the patch is before it jumps", "published"),
        Observed(
            "contact_profiles.jump_to", SYSTEM, "place of contact on the rail at a shift of 5 mm", at5["rail"], "mm"
        ).within(
            CONTACT_JUMP["to"],
            1.0,
            f"{BENCHMARK_SOURCE}; a touching point here, the middle of a patch 4 mm wide there",
            "published",
        ),
        Observed(
            "contact_profiles.places",
            SYSTEM,
            "places that are closer than 0.2 mm at a shift of 5 mm",
            float(len(by[5.0]["places"])),
            "",
        ).within(2.0, 0.0, "both ends of the jump", "published"),
    ]


def _benchmark_rows(shift_records: list[dict[str, Any]]) -> list[Row]:
    """Rows: the loads of the patches add up to the wheel load, and peak pressures beside those of the benchmark."""
    by = {case["shift"]: case for case in shift_records}
    vertical = max(
        abs(
            sum(contact_point["load"] * np.cos(np.radians(contact_point["angle"])) for contact_point in case["places"])
            - WHEEL_LOAD
        )
        for case in shift_records
    )
    return [
        Observed(
            "contact_profiles.load",
            SYSTEM,
            "difference of the vertical sum of the patches' loads from the wheel load, at every shift",
            float(vertical),
            "N",
        ).at_most(1e-6, "patches share the load without loss", "none"),
        Observed(
            "contact_profiles.peak",
            SYSTEM,
            "largest pressure at a shift of 5 mm, exact theory, of the patch that carries most",
            by[5.0]["exact"],
            "MPa",
        ).beside(CONTACT_JUMP["peak"], BENCHMARK_SOURCE),
        Observed(
            "contact_profiles.flange_peak",
            SYSTEM,
            "largest pressure at a shift of 6.5 mm, exact theory",
            by[FLANGE_CONTACT_SHIFT]["exact"],
            "MPa",
        ).beside("about 2600", BENCHMARK_SOURCE),
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of contact points, loads and pressures at every lateral displacement."""
    heads = (
        "shift [mm]",
        "yaw [mrad]",
        "on the rail [mm]",
        "on the wheel [mm]",
        "ahead [mm]",
        "contact angle [deg]",
        "load [kN]",
        "peak [MPa]",
        "exact peak [MPa]",
    )
    note = (
        f"{BENCHMARK_SOURCE}; {WHEEL_LOAD / 1e3:g} kN on the right wheel, vertical. A row for every place closer "
        "than 0.2 mm; "
        "y on the rail from its highest point, on the wheel from the taping line; pressures of the theory of 1983."
    )
    return [
        Table(f"Places of contact, {name}", note, heads, tuple(_contact_point_table_rows(cases)))
        for name, cases in case_data.items()
    ]


def _contact_point_table_rows(shift_records: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Rows of the table of contact points."""
    return [
        (
            f"{case['shift']:g}",
            f"{1e3 * case['yaw']:g}",
            f"{contact_point['rail']:.2f}",
            f"{contact_point['wheel']:.2f}",
            f"{contact_point['ahead']:.2f}",
            f"{contact_point['angle']:.1f}",
            f"{contact_point['load'] / 1e3:.2f}",
            f"{case['peak']:.0f}",
            f"{case['exact']:.0f}" if case["exact"] is not None else "-",
        )
        for case in shift_records
        for contact_point in case["places"]
    ]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot position and load of the contact points over the lateral displacement."""
    from models.drawing.figures import add_heading, subplots

    figure, axis = subplots(figsize=(7.0, 3.6))
    for name, cases in case_data.items():
        points = [
            (case["shift"], contact_point["rail"], contact_point["load"])
            for case in cases
            for contact_point in case["places"]
        ]
        shift, rail, load = np.array(points).T
        hollow: dict[str, Any] = {} if name == "no yaw" else {"markerfacecolor": "none", "markersize": 10}
        style: dict[str, Any] = {"marker": "o", "linestyle": "none", **hollow}
        axis.plot(shift[load == 0], rail[load == 0], color="0.75", **style)
        axis.plot(shift[load > 0], rail[load > 0], label=f"in contact, {FIGURE_LABELS[name]}", **style)
    axis.set(xlabel="lateral shift of the wheelset [mm]", ylabel="place of contact on the rail [mm]")
    axis.legend()
    add_heading(figure, "S1002 on UIC 60: where the right wheel touches its rail")
    caption = (
        "Right wheel S1002 on UIC 60: the contact jumps to the gauge corner at 5 mm, and the flange touches "
        "from 6.5 mm. Grey: closer than 0.2 mm, but not in contact."
    )
    return [(caption, figure)]
