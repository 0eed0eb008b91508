"""What a contact kernel costs inside an engine: the kernel itself, the bridge to it, and the engine around both."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from models.compiled import njit
from models.contact.fastsim import fastsim
from models.contact.hertz import by_approach
from models.contact.inputs import Array
from models.contact.patches import separate
from models.contact.simplified_theory import Options, press, roll
from models.contact.stack import start
from models.contact.undeformed_distance import Distance
from models.engines.contact_bridge import FREEDOMS, SUNK, YAW, Wheels, X, Y, Z, add_forces, forces
from models.engines.contact_bridge_exudyn import ROUTES, Forces, Rolling
from models.engines.contact_bridge_mujoco import Marcher, empty_law, model, native_law, python_law
from models.engines.mujoco_callback import installed
from validation.rows import Row, System, Table, at_most, behaves
from validation.timing import interleave

TITLE = "What a contact kernel costs inside an engine"
SYSTEM: System = "rolling-vehicle"
STEP = 2e-5
STEPS = {"none": 1000, "empty": 600, "native": 160, "jitted": 160, "plain": 6, "non-Hertzian": 2}
"""Steps of a run with one call each: runs of a few milliseconds, which now and then nothing else disturbs."""
CELLS = (0, 7, 11, 21, 41)
COUNTS = (1, 4, 8)
EVALUATIONS = {"Euler": 1, "RK4": 4, "ExplicitEuler": 1, "RK44": 4}
"""Calls of the callback per step."""
ENGINES = {"mujoco": ("Euler", "RK4"), "exudyn": ("ExplicitEuler", "RK44")}
ROUNDS = 60
LEAST = 0.001
WHY = "least of interleaved rounds, as whatever else a machine does only adds to a time; start of a run taken out"
THEORY = Options(net=9)


@dataclass(frozen=True)
class Setup:
    """One way of marching. bridge : none, empty, native, jitted, plain, or a route of Exudyn's; law : cells of FASTSIM,
    0 the linear theory, -1 the non-Hertzian one, None where nothing is computed.
    """

    engine: str
    method: str
    bridge: str
    law: int | None
    count: int

    def what(self) -> str:
        """The law by its name."""
        return {None: "no contact" if self.bridge == "none" else "empty callback", 0: "linear theory",
                -1: "non-Hertzian"}.get(self.law, f"FASTSIM, {self.law} cells")  # fmt: skip


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Whether threads and engines agree; in the full run also the price of every law, bridge and count of wheels.

    Prices are only judged in the full run: the least of a few rounds is not the least.
    """
    rows = [_threads_row(), _agreement_row()]
    if quick:
        return rows, {}
    setups = every()
    took, kernels = prices(setups, ROUNDS)
    found = [_split(one, took, kernels) for one in setups]
    return rows + _price_rows(found), {"points": found}


def every() -> list[Setup]:
    """All of them."""
    found = []
    for engine, methods in ENGINES.items():
        best, *others = ("native", "jitted", "plain") if engine == "mujoco" else (*ROUTES, "plain")
        for method, count in [(methods[0], count) for count in COUNTS] + [(methods[1], 4)]:
            found += [Setup(engine, method, "none", None, count), Setup(engine, method, "empty", None, count)]
            found += [Setup(engine, method, best, cells, count) for cells in CELLS]
        found += [Setup(engine, method, other, 21, 4) for method in methods for other in others]
        found.append(Setup(engine, methods[0], "plain", -1, 4))
    return found


Kernel = tuple[int, int]
"""Law and count of wheels."""


def prices(setups: Sequence[Setup], rounds: int) -> tuple[dict[Setup, float], dict[Kernel, float]]:
    """Seconds per step of each, and seconds of one evaluation of the forces on all wheels in a compiled loop."""
    kernels = sorted({(one.law, one.count) for one in setups if one.law is not None})
    runs, loops = [_job(one) for one in setups], [_kernel_job(*one) for one in kernels]
    jobs = [part for march, steps in runs for part in (partial(march, steps), partial(march, 1))]
    least = interleave([*jobs, *(job for job, _ in loops)], rounds, LEAST).min(axis=1)
    whole, first, alone = least[: len(jobs) : 2], least[1 : len(jobs) : 2], least[len(jobs) :]
    per_step = [float(a - b) / (steps - 1) for a, b, (_, steps) in zip(whole, first, runs, strict=True)]
    per_call = [float(seconds) / calls for seconds, (_, calls) in zip(alone, loops, strict=True)]
    return dict(zip(setups, per_step, strict=True)), dict(zip(kernels, per_call, strict=True))


