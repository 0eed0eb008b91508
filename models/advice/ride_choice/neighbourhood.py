"""Changes by leaving effects out near a ride scene: between its speeds, and with vehicle parameters a few per cent off.

A change e of a deviation is told by sums over frequencies, J = sum of |H(w) u(w)|^2, H the outputs by the heights u of
the road, for the whole scene and for what is left. One solution tells the slopes of e by all parameters and at all
speeds. Signs of the slopes name the corner of the box of parameters in which e is the largest: it is looked at as it
is.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigvals

from models.advice.ride_choice.parameters import PARAMETER_ERROR, Parameter, scaled_vehicle, uncertain_parameters
from models.advice.ride_choice.reduced import ReducedVehicle, Vehicles, speed_if_needed
from models.advice.ride_choice.response import Response
from models.advice.ride_choice.slopes import Sensitivity, Shifts
from models.advice.ride_choice.waves import at_axles, filter_states, frequency_panels, variances, weighting_factors
from models.road.excitation import RoadExcitation
from models.systems.ride.reduced_scene import ReducedScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle

LOBE_FREQUENCY, LEAST_SPEEDS = 12.0, 10
"""Frequency (Hz) of waves that turn by at most an eighth between axles from one speed to the next, and the least number
of speeds.
"""
SLOPE_SPEEDS = 9
"""Number of speeds at which sensitivities to parameters are computed."""
FREQUENCY_ENDS = 1e-3, 1e5
"""Lowest and highest frequency of integration, as ratios to the slowest and the fastest eigenvalue."""
ROUNDING_SHARE = 1e-9
"""Share of the largest sensitivity up to which a sensitivity is only rounding."""


def speeds_between(scene: ReducedScene, listed_speeds: np.ndarray) -> np.ndarray:
    """The listed speeds (m/s), and enough speeds between the slowest and the fastest to resolve the effect of the delay
    between axles.
    """
    low, high = float(listed_speeds.min()), float(listed_speeds.max())
    if low == high:
        return np.array([low])
    length = max(scene.excitation().lengths)
    turns = 8.0 * LOBE_FREQUENCY * length * (1.0 / low - 1.0 / high)
    slow = 1.0 / np.linspace(1.0 / high, 1.0 / low, int(np.ceil(turns)) + 1)
    return np.unique(np.concatenate([listed_speeds, slow, np.geomspace(low, high, LEAST_SPEEDS)]).round(12))


@dataclass(frozen=True)
class Spectra:
    """Variances (speeds, quantities) of a scene, and their slopes (v, q, p): first-order changes of the variances if
    each parameter is off by itself.
    """

    variances: np.ndarray
    slopes: np.ndarray


class Neighbourhood:
    """Quantities of a ride scene at all speeds (m/s) of its range, and with parameters off. Quantities are outputs with
    the names of their weightings, "" for none.

    perturbed_vehicle_count : number of vehicles with parameters off that were built.
    """

    def __init__(
        self,
        scene: ReducedScene,
        listed_speeds: np.ndarray,
        quantities: Sequence[tuple[int, str]],
        vehicles: Vehicles | None = None,
    ) -> None:
        self.scene, self.quantities = scene, quantities
        self.speeds = speeds_between(scene, listed_speeds)
        self.vehicles = Vehicles(scene.vehicle, float(self.speeds[0])) if vehicles is None else vehicles
        self.perturbed_vehicle_count = 0
        self.parameters = uncertain_parameters(scene.vehicle)
        self.slope_speeds = self.speeds[
            np.unique(np.linspace(0, len(self.speeds) - 1, SLOPE_SPEEDS).round().astype(int))
        ]
        self._shifts: dict[Hashable, Shifts] = {}
        self.full_variances, self.spectra_at_slope_speeds = self._variances(scene, self.vehicles), self._slopes(scene)

    def changes(
        self, reduced_scene: ReducedScene, parameter_factors: Mapping[Parameter, float] | None = None
    ) -> np.ndarray:
        """Relative changes (v, q) of standard deviations from the full to the reduced scene; ``parameter_factors`` : of
        parameters that are off in both scenes.
        """
        if not parameter_factors:
            return np.asarray(np.sqrt(self._variances(reduced_scene, self.vehicles) / self.full_variances) - 1.0)
        scene, reduced_scene = (
            replace(any_scene, vehicle=scaled_vehicle(any_scene.vehicle, parameter_factors))
            for any_scene in (self.scene, reduced_scene)
        )
        vehicles = Vehicles(scene.vehicle, float(self.speeds[0]), self.vehicles.roads)
        changes = np.sqrt(self._variances(reduced_scene, vehicles) / self._variances(scene, vehicles)) - 1.0
        self.perturbed_vehicle_count += len(vehicles)
        return np.asarray(changes)

    def corners(self, reduced_scene: ReducedScene) -> list[dict[Parameter, float]]:
        """For each quantity, the factors of all parameters with which its change is the largest, to first order, at any
        of a few speeds.
        """
        reduced, full = self._slopes(reduced_scene), self.spectra_at_slope_speeds
        ratio = np.sqrt(reduced.variances / full.variances)
        logs = [spectra.slopes / spectra.variances[..., None] for spectra in (reduced, full)]
        slopes = ratio[..., None] / 2 * (logs[0] - logs[1])
        worst = (abs(ratio - 1) + abs(slopes).sum(axis=2)).argmax(axis=0)
        signs = [_signs_of_slopes(slopes[i, q]) * (1.0 if ratio[i, q] >= 1 else -1.0) for q, i in enumerate(worst)]
        return [dict(zip(self.parameters, 1.0 + PARAMETER_ERROR * sign, strict=True)) for sign in signs]

    def _variances(self, scene: ReducedScene, vehicles: Vehicles) -> np.ndarray:
        """Variances (v, q) of a scene's quantities at all speeds."""
        groups = _speeds_with_same_matrices(scene.vehicle, self.speeds)
        return np.concatenate([self._frequency_sum(scene, vehicles, speeds).variances for speeds in groups])

    def _frequency_sum(self, scene: ReducedScene, vehicles: Vehicles, speeds: np.ndarray) -> "FrequencySum":
        return FrequencySum(
            vehicles.roads.excitation_of(scene),
            vehicles.reduced_vehicle_of(scene, float(speeds[0])),
            self.quantities,
            speeds,
        )

    def _slopes(self, scene: ReducedScene) -> Spectra:
        """Variances of a scene's quantities at a few speeds, with their first-order changes by each parameter that is
        off.
        """
        variances, slopes = [], []
        for speeds in _speeds_with_same_matrices(scene.vehicle, self.slope_speeds):
            total, vehicle = (
                self._frequency_sum(scene, self.vehicles, speeds),
                self.vehicles.reduced_vehicle_of(scene, float(speeds[0])),
            )
            sensitivity = Sensitivity(total.response, total.heights(), total.weights, vehicle.N)
            inert = [group != "bodies" or name not in scene.massless for group, name, _ in self.parameters]
            variances.append(total.variances)
            slopes.append(sensitivity.slopes(self._shifts_of(scene.vehicle, float(speeds[0])), np.array(inert)))
        return Spectra(np.concatenate(variances), np.concatenate(slopes))

    def _shifts_of(self, vehicle: SpatialVehicle, speed: float) -> Shifts:
        """Changes of a vehicle's matrices with all parameters. The full vehicle's changes are used where only bars and
        the damping of tyres are removed and gravity is absent.
        """
        full_vehicle = self.scene.vehicle
        if (
            not full_vehicle.gravity
            and replace(vehicle, bars=full_vehicle.bars, tyres=full_vehicle.tyres) == full_vehicle
        ):
            present_parameters = set(uncertain_parameters(vehicle))
            return self._parameter_shifts(full_vehicle, speed).only(
                np.array([parameter in present_parameters for parameter in self.parameters])
            )
        return self._parameter_shifts(vehicle, speed)

    def _parameter_shifts(self, vehicle: SpatialVehicle, speed: float) -> Shifts:
        """Changes of a vehicle's matrices with all parameters, computed once for each vehicle and speed."""
        key = vehicle, speed_if_needed(vehicle, speed)
        if key not in self._shifts:
            linear, factor = self.vehicles.linear, 1.0 + PARAMETER_ERROR
            changed_vehicles = [
                linear(scaled_vehicle(vehicle, {parameter: factor}), speed) for parameter in self.parameters
            ]
            self._shifts[key] = Shifts.from_vehicles(
                linear(vehicle, speed), changed_vehicles, [row for row, _ in self.quantities]
            )
        return self._shifts[key]


