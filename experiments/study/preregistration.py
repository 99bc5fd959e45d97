"""What a study had set before its first run, word by word and hashed, and what has become of it since.

`recoil freeze` writes `preregistration-1.json` beside `study.toml`: every file of the study as it was read, and the
words for people. Its hash is over all of it. It is never written again: what changes later is an amendment,
`preregistration-2.json`, which names the hash of the one before. The journal of every later run names the last.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from pydantic import JsonValue, ValidationError

from device.messages import RecoilError
from experiments.clock import date_text
from experiments.config.door import ConfigError, Model, StudyConfig, read_toml
from experiments.config.setup import GunConfig, Setup, sha256
from experiments.design.config import DesignConfig
from experiments.record import storage
from experiments.record.lines import strict_json
from experiments.study.changes import (
    Files,
    FileValues,
    KeyChange,
    changed_keys,
    setup_changes,
    table_in,
    without_reasons,
)

STUDY_FILE = "study.toml"
_NAME = re.compile(r"preregistration-([1-9][0-9]{0,5})\.(json|md)")
_RESTORE = "put the original back, from a copy"
SHORT = 12
"""So many digits of a hash are enough for people."""


class PreregistrationError(RecoilError):
    """A preregistration that cannot be written, or trusted: what is so `at` a file or folder, and what mends it."""

    def __init__(self, said: str, *, at: Path | str = "", mend: str = "") -> None:
        super().__init__("; ".join(filter(None, [f"{at}: {said}" if at else said, mend])))
        self.said, self.at = said, at


class Preregistration(Model):
    """What was set before the first run, or amended later.

    `begun`: the runs of people that had begun when it was written; `previous`: the hash of the one that it amends,
    `changes` what differs from that, `reason` why. `files` are the study's, `words` all of it for people.
    """

    format: Literal[1] = 1
    number: int
    written_utc: str
    provenance: dict[str, str]
    previous: str | None = None
    reason: str = ""
    changes: tuple[KeyChange, ...] = ()
    begun: tuple[str, ...] = ()
    files: dict[str, dict[str, JsonValue]]
    words: str

    @property
    def sha256(self) -> str:
        """The hash that every later journal names."""
        return sha256(self.model_dump(mode="json"))

    @property
    def short(self) -> str:
        """The beginning of the hash, which is enough for people."""
        return self.sha256[:SHORT]

    @property
    def title(self) -> str:
        """What it is called."""
        return f"preregistration {self.number} of {date_text(self.written_utc)} ({self.short})"

    @property
    def study(self) -> StudyConfig:
        """The study as it was frozen."""
        return StudyConfig.model_validate_json(json.dumps(self.files[STUDY_FILE]), extra="ignore")

    @property
    def designs(self) -> dict[str, str]:
        """The names of the experiments' designs by their files."""
        files = [_place(file) for file in self.study.experiments]
        return {file: str(self.files[file].get("design")) for file in files if file in self.files}

    def record(self) -> dict[str, JsonValue]:
        """What its file holds."""
        return {**self.model_dump(mode="json"), "sha256": self.sha256}

    def page(self) -> str:
        """Its words as a page of their own, with the hash."""
        return f"{self.words}\nSHA-256 of this preregistration: `{self.sha256}`\n"


# what a study is now


def files_now(source: Path, study: StudyConfig, setups: Sequence[Setup[DesignConfig]]) -> Files:
    """The files of a study as they are: study, designs and guns with all their defaults, the others as written."""
    own = study.preregistration
    named = [one for one in (study.paper, own.rules, own.requests, own.codebook) if one is not None]
    return {
        STUDY_FILE: study.model_dump(mode="json"),
        **{
            file: values
            for name, setup in zip(study.experiments, setups, strict=True)
            for file, values in _files_of(_place(name), setup).items()
        },
        **{name: as_frozen(path) for name in named if (path := source.parent / name).exists()},
    }


