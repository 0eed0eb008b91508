"""Stabilisers of a force-excited run: forces and moments that reveal wrong masses, and effects that must be exact."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from models.core.noise import normal_samples
from models.core.result import Result
from models.core.signals import SampledSignal
from models.core.time_series import write_time_series
from models.engines.assembly import Assembly, Settings
from models.engines.stability import first_order, linearised_matrices
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene
from models.systems.pitch_plane.virtual_measurement import BuildFollower, follower_builder, write_measurement
from models.systems.pitch_plane.virtual_measurement import measure as measure_road
from models.vehicles.pitch_plane import PitchPlaneParameters
from validation.common import checks
from validation.common.checks import trajectory_gap
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.common.scenes import VEHICLE_SETS, on_paper_road, road_scene

TITLE = "Stabilisers"
SYSTEM: System = "drift"
TIME_STEP = 1e-3
MISSING_MASS_SHARE, CENTRE_SHIFT = 0.05, 0.02
"""Share of the chassis mass that the model lacks; distance (m) by which its centre of mass lies ahead of the true
one."""
MEAN_FORCE_TOLERANCE = 1e-3
"""Tolerance of a mean force or moment, divided by the predicted mean: forces that are linear between samples of 1 ms
leave 1e-4."""
SEED, PITCH_NOISE = 37, np.deg2rad(0.1)
"""Seed of the noise on a measured pitch, and its standard deviation per sample (rad)."""
PUBLISHED_RMS_MOMENTS = {5.0: 3097.0, 15.0: 1333.0}
"""Published rms moment (N m) by bandwidth (Hz), left by another zero-phase filter on a similar drive."""
HIGH_PASS_CUT_OFF = 0.25
"""Cut-off frequency (Hz) of the high-pass."""
PRESCRIBED_MOTION_EFFECT = {"prescribed_heave_and_pitch": {"file": "motion.csv"}}
CONSTRAINED_INTEGRATORS = {"reference": "RK4", "exudyn": "GeneralizedAlpha", "mujoco": "RK4"}
EXPLICIT_INTEGRATORS = {"exudyn": "RK44", "mujoco": "RK4"}
DEAD_BAND_SPRING = {"pitch_spring": {"stiffness": 3e3, "damping": 200.0, "dead_band": 0.01}}


@allowing_breaches("masses are wrong on purpose: what they leave to be held is what is measured")
@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows: forces and moments that reveal a missing mass and a misplaced centre of mass on both vehicles, and the
    other stabilisers on the asymmetric vehicle; a quick run has half a second."""
    duration = 0.5 if quick else 10.0
    rows: list[Row] = []
    with TemporaryDirectory() as name:
        for parameter_set_name in VEHICLE_SETS:
            scene = road_scene(parameter_set_name, TIME_STEP, duration)
            measured, work = measure_road(scene), Path(name) / parameter_set_name
            work.mkdir()
            write_measurement(measured, work, TIME_STEP)
            follow, p = follower_builder(scene, work), scene.vehicle_parameters()
            rows += _missing_mass_rows(parameter_set_name, p, measured, follow, work)
            rows += _shifted_centre_rows(parameter_set_name, p, measured, follow, work)
        rows += [
            *_dead_band_and_moment_rows(follow, min(duration, 4.0)),
            _high_pass_row(follow),
            *_bandwidth_rows(measured, follow, work),
        ]
    return rows, {}


def write_prescribed_motion(measured_run: Result, work_folder: Path, distance_ahead: float = 0.0) -> None:
    """Write the pitch, and the heave of a point ``distance_ahead`` (m) of the true centre of mass, to the file that
    scenes with prescribed motion read."""
    pitch = measured_run["pitch"]
    columns = {"z3": ("m", measured_run["z3"] - distance_ahead * np.sin(pitch)), "pitch": ("rad", pitch)}
    write_time_series(work_folder / "motion.csv", columns, TIME_STEP)


def run_with_prescribed_motion(scene: Scene, engine_name: str) -> Result:
    """Run with prescribed motion, by the engine's integrator that can solve constraints."""
    return simulate(
        scene,
        engine_name,
        Settings(CONSTRAINED_INTEGRATORS[engine_name], TIME_STEP, scene.run.duration, spectral_radius=0.6),
    )


def _missing_mass_rows(
    parameter_set_name: str,
    parameters: PitchPlaneParameters,
    measured_run: Result,
    build_follower_scene: BuildFollower,
    work_folder: Path,
) -> list[Row]:
    """Rows: if the model's chassis is 5 % too light by the mass dm, prescribing the heave takes a mean force of dm (g -
    z3'')."""
    write_prescribed_motion(measured_run, work_folder)
    scene = build_follower_scene({"m3": (1 - MISSING_MASS_SHARE) * parameters.m3}, PRESCRIBED_MOTION_EFFECT)
    rate = measured_run["z3_rate"]
    mean = (rate[-1] - rate[0]) / scene.run.duration
    wanted = MISSING_MASS_SHARE * parameters.m3 * (parameters.g - mean)
    return [
        Observed(
            f"stabilisers.mass.{engine}.{parameter_set_name}",
            SYSTEM,
            f"{engine}, {parameter_set_name}: mean force that prescribes the heave, {MISSING_MASS_SHARE:.0%} of the "
            f"chassis missing (0.05 m3 g = {MISSING_MASS_SHARE * parameters.m3 * parameters.g:.1f} N)",
            float(run_with_prescribed_motion(scene, engine)["enforced_force"].mean()),
            "N",
        ).within(
            wanted,
            MEAN_FORCE_TOLERANCE * wanted,
            f"0.05 m3 (g - z3''), down; z3'' is {mean:.3f} m/s^2 on average here",
            "closed form",
        )
        for engine in CONSTRAINED_INTEGRATORS
    ]


