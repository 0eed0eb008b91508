"""Scenes of pictures: the drawn vehicle, the duration of its run, and the speed and format of the film."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.scene_file import SceneFile, checked
from models.core.strict import Strict

FRAME_LIMIT = 3000
"""Largest number of frames: two minutes of film; drawing a frame takes a fifth of a second."""
LONGEST_RUN_DURATION = 120.0
"""Longest run (s): all its steps are computed, however few frames show it."""


class FilmTable(Strict):
    """[film]: how long a run is shown, and how."""

    duration: float = Field(gt=0, le=LONGEST_RUN_DURATION, description="s of the run that are shown")
    slow_motion: float = Field(default=1.0, gt=0, le=1000, description="seconds of film per second of the run")
    frames_per_second: int = Field(default=25, ge=1, le=60, description="of the film")
    format: Literal["mp4", "gif", "png"] = Field(default="mp4", description="png: stills only")

    def frame_times(self) -> np.ndarray:
        """Times (s) of the frames within the run, the first one at 0."""
        return np.arange(self.frame_count) / (self.slow_motion * self.frames_per_second)

    @property
    def frame_count(self) -> int:
        """Number of frames of the film."""
        return max(1, round(self.duration * self.slow_motion * self.frames_per_second))


class PictureScene(SceneFile):
    """Scene of pictures: a vehicle and a film of it."""

    system: Literal["pictures"] = "pictures"
    study: str = Field(default="animation", description="the study that runs the scene")
    vehicle: Literal["wheelset", "pitch_plane", "r19_free"] = Field(description="what is drawn")
    film: FilmTable


def build(scene_table: Mapping[str, Any], scene_file: str = "", scene_folder: Path = Path()) -> PictureScene:
    """Checked scene of pictures from nested tables; raises InputError for anything that is not understood."""
    scene = checked(PictureScene, scene_table, scene_file, scene_folder)
    if scene.film.frame_count > FRAME_LIMIT:
        allowed = (
            f"makes {scene.film.frame_count} frames (duration x slow motion x frames per second) where at most "
            f"{FRAME_LIMIT} are drawn: show less of the run"
        )
        raise InputError(scene_file, "film.duration", scene.film.duration, allowed)
    return scene
