"""`recoil analyze`: logs to statistics, tables, figures and report."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import JsonValue

from analysis.logs.exclusion_rules import ExclusionEffect, Rules, apply_rules
from analysis.logs.exclusions import LeftOut, by_study, left_out_by_files, log_remarks
from analysis.logs.files import Problem, shown_name
from analysis.logs.journals import NOT_FINISHED, shots_beside
from analysis.logs.kinds import OF_KIND, folder_of
from analysis.logs.reading import Logs, Track, read_logs, refuse_nothing
from analysis.report import placing
from analysis.report.section import Section
from analysis.report.serial import as_json
from analysis.report.terminal import Progress, Tell, unseen, untold
from analysis.summary.deviations import AnalysisFiles, deviations, frozen_tests
from analysis.summary.languages import unchecked_languages
from analysis.summary.participation import exclusion_lines, participation
from analysis.summary.results import STATISTICS_FILE, RulesApplied, StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.exclusion_words import dropped_by_rule
from analysis.summary.summary import summarize
from analysis.summary.tables_out import TABLE_FILES, result_tables, table_names
from device.messages import first_few
from experiments.config.door import load
from experiments.config.setup import sha256
from experiments.record.provenance import provenance

if TYPE_CHECKING:
    from analysis.logs.column_map import ColumnMap
    from analysis.paper.paper import ComparisonRow, Paper
    from analysis.summary.delivered import DeliveredCourse
    from analysis.summary.remarks_coding import Codebook, CodedRemarks
    from analysis.summary.requests import Requests

_PARTS = 4
"""Statistics, fits, figures and pages: a bar tells of each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What is asked for: the logs, where to write, and the files that say how to read and what to leave out.

    `fits`: with the diffusion model fitted to response times, and psychometric functions to everybody. `title` of the
    report: what was read, unless given; `extra` sections of it stand behind the results. Unless `against_frozen`, no
    deviation from a preregistration is looked for. `left_out`: who is known to be left out though no log says so.
    """

    paths: Sequence[Path]
    out: Path
    paper: Path | None = None
    columns: Path | None = None
    rules: Path | None = None
    codebook: Path | None = None
    fits: bool = False
    requests: Path | None = None
    include_synthetic: bool = False
    title: str = ""
    extra: tuple[Section, ...] = ()
    against_frozen: bool = True
    left_out: tuple[LeftOut, ...] = ()

    @property
    def files(self) -> AnalysisFiles:
        """What is held against a preregistration."""
        return AnalysisFiles(
            rules=self.rules, requests=self.requests, codebook=self.codebook, paper=self.paper, fits=self.fits
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """The files of a request, read."""

    published: Paper | None
    mapping: ColumnMap | None
    rules: Rules | None
    requests: Requests | None
    codebook: Codebook | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Analysed:
    """Logs of one kind of data, their statistics, and what rules did to them.

    `frozen`: the tests of the preregistration that were made, as no others were asked for.
    """

    logs: Logs
    statistics: StudyStatistics
    effect: ExclusionEffect | None
    frozen: tuple[JsonValue, ...] = ()


def analyze(
    request: Request, track: Track = iter, progress: Progress = unseen
) -> tuple[StudyStatistics, tuple[str, ...], tuple[str, ...]]:
    """Write statistics, tables and report of all usable logs; returns the statistics, exceptions and notes.

    Exceptions: whose logs were left out, and what was used though something is to be said of it.

    `PlaceError` if there is no usable log at all, with every reason.
    """
    from analysis.summary.sections.sections import write_report  # noqa: PLC0415 - who writes none has no need of figures

    files = _loaded(request)
    with placing.results_in(request.out, STATISTICS_FILE, TABLE_FILES) as part:
        logs = _usable(request, files, track)
        with progress("analyze", _PARTS) as tell:
            report, parts, edited = _analysis(request, files, logs, tell)
            write_report(part, report, tell, meanwhile=lambda: _write_tables(part, parts))
    notes = (*map(str, logs.notes), *_without_effect(parts))
    return report.statistics, (*edited, *_said(logs, report.statistics)), notes


def result_files(request: Request, track: Track = iter) -> dict[str, bytes]:
    """What `analyze` writes beside report and figures, by path: the statistics and the tables. Nothing is written."""
    files = _loaded(request)
    report, parts, _ = _analysis(request, files, _usable(request, files, track))
    return {STATISTICS_FILE: as_json(report.statistics), **_tables(parts)}


def _loaded(request: Request) -> _Asked:
    """The files of a request. Most are not given: what reads them is imported with them."""
    published, mapping, requests, codebook = None, None, None, None
    if request.paper:
        from analysis.paper.paper import load_paper  # noqa: PLC0415 - with its file

        published = load_paper(request.paper)
    if request.columns:
        from analysis.logs.column_map import ColumnMap  # noqa: PLC0415 - with its file

        mapping = load(ColumnMap, request.columns)
    if request.requests:
        from analysis.summary.requests import Requests  # noqa: PLC0415 - with its file

        requests = load(Requests, request.requests)
    if request.codebook:
        from analysis.summary.remarks_coding import load_codebook  # noqa: PLC0415 - with its file

        codebook = load_codebook(request.codebook)
    rules = load(Rules, request.rules) if request.rules else None
    return _Asked(published=published, mapping=mapping, rules=rules, requests=requests, codebook=codebook)


def _usable(request: Request, files: _Asked, track: Track) -> Logs:
    logs = read_logs(request.paths, track, files.mapping, include_synthetic=request.include_synthetic)
    refuse_nothing(request.paths, logs)
    return logs


def _analysis(
    request: Request, files: _Asked, logs: Logs, tell: Tell = untold
) -> tuple[ReportData, tuple[_Analysed, ...], tuple[str, ...]]:
    """What a report tells of logs; each kind of data by itself, of which the first is the report's; what was edited."""
    first = replace(logs, apart=())
    main = _analysed(first, files, request, tell)
    others = [_analysed(part, files, request, apart=True) for part in logs.apart]
    kept_apart = {one.logs.kind: replace(one.statistics, versions=None) for one in others}
    used = replace(request.files, answered=main.frozen)
    frozen, edited = deviations(first, used) if request.against_frozen else ((), ())
    warnings = (*main.statistics.warnings, *_without_effect((main, *others)), *unchecked_languages(logs.runs))
    statistics = replace(
        main.statistics,
        kept_apart=kept_apart or None,
        preregistration=frozen or None,
        warnings=warnings,
        log_remarks=log_remarks(logs) or None,
    )
    told = _told(main, files.mapping, logs.remarks)
    compared = _compared(statistics, files.published, request.paper) if files.published and request.paper else None
    report = replace(
        told,
        title=request.title or report_title(logs),
        statistics=statistics,
        problems=logs.problems,
        remarks=(*logs.remarks, *logs.notes),
        comparison=compared,
        beside=table_names(main.logs, main.statistics.analysed),
        provenance=provenance() | _read_by(request.columns, files.mapping),
        extra=(*request.extra, *told.extra),
        apart=tuple(_told(one, files.mapping, logs.remarks) for one in others),
    )
    return report, (main, *others), edited


