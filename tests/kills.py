"""Runs that are killed, and disks that are full."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

from experiments.record.journal import Contents, read_journal
from experiments.record.replay import history
from experiments.session.steps import Answered
from tests.at_terminal import ANSWERS, FIRES, AtTerminal, answer_until_killed
from tests.conftest import RECOIL
from tests.warm_start import warm

STEM = "sub-P01/sub-P01_task-direction"


def words(configs: Path, *more: object) -> list[object]:
    return ["run", configs / "direction.toml", "--participant", "P01", "--seed", 1, "--results", "results", *more]


def answers(contents: Contents) -> str:
    return "".join(outcome.value[0] for _, outcome in history(contents) if isinstance(outcome, Answered))


def in_small_disk(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A script in a private mount namespace, where it can mount a disk as small as it likes."""
    flags = ["-m"] if os.getuid() == 0 else ["-rm"]
    return subprocess.run(
        ["unshare", *flags, "sh", "-c", script], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )


def can_mount(folder: Path) -> bool:
    return in_small_disk("mkdir -p m && mount -t tmpfs none m", folder).returncode == 0


def killed_run(configs: Path, folder: Path, seconds: float, *, begun: bool) -> tuple[str, Path]:
    """A run killed some seconds after its start, or after it has `begun`: what was acknowledged, and the journal."""
    with AtTerminal(warm(*words(configs)), folder) as screen:
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


def traced_run(configs: Path, folder: Path) -> list[str]:
    trace = folder / "trace"
    calls = "trace=openat,write,fsync,close"
    with AtTerminal(["strace", "-f", "-s", "64", "-e", calls, "-o", trace, RECOIL, *words(configs)], folder) as screen:
        screen.answer_trials(3)
        screen.wait_for(FIRES, 4)
        screen.type("stop")
        assert screen.end(60) == 130
    return trace.read_text().splitlines()


def check_syncs(calls: list[str]) -> None:
    """The system calls of a run show a sync before each acknowledgement, and one of the folder before the first."""
    opened = next(i for i, call in enumerate(calls) if "O_CREAT" in call and "_journal.jsonl" in call)
    journal = re.search(r"= (\d+)$", calls[opened])[1]
    folder = next(call for call in calls[opened + 1 :] if "openat" in call and 'sub-P01"' in call)
    folder_fd = re.search(r"= (\d+)$", folder)[1]
    written = (i for i, call in enumerate(calls) if f" write({journal}, " in call)
    first_write = next(i for i in written if i > opened)  # what is compiled before may have been written by that number
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


def check_full_disk(configs: Path, folder: Path) -> None:
    """A full disk stops a run at the last safe answer; with room again it goes on."""
    run = " ".join(map(str, [RECOIL, *words(configs, "--screen", "synthetic")]))
    done = in_small_disk(
        f"mkdir -p results && mount -t tmpfs -o size=64k none results && {run}; echo code $?; cp -r results full;"
        f"mount -o remount,size=8m results && {run} --resume; echo code $?; cp -r results whole",
        folder,
    )
    assert done.stdout.count("code 2") == 1
    assert done.stdout.count("code 0") == 1
    full = read_journal(folder / "full" / f"{STEM}_journal.jsonl")
    assert "No space left" in done.stderr
    assert f"everything up to record {len(full.records) - 1} is safe" in done.stderr
    assert "Traceback" not in done.stderr
    safe, whole = answers(full), read_journal(folder / "whole" / f"{STEM}_journal.jsonl")
    assert 0 < len(safe) < 60
    assert answers(whole).startswith(safe)
    assert whole.finished
