"""Equivalent conicity by EN 15302: closed forms, an integration in time, wheels that are not alike, bad tables."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from models.core.errors import InputError
from models.core.tables import write_table
from models.rail import equivalent_conicity as module
from models.rail.equivalent_conicity import (
    RollingRadiusTable,
    conicity_row,
    equivalent_conicity,
    harmonic_linearised_conicity,
    klingel_wave,
)
from models.rail.rolling_radius_table import read_rolling_radii
from models.systems.wheelset import conicity as system
from models.systems.wheelset.of_scene import wheelset_of
from models.systems.wheelset.scene import build
from studies import conicity as study

Y = np.linspace(-8.0, 8.0, 161)


def two_slopes(inner, outer, bend, amplitude):
    """Period of the wave where dr has the slope ``inner`` up to ``bend`` and ``outer`` beyond, by its sines."""
    w, u = math.sqrt(inner), math.sqrt(outer)
    deep = amplitude - bend + inner * bend / outer  # amplitude of the outer sine about where its line is zero
    turn = math.acos(inner * bend / outer / deep) / u
    speed = u * math.sqrt(deep**2 - (inner * bend / outer) ** 2)
    return 4.0 * (turn + math.atan(w * bend / speed) / w)


def test_cones_exactly():
    """A cone of 1/20 in any unit, about any centre."""
    for scale in (1.0, 1e-3):
        for amplitude in (0.03, 1.0, 7.9):
            assert equivalent_conicity(scale * Y, scale * 0.1 * Y, scale * amplitude) == pytest.approx(0.05, rel=1e-12)
    wave = klingel_wave(RollingRadiusTable(Y, 0.1 * (Y + 1.0)), 3.0)  # right wheel 2 mm larger in diameter
    assert wave.conicity == pytest.approx(0.05, rel=1e-12)
    assert wave.centre == pytest.approx(-10.0 * 0.1, abs=1e-12)


@pytest.mark.parametrize("amplitude", [1.0, 2.9, 3.0, 3.1, 5.0, 8.0])
def test_two_slopes(amplitude):
    """A tread and a steeper part; stiffer and softer."""
    for inner, outer in ((0.05, 0.8), (0.8, 0.05)):
        dr = np.where(abs(Y) < 3.0, inner * Y, np.sign(Y) * (3.0 * inner + outer * (abs(Y) - 3.0)))
        period = two_slopes(inner, outer, 3.0, amplitude) if amplitude > 3.0 else 2.0 * math.pi / math.sqrt(inner)
        assert klingel_wave(RollingRadiusTable(Y, dr), amplitude).period == pytest.approx(period, rel=1e-11)


def test_cubic_is_an_elliptic_integral():
    """dr = a y + b y^3: T = 4 K(m) / sqrt(a + b A^2), m = b A^2 / (2 (a + b A^2))."""
    a, b, amplitude = 0.1, 0.02, 4.0
    stiff = a + b * amplitude**2
    period = 4.0 * ellipk(b * amplitude**2 / (2.0 * stiff)) / math.sqrt(stiff)
    errors = []
    for rows in (161, 321):
        y = np.linspace(-8.0, 8.0, rows)
        errors.append(klingel_wave(RollingRadiusTable(y, a * y + b * y**3), amplitude).period / period - 1.0)
    assert abs(errors[1]) < 4.5e-5  # lines over h = 0.05 are off by h^2 dr'' / 8, 9e-5 of dr at the turning point
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_jump_at_the_middle():
    """dr = -c to the left, c to the right: parabolas, T = 4 sqrt(2 A / c); the first harmonic differs."""
    y, dr = np.array([-5.0, 0.0, 0.0, 5.0]), np.array([-0.3, -0.3, 0.3, 0.3])
    assert klingel_wave(RollingRadiusTable(y, dr), 2.0).period == pytest.approx(4.0 * math.sqrt(4.0 / 0.3), rel=1e-12)
    harmonic = 2.0 * 0.3 / math.pi / 2.0
    assert harmonic_linearised_conicity(y, dr, 2.0) == pytest.approx(harmonic, rel=1e-3)


def swung(table, wave):
    """Period by integration in time from the lower turning point."""

    def rates(_, state):
        return [state[1], -float(np.interp(state[0], table.displacements, table.differences))]

    def turns(_, state):
        return state[1]

    turns.direction, turns.terminal = -1, True
    start, step = [wave.lowest, 0.0], {"rtol": 1e-9, "atol": 1e-11, "max_step": wave.period / 500}
    half = solve_ivp(rates, (0.0, wave.period), start, events=turns, method="DOP853", **step)
    return 2.0 * half.t_events[0][-1], half.y_events[0][-1][0]


def test_noise_and_wheels_that_are_not_alike_against_integration_in_time():
    """Measured tables: uneven rows, noise, an offset, different slopes on both sides."""
    random = np.random.default_rng(5)
    for _ in range(4):
        y = np.sort(random.uniform(-9.0, 9.0, 120))
        dr = np.where(y > 0.4, 0.9, 0.2) * (y - 0.4) + 0.05 * random.normal(size=y.size) + random.uniform(-0.4, 0.4)
        table = RollingRadiusTable(y, dr)
        wave = klingel_wave(table, 4.0)
        period, turned = swung(table, wave)
        assert abs(wave.centre) > 0.1
        assert turned == pytest.approx(wave.highest, abs=1e-5)
        assert wave.period == pytest.approx(period, rel=1e-5)


def test_mirrored_wheels_have_the_same_conicity():
    dr = 0.1 * Y + 0.02 * np.maximum(Y - 1.0, 0.0) ** 2 + 0.3
    there, back = klingel_wave(RollingRadiusTable(Y, dr), 4.0), klingel_wave(RollingRadiusTable(Y, -dr[::-1]), 4.0)
    assert back.conicity == pytest.approx(there.conicity, rel=1e-12)
    assert back.centre == pytest.approx(-there.centre, rel=1e-12)
    turned = RollingRadiusTable(Y[::-1], dr[::-1])  # from right to left
    assert klingel_wave(turned, 4.0).conicity == there.conicity


def test_flat_part():
    """Wheels that do not steer within 1.7 mm: no conicity up to there, then one that begins at 0."""
    dr = np.sign(Y) * np.maximum(abs(Y) - 1.7, 0.0)
    dr[abs(abs(Y) - 1.7) < 1e-9] = 0.0
    table = RollingRadiusTable(Y, dr)
    still = klingel_wave(table, 1.5)
    assert (still.conicity, still.period) == (0.0, math.inf)
    assert abs(still.centre) < 1e-12
    # Two half-sines and the way across at their speed.
    assert klingel_wave(table, 2.0).period == pytest.approx(2.0 * math.pi + 4.0 * 1.7 / 0.3, rel=1e-9)
    assert 0.0 < equivalent_conicity(Y, dr, 1.71) < 1e-4


@pytest.mark.parametrize(
    ("y", "dr", "amplitude", "said"),
    [
        (Y, 0.1 * Y, 8.1, "half of peak to peak"),
        (Y, 0.1 * Y, 0.0, "above 0"),
        (Y, 0.1 * Y, math.nan, "above 0"),
        (Y, -0.1 * Y, 3.0, "left less right"),
        (Y, 0.1 * Y + 1.0, 3.0, "does not change its sign"),
        (Y, 0.1 * (Y + 6.0), 3.0, "beyond"),
        (Y, 0.0 * Y + 0.1, 3.0, "does not change its sign"),
        (Y, Y**3 / 50.0 - Y, 1.0, "2 waves"),
        (np.append(Y, 3.0), np.append(Y, 0.3), 3.0, "row 162"),
        (np.repeat(Y, 3), np.repeat(Y, 3), 3.0, "three rows"),
        (Y, Y[1:], 3.0, "two columns"),
        (Y, np.where(Y == 0.0, math.nan, Y), 3.0, "finite"),
    ],
)
def test_what_has_no_wave_is_refused(y, dr, amplitude, said):
    with pytest.raises(InputError, match=said):
        equivalent_conicity(y, dr, amplitude)


def test_one_of_several_waves_is_chosen():
    dr = Y**3 / 50.0 - Y  # two wells, about +-7
    right, left = (equivalent_conicity(Y, dr, 0.5, centre_guess=near) for near in (7.0, -7.0))
    assert right == pytest.approx(left, rel=1e-9)
    assert klingel_wave(RollingRadiusTable(Y, dr), 0.5, centre_guess=7.0).centre > 6.5


def test_repeated_rows_change_nothing():
    y, dr = np.repeat(Y, 2), np.repeat(0.1 * Y, 2)
    assert equivalent_conicity(y, dr, 3.0) == pytest.approx(0.05, rel=1e-12)


def test_spacing_error_covers_what_straight_lines_leave():
    y = np.linspace(-8.0, 8.0, 81)
    row = conicity_row(RollingRadiusTable(y, 0.1 * y + 0.02 * y**3), 4.0)
    fine = np.linspace(-8.0, 8.0, 16001)
    true = equivalent_conicity(fine, 0.1 * fine + 0.02 * fine**3, 4.0)
    assert abs(row.equivalent - true) < row.spacing_error < 10.0 * abs(row.equivalent - true)


def test_file(tmp_path):
    """Columns in mm; what is wrong is told by line."""
    path = tmp_path / "dr.csv"
    path.write_text("y [mm],dr [mm]\n" + "".join(f"{y:.17g},{0.1 * y:.17g}\n" for y in Y))
    table = read_rolling_radii(path)
    assert klingel_wave(table, 3e-3).conicity == pytest.approx(0.05, rel=1e-12)
    path.write_text("y [mm],dr [mm]\n0,0\n1,x\n2,2\n")
    with pytest.raises(InputError, match="line 3"):
        read_rolling_radii(path)


FAULTS = {
    "half of the swing": lambda table, amplitude: klingel_wave(table, amplitude / 2.0).conicity,
    "about y = 0": lambda table, amplitude: (
        klingel_wave(
            RollingRadiusTable(table.displacements, table.differences - table.difference(0.0)), amplitude
        ).conicity
    ),
    "first harmonic": lambda table, amplitude: harmonic_linearised_conicity(
        table.displacements, table.differences, amplitude
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_seen(fault):
    """Each of them is far outside of what the closed form of two slopes and an offset allows."""
    dr = np.where(abs(Y) < 3.0, 0.05 * Y, np.sign(Y) * (0.15 + 0.8 * (abs(Y) - 3.0))) + 0.4
    table = RollingRadiusTable(Y, dr)
    wave = klingel_wave(table, 4.0)
    assert abs(FAULTS[fault](table, 4.0) / wave.conicity - 1.0) > 0.02


def test_a_wrong_factor_in_a_piece_is_seen(monkeypatch):
    times = module._crossing_times
    monkeypatch.setattr(module, "_crossing_times", lambda way, slope: times(way, 1.01 * slope))
    with pytest.raises(AssertionError):
        test_two_slopes(5.0)


def scene(**tables):
    """A wheelset scene that asks for conicities."""
    base = {"title": "t", "system": "wheelset", "study": "conicity", "speeds": {"values": [20.0]}}
    return build(base | tables, "s.toml")


def test_scene_with_a_table(tmp_path):
    """The table of a scene; an amplitude without a wave is told, the others stand."""
    path = tmp_path / "own.csv"
    write_table(path, {"y": ("mm", Y), "dr": ("mm", 0.1 * (Y + 1.0))})
    asked = scene(conicity={"amplitudes": [2e-3, 9e-3], "table": str(path)})
    got = system.run(asked)
    assert got["equivalent"][0] == pytest.approx(0.05, rel=1e-9)
    assert got["centre"][0] == pytest.approx(-1e-3, abs=1e-12)
    assert got["wavelength"][0] == pytest.approx(2.0 * math.pi * math.sqrt(0.46 * 0.75 / 0.05), rel=1e-9)
    assert math.isnan(got["equivalent"][1])
    assert "half of peak to peak" in "".join(system.conicity_lines(got.detail))
    study.run(asked, ("reference",), tmp_path, lambda *_: None)
    again = read_rolling_radii(tmp_path / "rolling_radii.csv")
    np.testing.assert_array_equal(again.differences, got.detail.table.differences)
    assert (tmp_path / "conicity.png").is_file()
    with pytest.raises(InputError, match=r"own.csv: conicity.amplitudes.*half of peak to peak"):
        study.run(scene(conicity={"amplitudes": [9e-3], "table": str(path)}), (), tmp_path, lambda *_: None)


def test_scene_with_cones_of_unequal_radius():
    """920 and 918 mm: the cone's own conicity, about where both radii are equal."""
    asked = scene(conicity={"right_radius": 0.460, "left_radius": 0.459})
    row = system.run(asked).detail.rows[0]
    slope = wheelset_of(asked).equivalent_conicity
    assert row.equivalent == pytest.approx(slope, rel=1e-9)
    assert row.centre == pytest.approx(-1e-3 / (2.0 * slope), rel=1e-9)


