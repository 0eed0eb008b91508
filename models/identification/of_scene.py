"""Identification problem of a scene of any system: keys of the scene as parameters, and a measurement."""

import copy
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from models.core.errors import InputError, RunFailed, suggestion_phrase
from models.core.result import Result
from models.core.scene_file import set_key
from models.core.strict import LARGEST_QUANTITY
from models.core.systems import SYSTEMS, scene_of_table
from models.identification.problem import (
    ChannelOnClock,
    FitClock,
    IdentificationProblem,
    IdentifiedParameter,
    TimeCurve,
    measured_channel,
)
from models.measured.channel import MeasurementSource
from models.measured.curve import channel_curve
from models.measured.formats import open_source

PARAMETERS_OPTION_NAME = "--parameters"
TRIAL_RUN_SHARE = 50.0
"""Ratio of the scene's duration to that of the short run that gives the names of its channels."""


def parameter_of_scene(scene: Any, parameter_text: str) -> IdentifiedParameter:
    """Parameter from text KEY or KEY=LOW:HIGH; its start is the scene's value, and without a range its bounds are the
    limits of the scene's key.

    Raises InputError for a key that is not there or holds no number, and for a range that does not hold the start.
    """
    key, equals, span = (piece.strip() for piece in parameter_text.partition("="))
    start, low, high = scene_value(scene, key)
    if equals:
        low, high = _limits_of_range(key, span)
    return IdentifiedParameter(key, start, low, high)


def _limits_of_range(scene_key: str, range_text: str) -> tuple[float, float]:
    """The two numbers in text LOW:HIGH; either may be infinite."""
    try:
        low, high = (float(end) for end in range_text.split(":"))
    except ValueError:
        raise InputError(
            PARAMETERS_OPTION_NAME, scene_key, range_text, "a range reads KEY=LOW:HIGH, two numbers"
        ) from None
    if np.isnan(low) or np.isnan(high):
        raise InputError(
            PARAMETERS_OPTION_NAME, scene_key, range_text, "a range reads KEY=LOW:HIGH: both must be numbers"
        )
    if not low < high:
        raise InputError(
            PARAMETERS_OPTION_NAME, scene_key, range_text, "a range reads KEY=LOW:HIGH: LOW must be below HIGH"
        )
    return low, high


