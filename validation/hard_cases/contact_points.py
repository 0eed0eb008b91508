"""Hard cases of massless contact points of tyres: first-order states with a time constant of 1 ms or of zero."""

from pathlib import Path

import mujoco
import numpy as np

from models.core.signals import SampledSignal
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly
from models.systems.pitch_plane.effects.contact_points import contact_points
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import IMPLICIT_INTEGRATORS, driven_by_forces, largest_magnitude, run, vehicle

TIME_STEPS = (1e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
WHEEL_LOAD = 1000.0


def _compressions(assembly: Assembly, trajectory: Trajectory) -> np.ndarray:
    """Tyre compression (n, 2) in m along a run's path."""
    channels = contact_points(assembly, trajectory.times, trajectory.states)
    return trajectory.states[:, :2] - np.column_stack([channels["zeta1"][2], channels["zeta2"][2]])


def step_response_error(engine_name: str, work_folder: Path) -> float:
    """Case: a wheel force that steps from 0 to 1 kN, with time steps from a tenth to twenty times the tyre's time
    constant. Error: largest error of the tyre compression divided by f/k."""
    base = vehicle()
    values = np.zeros((10, 2))
    values[1:] = WHEEL_LOAD
    p, worst = base.parameters, 0.0
    for step in TIME_STEPS:
        assembly = driven_by_forces(base, SampledSignal(values, 2e-2, held=True))
        if engine_name == "exudyn":  # its implicit integrators refuse held samples
            path = run(engine_name, assembly, min(step, 2e-3), 0.1)
        else:
            path = run(engine_name, assembly, step, 0.1, IMPLICIT_INTEGRATORS[engine_name])
        since = np.maximum(path.times - 2e-2, 0.0)
        truth = -WHEEL_LOAD / p.k1 * np.expm1(-since * p.k1 / p.d1)
        worst = max(worst, largest_magnitude(_compressions(assembly, path)[:, 0] - truth) / (WHEEL_LOAD / p.k1))
    return worst


def step_response_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: response to a step by a native MuJoCo activation with its first-order
    filter."""
    ends = []
    for integrator in ("Euler", "RK4"):
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep="0.0055" integrator="{integrator}"/><worldbody><body><joint name="j"/>'
            '<geom size="1"/></body></worldbody><actuator><general joint="j" dyntype="filter" dynprm="0.001" '
            'gainprm="0"/></actuator></mujoco>'
        )
        data = mujoco.MjData(model)
        data.ctrl[0] = 1.0
        mujoco.mj_step(model, data, nstep=20)
        ends.append(f"{abs(data.act[0]):.0e} ({integrator})")
    return f"a native MuJoCo activation at 5.5 ms reaches {', '.join(ends)} times its load in 20 steps, unwarned"


def ramp_response_error(engine_name: str, work_folder: Path) -> float:
    """Case: a wheel force that rises by 1 kN in 20 ms. Error: largest difference of the tyre compression from the
    closed form, divided by f/k."""
    return max(_ramp_error(engine_name, step, IMPLICIT_INTEGRATORS[engine_name]) for step in (1e-3, 5e-3, 2e-2))


def _ramp_error(engine_name: str, time_step: float, integrator_name: str) -> float:
    """Largest difference of the tyre compression from the ramp's closed form at the time of each row, divided by
    f/k."""
    base, rising = vehicle(), WHEEL_LOAD * np.minimum(np.arange(6.0), 1.0)[:, None] * np.ones(2)
    assembly, p = driven_by_forces(base, SampledSignal(rising, 2e-2, held=False)), base.parameters
    path = run(engine_name, assembly, time_step, 0.1, integrator_name)
    return largest_magnitude(_compressions(assembly, path)[:, 0] - _compression_under_ramp(path.times, p.k1, p.d1)) / (
        WHEEL_LOAD / p.k1
    )


def _compression_under_ramp(times: np.ndarray, stiffness: float, damping: float) -> np.ndarray:
    """Tyre compression (n,) in m under a load that rises to LOAD in 20 ms, as the difference of two ramps."""
    lag = damping / stiffness

    def ramp(t: np.ndarray) -> np.ndarray:
        return np.where(t > 0, t + lag * np.expm1(-np.maximum(t, 0) / lag), 0.0)

    return WHEEL_LOAD / stiffness / 2e-2 * (ramp(times) - ramp(times - 2e-2))


def adaptive_ramp_error(engine_name: str, work_folder: Path) -> float:
    """Case: the ramp in an adaptive run with rows at any times. Error: largest difference of the tyre compression from
    the closed form at these times, divided by f/k."""
    return _ramp_error(engine_name, 1e-3, {"reference": "DOP853", "exudyn": "DOPRI5"}.get(engine_name, "RK4"))


def undamped_contact_error(engine_name: str, work_folder: Path) -> float:
    """Case: a tyre without damping, whose contact point has no state and follows its force at once. Error: that of the
    compression divided by f/k."""
    base = vehicle(d1=0.0, d2=0.0)
    values = WHEEL_LOAD * np.random.default_rng(4).standard_normal((100, 2))
    assembly = driven_by_forces(base, SampledSignal(values, 1e-3, held=True))
    path = run(engine_name, assembly, 1e-3, 0.1)
    stiffness = base.parameters.k1
    return largest_magnitude(_compressions(assembly, path)[:100] - values / stiffness) / (WHEEL_LOAD / stiffness)


CASES = (
    HardCase(
        "contact point under a sudden force",
        "a state with a time constant of 1 ms beside a step of up to 20 ms",
        "-f/k (1 - exp(-t k/d)) at steps of 0.1 to 20 ms",
        "of f/k",
        1e-12,
        "an exact filter: rounding only",
        step_response_error,
        {},
        step_response_naive_result,
    ),
    HardCase(
        "contact point under a ramp",
        "a linear force within each step",
        "the ramp's closed form at 1, 5 and 20 ms",
        "of f/k",
        1e-12,
        "an exact filter: rounding only",
        ramp_response_error,
    ),
    HardCase(
        "contact point along an adaptive run",
        "rows that do not lie on the samples' grid",
        "the ramp's closed form at each row's own time",
        "of f/k",
        1e-12,
        "an exact filter: rounding only",
        adaptive_ramp_error,
    ),
    HardCase(
        "contact point without damping",
        "d = 0 makes the differential equation an algebraic one",
        "f/k at once",
        "of f/k",
        1e-12,
        "one division",
        undamped_contact_error,
    ),
)
