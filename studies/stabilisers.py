"""Which stabiliser can be trusted: all of them on the same wrong model and noisy forces, scored by damage.

A virtual measurement on a road gives wheel forces, pitch and heave. A perturbed model is driven by these forces with
noise: free, with its pitch prescribed, held by springs, high-pass filtered, drawn to the estimate of a Kalman filter.
Every run is scored (models/drift/score.py), on the road as it is and on the same road with a grade, where
whatever keeps the pitch near zero is wrong. The first engine runs all methods, the others those that it accepts.
"""

import csv
import math
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError, RunFailed
from models.core.noise import PITCH_SENSOR, normal
from models.core.result import Result
from models.core.strict import Strict, quantity, read
from models.core.time_series import write_time_series
from models.core.whole_files import whole_file, write_whole
from models.drift.growth import holding_stiffness, rigid_pitch
from models.drift.score import (
    CHANNELS,
    COARSEST,
    LEAST,
    TUMBLED,
    Limits,
    blind_verdict,
    consistent,
    errors,
    own_figures,
    uncertainty,
    verdict,
)
from models.fatigue.damage import CONVENTION, SLOPE
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assemble, build
from models.systems.pitch_plane.trust import trust
from models.vehicles.pitch_plane import Parameters
from studies.virtual_measurement import PAPER, check_road, check_steps, follower, measure, stride, write_measurement

Progress = Callable[[str, float], None]
Row = dict[str, Any]

DAMPING = 0.7
"""Damping ratio of springs and high-pass filters."""


class Options(Strict):
    """[options] of this study."""

    sampling_rate: float = quantity("Hz", "rate at which forces and pitch are measured", default=1000.0)
    noise_fraction: float = quantity("", "standard deviation of the force noise by the largest force", default=0.002)
    angle_deviation: float = quantity("rad", "white noise on each measured pitch", default=math.radians(0.1))
    inertia_deviation: float = quantity("", "share by which the filter lets the inertia be wrong", default=0.05)
    factors: dict[str, float] = Field(PAPER, description="what the model's parameters are multiplied by")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of force and pitch noise")
    bandwidth: float = quantity("Hz", "of the prescribed measured pitch", default=15.0)
    stiffnesses: list[float] = Field([50.0, 100.0, 300.0, 1e4], min_length=1, description="springs, N m/rad")
    dead_band: float = quantity("rad", "half width of the dead band of the stiffest spring", default=0.05)
    cut_offs: list[float] = Field([0.1, 0.5], description="high-pass filters, Hz")
    sweep: list[float] = Field(
        np.geomspace(30.0, 3e5, 9).tolist(), min_length=1, description="springs of the second figure, N m/rad"
    )
    grade: float | None = Field(
        None, gt=-0.5, lt=0.5, description="slope angle of the second road", json_schema_extra={"unit": "rad"}
    )
    slope: float = quantity("", "Woehler exponent", default=SLOPE)
    limits: Limits = Limits()


