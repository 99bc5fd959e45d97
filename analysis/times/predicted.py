"""What a fitted diffusion predicts of the trials: how many are answered right, and wrong, by each time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray
from analysis.times.first_passage import distribution
from analysis.times.fit import DiffusionFit
from analysis.times.likelihood import Range


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnsweredBy:
    """Shares of all trials answered right and wrong by each time: cumulative, so that the ends add up to 1."""

    right: FloatArray
    wrong: FloatArray


def answered_by(
    fit: DiffusionFit,
    time_s: ArrayLike,
    *,
    condition: str,
    instruction: str,
    towards_upper: float = 0.5,
    lapse_range_s: Range | None = None,
) -> AnsweredBy:
    """The fit's prediction for a condition and instruction, at times of one axis.

    `towards_upper` is the share of shots that drive to the upper answer; `lapse_range_s` that of the fit, if it has
    lapses. `KeyError`: the fit knows no such condition or instruction.
    """
    t = np.asarray(time_s, dtype=np.float64)
    v, a = fit[f"drift {condition}".strip()].value, fit[f"boundary {instruction}".strip()].value
    values = {estimate.name: estimate.value for estimate in fit.estimates}
    w, lapse = values.get("start", 0.5), values.get("lapse", 0.0)
    decided = t - values["non_decision_s"]
    right, wrong = (
        towards_upper * np.asarray(distribution(decided, answer, v, a, w))
        + (1.0 - towards_upper) * np.asarray(distribution(decided, not answer, -v, a, w))
        for answer in (True, False)
    )
    lapsed = np.zeros_like(t)
    if lapse_range_s is not None:
        earliest, latest = lapse_range_s
        lapsed = 0.5 * lapse * np.clip((t - earliest) / (latest - earliest), 0.0, 1.0)
    return AnsweredBy(right=(1.0 - lapse) * right + lapsed, wrong=(1.0 - lapse) * wrong + lapsed)
