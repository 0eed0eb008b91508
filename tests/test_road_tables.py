"""Strict reading of measured tables: units, order, and every fault with its place."""

import numpy as np
import pytest

from models.core import tables
from models.core.errors import InputError

FORCES = {"time": tables.SECONDS, "front": tables.NEWTONS, "rear": tables.NEWTONS}
GOOD = "# rig 3\ntime [s], front [N], rear [kN]\n0, 1, 2\n\n0.5, 3.5, -4e-1\n"


def read(tmp_path, text, **options):
    path = tmp_path / "forces.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return tables.read_table(path, FORCES, **options)


def test_units_are_converted_once(tmp_path):
    table = read(tmp_path, GOOD, increasing_column="time")
    assert list(table) == ["time", "front", "rear"]
    np.testing.assert_array_equal(table["time"], [0.0, 0.5])
    np.testing.assert_array_equal(table["front"], [1.0, 3.5])
    np.testing.assert_array_equal(table["rear"], [2000.0, -400.0])


def test_order_of_columns_line_ends_and_byte_order_mark_do_not_matter(tmp_path):
    text = b'\xef\xbb\xbfrear [N],"time [ms]",front [kN]\r\n1,2,3\r\n'
    table = read(tmp_path, text)
    assert (table["rear"][0], table["time"][0], table["front"][0]) == (1.0, 2e-3, 3000.0)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("front [N]", "front", ["line 2", "'front'", "unit is missing", "front [N]"]),
        ("front [N]", "front [kn]", ["line 2", "'kn'", "did you mean 'kN'"]),
        ("front [N]", "fornt [N]", ["line 2", "'fornt'", "did you mean 'front'"]),
        (", rear [kN]", "", ["line 2", "column 'rear' is missing"]),
        ("rear [kN]", "front [kN]", ["line 2", "'front'", "twice"]),
        ("0, 1, 2", "0, nan, 2", ["line 3, column 'front [N]'", "'nan'", "finite"]),
        ("0, 1, 2", "0, inf, 2", ["line 3", "'inf'"]),
        ("0, 1, 2", "0, 1_0, 2", ["line 3", "'1_0'"]),
        ("0, 1, 2", "0, one, 2", ["line 3", "'one'"]),
        ("0, 1, 2", "0, , 2", ["line 3", "''"]),
        ("0, 1, 2", "0, 1", ["line 3", "3 values are needed, found 2"]),
        ("0, 1, 2", "0; 1; 2", ["line 3", "3 values are needed, found 1"]),
        ("0.5, 3.5", "0, 3.5", ["line 5, column 'time'", "greater than 0"]),
        ("0.5, 3.5", "-1, 3.5", ["line 5, column 'time'", "= -1.0"]),
        ("-4e-1\n", "-4e-", ["line 5", "cut off"]),
    ],
)
def test_every_fault_names_its_place(tmp_path, old, new, parts):
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        read(tmp_path, GOOD.replace(old, new), increasing_column="time")
    for part in ["forces.csv", *parts]:
        assert part in str(caught.value)


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n", b"\xff\xfe\x00", b"\x00\n"])
def test_files_without_a_table_are_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"forces\.csv"):
        read(tmp_path, text)


def test_too_few_rows_and_missing_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="rows = 2: at least 4"):
        read(tmp_path, GOOD, least_row_count=4)
    with pytest.raises(InputError, match="No such file"):
        tables.read_table(tmp_path / "absent.csv", FORCES)
    with pytest.raises(InputError, match="cannot be read"):
        tables.read_table(tmp_path, FORCES)


def test_a_file_cut_at_any_byte_is_refused_or_a_prefix_of_whole_rows(tmp_path):
    """A number that lost its last digits is the one fault that would pass as a value."""
    whole = read(tmp_path, GOOD)
    for end in range(len(GOOD)):
        try:
            part = read(tmp_path, GOOD[:end])
        except InputError:
            continue
        for name, values in part.items():
            np.testing.assert_array_equal(values, whole[name][: values.size])
