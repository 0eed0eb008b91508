"""Equivalent conicity of a wheelset from its rolling radius difference: by EN 15302, and by the first harmonic.

Without slip a wheelset on straight track follows Klingel's wave, y'' = -dr(y) / (s r) over the way, with s the distance
of the contact points and r the rolling radius. Equivalent conicity at an amplitude is that of the cones whose wave is
as long (EN 15302:2021, clause 4). With the way in units of the root of s r the equation is

    y'' = -dr(y),    conicity = (2 pi / T)^2 / 2,

T the period of the amplitude; cones have dr = 2 conicity y. **The amplitude is half of peak to peak.** The wave swings
between two places of one potential V = int dr dy, which need not lie symmetrically about y = 0: of wheels of unequal
radius or shape they do not, and the middle between them is the wave's centre.

dr is straight between the rows of a table, on which the time from one row to the next is known: with K the square of
the speed over two, w the root of a piece's slope and l its length,

    t = (2 / w) arctan(w l / (v_1 + v_2)),    arctanh where the slope is negative,

which is smooth at the turning points, where v = 0. So T is exact but for rounding; what is left is how far the table's
lines are from the true difference, which ``ConicityRow.spacing_error`` estimates.

The **harmonic linearisation** (quasi-linearisation) instead takes the first harmonic of dr on a sine of that amplitude.
Both agree on cones only.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.contact.inputs import Array, checked_number, checked_quantity
from models.core.errors import InputError
from models.rail.rolling_radius_table import RollingRadiusTable

SERIES_LIMIT = 1e-6
"""Argument z below which arctan z / z is taken as 1, with an error below 4e-13."""
AMPLITUDE_TOLERANCE = 1e-9
"""Share of an amplitude within which two waves count as equal, or an amplitude as that of the table's ends."""
HARMONIC_PHASES = 720
"""Count of phases at which the first harmonic is summed."""


@dataclass(frozen=True)
class KlingelWave:
    """Periodic motion of a free wheelset (Klingel) with one amplitude, in the table's unit of length.

    centre : middle between both turning points ``lowest`` and ``highest``. period : T of y'' = -dr(y); infinite where
    dr is zero over the whole of the amplitude: then the wheelset does not steer, the conicity is 0 and there is no
    wave. conicity : -.
    """

    amplitude: float
    centre: float
    period: float

    @property
    def lowest(self) -> float:
        """Turning point on the left, the smallest displacement."""
        return self.centre - self.amplitude

    @property
    def highest(self) -> float:
        """Turning point on the right, the largest displacement."""
        return self.centre + self.amplitude

    @property
    def conicity(self) -> float:
        """Equivalent conicity by EN 15302."""
        return 0.5 * (2.0 * math.pi / self.period) ** 2

    def wavelength(self, rolling_radius: float, contact_spacing: float) -> float:
        """Wavelength (m) along the track, for a rolling radius and a distance between the contact points (m)."""
        return self.period * math.sqrt(rolling_radius * contact_spacing)


def equivalent_conicity(
    displacements: Array, radius_differences: Array, amplitude: float, *, centre_guess: float | None = None
) -> float:
    """Equivalent conicity by EN 15302 at an amplitude (half of peak to peak); see ``klingel_wave``.

    displacements : (n,) lateral, to the right, rising; radius_differences : (n,) of the rolling radii, right less left;
    amplitude : above 0. All in one unit of length.
    """
    return klingel_wave(
        RollingRadiusTable(displacements, radius_differences), amplitude, centre_guess=centre_guess
    ).conicity


def klingel_wave(
    radius_table: RollingRadiusTable, amplitude: float, *, centre_guess: float | None = None
) -> KlingelWave:
    """Klingel's wave of an amplitude (in the table's unit, half of peak to peak) from a table of rolling radius
    differences.

    centre_guess : where the centre is looked for, if several waves have this amplitude. Raises InputError where there
    is no wave: dr without a change of sign, dr that falls with the displacement, an amplitude whose wave leaves the
    table; or where there are several and ``centre_guess`` is not given.
    """
    amplitude = checked_number("amplitude", amplitude, "an amplitude above 0, half of peak to peak", 1e-12)
    first_displacement, last_displacement = radius_table.displacement_range
    if 0.0 <= 2.0 * amplitude - (last_displacement - first_displacement) <= AMPLITUDE_TOLERANCE * amplitude:
        amplitude = (last_displacement - first_displacement) / 2.0
    if 2.0 * amplitude > last_displacement - first_displacement:
        table_range = f"the table goes from {first_displacement:g} to {last_displacement:g}"
        allowed = f"is half of peak to peak, and {table_range}: it cannot hold the wave"
        raise InputError(radius_table.source, "amplitude", amplitude, allowed)
    waves = [
        wave
        for low in _turning_points(radius_table, amplitude)
        if (wave := _wave_from_turning_point(radius_table, low, amplitude)) is not None
    ]
    if not waves:
        return _without_wave(radius_table, amplitude)
    if len(waves) > 1 and centre_guess is None:
        centres = ", ".join(f"{wave.centre:.6g}" for wave in waves)
        allowed = f"has {len(waves)} waves, about {centres}: smooth the table, or choose one by near"
        raise InputError(radius_table.source, "amplitude", amplitude, allowed)
    return min(waves, key=lambda wave: abs(wave.centre - (centre_guess or 0.0)))


