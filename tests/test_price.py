"""Work-precision runner: its analysis on curves whose answer is known, and planted solvers that lie."""

import json
import math
from dataclasses import asdict, dataclass, replace

import numpy as np
import pytest

from models.advice.price import curves
from models.advice.price import runner as cost
from models.advice.price.problem import Setting
from models.core.errors import Refused, RunFailed
from models.machine.timing import interleave, paired_ratio, timing_statistics
from validation.price.rows import rows_of
from validation.price.tables import rounds_sentence, tables

STEPS = (8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)


@dataclass
class Solution:
    error: float
    counts: dict[str, int]
    doubt: str


@dataclass
class Planted:
    """A solver with error = scale h^order, ``stages`` calls a step, and one vice."""

    setting: Setting
    scale: float
    vice: str

    def run(self):
        h = self.setting.value
        if self.vice == "raises":
            raise RunFailed("planted", "the state became infinite", 0.5)
        error = {"huge": 1e9, "nan": math.nan}.get(self.vice, self.scale * h**self.setting.order)
        steps = round(1.0 / h)
        calls = self.setting.stages * steps + (1 if self.vice == "miscounts" else 0)
        doubt = "beyond what it is good for" if self.vice == "doubts" else ""
        return Solution(error, {"steps": steps, "force calls": calls}, doubt)


class PlantedProblem:
    """Order 4 with 4 stages against order 1 with 1, both with error 1 N at 8 ms."""

    key, title, note, duration, reference, bound = "planted", "planted", "", 1.0, "closed form", 1e6
    units, uncertainty, tolerances = {"force": "N"}, {"force": 1e-9}, (0.1, 0.01, 1e-3)

    def __init__(self, vice="none", at=1e-3):
        self.vice, self.at = vice, at

    def setting(self, engine, method, value):
        order = {"fourth": 4, "first": 1}[method]
        return Setting(engine, method, value, order, stages=order, default="planted" if method == "first" else "")

    def settings(self, quick):
        return tuple(self.setting("exudyn", method, h) for method in ("fourth", "first") for h in STEPS)

    def build(self, setting):
        bad = setting.method == "fourth" and setting.value == self.at
        if bad and self.vice == "refuses":
            raise Refused("planted", "it would answer wrongly")
        return Planted(setting, (1 / STEPS[0]) ** setting.order, self.vice if bad else "none")

    def errors(self, solution):
        return {"force": solution.error}


def measured_of(problem):
    return cost.measure(problem, False, 3, 0.0)


def with_points(points):
    """The planted problem with these points."""
    return cost.measured_points(PlantedProblem(), points)


def test_order_of_synthetic_curves():
    steps = np.array(STEPS)
    for order in (1, 2, 4):
        assert curves.log_log_slope(steps, 7 * steps**order) == pytest.approx(order, abs=1e-12)


def test_hollow_points_do_not_enter_the_order():
    """A floor of 1e-6 bends a fourth-order curve; the points above it still say 4."""
    steps = np.array(STEPS)
    errors = np.maximum(1e6 * steps**4, 1e-6)
    assert curves.observed_order(steps, errors, error_floor=1e-5) == pytest.approx(4, abs=1e-12)
    assert curves.observed_order(steps, errors, error_floor=0.0) < 3
    assert math.isnan(curves.observed_order(steps, errors, error_floor=1e9))


def test_coinciding_curves_are_named():
    base = {h: h**4 for h in STEPS}
    found = curves.coinciding_curves(
        {
            "a": base,
            "b": {h: 1.009 * e for h, e in base.items()},
            "c": {h: 1.05 * e for h, e in base.items()},
            "two points": {h: base[h] for h in STEPS[:2]},
        }
    )
    assert found == [("a", "b")], "1 % is the same, 5 % is not, two common points prove nothing"


