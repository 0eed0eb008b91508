"""A vehicle file becomes a vehicle in space: read strictly, checked as a whole, every fault told by its entry."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.scene_file import existing, parse
from models.core.strict import read
from models.vehicles.spatial import (
    AntiRollBar,
    Body,
    Curve,
    Drag,
    Limits,
    PartOutput,
    PointOutput,
    SideForce,
    SpatialOutput,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
    Tyre,
    TyreOutput,
    Vector,
)
from models.vehicles.vehicle_checks import check
from models.vehicles.vehicle_tables import (
    AxleTable,
    CurveTable,
    OutputTable,
    ReducedTable,
    SeatTable,
    SpringTable,
    TyreTable,
    VehicleTable,
)

GROUND = "ground"
SHIPPED = Path(__file__).parent / "parameters" / "vehicles"


def shipped() -> tuple[str, ...]:
    """Names of the vehicles that come with twinrig."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def load_vehicle(
    name: str, folder: str | Path = ".", file: str = "", place: str = "", reduced: bool = False
) -> SpatialVehicle:
    """A vehicle that comes with twinrig, by its name, or a user's TOML file, relative to ``folder``; unloaded.

    ``file`` and ``place`` say who asked for it, for the message if there is none. reduced : may it have [reduced]?
    Raises InputError.
    """
    path = vehicle_path(name, folder, file, place)
    vehicle = build_vehicle(parse(path), path.name)
    if vehicle.limits and not reduced:
        raise InputError(
            file,
            place,
            name,
            "has a table [reduced], which only the study ride of linear vehicles reads: name the whole vehicle here",
        )
    return vehicle


def vehicle_path(name: str, folder: str | Path = ".", file: str = "", place: str = "") -> Path:
    """Where the file of a vehicle is, which ``load_vehicle`` reads; raises InputError."""
    if not name.endswith(".toml"):
        if name not in shipped():
            raise InputError(file, place, name, "no such vehicle; a file of your own ends in .toml", shipped())
        return SHIPPED / f"{name}.toml"
    return existing(name, Path(folder), file, place)


def build_vehicle(table: Mapping[str, Any], file: str) -> SpatialVehicle:
    """The vehicle of nested tables as a TOML file holds them; raises InputError for the first fault."""
    return _Builder(_read(table, file), file).vehicle()


def _read(table: Mapping[str, Any], file: str) -> VehicleTable:
    """The tables; a fault within a list of tables is told with the entry's own name."""
    try:
        return read(VehicleTable, table, file)
    except InputError as error:
        found = re.match(r"(\w+)\.(\d+)(?=\.|$)", error.place)
        if not found:
            raise
        entry = table[found[1]][int(found[2])]
        name = entry.get("name") if isinstance(entry, Mapping) else None
        raise InputError(
            file, _place(found[1], name or int(found[2])) + error.place[found.end() :], error.value, error.allowed
        ) from None


def _place(table: str, entry: object, key: str = "") -> str:
    return f"{table}[{entry}]" + (f".{key}" if key else "")


