"""The columns of the log table that a design makes: which there are, what each means, what each may hold. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from experiments.design.config import DesignConfig
from experiments.design.language import FactorConfig, QuestionConfig, shown_level
from experiments.design.plan import in_interval
from experiments.design.units import parted
from experiments.record import tables
from experiments.record.tables import Column
from experiments.tasks.questions import correct_columns


def columns(design: DesignConfig) -> tuple[Column, ...]:
    """The columns of a design's table: who and where, factors, questions, and how the trial was presented.

    A factor stands where it is constant: beside the session, beside the set, or beside the trial.
    """
    return (*_places(design), *_questions(design), *_presentation(design))


def _places(design: DesignConfig) -> Iterator[Column]:
    yield tables.PARTICIPANT
    yield tables.level_column("experiment", (design.design,), "which design", required=True)
    in_session, in_set = (*design.between, *design.order.session), design.order.set
    if design.table == "trials":
        yield tables.integer_column("session", "session, from 1, in order of presentation", required=True)
    yield from _factors(design, in_session)
    if design.table == "trials":
        yield tables.SET
    yield from _factors(design, in_set)
    yield tables.integer_column("trial", "trial within the session, from 1, in order of presentation", required=True)
    if design.adaptive is not None:
        yield tables.integer_column("track", "adaptive track, from 1; empty of a catch trial")
    if design.trial.catch:
        yield tables.flag_column("stimulus", "1 if there was a stimulus, 0 in a catch trial")
    yield from _factors(design, design.varying)


def _factors(design: DesignConfig, names: Iterable[str]) -> Iterator[Column]:
    for name in names:
        factor, compared = design.factors[name], name == design.trial.compare
        chosen = _CHOSEN if name in design.adapted else ""
        if not (compared and design.trial.kind == "pair"):
            what = "level that was compared" if compared else tables.KNOWN_FACTORS.get(name, "level of this factor")
            yield _factor(name, name, factor, what + chosen)
        if compared:
            for place in range(1, design.trial.intervals + 1):
                own = chosen if in_interval(name, place) in design.chosen_names else "; empty if there was no stimulus"
                yield _factor(name, in_interval(name, place), factor, f"level in interval {place}{own}")


_CHOSEN = ", chosen by the answers before; empty if it was not felt"


def _factor(name: str, column: str, factor: FactorConfig, description: str) -> Column:
    """A column of a factor's levels; the unit ends the factor's name, not always the column's.

    A unit that nobody knows here, as in angle_deg, is one all the same.
    """
    if isinstance(factor.all_levels[0], float):
        own = name.rsplit("_", 1)[-1] if "_" in name else ""
        return tables.number_column(column, parted(name).unit.replace("_", "/") or own, description)
    return tables.level_column(column, tuple(map(shown_level, factor.all_levels)), description)


def _questions(design: DesignConfig) -> Iterator[Column]:
    scored = correct_columns(design.questions)
    for name, question in design.questions.items():
        yield _answer(name, question)
        if name in scored:
            yield tables.flag_column(scored[name], "1 if the answer was right, 0 if not; empty without one")
        if question.named_answers:
            yield tables.seconds_column(
                f"{name}_time_s", "time from the onset of the last stimulus to the answer; empty if there is none"
            )
            yield tables.level_column(f"{name}_source", tables.HANDS, "whose hand gave the answer")
            yield tables.flag_column(f"{name}_time_valid", tables.TIME_VALID)
        elif question.kind != "text":
            yield tables.level_column(f"{name}_by", tables.HANDS, "whose hand entered it")


def _answer(name: str, question: QuestionConfig) -> Column:
    match question.kind:
        case "choice" | "yes-no":
            return tables.level_column(
                name, question.named_answers, "what the participant said; empty if never answered"
            )
        case "rating":
            low, high = question.minimum_text or "lower end", question.maximum_text or "upper end"
            ends = f"{question.minimum:g} ({low}) to {question.maximum:g} ({high})"
            return tables.bounded_column(name, f"{ends}; empty means none was given", *question.scale)
        case "number":
            said = "the number that the participant said; empty means none was given"
            return tables.bounded_column(name, said, *question.scale)
        case "ranking":
            meaning = f"rank among the trials of the block, 1 = {question.minimum_text}; empty means none was given"
            return tables.integer_column(name, meaning, most=tables.MOST_OFTEN)
        case "text":
            return tables.text_column(name, "the participant's own words")


def _presentation(design: DesignConfig) -> Iterator[Column]:
    if design.trial.kind == "train":
        yield from tables.EXPOSURE
    if design.below_break_away:
        said = "what the model says of each shot of the last presentation: `home`, `no-break-away` or `rendered`"
        yield tables.text_column("status", said)
    yield from tables.PRESENTATION
