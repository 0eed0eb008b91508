"""A ride scene with nonlinear springs in the time domain, with some effects left out: copies of its vehicle on random
roads.

The copies know nothing of each other, and two runs meet the same roads, so that what leaving something out changes is
known with its standard error. A longer step reads every so many rows of the same roads.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pydantic import Field

from models.core.errors import InputError, RunFailed
from models.core.scene_effects import absent_effects, with_effects
from models.core.strict import LARGEST_QUANTITY, Strict, quantity
from models.ride.gaussian_laws import mean_force_and_slope, mean_friction_slope
from models.ride.nonlinear_copies import STEPS_PER_READING, CopiesMarch, settling_time, usual_step
from models.ride.road_path import RoadPath, check_rates, road_path
from models.ride.statistical_linearisation import BentSpringResult, statistically_linear
from models.road.excitation import RoadExcitation
from models.systems.ride.of_scene import has_no_linear_equivalent
from models.systems.ride.omissions import effects_of, wheels_of
from models.systems.ride.reduced_scene import OmissibleEffect, ReducedScene, refusal_reason
from models.systems.ride.reduced_scene import reduced_without as without_effects
from models.vehicles.linear_vehicle import LinearOutput
from models.vehicles.spatial import Body, SpatialVehicle, SpringDamper

FEWEST_COPIES = 12
"""Smallest number of copies for a standard error, which is itself uncertain by about a fifth then."""
STEP_MULTIPLE = 48
"""The numbers of steps, both before and while outputs count, are multiples of this; a step may be longer by any of its
divisors.
"""
ROADS_BYTES = 3e8
"""Memory (bytes) of stored road samples, which many variants share, above which the oldest ones are deleted."""


class Samples(Strict):
    """Number and duration of the copies of a vehicle, from a scene's [options]."""

    copies: int = Field(
        default=48, ge=FEWEST_COPIES, le=100_000, description="of the vehicle, each on a road of its own"
    )
    lasting: float = quantity("s", "length of each copy after it has forgotten its beginning", default=10.0)
    seed: int = Field(default=1, ge=0, lt=2**64, description="of all roads")


@dataclass(frozen=True)
class CopySteps:
    """Time steps of the copies at a speed (m/s): half of the step (s), the numbers of steps before and while outputs
    count, and the motion of the nonlinear springs of the full vehicle.
    """

    speed: float
    half: float
    settling_steps: int
    counted_steps: int
    springs: dict[str, BentSpringResult]

    @property
    def steps(self) -> int:
        """Number of time steps of a copy."""
        return self.settling_steps + self.counted_steps


