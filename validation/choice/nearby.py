"""A choice looked at by other routes than its own: near its scene by the exact solve, and at equal accuracy by the
covariance of what runs sample.
"""

from dataclasses import replace

import numpy as np

from models.advice.ride_choice.choose import Chooser, Set
from models.advice.ride_choice.march import longest_step
from models.advice.ride_choice.neighbourhood import OFF, changed, parameters
from models.advice.ride_choice.reduced import Whole
from models.advice.ride_choice.screen import confirmed
from validation.choice.sampled import Sampled


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


def measured_step(chooser: Chooser, chosen: Set) -> float:
    """Longest step (s) that keeps the tolerance, by the covariance of what runs sample; no quantity is weighted."""
    runs = [Sampled(march) for march in chooser.marches(chosen)]
    exact = [np.sqrt(chooser.full[chooser.wholes.index(whole)]) for whole in chooser.screened]
    return longest_step(runs, exact, chooser.tolerance)
