"""The page about runs in progress: what it shows of each, whom it refuses, and that it touches nothing."""

from __future__ import annotations

import http.client
import json
import os
import re
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from html.parser import HTMLParser
from pathlib import Path

import pytest

from device.messages import RecoilError
from experiments.record import storage, tail
from experiments.record.journal import JournalError
from experiments.record.tail import JournalTail
from experiments.session.remarks import HALTED_BEFORE
from experiments.watch import server as serving
from experiments.watch.folder import FolderWatch, Reader, Watched, watched_folder
from experiments.watch.page import PAGE_PARTS, page_parts, whole_page
from experiments.watch.runs import RunRow
from experiments.watch.server import WatchServer
from tests.conftest import Recoil, refused
from tests.journals import forged
from tests.waiting import PATIENCE_S, wait_for

pytestmark = pytest.mark.slow

NAME = "sub-P01_task-direction_journal.jsonl"


@pytest.fixture(scope="module")
def whole(reproduction: Path) -> bytes:
    """The journal of a finished run."""
    return (reproduction / "logs" / "sub-P01" / NAME).read_bytes()


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    folder = tmp_path / "results" / "sub-P01"
    folder.mkdir(parents=True)
    return folder / NAME


def results_of(journal: Path) -> Path:
    return journal.parent.parent


def lines_of(whole: bytes) -> list[bytes]:
    return whole.splitlines(keepends=True)


def rows(watch: FolderWatch) -> tuple[RunRow, ...]:
    seen = watch.look()
    assert seen is not None
    return seen.rows


def row(journal: Path) -> RunRow:
    (found,) = rows(FolderWatch(results_of(journal)))
    return found


def part(whole: bytes, kind: str, number: int = 1) -> bytes:
    """A journal up to the record of the n-th step of a kind, which stands last."""
    lines, count = lines_of(whole), 0
    for end, line in enumerate(lines, start=1):
        record = json.loads(line)
        count += record["kind"] == "step" and record["body"]["kind"] == kind
        if count == number:
            return b"".join(lines[:end])
    raise AssertionError(kind)


@contextmanager
def held(journal: Path) -> Iterator[None]:
    """A journal that a run has open, as the page sees it from another process."""
    descriptor = storage.reopen(journal)
    assert storage.hold(descriptor)
    try:
        yield
    finally:
        os.close(descriptor)


def with_remarks(whole: bytes, *bodies: dict[str, object]) -> bytes:
    """A journal that goes on with remarks."""
    entries = [json.loads(line) for line in lines_of(whole)]
    entries += [entries[-1] | {"kind": "remark", "body": body} for body in bodies]
    return forged(entries)


# what is shown of a run


def test_a_run_is_shown_with_its_place_and_what_is_awaited_and_without_any_answer(journal: Path, whole: bytes) -> None:
    journal.write_bytes(part(whole, "ask", 8))
    with held(journal):
        shown = row(journal)
    assert (shown.state, shown.done, shown.planned) == ("running", 7, 60)
    assert shown.where == "Trial 8 of 20 · set 2 of 4 · session 1 of 3"
    assert shown.doing == "an answer is awaited"
    seen = FolderWatch(results_of(journal)).look()
    assert seen is not None
    page = " ".join(page_parts(seen))
    assert "SYNTHETIC" in page
    for word in ("forward", "backward", "correct", "asymmetric", "vibration"):
        assert word not in page


@pytest.mark.parametrize(
    ("remarks", "state", "faults"),
    [
        ([{"kind": "paused"}], "paused", 0),
        ([{"kind": "paused", "cause": "the keys are gone"}], "paused", 1),
        ([{"kind": "paused"}, {"kind": "continued", "paused_s": 3.0}], "running", 0),
        ([{"kind": "halted", "by": "participant"}], "emergency stop", 1),
        ([{"kind": "noted", "trial": None, "text": HALTED_BEFORE}], "emergency stop", 0),
    ],
)
def test_a_pause_and_an_emergency_stop_are_told(
    remarks: list[dict[str, object]], state: str, faults: int, journal: Path, whole: bytes
) -> None:
    journal.write_bytes(with_remarks(part(whole, "prepare", 3), *remarks))
    with held(journal):
        shown = row(journal)
    assert (shown.state, shown.faults, shown.problem) == (state, faults, "")