def test_cheapest_setting_is_interpolated():
    """error = h^2, calls = 1 / h: 1e-5 needs h = 10^-2.5 and 10^2.5 calls, between the settings tried."""
    steps = [1e-1, 1e-2, 1e-3]
    found = curves.cost_at_tolerance(steps, [h**2 for h in steps], [1 / h for h in steps], 1e-5, convergence_order=2)
    assert found.origin == "interpolated"
    assert (found.cost, found.value) == pytest.approx((10**2.5, 10**-2.5), rel=1e-12)


def test_beyond_the_finest_setting():
    steps = [1e-1, 1e-2]
    table = steps, [h**2 for h in steps], [1 / h for h in steps]
    assert curves.cost_at_tolerance(*table, 1e-6, convergence_order=2) is None
    found = curves.cost_at_tolerance(*table, 1e-6, convergence_order=2, extrapolate=True)
    assert (found.cost, found.origin) == (pytest.approx(1000, rel=1e-12), "extrapolated")
    assert curves.cost_at_tolerance(*table, 1.0, convergence_order=2).origin == "coarsest"


def test_adaptive_methods_count_only_where_tried():
    found = curves.cost_at_tolerance([1e-2, 1e-4], [1.0, 1e-3], [10.0, 20.0], 0.1, convergence_order=0)
    assert (found.cost, found.value, found.origin) == (20.0, 1e-4, "tried")
    assert (
        curves.cost_at_tolerance([1e-2, 1e-4], [1.0, 1e-3], [10.0, 20.0], 1e-4, convergence_order=0, extrapolate=True)
        is None
    )


def test_a_lucky_coarse_setting_does_not_count():
    """The curve dips below 0.1 at 0.4 and comes back: only the last crossing promises anything."""
    found = curves.cost_at_tolerance(
        [0.8, 0.4, 0.2, 0.1], [1.0, 0.05, 0.2, 0.01], [1.0, 2.0, 4.0, 8.0], 0.1, convergence_order=1
    )
    assert 4.0 < found.cost < 8.0


def test_pareto_front():
    assert curves.pareto_front([1, 2, 3, 4], [10, 20, 1, 0.999]) == [0, 2], "0.1 % better is not better"


@pytest.mark.parametrize(
    ("vice", "status"),
    [
        ("huge", "SILENT"),
        ("nan", "SILENT"),
        ("raises", "raised"),
        ("refuses", "refused"),
        ("doubts", "flagged"),
        ("none", "ok"),
    ],
)
def test_status(vice, status):
    problem = PlantedProblem(vice)
    point = cost.attempt(problem, problem.setting("exudyn", "fourth", 1e-3))
    assert point.status == status
    assert bool(point.reason) == (status != "ok")


@pytest.mark.parametrize(("vice", "row"), [("huge", "silent"), ("nan", "silent"), ("miscounts", "counts.said")])
def test_a_lying_solver_fails_its_row(vice, row):
    for planted, expected in (("none", "passed"), (vice, "failed")):
        problem = PlantedProblem(planted)
        rows = {one.id: one for one in rows_of(problem, measured_of(problem), is_quick=False)}
        assert rows[f"price.planted.{row}"].status == expected
    assert "exudyn fourth 1 ms" in rows[f"price.planted.{row}"].quantity, "the row names the offender"


def test_a_run_that_counts_otherwise_when_repeated_fails_its_row():
    class Restless(PlantedProblem):
        """Its finest first-order setting takes a call more each time."""

        calls = 0

        def build(self, setting):
            planted = super().build(setting)
            if setting.method == "first" and setting.value == STEPS[-1]:
                self.calls += 1
                solution = planted.run()
                solution.counts["force calls"] += self.calls
                planted.run = lambda: solution
            return planted

    for problem, expected in ((PlantedProblem(), "passed"), (Restless(), "failed")):
        rows = {one.id: one for one in rows_of(problem, measured_of(problem), is_quick=True)}
        assert rows["price.planted.counts.repeat"].status == expected
    assert "exudyn first 0.25 ms" in rows["price.planted.counts.repeat"].quantity


