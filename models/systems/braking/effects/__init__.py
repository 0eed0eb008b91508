"""Effects of braking scenes: controller, brakes, pressure dynamics, sensors, surfaces, tyres, trailer, suspension (see
``models.core.scene_effects``).

Counts are those of a stop: coordinates and wheels of the vehicle, memory of its brakes, chambers and tyres, and
controllers in the loop.
"""

from typing import Any

from models.core.scene_effects import EffectEntry, Table
from models.systems.handling.effects import without_trailer

AXLE_KEYS = ("front", "rear", "trailer")
NOISE_KEYS, CONVERTER_KEYS, SCALE_KEYS = ("noise",), ("bits", "range"), ("gain", "offset")
"""Keys of a sensor's white noise, of its analogue-digital converter, and of its wrong calibration."""


def _differs_from_default(scene_table: Any, key_names: tuple[str, ...]) -> bool:
    """Whether any of some keys of a scene's table differs from its default."""
    return any(getattr(scene_table, key) != type(scene_table).model_fields[key].default for key in key_names)


def _sensor_effect(
    signal_kind: str,
    key_names: tuple[str, ...],
    description: str,
    cost: str,
    counted_item: str,
    usual_value: dict[str, float],
) -> EffectEntry:
    """Returns an effect of sensors at the port, present where keys of [port.signals] or [port.pressures] differ from
    those of a perfect sensor.
    """

    def is_present(scene: Any) -> bool:
        return scene.port is not None and _differs_from_default(getattr(scene.port, signal_kind), key_names)

    def leave_out(scene_tables: Table, scene: Any) -> None:
        for key in (*key_names, *(("seed",) if key_names == NOISE_KEYS else ())):
            scene_tables["port"][signal_kind].pop(key, None)

    def put_in(scene_tables: Table, scene: Any) -> None:
        scene_tables.setdefault("port", {}).setdefault(signal_kind, {}).update(usual_value)

    counts = {"asked": 1, counted_item: 4}
    key_path = f"port.{signal_kind}.{key_names[0]}"
    return EffectEntry(
        description, key_path, cost, counts, ("port",), is_present=is_present, leave_out=leave_out, put_in=put_in
    )


def _brake_effect(
    key_names: tuple[str, ...],
    removed_keys: tuple[str, ...],
    description: str,
    key_path: str,
    cost: str,
    counted_item: str,
    usual_value: Any,
) -> EffectEntry:
    """Returns an effect of the brakes, present where keys of [brakes.AXLE] differ from their defaults. Leaving it out
    removes ``removed_keys``; putting it in updates the front and rear tables by ``usual_value(axle, brake)``.
    """

    def is_present(scene: Any) -> bool:
        return any(_differs_from_default(getattr(scene.brakes, axle), key_names) for axle in AXLE_KEYS)

    def leave_out(scene_tables: Table, scene: Any) -> None:
        for axle in {*AXLE_KEYS} & {*scene_tables["brakes"]}:
            for key in removed_keys:
                scene_tables["brakes"][axle].pop(key, None)

    def put_in(scene_tables: Table, scene: Any) -> None:
        for axle in AXLE_KEYS[:2]:
            plain = getattr(scene.brakes, axle).model_dump(exclude_none=True)
            brake = scene_tables.setdefault("brakes", {}).setdefault(axle, plain)
            brake.update(usual_value(axle, brake))

    return EffectEntry(
        description, key_path, cost, {counted_item: 4}, is_present=is_present, leave_out=leave_out, put_in=put_in
    )