def _without_effect(parts: Sequence[_Analysed]) -> tuple[str, ...]:
    """The entries of the rules that mean nobody in data of any kind; behind a semicolon stands what these data have."""
    said = [one.effect.warnings for one in parts if one.effect is not None]
    entries = [{warning.partition(";")[0] for warning in some} for some in said]
    return tuple(one for one in said[0] if all(one.partition(";")[0] in some for some in entries)) if said else ()


def _tables(parts: Sequence[_Analysed]) -> dict[str, bytes]:
    """The tables of results by path: those of data that are kept apart in folders of their own."""
    first, *others = ((one.logs.kind, result_tables(one.logs, one.statistics.analysed)) for one in parts)
    apart = {f"{folder_of(kind)}/{name}": data for kind, tables in others for name, data in tables.items()}
    return {**first[1], **apart}


def _write_tables(out: Path, parts: Sequence[_Analysed]) -> None:
    for path, content in _tables(parts).items():
        placing.write_file(out, path, content)


def _said(logs: Logs, statistics: StudyStatistics) -> Iterator[str]:
    yield from (f"left out: {problem}" for problem in logs.problems)
    yield from (f"left out: {run}" for run in logs.begun)
    yield from exclusion_lines(statistics.excluded)
    for kind, one in (statistics.kept_apart or {}).items():
        yield from (f"{OF_KIND[kind]}, kept apart: {line}" for line in exclusion_lines(one.excluded))
    yield from map(str, logs.remarks)


def with_everybody(statistics: StudyStatistics, logs: Logs, others: Sequence[LeftOut] = ()) -> StudyStatistics:
    """The statistics with whose logs could not be read, and `others`, among the excluded; and who is in which."""
    excluded = (*statistics.excluded, *left_out_by_files(logs), *others)
    found = participation(logs, who_is_analysed(statistics, logs), excluded)
    return replace(statistics, excluded=excluded, participation=found)


def who_is_analysed(statistics: StudyStatistics, logs: Logs) -> dict[str, tuple[str, ...]]:
    """Whose answers stand in the statistics of each experiment and design."""
    analysed = {name: found.participants.codes for name, found in statistics.analysed.items()}
    return analysed | {one.design.design: tuple(map(str, one.table["participant_id"].unique())) for one in logs.designs}


_TITLED = 3
"""So many studies stand in the title of a report."""


def report_title(logs: Logs) -> str:
    """The studies that were read, alike for a folder and for its files named one by one."""
    every = {name for part in (logs, *logs.apart) for name in part.names.values()}
    names = sorted({shown_name(name) for name in every if name})
    return f"Statistics of {first_few(names, _TITLED)}" if names else "Statistics"


