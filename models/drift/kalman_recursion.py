"""An extended Kalman filter over all samples of a run, compiled as one loop.

It does what filterpy's ``ExtendedKalmanFilter`` does, in the same order and in Joseph form: P = F P F' + Q, then
K = P H' (H P H' + R)^-1, x = x + K (z - H x), P = (I - K H) P (I - K H)' + K R K'. A step of filterpy's costs ten
times the vehicle's own with all its derivatives, because each of its products of 7 x 7 numbers is a call of its own.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from models.compiled import lean

STATES = 7


class Trace(NamedTuple):
    """All that a filter's run leaves, at n times.

    states, covariances : (n, 7), (n, 7, 7), after what was measured at that time
    pending : (n, 7, 2), response to the force sample of that very instant, per N: not yet in the covariance
    predictions, transitions, noises : (n, 7), (n, 7, 7), (n, 7, 7), of the step that ends there
    used : (n,), measured numbers; surprises : (n,), normalised innovation squared, NaN where nothing was measured
    """

    states: np.ndarray
    covariances: np.ndarray
    pending: np.ndarray
    predictions: np.ndarray
    transitions: np.ndarray
    noises: np.ndarray
    used: np.ndarray
    surprises: np.ndarray


def blank(n: int) -> Trace:
    """A trace of n times with nothing in it yet."""
    square = (n, STATES, STATES)
    return Trace(np.zeros((n, STATES)), np.zeros(square), np.zeros((n, STATES, 2)), np.zeros((n, STATES)),
                 np.zeros(square), np.zeros(square), np.zeros(n, dtype=np.int64), np.full(n, math.nan))  # fmt: skip


def recursion(respond: Any) -> Any:
    """The loop over a vehicle's steps, in Python: to be compiled under a name of its own.

    respond : the step with its derivatives, compiled into the loop; see ``pitch_step.responding``
    The loop's arguments: x (7,) and covariance (7, 7) at the start, which it goes on with; intensity, variance (N^2)
    of a force sample; ``steps``, what respond takes after x, with the inputs of the whole run; ``measured``: values
    (rows, m), columns (m,) of the state, variances (m,), steps from row to row, with m of one or two; and the trace,
    which it fills. It returns the first time whose estimate is infinite or not a number, or -1.
    """

    def march(x, covariance, intensity, steps, measured, trace):
        step, count, inputs, rows, p, hats = steps
        values, columns, variances, every = measured
        late, work, left = np.zeros((7, 2)), np.empty((7, 7)), np.empty((7, 7))
        push, gain, noise, there = np.empty((7, 2)), np.empty((7, 2)), np.empty((2, 2)), np.empty(2, dtype=np.int64)
        for i in range(len(trace.states)):
            if i > 0:
                first = (i - 1) * count * rows[2]
                found = respond(x, step, count, inputs[first : first + len(hats)], rows, p, hats)
                predict(found, x, covariance, late, intensity, push, work, trace.transitions[i], trace.noises[i])
            if not finite(x, covariance):
                return i
            copy(x, trace.predictions[i])
            if i % every == 0 and i // every < len(values):
                seen = values[i // every]
                trace.used[i] = m = present(seen, there)
                if m > 0:
                    own_noise(late, intensity, columns, variances, there, m, noise)
                    trace.surprises[i] = update(x, covariance, seen, columns, there, m, noise, gain, left, work)
            copy(x, trace.states[i])
            copy(covariance.reshape(49), trace.covariances[i].reshape(49))
            copy(late.reshape(14), trace.pending[i].reshape(14))
        return -1

    return march


@lean
def copy(values, place):
    """A row assigned at once takes seconds to compile."""
    for i in range(len(values)):
        place[i] = values[i]


@lean
def finite(x, covariance):
    """Whether nothing in state and covariance is infinite or not a number."""
    total = 0.0
    for i in range(len(x)):
        for j in range(len(x)):
            total += x[i] * covariance[i, j] * x[j]
    return math.isfinite(total)


@lean
def product(a, b, found):
    """Matrix product a b."""
    for i in range(len(a)):
        for j in range(b.shape[1]):
            found[i, j] = 0.0
            for k in range(len(b)):
                found[i, j] += a[i, k] * b[k, j]


@lean
def transposed(a, b, m, found):
    """Matrix product a b' over the first m columns of both."""
    for i in range(len(a)):
        for j in range(len(b)):
            found[i, j] = 0.0
            for k in range(m):
                found[i, j] += a[i, k] * b[j, k]


