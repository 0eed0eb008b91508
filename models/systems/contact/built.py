"""What touches and how, before it is pressed: what effects of contact extend."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from models.contact.falling_friction import Falling
from models.contact.material import Pair
from models.contact.profiles import Profile


@dataclass(frozen=True)
class Built:
    """pair : elastic constants; friction : its coefficient; load (N) or approach (m): the other one is None.

    falling : friction that falls with the speed of slip, of FASTSIM alone; profiles : cross-sections of "wheel" and
    "rail", none where an ellipse is given. In a table of cases friction and load are (n,), those of its rows.
    """

    pair: Pair
    friction: Any
    load: Any = None
    approach: float | None = None
    falling: Falling | None = None
    profiles: Mapping[str, Profile] = field(default_factory=dict)