class FrequencySum:
    """Variances as sums over frequencies (w,) for a reduced scene at speeds (m/s)."""

    def __init__(
        self,
        excitation: RoadExcitation,
        vehicle: ReducedVehicle,
        quantities: Sequence[tuple[int, str]],
        speeds: np.ndarray,
    ) -> None:
        self.excitation, self.speeds = excitation, speeds
        rates = vehicle.modes.rates if vehicle.modes else _vehicle_eigenvalues(vehicle.linear)
        ends = FREQUENCY_ENDS[0] * abs(rates).min(), FREQUENCY_ENDS[1] * abs(rates).max()
        self.omega, weights, self.is_independent = frequency_panels(
            rates, max(self.excitation.lengths) / float(speeds[0]), ends
        )
        factors = weighting_factors([name for _, name in quantities], self.omega).T
        self.weights = weights[:, None] * abs(factors) ** 2 / np.pi
        self.response = Response(vehicle, [row for row, _ in quantities], self.omega)

    @property
    def variances(self) -> np.ndarray:
        """Variances (v, q) of the quantities at each speed."""
        H = np.sqrt(self.weights)[..., None] * self.response.H
        rows = H.reshape(-1, H.shape[2])
        gains = [(rows @ heights).reshape(*H.shape[:2], -1) for heights in self.excitation.heights]
        return variances(gains, self.excitation, self.speeds, self.omega, self.is_independent)

    def heights(self) -> np.ndarray:
        """Transfer functions (v, w, wheels, k) from unit noises to road heights under the wheels."""
        states_of_axle = filter_states(self.excitation, self.speeds, self.omega)
        road = at_axles(states_of_axle, self.excitation, self.speeds, self.omega, self.is_independent)
        return np.asarray(np.hstack(self.excitation.heights) @ road)


def _signs_of_slopes(slopes: np.ndarray) -> np.ndarray:
    """Signs of sensitivities (p,): 1 or -1; 1 also where a sensitivity vanishes, since its sign would come from
    rounding.
    """
    return np.where(slopes < -ROUNDING_SHARE * abs(slopes).max(initial=0.0), -1.0, 1.0)


def _speeds_with_same_matrices(vehicle: SpatialVehicle, speeds: np.ndarray) -> list[np.ndarray]:
    """Groups of speeds (m/s) at which the vehicle has the same matrices."""
    return [speeds] if speed_if_needed(vehicle, 0.0) is None else [speeds[[i]] for i in range(len(speeds))]


def _vehicle_eigenvalues(vehicle: LinearVehicle) -> np.ndarray:
    """Finite eigenvalues (1/s) of a linear vehicle; massless bodies reduce their number."""
    n = len(vehicle.mass)
    left = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), vehicle.mass]])
    right = np.block([[np.zeros((n, n)), np.eye(n)], [-vehicle.stiffness, -vehicle.damping]])
    rates = eigvals(right, left)
    rates = rates[np.isfinite(rates)]
    return rates[abs(rates) < 1e9]
