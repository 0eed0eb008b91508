"""Contact of a wheel's profile with a rail's in plain numpy, for comparison with ``models.rail.profile_contact``.

Both wheels are described as they lie, no mirror: every circle of the wheel in space, the point at which its surface's
normal is square to the rail, how deep that point lies; then means over the circles in contact. Patches that press each
other down are settled by a solver. The nodes of wheel and rail are the package's. Axes, signs and units are those of
``models.rail``.
"""

import numpy as np
from scipy.interpolate import PPoly
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from models.contact.inputs import Array
from models.rail.profile_contact import SHARPEST_CURVATURE, TOUCH_RECORD, LaidProfile, WheelPose
from validation.contact.plain_fastsim import hertz_ellipse

LOAD_TOLERANCE = 1e-12
"""Largest residual of the patches' loads against their penetrations, divided by the load."""


def right_rail_depth(laid_profile: LaidProfile) -> PPoly:
    """Depth of the right rail's surface below its top (m) over y (m) from the middle of the track."""
    knots = laid_profile.knots
    return PPoly(np.array([knots[name][:-1] for name in ("c3", "c2", "c1", "c0")]), knots["y"], extrapolate=False)


def circle_contacts(wheel_side: int, wheelset_pose: WheelPose, laid_profile: LaidProfile) -> tuple[Array, Array, Array]:
    """For each circle of the wheel: penetration (n,), and its nearest point relative to the wheelset's centre and the
    rail's normal there, both (n, 3)."""
    head, nodes, rail = laid_profile.head[0], laid_profile.nodes, right_rail_depth(laid_profile)
    turn = Rotation.from_euler("ZX", [wheelset_pose.yaw, wheelset_pose.roll]).as_matrix()
    # A point (r sin phi, side (arm + y), r cos phi) has the normal (sin phi, -side slope, cos phi) in the wheelset.
    along, across, down = turn[0]
    phase = np.arcsin(across * wheel_side * nodes["slope"] / np.hypot(along, down)) - np.arctan2(down, along)
    radius = nodes["radius"]
    points = (
        np.column_stack([radius * np.sin(phase), wheel_side * (head.arm + nodes["y"]), radius * np.cos(phase)]) @ turn.T
    )
    y = wheelset_pose.y + points[:, 1]
    slope = wheel_side * rail(wheel_side * y, 1)
    normals = np.column_stack([np.zeros(y.size), -slope, np.ones(y.size)]) / np.hypot(1.0, slope)[:, None]
    depth = (wheelset_pose.z + head.level + points[:, 2] - rail(wheel_side * y)) * normals[:, 2]
    return np.where(np.isfinite(depth), depth, -1.0), points, normals


def contacts_of_wheel(
    wheel_side: int, wheelset_pose: WheelPose, laid_profile: LaidProfile, contact_modulus: float
) -> Array:
    """Contact patches of a wheel, records TOUCH (zones,); contact_modulus: contact modulus E* (Pa)."""
    depth, points, normals = circle_contacts(wheel_side, wheelset_pose, laid_profile)
    zone, length = laid_profile.nodes["zone"], np.arange(depth.size) * laid_profile.head[0].spacing
    radial = Rotation.from_euler("ZX", [wheelset_pose.yaw, wheelset_pose.roll]).as_matrix()[:, 2]
    touches = np.zeros(int(laid_profile.head[0].zones), TOUCH_RECORD)
    for k, touch in enumerate(touches):
        weight = np.maximum(1.0 - np.abs(zone - k), 0.0) * np.maximum(depth, 0.0) ** 2
        if not weight.any():
            continue
        normal = weight @ np.nan_to_num(normals)
        normal /= np.linalg.norm(normal)
        touch.depth = 7.0 / 6.0 * np.average(depth, weights=weight)
        touch.n_y, touch.n_z = normal[1:]
        touch.x, touch.y, touch.z = np.average(points, axis=0, weights=weight)
        touch.along = 0.5 * normal @ radial / np.average(laid_profile.nodes["radius"], weights=weight)
        width = 7.0 * np.cov(length, aweights=weight, ddof=0)
        touch.across = touch.depth / (width + touch.depth / SHARPEST_CURVATURE)
    if np.count_nonzero(touches["depth"] > 0.0) > 1:
        touches["depth"] = settled_penetrations(touches, contact_modulus)
    return touches


def hertz_force(
    penetration: float, curvature_along: float, curvature_across: float, contact_modulus: float
) -> tuple[float, float, float]:
    """Normal force (N) and semi-axes along and across rolling (m) by Hertz for a penetration (m) and curvatures (1/m);
    zeros where there is a gap."""
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    long, short, approach = hertz_ellipse(
        min(curvature_along, curvature_across), max(curvature_along, curvature_across), contact_modulus, 1.0
    )
    grown = (penetration / approach) ** 0.5
    axes = (long, short) if curvature_along <= curvature_across else (short, long)
    return grown**3, grown * axes[0], grown * axes[1]


def settled_penetrations(contact_patches: Array, contact_modulus: float) -> Array:
    """Penetrations (n,) in m of contact patches, reduced by the surface deformation that the other patches cause."""
    alone = contact_patches["depth"].copy()
    loads, axes = np.array([hertz_force(t.depth, t.along, t.across, contact_modulus)[:2] for t in contact_patches]).T
    places = np.column_stack([contact_patches[name] for name in ("x", "y", "z")])
    normals = np.column_stack([contact_patches["n_y"], contact_patches["n_z"]])
    apart = np.sum((places[:, None] - places) ** 2, axis=2) + (axes[:, None] ** 2 + axes**2) / 5.0
    pushes = (normals @ normals.T) / np.sqrt(apart) / (np.pi * contact_modulus)
    np.fill_diagonal(pushes, 0.0)
    loaded = alone > 0.0

    def depths(load_distribution: Array) -> Array:
        return alone - pushes @ load_distribution

    def residual(load_shares: Array) -> Array:
        left = np.where(loaded, np.maximum(depths(load_shares * loads), 0.0) / np.where(loaded, alone, 1.0), 0.0)
        return load_shares - left**1.5

    share = fsolve(residual, np.ones(alone.size), xtol=1e-14, full_output=True)[0]  # which no processor need reach
    if not np.abs(residual(share)).max() < LOAD_TOLERANCE:
        raise ArithmeticError(f"the loads of touching patches do not settle: {residual(share)}")
    return depths(share * loads)
