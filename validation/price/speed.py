"""Computing times: what a compiled callback costs in MuJoCo, and how fast the reference implementation runs."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from models.engines.assembly import Assembly, Settings
from models.engines.protocol import build
from models.machine.timing import bootstrap_median, interleave, paired_ratio, timing_statistics
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from validation.price.compiled_forces import CompiledForces

STEP = 1e-3


def callback_cost(
    road_assembly: Assembly, duration: float, integrator_name: str, round_count: int, minimum_seconds: float
) -> dict[str, Any]:
    """Ratios of computing time between variants of a MuJoCo model: bare; with native springs and dampers; on a road;
    with all forces in one callback.

    road_assembly : a vehicle on a road, whose input enters through a compiled callback.
    Values are (ratio, low, high) with a bootstrap 95 % interval, and medians in s. ``gap`` is the largest
    difference of states between the native route and the one with every force in the callback.
    """
    flat = assembly_of_scene(build_scene({"title": "no input", "run": {"duration": duration, "step": STEP}}))
    bare = replace(flat, vehicle=replace(flat.vehicle, struts=()))
    settings = Settings(integrator_name, STEP, duration)
    models = [build("mujoco", assembly, settings) for assembly in (bare, flat, road_assembly)]
    compiled = CompiledForces(road_assembly, settings)
    runs: list[Callable[[], Any]] = [model.run for model in models]
    seconds = interleave([*runs, compiled.run_with_installed_callback, compiled.run], round_count, minimum_seconds)
    names = ("without forces", "springs and dampers", "with callback", "bare", "all in the callback")
    return {
        "gap": float(np.abs(compiled.run() - models[2].run().states).max()),
        "all compiled to no forces": paired_ratio(seconds[4], seconds[3]),
        "callbacks": [model.plan()["callbacks"] for model in models],
        "seconds": {
            name: timing_statistics(seconds_of_variant) for name, seconds_of_variant in zip(names, seconds, strict=True)
        },
        "to no forces": paired_ratio(seconds[2], seconds[0]),
        "to no callback": paired_ratio(seconds[2], seconds[1]),
    }


def real_time_factors(
    road_assembly: Assembly, duration: float, round_count: int, minimum_seconds: float
) -> dict[str, Any]:
    """Ratio of simulated time to computing time of the reference with steps of 1 ms, with and without the computation
    of its road table.

    The road is timed by itself beside the run and subtracted within each round.
    """
    signal, steps = road_assembly.input, round(duration / STEP)
    assert signal is not None
    model = build("reference", road_assembly, Settings("RK4", STEP, duration))
    run, table = interleave(
        [model.run, lambda: signal.sample(0.0, STEP / 2, 2 * steps + 1)], round_count, minimum_seconds
    )
    known = (run > table).all()  # else the machine's other work is larger than what is told
    return {
        "with table": bootstrap_median(duration / run),
        "without table": bootstrap_median(duration / (run - table)) if known else None,
        "seconds": timing_statistics(run),
    }
