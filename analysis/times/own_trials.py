"""The trials of a log whose times are the answerer's own, who may be timed, and the spread of response times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import BoolArray, FloatArray, IndexArray, numbers
from analysis.stats.cells import Finite, codes_of, places_among
from device.words import DIRECTIONS
from experiments.synthetic.model_based import NEUTRAL

OWN_SOURCES = ("participant", "synthetic")
"""The values of `response_source` whose times are the answerer's own."""
REASON = (
    "such a time holds the spoken answer and the experimenter's reaction to it as well, so it says nothing of the "
    "participant's speed: leave these rows out, or let the participant answer by hand"
)


def own_times(time_s: ArrayLike, sources: Sequence[str] | ArrayLike) -> FloatArray:
    """The response times in s, if each is above 0 and its `response_source` the participant or a synthetic one.

    `ValueError` naming the first row that is not so, with the reason; rows count from 0.
    """
    times, names = numbers(time_s, "response_time_s"), np.asarray(sources, dtype=np.str_)
    if times.ndim != 1 or names.shape != times.shape:
        raise ValueError(
            f"response_time_s and response_source must be columns of one length, not {times.shape} and {names.shape}"
        )
    foreign = np.flatnonzero(~np.isin(names, OWN_SOURCES))
    if foreign.size:
        raise ValueError(
            f"{foreign.size} of {times.size} response times are not the participant's own; the first, row "
            f"{foreign[0]}, has response_source {str(names[foreign[0]])!r}: {REASON}"
        )
    if not (times > 0.0).all():
        row = int(np.argmax(~(times > 0.0)))
        raise ValueError(f"response_time_s must be above 0, but row {row} has {times[row]:g}")
    return times


def answers(values: ArrayLike, name: str, count: int) -> FloatArray:
    """`values` as zeros and ones, one of each of `count` rows; else `ValueError`."""
    found = numbers(values, name)
    if found.shape != (count,) or not np.isin(found, (0.0, 1.0)).all():
        raise ValueError(f"{name} must be {count} values of 0 or 1")
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ordered:
    """Rows of trials, person after person in the codes' sorted order, each one's by time; equal times as they stood."""

    rows: IndexArray
    count: IndexArray  # of each person's trials

    @property
    def people(self) -> int:
        """How many people there are."""
        return int(self.count.size)

    @property
    def person(self) -> IndexArray:
        """The person of each row, from 0."""
        return np.repeat(np.arange(self.people), self.count)

    @property
    def rank(self) -> IndexArray:
        """The place of each row among its person's, from 0."""
        first = np.cumsum(self.count) - self.count
        return np.asarray(np.arange(self.rows.size) - np.repeat(first, self.count))

    def means(self, values: FloatArray) -> FloatArray:
        """Each person's mean of `values`, one a trial in the order of the table."""
        return np.bincount(self.person, weights=values[self.rows], minlength=self.people) / self.count

    def only(self, chosen: NDArray[np.bool_]) -> Ordered:
        """Of these trials alone, one flag a trial in the order of the table; who has none of them is gone."""
        kept = chosen[self.rows]
        counts = np.bincount(self.person[kept], minlength=self.people)
        return Ordered(rows=self.rows[kept], count=counts[counts > 0])

    def of_at_least(self, fewest: int) -> Ordered:
        """Of the people who have so many trials."""
        return self.of(self.count >= fewest)

    def of(self, people: NDArray[np.bool_]) -> Ordered:
        """Of these people alone, one flag a person."""
        return Ordered(rows=self.rows[np.repeat(people, self.count)], count=self.count[people])


def ordered(people: ArrayLike, time_s: FloatArray) -> Ordered:
    """The rows of each person. `ValueError`: not one code a row."""
    codes = np.asarray(people)
    if codes.shape != time_s.shape:
        raise ValueError(f"people must be {time_s.size} codes, one a row, not {codes.shape}")
    rows = np.arange(codes.size) if _in_order(codes, time_s) else np.lexsort((time_s, codes))
    sorted_codes = codes[rows]
    begins = np.flatnonzero(np.append(True, sorted_codes[1:] != sorted_codes[:-1])[: codes.size])
    return Ordered(rows=rows, count=np.diff(np.append(begins, codes.size)))


def _in_order(codes: NDArray[Any], time_s: FloatArray) -> bool:
    later = codes[1:] > codes[:-1]
    return bool((later | ((codes[1:] == codes[:-1]) & (time_s[1:] >= time_s[:-1]))).all())


