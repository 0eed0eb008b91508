"""A user's scene of handling as the search of the price of accuracy sees it: one of its manoeuvres."""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.advice.price.meshed import OTHER_TOLERANCE, MeshedScene, checked_quantity, first_part, run_and_quantity
from models.advice.price.problem import Setting
from models.core.errors import RunFailed
from models.core.trajectory import Trajectory
from models.multibody.numbers import Handling
from models.systems.handling.run import Drive, build, drive_of_fixed_steps, drive_result, drive_run
from models.systems.handling.scene import HandlingScene

SEARCHED_DURATION = 1.0
"""s: of a longer manoeuvre only so much is searched."""
USUAL_QUANTITY = "yaw_rate"
QUANTITIES: dict[str, tuple[Any, str]] = {
    "yaw_rate": (lambda drive: drive.velocity()[:, 2], "rad/s"),
    "lateral_acceleration": (lambda drive: drive.lateral_acceleration(), "m/s^2"),
    "lateral_speed": (lambda drive: drive.velocity()[:, 1], "m/s"),
    "speed": (lambda drive: drive.velocity()[:, 0], "m/s"),
    "load": (lambda drive: drive["load"], "N"),
}
"""What can be asked about, and its unit."""


@cache
def _with_cells(handling: Handling, cells: int) -> Handling:
    """The vehicle with another number of cells in its tyres' patches."""
    return replace(handling, tyres=replace(handling.tyres, cells=cells))


@dataclass(frozen=True)
class PricedHandling(MeshedScene):
    """A manoeuvre of handling as a priced scene."""

    scene: HandlingScene
    name: str
    speed: float
    handling: Handling

    def run(self, engine: str, cells: int, step: float, duration: float) -> Drive:
        """Drive the manoeuvre in an engine with this number of cells and this step (s)."""
        return drive_run(engine, _with_cells(self.handling, cells), self.speed, duration, step)

    def exact(self, cells: int, step: float, duration: float) -> Drive:
        """Drive the manoeuvre by the solver DOP853 with the engine's accelerations, as an accurate reference."""
        handling = _with_cells(self.handling, cells)
        model, start = build(self.reference_engine, handling), np.concatenate(handling.straight(self.speed))
        n, times = start.size // 2, step * np.arange(round(duration / step) + 1)
        solved = solve_ivp(
            lambda t, y: np.concatenate((y[n:], model.acceleration(t, y[:n], y[n:]))),
            (0.0, duration),
            start,
            "DOP853",
            np.minimum(times, duration),
            rtol=OTHER_TOLERANCE,
            atol=OTHER_TOLERANCE,
        )
        if not solved.success:
            raise RunFailed(self.reference_engine, solved.message)
        return drive_of_fixed_steps(handling, Trajectory(times, solved.y.T), self.reference_engine)

    def read(self, run: Drive) -> tuple[np.ndarray, np.ndarray, int]:
        """The quantity over the time of a drive, and the number of force calls; the drive's assumptions are judged."""
        drive_result(self.scene, self.reference_engine, self.name, run)
        values, times = QUANTITIES[self.quantity][0](run), run.run.times
        return times, values.reshape(len(times), -1), 4 * (len(times) - 1) * run.tyres.shape[1]

    def lines(self, setting: Setting) -> list[str]:
        """Lines of a scene that set the number of cells and the step."""
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
        first_part(manoeuvre.duration, SEARCHED_DURATION),
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
