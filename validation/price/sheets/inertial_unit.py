"""Problem sheet of the attitude from gyro rates over ten minutes."""

from pathlib import Path

from validation.price.problems import inertial_unit
from validation.price.problems.inertial_unit import ANGLE_SINES, DURATION, STEADY_YAW_RATE
from validation.price.sheets.page import ReferenceValue
from validation.price.sheets.page import write as write_page

QUATERNION_NAMES = ("q1", "q2", "q3", "q4")


def write(output_folder: Path) -> list[ReferenceValue]:
    """Write the problem sheet into ``output_folder``; returns the reference values of the final quaternion."""
    problem = inertial_unit.problem(False)
    sure = problem.uncertainty["attitude"]
    values = [
        ReferenceValue("unit", name, "", DURATION, float(component), sure)
        for name, component in zip(QUATERNION_NAMES, problem.true[-1], strict=True)
    ]
    return write_page(
        output_folder,
        "unit",
        problem.title,
        _sheet_text(),
        f"The quaternion at {DURATION:g} s ({problem.reference}); the "
        "uncertainty is the largest angle between the two, rad. q and -q are the same attitude.",
        values,
    )


def _sheet_text() -> str:
    angles = "\n".join(
        f"    {name:5s} = "
        + " + ".join(
            ([f"{STEADY_YAW_RATE:g} t"] if name == "yaw" else [])
            + [f"{size:g} sin({rate:g} t + {phase:g})" for size, rate, phase in sines]
        )
        for name, sines in ANGLE_SINES.items()
    )
    return f"""{inertial_unit.InertialUnit.note}

A car turns by (rad, t in s)

{angles}

about its axes: S = Rz(yaw) Ry(pitch) Rx(roll) turns local components into global ones. Its local rates are

    w1 = roll' - yaw' sin(pitch)
    w2 = pitch' cos(roll) + yaw' sin(roll) cos(pitch)
    w3 = -pitch' sin(roll) + yaw' cos(roll) cos(pitch)

A gyro samples them n times a second, the first time at t = 0. From these samples alone, and the attitude at the start,
S(0), find the unit quaternion q = (q1; q2, q3, q4), scalar first, of

    q' = q (0, w) / 2        or        S' = S skew(w).

Asked for: the largest angle between the attitude found and the true one at every full second up to {DURATION:g} s."""
