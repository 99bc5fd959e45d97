"""How well a threshold can be known from so many trials, whatever the procedure: a bound for planning."""

from __future__ import annotations

from math import pi, sqrt
from statistics import NormalDist

from experiments.design.procedures.psychometric import TAIL


def width_of(sd: float) -> float:
    """The width of a cumulative normal with a standard deviation."""
    return 2 * NormalDist().inv_cdf(1 - TAIL) * sd


def threshold_bound(trials: int, *, width: float, guess: float, lapse: float) -> float:
    """The least standard error of a threshold from so many trials, of a cumulative normal whose slope is not known.

    √(p (1 - p) / n) / ((1 - g - l) φ(0) / sd), with p = g + (1 - g - l) / 2 the share at the threshold and sd the
    function's standard deviation, of which `width` has 3.29. It is the Cramér-Rao bound of the best placement, all
    trials at the threshold (Elfving 1952), which is known to nobody before; its derivation is in the docs.
    """
    slack = 1 - guess - lapse
    share, sd = guess + slack / 2, width / width_of(1.0)
    return sd * sqrt(2 * pi * share * (1 - share) / trials) / slack
