"""Covariance of a vehicle with nonlinear springs on a random road, by statistical linearisation.

Every spring-damper with curves or friction is replaced by the stiffness and damping that miss its force least in the
mean square where travel and rate are Gaussian with the covariance that the replaced vehicle itself has (the gains of
``gaussian_laws``; travel and its rate at one instant do not depend on each other). Laws that are not odd also have a
mean force: the vehicle then moves about a mean position of its own, at which its springs carry on average what the
statics ask for. Gains, covariance and mean are one fixed point, with and without gravity.

What the gains leave out of the forces is no part of the answer. How much it would matter is estimated: the left-out
force of each law, as noise with the law's own rate, through the replaced vehicle, by the variance of every output.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from models.core.errors import InputError, RunFailed
from models.ride.covariance import StationaryCovariance, stationary_covariance
from models.ride.excited import DelayedSystem, vehicle_with_road
from models.ride.gaussian_laws import linearised_rate_law, linearised_travel_law
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearOutput, LinearVehicle, WheelPosition
from models.vehicles.spatial import PartKind, PartOutput, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import Gains, linearise

GAIN_TOLERANCE = 1e-12
"""Largest relative change of a gain at which the fixed point counts as reached."""
LARGEST_ITERATION_COUNT = 400
FIRST_TRAVEL_DEVIATION, FIRST_RATE_DEVIATION = 0.02, 0.3
"""Standard deviations of travel (m) and rate (m/s) at which the first gains are computed: slopes at rest may leave a
vehicle undamped."""
GAUSSIAN_REMARK = "it is nearly Gaussian"
NOT_GAUSSIAN = "it is not Gaussian any more: no shares of time and exceedances from it"
ERROR_GRADES = ((0.01, 0.02, GAUSSIAN_REMARK), (0.05, 0.06, GAUSSIAN_REMARK), (0.1, 0.06, NOT_GAUSSIAN))
"""Share of an output's variance from forces that linearisation leaves out, largest relative error of its standard
deviation seen up to there, and remark. The errors are those against Monte Carlo of quarter cars: dampers of two slopes
and more, dry friction, stops, alone and together, on five levels of road at two speeds. Kurtosis, 3 for Gaussian
outputs, was 2.5 to 3.3 in the first two and up to 4 in the third."""
EXTRAPOLATION_ERROR = 0.15
"""Relative error of a standard deviation seen beyond these shares, with stops that are met at every second wave;
kurtosis went up to 6."""
MOST_NEWTON_STEPS = 60
HARMONIC_RATIO = 2.0
"""Ratio of the frequency of left-out forces to that of the spring's motion, at least: they are harmonics of this
motion."""


@dataclass(frozen=True)
class BentSpringResult:
    """A nonlinear spring (curves or friction) in random motion: its equivalent stiffness and damping (N/m, N s/m), mean
    travel (m) and mean force (N).

    deviation, rate : standard deviations of travel (m) and its rate (m/s). ``force``: mean force less the preload (N).
    ``left_out``: share of the variance of its force that the gains leave out.
    """

    equivalent_gains: Gains
    travel: float
    deviation: float
    rate: float
    force: float
    left_out: float


@dataclass(frozen=True)
class StatisticallyLinear:
    """Statistically linearised vehicle, its covariance and its mean position.

    mean, left_out (p,), by output: mean beside the equilibrium on a flat road (0 for accelerations), and the variance
    that the left-out forces would add, by its own; ``sentences`` judge each output by it. ``gain_changes``: largest
    relative change of a gain, iteration after iteration; the last one is that of a fixed point.
    """

    vehicle: LinearVehicle
    system: DelayedSystem
    covariance: StationaryCovariance
    mean: np.ndarray
    springs: dict[str, BentSpringResult]
    left_out: np.ndarray
    sentences: tuple[str, ...]
    gain_changes: tuple[float, ...]

    @property
    def contraction(self) -> float:
        """Largest ratio of a gain change to that of the iteration before, in the later half of the changes above
        rounding."""
        ratios = [
            change_after / change_before
            for change_before, change_after in pairwise(self.gain_changes)
            if change_after > 100.0 * GAIN_TOLERANCE
        ]
        return max(ratios[len(ratios) // 2 :], default=0.0)

    @property
    def fixed_point_distance(self) -> float:
        """Largest relative distance of the gains from the fixed point: last change * c / (1 - c) with contraction c,
        Banach's bound."""
        c = self.contraction
        return self.gain_changes[-1] * c / (1.0 - c) if c < 1.0 else np.inf


def nonlinear_springs(vehicle: SpatialVehicle) -> tuple[SpringDamper, ...]:
    """Springs of the vehicle that have curves or friction."""
    return tuple(spring for spring in vehicle.springs if spring.is_nonlinear)


