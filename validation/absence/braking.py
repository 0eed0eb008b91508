"""Braking: what a scene does not name is not imported, not compiled, has no state and nothing in the loop.

One fresh process runs a bare scene while what it does without cannot be imported at all, then the same scene with one
effect after the other, each a positive control: it must change the counts by what it declares. Last comes the bare
scene again, with everything loaded, and must give the same path to the last bit. Two absences are none of code: a
brake without hysteresis runs the same torque law with its two lines on each other, and a chamber without dynamics the
same law with time constants of none.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any
from unittest import mock

from validation.rows import Row, System, at_most, behaves

SYSTEM: System = "effects"
FOREIGN = ("models.braking.relaxation", "models.engines", "exudyn", "mujoco", "fmpy")
"""What a bare scene does without, although all of it is part of twinrig or may be installed."""
STOP = "stop"
BARE: dict[str, Any] = {"title": "bare", "system": "braking", "road": {"stretches": [{"left": "snow"}]},
                        "procedures": {STOP: {"kind": "j_turn", "speed": 3.0, "steer": 0.02}},
                        "controller": {"kind": "slip_bang_bang"}}  # fmt: skip
AXLE = {"track": 1.8, "radius": 0.5, "spin_inertia": 27.0, "roll_share": 0.5}
TRAILER = {"mass": 4500.0, "yaw_inertia": 15000.0, "height": 1.2, "drawbar": 2.5, "drawbar_mass": 700.0,
           "drawbar_inertia": 500.0, "front": {"x": 2.0, **AXLE}, "rear": {"x": -2.0, **AXLE}}  # fmt: skip
EFFECTS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "relaxation": ({"relaxation": {"front": 0.3, "rear": 0.3}},
                   {"imported": ["models.braking.relaxation"], "compiled": ["models.braking.relaxation"], "lags": 4}),
    "trailer": ({"trailer": TRAILER}, {"coordinates": 5, "wheels": 8}),
    "load transfer": ({"load_transfer": {}}, {"moving loads": 4}),
    "pressure dynamics": ({"pressure": {}}, {"time constants": 8}),
    "delay of valves": ({"pressure": {"delay": 0.011}}, {"time constants": 8, "kept commands": 8}),
    "reservoir": ({"pressure": {"reservoir": 40.0}}, {"time constants": 8, "volumes": 4}),
    "hysteresis": ({"brakes": {"front": {"gradient": 1500.0, "push_out": 0.75, "release": 0.5}}}, {"loops": 2}),
    "port": ({"port": {}}, {"asked": "Asked SlipBangBang"}),
    "conversion of signals": ({"port": {"signals": {"bits": 10, "range": 40.0}}},
                              {"asked": "Sensed Asked SlipBangBang"}),
    "faults": ({"port": {"faults": [{"kind": "lost", "end": 0.1}]}}, {"asked": "Faulty Asked SlipBangBang"}),
}  # fmt: skip
"""Effect -> what the scene says of it, and the counts that it must change with what they must become."""
ALONE: dict[str, Any] = {
    "imported": [], "compiled": [], "coordinates": 3, "wheels": 4, "lags": 0, "moving loads": 0, "time constants": 0,
    "kept commands": 0, "volumes": 0, "loops": 0, "asked": "SlipBangBang",
}  # fmt: skip
"""Counts of the bare scene; an effect changes none but those that it declares."""


def probed() -> dict[str, Any]:
    """To be run in a fresh process: counts of the bare scene, of each effect, of an engine, and both bare paths."""
    with _unimportable():
        bare, path = counted({})
    found = {name: counted(says)[0] for name, (says, _) in EFFECTS.items()}
    engine, _ = counted({}, "exudyn")
    return {"bare": bare, "effects": found, "engine": engine["imported"], "same": path == counted({})[1]}


@contextmanager
def _unimportable() -> Iterator[None]:
    """As if the files of FOREIGN had been removed."""
    assert not _loaded(), "the process is not fresh"
    blocked: dict[str, Any] = dict.fromkeys(FOREIGN)
    sys.modules.update(blocked)
    yield
    for name in FOREIGN:
        del sys.modules[name]


def counted(says: dict[str, Any], engine: str = "reference") -> tuple[dict[str, Any], bytes]:
    """Counts and path of the scene with what is said besides."""
    from models.braking.procedures import drive
    from models.braking.run import Braked
    from models.braking.scene import build

    seen, run, before, compiled = dict[str, Any](), Braked.run, _loaded(), _compiled()

    def watched(vehicle: Braked, controller: Any, *more: Any) -> Any:
        seen.update(_counts(vehicle, controller))
        return run(vehicle, controller, *more)

    with mock.patch.object(Braked, "run", watched):
        path = drive(build({**BARE, **says}), STOP, engine)
    seen["imported"] = [name for name in _loaded() if name not in before]
    seen["compiled"] = [name for name in _compiled() if name not in compiled]
    return seen, path.states.tobytes()


def _loaded() -> list[str]:
    """Modules of FOREIGN that are there, by the name in FOREIGN that they belong to."""
    there = [name for name, module in sys.modules.items() if module is not None]
    return [name for name in FOREIGN if any(one == name or one.startswith(f"{name}.") for one in there)]


def _compiled() -> list[str]:
    """Modules of FOREIGN that have a compiled function with a signature: compiled, or loaded from disk."""
    return [name for name in _loaded()
            if any(getattr(one, "signatures", None) for one in vars(sys.modules[name]).values())]  # fmt: skip


def changes(bare: dict[str, Any], found: dict[str, Any]) -> dict[str, Any]:
    """Counts that are not those of the bare scene."""
    return {key: value for key, value in found.items() if value != bare[key]}


def _counts(vehicle: Any, controller: Any) -> dict[str, Any]:
    """What a run is made of."""
    from models.braking.pressure import still

    plane, brakes, chambers = vehicle.plane, vehicle.brakes, vehicle.chambers
    chain = [controller]
    while hasattr(chain[-1], "inner"):
        chain.append(chain[-1].inner)
    return {
        "coordinates": 2 + plane.masses.size, "wheels": plane.wheels,
        "lags": 0 if vehicle.relaxation is None else vehicle.relaxation.size,
        "moving loads": int(((plane.by_x != 0.0) | (plane.by_y != 0.0)).sum()),
        "time constants": int((chambers.fill > 0.0).sum() + (chambers.empty > 0.0).sum()),
        "kept commands": (len(still(chambers, vehicle.sample).commands) - 2) * plane.wheels,
        "volumes": chambers.volumes.size,
        "loops": int(((brakes.release != brakes.push_out) | (brakes.falling != brakes.rising)).sum()),
        "asked": " ".join(type(one).__name__ for one in chain),
    }  # fmt: skip


@cache
def found() -> dict[str, Any]:
    """``probed`` from a process of its own."""
    code = "import json; from validation.absence.braking import probed; print(json.dumps(probed()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def rows() -> list[Row]:
    """Absence, and a positive control for every effect."""
    seen = found()
    bare = seen["bare"]
    why = "counted in a fresh process, in what was handed to the run"
    return [
        at_most("absent.braking.imports", SYSTEM, "modules of lagging tyres, of engines and of FMUs that a bare "
                "braking scene imports or compiles", len(bare["imported"]) + len(bare["compiled"]), "", 0,
                "none of them could have been imported meanwhile", "none"),
        behaves("absent.braking.bare", SYSTEM, "what a bare braking scene is made of", _text(bare), _text(ALONE), why),
        behaves("absent.braking.same", SYSTEM, "path of the bare scene, once while these files could not be imported, "
                "once after all effects ran", "the same" if seen["same"] else "not the same", "the same",
                "to the last bit"),
        behaves("absent.braking.engine", SYSTEM, "what the bare scene imports by Exudyn", _text(seen["engine"]),
                "exudyn, models.engines", "positive control"),
        *(behaves(f"absent.braking.{name.replace(' ', '-')}", SYSTEM, f"what {name} changes",
                  _text(changes(bare, seen["effects"][name])), _text(declared), "positive control: this and no more")
          for name, (_, declared) in EFFECTS.items()),
    ]  # fmt: skip


def _text(given: Any) -> str:
    if isinstance(given, dict):
        return "; ".join(f"{key} {_text(given[key])}" for key in sorted(given))
    return ", ".join(sorted(given)) if isinstance(given, list) else str(given)
