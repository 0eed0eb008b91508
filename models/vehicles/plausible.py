"""Plausibility checks of a vehicle: a mass in tonnes, springs in N/mm, a strut far from its wheel, a wheel without a
strut.

Nothing here refuses: each finding names the entry, its value and what is usual, as the units of a file are named. Only
what is far from every vehicle on wheels is queried, from a quarter of a small car to a loaded truck; a vehicle that is
meant so is run as it is.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.vehicles.kinematics import Kinematics
from models.vehicles.spatial import Body, SpatialVehicle, SpringDamper, Tyre
from models.vehicles.spatial_linear import design_mass_matrix, slopes_at_rest, static_preloads, static_stiffness

GRAVITY = 9.81
USUAL_MASS = 30.0, 60e3
"""Usual range of the mass (kg) of the whole vehicle."""
LEAST_SPRUNG_RATIO = 0.7
"""Smallest usual ratio of sprung to unsprung mass: that of the axle of an empty trailer."""
LEAST_AXLE_SHARE = 0.03
"""Smallest usual share of the weight on an axle, where there are several."""
LARGEST_WHEEL_RATIO = 3.0
"""Largest usual ratio of load, or stiffness, between the wheels of an axle."""
USUAL_BOUNCE_FREQUENCY = 0.5, 6.0
"""Usual range of the bounce frequency (Hz) of the vehicle on springs and tyres, from its static deflection."""
USUAL_HOP_FREQUENCY = 3.0, 60.0
"""Usual range of the hop frequency (Hz) of a wheel or an axle between road and body."""
USUAL_DAMPING_RATIO = 0.005, 5.0
"""Usual range of the damping ratio of a damper beside its spring under its static load."""
USUAL_TYRE_DEFLECTION = 5e-4, 0.25
"""Usual range of the deflection (m) of a tyre under its static load."""
FARTHEST_STRUT = 0.7
"""Largest usual distance (m) from a strut to its wheel sideways or along, beyond the track of a rigid axle: levers
bring it inwards."""
USUAL_WHEELBASE = 0.5, 25.0
USUAL_TRACK = 0.3, 4.0
LARGEST_HEIGHT = 5.0
"""Largest usual height (m) of a centre of mass above the ground."""
USUAL_GYRATION_RATIOS = {"rx": (0.15, 1.5), "ry": (0.12, 1.2), "rz": (0.12, 1.2)}
"""Usual ranges of the ratio of the sprung body's radius of gyration to the track in roll, and to the wheelbase in pitch
and yaw."""
LEAST_VERTICAL_COMPONENT = 0.3
"""Smallest vertical component of a spring's direction with which the spring counts as carrying weight."""


@dataclass(frozen=True)
class VehicleFigures:
    """Quantities of a vehicle that several plausibility checks use."""

    vehicle: SpatialVehicle

    @cached_property
    def wheels(self) -> dict[str, tuple[Tyre, ...]]:
        """Unsprung bodies, those that carry tyres, by name, with their tyres; empty if all bodies carry tyres."""
        names = dict.fromkeys(tyre.body for tyre in self.vehicle.tyres)
        tyres_of = {name: tuple(t for t in self.vehicle.tyres if t.body == name) for name in names}
        return tyres_of if len(tyres_of) < len(self.vehicle.bodies) else {}

    @cached_property
    def sprung_body(self) -> Body:
        """The sprung body: the heaviest body that carries no tyre."""
        return max((b for b in self.vehicle.bodies if b.name not in self.wheels), key=lambda body: body.mass)

    @cached_property
    def total_mass(self) -> float:
        """Mass of the whole vehicle, kg."""
        return sum(body.mass for body in self.vehicle.bodies)

    @cached_property
    def static_forces(self) -> dict[str, float]:
        """Static forces of all tyres, springs and bars, N; InputError if a weight is not supported."""
        preloaded = static_preloads(replace(self.vehicle, gravity=GRAVITY))
        return preloaded.parts | preloaded.tyres

    @cached_property
    def wheelbase(self) -> float:
        """Wheelbase of the vehicle, m; 0 for a single axle."""
        return max(self.vehicle.axles) - min(self.vehicle.axles)

    @cached_property
    def track(self) -> float:
        """Largest track width of the vehicle, m; 0 for a vehicle without width."""
        return float(np.ptp([tyre.point[1] for tyre in self.vehicle.tyres]))

    def struts(self, wheel: str) -> list[SpringDamper]:
        """Nearly vertical springs and dampers between a wheel or an axle and another body."""
        return [
            s
            for s in self.vehicle.springs
            if s.second_body is not None
            and wheel in (s.first_body, s.second_body)
            and abs(s.axis[2]) > LEAST_VERTICAL_COMPONENT
        ]

    def has_joint_elements(self, wheel: str) -> bool:
        """Whether a joint element acts on a wheel or an axle."""
        chain = self.vehicle.chain(wheel)
        return any(e.stiffness and body in chain for e in self.vehicle.joint_elements for body, _ in e.coordinates)


