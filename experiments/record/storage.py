"""Files that are safe once written: readable by their owner only, synced with their folder, held by one run at a time.

Linux is tested. On macOS a sync asks the drive itself (`F_FULLFSYNC`), where the file system can. On Windows folders
cannot be synced and file modes do not exist, so the folder's own permissions count there.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path

from device.machine_clock import machine_s

OWNER_FILE = 0o600
OWNER_FOLDER = 0o700
JOURNAL_ENDING = "_journal.jsonl"
DISK_FULL = (errno.ENOSPC, errno.EDQUOT)
"""The numbers of a system's errors that say that a disk is full."""


def make_folder(folder: Path) -> None:
    """Make a folder and its parents, readable by their owner only, and sync what names them."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir(mode=OWNER_FOLDER, exist_ok=True)
        sync_folder(path.parent)


def create(path: Path) -> int:
    """A new file to append to; its name is on disk when this returns. `FileExistsError` if there is one."""
    descriptor = os.open(path, _APPEND | os.O_CREAT | os.O_EXCL, OWNER_FILE)
    sync_folder(path.parent)
    return descriptor


def reopen(path: Path) -> int:
    """An existing file to append to."""
    return os.open(path, _APPEND)


_APPEND = os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)


def is_at(descriptor: int, path: Path) -> bool:
    """Whether an open file is still the one that a path names: it was neither deleted nor moved."""
    try:
        there = path.stat()
    except OSError:
        return False
    here = os.fstat(descriptor)
    return (here.st_dev, here.st_ino) == (there.st_dev, there.st_ino)


def why_not_seen(path: Path) -> OSError | None:
    """Why nobody can look at a file that may be there still, as in a closed folder; `None` if it is not there."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        return error
    return None


def moved_to(descriptor: int) -> Path | None:
    """Where an open file lies now, where the system tells (Linux); `None` if it was deleted."""
    try:
        path = Path(f"/proc/self/fd/{descriptor}").readlink()
    except OSError:
        return None
    return path if is_at(descriptor, path) else None


def open_to_read(path: Path | str) -> int:
    """A file to be read. `OSError` where there is none: a pipe would be waited for, and a device has no end."""
    descriptor = os.open(path, _READ)
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return descriptor
    os.close(descriptor)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    raise OSError(errno.EINVAL, NO_FILE, str(path))


NO_FILE = "it is a pipe or a device, not a file"


_READ = os.O_RDONLY
for _flag in ("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_BINARY"):
    _READ |= getattr(os, _flag, 0)


def read(path: Path, most: int, start: int = 0) -> bytes:
    """So many bytes of a file at most. `OSError` as of `open_to_read`."""
    with os.fdopen(open_to_read(path), "rb") as file:
        file.seek(start)
        return file.read(most) or b""  # nothing: a file of the system that has nothing to say just now


def read_whole(path: Path | str) -> bytes:
    """A file's bytes, with as few calls as can be. `OSError` as of `open_to_read`."""
    descriptor = open_to_read(path)
    try:
        found = [os.read(descriptor, _LOG_BYTES)]
        while piece := os.read(descriptor, _LOG_BYTES):
            found.append(piece)
    finally:
        os.close(descriptor)
    return found[0] if len(found) == 1 else b"".join(found)


_LOG_BYTES = 1 << 16
"""Most logs are one piece of so many."""


def first_line(path: Path | str) -> bytes:
    """The first line of a file. `OSError` as of `open_to_read`."""
    with os.fdopen(open_to_read(path), "rb") as file:
        return file.readline()


def pieces(path: Path, length: int) -> Iterator[bytes]:
    """The first bytes of a file, a piece at a time. `OSError` as of `open_to_read`."""
    with os.fdopen(open_to_read(path), "rb") as file:
        while length and (piece := file.read(min(length, _PIECE_BYTES))):
            yield piece
            length -= len(piece)


_PIECE_BYTES = 1 << 20


def read_open(descriptor: int, length: int) -> bytes:
    """The first bytes of an open file, also of one that was deleted."""
    os.lseek(descriptor, 0, os.SEEK_SET)
    with os.fdopen(os.dup(descriptor), "rb") as file:
        return file.read(length)


def write_all(descriptor: int, data: bytes) -> None:
    """Write every byte, however many calls it takes."""
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]


def written_again(path: Path, data: bytes) -> bool:
    """Whether a file could be made of this, where none was."""
    try:
        make_folder(path.parent)
        descriptor = create(path)
    except OSError:
        return False
    try:
        write_all(descriptor, data)
        sync(descriptor)
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return True


