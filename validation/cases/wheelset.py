"""A wheelset on straight track in three implementations: wavelength, critical speed, simulations, limit cycles,
friction power, planted faults."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.rail import equations as eq
from models.rail.eigenvalues import hunting_wavelength, largest_growth_rate
from models.rail.energy import energy_ledger
from models.rail.equations import WheelsetEquations
from models.rail.limit_cycle import Orbit, attained_limit_cycle, guess_from_orbit, refined_orbit, solved_orbit
from models.rail.linear import NoCriticalSpeed, critical_speed, klingel_wavelength
from models.rail.wheelset import CHOSEN_WHEELSET, Wheelset
from models.systems.wheelset.of_scene import IMPLEMENTATION_MODULES, equations_class
from validation.common.checks import largest_relative_difference
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.contact.drawn_wheelsets import (
    HEAVY_WHEELSET,
    SEED,
    STIFF_WHEELSET,
    CriticalSpeeds,
    critical_speeds,
    drawn_wheelsets,
)
from validation.faults import wheelset as faults

TITLE = "A wheelset on straight track"
SYSTEM: System = "rolling-vehicle"
EDGE_RAIL_HEAD_RADIUS = 2e-3
"""Head radius (m) of rails that are nearly edges, as in Klingel's formula."""
TIME_STEP, DURATION = 5e-4, 1.0
RANDOM_STATE_DEVIATIONS = np.array([6e-3, 5e-5, 2e-3, 2e-2, 3.0, 0.3, 0.05, 1.0, 1.0, 10.0])
"""Standard deviations of random states about rest, so large that flanges touch, wheels lift off, and creep forces
saturate."""
RATIO_TO_CRITICAL_SPEED = 1.1
"""Speed of simulations and limit cycles divided by the critical speed."""
ENGINE_NAMES = tuple(name for name in IMPLEMENTATION_MODULES if name != "reference")


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows: wavelength, critical speed, accelerations, simulations, limit cycles, energy and planted faults. A quick
    run has the chosen wheelset alone, without planted faults."""
    wheelsets = {"chosen": CHOSEN_WHEELSET} | ({} if quick else drawn_wheelsets())
    speeds = {name: critical_speeds(wheelset, quick or name != "chosen") for name, wheelset in wheelsets.items()}
    rows = [*_wavelength_rows(wheelsets), *_critical_speed_rows(speeds), *_acceleration_rows(wheelsets)]
    rows += _simulation_rows(wheelsets, speeds, 11 if quick else 21)
    cycles = _limit_cycles(wheelsets, speeds, ("reference", "mujoco") if quick else tuple(IMPLEMENTATION_MODULES))
    rows += [*_limit_cycle_rows(cycles), _convergence_order_row(), *_energy_rows()]
    if not quick:
        rows += [
            _no_critical_speed_row("heavy", HEAVY_WHEELSET, "unstable"),
            _no_critical_speed_row("stiff", STIFF_WHEELSET, "stable"),
            *_planted_fault_rows(),
        ]
    orbit_fields = ("speed", "amplitude", "frequency", "error", "frequency_error")
    return rows, {
        "critical": speeds,
        "cycles": {
            name: {
                engine: {key: float(getattr(orbit, key)) for key in orbit_fields} for engine, orbit in of_engine.items()
            }
            for name, of_engine in cycles.items()
        },
    }


def _relative_spread(compared_values: Iterable[float]) -> float:
    """Largest difference between any two values, divided by the largest magnitude."""
    every = np.array(list(compared_values))
    return float(np.ptp(every) / np.abs(every).max())


def _wavelength_rows(wheelsets: dict[str, Wheelset]) -> list[Row]:
    """Rows: wavelength of each free wheelset in all implementations, compared with the closed form and, on knife-edge
    rails, with Klingel's formula."""
    closed, edges, among = [], [], []
    for wheelset in wheelsets.values():
        waves = {engine: hunting_wavelength(equations_class(engine), wheelset) for engine in IMPLEMENTATION_MODULES}
        closed.append(max(abs(wave / klingel_wavelength(wheelset) - 1.0) for wave in waves.values()))
        among.append(_relative_spread(waves.values()))
        edge = wheelset.changed(head_radius=EDGE_RAIL_HEAD_RADIUS)
        plain = 2.0 * np.pi * np.sqrt(edge.radius * edge.half_gauge / edge.conicity)
        edges.append(abs(hunting_wavelength(WheelsetEquations, edge) / plain - 1.0))
    count = f"of {len(wheelsets)} wheelsets without suspension at 0.2 m/s"
    return [
        Observed(
            "wheelset.wave.closed",
            SYSTEM,
            f"wavelength {count}: relative difference of the eigenvalues of all motions from the closed form",
            max(closed),
            "",
        ).at_most(1e-3, "cones on round heads without slip; inertia and spin creepage are what is left", "closed form"),
        Observed(
            "wheelset.wave.klingel",
            SYSTEM,
            f"wavelength {count} on rails that are edges: relative difference from Klingel's formula",
            max(edges),
            "",
        ).at_most(1e-3, "2 pi sqrt(r b / c), for which rails have no radius", "closed form"),
        Observed(
            "wheelset.wave.engines",
            SYSTEM,
            f"wavelength {count}: relative difference between three implementations",
            max(among),
            "",
        ).at_most(1e-6, "each linearises its own equations of motion around the same contact forces", "shared kernel"),
    ]


