"""Export of a vehicle's native elements as a file of the engine: MJCF for MuJoCo, a Python script for Exudyn.

What is written is what the builders of the models make, not a second description: bodies, joints, weights, and the
springs and dampers that are elements of the engine. Every other force acts in twinrig by compiled functions and stays
behind; the file and the terminal name each of them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from models.engines.free_vehicle import LoadedVehicle
from models.vehicles.spatial import SpatialVehicle

if TYPE_CHECKING:
    import mujoco

SUFFIXES = {"mujoco": ".xml", "exudyn": ".py"}
"""Suffixes of exported files, by engine."""
LIGHTEST_SHOWN_BODY = 1e-6
"""Mass (kg) below which a body is not shown: such bodies only carry joints or spin."""


@dataclass(frozen=True)
class ExportedModel:
    """An exported model. text : of the file; has : texts with counts of what the file holds; left_out : texts on what
    the file does not hold."""

    text: str
    has: tuple[str, ...]
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class ExportSubject:
    """The system that an exported file describes. title : of the scene; source : the scene's file; axes : a sentence on
    directions and origin."""

    title: str
    source: str
    axes: str

    def comment(self, content_texts: Sequence[str], omissions: Sequence[str]) -> str:
        """Comment lines for the head of an exported file."""
        from importlib.metadata import version

        lines = [
            f"{self.title}",
            f"From the scene {self.source} by twinrig {version('twinrig')}. SI units. {self.axes}",
            f"Has {', '.join(content_texts)}.",
            *(["Leaves out:"] if omissions else ["Leaves nothing out."]),
            *(f"  {text}" for text in omissions),
        ]
        return "\n".join(lines)


def exported_mujoco_model(
    mujoco_spec: "mujoco.MjSpec",
    mujoco_model: "mujoco.MjModel",
    names_in_file: Mapping[str, str],
    export_subject: ExportSubject,
    omissions: Sequence[str],
) -> ExportedModel:
    """Exported MuJoCo model that was compiled from a specification; names_in_file : see ``mujoco_export.mjcf``."""
    from models.engines.mujoco_export import item_counts, mjcf

    has, missing = tuple(item_counts(mujoco_model)), tuple(omissions)
    return ExportedModel(
        mjcf(mujoco_spec, mujoco_model, names_in_file, export_subject.title, export_subject.comment(has, missing)),
        has,
        missing,
    )


def exported_exudyn_system(
    mbs: Any, coordinate_indices: dict[str, int], export_subject: ExportSubject, omissions: Sequence[str]
) -> ExportedModel:
    """Exported assembled Exudyn system; coordinate_indices : indices of the coordinates in Exudyn's vectors, by
    name."""
    from models.engines.exudyn_export import item_counts, python_script

    has, missing = tuple(item_counts(mbs)), tuple(omissions)
    return ExportedModel(python_script(mbs, coordinate_indices, export_subject.comment(has, missing)), has, missing)


def export_free_vehicle(
    engine: str, loaded_vehicle: LoadedVehicle, export_subject: ExportSubject, omissions: Sequence[str]
) -> ExportedModel:
    """Exported free vehicle in "exudyn" or "mujoco", without the forces of the compiled kernel."""
    if engine == "exudyn":
        from models.engines.free_vehicle_exudyn import FreeExudyn

        coordinates = {name: i for i, name in enumerate(coordinate_names(loaded_vehicle.vehicle))}
        return exported_exudyn_system(FreeExudyn(loaded_vehicle).mbs, coordinates, export_subject, omissions)
    from models.engines.free_vehicle_mujoco import compiled_from, specification_of
    from models.engines.mujoco_export import add_shapes
    from models.engines.mujoco_inertia import with_realisable_inertia

    vehicle, lowered = with_realisable_inertia(loaded_vehicle.vehicle)
    loaded_vehicle = replace(loaded_vehicle, vehicle=vehicle)
    spec = specification_of(loaded_vehicle)
    add_shapes(spec, masses_of_shown_bodies(vehicle, {body.name for body in spec.bodies}))
    return exported_mujoco_model(
        spec, compiled_from(spec, loaded_vehicle), exported_names(vehicle), export_subject, [*omissions, *lowered]
    )


def exported_names(vehicle: SpatialVehicle) -> dict[str, str]:
    """Names of bodies and joints in the exported file, by their names in a specification of ``mujoco_tree``."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    bodies = {number: name if name != "world" else "world of the vehicle" for name, number in numbers.items()}
    return bodies | {f"{numbers[name]} {freedom}": f"{name} {freedom}" for name, freedom in vehicle.coordinates()}


def masses_of_shown_bodies(vehicle: SpatialVehicle, shown_bodies: Iterable[str]) -> dict[str, float]:
    """Masses (kg) of the bodies that are shown, by their names in a specification of ``mujoco_tree``."""
    return {
        str(i): body.mass
        for i, body in enumerate(vehicle.bodies)
        if str(i) in set(shown_bodies) and body.mass > LIGHTEST_SHOWN_BODY
    }


def coordinate_names(vehicle: SpatialVehicle) -> list[str]:
    """Names of the coordinates in the order of the state."""
    return [f"{body} {freedom}" for body, freedom in vehicle.coordinates()]


def elements_left_out(vehicle: SpatialVehicle, native_names: Iterable[str] = ()) -> list[str]:
    """Texts that name the springs, bars and tyres of a vehicle, except those named in ``native_names``."""
    kept = set(native_names)
    return [
        *(f"spring {spring.name!r}" for spring in vehicle.springs if spring.name not in kept),
        *(f"anti-roll bar {bar.name!r}" for bar in vehicle.bars if bar.name not in kept),
        *(f"tyre {tyre.name!r}" for tyre in vehicle.tyres if tyre.name not in kept),
    ]
