"""Profiles from files and built in, and where wheel and rail touch."""

import math

import numpy as np
import pytest

from models.contact.material import MaterialPair
from models.contact.profile_files import read_profile
from models.contact.profiles import ContactProfile, profile_of_points
from models.contact.simplified_theory import solve_normal_contact
from models.contact.standard_profiles import built_in_profile, s1002_height, s1002_profile, uic60_profile
from models.contact.wheel_on_rail import TrackGeometry, WheelsetGeometry, rail_in_track, wheel_on_rail
from models.core.errors import InputError
from validation.cases.contact_profiles import (
    PROFILE_TOLERANCE,
    RAIL_FILE,
    WHEEL_FILE,
    rail_profile_distance,
    wheel_profile_difference,
)
from validation.common.scenes import data_folder

FOLDER = data_folder()
needs_data = pytest.mark.skipif(FOLDER is None, reason="TWINRIG_DATA names no folder with the benchmark's profiles")


@pytest.mark.grounds("published")
@needs_data
def test_built_in_profiles_are_those_of_the_benchmark():
    assert wheel_profile_difference(read_profile(FOLDER / WHEEL_FILE, "wheel")) < PROFILE_TOLERANCE  # 0.0005 mm seen
    assert (
        rail_profile_distance(read_profile(FOLDER / RAIL_FILE, "rail")) < PROFILE_TOLERANCE
    )  # 0.002 mm seen, of which half is the search


def test_sections_of_the_wheel_meet():
    ends = np.array([-62.764705882, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796])
    steps = s1002_height(ends + 1e-6) - s1002_height(ends - 1e-6)
    slopes, before = ((s1002_height(ends + 2 * d) - s1002_height(ends + d)) / d for d in (1e-2, -1e-2))
    assert np.abs(steps).max() < 2e-4  # mm: 1.2e-4 at the throat, in the standard's own digits
    assert slopes == pytest.approx(before, abs=0.03)  # no kink: 0.02 is the curvature of the throat
    assert s1002_height(np.array(-55.0)) == pytest.approx(28.0)  # height of the flange
    assert s1002_height(np.array(0.0)) == 0.0


def test_head_of_the_rail():
    rail = uic60_profile()
    assert rail.z.min() == pytest.approx(0.0, abs=1e-15)
    assert 2 * np.interp(0.01426, rail.z[rail.y > 0], rail.y[rail.y > 0]) == pytest.approx(0.072, abs=2e-5)  # its width
    top = np.abs(rail.y) < 5e-3
    assert np.polyfit(rail.y[top], rail.z[top], 2)[0] == pytest.approx(1 / 0.6, rel=1e-3)  # radius of 300 mm
    assert rail.curve(-rail.y) == pytest.approx(rail.z, abs=1e-9)


def test_inclination_moves_the_top_outwards():
    leaning = uic60_profile().turned(0.025)
    assert leaning.y[np.argmin(leaning.z)] == pytest.approx(0.3 * math.sin(0.025), abs=1e-4)


def test_gauge_is_where_it_is_measured():
    rail = rail_in_track(uic60_profile(), TrackGeometry(inclination=0.05))
    inner = rail.y < rail.y[np.argmin(rail.z)]
    face = np.interp(-0.014, -rail.z[inner], rail.y[inner])
    assert face == pytest.approx(0.7175, abs=1e-12)  # between points; at the point below it, 9 um would be missing


def cone(radius):
    """A rail with a round head of this radius (m), symmetric."""
    y = np.linspace(-0.034, 0.034, 2001)
    return ContactProfile(y, radius - np.sqrt(radius**2 - y**2))


def coned_wheel(slope):
    """A wheel with a conical tread, no flange."""
    y = np.linspace(-0.07, 0.06, 2001)
    return ContactProfile(y, -slope * y)


@pytest.mark.grounds("closed form")
def test_cone_on_a_round_head_touches_where_geometry_says():
    radius, slope = 0.04, 0.05
    touch = wheel_on_rail(
        coned_wheel(slope), cone(radius), track=TrackGeometry(inclination=0.0, gauge=1.5 - 2 * 0.0303975)
    )[0]
    assert touch.angle == pytest.approx(-math.atan(slope), abs=1e-4)
    assert touch.rail_y == pytest.approx(-radius * math.sin(math.atan(slope)), abs=1e-5)
    height = touch.patch.distance
    # Curvatures: the head's alone across, and cos(angle)/r along, for a cone is a circle in the plane square to it.
    r = 0.46 - slope * touch.wheel_y
    x, y = np.array([4e-3]), np.array([3e-3])
    assert float(height.at(x, np.zeros(1))[0]) == pytest.approx(math.cos(touch.angle) * 16e-6 / (2 * r), rel=2e-3)
    assert float(height.at(np.zeros(1), y)[0]) == pytest.approx(radius - math.sqrt(radius**2 - 9e-6), rel=2e-3)


