"""FASTSIM: creep forces on an elliptic contact by Kalker's simplified theory (Vehicle System Dynamics 11 (1982) 1).

Displacement is traction times a flexibility L. In each strip along the direction of rolling the traction starts from
zero at the leading edge and grows by -w dx / L over each step, with w = (xi_x - spin y, xi_y + spin x) the rigid
slip; where it would exceed mu times the pressure, the strip slips and the traction is held to that bound.

Flexibilities
    L1, L2, L3 for longitudinal and lateral creepage and spin make the forces of small creepages those of the linear
    theory. ``"three"`` uses each with its own creepage; sliding all over, the traction then does not point along the
    slip. ``"one"`` is the weighted one of 1982: right in full sliding, not smooth at small creepage, and up to a
    quarter of mu N off in mixed creepage. ``"blended"``, the default, goes from three to one mean as slip takes over.
Bound
    ``"parabolic"`` pressure goes with a bed of springs and begins to slip as it should; ``"elliptic"`` is Hertz's,
    right in full sliding with spin. ``"intermediate"``, the default, has the power 0.75 of the parabola
    (ellipse: 0.5), the least error of forces and moment on the whole.
Moment
    That of the tractions about the centre, so never beyond the integral of mu p r dA of the pressure that bounds them.
    At small creepages it is pi/4 a^3 b xi_y / L2 - 8/15 a^2 b^3 spin / L3, not the linear theory's, which has C23 and
    C33 there: for nu = 0.28 and a/b from 0.1 to 10 the first is 0.47 to 0.82, the second 1.24 to 0.65 of that.
March
    ``"second-order"``, the default, takes half a first step and turns a slipping traction exactly. ``"plain"`` is the
    program of 1982, first order in the size of the cells.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from models.contact.fastsim_grid import POWERS, BoundShape, FastsimGrid, count_of_strips, ellipse_grid, grids_of_ratios
from models.contact.fastsim_kernels import PLAIN, SECOND_ORDER
from models.contact.fastsim_many import BLENDED, ONE_FLEXIBILITY, THREE_FLEXIBILITIES, ellipse_forces
from models.contact.fastsim_many import fill_contact_forces as march_all
from models.contact.fastsim_records import CONTACT, FORCES
from models.contact.hertz import LEAST_AXIS
from models.contact.inputs import (
    LARGEST_LOAD,
    NEGLIGIBLE_BOUND,
    Array,
    broadcast_together,
    checked_creepages,
    checked_number,
    checked_quantity,
    checked_whole_number,
)
from models.contact.linear_theory import fastsim_flexibilities as linear_flexibilities
from models.contact.material import FallingFriction, MaterialPair
from models.core.errors import InputError

FlexibilityChoice = Literal["blended", "one", "three"]
MarchChoice = Literal["second-order", "plain"]
FLEXIBILITY_KINDS = {"blended": BLENDED, "one": ONE_FLEXIBILITY, "three": THREE_FLEXIBILITIES}
MARCH_KINDS = {"second-order": SECOND_ORDER, "plain": PLAIN}
FLEXIBILITY_FIELDS = ("l1", "l2", "l3")
"""Names of the flexibilities among the fields of CONTACT."""
LEAST_CELLS, MOST_CELLS = 3, 2000


@dataclass(frozen=True)
class RollingEllipse:
    """One rolling elliptic contact, or many: each field is a number or an array, and all arrays broadcast.

    a, b : semi-axes along and across the direction of rolling (m); load : N, zero or less makes all forces zero; mu :
    coefficient of friction, 0 to 10; xi_x, xi_y : creepages; spin : 1/m, signs as in ``models.contact``
    """

    a: Any
    b: Any
    load: Any
    mu: Any
    xi_x: Any
    xi_y: Any
    spin: Any


@dataclass(frozen=True)
class CreepForces:
    """Creep forces on the wheel; every field has the common shape of the inputs.

    fx, fy : N. mz : N m, about the centre. stick : share of the area that sticks. dissipation : -(fx xi_x + fy xi_y +
    mz spin) in J per metre rolled, times the rolling speed the power in W; never negative (on fewer than 20 cells per
    strip by up to 1e-5 of mu N times the creepage, on ellipses beyond a/b = 100; beyond 900 on any). wear_number :
    |fx xi_x| + |fy xi_y| in N (T gamma).
    """

    fx: Array
    fy: Array
    mz: Array
    stick: Array
    dissipation: Array
    wear_number: Array


def fastsim(
    ellipse: RollingEllipse,
    material_pair: MaterialPair,
    *,
    cells: int = 21,
    bound: BoundShape = "intermediate",
    flexibilities: FlexibilityChoice = "blended",
    march: MarchChoice = "second-order",
    falling: FallingFriction | None = None,
) -> CreepForces:
    """Creep forces on one elliptic contact or on many, by FASTSIM.

    Parameters
    ----------
    material_pair : the two materials
    cells : in each strip; strips are as many, and more on an ellipse narrower than a/b = 1/2 (see ``fastsim_grid``)
    falling : friction that falls with the speed of slip; None for a constant one

    Raises
    ------
    InputError : names the value that is not finite, not plausible in SI, or of no common shape, or the word not known
    """
    check_fastsim_choices(cells, bound, flexibilities, march, falling)
    contacts, shape = contact_records(ellipse, material_pair)
    forces = np.zeros(len(contacts), FORCES)
    for rows, net in grids_of_ratios(contacts["a"] / contacts["b"], cells, bound):
        marched, net_forces = (
            (contacts[rows], *net.records, FLEXIBILITY_KINDS[flexibilities]),
            np.zeros(rows.size, FORCES),
        )
        if falling is None:
            march_all(*marched, MARCH_KINDS[march], net_forces)
        else:
            from models.contact.fastsim_falling import fill_forces_with_falling_friction

            fill_forces_with_falling_friction(*marched, falling.law, net_forces)
        forces[rows] = net_forces
    fx, fy, mz, stick = (forces[name] for name in ("fx", "fy", "mz", "stick"))
    along, across = fx * contacts["xi_x"], fy * contacts["xi_y"]
    lost = 0.0 - (along + across + mz * contacts["spin"])
    values = fx, fy, mz, stick, lost, np.abs(along) + np.abs(across)
    return CreepForces(*(value.reshape(shape)[()] for value in values))


class FastsimEllipse:
    """FASTSIM for ellipses of one axis ratio, as of a wheel on a rail; all that depends on the ratio alone is computed
    once.

    ``Ellipse(ratio, pair)(a, load, mu, xi_x, xi_y, spin)`` is (fx, fy, mz) in N, N, N m, from plain numbers and for
    plain numbers, in microseconds; ratio = a/b. Options are those of ``fastsim``. Raises InputError.
    """

    def __init__(
        self,
        axis_ratio: float,
        material_pair: MaterialPair,
        *,
        cells: int = 21,
        bound: BoundShape = "intermediate",
        flexibilities: FlexibilityChoice = "blended",
        march: MarchChoice = "second-order",
    ) -> None:
        check_fastsim_choices(cells, bound, flexibilities, march)
        self.ratio = checked_number("ratio", axis_ratio, "a ratio a/b of semi-axes from 1e-6 to 1e6", 1e-6, 1e6)
        self.net: FastsimGrid = ellipse_grid(cells, int(count_of_strips(np.array(self.ratio), cells)), bound)
        size = 1e-3
        flexible = linear_flexibilities(size, size / self.ratio, material_pair)
        unit = (1.0 / self.ratio, *(float(value) / size for value in flexible))
        choices = self.net.middle, FLEXIBILITY_KINDS[flexibilities], MARCH_KINDS[march]
        self._fixed = unit, self.net.strips, self.net.cells, choices

    def __call__(
        self, a: float, load: float, mu: float, xi_x: float, xi_y: float, spin: float
    ) -> tuple[float, float, float]:
        """Creep forces fx, fy (N) and moment mz (N m); a : semi-axis along the direction of rolling (m)."""
        given = (a, load, mu, xi_x, xi_y, spin)
        try:
            forces = ellipse_forces(tuple(map(float, given)), *self._fixed)
        except (TypeError, ValueError):
            forces = (math.nan,) * 3
        if not math.isfinite(forces[0] + forces[1] + forces[2]):
            for name, value in zip(("a", "load", "mu", "xi_x", "xi_y", "spin"), given, strict=True):
                checked_number(name, value, "finite")
            contact_records(RollingEllipse(a, a / self.ratio, load, mu, xi_x, xi_y, spin), MaterialPair())
            raise InputError("", "a", a, "must be a semi-axis in m, above 0 where there is a load")
        return forces


def check_fastsim_choices(
    cells: int, bound: str, flexibilities: str, march: str, falling: FallingFriction | None = None
) -> None:
    """Raise InputError for an unknown option, or for falling friction with a march that does not support it."""
    checked_whole_number("cells", cells, LEAST_CELLS, MOST_CELLS)
    for name, value, known in (
        ("bound", bound, tuple(POWERS)),
        ("march", march, tuple(MARCH_KINDS)),
        ("flexibilities", flexibilities, tuple(FLEXIBILITY_KINDS)),
    ):
        if value not in known:
            raise InputError("", name, value, "is not known", known)
    if falling is not None and march != "second-order":
        raise InputError("", "march", march, "must be second-order where friction falls with the speed of slip")


def contact_records(ellipse: RollingEllipse, material_pair: MaterialPair) -> tuple[Array, tuple[int, ...]]:
    """Inputs as records CONTACT (n,) for compiled functions, and their common shape. Contacts without load get
    semi-axes of 0.1 m.
    """
    axis = "a semi-axis in m, zero or more"
    given = broadcast_together(
        a=checked_quantity("a", ellipse.a, axis, 0.0),
        b=checked_quantity("b", ellipse.b, axis, 0.0),
        load=checked_quantity("load", ellipse.load, f"a load in N, at most {LARGEST_LOAD:g}", maximum=LARGEST_LOAD),
        mu=checked_quantity("mu", ellipse.mu, "a coefficient of friction from 0 to 10", 0.0, 10.0),
        **checked_creepages(ellipse.xi_x, ellipse.xi_y, ellipse.spin),
    )
    contacts = np.empty(given[0].size, CONTACT)
    for name, values in zip(("a", "b", "load", "mu", "xi_x", "xi_y", "spin"), given, strict=True):
        contacts[name] = values.ravel()
    loaded = contacts["load"] > NEGLIGIBLE_BOUND
    for name in ("a", "b"):
        checked_quantity(name, contacts[name][loaded], "a semi-axis in m, above 0 where there is a load", LEAST_AXIS)
        contacts[name][~loaded] = 0.1
    for name, value in zip(
        FLEXIBILITY_FIELDS, linear_flexibilities(contacts["a"], contacts["b"], material_pair), strict=True
    ):
        contacts[name] = value
    return contacts, given[0].shape
