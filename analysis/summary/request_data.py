"""The scores and trials that requests are answered from, as the statistics of the report take them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import pandas as pd
from pydantic import JsonValue

from analysis.logs.exclusions import complete_rows
from analysis.logs.measures import MEASURES
from analysis.logs.names import MethodNames
from analysis.logs.reading import Logs
from analysis.stats.cells import coded
from analysis.summary.conditions import varied
from analysis.summary.design_comparisons import nested_between
from analysis.summary.designs import question_scores
from analysis.summary.requests import (
    LOGARITHMS,
    AnyRequest,
    RequestData,
    Requested,
    RequestNames,
    Requests,
    answer_to,
    bounds_in,
)
from analysis.summary.summary import methods_in
from experiments.config.door import ConfigError, at_key
from experiments.design.config import DesignConfig
from experiments.design.language import METHOD_FACTOR, Level, QuestionConfig, shown_level


def answers_to(asked: Requests, path: Path, logs: Logs) -> tuple[Requested, ...]:
    """The answers to the requests of a file, in its order. `ConfigError` with the line of each that has none."""
    found, faults = [], []
    for place, request in enumerate(asked.requests):
        try:
            found.append(answer_to(request, request_data(logs, request)))
        except ValueError as error:
            faults.append(at_key(path, f"requests.{place}: {error}"))
    if faults:
        raise ConfigError("\n".join(faults))
    return tuple(found)


def frozen_answer(test: JsonValue, logs: Logs) -> Requested:
    """The answer to a test as a preregistration holds it. `ValueError`: the data have not what it names."""
    (request,) = Requests.model_validate_json(json.dumps({"requests": [test]})).requests
    found = answer_to(request, request_data(logs, request))
    return replace(found, note=f"Asked for by the preregistration. {found.note}")


def request_data(logs: Logs, request: AnyRequest) -> RequestData:
    """What a request is about. `ValueError`: no such logs, or no such question."""
    there = {name: table for name, table in logs.tables.items() if len(table)}
    designs = {one.design.design: one for one in logs.designs}
    if request.of in there:
        _refuse_question(request.of, request.question)
        return _of_experiment(request.of, there[request.of], logs.methods)
    if request.of in designs:
        return _of_design(designs[request.of].design, request.question, designs[request.of].table)
    raise ValueError(f"of = {request.of!r}: there are no logs of it; there are some of {', '.join((*there, *designs))}")


def planned_names(design: DesignConfig, asked: str | None) -> RequestNames:
    """What a request may name in the data that a design gives. `ValueError`: of no such question, or of none tested."""
    if design.design in MEASURES:
        _refuse_question(design.design, asked)
        methods = design.factors[METHOD_FACTOR].all_levels
        return RequestNames(conditions=tuple(map(str, methods)), factors={METHOD_FACTOR: methods})
    _question(design, asked)
    within = [name for name in varied(design) if name not in design.between]
    conditions = tuple(_conditions(_met(design, within))) if within else ("score",)
    return _names(design, conditions)


def _met(design: DesignConfig, within: Sequence[str]) -> Iterator[tuple[Level, ...]]:
    """The levels of these factors that meet: of a nested one those alone that its outer factor's level has."""
    outer = {name: design.factors[name].within for name in within}
    for levels in product(*(design.factors[name].all_levels for name in within)):
        at: dict[str | None, Level] = dict(zip(within, levels, strict=True))
        if all(at[one] in design.factors[one].levels_within(at[of]) for one, of in outer.items() if of in at):
            yield levels


def _names(design: DesignConfig, conditions: tuple[str, ...]) -> RequestNames:
    return RequestNames(
        conditions=conditions,
        factors=_factors(design),
        grouped=bool(design.between),
        parted=tuple(nested_between(design)),
    )


def unit_of_bounds(design: DesignConfig, asked: str | None) -> str:
    """In what the bounds of an equivalence test of a design's scores are."""
    if design.design in MEASURES:
        return bounds_in(MEASURES[design.design].unit, shares=MEASURES[design.design].scale == (0.0, 1.0))
    question = design.questions[_question(design, asked)]
    return bounds_in(_unit(question), shares=question.kind in _SHARES)


def _refuse_question(name: str, asked: str | None) -> None:
    if asked is not None:
        raise ValueError(f"question: {name} has one measure; leave the key out")


def _question(design: DesignConfig, asked: str | None) -> str:
    """The question that is asked about; without one, the only one that is not of words."""
    names = [name for name, question in design.questions.items() if question.kind != "text"]
    if not names:
        raise ValueError(f"{design.design} asks for words alone, which are described, not tested")
    if asked is None and len(names) > 1:
        raise ValueError(f"question: say which one; {design.design} has {', '.join(names)}")
    name = asked or names[0]
    if name not in names:
        raise ValueError(f"question = {asked!r}: {design.design} has {', '.join(names)}")
    if design.trial.kind == "pair":
        raise ValueError("pairs are described, not tested")
    return name


def _factors(design: DesignConfig) -> dict[str, tuple[Level, ...]]:
    return {name: factor.all_levels for name, factor in design.factors.items() if len(factor.all_levels) > 1}


def _of_experiment(name: str, table: pd.DataFrame, called: MethodNames) -> RequestData:
    """Everybody who is complete."""
    measure = MEASURES[name]
    methods = methods_in(table, called)
    rows = complete_rows(coded(table), name, methods)[0]
    if measure.direction is not None:
        rows = rows[rows["direction"] == measure.direction]
    trials = pd.DataFrame(
        {
            "participant_id": rows["participant_id"].astype(str),
            "method": rows["method"].astype(str),
            "score": rows[measure.score].astype("float64"),
        }
    )
    scores = trials.pivot_table(index="participant_id", columns="method", values="score").reindex(columns=methods)
    names = RequestNames(conditions=tuple(methods), factors={METHOD_FACTOR: tuple(methods)})
    shares = measure.scale == (0.0, 1.0)
    return RequestData(scores=scores, trials=trials, unit=measure.unit, shares=shares, names=names)


def _of_design(design: DesignConfig, asked: str | None, table: pd.DataFrame) -> RequestData:
    name = _question(design, asked)
    found = question_scores(design, name, table)
    conditions = tuple(_conditions(found.people.columns))
    return RequestData(
        scores=found.people.set_axis([*conditions], axis=1),
        trials=found.real,
        unit=_unit(design.questions[name]),
        shares=design.questions[name].kind in _SHARES,
        names=_names(design, conditions),
    )


_SHARES = frozenset({"choice", "yes-no"})
"""Questions whose scores are shares of answers."""


def _unit(question: QuestionConfig) -> str:
    """What a score of a question is, as `question_scores` has it."""
    if question.kind in {"rating", "ranking"}:
        return f"{question.kind}s"
    if question.kind == "number":
        return LOGARITHMS
    return "right answers" if question.correct is not None else f"answers {question.named_answers[0]}"


def _conditions(columns: Iterable[object]) -> Iterator[str]:
    """Conditions by their levels."""
    for levels in columns:
        yield "/".join(map(shown_level, levels if isinstance(levels, tuple) else (levels,)))
