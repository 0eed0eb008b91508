"""Stated errors of the creep forces of a contact: errors of the finite cells and of the theory."""

from collections.abc import Sequence

import numpy as np

from models.contact.accuracy import ContactErrors
from models.contact.theories import LinearTheory, RollingContact
from models.core.discretisation import (
    Estimate,
    finite_rms,
    grid_error,
    not_estimated,
    with_stated_errors,
    with_theory_error,
)
from models.core.result import Result
from models.systems.contact.scene import ContactScene

LARGEST_CELL_COUNT = 400
HALVED_CELLS_TEXT = "half the cells along each axis"
BAND_TEXT = "which 95 % of such contacts keep to"


def with_error(
    run_result: Result, scene: ContactScene, rolling_contact: RollingContact, contact_errors: Sequence[ContactErrors]
) -> Result:
    """Returns the result with the stated errors of force and moment, each as the root mean square over all creepages.

    Relative errors of the force refer to its root mean square. Those of the moment, which may vanish, refer to that
    force times the contact's lever. Raises RunFailed where the cells are too few.
    """
    force = finite_rms(np.hypot(run_result["fx"], run_result["fy"]))
    sizes = {"force": (force, "N"), "mz": (force * rolling_contact.lever, "N m")}
    likely = {"force": [e.likely for e in contact_errors], "mz": [e.moment_likely for e in contact_errors]}
    cells, order = scene.method.cells, min(rolling_contact.order, 1.5)
    estimates = {
        name: grid_error(finite_rms(np.array(likely[name])), *sizes[name], cells, order, LARGEST_CELL_COUNT)
        for name in likely
    }
    if isinstance(rolling_contact, LinearTheory):
        not_estimated(run_result, "the linear theory has no cells")
    else:
        with_stated_errors(run_result, estimates, HALVED_CELLS_TEXT)
    theory = finite_rms(run_result["error_of_theory"])
    return (
        with_theory_error(run_result, {"force": _theory_estimate(theory, force)}, BAND_TEXT)
        if theory > 0.0
        else run_result
    )


def with_error_of_rows(table_result: Result, scene: ContactScene) -> Result:
    """Returns the result of a table of cases with its stated errors, as root mean squares over the rows in the result:
    the error of the cells, and the error of the theory, which 95 % of cases do not exceed.
    """
    force = finite_rms(np.hypot(table_result["fx"], table_result["fy"]))
    cells, order = scene.method.cells, min(scene.method.order, 1.5)
    with_stated_errors(
        table_result,
        {"force": grid_error(finite_rms(table_result["error_of_cells"]), force, "N", cells, order, LARGEST_CELL_COUNT)},
        HALVED_CELLS_TEXT,
    )
    return with_theory_error(
        table_result, {"force": _theory_estimate(finite_rms(table_result["error_of_theory"]), force)}, BAND_TEXT
    )


def _theory_estimate(theory_error: float, force_size: float) -> Estimate:
    return Estimate(theory_error, "N", theory_error / force_size if force_size > 0.0 else 0.0, 0.0, 0.0)