def _turning_points(radius_table: RollingRadiusTable, amplitude: float) -> list[float]:
    """Possible left turning points of waves of an amplitude: the potential there equals the potential at the right
    turning point.

    Between the rows of the table, the difference of both potentials is a parabola in the left turning point.
    """
    y, width = radius_table.displacements, 2.0 * amplitude
    candidates = np.unique(np.concatenate([y, y - width, [y[-1] - width]]))
    candidates = candidates[(candidates >= y[0]) & (candidates <= y[-1] - width)]
    points: list[float] = []
    for low, high in pairwise(candidates.tolist()):
        begin, middle, end = (
            radius_table.integral(low + share * (high - low) + width)
            - radius_table.integral(low + share * (high - low))
            for share in (0.0, 0.5, 1.0)
        )
        points += [float(low + share * (high - low)) for share in _parabola_roots(begin, middle, end)]
    if len(candidates) == 1:
        points = [float(candidates[0])]
    separate = [k for k in range(len(points)) if k == 0 or points[k] - points[k - 1] > AMPLITUDE_TOLERANCE * amplitude]
    return [points[k] for k in separate]


def _parabola_roots(begin_value: float, middle_value: float, end_value: float) -> list[float]:
    """Roots between 0 and 1 of the parabola with the given values at 0, 1/2 and 1; empty if it is zero everywhere."""
    bend, slope = (
        2.0 * (begin_value - 2.0 * middle_value + end_value),
        4.0 * middle_value - 3.0 * begin_value - end_value,
    )
    scale = max(abs(begin_value), abs(middle_value), abs(end_value))
    if scale == 0.0:
        return []
    if abs(bend) <= 1e-14 * abs(slope):
        roots = [-begin_value / slope] if slope else []
    elif (discriminant := slope * slope - 4.0 * bend * begin_value) < 0.0:
        roots = []
    else:
        half = -0.5 * (slope + math.copysign(math.sqrt(discriminant), slope))
        roots = [half / bend] + ([begin_value / half] if half else [])
    return sorted(min(max(root, 0.0), 1.0) for root in roots if -1e-12 <= root <= 1.0 + 1e-12)


def _wave_from_turning_point(
    radius_table: RollingRadiusTable, left_turning_point: float, amplitude: float
) -> KlingelWave | None:
    """The wave whose left turning point is ``left_turning_point``; None if the motion would stop before the other
    turning point.
    """
    y, dr = radius_table.section(left_turning_point, left_turning_point + 2.0 * amplitude)
    if dr[0] > 0.0 or dr[-1] < 0.0:
        return None
    length = np.diff(y)
    if y.size == 2:  # within one straight piece, which makes a sine
        slope = float(dr[1] - dr[0]) / (2.0 * amplitude)
        return (
            KlingelWave(amplitude, left_turning_point + amplitude, 2.0 * math.pi / math.sqrt(slope))
            if slope > 0.0
            else None
        )
    energy = _swing_energy(dr, length)
    if not ((energy[1:-1] > 0.0).all() and (_lowest_energy(dr, length, energy) > 0.0).all()):
        return None
    speed = np.sqrt(2.0 * energy)
    speed[0] = speed[-1] = 0.0
    moving = length > 0.0
    path_by_speed = length[moving] / (speed[1:] + speed[:-1])[moving]
    return KlingelWave(
        amplitude,
        left_turning_point + amplitude,
        2.0 * float(_crossing_times(path_by_speed, np.diff(dr)[moving] / length[moving]).sum()),
    )


def _swing_energy(radius_difference: Array, swing_lengths: Array) -> Array:
    """Energy v^2 / 2 (n,) at the rows of a swing. Each is summed from the nearer turning point, where it is small, to
    limit rounding."""
    work = swing_lengths * (radius_difference[1:] + radius_difference[:-1]) / 2.0
    from_left, from_right = -np.append(0.0, np.cumsum(work)), np.append(np.cumsum(work[::-1])[::-1], 0.0)
    return np.where(np.arange(len(radius_difference)) <= np.argmax(from_left), from_left, from_right)


def _lowest_energy(radius_difference: Array, swing_lengths: Array, swing_energy: Array) -> Array:
    """Energies at the maxima of the potential inside pieces of the table, where a falling difference
    ``radius_difference`` passes zero.
    """
    falls = (radius_difference[:-1] > 0.0) & (radius_difference[1:] < 0.0) & (swing_lengths > 0.0)
    distance_to_zero = (
        swing_lengths[falls] * radius_difference[:-1][falls] / (radius_difference[:-1] - radius_difference[1:])[falls]
    )
    return swing_energy[:-1][falls] - 0.5 * distance_to_zero * radius_difference[:-1][falls]


