"""One figure for each finding of the checks of a recording: what an engineer looks at before he believes it."""

from pathlib import Path
from textwrap import shorten

import numpy as np

from models.core.finding import Finding
from models.drawing.figures import plt, save
from models.measured.checks.agreement import Agreement, Fault, Group
from models.measured.checks.evidence import Evidence
from models.measured.signal import UNITS, Signal
from models.vehicles.cut_vehicle import GRAVITY

AROUND, LONGEST, MOST = 0.6, 15.0, 20_000
"""s drawn beside a marked time; s drawn where none is marked; samples drawn at the most."""
SHOWN = 4
"""Signals drawn at the most."""
TITLE = 60
"""Letters of a place in a title."""
LOUD, QUIET, MARK = "#d55e00", "#222222", "#f0e442"


def figure(finding: Finding, evidence: Evidence, path: Path) -> Path | None:
    """Draw what a finding says into ``path``; None where there is nothing to draw."""
    fault = next(
        (
            f
            for f in evidence.faults
            if {s.name for s in f.signals} == set(finding.signals) and finding.check in KINDS.get(f.kind, ())
        ),
        None,
    )
    signals = tuple(s for s in evidence.recording.signals if s.name in finding.signals)
    if not signals:
        return None
    if finding.check in ("weight", "gain", "sign", "unit") and _loads(evidence, signals):
        return _means(evidence, path)
    if evidence.agreement is not None and fault is not None:
        return _exchange(evidence.agreement, fault, path) if fault.kind == "swapped" else _ratio(evidence, fault, path)
    return _spectrum(evidence, signals, path) if finding.check == "noise" else _times(finding, evidence, signals, path)


KINDS = {"late": ("shift",), "factor": ("sign", "unit", "gain"), "swapped": ("swapped",)}
"""Checks that tell a kind of fault."""


def _loads(evidence: Evidence, signals: tuple[Signal, ...]) -> bool:
    """Whether signals are vertical forces of a vehicle whose hubs all have one."""
    own = evidence.vertical()
    return evidence.vehicle is not None and len(own) == len(evidence.vehicle.hubs) and set(signals) <= set(own.values())


