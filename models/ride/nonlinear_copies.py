"""Monte Carlo simulation of a vehicle with nonlinear springs, or with tyres that may lift off: many copies on
independent random roads, integrated in time.

Motion is small, as in ``spatial_linear``, but for these springs and tyres, whose forces are taken as they are. The
classical Runge-Kutta method reads the road at half steps; these laws have corners, so its error falls with the square
of the step.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from models.ride.copies_kernel import POWERS_SUMMED, ForceCurves, ForceLaws, PushingTyres, march_copies
from models.ride.road_path import RoadPath, check_rates, road_path
from models.ride.statistical_linearisation import nonlinear_springs, statistically_linear
from models.road.excitation import RoadExcitation
from models.vehicles.kinematics import Kinematics
from models.vehicles.linear_vehicle import LinearVehicle, eigenvalues
from models.vehicles.spatial import Curve, PartOutput, SpatialOutput, SpatialVehicle, SpringDamper, Tyre, TyreOutput
from models.vehicles.spatial_linear import Gains, linearise, static_preloads

LARGEST_RATE_TIMES_STEP, LARGEST_STIFF_RATE_TIMES_STEP = 0.25, 0.5
"""Largest products of step and fastest rate: of the statistically linearised vehicle, and of the vehicle with its
springs as stiff as they can become. Deviations of a quarter car are then too large by 0.05 to 0.1 %, by the covariance
of the steps themselves."""
STEPS_PER_BLOCK = 200
"""Count of steps in a block, for which the road is generated at once."""
STEPS_PER_READING = 4
"""Count of steps from one reading of the outputs to the next, whose values are correlated anyway."""
SETTLING_EXPONENT = 9.0
"""Product of the slowest decay rate and the time that copies, begun at rest, run before they count."""
SLOWEST_DECAY_SHARE = 1e-6
"""Share of the largest decay rate below which a motion counts as having no restoring force."""


@dataclass(frozen=True)
class CopyStatistics:
    """Statistics of the outputs of the copies: for each copy (copies, p) the means of y, y^2, y^3 and y^4 over the
    counted time.

    step (s) of the runs, ``duration`` (s) that counts after ``settling_steps`` steps.
    """

    names: tuple[str, ...]
    moments: np.ndarray
    step: float
    duration: float
    settling_steps: int

    @property
    def mean(self) -> np.ndarray:
        """Means (p,) of the outputs."""
        return self.moments[0].mean(axis=0)

    @property
    def mean_error(self) -> np.ndarray:
        """Standard errors (p,) of the outputs' means, from the scatter between the independent copies."""
        return self.moments[0].std(axis=0, ddof=1) / len(self.moments[0]) ** 0.5

    @property
    def variance(self) -> np.ndarray:
        """Variances (p,) of the outputs about their means."""
        return self.about_mean().mean(axis=0)

    @property
    def error(self) -> np.ndarray:
        """Standard errors (p,) of the outputs' variances, from the scatter between the copies."""
        return self.about_mean().std(axis=0, ddof=1) / len(self.moments[0]) ** 0.5

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (p,) of the outputs."""
        return np.sqrt(self.variance)

    @property
    def kurtosis(self) -> np.ndarray:
        """Ratio (p,) of the fourth central moment to the squared variance: 3 for a Gaussian output."""
        first, second, third, fourth = self.moments.mean(axis=1)
        central = fourth - 4 * first * third + 6 * first**2 * second - 3 * first**4
        return central / self.variance**2

    def z(self, expected_deviation: np.ndarray) -> np.ndarray:
        """Standard scores (p,): the variances minus the squares of the given standard deviations (p,), divided by the
        standard errors."""
        return (self.variance - expected_deviation**2) / self.error

    def about_mean(self) -> np.ndarray:
        """Mean square (copies, p) of each copy's outputs about the mean of all copies."""
        first, second = self.moments[:2]
        return second - 2 * self.mean * first + self.mean**2


def copies_in_time(
    vehicle: SpatialVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    duration: float,
    *,
    copy_count: int = 500,
    seed: int = 0,
    longest_step: float | None = None,
) -> CopyStatistics:
    """Simulate the copies for ``duration`` (s), after a settling time in which they lose the memory of their initial
    state.

    longest_step : largest step (s); by itself it comes from the fastest rates.
    Raises InputError for damped tyres on a road whose heights have no rates.
    """
    check_rates(vehicle, road_excitation)
    replaced = statistically_linear(vehicle.with_tyres(pushes_only=False), road_excitation, speed).vehicle
    road = road_path(road_excitation, speed, longest_step or usual_step(vehicle, speed, replaced))
    settling, counted = int(np.ceil(settling_time(replaced) / road.step)), int(np.ceil(duration / road.step))
    march = CopiesMarch(vehicle, speed, road.step, copy_count)
    for number, portion in enumerate(road.blocks(STEPS_PER_BLOCK, copy_count, seed)):
        left = settling + counted - number * STEPS_PER_BLOCK
        march.march_over(portion[: 2 * left + 1], _steps_to_first_output(settling, number * STEPS_PER_BLOCK))
        if left <= STEPS_PER_BLOCK:
            break
    moments = march.sums.swapaxes(1, 2) / len(range(0, counted, STEPS_PER_READING))
    return CopyStatistics(march.plain.names, moments, road.step, counted * road.step, settling)


