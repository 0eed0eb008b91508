"""What several test files share: an empty folder to work in, and the command."""

import sys

import pytest


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """A new folder, which is the current one during the test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def twinrig(empty_folder):
    """Function that runs ``twinrig ARGS`` within this process, in an empty folder, and returns its exit code."""
    from studies import command_line

    def run(*args):
        with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
            patch.setattr(sys, "argv", ["twinrig", *args])
            command_line.main()
        return ended.value.code

    return run