def test_mirror_image():
    one = wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=0.004, yaw=0.01)
    other = wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=0.004, yaw=-0.01)
    assert other[0].rail_y == pytest.approx(one[0].rail_y, abs=2e-4)
    assert other[0].x == pytest.approx(-one[0].x, abs=1e-4)


def test_yaw_moves_the_contact_along_the_flange():
    # A flange of slope tan(70 degrees) at 20 mrad leads by r tan(70) yaw = 25 mm: to the front for one hand of yaw.
    straight, turned = (
        wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=0.008, yaw=yaw)[0] for yaw in (0.0, 0.02)
    )
    assert straight.x == pytest.approx(0.0, abs=1e-6)
    assert abs(turned.x) == pytest.approx(0.47 * math.tan(abs(turned.angle)) * 0.02, rel=0.05)
    assert turned.patch.low == pytest.approx(0.0, abs=2e-8)


def test_contact_jumps_at_5_mm_and_the_flange_touches_from_6_5_mm():
    places = {
        shift: wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=1e-3 * shift)
        for shift in (4.5, 5.0, 6.0, 6.5)
    }
    assert places[4.5][0].rail_y == pytest.approx(-22.6e-3, abs=1e-3)  # Manchester benchmark
    assert places[5.0][0].rail_y == pytest.approx(-33.4e-3, abs=1e-3)
    assert len(places[5.0]) == 2
    assert -places[6.0][0].angle < math.radians(30) < math.radians(60) < -places[6.5][0].angle


def test_patches_share_the_vertical_load():
    touches = wheel_on_rail(s1002_profile(), uic60_profile())
    found = solve_normal_contact([touch.patch for touch in touches], MaterialPair(), load=1e4)
    assert len(found.patches) == 2
    assert sum(part.load * math.cos(part.patch.lean) for part in found.patches) == pytest.approx(1e4, rel=1e-9)


@pytest.mark.parametrize("load", [9400.0, 1e4])
def test_a_patch_that_only_just_touches_settles(load):
    """Beside one that carries hundreds of times as much, where one way of solving alone is caught in kinks."""
    touches = wheel_on_rail(
        s1002_profile(), uic60_profile(), lateral_shift=4e-3, yaw=0.03, track=TrackGeometry(inclination=0.0)
    )
    found = solve_normal_contact([touch.patch for touch in touches], MaterialPair(), load=load)
    assert found.load == pytest.approx(load, rel=1e-9) and found.patches[0].load > 50 * sum(
        part.load for part in found.patches[1:]
    )


def test_smoothing_halves_its_wavelength():
    y = np.linspace(-0.03, 0.03, 1201)
    wave = 1e-5 * np.sin(2 * np.pi * y / 3e-3)
    smooth = profile_of_points(y, wave, smoothing=3e-3)
    inside = np.abs(smooth.y) < 0.02
    assert np.ptp(smooth.z[inside]) == pytest.approx(1e-5, rel=0.03)  # half of 2e-5
    passed = profile_of_points(y, 1e-5 * np.sin(2 * np.pi * y / 12e-3), smoothing=3e-3)
    assert np.ptp(passed.z[np.abs(passed.y) < 0.02]) == pytest.approx(2e-5 / (1 + 4.0**-4), rel=0.01)


def columns(rail):
    return "".join(f"{1e3 * y:.6f} {1e3 * z:.6f}\n" for y, z in zip(rail.y[::4], rail.z[::4], strict=True))


SIMPACK = """header.begin
  version = 1
  type = 0
header.end
spline.begin
  mirror.y = {mirror}   ! 5: mirrored
  inversion = {inversion}
  units.len.f = {factor}
  point.begin
{points}  point.end
spline.end
"""


def test_every_format_gives_the_same_profile(tmp_path):
    rail = uic60_profile()
    (tmp_path / "rail.txt").write_text("\ufeff# y z\n" + columns(rail).replace(" ", " ; "))
    (tmp_path / "rail.prr").write_text(SIMPACK.format(mirror=0, inversion=0, factor=1000.0, points=columns(rail)))
    mirrored = "".join(f"{-y:.9f}\t{z:.9f} 1.0\n" for y, z in zip(rail.y[::4], rail.z[::4], strict=True))
    (tmp_path / "mirrored.prr").write_text(SIMPACK.format(mirror=1, inversion=1, factor=1.0, points=mirrored))
    up = "".join(f"{1e3 * y:.6f}, {-1e3 * z:.6f}, 0.0\n" for y, z in zip(rail.y[::4], rail.z[::4], strict=True))
    (tmp_path / "rail.ban").write_text("ProgramName=MiniProf\nColumnDef=X,Y,A\n\n" + up)
    for name in ("rail.txt", "rail.prr", "mirrored.prr", "rail.ban"):
        found = read_profile(tmp_path / name, "rail")
        at = np.linspace(-0.03, 0.03, 50)
        assert found.curve(at) == pytest.approx(rail.curve(at), abs=2e-6), name


