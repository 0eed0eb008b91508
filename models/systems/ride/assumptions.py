"""Assumptions of a ride. Where no values over time are known they are Gaussian, and checked at three standard
deviations.

Linear vehicles have tyres that could pull, springs without stops and unlimited angles. Spectra of roads are known for a
range of wavelengths, and force curves within their tables.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from models.core.assumptions import Assumption, GaussianValues, Watched
from models.core.result import Result
from models.systems.ride.scene import RideScene
from models.systems.ride.watched import GRAVITY, ROTATION_AXES, WatchedMotion, static_loads
from models.vehicles.kinematics import Kinematics
from models.vehicles.spatial import NO_LIMITS, Curve, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import linearise

SMALL_ANGLE = 0.3
"""Largest angle (rad) of a body in linear equations: it differs from its sine by 1.5 %."""
LARGEST_TRAVEL = 0.1
"""Usual travel (m) at which suspensions of road vehicles meet a stop."""
LARGEST_SLIP_ANGLE = 0.07
"""Largest slip angle (rad, 4 degrees) up to which side forces of tyres grow in proportion to it."""
PULL_LIMIT = 1.0
"""Largest pull (N) of a tyre at the road that does not count as leaving the road."""
SHORTEST_WAVE, LONGEST_WAVE = 0.1, 100.0
"""Shortest and longest wave (m) of standard road spectra (ISO 8608: 0.01 to 10 cycles/m); a contact patch averages out
shorter waves.
"""
LEFT_OUT_SHARE = 0.1
"""Largest share of an output's variance that gains may neglect: beyond, its distribution is not Gaussian any more."""
RUN_IN_TIME_TEXT = "use the study ride_nonlinear"
LEAST_UPRIGHT_COSINE = 0.7
"""Least cosine between a spring's direction and the vertical at which the spring counts as a suspension."""


def assumptions(
    scene: RideScene,
    vehicle: SpatialVehicle,
    watched_motion: WatchedMotion | None = None,
    gains_replace_curves: bool = False,
) -> list[Assumption]:
    """Assumptions of the vehicle and road of a ride scene; ``watched_motion`` : of a run, on which they are checked,
    None to list them only.

    gains_replace_curves : whether statistical linearisation replaces nonlinear springs by gains.
    """

    def values_of(motion_name: str) -> np.ndarray | GaussianValues:
        assert watched_motion is not None
        return watched_motion.motion_of_part(motion_name)

    assumptions_of_vehicle = [
        *_tyre_assumptions(vehicle, values_of),
        *_angle_assumptions(vehicle, values_of),
        *_slip_assumptions(vehicle, values_of),
    ]
    for spring in vehicle.springs:
        assumptions_of_vehicle += (
            _curve_assumptions(scene, spring, values_of)
            if spring.is_nonlinear
            else _travel_assumptions(scene, vehicle, spring, values_of)
        )
    assumptions_of_vehicle += [*_wave_assumptions(scene, vehicle), *_seat_assumptions(scene)]
    return [*assumptions_of_vehicle, *([NEARLY_GAUSSIAN] if gains_replace_curves else [])]


ValuesByName = Callable[[str], np.ndarray | GaussianValues]


def _tyre_assumptions(vehicle: SpatialVehicle, values_of_motion: ValuesByName) -> Iterator[Assumption]:
    loads = static_loads(vehicle)
    if not loads or vehicle.lifts:
        return

    def watched(run_result: Result) -> Watched:
        return {
            f"tyre {name}": _with_static_load(values_of_motion(f"load {name}"), load) for name, load in loads.items()
        }

    remedy = f'{RUN_IN_TIME_TEXT} with [effects.lift_off] and vehicle.operating_point = "loaded", whose tyres only push'
    yield Assumption("tyres press", "linear tyres stay on the road", remedy, watched, "N", lower_limit=-PULL_LIMIT)


def _with_static_load(dynamic_loads: np.ndarray | GaussianValues, static_load: float) -> np.ndarray | GaussianValues:
    """Dynamic tyre loads (N) with the static load (N) added."""
    return (
        replace(dynamic_loads, mean=dynamic_loads.mean + static_load)
        if isinstance(dynamic_loads, GaussianValues)
        else dynamic_loads + static_load
    )


