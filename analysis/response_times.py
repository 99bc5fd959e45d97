"""Response times that are the participant's own: how they spread over methods and directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

Json = dict[str, Any]

DIRECTIONS = ("forward", "backward")
_PERCENT = np.arange(101)


def response_times(trials: pd.DataFrame, methods: Sequence[str]) -> Json:
    """Distributions of the valid response times in seconds, for `direction.response_times` of `statistics.json`.

    `n` valid times and `left_out` answered trials without one (corrected, or by the experimenter's hand); `methods`
    and `directions` hold n, mean, SD and the percentiles 0, 1, ..., 100; `participants` the median of each one's times
    by method and direction.
    """
    valid = trials[valid_times(trials)]
    answered = int(trials["correct"].notna().sum())
    return {
        "n": len(valid),
        "left_out": answered - len(valid),
        "methods": {method: _spread(valid[valid["method"] == method]) for method in methods},
        "directions": {method: _by_direction(valid[valid["method"] == method]) for method in methods},
        "participants": _medians(valid),
    }


def valid_times(trials: pd.DataFrame) -> pd.Series:
    """Which rows hold a response time that is the participant's own."""
    return (trials["response_time_valid"] == 1).fillna(False).astype(bool) & trials["response_time_s"].notna()


def _by_direction(trials: pd.DataFrame) -> Json:
    found = {direction: _spread(trials[trials["direction"] == direction]) for direction in DIRECTIONS}
    return {direction: spread for direction, spread in found.items() if spread is not None}


def _spread(trials: pd.DataFrame) -> Json | None:
    """None without a time; the SD None of a single one. Sorted first: the order of the files changes no last digit."""
    times = np.sort(trials["response_time_s"].to_numpy(dtype=np.float64))
    if not times.size:
        return None
    return {
        "n": int(times.size),
        "participants": int(trials["participant_id"].nunique()),
        "mean": float(times.mean()),
        "sd": float(times.std(ddof=1)) if times.size > 1 else None,
        "percentiles": [float(value) for value in np.percentile(times, _PERCENT)],
    }


def _medians(valid: pd.DataFrame) -> Json:
    keys = [valid[name].astype("category").cat for name in ("participant_id", "method", "direction")]
    names = [[str(name) for name in key.categories] for key in keys]
    shape = tuple(map(len, names))
    if not len(valid):
        return {}
    cell = np.ravel_multi_index(tuple(key.codes.to_numpy().astype(np.intp) for key in keys), shape)
    times = valid["response_time_s"].to_numpy(dtype=np.float64)
    times = times[np.lexsort((times, cell))]
    cells, counts = np.unique(cell, return_counts=True)
    starts = np.cumsum(counts) - counts
    medians = (times[starts + (counts - 1) // 2] + times[starts + counts // 2]) / 2.0
    found: Json = {}
    for *key, median in zip(*(place.tolist() for place in np.unravel_index(cells, shape)), medians.tolist(), strict=True):
        code, method, direction = (name[place] for name, place in zip(names, key, strict=True))
        found.setdefault(code, {}).setdefault(method, {})[direction] = median
    return found
