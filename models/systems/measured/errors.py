"""Stated errors of the section forces of a recording's run by the length of its time steps.

A time step is usually as long as a sampling period: longer steps would take the samples' noise for motion. So part of
the recording is run in the same steps and in half of them.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from models.core.discretisation import Estimate, error_estimate, estimate_rescaled, reference_size, summed_error
from models.systems.hub_forces.run import LEAST_CHANGE_SHARE, STEP_ERROR_ORDER
from models.systems.measured.consequences import samples_as_recording
from models.systems.measured.section_run import SectionOutcome, SectionRunSettings
from models.systems.measured.section_run import run as march

REPEATED_SHARE, LONGEST_REPEAT = 0.2, 30.0
"""Share of a recording that is run again, in the same steps and in half of them (0.6 of its force calls), and its
longest duration (s).
"""


def errors_of_steps(
    run_settings: SectionRunSettings,
    run_outcome: SectionOutcome,
    earlier_errors: dict[str, Estimate],
    work_folder: Path,
) -> dict[str, Estimate]:
    """Estimate the errors that the time steps cause in forces of springs, mounts and bars, and in roll and pitch;
    returned by channel name.

    earlier_errors : errors of the virtual measurement by element name, which are added. Raises RunFailed where the
    repeated part, which begins at rest in the middle of the recording, fails.
    """
    grid, recording = run_settings.grid, run_settings.recording
    count = round(min(REPEATED_SHARE * recording.duration, LONGEST_REPEAT) / recording.period) + 1
    first = (recording.count - count) // 2
    samples = {s: recording.columns.read(s.name, first, count) for s in recording.signals}
    shutil.rmtree(work_folder, ignore_errors=True)
    middle_job = replace(run_settings, recording=samples_as_recording(recording, samples, work_folder))
    coarse = march(middle_job, work_folder / "own")
    fine = march(replace(middle_job, step=0.5 * grid.step), work_folder / "half")
    stride, errors = round(coarse.period / fine.period), dict[str, Estimate]()
    for name, element in _principal_channels(run_settings, run_outcome, bool(earlier_errors)).items():
        error = error_estimate(
            fine.samples(name)[::stride][: coarse.done], coarse.samples(name), STEP_ERROR_ORDER, grid.step
        )
        scaled = replace(
            error, error=error.error * 2.0**error.order, unit="rad" if not element else _unit(run_settings, element)
        )
        errors[name] = estimate_rescaled(scaled, reference_size(run_outcome.samples(name)), grid.step)
        if element in earlier_errors:
            errors[name] = summed_error(errors[name], earlier_errors[element])
    shutil.rmtree(work_folder, ignore_errors=True)
    return errors


def _principal_channels(
    run_settings: SectionRunSettings, run_outcome: SectionOutcome, is_virtual: bool
) -> dict[str, str]:
    """Names of the channels whose error is estimated, each with its element ("" for an angle), without channels that
    hardly move.

    After a virtual measurement roll and pitch are left out: errors of measured moments accumulate in them.
    """
    elements = {element.name: element.unit for element in run_settings.vehicle.elements}
    names = {a.name: a.section for a in run_outcome.answers if a.section in elements and a.unit == elements[a.section]}
    names |= {} if is_virtual else {f"{run_settings.vehicle.chassis} {angle}": "" for angle in ("roll", "pitch")}
    change = {name: float(np.std(run_outcome.samples(name))) for name in names}
    kinds = {name: elements.get(element, "rad") for name, element in names.items()}
    most = {kind: max(change[name] for name in names if kinds[name] == kind) for kind in kinds.values()}
    return {name: element for name, element in names.items() if change[name] > LEAST_CHANGE_SHARE * most[kinds[name]]}


def _unit(run_settings: SectionRunSettings, element_name: str) -> str:
    """Unit of the force or moment of an element: N or N m."""
    return next(candidate.unit for candidate in run_settings.vehicle.elements if candidate.name == element_name)
