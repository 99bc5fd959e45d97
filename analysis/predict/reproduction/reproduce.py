"""`recoil reproduce`: a study with synthetic participants, drawn or rebuilt from the published numbers.

Every part is the one that live sessions use; only the clock is virtual, so that breaks take no time. The odds are over
participants of the same config, whose logs are not written.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from analysis.logs.reading import Logs, read_logs
from analysis.paper.audit.claims import AuditFinding
from analysis.paper.audit.lattices import Rows
from analysis.paper.audit.page import ATTENTION, ELSEWHERE, cut, other_rows, predictions
from analysis.paper.audit.participants import MEAN_SLACK, RebuiltAnswers, backward_counts, forward_counts, rating_grains
from analysis.paper.audit.run import audit, load_paper_file
from analysis.paper.paper import (
    ComparisonRow,
    Paper,
    PublishedDirection,
    PublishedExperiment,
    PublishedPreference,
    load_paper,
)
from analysis.paper.recurrence import PatternOdds
from analysis.predict.drawn import DirectionStudies, Drawn, RatingStudies, rates_by_method, studies_of
from analysis.predict.simulate.panels import shot_panel
from analysis.predict.synthetic_studies import pattern_odds, rates_of
from analysis.report.serial import as_csv
from analysis.report.terminal import Tell
from analysis.summary.comparison import compare
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.published import obtained_text
from analysis.summary.sections.sections import write_report
from analysis.summary.summary import summarize
from device.parameters import GunParameters
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError, StudyConfig
from experiments.config.setup import Setup, sha256
from experiments.design.config import DesignConfig
from experiments.load import load_setup, load_study
from experiments.rebuild import rebuild
from experiments.record import storage
from experiments.record.journal import begun
from experiments.record.provenance import git_commit, provenance, recoil_version
from experiments.run import RunRequest, run
from experiments.screens.synthetic import synthetic_screen
from experiments.study import folders
from experiments.synthetic.laws import DiffusionLaw, SyntheticAnswers, TableLaw

MANIFEST = "reproduction.json"

Observer = Literal["reconstructed", "rates"]
"""Who answers: participants rebuilt from the published numbers, or those that the configs describe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedStudy:
    """A study ready to run: its config, its experiments' setups, the seed and the published numbers.

    `answering`: the setups with the participants who answer; `findings`: the audit of the published numbers.
    """

    config: StudyConfig
    setups: tuple[Setup[DesignConfig], ...]
    answering: tuple[Setup[DesignConfig], ...]
    seed: int
    paper: Paper | None
    findings: tuple[AuditFinding, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def reconstructed(self) -> bool:
        """Are the participants rebuilt from the published numbers?"""
        return self.answering != self.setups

    @property
    def runs(self) -> list[tuple[Setup[DesignConfig], str]]:
        """Each experiment with each participant."""
        return [(setup, code) for code in self.config.codes() for setup in self.answering]

    def manifest(self) -> dict[str, object]:
        """What makes one reproduction the same as another."""
        setups = sha256([setup.record() for setup in self.answering])
        people = [setup.laws.model_dump(mode="json") for setup in self.answering if setup.laws is not None]
        return {
            "seed": self.seed,
            "participants": self.config.codes(),
            "setups_sha256": setups,
            "people_sha256": sha256(people),
            "recoil": recoil_version(),
            "git_commit": git_commit(),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduced:
    """The statistics of a reproduction, and every published number beside what was obtained."""

    statistics: StudyStatistics
    comparison: tuple[ComparisonRow, ...]


def prepared(name: str, seed: int, observer: Observer | None = None) -> ReproducedStudy:
    """A study from its config, with reconstructed participants unless others are asked for or those do not fit it.

    `ConfigError` for configs that cannot be used, and if reconstructed participants are asked for and do not fit.
    """
    config, folder = load_study(name)
    setups = tuple(load_setup(folder / experiment) for experiment in config.experiments)
    paper = load_paper(folder / config.paper) if config.paper else None
    findings = audit(load_paper_file(folder / config.paper)) if config.paper else ()
    study = ReproducedStudy(config=config, setups=setups, answering=setups, seed=seed, paper=paper, findings=findings)
    reason = "other participants were asked for" if observer == "rates" else misfit(config, setups, paper)
    if observer == "reconstructed" and reason:
        raise ConfigError(f"{name}: no reconstructed participants: {reason}")
    if paper is None or reason:
        return replace(study, notes=(f"The participants are those of the configs: {reason}.",))
    answering, notes = reconstructed_people(config, setups, paper, seed)
    return replace(study, answering=answering, notes=notes)


_RUN_S, _REPORT_S = 0.12, 6.0


def reproduction_time_s(study: ReproducedStudy) -> float:
    """About how long a reproduction takes."""
    return _REPORT_S + _RUN_S * len(study.runs)


def reproduce(study: ReproducedStudy, out: Path, tell: Tell) -> Reproduced:
    """Run, log, analyse and report a study into `out`.

    An unfinished reproduction of the same study is gone on with; another one in `out` is set aside.
    """
    _claim(study, out)
    for setup, code in study.runs:
        _take_part(study, setup, code, out / "logs")
        tell(f"{code} {setup.config.experiment}")
    logs = read_logs([out / "logs"])
    statistics = summarize(logs, fits=True)
    tell("statistics")
    odds = tuple(_odds(study))
    tell("odds of the published pattern")
    comparison = tuple(_compared(study, statistics))
    write_report(out, _report(study, logs, statistics, odds, comparison))
    tell("report")
    return Reproduced(statistics=statistics, comparison=comparison)


def comparison_text(comparison: tuple[ComparisonRow, ...]) -> str:
    """Every published number with its verdict, for the terminal."""
    if not comparison:
        return "No published numbers to compare with."
    rows = [("verdict", "published", "obtained", "number"), *map(_cells, comparison)]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = ["  ".join([*map(str.ljust, row, widths), row[3]]) for row in rows]
    notes = [f"{row.quantity}, published {row.published}: {row.note}" for row in comparison if _remarkable(row)]
    return "\n".join([*lines, *([""] if notes else []), *notes])


def _cells(row: ComparisonRow) -> tuple[str, str, str, str]:
    apart = row.experiment == ELSEWHERE
    name = row.quantity if apart else f"{row.experiment}: {row.quantity}"
    return row.verdict, cut(row.published, 20), "" if apart else obtained_text(row), cut(name, 72)


def _remarkable(row: ComparisonRow) -> bool:
    """Does the verdict call for its reason?"""
    return bool(row.note) and row.verdict in {"differs", "differs as predicted", *ATTENTION}


def _compared(study: ReproducedStudy, statistics: StudyStatistics) -> Iterator[ComparisonRow]:
    """Every published number: those that logs hold beside the obtained, the others with the audit's verdict."""
    if study.paper is not None:
        yield from compare(statistics, study.paper, predictions(study.findings))
        yield from other_rows(study.findings)


def _claim(study: ReproducedStudy, out: Path) -> None:
    """Make `out` this study's: go on with the same, set aside another, refuse what is not a reproduction."""
    manifest, wanted = out / MANIFEST, study.manifest()
    if manifest.is_file():
        if json.loads(manifest.read_text(encoding="utf-8")) == wanted:
            return
        folders.set_aside_file(out)
    elif out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise folders.PlaceError(f"{out}: exists and is no reproduction of a study; choose another --out")
    storage.make_folder(out)
    for setup in study.answering if study.reconstructed else ():
        storage.write_whole(out / table_name(setup), answers_table(setup))
    storage.write_whole(manifest, (json.dumps(wanted, indent=1) + "\n").encode())


def _take_part(study: ReproducedStudy, setup: Setup[DesignConfig], code: str, results: Path) -> None:
    """Have a synthetic participant do an experiment, unless the logs hold it already."""
    where = folders.place(results, code, setup.config.experiment)
    if not _finished(where):
        request = RunRequest(setup=setup, participant_id=code, results=results, seed=study.seed, again="resume")
        run(request, synthetic_screen, VirtualClock())
    elif not where.table.exists():  # killed between the last record and the table
        table, data, _ = rebuild(where.journal)
        storage.write_whole(table, data)


def _finished(where: folders.Place) -> bool:
    before = begun(where.journal) if where.journal.exists() else None
    return before is not None and before.finished


def _odds(study: ReproducedStudy) -> Iterator[PatternOdds]:
    if study.paper is None or not study.config.replications:
        return
    for setup in study.setups:
        studies = _drawn(setup)
        published = None if studies is None else _published(studies, study.paper)
        if studies is not None and published is not None and not _lacking(studies, published):
            yield pattern_odds(studies, published, study.config.replications, study.seed)


def _lacking(studies: Drawn, published: PublishedExperiment) -> list[str]:
    """The methods of the paper that a study does without, so that its claims cannot recur."""
    return [method for method in published.methods if method not in studies.methods]


def _drawn(setup: Setup[DesignConfig]) -> Drawn | None:
    """The studies of a design whose people are right at rates or rate by means; `None` of others."""
    try:
        found = studies_of(setup)
    except ConfigError:
        return None
    return None if isinstance(found.law, DiffusionLaw) else found


def _published(studies: Drawn, paper: Paper) -> PublishedExperiment:
    return paper.preference if isinstance(studies, RatingStudies) else paper.direction


def _report(
    study: ReproducedStudy,
    logs: Logs,
    statistics: StudyStatistics,
    odds: tuple[PatternOdds, ...],
    comparison: tuple[ComparisonRow, ...],
) -> ReportData:
    people = "synthetic, reconstructed from the published numbers" if study.reconstructed else "synthetic"
    return ReportData(
        title=study.config.title,
        statistics=statistics,
        problems=logs.problems,
        comparison=comparison or None,
        odds=odds,
        panels=tuple(_panels(study.setups[0])),
        files=logs.files,
        provenance=provenance() | {"seed": str(study.seed), "participants": people, "gun": "simulated"},
        beside=tuple(table_name(setup) for setup in study.answering) if study.reconstructed else (),
        notes=tuple(_notes(study)),
        reconstructed=study.reconstructed,
    )


def _panels(setup: Setup[DesignConfig]) -> Iterator[Any]:
    for method in setup.config.methods:
        parameters = setup.gun.rendering(method)
        if isinstance(parameters, GunParameters):
            label = setup.gun.methods[method].label
            yield shot_panel(f"{label} (friction {parameters.friction_N:g} N)", parameters)


def _notes(study: ReproducedStudy) -> Iterator[str]:
    """What the numbers rest on beyond the paper."""
    yield from study.notes
    yield from _without_odds(study)
    gun = study.setups[0].gun
    coil = gun.coil
    open_there, beyond = ("; the paper leaves both open", ", not in the paper") if study.paper else ("", "")
    yield f"The coil after the pulse is {coil.drive_off}, its back-EMF is {coil.emf}{open_there}."
    for setup in study.setups:
        if setup.config.assumed:
            yield f"Assumed or fitted for {setup.config.experiment}{beyond}: {', '.join(setup.config.assumed)}."
    if gun.assumed:
        yield f"Assumed for the gun{beyond}: {', '.join(gun.assumed)}."


def _without_odds(study: ReproducedStudy) -> Iterator[str]:
    for setup in study.setups if study.paper else ():
        studies = _drawn(setup)
        lacking = [] if studies is None or study.paper is None else _lacking(studies, _published(studies, study.paper))
        if lacking:
            name, methods = setup.config.design, ", ".join(lacking)
            yield f"No odds of the published pattern of {name}: the study has no {methods}, which its claims are about."


HONESTY = (
    "The participants are reconstructed: one of very many sets of answers that give the published statistics, found by "
    "the seed. They are not the paper's participants, and what is not published of them is assumed."
)


def misfit(study: StudyConfig, setups: Sequence[Setup[DesignConfig]], paper: Paper | None) -> str | None:
    """Why the paper's participants do not fit this study; None if they can."""
    if paper is None:
        return "the study names no paper"
    for setup in setups:
        studies = _drawn(setup)
        if studies is None:
            return f"the people of {setup.config.design} answer by another law than rates or ratings by method"
        if reason := _other_people(study, studies, _published(studies, paper)) or _other_trials(studies, paper):
            return reason
    return None


def _other_people(study: StudyConfig, studies: Drawn, published: PublishedExperiment) -> str | None:
    if study.participants != published.n:
        return f"the study has {study.participants} participants, the paper {published.n}"
    same = sorted(studies.methods) == sorted(published.methods)
    return None if same else f"{studies.design.design} has other methods than the paper"


def _other_trials(studies: Drawn, paper: Paper) -> str | None:
    name = studies.design.design
    if isinstance(studies, DirectionStudies):
        protocol = paper.direction.protocol
        same = studies.trials == (protocol.forward_trials_per_session, protocol.backward_trials_per_session)
        return None if same else f"{name} has other numbers of trials than the paper"
    scale = studies.scale
    same = scale.minimum == paper.preference.scale_min and scale.maximum == paper.preference.scale_max
    return None if same else f"{name} has another scale"


def reconstructed_people(
    study: StudyConfig, setups: Sequence[Setup[DesignConfig]], paper: Paper, seed: int
) -> tuple[tuple[Setup[DesignConfig], ...], tuple[str, ...]]:
    """The setups with reconstructed participants, and what is to be said of them.

    `ConfigError` if no such participants were found.
    """
    codes, people, notes = study.codes(), [], [HONESTY]
    for setup in setups:
        studies = studies_of(setup)
        try:
            law, note = _answers(studies, table_name(setup), paper, codes, seed)
        except ValueError as error:
            raise ConfigError(f"{setup.source}: {error}; try another --seed, or --observer rates") from error
        people.append(replace(setup, laws=_with_law(setup, studies.question, law)))
        notes.append(note)
    return tuple(people), tuple(notes)


def _with_law(setup: Setup[DesignConfig], question: str, law: TableLaw) -> SyntheticAnswers:
    laws = setup.laws if isinstance(setup.laws, SyntheticAnswers) else SyntheticAnswers(questions={})
    return laws.model_copy(update={"questions": laws.questions | {question: law}, "assumed": ()})


def table_name(setup: Setup[DesignConfig]) -> str:
    """The file that holds an experiment's answers."""
    return f"reconstructed_{setup.config.experiment}.csv"


def answers_table(setup: Setup[DesignConfig]) -> bytes:
    """The answers as CSV: a table for the law `table`."""
    laws = setup.laws.questions if isinstance(setup.laws, SyntheticAnswers) else {}
    name, law = next((name, law) for name, law in laws.items() if isinstance(law, TableLaw))
    columns = law.columns(name, scored=setup.config.questions[name].correct is not None)
    return as_csv(columns, ([row[column] for column in columns] for row in law.rows))


def _answers(studies: Drawn, file: str, paper: Paper, codes: Sequence[str], seed: int) -> tuple[TableLaw, str]:
    if isinstance(studies, DirectionStudies):
        return _direction(studies, file, paper.direction, codes, seed)
    return _preference(studies, file, paper.preference, codes, seed)


def _direction(
    studies: DirectionStudies, file: str, paper: PublishedDirection, codes: Sequence[str], seed: int
) -> tuple[TableLaw, str]:
    forward = forward_counts(paper, seed)
    backward = backward_counts(paper, rates_by_method(rates_of(studies), studies.methods, "backward"), seed)
    ways = {"forward": forward.rows, "backward": backward.data[0]}
    rows = tuple(
        {"participant_id": code, "method": method, "direction": way, "correct": str(right)}
        for way, counts in ways.items()
        for code, method, right in _grain_cells(codes, paper, counts)
    )
    each, also = paper.protocol.forward_trials_per_session, paper.protocol.backward_trials_per_session
    return TableLaw(law="table", file=file, by=("method", "direction"), rows=rows), (
        f"Direction, forward: {_totals(paper, forward.rows)} correct of {paper.n * each} give the published means, "
        f"{_f_words(paper, forward)}. Backward: {_totals(paper, backward.data[0])} correct of {paper.n * also}; those "
        "without a published binomial p are assumed."
    )


def _preference(
    studies: RatingStudies, file: str, paper: PublishedPreference, codes: Sequence[str], seed: int
) -> tuple[TableLaw, str]:
    law, scale = studies.law, studies.scale
    least, grain = Fraction(str(scale.minimum)), Fraction(str(scale.grain))
    rebuilt = rating_grains(paper, law.mean, str(scale.grain), law.person_sd, seed)
    rows = tuple(
        {"participant_id": code, "method": method, studies.question: f"{float(least + grain * steps):g}"}
        for code, method, steps in _grain_cells(codes, paper, rebuilt.rows)
    )
    means = ", ".join(f"{method} {law.mean[method]:g}" for method in paper.methods)
    return TableLaw(law="table", file=file, rows=rows), (
        f"Preference: ratings in steps of {float(grain):g} (assumed) with means within {float(MEAN_SLACK):g} of "
        f"{means} (assumed; neither means nor SDs are published), {_f_words(paper, rebuilt)}; "
        f"{paper.lowest.participants} rate {paper.lowest.method} lowest, {paper.same_score.participants} give "
        f"{' and '.join(paper.same_score.methods)} one score."
    )


def _f_words(paper: PublishedExperiment, rebuilt: RebuiltAnswers) -> str:
    found = f"({rebuilt.search.succeeded} of {rebuilt.search.starts} starts of the search succeeded)"
    if rebuilt.nearest_only:
        return f"and F = {rebuilt.F}, the nearest attainable to the published {paper.anova.F} {found}"
    return f"and F = {rebuilt.F} as published {found}"


def _totals(paper: PublishedExperiment, rows: Rows) -> str:
    sums: Mapping[str, int] = dict(zip(paper.methods, map(sum, zip(*rows, strict=True)), strict=True))
    return ", ".join(f"{method} {total}" for method, total in sums.items())


def _grain_cells(codes: Sequence[str], paper: PublishedExperiment, rows: Rows) -> list[tuple[str, str, int]]:
    """Code, method and number of each cell."""
    return [
        (code, method, value)
        for code, row in zip(codes, rows, strict=True)
        for method, value in zip(paper.methods, row, strict=True)
    ]
