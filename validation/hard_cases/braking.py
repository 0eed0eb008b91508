"""Braked wheels: standstill, locking, falling friction, hardly any of it or much, steps and answers at their ends.

Every implementation carries the chassis by itself; tyres and wheels are the same compiled ones.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.advance import AT_REST, FINE, advance
from models.brake.brake import PAPER_FRONT, Brake, of_wheels, torque
from models.brake.controller import AllApplied, Command, Sample
from models.brake.plane_chain import inertia
from models.brake.plane_step import BORNE, KNOWN, REPORTED, SIDE, share_out
from models.brake.plane_vehicle import GRAVITY, PAPER, Plane, truck
from models.brake.port.ask import checked
from models.brake.quarter import Quarter, braked
from models.brake.surfaces import Road, Stretch, check_way, road
from models.brake.trailer import CHOSEN, train
from models.core.errors import InputError, RunFailed
from models.engines.braking import Carried
from models.systems.braking.endings import ENDS, ending
from models.systems.braking.procedures import check_engine, drive, ready
from models.systems.braking.run import Start
from models.systems.braking.scene import BrakingScene, build
from models.tyre.magic_formula import surface
from models.tyre.tyre_table import Tables, TyreTable, stacked
from validation.braking.braking_schemes import exact
from validation.hard_cases.case import IMPLEMENTATIONS, Case, Word

STEP, SPEED = 5.5e-3, 10.0
ONE = Quarter(mass=1700.0, radius=0.5, spin_inertia=13.35)
LOAD = ONE.mass * GRAVITY
EVEN = road([Stretch(0.0, 0, 0)])
DRY, ICE = surface("dry"), surface("ice")


def bent(*points: tuple[float, float]) -> TyreTable:
    """Friction of these (slip, mu) at every load and slip angle, and none across."""
    slips, mu = np.array(points).T
    along = np.tile(mu, (2, 1, 1))
    return TyreTable(np.array([0.0, 1.5]), slips, np.array([LOAD]), along, np.ones((2, slips.size)), np.zeros((2, 1)))


def motion(
    implementation: str,
    plane: Plane,
    tyres: Tables,
    own: Road,
    torques: np.ndarray,
    step: float,
    state: np.ndarray,
    turning: np.ndarray,
    steer: float = 0.0,
) -> bool:
    """Move state (2, 2 + U) and turning (W,) under torques (n + 1, W); whether it came to rest."""
    go = advance if implementation == "reference" else Carried(implementation, plane).advance
    angles = np.where(plane.place[:, 0] > 0.0, steer, 0.0)
    rates, report = np.zeros(state.shape[1]), np.zeros((plane.wheels, REPORTED))
    status, used = go(
        state,
        turning,
        torques,
        step,
        angles,
        10.0,
        plane,
        np.zeros(plane.wheels, dtype=np.int64),
        own,
        tyres.packed,
        rates,
        report,
    )
    if status in ENDS:
        raise RunFailed(implementation, ending(status, plane, state, rates, report), used)
    if not (np.isfinite(state).all() and np.isfinite(turning).all()):
        return False
    return status == AT_REST and status != FINE


def start(plane: Plane, speed: float = SPEED) -> tuple[np.ndarray, np.ndarray]:
    """Rolling along x at a speed (m/s)."""
    state = np.zeros((2, 2 + plane.masses.size))
    state[1, 0] = speed
    return state, speed / plane.radius


def stopping(
    implementation: str,
    tyre: TyreTable,
    level: float,
    *,
    step: float = STEP,
    turning: float | None = None,
    own: Road = EVEN,
    more: tuple[TyreTable, ...] = (),
) -> float:
    """Way (m) to a stop that is one exactly, under a torque (N m); infinite without it."""
    state, spin = start(ONE.plane)
    if turning is not None:
        spin[:] = turning
    least = min(level / ONE.radius, LOAD * min(float(t.mu_x[0, 0, -1]) for t in (tyre, *more)))
    steps = int(2.0 * SPEED * ONE.mass / least / step) + 50
    torques, tyres = np.full((steps, 1), level), stacked([tyre, *more])
    rests = motion(implementation, ONE.plane, tyres, own, torques, step, state, spin)
    return float(state[0, 0]) if rests and not state[1].any() and spin[0] == 0.0 else np.inf


def steady(tyre: TyreTable, slip: float, step: float = STEP) -> Callable[[str, Path], float]:
    """A case of a stop at a slip that stays: way against m v^2 / (2 F), relative."""
    force = LOAD * float(np.interp(slip, tyre.slips, tyre.mu_x[0, 0]))
    level = ONE.steady_torque(slip, force)

    def error(implementation: str, folder: Path) -> float:
        way = stopping(implementation, tyre, level, step=step, turning=(1.0 - slip) * SPEED / ONE.radius)
        return abs(way / (ONE.mass * SPEED**2 / (2.0 * force)) - 1.0)

    return error


def from_rolling(tyre: TyreTable, slip: float, step: float) -> Callable[[str, Path], float]:
    """A case of a stop from rolling: way against the exact one, relative."""
    level = ONE.steady_torque(slip, LOAD * float(np.interp(slip, tyre.slips, tyre.mu_x[0, 0])))
    return lambda name, folder: abs(stopping(name, tyre, level, step=step) / exact(ONE, tyre, level, SPEED) - 1.0)


def beyond_the_peak(implementation: str, folder: Path) -> float:
    """A thousandth above the torque of the peak: the wheel locks; way against the exact one."""
    peak = 1.001 * LOAD * 0.8 * (ONE.radius + ONE.spin_inertia / (ONE.mass * ONE.radius))
    tyre = bent((0.0, 0.0), (0.1, 0.8), (1.0, 0.6))
    return abs(stopping(implementation, tyre, peak) / exact(ONE, tyre, peak, SPEED) - 1.0)


def at_the_peak(implementation: str, folder: Path) -> float:
    """The torque of the peak itself: way outside those of the peak and of sliding, by the first."""
    force = LOAD * 0.8
    way = stopping(
        implementation,
        bent((0.0, 0.0), (0.1, 0.8), (1.0, 0.6)),
        ONE.steady_torque(0.1, force),
        turning=0.9 * SPEED / ONE.radius,
    )
    least = ONE.mass * SPEED**2 / (2.0 * force)
    return max(1.0 - way / least, way / (least * 0.8 / 0.6) - 1.0, 0.0)


def locked(implementation: str, folder: Path) -> float:
    """Locked from the start: way against v^2 / (2 mu g)."""
    way = stopping(implementation, DRY, 2e4, turning=0.0)
    return abs(way * 2.0 * GRAVITY * float(DRY.mu_x[0, 0, -1]) / SPEED**2 - 1.0)


def changing(implementation: str, folder: Path) -> float:
    """Locked from friction 0.2 on to 0.8 after 10 m: way against its closed form."""
    slick, rough = (bent((0.0, 0.0), (1.0, mu)) for mu in (0.2, 0.8))
    own = road([Stretch(0.0, 0, 0), Stretch(10.0, 1, 1)])
    way = stopping(implementation, slick, 1e5, turning=0.0, own=own, more=(rough,))
    return abs(way / (10.0 + (SPEED**2 - 2.0 * 0.2 * GRAVITY * 10.0) / (2.0 * 0.8 * GRAVITY)) - 1.0)


def frictions(implementation: str, folder: Path) -> float:
    """Locked on friction from 1e-6 to 1.5 for 0.2 s: speed lost against mu g t."""
    found = []
    for mu in (1e-6, 1e-3, 0.1, 1.5):
        state, _ = start(ONE.plane)
        motion(
            implementation,
            ONE.plane,
            stacked([bent((0.0, 0.0), (1.0, mu))]),
            EVEN,
            np.full((41, 1), 1e6),
            5e-3,
            state,
            np.zeros(1),
        )
        found.append(abs((SPEED - state[1, 0]) / (mu * GRAVITY * 0.2) - 1.0))
    return float(max(found))


def at_rest(implementation: str, folder: Path) -> float:
    """A vehicle that stands, its brakes on: way and speed (m, m/s)."""
    state, spin = start(ONE.plane, 0.0)
    motion(implementation, ONE.plane, stacked([DRY]), EVEN, np.full((51, 1), 5e3), STEP, state, spin)
    return float(np.abs(state).max() + abs(spin[0]))


def backwards(implementation: str, folder: Path) -> float:
    """A wheel thrown backwards, no brake: rim's speed against the vehicle's after 0.5 s, by it."""
    state, _ = start(ONE.plane)
    spin = np.array([-10.0])
    motion(implementation, ONE.plane, stacked([DRY]), EVEN, np.zeros((101, 1)), 5e-3, state, spin)
    return float(abs(ONE.radius * spin[0] / state[1, 0] - 1.0))


def released(implementation: str, folder: Path) -> float:
    """A locked wheel whose brake lets go on a step's end: rim's speed against the vehicle's 0.6 s later, by it."""
    torques = np.where(np.arange(161) < 40, 2e4, 0.0)[:, None]
    state, _ = start(ONE.plane)
    spin = np.zeros(1)
    motion(implementation, ONE.plane, stacked([ICE]), EVEN, torques, 5e-3, state, spin)
    return float(abs(ONE.radius * spin[0] / state[1, 0] - 1.0))


