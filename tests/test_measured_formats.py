"""Measurement files: written whole or not at all, read by block from anywhere, by what is in them, and quietly."""

import builtins
from datetime import datetime

import numpy as np
import pytest

from models.core.errors import InputError
from models.measured.formats import csv as csv_format
from models.measured.formats import csv_rows, mdf4, open_source, tdms, write
from models.measured.formats.opened import OpenFile
from models.measured.formats.writing import ChannelGroup
from validation.cases import measured_formats as case
from validation.measured.measured_files import csv as csv_files
from validation.measured.measured_files import mdf4 as mdf4_files
from validation.measured.measured_files import tdms as tdms_files
from validation.measured.measured_files.odd import (
    FX,
    FZ,
    SAMPLE_TIMES,
    CutSweep,
    file_of_two_rates,
    read_channels,
    usual_truth,
    write_usual_file,
)

EXTENSIONS = (".csv", ".mf4", ".rsp", ".tdms")


def group(count=50, **changed):
    """A group of two channels, in blocks of 20."""
    table = np.column_stack((np.arange(count) + 0.5, -2.0 * np.arange(count)))
    own = {
        "names": ("Fz", "Fx"),
        "units": ("N", "kN"),
        "comments": ("", ""),
        "period": 0.01,
        "count": count,
        "blocks": [table[i : i + 20] for i in range(0, count, 20)],
    }
    return ChannelGroup(**own | changed)


def odd(module, name):
    """An odd file by its name."""
    return next(one for one in module.FILES if one.name == name)


def test_every_row_of_the_case_passes(tmp_path):
    rows, data = case.measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == [] and len(rows) == 23
    assert len(case.tables(data)[0].rows) == 4


def test_a_value_that_is_off_by_one_bit_is_seen_by_the_case(tmp_path, monkeypatch):
    original = OpenFile._checked_blocks

    def off(self, chosen, spans):
        for block in original(self, chosen, spans):
            block.values[0, 0] = np.nextafter(block.values[0, 0], np.inf)
            yield block

    monkeypatch.setattr(OpenFile, "_checked_blocks", off)
    rows, _ = case.round_trip_rows(tmp_path / "trip.mf4", ".mf4")
    assert [row.id for row in rows if row.status == "failed"] == ["measured_formats.mf4.values"]


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_any_part_of_a_file_is_the_same_as_that_part_of_the_whole(tmp_path, extension):
    path = write(tmp_path / f"a{extension}", [group(3000)])
    source = open_source(path)
    whole = next(source.blocks(["Fx", "Fz"], 5000))
    assert whole.values.shape == (3000, 2) and whole.values[7, 1] == 7.5  # in the order that was asked for
    for first, length in ((0, 1), (999, 2), (1000, 1000), (2047, 2), (2999, 5)):
        part = next(source.blocks(["Fx", "Fz"], length, first))
        count = min(length, 3000 - first)
        assert part.first == first
        assert np.array_equal(part.values, whole.values[first : first + count])
        assert np.array_equal(part.times, whole.times[first : first + count])


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_channels_are_asked_for_by_names_that_exist(tmp_path, extension):
    source = open_source(write(tmp_path / f"a{extension}", [group()]))
    with pytest.raises(InputError, match="did you mean 'Fz'"):
        source.blocks(["fz"])
    with pytest.raises(InputError, match="one or more channels"):
        source.blocks([])


def test_channels_of_two_rates_are_not_read_as_one(tmp_path):
    source = open_source(file_of_two_rates(".mf4")(tmp_path))
    with pytest.raises(InputError, match="one sampling rate"):
        source.blocks(["Fz", "Fx"])


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_nothing_is_overwritten(tmp_path, extension):
    path = tmp_path / f"a{extension}"
    path.write_text("mine")
    with pytest.raises(InputError, match="exists already"):
        write(path, [group()])
    assert path.read_text() == "mine" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_a_file_that_appears_while_another_is_written_stays(tmp_path, extension):
    path = tmp_path / f"a{extension}"

    def blocks():
        yield np.ones((20, 2))
        path.write_text("mine")
        yield np.ones((30, 2))

    with pytest.raises(InputError, match="exists already"):
        write(path, [group(blocks=blocks())])
    assert path.read_text() == "mine" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize(("last", "error"), [(np.full((30, 2), np.inf), InputError), (np.ones((9, 2)), ValueError)])
