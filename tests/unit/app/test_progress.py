"""Progress: what replicates report arrives, and nothing is printed where nobody looks."""

from __future__ import annotations

import io
import pickle
import time

import numpy as np
from rich.console import Console

from fieldrl.app.progress import board


def test_what_a_replicate_reports_is_seen_through_a_pickle():
    with board(3, 10, Console(file=io.StringIO())) as reporter:
        first = reporter(1)
        pickle.loads(pickle.dumps(first)).open()(4, 50.0, 2.0)
        rows = np.memmap(first.path, dtype=float, mode="r", shape=first.shape)
        np.testing.assert_array_equal(rows, [[0, 0, 0], [5, 50, 2], [0, 0, 0]])


def test_nothing_is_printed_where_there_is_no_terminal():
    file = io.StringIO()
    with board(1, 2, Console(file=file)) as reporter:
        reporter(0).open()(0, 1.0, 2.0)
    assert file.getvalue() == ""


def test_a_terminal_shows_episodes_return_and_total_error():
    file = io.StringIO()
    with board(1, 4, Console(file=file, force_terminal=True, width=80)) as reporter:
        reporter(0).open()(1, 61.25, 2.125)
        time.sleep(0.6)
    text = file.getvalue()
    assert "2/4" in text
    assert "61.2" in text
    assert "2.12" in text
