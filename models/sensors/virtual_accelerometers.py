"""What tri-axial accelerometers on the chassis would read, on rigid mounts or on a bracket that gives way."""

import numpy as np

from models.sensors.rotations import from_cardan, matrix, skew


def readings(
    places: np.ndarray,
    pitch: np.ndarray,
    rate: np.ndarray,
    heave_acceleration: np.ndarray,
    pitch_acceleration: np.ndarray,
    gravity: float,
) -> np.ndarray:
    """Specific forces (n, sensors, 3) in m/s^2, in the chassis' axes (x forward, y right, z down), eqs (16), (17).

    places : (sensors, 3) in m from the centre of mass, local; pitch (rad, nose up), its rate and acceleration, and
    the heave acceleration (m/s^2, down), each (n,). The vehicle moves in its plane: no roll, no yaw, no surge.
    """
    count = len(pitch)
    none = np.zeros(count)
    turn = matrix(from_cardan(none, pitch, none))
    alpha, w = (np.column_stack([none, values, none]) for values in (pitch_acceleration, rate))
    felt = (heave_acceleration - gravity)[:, None] * turn[:, 2]  # S^T along the global vertical
    return in_space(places, felt, w, alpha)


def in_space(places: np.ndarray, felt: np.ndarray, w: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Specific forces (n, sensors, 3) in m/s^2, in the body's axes, eqs (16), (17), whatever its motion.

    places : (sensors, 3) in m from a point of the body that feels ``felt`` (n, 3); w, alpha : (n, 3), the body's rates
    and their derivatives about its own axes, rad/s and rad/s^2. Any right-handed axes.
    """
    lever = skew(alpha) + skew(w) @ skew(w)
    return felt[:, None] + np.einsum("nij,sj->nsi", lever, np.asarray(places))


def on_bracket(mount: np.ndarray, period: float, frequency: float, damping: float) -> np.ndarray:
    """Reading (n, 3) of a sensor on a light bracket from that of a rigid mount (n, 3), sampled every ``period`` (s).

    Along each of the body's axes a one-way coupled oscillator of natural frequency (Hz) and damping ratio: its
    mass is too small to move the body, and what the sensor feels is what spring and damper pass on,
    (2 zeta w0 s + w0^2) / (s^2 + 2 zeta w0 s + w0^2) of the mount's. Exact for readings that are linear between
    their samples, whatever the period; at the first sample it is at rest under that reading.
    """
    from scipy.signal import cont2discrete, lfilter, lfilter_zi, ss2tf

    w0 = 2 * np.pi * frequency
    change = np.array([[0.0, 1.0], [-(w0**2), -2 * damping * w0]])
    *system, _ = cont2discrete((change, np.eye(2)[:, 1:], -change[1:], np.zeros((1, 1))), period, method="foh")
    upper, lower = ss2tf(*system)
    start = lfilter_zi(upper[0], lower)
    return lfilter(upper[0], lower, mount, axis=0, zi=start[:, None] * mount[0])[0]
