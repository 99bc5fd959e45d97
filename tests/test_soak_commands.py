"""What each command takes, and what it imports: `make soak`.

With the folder of an older version in `RECOIL_OLD` (`git worktree add --detach FOLDER COMMIT`, then `make full` there)
both are run in turn, and the table has their ratio; else it has new times alone. A bound is a time for a machine on
which 64dce29 takes a known one as it was set up, with nothing of Python compiled, as setting up does by now. So it is
held as a share of that. Beside it stands what the old one takes with all of Python compiled before.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.at_display import READY, virtual_display
from tests.conftest import RECOIL, Soak
from tests.waiting import wait_for

pytestmark = pytest.mark.soak

AS_SET_UP = "as it was set up"
OLD = Path(os.environ["RECOIL_OLD"]) if os.environ.get("RECOIL_OLD") else None
PROGRAMS = {"new": RECOIL}
if OLD is not None:
    PROGRAMS |= dict.fromkeys(("old", AS_SET_UP), OLD / ".venv" / "bin" / "recoil")
SURROUNDINGS = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
"""Programs are compiled once, as where they are installed: else most of a short command is the compiler of Python."""
UNCOMPILED = {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPYCACHEPREFIX": os.devnull}
LONG = ("bench", "design")
"""What does not take its time to start."""
HEAVY = ("numpy", "scipy.special", "scipy.stats", "pandas", "pyarrow", "matplotlib", "numba", "pingouin", "PyQt6")


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command, how often it is run, and what it may take where the old one takes so long."""

    words: str
    turns: int
    most_s: float
    was_s: float | None = None
    codes: tuple[int, ...] = (0,)

    @property
    def bound(self) -> str:
        """The bound in words."""
        return f"{self.most_s:g} s" + (f" where it was {self.was_s:g} s" if self.was_s else "")

    def most_of(self, times: Mapping[str, float]) -> float:
        """What it may take in this run."""
        old = times.get(AS_SET_UP) or times.get("old")
        return self.most_s / self.was_s * old if old and self.was_s else self.most_s


SWEEP = "simulate --vary friction_N=0.1:1.2:50 --vary drive_off=open,shorted --table OUT/shots.parquet"
COMMANDS = (
    Command(words="check direction", turns=9, most_s=0.8, was_s=1.6),
    Command(words="analyze RUNS --out OUT/analysis", turns=5, most_s=4.12, was_s=10.3),
    Command(words="reproduce --out OUT/reproduction", turns=5, most_s=10.0, was_s=20.0),
    Command(
        words="simulate --method asymmetric-2 --set voltage_V=20 --plot OUT/shot.png", turns=5, most_s=2.0, was_s=5.2
    ),
    Command(words=SWEEP, turns=3, most_s=2.0, was_s=39.0),
    Command(words="audit paper --out OUT/audit", turns=5, most_s=3.0, was_s=5.9, codes=(1,)),
    Command(words="fit percept --out OUT/fit", turns=3, most_s=6.0, was_s=11.0),
    Command(words="design --rate-above 5 --out OUT/design", turns=3, most_s=20.0, was_s=87.0),
    Command(words="bench --out OUT/bench", turns=1, most_s=60.0),
)


def median_times(
    turns: int, run: Callable[[str], float], programs: Sequence[str] = tuple(PROGRAMS)
) -> dict[str, float]:
    """The median seconds of each program, one after the other in each turn."""
    taken: dict[str, list[float]] = {name: [] for name in programs}
    for _ in range(turns):
        for name in programs:
            taken[name].append(run(name))
    return {name: statistics.median(each) for name, each in taken.items()}


def said(times: dict[str, float]) -> str:
    """Times in words, with their ratios where there are more than one."""
    words = [f"{times['new']:.2f} s"]
    for name, how in ((AS_SET_UP, f" {AS_SET_UP}"), ("old", " compiled before")):
        if name in times:
            words.append(f"was {times[name]:.2f} s{how}: {times['new'] / times[name]:.2f} of it")
    return ", ".join(words)


def surroundings(name: str) -> dict[str, str]:
    """The variables that a program is run with."""
    return SURROUNDINGS | (UNCOMPILED if name == AS_SET_UP else {})


