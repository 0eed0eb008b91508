"""Hard cases of damaged or odd measurement files, which must be read correctly, read in part with a doubt, or
refused."""

from pathlib import Path

import numpy as np

from models.measured.formats.mdf4 import opened_mdf as mdf4_opened
from models.measured.formats.tdms import BoundedFile, opened_tdms
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase
from validation.measured.measured_files import csv, csv_forms, kinds, mdf4, rpc3, tdms
from validation.measured.measured_files.odd import FX, FZ, TOLERANCE, CutSweep, OddFile, file_of_bytes

CHECK_OF_OUTCOME = {
    "right": "times, values and names as they were written",
    "named": "times, values and names as far as they go, and the doubt is named",
    "refused": "refused with file and place; nothing is written",
}


def numpy_on_cut_number(work_folder: Path) -> str:
    """Text on the value that numpy reads from a file that was cut off within a number."""
    path = file_of_bytes(csv.usual_text()[:-3].encode())(work_folder)
    last_value = np.genfromtxt(path, delimiter=",", skip_header=1)[-1, 2]
    return f"numpy reads the last value as {last_value:g}, which was {FX[-1]:g}"


def asammdf_on_invalid_samples(work_folder: Path) -> str:
    """Text on what asammdf returns for samples that are marked as invalid."""
    path = next(odd_file for odd_file in mdf4.FILES if odd_file.name == "MDF 4 with invalid samples").make(work_folder)
    with mdf4_opened(path) as file:
        samples = file.get(group=0, index=1, samples_only=True, data=next(file._mdf._load_data(file.groups[0])))[0]
    return f"asammdf hands over {len(samples)} of {len(FZ)} samples of a block, those after a gap moved up"


def nptdms_on_cut_segment(work_folder: Path) -> str:
    """Text on what npTDMS reads from a file that was cut off."""
    with BoundedFile(tdms.cut_by(100)(work_folder)) as file:
        lengths = [len(channel) for group in opened_tdms(work_folder, file).groups() for channel in group.channels()]
    return f"npTDMS hands over channels of {' and '.join(map(str, lengths))} samples"


NAIVE_RESULTS = {
    "CSV cut within a number": numpy_on_cut_number,
    "MDF 4 with invalid samples": asammdf_on_invalid_samples,
    "TDMS cut in its samples": nptdms_on_cut_segment,
}


def case_of_file(odd_file: OddFile) -> HardCase:
    """Hard case made from an odd measurement file."""
    return HardCase(
        name=odd_file.name,
        difficulty=odd_file.difficulty,
        exact_answer=CHECK_OF_OUTCOME[odd_file.expected_outcome],
        unit="s or N",
        tolerance=TOLERANCE,
        tolerance_reason="values have bits that every format keeps; CSV writes times with 15 digits",
        error_function=lambda _, folder: odd_file.error(folder / "odd"),
        expected_outcomes=dict.fromkeys(IMPLEMENTATIONS, "refused") if odd_file.expected_outcome == "refused" else {},
        naive_result=NAIVE_RESULTS.get(odd_file.name),
        is_without_engine=True,
    )


def case_of_sweep(cut_sweep: CutSweep) -> HardCase:
    """Hard case made from a file that is cut off at many positions."""
    return HardCase(
        name=f"{cut_sweep.extension} cut off at {cut_sweep.cuts} places",
        difficulty="a library reads what is left, or what is not there",
        exact_answer="every cut is refused, or what is left is right and the cut named",
        unit="silent cuts",
        tolerance=0.0,
        tolerance_reason="no file that was cut off may be used without a word",
        error_function=lambda _, folder: cut_sweep.silent_cuts(folder / "cut"),
        is_without_engine=True,
    )


CASES = (
    *(case_of_file(odd) for module in (csv, csv_forms, kinds, mdf4, rpc3, tdms) for odd in module.FILES),
    *(case_of_sweep(CutSweep(extension)) for extension in (".csv", ".mf4", ".rsp", ".tdms")),
)
