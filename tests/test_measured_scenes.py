"""Scenes of measurements: units, the channel map, one clock, guesses, and what a user's mistake is answered with."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.result import load_result
from models.measured.channel import FileChannel
from models.measured.formats import open_source
from models.measured.gaps import without_impossible_values
from models.measured.resampling import resample_to
from models.measured.signal import MeasuredSignal, MeasurementPlaces
from models.measured.timing import sample_timing
from models.measured.units import factor_to_si
from models.systems.measured.channel_map import mapped_signals
from models.systems.measured.clock import record_on_clock
from models.systems.measured.listing import describe, guess_channel
from models.systems.measured.plan import check
from models.systems.measured.scene import build
from studies.command.summary_numbers import summary_scalars
from studies.recording import run

HUBS = ("fl", "fr")
PLACES = MeasurementPlaces(HUBS, ("body",), ("front left",), ("dash",))


@pytest.mark.parametrize(
    "unit, quantity, factor",
    [
        ("kN", "force", 1e3),
        ("lbf", "force", 4.4482216152605),
        ("kp", "force", 9.80665),
        ("[N]", "force", 1.0),
        ("Nm", "moment", 1.0),
        ("kNm", "moment", 1e3),
        ("N-m", "moment", 1.0),
        ("lbf ft", "moment", 1.3558179483314),
        ("g", "acceleration", 9.80665),
        ("m/s2", "acceleration", 1.0),
        ("m/s²", "acceleration", 1.0),
        ("°/s", "angular rate", np.pi / 180),
        ("U/min", "angular rate", np.pi / 30),
        ("Grad", "angle", np.pi / 180),
        ("mm", "travel", 1e-3),
        ("µm/m", "strain", 1e-6),
        ("%", "strain", 1e-2),
        ("mm/m", "strain", 1e-3),
        ("", "strain", 1.0),
    ],
)
def test_units_as_they_are_spelt(unit, quantity, factor):
    assert factor_to_si(unit, quantity, "", "") == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    "unit, quantity, said",
    [
        ("kn", "force", "did you mean 'kN'"),
        ("Nm", "force", "unit of moment"),
        ("degC", "force", "degree_Celsius"),
        ("mV/V", "force", "calibration"),
        ("wibbles", "travel", "no such unit"),
        ("1/s", "angular rate", "does not say"),
        ("Hz", "angular rate", "does not say"),
        ("%", "angle", "does not say"),
        ("deg", "strain", "unit of angle"),
        ("grad", "angle", "no such unit"),
        ("", "force", "pure number"),
        ("10 kN", "force", "no such unit"),
    ],
)
def test_units_that_mean_something_else_are_refused(unit, quantity, said):
    with pytest.raises(InputError, match=said.replace("'", ".")):
        factor_to_si(unit, quantity, "scene.toml", "unit")


def write_csv(path: Path, times: np.ndarray, **columns: np.ndarray) -> str:
    names = ",".join(f"{name.replace('__', ' [')}]" for name in columns)
    rows = "\n".join(",".join(f"{v:.9g}" for v in row) for row in np.column_stack([times, *columns.values()]))
    path.write_text(f"time [s],{names}\n{rows}\n")
    return path.name


def scene(folder: Path, *files: dict, **tables: object):
    table = {"title": "t", "system": "measured", "vehicle": {"file": "r19_free"}, "files": list(files), **tables}
    return build(table, "scene.toml", folder)


def force(channel: str, at: str, **more: object) -> dict:
    return {"channel": channel, "quantity": "force", "at": at, "component": "z", **more}


def recorded(own, folder: Path):
    sources = [open_source(own.path(file.file)) for file in own.files]
    (folder / "work").mkdir(exist_ok=True)
    return record_on_clock(own, sources, mapped_signals(own, sources, PLACES), HUBS, folder / "work")


def test_all_channels_on_the_clock_of_the_wheel_forces(tmp_path):
    t, fast, slow = np.arange(1001) * 2e-3, np.arange(-100, 5001) * 5e-4, np.arange(101) * 2e-2
    a = write_csv(tmp_path / "a.csv", t, fl__kN=np.sin(t), fr__N=np.cos(t))
    b = write_csv(tmp_path / "b.csv", fast, az__g=np.sin(2 * np.pi * 20 * fast) + np.sin(2 * np.pi * 700 * fast))
    c = write_csv(tmp_path / "c.csv", slow + 0.5, roll__deg=slow)
    own = scene(
        tmp_path,
        {"file": a, "channels": [force("fl", "fl"), force("fr", "fr", sign=-1)]},
        {"file": b, "channels": [{"channel": "az", "quantity": "acceleration", "at": "dash", "component": "z"}]},
        {
            "file": c,
            "offset": -0.5,
            "channels": [{"channel": "roll", "quantity": "angle", "at": "body", "component": "roll"}],
        },
    )
    found = recorded(own, tmp_path)
    fl, fr, az, roll = (found.samples(signal) for signal in found.signals)
    assert (found.period, found.count) == (pytest.approx(2e-3), 1001)
    assert fl == pytest.approx(1e3 * np.sin(t), abs=1e-4)  # the file has nine digits
    assert fr == pytest.approx(-np.cos(t), abs=1e-8)
    # 20 Hz kept within 0.1 %, which is what a Kaiser window of 60 dB promises; 700 Hz, an alias of 200 Hz, is gone
    assert az[50:-50] / 9.80665 == pytest.approx(np.sin(2 * np.pi * 20 * t[50:-50]), abs=2e-3)
    assert roll == pytest.approx(np.radians(t), abs=1e-8)


def test_files_are_placed_by_their_start_times_and_must_overlap(tmp_path):
    t = np.arange(200) * 1e-2
    a = write_csv(tmp_path / "a.csv", t, fl__N=t)
    b = write_csv(tmp_path / "b.csv", t, fr__N=t)
    files = {"file": a, "channels": [force("fl", "fl")]}, {"file": b, "offset": 0.5, "channels": [force("fr", "fr")]}
    found = recorded(scene(tmp_path, *files), tmp_path)
    assert found.count == 150 and found.samples(found.signals[1])[0] == pytest.approx(0.0, abs=1e-9)
    apart = scene(tmp_path, files[0], {**files[1], "offset": 5.0})
    (tmp_path / "other").mkdir()
    with pytest.raises(InputError, match="do not overlap"):
        recorded(apart, tmp_path / "other")


def test_a_clock_that_is_fast_is_slowed_down_and_a_zero_is_taken_off(tmp_path):
    t = np.arange(2000) * 1e-2
    a = write_csv(tmp_path / "a.csv", t, fl__kN=t + 0.25)
    b = write_csv(tmp_path / "b.csv", 1.002 * t, fr__N=t)
    own = scene(
        tmp_path,
        {"file": a, "channels": [force("fl", "fl", sign=-1, zero=0.25)]},
        {"file": b, "drift": 2e-3, "channels": [force("fr", "fr")]},
    )
    found = recorded(own, tmp_path)
    assert found.samples(found.signals[0]) == pytest.approx(-1e3 * t, abs=1e-4)
    assert found.samples(found.signals[1]) == pytest.approx(t, abs=1e-6) and found.count == 2000


def test_gaps_are_not_measured_and_all_else_is(tmp_path):
    t = np.delete(np.arange(1000) * 1e-3, np.arange(400, 600))
    own = scene(tmp_path, {"file": write_csv(tmp_path / "a.csv", t, fl__N=t), "channels": [force("fl", "fl")]})
    found = recorded(own, tmp_path)
    values = found.samples(found.signals[0])
    assert np.flatnonzero(np.isnan(values)).tolist() == list(range(400, 600))
    assert values[600:] == pytest.approx(np.arange(600, 1000) * 1e-3)
    assert any(finding.check == "clock gaps" and finding.size == pytest.approx(0.201) for finding in found.findings)


@pytest.mark.parametrize("head, period, said", [("ms", 5e-3, "seconds"), ("s", 5.0, "milliseconds"), ("s", 5e-3, "")])
def test_times_under_a_head_of_another_unit_are_told_with_the_remedy(tmp_path, head, period, said):
    t = np.arange(400) * period
    name = write_csv(tmp_path / "a.csv", t, fl__N=np.sin(t), fr__N=np.cos(t))
    path = tmp_path / name
    path.write_text(path.read_text().replace("time [s]", f"time [{head}]"))
    own = scene(tmp_path, {"file": name, "channels": [force("fl", "fl"), force("fr", "fr")]})
    found = [f for f in recorded(own, tmp_path).findings if f.check == "times"]
    assert [f.weight for f in found] == [{"ms": "doubt", "s": "error"}[head]] * bool(said)
    assert all(f"if its times are in {said}, not in" in f.text for f in found)


def test_times_that_are_late_repeated_or_go_back(tmp_path):
    t = np.arange(100) * 1e-3
    late = t.copy()
    late[[40, 41]] = late[[41, 40]]
    sorted_out = sample_timing(late, "a.csv")
    assert sorted_out.times == pytest.approx(t) and sorted_out.order[40:42].tolist() == [41, 40]
    assert [f.weight for f in sorted_out.findings if f.check == "time"] == ["doubt"]
    twice = sample_timing(np.insert(t, 50, t[50]), "a.csv")
    assert twice.times == pytest.approx(t) and "more than once" in twice.findings[0].text
    again = sample_timing(np.concatenate((t, t)), "a.csv")
    assert len(again.times) == 100 and again.findings[0].weight == "error" and again.findings[0].size == t[-1]
    with pytest.raises(InputError, match="two samples or more"):
        sample_timing(np.zeros(3), "a.csv")


@pytest.mark.parametrize(
    "rate, digits, way",
    [(1000, 2, np.round), (1024, 3, np.round), (400, 3, np.round), (1000, 2, np.floor), (2000, 3, np.ceil)],
)
def test_rounded_times_are_those_of_an_even_clock(rate, digits, way):
    t = np.arange(1500) / rate
    found = sample_timing(way(np.round(t * 10**digits, 6)) / 10**digits, "a.csv")
    assert found.order is None and len(found.times) == 1500 and found.rate == pytest.approx(rate, rel=1e-12)
    assert np.ptp(found.times - t) < 1e-9 and [finding.weight for finding in found.findings] == ["note"]


@pytest.mark.parametrize("rate", [200.0, 500.0, 1000.0, 2048.0])
def test_seconds_since_1970_have_the_rate_of_their_clock(rate):
    """Steps are off by up to 1e-4 of themselves: their median is no rate, and samples fell between those of a clock."""
    found = sample_timing(np.array([float(f"{1767600000 + i / rate:.6f}") for i in range(8000)]), "a.csv")
    off = found.times - found.times[0] - found.period * np.arange(8000)
    assert found.rate == pytest.approx(rate, rel=1e-7) and np.abs(off).max() < 2e-6


def test_times_that_no_even_clock_explains_are_not_believed():
    t = np.delete(np.arange(1500) * 1e-3, slice(700, 760))
    broken = sample_timing(np.round(t, 2), "a.csv")  # rounded, and a gap: where it lies, nobody can tell
    assert broken.findings[0].weight == "error" and "1294 of 1440 times" in broken.findings[0].text
    one_lost = sample_timing(np.delete(np.arange(1500) * 1e-3, 700), "a.csv")
    assert len(one_lost.times) == 1499 and one_lost.findings[0].check == "clock gaps"
    mark = np.arange(1500) * 1e-3
    mark[77] = 9.9e34
    left = sample_timing(mark, "a.csv")
    assert len(left.times) == 1499 and left.times[-1] == mark[-1] and "number 78" in left.findings[0].text


@pytest.mark.parametrize("mark", [9.9e34, -1e30, 3.4e38, 4e7])
def test_marks_for_no_value_are_told_and_not_measured(tmp_path, mark):
    t = np.arange(1000) * 1e-3
    load = 3e3 + 300 * np.sin(20 * t)
    load[[400, 401, 700]] = mark
    own = scene(tmp_path, {"file": write_csv(tmp_path / "a.csv", t, fl__N=load), "channels": [force("fl", "fl")]})
    for _ in range(2):  # a run that goes on where it was killed says the same
        found = recorded(own, tmp_path)
        values = found.samples(found.signals[0])
        assert np.flatnonzero(np.isnan(values)).tolist() == [400, 401, 700]
        told = next(finding for finding in found.findings if finding.check == "no value")
        assert told.size == 3 and told.times == pytest.approx((0.4, 0.7)) and "a.csv, fl: 3 samples" in told.text
        assert "at 0.4 s" in told.text


def test_a_wrong_unit_and_a_rough_road_are_no_marks(tmp_path):
    t = np.arange(1000) * 1e-3
    load = 3e3 * (1 + 0.5 * np.sin(20 * t))
    for values in (1e3 * load, np.where(np.arange(1000) == 500, 9e4, load)):
        signal = MeasuredSignal("fl", "a.csv", "fl", "force", "fl", "z", "hub", 1, "N", 1.0)
        kept, said = without_impossible_values(signal, values, t)
        assert said is None and kept is values


def test_jitter_is_measured(tmp_path):
    # 5 % of a period as sd of every time makes sqrt(2) times as much of every step; 4 standard errors of 2000 are 7 %
    times = (np.arange(2000) + 0.05 * np.random.default_rng(1).standard_normal(2000)) * 1e-2
    found = next(finding for finding in sample_timing(times, "a.csv").findings if finding.check == "jitter")
    assert found.size == pytest.approx(0.05 * np.sqrt(2) * 1e-2, rel=0.07)


def test_resampling_knows_nothing_outside():
    t = np.arange(50) * 0.1
    out = resample_to(t, t, 0.1, np.arange(-10, 60) * 0.1)
    assert np.isnan(out[:10]).all() and np.isnan(out[60:]).all() and np.isfinite(out[10:60]).all()


@pytest.mark.parametrize(
    "change, said",
    [
        ({"channel": "FL"}, "did you mean 'fl'"),
        ({"channel": "wheel"}, "which has 2: fl, fr"),
        ({"at": "lf"}, "no such place"),
        ({"component": "w"}, "must be x, y or z"),
        ({"component": ""}, "x, y or z"),
        ({"frame": "sensor"}, "no frame"),
        ({"unit": "mm"}, "unit of travel"),
        ({"quantity": "thrust"}, "must be force"),
        ({"sign": 0}, "must be 1 or -1"),
        ({"at": "front left"}, "leave component out"),
        ({"channel": "fr"}, "twice"),
    ],
)
def test_mistakes_in_the_map_are_told_in_one_sentence(tmp_path, change, said):
    t = np.arange(200) * 1e-2
    name = write_csv(tmp_path / "a.csv", t, fl__N=t, fr__N=t)
    rows = [{**force("fl", "fl"), **change}, force("fr", "fr")]
    with pytest.raises(InputError, match=said.replace("'", ".")) as error:
        own = scene(tmp_path, {"file": name, "channels": rows})
        mapped_signals(own, [open_source(tmp_path / name)], PLACES)
    assert "\n" not in str(error.value) and "Traceback" not in str(error.value)


def test_a_name_that_a_file_has_twice_is_told_with_the_names_that_tell_them_apart(tmp_path):
    rows = "\n".join(f"{0.01 * i:.2f},1.5,2.5" for i in range(200))
    (tmp_path / "a.csv").write_text(f"time [s],fl [N],fl [N]\n{rows}\n")
    own = scene(tmp_path, {"file": "a.csv", "channels": [force("fl", "fl")]})
    with pytest.raises(InputError, match=r"is there 2 times in a.csv: name one of 'fl \(1\)', 'fl \(2\)'"):
        mapped_signals(own, [open_source(tmp_path / "a.csv")], PLACES)


def test_a_missing_wheel_or_angle_is_refused_before_anything_runs(tmp_path):
    t = np.arange(200) * 1e-2
    name = write_csv(tmp_path / "a.csv", t, fl__N=t)
    with pytest.raises(InputError, match="no vertical force is mapped at 'fr'"):
        check(scene(tmp_path, {"file": name, "channels": [force("fl", "fl")]}), ("mujoco",))
    with pytest.raises(InputError, match=r"either \[\[files\]\]"):
        scene(tmp_path)


@pytest.mark.parametrize(
    "name, unit, found",
    [
        ("FL_Fx", "kN", ("force", "fl", "x")),
        ("WFT_RR_MZ", "N m", ("moment", "rr", "z")),
        ("Radkraft vorne links", "kN", ("force", "fl", "z")),
        ("Nickrate", "°/s", ("angular rate", "body", "pitch")),
        ("FzFrontRight", "N", ("force", "fr", "z")),
        ("Federweg HL", "mm", ("travel", "rear left", "")),
        ("Fx_rr", "", ("force", "rr", "x")),
        ("Vehicle speed", "km/h", None),
    ],
)
def test_guesses(name, unit, found):
    own = guess_channel(FileChannel(name, unit, "", 0, 10, None))
    assert (own and (own.quantity, own.at, own.component)) == found


@pytest.mark.parametrize(
    "name, unit, family, reason",
    [
        ("Strut_FL_F", "N", "", "strut"),
        ("Damper force FL", "kN", "", "damper"),
        ("Federbein VL", "kN", "", "federbein"),
        ("shock_rr", "N", "", "shock"),
        ("Stoßdämpferkraft HL", "N", "", "stoßdämpferkraft"),
        ("TieRodFL", "N", "", "tie"),
        ("Fz", "N", "Damper FL", "damper"),
        ("Strut FL Mx", "N m", "", "strut"),
        ("Bellows FL", "N", "", "bellows"),
    ],
)
def test_forces_of_struts_are_not_guessed_to_be_hub_forces(tmp_path, name, unit, family, reason):
    own = guess_channel(FileChannel(name, unit, "", 0, 10, None, family=family))
    assert own.at == "" and f"({reason}" in own.left_out
    own = guess_channel(FileChannel("Unheard of FL", "N", "", 0, 10, None))
    assert "'unheard'" in own.left_out
    t = np.arange(200) * 1e-2
    write_csv(tmp_path / "a.csv", t, **{"FL_Fz__N": t, f"{name}__{unit}": t})
    if not family:
        rows = tomllib.loads(describe(tmp_path / "a.csv"))["files"][0]["channels"]
        assert [row["channel"] for row in rows] == ["FL_Fz"]


@pytest.mark.parametrize(
    "name, unit, family, at",
    [
        ("Fz", "N", "WFT VL", "fl"),
        ("My", "N m", "Rear right wheel", "rr"),
        ("Instrument FR Fz", "N", "", "fr"),
        ("spring travel FL", "mm", "", "front left"),
        ("Radkraft vorne links", "N", "", "fl"),
    ],
)
def test_groups_and_words_that_only_sound_like_parts_are_guessed(name, unit, family, at):
    own = guess_channel(FileChannel(name, unit, "", 0, 10, None, family=family))
    assert own.at == at and not own.left_out


def test_what_show_prints_is_a_scene(tmp_path):
    t = np.arange(200) * 1e-2
    write_csv(tmp_path / "monday.csv", t, **{"FL_Fz__kN": t, "speed__km/h": t})
    table = tomllib.loads(describe(tmp_path / "monday.csv"))
    own = build(table, "monday.toml", tmp_path)
    assert [(row.channel, row.at) for row in own.files[0].channels] == [("FL_Fz", "fl")]


@pytest.mark.full
def test_from_the_road_to_the_page(tmp_path):
    own = build(
        {
            "title": "short",
            "system": "measured",
            "vehicle": {"file": "r19_free"},
            "virtual": {"duration": 0.6, "format": "csv", "sampling_rate": 500.0, "sections": ["front left"]},
            "hand_on": {"sections": ["front left", "fl hub"], "formats": ["csv"], "slopes": [5.0]},
        },
        "s.toml",
    )
    summary = run(own, ("mujoco",), tmp_path, lambda text, part: None)
    page = (tmp_path / "recording.html").read_text()
    assert summary["failed"] == {} and "<b>Accepted</b>" in page and page.count("<img") >= 5
    assert "http" not in page.replace("http-equiv", "")  # one file, that fetches nothing
    handed = open_source(tmp_path / "section_forces.csv")
    assert {channel.name for channel in handed.channels} == {"front left F", *(f"fl hub {axis}" for axis in AXES)}
    (block,) = handed.blocks(["front left F"])
    saved = load_result(tmp_path / "recording.nc").data
    assert saved["section_force"].values.tolist() == list(summary["channels"]) and saved.attrs["system"] == "measured"
    assert saved["greatest"].values[0] == block.values.max() and saved["damage"].shape == (7, 1)
    assert np.array_equal(saved["front left F"].values, block.values[:, 0]) and saved.attrs["run"] == "kalman"
    assert summary_scalars(summary)["front left F, max [N]"] == np.abs(block.values).max()  # what a sweep draws


AXES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def test_an_error_stops_the_run_and_the_page_says_so(tmp_path):
    t = np.arange(1000) * 2e-3
    loads = {"fl": 3228.0, "fr": 3228.0, "rl": 2723.2, "rr": 2723.2}
    noise = np.random.default_rng(1).standard_normal((4, 1000))
    columns = {f"{hub}__N": 1e-3 * load + 1e-3 * own for (hub, load), own in zip(loads.items(), noise, strict=True)}
    name = write_csv(tmp_path / "a.csv", t, **columns)  # in kN, and the file says N
    (tmp_path / "scene.toml").write_text("")
    own = scene(tmp_path, {"file": name, "channels": [force(hub, hub) for hub in loads]}, stabilise={"method": "none"})
    summary = run(own, ("mujoco",), tmp_path / "out", lambda text, part: None)
    page = (tmp_path / "out" / "recording.html").read_text()
    assert "checks" in summary["failed"] and "Stopped: nothing was run" in page and "kN" in page
    assert summary["channels"] == {}
    assert not (tmp_path / "out" / "section_forces.csv").exists()