def _without_reservoir(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: remove the reservoir and its volume, so that the supply pressure is constant."""
    for key in ("reservoir", "volume"):
        scene_tables["pressure"].pop(key, None)


def _without_slow_apply(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: remove slow filling, so that valves apply, hold and release. The controller loses its parameter
    ``slow`` and applies in steps.
    """
    del scene_tables["pressure"]["slow"]
    scene_tables.get("controller", {}).get("parameters", {}).pop("slow", None)


def _with_slow_apply(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: let valves fill slowly, too, with eight times the time constant."""
    fill = 0.15 if scene.pressure is None else scene.pressure.fill
    scene_tables.setdefault("pressure", {})["slow"] = 8.0 * fill


def _with_delay(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: set the delay of the valves to two samples."""
    scene_tables.setdefault("pressure", {})["delay"] = 2.0 * scene.run.sample


def _has_two_surfaces(scene: Any) -> bool:
    stretches = scene.road.stretches
    return any(
        len({s.left for s in stretches} | {procedure.right or s.right or s.left for s in stretches}) > 1
        for procedure in scene.procedures.values()
    )


def _on_one_surface(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: replace the road by a single surface, the one left of the line at the start."""
    first = scene.road.stretches[0].left
    scene_tables["road"] = {"stretches": [{"left": first}]}
    for procedure in scene_tables["procedures"].values():
        if "right" in procedure:
            procedure["right"] = first


def _add_surface(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: append a stretch of road 10 m after the beginning of the last stretch; ice after dry, else dry."""
    last_stretch = scene.road.stretches[-1]
    stretches = scene_tables.setdefault("road", {}).setdefault("stretches", [{"left": "ice"}])
    stretches.append({"x": last_stretch.x + 10.0, "left": "ice" if last_stretch.left == "dry" else "dry"})


def _without_suspension(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: replace the suspended vehicle by a plane vehicle with the same masses, axles and wheels."""
    from models.systems.braking.of_scene import vehicle_of

    scene_tables["vehicle"] = {"override": vehicle_of(scene).model_dump()}


def _with_trailer(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: add the unladen trailer CHOSEN_TRAILER."""
    from models.brake.trailer import CHOSEN_TRAILER

    scene_tables["trailer"] = CHOSEN_TRAILER.model_dump(exclude_unset=True)


def _tows_bodies(scene: Any) -> bool:
    """Whether the vehicle of vehicle.file tows bodies."""
    from models.systems.braking.of_scene import spatial_vehicle_of

    spatial_vehicle = spatial_vehicle_of(scene)
    return spatial_vehicle is not None and bool(spatial_vehicle.towed)


MEASURED_PRESSURES_KEY, SUSPENSION_KEY = ("measured_pressures",), ("suspension",)
TABLE = {
    "anti_lock": EffectEntry(
        "A controller that opens and closes the valves of every wheel",
        "controller",
        "one answer of the controller per sample",
        {"controllers": 1},
        excludes=MEASURED_PRESSURES_KEY,
        why="which leaves a controller nothing to control",
        usual_value={"kind": "slip_bang_bang"},
        is_present=lambda scene: scene.controller.kind != "none",
    ),
    "faults": EffectEntry(
        "Lost, delayed or wrong samples, and valves that are stuck, on demand",
        "port.faults",
        "one look at each fault per sample",
        {"asked": 1},
        ("port",),
        usual_value=[{"kind": "lost", "start": 0.1, "end": 0.2}],
        is_present=lambda scene: scene.port is not None and bool(scene.port.faults),
    ),
    "hysteresis": _brake_effect(
        ("release", "falling"),
        ("release", "falling"),
        "Brakes whose torque falls along another line than it rises",
        "brakes.front.release",
        "nothing: the same law of torque by pressure, its two lines apart",
        "loops",
        lambda axle, brake: {"falling": 1.1 * brake["gradient"]},  # chosen
    ),
    "load_transfer": EffectEntry(
        "Loads that move between the wheels with the accelerations of the body, semi-static",
        "load_transfer",
        "two products per wheel and step",
        {"moving loads": 4},
        excludes=SUSPENSION_KEY,
        why="whose springs carry the loads",
        usual_value={},
    ),
    "measured_pressures": EffectEntry(
        "Pressures from a file in place of pedal and controller",
        "measured",
        "a row of a table per sample",
        {"files": 1},
    ),
    "port": EffectEntry(
        "A port between vehicle and controller, each exchange checked, behind which anything may stand",
        "port",
        "one exchange per sample, and what stands behind it",
        {"asked": 1},
        excludes=MEASURED_PRESSURES_KEY,
        why="which leaves no controller that could be asked",
        usual_value={},
    ),
    "pressure_calibration": _sensor_effect(
        "pressures",
        SCALE_KEYS,
        "Pressures that come out too large or shifted",
        "a product and a sum per brake and sample",
        "wrong signals",
        {"gain": 1.01},
    ),
    "pressure_dynamics": EffectEntry(
        "Chambers that fill and empty with time constants behind their valves",
        "pressure",
        "two exponentials per wheel and sample",
        {"time constants": 8},
        excludes=MEASURED_PRESSURES_KEY,
        why="which are the chambers'",
        usual_value={},
    ),
    "pressure_noise": _sensor_effect(
        "pressures",
        NOISE_KEYS,
        "White noise on the pressures that a controller asks for",
        "a random number per brake and sample",
        "noisy signals",
        {"noise": 0.02},
    ),
    "pressure_quantisation": _sensor_effect(
        "pressures",
        CONVERTER_KEYS,
        "Pressures that a controller asks for, in the steps of a converter",
        "a rounding per brake and sample",
        "converted signals",
        {"bits": 12, "range": 16.0},
    ),
    "push_out": _brake_effect(
        ("push_out",),
        ("push_out", "release"),
        "Pressure that the brakes need before any torque comes",
        "brakes.front.push_out",
        "nothing: the same law of torque by pressure",
        "push-outs",
        lambda axle, brake: {"push_out": 0.75 if axle == "front" else 0.25},  # of the paper's brakes
    ),
    "rear_tyres": EffectEntry(
        "Rear tyres with figures of their own",
        "tyres.own_rear",
        "a second table of friction per surface",
        {"tables": 1},
        usual_value=True,
    ),
    "relaxation": EffectEntry(
        "Slip angles that lag behind the motion by a relaxation length",
        "relaxation",
        "a state per wheel, exact within a step",
        {"lags": 4},
        modules=("models.brake.relaxation",),
        usual_value={"front": 0.3, "rear": 0.3},  # m, chosen
    ),
    "reservoir": EffectEntry(
        "A reservoir whose pressure falls as chambers fill from it",
        "pressure.reservoir",
        "a sum over the chambers per sample",
        {"volumes": 4},
        ("pressure_dynamics",),
        usual_value=40.0,  # l, of a truck
        leave_out=_without_reservoir,
    ),
    "second_surface": EffectEntry(
        "A road of more than one surface, along it or across",
        "road.stretches",
        "the surface under each wheel is looked up at every step",
        {"surfaces": 1, "tables": 1},
        is_present=_has_two_surfaces,
        leave_out=_on_one_surface,
        put_in=_add_surface,
    ),
    "signal_calibration": _sensor_effect(
        "signals",
        SCALE_KEYS,
        "Wheel speeds that are read too large or shifted",
        "a product and a sum per wheel and sample",
        "wrong signals",
        {"gain": 1.01},
    ),
    "signal_noise": _sensor_effect(
        "signals",
        NOISE_KEYS,
        "White noise on the wheel speeds that the controller is given",
        "a random number per wheel and sample",
        "noisy signals",
        {"noise": 0.05},
    ),
    "signal_quantisation": _sensor_effect(
        "signals",
        CONVERTER_KEYS,
        "Wheel speeds in the steps of a converter",
        "a rounding per wheel and sample",
        "converted signals",
        {"bits": 12, "range": 40.0},
    ),
    "slow_apply": EffectEntry(
        "Valves with a fourth state beside apply, hold and release: they apply slowly",
        "pressure.slow",
        "one comparison per wheel and step",
        {"slow fillings": 4},
        ("pressure_dynamics",),
        leave_out=_without_slow_apply,
        put_in=_with_slow_apply,
    ),
    "suspension": EffectEntry(
        "A vehicle with suspension from a vehicle file, whose body rolls and pitches under braking",
        "vehicle.file",
        "every freedom of its file, and a step of an engine around the compiled tyres",
        modules=("models.brake.sprung", "models.engines.braking_sprung"),
        leave_out=_without_suspension,
    ),
    "teeth": EffectEntry(
        "Wheel speeds that are counted from the teeth of a wheel by a timer",
        "port.teeth",
        "the edges of every wheel within each sample",
        {"asked": 1},
        ("port",),
        usual_value={},
    ),
    "towed": EffectEntry(
        "Bodies that the vehicle of a file tows by a hitch, on springs and wheels of their own",
        "vehicle.file",
        "the coordinates of its hitch and wheels, and a tyre, a brake and a chamber per wheel",
        needs=SUSPENSION_KEY,
        is_present=_tows_bodies,
        leave_out=without_trailer,
    ),
    "trailer": EffectEntry(
        "A drawbar trailer of two axles behind the truck",
        "trailer",
        "two coordinates and four wheels more",
        {"coordinates": 2, "wheels": 4},
        excludes=SUSPENSION_KEY,
        why="whose file says what it tows",
        put_in=_with_trailer,
    ),
    "valve_delay": EffectEntry(
        "Valves that answer a while after their command",
        "pressure.delay",
        "commands that are kept for as many samples",
        {"kept commands": 8},
        ("pressure_dynamics",),
        put_in=_with_delay,
    ),
}
