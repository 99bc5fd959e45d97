"""What files ask for beside the statistics: tests of one's own, those that were frozen, remarks coded by a codebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd
from pydantic import JsonValue

from analysis.logs.reading import Logs
from analysis.summary.remarks_coding import Codebook, CodedRemarks, WrittenRemark, code_remarks
from analysis.summary.request_data import answers_to, frozen_answer
from analysis.summary.requests import Requested, Requests
from analysis.summary.results import StudyStatistics
from experiments.config.door import ConfigError
from experiments.design.language import METHOD_FACTOR


@dataclass(frozen=True, slots=True, kw_only=True)
class AskedFor:
    """A codebook, the requests in the file at `path`, and the `frozen` tests that are made where no others are."""

    codebook: Codebook | None
    requests: Requests | None
    path: Path | None
    frozen: Sequence[JsonValue]


def with_answers(
    asked: AskedFor, statistics: StudyStatistics, logs: Logs, *, apart: bool
) -> tuple[StudyStatistics, tuple[JsonValue, ...]]:
    """The statistics with the answers to all that is asked for, and those of the frozen tests that were made.

    `ConfigError`: the data have not what is asked about; where they are kept `apart`, that is a warning.
    """
    for answer in (_with_remarks, _with_requested):
        try:
            statistics = answer(asked, statistics, logs)
        except ConfigError as error:
            if not apart:
                raise
            statistics = replace(statistics, warnings=(*statistics.warnings, f"not answered here: {error}"))
    return _with_frozen(asked.frozen, statistics, logs) if asked.frozen else (statistics, ())


def _with_remarks(asked: AskedFor, statistics: StudyStatistics, logs: Logs) -> StudyStatistics:
    book = asked.codebook
    return statistics if book is None else replace(statistics, remarks=_coded(logs, statistics, book))


def _with_requested(asked: AskedFor, statistics: StudyStatistics, logs: Logs) -> StudyStatistics:
    if asked.requests is None or asked.path is None:
        return statistics
    return replace(statistics, requested=answers_to(asked.requests, asked.path, logs))


def _with_frozen(
    tests: Sequence[JsonValue], statistics: StudyStatistics, logs: Logs
) -> tuple[StudyStatistics, tuple[JsonValue, ...]]:
    """The statistics with the tests that were frozen, as far as the data have what they name, and those tests."""
    found, made, warnings = list[Requested](), list[JsonValue](), list[str]()
    for place, test in enumerate(tests):
        try:
            found.append(frozen_answer(test, logs))
        except ValueError as error:
            warnings.append(f"a frozen test is not made: requests.{place}: {error}")
        else:
            made.append(test)
    said = (*statistics.warnings, *warnings)
    return replace(statistics, requested=tuple(found) or None, warnings=said), tuple(made)


def _coded(logs: Logs, statistics: StudyStatistics, book: Codebook) -> CodedRemarks:
    """What people said in their own words, coded. `ConfigError` if the codebook does not fit that."""
    found = [*_written(logs, statistics)]
    if not found:
        raise ConfigError("the codebook: nobody who is analysed was asked for words")
    remarks = [remark for _, remark in found if remark is not None]
    try:
        return code_remarks(remarks, list(dict.fromkeys(who for who, _ in found)), book)
    except ValueError as error:
        raise ConfigError(f"the codebook: {error}") from error


def _written(logs: Logs, statistics: StudyStatistics) -> Iterator[tuple[str, WrittenRemark | None]]:
    """What was asked for in words of whom: every analysed participant once at least."""
    if statistics.preference is not None:
        analysed = dict.fromkeys(statistics.preference.participants.codes)
        yield from analysed.items()
        yield from (one for one in _remarks_in(logs.ratings, "comment") if one[0] in analysed)
    for one in logs.designs:
        for name, question in one.design.questions.items():
            if question.kind == "text":
                yield from _remarks_in(one.table, name)


def _remarks_in(table: pd.DataFrame, name: str) -> Iterator[tuple[str, WrittenRemark]]:
    methods = table[METHOD_FACTOR] if METHOD_FACTOR in table else table["participant_id"].map(lambda _: "")
    columns = table["participant_id"].astype(str), methods.astype(str), table[name].fillna("").astype(str)
    for who, method, text in zip(*columns, strict=True):
        yield who, WrittenRemark(participant=who, method=method, text=text)
