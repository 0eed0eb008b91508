"""The road's second corner: its filters of second order become those of first order."""

from typing import Any

from models.systems.ride.effects import tyre_damping
from models.systems.ride.reduced_scene import Effect, Held, holds

PLACE = "road.cutoff"
COST = "a state more per filter of the road"
COUNTS = {"all": {"states": 4}}


def found(held: Held) -> list[Effect]:
    """One effect, where the road has a second corner; a tyre that is damped would then meet white noise."""
    if held.scene.road.cutoff is None:
        return []
    damped = any(tyre.damping for tyre in held.vehicle.tyres)
    return [
        Effect(
            "second corner of the road",
            _without,
            "road filters of first order",
            (tyre_damping.NAME,) if damped else (),
            (),
            "for it would pass white noise",
        )
    ]


def _without(held: Held) -> Held:
    return held.on_road(cutoff=None)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return holds(scene, found)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Road filters of first order."""
    table["road"].pop("cutoff", None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """At 20 rad/m, a wavelength of a third of a metre."""
    table.setdefault("road", {})["cutoff"] = 20.0
