"""The page of a recording: one HTML file with everything in it, to be mailed."""

import base64
import math
import platform
import sys
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from models.core.finding import Finding
from models.core.whole_files import write_whole
from models.fatigue.counting import Counted
from models.fatigue.damage import SLOPE
from models.systems.measured.comparison import Band
from models.systems.measured.consequences import DAMAGE, FORCE
from models.systems.measured.section_run import Outcome
from models.systems.measured.sections import Answer
from models.systems.measured.verdict import DISAGREES, errors
from models.systems.pitch_plane.trust import Trust
from studies import recording_runs as draw
from studies.recording import FREE, Found, handed_on
from studies.recording_figures import figure

TEMPLATE = "recording.html.jinja"
NAMES = {FREE: "Free run", "kalman": "Run held by the Kalman filter", "prescribed": "Run held to measured angles"}
STILL = 1e-6
"""N, N m: what changes by less is rounding."""
DRAWN = 6
"""Section forces drawn at the most; all of them are in the table and in the files."""


@dataclass(frozen=True)
class Table:
    """Heads, and rows of text; ``numbers`` if all but the first column are; ``folded`` behind this summary if any."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: bool = True
    folded: str = ""


@dataclass(frozen=True)
class Figure:
    """A PNG as base64."""

    data: str
    caption: str


@dataclass(frozen=True)
class Part:
    """A chapter of the page."""

    title: str
    texts: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = field(default=())


def write(found: Found, path: Path) -> Path:
    """Write the page, whole or not at all; returns its path."""
    with TemporaryDirectory() as folder:
        text = page(found, Path(folder))
    write_whole(path, text)
    return path


def page(found: Found, folder: Path) -> str:
    """The page as text; figures pass through ``folder``."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    notes = [finding.text for finding in found.findings if finding.weight == "note"]
    return environment.get_template(TEMPLATE).render(
        title=found.scene.title,
        subtitle=_subtitle(found),
        verdict=_verdict(found),
        tiles=_tiles(found),
        findings=[_finding(found, one, folder, i) for i, one in enumerate(found.findings) if one.weight != "note"],
        notes=notes,
        parts=_parts(found, folder),
        files=_files(found),
        provenance=_provenance(found),
        scene=(Path(found.scene.folder) / found.scene.file).read_text(encoding="utf-8-sig"),
    )


def _subtitle(found: Found) -> str:
    own = found.recording
    began = f"recorded {own.start:%Y-%m-%d %H:%M:%S %Z}, " if own.start else ""
    kind = "a virtual measurement, with the truth beside it; " if found.virtual is not None else ""
    return (
        f"{kind}{began}{own.duration:.6g} s at {1 / own.period:.6g} Hz, {len(own.signals)} channels, vehicle "
        f"{found.rig.name}"
    )


def _verdict(found: Found) -> dict[str, str]:
    """Kind, word, threshold and reason."""
    if found.stopped:
        errors = sum(finding.weight == "error" for finding in found.findings)
        return {
            "kind": "bad",
            "threshold": "Threshold: no error in the recording.",
            "word": "Stopped: nothing was run",
            "why": f"{errors} error(s) were found in the recording. Correct them in the file or in the channel "
            "map, and run again.",
        }
    if found.held is None:
        return {"kind": "bad", "threshold": "Threshold: a run.", "word": "Failed", "why": _ended(found, found.chosen)}
    own, limits = found.verdicts[found.chosen], found.scene.limits
    other = found.verdicts.get(FREE) if found.chosen != FREE else None
    free = f" The free run: {other.word} ({other.reason})." if other else ""
    return {
        "kind": {"accepted": "good", "rejected": "bad"}.get(own.word, "idle"),
        "word": own.word.capitalize(),
        "why": f"{NAMES[found.chosen]}: {own.reason}.{free}",
        "threshold": f"Threshold: held to measured angles with an artificial moment of at most "
        f"{limits.artificial_share:.0%} of what turns the {found.rig.chassis} (up to 15 Hz), "
        f"angles known to {limits.pitch_error:g} rad, and no check channel off by more than "
        f"{DISAGREES:.0%}; or free, and shorter than it can be trusted. A doubt that changes a "
        f"section force by {FORCE[0]:.0%} to {FORCE[1]:.0%} of its rms or {DAMAGE[0]:.0%} to "
        f"{DAMAGE[1]:.0%} of its damage is said, one that changes more rejects.",
    }


