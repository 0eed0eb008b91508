"""Assumptions of a vehicle driven by hub forces, and of the virtual measurement of hub forces."""

from collections.abc import Callable

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.engines.cut_vehicle import TUMBLED_PITCH
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.measurement import MeasuredAngles, element_travels
from models.systems.hub_forces.scene import HubScene, TwoTrackRoadTable
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle

_SMOOTHER_ROAD_ADVICE = (
    "take a smoother road.iso8608, a lower road.speed, stiffer springs, or give them a stop as travel_force"
)
RUN_ON_TYRES = "on tyres"
"""Name that stands for the run on the road (virtual measurement) where otherwise a stabiliser is named."""
PULL_LIMIT = 1.0
"""Largest pull (N) of a tyre at the road that does not count as leaving the road."""
LARGEST_SIDE_FORCE_SHARE = 0.45
"""Largest side force of a tyre divided by its load at rest: up to half of a friction of 0.9, side forces grow with the
slip angle.
"""
SMALL_ANGLE = 0.2
"""Largest roll, pitch and heading (rad): rotations about the body's axes differ from angles by 2 %, and so does the
vehicle's direction from the road's tracks.
"""
TURNED_FORCE_ANGLE = 0.05
"""Rotation (rad) that turns 5 % of a force into another axis."""
LARGEST_TRAVEL, LARGEST_JOINT_TURN = 0.12, 0.3
"""Largest travel of a linear spring (m) and of a bar (rad), which have no stops: a car's springs meet their stops about
there.
"""
LARGEST_WAVES_PER_SAMPLE = {"held": 0.064, "linear": 0.25, "smooth": 0.4}
"""Largest number of road waves per sample, by interpolation. At this limit held samples are half a period late (an
error of 20 % of the wave), straight lines lose 19 %, cubics 20 %.
"""
LARGEST_IMBALANCE, ROUGH_ROAD_SPEED_CHANGE = 0.05, 0.5
"""Largest imbalance of the vertical forces, divided by the weight, which lifts or drops a vehicle by 55 m in 15 s; and
the change of vertical speed (m/s) that a rough road may cause between the ends of a run."""


def assumptions(
    scene: HubScene, vehicle: CutVehicle, stabiliser_method: str, measured_angles: MeasuredAngles | None = None
) -> list[Assumption]:
    """Assumptions of a run with a stabiliser (``stabiliser_method``), or of the run on tyres over the road
    (RUN_ON_TYRES).

    measured_angles : measured angles with which the run is compared; None if the assumptions are only listed.
    """
    listed = (
        _assumptions_on_tyres(vehicle)
        if stabiliser_method == RUN_ON_TYRES
        else _assumptions_on_forces(scene, vehicle, stabiliser_method, measured_angles)
    )
    return [
        *listed,
        *usual_travel_assumptions(vehicle, lambda run: element_travels(vehicle, run.detail), _SMOOTHER_ROAD_ADVICE),
    ]


def usual_travel_assumptions(
    vehicle: CutVehicle, travels_of_result: Callable[[Result], Watched], remedy: str
) -> list[Assumption]:
    """Assumptions that springs, mounts and bars without stops stay within usual travels. ``travels_of_result`` returns
    the travels (m, rad) of a result by name; a travel_force counts as a stop.
    """
    kinds = (("springs", "N", "m", LARGEST_TRAVEL), ("bars", "N m", "rad", LARGEST_JOINT_TURN))
    listed = []
    for kind, unit_of_kind, unit, largest_travel in kinds:
        names = {
            element.name for element in vehicle.elements if element.unit == unit_of_kind and not element.travel_force
        }

        def watched(run_result: Result, element_names: set[str] = names) -> Watched:
            return {name: values for name, values in travels_of_result(run_result).items() if name in element_names}

        says = f"linear {kind} do not meet their stops"
        listed += (
            [Assumption(f"{kind} between stops", says, remedy, watched, unit, -largest_travel, largest_travel)]
            if names
            else []
        )
    return listed


def _assumptions_on_tyres(vehicle: CutVehicle) -> list[Assumption]:
    """Assumptions of the run on tyres: tyres press on the road, side forces are linear, the vehicle
    goes straight on.
    """
    return [
        *_pressing_assumptions(vehicle, PULL_LIMIT),
        Assumption(
            "side forces",
            "side forces of the measurement grow with the slip angle",
            'use system = "handling", whose tyres slide, or lower road.speed',
            lambda run: {
                hub: np.abs(force) / load
                for (hub, force), load in zip(_forces_at_hubs(run, vehicle, 1).items(), vehicle.loads, strict=True)
            },
            "of the load at rest",
            upper_limit=LARGEST_SIDE_FORCE_SHARE,
        ),
        Assumption(
            "straight on",
            "the measured vehicle goes straight on, level",
            'use system = "handling", or a smoother road',
            lambda run: {name: run[name] for name in ("roll", "pitch", "heading")},
            "rad",
            -SMALL_ANGLE,
            SMALL_ANGLE,
        ),
    ]


