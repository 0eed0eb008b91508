"""Measured roads from files: OpenCRG and CSV, and every way in which a file can be wrong."""

import io
import os
from pathlib import Path

import numpy as np
import pyopencrg
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from models.core.errors import InputError
from models.road import SplineProfile
from models.road.csv_road import read_csv_road, read_csv_tracks
from models.road.opencrg import read_opencrg, write_opencrg
from models.road.study import study_road

DATA = os.environ.get("TWINRIG_DATA")
needs_data = pytest.mark.skipif(not DATA, reason="the folder of measured roads, TWINRIG_DATA, is not set")
FORMATS = ("KDBI", "KRBI", "LDFI", "LRFI")


def grid_file(path, fmt="KDBI", z=None, **options):
    """Write a file with the library; z is (records, sections), heights up."""
    z = np.random.default_rng(1).normal(size=(21, 3)) * 0.02 if z is None else z
    across = options.pop("v", np.linspace(-1.0, 1.0, z.shape[1]))
    pyopencrg.CrgRoad(z, 0.05, across, **options).save(path, fmt)
    return z


@pytest.fixture(scope="module")
def good_bytes(tmp_path_factory):
    """Bytes of a sound file in every format."""
    folder = tmp_path_factory.mktemp("good")
    for fmt in FORMATS:
        grid_file(folder / fmt, fmt)
    return {fmt: (folder / fmt).read_bytes() for fmt in FORMATS}


def refusal(path, **options):
    """Text of the error of a file that must be refused; anything but an InputError passes through."""
    with pytest.raises(InputError) as caught:
        read_opencrg(path, **options)
    assert str(path) in str(caught.value)
    return str(caught.value)


def edited(tmp_path, content, old, new):
    """File with one piece of its header replaced."""
    assert old in content
    path = tmp_path / "edited.crg"
    path.write_bytes(content.replace(old, new, 1))
    return path


@pytest.mark.parametrize(("length", "increment"), [(30.0, 0.1), (12.5, 1 / 64), (3.0, 1.0), (99.9, 0.333)])
def test_what_is_written_is_read_bit_for_bit(tmp_path, length, increment):
    road, path = study_road(), tmp_path / "study.crg"
    write_opencrg(road, path, length, increment)
    for track in ("left", "right", "mean", "centre"):
        back = read_opencrg(path, track)
        s = np.arange(round(length / increment) + 1) * increment
        np.testing.assert_array_equal(back.station, s)
        np.testing.assert_array_equal(back.coefficients[:, 3], road.height_and_slope(s)[0][:-1])
        # the last height is the last piece's value at its end: one rounding of a cubic
        assert back.points[1][-1] == pytest.approx(road.height_slope_at(s[-1])[0], rel=1e-14)


def test_two_tracks_keep_their_sides_and_their_sign(tmp_path):
    s, path = np.arange(0.0, 5.05, 0.1), tmp_path / "tracks.csv.crg"
    left, right = SplineProfile.through(s, -0.1 * s), SplineProfile.through(s, 0.02 * s**2)
    write_opencrg(left, path, 5.0, 0.5, right)
    assert pyopencrg.read(path).uv_to_z(5.0, 0.75) == pytest.approx(0.5)  # heights up, v positive to the left
    assert read_opencrg(path, "left").height_slope_at(5.0)[0] == pytest.approx(-0.5)
    assert read_opencrg(path, "right").height_slope_at(5.0)[0] == pytest.approx(0.5)
    assert read_opencrg(path, "mean").height_slope_at(4.0)[0] == pytest.approx((-0.4 + 0.32) / 2)


def test_height_is_grid_plus_reference_line_plus_banking(tmp_path):
    path, z = tmp_path / "banked.crg", np.zeros((21, 3))
    z[:, 2] = 0.3
    grid_file(path, z=z, slope=0.1, banking=0.05, z_start=2.0, u_start=7.0)
    road = read_opencrg(path, "centre", lateral_offset=0.5)
    expected = -(2.0 + 0.1 * road.station + 0.05 * 0.5 + 0.15)
    np.testing.assert_allclose(road.points[1], expected, atol=1e-12)
    assert (road.start, road.end) == (0.0, pytest.approx(1.0))


