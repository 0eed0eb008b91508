"""A new effect of every system is one new file: listed, named, computed in every engine, counted, refused, left out."""

from dataclasses import dataclass
from importlib import import_module

import numpy as np
import pytest

from models.errors import InputError
from models.handling.in_engines import driven, unaccounted
from models.handling.numbers import Handling, Push
from models.scene_effects import beside, listing, own_table, rebuilt, without
from models.systems import SYSTEMS
from models.vehicles.vehicle_file import load_vehicle
from validation.absence.of_systems import added, bare, declared, seen


@dataclass(frozen=True)
class New:
    """A file of an effect, the name of another that it excludes, and how far engines may part (relative)."""

    name: str
    excludes: str
    parameter: str
    value: float
    counts: str
    extend: str
    apart: float = 1e-12
    beside: tuple[str, ...] = ()

    @property
    def text(self):
        """What stands in the file."""
        return f'''"""New: {self.name}."""

from dataclasses import replace

import numpy as np

from models.strict import Strict, quantity

EXCLUDES = ("{self.excludes}",)
WHY = "which it would be twice"
COST = "what {self.name} costs"
EXAMPLE = {{"{self.parameter}": {self.value}}}
COUNTS = {self.counts}


class Parameters(Strict):
    {self.parameter}: float = quantity("", "of {self.name}")


def extend(built, p):
{self.extend}'''


NEW = {
    "ride": New("tread", "second_corner", "length", 0.1, '{"all": {"states": 4}}', """
    def lagged(road):
        m, lag = len(road.F), np.eye(len(road.F)) / p.length
        return replace(road, F=np.block([[road.F, np.zeros((m, m))], [lag, -lag]]),
                       G=np.vstack([road.G, 0.0 * road.G]),
                       heights=tuple(np.hstack([0.0 * H, H]) for H in road.heights))

    return replace(built, road=(*built.road, lagged))
"""),
    "contact": New("soft_bodies", "falling_friction", "share", 0.5, "{}", """
    from models.contact.material import Material, Pair

    soft = (Material(E=p.share * body.E, nu=body.nu) for body in (built.pair.one, built.pair.two))
    return replace(built, pair=Pair(*soft))
""", beside=("saturation",)),
    "wheelset": New("rubber", "profiles", "stiffness", 1e7, '{"all": {"springs": 1}, "exudyn": {"spring-dampers": 2}, '
                    '"mujoco": {"actuators": 2}}', """
    return built.changed(stiffness_x=p.stiffness)
"""),
    "handling": New("side_wind", "rough_road", "force", 900.0, '{"all": {"pushes": 1}}', """
    from models.handling.numbers import Push

    wind = Push("body", (0.3, 0.0, 0.8), (0.0, 1.0, 0.0), ((0.0, 0.0), (5e-3, p.force)))
    return replace(built, pushes=(*built.pushes, wind))
"""),
    "hub-forces": New("light_wheels", "turning_forces", "share", 0.5, "{}", """
    wheels = {tyre.body for tyre in built.tyres}
    bodies = (replace(b, mass=p.share * b.mass) if b.name in wheels else b for b in built.bodies)
    return replace(built, bodies=tuple(bodies))
"""),
    "measured": New("slow_transducers", "own_clocks", "time", 5e-3, "{}", """
    share = 1.0 - np.exp(-built.period / p.time)

    def lag(signal, samples):
        out = samples.copy()
        for i in range(1, len(out) if signal.quantity == "force" else 0):
            out[i] = out[i - 1] + share * (samples[i] - out[i - 1])
        return out

    return built.changed(lag)
"""),
}  # fmt: skip
"""System -> a file for it. Where engines march by one tableau they part by rounding alone."""


@pytest.mark.parametrize("system", NEW)
def test_a_new_effect_is_one_file(system, new_file):
    new, scene = NEW[system], bare(system)
    before, table = seen(system, scene), own_table(scene) | {"effects": {NEW[system].name: {}}}
    with pytest.raises(InputError, match="no such effect"):
        rebuilt(table, scene)
    new_file(system, new.name, new.text)
    assert listing(system)[new.name] == f"New: {new.name}"
    assert added(system, new.name, quick=True) == declared(system, new.name, [next(iter(before))])
    own = beside(scene, new.name)
    assert f" {new.name}: what {new.name} costs" in import_module(SYSTEMS[system].plan).describe(own)
    _judged(before, seen(system, own), new.apart)
    assert without(own, new.name) == scene  # and the very path that it had before there was a file:
    assert all(before[engine] == found for engine, found in seen(system, without(own, new.name), quick=True).items())
    with pytest.raises(InputError, match=rf"effects.{new.name}.{new.parameter} = -1"):
        rebuilt(table | {"effects": {new.name: {new.parameter: -1.0}}}, scene)


def _judged(before, after, apart):
    """Every engine has another path than before, and all have the same one."""
    paths = {engine: np.frombuffer(path) for engine, (_, path) in after.items()}
    first = next(iter(paths.values()))
    for engine, path in paths.items():
        assert path.tobytes() != before[engine][1], "nothing of it is computed"
        assert np.abs(path - first).max() < apart * np.abs(first).max()


def test_a_push_from_outside_does_the_work_that_the_vehicle_gains():
    """Energy of the rigid bodies, written without an engine, less the power of all forces by Simpson's rule: a push of
    900 N over some 16 mm puts in 15 J, and 9e-8 J are left."""
    handling = Handling(load_vehicle("r19_free")).changed(pushes=(
        Push("body", (0.3, 0.0, 0.8), (0.0, 1.0, 0.0), ((0.0, 0.0), (0.05, 900.0), (0.3, 900.0), (0.4, 0.0))),))
    drive = driven("mujoco", handling, 25.0, 0.5)
    assert np.abs(unaccounted(drive)).max() < 1e-6
    assert drive.path[-1, 1] > 0.04  # m, to the left
    with pytest.raises(InputError, match="no such body"):
        handling.changed(pushes=(Push("sail", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), ((0.0, 1.0),)),))


@pytest.mark.parametrize("system", [name for name in NEW if name != "measured"])
def test_a_new_effect_cannot_stand_beside_what_it_excludes(system, new_file):
    new = NEW[system]
    new_file(system, new.name, new.text)
    with pytest.raises(InputError, match=f"cannot stand beside '{new.excludes}', which it would be twice: drop one"):
        beside(bare(system), *new.beside, new.excludes, new.name)
