"""What exists, and how it moves: the conventions that every file of twinrig keeps.

Axes
    Right-handed, x forward, y to the right, z **down**. A road that rises has a negative height
    ``zeta``; gravity acts along +z.
Pitch
    ``pitch`` (the paper's beta) is the rotation about +y, positive **nose up**: a point of the chassis
    at x = +b ahead of the centre of mass lies at z3 - b sin(pitch).
Wheels
    1 is the front one, 2 the rear one. ``a`` is the distance from the centre of mass to the **rear**
    axle and ``b`` to the **front** axle (as in the paper, eq. 35, not as in most textbooks).
Forces
    Wheel forces f1, f2 act from the road on the wheels and are positive **up** (compression).
    Suspension forces f3 (front), f4 (rear) are positive in compression: they push the chassis up
    and the wheels down.
Units
    SI everywhere inside: m, kg, s, N, rad. Files state their units in their headers and are
    converted once, where they are read.
States
    y = (z1, z2, z3, pitch, z1', z2', z3', pitch'); shapes are (8,) or (n, 8). The zero of every
    coordinate is the unstressed vehicle on the flat road, not the static equilibrium.
Time
    Time steps are counted, never accumulated: sample i of a run lies at t = i h. "Held" samples are
    constant over a step, "linear" ones are read at the time of the integrator's stage.
Noise
    A standard deviation of samples always comes with its sampling rate; noise is drawn before a run
    and belongs to the samples, never to the integrator's step.
"""

from models.core.moved import register_old_module_finder
from models.machine.threads import use_one_thread

use_one_thread()
register_old_module_finder()
