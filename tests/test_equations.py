"""The hand-written equations against the paper's matrices, and against what must hold of any vehicle."""

import numpy as np
import pytest

from models.engines.reference import compiled_derivative
from models.vehicles.description import mass_damping_stiffness
from models.vehicles.parameters import asymmetric_twin, itwm_drift
from models.vehicles.pitch_plane import equilibrium, pitch_plane_vehicle

SETS = {"itwm_drift": itwm_drift.PARAMETERS, "asymmetric_twin": asymmetric_twin.PARAMETERS}
RANDOM = np.random.default_rng(7)


@pytest.fixture(params=SETS)
def p(request):
    return SETS[request.param]


def paper_matrix(p, beta):
    """M (diagonal) and A of M x' = A x + F, typed from eq. (37), without the contact points."""
    s, c = (np.sin(beta) / beta if beta else 1.0), np.cos(beta)
    k1, k3, k4, d1, d3, d4, a, b = p.k1, p.k3, p.k4, p.d1, p.d3, p.d4, p.a, p.b
    del k1, d1
    stiff = np.array(
        [
            [-k3, 0, k3, -b * k3 * s],
            [0, -k4, k4, a * k4 * s],
            [k3, k4, -k3 - k4, (b * k3 - a * k4) * s],
            [-b * k3 * c, a * k4 * c, (b * k3 - a * k4) * c, (-b * b * k3 - a * a * k4) * s * c],
        ]
    )
    damp = np.array(
        [
            [-d3, 0, d3, -b * d3 * c],
            [0, -d4, d4, a * d4 * c],
            [d3, d4, -d3 - d4, (b * d3 - a * d4) * c],
            [-b * d3 * c, a * d4 * c, (b * d3 - a * d4) * c, (-b * b * d3 - a * a * d4) * c * c],
        ]
    )
    return np.array([p.m1, p.m2, p.m3, p.I]), stiff, damp