def _times(finding: Finding, evidence: Evidence, signals: tuple[Signal, ...], path: Path) -> Path:
    """Signals over time, what is meant marked."""
    own, marked = evidence.recording, finding.times
    begin = max(marked[0] - AROUND, 0.0) if marked else 0.0
    end = min(marked[1] + AROUND, own.duration) if marked else min(LONGEST, own.duration)
    first, last = round(begin / own.period), round(end / own.period) + 1
    every = max((last - first) // MOST, 1)
    times = own.period * np.arange(first, last)[::every]
    drawn, axes = plt.subplots(
        len(signals[:SHOWN]), 1, figsize=(8, 1.2 + 1.5 * len(signals[:SHOWN])), sharex=True, squeeze=False
    )
    for axis, signal in zip(axes[:, 0], signals[:SHOWN], strict=False):
        values = own.columns.read(signal.name, first, last - first)[::every]
        axis.plot(times[: len(values)], values, color=QUIET, lw=0.8)
        axis.set_ylabel(f"{signal.name} [{UNITS[signal.quantity]}]")
        if finding.check == "gravity" and signal.component == "z":
            axis.axhline(GRAVITY if signal.gravity else 0.0, color=LOUD, ls="--", label="expected mean")
            axis.legend(loc="best")
        if marked:
            axis.axvspan(*marked, color=MARK, alpha=0.5, lw=0)
        if finding.check == "clipped" and marked:
            axis.axhline(float(own.columns.read(signal.name, round(marked[0] / own.period), 1)[0]), color=LOUD, ls="--")
    axes[-1, 0].set_xlabel("time [s]" + ("; yellow: what is meant" if marked else ""))
    place = shorten(finding.place or "Recording", TITLE, placeholder=" ...")
    drawn.suptitle(f"{place}: as recorded", x=0.01, ha="left", fontweight="bold")
    return save(drawn, path)


def _means(evidence: Evidence, path: Path) -> Path:
    """Mean vertical forces beside the static loads."""
    assert evidence.vehicle is not None
    hubs, loads = evidence.vehicle.hubs, evidence.vehicle.loads
    found = np.array([evidence.mean(evidence.vertical()[hub]) for hub in hubs])
    drawn, axis = plt.subplots(figsize=(8, 3.2))
    at = np.arange(len(hubs))
    axis.bar(at - 0.2, loads, 0.38, color="#bbbbbb", label="static load by the vehicle file")
    bars = axis.bar(at + 0.2, found, 0.38, color=LOUD, label="mean of the recording")
    axis.bar_label(bars, [f"{part:+.2%}" if abs(part) < 0.5 else f"x {part + 1:.3g}" for part in found / loads - 1])
    axis.set_xticks(at, [f"{hub}\n{evidence.vertical()[hub].name}" for hub in hubs])
    axis.set_ylabel("vertical force [N]")
    if np.abs(found).max() > 10 * loads.max():
        axis.set_yscale("symlog", linthresh=float(loads.max()))
    axis.margins(y=0.2)
    drawn.legend(*axis.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    drawn.suptitle("Mean vertical forces", x=0.01, ha="left", fontweight="bold")
    return save(drawn, path)


def _ratio(evidence: Evidence, fault: Fault, path: Path) -> Path:
    """What a channel reads by what it should, by frequency: a delay is a slope of the phase, a factor a level."""
    assert evidence.agreement is not None
    own = evidence.agreement
    f, ratio, sure = _measured_ratio(_before(own, evidence.faults, fault), fault)
    late, factor = (fault.size, 1.0) if fault.kind == "late" else (0.0, fault.size)
    expected = factor * np.exp(-2j * np.pi * f * late)
    turned = -360 * f * late + (180.0 if factor < 0 else 0.0)
    drawn, axes = plt.subplots(2, 1, figsize=(8, 4.4), sharex=True)
    for axis, measured, said, level in (
        (axes[0], np.abs(ratio), np.abs(expected), 1.0),
        (axes[1], _degrees(ratio / expected) + turned, turned, 0.0),
    ):
        axis.scatter(f, measured, s=4 + 40 * sure, color=QUIET, label="measured; larger: surer")
        axis.plot(f, said, color=LOUD, label=_said(fault))
        axis.axhline(level, color="#999999", ls=":", label="as it should be")
    axes[0].set_ylabel("size [-]")
    axes[1].set_ylabel("phase [deg]")
    axes[0].set_ylim(0.0, 2 * max(abs(factor), 1.0))
    axes[1].set_xlabel("frequency [Hz]")
    drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    title = f"{fault.name}: recorded by what the motion of the vehicle tells"
    drawn.suptitle(title, x=0.01, ha="left", fontweight="bold")
    return save(drawn, path)


def _degrees(values: np.ndarray) -> np.ndarray:
    return np.degrees(np.angle(values))


def _said(fault: Fault) -> str:
    return f"{1e3 * fault.size:+.2f} ms" if fault.kind == "late" else f"factor {fault.size:.4g}"


def _before(own: Agreement, faults: tuple[Fault, ...], fault: Fault) -> Agreement:
    """The agreement in which this fault was found: without those that were found before it."""
    for other in faults[: faults.index(fault)]:
        own = own.without(other)
    return own


def _measured_ratio(own: Agreement, fault: Fault) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies (f,), recorded by true value (f,), and how sure it is (f,), up to 1."""
    among = own.inputs if fault.signals[0] in own.inputs else own.outputs
    group = Group(fault.name, among is own.inputs, tuple(among.index(s) for s in fault.signals))
    cross, power = own.share(group)
    weights = own.weights
    line, size = (weights * cross).sum(axis=1), (weights * power).sum(axis=1)
    ratio = line / size
    return own.frequencies, 1 / ratio if group.forces else ratio, size / size.max()


def _exchange(own: Agreement, fault: Fault, path: Path) -> Path:
    """Unexplained shares of every reading, as mapped and exchanged."""
    other, names = own.without(fault), [s.name for s in own.outputs]
    drawn, axis = plt.subplots(figsize=(8, 1.4 + 0.24 * len(names)))
    at = np.arange(len(names))
    axis.barh(at - 0.2, 100 * own.unexplained, 0.38, color=LOUD, label="as mapped")
    axis.barh(at + 0.2, 100 * other.unexplained, 0.38, color=QUIET, label=f"{fault.name} exchanged")
    axis.set_yticks(at, names)
    axis.invert_yaxis()
    axis.set_xlabel("what the hub forces leave unexplained of each reading [%]")
    drawn.legend(*axis.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    drawn.suptitle("Exchanged hubs", x=0.01, ha="left", fontweight="bold")
    return save(drawn, path)


def _spectrum(evidence: Evidence, signals: tuple[Signal, ...], path: Path) -> Path:
    """Power density of signals beside the noise that is stated."""
    from scipy.signal import welch

    own = evidence.recording
    drawn, axis = plt.subplots(figsize=(8, 3.2))
    for signal in signals[:SHOWN]:
        values = own.samples(signal)
        f, density = welch(np.where(np.isfinite(values), values, np.nanmean(values)), 1 / own.period, nperseg=2048)
        axis.loglog(f[1:], np.sqrt(density[1:]), lw=0.9, label=signal.name)
        stated = evidence.claimed.get(signal.name)
        if stated:
            axis.axhline(stated * np.sqrt(2 * own.period), color=LOUD, ls="--", label=f"stated for {signal.name}")
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(f"spectral density [{UNITS[signals[0].quantity]} / sqrt(Hz)]")
    drawn.legend(*axis.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    drawn.suptitle("Noise: where the spectrum goes flat", x=0.01, ha="left", fontweight="bold")
    return save(drawn, path)
