"""Markers for Lab Streaming Layer: what a recorder gets is the journal, row for row; trouble is said once."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pylsl
import pytest

from experiments.doctor import verdicts
from experiments.record.journal import Contents, read_journal
from experiments.watch.feed import MarkerFeed
from experiments.watch.lsl import source_of
from experiments.watch.markers import KEY_S, RECORD_S, Marker, RunMarkers
from experiments.watch.markers_process import markers_beside
from tests.at_runs import shorten
from tests.at_terminal import DAMPER, ENDS, FIRES, AtTerminal
from tests.conftest import RECOIL, Recoil
from tests.gun_plugins import ROOT
from tests.journals import forged, raw
from tests.kills import words
from tests.recorder import markers_process, recorded, recording
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

pytestmark = pytest.mark.slow

NAME = "sub-P01_task-direction_journal.jsonl"
CLOCKS_S = 1e-4
"""So well the clocks are mapped, on a machine however busy."""
Entry = dict[str, Any]


# what a recorder gets


def told_by(journal: Path) -> Iterator[tuple[int, str, float, float]]:  # noqa: C901 - one case an event
    """What a journal's plain JSON says of shots, answers, pauses and ends: record, marker, time, uncertainty."""
    step: Entry = {}
    onset_s = 0.0
    for record in raw(journal):
        body, n, at_s = record.get("body") or {}, record["n"], record["monotonic_s"]
        match record["kind"], body.get("kind"):
            case "run", _:
                yield n, "begin", at_s, 0.01
            case "finished", _:
                yield n, "finish", at_s, 0.01
            case "step", _:
                step = body
            case "outcome", "fired":
                onset_s = body["pulse_start_s"]
                levels = "/".join(f"{name}={level}" for name, level in step["trial"]["levels"])
                yield n, f"shot/{levels}", onset_s, max(at_s - onset_s, onset_s - body["requested_s"])
            case "outcome", "answered":
                yield n, f"answer/response={body['value']}", onset_s + body["response_time_s"], 0.01
            case "remark", "paused":
                yield n, "pause", at_s, 0.01
            case "remark", "continued":
                yield n, "continue", at_s, 0.01
            case "remark", "corrected":
                yield n, f"correction/response={body['value']}", at_s, 0.01


def worked(*at_the_gun: str) -> Callable[[str, int], str]:
    """A person who works a run to its end, and types these where the gun is handed over."""
    typed = iter(at_the_gun)

    def reply(asked: str, _: int) -> str:
        if FIRES in asked:
            return next(typed, "")
        due = {DAMPER: "d", "go on": "go on", ENDS: "", "Correct the answer": "f"}
        return next((answer for words, answer in due.items() if words in asked), "b")

    return reply


def found(results: Path, seconds: float) -> list[pylsl.StreamInfo]:
    return list(pylsl.resolve_bypred(f"starts-with(source_id,'{source_of(results)}')", 2, seconds))


@pytest.mark.soak  # twenty seconds, in which LabRecorder is waited for
def test_a_recording_is_the_journal_row_for_row(quick_configs: Path, tmp_path: Path) -> None:
    shorten(quick_configs)
    results, xdf = tmp_path / "results", tmp_path / "run.xdf"
    results.mkdir()
    run = warm(*words(quick_configs, "--screen", "terminal"))
    with markers_process(results):
        streams = [pylsl.StreamInlet(info) for info in found(results, PATIENCE_S)]
        for stream in streams:
            stream.open_stream(PATIENCE_S)
        with recording(xdf, source_of(results)), AtTerminal(run, tmp_path) as screen:
            screen.work(worked("", "pause", "", "", "undo"))
            assert screen.end() == 0
            for stream in streams:
                while stream.pull_sample(PATIENCE_S)[0][0] != "finish":
                    pass
    told = list(told_by(results / "sub-P01" / NAME))
    assert {name.split("/")[0] for _, name, _, _ in told} == {
        *("begin", "shot", "answer", "pause", "continue", "correction", "finish")
    }
    names, rows = recorded(xdf)
    assert [name for _, name in names] == [name for _, name, _, _ in told]
    assert [(int(row["record"]), row["name"]) for _, row in rows] == [(n, name) for n, name, _, _ in told]
    assert [at_s for at_s, _ in names] == [at_s for at_s, _ in rows]
    for (at_s, row), (_, _, own_s, within_s) in zip(rows, told, strict=True):
        assert at_s == pytest.approx(own_s, abs=CLOCKS_S)  # the same clock on Linux
        assert float(row["uncertainty_s"]) == pytest.approx(within_s, abs=CLOCKS_S)


