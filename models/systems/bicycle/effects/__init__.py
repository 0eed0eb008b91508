"""Effects of scenes of a bicycle: what turns the steering beside the bicycle itself, and how sensors and motor err."""

from typing import Any

from models.core.scene_effects import Entry, Table


def _of_control(key: str, neutral: float, usual_value: float, description: str, **entry_fields: Any) -> Entry:
    """An effect of the control: it is present where this key of [control] has a value other than ``neutral``."""

    def is_present(scene: Any) -> bool:
        return bool(getattr(scene.control, key) != neutral)

    def leave_out(table: Table, scene: Any) -> None:
        table["control"].pop(key, None)

    def put_in(table: Table, scene: Any) -> None:
        table.setdefault("control", {})[key] = usual_value

    cost = "a product per call"
    return Entry(
        description, f"control.{key}", cost, is_present=is_present, leave_out=leave_out, put_in=put_in, **entry_fields
    )


NEEDS_OF_SENSING = {"needs": ("feedback",), "why": "whose command or sensor it changes"}
TABLE = {
    "feedback": _of_control("gain", 0.0, 2.0, "Steer torque by the lean rate, less the faster the bicycle is"),
    "steering_friction": _of_control("friction", 0.0, 0.15, "Viscous friction of the steering"),
    "dry_friction": _of_control("dry_friction", 0.0, 0.16, "Dry friction of the steering"),
    "torque_gain": _of_control("torque_gain", 1.0, 0.9, "A motor that gives less than its command", **NEEDS_OF_SENSING),
    "encoder_gain": _of_control("encoder_gain", 1.0, 0.8, "An encoder that tells less than the steer angle"),
    "speed_gain": _of_control("speed_gain", 1.0, 1.066, "A speed sensor of another slope", **NEEDS_OF_SENSING),
    "speed_bias": _of_control("speed_bias", 0.0, -0.128, "A speed sensor with a bias", **NEEDS_OF_SENSING),
}