def test_parts_of_a_step_from_three_runs():
    """A step of 10 us: 4 in the engine, 1 over the bridge, 5 in the kernel, in the median round."""
    from validation.price import split

    noise, seconds = np.array([1.3, 1.0, 1.1]), 1e-6 * split.STEPS["road"]
    runs = zip(split.FORCE_VARIANTS, (4, 5, 10), strict=True)
    saved = {
        "problem": "road",
        "engine": "mujoco",
        "seconds": {run: (total * seconds * noise).tolist() for run, total in runs},
    }
    assert split.step_parts(saved) == pytest.approx([4.4, 1.1, 5.5])
    assert split.bridge_share(saved) == pytest.approx((10, 10, 10))
    assert split.table([saved], "road")[0].rows[0][2:5] == ("4.40", "1.10", "5.50")
    assert split.table([saved], "wheel") == []


def test_a_wrong_order_fails_its_row():
    problem = PlantedProblem()
    points = [
        p
        if p.setting.method == "first"
        else cost.WorkPrecisionPoint(p.setting, p.status, "", {"force": p.setting.value**3}, p.counts, p.seconds)
        for p in measured_of(problem).points
    ]
    rows = {one.id: one for one in rows_of(problem, with_points(points), is_quick=True)}
    assert rows["price.planted.order.force.exudyn-fourth"].status == "failed"
    assert rows["price.planted.order.force.exudyn-first"].status == "passed"


def test_what_a_default_loses():
    """1e-3 N: first order needs 1000 times 125 calls, fourth order 1000^(1/4) times 500: 44.5 times."""
    found = measured_of(PlantedProblem()).loss_by_default(1e-3, "force calls", "exudyn first")
    assert found.origin == "extrapolated"
    assert found.cost_ratio == pytest.approx(125_000 / (500 * 1000**0.25), rel=1e-9)
    assert found.lower_limit == found.upper_limit == found.cost_ratio, "counts have no interval"


def test_an_interval_needs_rounds():
    """One round has a factor, but nothing to tell how sure it is: its interval would be of width 0, as if exact."""
    points = [replace(p, seconds=(p.counts["force calls"] * 1e-6,)) for p in measured_of(PlantedProblem()).points]
    one = with_points(points).loss_by_default(1e-3, "seconds", "exudyn first")
    assert one.cost_ratio > 1 and math.isnan(one.lower_limit) and math.isnan(one.upper_limit)
    five = [replace(p, seconds=p.seconds * cost.FEWEST_TIMING_ROUNDS) for p in points]
    assert with_points(five).loss_by_default(1e-3, "seconds", "exudyn first").lower_limit == pytest.approx(
        one.cost_ratio
    )


def timed(factor=1.0, once=()):
    """Both curves at 1 us a call, the first-order one ``factor`` times that, 15 rounds with 5 % noise of their own;
    those with a step in ``once`` with the first of them alone."""
    random, found = np.random.default_rng(11), []
    for p in [cost.attempt(PlantedProblem(), setting) for setting in PlantedProblem().settings(False)]:
        slow = factor if p.setting.method == "first" else 1.0
        seconds = slow * 1e-6 * p.counts["force calls"] * np.exp(random.normal(0, 0.05, 15))
        kept = seconds[:1] if p.setting.value in once else seconds
        found.append(replace(p, seconds=tuple(kept.tolist()), changed=False))
    return found


def test_a_slowed_setting_is_noticed():
    """1 N takes 125 calls of first order and 500 of fourth: slowed fourfold they take the same seconds, sixfold half as
    many again, by the interval of 15 rounds of 5 % noise, which is 4 % each way."""
    for factor, slower in ((4.0, False), (6.0, True)):
        found = with_points(timed(factor)).loss_by_default(1.0, "seconds", "exudyn first")
        assert found.cost_ratio == pytest.approx(factor / 4, rel=0.1)
        assert (found.lower_limit > 1.05) == slower, "slower beyond doubt, or not"


