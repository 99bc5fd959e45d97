"""`recoil verify`: is an archive whole, and do its journals make its tables and statistics?

First every hash; only of a whole archive tables and statistics are made again from the redacted journals, byte for
byte. Made with other versions of libraries, numbers may differ by 1e-12, and each that does is named.
"""

from __future__ import annotations

import csv
import json
import math
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from analysis.archive import making, manifest
from analysis.archive.contents import CONTENTS
from analysis.archive.making import ANALYSIS, BIDS, PREREGISTRATION, RESULTS, ArchiveSettings
from analysis.archive.manifest import ArchiveFault
from analysis.logs.files import shown_name
from analysis.logs.reading import Track
from analysis.report import placing
from analysis.report.serial import as_json, written
from analysis.summary.analyze import result_files
from analysis.summary.results import STATISTICS_FILE
from device.messages import RecoilError, escaped, first_few
from experiments.record import journal, storage
from experiments.record.lines import strict_json
from experiments.record.names import shots_path
from experiments.record.provenance import recoil_version
from experiments.record.rebuild import rebuild, shots_table
from experiments.study.folders import PlaceError
from experiments.study.register import REGISTER_FILE

CLOSE = 1e-12
"""How far numbers may be from each other, in parts of the larger one or by themselves."""
_FILES = 3
"""So many files are named in the verdict."""
_NAMED = 20
"""So many numbers of a file are named."""


