"""Price of accuracy of a user's handling scene: one of its manoeuvres, with the steps and contact cells of its
engines.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.advice.price.meshed import (
    SECOND_SOLVER_TOLERANCE,
    MeshedScene,
    checked_quantity,
    duration_of_first_part,
    run_and_quantity,
)
from models.advice.price.problem import Setting
from models.core.errors import RunFailed
from models.core.trajectory import Trajectory
from models.multibody.numbers import Handling
from models.systems.handling.run import SimulatedDrive, build_in_engine, drive_of_fixed_steps, drive_result, drive_run
from models.systems.handling.scene import HandlingScene

SEARCHED_DURATION = 1.0
"""Longest part (s) of a manoeuvre over which settings are searched."""
USUAL_QUANTITY = "yaw_rate"
QUANTITIES: dict[str, tuple[Any, str]] = {
    "yaw_rate": (lambda drive: drive.velocity()[:, 2], "rad/s"),
    "lateral_acceleration": (lambda drive: drive.lateral_acceleration(), "m/s^2"),
    "lateral_speed": (lambda drive: drive.velocity()[:, 1], "m/s"),
    "speed": (lambda drive: drive.velocity()[:, 0], "m/s"),
    "load": (lambda drive: drive["load"], "N"),
}
"""Quantities that can be priced: functions that read them from a drive, and their units."""


@cache
def _with_cells(handling: Handling, cell_count: int) -> Handling:
    """The vehicle with ``cell_count`` cells along the contact patches of its tyres."""
    return replace(handling, tyres=replace(handling.tyres, cells=cell_count))


@dataclass(frozen=True)
class PricedHandling(MeshedScene):
    """A handling manoeuvre as a priced scene."""

    scene: HandlingScene
    manoeuvre_name: str
    speed: float
    handling: Handling

    def run(self, engine: str, cell_count: int, step: float, duration: float) -> SimulatedDrive:
        """Simulate the manoeuvre in an engine with this number of contact cells and this step (s)."""
        return drive_run(engine, _with_cells(self.handling, cell_count), self.speed, duration, step)

    def exact_run(self, cell_count: int, step: float, duration: float) -> SimulatedDrive:
        """Simulate the manoeuvre by the solver DOP853 with the engine's accelerations, as an accurate reference."""
        handling = _with_cells(self.handling, cell_count)
        model, start = build_in_engine(self.reference_engine, handling), np.concatenate(handling.straight(self.speed))
        n, times = start.size // 2, step * np.arange(round(duration / step) + 1)
        solved = solve_ivp(
            lambda t, y: np.concatenate((y[n:], model.acceleration(t, y[:n], y[n:]))),
            (0.0, duration),
            start,
            "DOP853",
            np.minimum(times, duration),
            rtol=SECOND_SOLVER_TOLERANCE,
            atol=SECOND_SOLVER_TOLERANCE,
        )
        if not solved.success:
            raise RunFailed(self.reference_engine, solved.message)
        return drive_of_fixed_steps(handling, Trajectory(times, solved.y.T), self.reference_engine)

    def quantity_along_run(self, run: SimulatedDrive) -> tuple[np.ndarray, np.ndarray, int]:
        """Times (n,) in s and values (n, k) of the quantity along a manoeuvre, and the number of force calls; the
        assumptions of the run are judged.
        """
        drive_result(self.scene, self.reference_engine, self.manoeuvre_name, run)
        values, times = QUANTITIES[self.quantity][0](run), run.run.times
        return times, values.reshape(len(times), -1), 4 * (len(times) - 1) * run.tyres.shape[1]

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that set the number of contact cells and the step."""
        return [
            "[tyres]",
            f"cells = {round(1 / setting.value)}",
            "[run]",
            f"step = {self.steps[setting.method]!r}",
            f"# twinrig run SCENE --engine {setting.engine}",
        ]


def priced_scene(scene: HandlingScene, quantity: str | None, engines: tuple[str, ...]) -> PricedHandling:
    """The handling scene with the quantity MANOEUVRE.QUANTITY to price; the first manoeuvre where none is named."""
    name, quantity_name = run_and_quantity(quantity, USUAL_QUANTITY, scene.manoeuvres, "manoeuvre")
    checked_quantity(quantity_name, QUANTITIES)
    manoeuvre, step, other_manoeuvres = (
        scene.manoeuvres[name],
        scene.run.step,
        [name_of_other for name_of_other in scene.manoeuvres if name_of_other != name],
    )
    note = f"manoeuvre {name}" + (
        f"; of another one by --quantity {other_manoeuvres[0]}.{quantity_name}" if other_manoeuvres else ""
    )
    return PricedHandling(
        scene.title,
        quantity_name,
        QUANTITIES[quantity_name][1],
        note,
        manoeuvre.duration,
        duration_of_first_part(manoeuvre.duration, SEARCHED_DURATION),
        engines,
        "mujoco",
        step,
        2.0 * step,
        scene.tyres.cells,
        scene,
        name,
        manoeuvre.speed,
        scene.handling(name),
    )
