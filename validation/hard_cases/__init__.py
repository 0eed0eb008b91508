"""Hard cases: what is hard, the invariant or exact answer, and what each implementation makes of it.

One file per family, each with ``CASES``. A case is judged per implementation as **right** (its error is
within the tolerance), **refused** (before the run, with a reason), **raised** (the run failed and said so)
or **SILENT**: a finite wrong answer without a word, which is never accepted.
"""

from importlib import import_module

from validation.hard_cases.case import Case

FAMILIES = (
    "stepping",
    "sampled_input",
    "contact_points",
    "prescribed_pitch",
    "stabilisers",
    "invariants",
    "extremes",
    "lifting",
    "accelerometers",
    "random_input",
    "drift",
    "kalman",
    "covariance",
    "contact",
    "contact_limits",
    "ride",
    "rolling",
    "rolling_contacts",
    "between_steps",
    "odd_values",
    "braking",
    "brake_loops",
    "recordings",
    "measured_files",
    "input_that_cannot_be",
)


def cases_by_family() -> tuple[tuple[str, Case], ...]:
    """(family, case) of every case, in the order of the table."""
    return tuple(
        (family, case) for family in FAMILIES for case in import_module(f"validation.hard_cases.{family}").CASES
    )


def all_cases() -> tuple[Case, ...]:
    """Every case of every family, in the same order."""
    return tuple(case for _, case in cases_by_family())
