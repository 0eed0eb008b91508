"""Problem sheets serve without twinrig: their equations and files, solved by scipy alone, give their end values."""

import csv
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from validation.price import sheets
from validation.price.problems import noisy_forces


@pytest.mark.full
def test_the_sheet_of_noisy_forces_is_solved_by_scipy_alone(tmp_path):
    sheets.PROBLEMS = (noisy_forces.problem,)
    sheets.main(tmp_path)
    k, d, m, inertia, g = 1e5, 1e4, (15.0, 15.0, 750.0), 500.0, 9.81
    t, front, rear = np.loadtxt(tmp_path / "noise.csv", delimiter=",", skiprows=1).T

    def rates(now, y):
        f3 = k * (y[2] - y[0] - np.sin(y[3])) + d * (y[6] - y[4] - y[7] * np.cos(y[3]))
        f4 = k * (y[2] - y[1] + np.sin(y[3])) + d * (y[6] - y[5] + y[7] * np.cos(y[3]))
        f1, f2 = np.interp(now, t, front), np.interp(now, t, rear)
        return [*y[4:], g + (f3 - f1) / m[0], g + (f4 - f2) / m[1], g - (f3 + f4) / m[2],
                np.cos(y[3]) * (f3 - f4) / inertia]  # fmt: skip

    start = (tmp_path / "noise.md").read_text().partition("Start: ")[2].partition(".\n")[0]
    y = np.array([float(part.partition(" = ")[2]) for part in start.split(", ")])
    for begin, end in pairwise(t):
        y = solve_ivp(rates, (begin, end), y, method="LSODA", rtol=1e-11, atol=1e-13).y[:, -1]
    with open(tmp_path / "reference_values.csv") as file:
        rows = list(csv.DictReader(file))
    assert y == pytest.approx([float(row["value"]) for row in rows], abs=1e-8)
    assert max(float(row["uncertainty"]) for row in rows) < 1e-11  # ten digits of what is of size 1
