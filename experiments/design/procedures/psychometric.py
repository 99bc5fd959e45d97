"""How often a stimulus is answered right, or with yes, by its level.

    share(x) = g + (1 - g - l) F((x - threshold) / width)

F is 1/2 at the threshold, and 0.05 and 0.95 a width apart; g is the guess rate, l the lapse rate (Wichmann and Hill
2001; the parameters are those of psignifit, Schütt and others 2016). A Weibull function is a Gumbel function of ln x.
"""

from __future__ import annotations

from math import log
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.design.language import Shape

Shares = NDArray[np.float64]

TAIL = 0.05
"""The width goes from this share to its complement."""
_NORMAL = 2 * NormalDist().inv_cdf(1 - TAIL)
_LOGISTIC = 2 * log(1 / TAIL - 1)
_GUMBEL = log(-log(TAIL)) - log(-log(1 - TAIL))
_HALF = log(log(2))


def share_felt(x: ArrayLike, threshold: ArrayLike, width: ArrayLike, shape: Shape = "normal") -> Shares:
    """F at x; all arrays are broadcast against each other. `width` is above 0.

    >>> share_felt([8.0, 10.0, 12.0], 10.0, 4.0).round(3).tolist()
    [0.05, 0.5, 0.95]
    >>> share_felt(10.0, 10.0, 4.0, "gumbel").round(3).tolist()
    0.5
    """
    from scipy.special import expit, ndtr  # noqa: PLC0415 - slow, and whoever only reads a design needs none of it

    z = (np.asarray(x, float) - np.asarray(threshold, float)) / np.asarray(width, float)
    match shape:
        case "normal":
            return np.asarray(ndtr(_NORMAL * z))
        case "logistic":
            return np.asarray(expit(_LOGISTIC * z))
        case "gumbel":
            return np.asarray(-np.expm1(-np.exp(np.minimum(_GUMBEL * z + _HALF, 700.0))))
        case "reversed-gumbel":
            return np.asarray(np.exp(-np.exp(np.minimum(-_GUMBEL * z + _HALF, 700.0))))
