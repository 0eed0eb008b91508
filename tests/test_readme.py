"""The README's two commands are the ones that CI runs, and what it lists exists."""

import re
from pathlib import Path

from studies.command.asked import studies

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def commands():
    plain = re.sub(r"```\w+\n.*?```", "", README, flags=re.DOTALL)
    return [block.strip() for block in re.findall(r"```\n(.*?)```", plain, flags=re.DOTALL)]


def test_both_commands_are_what_ci_runs_tests_first():
    main, tests = commands()
    assert main.endswith("twinrig validate --quick") and tests.endswith("python -m pytest -n 2")
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert lines.index(tests) < lines.index(main)


def test_every_study_is_listed_with_its_duration_and_run_by_ci():
    ci = (ROOT / ".ci" / "run").read_text()
    assert len(studies()) > 25
    for name in studies():
        row = next(line for line in README.splitlines() if f"studies/{name}.py" in line)
        assert re.search(r"\d+ (s|min) \|$", row), row
        assert name in ci


def test_every_effect_that_is_listed_is_one_and_every_folder_is_listed():
    """An effect need not be listed: its file is all that it takes, and `twinrig list` reads that."""
    from models.core.scene_effects import names_of
    from models.core.systems import DEFAULT

    table = README.partition("\n## Effects\n")[2].partition("\n## ")[0]
    rows = set(re.findall(r"^\| `(\w+)` \|", table, flags=re.MULTILINE))
    assert len(rows) > 10 and rows <= {*names_of(DEFAULT)}
    for folder in ("twinrig", "models", "studies", "validation", "tests"):
        assert f"| `{folder}/` |" in README and (ROOT / folder).is_dir()


def test_the_scene_of_the_readme_is_a_valid_scene(tmp_path):
    import tomllib

    from models.systems.pitch_plane.scene import build

    table = tomllib.loads(re.search(r"```toml\n(.*?)```", README, flags=re.DOTALL).group(1))
    assert set(build(table, "README.md", tmp_path).effects) == {"road"}


def test_the_contact_of_the_readme_is_a_valid_scene(tmp_path):
    import tomllib

    from models.systems.contact.scene import build

    table = tomllib.loads(re.findall(r"```toml\n(.*?)```", README, flags=re.DOTALL)[1])
    assert build(table, "README.md", tmp_path).geometry == "radii"


def test_the_python_of_the_readme_runs(empty_folder, capsys):
    import matplotlib

    matplotlib.use("Agg")
    names: dict = {}
    exec(python_of("import twinrig"), names)
    assert list(names["frame"]) == ["f1", "f2"] and (empty_folder / "forces.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "error at most" in said and "largest         rms unit" in said


def test_the_figure_of_the_readme_is_there():
    for name in re.findall(r"!\[.*?\]\((.*?)\)", README):
        assert (ROOT / name).stat().st_size < 400_000


def test_the_constraints_are_plain_pins():
    for line in (ROOT / ".ci" / "constraints.txt").read_text().splitlines():
        assert re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9_.]+", line), line


def python_of(word):
    """The block of Python in which a word stands first."""
    return next(block for block in re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL) if word in block)


def test_the_effect_of_the_readme_is_one_file(new_file):
    from validation.absence.of_systems import added, declared

    new_file("handling", "side_wind", python_of("def extend"))
    assert added("handling", "side_wind", quick=True) == declared("handling", "side_wind", ["mujoco"])
    assert declared("handling", "side_wind", ["mujoco"]) == {"mujoco": {"pushes": 1}}