def energy_grows(state: np.ndarray, level: float, tyre: TyreTable = ICE) -> Callable[[str, Path], float]:
    """A case of the truck from a state: largest gain of its kinetic energy over 20 ms, by that of the start."""
    plane = truck(PAPER)

    def energy(now: np.ndarray) -> float:
        return float(plane.masses[0] * (now[1, :2] ** 2).sum() + plane.inertias[0] * now[1, 2] ** 2)

    def error(implementation: str, folder: Path) -> float:
        now, spin, found = state.copy(), np.zeros(4), []
        for _ in range(25):
            before = energy(now)
            motion(implementation, plane, stacked([tyre]), EVEN, np.full((5, 4), level), 5e-3, now, spin)
            found.append(energy(now) - before)
        return float(max(*found, 0.0) / energy(state)) if np.isfinite(now).all() else np.inf

    return error


def even(implementation: str, folder: Path) -> float:
    """The truck on even friction, straight ahead: y, heading and yaw rate (m, rad, rad/s)."""
    plane = truck(PAPER)
    state, spin = start(plane)
    motion(implementation, plane, stacked([DRY]), EVEN, np.full((101, 4), 4e3), STEP, state, spin)
    return float(np.abs(state[:, 1:]).max())


def mirrored(implementation: str, folder: Path) -> float:
    """The truck steered left on a slick left side, and its mirror image: difference (m, rad)."""
    plane, ends = truck(PAPER), []
    for side in (1.0, -1.0):
        state, spin = start(plane)
        own = road([Stretch(0.0, 0, 1) if side > 0.0 else Stretch(0.0, 1, 0)])
        motion(implementation, plane, stacked([ICE, DRY]), own, np.full((101, 4), 2e3), STEP, state, spin, 0.05 * side)
        ends.append(state * np.array([1.0, side, side]))
    return float(np.abs(ends[0] - ends[1]).max())


