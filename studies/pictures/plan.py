"""The plan of a scene of pictures: printed by ``twinrig show``, checked before any run."""

from studies.pictures.scene import PictureScene
from studies.pictures.video import missing_extra


def check(scene: PictureScene, engines: tuple[str, ...]) -> None:
    """Refuse nothing: the scene's tables say it all."""


def describe(scene: PictureScene) -> str:
    """The scene's plan as text."""
    film = scene.film
    long = film.frames / film.frames_per_second
    shown = f"{film.duration:g} s of the run in {film.frames} frames, {long:g} s of film"
    lines = [
        scene.title,
        f"  scene      {scene.file}, study {scene.study}",
        f"  vehicle    {scene.vehicle}",
        f"  film       {shown}, {film.format}",
    ]
    missing_format = missing_extra(film.format)
    return "\n".join([*lines, f"  note       {missing_format}"] if missing_format else lines)
