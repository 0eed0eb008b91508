"""Every rule of figures notices the fault that it is there for, and a figure of the usual kind keeps to all of them."""

from pathlib import Path

import numpy as np
import pytest
from figure_rules import faults
from matplotlib.figure import Figure

from models.drawing.figures import (
    COLUMN_WIDTH,
    CURVE_COLOURS,
    SMALL_TEXT,
    add_heading,
    legend_below,
    panels,
    save,
    scale_about_one,
    subplots,
    wrapped_text,
)


@pytest.fixture
def usual():
    """A figure with two panels of curves, a title, a legend below."""
    figure, axes = panels(2, 2, 3.0)
    times = np.linspace(0.0, 1.0, 50)
    for axis in axes:
        axis.plot(times, np.sin(9.0 * times), label="sine")
        axis.set(xlabel="time [s]", ylabel="displacement [mm]", title="A panel")
    legend_below(figure, *axes)
    add_heading(figure, "A figure as all of them are")
    yield figure, axes


def test_usual_figure_has_no_fault(usual):
    assert faults(usual[0]) == []


def small_letters(figure, axes):
    axes[0].set_title("A panel", fontsize=6.9)


def large_letters_of_a_wide_figure(figure, axes):
    figure.set_size_inches(1.5 * COLUMN_WIDTH, 5.0)


def no_curve(figure, axes):
    axes[1].lines[0].remove()


def curve_of_nothing(figure, axes):
    axes[1].lines[0].set_ydata(np.full(50, np.nan))


def curve_of_zeros(figure, axes):
    axes[1].lines[0].set_ydata(np.zeros(50))


def hidden_panel(figure, axes):
    axes[1].set_visible(False)


def no_label(figure, axes):
    axes[1].set_xlabel("")


def no_unit(figure, axes):
    axes[1].set_ylabel("displacement")


def legend_over_title(figure, axes):
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 0.98))


def words_over_words(figure, axes):
    for _ in range(2):
        axes[0].text(0.5, 0.5, "one thing")


def title_beyond_the_edge(figure, axes):
    figure.suptitle("A title that is longer than its figure is wide, " * 4, x=0.01, ha="left")


PLANTED = {
    small_letters: "6.9 points",
    large_letters_of_a_wide_figure: "points",
    no_curve: "empty panel",
    curve_of_nothing: "empty panel",
    curve_of_zeros: "empty panel",
    hidden_panel: "empty panel",
    no_label: "no unit on the x axis",
    no_unit: "no unit on the y axis",
    legend_over_title: "'a legend' and 'A panel' lie on one another",
    words_over_words: "'one thing' and 'one thing' lie on one another",
    title_beyond_the_edge: "leaves the figure",
}


@pytest.mark.parametrize("plant", PLANTED, ids=lambda plant: plant.__name__)
def test_planted_fault_is_told(usual, plant):
    figure, axes = usual
    plant(figure, axes)
    assert any(PLANTED[plant] in fault or PLANTED[plant] in _turned(fault) for fault in faults(figure))


def _turned(fault: str) -> str:
    """The same of what lies on one another, the other way round."""
    one, _, rest = fault.removesuffix(" lie on one another").partition(" and ")
    return f"{rest} and {one} lie on one another"


def test_figures_that_tests_save_are_held_to_the_rules(usual, tmp_path):
    figure, axes = usual
    small_letters(figure, axes)
    for file in ("small.png", "small.svg"):
        with pytest.raises(AssertionError, match=r"6\.9 points"):
            save(figure, tmp_path / file)
        assert not (tmp_path / file).exists()


def test_pages_of_drawings_use_the_palette():
    """Colours are written down in one place; what is drawn in space, and roads, have some more."""
    apart = {"pictures", "braking_figures.py"}
    root = Path(__file__).parents[1]
    files = [file for place in ("studies", "validation", "models/drawing") for file in (root / place).rglob("*.py")]
    others = [file for file in files if not apart & set(file.parts) and file.name != "figures.py"]
    written = {file.name: colour for file in others for colour in CURVE_COLOURS if colour in file.read_text()}
    assert len(others) > 30 and written == {}


def test_ratios_near_one_and_far_away_are_both_told():
    _, axis = subplots()
    scale_about_one(axis, "y", [1e-3, 0.9, 1.0, 1.1, 1e3])
    low, near, one, high, far = axis.transData.transform([(0, value) for value in (1e-3, 0.9, 1.0, 1.1, 1e3)])[:, 1]
    assert high - one > 0.1 * (far - low) and one - near > 0.1 * (far - low)


def test_places_without_a_panel_are_taken_away():
    figure, axes = panels(3, 2, 2.0, sharex=True)
    assert len(axes) == 3 == len(figure.axes) and figure.get_figwidth() == COLUMN_WIDTH


def test_lines_are_broken_where_a_figure_ends():
    figure = Figure(figsize=(4.0, 1.0))
    text = figure.text(
        0.0, 0.5, wrapped_text("every one of these words is short " * 6, 4.0, SMALL_TEXT), fontsize=SMALL_TEXT
    )
    figure.draw_without_rendering()
    assert "\n" in text.get_text() and text.get_window_extent().width < figure.bbox.width
