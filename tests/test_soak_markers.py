"""Markers for Lab Streaming Layer: what they cost the run, and many recordings beside their journals."""

from __future__ import annotations

import os
import signal
import statistics
from pathlib import Path

import numpy as np
import pylsl
import pytest

from experiments.record.journal import read_journal
from experiments.watch.lsl import source_of
from experiments.watch.markers import RunMarkers
from tests.at_terminal import AtTerminal
from tests.conftest import RECOIL, Soak
from tests.journals import key_to_disk_ms
from tests.kills import words
from tests.recorder import markers_process, recorded, recording
from tests.waiting import wait_for

pytestmark = pytest.mark.soak

RUNS, TRIALS, BLOCK = 6, 60, 5
"""Markers are sent and not sent in turn, so many trials at a time; a recorder takes them down all the while."""
COST_MS = 1.0
"""The bound of issue 19 for what stands beside a session: its 99th percentile is unchanged within this."""
CLOCKS_S = 1e-4


def answered(configs: Path, folder: Path, number: int) -> tuple[list[float], list[float], int, int]:
    """A run at a terminal: from key to disk with and without markers; the markers told, and those that differ."""
    results, xdf = folder / "results", folder / "run.xdf"
    results.mkdir(parents=True)
    with (
        markers_process(results) as program,
        recording(xdf, source_of(results)),
        AtTerminal([RECOIL, *words(configs, "--screen", "terminal")], folder) as screen,
    ):
        reader = pylsl.StreamInlet(pylsl.resolve_byprop("source_id", f"{source_of(results)}-markers", 1)[0])
        reader.open_stream()
        for trial in range(TRIALS):
            if trial % BLOCK == 0:
                os.kill(program, signal.SIGCONT if (trial // BLOCK + number) % 2 == 0 else signal.SIGSTOP)
            screen.fire(trial + 1)
            screen.wait_for("b = backward:", trial + 1)
            screen.type("f")
            screen.wait_for("Saved.", trial + 1)
        os.kill(program, signal.SIGCONT)
        screen.close()
        assert screen.end(60) == 0
        wait_for(lambda: reader.pull_sample(0.0)[0] == ["finish"])
    (journal,) = folder.rglob("*_journal.jsonl")
    contents = read_journal(journal)
    took_ms = list(enumerate(key_to_disk_ms(contents.records)))
    sent = [ms for trial, ms in took_ms if (trial // BLOCK + number) % 2 == 0]
    alone = [ms for trial, ms in took_ms if (trial // BLOCK + number) % 2]
    one = RunMarkers(contents.head)
    told = [marker for marker in map(one.of, contents.records) if marker is not None]
    _, rows = recorded(xdf)
    same = [
        (row["name"], int(row["record"])) == (marker.name, marker.record) and abs(at_s - marker.at_s) <= CLOCKS_S
        for (at_s, row), marker in zip(rows, told, strict=False)
    ]
    return sent, alone, len(told), max(len(rows), len(told)) - sum(same)


def test_markers_cost_a_run_nothing_that_can_be_measured_and_a_recording_is_the_journal(
    quick_configs: Path, tmp_path: Path, soak: Soak
) -> None:
    sent, alone, told, other = list[float](), list[float](), 0, 0
    for number in range(RUNS):
        with_ms, without_ms, markers, differ = answered(quick_configs, tmp_path / str(number), number)
        sent, alone, told, other = [*sent, *with_ms], [*alone, *without_ms], told + markers, other + differ
    with_ms, without_ms = np.percentile(sent, 99), np.percentile(alone, 99)
    soak(
        "99th percentile, key to synced journal, with markers and a recorder, and without markers",
        f"{with_ms:.2f} ms with, {without_ms:.2f} ms without",
        f"{COST_MS:g} ms more",
        f"{len(sent)} and {len(alone)} answers at a terminal, in turn by {BLOCK} trials; "
        f"median {statistics.median(sent):.2f} and {statistics.median(alone):.2f} ms",
    )
    soak(
        "markers in XDF files that are not the journal's, or missing",
        other,
        "0",
        f"{told} markers of {RUNS} runs by LabRecorder: name, record, and time to {1000 * CLOCKS_S:g} ms",
    )
    assert other == 0
    assert statistics.median(sent) <= statistics.median(alone) + COST_MS
    assert with_ms <= without_ms + COST_MS