class _Builder:
    """Turns the tables of one file into the parts of a vehicle."""

    def __init__(self, tables: VehicleTable, file: str) -> None:
        self.tables, self.file = tables, file
        bodies = [body.name for body in tables.bodies] + [seat.name for seat in tables.seats]
        self._unique("bodies", bodies, reserved=(GROUND,))
        self._unique("axles", [axle.name for axle in tables.axles])
        self._unique("tyres", [tyre.name for tyre in tables.tyres])
        self._unique("outputs", [output.name for output in tables.outputs])
        self.bodies = self._bodies()
        self.axles = self._axles()
        self.tyres = {tyre.name: tyre for tyre in self._tyres()}

    def vehicle(self) -> SpatialVehicle:
        springs = (*self._springs(), *self._mounts(), *map(self._seat_spring, self.tables.seats))
        bars = self._bars()
        parts = tuple(spring.name for spring in springs) + tuple(bar.name for bar in bars)
        self._unique("springs, mounts, seats, anti_roll_bars", parts)
        vehicle = SpatialVehicle(
            name=self.file,
            bodies=tuple(self.bodies.values()),
            springs=springs,
            tyres=tuple(self.tyres.values()),
            axles=tuple(axle.x for axle in self.tables.axles),
            bars=bars,
            side_forces=self._side_forces(),
            drags=self._drags(),
            outputs=tuple(self._output(output, parts) for output in self.tables.outputs),
        )
        check(vehicle, self.file)
        return replace(vehicle, limits=self._limits(vehicle))

    def _limits(self, vehicle: SpatialVehicle) -> Limits:
        table = self.tables.reduced or ReducedTable()
        springs = tuple(spring.name for spring in vehicle.springs)
        known = tuple(" ".join(one) for one in vehicle.coordinates())
        for body in table.massless:
            self._body("reduced.massless", body)
        for spring in table.rigid:
            self._known("reduced.rigid", spring, "spring", springs)
        for pair in table.locked:
            self._known("reduced.locked", " ".join(pair), "freedom of a body", known)
        locked = frozenset(one for one in vehicle.coordinates() if list(one) in table.locked)
        return Limits(frozenset(table.massless), frozenset(table.rigid), locked)

    def _fault(self, place: str, value: Any, allowed: str, choices: Sequence[str] = ()) -> InputError:
        return InputError(self.file, place, value, allowed, tuple(choices))

    def _unique(self, table: str, names: Sequence[str], reserved: Sequence[str] = ()) -> None:
        for i, name in enumerate(names):
            if name in reserved:
                raise self._fault(_place(table, name, "name"), name, "this name means the ground: choose another")
            if name in names[:i]:
                raise self._fault(_place(table, name, "name"), name, "two entries have this name")

    def _known(self, place: str, name: str, kind: str, choices: Sequence[str]) -> str:
        if name not in choices:
            raise self._fault(place, name, f"no such {kind}", choices)
        return name

    def _body(self, place: str, name: str) -> str:
        return self._known(place, name, "body", tuple(self.bodies))

    def _bodies(self) -> dict[str, Body]:
        """Parents before their children, otherwise as the file has them, then the occupants of the seats."""
        waiting = {body.name: body for body in self.tables.bodies}
        names, done = tuple(waiting), dict[str, Body]()
        for body in self.tables.bodies:
            if body.parent is not None:
                self._known(_place("bodies", body.name, "parent"), body.parent, "body", names)
        while waiting:
            ready = next((b for b in waiting.values() if b.parent is None or b.parent in done), None)
            if ready is None:
                first = next(iter(waiting.values()))
                raise self._fault(_place("bodies", first.name, "parent"), first.parent, "bodies ride on one another")
            (xx, yy, zz), (xy, xz, yz) = ready.inertia, ready.products
            inertia = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
            at = _vector(ready.position)
            done[ready.name] = Body(ready.name, ready.mass, at, tuple(ready.freedoms), inertia, ready.parent)
            del waiting[ready.name]
        for seat in self.tables.seats:
            done[seat.name] = Body(seat.name, seat.mass, _vector(seat.position), ("z",))
        return done

    def _axles(self) -> dict[str, AxleTable]:
        """Axles by name: each behind the one before, and with a tyre."""
        for before, axle in pairwise(self.tables.axles):
            if axle.x >= before.x:
                allowed = f"axles are listed from the front: must lie behind {before.name!r}, below {before.x:g} m"
                raise self._fault(_place("axles", axle.name, "x"), axle.x, allowed)
        names = tuple(axle.name for axle in self.tables.axles)
        for tyre in self.tables.tyres:
            self._known(_place("tyres", tyre.name, "axle"), tyre.axle, "axle", names)
        for axle in self.tables.axles:
            if all(tyre.axle != axle.name for tyre in self.tables.tyres):
                raise self._fault(_place("axles", axle.name), None, "no tyre names this axle")
        return {axle.name: axle for axle in self.tables.axles}

    def _springs(self) -> list[SpringDamper]:
        return [self._spring(spring) for spring in self.tables.springs]

    def _spring(self, spring: SpringTable) -> SpringDamper:
        place = _place("springs", spring.name)
        one, two = self._ends(place, spring.bodies)
        points = self._points(place, spring)
        axis = self._axis(place, spring, points)
        acts = (spring.stiffness, spring.damping, spring.friction, spring.travel_force, spring.rate_force)
        if not any(acts):
            raise self._fault(f"{place}.stiffness", None, "is missing: neither spring, damper, curve nor friction")
        return SpringDamper(
            spring.name,
            one,
            two,
            *points,
            axis,
            spring.stiffness,
            spring.damping,
            self._curve(f"{place}.travel_force", spring.travel_force),
            self._curve(f"{place}.rate_force", spring.rate_force),
            spring.friction,
            spring.friction_rate,
        )

    def _ends(self, place: str, bodies: Sequence[str]) -> tuple[str, str | None]:
        """The two bodies, None for the ground."""
        one, two = bodies
        if one == two:
            raise self._fault(f"{place}.bodies", bodies, "connects a body with itself")
        if one == GROUND:
            raise self._fault(f"{place}.bodies", bodies, "name the ground second")
        self._body(f"{place}.bodies", one)
        return one, None if two == GROUND else self._body(f"{place}.bodies", two)

    def _points(self, place: str, spring: SpringTable) -> tuple[Vector, Vector]:
        if (spring.point is None) == (spring.points is None):
            raise self._fault(f"{place}.point", None, "give either point, the place of both ends, or points, both")
        one, two = (spring.point, spring.point) if spring.points is None else spring.points
        return _vector(one), _vector(two)

    def _axis(self, place: str, spring: SpringTable, points: tuple[Vector, Vector]) -> Vector:
        """Unit direction: as given, or from the second point to the first, or up."""
        if spring.direction is not None:
            return self._unit(f"{place}.direction", spring.direction)
        apart = np.subtract(*points)
        distance = float(np.linalg.norm(apart))
        return _vector(apart / distance) if distance else (0.0, 0.0, 1.0)

    def _unit(self, place: str, direction: Sequence[float]) -> Vector:
        length = float(np.linalg.norm(direction))
        if not length:
            raise self._fault(place, list(direction), "a direction needs a length")
        return _vector(np.array(direction) / length)

    def _curve(self, place: str, curve: CurveTable | None) -> Curve | None:
        if curve is None:
            return None
        if len(curve.at) != len(curve.force):
            raise self._fault(f"{place}.force", curve.force, f"must hold as many values as at, {len(curve.at)}")
        if any(after <= before for before, after in pairwise(curve.at)):
            raise self._fault(f"{place}.at", curve.at, "must rise from value to value")
        found = Curve(tuple(curve.at), tuple(curve.force))
        if abs(found(0.0)) > 1e-9 * max(map(abs, curve.force)):
            raise self._fault(f"{place}.force", found(0.0), "must be 0 N at 0: the design position is at rest")
        return found

    def _mounts(self) -> list[SpringDamper]:
        found = []
        for mount in self.tables.mounts:
            one, two = self._ends(_place("mounts", mount.name), mount.bodies)
            if not any(mount.stiffness) and not any(mount.damping):
                place = _place("mounts", mount.name, "stiffness")
                raise self._fault(place, mount.stiffness, "has neither spring nor damper")
            at = _vector(mount.point)
            for name, axis, k, c in zip("xyz", np.eye(3), mount.stiffness, mount.damping, strict=True):
                found.append(SpringDamper(f"{mount.name}.{name}", one, two, at, at, _vector(axis), k, c))
        return found

    def _seat_spring(self, seat: SeatTable) -> SpringDamper:
        """Carrier below, occupant above: turned round so that force is positive in compression."""
        carrier = self._body(_place("seats", seat.name, "body"), seat.body)
        at = _vector(seat.position)
        return SpringDamper(seat.name, seat.name, carrier, at, at, (0.0, 0.0, 1.0), seat.stiffness, seat.damping)

    def _tyres(self) -> list[Tyre]:
        order = tuple(self.axles)
        return [self._tyre(tyre, order) for tyre in self.tables.tyres]

    def _tyre(self, tyre: TyreTable, order: tuple[str, ...]) -> Tyre:
        place = _place("tyres", tyre.name)
        axle = self.axles[tyre.axle]
        x, y, z = self.bodies[self._body(f"{place}.body", tyre.body)].position
        if abs(x - axle.x) > 1e-9:
            allowed = f"its body lies at x = {x:g} m, its axle {axle.name!r} at {axle.x:g} m: they must agree"
            raise self._fault(f"{place}.axle", tyre.axle, allowed)
        at = (axle.x, y if tyre.y is None else tyre.y, z)
        return Tyre(tyre.name, tyre.body, at, order.index(tyre.axle), tyre.stiffness, tyre.damping)

    def _bars(self) -> tuple[AntiRollBar, ...]:
        found = []
        for bar in self.tables.anti_roll_bars:
            place = _place("anti_roll_bars", bar.name)
            body = self.bodies[self._body(f"{place}.body", bar.body)]
            if "rx" not in body.freedoms or body.parent is not None:
                raise self._fault(f"{place}.body", bar.body, "needs a body with the freedom rx and without a parent")
            left, right = (self.tyres[self._known(f"{place}.tyres", t, "tyre", tuple(self.tyres))] for t in bar.tyres)
            if left.axle != right.axle or left.point[1] <= right.point[1]:
                raise self._fault(f"{place}.tyres", bar.tyres, "must be the left and the right tyre of one axle")
            ends = (left.body, right.body, left.point, right.point)
            found.append(AntiRollBar(bar.name, bar.body, *ends, bar.stiffness, bar.damping))
        return tuple(found)

    def _side_forces(self) -> tuple[SideForce, ...]:
        rolling = [tyre for tyre in self.tables.tyres if tyre.cornering]
        steered = next((axle for axle in self.tables.axles if axle.roll_steer), None)
        if steered and not rolling:
            place = _place("axles", steered.name, "roll_steer")
            raise self._fault(place, steered.roll_steer, "steers nothing: no tyre has a cornering stiffness")
        if not rolling:
            return ()
        if self.tables.chassis is None:
            raise self._fault("chassis", None, f"is missing: tyre {rolling[0].name!r} has a side force")
        chassis = self._body("chassis", self.tables.chassis)
        return tuple(self._side_force(tyre, chassis) for tyre in rolling)

    def _side_force(self, tyre: TyreTable, chassis: str) -> SideForce:
        """On the chassis, which guides the wheel sideways."""
        (x, y, _), axle = self.tyres[tyre.name].point, self.axles[tyre.axle]
        if tyre.body != chassis and "y" in self.bodies[tyre.body].freedoms:
            allowed = f"its side force acts on the chassis: body {tyre.body!r} must not have the freedom y"
            raise self._fault(_place("tyres", tyre.name, "cornering"), tyre.cornering, allowed)
        return SideForce(tyre.name, chassis, (x, y, 0.0), chassis, tyre.cornering, axle.roll_steer)

    def _drags(self) -> tuple[Drag, ...]:
        drag = self.tables.drag
        return () if drag is None else (Drag(self._body("drag.body", drag.body), drag.coefficient),)

    def _output(self, output: OutputTable, parts: tuple[str, ...]) -> SpatialOutput:
        place, kind = _place("outputs", output.name), output.kind
        needed = "part" if kind in ("travel", "travel rate", "force") else "tyre" if "tyre" in kind else "body"
        foreign = {"part": "body point tyre", "tyre": "body point part", "body": "part tyre"}[needed].split()
        unused = [key for key in foreign if getattr(output, key) is not None]
        if unused:
            raise self._fault(f"{place}.{unused[0]}", getattr(output, unused[0]), f"{kind} is read of a {needed}")
        name = getattr(output, needed)
        if name is None:
            raise self._fault(f"{place}.{needed}", None, f"is missing: {kind} is read of a {needed}")
        known = {"part": parts, "tyre": tuple(self.tyres), "body": tuple(self.bodies)}[needed]
        self._known(f"{place}.{needed}", name, needed, known)
        if needed == "part":
            return PartOutput(output.name, kind, name)  # type: ignore[arg-type]
        if needed == "tyre":
            return TyreOutput(output.name, kind, name)  # type: ignore[arg-type]
        axis = self._unit(f"{place}.direction", output.direction)
        if kind.startswith("ang"):
            return TurnOutput(output.name, kind, name, axis)  # type: ignore[arg-type]
        point = self.bodies[name].position if output.point is None else _vector(output.point)
        return PointOutput(output.name, kind, name, point, axis)  # type: ignore[arg-type]


def _vector(values: Any) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