def test_a_run_with_markers_has_its_streams_from_its_begin_to_its_end(quick_configs: Path, tmp_path: Path) -> None:
    shorten(quick_configs)
    run = warm(*words(quick_configs, "--screen", "terminal", "--lsl"))
    with AtTerminal(run, tmp_path) as screen:
        screen.prompt(0)
        assert len(found(tmp_path / "results", PATIENCE_S)) == 2
        screen.work(worked())
        assert screen.end() == 0
    assert found(tmp_path / "results", 0.5) == []
    assert "markers" not in screen.seen


# what is in the way


DEAF = """[multicast]
MachineAddresses = {}
LinkAddresses = {}
SiteAddresses = {}
ResolveScope = machine
"""
"""A network on which nobody is found, in the words of the library's own config."""


@pytest.mark.parametrize(
    ("library", "network", "said"),
    [
        ("raise ImportError('no pylsl')", "", "no Lab Streaming Layer here (no pylsl): install the extra `lsl`"),
        ("raise RuntimeError('no binary')", "", "no Lab Streaming Layer here (no binary): install the extra `lsl`"),
        ("raise SystemExit", "", "the package pylsl is broken (SystemExit): install the extra `lsl`"),
        ("IRREGULAR_RATE = 0.0", "", "pylsl.py: is not what it should be (AttributeError: module 'pylsl' has no"),
        ("", DEAF, "the streams are not found on this machine's own network"),
    ],
)
def test_what_is_in_the_way_is_said_once_and_the_run_goes_on(  # noqa: PLR0917
    library: str, network: str, said: str, quick_configs: Path, tmp_path: Path, recoil: Recoil
) -> None:
    variables = {}
    if library:
        (tmp_path / "fake").mkdir()
        (tmp_path / "fake" / "pylsl.py").write_text(library)
        variables["PYTHONPATH"] = str(tmp_path / "fake")
    if network:
        (tmp_path / "deaf.cfg").write_text(network)
        variables["LSLAPICFG"] = str(tmp_path / "deaf.cfg")
    done = recoil(*words(quick_configs, "--screen", "synthetic", "--gun", "simulated", "--lsl"), **variables)
    assert done.returncode == 0
    apart = ("clock of its own", "the run waits for the streams")  # the second on a slow machine
    (line,) = [line for line in done.stderr.splitlines() if not any(words in line for words in apart)]
    assert said in line
    assert read_journal(tmp_path / "results" / "sub-P01" / NAME).finished


LIBRARY = """
import time
IRREGULAR_RATE = 0.0
class Any:
    def __getattr__(self, name): return lambda *_: self
StreamInfo = lambda *_: Any()
class StreamOutlet:
    def __init__(self, info): pass
    def push_sample(self, sample, at_s): {push}
    def have_consumers(self): return False
def local_clock(): return {clock}
def resolve_bypred(*_): return {found}
"""