def _ended(found: Found, name: str) -> str:
    """How a run ended."""
    return f"{NAMES[name]}: " + found.failed.get(name, "went to the end") + "."


def _tiles(found: Found) -> list[dict[str, str]]:
    weights = [finding.weight for finding in found.findings]
    own = found.recording
    return [
        {"value": f"{own.duration:.4g} s", "name": "of recording"},
        {"value": str(sum(found.put_in(s) for s in own.signals)), "name": "channels put in"},
        {"value": str(sum(not found.put_in(s) for s in own.signals)), "name": "compared with"},
        {"value": str(weights.count("error")), "name": "errors"},
        {"value": str(weights.count("doubt")), "name": "doubts"},
    ]


def _finding(found: Found, one: Finding, folder: Path, i: int) -> dict[str, Any]:
    """A finding and its figure, where there is anything to draw."""
    drawn = figure(one, found.evidence, folder / f"finding_{i}.png")
    effect = next((f" {own}." for own in found.consequences if own.finding == one and own.section), "")
    return {"weight": one.weight, "text": one.text + effect, "figure": _figure(drawn, "") if drawn else None}


def _parts(found: Found, folder: Path) -> list[Part]:
    """Chapters, as far as the recording was brought."""
    inputs = draw.inputs_figure(found, folder / "inputs.png")
    parts = [Part("What drives the vehicle", figures=(_figure(inputs, "Forces on the hubs as they are put in."),))]
    if found.runs:
        parts.append(_drift(found, folder))
    if found.held is not None:
        parts.append(_forces(found, found.held, folder))
        parts += [_checks(found, folder)] if found.compared else []
    return [*parts, _map(found)]


def _drift(found: Found, folder: Path) -> Part:
    said = "; ".join(f"{what}: {_until(own)}" for what, own in found.trust)
    texts = (f"Predicted of the free run, before it is made: {said}.", *(_ended(found, name) for name in found.runs))
    drawn = draw.drift_figure(found, folder / "drift.png")
    return Part("Predicted and run", texts, figures=(_figure(drawn, "Roll and pitch of every run."),))


def _until(trust: Trust) -> str:
    """How far a free run can be trusted, and what ends that."""
    if trust.until is None:
        return f"trusted throughout (an angle wrong by {trust.angle:g} rad is not expected)"
    name, time = trust.until
    return f"trusted until {time:.3g} s, when {name} makes an angle wrong by {trust.angle:g} rad"


def _forces(found: Found, run: Outcome, folder: Path) -> Part:
    counted = {answer: found.counted(run, answer) for answer in handed_on(found, run)}
    moving = {answer: own for answer, own in counted.items() if own.greatest - own.least > STILL}
    first = list(moving)[:DRAWN]
    figures = (
        _figure(
            draw.forces_figure(run, first, folder / "forces.png", found.chosen),
            f"The first {len(first)} of {len(moving)} section forces and moments that change.",
        ),
        _figure(
            draw.counting_figure({a: moving[a] for a in first}, folder / "counting.png"),
            "Level crossings (how often the load rises through a level) and range pairs (rainflow cycles "
            "of at least a range) of the same.",
        ),
    )
    files = f"Handed on as {', '.join(path.name for path in found.handed)}."
    still = len(counted) - len(moving)
    none = f" {still} more are handed on that stay the same throughout." if still else ""
    return Part("Section forces and moments", (files + none, DAMAGE_NOTE), _damages(found, run, moving), figures)


DAMAGE_NOTE = (
    "Pseudo-damage is the sum over rainflow cycles (ASTM E1049-85, the residue as half cycles) of the range "
    "to the slope; compare it only with figures counted alike."
)


