"""Resume: runs of both experiments, broken off at many records and gone on with, against the unbroken ones."""

import csv
import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from device import DeviceError
from experiments.clock import RealClock, VirtualClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planning import plan_of
from experiments.earlier_run import NotAsItBegan, earlier_run, way_back_to_gun
from experiments.record.journal import Journal, JournalError, read_journal, record_line
from experiments.record.rebuild import rebuild, rebuild_table
from experiments.record.replay import go_on, history, replay
from experiments.run import run
from experiments.run_request import Again, ParticipantOptions, RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.session.design_session import design_session
from experiments.session.states import EMERGENCY
from experiments.study import register
from experiments.study.folders import PlaceError, place
from experiments.study.register import RegisterError
from tests.designs import changed, direction_with
from tests.gun_plugins import install
from tests.journals import forged, raw
from tests.other_trials import turned

SETUPS = {
    "direction": direction_with(sets=2, repetitions=2),
    "preference": changed("preference", laws={"exposure_s": 5.0}),
}
"""Of every step several: three sessions of two sets of two trials; three trains of a few shots."""
ANSWERS = {
    "direction": ("response", "correct", "response_time_s", "response_source", "response_time_valid"),
    "preference": ("rating", "rating_by", "comment", "shots"),
}
LAST_ANSWER = {"direction": "ask", "preference": "describe"}


def request(name: str, results: Path, again: Again = "ask", seed: int | None = 1, **changes: Any) -> RunRequest:
    setup = changes.pop("setup", SETUPS[name])
    return RunRequest(setup=setup, participant_id="P01", results=results, seed=seed, again=again)


class Unbroken(NamedTuple):
    """A run that was never broken off: its plan, its journal's lines and its table."""

    name: str
    plan: Plan
    lines: list[bytes]
    rows: list[dict[str, str]]
    table: bytes

    @property
    def records(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.lines]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, strict=True))


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Unbroken]:
    runs = {}
    for name in SETUPS:
        done = run(request(name, tmp_path_factory.mktemp(name)), synthetic_screen, VirtualClock())
        lines = done.place.journal.read_bytes().splitlines(keepends=True)
        table = done.place.table.read_bytes()
        runs[name] = Unbroken(name, done.plan, lines, rows_of(done.place.table), table)
    return runs


def broken_off(whole: Unbroken, results: Path, records: int, rest: bytes = b"") -> Path:
    """A copy of the run's journal that ends behind so many records."""
    where = place(results, "P01", whole.name)
    where.folder.mkdir(parents=True)
    where.journal.write_bytes(b"".join(whole.lines[:records]) + rest)
    return where.journal


def broken_stimulus(whole: Unbroken, records: int) -> int | None:
    """The place of the trial whose stimulus may have been felt in vain, by the last records that are left."""
    steps = [entry for entry in whole.records[:records] if entry["kind"] == "step"]
    if not steps:
        return None
    last, done = steps[-1]["body"], whole.records[records - 1]["kind"] == "outcome"
    if last["kind"] == "fire" or (not done and last["kind"] in ("ask", "present")):
        keys = [trial_key(trial) for trial in whole.plan.record()["trials"]]
        return keys.index(trial_key(last["trial"]))
    return None


def trial_key(trial: dict[str, Any]) -> tuple[int, int]:
    return trial["session"], trial["trial"]


def done_trials(entries: list[dict[str, Any]], name: str) -> Iterator[tuple[int, int]]:
    """The trials in the order in which they were answered."""
    for step, outcome in pairwise(entry for entry in entries if entry["kind"] in ("step", "outcome")):
        answered = step["kind"] == "step" and step["body"]["kind"] == LAST_ANSWER[name]
        if answered and outcome["kind"] == "outcome" and outcome["body"]["kind"] != "interrupted":
            yield trial_key(step["body"]["trial"])


