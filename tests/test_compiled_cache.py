"""Compiled kernels: each has a cache file of its own, and a change of the equations makes a new one."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import models
from models.engines.reference import compiled_derivative, compiled_march
from models.machine import compiled

MODES = (
    ("road", "exact"),
    ("road", "linear"),
    ("force", "exact"),
    ("force-body", "exact"),
    ("force", "exact", "springs"),
)


def test_no_two_kernels_share_a_cache_file():
    names = [make(*mode)._cache._impl.filename_base for make in (compiled_march, compiled_derivative) for mode in MODES]
    assert len(set(names)) == len(names)


def test_two_processes_never_write_the_same_file(tmp_path):
    """Both read an empty index, then each keeps its own signature: numba's own names would be one and the same."""
    from numba.core.caching import IndexDataCacheFile

    file = compiled_march("road", "exact")._cache._cache_file
    assert file._data_name(1) != file._data_name(1)
    plain = IndexDataCacheFile(str(tmp_path), "kernel", None)
    assert plain._data_name(1) == plain._data_name(1)  # as soon as this fails, numba has its own cure


def test_every_kernel_is_compiled_that_way():
    sources = {path.name: path.read_text() for path in Path(models.__file__).parent.rglob("*.py")}
    own = {name for name, text in sources.items() if "numba.njit(" in text or "from numba import njit" in text}
    assert own == {"compiled.py"}
    nested = [name for name, text in sources.items() if re.search(r"^ +@(register_jitable|njit)", text, re.MULTILINE)]
    assert not nested, "closures take a name of their own by models.machine.compiled.closure_with_unique_name"


FACTORY = """
from numba.extending import register_jitable
from models.machine.compiled import closure_with_unique_name, njit

def inner(factor):
    def times(x):
        total = 0.0
        for i in range(1000):  # long enough to stay a function of its own
            total += factor * x / (i + 1.0) - factor * x / (i + 1.0) + factor * x / 1000
        return total
    return register_jitable(NAMED)

def kernel(factor):
    times = inner(factor)
    def whole(x):
        return times(x) + times(2 * x)
    return njit(cache=True)(closure_with_unique_name(whole, int(factor)))
"""


def answers(folder, name, *factors):
    """Of kernels that a process of its own makes with these factors, its inner functions named or not."""
    (folder / "factory.py").write_text(FACTORY.replace("NAMED", name))
    command = [sys.executable, "-c", f"from factory import kernel; print([kernel(f)(1.0) for f in {list(factors)}])"]
    path = os.pathsep.join([str(folder), str(Path(models.__file__).parents[1])])
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": path}
    )
    return json.loads(done.stdout)


def test_closures_of_one_factory_never_stand_in_for_one_another(tmp_path):
    """Two processes keep a kernel each, a third loads both: each must call its own inner function, 3 times 1 x."""
    named = "closure_with_unique_name(times, int(factor))"
    assert answers(tmp_path, named, 2.0) == pytest.approx([6.0])
    assert answers(tmp_path, named, 3.0) == pytest.approx([9.0])
    assert answers(tmp_path, named, 2.0, 3.0) == pytest.approx([6.0, 9.0])


