"""A stop's report held to a known motion: a circle to the left, driven at a constant angle to the path."""

import numpy as np
import pytest

from models.systems.braking.march import BrakingPath
from models.systems.braking.stop_report import StopHistory

pytestmark = pytest.mark.grounds("closed form")
SPEED, RADIUS, SLIP, STEP = 15.0, 60.0, 0.04, 1e-3


@pytest.fixture(scope="module")
def circle() -> StopHistory:
    """2 s of it; the vehicle points ``SLIP`` (rad) to the right of its path."""
    times = STEP * np.arange(2001)
    course = SPEED / RADIUS * times
    places = np.stack([RADIUS * np.sin(course), RADIUS * (1.0 - np.cos(course)), course - SLIP], axis=1)
    rates = np.stack([SPEED * np.cos(course), SPEED * np.sin(course), np.full_like(times, SPEED / RADIUS)], axis=1)
    blank = np.zeros((len(times), 4))
    return StopHistory(
        BrakingPath(times, np.stack([places, rates], axis=1), blank, blank, blank, np.zeros((2000, 4, 7)), False)
    )


def test_a_circle_to_the_left_has_its_signs_and_sizes(circle: StopHistory) -> None:
    """Chords are shorter than arcs by (v dt / R)^2 / 24 = 3e-9, changes of velocity by as little."""
    assert np.allclose(circle.side_slip, SLIP, rtol=1e-12)
    assert np.allclose(circle.lateral_acceleration, SPEED**2 / RADIUS, rtol=1e-7)
    assert circle.distance_travelled == pytest.approx(SPEED * circle.times, rel=1e-8)
    told = circle.vehicle_results()
    assert told["stopping distance [m]"] == pytest.approx(2.0 * SPEED, rel=1e-8)
    assert told["final yaw [deg]"] == pytest.approx(np.degrees(2.0 * SPEED / RADIUS), rel=1e-12)
    assert told["largest lateral acceleration [m/s^2]"] == pytest.approx(SPEED**2 / RADIUS, rel=1e-7)


def test_it_stays_on_its_circle(circle: StopHistory) -> None:
    told = circle.results_in_turn(RADIUS)
    assert told["yaw rate by that of the circle"] == pytest.approx(1.0, rel=1e-12)
    assert told["outside of the circle [m]"] == pytest.approx(0.0, abs=1e-9)
    assert told["side slip [deg]"] == pytest.approx(np.degrees(SLIP), rel=1e-9)
    x, y = RADIUS * np.sin(SPEED / RADIUS), RADIUS * (1.0 - np.cos(SPEED / RADIUS))
    inside = np.hypot(x, y - 61.0) - 61.0
    assert (
        circle.results_in_turn(RADIUS + 1.0)["outside of the circle [m]"] == pytest.approx(inside, rel=1e-9)
        and inside < 0.0
    )
