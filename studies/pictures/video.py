"""Films as files: MP4 or GIF, with twinrig's extra ``video``; and stills as PNG, without it."""

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imsave

from models.core.whole_files import whole_file

VIDEO_PACKAGES = ("imageio", "imageio_ffmpeg")


def missing_extra(format_name: str) -> str:
    """Sentence on the extra to install if a film format needs missing packages; else ""."""
    if format_name == "png" or all(find_spec(name) for name in VIDEO_PACKAGES):
        return ""
    return (
        f"no {format_name} is written without the extra 'video': pip install 'twinrig[video]'; the stills need nothing"
    )


def write(film_path: Path, frame_images: Iterable[np.ndarray], frames_per_second: int) -> Path:
    """Write frames (h, w, 3) with 8 bits per colour to a film file, .mp4 or .gif; returns its path.
    frames_per_second : frames per second of film."""
    import imageio.v2 as imageio

    gif: dict[str, Any] = {"duration": 1000.0 / frames_per_second, "loop": 0}
    mp4: dict[str, Any] = {"fps": frames_per_second, "codec": "libx264", "quality": 7}
    writer: Any
    with (
        whole_file(film_path) as partial_path,
        imageio.get_writer(partial_path, **(gif if film_path.suffix == ".gif" else mp4)) as writer,
    ):
        for frame in frame_images:
            writer.append_data(frame)
    return film_path


def write_png(picture_path: Path, image: np.ndarray) -> Path:
    """Write an image (h, w, 3) to a PNG file, with equal bytes for equal images; returns its path."""
    metadata: Any = {"Software": None}
    with whole_file(picture_path) as partial_path:
        imsave(partial_path, np.ascontiguousarray(image), metadata=metadata)
    return picture_path
