"""`recoil analyze`: logs to statistics, tables, figures and report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.logs.column_map import ColumnMap
from analysis.logs.exclusions import ExclusionEffect, Rules, apply_rules, by_study, left_out_by_files
from analysis.logs.files import shown_name
from analysis.logs.kinds import OF_KIND, folder_of
from analysis.logs.reading import Logs, Track, read_logs, refuse_nothing
from analysis.paper.audit.page import predictions
from analysis.paper.audit.run import audit, load_paper_file
from analysis.paper.paper import Prediction, load_paper
from analysis.report.terminal import Progress, Tell, unseen, untold
from analysis.summary import remarks_coding
from analysis.summary.comparison import compare
from analysis.summary.deviations import AnalysisFiles, deviations
from analysis.summary.participation import exclusion_lines, participation
from analysis.summary.request_data import answers_to
from analysis.summary.requests import Requests
from analysis.summary.results import RulesApplied, StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.sections import write_report
from analysis.summary.summary import summarize
from analysis.summary.tables_out import result_tables
from experiments.config.door import ConfigError, load
from experiments.config.setup import sha256
from experiments.record import storage
from experiments.record.provenance import provenance

_PARTS = 4
"""Statistics, fits, figures and pages: a bar tells of each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What is asked for: the logs, where to write, and the files that say how to read and what to leave out.

    `fits`: with the diffusion model fitted to response times.
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

    @property
    def files(self) -> AnalysisFiles:
        """What is held against a preregistration."""
        return AnalysisFiles(
            rules=self.rules, requests=self.requests, codebook=self.codebook, paper=self.paper, fits=self.fits
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Analysed:
    """Logs of one kind of data, their statistics, what rules did to them, and the tables of results by file name."""

    logs: Logs
    statistics: StudyStatistics
    effect: ExclusionEffect | None
    tables: Mapping[str, bytes]


def analyze(
    request: Request, track: Track = iter, progress: Progress = unseen
) -> tuple[StudyStatistics, tuple[str, ...]]:
    """Write statistics, tables and report of all usable logs; returns the statistics and what there is to say.

    That is whose logs were left out, and what was used though something is to be said of it.

    `PlaceError` if there is no usable log at all, with every reason.
    """
    published = load_paper(request.paper) if request.paper else None
    mapping = load(ColumnMap, request.columns) if request.columns else None
    rules = load(Rules, request.rules) if request.rules else None
    asked = load(Requests, request.requests) if request.requests else None
    book = remarks_coding.load_codebook(request.codebook) if request.codebook else None
    logs = read_logs(request.paths, track, mapping, include_synthetic=request.include_synthetic)
    refuse_nothing(request.paths, logs)
    parts = (replace(logs, apart=()), *logs.apart)
    with progress("analyze", _PARTS) as tell:
        main = _analysed(parts[0], rules, request, tell)
        others = [_analysed(part, rules, request) for part in parts[1:]]
        kept_apart = {one.logs.kind: replace(one.statistics, versions=None) for one in others}
        statistics = replace(main.statistics, kept_apart=kept_apart or None)
        coded = None if book is None else _coded(main.logs, statistics, book)
        if coded is not None:
            statistics = replace(statistics, remarks=coded)
        if asked is not None and request.requests is not None:
            statistics = replace(statistics, requested=answers_to(asked, request.requests, main.logs))
        frozen, edited = deviations(parts[0], request.files)
        statistics = replace(statistics, preregistration=frozen or None)
        storage.make_folder(request.out)
        report = ReportData(
            title=report_title(request.paths),
            statistics=statistics,
            problems=logs.problems,
            remarks=logs.remarks,
            comparison=None if published is None else compare(statistics, published, _predicted(request.paper)),
            files=logs.files,
            beside=tuple(main.tables),
            provenance=provenance() | _read_by(request.columns, mapping),
            dropped=tuple(_notes(main.effect)),
            extra=() if coded is None else (remarks_coding.coding_section(coded),),
            apart=tuple(_report_apart(one) for one in others),
        )
        write_report(request.out, report, tell)
    _write_tables(request.out, main)
    for one in others:
        storage.make_folder(request.out / folder_of(one.logs.kind))
        _write_tables(request.out / folder_of(one.logs.kind), one)
    return statistics, (*edited, *_said(logs, statistics))


def _said(logs: Logs, statistics: StudyStatistics) -> Iterator[str]:
    yield from (f"left out: {problem}" for problem in logs.problems)
    yield from (f"left out: {run}" for run in logs.begun)
    yield from exclusion_lines(statistics.excluded)
    for kind, one in (statistics.kept_apart or {}).items():
        yield from (f"{OF_KIND[kind]}, kept apart: {line}" for line in exclusion_lines(one.excluded))
    yield from map(str, logs.remarks)


def with_everybody(statistics: StudyStatistics, logs: Logs) -> StudyStatistics:
    """The statistics with whose logs could not be read among the excluded, and who is in which analysis."""
    excluded = (*statistics.excluded, *left_out_by_files(logs))
    analysed = {name: found.participants.codes for name, found in statistics.analysed.items()}
    analysed |= {one.design.design: tuple(map(str, one.table["participant_id"].unique())) for one in logs.designs}
    return replace(statistics, excluded=excluded, participation=participation(logs, analysed, excluded))


_TITLED = 3
"""So many paths stand in the title of a report."""


def report_title(paths: Sequence[Path]) -> str:
    """What was read, whatever the order it was named in.

    >>> report_title([Path("oslo"), Path("kyoto")]), report_title([Path(f"P{i}.csv") for i in range(20)])
    ('Statistics of kyoto, oslo', 'Statistics of P0.csv, P1.csv, P10.csv and 17 more')
    """
    names = sorted({shown_name(path.name or path.absolute().name or path) for path in paths})
    more = f" and {len(names) - _TITLED} more" if len(names) > _TITLED else ""
    return f"Statistics of {', '.join(names[:_TITLED])}{more}"


def _analysed(logs: Logs, rules: Rules | None, request: Request, tell: Tell = untold) -> _Analysed:
    """The statistics of logs of one kind of data, after the rules if there are some."""
    effect = apply_rules(logs, rules) if rules is not None else None
    used = effect.logs if effect is not None else logs
    found = summarize(used, fits=request.fits, tell=tell)
    statistics = replace(found, studies=_by_study(used, fits=request.fits))
    if effect is not None and rules is not None and request.rules is not None:
        statistics = _with_rules(statistics, effect, rules, request.rules)
    return _Analysed(
        logs=used,
        statistics=with_everybody(statistics, used),
        effect=effect,
        tables=result_tables(used, statistics.analysed),
    )


def _report_apart(one: _Analysed) -> ReportData:
    """What is told of data that are kept apart."""
    return ReportData(title="", statistics=one.statistics, files=one.logs.files, dropped=tuple(_notes(one.effect)))


def _write_tables(folder: Path, one: _Analysed) -> None:
    for name, content in one.tables.items():
        storage.write_whole(folder / name, content)


def _predicted(paper: Path | None) -> dict[str, Prediction]:
    """What the audit says of the published numbers."""
    return {} if paper is None else predictions(audit(load_paper_file(paper)))


def _coded(logs: Logs, statistics: StudyStatistics, book: remarks_coding.Codebook) -> remarks_coding.CodedRemarks:
    """The descriptions of experiment 2, coded. `ConfigError` if the codebook does not fit them."""
    if statistics.preference is None:
        raise ConfigError("the codebook: no ratings here")
    ratings = logs.ratings
    columns = ratings["participant_id"].astype(str), ratings["method"].astype(str), ratings["comment"].fillna("")
    remarks = [
        remarks_coding.WrittenRemark(participant=who, method=method, text=text)
        for who, method, text in zip(*columns, strict=True)
    ]
    try:
        return remarks_coding.code_remarks(remarks, statistics.preference.participants.codes, book)
    except ValueError as error:
        raise ConfigError(f"the codebook: {error}") from error


def _by_study(logs: Logs, *, fits: bool) -> dict[str, StudyStatistics] | None:
    """Each study's own statistics, if there are several; what computed them stands above."""
    each = by_study(logs).items()
    return {name: replace(summarize(alone, fits=fits), versions=None) for name, alone in each} or None


def _with_rules(statistics: StudyStatistics, effect: ExclusionEffect, rules: Rules, path: Path) -> StudyStatistics:
    return replace(
        statistics,
        excluded=(*effect.excluded, *statistics.excluded),
        warnings=(*statistics.warnings, *effect.warnings),
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
        counts = Counter[str]()
        for by_rule in people.values():
            counts.update(by_rule)
        shown = ", ".join(f"{rule} {count}" for rule, count in sorted(counts.items())) or "none"
        recorded = effect.trials[experiment].recorded
        notes.append(f"Trials dropped by rule in {experiment}, of {recorded}: {shown}.")
    return notes


def _read_by(path: Path | None, mapping: ColumnMap | None) -> dict[str, str]:
    if path is None or mapping is None:
        return {}
    return {"other programs' logs read by": f"{path.name}, sha256 {sha256(mapping.model_dump(mode='json'))}"}