def test_what_fails_in_the_middle_leaves_nothing_behind(tmp_path, extension, last, error):
    with pytest.raises(error):
        write(tmp_path / f"a{extension}", [group(blocks=[np.ones((20, 2)), last])])
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_does_not_exist_is_one_message(tmp_path):
    for extension in EXTENSIONS:
        with pytest.raises(InputError, match="cannot be written"):
            write(tmp_path / "no" / f"a{extension}", [group()])


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"names": ("Fz", "Fz")}, "once in a file"),
        ({"names": ("Fz", "a\nb")}, "printable"),
        ({"names": ("Fz", " Fx")}, "printable"),
        ({"names": ("Fz", "")}, "printable"),
        ({"count": 0}, "samples"),
        ({"period": 0.0}, "period"),
    ],
)
def test_channels_that_no_file_can_hold_are_refused_before_a_block_is_taken(tmp_path, changed, says):
    for extension in EXTENSIONS:
        with pytest.raises(InputError, match=says):
            write(tmp_path / f"a{extension}", [group(**changed, blocks=iter(()))])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"names": ("Fz", "M" * 96)}, "room for 95"),
        ({"names": ("Fz", "Ω")}, "'Ω'"),
        ({"units": ("N", "kΩ")}, "'Ω'"),
        ({"comments": ("", "x" * 95 * 1100)}, "1024 parameters"),
    ],
)
def test_what_rpc_has_no_room_for_is_refused_and_never_cut(tmp_path, changed, says):
    with pytest.raises(InputError, match=says):
        write(tmp_path / "a.rsp", [group(**changed, blocks=iter(()))])
    assert list(tmp_path.iterdir()) == []


def test_a_long_comment_is_kept_to_the_letter(tmp_path):
    text = "\\n ist kein Zeilenende, \\ auch nicht\n" + "ä b " * 300 + "Ende"
    for extension in (".csv", ".rsp", ".tdms"):  # asammdf takes spaces away from the ends of the lines
        path = write(tmp_path / f"a{extension}", [group(comments=(text, ""))], comment=text)
        source = open_source(path)
        assert (source.comment, source.channels[0].comment, source.channels[1].comment) == (text, text, "")


def test_names_that_look_like_csv_come_back(tmp_path):
    names, units = ('a;b, "c"', "d [e]"), ("", "N;m")
    source = open_source(write(tmp_path / "a.csv", [group(names=names, units=units)]))
    assert [(one.name, one.unit) for one in source.channels] == list(zip(names, units, strict=True))
    for changed in ({"units": ("N", "[N]")}, {"units": ("N\n", "")}, {"names": ("Fz", "Time")}):
        with pytest.raises(InputError, match=r"CSV"):
            write(tmp_path / "b.csv", [group(**changed)])


def test_formats_of_one_rate_take_one_group(tmp_path):
    for extension in (".csv", ".rsp"):
        with pytest.raises(InputError, match="one sampling rate"):
            write(tmp_path / f"a{extension}", [group(), group(names=("a", "b"))])


def test_a_start_needs_a_zone_and_an_extension_a_format(tmp_path):
    with pytest.raises(InputError, match="time zone"):
        write(tmp_path / "a.csv", [group()], datetime(2026, 11, 21))
    with pytest.raises(InputError, match=r"\.mf4"):
        write(tmp_path / "a.mdf4", [group()])


def test_a_file_without_a_start_gives_none(tmp_path):
    for extension in EXTENSIONS:
        assert open_source(write(tmp_path / f"a{extension}", [group()])).start is None


def test_a_file_that_does_not_exist_offers_the_next(tmp_path):
    write_usual_file(tmp_path / "monday.csv")
    with pytest.raises(InputError, match=r"did you mean 'monday\.csv'"):
        open_source(tmp_path / "mondy.csv")


@pytest.mark.parametrize(("extension", "name"), [(".mf4", "asammdf"), (".tdms", "nptdms")])
def test_a_missing_package_is_named_with_its_extra(tmp_path, monkeypatch, extension, name):
    path = write_usual_file(tmp_path / f"a{extension}")
    original = builtins.__import__

    def without(module, *args, **kwargs):
        if module.split(".")[0] == name:
            raise ImportError(module)
        return original(module, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"twinrig\[measured\]"):
        open_source(path)
    with pytest.raises(InputError, match=r"twinrig\[measured\]"):
        write(tmp_path / f"b{extension}", [group()])


