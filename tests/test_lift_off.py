"""Tyres that only push: the law, the three implementations, closed forms, energy, what is refused, planted faults."""

from dataclasses import replace

import numpy as np
import pytest

from models.advice.choice.systems.ride import copies_of_scene
from models.core.errors import InputError, RunFailed
from models.core.scene_effects import scene_without
from models.engines import reference
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE
from models.engines.catalogue import RECOMMENDED as INTEGRATORS
from models.engines.protocol import build
from models.engines.spatial_protocol import build as build_spatial
from models.engines.spatial_reference import SpatialReference
from models.ride.nonlinear_copies import CopiesMarch, copies_in_time
from models.ride.road_path import road_path
from models.ride.statistical_linearisation import statistically_linear
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.measurement import road_under_wheels, true_run
from models.systems.hub_forces.scene import build as build_hubs
from models.systems.pitch_plane.effects import lift_off
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene, settings_of
from models.systems.pitch_plane.scene import build as build_scene
from models.systems.ride.nonlinear import drive_over_road
from models.systems.ride.of_scene import check_linear, excitation_of, vehicle_of
from models.systems.ride.scene import build as build_ride
from models.vehicles import pitch_plane_equations
from models.vehicles.pitch_plane import pitch_plane_vehicle
from models.vehicles.spatial_linear import static_preloads, wheels
from models.vehicles.vehicle_file import load_vehicle
from studies import ride_nonlinear
from validation.common import checks
from validation.common.bounces import BouncingVehicle, bounce_energy
from validation.common.scenes import largest_difference

ENGINES = ("reference", "exudyn", "mujoco")
ROAD = {"source": "study", "speed": 20.0}
SLACK = {"stiffness": 2e4, "dead_band": 0.01}
DROP = {"z1": -0.3, "z2": -0.2, "z3": -0.4, "pitch": 0.05}
"""m, rad: both wheels in the air, the front one higher."""


def scene(effects=None, geometry="exact", duration=2.0, step=5e-4, start=None, **override):
    return build_scene(
        {
            "title": "t",
            "vehicle": {"parameters": "asymmetric_twin", "geometry": geometry, "override": override},
            "run": {"duration": duration, "step": step},
            "start": start or {},
            "effects": {"lift_off": {}, **(effects or {})},
        }
    )


def forces(run):
    return np.array([run["f1"], run["f2"]])


@pytest.mark.parametrize("geometry", ["exact", "linear"])
@pytest.mark.parametrize(
    "effects", [{}, {"road": ROAD}, {"road": ROAD, "pitch_spring": SLACK}], ids=["flat", "road", "dead band"]
)
def test_three_implementations_agree_and_never_pull(effects, geometry):
    own = scene(effects, geometry=geometry, start=DROP)
    found = {engine: simulate(own, engine) for engine in ENGINES}
    for engine in ENGINES[1:]:
        assert (
            largest_difference(found[engine], found["reference"]) < 1e-12
        )  # the order of additions is all that differs
        settings = settings_of(own, engine)
        # random states lie half a metre to both sides: tyres in the air, pressed and hit
        assert checks.acceleration_gap(checks.engine(engine), assembly_of_scene(own), settings) < 1e-12
    pressed = forces(found["reference"])
    assert pressed.min() == 0.0 and 0.05 < (pressed == 0.0).mean() < 0.5


@pytest.mark.grounds("closed form")
def test_the_law_at_hand_made_states():
    """In the air, pressed, released faster than the spring follows, hit faster than it gives way."""
    p = assembly_of_scene(scene()).parameters
    p = p.model_copy(update={"k1": 1e5, "d1": 400.0})
    laws = {(-0.01, 9.0): 0.0, (0.02, 1.0): 2400.0, (0.02, -6.0): 0.0, (0.02, -4.0): 400.0, (0.001, 3.0): 200.0}
    for (e, rate), wanted in laws.items():
        y = np.array([e + 0.3, 0.0, 0.0, 0.0, rate + 2.0, 0.0, 0.0, 0.0])
        found = pitch_plane_equations.pushing_tyres(y, np.array([0.3, 0.0, 2.0, 0.0]), p.array())[0]
        assert found == pytest.approx(wanted, abs=1e-9)
    y[0] = np.nan
    assert np.isnan(pitch_plane_equations.pushing_tyres(y, np.zeros(4), p.array())[0])


