"""The point mass of the paper's Section 2: position and velocity covariances compared with 60-digit arithmetic and with
Monte Carlo."""

from collections.abc import Sequence
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np

from models.drift.point_mass import continuous_covariance, euler_covariance, monte_carlo_errors
from validation.common.bands import mean_square
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table

TITLE = "A point mass driven by a noisy force"
SYSTEM: System = "drift"
SEED = 20
DECIMAL_DIGITS = 60
FORCE_NOISE_DEVIATION, TIME_STEP, VEHICLE_MASS = 32.0, 1e-3, 780.0
"""Standard deviation of the force noise (N), step (s) and mass (kg) of the paper's vehicle."""
DAMPING_PRODUCTS = (0.0, 1e-8, 1e-4, 1e-2, 1.0, 100.0)
"""Products of the damping rate and the time, dimensionless."""
STEP_COUNTS = (10, 1_000_000)
END_TIME = 10.0
RELATIVE_TOLERANCE = 1e-10

DecimalMatrix = list[list[Decimal]]
BOUND_REASON = (
    "the linear equation of the covariance itself, stepped by squaring its matrix in 60 decimal digits: no sum, no "
    "integral and no digit shared with the closed form"
)


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows for both covariances compared with 60-digit arithmetic, for their difference, and for Monte Carlo; a quick
    run has 2000 paths."""
    exact = {
        "continuous": [_continuous_covariance_error(x) for x in DAMPING_PRODUCTS],
        **{f"{n} steps": [_discrete_covariance_error(x, n) for x in DAMPING_PRODUCTS] for n in STEP_COUNTS},
    }
    rows = [
        Observed(
            f"point_mass.{name.replace(' ', '_')}.{x:g}",
            SYSTEM,
            f"largest relative error of the covariance, {name}, product of damping and time {x:g}",
            error,
            "",
        ).at_most(RELATIVE_TOLERANCE, BOUND_REASON, "closed form")
        for name, errors in exact.items()
        for x, error in zip(DAMPING_PRODUCTS, errors, strict=True)
    ]
    differences = [
        [n, *(_discretisation_difference(x, n) for x in (0.0, 1.0, 10.0))] for n in (10, 100, 1000, 10_000, 100_000)
    ]
    rows.append(
        Observed(
            "point_mass.order",
            SYSTEM,
            "ratio of the discrete to the continuous variance of the position, no damping, n = 1000",
            1 - differences[2][1],
            "",
        ).within(7.4888 / 7.5, 1e-5, "1 - 3/(2n): 7.4888 against 7.5", "closed form")
    )
    for x in (0.0, 3.0):
        rows += _monte_carlo_rows(x, 2000 if quick else 10_000)
    return rows, {"errors": exact, "differences": differences}


def _matrix_power(matrix: DecimalMatrix, exponent: int) -> DecimalMatrix:
    """Integer power of a matrix, by squaring."""
    size = range(len(matrix))
    product = [[Decimal(int(i == j)) for j in size] for i in size]
    while exponent:
        if exponent % 2:
            product = _matrix_product(product, matrix)
        matrix, exponent = _matrix_product(matrix, matrix), exponent // 2
    return product


def _matrix_product(first_matrix: DecimalMatrix, second_matrix: DecimalMatrix) -> DecimalMatrix:
    """Product of two matrices in decimal arithmetic."""
    return [
        [
            sum((x * y for x, y in zip(row, column, strict=True)), Decimal(0))
            for column in zip(*second_matrix, strict=True)
        ]
        for row in first_matrix
    ]


def _matrix_exponential(matrix: DecimalMatrix) -> DecimalMatrix:
    """Matrix exponential by a Taylor series of the matrix divided by 2^20, squared 20 times."""
    small = [[value / 2**20 for value in row] for row in matrix]
    term = total = _matrix_power(small, 0)
    for k in range(1, 25):
        term = [[value / k for value in row] for row in _matrix_product(term, small)]
        total = [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
    return _matrix_power(total, 2**20)


def _continuous_covariance_error(damping_product: float) -> float:
    """Largest relative error of the continuous covariance P of position x and velocity v. Exact: d/dt (Pxx, Pxv, Pvv) =
    (2 Pxv, Pvv - eta Pxv, s^2 - 2 eta Pvv), with damping eta and noise intensity s^2."""
    eta = damping_product / END_TIME
    with localcontext(prec=DECIMAL_DIGITS):
        e, t = Decimal(eta), Decimal(END_TIME)
        gain = Decimal(FORCE_NOISE_DEVIATION) ** 2 * Decimal(TIME_STEP) / Decimal(VEHICLE_MASS) ** 2
        rates: DecimalMatrix = [
            [Decimal(0), 2 * t, Decimal(0), Decimal(0)],
            [Decimal(0), -e * t, t, Decimal(0)],
            [Decimal(0), Decimal(0), -2 * e * t, gain * t],
            [Decimal(0)] * 4,
        ]
        truth = [row[3] for row in _matrix_exponential(rates)]
        return _largest_covariance_error(
            continuous_covariance(END_TIME, FORCE_NOISE_DEVIATION, TIME_STEP, VEHICLE_MASS, eta), truth
        )


def _discrete_covariance_error(damping_product: float, step_count: int) -> float:
    """Largest relative error of the discrete covariance, compared with the matrix recursion of an Euler step in
    60-digit arithmetic. ``step_count`` steps make END_TIME."""
    step = END_TIME / step_count
    eta = min(damping_product / END_TIME, 1.9 / step)
    with localcontext(prec=DECIMAL_DIGITS):
        d = Decimal(step)
        r, kick = 1 - Decimal(eta) * d, (Decimal(FORCE_NOISE_DEVIATION) * d / Decimal(VEHICLE_MASS)) ** 2
        recursion: DecimalMatrix = [
            [Decimal(1), 2 * d, d * d, Decimal(0)],
            [Decimal(0), r, d * r, Decimal(0)],
            [Decimal(0), Decimal(0), r * r, kick],
            [Decimal(0)] * 3 + [Decimal(1)],
        ]
        truth = [row[3] for row in _matrix_power(recursion, step_count)]
        return _largest_covariance_error(
            euler_covariance(step_count, FORCE_NOISE_DEVIATION, step, VEHICLE_MASS, eta), truth
        )


def _largest_covariance_error(covariance: np.ndarray, exact_values: Sequence[Decimal]) -> float:
    """Largest relative error of the entries xx, xv and vv of a covariance."""
    return max(
        float(abs(Decimal(float(value)) / true - 1))
        for value, true in zip(covariance[[0, 0, 1], [0, 1, 1]], exact_values, strict=False)
    )


def _discretisation_difference(damping_product: float, step_count: int) -> float:
    """1 minus the ratio of the discrete to the continuous variance of the position."""
    step = END_TIME / step_count
    arguments = (FORCE_NOISE_DEVIATION, step, VEHICLE_MASS, damping_product / END_TIME)
    return 1 - float(euler_covariance(step_count, *arguments)[0, 0] / continuous_covariance(END_TIME, *arguments)[0, 0])


def _monte_carlo_rows(damping_product: float, noise_path_count: int) -> list[Row]:
    """Rows: Monte Carlo variance of the position, and mean square of position and velocity together, weighted by the
    inverse covariance of the law."""
    steps = 1000
    arguments = (FORCE_NOISE_DEVIATION, TIME_STEP, VEHICLE_MASS, damping_product / (steps * TIME_STEP))
    law, drawn = euler_covariance(steps, *arguments), monte_carlo_errors(noise_path_count, steps, *arguments, seed=SEED)
    distance = float(np.mean(np.sum(drawn * np.linalg.solve(law, drawn.T).T, axis=1))) / 2
    why = f"{noise_path_count:,} paths of {steps} explicit Euler steps, seed {SEED}"
    return [
        mean_square(
            Observed(
                f"point_mass.position.{damping_product:g}",
                SYSTEM,
                f"variance of the position by Monte Carlo, product of damping and time {damping_product:g}",
                float(np.mean(drawn[:, 0] ** 2)),
                "m^2",
            ),
            float(law[0, 0]),
            noise_path_count,
            why,
        ),
        mean_square(
            Observed(
                f"point_mass.joint.{damping_product:g}",
                SYSTEM,
                "half the mean squared distance, which tests the whole covariance by Monte Carlo, "
                f"product of damping and time {damping_product:g}",
                distance,
                "",
            ),
            1.0,
            2 * noise_path_count,
            why,
        ),
    ]


def tables(case_data: Saved) -> list[Table]:
    """Table of the relative errors of both covariances."""
    rows = tuple((name, *(f"{error:.1e}" for error in errors)) for name, errors in case_data["errors"].items())
    note = (
        f"Worst entry of the covariance against {DECIMAL_DIGITS} digits, over damping times time. Ten steps cannot be "
        "stable at 100: there the damping is that of 1.9 per step."
    )
    return [Table("Relative error of the covariances", note, ("", *(f"{x:g}" for x in DAMPING_PRODUCTS)), rows)]


def draw(case_data: Saved) -> Drawn:
    """Plot the position's standard deviation over time, and the difference of the Euler scheme from its limit over the
    number of steps."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, axes = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    times = np.geomspace(0.01, 100.0, 81)
    for i, eta in enumerate((0.0, 0.1, 1.0)):
        exact = [
            continuous_covariance(t, FORCE_NOISE_DEVIATION, TIME_STEP, VEHICLE_MASS, eta)[0, 0] ** 0.5 for t in times
        ]
        step_counts = np.unique(np.geomspace(10, 1e5, 13).astype(int))
        euler = [
            euler_covariance(int(n), FORCE_NOISE_DEVIATION, TIME_STEP, VEHICLE_MASS, eta)[0, 0] ** 0.5
            for n in step_counts
        ]
        axes[0].loglog(times, exact, color=f"C{i}", label=f"damping {eta:g} 1/s")
        axes[0].loglog(step_counts * TIME_STEP, euler, "o", color=f"C{i}", markersize=3.5)
    axes[0].set(title="Position: standard deviation [m]", xlabel="time [s]")
    axes[0].legend(title="line: eq. (11); dots: Euler scheme", loc="upper left")
    steps, *columns = np.array(case_data["differences"]).T
    for x, column in zip((0, 1, 10), columns, strict=True):
        axes[1].loglog(steps, np.abs(column), "o-", markersize=3.5, label=f"damping times time {x}")
    axes[1].loglog(steps, 1.5 / steps, color="black", linestyle=":", label="3 / (2n)")
    axes[1].set(title="Euler scheme against its limit [-]", xlabel="steps n [-]")
    axes[1].legend()
    add_heading(figure, "A point mass under white force noise, 32 N at 1 kHz on 780 kg: Euler steps and their limit")
    caption = "Error of a point mass's position over time, continuous and in Euler steps; the two differ by O(1/n)."
    return [(caption, figure)]
