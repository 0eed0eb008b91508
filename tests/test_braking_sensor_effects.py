"""Noise, quantisation and calibration of what passes a brake controller's port: each comes and goes alone."""

import pytest

from models.brake.port.sensors import SensorConversion
from models.core.errors import InputError
from models.core.scene_effects import check_combination, named_effects, scene_without, with_effects
from validation.absence.of_systems import bare_scene

SENSORS = tuple(f"{what}_{how}" for what in ("signal", "pressure") for how in ("noise", "quantisation", "calibration"))


@pytest.fixture(scope="module")
def full():
    return with_effects(bare_scene("braking"), "port", *SENSORS)


@pytest.mark.parametrize("name", SENSORS)
def test_each_leaves_alone_and_takes_all_of_its_own_with_it(full, name):
    less = scene_without(full, name)
    assert {*named_effects(full)} - {*named_effects(less)} == {name}
    assert named_effects(scene_without(less, *(other for other in SENSORS if other != name))) == ("port",)


def test_what_is_left_is_a_perfect_sensor(full):
    bare_port = scene_without(full, *SENSORS).port
    assert bare_port.signals == bare_port.pressures == SensorConversion()


def test_a_sensor_needs_a_port(full):
    with pytest.raises(InputError, match="needs the effect 'port'"):
        check_combination(SENSORS[:1], full)
    assert "signal_noise" not in named_effects(
        bare_scene("braking", port={"signals": {"seed": 3}})
    )  # a seed is no noise


def test_what_needs_another_effect_is_told_and_not_taken_along(full):
    """Deleting [port] would delete its sensors."""
    with pytest.raises(InputError, match=r"port cannot be left out alone: leave out pressure_calibration and .* too"):
        scene_without(full, "port")
    assert named_effects(scene_without(full, "port", *SENSORS)) == ()
