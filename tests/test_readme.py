"""The README's two commands are the ones that CI runs, and what it and the pages list exists."""

import re

from docs.pages import ROOT, example_blocks
from studies.command.asked import study_names

README = (ROOT / "README.md").read_text()


def commands():
    return [block.text.strip() for block in example_blocks(README) if not block.mark and not block.language]


def of_page(name, language, word=""):
    """The first block of a language in a page of ``docs`` in which a word stands."""
    text = (ROOT / "docs" / name).read_text()
    return next(block.text for block in example_blocks(text) if block.language == language and word in block.text)


def test_both_commands_are_what_ci_runs_tests_first():
    main, tests = commands()
    assert main.endswith("twinrig validate --quick") and tests.endswith("python -m pytest -n 2")
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert lines.index(tests) < lines.index(main)


def test_the_readme_is_short():
    assert len(README.split()) <= 900


def test_every_study_is_listed_with_its_duration_and_run_by_ci():
    ci = (ROOT / ".ci" / "run").read_text()
    listed = (ROOT / "docs" / "reference" / "studies.md").read_text().splitlines()
    assert len(study_names()) > 25
    for name in study_names():
        row = next(line for line in listed if f"studies/{name}.py" in line)
        assert re.search(r"\d+ (s|min) \|$", row), row
        assert name in ci


def test_every_command_is_listed():
    from studies.command_line import app

    text = (ROOT / "docs" / "reference" / "commands.md").read_text()
    names = [each.name or each.callback.__name__ for each in app.registered_commands]
    assert len(names) > 5
    assert [name for name in names if f"`twinrig {name}" not in text] == []


def test_every_folder_is_listed():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    for folder in ("twinrig", "models", "studies", "validation", "docs", "tests"):
        assert f"| `{folder}/` |" in text and (ROOT / folder).is_dir()


def test_the_python_of_the_pages_runs(empty_folder, capsys):
    import matplotlib

    matplotlib.use("Agg")
    names: dict = {}
    exec(of_page("how-to/python.md", "python", "import twinrig"), names)
    assert list(names["frame"]) == ["f1", "f2"] and (empty_folder / "forces.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "error at most" in said and "largest         rms unit" in said


def test_the_constraints_are_plain_pins():
    for line in (ROOT / ".ci" / "constraints.txt").read_text().splitlines():
        assert re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9_.]+", line), line


def test_the_effect_of_the_pages_is_one_file(new_file):
    from validation.absence.of_systems import added_counts, declared_counts

    new_file("handling", "side_wind", of_page("how-to/own_effect.md", "python", "def extend"))
    assert added_counts("handling", "side_wind", is_quick=True) == declared_counts("handling", "side_wind", ["mujoco"])
    assert declared_counts("handling", "side_wind", ["mujoco"]) == {"mujoco": {"pushes": 1}}
