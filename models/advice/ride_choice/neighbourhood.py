"""Changes by leaving effects out, near a scene: between its speeds, and with parameters a few per cent off.

A change e of a deviation is told by sums over frequencies, J = sum of |H(w) u(w)|^2, H the outputs by the heights u of
the road, for the whole scene and for what is left. With Z q = B u the dynamic stiffness and y = C q, a parameter moves
H by dC q - (C / Z) (dZ q - dB), so that one solution tells the slopes of e by all parameters and at all speeds. Signs
of the slopes name the corner of the box of parameters in which e is the largest: it is looked at as it is.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigvals

from models.advice.ride_choice.reduced import constrain
from models.advice.ride_choice.waves import at_axles, filtered, frequencies, weighting_factors
from models.systems.ride.reduced_scene import ReducedScene
from models.vehicles.linear_vehicle import LinearVehicle, Rows
from models.vehicles.spatial import SpatialVehicle

OFF = 0.05
"""Share by which every mass, inertia, stiffness and damping may be off, each for itself."""
PARTS = {
    "bodies": ("mass", "inertia"),
    "springs": ("stiffness", "damping"),
    "tyres": ("stiffness", "damping"),
    "bars": ("stiffness", "damping"),
}
"""Parameters of a vehicle's parts."""
LOBES, EVEN = 12.0, 10
"""Speeds so close that waves of this frequency (Hz) turn by an eighth between axles, and at least so many."""
FEW = 9
"""Speeds at which slopes are told."""
ENDS = 1e-3, 1e5
"""First and last frequency, by the slowest and the fastest motion."""

Parameter = tuple[str, str, str]
"""Group, name and key of a value, as in ("springs", "front left", "damping")."""


def parameters(vehicle: SpatialVehicle) -> list[Parameter]:
    """All values that may be off."""
    return [
        (group, part.name, key)
        for group, keys in PARTS.items()
        for part in getattr(vehicle, group)
        for key in keys
        if np.any(getattr(part, key))
    ]


def changed(vehicle: SpatialVehicle, factors: Mapping[Parameter, float]) -> SpatialVehicle:
    """The vehicle with these values so many times as large; those that it has not are passed over."""

    def part(group: str, before: Any) -> Any:
        known = [key for key in PARTS[group] if (group, before.name, key) in factors]
        return replace(before, **{k: _times(getattr(before, k), factors[group, before.name, k]) for k in known})

    groups: dict[str, Any] = {group: tuple(part(group, each) for each in getattr(vehicle, group)) for group in PARTS}
    return replace(vehicle, **groups)


def _times(value: Any, factor: float) -> Any:
    return tuple(_times(each, factor) for each in value) if isinstance(value, tuple) else value * factor


def speeds_between(scene: ReducedScene, listed: np.ndarray) -> np.ndarray:
    """The listed speeds (m/s) and as many between the first and the last as tell how the axles' delay goes on."""
    low, high = float(listed.min()), float(listed.max())
    if low == high:
        return np.array([low])
    length = max(scene.excitation().lengths)
    turns = 8.0 * LOBES * length * (1.0 / low - 1.0 / high)
    slow = 1.0 / np.linspace(1.0 / high, 1.0 / low, int(np.ceil(turns)) + 1)
    return np.unique(np.concatenate([listed, slow, np.geomspace(low, high, EVEN)]).round(12))


@dataclass(frozen=True)
class Spectra:
    """Variances (speeds, quantities) of a scene, and what each parameter, so much off, adds to them (v, q, p)."""

    variances: np.ndarray
    slopes: np.ndarray


