"""Effects of scenes of recordings: faults of virtual transducers, clocks of files, stabilisers, virtual measurement
(see ``models.core.scene_effects``).
"""

from collections.abc import Mapping
from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import EffectEntry, Table


def _transducer_effect(
    fault_key: str, description: str, cost: str, usual_value: dict[str, Any], **work_counts: int
) -> EffectEntry:
    """Returns an effect of virtual transducers that is present where a key of [virtual.faults] has a value. Measured
    files cannot have it, as their faults are their own.
    """
    why = "for files have the faults that they have"

    def is_present(scene: Any) -> bool:
        fault = getattr(scene.virtual.faults, fault_key) if scene.virtual is not None else None
        return any(fault.values()) if isinstance(fault, Mapping) else fault is not None

    def put_in(scene_tables: Table, scene: Any) -> None:
        if "virtual" not in scene_tables:
            raise InputError(scene.file, f"virtual.faults.{fault_key}", None, f"needs a table [virtual], {why}")
        scene_tables["virtual"].setdefault("faults", {})[fault_key] = usual_value

    faulty = {name.replace("_", " "): count for name, count in work_counts.items()}
    needs = ("virtual_measurement",)
    return EffectEntry(
        description, f"virtual.faults.{fault_key}", cost, faulty, needs, why=why, is_present=is_present, put_in=put_in
    )


def _stabiliser_effect(
    stabiliser_method: str, description: str, cost: str, counted_item: str, needed_modules: tuple[str, ...] = ()
) -> EffectEntry:
    """Returns the effect of a stabiliser method. Without it roll and pitch are not stabilised, as the other method
    costs more.
    """

    def leave_out(scene_tables: Table, scene: Any) -> None:
        scene_tables.setdefault("stabilise", {})["method"] = "none"

    return EffectEntry(
        description,
        "stabilise.method",
        cost,
        {counted_item: 2},
        modules=needed_modules,
        usual_value=stabiliser_method,
        is_present=lambda scene: scene.stabilise.method == stabiliser_method,
        leave_out=leave_out,
    )


def _without_clock_errors(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: remove offset and drift of the files' clocks."""
    for file in scene_tables["files"]:
        file.pop("offset", None)
        file.pop("drift", None)


def _keep_road(scene_tables: Table, scene: Any) -> None:
    """Raise InputError, as the virtual measurement can be left out only if measured files replace it."""
    raise InputError(scene.file, "virtual", None, "can only give way to [[files]] that were measured: name them")


TABLE = {
    "dropouts": _transducer_effect(
        "dropouts",
        "Virtual transducers that fall silent for a while",
        "gaps to be bridged or left to the filter before the run, no more in it",
        {"rate": 0.1, "length": 0.01},
        faulty_channels=29,
        silent_channels=29,
    ),
    "kalman_filter": _stabiliser_effect(
        "kalman",
        "Roll and pitch held by a moment towards a Kalman filter's estimate",
        "a filter over all samples before the run, and a moment over time",
        "pulled angles",
        ("models.systems.hub_forces.tilt_filter", "models.systems.hub_forces.tilt_march"),
    ),
    "late_channels": _transducer_effect(
        "delay",
        "Channels of virtual transducers that are late",
        "a spline through each late channel before the run, no more in it",
        {"force": 2e-3},
        faulty_channels=12,
    ),
    "offsets": _transducer_effect(
        "bias",
        "Virtual transducers that do not read nought at nought",
        "a sum per sample and channel before the run, no more in it",
        {"force": 20.0},
        faulty_channels=12,
    ),
    "own_clocks": EffectEntry(
        "Clocks of files that are shifted or too fast",
        "files.0.offset",
        "signals are moved to one clock by interpolation",
        {"moved clocks": 1},
        is_present=lambda scene: any(file.offset or file.drift for file in scene.files),
        leave_out=_without_clock_errors,
    ),
    "prescribed_angles": _stabiliser_effect(
        "prescribed",
        "Roll and pitch enforced as measured, smoothed",
        "derivatives of the smoothed angles before the run, and in every call a mass matrix solved for two moments",
        "enforced angles",
    ),
    "quantisation": _transducer_effect(
        "quantisation",
        "Samples of virtual transducers rounded to the steps of a converter",
        "a rounding per sample and channel before the run, no more in it",
        {"bits": 12},
        faulty_channels=29,
    ),
    "sensor_noise": _transducer_effect(
        "noise",
        "White noise on every sample of virtual transducers",
        "a random number per sample and channel before the run, no more in it",
        {"force": 8.0, "moment": 1.0, "angle": 1.75e-3, "angular rate": 5e-3},
        faulty_channels=29,
    ),
    "virtual_measurement": EffectEntry(
        "A virtual measurement in place of files",
        "virtual",
        "a run of the whole vehicle on its tyres, written as a file and read again",
        {"runs on tyres": 1},
        leave_out=_keep_road,
    ),
    "wrong_gains": _transducer_effect(
        "gain",
        "Virtual transducers whose factor is wrong",
        "a product per sample and channel before the run, no more in it",
        {"force": 0.01},
        faulty_channels=12,
    ),
}