def as_frozen(path: Path) -> FileValues:
    """The values of a file of rules, tests, codes or published numbers, without why people are excluded by code.

    What is frozen is published, and its hash lets nothing be taken out of it later.
    """
    return without_reasons(read_toml(path))


def _files_of(file: str, setup: Setup[DesignConfig]) -> Files:
    record, gun = setup.record(), _beside(file, setup.config.gun)
    return {file: table_in(record, "experiment"), gun: table_in(record, "gun")}


def _place(file: str | Path) -> str:
    """A file as configs name it: beside the study, or elsewhere, on Windows on another drive too."""
    return Path(os.path.normpath(file)).as_posix()


def _beside(file: str, named: str) -> str:
    """A file that another one names."""
    return _place(Path(file).parent / named)


def changes(frozen: Files, now: Files) -> tuple[KeyChange, ...]:
    """Every file that is new or gone, and of the others every key that differs; a default spelled out is the same."""
    names = now[STUDY_FILE].get("experiments")
    designs = [_place(str(name)) for name in names] if isinstance(names, list) else []
    guns = [_beside(file, str(now[file].get("gun"))) for file in designs]
    models: dict[str, type[Model]] = {STUDY_FILE: StudyConfig}
    models |= {**dict.fromkeys(guns, GunConfig), **dict.fromkeys(designs, DesignConfig)}
    return tuple(
        change
        for file in dict.fromkeys([*frozen, *now])
        for change in _changes_of_file(file, frozen, now, models.get(file))
    )


def _changes_of_file(file: str, frozen: Files, now: Files, model: type[Model] | None) -> Iterator[KeyChange]:
    if file in frozen and file in now:
        yield from changed_keys(file, frozen[file], now[file], model)
    else:
        yield KeyChange(file=file, key="removed" if file in frozen else "added", frozen=None, now=None)


def changes_of_run(frozen: Preregistration, setup: object) -> tuple[KeyChange, ...]:
    """What a run's setup has otherwise than it was frozen; `setup` is the record of it, as in the journal's head."""
    design = table_in(setup, "experiment").get("design")
    file = design_file(frozen, str(design))
    if file is None:
        names = frozen.files[STUDY_FILE].get("experiments")
        return (KeyChange(file=STUDY_FILE, key="experiments", frozen=names, now=design),)
    of_gun = gun_file(frozen, file)
    own = {"experiment": frozen.files[file], "gun": frozen.files.get(of_gun, {})}
    return tuple(setup_changes(own, setup, (file, of_gun)))


def design_file(frozen: Preregistration, design: str) -> str | None:
    """The file of the study that holds a design of this name; `None`: none was frozen."""
    return next((file for file, name in frozen.designs.items() if name == design), None)


def gun_file(frozen: Preregistration, file: str) -> str:
    """The file of the gun that a frozen design names."""
    return _beside(file, str(frozen.files[file].get("gun")))


# reading what was frozen


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """The preregistrations of a folder that can be trusted, in their order, and what is wrong with the others."""

    folder: Path
    every: tuple[Preregistration, ...] = ()
    problems: tuple[PreregistrationError, ...] = ()

    @property
    def last(self) -> Preregistration | None:
        """The one in force."""
        return self.every[-1] if self.every else None

    def by_hash(self, wanted: str) -> Preregistration | None:
        """The one that a journal names."""
        return next((one for one in self.every if one.sha256 == wanted), None)


def json_file(folder: Path, number: int) -> Path:
    """The file of a preregistration."""
    return folder / f"preregistration-{number}.json"


def page_file(folder: Path, number: int) -> Path:
    """The page of a preregistration, for people."""
    return folder / f"preregistration-{number}.md"


def numbers_there(folder: Path) -> list[int]:
    """The numbers of the preregistrations of a folder, also of those that were edited, or have a page alone."""
    names = (_NAME.fullmatch(path.name) for path in folder.glob("preregistration-*"))
    return sorted({int(found[1]) for found in names if found})


