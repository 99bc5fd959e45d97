"""`recoil export archive`: one folder to publish, whose tables and statistics are made from redacted journals."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from analysis.archive import bids_export, contents, datapackage, manifest, pages, redaction
from analysis.archive.contents import CONTENTS, Entry, EntryState
from analysis.archive.datapackage import Resource
from analysis.archive.making import (
    ANALYSIS,
    BIDS,
    PREREGISTRATION,
    REQUESTS_FILE,
    RESULTS,
    RULES_FILE,
    ArchiveSettings,
    analysis_of,
    bids_files,
    preregistration_faults,
)
from analysis.archive.pages import CITATION, ArchivedDesign
from analysis.logs.exclusion_rules import Rules
from analysis.logs.files import ARCHIVE_FILE, BadLogError, Problem, code_in_name, experiment_in_name
from analysis.logs.journals import journal_of
from analysis.logs.reading import Logs, Track, read_logs, refuse_nothing
from analysis.logs.setups import setup_differences
from analysis.report import placing
from analysis.report.section import Section
from analysis.report.serial import as_json
from analysis.report.terminal import Progress, unseen
from analysis.summary.analyze import analyze
from analysis.summary.requests import Requests
from experiments.config.door import checked_table, load, read_text
from experiments.config.setup import GunConfig
from experiments.record import design_columns, journal
from experiments.record.dictionary import design_dictionary, shots_dictionary
from experiments.record.head_design import began_with
from experiments.record.journal import Contents, JournalError
from experiments.record.names import shots_path
from experiments.record.provenance import recoil_version
from experiments.record.rebuild import rebuild, shots_table
from experiments.record.shots_table import SHOTS
from experiments.record.tables import DataKind
from experiments.study.changes import Files, setup_key
from experiments.study.folders import PlaceError
from experiments.study.register import REGISTER_FILE
from experiments.study.study import Member


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchiveRequest:
    """The folder that holds a study's logs, where the archive goes, and what is to be in it.

    Without `out` that is beside the study. `rules` and `requests` are the files that the analysis of the paper was made
    with.
    """

    folder: Path
    out: Path | None = None
    free_text: bool = False
    include_synthetic: bool = False
    rules: Path | None = None
    requests: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Archived:
    """Where an archive lies, the hash of its manifest, which vouches for all of it, and what there is to say."""

    out: str
    manifest_sha256: str
    files: int
    participants: int
    runs: int
    left_out: tuple[str, ...]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """A run to archive: its journal and whose data it holds."""

    path: Path
    data: bytes = field(repr=False)
    contents: Contents = field(repr=False)
    kind: DataKind

    @property
    def code(self) -> str:
        return self.contents.plan.participant_id


def export_archive(request: ArchiveRequest, track: Track = iter, progress: Progress = unseen) -> Archived:
    """Write the archive of a study. Whoever looks sees no archive, or the whole.

    `PlaceError` if no log is usable, if something is in the archive's place, or if that lies within the study;
    `RegisterError` if the register cannot be trusted; `ConfigError` for a file that was given.
    """
    target = _free_target(request)
    for model, file in ((Rules, request.rules), (Requests, request.requests)):
        if file is not None:
            load(model, file)
    logs = read_logs([request.folder], track, include_synthetic=request.include_synthetic)
    refuse_nothing([request.folder], logs)
    results = bids_export.results_of(request.folder, logs)
    members, title = bids_export.members_of(results), bids_export.name_of(results)
    runs, unproven = _runs(logs)
    if not runs:
        reasons = map(str, (*logs.problems, *unproven))
        raise PlaceError("\n".join([f"{request.folder}: no run has a journal that proves its table", *reasons]))
    settings = ArchiveSettings(title=title, free_text=request.free_text, include_synthetic=request.include_synthetic)
    given = _citation([request.folder, results, results.parent])
    entries = [*_entries(runs), *contents.left_out_entries(logs, members, unproven)]
    with placing.in_place(target, lambda: _free_target(request)) as part:
        _write_results(part, runs, members, free_text=request.free_text)
        placing.write_file(part, CONTENTS, contents.contents_table(entries))
        _write_analysis(part, request, settings, pages.contents_section(entries), progress)
        _write_bids(part, request, settings, results)
        _write_pages(part, settings, entries, _designs(runs))
        placing.write_file(part, CITATION, given or pages.citation(title, recoil_version()))
        for frozen in _preregistrations([request.folder, results.parent]):
            placing.write_file(part, f"{PREREGISTRATION}/{frozen.name}", frozen.read_bytes())
        untrusted = [
            f"{fault}; mend it in the study's folder, and export again" for fault in preregistration_faults(part)
        ]
        _write_package(part, title, runs)
        files = manifest.manifest_bytes(part)
        placing.write_file(part, manifest.MANIFEST_FILE, files)
    return Archived(
        out=str(request.out or target),
        manifest_sha256=manifest.read_manifest(target).sha256,
        files=files.count(b"\n"),
        participants=len({run.code for run in runs}),
        runs=len(runs),
        left_out=tuple(map(str, (*logs.problems, *unproven))),
        remarks=(*map(str, logs.remarks), *map(str, logs.begun), *untrusted),
    )


def _free_target(request: ArchiveRequest) -> Path:
    """Where the archive goes. `PlaceError`: something is there, or it would be read as a part of the study."""
    if not request.folder.is_dir():
        raise PlaceError(f"{request.folder}: no such folder; name the folder that holds the logs")
    here = request.folder.resolve()
    study = here.parent if (here.parent / "study.toml").is_file() else here
    shown = request.out or study.with_name(f"{study.name}-archive")
    target = Path(os.path.realpath(shown))  # which a loop of links does not stop
    if target.is_relative_to(study):
        raise PlaceError(f"{shown}: lies in {study}, whose logs would then be read twice; choose an --out beside it")
    if within := [one for one in target.parents if (one / manifest.MANIFEST_FILE).exists()]:
        raise PlaceError(
            f"{shown}: lies in the archive {within[0]}, which would be whole no more; choose another --out"
        )
    if not placing.is_free(target):
        raise PlaceError(f"{shown}: is there already, and no archive is overwritten; move it away, or choose an --out")
    return target


def _runs(logs: Logs) -> tuple[list[_Run], list[Problem]]:
    """The runs whose logs are used, by their journals; and the logs that no journal proves."""
    runs, unproven = list[_Run](), list[Problem]()
    for part in (logs, *logs.apart):
        for file in part.files:
            path = Path(journal_of(str(file)))
            code, experiment = code_in_name(file.name) or "", experiment_in_name(file.name)
            try:
                data = journal.journal_bytes(path)
                found = journal.contents_of(path, data)
            except JournalError as error:
                said = f"no journal proves this log, so it cannot be archived: {error}"
                unproven.append(BadLogError(said).of(file, code, experiment, ""))
                continue
            if found is None:
                unproven.append(BadLogError("its journal holds no whole record").of(file, code, experiment, ""))
            else:
                kind: DataKind = "synthetic" if found.head.participant == "synthetic" else part.kind
                runs.append(_Run(path=path, data=data, contents=found, kind=kind))
    return runs, unproven


def _entries(runs: Iterable[_Run]) -> Iterator[Entry]:
    for run in runs:
        plan = run.contents.plan
        state: EntryState = "finished" if run.contents.finished else "not finished"
        yield Entry(participant_id=run.code, experiment=plan.experiment, state=state, kind=run.kind)


def _write_results(part: Path, runs: Sequence[_Run], members: Mapping[str, Member], *, free_text: bool) -> None:
    """The redacted journals, the tables that they make, what their columns mean, and a register of who is here."""
    first = {run.code: redaction.moment_of(run.contents.head.utc) for run in runs}
    for run in runs:
        first[run.code] = min(first[run.code], redaction.moment_of(run.contents.head.utc))
    for run in runs:
        code, name = run.code, f"sub-{run.code}_task-{run.contents.plan.experiment}{journal.ENDING}"
        place = f"{RESULTS}/sub-{code}/{name}"
        placing.write_file(part, place, redaction.redacted(run.path, run.data, first[code], free_text=free_text))
        table, data, made = rebuild(part / place)
        placing.write_file(table.parent, table.name, data)
        shots = shots_table(made)
        if shots is not None:
            placing.write_file(table.parent, shots_path(part / place).name, shots)
            placing.write_file(part, f"{RESULTS}/shots_columns.md", shots_dictionary().encode())
        design = began_with(made.head)
        placing.write_file(part, f"{RESULTS}/task-{design.design}_columns.md", design_dictionary(design).encode())
    facts = redaction.redacted_register(members[code] for code in first if code in members)
    if facts:
        placing.write_file(part, f"{RESULTS}/{REGISTER_FILE}", facts)


def _write_analysis(
    part: Path, request: ArchiveRequest, settings: ArchiveSettings, left_out: Section, progress: Progress
) -> None:
    for given, path in ((request.rules, RULES_FILE), (request.requests, REQUESTS_FILE)):
        if given is not None:
            data = given.read_bytes() if request.free_text else redaction.redacted_config(given)
            placing.write_file(part, path, data)
    placing.write_file(part, ARCHIVE_FILE, as_json(settings))
    analyze(replace(analysis_of(part, settings), extra=(left_out,)), progress=progress)


def _write_bids(part: Path, request: ArchiveRequest, settings: ArchiveSettings, results: Path) -> None:
    """The data set; what people added to one that was exported from the study before stays in it."""
    files = bids_files(part, settings)
    earlier = next((one for one in (results / BIDS, request.folder / BIDS) if bids_export.is_export(one)), None)
    for path, data in (files | bids_export.filled_in(earlier, files)).items():
        placing.write_file(part, f"{BIDS}/{path}", data)


def _write_pages(
    part: Path, settings: ArchiveSettings, entries: Sequence[Entry], designs: Sequence[ArchivedDesign]
) -> None:
    page = pages.archive_page(settings.title, recoil_version(), entries, free_text=settings.free_text)
    placing.write_file(part, "README.md", page)
    placing.write_file(part, "METHODS.md", pages.methods(designs))


def _designs(runs: Iterable[_Run]) -> list[ArchivedDesign]:
    """The designs of the runs, each with its gun; one that was changed during the study stands as often as it was."""
    by_setup: dict[str, list[_Run]] = {}
    setups: dict[str, Files] = {}
    first: dict[str, Files] = {}
    for run in sorted(runs, key=lambda run: (run.contents.plan.experiment, run.code)):
        of_head = redaction.without_places(run.contents.head.setup_json)
        setup = of_head if isinstance(of_head, dict) else {}
        by_setup.setdefault(setup_key(setup), []).append(run)
        setups.setdefault(setup_key(setup), setup)
        first.setdefault(run.contents.plan.experiment, setup)
    return [_design(some, setups[key], first[some[0].contents.plan.experiment]) for key, some in by_setup.items()]


def _design(runs: Sequence[_Run], setup: Files, first: Files) -> ArchivedDesign:
    """The design of runs of one setup; `first` is that of the experiment's first participant."""
    head = runs[0].contents.head
    return ArchivedDesign(
        design=began_with(head),
        gun=checked_table(GunConfig, dict(setup.get("gun", {})), f"{head.path}: line 1"),
        participants=tuple(run.code for run in runs),
        spoken=tuple(run.contents.head.language for run in runs if run.contents.head.language is not None),
        synthetic=sum(run.kind == "synthetic" for run in runs),
        stopped=sum(not run.contents.finished for run in runs),
        differs=setup_differences(first, setup),
    )