@pytest.mark.parametrize("fmt", FORMATS)
def test_every_format_is_read(tmp_path, fmt):
    path = tmp_path / "road.crg"
    z = grid_file(path, fmt)
    resolution = {"KDBI": 0.0, "KRBI": 2.0**-29, "LDFI": 1e-16, "LRFI": 1e-7}[fmt]  # of heights below 0.1 m
    np.testing.assert_allclose(read_opencrg(path, "centre").points[1], -z[:, 1], rtol=1e-15, atol=resolution)


def test_empty_borders_do_not_matter_but_an_empty_track_does(tmp_path):
    path, z = tmp_path / "holes.crg", np.zeros((21, 5))
    z[:, :2] = z[13, 4] = np.nan
    grid_file(path, z=z)
    assert read_opencrg(path, "centre").end == pytest.approx(1.0)
    text = refusal(path, track_name="left")
    assert "cross section 14 (u = 0.65 m), v = 0.75 m = nan" in text


@pytest.mark.parametrize("fmt", FORMATS)
@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_a_file_cut_at_any_byte_is_refused(tmp_path_factory, good_bytes, fmt, data):
    content, path = good_bytes[fmt], tmp_path_factory.getbasetemp() / f"cut_{fmt}.crg"
    path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    refusal(path)


@pytest.mark.parametrize("fmt", FORMATS)
def test_a_file_cut_in_its_last_bytes_or_between_blocks_is_refused(tmp_path, good_bytes, fmt):
    """The cuts that the library alone reads: the last digits of a text, whole lines, whole 80 bytes."""
    content, path = good_bytes[fmt], tmp_path / "cut.crg"
    for lost in [*range(1, 25), 80, 160, 240, 61 * 4, 61]:
        path.write_bytes(content[:-lost])
        assert "cut off or damaged" in refusal(path) or fmt in ("LDFI", "LRFI")


@pytest.mark.parametrize("fmt", ["LDFI", "LRFI"])
def test_a_digit_lost_inside_a_text_is_refused(tmp_path, good_bytes, fmt):
    """All lines are there, but every number after the lost digit stands one place too far left."""
    content, path = good_bytes[fmt], tmp_path / "shifted.crg"
    path.write_bytes(content[:-215] + content[-214:])
    assert "characters wide" in refusal(path)


@pytest.mark.parametrize("fmt", ["LDFI", "LRFI"])
def test_without_the_count_of_bytes_a_cut_number_would_be_read(tmp_path, good_bytes, fmt, monkeypatch):
    """Planted fault: the library alone reads the digits that are left. If this fails, it has learnt to refuse."""
    path = tmp_path / "cut.crg"
    path.write_bytes(good_bytes[fmt][:-3])
    monkeypatch.setattr("models.road.opencrg._check_text", lambda *_: None)
    assert read_opencrg(path).station.size == 21


@pytest.mark.parametrize("fmt", FORMATS)
def test_surplus_bytes_are_refused(tmp_path, good_bytes, fmt):
    path = tmp_path / "longer.crg"
    path.write_bytes(good_bytes[fmt] + b"0" * 80 + b"\n")
    assert "cut off or damaged" in refusal(path)


