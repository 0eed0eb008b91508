"""Stabilisers of a force-excited run: the loads that a prescribed motion reveals, and effects that must be exact."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from models.core.noise import normal_samples
from models.core.result import Result
from models.core.signals import Sampled
from models.core.time_series import write_time_series
from models.engines.assembly import Assembly, Settings
from models.engines.stability import first_order, linearised
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene
from models.systems.pitch_plane.virtual_measurement import BuildFollower, follower_builder, write_measurement
from models.systems.pitch_plane.virtual_measurement import measure as measure_road
from models.vehicles.pitch_plane import Parameters
from validation.common import checks
from validation.common.checks import trajectory_gap
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.common.scenes import VEHICLE_SETS, on_paper_road, road_scene

TITLE = "Stabilisers"
SYSTEM: System = "drift"
STEP = 1e-3
MISSING_MASS_SHARE, CENTRE_SHIFT = 0.05, 0.02
"""Part of the chassis that the model lacks; how far (m) ahead of the truth its centre of mass lies."""
MEAN_BOUND = 1e-3
"""Of the predicted mean: forces linear between samples of 1 ms leave 1e-4."""
SEED, SENSOR = 37, np.deg2rad(0.1)
"""Seed of the noise on a measured pitch, and its standard deviation per sample (rad)."""
BANDWIDTHS = {5.0: 3097.0, 15.0: 1333.0}
"""Hz, with the rms moment (N m) that another zero-phase filter left on a like drive."""
CUT_OFF = 0.25
"""Of the high-pass, Hz."""
RAILS = {"prescribed_heave_and_pitch": {"file": "motion.csv"}}
CONSTRAINED = {"reference": "RK4", "exudyn": "GeneralizedAlpha", "mujoco": "RK4"}
EXPLICIT = {"exudyn": "RK44", "mujoco": "RK4"}
BAND = {"pitch_spring": {"stiffness": 3e3, "damping": 200.0, "dead_band": 0.01}}


@allowing_breaches("masses are wrong on purpose: what they leave to be held is what is measured")
@on_paper_road()
def measure(quick: bool, folder: Path) -> CaseAnswer:
    """Missing mass and misplaced centre on both vehicles; the rest on the asymmetric one; quick: half a second."""
    duration = 0.5 if quick else 10.0
    rows: list[Row] = []
    with TemporaryDirectory() as name:
        for parameters in VEHICLE_SETS:
            scene = road_scene(parameters, STEP, duration)
            measured, work = measure_road(scene), Path(name) / parameters
            work.mkdir()
            write_measurement(measured, work, STEP)
            follow, p = follower_builder(scene, work), scene.vehicle_parameters()
            rows += _missing_mass(parameters, p, measured, follow, work)
            rows += _shifted_centre(parameters, p, measured, follow, work)
        rows += [
            *_dead_band_and_moment(follow, min(duration, 4.0)),
            _high_pass(follow),
            *_bandwidth(measured, follow, work),
        ]
    return rows, {}


def write_motion(measured_run: Result, folder: Path, ahead: float = 0.0) -> None:
    """Write the pitch, and the heave of a point ``ahead`` (m) of the true centre of mass, to the file that guided
    scenes read."""
    pitch = measured_run["pitch"]
    columns = {"z3": ("m", measured_run["z3"] - ahead * np.sin(pitch)), "pitch": ("rad", pitch)}
    write_time_series(folder / "motion.csv", columns, STEP)


def guided(scene: Scene, engine: str) -> Result:
    """A run with prescribed motion, by the engine's integrator that can solve constraints."""
    return simulate(scene, engine, Settings(CONSTRAINED[engine], STEP, scene.run.duration, spectral_radius=0.6))


def _missing_mass(
    parameters: str, p: Parameters, measured_run: Result, build_follower: BuildFollower, folder: Path
) -> list[Row]:
    """Rows: if the model's chassis is 5 % too light, prescribing the heave takes a mean force of dm (g - z3'')."""
    write_motion(measured_run, folder)
    scene = build_follower({"m3": (1 - MISSING_MASS_SHARE) * p.m3}, RAILS)
    rate = measured_run["z3_rate"]
    mean = (rate[-1] - rate[0]) / scene.run.duration
    wanted = MISSING_MASS_SHARE * p.m3 * (p.g - mean)
    return [
        Observed(
            f"stabilisers.mass.{engine}.{parameters}",
            SYSTEM,
            f"{engine}, {parameters}: mean force that prescribes the heave, {MISSING_MASS_SHARE:.0%} of the "
            f"chassis missing (0.05 m3 g = {MISSING_MASS_SHARE * p.m3 * p.g:.1f} N)",
            float(guided(scene, engine)["enforced_force"].mean()),
            "N",
        ).within(
            wanted,
            MEAN_BOUND * wanted,
            f"0.05 m3 (g - z3''), down; z3'' is {mean:.3f} m/s^2 on average here",
            "closed form",
        )
        for engine in CONSTRAINED
    ]


