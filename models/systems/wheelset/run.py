"""What is computed of a scene of a wheelset: paths, its linearisation over the speeds, the branch of limit cycles."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Channel, Result, joined, result
from models.rail import wheel_forces as wf
from models.rail.doubts import doubts
from models.rail.eigenvalues import growth, hunting, locus, wavelength
from models.rail.equations import ROLL, SPIN, YAW, Path, Y, Z
from models.rail.limit_cycle import Orbit, attained, beside, bifurcation, refined, solved
from models.rail.linear import NoCriticalSpeed, critical_or_why
from models.systems.wheelset.of_scene import BESIDE, equations_of, implementation, path_speeds, started, wheelset_of
from models.systems.wheelset.scene import WheelsetScene

STATES = {"y": (Y, "m"), "z": (Z, "m"), "roll": (ROLL, "rad"), "yaw": (YAW, "rad"), "spin": (SPIN, "rad/s")}
CONTACTS = {
    "normal": (wf.LOAD, "N"),
    "fx": (wf.FX, "N"),
    "fy": (wf.FY, "N"),
    "mz": (wf.MZ, "N m"),
    "power": (wf.POWER, "W"),
}
"""What is saved of every path, with its place and unit."""
ORBIT = {
    "speed": "m/s",
    "amplitude": "m",
    "frequency": "Hz",
    "multiplier": "-",
    "error": "m/s or m",
    "frequency_error": "Hz",
}
"""What is saved of every limit cycle of a branch, with its unit."""


def run(scene: WheelsetScene, engine: str, speed: float | None = None) -> Result:
    """The path at a speed (m/s), the first of the scene's if none is given; the detail is its ``Path``.

    Channels are states over time and forces of the contacts over time and patch. Raises InputError or RunFailed.
    """
    speed = path_speeds(scene)[0] if speed is None else speed
    equations, _ = started(scene, engine, speed)
    begun = time.process_time()
    motion = path(scene, engine, speed)
    seconds = time.process_time() - begun
    return _labelled(scene, engine, motion, seconds=seconds, doubts=doubts(equations, motion))


def path(scene: WheelsetScene, engine: str, speed: float) -> Path:
    """The motion at a speed (m/s) from the scene's displacement and yaw, every step of it, and nothing else."""
    equations, start = started(scene, engine, speed)
    return equations.run(start, scene.run.duration, scene.run.step)


def _labelled(scene: WheelsetScene, engine: str, motion: Path, **more: Any) -> Result:
    steps, times = len(motion.times) - 1, Channel("time", motion.times, "s")
    channels = {name: Channel("time", motion.states[:, k], unit) for name, (k, unit) in STATES.items()}
    channels |= {
        name: Channel(("time", "patch"), motion.contacts[:, :, k], unit) for name, (k, unit) in CONTACTS.items()
    }
    counts = {"steps": steps, "force calls": 4 * steps}
    return result(scene, channels, {"time": times}, engine=engine, counts=counts, detail=motion, **more)


def over_speeds(paths: Mapping[str, Mapping[Any, Result]]) -> Result:
    """Paths by engine and speed (m/s) as one result over engine, speed and time."""
    whole = joined({engine: joined(results, "speed") for engine, results in paths.items()}, "engine")
    whole.data["speed"].attrs["units"] = "m/s"
    return whole


@dataclass(frozen=True, eq=False)
class Linear:
    """Linearised motion: eigenvalues (speeds, 9) in 1/s at speeds (m/s), the free wheelset's wavelength (m), the
    critical speed (m/s), or why there is none."""

    speeds: np.ndarray
    values: np.ndarray
    wavelength: float
    critical: float | None
    why: str

    @property
    def hunting(self) -> np.ndarray:
        """The least damped oscillation's eigenvalue (speeds,) in 1/s."""
        return hunting(self.values)


def linearised(scene: WheelsetScene, engine: str) -> Result:
    """Eigenvalues over the scene's speeds with linear creep; the detail is ``Linear``."""
    kind, wheelset, speeds = implementation(engine), wheelset_of(scene), scene.speeds.all()
    linear = Linear(
        speeds,
        locus(kind, wheelset, speeds),
        wavelength(kind, wheelset),
        *critical_or_why(wheelset, partial(growth, kind)),
    )
    channels = {
        name: Channel(("speed", "eigenvalue"), part, "1/s")
        for name, part in (("real", linear.values.real), ("imag", linear.values.imag))
    }
    return result(scene, channels, {"speed": Channel("speed", speeds, "m/s")}, engine=engine, detail=linear)


def branch(scene: WheelsetScene, told: Callable[[int], Any] = lambda count: None) -> Result:
    """Limit cycles by rising amplitude within the scene's speeds, by the written equations; the detail are its orbits.

    Where no branch begins because nothing is stable, cycles that motions reach at these speeds. Why it ends or never
    begins is a doubt. told : called with the number of cycles after each.
    """
    speeds, orbits, why = scene.speeds.all(), list[Orbit](), list[str]()
    equations = equations_of(scene, "reference", float(speeds[-1]))
    try:
        for orbit in bifurcation(equations, float(speeds.min()), float(speeds.max()), scene.run.step):
            orbits.append(orbit)
            told(len(orbits))
    except NoCriticalSpeed as error:
        why = [f"no branch begins: the wheelset {error.allowed}"]
        reached = (_attained(scene, float(speed)) for speed in speeds) if error.unstable else ()
        orbits = [refined(orbit, "amplitude") for orbit in reached if orbit is not None]
    except RunFailed as error:
        why = [f"the branch is followed no further: {error.reason}"]
    channels = {
        name: Channel("cycle", np.array([getattr(orbit, name) for orbit in orbits]), unit)
        for name, unit in ORBIT.items()
    }
    return result(scene, channels, {}, engine="reference", doubts=why, detail=orbits)


def _attained(scene: WheelsetScene, speed: float) -> Orbit | None:
    return attained(equations_of(scene, "reference", speed), start=scene.run.displacement, step=scene.run.step)


def cycle_speed(scene: WheelsetScene, orbits: Sequence[Orbit]) -> float:
    """A speed (m/s) above that at which the branch begins, the scene's last where there is none."""
    last = float(scene.speeds.all().max())
    return min(last, round(BESIDE[1] * orbits[0].speed, 2)) if orbits else last


def cycles(scene: WheelsetScene, engines: Sequence[str], speed: float) -> tuple[dict[str, Result], dict[str, str]]:
    """One period of the refined limit cycle at a speed (m/s) by every engine, and why some have none.

    Each engine finds it from a guess that is off. The details are the orbits. None of both where the motion dies out.
    """
    results, failed = dict[str, Result](), dict[str, str]()
    first = _attained(scene, speed)
    if first is None:
        return results, failed
    for engine in engines:
        try:
            guess = beside(first, equations_of(scene, engine, speed))
            orbit = refined(solved(guess, "amplitude", precise=False), "amplitude")
        except RunFailed as error:
            failed[engine] = str(error)
            continue
        data = over_speeds({engine: {orbit.speed: _labelled(scene, engine, orbit.path())}}).data
        results[engine] = Result(data, orbit)
    return results, failed
