"""Random scenes of systems that are run in time, each with a question: quantities, and a tolerance."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from models.core.systems import SYSTEMS

TOLERANCES = (0.02, 0.005, 0.05)
"""Drawn scenes take these in turn."""


@dataclass(frozen=True)
class Asked:
    """A scene's table, and its question."""

    table: dict[str, Any]
    quantities: tuple[str, ...]
    tolerance: float

    def scene(self) -> Any:
        """The scene, built."""
        return import_module(SYSTEMS[self.table.get("system", "pitch-plane")].scene).build(self.table, "drawn")


def draw_scene(system: str, seed: int) -> Asked:
    """The scene of a system and a seed."""
    draw = np.random.default_rng([SEED, seed])
    table, quantities = DRAWN[system](draw)
    return Asked({"title": f"drawn {seed}", "system": system, **table}, quantities, TOLERANCES[seed % len(TOLERANCES)])


SEED = 2210


def _pitch_plane(draw: np.random.Generator) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A half car on a road, with a pitch spring of any strength and a gyro; half of them start off their rest."""
    road = [
        {"source": "study", "speed": float(draw.uniform(8.0, 30.0))},
        {
            "source": "iso8608",
            "road_class": str(draw.choice(list("ABCD"))),
            "speed": float(draw.uniform(8.0, 30.0)),
            "seed": int(draw.integers(1000)),
        },
    ][int(draw.integers(2))]
    effects: dict[str, Any] = {"road": road}
    if draw.random() < 0.7:
        stiffness = float(10.0 ** draw.uniform(0.5, 4.5))
        effects["pitch_spring"] = {"stiffness": stiffness, "damping": stiffness * float(draw.uniform(0.0, 0.05))}
    if draw.random() < 0.5:
        effects["gyro"] = {"deviation": 1e-3, "sampling_rate": 100.0}
    start = {"pitch": float(draw.uniform(-0.1, 0.1))} if draw.random() < 0.5 else {}
    step = float(draw.choice([1e-4, 2.5e-4, 5e-4]))
    asked = draw.choice(["f1", "f2", "f3", "z3", "pitch", "rms f1", "max f2", "rms pitch_rate"], 2, replace=False)
    return {"run": {"duration": 2.0, "step": step}, "start": start, "effects": effects}, tuple(map(str, asked))


def _wheelset(draw: np.random.Generator) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A wheelset below and above its critical speed, from small displacements to those that meet the flange."""
    factors = {name: float(np.exp(draw.uniform(-0.7, 0.7))) for name in ("stiffness_x", "damping_x", "damping_y")}
    usual = {"stiffness_x": 2e5, "damping_x": 1e3, "damping_y": 1e3}
    displacement = float(10.0 ** draw.uniform(-4.0, -2.2))
    asked = draw.choice(["y", "yaw", "rms y", "max fy", "rms power", "rms fx"], 2, replace=False)
    return {
        "wheelset": {"override": {name: usual[name] * factor for name, factor in factors.items()}},
        "contact": {"law": "fastsim"},
        "speeds": {"values": [10.0]},
        "run": {
            "duration": 0.24,
            "step": float(draw.choice([1e-4, 2e-4])),
            "displacement": displacement,
            "speeds": [float(draw.uniform(5.0, 60.0))],
        },
    }, tuple(map(str, asked))


def _braking(draw: np.random.Generator) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A truck that stops on one of four surfaces, with and without anti-lock control."""
    push_out = float(draw.uniform(0.05, 0.8))
    table: dict[str, Any] = {
        "road": {"stretches": [{"left": str(draw.choice(["dry", "wet", "snow", "ice"]))}]},
        "brakes": {
            "supply": float(draw.uniform(3.0, 7.0)),
            "front": {
                "gradient": float(draw.uniform(1000.0, 2000.0)),
                "push_out": push_out,
                "release": push_out * float(draw.uniform(0.5, 1.0)),
            },
            "rear": {"gradient": float(draw.uniform(800.0, 1600.0)), "push_out": float(draw.uniform(0.0, 0.3))},
        },
        "controller": {"kind": str(draw.choice(["none", "slip_bang_bang", "slip_pi"]))},
        "procedures": {"straight": {"kind": "straight", "speed": float(draw.uniform(5.0, 9.0))}},
        "run": {"duration": 12.0, "substeps": 8},
    }
    if draw.random() < 0.7:
        table["load_transfer"] = {"front": float(draw.uniform(0.2, 0.4))}
    if draw.random() < 0.7:
        table["pressure"] = {"fill": float(draw.uniform(0.01, 0.2)), "empty": float(draw.uniform(0.01, 0.2))}
    asked = draw.choice(["stopping distance [m]", "stopping time [s]", "MFDD [m/s^2]", "mean slip"], 1)
    return table, tuple(map(str, asked))


DRAWN = {"pitch-plane": _pitch_plane, "wheelset": _wheelset, "braking": _braking}
