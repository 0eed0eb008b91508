"""Compiled evaluation of road profiles: sums of sines and piecewise cubics, faded in by a window.

Frame: s along the road in m, zeta in m positive **down** (a rise is negative), slope d(zeta)/ds.
"""

import math
from typing import NamedTuple

import numpy as np

from models.machine.compiled import njit

SAMPLES_PER_RESYNCHRONISATION = 128
"""Count of samples between two exact evaluations of sin and cos in :func:`sines_uniform`.

One rotation adds at most about 2e-16 of a wave's amplitude; 128 of them stay near 1e-14 even if every
rounding fell the same way, and the exact values then cost 1/128 of what direct evaluation costs.
"""

VECTOR_LANES = 16
"""The number of waves is filled up to a multiple of this with waves of amplitude 0, so that all vector registers are
full."""


class RoadWaves(NamedTuple):
    """Waves of a road -w(s) sum amplitude sin(wavenumber s + phase): m, rad/m, rad, all (n,), and the length (m) of its
    window w."""

    amplitude: np.ndarray
    wavenumber: np.ndarray
    phase: np.ndarray
    window: float


@njit(cache=True)
def smoothstep(share_of_transition: float) -> tuple[float, float]:
    """Quintic smoothstep 10 x^3 - 15 x^4 + 6 x^5 and its derivative; 0 before x = 0, 1 after x = 1, C2 at both ends."""
    if share_of_transition <= 0.0:
        return 0.0, 0.0
    if share_of_transition >= 1.0:
        return 1.0, 0.0
    return share_of_transition * share_of_transition * share_of_transition * (
        10.0 - share_of_transition * (15.0 - 6.0 * share_of_transition)
    ), 30.0 * share_of_transition * share_of_transition * (1.0 - share_of_transition) * (1.0 - share_of_transition)


@njit(cache=True)
def fade_in(distance: float, window_length: float, height: float, slope: float) -> tuple[float, float]:
    """Height (m) and slope of ``w(distance / window) * height``, w the smoothstep; 0 for distances up to 0; a window of
    0 means no windowing."""
    if distance <= 0.0:
        return 0.0, 0.0
    if distance >= window_length:
        return height, slope
    weight, rate = smoothstep(distance / window_length)
    return weight * height, weight * slope + rate / window_length * height


@njit(cache=True)
def sines_at(station, amplitude, wavenumber, phase, window_length):
    """Height (m, down) and slope of a sum of sines at a station s (m). The arrays of ``RoadWaves`` are separate
    arguments, since passing the tuple from Python doubles the time.
    """
    height, slope = 0.0, 0.0
    if station > 0.0:
        for i in range(amplitude.size):
            angle = wavenumber[i] * station + phase[i]
            height -= amplitude[i] * math.sin(angle)
            slope -= amplitude[i] * wavenumber[i] * math.cos(angle)
    return fade_in(station, window_length, height, slope)


@njit(cache=True)
def fill_sines(station, waves, height, slope):
    """Fill ``height`` (m, down) and ``slope`` of a sum of sines at every station of the flat array ``station`` (m)."""
    for j in range(station.size):
        height[j], slope[j] = sines_at(station[j], waves.amplitude, waves.wavenumber, waves.phase, waves.window)


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _rotate_waves(sine, cosine, step_sine, step_cosine, wavenumber):
    """Sums of all waves and of their slopes at the present sample; rotates every wave to the next sample.

    The waves are the inner loop because they are independent: the sums may be reordered (``reassoc``),
    so the loop becomes one of vector instructions. ``sine`` and ``cosine`` carry the amplitudes.
    """
    height, slope = 0.0, 0.0
    for i in range(sine.size):
        u, v = sine[i], cosine[i]
        height -= u
        slope -= wavenumber[i] * v
        sine[i] = u * step_cosine[i] + v * step_sine[i]
        cosine[i] = v * step_cosine[i] - u * step_sine[i]
    return height, slope


@njit(cache=True)
def sines_uniform(start_station, station_step, waves, height, slope):
    """Fill ``height`` (m, down) and ``slope`` of a sum of sines at ``start_station + j step`` by complex rotation,
    exact every 128 samples."""
    amplitude, wavenumber, phase, window = waves
    n = amplitude.size
    work = np.zeros((5, (n + VECTOR_LANES - 1) // VECTOR_LANES * VECTOR_LANES))
    sine, cosine, turn_sine, turn_cosine, number = work[0], work[1], work[2], work[3], work[4]
    for i in range(n):  # a slice assigned at once takes seconds to compile
        number[i] = wavenumber[i]
        turn_sine[i], turn_cosine[i] = math.sin(number[i] * station_step), math.cos(number[i] * station_step)
    for first in range(0, height.size, SAMPLES_PER_RESYNCHRONISATION):
        s = start_station + first * station_step
        for i in range(n):
            angle = number[i] * s + phase[i]
            sine[i], cosine[i] = amplitude[i] * math.sin(angle), amplitude[i] * math.cos(angle)
        for j in range(first, min(first + SAMPLES_PER_RESYNCHRONISATION, height.size)):
            value, rate = _rotate_waves(sine, cosine, turn_sine, turn_cosine, number)
            height[j], slope[j] = fade_in(start_station + j * station_step, window, value, rate)


@njit(cache=True)
def piece_index(stations, station, guessed_piece):
    """Index of the spline's piece that contains station ``station``; the search starts at the piece found last,
    ``guessed_piece``."""
    last_piece = stations.size - 2
    for i in range(guessed_piece, min(guessed_piece + 2, last_piece + 1)):
        if stations[i] <= station < stations[i + 1]:
            return i
    low, high = 0, last_piece
    while low < high:
        middle = (low + high + 1) // 2
        if stations[middle] <= station:
            low = middle
        else:
            high = middle - 1
    return low


@njit(cache=True)
def cubic_at(station, piece_number, stations, coefficients, window_length):
    """Height (m, down) and slope of a cubic piece (coefficient rows from the highest power), multiplied by the window
    that starts at the first station."""
    d = station - stations[piece_number]
    a, b, c, e = (
        coefficients[piece_number, 0],
        coefficients[piece_number, 1],
        coefficients[piece_number, 2],
        coefficients[piece_number, 3],
    )
    height = ((a * d + b) * d + c) * d + e
    slope = (3.0 * a * d + 2.0 * b) * d + c
    if window_length > 0.0:
        return fade_in(station - stations[0], window_length, height, slope)
    return height, slope


@njit(cache=True)
def cubic_at_station(station, stations, coefficients, window_length):
    """Height (m, down) and slope of a piecewise cubic road at a station s (m)."""
    return cubic_at(station, piece_index(stations, station, 0), stations, coefficients, window_length)


@njit(cache=True)
def fill_cubics(station, stations, coefficients, window_length, height, slope):
    """Fill ``height`` (m, down) and ``slope`` of a piecewise cubic road at every station of the flat array ``station``
    (m)."""
    piece = 0
    for j in range(station.size):
        piece = piece_index(stations, station[j], piece)
        height[j], slope[j] = cubic_at(station[j], piece, stations, coefficients, window_length)


@njit(cache=True)
def cubics_uniform(start_station, station_step, stations, coefficients, window_length, height, slope):
    """Fill ``height`` (m, down) and ``slope`` of a piecewise cubic road at ``start_station + j step`` (m)."""
    piece = 0
    for j in range(height.size):
        s = start_station + j * station_step
        piece = piece_index(stations, s, piece)
        height[j], slope[j] = cubic_at(s, piece, stations, coefficients, window_length)
