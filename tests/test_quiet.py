"""A failed MuJoCo run leaves no log file and prints nothing of its own."""

import pytest

from models.core.errors import RunFailed
from models.engines import mujoco as adapter
from models.engines.assembly import Settings
from models.systems.pitch_plane.scene import assembly_of_scene, build


def test_a_run_that_blows_up_is_one_error_and_nothing_else(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    scene = build({"title": "test", "run": {"duration": 2.0, "step": 1e-3}, "start": {"z3": -0.2}})
    model = adapter.build(assembly_of_scene(scene), Settings("RK4", 8e-3, 2.0))
    with pytest.raises(RunFailed, match=r"mujoco: .*last good state"):
        model.run()
    out, err = capfd.readouterr()
    assert out == err == "" and list(tmp_path.iterdir()) == []
