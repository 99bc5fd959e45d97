"""A sensor beside a run: what it costs from the key to the synced journal."""

from __future__ import annotations

import os
import signal
import statistics
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from experiments.record.journal import read_journal
from tests.at_terminal import DAMPER, FIRES, AtTerminal
from tests.conftest import RECOIL, Soak
from tests.delivered_chain import stream_written
from tests.journals import key_to_disk_ms
from tests.kills import words
from tests.waiting import wait_for

pytestmark = pytest.mark.soak

RUNS, TRIALS, BLOCK = 3, 60, 5
"""Two runs at a time, one with a sensor, are worked in turn, so many trials at a time."""
COST_MS = 1.0
"""The bound of issue 19 for what stands beside a session: its 99th percentile is unchanged within this."""
HEARD_S = 1.5
"""So long after a stop a sensor is heard again, and that is on record."""


def children(process: int) -> list[int]:
    """The processes that a process started."""
    return [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def send(processes: Iterable[int], number: signal.Signals) -> None:
    for process in processes:
        os.kill(process, number)


def work(screen: AtTerminal, first: int, random: np.random.Generator) -> None:
    """A block of trials; the answers come while what was measured of the shot is written, or before, or after.

    What the sensor says makes the terminal ask again, so it is looked for what was asked since the last key.
    """
    for trial in range(first + 1, first + BLOCK + 1):
        typed = max(0, screen.seen.rfind("Saved."))
        wait_for(lambda: FIRES in screen.seen[typed:] or DAMPER in screen.seen[typed:])  # noqa: B023 - waited for here
        if FIRES not in screen.seen[typed:]:
            screen.type("d")
            wait_for(lambda: FIRES in screen.seen[typed:])  # noqa: B023
        typed = len(screen.seen)
        screen.type("")
        wait_for(lambda: "b = backward:" in screen.seen[typed:])  # noqa: B023
        time.sleep(random.uniform(0.05, 0.5))
        screen.type("f")
        screen.wait_for("Saved.", trial)


def took_ms(folder: Path) -> tuple[list[float], int]:
    """From key to disk, and how many shots were measured."""
    (journal,) = folder.rglob("*_journal.jsonl")
    records = read_journal(journal).records
    bodies = [record.body for record in records if record.kind == "measured" and isinstance(record.body, dict)]
    return key_to_disk_ms(records), sum(body["mark"] != "not-measured" for body in bodies)


def test_a_sensor_costs_a_run_nothing_that_can_be_measured(quick_configs: Path, tmp_path: Path, soak: Soak) -> None:
    random, sensed, alone, measured = np.random.default_rng(1), list[float](), list[float](), 0
    for number in range(RUNS):
        folders = [tmp_path / str(number) / name for name in ("with", "without")]
        for folder in folders:
            folder.mkdir(parents=True)
        command = [RECOIL, *words(quick_configs, "--screen", "terminal")]
        with (
            stream_written(folders[0] / "stream.csv", "0.01") as (writer, stream),
            AtTerminal([*command, "--sensor", f"csv:{stream}"], folders[0]) as with_sensor,
            AtTerminal(command, folders[1]) as without,
        ):
            for first in range(0, TRIALS, BLOCK):
                work(with_sensor, first, random)
                beside = [writer.pid, *children(with_sensor.process.pid)]
                send(beside, signal.SIGSTOP)
                work(without, first, random)
                send(beside, signal.SIGCONT)
                time.sleep(HEARD_S)
            for screen in (with_sensor, without):
                screen.close()
                assert screen.end(60) == 0
        with_ms, shots = took_ms(folders[0])
        sensed, alone, measured = [*sensed, *with_ms], [*alone, *took_ms(folders[1])[0]], measured + shots
    with_99, without_99 = np.percentile(sensed, 99), np.percentile(alone, 99)
    soak(
        "99th percentile, key to synced journal, with a sensor and without",
        f"{with_99:.2f} ms with, {without_99:.2f} ms without",
        f"{COST_MS:g} ms more",
        f"{len(sensed)} and {len(alone)} answers at terminals, in turn by {BLOCK} trials, {measured} shots measured; "
        f"median {statistics.median(sensed):.2f} and {statistics.median(alone):.2f} ms",
    )
    assert measured > 0.9 * len(sensed)
    assert statistics.median(sensed) <= statistics.median(alone) + COST_MS
    assert with_99 <= without_99 + COST_MS
