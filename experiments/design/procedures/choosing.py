"""What a procedure's table makes of a track: what its answers so far say, whether it is over, which level comes next.

A track is a frozen value; each answer makes the next one. All levels of its factors are where it may go.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol, Self

import numpy as np

from experiments.design.procedures.config import (
    AdaptiveConfig,
    PosteriorConfig,
    PriorConfig,
)
from experiments.design.procedures.posterior import (
    EntropyRule,
    ParameterGrid,
    VarianceRule,
    WantedParameter,
    best_stimulus,
    entropy_rule,
    posterior_after,
    variance_rule,
)
from experiments.design.procedures.psychometric import Shares, share_felt
from experiments.design.procedures.up_down import Kesten, TrackState, UpDown, track_after
from experiments.design.procedures.walks import NumericLevels, walk_rule

_TAILS = (0.025, 0.975)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenLevels:
    """The levels of a track's next trial. `at_edge`: at the end of what there is, where the rule may want to go on."""

    levels: NumericLevels
    at_edge: bool = False


class AdaptiveTrack(Protocol):
    """Where a track stands after its answers so far."""

    @property
    def over(self) -> bool:
        """Whether its rule has ended it."""

    def choice(self) -> ChosenLevels:
        """The levels of its next trial."""

    def after(self, felt: NumericLevels, *, success: bool) -> Self:
        """Where it stands after one more answer, to what was felt."""


@dataclass(frozen=True, slots=True)
class WalkedTrack:
    """A track that goes up and down by the answers alone."""

    rule: UpDown | Kesten
    answers: tuple[bool, ...] = ()

    @property
    def state(self) -> TrackState:
        """Where the walk stands."""
        return track_after(self.rule, self.answers)

    @property
    def over(self) -> bool:
        """Whether its trials or reversals are done."""
        return self.state.next_level is None

    def choice(self) -> ChosenLevels:
        """The level that the answers call for; `ValueError`: it is over."""
        state = self.state
        if state.next_level is None:
            raise ValueError("the track is over")
        return ChosenLevels(levels=(state.next_level,), at_edge=state.at_edge)

    def after(self, felt: NumericLevels, *, success: bool) -> Self:  # noqa: ARG002 - a walk follows its answers
        """One answer more."""
        return replace(self, answers=(*self.answers, success))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PosteriorRule:
    """A table's grid of parameters, its stimuli as levels of each factor, and when a track of it is over."""

    table: PosteriorConfig
    grid: ParameterGrid
    rule: VarianceRule | EntropyRule
    stimuli: tuple[NumericLevels, ...]
    places: Mapping[NumericLevels, int]
    edges: frozenset[int]
    thresholds: Shares

    def credible_width(self, posterior: Shares) -> float:
        """How wide the 95 % credible interval of the threshold is, in the factor's unit."""
        weights = posterior.sum(axis=-1).reshape(len(self.thresholds), -1).sum(axis=-1)
        low, high = np.interp(_TAILS, np.cumsum(weights) - weights / 2, self.thresholds)
        return float(high - low)


@dataclass(frozen=True, slots=True, eq=False)
class KnownTrack:
    """A track of which the posterior of a psychometric function is known; `count` answers made it."""

    rule: PosteriorRule
    posterior: Shares
    count: int = 0

    @property
    def over(self) -> bool:
        """Whether its trials are done, or the threshold is known as well as asked for."""
        table = self.rule.table
        if self.count >= table.trials:
            return True
        if table.credible_width is None or self.count < max(table.least_trials, 1):
            return False
        return self.rule.credible_width(self.posterior) < table.credible_width

    def choice(self) -> ChosenLevels:
        """The stimulus whose answer tells most; the start, where the table names one, before the first answer."""
        rule, start = self.rule, self.rule.table.start
        if start is not None and not self.count:
            return ChosenLevels(levels=(start,))
        place = int(best_stimulus(rule.rule.gains(self.posterior)))
        return ChosenLevels(levels=rule.stimuli[place], at_edge=place in rule.edges)

    def after(self, felt: NumericLevels, *, success: bool) -> Self:
        """One answer more, to what was felt."""
        known = posterior_after(self.rule.grid, self.posterior, self.rule.places[felt], success)
        return replace(self, posterior=known, count=self.count + 1)


def tracks_of_cell(table: AdaptiveConfig, levels: Sequence[NumericLevels], guess: float) -> tuple[AdaptiveTrack, ...]:
    """The tracks of a cell before their first answer.

    `levels` are those of each adapted factor, and `guess` how often who feels nothing is right.
    """
    if isinstance(table, PosteriorConfig):
        rule = posterior_rule(table, levels, guess)
        return (KnownTrack(rule, rule.grid.start()),) * table.tracks
    return tuple(WalkedTrack(walk_rule(table, levels[0], start)) for start in table.starts)


def posterior_rule(table: PosteriorConfig, levels: Sequence[NumericLevels], guess: float) -> PosteriorRule:
    """The grid of a table, and the rule on it."""
    stimuli = tuple(product(*levels))
    grid = _grid(table, stimuli, guess)
    wanted: Mapping[str, tuple[WantedParameter, ...]] = {"both": ("threshold", "width"), "width": ("width",)}
    asked = wanted.get(table.target, ("threshold",))
    ends = [{one[0], one[-1]} for one in levels]
    edges = (at for at, one in enumerate(stimuli) if any(x in end for x, end in zip(one, ends, strict=True)))
    return PosteriorRule(
        table=table,
        grid=grid,
        rule=entropy_rule(grid) if table.rule == "entropy" else variance_rule(grid, asked),
        stimuli=stimuli,
        places={one: place for place, one in enumerate(stimuli)},
        edges=frozenset(edges),
        thresholds=table.threshold.values,
    )


def _grid(table: PosteriorConfig, stimuli: Sequence[NumericLevels], guess: float) -> ParameterGrid:
    """The parameters' values with their prior, and F of every stimulus at each.

    With two factors the places of `widths` are those of width × trade, as x = x1 + trade (x2 - mean of x2) is felt.
    """
    x = np.array(stimuli) if table.scale == "linear" else np.log(stimuli)
    thresholds = table.threshold.values if table.scale == "linear" else np.log(table.threshold.values)
    trade = table.trade or PriorConfig(minimum=0.0, maximum=0.0, points=1)
    guesses = table.guess or PriorConfig(minimum=guess, maximum=guess, points=1)
    t, w, k = (axis.ravel() for axis in np.meshgrid(thresholds, table.width.values, trade.values, indexing="ij"))
    second = x[:, 1] - x[:, 1].mean() if x.shape[1] > 1 else np.zeros(len(x))
    parts = (table.threshold, table.width, trade, table.lapse, guesses)
    prior = np.einsum("i,j,k,l,m->ijklm", *(one.weights for one in parts))
    lapse, chance = (axis.ravel() for axis in np.meshgrid(table.lapse.values, guesses.values, indexing="ij"))
    return ParameterGrid(
        stimuli=x[:, 0],
        thresholds=thresholds,
        widths=np.repeat(table.width.values, trade.points),
        lapses=table.lapse.values,
        guesses=guesses.values,
        prior=prior.reshape(len(thresholds), -1, table.lapse.points, guesses.points) / prior.sum(),
        felt=share_felt(x[:, :1] + k * second[:, None], t, w, table.shape),
        chance=chance,
        slack=1 - chance - lapse,
    )
