"""Hard cases: inputs at which codes of this kind fail, each with an invariant or exact answer that judges every
implementation.

One file per family, each with ``CASES``, found by listing. A case is judged per implementation as **right** (its error
is within the tolerance), **refused** (before the run, with a reason), **raised** (the run failed and said so)
or **SILENT**: a finite wrong answer without a word, which is never accepted.
"""

from importlib import import_module
from pkgutil import iter_modules

from validation.hard_cases.case import HardCase

SHARED_MODULES = ("case", "catalogue", "setups")
CASE_FAMILIES = tuple(module.name for module in iter_modules(__path__) if module.name not in SHARED_MODULES)


def cases_by_family() -> tuple[tuple[str, HardCase], ...]:
    """All hard cases as pairs (family, case), in the order of the report's table."""
    return tuple(
        (family, case) for family in CASE_FAMILIES for case in import_module(f"validation.hard_cases.{family}").CASES
    )
