"""The page of a user's model file: a self-contained HTML file; its texts are in the template."""

import platform
import sys
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from models.core.whole_files import write_whole
from models.drawing.pages import environment_of
from models.own_model.elements import ModelProperty, elements_of_model, is_word, two_digit_text, value_text
from studies.command.twin import TwinResults, verdict_sentence

PAGE_TEMPLATE = "twin.html.jinja"


def write(twin_results: TwinResults, page_path: Path) -> Path:
    """Write the page on examined model files as a complete file; returns its path."""
    write_whole(page_path, page_text(twin_results))
    return page_path


def page_text(twin_results: TwinResults) -> str:
    """HTML text of the page on examined model files."""
    environment = environment_of(Path(__file__).parent)
    environment.filters |= {"short": two_digit_text, "g": lambda number: f"{number:.6g}"}
    return environment.get_template(PAGE_TEMPLATE).render(
        twins=twin_results,
        title=" and ".join(twin_results.names),
        verdicts=[verdict_sentence(examined_file) for examined_file in twin_results.examined],
        tables=[
            _element_rows(list(elements_of_model(examined_file.file.twin.model).values()))
            for examined_file in twin_results.examined
        ],
        hashes=[
            sha256(examined_file.file.document.path.read_bytes()).hexdigest() for examined_file in twin_results.examined
        ],
        command=" ".join(sys.argv),
        versions={name: version(name) for name in ("twinrig", "mujoco", "exudyn", "numpy")},
        python=platform.python_version(),
    )


def _element_rows(model_elements: list[ModelProperty]) -> list[dict[str, Any]]:
    """Kind, owner, unit and value text of each nonzero element of a model file, for the page's table."""
    return [
        {"kind": element.kind, "owner": element.owner, "unit": element.unit, "value": value_text(element.value)}
        for element in model_elements
        if element.is_nonzero and not (is_word(element.value) and element.value[0] == "on")
    ]