def _pressing_assumptions(vehicle: CutVehicle, largest_pull: float) -> list[Assumption]:
    """Assumption that linear tyres never pull at the road by more than ``largest_pull`` (N); empty for tyres that only
    push.
    """
    lifting = Assumption(
        "tyres press",
        "the linear tyres of the measurement stay on the road",
        "name the effect lift_off, whose tyres only push",
        lambda run: _forces_at_hubs(run, vehicle, 2),
        "N",
        lower_limit=-largest_pull,
    )
    return [] if vehicle.uncut.lifts else [lifting]


def _assumptions_on_forces(
    scene: HubScene, vehicle: CutVehicle, stabiliser_method: str, measured_angles: MeasuredAngles | None
) -> list[Assumption]:
    """Assumptions of a vehicle driven by measured hub forces: it stays upright, forces are balanced and sampled fast
    enough.
    """
    listed = [
        Assumption(
            "upright",
            "the vehicle stays upright",
            "name the effect kalman_filter or prescribed_angles, or end the run before",
            lambda run: {name: run[name] for name in ("roll", "pitch")},
            "rad",
            -TUMBLED_PITCH,
            TUMBLED_PITCH,
        )
    ]
    if stabiliser_method == "none" and scene.forces.frame == "inertial":
        listed.append(
            Assumption(
                "same attitude",
                "forces that keep their directions meet a vehicle that lies as the measured one",
                "name the effect kalman_filter or prescribed_angles",
                lambda run: _angle_differences(run, measured_angles),
                "rad",
                -TURNED_FORCE_ANGLE,
                TURNED_FORCE_ANGLE,
            )
        )
    if stabiliser_method == "kalman":
        listed.append(
            Assumption(
                "small tilt",
                "the filter takes angles for turns about the body's axes",
                "name the effect prescribed_angles in place of kalman_filter",
                lambda run: {name: run[name] for name in ("roll", "pitch")},
                "rad",
                -SMALL_ANGLE,
                SMALL_ANGLE,
            )
        )
    if scene.road is None:
        return [*listed, _balance_assumption(vehicle)]
    noise = 5.0 * scene.forces.force_deviation if scene.forces.noise == "white" else 0.0
    return [*listed, _sampling_assumption(scene, scene.road), *_pressing_assumptions(vehicle, PULL_LIMIT + noise)]


def _balance_assumption(vehicle: CutVehicle) -> Assumption:
    """Assumption that the mean of the measured vertical forces is the vehicle's weight, within LARGEST_IMBALANCE."""
    return Assumption(
        "balance",
        "over the run the vertical forces carry the weight",
        "correct the loads of the vehicle file, or the columns of forces.file",
        lambda run: {
            "all hubs": carried_weight_share(
                sum(_forces_at_hubs(run, vehicle, 2).values(), np.zeros(1)), vehicle, run.times[-1]
            )
        },
        "of the weight",
        1.0 - LARGEST_IMBALANCE,
        1.0 + LARGEST_IMBALANCE,
    )


def carried_weight_share(vertical_forces: np.ndarray, vehicle: CutVehicle, duration: float) -> np.ndarray:
    """Mean of the vertical forces (n,) in N divided by the weight, shape (1,). A deviation from 1 is reduced by the
    part that a change of the vertical speed could explain.
    """
    excess = vertical_forces.mean() / vehicle.loads.sum() - 1.0
    return np.array([1.0 + np.sign(excess) * max(abs(excess) - ROUGH_ROAD_SPEED_CHANGE / (GRAVITY * duration), 0.0)])


def _sampling_assumption(scene: HubScene, road: TwoTrackRoadTable) -> Assumption:
    """Assumption that a virtual measurement samples fast enough to resolve the shortest wave of the road."""
    rate, rule = scene.forces.sampling_rate, scene.forces.interpolation
    wave = 4.0 * iso8608_road(road.iso8608, road.seed).finest
    other_remedy = ' or use forces.interpolation = "smooth",' if rule != "smooth" else ""
    return Assumption(
        "samples",
        "samples show every wave of the road",
        f"raise forces.sampling_rate,{other_remedy} or lower road.speed",
        lambda run: {"shortest wave": np.array([road.speed / wave / rate])},
        "waves per sample",
        upper_limit=LARGEST_WAVES_PER_SAMPLE[rule],
    )


def _angle_differences(run_result: Result, measured_angles: MeasuredAngles | None) -> Watched:
    """Roll and pitch (rad) of a run minus the measured angles, by name."""
    assert measured_angles is not None
    angle_times = measured_angles.period * np.arange(len(measured_angles.samples))
    return {
        name: run_result[name] - np.interp(run_result.times, angle_times, measured_angles.samples[:, i])
        for i, name in enumerate(("roll", "pitch"))
    }


def _forces_at_hubs(run_result: Result, vehicle: CutVehicle, axis_index: int) -> dict[str, np.ndarray]:
    """Applied hub forces (n,) in N along an axis (0 x, 1 y, 2 z), by hub name."""
    return {hub: run_result.detail.wrenches[:, i, axis_index] for i, hub in enumerate(vehicle.hubs)}
