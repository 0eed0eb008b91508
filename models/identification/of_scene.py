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
from models.identification.problem import ChannelOnClock, Curve, FitClock, Parameter, Problem, measured_channel
from models.measured.channel import Source
from models.measured.curve import channel_curve
from models.measured.formats import open_source

PARAMETERS_OPTION = "--parameters"
TRIAL_RUN_FRACTION = 50.0
"""Ratio of the scene's duration to that of the short run that gives the names of its channels."""


def parameter_of_scene(scene: Any, text: str) -> Parameter:
    """Parameter from text KEY or KEY=LOW:HIGH; its start is the scene's value, and without a range its bounds are the
    limits of the scene's key.

    Raises InputError for a key that is not there or holds no number, and for a range that does not hold the start.
    """
    key, equals, span = (piece.strip() for piece in text.partition("="))
    start, low, high = scene_value(scene, key)
    if equals:
        low, high = _low_and_high(key, span)
    return Parameter(key, start, low, high)


def _low_and_high(key: str, span: str) -> tuple[float, float]:
    """The two numbers in text LOW:HIGH; either may be infinite."""
    try:
        low, high = (float(end) for end in span.split(":"))
    except ValueError:
        raise InputError(PARAMETERS_OPTION, key, span, "a range reads KEY=LOW:HIGH, two numbers") from None
    if np.isnan(low) or np.isnan(high):
        raise InputError(PARAMETERS_OPTION, key, span, "a range reads KEY=LOW:HIGH: both must be numbers")
    if not low < high:
        raise InputError(PARAMETERS_OPTION, key, span, "a range reads KEY=LOW:HIGH: LOW must be below HIGH")
    return low, high


