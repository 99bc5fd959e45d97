"""The promise that the product is for: an acknowledged answer is on the disk, whatever happens next."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest

from experiments.record.journal import read_journal
from tests.at_terminal import ANSWERS, FIRES, AtTerminal
from tests.kills import (
    answers,
    can_mount,
    check_full_disk,
    check_killed_run,
    check_syncs,
    killed_run,
    traced_run,
    words,
)
from tests.warm_start import warm

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("kill", range(4))
def test_kill_9_at_a_random_moment_loses_no_acknowledged_answer(quick_configs: Path, tmp_path: Path, kill: int) -> None:
    check_killed_run(quick_configs, tmp_path, random.Random(kill).uniform(0.0, 2.0), begun=kill > 0)


def test_a_killed_run_goes_on_where_it_broke_off_and_ends_with_a_whole_table(
    quick_configs: Path, tmp_path: Path
) -> None:
    acknowledged, journal = killed_run(quick_configs, tmp_path, 2.0, begun=True)
    assert acknowledged
    before = answers(read_journal(journal))
    with AtTerminal(warm(*words(quick_configs, "--resume")), tmp_path) as screen:
        screen.answer_trials(2, already=len(before))
        screen.wait_for(FIRES, 3)
        screen.type("stop lunch")
        assert screen.end() == 130
    assert answers(read_journal(journal)) == (ANSWERS * 8)[: len(before) + 2]
    table = journal.with_name("sub-P01_task-direction_trials.csv").read_text().splitlines()
    assert len(table) == 61


@pytest.mark.skipif(shutil.which("strace") is None, reason="needs strace")
def test_the_system_calls_show_a_sync_before_each_acknowledgement(quick_configs: Path, tmp_path: Path) -> None:
    check_syncs(traced_run(quick_configs, tmp_path))


def test_a_full_disk_stops_the_run_at_the_last_safe_answer(quick_configs: Path, tmp_path: Path) -> None:
    if not can_mount(tmp_path):
        pytest.skip("no private mounts here")
    check_full_disk(quick_configs, tmp_path)
