"""Control of the MuJoCo state that is global to a process: its callbacks and its warnings."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

from models.core.errors import RunFailed


@contextmanager
def without_warnings() -> Iterator[None]:
    """Context in which MuJoCo prints no warnings and writes no log into the user's folder; every run checks for
    warnings itself."""
    previous_handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(previous_handler)


@contextmanager
def installed_callback(compiled_callback: Any) -> Iterator[None]:
    """Context in which a compiled MuJoCo callback, or none, is installed: MuJoCo's callbacks are global to the process.

    Meanwhile MuJoCo is quiet: what it would warn of is raised by whoever runs it. RunFailed where another one is.
    """
    if mujoco.get_mjcb_control() is not None or mujoco.get_mjcb_passive() is not None:
        raise RunFailed("mujoco", "another callback is installed in this process: its forces would act here, too")
    with without_warnings():
        if compiled_callback is None:
            yield
            return
        mujoco.set_mjcb_passive(compiled_callback.ctypes)
        try:
            yield
        finally:
            mujoco.set_mjcb_passive(None)
