"""What a run and a look at a study cost: files that are read, methods that are rendered. Counted, not timed."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from device import open_gun
from experiments.clock import VirtualClock
from experiments.earlier_run import UnfinishedRun
from experiments.load import load_setup
from experiments.record import rebuild, storage
from experiments.record.journal import Journal, JournalError, read_journal
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study import register
from experiments.study.enrolment import exclude
from experiments.study.folders import StudyFolder, look_at, open_study, overview
from experiments.study.new_study import new_study
from tests.traced_trial import MOST, traced

pytestmark = pytest.mark.slow

JOURNAL = "sub-{}_task-preference_journal.jsonl"


@pytest.fixture
def study(tmp_path: Path) -> StudyFolder:
    """Two people who have done the second experiment, whose orders are balanced; a third was excluded."""
    new_study(tmp_path / "pilot")
    config = tmp_path / "pilot" / "preference.toml"
    config.write_text(config.read_text().replace('trials = "random"', 'trials = "latin-square"'))
    study = open_study(tmp_path / "pilot")
    for code in ("P01", "P02", "P03"):
        run(asked(study, code), synthetic_screen, VirtualClock())
    exclude(study.results, "P03", "left-handed", VirtualClock())
    return study


def asked(study: StudyFolder, code: str, **more: Any) -> RunRequest:
    return RunRequest(
        setup=study.setups[1], participant_id=code, results=study.results, seed=1, screen="terminal", **more
    )


@pytest.fixture
def reads(study: StudyFolder, monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each file is read from now on, by its name."""
    counted: Counter[str] = Counter()
    read, read_journal = storage.read_whole, storage.read

    def counting(path: Path) -> bytes:
        counted[path.name] += 1
        return read(path)

    def counting_journals(path: Path, most: int, start: int = 0) -> bytes:
        counted[path.name] += 1
        return read_journal(path, most, start)

    monkeypatch.setattr(storage, "read_whole", counting)
    monkeypatch.setattr(storage, "read", counting_journals)
    return counted


def test_an_overview_reads_the_register_and_each_journal_once(study: StudyFolder, reads: Counter[str]) -> None:
    found = overview(study)
    assert [run.state for one in found.participants for run in one.runs] == ["not begun", "done"] * 3
    assert found.next is not None
    assert found.next.participant_id == "P01"
    assert reads == {register.REGISTER_FILE: 1} | {JOURNAL.format(code): 1 for code in ("P01", "P02", "P03")}


def test_an_overview_that_looks_for_the_next_row_reads_no_journal_again(
    study: StudyFolder, reads: Counter[str]
) -> None:
    alone = StudyFolder(config=study.config, source=study.source, setups=study.setups[1:], results=study.results)
    found = overview(alone)
    assert found.next is not None
    assert found.next.new
    assert found.orders["preference"] is not None
    assert max(reads.values()) == 1


def test_a_look_at_one_participant_reads_the_register_and_their_journal_once(
    study: StudyFolder, reads: Counter[str]
) -> None:
    look_at(study, "P02")
    assert reads == {register.REGISTER_FILE: 1, JOURNAL.format("P02"): 1}


def test_an_overview_makes_no_table(study: StudyFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(rebuild, "table_bytes")
    (first, *_) = overview(study).participants
    assert [(run.answered, run.planned) for run in first.runs] == [(0, 0), (3, 3)]


def test_a_run_reads_the_register_once_and_its_own_journal_once_at_its_end(
    study: StudyFolder, reads: Counter[str]
) -> None:
    run(asked(study, "P04"), synthetic_screen, VirtualClock())
    assert (reads[register.REGISTER_FILE], reads[JOURNAL.format("P04")]) == (1, 1)


def test_an_unfinished_run_that_is_asked_about_is_read_once(study: StudyFolder, reads: Counter[str]) -> None:
    journal = study.results / "sub-P01" / JOURNAL.format("P01")
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:4]))
    reads.clear()
    with pytest.raises(UnfinishedRun, match="unfinished run") as found:
        run(asked(study, "P01"), synthetic_screen, VirtualClock())
    assert len(found.value.contents.records) == 4
    assert (reads[register.REGISTER_FILE], reads[journal.name]) == (1, 1)


def test_a_run_that_goes_on_now_is_not_asked_about_as_an_unfinished_one(study: StudyFolder) -> None:
    journal = study.results / "sub-P01" / JOURNAL.format("P01")
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:4]))
    with (
        Journal.reopen(read_journal(journal), VirtualClock()),
        pytest.raises(JournalError, match="another run holds this journal; close that one first"),
    ):
        run(asked(study, "P01"), synthetic_screen, VirtualClock())


def test_the_methods_of_a_run_are_rendered_once_when_its_gun_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = load_setup("preference")
    given: list[Any] = []

    def opened(address: str, methods: Any, **how: Any) -> Any:
        given.extend(methods.values())
        return open_gun(address, methods, **how)

    monkeypatch.setattr("experiments.run.open_gun", opened)
    run(RunRequest(setup=setup, participant_id="P01", results=tmp_path, seed=1), synthetic_screen, VirtualClock())
    own = [setup.gun.rendering(name) for name in setup.config.methods]
    assert given
    assert all(any(one is method for method in own) for one in given)


def test_a_live_trial_runs_through_few_files(tmp_path: Path) -> None:
    assert len(traced(tmp_path).calls) <= MOST
