"""MuJoCo without its own words: what it warns of is told by the guard of every run."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco


@contextmanager
def quiet() -> Iterator[None]:
    """Keep MuJoCo from printing warnings and writing a log into the user's folder: the guard reports them."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
