"""Assumptions of the equations of a steered car, with the limits that decide whether a run breaks them."""

from functools import partial

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.multibody.numbers import GRAVITY, Handling
from models.tyre.bristles import FADING_SPEED
from models.vehicles.free_vehicle import SWAY, chassis_of
from models.vehicles.spatial import hitch_of

LARGEST_LOAD_RATIO = 2.5
"""Wheel load divided by the load at rest up to which a tyre's cornering stiffness grows with its load (Pacejka, Tyre
and Vehicle Dynamics, 4.3). The stiffness of the brush model grows without end.
"""
LARGEST_LEAN = 0.2
"""Largest roll and pitch (rad): springs act along the normal of the road's plane, and the cosine is 2 % below 1 here.
"""
SLIDING_SPEED, SLIDING_SPEED_SHARE, SLIDING_WEIGHT_SHARE = 4.0, 0.2, 0.1
"""Sliding speed (m/s), and sliding speed divided by the wheel's speed, above which measured friction falls; and the
largest share of the weight that may slide faster. Friction that is a fifth too large then changes all forces by 2 %."""
RELAXATION_LENGTH, LARGEST_SLIP_LEAD = 0.3, 0.02
"""Distance (m) over which a tyre's carcass follows a slip angle, and largest slip angle (rad) by which it may lag."""
LARGEST_TRAVEL = 0.12
"""Largest travel (m) of a wheel: a car's wheels reach their stops about there."""
LARGEST_STEER = 0.7
"""Largest steer angle (rad): beyond, steering joints reach their ends, and the inner wheel must turn more than the
outer wheel.
"""


def assumptions(handling_model: Handling) -> list[Assumption]:
    """Assumptions of the equations of a manoeuvre, about wheel loads, lean, friction, tyres, steer angle and travel."""
    return [
        Assumption(
            "wheel loads",
            "cornering stiffness grows with a tyre's load",
            "drive more slowly or steer less: no tyre here levels off",
            lambda run: _watched_by_tyre(run["load"] / _static_loads(handling_model), handling_model),
            "of the load at rest",
            upper_limit=LARGEST_LOAD_RATIO,
        ),
        Assumption(
            "small lean",
            "springs stay upright on a car that leans little",
            "drive more slowly or steer less: no suspension here has a geometry",
            lambda run: _lean_angles(run, handling_model),
            "rad",
            -LARGEST_LEAN,
            LARGEST_LEAN,
        ),
        Assumption(
            "one friction",
            "friction is the same at any sliding speed, and little of the weight slides fast",
            'brake less, or use system = "braking", whose tyre tables know locked wheels',
            lambda run: {"all tyres": _sliding_share(run, handling_model)},
            "of the weight",
            upper_limit=SLIDING_WEIGHT_SHARE,
        ),
        Assumption(
            "moving tyres",
            "wheels move faster than the speed below which their bristles creep",
            "end the manoeuvre before the car stops: shorten its duration",
            lambda run: _watched_by_tyre(_contact_speed(run), handling_model),
            "m/s",
            lower_limit=FADING_SPEED,
        ),
        Assumption(
            "slow steering",
            "tyres build up their forces at once",
            f"steer more slowly, or drive faster: the lag of {RELAXATION_LENGTH:g} m of way is not modelled",
            lambda run: _watched_by_tyre(_carcass_lag(run), handling_model),
            "rad",
            -LARGEST_SLIP_LEAD,
            LARGEST_SLIP_LEAD,
        ),
        Assumption(
            "steer angle",
            "both front wheels steer by the same angle, and their joints allow it",
            f"steer by at most {LARGEST_STEER:g} rad in manoeuvres.NAME.steer",
            lambda run: _watched_by_tyre(run["steer"], handling_model),
            "rad",
            -LARGEST_STEER,
            LARGEST_STEER,
        ),
        *_travel_assumptions(handling_model),
        *_stop_assumptions(handling_model),
    ]


