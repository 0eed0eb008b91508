"""Tables of contacts are answered as a stream: a longer one takes no more memory."""

import numpy as np
import pytest

from models.ensemble.workers import process_pool
from validation.common.peak_memory import peak_memory
from validation.price.contact_stream import cost_of_table, in_fresh_process


def kept_whole(folder, rows):
    """The same with all lines of the answer kept."""
    taken = cost_of_table(folder, rows)
    lines = (folder / "forces.csv").read_text().splitlines()
    assert len(lines) == rows + 1
    return taken._replace(memory=peak_memory())


def test_all_rows_are_answered(tmp_path):
    taken = cost_of_table(tmp_path, 2000)
    rows = (tmp_path / "forces.csv").read_text().splitlines()
    assert len(rows) == 2001 and rows[1].endswith(",ok") and rows[1001].split(",")[1:] == rows[1].split(",")[1:]
    assert taken.memory > 1e7 and taken.seconds > 0.0


def test_the_memory_of_a_process_does_not_count_that_of_its_parent():
    """300 MB are held here while the other process starts."""
    large = np.ones(300_000_000 // 8)
    with process_pool(1) as executor:
        assert executor.submit(peak_memory).result() < large.nbytes < peak_memory()


@pytest.mark.full
def test_ten_times_the_contacts_need_no_more_memory():
    """1,000,000 beside 100,000, within 10 %; the answer's lines kept as text, some 150 MB, would be seen."""
    few, many = (in_fresh_process(cost_of_table, rows).memory for rows in (100_000, 1_000_000))
    assert many < 1.1 * few, (few, many)
    assert in_fresh_process(kept_whole, 1_000_000).memory > 1.1 * few
