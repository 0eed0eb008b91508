"""Hard cases of values at the edge of what an engineer would enter: a road that begins metres above zero, slender
contacts, tiny intensities, invalid points and samples.

Each was answered once by finite numbers that were wrong, or by an error of the machinery.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from models.contact.accuracy import rolled_with_errors
from models.contact.hertz import by_axes
from models.contact.material import MaterialPair
from models.contact.profiles import profile_of_points
from models.contact.standard_profiles import built_in_profile
from models.contact.theories import ExactTheoryOnEllipse, FastsimTheory
from models.core.result import Result, load_result
from models.drift.growth import drift_off_time
from models.drift.point_mass import euler_covariance
from models.ensemble.statistics import deviation_with_error, quantile_with_interval
from models.fatigue.damage import pseudo_damage
from models.ride.covariance import lyapunov_solution
from models.ride.measures import dynamic_load_factor, time_share_beyond
from models.ride.nonlinear_copies import copies_in_time
from models.road.excitation import RoadExcitation
from models.systems.hub_forces.measurement import HubForces, MeasuredAngles
from models.systems.hub_forces.tilt_filter import StatedDeviations, estimate_tilt
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.systems.ride.scene import build
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import wheels
from models.vehicles.vehicle_file import load_vehicle
from validation.hard_cases.between_steps import REFUSED, refused_case
from validation.hard_cases.case import HardCase

FRICTION, CELLS = 0.3, 15


def long_wave_error(engine_name: str, work_folder: Path) -> float:
    """Case: nonlinear quarter cars on two roads that differ only in waves longer than 60 m. Error: largest relative
    difference of the standard deviations.

    The longer waves reach up to 10 m, from which cars that began at 0 would fall.
    """
    deviations = [_monte_carlo_run(corner).deviation for corner in (1e-6, 0.1)]
    return float(np.abs(deviations[0] / deviations[1] - 1.0).max())


def _monte_carlo_run(corner_wavenumber: float) -> Any:
    """Statistics of 20 copies of the quarter car in time, on a road with a corner wavenumber (rad/m)."""
    vehicle, road = _vehicle_and_road(corner_wavenumber)
    return copies_in_time(vehicle, road, 5.0, 1.0, copy_count=20, seed=1, longest_step=2e-3)


def _vehicle_and_road(corner_wavenumber: float) -> tuple[SpatialVehicle, RoadExcitation]:
    """Nonlinear quarter car, and a random road with a corner wavenumber (rad/m)."""
    scene = build(
        {
            "title": "hard",
            "system": "ride",
            "vehicle": {"file": "quarter_car_nonlinear"},
            "road": {"level": 6.4e-5, "corner_mean": corner_wavenumber, "corner_roll": corner_wavenumber},
            "speeds": {"start": 5.0, "stop": 6.0},
        }
    )
    vehicle = vehicle_of(scene)
    return vehicle, excitation_of(scene, wheels(vehicle))


def slender_ellipse_case(a: float, b: float) -> Callable[[str, Path], float]:
    """Case: a contact ellipse with semi-axes a, b (m) under spin. Error: difference of FASTSIM from the exact theory
    divided by its stated error."""

    def error(engine_name: str, work_folder: Path) -> float:
        pair = MaterialPair()
        hertz, motion = by_axes(a, b, pair, load=1e5), (0.0, 1e-3, 0.5)
        choices: dict[str, Any] = {"flexibilities": "blended", "bound": "intermediate", "march": "second-order"}
        (fast, error_of_fast), (exact, error_of_exact) = (
            rolled_with_errors(theory, motion, CELLS)
            for theory in (FastsimTheory(hertz, FRICTION, pair, **choices), ExactTheoryOnEllipse(hertz, FRICTION, pair))
        )
        force, moment = float(np.linalg.norm(fast.force - exact.force)), abs(fast.mz - exact.mz)
        return max(
            force / (error_of_fast.total + error_of_exact.cells),
            moment / (error_of_fast.moment + error_of_exact.moment_cells),
        )

    return error


def scaled_drift_off_error(engine_name: str, work_folder: Path) -> float:
    """Case: drift-off times with noise and angle scaled together over 300 decades. Error: relative difference of the
    times, which must be equal."""
    off_time = drift_off_time(0.3, 1e-5, 1e-3)
    scaled = [drift_off_time(0.3, 1e-5 * s * s, 1e-3 * s) for s in (1e-145, 1e-100, 1e145)]
    return float(np.abs(np.array(scaled) / off_time - 1.0).max())


def overconfident_filter_ratio(engine_name: str, work_folder: Path) -> float:
    """Case: a tilt filter with stated deviations of 1e-12 for angles and rates, and force noise of 1 N or 8 N. Error:
    the filter's deviations divided by the stated ones."""
    vehicle, angles = cut_at_hubs(load_vehicle("r19_free"), "body"), MeasuredAngles(np.zeros((5000, 4)), 2e-3)
    forces = HubForces(np.zeros((5000, 6 * len(vehicle.hubs))), 2e-3, "hub")
    fits = [
        estimate_tilt(
            vehicle, forces, angles, StatedDeviations(np.full(forces.samples.shape[1], noise), (1e-12, 1e-12), 10.0)
        )
        for noise in (1.0, 8.0)
    ]
    return max(float(np.nan_to_num(fit.deviations / 1e-12, nan=np.inf).max()) for fit in fits)


