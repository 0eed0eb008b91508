"""Controller process at the socket of a braked vehicle that answers correctly for some samples, then makes one error.

Run as ``python misbehaving_client.py KIND PORT``; it knows the port by its documented bytes alone.
"""

import os
import socket
import struct
import sys
import time

GOOD_SAMPLES = 20
"""Number of samples that are answered correctly."""
NAN = float("nan")


def answer_frame(
    sample_number: int,
    magic_bytes: bytes = b"TRA1",
    mode_byte: bytes = b"V",
    wheel_count: int = 4,
    first_value: float = 1.0,
) -> bytes:
    """Bytes of a controller's answer to a sample, valid by default; other arguments make it invalid."""
    return struct.pack(
        "<4sIBB6x8d",
        magic_bytes,
        sample_number,
        mode_byte[0],
        wheel_count,
        first_value,
        1.0,
        1.0,
        1.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )


def misbehave(misbehaviour: str, sample_number: int, connection: socket.socket) -> None:
    """Send the wrong answer named by ``misbehaviour``, then wait until the vehicle's side closes the connection."""
    if misbehaviour == "died":
        os._exit(9)
    if misbehaviour == "late":
        time.sleep(0.8)
    connection.sendall(
        {
            "NaN": answer_frame(sample_number, mode_byte=b"P", first_value=NAN),
            "infinite": answer_frame(sample_number, mode_byte=b"P", first_value=float("inf")),
            "NaN as a valve": answer_frame(sample_number, first_value=NAN),
            "negative pressure": answer_frame(sample_number, mode_byte=b"P", first_value=-1.0),
            "valve in no state": answer_frame(sample_number, first_value=0.5),
            "too few wheels": answer_frame(sample_number, wheel_count=3),
            "too many bytes": answer_frame(sample_number) + b"\0",
            "part of a frame": answer_frame(sample_number)[:33],
            "another protocol": b"HTTP/1.1 200 OK\r\n" + 63 * b" ",
            "answer to another sample": answer_frame(sample_number - 1),
            "late": answer_frame(sample_number),
            "silence": b"",
        }[misbehaviour]
    )
    connection.recv(1)


def main(misbehaviour: str, port: str) -> None:
    """Connect to the port, answer correctly for GOOD_SAMPLES samples, then send the wrong answer named by
    ``misbehaviour``."""
    with socket.create_connection(("127.0.0.1", int(port))) as link:
        while True:
            question = link.recv(104, socket.MSG_WAITALL)
            if len(question) < 104:
                return
            number = struct.unpack_from("<I", question, 4)[0]
            if number >= GOOD_SAMPLES:
                misbehave(misbehaviour, number, link)
                return
            link.sendall(answer_frame(number))


if __name__ == "__main__":
    main(*sys.argv[1:])
