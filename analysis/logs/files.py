"""The log files in folders, the study each belongs to under a short name, and their unedited content."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

from device.messages import RecoilError, escaped, first_few
from experiments.record import storage, tables
from experiments.record.names import is_practice

ARCHIVE_FILE = "archive.json"
"""What a folder that is an archive has, beside the results in it."""
ENDINGS = tuple(f"_{suffix}.csv" for suffix in tables.FILE_SUFFIX.values())
_CODE = re.compile(r"sub-([^_]+)_")
_TASK = re.compile(r"_task-([a-z]+)_[^/\\]*$")
FULL_ONSET = re.compile(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z")
"""An onset to the µs: no two runs have all the same."""


class BadLogError(RecoilError):
    """A log that breaks a rule: what, and where. It never leaves the room.

    `experiment`: of which it is, where its name says another.
    """

    def __init__(
        self, message: str, line: int | None = None, column: str | None = None, *, experiment: str = ""
    ) -> None:
        super().__init__(message)
        self.message, self.line, self.column, self.experiment = str(self), line, column, experiment

    def of(self, file: Path, participant: str, experiment: str, study: str) -> Problem:
        """The same as it leaves the room: in which file, whose log it was, of which experiment by its name."""
        return Problem(
            file=file,
            line=self.line,
            column=self.column,
            message=self.message,
            participant=participant,
            experiment=self.experiment or experiment,
            study=study,
        )


_NO_FILE = "a link that leads to no file; fetch what it stands for (`git annex get`, `datalad get`), or delete it"
_LIKE_A_LOG = re.compile(r"sub-[^_]+_task-[^_]+_(trials|ratings)(?!\.aside-[0-9]+\.[a-z]+$).*\.csv", re.IGNORECASE)
_RENAMED = (
    "not read for its name, which is that of a copy (rule: sub-CODE_task-EXPERIMENT_trials.csv or _ratings.csv, and "
    "_journal.jsonl beside it); if it is somebody's only log, give it that name, else delete it"
)
_LIKE_A_FOLDER = re.compile(r"sub-[^_.]+(\.(zip|gz|tgz|tar|rar|7z))?", re.IGNORECASE)
_LACKING = "put back what is missing, unpacked if it was packed, or delete this"
_FEW = 3
_RULE = re.compile(r"\(rule: ((?:[^()]|\([^()]*\))*|.*)\)")
"""What stands in brackets that are closed behind it, with brackets of its own; of a pattern with more of these, all."""
_LINKED = "a link to a folder, and linked folders are not read, so nobody is read twice; put the folder itself here"


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A file, or somebody's part of it, that was left out or needs a word: the place, and why.

    `participant`, `experiment`, `study` (its folder or name) and whose `data` as far as they are known; a person is
    named where the file's name does not.
    """

    file: Path
    line: int | None
    column: str | None
    message: str
    participant: str = ""
    experiment: str = ""
    study: str = ""
    data: tables.DataKind | None = None

    @property
    def rule(self) -> str:
        """The rule that was broken, as the message has it; empty if it names none."""
        found = _RULE.search(self.message)
        return found[1] if found else ""

    def __str__(self) -> str:
        named = not self.participant or code_in_name(f"{self.file}_") == self.participant
        who = "" if named else f"participant {self.participant} of "
        line = "" if self.line is None else f", line {self.line}"
        column = "" if self.column is None else f", column {self.column}"
        return f"{who}{shown_name(self.file)}{line}{column}: {self.message}"


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundFiles:
    """Logs and journals by their paths, each with the folder that stands for its study; and what cannot be read."""

    logs: Mapping[str, str]
    journals: Mapping[str, str]
    problems: tuple[Problem, ...]
    given: Mapping[str, int]
    """For each the place, among the paths that were given, of the first that holds it."""


def find_logs(paths: Sequence[Path], endings: tuple[str, ...] = ENDINGS) -> FoundFiles:
    """The files in `paths`, each once, with the folder that stands for its study; files in folders by their endings.

    Logs of practices are left out; journals are all there. All comes in the order of real paths, whatever the order of
    `paths`.
    """
    found: dict[str, tuple[str, str]] = {}
    given: dict[str, int] = {}
    places = {path: place for place, path in reversed([*enumerate(paths)])}
    problems: list[Problem] = []
    for path in sorted(set(paths), key=lambda path: (_real(path), str(path))):
        logs = _in_folder(path, (*endings, _JOURNALS), problems) if path.is_dir() else {_real(path): str(path)}
        if not any(map(_is_counted, logs.values())) or not path.exists():
            kinds = " or ".join(f"*{ending}" for ending in endings)
            there = "is a practice, or no log" if path.exists() else "no such file or folder"
            reason = f"no {kinds} in this folder" if path.is_dir() else there
            problems.append(Problem(file=path, line=None, column=None, message=reason))
            continue
        top = _real(path if path.is_dir() else path.parent)
        for real, log in logs.items():
            there, _ = found.setdefault(real, (log, _study(real, top)))
            given[there] = min(places[path], given.get(there, len(paths)))
    in_order = [found[real] for real in sorted(found, key=_by_parts)]
    journals = {log: study for log, study in in_order if _is_journal(log)}
    logs_found = {log: study for log, study in in_order if log not in journals and _is_counted(log)}
    return FoundFiles(logs=logs_found, journals=journals, problems=tuple(problems), given=given)


