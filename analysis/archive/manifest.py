"""The list of an archive's files with the SHA-256 of each, as `sha256sum --check` reads it; and whether it holds.

Nothing else stands in it, so that no byte of an archive is without a witness.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from analysis.logs.files import shown_name
from device.messages import escaped
from experiments.study.folders import PlaceError

MANIFEST_FILE = "manifest-sha256.txt"
_LINE = re.compile(r"([0-9a-f]{64})  ([^\x00-\x1f\\]+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchiveFault:
    """Something wrong in an archive, a line as text; `file` is empty where it is about no one file."""

    said: str
    file: str = ""

    def __str__(self) -> str:
        return escaped(f"{shown_name(self.file)}: {self.said}" if self.file else self.said)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hashes:
    """What a manifest lists: hashes by path; its own hash, which vouches for all others; and what is wrong with it."""

    listed: Mapping[str, str]
    sha256: str
    faults: tuple[ArchiveFault, ...] = ()


def manifest_bytes(folder: Path) -> bytes:
    """The manifest of a folder, of every file but itself."""
    hashes = {path: _sha256(folder / path) for path, kind in _entries(folder) if kind == "file"}
    hashes.pop(MANIFEST_FILE, None)
    return _text(hashes).encode()


def read_manifest(folder: Path) -> Hashes:
    """The manifest of an archive. `PlaceError` if there is none to read: then the folder is no archive."""
    path = folder / MANIFEST_FILE
    if path.is_symlink() or not path.is_file():
        there = "is no plain file" if path.is_symlink() or path.exists() else "is not there"
        raise PlaceError(f"{folder}: is no archive of Recoil, or not a whole one: {MANIFEST_FILE} {there}")
    data = path.read_bytes()
    if not data.strip():
        raise PlaceError(
            f"{folder}: {MANIFEST_FILE} is empty, so nothing vouches for the other files; get a whole copy"
        )
    lines = data.decode("utf-8", "surrogateescape").split("\n")
    found = {match[2]: match[1] for line in lines if (match := _LINE.fullmatch(line))}
    wrong = [
        f"line {number}: is no hash and path, so it was changed"
        for number, line in enumerate(lines[:-1], start=1)
        if not _LINE.fullmatch(line)
    ]
    if not wrong and _text(found).encode("utf-8", "surrogateescape") != data:
        wrong = ["is not as it was written: order, a doubled path or the end differs"]
    faults = tuple(ArchiveFault(file=MANIFEST_FILE, said=said) for said in wrong)
    return Hashes(listed=found, sha256=hashlib.sha256(data).hexdigest(), faults=faults)


def faults(folder: Path, hashes: Hashes) -> Iterator[ArchiveFault]:
    """What of an archive is not what its manifest lists: missing, changed, a link, foreign."""
    there = dict(_entries(folder))
    folders = {str(parent) for path in hashes.listed for parent in Path(path).parents}
    for path in sorted({*hashes.listed, *there} - {MANIFEST_FILE}):
        kind, listed = there.get(path), hashes.listed.get(path)
        if kind == "folder" and path in folders:
            continue
        said = _fault(folder / path, kind, listed)
        if said:
            yield ArchiveFault(file=path, said=said)


def _fault(path: Path, kind: str | None, listed: str | None) -> str:
    """What is wrong with a file, a link or a folder without files; empty if nothing is."""
    if kind is None:
        return "missing: the manifest lists it"
    if kind != "file":
        return f"a {kind}, which no archive holds" if kind != "folder" else "a foreign folder: the manifest lists none"
    if listed is None:
        return "a foreign file: the manifest does not list it"
    try:
        return "" if _sha256(path) == listed else "changed: its bytes are not those that were archived"
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def _entries(folder: Path, below: str = "") -> Iterator[tuple[str, str]]:
    """Everything in a folder by its path, with what it is: file, folder, link or special file. No link is followed."""
    try:
        with os.scandir(folder / below) as found:
            entries = sorted(found, key=lambda entry: entry.name)
    except OSError as error:
        raise PlaceError(f"{shown_name(folder / below)}: cannot be read ({error.strerror})") from error
    for entry in entries:
        path = f"{below}{entry.name}"
        if entry.is_symlink():
            yield path, "link"
        elif entry.is_dir(follow_symlinks=False):
            yield path, "folder"
            yield from _entries(folder, f"{path}/")
        else:
            yield path, "file" if entry.is_file(follow_symlinks=False) else "special file"


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _text(hashes: Mapping[str, str]) -> str:
    return "".join(f"{hashes[path]}  {path}\n" for path in sorted(hashes))
