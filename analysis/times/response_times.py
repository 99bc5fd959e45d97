"""Response times that are the participant's own: how they spread over methods and directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray
from analysis.stats.cells import Finite

Json = dict[str, Any]
Flags = NDArray[np.bool_]

DIRECTIONS = ("forward", "backward")
_KEYS = ("participant_id", "method", "direction")
_PERCENT = np.arange(101)


def response_times(trials: pd.DataFrame, methods: Sequence[str]) -> Json:
    """Distributions of the valid response times in seconds, for `direction.response_times` of `statistics.json`.

    `n` valid times and `left_out` answered trials without one (corrected, or by the experimenter's hand); `methods`
    and `directions` hold n, mean, SD and the percentiles 0, 1, ..., 100; `participants` the median of each one's times
    by method and direction.
    """
    valid = trials[[*_KEYS, "response_time_s"]][valid_times(trials)]
    seconds, people = valid["response_time_s"].to_numpy(dtype=np.float64), _codes(valid["participant_id"])
    under = {method: np.asarray(valid["method"] == method) for method in methods}
    towards = {direction: np.asarray(valid["direction"] == direction) for direction in DIRECTIONS}

    def by_direction(rows: Flags) -> Json:
        chosen = {direction: rows & there for direction, there in towards.items()}
        return {direction: _spread(seconds[rows], people[rows]) for direction, rows in chosen.items() if rows.any()}

    return {
        "n": len(valid),
        "left_out": int(trials["correct"].notna().sum()) - len(valid),
        "methods": {method: _spread(seconds[rows], people[rows]) for method, rows in under.items()},
        "directions": {method: by_direction(rows) for method, rows in under.items()},
        "participants": _medians(valid),
    }


def valid_times(trials: pd.DataFrame) -> pd.Series:
    """Which rows hold a response time that is the participant's own."""
    return (trials["response_time_valid"] == 1).fillna(False).astype(bool) & trials["response_time_s"].notna()


def _codes(column: pd.Series) -> NDArray[np.intp]:
    return column.astype("category").cat.codes.to_numpy().astype(np.intp)


def _spread(seconds: FloatArray, people: NDArray[np.intp]) -> Json | None:
    """None without a time; the SD None of a single one. Sorted first: the order of the files changes no last digit."""
    times = np.sort(seconds)
    if not times.size:
        return None
    return {
        "n": int(times.size),
        "participants": int(np.count_nonzero(np.bincount(people))),
        "mean": float(times.mean()),
        "sd": float(times.std(ddof=1)) if times.size > 1 else None,
        "percentiles": np.percentile(times, _PERCENT).tolist(),
    }


def _medians(valid: pd.DataFrame) -> Json:
    """The median of each participant's times by method and direction, as far as there are some."""
    keys = [valid[name].astype("category").cat for name in _KEYS]
    names = [[str(name) for name in key.categories] for key in keys]
    if not len(valid):
        return {}
    shape = tuple(map(len, names))
    cell = np.ravel_multi_index(tuple(key.codes.to_numpy().astype(np.intp) for key in keys), shape)
    medians = pd.Series(valid["response_time_s"].to_numpy()).groupby(cell).median()
    found: Json = {}
    places = (place.tolist() for place in np.unravel_index(medians.index.to_numpy(), shape))
    for person, method, direction, median in zip(*places, medians.tolist(), strict=True):
        own = found.setdefault(names[0][person], {}).setdefault(names[1][method], {})
        own[names[2][direction]] = median
    return Finite(found) if np.isfinite(medians).all() else found
