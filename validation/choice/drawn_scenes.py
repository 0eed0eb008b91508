"""Random scenes for the choice of effects in time simulation, each with quantities and a tolerance."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from models.core.systems import SYSTEMS

TOLERANCES = (0.02, 0.005, 0.05)
"""Tolerances of the random scenes, used in turn."""


@dataclass(frozen=True)
class ChoiceQuestion:
    """A random scene, as a table, with the quantities and the tolerance for which effects are to be chosen."""

    scene_table: dict[str, Any]
    quantities: tuple[str, ...]
    tolerance: float

    def scene(self) -> Any:
        """Scene built from the table."""
        return import_module(SYSTEMS[self.scene_table.get("system", "pitch-plane")].scene).build(
            self.scene_table, "drawn"
        )


def draw_scene(system_name: str, seed: int) -> ChoiceQuestion:
    """Random scene of a system with quantities and tolerance, for a seed."""
    draw = np.random.default_rng([SEED, seed])
    table, quantities = DRAWN_SYSTEMS[system_name](draw)
    return ChoiceQuestion(
        {"title": f"drawn {seed}", "system": system_name, **table}, quantities, TOLERANCES[seed % len(TOLERANCES)]
    )


SEED = 2210


def _random_half_car(generator: np.random.Generator) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Scene table and quantities of a random half car on a road. It may have a pitch spring of random stiffness and a
    gyro; half of the scenes start with a pitch."""
    road = [
        {"source": "study", "speed": float(generator.uniform(8.0, 30.0))},
        {
            "source": "iso8608",
            "road_class": str(generator.choice(list("ABCD"))),
            "speed": float(generator.uniform(8.0, 30.0)),
            "seed": int(generator.integers(1000)),
        },
    ][int(generator.integers(2))]
    effects: dict[str, Any] = {"road": road}
    if generator.random() < 0.7:
        stiffness = float(10.0 ** generator.uniform(0.5, 4.5))
        effects["pitch_spring"] = {"stiffness": stiffness, "damping": stiffness * float(generator.uniform(0.0, 0.05))}
    if generator.random() < 0.5:
        effects["gyro"] = {"deviation": 1e-3, "sampling_rate": 100.0}
    start = {"pitch": float(generator.uniform(-0.1, 0.1))} if generator.random() < 0.5 else {}
    step = float(generator.choice([1e-4, 2.5e-4, 5e-4]))
    drawn_quantities = generator.choice(
        ["f1", "f2", "f3", "z3", "pitch", "rms f1", "max f2", "rms pitch_rate"], 2, replace=False
    )
    return {"run": {"duration": 2.0, "step": step}, "start": start, "effects": effects}, tuple(
        map(str, drawn_quantities)
    )


def _random_wheelset(generator: np.random.Generator) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Scene table and quantities of a random wheelset at a speed below or above its critical speed, with a displacement
    from small up to flange contact."""
    factors = {name: float(np.exp(generator.uniform(-0.7, 0.7))) for name in ("stiffness_x", "damping_x", "damping_y")}
    usual = {"stiffness_x": 2e5, "damping_x": 1e3, "damping_y": 1e3}
    displacement = float(10.0 ** generator.uniform(-4.0, -2.2))
    drawn_quantities = generator.choice(["y", "yaw", "rms y", "max fy", "rms power", "rms fx"], 2, replace=False)
    return {
        "wheelset": {"override": {name: usual[name] * factor for name, factor in factors.items()}},
        "contact": {"law": "fastsim"},
        "speeds": {"values": [10.0]},
        "run": {
            "duration": 0.24,
            "step": float(generator.choice([1e-4, 2e-4])),
            "displacement": displacement,
            "speeds": [float(generator.uniform(5.0, 60.0))],
        },
    }, tuple(map(str, drawn_quantities))


def _random_stop(generator: np.random.Generator) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Scene table and quantities of a random stop of a truck on one of four surfaces, with or without anti-lock
    control."""
    push_out = float(generator.uniform(0.05, 0.8))
    table: dict[str, Any] = {
        "road": {"stretches": [{"left": str(generator.choice(["dry", "wet", "snow", "ice"]))}]},
        "brakes": {
            "supply": float(generator.uniform(3.0, 7.0)),
            "front": {
                "gradient": float(generator.uniform(1000.0, 2000.0)),
                "push_out": push_out,
                "release": push_out * float(generator.uniform(0.5, 1.0)),
            },
            "rear": {
                "gradient": float(generator.uniform(800.0, 1600.0)),
                "push_out": float(generator.uniform(0.0, 0.3)),
            },
        },
        "controller": {"kind": str(generator.choice(["none", "slip_bang_bang", "slip_pi"]))},
        "procedures": {"straight": {"kind": "straight", "speed": float(generator.uniform(5.0, 9.0))}},
        "run": {"duration": 12.0, "substeps": 8},
    }
    if generator.random() < 0.7:
        table["load_transfer"] = {"front": float(generator.uniform(0.2, 0.4))}
    if generator.random() < 0.7:
        table["pressure"] = {"fill": float(generator.uniform(0.01, 0.2)), "empty": float(generator.uniform(0.01, 0.2))}
    drawn_quantities = generator.choice(["stopping distance [m]", "stopping time [s]", "MFDD [m/s^2]", "mean slip"], 1)
    return table, tuple(map(str, drawn_quantities))


DRAWN_SYSTEMS = {"pitch-plane": _random_half_car, "wheelset": _random_wheelset, "braking": _random_stop}
