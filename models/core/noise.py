"""Counter-based random numbers: any block of any noise stream can be computed alone, in any order, in any process.

A stream is named by (seed, path, source); its samples are made in blocks of SAMPLES_PER_BLOCK that the counter numbers,
so sample i of path j is the same number whoever asks for it and whatever was asked for before. The source says whose
noise it is: an engineer who gives one seed to forces and gyro still gets independent noise.
"""

import numpy as np

from models.core.errors import InputError

SAMPLES_PER_BLOCK = 4096
"""Number of noise samples per block; never changed, since every sample of a stream would change with it."""


(
    FORCES,
    GYRO,
    GYRO_BIAS,
    PITCH_SENSOR,
    ACCELEROMETERS,
    ROAD,
    BRAKE_SIGNALS,
    BRAKE_PRESSURES,
    SPEED,
    TRANSDUCERS,
    DROPOUTS,
) = range(11)
"""Numbers of the noise sources (measured forces, gyro, ...), so that equal seeds give independent noise; a new source
takes the next number."""


def normal_block(
    seed: int,
    noise_path: int,
    block_index: int,
    channel_count: int,
    noise_source: int = FORCES,
    row_count: int = SAMPLES_PER_BLOCK,
) -> np.ndarray:
    """First ``row_count`` standard normal samples (rows, channels) of block number ``block_index`` of the noise stream
    (seed, path, source).

    seed : 0 to 2**64 - 1; noise_path : 0 to 2**64 - 1; block_index : 0 to 2**64 - 1; InputError for others, which would
    name the stream of another one. Philox with the key (seed, path), the block in the counter's third word and the
    source in its fourth, so that blocks never overlap."""
    key = np.array([_checked_whole_number("seed", seed), _checked_whole_number("path", noise_path)], dtype=np.uint64)
    bits = np.random.Philox(
        key=key, counter=np.array([0, 0, _checked_whole_number("block", block_index), noise_source], dtype=np.uint64)
    )
    return np.random.Generator(bits).standard_normal((row_count, channel_count))


def _checked_whole_number(number_name: str, number: int) -> int:
    """The number as int; raises InputError unless it is a whole number from 0 to 2**64 - 1."""
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < 2**64:
        raise InputError("", number_name, number, "must be a whole number from 0 to 2^64 - 1")
    return int(number)


def normal_samples(
    seed: int, noise_path: int, sample_count: int, channel_count: int, first_sample: int = 0, noise_source: int = FORCES
) -> np.ndarray:
    """Standard normal samples (count, channels) of the noise stream (seed, path, source), from sample ``first_sample``
    on; raises InputError for negative counts, and as ``normal_block``."""
    if min(sample_count, first_sample) < 0:
        raise InputError("", "count, first", (sample_count, first_sample), "must be 0 or more")
    start, end = first_sample // SAMPLES_PER_BLOCK, -(-(first_sample + sample_count) // SAMPLES_PER_BLOCK)
    blocks = [
        normal_block(
            seed,
            noise_path,
            block,
            channel_count,
            noise_source,
            row_count=min(SAMPLES_PER_BLOCK, first_sample + sample_count - block * SAMPLES_PER_BLOCK),
        )
        for block in range(start, end)
    ]  # what lies behind the last sample is never drawn
    return (
        np.concatenate(blocks)[first_sample - start * SAMPLES_PER_BLOCK :] if blocks else np.empty((0, channel_count))
    )
