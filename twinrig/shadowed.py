"""Check for user files that hide twinrig's packages of the same name."""

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("models", "studies", "validation")
"""Names of the packages beside ``twinrig``."""


def check() -> None:
    """Raise ImportError if Python would import another ``models``, ``studies`` or ``validation`` than twinrig's.

    The console command ends with the message alone.
    """
    try:
        _check()
    except ImportError as error:
        if Path(sys.argv[0]).stem != "twinrig":
            raise
        sys.exit(f"twinrig: {error}")


def _check() -> None:
    tree = Path(__file__).resolve().parents[1]
    for name in PACKAGES:
        spec = find_spec(name)
        package_path = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if package_path is None:
            raise ImportError(f"twinrig needs its package {name!r} in {tree}, which is not on Python's path")
        if package_path != tree / name / "__init__.py":
            hides = package_path.parent if package_path.name == "__init__.py" else package_path
            raise ImportError(
                f"{hides} hides twinrig's package {name!r}: rename it, or start Python in another folder", name=name
            )
