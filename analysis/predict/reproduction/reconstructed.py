"""Participants rebuilt from the published numbers, as synthetic ones: setups whose tables answer for them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from analysis.paper.audit.lattices import Rows
from analysis.paper.audit.participants import MEAN_SLACK, RebuiltAnswers, backward_counts, forward_counts, rating_grains
from analysis.paper.paper import Paper, PublishedDirection, PublishedExperiment, PublishedPreference
from experiments.catalogue import CATALOGUE
from experiments.config.door import ConfigError
from experiments.config.models import StudyConfig
from experiments.config.setup import Setup
from experiments.direction.config import DirectionConfig
from experiments.preference.config import PreferenceConfig

Answers = tuple[dict[str, str], ...]
HONESTY = (
    "The participants are reconstructed: one of very many sets of answers that give the published statistics, found by "
    "the seed. They are not the paper's participants, and what is not published of them is assumed."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReconstructedPeople:
    """Setups whose synthetic participants are reconstructed, and what is to be said of them."""

    setups: tuple[Setup[Any], ...]
    notes: tuple[str, ...]


def misfit(study: StudyConfig, setups: Sequence[Setup[Any]], paper: Paper | None) -> str | None:
    """Why the paper's participants do not fit this study; None if they can."""
    if paper is None:
        return "the study names no paper"
    for setup in setups:
        config = setup.config
        published: PublishedExperiment = paper.direction if config.experiment == "direction" else paper.preference
        if study.participants != published.n:
            return f"the study has {study.participants} participants, the paper {published.n}"
        if sorted(config.design.methods) != sorted(published.methods):
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
) -> ReconstructedPeople:
    """The setups with reconstructed participants. `ConfigError` if no such participants were found."""
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
    return ReconstructedPeople(setups=tuple(people), notes=tuple(notes))


def table_name(setup: Setup[Any]) -> str:
    """The file that holds an experiment's answers."""
    return f"reconstructed_{setup.config.experiment}.csv"


def answers_table(setup: Setup[Any]) -> bytes:
    """The answers as CSV: a table for `synthetic.table` of a config."""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, CATALOGUE[setup.config.experiment].answer_columns)
    writer.writeheader()
    writer.writerows(setup.answers)
    return text.getvalue().encode()


def _answers(config: Any, paper: Paper, codes: Sequence[str], seed: int) -> tuple[Answers, str]:
    if isinstance(config, DirectionConfig):
        return _direction(config, paper.direction, codes, seed)
    return _preference(config, paper.preference, codes, seed)


def _direction(
    config: DirectionConfig, paper: PublishedDirection, codes: Sequence[str], seed: int
) -> tuple[Answers, str]:
    forward = forward_counts(paper, seed)
    backward = backward_counts(paper, config.synthetic.rates.backward, seed)
    both = zip(_cells(codes, paper, forward.rows), _cells(codes, paper, backward.data[0]), strict=True)
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
        for code, method, steps in _cells(codes, paper, rebuilt.rows)
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


def _cells(codes: Sequence[str], paper: PublishedExperiment, rows: Rows) -> list[tuple[str, str, int]]:
    """Code, method and number of each cell."""
    return [
        (code, method, value)
        for code, row in zip(codes, rows, strict=True)
        for method, value in zip(paper.methods, row, strict=True)
    ]
