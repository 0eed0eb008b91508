"""Faults planted in contact pressure, creep law and exact contact theory, and the checks that see them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from models.contact import fastsim as creep
from models.contact import hertz, normal_problem, rolling_problem
from models.contact.fastsim_kernels import PLAIN
from models.contact.inputs import Array
from models.contact.linear_theory import linear_creep_forces
from models.contact.material import STEEL, Material, MaterialPair
from models.contact.normal_problem import NormalSolution, cell_centres
from validation.common.checks import largest_relative_difference
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch

MATERIAL_PAIR = MaterialPair()
LOAD, RADIUS, FRICTION = 1e4, 0.3, 0.3
A, B = 6e-3, 4e-3
CELLS, CELL_LENGTH, CELL_WIDTH = (21, 31), 3.0e-4, 4.2e-4
"""Number of rows and columns, length and width (m) of the cells; they are not square, so that an exchange of both
directions shows."""
PUBLISHED_COEFFICIENTS = (4.12, 3.67, 1.47)
"""Kalker's published coefficients C11, C22, C23 for a = b and Poisson's ratio 0.25."""


def _ball_contact() -> tuple[float, float, float]:
    """Contact radius (m), approach (m) and peak pressure (Pa) of a ball on a plane, in closed form."""
    stiff = STEEL.E / (2.0 * (1.0 - STEEL.nu**2))
    a = (0.75 * LOAD * RADIUS / stiff) ** (1.0 / 3.0)
    return a, a * a / RADIUS, 1.5 * LOAD / (np.pi * a * a)


def _hertz_errors() -> float:
    """Largest relative error of the computed contact radius, approach and peak pressure of a ball on a plane."""
    answer = hertz.by_load(0.5 / RADIUS, 0.5 / RADIUS, LOAD, MATERIAL_PAIR)
    return largest_relative_difference(np.array([answer.a, answer.approach, answer.p0]) / _ball_contact(), np.ones(3))


def _ellipse_errors() -> float:
    """Relative error of an elliptic contact's load against the integral of its pressure, 2/3 pi a b p0; infinite if the
    wrong axis is longer."""
    answer = hertz.by_load(2.0, 1.0, LOAD, MATERIAL_PAIR)
    balanced = abs(float(2.0 / 3.0 * np.pi * answer.a * answer.b * answer.p0) / LOAD - 1.0)
    return balanced if answer.b > answer.a else np.inf


def _normal_solution() -> NormalSolution:
    y, x = cell_centres(CELLS[0], CELL_WIDTH), cell_centres(CELLS[1], CELL_LENGTH)
    away = (x**2 + y[:, None] ** 2) / (2.0 * RADIUS)
    return normal_problem.solve_normal(away, CELL_LENGTH, CELL_WIDTH, MATERIAL_PAIR, load=LOAD)


def _normal_solution_errors() -> float:
    """Largest relative error of the numerical normal solution's approach and peak pressure for a ball."""
    answer = _normal_solution()
    return largest_relative_difference(
        np.array([answer.approach, answer.pressure.max()]) / _ball_contact()[1:], np.ones(2)
    )


def _kalker_errors() -> float:
    """Largest relative error of creep forces at small creepages and spin, against Kalker's published coefficients."""
    soft = MaterialPair(Material(E=2.5e11, nu=0.25), Material(E=2.5e11, nu=0.25))
    a, shear = 5e-3, 1e11
    motion = np.array([[1e-7, 0.0, 0.0], [0.0, 1e-7, 0.0], [0.0, 0.0, 1e-4]])
    answer = creep.fastsim(creep.RollingEllipse(a, a, LOAD, FRICTION, motion[0], motion[1], motion[2]), soft)
    c11, c22, c23 = PUBLISHED_COEFFICIENTS
    wanted = -shear * a * a * np.array([c11 * 1e-7, c22 * 1e-7, c23 * a * 1e-4])
    return largest_relative_difference(np.array([answer.fx[0], answer.fy[1], answer.fy[2]]) / wanted, np.ones(3))


def _linear_theory_errors() -> float:
    """Relative error of FASTSIM's creep forces on an ellipse at small creepages, against the linear theory."""
    motion = (1e-7, 0.7e-7, 2e-5)
    answer = creep.fastsim(creep.RollingEllipse(A, B, LOAD, FRICTION, *motion), MATERIAL_PAIR, cells=41)
    return largest_relative_difference(
        np.array([answer.fx, answer.fy]), np.array(linear_creep_forces(A, B, *motion, MATERIAL_PAIR)[:2])
    )


def _sliding_errors() -> float:
    """Relative error of the creep force in gross sliding, against mu N opposite to the creepage."""
    answer = creep.fastsim(creep.RollingEllipse(A, B, LOAD, FRICTION, 0.03, 0.04, 0.0), MATERIAL_PAIR)
    return largest_relative_difference(np.array([answer.fx, answer.fy]), -FRICTION * LOAD * np.array([0.6, 0.8]))


def _theory_difference() -> float:
    """Difference between the creep forces by exact theory and by FASTSIM in partial slip, divided by mu N."""
    pressed, a = _normal_solution(), _ball_contact()[0]
    motion = (1.2e-3, -0.8e-3, 0.2)
    exact = rolling_problem.solve_rolling(pressed, FRICTION, *motion, MATERIAL_PAIR)
    answer = creep.fastsim(creep.RollingEllipse(a, a, LOAD, FRICTION, *motion), MATERIAL_PAIR)
    return float(np.hypot(exact.fx - answer.fx, exact.fy - answer.fy) / (FRICTION * LOAD))


