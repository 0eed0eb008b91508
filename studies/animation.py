"""Pictures of a moving vehicle with the forces on it, as each engine computes them: stills and a film."""

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from models.drawing.figures import LABELS
from studies.pictures.page import FilmPage, difference_sentence, eight_bit_image
from studies.pictures.scene import PictureScene
from studies.pictures.video import missing_extra, write, write_png

SYSTEM = "pictures"
ReportProgress = Callable[[str, float], None]
STILL_SIZE = 1280, 800
"""Width and height (pixels) of an engine's still."""
RUN_SHARE_OF_PROGRESS = 0.2
"""Share of the total time that the runs take, for the progress bar."""


def run(
    scene: PictureScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Run the vehicle in each engine and draw it; saves ``page.png``, a still for each engine and ``film.mp4``, and
    returns the summary."""
    from studies.pictures.drawing import draw_frame

    report_progress(f"{scene.vehicle} in {', '.join(LABELS[engine] for engine in engines)}", 0.0)
    film, vehicle = scene.film, import_module(f"studies.pictures.{scene.vehicle}")
    stage, motions = vehicle.stage_and_motions(film.duration, film.frame_times(), engines)
    page = FilmPage(stage, motions)
    best = page.frame_of_largest_force()
    written = [write_png(output_folder / "page.png", page.frame(best))]
    for motion in motions:
        image = eight_bit_image(draw_frame(motion, stage, best, *STILL_SIZE))
        written.append(write_png(output_folder / f"{motion.engine}.png", image))
    missing_format = missing_extra(film.format)
    if film.format != "png" and not missing_format:
        frames = _frames_with_progress(page.frames(), film.frame_count, report_progress)
        written.append(write(output_folder / f"film.{film.format}", frames, film.frames_per_second))
    table = [difference_sentence(motions), ", ".join(path.name for path in written), missing_format]
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "frames": film.frame_count,
        "results": {motion.engine: motion.run for motion in motions if motion.run is not None},
        "table": [f"  {line}" for line in table if line],
    }


def _frames_with_progress(
    frame_images: Iterator[np.ndarray], frame_count: int, report_progress: ReportProgress
) -> Iterator[np.ndarray]:
    """Yield the frames, and advance the progress bar at each frame."""
    for k, frame in enumerate(frame_images):
        report_progress(
            f"frame {k + 1} of {frame_count}", RUN_SHARE_OF_PROGRESS + (1.0 - RUN_SHARE_OF_PROGRESS) * k / frame_count
        )
        yield frame


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("animation")
