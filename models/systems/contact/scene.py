"""Scenes of rolling contact: materials, geometry, load, friction, creepages, and the theory of the creep forces."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from models.contact.inputs import LARGEST_APPROACH, LARGEST_CREEPAGE, LARGEST_LOAD, LARGEST_SPIN
from models.contact.material import STEEL, FallingFriction, Material, MaterialPair
from models.core.errors import InputError
from models.core.scene_effects import check_effects, with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.strict import Strict, quantity

GEOMETRY_TABLES = ("ellipse", "curvatures", "radii", "profiles", "cases")
"""Scene tables that describe the geometry of the contact; a scene has exactly one of them."""


class WheelRailBodies(Strict):
    """[bodies]: elastic constants of wheel and rail, by default steel."""

    wheel: Material = Field(default=STEEL, description="E in Pa and nu of body 1")
    rail: Material = Field(default=STEEL, description="E in Pa and nu of body 2")


class ContactEllipse(Strict):
    """[ellipse]: semi-axes of the contact area."""

    a: float = quantity("m", "semi-axis along x, the direction of rolling")
    b: float = quantity("m", "semi-axis along y")


class ContactCurvatures(Strict):
    """[curvatures]: coefficients A and B of the undeformed distance A x^2 + B y^2 between the bodies."""

    A: float = quantity("1/m", "curvature along x, half the sum of both bodies' curvatures")
    B: float = quantity("1/m", "curvature along y, half the sum of both bodies' curvatures")


class CurvatureRadii(Strict):
    """[radii]: radii of curvature of both bodies, positive where convex; flat in a direction without a radius."""

    wheel_x: float | None = quantity("m", "rolling radius of the wheel", default=None, signed=True)
    wheel_y: float | None = quantity("m", "radius of the wheel's profile", default=None, signed=True)
    rail_x: float | None = quantity("m", "radius of the rail along x", default=None, signed=True)
    rail_y: float | None = quantity("m", "radius of the rail's profile", default=None, signed=True)

    def curvatures(self, scene_path: str) -> tuple[float, float]:
        """Coefficients A and B (1/m) of the undeformed distance A x^2 + B y^2. Raises InputError for a radius of zero,
        or bodies that do not touch on an ellipse.
        """
        for name, radius in self:
            if radius == 0:
                raise InputError(
                    scene_path, f"radii.{name}", radius, "must not be 0 (radius in m, negative if concave)"
                )
        curvature_pair = []
        for axis in ("x", "y"):
            value = sum(1.0 / radius for name, radius in self if radius is not None and name.endswith(axis)) / 2
            if value <= 0:
                raise InputError(
                    scene_path,
                    f"radii.wheel_{axis}, rail_{axis}",
                    None,
                    f"are flat or conform along {axis}: "
                    f"half the sum of their curvatures is {value:.4g} 1/m and must be above 0",
                )
            curvature_pair.append(value)
        return curvature_pair[0], curvature_pair[1]


class WheelRailProfiles(Strict):
    """[profiles]: cross-sections of wheel and rail, and their position relative to each other."""

    wheel: str = Field(default="S1002", description="S1002, or a file of a profile")
    rail: str = Field(default="UIC60", description="UIC60, or a file of a profile")
    inclination: float = quantity("rad", "of the rail towards the track's centre", default=0.025, signed=True)
    lateral_shift: float = quantity("m", "of the wheel towards the rail's gauge corner", default=0.0, signed=True)
    yaw: float = quantity("rad", "of the wheelset", default=0.0, signed=True)
    radius: float = quantity("m", "of the wheel at its taping line", default=0.46)
    back_to_back: float = quantity("m", "between the backs of the wheels' flanges", default=1.360)
    gauge: float = quantity("m", "of the track", default=1.435)
    gauge_depth: float = quantity("m", "below the rails' tops where the gauge is measured", default=0.014)
    smoothing: float = quantity("m", "wavelength of which half is left in profiles from files", default=0.0, zero=True)


class CasesFile(Strict):
    """[cases]: file of a table in which each row has a contact, its load, friction and creepages."""

    file: str = Field(description="CSV file, beside the scene or in the folder in which the command runs")


class ContactTable(Strict):
    """[contact]: normal load or approach of the bodies, and coefficient of friction."""

    load: float | None = quantity("N", "normal load, on profiles the vertical one", default=None)
    approach: float | None = quantity("m", "approach of the bodies instead of a load", default=None)
    friction: float = quantity("", "coefficient of friction")


class CreepageTable(Strict):
    """[creepage]: velocity of the wheel relative to the rail, divided by the rolling speed."""

    xi_x: float = quantity("", "longitudinal creepage", default=0.0, signed=True)
    xi_y: float = quantity("", "lateral creepage", default=0.0, signed=True)
    spin: float = quantity("1/m", "spin by the rolling speed", default=0.0, signed=True)


class CreepageSweep(Strict):
    """[sweep]: range through which one creepage is varied; the other creepages are those of [creepage]."""

    of: Literal["xi_x", "xi_y", "spin"] = Field(description="the creepage that is swept")
    start: float = quantity("1 or 1/m", "first value", signed=True)
    stop: float = quantity("1 or 1/m", "last value", signed=True)
    count: int = Field(default=25, ge=2, le=10_000, description="number of values")
    spacing: Literal["linear", "logarithmic"] = Field(default="linear", description="of the values")

    def values(self) -> np.ndarray:
        """Values (count,) of the swept creepage, from start to stop."""
        spaced = np.linspace if self.spacing == "linear" else np.geomspace
        return spaced(self.start, self.stop, self.count)


class ContactMethod(Strict):
    """[method]: theory of the creep forces, and number of cells along each axis of the contact."""

    name: Literal["fastsim", "simplified", "exact", "linear"] = Field(default="fastsim", description="theory")
    cells: int = Field(default=21, ge=5, le=400, description="cells along each axis")
    march: Literal["second-order", "plain"] = Field(default="second-order", description="of FASTSIM")
    bound: Literal["intermediate", "parabolic", "elliptic"] = Field(default="intermediate", description="of tractions")
    flexibilities: Literal["blended", "one", "three"] = Field(default="blended", description="of FASTSIM")

    @property
    def order(self) -> float:
        """Order of convergence: the power of the cell size to which the error of the forces is proportional."""
        return 2.0 if self.name == "fastsim" and self.march == "second-order" and self.bound != "elliptic" else 1.0

    @property
    def error_band_name(self) -> str:
        """Name of the theory's error band in ``models.contact.accuracy``."""
        return f"{self.flexibilities} {self.bound}" if self.name == "fastsim" else self.name

    def unread_keys(self) -> frozenset[str]:
        """Keys of [method] that have no meaning for the scene's theory."""
        fastsim = {"march", "bound", "flexibilities"}
        return frozenset({"fastsim": set(), "linear": {"cells", *fastsim}}.get(self.name, fastsim))


