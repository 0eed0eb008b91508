"""Interpolation of hub forces, held or linear, by fixed steps and adaptive integrators, against closed forms.

Forces in the axes of space move the centre of mass of all bodies as they would a point, whatever springs do inside: a
force that is held moves it along a parabola, one that is linear along a cubic. All integrators meet both but for
rounding, or for their tolerance.
"""

import numpy as np

from models.engines.assembly import Settings
from models.engines.cut_vehicle import ENGINES, FIXED_STEP_METHOD, PLAIN_ENGINE, HubModel
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_table import HubInputs
from models.multibody.plain.motion import PLACE, Bodies
from models.systems.hub_forces.measurement import HubForces
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle
from validation.common.rows import Observed, Row, System
from validation.spatial.cars import random_states, static_forces
from validation.spatial.written_equations import FORCE_FRAMES

SEED, SAMPLE_COUNT, STEP, STEPS_PER_SAMPLE = 37, 12, 2e-3, 4
"""Seed and number of the force samples, step (s), and number of steps from one sample to the next."""
SOLVER_TOLERANCE = 1e-11
"""Relative tolerance of the adaptive integrators."""
QUICK_METHODS = {"DOPRI5": "exudyn", "LSODA": "reference"}
ADAPTIVE_METHODS = QUICK_METHODS | {"DOP853": "reference"}
"""Adaptive integrators and the engine of each; ODE23 and Radau would take twenty times as long."""
SYSTEM: System = "drift"


def rows(vehicle: CutVehicle, is_quick: bool) -> list[Row]:
    """Rows on the interpolation of hub forces on a vehicle: held forces in every engine, and adaptive integrators."""
    methods = QUICK_METHODS if is_quick else ADAPTIVE_METHODS
    names = " and ".join(methods)
    return [
        Observed(
            "hub_forces.held_centre",
            SYSTEM,
            "largest distance of the centre of mass from its parabolas, forces held from sample to sample in the axes "
            f"of space, in {len(ENGINES)} implementations",
            max(centre_of_mass_error(vehicle, engine, "held") for engine in ENGINES),
            "m",
        ).at_most(1e-9, "a step in which a stage reads the next sample is 1e-5 m off after 12 samples", "closed form"),
        Observed(
            "hub_forces.own_steps_centre",
            SYSTEM,
            f"centre of mass by {names}, which pick their own steps: largest distance from its parabolas",
            max(
                centre_of_mass_error(vehicle, m, interpolation_name, name)
                for name, m in methods.items()
                for interpolation_name in ("held", "linear")
            ),
            "m",
        ).at_most(1e-10, f"a tolerance of {SOLVER_TOLERANCE:g} per step", "closed form"),
        Observed(
            "hub_forces.own_steps_path",
            SYSTEM,
            f"largest difference of coordinates and rates by {names} from Runge-Kutta 4 in steps of "
            f"{1e3 * STEP / 8:g} ms",
            max(trajectory_gap(vehicle, engine, name) for name, engine in methods.items()),
            "m, rad, 1/s",
        ).at_most(1e-7, "the error of Runge-Kutta 4, which falls 16 times with half the step", "shared kernel"),
        Observed(
            "hub_forces.between_rows",
            SYSTEM,
            "relative difference of the accelerations at random times between the rows of forces and of angles from "
            "the plain equations",
            acceleration_difference_between_rows(vehicle, 6),
            "1",
        ).at_most(1e-12, "weights of the compiled forces, differences of the plain ones", "native"),
    ]


def settings(integrator_name: str = FIXED_STEP_METHOD) -> Settings:
    """Settings of a run over all force samples with an integrator."""
    return Settings(integrator_name, STEP, (SAMPLE_COUNT - 1) * STEPS_PER_SAMPLE * STEP, SOLVER_TOLERANCE)


def samples(vehicle: CutVehicle) -> HubForces:
    """Hub force samples in axes fixed in space: static loads, with noise of 400 N and 40 N m."""
    static_inputs = static_forces(vehicle, SAMPLE_COUNT, "inertial")
    deviations = np.tile([400.0] * 3 + [40.0] * 3, len(vehicle.hubs))
    return HubForces(static_inputs.hubs, STEPS_PER_SAMPLE * STEP, "inertial").with_noise(deviations, SEED)


