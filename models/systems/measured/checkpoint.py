"""Where a long run stands, written whole or not at all, and of which inputs it is."""

import hashlib
import json
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.whole_files import write_whole
from models.measured.recording import Recording
from models.measured.signal import Signal


@dataclass(frozen=True)
class Checkpoint:
    """A file that holds arrays, and the inputs that they are of: ``of`` gives each a name that a user understands."""

    path: Path
    of: dict[str, str] = field(default_factory=dict)

    def load(self) -> dict[str, np.ndarray] | None:
        """What was saved, None if nothing; InputError, which names the input that differs, if it is of others."""
        if not self.path.is_file():
            return None
        try:
            with np.load(self.path) as found:
                arrays = dict(found)
            of = json.loads(str(arrays.pop("of")))
        except Exception as error:
            raise InputError(self.path, "", None, f"is no checkpoint of a run: remove its folder ({error})") from error
        other = [name for name in sorted({*of, *self.of}) if of.get(name) != self.of.get(name)]
        if other:
            raise InputError(
                self.path,
                "",
                None,
                f"is of a run with another {' and another '.join(other)}: choose another folder, or remove this one",
            )
        return arrays

    def save(self, **arrays: np.ndarray) -> None:
        """Replace what was saved by these arrays."""
        buffer = BytesIO()
        np.savez(buffer, of=np.array(json.dumps(self.of)), **arrays)  # type: ignore[arg-type]
        write_whole(self.path, buffer.getvalue())


def digest(*parts: object) -> str:
    """Digest of objects by their representation, arrays by their bytes."""
    found = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, np.ndarray):
            found.update(f"{part.dtype} {part.shape}".encode())
            found.update(np.ascontiguousarray(part).data)
        else:
            found.update(f"{part!r};".encode())
    return found.hexdigest()


def digest_of(recording: Recording, signals: tuple[Signal, ...]) -> str:
    """Digest of all samples of these signals, and of what they are."""
    own = digest(recording.period, recording.count)
    for signal in signals:
        own = digest(own, signal, recording.samples(signal))
    return own
