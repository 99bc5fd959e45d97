"""The promise that the product is for: an acknowledged answer is on the disk, whatever happens next."""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path

import pytest

from experiments.record.journal import read_journal
from tests.at_terminal import ANSWERS, FIRES, AtTerminal, answer_until_killed
from tests.kills import answers, can_mount, in_small_disk, words

STEM = "sub-P01/sub-P01_task-direction"


def killed_run(configs: Path, folder: Path, seconds: float, *, begun: bool) -> tuple[str, Path]:
    """A run killed some seconds after its start, or after it has `begun`: what was acknowledged, and the journal."""
    with AtTerminal(words(configs), folder) as screen:
        if begun:
            screen.wait_for("Trial 1 of")
        answer_until_killed(screen, seconds)
        saved = screen.seen.count("Saved.")
    return (ANSWERS * 8)[:saved], folder / "results" / f"{STEM}_journal.jsonl"


def check_killed_run(configs: Path, folder: Path, seconds: float, *, begun: bool) -> int:
    acknowledged, journal = killed_run(configs, folder, seconds, begun=begun)
    if not journal.exists() or not journal.read_bytes().count(b"\n"):
        assert acknowledged == ""
        return 0
    recorded = answers(read_journal(journal))
    assert recorded.startswith(acknowledged)
    assert len(recorded) - len(acknowledged) <= 1
    return len(acknowledged)


@pytest.mark.parametrize("kill", range(6))
def test_kill_9_at_a_random_moment_loses_no_acknowledged_answer(quick_configs: Path, tmp_path: Path, kill: int) -> None:
    check_killed_run(quick_configs, tmp_path, random.Random(kill).uniform(0.0, 2.0), begun=kill > 0)


def test_a_killed_run_goes_on_where_it_broke_off_and_ends_with_a_whole_table(
    quick_configs: Path, tmp_path: Path
) -> None:
    acknowledged, journal = killed_run(quick_configs, tmp_path, 2.0, begun=True)
    assert acknowledged
    before = answers(read_journal(journal))
    with AtTerminal(words(quick_configs, "--resume"), tmp_path) as screen:
        screen.answer_trials(2, already=len(before))
        screen.wait_for(FIRES, 3)
        screen.type("stop lunch")
        assert screen.end() == 130
    assert answers(read_journal(journal)) == (ANSWERS * 8)[: len(before) + 2]
    table = journal.with_name("sub-P01_task-direction_trials.csv").read_text().splitlines()
    assert len(table) == 61


def traced_run(configs: Path, folder: Path) -> list[str]:
    trace = folder / "trace"
    calls = "trace=openat,write,fsync,close"
    with AtTerminal(["strace", "-f", "-s", "64", "-e", calls, "-o", trace, *words(configs)], folder) as screen:
        screen.answer_trials(3)
        screen.wait_for(FIRES, 4)
        screen.type("stop")
        assert screen.end(60) == 130
    return trace.read_text().splitlines()


@pytest.mark.skipif(shutil.which("strace") is None, reason="needs strace")
def test_the_system_calls_show_a_sync_before_each_acknowledgement(quick_configs: Path, tmp_path: Path) -> None:
    calls = traced_run(quick_configs, tmp_path)
    opened = next(i for i, call in enumerate(calls) if "O_CREAT" in call and "_journal.jsonl" in call)
    journal = re.search(r"= (\d+)$", calls[opened])[1]
    folder = next(call for call in calls[opened + 1 :] if "openat" in call)
    folder_fd = re.search(r"= (\d+)$", folder)[1]
    first_write = next(i for i, call in enumerate(calls) if f" write({journal}, " in call)
    assert 'sub-P01"' in folder
    assert any(f" fsync({folder_fd})" in call and call.endswith("= 0") for call in calls[opened:first_write])

    synced, acknowledged = False, 0
    for call in calls[opened:]:
        if f" write({journal}, " in call:
            synced = False
        elif re.search(rf" fsync\({journal}\)\s+= 0", call):
            synced = True
        elif " write(1, " in call and "Saved." in call:
            assert synced
            acknowledged += 1
    assert acknowledged == 3


def test_a_full_disk_stops_the_run_at_the_last_safe_answer(quick_configs: Path, tmp_path: Path) -> None:
    if not can_mount(tmp_path):
        pytest.skip("no private mounts here")
    run = " ".join(map(str, words(quick_configs, "--screen", "synthetic")))
    done = in_small_disk(
        f"mkdir -p results && mount -t tmpfs -o size=64k none results && {run}; echo code $?; cp -r results full;"
        f"mount -o remount,size=8m results && {run} --resume; echo code $?; cp -r results whole",
        tmp_path,
    )
    assert done.stdout.count("code 2") == 1
    assert done.stdout.count("code 0") == 1
    full = read_journal(tmp_path / "full" / f"{STEM}_journal.jsonl")
    assert "No space left" in done.stderr
    assert f"everything up to record {len(full.records) - 1} is safe" in done.stderr
    assert "Traceback" not in done.stderr
    safe, whole = answers(full), read_journal(tmp_path / "whole" / f"{STEM}_journal.jsonl")
    assert 0 < len(safe) < 60
    assert answers(whole).startswith(safe)
    assert whole.finished