class Neighbourhood:
    """A scene's quantities (outputs with the names of their weightings, or "") at all speeds (m/s) of its range."""

    def __init__(self, scene: ReducedScene, listed: np.ndarray, quantities: list[tuple[int, str]]) -> None:
        self.scene, self.quantities = scene, quantities
        self.speeds = speeds_between(scene, listed)
        self.parameters = parameters(scene.vehicle)
        self.few = self.speeds[np.unique(np.linspace(0, len(self.speeds) - 1, FEW).round().astype(int))]
        self.whole, self.at_few = self.spectra(scene, self.speeds), self.spectra(scene, self.few, True)

    def changes(self, reduced: ReducedScene, factors: Mapping[Parameter, float] | None = None) -> np.ndarray:
        """Relative changes (v, q) of deviations by what is left; with parameters that are off in both."""
        full = self.whole if factors is None else self.spectra(_off(self.scene, factors), self.speeds)
        left = self.spectra(_off(reduced, factors or {}), self.speeds)
        return np.sqrt(left.variances / full.variances) - 1.0

    def corners(self, reduced: ReducedScene) -> list[dict[Parameter, float]]:
        """Factors of all parameters that make each quantity's change the largest, to first order, at any of a few
        speeds."""
        left, full = self.spectra(reduced, self.few, True), self.at_few
        ratio = np.sqrt(left.variances / full.variances)
        logs = [spectra.slopes / spectra.variances[..., None] for spectra in (left, full)]
        slopes = ratio[..., None] / 2 * (logs[0] - logs[1])
        worst = (abs(ratio - 1) + abs(slopes).sum(axis=2)).argmax(axis=0)
        signs = [np.sign(slopes[i, q]) * (1.0 if ratio[i, q] >= 1 else -1.0) for q, i in enumerate(worst)]
        return [dict(zip(self.parameters, 1.0 + OFF * sign, strict=True)) for sign in signs]

    def spectra(self, scene: ReducedScene, speeds: np.ndarray, slopes: bool = False) -> Spectra:
        """Variances of a scene, and slopes if asked for; at each speed by itself where the vehicle depends on it."""
        apart = scene.vehicle.side_forces or scene.vehicle.drags
        groups = [speeds[[i]] for i in range(len(speeds))] if apart else [speeds]
        spectra = [self._spectra(scene, speeds, slopes) for speeds in groups]
        return Spectra(*(np.concatenate([getattr(each, key) for each in spectra]) for key in ("variances", "slopes")))

    def _spectra(self, scene: ReducedScene, speeds: np.ndarray, slopes: bool) -> Spectra:
        vehicle, _ = constrain(scene, float(speeds[0]))
        excitation, rates = scene.excitation(), _rates(vehicle)
        ends = ENDS[0] * abs(rates).min(), ENDS[1] * abs(rates).max()
        omega, weights, apart = frequencies(rates, max(excitation.lengths) / float(speeds[0]), ends)
        factors = weighting_factors([name for _, name in self.quantities], omega).T
        weights = weights[:, None] * abs(factors) ** 2 / np.pi
        road = at_axles(filtered(excitation, speeds, omega), excitation, speeds, omega, apart)
        heights = np.hstack(excitation.heights) @ road
        response = VehicleResponse(vehicle, [row for row, _ in self.quantities], omega)
        seen = response.H @ heights
        variances = np.einsum("vwqk,vwqk,wq->vq", seen, seen.conj(), weights, optimize=True).real
        if not slopes:
            return Spectra(variances, np.zeros((len(speeds), 0)))
        by_parameter = np.zeros((*variances.shape, len(self.parameters)))
        for i, parameter in enumerate(self.parameters):
            other, _ = constrain(_off(scene, {parameter: 1.0 + OFF}), float(speeds[0]))
            moved = response.slope(other) @ heights
            by_parameter[:, :, i] = 2 * np.einsum("vwqk,vwqk,wq->vq", seen.conj(), moved, weights, optimize=True).real
        return Spectra(variances, by_parameter)


class VehicleResponse:
    """Outputs by heights, H (w, q, wheels), of a vehicle at frequencies (w,), and how another one moves them."""

    def __init__(self, vehicle: LinearVehicle, rows: list[int], omega: np.ndarray) -> None:
        self.rows, self.s = rows, 1j * omega[:, None, None]
        self.vehicle = self._asked(vehicle)
        Z, B = self._stiffness(vehicle)
        C, self.direct = self._outputs(self.vehicle)
        self.q, self.back = np.linalg.solve(Z, B), np.linalg.solve(Z.mT, C.mT).mT
        self.H = C @ self.q + self.direct

    def slope(self, other: LinearVehicle) -> np.ndarray:
        """dH (w, q, wheels) towards another vehicle, to first order."""
        other, matrices = self._asked(other), ("mass", "damping", "stiffness", "road_stiffness", "road_damping")
        outputs = tuple(_less(a, b, Rows._fields) for a, b in zip(other.outputs, self.vehicle.outputs, strict=True))
        less = replace(_less(other, self.vehicle, matrices), outputs=outputs)
        (Z, B), (C, direct) = self._stiffness(less), self._outputs(less)
        return C @ self.q + direct - self.back @ (Z @ self.q - B)

    def _asked(self, vehicle: LinearVehicle) -> LinearVehicle:
        """The vehicle with the outputs that are asked for."""
        return replace(vehicle, outputs=tuple(vehicle.outputs[row] for row in self.rows))

    def _stiffness(self, vehicle: LinearVehicle) -> tuple[np.ndarray, np.ndarray]:
        Z = vehicle.stiffness + self.s * vehicle.damping + self.s**2 * vehicle.mass
        return Z, vehicle.road_stiffness + self.s * vehicle.road_damping

    def _outputs(self, vehicle: LinearVehicle) -> tuple[np.ndarray, np.ndarray]:
        read = vehicle.read
        C = read.displacement + self.s * read.rate + self.s**2 * read.acceleration
        return C, read.road + self.s * read.road_rate


def _less(spectra: Any, subtrahend: Any, keys: Iterable[str]) -> Any:
    """One less another in some of its arrays."""
    return replace(spectra, **{key: getattr(spectra, key) - getattr(subtrahend, key) for key in keys})


def _off(scene: ReducedScene, factors: Mapping[Parameter, float]) -> ReducedScene:
    return replace(scene, vehicle=changed(scene.vehicle, factors)) if factors else scene


def _rates(vehicle: LinearVehicle) -> np.ndarray:
    """Rates (1/s) of all motions; a body without mass leaves fewer."""
    n = len(vehicle.mass)
    left = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), vehicle.mass]])
    right = np.block([[np.zeros((n, n)), np.eye(n)], [-vehicle.stiffness, -vehicle.damping]])
    rates = eigvals(right, left)
    rates = rates[np.isfinite(rates)]
    return rates[abs(rates) < 1e9]