def test_ends_are_told_apart(journal: Path, whole: bytes) -> None:
    journal.write_bytes(b"")
    assert row(journal).state == "not begun"
    with held(journal):
        assert row(journal).state == "beginning"
    journal.write_bytes(whole)
    assert (row(journal).state, row(journal).done) == ("finished", 60)
    cut = part(whole, "ask", 5)
    entries = [json.loads(line) for line in lines_of(cut)]
    journal.write_bytes(forged([*entries, entries[-1] | {"kind": "stopped", "reason": "lunch"}]))
    assert (row(journal).state, row(journal).doing) == ("stopped", "lunch")
    journal.write_bytes(cut + b'{"n":')
    assert row(journal).state == "broken off"
    assert "cut off after 5 bytes" in row(journal).problem
    with held(journal):
        assert (row(journal).state, row(journal).problem) == ("running", "")


def test_a_run_that_was_killed_and_resumed_says_so(journal: Path, whole: bytes) -> None:
    entries = [json.loads(line) for line in lines_of(part(whole, "ask", 5))]
    journal.write_bytes(forged([*entries, entries[0] | {"kind": "resumed", "synced_s": None}]))
    with held(journal):
        shown = row(journal)
    assert (shown.faults, shown.sync) == (1, None)
    assert shown.last_fault is not None
    assert "broken off" in shown.last_fault.what


def test_how_long_still_counts_from_the_plan_and_stops_in_a_pause(journal: Path, whole: bytes) -> None:
    def real(data: bytes) -> bytes:
        return forged([entry | {"clock": "real"} for entry in map(json.loads, lines_of(data))])

    def left_s(data: bytes) -> float:
        journal.write_bytes(data)
        with held(journal):
            found = row(journal).left_s
        assert found is not None
        return found

    early, late = (left_s(real(part(whole, "prepare", number))) for number in (2, 50))
    assert early > late > 0
    resting = [entry | {"utc": "2026-01-01T00:00:00Z"} for entry in raw_of(part(whole, "rest"))]
    journal.write_bytes(forged([entry | {"clock": "real"} for entry in resting]))
    watch = FolderWatch(results_of(journal))
    with held(journal):
        assert rows(watch)[0].doing == "a break"
    run = watch.runs[0]
    at = datetime(2026, 1, 1, tzinfo=UTC)
    long = resting[-1]["body"]["duration_s"]
    begun, ended, later = (run.row(at + timedelta(seconds=after)).left_s for after in (0.0, long, 10 * long))
    assert begun is not None
    assert ended == later == pytest.approx(begun - long)


def raw_of(data: bytes) -> list[dict[str, object]]:
    return [json.loads(line) for line in lines_of(data)]


def test_a_copied_folder_is_shown_like_any_other(journal: Path, whole: bytes, tmp_path: Path) -> None:
    journal.write_bytes(part(whole, "ask", 5))
    shutil.copytree(results_of(journal), tmp_path / "copy")
    with held(journal):
        (shown,) = rows(FolderWatch(tmp_path / "copy"))
        assert replace(row(journal), state="broken off", doing="", left_s=None) == shown
    assert shown.state == "broken off"


# a journal that grows


def test_records_are_read_once_each_as_they_come(journal: Path, whole: bytes) -> None:
    lines, tail, found = lines_of(whole)[:40], JournalTail(journal), []
    journal.write_bytes(b"")
    assert tail.look().records == ()
    for line in lines:
        half = len(line) // 2
        for piece in (line[:half], line[half:]):
            with journal.open("ab") as file:
                file.write(piece)
            found += [record.n for record in tail.look().records]
    assert found == list(range(40))


