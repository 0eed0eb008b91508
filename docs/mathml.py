"""Conversion of the site's formulas to MathML, which browsers draw without a script or network access.

A hook of MkDocs, which calls ``on_page_content`` for every page; the extension arithmatex has marked the formulas.
"""

import re
from html import unescape
from typing import Any

MARKED_FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<formula>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
"""Pattern of a LaTeX formula in a page: within a line (span) or as a line of its own (div)."""


def on_page_content(html: str, page: Any = None, **unused: Any) -> str:
    """HTML of a page with all marked formulas converted to MathML; raises ValueError for a formula that cannot be
    read."""
    from latex2mathml.converter import convert

    def drawn(formula_match: re.Match[str]) -> str:
        formula = unescape(formula_match["formula"]).strip()
        try:
            math = convert(formula, display="inline" if formula_match["tag"] == "span" else "block")
        except Exception as error:  # the library has one for each kind of mistake
            raise ValueError(f"{page}: the formula {formula!r} cannot be read: {error!r}") from error
        if "\\" in math:
            raise ValueError(f"{page}: the formula {formula!r} has a command that is not known")
        return math

    return MARKED_FORMULA.sub(drawn, html)
