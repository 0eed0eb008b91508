"""Export of the linear vehicle on its road for other programs: matrices as npz and mat, and as python-control's
StateSpace."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from models.core.whole_files import whole_file
from models.ride.covariance import StationaryCovariance
from models.ride.excited import DelayedSystem

if TYPE_CHECKING:
    import control


def exported_arrays(delayed_system: DelayedSystem, covariance: StationaryCovariance) -> dict[str, Any]:
    """Arrays for export by name: A, C, B and D of every axle (B1, D1, ...), delays (s), names, state covariance P and
    standard deviations of the outputs."""
    named: dict[str, Any] = {"A": delayed_system.A, "C": delayed_system.C}
    for i, (B, D) in enumerate(zip(delayed_system.B, delayed_system.D, strict=True), start=1):
        named |= {f"B{i}": B, f"D{i}": D}
    return named | {
        "delays": np.array(delayed_system.delays),
        "independent": delayed_system.independent,
        "outputs": np.array(delayed_system.names),
        "P": covariance.P,
        "deviation": covariance.deviation,
    }


def write_exports(delayed_system: DelayedSystem, covariance: StationaryCovariance, path_stem: Path) -> list[Path]:
    """Write the exported arrays to ``path_stem``.npz and ``path_stem``.mat; returns the paths of both files."""
    from scipy.io import savemat

    content = exported_arrays(delayed_system, covariance)
    paths = [path_stem.with_suffix(".npz"), path_stem.with_suffix(".mat")]
    with whole_file(paths[0]) as partial_path:
        np.savez(partial_path, allow_pickle=False, **content)
    with whole_file(paths[1]) as partial_path:
        savemat(partial_path, {**content, "outputs": content["outputs"].astype(object)})
    return paths


def control_state_space(delayed_system: DelayedSystem) -> "control.StateSpace":
    """State-space model of python-control in which each axle's noise is a separate input, axle after axle; the user
    must apply the delays.

    Inputs are named w1_1, w1_2, ... (axle, channel); the noise of axle i is that of the first, ``delays[i]`` later.
    """
    from control import StateSpace

    names = [f"w{i}_{k}" for i, B in enumerate(delayed_system.B, 1) for k in range(1, B.shape[1] + 1)]
    return StateSpace(
        delayed_system.A,
        np.hstack(delayed_system.B),
        delayed_system.C,
        np.hstack(delayed_system.D),
        inputs=names,
        outputs=list(delayed_system.names),
    )
