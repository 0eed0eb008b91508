"""Exact path of a pitch-plane vehicle that bounces on a flat road, by matrix exponentials between contact changes.

With geometry linear in the pitch and the tyres of the effect ``lift_off`` the motion is linear as long as each tyre
stays in one of three states: in the air (no force), pressed (k e + d e') or hit so fast that the damper is limited by
the spring (2 k e). Where a tyre goes from one to another is found by bisection to the last bits of time. Nothing here
is shared with the implementations but the mass, damping and stiffness of the vehicle without tyres.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from scipy.linalg import expm

from models.engines.assembly import Assembly
from models.vehicles.description import mass_damping_stiffness
from models.vehicles.pitch_plane import PitchPlaneParameters

IN_AIR, PRESSED, DAMPER_LIMITED = range(3)
SWITCH_BISECTIONS = 52
ContactStates = tuple[int, int]


class BouncingVehicle:
    """Exact solution for a bouncing pitch-plane vehicle. A tyre must not change its contact state twice within a
    ``step`` (s)."""

    def __init__(self, assembly: Assembly, time_step: float) -> None:
        vehicle, self.parameters, self.step = assembly.vehicle, assembly.parameters, time_step
        bare = replace(vehicle, struts=tuple(strut for strut in vehicle.struts if strut.lower.body is not None))
        mass, damping, stiffness = mass_damping_stiffness(bare)
        weight = np.array([*(body.mass * vehicle.gravity for body in vehicle.bodies), 0.0])
        self.rates = {
            (i, j): _rate_matrix(mass, damping, stiffness, weight, _tyre_laws(self.parameters, (i, j)))
            for i, j in product(range(3), range(3))
        }
        self.transitions = {states: expm(rate * time_step) for states, rate in self.rates.items()}

    def path(self, start_state: np.ndarray, state_count: int) -> np.ndarray:
        """States (state_count + 1, 8) at intervals of ``step`` (s), from the initial state (8,)."""
        states = [np.append(start_state, 1.0)]
        for _ in range(state_count):
            states.append(self._state_after_step(states[-1]))
        return np.array(states)[:, :8]

    def _state_after_step(self, extended_state: np.ndarray) -> np.ndarray:
        """State (8,) with a 1 appended, a step later."""
        left, states = self.step, self._contact_states(extended_state)
        while True:
            state_after = (
                self.transitions[states] if left == self.step else expm(self.rates[states] * left)
            ) @ extended_state
            if self._contact_states(state_after) == states:
                return state_after
            passed, extended_state = self._state_at_switch(extended_state, states, left)
            left, states = left - passed, self._contact_states(extended_state)

    def _state_at_switch(
        self, extended_state: np.ndarray, contact_states: ContactStates, time_limit: float
    ) -> tuple[float, np.ndarray]:
        """Time (s) until a tyre changes its contact state, and the vehicle's state (9,) then."""
        time_before, time_after = 0.0, time_limit
        for _ in range(SWITCH_BISECTIONS):
            middle = 0.5 * (time_before + time_after)
            if self._contact_states(expm(self.rates[contact_states] * middle) @ extended_state) == contact_states:
                time_before = middle
            else:
                time_after = middle
        return time_after, expm(self.rates[contact_states] * time_after) @ extended_state

    def _contact_states(self, extended_state: np.ndarray) -> ContactStates:
        """Contact states of the front and rear tyre: in the air, pressed, or with its damper limited."""
        p = self.parameters
        return _contact_state(p.k1 * extended_state[0], p.d1 * extended_state[4]), _contact_state(
            p.k2 * extended_state[1], p.d2 * extended_state[5]
        )


def _contact_state(spring_force: float, damper_force: float) -> int:
    if spring_force <= 0.0 or spring_force + damper_force <= 0.0:
        return IN_AIR
    return DAMPER_LIMITED if damper_force > spring_force else PRESSED


def _tyre_laws(parameters: PitchPlaneParameters, contact_states: ContactStates) -> list[tuple[float, float]]:
    """Stiffness (N/m) and damping (N s/m) of the front and rear tyre in their contact states."""
    laws = [
        ((0.0, 0.0), (k, d), (2.0 * k, 0.0))
        for k, d in ((parameters.k1, parameters.d1), (parameters.k2, parameters.d2))
    ]
    return [law[state] for law, state in zip(laws, contact_states, strict=True)]


def _rate_matrix(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    weight: np.ndarray,
    tyre_laws: list[tuple[float, float]],
) -> np.ndarray:
    """Matrix A (9, 9) of x' = A x, where x is the vehicle's state (8,) followed by 1."""
    a, inverse = np.zeros((9, 9)), 1.0 / mass.diagonal()
    extra_k, extra_d = (np.diag([*(law[i] for law in tyre_laws), 0.0, 0.0]) for i in range(2))
    a[:4, 4:8] = np.eye(4)
    a[4:8, :4], a[4:8, 4:8] = -inverse[:, None] * (stiffness + extra_k), -inverse[:, None] * (damping + extra_d)
    a[4:8, 8] = inverse * weight
    return a


def bounce_energy(assembly: Assembly, states: np.ndarray) -> np.ndarray:
    """Total energy (m,) in J of states (m, 8) on a flat road: kinetic energy, weight, suspension springs and compressed
    tyres."""
    p, vehicle = assembly.parameters, assembly.vehicle
    z, v = states[:, :3], states[:, 4:]
    pitch = np.sin(states[:, 3]) if vehicle.geometry == "exact" else states[:, 3]
    kinetic = 0.5 * v**2 @ np.array([p.m1, p.m2, p.m3, p.I])
    weight = -p.g * z @ np.array([p.m1, p.m2, p.m3])
    front, rear = z[:, 2] - z[:, 0] - p.b * pitch, z[:, 2] - z[:, 1] + p.a * pitch
    tyres = 0.5 * np.maximum(z[:, :2], 0.0) ** 2 @ np.array([p.k1, p.k2])
    return np.asarray(kinetic + weight + tyres + 0.5 * (p.k3 * front**2 + p.k4 * rear**2))
