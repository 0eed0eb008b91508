"""Laws of the braked wheel, each computed by compiled code and by independent plain code, at random states.

Differences are divided by the largest of the values, so that the rounding of a small force does not count.
"""

from dataclasses import replace

import numpy as np

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controller import APPLY, HOLD, RELEASE, SLOW
from models.brake.plain import pressure as plain_pressure
from models.brake.plain import road as plain_road
from models.brake.plain import tyre as plain_tyre
from models.brake.pressure import AirState, BrakeChambers, advance_by_pressures, advance_by_valves, air_at_rest
from models.brake.surfaces import RoadStretch, RoadSurfaces, road_of_stretches
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import StackedTyreTables, TyreTable, stacked_tables
from validation.braking import compiled_brakes as compiled
from validation.braking.compiled_brakes import PAPER_PLANE
from validation.braking.plain_relaxation import lag_on as plain_lag_on

STATE_COUNT = 400
SEED = 20_26
LOADS = np.array([1e3, 4e3, 1e4])
FRICTION_BY_LOAD = np.array([1.1, 1.0, 0.8])
"""Friction at the loads LOADS (N) divided by the surface's friction."""


def load_dependent_tyre(surface_name: str) -> TyreTable:
    """Tyre table of a surface, changed so that friction falls with the load."""
    tyre_tables_of = table_of_surface(surface_name)
    spread = tyre_tables_of.refined(tyre_tables_of.angles, tyre_tables_of.slips, LOADS)
    return replace(spread, mu_x=spread.mu_x * FRICTION_BY_LOAD[None, :, None], h=spread.h * FRICTION_BY_LOAD)


def tables() -> StackedTyreTables:
    """Tyre tables of three surfaces, each at several loads, stacked for compiled functions."""
    return stacked_tables([load_dependent_tyre(name) for name in ("dry", "wet", "ice")])


def largest_difference(compiled_values: np.ndarray, plain_values: np.ndarray) -> float:
    """Largest difference between two arrays (n, columns), divided in each column by its largest magnitude. Infinite
    where a value is not a number."""
    scale = np.maximum(np.abs(plain_values).max(axis=0), 1e-300)
    difference = float(np.max(np.abs(compiled_values - plain_values) / scale))
    return difference if np.isfinite(difference) else np.inf


