"""`recoil reproduce`: a study with synthetic participants, drawn or rebuilt from the published numbers.

Every part is the one that live sessions use; only the clock is virtual, so that breaks take no time. The odds are over
participants of the same config, whose logs are not written.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from analysis.predict.simulate.shot import shot_panel
from analysis.predict.synthetic_studies import pattern_odds
from analysis.report.serial import as_csv
from analysis.summary.comparison import compare
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.sections import obtained_text, write_report
from analysis.summary.summary import summarize
from device.parameters import GunParameters
from experiments.catalogue import CATALOGUE, rebuild
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError, StudyConfig
from experiments.config.setup import Setup, sha256
from experiments.direction.config import DirectionConfig
from experiments.load import load_setup, load_study
from experiments.preference.config import PreferenceConfig
from experiments.record import storage
from experiments.record.journal import begun
from experiments.record.provenance import git_commit, provenance, recoil_version
from experiments.run import RunRequest, run
from experiments.screens.synthetic import synthetic_screen
from experiments.study import folders

MANIFEST = "reproduction.json"

Observer = Literal["reconstructed", "rates"]
"""Who answers: participants rebuilt from the published numbers, or those that the configs describe."""

Tell = Callable[[str], None]
"""Told what was done, once a run and once a part of the analysis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedStudy:
    """A study ready to run: its config, its experiments' setups, the seed and the published numbers.

    `answering`: the setups with the participants who answer; `findings`: the audit of the published numbers.
    """

    config: StudyConfig
    setups: tuple[Setup[Any], ...]
    answering: tuple[Setup[Any], ...]
    seed: int
    paper: Paper | None
    findings: tuple[AuditFinding, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def reconstructed(self) -> bool:
        """Are the participants rebuilt from the published numbers?"""
        return self.answering != self.setups

    @property
    def runs(self) -> list[tuple[Setup[Any], str]]:
        """Each experiment with each participant."""
        return [(setup, code) for code in self.config.codes() for setup in self.answering]

    def manifest(self) -> dict[str, object]:
        """What makes one reproduction the same as another."""
        setups = sha256([setup.record() for setup in self.answering])
        return {
            "seed": self.seed,
            "participants": self.config.codes(),
            "setups_sha256": setups,
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
    setups = tuple(load_setup(str(folder / experiment)) for experiment in config.experiments)
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


def reproduce(study: ReproducedStudy, out: Path, tell: Tell) -> Reproduced:
    """Run, log, analyse and report a study into `out`.

    An unfinished reproduction of the same study is gone on with; another one in `out` is set aside.
    """
    _claim(study, out)
    for setup, code in study.runs:
        _take_part(study, setup, code, out / "logs")
        tell(f"{code} {setup.config.experiment}")
    logs = read_logs([out / "logs"])
    statistics = summarize(logs)
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


def _take_part(study: ReproducedStudy, setup: Setup[Any], code: str, results: Path) -> None:
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
        config = setup.config
        if config.synthetic.observer in ("rates", "ratings"):
            published: PublishedExperiment = getattr(study.paper, config.experiment)
            yield pattern_odds(config, published, study.config.replications, study.seed)


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
        notes=tuple(_notes(study)),
    )


def _panels(setup: Setup[Any]) -> Iterator[Any]:
    for method in setup.config.methods:
        parameters = setup.gun.rendering(method)
        if isinstance(parameters, GunParameters):
            label = setup.gun.methods[method].label
            yield shot_panel(f"{label} (friction {parameters.friction_N:g} N)", parameters)


def _notes(study: ReproducedStudy) -> Iterator[str]:
    """What the numbers rest on beyond the paper."""
    yield from study.notes
    gun = study.setups[0].gun
    coil = gun.coil
    yield f"The coil after the pulse is {coil.drive_off}, its back-EMF is {coil.emf}; the paper leaves both open."
    for setup in study.setups:
        keys = ", ".join(setup.config.assumed)
        yield f"Assumed or fitted for {setup.config.experiment}, not in the paper: {keys}."
    yield f"Assumed for the gun, not in the paper: {', '.join(gun.assumed)}."


Answers = tuple[dict[str, str], ...]
HONESTY = (
    "The participants are reconstructed: one of very many sets of answers that give the published statistics, found by "
    "the seed. They are not the paper's participants, and what is not published of them is assumed."
)


def misfit(study: StudyConfig, setups: Sequence[Setup[Any]], paper: Paper | None) -> str | None:
    """Why the paper's participants do not fit this study; None if they can."""
    if paper is None:
        return "the study names no paper"
    for setup in setups:
        config = setup.config
        published: PublishedExperiment = paper.direction if config.experiment == "direction" else paper.preference
        if study.participants != published.n:
            return f"the study has {study.participants} participants, the paper {published.n}"
        if sorted(config.methods) != sorted(published.methods):
            return f"{config.experiment} has other methods than the paper"
        if config.synthetic.observer == "table":
            return f"the answers of {config.experiment} come from a table of its own"
        if reason := _other_trials(config, paper):
            return reason
    return None


def _other_trials(config: DirectionConfig | PreferenceConfig, paper: Paper) -> str | None:
    if isinstance(config, DirectionConfig):
        protocol, design = paper.direction.protocol, config.design
        planned = (design.forward_per_session, design.backward_per_session)
        same = planned == (protocol.forward_trials_per_session, protocol.backward_trials_per_session)
        return None if same else "direction has other numbers of trials than the paper"
    scale = paper.preference.scale_min, paper.preference.scale_max
    return None if (config.rating.minimum, config.rating.maximum) == scale else "preference has another scale"


def reconstructed_people(
    study: StudyConfig, setups: Sequence[Setup[Any]], paper: Paper, seed: int
) -> tuple[tuple[Setup[Any], ...], tuple[str, ...]]:
    """The setups with reconstructed participants, and what is to be said of them.

    `ConfigError` if no such participants were found.
    """
    codes, people, notes = study.codes(), [], [HONESTY]
    for setup in setups:
        try:
            answers, note = _answers(setup.config, paper, codes, seed)
        except ValueError as error:
            raise ConfigError(f"{setup.source}: {error}; try another --seed, or --observer rates") from error
        synthetic = setup.config.synthetic.model_copy(update={"observer": "table", "table": table_name(setup)})
        config = setup.config.model_copy(update={"synthetic": synthetic})
        people.append(replace(setup, config=config, answers=answers))
        notes.append(note)
    return tuple(people), tuple(notes)


def table_name(setup: Setup[Any]) -> str:
    """The file that holds an experiment's answers."""
    return f"reconstructed_{setup.config.experiment}.csv"


def answers_table(setup: Setup[Any]) -> bytes:
    """The answers as CSV: a table for `synthetic.table` of a config."""
    columns = CATALOGUE[setup.config.experiment].answer_columns
    return as_csv(columns, ([row[name] for name in columns] for row in setup.answers))


def _answers(config: Any, paper: Paper, codes: Sequence[str], seed: int) -> tuple[Answers, str]:
    if isinstance(config, DirectionConfig):
        return _direction(config, paper.direction, codes, seed)
    return _preference(config, paper.preference, codes, seed)


def _direction(
    config: DirectionConfig, paper: PublishedDirection, codes: Sequence[str], seed: int
) -> tuple[Answers, str]:
    forward = forward_counts(paper, seed)
    backward = backward_counts(paper, config.synthetic.rates.backward, seed)
    both = zip(_grain_cells(codes, paper, forward.rows), _grain_cells(codes, paper, backward.data[0]), strict=True)
    answers = tuple(
        {"participant_id": code, "method": method, "forward_correct": str(right), "backward_correct": str(back)}
        for (code, method, right), (_, _, back) in both
    )
    each, also = paper.protocol.forward_trials_per_session, paper.protocol.backward_trials_per_session
    return answers, (
        f"Direction, forward: {_totals(paper, forward.rows)} correct of {paper.n * each} give the published means, "
        f"{_f_words(paper, forward)}. Backward: {_totals(paper, backward.data[0])} correct of {paper.n * also}; those "
        "without a published binomial p are assumed."
    )


def _preference(
    config: PreferenceConfig, paper: PublishedPreference, codes: Sequence[str], seed: int
) -> tuple[Answers, str]:
    law, grain = config.synthetic.ratings, Fraction(str(config.rating.grain))
    rebuilt = rating_grains(paper, law.mean, str(config.rating.grain), law.person_sd, seed)
    least = Fraction(str(config.rating.minimum))
    answers = tuple(
        {"participant_id": code, "method": method, "rating": f"{float(least + grain * steps):g}"}
        for code, method, steps in _grain_cells(codes, paper, rebuilt.rows)
    )
    means = ", ".join(f"{method} {law.mean[method]:g}" for method in paper.methods)
    return answers, (
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
