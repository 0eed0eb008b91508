"""Where on a vehicle a channel can be measured, by names."""

from collections.abc import Mapping
from dataclasses import dataclass

from models.measured.signal import Quantity


@dataclass(frozen=True)
class Places:
    """Names of a vehicle that a channel can be at: hubs, bodies, connectors (springs, mounts, bars), sensors."""

    hubs: tuple[str, ...]
    bodies: tuple[str, ...]
    connectors: tuple[str, ...]
    sensors: tuple[str, ...] = ()

    def of(self, quantity: Quantity) -> Mapping[str, tuple[str, ...]]:
        """Kinds of places at which a quantity is measured, with their names; none if anywhere."""
        connectors = {"springs, mounts and bars": self.connectors}
        if quantity in ("force", "moment"):
            return {"hubs": self.hubs, **connectors}
        moving = {"bodies": self.bodies, "sensors": self.sensors}
        return {"travel": connectors, "strain": {}}.get(quantity, moving)