def test_a_wheel_that_never_lifts_has_the_paper_s_tyre():
    """A smooth road, whose loads stay far from zero: the same to rounding with and without the effect."""
    own = scene({"road": {"source": "study", "speed": 20.0, "gd": 1e-6}})
    for engine in ENGINES:
        with_it, linear = simulate(own, engine), simulate(scene_without(own, "lift_off"), engine)
        assert forces(linear).min() > 500.0 and largest_difference(with_it, linear) < 1e-11


@pytest.mark.parametrize("engine", ENGINES)
def test_free_fall_until_the_wheels_touch(engine):
    own = scene(start={"z1": -1.0, "z2": -1.0, "z3": -1.0}, duration=0.3)
    run, p = simulate(own, engine), assembly_of_scene(own).parameters
    masses = np.array([p.m1, p.m2, p.m3])
    centre = run.states[:, :3] @ masses / masses.sum()
    assert forces(run).max() == 0.0
    assert np.abs(centre + 1.0 - 0.5 * p.g * run.times**2).max() < 1e-12  # RK4 is exact for a parabola


@pytest.mark.parametrize("engine", ENGINES)
def test_a_wheel_alone_bounces_by_the_closed_form(engine):
    """Cut off its chassis it falls, swings once about its static depth on the tyre, and flies again, without end."""
    height, k, m, g = 0.05, 4e4, 25.0, 9.81
    base = assembly_of_scene(scene())
    p = base.parameters.model_copy(update={"k1": k, "m1": m, "d1": 0.0, "k3": 0.0, "k4": 0.0, "d3": 0.0, "d4": 0.0})
    alone = lift_off.extend(
        replace(base, parameters=p, vehicle=pitch_plane_vehicle(p), initial=-height * np.eye(8)[0]), None
    )
    run = build(engine, alone, Settings(INTEGRATORS[engine], 1e-4, 0.5)).run()
    omega, fall, speed = np.sqrt(k / m), np.sqrt(2.0 * height / g), np.sqrt(2.0 * g * height)
    contact = 2.0 * (np.pi - np.arctan2(speed, m * g / k * omega)) / omega
    since = np.mod(run.times + fall, 2.0 * fall + contact) - 2.0 * fall  # of the last touch-down, or to the next
    swing = m * g / k * (1.0 - np.cos(omega * since)) + speed / omega * np.sin(omega * since)
    flight = -height + 0.5 * g * (since + fall) ** 2
    wanted = np.where(since > 0.0, swing, flight)
    assert (since > 0.0).any() and np.abs(run.states[:, 0] - wanted).max() < 5e-6  # corners: the square of 0.1 ms


@pytest.mark.parametrize(
    "override", [{}, {"d1": 3000.0, "d2": 2000.0}, {"d1": 0.0, "d2": 0.0}], ids=["as it is", "damped", "undamped"]
)
def test_the_exact_path_piece_by_piece(override):
    own = scene(geometry="linear", start=DROP, duration=1.0, step=1e-4, **override)
    assembly = assembly_of_scene(own)
    exact = BouncingVehicle(assembly, 1e-4).path(assembly.initial, 10_000)
    tight = simulate(own, "reference", Settings("DOP853", 1e-4, 1.0, 1e-11))
    assert np.abs(tight.states - exact).max() < 1e-6  # its rows are interpolated, across corners, too
    for engine in ENGINES:
        assert np.abs(simulate(own, engine).states - exact).max() < 2e-4  # square of the step, by 20 corners


def test_the_error_falls_with_the_square_of_the_step():
    own = scene(geometry="linear", start=DROP)
    assembly, steps = assembly_of_scene(own), 1e-3 / 2.0 ** np.arange(6)
    exact = BouncingVehicle(assembly, 1e-3).path(assembly.initial, 1000)
    errors = []
    for step in steps:
        run = build("reference", assembly, Settings("RK4", step, 1.0)).run()
        errors.append(np.abs(run.states[:: round(1e-3 / step)] - exact).max())
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.5 < slope < 3.0  # a corner anywhere within a step: 2 on the average, not 4


FIRST_ORDER = [
    (engine, name)
    for engine in ("exudyn", "mujoco")
    for name, integrator in CATALOGUE[engine].items()
    if integrator.order == 1
]


