"""The road under a vehicle's tracks: spectra, coherency, correlation cases, isotropic and measured roads, frequency
weighting."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad

from models.ride.covariance import stationary_covariance
from models.ride.excited import DelayedSystem, vehicle_with_road
from models.ride.frequency import output_densities, signed_wavenumbers, variances_over_wavenumbers
from models.ride.weighting import WEIGHTINGS, system_with_weightings
from models.road.excitation import RoadExcitation
from models.road.isotropic import DensityTerm, IsotropicRoad, cross_spectrum_of, isotropic_road_like, spectral_matrix
from models.road.two_track import (
    CORRELATION_CASES,
    TRACK_DENSITY_LEVEL,
    TwoTrackRoad,
    input_covariance,
    road_excitation,
    road_of_level,
)
from models.vehicles.linear_vehicle import LinearVehicle, WheelPosition
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System, Table
from validation.ride.fitted_roads import (
    HALF_TRACK,
    coherency_figure,
    fits_table,
    generated_road_rows,
    measured_road_rows,
)
from validation.ride.rides import STANDARD_WEIGHTINGS, largest_relative_error

TITLE = "Ride: roads under two tracks"
SYSTEM: System = "ride"
ASYMMETRIC_WHEEL_POSITIONS = (
    WheelPosition("front left", 1.2, 0.7, 0),
    WheelPosition("front right", 1.2, -0.6, 0),
    WheelPosition("middle left", -1.4, 0.65, 1),
    WheelPosition("middle right", -1.4, -0.75, 1),
    WheelPosition("rear left", -2.7, 0.9, 2),
    WheelPosition("rear right", -2.7, -0.9, 2),
)
"""Wheels of three axles, all different and without symmetry."""
SPEED = 20.0
WAVENUMBER_BAND = (1e-4, 500.0)
"""Wavenumbers (rad/m) between which spectra are integrated."""
MISPRINTED_FREQUENCY = 10.0
"""Frequency (Hz) at which the standard's table prints Wd = 212 although its own parameters give 202."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of closed forms by second methods, frequency weightings, and fits to an artificial road; a full run also has
    fits to measured roads."""
    rows = [*_paper_road_rows(), *_wheel_height_covariance_rows(), *_isotropic_rows(), *_weighting_rows()]
    of_made, road = generated_road_rows(1_000.0 if quick else 20_000.0)
    of_measured, roads = ([], []) if quick else measured_road_rows()
    return [*rows, *of_made, *of_measured], {"made": road, "measured": roads}


def _paper_road_rows() -> list[Row]:
    """Rows on the paper's two-track road: level of the track spectrum, variance of a track, and coherency, compared
    with closed forms."""
    road = road_of_level(HALF_TRACK)
    spectrum = road.spectrum(np.array([1e4]), HALF_TRACK)[0] * 1e8
    variance = 2.0 * quad(lambda k: float(road.spectrum(np.array(k), HALF_TRACK)), 0.0, math.inf, epsabs=1e-18)[0]
    closed = float(road.covariance(np.array(0.0), HALF_TRACK, HALF_TRACK))
    k = np.array([0.0, 1.0, 16.0])
    formula = (1.5**2 - 0.3**2) / (0.3**2 + 1.5**2 + 2.0 * k**2)
    coherency = road.coherency(k, HALF_TRACK, -HALF_TRACK)
    return [
        Observed(
            "ride_road.level",
            SYSTEM,
            "relative difference of the track spectrum at 10,000 rad/m, times Omega^2, from S0",
            spectrum / TRACK_DENSITY_LEVEL - 1.0,
            "",
        ).at_most(1e-7, "two-sided; corners matter by (1.5 / 10,000)^2 / 2 = 1e-8", "closed form"),
        Observed(
            "ride_road.variance",
            SYSTEM,
            "relative difference of the variance of a track from the integral of its spectrum",
            closed / variance - 1.0,
            "",
        ).at_most(1e-9, "the closed form (S0 pi / 2)(1/O1 + 1/O2) by quadrature", "closed form"),
        Observed(
            "ride_road.coherency",
            SYSTEM,
            "difference of the coherency at 0, 1 and 16 rad/m from (O2^2 - O1^2)/(O1^2 + O2^2 + 2 Omega^2)",
            float(np.abs(coherency - formula).max()),
            "",
        ).at_most(1e-15, "equal shares at short waves", "closed form"),
    ]


def _wheel_height_covariance_rows() -> list[Row]:
    """Rows: height covariances of the wheels in five cases of correlation, by filters with delayed noise, compared with
    delayed outputs of one filter."""
    worst = {"first": 0.0, "second": 0.0}
    for order, cutoff in (("first", None), ("second", 40.0)):
        road = road_of_level(HALF_TRACK, cutoff_wavenumber=cutoff)
        for case in CORRELATION_CASES.values():
            by_noise = wheel_heights_covariance(road_excitation(road, ASYMMETRIC_WHEEL_POSITIONS, *case))
            by_output = input_covariance(road, ASYMMETRIC_WHEEL_POSITIONS, *case)
            worst[order] = max(worst[order], float(np.abs(by_noise - by_output).max() / np.abs(by_output).max()))
    why = "the Lyapunov equation of six wheels with delays, against the autocovariance of the filter at the distance"
    return [
        Observed(
            f"ride_road.inputs.{order}",
            SYSTEM,
            "difference between a filter of delayed noise and delayed output, five input "
            f"covariances, three axles, filters of {order} order",
            error,
            "",
        ).at_most(1e-13, why, "closed form")
        for order, error in worst.items()
    ] + [_axle_distance_limit_row()]


def wheel_heights_covariance(excitation: RoadExcitation, speed: float = SPEED) -> np.ndarray:
    """Covariance (w, w) in m^2 of the road heights under the w wheels, from the Lyapunov equation of the filters of all
    axles."""
    axles, C = np.eye(len(excitation.heights)), np.hstack(excitation.heights)
    B = tuple(np.kron(axles[:, [i]], speed**0.5 * excitation.G) for i in range(len(axles)))
    D = tuple(np.zeros((len(C), excitation.G.shape[1])) for _ in B)
    delays = tuple(length / speed for length in excitation.lengths)
    names = tuple(map(str, range(len(C))))
    A = np.kron(axles, speed * excitation.F)
    return C @ stationary_covariance(DelayedSystem(A, B, delays, C, D, names, excitation.independent)).P @ C.T


def _axle_distance_limit_row() -> Row:
    """Row: height covariance of axles at the same place compared with equal axles, and of axles far apart compared with
    uncorrelated axles."""
    road = road_of_level(HALF_TRACK)
    pairs = []
    for length, front_rear in ((0.0, "equal"), (200.0, "uncorrelated")):
        wheels = tuple(WheelPosition(w.name, -length * w.axle, w.y, w.axle) for w in ASYMMETRIC_WHEEL_POSITIONS)
        delayed, limit = (
            wheel_heights_covariance(road_excitation(road, wheels, "modelled", how)) for how in ("delayed", front_rear)
        )
        pairs.append(float(np.abs(delayed - limit).max() / np.abs(limit).max()))
    why = "no distance: one input; 200 m: independent but for exp(-0.3 times 200) = 9e-27"
    return Observed(
        "ride_road.limits",
        SYSTEM,
        "difference of the input covariance of axles in a single place and 200 m apart from equal "
        "and uncorrelated axles",
        max(pairs),
        "",
    ).at_most(1e-14, why, "closed form")


def _isotropic_rows() -> list[Row]:
    """Rows: closed forms of an isotropic road by Bessel functions, compared with the integrals that define them; and
    effect of isotropy on accelerations."""
    road, apart, k = road_of_level(HALF_TRACK), 2.0 * HALF_TRACK, np.array([0.05, 0.3, 1.0, 3.0])
    closed = isotropic_road_like(road, HALF_TRACK).cross_spectrum(k, apart)
    along = cross_spectrum_of(lambda r: float(road.covariance(np.array(r), HALF_TRACK, HALF_TRACK)), list(k), apart)
    density_part = DensityTerm(1e-5, 0.3, 2.6)
    across = np.array([_cross_density_of_surface(density_part, float(wavenumber), apart) for wavenumber in k])
    hankel = density_part.density(k, apart)
    return [
        Observed(
            "ride_road.isotropic.fourier",
            SYSTEM,
            "difference of the cross density of an isotropic road, Bessel function, from the Fourier "
            "integral of R(sqrt(x^2 + d^2))",
            largest_relative_error(along, closed),
            "",
        ).at_most(1e-11, "quadrature to 1e-12 of the variance, over a density that falls", "closed form"),
        Observed(
            "ride_road.isotropic.hankel",
            SYSTEM,
            "difference of the cross density for waviness 2.6, Bessel function of order 1.3, from "
            "the integral over the two-dimensional density",
            largest_relative_error(across, hankel),
            "",
        ).at_most(1e-9, "quadrature to 1e-12 of the density on the track", "closed form"),
        *_acceleration_rows(road),
    ]


def _cross_density_of_surface(density_term: DensityTerm, wavenumber: float, track_distance: float) -> float:
    """Cross spectral density S(k, d) of two tracks at the distance d, by the integral of Phi(sqrt(k^2 + l^2)) cos(l d)
    over l. Phi is the surface density, the Hankel transform of the track's autocovariance."""
    w = density_term.waviness
    height = density_term.level * math.gamma((w + 1.0) / 2.0) / (math.sqrt(math.pi) * math.gamma(w / 2.0))
    track = float(density_term.density(np.array(wavenumber), 0.0))
    return (
        2.0
        * track
        * quad(
            lambda across: height * (density_term.corner**2 + wavenumber**2 + across**2) ** (-(w + 1.0) / 2.0) / track,
            0.0,
            math.inf,
            weight="cos",
            wvar=track_distance,
            epsabs=1e-12,
            limlst=500,
        )[0]
    )


