"""Work in copies of this process: what it writes is there at the end, what goes wrong in it is told."""

import os
import select
import signal
import time
from pathlib import Path

import pytest

from analysis.report import copies as module
from analysis.report.copies import cores, in_copy, process_copies
from analysis.report.terminal import Tell
from device.messages import RecoilError
from tests.waiting import PATIENCE_S, wait_for

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no copies of a process on this system")


@pytest.fixture(autouse=True)
def another_core(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a machine with two cores, however many there are."""
    monkeypatch.setattr(module, "cores", lambda: 2)


def test_what_a_copy_writes_is_there_at_the_end(tmp_path: Path) -> None:
    """The second finds the one copy at work, or done: either way every file is there, each from one process."""
    with process_copies():
        for name in "abc":
            in_copy(lambda _, name=name: (tmp_path / name).write_text(str(os.getpid())))
    writers = [(tmp_path / name).read_text() for name in "abc"]
    assert writers[0] != str(os.getpid())
    assert len(writers) == 3


def test_what_a_copy_changes_in_memory_is_lost_with_it() -> None:
    seen: list[int] = []
    with process_copies():
        in_copy(lambda _: seen.append(1))
    assert seen == []


def test_where_none_are_allowed_the_work_is_done_at_once() -> None:
    seen: list[int] = []
    in_copy(lambda _: seen.append(os.getpid()))
    assert seen == [os.getpid()]


def test_a_copy_makes_no_copies(tmp_path: Path) -> None:
    def twice(_: Tell) -> None:
        in_copy(lambda _: (tmp_path / "inner").write_text(str(os.getpid())))
        (tmp_path / "outer").write_text(str(os.getpid()))

    with process_copies():
        in_copy(twice)
    assert (tmp_path / "inner").read_text() == (tmp_path / "outer").read_text()


def test_an_error_of_a_copy_is_raised_with_its_file(tmp_path: Path) -> None:
    missing = tmp_path / "nowhere" / "figure.svg"
    with pytest.raises(FileNotFoundError) as found, process_copies():
        in_copy(lambda _: missing.write_text(""))
    assert found.value.filename == str(missing)


def test_a_copy_that_is_killed_is_told() -> None:
    with pytest.raises(RecoilError, match="was killed"), process_copies():
        in_copy(lambda _: os.kill(os.getpid(), signal.SIGKILL))


def test_an_error_that_cannot_be_sent_is_told_in_its_words() -> None:
    class OwnError(Exception):
        pass

    def fail(_: Tell) -> None:
        raise OwnError("the reason")

    with pytest.raises(RecoilError, match="the reason"), process_copies():
        in_copy(fail)


def test_who_waits_hears_of_each_part() -> None:
    def three_parts(tell: Tell) -> None:
        for name in "abc":
            tell(name)

    heard: list[str] = []
    with process_copies():
        in_copy(three_parts, heard.append)
    assert heard == ["a", "b", "c"]


def test_who_is_interrupted_leaves_no_copy(tmp_path: Path) -> None:
    def for_ever(_: Tell) -> None:
        (tmp_path / "pid").write_text(str(os.getpid()))
        time.sleep(600)

    def interrupted() -> None:
        in_copy(for_ever)
        wait_for(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text(), "the copy does not begin")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), process_copies():
        interrupted()
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_a_copy_ends_with_the_process_that_began_it(tmp_path: Path) -> None:
    """Else it would go on with what somebody begins anew."""

    def work(_: Tell) -> None:
        (tmp_path / "begun").write_text(str(os.getpid()))
        time.sleep(PATIENCE_S)

    first = os.fork()
    if first == 0:
        with process_copies():
            in_copy(work)
    wait_for(lambda: (tmp_path / "begun").exists() and (tmp_path / "begun").read_text())
    copy = os.pidfd_open(int((tmp_path / "begun").read_text()))
    os.kill(first, signal.SIGKILL)
    os.waitpid(first, 0)
    assert select.select([copy], [], [], PATIENCE_S / 2)[0]
    os.close(copy)


def test_cores_are_those_that_this_process_may_use() -> None:
    assert 1 <= cores() <= (os.cpu_count() or 1)
