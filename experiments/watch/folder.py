"""A results folder while runs are going on: its journals are found and followed by one reader, for all who look."""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from device.machine_clock import machine_s
from experiments.record.journal import ENDING
from experiments.study.folders import PlaceError
from experiments.watch.runs import RunRow, WatchedRun

NEXT_LOOK_S = 0.1
"""How long after a look the next one comes."""
HOLD_S, CHECK_S, TICK_S = 0.5, 5.0, 0.5
"""How often it is asked who holds a journal, whether what was read still stands there, and how long still."""
FIRST_S = 0.15
"""So long at most the journals that are new are read in one look, so that those that grow do not wait for them."""
SHARE = 4
"""A look that takes long is followed by a rest so many times as long: a folder of thousands is looked at less often."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """What a look at the folder found: each run, by participant and experiment, and what there is to say beside them.

    `set_aside` and `unread`: how many journals were set aside, which are not shown, and how many are still to be read.
    `problems`: what cannot be read, or is no file.
    """

    folder: Path
    utc: datetime
    rows: tuple[RunRow, ...] = ()
    set_aside: int = 0
    unread: int = 0
    problems: tuple[str, ...] = ()


def watched_folder(folder: Path) -> Path:
    """The results folder that is meant: a study's folder means its results. `PlaceError` if there is no such folder."""
    if not folder.is_dir():
        what = "is no folder" if os.path.lexists(folder) else "no such folder"
        raise PlaceError(f"{folder}: {what}; name a results folder, or the folder of a study")
    return folder / "results" if (folder / "study.toml").is_file() else folder


class FolderWatch:
    """Looks at the journals of a folder, and remembers them. Nothing is written, and nothing is kept open."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._runs: dict[Path, WatchedRun] = {}
        self._unread: dict[Path, float] = {}
        self._found = JournalFiles()
        self._asked_s = self._checked_s = self._told_s = -1e9

    def look(self) -> Watched | None:
        """What there is to show; `None` if that is the same as before."""
        now_s = machine_s()
        changed = self._find()
        for run in tuple(self._runs.values()):
            changed |= run.look()
        changed |= self._read_unread(now_s + FIRST_S)
        if now_s - self._asked_s >= HOLD_S or changed:
            self._asked_s = now_s
            for run in self._runs.values():
                changed |= run.ask_who_holds()
        if now_s - self._checked_s >= CHECK_S:
            self._checked_s = now_s
            for run in self._runs.values():
                if not (run.over or run.gone):
                    run.check()
        if not changed and now_s - self._told_s < TICK_S:
            return None
        self._told_s = now_s
        return self._watched()

    @property
    def runs(self) -> tuple[WatchedRun, ...]:
        """What is watched, in order of the files' names."""
        return tuple(self._runs[path] for path in sorted(self._runs))

    def _watched(self) -> Watched:
        utc = datetime.now(UTC)
        return Watched(
            folder=self.folder,
            utc=utc,
            rows=tuple(run.row(utc) for run in self.runs),
            set_aside=self._found.set_aside,
            unread=len(self._unread),
            problems=self._found.problems,
        )

    def _find(self) -> bool:
        """Know the journals that are there now; whether they are others than before."""
        before = self._there()
        self._found = journals_in(self.folder)
        stats = self._found.stats
        for path, run in self._runs.items():
            run.gone = path not in stats and _is_gone(path)
        self._unread = {path: stat.st_mtime for path, stat in stats.items() if path not in self._runs}
        return before != self._there()

    def _there(self) -> tuple[int, tuple[str, ...], int, int]:
        """What a look at the folder alone can change."""
        gone = sum(run.gone for run in self._runs.values())
        return self._found.set_aside, self._found.problems, len(self._runs) + len(self._unread), gone

    def _read_unread(self, until_s: float) -> bool:
        """Read journals for the first time, the youngest first; whether there were any."""
        waiting = sorted(self._unread, key=lambda path: -self._unread[path])
        for path in waiting:
            run = self._runs[path] = WatchedRun(path)
            del self._unread[path]
            run.look()
            if machine_s() > until_s:
                break
        return bool(waiting)


