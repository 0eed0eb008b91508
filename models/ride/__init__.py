"""Random vibration of linear vehicles on rough roads: covariances of the outputs, and the measures that engineers read
from them.

Axes of this package are those of ride and of ISO 8855: x forward, y to the **left**, z **up** from the ground; roll,
pitch and yaw (rx, ry, rz) are right-handed rotations about them, so that pitch is positive nose **down**. Road heights
are positive up. (The pitch-plane vehicle keeps its paper's axes, z down: see ``models``.)

Spectral densities are two-sided over the wavenumber in rad/m wherever nothing else is said: the variance is the
integral from minus to plus infinity. Noise w of intensity q has E[w(s) w(s + d)] = q delta(d).
"""
