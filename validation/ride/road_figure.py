"""Spectra and coherency of roads under two tracks, in the manner of Rill's Fig. 3."""

from typing import Any

import numpy as np

from models.road.iso8608 import level_of_class
from models.road.isotropic import isotropic_like
from models.road.two_track import road_of_level


def coherency_figure(half_track: float, measured: list[dict[str, Any]]) -> tuple[str, Any]:
    """Left the spectra over the wavenumber, right the coherency of left and right; measured roads thin."""
    from models.drawing.figures import plt

    road, k = road_of_level(half_track), np.geomspace(0.02, 100.0, 300)
    isotropic = isotropic_like(road, half_track)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.4))
    left.fill_between(
        k,
        level_of_class("C") / 2 / k**2,
        level_of_class("C") * 2 / k**2,
        color="0.92",
        zorder=0,
        label="ISO 8608 class C, limits halved: two-sided",
    )
    left.loglog(k, road.spectrum(k, half_track), "k", lw=2, label="track: mean and roll process")
    left.loglog(k, road.mean.spectrum(k), "k--", label="mean process")
    left.loglog(k, half_track**2 * road.roll.spectrum(k), "k:", label="roll process, times $b^2$")
    right.semilogx(k, road.coherency(k, half_track, -half_track), "k", lw=2, label="mean and roll process")
    right.semilogx(k, isotropic.coherency(k, 2 * half_track), "k-.", label="isotropic, same track spectrum")
    for i, one in enumerate(measured):
        left.loglog(one["wavenumber"], one["left"], color=f"C{i}", lw=0.8, label=_label(one))
        if one["fits"][1] is not None:
            right.semilogx(one["wavenumber"], one["coherency"], color=f"C{i}", lw=0.8, label=_label(one))
            right.axhline(one["chance"], color=f"C{i}", lw=0.8, ls=(0, (1, 3)))
    left.set(
        title="Spectral density of the left track [m$^3$], two-sided",
        xlabel="wavenumber [rad/m]",
        xlim=(0.02, 100),
        ylim=(1e-10, 1e-1),
    )
    right.set(
        title="Coherency of left and right",
        xlabel="wavenumber [rad/m]",
        xlim=(0.02, 100),
        ylim=(0, 1.4),
        yticks=np.linspace(0, 1, 6),
    )
    left.legend(fontsize=7.5, loc="lower left")
    right.legend(fontsize=7.5, loc="upper right", ncols=2)
    figure.suptitle(
        "A road of mean and roll process: both tracks move together in long waves and part in short ones",
        x=0.01,
        ha="left",
        fontweight="bold",
    )
    said = (
        f"Tracks {2 * half_track:g} m apart with the values read from the paper; its vehicle and measurements are "
        "not recoverable. Dotted levels: what chance alone shows in 95 % of the windowed estimates."
    )
    return said, figure


def _label(one: dict[str, Any]) -> str:
    name = one["name"].removesuffix(".crg").replace("_", " ")
    return f"{name}, {one['length']:.3g} m" if one["length"] < 999 else f"{name}, {one['length'] / 1e3:.3g} km"
