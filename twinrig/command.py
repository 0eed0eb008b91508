"""The console command: that of ``studies``, once ``twinrig`` has seen that nothing hides its packages."""

from studies.command_line import main

__all__ = ["main"]