def test_a_change_of_the_equations_is_seen(tmp_path):
    """Copy the package, run, change a sign in the equations, run again: the answer must change."""
    import shutil

    copy = tmp_path / "models"
    shutil.copytree(Path(models.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    script = (
        "import numpy as np; from models.engines.reference import compiled_derivative; "
        "from models.vehicles.parameters.itwm_drift import PARAMETERS as p; "
        "print(compiled_derivative('road', 'exact')(np.full(8, 0.1), np.zeros(4), p.array())[7])"
    )

    def answer():
        done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
        return float(done.stdout)

    first, again = answer(), answer()
    equations = copy / "vehicles" / "pitch_plane_equations.py"
    equations.write_text(equations.read_text().replace("p[1] * f3 - p[0] * f4", "p[1] * f3 + p[0] * f4"))
    assert first == again and answer() != first


def test_machine_code_is_as_old_as_the_kernels_that_its_file_imports_from_other_folders(tmp_path, monkeypatch):
    for name, text in (
        ("a/mine.py", "from models.b.theirs import (  # both\n    f,\n    g,\n)"),
        ("b/theirs.py", "from models.c import deep as d"),
        ("c/deep.py", ""),
        ("c/other.py", ""),
    ):
        path = tmp_path / "models" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"from models.machine.compiled import lean\n{text}\n")
    monkeypatch.setattr(compiled, "ROOT", tmp_path)
    found = {}
    for changed in ("a/mine.py", "b/theirs.py", "c/deep.py", "c/other.py"):
        before = compiled.source_checksum(tmp_path / "models" / "a" / "mine.py")
        path = tmp_path / "models" / changed
        path.write_text(path.read_text() + "# changed\n")
        compiled.folder_checksum.cache_clear()
        found[changed] = compiled.source_checksum(tmp_path / "models" / "a" / "mine.py") != before
    assert found == {"a/mine.py": True, "b/theirs.py": True, "c/deep.py": True, "c/other.py": False}


def test_a_kernel_that_is_given_another_one_is_as_old_as_that():
    from models.brake.sprung_step import compiled as stepping
    from models.engines.mujoco_native import accelerate, march

    files = compiled._compiled_source_files(stepping("in_a_test", accelerate=accelerate, march=march).py_func)
    assert {file.name for file in files} >= {"sprung_step.py", "plane_step.py", "mujoco_native.py"}


RECORD = """
from typing import NamedTuple
from models.machine.compiled import compiled

class NAME(NamedTuple):
    x: float

@compiled
def twice(record):
    return 2.0 * record.x

print(twice(NAME(1.5)))
"""


def test_machine_code_of_a_class_that_is_gone_is_made_anew(tmp_path):
    """An update renames the class in a kernel's signature: the index that names it cannot be read any more."""
    (tmp_path / "script.py").write_text("import kernel")
    for name in ("Before", "After"):
        (tmp_path / "kernel.py").write_text(RECORD.replace("NAME", name))
        told = subprocess.run(
            [sys.executable, "script.py"],
            cwd=tmp_path,
            env=os.environ
            | {"NUMBA_CACHE_DIR": str(tmp_path / "kept"), "PYTHONPATH": str(Path(models.__file__).parents[1])},
            capture_output=True,
            text=True,
        )
        assert told.stdout == "3.0\n", told.stderr


def test_machine_code_is_kept_in_the_users_folder_where_the_packages_is_closed(tmp_path):
    """A file stands where the folder beside the source would be made, so that not even root can write there."""
    (tmp_path / "kernel.py").write_text(RECORD.replace("NAME", "Fixed"))
    (tmp_path / "__pycache__").write_text("")
    plain = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    kept = tmp_path / "of the user"
    told = subprocess.run(
        [sys.executable, "-c", "import kernel"],
        cwd=tmp_path,
        env=plain | {"XDG_CACHE_HOME": str(kept), "PYTHONPATH": str(Path(models.__file__).parents[1])},
        capture_output=True,
        text=True,
    )
    assert told.stdout == "3.0\n", told.stderr
    assert [path.name for path in kept.rglob("*.nbc")], "numba's own way, as long as this passes"


def test_classes_that_kernels_take_are_in_files_that_import_no_engine():
    """Whoever reads a kernel's index imports the classes of all its signatures. The callback of spatial MuJoCo models
    stays apart: its classes remain within it."""
    models = Path(compiled.ROOT) / "models"
    files = [
        path
        for path in sorted(models.rglob("*.py"))
        if "(NamedTuple)" in (text := path.read_text()) and "from models.machine.compiled import" in text
    ]
    names = [".".join(path.relative_to(compiled.ROOT).with_suffix("").parts) for path in files]
    assert len(names) > 20 and "models.engines.mujoco_native" in names
    script = (
        f"import importlib, sys\nfor name in {names!r}:\n    importlib.import_module(name)\n"
        "print([name for name in ('exudyn', 'mujoco') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_function_is_compiled_once_for_all_numbers_that_its_callers_write_out():
    @compiled.njit()
    def shifted(x, offset):
        return x + offset

    @compiled.njit()
    def summed(x):
        return shifted(x, 1) + shifted(x, 2)

    assert summed(1.0) == 5.0 and len(shifted.signatures) == 1


CALLBACK_OF_A_KERNEL = """
from models.engines.mujoco_callback import kernel_law
from models.rail.joint_forces import joint_forces
print(kernel_law(joint_forces).cache_hits)
"""


def test_a_callback_that_passes_data_to_a_kernel_is_compiled_once_for_all_processes():
    hits = [
        subprocess.run([sys.executable, "-c", CALLBACK_OF_A_KERNEL], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert hits[1].strip() == "1"
