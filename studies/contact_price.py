"""What accuracy costs in rolling contact: every theory on the scene's ellipse, its error beside its time and cells."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, read
from models.core.whole_files import write_whole
from models.machine.seconds import cost
from models.systems.contact.of_scene import built_of, hertz_of
from models.systems.contact.scene import ContactScene
from models.systems.contact.work_precision import WAYS, cheapest_lines, ellipse_cases, exact, measure

SYSTEM = "contact"
Progress = Callable[[str, float], None]


class Options(Strict):
    """[options] of this study."""

    levels: list[float] = Field(
        [0.5, 1.5], min_length=1, description="sizes of the creepage; at 1 the linear theory reaches mu N"
    )


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Refuse what is no single ellipse, and keys that this study sets itself."""
    options = read(Options, scene.options, scene.file, "options")
    if scene.profiles is not None or scene.cases is not None:
        raise InputError(scene.file, scene.geometry, None, "this study needs an ellipse, curvatures or radii")
    for name in ("creepage", "sweep", "method"):
        if name in scene.model_fields_set:
            raise InputError(scene.file, name, None, "this study goes through all of them itself: drop this table")
    if built_of(scene).falling is not None:
        raise InputError(scene.file, "falling_friction", None, "the exact theory here has constant friction: drop this")
    if not all(0 < level <= 100 for level in options.levels):
        raise InputError(scene.file, "options.levels", options.levels, "must be above 0 and at most 100")


def run(scene: ContactScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Exact forces, then every theory on every number of cells; saves ``price.png`` and ``table.txt``."""
    check(scene, engines)
    options, hertz = read(Options, scene.options, scene.file, "options"), hertz_of(scene)
    built = built_of(scene)
    cases = ellipse_cases(
        float(hertz.a), float(hertz.b), float(hertz.load), built.friction, built.pair, tuple(options.levels)
    )
    known = []
    for i, case in enumerate(cases):
        progress("exact theory", 0.5 * i / len(cases))
        known.append(exact(case))
    points = []
    for i, way in enumerate(WAYS):
        progress(way.name, 0.5 + 0.5 * i / len(WAYS))
        points += [measure(way, cells, known) for cells in way.cells]
    table = _table(points, len(known), max(case.error for case in known))
    write_whole(folder / "table.txt", "\n".join(table) + "\n")
    from models.drawing.figures import save
    from studies.contact_figures import price_figure

    title = f"What accuracy costs: a = {1e3 * hertz.a:.2f} mm, b = {1e3 * hertz.b:.2f} mm, {len(known)} contacts"
    save(price_figure(points, title), folder / "price.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "points": [asdict(one) for one in points],
        "table": table,
    }


def _table(points: list[Any], count: int, uncertain: float) -> list[str]:
    """All points, then the cheapest for each target."""
    lines = [
        f"  error of the tangential force in % of mu N over {count} contacts (exact ones known to "
        f"{100 * uncertain:.2g} %)",
        f"    {'':<28}{'cells':>6}{'mean':>8}{'95 of 100':>11}{'largest':>9}   time of contacts",
    ]
    lines += [
        f"    {one.name:<28}{one.cells:>6}{100 * one.mean:>8.2f}{100 * one.most:>11.2f}"
        f"{100 * max(one.errors):>9.2f}   {cost((one.seconds, *one.range))}"
        for one in points
    ]
    lines.append("  cheapest that meets      in the mean; in 95 of 100 contacts")
    return lines + [f"    {target:>6}  {mean};  {most}" for target, mean, most in cheapest_lines(points)]


if __name__ == "__main__":
    from studies.command_line import study

    study("contact_price")
