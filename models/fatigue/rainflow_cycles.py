"""Compiled rainflow counting of a load's turning points after ASTM E1049-85, section 5.4.4."""

import numpy as np

from models.machine.compiled import njit


@njit(cache=True, error_model="numpy")
def rainflow_cycles(turning_points):
    """Ranges (c,), means (c,) and counts (c,) of the rainflow cycles of turning points (n,); open cycles, the residue,
    count 0.5.

    Consecutive points differ and turn; the first and the last point of a load count among them.
    """
    stack, closed, first_range, top = np.empty(len(turning_points)), np.empty((len(turning_points), 3)), 0, 0
    n = 0
    for i in range(len(turning_points)):
        stack[top] = turning_points[i]
        top += 1
        while top - first_range >= 3:
            last_range, previous_range = abs(stack[top - 1] - stack[top - 2]), abs(stack[top - 2] - stack[top - 3])
            if last_range < previous_range:
                break
            closed[n] = previous_range, 0.5 * (stack[top - 2] + stack[top - 3]), 1.0
            if top - first_range == 3:
                closed[n, 2] = 0.5
                first_range += 1
            else:
                stack[top - 3] = stack[top - 1]
                top -= 2
            n += 1
    for i in range(first_range, top - 1):
        closed[n] = abs(stack[i + 1] - stack[i]), 0.5 * (stack[i + 1] + stack[i]), 0.5
        n += 1
    return closed[:n, 0].copy(), closed[:n, 1].copy(), closed[:n, 2].copy()
