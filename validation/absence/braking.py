"""Braking scene without effects, for the absence checks: its tables, counts of its model's components, its path.

Two absent effects still run code: a brake without hysteresis runs the same torque law with coinciding lines for rising
and falling pressure, and a brake chamber without dynamics runs the same law with time constants of zero.
"""

from pathlib import Path
from typing import Any
from unittest import mock

from models.systems.braking.scene import BrakingScene

ENGINES = ("reference", "exudyn", "mujoco")
STOP = "stop"
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "braking",
    "road": {"stretches": [{"left": "snow"}]},
    "procedures": {STOP: {"kind": "j_turn", "speed": 3.0, "steer": 0.02}},
}
HAND_WRITTEN_TABLES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "measured_pressures": ({}, {"measured": {"file": "pressures.csv"}})
}


def write(scene_folder: Path) -> None:
    """Write a file of brake pressures that rise at all wheels and stay below the supply of 6 bar."""
    rows = (f"{time},{','.join([str(5.0 * time)] * 4)}" for time in (0.0, 0.5, 1.0))
    names = ",".join(f"pressure_{wheel} [bar]" for wheel in ("fl", "fr", "rl", "rr"))
    (scene_folder / "pressures.csv").write_text("\n".join([f"time [s],{names}", *rows, ""]))


def counts_and_path(scene: BrakingScene, engine: str = "reference") -> tuple[dict[str, int], bytes]:
    """Counts of the components (lags, controllers, noisy signals, ...) in the model of a braking scene, and the states
    of a run as bytes."""
    from models.systems.braking.march import BrakedVehicle
    from models.systems.braking.run import run

    counts, march = dict[str, int](), BrakedVehicle.run

    def watched(vehicle: BrakedVehicle, controller: Any, *march_arguments: Any) -> Any:
        counts.update(_counts_of_run(vehicle, controller))
        return march(vehicle, controller, *march_arguments)

    with mock.patch.object(BrakedVehicle, "run", watched):
        path = run(scene, engine, procedure=STOP).detail
    return counts, path.states.tobytes()


def _counts_of_run(vehicle: Any, controller: Any) -> dict[str, int]:
    """Counts of the components in the model of a braked vehicle and its controller, by kind."""
    from models.brake.controllers import CONTROLLERS
    from models.brake.pressure import air_at_rest
    from models.systems.braking.measured_pressures import MeasuredPressures

    plane, brakes, chambers = vehicle.plane, vehicle.brakes, vehicle.chambers
    chain = [controller]
    while hasattr(chain[-1], "controller"):
        chain.append(chain[-1].controller)
    innermost, seeing = (
        chain[-1],
        [controller_part for controller_part in chain if hasattr(controller_part, "tooth_counter")],
    )
    conversions = [
        channels.conversion
        for controller_part in seeing
        for channels in (controller_part.wheels, controller_part.pressures)
    ]
    return {
        "coordinates": len(vehicle.coordinates),
        "wheels": plane.wheels,
        "lags": 0 if vehicle.relaxation is None else vehicle.relaxation.size,
        "moving loads": int(((plane.load_per_x_acceleration != 0.0) | (plane.load_per_y_acceleration != 0.0)).sum()),
        "time constants": int((chambers.fill_time > 0.0).sum() + (chambers.empty_time > 0.0).sum()),
        "kept commands": (len(air_at_rest(chambers, vehicle.sample).commands) - 2) * plane.wheels,
        "slow fillings": chambers.slow.size,
        "volumes": chambers.volumes.size,
        "push-outs": int((brakes.push_out > 0.0).sum()),
        "loops": int(((brakes.release != brakes.push_out) | (brakes.falling != brakes.rising)).sum()),
        "asked": len(chain) - 1,
        "files": int(isinstance(innermost, MeasuredPressures)),
        "controllers": int(not isinstance(innermost, (CONTROLLERS["none"], MeasuredPressures))),
        "surfaces": int(max(vehicle.road.left.max(), vehicle.road.right.max())) + 1,
        "tables": len(vehicle.tables.mu_x),
        "noisy signals": plane.wheels * sum(read.noise > 0.0 for read in conversions),
        "converted signals": plane.wheels * sum(read.bits is not None for read in conversions),
        "wrong signals": plane.wheels * sum((read.gain, read.offset) != (1.0, 0.0) for read in conversions),
    }
