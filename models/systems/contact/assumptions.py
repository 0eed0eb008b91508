"""Assumptions of the theories of one rolling contact."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from models.contact.accuracy import MEASURED_AXIS_RATIOS
from models.contact.limits import (
    CONSTANT_FRICTION,
    LARGEST_AXIS_SHARE,
    LINEAR_FORCE_SHARE,
    SMALL_CREEPAGE,
    YIELD_PRESSURE,
    yield_is_known,
)
from models.contact.theories import FastsimTheory, LinearTheory, RollingContact, RollingOnEllipse, RollingOnPatches
from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.core.tables import METRES, table_blocks
from models.systems.contact.cases_table import BY_AXES, BY_CURVATURES
from models.systems.contact.scene import ContactScene

DISSIMILARITY_COST = 0.02
"""Largest error of a force, divided by mu N, that comes from treating different materials as alike."""


def assumptions(scene: ContactScene, rolling_contact: RollingContact) -> list[Assumption]:
    """Assumptions of the scene's theory about its contact: half-space, elasticity, small creepages, shape, friction."""
    listed = [*pressing_assumptions(scene, rolling_contact), *_creepage_assumptions(rolling_contact)]
    if isinstance(rolling_contact, LinearTheory):
        listed.append(_no_slip_assumption(lambda run: {"contact": _utilised_friction(run, rolling_contact)}))
    if isinstance(rolling_contact, LinearTheory | FastsimTheory):
        listed.append(_slender_assumption(lambda run: {"contact": np.array([rolling_contact.a / rolling_contact.b])}))
    if rolling_contact.pair.mismatch != 0.0 and rolling_contact.friction > 0.0:
        listed.append(_like_bodies_assumption(rolling_contact))
    return listed


def pressing_assumptions(scene: ContactScene, rolling_contact: RollingContact) -> list[Assumption]:
    """Assumptions of the normal problem: half-spaces, elastic bodies, and patches within the profiles."""
    listed = [_half_space_assumption(_axes_divided_by_radii(scene, rolling_contact))]
    if yield_is_known(scene.bodies.wheel, scene.bodies.rail):
        listed.append(_elastic_assumption(lambda run: {"contact": np.array([1e-6 * rolling_contact.pressing.peak])}))
    return listed + (
        _profile_assumptions(rolling_contact)
        if scene.profiles is not None and isinstance(rolling_contact, RollingOnPatches)
        else []
    )


def table_assumptions(cases_path: Path) -> list[Assumption]:
    """Assumptions about the contacts in a table of cases, checked on its first block of rows only."""
    rows = next(iter(table_blocks(cases_path, (BY_AXES, BY_CURVATURES))), None)
    values = {} if rows is None else {name: np.asarray(column, float) for name, column in rows.values.items()}
    listed = []
    if "a" in values:
        a, b = values["a"], values["b"]
        peak = 1.5e-6 * values["load"] / (np.pi * a * b)
        listed = [_slender_assumption(lambda run: {"rows": a / b}), _elastic_assumption(lambda run: {"rows": peak})]
    creepages = {name: values.get(name, np.zeros(0)) for name in ("xi_x", "xi_y")}
    return [
        *listed,
        _small_creepage_assumption(lambda run: creepages),
        _constant_friction_assumption(lambda run: creepages),
    ]


def _half_space_assumption(values_of_result: Callable[[Result], Watched]) -> Assumption:
    return Assumption(
        "half-space",
        "the contact is small beside the bodies' radii",
        "lower the load, or compute with finite elements",
        values_of_result,
        "of the radius",
        upper_limit=LARGEST_AXIS_SHARE,
    )


def _axes_divided_by_radii(scene: ContactScene, rolling_contact: RollingContact) -> Callable[[Result], Watched]:
    """Returns a function of a result that gives the contact's semi-axes divided by the radii of curvature.

    The radii are those of both bodies, or else of the distance between the undeformed surfaces.
    """
    shares: dict[str, np.ndarray] = {}
    if isinstance(rolling_contact, RollingOnEllipse):
        axes = {"x": rolling_contact.a, "y": rolling_contact.b}
        if scene.radii is not None:
            shares = {f"radii.{name}": np.array([axes[name[-1]] / abs(r)]) for name, r in scene.radii if r is not None}
        else:
            shares = {
                "along": 2.0 * rolling_contact.a * rolling_contact.hertz.A,
                "across": 2.0 * rolling_contact.b * rolling_contact.hertz.B,
            }
    elif isinstance(rolling_contact, RollingOnPatches):
        for k, patch_pressure in enumerate(rolling_contact.pressed.patches, 1):
            curvature_along, across = patch_pressure.patch.distance.curvatures
            x0, x1, y0, y1 = patch_pressure.box
            shares[f"patch {k} along"] = np.array([0.5 * (x1 - x0) * curvature_along])
            shares[f"patch {k} across"] = np.array([0.5 * (y1 - y0) * across])
    arrays = {axis_name: np.atleast_1d(share) for axis_name, share in shares.items()}
    return lambda run: arrays