class ContactScene(SceneFile):
    """A scene of rolling contact: all tables of its scene file, exactly one of GEOMETRY_TABLES among them."""

    system: Literal["contact"] = "contact"
    study: str = Field(default="contact", description="the study that runs the scene")
    bodies: WheelRailBodies = WheelRailBodies()
    ellipse: ContactEllipse | None = Field(default=None, description="semi-axes of the contact area")
    curvatures: ContactCurvatures | None = Field(default=None, description="of the undeformed distance")
    radii: CurvatureRadii | None = Field(default=None, description="of both bodies")
    profiles: WheelRailProfiles | None = Field(default=None, description="cross-sections of wheel and rail")
    cases: CasesFile | None = Field(default=None, description="a contact in every row of a file")
    contact: ContactTable | None = Field(default=None, description="table with load or approach, and friction")
    falling_friction: FallingFriction | None = Field(
        default=None, description="friction that falls with the speed of slip"
    )
    creepage: CreepageTable = CreepageTable()
    sweep: CreepageSweep | None = Field(default=None, description="one creepage through a range")
    method: ContactMethod = ContactMethod()
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")

    @property
    def geometry(self) -> str:
        """Name of the scene's geometry table, one of GEOMETRY_TABLES."""
        return next(name for name in GEOMETRY_TABLES if getattr(self, name) is not None)

    def cases_file(self) -> Path:
        """Path of the CSV file with the table of cases."""
        assert self.cases is not None
        return self.path(self.cases.file, "cases.file")

    @property
    def pair(self) -> MaterialPair:
        """Elastic constants of wheel and rail."""
        return MaterialPair(self.bodies.wheel, self.bodies.rail)


@contextmanager
def scene_errors(scene: ContactScene) -> Iterator[None]:
    """Context that adds the scene's file and key to an InputError of functions that know no scene."""
    try:
        yield
    except InputError as error:
        if error.file:
            raise
        tables: dict[str, type[Strict]] = {"profiles": WheelRailProfiles, "contact": ContactTable}
        within = next((f"{name}." for name, keys in tables.items() if error.place in keys.model_fields), "")
        raise InputError(scene.file, f"{within}{error.place}", error.value, error.allowed, error.choices) from None


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> ContactScene:
    """Build a checked contact scene from the nested tables of a scene file. Raises InputError for unknown keys and for
    values outside their ranges.
    """
    scene = checked(ContactScene, scene_tables, scene_path, scene_folder)
    _raise_first_refusal(
        scene, _geometry_refusals, _contact_refusals, _size_refusals, _sweep_refusals, _method_refusals
    )
    complete = with_effect_tables(scene)
    check_effects(complete)
    _raise_first_refusal(scene, _friction_refusals)
    return complete


ContactRefusals = Iterator[tuple[str, Any, str]]
"""Wrong keys of a scene, their values and what is allowed there; the first of them is reported."""


def _raise_first_refusal(scene: ContactScene, *refusal_checks: Callable[[ContactScene], ContactRefusals]) -> None:
    for key_path, value, allowed in chain.from_iterable(wrong(scene) for wrong in refusal_checks):
        raise InputError(scene.file, key_path, value, allowed)


