"""Plausibility checks of pitch-plane vehicles, by the checks of the equivalent vehicle in space."""

from collections.abc import Sequence

from models.core.finding import Finding
from models.vehicles.pitch_plane import Parameters
from models.vehicles.plausible import plausible
from models.vehicles.spatial import Body, SpatialVehicle, SpringDamper, Tyre

UP = (0.0, 0.0, 1.0)


def plausible_plane(p: Parameters, accept: Sequence[str] = ()) -> tuple[Finding, ...]:
    """Findings on implausible values of a pitch-plane parameter set, as ``plausible`` gives them, under the parameters'
    symbols."""
    return plausible(equivalent_spatial_vehicle(p), accept)


def equivalent_spatial_vehicle(p: Parameters) -> SpatialVehicle:
    """Vehicle in space without width that is equivalent to a pitch-plane parameter set.

    Its wheels are 0.3 m and its chassis 0.6 m above the ground, which has no influence. Its parts have the names of the
    parameters.
    """
    chassis, still = "chassis: m3, I", ((0.0,) * 3,) * 3
    ends = (
        ("front", p.b, p.m1, p.k1, p.d1, p.k3, p.d3, "m1", "k1, d1", "k3, d3"),
        ("rear", -p.a, p.m2, p.k2, p.d2, p.k4, p.d4, "m2", "k2, d2", "k4, d4"),
    )
    bodies = [Body(chassis, p.m3, (0.0, 0.0, 0.6), ("z", "ry"), ((0.0,) * 3, (0.0, p.I, 0.0), (0.0,) * 3))]
    springs, tyres = list[SpringDamper](), list[Tyre]()
    for i, (end, x, mass, tyre, tyre_damper, spring, damper, m, kd_tyre, kd_spring) in enumerate(ends):
        wheel, at = f"{end} wheel: {m}", (x, 0.0, 0.3)
        bodies.append(Body(wheel, mass, at, ("z",), still))
        springs.append(SpringDamper(f"{end} suspension: {kd_spring}", chassis, wheel, at, at, UP, spring, damper))
        tyres.append(Tyre(f"{end} tyre: {kd_tyre}", wheel, at, i, tyre, tyre_damper))
    return SpatialVehicle("pitch plane", tuple(bodies), tuple(springs), tuple(tyres), (p.b, -p.a))