def read_chain(folder: Path) -> Chain:
    """The preregistrations beside a study; none is no problem."""
    every, problems, there = list[Preregistration](), list[PreregistrationError](), numbers_there(folder)
    for number in sorted({*there, *(number - 1 for number in there if number > 1)}):
        try:
            one = _read(json_file(folder, number), number)
            problems += _broken_links(folder, every, one)
            every.append(one)
            problems += _edited_page(page_file(folder, number), one)
        except PreregistrationError as error:
            problems.append(error)
    return Chain(folder=folder, every=tuple(every), problems=tuple(problems))


def _broken_links(
    folder: Path, before: Sequence[Preregistration], one: Preregistration
) -> Iterator[PreregistrationError]:
    earlier = before[-1] if before and before[-1].number == one.number - 1 else None
    if earlier is not None and one.previous != earlier.sha256:
        said = (
            f"is not the preregistration that {json_file(folder, one.number).name} amends "
            f"({str(one.previous)[:SHORT]}, not {earlier.short})"
        )
        yield PreregistrationError(said, at=json_file(folder, earlier.number), mend=f"it was replaced: {_RESTORE}")


def _edited_page(path: Path, one: Preregistration) -> Iterator[PreregistrationError]:
    """A page that is not there says nothing: the words stand in the other file too."""
    try:
        there = storage.read_whole(path).decode().replace("\r\n", "\n")
    except FileNotFoundError:
        return
    except (OSError, UnicodeDecodeError) as error:
        there = str(error)
    if there != one.page():
        said = f"was edited: it is not the page of {json_file(path.parent, one.number).name}"
        yield PreregistrationError(said, at=path, mend=f"delete it, and `recoil freeze {path.parent}` writes it again")


def _read(path: Path, number: int) -> Preregistration:
    """One that can be trusted. `PreregistrationError`: it is missing, or was edited."""
    try:
        found = strict_json(storage.read_whole(path), pairs=_once)
        if not isinstance(found, dict):
            raise ValueError("it is no JSON object")
        stated = found.pop("sha256", None)
        one = Preregistration.model_validate_json(json.dumps(found))
        if STUDY_FILE in one.files:
            StudyConfig.model_validate_json(json.dumps(one.files[STUDY_FILE]), extra="ignore")
    except FileNotFoundError as error:
        said = "is missing, though its page or a later one is not"
        raise PreregistrationError(said, at=path, mend=_RESTORE) from error
    except OSError as error:
        raise PreregistrationError(f"cannot be read ({error.strerror})", at=path) from error
    except (ValueError, RecursionError) as error:
        why = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        said = f"was edited, or is of another version of Recoil ({why})"
        raise PreregistrationError(said, at=path, mend=_RESTORE) from error
    if one.sha256 == stated and one.number != number:
        said = f"was renamed: it is preregistration {one.number}"
        raise PreregistrationError(said, at=path, mend="give it its name back")
    if one.sha256 != stated or STUDY_FILE not in one.files:
        said = f"was edited: its content has the hash {one.short}, and it says {str(stated)[:SHORT]}"
        meant = f"A change that is meant goes into the configs; `recoil freeze {path.parent}` then writes an amendment"
        raise PreregistrationError(said, at=path, mend=f"{_RESTORE}. {meant}")
    return one


def _once(pairs: Sequence[tuple[str, JsonValue]]) -> dict[str, JsonValue]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key stands there twice")
    return found


# how a study stands


