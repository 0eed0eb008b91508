"""Equations of motion of the pitch-plane vehicle, written straight from the paper (eqs 35 to 39).

Each right-hand side takes the state y (8,), the inputs u of its mode, the parameters p (15,) in the
order of ``PitchPlaneParameters`` and fills the state's rates (8,). They are plain functions that numba
can compile into a caller, which keeps them cacheable.

| mode | input u | equation |
|---|---|---|
| road | zeta1, zeta2, zeta1', zeta2' | (38) |
| lift-off | the same | (38) with tyres that only push |
| force | f1, f2 | (37) |
| pitch | f1, f2, beta, beta', beta'' | (39) |
| heave-pitch | f1, f2, z3, beta, z3', beta', z3'', beta'' | (39) without its row of the chassis |
"""

import math
from typing import Any

import numpy as np
from numba.extending import register_jitable

from models.vehicles.description import Geometry, PlaneVehicle
from models.vehicles.pitch_plane import PitchPlaneParameters


def parameter_numbers(parameters: PitchPlaneParameters, vehicle: PlaneVehicle) -> np.ndarray:
    """Array of numbers for the compiled equations: the parameters (15,), then stiffness, damping and dead band of each
    pitch spring."""
    springs = [(spring.stiffness, spring.damping, spring.dead_band) for spring in vehicle.pitch_springs]
    return np.concatenate((parameters.array(), *springs))


@register_jitable
def suspension_forces(y, p, pitch_sine, pitch_cosine):
    """Suspension forces f3, f4 (N, compression positive), eq. (35)."""
    a, b = p[0], p[1]
    f3 = p[8] * (y[2] - y[0] - b * pitch_sine) + p[12] * (y[6] - y[4] - b * y[7] * pitch_cosine)
    f4 = p[9] * (y[2] - y[1] + a * pitch_sine) + p[13] * (y[6] - y[5] + a * y[7] * pitch_cosine)
    return f3, f4


def suspension_loads(y: Any, p: PitchPlaneParameters, geometry: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Suspension forces f3, f4 (N, compression) and their moment on the chassis (N m, nose up), (n,) each, at states y,
    eight arrays (n,); eqs (35), (36)."""
    exact = geometry == "exact"
    sine, cosine = (np.sin(y[3]), np.cos(y[3])) if exact else (y[3], np.ones_like(y[3]))
    f3, f4 = suspension_forces(y, p.array(), sine, cosine)
    return f3, f4, cosine * (p.b * f3 - p.a * f4)


@register_jitable
def linear_tyres(y, u, p):
    """Tyre forces f1, f2 (N, up on the wheel) of the linear tyres on a road u, eqs (33) and (35)."""
    f1 = p[6] * (y[0] - u[0]) + p[10] * (y[4] - u[2])
    f2 = p[7] * (y[1] - u[1]) + p[11] * (y[5] - u[3])
    return f1, f2


@register_jitable
def pushing_tyres(y, u, p):
    """Tyre forces f1, f2 (N, up on the wheel) of tyres that never pull (the effect ``lift_off``), on a road u. NaN in
    the states gives NaN."""
    e1, e2 = y[0] - u[0], y[1] - u[1]
    f1 = max(min(p[6] * e1 + p[10] * (y[4] - u[2]), 2.0 * p[6] * e1), 0.0)
    f2 = max(min(p[7] * e2 + p[11] * (y[5] - u[3]), 2.0 * p[7] * e2), 0.0)
    return f1, f2


@register_jitable
def newton_euler(y, tyre_forces, strut_forces, pitch_cosine, p, state_rates):
    """Fill the state's rates (8,) from the balance of forces and moments, eq. (36): wheel forces f1, f2 (N, up on
    the wheel), suspension forces f3, f4 (N)."""
    (f1, f2), (f3, f4) = tyre_forces, strut_forces
    for i in range(4):
        state_rates[i] = y[4 + i]
    state_rates[4] = p[14] + (f3 - f1) / p[2]
    state_rates[5] = p[14] + (f4 - f2) / p[3]
    state_rates[6] = p[14] - (f3 + f4) / p[4]
    state_rates[7] = pitch_cosine * (p[1] * f3 - p[0] * f4) / p[5]


@register_jitable
def road_exact(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the road-excited vehicle, nonlinear in pitch (38)."""
    sine, cosine = math.sin(state[3]), math.cos(state[3])
    newton_euler(
        state,
        linear_tyres(state, inputs, parameters),
        suspension_forces(state, parameters, sine, cosine),
        cosine,
        parameters,
        state_rates,
    )


