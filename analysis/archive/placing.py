"""A folder put in its place whole or not at all: whoever looks sees the old one, or the new one."""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from experiments.record import storage
from experiments.study import folders

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
"""Linux's words for exchanging two names at once: renameat2(2)."""


@contextmanager
def in_place(target: Path, check: Callable[[], object]) -> Iterator[Path]:
    """An empty folder beside `target` to fill; at the end it stands in its place, after an error nothing is left.

    `check` raises if the place may not be taken: it is asked again just before, as somebody may have come meanwhile.
    What an export that was killed left there is taken away first; one that is at work holds its folder.
    """
    storage.make_folder(target.parent)
    prefix = f".{target.name}.part-"
    for left_over in (path for path in target.parent.iterdir() if path.name.startswith(prefix)):
        with _folder_held(left_over) as is_ours:
            if is_ours:
                shutil.rmtree(left_over, ignore_errors=True)
    part = Path(tempfile.mkdtemp(prefix=prefix, dir=target.parent))
    try:
        with _folder_held(part):
            yield part
            check()
            _replace(target, part)
        storage.sync_folder(target.parent)
    finally:
        shutil.rmtree(part, ignore_errors=True)


@contextmanager
def _folder_held(folder: Path) -> Iterator[bool]:
    """Hold a folder for this process, and say whether nobody else does. Where folders cannot be held, nobody does."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        yield os.name != "posix"
        return
    try:
        yield storage.hold(descriptor)
    finally:
        os.close(descriptor)


def is_free(target: Path) -> bool:
    """Whether nothing is there, or an empty folder."""
    if target.is_symlink() or target.exists():
        return target.is_dir() and not target.is_symlink() and not any(target.iterdir())
    return True


def write_file(folder: Path, path: str, data: bytes) -> None:
    """Write a file in a folder, with the folders that its path names."""
    storage.make_folder((folder / path).parent)
    storage.write_whole(folder / path, data)


def _replace(target: Path, part: Path) -> None:
    if target.exists() and not any(target.iterdir()):
        target.rmdir()
    if not target.exists():
        part.rename(target)
    elif not _exchange(target, part):  # in two steps: killed between them, the old one is there under another name
        aside = folders.set_aside_file(target)
        part.rename(target)
        shutil.rmtree(aside)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two names at once; false where system or file system cannot."""
    if sys.platform != "linux":
        return False
    with suppress(OSError, AttributeError):  # no such call in this C library
        renameat2 = ctypes.CDLL(None, use_errno=True).renameat2
        return bool(renameat2(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) == 0)
    return False
