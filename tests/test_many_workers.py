"""A simulated cluster obeys the laws of queues, and the docs say what it says; the measurement behind it runs."""

from pathlib import Path

import pytest

from validation.price import many_workers
from validation.price.many_workers import (
    COMMAND_TIMES,
    DISK_RATE,
    LINK_RATE,
    SECONDS_PER_BYTE,
    Ensemble,
    shares_table,
    simulated_shares,
)
from validation.price.two_workers import Sender, cost_of_blocks

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "cluster.md"


def test_few_workers_compute_all_the_time_and_many_wait_for_the_slowest_station():
    """Throughput is the least of what workers compute and of what the command takes, to 3 % of filling and emptying."""
    ensemble = Ensemble()
    slowest = COMMAND_TIMES + SECONDS_PER_BYTE * ensemble.result_bytes
    assert ensemble.most_workers == pytest.approx(ensemble.block_seconds / slowest)
    few, many = simulated_shares(ensemble, 10, 1000), simulated_shares(ensemble, 500, 10_000)
    assert few.rate == pytest.approx(10 / ensemble.block_seconds, rel=0.03) and few.bottleneck == "workers"
    assert many.rate == pytest.approx(1.0 / slowest, rel=0.03) and many.bottleneck == "command"
    assert many.workers == pytest.approx(ensemble.most_workers / 500, rel=0.05)


def test_the_disk_is_the_bottleneck_where_it_is_slow(monkeypatch):
    monkeypatch.setattr(many_workers, "DISK_RATE", 1e7)
    outcome = simulated_shares(Ensemble(), 100, 2000)
    assert outcome.bottleneck == "disk" and outcome.rate == pytest.approx(1e7 / Ensemble().result_bytes, rel=0.03)
    assert DISK_RATE < LINK_RATE


def test_a_block_that_comes_late_holds_up_the_others(monkeypatch):
    """No block is begun further before the first that is missing than there may be under way."""
    alike = Ensemble(50, 1000)
    monkeypatch.setattr(many_workers, "BLOCKS_AHEAD", 0)  # two blocks a worker
    calm = simulated_shares(alike, 20, 400)
    monkeypatch.setattr(many_workers, "TIME_SCATTER", 0.4)
    assert simulated_shares(alike, 20, 400).workers < calm.workers - 0.01


def test_the_docs_have_the_simulated_table():
    page = PAGE.read_text()
    rows = list(shares_table())
    assert len(rows) == 4 and all(row in page for row in rows), "\n".join(rows)


class Here:
    """An executor that computes at once."""

    def submit(self, function, /, *args):
        from concurrent.futures import Future

        future = Future()
        future.set_result(function(*args))
        return future


def test_what_a_block_costs_is_told_by_its_size(monkeypatch):
    monkeypatch.setattr("validation.price.two_workers.EMPTY_BLOCKS", 3)
    costs = cost_of_blocks(Here())
    assert list(costs) == [1_000, 50_000, 500_000] and all(0.0 <= took < 1.0 for took in costs.values())
    assert Sender(7)(range(2))["x"].shape == (2, 7)