def _is_gone(path: Path) -> bool:
    """Whether there is nothing by that name, as far as one may look."""
    try:
        path.lstat()
    except OSError as error:
        return isinstance(error, FileNotFoundError | NotADirectoryError)
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class JournalFiles:
    """The journals of a folder, how many more were set aside, and what in it cannot be read, one sentence each."""

    stats: Mapping[Path, os.stat_result] = field(default_factory=dict)
    set_aside: int = 0
    problems: tuple[str, ...] = ()


def journals_in(folder: Path) -> JournalFiles:
    """What is named as the files are that runs write their records to. What cannot be read hides nothing else."""
    stats, set_aside, problems = dict[Path, os.stat_result](), 0, list[str]()
    for one in _named_as_journals(folder, problems):
        found = _stat(one, problems)
        if found is None:
            continue
        if not stat.S_ISREG(found.st_mode):
            problems.append(f"{one.path}: is no file, though it is named like a journal; it is left alone")
        elif one.name.endswith(ENDING):
            stats[Path(one)] = found
        else:
            set_aside += 1
    return JournalFiles(stats=stats, set_aside=set_aside, problems=tuple(problems))


def _named_as_journals(folder: Path, problems: list[str]) -> Iterator[os.DirEntry[str]]:
    """What in people's folders has the name of a journal, or of one that was set aside."""
    for person in _listed(folder, problems):
        found = _stat(person, problems) if person.name.startswith("sub-") else None
        if found is not None and stat.S_ISDIR(found.st_mode):
            files = _listed(Path(person), problems)
            yield from (one for one in files if _STEM in one.name and one.name.endswith(".jsonl"))


_STEM = ENDING.removesuffix(".jsonl")


def _listed(folder: Path, problems: list[str]) -> list[os.DirEntry[str]]:
    """What is in a folder."""
    try:
        with os.scandir(folder) as entries:
            return sorted(entries, key=lambda entry: entry.name)
    except OSError as error:
        problems.append(f"{folder}: cannot be read ({error.strerror}); what is in it is not shown")
        return []


def _stat(entry: os.DirEntry[str], problems: list[str]) -> os.stat_result | None:
    """What a name stands for; `None` if that cannot be told, or it was moved away just now."""
    try:
        return Path(entry).stat()  # an entry of Windows has no number, and an old size of what grows
    except OSError as error:
        if entry.is_symlink() or not isinstance(error, FileNotFoundError):
            problems.append(f"{entry.path}: cannot be read ({error.strerror}); it is left alone")
        return None


_LEAVE_S = 2.0
"""How long a look that is under way is waited for."""


class Reader:
    """The one thread that looks, and what it saw last, for everybody who waits for it.

    `made`: what is kept of a look, made once however many wait.
    """

    def __init__(self, watch: FolderWatch, made: Callable[[Watched], tuple[str, ...]]) -> None:
        self._watch, self._made = watch, made
        self._news = threading.Condition()
        self._parts: tuple[str, ...] = ()
        self._number = 0
        self._leaves = threading.Event()
        self.failure: Exception | None = None
        """What the looking broke off with; nothing new comes any more."""
        self._thread = threading.Thread(target=self._look_on, daemon=True, name="watch")

    def start(self) -> None:
        """Look once, and go on beside."""
        self._look()
        self._thread.start()

    def stop(self) -> None:
        """Look no more, and let go of everybody who waits."""
        self._leaves.set()
        if self._thread.ident is not None:
            self._thread.join(_LEAVE_S)
        with self._news:
            self._news.notify_all()

    @property
    def stopped(self) -> bool:
        """Whether there will be nothing new."""
        return self._leaves.is_set()

    def after(self, number: int, wait_s: float) -> tuple[int, tuple[str, ...]]:
        """What was seen last and its number, as soon as that is another than one has, or after so long."""
        with self._news:
            self._news.wait_for(lambda: self._number != number or self.stopped, wait_s)
            return self._number, self._parts

    def _look_on(self) -> None:
        began_s = machine_s()
        took_s = 0.0
        while not self._leaves.wait(max(NEXT_LOOK_S, SHARE * took_s)):
            began_s = machine_s()
            try:
                self._look()
            except Exception as error:  # noqa: BLE001 - raised where the page is served
                self.failure = error
                self._leaves.set()
            took_s = machine_s() - began_s

    def _look(self) -> None:
        seen = self._watch.look()
        if seen is None:
            return
        parts = self._made(seen)
        if parts != self._parts:
            with self._news:
                self._parts, self._number = parts, self._number + 1
                self._news.notify_all()
