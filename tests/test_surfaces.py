"""Which surface is under which wheel: along the road, on either side of a line, shared within a step."""

import numpy as np
import pytest

from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.brake.surfaces import (
    RoadStretch,
    VehicleOnRoad,
    WheelSurfaces,
    check_step_distance,
    fill_surfaces_under_wheels,
    road_of_stretches,
)
from models.core.errors import InputError
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import stacked_tables

PLANE, ICE = plane_of_truck(PAPER_TRUCK), table_of_surface("ice")
KINDS = np.array([0, 0, 1, 1])
ROAD = road_of_stretches(
    [RoadStretch(0.0, 0, 1), RoadStretch(10.0, 2, 3), RoadStretch(12.0, 0, 0)], dividing_line=0.5, tyre_kind_count=2
)
FRONT, REAR = PAPER_TRUCK.front.x, PAPER_TRUCK.rear.x


def under(x, y=0.0, vx=0.0, vy=0.0, step=0.1, own=ROAD):
    """Of each wheel its first and its second table and the share of the second."""
    surfaces = WheelSurfaces(*np.zeros((4, 4)))
    vehicle = VehicleOnRoad(PLANE, KINDS, 0.0, stacked_tables([ICE]), own)
    fill_surfaces_under_wheels(np.array([[x, y, 0.0], [vx, vy, 0.0]]), step, vehicle, surfaces)
    return np.column_stack((surfaces.first, surfaces.second, surfaces.share))


def test_each_wheel_has_the_surface_under_it_and_its_own_tyre():
    # front wheels at 11 m, rear ones at 7.39 m; left ones at y = 0.95 and 0.9, right ones on the other side of 0.5
    found = under(11.0 - FRONT)
    assert found[:, 0].tolist() == [4.0, 6.0, 1.0, 3.0] and not found[:, 2].any()
    assert under(-1e6)[:, 0].tolist() == [0.0, 2.0, 1.0, 3.0]
    assert under(1e6)[:, 0].tolist() == [0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize("speed", [10.0, -10.0])
def test_a_step_over_an_edge_has_the_share_of_the_way_whichever_the_direction(speed):
    # of the metre of a step, 0.3 m lie beyond x = 10
    start = 9.3 if speed > 0 else 10.3
    left_front = under(start - FRONT, vx=speed)[0]
    assert left_front[:2].tolist() == [0.0, 4.0] and left_front[2] == pytest.approx(0.3, abs=1e-12)


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_a_step_over_the_line_has_the_share_of_the_way(speed):
    # the left front wheel is at y + 0.95: of its 0.2 m, 0.05 m lie left of the line
    y = 0.5 - 0.95 + (-0.15 if speed > 0 else 0.05)
    left_front = under(0.0, y, vy=speed)[0]
    assert left_front[:2].tolist() == [2.0, 0.0] and left_front[2] == pytest.approx(0.25, abs=1e-12)


def test_shares_of_successive_steps_add_up_to_the_way():
    # whatever the step, friction summed over the way is that of the road: 2 m of surface 2 between two of 0
    for step in (0.01, 0.037, 0.11):
        x = 9.0 - FRONT + step * 10.0 * np.arange(round(4.0 / (10.0 * step)))
        rows = np.array([under(place, vx=10.0, step=step)[0] for place in x])
        on = (rows[:, 0] == 4.0) * (1.0 - rows[:, 2]) + (rows[:, 1] == 4.0) * rows[:, 2]
        assert on.sum() * step * 10.0 == pytest.approx(2.0, abs=1e-9)


def test_roads_that_cannot_be_are_told():
    for wrong in ([], [RoadStretch(0, 0, 0), RoadStretch(0, 1, 1)], [RoadStretch(np.nan, 0, 0)]):
        with pytest.raises(InputError, match="rise strictly"):
            road_of_stretches(wrong)
    with pytest.raises(InputError, match="count from 0"):
        road_of_stretches([RoadStretch(0, -1, 0)])
    check_step_distance(ROAD, 2.0)
    with pytest.raises(InputError, match=r"stretches = 2.0: .*more substeps"):
        check_step_distance(ROAD, 2.1)
    check_step_distance(
        road_of_stretches([RoadStretch(0, 0, 0), RoadStretch(0.1, 1, 1)]), 50.0
    )  # the last and the first have no end
