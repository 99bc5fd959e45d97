"""Who takes part in a reproduction: participants rebuilt from the published numbers, if those fit the study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from analysis.paper.audit.lattices import Rows
from analysis.paper.audit.participants import MEAN_SLACK, RebuiltAnswers, backward_counts, forward_counts, rating_grains
from analysis.paper.paper import Paper, PublishedDirection, PublishedExperiment, PublishedPreference
from analysis.predict.drawn import DirectionStudies, Drawn, RatingStudies, rates_by_method, studies_of
from analysis.predict.synthetic_studies import rates_of
from analysis.report.serial import as_csv
from experiments.config.door import ConfigError, StudyConfig
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.synthetic.laws import DiffusionLaw, SyntheticAnswers, TableLaw

HONESTY = (
    "The participants are reconstructed: one of very many sets of answers that give the published statistics, found by "
    "the seed. They are not the paper's participants, and what is not published of them is assumed."
)


def misfit(study: StudyConfig, setups: Sequence[Setup[DesignConfig]], paper: Paper | None) -> str | None:
    """Why the paper's participants do not fit this study; None if they can."""
    if paper is None:
        return "the study names no paper"
    for setup in setups:
        studies = drawn_studies(setup)
        if studies is None:
            return f"the people of {setup.config.design} answer by another law than rates or ratings by method"
        if reason := _other_people(study, studies, published_of(studies, paper)) or _other_trials(studies, paper):
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
            raise ConfigError(f"{setup.source}: {error}; try another --seed, or --synthetic rates") from error
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


def drawn_studies(setup: Setup[DesignConfig]) -> Drawn | None:
    """The studies of a design whose people are right at rates or rate by means; `None` of others."""
    try:
        found = studies_of(setup)
    except ConfigError:
        return None
    return None if isinstance(found.law, DiffusionLaw) else found


def published_of(studies: Drawn, paper: Paper) -> PublishedExperiment:
    """The paper's numbers of the experiment that studies repeat."""
    return paper.preference if isinstance(studies, RatingStudies) else paper.direction


def missing_methods(studies: Drawn, published: PublishedExperiment) -> list[str]:
    """The methods of the paper that a study does without, so that its claims cannot recur."""
    return [method for method in published.methods if method not in studies.methods]
