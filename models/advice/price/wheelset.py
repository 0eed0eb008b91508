"""A user's scene of a wheelset as the search of the price of accuracy sees it: all its paths at once."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from models.advice.price.meshed import TIGHT, Meshed, chosen, first_part
from models.advice.price.problem import Setting
from models.core.errors import RunFailed
from models.rail.equations import STATES, STIFF, YAW, Equations, Path, rates
from models.rail.wheelset import Wheelset
from models.systems.wheelset.channels import CONTACTS
from models.systems.wheelset.channels import STATES as COORDINATES
from models.systems.wheelset.of_scene import implementation, path_speeds, wheelset_of
from models.systems.wheelset.scene import WheelsetScene

FIRST = 0.25
"""s: of a longer path only so much is searched."""
USUAL = "y"
QUANTITIES = {**COORDINATES, **CONTACTS}
"""Places and units of what can be asked about: of states, or of the contacts of all patches."""


@dataclass(frozen=True)
class OwnWheelset(Meshed):
    """The paths of a scene at all its speeds."""

    wheelset: Wheelset
    law: Literal["linear", "fastsim"]
    speeds: tuple[float, ...]
    start: tuple[float, float]

    @cached_property
    def _starts(self) -> dict[tuple[str, int, float], tuple[Equations, np.ndarray]]:
        return {}

    def _started(self, engine: str, cells: int, speed: float) -> tuple[Equations, np.ndarray]:
        """Equations and the scene's start."""
        key = (engine, cells, speed)
        if key not in self._starts:
            found = implementation(engine)(self.wheelset, speed, self.law, cells or 3)
            state = found.displaced(self.start[0])
            state[YAW] = self.start[1]
            self._starts[key] = found, state
        return self._starts[key]

    def run(self, engine: str, cells: int, step: float, duration: float) -> list[Path]:
        """A path for every speed."""
        return [
            equations.run(state, duration, step)
            for equations, state in (self._started(engine, cells, speed) for speed in self.speeds)
        ]

    def exact(self, cells: int, step: float, duration: float) -> list[Path]:
        """The same by DOP853."""
        return [_exact(*self._started("reference", cells, speed), step, duration) for speed in self.speeds]

    def read(self, run: list[Path]) -> tuple[np.ndarray, np.ndarray, int]:
        """The quantity of all paths side by side."""
        place, times = QUANTITIES[self.quantity][0], run[0].times
        columns = [one.states[:, [place]] if self.quantity in COORDINATES else one.contacts[:, :, place] for one in run]
        return times, np.hstack(columns), 4 * len(run) * (len(times) - 1) * run[0].contacts.shape[1]

    def lines(self, setting: Setting) -> list[str]:
        """Cells and step."""
        step = f"step = {self.steps.get(setting.method, setting.value)!r}"
        cells = ["[contact]", f"cells = {round(1 / setting.value)}"] if self.cells else []
        return [*cells, "[run]", step, f"# twinrig run SCENE --engine {setting.engine}"]


def _exact(equations: Equations, start: np.ndarray, step: float, duration: float) -> Path:
    """A path by a Runge-Kutta method of order 8 with steps of its own; RunFailed where it gives up."""
    times = step * np.arange(round(duration / step) + 1)
    scale = np.maximum(np.abs(start), 1e-3)
    done = solve_ivp(
        lambda t, y: equations.rates(y),
        (0.0, duration),
        start,
        "DOP853",
        np.minimum(times, duration),
        rtol=TIGHT,
        atol=TIGHT * 1e-1 * scale,
    )
    if not done.success:
        raise RunFailed("reference", done.message)
    states = np.ascontiguousarray(done.y.T)
    contacts, out = equations.blank(len(times)), np.empty(STATES)
    for one, contact in zip(states, contacts, strict=True):
        rates(one, *equations.parameters, out, contact)
    return Path(times, states, contacts)


def own(scene: WheelsetScene, quantity: str | None, engines: tuple[str, ...]) -> OwnWheelset:
    """The scene with a quantity: a state or a force of the contacts, of its paths at all speeds."""
    asked, wheelset, contact = chosen(quantity or USUAL, QUANTITIES), wheelset_of(scene), scene.contact
    speeds, run = tuple(path_speeds(scene)), scene.run
    fastest = max(
        float(np.abs(np.linalg.eigvals(Equations(wheelset, speed, contact.law).state_matrix)).max()) for speed in speeds
    )
    longest, cells = 0.95 * STIFF / fastest, contact.cells if contact.law == "fastsim" else 0
    note = f"all paths together, at {' and '.join(f'{speed:g}' for speed in speeds)} m/s"
    return OwnWheelset(
        scene.title,
        asked,
        QUANTITIES[asked][1],
        note,
        run.duration,
        first_part(run.duration, FIRST),
        engines,
        "reference",
        run.step,
        longest,
        cells,
        wheelset,
        contact.law,
        speeds,
        (run.displacement, run.yaw),
    )