_JOURNALS = ".jsonl"
_JOURNAL = re.compile(r"_journal(\.aside-[0-9]+)?\.jsonl$")


def _is_journal(path: str) -> bool:
    return path.endswith(_JOURNALS) and _JOURNAL.search(path) is not None


def _is_counted(path: str) -> bool:
    """Whether a file may hold data: a practice holds none, nor does a register."""
    name = _name(path)
    return not is_practice(name) and (not name.lower().endswith(_JOURNALS) or _is_journal(name.lower()))


def _real(path: Path) -> str:
    return os.path.realpath(path)


def names_below(files: Iterable[Path]) -> dict[Path, Path]:
    """Files by their path below the folder that holds them all: results say nothing of the machine they come from."""
    every = [*files]
    root = folder_above(every)
    return {file: name_below(file, root) for file in every}


def folder_above(files: Iterable[Path]) -> str:
    """The folder that holds all of the files, empty if there are none."""
    folders = {_whole(file).rpartition(os.sep)[0] for file in files}
    return common_folder(folders) if folders else ""


def common_folder(paths: Collection[str]) -> str:
    """The folder that holds all of some paths; empty where none does, as of two drives on Windows."""
    try:
        return os.path.commonpath(paths)
    except ValueError:
        return ""


def name_below(file: Path, root: str) -> Path:
    """A file's path below a folder above it."""
    return Path(_whole(file)[len(root) :].lstrip(os.sep))


def _whole(file: Path) -> str:
    """A file's whole path, as text: of many thousands quicker than as paths."""
    return str(file if file.is_absolute() else file.absolute())


def below(problem: Problem, shown: Path) -> str:
    """A problem with its file's folder as it is shown: its remedy names the journal there as well."""
    text, instead = str(problem), "" if shown == Path() else f"{shown_name(shown.as_posix())}/"
    for folder in (problem.file.parent.absolute(), problem.file.parent):
        text = text.replace(f"{shown_name(folder)}{os.sep}", instead) if folder != Path() else text
    return text


def _name(path: str) -> str:
    return path.rpartition(os.sep)[2]


def results_above(path: str) -> str:
    """The folder that holds a log's own, empty where the path does not say.

    >>> results_above("results/sub-P01/sub-P01_task-direction_trials.csv")
    'results'
    """
    return path.rpartition(os.sep)[0].rpartition(os.sep)[0]


def seen_from(path: str, beside: str) -> str:
    """A file as it is seen from another one: below the folder that holds both, so no path says on which machine.

    >>> seen_from("lab/results/sub-P01/log.csv", "lab/copy/sub-P01/log.csv")
    'results/sub-P01/log.csv'
    """
    folder = common_folder([str(Path(one).absolute().parent) for one in (path, beside)])
    return os.path.relpath(path, folder) if folder else path


def _study(real: str, top: str) -> str:
    """The results folder that holds the file's `sub-<ID>` folder; without one, the folder that was asked for."""
    results, _, name = real.rpartition(os.sep)[0].rpartition(os.sep)
    return results or os.sep if name.startswith("sub-") else top


def _in_folder(folder: Path, endings: tuple[str, ...], problems: list[Problem]) -> dict[str, str]:
    """The files below a folder by their real paths, in the order of their paths.

    Linked folders are not entered; a participant's is named, and so is one without a log.
    """
    logs: list[tuple[str, str]] = []
    folders: list[str] = []
    waiting = [(str(folder), os.path.realpath(folder))]
    while waiting:
        place, real = waiting.pop()
        folders.append(place)
        try:
            with os.scandir(place) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        waiting.append((entry.path, f"{real}{os.sep}{entry.name}"))
                    elif why := _why_not_read(entry, endings):
                        problems.append(_not_read(entry.path, why))
                    elif entry.name.endswith(endings):
                        target = os.path.realpath(entry.path) if entry.is_symlink() else f"{real}{os.sep}{entry.name}"
                        logs.append((entry.path, target))
        except OSError as error:
            reason = f"cannot be read: {error.strerror or error}"
            problems.append(Problem(file=Path(place), line=None, column=None, message=reason))
    problems += _without_a_log(folders[1:], [*(path for path, _ in logs), *(f"{one.file}{os.sep}" for one in problems)])
    found: dict[str, str] = {}
    for path, real in sorted(logs, key=lambda log: _by_parts(log[0])):
        found.setdefault(real, path)
    return found


