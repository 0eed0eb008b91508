"""Absence checks of the wheelset: an effect that its scene does not name reads no parameter and adds no element and no
callback to an engine.

Positive controls stand beside: an effect in the scene changes the counts as its file declares. The creep law is chosen
at run time, by one comparison per call: FASTSIM is compiled, or loaded from disk, with the kernel that both laws share,
but with the linear law it is never called and none of its parameters is read.
"""

from typing import Any, cast

import numpy as np

from models.rail import equations as eq
from models.rail import wheel_forces as forces
from models.rail.eigenvalues import free_wheelset
from models.rail.equations import WheelsetEquations
from models.rail.wheelset import CHOSEN_WHEELSET, Wheelset
from models.systems.wheelset.scene import WheelsetScene
from validation.common.rows import Row, System, behaviour_row

SYSTEM: System = "effects"
SPEED, LATERAL_SHIFT = 60.0, 3e-3
ENGINES = ("reference", "exudyn", "mujoco")
FREE_WHEELSET = {name: 0.0 for name in Wheelset.model_fields if name.startswith(("stiffness", "damping"))}
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "wheelset",
    "contact": {"law": "linear"},
    "speeds": {"values": [SPEED]},
    "wheelset": {"override": {**FREE_WHEELSET, "flange_stiffness": 0.0, "contact_damping": 0.0}},
    "run": {"duration": 0.01, "step": 5e-4, "displacement": 1e-3, "speeds": [SPEED]},
}
"""Scene of a wheelset without effects: conical wheels without flanges, no suspension, linear creep law."""


def counts_and_path(scene: WheelsetScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the components of a wheelset's model (springs, flanges, creep grids, ...), and the states of a run as
    bytes."""
    from models.systems.wheelset.of_scene import equations_of
    from models.systems.wheelset.run import run

    equations = equations_of(scene, engine, SPEED)
    body, rails = equations.body, equations.rails
    wheels, profiles = rails.wheels[0], rails.profile.nodes.size > 0  # profiles have flanges of their own
    counts = {
        "springs": sum(stiffness > 0.0 for stiffness in body.stiffness),
        "dampers": sum(damping > 0.0 for damping in body.damping),
        "creep nets": int(rails.law == forces.FASTSIM),
        "flanges": int(wheels.flange > 0.0 and not profiles),
        "contact damping": int(wheels.damping > 0.0),
        "profiles": int(profiles),
    }
    if engine != "reference":
        exudyn, mujoco = spring_counts(equations.wheelset)
        counts |= {"spring-dampers": exudyn} if engine == "exudyn" else {"actuators": mujoco}
    return counts, run(scene, engine, SPEED).detail.states.tobytes()


def rates_with_nan_grid(creep_law: Any) -> str:
    """Returns "the same" if filling FASTSIM's grid with NaN does not change a bit of the wheelset's state rates, else
    "no numbers"."""
    equations = WheelsetEquations(CHOSEN_WHEELSET, SPEED, creep_law, 11)
    state, (speed, body, _), rails = equations.displaced_state(LATERAL_SHIFT), equations.parameters, equations.rails
    rails = rails._replace(strips=np.full_like(rails.strips, np.nan), cells=np.full_like(rails.cells, np.nan))
    rates = np.empty(eq.STATE_COUNT)
    eq.fill_rates(state, speed, body, forces.plain_rails(rails), rates, equations.empty_contacts())
    return "the same" if rates.tobytes() == equations.rates(state).tobytes() else "no numbers"


def spring_counts(wheelset: Wheelset) -> tuple[int, int]:
    """Number of spring-dampers in Exudyn's model of a wheelset, and number of actuators in MuJoCo's model."""
    from models.engines.wheelset import ExudynWheelset, MujocoWheelset

    exudyn, mujoco = (cast(Any, engine(wheelset, SPEED).model) for engine in (ExudynWheelset, MujocoWheelset))
    mbs = exudyn.mbs
    items = [mbs.GetObject(k)["objectType"] for k in range(mbs.systemData.NumberOfObjects())]
    return sum("SpringDamper" in kind for kind in items), mujoco.model.nu


def rows() -> list[Row]:
    """Report rows: a wheelset without FASTSIM reads no FASTSIM grid, and one without suspension has no suspension
    elements. Each stands next to a positive control."""
    counts = [
        ", ".join(map(str, spring_counts(wheelset))) for wheelset in (CHOSEN_WHEELSET, free_wheelset(CHOSEN_WHEELSET))
    ]
    return [
        behaviour_row(
            "absent.wheelset.fastsim",
            SYSTEM,
            "rates of a wheelset while FASTSIM's net holds no numbers, with the linear law and with FASTSIM",
            ", ".join(rates_with_nan_grid(law) for law in ("linear", "fastsim")),
            "the same, no numbers",
            "what is not read cannot spoil anything",
        ),
        behaviour_row(
            "absent.wheelset.suspension",
            SYSTEM,
            "number of spring-dampers in Exudyn and actuators in MuJoCo, for the chosen wheelset and for a free one",
            "; ".join(counts),
            "2, 6; 0, 2",
            "one for each end in Exudyn; one for each direction in MuJoCo, where two hold the vehicle's weight",
        ),
    ]