RERUN_SHARE = 0.5
"""Share of the copies that are simulated again with longer steps, to estimate the error of the step."""


def coarser_variances(
    vehicle: SpatialVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    fine_copies: CopyStatistics,
    step_factor: int,
    seed: int,
) -> np.ndarray:
    """Variances (k, p) of the outputs about their means for the first k copies, simulated again on the same roads with
    steps that are ``step_factor`` (2 or 4) times as long."""
    copies = len(fine_copies.moments[0])
    rerun_copies, road = (
        max(1, math.ceil(RERUN_SHARE * copies)),
        RoadPath(road_excitation, speed, fine_copies.step / 2.0),
    )
    settling, counted = (
        fine_copies.settling_steps // step_factor,
        round(fine_copies.duration / fine_copies.step) // step_factor,
    )
    block, reading_interval = STEPS_PER_BLOCK // step_factor, STEPS_PER_READING // step_factor
    march = CopiesMarch(vehicle, speed, step_factor * fine_copies.step, rerun_copies)
    for number, portion in enumerate(road.blocks(STEPS_PER_BLOCK, copies, seed)):
        left = settling + counted - number * block
        march.march_over(
            portion[: 2 * step_factor * left + 1 : step_factor, :, :rerun_copies].copy(),
            _steps_to_first_output(settling, number * block, reading_interval),
            reading_interval,
        )
        if left <= block:
            break
    moments = march.sums.swapaxes(1, 2) / len(range(0, counted, reading_interval))
    return replace(fine_copies, moments=moments).about_mean()


class CopiesMarch:
    """Time integration of copies of a vehicle, from rest, over random roads; ``sums`` (4, p, copies): sums of the
    powers of its outputs so far."""

    def __init__(self, vehicle: SpatialVehicle, speed: float, time_step: float, copy_count: int) -> None:
        springs = nonlinear_springs(vehicle)
        self.plain = linearise(vehicle, speed, {s.name: (s.stiffness, s.damping) for s in springs})
        self.laws, self.step = force_laws(vehicle, self.plain, springs, speed), time_step
        self.sums = np.zeros((POWERS_SUMMED, len(self.plain.outputs), copy_count))
        self.states: np.ndarray | None = None

    def march_over(
        self, road_paths: np.ndarray, first_counted_step: int, counting_stride: int = STEPS_PER_READING
    ) -> None:
        """Continue the motion over roads (2 steps + 1, 2 w, copies), read every half step; outputs count from step
        ``first_counted_step`` on."""
        if self.states is None:
            self.states = np.vstack([_static_positions(self.plain, road_paths[0])] * 2)
            self.states[len(self.plain.mass) :] = 0.0
        march_copies(self.states, road_paths, self.step, first_counted_step, counting_stride, self.laws, self.sums)


def usual_step(vehicle: SpatialVehicle, speed: float, linearised_vehicle: LinearVehicle) -> float:
    """Step (s) for a nonlinear vehicle, from the rates of its statistically linearised ``linearised_vehicle``."""
    return min(
        LARGEST_RATE_TIMES_STEP / float(abs(eigenvalues(linearised_vehicle)).max()),
        longest_resolving_step(vehicle, speed),
    )


def settling_time(linearised_vehicle: LinearVehicle) -> float:
    """Time (s) after which copies no longer depend on their initial state."""
    decay = abs(eigenvalues(linearised_vehicle).real)
    return SETTLING_EXPONENT / float(decay[decay > SLOWEST_DECAY_SHARE * decay.max()].min())


def longest_resolving_step(vehicle: SpatialVehicle, speed: float) -> float:
    """Longest step (s) that resolves the vehicle's motion when its springs are as stiff as they can become."""
    steepest = linearise(vehicle, speed, {s.name: _steepest_gains(s) for s in nonlinear_springs(vehicle)})
    return LARGEST_STIFF_RATE_TIMES_STEP / float(abs(eigenvalues(steepest)).max())


def _steps_to_first_output(settling_steps: int, completed_steps: int, counting_stride: int = STEPS_PER_READING) -> int:
    """Number of steps from the ``completed_steps`` ones to the next step at which outputs count."""
    return (
        settling_steps - completed_steps
        if completed_steps <= settling_steps
        else (settling_steps - completed_steps) % counting_stride
    )


def _static_positions(linear_vehicle: LinearVehicle, road_heights: np.ndarray) -> np.ndarray:
    """Positions (n, copies) of static equilibrium on a road (2 w, copies). Vehicles that start far above the road would
    oscillate for long."""
    heights = road_heights[: linear_vehicle.road_stiffness.shape[1]]
    return np.linalg.lstsq(linear_vehicle.stiffness, linear_vehicle.road_stiffness @ heights, rcond=1e-12)[0]