def _critical_speed_rows(critical_speed_table: CriticalSpeeds) -> list[Row]:
    """Rows: largest relative difference between the implementations' critical speeds, and whether they agree on which
    wheelsets have one."""
    there = [[speed for speed in speeds.values() if speed is not None] for speeds in critical_speed_table.values()]
    agreed = all(len(of_engine) in (0, len(IMPLEMENTATION_MODULES)) for of_engine in there)
    having = [of_engine for of_engine in there if len(of_engine) == len(IMPLEMENTATION_MODULES)]
    why = (
        "each linearises its own equations of motion around the same contact forces, and looks for itself: at all "
        "speeds for the chosen wheelset, for drawn ones near the first's and below"
    )
    return [
        Observed(
            "wheelset.critical.engines",
            SYSTEM,
            f"critical speed of {len(having)} wheelsets: relative difference between three implementations",
            max(map(_relative_spread, having)),
            "",
        ).at_most(1e-6, why, "shared kernel"),
        behaviour_row(
            "wheelset.critical.agreed",
            SYSTEM,
            f"which of {len(there)} wheelsets have a critical speed",
            "agreed" if agreed else "different",
            "agreed",
            why,
            "shared kernel",
        ),
    ]


def _no_critical_speed_row(wheelset_name: str, wheelset: Wheelset, expected_outcome: str) -> Row:
    """Row: all implementations report that a wheelset has no critical speed, and why."""
    outcomes = set()
    for engine in IMPLEMENTATION_MODULES:
        try:
            outcomes.add(f"{critical_speed(wheelset, partial(largest_growth_rate, equations_class(engine))):.3g} m/s")
        except NoCriticalSpeed as error:
            outcomes.add("unstable" if error.unstable else "stable")
    return behaviour_row(
        f"wheelset.critical.{wheelset_name}",
        SYSTEM,
        f"outcome of three implementations for a {wheelset_name} wheelset at all speeds",
        " or ".join(sorted(outcomes)),
        expected_outcome,
        "nothing holds it, or more than creep forces can drive",
    )


def _acceleration_rows(wheelsets: dict[str, Wheelset]) -> list[Row]:
    """Rows: state derivatives of each engine at random states, compared with the reference equations."""
    draw, rows = np.random.default_rng(SEED), []
    for engine in ENGINE_NAMES:
        worst = 0.0
        for wheelset in wheelsets.values():
            written, built = (equations_class(name)(wheelset, 60.0, cells=11) for name in ("reference", engine))
            states = written.rest + RANDOM_STATE_DEVIATIONS * draw.normal(size=(20, eq.STATE_COUNT))
            worst = max(
                worst, *(largest_relative_difference(built.rates(state), written.rates(state)) for state in states)
            )
        rows.append(
            Observed(
                f"wheelset.accelerations.{engine}",
                SYSTEM,
                f"largest difference of the rates at 20 random states of {len(wheelsets)} wheelsets "
                "with FASTSIM, over the largest rate",
                worst,
                "",
            ).at_most(1e-10, "the engine's own equations of motion around the same contact forces", "shared kernel")
        )
    return rows


def _travel_speed_of_simulation(critical_speed_table: CriticalSpeeds, wheelset_name: str) -> float:
    """Speed (m/s) of a wheelset's simulation: above its critical speed, or 60 m/s if it has none."""
    critical = critical_speed_table[wheelset_name]["reference"]
    return min(RATIO_TO_CRITICAL_SPEED * critical, 180.0) if critical is not None else 60.0


