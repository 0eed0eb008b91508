"""Effects of hub forces scenes: noise, interpolation, frame, stabilisers, virtual measurement (see
``models.core.scene_effects``).
"""

from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import EffectEntry, Table


def _selected_effect(
    description: str,
    key_path: str,
    cost: str,
    work_counts: dict[str, int],
    usual_value: str,
    value_without: str | None,
    **entry_fields: Any,
) -> EffectEntry:
    """Returns an effect that is selected by the value of a scene key: ``usual_value`` with the effect,
    ``value_without`` without it; None removes the key.

    An effect that needs the virtual measurement is absent where the scene has files. Without an effect of noise its
    stated deviations stay, so that the filter uses the same values.
    """
    name, key = key_path.split(".")

    def is_present(scene: Any) -> bool:
        word = getattr(getattr(scene, name), key)
        named = word == usual_value if key != "frame" else word != value_without
        return named and not (entry_fields.get("needs") and scene.road is None)

    def leave_out(scene_tables: Table, scene: Any) -> None:
        if value_without is None:
            del scene_tables[name][key]
        else:
            scene_tables.setdefault(name, {})[key] = value_without

    def put_in(scene_tables: Table, scene: Any) -> None:
        scene_tables.setdefault(name, {})[key] = usual_value

    return EffectEntry(
        description,
        key_path,
        cost,
        work_counts,
        is_present=is_present,
        leave_out=leave_out,
        put_in=put_in,
        **entry_fields,
    )


def _keep_road(scene_tables: Table, scene: Any) -> None:
    """Raise InputError: the road can be left out only if files replace it."""
    raise InputError(scene.file, "road", None, "can only give way to forces.file and angles.file: name them")


NOISE_NEEDS: dict[str, Any] = {"needs": ("virtual_measurement",), "why": "for files have the noise that they have"}
INTERPOLATION_EXCLUSION = "as forces.interpolation is one word"
HOLDING_EXCLUSION = "as one moment holds roll and pitch"
FILTER_MODULES = tuple(f"models.systems.hub_forces.{name}" for name in ("tilt_filter", "tilt_march"))
TABLE = {
    "angle_noise": _selected_effect(
        "White noise on every sample of roll, pitch and their rates",
        "angles.noise",
        "four random numbers per sample before the run; only a stabiliser reads them",
        {"noisy angles": 4},
        "white",
        "none",
        **NOISE_NEEDS,
    ),
    "force_noise": _selected_effect(
        "White noise on every sample of the hub forces",
        "forces.noise",
        "a random number per component and sample before the run, no more in it",
        {"noisy forces": 24},
        "white",
        "none",
        **NOISE_NEEDS,
    ),
    "held_forces": _selected_effect(
        "Forces that stay what they are from one sample to the next",
        "forces.interpolation",
        "a march of its own from sample to sample",
        {"held forces": 24},
        "held",
        None,
        excludes=("smooth_forces",),
        why=INTERPOLATION_EXCLUSION,
    ),
    "kalman_filter": _selected_effect(
        "Roll and pitch held by a moment towards a Kalman filter's estimate",
        "stabilise.method",
        "a filter over all samples before the run, and two springs and dampers in it",
        {"pulled angles": 2},
        "kalman",
        "none",
        excludes=("prescribed_angles",),
        why=HOLDING_EXCLUSION,
        modules=FILTER_MODULES,
    ),
    "prescribed_angles": _selected_effect(
        "Roll and pitch enforced as measured, smoothed",
        "stabilise.method",
        "derivatives of the smoothed angles before the run, and in every call a mass matrix solved for two moments",
        {"enforced angles": 2},
        "prescribed",
        "none",
        excludes=("kalman_filter",),
        why=HOLDING_EXCLUSION,
    ),
    "smooth_forces": _selected_effect(
        "Forces with continuous rates between the samples",
        "forces.interpolation",
        "cubic pieces in place of straight ones",
        {"curves between samples": 1},
        "smooth",
        None,
        excludes=("held_forces",),
        why=INTERPOLATION_EXCLUSION,
    ),
    "turning_forces": _selected_effect(
        "Forces that turn with the hub or the chassis",
        "forces.frame",
        "a rotation per hub and call",
        {"turning hubs": 4},
        "hub",
        "inertial",
    ),
    "virtual_measurement": EffectEntry(
        "Forces and angles of a virtual measurement on two tracks of a random road",
        "road",
        "a run of the whole vehicle on its tyres before the others",
        {"runs on tyres": 1},
        leave_out=_keep_road,
    ),
}
