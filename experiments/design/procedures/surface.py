"""How a stimulus of two dimensions is answered, such as a voltage and a pulse length, for the entropy rule.

    share(x, y) = g + (1 - g - l) F((x - threshold(y)) / width)
    threshold(y) = max(floor, intercept + rise y)

The threshold of one dimension changes along the other as a line does, down to a floor: the surface of Watson (2017, J.
Vis. 17(3):10, example 4). With the logarithms of strength and duration it is Bloch's law of temporal summation, at a
rise of -1: what counts is strength × duration, up to a critical duration where the line meets the floor (Bloch 1885;
for vibration on the skin Verrillo 1965, J. Acoust. Soc. Am. 37, 843).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from experiments.design.language import Shape
from experiments.design.procedures.posterior import AnswerGrid, chance_and_slack, checked_prior
from experiments.design.procedures.psychometric import Shares, share_felt


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceGrid(AnswerGrid):
    """A grid of intercept, rise, floor, width, lapse and guess rate, and the stimuli (n, 2): x and y of each."""

    stimuli: Shares


def threshold_along(other: ArrayLike, intercept: ArrayLike, rise: ArrayLike, floor: ArrayLike) -> Shares:
    """The threshold of x at y = `other`; all arrays are broadcast against each other.

    >>> threshold_along([0.0, 1.0, 2.0], 4.0, -1.5, 2.0).tolist()
    [4.0, 2.5, 2.0]
    """
    line = np.asarray(intercept, float) + np.asarray(rise, float) * np.asarray(other, float)
    return np.asarray(np.maximum(np.asarray(floor, float), line))


def surface_grid(
    *,
    stimuli: Shares,
    intercepts: Shares,
    rises: Shares,
    floors: Shares,
    widths: Shares,
    lapses: Shares,
    guesses: Shares,
    prior: Shares | None = None,
    shape: Shape = "normal",
    either_way: bool = False,
) -> SurfaceGrid:
    """A grid; without a prior every place has the same. `either_way` as of `parameter_grid`.

    `ValueError`: stimuli that are no pairs; a prior of another shape, or of nothing.
    """
    pairs = np.asarray(stimuli, float)
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise ValueError(f"stimuli: a row each, of two numbers, not of the shape {pairs.shape}")
    axes = {
        "intercept": intercepts,
        "rise": rises,
        "floor": floors,
        "width": widths,
        "lapse": lapses,
        "guess": guesses,
    }
    intercept, rise, floor, width = (
        place.ravel() for place in np.meshgrid(intercepts, rises, floors, widths, indexing="ij")
    )
    thresholds = threshold_along(pairs[:, 1:], intercept, rise, floor)
    chance, slack = chance_and_slack(lapses, guesses, either_way=either_way)
    return SurfaceGrid(
        stimuli=pairs,
        axes={name: np.asarray(values, float) for name, values in axes.items()},
        prior=checked_prior(prior, tuple(map(len, axes.values()))),
        felt=share_felt(pairs[:, :1], thresholds, width, shape),
        chance=chance,
        slack=slack,
    )
