"""Tables of a vehicle file, as a user writes them: axes x forward, y left, z up from the ground, SI units."""

from typing import Annotated, Any, Literal

from pydantic import Field

from models.core.strict import LARGEST_QUANTITY, Strict, quantity
from models.vehicles.spatial import Freedom

FiniteNumber = Annotated[float, Field(ge=-LARGEST_QUANTITY, le=LARGEST_QUANTITY)]
Positive = Annotated[float, Field(gt=0, le=LARGEST_QUANTITY)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST_QUANTITY)]
ThreeNumbers = Annotated[list[FiniteNumber], Field(min_length=3, max_length=3)]
ThreeNotNegative = Annotated[list[NotNegative], Field(min_length=3, max_length=3)]
Names = Annotated[list[str], Field(min_length=2, max_length=2)]
Name = Annotated[str, Field(min_length=1)]

UP = [0.0, 0.0, 1.0]
FRAME = "body in whose axes the direction is fixed; by default what the system of the scene takes"


def quantity_list(unit: str, meaning: str, default: Any = ...) -> Any:
    """Schema field for a list of quantities with a unit and a meaning."""
    return Field(default, description=meaning, json_schema_extra={"unit": unit})


def _source_field() -> Any:
    return Field("", description="where the values are from: published (where), measured, or chosen")


class NamedTable(Strict):
    """Keys that every table of a vehicle file has: a name, by which messages and outputs call it, and the source of its
    values."""

    name: Name
    source: str = _source_field()


class BodyTable(NamedTable):
    """[[bodies]]: a rigid body, the position of its centre of mass and its freedoms."""

    mass: float = quantity("kg", "mass")
    position: ThreeNumbers = quantity_list("m", "centre of mass: x forward, y left, z above the ground")
    freedoms: list[Freedom] = Field(description="which of x, y, z, rx (roll), ry (pitch), rz (yaw) it has")
    inertia: ThreeNotNegative = quantity_list("kg m^2", "Ixx, Iyy, Izz about its centre of mass", [0.0, 0.0, 0.0])
    products: ThreeNumbers = quantity_list(
        "kg m^2", "Ixy, Ixz, Iyz as entries of the tensor, -int x z dm", [0.0, 0.0, 0.0]
    )
    parent: str | None = Field(None, description="body it rides on; its freedoms then count relative to that body")
    hitch: ThreeNumbers | None = quantity_list(
        "m", "where its parent tows it, as a trailer: its freedoms are turns about it", None
    )


class CurveTable(Strict):
    """{ at = [...], force = [...] }: straight lines through points and the origin, going on beyond the outer ones."""

    at: list[FiniteNumber] = Field(description="travel in m or its rate in m/s, rising", min_length=2)
    force: list[FiniteNumber] = Field(description="forces in N, one for each", min_length=2)


class SpringTable(NamedTable):
    """[[springs]]: spring, damper, curves and friction between points of two bodies along a direction."""

    bodies: Names = Field(description='two bodies; the second may be "ground"')
    point: ThreeNumbers | None = quantity_list("m", "the place of both points", None)
    points: Annotated[list[ThreeNumbers], Field(min_length=2, max_length=2)] | None = quantity_list(
        "m", "one point on each body", None
    )
    direction: ThreeNumbers | None = quantity_list(
        "", "up where nothing else is said, or from the second point to the first", None
    )
    stiffness: float = quantity("N/m", "spring", default=0.0, zero=True)
    damping: float = quantity("N s/m", "damper", default=0.0, zero=True)
    travel_force: CurveTable | None = Field(None, description="force over travel beside the spring, as a bump stop")
    rate_force: CurveTable | None = Field(None, description="force over rate beside the damper")
    friction: float = quantity("N", "dry friction", default=0.0, zero=True)
    friction_rate: float = quantity("m/s", "friction is friction * tanh(rate / friction_rate)", default=0.01)
    frame: str | None = Field(None, description=FRAME)


class MountTable(NamedTable):
    """[[mounts]]: three springs and dampers along x, y, z at one place; outputs call them NAME.x, NAME.y, NAME.z."""

    bodies: Names = Field(description='two bodies; the second may be "ground"')
    point: ThreeNumbers = quantity_list("m", "its place")
    stiffness: ThreeNotNegative = quantity_list("N/m", "along x, y, z")
    damping: ThreeNotNegative = quantity_list("N s/m", "along x, y, z", [0.0, 0.0, 0.0])
    frame: str | None = Field(None, description=FRAME)