def check_resumed(whole: Unbroken, journal: Path, records: int) -> None:
    name, results = whole.name, journal.parent.parent
    done = run(request(name, results, "resume", seed=None), synthetic_screen, VirtualClock())
    assert done.plan == whole.plan
    contents = read_journal(journal)
    assert contents.finished
    # nothing that was on the disk changed
    assert b"".join(journal.read_bytes().splitlines(keepends=True)[:records]) == b"".join(whole.lines[:records])
    assert contents.records[records].kind == "resumed"
    # what is left is done in the order of the plan
    planned = [trial_key(trial) for trial in whole.plan.record()["trials"]]
    assert list(done_trials(raw(journal), name)) == planned
    # one row a trial, each with the answers of the unbroken run
    rows = rows_of(done.place.table)
    assert len(rows) == len(planned)
    for column in ANSWERS[name]:
        assert [row[column] for row in rows] == [row[column] for row in whole.rows], column
    for row, other in zip(rows, whole.rows, strict=True):
        if name == "preference":
            assert float(row["exposure_s"]) == pytest.approx(float(other["exposure_s"]), abs=1e-6)
    # a stimulus that was, or may have been, felt in vain is told
    broken = broken_stimulus(whole, records)
    for number, row in enumerate(rows):
        told = ("2", "interrupted") if number == broken else ("1", "")
        assert (row["attempts"], row["flags"]) == told, number
    # rows that were complete before are the same to the last byte
    complete = set(done_trials(whole.records[:records], name))
    for key, row, other in zip(planned, rows, whole.rows, strict=True):
        assert key not in complete or row == other
    assert rebuild(journal)[1] == done.place.table.read_bytes()
    assert raw(contents.path)[-1]["table_sha256"] == hashlib.sha256(done.place.table.read_bytes()).hexdigest()


def test_an_unbroken_run_has_one_attempt_a_trial_and_no_flag(unbroken: dict[str, Unbroken]) -> None:
    for whole in unbroken.values():
        assert {(row["attempts"], row["flags"]) for row in whole.rows} == {("1", "")}
        assert whole.records[-1]["kind"] == "finished"
        assert whole.records[-1]["table_sha256"] == hashlib.sha256(whole.table).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize("name", SETUPS)