@dataclass(frozen=True)
class CopiesInTime:
    """The copies of a vehicle on random roads at all speeds of a ride scene, without the effects ``left_out``, with
    steps longer by the factor ``step_factor``.
    """

    scene: ReducedScene
    samples: Samples
    steps_at_speeds: tuple[CopySteps, ...]
    effects: tuple[OmissibleEffect, ...]
    left_out: frozenset[str] = frozenset()
    step_factor: int = 1
    system = "ride"

    @property
    def file(self) -> str:
        """Name of the scene file."""
        return self.scene.ride_scene.file

    @property
    def effect_names(self) -> tuple[str, ...]:
        """Names of the effects that have not been left out."""
        return tuple(effect.name for effect in self.effects if effect.name not in self.left_out)

    @property
    def effect_sentences(self) -> dict[str, str]:
        """Sentences on what leaving out an effect means, by the name of the effect."""
        return {effect.name: effect.says for effect in self.effects}

    @property
    def absent_effect_names(self) -> tuple[str, ...]:
        """Names of the effects that the scene could have but does not name."""
        return absent_effects(self.scene.ride_scene)

    def with_effect(self, effect_name: str) -> "CopiesInTime":
        """The copies with an absent effect added at its usual values; InputError where the effect cannot be added."""
        scene = ReducedScene.complete(with_effects(self.scene.ride_scene, effect_name))
        _check(scene)
        return replace(self, scene=scene)

    @property
    def steps(self) -> int:
        """Number of time steps of all copies at all speeds."""
        return self.samples.copies * sum(pace.steps for pace in self.steps_at_speeds) // self.step_factor

    def without(self, effect_names: Iterable[str]) -> "CopiesInTime":
        """The copies without these effects; InputError where they may not be left out."""
        left_out = self.left_out | set(effect_names)
        chosen = [effect for effect in self.effects if effect.name in left_out]
        why = refusal_reason(chosen)
        if why:
            raise InputError(self.file, "effects", None, why)
        fresh = [effect for effect in chosen if effect.name not in self.left_out]
        return replace(self, scene=without_effects(self.scene, fresh), left_out=left_out)

    def in_longer_steps(self, step_factor: int) -> "CopiesInTime":
        """The copies with steps longer by the factor ``step_factor``."""
        return replace(self, step_factor=self.step_factor * step_factor)

    def with_fewer_copies(self, step_count: int) -> "CopiesInTime":
        """Fewer copies, which take about ``step_count`` time steps in all, but enough copies for a standard error."""
        copies = max(FEWEST_COPIES, -(-self.samples.copies * step_count // self.steps))
        return replace(self, samples=self.samples.model_copy(update={"copies": min(copies, self.samples.copies)}))

    @cached_property
    def _excitation(self) -> RoadExcitation:
        return self.scene.excitation()

    def vehicle(self, copy_steps: CopySteps) -> SpatialVehicle:
        """The vehicle for a run at a speed, without the effects that are left out; InputError where a run in time needs
        one of them.
        """
        return reduced_vehicle(self.scene, copy_steps.springs)

    def roads(self, copy_steps: CopySteps) -> np.ndarray:
        """Heights and their rates (2 steps + 1, 2 w, copies) of the road under each wheel, at half steps."""
        roads = _road_heights(
            RoadPath(self._excitation, copy_steps.speed, copy_steps.half), copy_steps.steps, self.samples
        )
        return np.ascontiguousarray(roads[:: self.step_factor])

    def mean_squares(self, copy_steps: CopySteps, roads: np.ndarray) -> tuple[tuple[LinearOutput, ...], np.ndarray]:
        """Outputs of the vehicle, and for each copy their mean squares (copies, p) about the mean of all copies."""
        step = 2.0 * copy_steps.half * self.step_factor
        march = CopiesMarch(self.vehicle(copy_steps), copy_steps.speed, step, self.samples.copies)
        reading_interval = max(1, STEPS_PER_READING // self.step_factor)
        march.march_over(roads, copy_steps.settling_steps // self.step_factor, reading_interval)
        count = len(range(0, copy_steps.counted_steps // self.step_factor, reading_interval))
        first, second = march.sums[0].T / count, march.sums[1].T / count
        if not (second < LARGEST_QUANTITY).all():
            raise RunFailed("reference", f"grows without end in steps of {step:.3g} s", step)
        mean = first.mean(axis=0)
        return march.plain.outputs, second - 2 * mean * first + mean**2


def in_time(scene: ReducedScene) -> CopiesInTime:
    """The copies of a complete ride scene, to be integrated in time; InputError for a scene with a closed form, or one
    whose effects or weightings copies cannot represent.
    """
    _check(scene)
    speeds, options = scene.ride_scene.speeds, scene.ride_scene.options
    assert speeds is not None
    samples = Samples.model_validate({key: value for key, value in options.items() if key in Samples.model_fields})
    paces = tuple(_copy_steps(scene, float(speed), samples.lasting) for speed in speeds.all())
    return CopiesInTime(
        scene, samples, paces, tuple(effect for effect in effects_of(scene) if _can_be_left_out(scene, effect))
    )


def _check(scene: ReducedScene) -> None:
    ride = scene.ride_scene
    if ride.vehicle.small_motion or not has_no_linear_equivalent(scene.vehicle):
        raise InputError(ride.file, "vehicle.file", ride.vehicle.file, "is linear, and has a closed form")
    if ride.speeds is None:
        raise InputError(ride.file, "drive", None, "has no effects priced or chosen by runs: give [speeds]")
    for name, weighting_name in ride.weighting.items():
        raise InputError(ride.file, f"weighting.{name}", weighting_name, "is not read by runs in time: leave it out")
    check_rates(scene.vehicle, scene.excitation(), ride.file)


def _copy_steps(scene: ReducedScene, speed: float, counted_duration: float) -> CopySteps:
    """Time steps of the copies at a speed (m/s), each ``counted_duration`` (s) after settling."""
    excitation = scene.excitation()
    linear = statistically_linear(scene.vehicle.with_tyres(pushes_only=False), excitation, speed)
    half = road_path(excitation, speed, usual_step(scene.vehicle, speed, linear.vehicle)).half_step
    unit = 2.0 * half * STEP_MULTIPLE
    settling, counted = (
        STEP_MULTIPLE * int(np.ceil(time / unit)) for time in (settling_time(linear.vehicle), counted_duration)
    )
    return CopySteps(speed, half, settling, counted, linear.springs)


def _can_be_left_out(scene: ReducedScene, effect: OmissibleEffect) -> bool:
    """Whether a run in time can do without an effect and the parts that must leave with it."""
    reduced_scene = effect.without(scene)
    rigid = (spring for spring in scene.vehicle.springs if spring.name in reduced_scene.rigid)
    return not reduced_scene.massless and not any(
        {spring.first_body, spring.second_body} & wheels_of(scene.vehicle) for spring in rigid
    )


def reduced_vehicle(scene: ReducedScene, motion_of_spring: dict[str, BentSpringResult]) -> SpatialVehicle:
    """The vehicle of a reduced scene; ``motion_of_spring`` : motion of the nonlinear springs, for the gains of
    statistical linearisation.
    """
    springs = scene.vehicle.springs
    seats = {s.first_body: s.second_body for s in springs if s.name in scene.rigid and s.second_body is not None}

    def body(full_body: Body) -> Body:
        if full_body.name in seats:
            return replace(full_body, freedoms=(), parent=seats[full_body.name])
        return replace(
            full_body, freedoms=tuple(f for f in full_body.freedoms if (full_body.name, f) not in scene.locked)
        )

    return replace(
        scene.vehicle,
        springs=tuple(
            _linearised_spring(s, scene.linearised_laws, motion_of_spring) for s in springs if s.name not in scene.rigid
        ),
        bodies=tuple(sorted(map(body, scene.vehicle.bodies), key=lambda any_body: any_body.name in seats)),
    )


def _linearised_spring(
    spring: SpringDamper, nonlinear_laws: frozenset[str], motion_of_spring: dict[str, BentSpringResult]
) -> SpringDamper:
    """The spring with gains of statistical linearisation in place of the nonlinear ``nonlinear_laws``."""
    motion = motion_of_spring.get(spring.name)
    if motion is None:
        return spring
    if "travel_force" in nonlinear_laws and spring.travel_force:
        gain = mean_force_and_slope(spring.travel_force, motion.travel, motion.deviation)[1]
        spring = replace(spring, stiffness=spring.stiffness + gain, travel_force=None)
    if "rate_force" in nonlinear_laws and spring.rate_force:
        gain = mean_force_and_slope(spring.rate_force, 0.0, motion.rate)[1]
        spring = replace(spring, damping=spring.damping + gain, rate_force=None)
    if "friction" in nonlinear_laws and spring.friction:
        gain = mean_friction_slope(spring.friction, spring.friction_rate, motion.rate)
        spring = replace(spring, damping=spring.damping + gain, friction=0.0)
    return spring


_stored_roads: dict[tuple[object, ...], np.ndarray] = {}


def _road_heights(path: RoadPath, step_count: int, copy_samples: Samples) -> np.ndarray:
    """Heights and rates (2 steps + 1, 2 w, copies) of the road at half steps; those that were requested last are
    stored.
    """
    road = path.excitation
    arrays = (array.tobytes() for array in (road.F, road.G, *road.heights))
    of_run = path.speed, path.half_step, step_count, copy_samples.copies, copy_samples.seed
    key = (*arrays, road.lengths, road.independent, *of_run)
    if key not in _stored_roads:
        while sum(roads.nbytes for roads in _stored_roads.values()) > ROADS_BYTES:
            del _stored_roads[next(iter(_stored_roads))]
        _stored_roads[key] = next(path.blocks(step_count, copy_samples.copies, copy_samples.seed))
    return _stored_roads[key]