_LINES = written(lambda faults: [*map(str, faults)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Verified:
    """What was checked of an archive, what is wrong with it, and what there is to say otherwise.

    `manifest_sha256` vouches for all of it: whoever published it knows which archive this is. `rebuilt` are the tables
    and statistics that were made again; none if a hash is wrong already. `recoil`: what its statistics name as the
    version that made them, if they do.
    """

    archive: str
    manifest_sha256: str
    files: int
    rebuilt: int
    faults: tuple[ArchiveFault, ...] = field(metadata=_LINES)
    remarks: tuple[ArchiveFault, ...] = field(default=(), metadata=_LINES)
    recoil: str | None = None

    @property
    def whole(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults

    def as_text(self) -> str:
        """The verdict in a line."""
        shown = shown_name(self.archive)
        if self.whole:
            made = f"{self.rebuilt} tables and statistics made again from its journals are the same"
            vouches = f"sha256 of its manifest: {self.manifest_sha256}"
            return f"{shown}: whole ({self.files} files), and {made}\n{vouches}"
        if not self.rebuilt:
            return f"{shown}: {len(self.faults)} of its parts are not as they were archived"
        paths = dict.fromkeys(fault.file for fault in self.faults if not fault.file.startswith(PREREGISTRATION))
        files = [*map(shown_name, paths)]
        one = "1 file is" if len(files) == 1 else f"{len(files)} files are"
        otherwise = f"{one} not what this Recoil makes of its journals: {first_few(files, _FILES)}; {self._made_by()}"
        but = otherwise if files else "its preregistrations are not all there as they were frozen"
        return f"{shown}: every file has the hash of the manifest, but {but}"

    def _made_by(self) -> str:
        if self.recoil in (None, recoil_version()):
            return "if another state of Recoil made the archive, verify it with that one"
        return f"Recoil {self.recoil} made the archive, and this is {recoil_version()}: verify it with that one"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Made:
    """A file of an archive as it was made again; `close` where numbers of other versions may differ a little."""

    path: str
    data: bytes
    close: bool = False


def verify(folder: Path, track: Track = iter) -> Verified:
    """Check an archive. `PlaceError` if the folder is none."""
    if not folder.is_dir():
        raise PlaceError(f"{folder}: no such folder; name an archive that `recoil export archive` wrote")
    hashes = manifest.read_manifest(folder)
    faults = [*hashes.faults, *manifest.faults(folder, hashes)]
    remarks, rebuilt, recoil = list[ArchiveFault](), 0, None
    if not faults:
        with tempfile.TemporaryDirectory(prefix="recoil-verify-") as place:
            try:
                made = [*_made_again(folder, Path(place), hashes.listed, track)]
                faults, remarks = _compared(folder, hashes.listed, made)
                faults += [ArchiveFault(file=CONTENTS, said=said) for said in _contents_faults(folder)]
                faults += making.preregistration_faults(folder)
                rebuilt, recoil = len(made), _recoil_of(_versions(folder))
            except RecoilError as error:
                said = str(error).replace(f"{place}{os.sep}", f"{folder}{os.sep}")
                faults = [ArchiveFault(said=f"cannot be made again: {line}") for line in said.split("\n")]
    return Verified(
        archive=str(folder),
        manifest_sha256=hashes.sha256,
        files=len(hashes.listed),
        rebuilt=rebuilt,
        faults=tuple(faults),
        remarks=tuple(remarks),
        recoil=recoil,
    )


def _made_again(folder: Path, place: Path, listed: Mapping[str, str], track: Track) -> Iterator[_Made]:
    """Tables of runs, statistics with tables of results, and the tables of the BIDS data set.

    They are made at another place, without the archive's tables: what is wrong with one of these makes no other wrong.
    """
    settings = making.read_settings(folder)
    for path in sorted(listed):
        if _is_source(path):
            placing.write_file(place, path, (folder / path).read_bytes())
            if path.endswith(journal.ENDING):
                table, data, contents = rebuild(place / path)
                shots = {shots_path(place / path): shots_table(contents)}
                for one, made in ({table: data} | shots).items():
                    if made is not None:
                        placing.write_file(one.parent, one.name, made)
                        yield _Made(path=one.relative_to(place).as_posix(), data=made)
    yield from _results(place, settings, _versions(folder), track)
    for path, data in making.bids_files(place, settings).items():
        if path.endswith(".tsv"):
            yield _Made(path=f"{BIDS}/{path}", data=data)


def _is_source(path: str) -> bool:
    """Whether a file is one that all others are made from."""
    is_result = path.startswith(f"{RESULTS}/") and path.endswith((journal.ENDING, REGISTER_FILE))
    return is_result or path in (CONTENTS, making.RULES_FILE, making.REQUESTS_FILE)


def _results(place: Path, settings: ArchiveSettings, theirs: object, track: Track) -> Iterator[_Made]:
    """The statistics with `theirs` as versions, and the tables of results."""
    files = result_files(making.analysis_of(place, settings), track)
    ours = json.loads(files[STATISTICS_FILE])["versions"]
    other = theirs != ours
    as_theirs = as_json(json.loads(files[STATISTICS_FILE]) | {"versions": theirs})
    for path, data in (files | {STATISTICS_FILE: as_theirs}).items():
        yield _Made(path=f"{ANALYSIS}/{path}", data=data, close=other)


def _versions(folder: Path) -> object:
    """The versions that an archive's statistics were made with."""
    values = _json(folder / ANALYSIS / STATISTICS_FILE)
    return values.get("versions") if isinstance(values, dict) else None


def _recoil_of(versions: object) -> str | None:
    named = versions.get("recoil") if isinstance(versions, dict) else None
    return None if named is None else escaped(str(named))


def _json(path: Path) -> object:
    try:
        return strict_json(storage.read_whole(path))
    except (OSError, ValueError, RecursionError) as error:
        raise PlaceError(f"{path}: is no JSON file that can be read ({error})") from error


def _compared(
    folder: Path, listed: Mapping[str, str], made: Sequence[_Made]
) -> tuple[list[ArchiveFault], list[ArchiveFault]]:
    """What differs between an archive and what its journals make: what must not, and what may."""
    faults, remarks = list[ArchiveFault](), list[ArchiveFault]()
    for one in made:
        if one.path not in listed:
            faults.append(ArchiveFault(file=one.path, said="missing: its journals make it"))
        elif (folder / one.path).read_bytes() != one.data:
            found = _differences(folder / one.path, one)
            (remarks if one.close and all(close for _, close in found) else faults).extend(_named(one.path, found))
    tables = {path for path in listed if _is_made(path)} - {one.path for one in made}
    faults += [ArchiveFault(file=path, said="no journal of the archive makes it") for path in sorted(tables)]
    return faults, remarks


def _contents_faults(folder: Path) -> Iterator[str]:
    """Runs whose journal is there and which the list of runs has otherwise, and the other way round."""
    if not (folder / CONTENTS).is_file():
        yield "missing: every archive has one"
        return
    try:
        with (folder / CONTENTS).open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row.get("in_archive") != "0"]
    except (ValueError, csv.Error) as error:
        yield f"cannot be read ({error})"
        return
    listed = sorted(tuple(str(row.get(key)) for key in ("participant_id", "experiment", "state")) for row in rows)
    there = sorted(map(_as_listed, (folder / RESULTS).rglob(f"*{journal.ENDING}")))
    for run in sorted({*listed, *there}):
        if listed.count(run) != there.count(run):
            what = "a journal, and no row" if run in there else "a row, and no such journal"
            yield f"{', '.join(run)}: there is {what}"


def _as_listed(path: Path) -> tuple[str, ...]:
    """A run as its row of the list has it."""
    found = journal.read_journal(path)
    return found.plan.participant_id, found.plan.experiment, "finished" if found.finished else "not finished"


def _is_made(path: str) -> bool:
    """Whether a path is that of a table which journals make."""
    room, ending = path.partition("/")[0], path.rpartition(".")[2]
    return (room, ending) in ((RESULTS, "csv"), (ANALYSIS, "csv"), (BIDS, "tsv"))


def _named(path: str, found: Sequence[tuple[str, bool]]) -> Iterator[ArchiveFault]:
    for said, close in found[:_NAMED]:
        other = f" (less than {CLOSE:g} apart: other versions)" if close else ""
        yield ArchiveFault(file=path, said=f"{said}{other}")
    if len(found) > _NAMED:
        yield ArchiveFault(file=path, said=f"and {len(found) - _NAMED} more differences")


def _differences(path: Path, made: _Made) -> list[tuple[str, bool]]:
    """Where a file differs from what was made again, each with whether numbers are close."""
    try:
        theirs, ours = (dict(_leaves(path.suffix, data)) for data in (path.read_bytes(), made.data))
    except (ValueError, RecursionError, csv.Error) as error:
        return [(f"cannot be read ({error})", False)]
    places = dict.fromkeys([*theirs, *ours])
    found = [
        (
            f"{place} is {theirs.get(place, 'missing')} in the archive, its journals make {ours.get(place, 'none')}",
            _is_close(theirs.get(place), ours.get(place)),
        )
        for place in places
        if theirs.get(place) != ours.get(place) or place not in theirs or place not in ours
    ]
    return found or [("differs in its layout alone: blanks, ends of lines or the spelling of numbers", False)]


def _is_close(one: object, other: object) -> bool:
    try:
        return math.isclose(float(str(one)), float(str(other)), rel_tol=CLOSE, abs_tol=CLOSE)
    except ValueError:
        return False


def _leaves(suffix: str, data: bytes) -> Iterator[tuple[str, object]]:
    """Every value of a JSON file or a table, by its place."""
    if suffix == ".json":
        yield from _values(json.loads(data))
        return
    rows = csv.reader(data.decode().splitlines(), delimiter="\t" if suffix == ".tsv" else ",")
    header = next(rows, [])
    yield from ((f"column {place}", name) for place, name in enumerate(header, start=1))
    for line, row in enumerate(rows, start=2):
        names = [*header, *(f"cell {place}" for place in range(len(header) + 1, len(row) + 1))]
        yield from ((f"line {line}, {name}", cell) for name, cell in zip(names, row, strict=False))


def _values(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        for key, one in value.items():
            yield from _values(one, f"{place}.{key}".lstrip("."))
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield from _values(one, f"{place}[{number}]")
    else:
        yield place, value
