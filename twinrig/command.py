"""Console command ``twinrig``: the command of ``studies``, after the check that no user file hides twinrig's
packages."""

from studies.command_line import main

__all__ = ["main"]
