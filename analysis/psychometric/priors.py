"""What is thought of a psychometric function before its data: threshold, width and rates, each on its own.

The defaults are psignifit's (Schütt, Harmeling, Macke and Wichmann 2016, section 2.2), so that fits can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.stats.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class PlateauPrior:
    """As likely everywhere from `flat_from` to `flat_to`, with a cosine's fall to nothing at `low` and `high`."""

    low: float
    flat_from: float
    flat_to: float
    high: float

    def density(self, x: FloatArray) -> FloatArray:
        """Up to a constant."""
        rise = (x - self.low) / max(self.flat_from - self.low, np.finfo(float).tiny)
        fall = (self.high - x) / max(self.high - self.flat_to, np.finfo(float).tiny)
        inside = np.clip(np.minimum(rise, fall), 0.0, 1.0)
        return np.asarray((1 - np.cos(np.pi * inside)) / 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class RatePrior:
    """A rate with the density of Beta(1, `against`): the less likely the larger, up to `most`."""

    against: float = 10.0
    most: float = 0.5

    @property
    def low(self) -> float:
        """The smallest rate."""
        return 0.0

    def density(self, x: FloatArray) -> FloatArray:
        """Up to a constant."""
        return np.asarray((1 - x) ** (self.against - 1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ListedPrior:
    """Weights (n,) of values (n,), lowest first, as a procedure's grid has them; a density between them.

    Of one value the parameter is known.
    """

    values: FloatArray
    weights: FloatArray

    @property
    def low(self) -> float:
        """The smallest value."""
        return float(self.values[0])

    @property
    def high(self) -> float:
        """The largest value."""
        return float(self.values[-1])

    @property
    def most(self) -> float:
        """The largest value, of a rate."""
        return self.high

    def density(self, x: FloatArray) -> FloatArray:
        """Up to a constant."""
        return np.asarray(np.interp(x, self.values, self.weights / np.gradient(self.values), left=0.0, right=0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Priors:
    """Of threshold and width, in the unit of the levels (of a fit on a logarithmic axis: of their logarithms)."""

    threshold: PlateauPrior
    width: PlateauPrior | ListedPrior
    lapse: RatePrior | ListedPrior = RatePrior()
    guess: RatePrior = RatePrior()
    overdispersion: RatePrior = RatePrior(most=0.999)


def default_priors(levels: FloatArray) -> Priors:
    """The threshold lies among the levels, or up to half their span beside them; the width is between them.

    `levels` (k,), at least two of them different.
    """
    different = np.unique(levels)
    span, step = float(different[-1] - different[0]), float(np.min(np.diff(different)))
    low, high = float(different[0]), float(different[-1])
    return Priors(
        threshold=PlateauPrior(low=low - span / 2, flat_from=low, flat_to=high, high=high + span / 2),
        width=PlateauPrior(low=step, flat_from=2 * step, flat_to=span, high=3 * span),
    )