class SeatTable(NamedTable):
    """[[seats]]: an occupant that moves up and down on a spring and damper; both the body and its spring are NAME."""

    body: str = Field(description="body that carries the seat")
    mass: float = quantity("kg", "mass of the occupant")
    position: ThreeNumbers = quantity_list("m", "the occupant, and the foot of the seat under it")
    stiffness: float = quantity("N/m", "spring")
    damping: float = quantity("N s/m", "damper", zero=True)


class BarTable(NamedTable):
    """[[anti_roll_bars]]: moment stiffness (roll of body - (left - right height) / their distance)."""

    body: str = Field(description="body whose roll it resists")
    tyres: Names = Field(description="left and right tyre of one axle, at whose places the bar is held")
    stiffness: float = quantity("N m/rad", "torsional stiffness at the axle")
    damping: float = quantity("N m s/rad", "torsional damping", default=0.0, zero=True)


class AxleTable(NamedTable):
    """[[axles]]: an axle of the vehicle, listed from the front."""

    x: float = quantity("m", "place of the axle", signed=True)
    roll_steer: float = quantity("rad/rad", "steer of its wheels over roll of the chassis", default=0.0, signed=True)


class TyreTable(NamedTable):
    """[[tyres]]: vertical spring and damper to the road at the axle's x."""

    axle: str = Field(description="name of its axle")
    body: str = Field(description="wheel or rigid axle that it carries")
    y: float | None = quantity("m", "place to the left, by default the body's", default=None, signed=True)
    stiffness: float = quantity("N/m", "vertical stiffness")
    damping: float = quantity("N s/m", "vertical damping", default=0.0, zero=True)
    cornering: float = quantity("N/rad", "side force on the chassis over slip angle", default=0.0, zero=True)


class DragTable(Strict):
    """[drag]: force coefficient * speed * (small) x-velocity against the motion of a body's centre."""

    body: str
    coefficient: float = quantity("N s^2/m^2", "force over speed and velocity")
    source: str = _source_field()


OutputKind = Literal[
    "acceleration",
    "velocity",
    "displacement",
    "angular acceleration",
    "angular velocity",
    "angle",
    "travel",
    "travel rate",
    "force",
    "tyre force",
    "tyre deflection",
]


class OutputTable(Strict):
    """[[outputs]]: an output of the simulation: motion of a point of a body, or a quantity of a spring, mount, seat or
    bar, or of a tyre."""

    name: Name
    kind: OutputKind
    body: str | None = Field(None, description="body, for accelerations and other motion")
    point: ThreeNumbers | None = quantity_list("m", "point of the body, its centre of mass where nothing is said", None)
    direction: ThreeNumbers = quantity_list("", "direction or axis", UP)
    part: str | None = Field(None, description="spring, mount (NAME.z), seat or bar, for travel, travel rate, force")
    tyre: str | None = Field(None, description="tyre, for tyre force and deflection")


class ReducedTable(Strict):
    """[reduced]: parts that a choice of effects has left out, as limits; only the closed form of ride reads them."""

    massless: list[Name] = Field(default_factory=list, description="bodies that count as having no mass")
    rigid: list[Name] = Field(default_factory=list, description="springs, and NAME.x of mounts, that count as rigid")
    locked: list[Names] = Field(default_factory=list, description="freedoms that count as locked: body and freedom")


class VehicleTable(Strict):
    """Tables of a vehicle file."""

    title: str = Field(description="what the vehicle is")
    notes: str = Field("", description="what a reader should know")
    chassis: str | None = Field(
        None, description="body on which the tyres' side forces act, and whose roll and yaw they see"
    )
    bodies: list[BodyTable] = Field(min_length=1)
    axles: list[AxleTable] = Field(min_length=1)
    tyres: list[TyreTable] = Field(min_length=1)
    springs: list[SpringTable] = Field(default_factory=list)
    mounts: list[MountTable] = Field(default_factory=list)
    seats: list[SeatTable] = Field(default_factory=list)
    anti_roll_bars: list[BarTable] = Field(default_factory=list)
    drag: DragTable | None = None
    outputs: list[OutputTable] = Field(min_length=1, description="what is read")
    reduced: ReducedTable | None = None
