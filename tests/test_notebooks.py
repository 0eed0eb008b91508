"""Notebooks of the documentation: each runs from its first cell to its last, and none keeps an output."""

import json
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
NAMES = [path.stem for path in NOTEBOOKS]
LONGEST = 300.0
"""Seconds of one cell, compiling and a busy machine included; with compiled functions ready a notebook takes 10 s."""


def test_there_are_three() -> None:
    """A folder that was moved must not leave an empty list behind."""
    assert len(NOTEBOOKS) >= 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=NAMES)
def test_no_output_is_kept(path: Path) -> None:
    """Outputs are made by the build; kept ones would grow old, and the repository large."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert code
    assert [cell["outputs"] for cell in code if cell["outputs"]] == []
    assert [cell["execution_count"] for cell in code if cell["execution_count"]] == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=NAMES)
def test_last_cell_checks_the_result(path: Path) -> None:
    """What a notebook claims is asserted in it, so that an execution can fail."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert "assert " in "".join(cells[-1]["source"])


@pytest.mark.full
@pytest.mark.parametrize("path", NOTEBOOKS, ids=NAMES)
def test_it_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every cell, in a folder of its own, by a kernel that finds this tree."""
    nbclient = pytest.importorskip("nbclient", reason="needs the extra notebooks")
    pytest.importorskip("ipykernel", reason="needs the extra notebooks")
    import nbformat

    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=LONGEST, resources={"metadata": {"path": str(tmp_path)}}).execute()
