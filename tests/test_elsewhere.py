"""What becomes of us on Windows and on a Mac, as far as it can be seen on Linux: with what they lack taken away."""

from __future__ import annotations

import errno
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import pytest
import serial

from analysis.logs import files
from analysis.predict import jobs
from analysis.report import placing
from device.sensor.streams import CsvSensor, SensorError
from device.serial_gun.lines import SerialPort
from device.words import LinkError
from experiments.record import storage
from experiments.screens.participant.stage import writable_home
from experiments.watch.folder import journals_in
from tests.elsewhere import byte_locks

ROOT = Path(__file__).parents[1]


def elsewhere(system: str, *words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A command as another system would carry it out, which need not list the fonts anew."""
    own = {"PATH": "", "PYTHONPATH": str(ROOT), "HOME": str(folder), "PYTHONIOENCODING": "cp1252"}
    return subprocess.run(
        [sys.executable, "-m", "tests.elsewhere", system, *words],
        cwd=folder,
        env=own | {"MPLCONFIGDIR": matplotlib.get_cachedir()},
        capture_output=True,
        encoding="cp1252",
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_every_module_can_be_imported(system: str, tmp_path: Path) -> None:
    done = elsewhere(system, "import", folder=tmp_path)
    told = re.fullmatch(r"(\d+) modules\n", done.stdout)
    assert told, done.stdout
    assert int(told[1]) > 300  # it was not a walk through nothing
    assert (done.returncode, done.stderr) == (0, "")


# the clock


def test_windows_has_the_fine_clock() -> None:
    look = "import sys, time; sys.platform = 'win32'; from device import machine_clock as ours; "
    look += "sys.exit(ours.machine_s is not time.perf_counter or ours.MACHINE_CLOCK != 'perf_counter')"
    assert subprocess.run([sys.executable, "-c", look], cwd=ROOT, check=False).returncode == 0


def test_nobody_tells_the_time_by_another_clock() -> None:
    files = [path for top in ("device", "experiments", "analysis", "recoil") for path in (ROOT / top).rglob("*.py")]
    strangers = [path.name for path in files if "time.monotonic" in path.read_text(encoding="utf-8")]
    assert strangers == ["machine_clock.py"]


# signals


def test_ctrl_break_ends_a_command_in_order() -> None:
    look = "import signal, sys; signal.SIGBREAK = signal.SIGUSR1; del signal.SIGHUP, signal.SIGQUIT; "
    look += "from device.interrupts import INTERRUPTS as ours; sys.exit([*map(int, ours)] != [2, 15, signal.SIGBREAK])"
    assert subprocess.run([sys.executable, "-c", look], cwd=ROOT, check=False).returncode == 0


def test_ctrl_c_is_for_the_run_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    from device.sensor import link
    from experiments.watch import markers_process

    started: list[dict[str, object]] = []

    def begin(_: object, **how: object) -> None:
        started.append(how)
        raise FileNotFoundError

    monkeypatch.setattr(subprocess, "Popen", begin)
    monkeypatch.setattr(link, "OWN_GROUP", 0x200)
    with pytest.raises(FileNotFoundError):
        link.SensorLink("simulated")
    monkeypatch.setattr(markers_process, "OWN_GROUP", 0x200)
    said: list[str] = []
    with markers_process.markers_beside(ROOT, said.append):
        assert len(said) == 1
    assert [how["creationflags"] for how in started] == [0x200, 0x200]


# files


def test_a_drive_that_a_mac_cannot_ask_is_synced_as_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import fcntl

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOTSUP, "Operation not supported")  # as of a folder that is shared by SMB

    synced: list[int] = []
    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", refuse)
    monkeypatch.setattr(os, "fsync", synced.append)
    monkeypatch.setattr("sys.platform", "darwin")
    descriptor = os.open(tmp_path / "file", os.O_CREAT | os.O_WRONLY)
    storage.sync(descriptor)
    assert synced == [descriptor]
    monkeypatch.setattr(fcntl, "fcntl", lambda *_: 0)
    storage.sync(descriptor)
    assert synced == [descriptor]
    os.close(descriptor)


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its locks, which know no sharing and hold no folder."""

    def open_file(path: Path, *how: int) -> int:
        if Path(path).is_dir():
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return os.open(path, *how)

    monkeypatch.setattr(storage, "os", SimpleNamespace(**vars(os) | {"name": "nt", "open": open_file}))
    monkeypatch.setitem(sys.modules, "msvcrt", byte_locks())
    monkeypatch.setattr("sys.platform", "win32")


def test_a_folder_is_held_by_a_file_beside_it_that_goes_again(windows: None, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    with storage.folder_held(folder) as ours:
        with storage.folder_held(folder) as theirs:
            assert (ours, theirs) == (True, False)
        folder.rename(tmp_path / "elsewhere")  # nothing in it is open
    with storage.folder_held(folder) as again:
        assert again
    assert [path.name for path in tmp_path.iterdir()] == ["elsewhere"]


def test_the_unfinished_folder_of_another_that_is_at_work_is_kept(windows: None, tmp_path: Path) -> None:
    with placing.files_in(tmp_path) as part, placing.files_in(tmp_path) as another:
        assert part.is_dir()
        (part / "ours").touch()
        (another / "theirs").touch()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ours", "theirs"]


def test_who_looks_at_the_same_time_as_another_takes_them_for_nobody_who_holds(
    windows: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    looking = storage.reopen(tmp_path / "file")
    assert storage.hold(looking)
    assert storage.is_held(tmp_path / "file")
    monkeypatch.setattr(storage.time, "sleep", lambda _: os.close(looking))  # who looks is done soon
    assert not storage.is_held(tmp_path / "file")


@pytest.fixture
def excel(windows: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A table that another program has open."""
    table, renamed = tmp_path / "b.csv", Path.rename

    def rename(path: Path, target: Path) -> Path:
        if table in (path, target):
            raise PermissionError(errno.EACCES, "Access is denied", str(path))
        return renamed(path, target)

    table.write_bytes(b"old")
    monkeypatch.setattr(Path, "rename", rename)
    monkeypatch.setattr(Path, "replace", rename)
    return table


@pytest.mark.slow
def test_a_table_that_is_open_elsewhere_is_named_with_what_to_do(excel: Path) -> None:
    with pytest.raises(PermissionError) as refused:
        storage.write_whole(excel, b"new")
    assert (refused.value.filename, refused.value.strerror) == (
        str(excel),
        "cannot be replaced: if another program has it open, such as Excel, close it there",
    )
    assert [path.name for path in excel.parent.iterdir()] == ["b.csv"]


@pytest.mark.slow
def test_of_results_of_which_one_is_open_elsewhere_none_is_replaced(excel: Path) -> None:
    (excel.parent / "a.csv").write_bytes(b"old")

    def write() -> None:
        with placing.files_in(excel.parent) as part:
            for name in ("a.csv", "b.csv"):
                (part / name).write_bytes(b"new")

    with pytest.raises(PermissionError, match=r"close it there"):
        write()
    assert {path.name: path.read_bytes() for path in excel.parent.iterdir()} == {"a.csv": b"old", "b.csv": b"old"}


def test_who_only_looks_is_waited_for(excel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(storage.time, "sleep", lambda _: monkeypatch.undo())
    storage.write_whole(excel, b"new")
    assert excel.read_bytes() == b"new"


# ports


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        ("PermissionError(13, 'Zugriff verweigert', None, 5)", "another program, or another run, has it open"),
        ("FileNotFoundError(2, 'Das System kann ...', None, 2)", "No such file or directory"),
    ],
)
def test_a_port_that_is_taken_or_not_there_is_told_as_elsewhere(
    said: str, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(f"could not open port 'COM3': {said}")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(LinkError, match=rf"^cannot open COM3: {reason}"):
        SerialPort("COM3")


@pytest.mark.parametrize("port", ["COM3", "com12", "COM3:", r"\\.\COM10"])
def test_a_serial_port_is_no_file_on_windows(port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "win32")
    with pytest.raises(SensorError, match=r"^is a serial port, which Windows does not read as a file"):
        CsvSensor(port)


@pytest.mark.slow
def test_a_file_that_grows_is_read_where_nothing_is_opened_without_waiting(tmp_path: Path) -> None:
    (tmp_path / "lines.csv").touch()
    look = "import os; del os.O_NONBLOCK; from device.sensor.streams import CsvSensor; "
    look += "sensor = CsvSensor('lines.csv'); open('lines.csv', 'a').write('1.5,0.25\\n'); print(sensor.read())"
    done = subprocess.run(
        [sys.executable, "-c", look], cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, check=False
    )
    assert (done.stdout, done.stderr) == (b"[(1.5, 0.25)]\n", b"")


# processes


def test_no_more_workers_are_asked_for_than_windows_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    def pool(workers: int, **_: object) -> None:
        raise RuntimeError(workers)

    monkeypatch.setattr(jobs, "ProcessPoolExecutor", pool)
    for system, most in (("win32", "61"), ("linux", "96")):
        monkeypatch.setattr("sys.platform", system)
        with jobs.on_processes(96) as run, pytest.raises(RuntimeError, match=rf"^{most}$"):
            run(abs, range(200), lambda *_: None)


@pytest.mark.slow
def test_what_the_markers_say_to_the_run_is_utf_8_whatever_the_terminal_takes(tmp_path: Path) -> None:
    (tmp_path / "pylsl.py").write_text("raise ImportError('l’été')", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "experiments.watch.markers_process", str(tmp_path)],
        env={"PYTHONPATH": f"{tmp_path}:{ROOT}", "PYTHONIOENCODING": "cp1252"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    assert "l’été" in done.stdout.decode("utf-8")


def test_the_participants_screen_leaves_nothing_where_it_was_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("HOME")
    monkeypatch.setattr("sys.platform", "win32")
    with writable_home():
        assert "HOME" not in os.environ
    assert not list(tmp_path.iterdir())


# commands


@pytest.mark.slow
def test_a_twin_needs_a_tcp_port_where_there_are_no_pseudo_terminals(tmp_path: Path) -> None:
    done = elsewhere("win32", "twin", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "recoil: the twin cannot be plugged in here: this system has no pseudo-terminals; "
        "try --tcp PORT, or another --link\n"
    )


@pytest.mark.slow
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_a_study_from_a_new_folder_to_its_report(system: str, tmp_path: Path) -> None:
    run = ["run", "pilot/direction.toml", "--screen", "synthetic", "--seed", "1", "--results", "pilot/simulated"]
    commands = (
        ["new", "pilot"],
        ["check", "pilot/direction.toml"],
        *([*run, "--participant", code] for code in ("CON", "S02")),  # the first is no name of a file on Windows
        ["study", "pilot"],
        ["rebuild", "pilot/simulated/sub-S02/sub-S02_task-direction_journal.jsonl"],
        ["freeze", "pilot"],
        ["analyze", "pilot/simulated", "--out", "pilot/analysis"],
        ["doctor", "--results", "pilot/simulated"],  # what it finds is this machine's
    )
    words = [word for command in commands for word in ("then", *command)][1:]
    done = elsewhere(system, *words, folder=tmp_path)
    assert done.returncode < 2, done.stderr
    assert not re.search(r"Traceback|(Attribute|Import|Module\w+)Error", f"{done.stdout}{done.stderr}")
    assert (tmp_path / "pilot/analysis/report.html").exists()


# paths


def test_logs_on_two_drives_are_named_by_their_whole_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: object) -> str:
        raise ValueError("Paths don't have the same drive")

    monkeypatch.setattr(os.path, "commonpath", refuse)
    paths = [Path("/c/sub-P01/log.csv"), Path("/d/sub-P01/log.csv")]
    assert files.folder_above(paths) == ""
    assert [*files.names_below(paths).values()] == [Path("c/sub-P01/log.csv"), Path("d/sub-P01/log.csv")]
    assert files.seen_from("/c/sub-P01/log.csv", "/d/sub-P01/log.csv") == "/c/sub-P01/log.csv"


@dataclass(frozen=True, slots=True)
class Entry:
    """What Windows lists in a folder: of a file that is open it knows an old size, and no number."""

    path: str

    @property
    def name(self) -> str:
        return Path(self.path).name

    def __fspath__(self) -> str:
        return self.path

    def stat(self) -> os.stat_result:
        return os.stat_result((0o100600, *[0] * 9))


def test_a_journal_that_grows_is_seen_to_grow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    listed = os.listdir

    @contextmanager
    def scandir(folder: Path) -> Iterator[list[Entry]]:
        yield [Entry(f"{folder}/{name}") for name in listed(folder)]

    journal = tmp_path / "sub-P01" / "sub-P01_task-direction_journal.jsonl"
    journal.parent.mkdir()
    journal.write_bytes(b"grown")
    monkeypatch.setattr(os, "scandir", scandir)
    (found,) = journals_in(tmp_path).stats.values()
    assert (found.st_ino, found.st_size) == (journal.stat().st_ino, 5)
