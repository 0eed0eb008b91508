"""Property files of the magic formula become tyre tables; what they lack is told."""

import math

import numpy as np
import pytest

from models.core.errors import InputError
from models.tyre.tir_file import tir_table

TRUCK = """[MDI_HEADER]
FILE_TYPE = 'tir'
$ comment
[UNITS]
LENGTH = 'meter'
FORCE  = 'newton'
ANGLE  = 'radians'
[MODEL]
FITTYP = 5                  $ version
[VERTICAL]
FNOMIN = 29912
[VERTICAL_FORCE_RANGE]
FZMIN = 8852
FZMAX = 42193
[LONGITUDINAL_COEFFICIENTS]
PCX1 = 1.4
PDX1 = 0.84003
PDX2 = -0.065962
PEX1 = -4.5309
PEX2 = -3.0987
PEX3 = 0.20647
PKX1 = 6.3425
PKX2 = -1.9878e-05
PKX3 = -0.16666
PHX1 = 0.001
[LATERAL_COEFFICIENTS]
PCY1 = 0.54764
PDY1 = -1.1188
PDY2 = 0.072812
PEY1 = 0.056372
PEY2 = -0.065607
PKY1 = -9.5432
PKY2 = 2.4559
"""
"""335/65R22.5 truck tyre: figures of vehicle/feda/tires/335_65R22_5_G275MSA_95psi.tir in Project Chrono (BSD-3)."""


def table(tmp_path, text=TRUCK):
    path = tmp_path / "truck.tir"
    path.write_text(text)
    return tir_table(path)


def test_peaks_slopes_and_their_fall_with_the_load(tmp_path):
    tyre, nominal = table(tmp_path), 29912.0
    assert tyre.name == "truck.tir" and nominal in tyre.loads and tyre.loads[[0, -1]].tolist() == [8852.0, 42193.0]
    for load in (8852.0, nominal, 42193.0):
        off = load / nominal - 1.0
        x, _ = tyre.friction([0.0], np.linspace(0, 1, 2001), load)
        assert x.max() == pytest.approx(0.84003 - 0.065962 * off, rel=2e-4)  # the peak lies between two nodes
        slope = tyre.friction([0.0], [1e-4], load)[0][0, 0] / 1e-4
        assert slope == pytest.approx((6.3425 - 1.9878e-05 * off) * math.exp(-0.16666 * off), rel=2e-3)
        _, y = tyre.friction([1e-4], [0.0], load)
        cornering = 9.5432 * nominal * math.sin(2 * math.atan(load / (2.4559 * nominal))) / load
        assert y[0, 0] / 1e-4 == pytest.approx(cornering, rel=2e-3)
        # C below 1: the curve only tends to its end, D sin(C pi / 2)
        _, end = tyre.friction([math.pi / 2], [0.0], load)
        assert end[0, 0] == pytest.approx((1.1188 - 0.072812 * off) * math.sin(0.54764 * math.pi / 2), rel=1e-6)


def test_a_point_of_the_curve_by_hand(tmp_path):
    # E = -4.5309, B = 6.3425 / (1.4 * 0.84003) at the nominal load and a slip of 0.1
    bent = 6.3425 / (1.4 * 0.84003) * 0.1
    want = 0.84003 * math.sin(1.4 * math.atan(bent + 4.5309 * (bent - math.atan(bent))))
    assert table(tmp_path).friction([0.0], [0.1], 29912.0)[0][0, 0] == pytest.approx(want, abs=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("PKY2 = 2.4559\n", "", "truck.tir: PKY2: is missing"),
        ("'newton'", "'pound_force'", r"line 6, FORCE = 'pound_force': must be 'newton'"),
        ("ANGLE  = 'radians'\n", "", r"\[UNITS\] ANGLE: is missing"),
        ("= 0.84003", "= 0,84003", r"line 17, PDX1 = '0,84003': must be a finite number"),
        ("FITTYP = 5 ", "FITTYP = 61 ", "FITTYP = '61': is of other equations"),
        ("FZMAX = 42193", "FZMAX = 42", "FZMAX = '42': must be above FZMIN"),
        ("PDX1 = 0.84003", "PDX1 = 8.4", "give no friction"),
        ("PCX1 = 1.4", "PCX1 = 1.4\nPCX1 = 1.5", "line 17, PCX1 = '1.5': stands in line 16 already"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, old, new, said):
    with pytest.raises(InputError, match=said):
        table(tmp_path, TRUCK.replace(old, new))
