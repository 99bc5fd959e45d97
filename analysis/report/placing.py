"""Folders and files of results put in their places whole or not at all: whoever looks sees the old, or the new."""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path

from analysis.report.copies import no_interrupt
from analysis.report.section import MAKER, REPORT_FILES
from analysis.report.terminal import say
from device.messages import RecoilError, first_few
from experiments.record import storage

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
"""Linux's words for exchanging two names at once: renameat2(2)."""


@contextmanager
def in_place(target: Path, check: Callable[[], object]) -> Iterator[Path]:
    """An empty folder beside `target` to fill; at the end it stands in its place, after an error nothing is left.

    `check` raises if the place may not be taken: it is asked again just before, as somebody may have come meanwhile.
    """
    storage.make_folder(target.parent)
    with _part(target.parent, f".{target.name}.part-") as part, _errors_name(target, part):
        yield part
        check()
        _replace(target, part)
    storage.sync_folder(target.parent)


FIT_FILE, POWER_FILE = "fit.json", "power.json"
"""The numbers of whatever is fitted, and of whatever is planned."""


@contextmanager
def results_in(out: Path, record: str, others: Sequence[str] = ()) -> Iterator[Path]:
    """An empty folder to fill with results; at the end all its files go to `out` at once, after an error none does.

    So no figure of one analysis stands beside numbers of another, whenever one is interrupted. What results before
    these left there stays, and is named: all in their folders, and what `others`, patterns of names, fit.

    `record`: the file of numbers that results of this kind have. `RecoilError`: in `out` a report or such a file
    stands alone, which is of something else; `OSError`: a place that cannot be written to; before anything is done.
    Other files that would be replaced, where no results of this kind are, are set aside.
    """
    made = [path for path in (out, *out.parents) if not path.exists()]
    storage.make_folder(out)
    try:
        check_for_another(out, record)
        with _part(out, ".part-") as part, _errors_name(out, part):
            yield part
            check_for_another(out, record)
            aside = _others_files(out, record, part)
            left = _left_over(out, part, others) if (out / record).exists() else []
            with no_interrupt():
                for file in aside:
                    say(f"recoil: {file}: is of something else, and was set aside as {storage.set_aside_file(file)}")
                _move_files(part, out)
        if left:
            say(f"recoil: {out}: of results before these, and left there: {first_few(left, _NAMED)}")
    finally:
        for folder in made:
            with suppress(OSError):  # it is not empty
                folder.rmdir()


def check_for_another(out: Path, record: str) -> None:
    """`RecoilError` for a report in `out` that is of something else, as its file of numbers is not there."""
    report = _report_in(out)
    if report is not None and not (out / record).exists():
        raise RecoilError(f"{out}: has a {report} of something else (there is no {record} beside it); {_MOVE}")
    if report is None and (out / record).exists():
        raise RecoilError(f"{out}: has a {record} of something else (there is no report beside it); {_MOVE}")


_MOVE = "choose another folder, or move that away"


def _report_in(out: Path) -> str | None:
    return next((name for name in REPORT_FILES if (out / name).exists()), None)


def _others_files(out: Path, record: str, part: Path) -> list[Path]:
    """The files in `out` that would be replaced where no results of this kind are."""
    if (out / record).exists():
        return []
    files = sorted(path.relative_to(part) for path in part.rglob("*") if path.is_file())
    return [out / file for file in files if (out / file).is_file()]


_NAMED = 5


@contextmanager
def _errors_name(out: Path, part: Path) -> Iterator[None]:
    """Errors of the system speak of the place where a file was to stand, not of where it stood until then."""
    try:
        yield
    except OSError as error:
        file = Path(str(error.filename)).absolute()
        if file.is_relative_to(part.absolute()):
            error.filename, error.filename2 = str(out / file.relative_to(part.absolute())), None
        raise


def _left_over(out: Path, part: Path, others: Sequence[str]) -> list[str]:
    """What is in `out` of results before, by its path there, and will not be replaced."""
    new = {path.relative_to(part) for path in part.rglob("*")}
    folders = [path for path in new if (part / path).is_dir()]
    there = {*chain.from_iterable((out / folder).glob("*") for folder in folders)}
    there |= {*chain.from_iterable(out.glob(pattern) for pattern in ("figures/*", *others))}
    return sorted(path.relative_to(out).as_posix() for path in there if path.relative_to(out) not in new)


def _move_files(part: Path, out: Path) -> None:
    files = sorted(path.relative_to(part) for path in part.rglob("*") if path.is_file())
    for file in files:
        storage.make_folder((out / file).parent)
        storage.check_file(out / file)
    for file in files:
        (part / file).replace(out / file)
    for folder in {(out / file).parent for file in files}:
        storage.sync_folder(folder)


@contextmanager
def _part(folder: Path, prefix: str) -> Iterator[Path]:
    """A new folder in a folder, which is gone in the end.

    What a command that was killed left there is taken away first; one that is at work holds its own.
    """
    for left_over in (path for path in folder.iterdir() if path.name.startswith(prefix)):
        with storage.folder_held(left_over) as is_ours:
            if is_ours:
                shutil.rmtree(left_over, ignore_errors=True)
    try:
        part = Path(tempfile.mkdtemp(prefix=prefix, dir=folder))
    except OSError as error:
        error.filename = str(folder)  # nobody knows the other name
        raise
    try:
        with storage.folder_held(part):
            yield part
    finally:
        shutil.rmtree(part, ignore_errors=True)


@contextmanager
def files_in(folder: Path) -> Iterator[Path]:
    """An empty folder to fill; at the end its files stand in `folder`, all of them, and after an error none does."""
    storage.make_folder(folder)
    with _part(folder, ".part-") as part, _errors_name(folder, part):
        yield part
        with no_interrupt():
            _move_files(part, folder)


_SAID = [f"Software\0{MAKER}".encode(), f"<dc:title>{MAKER}</dc:title>".encode(), f"/Creator ({MAKER})".encode()]


def is_own_picture(path: Path) -> bool:
    """Does a file say that it is a picture of ours, PNG, SVG or PDF?"""
    content = path.read_bytes()
    return any(said in content for said in _SAID)


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
        aside = storage.set_aside_file(target)
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