def tyre_reports(state_count: int = STATE_COUNT, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Tyre reports (state_count, 7) after random time steps, by compiled and by plain code. Wheels roll, are locked,
    are released or spin backwards.
    """
    random, tyre_tables = np.random.default_rng(seed), tables()
    reports, plain = np.empty((2, state_count, 7))
    for i in range(state_count):
        u, rate, across = random.uniform(-3.0, 30.0), random.uniform(-9.0, 3.0), random.normal(0.0, 1.0)
        slip = random.choice([0.0, 1.0, random.uniform(-0.3, 1.2), random.uniform(-3.0, 2.0)])
        radius, inertia, step = random.uniform(0.25, 0.5), random.uniform(0.5, 15.0), random.choice([5.5e-3, 1.4e-3])
        load, level = random.uniform(0.0, 12e3), random.choice([0.0, 300.0, 2e3, 1e5])
        load *= random.choice([1.0, 1.0, 0.03])  # of light loads the slip decays so slowly that a series stands for it
        torques = level * random.uniform(0.5, 1.0), level * random.uniform(0.0, 1.0)
        first, second_table = map(int, random.integers(0, 3, 2))
        under = plain_tyre.WheelSurface(first, second_table, float(random.choice([0.0, random.uniform()])))
        turning = u * (1.0 - slip) / radius
        motion = plain_tyre.WheelMotion(u, rate, u + 0.5 * step * rate, across, 0.1)
        braked = plain_tyre.BrakedStep(torques, step, radius, inertia, turning)
        plain[i] = plain_tyre.tyre_report(tyre_tables, under, motion, load, braked)
        reports[i] = compiled.tyre(tyre_tables, under, motion, load, braked)
    return reports, plain


def random_surfaces(state_count: int = STATE_COUNT, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Surfaces under the wheels of a truck that crosses seams and lines between surfaces, by compiled and by plain
    code. Shape (4 state_count, 3): number of the first surface, of the second, share of the second."""
    random, shares, plain = np.random.default_rng(seed), list[np.ndarray](), list[list[float]]()
    stretched: RoadSurfaces = road_of_stretches(
        [RoadStretch(0.0, 0, 1), RoadStretch(1.0, 2, 2), RoadStretch(1.7, 1, 0)], 0.3, 2
    )
    kind = np.array([0, 0, 1, 1])
    for _ in range(state_count):
        state = np.array([random.uniform(-2.0, 4.0, 3), random.uniform(-30.0, 30.0, 3)]) * [1.0, 0.5, 1.0]
        step = random.choice([5.5e-3, 1e-3])
        shares.append(compiled.under_wheels(stretched, state, step, kind))
        under = plain_road.surfaces_under_wheels(
            stretched, plain_road.ground_paths(state[0], state[1], PAPER_PLANE.place, step), kind
        )
        plain += [[surface.first, surface.second, surface.share] for surface in under]
    return np.concatenate(shares), np.array(plain)


def torques_by_commands(sample_count: int = 60, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Pressures, torques and supply pressure (n, 9) under random valve and pressure commands, by compiled and by plain
    code."""
    random, four = np.random.default_rng(seed), np.ones(4)
    brakes = brakes_of_wheels(
        Brake(push_out=0.75, release=0.5, rising=1500.0, falling=1600.0),
        Brake(push_out=0.7, release=0.7, rising=1400.0, falling=1400.0),
        Brake(push_out=0.25, release=0.2, rising=1200.0, falling=1300.0),
        Brake(push_out=0.0, release=0.0, rising=1000.0, falling=1000.0),
    )
    rows: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for delay in (0.0, 2e-3, 5.5e-3, 13e-3):
        chambers = BrakeChambers(
            0.15 * four, np.array([0.1, 0.1, 0.0, 0.2]), 8.0, four * [0.5, 0.4, 0.3, 0.6], 40.0, delay, 0.6 * four
        )
        airs = air_at_rest(chambers, 5.5e-3), air_at_rest(chambers, 5.5e-3)
        pressures = plain_pressure.PlainAirSystem(chambers, brakes, 5.5e-3, airs[1])
        for n in range(sample_count):
            valves = random.choice([RELEASE, HOLD, APPLY, APPLY, SLOW], 4)
            torques = np.empty((2, 5, 4))
            if n % 20 == 19:
                levels = random.uniform(0.0, 6.0, 4)
                advance_by_pressures(levels, airs[0], brakes, torques[0])
                pressures.by_pressures(levels, torques[1])
            else:
                advance_by_valves(valves, 5.5e-3, airs[0], chambers, brakes, torques[0])
                pressures.by_valves(valves, torques[1])
            for k in range(2):
                rows[k].append(_air_row(airs[k], torques[k]))
    return np.array(rows[0]), np.array(rows[1])


def _air_row(air_system: AirState, brake_torques: np.ndarray) -> np.ndarray:
    return np.concatenate((air_system.pressure, brake_torques.ravel(), air_system.supply))


def slip_lags(state_count: int = STATE_COUNT, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Lagging slip angles (rad) after a time step and those used within the step, (state_count, 8), of random states,
    by compiled and by plain code.
    """
    random, steer = np.random.default_rng(seed), np.array([0.1, 0.1, 0.0, 0.0])
    lags, plain = np.empty((2, state_count, 8))
    for i in range(state_count):
        state = np.array([random.uniform(-3.0, 3.0, 3), random.normal(0.0, 1.0, 3)])
        state[1, :2] *= random.choice([0.0, 0.3, 20.0])
        length, time, slope = random.uniform(0.1, 2.0, 4), random.choice([5.5e-3, 0.5]), random.uniform(5.0, 30.0)
        lag = np.where(random.uniform(size=4) < 0.2, np.nan, random.normal(0.0, 0.1, 4))
        lag = lag if state[1].any() else np.nan_to_num(lag)
        lags[i] = np.concatenate(compiled.lag_on(state, time, steer, slope, length, lag))
        plain[i] = np.concatenate(plain_lag_on(state, time, steer, PAPER_PLANE.place, slope, length, lag))
    return lags, plain


def friction_of_random_states(state_count: int = STATE_COUNT, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Friction coefficients mu_x and mu_y (state_count, 2) of random states, by compiled code on stacked tables and by
    plain code on each single table with its original nodes.
    """
    random, tyres = (
        np.random.default_rng(seed),
        [table_of_surface("dry"), load_dependent_tyre("wet"), load_dependent_tyre("ice")],
    )
    all_tables, (coefficients, plain) = stacked_tables(tyres), np.empty((2, state_count, 2))
    for i in range(state_count):
        tyre_index, angle, load = int(random.integers(len(tyres))), random.uniform(0.0, 1.7), random.uniform(0.0, 12e3)
        slip, chosen = random.uniform(), tyres[tyre_index]
        coefficients[i] = compiled.friction(all_tables, tyre_index, angle, load, slip)
        single_tables = StackedTyreTables(
            chosen.angles, chosen.slips, chosen.loads, chosen.mu_x[None], chosen.g[None], chosen.h[None]
        )
        friction = plain_tyre.TyreFriction(single_tables, plain_tyre.WheelSurface(0, 0, 0.0), angle, load)
        friction_along = friction.force_along()
        plain[i] = np.interp(slip, friction_along.slips, friction_along.forces) / load, friction.side_force(slip) / load
    return coefficients, plain