def lifting(implementation: str, folder: Path) -> float:
    """A truck as high as it is long, braked on dry road."""
    plane = truck(PAPER.model_copy(update={"height": 4.0}))
    state, spin = start(plane, 20.0)
    motion(implementation, plane, stacked([DRY]), EVEN, np.full((101, 4), 2e4), STEP, state, spin)
    return np.inf


def jackknifed(implementation: str, folder: Path) -> float:
    """A train folded by 100 degrees, all wheels locked on dry road: largest gain of energy over 0.4 s, by the first."""
    plane = train(PAPER, CHOSEN.model_copy(update={"fold": np.pi}), transfer=False)
    state, spin = start(plane)[0], np.zeros(plane.wheels)
    state[0, 3:] = np.radians(-100.0)

    def energy() -> float:
        mass, rest = np.zeros((5, 5)), np.zeros(5)
        units = np.column_stack((np.cos(state[0, 2:]), np.sin(state[0, 2:])))
        inertia(units, state[1], plane.masses, plane.inertias, plane.reach, mass, rest, rest.copy(), rest.copy())
        return float(0.5 * state[1] @ mass @ state[1])

    levels = [energy()]
    for _ in range(20):
        motion(implementation, plane, stacked([DRY]), EVEN, np.full((5, plane.wheels), 2e4), 5e-3, state, spin)
        levels.append(energy())
    found = np.diff(levels)
    return float(max(found.max(), 0.0) / levels[0]) if levels[-1] < 0.8 * levels[0] else np.inf


def lagging_at_rest(implementation: str, folder: Path) -> float:
    """Braked to a stop in a slide on tyres that lag, then watched for 1 s: way and speed since it rests (m, m/s)."""
    scene = braking_scene(relaxation={"front": 0.5, "rear": 0.5})
    check_engine(scene, implementation)
    vehicle, begun = ready(scene, "stop")
    begun.state[1, 1] = 0.2
    path = vehicle.run(AllApplied(4), begun, 10.0)
    rest = Start(path.states[-1].copy(), path.turning[-1].copy())
    after = vehicle.run(AllApplied(4), rest, 1.0)
    moved = np.abs(after.states[:, 0] - rest.state[0]).max() + np.abs(after.states[:, 1]).max()
    return float(moved) if path.stands else np.inf


