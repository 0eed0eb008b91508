"""A user's CSV of friction becomes a tyre table; what is wrong with it is told by line and column."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.tyre.tyre_file import tyre_table

HEADER = "slip angle [deg], slip [%], load [kN], mu_x [-], mu_y [-]"
SLIPS, ANGLES, LOADS = (0, 20, 100), (0, 4, 90), (10, 30)
X, SHARE = {0: 0.0, 20: 0.8, 100: 0.6}, {0: 1.0, 4: 0.8, 90: 0.1}


def rows(mu_y=lambda angle, load, slip: {0: 0, 4: 0.35, 90: 0.7}[angle] * (1 - slip / 250) * (1.1 - load / 100)):
    """All combinations; friction of whatever shape."""
    return [
        f"{a},{s},{f},{X[s] * SHARE[a] * (1.1 - f / 100):.12g},{mu_y(a, f, s):.12g}"
        for s in SLIPS
        for f in LOADS
        for a in ANGLES
    ]


def table(tmp_path, lines, header=HEADER):
    path = tmp_path / "my.csv"
    path.write_text("\n".join(["# my tyre", header, *lines, ""]))
    return tyre_table(path)


def test_exact_at_every_row_in_si_units_and_any_order(tmp_path):
    lines = rows()
    tyre = table(tmp_path, lines[::-1])
    assert tyre.slips.tolist() == [0.0, 0.2, 1.0] and tyre.loads.tolist() == [1e4, 3e4]
    assert np.rad2deg(tyre.angles) == pytest.approx(ANGLES, rel=1e-14)
    for line in lines:
        angle, slip, load, mu_x, mu_y = map(float, line.split(","))
        x, y = tyre.friction([np.deg2rad(angle)], [slip / 100], load * 1e3)
        assert (x[0, 0], y[0, 0]) == pytest.approx((mu_x, mu_y), rel=1e-11, abs=1e-15)


def test_a_file_without_loads_holds_for_all(tmp_path):
    lines = ["0,0,0,0", "0,1,0.5,0", "0.1,0,0,0.4", "0.1,1,0.3,0.2"]
    tyre = table(tmp_path, lines, "slip angle [rad], slip [-], mu_x [-], mu_y [-]")
    for load in (1.0, 1e4, 1e6):
        x, y = tyre.friction([0.05], [0.5], load)
        # mu_x: mean of four corners; mu_y: g is that of the first angle down to none, so linear in it
        assert (x[0, 0], y[0, 0]) == pytest.approx((0.2, 0.15), rel=1e-12)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: [*r[:4], "4,0,30,abc,0.4", *r[5:]], r"line 7: .*mu_x.* = 'abc'.*finite number"),
        (lambda r: [*r[:4], "4,0,30,0", *r[5:]], "line 7: .*5 values are needed"),
        (lambda r: r[:-1], "1 of 18 combinations are missing, the first: slip angle 90 deg, load 30 kN, slip 1"),
        (lambda r: [*r, r[0]], "line 21: has the slip angle, load and slip of line 3"),
        (lambda r: ["-1,0,10,0,0", *r[1:]], "line 3, column 'slip angle'"),
        (lambda r: ["0,0,10,0.1,0", *r[1:]], "line 3, column 'mu_x' = 0.1: must be 0 where slip is 0"),
        (lambda r: ["0,0,10,0,4", *r[1:]], "line 3, column 'mu_y' = 4.0: must be from 0 to 3"),
        (lambda r: [line for line in r if ",100," not in line], "slips = 0.2: must begin at 0 and end at 1"),
    ],
)
def test_what_is_wrong_is_told_by_line(tmp_path, change, said):
    with pytest.raises(InputError, match=said):
        table(tmp_path, change(rows()))


def test_a_unit_that_is_wrong_and_a_column_that_is_missing(tmp_path):
    with pytest.raises(InputError, match="unit = 'kg'"):
        table(tmp_path, rows(), HEADER.replace("kN", "kg"))
    with pytest.raises(InputError, match="'mu_y' is missing"):
        table(tmp_path, rows(), "slip angle [deg], slip [%], load [kN], mu_x [-]")


def test_friction_that_is_no_product_is_told(tmp_path):
    shaped = rows(lambda angle, load, slip: 0.0 if angle == 0 else 0.6 * (1 - slip / (110 if load == 10 else 400)))
    with pytest.raises(InputError, match=r"line \d+, column 'mu_y'.*no product of g"):
        table(tmp_path, shaped)