def quantiles(time_s: FloatArray, by: Ordered, shares: Sequence[float]) -> FloatArray:
    """Each person's quantiles (people, shares) of the times, interpolated linearly.

    >>> times = np.array([1.0, 2.0, 4.0, 7.0])
    >>> quantiles(times, ordered(["a", "a", "a", "b"], times), [0.5, 0.75]).tolist()
    [[2.0, 3.0], [7.0, 7.0]]
    """
    times = time_s[by.rows]
    first = (np.cumsum(by.count) - by.count)[:, None]
    wanted = (by.count - 1)[:, None] * np.asarray(shares, dtype=np.float64)
    below = np.floor(wanted).astype(np.intp)
    low, high = times[first + below], times[first + np.minimum(below + 1, by.count[:, None] - 1)]
    return np.asarray(low + (high - low) * (wanted - below))


INSTRUCTION = "instruction"
"""The optional column that says what the participant was told."""
INSTRUCTION_ORDER = ("speed", NEUTRAL, "accuracy")

REFUSALS = {
    "experimenter": f"the time came from the experimenter's hand: {REASON}",
    "no_source": "response_source is empty: nobody knows whose hand the time came from",
    "no_time": "there is no time",
    "not_valid": "response_time_valid is not 1: the time is not said to be the participant's own",
    "not_above_0": "the time is not above 0",
}
"""Why an answered trial is refused; of several reasons the first counts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timed:
    """Which trials of a table are answered with a time of the answerer's own, and why the other answered ones are not.

    `by_own_hand`: the log says that the time is the participant's own, also where it is zero or below.
    """

    own: BoolArray
    by_own_hand: BoolArray
    answered: int
    refused: dict[str, int]  # reason in `REFUSALS` -> trials


def timed(trials: pd.DataFrame) -> Timed:
    """Look at every trial of a log: the one rule of what is a valid response time."""
    sources, source = _names(trials["response_source"])
    time_s = trials["response_time_s"].to_numpy(dtype=np.float64)
    faults = {
        "experimenter": (sources == "experimenter")[source],
        "no_source": ~np.isin(sources, (*OWN_SOURCES, "experimenter"))[source],
        "no_time": np.isnan(time_s),
        "not_valid": ~(trials["response_time_valid"] == 1).fillna(value=False).to_numpy(dtype=np.bool_),
        "not_above_0": time_s <= 0.0,
    }
    answered = trials["correct"].notna().to_numpy(dtype=np.bool_)
    left, refused = answered, dict[str, int]()
    for reason, fault in faults.items():
        refused[reason] = int(np.count_nonzero(left & fault))
        left = left & ~fault
    return Timed(
        own=left,
        by_own_hand=answered & ~np.logical_or.reduce([faults[name] for name in REFUSALS if name != "not_above_0"]),
        answered=int(np.count_nonzero(answered)),
        refused={reason: count for reason, count in refused.items() if count},
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnTrials:
    """Trials, one axis, each person's in order of time; persons, methods and instructions as places in their names."""

    person: IndexArray
    method: IndexArray
    instruction: IndexArray
    forward: BoolArray  # which way the shot went
    correct: FloatArray
    time_s: FloatArray
    source: NDArray[np.str_]
    people: tuple[str, ...]
    methods: tuple[str, ...]
    instructions: tuple[str, ...]
    answered: int
    refused: dict[str, int]  # reason in `REFUSALS` -> trials

    def of(self, rows: BoolArray) -> OwnTrials:
        """Some of the trials, under the same names."""
        names = ("person", "method", "instruction", "forward", "correct", "time_s", "source")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def cell(self, method: str, instruction: str) -> OwnTrials:
        """The trials of a method under an instruction."""
        mine = self.method == self.methods.index(method)
        return self.of(mine & (self.instruction == self.instructions.index(instruction)))


def own_trials(trials: pd.DataFrame, methods: Sequence[str]) -> OwnTrials:
    """The answered trials of a coded table whose times are the answerer's own; an optional column `instruction`."""
    instructions, instruction = _instructions(trials)
    sources, source = _names(trials["response_source"])
    time_s = trials["response_time_s"].to_numpy(dtype=np.float64)
    found = timed(trials)
    rows = np.flatnonzero(found.own)
    person = codes_of(trials["participant_id"])
    rows = rows[ordered(person[rows], time_s[rows]).rows]
    return OwnTrials(
        person=person[rows],
        method=places_among(trials["method"], methods)[rows],
        instruction=instruction[rows],
        forward=np.asarray(trials["direction"] == "forward", dtype=np.bool_)[rows],
        correct=trials["correct"].to_numpy(dtype=np.float64, na_value=np.nan)[rows],
        time_s=time_s[rows],
        source=sources[source[rows]],
        people=tuple(map(str, trials["participant_id"].cat.categories)),
        methods=tuple(methods),
        instructions=instructions,
        answered=found.answered,
        refused=found.refused,
    )