def scene_value(scene: Any, scene_key: str) -> tuple[float, float, float]:
    """Value of a scene at a dotted key, and the smallest and the largest value that this key allows."""
    container: Any = scene
    *tables, last_key = scene_key.split(".")
    for table in tables:
        container = _value_at_key(container, table, scene_key)
    value = _value_at_key(container, last_key, scene_key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(
            PARAMETERS_OPTION_NAME, scene_key, None, "holds no number: a parameter is a number of the scene"
        )
    field = type(container).model_fields.get(last_key) if isinstance(container, BaseModel) else None
    limits = field.metadata if field is not None else []
    low = max((float(limit_end) for limit in limits for limit_end in _limit_ends(limit, "gt", "ge")), default=-np.inf)
    high = min((float(limit_end) for limit in limits for limit_end in _limit_ends(limit, "lt", "le")), default=np.inf)
    return float(value), low, high


def _limit_ends(field_limit: Any, *limit_names: str) -> list[float]:
    """Ends of a pydantic field's limit with these names; none for the general limit on all quantities."""
    ends = (getattr(field_limit, name, None) for name in limit_names)
    return [end for end in ends if end is not None and abs(end) < LARGEST_QUANTITY]


def _value_at_key(container: Any, key_name: str, dotted_key: str) -> Any:
    """Value at one key of a table, list or model; raises InputError if there is none."""
    if isinstance(container, list) and key_name.isdecimal() and int(key_name) < len(container):
        return container[int(key_name)]
    if isinstance(container, Mapping) and key_name in container:
        return container[key_name]
    if isinstance(container, BaseModel) and key_name in type(container).model_fields:
        return getattr(container, key_name)
    names = _key_names(container)
    if isinstance(container, Mapping) and not suggestion_phrase(key_name, names):
        raise InputError(
            PARAMETERS_OPTION_NAME,
            dotted_key,
            None,
            f"is not in the scene: --set {dotted_key}=VALUE gives it a value to start from",
        )
    raise InputError(
        PARAMETERS_OPTION_NAME, dotted_key, None, f"is no key of the scene: there is no {key_name!r}", names
    )


def _key_names(container: Any) -> tuple[str, ...]:
    """Names of the keys of a table or model."""
    if isinstance(container, BaseModel):
        return tuple(name for name, field in type(container).model_fields.items() if not field.exclude)
    return tuple(map(str, container)) if isinstance(container, Mapping) else ()


class SceneModel:
    """Model of a scene for identification: its channels over time as a function of the values of some keys, computed by
    an engine.

    table, file, folder : of the scene; scene_keys : of the parameters; engine : name of the engine.
    """

    def __init__(self, scene: Any, scene_keys: Sequence[str], engine: str) -> None:
        self.table, self.file, self.folder = scene.table(), scene.file, Path(scene.folder)
        self.keys, self.engine = tuple(scene_keys), engine
        self.run_of = import_module(f"{SYSTEMS[scene.system].package}.run").run

    def scene(self, parameter_values: np.ndarray) -> Any:
        """The scene with the given parameter values (p,)."""
        table = copy.deepcopy(self.table)
        for key, value in zip(self.keys, parameter_values, strict=True):
            set_key(table, key, float(value))
        return scene_of_table(table, self.file, self.folder)

    def result(self, parameter_values: np.ndarray) -> Result:
        """Result of the run of the scene with the given parameter values (p,)."""
        return self.run_of(self.scene(parameter_values), self.engine)

    def __call__(self, parameter_values: np.ndarray) -> dict[str, TimeCurve]:
        """Channels over time, by name, for the given parameter values (p,)."""
        return {
            name: (times, row) for name, (_, times, row) in channels_over_time(self.result(parameter_values)).items()
        }


def channels_over_time(run: Result) -> dict[str, tuple[str, np.ndarray, np.ndarray]]:
    """Unit, times and values of every channel of a result over time; each row of an array channel becomes a channel
    with the row's label."""
    answer = dict[str, tuple[str, np.ndarray, np.ndarray]]()
    for name, channel in run.data.data_vars.items():
        if "time" not in channel.dims or channel.dtype.kind not in "fiu":
            continue
        other_dims = [dim for dim in channel.dims if dim != "time"]
        times, unit = run.times, str(channel.attrs.get("units", ""))
        for index in np.ndindex(*(channel.sizes[dim] for dim in other_dims)):
            index_by_dim = dict(zip(other_dims, index, strict=True))
            labels = [
                str(channel[dim].values[i]) if dim in channel.coords else f"{dim} {i}"
                for dim, i in index_by_dim.items()
            ]
            answer[", ".join((str(name), *labels))] = unit, times, channel.isel(index_by_dim).values.astype(float)
    return answer


def _check_channel_names(scene: Any, measurement_path: str | Path, engine: str) -> None:
    """Raise InputError early if no channel of the measurement has the name of a channel of the run. A shorter run gives
    the names; if the scene has no duration, nothing is checked."""
    source, table = open_source(measurement_path), scene.table()
    duration = table.get("run", {}).get("duration")
    if not isinstance(duration, int | float):
        return
    set_key(table, "run.duration", duration / TRIAL_RUN_SHARE)
    try:
        short = scene_of_table(table, scene.file, Path(scene.folder))
        names = channels_over_time(import_module(f"{SYSTEMS[scene.system].package}.run").run(short, engine))
    except (InputError, RunFailed):
        return
    _channels_with_names(source, measurement_path, tuple(names))


def _channels_with_names(
    measurement_source: MeasurementSource, measurement_path: str | Path, channel_names: tuple[str, ...]
) -> list[str]:
    """Names of the channels of a measurement that are among ``channel_names``; InputError if there are none."""
    named = [channel.name for channel in measurement_source.channels if channel.name in channel_names]
    if not named:
        theirs = [channel.name for channel in measurement_source.channels]
        raise InputError(
            measurement_path,
            "",
            theirs[0] if theirs else None,
            "no channel has the name of one of the run",
            channel_names,
        )
    return named


def measured_curves(measurement_path: str | Path, unit_of_channel: Mapping[str, str]) -> dict[str, TimeCurve]:
    """Times and values, by channel name, of the channels of a measurement whose names are keys of ``unit_of_channel``,
    converted to the units given there.

    Raises InputError where there is none, for a unit that does not fit, and for times that go back.
    """
    source = open_source(measurement_path)
    named = _channels_with_names(source, measurement_path, tuple(unit_of_channel))
    return {name: channel_curve(source, name, unit_of_channel[name]) for name in named}


def identification_problem_of(
    scene: Any,
    measurement_path: str | Path,
    parameter_texts: Sequence[str],
    engine: str = "",
    low_pass_edge: float = 0.0,
) -> IdentificationProblem:
    """Identification problem of a scene: ``parameter_texts`` as KEY or KEY=LOW:HIGH, and the channels of the
    measurement that have names of the run's channels.

    low_pass_edge : Hz, of model and measurement alike, without phase; 0 for none. Times of both are the same clock.
    """
    parameters_of_scene = [parameter_of_scene(scene, text) for text in parameter_texts]
    for i, parameter in enumerate(parameters_of_scene):
        if parameter.name in [earlier.name for earlier in parameters_of_scene[:i]]:
            raise InputError(PARAMETERS_OPTION_NAME, parameter.name, None, "is named twice")
    model = SceneModel(scene, [parameter.name for parameter in parameters_of_scene], engine)
    _check_channel_names(scene, measurement_path, engine)
    first = channels_over_time(model.result(np.array([parameter.start for parameter in parameters_of_scene])))
    read = measured_curves(measurement_path, {name: unit for name, (unit, _, _) in first.items()})
    clock = _shared_clock(
        [first[name][1] for name in read], [times for times, _ in read.values()], low_pass_edge, measurement_path
    )
    channels: list[ChannelOnClock] = [
        measured_channel(name, first[name][0], samples, clock, str(measurement_path)) for name, samples in read.items()
    ]
    return IdentificationProblem(model, parameters_of_scene, channels, clock)


def _shared_clock(
    run_times: list[np.ndarray], measured_times: list[np.ndarray], low_pass_edge: float, measurement_path: str | Path
) -> FitClock:
    """Time grid in the interval shared by the run and all measured channels; its step is the shortest in the
    measurement."""
    begin = max(float(times[0]) for times in (*run_times, *measured_times))
    end = min(float(times[-1]) for times in (*run_times, *measured_times))
    period = min(float(np.median(np.diff(times))) for times in measured_times)
    if not end - begin >= 8.0 * period:
        allowed = f"run and measurement share no time: the run goes from {run_times[0][0]:g} to {run_times[0][-1]:g} s"
        raise InputError(measurement_path, "time", [float(measured_times[0][0]), float(measured_times[0][-1])], allowed)
    if low_pass_edge and not 0.0 < low_pass_edge < 0.5 / period:
        allowed = f"must be below {0.5 / period:g} Hz, half the sampling rate of the measurement, or 0 for none"
        raise InputError("--low-pass", "", low_pass_edge, allowed)
    return FitClock(begin + period * np.arange(int((end - begin) / period + 1e-6) + 1), low_pass_edge)
