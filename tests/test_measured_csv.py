"""CSV in the forms that loggers, spreadsheets and scripts write: the samples of the plain file, or a refusal."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.core.csv_header import find_heads_above_numbers, name_and_unit, split_cells
from models.core.errors import InputError
from models.measured.formats import csv_layout, csv_rows, open_source
from models.measured.formats.csv_layout import clock_heading, is_clock, is_other_clock
from validation.cases import measured_formats as case
from validation.measured.measured_files.csv_forms import (
    BARE_HEADINGS,
    FILES,
    HEADINGS,
    KEYS,
    MILLI,
    READ,
    TITLES,
    Form,
    clock_text,
    german_text,
    iso_text,
    time_texts,
)
from validation.measured.measured_files.odd import SAMPLE_TIMES, OddFile, read_channels, reading_error, usual_truth

PLAIN = Form().times
FORMS = st.builds(
    Form,
    headings=st.just(HEADINGS),
    lines_above=st.sampled_from([(), TITLES, KEYS, ("# by hand",)]),
    separator=st.sampled_from(",;\t"),
    decimal=st.sampled_from(".,"),
    quoted=st.booleans(),
    trailing=st.sampled_from(["", ","]),
    end=st.sampled_from(["\n", "\r\n"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    last_lines=st.sampled_from([(), ("",), (",,",)]),
    times=st.sampled_from([PLAIN, time_texts(clock_text), time_texts(iso_text), time_texts(german_text)]),
)


def possible(form: Form) -> Form:
    """The nearest form that somebody can have meant: separators that end rows part them, and quotes hold commas."""
    form = replace(
        form,
        trailing=form.trailing and form.separator,
        last_lines=tuple(line.replace(",", form.separator) for line in form.last_lines),
    )
    commas = form.decimal == "," or "," in form.times[0]
    return replace(form, quoted=True) if commas and form.separator == "," else form


def ended(form: Form, text: str | None = None) -> float | str:
    """Difference to the plain file, or the refusal."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "odd.csv"
        path.write_bytes((form.text() if text is None else text).encode(form.encoding))
        try:
            source = open_source(path)
            said = [one.text for one in source.findings]
            return reading_error(source, usual_truth(), "cut off" if any("cut off" in text for text in said) else "")
        except InputError as refusal:
            assert path.name in str(refusal) and "\n" not in str(refusal)
            return str(refusal)


@settings(max_examples=150, deadline=None)
@given(FORMS)
def test_every_form_that_is_meant_is_read_as_the_plain_file(form):
    own = possible(form)
    assert ended(own) <= 1e-16, own.text()[:200]


def test_a_tab_is_no_blank_before_a_time():
    """It may stand for a lost digit: 23:59:59 would become 3:59:59, a gap of 20 hours before the next row."""
    form = next(
        form for _, _, form, truth in READ if set(truth) == set(usual_truth()) and form.times[0].startswith("23:")
    )
    text = form.text().replace(form.times[0], "\t" + form.times[0][1:], 1)
    assert "a tab in it" in str(ended(form, text))


@settings(max_examples=150, deadline=None)
@given(
    FORMS,
    st.sampled_from(
        [
            form
            for _, _, form, truth in READ
            if set(truth) == set(usual_truth()) and form.gap is None and not form.last_cells and "" not in form.headings
        ]
    ),
    st.booleans(),
    st.integers(0, 10**6),
    st.sampled_from("xä;,\t\"'°"),
)
def test_a_strange_letter_in_a_row_is_never_silent(one, other, which, place, letter):
    form = possible(one) if which else other
    text = form.text()
    begin = text.index(form.row(0))
    end = text.index(form.row(39)) + len(form.row(39))
    place = begin + place % (end - begin)
    wrong = ended(form, text[:place] + letter + text[place + 1 :])
    assert isinstance(wrong, str) or wrong <= 1e-16, text[:place] + "!" + letter


@settings(max_examples=150, deadline=None)
@given(FORMS, st.integers(1, 10**6))
def test_a_cut_within_a_line_is_never_silent(form, place):
    own = possible(form)
    text = own.text()
    place = place % len(text)
    if text[place - 1] == "\n":
        return  # nothing in the file shows that it is cut
    left = ended(own, text[:place])
    assert isinstance(left, str) or left <= 1e-16 or "cut off" in str(left)