def test_scene_with_profiles_of_unequal_radius():
    """S1002 on UIC 60: as the usual value of this pair, and another about another centre for 920 and 918 mm."""
    table = {"spacing": 5e-4, "reach": 9e-3}
    same = system.run(scene(profiles={}, conicity=table)).detail.rows[0]
    assert same.equivalent == pytest.approx(0.18, abs=0.01)
    assert abs(same.centre) < 1e-9
    unequal = {"right_radius": 0.460, "left_radius": 0.459}
    other = system.run(scene(profiles={}, conicity=table | unequal)).detail.rows[0]
    assert other.centre == pytest.approx(-2.35e-3, abs=2e-4)
    assert other.equivalent == pytest.approx(0.27, abs=0.02)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"conicity": {"amplitudes": []}}, "conicity.amplitudes"),
        ({"conicity": {"amplitudes": [0.0]}}, "amplitudes.0.*above 0"),
        ({"conicity": {"amplitudes": [3.0]}}, "at most 0.02 m"),
        ({"conicity": {"left_wheel": "S1002"}}, "needs .profiles."),
        ({"conicity": {"table": "a.csv", "left_radius": 0.4}}, "beside a table"),
        ({"conicity": {"left_radius": 4.0}}, "from 0.1 to 1.5 m"),
        ({"conicity": {"reach": 0.01, "spacing": 0.01}, "profiles": {}}, "1/4 of reach"),
        ({"conicity": {"tabel": "a.csv"}}, "did you mean 'table'"),
    ],
)
def test_scene_that_cannot_be(tables, said):
    with pytest.raises(InputError, match=said):
        scene(**tables)


def test_scene_names_what_is_not_there():
    with pytest.raises(InputError, match=r"conicity.table.*nowhere.csv"):
        system.check(scene(conicity={"table": "nowhere.csv"}))
    with pytest.raises(InputError, match=r"built in.*did you mean 'S1002'"):
        system.check(scene(profiles={}, conicity={"left_wheel": "S1001"}))
