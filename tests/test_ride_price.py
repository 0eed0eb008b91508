"""The price of accuracy in ride: all judged rows pass, and a lossy route fails its own."""

import pytest
from matplotlib.figure import Figure

from validation.price import ride


@pytest.fixture(scope="module")
def measured():
    return ride.measure_routes(True, 1, 0.0)


def test_all_rows_pass_and_table_and_figure_come_from_saved_data(measured):
    rows, data = measured
    assert [row.reason for row in rows if row.status in ("failed", "not run")] == []
    assert len(ride.table(data).rows) == len(data["points"])
    assert isinstance(ride.draw(data)[1], Figure)


def test_a_route_that_loses_digits_fails_its_row(measured):
    points = [ride.RoutePoint(**saved) for saved in measured[1]["points"]]
    lossy = [
        ride.RoutePoint(**{**vars(p), "errors": {"tyre forces": 1e-8}}) if "Lyapunov" in p.name else p for p in points
    ]
    known = ride.PricedRide(None, {}, None, 1e-12)
    failed = [row.id for row in ride.judging_rows(known, lossy) if row.status == "failed"]
    assert failed == ["price.ride.error.Lyapunov"]
