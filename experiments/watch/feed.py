"""The markers of the runs of a results folder, as their records come to the disk. Journals are read only."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

from device.machine_clock import machine_s
from experiments.record import storage
from experiments.record.journal import Head, Record
from experiments.record.tail import JournalTail
from experiments.watch.folder import journals_in
from experiments.watch.markers import Marker, RunMarkers
from experiments.watch.runs import age_s, damage_shown

_FIND_S = 0.2
"""How often it is looked for journals that have begun or go on."""
_SHARE = 10
"""A search that takes long is followed by a rest so many times as long: folders can hold thousands of journals."""
_STRANGE_S = 5.0
"""A record that is younger or older by its clock than by its date by so much was written by another clock (assumed)."""
_Say = Callable[[str], None]
_Stamp = tuple[int, int]
"""Which file it is, and how long."""


class MarkerFeed:
    """Gives the markers of what is written from its making on. What is wrong with a journal is said once."""

    def __init__(self, folder: Path, say: _Say) -> None:
        self._folder, self._say = folder, say
        self._problems = set[str]()
        self._known: dict[Path, _Stamp] = dict(self._journals())
        self._runs: dict[Path, FollowedRun] = {}
        self._ended: dict[Path, int] = {}
        """Of which files nothing more will come."""
        self._next_s = 0.0

    def look(self) -> list[Marker]:
        """What is new, in the order of each journal."""
        if machine_s() >= self._next_s:
            self.find()
        markers = [marker for run in self._runs.values() for marker in run.look()]
        for path in [path for path, run in self._runs.items() if run.over]:
            self._ended[path] = self._known[path][0]
            del self._runs[path]
        return markers

    def find(self) -> None:
        """Follow the journals that are new, or have grown."""
        began_s = machine_s()
        for path, stamp in self._journals():
            before = self._known.get(path)
            self._known[path] = stamp
            if path not in self._runs and stamp != before and self._ended.get(path) != stamp[0]:
                self._follow(path, before, stamp)
        now_s = machine_s()
        self._next_s = now_s + max(_FIND_S, _SHARE * (now_s - began_s))

    def _follow(self, path: Path, before: _Stamp | None, now: _Stamp) -> None:
        try:
            self._runs[path] = FollowedRun(path, _lines_before(path, before, now), self._say)
        except OSError as error:
            self._say_once(f"{path}: cannot be read ({error.strerror}); no markers of this run")

    def _journals(self) -> Iterator[tuple[Path, _Stamp]]:
        if not os.path.lexists(self._folder):  # not made yet, or moved away just now
            return
        found = journals_in(self._folder)
        for problem in found.problems:
            self._say_once(problem)
        for path, now in found.stats.items():
            yield path, (now.st_ino, now.st_size)

    def _say_once(self, problem: str) -> None:
        if problem not in self._problems:
            self._problems.add(problem)
            self._say(problem)


def _lines_before(path: Path, before: _Stamp | None, now: _Stamp) -> int:
    """How many records a journal had when it was first seen; none, if that was another file by its name."""
    if before is None or before[0] != now[0]:
        return 0
    return sum(piece.count(b"\n") for piece in storage.pieces(path, before[1]))


class FollowedRun:
    """A journal that grows, and its markers after so many records."""

    def __init__(self, path: Path, skip: int, say: _Say) -> None:
        self._path, self._skip, self._say = path, skip, say
        self._tail = JournalTail(path)
        self._markers: RunMarkers | None = None
        self._clock: str | None = None
        self._mute: bool | None = None
        """Whether nothing is told of this sitting; `None` until its first record."""
        self.over = False
        """Whether nothing more will come: the run is finished, or its journal is damaged."""

    def look(self) -> list[Marker]:
        """What is new. Never raises."""
        markers = list[Marker]()
        try:
            for record in self._tail.look().records:
                markers += self._of(record)
                self.over = record.kind == "finished"
        except Exception as error:  # noqa: BLE001 - whatever one journal does, the others go on
            self._end(damage_shown(self._path, error))
        return markers

    def _end(self, why: str) -> None:
        self.over = True
        self._say(f"{why}; no more markers of this run")

    def _of(self, record: Record) -> list[Marker]:
        if isinstance(record, Head):
            self._skip = self._skip if self._markers is None else 0  # another run's journal by the same name
            self._markers = RunMarkers(record)
        if isinstance(record, Head) or record.kind == "resumed":
            self._clock, self._mute = record.clock, None
        if self._markers is None:
            return []
        marker = self._markers.of(record)
        if record.n < self._skip:
            return []
        if self._mute is None:
            self._mute = self._refused(record)
        return [] if marker is None or self._mute else [marker]

    def _refused(self, first: Record) -> bool:
        """Whether nothing can be told of a sitting, as its clock is not that of this machine; said, if it is so."""
        now_s, utc = machine_s(), datetime.now(UTC)
        clock = self._clock or "real"
        if clock != "real":
            why = f"this run is on a clock of its own ({clock}), which no other recording has"
        elif abs(now_s - first.monotonic_s - age_s(first.utc, utc)) > _STRANGE_S:
            why = f"record {first.n} was written at another machine, or its date was set just then"
        else:
            return False
        self._say(f"{self._path}: {why}; no markers of it")
        return True
