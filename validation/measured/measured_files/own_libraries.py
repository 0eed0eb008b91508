"""Reads a file with the library of its format (CSV with numpy): values and unit of each channel, as the file states
them."""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np

ChannelValues = dict[str, tuple[np.ndarray, str]]


def by_numpy(file_path: Path) -> ChannelValues:
    """Read a CSV file with numpy."""
    with file_path.open(encoding="utf-8") as file:
        headings = next(csv.reader(line for line in file if not line.startswith("#")))
        table = np.genfromtxt(file, delimiter=",")
    names = [heading.rstrip("]").rpartition(" [") for heading in headings]
    return {name: (table[:, i], unit) for i, (name, _, unit) in enumerate(names) if name != "time"}


def by_asammdf(file_path: Path) -> ChannelValues:
    """Read an MDF 4 file with asammdf."""
    from asammdf import MDF

    with MDF(file_path) as file:
        return {signal.name: (signal.samples, signal.unit) for signal in file.iter_channels()}


def by_rpc3(file_path: Path) -> ChannelValues:
    """Read an RPC III file with rpc3."""
    import rpc3

    rpc3.rpc3.progressbar = False
    return {channel.name: (np.asarray(channel.data), channel.unit) for channel in rpc3.read(str(file_path))[0]}


def by_nptdms(file_path: Path) -> ChannelValues:
    """Read a TDMS file with npTDMS."""
    from nptdms import TdmsFile

    channels = [channel for group in TdmsFile.read(file_path).groups() for channel in group.channels()]
    return {channel.name: (channel[:], channel.properties["unit_string"]) for channel in channels}


LIBRARIES: dict[str, tuple[str, Callable[[Path], ChannelValues]]] = {
    ".csv": ("numpy", by_numpy),
    ".mf4": ("asammdf", by_asammdf),
    ".rsp": ("rpc3-file", by_rpc3),
    ".tdms": ("npTDMS", by_nptdms),
}
"""For each file extension: name of the library, and the function that reads with it."""