def on_the_line(implementation: str, folder: Path) -> float:
    """A wheel exactly on the line between dry and ice: way against that on the left surface alone (m)."""
    both = stopping(implementation, DRY, 2e3, own=road([Stretch(0.0, 0, 1)]), more=(ICE,))
    return abs(both - stopping(implementation, DRY, 2e3))


def no_friction_on_one_side(implementation: str, folder: Path) -> float:
    """The truck locked, none on the left, 0.8 on the right, for 5 ms: speed lost against mu g t / 2, relative."""
    plane = truck(PAPER, transfer=False)
    state, _ = start(plane)
    tyres = stacked([bent((0.0, 0.0), (1.0, 0.0)), bent((0.0, 0.0), (1.0, 0.8))])
    motion(implementation, plane, tyres, road([Stretch(0.0, 0, 1)]), np.full((6, 4), 2e4), 1e-3, state, np.zeros(4))
    return abs((SPEED - state[1, 0]) / (0.4 * GRAVITY * 5e-3) - 1.0) if state[1, 2] < 0.0 else np.inf


def slope_changes(implementation: str, folder: Path) -> float:
    """From dry on to wet within a step of 20 ms, lightly braked: way against that of the same force, relative."""
    force = LOAD * float(np.interp(0.004, DRY.slips, DRY.mu_x[0, 0]))
    own = road([Stretch(0.0, 0, 0), Stretch(5.03, 1, 1)])
    way = stopping(
        implementation,
        DRY,
        ONE.steady_torque(0.004, force),
        step=2e-2,
        turning=0.996 * SPEED / ONE.radius,
        own=own,
        more=(surface("wet"),),
    )
    return abs(way / (ONE.mass * SPEED**2 / (2.0 * force)) - 1.0)


def all_open(implementation: str, folder: Path) -> float:
    """Valves that stay open, on ice: speeds that are left of the vehicle and of its wheels (m/s, rad/s)."""
    path = drive(braking_scene(run={"duration": 10.0}), "stop", implementation)
    return float(np.abs(path.states[-1, 1]).max() + np.abs(path.turning[-1]).max()) if path.stands else np.inf


def braking_scene(**tables: Any) -> BrakingScene:
    """The truck from 1.5 m/s on ice without anti-lock system."""
    plain = {"title": "hard", "system": "braking", "procedures": {"stop": {"speed": 1.5}}, "pressure": {}}
    return build({**plain, **tables})


def at_the_edge_of_locking(implementation: str, folder: Path) -> float:
    """A J-turn on dry road, stopped under full brakes: speeds that are left (m/s, rad/s)."""
    scene = build(
        {
            "title": "hard",
            "system": "braking",
            "load_transfer": {"front": 0.3},
            "brakes": {"supply": 5.0},
            "road": {"stretches": [{"left": "dry"}]},
            "procedures": {"stop": {"kind": "j_turn", "speed": 15.0, "steer": 0.02}},
        }
    )
    path = drive(scene, "stop", implementation)
    return float(np.abs(path.states[-1, 1]).max() + np.abs(path.turning[-1]).max()) if path.stands else np.inf


def one_wheel_lifted(implementation: str, folder: Path) -> float:
    """Loads of which one would be negative: weight, and moments along and across, that change (N, N m)."""
    plane, known = truck(PAPER), np.zeros((4, KNOWN))
    known[:, SIDE], known[:, BORNE] = plane.place[:, 1], (9e3, 24e3, -4e3, 26e3)

    def balance() -> np.ndarray:
        loads: np.ndarray = known[:, BORNE]
        return np.array([loads.sum(), loads @ plane.place[:, 0], loads @ plane.place[:, 1]])

    before = balance()
    share_out(known)
    return float(np.abs(balance() - before).max()) if known[:, BORNE].min() >= 0.0 else np.inf


def turned_over(implementation: str, folder: Path) -> float:
    """A truck twice as high as it is wide, steered on dry road."""
    plane = truck(PAPER.model_copy(update={"height": 4.0}))
    state, spin = start(plane, 20.0)
    motion(implementation, plane, stacked([DRY]), EVEN, np.zeros((201, 4)), STEP, state, spin, 0.1)
    return np.inf


