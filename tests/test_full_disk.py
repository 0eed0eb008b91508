"""A full disk: one sentence, code 1, and every file that is there is whole."""

import errno

import pytest

from models.core.result_folders import COMMAND_FILE
from models.core.whole_files import whole_file, write_error_phrase, write_whole
from validation.common import full_disk
from validation.common.full_disk import files_of_at_most


def sizes(folder):
    return {path.relative_to(folder): path.stat().st_size for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("share", [i / 20 for i in range(20)])
def test_full_at_twenty_moments(twinrig, empty_folder, capsys, share):
    asked = ("run", "study_road", "--engine", "reference", "--set", "run.duration=0.2", "--out")
    assert twinrig(*asked, "whole") == 0
    whole = sizes(empty_folder / "whole")
    capsys.readouterr()
    with files_of_at_most(int(share * max(whole.values()))):
        code = twinrig(*asked, "full")
    said = capsys.readouterr().err
    assert code == 1
    assert said.startswith("twinrig: the results could not be written: the disk is full (") and said.count("\n") == 1
    left = sizes(empty_folder / "full") if (empty_folder / "full").exists() else {}
    assert all(size == whole[name] for name, size in left.items() if name.name != COMMAND_FILE)
    assert not any(name.name.endswith(".part") or ".part." in name.name for name in left)


def test_part_leaves_no_trace(tmp_path):
    with pytest.raises(OSError, match="space") as raised, whole_file(tmp_path / "a.csv") as part:
        part.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device")
    assert list(tmp_path.iterdir()) == []
    assert write_error_phrase(raised.value) == f"the disk is full ({tmp_path / 'a.csv'})"


def test_earlier_file_survives(tmp_path):
    write_whole(tmp_path / "a.txt", "before")
    with pytest.raises(ZeroDivisionError), whole_file(tmp_path / "a.txt") as part:
        part.write_text("after")
        raise ZeroDivisionError
    assert (tmp_path / "a.txt").read_text() == "before"


def test_other_reasons_keep_their_words():
    assert (
        write_error_phrase(PermissionError(errno.EACCES, "Permission denied", "x.csv")) == "Permission denied (x.csv)"
    )


def test_a_writer_that_leaves_its_part_is_seen(tmp_path, monkeypatch):
    """The fault to be seen: the file appears under its own name as it is written."""
    (tmp_path / "right").mkdir(), (tmp_path / "wrong").mkdir()
    assert full_disk.damaged_moments(tmp_path / "right") == 0
    monkeypatch.setattr("models.core.result.write_whole", lambda path, content: path.write_bytes(content))
    assert full_disk.damaged_moments(tmp_path / "wrong") > full_disk.MOMENTS_TRIED // 2