@cache
def _forces_at_small_creepage() -> Array:
    a = _ball_contact()[0]
    return np.array(linear_creep_forces(a, a, 2e-5, 1e-5, 0.0, MATERIAL_PAIR)[:2])


def _exact_theory_error() -> float:
    """Relative difference between the creep forces by exact theory at small creepages and by linear theory."""
    exact = rolling_problem.solve_rolling(_normal_solution(), FRICTION, 2e-5, 1e-5, 0.0, MATERIAL_PAIR)
    return largest_relative_difference(np.array([exact.fx, exact.fy]), _forces_at_small_creepage())


CHECKS = {
    "ball": Check("Hertz's ball in closed form", "relative", 1e-9, _hertz_errors),
    "ellipse": Check("load of an ellipse by its pressure", "relative", 1e-9, _ellipse_errors),
    "cells": Check("pressure of a ball on cells in closed form", "relative", 2e-3, _normal_solution_errors),
    "Kalker's table": Check("creep forces by published coefficients", "relative", 0.015, _kalker_errors),
    "linear": Check("creep forces of small creepages by linear theory", "of the largest", 5e-3, _linear_theory_errors),
    "sliding": Check("sliding by mu N", "relative", 1e-6, _sliding_errors),
    "exact small": Check("exact theory by linear theory", "of the largest", 0.08, _exact_theory_error),
    "theories": Check("exact theory beside FASTSIM", "mu N", 0.04, _theory_difference),
}


def _contacts_patch(change_contacts: Callable[[Array], None]) -> Patch:
    """Patch that changes FASTSIM's input records CONTACT (n,) in place."""

    def contacts(original_function: Any) -> Any:
        def planted(*arguments: Any) -> Any:
            answer, shape = original_function(*arguments)
            change_contacts(answer)
            return answer, shape

        return planted

    return attribute_patch("models.contact.fastsim:contact_records", contacts)


def _multiplication_patch(field_name: str, field_factor: float) -> Patch:
    def change(contact_records: Array) -> None:
        contact_records[field_name] *= field_factor

    return _contacts_patch(change)


def _exchange_patch(first_field: str, second_field: str) -> Patch:
    def change(contact_records: Array) -> None:
        contact_records[first_field], contact_records[second_field] = (
            contact_records[second_field].copy(),
            contact_records[first_field].copy(),
        )

    return _contacts_patch(change)


FAULTS = (
    CampaignFault(
        "one body's modulus for the pair's",
        "Hertz",
        attribute_patch(
            "models.contact.hertz:by_load", lambda real: lambda a, b, load, pair: real(a, b, load / 2, pair)
        ),
    ),
    CampaignFault(
        "diameter for radius",
        "Hertz",
        attribute_patch(
            "models.contact.hertz:by_load", lambda real: lambda a, b, *arguments: real(a / 2, b / 2, *arguments)
        ),
    ),
    CampaignFault(
        "curvatures exchanged",
        "Hertz",
        attribute_patch("models.contact.hertz:by_load", lambda real: lambda a, b, *arguments: real(b, a, *arguments)),
    ),
    CampaignFault(
        "axes not squared up: p0 of a cylinder",
        "Hertz",
        attribute_patch(
            "models.contact.hertz:by_load",
            lambda real: lambda *arguments: replace(real(*arguments), p0=2.0 / 3.0 * 4.0 / np.pi * real(*arguments).p0),
        ),
    ),
    CampaignFault(
        "sides of a cell exchanged",
        "normal problem",
        attribute_patch(
            "models.contact.normal_problem:influence_of_rectangle",
            lambda real: lambda x, y, dx, dy, pair: real(x, y, dy, dx, pair),
        ),
    ),
    CampaignFault(
        "influence of one body alone",
        "normal problem",
        attribute_patch(
            "models.contact.normal_problem:influence_of_rectangle",
            lambda real: lambda *arguments: 0.5 * real(*arguments),
        ),
    ),
    CampaignFault(
        "whole first step at the leading edge",
        "FASTSIM",
        attribute_patch("models.contact.fastsim:MARCH_KINDS", lambda real: {**real, "second-order": PLAIN}),
    ),
    CampaignFault("sign of the spin", "FASTSIM", _multiplication_patch("spin", -1.0)),
    CampaignFault("creepages exchanged", "FASTSIM", _exchange_patch("xi_x", "xi_y")),
    CampaignFault("semi-axes exchanged", "FASTSIM", _exchange_patch("a", "b")),
    CampaignFault("flexibilities along and across exchanged", "FASTSIM", _exchange_patch("l1", "l2")),
    CampaignFault("flexibility of spin 10 % off", "FASTSIM", _multiplication_patch("l3", 1.1)),
    CampaignFault("friction 1 % off", "FASTSIM", _multiplication_patch("mu", 1.01)),
    CampaignFault("bound of the cylinder", "FASTSIM", _multiplication_patch("load", 0.9)),
    CampaignFault(
        "gradient taken downstream",
        "exact theory",
        attribute_patch("models.contact.rolling_problem:rigid_slip", lambda real: lambda *arguments: -real(*arguments)),
    ),
    CampaignFault(
        "gradient of half the length",
        "exact theory",
        attribute_patch(
            "models.contact.rolling_problem:ROLLING_WEIGHTS", lambda real: tuple(2.0 * arguments for arguments in real)
        ),
    ),
    CampaignFault(
        "sign of the spin",
        "exact theory",
        attribute_patch(
            "models.contact.rolling_problem:rigid_slip",
            lambda real: lambda x, y, xi_x, xi_y, spin: real(x, y, xi_x, xi_y, -spin),
        ),
    ),
)

CAMPAIGN = Campaign("planted.contact", "contact", "contact", CHECKS, FAULTS)