def _shifted_centre_rows(
    parameter_set_name: str,
    parameters: PitchPlaneParameters,
    measured_run: Result,
    build_follower_scene: BuildFollower,
    work_folder: Path,
) -> list[Row]:
    """Rows: if the model's centre of mass lies ahead of the true one, prescribing the motion takes a moment, nose
    up."""
    write_prescribed_motion(measured_run, work_folder, CENTRE_SHIFT)
    scene = build_follower_scene(
        {"a": parameters.a + CENTRE_SHIFT, "b": parameters.b - CENTRE_SHIFT}, PRESCRIBED_MOTION_EFFECT
    )
    wanted = CENTRE_SHIFT * float(np.mean((measured_run["f3"] + measured_run["f4"]) * np.cos(measured_run["pitch"])))
    return [
        Observed(
            f"stabilisers.centre.{engine}.{parameter_set_name}",
            SYSTEM,
            f"{engine}, {parameter_set_name}: mean moment that prescribes the pitch, centre of mass {CENTRE_SHIFT:g} "
            f"m too far ahead (m3 g x = {CENTRE_SHIFT * parameters.m3 * parameters.g:.1f} N m)",
            float(run_with_prescribed_motion(scene, engine)["enforced_moment"].mean()),
            "N m",
        ).within(
            wanted, MEAN_FORCE_TOLERANCE * wanted, "x (f3 + f4) cos(pitch) of the true drive, nose up", "closed form"
        )
        for engine in CONSTRAINED_INTEGRATORS
    ]


def _dead_band_and_moment_rows(build_follower_scene: BuildFollower, duration: float) -> list[Row]:
    """Rows: states with a dead-band spring, and with an added moment, in Exudyn and MuJoCo compared with the reference
    equations."""
    assembly = assembly_of_scene(build_follower_scene({}, DEAD_BAND_SPRING))
    times = TIME_STEP * np.arange(round(duration / TIME_STEP) + 1)
    moment = SampledSignal(500.0 * np.sin(30.0 * times)[:, None], TIME_STEP, held=False)
    free = assembly_of_scene(build_follower_scene({}, {}))
    laws: dict[str, tuple[Assembly, str]] = {
        "dead_band": (assembly, "a pitch spring with a dead band of 0.01 rad"),
        "moment": (free.with_moment(moment), "an added moment of 500 N m at 30 rad/s"),
    }
    return [
        Observed(
            f"stabilisers.{name}.{engine}",
            SYSTEM,
            f"{engine}, {words}: largest difference of any state from the reference",
            trajectory_gap(checks.engine(engine), law, Settings(integrator, TIME_STEP, duration)),
            "SI",
        ).at_most(1e-12, "the same stages see the same side of the band and the same moment", "native")
        for name, (law, words) in laws.items()
        for engine, integrator in EXPLICIT_INTEGRATORS.items()
    ]


def _high_pass_row(build_follower_scene: BuildFollower) -> Row:
    """Row: distance between the slow pole of the linearised vehicle with the high-pass and the pole of the high-pass
    alone."""
    corner, ratio = 2 * np.pi * HIGH_PASS_CUT_OFF, 0.7
    vehicle = assembly_of_scene(
        build_follower_scene({}, {"high_pass": {"cut_off": HIGH_PASS_CUT_OFF, "damping_ratio": ratio}})
    ).vehicle
    poles = np.linalg.eigvals(first_order(linearised_matrices(vehicle)))
    wanted = corner * complex(-ratio, np.sqrt(1 - ratio**2))
    off = float(np.abs(poles - wanted).min()) / corner
    return Observed(
        "stabilisers.high_pass",
        SYSTEM,
        f"high-pass at {HIGH_PASS_CUT_OFF:g} Hz: distance of the vehicle's slow pole from that of s^2 + 2 zeta "
        "wc s + wc^2, over wc",
        off,
        "",
    ).at_most(
        0.01,
        "k = (I + J) wc^2, d = 2 zeta (I + J) wc; the wheels follow the chassis but for (wc / 20)^2, and "
        "unequal ends couple heave by (b m1 - a m2)^2 / (M (I + J))",
        "closed form",
    )


def _bandwidth_rows(measured_run: Result, build_follower_scene: BuildFollower, work_folder: Path) -> list[Row]:
    """Rows: stabilising moment if the prescribed pitch has the white noise of an inertial unit, raw and smoothed."""
    noise = PITCH_NOISE * normal_samples(SEED, 0, len(measured_run.times), 1)[:, 0]
    write_time_series(work_folder / "measured.csv", {"pitch": ("rad", measured_run["pitch"] + noise)}, TIME_STEP)
    file = {"file": "measured.csv"}
    runs = {
        bandwidth: run_with_prescribed_motion(
            build_follower_scene({}, {"prescribed_pitch": file | ({"bandwidth": bandwidth} if bandwidth else {})}),
            "reference",
        )
        for bandwidth in (None, *PUBLISHED_RMS_MOMENTS)
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
    for bandwidth, published in PUBLISHED_RMS_MOMENTS.items():
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