def _instructions(trials: pd.DataFrame) -> tuple[tuple[str, ...], IndexArray]:
    """The instructions that occur, from speed to accuracy if they are those; and each trial's place.

    Others stand in the order of an ordered column, else by the alphabet.
    """
    if INSTRUCTION not in trials:
        return (NEUTRAL,), np.zeros(len(trials), dtype=np.intp)
    names, places = _names(trials[INSTRUCTION])
    labels = np.where(names == "", NEUTRAL, names)
    found = [str(labels[place]) for place in np.flatnonzero(np.bincount(places, minlength=len(labels)))]
    kind = trials[INSTRUCTION].dtype
    others = found if isinstance(kind, pd.CategoricalDtype) and kind.ordered else sorted({*found})
    order = [name for name in INSTRUCTION_ORDER if name in found] if {*found} <= {*INSTRUCTION_ORDER} else others
    where = np.array([order.index(label) if label in found else 0 for label in labels.tolist()], dtype=np.intp)
    return tuple(order), where[places]


def _names(column: pd.Series) -> tuple[NDArray[np.str_], IndexArray]:
    """The names in a column and each row's place among them; the last is empty and stands for a missing one."""
    found = column.astype("category").cat
    names = np.array([*map(str, found.categories), ""], dtype=np.str_)
    places = found.codes.to_numpy().astype(np.intp)
    return names, np.where(places < 0, len(names) - 1, places)


_KEYS = ("participant_id", "method", "direction")
_PERCENT = np.arange(101)


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeSpread:
    """How some times spread: mean and SD (`None` of a single time) in s, and the percentiles 0, 1, ..., 100."""

    n: int
    participants: int
    mean: float
    sd: float | None
    percentiles: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseTimes:
    """Distributions of the valid response times in s, as in `direction.response_times` of `statistics.json`.

    `n` valid times and `left_out` answered trials without one; their spread by method (`None` without a time) and by
    method and direction; each participant's median by method and direction.
    """

    n: int
    left_out: int
    methods: Mapping[str, TimeSpread | None]
    directions: Mapping[str, Mapping[str, TimeSpread]]
    participants: Mapping[str, Mapping[str, Mapping[str, float]]]


def response_times(trials: pd.DataFrame, methods: Sequence[str]) -> ResponseTimes:
    """The distributions of a table's response times, as far as `own_trials.timed` finds them valid."""
    found = timed(trials)
    valid = trials[[*_KEYS, "response_time_s"]][found.own]
    seconds, people = valid["response_time_s"].to_numpy(dtype=np.float64), _codes(valid["participant_id"])
    under = {method: np.asarray(valid["method"] == method) for method in methods}
    towards = {direction: np.asarray(valid["direction"] == direction) for direction in DIRECTIONS}
    both = {method: {way: rows & there for way, there in towards.items()} for method, rows in under.items()}

    def spread(rows: NDArray[np.bool_]) -> TimeSpread | None:
        return _spread(seconds[rows], people[rows]) if rows.any() else None

    return ResponseTimes(
        n=len(valid),
        left_out=found.answered - len(valid),
        methods={method: spread(rows) for method, rows in under.items()},
        directions={
            method: {way: times for way, rows in ways.items() if (times := spread(rows))}
            for method, ways in both.items()
        },
        participants=_medians(valid),
    )


def _codes(column: pd.Series) -> NDArray[np.intp]:
    return column.astype("category").cat.codes.to_numpy().astype(np.intp)


def _spread(seconds: FloatArray, people: NDArray[np.intp]) -> TimeSpread:
    """Of at least one time. Sorted first: the order of the files changes no last digit."""
    times = np.sort(seconds)
    return TimeSpread(
        n=int(times.size),
        participants=int(np.count_nonzero(np.bincount(people))),
        mean=float(times.mean()),
        sd=float(times.std(ddof=1)) if times.size > 1 else None,
        percentiles=tuple(np.percentile(times, _PERCENT).tolist()),
    )


def _medians(valid: pd.DataFrame) -> Mapping[str, Mapping[str, Mapping[str, float]]]:
    """The median of each participant's times by method and direction, as far as there are some."""
    keys = [valid[name].astype("category").cat for name in _KEYS]
    names = [[str(name) for name in key.categories] for key in keys]
    if not len(valid):
        return {}
    shape = tuple(map(len, names))
    cell = np.ravel_multi_index(tuple(key.codes.to_numpy().astype(np.intp) for key in keys), shape)
    medians = pd.Series(valid["response_time_s"].to_numpy()).groupby(cell).median()
    found = Finite()
    places = (place.tolist() for place in np.unravel_index(medians.index.to_numpy(), shape))
    for person, method, direction, median in zip(*places, medians.tolist(), strict=True):
        own = found.setdefault(names[0][person], {}).setdefault(names[1][method], {})
        own[names[2][direction]] = median
    return found
