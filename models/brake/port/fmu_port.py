"""Controllers as FMUs (FMI 2.0, co-simulation), run through fmpy.

Inputs: ``wheel_1`` to ``wheel_W`` (real, m/s), and as far as the FMU has them ``brake`` (boolean), ``supply`` (real,
bar) and ``speed`` (real, m/s; not a number if it is not given). Outputs: ``valve_1`` to ``valve_W`` (real or integer;
-1 release, 0 hold, 1 apply, 2 apply slowly where the scene has such valves) or ``pressure_1`` to ``pressure_W`` (real,
bar). At each sample the inputs are set, one step of a sample's length is done, and the outputs then are the answer to
that sample.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.controller import Command, Sample
from models.core.errors import InputError


@contextmanager
def opened_fmu(fmu_path: Path, unpacking_folder: Path, wheel_count: int, sampling_period: float) -> Iterator["FmuPort"]:
    """The controller of an FMU file, unpacked into a folder, as a context manager; sampling_period : duration (s).

    Raises InputError.
    """
    import fmpy

    try:
        description = fmpy.read_model_description(str(fmu_path))
        fmpy.extract(str(fmu_path), str(unpacking_folder))
    except Exception as error:
        raise InputError(fmu_path.name, "fmu", None, f"is no FMU: {type(error).__name__}: {error}") from None
    if not description.fmiVersion.startswith("2.") or description.coSimulation is None:
        raise InputError(fmu_path.name, "fmu", description.fmiVersion, "must be of FMI 2 with co-simulation")
    names = _variables_by_name(description, wheel_count, fmu_path.name)
    with _running_fmu(description, str(unpacking_folder), fmu_path.name) as slave:
        yield FmuPort(slave, names, wheel_count, sampling_period)


@contextmanager
def _running_fmu(fmu_description: Any, unpacked_folder: str, fmu_file: str) -> Iterator[Any]:
    """The FMU, instantiated and initialised, as a context manager that frees it."""
    from fmpy.fmi2 import FMU2Slave

    try:
        slave = FMU2Slave(
            guid=fmu_description.guid,
            unzipDirectory=unpacked_folder,
            instanceName="controller",
            modelIdentifier=fmu_description.coSimulation.modelIdentifier,
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
    except Exception as error:
        raise InputError(fmu_file, "fmu", None, f"cannot be run here: {type(error).__name__}: {error}") from None
    try:
        yield slave
    finally:
        with suppress(Exception):  # one that has failed cannot be asked to end, and said so when it failed
            slave.terminate()
        slave.freeInstance()


OPTIONAL_INPUTS = {"supply": "Real", "speed": "Real", "brake": "Boolean"}
"""Inputs that an FMU may have, with their types."""


class FmuPort:
    """A running FMU as a controller. names : value reference and type of each variable, by its name."""

    def __init__(
        self, fmu_instance: Any, fmu_variables: dict[str, tuple[int, str]], wheel_count: int, sampling_period: float
    ) -> None:
        self._slave, self._step = fmu_instance, sampling_period
        self._wheels = _references(fmu_variables, "wheel", wheel_count)
        self._extra = [(fmu_variables[name][0], name) for name in ("supply", "speed") if name in fmu_variables]
        self._references = self._wheels + [reference for reference, _ in self._extra]
        self._brake = [fmu_variables["brake"][0]] if "brake" in fmu_variables else []
        self._mode = "valve" if "valve_1" in fmu_variables else "pressure"
        self._answers = _references(fmu_variables, self._mode, wheel_count)
        self._get = (
            fmu_instance.getInteger if fmu_variables[f"{self._mode}_1"][1] == "Integer" else fmu_instance.getReal
        )

    def sample(self, sample: Sample) -> Command:
        """The controller's command for a sample: the FMU's outputs after one step."""
        self._slave.setReal(
            self._references, sample.wheels.tolist() + [getattr(sample, name) for _, name in self._extra]
        )
        if self._brake:
            self._slave.setBoolean(self._brake, [sample.brake])
        self._slave.doStep(sample.number * self._step, self._step)
        values = np.array(self._get(self._answers), dtype=float)
        return Command(valves=values) if self._mode == "valve" else Command(pressures=values)


def _references(fmu_variables: dict[str, tuple[int, str]], variable_kind: str, wheel_count: int) -> list[int]:
    """Value references of a kind of variable for all wheels."""
    return [fmu_variables[f"{variable_kind}_{i + 1}"][0] for i in range(wheel_count)]


def _variables_by_name(fmu_description: Any, wheel_count: int, fmu_file: str) -> dict[str, tuple[int, str]]:
    """Value reference and type of each variable, by name; raises InputError if one is missing or has the wrong type."""
    names = {variable.name: (variable.valueReference, variable.type) for variable in fmu_description.modelVariables}
    kind = "valve" if "valve_1" in names else "pressure"
    wanted: dict[str, tuple[str, ...]] = {f"wheel_{i + 1}": ("Real",) for i in range(wheel_count)}
    wanted |= {f"{kind}_{i + 1}": ("Real", "Integer") if kind == "valve" else ("Real",) for i in range(wheel_count)}
    wanted |= {name: (kind_of,) for name, kind_of in OPTIONAL_INPUTS.items() if name in names}
    for name, types in wanted.items():
        if name not in names:
            raise InputError(
                fmu_file, name, None, f"is missing: an FMU for {wheel_count} wheels has it, and its outputs"
            )
        if names[name][1] not in types:
            raise InputError(fmu_file, name, names[name][1], f"must be of type {' or '.join(types)}")
    if kind == "valve" and len({names[f"valve_{i + 1}"][1] for i in range(wheel_count)}) > 1:
        raise InputError(fmu_file, "valve_1", names["valve_1"][1], "must be of one type with all other valves")
    return names