@pytest.mark.parametrize("odd", FILES, ids=lambda odd: odd.name)
def test_a_form_is_read_or_refused_as_it_should(tmp_path, odd: OddFile):
    if odd.expected_outcome == "refused":
        with pytest.raises(InputError):
            odd.error(tmp_path)
    else:
        assert odd.error(tmp_path) <= 1e-16


def test_the_case_sees_a_form_that_is_read_wrong(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_layout, "TIME_UNITS", dict.fromkeys(csv_layout.TIME_UNITS, 1.0))
    monkeypatch.setattr("models.measured.formats.csv.TIME_UNITS", dict.fromkeys(csv_layout.TIME_UNITS, 1.0))
    assert [row.id for row in case.file_form_rows(tmp_path) if row.status == "failed"] == [
        "measured_formats.forms.values"
    ]


def test_the_case_sees_a_form_that_is_read_without_a_word(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_layout, "decimal_sign", lambda path, line, separator, cells: ",")
    monkeypatch.setattr(csv_rows, "_without_quotes", lambda path, layout, text, line: text.replace(b'"', b""))
    assert any(row.status == "failed" for row in case.file_form_rows(tmp_path))


def test_stamps_keep_their_zone_and_their_day(tmp_path):
    path = Form(times=time_texts(lambda stamp: iso_text(stamp) + "+01:00")).make(tmp_path)
    assert open_source(path).start.isoformat() == "2026-03-02T09:30:00+01:00"
    found = read_channels(open_source(Form(times=time_texts(clock_text)).make(tmp_path)))
    assert np.abs(found["Fz"][0] - SAMPLE_TIMES).max() <= 1e-16 and open_source(path).channels[0].unit == "N"


@pytest.mark.parametrize(
    "name, unit",
    [
        ("time [s]", "s"),
        ("Time (s)", "s"),
        ("t / ms", "ms"),
        ("Zeit_s", "s"),
        ("TIME [hh:mm:ss]", "hh:mm:ss"),
        ("t", ""),
    ],
)
def test_headings_of_clocks(name, unit):
    assert is_clock(name) and clock_heading(name)[1] == unit


@pytest.mark.parametrize("name", ["Timestamp", "timeStamp", "Date/Time", "Elapsed_Time (s)", "X_Value", "Uhrzeit"])
def test_headings_of_clocks_where_none_is_called_time(name):
    assert is_other_clock(name) and not is_clock(name)


@pytest.mark.parametrize("name", ["Fz [N]", "lap time", "time constant", "Date", "temp (s)", "Fz (1)"])
def test_headings_of_other_columns(name):
    assert not is_clock(name) and not is_other_clock(name)


def test_a_unit_in_parentheses_is_known_and_stays_in_the_name(tmp_path):
    source = open_source(Form(("time [s]", "Fz (kN)", "Fx (1)")).make(tmp_path))
    assert [(one.name, one.unit) for one in source.channels] == [("Fz (kN)", "kN"), ("Fx (1)", "")]


def test_units_beneath_the_headings_reach_the_channels(tmp_path):
    for headings, row in (
        (BARE_HEADINGS, "s,[kN],N m"),
        (("time [s]", "Fz", "Fx"), "-,kN,N m"),
        (BARE_HEADINGS, "s;kN;N m"),
    ):
        form = Form(headings, lines_below_headings=(row,), separator=";" if ";" in row else ",")
        assert [one.unit for one in open_source(form.make(tmp_path)).channels] == ["kN", "N m"]


def test_groups_above_the_headings_are_known_where_names_differ(tmp_path):
    source = open_source(Form(lines_above=(",WFT VL,",)).make(tmp_path))
    assert [(one.name, one.family) for one in source.channels] == [("Fz", "WFT VL"), ("Fx", "WFT VL")]


def test_titles_and_comments_are_the_comment_of_the_file(tmp_path):
    form = Form(
        BARE_HEADINGS,
        lines_above=("# comment: by hand", '"Run; 7",,', "# samples: 40"),
        lines_below_headings=("ms,N,N",),
        times=MILLI,
    )
    source = open_source(form.make(tmp_path))
    assert source.comment == "by hand\nRun; 7"


def test_lines_that_are_no_table_have_no_head():
    lines = [csv_layout.FileLine(1, "time;date", 0, 10), csv_layout.FileLine(2, "Meier;today", 10, 22)]
    assert find_heads_above_numbers(lines, is_clock, ",;\t") == [] and split_cells('"a;b";c', ";") == ["a;b", "c"]
    assert name_and_unit("Fz [N]") == ("Fz", "N")