def statistically_linear(
    vehicle: SpatialVehicle, road_excitation: RoadExcitation, speed: float, start_scale: float = 1.0
) -> StatisticallyLinear:
    """Statistical linearisation of a vehicle with nonlinear springs on a road, at a constant speed (m/s).

    start_scale : of the travels and rates that the first gains are taken at. Where different ones lead to different
        fixed points, the vehicle has several ways to move, and no one covariance. InputError for tyres that may lift,
        which nothing linear stands for. Raises Unstable where a replaced vehicle leaves its equilibrium on its own,
        RunFailed where no fixed point is found.
    """
    if vehicle.lifts:
        raise InputError(
            vehicle.name,
            "tyres",
            None,
            "may lift, and no linear vehicle stands for that: take copies in time, or tyres that stay on the road",
        )
    return _FixedPointSearch(vehicle, road_excitation, speed).iterate_to_fixed_point(start_scale)


LinearisedLaw = tuple[float, float, float]
"""Statistical linearisation of a force law by ``gaussian_laws``: mean force, gain, and variance of the remaining
force."""


@dataclass
class _SpringMoments:
    """Moments of the nonlinear springs' motion: mean travel (m), and standard deviations of travel (m) and rate (m/s),
    each (springs,)."""

    mean: np.ndarray
    travel: np.ndarray
    rate: np.ndarray


