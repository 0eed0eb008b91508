"""Plausibility checks of pitch-plane vehicles, by the checks of the equivalent vehicle in space."""

from collections.abc import Sequence

from models.core.finding import Finding
from models.vehicles.pitch_plane import PitchPlaneParameters
from models.vehicles.plausible import implausible_values
from models.vehicles.spatial import Body, SpatialVehicle, SpringDamper, Tyre

UP = (0.0, 0.0, 1.0)


def implausible_plane_values(
    parameters: PitchPlaneParameters, accepted_queries: Sequence[str] = ()
) -> tuple[Finding, ...]:
    """Findings on implausible values of a pitch-plane parameter set, as ``implausible_values`` gives them, under the
    parameters' symbols."""
    return implausible_values(equivalent_spatial_vehicle(parameters), accepted_queries)


def equivalent_spatial_vehicle(parameters: PitchPlaneParameters) -> SpatialVehicle:
    """Vehicle in space without width that is equivalent to a pitch-plane parameter set.

    Its wheels are 0.3 m and its chassis 0.6 m above the ground, which has no influence. Its parts have the names of the
    parameters.
    """
    chassis, still = "chassis: m3, I", ((0.0,) * 3,) * 3
    ends = (
        (
            "front",
            parameters.b,
            parameters.m1,
            parameters.k1,
            parameters.d1,
            parameters.k3,
            parameters.d3,
            "m1",
            "k1, d1",
            "k3, d3",
        ),
        (
            "rear",
            -parameters.a,
            parameters.m2,
            parameters.k2,
            parameters.d2,
            parameters.k4,
            parameters.d4,
            "m2",
            "k2, d2",
            "k4, d4",
        ),
    )
    bodies = [
        Body(chassis, parameters.m3, (0.0, 0.0, 0.6), ("z", "ry"), ((0.0,) * 3, (0.0, parameters.I, 0.0), (0.0,) * 3))
    ]
    springs, tyres = list[SpringDamper](), list[Tyre]()
    for i, (end, x, mass, tyre, tyre_damper, spring, damper, m, kd_tyre, kd_spring) in enumerate(ends):
        wheel, at = f"{end} wheel: {m}", (x, 0.0, 0.3)
        bodies.append(Body(wheel, mass, at, ("z",), still))
        springs.append(SpringDamper(f"{end} suspension: {kd_spring}", chassis, wheel, at, at, UP, spring, damper))
        tyres.append(Tyre(f"{end} tyre: {kd_tyre}", wheel, at, i, tyre, tyre_damper))
    return SpatialVehicle("pitch plane", tuple(bodies), tuple(springs), tuple(tyres), (parameters.b, -parameters.a))
