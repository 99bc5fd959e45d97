"""What several tests share: the program as a user calls it, and the shipped experiments without breaks."""

from __future__ import annotations

import fcntl
import gc
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from experiments.load import shipped_folder
from experiments.record import storage
from tests import figure_files, warm_start

gc.disable()  # what is collected here stays: six thousand tests and all that they import, gone through again and again

pytest.register_assert_rewrite("tests.at_controls", "tests.brute_force", "tests.experimenters", "tests.kills")

settings.register_profile("recoil", deadline=None, derandomize=True)
settings.load_profile("recoil")


def pytest_configure(config: pytest.Config) -> None:
    """Name the place of the server of `tests/warm_start.py`, one for all workers; it starts when it is first asked."""
    if not hasattr(config, "workerinput"):
        os.environ[warm_start.OWNER] = str(os.getpid())
        os.environ[warm_start.FOLDER] = tempfile.mkdtemp(prefix="recoil-tests-")


_MANY = 10
"""From so many slow tests on a module is as long as any."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The modules with most slow tests come first, those that wait mixed with those that compute; the quick fill up."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: (-min(slow[item.path], _MANY), zlib.crc32(item.path.name.encode())))


def pytest_collection_finish(session: pytest.Session) -> None:
    """From here on the collector looks at what the tests leave, not at themselves."""
    gc.freeze()
    gc.enable()


def pytest_unconfigure(config: pytest.Config) -> None:
    """Forget that place."""
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ[warm_start.FOLDER])


@pytest.fixture
def disk_that_fills(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fifth file that is written whole finds no room."""
    written: list[Path] = []

    def write(path: Path, data: bytes) -> None:
        written.append(path)
        if len(written) == 5:
            raise OSError(28, "No space left on device")
        path.write_bytes(data)

    monkeypatch.setattr(storage, "write_whole", write)


RECOIL = Path(sys.executable).with_name("recoil")

Recoil = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def recoil(tmp_path: Path) -> Recoil:
    """The command, called in an empty folder with an empty home; `NAME="value"` is put into its environment."""
    home = tmp_path / "home"
    home.mkdir()
    environment = {key: value for key, value in os.environ.items() if key in ("PATH", "LANG", "LC_ALL", "TMPDIR")}

    def call(*words: object, **variables: str) -> subprocess.CompletedProcess[str]:
        return warm_start.run_warm(*words, cwd=tmp_path, env=environment | {"HOME": str(home)} | variables)

    return call


@pytest.fixture(scope="session", autouse=True)
def _png_alone() -> None:
    """Of each figure, but where a test asks for more (`figure_files.drawn`)."""
    figure_files.leave_out()


@pytest.fixture(scope="session")
def reproduction() -> Path:
    """What `recoil reproduce` leaves, made once for all tests, which only read it; what it said lies beside it."""
    place = Path(os.environ[warm_start.FOLDER]) / "reproduction"
    place.mkdir(exist_ok=True)
    said = place / "said.txt"
    with (place / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another worker may be making it
        if not said.exists():
            words = warm_start.warm("reproduce", "--out", "out")
            done = subprocess.run(words, cwd=place, check=True, capture_output=True)
            said.write_bytes(done.stdout)
    return place / "out"


@pytest.fixture
def quick_configs(tmp_path: Path) -> Path:
    """The shipped configs in a folder of their own, without a guard against hasty hands.

    Experiment 1 has no breaks, and quick synthetic answers.
    """
    folder = tmp_path / "configs"
    folder.mkdir()
    (folder / "synthetic").mkdir()
    for source in [*shipped_folder().glob("*.toml"), *shipped_folder().glob("synthetic/*.toml")]:
        (folder / source.relative_to(shipped_folder())).write_text(
            source.read_text()
            .replace("guard_s = 0.25", "guard_s = 0.0")
            .replace("least_exposure_s = 1.0", "least_exposure_s = 0.0")
        )
    people, config = folder / "synthetic/direction.toml", folder / "direction.toml"
    quick = people.read_text().replace("shift_s = 0.35", "shift_s = 0.01").replace("median_s = 0.75", "median_s = 0.02")
    people.write_text(quick)
    text = re.sub(r"between_(sets|sessions)_s = [\d.]+", r"between_\1_s = 0.0", config.read_text())
    config.write_text(text.replace("max_trials_without_break = 10", "max_trials_without_break = 60"))
    return folder


Soak = Callable[..., None]

SOAK_FOLDER = Path(__file__).parent.parent / "results" / "soak"


def table_rows(table: Path) -> list[tuple[str, ...]]:
    """The rows of a table of figures, as they are kept; none if there is no table."""
    lines = table.read_text(encoding="utf-8").splitlines() if table.exists() else []
    return [tuple(line.removeprefix("| ").removesuffix(" |").split(" | ")) for line in lines if line[:1] == "|"][2:]


@pytest.fixture(scope="module")
def soak(request: pytest.FixtureRequest) -> Iterator[Soak]:
    """Keeps measured figures: `soak(promise, figure, bound, detail)`; a module's become its table in results/soak/.

    Where only some are measured anew, the table keeps the others.
    """
    rows: list[tuple[str, ...]] = []
    yield lambda *cells: rows.append(tuple(map(str, cells)))
    name = request.module.__name__.removeprefix("tests.test_soak_")
    machine = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    header = ["| promise | figure | bound | how |", "| --- | --- | --- | --- |"]
    table = SOAK_FOLDER / f"{name}.md"
    measured = {row[0] for row in rows}
    rows[:0] = [row for row in table_rows(table) if row[0] not in measured]
    lines = [f"# {name.capitalize()}", "", f"Made by `make soak` on {machine}.", "", *header]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    SOAK_FOLDER.mkdir(parents=True, exist_ok=True)
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")


def refused(done: subprocess.CompletedProcess[str], *said: str) -> None:
    """Exit code 2 and one message that says it all; no traceback, nothing on standard output."""
    assert done.returncode == 2, done
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    for words in said:
        assert words in done.stderr
