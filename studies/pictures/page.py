"""Page of a film: each engine's picture, scale of the forces, forces over time, and differences of the engines."""

from collections.abc import Iterator
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrow
from matplotlib.transforms import IdentityTransform

from models.drawing.figures import COLOURS, DARK, GREY, LABELS, ORANGE, PINK, SKY
from studies.pictures.drawing import draw_frame
from studies.pictures.film import FilmedMotion, FilmStage, largest_motion_differences

PAGE_WIDTH, PAGE_HEIGHT = 1280, 720
PAGE_MARGIN, TITLE_HEIGHT, PICTURE_HEIGHT = 12, 66, 400
"""Margin, height of the title, and height of the pictures, in pixels."""


FONT_SIZES: dict[Any, Any] = {
    "font.size": 11.5,
    **dict.fromkeys(("axes.labelsize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize"), 11.5),
    "axes.titlesize": 12.5,
}
"""Font sizes (points) that are readable if the page is shown as wide as other figures."""


class FilmPage:
    """Page of 1280 x 720 pixels on which the frames of filmed motions are drawn one after the other."""

    def __init__(self, film_stage: FilmStage, filmed_motions: list[FilmedMotion]) -> None:
        self.stage, self.motions = film_stage, filmed_motions
        self._wide = (PAGE_WIDTH - PAGE_MARGIN * (len(filmed_motions) + 1)) // len(filmed_motions)
        self._lefts = [PAGE_MARGIN + i * (self._wide + PAGE_MARGIN) for i in range(len(filmed_motions))]
        self._forces = [
            [
                arrow.vectors @ film_stage.force_curve.direction / 1e3
                for arrow in motion.arrows
                if arrow.kind == film_stage.force_curve.kind
            ]
            for motion in filmed_motions
        ]
        with rc_context(FONT_SIZES):
            self._draw()
        self._still = self._canvas.copy_from_bbox(self._figure.bbox)

    def _draw(self) -> None:
        """Draw all parts of the page that are the same in all frames."""
        stage, motions = self.stage, self.motions
        no_layout: Any = "none"  # overrides the style of figures; the type hints do not know it
        self._figure = Figure(figsize=(PAGE_WIDTH / 100, PAGE_HEIGHT / 100), dpi=100, layout=no_layout)
        self._canvas = FigureCanvasAgg(self._figure)
        self._figure.text(PAGE_MARGIN / PAGE_WIDTH, 0.96, stage.title, fontsize=15, weight="bold")
        for left, motion in zip(self._lefts, motions, strict=True):
            style: Any = {"fontsize": 12, "weight": "bold", "color": COLOURS[motion.engine], "va": "bottom"}
            self._figure.text(left / PAGE_WIDTH, 1 - (TITLE_HEIGHT - 5) / PAGE_HEIGHT, LABELS[motion.engine], **style)
        self._draw_legend()
        axes = self._draw_curves()
        self._clock = self._figure.text(
            1 - PAGE_MARGIN / PAGE_WIDTH, 0.96, "", ha="right", fontsize=13, family="monospace"
        )
        self._cursor = axes.axvline(0.0, color=DARK, lw=1.2)
        for artist in (self._clock, self._cursor):
            artist.set_animated(True)
        self._canvas.draw()

    def frames(self) -> Iterator[np.ndarray]:
        """Yield the page (720, 1280, 3) of every frame, with 8 bits per colour."""
        return (self.frame(k) for k in range(len(self.motions[0].times)))

    def frame(self, frame_number: int) -> np.ndarray:
        """The page (720, 1280, 3) of frame number ``frame_number``, with 8 bits per colour."""
        time, canvas = float(self.motions[0].times[frame_number]), self._canvas
        canvas.restore_region(self._still)
        self._clock.set_text(f"t = {time:.3f} s")
        self._cursor.set_xdata([time, time])
        for artist in (self._clock, self._cursor):
            self._figure.draw_artist(artist)
        page = np.asarray(canvas.buffer_rgba())[..., :3].copy()
        for left, motion in zip(self._lefts, self.motions, strict=True):
            image = draw_frame(motion, self.stage, frame_number, self._wide, PICTURE_HEIGHT)
            page[TITLE_HEIGHT : TITLE_HEIGHT + PICTURE_HEIGHT, left : left + self._wide] = eight_bit_image(image)
        return page

    def frame_of_largest_force(self) -> int:
        """Number of the frame in which the sum of the plotted forces' magnitudes is largest."""
        return int(np.abs(np.column_stack(self._forces[0])).sum(axis=1).argmax())

    def _draw_legend(self) -> None:
        """Draw the legend: an arrow for each kind of force with its legend force (N) to scale at the camera's target,
        and the stage's caption."""
        row, left = 1 - (TITLE_HEIGHT + PICTURE_HEIGHT + 20) / PAGE_HEIGHT, float(PAGE_MARGIN)
        for name, kind in self.stage.arrow_styles.items():
            length = kind.scale * kind.legend * self.stage.camera.pixels_per_metre(PICTURE_HEIGHT)
            arrow = FancyArrow(
                left,
                row * PAGE_HEIGHT,
                length,
                0.0,
                width=3.5,
                head_width=12,
                head_length=min(15, length),
                length_includes_head=True,
                color=kind.colour,
                lw=0,
                transform=IdentityTransform(),
            )
            self._figure.add_artist(arrow)
            text = self._figure.text(
                (left + length + 8) / PAGE_WIDTH, row, f"{name}, {kind.legend / 1e3:g} kN", va="center"
            )
            left += length + 8 + text.get_window_extent().width + 34
        self._figure.text(1 - PAGE_MARGIN / PAGE_WIDTH, row, self.stage.caption, ha="right", va="center")

    def _draw_curves(self) -> Axes:
        """Draw the plotted forces (kN) over time: lines for the first engine, dots for the others; returns the axes."""
        axes = self._figure.add_axes((70 / PAGE_WIDTH, 62 / PAGE_HEIGHT, 1 - 82 / PAGE_WIDTH, 128 / PAGE_HEIGHT))
        first, curve = self.motions[0], self.stage.force_curve
        names = [arrow.name.rpartition(", ")[2] for arrow in first.arrows if arrow.kind == curve.kind]
        film_times, stride = first.times, max(1, len(first.times) // 60)
        for name, values, tone in zip(names, self._forces[0], cycle(CURVE_COLOURS)):
            axes.plot(film_times, values, color=tone, label=name)
        for forces in self._forces[1:]:
            for values, tone in zip(forces, cycle(CURVE_COLOURS)):
                axes.plot(film_times[::stride], values[::stride], "o", ms=3, color=tone)
        axes.set_xlim(film_times[0], film_times[-1] if film_times[-1] > film_times[0] else film_times[0] + 1.0)
        axes.set_ylabel(f"{curve.kind} [kN]")
        marks = ": lines {}, dots {}" if len(self.motions) > 1 else ""
        labels = (LABELS[motion.engine] for motion in self.motions)
        axes.set_title(f"{curve.kind.capitalize()} {curve.direction_text}" + marks.format(*labels))
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=len(names))
        self._figure.text(1 - PAGE_MARGIN / PAGE_WIDTH, 12 / PAGE_HEIGHT, difference_sentence(self.motions), ha="right")
        self._figure.text(70 / PAGE_WIDTH, 12 / PAGE_HEIGHT, "time [s]")
        return axes


CURVE_COLOURS = (DARK, PINK, ORANGE, SKY, GREY)
"""Colours of the force curves, which differ from the engines' colours."""


def difference_sentence(filmed_motions: list[FilmedMotion]) -> str:
    """Sentence on the largest differences between two engines over the film; with a single engine, its name."""
    if len(filmed_motions) == 1:
        return f"poses as {LABELS[filmed_motions[0].engine]} reports them"
    position_gap, turns, forces = largest_motion_differences(*filmed_motions)
    return (
        "poses as each engine reports them; largest difference over the film: "
        f"places {position_gap:.1e} m, rotations {turns:.1e} rad, forces {forces:.1e} N"
    )


def eight_bit_image(image: np.ndarray) -> np.ndarray:
    """Image with colours from 0 to 1, converted to bytes from 0 to 255."""
    return (255.0 * image.clip(0.0, 1.0) + 0.5).astype(np.uint8)