def scene_value(scene: Any, key: str) -> tuple[float, float, float]:
    """Value of a scene at a dotted key, and the smallest and the largest value that this key allows."""
    container: Any = scene
    *tables, last_key = key.split(".")
    for table in tables:
        container = _value_at_key(container, table, key)
    value = _value_at_key(container, last_key, key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(PARAMETERS_OPTION, key, None, "holds no number: a parameter is a number of the scene")
    field = type(container).model_fields.get(last_key) if isinstance(container, BaseModel) else None
    limits = field.metadata if field is not None else []
    low = max((float(limit_end) for limit in limits for limit_end in _limit_ends(limit, "gt", "ge")), default=-np.inf)
    high = min((float(limit_end) for limit in limits for limit_end in _limit_ends(limit, "lt", "le")), default=np.inf)
    return float(value), low, high


def _limit_ends(field_limit: Any, *names: str) -> list[float]:
    """Ends of a pydantic field's limit with these names; none for the general limit on all quantities."""
    ends = (getattr(field_limit, name, None) for name in names)
    return [end for end in ends if end is not None and abs(end) < LARGEST_QUANTITY]


def _value_at_key(container: Any, name: str, key: str) -> Any:
    """Value at one key of a table, list or model; raises InputError if there is none."""
    if isinstance(container, list) and name.isdecimal() and int(name) < len(container):
        return container[int(name)]
    if isinstance(container, Mapping) and name in container:
        return container[name]
    if isinstance(container, BaseModel) and name in type(container).model_fields:
        return getattr(container, name)
    names = _key_names(container)
    if isinstance(container, Mapping) and not suggestion_phrase(name, names):
        raise InputError(
            PARAMETERS_OPTION, key, None, f"is not in the scene: --set {key}=VALUE gives it a value to start from"
        )
    raise InputError(PARAMETERS_OPTION, key, None, f"is no key of the scene: there is no {name!r}", names)


def _key_names(container: Any) -> tuple[str, ...]:
    """Names of the keys of a table or model."""
    if isinstance(container, BaseModel):
        return tuple(name for name, field in type(container).model_fields.items() if not field.exclude)
    return tuple(map(str, container)) if isinstance(container, Mapping) else ()


class SceneModel:
    """Model of a scene for identification: its channels over time as a function of the values of some keys, computed by
    an engine.

    table, file, folder : of the scene; keys : scene keys of the parameters; engine : name of the engine.
    """

    def __init__(self, scene: Any, keys: Sequence[str], engine: str) -> None:
        self.table, self.file, self.folder = scene.table(), scene.file, Path(scene.folder)
        self.keys, self.engine = tuple(keys), engine
        self.run_of = import_module(f"{SYSTEMS[scene.system].package}.run").run

    def scene(self, values: np.ndarray) -> Any:
        """The scene with the given parameter values (p,)."""
        table = copy.deepcopy(self.table)
        for key, value in zip(self.keys, values, strict=True):
            set_key(table, key, float(value))
        return scene_of_table(table, self.file, self.folder)

    def result(self, values: np.ndarray) -> Result:
        """Result of the run of the scene with the given parameter values (p,)."""
        return self.run_of(self.scene(values), self.engine)

    def __call__(self, values: np.ndarray) -> dict[str, Curve]:
        """Channels over time, by name, for the given parameter values (p,)."""
        return {name: (times, row) for name, (_, times, row) in channels_over_time(self.result(values)).items()}


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


def _check_channel_names(scene: Any, measurement: str | Path, engine: str) -> None:
    """Raise InputError early if no channel of the measurement has the name of a channel of the run. A shorter run gives
    the names; if the scene has no duration, nothing is checked."""
    source, table = open_source(measurement), scene.table()
    duration = table.get("run", {}).get("duration")
    if not isinstance(duration, int | float):
        return
    set_key(table, "run.duration", duration / TRIAL_RUN_FRACTION)
    try:
        short = scene_of_table(table, scene.file, Path(scene.folder))
        names = channels_over_time(import_module(f"{SYSTEMS[scene.system].package}.run").run(short, engine))
    except (InputError, RunFailed):
        return
    _channels_with_names(source, measurement, tuple(names))


def _channels_with_names(measurement_source: Source, path: str | Path, names: tuple[str, ...]) -> list[str]:
    """Names of the channels of a measurement that are among ``names``; InputError if there are none."""
    named = [channel.name for channel in measurement_source.channels if channel.name in names]
    if not named:
        theirs = [channel.name for channel in measurement_source.channels]
        raise InputError(path, "", theirs[0] if theirs else None, "no channel has the name of one of the run", names)
    return named


def measured_curves(path: str | Path, units: Mapping[str, str]) -> dict[str, Curve]:
    """Times and values, by channel name, of the channels of a measurement whose names are keys of ``units``, converted
    to the units given there.

    Raises InputError where there is none, for a unit that does not fit, and for times that go back.
    """
    source = open_source(path)
    named = _channels_with_names(source, path, tuple(units))
    return {name: channel_curve(source, name, units[name]) for name in named}


def problem_of(
    scene: Any, measurement: str | Path, parameters: Sequence[str], engine: str = "", low_pass: float = 0.0
) -> Problem:
    """Identification problem of a scene: ``parameters`` as KEY or KEY=LOW:HIGH, and the channels of the measurement
    that have names of the run's channels.

    low_pass : Hz, of model and measurement alike, without phase; 0 for none. Times of both are the same clock.
    """
    parameters_of_scene = [parameter_of_scene(scene, text) for text in parameters]
    for i, parameter in enumerate(parameters_of_scene):
        if parameter.name in [earlier.name for earlier in parameters_of_scene[:i]]:
            raise InputError(PARAMETERS_OPTION, parameter.name, None, "is named twice")
    model = SceneModel(scene, [parameter.name for parameter in parameters_of_scene], engine)
    _check_channel_names(scene, measurement, engine)
    first = channels_over_time(model.result(np.array([parameter.start for parameter in parameters_of_scene])))
    read = measured_curves(measurement, {name: unit for name, (unit, _, _) in first.items()})
    clock = _shared_clock(
        [first[name][1] for name in read], [times for times, _ in read.values()], low_pass, measurement
    )
    channels: list[ChannelOnClock] = [
        measured_channel(name, first[name][0], samples, clock, str(measurement)) for name, samples in read.items()
    ]
    return Problem(model, parameters_of_scene, channels, clock)


def _shared_clock(
    run_times: list[np.ndarray], measured_times: list[np.ndarray], low_pass: float, measurement: str | Path
) -> FitClock:
    """Time grid in the interval shared by the run and all measured channels; its step is the shortest in the
    measurement."""
    begin = max(float(times[0]) for times in (*run_times, *measured_times))
    end = min(float(times[-1]) for times in (*run_times, *measured_times))
    period = min(float(np.median(np.diff(times))) for times in measured_times)
    if not end - begin >= 8.0 * period:
        allowed = f"run and measurement share no time: the run goes from {run_times[0][0]:g} to {run_times[0][-1]:g} s"
        raise InputError(measurement, "time", [float(measured_times[0][0]), float(measured_times[0][-1])], allowed)
    if low_pass and not 0.0 < low_pass < 0.5 / period:
        allowed = f"must be below {0.5 / period:g} Hz, half the sampling rate of the measurement, or 0 for none"
        raise InputError("--low-pass", "", low_pass, allowed)
    return FitClock(begin + period * np.arange(int((end - begin) / period + 1e-6) + 1), low_pass)
