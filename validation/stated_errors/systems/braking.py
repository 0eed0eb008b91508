"""Stated errors of random braking stops; the true solution has a hundred times as many steps per sample, by the
reference, or by MuJoCo for a vehicle on its suspension."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import numpy as np

from models.core.discretisation import error_estimates_of
from models.core.errors import RunFailed
from models.systems.braking import ENGINES
from models.systems.braking.errors import motion_and_distance
from models.systems.braking.march import BrakedVehicle, BrakingPath
from models.systems.braking.run import run
from models.systems.braking.scene import BrakingScene, build
from validation.stated_errors.sample import Sample, random_samples

FINER_STEPS = 100
"""Ratio of the number of steps of the true solution to that of the run."""
SURFACES = {"ice": 0.15, "snow": 0.25, "wet": 0.6, "dry": 0.7}
"""Surfaces of random stops, with a coefficient of friction for the choice of the circle's radius."""
CONTROLLERS = ("none", "slip_bang_bang", "acceleration_phases", "slip_pi")
AXLE_DATA = {"track": 1.9, "radius": 0.5, "spin_inertia": 13.35, "roll_share": 0.5}
TRAILER_DATA = {
    "mass": 7000.0,
    "yaw_inertia": 20000.0,
    "height": 1.2,
    "drawbar": 2.5,
    "drawbar_mass": 600.0,
    "drawbar_inertia": 600.0,
    "front": {"x": 2.2, **AXLE_DATA},
    "rear": {"x": -2.2, **AXLE_DATA},
}


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random braking stops; runs that fail are replaced, results without a stated
    error are not."""
    return random_samples(sample_count, seed, _sample_of_random_stop)


def _sample_of_random_stop(generator: np.random.Generator) -> Sample:
    """Sample from a random braking stop; raises if the tyres cannot hold the circle or the vehicle rolls over."""
    engine, scene = str(generator.choice(ENGINES)), build(_random_scene_table(generator), "drawn.toml")
    return _sample_of_stop(scene, engine)


def _random_scene_table(generator: np.random.Generator) -> dict[str, Any]:
    """Table of a random braking scene with one procedure."""
    surface, kind, steps = (
        str(generator.choice(list(SURFACES))),
        str(generator.choice(CONTROLLERS)),
        int(generator.choice(8)) + 1,
    )
    supply = generator.uniform(0.9, 2.5) if kind == "none" else generator.uniform(3.0, 9.0)
    table: dict[str, Any] = {
        "title": f"drawn: {kind} on {surface}, {steps} steps",
        "system": "braking",
        "road": {"stretches": [{"left": surface}]},
        "tyres": {"scale": {"dry": generator.uniform(0.6, 1.0)}},
        "brakes": {
            "supply": supply,
            "front": {"gradient": generator.uniform(800.0, 2000.0), "push_out": generator.uniform(0.0, 0.8)},
            "rear": {"gradient": generator.uniform(600.0, 1500.0), "push_out": 0.25},
        },
        "controller": {"kind": kind},
        "procedures": {"stop": _random_procedure(generator, surface)},
        "run": {"sample": float(generator.choice([0.004, 0.0055, 0.01])), "substeps": steps},
    }
    if generator.random() < 0.2:
        return table | {"vehicle": {"file": "r19_free", "spin_inertia": 1.0}, "brakes": _random_brakes(generator)}
    table["vehicle"] = {
        "override": {"mass": generator.uniform(4500.0, 9000.0), "yaw_inertia": generator.uniform(2e4, 4e4)}
    }
    effects = {
        "load_transfer": {},
        "pressure": {"fill": generator.uniform(0.05, 0.25), "empty": generator.uniform(0.05, 0.2)},
        "trailer": TRAILER_DATA,
        "relaxation": {"front": generator.uniform(0.2, 0.6), "rear": generator.uniform(0.2, 0.6)},
    }
    shares = (0.7, 0.8, 0.25, 0.2)
    return table | {
        name: effect_table
        for (name, effect_table), share in zip(effects.items(), shares, strict=True)
        if generator.random() < share
    }


def _random_brakes(generator: np.random.Generator) -> dict[str, Any]:
    """Table of random brakes for a vehicle on its suspension."""
    gradient = generator.uniform(200.0, 600.0)
    return {
        "supply": generator.uniform(1.0, 4.0),
        "front": {"gradient": gradient},
        "rear": {"gradient": 0.5 * gradient},
    }


def _random_procedure(generator: np.random.Generator, surface_name: str) -> dict[str, Any]:
    kind, speed = str(generator.choice(["straight", "split", "turn", "j_turn"])), generator.uniform(5.0, 20.0)
    radius = generator.choice([-1.0, 1.0]) * max(
        speed**2 / (SURFACES[surface_name] * 9.81 * generator.uniform(0.2, 0.6)), 25.0
    )
    other_surface = str(generator.choice([name for name in SURFACES if name != surface_name]))
    of_kind = {
        "split": {"right": other_surface},
        "turn": {"radius": radius},
        "j_turn": {"steer": generator.uniform(-0.06, 0.06)},
    }
    return {"kind": kind, "speed": speed, **of_kind.get(kind, {})}


def _sample_of_stop(scene: BrakingScene, engine: str) -> Sample:
    """Sample from a run of a braking scene with its stated error; the true error is computed by a finer run."""
    with counting_steps() as calls:
        try:
            stated_run = run(scene, engine, error=True)
        except RunFailed as error:
            if error.partial is None or not error_estimates_of(error.partial):
                raise
            stated_run = error.partial
    errors, true = error_estimates_of(stated_run), dict[str, float]()
    if errors:
        finer_settings = scene.run.model_copy(update={"substeps": FINER_STEPS * scene.run.substeps})
        truth = run(
            scene.model_copy(update={"run": finer_settings}), "mujoco" if scene.vehicle.file else "reference"
        ).detail
        fine, exact = (
            motion_and_distance(stated_run.detail, stated_run.times),
            motion_and_distance(truth, stated_run.times),
        )
        true = {name: float(np.sqrt(np.mean((fine[name] - exact[name]) ** 2))) for name in errors}
    return Sample(scene.title, engine, errors, true, calls[0], sum(calls[1:]))


@contextmanager
def counting_steps() -> Iterator[list[float]]:
    """Context that yields a list, to which every braking run within it adds its number of steps."""
    calls, march = list[float](), BrakedVehicle.run

    def counting(vehicle: BrakedVehicle, *march_arguments: Any) -> BrakingPath:
        path = march(vehicle, *march_arguments)
        calls.append(float(vehicle.substeps * (len(path.times) - 1)))
        return path

    with mock.patch.object(BrakedVehicle, "run", counting):
        yield calls