def test_a_run_broken_off_at_any_record_goes_on_to_the_same_answers(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken[name]
    for records in range(1, len(whole.lines)):
        check_resumed(whole, broken_off(whole, tmp_path / str(records), records), records)


@pytest.mark.slow
@pytest.mark.parametrize("name", SETUPS)
def test_a_run_broken_off_within_a_record_goes_on_from_the_last_whole_one(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken[name]
    for records in (1, 3, 4, 7, 11):
        rest = whole.lines[records][: len(whole.lines[records]) // 2]
        journal = broken_off(whole, tmp_path / str(records), records, rest)
        check_resumed(whole, journal, records)
        assert raw(journal)[records]["cut_bytes"] == len(rest)


@pytest.mark.slow
@pytest.mark.parametrize(("more", "says"), [(1, "comes again as a whole"), (2, "if the journal is cut short")])
def test_a_row_that_a_resumed_run_takes_back_is_no_sign_of_a_cut_journal(
    more: int, says: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken["direction"]
    journal = broken_off(whole, tmp_path, 2)
    run(request(whole.name, tmp_path, "resume"), synthetic_screen, VirtualClock())
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:20]))
    table, data, _ = rebuild(journal)
    rows, answered = data.splitlines(keepends=True), whole.table.splitlines(keepends=True)
    lacks = [number for number, line in enumerate(rows) if line != answered[number]][-more:]
    table.write_bytes(b"".join(answered[number] if number in lacks else line for number, line in enumerate(rows)))
    (message,) = rebuild_table(journal).messages
    assert says in message


@pytest.mark.parametrize("name", SETUPS)
def test_a_run_may_be_broken_off_and_gone_on_with_many_times(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken[name]
    journal = broken_off(whole, tmp_path, 2)
    for _ in range(4):
        run(request(name, tmp_path, "resume"), synthetic_screen, VirtualClock())
        lines = journal.read_bytes().splitlines(keepends=True)
        resumed = max(number for number, line in enumerate(lines) if json.loads(line)["kind"] == "resumed")
        journal.write_bytes(b"".join(lines[: resumed + 6]))
    run(request(name, tmp_path, "resume"), synthetic_screen, VirtualClock())
    assert [entry.kind for entry in read_journal(journal).records].count("resumed") == 5
    rows = rows_of(place(tmp_path, "P01", name).table)
    for column in ANSWERS[name]:
        assert [row[column] for row in rows] == [row[column] for row in whole.rows]


@pytest.mark.parametrize("name", SETUPS)
def test_the_head_of_a_resumption_says_what_it_goes_on_with(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken[name]
    journal = broken_off(whole, tmp_path, 5)
    run(request(name, tmp_path, "resume"), synthetic_screen, VirtualClock())
    resumed = raw(journal)[5]
    assert resumed["stopped_utc"] == whole.records[4]["utc"]
    assert resumed["clock"] == "virtual"
    assert resumed["gun"]["model"] == "simulated"
    assert "git_commit" in resumed["provenance"]


# refused


def others(name: str) -> Iterator[Setup[DesignConfig]]:
    setup = SETUPS[name]
    yield replace(setup, config=setup.config.model_copy(update={"title": "another"}))
    yield replace(setup, gun=setup.gun.model_copy(update={"title": "another"}))


@pytest.mark.parametrize("name", SETUPS)
@pytest.mark.parametrize("records", [1, 8])
def test_another_config_or_gun_is_refused(
    name: str, records: int, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken[name], tmp_path, records)
    before = journal.read_bytes()
    for setup in others(name):
        with pytest.raises(PlaceError, match=r"config or gun file: \S+: title \(.*, now \"another\"\); .*--fresh"):
            run(request(name, tmp_path, "resume", setup=setup), synthetic_screen, VirtualClock())
    assert journal.read_bytes() == before


@pytest.mark.parametrize("name", SETUPS)
def test_another_seed_is_refused_and_the_same_is_not(name: str, unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    journal = broken_off(unbroken[name], tmp_path, 4)
    before = journal.read_bytes()
    with pytest.raises(PlaceError, match="began with seed 1, not 2; leave out --seed"):
        run(request(name, tmp_path, "resume", seed=2), synthetic_screen, VirtualClock())
    assert journal.read_bytes() == before
    run(request(name, tmp_path, "resume", seed=1), synthetic_screen, VirtualClock())


def with_plan(line: bytes, plan: dict[str, Any], **others: object) -> bytes:
    return record_line(json.loads(line) | {"plan": plan} | others)


@pytest.mark.parametrize("name", SETUPS)
def test_another_plan_is_refused_at_the_first_step_that_does_not_follow(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken[name]
    journal = broken_off(whole, tmp_path, 20)
    other = plan_of(SETUPS[name].config, "P01", 3)
    assert other.trials[0] != whole.plan.trials[0]
    head = json.loads(with_plan(whole.lines[0], other.record(), plan_sha256=other.sha256()))
    journal.write_bytes(forged([head, *whole.records[1:20]]))
    with pytest.raises(JournalError, match=r"of the plan in line 1|from the plan in line 1"):
        run(request(name, tmp_path, "resume", seed=None), synthetic_screen, VirtualClock())


@pytest.mark.parametrize("name", SETUPS)
def test_a_plan_that_was_changed_where_no_trial_was_reached_yet_is_refused_by_its_hash(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken[name]
    journal = broken_off(whole, tmp_path, 5)
    last = whole.plan.trials[-1]
    plan = replace(whole.plan, trials=(*whole.plan.trials[:-1], turned(last)))
    journal.write_bytes(with_plan(whole.lines[0], plan.record()) + b"".join(whole.lines[1:5]))
    with pytest.raises(JournalError, match="line 1"):
        run(request(name, tmp_path, "resume"), synthetic_screen, VirtualClock())


@pytest.mark.parametrize("plan", [{}, [], None, {"seed": 1}])
def test_a_head_whose_plan_is_none_is_a_journal_error(plan: Any, unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    whole = unbroken["direction"]
    journal = broken_off(whole, tmp_path, 5)
    journal.write_bytes(with_plan(whole.lines[0], plan) + b"".join(whole.lines[1:5]))
    for attempt in (
        lambda: rebuild(journal),
        lambda: run(request("direction", tmp_path, "resume"), synthetic_screen, VirtualClock()),
    ):
        with pytest.raises(JournalError, match="line 1"):
            attempt()


def test_an_answer_that_was_changed_to_none_is_refused_with_its_line(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken["direction"]
    journal = broken_off(whole, tmp_path, 9)
    answer = whole.records[6]
    assert answer["body"]["kind"] == "answered"
    answer["body"]["value"] = "left"
    journal.write_bytes(b"".join([*whole.lines[:6], record_line(answer), *whole.lines[7:9]]))
    with pytest.raises(JournalError, match="line 8: does not follow from line 7, which was changed"):
        run(request("direction", tmp_path, "resume"), synthetic_screen, VirtualClock())
    journal.write_bytes(forged([*whole.records[:6], answer, *whole.records[7:9]]))
    with pytest.raises(JournalError, match=r"line 7: value 'left' is no answer; the record was changed"):
        run(request("direction", tmp_path, "resume"), synthetic_screen, VirtualClock())


def test_an_outcome_without_its_step_is_refused_with_its_line(unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    whole = unbroken["direction"]
    doubled = [whole.records[number] for number in (0, 1, 2, 2)]
    journal = broken_off(whole, tmp_path, 1)
    journal.write_bytes(forged(doubled))
    with pytest.raises(JournalError, match="line 4: an outcome without its step"):
        history(read_journal(journal))


def test_an_emergency_stop_that_the_disk_did_not_take_is_known_from_the_stop_and_not_from_words_for_it(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    whole = unbroken["direction"]
    stopped = {"kind": "stopped", "reason": EMERGENCY, "monotonic_s": 1.0, "utc": "2026-01-01T00:00:00Z"}
    journal = broken_off(whole, tmp_path, 1)
    for more, halted in (({"halted": True}, True), ({}, False)):
        journal.write_bytes(forged([*(whole.records[number] for number in (0, 1, 2)), stopped | more]))
        session = design_session(read_journal(journal).plan, SETUPS["direction"])
        assert replay(session, read_journal(journal)).halted == halted


@pytest.mark.parametrize("name", SETUPS)
def test_an_unfinished_run_is_neither_gone_on_with_nor_written_over_unasked(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken[name], tmp_path, 6)
    before = journal.read_bytes()
    with pytest.raises(PlaceError, match=r"unfinished run .* after record 5: .*--resume goes on .*--fresh --reason T"):
        run(request(name, tmp_path, "ask"), synthetic_screen, VirtualClock())
    assert journal.read_bytes() == before


@pytest.mark.parametrize("name", SETUPS)
def test_a_fresh_run_sets_the_unfinished_one_aside_with_every_byte(
    name: str, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken[name], tmp_path, 6, b'{"half')
    before = journal.read_bytes()
    run(request(name, tmp_path, "fresh", seed=5), synthetic_screen, VirtualClock())
    assert journal.with_name(f"{journal.stem}.aside-1.jsonl").read_bytes() == before
    assert read_journal(journal).plan.seed == 5


def test_why_a_run_was_set_aside_stands_in_the_register_and_in_the_new_journals_head(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    asked = replace(request("preference", tmp_path, "fresh"), anew_reason="the gun came loose")
    run(asked, synthetic_screen, VirtualClock())
    (_, one), *others = register.read_register(tmp_path).entries
    assert not others
    assert one.model_dump() == {
        "kind": "set-aside",
        "participant_id": "P01",
        "experiment": "preference",
        "reason": "the gun came loose",
    }
    assert raw(journal)[0]["set_aside_reason"] == "the gun came loose"


def test_where_there_was_nothing_to_set_aside_no_reason_is_recorded(tmp_path: Path) -> None:
    asked = replace(request("preference", tmp_path, "fresh"), anew_reason="the gun came loose")
    done = run(asked, synthetic_screen, VirtualClock())
    assert not register.read_register(tmp_path).entries
    assert "set_aside_reason" not in raw(done.place.journal)[0]


def test_a_reason_that_cannot_be_recorded_leaves_the_run_where_it_is(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    before = journal.read_bytes()
    with pytest.raises(RegisterError, match="must say why"):
        run(
            replace(request("preference", tmp_path, "fresh"), anew_reason="two\nlines"),
            synthetic_screen,
            VirtualClock(),
        )
    assert journal.read_bytes() == before
    assert not list(journal.parent.glob("*aside*"))


def refused_anew(results: Path, match: str, **how: Any) -> None:
    """A run that is begun anew for a reason, and refused: the one that is there stays, and nothing is on record."""
    journal = place(results, "P01", "preference").journal
    before = {file: file.read_bytes() for file in results.rglob("*") if file.is_file()}
    asked = replace(request("preference", results, "fresh"), anew_reason="the gun came loose", **how)
    with pytest.raises((PlaceError, DeviceError), match=match):
        run(asked, synthetic_screen, RealClock() if "gun" in how else VirtualClock())
    assert before == {file: file.read_bytes() for file in results.rglob("*") if file.is_file()}
    assert journal in before


def test_a_fresh_run_whose_gun_cannot_be_opened_leaves_the_unfinished_one_where_it_is(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    broken_off(unbroken["preference"], tmp_path, 6)
    refused_anew(tmp_path, "no-such-port", gun="serial:/dev/no-such-port")


def test_a_fresh_run_whose_sensor_is_refused_leaves_the_unfinished_one_where_it_is(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    broken_off(unbroken["preference"], tmp_path, 6)
    refused_anew(tmp_path, "sensor csv:nowhere.csv", sensor="csv:nowhere.csv")


def test_a_run_that_another_one_took_the_place_of_meanwhile_is_not_set_aside(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    newer = b"".join(unbroken["preference"].lines[:9])

    def slow_screen(*made: Any) -> Any:
        journal.write_bytes(newer)
        return synthetic_screen(*made)

    asked = replace(request("preference", tmp_path, "fresh"), anew_reason="the gun came loose")
    with pytest.raises(JournalError, match="another run wrote to it just now; look again"):
        run(asked, slow_screen, VirtualClock())
    assert journal.read_bytes() == newer
    assert not register.read_register(tmp_path).entries


def test_what_cannot_be_read_is_set_aside_for_a_reason_alone(unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    spoilt = journal.read_bytes().replace(b'"n":3', b'"n":4')
    journal.write_bytes(spoilt)
    with pytest.raises(PlaceError, match=r"--fresh sets them aside, so say why with --reason TEXT"):
        run(request("preference", tmp_path, "fresh"), synthetic_screen, VirtualClock())
    assert journal.read_bytes() == spoilt


def test_what_another_version_wrote_is_set_aside_for_a_reason_alone(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    records = raw(journal)
    step = next(record for record in records if record["kind"] == "step")
    step["body"]["kind"] = "newer"
    records[0]["participant"] = "person"
    journal.write_bytes(forged(records))
    asked = request("preference", tmp_path, "fresh")
    with pytest.raises(PlaceError, match=rf"line {step['n'] + 1}: Input tag 'newer' .*; --fresh sets them aside"):
        earlier_run(place(tmp_path, "P01", "preference"), asked)
    earlier = earlier_run(place(tmp_path, "P01", "preference"), replace(asked, anew_reason="another version"))
    assert (earlier.gives_way, earlier.reason) == (True, "another version")


@pytest.mark.parametrize("again", ["resume", "fresh", "ask"])
def test_the_run_of_somebody_who_is_excluded_neither_goes_on_nor_gives_way(
    again: Again, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    before = journal.read_bytes()
    register.append(tmp_path, register.entry("excluded", "P01", reason="felt ill"), VirtualClock())
    asked = replace(request("preference", tmp_path, again), anew_reason="again")
    with pytest.raises(PlaceError, match=r"P01 is excluded \(felt ill\); readmit them"):
        run(asked, synthetic_screen, VirtualClock())
    assert journal.read_bytes() == before


@pytest.mark.parametrize("again", ["resume", "fresh", "ask"])
def test_a_journal_of_another_participant_is_never_gone_on_with_nor_set_aside(
    again: Again, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    theirs = place(tmp_path, "P02", "preference")
    theirs.folder.mkdir()
    copied = journal.rename(theirs.journal).read_bytes()
    asked = replace(request("preference", tmp_path, again), participant_id="P02", anew_reason="again")
    with pytest.raises(JournalError, match=r"is of participant P01, experiment preference; it was renamed or copied"):
        run(asked, synthetic_screen, VirtualClock())
    assert theirs.journal.read_bytes() == copied


def test_a_run_that_began_on_a_gun_is_not_gone_on_with_where_nothing_is_felt(
    unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    records = raw(journal)
    records[0]["gun"] |= {"model": "haptic-gun", "serial": "77"}
    journal.write_bytes(forged(records))
    before = journal.read_bytes()
    said = r"began on haptic-gun:77, .*the gun it began with \(--gun\), or start anew \(--fresh\)"
    with pytest.raises(NotAsItBegan, match=said) as refused:
        run(request("preference", tmp_path, "resume"), synthetic_screen, VirtualClock())
    assert " --" not in refused.value.refusal  # which a window says, where there is no command line
    assert journal.read_bytes() == before


class Sit(NamedTuple):
    """Sittings on a gun that has a name, and what was said of it."""

    at: Callable[..., Path]
    told: list[str]


NAMED_GUN = """
from device import Identity
from device.simulated import SimulatedGun

class NamedGun(SimulatedGun):
    def __init__(self, name, methods, clock):
        super().__init__(methods, clock)
        self.name = name

    def identify(self):
        return Identity(model="shaker", version="2", serial=self.name)

open_gun = NamedGun
"""


def sat(asked: RunRequest, records: int, told: list[str]) -> Path:
    """A run that was broken off after so many records, and what its screen was told."""

    def screen(*given: Any) -> Any:
        made = synthetic_screen(*given)
        made.trouble = told.append  # type: ignore[method-assign]
        return made

    journal = run(asked, screen, VirtualClock()).place.journal
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:records]))
    return journal


@pytest.mark.slow
@pytest.mark.parametrize(
    ("had", "said"),
    [
        (ParticipantOptions(noise=True), "Masking noise was asked for in this run until now"),
        (ParticipantOptions(screen=True), "The participant had a screen of their own in this run until now"),
        (ParticipantOptions(keys=True), "The participant had keys of their own in this run until now"),
    ],
)
def test_a_run_in_which_the_participant_had_something_and_goes_on_without_says_so_once_and_has_it_on_record(
    tmp_path: Path, had: ParticipantOptions, said: str
) -> None:
    told = list[str]()

    def sit(again: Again, records: int, options: ParticipantOptions) -> Path:
        return sat(replace(request("direction", tmp_path, again), options=options), records, told)

    sit("ask", 8, had)
    sit("resume", 16, had)
    assert told == []
    sit("resume", 24, ParticipantOptions())
    journal = sit("resume", 32, ParticipantOptions())
    assert [text.startswith(said) for text in told] == [True]
    assert [one["body"]["text"] for one in raw(journal) if one["kind"] == "remark"] == told


@pytest.fixture
def sit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Sit:
    """A sitting on a gun of a name, which is cut off after so many records; what it said of the gun is in `told`."""
    install(monkeypatch, tmp_path, NAMED_GUN, name="shaker", module="named_gun")
    told = list[str]()

    def at(gun: str, again: Again, records: int, *, noise: bool = False) -> Path:
        asked = replace(request("direction", tmp_path / "results", again), gun=f"shaker:{gun}")
        return sat(replace(asked, options=ParticipantOptions(noise=noise)), records, told)

    return Sit(at=at, told=told)


@pytest.mark.slow
def test_a_run_that_goes_on_on_another_gun_says_so_and_has_it_on_record(sit: Sit) -> None:
    sit.at("left", "ask", 8)
    sit.at("left", "resume", 16)
    assert sit.told == []
    sit.at("right", "resume", 24)
    sit.at("right", "resume", 32)
    journal = sit.at("left", "resume", 40)
    names = ["shaker:left (version 2)", "shaker:right (version 2)"]
    assert [one.partition(" from here on")[0] for one in sit.told] == [
        f"The gun was {was} until now, and is {now}" for was, now in (names, names[::-1])
    ]
    assert [one["body"]["text"] for one in raw(journal) if one["kind"] == "remark"] == sit.told


@pytest.mark.slow
def test_all_that_is_not_as_before_is_said_at_once_as_a_second_message_takes_the_place_of_the_first(sit: Sit) -> None:
    sit.at("left", "ask", 8, noise=True)
    journal = sit.at("right", "resume", 16)
    (said,) = sit.told
    assert [one["body"]["text"] for one in raw(journal) if one["kind"] == "remark"] == said.split("\n")
    assert [line.partition(" ")[0] for line in said.split("\n")] == ["Masking", "The"]


@pytest.mark.slow
def test_a_gun_on_which_nothing_was_fired_is_not_the_one_that_a_run_had(sit: Sit) -> None:
    journal = sit.at("left", "ask", 8)
    assert way_back_to_gun(journal, "shaker:left") == " --gun shaker:left"
    records = [one["kind"] for one in raw(sit.at("right", "resume", 12))]
    assert records[8:] == ["resumed", "outcome", "step", "remark"]
    assert len(sit.told) == 1
    back = " and --gun for shaker:left (version 2), as nothing was felt on the other yet"
    assert way_back_to_gun(journal, "shaker:right") == back
    sit.at("left", "resume", 24)
    assert len(sit.told) == 1
    assert way_back_to_gun(journal, "shaker:left") == " --gun shaker:left"


@pytest.mark.parametrize("again", ["ask", "resume", "fresh"])
def test_a_journal_in_which_nothing_was_acknowledged_is_set_aside(
    again: Again, unbroken: dict[str, Unbroken], tmp_path: Path
) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 0, b'{"half')
    run(request("preference", tmp_path, again), synthetic_screen, VirtualClock())
    assert read_journal(journal).finished
    assert journal.with_name(f"{journal.stem}.aside-1.jsonl").read_bytes() == b'{"half'


@pytest.mark.slow
def test_a_run_that_another_process_is_at_cannot_be_set_aside(unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    journal = broken_off(unbroken["preference"], tmp_path, 6)
    with Journal.reopen(read_journal(journal), VirtualClock()), pytest.raises(JournalError, match="another run holds"):
        run(request("preference", tmp_path, "fresh"), synthetic_screen, VirtualClock())


@pytest.mark.parametrize("again", ["ask", "resume", "fresh"])
def test_a_finished_run_is_never_done_again(again: Again, unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    whole = unbroken["preference"]
    journal = broken_off(whole, tmp_path, len(whole.lines))
    with pytest.raises(PlaceError, match=r"has finished preference: .*a retest is a copy of the config"):
        run(request("preference", tmp_path, again), synthetic_screen, VirtualClock())
    assert journal.read_bytes() == b"".join(whole.lines)


# parts


@pytest.mark.parametrize("name", SETUPS)
def test_replaying_a_whole_journal_stands_at_the_end(name: str, unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    whole = unbroken[name]
    contents = read_journal(broken_off(whole, tmp_path, len(whole.lines) - 1))
    session = design_session(whole.plan, SETUPS[name])
    standing = replay(session, contents)
    assert standing.step is None
    told: list[object] = []
    assert go_on(session, contents, standing, lambda *record, **body: told.append((record, body))) == standing
    assert told == []


@pytest.mark.parametrize("name", SETUPS)
def test_a_rebuilt_table_is_the_same_to_the_last_byte(name: str, unbroken: dict[str, Unbroken], tmp_path: Path) -> None:
    whole = unbroken[name]
    journal = broken_off(whole, tmp_path, len(whole.lines))
    path, data, contents = rebuild(journal)
    assert path == place(tmp_path, "P01", name).table
    assert data == whole.table
    assert contents.finished