def _kernel_job(law: int, count: int) -> tuple[Callable[[], Any], int]:
    wheels = Wheels(count, max(law, 0))
    q, v = wheels.state()
    f, numbers = np.zeros(wheels.size), wheels.numbers
    if law < 0:
        other = non_hertzian(wheels)
        return lambda: other(numbers, q, v, f), 1
    return lambda: _repeat(numbers, q, v, f, 200), 200


@njit(cache=True, error_model="numpy")
def _repeat(numbers, q, v, f, times):
    for _ in range(times):
        forces(start(numbers), start(q), start(v), start(f))


def _job(one: Setup) -> tuple[Callable[[int], Any], int]:
    """Function that marches some steps, and how many are to be timed."""
    wheels = Wheels(one.count, None if one.law is None else max(one.law, 0))
    kind = "non-Hertzian" if one.law == -1 else one.bridge if one.bridge in STEPS else "native"
    law = None
    if one.bridge == "plain":
        law = non_hertzian(wheels) if one.law == -1 else plain(wheels)
    march = (_mujoco_job if one.engine == "mujoco" else _exudyn_job)(one, wheels, law)
    return march, max(2, STEPS[kind] // EVALUATIONS[one.method])


def _mujoco_job(one: Setup, wheels: Wheels, law: Any) -> Callable[[int], Any]:
    start, march = np.concatenate(wheels.state())[None], Marcher(model(wheels, STEP, one.method))
    callback = {"none": lambda: None, "empty": lambda: empty_law().ctypes, "native": lambda: native_law().ctypes,
                "jitted": lambda: python_law(add_forces), "plain": lambda: python_law(law)}[one.bridge]()  # fmt: skip

    def job(steps: int) -> None:
        mujoco.set_mjcb_passive(callback)
        try:
            march.run(start, steps)
        finally:
            mujoco.set_mjcb_passive(None)

    return job


def _exudyn_job(one: Setup, wheels: Wheels, law: Any) -> Callable[[int], Any]:
    zeros, of = [0.0] * wheels.size, None
    if one.bridge == "empty":
        of = lambda q, v: zeros  # noqa: E731
    elif one.bridge != "none":
        of = Forces(wheels, law).of
    rolling, state = Rolling(wheels, of, one.bridge if one.bridge in ROUTES else ROUTES[0]), wheels.state()
    return lambda steps: rolling.run(*state, steps, STEP, one.method)


def plain(wheels: Wheels) -> Callable[[Array, Array, Array, Array], None]:
    """The same law by the functions that a user calls from Python."""

    def add(numbers: Array, q: Array, v: Array, f: Array) -> None:
        for k in range(0, wheels.size, FREEDOMS):
            hertz = by_approach(*wheels.curvatures, numbers[SUNK] + q[k + Z], wheels.pair)
            creep = fastsim(hertz.a, hertz.b, hertz.load, wheels.mu, *_motion(wheels, q, v, k), wheels.pair,
                            cells=wheels.cells or 21)  # fmt: skip
            f[k : k + FREEDOMS] += creep.fx, creep.fy, wheels.load - hertz.load, creep.mz

    return add


def non_hertzian(wheels: Wheels) -> Callable[[Array, Array, Array, Array], None]:
    """The theory of 1983 on the same bodies, given by their distance; 21 cells on a net of 9."""
    x = np.linspace(-0.03, 0.03, 61)
    bodies = separate(Distance(x, x, wheels.curvatures[0] * x**2 + wheels.curvatures[1] * x[:, None] ** 2))

    def add(numbers: Array, q: Array, v: Array, f: Array) -> None:
        for k in range(0, wheels.size, FREEDOMS):
            pressed = press(bodies, wheels.pair, approach=numbers[SUNK] + q[k + Z], options=THEORY)
            creep = roll(pressed, wheels.mu, *_motion(wheels, q, v, k), cells=21)
            f[k : k + FREEDOMS] += creep.fx, creep.fy, wheels.load - pressed.load, creep.mz

    return add


def _motion(wheels: Wheels, q: Array, v: Array, k: int) -> tuple[float, float, float]:
    """Creepages and spin (1/m) of the wheel whose coordinates begin at k."""
    return v[k + X] / wheels.speed, v[k + Y] / wheels.speed - q[k + YAW], v[k + YAW] / wheels.speed


def _split(one: Setup, took: dict[Setup, float], kernels: dict[Kernel, float]) -> dict[str, Any]:
    """Seconds per step and what they are made of: engine, kernel, bridge."""
    engine = took[replace(one, bridge="none", law=None)]
    calls = 1 if one.bridge == "before each step" else EVALUATIONS[one.method]
    kernel = calls * kernels[one.law, one.count] if one.law is not None else 0.0
    return {"engine": one.engine, "method": one.method, "bridge": one.bridge, "law": one.what(), "wheels": one.count,
            "cells": one.law, "step": took[one], "own": engine, "kernel": kernel,
            "over": took[one] - engine - kernel}  # fmt: skip


def _price_rows(found: list[dict[str, Any]]) -> list[Row]:
    rows = []
    for p in found:
        if (p["cells"], p["wheels"]) != (21, 4) or p["bridge"] not in ("native", ROUTES[0]):
            continue
        name, calls = f"contact_bridges.{p['engine']}.{p['method']}", EVALUATIONS[p["method"]]
        if p["engine"] == "mujoco":
            what = (f"MuJoCo, {p['method']}: step with FASTSIM at four wheels (21 x 21, native, {1e6 * p['step']:.1f} "
                    f"us) by the step without contact and {4 * calls} kernel times")  # fmt: skip
            rows.append(at_most(name, SYSTEM, what, p["step"] / (p["own"] + p["kernel"]), "", 1.3, WHY, "none"))
        else:
            what = (f"Exudyn, {p['method']}: share of the bridge in a step with FASTSIM at four wheels (21 x 21, "
                    f"{1e6 * p['step']:.1f} us)")  # fmt: skip
            rows.append(at_most(name, SYSTEM, what, max(p["over"] / p["step"], 0.0), "", 0.25, WHY, "none"))
    return rows


def _threads_row() -> Row:
    """Two threads beside one, from ten starts."""
    wheels = Wheels()
    states, built = np.array([np.concatenate(wheels.state(seed)) for seed in range(10)]), model(wheels, 1e-4, "RK4")
    with installed(native_law()):
        one, two = (Marcher(built, threads).run(states, 100) for threads in (1, 2))
    same = "identical" if np.isfinite(one).all() and one.tobytes() == two.tobytes() else "different"
    return behaves("contact_bridges.threads", SYSTEM, "MuJoCo, ten runs of 100 steps with FASTSIM in two threads "
                   "beside one", same, "identical", "the kernel holds nothing between calls")  # fmt: skip


def _agreement_row() -> Row:
    """Both engines by Runge-Kutta's method over 0.1 s."""
    wheels, steps = Wheels(), 1000
    q, v = wheels.state()
    with installed(native_law()):
        path = Marcher(model(wheels, 1e-4, "RK4")).run(np.concatenate((q, v))[None], steps)[0]
    other = Rolling(wheels, Forces(wheels).of).run(q, v, steps, 1e-4, "RK44")
    size = wheels.size
    scale = np.repeat([np.abs(path[:, :size]).max(), np.abs(path[:, size:]).max()], size)
    return at_most("contact_bridges.agreement", SYSTEM, "state after 0.1 s with FASTSIM in MuJoCo beside Exudyn, by "
                   "the largest displacement or rate", float((np.abs(path[-1] - other) / scale).max()), "", 1e-10,
                   "the same kernel and method; what differs is rounding", "shared kernel")  # fmt: skip


def tables(data: dict[str, Any]) -> list[Table]:
    """Every cost per step."""
    if not data:
        return []
    note = (f"Microseconds per step, {WHY}. Kernel: the forces of all wheels in a compiled loop, times the calls per "
            "step. Bridge: what the step takes beyond the engine's own and the kernel.")  # fmt: skip
    heads = ("engine", "method", "wheels", "bridge", "law", "step", "engine's own", "kernel", "bridge's", "share")
    rows = tuple((p["engine"], p["method"], str(p["wheels"]), p["bridge"], p["law"],
                  *(f"{1e6 * p[part]:.2f}" for part in ("step", "own", "kernel", "over")),
                  f"{p['over'] / p['step']:.0%}") for p in data["points"])  # fmt: skip
    return [Table("Cost per step of a contact kernel inside an engine", note, heads, rows)]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Cost per step over the law, and shares of engine, kernel and bridge."""
    if not data:
        return []
    from validation.contact_bridges_figure import figure

    return [("Contact kernels inside the engines", figure(data["points"]))]