def test_a_journal_that_is_set_aside_gives_way_to_the_new_one(journal: Path, whole: bytes) -> None:
    journal.write_bytes(part(whole, "ask", 5))
    watch = FolderWatch(results_of(journal))
    assert [one.done for one in rows(watch)] == [4]
    journal.rename(journal.with_name("sub-P01_task-direction_journal.aside-1.jsonl"))
    journal.write_bytes(part(whole, "ask", 2))
    seen = watch.look()
    assert seen is not None
    assert ([one.done for one in seen.rows], seen.set_aside) == ([1], 1)


@pytest.mark.parametrize("kind", ["ask", "finished"])
def test_a_journal_that_is_deleted_is_said_to_be_gone_with_what_was_read_until_it_is_back(
    kind: str, journal: Path, whole: bytes
) -> None:
    data = whole if kind == "finished" else part(whole, "ask", 5)
    journal.write_bytes(data)
    watch = FolderWatch(results_of(journal))
    (before,) = rows(watch)
    shutil.rmtree(journal.parent)
    seen = watch.look()
    assert seen is not None
    (shown,) = seen.rows
    assert (shown.state, shown.name, shown.done, shown.problem) == ("gone", "P01", before.done, "")
    summary, cards, finished = page_parts(seen)
    assert ("1 gone" in summary, "Its journal is gone" in cards, "P01" in finished) == (True, True, False)
    for _ in range(3):
        watch.look()
    journal.parent.mkdir()
    journal.write_bytes(data)
    (back,) = rows(watch)
    assert back == before


def damaged(data: bytes, at: int) -> bytes:
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


