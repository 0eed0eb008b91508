"""What the other code wrote of a mechanism's motion: a table, its digits, and the energy that its motion lost."""

import csv
import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from models.core.errors import InputError
from validation.adams_joints.mechanism import Mechanism
from validation.adams_joints.motion import BodyMotion, Reaction, reaction_by_momentum

COLUMN_GROUPS = {"Pos": 3, "Quat": 4, "Vel": 3, "Avel": 3, "Acc": 3, "Aacc": 3, "Rforce": 3, "Rtorque": 3}
"""Groups of columns, numbered from 1."""


@dataclass(frozen=True, eq=False)
class OutputFile:
    """Table of an output file. times (m,) s; columns: arrays (m, 3 or 4) by group, as in COLUMN_GROUPS; digits: number
    of significant digits in the file."""

    times: np.ndarray
    columns: dict[str, np.ndarray]
    digits: int

    def rounding(self, column_group: str) -> np.ndarray:
        """Rounding error (m, columns) of a group's numbers: half of their last digit."""
        size = np.maximum(np.abs(self.columns[column_group]), 1e-30)
        return 0.5 * 10.0 ** (np.floor(np.log10(size)) - self.digits + 1)

    def motion(self, mechanism: Mechanism) -> BodyMotion:
        """The body's motion as the file gives it."""
        scalar, *vector = self.columns["Quat"].T
        rotations = Rotation.from_quat(np.column_stack([*vector, scalar])).as_matrix() @ mechanism.axes.T
        c = self.columns
        return BodyMotion(self.times, c["Pos"], c["Vel"], c["Acc"], rotations, c["Avel"], c["Aacc"])

    def energies(self, mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray]:
        """Kinetic energy and total energy (m,) in J. The total is the sum of the kinetic and the gravitational
        energy."""
        motion = self.motion(mechanism)
        inertia = motion.turned @ mechanism.inertia @ np.transpose(motion.turned, (0, 2, 1))
        kinetic = 0.5 * mechanism.mass * (motion.velocity**2).sum(axis=1)
        kinetic += 0.5 * np.einsum("mi,mij,mj->m", motion.turning, inertia, motion.turning)
        return kinetic, kinetic - mechanism.mass * motion.place @ mechanism.gravity

    def energy_lost(self, mechanism: Mechanism) -> float:
        """Ratio of the largest change of total energy to the largest kinetic energy; 0 for a body at rest."""
        kinetic, total_energy = self.energies(mechanism)
        return float(np.abs(total_energy - total_energy[0]).max() / max(kinetic.max(), 1e-30))

    def reaction(self) -> Reaction:
        """The reaction force and moment that the file gives."""
        return Reaction(self.columns["Rforce"], self.columns["Rtorque"])

    def reaction_of_motion(self, mechanism: Mechanism) -> Reaction:
        """Reaction by Newton's and Euler's equations from the file's own motion."""
        return reaction_by_momentum(mechanism, self.motion(mechanism))


def read_output(path: str | Path) -> OutputFile:
    """The table of a file, plain or compressed; InputError names the column or the line that is wrong."""
    path = Path(path)
    try:
        with (gzip.open if path.suffix == ".gz" else open)(path, "rt", encoding="utf-8") as file:
            names, *rows = csv.reader(file)
    except (OSError, ValueError) as error:
        raise InputError(path, "", None, f"the file cannot be read: {error}") from None
    groups = {group: [f"{group}{k + 1}" for k in range(count)] for group, count in COLUMN_GROUPS.items()}
    missing = [name for column_names in (["time"], *groups.values()) for name in column_names if name not in names]
    if missing:
        raise InputError(path, "header", missing[0], "is missing")
    try:
        table = np.array(rows, float)
    except ValueError as error:
        raise InputError(path, "rows", None, f"must hold a number in every column: {error}") from None
    digits = max(_significant_digits(cell) for row in rows for cell in row)
    columns = {group: table[:, [names.index(name) for name in column_names]] for group, column_names in groups.items()}
    return OutputFile(table[:, names.index("time")], columns, digits)


def _significant_digits(cell: str) -> int:
    """Significant digits of a number as it is written."""
    return len(cell.lower().partition("e")[0].replace(".", "").lstrip("+-0"))


def starts_with_mechanism(mechanism: Mechanism, output: OutputFile) -> bool:
    """Whether the body's position in the file's first row is that of the mechanism at its start."""
    return bool(np.abs(output.columns["Pos"][0] - mechanism.centre).max() <= 1e-5)