def implausible_values(vehicle: SpatialVehicle, accepted_queries: Sequence[str] = ()) -> tuple[Finding, ...]:
    """Findings on implausible values of a vehicle, in SI units, without those that the user has accepted; empty for an
    ordinary vehicle."""
    whole = VehicleFigures(vehicle)
    queries = (
        query
        for look in (_mass_findings, _size_findings, _inertia_findings, _strut_findings, _static_findings)
        for query in look(whole)
    )
    return tuple(query for query in queries if query.check not in accepted_queries)


def _finding(check_name: str, entry_name: str, query_text: str, size_of_doubt: float, unit: str) -> Finding:
    return Finding(check_name, "doubt", entry_name, f"{entry_name}: {query_text}.", size_of_doubt, unit)


def _is_unusual(value: float, usual_range: tuple[float, float]) -> bool:
    return not usual_range[0] <= value <= usual_range[1]


def _mass_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    if _is_unusual(vehicle_figures.total_mass, USUAL_MASS):
        yield _finding(
            "mass",
            "mass of the vehicle",
            f"{vehicle_figures.total_mass:.4g} kg; usual are {USUAL_MASS[0]:g} to {USUAL_MASS[1]:g} kg. "
            f"{_text_in_tonnes(vehicle_figures.total_mass)}",
            vehicle_figures.total_mass,
            "kg",
        )
    unsprung = sum(vehicle_figures.vehicle.body(name).mass for name in vehicle_figures.wheels)
    if (
        vehicle_figures.wheels
        and not _is_unusual(vehicle_figures.total_mass, USUAL_MASS)
        and vehicle_figures.total_mass - unsprung < LEAST_SPRUNG_RATIO * unsprung
    ):
        yield _finding(
            "mass",
            f"bodies[{vehicle_figures.sprung_body.name}].mass",
            f"{vehicle_figures.sprung_body.mass:.4g} kg; all that is carried "
            f"weighs {vehicle_figures.total_mass - unsprung:.4g} kg, wheels and axles {unsprung:.4g} kg. "
            f"{_text_in_tonnes(vehicle_figures.sprung_body.mass)}",
            vehicle_figures.sprung_body.mass,
            "kg",
        )


def _text_in_tonnes(mass_in_kg: float) -> str:
    return "Masses are in kg, not in tonnes" if mass_in_kg < 100 else "Masses are in kg, not in g or lb"


def _size_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    metres = "Lengths are in m, not in mm"
    for name, value, usual in (
        ("wheelbase", vehicle_figures.wheelbase, USUAL_WHEELBASE),
        ("track", vehicle_figures.track, USUAL_TRACK),
    ):
        if value and _is_unusual(value, usual):
            yield _finding(
                "size", name, f"{value:.4g} m; usual are {usual[0]:g} to {usual[1]:g} m. {metres}", value, "m"
            )
    for body in vehicle_figures.vehicle.bodies:
        if _is_unusual(body.position[2], (-0.01, LARGEST_HEIGHT)):
            yield _finding(
                "size",
                f"bodies[{body.name}].position",
                f"{body.position[2]:.4g} m above the ground; usual are 0 to {LARGEST_HEIGHT:g} m. {metres}",
                body.position[2],
                "m",
            )


def _inertia_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    """Findings on the inertia of the sprung body (radii of gyration) and on tensors that would need negative mass."""
    body, spans = (
        vehicle_figures.sprung_body,
        {"rx": vehicle_figures.track, "ry": vehicle_figures.wheelbase, "rz": vehicle_figures.wheelbase},
    )
    about = dict(zip(USUAL_GYRATION_RATIOS, np.diag(body.inertia).tolist(), strict=True))
    for freedom, usual in USUAL_GYRATION_RATIOS.items():
        span, inertia = spans[freedom], about[freedom]
        radius = (inertia / body.mass) ** 0.5
        if span and freedom in body.freedoms and inertia and _is_unusual(radius / span, usual):
            yield _finding(
                "inertia",
                f"bodies[{body.name}].inertia",
                f"{inertia:.4g} kg m^2 about {freedom[1]} is a radius "
                f"of gyration of {radius:.3g} m, {radius / span:.2g} of the "
                f"{'track' if freedom == 'rx' else 'wheelbase'}; usual are {usual[0]:g} to {usual[1]:g}",
                inertia,
                "kg m^2",
            )
    for each in vehicle_figures.vehicle.bodies:
        low, middle, high = sorted(np.diag(each.inertia).tolist())
        if low > 0 and high > 1.05 * (low + middle):
            yield _finding(
                "inertia",
                f"bodies[{each.name}].inertia",
                f"{high:.4g} kg m^2 about one axis is more than "
                f"the sum of the other two, {low + middle:.4g}, which no body has",
                high,
                "kg m^2",
            )