def _acceleration_rows(road: TwoTrackRoad) -> list[Row]:
    """Rows: accelerations of the built-in vehicle by frequency responses compared with the covariance, and those on an
    isotropic road."""
    vehicle = linearise(load_vehicle("r19_ride"))
    exact = _values_of_accelerations(
        stationary_covariance(vehicle_with_road(vehicle, road_excitation(road, vehicle.wheels), SPEED)).deviation,
        vehicle,
    )
    by_frequency, isotropic = (
        _accelerations_by_frequency(vehicle, road_model) for road_model in (road, isotropic_road_like(road, HALF_TRACK))
    )
    rows = [
        Observed(
            "ride_road.route",
            SYSTEM,
            f"relative difference of {len(exact)} accelerations of R19-ride by the densities of the "
            "heights from the covariance",
            largest_relative_error(by_frequency, exact),
            "",
        ).at_most(
            1e-6, "0.0001 to 500 rad/m; no filter and no state on one side; what lies beyond is 1e-7", "closed form"
        )
    ]
    why = "isotropic tracks part sooner than mean and roll process as waves get shorter: less heave, more roll"
    return rows + [
        Observed(
            f"ride_road.isotropic.{name.split()[0]}",
            SYSTEM,
            f"ratio of {name} of R19-ride at {SPEED:g} m/s on an isotropic road to a two-track road "
            "of the same track spectrum",
            float(isotropic[i] / exact[i]),
            "",
        ).beside("", why)
        for i, name in enumerate(_acceleration_names(vehicle))
        if name in ("body centre", "roll acceleration")
    ]