def sync(descriptor: int) -> None:
    """Return when the file's bytes are on the disk."""
    if sys.platform == "darwin":
        import fcntl  # noqa: PLC0415 - this system only

        with suppress(OSError):  # a shared folder or a foreign disk has no such request: then as elsewhere
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def sync_folder(folder: Path) -> None:
    """Return when the names in a folder are on the disk; where the system cannot, do nothing."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def hold(descriptor: int, patience_s: float = 0.0) -> bool:
    """Take the file for this process alone; false if another holds it. Let go when the file is closed.

    With patience, somebody who only looks (`is_held`) and lets go at once is no hindrance.
    """
    end_s = machine_s() + patience_s
    while not _locked(descriptor, shared=False):
        if machine_s() >= end_s:
            return False
        time.sleep(_AGAIN_S)
    return True


_AGAIN_S = 0.01


@contextmanager
def folder_held(folder: Path, patience_s: float = 0.0) -> Iterator[bool]:
    """Hold a folder for this process, and say whether nobody else does. Where folders cannot be held, nobody does.

    Windows opens no folder: a file beside it is held in its stead, which is gone in the end.
    """
    beside = _beside(folder) if sys.platform == "win32" else None
    try:
        descriptor = os.open(beside or folder, os.O_RDWR | os.O_CREAT if beside else os.O_RDONLY, OWNER_FILE)
    except OSError:
        yield beside is not None
        return
    is_ours = False
    try:
        is_ours = hold(descriptor, patience_s)
        yield is_ours
    finally:
        os.close(descriptor)
        if beside is not None and is_ours:
            with suppress(OSError):  # another one waits for it
                beside.unlink()


def _beside(folder: Path) -> Path:
    """The file that stands for a folder; one in it would keep the folder from being renamed."""
    here = folder.absolute()
    return here.parent / f".{here.name}.held"


def is_held(path: Path) -> bool:
    """Whether somebody holds a file. To find out it is held for a moment, which others who only look do not notice.

    On Windows they would: whoever looks there looks again for a moment before it is said to be held.
    """
    descriptor = open_to_read(path)
    try:
        return not (hold(descriptor, _LOOKED_S) if sys.platform == "win32" else _locked(descriptor, shared=True))
    finally:
        os.close(descriptor)


_LOOKED_S = 0.05


def _locked(descriptor: int, *, shared: bool) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt  # noqa: PLC0415 - this system only

            os.lseek(descriptor, 0x7FFF_FFFE, os.SEEK_SET)  # far behind the end, so that reading stays allowed
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl  # noqa: PLC0415 - not on Windows

            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


@contextmanager
def errors_name(path: Path | str) -> Iterator[None]:
    """Errors of the system that say of no file where they happened, as a full disk does, say it of this one."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


def check_file(path: Path) -> None:
    """`OSError` if something is at this place that is no file: a folder, a device, or a pipe, which may never end.

    Or a file that is open in another program, on Windows.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, not a file", str(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "is a device or a pipe, not a file", str(path))
    if sys.platform == "win32" and path.exists():
        _check_closed(path)


def _check_closed(path: Path) -> None:
    """`PermissionError` if a file stays open elsewhere: Windows then lets nothing rename it, or take its place."""
    end_s = machine_s() + _OPEN_S
    while True:
        try:
            path.rename(path)
        except PermissionError:
            if machine_s() >= end_s:
                raise PermissionError(errno.EACCES, _IS_OPEN, str(path)) from None
            time.sleep(_AGAIN_S)
        else:
            return


_OPEN_S = 1.0
"""Who only looks has a file open for less (assumed)."""
_IS_OPEN = "cannot be replaced: if another program has it open, such as Excel, close it there"


def write_whole(path: Path, data: bytes) -> None:
    """Put a whole file in its place at once: readers see the old one or the new one, never a part.

    A journal is the only full record of a run: nothing takes its place. Whoever writes the same file at the same time,
    as consoles that share a folder do, writes a part of their own; the last one stands there in the end.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_ident()}.part")
    with errors_name(path):
        check_file(path)
        _take_away_parts(path)
        if path.name.endswith(JOURNAL_ENDING) and path.exists():
            raise FileExistsError(errno.EEXIST, "is the journal of a run, which nothing replaces", str(path))
        part.unlink(missing_ok=True)
        try:
            descriptor = os.open(part, _APPEND | os.O_CREAT | os.O_EXCL, OWNER_FILE)
            try:
                write_all(descriptor, data)
                sync(descriptor)
            finally:
                os.close(descriptor)
            part.replace(path)
        except OSError as error:
            part.unlink(missing_ok=True)
            error.filename, error.filename2 = str(path), None  # nobody knows the other name
            raise
        sync_folder(path.parent)


_LEFT_S = 3600.0
"""A part that nobody has written to for so long was left by a program that was killed."""


def _take_away_parts(path: Path) -> None:
    """Take away what a program that was killed left of a file."""
    with suppress(OSError):
        for part in path.parent.glob(f".{escape(path.name)}.*.part"):
            if time.time() - part.stat().st_mtime > _LEFT_S:
                part.unlink()


def set_aside_file(path: Path) -> Path:
    """Rename a file, or a folder, to the first free `NAME.aside-N`. Returns the new name."""
    return set_aside_files(path)[0]


def set_aside_files(*paths: Path) -> list[Path]:
    """The same of files that belong together: those that are there get one N, which is free for all."""
    number = 1
    while any(os.path.lexists(_aside(path, number)) for path in paths):
        number += 1
    return [path.rename(_aside(path, number)) for path in paths if os.path.lexists(path)]


def _aside(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}.aside-{number}{path.suffix}")