def _analysed(logs: Logs, asked: _Asked, request: Request, tell: Tell = untold, *, apart: bool = False) -> _Analysed:
    """The statistics of logs of one kind of data, after the rules if there are some, with all that was asked for.

    Data that are kept `apart` need not have all that is asked about: what they lack is a warning.
    """
    effect = apply_rules(logs, asked.rules) if asked.rules is not None else None
    used = effect.logs if effect is not None else logs
    found = summarize(used, fits=request.fits, tell=tell)
    statistics = replace(found, studies=_by_study(used, fits=request.fits))
    if effect is not None and asked.rules is not None and request.rules is not None:
        statistics = _with_rules(statistics, effect, asked.rules, request.rules)
    frozen: tuple[JsonValue, ...] = ()
    tests = () if request.requests or not request.against_frozen or apart else frozen_tests(used)
    if asked.codebook or asked.requests or tests:
        from analysis.summary.asked import AskedFor, with_answers  # noqa: PLC0415 - what is asked for by files alone

        files = AskedFor(codebook=asked.codebook, requests=asked.requests, path=request.requests, frozen=tests)
        statistics, frozen = with_answers(files, statistics, used, apart=apart)
    return _Analysed(
        logs=used,
        statistics=with_everybody(statistics, used, () if apart else request.left_out),
        effect=effect,
        frozen=frozen,
    )


def _told(one: _Analysed, mapping: ColumnMap | None, remarks: Iterable[Problem]) -> ReportData:
    """What is told of data of one kind."""
    registered = ((one.logs.person(where, member.participant_id), member) for where, member in one.logs.joined)
    return ReportData(
        title="",
        statistics=one.statistics,
        files=one.logs.files,
        dropped=tuple(_notes(one.effect)),
        extra=_coding(one.statistics.remarks),
        planned=not one.logs.mapped,
        rated_from=mapping.rated_from if mapping is not None and one.logs.mapped else None,
        members=dict(registered),
        analysed=who_is_analysed(one.statistics, one.logs),
        stopped=_stopped(one.logs, remarks),
        delivered=() if one.logs.mapped else _delivered(one.logs.files),
    )


def _delivered(files: Sequence[Path]) -> tuple[DeliveredCourse, ...]:
    """What sensors said of the shots, where there were some."""
    measured = [log for log in files if shots_beside(log).is_file()]
    if not measured:
        return ()
    from analysis.summary.delivered import delivered_courses  # noqa: PLC0415 - of no use without a sensor

    return delivered_courses(measured)


def _stopped(logs: Logs, remarks: Iterable[Problem]) -> dict[str, frozenset[str]]:
    """By experiment whose logs are of runs that were stopped before their end."""
    found: dict[str, set[str]] = {}
    for one in remarks:
        if one.message.startswith(NOT_FINISHED):
            found.setdefault(one.experiment, set()).add(logs.person(one.study, one.participant))
    return {experiment: frozenset(people) for experiment, people in found.items()}


def _compared(statistics: StudyStatistics, published: Paper, path: Path) -> tuple[ComparisonRow, ...]:
    """The published numbers beside these, with what the audit of the paper's file says of them."""
    from analysis.paper.audit import page, run  # noqa: PLC0415 - of no use without a paper
    from analysis.summary.comparison import compare  # noqa: PLC0415 - the same

    return compare(statistics, published, page.predictions(run.audit(run.load_paper_file(path))))


def _coding(coded: CodedRemarks | None) -> tuple[Section, ...]:
    """The section of remarks that were coded, if there are some."""
    if coded is None:
        return ()
    from analysis.summary.remarks_coding import coding_section  # noqa: PLC0415 - of no use without a codebook

    return (coding_section(coded),)


def _by_study(logs: Logs, *, fits: bool) -> dict[str, StudyStatistics] | None:
    """Each study's own statistics, if there are several; what computed them stands above."""
    each = by_study(logs).items()
    return {name: replace(summarize(alone, fits=fits), versions=None) for name, alone in each} or None


def _with_rules(statistics: StudyStatistics, effect: ExclusionEffect, rules: Rules, path: Path) -> StudyStatistics:
    return replace(
        statistics,
        excluded=(*effect.excluded, *statistics.excluded),
        rules=RulesApplied(
            file=path.name, config=rules.model_dump(mode="json"), trials=effect.trials, dropped=effect.dropped
        ),
    )


def _notes(effect: ExclusionEffect | None) -> list[str]:
    """How many trials the rules dropped, for the report."""
    if effect is None:
        return []
    notes = []
    for experiment, people in effect.dropped.items():
        counts = dropped_by_rule(people)
        shown = ", ".join(f"{rule} {count}" for rule, count in sorted(counts.items())) or "none"
        recorded = effect.trials[experiment].recorded
        notes.append(f"Trials dropped by rule in {experiment}, of {recorded}: {shown}.")
    return notes


def _read_by(path: Path | None, mapping: ColumnMap | None) -> dict[str, str]:
    if path is None or mapping is None:
        return {}
    return {"other programs' logs read by": f"{path.name}, sha256 {sha256(mapping.model_dump(mode='json'))}"}
