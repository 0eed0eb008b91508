"""A job for workers that are killed, in a file that imports little: every fresh worker imports it, too."""

import os
import time
from pathlib import Path

import numpy as np


class Mortal:
    """A job of the roots of path numbers; its processes note themselves in a folder, for whoever kills them."""

    def __init__(self, folder: Path):
        self.folder = folder

    def __call__(self, paths):
        (self.folder / str(os.getpid())).touch()
        time.sleep(0.02)
        return {"x": np.sqrt(np.arange(paths[0], paths[-1] + 1))}

    def facts(self):
        return {}
