"""Random road (mean height and roll process) fitted to two measured tracks, with sentences on what the measurement
leaves undetermined."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.road.measured_tracks import MeasuredTracks, TrackSpectra, track_spectra
from models.road.shape_filter import ShapeFilter
from models.road.two_track import TwoTrackRoad

BANDS_PER_DECADE = 10
"""Count of bands per decade in which a density is averaged before the fit, so that every octave counts the same."""
HIGHEST_WAVENUMBER = 2.0 * math.pi * 2.83
"""Upper end (rad/m) of the band of ISO 8608: shorter waves are swallowed by the tyre."""


@dataclass(frozen=True)
class RoadFilterFit:
    """First-order filter fitted to a measured density between the wavenumbers ``low_wavenumber`` and
    ``high_wavenumber`` (rad/m).

    corner_error, intensity_error: relative standard errors from the scatter about the fit. ``log_residual``: rms of
    ln(measured / fitted) over the bands; 0.69 is a factor of two. The corner is ``corner_is_resolved`` if it lies
    within the band and is known to half of itself; it is never sought below a tenth of ``low_wavenumber``.
    """

    filter: ShapeFilter
    corner_error: float
    intensity_error: float
    log_residual: float
    low_wavenumber: float
    high_wavenumber: float
    corner_is_resolved: bool


@dataclass(frozen=True)
class FittedRoad:
    """Road fitted to measured tracks, the fits of its mean and roll process (None for an absent process), sentences on
    their quality, and the spectra."""

    road: TwoTrackRoad
    mean: RoadFilterFit
    roll: RoadFilterFit | None
    notes: tuple[str, ...]
    spectra: TrackSpectra


def fit_road(
    measured_tracks: MeasuredTracks,
    window_length: float | None = None,
    lowest_wavenumber: float | None = None,
    highest_wavenumber: float | None = None,
) -> FittedRoad:
    """Fit of a first-order mean and roll process by least squares on the logarithms of the measured densities.

    lowest_wavenumber, highest_wavenumber : band of the fit in rad/m; by default from twice the lowest wavenumber that a
    window holds, where the straight line that was taken out is no longer felt, to the end of the standard's band

    Raises
    ------
    InputError : too few windows, fewer than four bands to fit two numbers to, or no mean process at all
    """
    measured = track_spectra(measured_tracks, window_length)
    height = max(float(np.abs(measured_tracks.left).max()), float(np.abs(measured_tracks.right).max()))
    if float(np.ptp(measured_tracks.left + measured_tracks.right)) <= 1e-12 * height:
        raise InputError(
            measured_tracks.name, "heights", None, "left and right have the same mean all along: there is no road"
        )
    low_wavenumber = 2.0 * float(measured.wavenumber[0]) if lowest_wavenumber is None else lowest_wavenumber
    high_wavenumber = (
        min(HIGHEST_WAVENUMBER, 0.5 * float(measured.wavenumber[-1]))
        if highest_wavenumber is None
        else highest_wavenumber
    )
    mean = _fit_first_order(
        measured.wavenumber,
        measured.mean,
        measured.degrees_of_freedom,
        low_wavenumber,
        high_wavenumber,
        measured_tracks.name,
    )
    track_difference = float(np.abs(measured_tracks.left - measured_tracks.right).max())
    roll = (
        _fit_first_order(
            measured.wavenumber,
            measured.roll,
            measured.degrees_of_freedom,
            low_wavenumber,
            high_wavenumber,
            measured_tracks.name,
        )
        if track_difference > 0.0
        else None
    )
    silent = ShapeFilter(mean.filter.corner, 0.0)
    road = TwoTrackRoad(mean.filter, silent if roll is None else roll.filter)
    return FittedRoad(
        road,
        mean,
        roll,
        (*_data_limit_sentences(measured_tracks, measured), *_misfit_sentences(measured, mean, roll)),
        measured,
    )


def _fit_first_order(
    wavenumbers: np.ndarray,
    density: np.ndarray,
    degrees_of_freedom: float,
    lowest_wavenumber: float,
    highest_wavenumber: float,
    process_name: str,
) -> RoadFilterFit:
    """Least-squares fit of ln S = ln(q / 2 pi) - ln(corner^2 + k^2), with the logarithms of q and corner as unknowns,
    to a density over the wavenumber k."""
    from scipy.optimize import least_squares

    middle, mean = _band_averages(wavenumbers, density, degrees_of_freedom, lowest_wavenumber, highest_wavenumber)
    if len(middle) < 4:
        band = f"{lowest_wavenumber:.3g} and {highest_wavenumber:.3g} rad/m"
        allowed = f"four bands or more are needed between {band}: the road is too short"
        raise InputError(process_name, "bands to fit", len(middle), allowed)

    def error(log_parameters: np.ndarray) -> np.ndarray:
        return log_parameters[1] - np.log(2.0 * math.pi * (np.exp(2.0 * log_parameters[0]) + middle**2)) - mean

    start = np.array(
        [math.log(lowest_wavenumber), math.log(2.0 * math.pi) + float(np.mean(mean + 2.0 * np.log(middle)))]
    )
    bounds = ([math.log(lowest_wavenumber / 10.0), -np.inf], [math.log(highest_wavenumber), np.inf])
    best = least_squares(error, start, bounds=bounds, x_scale=1.0, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    scatter = float(np.sum(best.fun**2)) / (len(middle) - 2)
    sd = np.sqrt(np.diag(np.linalg.pinv(best.jac.T @ best.jac)) * scatter)
    corner = math.exp(best.x[0])
    resolved = bool(lowest_wavenumber < corner < highest_wavenumber * (1.0 - 1e-6) and sd[0] < 0.5)
    residual = math.sqrt(float(np.mean(best.fun**2)))
    filter = ShapeFilter(corner, math.exp(best.x[1]))
    return RoadFilterFit(filter, float(sd[0]), float(sd[1]), residual, lowest_wavenumber, highest_wavenumber, resolved)


def _band_averages(
    wavenumbers: np.ndarray,
    density: np.ndarray,
    degrees_of_freedom: float,
    lowest_wavenumber: float,
    highest_wavenumber: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Band centres (rad/m), and logarithms of the densities averaged in bands (as density times k^2), corrected for the
    bias of the logarithm."""
    from scipy.special import digamma

    count = (
        max(1, round(BANDS_PER_DECADE * math.log10(highest_wavenumber / lowest_wavenumber)))
        if highest_wavenumber > lowest_wavenumber
        else 0
    )
    edges = np.geomspace(lowest_wavenumber, highest_wavenumber, count + 1)
    middles, values = [], []
    for start, end in itertools.pairwise(edges):
        in_band = (wavenumbers >= start) & (wavenumbers < end)
        if in_band.any():
            half = degrees_of_freedom * in_band.sum() / 2.0
            middle = float(np.exp(np.log(wavenumbers[in_band]).mean()))
            flat = float(np.mean(density[in_band] * wavenumbers[in_band] ** 2))
            middles.append(middle)
            values.append(math.log(flat / middle**2) - (digamma(half) - math.log(half)))
    return np.array(middles), np.array(values)


