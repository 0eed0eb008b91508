"""Price of accuracy of a user's pitch-plane scene: the methods, steps and tolerances of its engines."""

import math
from dataclasses import dataclass, replace

import numpy as np

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.problem import Setting
from models.core.errors import InputError
from models.core.result import Result
from models.core.steps import step_divides
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES, UNAVAILABLE_INTEGRATORS
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import Scene, assembly_of_scene

ADAPTIVE_STEP = {"exudyn": 5e-3, "reference": 1e-3}
"""Largest step (s) of Exudyn's adaptive solvers, with which they also begin, and spacing (s) of scipy's output."""
SPECTRAL_RADII = {"GeneralizedAlpha 0.9": 0.9, "GeneralizedAlpha 0.6": 0.6}
"""Spectral radii of the generalised-alpha method that are tried, by the name of the method."""

SEARCHED_DURATION = 2.0
"""Longest part (s) of a run over which settings are searched; the recommended ones are confirmed over all of it."""
STEPS_TRIED = tuple(
    mantissa * 10.0**power
    for power in (-2, -3, -4, -5, -6)
    for mantissa in (10.0, 8.0, 6.25, 5.0, 4.0, 3.2, 2.5, 2.0, 1.6, 1.25)
)[5:]
"""Steps (s) that are tried, each shortened to a whole fraction of the run's base step."""
TOLERANCES_TRIED = tuple(10.0**-k for k in range(2, 13))
DEFAULT_OF_METHOD = {("exudyn", "GeneralizedAlpha 0.9"): 1e-2, ("mujoco", "Euler"): 2e-3}
"""Default steps (s) of the engines: Exudyn takes 100 steps in 1 s, MuJoCo a timestep of 2 ms."""
USUAL_QUANTITY = {
    "free": "f1,f2",
    "road": "f1,f2",
    "force": "pitch",
    "force-body": "pitch",
    "pitch": "enforced_moment",
    "heave-pitch": "enforced_force",
}
"""Quantity that is priced where the user names none, by the vehicle's input."""
SENSOR_EFFECTS = frozenset({"accelerometers", "gyro", "gyro_bias", "pitch_sensor"})
"""Effects that only read the motion: they are left out, since otherwise no step could be tried that misses a sampling
time.
"""
FEWEST_ROWS = 4
"""Least number of reference rows between which other times are interpolated."""
ROW_SPACING = 1e-3
"""Spacing (s) of the output rows of an adaptive method of an engine from outside the project."""
SECOND_SOLVER_TOLERANCE = 1e-10
"""Relative tolerance of the second solver, a multistep method that checks the reference's Runge-Kutta method."""