def _values_of_accelerations(output_values: np.ndarray, vehicle: LinearVehicle) -> np.ndarray:
    """Entries of the vehicle's outputs (m,) that are accelerations."""
    return output_values[["acceleration" in output.kind for output in vehicle.outputs]]


def _acceleration_names(vehicle: LinearVehicle) -> list[str]:
    """Names of the vehicle's outputs that are accelerations."""
    return [output.name for output in vehicle.outputs if "acceleration" in output.kind]


def _accelerations_by_frequency(vehicle: LinearVehicle, road_model: TwoTrackRoad | IsotropicRoad) -> np.ndarray:
    """Standard deviations (m/s^2) of the vehicle's accelerations, integrated over the wavenumbers."""
    spectral = variances_over_wavenumbers(
        vehicle, lambda k: spectral_matrix(road_model, vehicle.wheels, k), SPEED, *WAVENUMBER_BAND
    )
    return np.sqrt(_values_of_accelerations(spectral, vehicle))


def _weighting_rows() -> list[Row]:
    """Rows: frequency weightings compared with the standard's table, as filters compared with their formulas, and
    weighted accelerations by two methods."""
    frequency, wk, wd = np.array(STANDARD_WEIGHTINGS).T
    rows = []
    for name, table in (("Wk", wk), ("Wd", wd)):
        W = WEIGHTINGS[name]
        digit = 10.0 ** (np.floor(np.log10(np.minimum(table, 999.0))) - 2.0)
        sound = (frequency != MISPRINTED_FREQUENCY) | (name != "Wd")
        digits = (1e3 * np.abs(W.response(frequency)) - table) / digit
        A, B, C = W.matrices()
        by_states = np.array([C @ np.linalg.solve(2j * np.pi * f * np.eye(len(A)) - A, B) for f in frequency])
        rows += [
            Observed(
                f"ride_road.weighting.{name}.table",
                SYSTEM,
                f"largest difference of {name} from the table of ISO 2631-1, {sound.sum()} frequencies",
                float(np.abs(digits[sound]).max()),
                "units of the table's last digit",
            ).at_most(1.0, "half a unit of rounding; two entries were cut off, not rounded", "published"),
            Observed(
                f"ride_road.weighting.{name}.states",
                SYSTEM,
                f"relative difference of {name} as a cascade of scaled sections from the formula of its sections",
                largest_relative_error(by_states, W.response(frequency)),
                "",
            ).at_most(1e-13, "rounding", "closed form"),
        ]
    rows.append(
        Observed(
            "ride_road.weighting.misprint",
            SYSTEM,
            "Wd at 10 Hz from the parameters, times 1000",
            1e3 * float(np.abs(WEIGHTINGS["Wd"].response(np.array(10.0)))),
            "",
        ).beside(212.0, "the table's 212 is not that of its own parameters: 22 other entries are")
    )
    return rows + _weighted_acceleration_rows()


