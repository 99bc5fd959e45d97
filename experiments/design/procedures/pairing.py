"""Which two items are compared next, so that their order is known after few comparisons.

Bradley and Terry (1952): P(i is chosen over j) = 1 / (1 + exp(s_j - s_i)). The scores have a normal prior, and after
some choices a normal posterior by Laplace's approximation, scores m with covariance C. For each pair the posterior
after either choice is foreseen by one step of its approximation, and the pair is taken after which the order of all
items is expected to be known best: the least Σ π (1 - π), π the probability that one item of a pair is above the other,
which is half the number of pairs that two orders drawn from the posterior put differently. To choose by what a
comparison is expected to tell under such an approximation is from Chen and others (2013, WSDM, Crowd-BT) and Mikhailiuk
and others (2020, ICPR, ASAP), whose losses are of the scores; this one is of their order. At first only pairs are taken
that connect items which nothing connects yet.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from experiments.design.procedures.psychometric import Shares
from experiments.design.streams import Stream

_ALIKE = 1e-9
_STEPS, _FARTHEST, _REACHED = 60, 2.0, 1e-10
"""Newton's steps to the posterior's mode at most, how far one goes, in logits, and when it is there."""
_PROBIT = np.pi / 8
"""A logistic function of a normal variable has about the mean of one that is as much flatter (MacKay 1992)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairingRule:
    """Each pair of items once, (pairs, 2), in the order in which those that are alike are taken, first item first.

    `spread` is the prior's standard deviation of the scores, in logits.
    """

    items: int
    pairs: NDArray[np.intp]
    spread: float = 2.0


def pairing_rule(items: int, stream: Stream, spread: float = 2.0) -> PairingRule:
    """The rule for so many items; the stream orders the pairs and the items within.

    `ValueError`: fewer than two items, or a spread that is none.
    """
    if items < 2 or not spread > 0:
        raise ValueError(f"items must be at least 2 and spread above 0, not {items} and {spread:g}")
    mixed = stream.shuffled(list(combinations(range(items), 2)))
    pairs = [pair[::-1] if stream.below(2) else pair for pair in mixed]
    return PairingRule(items=items, pairs=np.array(pairs, dtype=np.intp), spread=spread)


def pair_after(rule: PairingRule, choices: Iterable[tuple[int, int, float]]) -> tuple[int, int]:
    """The items of the next comparison, the one to be shown first before the other.

    A choice is (first item, second item, 1 for the first, 0 for the second or 0.5 for a tie). No pair comes twice in a
    row if there is another; each time a pair comes again, its items change places.

    >>> rule = pairing_rule(4, Stream(1, "pairs"))
    >>> pair_after(rule, []), pair_after(rule, [(0, 1, 1.0)])
    ((0, 1), (2, 1))
    """
    wins, last = np.zeros((rule.items, rule.items)), -1
    places = {frozenset(pair): place for place, pair in enumerate(rule.pairs.tolist())}
    for first, second, chosen in choices:
        wins[first, second] += chosen
        wins[second, first] += 1 - chosen
        last = places[frozenset((first, second))]
    one, other = rule.pairs[int(next_pair(rule, wins, np.array(last)))].tolist()
    again = round(wins[one, other] + wins[other, one]) % 2
    return (other, one) if again else (one, other)


def next_pair(rule: PairingRule, wins: Shares, last: NDArray[np.intp]) -> NDArray[np.intp]:
    """The place among the rule's pairs of the next one, of the shape of `last`, the places of those before (-1: none).

    `wins` (..., items, items): how often the row was chosen over the column, a tie half for each. Axes in front are
    for many participants at once. The work grows with the fourth power of the items: 40 take 70 times what 12 do.
    """
    gains = order_gains(rule, *item_posterior(wins, rule.spread))
    apart = ~_connected(wins)[..., rule.pairs[:, 0], rule.pairs[:, 1]]
    allowed = apart | ~apart.any(axis=-1, keepdims=True)
    if len(rule.pairs) > 1:
        allowed &= np.arange(len(rule.pairs)) != np.asarray(last)[..., None]
    gains = np.where(allowed, gains, -np.inf)
    most = gains.max(axis=-1, keepdims=True)
    return np.asarray(np.argmax(gains >= most - _ALIKE, axis=-1))


def item_posterior(wins: Shares, spread: float) -> tuple[Shares, Shares]:
    """The items' likeliest scores (..., items) and their covariance (..., items, items), by Laplace's approximation."""
    wins = np.asarray(wins, float)
    compared, own = wins + wins.swapaxes(-1, -2), np.arange(wins.shape[-1])
    scores = np.zeros(wins.shape[:-1])
    for _ in range(_STEPS):
        share = _share(scores[..., :, None] - scores[..., None, :])
        slope = (wins - compared * share).sum(axis=-1) - scores / spread**2
        weight = compared * share * (1 - share)
        curvature = -weight
        curvature[..., own, own] += weight.sum(axis=-1) + 1 / spread**2
        step = np.linalg.solve(curvature, slope[..., None])[..., 0]
        scores = scores + step * np.minimum(1, _FARTHEST / np.maximum(np.abs(step), _FARTHEST).max(-1, keepdims=True))
        if np.abs(step).max() < _REACHED:
            break
    return np.asarray(scores), np.asarray(np.linalg.inv(curvature))


def order_gains(rule: PairingRule, scores: Shares, covariance: Shares) -> Shares:
    """How much less than now the order of the items is in doubt after each pair's comparison: (..., pairs)."""
    one, other = rule.pairs.T
    apart = scores[..., one] - scores[..., other]
    to_items = covariance[..., one, :] - covariance[..., other, :]
    together = to_items[..., one] - to_items[..., other]
    variance = np.diagonal(together, axis1=-2, axis2=-1)
    share = _share(apart)
    weight = share * (1 - share)
    kept = 1 / (1 + weight * variance)
    after = np.sqrt(np.maximum(variance[..., None, :] - together**2 * (weight * kept)[..., None], 1e-12))
    expected = _share(apart / np.sqrt(1 + _PROBIT * variance))
    doubt = np.zeros_like(apart)
    for chosen, likely in ((1.0, expected), (0.0, 1 - expected)):
        moved = apart[..., None, :] + together * ((chosen - share) * kept)[..., None]
        doubt += likely * _doubt_of_order(moved / after)
    return np.asarray(_doubt_of_order(apart / np.sqrt(variance))[..., None] - doubt)


def _share(apart: Shares) -> Shares:
    """How often one item is chosen over another so far below it."""
    from scipy.special import expit  # noqa: PLC0415 - slow, and whoever only reads a design needs none of it

    return np.asarray(expit(apart))


def _doubt_of_order(z: Shares) -> Shares:
    from scipy.special import ndtr  # noqa: PLC0415 - as above

    above = ndtr(z)
    return np.asarray((above * (1 - above)).sum(axis=-1))


def _connected(wins: Shares) -> NDArray[np.bool_]:
    """Whether items are compared with each other, if only by way of others: (..., items, items)."""
    items = wins.shape[-1]
    reached = ((wins + wins.swapaxes(-1, -2)) > 0) | np.eye(items, dtype=bool)
    for _ in range(items.bit_length()):
        reached = (reached.astype(float) @ reached.astype(float)) > 0
    return np.asarray(reached)