def _citation(folders: Iterable[Path]) -> bytes | None:
    """The file that the authors filled in, if there is one in the study's folder."""
    path = next((one / CITATION for one in folders if (one / CITATION).is_file()), None)
    return read_text(path).encode() if path else None


def _preregistrations(folders: Iterable[Path]) -> list[Path]:
    """What a study was frozen as, whose hashes its journals carry."""
    found = (sorted(one.glob("preregistration-*")) for one in folders)
    return [path for path in next(filter(None, found), []) if path.suffix in (".json", ".md") and path.is_file()]


def _write_package(part: Path, title: str, runs: Iterable[_Run]) -> None:
    """The data package: every table with a schema."""
    schemas, resources = dict[bytes, str](), list[Resource]()
    for path, name, schema in _tables(part, runs):
        taken = sum(one.startswith((f"schemas/{name}.", f"schemas/{name}-")) for one in schemas.values())
        place = schemas.setdefault(schema, f"schemas/{name}{f'-{taken + 1}' if taken else ''}.json")
        placing.write_file(part, place, schema)
        resources.append(Resource(path=path, data=(part / path).read_bytes(), title=Path(path).name, schema=place))
    package = datapackage.descriptor(title, recoil_version(), resources)
    placing.write_file(part, datapackage.DESCRIPTOR, package)


