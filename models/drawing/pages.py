"""Templates of self-contained HTML pages: what every page of ours sets in the same way."""

from pathlib import Path
from typing import Any


def environment_of(folder: Path) -> Any:
    """Jinja's environment for the templates of a folder: text is escaped, and a name that is missing is an error."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
