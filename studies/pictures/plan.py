"""Description of a scene of pictures for ``twinrig show``, and its check before a run."""

from studies.pictures.scene import PictureScene
from studies.pictures.video import missing_extra


def check(scene: PictureScene, engines: tuple[str, ...]) -> None:
    """Accept every scene of pictures: its tables were checked when it was read."""


def describe(scene: PictureScene) -> str:
    """Text for ``twinrig show``: vehicle, film and format of a scene of pictures."""
    film = scene.film
    long = film.frame_count / film.frames_per_second
    shown = f"{film.duration:g} s of the run in {film.frame_count} frames, {long:g} s of film"
    lines = [
        scene.title,
        f"  scene      {scene.file}, study {scene.study}",
        f"  vehicle    {scene.vehicle}",
        f"  film       {shown}, {film.format}",
    ]
    missing_format = missing_extra(film.format)
    return "\n".join([*lines, f"  note       {missing_format}"] if missing_format else lines)