@given(place=st.integers(0, 1500), byte=st.integers(0, 255), fmt=st.sampled_from(FORMATS))
@example(place=0, byte=0, fmt="KDBI")
@settings(max_examples=150, deadline=None)
def test_a_damaged_byte_gives_an_input_error_or_a_whole_road(tmp_path_factory, good_bytes, place, byte, fmt):
    """No format with no check sum can show a changed height; but nothing else may come out, and no traceback."""
    content = bytearray(good_bytes[fmt])
    content[place] = byte
    path = tmp_path_factory.getbasetemp() / f"damaged_{fmt}.crg"
    path.write_bytes(content)
    try:
        road = read_opencrg(path)
    except InputError:
        return
    assert road.station.size == 21
    assert np.isfinite(road.coefficients).all()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"$KD_DEFINITION", b"$KD_DEFINITIOM", "$KD_DEFINITION"),
        (b"#:KDBI", b"#:KDBJ", "KRBI, KDBI, LRFI, LDFI"),
        (b"#:KDBI\n", b"", "KRBI, KDBI, LRFI, LDFI"),
        (b"increment  =   5.0000000000000003e-02", b"increment  =   0.0", "reference_line_increment = 0.0"),
        (b"increment  =   5.0", b"increment  =  -5.0", "reference_line_increment = -0.05"),
        (b"increment  =   5.0", b"increment  =   nan", "reference_line_increment = 'nan"),
        (b"reference_line_increment ", b"reference_line_incrememt ", "reference_line_increment"),
        (b"v_increment  =   1.0", b"v_increment  =  -1.0", "long_section_v_increment"),
        (b"end_u      =   1.0", b"end_u      =  -1.0", "reference_line_end_u = -1.0"),
        (b"end_u      =   1.0", b"end_u      =   2.0", "41 cross sections"),
        (b"end_u      =   1.0", b"end_u      =   inf", "reference_line_end_u"),
        (b"reference_line_end_u ", b"reference_line_emd_u ", "reference_line_end_u"),
        (b"v_left       =   1.0", b"v_left       =   1.x", "long_section_v_left"),
        (b"start_z    =   0.0", b"start_z    =   ???", "reference_line_start_z"),
        (b"D:long section 3", b"D:long section 4", "long section"),
        (b"D:long section 3,m", b"D:long section 3,mm", "must be m"),
        (b"D:long section 3,m\n", b"", "21 cross sections of 2 values"),
    ],
)
def test_faults_of_the_header_are_named(tmp_path, good_bytes, old, new, words):
    assert words in refusal(edited(tmp_path, good_bytes["KDBI"], old, new))


def test_scaling_modifiers_are_not_ignored(tmp_path, good_bytes):
    block = b"$ROAD_CRG_MODS\nscale_z_grid = 2.0\n$\n$KD_DEFINITION"
    assert "scale_z_grid = 2.0" in refusal(edited(tmp_path, good_bytes["KDBI"], b"$KD_DEFINITION", block))


def test_records_of_nan_at_the_end_are_missing_records(tmp_path):
    """The library takes them for padding and shortens the road; the header's promise shows it."""
    path, z = tmp_path / "tail.crg", np.zeros((21, 3))
    grid_file(path, z=z)
    content = path.read_bytes()
    path.write_bytes(content[:-128] + np.full(16, np.nan, dtype=">f8").tobytes())
    refusal(path)


@pytest.mark.parametrize("content", [b"", b"$", b"PK\x03\x04" * 100, b"\x00" * 5000, b"$$$$\n", b"s [m]\n0\n"])
def test_other_files_are_refused(tmp_path, content):
    path = tmp_path / "other.crg"
    path.write_bytes(content)
    refusal(path)


def test_absent_files_tracks_and_positions_are_named(tmp_path, good_bytes):
    refusal(tmp_path / "absent.crg")
    refusal(tmp_path)
    path = tmp_path / "road.crg"
    path.write_bytes(good_bytes["KDBI"])
    assert "did you mean 'left'" in refusal(path, track_name="lefft")
    assert "= 1.75: the file covers v = -1 to 1 m" in refusal(path, track_name="left", lateral_offset=1.0)


@pytest.mark.parametrize(("length", "increment"), [(1.0, 0.0), (1.0, 5e-4), (1.05, 0.1), (0.2, 0.1), (np.nan, 0.1)])
def test_impossible_lengths_are_not_written(tmp_path, length, increment):
    with pytest.raises(InputError, match="must be"):
        write_opencrg(study_road(), tmp_path / "no.crg", length, increment)
    assert not (tmp_path / "no.crg").exists()


