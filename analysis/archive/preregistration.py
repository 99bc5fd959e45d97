"""`recoil freeze`: a study as it is before its first run, in words and as a hash; later the amendments."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from analysis.archive.preregistration_page import Planned, page
from analysis.report.serial import as_json
from analysis.summary.planned_files import planned_files
from experiments.clock import Clock
from experiments.record import journal, storage
from experiments.record.journal import JournalError
from experiments.record.names import journals
from experiments.record.provenance import provenance
from experiments.study.folders import PlaceError, StudyFolder, open_study
from experiments.study.preregistration import (
    STUDY_FILE,
    Preregistration,
    PreregistrationError,
    carried_by,
    changes,
    files_now,
    json_file,
    missing,
    page_file,
    read_chain,
)
from experiments.study.register import check_reason


@dataclass(frozen=True, slots=True, kw_only=True)
class Frozen:
    """The preregistration that is in force now, where it lies, and whether it was written just now."""

    file: Path
    page: Path
    preregistration: Preregistration
    is_new: bool


def freeze(folder: Path, reason: str, clock: Clock) -> Frozen:
    """Write the preregistration of a study, or an amendment if something has changed since the last.

    Nothing is overwritten. `PlaceError`: no study; `ConfigError`: its files are not in order; `PreregistrationError`:
    an earlier one was edited or is missing.
    """
    study = _study(folder)
    if reason:
        check_reason(reason)
    planned, chain = _planned(study), read_chain(folder)
    if problems := [*chain.problems, *missing(chain, carried_by(journals(study.results)))]:
        raise PreregistrationError("\n".join(map(str, problems)))
    now = files_now(study.source, study.config, study.setups)
    since = () if chain.last is None else changes(chain.last.files, now)
    if chain.last is not None and not since:
        return _kept(folder, chain.last, is_new=False)
    bare = Preregistration(
        number=len(chain.every) + 1,
        written_utc=clock.utc(),
        provenance=provenance(),
        previous=None if chain.last is None else chain.last.sha256,
        reason=reason,
        changes=since,
        begun=tuple(_begun(study)),
        files={name: dict(values) for name, values in now.items()},
        words="",
    )
    found = bare.model_copy(update={"words": page(bare, planned)})
    _write_new(json_file(folder, found.number), as_json(found.record()))
    return _kept(folder, found, is_new=True)


def _study(folder: Path) -> StudyFolder:
    if not (folder / STUDY_FILE).is_file():
        raise PlaceError(f"{folder}: no study's folder (no {STUDY_FILE} in it); `recoil new STUDY` makes one")
    return open_study(folder)


def _planned(study: StudyFolder) -> Planned:
    """The study with what its further files say."""
    files = planned_files(study.source, study.config, [setup.config for setup in study.setups])
    return Planned(study=study.config, setups=study.setups, rules=files.rules, requests=files.requests)


def _begun(study: StudyFolder) -> Iterator[str]:
    """The runs of people that there are, also those that were set aside or cannot be read; practices are none."""
    for setup in study.setups:
        name = setup.config.experiment
        for path in journals(study.results, name, aside=True):
            code, aside = path.parent.name.removeprefix("sub-"), ", set aside" if ".aside-" in path.name else ""
            try:
                head = journal.head(path)
            except JournalError:
                yield f"{code} {name} (cannot be read)"
            else:
                if head is not None and head.participant == "person":
                    yield f"{code} {name}{aside}"


def _kept(folder: Path, one: Preregistration, *, is_new: bool) -> Frozen:
    """With its page, which is written where it is missing."""
    where = page_file(folder, one.number)
    if not where.exists():
        _write_new(where, one.page().encode())
    return Frozen(file=json_file(folder, one.number), page=where, preregistration=one, is_new=is_new)


def _write_new(path: Path, data: bytes) -> None:
    """A file that was not there: nothing frozen is ever written over, and half a file does not stay."""
    try:
        descriptor = storage.create(path)
    except OSError as error:
        raise PreregistrationError(f"cannot be made ({error.strerror}); nothing was frozen", at=path) from error
    try:
        with open(descriptor, "wb") as file:  # noqa: PTH123 - a descriptor has no path
            storage.write_all(file.fileno(), data)
            storage.sync(file.fileno())
    except OSError as error:
        with suppress(OSError):
            path.unlink()
        raise PreregistrationError(f"cannot be written ({error.strerror}); nothing was frozen", at=path) from error


def frozen_text(found: Frozen) -> str:
    """What was done, for a person."""
    one = found.preregistration
    if not found.is_new:
        return f"Nothing has changed since preregistration {one.number} ({one.short}): {found.page}"
    what = "Frozen" if one.previous is None else f"Amended ({len(one.changes)} changed)"
    begun = f"\nBegun before: {', '.join(one.begun)}; the report will say so" if one.begun else ""
    return (
        f"{what}: {found.page}, for people; {found.file}, for programs\nSHA-256 {one.sha256}\n"
        f"Register or publish the page; every later journal carries the hash.{begun}"
    )


def frozen_json(found: Frozen) -> dict[str, object]:
    """The same for programs."""
    one = found.preregistration
    return {
        "file": str(found.file),
        "page": str(found.page),
        "number": one.number,
        "sha256": one.sha256,
        "previous": one.previous,
        "written": found.is_new,
        "changes": [change.model_dump(mode="json") for change in one.changes],
        "begun": list(one.begun),
    }
