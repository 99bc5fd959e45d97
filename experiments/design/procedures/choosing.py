"""What a procedure's table makes of a track: what its answers so far say, whether it is over, which level comes next.

A track is a frozen value; each answer makes the next one. All levels of its factors are where it may go.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from typing import Protocol, Self

import numpy as np

from experiments.design.language import Levels
from experiments.design.procedures.config import (
    NumericConfig,
    PairingConfig,
    PosteriorConfig,
    PriorConfig,
)
from experiments.design.procedures.pairing import PairingRule, pair_after, pairing_rule
from experiments.design.procedures.posterior import (
    EntropyRule,
    ParameterGrid,
    VarianceRule,
    WantedParameter,
    best_stimulus,
    credible_span,
    entropy_rule,
    parameter_grid,
    posterior_after,
    variance_rule,
)
from experiments.design.procedures.psychometric import Shares
from experiments.design.procedures.surface import SurfaceGrid, surface_grid
from experiments.design.procedures.up_down import Kesten, TrackState, UpDown, track_after
from experiments.design.procedures.walks import NumericLevels, walk_rule
from experiments.design.streams import Stream

_WANTED: Mapping[str, tuple[WantedParameter, ...]] = {
    "threshold": ("threshold",),
    "width": ("width",),
    "both": ("threshold", "width"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenLevels:
    """The levels of a track's next trial: one a factor, or of a pair the first and the second.

    `at_edge`: at the end of what there is, where the rule may want to go on.
    """

    levels: Levels
    at_edge: bool = False


class AdaptiveTrack(Protocol):
    """Where a track stands after its answers so far."""

    @property
    def over(self) -> bool:
        """Whether its rule has ended it."""

    def choice(self) -> ChosenLevels:
        """The levels of its next trial."""

    def after(self, felt: Levels, *, success: float) -> Self:
        """Where it stands after one more answer, to what was felt: 1 for a success, 0 for none.

        Of a pair 1 for the first, 0 for the second, 0.5 for neither.
        """


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

    def after(self, felt: Levels, *, success: float) -> Self:  # noqa: ARG002 - a walk follows its answers
        """One answer more."""
        return replace(self, answers=(*self.answers, success == 1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PosteriorRule:
    """A table's grid of parameters, its stimuli as levels of each factor, and when a track of it is over."""

    table: PosteriorConfig
    grid: ParameterGrid | SurfaceGrid
    rule: VarianceRule | EntropyRule
    stimuli: tuple[NumericLevels, ...]
    places: Mapping[Levels, int]
    edges: frozenset[int]

    def credible_width(self, posterior: Shares) -> float:
        """How wide the 95 % credible interval of the threshold is, in the factor's unit."""
        name = next(iter(self.grid.axes))
        weights = self.grid.marginal(posterior, name)
        return float(credible_span(self.grid.axes[name], weights, log=self.table.scale == "log"))


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

    def after(self, felt: Levels, *, success: float) -> Self:
        """One answer more, to what was felt."""
        known = posterior_after(self.rule.grid, self.posterior, self.rule.places[felt], success == 1)
        return replace(self, posterior=known, count=self.count + 1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairedTrack:
    """A track of so many pairs of items, each pair chosen by what was said of those before."""

    rule: PairingRule
    items: Levels
    trials: int
    choices: tuple[tuple[int, int, float], ...] = ()

    @property
    def over(self) -> bool:
        """Whether its trials are done."""
        return len(self.choices) >= self.trials

    def choice(self) -> ChosenLevels:
        """The pair after which the order of the items is expected to be known best."""
        one, other = pair_after(self.rule, self.choices)
        return ChosenLevels(levels=(self.items[one], self.items[other]))

    def after(self, felt: Levels, *, success: float) -> Self:
        """One answer more, to the pair that was felt."""
        one, other = map(self.items.index, felt)
        return replace(self, choices=(*self.choices, (one, other, success)))


def paired_track(table: PairingConfig, items: Levels, stream: Stream) -> PairedTrack:
    """A track of pairs before its first answer; the stream is its own."""
    return PairedTrack(rule=pairing_rule(len(items), stream, table.spread), items=items, trials=table.trials)


def tracks_of_cell(table: NumericConfig, levels: Sequence[NumericLevels], guess: float) -> tuple[AdaptiveTrack, ...]:
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
    if isinstance(grid, ParameterGrid) and table.rule == "variance":
        rule: VarianceRule | EntropyRule = variance_rule(grid, _WANTED[table.target])
    else:
        rule = entropy_rule(grid)
    ends = [{one[0], one[-1]} for one in levels]
    edges = (at for at, one in enumerate(stimuli) if any(x in end for x, end in zip(one, ends, strict=True)))
    return PosteriorRule(
        table=table,
        grid=grid,
        rule=rule,
        stimuli=stimuli,
        places={one: place for place, one in enumerate(stimuli)},
        edges=frozenset(edges),
    )


def _grid(table: PosteriorConfig, stimuli: Sequence[NumericLevels], guess: float) -> ParameterGrid | SurfaceGrid:
    """The parameters' values with their prior, and F of every stimulus at each.

    Of two factors the threshold of the first is `threshold` at the mean of the second's levels, and changes along it.
    """
    x = np.array(stimuli) if table.scale == "linear" else np.log(stimuli)
    guesses = table.guess or PriorConfig(minimum=guess, maximum=guess, points=1)
    after = (table.width.weights, table.lapse.weights, guesses.weights)
    if table.rise is None:
        return parameter_grid(
            stimuli=x[:, 0],
            thresholds=table.scaled(table.threshold),
            widths=table.width.values,
            lapses=table.lapse.values,
            guesses=guesses.values,
            prior=_outer(table.threshold.weights, *after),
            shape=table.shape,
            either_way=table.lapse_either_way,
        )
    floor_weights = np.ones(1) if table.floor is None else table.floor.weights
    return surface_grid(
        stimuli=np.column_stack([x[:, 0], x[:, 1] - x[:, 1].mean()]),
        intercepts=table.scaled(table.threshold),
        rises=table.rise.values,
        floors=np.array([-np.inf]) if table.floor is None else table.scaled(table.floor),
        widths=table.width.values,
        lapses=table.lapse.values,
        guesses=guesses.values,
        prior=_outer(table.threshold.weights, table.rise.weights, floor_weights, *after),
        shape=table.shape,
        either_way=table.lapse_either_way,
    )


def _outer(*weights: Shares) -> Shares:
    return np.asarray(reduce(np.multiply.outer, weights))
