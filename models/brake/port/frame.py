"""Frames of the port, byte by byte: a question with a sample, and an answer with a command; fixed size, little-endian,
numbers as IEEE 754 doubles bit for bit.

Question, 104 bytes, from the vehicle

    byte  type      what
    0     4 bytes   "TRQ1"
    4     uint32    number of the sample, from 0
    8     int64     simulated time since the start, ns
    16    uint8     W, number of wheels, 1 to 8
    17    uint8     bit 0: brake switch closed; bit 1: the vehicle's speed is given
    18    6 bytes   zero
    24    double    supply pressure, bar
    32    double    the vehicle's speed, m/s; not a number if it is not given
    40    double[8] wheel-speed signals times the wheel's radius, m/s, axle by axle, the left one first; after W zero

Answer, 80 bytes, from the controller

    byte  type      what
    0     4 bytes   "TRA1"
    4     uint32    number of the sample that is answered
    8     uint8     "V": states of valves, -1 release, 0 hold, 1 apply, 2 apply slowly where the scene has
                      such valves; "P": pressures in the chambers, bar
    9     uint8     W
    10    6 bytes   zero
    16    double[8] one value per wheel; after W zero

Lock-step: the vehicle asks and waits, and no time passes for it meanwhile.
"""

import struct

import numpy as np

from models.brake.controller import Command, Sample

QUESTION_LAYOUT, ANSWER_LAYOUT = struct.Struct("<4sIqBB6xdd8d"), struct.Struct("<4sIBB6x8d")
FRAME_WHEEL_LIMIT = 8
SWITCH, SPEED_GIVEN = 1, 2
"""Bits of the question's flags: brake switch closed, speed given."""


class WrongFrame(ValueError):
    """Error of bytes that do not form a frame of this port; name : as in ``ask.FAULT_NAMES``."""

    def __init__(self, fault_name: str, reason: str) -> None:
        self.name = fault_name
        super().__init__(reason)


def question_frame(sample: Sample) -> bytes:
    """Frame (104 bytes) that carries one sample to the controller."""
    flags = SWITCH * sample.brake | SPEED_GIVEN * (sample.speed == sample.speed)
    return QUESTION_LAYOUT.pack(
        b"TRQ1",
        sample.number,
        sample.time,
        sample.wheels.size,
        flags,
        sample.supply,
        sample.speed,
        *_eight_values(sample.wheels),
    )


def sample_of_question(question_bytes: bytes) -> Sample:
    """The sample in a question frame; raises WrongFrame."""
    if len(question_bytes) != QUESTION_LAYOUT.size:
        raise WrongFrame("wrong length", f"a question of {len(question_bytes)} bytes, not {QUESTION_LAYOUT.size}")
    magic, number, time, wheels, flags, supply, speed, *signals = QUESTION_LAYOUT.unpack(question_bytes)
    if magic != b"TRQ1" or not 1 <= wheels <= FRAME_WHEEL_LIMIT:
        raise WrongFrame("wrong frame", f"begins with {magic!r}, not with b'TRQ1' and 1 to {FRAME_WHEEL_LIMIT} wheels")
    return Sample(number, time, np.array(signals[:wheels]), bool(flags & SWITCH), supply, speed)


def answer_frame(sample_number: int, command: Command) -> bytes:
    """Frame (80 bytes) that carries a controller's command for a sample."""
    mode, values = (b"P", command.pressures) if command.valves is None else (b"V", command.valves)
    assert values is not None
    return ANSWER_LAYOUT.pack(b"TRA1", sample_number, mode[0], len(values), *_eight_values(values))


def command_of_answer(answer_bytes: bytes, sample_number: int) -> Command:
    """The command in an answer frame; raises WrongFrame if the frame does not answer the sample ``sample_number``."""
    magic, answered, mode, wheels, *values = ANSWER_LAYOUT.unpack(answer_bytes)
    if magic != b"TRA1" or mode not in b"VP":
        raise WrongFrame("wrong frame", f"begins with {magic!r}, mode {mode}, not with b'TRA1' and 'V' or 'P'")
    if answered != sample_number:
        raise WrongFrame("wrong number", f"the answer is one to sample {answered}")
    if wheels > FRAME_WHEEL_LIMIT:
        raise WrongFrame("wrong length", f"values for {wheels} wheels, at most {FRAME_WHEEL_LIMIT} fit")
    array = np.array(values[:wheels])
    return Command(pressures=array) if mode == ord("P") else Command(valves=array)


def _eight_values(wheel_values: np.ndarray) -> list[float]:
    """Values for eight wheels, the largest number: the given ones, then zeros."""
    return [*np.asarray(wheel_values, dtype=float).tolist(), *[0.0] * (FRAME_WHEEL_LIMIT - len(wheel_values))]