def _elastic_assumption(values_of_result: Callable[[Result], Watched]) -> Assumption:
    return Assumption(
        "elastic",
        "the steel does not flow",
        "lower the load or take larger radii: a real contact would be larger and its pressure lower",
        values_of_result,
        "MPa",
        upper_limit=1e-6 * YIELD_PRESSURE,
    )


def _creepage_assumptions(rolling_contact: RollingContact) -> list[Assumption]:
    """Assumptions that creepages are small and, where friction is constant, that slip is slow."""
    longer = rolling_contact.lever

    def creepages(run_result: Result) -> Mapping[str, np.ndarray]:
        return {
            "xi_x": np.abs(run_result["xi_x"]),
            "xi_y": np.abs(run_result["xi_y"]),
            "spin": longer * np.abs(run_result["spin"]),
        }

    if isinstance(rolling_contact, LinearTheory) or (
        isinstance(rolling_contact, FastsimTheory) and rolling_contact.choices["falling"] is not None
    ):
        return [_small_creepage_assumption(creepages)]
    return [
        _small_creepage_assumption(creepages),
        _constant_friction_assumption(lambda run: {name: np.abs(run[name]) for name in ("xi_x", "xi_y")}),
    ]


def _small_creepage_assumption(values_of_result: Callable[[Result], Mapping[str, np.ndarray]]) -> Assumption:
    return Assumption(
        "small creepage",
        "creepages, and spin times the semi-axis, are so small that their squares do not count",
        "lower the creepage: a wheel that slides is no rolling contact",
        lambda run: {name: np.abs(values) for name, values in values_of_result(run).items()},
        "",
        upper_limit=SMALL_CREEPAGE,
    )


def _constant_friction_assumption(values_of_result: Callable[[Result], Mapping[str, np.ndarray]]) -> Assumption:
    return Assumption(
        "constant friction",
        "friction is the same however fast the contact slips",
        "name the effect falling_friction, which FASTSIM computes",
        lambda run: {name: np.abs(values) for name, values in values_of_result(run).items()},
        "",
        upper_limit=CONSTANT_FRICTION,
    )


def _no_slip_assumption(values_of_result: Callable[[Result], Watched]) -> Assumption:
    return Assumption(
        "no slip",
        "the force of the linear theory is far below mu N",
        'name the effect saturation: method.name = "fastsim"',
        values_of_result,
        "mu N",
        upper_limit=LINEAR_FORCE_SHARE,
    )


def _utilised_friction(run_result: Result, rolling_contact: RollingContact) -> np.ndarray:
    """Tangential force divided by mu N at every creepage; infinite for any force without friction."""
    force, limit = (
        np.hypot(run_result["fx"], run_result["fy"]),
        rolling_contact.friction * rolling_contact.pressing.load,
    )
    return force / limit if limit > 0.0 else np.where(force > 0.0, np.inf, 0.0)


def _slender_assumption(values_of_result: Callable[[Result], Watched]) -> Assumption:
    return Assumption(
        "axes alike",
        "the ellipse is no more slender than those of Kalker's table",
        'name the effect half_space: method.name = "exact"',
        values_of_result,
        "",
        *MEASURED_AXIS_RATIOS,
    )


def _like_bodies_assumption(rolling_contact: RollingContact) -> Assumption:
    cost = np.array([rolling_contact.pair.quasi_identity_error(rolling_contact.friction)])
    return Assumption(
        "bodies alike",
        "both bodies stretch alike under the pressure",
        "give both bodies the same material",
        lambda run: {"bodies": cost},
        "mu N",
        upper_limit=DISSIMILARITY_COST,
    )


def _profile_assumptions(rolling_contact: RollingOnPatches) -> list[Assumption]:
    """Assumptions that contact patches lie within the profiles, and do not overlap."""
    parts = sorted(rolling_contact.pressed.patches, key=lambda patch_pressure: patch_pressure.patch.contour_position)
    free_distances = {}
    for k, patch_pressure in enumerate(parts, 1):
        known, (_, _, low, high) = patch_pressure.patch.distance, patch_pressure.box
        free = [known.y[-1] - high] * (not patch_pressure.patch.cut[3]) + [low - known.y[0]] * (
            not patch_pressure.patch.cut[2]
        )
        free_distances[f"patch {k}"] = 1e3 * np.array(free)
    gaps = [(b.patch.contour_position + b.box[2]) - (a.patch.contour_position + a.box[3]) for a, b in pairwise(parts)]
    return [
        Assumption(
            "within the profiles",
            "the contact lies within the profiles and their surroundings that are known",
            "use longer profiles, a smaller load or lateral_shift",
            lambda run: free_distances,
            "mm from the end",
            lower_limit=0.0,
        ),
        Assumption(
            "patches apart",
            "patches of one wheel lie beside one another",
            'use system = "wheel-rail", which joins patches that have grown together',
            lambda run: {"neighbours": np.array(gaps) / METRES["mm"]},
            "mm",
            lower_limit=0.0,
        ),
    ]
