"""Assumptions behind friction values that are read from a tyre table."""

import numpy as np

from models.core.assumptions import Assumption
from models.tyre.tyre_table import TyreTable


def tyre_table_assumptions(tyre_table: TyreTable, wheel_load: float) -> list[Assumption]:
    """Assumptions of a result over "slip_angle" (deg) under a wheel_load (N): that both lie within the tyre table.

    A table of one load holds for all of them.
    """
    listed = [
        Assumption(
            "slip angles in the table",
            "slip angles lie within the tyre's table, whose last value holds beyond",
            "ask for smaller options.slip_angles, or name a table in tyres.files that reaches farther",
            lambda run: {"slip angles": run["slip_angle"]},
            "deg",
            upper_limit=float(np.rad2deg(tyre_table.angles[-1])) * (1.0 + 1e-9),
        )
    ]
    if tyre_table.loads.size > 1:
        listed.append(
            Assumption(
                "loads in the table",
                "the load lies within the tyre's table, whose last value holds beyond",
                "ask for another options.load, or name a table in tyres.files that reaches farther",
                lambda run: {"load": np.array([wheel_load])},
                "N",
                float(tyre_table.loads[0]),
                float(tyre_table.loads[-1]),
            )
        )
    return listed
