"""Readings of gyro and pitch sensor: at their own instants, with their own noise, and as files."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.noise import GYRO, PITCH_SENSOR, normal_samples
from models.core.time_series import read_time_series
from models.engines.assembly import Settings
from models.sensors.inertial_unit import DEGREES_PER_HOUR, angle_variance, bias_path
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.sampling import write_samples
from models.systems.pitch_plane.scene import assembly_of_scene, build

ENGINES = ("reference", "exudyn", "mujoco")


def scene(effects, step=5e-4, **engines):
    return build(
        {
            "title": "test",
            "run": {"duration": 0.4, "step": step},
            "start": {"pitch": 0.05},
            "effects": effects,
            "engines": engines,
        }
    )


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("engine", ENGINES)
def test_readings_are_the_truth_at_their_instants_plus_their_own_noise(engine):
    gyro = {"sampling_rate": 200.0, "deviation": 0.02, "seed": 4, "path": 2}
    sensor = {"sampling_rate": 100.0, "deviation": 0.01, "seed": 4, "path": 2}
    run = simulate(scene({"gyro": gyro, "pitch_sensor": sensor}), engine)
    rows = np.arange(801)
    for channel, true, every, deviation, source in (
        ("gyro", "pitch_rate", 10, 0.02, GYRO),
        ("pitch_reading", "pitch", 20, 0.01, PITCH_SENSOR),
    ):
        noise = deviation * normal_samples(4, 2, 800 // every + 1, 1, noise_source=source)[:, 0]
        assert np.array_equal(run[channel], run[true][rows - rows % every] + noise[rows // every])
    assert np.array_equal(run.states, simulate(scene({}), engine).states)


def test_instruments_of_one_seed_are_independent():
    draws = [normal_samples(7, 0, 20_000, 1, noise_source=source)[:, 0] for source in range(4)]
    off = np.corrcoef(draws)[np.triu_indices(4, 1)]
    assert np.abs(off).max() < 4.0 / np.sqrt(20_000)  # 4 standard errors; the same stream would give 1


@pytest.mark.grounds("closed form")
def test_bias_stands_on_the_gyro_and_beside_it():
    gyro = {"sampling_rate": 1000.0, "deviation": 0.02}
    own = {"turn_on": 10.0, "instability": 3.0, "correlation_time": 0.1, "seed": 5}
    plain, biased = (simulate(scene({"gyro": gyro, **more}), "reference") for more in ({}, {"gyro_bias": own}))
    assert np.array_equal(biased["gyro"], plain["gyro"] + biased["gyro_bias"])
    drift = bias_path(401, 1e-3, 10 * DEGREES_PER_HOUR, 3 * DEGREES_PER_HOUR, 0.1, 5, 0)
    assert np.array_equal(biased["gyro_bias"], np.repeat(drift, 2)[:801])
    assert np.ptp(drift) > 0


def test_bias_needs_a_gyro():
    with pytest.raises(InputError, match="needs the effect 'gyro'"):
        simulate(scene({"gyro_bias": {"turn_on": 1.0}}), "reference")


@pytest.mark.grounds("closed form")
def test_stationary_bias_of_any_sampling_rate():
    """4,000 paths at two rates: the variance at each end and the correlation over one correlation time."""
    for later, period in ((2, 0.25), (20, 0.025)):
        ends = np.array([bias_path(later + 1, period, 0.0, 2.0, 0.5, 1, path)[[0, later]] for path in range(4000)])
        covariance = ends.T @ ends / 4000
        # 99.9 % of a mean of 4,000 squares lies within 3.3 sqrt(2 / 4000), 7.4 %
        assert covariance[0, 0] == pytest.approx(4.0, rel=0.074) and covariance[1, 1] == pytest.approx(4.0, rel=0.074)
        assert covariance[0, 1] == pytest.approx(4.0 * np.exp(-1), abs=3.3 * 4 * np.sqrt((1 + np.exp(-2)) / 4000))


def test_angle_variance_at_its_limits():
    """A bias that never forgets is a constant one, 2 tau below its length white noise of intensity 2 b^2 tau."""
    time = np.array([1e-6, 1.0, 50.0])
    assert angle_variance(time, 0.0, 0.0, 0.3, 1e12) == pytest.approx(angle_variance(time, 0.0, 0.3, 0.0, 1.0))
    fast, white = (angle_variance(np.array(1e4), *own) for own in ((0, 0, 0.3, 0.01), (0.3 * 0.02**0.5, 0, 0, 1.0)))
    assert fast == pytest.approx(white, rel=2e-6)  # 1 - tau / t


def test_readings_are_written_as_other_effects_read_them(tmp_path):
    sensor = {"sampling_rate": 100.0, "deviation": 0.01}
    run = simulate(scene({"pitch_sensor": sensor}), "reference")
    write_samples(run, {"pitch": "pitch_reading"}, 100.0, tmp_path / "pitch.csv")
    values, period = read_time_series(tmp_path / "pitch.csv", {"pitch": {"rad": 1.0}})
    assert period == 0.01 and np.array_equal(values[:, 0], run["pitch_reading"][::20])
    with pytest.raises(InputError, match="do not fit"):
        write_samples(run, {"pitch": "pitch_reading"}, 300.0, tmp_path / "other.csv")


def test_a_rate_that_falls_between_the_steps_is_refused():
    with pytest.raises(InputError, match="must be a multiple"):
        simulate(scene({"gyro": {"sampling_rate": 300.0, "deviation": 0.1}}), "reference")
    own = scene({"pitch_sensor": {"sampling_rate": 100.0, "deviation": 0.1}}, exudyn={"integrator": "DOPRI5"})
    with pytest.raises(InputError, match="needs a row"):
        assembly_of_scene(own)
    uneven = scene({"gyro": {"sampling_rate": 100.0, "deviation": 0.1}})
    with pytest.raises(InputError, match="needs a row"):
        simulate(uneven, "reference", Settings("RK4", 4e-3, 0.4))