def test_rounds_are_for_settings_that_decide_something():
    """A method with ten times the seconds of the fourth-order one wins nothing; with 1.2 times it may."""
    points = timed()
    fourth = [p for p in points if p.setting.method == "fourth"]
    for longer, expected in ((10.0, False), (1.2, True)):
        third = [
            replace(p, setting=replace(p.setting, method="third"), seconds=(longer * p.cost("seconds"),))
            for p in fourth
        ]
        chosen = {p.setting.curve for p in with_points(points + third).points_to_time()}
        assert {"exudyn fourth", "exudyn first"} <= chosen
        assert ("exudyn third" in chosen) == expected


def test_a_slow_run_is_not_repeated_in_few_rounds(monkeypatch):
    """Three rounds, of which a slow setting is in the first: that is the run that has been."""
    monkeypatch.setattr(cost, "SLOW_RUN_DURATION", 0.0)
    points = cost.measure(PlantedProblem(), True, cost.FEWEST_TIMING_ROUNDS - 2, 0.0).points
    assert {(len(p.seconds), p.changed) for p in points} == {(1, None)}
    points = cost.measure(PlantedProblem(), False, 2 * cost.FEWEST_TIMING_ROUNDS - 1, 0.0).points
    assert {len(p.seconds) for p in points if p.changed is False} == {cost.FEWEST_TIMING_ROUNDS}


def test_no_interval_from_one_run():
    found = with_points(timed(once=STEPS[-1:])).loss_by_default(1e-3, "seconds", "exudyn first")
    assert found.cost_ratio > 10 and math.isnan(found.lower_limit), "its finest step has one run alone"


def test_a_job_takes_part_in_some_rounds():
    calls = []
    jobs = [lambda i=i: calls.append(i) for i in range(2)]
    seconds = interleave(jobs, 15, 0.0, warm_up_times=[1.0, 7.0], round_interval=[1, 3])
    assert (calls.count(0), calls.count(1), seconds[1, 0]) == (15, 4, 7.0), "the run that has been is its first"
    assert np.flatnonzero(np.isfinite(seconds[0])).size == 15
    assert np.flatnonzero(np.isfinite(seconds[1])).tolist() == [0, 3, 6, 9, 12]


def test_a_job_that_has_not_been_is_timed_in_its_first_round():
    seconds = interleave([lambda: sum(range(100))], 8, 1e-5, round_interval=[4])
    assert (seconds[0, [0, 4]] > 0.0).all(), "no run of no seconds, which would be the least"


def test_rounds_are_told():
    points = [replace(p, changed=None, seconds=p.seconds[:1]) if p.setting.method == "first" else p for p in timed()]
    assert rounds_sentence(points).startswith("Seconds are medians of 15 interleaved rounds for 6 settings")
    assert "one run for 6" in rounds_sentence(points)


def test_tables_come_from_saved_points():
    problem = PlantedProblem("raises")
    saved = json.loads(json.dumps(asdict(measured_of(problem))))
    found = {table.title: table for table in tables(cost.points_from_saved(saved))}
    cheapest = found["Cheapest setting that meets the tolerance"].rows[0]
    assert cheapest[0] == "0.1"
    assert cheapest[1].startswith("Exudyn fourth, 4.5 ms"), "0.1^(1/4) 8 ms = 4.499 ms"
    assert found["Settings that gave no answer to rely on"].rows[0][:3] == ("Exudyn fourth", "1 ms", "raised")
    for table in found.values():
        assert all(len(row) == len(table.headings) for row in table.rows)


def test_interval_of_a_paired_ratio_covers_it():
    """Two jobs in a ratio of 1.5, sharing the drift of the machine, 10 % noise of their own: 200 experiments.

    A 95 % bootstrap interval of a median of 15 covers in 93 to 97 %; 178 of 200 would be 4 standard errors low.
    """
    random = np.random.default_rng(3)
    covered = 0
    for _ in range(200):
        drift = np.exp(random.normal(0, 0.5, 15))
        a, b = 1.5 * drift * np.exp(random.normal(0, 0.1, 15)), drift * np.exp(random.normal(0, 0.1, 15))
        ratio, low, high = paired_ratio(a, b)
        assert low <= ratio <= high
        covered += low <= 1.5 <= high
    assert 178 <= covered <= 200


