"""Comparison of the paths of two model files from the same state, by the same build, integration method and step."""

from dataclasses import dataclass

import numpy as np

from models.core.errors import RunFailed
from models.engines.free_vehicle import ENGINES
from models.own_model.control_table import constant_sections
from models.own_model.elements import two_digit_text
from models.own_model.path import (
    DISTURBANCE,
    PATH_DURATION,
    count_of_equal_states,
    has_diverged,
    path_of_build,
    step_count_of_path,
)
from models.own_model.reading import TwinModel
from models.own_model.states import random_states


@dataclass(frozen=True)
class PathGap:
    """Difference of two files' paths. horizon : time (s) up to which paths are compared, as in ``PathReport``; distance
    : largest difference of a coordinate or rate, relative to the largest value in the first file, at least 1; worst :
    name of the coordinate with this difference; failed : why there is no comparison."""

    horizon: float
    distance: float
    worst: str
    failed: str = ""

    def line(self) -> str:
        """Text of one line for the terminal."""
        if self.failed:
            return f"paths of both files from one state are not compared: {self.failed}"
        until = (
            "" if self.horizon >= PATH_DURATION else f", where a disturbance of {DISTURBANCE:g} makes them different"
        )
        return (
            f"paths of both files from one state, in Exudyn: {two_digit_text(self.distance)} apart up "
            f"to {self.horizon:.3g} s"
            f"{until}; most at {self.worst}"
        )


def compare_two_paths(first_model: TwinModel, second_model: TwinModel) -> PathGap:
    """Difference between two files' paths over 1 s, at the step of the first file; both files must have coordinates of
    the same names."""
    steps, (q,), (v,) = step_count_of_path(first_model), *random_states(first_model, 1)
    step, order = PATH_DURATION / steps, [first_model.names.index(name) for name in second_model.names]
    legs = [constant_sections(twin, steps) for twin in (first_model, second_model)]
    try:
        with np.errstate(all="ignore"):  # what blows up is told
            path = path_of_build(legs[0], ENGINES[0], (q, v), step)
            disturbed = path_of_build(legs[0], ENGINES[0], (q + DISTURBANCE, v), step)
            other = path_of_build(legs[1], ENGINES[0], (q[order], v[order]), step)
    except RunFailed as error:
        return PathGap(0.0, np.nan, "", error.reason)
    if has_diverged(path) or has_diverged(other):
        return PathGap(0.0, np.nan, "", "the motion blows up at this step")
    rows, places = count_of_equal_states(path, disturbed, steps), np.argsort(order)
    there = other[:rows, np.concatenate((places, first_model.size + places))]
    apart = np.abs(there - path[:rows]).max(axis=0)
    at, size = int(apart.argmax()), max(1.0, float(np.abs(path[:rows]).max()))
    return PathGap((rows - 1) * step, float(apart[at]) / size, first_model.names[at % first_model.size])
