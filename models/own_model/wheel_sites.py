"""Sites of an MJCF file that are named as tyres or hubs: positions of a car's wheels, and parameters of their tyres.

A site at the centre of a wheel whose name begins with "tyre" or "hub" makes a tyre of the rest of its name. What MJCF
has no word for stands in the site's ``user``: vertical stiffness (N/m), damping (N s/m), cornering stiffness (N/rad).
"""

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import NoReturn

import mujoco
import numpy as np

from models.core.errors import InputError
from models.own_model.xml_guard import ModelXml

WHEEL_SITE_PATTERN = re.compile(r"(?:tyre|hub)[ _.:-]*(.*)", re.IGNORECASE)
EXAMPLE_SITE = '<site name="tyre front_left" pos="X Y Z" user="STIFFNESS DAMPING CORNERING"/>'
SAME_AXLE_DISTANCE, AXLE_SEPARATION = 1e-6, 0.2
"""Largest distance (m) along x between the wheels of one axle, and smallest distance between two axles."""
MOST_WHEELS_PER_AXLE = 2
"""Largest count of wheels of an axle."""


@dataclass(frozen=True, eq=False)
class WheelSite:
    """Site of an MJCF file that marks a wheel. name : of the tyre; site, body : their numbers in the model; point (3,)
    in the design position, m.

    axle : from the front, 0 first; stiffness (N/m), damping (N s/m), cornering (N/rad)."""

    name: str
    site: int
    body: int
    point: np.ndarray
    axle: int
    stiffness: float
    damping: float
    cornering: float


def wheel_sites(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, model_xml: ModelXml) -> tuple[WheelSite, ...]:
    """Wheel sites from front to rear, left before right. Raises InputError if the sites do not form the axles of a car.

    design_data : data of the model in the design position, with kinematics computed.
    """
    sites = {
        s: match[1]
        for s in range(mujoco_model.nsite)
        if (match := WHEEL_SITE_PATTERN.fullmatch(mujoco_model.site(s).name))
    }
    if not sites:
        said = (
            f"no site is named as a tyre or a hub: a vehicle needs one at the centre of every wheel, as {EXAMPLE_SITE}"
        )
        raise InputError(model_xml.path.name, "worldbody", None, said)
    for s, name in sites.items():
        _check_site(mujoco_model, design_data, model_xml, s, name, list(sites.values()).count(name) > 1)
    axles = _axles(design_data, model_xml, mujoco_model, sorted(sites, key=lambda s: -design_data.site_xpos[s, 0]))
    return tuple(
        WheelSite(
            sites[s],
            s,
            int(mujoco_model.site_bodyid[s]),
            design_data.site_xpos[s].copy(),
            axle,
            *_tyre_numbers(mujoco_model, model_xml, s),
        )
        for axle, abreast in enumerate(axles)
        for s in abreast
    )


def site_text(mujoco_model: mujoco.MjModel, model_xml: ModelXml, site: int) -> str:
    """Text by which messages name a site."""
    name = mujoco_model.site(site).name
    line = model_xml.line(("site",), name)
    return f"site {name!r}" + (f" ({line})" if line else "")


def _refuse(mujoco_model: mujoco.MjModel, model_xml: ModelXml, site: int, wrong_value: object, reason: str) -> NoReturn:
    raise InputError(model_xml.path.name, site_text(mujoco_model, model_xml, site), wrong_value, reason)


def _check_site(
    mujoco_model: mujoco.MjModel,
    design_data: mujoco.MjData,
    model_xml: ModelXml,
    site: int,
    site_name: str,
    is_repeated: bool,
) -> None:
    if not site_name:
        _refuse(
            mujoco_model,
            model_xml,
            site,
            None,
            'needs the name of its tyre behind "tyre" or "hub", as "tyre front_left"',
        )
    if is_repeated:
        _refuse(mujoco_model, model_xml, site, site_name, "two sites have this name behind their first word")
    if not mujoco_model.site_bodyid[site]:
        _refuse(mujoco_model, model_xml, site, None, "lies in the world: it must be in the body of its wheel")
    height = float(design_data.site_xpos[site, 2])
    if not height > 0.0:
        _refuse(
            mujoco_model, model_xml, site, height, "m is its height: a wheel's centre must lie above the road, z = 0"
        )


def _axles(
    design_data: mujoco.MjData, model_xml: ModelXml, mujoco_model: mujoco.MjModel, ordered_sites: list[int]
) -> list[tuple[int, ...]]:
    """Numbers of the sites of every axle, from the front. Raises InputError where they do not form axles."""
    axles, x = [ordered_sites[:1]], design_data.site_xpos[:, 0]
    for before, site in pairwise(ordered_sites):
        apart = round(float(x[before] - x[site]), 9)
        if SAME_AXLE_DISTANCE < apart < AXLE_SEPARATION:
            other = mujoco_model.site(before).name
            _refuse(
                mujoco_model,
                model_xml,
                site,
                apart,
                f"m behind {other!r}: one axle within {SAME_AXLE_DISTANCE:g} m, or {AXLE_SEPARATION:g} m apart",
            )
        if apart > SAME_AXLE_DISTANCE:
            axles.append([])
        axles[-1].append(site)
    for sites in axles:
        sites.sort(key=lambda site: -design_data.site_xpos[site, 1])
        _check_axle(design_data, model_xml, mujoco_model, sites)
    return [tuple(sites) for sites in axles]


def _check_axle(
    design_data: mujoco.MjData, model_xml: ModelXml, mujoco_model: mujoco.MjModel, sites: list[int]
) -> None:
    """Raise InputError unless an axle has a left and a right wheel, or one wheel in the middle."""
    y, at = design_data.site_xpos[sites, 1], f"the axle at x = {design_data.site_xpos[sites[0], 0]:.6g} m"
    if len(sites) > MOST_WHEELS_PER_AXLE:
        names = ", ".join(repr(mujoco_model.site(s).name) for s in sites)
        _refuse(
            mujoco_model,
            model_xml,
            sites[-1],
            None,
            f"{at} has {len(sites)} wheels, {names}: {MOST_WHEELS_PER_AXLE} at the most",
        )
    if len(sites) == MOST_WHEELS_PER_AXLE and not y[0] > 0.0 > y[1]:
        _refuse(
            mujoco_model,
            model_xml,
            sites[-1],
            y.tolist(),
            f"{at} must have a left wheel, y above 0, and a right one, below",
        )
    if len(sites) == 1 and abs(y[0]) > SAME_AXLE_DISTANCE:
        _refuse(
            mujoco_model, model_xml, sites[0], float(y[0]), f"m is y of the only wheel of {at}: its partner is missing"
        )


def _tyre_numbers(mujoco_model: mujoco.MjModel, model_xml: ModelXml, site: int) -> tuple[float, float, float]:
    """Stiffness (N/m), damping (N s/m) and cornering stiffness (N/rad) from a site's ``user`` attribute."""
    numbers = np.zeros(3)
    given = mujoco_model.site_user[site][:3] if mujoco_model.nuser_site else numbers[:0]
    numbers[: len(given)] = given
    if not np.isfinite(numbers).all() or (numbers < 0.0).any() or not numbers[0] > 0.0:
        allowed = "user must hold the tyre's stiffness in N/m above 0, then damping in N s/m and cornering in N/rad: "
        _refuse(mujoco_model, model_xml, site, numbers.tolist(), f"{allowed}{EXAMPLE_SITE}")
    stiffness, damping, cornering = numbers.tolist()
    return stiffness, damping, cornering