def test_interleaving_runs_every_job_in_every_round():
    calls = []
    seconds = interleave([lambda i=i: calls.append(i) for i in range(3)], rounds=20, minimum_seconds=0.0)
    assert seconds.shape == (3, 20)
    assert (seconds >= 0).all()
    rounds = np.array(calls[-60:]).reshape(20, 3)
    assert (np.sort(rounds, axis=1) == [0, 1, 2]).all()
    assert len({tuple(one) for one in rounds}) == 6, "all orders of three jobs occur in 20 rounds"


def test_description_of_seconds():
    assert timing_statistics([3.0, 1.0, 2.0, 10.0, 2.0]) == {"median": 2.0, "mad": 1.0, "min": 1.0}


def test_force_calls_seen_from_outside():
    """Each adapter's counts against MuJoCo's timers and Exudyn's own calls of a load, 50 steps each."""
    from models.systems.pitch_plane.scene import assembly_of_scene
    from validation.price.force_calls import counted_calls
    from validation.price.problems.road_excited import scene, setting, settings_of

    assembly = assembly_of_scene(scene())
    for engine, method, stages in (
        ("mujoco", "RK4", 4),
        ("mujoco", "Euler", 1),
        ("exudyn", "RK44", 4),
        ("exudyn", "RK67", 7),
        ("exudyn", "VelocityVerlet", 1),
    ):
        assert counted_calls(engine, assembly, settings_of(setting(engine, method, 1e-3), 0.05)) == (
            50 * stages,
            50 * stages,
        )
    outside, said = counted_calls(
        "exudyn", assembly, settings_of(setting("exudyn", "GeneralizedAlpha 0.9", 1e-3), 0.05)
    )
    assert outside == said > 50


def test_every_integrator_of_the_catalogue_is_tried():
    from models.engines.catalogue import CATALOGUE
    from validation.price.problems.road_excited import DEFAULT_SETTING_OWNERS, FULL_STEPS, QUICK_STEPS

    tried = {(engine, method.split()[0]) for engine, method in FULL_STEPS}
    assert tried == {(engine, name) for engine, names in CATALOGUE.items() for name in names}
    for engine, method, value in DEFAULT_SETTING_OWNERS:
        assert value in FULL_STEPS[engine, method], "a default is left out of the full sweep"
        assert value in QUICK_STEPS[engine, method], "a default is left out of the quick one"
    assert all(set(values) <= set(FULL_STEPS[curve]) for curve, values in QUICK_STEPS.items())


def test_defaults_are_those_of_the_installed_engines():
    import exudyn
    import mujoco

    from models.advice.price.systems.pitch_plane import SPECTRAL_RADII
    from validation.price.problems.road_excited import DEFAULT_SETTING_OWNERS

    ti, option = exudyn.SimulationSettings().timeIntegration, mujoco.MjOption()
    assert DEFAULT_SETTING_OWNERS["exudyn", "GeneralizedAlpha 0.9", ti.endTime / ti.numberOfSteps] == "Exudyn"
    assert SPECTRAL_RADII["GeneralizedAlpha 0.9"] == ti.generalizedAlpha.spectralRadius
    assert DEFAULT_SETTING_OWNERS["mujoco", "Euler", option.timestep] == "MuJoCo"
    assert option.integrator == mujoco.mjtIntegrator.mjINT_EULER


def test_every_force_in_one_callback_gives_the_native_path():
    from models.engines.assembly import Settings
    from models.engines.protocol import build
    from models.systems.pitch_plane.scene import assembly_of_scene
    from validation.common.scenes import VEHICLE_SETS, road_scene
    from validation.price.compiled_forces import CompiledForces

    settings = Settings("RK4", 1e-3, 0.5)
    for parameters in VEHICLE_SETS:
        assembly = assembly_of_scene(road_scene(parameters, duration=0.5))
        native = build("mujoco", assembly, settings).run().states
        assert np.abs(CompiledForces(assembly, settings).run() - native).max() < 1e-12
