"""`recoil analyze`: logs to statistics, tables, figures and report."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd
from pydantic import JsonValue

from analysis.logs.column_map import ColumnMap
from analysis.logs.exclusion_rules import ExclusionEffect, Rules, apply_rules
from analysis.logs.exclusions import LeftOut, by_study, left_out_by_files, log_remarks
from analysis.logs.files import Problem, shown_name
from analysis.logs.journals import NOT_FINISHED
from analysis.logs.kinds import OF_KIND, folder_of
from analysis.logs.reading import Logs, Track, read_logs, refuse_nothing
from analysis.paper.paper import Paper, Prediction, load_paper
from analysis.report import placing
from analysis.report.section import Section
from analysis.report.serial import as_json
from analysis.report.terminal import Progress, Tell, unseen, untold
from analysis.summary import remarks_coding
from analysis.summary.comparison import compare
from analysis.summary.delivered import delivered_courses
from analysis.summary.deviations import AnalysisFiles, deviations, frozen_tests
from analysis.summary.languages import unchecked_languages
from analysis.summary.participation import exclusion_lines, participation
from analysis.summary.request_data import answers_to, frozen_answer
from analysis.summary.requests import Requested, Requests
from analysis.summary.results import STATISTICS_FILE, RulesApplied, StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.exclusion_words import dropped_by_rule
from analysis.summary.summary import summarize
from analysis.summary.tables_out import TABLE_FILES, result_tables, table_names
from device.messages import first_few
from experiments.config.door import ConfigError, load
from experiments.config.setup import sha256
from experiments.design.language import METHOD_FACTOR
from experiments.record.provenance import provenance

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
    codebook: remarks_coding.Codebook | None


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
    return _Asked(
        published=load_paper(request.paper) if request.paper else None,
        mapping=load(ColumnMap, request.columns) if request.columns else None,
        rules=load(Rules, request.rules) if request.rules else None,
        requests=load(Requests, request.requests) if request.requests else None,
        codebook=remarks_coding.load_codebook(request.codebook) if request.codebook else None,
    )


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
    compared = None if files.published is None else compare(statistics, files.published, _predicted(request.paper))
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
    for answered in (_with_remarks, _with_requested):
        try:
            statistics = answered(statistics, used, asked, request)
        except ConfigError as error:
            if not apart:
                raise
            statistics = replace(statistics, warnings=(*statistics.warnings, f"not answered here: {error}"))
    frozen: tuple[JsonValue, ...] = ()
    if request.requests is None and request.against_frozen and not apart:
        statistics, frozen = _with_frozen(statistics, used)
    return _Analysed(
        logs=used,
        statistics=with_everybody(statistics, used, () if apart else request.left_out),
        effect=effect,
        frozen=frozen,
    )


def _with_remarks(statistics: StudyStatistics, logs: Logs, asked: _Asked, _: Request) -> StudyStatistics:
    book = asked.codebook
    return statistics if book is None else replace(statistics, remarks=_coded(logs, statistics, book))


def _with_requested(statistics: StudyStatistics, logs: Logs, asked: _Asked, request: Request) -> StudyStatistics:
    if asked.requests is None or request.requests is None:
        return statistics
    return replace(statistics, requested=answers_to(asked.requests, request.requests, logs))


def _with_frozen(statistics: StudyStatistics, logs: Logs) -> tuple[StudyStatistics, tuple[JsonValue, ...]]:
    """The statistics with the tests that were frozen, as far as the data have what they name, and those tests."""
    found, made, warnings = list[Requested](), list[JsonValue](), list[str]()
    for place, test in enumerate(frozen_tests(logs)):
        try:
            found.append(frozen_answer(test, logs))
        except ValueError as error:
            warnings.append(f"a frozen test is not made: requests.{place}: {error}")
        else:
            made.append(test)
    said = (*statistics.warnings, *warnings)
    return replace(statistics, requested=tuple(found) or None, warnings=said), tuple(made)


def _told(one: _Analysed, mapping: ColumnMap | None, remarks: Iterable[Problem]) -> ReportData:
    """What is told of data of one kind."""
    coded = one.statistics.remarks
    registered = ((one.logs.person(where, member.participant_id), member) for where, member in one.logs.joined)
    return ReportData(
        title="",
        statistics=one.statistics,
        files=one.logs.files,
        dropped=tuple(_notes(one.effect)),
        extra=() if coded is None else (remarks_coding.coding_section(coded),),
        planned=not one.logs.mapped,
        rated_from=mapping.rated_from if mapping is not None and one.logs.mapped else None,
        members=dict(registered),
        analysed=who_is_analysed(one.statistics, one.logs),
        stopped=_stopped(one.logs, remarks),
        delivered=() if one.logs.mapped else delivered_courses(one.logs.files),
    )


def _stopped(logs: Logs, remarks: Iterable[Problem]) -> dict[str, frozenset[str]]:
    """By experiment whose logs are of runs that were stopped before their end."""
    found: dict[str, set[str]] = {}
    for one in remarks:
        if one.message.startswith(NOT_FINISHED):
            found.setdefault(one.experiment, set()).add(logs.person(one.study, one.participant))
    return {experiment: frozenset(people) for experiment, people in found.items()}


def _predicted(paper: Path | None) -> dict[str, Prediction]:
    """What the audit says of the published numbers."""
    if paper is None:
        return {}
    from analysis.paper.audit import page, run  # noqa: PLC0415 - of no use without a paper

    return page.predictions(run.audit(run.load_paper_file(paper)))


def _coded(logs: Logs, statistics: StudyStatistics, book: remarks_coding.Codebook) -> remarks_coding.CodedRemarks:
    """What people said in their own words, coded. `ConfigError` if the codebook does not fit that."""
    found = [*_written(logs, statistics)]
    if not found:
        raise ConfigError("the codebook: nobody who is analysed was asked for words")
    remarks = [remark for _, remark in found if remark is not None]
    try:
        return remarks_coding.code_remarks(remarks, list(dict.fromkeys(who for who, _ in found)), book)
    except ValueError as error:
        raise ConfigError(f"the codebook: {error}") from error


def _written(logs: Logs, statistics: StudyStatistics) -> Iterator[tuple[str, remarks_coding.WrittenRemark | None]]:
    """What was asked for in words of whom: every analysed participant once at least."""
    if statistics.preference is not None:
        analysed = dict.fromkeys(statistics.preference.participants.codes)
        yield from analysed.items()
        yield from (one for one in _remarks_in(logs.ratings, "comment") if one[0] in analysed)
    for one in logs.designs:
        for name, question in one.design.questions.items():
            if question.kind == "text":
                yield from _remarks_in(one.table, name)


def _remarks_in(table: pd.DataFrame, name: str) -> Iterator[tuple[str, remarks_coding.WrittenRemark]]:
    methods = table[METHOD_FACTOR] if METHOD_FACTOR in table else table["participant_id"].map(lambda _: "")
    columns = table["participant_id"].astype(str), methods.astype(str), table[name].fillna("").astype(str)
    for who, method, text in zip(*columns, strict=True):
        yield who, remarks_coding.WrittenRemark(participant=who, method=method, text=text)


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
