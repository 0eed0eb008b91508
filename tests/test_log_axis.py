"""Labels of logarithmic axes: plain text, powers where there are many decades, numbers that fit where there are few."""

from models.drawing.figures import subplots


def labels(low: float, high: float) -> list[str]:
    _, axis = subplots()
    axis.set(xscale="log", xlim=(low, high))
    found = [label.get_text() for which in ("major", "minor") for label in axis.get_xticklabels(which=which)]
    return [text for text in found if text]


def test_many_decades_are_powers_without_marks_between():
    found = labels(1e-4, 1e1)
    assert "10⁻³" in found and "10⁰" in found
    assert all(text.startswith("10") and "$" not in text for text in found)


def test_few_decades_are_numbers():
    assert {"2", "3", "4", "6"} <= {*labels(1.5, 9.0)}
    assert {"2 × 10⁻⁷"} <= {*labels(1e-7, 4e-7)}
