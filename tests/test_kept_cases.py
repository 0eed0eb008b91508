"""Cases of a report are measured once: what has ended is kept, what broke or was lost is measured again."""

import sys
import types
from concurrent.futures import ThreadPoolExecutor

import pytest

from models.core.errors import InputError
from validation.common.rows import Observed
from validation.run import Cases, measured_cases

NAMES = ("a_case", "bad_case", "one_more")


@pytest.fixture
def cases(monkeypatch):
    """Names of the cases as they are measured; ``bad_case`` breaks while its name is in ``broken``."""
    done, broken = [], {"bad_case"}

    def made(name):
        def measure(quick, folder):
            done.append(name)
            if name in broken:
                raise ValueError("no wheel")
            return [Observed(f"{name}.third", "drift", "a third", 1 / 3, "m").within(0.1, 0.5, "why", "native")], {
                "name": name
            }

        module = types.ModuleType(f"validation.cases.{name}")
        module.measure = measure
        return module

    for name in NAMES:
        monkeypatch.setitem(sys.modules, f"validation.cases.{name}", made(name))
    return done, broken


def go(folder, quick=True):
    (folder / "data").mkdir(exist_ok=True)
    told = []
    with ThreadPoolExecutor(2) as pool:
        return measured_cases(Cases(NAMES, quick, folder), pool, told.append), told


def test_a_report_goes_on_with_the_cases_that_have_not_ended(cases, tmp_path):
    done, broken = cases
    first, _ = go(tmp_path)
    row = first["bad_case"][0][0]
    assert sorted(done) == sorted(NAMES) and (row.id, row.status) == ("bad_case.broken", "failed")
    assert row.reason == "ValueError: no wheel"
    assert (tmp_path / "data" / "a_case.json").exists() and not (tmp_path / "data" / "bad_case.json").exists()
    done.clear()
    broken.clear()
    second, told = go(tmp_path)
    assert done == ["bad_case"] and told == [2, 3]
    assert second["a_case"] == first["a_case"] and second["bad_case"][0][0].value == 1 / 3


def test_another_share_is_not_mixed_with_what_is_kept(cases, tmp_path):
    go(tmp_path)
    with pytest.raises(InputError, match="quick"):
        go(tmp_path, quick=False)


def test_measured_files_that_came_later_are_not_mixed_either(cases, tmp_path, monkeypatch):
    monkeypatch.delenv("TWINRIG_DATA", raising=False)
    go(tmp_path)
    (tmp_path / "course.crg").write_text("x")
    monkeypatch.setenv("TWINRIG_DATA", str(tmp_path))
    with pytest.raises(InputError, match=r"measured files"):
        go(tmp_path)
