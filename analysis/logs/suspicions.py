"""What logs show only beside each other: that one is a copy of another, and that all answers are turned round."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.logs.doubles import ODDS, STRETCH, Double
from analysis.logs.files import Problem, common_folder, seen_from
from analysis.stats.binomial import binomial_test_p

PersonCalled = Callable[[int, int], str]
"""What the person of a log is called in what is said of another log, by both numbers."""


def copies(
    doubles: Sequence[Double], proven: Collection[int], rank: Callable[[int], tuple[bool, int]], named: PersonCalled
) -> Iterator[tuple[int, str]]:
    """The logs to leave out, each with what is said of it.

    Of those that are alike from end to end one stays: the first by `rank`. Where a part was copied, nobody knows into
    which of both, so that both go, but for what a journal proves; what repeats itself goes.
    """
    stay: dict[int, int] = {}
    for double in doubles:
        if double.whole:
            stay[double.first] = min(stay.get(double.first, double.first), double.second, key=rank)
    for double in doubles:
        first, second = double.first, double.second
        if first == second:
            yield first, _said_of_itself(double)
        elif double.whole:
            stays = stay[first]
            goes = first if second == stays else second
            yield goes, f"holds what the log of participant {named(stays, goes)} holds: {_same(double)}"
        else:
            both = (first, second, double.at), (second, first, double.at[::-1])
            yield from (
                (
                    goes,
                    f"{_rows(at[0])} at least are {_rows(at[1])} of participant {named(other, goes)}: {_same(double)}",
                )
                for goes, other, at in both
                if goes not in proven
            )


def _said_of_itself(double: Double) -> str:
    if double.whole:
        return f"is one part several times over, again from row {double.at[1]} on: {_same(double)}"
    return f"{_rows(double.at[1])} at least repeat {_rows(double.at[0])}: {_same(double)}"


def _rows(first: int) -> str:
    return f"rows {first} to {first + STRETCH - 1}"


def _same(double: Double) -> str:
    same = "all that was asked and answered" + (", and the response times to the ms" if double.timed else "")
    rule = f"(rule: by chance that is so less than once in {ODDS:,.0f}, and answers count once)"
    return f"{same} {rule}; find out whose they are, and take the copy out"


def other_log(code: str, path: str, beside: str) -> str:
    """A participant with their file, as it is seen from another one's."""
    return code if path == beside else f"{code} in {seen_from(path, beside)}"


_CHANCE = 1e-3


def turned_round(trials: pd.DataFrame, paths: Sequence[str]) -> Iterator[Problem]:
    """What there is to say where nobody is right more often than by chance, and all together less often."""
    known = trials[trials["correct"].notna()]
    right = known.groupby("participant_id", observed=True)["correct"].agg(["sum", "size"]).astype(np.int64)
    total, count = int(right["sum"].sum()), int(right["size"].sum())
    if not count or (2 * right["sum"] >= right["size"]).any() or binomial_test_p(total, count, 0.5, "less") >= _CHANCE:
        return
    people = f"each of {len(right)} people is" if len(right) > 1 else "the one participant is"
    yield Problem(
        file=Path(common_folder(paths)),
        line=None,
        column=None,
        message=f"{people} right in fewer than half of the trials, in {total} of {count} altogether "
        f"(p < {_CHANCE:g} by guessing): are answers or directions turned round, by the map, in the files, or by how "
        "the gun was held? A log cannot tell by itself; a column `correct` of the program that asked can",
    )
