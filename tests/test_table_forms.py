"""Roads, wheel forces and pressures as spreadsheets and loggers write them: the numbers of the plain table."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.tables import METRES, SECONDS, read_table
from models.core.time_series import read_time_series

COLUMNS = {"time": SECONDS, "left": METRES, "right": METRES}
TIMES, LEFT, RIGHT = 0.125 * np.arange(12), 1.5 * np.arange(12.0), -0.25 * np.arange(12.0)
PLAIN = "time [s],left [mm],right [mm]\n" + "".join(
    f"{t},{a},{b}\n" for t, a, b in zip(TIMES.tolist(), LEFT.tolist(), RIGHT.tolist(), strict=True)
)
GERMAN = PLAIN.replace(",", ";").replace(".", ",")
ROWS = PLAIN.split("\n", 1)[1]
QUOTED = "".join('"' + line.replace(",", '","') + '"\n' for line in PLAIN.splitlines())
FORMS = {
    "semicolons": GERMAN,
    "tabs": PLAIN.replace(",", "\t"),
    "sep": "sep=;\n" + GERMAN,
    "quotes": QUOTED,
    "quotes and commas": "".join('"' + line.replace(";", '","') + '"\n' for line in GERMAN.splitlines()),
    "titles": "Road survey\nOperator; Meier\n\n" + PLAIN,
    "units beneath": "time,left,right\ns,mm,mm\n" + ROWS,
    "units in brackets beneath": "time;left;right\n[s];[mm];[mm]\n" + GERMAN.split("\n", 1)[1],
    "ends of Windows": GERMAN.replace("\n", "\r\n"),
    "separator at the end": PLAIN.replace("\n", ",\n"),
    "comment within": PLAIN.replace("\n0.25,", "\n# here\n0.25,").replace(",", ";"),
}


def table(tmp_path, text, encoding="utf-8", **asked):
    """Read a text as a table of two tracks over time."""
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    return read_table(tmp_path / "a.csv", COLUMNS, increasing_column="time", **asked)


@pytest.mark.parametrize("text", FORMS.values(), ids=FORMS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_form_has_the_bits_of_the_plain_table(tmp_path, text, encoding):
    found, plain = table(tmp_path, text, encoding), table(tmp_path, PLAIN)
    assert all(np.array_equal(found[name], plain[name]) for name in COLUMNS)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (GERMAN.replace("1,5;", "1.001,5;"), "thousands"),
        (GERMAN.replace("3,0;", "x;"), "line 4, column 'left [mm]'"),
        (GERMAN.replace("3,0;", ""), "line 4"),
        (GERMAN.replace("3,0;", "NA;"), "line 4, column 'left [mm]'"),
        (GERMAN[:-5], "no line end"),
        ("titles\nno table\n", "wanted"),
        (GERMAN.replace("[mm]", ""), "unit is missing"),
        (QUOTED.replace('"1.5"', '"1,500"'), "thousands"),
        (GERMAN.replace("left", "lft"), "lft"),
        ("sep=|\n" + PLAIN.replace(",", "|"), "sep=|"),
        (PLAIN.replace("left", '"left"', 1).replace("1.5", "1 .5"), "1 .5"),
    ],
)
def test_what_has_two_meanings_is_refused_with_its_place(tmp_path, text, says):
    with pytest.raises(InputError) as error:
        table(tmp_path, text)
    assert says in str(error.value) and "a.csv" in str(error.value)


def test_marks_are_gaps_where_gaps_are_allowed(tmp_path):
    text = GERMAN.replace("3,0;", "--;").replace("4,5;", "n/a;")
    found = table(tmp_path, text, allows_gaps=True)["left"]
    assert np.flatnonzero(np.isnan(found)).tolist() == [2, 3]


def test_time_series_gain_from_it(tmp_path):
    (tmp_path / "a.csv").write_text("Logger 7\n" + GERMAN)
    values, period = read_time_series(tmp_path / "a.csv", {"left": METRES, "right": METRES})
    assert period == 0.125 and np.allclose(values[:, 0], 1e-3 * LEFT, atol=1e-15)
