"""Friction that falls with the speed of slip: mu(s) = mu (floor + (1 - floor) exp(-decay s)), s in m/s.

The law is Polach's (Wear 258 (2005) 992), taken point by point. ``fastsim_falling`` computes with it, and is not
imported where friction is constant.
"""

from typing import Any

from pydantic import Field

from models.core.strict import Strict


class Falling(Strict):
    """[falling_friction]: ``Falling(floor=0.4, decay=0.6, speed=20.0)``."""

    floor: float = Field(
        gt=0.0, le=1.0, description="friction at endless slip by that at none", json_schema_extra={"unit": ""}
    )
    decay: float = Field(ge=0.0, le=1e6, description="of the exponential", json_schema_extra={"unit": "s/m"})
    speed: float = Field(ge=0.0, le=1e4, description="rolling speed", json_schema_extra={"unit": "m/s"})

    def __init__(self, **values: Any) -> None:
        super().__init__(**values)

    @property
    def law(self) -> tuple[float, float]:
        """Floor, and decay per unit of slip by the rolling speed."""
        return self.floor, self.decay * self.speed