@pytest.mark.grounds("written equations")
def test_force_excitation_is_equation_37(p):
    for _ in range(50):
        y, f = RANDOM.uniform(-0.7, 0.7, 8), RANDOM.uniform(-1e4, 1e4, 2)
        mass, stiff, damp = paper_matrix(p, y[3])
        load = np.array([p.m1 * p.g - f[0], p.m2 * p.g - f[1], p.m3 * p.g, 0.0])
        expected = (stiff @ y[:4] + damp @ y[4:] + load) / mass
        found = compiled_derivative("force", "exact")(y, f, p.array())
        assert np.allclose(found[:4], y[4:], rtol=0, atol=0)
        # 1e-12 of the largest: a dozen products of doubles
        assert np.abs(found[4:] - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.grounds("written equations")
def test_road_excitation_is_equation_38(p):
    for _ in range(50):
        y, u = RANDOM.uniform(-0.7, 0.7, 8), RANDOM.uniform(-1, 1, 4)
        mass, stiff, damp = paper_matrix(p, y[3])
        stiff[0, 0] -= p.k1
        stiff[1, 1] -= p.k2
        damp[0, 0] -= p.d1
        damp[1, 1] -= p.d2
        load = np.array(
            [p.m1 * p.g + p.k1 * u[0] + p.d1 * u[2], p.m2 * p.g + p.k2 * u[1] + p.d2 * u[3], p.m3 * p.g, 0.0]
        )
        expected = (stiff @ y[:4] + damp @ y[4:] + load) / mass
        found = compiled_derivative("road", "exact")(y, u, p.array())[4:]
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.grounds("written equations")
def test_prescribed_pitch_is_equation_39_with_its_third_row_repaired(p):
    for _ in range(50):
        y, f = RANDOM.uniform(-0.7, 0.7, 8), RANDOM.uniform(-1e4, 1e4, 2)
        beta, rate, second = RANDOM.uniform(-0.7, 0.7, 3)
        s, c = np.sin(beta), np.cos(beta)
        z, w = y[:3], y[4:7]
        rows = (
            np.array([[-p.k3, 0, p.k3], [0, -p.k4, p.k4], [p.k3, p.k4, -p.k3 - p.k4]]) @ z
            + np.array([[-p.d3, 0, p.d3], [0, -p.d4, p.d4], [p.d3, p.d4, -p.d3 - p.d4]]) @ w
        )
        load = np.array(
            [
                p.m1 * p.g - f[0] - p.k3 * p.b * s - p.d3 * p.b * rate * c,
                p.m2 * p.g - f[1] + p.k4 * p.a * s + p.d4 * p.a * rate * c,
                p.m3 * p.g + (p.k3 * p.b - p.k4 * p.a) * s + (p.d3 * p.b - p.d4 * p.a) * rate * c,
            ]
        )
        expected = (rows + load) / np.array([p.m1, p.m2, p.m3])
        u = np.array([*f, beta, rate, second])
        found = compiled_derivative("pitch", "exact")(y, u, p.array())
        assert np.abs(found[4:7] - expected).max() <= 1e-12 * np.abs(expected).max()
        assert found[7] == second


@pytest.mark.grounds("closed form")
def test_linear_geometry_is_the_linearisation(p):
    mass, damping, stiffness = mass_damping_stiffness(pitch_plane_vehicle(p, "linear"))
    for _ in range(20):
        y = RANDOM.uniform(-0.5, 0.5, 8)
        weight = p.g * np.array([p.m1, p.m2, p.m3, 0.0])
        expected = np.linalg.solve(mass, weight - stiffness @ y[:4] - damping @ y[4:])
        found = compiled_derivative("road", "linear")(y, np.zeros(4), p.array())[4:]
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


def level(p, y, load):
    """Accelerations (4,) by eq. (37) with A(0): linearised about zero pitch; load : N on the wheels and the chassis, N
    m on its pitch."""
    mass, stiff, damp = paper_matrix(p, 0.0)
    return (stiff @ y[:4] + damp @ y[4:] + load) / mass


@pytest.mark.grounds("written equations")
def test_linear_forms_with_forces_and_guides_are_the_paper_s_at_no_pitch(p):
    for _ in range(20):
        y, f, guide = RANDOM.uniform(-0.7, 0.7, 8), RANDOM.uniform(-1e4, 1e4, 2), RANDOM.uniform(-0.7, 0.7, 6)
        load = np.array([p.m1 * p.g - f[0], p.m2 * p.g - f[1], p.m3 * p.g, 0.0])
        free = compiled_derivative("force", "linear")(y.copy(), f, p.array())
        assert free == pytest.approx(np.concatenate((y[4:], level(p, y, load))), rel=1e-12)
        pitched = y.copy()
        pitched[[3, 7]] = guide[:2]
        by_pitch = compiled_derivative("pitch", "linear")(y.copy(), np.concatenate((f, guide[:3])), p.array())
        expected = np.concatenate((pitched[4:], level(p, pitched, load)[:3], guide[2:3]))
        assert by_pitch == pytest.approx(expected, rel=1e-12)
        y[[2, 3, 6, 7]] = guide[:4]
        both = compiled_derivative("heave-pitch", "linear")(y.copy(), np.concatenate((f, guide)), p.array())
        assert both == pytest.approx(np.concatenate((y[4:], level(p, y, load)[:2], guide[4:])), rel=1e-12)


def pushing(stiffness, damping, pressed, rate):
    """Force (N) of a tyre that never pulls: none in the air; pressed, that of spring and damper between zero and twice
    the spring's."""
    return (
        0.0 if pressed <= 0.0 else float(np.clip(stiffness * pressed + damping * rate, 0.0, 2.0 * stiffness * pressed))
    )


@pytest.mark.grounds("written equations")
@pytest.mark.parametrize("geometry", ["exact", "linear"])
def test_tyres_that_only_push_are_wheel_forces_of_equation_37(p, geometry):
    """Pressed by a few centimetres, released and in the air; damping from none to twice the spring's force."""
    seen = set()
    for _ in range(60):
        y, u = RANDOM.uniform(-0.7, 0.7, 8), RANDOM.uniform(-0.02, 0.02, 4)
        y[:2] = RANDOM.uniform(-0.02, 0.04, 2)
        u[2:] = y[4:6] + RANDOM.uniform(-1.0, 1.0, 2)
        tyres = ((p.k1, 300.0), (p.k2, 500.0))
        forces = [pushing(*tyre, y[i] - u[i], y[4 + i] - u[2 + i]) for i, tyre in enumerate(tyres)]
        seen |= {force > 0.0 for force in forces}
        mass, stiff, damp = paper_matrix(p, y[3] if geometry == "exact" else 0.0)
        load = np.array([p.m1 * p.g - forces[0], p.m2 * p.g - forces[1], p.m3 * p.g, 0.0])
        expected = np.concatenate((y[4:], (stiff @ y[:4] + damp @ y[4:] + load) / mass))
        damped = p.model_copy(update={"d1": 300.0, "d2": 500.0})
        assert compiled_derivative("lift-off", geometry)(y, u, damped.array()) == pytest.approx(expected, rel=1e-11)
    assert seen == {True, False}


@pytest.mark.parametrize("geometry", ["exact", "linear"])
def test_static_equilibrium_is_at_rest(p, geometry):
    y = equilibrium(p, geometry)
    rest = compiled_derivative("road", geometry)(y, np.zeros(4), p.array())
    # forces of some kN on 15 kg cancel to their last digits
    assert np.abs(rest).max() < 1e-10


def test_equilibrium_of_the_published_vehicle():
    # by hand: 7651.8 N over two tyres of 2e5 N/m, chassis 3678.75 N a spring; printed figures 0.0191295, 0.0559170
    assert equilibrium(itwm_drift.PARAMETERS)[:4] == pytest.approx([0.0191295, 0.0191295, 0.055917, 0.0], abs=1e-9)


@pytest.mark.grounds("closed form")
def test_body_fixed_forces_have_no_cosine_in_their_moment(p):
    """Without wheel mass and gravity the pitch row of body-fixed forces is b f1 - a f2 at every angle."""
    light = p.model_copy(update={"m1": 1e-9, "m2": 1e-9, "g": 0.0})
    f = np.array([5000.0, 3000.0])
    for beta in (0.0, 0.3, -0.6):
        # with weightless wheels at rest the struts carry f cos(beta) each
        y = np.zeros(8)
        y[3] = beta
        y[0] = -p.b * np.sin(beta) - f[0] * np.cos(beta) / p.k3
        y[1] = p.a * np.sin(beta) - f[1] * np.cos(beta) / p.k4
        found = compiled_derivative("force-body", "exact")(y, f, light.array())[7] * p.I
        assert found == pytest.approx(p.b * f[0] - p.a * f[1], rel=1e-12)


def test_a_nose_up_moment_lifts_the_front(p):
    """More force at the front wheel than at the rear one pitches the nose up (positive)."""
    y = equilibrium(p)
    y[0] += 0.01
    assert compiled_derivative("force", "exact")(y, np.array([p.k1 * y[0], p.k2 * y[1]]), p.array())[7] < 0
    y[0] -= 0.02
    assert compiled_derivative("force", "exact")(y, np.array([p.k1 * y[0], p.k2 * y[1]]), p.array())[7] > 0


@pytest.mark.parametrize("interpolation", ["held", "linear", "smooth"])
@pytest.mark.parametrize("guided", [False, True])
def test_accelerations_agree_at_any_sample(tmp_path, interpolation, guided):
    """The audit of force-excited scenes: every implementation reads the sample of the asked time."""
    from models.core.time_series import write_time_series
    from models.engines.protocol import build
    from models.systems.pitch_plane.scene import assembly_of_scene, settings_of
    from models.systems.pitch_plane.scene import build as build_scene

    t = 1e-3 * np.arange(301)
    write_time_series(tmp_path / "f.csv", {"front": ("N", 4e3 + 3e6 * t**2), "rear": ("N", 3e3 - 1e4 * t)}, 1e-3)
    write_time_series(tmp_path / "p.csv", {"pitch": ("rad", 0.1 * np.sin(9 * t))}, 1e-3)
    meant = ["weight", "balance"]  # any forces will do: nothing is run
    effects = {"wheel_forces": {"file": "f.csv", "interpolation": interpolation, "accept": meant}}
    effects |= {"prescribed_pitch": {"file": "p.csv"}} if guided else {}
    scene = build_scene({"title": "test", "run": {"duration": 0.3, "step": 1e-3}, "effects": effects}, "", tmp_path)
    assembly = assembly_of_scene(scene)
    # Exudyn's generalised-alpha refuses held samples, and a prescribed pitch has no other integrator there
    engines = ("reference", "mujoco") if guided and interpolation == "held" else ("reference", "exudyn", "mujoco")
    models = [build(engine, assembly, settings_of(scene, engine)) for engine in engines]
    for time in (0.0, 0.1, 0.2):
        y = RANDOM.uniform(-0.3, 0.3, 8)
        if guided:
            y[[3, 7]] = assembly.input.at(time)[2:4]
        first, *others = (model.acceleration(time, *np.split(y, 2)) for model in models)
        for found in others:
            assert np.abs(found - first).max() <= 1e-12 * np.abs(first).max()
