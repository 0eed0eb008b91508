"""Efficiency of up to a thousand workers: an event simulation of an ensemble's blocks on a cluster.

    command --(block's number)--> a free worker --(arrays)--> link --> command and its disk

The command, with the scheduler beside it, and the link to it each serve a block at a time; workers compute beside one
another. So many blocks are under way as ``models.ensemble.runner`` allows, none further before the first that is not
back. Costs are those measured with two workers (``validation.price.two_workers``) for paths of 60 s at 1 kHz; rates of
the link and the disk are assumed. ``python -m validation.price.many_workers`` prints the table of the docs.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count

import numpy as np

from models.ensemble.runner import BLOCKS_AHEAD

PATH_SECONDS, PATH_BYTES = 0.8 / 50, 0.4e6 / 50
"""Computing time (s) of a path of 60 s on a worker, and size (bytes) of its states at 121 rows."""
COMMAND_TIMES, SECONDS_PER_BYTE = 12e-3, 2e-3 / 0.4e6
"""Processor time of command and scheduler for a block of any size (s), and for each of its bytes (s)."""
LINK_RATE, DISK_RATE = 1.25e9, 500e6
"""Assumed rates (bytes/s) of the network link into the command (10 Gbit/s), and of its disk."""
TIME_SCATTER = 0.1
"""Standard deviation of a block's computing time divided by the mean."""
SEED = 25
WORKERS = (2, 10, 100, 1000)


@dataclass(frozen=True)
class Ensemble:
    """An ensemble that is computed in blocks. paths_per_block: number of paths in each; thinning_factor: factor by
    which workers thin the time rows that they send back."""

    paths_per_block: int = 50
    thinning_factor: int = 1

    @property
    def block_seconds(self) -> float:
        """Computing time (s) of a block on a worker."""
        return self.paths_per_block * PATH_SECONDS

    @property
    def result_bytes(self) -> float:
        """Size (bytes) of the result that a worker sends back for a block."""
        return self.paths_per_block * PATH_BYTES / self.thinning_factor

    @property
    def station_times(self) -> dict[str, float]:
        """Time (s) that each station (command, link, disk), which serves one block at a time, needs for a block."""
        return {
            "command": COMMAND_TIMES + SECONDS_PER_BYTE * self.result_bytes,
            "link": self.result_bytes / LINK_RATE,
            "disk": self.result_bytes / DISK_RATE,
        }

    @property
    def most_workers(self) -> float:
        """Number of workers that the slowest station can keep busy."""
        return self.block_seconds / max(self.station_times.values())


@dataclass(frozen=True)
class WorkerShares:
    """Shares of time for which the workers compute and for which each station is busy, and ``rate`` in blocks per
    second."""

    workers: float
    stations: dict[str, float]
    rate: float

    @property
    def bottleneck(self) -> str:
        """The station with the largest busy share, or the workers."""
        shares = {"workers": self.workers, **self.stations}
        return max(shares, key=lambda name: shares[name])


def simulated_shares(ensemble: Ensemble, worker_count: int, block_count: int) -> WorkerShares:
    """Busy shares in a simulated run of ``block_count`` blocks by ``worker_count`` workers, from sending the first
    block to saving the last."""
    seconds = ensemble.block_seconds * np.random.default_rng(SEED).normal(1.0, TIME_SCATTER, block_count).clip(0.5, 1.5)
    half, waiting, free = ensemble.station_times["command"] / 2.0, list[int](), worker_count
    idle, events, order = dict.fromkeys(("command", "link", "disk"), 0.0), list[tuple[float, int, str, int]](), count()
    saved_blocks, first, sent, current_time = set[int](), 0, 0, 0.0
    blocks_ahead = max(BLOCKS_AHEAD, 2 * worker_count)

    def serve(station_name: str, service_seconds: float, next_station: str, block_number: int) -> None:
        """Let a station serve a block as soon as it is idle."""
        idle[station_name] = max(idle[station_name], current_time) + service_seconds
        heappush(events, (idle[station_name], next(order), next_station, block_number))

    while len(saved_blocks) < block_count:
        while sent < min(block_count, first + blocks_ahead) and sent - len(saved_blocks) < blocks_ahead:
            serve("command", half, "sent", sent)
            sent += 1
        current_time, _, event, block = heappop(events)
        if event == "sent":
            waiting.append(block)
        elif event == "computed":
            free += 1
            serve("link", ensemble.station_times["link"], "here", block)
        elif event == "here":
            serve("command", half, "taken", block)
        elif event == "taken":
            serve("disk", ensemble.station_times["disk"], "kept", block)
        else:
            saved_blocks.add(block)
            while first in saved_blocks:
                first += 1
        while free and waiting:
            free -= 1
            start_time = waiting.pop(0)
            heappush(events, (current_time + float(seconds[start_time]), next(order), "computed", start_time))
    busy = {name: block_count * takes / current_time for name, takes in ensemble.station_times.items()}
    return WorkerShares(float(seconds.sum()) / (worker_count * current_time), busy, block_count / current_time)


SETTINGS = {
    "blocks of 50 paths, as they come": Ensemble(),
    "`options.block=1000`": Ensemble(1000),
    "`options.block=1000`, `options.rows=5`": Ensemble(1000, 10),
    "`options.block=2000`, `options.rows=5`": Ensemble(2000, 10),
}
"""Ensembles of the table, by the options that a user types."""


def shares_table(round_count: int = 20) -> Iterator[str]:
    """Lines of the table in the docs: share of time for which workers compute, and the busiest station with the largest
    number of workers. round_count : number of blocks per worker."""
    for name, ensemble in SETTINGS.items():
        outcomes = [simulated_shares(ensemble, workers, round_count * workers) for workers in WORKERS]
        shares = " | ".join(f"{100.0 * outcome.workers:.0f} %" for outcome in outcomes)
        sent = outcomes[-1].rate * ensemble.result_bytes / 1e6
        yield f"| {name} | {shares} | {outcomes[-1].bottleneck} | {sent:.0f} MB/s | {ensemble.most_workers:.0f} |"


if __name__ == "__main__":
    print("\n".join(shares_table()))