def _shifted_centre(
    parameters: str, p: Parameters, measured_run: Result, build_follower: BuildFollower, folder: Path
) -> list[Row]:
    """Rows: if the model's centre of mass lies ahead of the true one, prescribing the motion takes a moment, nose
    up."""
    write_motion(measured_run, folder, CENTRE_SHIFT)
    scene = build_follower({"a": p.a + CENTRE_SHIFT, "b": p.b - CENTRE_SHIFT}, RAILS)
    wanted = CENTRE_SHIFT * float(np.mean((measured_run["f3"] + measured_run["f4"]) * np.cos(measured_run["pitch"])))
    return [
        Observed(
            f"stabilisers.centre.{engine}.{parameters}",
            SYSTEM,
            f"{engine}, {parameters}: mean moment that prescribes the pitch, centre of mass {CENTRE_SHIFT:g} "
            f"m too far ahead (m3 g x = {CENTRE_SHIFT * p.m3 * p.g:.1f} N m)",
            float(guided(scene, engine)["enforced_moment"].mean()),
            "N m",
        ).within(wanted, MEAN_BOUND * wanted, "x (f3 + f4) cos(pitch) of the true drive, nose up", "closed form")
        for engine in CONSTRAINED
    ]


def _dead_band_and_moment(build_follower: BuildFollower, duration: float) -> list[Row]:
    """Rows: a spring with a dead band, and an added moment, in both engines compared with the reference."""
    assembly = assembly_of_scene(build_follower({}, BAND))
    times = STEP * np.arange(round(duration / STEP) + 1)
    moment = Sampled(500.0 * np.sin(30.0 * times)[:, None], STEP, held=False)
    free = assembly_of_scene(build_follower({}, {}))
    laws: dict[str, tuple[Assembly, str]] = {
        "dead_band": (assembly, "a pitch spring with a dead band of 0.01 rad"),
        "moment": (free.with_moment(moment), "an added moment of 500 N m at 30 rad/s"),
    }
    return [
        Observed(
            f"stabilisers.{name}.{engine}",
            SYSTEM,
            f"{engine}, {words}: largest difference of any state from the reference",
            trajectory_gap(checks.engine(engine), law, Settings(integrator, STEP, duration)),
            "SI",
        ).at_most(1e-12, "the same stages see the same side of the band and the same moment", "native")
        for name, (law, words) in laws.items()
        for engine, integrator in EXPLICIT.items()
    ]


def _high_pass(build_follower: BuildFollower) -> Row:
    """Rows on the high-pass: the slow pole of the linearised vehicle with the filter is the filter's own."""
    corner, ratio = 2 * np.pi * CUT_OFF, 0.7
    vehicle = assembly_of_scene(build_follower({}, {"high_pass": {"cut_off": CUT_OFF, "damping_ratio": ratio}})).vehicle
    poles = np.linalg.eigvals(first_order(linearised(vehicle)))
    wanted = corner * complex(-ratio, np.sqrt(1 - ratio**2))
    off = float(np.abs(poles - wanted).min()) / corner
    return Observed(
        "stabilisers.high_pass",
        SYSTEM,
        f"high-pass at {CUT_OFF:g} Hz: distance of the vehicle's slow pole from that of s^2 + 2 zeta "
        "wc s + wc^2, over wc",
        off,
        "",
    ).at_most(
        0.01,
        "k = (I + J) wc^2, d = 2 zeta (I + J) wc; the wheels follow the chassis but for (wc / 20)^2, and "
        "unequal ends couple heave by (b m1 - a m2)^2 / (M (I + J))",
        "closed form",
    )


def _bandwidth(measured_run: Result, build_follower: BuildFollower, folder: Path) -> list[Row]:
    """Rows: stabilising moment by a pitch with the white noise of an inertial unit, raw and smoothed."""
    noise = SENSOR * normal_samples(SEED, 0, len(measured_run.times), 1)[:, 0]
    write_time_series(folder / "measured.csv", {"pitch": ("rad", measured_run["pitch"] + noise)}, STEP)
    file = {"file": "measured.csv"}
    runs = {
        bandwidth: guided(
            build_follower({}, {"prescribed_pitch": file | ({"bandwidth": bandwidth} if bandwidth else {})}),
            "reference",
        )
        for bandwidth in (None, *BANDWIDTHS)
    }
    rms = {bandwidth: float(np.sqrt(np.mean(run["enforced_moment"] ** 2))) for bandwidth, run in runs.items()}
    rows = [
        Observed(
            "stabilisers.bandwidth.raw",
            SYSTEM,
            "rms moment that prescribes a pitch with noise of 0.1 degrees per sample at 1 kHz",
            rms[None],
            "N m",
        ).beside(1e6, "I s sqrt(6) / T^2 and more: differentiated twice", "published")
    ]
    for bandwidth, published in BANDWIDTHS.items():
        off = float(np.abs(runs[bandwidth]["pitch"] - measured_run["pitch"]).max())
        rows.append(
            Observed(
                f"stabilisers.bandwidth.{bandwidth:g}",
                SYSTEM,
                f"rms moment that prescribes the noisy pitch smoothed to {bandwidth:g} Hz, which is "
                f"then off by at most {off:.4f} rad",
                rms[bandwidth],
                "N m",
            ).beside(
                published, "with another filter: a low one takes motion away, a high one leaves noise", "published"
            )
        )
    return rows