@register_jitable
def road_linear(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the road-excited vehicle, linearised about zero pitch (38 with A(0))."""
    newton_euler(
        state,
        linear_tyres(state, inputs, parameters),
        suspension_forces(state, parameters, state[3], 1.0),
        1.0,
        parameters,
        state_rates,
    )


@register_jitable
def lift_off_exact(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the vehicle on tyres that never pull, nonlinear in pitch."""
    sine, cosine = math.sin(state[3]), math.cos(state[3])
    newton_euler(
        state,
        pushing_tyres(state, inputs, parameters),
        suspension_forces(state, parameters, sine, cosine),
        cosine,
        parameters,
        state_rates,
    )


@register_jitable
def lift_off_linear(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the vehicle on tyres that never pull, linearised about zero pitch."""
    newton_euler(
        state,
        pushing_tyres(state, inputs, parameters),
        suspension_forces(state, parameters, state[3], 1.0),
        1.0,
        parameters,
        state_rates,
    )


@register_jitable
def force_exact(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the force-excited vehicle, wheel forces vertical in the inertial frame (37)."""
    sine, cosine = math.sin(state[3]), math.cos(state[3])
    newton_euler(
        state,
        (inputs[0], inputs[1]),
        suspension_forces(state, parameters, sine, cosine),
        cosine,
        parameters,
        state_rates,
    )


@register_jitable
def force_linear(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the force-excited vehicle, linearised about zero pitch (37 with A(0))."""
    newton_euler(
        state, (inputs[0], inputs[1]), suspension_forces(state, parameters, state[3], 1.0), 1.0, parameters, state_rates
    )


@register_jitable
def force_body(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the force-excited vehicle, wheel forces along the chassis' own vertical axis.

    By virtual work: the vertical part f cos(beta) acts on the wheel; the horizontal part f sin(beta)
    goes through the wheel's guide to the chassis at the strut's point, f b sin(beta)^2 about its centre.
    Without wheel mass the moment is b f1 - a f2 at every pitch: no cosine, hence no instability.
    """
    sine, cosine = math.sin(state[3]), math.cos(state[3])
    newton_euler(
        state,
        (inputs[0] * cosine, inputs[1] * cosine),
        suspension_forces(state, parameters, sine, cosine),
        cosine,
        parameters,
        state_rates,
    )
    state_rates[7] += sine * sine * (parameters[1] * inputs[0] - parameters[0] * inputs[1]) / parameters[5]


@register_jitable
def pitch_exact(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the force-excited vehicle with prescribed pitch (39); pitch and its rate are read
    from the inputs."""
    sine, cosine = math.sin(inputs[2]), math.cos(inputs[2])
    state[3], state[7] = inputs[2], inputs[3]
    newton_euler(
        state,
        (inputs[0], inputs[1]),
        suspension_forces(state, parameters, sine, cosine),
        cosine,
        parameters,
        state_rates,
    )
    state_rates[7] = inputs[4]


@register_jitable
def pitch_linear(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the force-excited vehicle with prescribed pitch, linearised about zero pitch."""
    state[3], state[7] = inputs[2], inputs[3]
    newton_euler(
        state,
        (inputs[0], inputs[1]),
        suspension_forces(state, parameters, inputs[2], 1.0),
        1.0,
        parameters,
        state_rates,
    )
    state_rates[7] = inputs[4]


@register_jitable
def heave_pitch_exact(state, inputs, parameters, state_rates):
    """Fill the time derivatives of two wheels under a chassis whose heave and pitch are prescribed in the inputs."""
    sine, cosine = math.sin(inputs[3]), math.cos(inputs[3])
    state[2], state[3], state[6], state[7] = inputs[2], inputs[3], inputs[4], inputs[5]
    newton_euler(
        state,
        (inputs[0], inputs[1]),
        suspension_forces(state, parameters, sine, cosine),
        cosine,
        parameters,
        state_rates,
    )
    state_rates[6], state_rates[7] = inputs[6], inputs[7]


@register_jitable
def heave_pitch_linear(state, inputs, parameters, state_rates):
    """Fill the time derivatives of the vehicle with prescribed heave and pitch, linearised about zero pitch."""
    state[2], state[3], state[6], state[7] = inputs[2], inputs[3], inputs[4], inputs[5]
    newton_euler(
        state,
        (inputs[0], inputs[1]),
        suspension_forces(state, parameters, inputs[3], 1.0),
        1.0,
        parameters,
        state_rates,
    )
    state_rates[6], state_rates[7] = inputs[6], inputs[7]


RIGHT_HAND_SIDES = {
    ("road", "exact"): road_exact,
    ("road", "linear"): road_linear,
    ("lift-off", "exact"): lift_off_exact,
    ("lift-off", "linear"): lift_off_linear,
    ("force", "exact"): force_exact,
    ("force", "linear"): force_linear,
    ("force-body", "exact"): force_body,
    ("pitch", "exact"): pitch_exact,
    ("pitch", "linear"): pitch_linear,
    ("heave-pitch", "exact"): heave_pitch_exact,
    ("heave-pitch", "linear"): heave_pitch_linear,
}
"""Right-hand sides of the equations of motion by mode and geometry; linearised, a body-fixed force is a vertical
one."""


@register_jitable
def pitch_springs(state, inputs, parameters, state_rates):
    """Add rotational springs and dampers between chassis and ground to the state's rates; their N m/rad, N m s/rad and
    dead band (rad) begin at p[15]."""
    for i in range(15, len(parameters), 3):
        beyond = abs(state[3]) - parameters[i + 2]
        if beyond >= 0.0:
            state_rates[7] -= (
                parameters[i] * math.copysign(beyond, state[3]) + parameters[i + 1] * state[7]
            ) / parameters[5]


@register_jitable
def pitch_moment(state, inputs, parameters, state_rates):
    """Add a moment on the chassis (N m, nose up), the last channel of the input, to the state's rates."""
    state_rates[7] += inputs[-1] / parameters[5]


ADDED_TERMS = {"springs": pitch_springs, "moment": pitch_moment}
"""Further terms by which a right-hand side may be followed."""