@pytest.mark.parametrize(("engine", "name"), FIRST_ORDER)
def test_methods_of_first_order_run_where_tyres_lift(engine, name):
    """On a rough road their errors fall with the step; steps that jump over landings of stiff tyres are told."""
    assembly = assembly_of_scene(scene({"road": ROAD}, duration=1.0))
    exact = build("reference", assembly, Settings("RK4", 5e-5, 1.0)).run().states
    errors = []
    for step in (1e-3, 2.5e-4):
        states = build(engine, assembly, Settings(name, step, 1.0)).run().states
        errors.append(np.abs(states - exact[:: round(step / 5e-5)])[:, 4:].max())
    assert 3.0 < errors[0] / errors[1] < 5.0  # a quarter of the step
    stiff = assembly_of_scene(scene(start=DROP, k1=2e7, k2=2e7, d1=0.0, d2=0.0))
    with pytest.raises((RunFailed, InputError), match=r"goes unseen between them|stability limit"):
        build(engine, stiff, Settings(name, 2e-3, 2.0)).run()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("geometry", ["exact", "linear"])
def test_a_bouncing_vehicle_gains_no_energy(engine, geometry):
    undamped = scene(geometry=geometry, start=DROP, step=1e-4, duration=1.5, d1=0.0, d2=0.0, d3=0.0, d4=0.0)
    damped = scene(geometry=geometry, start=DROP, step=1e-4, duration=1.5, d1=800.0, d3=0.0, d4=0.0)
    for own in (undamped, damped):
        states = simulate(own, engine).states
        of = bounce_energy(assembly_of_scene(own), states)
        size = np.ptp(bounce_energy(assembly_of_scene(own), states * np.array([0, 0, 0, 0, 1, 1, 1, 1])))  # of motion
        assert (of - np.minimum.accumulate(of)).max() < 1e-4 * size  # the error of the step
        if own is undamped:
            assert np.abs(of - of[0]).max() < 1e-4 * size


def test_a_tyre_that_pulls_in_one_implementation_is_seen(monkeypatch):
    """Planted: the cut at zero is forgotten; the damper is not limited."""
    own = scene({"road": ROAD}, duration=1.5)
    truth = simulate(own, "exudyn")
    for law in (
        lambda y, u, p: pitch_plane_equations.linear_tyres(y, u, p),
        lambda y, u, p: tuple(max(f, 0.0) for f in pitch_plane_equations.linear_tyres(y, u, p)),
    ):
        assembly = assembly_of_scene(own)
        model = build("reference", assembly, settings_of(own, "reference"))
        dy = np.empty(8)

        def wrong(y, u, p, law=law, dy=dy):
            struts = pitch_plane_equations.suspension_forces(y, p, np.sin(y[3]), np.cos(y[3]))
            pitch_plane_equations.newton_euler(y, law(y, u, p), struts, np.cos(y[3]), p, dy)
            return dy

        monkeypatch.setattr(reference, "compiled_derivative", lambda *key, wrong=wrong: wrong)
        states = checks.random_states(100)
        found = np.array([model.acceleration(1.0, *np.split(y, 2)) for y in states])
        monkeypatch.undo()
        right = np.array(
            [build("exudyn", assembly, settings_of(own, "exudyn")).acceleration(1.0, *np.split(y, 2)) for y in states]
        )
        assert checks.relative_difference(found, right) > 1e-3
    assert forces(truth).min() == 0.0


def test_what_cannot_be_is_told_with_the_remedy(tmp_path):
    from models.core.time_series import write_time_series

    write_time_series(tmp_path / "f.csv", {"front": ("N", np.full(9, 4e3)), "rear": ("N", np.full(9, 4e3))}, 1e-3)
    with pytest.raises(InputError, match="lift_off: cannot stand beside 'wheel_forces', there is no tyre"):
        assembly_of_scene(
            build_scene(
                {
                    "title": "t",
                    "run": {"duration": 5e-3},
                    "effects": {"lift_off": {}, "wheel_forces": {"file": "f.csv", "interpolation": "linear"}},
                },
                "",
                tmp_path,
            )
        )
    with pytest.raises(InputError, match="depth"):
        build_scene({"title": "t", "run": {"duration": 5e-3}, "effects": {"lift_off": {"depth": 1e-3}}})


def test_absent_means_absent():
    plain = build_scene({"title": "t", "run": {"duration": 0.01}, "effects": {"road": ROAD}})
    for engine in ENGINES:
        model = build(engine, assembly_of_scene(plain), settings_of(plain, engine))
        more = build(engine, assembly_of_scene(scene({"road": ROAD}, duration=0.01)), settings_of(plain, engine)).plan()
        counts = model.plan()
        assert counts["callbacks"] == {"reference": 0, "exudyn": 4, "mujoco": 1}[engine]
        assert more["callbacks"] == {"reference": 0, "exudyn": 2, "mujoco": 1}[engine]
    assert lift_off.COUNTS["exudyn"] == {"callbacks": 2}  # of a flat road, where the bare scene has none


