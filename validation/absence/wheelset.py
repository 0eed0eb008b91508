"""A wheelset: what its scene does not name is not read, has no element and no callback.

Positive controls stand beside: what is named changes the counts by what it says. The creep law is chosen at run time,
by one comparison per call: FASTSIM is compiled, or loaded from disk, with the kernel that both laws share, but with the
linear law it is never called and none of its numbers is read.
"""

from typing import Any

import numpy as np

from models.engines.wheelset_exudyn import ExudynWheelset
from models.engines.wheelset_mujoco import MujocoWheelset
from models.rail import equations as eq
from models.rail.eigenvalues import free
from models.rail.equations import Equations
from models.rail.wheelset import CHOSEN, Wheelset
from validation.rows import Row, System, behaves

SYSTEM: System = "effects"
SPEED, SHIFT = 60.0, 3e-3


def without_net(law: Any) -> str:
    """What the rates become where FASTSIM's net holds no numbers: the same to the last bit, or no numbers."""
    equations = Equations(CHOSEN, SPEED, law, 11)
    state, (speed, body, p, strips, cells, *rest) = equations.displaced(SHIFT), equations.given
    found, report = np.empty(eq.STATES), equations.blank()
    eq.rates(state, speed, body, p, np.full_like(strips, np.nan), np.full_like(cells, np.nan), *rest, found, report)
    return "the same" if found.tobytes() == equations.rates(state).tobytes() else "no numbers"


def springs(wheelset: Wheelset) -> tuple[int, int]:
    """Spring-dampers of Exudyn's system and actuators of MuJoCo's model."""
    mbs, _ = ExudynWheelset(wheelset, SPEED)._system
    items = [mbs.GetObject(k)["objectType"] for k in range(mbs.systemData.NumberOfObjects())]
    return sum("SpringDamper" in kind for kind in items), MujocoWheelset(wheelset, SPEED).model.nu


def rows() -> list[Row]:
    """All counts, each beside its positive control."""
    counts = [", ".join(map(str, springs(one))) for one in (CHOSEN, free(CHOSEN))]
    return [
        behaves("absent.wheelset.fastsim", SYSTEM, "rates of a wheelset where FASTSIM's net is made of no numbers: "
                "linear law, FASTSIM", ", ".join(without_net(law) for law in ("linear", "fastsim")),
                "the same, no numbers", "what is not read cannot spoil anything"),
        behaves("absent.wheelset.suspension", SYSTEM, "spring-dampers in Exudyn and actuators in MuJoCo: of the chosen "
                "wheelset; of a free one", "; ".join(counts), "2, 6; 0, 2",
                "one for each end in Exudyn; one for each direction in MuJoCo, where two hold the vehicle's weight"),
    ]  # fmt: skip
