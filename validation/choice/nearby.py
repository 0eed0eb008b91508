"""A choice looked at by other routes than its own: near its scene by the exact solve, and at equal accuracy by runs."""

from dataclasses import replace

import numpy as np

from models.ride.choice.choose import Chooser, Set
from models.ride.choice.march import March
from models.ride.choice.marched import FINER, marched
from models.ride.choice.neighbourhood import OFF, changed, parameters
from models.ride.choice.reduced import Whole
from models.ride.choice.screen import confirmed

COPIES = 192
"""Of a run that measures a step."""
BESIDE = 0.98
"""A step so many times as long tells how fast its error grows."""


def worst_nearby(chooser: Chooser, chosen: Set, draws: int, seed: int) -> float:
    """Largest change, by the tolerance, at random speeds of the range and with every parameter off at random."""
    random, rest, worst = np.random.default_rng(seed), chooser.rest(chosen), 0.0
    low, high = chooser.wholes[0].speed, chooser.wholes[-1].speed
    names = parameters(chooser.held.vehicle)
    for _ in range(draws):
        factors = dict(zip(names, 1.0 + OFF * random.uniform(-1.0, 1.0, len(names)), strict=True))
        full, left = (replace(one, vehicle=changed(one.vehicle, factors)) for one in (chooser.held, rest))
        whole = Whole(full, float(random.uniform(low, high)))
        ratio = confirmed(whole.reduced(left), chooser.rows) / confirmed(whole.full, chooser.rows)
        worst = max(worst, float(abs(np.sqrt(ratio) - 1.0).max()))
    return worst / chooser.tolerance


def measured_step(chooser: Chooser, chosen: Set, step: float) -> float:
    """Longest step (s) that keeps the tolerance, by a run at the speed where ``step`` comes nearest to breaking it.

    The run tells the error of that step, the closed form how fast it grows; never beyond the stable step."""
    marches = chooser.marches(chosen)
    exact = [np.sqrt(chooser.full[chooser.wholes.index(whole)]) for whole in chooser.screened]
    errors = [abs(march.deviations(step) / own - 1.0) for march, own in zip(marches, exact, strict=True)]
    at = int(np.argmax([own.max() for own in errors]))
    march, own, q = replace(marches[at], weightings=()), exact[at], int(errors[at].argmax())
    if marches[at].weightings:
        return step  # a run tells nothing of weightings
    ratio = marched(march, step, COPIES).ratio[q] * march.deviations(step / FINER)[q] / own[q]
    slope = np.log(errors[at][q] / abs(march.deviations(BESIDE * step)[q] / own[q] - 1.0)) / -np.log(BESIDE)
    by_run = step * (chooser.tolerance / abs(ratio - 1.0)) ** (1.0 / slope)
    return float(min(by_run, _stable(marches)))


def _stable(marches: list[March]) -> float:
    return min(march.longest for march in marches)