def test_steps_of_whole_numbers_are_told(tmp_path):
    source = open_source(odd(mdf4_files, "MDF 4 of whole numbers").make(tmp_path))
    assert source.channels[0].resolution == 0.5
    assert open_source(write_usual_file(tmp_path / "a.mf4")).channels[0].resolution == 0.0


def test_readers_say_nothing_on_the_terminal(tmp_path, capfd):
    for module, name in (
        (mdf4_files, "MDF 3 cut"),
        (tdms_files, "TDMS cut in its samples"),
        (mdf4_files, "MDF 4 with invalid samples"),
    ):
        try:
            odd(module, name).error(tmp_path / name)
        except InputError:
            continue
    assert capfd.readouterr() == ("", "")


def test_numbers_in_other_hands(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text('Zeit [ms]\tKraft [kN]\t"a, b"\n0\t+1.5e3\t.5\n10\t-1E-3\tNaN\n', encoding="utf-8")
    source = open_source(path)
    assert [(one.name, one.unit) for one in source.channels] == [("Kraft", "kN"), ("a, b", "")]
    found = read_channels(source)
    assert np.array_equal(found["Kraft"][0], [0.0, 0.01]) and np.array_equal(found["Kraft"][1], [1500.0, -1e-3])
    assert "tabs" in source.findings[0].text


def test_shortest_and_longest_decimals_are_read_to_the_last_bit(tmp_path):
    values = np.concatenate(
        ([5e-324, 1.7976931348623157e308, 0.1, 2.0**-1074 * 3], case.normal_samples(7, 0, 500, 1)[:, 0])
    )
    rows = "".join(f"{i},{value:.17g}\n" for i, value in enumerate(values))
    (tmp_path / "a.csv").write_text("time [s],x [N]\n" + rows)
    assert np.array_equal(read_channels(open_source(tmp_path / "a.csv"))["x"][1], values)


def test_without_the_count_of_columns_a_short_row_is_filled_up(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_rows, "_refuse_uneven_row", lambda *_: None)
    assert odd(csv_files, "CSV with a short row").error(tmp_path) == np.inf


def test_without_the_marks_invalid_samples_pass_for_measured(tmp_path, monkeypatch):
    original = mdf4._physical_values
    monkeypatch.setattr(mdf4, "_physical_values", lambda *args: np.nan_to_num(original(*args)))
    assert odd(mdf4_files, "MDF 4 with invalid samples").error(tmp_path) == np.inf


def test_without_the_walk_over_segments_a_cut_is_silent(tmp_path, monkeypatch):
    monkeypatch.setattr(tdms, "check_segments", lambda _: [])
    assert odd(tdms_files, "TDMS cut in its samples").error(tmp_path) == np.inf


def test_without_the_announced_rows_a_cut_at_a_line_end_is_silent(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_format, "_findings_on_end", lambda *_: [])
    assert odd(csv_files, "CSV cut at a line end").error(tmp_path) == np.inf


@pytest.mark.grounds("closed form")
def test_the_usual_file_is_what_the_truth_says(tmp_path):
    for extension in EXTENSIONS:
        found = read_channels(open_source(write_usual_file(tmp_path / f"a{extension}")))
        assert (
            set(found) == set(usual_truth())
            and np.array_equal(found["Fz"][1], FZ)
            and np.array_equal(found["Fx"][1], FX)
        )
        assert np.allclose(found["Fz"][0], SAMPLE_TIMES, atol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_no_cut_at_any_byte_is_silent(tmp_path, extension):
    sweep = CutSweep(extension, 2000 if extension == ".rsp" else 0)  # its samples fill 57,000 bytes
    assert sweep.silent_cuts(tmp_path) == 0


@pytest.mark.parametrize("unit, factor", [("ms", 1e3), ("s", 1.0), ("us", 1e6), ("", 1.0)])
def test_a_master_channel_in_another_unit_is_read_in_seconds(tmp_path, unit, factor):
    asammdf = pytest.importorskip("asammdf")
    times, file = np.arange(50) * 2e-3, asammdf.MDF(version="4.10")
    file.append([asammdf.Signal(np.sin(times), factor * times, name="fz", unit="kN")], common_timebase=True)
    file.groups[0].channels[0].unit = unit
    file.save(tmp_path / "a.mf4")
    (block,) = open_source(tmp_path / "a.mf4").blocks(["fz"])
    np.testing.assert_allclose(block.times, times, rtol=1e-12, atol=1e-15)