def run(scene: Scene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """All methods on both roads; saves every road's files, ``score.csv``, ``table.txt`` and two figures."""
    check(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    benches = [Bench(own, road, options, folder) for road, own in _roads(scene, options).items()]
    rows: list[Row] = []
    failed: dict[str, str] = {}
    for i, bench in enumerate(benches):
        others = engines[1:] if i == 0 else ()
        rows += bench.score(engines[0], others, failed, partial(_part, progress, i, len(benches) + 1))
    progress("sweep of stiffness and cut-off", len(benches) / (len(benches) + 1))
    sweep = {bench.road: bench.sweep() for bench in benches}
    table = text(rows, benches, options)
    write_whole(folder / "table.txt", "\n".join(table) + "\n")
    _write_csv(folder / "score.csv", rows)
    from models.drawing.figures import save
    from studies.stabiliser_figures import decision, stiffness

    progress("figures", 1.0)
    own = [row for row in rows if row["engine"] == engines[0]]
    save(decision(own, options.limits, options.grade), folder / "decide.png")
    save(stiffness(sweep, benches[0], options.limits, options.grade), folder / "stiffness.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "rows": rows,
        "failed": failed,
        "table": table,
        "sweep": {road: found.tolist() for road, found in sweep.items()},
    }


def check(scene: Scene, engines: tuple[str, ...]) -> None:
    """Refuse, before anything is written, a scene that this study cannot follow through all its runs."""
    options = read(Options, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)
    check_steps(scene, engines)
    if scene.run.step > COARSEST or scene.run.duration < LEAST * scene.run.step:
        raise InputError(
            scene.file,
            "run",
            f"{scene.run.duration:g} s by {scene.run.step:g} s",
            f"the score takes {LEAST} steps or more, of {COARSEST:g} s or less",
        )
    for name, factor in options.factors.items():
        if name not in Parameters.model_fields:
            allowed = "not a parameter of the vehicle"
            raise InputError(scene.file, f"options.factors.{name}", factor, allowed, tuple(Parameters.model_fields))
    for name in ("stiffnesses", "cut_offs", "sweep"):
        for value in getattr(options, name):
            if not 0.0 < value < math.inf:
                raise InputError(scene.file, f"options.{name}", value, "must be above 0 and finite")
    for own in _roads(scene, options).values():
        assemble(own)


def _part(progress: Progress, done: int, parts: int, text: str, part: float) -> None:
    progress(text, (done + part) / parts)


def _roads(scene: Scene, options: Options) -> dict[str, Scene]:
    """The scene's own road, and where a grade is asked for, the same road on it."""
    if options.grade is None:
        return {"road": scene}
    table = scene.table()
    if "grade" in table["effects"]["road"]:
        allowed = "this study puts the road on options.grade itself: drop this key"
        raise InputError(scene.file, "effects.road.grade", table["effects"]["road"]["grade"], allowed)
    table["effects"]["road"]["grade"] = options.grade
    return {"road": scene, "grade": build(table, scene.file, Path(scene.folder))}


class Bench:
    """One road: what was measured on it, and the perturbed model's runs on these files."""

    def __init__(self, scene: Scene, road: str, options: Options, folder: Path) -> None:
        self.road, self.options, self.folder = road, options, folder / road
        self.folder.mkdir()
        every = stride(scene, options.sampling_rate)
        self.truth = measure(scene)
        largest = write_measurement(self.truth, options.sampling_rate, every, self.folder)
        self.deviation = options.noise_fraction * largest
        self._write_sensors(every)
        base = scene.vehicle_parameters()
        self.override = {name: getattr(base, name) * factor for name, factor in options.factors.items()}
        self.follow = follower(scene, self.folder)
        self.parameters = self.follow(self.override, {}).vehicle_parameters()
        self.methods = self._methods()
        self._predict()

    def _predict(self) -> None:
        """What is known before any run: until when a free one can be trusted (s), and which spring holds (N m/rad)."""
        free = assemble(self._scene({}))
        found = trust(free, self.options.limits.pitch_error)
        assert found is not None  # nothing holds a free run
        self.trusted = free.scene.run.duration if found.until is None else found.until[1]
        self.holding = holding_stiffness(self.parameters, found.rate)

    def _write_sensors(self, every: int) -> None:
        """Noisy pitch, and exact heave and pitch, as files."""
        period = 1.0 / self.options.sampling_rate
        heave, pitch = self.truth["z3"][::every], self.truth["pitch"][::every]
        noise = normal(self.options.seed, 0, len(pitch), 1, source=PITCH_SENSOR)[:, 0]
        noisy = {"pitch": ("rad", pitch + self.options.angle_deviation * noise)}
        write_time_series(self.folder / "measured_pitch.csv", noisy, period)
        both = {"z3": ("m", heave), "pitch": ("rad", pitch)}
        write_time_series(self.folder / "heave_and_pitch.csv", both, period)

    @property
    def resisting(self) -> float:
        """I + J in kg m^2: what a moment on the pitch has to turn."""
        return rigid_pitch(self.parameters).total

    def spring(self, stiffness: float) -> dict[str, float]:
        """Settings of a spring to the ground with its damper."""
        return {"stiffness": stiffness, "damping": 2.0 * DAMPING * math.sqrt(stiffness * self.resisting)}

    def _methods(self) -> dict[str, dict[str, Any]]:
        """Name -> effects beside forces and noise."""
        own, noisy = self.options, "measured_pitch.csv"
        sure = {"file": noisy, "pitch_deviation": own.angle_deviation, "force_deviation": self.deviation}
        filtered = {**sure, "inertia_deviation": own.inertia_deviation}
        smoothed = {"file": noisy, "bandwidth": own.bandwidth}
        springs = {f"spring {k:g} N m/rad": {"pitch_spring": self.spring(k)} for k in own.stiffnesses}
        stiffest = max(own.stiffnesses)
        banded = {"pitch_spring": {**self.spring(stiffest), "dead_band": own.dead_band}}
        passes = {f"high-pass {f:g} Hz": {"high_pass": {"cut_off": f, "damping_ratio": DAMPING}} for f in own.cut_offs}
        return {
            "free": {},
            "exact pitch prescribed": {"prescribed_pitch": {"file": "pitch.csv"}},
            "exact heave and pitch": {"prescribed_heave_and_pitch": {"file": "heave_and_pitch.csv"}},
            f"measured pitch to {own.bandwidth:g} Hz": {"prescribed_pitch": smoothed},
            **springs,
            f"{stiffest:g} beyond {own.dead_band:g} rad": banded,
            **passes,
            "Kalman, sure of the model": {"kalman_filter": sure},
            "Kalman filter": {"kalman_filter": filtered},
            "Kalman smoother": {"kalman_filter": {**filtered, "smoother": True}},
        }

    def score(self, engine: str, others: tuple[str, ...], failed: dict[str, str], progress: Progress) -> list[Row]:
        """A row per method in one engine, and in the others if it is accepted; ``failed`` takes runs that fail."""
        rows: list[Row] = []
        self.simulate(engine, {})  # compiles what is not compiled yet, so that no row pays for it
        for i, (name, effects) in enumerate(self.methods.items()):
            progress(f"{engine}, {self.road}: {name}", i / len(self.methods))
            own = self._scored(engine, name, effects, failed)
            rows += own
            if own and (name == "free" or own[0]["verdict"] == "accepted"):
                rows += [row for other in others for row in self._scored(other, name, effects, failed)]
        return rows

    def _scored(self, engine: str, name: str, effects: dict[str, Any], failed: dict[str, str]) -> list[Row]:
        """One row, or none for a run that fails."""
        start = time.perf_counter()
        try:
            found = self.simulate(engine, effects)
        except RunFailed as error:
            failed[f"{engine}, {self.road}, {name}"] = str(error)
            return []
        seconds = time.perf_counter() - start
        return [{"engine": engine, "road": self.road, **self.row(name, effects, found), "seconds": seconds}]

    def simulate(self, engine: str, effects: dict[str, Any]) -> Result:
        """A run of the perturbed model under noisy forces."""
        return simulate(self._scene(effects), engine)

    def _scene(self, effects: dict[str, Any]) -> Scene:
        noise = {"force_noise": {"deviation": self.deviation, "seed": self.options.seed}}
        return self.follow(self.override, noise | effects)

    def row(self, name: str, effects: dict[str, Any], run: Result) -> Row:
        """Figures and verdicts; a tumbled run has no damage that could mislead."""
        limits = self.options.limits
        own, wrong = own_figures(run, self.parameters), errors(run, self.truth, self.options.slope)
        with_truth = verdict(own, wrong, effects, limits)
        alone = blind_verdict(
            own, effects, float(run.times[-1]), limits, self.trusted, consistent(run), uncertainty(run)
        )
        loads = {f"damage {channel}": wrong.damage[channel] for channel in CHANNELS}
        loads |= {f"error {channel} [N]": wrong.force_rms[channel] for channel in CHANNELS}
        return {
            "method": name,
            **(dict.fromkeys(loads) if own.pitch_max > TUMBLED else loads),
            "vertical damage f3": wrong.vertical_damage["f3"],
            "vertical damage f4": wrong.vertical_damage["f4"],
            "pitch error max [rad]": wrong.pitch_max,
            "pitch error rms [rad]": wrong.pitch_rms,
            "heave error max [m]": wrong.heave_max,
            "moment rms [N m]": own.moment_rms,
            "moment max [N m]": own.moment_max,
            "moment share": own.moment_share,
            "moment share to 15 Hz": own.moment_share_band,
            "force share to 15 Hz": own.force_share_band,
            "force calls": own.force_calls,
            "steps": own.steps,
            "verdict": with_truth.word,
            "reason": with_truth.reason,
            "without truth": alone.word,
            "reason without truth": alone.reason,
        }

    def sweep(self) -> np.ndarray:
        """(n, 4): stiffness, largest pitch error of the spring, of the high-pass, worst damage ratio of the spring."""
        return np.array([self._swept(stiffness) for stiffness in self.options.sweep])

    def _swept(self, stiffness: float) -> tuple[float, float, float, float]:
        cut_off = math.sqrt(stiffness / self.resisting) / (2.0 * math.pi)
        sprung = self.simulate("reference", {"pitch_spring": self.spring(stiffness)})
        passed = self.simulate("reference", {"high_pass": {"cut_off": cut_off, "damping_ratio": DAMPING}})
        found, other = (errors(one, self.truth, self.options.slope) for one in (sprung, passed))
        worst = max(found.damage.values(), key=lambda ratio: abs(math.log(ratio)))
        return stiffness, found.pitch_max, other.pitch_max, worst


def text(rows: list[Row], benches: list[Bench], options: Options) -> list[str]:
    """The table as lines of text, a block per engine and road."""
    lines = [
        f"  Damage ratios: {CONVENTION}, exponent {options.slope:g}. Accepted: all four body-frame ratios within "
        f"{options.limits.damage_error:.0%},",
        f"  pitch within {options.limits.pitch_error:g} rad, artificial moment up to 15 Hz at most "
        f"{options.limits.artificial_share:.0%} of I pitch''. The vertical f3 is never judged: it is blind.",
        "  * seconds by those of the free run, each run once",
    ]
    for engine, road in dict.fromkeys((row["engine"], row["road"]) for row in rows):
        own = [row for row in rows if (row["engine"], row["road"]) == (engine, road)]
        bench = next(bench for bench in benches if bench.road == road)
        where = "the road" if road == "road" else f"a grade of {options.grade:g} rad"
        free = next(row["seconds"] for row in own if row["method"] == "free")
        lines += [
            "",
            f"  {engine} on {where}: force noise {bench.deviation:.1f} N; predicted beforehand: a free run "
            f"can be trusted for {bench.trusted:.1f} s, springs hold from {bench.holding:.0f} N m/rad on",
        ]
        lines += [HEADS, UNITS]
        lines += [_line(row, free) for row in own]
    return lines


HEADS = (
    f"  {'':<25}{'damage ratio':^28}{'vertical':>9}{'pitch error':>16}{'artificial moment':>21}{'cost':>8}"
    f"{'verdict':>11}{'without':>11}"
)
UNITS = (
    f"  {'method':<25}{'f3x':>7}{'f3z':>7}{'f4x':>7}{'f4z':>7}{'f3':>9}{'max':>9}{'rms':>7}"
    f"{'rms':>7}{'max N m':>8}{'share':>6}{'x free*':>8}{'':>11}{'truth':>11}"
)


def _line(row: Row, free: float) -> str:
    ratios = "".join(f"{_ratio(row[f'damage {channel}']):>7}" for channel in CHANNELS)
    return (
        f"  {row['method']:<25}{ratios}{_ratio(row['vertical damage f3']):>9}{row['pitch error max [rad]']:>9.4f}"
        f"{row['pitch error rms [rad]']:>7.4f}{row['moment rms [N m]']:>7.0f}{row['moment max [N m]']:>8.0f}"
        f"{row['moment share to 15 Hz']:>6.0%}{row['seconds'] / free:>8.1f}{row['verdict']:>11}"
        f"{row['without truth']:>11}"
    )


def _ratio(value: float | None) -> str:
    """A damage ratio in six characters; none for a tumbled run."""
    return "-" if value is None else f"{value:.3f}" if value < 10 else f"{value:.1f}" if value < 1e3 else f"{value:.0e}"


def _write_csv(path: Path, rows: list[Row]) -> None:
    with whole_file(path) as part, part.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    from studies.command_line import study

    study("stabilisers")
