"""Effects of bicycle scenes: feedback to a steering motor, friction of the steering, errors of sensors and motor."""

from typing import Any

from models.core.scene_effects import EffectEntry, Table


def _control_effect(
    control_key: str, neutral_value: float, usual_value: float, description: str, **entry_fields: Any
) -> EffectEntry:
    """Returns an effect that is present where a key of [control] has a value other than ``neutral_value``.

    usual_value : value of the key when the effect is added to a scene.
    """

    def is_present(scene: Any) -> bool:
        return bool(getattr(scene.control, control_key) != neutral_value)

    def leave_out(scene_tables: Table, scene: Any) -> None:
        scene_tables["control"].pop(control_key, None)

    def put_in(scene_tables: Table, scene: Any) -> None:
        scene_tables.setdefault("control", {})[control_key] = usual_value

    cost = "a product per call"
    return EffectEntry(
        description,
        f"control.{control_key}",
        cost,
        is_present=is_present,
        leave_out=leave_out,
        put_in=put_in,
        **entry_fields,
    )


NEEDS_FEEDBACK = {"needs": ("feedback",), "why": "whose command or sensor it changes"}
TABLE = {
    "feedback": _control_effect("gain", 0.0, 2.0, "Steer torque by the lean rate, less the faster the bicycle is"),
    "steering_friction": _control_effect("friction", 0.0, 0.15, "Viscous friction of the steering"),
    "dry_friction": _control_effect("dry_friction", 0.0, 0.16, "Dry friction of the steering"),
    "torque_gain": _control_effect(
        "torque_gain", 1.0, 0.9, "A motor that gives less than its command", **NEEDS_FEEDBACK
    ),
    "encoder_gain": _control_effect("encoder_gain", 1.0, 0.8, "An encoder that tells less than the steer angle"),
    "speed_gain": _control_effect("speed_gain", 1.0, 1.066, "A speed sensor of another slope", **NEEDS_FEEDBACK),
    "speed_bias": _control_effect("speed_bias", 0.0, -0.128, "A speed sensor with a bias", **NEEDS_FEEDBACK),
}
