"""The catalogue of 54 hard cases that practice and literature know, and the cases here that stand for each.

A number of the catalogue is a class of failures; a case is one scene with an answer.
"""

COVERED: dict[int, tuple[str, tuple[str, ...]]] = {
    1: (
        "callback force missing in an implicit engine's derivative",
        ("stiff damper, step just inside the limit", "stiff damper, step just beyond the limit"),
    ),
    2: ("automatic reset, finite garbage", ("automatic reset", "finite but huge states", "NaN past the reader")),
    3: ("contact-point state as an engine's activation", ("contact point under a sudden force",)),
    4: (
        "the same under an implicit method that rings",
        ("contact point under a ramp", "contact point along an adaptive run"),
    ),
    5: ("sudden load with a large step", ("sudden load",)),
    6: (
        "creep damping at low speed",
        (
            "wheelset at 1 micrometre per second",
            "rig at 0.1 m/s in steps of 1 ms",
            "step of 0.5 ms at standstill",
            "wheelset that stands on a slope",
        ),
    ),
    7: ("adaptive solver on held noise", ("adaptive solver on held noise", "bump after a long flat road")),
    8: ("sample index from accumulated time", ("replay of a ramp",)),
    9: ("held against linear samples", ("held against linear",)),
    10: ("gravity, inertia and contacts that an engine adds", ("nothing but what is described",)),
    11: ("z down or up, sign of pitch", ("+z is down", "nose up", "more force in front")),
    12: ("restart from a saved state", ("restart from a saved state", "repeated run", "stream in pieces")),
    13: ("output stamps of adaptive solvers", ("adaptive output stamps",)),
    14: ("Newton tolerance against step", ("order down to fine steps",)),
    15: ("free heave and pitch", ("unconstrained heave", "momentum")),
    16: ("exact pitch, multiplier without damping", ("multiplier without damping", "enforced moment")),
    17: (
        "noise on prescribed pitch",
        (
            "noise of 1e-6 rad on the pitch",
            "the same noise, an eighth of the step",
            "noise of 1e-6 on prescribed heave and pitch",
        ),
    ),
    18: ("pitch interpolated between its samples", ("pitch data between the samples",)),
    19: ("pitch eliminated by hand", ("enforced moment", "pitch of a free run, prescribed")),
    20: ("pitch and its derivatives not consistent", ("gap of the constraint",)),
    21: ("solver settings that constraints do not survive", ("explicit solver, active constraint",)),
    22: ("noise per step in place of per sample", ("samples belong to the recorder",)),
    23: ("noise drawn inside a callback", ("accelerations asked again",)),
    24: ("noisy quaternion, Ito or Stratonovich", ("white noise on a gyro",)),
    25: ("order under noise", ("samples belong to the recorder", "adaptive solver on held noise")),
    26: ("white noise through a tyre's damper", ("tyre damping on a road of first order",)),
    27: ("shape filter by explicit Euler", ("shape filter at any step",)),
    28: ("delay rounded to steps", ("delay between steps",)),
    29: ("streams that are one", ("streams of noise", "stream in pieces")),
    30: ("exponent of growth", ("growth law at no growth", "forces in the body's frame")),
    31: ("free vehicle in Lyapunov's equation", ("car that is free on the road", "roll steer on a free car")),
    32: ("speed towards zero", ("speeds of 1 mm/s and 300 m/s", "weighting at 1 mm/s", "no speed")),
    33: ("stiffness ratios", ("stiffness ratio of 1e9", "wheel of a milligram")),
    34: ("sign of the delay", ("delay of hours", "two axles at one place")),
    35: ("indefinite right side", ("delayed axle in Lyapunov's equation",)),
    36: ("nearly equal poles", ("threefold eigenvalue",)),
    37: (
        "covariance of a filter from far off",
        ("filter from a wrong start", "process noise of a stiff vehicle", "filter told of angles to a billionth"),
    ),
    38: ("missing measurement", ("pitch measurement with an outage", "pitch measurement without a number")),
    39: ("filter surer than it may be", ("pitch measurement with an outage", "filter from a wrong start")),
    40: ("anti-lock to standstill", ("light braking to a stop", "light braking to a stop, 20 ms")),
    41: ("implicit step on a kinked curve", ("slip that settles on a node", "torque just above the peak")),
    42: ("wheel lock", ("locked from the start", "friction from 1e-6 to 1.5, locked", "standstill under brakes")),
    43: (
        "jump of friction, split friction, edges of tables",
        (
            "friction changes under a locked wheel",
            "truck on even friction",
            "truck on split friction in a mirror",
            "table of a single cell",
        ),
    ),
    44: ("loop of a brake, push-out", ("pressure below push-out", "loop of a brake in odd steps")),
    45: ("leading edge of FASTSIM", ("leading edge by few cells",)),
    46: ("no creepage, no load, no bound", ("rolling without creepage", "creepage of 1e-300", "lift-off")),
    47: ("gross slip", ("locked wheel with spin", "car with locked wheels", "friction from 0 to 1")),
    48: ("symmetry and dissipation", ("all creepages turned round", "contact in a mirror", "power of a contact")),
    49: ("large spin, pole inside the patch", ("nothing but spin", "spin against lateral creepage")),
    50: (
        "patches that are not ellipses",
        ("two patches under one load", "patches that merge", "patch cut off by the grid"),
    ),
    51: (
        "wheel lift",
        (
            "lift-off",
            "one wheel lifted",
            "car off a ramp",
            "both wheels in the air",
            "fall from five metres",
            "car dropped in space",
        ),
    ),
    52: (
        "damaged tables of samples",
        ("NaN in a force file", "CSV with empty cells and nan", "CSV whose clock goes back"),
    ),
    53: (
        "unit, sign, clipped channel",
        ("wheel force in kN read as N", "wheel force with the other sign", "clipped wheel force", "dead channel"),
    ),
    54: ("gaps, jitter, shift in time", ("one channel 3 ms late", "gap of half a second", "TDMS of two starts")),
}


def missing(names: set[str]) -> list[str]:
    """Cases that the catalogue names and that are not there, with their number."""
    return [f"{number}: {name}" for number, (_, own) in COVERED.items() for name in own if name not in names]


def beyond(names: list[str]) -> list[str]:
    """Cases that no number of the catalogue names."""
    named = {name for _, own in COVERED.values() for name in own}
    return [name for name in names if name not in named]
