"""A second process that compiles the kernels of a scene's last engine while the first engines run.

It runs the scene in that engine, with results in a temporary folder. It starts as soon as a kernel is compiled, once
after an installation, if a user waits at a terminal and a core is idle. Both processes need mostly the same kernels, in
the same order, and wait for one another (``models.machine.alone``); so it begins with one that the first process needs
late.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from studies.command.asked import load_scene, runs_without_extras, study_module_of
from studies.command.waiting import CompilationObserver


class SecondCompiler(CompilationObserver):
    """Observer of compilation that starts a command once, when this process compiles a kernel that it did not load."""

    def __init__(self, process_command: list[str]) -> None:
        super().__init__()
        self.command = process_command
        self.process: subprocess.Popen[bytes] | None = None

    def _start(self, *compiler_event: Any) -> None:
        if self.process is None:
            nowhere = subprocess.DEVNULL
            self.process = subprocess.Popen(self.command, stdin=nowhere, stdout=nowhere, stderr=nowhere)

    def end(self) -> None:
        """Stop observing, and end the started command if it still runs."""
        self.detach()
        if self.process is not None:
            self.process.kill()
            self.process.wait()


@contextmanager
def second_process_compiles(
    scene_name: str, key_changes: list[str], scene: Any, engines: tuple[str, ...]
) -> Iterator[None]:
    """Context in which a second process compiles the kernels of the scene's last engine if they are missing.

    scene_name, key_changes : which scene this is, as the user gave them. Nothing is run twice that has workers of its
    own, or code of the user's.
    """
    idle = len(engines) > 1 and (os.cpu_count() or 1) > 1 and sys.stderr.isatty()
    if not idle or not runs_without_extras(scene, engines, study_module_of(scene)):
        yield
        return
    with TemporaryDirectory() as folder:
        request = json.dumps([scene_name, key_changes, engines[-1], scene.error, folder])
        compiler = SecondCompiler([sys.executable, "-P", "-m", __name__, request])
        compiler.attach()
        try:
            yield
        finally:
            compiler.end()


def run_for_kernels(scene_name: str, key_changes: list[str], engine: str, with_error: bool, output_folder: str) -> None:
    """Run a scene in one engine, which compiles its kernels; results are saved in ``output_folder``. The scene is
    checked by the first process."""
    scene = load_scene(scene_name, key_changes).model_copy(update={"error": with_error})
    if scene.system in LATE_KERNELS:
        LATE_KERNELS[scene.system]()
    study_module_of(scene).run(scene, (engine,), Path(output_folder), lambda text, share: None)


def compile_fastsim() -> None:
    """Compile FASTSIM for many contacts, which a wheelset's equations call."""
    import numpy as np

    from models.contact.fastsim_many import fill_contact_forces
    from models.contact.fastsim_records import CONTACT, FORCES, GridStrips, StripCells

    no_strips = GridStrips(*np.empty((4, 0)))
    centre, bound, middle, start_bound, rate = np.empty((5, 0))
    no_cells = StripCells(centre, bound, middle, start_bound, rate, 1.0)
    fill_contact_forces(np.empty(0, CONTACT), no_strips, no_cells, 0, 0, np.empty(0, FORCES))


def compile_free_vehicle_forces() -> None:
    """Compile the forces of a vehicle that moves freely, which engines call."""
    from models.multibody.forces import set_forces

    set_forces.compile("(int64, float64, int64)")


LATE_KERNELS = {"wheelset": compile_fastsim, "handling": compile_free_vehicle_forces}
"""By system, the function that compiles a kernel that takes seconds and that the first process needs late."""


if __name__ == "__main__":
    run_for_kernels(*json.loads(sys.argv[1]))