def _simulation_rows(
    wheelsets: dict[str, Wheelset], critical_speed_table: CriticalSpeeds, cell_count: int
) -> list[Row]:
    """Rows on simulations of one second by RK4 with FASTSIM: differences between the implementations, and the sign of
    the creep forces' power."""
    pairs = {("reference", engine): 0.0 for engine in ENGINE_NAMES} | {ENGINE_NAMES: 0.0}
    positive = steps = 0
    for name, wheelset in wheelsets.items():
        paths: dict[str, Any] = {}
        setup: tuple[Any, ...] = (
            wheelset,
            _travel_speed_of_simulation(critical_speed_table, name),
            "fastsim",
            cell_count,
        )
        step = _time_step_of_wheelset(WheelsetEquations(*setup))
        for engine in IMPLEMENTATION_MODULES:
            equations = equations_class(engine)(*setup)
            paths[engine] = equations.run(equations.displaced_state(4e-3), DURATION, step)
            power = paths[engine].contacts["power"]
            positive, steps = positive + int((power > 0.0).sum()), steps + power.size
        for first, second in pairs:
            gap = float(np.abs(paths[first].states - paths[second].states).max())
            pairs[first, second] = max(pairs[first, second], gap)
    of = f"states of {len(wheelsets)} wheelsets over 1 s with FASTSIM ({cell_count} cells), RK4 at the same step"
    why = "the same method and contact forces; what differs is rounding"
    return [
        *(
            Observed(
                f"wheelset.path.{engine}",
                SYSTEM,
                f"{of}: largest difference of {engine} from the equations (m, rad, s)",
                pairs["reference", engine],
                "",
            ).at_most(1e-10, why, "shared kernel")
            for engine in ENGINE_NAMES
        ),
        Observed(
            "wheelset.path.between",
            SYSTEM,
            f"{of}: largest difference between the two engines",
            pairs[ENGINE_NAMES],
            "",
        ).at_most(1e-10, why, "shared kernel"),
        Observed(
            "wheelset.power",
            SYSTEM,
            f"creep forces with a power above zero, of {steps:,}, at every step of these paths",
            positive,
            "",
        ).at_most(0, "friction takes energy and never gives any", "none"),
    ]


def _time_step_of_wheelset(equations: WheelsetEquations) -> float:
    """Time step (s) for the wheelset's fastest motion: TIME_STEP, or a smaller step that divides DURATION."""
    fastest = float(np.abs(np.linalg.eigvals(equations.state_matrix)).max())
    return DURATION / np.ceil(DURATION / min(TIME_STEP, 1.0 / fastest))


def _limit_cycles(
    wheelsets: dict[str, Wheelset], critical_speed_table: CriticalSpeeds, engine_names: tuple[str, ...]
) -> dict[str, dict[str, Orbit]]:
    """Limit cycles by wheelset and implementation: of the chosen wheelset, and of those whose critical speed is low
    enough for a simulation above this speed.

    Each implementation starts from a guess that is 1 % off, and closes the orbit again at half the step.
    """
    cycles = {}
    for name, wheelset in wheelsets.items():
        if name != "chosen" and not 20.0 < (critical_speed_table[name]["reference"] or 0.0) < 160.0:
            continue
        setup: tuple[Any, ...] = (wheelset, _travel_speed_of_simulation(critical_speed_table, name), "fastsim", 11)
        first = attained_limit_cycle(
            WheelsetEquations(*setup), time_step=_time_step_of_wheelset(WheelsetEquations(*setup))
        )
        if first is not None:
            guesses = {engine: guess_from_orbit(first, equations_class(engine)(*setup)) for engine in engine_names}
            cycles[name] = {
                engine: refined_orbit(solved_orbit(guess, "amplitude", is_precise=False), "amplitude")
                for engine, guess in guesses.items()
            }
    return cycles


def _limit_cycle_rows(limit_cycles: dict[str, dict[str, Orbit]]) -> list[Row]:
    """Rows on amplitude and frequency of the limit cycles: relative change by halving the step, and difference between
    the implementations divided by this change."""
    rows, count = list[Row](), len(limit_cycles["chosen"])
    for value, error in (("amplitude", "error"), ("frequency", "frequency_error")):
        every = [
            [(getattr(o, value), getattr(o, error)) for o in of_engine.values()] for of_engine in limit_cycles.values()
        ]
        errors = max(e / v for of_engine in every for v, e in of_engine)
        apart = max(float(np.ptp([v for v, _ in of_engine])) / max(e for _, e in of_engine) for of_engine in every)
        of = f"{value} of the limit cycle of {len(limit_cycles)} wheelsets above the critical speed"
        rows += [
            Observed(
                f"wheelset.cycle.{value}.error", SYSTEM, f"{of}: relative change if the step is halved", errors, ""
            ).at_most(1e-2, "Newton's method closes the orbit at either step", "none"),
            Observed(
                f"wheelset.cycle.{value}",
                SYSTEM,
                f"{of}: ratio of the difference between {count} implementations to the error of the step",
                apart,
                "",
            ).at_most(1.0, "each closes its own orbit, from a guess that is 1 % off", "shared kernel"),
        ]
    return rows