def test_unwritable_places_and_short_roads_are_named(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_opencrg(study_road(), tmp_path / "absent" / "no.crg", 1.0, 0.1)
    with pytest.raises(InputError, match="0 m to 3 m"):
        write_opencrg(SplineProfile.through(np.arange(4.0), np.zeros(4)), tmp_path / "no.crg", 4.0, 0.1)


CSV = "# survey 7\ns [km], left [mm], right [cm]\n0.010, 1, 1\n0.011, 2, 1\n0.0125, -4, 1\n0.014, 8, 1\n"


def csv_file(tmp_path, text):
    path = tmp_path / "road.csv"
    path.write_text(text)
    return path


def test_csv_heights_are_up_and_stations_start_at_zero(tmp_path):
    path = csv_file(tmp_path, CSV)
    left = read_csv_road(path, "left")
    np.testing.assert_allclose(left.station, [0.0, 1.0, 2.5, 4.0], atol=1e-12)
    np.testing.assert_allclose(left.points[1], [-1e-3, -2e-3, 4e-3, -8e-3], atol=1e-16)
    np.testing.assert_allclose(read_csv_road(path, "right").points[1], -0.01, atol=1e-16)
    np.testing.assert_allclose(read_csv_road(path).points[1], [-5.5e-3, -6e-3, -3e-3, -9e-3], atol=1e-15)
    assert read_csv_tracks(path)[1].name == "road.csv, right"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("left [mm]", "left", "line 2.*unit is missing"),
        ("left [mm]", "left [inch]", "'inch'.*allowed: cm, m, mm"),
        ("left [mm]", "lft [mm]", "did you mean 'left'"),
        (", right [cm]", "", "'right' is missing"),
        ("-4, 1", "nan, 1", "line 5, column 'left .mm.'.*'nan'"),
        ("-4, 1", "deep, 1", "line 5.*'deep'"),
        ("0.0125", "0.011", "line 5, column 's'.*greater than 0.011"),
        ("0.0125", "0.0105", "line 5, column 's'"),
        ("0.014, 8, 1\n", "", "rows = 3: at least 4"),
        ("# survey 7\n" + CSV[11:], "", "empty"),
    ],
)
def test_faults_of_a_csv_road_are_named(tmp_path, old, new, words):
    assert old in CSV
    with pytest.raises(InputError, match=words):
        read_csv_road(csv_file(tmp_path, CSV.replace(old, new)))


def test_unknown_csv_tracks_are_refused(tmp_path):
    with pytest.raises(InputError, match="did you mean 'right'"):
        read_csv_road(csv_file(tmp_path, CSV), "rigth")


def test_csv_and_opencrg_tell_the_same_road(tmp_path):
    road, s = study_road(), np.arange(0.0, 20.05, 0.1)
    up = -road.height_and_slope(s)[0]
    text = io.StringIO()
    header = "s [m],left [m],right [m]"
    np.savetxt(text, np.column_stack([s, up, up]), fmt="%.17g", delimiter=",", header=header, comments="")
    from_csv = read_csv_road(csv_file(tmp_path, text.getvalue()))
    write_opencrg(road, tmp_path / "road.crg", 20.0, 0.1)
    from_crg = read_opencrg(tmp_path / "road.crg")
    np.testing.assert_allclose(from_csv.coefficients, from_crg.coefficients, rtol=0.0, atol=1e-9)


@needs_data
def test_measured_roads_of_the_data_folder():
    """Figures of these files: 504.75 m with equal tracks; two true tracks of 25.6 and 25.7 mm, correlated -0.38."""
    folder = Path(DATA or "")
    course = [read_opencrg(folder / "detrended_rms_course_2in.crg", track) for track in ("left", "right")]
    assert course[0].end == pytest.approx(504.75)
    np.testing.assert_array_equal(course[0].coefficients, course[1].coefficients)
    assert read_opencrg(folder / "Horstwalde.crg").end == pytest.approx(250.2)
    blocks = [read_opencrg(folder / "belgian_block.crg", track).points[1] for track in ("left", "right")]
    assert [1e3 * z.std() for z in blocks] == pytest.approx([25.6, 25.7], abs=0.06)
    assert np.corrcoef(blocks)[0, 1] == pytest.approx(-0.38, abs=0.006)