class _FixedPointSearch:
    """Fixed-point search for the equivalent gains of one vehicle, road and speed; extra outputs read the motion of the
    nonlinear springs."""

    def __init__(self, vehicle: SpatialVehicle, road_excitation: RoadExcitation, speed: float) -> None:
        self.vehicle, self.excitation, self.speed = vehicle, road_excitation, speed
        self.springs = nonlinear_springs(vehicle)
        kinds: tuple[PartKind, ...] = ("travel", "travel rate")
        watched = [PartOutput(f"{kind} of {s.name}", kind, s.name) for kind in kinds for s in self.springs]
        self.watched = replace(vehicle, outputs=(*vehicle.outputs, *watched))
        self.plain = linearise(self.watched, speed, {s.name: (s.stiffness, s.damping) for s in self.springs})
        with_forces = self.plain.outputs[len(vehicle.outputs) :][: len(self.springs)]
        self.rows = np.array([output.displacement_factors for output in with_forces]).reshape(-1, len(self.plain.mass))

    def iterate_to_fixed_point(self, start_scale: float) -> StatisticallyLinear:
        """Iterate the gains to the fixed point; returns the linearised vehicle."""
        count = len(self.springs)
        first = _SpringMoments(
            np.zeros(count),
            np.full(count, start_scale * FIRST_TRAVEL_DEVIATION),
            np.full(count, start_scale * FIRST_RATE_DEVIATION),
        )
        gains, position = self._equivalent_gains(first), np.zeros(len(self.plain.mass))
        changes: list[float] = []
        relaxation_factor = 1.0
        while not changes or changes[-1] > GAIN_TOLERANCE:
            moments, position = self._spring_moments(gains, position)
            wanted = self._equivalent_gains(moments)
            changes.append(_largest_gain_change(wanted, gains))
            if len(changes) >= LARGEST_ITERATION_COUNT:
                raise RunFailed(
                    "statistical linearisation",
                    f"gains still change by {changes[-1]:.1e} after {LARGEST_ITERATION_COUNT} "
                    "iterations: the vehicle has no one way to move on this road",
                )
            if len(changes) > 1 and changes[-1] > 0.9 * changes[-2] and changes[-1] > GAIN_TOLERANCE:
                relaxation_factor = max(0.5 * relaxation_factor, 0.1)
            gains = gains + relaxation_factor * (wanted - gains)
        return self._result(gains, moments, position, changes)

    def _equivalent_gains(self, spring_moments: _SpringMoments) -> np.ndarray:
        """Equivalent stiffness and damping (springs, 2) of the nonlinear springs at given moments of their motion."""
        laws = zip(self.springs, self._linearised_laws(spring_moments), strict=True)
        rows = [(s.stiffness + travel[1], s.damping + rate[1]) for s, (travel, rate) in laws]
        return np.array(rows).reshape(-1, 2)

    def _linearised_laws(self, spring_moments: _SpringMoments) -> list[tuple[LinearisedLaw, LinearisedLaw]]:
        """Statistical linearisation of each spring's force laws over travel and over rate: mean force, gain, and
        variance of the remaining force."""
        moments_by_spring = zip(
            self.springs, spring_moments.mean, spring_moments.travel, spring_moments.rate, strict=True
        )
        return [
            (linearised_travel_law(s, mean, travel), linearised_rate_law(s, rate))
            for s, mean, travel, rate in moments_by_spring
        ]

    def _linearised_vehicle(self, equivalent_gains: np.ndarray, vehicle: SpatialVehicle) -> LinearVehicle:
        named = {s.name: (float(k), float(c)) for s, (k, c) in zip(self.springs, equivalent_gains, strict=True)}
        return linearise(vehicle, self.speed, named)

    def _spring_moments(
        self, equivalent_gains: np.ndarray, mean_position: np.ndarray
    ) -> tuple[_SpringMoments, np.ndarray]:
        """Moments of the springs' motion in the linearised vehicle, and its mean position (n,)."""
        linear = self._linearised_vehicle(equivalent_gains, self.watched)
        deviation = stationary_covariance(vehicle_with_road(linear, self.excitation, self.speed)).deviation[
            len(self.vehicle.outputs) :
        ]
        if not np.isfinite(deviation).all():
            raise RunFailed("statistical linearisation", "the travel of a bent spring has no finite variance here")
        travel, rate = np.split(deviation, 2)
        mean_position = self._mean_position(travel, rate, mean_position)
        return _SpringMoments(self.rows @ mean_position, travel, rate), mean_position

    def _mean_position(self, mean_travels: np.ndarray, mean_rates: np.ndarray, mean_position: np.ndarray) -> np.ndarray:
        """Mean position (n,) in which all mean forces are in equilibrium, by Newton's method; unconstrained motions
        stay 0."""
        damper = np.array([linearised_rate_law(s, r)[0] for s, r in zip(self.springs, mean_rates, strict=True)])
        for _ in range(MOST_NEWTON_STEPS):
            laws = [
                linearised_travel_law(s, m, d)
                for s, m, d in zip(self.springs, self.rows @ mean_position, mean_travels, strict=True)
            ]
            force, gain = np.array([law[:2] for law in laws]).reshape(-1, 2).T
            left = self.plain.stiffness @ mean_position + self.rows.T @ (force + damper)
            step = np.linalg.lstsq(self.plain.stiffness + self.rows.T * gain @ self.rows, left, rcond=1e-12)[0]
            mean_position = mean_position - step
            if abs(step).max(initial=0.0) <= 1e-15 + 1e-13 * abs(mean_position).max(initial=0.0):
                return mean_position
        raise RunFailed("statistical linearisation", "no mean position balances the mean forces of the bent springs")

    def _result(
        self,
        equivalent_gains: np.ndarray,
        spring_moments: _SpringMoments,
        mean_position: np.ndarray,
        gain_changes: list[float],
    ) -> StatisticallyLinear:
        linear = self._linearised_vehicle(equivalent_gains, self.vehicle)
        system = vehicle_with_road(linear, self.excitation, self.speed)
        covariance = stationary_covariance(system)
        left = self._left_out(linear, spring_moments, system, covariance)
        springs = {
            s.name: self._spring_in_motion(i, equivalent_gains[i], spring_moments) for i, s in enumerate(self.springs)
        }
        outputs = zip(covariance.names, left, covariance.status, strict=True)
        sentences = tuple(_left_out_sentence(*output) for output in outputs)
        return StatisticallyLinear(
            linear,
            system,
            covariance,
            self._output_means(springs, linear, mean_position),
            springs,
            left,
            sentences,
            tuple(gain_changes),
        )

    def _spring_in_motion(
        self, spring_index: int, equivalent_gains: np.ndarray, spring_moments: _SpringMoments
    ) -> BentSpringResult:
        s, mean, d, r = (
            self.springs[spring_index],
            float(spring_moments.mean[spring_index]),
            float(spring_moments.travel[spring_index]),
            float(spring_moments.rate[spring_index]),
        )
        travel, rate = self._linearised_laws(spring_moments)[spring_index]
        lost = travel[2] + rate[2]
        total = lost + (equivalent_gains[0] * d) ** 2 + (equivalent_gains[1] * r) ** 2
        return BentSpringResult(
            (float(equivalent_gains[0]), float(equivalent_gains[1])),
            mean,
            d,
            r,
            s.stiffness * mean + travel[0] + rate[0],
            float(lost / total) if total else 0.0,
        )

    def _output_means(
        self, springs: dict[str, BentSpringResult], linearised_vehicle: LinearVehicle, mean_position: np.ndarray
    ) -> np.ndarray:
        """Means (p,) of the outputs. The mean force of a nonlinear spring is not its gain times its mean travel."""
        means = np.array([output.displacement_factors @ mean_position for output in linearised_vehicle.outputs])
        for i, spec in enumerate(self.vehicle.outputs):
            if isinstance(spec, PartOutput) and spec.kind == "force" and spec.part in springs:
                means[i] = springs[spec.part].force
        return means

    def _left_out(
        self,
        linearised_vehicle: LinearVehicle,
        spring_moments: _SpringMoments,
        delayed_system: DelayedSystem,
        covariance: StationaryCovariance,
    ) -> np.ndarray:
        """Ratios (p,) of the variance that the left-out forces would add to each output to the output's own variance;
        each force law counts separately."""
        if not self.springs:
            return np.zeros(len(linearised_vehicle.outputs))
        n = len(linearised_vehicle.mass)
        jerk = self.rows @ delayed_system.A[n : 2 * n]
        change = np.sqrt(np.einsum("si,ij,sj->s", jerk, covariance.P, jerk).clip(0.0))
        corners = np.concatenate(
            [
                _corner_frequency(spring_moments.rate, spring_moments.travel),
                _corner_frequency(change, spring_moments.rate),
            ]
        )
        lost = np.array([[law[2] for law in laws] for laws in self._linearised_laws(spring_moments)]).T.ravel()
        forced = _vehicle_under_forces(
            linearised_vehicle, np.vstack([self.rows, self.rows]), self._spring_force_outputs()
        )
        noise = np.diag(np.sqrt(2.0 * corners * lost))
        added = stationary_covariance(
            vehicle_with_road(forced, RoadExcitation(-np.diag(corners), noise, (np.eye(len(corners)),), (0.0,)), 1.0)
        )
        usable = np.isfinite(covariance.variance) & (covariance.variance > 0) & np.isfinite(added.variance)
        return np.divide(added.variance, covariance.variance, out=np.zeros(len(usable)), where=usable)

    def _spring_force_outputs(self) -> np.ndarray:
        """Matrix (p, 2 springs) with 1 where an output is the force of this nonlinear spring."""
        names = [s.name for s in self.springs] * 2
        return np.array(
            [
                [float(isinstance(spec, PartOutput) and spec.kind == "force" and spec.part == name) for name in names]
                for spec in self.vehicle.outputs
            ]
        )