def beyond_the_supply(implementation: str, folder: Path) -> float:
    """A controller that asks for 299 bar of a supply of 6."""
    checked(Command(pressures=np.full(4, 299.0)), Sample(3, 16_500_000, np.ones(4), True, 6.0, 10.0), most=6.0)
    return np.inf


def below_push_out(implementation: str, folder: Path) -> float:
    """Torque (N m) of a brake below its push-out pressure."""
    return float(torque(0, 0.99 * PAPER_FRONT.push_out, 0.0, of_wheels(PAPER_FRONT)))


def answers(**command: Any) -> Callable[[str, Path], float]:
    """A case of a controller that answers nonsense."""

    def error(implementation: str, folder: Path) -> float:
        checked(Command(**command), Sample(3, 16_500_000, np.ones(4), True, 8.0, 10.0))
        return np.inf

    return error


def refused(run: Callable[[], Any]) -> Callable[[str, Path], float]:
    """A case that is refused."""

    def error(implementation: str, folder: Path) -> float:
        run()
        return np.inf

    return error


def slippery_brake() -> None:
    """A brake that lets go above the pressure at which it takes hold."""
    try:
        Brake(push_out=0.5, release=0.7, rising=1000.0, falling=1000.0)
    except ValueError as error:
        raise InputError("", "release", 0.7, str(error)) from None


