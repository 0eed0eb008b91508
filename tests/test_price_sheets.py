"""Problem sheets serve without twinrig: their equations and files, solved by scipy alone, give their end values."""

import csv
import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation

from validation.price import sheets
from validation.price.problems import force_excited
from validation.price.sheets import inertial_unit, pitch_plane, ride


def values(folder, writer):
    """The lines of ``reference_values.csv`` of one sheet."""
    sheets.main(folder, (writer,))
    with open(folder / "reference_values.csv") as file:
        return list(csv.DictReader(file))


@pytest.mark.full
def test_the_sheet_of_noisy_forces_is_solved_by_scipy_alone(tmp_path):
    rows = values(tmp_path, lambda folder: pitch_plane.write_force_sheet(force_excited.noisy_problem(False), folder))
    k, d, m, inertia, g = 1e5, 1e4, (15.0, 15.0, 750.0), 500.0, 9.81
    t, front, rear = np.loadtxt(tmp_path / "noise.csv", delimiter=",", skiprows=1).T

    def rates(now, y):
        f3 = k * (y[2] - y[0] - np.sin(y[3])) + d * (y[6] - y[4] - y[7] * np.cos(y[3]))
        f4 = k * (y[2] - y[1] + np.sin(y[3])) + d * (y[6] - y[5] + y[7] * np.cos(y[3]))
        f1, f2 = np.interp(now, t, front), np.interp(now, t, rear)
        return [
            *y[4:],
            g + (f3 - f1) / m[0],
            g + (f4 - f2) / m[1],
            g - (f3 + f4) / m[2],
            np.cos(y[3]) * (f3 - f4) / inertia,
        ]

    start = (tmp_path / "noise.md").read_text().partition("Start: ")[2].partition(".\n")[0]
    y = np.array([float(part.partition(" = ")[2]) for part in start.split(", ")])
    for begin, end in pairwise(t):
        y = solve_ivp(rates, (begin, end), y, method="LSODA", rtol=1e-11, atol=1e-13).y[:, -1]
    assert y == pytest.approx([float(row["value"]) for row in rows], abs=1e-8)
    assert max(float(row["uncertainty"]) for row in rows) < 1e-11  # ten digits of what is of size 1


@pytest.mark.full
def test_the_sheet_of_the_inertial_unit_is_solved_by_scipy_alone(tmp_path):
    """Its formulas are read from the page, and the attitude is integrated from its rates by DOP853 over a minute."""
    rows = values(tmp_path, inertial_unit.write)
    text = (tmp_path / "unit.md").read_text()
    found = {name: re.search(rf"^    {name} += (.*)$", text, re.MULTILINE)[1] for name in ("roll", "pitch", "yaw")}
    names = {"sin": np.sin, "cos": np.cos}
    formulas = [re.sub(r"([\d.]+) (sin|t)", r"\1 * \2", found[name]) for name in found]

    def angles(t):
        return np.array([eval(formula, {**names, "t": t}) for formula in formulas])

    def rates(t, q):
        (roll, pitch, _), (r, p, y) = angles(t), (angles(t + 1e-5) - angles(t - 1e-5)) / 2e-5
        w = np.array(
            [
                r - y * np.sin(pitch),
                p * np.cos(roll) + y * np.sin(roll) * np.cos(pitch),
                -p * np.sin(roll) + y * np.cos(roll) * np.cos(pitch),
            ]
        )
        return 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])

    def attitude(t):
        return Rotation.from_euler("ZYX", angles(t)[::-1]).as_quat(scalar_first=True)

    end = np.array([float(row["value"]) for row in rows])
    assert attitude(600.0) * np.sign(attitude(600.0)[0] * end[0]) == pytest.approx(end, abs=2e-12)
    turned = solve_ivp(rates, (0.0, 20.0), attitude(0.0), method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    assert turned * np.sign(turned @ attitude(20.0)) == pytest.approx(attitude(20.0), abs=1e-8)  # differences: 1e-10


@pytest.mark.full
def test_the_sheet_of_ride_is_solved_by_scipy_alone(tmp_path):
    """One acceleration and one tyre force by ``quad`` over the wavenumber, from the sheet's matrices and spectra."""
    rows = values(tmp_path, ride.write)
    text, v = (tmp_path / "ride.md").read_text(), 20.0
    table = csv.DictReader((tmp_path / "ride.csv").read_text().splitlines())
    n, w, outputs = 19, 4, len(rows)
    shapes = {
        "M": (n, n),
        "D": (n, n),
        "K": (n, n),
        "R": (n, w),
        "S": (n, w),
        "A": (outputs, n),
        "V": (outputs, n),
        "P": (outputs, n),
        "H": (outputs, w),
        "E": (outputs, w),
    }
    m = {name: np.zeros(shape) for name, shape in shapes.items()}
    for line in table:
        m[line["matrix"]][int(line["row"]) - 1, int(line["column"]) - 1] = float(line["value"])
    x, y = np.array(re.findall(r"^\| \d \| [^|]+ \| (\S+) \| (\S+) \|$", text, re.MULTILINE), dtype=float).T
    (mean, at), (roll, of) = np.array(re.findall(r"= (\S+) / \(2 pi \(W\^2 \+ (\S+)\^2\)\)", text), dtype=float)

    def density(wave, row):
        s = 1j * v * wave
        late = np.exp(-1j * wave * (x.max() - x))
        z = np.column_stack([late, y * late])
        q = np.linalg.solve(s * s * m["M"] + s * m["D"] + m["K"], (m["R"] + s * m["S"]) @ z)
        out = (s * s * m["A"] + s * m["V"] + m["P"])[row] @ q + (m["H"] + s * m["E"])[row] @ z
        level = np.array([mean / (wave**2 + at**2), roll / (wave**2 + of**2)]) / (2 * np.pi)
        return 2 * float(np.abs(out) ** 2 @ level)

    assert np.isfinite(density(1.0, 0))
    for row in (0, 5):
        variance = sum(
            quad(density, a, b, (row,), limit=400, epsrel=1e-11)[0]
            for a, b in pairwise((0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 20.0, 100.0, 2000.0, np.inf))
        )
        assert variance**0.5 == pytest.approx(float(rows[row]["value"]), rel=1e-9)
