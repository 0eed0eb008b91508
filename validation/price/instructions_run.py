"""A process that only integrates in time, so that valgrind counts instructions of time steps and not of compilation.

The linear pitch-plane vehicle with all forces from one Python function, in both engines, method after method. Once
everything is loaded, two copies of the process march, one after the other: to load it all twice would take most of the
time. Between two marches a copy asks for its own group, which is what valgrind is told to begin a new count at.
"""

import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

STEP = 1e-3
MARKING_SYSTEM_CALL = "getpgid"
"""System call that separates valgrind's counts: a function of the C library that no engine calls."""


def linear_force_function(
    damping: list[list[float]], stiffness: list[list[float]]
) -> Callable[[Any, Any], list[float]]:
    """Python function of lists q and q' that returns the forces -K q - D q', for damping D and stiffness K (4, 4)."""
    rows = [(*k, *d) for k, d in zip(stiffness, damping, strict=True)]

    def law(q: Any, v: Any) -> list[float]:
        a, b, c, d = q
        e, f, g, h = v
        return [-(r[0] * a + r[1] * b + r[2] * c + r[3] * d + r[4] * e + r[5] * f + r[6] * g + r[7] * h) for r in rows]

    return law


def exudyn_marches(
    masses: list[float], force_function: Callable[[Any, Any], list[float]], method_names: list[str]
) -> list[Any]:
    """For each integration method of Exudyn, a function that integrates a number of steps."""
    import exudyn as exu
    import exudyn.itemInterface as items
    import numpy as np

    exu.config.printToConsole = False
    container = exu.SystemContainer()
    mbs: Any = container.AddSystem()
    node = mbs.AddNode(
        items.NodeGenericODE2(
            numberOfODE2Coordinates=4,
            referenceCoordinates=[0.0] * 4,
            initialCoordinates=[1e-3] * 4,
            initialCoordinates_t=[0.0] * 4,
        )
    )
    user: Any = lambda mbs, t, item, q, v: force_function(q, v)  # noqa: E731
    mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.diag(masses), forceUserFunction=user))
    mbs.Assemble()
    options = exu.SimulationSettings()
    options.solution.file.write = options.solution.sensors.active = False
    ti = options.timeIntegration
    ti.adaptiveStep = ti.automaticStepSize = ti.explicit.computeEndOfStepAccelerations = False
    ti.verboseMode = 0

    def march(method_name: str, step_count: int) -> None:
        ti.numberOfSteps, ti.endTime = step_count, step_count * STEP
        mbs.SolveDynamic(options, solverType=getattr(exu.DynamicSolverType, method_name))

    return [lambda steps, method=method: march(method, steps) for method in method_names]


def mujoco_marches(
    masses: list[float], force_function: Callable[[Any, Any], list[float]], method_names: list[str]
) -> list[Any]:
    """For each integration method of MuJoCo, a function that integrates a number of steps in MuJoCo's own loop."""
    import mujoco

    bodies = "".join(
        f'<body><joint type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/></body>'
        for mass in masses
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP}" gravity="0 0 0"><flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{bodies}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)

    def passive(mujoco_model: Any, mujoco_data: Any) -> None:
        mujoco_data.qfrc_passive[:] = force_function(mujoco_data.qpos.tolist(), mujoco_data.qvel.tolist())

    def march(method_name: str, step_count: int) -> None:
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{method_name.upper()}")
        data.qpos[:], data.qvel[:], data.time = 1e-3, 0.0, 0.0  # mj_resetData prints how long the last run took
        mujoco.mj_step(model, data, step_count)

    mujoco.set_mjcb_passive(passive)
    return [lambda steps, method=method: march(method, steps) for method in method_names]


def main(job_settings: dict[str, Any]) -> None:
    """Run the time integration of every method once to warm up, then count its instructions in two copies of the
    process."""
    law = linear_force_function(job_settings["damping"], job_settings["stiffness"])
    marches = [
        march
        for engine, make in (("exudyn", exudyn_marches), ("mujoco", mujoco_marches))
        for march in make(job_settings["masses"], law, job_settings["methods"][engine])
    ]
    gc.disable()
    for march in marches:
        march(job_settings["steps"][0])
    start_counting()
    for _ in range(2):
        run_in_forked_copy(marches, job_settings["steps"])


def start_counting() -> None:
    """Make valgrind count instructions from here on; earlier code is not counted and runs several times as fast."""
    asking = subprocess.Popen(
        ["vgdb", f"--pid={os.getpid()}", "instrumentation", "on"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while asking.poll() is None:  # valgrind hears of it only between instructions of a program that runs
        pass
    if asking.returncode != 0:
        raise SystemExit("valgrind could not be told to begin")


def run_in_forked_copy(marches: list[Callable[[int], None]], step_counts: list[int]) -> None:
    """Run ``run_marked_marches`` in a forked copy of the process, so that nothing changes in this process."""
    copy = os.fork()
    if copy == 0:
        run_marked_marches(marches, step_counts)
    if os.waitpid(copy, 0)[1] != 0:
        raise SystemExit("a copy failed")


def run_marked_marches(marches: list[Callable[[int], None]], step_counts: list[int]) -> None:
    """Run every time integration for each number of steps, with the system call MARKING_SYSTEM_CALL before each and at
    the end; then exit the process."""
    for march in marches:
        for steps in step_counts:
            os.getpgid(0)
            march(steps)
    os.getpgid(0)
    os._exit(0)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
