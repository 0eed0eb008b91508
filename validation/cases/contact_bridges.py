"""Computing time of a contact kernel inside a multibody engine, split into the kernel itself, the call from the engine,
and the engine's own step."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np

from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_approach
from models.contact.inputs import Array
from models.contact.patches import separate_patches
from models.contact.simplified_theory import solve_normal_contact, solve_rolling_contact
from models.engines.contact_bridge import FREEDOM, FREEDOMS, RailWheels, Theory, add_forces, forces
from models.engines.contact_bridge_exudyn import ROUTES, RailWheelSystem, WheelForceFunctions
from models.engines.contact_bridge_mujoco import empty_law, python_law, rail_wheel_model
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_march import Marcher
from models.engines.mujoco_quiet import installed_callback
from models.machine.compiled import njit
from models.machine.stack import start
from models.machine.timing import bootstrap_median, interleave, interval_text
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.contact import slow_wheels

TITLE = "What a contact kernel costs inside an engine"
SYSTEM: System = "rolling-vehicle"
TIME_STEP = 2e-5
STEP_COUNT_BY_BRIDGE = {
    "none": 1000,
    "empty": 600,
    "native": 160,
    "jitted": 160,
    "plain": 6,
    "simplified": 4,
    "plain simplified": 2,
}
"""Number of steps of a timed run, by bridge, for an integrator with one force call per step. The runs take a few
milliseconds, so that some of them are not disturbed by other processes."""
CONTACT_THEORIES_AND_CELLS = (
    ("linear", 0),
    ("fastsim", 7),
    ("fastsim", 11),
    ("fastsim", 21),
    ("fastsim", 41),
    ("simplified", 21),
)
"""Contact theories, each with a number of cells per strip."""
MAIN_CONTACT_LAW = CONTACT_THEORIES_AND_CELLS[3]
WHEEL_COUNTS = (1, 4, 8)
FORCE_CALLS_PER_STEP = {"Euler": 1, "RK4": 4, "ExplicitEuler": 1, "RK44": 4}
"""Number of force calls per step of each integrator."""
ENGINE_NAMES = {"mujoco": "MuJoCo", "exudyn": "Exudyn"}
THEORY_NAMES = {"linear": "linear theory", "simplified": "non-Hertzian"}
INTEGRATORS = {"mujoco": ("Euler", "RK4"), "exudyn": ("ExplicitEuler", "RK44")}
"""Usual integrator and fine integrator of each engine."""
TIMING_ROUNDS, FIGURE_ROUNDS = 48, 6
"""Timing rounds of the set-ups that have rows, which are timed separately because other work between them slows short
runs; and timing rounds of all set-ups for the table."""
SHORTEST_RUN_SECONDS = 0.001
TIMING_NOTE = "median of the ratios within interleaved rounds, seconds of the processor; start of a run taken out"


@dataclass(frozen=True)
class ContactTimingSetup:
    """One way to simulate wheels with contact. bridge: how the engine calls the contact forces (none, empty, native,
    jitted, plain, or a route of Exudyn's); contact_law: contact theory and number of cells, None where no contact is
    computed."""

    engine: str
    integrator: str
    bridge: str
    contact_law: tuple[str, int] | None
    wheel_count: int

    def law_name(self) -> str:
        """Name of the contact law."""
        if self.contact_law is None:
            return "no contact" if self.bridge == "none" else "empty callback"
        theory, cells = self.contact_law
        return f"FASTSIM, {cells} cells" if theory == "fastsim" else THEORY_NAMES[theory]

    @property
    def is_reported(self) -> bool:
        """Whether the report has a row on the cost of this set-up."""
        return (self.contact_law, self.wheel_count) == (MAIN_CONTACT_LAW, 4) and self.bridge in ("native", ROUTES[0])

    @property
    def without_contact(self) -> "ContactTimingSetup":
        """The same set-up without contact."""
        return replace(self, bridge="none", contact_law=None)

    def wheels(self) -> RailWheels:
        """The wheels that this set-up simulates."""
        theory, cells = self.contact_law or ("none", 21)
        return RailWheels(self.wheel_count, cast(Theory, theory), cells or 21)


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on equal results of threads and engines, and on low speeds; a full run also has the cost of every contact
    law and bridge.

    Costs are measured by the full run only: a few timing rounds are not enough.
    """
    rows, done = slow_wheels.rows(quick)
    rows += [_equal_bits_in_threads_row(), _engine_agreement_row()]
    data: dict[str, Any] = {"slow": [asdict(run) for run in done]}
    if quick:
        return rows, data
    setups = all_timing_setups()
    listed_setups = [setup for setup in setups if setup.is_reported]
    rows += _bridge_cost_rows(
        MeasuredContactTimes([*listed_setups, *(setup.without_contact for setup in listed_setups)], TIMING_ROUNDS)
    )
    shown = MeasuredContactTimes(setups, FIGURE_ROUNDS)
    return rows, {**data, "points": [shown.table_entry(setup) for setup in setups]}


def all_timing_setups() -> list[ContactTimingSetup]:
    """All timed combinations of engine, integrator, bridge, contact law and number of wheels."""
    setups = []
    for engine, (usual, fine) in INTEGRATORS.items():
        best, *other_bridges = ("native", "jitted", "plain") if engine == "mujoco" else (*ROUTES, "plain")
        for method, count in (*((usual, count) for count in WHEEL_COUNTS), (fine, 4)):
            setups += [ContactTimingSetup(engine, method, bridge, None, count) for bridge in ("none", "empty")]
            setups += [
                ContactTimingSetup(engine, method, best, law, count)
                for law in (CONTACT_THEORIES_AND_CELLS if method == usual else (MAIN_CONTACT_LAW,))
            ]
        setups += [
            ContactTimingSetup(engine, method, other_bridge, MAIN_CONTACT_LAW, 4)
            for method in (usual, fine)
            for other_bridge in other_bridges
        ]
    return [*setups, ContactTimingSetup("mujoco", "Euler", "plain", CONTACT_THEORIES_AND_CELLS[-1], 4)]


class MeasuredContactTimes:
    """Measured times (s) of every timing round: per step of each set-up, and per evaluation of the contact forces of
    all wheels."""

    def __init__(self, timing_setups: list[ContactTimingSetup], round_count: int) -> None:
        self.setups = timing_setups
        kernels = sorted(
            {(setup.contact_law, setup.wheel_count) for setup in timing_setups if setup.contact_law is not None}
        )
        runs, loops = (
            [_timed_march(setup) for setup in timing_setups],
            [_timed_kernel(law, wheel_count) for law, wheel_count in kernels],
        )
        jobs = [part for march, steps in runs for part in (partial(march, steps), partial(march, 1))]
        seconds = interleave(
            [*jobs, *(job for job, _ in loops)], round_count, SHORTEST_RUN_SECONDS, clock=time.process_time
        )
        full_time, first, alone = seconds[: len(jobs) : 2], seconds[1 : len(jobs) : 2], seconds[len(jobs) :]
        self._steps = {
            setup: (a, b, steps - 1)
            for setup, a, b, (_, steps) in zip(timing_setups, full_time, first, runs, strict=True)
        }
        self._calls = {kernel: setup / calls for kernel, setup, (_, calls) in zip(kernels, alone, loops, strict=True)}

    def times_by_round(self, timing_setup: ContactTimingSetup) -> tuple[Any, Any, Any]:
        """Times (s) by timing round: of a step, of a step without contact (the engine's own share), and of the contact
        kernel in a step."""
        step, bare = (
            (full_time - first) / steps
            for full_time, first, steps in (self._steps[timing_setup], self._steps[timing_setup.without_contact])
        )
        calls = 1 if timing_setup.bridge == "before each step" else FORCE_CALLS_PER_STEP[timing_setup.integrator]
        return (
            step,
            bare,
            0.0
            if timing_setup.contact_law is None
            else calls * self._calls[timing_setup.contact_law, timing_setup.wheel_count],
        )

    def table_entry(self, timing_setup: ContactTimingSetup) -> dict[str, Any]:
        """Median time (s) of a step, its parts for engine, kernel and bridge, and the bridge's share of the step."""
        a, b, c = self.times_by_round(timing_setup)
        step, bare, kernel = (float(np.median(round_times)) for round_times in (a, b, c))
        share = bootstrap_median((a - b - c) / a)
        return {
            "engine": timing_setup.engine,
            "method": timing_setup.integrator,
            "bridge": timing_setup.bridge,
            "law": timing_setup.law_name(),
            "wheels": timing_setup.wheel_count,
            "main": timing_setup.contact_law == MAIN_CONTACT_LAW,
            "step": step,
            "own": bare,
            "kernel": kernel,
            "over": step - bare - kernel,
            "share": share,
            "range": bootstrap_median(a)[1:],
        }


def _timed_kernel(contact_law: tuple[str, int], wheel_count: int) -> tuple[Callable[[], Any], int]:
    """Function that evaluates the contact forces of all wheels a number of times, and this number."""
    wheels = ContactTimingSetup("", "", "native", contact_law, wheel_count).wheels()
    q, v = wheels.state()
    f, numbers, calls = np.zeros(wheels.size), wheels.numbers, 4 if contact_law[0] == "simplified" else 200
    return lambda: _repeat_kernel(numbers, q, v, f, calls), calls


@njit(cache=True, error_model="numpy")
def _repeat_kernel(wheel_table, q, v, force_sum, repeat_count):
    for _ in range(repeat_count):
        forces(start(wheel_table), 0.0, start(q), start(v), start(force_sum))


def _timed_march(timing_setup: ContactTimingSetup) -> tuple[Callable[[int], Any], int]:
    """Function that simulates a given number of steps, and the number of steps to time."""
    wheels = timing_setup.wheels()
    kind = timing_setup.bridge if timing_setup.bridge in STEP_COUNT_BY_BRIDGE else "native"
    if wheels.theory == "simplified":
        kind = "plain simplified" if timing_setup.bridge == "plain" else "simplified"
    law = contact_law_of_library(wheels) if timing_setup.bridge == "plain" else None
    march = (_mujoco_march if timing_setup.engine == "mujoco" else _exudyn_march)(timing_setup, wheels, law)
    return march, max(2, STEP_COUNT_BY_BRIDGE[kind] // FORCE_CALLS_PER_STEP[timing_setup.integrator])


def _mujoco_march(timing_setup: ContactTimingSetup, wheels: RailWheels, contact_law: Any) -> Callable[[int], Any]:
    """Function that simulates a given number of steps in MuJoCo."""
    start, march = (
        np.concatenate(wheels.state())[None],
        Marcher(rail_wheel_model(wheels, TIME_STEP, timing_setup.integrator)),
    )
    callback = {
        "none": lambda: None,
        "empty": lambda: empty_law().ctypes,
        "native": lambda: kernel_law(forces).ctypes,
        "jitted": lambda: python_law(add_forces),
        "plain": lambda: python_law(contact_law),
    }[timing_setup.bridge]()

    def job(step_count: int) -> None:
        mujoco.set_mjcb_passive(callback)
        try:
            march.run(start, step_count)
        finally:
            mujoco.set_mjcb_passive(None)

    return job


def _exudyn_march(timing_setup: ContactTimingSetup, wheels: RailWheels, contact_law: Any) -> Callable[[int], Any]:
    """Function that simulates a given number of steps in Exudyn."""
    zeros, of = [0.0] * wheels.size, None
    if timing_setup.bridge == "empty":
        of = lambda q, v: zeros  # noqa: E731
    elif timing_setup.bridge != "none":
        of = WheelForceFunctions(wheels, contact_law).of
    rolling, state = (
        RailWheelSystem(wheels, of, timing_setup.bridge if timing_setup.bridge in ROUTES else ROUTES[0]),
        wheels.state(),
    )
    return lambda steps: rolling.run(*state, steps, TIME_STEP, timing_setup.integrator)


def contact_law_of_library(wheels: RailWheels) -> Callable[[Array, Array, Array, Array], None]:
    """Contact law that calls the library's Python functions: FASTSIM, or the simplified theory of 1983."""
    bodies = separate_patches(wheels.bodies) if wheels.theory == "simplified" else None

    def add(wheel_table: Array, q: Array, v: Array, force_sum: Array) -> None:
        pressed: Any
        creep: Any
        for k, (position, rate) in enumerate(zip(q.view(FREEDOM), v.view(FREEDOM), strict=True)):
            approach, mu, speed = wheels.sunk + position["z"], wheels.mu, wheels.speed
            slip = rate["x"] / speed, rate["y"] / speed - position["yaw"], rate["yaw"] / speed
            if bodies is not None:
                pressed = solve_normal_contact(bodies, wheels.pair, approach=approach)
                creep = solve_rolling_contact(pressed, mu, *slip, cell_count=wheels.cells)
            else:
                pressed = by_approach(*wheels.curvatures, approach, wheels.pair)
                ellipse = RollingEllipse(pressed.a, pressed.b, pressed.load, mu, *slip)
                creep = fastsim(ellipse, wheels.pair, cells=wheels.cells)
            force_sum[FREEDOMS * k : FREEDOMS * (k + 1)] += creep.fx, creep.fy, wheels.load - pressed.load, creep.mz

    return add


def _bridge_cost_rows(measured_times: MeasuredContactTimes) -> list[Row]:
    """Rows: cost of the bridge in each engine, with the main contact law at four wheels."""
    rows = []
    for setup in measured_times.setups:
        if not setup.is_reported:
            continue
        step, bare, kernel = measured_times.times_by_round(setup)
        name, calls = f"contact_bridges.{setup.engine}.{setup.integrator}", FORCE_CALLS_PER_STEP[setup.integrator]
        if setup.engine == "mujoco":
            value, low, high = bootstrap_median(step / (bare + kernel))
            what, bound = f"ratio to the step without contact plus {4 * calls} kernel times", 1.3
        else:
            value, low, high = bootstrap_median((step - bare - kernel) / step)
            what, bound = "share of the bridge", 0.25
        what = (
            f"{ENGINE_NAMES[setup.engine]}, {setup.integrator}: {what}, step with FASTSIM at four wheels (21 x 21, "
            "native, "
            f"{interval_text(step, 1e6)} us), 95 % interval {low:.3f} to {high:.3f}"
        )
        rows.append(Observed(name, SYSTEM, what, value, "").aim(bound, TIMING_NOTE))
    return rows


def _equal_bits_in_threads_row() -> Row:
    """Row: runs from ten initial states give the same bits in two threads as in one."""
    wheels = RailWheels()
    states, built = (
        np.array([np.concatenate(wheels.state(seed)) for seed in range(10)]),
        rail_wheel_model(wheels, 1e-4, "RK4"),
    )
    with installed_callback(kernel_law(forces)):
        first, two = (Marcher(built, threads).run(states, 100) for threads in (1, 2))
    same = "identical" if np.isfinite(first).all() and first.tobytes() == two.tobytes() else "different"
    return behaviour_row(
        "contact_bridges.threads",
        SYSTEM,
        "ten runs of 100 steps with FASTSIM in MuJoCo give the same bits in two threads as in one",
        same,
        "identical",
        "the kernel holds nothing between calls",
    )


def _engine_agreement_row() -> Row:
    """Row: difference of the states in Exudyn and MuJoCo after 0.1 s, by Runge-Kutta's method."""
    wheels, steps = RailWheels(), 1000
    q, v = wheels.state()
    with installed_callback(kernel_law(forces)):
        path = Marcher(rail_wheel_model(wheels, 1e-4, "RK4")).run(np.concatenate((q, v))[None], steps)[0]
    by_engine = RailWheelSystem(wheels, WheelForceFunctions(wheels).of).run(q, v, steps, 1e-4, "RK44")
    size = wheels.size
    scale = np.repeat([np.abs(path[:, :size]).max(), np.abs(path[:, size:]).max()], size)
    return Observed(
        "contact_bridges.agreement",
        SYSTEM,
        "difference of the state after 0.1 s with FASTSIM in MuJoCo from that in Exudyn, over the "
        "largest displacement or rate",
        float((np.abs(path[-1] - by_engine) / scale).max()),
        "",
    ).at_most(1e-10, "the same kernel and method; what differs is rounding", "shared kernel")


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the cost per step, and of runs at low speed."""
    slow = slow_wheels.table(case_data["slow"])
    if "points" not in case_data:
        return [slow]
    note = (
        "Microseconds per step, median of interleaved rounds, that of the step with its 95 % interval; "
        "start of a run taken out. Kernel: the forces of all wheels in a compiled loop, times the calls per step. "
        "Bridge: what the step takes beyond the engine's own and the kernel, for plain Python its slower kernel "
        "too. Share: of the bridge in the step, median of the rounds with its 95 % interval. Rows time what they "
        f"tell by itself, in {TIMING_ROUNDS} rounds; here are {FIGURE_ROUNDS} of all."
    )
    heads = ("engine", "method", "wheels", "bridge", "law", "step", "engine's own", "kernel", "bridge's", "share [%]")
    rows = tuple(
        (
            p["engine"],
            p["method"],
            str(p["wheels"]),
            p["bridge"],
            p["law"],
            "{:.2f} ({:.2f} to {:.2f})".format(*(1e6 * value for value in (p["step"], *p["range"]))),
            *(f"{1e6 * p[part_name]:.2f}" for part_name in ("own", "kernel", "over")),
            "{:.0f} ({:.0f} to {:.0f})".format(*(100.0 * share for share in p["share"])),
        )
        for p in case_data["points"]
    )
    return [Table("Cost per step of a contact kernel inside an engine", note, heads, rows), slow]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the cost per step for each contact law, and the shares of engine, kernel and bridge."""
    if "points" not in case_data:
        return []
    from validation.contact.contact_bridges_figure import figure

    return [("Contact kernels inside the engines: cost per step by law, and its shares", figure(case_data["points"]))]