def _corner_frequency(rate_deviation: np.ndarray, travel_deviation: np.ndarray) -> np.ndarray:
    """Corner frequency (1/s) of the spectrum of a left-out force, from the standard deviations of the spring's motion
    and of its rate."""
    return HARMONIC_RATIO * np.divide(
        rate_deviation, travel_deviation, out=np.ones_like(rate_deviation), where=travel_deviation > 0
    )


def _vehicle_under_forces(
    linearised_vehicle: LinearVehicle, output_rows: np.ndarray, direct_effects: np.ndarray
) -> LinearVehicle:
    """The vehicle excited by forces along rows (f, n) instead of road heights; ``direct_effects`` (p, f): direct effect
    of the forces on the outputs."""
    no_roads = np.zeros(len(output_rows))
    outputs = tuple(
        LinearOutput(
            o.name, o.unit, o.kind, o.acceleration_factors, o.rate_factors, o.displacement_factors, read, no_roads
        )
        for o, read in zip(linearised_vehicle.outputs, direct_effects, strict=True)
    )
    wheels = tuple(WheelPosition(str(i), 0.0, 0.0, 0) for i in range(len(output_rows)))
    return replace(
        linearised_vehicle,
        road_stiffness=-output_rows.T,
        road_damping=np.zeros(output_rows.T.shape),
        wheels=wheels,
        outputs=outputs,
    )


def _largest_gain_change(wanted_gains: np.ndarray, equivalent_gains: np.ndarray) -> float:
    """Largest relative change of a gain; a very small gain is related to the largest gain of its kind instead."""
    size = np.maximum(abs(wanted_gains), 1e-6 * abs(wanted_gains).max(axis=0, initial=np.finfo(float).tiny))
    return float((abs(wanted_gains - equivalent_gains) / size).max(initial=0.0))


def _left_out_sentence(spring_name: str, left_out_share: float, variance_status: str) -> str:
    """Sentence on how much the left-out share of force may change an output's standard deviation."""
    if variance_status != "finite":
        return f"{spring_name}: {variance_status}, so that there is no deviation to judge"
    opening = (
        f"{spring_name}: forces that the replaced springs leave out would add {100 * left_out_share:.2g} % "
        "to its variance: "
    )
    for largest_share, error, shape in ERROR_GRADES:
        if left_out_share <= largest_share:
            return opening + f"its deviation is good to {100 * error:.0f} %, and {shape}"
    return opening + (
        f"the covariance is no longer good (deviations were found up to {100 * EXTRAPOLATION_ERROR:.0f} % off, and far "
        "from Gaussian): take Monte Carlo"
    )


def largest_error_seen(left_out_share: float) -> float:
    """Largest relative error of an output's standard deviation that tests have seen at this share of left-out
    forces."""
    return next(
        (error for largest_share, error, _ in ERROR_GRADES if left_out_share <= largest_share), EXTRAPOLATION_ERROR
    )