def _strut_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    """Findings on wheels without a strut, and on struts far from their wheels."""
    for wheel, tyres in vehicle_figures.wheels.items():
        struts = vehicle_figures.struts(wheel)
        if vehicle_figures.has_joint_elements(wheel):
            continue
        if not any(slopes_at_rest(strut)[0] for strut in struts) and wheel != vehicle_figures.sprung_body.name:
            kind = "damper alone" if struts else "strut"
            yield _finding(
                "strut",
                f"bodies[{wheel}]",
                f"{'a' if struts else 'no'} {kind} holds the body up on it: a spring between them is missing",
                float(len(struts)),
                "1",
            )
        for strut in struts:
            apart = _distance_from_wheel(strut, wheel, tyres)
            if apart > FARTHEST_STRUT:
                point = strut.first_point if strut.first_body == wheel else strut.second_point
                yield _finding(
                    "strut",
                    f"springs[{strut.name}]",
                    f"its point {[round(x, 4) for x in point]} lies "
                    f"{apart:.3g} m from the wheel or axle {wheel!r}; usual are at most {FARTHEST_STRUT:g} m",
                    apart,
                    "m",
                )


def _distance_from_wheel(strut: SpringDamper, wheel: str, tyres: tuple[Tyre, ...]) -> float:
    """Horizontal distance (m) of a strut's end on a wheel from the line between the wheel's tyres."""
    x, y, _ = strut.first_point if strut.first_body == wheel else strut.second_point
    beside = [tyre.point[1] for tyre in tyres]
    return float(np.hypot(x - tyres[0].point[0], max(min(beside) - y, y - max(beside), 0.0)))


def _static_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    """Findings on static loads and the values that follow from them; empty if masses or lengths are already
    implausible."""
    if any(_mass_findings(vehicle_figures)) or any(_size_findings(vehicle_figures)):
        return
    try:
        vehicle_figures.static_forces  # noqa: B018
    except InputError as error:
        yield _finding("load", error.place, error.allowed, 0.0, "N")
        return
    yield from _wheel_load_findings(vehicle_figures)
    yield from _frequency_findings(vehicle_figures)
    yield from _damping_findings(vehicle_figures)


def _wheel_load_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    weight, axles = vehicle_figures.total_mass * GRAVITY, dict[int, list[Tyre]]()
    for tyre in vehicle_figures.vehicle.tyres:
        axles.setdefault(tyre.axle, []).append(tyre)
        if vehicle_figures.static_forces[tyre.name] < 0:
            yield _finding(
                "load",
                f"tyres[{tyre.name}]",
                f"its static load is {vehicle_figures.static_forces[tyre.name]:.4g} N: the wheel "
                "pulls on the road. The centre of mass lies beyond the axles, or an axle at a wrong place",
                vehicle_figures.static_forces[tyre.name],
                "N",
            )
    for tyres in axles.values():
        loads = [vehicle_figures.static_forces[tyre.name] for tyre in tyres]
        names = " and ".join(tyre.name for tyre in tyres)
        if len(axles) > 1 and 0 <= sum(loads) < LEAST_AXLE_SHARE * weight:
            yield _finding(
                "load",
                f"tyres[{names}]",
                f"carry {sum(loads):.4g} N of {weight:.4g} N, "
                f"{sum(loads) / weight:.1%}; usual are at least {LEAST_AXLE_SHARE:.0%} on an axle",
                sum(loads),
                "N",
            )
        for what, unit, values in (("load", "N", loads), ("stiffness", "N/m", [tyre.stiffness for tyre in tyres])):
            if min(values) >= 0 and max(values) > LARGEST_WHEEL_RATIO * min(values):
                yield _finding(
                    what,
                    f"tyres[{names}]",
                    f"the {what}s {min(values):.4g} and {max(values):.4g} {unit} of one "
                    f"axle differ by more than {LARGEST_WHEEL_RATIO:g} times",
                    max(values) / max(min(values), 1e-300),
                    "1",
                )


