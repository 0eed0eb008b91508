"""The plan of a recording's scene: printed by ``twinrig show``, checked before any run."""

from collections.abc import Sequence

from models.core.assumptions import assumption_lines
from models.core.errors import InputError
from models.core.finding import Finding
from models.core.finding import finding_lines as finding_texts
from models.core.scene_effects import effect_lines as effect_lines
from models.measured.channel import MeasurementSource
from models.measured.formats import open_source
from models.measured.signal import MeasuredSignal
from models.systems.measured.assumptions import assumptions
from models.systems.measured.channel_map import mapped_signals
from models.systems.measured.scene import MeasuredRig, MeasuredScene
from models.systems.measured.virtual import checked_signals as check_virtual
from models.vehicles.plausible import implausible_values
from models.vehicles.plausible_plane import implausible_plane_values

MISSING_FORCE_TEXT = "no vertical force is mapped at {}: without it the vehicle falls"


def check(scene: MeasuredScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for wrong engines, vehicles, files, channel maps or virtual
    measurements.
    """
    if len(engines) != 1:
        raise InputError("--engine", "", "all", "a recording is run in one engine: name one, or leave it out")
    rig = scene.rig()
    _check_names(scene, rig)
    if scene.virtual is None:
        signals_of_files(scene, opened_files(scene), rig)
    elif rig.vehicle is not None:
        check_virtual(rig.vehicle, scene.virtual, scene.file)


def opened_files(scene: MeasuredScene) -> tuple[MeasurementSource, ...]:
    """Opens the measurement files of a scene; raises InputError."""
    return tuple(open_source(scene.path(file.file, f"files.{i}.file")) for i, file in enumerate(scene.files))


def signals_of_files(
    scene: MeasuredScene, measurement_files: Sequence[MeasurementSource], measured_rig: MeasuredRig
) -> tuple[MeasuredSignal, ...]:
    """Returns the signals of all mapped channels. Raises InputError also where a wheel has no vertical force, or the
    stabiliser no angles.
    """
    signals, method = mapped_signals(scene, measurement_files, measured_rig.places), scene.stabilise.method
    driving = {(s.quantity, s.at, s.component) for s in signals if not s.check}
    for hub in measured_rig.hubs if measured_rig.vehicle else ():
        if ("force", hub, "z") not in driving:
            raise InputError(scene.file, "files", None, MISSING_FORCE_TEXT.format(repr(hub)))
    needed_quantities = {"none": (), "prescribed": ("angle",), "kalman": ("angle", "angular rate")}[method]
    for quantity in needed_quantities:
        for axis in measured_rig.angles:
            if (quantity, measured_rig.chassis, axis) not in driving:
                needed = f"needs the {quantity} {axis!r} of {measured_rig.chassis!r}, which no channel is mapped to"
                raise InputError(scene.file, "stabilise.method", method, f"{needed}: map it, or say 'none'")
    return signals


def _check_names(scene: MeasuredScene, measured_rig: MeasuredRig) -> None:
    bodies = measured_rig.places.bodies
    named_in_scene = [
        *(
            (f"sensors.{name}.body", sensor.body, "the vehicle has no such body", bodies)
            for name, sensor in scene.sensors.items()
        ),
        *(("levers", name, "the vehicle has no such hub", measured_rig.hubs) for name in scene.levers),
        *(
            ("hand_on.sections", name, "the vehicle has no such section", measured_rig.sections)
            for name in scene.hand_on.sections or ()
        ),
    ]
    for key, name, reason, known in named_in_scene:
        if name not in known:
            raise InputError(scene.file, key, name, reason, known)


def findings(scene: MeasuredScene) -> tuple[Finding, ...]:
    """Returns doubts about implausible parameters of the vehicle; the study of the recording reports those about the
    measurement.
    """
    accept, plane = scene.vehicle.accept, scene.plane()
    if plane is not None:
        return implausible_plane_values(plane, accept)
    vehicle = scene.rig().vehicle
    return () if vehicle is None else implausible_values(vehicle.uncut, accept)


def describe(scene: MeasuredScene) -> str:
    """Returns the plan of a recording's scene as text: vehicle, files and channels, runs, output files, assumptions."""
    rig = scene.rig()
    _check_names(scene, rig)
    size = f"{rig.vehicle.size} freedoms, cut at {', '.join(rig.hubs)}" if rig.vehicle else "the pitch plane"
    lines = [
        scene.title,
        _plan_line("scene", f"{scene.file}, study {scene.study}"),
        _plan_line("vehicle", f"{rig.name}: {size}"),
    ]
    virtual, stabilised, handed_on = scene.virtual, scene.stabilise, scene.hand_on
    if virtual is None:
        lines += _file_lines(scene, rig)
    else:
        road = f"{virtual.duration:g} s on ISO 8608 class {virtual.road.iso8608} at {virtual.road.speed:g} m/s"
        text = f"virtually: {road}, {virtual.sampling_rate:g} Hz, as {virtual.format} and back"
        lines.append(_plan_line("measured", text))
    text_of_method = {
        "kalman": f"Kalman filter of roll and pitch, a moment towards it of {stabilised.bandwidth:g} Hz",
        "prescribed": f"measured roll and pitch enforced, smoothed at {stabilised.smoothing:g} Hz",
        "none": "nothing",
    }
    sections, slopes = (
        ", ".join(handed_on.sections or ["every section"]),
        ", ".join(f"{each:g}" for each in handed_on.slopes),
    )
    lines += [
        _plan_line("runs", f"free, and held by: {text_of_method[stabilised.method]}; {scene.run.engine}"),
        _plan_line("hand on", f"{sections}; as {', '.join(handed_on.formats)}; damage of slopes {slopes}"),
    ]
    return "\n".join([*lines, *effect_lines(scene), *assumption_lines(assumptions(scene, rig.vehicle))])


def _file_lines(scene: MeasuredScene, measured_rig: MeasuredRig) -> list[str]:
    """Lines of text on every measurement file and its mapped channels: quantity, place, axes, factor to SI."""
    sources, lines = opened_files(scene), list[str]()
    signals = signals_of_files(scene, sources, measured_rig)
    for source in sources:
        began = f", began {source.start.isoformat(sep=' ')}" if source.start else ""
        lines.append(_plan_line("file", f"{source.path.name}: {len(source.channels)} channels{began}"))
        for s in (s for s in signals if s.file == source.path.name):
            what = f"{s.quantity} {s.component}".strip()
            sign, use = "-" if s.sign < 0 else "", ", only compared with" if s.check else ""
            lines.append(
                _plan_line(
                    "", f"{s.channel:<24} {what} at {s.at}, axes {s.frame}, {sign}{s.factor:g} x [{s.unit}]{use}"
                )
            )
        lines += finding_texts(source.findings)
    return lines


def _plan_line(label: str, text: str) -> str:
    return f"  {label:<10} {text}"