SIDEWAYS = np.array([[0.0, 0.0, 0.0], [5.0, 8.0, 0.0]])
SPINNING = np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 3.0]])
LINE = bent((0.0, 0.0), (1.0, 0.9))
REFUSED: dict[str, Word] = dict.fromkeys(IMPLEMENTATIONS, "refused")
RAISED: dict[str, Word] = dict.fromkeys(IMPLEMENTATIONS, "raised")
CASES = (
    Case(
        "light braking to a stop",
        "slip has the speed in its denominator, which ends at 0",
        "m v^2 / (2 F)",
        "",
        1e-7,
        "the step in which it stops",
        steady(DRY, 0.02),
    ),
    Case(
        "light braking to a stop, 20 ms",
        "50 time constants of the wheel in a step",
        "m v^2 / (2 F)",
        "",
        1e-6,
        "the step in which it stops",
        steady(DRY, 0.004, 2e-2),
    ),
    Case(
        "table of a single cell",
        "slip 0 and 1 are its only nodes",
        "m v^2 / (2 F)",
        "",
        1e-6,
        "the step in which it stops",
        steady(LINE, 0.5),
    ),
    Case(
        "slip that settles on a node",
        "the slope of friction jumps there",
        "m v^2 / (2 F)",
        "",
        1e-6,
        "the step in which it stops",
        steady(bent((0.0, 0.0), (0.05, 0.5), (0.2, 0.8), (1.0, 0.6)), 0.05),
    ),
    Case(
        "from rolling, 20 ms",
        "the wheel slows down within two steps",
        "the exact way",
        "",
        5e-4,
        "asked for",
        from_rolling(DRY, 0.05, 2e-2),
    ),
    Case(
        "torque just above the peak",
        "falls off along falling friction, slowly at first",
        "the exact way",
        "",
        5e-4,
        "asked for",
        beyond_the_peak,
    ),
    Case(
        "torque exactly at the peak",
        "no slip beyond it is stable",
        "between the ways of peak and sliding",
        "",
        1e-6,
        "the step in which it stops",
        at_the_peak,
    ),
    Case(
        "locked from the start", "the rate of slip is 0 / 0 at the end", "v^2 / (2 mu g)", "", 1e-9, "asked for", locked
    ),
    Case(
        "friction changes under a locked wheel",
        "within a step",
        "its closed form",
        "",
        1e-4,
        "the step of the change takes its share of the way",
        changing,
    ),
    Case(
        "friction from 1e-6 to 1.5, locked",
        "bounded by next to nothing",
        "mu g t",
        "",
        1e-6,
        "rounding of the speed",
        frictions,
    ),
    Case("standstill under brakes", "friction would push it back", "does not move", "m, m/s", 0.0, "exact", at_rest),
    Case("wheel thrown backwards", "slip above 1", "rolls", "", 1e-6, "25 time constants", backwards),
    Case(
        "brake lets go on a step's end",
        "locked until then, by an explicit state",
        "rolls",
        "",
        1e-6,
        "60 time constants once it grips",
        released,
    ),
    Case(
        "truck sliding sideways, locked",
        "slip angles of 58 degrees",
        "gains no energy",
        "",
        1e-12,
        "rounding",
        energy_grows(SIDEWAYS, 2e4),
    ),
    Case(
        "truck spinning on ice",
        "wheels go forwards and backwards",
        "gains no energy",
        "",
        1e-12,
        "rounding",
        energy_grows(SPINNING, 2e4),
    ),
    Case("truck on even friction", "rounding left and right", "does not yaw", "m, rad, rad/s", 0.0, "exact", even),
    Case(
        "truck on split friction in a mirror", "sides exchanged", "mirror image", "m, rad", 1e-12, "rounding", mirrored
    ),
    Case(
        "train that jackknifes, locked",
        "the drawbar folded under it",
        "gains no energy",
        "",
        1e-12,
        "rounding",
        jackknifed,
    ),
    Case(
        "tyres that lag, at standstill",
        "the tyre is a spring there",
        "stays at rest",
        "m, m/s",
        0.0,
        "exact",
        lagging_at_rest,
        {"exudyn": "refused", "mujoco": "refused"},
    ),
    Case("wheel exactly on the line", "of split friction", "as on the left surface", "m", 0.0, "exact", on_the_line),
    Case(
        "no friction on one side",
        "wheels without any force",
        "mu g t / 2",
        "",
        1e-4,
        "it has begun to yaw",
        no_friction_on_one_side,
    ),
    Case(
        "slope of friction changes within a step",
        "from dry on to wet, 20 ms",
        "m v^2 / (2 F)",
        "",
        1e-4,
        "the wheel takes up another slip",
        slope_changes,
    ),
    Case("valves open for ever", "all wheels lock", "comes to rest", "m/s, rad/s", 0.0, "exact", all_open),
    Case(
        "pressure below push-out", "hysteresis would pull it below 0", "no torque", "N m", 0.0, "exact", below_push_out
    ),
    Case(
        "slow wheel at the edge of locking",
        "a little less load, and it stands within the step",
        "comes to rest",
        "m/s, rad/s",
        0.0,
        "exact",
        at_the_edge_of_locking,
    ),
    Case(
        "one wheel of four lifted",
        "the plane's loads follow its accelerations",
        "statics of three wheels",
        "N, N m",
        1e-9,
        "rounding",
        one_wheel_lifted,
        once=True,
    ),
    Case(
        "truck that rolls over",
        "both wheels of a side bear nothing",
        "fails, and says when",
        "",
        0.0,
        "exact",
        turned_over,
        RAISED,
    ),
    Case(
        "299 bar of a supply of 6",
        "more than there is",
        "fails, and says when",
        "",
        0.0,
        "exact",
        beyond_the_supply,
        RAISED,
    ),
    Case(
        "truck that lifts its rear wheels",
        "the plane has no lift-off",
        "fails, and says when",
        "",
        0.0,
        "exact",
        lifting,
        RAISED,
    ),
    Case(
        "controller answers not a number",
        "would spread to every state",
        "fails, and says when",
        "",
        0.0,
        "exact",
        answers(pressures=np.array([1.0, np.nan, 1.0, 1.0])),
        RAISED,
    ),
    Case(
        "controller answers for three wheels",
        "of four",
        "fails, and says when",
        "",
        0.0,
        "exact",
        answers(valves=np.ones(3, dtype=np.int64)),
        RAISED,
    ),
    Case(
        "controller answers nothing",
        "neither valves nor pressures",
        "fails, and says when",
        "",
        0.0,
        "exact",
        answers(),
        RAISED,
    ),
    *(
        Case(name, "a number from senseless input", "refused", "", 0.0, "exact", refused(run), REFUSED)
        for name, run in (
            ("torque that drives the wheel", lambda: braked(ONE, stacked([DRY]), EVEN, np.full(3, -1.0), STEP, SPEED)),
            ("table that ends before it locks", lambda: bent((0.0, 0.0), (0.9, 0.8))),
            ("table with friction at no slip", lambda: bent((0.0, 0.1), (1.0, 0.8))),
            (
                "stretches shorter than a step",
                lambda: check_way(road([Stretch(0.0, 0, 0), Stretch(1.0, 1, 1), Stretch(1.01, 0, 0)]), 0.1),
            ),
            ("brake that lets go too early", slippery_brake),
            ("vehicle lighter than its wheels", lambda: truck(PAPER.model_copy(update={"mass": 100.0}))),
            (
                "roll shares that do not add up",
                lambda: truck(PAPER.model_copy(update={"front": PAPER.front.model_copy(update={"roll_share": 0.5})})),
            ),
        )
    ),
)