@dataclass(frozen=True)
class PricedPitchPlane:
    """A pitch-plane scene as a priced scene, see ``models.advice.price.PricedScene``. channels : of the quantity;
    base_step : step (s) whose whole fractions all divide the run and its samples.
    """

    assembly: Assembly
    engines: tuple[str, ...]
    channels: tuple[str, ...]
    unit: str
    base_step: float
    searched_duration: float

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.assembly.scene.title

    @property
    def quantity(self) -> str:
        """Channels to which the tolerance applies, as text."""
        return " and ".join(self.channels)

    @property
    def full_duration(self) -> float:
        """Duration (s) of the scene's run."""
        return self.assembly.scene.run.duration

    @property
    def has_sampled_input(self) -> bool:
        """Whether the input has kinks or jumps at its sampling times."""
        signal = self.assembly.input
        return signal is not None and signal.period is not None and len(signal.knots(self.full_duration)) > 0

    @property
    def kink_period(self) -> float:
        """Sampling period (s) of an input that is not smooth at its samples; 0 for a smooth input."""
        return self.base_step if self.has_sampled_input else 0.0

    @property
    def note(self) -> str:
        """Text on which methods the price leaves out."""
        return "adaptive methods are left out: they restart at every sample" if self.has_sampled_input else ""

    @property
    def work_count_name(self) -> str:
        """Name of the count that measures the work: force calls, for every method."""
        return "force calls"

    def setting_ladders(self) -> list[SettingLadder]:
        """Ladders of settings for every method of the engines; generalised-alpha with Exudyn's default spectral radius
        and with the recommended one.
        """
        ladders = []
        for engine in self.engines:
            for name, known in CATALOGUE[engine].items():
                adaptive = known.adaptive or getattr(OUTSIDE_CLASSES.get(engine), "adaptive", False)
                if known.adaptive and self.has_sampled_input and (engine, name) not in UNAVAILABLE_INTEGRATORS:
                    continue
                for method in [m for m in SPECTRAL_RADII if m.startswith(name)] or [name]:
                    values = TOLERANCES_TRIED if adaptive else self._steps()
                    values = values[:1] if (engine, name) in UNAVAILABLE_INTEGRATORS else values
                    order = 0 if adaptive else known.order
                    default = DEFAULT_OF_METHOD.get((engine, method), 0.0)
                    ladders.append(SettingLadder(engine, method, values, order, adaptive, default))
        return ladders

    def reference_ladder(self) -> SettingLadder:
        """Ladder of the reference: RK4 on the hand-written equations of motion; each step is half the previous one."""
        fewest_steps = math.ceil((FEWEST_ROWS - 1) * self.base_step / self.searched_duration * (1 - 1e-9))
        coarsest_steps = max(fewest_steps, math.ceil(self.base_step / 4e-3 * (1 - 1e-9)))
        return SettingLadder("reference", "RK4", tuple(self.base_step / coarsest_steps / 2**k for k in range(16)), 4)

    def second_setting(self, reference_setting: Setting) -> Setting | None:
        """LSODA as the setting that checks the reference; None where it would restart at every sample."""
        return (
            None if self.has_sampled_input else Setting("reference", "LSODA", SECOND_SOLVER_TOLERANCE, 0, adaptive=True)
        )

    def solve(self, setting: Setting, duration: float) -> Result:
        """The result of a run with a solver setting, with an output row at every step."""
        return self.run(setting.engine, self._engine_settings(setting, duration))

    def run(self, engine: str, settings: Settings) -> Result:
        """The result of the scene in an engine with these solver settings, with an output row at every step."""
        scene: Scene = self.assembly.scene
        every_step = scene.model_copy(update={"run": scene.run.model_copy(update={"output_step": None})})
        return run(every_step, engine, settings, self.assembly)

    def priced_run(self, solution: Result) -> PricedRun:
        """The quantity's channels along a run."""
        return PricedRun(solution.times, np.column_stack([solution[name] for name in self.channels]), solution.counts())

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that select the solver setting."""
        if setting.engine in OUTSIDE_CLASSES:
            return _outside_engine_lines(setting)
        name, (_, _, radius) = setting.method.split()[0], setting.method.partition(" ")
        setting_line = f"tolerance = {setting.value:.4g}" if setting.adaptive else f"step = {setting.value!r}"
        return [
            f"[engines.{setting.engine}]",
            f'integrator = "{name}"',
            setting_line,
            *([f"spectral_radius = {radius}"] if radius else []),
        ]

    def _engine_settings(self, setting: Setting, duration: float) -> Settings:
        if not setting.adaptive:
            return engine_settings(setting, duration)
        signal = self.assembly.input
        longest = min(ADAPTIVE_STEP.get(setting.engine, ROW_SPACING), signal.resolution if signal is not None else 1.0)
        return Settings(setting.method, duration / math.ceil(duration / longest * (1 - 1e-9)), duration, setting.value)

    def _steps(self) -> tuple[float, ...]:
        """Steps (s) to try, from coarse to fine, all whole fractions of ``base_step``."""
        parts = np.unique(np.ceil(self.base_step / np.array(STEPS_TRIED) * (1 - 1e-9)).astype(int))
        return tuple(self.base_step / int(k) for k in parts)


def _outside_engine_lines(setting: Setting) -> list[str]:
    """Text lines that select a setting of an engine from outside the project, which a scene file cannot name."""
    command_line = f"# twinrig run SCENE --engine {setting.engine}"
    return (
        [command_line, f"# with the {setting.label()} in the class itself"]
        if setting.adaptive
        else ["[run]", f"step = {setting.value!r}", command_line]
    )


def priced_scene(scene: Scene, quantity: str | None, engines: tuple[str, ...]) -> PricedPitchPlane:
    """The pitch-plane scene with a quantity to price: channels of its result that share a unit, separated by commas."""
    assembly = assembly_of_scene(_without_sensors(scene))
    channels = tuple(name.strip() for name in (quantity or USUAL_QUANTITY[assembly.mode]).split(","))
    base, first = _base_step_and_duration(assembly)
    priced = PricedPitchPlane(assembly, engines, channels, "", base, first)
    return replace(priced, unit=_common_unit(priced))


def _without_sensors(scene: Scene) -> Scene:
    """The pitch-plane scene without its sensor effects."""
    moving = {name: parameters for name, parameters in scene.effects.items() if name not in SENSOR_EFFECTS}
    return scene.model_copy(update={"effects": moving})


def _base_step_and_duration(assembly: Assembly) -> tuple[float, float]:
    """Step (s) whose whole fractions divide the run and its samples, and the duration (s) of the part that is
    searched.
    """
    length, step = assembly.scene.run.duration, assembly.scene.run.step
    sampled = (signal for signal in (assembly.input, assembly.moment) if signal is not None)
    period = next((signal.period for signal in sampled if signal.period is not None), None)
    if period is None:
        first = length / math.ceil(length / SEARCHED_DURATION * (1 - 1e-9))
        return first, first
    divides_evenly = step_divides(period, length)
    base = period if divides_evenly else step * math.gcd(round(length / step), round(period / step))
    return base, min(length, base * math.ceil(SEARCHED_DURATION / base * (1 - 1e-9)))


def _common_unit(priced: PricedPitchPlane) -> str:
    """The common unit of the priced channels; InputError for an unknown channel, or several units."""
    longest = float(priced.assembly.scene.settings("reference").step or priced.base_step)
    settings = Settings("RK4", priced.base_step / math.ceil(priced.base_step / longest * (1 - 1e-9)), priced.base_step)
    channels = priced.run("reference", settings).data.data_vars
    for name in priced.channels:
        if name not in channels:
            raise InputError("--quantity", "", name, "is no channel of this scene", tuple(map(str, channels)))
    units = list(dict.fromkeys(channels[name].attrs["units"] for name in priced.channels))
    if len(units) > 1:
        allowed = f"has several units, {' and '.join(units)}: one tolerance cannot hold for all"
        raise InputError("--quantity", "", ",".join(priced.channels), allowed)
    return units[0]


def engine_settings(setting: Setting, duration: float) -> Settings:
    """The solver setting for a run of ``duration`` (s), in the form that engines use."""
    integrator = setting.method.split()[0]
    radius = SPECTRAL_RADII.get(setting.method, 0.6)
    if setting.adaptive:
        return Settings(integrator, ADAPTIVE_STEP[setting.engine], duration, setting.value, radius)
    return Settings(integrator, setting.value, duration, spectral_radius=radius)