def test_damage_while_it_is_watched_is_said_in_its_row_and_gone_with_it(journal: Path, whole: bytes) -> None:
    good = part(whole, "ask", 8)
    journal.write_bytes(good)
    watch = FolderWatch(results_of(journal))
    assert rows(watch)[0].state == "broken off"
    lines = lines_of(good)
    for broken, said in (
        (damaged(good, len(good) // 2), f"{journal}: line "),
        (b"".join(lines[:20]), f"has 20 whole records and had {len(lines)} while it was watched"),
        (forged([*raw_of(good)[:-1], raw_of(good)[-1] | {"monotonic_s": 0.5}]), "was rewritten while it was watched"),
        (b"\xff\x00" * 50 + b"\n", "line 1: "),
    ):
        journal.write_bytes(broken)
        os.utime(journal, ns=(0, len(broken)))  # another time, however coarse the disk's
        (shown,) = rows(watch)
        assert (shown.name, shown.state, said in shown.problem) == ("P01", "damaged", True), shown
        journal.write_bytes(good)
        os.utime(journal, ns=(0, 1))
        assert rows(watch)[0].state == "broken off"


def test_damage_that_leaves_size_and_time_is_found_by_the_check(journal: Path, whole: bytes) -> None:
    good = part(whole, "ask", 3)
    journal.write_bytes(good)
    os.utime(journal, ns=(0, 7))
    tail = JournalTail(journal)
    assert tail.look().records
    journal.write_bytes(damaged(good, len(good) // 2))
    os.utime(journal, ns=(0, 7))
    assert tail.look().records == ()
    tail.check()
    with pytest.raises(JournalError, match="line"):
        tail.look()


@pytest.mark.parametrize(
    "change",
    [
        {"body": {"kind": "ask"}},
        {"body": 7},
        {"utc": "yesterday"},
        {"monotonic_s": 1e308},
        {"kind": "outcome", "body": {"kind": "closed"}},
        {"kind": "remark", "body": {"kind": "halted", "by": "nobody"}},
    ],
)
def test_a_forged_record_is_no_end_of_the_page(change: dict[str, object], journal: Path, whole: bytes) -> None:
    entries = raw_of(part(whole, "ask", 5))
    journal.write_bytes(forged([*entries[:-1], entries[-1] | change | {"clock": "real"}]))
    with held(journal):
        seen = FolderWatch(results_of(journal)).look()
    assert seen is not None
    assert "<article" in page_parts(seen)[1]


def test_a_journal_under_another_name_and_what_is_no_journal_are_said(journal: Path, whole: bytes) -> None:
    journal.with_name("sub-P09_task-direction_journal.jsonl").write_bytes(whole)
    journal.write_bytes(b"no journal <script>\n")
    os.mkfifo(journal.with_name("sub-P02_task-direction_journal.jsonl"))  # nothing is ever read from it
    seen = FolderWatch(results_of(journal)).look()
    assert seen is not None
    assert [one.state for one in seen.rows] == ["damaged", "damaged"]
    assert "was it renamed?" in seen.rows[1].problem
    (problem,) = seen.problems
    assert "sub-P02_task-direction_journal.jsonl: is no file, though it is named like a journal" in problem
    assert "<script>" not in page_parts(seen)[1]


def test_a_folder_that_goes_away_is_said_and_comes_back(journal: Path, whole: bytes) -> None:
    journal.write_bytes(whole)
    watch = FolderWatch(results_of(journal))
    assert len(rows(watch)) == 1
    away = results_of(journal).rename(results_of(journal).with_name("away"))
    seen = watch.look()
    assert seen is not None
    assert "cannot be read" in " ".join(seen.problems)
    assert [one.state for one in seen.rows] == ["gone"]
    away.rename(results_of(journal))
    seen = watch.look()
    assert seen is not None
    assert (seen.problems, [one.state for one in seen.rows]) == ((), ["finished"])


def loop(path: Path) -> None:
    path.symlink_to(path.name)


def device_without_end(path: Path) -> None:
    path.symlink_to("/dev/zero")


def no_file_at_all(path: Path) -> None:
    path.symlink_to("nothing")


@pytest.mark.parametrize("bad", [loop, os.mkfifo, device_without_end, no_file_at_all])
@pytest.mark.parametrize("name", ["sub-P00", f"sub-P01/{NAME.replace('direction', 'other')}"])
def test_one_bad_entry_is_named_and_hides_no_other_run(
    bad: Callable[[Path], None], name: str, journal: Path, whole: bytes
) -> None:
    watch = FolderWatch(results_of(journal))
    bad(results_of(journal) / name)
    seen = watch.look()
    assert seen is not None
    if "/" in name or bad in (loop, no_file_at_all):
        assert [results_of(journal) / name] == [Path(problem.partition(": ")[0]) for problem in seen.problems]
        assert "no run is to be seen" in page_parts(seen)[0]
    journal.write_bytes(whole)
    assert [(one.name, one.state) for one in rows(watch)] == [("P01", "finished")]


@pytest.mark.parametrize("bad", [loop, os.mkfifo, device_without_end, no_file_at_all])
def test_a_journal_in_whose_place_there_is_none_any_more_is_never_read(
    bad: Callable[[Path], None], journal: Path, whole: bytes
) -> None:
    journal.write_bytes(part(whole, "ask", 5))
    watch = FolderWatch(results_of(journal))
    before = rows(watch)
    journal.unlink()
    bad(journal)
    (shown,) = rows(watch)
    assert (shown.name, shown.state, shown.done) == ("P01", "damaged", before[0].done)
    assert watch.look() is None  # said once, not at every look


def test_what_is_longer_than_any_record_is_read_no_further(journal: Path, whole: bytes) -> None:
    journal.write_bytes(part(whole, "ask", 5))
    watch = FolderWatch(results_of(journal))
    rows(watch)
    os.truncate(journal, 1 << 40)  # a hole: a terabyte that takes no place
    assert "is longer than any record" in rows(watch)[0].problem


def test_a_journal_is_read_a_look_at_a_time(journal: Path, whole: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tail, "LOOK_BYTES", max(map(len, lines_of(whole))))
    journal.write_bytes(whole)
    watch, states = FolderWatch(results_of(journal)), list[str]()
    for _ in range(len(lines_of(whole))):
        watch.look()
        states += [run.row(datetime.now(UTC)).state for run in watch.runs]
        if states[-1] == "finished":
            break
    assert states.count("finished") == 1
    assert len(states) > 2
    assert "damaged" not in states


def test_a_reader_that_breaks_off_ends_the_page_with_one_message(journal: Path, whole: bytes) -> None:
    def made(seen: Watched) -> tuple[str, ...]:
        if seen.rows:
            raise MemoryError("no memory for a page")
        return page_parts(seen)

    reader = Reader(FolderWatch(results_of(journal)), made)
    with WatchServer(reader, 0, "results") as server:
        reader.start()
        journal.write_bytes(whole)
        try:
            with pytest.raises(RecoilError, match="the looking broke off") as caught:
                server.serve_forever()
        finally:
            reader.stop()
    assert "start `recoil watch` anew" in str(caught.value)


def test_nothing_in_the_folder_is_touched_and_a_run_finds_its_journal_free(journal: Path, whole: bytes) -> None:
    journal.write_bytes(part(whole, "ask", 5))
    before = [(path, path.stat().st_mtime_ns, path.stat().st_ctime_ns) for path in results_of(journal).rglob("*")]
    watch = FolderWatch(results_of(journal))
    for _ in range(20):
        watch.look()
        with held(journal):
            watch.look()
    assert before == [
        (path, path.stat().st_mtime_ns, path.stat().st_ctime_ns) for path in results_of(journal).rglob("*")
    ]


def test_a_study_means_its_results_and_no_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study.toml").touch()
    assert watched_folder(tmp_path) == tmp_path / "results"
    with pytest.raises(RecoilError, match="no such folder"):
        watched_folder(tmp_path / "nowhere")


# the page


@pytest.fixture
def server(journal: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[WatchServer]:
    monkeypatch.setattr(serving, "REFUSAL_S", 0.01)
    reader = Reader(FolderWatch(results_of(journal)), page_parts)
    with WatchServer(reader, 0, "results") as running:
        reader.start()
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        yield running
        reader.stop()
        running.shutdown()
        thread.join()


def asked(server: WatchServer, path: str, method: str = "GET", **headers: str) -> tuple[int, str, dict[str, str]]:
    connection = http.client.HTTPConnection(serving.HOST, server.page.port, timeout=PATIENCE_S)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, body, dict(answer.getheaders())


def test_the_page_is_whole_without_a_script_and_holds_nothing_from_elsewhere(server: WatchServer) -> None:
    status, body, headers = asked(server, f"/{server.token}/")
    assert status == 200
    assert "no run has begun here" in body
    assert 'http-equiv="refresh"' in body
    assert not re.search(r"(src|href)=\"(https?:)?//", body)
    assert headers["Content-Security-Policy"].startswith("default-src 'none'")
    assert not [name for name in headers if name.startswith("Access-Control")]
    for name in re.findall(r'(?:src|href)="(watch\.\w+)"', body):
        assert asked(server, f"/{server.token}/{name}")[0] == 200
    status, body, headers = asked(server, f"/{server.token}/", "HEAD")
    assert (status, body) == (200, "")
    assert int(headers["Content-Length"]) > 500
    assert asked(server, f"/{server.token}")[2]["Location"] == f"/{server.token}/"


class Outline(HTMLParser):
    """Which elements stand directly in which, and whether every one that is opened is closed where it should be."""

    EMPTY = ("meta", "link")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open, self.within = ["page"], set[tuple[str, str]]()
        self.feed(page)
        assert self.open == ["page"]

    def handle_starttag(self, tag: str, _: object) -> None:
        self.within.add((self.open[-1], tag))
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def inside(self, *tags: str) -> set[str]:
        return {inner for outer, inner in self.within if outer in tags}


def test_a_file_whose_name_is_no_text_is_no_end_of_the_page() -> None:
    """A name in another encoding is read with letters that no page can have."""
    parts = ("\udcff",) * len(PAGE_PARTS)
    assert whole_page(parts, "\udcff").decode().count("?") >= len(PAGE_PARTS)


def test_lists_hold_items_and_lines_of_text_hold_no_blocks(journal: Path, whole: bytes) -> None:
    for data in (None, whole, part(whole, "ask", 5)):
        if data is not None:
            journal.write_bytes(data)
        seen = FolderWatch(results_of(journal)).look()
        assert seen is not None
        outline = Outline(whole_page(page_parts(seen), "results").decode())
        assert outline.inside("ul") <= {"li"}
        assert outline.inside("dl") <= {"dt", "dd"}
        assert outline.inside("p", "h1", "h2", "h3", "li", "dt", "dd") <= {"span", "small", "b", "code"}


def test_who_is_not_meant_is_refused(server: WatchServer) -> None:
    there = f"/{server.token}/"
    assert asked(server, "/")[0] == 403
    assert asked(server, f"/{server.token[:-1]}{'y' if server.token.endswith('x') else 'x'}/")[0] == 403
    assert asked(server, f"/x{there}")[0] == 403
    assert asked(server, there + "../../etc/passwd")[0] == 404
    assert asked(server, there, Host=f"rebound.example:{server.page.port}")[0] == 403
    assert asked(server, there, Host="localhost:9000")[0] == 200  # by a tunnel
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert asked(server, there, method)[0] == 405


def test_of_many_wrong_tokens_at_a_time_some_get_no_answer(
    server: WatchServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    for _ in range(serving.REFUSED_AT_ONCE):
        server.refusals.acquire()
    with pytest.raises(http.client.RemoteDisconnected):
        asked(server, "/guess/")
    assert asked(server, f"/{server.token}/")[0] == 200


def test_a_viewer_gets_what_is_new_without_asking_again(server: WatchServer, journal: Path, whole: bytes) -> None:
    connection = http.client.HTTPConnection(serving.HOST, server.page.port, timeout=PATIENCE_S)
    connection.request("GET", f"/{server.token}/events")
    stream, seen = connection.getresponse(), dict.fromkeys(PAGE_PARTS, "")

    def read() -> str:
        line = stream.readline().decode()
        if line.startswith("event: "):
            seen[line.split()[1]] = stream.readline().decode()
        return seen["open"]

    wait_for(lambda: "No run is open" in read())
    journal.write_bytes(part(whole, "ask", 2))
    wait_for(lambda: "1 of 60 trials done" in read())
    with journal.open("ab") as file:
        file.write(part(whole, "ask", 4)[journal.stat().st_size :])
    wait_for(lambda: "3 of 60 trials done" in read())
    connection.close()


def test_viewers_who_are_one_too_many_are_turned_away(journal: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serving, "VIEWERS", 1)
    reader = Reader(FolderWatch(results_of(journal)), page_parts)
    with WatchServer(reader, 0, "results") as running:
        reader.start()
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        first = http.client.HTTPConnection(serving.HOST, running.page.port, timeout=PATIENCE_S)
        first.request("GET", f"/{running.token}/events")
        first.getresponse().readline()
        with pytest.raises((http.client.RemoteDisconnected, ConnectionResetError)):
            asked(running, f"/{running.token}/")
        reader.stop()
        running.shutdown()
        thread.join()
        first.close()


# the command


def test_a_port_that_is_taken_is_refused_in_one_message(server: WatchServer, journal: Path, recoil: Recoil) -> None:
    done = recoil("watch", results_of(journal), "--port", server.page.port)
    refused(done, f"--port {server.page.port}: cannot be used", "perhaps another `recoil watch` is there")
    refused(recoil("watch", "nowhere"), "nowhere: no such folder")