def _angle_assumptions(vehicle: SpatialVehicle, values_of_motion: ValuesByName) -> Iterator[Assumption]:
    turning = [(body.name, f) for body in vehicle.bodies for f in body.freedoms if f in ROTATION_AXES]
    if turning:
        names = {"rx": "roll", "ry": "pitch", "rz": "yaw"}
        yield Assumption(
            "small angles",
            "bodies turn so little that sines are angles",
            "take a smoother road or a slower speed: ride is small motion",
            lambda run: {f"{names[f]} of {body}": values_of_motion(f"{f} {body}") for body, f in turning},
            "rad",
            -SMALL_ANGLE,
            SMALL_ANGLE,
        )


def _slip_assumptions(vehicle: SpatialVehicle, values_of_motion: ValuesByName) -> Iterator[Assumption]:
    if vehicle.side_forces:
        yield Assumption(
            "small slip",
            "side forces of tyres grow in proportion to slip angles",
            "use the system handling, whose tyres saturate",
            lambda run: {
                f"side force {force.name}": values_of_motion(f"slip {force.name}") for force in vehicle.side_forces
            },
            "rad",
            -LARGEST_SLIP_ANGLE,
            LARGEST_SLIP_ANGLE,
        )


def _travel_assumptions(
    scene: RideScene, vehicle: SpatialVehicle, spring: SpringDamper, values_of_motion: ValuesByName
) -> Iterator[Assumption]:
    """Assumption that the linear spring between a wheel and the body above stays within its free travel."""
    wheels = {tyre.body for tyre in vehicle.tyres}
    ends = {spring.first_body, spring.second_body}
    if abs(spring.axis[2]) < LEAST_UPRIGHT_COSINE or None in ends or not ends & wheels:
        return
    free = float(scene.options.get("free_travel") or LARGEST_TRAVEL)
    yield Assumption(
        f"free travel of {spring.name}",
        f"the suspension {spring.name} meets no stop",
        f"give its spring in the vehicle file a travel_force with stops, and {RUN_IN_TIME_TEXT}",
        lambda run: {spring.name: values_of_motion(f"travel {spring.name}")},
        "m",
        -free,
        free,
    )


def _curve_assumptions(scene: RideScene, spring: SpringDamper, values_of_motion: ValuesByName) -> Iterator[Assumption]:
    """Assumptions that travel and rate of a nonlinear spring stay within its curves' tables, or within their linear
    range about rest where slopes at rest are used.
    """
    for kind, curve, unit in (("travel", spring.travel_force, "m"), ("rate", spring.rate_force, "m/s")):
        friction = spring.friction and kind == "rate" and scene.vehicle.small_motion
        if curve is None and not friction:
            continue
        low, high = _curve_range(curve, scene.vehicle.small_motion)
        if friction:
            low, high = max(low, -spring.friction_rate), min(high, spring.friction_rate)
        straight = (
            f"{kind}s of {spring.name} stay where its slopes at rest stand for its curves",
            f"leave out vehicle.small_motion and {RUN_IN_TIME_TEXT}",
        )
        table = (
            f"{kind}s of {spring.name} stay within the table of its curve",
            f"give its {kind}_force in the vehicle file points further out",
        )
        says, remedy = straight if scene.vehicle.small_motion else table
        yield Assumption(
            f"{kind} of {spring.name}",
            says,
            remedy,
            lambda run, name=f"{kind} {spring.name}": {spring.name: values_of_motion(name)},  # type: ignore[misc]
            unit,
            low,
            high,
        )


def _curve_range(force_curve: Curve | None, small_motion: bool) -> tuple[float, float]:
    """Lowest and highest argument of a curve's table or, for small motion, of its linear range about rest."""
    if force_curve is None:
        return -np.inf, np.inf
    curve_arguments = np.array(force_curve.arguments)
    if not small_motion:
        return float(curve_arguments[0]), float(curve_arguments[-1])
    _, _, corners, bends = force_curve.hinges()
    bent = np.array(corners)[np.array(bends) != 0.0] if corners else np.zeros(0)
    if (bent == 0.0).any():  # no slope at rest stands for a corner at rest, however small the motion is
        return 0.0, 0.0
    return float(max(bent[bent < 0.0], default=-np.inf)), float(min(bent[bent > 0.0], default=np.inf))


