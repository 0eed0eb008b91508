"""Effects of virtual transducers, each left out and put in by itself."""

import pytest

from models.errors import InputError
from models.scene_effects import absent, beside, named, without
from models.systems import load
from studies.asked import SCENES
from validation.absence.measured import FAULTS
from validation.absence.of_systems import bare


def test_each_fault_of_transducers_comes_and_goes_alone():
    scene = load(SCENES / "recording.toml")
    assert "sensor_noise" in named(scene) and {*FAULTS} - {"sensor_noise"} <= {*absent(scene)}
    full = beside(scene, *(name for name in FAULTS if name != "sensor_noise"))
    for name in FAULTS:
        assert {*named(full)} - {*named(without(full, name))} == {name}
    assert without(full, *FAULTS).virtual.faults == type(full.virtual.faults)()  # nothing of any is left


@pytest.mark.parametrize("name", FAULTS)
def test_files_have_the_faults_that_they_have(name):
    with pytest.raises(InputError, match=r"virtual.faults.* needs a table \[virtual\], for files have the faults"):
        beside(bare("measured"), name)
