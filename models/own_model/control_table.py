"""Controls of a model's actuators over time, from a CSV file; the controls of a row apply until the next row's time.

MuJoCo holds controls over each of its steps; so do all builds here, and every row lies on a step.
"""

import copy
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from models.core.errors import InputError
from models.core.tables import SECONDS, read_table
from models.own_model.reading import TwinModel, affine_law, constant_controls, described_model

CONTROL_UNITS = dict.fromkeys(("-", "N", "N m", "m", "rad", "m/s", "rad/s"), 1.0)
"""Units that a control in a CSV file may have, with their factors: SI, as MuJoCo takes it."""
STEP_TIME_TOLERANCE = 1e-6
"""Share of a step by which a row's time may differ from a multiple of the step."""


class PathSection(NamedTuple):
    """Section of a path with constant controls (nu,) over a number of steps; ``twin`` is the model with these controls
    as constants of its actuators."""

    twin: TwinModel
    step_count: int
    controls: np.ndarray


@dataclass(frozen=True, eq=False)
class ControlTable:
    """Table of controls over time. path : of its file; times (rows,) in s from 0, rising; values (rows, nu) in the
    order of the actuators."""

    path: Path
    times: np.ndarray
    values: np.ndarray

    def path_sections(self, user_model: TwinModel, step_count: int, time_step: float) -> list[PathSection]:
        """Sections of a path of ``step_count`` steps of ``time_step`` seconds, each with constant controls. Raises
        InputError where a row's time lies between two steps."""
        first = self.times / time_step
        off = np.flatnonzero(abs(first - np.round(first)) > STEP_TIME_TOLERANCE)
        if len(off):
            time, allowed = float(self.times[off[0]]), f"times must be multiples of the step, {time_step:g} s"
            raise InputError(self.path, f"row {off[0] + 1}, column 'time'", time, allowed)
        ends = [*np.round(first).astype(int).tolist(), step_count]
        counts = [min(end, step_count) - start for start, end in pairwise(ends) if start < step_count]
        return [
            PathSection(with_constant_controls(user_model, row), count, row)
            for row, count in zip(self.values, counts, strict=False)
        ]


def constant_sections(user_model: TwinModel, step_count: int) -> list[PathSection]:
    """Sections of a path that has the model's constant controls throughout: a single one."""
    return [PathSection(user_model, step_count, constant_controls(user_model.model))]


def read_controls(csv_path: Path, mujoco_model: mujoco.MjModel) -> ControlTable:
    """Read a CSV file with columns ``time [s]`` and one per actuator, called by its name (``actuator 3`` if it has
    none).

    Raises InputError for what ``read_table`` refuses, a first time that is not 0, and a control out of its range.
    """
    names = [mujoco_model.actuator(i).name or f"actuator {i}" for i in range(mujoco_model.nu)]
    if not names:
        raise InputError("--controls", "", str(csv_path), "the model has no actuators")
    if len({"time", *names}) <= len(names):
        raise InputError("--controls", "", str(csv_path), "columns would share a name: rename the model's actuators")
    table = read_table(csv_path, {"time": SECONDS, **dict.fromkeys(names, CONTROL_UNITS)}, increasing_column="time")
    if table["time"][0] != 0.0:
        raise InputError(csv_path, "row 1, column 'time'", float(table["time"][0]), "the first row must be of time 0")
    for i, name in enumerate(names):
        low, high = mujoco_model.actuator_ctrlrange[i] if mujoco_model.actuator_ctrllimited[i] else (-np.inf, np.inf)
        beyond = np.flatnonzero((table[name] < low) | (table[name] > high))
        if len(beyond):
            place = f"row {beyond[0] + 1}, column {name!r}"
            raise InputError(csv_path, place, float(table[name][beyond[0]]), f"its range is from {low:g} to {high:g}")
    return ControlTable(csv_path, table["time"], np.column_stack([table[name] for name in names]))


def with_constant_controls(user_model: TwinModel, controls: np.ndarray) -> TwinModel:
    """Model whose actuators ignore their control and act as they do with the constant controls (nu,)."""
    model = copy.copy(user_model.model)
    for i in range(model.nu):
        model.actuator_biasprm[i, :3] = affine_law(user_model.model, i, float(controls[i]))
        model.actuator_gainprm[i, :3] = 0.0
        model.actuator_biastype[i] = mujoco.mjtBias.mjBIAS_AFFINE
    return described_model(model, user_model.name)