def test_a_wheel_is_laid_with_its_flange_down_and_inwards(tmp_path):
    wheel = s1002_profile()
    lines = "".join(f"{-1e3 * y:.6f} {-1e3 * z:.6f}\n" for y, z in zip(wheel.y[::10], wheel.z[::10], strict=True))
    (tmp_path / "wheel.txt").write_text(lines)
    found = read_profile(tmp_path / "wheel.txt", "wheel")
    at = np.linspace(-0.06, 0.05, 50)
    assert found.curve(at) == pytest.approx(wheel.curve(at), abs=5e-6)
    from_the_back = "".join(f"{70 - 1e3 * y:.4f} {-1e3 * z:.4f}\n" for y, z in zip(wheel.y, wheel.z, strict=True))
    (tmp_path / "wheel.txt").write_text(from_the_back)
    with pytest.raises(InputError, match="must count from the taping line"):
        read_profile(tmp_path / "wheel.txt", "wheel")


BAD_FILES = {
    "word": ("rail.txt", "1.0 2.0\n3.0 four\n", r"rail.txt: line 2 = '3.0 four': must hold 2 or more finite numbers"),
    "one column": ("rail.txt", "1.0\n", "line 1 = '1.0'"),
    "not finite": ("rail.txt", "1.0 nan\n", "line 1"),
    "decimal commas": ("rail.txt", columns(uic60_profile()).replace(".", ","), "line 1 = '.*,.*': has decimal commas"),
    "three columns": ("rail.txt", "1 0.5 0.1\n", "line 1 = '1 0.5 0.1': must hold y and z, found 3"),
    "columns exchanged": (
        "rail.txt",
        "".join(f"{1e3 * z:.4f} {1e3 * y:.4f}\n" for y, z in zip(uic60_profile().y, uic60_profile().z, strict=True)),
        "against it: points must follow the contour, y before z",
    ),
    "empty": ("rail.txt", "# nothing\n", "0: points found; a profile needs ten"),
    "no points": ("rail.prr", "header.begin\nheader.end\n", "no points between point.begin"),
    "unit": (
        "rail.prr",
        SIMPACK.format(mirror=0, inversion=0, factor=0.0, points=columns(uic60_profile())),
        "must be above 0",
    ),
    "metres": (
        "rail.txt",
        "".join(f"{y:.6f} {z:.6f}\n" for y, z in zip(uic60_profile().y, uic60_profile().z, strict=True)),
        "the unit right",
    ),
    "header": ("rail.ban", "MiniProf file\n\n", "line 1 = 'MiniProf file': must be key=value"),
    "kind": ("rail.prw", "", "is a file of a wheel by its ending"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_wrong_file_is_told_by_line(tmp_path, case):
    name, text, told = BAD_FILES[case]
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=told):
        read_profile(tmp_path / name, "rail")


def test_a_missing_file_is_told_with_the_nearest(tmp_path):
    (tmp_path / "UIC60.prr").write_text("")
    with pytest.raises(InputError, match=r"did you mean 'UIC60.prr'"):
        read_profile(tmp_path / "UIC6O.prr", "rail")


BAD_PLACES = {
    "name": (lambda: built_in_profile("S102"), "did you mean 'S1002'"),
    "shift": (lambda: wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=5.0), "-0.03 to 0.03"),
    "yaw": (lambda: wheel_on_rail(s1002_profile(), uic60_profile(), yaw=math.nan), "a yaw angle in rad"),
    "gauge": (lambda: wheel_on_rail(s1002_profile(), uic60_profile(), track=TrackGeometry(gauge=1.0)), "lateral_shift"),
    "wheelset": (
        lambda: wheel_on_rail(s1002_profile(), uic60_profile(), wheelset=WheelsetGeometry(back_to_back=1.0)),
        "lateral_shift",
    ),
    "shallow rail": (
        lambda: rail_in_track(
            ContactProfile(np.linspace(-0.02, 0.02, 50), np.linspace(-0.02, 0.02, 50) ** 2), TrackGeometry()
        ),
        "the gauge is measured at 0.014 m",
    ),
}


@pytest.mark.parametrize("case", BAD_PLACES)
def test_a_wrong_place_is_told(case):
    call, told = BAD_PLACES[case]
    with pytest.raises(InputError, match=told):
        call()