def spent(name: str, words: Sequence[str | Path], codes: Sequence[int]) -> float:
    """The seconds of one run."""
    start_s = time.perf_counter()
    words = [PROGRAMS[name], *words]
    done = subprocess.run(words, capture_output=True, text=True, check=False, env=surroundings(name))
    taken_s = time.perf_counter() - start_s
    assert done.returncode in codes, done.stderr
    return taken_s


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The logs of one participant, by the program that made them."""
    found = {}
    for name, program in PROGRAMS.items():
        found[name] = tmp_path_factory.mktemp(name)
        for experiment in ("direction", "preference"):
            who = ["--participant", "S01", "--screen", "synthetic", "--seed", "1", "--results", found[name]]
            subprocess.run([program, "run", experiment, *who], check=True, capture_output=True)
    return found


@pytest.mark.parametrize("command", COMMANDS, ids=lambda one: one.words.split()[0])
def test_a_command_ends_in_its_time(command: Command, runs: dict[str, Path], tmp_path: Path, soak: Soak) -> None:
    def run(name: str) -> float:
        out = tmp_path / f"{name}-{len(list(tmp_path.iterdir()))}"
        out.mkdir()
        words = [word.replace("OUT", str(out)).replace("RUNS", str(runs[name])) for word in command.words.split()]
        return spent(name, words, command.codes)

    is_long = command.words.startswith(LONG)
    programs = [name for name in PROGRAMS if name != AS_SET_UP or not is_long]
    if command.turns > 1:
        for name in programs:
            run(name)  # warm
    times = median_times(command.turns, run, programs)
    load = os.getloadavg()[0]
    soak(
        f"`recoil {command.words.replace('OUT/', '').replace('RUNS', 'logs of one participant')}`",
        said(times),
        command.bound,
        f"medians of {command.turns} turns in one run, load {load:.1f} after",
    )
    assert times["new"] < command.most_of(times)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda one: one.words.split()[0])
def test_what_a_command_imports(command: Command, runs: dict[str, Path], tmp_path: Path, soak: Soak) -> None:
    if command.words.startswith(LONG):
        pytest.skip("their time is not that of their imports")
    words = command.words.replace("OUT", str(tmp_path)).replace("RUNS", str(runs["new"])).split()
    python = RECOIL.with_name("python")
    done = subprocess.run([python, "-X", "importtime", RECOIL, *words], capture_output=True, text=True, check=False)
    rows = [line.removeprefix("import time:").split("|") for line in done.stderr.splitlines() if "|" in line]
    own_us = [int(row[0]) for row in rows if row[0].strip().isdigit()]
    loaded = {row[2].strip() for row in rows}
    heavy = ", ".join(name for name in HEAVY if name in loaded) or "nothing heavy"
    figure = f"{len(own_us)} modules in {sum(own_us) / 1e6:.2f} s: {heavy}"
    soak(f"what `recoil {' '.join(words[:1])}`{_kind(command)} imports", figure, "stated", "-X importtime")
    assert own_us


def _kind(command: Command) -> str:
    kinds = {"--vary": " of a table", "--plot": " of a figure", "percept": " percept"}
    return next((words for key, words in kinds.items() if key in command.words), "")


@pytest.mark.skipif(not READY, reason="needs Xvfb and openbox")
def test_the_start_window_stands(tmp_path: Path, soak: Soak) -> None:
    from Xlib.display import Display  # python-xlib is in the extra `gui`

    with virtual_display() as name:
        looks = Display(name)
        listed = looks.intern_atom("_NET_CLIENT_LIST")

        def windows() -> bool:
            there = looks.screen().root.get_full_property(listed, 0)
            return there is not None and len(there.value) > 0

        def run(which: str) -> float:
            folder = tmp_path / which
            folder.mkdir(exist_ok=True)
            words = [PROGRAMS[which], "run", "direction", "--screen", "console", "--results", folder]
            start_s = time.perf_counter()
            process = subprocess.Popen(
                words, env=surroundings(which) | {"DISPLAY": name}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            wait_for(lambda: windows() or process.poll() is not None, "no window")
            taken_s = time.perf_counter() - start_s
            assert process.poll() is None
            process.kill()  # nothing is open yet, and an old one may ask first
            process.wait()
            wait_for(lambda: not windows(), "the window stays")
            return taken_s

        run("new")  # warm
        times = median_times(7, run)
        looks.close()
    soak("the console's start window", said(times), "1.2 s", "medians of 7 turns in one run, from the command on, warm")
    assert times["new"] < 1.2
