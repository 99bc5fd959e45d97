"""Signal detection: sensitivity apart from the readiness to say one thing rather than the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.arrays import FloatArray, Values, float_or_array, numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """d' and criterion with the corrected rates they come from. A criterion below 0 leans towards "yes"."""

    d_prime: Values
    criterion: Values
    hit_rate: Values
    false_alarm_rate: Values


def yes_no(hits: ArrayLike, signal_trials: ArrayLike, false_alarms: ArrayLike, noise_trials: ArrayLike) -> Detection:
    """Sensitivity d' = z(H) - z(F) and criterion c = -(z(H) + z(F)) / 2 of a yes/no judgement, log-linear corrected.

    H = (hits + 0.5) / (signal_trials + 1), F = (false_alarms + 0.5) / (noise_trials + 1), always, not only at 0 and 1.
    For judgements of direction "yes" is "forward": said on a forward shot a hit, on a backward shot a false alarm.
    All arguments broadcast. `ValueError`: a count that is not whole or outside 0..its trials, or no trials.
    Sources: Hautus 1995, Behavior Research Methods 27, 46; Macmillan & Creelman 2005, chapter 2.

    >>> round(yes_no(10, 10, 0, 10).d_prime, 3)
    3.381
    """
    hit_rate, z_hit = _rate_and_z(hits, signal_trials, "hits")
    false_alarm_rate, z_false_alarm = _rate_and_z(false_alarms, noise_trials, "false_alarms")
    return Detection(
        d_prime=float_or_array(z_hit - z_false_alarm),
        criterion=float_or_array(-(z_hit + z_false_alarm) / 2.0),
        hit_rate=float_or_array(hit_rate),
        false_alarm_rate=float_or_array(false_alarm_rate),
    )


def _rate_and_z(count: ArrayLike, trials: ArrayLike, name: str) -> tuple[FloatArray, FloatArray]:
    """The corrected rate and its normal quantile, taken from the nearer end so that 0 and all mirror exactly."""
    counts, totals = np.broadcast_arrays(numbers(count, name), numbers(trials, f"trials of {name}"))
    if (totals < 1.0).any():
        raise ValueError(f"{name}: there must be at least 1 trial")
    if ((counts < 0.0) | (counts > totals)).any():
        raise ValueError(f"{name} must lie in 0..trials, not {counts[(counts < 0.0) | (counts > totals)][0]:g}")
    if (counts != np.floor(counts)).any() or (totals != np.floor(totals)).any():
        raise ValueError(f"{name} and their trials must be whole numbers, counts and not rates")
    rest = totals - counts
    z = special.ndtri((np.minimum(counts, rest) + 0.5) / (totals + 1.0))
    return (counts + 0.5) / (totals + 1.0), np.where(counts > rest, -z, z)