def _weighted_acceleration_rows() -> list[Row]:
    """Rows: weighted acceleration a_w of a vehicle by the Lyapunov equation, compared with quadrature."""
    vehicle = linearise(load_vehicle("r19_ride"))
    road = road_of_level(HALF_TRACK)
    filters = {"left occupant": "Wk", "body centre": "Wd"}
    system = system_with_weightings(vehicle_with_road(vehicle, road_excitation(road, vehicle.wheels), SPEED), filters)
    deviations = stationary_covariance(system).deviation[-len(filters) :]
    k, weight = signed_wavenumbers(vehicle, *WAVENUMBER_BAND)
    density = output_densities(vehicle, lambda k: spectral_matrix(road, vehicle.wheels, k), SPEED, k)
    rows = []
    for value, (output, name) in zip(deviations, filters.items(), strict=True):
        gain = np.abs(WEIGHTINGS[name].response(SPEED * k / (2.0 * np.pi))) ** 2
        expected = math.sqrt(weight @ (gain * density[:, vehicle.names.index(output)]))
        rows.append(
            Observed(
                f"ride_road.weighted.{name}",
                SYSTEM,
                f"relative difference of {output} of R19-ride weighted by {name} between Lyapunov "
                f"equation and quadrature, {SPEED:g} m/s",
                float(value / expected - 1.0),
                "",
            ).at_most(1e-8, "0.0001 to 500 rad/m: a weighting leaves nothing beyond", "closed form")
        )
    return rows


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the five input covariances, of the weightings beside the standard's table, and of the fits."""
    return [
        _wheel_height_covariance_table(),
        _weighting_table(),
        fits_table([case_data["made"], *case_data["measured"]]),
    ]


def _wheel_height_covariance_table() -> Table:
    """Table of the height covariances of pairs of wheels in the five cases of correlation."""
    road = road_of_level(HALF_TRACK)
    some = ((0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (2, 3), (4, 5))
    rows = []
    for number, case in CORRELATION_CASES.items():
        P = input_covariance(road, ASYMMETRIC_WHEEL_POSITIONS, *case)
        rows.append((f"{number}: {case[0]}, {case[1]}", *(f"{1e6 * P[i, j]:.2f}" for i, j in some)))
    heads = (
        "left/right, front/rear",
        *(f"{ASYMMETRIC_WHEEL_POSITIONS[i].name} with {ASYMMETRIC_WHEEL_POSITIONS[j].name}" for i, j in some),
    )
    note = "Covariance of the heights under the wheels in mm^2; three axles, every wheel at its own y."
    return Table("The road under the wheels in five cases", note, heads, tuple(rows))


def _weighting_table() -> Table:
    """Table of the weighting factors beside those of the standard."""
    rows = []
    for f, wk, wd in STANDARD_WEIGHTINGS:
        factors = [1e3 * abs(complex(WEIGHTINGS[name].response(np.array(f)))) for name in ("Wk", "Wd")]
        rows.append((f"{f:g}", f"{factors[0]:.1f}", f"{wk:g}", f"{factors[1]:.1f}", f"{wd:g}"))
    note = "Factors times 1000; the table as others have printed it. Its Wd at 10 Hz does not fit its own parameters."
    heads = ("Hz", "Wk", "Wk, table", "Wd", "Wd, table")
    return Table("Weightings of ISO 2631-1", note, heads, tuple(rows))


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot spectra and coherency of the model, of artificial and of measured roads."""
    return [coherency_figure(HALF_TRACK, [case_data["made"], *case_data["measured"]])]
