"""Progress: what replicates report arrives, and nothing is printed where nobody looks."""

from __future__ import annotations

import io
import pickle
import time

import numpy as np
from rich.console import Console

from fieldrl.cli.progress_bar import ProgressBar
from fieldrl.cli.terminal import Bar
from fieldrl.runs.progress import shared_progress


def test_what_a_replicate_reports_is_seen_through_a_pickle():
    with shared_progress(3) as progress:
        pickle.loads(pickle.dumps(progress)).report(1)(4, 50.0, 2.0)
        np.testing.assert_array_equal(progress.rows(), [[0, 0, 0], [5, 50, 2], [0, 0, 0]])


def test_a_replicate_on_another_machine_reports_to_nobody():
    with shared_progress(1) as progress:
        pass
    progress.report(0)(0, 1.0, 2.0)


def test_nothing_is_printed_where_there_is_no_terminal(capsys):
    with shared_progress(1) as progress, Bar().progress(progress.rows(), 2):
        progress.report(0)(0, 1.0, 2.0)
    assert capsys.readouterr().out == ""


def test_a_terminal_shows_episodes_return_and_total_error():
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, width=80)
    with shared_progress(1) as progress, ProgressBar(progress.rows(), 4, console):
        progress.report(0)(1, 61.25, 2.125)
        time.sleep(0.6)
    text = file.getvalue()
    assert "2/4" in text
    assert "61.2" in text
    assert "2.12" in text
