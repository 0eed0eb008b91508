"""Recorded answers in a folder: ``NAME.json`` and ``NAME.npz`` of each job, and the jobs themselves."""

import json
import zipfile
from dataclasses import asdict
from pathlib import Path

import numpy as np

from validation.replay.answers import Answer
from validation.replay.jobs import Job

JOBS = "jobs.json"


def write_jobs(folder: Path, jobs: list[Job]) -> None:
    """Keep what is asked, so that a later version is asked the same."""
    (folder / JOBS).write_text(json.dumps([asdict(job) for job in jobs], indent=1))


def read_jobs(folder: Path) -> list[Job]:
    """The jobs of a recording."""
    return [
        Job(each["name"], tuple(map(tuple, each["commands"])), each["scene"])
        for each in json.loads((folder / JOBS).read_text())
    ]


def save(folder: Path, name: str, answer: Answer) -> None:
    """Keep an answer; its note is written last."""
    arrays = {str(i): array for i, array in enumerate(answer.arrays.values())}
    np.savez_compressed(folder / f"{name}.npz", allow_pickle=False, **arrays)
    note = {"codes": answer.codes, "message": answer.message, "seconds": answer.seconds, "arrays": list(answer.arrays)}
    (folder / f"{name}.json").write_text(json.dumps(note, indent=1))


def load(folder: Path, name: str) -> Answer | None:
    """A kept answer, or None where there is none that is whole."""
    try:
        note = json.loads((folder / f"{name}.json").read_text())
        with np.load(folder / f"{name}.npz") as file:
            arrays = {key: file[str(i)] for i, key in enumerate(note["arrays"])}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None
    return Answer(note["codes"], note["message"], note["seconds"], arrays)