def _convergence_order_row() -> Row:
    """Row: observed order of RK4 with linear creep, from three steps."""
    equations = WheelsetEquations(CHOSEN_WHEELSET, 60.0, "linear")
    start = equations.displaced_state(5e-3)
    ends = [equations.run(start, 0.1, step).states[-1] for step in (1.25e-4, 6.25e-5, 3.125e-5)]
    first, second = np.abs(ends[0] - ends[1])[eq.YAW], np.abs(ends[1] - ends[2])[eq.YAW]
    return Observed(
        "wheelset.order",
        SYSTEM,
        "observed order of RK4 in the yaw after 0.1 s, linear creep",
        float(np.log2(first / second)),
        "",
    ).within(4.0, 0.2, "the order of the method", "closed form")


def _energy_rows() -> list[Row]:
    """Rows: error of the energy balance of a simulation without flange contact, and observed order of this error in the
    step, for both creep laws."""
    rows = list[Row]()
    for law, named in (("linear", "linear creep"), ("fastsim", "FASTSIM (11 cells)")):
        equations = WheelsetEquations(CHOSEN_WHEELSET, 60.0, law, 11)  # type: ignore[arg-type]
        left = []
        for step in (TIME_STEP, TIME_STEP / 2.0, TIME_STEP / 4.0):
            book = energy_ledger(equations, equations.run(equations.displaced_state(5e-3), 0.1, step))
            left.append(float(np.abs(book.residual).max() / book.creep[-1]))
        rows += [
            Observed(
                f"wheelset.energy.{law}",
                SYSTEM,
                f"error of the energy balance over a path of 0.1 s / energy dissipated by creep, {named}",
                left[-1],
                "",
            ).at_most(1e-8, "steps of 0.125 ms; works by the stages of RK4", "none"),
            Observed(
                f"wheelset.energy.{law}.order",
                SYSTEM,
                f"observed order at which the ledger's open energy falls with the step, {named}",
                float(np.log2(left[0] / left[1])),
                "",
            ).within(4.0, 0.2, "that of the integrator", "none"),
        ]
    return rows


def _planted_fault_rows() -> list[Row]:
    """Rows: a small fault planted in one implementation must exceed the tolerances of the other rows."""
    equations, engine = WheelsetEquations(CHOSEN_WHEELSET, 60.0), equations_class("mujoco")(CHOSEN_WHEELSET, 60.0)
    state = equations.displaced_state(3e-3)
    right = largest_relative_difference(engine.rates(state), equations.rates(state))
    with faults.creep_law_patch(faults.spin_reversed)()():
        spin = largest_relative_difference(engine.rates(state), equations.rates(state))
    softer = CHOSEN_WHEELSET.changed(stiffness_x=0.99 * CHOSEN_WHEELSET.stiffness_x)
    stiff, changed = (
        critical_speed(wheelset, partial(largest_growth_rate, WheelsetEquations))
        for wheelset in (CHOSEN_WHEELSET, softer)
    )
    seen = {"sign of the spin": right < 1e-10 < spin, "1 % of a stiffness": abs(changed / stiff - 1.0) > 1e-6}
    return [
        behaviour_row(
            f"wheelset.fault.{name.split()[-1]}",
            SYSTEM,
            f"a planted fault in a single implementation is noticed: {name}",
            "seen" if caught else "unseen",
            "seen",
            "beyond the bounds of the rows above",
        )
        for name, caught in seen.items()
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of critical speeds and of limit cycles."""
    speeds = tuple(
        (name, *("none" if v is None else f"{v:.9g}" for v in of_engine.values()))
        for name, of_engine in case_data["critical"].items()
    )
    cycles = tuple(
        (
            name,
            engine,
            f"{o['speed']:.4g}",
            f"{1e3 * o['amplitude']:.7f}",
            f"{1e3 * o['error']:.0e}",
            f"{o['frequency']:.8f}",
            f"{o['frequency_error']:.0e}",
        )
        for name, of_engine in case_data["cycles"].items()
        for engine, o in of_engine.items()
    )
    note = "In m/s, with linear creep; parameters drawn at random but for the chosen ones."
    heads = ("wheelset", "implementation", "speed [m/s]", "amplitude [mm]", "error", "frequency [Hz]", "error")
    return [
        Table("Critical speed of wheelsets", note, ("wheelset", *IMPLEMENTATION_MODULES), speeds),
        Table(
            "Limit cycles of wheelsets",
            "With FASTSIM, 11 cells; errors are what halving the step changes.",
            heads,
            cycles,
        ),
    ]
