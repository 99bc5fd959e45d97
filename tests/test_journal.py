import json
import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from experiments.clock import VirtualClock
from experiments.config.setup import sha256
from experiments.record import storage
from experiments.record.journal import ENDING, Journal, JournalError, JournalGone, head, read_journal

PARTS = {"plan": {"trials": [1, 2]}, "setup": {"title": "é – 20 °C"}}
HEAD = PARTS | {f"{name}_sha256": sha256(part) for name, part in PARTS.items()}
RECORDS = 8


def written(path: Path) -> Path:
    """A journal of a head and steps with outcomes, half a second each."""
    clock = VirtualClock()
    with Journal.create(path, clock) as journal:
        journal.append("run", **HEAD)
        for number in range(1, RECORDS):
            clock.sleep(0.5)
            journal.append("step" if number % 2 else "outcome", body={"number": number, "text": "“next”\n"})
    return path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return written(tmp_path / "a_journal.jsonl")


def lines_of(path: Path) -> list[bytes]:
    return path.read_bytes().splitlines(keepends=True)


# writing and reading


def test_every_record_has_number_kind_and_times(path: Path) -> None:
    records = read_journal(path).records
    assert [entry.n for entry in records] == list(range(RECORDS))
    assert [entry.kind for entry in records] == ["run", *["step", "outcome"] * 3, "step"]
    assert [entry.monotonic_s for entry in records] == [0.5 * number for number in range(RECORDS)]
    assert all(entry.utc.endswith("Z") for entry in records)
    assert records[3].body == {"number": 3, "text": "“next”\n"}


def test_the_first_record_is_the_head(path: Path) -> None:
    contents = read_journal(path)
    parts = {"plan": contents.head.plan_json, "setup": contents.head.setup_json}
    hashes = {"plan_sha256": contents.head.plan_sha256, "setup_sha256": contents.head.setup_sha256}
    assert parts | hashes == HEAD
    assert head(path) == contents.head == contents.records[0]


def test_every_record_tells_when_the_one_before_it_was_on_the_disk(path: Path) -> None:
    first, *others = read_journal(path).records
    assert first.synced_s is None
    # on the virtual clock writing takes no time: synced at the time of the record itself, half a second ago
    assert [entry.synced_s for entry in others] == [entry.monotonic_s - 0.5 for entry in others]


def test_what_is_synced_at_the_end_says_of_no_record_that_it_was(tmp_path: Path) -> None:
    with Journal.create(tmp_path / "j", VirtualClock(), each=False) as journal:
        journal.append("run", **HEAD)
        journal.append("step", body=1)
    first, second = read_journal(tmp_path / "j").records
    assert (first.synced_s, second.synced_s) == (None, None)


def test_a_disk_that_fails_at_the_end_is_told_with_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_: int) -> None:
        raise OSError(5, "Input/output error")

    journal = Journal.create(tmp_path / "j", VirtualClock(), each=False)
    journal.append("run", **HEAD)
    monkeypatch.setattr(storage, "sync", fails)
    with pytest.raises(OSError, match="Input/output") as found:
        journal.close()
    assert found.value.filename == str(tmp_path / "j")


def test_a_record_is_on_the_disk_when_append_returns(tmp_path: Path) -> None:
    with Journal.create(tmp_path / "j", VirtualClock()) as journal:
        journal.append("run", **HEAD)
        for count in range(2, 5):
            journal.append("step", body=count)
            assert len(read_journal(tmp_path / "j").records) == count


def test_records_that_are_written_together_are_there_together_however_little_room_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    together = [{"body": "one"}, {"body": "two"}]

    def bodies(room: int) -> list[object]:
        def short(descriptor: int, data: bytes) -> None:
            os.write(descriptor, data[:room])
            if len(data) > room:
                raise OSError(28, "No space left on device")

        with Journal.create(tmp_path / f"{room}", VirtualClock()) as journal:
            journal.append("run", **HEAD)
            with monkeypatch.context() as disk:
                disk.setattr(storage, "write_all", short)
                refused = journal.submit_together("remark", together).exception()
            journal.append("step", body=room)
        found = [record.body for record in read_journal(tmp_path / f"{room}").records[1:]]
        assert (refused is None) == ("two" in found)
        return found

    assert {tuple(bodies(room)[:-1]) for room in range(0, 500, 20)} == {(), ("one", "two")}


