"""Log file of every exchange with a controller, and a controller that replays a log.

File: the line ``twinrig braking port log 1``, one line with 64 hexadecimal digits that name the scene, then per
exchange the frame of the question and that of the answer, as in ``frame``.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import BinaryIO

from models.brake.controller import Command, Controller, Sample
from models.brake.port.frame import ANSWER_LAYOUT, QUESTION_LAYOUT, answer_frame, command_of_answer, question_frame
from models.core.errors import InputError, RunFailed

LOG_TITLE = b"twinrig braking port log 1\n"
RECORD_LENGTH = QUESTION_LAYOUT.size + ANSWER_LAYOUT.size


def scene_hash(scene_text: str) -> str:
    """Hash of a scene's text, 64 hexadecimal digits, by which a log identifies its scene."""
    return sha256(scene_text.encode()).hexdigest()


@dataclass
class LoggedController:
    """A controller whose exchanges are written to a log as they happen."""

    controller: Controller
    file: BinaryIO

    def sample(self, sample: Sample) -> Command:
        """The controller's command for a sample; both are written to the log."""
        question = question_frame(sample)  # before a controller can write into what it is given
        command = self.controller.sample(sample)
        self.file.write(question + answer_frame(sample.number, command))
        return command


@contextmanager
def logged_controller(controller: Controller, log_path: Path, hash_of_scene: str) -> Iterator[LoggedController]:
    """The controller with a log of its exchanges, as a context manager; hash_of_scene : hash from ``scene_hash``."""
    with log_path.open("wb") as file:
        file.write(LOG_TITLE + hash_of_scene.encode() + b"\n")
        yield LoggedController(controller, file)


def log_refusal(log_path: Path) -> str:
    """Reason why no log can be written to a path, or "" if it can. An older log is overwritten, any other file is
    not.
    """
    if log_path.is_dir():
        return "is a folder: name a file"
    if not log_path.parent.is_dir():
        return f"no such folder: {str(log_path.parent)!r}"
    if not log_path.exists():
        return ""
    with log_path.open("rb") as file:
        known = file.read(len(LOG_TITLE)) == LOG_TITLE
    return "" if known else "is a file that is no log, and would be overwritten: name another one"


class ReplayedController:
    """Controller that repeats the commands of a log as long as the samples equal the logged ones; raises InputError for
    another scene's log.
    """

    def __init__(self, log_path: Path, hash_of_scene: str) -> None:
        try:
            title, name, records = (log_path.read_bytes() + b"\n\n").split(b"\n", 2)
        except OSError as error:
            raise InputError(log_path.name, "replay", None, f"cannot be read: {error.strerror}") from None
        if title + b"\n" != LOG_TITLE:
            raise InputError(log_path.name, "replay", None, "is no log of the port, or of another version of it")
        if name != hash_of_scene.encode():
            raise InputError(log_path.name, "replay", None, "is the log of another scene")
        self._records, self._path = records, log_path

    def sample(self, sample: Sample) -> Command:
        """The logged command for a sample; raises RunFailed if the log has ended, or if its sample differs from this
        one.
        """
        start = sample.number * RECORD_LENGTH
        record, position_text = (
            self._records[start : start + RECORD_LENGTH],
            f"sample {sample.number}: {self._path.name}",
        )
        if len(record) < RECORD_LENGTH:
            raise RunFailed("replay", f"{position_text} has ended", 1e-9 * sample.time)
        if record[: QUESTION_LAYOUT.size] != question_frame(sample):
            raise RunFailed("replay", f"{position_text} was asked something else", 1e-9 * sample.time)
        return command_of_answer(record[QUESTION_LAYOUT.size :], sample.number)
