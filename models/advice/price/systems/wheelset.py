"""Price of accuracy of a user's wheelset scene: its paths at all speeds together."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from models.advice.price.meshed import SECOND_SOLVER_TOLERANCE, MeshedScene, checked_quantity, duration_of_first_part
from models.advice.price.problem import Setting
from models.core.errors import RunFailed
from models.rail.equations import ALLOWED_STEP_RATE, WheelsetEquations, WheelsetPath
from models.systems.wheelset.of_scene import equations_and_start, path_speeds, wheelset_of
from models.systems.wheelset.run import CONTACT_CHANNELS, STATE_CHANNELS, path_result, simulated_path
from models.systems.wheelset.scene import WheelsetScene

SEARCHED_DURATION = 0.25
"""Longest part (s) of a path over which settings are searched."""
USUAL_QUANTITY = "y"
PRICED_QUANTITIES = {**STATE_CHANNELS, **CONTACT_CHANNELS}
"""Quantities that can be priced: state index or contact field, and unit, by name."""


@dataclass(frozen=True)
class PricedWheelset(MeshedScene):
    """The paths of a wheelset scene at all its speeds, as a priced scene."""

    scene: WheelsetScene
    speeds: tuple[float, ...]

    def _changed_scene(self, cell_count: int, step: float, duration: float) -> WheelsetScene:
        """The wheelset scene with another number of contact cells, step (s) and duration (s)."""
        contact = self.scene.contact.model_copy(update={"cells": cell_count or 3})
        run = self.scene.run.model_copy(update={"step": step, "duration": duration})
        return self.scene.model_copy(update={"contact": contact, "run": run})

    def run(self, engine: str, cell_count: int, step: float, duration: float) -> list[WheelsetPath]:
        """Compute the wheelset's path at every speed in an engine, with this number of contact cells and this step
        (s).
        """
        return [simulated_path(self._changed_scene(cell_count, step, duration), engine, speed) for speed in self.speeds]

    def exact_run(self, cell_count: int, step: float, duration: float) -> list[WheelsetPath]:
        """The wheelset's path at every speed by the solver DOP853, as an accurate reference."""
        scene = self._changed_scene(cell_count, step, duration)
        return [_exact_path(*equations_and_start(scene, "reference", speed), step, duration) for speed in self.speeds]

    def quantity_along_run(self, run: list[WheelsetPath]) -> tuple[np.ndarray, np.ndarray, int]:
        """Times (n,) in s and values (n, k) of the quantity along the paths at all speeds, and the number of force
        calls; the assumptions of each path are judged.
        """
        for speed, wheelset_run in zip(self.speeds, run, strict=True):
            path_result(self.scene, self.reference_engine, speed, wheelset_run)
        name, times = self.quantity, run[0].times
        if name in STATE_CHANNELS:
            columns = [wheelset_run.states[:, [STATE_CHANNELS[name][0]]] for wheelset_run in run]
        else:
            columns = [wheelset_run.contacts[CONTACT_CHANNELS[name][0]] for wheelset_run in run]
        return times, np.hstack(columns), 4 * len(run) * (len(times) - 1) * run[0].contacts.shape[1]

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that set the number of contact cells and the step."""
        step = f"step = {self.steps.get(setting.method, setting.value)!r}"
        cells = ["[contact]", f"cells = {round(1 / setting.value)}"] if self.cells else []
        return [*cells, "[run]", step, f"# twinrig run SCENE --engine {setting.engine}"]


def _exact_path(equations: WheelsetEquations, start_state: np.ndarray, step: float, duration: float) -> WheelsetPath:
    """A wheelset's path by a Runge-Kutta method of order 8 with automatic steps; RunFailed where it gives up."""
    times = step * np.arange(round(duration / step) + 1)
    scale = np.maximum(np.abs(start_state), 1e-3)
    solved = solve_ivp(
        lambda t, y: equations.rates(y),
        (0.0, duration),
        start_state,
        "DOP853",
        np.minimum(times, duration),
        rtol=SECOND_SOLVER_TOLERANCE,
        atol=SECOND_SOLVER_TOLERANCE * 1e-1 * scale,
    )
    if not solved.success:
        raise RunFailed("reference", solved.message)
    states = np.ascontiguousarray(solved.y.T)
    return WheelsetPath(times, states, contacts=equations.at(states)[1])


def priced_scene(scene: WheelsetScene, quantity: str | None, engines: tuple[str, ...]) -> PricedWheelset:
    """The wheelset scene with a quantity to price: a state or a contact force, along its paths at all speeds."""
    quantity_name, wheelset, contact = (
        checked_quantity(quantity or USUAL_QUANTITY, PRICED_QUANTITIES),
        wheelset_of(scene),
        scene.contact,
    )
    speeds, run = tuple(path_speeds(scene)), scene.run
    fastest = max(
        float(np.abs(np.linalg.eigvals(WheelsetEquations(wheelset, speed, contact.law).state_matrix)).max())
        for speed in speeds
    )
    longest, cells = 0.95 * ALLOWED_STEP_RATE / fastest, contact.cells if contact.law == "fastsim" else 0
    note = f"all paths together, at {' and '.join(f'{speed:g}' for speed in speeds)} m/s"
    return PricedWheelset(
        scene.title,
        quantity_name,
        PRICED_QUANTITIES[quantity_name][1],
        note,
        run.duration,
        duration_of_first_part(run.duration, SEARCHED_DURATION),
        engines,
        "reference",
        run.step,
        longest,
        cells,
        scene,
        speeds,
    )
