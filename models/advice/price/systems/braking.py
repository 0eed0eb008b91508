"""Price of accuracy of a user's braking scene: one of its procedures, up to standstill, with the steps of its only
method.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.meshed import checked_quantity, run_and_quantity
from models.advice.price.problem import Setting
from models.core.errors import InputError, RunFailed
from models.systems.braking.march import BrakingPath
from models.systems.braking.procedures import engines_of
from models.systems.braking.run import run as drive
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import StopHistory

METHOD_NAME = "exact wheel"
SUBSTEPS_TRIED = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Numbers of steps within a controller sample that are tried, beside the scene's number."""
FIRST_REFERENCE_SUBSTEPS, REFERENCE_RUNGS = 8, 8
"""Number of steps within a sample on the reference's first rung, and the number of its rungs."""
USUAL_QUANTITY = "stopping_distance"
QUANTITIES: dict[str, tuple[Any, str]] = {
    "stopping_distance": (lambda path: StopHistory(path).distance_travelled[-1], "m"),
    "stopping_time": (lambda path: path.times[-1], "s"),
    "aside": (lambda path: path.states[-1, 0, 1], "m"),
    "yaw": (lambda path: path.states[-1, 0, 2], "rad"),
}
"""Quantities that can be priced: functions that read them at the end of the stop, and their units."""


@dataclass(frozen=True)
class PricedBraking:
    """A braking procedure as a priced scene, see ``models.advice.price.PricedScene``. procedure_name : name of the
    procedure.
    """

    scene: BrakingScene
    procedure_name: str
    quantity: str
    engines: tuple[str, ...]
    note: str
    kink_period = 0.0

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.scene.title

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return str(QUANTITIES[self.quantity][1])

    @property
    def full_duration(self) -> float:
        """Longest duration (s) that a run may take."""
        return self.scene.run.duration

    searched_duration = full_duration

    @property
    def work_count_name(self) -> str:
        """Name of the count that measures the work: tyre forces, evaluated once per step in every engine."""
        return "force calls"

    def setting_ladders(self) -> list[SettingLadder]:
        """Ladders of steps for the only method of braking, one for each engine that integrates the chassis."""
        run = self.scene.run
        values = tuple(run.sample / n for n in sorted({*SUBSTEPS_TRIED, run.substeps}))
        return [
            SettingLadder(engine, METHOD_NAME, values, 1, default=run.sample / run.substeps) for engine in self.engines
        ]

    def reference_ladder(self) -> SettingLadder:
        """Ladder of the reference, with twice as many steps within a sample on every rung."""
        engine = "reference" if "reference" in engines_of(self.scene, ("reference", "exudyn", "mujoco")) else "mujoco"
        return SettingLadder(
            engine,
            METHOD_NAME,
            tuple(self.scene.run.sample / (FIRST_REFERENCE_SUBSTEPS * 2**k) for k in range(REFERENCE_RUNGS)),
            1,
        )

    def second_setting(self, reference_setting: Setting) -> Setting | None:
        """None: braking with valves in the loop has only one method."""
        return None

    def solve(self, setting: Setting, duration: float) -> tuple[int, BrakingPath]:
        """Simulate the braking procedure with a setting; returns the number of steps within a sample and the path.
        RunFailed where the vehicle does not stop.
        """
        substeps = round(self.scene.run.sample / setting.value)
        run = self.scene.run.model_copy(update={"substeps": substeps})
        path = drive(self.scene.model_copy(update={"run": run}), setting.engine, procedure=self.procedure_name).detail
        if not path.ended_at_rest:
            raise RunFailed(setting.engine, f"the vehicle does not stand after {duration:g} s: give it longer")
        return substeps, path

    def priced_run(self, solution: tuple[int, BrakingPath]) -> PricedRun:
        """The quantity, a single number, as a constant time history. Each step evaluates the forces of each wheel
        once.
        """
        substeps, path = solution
        value, calls = QUANTITIES[self.quantity][0](path), substeps * path.turning.shape[1] * (len(path.times) - 1)
        return PricedRun(np.array([0.0, 1.0]), np.full((2, 1), value), {"force calls": calls})

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that set the number of steps within a sample."""
        return [
            "[run]",
            f"substeps = {round(self.scene.run.sample / setting.value)}",
            f"# twinrig run SCENE --engine {setting.engine}",
        ]


def priced_scene(scene: BrakingScene, quantity: str | None, engines: tuple[str, ...]) -> PricedBraking:
    """The braking scene with the quantity PROCEDURE.QUANTITY to price; the first procedure where none is named."""
    if scene.port is not None:
        raise InputError(
            scene.file,
            "port",
            None,
            "cannot be priced: what stands behind it answers one run; leave it out, with a controller in its place",
        )
    name, requested_quantity = run_and_quantity(quantity, USUAL_QUANTITY, scene.procedures, "procedure")
    checked_quantity(requested_quantity, QUANTITIES)
    other_procedures = [procedure for procedure in scene.procedures if procedure != name]
    note = f"procedure {name}" + (
        f"; of another one by --quantity {other_procedures[0]}.{requested_quantity}" if other_procedures else ""
    )
    return PricedBraking(scene, name, requested_quantity, engines_of(scene, engines), note)