def flipped_bit_error(engine_name: str, work_folder: Path) -> float:
    """Case: a bit of a saved result was changed on the disk; loading must be refused. Error: largest change of the
    values."""
    heave = np.linspace(1.0, 2.0, 64)
    Result(xr.Dataset({"z3": ("time", heave)}, {"time": ("time", np.arange(64.0))})).save(work_folder / "run.nc")
    content = bytearray((work_folder / "run.nc").read_bytes())
    content[content.index(heave.tobytes()) + 100] ^= 4
    (work_folder / "run.nc").write_bytes(content)
    return float(np.abs(load_result(work_folder / "run.nc")["z3"] - heave).max())


def profile_with_spike() -> Any:
    """A rail profile with a point measured 1 mm too low, which must be refused."""
    rail = built_in_profile("UIC60")
    return profile_of_points(rail.y, rail.z + 1e-3 * (np.arange(rail.z.size) == rail.z.size // 2))


def rounded_profile() -> Any:
    """A rail profile with points rounded to 0.1 mm, so that its steep sides go back and forth, which must be
    refused."""
    rail = built_in_profile("UIC60")
    return profile_of_points(rail.y.round(4), rail.z.round(4))


MASKED_SAMPLES = np.ma.array([0.0, 100.0, 0.0, 1.0, 0.0], mask=np.arange(5) == 1)
SKEW_MATRIX = np.array([[1.0, 2.0], [0.0, 1.0]])
STABLE_MATRIX = np.array([[0.0, 1.0], [-4.0, -0.5]])
CASES = (
    HardCase(
        "road that begins 10 m up",
        "vehicles let go at 0 fall onto it and ring for long",
        "as on one without its long waves",
        "relative",
        0.02,
        "waves of 60 m at 0.1 Hz",
        long_wave_error,
        is_without_engine=True,
    ),
    HardCase(
        "narrow contact",
        "an ellipse 20 times as wide as long: FASTSIM's moment is two and a half times too large",
        "within its stated error of the exact theory",
        "of it",
        1.0,
        "exact",
        slender_ellipse_case(5e-4, 1e-2),
        is_without_engine=True,
    ),
    HardCase(
        "drift-off time under tiny noise",
        "squares of angles underflow",
        "the same by scaling",
        "relative",
        1e-12,
        "rounding",
        scaled_drift_off_error,
        is_without_engine=True,
    ),
    HardCase(
        "filter of tilts told of them to 1e-12",
        "subtracted covariances leave less than nothing",
        "surer than each value, never less",
        "of the deviations told",
        1.0 + 1e-9,
        "rounding",
        overconfident_filter_ratio,
        is_without_engine=True,
    ),
    HardCase(
        "saved result with a flipped bit",
        "every number of it is plausible",
        "refused",
        "",
        0.0,
        "exact",
        flipped_bit_error,
        REFUSED,
        is_without_engine=True,
    ),
    *(
        HardCase(name, hard, "refused", "", 0.0, "exact", refused_case(answer), REFUSED, is_without_engine=True)
        for name, hard, answer in (
            ("profile with a spike", "a spline swings about it", profile_with_spike),
            ("profile rounded to 0.1 mm", "the half beyond the first step back would be lost", rounded_profile),
            ("masked samples", "would be counted", lambda: pseudo_damage(MASKED_SAMPLES)),
            ("load below 0 under a wheel", "its factor would be negative", lambda: dynamic_load_factor(100.0, -4000.0)),
            ("limit below 0", "a share of time above 1", lambda: time_share_beyond(1.0, -1.0)),
            ("deviation of two values", "its error would be 0", lambda: deviation_with_error(np.array([1.0, 2.0]))),
            (
                "quantile of what is no number",
                "would be sorted to the end",
                lambda: quantile_with_interval(np.array([1.0, np.nan]), 0.5),
            ),
            (
                "covariance of what grows",
                "Lyapunov's equation has an answer, which is none",
                lambda: lyapunov_solution(-STABLE_MATRIX, np.eye(2)),
            ),
            (
                "right side that is askew",
                "another one would be solved",
                lambda: lyapunov_solution(STABLE_MATRIX, SKEW_MATRIX),
            ),
            ("point mass of nothing", "divided by", lambda: euler_covariance(10, 1.0, 1e-3, 0.0)),
        )
    ),
)
