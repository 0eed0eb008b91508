"""The page of a recording: one HTML file with everything in it, to be mailed."""

import base64
import os
import platform
import sys
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from models.measured.counting import Counted
from models.measured.finding import Finding
from models.measured.section_run import Outcome
from models.measured.sections import Answer
from studies.recording import FREE, Found

TEMPLATE = "recording.html.jinja"
DRAWN = 6
"""Section forces drawn at the most; all of them are in the table and in the files."""


@dataclass(frozen=True)
class Table:
    """Heads, and rows of text; ``numbers`` if all but the first column are."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: bool = True


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
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)
    return path


def page(found: Found, folder: Path) -> str:
    """The page as text; figures pass through ``folder``."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)  # fmt: skip
    notes = [finding.text for finding in found.findings if finding.weight == "note"]
    return environment.get_template(TEMPLATE).render(
        title=found.scene.title, subtitle=_subtitle(found), verdict=_verdict(found), tiles=_tiles(found),
        findings=[_finding(found, one, folder, i) for i, one in enumerate(found.findings) if one.weight != "note"],
        notes=notes, parts=_parts(found, folder), files=_files(found), provenance=_provenance(found),
        scene=(Path(found.scene.folder) / found.scene.file).read_text(encoding="utf-8-sig"),
    )  # fmt: skip


def _subtitle(found: Found) -> str:
    own = found.recording
    began = f"recorded {own.start:%Y-%m-%d %H:%M:%S %Z}, " if own.start else ""
    kind = "a virtual measurement, with the truth beside it; " if found.virtual is not None else ""
    return f"{kind}{began}{own.duration:.6g} s at {1 / own.period:.6g} Hz, {len(own.signals)} channels, vehicle " \
           f"{found.vehicle.tree.name}"  # fmt: skip


def _verdict(found: Found) -> dict[str, str]:
    """Kind, word, threshold and reason."""
    if found.stopped:
        errors = sum(finding.weight == "error" for finding in found.findings)
        return {"kind": "bad", "threshold": "Threshold: no error in the recording.", "word": "Stopped: nothing was run",
                "why": f"{errors} error(s) were found in the recording. Correct them in the file or in the channel "
                       "map, and run again."}  # fmt: skip
    return {"kind": "idle", "threshold": "", "word": "", "why": ""}


def _tiles(found: Found) -> list[dict[str, str]]:
    weights = [finding.weight for finding in found.findings]
    own = found.recording
    return [{"value": f"{own.duration:.4g} s", "name": "of recording"},
            {"value": str(sum(not s.check for s in own.signals)), "name": "channels put in"},
            {"value": str(sum(s.check for s in own.signals)), "name": "channels compared with"},
            {"value": str(weights.count("error")), "name": "errors"},
            {"value": str(weights.count("doubt")), "name": "doubts"}]  # fmt: skip


def _finding(found: Found, one: Finding, folder: Path, i: int) -> dict[str, Any]:
    return {"weight": one.weight, "text": one.text, "figure": None}


def _parts(found: Found, folder: Path) -> list[Part]:
    """Chapters, as far as the recording was brought."""
    from studies import recording_runs as draw

    inputs = draw.inputs_figure(found, folder / "inputs.png")
    parts = [Part("What drives the vehicle", figures=(_figure(inputs, "Forces on the hubs as they are put in."),))]
    if found.held is not None:
        parts += [_drift(found, folder), _forces(found, found.held, folder)]
    return [*parts, _map(found)]


def _drift(found: Found, folder: Path) -> Part:
    from studies.recording_runs import drift_figure

    texts = [f"The run {'driven by the forces alone' if name == FREE else f'with the stabiliser {name!r}'} "
             + (f"ended early: {found.failed[name]}." if name in found.failed else "went to the end.")
             for name in found.runs]  # fmt: skip
    drawn = drift_figure(found, folder / "drift.png")
    return Part("How the runs went", tuple(texts), figures=(_figure(drawn, "Roll and pitch of every run."),))


def _forces(found: Found, run: Outcome, folder: Path) -> Part:
    from studies.recording_runs import counting_figure, forces_figure

    answers = handed_on(found, run)
    name = found.scene.stabilise.method if found.scene.stabilise.method in found.runs else FREE
    counted = {answer: found.counted(run, answer) for answer in answers}
    first = answers[:DRAWN]
    figures = (_figure(forces_figure(run, first, folder / "forces.png", name),
                       f"The first {len(first)} of {len(answers)} section forces and moments."),
               _figure(counting_figure({a: counted[a] for a in first}, folder / "counting.png"),
                       "Level crossings (how often the load rises through a level) and range pairs (rainflow cycles "
                       "of at least a range) of the same."))  # fmt: skip
    return Part("Section forces and moments", (DAMAGE_NOTE,), (_damages(found, counted),), figures)


DAMAGE_NOTE = ("Pseudo-damage is the sum over rainflow cycles (ASTM E1049-85, the residue as half cycles) of the range "
               "to the slope; compare it only with figures counted alike.")  # fmt: skip


def handed_on(found: Found, run: Outcome) -> list[Answer]:
    """Forces and moments of the sections that the scene names."""
    wanted = found.scene.hand_on.sections
    return [a for a in run.answers if a.section and a.unit in ("N", "N m") and (wanted is None or a.section in wanted)]


def _damages(found: Found, counted: dict[Answer, Counted]) -> Table:
    slopes = tuple(found.scene.hand_on.slopes)
    heads = ("section", "unit", "least", "greatest", "mean", *(f"damage, slope {slope:g}" for slope in slopes))
    rows = [(answer.name, answer.unit, *(f"{v:.4g}" for v in (own.least, own.greatest, own.mean)),
             *(f"{own.damage[slope]:.3e}" for slope in slopes)) for answer, own in counted.items()]  # fmt: skip
    return Table(heads, tuple(rows))


def _map(found: Found) -> Part:
    heads = ("channel", "file", "quantity", "at", "component", "axes", "unit in the file", "to SI", "use")
    rows = [(s.channel, s.file, s.quantity, s.at, s.component or "–", s.frame, s.unit or "–",
             f"{s.sign * s.factor:g}", "compared with" if s.check else "put in")
            for s in found.recording.signals]  # fmt: skip
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
    return [f"Command: {' '.join(sys.argv)}", f"Versions: {versions}, Python {platform.python_version()}",
            f"Engine: {found.engine}, Runge-Kutta 4", f"Time taken: {times}",
            *([f"Comment of the files: {found.recording.comment}"] if found.recording.comment else [])]  # fmt: skip


def _figure(path: Path, caption: str) -> Figure:
    return Figure(base64.b64encode(path.read_bytes()).decode(), caption)
