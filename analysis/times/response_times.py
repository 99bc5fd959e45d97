"""Response times that are the participant's own: how they spread over methods and directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray
from analysis.stats.cells import Finite
from analysis.times.own_trials import timed
from device.words import DIRECTIONS

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
