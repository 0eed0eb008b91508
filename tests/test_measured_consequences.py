"""Verdicts on recordings follow from what their findings do to the section forces, held against planted truth."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from models.core.finding import Finding
from models.drift.score import StabilisedRunVerdict, root_mean_square
from models.fatigue.damage import WOEHLER_SLOPE, damage_ratio
from models.measured.faults_of_measurement import SimulatedFaults
from models.measured.recording import Recording
from models.systems.measured.consequences import (
    DAMAGE_LIMITS,
    FORCE_LIMITS,
    Consequence,
    consequences,
    verdict_with_consequences,
)
from models.systems.measured.section_run import AttitudeHold, SectionOutcome, SectionRunSettings, run
from models.systems.measured.sections import Sections
from models.systems.measured.virtual import VirtualMeasurement, recording_of_samples
from validation.measured import planted as bench

SECTION = "rear right F"


@pytest.fixture(scope="module")
def ridden() -> VirtualMeasurement:
    """Five seconds of a car on a road."""
    return bench.measurement(road=("C", 1, 20.0, 5.0))


def made(ridden: VirtualMeasurement, own: Recording, folder: Path) -> SectionOutcome:
    """The run with the filter."""
    return run(SectionRunSettings(ridden.vehicle, own, Sections(ridden.vehicle), hold=AttitudeHold()), folder / "run")


def of(ridden: VirtualMeasurement, faults: dict, finding: Finding, folder: Path) -> tuple[Consequence, float, float]:
    """The consequence of a finding, and what the planted fault really does to the force of a spring."""
    samples = [ridden.samples(SimulatedFaults(**one, noise=bench.NOISE), bench.SEED) for one in (faults, {})]
    own, right = (recording_of_samples(ridden, values, folder / f"{i}.columns") for i, values in enumerate(samples))
    answers = [a for a in Sections(ridden.vehicle).answers if a.name == SECTION]
    (found,) = consequences([finding], own, partial(made, ridden), answers, folder / "work")
    wrong, true = (
        made(ridden, each, folder / name).samples(answers[0])[500:] for each, name in ((own, "wrong"), (right, "true"))
    )
    return (
        found,
        root_mean_square(wrong - true) / root_mean_square(true - true.mean()),
        damage_ratio(wrong, true, WOEHLER_SLOPE),
    )


def named(ridden: VirtualMeasurement, check: str, size: float, unit: str, hub: str) -> Finding:
    names = tuple(s.name for s in ridden.signals if s.at == hub)
    return Finding(check, "doubt", hub, "planted", size, unit, names)


@pytest.mark.parametrize("late, grade", [(10e-3, 2), (0.6e-3, 0)])
def test_a_late_wheel_is_judged_by_what_it_does(late, grade, ridden, tmp_path):
    found, force, damage = of(ridden, {"delay": {"rr": late}}, named(ridden, "shift", late, "s", "rr"), tmp_path)
    # noise of the forces is read later, too: a hundredth of the force
    assert found.force == pytest.approx(force, rel=0.1, abs=0.01)
    assert found.damage == pytest.approx(damage, rel=0.05) and found.grade == grade


def test_a_wrong_factor_is_judged_by_what_it_does(ridden, tmp_path):
    found, force, damage = of(ridden, {"gain": {"rr": 0.08}}, named(ridden, "gain", 8.0, "%", "rr"), tmp_path)
    assert found.force == pytest.approx(force, rel=0.1, abs=0.01) and found.damage == pytest.approx(damage, rel=0.05)
    assert found.grade == 2  # 8 % of an amplitude are 47 % of damage


def test_lost_samples_are_judged_by_what_their_bridging_is_known_to(ridden, tmp_path):
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE), bench.SEED)
    grades = []
    for length, every in ((2, 1000), (40, 60)):
        lossy = samples.copy()
        own = [i for i, s in enumerate(ridden.signals) if s.at == "rr"]
        for first in range(200, len(samples) - 100, every):
            lossy[first : first + length, own] = np.nan
        folder = tmp_path / str(length)
        folder.mkdir()
        answers = [a for a in Sections(ridden.vehicle).answers if a.name == SECTION]
        silent = recording_of_samples(ridden, lossy, folder / "a.columns")
        finding = named(ridden, "gaps", 0.0, "s", "rr")
        (found,) = consequences([finding], silent, partial(made, ridden), answers, folder / "work")
        grades.append(found.grade)
    assert grades[0] == 0 and grades[1] > 0


def test_words_follow_the_bounds():
    finding, good = Finding("shift", "doubt", "fl", ""), StabilisedRunVerdict("accepted", "held")
    one = Consequence(finding, "a", FORCE_LIMITS[0], 1.0 + 0.9 * DAMAGE_LIMITS[0])
    several = (
        one,
        replace(one, force=2 * FORCE_LIMITS[0]),
        replace(one, damage=0.7),
        replace(one, force=2 * FORCE_LIMITS[1]),
        Consequence(finding),
    )
    words = [verdict_with_consequences(good, [each]).word for each in several]
    assert words == ["accepted", "accepted with doubt", "rejected", "rejected", "accepted with doubt"]
    assert (
        verdict_with_consequences(good, []) is good
        and verdict_with_consequences(StabilisedRunVerdict("stabilise", ""), [one]).word == "stabilise"
    )