def _without_a_log(folders: Iterable[str], files: Iterable[str]) -> Iterator[Problem]:
    """What is said of the participants' folders that hold none of the files, and no folder, as those of BIDS do."""
    held = set[str]()
    for file in files:
        folder = file.rpartition(os.sep)[0]
        while folder and folder not in held:
            held.add(folder)
            folder = folder.rpartition(os.sep)[0]
    for folder in (one for one in folders if one not in held and _name(one).startswith("sub-")):
        children = sorted(Path(folder).iterdir())
        if not any(path.is_dir() for path in children):
            there = first_few([path.name for path in children], _FEW) or "nothing"
            yield _not_read(folder, f"a participant's folder without a log or a journal; in it: {there}; {_LACKING}")


def _by_parts(path: str) -> str:
    """Paths in the order of their parts, as no part holds a null."""
    return path.replace(os.sep, "\0")


def _why_not_read(entry: os.DirEntry[str], endings: tuple[str, ...]) -> str:
    """Why a link that looks like a log or a participant's folder is not read; empty if nothing is wrong."""
    if entry.name.endswith(endings):
        return "" if entry.is_file() else _NO_FILE if entry.is_symlink() else storage.NO_FILE
    if _LIKE_A_LOG.fullmatch(entry.name) and _is_counted(entry.name):
        return _RENAMED
    if _LIKE_A_FOLDER.fullmatch(entry.name) and entry.is_file():
        return f"a file where a participant's folder belongs; {_LACKING}"
    return _LINKED if entry.name.startswith("sub-") and entry.is_dir() else ""


def _not_read(path: str, why: str) -> Problem:
    folder, _, name = path.rpartition(os.sep)
    real = os.path.realpath(folder)
    study = _study(f"{real}{os.sep}{name}", real)
    code = code_in_name(f"{Path(path).stem}_") or ""
    return BadLogError(why).of(Path(path), code, experiment_in_name(path), study)


def code_in_name(path: str) -> str | None:
    """The participant's code in a file's name, if there is one.

    >>> code_in_name("results/sub-P01/sub-P01_task-direction_trials.csv"), code_in_name("log.csv")
    ('P01', None)
    """
    match = _CODE.match(_name(path))
    return match[1] if match else None


def experiment_in_name(path: str) -> str:
    """The experiment in a file's name, empty if there is none.

    >>> experiment_in_name("results/sub-P01/sub-P01_task-direction_trials.csv")
    'direction'
    """
    found = _TASK.search(path)
    return found[1] if found else ""


def check_name(path: str, experiment: str) -> None:
    """`BadLogError` for a table of an experiment that is named for another."""
    named = experiment_in_name(path)
    if named not in ("", experiment):
        own = _name(path).replace(f"_task-{named}_", f"_task-{experiment}_")
        raise BadLogError(
            f"is a table of {experiment!r}, named for {named!r}; was it renamed? (rule: a table is called as its run, "
            f"{own}); give it its name back, and its journal too",
            experiment=experiment,
        )


LONGEST_LOG, LONGEST_MAPPED = 100_000, 400_000
"""Of a participant's log, ten times what a design may ask of a participant; and of a file that a map reads."""


def check_length(content: bytes, most: int = LONGEST_LOG) -> None:
    """`BadLogError` for a file of more lines than are analysed while somebody waits."""
    if len(content) > most and content.count(b"\n") > most + 1:
        raise BadLogError(f"has more than {most:,} rows (rule: at most so many in a file)")


def read_content(path: str) -> bytes:
    """A file's bytes; `BadLogError` if it cannot be read."""
    try:
        return storage.read_whole(path)
    except OSError as error:
        raise BadLogError(f"cannot be read: {error.strerror or error}") from error


def study_names(folders: Iterable[str]) -> dict[str, str]:
    """Short names for studies' folders: what tells them apart, from the first differing part on; else the last part.

    >>> study_names(["/data/kyoto/results", "/data/oslo/results"])
    {'/data/kyoto/results': 'kyoto', '/data/oslo/results': 'oslo'}
    >>> study_names(["/data/kyoto"])
    {'/data/kyoto': 'kyoto'}
    """
    ways = {folder: PurePath(shown_name(folder)).parts for folder in sorted(folders)}
    shared = _shared(list(ways.values()))
    tails = [way[shared:][::-1] for way in ways.values()]
    behind = _shared(tails)
    ends = {folder: way[shared : len(way) - behind] for folder, way in ways.items()}
    if len(ways) > 1 and all(ends.values()):
        return {folder: "/".join(end) for folder, end in ends.items()}
    return {folder: "/".join(way[shared - 1 :]) for folder, way in ways.items()} if ways else {}


def shown_name(path: str | PurePath) -> str:
    r"""A path on one line of text, whatever bytes it is made of: no UTF-8, control characters and breaks are escaped.

    >>> shown_name("caf\udce9/results"), shown_name("a\nb")
    ('caf\\xe9/results', 'a\\nb')
    """
    return escaped(os.fsencode(path).decode("utf-8", "backslashreplace"))


def _shared(ways: list[tuple[str, ...]]) -> int:
    """How many parts all begin with."""
    return next(
        (n for n, parts in enumerate(zip(*ways, strict=False)) if len(set(parts)) > 1), min(map(len, ways), default=0)
    )
