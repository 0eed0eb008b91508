"""Output files of Adams/Solver: table of a body's motion, its number of digits, and the energy that the motion lost."""

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
"""Group of columns in an output file -> number of columns; columns are numbered from 1."""


@dataclass(frozen=True, eq=False)
class OutputFile:
    """Table of an output file. times (m,) s; columns: arrays (m, 3 or 4) by group, as in COLUMN_GROUPS; digit_count:
    number of significant digits in the file."""

    times: np.ndarray
    columns: dict[str, np.ndarray]
    digit_count: int

    def rounding_error(self, column_group: str) -> np.ndarray:
        """Largest rounding error (m, 3 or 4) of the numbers of a column group: half of their last digit."""
        size = np.maximum(np.abs(self.columns[column_group]), 1e-30)
        return 0.5 * 10.0 ** (np.floor(np.log10(size)) - self.digit_count + 1)

    def motion(self, mechanism: Mechanism) -> BodyMotion:
        """Motion of the body as stated in the file."""
        scalar, *vector = self.columns["Quat"].T
        rotations = Rotation.from_quat(np.column_stack([*vector, scalar])).as_matrix() @ mechanism.axes.T
        c = self.columns
        return BodyMotion(self.times, c["Pos"], c["Vel"], c["Acc"], rotations, c["Avel"], c["Aacc"])

    def energies(self, mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray]:
        """Kinetic energy and total energy (m,) in J. The total is the sum of the kinetic and the gravitational
        energy."""
        motion = self.motion(mechanism)
        inertia = motion.rotation @ mechanism.inertia @ np.transpose(motion.rotation, (0, 2, 1))
        kinetic = 0.5 * mechanism.mass * (motion.velocity**2).sum(axis=1)
        kinetic += 0.5 * np.einsum("mi,mij,mj->m", motion.angular_velocity, inertia, motion.angular_velocity)
        return kinetic, kinetic - mechanism.mass * motion.position @ mechanism.gravity

    def energy_lost(self, mechanism: Mechanism) -> float:
        """Largest change of the total energy divided by the largest kinetic energy; 0 for a body at rest."""
        kinetic, total_energy = self.energies(mechanism)
        return float(np.abs(total_energy - total_energy[0]).max() / max(kinetic.max(), 1e-30))

    def reaction(self) -> Reaction:
        """Reaction force and moment of joint and springs as stated in the file."""
        return Reaction(self.columns["Rforce"], self.columns["Rtorque"])

    def reaction_of_motion(self, mechanism: Mechanism) -> Reaction:
        """Reaction of joint and springs computed from the motion stated in the file, by Newton's and Euler's
        equations."""
        return reaction_by_momentum(mechanism, self.motion(mechanism))


def read_output(output_path: str | Path) -> OutputFile:
    """Read an output file, plain or compressed (.gz). Raises InputError that names the wrong column or line."""
    output_path = Path(output_path)
    try:
        with (gzip.open if output_path.suffix == ".gz" else open)(output_path, "rt", encoding="utf-8") as file:
            names, *rows = csv.reader(file)
    except (OSError, ValueError) as error:
        raise InputError(output_path, "", None, f"the file cannot be read: {error}") from None
    groups = {group: [f"{group}{k + 1}" for k in range(count)] for group, count in COLUMN_GROUPS.items()}
    missing = [name for column_names in (["time"], *groups.values()) for name in column_names if name not in names]
    if missing:
        raise InputError(output_path, "header", missing[0], "is missing")
    try:
        table = np.array(rows, float)
    except ValueError as error:
        raise InputError(output_path, "rows", None, f"must hold a number in every column: {error}") from None
    digits = max(_significant_digits(cell) for row in rows for cell in row)
    columns = {group: table[:, [names.index(name) for name in column_names]] for group, column_names in groups.items()}
    return OutputFile(table[:, names.index("time")], columns, digits)


def _significant_digits(number_text: str) -> int:
    """Number of significant digits in the text of a number."""
    return len(number_text.lower().partition("e")[0].replace(".", "").lstrip("+-0"))


def starts_with_mechanism(mechanism: Mechanism, output_file: OutputFile) -> bool:
    """Whether the body's position in the first row of the output file equals the start position of the mechanism."""
    return bool(np.abs(output_file.columns["Pos"][0] - mechanism.centre).max() <= 1e-5)
