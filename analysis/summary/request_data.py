"""The scores and trials that requests are answered from, as the statistics of the report take them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd
from pydantic import JsonValue

from analysis.logs.exclusions import complete_rows
from analysis.logs.measures import MEASURES
from analysis.logs.names import MethodNames
from analysis.logs.reading import Logs
from analysis.stats.cells import coded
from analysis.summary.designs import question_scores
from analysis.summary.requests import AnyRequest, RequestData, Requested, Requests, answer_to
from analysis.summary.summary import methods_in
from experiments.config.door import ConfigError, read_text
from experiments.config.findings import line_of
from experiments.design.config import DesignConfig
from experiments.design.language import QuestionConfig, shown_level


def answers_to(asked: Requests, path: Path, logs: Logs) -> tuple[Requested, ...]:
    """The answers to the requests of a file, in its order. `ConfigError` with the line of each that has none."""
    found, faults = [], []
    for place, request in enumerate(asked.requests):
        try:
            found.append(answer_to(request, request_data(logs, request)))
        except ValueError as error:
            line = line_of(read_text(path), ["requests", str(place)])
            faults.append(f"{path}{f':{line}' if line else ''}: requests.{place}: {error}")
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
        if request.question is not None:
            raise ValueError(f"question: {request.of} has one measure; leave the key out")
        return _of_experiment(request.of, there[request.of], logs.methods)
    if request.of in designs:
        return _of_design(designs[request.of].design, request.question, designs[request.of].table)
    raise ValueError(f"of = {request.of!r}: there are no logs of it; there are some of {', '.join((*there, *designs))}")


def _of_experiment(name: str, table: pd.DataFrame, names: MethodNames) -> RequestData:
    """Everybody who is complete."""
    measure = MEASURES[name]
    methods = methods_in(table, names)
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
    return RequestData(scores=scores, trials=trials, factors={"method": tuple(methods)}, unit=measure.unit)


def _of_design(design: DesignConfig, asked: str | None, table: pd.DataFrame) -> RequestData:
    names = [name for name, question in design.questions.items() if question.kind != "text"]
    if asked is None and len(names) > 1:
        raise ValueError(f"question: say which one; {design.design} has {', '.join(names)}")
    name = asked or names[0]
    if name not in names:
        raise ValueError(f"question = {asked!r}: {design.design} has {', '.join(names)}")
    if design.trial.kind == "pair":
        raise ValueError("pairs are described, not tested")
    found = question_scores(design, name, table)
    levels = {one: factor.all_levels for one, factor in design.factors.items() if len(factor.all_levels) > 1}
    scores = found.people.set_axis([*_conditions(found.people.columns)], axis=1)
    unit = _unit(design.questions[name])
    return RequestData(scores=scores, trials=found.real, factors=levels, unit=unit, grouped=bool(design.between))


def _unit(question: QuestionConfig) -> str:
    """What a score of a question is, as `question_scores` has it."""
    if question.kind in {"rating", "ranking"}:
        return f"{question.kind}s"
    if question.kind == "number":
        return "natural logarithms of the numbers"
    return "right answers" if question.correct is not None else f"answers {question.named_answers[0]}"


def _conditions(columns: Iterable[object]) -> Iterator[str]:
    """Conditions by their levels."""
    for levels in columns:
        yield "/".join(map(shown_level, levels if isinstance(levels, tuple) else (levels,)))
