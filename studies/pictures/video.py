"""Frames to a file: MP4 or GIF by the extra ``video``; stills always."""

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imsave

from models.core.whole_files import whole_file

VIDEO_PACKAGES = ("imageio", "imageio_ffmpeg")


def missing_extra(format_name: str) -> str:
    """Sentence that names the extra to install if a film format needs one that is missing; else empty."""
    if format_name == "png" or all(find_spec(name) for name in VIDEO_PACKAGES):
        return ""
    return (
        f"no {format_name} is written without the extra 'video': pip install 'twinrig[video]'; the stills need nothing"
    )


def write(path: Path, frames: Iterable[np.ndarray], per_second: int) -> Path:
    """Write frames (h, w, 3) of 8 bits a colour to ``path``, .mp4 or .gif, one at a time."""
    import imageio.v2 as imageio

    gif: dict[str, Any] = {"duration": 1000.0 / per_second, "loop": 0}
    mp4: dict[str, Any] = {"fps": per_second, "codec": "libx264", "quality": 7}
    writer: Any
    with (
        whole_file(path) as partial_path,
        imageio.get_writer(partial_path, **(gif if path.suffix == ".gif" else mp4)) as writer,
    ):
        for frame in frames:
            writer.append_data(frame)
    return path


def write_png(path: Path, image: np.ndarray) -> Path:
    """Write one image (h, w, 3) to a PNG file, the same bytes from the same image."""
    metadata: Any = {"Software": None}
    with whole_file(path) as partial_path:
        imsave(partial_path, np.ascontiguousarray(image), metadata=metadata)
    return path
