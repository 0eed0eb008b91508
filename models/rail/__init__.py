"""A railway wheelset on straight track, from its linear theory to the limit cycle.

Axes
    Of the track: x in the direction of travel, y to the right, z down. The frame moves along x with the speed; y and z
    of the wheelset's centre, its yaw (about z, from x to y) and roll (about the axle's own x) are zero where both
    wheels just touch in the middle of the track. Rotation from wheelset to track: roll first, then yaw.
Contact
    Of each wheel: x as the track's, y to the right along the rail's surface, z into the rail, as in ``models.contact``.
Order
    The right wheel comes before the left one.
Units
    SI: m, s, kg, N, rad.
"""