def _geometry_refusals(scene: ContactScene) -> ContactRefusals:
    """Yields refusals of a scene with several geometry tables or none, of impossible radii, and of profile values out
    of range, as of a wheel in mm.
    """
    tables = [name for name in GEOMETRY_TABLES if getattr(scene, name) is not None]
    if len(tables) != 1:
        known = ", ".join(GEOMETRY_TABLES)
        yield "", None, f"one of the tables {known} says where the bodies touch; found {', '.join(tables) or 'none'}"
    if scene.radii is not None:
        scene.radii.curvatures(scene.file)
    if (profiles := scene.profiles) is None:
        return
    for key, (least, largest, unit) in PROFILE_RANGES.items():
        value = getattr(profiles, key)
        if not least <= value <= largest:
            yield f"profiles.{key}", value, f"must be from {least:g} to {largest:g} {unit}"
    if profiles.smoothing and "." not in profiles.wheel + profiles.rail:
        yield "profiles.smoothing", profiles.smoothing, "has no meaning for built-in profiles"


PROFILE_RANGES = {
    "inclination": (-0.5, 0.5, "rad"),
    "radius": (0.02, 5.0, "m"),
    "gauge": (0.1, 3.0, "m"),
    "back_to_back": (0.1, 3.0, "m"),
    "gauge_depth": (0.0, 0.1, "m"),
}
"""Smallest and largest values of the keys of [profiles], with their unit."""
TABLES_IN_CASES_FILE = {"contact", "creepage", "sweep"}
"""Scene tables that a scene with [cases] must not have: each row of the file has their content."""
LARGEST_INPUTS = {
    "contact.load": LARGEST_LOAD,
    "contact.approach": LARGEST_APPROACH,
    "contact.friction": 10.0,
    "creepage.xi_x": LARGEST_CREEPAGE,
    "creepage.xi_y": LARGEST_CREEPAGE,
    "creepage.spin": LARGEST_SPIN,
}
"""Largest magnitudes of inputs that the theories take, by scene key."""


def _contact_refusals(scene: ContactScene) -> ContactRefusals:
    contact = scene.contact
    if scene.cases is not None:
        for table in sorted(scene.model_fields_set & TABLES_IN_CASES_FILE):
            yield table, None, "is in the file of cases: drop this table"
    elif contact is None:
        yield "contact", None, "is missing: a table with load or approach, and friction"
    elif (contact.load is None) == (contact.approach is None):
        yield "contact.load", contact.load, "give either the load in N or contact.approach in m"


def _size_refusals(scene: ContactScene) -> ContactRefusals:
    """Yields refusals of values beyond LARGEST_INPUTS. The theories would refuse them, too, without the name of file
    and key.
    """
    for key_path, largest in LARGEST_INPUTS.items():
        table, key = key_path.split(".")
        values = {key_path: getattr(getattr(scene, table), key, None)}
        if scene.sweep is not None and scene.sweep.of == key:
            values = {f"sweep.{end}": getattr(scene.sweep, end) for end in ("start", "stop")}
        unit = {"load": " N", "approach": " m", "spin": " 1/m"}.get(key, "")
        for value_path, value in values.items():
            if value is not None and abs(value) > largest:
                yield value_path, value, f"must be at most {largest:g}{unit}, of either sign"


def _sweep_refusals(scene: ContactScene) -> ContactRefusals:
    if (sweep := scene.sweep) is None:
        return
    if sweep.start == sweep.stop:
        yield "sweep.stop", sweep.stop, "must differ from sweep.start"
    if sweep.spacing == "logarithmic" and sweep.start * sweep.stop <= 0:
        yield "sweep.spacing", sweep.spacing, "start and stop must then both be above 0, or both below"
    if sweep.of in scene.creepage.model_fields_set:
        remedy = "on the command line give the whole table, as in --set creepage={xi_x=1e-3}"
        yield f"creepage.{sweep.of}", getattr(scene.creepage, sweep.of), f"is swept: drop this key; {remedy}"


THEORIES_OF_PROFILES = ("simplified", "exact")
"""Theories that compute contact areas of any shape, as profiles need."""


def _method_refusals(scene: ContactScene) -> ContactRefusals:
    """Yields refusals of [method] keys that the theory does not read, and of a theory that does not suit the
    geometry.
    """
    method = scene.method
    for key in sorted(method.model_fields_set & method.unread_keys()):
        yield f"method.{key}", getattr(method, key), f"has no meaning for {method.name}"
    if scene.cases is not None and method.name != "fastsim":
        yield "method.name", method.name, "a table of cases is computed by fastsim"
    if scene.profiles is not None and method.name not in THEORIES_OF_PROFILES:
        yield "method.name", method.name, "needs an ellipse; for profiles use " + " or ".join(THEORIES_OF_PROFILES)


def _friction_refusals(scene: ContactScene) -> ContactRefusals:
    """Yields refusals of falling friction in a table of cases, and with a FASTSIM march that is not of second order."""
    march = scene.method.march
    if scene.falling_friction is None:
        return
    if scene.cases is not None:
        yield "falling_friction", None, "a table of cases has constant friction"
    if march != "second-order":
        yield "method.march", march, "must be second-order where friction falls"
