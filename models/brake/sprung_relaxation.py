"""Tyres with lagging slip angles on a vehicle on its suspension: the law of ``models.brake.relaxation`` at its wheel
contacts.

Where a step begins, the speeds there move the angles over the half of the step before, which had to wait for them, and
over the half of this one: no state has its forces taken for the lag alone.
"""

from typing import NamedTuple

import numpy as np

from models.brake.relaxation import advance_lagging_slip
from models.machine.compiled import lean


class ContactLag(NamedTuple):
    """Tyres with lagging slip angles, as ``TyreLag``: length and angle (W,), and behind (1,): the time (s) by which the
    angles lie behind the motion.
    """

    length: np.ndarray
    angle: np.ndarray
    behind: np.ndarray


@lean
def advance_contact_lag(wheel_contacts, half_step, cornering_coefficient, contact_lag, surfaces):
    """Advance a ``ContactLag`` to half a step (s) after the motion in ``WheelContact`` records; put its slip angles
    into the ``WheelSurfaces``.
    """
    time = contact_lag.behind[0] + half_step
    for i in range(contact_lag.angle.size):
        advance_lagging_slip(
            i, wheel_contacts.along[i], wheel_contacts.across[i], time, cornering_coefficient, contact_lag, surfaces.lag
        )
    contact_lag.behind[0] = half_step