def _wave_assumptions(scene: RideScene, vehicle: SpatialVehicle) -> Iterator[Assumption]:
    """Assumptions that the road waves that excite wheels and body have wavelengths for which spectra of roads are
    known. Slow speeds count at constant speeds only, as a drive is slow only at its start.
    """
    if scene.road.file is not None or vehicle.limits:
        return
    hop, bounce = tyre_mode_frequencies(vehicle)
    speeds = scene.speeds.all() if scene.speeds is not None else np.array(scene.drive.speed if scene.drive else [0.0])
    slow, fast = float(speeds.min()), float(speeds.max())

    def watched(run_result: Result) -> Watched:
        wheels = {f"the wheels at {slow:g} m/s": np.array([slow / hop])} if hop and scene.speeds is not None else {}
        body = {f"the body at {fast:g} m/s": np.array([fast / bounce])} if bounce else {}
        return wheels | body

    if hop or bounce:
        least_text = f"from {SHORTEST_WAVE * hop:.2g} " if hop else ""
        yield Assumption(
            "waves of the road",
            "waves that swing wheels and body are as long as those of which spectra of roads are known",
            f"take speeds {least_text}to {LONGEST_WAVE * bounce:.2g} m/s, or a measured road",
            watched,
            "m",
            SHORTEST_WAVE,
            LONGEST_WAVE,
        )


def tyre_mode_frequencies(vehicle: SpatialVehicle) -> tuple[float, float]:
    """Highest natural frequency (Hz) of motions that deform mostly the tyres, 0 if there are none, and lowest natural
    frequency (Hz) of all oscillations, infinite if there are none.
    """
    still = replace(vehicle, side_forces=(), drags=(), limits=NO_LIMITS, gravity=0.0)
    linear, motion = linearise(still), Kinematics(still)
    squares, shapes = eigh((linear.stiffness + linear.stiffness.T) / 2, linear.mass)
    rows = np.array([motion.shift(tyre.body, tyre.point)[2] for tyre in vehicle.tyres])
    energy = np.array([tyre.stiffness for tyre in vehicle.tyres]) @ (rows @ shapes) ** 2
    swinging = squares > 1e-8 * squares.max()
    frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    hop = frequencies[swinging & (energy > 0.5 * squares)]
    return float(hop.max(initial=0.0)), float(frequencies[swinging].min(initial=np.inf))


def _seat_assumptions(scene: RideScene) -> Iterator[Assumption]:
    """Assumption that people stay on their seats, for vertical accelerations weighted by ISO 2631-1 (Wk): they stay
    above -g.
    """
    people = [name for name, weighting_name in scene.weighting.items() if weighting_name == "Wk"]
    if not people:
        return

    def watched(run_result: Result) -> Watched:
        outputs, deviation = run_result["output"].tolist(), run_result["deviation"]
        if deviation.ndim == 3:
            deviation = deviation[0]
        rows = [f"at {speed:g} m/s" for speed in run_result["speed"]] if "speed" in run_result.data.coords else []
        deviations = {name: deviation[:, outputs.index(name)] for name in people if name in outputs}
        return {name: GaussianValues(np.zeros(len(values)), values, rows) for name, values in deviations.items()}

    yield Assumption(
        "people stay seated",
        "seats press on those who sit on them",
        "take a smoother road or a slower speed: no effect lets them leave the seat",
        watched,
        "m/s^2",
        lower_limit=-GRAVITY,
    )


NEARLY_GAUSSIAN = Assumption(
    "nearly Gaussian",
    "the part of nonlinear spring forces that equivalent gains neglect is a small share of an output's variance",
    "take the deviations of the copies (options.beside), or engines in time",
    lambda run: {
        f"{name} at {speed:g} m/s": np.array([share])
        for share, name, speed in sorted(
            (
                (float(share), str(name), float(speed))
                for speed, row in zip(run["speed"], run["left_out"], strict=True)
                for name, share in zip(run["output"], row, strict=True)
            ),
            reverse=True,
        )
    },
    "",
    upper_limit=LEFT_OUT_SHARE,
)