def _stop_assumptions(handling_model: Handling) -> list[Assumption]:
    """Assumptions that bodies stay between the stops of the vehicle file that are not part of the model."""
    coordinates = handling_model.vehicle.coordinates()
    return [
        Assumption(
            f"stops {body} {freedom}",
            f"{body!r} stays between the stops of its degree of freedom {freedom}, which are not built",
            "drive more slowly or steer less, or stiffen the spring",
            partial(_watched_coordinate, coordinates.index((body, freedom)), f"{body} {freedom}"),
            "rad" if freedom.startswith("r") else "m",
            low,
            high,
        )
        for (body, freedom), low, high in handling_model.given.ranges
    ]


def _travel_assumptions(handling_model: Handling) -> list[Assumption]:
    """Assumptions that the travel of upright wheel springs stays within the spring's force curve, or without a curve
    within the usual stops of a car.
    """
    carrying = {chassis_of(handling_model.given).name, *handling_model.given.towed}
    bodies = {tyre.body for tyre in handling_model.given.tyres}
    listed = []
    for spring in handling_model.given.springs:
        upright = spring.axis[2] > 0.9 and spring.first_body in carrying and spring.second_body in bodies
        if not upright or (spring.second_body, "z") not in handling_model.vehicle.coordinates():
            continue
        column = handling_model.vehicle.coordinates().index((str(spring.second_body), "z"))
        low, high = -LARGEST_TRAVEL, LARGEST_TRAVEL
        remedy = "drive more slowly, or give the spring a travel_force with its stops in the vehicle file"
        if curve := spring.travel_force:
            low, high, remedy = curve.arguments[0], curve.arguments[-1], "let its travel_force reach farther"
        listed.append(
            Assumption(
                f"travel {spring.name}",
                f"the spring {spring.name!r} moves within its travel",
                remedy,
                partial(_watched_coordinate, column, spring.name),
                "m",
                low,
                high,
            )
        )
    return listed


def _watched_coordinate(coordinate_column: int, coordinate_name: str, run_result: Result) -> Watched:
    """Values (m,) of a coordinate over a run, under the name of the coordinate."""
    return {coordinate_name: run_result["positions"][:, coordinate_column]}


def _watched_by_tyre(tyre_values: np.ndarray, handling_model: Handling) -> Watched:
    """Columns of values (m, w) by the name of the tyre."""
    return {tyre.name: column for tyre, column in zip(handling_model.vehicle.tyres, tyre_values.T, strict=True)}


def _static_loads(handling_model: Handling) -> np.ndarray:
    """Loads (w,) in N of the tyres at rest."""
    return np.array([handling_model.held.tyres[tyre.name] for tyre in handling_model.vehicle.tyres])


def _lean_angles(run_result: Result, handling_model: Handling) -> Watched:
    coordinates = handling_model.vehicle.coordinates()
    names = {SWAY: "", **{hitch_of(name): f" of {name} beside what tows it" for name in handling_model.vehicle.towed}}
    turns = [("roll", "rx"), ("pitch", "ry")]
    leans = {f"{angle}{body_suffix}": (body, turn) for body, body_suffix in names.items() for angle, turn in turns}
    return {
        name: run_result["positions"][:, coordinates.index(coordinate)]
        for name, coordinate in leans.items()
        if coordinate in coordinates
    }


def _sliding_share(run_result: Result, handling_model: Handling) -> np.ndarray:
    """Share (m,) of the vehicle's weight on tyres that slide faster than SLIDING_SPEED and faster than
    SLIDING_SPEED_SHARE of the wheel's speed.
    """
    fast = np.hypot(run_result["slip_x"], run_result["slip_y"]) > np.maximum(
        SLIDING_SPEED, SLIDING_SPEED_SHARE * _contact_speed(run_result)
    )
    weight = GRAVITY * sum(body.mass for body in handling_model.vehicle.bodies)
    return np.sum(run_result["load"] * fast, axis=1) / weight


def _contact_speed(run_result: Result) -> np.ndarray:
    """Speed (m/s) of every wheel over the road, from rolling and sliding together, shape (m, w)."""
    return np.hypot(run_result["tread"] + run_result["slip_x"], run_result["slip_y"])


def _carcass_lag(run_result: Result) -> np.ndarray:
    """Change of the steer angle (rad) while a wheel rolls over the relaxation length of its tyre, shape (m, w)."""
    return (
        np.gradient(run_result["steer"], run_result.times, axis=0)
        * RELAXATION_LENGTH
        / np.maximum(_contact_speed(run_result), FADING_SPEED)
    )