def _tables(part: Path, runs: Iterable[_Run]) -> Iterator[tuple[str, str, bytes]]:
    """Every table by its path in the archive, with a name for its schema, and that."""
    for run in runs:
        design = began_with(run.contents.head)
        columns = design_columns.columns(design)
        keys = [column.name for column in columns if column.name in ("participant_id", "session", "trial")]
        path = f"{RESULTS}/sub-{run.code}/sub-{run.code}_task-{design.design}_{design.table}.csv"
        yield path, f"task-{design.design}", datapackage.schema(columns, keys)
        shots = f"{RESULTS}/sub-{run.code}/sub-{run.code}_task-{design.design}_shots.csv"
        if (part / shots).is_file():
            yield shots, "shots", datapackage.schema(SHOTS)
    for file in sorted((part / ANALYSIS).rglob("*.csv")):
        path = file.relative_to(part).as_posix()
        yield path, path.removesuffix(".csv"), datapackage.schema_of_results(file.read_bytes())
    yield CONTENTS, "contents", datapackage.schema(contents.CONTENT_COLUMNS)
    people = (part / BIDS / "participants.tsv").read_text(encoding="utf-8").split("\n", 1)[0]
    yield f"{BIDS}/participants.tsv", "participants", datapackage.schema_of_participants(people.split("\t"))
