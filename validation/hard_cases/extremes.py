"""Hard cases of extreme parameters: no damping, mass ratios of 1e6, stiffnesses of 1e9 N/m."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from models.engines.assembly import Assembly
from validation.hard_cases import setups
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import REFUSED, exact_states, largest_magnitude, run, unchecked_run, vehicle

IMPLICIT_INTEGRATORS = {**setups.IMPLICIT_INTEGRATORS, "reference": "LSODA"}
"""Implementation -> implicit integrator. Radau would take minutes in the reference, as its error estimate reacts to the
rounding of kN on a wheel of a gram."""
TOLERANCE = 1e-6
"""Tolerance of the adaptive solvers; at a tenth of it LSODA reacts to rounding, too, and needs 140,000 steps instead of
300."""


def _raised_vehicle(base_assembly: Assembly) -> Assembly:
    """The vehicle with its chassis 10 mm above its equilibrium."""
    return replace(base_assembly, initial=base_assembly.initial - np.array([0, 0, 0.01, 0, 0, 0, 0, 0]))


def _distance_from_equilibrium(engine_name: str, base_assembly: Assembly, integrator: str = "") -> float:
    """Distance of the state from the equilibrium after 3 s, divided by the initial displacement."""
    end = run(engine_name, _raised_vehicle(base_assembly), 1e-3, 3.0, integrator, tolerance=TOLERANCE).states[-1]
    return largest_magnitude(end - base_assembly.initial) / 0.01


def undamped_error(engine_name: str, work_folder: Path) -> float:
    """Case: a vehicle without any dampers for 1 s. Error: difference of the states from the matrix exponential, divided
    by the largest motion."""
    return _undamped_motion_error(engine_name)


def _undamped_motion_error(engine_name: str, integrator: str = "") -> float:
    """Difference of the undamped vehicle's states from the exact ones, divided by the largest motion."""
    base, truth = _undamped_vehicle()
    return largest_magnitude(run(engine_name, base, 1e-3, 1.0, integrator).states - truth) / largest_magnitude(
        truth - base.initial
    )


def _undamped_vehicle() -> tuple[Assembly, np.ndarray]:
    """The vehicle without dampers, displaced from equilibrium, and its exact states (1001, 8) over 1 s."""
    base = _raised_vehicle(vehicle("asymmetric_twin", "linear", d1=0.0, d2=0.0, d3=0.0, d4=0.0))
    return base, exact_states(base, 1e-3, 1000)


def undamped_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: explicit Euler with the check bypassed, by which every mode grows."""
    base, truth = _undamped_vehicle()
    states = unchecked_run("exudyn", base, 1e-3, 1.0, "ExplicitEuler").states
    return (
        f"Exudyn's explicit Euler past the check: {largest_magnitude(states - base.initial):.2g} where the truth "
        f"stays below {largest_magnitude(truth - base.initial):.2g}, finite and unwarned"
    )


def undamped_euler_error(engine_name: str, work_folder: Path) -> float:
    """Case: undamped oscillation by an explicit first-order method, which makes it grow. Error: difference of the
    states from the matrix exponential, divided by the largest motion."""
    return _undamped_motion_error(
        engine_name, {"reference": "RK4", "exudyn": "ExplicitEuler", "mujoco": "Euler"}[engine_name]
    )


def light_wheel_error(engine_name: str, work_folder: Path) -> float:
    """Case: wheels of 0.75 g under 750 kg, with poles of -1.4e7 1/s, at the recommended settings. Error: distance from
    equilibrium after 3 s divided by the initial displacement."""
    return _distance_from_equilibrium(engine_name, vehicle(m1=7.5e-4, m2=7.5e-4))


def light_wheel_implicit_error(engine_name: str, work_folder: Path) -> float:
    """Case: wheels of 0.75 g under 750 kg by an implicit integrator. Error: distance from equilibrium after 3 s divided
    by the initial displacement."""
    return _distance_from_equilibrium(engine_name, vehicle(m1=7.5e-4, m2=7.5e-4), IMPLICIT_INTEGRATORS[engine_name])


def stiff_tyre_error(engine_name: str, work_folder: Path) -> float:
    """Case: tyres of 1e9 N/m, so that the wheels oscillate at 8,200 rad/s, at the recommended settings. Error: distance
    from equilibrium after 3 s divided by the initial displacement."""
    return _distance_from_equilibrium(engine_name, vehicle(k1=1e9, k2=1e9))


def stiff_tyre_implicit_error(engine_name: str, work_folder: Path) -> float:
    """Case: tyres of 1e9 N/m by an implicit integrator. Error: distance from equilibrium after 3 s divided by the
    initial displacement."""
    return _distance_from_equilibrium(engine_name, vehicle(k1=1e9, k2=1e9), IMPLICIT_INTEGRATORS[engine_name])


def stiff_tyre_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: two steps with the check bypassed."""
    base = vehicle(k1=1e9, k2=1e9)
    end = unchecked_run("mujoco", _raised_vehicle(base), 1e-3, 2e-3).states[-1]
    return f"MuJoCo past the check: {largest_magnitude(end - base.initial):.0f} m/s after 2 ms, finite and unwarned"


AT_REST_REASON = "the vehicle is back in its equilibrium after 3 s"
DECAYED_REASON = "the slowest mode, -10 1/s, has shrunk to 1e-13; first-order steps damp it a little less"

CASES = (
    HardCase(
        "no damping",
        "poles on the imaginary axis: nothing forgives a method that adds energy",
        "matrix exponential, 1 s",
        "of the motion",
        1e-3,
        "RK4 at 1 ms and 121 rad/s: a phase error of 2e-7 per step",
        undamped_error,
        {},
        undamped_naive_result,
    ),
    HardCase(
        "no damping, first order",
        "explicit Euler adds energy at every step. The reference runs RK4; MuJoCo's Euler is symplectic here",
        "matrix exponential, or refused",
        "of the motion",
        0.25,
        "first order: h omega / 2 of 121 rad/s is a phase of 6 %",
        undamped_euler_error,
        {"exudyn": "refused"},
    ),
    HardCase(
        "mass ratio 1e6",
        "a light wheel on a stiff damper: poles at -1.4e7 1/s",
        AT_REST_REASON,
        "of the push",
        1e-6,
        DECAYED_REASON,
        light_wheel_error,
        REFUSED,
    ),
    HardCase(
        "mass ratio 1e6, implicit",
        "one step spans 14,000 time constants",
        AT_REST_REASON,
        "of the push",
        1e-6,
        DECAYED_REASON,
        light_wheel_implicit_error,
    ),
    HardCase(
        "stiffness 1e9",
        "wheels at 8,200 rad/s",
        AT_REST_REASON,
        "of the push",
        1e-6,
        DECAYED_REASON,
        stiff_tyre_error,
        REFUSED,
        stiff_tyre_naive_result,
    ),
    HardCase(
        "stiffness 1e9, implicit",
        "one step spans 1.3 periods of the wheel",
        AT_REST_REASON,
        "of the push",
        1e-6,
        DECAYED_REASON,
        stiff_tyre_implicit_error,
    ),
)
