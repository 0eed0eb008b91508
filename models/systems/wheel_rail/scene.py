"""Scenes of a wheelset on its rails at prescribed lateral displacements, as in the Manchester contact benchmark."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from models.contact.material import MaterialPair
from models.core.errors import InputError
from models.core.scene_file import SceneFile, checked
from models.core.strict import Strict, quantity
from models.rail.contact_table import CELLS_PER_STRIP, WheelsetContact
from models.rail.laid_profiles import CrossSections
from models.systems.contact.scene import WheelRailBodies

LARGEST_CELL_COUNT = 300
"""Most cells along each axis of a patch in the computation of creep forces."""


class WheelsetOnRails(Strict):
    """[wheelset]: two wheels on one axle, each with the same load."""

    radius: float = quantity("m", "of the wheels at the taping line", default=0.46)
    load: float = quantity("N", "vertical, on each wheel", default=1.0e4)
    speed: float = quantity("m/s", "of the wheelset along the track", default=2.0)


class LateralPositions(Strict):
    """[positions]: lateral displacements of the wheelset, evenly spaced, positive to the right."""

    start: float = quantity("m", "first displacement", default=0.0, signed=True)
    stop: float = quantity("m", "last displacement", default=0.010, signed=True)
    count: int = Field(default=21, ge=1, le=1000, description="number of displacements")

    def values(self) -> np.ndarray:
        """Lateral displacements (count,) of the wheelset in m."""
        return np.linspace(self.start, self.stop, self.count)


class WheelRailCase(Strict):
    """[cases.NAME]: yaw of the wheelset, and friction if it rolls."""

    yaw: float = quantity("rad/m", "yaw for each metre of displacement", default=0.0, signed=True)
    friction: float = quantity(
        "", "coefficient of friction; 0 for a wheelset that is pressed only", default=0.0, zero=True
    )


class PatchCells(Strict):
    """[method]: number of cells with which contacts are computed."""

    cells: int = Field(
        default=CELLS_PER_STRIP,
        ge=9,
        le=LARGEST_CELL_COUNT,
        description="along each axis of a patch, more on normal pressures",
    )


class WheelRailScene(SceneFile):
    """A scene of a wheelset at prescribed lateral displacements: every case is computed at every position."""

    system: Literal["wheel-rail"] = "wheel-rail"
    study: str = Field(default="manchester", description="the study that runs the scene")
    bodies: WheelRailBodies = WheelRailBodies()
    profiles: CrossSections = CrossSections()
    wheelset: WheelsetOnRails = WheelsetOnRails()
    positions: LateralPositions = LateralPositions()
    method: PatchCells = PatchCells()
    cases: dict[str, WheelRailCase] = Field(min_length=1, description="tables [cases.NAME] with yaw and friction")

    def contact(self, rail_case: WheelRailCase) -> WheelsetContact:
        """Returns the contact problem of the wheelset on the track in a case; raises InputError for files that are no
        profiles.
        """
        side = self.profiles.wheel_on_rail(self.wheelset.radius)
        return WheelsetContact(
            side,
            self.wheelset.load,
            self.wheelset.speed,
            rail_case.friction,
            MaterialPair(self.bodies.wheel, self.bodies.rail),
            CELLS_PER_STRIP / self.method.cells,
        )


PLAUSIBLE_RANGES = {
    "profiles.inclination": (-0.5, 0.5, "rad"),
    "profiles.gauge": (0.1, 3.0, "m"),
    "profiles.back_to_back": (0.1, 3.0, "m"),
    "profiles.gauge_depth": (1e-3, 0.1, "m"),
    "profiles.taping": (0.01, 0.2, "m"),
    "wheelset.radius": (0.02, 5.0, "m"),
    "wheelset.load": (1.0, 5e5, "N"),
    "wheelset.speed": (0.01, 200.0, "m/s"),
    "positions.start": (-0.03, 0.03, "m"),
    "positions.stop": (-0.03, 0.03, "m"),
}
"""Smallest and largest values that are taken: values beyond them are likely to be in a wrong unit."""
LARGEST_YAW, LARGEST_FRICTION = 0.1, 1.0
"""Largest yaw of the wheelset (rad) and largest coefficient of friction that a scene may have."""


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> WheelRailScene:
    """Build a checked wheel-rail scene from the nested tables of a scene file. Raises InputError for unknown keys and
    for values outside their ranges.
    """
    scene = checked(WheelRailScene, scene_tables, scene_path, scene_folder)
    for key_path, (least, most_allowed, unit) in PLAUSIBLE_RANGES.items():
        owner, key = key_path.split(".")
        value = getattr(getattr(scene, owner), key)
        if not least <= value <= most_allowed:
            raise InputError(scene_path, key_path, value, f"must be from {least:g} to {most_allowed:g} {unit}")
    for name, case in scene.cases.items():
        largest = float(np.abs(case.yaw * scene.positions.values()).max())
        if largest > LARGEST_YAW:
            refusal = (
                f"turns the wheelset by {largest:.3g} rad, more than {LARGEST_YAW:g}: the yaw is in rad for each metre "
                "of displacement"
            )
            raise InputError(scene_path, f"cases.{name}.yaw", case.yaw, refusal)
        if case.friction > LARGEST_FRICTION:
            raise InputError(
                scene_path, f"cases.{name}.friction", case.friction, f"must be at most {LARGEST_FRICTION:g}"
            )
    profiles = scene.profiles
    if profiles.smoothing and not any(Path(name).suffix for name in (profiles.wheel, profiles.rail)):
        raise InputError(scene_path, "profiles.smoothing", profiles.smoothing, "has no meaning for built-in profiles")
    return scene.model_copy(update={"profiles": profiles.with_full_paths(scene)})