@dataclass(frozen=True, slots=True, kw_only=True)
class FreezeStatus:
    """Whether a study is frozen, what has changed since, and what is wrong with what was frozen.

    `missing`: what is not there, or cannot be read, so that something cannot be compared.
    """

    chain: Chain
    changes: tuple[KeyChange, ...] = ()
    missing: tuple[str, ...] = ()

    @property
    def problems(self) -> tuple[str, ...]:
        """What was edited, or is missing."""
        return (*map(str, self.chain.problems), *self.missing)

    def of_files(self, names: Collection[str]) -> FreezeStatus:
        """The same of some files alone."""
        return replace(self, changes=tuple(change for change in self.changes if change.file in names))

    def record(self) -> dict[str, object] | None:
        """The preregistration in force, and what has changed since, as plain values; `None` where there is none."""
        last = self.chain.last
        if last is None:
            return None
        return {
            "number": last.number,
            "sha256": last.sha256,
            "written_utc": last.written_utc,
            "changes": [change.model_dump(mode="json") for change in self.changes],
        }

    def lines(self) -> tuple[str, ...]:
        """What there is to say: under which preregistration, and every key or file that has changed since."""
        last = self.chain.last
        if last is None:
            return ()
        if not self.changes:
            return (f"Frozen by {last.title}: nothing has changed since",)
        many = "1 key or file has" if len(self.changes) == 1 else f"{len(self.changes)} keys or files have"
        since = f"{many} changed since; `recoil freeze {self.chain.folder}` writes an amendment"
        return f"Frozen by {last.title}: {since}", *(f"  {change}" for change in self.changes)


def study_folder(results: Path, source: Path) -> Path:
    """The folder of the study that a run belongs to: that of its results, else that of its config."""
    beside = Path(os.path.normpath(results / ".."))
    own = (beside / STUDY_FILE).is_file() or numbers_there(beside)
    return beside if own else source.parent


def status_beside(folder: Path, now: Callable[[], Files], carried: Iterable[tuple[str, str]] = ()) -> FreezeStatus:
    """How a study stands. `now` reads its files, if something was frozen; `carried`: whose journal names which hash."""
    chain = read_chain(folder)
    gone = tuple(map(str, missing(chain, carried)))
    if chain.last is None:
        return FreezeStatus(chain=chain, missing=gone)
    try:
        return FreezeStatus(chain=chain, changes=changes(chain.last.files, now()), missing=gone)
    except ConfigError as error:
        return FreezeStatus(chain=chain, missing=(*gone, *str(error).splitlines()))


def missing(chain: Chain, carried: Iterable[tuple[str, str]]) -> Iterator[PreregistrationError]:
    """One for each preregistration that journals name, and that is not there. `carried`: code and hash."""
    whose: dict[str, dict[str, None]] = {}
    for code, named in carried:
        if named and chain.by_hash(named) is None:
            whose.setdefault(named, {})[code] = None
    for named, codes in whose.items():
        said = (
            f"there is no preregistration {named[:SHORT]} that can be trusted, which the journals of "
            f"{', '.join(codes)} name"
        )
        mend = "put its file preregistration-N.json back there, from a copy"
        yield PreregistrationError(said, at=chain.folder, mend=mend)


def carried_by(paths: Iterable[Path]) -> Iterator[tuple[str, str]]:
    """The code and the hash that each journal names; who names none, or cannot be read, is left out."""
    from experiments.record import journal  # noqa: PLC0415 - of use where there are journals alone

    for path in sorted(paths):
        try:
            head = journal.head(path)
        except journal.JournalError:
            continue
        if head is not None and head.preregistration_sha256:
            yield head.plan.participant_id, head.preregistration_sha256


def in_force(folder: Path) -> str:
    """The hash that the journal of a run names that begins now; empty where nothing was frozen."""
    last = read_chain(folder).last
    return "" if last is None else last.sha256


def run_warnings(setup: Setup[DesignConfig], results: Path, journals: Iterable[Path]) -> Iterator[str]:
    """What there is to say before a run of a frozen study: what was edited or is missing, and what has changed."""
    folder = study_folder(results, setup.source)
    chain = read_chain(folder)
    yield from map(str, (*chain.problems, *missing(chain, carried_by(journals))))
    if chain.last is not None and (found := changes_of_run(chain.last, setup.record())):
        yield (
            f"{setup.source}: is not as in {chain.last.title}; the run goes on, and the report will list what differs; "
            f"`recoil freeze {folder}` writes an amendment"
        )
        yield from map(str, found)