def test_what_is_read_back_is_all_that_was_written_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "j"
    with Journal.create(path, VirtualClock()) as journal:
        journal.append("run", **HEAD)
        journal.append("step", body=1)
        assert journal.read_back() == read_journal(path)
        journal.append("step", body=2)
        os.truncate(path, len(b"".join(path.read_bytes().splitlines(keepends=True)[:2])))  # whole records, one fewer
        with pytest.raises(JournalError, match=r"holds 2 records, and not the 3 that were written"):
            journal.read_back()
    contents = read_journal(path)
    with Journal.reopen(contents, VirtualClock()) as journal:
        assert journal.read_back() == contents


def test_one_record_is_one_line_of_json(path: Path) -> None:
    lines = lines_of(path)
    assert len(lines) == RECORDS
    assert all(line.endswith(b"\n") and isinstance(json.loads(line), dict) for line in lines)


def test_a_run_is_finished_once_its_last_record_says_so(path: Path) -> None:
    contents = read_journal(path)
    assert not contents.finished
    with Journal.reopen(contents, VirtualClock()) as journal:
        journal.append("finished", table_sha256="0")
    assert read_journal(path).finished


def test_an_existing_file_is_never_written_over(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(JournalError, match=r"cannot be created \(File exists\)"):
        Journal.create(path, VirtualClock())
    assert path.read_bytes() == before


def test_a_journal_where_there_is_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(JournalError, match=r"cannot be created .*nothing was recorded"):
        Journal.create(tmp_path / "none" / "j", VirtualClock())


def test_a_journal_that_is_not_there_cannot_be_read(tmp_path: Path) -> None:
    for reader in (read_journal, head):
        with pytest.raises(JournalError, match=r"cannot be read \(No such file"):
            reader(tmp_path / "none")


def test_what_a_terminal_may_take_for_text_is_written_or_refused_as_a_journal_error(tmp_path: Path) -> None:
    # a byte that is not UTF-8 comes from a terminal as a lone surrogate (surrogateescape, the C locale)
    with Journal.create(tmp_path / "j", VirtualClock()) as journal:
        journal.append("run", **HEAD)
        try:
            journal.append("outcome", body={"comment": "sch\udcf6n"})
        except JournalError:
            assert len(read_journal(tmp_path / "j").records) == 1
        else:
            assert len(read_journal(tmp_path / "j").records) == 2


# a full disk


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_is_told_with_what_is_safe(path: Path) -> None:
    descriptor = os.open("/dev/full", os.O_RDWR | os.O_APPEND)
    whole = read_journal(path)
    before = replace(whole, path=Path("/dev/full"), records=whole.records[:7], whole_bytes=0)
    journal = Journal(Path("/dev/full"), descriptor, VirtualClock(), before)
    said = r"record 7 cannot be written \(No space left .*record 6 is safe.*; free some .*, then resume the run$"
    with journal, pytest.raises(JournalError, match=said):
        journal.append("step", body={})


@pytest.mark.slow
def test_a_record_that_was_written_in_part_is_taken_back(path: Path) -> None:
    # a limit on the size of files is the only full disk that a test can make; it binds the process it is set in
    size = path.stat().st_size
    program = f"""
import resource, signal, sys
from pathlib import Path
from experiments.clock import VirtualClock
from experiments.record.journal import Journal, JournalError, read_journal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
contents = read_journal(Path({str(path)!r}))
with Journal.reopen(contents, VirtualClock()) as journal:
    resource.setrlimit(resource.RLIMIT_FSIZE, ({size} + 40, {size} + 40))
    try:
        journal.append("outcome", body="x" * 200)
    except JournalError as error:
        sys.exit(str(error))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert f"record {RECORDS} cannot be written (File too large); everything up to record {RECORDS - 1}" in done.stderr
    assert path.stat().st_size == size
    assert len(read_journal(path).records) == RECORDS


# cut off


@pytest.mark.slow
def test_a_journal_cut_at_any_byte_is_read_to_its_last_whole_record(path: Path) -> None:
    data, cut = path.read_bytes(), path.with_name(f"cut{ENDING}")
    ends = [n + 1 for n, byte in enumerate(data) if byte == 0x0A]
    for length in range(len(data) + 1):
        cut.write_bytes(data[:length])
        whole = sum(end <= length for end in ends)
        if not whole:
            assert head(cut) is None
            with pytest.raises(JournalError, match=r"line 1: no whole record, so nothing was acknowledged"):
                read_journal(cut)
            continue
        contents = read_journal(cut)
        assert len(contents.records) == whole
        assert contents.whole_bytes == ends[whole - 1]
        assert contents.cut_bytes == length - ends[whole - 1]
        assert head(cut) == contents.head
        if contents.cut_bytes == 0:
            assert contents.cut_message is None
        else:
            assert contents.cut_message == (
                f"{cut}: line {whole + 1} is cut off after {contents.cut_bytes} bytes and was never acknowledged; "
                f"everything up to record {whole - 1} is read"
            )


def test_rubbish_behind_the_last_line_end_is_taken_for_a_cut(path: Path) -> None:
    with path.open("ab") as file:
        file.write(b"\0" * 4096)  # what some file systems leave behind after a power cut
    contents = read_journal(path)
    assert (len(contents.records), contents.cut_bytes) == (RECORDS, 4096)


@pytest.mark.parametrize("cut_bytes", [0, 1, 30])
def test_reopening_takes_away_what_was_cut_off_and_goes_on_numbering(path: Path, cut_bytes: int) -> None:
    lines = lines_of(path)
    path.write_bytes(b"".join(lines[:5]) + lines[5][:cut_bytes])
    with Journal.reopen(read_journal(path), VirtualClock()) as journal:
        journal.append("resumed", cut_bytes=cut_bytes)
        journal.append("step", body=1)
    contents = read_journal(path)
    assert [entry.n for entry in contents.records] == list(range(7))
    assert [entry.kind for entry in contents.records[5:]] == ["resumed", "step"]
    assert contents.records[5].synced_s is None
    assert lines_of(path)[:5] == lines[:5]


# changed


@pytest.mark.parametrize("number", range(1, RECORDS - 1))
def test_a_record_that_was_removed_is_noticed_at_its_line(path: Path, number: int) -> None:
    lines = lines_of(path)
    path.write_bytes(b"".join(lines[:number] + lines[number + 1 :]))
    with pytest.raises(
        JournalError, match=rf"a_journal.jsonl: line {number + 1}: record number is {number + 1}, must be {number};"
    ):
        read_journal(path)


@pytest.mark.parametrize("number", range(1, RECORDS))
def test_a_record_that_was_doubled_is_noticed_at_its_line(path: Path, number: int) -> None:
    lines = lines_of(path)
    path.write_bytes(b"".join([*lines[: number + 1], lines[number], *lines[number + 1 :]]))
    with pytest.raises(JournalError, match=rf"line {number + 2}: record number is {number}, must be {number + 1}"):
        read_journal(path)


def test_records_that_were_exchanged_are_noticed(path: Path) -> None:
    lines = lines_of(path)
    path.write_bytes(b"".join([*lines[:3], lines[4], lines[3], *lines[5:]]))
    with pytest.raises(JournalError, match="line 4: record number is 4, must be 3"):
        read_journal(path)


def test_a_missing_head_is_noticed(path: Path) -> None:
    path.write_bytes(b"".join(lines_of(path)[1:]))
    with pytest.raises(JournalError, match="line 1: record number is 1, must be 0"):
        read_journal(path)


@pytest.mark.parametrize(
    ("line", "rule"),
    [
        (b"", "not a JSON record"),
        (b"{", "not a JSON record"),
        (b"\xff\xfe", "not a JSON record (byte 0 is not UTF-8)"),
        (b"\0\0\0\0", "not a JSON record"),
        (b"null", "not a JSON object"),
        (b"[3]", "not a JSON object"),
        (b"{}", "kind must be one of run, step, outcome"),
        (b'{"n":3,"kind":"stap"}', "kind must be one of"),
        (b'{"n":3,"kind":["step"]}', "kind must be one of"),
        (b'{"n":3,"kind":{}}', "kind must be one of"),
        (b'{"kind":"step"}', "record number is None, must be 3"),
        (b'{"n":"3","kind":"step"}', "record number is '3', must be 3"),
        (b'{"n":3,"kind":"step","x":NaN}', "not a JSON record (NaN is no number of JSON)"),
        (b'{"n":3,"kind":"step","x":-1e999}', "not a JSON record (-1e999 is no number of JSON)"),
        (b"[" * 100_000, "not a JSON record (it nests too deep)"),
        (b'{"n":' + b"9" * 5000 + b',"kind":"step"}', "not a JSON record (a number has thousands of digits)"),
    ],
    ids=lambda value: str(value)[:24],
)
def test_a_record_that_was_changed_is_refused_with_its_line(path: Path, line: bytes, rule: str) -> None:
    lines = lines_of(path)
    path.write_bytes(b"".join([*lines[:3], line, b"\n", *lines[4:]]))
    with pytest.raises(JournalError, match=r"a_journal\.jsonl: line 4: ") as refused:
        read_journal(path)
    assert rule in str(refused.value)


@pytest.mark.parametrize(
    "record",
    [
        {"n": 0, "kind": "step", **HEAD},
        {"n": 0, "kind": "run"},
        {"n": 0, "kind": "run", "plan": {}, "setup": {}},
        {"n": 1, "kind": "run", **HEAD},
    ],
)
def test_a_head_that_is_none_is_refused(tmp_path: Path, record: dict[str, Any]) -> None:
    (tmp_path / "j").write_text(json.dumps(record) + "\n")
    for reader in (read_journal, head):
        with pytest.raises(JournalError, match="j: line 1: "):
            reader(tmp_path / "j")


def test_a_head_with_a_number_beyond_all_numbers_is_refused(tmp_path: Path) -> None:
    (tmp_path / "j").write_text('{"n":0,"kind":"run","plan":{"x":1e999},"setup":{},"link":""}\n')
    with pytest.raises(JournalError, match=r"j: line 1: not a JSON record \(1e999 is no number of JSON\)"):
        head(tmp_path / "j")


def test_line_ends_of_another_system_do_no_harm(path: Path) -> None:
    before = read_journal(path).records
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_journal(path).records == before


# held by one


@pytest.mark.slow
def test_a_second_holder_is_refused_in_the_same_process(path: Path) -> None:
    with Journal.reopen(read_journal(path), VirtualClock()) as journal:
        with pytest.raises(JournalError, match="another run holds this journal; close that one first"):
            Journal.reopen(read_journal(path), VirtualClock())
        journal.append("step", body=0)
    with Journal.reopen(read_journal(path), VirtualClock()):
        pass


@pytest.mark.slow
def test_a_second_holder_is_refused_in_another_process_and_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "j"
    program = f"""
import sys
from pathlib import Path
from experiments.clock import VirtualClock
from experiments.record.journal import Journal, JournalError, read_journal
try:
    Journal.reopen(read_journal(Path({str(path)!r})), VirtualClock()).append("step", body="other")
except JournalError as error:
    sys.exit(str(error))
"""

    def other() -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    with Journal.create(path, VirtualClock()) as journal:
        journal.append("run", **HEAD)
        before = path.read_bytes()
        assert "another run holds this journal" in other().stderr
        assert path.read_bytes() == before
    assert other().returncode == 0
    assert len(read_journal(path).records) == 2


def test_records_that_another_run_wrote_since_the_reading_are_not_cut_away(path: Path) -> None:
    early = read_journal(path)
    with Journal.reopen(read_journal(path), VirtualClock()) as other:
        other.append("outcome", body="acknowledged")
    with suppress(JournalError):  # refusing is as good as going on behind the other's last record
        Journal.reopen(early, VirtualClock()).close()
    assert len(read_journal(path).records) == RECORDS + 1


def test_a_journal_that_vanished_since_the_reading_is_a_journal_error(path: Path) -> None:
    contents = read_journal(path)
    path.unlink()
    with pytest.raises(JournalError):
        Journal.reopen(contents, VirtualClock())


# files of their owner


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.skipif(sys.platform == "win32", reason="no file modes")
@pytest.mark.parametrize("umask", [0o000, 0o022, 0o077])
def test_files_and_folders_are_their_owners_alone_whatever_the_umask(tmp_path: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        folder = tmp_path / "results" / "sub-P01"
        storage.make_folder(folder)
        written(folder / "j")
        storage.write_whole(folder / "table.csv", b"1")
    finally:
        os.umask(before)
    assert [mode(folder.parent), mode(folder)] == [0o700, 0o700]
    assert [mode(folder / "j"), mode(folder / "table.csv")] == [0o600, 0o600]


def test_making_a_folder_again_changes_nothing(tmp_path: Path) -> None:
    storage.make_folder(tmp_path / "a" / "b")
    (tmp_path / "a" / "b" / "file").touch()
    storage.make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b" / "file").exists()


def test_a_file_is_replaced_as_a_whole_and_leaves_no_part_behind(tmp_path: Path) -> None:
    for data in (b"old", b"new" * 1000, b""):
        storage.write_whole(tmp_path / "table.csv", data)
        assert (tmp_path / "table.csv").read_bytes() == data
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_a_file_that_cannot_be_replaced_leaves_no_part_behind(tmp_path: Path) -> None:
    (tmp_path / "table.csv").mkdir()
    (tmp_path / "table.csv" / "inside").touch()
    with pytest.raises(OSError, match=r"table\.csv"):
        storage.write_whole(tmp_path / "table.csv", b"data")
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_a_part_left_by_a_crash_is_taken_away_and_one_at_work_is_not(tmp_path: Path) -> None:
    left, at_work = tmp_path / ".table.csv.1-2.part", tmp_path / ".table.csv.3-4.part"
    for part in (left, at_work):
        part.write_bytes(b"half")
    os.utime(left, (0, 0))
    storage.write_whole(tmp_path / "table.csv", b"whole")
    assert (tmp_path / "table.csv").read_bytes() == b"whole"
    assert (left.exists(), at_work.exists()) == (False, True)


def test_who_writes_one_file_at_once_leaves_it_whole(tmp_path: Path) -> None:
    path, texts = tmp_path / "columns.md", [letter * 100_000 for letter in (b"a", b"b", b"c", b"d")]

    def write(text: bytes) -> None:
        for _ in range(50):
            storage.write_whole(path, text)
            assert path.read_bytes() in texts

    with ThreadPoolExecutor(4) as pool:
        for done in [pool.submit(write, text) for text in texts]:
            done.result()
    assert [file.name for file in tmp_path.iterdir()] == ["columns.md"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_that_is_called_a_journal_keeps_nobody_waiting(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / f"sub-P01_task-direction{ENDING}")
    with pytest.raises(JournalError, match=r"cannot be read \(it is a pipe or a device, not a file\)"):
        read_journal(pipe)
    with pytest.raises(OSError, match="it is a pipe or a device, not a file"):
        storage.is_held(pipe)


@contextmanager
def closed(folder: Path) -> Iterator[None]:
    """A folder that may not be looked into. Whoever may look into any is somebody else meanwhile."""
    folder.chmod(0)
    if is_root := os.geteuid() == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        if is_root:
            os.seteuid(0)
        folder.chmod(0o700)


@pytest.mark.skipif(not hasattr(os, "seteuid"), reason="folders are not closed by their mode on this system")
def test_a_journal_whose_folder_was_closed_is_not_called_deleted_and_not_written_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (home := tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(home))
    (folder := tmp_path / "results").mkdir()
    with Journal.create(folder / f"sub-P01_task-direction{ENDING}", VirtualClock()) as journal:
        journal.append("run", **HEAD)
        said = r"cannot be looked at any more \(Permission denied\)\. .*, then resume the run"
        with closed(folder), pytest.raises(JournalGone, match=said):
            journal.append("step", body={"number": 1})
    assert len(read_journal(journal.path).records) == 2  # also that one, though it was not acknowledged
    assert list(home.iterdir()) == []