def _steepest_gains(spring: SpringDamper) -> Gains:
    """Largest stiffness (N/m) and damping (N s/m) of a spring's curves."""
    travel, rate = (_slopes_of_pieces(curve).max() for curve in (spring.travel_force, spring.rate_force))
    return spring.stiffness + travel, spring.damping + rate + spring.friction / spring.friction_rate


def _slopes_of_pieces(force_curve: Curve | None) -> np.ndarray:
    if force_curve is None:
        return np.zeros(1)
    _, slope, _, bends = force_curve.hinges()
    return slope + np.cumsum([0.0, *bends])


def force_laws(
    vehicle: SpatialVehicle, linear_vehicle: LinearVehicle, bent_springs: tuple[SpringDamper, ...], speed: float
) -> ForceLaws:
    """``ForceLaws`` of the vehicle for compiled loops; ``linear_vehicle`` is the vehicle without the nonlinear parts of
    these springs.
    """
    n = len(linear_vehicle.mass)
    watched = replace(vehicle, outputs=tuple(PartOutput(s.name, "travel", s.name) for s in bent_springs))
    rows = np.array([o.displacement_factors for o in linearise(watched, speed).outputs]).reshape(-1, n)
    pushing = [tyre for tyre in vehicle.tyres if tyre.pushes_only]
    kinematics = Kinematics(vehicle)
    heights = np.array([kinematics.shift(tyre.body, tyre.point)[2] for tyre in pushing]).reshape(-1, n)
    forced = (
        -linear_vehicle.stiffness,
        -linear_vehicle.damping,
        linear_vehicle.road_stiffness,
        linear_vehicle.road_damping,
        -rows.T,
        heights.T,
    )
    motion = np.linalg.solve(linear_vehicle.mass, np.hstack(forced))
    named_forces = [*(("force", s.name) for s in bent_springs), *(("tyre force", tyre.name) for tyre in pushing)]
    read = np.array([[float((o.kind, _part_of_output(o)) == force) for force in named_forces] for o in vehicle.outputs])
    read = np.hstack(
        [
            [
                np.concatenate(
                    [
                        o.displacement_factors,
                        o.rate_factors,
                        o.road_factors,
                        o.road_rate_factors,
                        o.acceleration_factors,
                    ]
                )
                for o in linear_vehicle.outputs
            ],
            read.reshape(len(linear_vehicle.outputs), -1),
        ]
    )
    return ForceLaws(
        rows,
        motion,
        read,
        _padded_curves([s.travel_force for s in bent_springs]),
        _padded_curves([s.rate_force for s in bent_springs]),
        np.array([s.friction for s in bent_springs], dtype=float),
        np.array([s.friction_rate for s in bent_springs], dtype=float),
        _pushing_tyres(vehicle, pushing, heights),
    )


def _part_of_output(vehicle_output: SpatialOutput) -> str:
    """Name of the spring or tyre whose force or travel an output reads; "" if none."""
    return (
        vehicle_output.part
        if isinstance(vehicle_output, PartOutput)
        else vehicle_output.tyre
        if isinstance(vehicle_output, TyreOutput)
        else ""
    )


def _pushing_tyres(vehicle: SpatialVehicle, tyres: Sequence[Tyre], wheel_rises: np.ndarray) -> PushingTyres:
    """``PushingTyres`` of tyres that only push; ``wheel_rises`` (u, n) : rise of each tyre's wheel per coordinate."""
    loads = static_preloads(vehicle).tyres if tyres else {}
    load, stiffness, damping = (
        np.array([(loads[tyre.name], tyre.stiffness, tyre.damping) for tyre in tyres], dtype=float)
        .reshape(-1, 3)
        .T.copy()
    )
    wheel = np.array([vehicle.tyres.index(tyre) for tyre in tyres], dtype=np.int64)
    return PushingTyres(wheel, load, stiffness, damping, wheel_rises)


def _padded_curves(force_curves: Sequence[Curve | None]) -> ForceCurves:
    """``ForceCurves`` of the springs, padded with bends of 0; a spring without a curve gets a curve that is 0
    everywhere.
    """
    known = [curve.hinges() if curve else (0.0, 0.0, (), ()) for curve in force_curves]
    most_corners = max((len(corners) for _, _, corners, _ in known), default=0)
    offset, slope = np.array([line for *line, _, _ in known], dtype=float).reshape(-1, 2).T.copy()
    corners, bends = np.zeros((len(known), most_corners)), np.zeros((len(known), most_corners))
    for i, (_, _, corners_of_curve, bent_by) in enumerate(known):
        corners[i, : len(corners_of_curve)], bends[i, : len(corners_of_curve)] = corners_of_curve, bent_by
    return ForceCurves(offset, slope, corners, bends)
