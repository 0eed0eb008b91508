"""Lists that ``twinrig list`` prints: shipped scenes, effects, parameter sets, engines with their integrators."""

from importlib import import_module

from models.core.scene_effects import effect_sentences
from models.core.scene_file import parse_toml
from models.core.systems import DEFAULT_SYSTEM, SYSTEMS
from models.engines.catalogue import CATALOGUE
from models.systems.pitch_plane.scene import parameter_sets
from studies.command.asked import SCENES_FOLDER


def print_lists() -> None:
    """Print the lists of scenes, effects, parameter sets and engines, each with its title."""
    scenes = {path.stem: parse_toml(path)["title"] for path in sorted(SCENES_FOLDER.glob("*.toml"))}
    sets = {name: import_module(f"models.vehicles.parameters.{name}").SOURCE for name in parameter_sets()}
    _print_titled_list("scenes (twinrig run NAME, or a file of your own)", scenes)
    for system in SYSTEMS:
        named = "[effects.NAME] in a scene" if system == DEFAULT_SYSTEM else "by the tables of its scenes"
        _print_titled_list(
            f"effects of {system} ({named}; one that is not named is not computed)", effect_sentences(system)
        )
    _print_titled_list("parameter sets (vehicle.parameters = NAME, or a TOML file of your own)", sets)
    _print_titled_list(
        "engines and their integrators (--engine NAME; [engines.NAME] integrator = ...)",
        {name: ", ".join(integrators) for name, integrators in CATALOGUE.items()},
    )


def _print_titled_list(title: str, descriptions: dict[str, str]) -> None:
    if not descriptions:
        return
    width = max(map(len, descriptions))
    print(title)
    for name, text in descriptions.items():
        print(f"  {name:<{width}} {text}")
