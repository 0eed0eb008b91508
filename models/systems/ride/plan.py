"""The plan of a scene of ride: printed by ``twinrig show``, checked before any run."""

from collections.abc import Iterator
from dataclasses import replace

from models.core.assumptions import assumption_lines
from models.core.errors import InputError
from models.core.finding import Finding
from models.core.scene_effects import effect_lines as effect_lines
from models.systems.ride.assumptions import assumptions
from models.systems.ride.of_scene import excitation_of, half_track_of, placed_wheels, road_of, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.linear_vehicle import WheelPosition
from models.vehicles.plausible import implausible_values
from models.vehicles.spatial import NO_LIMITS, SpatialVehicle
from models.vehicles.spatial_linear import linearise, wheels


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for a wrong vehicle or road, and for quantities or weightings that
    are not outputs of the vehicle.
    """
    vehicle = vehicle_of(scene)
    excitation_of(scene, wheels(vehicle))
    kinds = {output.name: output.kind for output in vehicle.outputs}
    weighted = tuple(f"{name} {weighting_name}" for name, weighting_name in scene.weighting.items())
    for i, name in enumerate(scene.quantities):
        if name not in (*kinds, *weighted):
            raise InputError(scene.file, f"quantities.{i}", name, "is no output of the vehicle", (*kinds, *weighted))
    for name in scene.weighting:
        if name not in kinds:
            raise InputError(scene.file, f"weighting.{name}", None, "is no output of the vehicle", tuple(kinds))
        if kinds[name] != "acceleration":
            allowed = f"weights accelerations, and this output is one of the kind {kinds[name]!r}"
            raise InputError(scene.file, f"weighting.{name}", scene.weighting[name], allowed)


def findings(scene: RideScene) -> tuple[Finding, ...]:
    """Returns doubts about implausible parameters of the vehicle, except parameters that the scene accepts."""
    return implausible_values(vehicle_of(scene), scene.vehicle.accept)


def describe(scene: RideScene) -> str:
    """Returns the plan of a ride scene as text: vehicle, freedoms, road, speeds, outputs, effects, assumptions."""
    vehicle = vehicle_of(scene)
    wheel_positions = wheels(vehicle)
    lines = [
        ("scene", f"{scene.file}, study {scene.study}"),
        ("vehicle", f"{vehicle.name} ({scene.vehicle.file}), {scene.vehicle.operating_point}"),
        *(("read", note) for note in vehicle.notes),
        *_vehicle_lines(vehicle),
        ("road", road_of(scene, wheel_positions).label(half_track_of(scene, wheel_positions))),
        *(("", text) for text in noise_sharing_text(scene, wheel_positions)),
        ("speed", _speed_text(scene)),
        ("outputs", ", ".join(output.name for output in vehicle.outputs)),
        (
            "weighting",
            ", ".join(f"{name} by {weighting_name}" for name, weighting_name in scene.weighting.items()) or "none",
        ),
    ]
    replaced = any(spring.is_nonlinear for spring in vehicle.springs) and not (
        vehicle.lifts or scene.vehicle.small_motion
    )
    assumed = assumption_lines(assumptions(scene, vehicle, gains_replace_curves=replaced))
    return "\n".join([scene.title, *(f"  {head:<10} {text}" for head, text in lines), *effect_lines(scene), *assumed])


LEFT_RIGHT_TEXTS = {
    "modelled": "every wheel meets z_M + y theta, one mean and one roll process for all",
    "uncorrelated": "the left wheels meet z_M + y theta, the right ones the same of a second, independent pair",
    "equal": "every wheel meets z_M + |y| theta, so that tracks of one distance do not roll it",
}
FRONT_REAR_TEXTS = {
    "delayed": "every axle meets what the first one met, its distance later",
    "uncorrelated": "every axle meets a road of its own",
    "equal": "every axle meets what the first one meets, at once",
}


def noise_sharing_text(scene: RideScene, wheel_positions: tuple[WheelPosition, ...]) -> tuple[str, str]:
    """Texts on the correlation of the road under left and right wheels, and under the axles."""
    road, placed = scene.road, placed_wheels(scene, wheel_positions)
    y_text = "its own place" if road.wheels == "own" else "that of the front wheel on its side"
    if len({wheel.y for wheel in placed}) == 1:
        y_text = f"{placed[0].y:g} m for all: one track"
    return (
        f"left and right {road.left_right}: {LEFT_RIGHT_TEXTS[road.left_right]}; y is {y_text}",
        f"axles {road.front_rear}: {FRONT_REAR_TEXTS[road.front_rear]}",
    )


def _vehicle_lines(vehicle: SpatialVehicle) -> Iterator[tuple[str, str]]:
    """Yields lines (heading, text) on each body, on the elements, on the degrees of freedom and, unless they depend on
    the speed, on their natural frequencies.
    """
    for body in vehicle.bodies:
        on = f" on {body.parent}" if body.parent else ""
        yield "  body", f"{body.name:<12} {body.mass:g} kg, {' '.join(body.freedoms)}{on}"
    parts = (len(vehicle.springs) + len(vehicle.joint_elements), len(vehicle.bars), len(vehicle.tyres))
    yield "  parts", "{} spring-dampers, {} anti-roll bars, {} tyres".format(*parts)
    frequencies = "frequencies depend on the speed"
    if not (vehicle.side_forces or vehicle.drags):
        frequencies = f"undamped {', '.join(f'{f:.3g}' for f in undamped_frequencies(vehicle))} Hz"
    yield "freedoms", f"{len(vehicle.coordinates())}, {frequencies}"
    yield from (("question", text) for text in frequency_doubts(vehicle))


def undamped_frequencies(vehicle: SpatialVehicle) -> list[float]:
    """Natural frequencies (Hz) of the vehicle without damping, side forces and drag, rising; 0 for motions without a
    restoring force.
    """
    import numpy as np
    from scipy.linalg import eigvalsh

    linear = linearise(replace(vehicle, side_forces=(), drags=(), limits=NO_LIMITS))
    squares = eigvalsh((linear.stiffness + linear.stiffness.T) / 2, linear.mass)
    return [float(f) for f in np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)]


USUAL_FREQUENCIES = (0.2, 500.0)
"""Lowest and highest natural frequency (Hz) of road vehicles, from a soft body to the stiffest mount."""
LARGEST_FREE_FREQUENCY = 1e-4
"""Frequency (Hz) below which a motion counts as free of restoring forces."""


def frequency_doubts(vehicle: SpatialVehicle) -> list[str]:
    """Returns a question as text where the vehicle has natural frequencies that no road vehicle has, as with values
    that are not in SI units.
    """
    odd = [
        f
        for f in undamped_frequencies(vehicle)
        if f > LARGEST_FREE_FREQUENCY and not USUAL_FREQUENCIES[0] <= f <= USUAL_FREQUENCIES[1]
    ]
    if not odd:
        return []
    listed = ", ".join(f"{f:.3g}" for f in odd[:4])
    return [
        f"is every value in SI units (kg, m, N/m)? Without damping the vehicle has frequencies of {listed} Hz; "
        f"those of road vehicles lie from {USUAL_FREQUENCIES[0]:g} to {USUAL_FREQUENCIES[1]:g} Hz"
    ]


def _speed_text(scene: RideScene) -> str:
    if scene.drive is not None:
        points = zip(scene.drive.time, scene.drive.speed, strict=True)
        return ", ".join(f"{speed:g} m/s at {time:g} s" for time, speed in points) + ", straight between"
    assert scene.speeds is not None
    values = scene.speeds.all()
    return f"{len(values)} from {values.min():g} to {values.max():g} m/s"