# vehicles in space ------------------------------------------------------------------------------------------------


def ride_scene(name="r19_ride", level=3e-4, **more):
    own = {
        "title": "t",
        "system": "ride",
        "vehicle": {"file": name, "operating_point": "loaded"},
        "road": {"level": level},
        "speeds": {"values": [20.0]},
        "effects": {"lift_off": {}},
    }
    return build_ride({**own, **more}, "s.toml")


@pytest.mark.parametrize("name", ["r19_ride", "half_car", "quarter_car_nonlinear"])
def test_vehicles_in_space_agree_with_the_written_equations_where_tyres_lift(name):
    random, whole = np.random.default_rng(5), vehicle_of(ride_scene(name))
    damped = replace(whole, tyres=tuple(replace(tyre, damping=300.0 + i) for i, tyre in enumerate(whole.tyres)))
    n, w = len(damped.coordinates()), len(damped.tyres)
    written = SpatialReference(damped)
    built = [build_spatial(engine, damped) for engine in ENGINES[1:]]
    for _ in range(30):
        q, v = random.uniform(-0.08, 0.08, n), random.uniform(-3.0, 3.0, n)
        road = np.concatenate([random.uniform(-0.1, 0.1, w), random.uniform(-3.0, 3.0, w)])
        wanted = written.acceleration(0.0, q, v, road)
        for model in built:
            assert np.abs(model.acceleration(0.0, q, v, road) - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_a_ride_lifts_in_both_engines_and_in_copies():
    own = ride_scene("quarter_car_nonlinear")
    vehicle = vehicle_of(own)
    road = road_path(excitation_of(own, wheels(vehicle)), 20.0, 5e-4)
    runs = [drive_over_road(engine, vehicle, road, 2.0, road_seed=2) for engine in ENGINES[1:]]
    assert np.abs(runs[0].run.positions - runs[1].run.positions).max() < 1e-12
    load = static_preloads(vehicle).tyres[vehicle.tyres[0].name]
    force = runs[0].output_values("tyre force front left")
    assert force.min() == pytest.approx(-load) and 0.1 < (force <= -load + 1e-9).mean() < 0.6
    march = CopiesMarch(vehicle, 20.0, road.step, 1)
    march.states = np.zeros((2 * len(vehicle.coordinates()), 1))  # the engines begin at rest in the design position
    march.march_over(road.wheel_heights_and_rates(runs[0].run.counts["steps"], 2)[:, :, None], 0)
    # a quarter car goes up and down alone, so that small motion is all that it has
    assert np.abs(march.states[:, 0] - np.concatenate([runs[1].run.positions[-1], runs[1].run.rates[-1]])).max() < 1e-11


def test_copies_whose_tyres_stay_on_the_road_are_the_linear_ones():
    own = ride_scene("quarter_car", 1e-6)
    vehicle, linear = vehicle_of(own), vehicle_of(own).with_tyres(pushes_only=False)
    road = excitation_of(own, wheels(vehicle))
    lifted, plain = (copies_in_time(each, road, 20.0, 1.0, copy_count=3) for each in (vehicle, linear))
    assert np.allclose(lifted.moments, plain.moments, rtol=1e-12)


def test_routes_of_covariance_refuse_and_name_the_one_in_time():
    own = ride_scene()
    with pytest.raises(InputError, match=r"effects\.lift_off: has no covariance: use the study ride_nonlinear"):
        check_linear(own, vehicle_of(own))
    with pytest.raises(InputError, match="may lift"):
        statistically_linear(vehicle_of(own), excitation_of(own, wheels(vehicle_of(own))), 20.0)
    with pytest.raises(InputError, match="needs the effect 'gravity_and_preload'"):
        ride_scene(vehicle={"file": "r19_ride"})
    with pytest.raises(InputError, match="in small motion no wheel leaves the road"):
        vehicle_of(ride_scene(vehicle={"file": "r19_ride", "operating_point": "loaded", "small_motion": True}))
    with pytest.raises(InputError, match="must bear"):
        static_preloads(load_vehicle("half_car").with_tyres(pushes_only=True))  # without gravity


def test_the_answer_of_a_ride_that_lifts_is_that_of_its_copies(tmp_path):
    own = ride_scene("quarter_car", study="ride_nonlinear", options={"copies": 12, "lasting": 1.0, "beside": [20.0]})
    found = ride_nonlinear.run(own, ("reference",), tmp_path, lambda *_: None)
    vehicle = vehicle_of(own)
    copies = copies_in_time(vehicle, excitation_of(own, wheels(vehicle)), 20.0, 1.0, copy_count=12, seed=1)
    name = "tyre force front left"
    assert found["answer"]["deviation"][name] == [pytest.approx(copies.deviation[copies.names.index(name)])]
    told = "\n".join(found["table"])
    assert "no answer where a tyre would pull" in told and "its deviation is good to" not in told


def test_a_choice_of_effects_runs_in_time_and_may_leave_it_out():
    whole = copies_of_scene(ride_scene("half_car", options={"copies": 12, "lasting": 1.0}))
    assert "lift_off" in whole.effect_names
    pace = whole.steps_at_speeds[0]
    assert whole.vehicle(pace).lifts and not whole.without(["lift_off"]).vehicle(pace).lifts


# hub forces -------------------------------------------------------------------------------------------------------


def hubs(road_class="E", **effects):
    return build_hubs(
        {
            "title": "t",
            "system": "hub-forces",
            "vehicle": {"file": "r19_free"},
            "road": {"iso8608": road_class},
            "run": {"duration": 2.0},
            "effects": effects,
        },
        "s.toml",
    ).cut_vehicle()


def test_hub_forces_of_wheels_in_the_air_are_none_in_every_engine():
    car, roads = hubs(lift_off={}), [iso8608_road("E", seed) for seed in (1, 2)]
    drive = road_under_wheels(car, *roads, 20.0, 1e-3, 2000)
    runs = {engine: true_run(engine, car, drive, "inertial", 1e-3, 2.0) for engine in ENGINES}
    for engine in ENGINES[1:]:
        assert np.abs(runs[engine].states - runs["reference"].states).max() < 1e-12
    wrenches = runs["reference"].wrenches
    air = wrenches[:, :, 2] == 0.0
    assert wrenches[:, :, 2].min() == 0.0 and 0.02 < air.mean() < 0.3
    assert np.abs(wrenches[air]).max() == 0.0  # neither along nor across, and no moment
    linear = true_run("reference", hubs(), drive, "inertial", 1e-3, 2.0).wrenches
    assert linear[:, :, 2].min() < -1000.0


def test_hub_loads_are_the_law_of_where_the_engine_says_the_hubs_are():
    """Independent of the compiled kernel: places and rates from MuJoCo's own Jacobians, the law written here."""
    import mujoco

    from models.engines.cut_vehicle import build as hub_model

    car = hubs(lift_off={})
    car = replace(car, uncut=replace(car.uncut, tyres=tuple(replace(t, damping=500.0) for t in car.uncut.tyres)))
    drive = road_under_wheels(car, *(iso8608_road("E", seed) for seed in (1, 2)), 20.0, 1e-3, 100)
    own = hub_model("mujoco", car, replace(drive, frame="inertial"), 1e-3, 0.1)
    model, data = own.model.model, own.model.data
    random = np.random.default_rng(2)
    names = [body.name for body in car.tree.bodies]
    for _ in range(20):
        q, v = random.uniform(-0.05, 0.05, car.size), random.uniform(-2.0, 2.0, car.size)
        loads = own.reported(np.zeros(1), np.concatenate([q, v])[None]).wrenches[0, :, 2]
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for i, tyre in enumerate(car.uncut.tyres):
            body, jacobian = int(model.body(str(names.index(tyre.body))).id), np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, data.xpos[body], body)
            height, rate = drive.hubs[0, i], drive.hubs[0, 4 + i]
            spring = car.loads[i] + tyre.stiffness * (height - data.xpos[body][2] + tyre.point[2])
            wanted = max(0.0, min(spring + 500.0 * (rate - jacobian[2] @ v), 2.0 * spring))
            assert loads[i] == pytest.approx(wanted, abs=1e-6)


def test_measured_hub_forces_have_no_tyre_that_could_lift():
    table = {
        "title": "t",
        "system": "hub-forces",
        "vehicle": {"file": "r19_free"},
        "forces": {"file": "f.csv"},
        "angles": {"file": "a.csv"},
        "effects": {"lift_off": {}},
    }
    with pytest.raises(InputError, match="lift_off: needs the effect 'virtual_measurement', for no tyre is below"):
        build_hubs(table, "s.toml")
