"""Cost of accuracy in rolling contact: error, computing time and cells of every theory on the scene's ellipse."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, read
from models.core.whole_files import write_whole
from models.machine.seconds import seconds_text
from models.systems.contact.run import inputs_of_scene_contact
from models.systems.contact.scene import ContactScene
from models.systems.contact.work_precision import TheoryPoint, cheapest_lines, priced_theories

SYSTEM = "contact"
ReportProgress = Callable[[str, float], None]


class Options(Strict):
    """Keys of the table [options] of this study."""

    levels: list[float] = Field(
        [0.5, 1.5], min_length=1, description="sizes of the creepage; at 1 the linear theory reaches mu N"
    )


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Raise InputError unless the contact is a single ellipse, or if the scene has keys that this study sets itself."""
    options = read(Options, scene.options, scene.file, "options")
    if scene.profiles is not None or scene.cases is not None:
        raise InputError(scene.file, scene.geometry, None, "this study needs an ellipse, curvatures or radii")
    for name in ("creepage", "sweep", "method"):
        if name in scene.model_fields_set:
            raise InputError(scene.file, name, None, "this study goes through all of them itself: drop this table")
    if inputs_of_scene_contact(scene).falling is not None:
        raise InputError(scene.file, "falling_friction", None, "the exact theory here has constant friction: drop this")
    if not all(0 < level <= 100 for level in options.levels):
        raise InputError(scene.file, "options.levels", options.levels, "must be above 0 and at most 100")


def run(
    scene: ContactScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute errors and times of every theory with every number of cells; saves ``price.nc``, ``price.png`` and
    ``table.txt``, and returns the summary."""
    check(scene, engines)
    price = priced_theories(scene, tuple(read(Options, scene.options, scene.file, "options").levels), report_progress)
    price.save(output_folder / "price.nc")
    points, uncertain = price.detail, price["uncertainty"]
    table = _table_lines(points, uncertain.size, uncertain.max())
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    from models.drawing.figures import save
    from studies.contact_figures import price_figure

    a, b = (1e3 * price.data.attrs[axis] for axis in "ab")
    title = f"What accuracy costs: a = {a:.2f} mm, b = {b:.2f} mm, {uncertain.size} contacts"
    save(price_figure(price, title), output_folder / "price.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": {"price": price},
        "points": [asdict(point) for point in points],
        "table": table,
    }


def _table_lines(theory_points: list[TheoryPoint], contact_count: int, reference_uncertainty: float) -> list[str]:
    """Lines for the screen: errors and times of all theories and cells, then the cheapest theory for each target
    error."""
    return [
        f"  error of the tangential force in % of mu N over {contact_count} contacts (exact ones known to "
        f"{100 * reference_uncertainty:.2g} %)",
        f"    {'':<28}{'cells':>6}{'mean':>8}{'95 of 100':>11}{'largest':>9}   time of contacts",
        *(
            f"    {point.name:<28}{point.cells:>6}{100 * point.mean:>8.2f}{100 * point.quantile_95:>11.2f}"
            f"{100 * max(point.errors):>9.2f}   {seconds_text((point.seconds, *point.range))}"
            for point in theory_points
        ),
        "  cheapest that meets      in the mean; in 95 of 100 contacts",
        *(
            f"    {target:>6}  {mean};  {largest_cheapest}"
            for target, mean, largest_cheapest in cheapest_lines(theory_points)
        ),
    ]


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("contact_price")