def _crossing_times(length_by_speeds: Array, difference_slope: Array) -> Array:
    """Times (n,) to cross each straight piece of the table; ``length_by_speeds`` : ratio of the piece's length to the
    sum of the speeds at both ends; difference_slope : of the rolling radius difference."""
    root = np.sqrt(np.abs(difference_slope))
    angle = root * length_by_speeds
    small, rising = angle < SERIES_LIMIT, difference_slope > 0.0
    safe = np.where(small, 1.0, root)
    across = np.where(rising, np.arctan(angle), np.arctanh(np.where(rising, 0.0, np.minimum(angle, 1.0 - 1e-16))))
    return 2.0 * np.where(small, length_by_speeds, across / safe)


def _without_wave(radius_table: RollingRadiusTable, amplitude: float) -> KlingelWave:
    """A wave of zero conicity if the wheels do not steer over the whole swing; otherwise raises the InputError that
    explains why there is no wave."""
    idle = _idle_centre(radius_table, amplitude)
    if idle is not None:
        return KlingelWave(amplitude, idle, math.inf)
    dr, (first_displacement, last_displacement) = radius_table.differences, radius_table.displacement_range
    rises = radius_table.difference(last_displacement, "left") - radius_table.difference(first_displacement)
    if (dr >= 0.0).all() or (dr <= 0.0).all():
        why = (
            f"has no wave: dr does not change its sign from {first_displacement:g} to {last_displacement:g}, "
            "so that nothing swings"
        )
    elif rises < 0.0:
        why = "has no wave: dr falls with the displacement; is it left less right? Right less left is wanted"
    else:
        table_range = f"from {first_displacement:g} to {last_displacement:g}"
        why = f"has no wave within the table, {table_range}: it would swing beyond, or not come across"
    raise InputError(radius_table.source, "amplitude", amplitude, why)


def _idle_centre(radius_table: RollingRadiusTable, amplitude: float) -> float | None:
    """Centre of an interval, the nearest to y = 0, in which the difference of rolling radii is zero and which is at
    least as wide as the swing; None if there is none."""
    y, zero = radius_table.displacements, radius_table.differences == 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], zero.astype(int), [0]])))
    stretches = [(float(y[a]), float(y[b - 1])) for a, b in edges.reshape(-1, 2)]
    wide = [
        (low + high) / 2.0 for low, high in stretches if high - low >= 2.0 * amplitude * (1.0 - AMPLITUDE_TOLERANCE)
    ]
    return min(wide, key=abs) if wide else None


def harmonic_linearised_conicity(
    displacements: Array, radius_differences: Array, amplitude: float, swing_centre: float = 0.0
) -> float:
    """Conicity of the cones whose rolling radius difference has the same first harmonic as the wheels', for lateral
    motion as ``amplitude`` times a sine.

    displacements : (n,) ascending, over the whole of the swing about ``swing_centre``, or from 0 on for wheels that are
    alike and a swing about 0; radius_differences : (n,) of the rolling radii, right less left. All in one unit of
    length.
    """
    displacements, radius_differences = np.asarray(displacements, float), np.asarray(radius_differences, float)
    if displacements[0] == 0.0:
        displacements = np.concatenate([-displacements[:0:-1], displacements])
        radius_differences = np.concatenate([-radius_differences[:0:-1], radius_differences])
    largest_amplitude = min(displacements[-1] - swing_centre, swing_centre - displacements[0])
    checked_quantity(
        "amplitude",
        amplitude,
        f"an amplitude above 0 and up to {largest_amplitude:g}, the table's",
        1e-12,
        largest_amplitude,
    )
    phase = 2.0 * math.pi * (np.arange(HARMONIC_PHASES) + 0.5) / HARMONIC_PHASES
    values = np.interp(swing_centre + amplitude * np.sin(phase), displacements, radius_differences)
    return float((values * np.sin(phase)).mean() / amplitude)


@dataclass(frozen=True)
class ConicityRow:
    """Equivalent conicity at one amplitude (m), by the standard and by the first harmonic, and the centre of the wave
    (m).

    spacing_error : difference of the standard's conicity on the table without every other row; NaN where that has no
    such wave.
    """

    amplitude: float
    centre: float
    period: float
    equivalent: float
    harmonic: float
    spacing_error: float


def conicity_row(
    radius_table: RollingRadiusTable, amplitude: float, *, centre_guess: float | None = None
) -> ConicityRow:
    """Equivalent conicity of a table at an amplitude, by the standard and by the first harmonic. Raises InputError as
    ``klingel_wave`` does."""
    wave = klingel_wave(radius_table, amplitude, centre_guess=centre_guess)
    harmonic = harmonic_linearised_conicity(
        radius_table.displacements, radius_table.differences, amplitude * (1.0 - 1e-12), wave.centre
    )
    try:
        coarse = klingel_wave(radius_table.without_every_second_row(), amplitude, centre_guess=wave.centre).conicity
    except InputError:
        coarse = math.nan
    return ConicityRow(amplitude, wave.centre, wave.period, wave.conicity, harmonic, abs(coarse - wave.conicity))