@lean
def predict(found, x, covariance, late, intensity, push, work, transition, noise):
    """State, covariance and what is late after a step that gave ``found`` (7, 12), in place.

    A force sample that is read linearly acts on the step before it, too. That part, ``late``, is not in the
    covariance: it joins one step later, with what the same sample does then. So the noise that joins is white, and
    the covariance of the error is the covariance with the part that is late.
    """
    n = len(x)
    for i in range(n):
        x[i] = found[i, 0]
        for j in range(n):
            transition[i, j] = found[i, 1 + j]
    product(transition, late, push)
    for i in range(n):
        for j in range(2):
            push[i, j] += found[i, 8 + j]
            late[i, j] = found[i, 10 + j]
    transposed(push, push, 2, noise)
    product(transition, covariance, work)
    transposed(work, transition, n, covariance)
    for i in range(n):
        for j in range(n):
            noise[i, j] *= intensity
            covariance[i, j] += noise[i, j]


@lean
def present(seen, there):
    """Where the numbers stand in a row of the measurement, into ``there``; how many."""
    m = 0
    for i in range(len(seen)):
        if math.isfinite(seen[i]):
            there[m] = i
            m += 1
    return m


@lean
def own_noise(late, intensity, columns, variances, there, m, noise):
    """Covariance (m, m) of m measured numbers: their own noise, and the late part of the force sample in the state."""
    for i in range(m):
        for j in range(m):
            a, b = columns[there[i]], columns[there[j]]
            noise[i, j] = intensity * (late[a, 0] * late[b, 0] + late[a, 1] * late[b, 1])
        noise[i, i] += variances[there[i]]


@lean
def update(x, covariance, seen, columns, there, m, noise, gain, left, work):
    """State and covariance after m measured numbers, one or two, in place; the normalised innovation squared."""
    n, first, last = len(x), there[0], there[m - 1]
    a, b = columns[first], columns[last]
    aa, ab = covariance[a, a] + noise[0, 0], covariance[a, b] + noise[0, m - 1]
    ba, bb = covariance[b, a] + noise[m - 1, 0], covariance[b, b] + noise[m - 1, m - 1]
    volume = aa * bb - ab * ba if m == 2 else aa
    ia, ib, ic, id = (bb / volume, -ab / volume, -ba / volume, aa / volume) if m == 2 else (1.0 / aa, 0.0, 0.0, 0.0)
    wrong_a, wrong_b = seen[first] - x[a], seen[last] - x[b]
    for i in range(n):
        gain[i, 0] = covariance[i, a] * ia + covariance[i, b] * ic
        gain[i, 1] = covariance[i, a] * ib + covariance[i, b] * id
    for i in range(n):
        x[i] += gain[i, 0] * wrong_a + gain[i, 1] * wrong_b
        for j in range(n):
            left[i, j] = 1.0 if i == j else 0.0
        left[i, a] -= gain[i, 0]
        left[i, b] -= gain[i, 1]
    product(left, covariance, work)
    transposed(work, left, n, covariance)
    for i in range(n):
        for j in range(n):
            for k in range(m):
                for q in range(m):
                    covariance[i, j] += gain[i, k] * noise[k, q] * gain[j, q]
    return wrong_a * (ia * wrong_a + ib * wrong_b) + wrong_b * (ic * wrong_a + id * wrong_b)