def centre_of_mass_error(
    vehicle: CutVehicle, engine: str, interpolation: str, integrator_name: str = FIXED_STEP_METHOD
) -> float:
    """Largest error (m) of a coordinate of the vehicle's centre of mass at the sample times, against the closed
    form."""
    forces, run_settings = samples(vehicle), settings(integrator_name)
    run = HubModel(engine, vehicle, forces.hub_inputs(STEP, run_settings.steps, interpolation), run_settings).run()  # type: ignore[arg-type]
    centre_path = centres_of_mass(vehicle, run.positions[::STEPS_PER_SAMPLE])
    return float(np.abs(centre_path - centre_path[0] - _falling_path(vehicle, forces, interpolation == "held")).max())


def centres_of_mass(vehicle: CutVehicle, coordinate_rows: np.ndarray) -> np.ndarray:
    """Centre of mass of all bodies (m, 3) in m, for m rows of coordinates (m, n)."""
    bodies, tree = vehicle.tree.bodies, Bodies(vehicle.tree)
    points, masses = tree.points([(body.name, body.position) for body in bodies]), [body.mass for body in bodies]
    point_positions = [tree.move(q, 0.0 * q).at(points)[:, PLACE] for q in coordinate_rows]
    return np.array([np.average(positions_of_row, axis=0, weights=masses) for positions_of_row in point_positions])


def _falling_path(vehicle: CutVehicle, hub_forces: HubForces, are_samples_held: bool) -> np.ndarray:
    """Path (samples, 3) in m, from rest, of a point mass with the vehicle's mass under weight and the sum of all hub
    forces."""
    mass, period = sum(body.mass for body in vehicle.tree.bodies), hub_forces.period
    hubs = hub_forces.samples.reshape(SAMPLE_COUNT, -1, WRENCH)[:, :, :3].sum(axis=1)
    begin = hubs[:-1] / mass - [0.0, 0.0, GRAVITY]
    end = begin if are_samples_held else hubs[1:] / mass - [0.0, 0.0, GRAVITY]
    speeds = np.vstack([np.zeros(3), np.cumsum(period / 2.0 * (begin + end), axis=0)])
    steps = period * speeds[:-1] + period**2 / 6.0 * (2.0 * begin + end)
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def acceleration_difference_between_rows(vehicle: CutVehicle, state_count: int) -> float:
    """Largest relative difference between accelerations by compiled forces and by the plain equations, at random states
    and times, with random hub forces and guides that are interpolated between their rows."""
    rng, rows, worst = np.random.default_rng(SEED), 7, 0.0
    for i in range(state_count):
        hubs = static_forces(vehicle, rows).hubs + rng.normal(0.0, 500.0, (rows, WRENCH * len(vehicle.hubs)))
        hub_inputs = HubInputs(hubs, FORCE_FRAMES[i % 3], guide=rng.normal(0.0, 0.1, (rows, 6)))
        run_settings = Settings("DOP853", STEP, (rows // 2) * STEP)
        compiled, plain = (
            HubModel(engine, vehicle, hub_inputs, run_settings) for engine in ("reference", PLAIN_ENGINE)
        )
        state, time = random_states(vehicle, i), rng.uniform(0.0, run_settings.duration)
        expected = plain.acceleration(time, *state)
        gap = np.abs(compiled.acceleration(time, *state) - expected).max() / np.abs(expected).max()
        worst = max(worst, float(gap))
    return worst


def trajectory_gap(vehicle: CutVehicle, engine: str, integrator_name: str) -> float:
    """Largest difference of any coordinate or rate between a run by an adaptive integrator and a run by Runge-Kutta 4
    with an eighth of the step; hub forces are linear between their samples."""
    forces, run_settings = samples(vehicle), settings(integrator_name)
    fine = Settings(FIXED_STEP_METHOD, STEP / 8.0, run_settings.duration)
    hub_inputs, finer = (
        forces.hub_inputs(settings_of_run.step, settings_of_run.steps) for settings_of_run in (run_settings, fine)
    )
    run, truth = (
        HubModel(engine, vehicle, hub_inputs, run_settings).run(),
        HubModel("reference", vehicle, finer, fine).run(),
    )
    return float(np.abs(run.states - truth.states[::8]).max())
