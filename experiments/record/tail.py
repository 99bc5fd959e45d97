"""A journal while it grows: what is new since the last look, read only, and whether what was read is still there.

A file is read on from where the last look ended. What was read is known by the link of its last line, which stands for
every line before it: a file in which it is not found again was changed or cut while it was watched.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from experiments.record import journal, storage
from experiments.record.journal import JournalError, Record, head_of, link_of, record_of

LOOK_BYTES = journal.MOST_LINE
"""So much of a journal is read in one look."""


@dataclass(frozen=True, slots=True, kw_only=True)
class News:
    """The records that a look found; `anew`: they are the first of their file, and what was read before is void."""

    records: tuple[Record, ...] = ()
    anew: bool = False


_NO_NEWS = News()
_READ_ON = -1
"""A time that no file has: there is something to be read, though nothing was written."""


class JournalTail:
    """One journal, looked at again and again. It is never held, and nothing is written.

    `cut_bytes`: what stands behind the last whole record.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.cut_bytes = 0
        self._stamp: tuple[int, int, int] | None = None
        self._begin()
        self._most, self._most_link = 0, ""

    def _begin(self) -> None:
        """Read from the first line at the next look."""
        self._count, self._length, self._link = 0, 0, ""
        self._digest = hashlib.sha256()

    def look(self) -> News:
        """What is new. `JournalError` names file, line and rule; after it the file is read anew once it has changed."""
        try:
            now = self.path.stat()
            stamp = (now.st_ino, now.st_size, now.st_mtime_ns)
            if stamp == self._stamp:
                return _NO_NEWS
            before, self._stamp = self._stamp, stamp
            if before is None or before[0] != now.st_ino:  # another file by the same name
                self._begin()
                self._most, self._most_link = 0, ""
            elif now.st_size <= before[1] and not self.unchanged():
                self._begin()
            return self._read_on()
        except OSError as error:
            self._stamp = None
            raise JournalError(f"cannot be read ({error.strerror})", at=self.path) from error

    def unchanged(self) -> bool:
        """Whether the bytes that were read stand there still. `OSError`: they cannot be read."""
        digest = hashlib.sha256()
        for piece in storage.pieces(self.path, self._length):
            digest.update(piece)
        return digest.digest() == self._digest.digest()

    def check(self) -> None:
        """Have everything read anew at the next look, if it was changed without a trace in size and time."""
        try:
            changed = not self.unchanged()
        except OSError:  # the next look says why
            changed = True
        if changed:
            self._begin()
            self._stamp = None if self._stamp is None else (self._stamp[0], self._stamp[1], _READ_ON)

    def _read_on(self) -> News:
        data = storage.read(self.path, LOOK_BYTES, self._length)
        whole, more = data[: data.rfind(b"\n") + 1], len(data) == LOOK_BYTES
        self.cut_bytes = 0 if more else len(data) - len(whole)
        anew = self._count == 0
        try:
            if not (self._count or whole) and data[:1] not in (b"", b"{"):
                raise JournalError("no record, and no beginning of one; it was changed", at=f"{self.path}: line 1")
            if more and not whole:
                raise JournalError(f"line {self._count + 1} is longer than any record; it was changed", at=self.path)
            records = tuple(map(self._next, whole.split(b"\n")[:-1]))
            self._check_whole(more=more)
        except JournalError:
            self._begin()
            raise
        return News(records=records, anew=anew)

    def _next(self, line: bytes) -> Record:
        """The record on the next line, where a line that was read before has to be the same."""
        record = self._record(line)
        self._count, self._length, self._link = self._count + 1, self._length + len(line) + 1, link_of(line)
        self._digest.update(line + b"\n")
        if self._count == self._most and self._link != self._most_link:
            raise JournalError("was rewritten while it was watched; look for who changes it", at=self.path)
        return record

    def _record(self, line: bytes) -> Record:
        if self._count:
            return record_of(self.path, self._count, line, self._link)
        head = head_of(self.path, line + b"\n")
        if head is None:
            raise JournalError("no whole record", at=f"{self.path}: line 1")
        return head

    def _check_whole(self, *, more: bool) -> None:
        """Whether all is there that was; with `more` the next look reads on."""
        if more and self._stamp is not None:
            self._stamp = (self._stamp[0], self._length, _READ_ON)
        if self._count >= self._most:
            self._most, self._most_link = self._count, self._link
        elif not more:
            raise JournalError(
                f"has {self._count} whole records and had {self._most} while it was watched; it was cut, so put back "
                "a copy",
                at=self.path,
            )
