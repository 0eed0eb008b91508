"""Kalker's contact programs of 1982 and 1983 compared on ellipses, as in his paper, with measured figures."""

from functools import partial
from typing import Any

import numpy as np

from models.contact.fastsim import CreepForces, RollingEllipse, fastsim
from models.contact.hertz import by_axes
from models.contact.simplified_theory import (
    FINE_CELLS,
    PAPER_OPTIONS,
    NormalContact,
    SimplifiedRolling,
    solve_rolling_contact,
)
from models.machine.seconds import seconds_text
from models.machine.timing import interleave
from models.systems.contact.run import interpenetration_contact
from models.systems.contact.work_precision import ContactCase
from validation.common.rows import Table

TIMING_ROUNDS = 5
"""Number of rounds in which computing times are measured."""


def compare_programs(contact_cases: list[ContactCase]) -> dict[str, Any]:
    """Force errors of Kalker's programs of 1982 and 1983 divided by mu N, relative errors of the 1983 normal contact
    against Hertz, and computing times (s) of a call."""
    pressed = {(c.a, c.b): _normal_contact(c) for c in contact_cases}

    def program_1982(contact_case: ContactCase) -> CreepForces:
        return fastsim(
            RollingEllipse(
                contact_case.a, contact_case.b, contact_case.load, contact_case.friction, *contact_case.motion
            ),
            contact_case.pair,
            **PROGRAM_OF_1982,
        )

    def program_1983(contact_case: ContactCase) -> SimplifiedRolling:
        return solve_rolling_contact(
            pressed[contact_case.a, contact_case.b], contact_case.friction, *contact_case.motion
        )

    def error(contact_case: ContactCase, computed_forces: CreepForces | SimplifiedRolling) -> float:
        return float(
            np.hypot(
                *(np.array([computed_forces.fx, computed_forces.fy]) / contact_case.friction_limit - contact_case.force)
            )
        )

    errors = {
        "1982": [error(case, program_1982(case)) for case in contact_cases],
        "1983": [error(case, program_1983(case)) for case in contact_cases],
    }
    normal = [_normal_errors(case, pressed[case.a, case.b]) for case in {(c.a, c.b): c for c in contact_cases}.values()]
    ways = {"1982": program_1982, "press": _normal_contact, "1983": program_1983}
    jobs = [partial(way, contact_cases[len(contact_cases) // 2]) for way in ways.values()]
    seconds = dict(zip(ways, interleave(jobs, TIMING_ROUNDS).tolist(), strict=True))
    return {"errors": errors, "normal": normal, "seconds": seconds}


PROGRAM_OF_1982: dict[str, Any] = {"cells": FINE_CELLS, "march": "plain", "flexibilities": "one", "bound": "parabolic"}
"""FASTSIM options of the program of 1982, with as many cells as the fine grid of the program of 1983."""


def _normal_contact(contact_case: ContactCase) -> NormalContact:
    return interpenetration_contact(
        by_axes(contact_case.a, contact_case.b, contact_case.pair, load=contact_case.load),
        contact_case.pair,
        PAPER_OPTIONS,
    )


def _normal_errors(contact_case: ContactCase, normal_contact: NormalContact) -> dict[str, float]:
    """Relative errors of approach, contact area and largest pressure against Hertz."""
    hertz = by_axes(contact_case.a, contact_case.b, contact_case.pair, load=contact_case.load)
    exact = {
        "approach": float(hertz.approach),
        "area": np.pi * contact_case.a * contact_case.b,
        "peak": float(hertz.p0),
    }
    return {name: getattr(normal_contact, name) / value - 1 for name, value in exact.items()}


def table(program_comparison: dict[str, Any]) -> Table:
    """Table of the paper's comparison of both programs, with measured figures."""
    error = {
        name: f"mean {100 * np.mean(e):.1f}, largest {100 * max(e):.0f} % of mu N"
        for name, e in program_comparison["errors"].items()
    }
    normal = {}
    for key in ("approach", "area", "peak"):
        values = [100 * errors[key] for errors in program_comparison["normal"]]
        normal[key] = f"{min(values):+.1f} to {max(values):+.1f} %"
    t = {name: np.array(seconds) for name, seconds in program_comparison["seconds"].items()}
    both = t["1983"] + t["press"]
    rows = (
        ("goes in", "semi-axes, load, creepages, linear coefficients", "undeformed distance, load, creepages"),
        ("contact area", "put in", f"found on a 15 x 15 net: {normal['area']}"),
        ("approach, largest pressure", "put in (Hertz)", f"{normal['approach']}; {normal['peak']}"),
        ("flexibility W", "from creepages and coefficients", "least squares against Boussinesq and Cerruti, crude net"),
        ("FASTSIM", "once", "twice, on the fine net"),
        ("accuracy in the paper", "roughly the same", "roughly the same"),
        ("accuracy, measured", error["1982"], error["1983"]),
        ("time in the paper", "1", "about 3"),
        (
            "time, measured",
            f"1 ({seconds_text(t['1982'])})",
            f"{np.median(both / t['1982']):.0f} ({seconds_text(both)}); "
            f"forces alone {np.median(t['1983'] / t['1982']):.0f}",
        ),
    )
    return Table(
        "The programs of 1982 and 1983",
        "Kalker's own comparison (1983) with measured figures; both to the "
        f"letter, {FINE_CELLS} strips and cells, times of one call from Python: median and range of rounds.",
        ("", "1982", "1983"),
        rows,
    )