def _damages(found: Found, run: Outcome, counted: dict[Answer, Counted]) -> tuple[Table, ...]:
    """Springs, mounts and bars, and folded away guides and hubs."""
    slopes = tuple(found.scene.hand_on.slopes)
    names = set(found.rig.places.connectors)
    true = errors(run, found.virtual, SLOPE).damage if found.virtual is not None else {}
    heads = (
        "section",
        "unit",
        "least",
        "greatest",
        "mean",
        *(f"damage, slope {slope:g}" for slope in slopes),
        *((f"damage by true one, slope {SLOPE:g}",) if true else ()),
    )
    rows = {
        answer: (
            answer.name,
            answer.unit,
            *(f"{v:.4g}" for v in (own.least, own.greatest, own.mean)),
            *(f"{own.damage[slope]:.3e}" for slope in slopes),
            *((f"{true[answer.section]:.3f}" if answer.section in true else "–",) if true else ()),
        )
        for answer, own in counted.items()
    }
    inside = tuple(row for answer, row in rows.items() if answer.section in names)
    outside = tuple(row for answer, row in rows.items() if answer.section not in names)
    both = Table(heads, inside), Table(heads, outside, folded=f"{len(outside)} forces and moments of guides and hubs")
    return tuple(table for table in both if table.rows)


def _checks(found: Found, folder: Path) -> Part:
    """Channels that were not put in, beside the run."""
    bands = next((one.bands for one in found.compared if one.bands), ())
    heads = (
        "channel",
        "unit",
        "explained",
        "offset",
        *(f"error {_band(band)}" for band in bands),
        *(f"damage ratio, slope {slope:g}" for slope in found.scene.hand_on.slopes),
        "trusted for",
    )
    sizes = [math.sqrt(sum(band.measured**2 for band in one.bands)) or math.inf for one in found.compared]
    rows = [
        (
            one.signal.name,
            one.answer.unit,
            f"{one.explained:.2%}",
            f"{one.offset:.3g}",
            *(f"{band.error / size:.2%}" for band in one.bands),
            *(f"{ratio:.3g}" for ratio in one.damage.values()),
            "all of it" if one.trusted == math.inf else f"{one.trusted:g} s",
        )
        for one, size in zip(found.compared, sizes, strict=True)
    ]
    named = [one for one in found.compared if one.signal.check] or list(found.compared)
    drawn = draw.overlay_figure(found, named[:DRAWN], folder / "checks.png")
    return Part(
        "Channels that were not put in, beside the run",
        (CHECKS_NOTE,),
        (Table(heads, tuple(rows)),),
        (_figure(drawn, "Measured and computed."),),
    )


CHECKS_NOTE = (
    "Explained is the part of the measured variance that the run gives; errors by band are by the rms of "
    "the channel; a channel is trusted until the error of one second exceeds half of that."
)


def _band(band: Band) -> str:
    return f"{band.low:g}–{band.high:g} Hz"


def _map(found: Found) -> Part:
    heads = ("channel", "file", "quantity", "at", "component", "axes", "unit in the file", "to SI", "use")
    rows = [
        (
            s.channel,
            s.file,
            s.quantity,
            s.at,
            s.component or "–",
            s.frame,
            s.unit or "–",
            f"{s.sign * s.factor:g}",
            "put in" if found.put_in(s) else "compared with",
        )
        for s in found.recording.signals
    ]
    return Part("Channel map", tables=(Table(heads, tuple(rows), numbers=False),))


def _files(found: Found) -> Table:
    rows = []
    for i, file in enumerate(found.scene.files):
        path = found.scene.path(file.file, f"files.{i}.file")
        rows.append((path.name, f"{path.stat().st_size:,} bytes", f"{file.offset:g} s"))
    return Table(("file", "size", "offset"), tuple(rows))


def _provenance(found: Found) -> list[str]:
    names = ("twinrig", found.engine if found.engine != "reference" else "numpy", "numpy", "scipy")
    versions = ", ".join(f"{name} {version(name)}" for name in dict.fromkeys(names))
    times = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in found.seconds.items())
    return [
        f"Command: {' '.join(sys.argv)}",
        f"Versions: {versions}, Python {platform.python_version()}",
        f"Engine: {found.engine}, Runge-Kutta 4",
        f"Time taken, once: {times}",
        *([f"Comment of the files: {found.recording.comment}"] if found.recording.comment else []),
    ]


def _figure(path: Path, caption: str) -> Figure:
    return Figure(base64.b64encode(path.read_bytes()).decode(), caption)
