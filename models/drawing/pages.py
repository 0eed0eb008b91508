"""Jinja environment of the templates of self-contained HTML pages."""

from pathlib import Path
from typing import Any


def environment_of(template_folder: Path) -> Any:
    """Jinja environment for the templates in a folder: text is escaped, and undefined names are errors."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(template_folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