def _data_limit_sentences(measured_tracks: MeasuredTracks, track_spectra_of_road: TrackSpectra) -> list[str]:
    """Sentences on limits of the measured data that no fit can remove."""
    lowest_wavenumber = track_spectra_of_road.wavenumber[0]
    low, high = track_spectra_of_road.confidence_factors()
    return [
        f"{measured_tracks.length:g} m in {track_spectra_of_road.window_count} windows: nothing is known of waves "
        f"longer than {2.0 * math.pi / lowest_wavenumber:.3g} m ({lowest_wavenumber:.3g} rad/m)",
        f"every single density is known to a factor {low:.2f} to {high:.2f} (95 %)",
        f"a coherency below {track_spectra_of_road.chance_coherency():.2f} cannot be told from none (95 %)",
    ]


def _misfit_sentences(
    track_spectra_of_road: TrackSpectra, mean_fit: RoadFilterFit, roll_fit: RoadFilterFit | None
) -> list[str]:
    """Sentences on where the fitted road differs from the measured one."""
    sentences = []
    for name, fitted in (("mean", mean_fit), ("roll", roll_fit)):
        if fitted is None:
            sentences.append(
                "left and right are the same heights: there is no roll process, and the file says nothing of it"
            )
            continue
        if not fitted.corner_is_resolved:
            sentences.append(
                f"the corner of the {name} process is not told by this road: only its level above "
                f"{fitted.low_wavenumber:.3g} rad/m is; do not read its variance"
            )
        if fitted.log_residual > math.log(2.0):
            sentences.append(
                f"the {name} process is not of first order: the fit is off by a factor "
                f"{_scatter_factor(fitted):.1f} (rms)"
            )
    shared = np.abs(track_spectra_of_road.mean_roll) / np.sqrt(
        track_spectra_of_road.mean * np.maximum(track_spectra_of_road.roll, 1e-300)
    )
    used = (track_spectra_of_road.wavenumber >= mean_fit.low_wavenumber) & (
        track_spectra_of_road.wavenumber <= mean_fit.high_wavenumber
    )
    often = float(np.mean(shared[used] > track_spectra_of_road.chance_coherency()))
    if roll_fit is not None and often > 0.2:
        sentences.append(
            f"mean and roll are coherent at {100.0 * often:.0f} % of the wavenumbers (5 % by chance): the tracks "
            "differ in level or lean on one another, which two independent processes cannot show"
        )
    return sentences


def _scatter_factor(filter_fit: RoadFilterFit) -> float:
    return math.exp(filter_fit.log_residual)