@pytest.mark.parametrize(
    ("odd", "said"),
    [
        ({}, ""),
        ({"push": "1 / 0"}, "no markers: Lab Streaming Layer broke off (ZeroDivisionError: division by zero)"),
        ({"push": "time.sleep(3600)"}, "markers: their process hung and was ended; some may not have been sent"),
        ({"push": "__import__('os')._exit(7)"}, "markers: their process broke off (exit code 7)"),
        ({"found": "None"}, "no markers: Lab Streaming Layer broke off (TypeError: object of type 'NoneType'"),
        ({"found": "exit(3)"}, "no markers: Lab Streaming Layer broke off (SystemExit: 3)"),
        ({"clock": "float('nan')"}, "is not what it should be (ValueError: its clock gives nan)"),
    ],
)
def test_what_an_odd_library_does_in_a_run_is_said_once(  # noqa: PLR0917
    odd: dict[str, str],
    said: str,
    journal: Path,
    whole: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    pushed = tmp_path / "pushed"
    parts = {"push": "None", "found": "[1, 2]", "clock": "time.monotonic()"} | odd
    parts["push"] = f"open({str(pushed)!r}, 'w').close(); {parts['push']}"
    (tmp_path / "fake").mkdir()
    (tmp_path / "fake" / "pylsl.py").write_text(LIBRARY.format(**parts))
    monkeypatch.syspath_prepend(tmp_path / "fake")
    told = list[str]()
    with markers_beside(journal.parents[1], told.append):
        journal.write_bytes(forged(now(entries_of(whole))[:3]))
        wait_for(lambda: told or pushed.exists())
    assert [said in line for line in told] == [True] * bool(said)
    assert "Traceback" not in capfd.readouterr().err


def test_markers_need_a_folder_that_is_there_and_a_library(recoil: Recoil, tmp_path: Path) -> None:
    assert recoil("markers", "nowhere").returncode == 2
    (tmp_path / "fake").mkdir()
    (tmp_path / "fake" / "pylsl.py").write_text("raise ImportError('no pylsl')")
    command = [RECOIL, "markers", str(tmp_path)]
    environment = {"PYTHONPATH": str(tmp_path / "fake"), "HOME": str(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("recoil: no Lab Streaming Layer here (no pylsl)")
    assert done.stderr.count("\n") == 1


# the markers of a journal


@pytest.fixture(scope="module")
def whole(reproduction: Path) -> bytes:
    """The journal of a finished run."""
    return (reproduction / "logs" / "sub-P01" / NAME).read_bytes()


def entries_of(data: bytes) -> list[Entry]:
    return [json.loads(line) for line in data.splitlines()]


def markers_of(contents: Contents) -> list[Marker]:
    one = RunMarkers(contents.head)
    return [marker for marker in map(one.of, contents.records) if marker is not None]


def told_after(whole: bytes, tmp_path: Path, kind: str, *more: Entry) -> list[Marker]:
    """The markers of records that follow the first step of a kind in a journal."""
    entries, path = entries_of(whole), tmp_path / NAME
    end = next(n for n, one in enumerate(entries, 1) if one["kind"] == "step" and one["body"]["kind"] == kind)
    path.write_bytes(forged([*entries[:end], *(entries[end - 1] | {"monotonic_s": 1000.0} | one for one in more)]))
    return markers_of(read_journal(path))[-len(more) :]


def remark(**body: object) -> Entry:
    return {"kind": "remark", "body": body}


def outcome(**body: object) -> Entry:
    return {"kind": "outcome", "body": body}


FIRED = {
    "kind": "fired", "gun": "g", "onset_utc": "", "requested_s": 998.0, "pulse_start_s": 999.0, "pulse_end_s": 999.0,
    "home_predicted_s": 999.0, "motion": "home",
}  # fmt: skip
TIMING = dict.fromkeys(
    ("requested_s", "written_s", "acknowledged_s", "accepted_s", "pulse_start_s", "pulse_end_s"), 1.0
)
TIMING |= {"uncertainty_s": 0.0004}
TEST_SHOT = {"kind": "test-shot", "method": "vibration", "held_s": 1.0}
COUNTS = dict.fromkeys(("gun_accepted_us", "gun_start_us", "gun_end_us", "gun_count", "asked"), 1)


def test_a_shots_uncertainty_is_the_guns_own_or_else_lies_between_request_and_record(
    whole: bytes, tmp_path: Path
) -> None:
    (bounded,) = told_after(whole, tmp_path, "fire", outcome(**FIRED))
    assert (bounded.at_s, bounded.uncertainty_s, bounded.time_from, bounded.attempt) == (999.0, 1.0, "gun", 1)
    (stated,) = told_after(whole, tmp_path, "fire", outcome(**FIRED, timing=TIMING | COUNTS))
    assert (stated.at_s, stated.uncertainty_s) == (999.0, 0.0004)


@pytest.mark.parametrize(
    ("record", "name", "value"),
    [
        (remark(kind="paused", cause="the keys are gone"), "pause", "the keys are gone"),
        (remark(kind="continued", paused_s=2.0), "continue", ""),
        (remark(kind="halted", by="participant"), "emergency-stop", "participant"),
        (remark(**TEST_SHOT, pulse_start_s=999.0), "test-shot/method=vibration", ""),
        (remark(**TEST_SHOT, cause="no link"), "fault", "no link"),
        (outcome(kind="failed", cause="no answer"), "fault", "no answer"),
        ({"kind": "stopped", "reason": "their words"}, "stop", ""),
    ],
)  # fmt: skip
def test_pauses_faults_and_stops_are_markers(
    record: Entry, name: str, value: str, whole: bytes, tmp_path: Path
) -> None:
    (marker,) = told_after(whole, tmp_path, "fire", record)
    assert (marker.name, marker.value) == (name, value)


def test_a_faults_uncertainty_reaches_back_to_its_step(whole: bytes, tmp_path: Path) -> None:
    failed = outcome(kind="failed", cause="no answer")
    step = next(one for one in entries_of(whole) if one["kind"] == "step" and one["body"]["kind"] == "fire")
    (fault,) = told_after(whole, tmp_path, "fire", failed)
    assert fault.at_s - fault.uncertainty_s == pytest.approx(step["monotonic_s"])


@pytest.mark.parametrize(
    "record",
    [
        remark(kind="noted", trial=None, text="their words"),
        remark(kind="refused", event="fire", state="asking", because="held", by="participant"),
        remark(kind="halt-reason", text="their words"),
    ],
)
def test_what_is_no_event_of_the_participants_is_no_marker(record: Entry, whole: bytes, tmp_path: Path) -> None:
    assert told_after(whole, tmp_path, "fire", record)[0].name == "begin"


def test_trains_ratings_and_descriptions_are_told_but_no_words(reproduction: Path, tmp_path: Path) -> None:
    folder = reproduction / "logs" / "sub-P01"
    (journal,) = folder.glob("*preference_journal.jsonl")
    entries = raw(journal)
    contents = read_journal(journal)
    told = markers_of(contents)
    shots = [marker for marker in told if marker.name.startswith("shot/")]
    assert [marker.at_s for marker in shots] == [
        one["body"]["pulse_start_s"] for one in entries if one["kind"] == "shot"
    ]
    assert shots[0].name.startswith("shot/method=")
    assert [marker.shot for marker in shots][:2] == [1, 2]
    ratings = [one["body"]["value"] for one in entries if (one.get("body") or {}).get("kind") == "answered"]
    said = [marker for marker in told if marker.name.startswith("answer/")]
    assert len(said) == len(ratings)
    for marker, value in zip(said, ratings, strict=True):
        number = isinstance(value, float)
        assert marker.value == (str(value) if number else "")
        assert marker.name.endswith(f"={value}") == number
    described = next(one for one in entries if one["kind"] == "step" and one["body"]["kind"] == "describe")["body"]
    words = {"kind": "corrected", "trial": described["trial"], "question": described["question"], "value": "my name"}
    end = next(n for n, one in enumerate(entries) if one["kind"] == "finished")
    path = tmp_path / journal.name
    path.write_bytes(forged([*entries[:end], entries[end - 1] | remark(**words)]))
    assert markers_of(read_journal(path))[-1].name == f"correction/{described['question']}"


def test_the_assumed_lateness_is_what_the_doctor_lets_pass() -> None:
    assert (1000 * KEY_S, 1000 * RECORD_S) == (verdicts.MAX_KEY_MS, verdicts.MAX_KEY_TO_DISK_MS)


# the feed


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    folder = tmp_path / "sub-P01"
    folder.mkdir()
    return folder / NAME


def now(entries: Sequence[Entry], ago_s: float = 0.0, clock: str = "real") -> list[Entry]:
    """The records as if they were written now, on this machine."""
    times = {"monotonic_s": time.monotonic() - ago_s, "utc": utc(ago_s)}
    return [one | times | ({"clock": clock} if "clock" in one else {}) for one in entries]


def utc(ago_s: float) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() - ago_s))


def names(feed: MarkerFeed) -> list[str]:
    feed.find()
    return [marker.name.split("/")[0] for marker in feed.look()]


def test_a_feed_gives_what_is_written_from_its_making_on_and_the_end_once(journal: Path, whole: bytes) -> None:
    entries, said = now(entries_of(whole)), list[str]()
    journal.write_bytes(forged(entries[:20]))
    feed = MarkerFeed(journal.parents[1], said.append)
    assert names(feed) == []
    journal.write_bytes(forged(entries[:26]))
    expected = [marker.name for marker in markers_of(read_journal(journal)) if marker.record >= 20]
    assert names(feed) == [name.split("/")[0] for name in expected]
    assert expected
    journal.write_bytes(forged(entries))
    assert names(feed)[-1] == "finish"
    assert (names(feed), said) == ([], [])
    journal.rename(journal.with_name("aside.jsonl"))
    journal.write_bytes(forged(entries[:2]))
    assert names(feed) == ["begin"]


@pytest.mark.parametrize(
    ("entries", "why"),
    [
        (lambda entries: now(entries, clock="virtual"), "on a clock of its own (virtual)"),
        (lambda entries: [one | {"monotonic_s": 5.0} for one in now(entries)], "written at another machine"),
    ],
)
def test_a_run_on_another_clock_has_no_markers_and_that_is_said_once(
    entries: Callable[[list[Entry]], list[Entry]], why: str, journal: Path, whole: bytes
) -> None:
    said = list[str]()
    feed = MarkerFeed(journal.parents[1], said.append)
    journal.write_bytes(forged(entries(entries_of(whole))))
    assert (names(feed), names(feed)) == ([], [])
    (line,) = said
    assert why in line


def test_a_damaged_journal_is_named_once_and_other_runs_go_on(journal: Path, whole: bytes) -> None:
    said, entries = list[str](), now(entries_of(whole))
    feed = MarkerFeed(journal.parents[1], said.append)
    other = journal.parents[1] / "sub-P02" / NAME.replace("P01", "P02")
    other.parent.mkdir()
    journal.write_bytes(forged(entries[:9]).replace(b'"kind":"step"', b'"kind":"stop"', 1))
    other.write_bytes(forged(entries[:2]))
    assert names(feed) == ["begin"]
    journal.write_bytes(forged(entries[:12]))
    assert names(feed) == []
    (line,) = said
    assert "kind must be one of" in line


def test_one_bad_entry_is_named_and_silences_no_other_run(journal: Path, whole: bytes) -> None:
    said, results = list[str](), journal.parents[1]
    (results / "sub-P00").symlink_to("sub-P00")
    other = journal.with_name(NAME.replace("direction", "other"))
    other.symlink_to(other.name)
    feed = MarkerFeed(results, said.append)
    journal.write_bytes(forged(now(entries_of(whole))[:2]))
    assert names(feed) == ["begin"]
    feed.find()
    assert [line.partition(":")[0] for line in said] == [str(results / "sub-P00"), str(other)]


def test_a_library_that_hangs_outlives_no_run(tmp_path: Path) -> None:
    (tmp_path / "pylsl.py").write_text("import time\ntime.sleep(3600)\n")
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    command = [sys.executable, "-m", "experiments.watch.markers_process", str(tmp_path)]
    with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdin is not None
        child.stdin.close()  # as at the end of a run, however it ends
        assert child.wait(PATIENCE_S) == 1


def test_a_name_that_is_no_text_ends_no_markers(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"sub-\xff")
    folder.mkdir()
    (folder / f"{folder.name}_task-direction_journal.jsonl").symlink_to("nowhere")
    with subprocess.Popen(
        [RECOIL, "markers", str(tmp_path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert "Streams" in child.stdout.readline()
        child.send_signal(signal.SIGINT)
        _, said = child.communicate(timeout=PATIENCE_S)
    assert "cannot be read (No such file or directory)" in said
    assert "Traceback" not in said


def test_a_folder_that_cannot_be_read_is_said_once(tmp_path: Path) -> None:
    said, place = list[str](), tmp_path / "file"
    place.touch()
    feed = MarkerFeed(place, said.append)
    assert (names(feed), names(feed), len(said)) == ([], [], 1)
