"""Growth of errors: the tangent against a small difference of runs, the laws against 50 digits, what limits a run."""

import math
from dataclasses import replace
from decimal import Decimal, getcontext

import numpy as np
import pytest

from models.core.noise import normal_samples
from models.core.systems import load
from models.drift import growth as law
from models.engines.protocol import build
from models.systems.pitch_plane.effects import pitch_spring
from models.systems.pitch_plane.plan import describe, trust_line
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene, settings_of
from models.systems.pitch_plane.tangent import (
    TangentPath,
    covariance_over_time,
    slow_swing_frequency,
    tangent_path_of,
    tilt_error_columns,
)
from models.systems.pitch_plane.trust import (
    interpolation_error_curve,
    model_error_curve,
    noise_error_curve,
    pitch_error_growth,
    predict_trust,
)
from models.systems.pitch_plane.virtual_measurement import write_measurement
from studies.command.asked import SCENES_FOLDER
from studies.trust import run as run_study
from validation.common.scenes import VEHICLE_SETS, force_scene, road_scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six seconds of wheel forces at 1 kHz and 100 Hz."""
    place = tmp_path_factory.mktemp("forces")
    true = simulate(road_scene(step=1e-3, duration=6.0), "reference")
    write_measurement(true, place, 1e-3)
    (place / "slow").mkdir()
    write_measurement(true, place / "slow", 1e-2)
    return place


def states(assembly):
    return build("reference", assembly, settings_of(assembly.scene, "reference")).run().states


@pytest.mark.parametrize("mode", ["force", "force-body"])
@pytest.mark.parametrize("parameters", VEHICLE_SETS)
def test_tangent_is_the_difference_of_two_runs(folder, mode, parameters):
    forces = {"file": "wheel_forces.csv", "interpolation": "linear", "accept": ["weight", "balance", "swapped"]}
    scene = force_scene(folder, parameters, 1e-3, 2.0, effects={"wheel_forces": forces})
    assembly = replace(assembly_of_scene(scene), mode=mode)
    small = 1e-6 * np.array([1.0, -2.0, 0.5, 1.0, 3.0, -1.0, 0.2, 1.0])
    _, columns = tangent_path_of(assembly).propagate_errors(small[None] / 1e-6)
    moved = [states(replace(assembly, initial=assembly.initial + sign * small)) for sign in (1, -1)]
    # central difference of 1e-6: second-order error 1e-12, rounding 1e-10 of it
    assert np.abs((moved[0] - moved[1]) / 2e-6 - columns[:, 0]).max() < 1e-5 * np.abs(columns).max()


def test_tangent_of_a_wrong_model_and_of_wrong_forces(folder):
    assembly = assembly_of_scene(force_scene(folder, duration=2.0, step=1e-3))
    p = assembly.parameters
    other = p.model_copy(update={"I": p.I * 1.0001, "k3": p.k3 * 0.9999})
    _, columns = tangent_path_of(assembly).propagate_errors(np.zeros((1, 8)), wrong_parameters=other)
    found = states(replace(assembly, parameters=other)) - states(assembly)
    assert np.abs(found - columns[:, 0]).max() < 1e-3 * np.abs(found).max()  # second order in 1e-4
    pushes = np.full((3 * 2000, 1, 2), [[0.01, -0.02]])
    _, columns = tangent_path_of(assembly).propagate_errors(np.zeros((1, 8)), pushes)
    wrong = assembly.input.values + np.array([0.01, -0.02])
    found = states(replace(assembly, input=replace(assembly.input, values=wrong)))
    assert np.abs(found - states(assembly) - columns[:, 0]).max() < 1e-3 * np.abs(columns).max()


def test_linear_geometry_and_body_forces_do_not_grow(folder):
    scene = force_scene(folder, duration=6.0, step=1e-3)
    assembly = assembly_of_scene(scene)
    linear = replace(assembly, vehicle=replace(assembly.vehicle, geometry="linear"))
    _, columns = tangent_path_of(linear).propagate_errors(tilt_error_columns(linear))
    assert columns[-1, 0, 3] == pytest.approx(1.0, abs=1e-9) and columns[-1, 1, 3] == pytest.approx(6.0, rel=1e-6)
    body = replace(assembly, mode="force-body")
    assert slow_swing_frequency(tangent_path_of(body)) > 0 and slow_swing_frequency(tangent_path_of(assembly)) == 0
    assert (
        pitch_error_growth(linear).rate == pitch_error_growth(body).rate == 0
        and 0.3 < pitch_error_growth(assembly).rate < 0.5
    )


@pytest.mark.parametrize("product", ["1e-8", "1e-4", "0.0499", "0.0501", "0.7", "9"])
def test_sinh_law_keeps_its_digits(product):
    getcontext().prec = 50
    x = 2 * Decimal(product)
    exact = ((x.exp() - (-x).exp()) / 2 - x) / (4 * Decimal(product) ** 3)
    assert float(law.pitch_variance(1.0, float(product), 1.0)) == pytest.approx(float(exact), rel=1e-13)


def test_drift_off_time_solves_the_law():
    for rate in (0.0, 0.01, 0.4, 2.0):
        time = law.drift_off_time(rate, 1e-6, 0.05)
        assert law.MEDIAN_OF_NORMAL * math.sqrt(law.pitch_variance(time, rate, 1e-6)) == pytest.approx(0.05, rel=1e-9)


def test_rigid_vehicle_about_the_common_centre_of_mass():
    """Momentum of the rigid linear vehicle: the pitch acceleration under forces, from the 2 x 2 mass matrix."""
    from models.vehicles.parameters.asymmetric_twin import PARAMETERS as p

    rigid = law.rigid_pitch(p)
    c, mass = p.b * p.m1 - p.a * p.m2, p.m1 + p.m2 + p.m3
    matrix = np.array([[mass, -c], [-c, p.I + p.m1 * p.b**2 + p.m2 * p.a**2]])
    for forces in ([1.0, 0.0], [0.0, 1.0]):
        pushed = np.linalg.solve(matrix, [-sum(forces), p.b * forces[0] - p.a * forces[1]])
        assert rigid.moment(np.array([forces]))[0] / rigid.total_inertia == pytest.approx(pushed[1], rel=1e-12)


@pytest.mark.parametrize("rule", ["linear", "held"])
@pytest.mark.parametrize("step", [1e-3, 2.5e-3])
def test_covariance_is_that_of_the_samples(folder, rule, step):
    """Linearised, every path is a sum over its samples, so the variance is the sum of their squares: no chance."""
    scene = force_scene(folder / "slow", duration=1.0, step=step, interpolation=rule)
    assembly = assembly_of_scene(scene)
    expected = covariance_over_time(assembly, 20.0, step).matrices[-1]
    path = tangent_path_of(assembly, step)
    responses = []
    for sample in range(path.samples + 1):
        for wheel in range(2):
            values = np.zeros_like(assembly.input.values)
            values[sample, wheel] = 20.0
            table = replace(path, forces=replace(assembly.input, values=values)).forces_at_stages
            stages = [table] * 3 if rule == "held" else [table[0:-1:2], table[1::2], table[2::2]]
            pushes = np.stack(stages, axis=1).reshape(-1, 1, 2)
            responses.append(path.propagate_errors(np.zeros((1, 8)), pushes)[1][-1, 0])
    found = np.array(responses).T @ np.array(responses)
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def test_covariance_refuses_a_spline(folder):
    with pytest.raises(ValueError, match="spline"):
        covariance_over_time(assembly_of_scene(force_scene(folder, duration=1.0, interpolation="smooth")), 1.0)


def test_held_run_has_no_path(folder):
    assembly = assembly_of_scene(force_scene(folder, duration=1.0))
    held = pitch_spring.extend(assembly, pitch_spring.Parameters(stiffness=100.0))
    with pytest.raises(ValueError, match="held"):
        tangent_path_of(held)
    assert predict_trust(held) is None and trust_line(held) == []


def test_trust_names_what_comes_first(folder):
    """Noise of 300 N drifts off in seconds; without it and at 1 kHz six seconds are not limited by anything."""
    noisy = force_scene(folder, duration=6.0, effects={"force_noise": {"deviation": 300.0}})
    name, time = predict_trust(assembly_of_scene(noisy)).until
    assert "300 N at 1000 Hz" in name and 1.0 < time < 4.0
    assert "trusted until about" in describe(noisy)
    assert "nothing known limits" in describe(force_scene(folder, duration=6.0))
    assert not [line for line in describe(road_scene()).splitlines() if line.startswith("  trust ")]


def test_noise_curve_scales_and_a_wrong_model_comes_from_its_inertia(folder):
    assembly = assembly_of_scene(force_scene(folder, duration=6.0, step=1e-3))
    once, twice = noise_error_curve(assembly, 10.0), noise_error_curve(assembly, 20.0)
    assert twice.size[-1] == pytest.approx(2 * once.size[-1], rel=1e-12)
    p = assembly.parameters
    wrong = {
        name: model_error_curve(assembly, p.model_copy(update={name: getattr(p, name) * 1.01})).size.max()
        for name in ("I", "k3", "k1")
    }
    assert wrong["I"] > 5 * wrong["k3"] and wrong["k1"] == 0.0  # the tyres are cut off


def test_interpolation_error_falls_with_the_square_of_the_period(folder):
    slow = interpolation_error_curve(assembly_of_scene(force_scene(folder / "slow", duration=5.0, step=1e-3)))
    fast = interpolation_error_curve(assembly_of_scene(force_scene(folder, duration=5.0, step=1e-3)))
    assert slow.size[-1] / fast.size[-1] == pytest.approx(100.0, rel=0.3)  # 40 Hz of road in samples of 10 ms


def test_monte_carlo_agrees_with_the_covariance(folder):
    """60 paths: standard deviation known to 1 / sqrt(120) = 9 %, three times that allowed."""
    assembly = assembly_of_scene(force_scene(folder, duration=4.0, step=1e-3))
    quiet, values = states(assembly)[-1], assembly.input.values
    off = [
        states(
            replace(
                assembly, input=replace(assembly.input, values=values + 30.0 * normal_samples(5, i, len(values), 2))
            )
        )
        for i in range(60)
    ]
    found = np.sqrt(np.mean([(path[-1] - quiet) ** 2 for path in off], axis=0))
    expected = np.sqrt(np.diag(covariance_over_time(assembly, 30.0).matrices[-1]))
    assert found[3] / expected[3] == pytest.approx(1.0, abs=0.27)
    assert found[2] / expected[2] == pytest.approx(1.0, abs=0.27)


def test_study_predicts_what_it_measures(tmp_path):
    changes = ["run.duration=14.0", "options.paths=40"]
    found = run_study(load(SCENES_FOLDER / "trust.toml", changes), ("reference",), tmp_path, lambda text, part: None)
    rows = {row["source"]: row for row in found["rows"]}
    assert rows["inertia"]["measured"] == pytest.approx(rows["inertia"]["predicted"], rel=0.02)
    # the median of 40 paths, half of which lie within 25 % of it, is known to 5 %
    assert rows["noise"]["measured"] == pytest.approx(rows["noise"]["predicted"], rel=0.2)
    assert (tmp_path / "error_growth.png").exists() and any("samples at" in line for line in found["table"])


def test_study_on_a_file_of_ones_own(folder):
    table = {
        "title": "own",
        "study": "trust",
        "run": {"duration": 6.0, "step": 1e-3},
        "effects": {"wheel_forces": {"file": "wheel_forces.csv", "interpolation": "linear"}},
        "options": {"paths": 20, "noise_fraction": 0.02},
    }
    from models.systems.pitch_plane.scene import build as build_scene

    (folder / "out").mkdir()
    found = run_study(build_scene(table, "", folder), ("reference",), folder / "out", lambda text, part: None)
    rows = {row["source"]: row for row in found["rows"]}
    assert rows["inertia"]["measured"] is None  # no truth to compare with
    assert rows["noise"]["measured"] == pytest.approx(rows["noise"]["predicted"], rel=0.3)


def test_a_path_is_a_march_of_the_reference(folder):
    assembly = assembly_of_scene(force_scene(folder, duration=2.0, step=1e-3))
    found, _ = TangentPath(assembly, assembly.input, 1, 2000).propagate_errors(np.zeros((1, 8)))
    assert np.abs(found - states(assembly)).max() < 1e-12