def _frequency_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    """Findings on the frequencies of the sprung body, from its static deflection, and of each wheel between road and
    body, and on the tyres' static deflections."""
    remedy = "Stiffness is in N/m, not in N/mm, mass in kg, not in tonnes"
    sunk = _static_deflection(vehicle_figures)
    bounce = (GRAVITY / sunk) ** 0.5 / (2 * np.pi) if sunk > 0 else float("inf")
    if _is_unusual(bounce, USUAL_BOUNCE_FREQUENCY):
        yield _finding(
            "frequency",
            f"bodies[{vehicle_figures.sprung_body.name}]",
            f"sinks {sunk:.4g} m under the vehicle's weight, a "
            f"natural frequency of {bounce:.3g} Hz; usual are {USUAL_BOUNCE_FREQUENCY[0]:g} to "
            f"{USUAL_BOUNCE_FREQUENCY[1]:g} Hz. {remedy}",
            bounce,
            "Hz",
        )
    for wheel in vehicle_figures.wheels:
        hop = _hop_frequency(vehicle_figures, wheel)
        if hop is not None and _is_unusual(hop, USUAL_HOP_FREQUENCY):
            yield _finding(
                "frequency",
                f"bodies[{wheel}]",
                f"between road and body it hops at {hop:.3g} Hz; usual are {USUAL_HOP_FREQUENCY[0]:g} to "
                f"{USUAL_HOP_FREQUENCY[1]:g} Hz. {remedy}",
                hop,
                "Hz",
            )
    for tyre in vehicle_figures.vehicle.tyres:
        pressed = vehicle_figures.static_forces[tyre.name] / tyre.stiffness
        if pressed > 0 and _is_unusual(pressed, USUAL_TYRE_DEFLECTION):
            yield _finding(
                "frequency",
                f"tyres[{tyre.name}].stiffness",
                f"{tyre.stiffness:.4g} N/m gives way by "
                f"{pressed:.3g} m under {vehicle_figures.static_forces[tyre.name]:.4g} N; usual are "
                f"{USUAL_TYRE_DEFLECTION[0]:g} to "
                f"{USUAL_TYRE_DEFLECTION[1]:g} m. {remedy}",
                pressed,
                "m",
            )


def _static_deflection(vehicle_figures: VehicleFigures) -> float:
    """Static deflection (m) of the sprung body under the weights, with springs and tyres in series."""
    vehicle, motion = vehicle_figures.vehicle, Kinematics(vehicle_figures.vehicle)
    stiffness = static_stiffness(replace(vehicle, bars=()), motion)  # bars carry no weight
    weights = sum(body.mass * GRAVITY * motion.shift(body.name, body.position)[2] for body in vehicle.bodies)
    moved = np.linalg.lstsq(stiffness, np.asarray(weights), rcond=1e-12)[0]
    return float(motion.shift(vehicle_figures.sprung_body.name, vehicle_figures.sprung_body.position)[2] @ moved)


def _hop_frequency(vehicle_figures: VehicleFigures, wheel: str) -> float | None:
    """Natural frequency (Hz) of the vertical motion of a wheel or an axle with all other bodies fixed; None if it
    cannot move so."""
    vehicle, motion = vehicle_figures.vehicle, Kinematics(vehicle_figures.vehicle)
    row = motion.coordinate(wheel, "z")
    if not row.any() or wheel == vehicle_figures.sprung_body.name:
        return None
    stiffness = static_stiffness(replace(vehicle, bars=()), motion)
    return float(np.sqrt((row @ stiffness @ row) / (row @ design_mass_matrix(vehicle) @ row)) / (2 * np.pi))


def _damping_findings(vehicle_figures: VehicleFigures) -> Iterator[Finding]:
    """Findings on the damping ratios of struts with the mass that rests on them."""
    struts = {strut.name: strut for wheel in vehicle_figures.wheels for strut in vehicle_figures.struts(wheel)}
    for name, strut in struts.items():
        stiffness, load = slopes_at_rest(strut)[0], vehicle_figures.static_forces[name]
        if not (strut.damping and stiffness > 0 and load > 0):
            continue
        share = strut.damping / (2 * (stiffness * load / GRAVITY) ** 0.5)
        if _is_unusual(share, USUAL_DAMPING_RATIO):
            yield _finding(
                "damping",
                f"springs[{name}].damping",
                f"{strut.damping:.4g} N s/m is {share:.2g} of the "
                f"critical damping of what rests on it; usual are {USUAL_DAMPING_RATIO[0]:g} to "
                f"{USUAL_DAMPING_RATIO[1]:g}. Damping "
                "is in N s/m, not in N s/mm",
                share,
                "1",
            )
