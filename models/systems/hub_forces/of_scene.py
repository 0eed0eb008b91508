"""From a scene of hub forces to what transducers say."""

from models.engines.cut_vehicle import HubRun
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.halved import check_halved
from models.systems.hub_forces.measurement import Angles, HubForces, recorded, truth, two_tracks
from models.systems.hub_forces.scene import HubScene
from models.vehicles.cut_vehicle import CutVehicle


def measured(scene: HubScene, vehicle: CutVehicle, engine: str) -> tuple[HubRun | None, HubForces, Angles]:
    """What transducers say: of the files, or of a run on the road, with its noise; RunFailed for too long a step."""
    if scene.road is None:
        return None, *scene.measured(vehicle)
    own, road, steps = scene.run, scene.road, round(scene.run.duration / scene.run.step)
    left, right = (iso8608_road(road.iso8608, road.seed + i) for i in range(2))

    def on_road(step: float, steps: int) -> HubRun:
        drive = two_tracks(vehicle, left, right, road.speed, step, steps)
        return truth(engine, vehicle, drive, scene.forces.frame, step, step * steps)

    true = on_road(own.step, steps)
    check_halved(engine, true, [element.name for element in vehicle.elements], on_road)
    forces, angles = recorded(true, scene.forces.frame, round(1.0 / (scene.forces.sampling_rate * own.step)))
    if scene.forces.noise == "white":
        forces = forces.noisy(scene.deviations(vehicle), scene.seed)
    if scene.angles.noise == "white":
        angles = angles.noisy(scene.angles.deviations, scene.seed)
    return true, forces, angles
