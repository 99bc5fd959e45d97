"""Synthetic people at each procedure: constant stimuli, up-down tracks, and the posterior rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from analysis.stats.arrays import FloatArray
from analysis.summary.thresholds import FittedShare
from experiments.design.procedures.choosing import PosteriorRule
from experiments.design.procedures.posterior import (
    VarianceRule,
    best_stimulus,
    parameter_grid,
    posterior_after,
    variance_rule,
)
from experiments.design.procedures.up_down import LevelRange, TrackEnd, UpDown, track_after

_STEPS = 60
"""So many steps from the lowest level to the highest may be taken by what adapts."""
_THRESHOLDS, _WIDTHS, _LAPSES, _GUESSES = 41, 12, (0.0, 0.02, 0.06), (0.0, 0.05, 0.1, 0.2)
_PROCEDURES = ("constant stimuli", "2-down-1-up", "3-down-1-up", "posterior")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SyntheticPeople:
    """People with thresholds (n,): right, or yes, with g + (1 - g - lapse) F(ln(x / threshold) / spread).

    `chance`: whether g is that of somebody who guesses, which the rule and the fit know.
    """

    thresholds: FloatArray
    spread: float
    lapse: float
    guess: float
    chance: bool

    def shares(self, levels: FloatArray) -> FloatArray:
        """How often each succeeds at their level (n,)."""
        with np.errstate(divide="ignore"):
            felt = ndtr(np.log(np.maximum(levels, 0.0) / self.thresholds) / self.spread)
        return np.asarray(self.guess + (1 - self.guess - self.lapse) * felt)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answers:
    """What was felt and whether it was right: (people, trials) each."""

    levels: FloatArray
    right: FloatArray


def procedures(share: FittedShare) -> tuple[str, ...]:
    """The procedures that are compared; of yes and of choices also the one that goes to one half."""
    return _PROCEDURES if share == "right" else ("constant stimuli", "1-down-1-up", *_PROCEDURES[1:])


def answers_by(
    procedure: str,
    people: SyntheticPeople,
    levels: Sequence[float],
    trials: int,
    stream: np.random.Generator,
    *,
    own: PosteriorRule | None = None,
) -> Answers:
    """All answers of the people; `levels`: those of the design, between which everything adaptive stays.

    `own`: the posterior rule that the design has.
    """
    if procedure == "constant stimuli":
        return _constant(people, np.array(levels), trials, stream)
    if procedure == "posterior":
        return _posterior(people, levels, trials, stream, own)
    return _track(int(procedure[0]), people, levels, trials, stream)


def _constant(people: SyntheticPeople, levels: FloatArray, trials: int, stream: np.random.Generator) -> Answers:
    blocks = [
        stream.permuted(np.tile(levels, (people.thresholds.size, 1)), axis=1) for _ in range(-(-trials // levels.size))
    ]
    shown = np.concatenate(blocks, axis=1)[:, :trials]
    shares = np.stack([people.shares(level) for level in shown.T], axis=1)
    return Answers(levels=shown, right=(stream.random(shown.shape) < shares).astype(float))


def _track(
    down: int, people: SyntheticPeople, levels: Sequence[float], trials: int, stream: np.random.Generator
) -> Answers:
    """From the highest level, in steps of an eighth, a sixteenth and a thirtieth of the range."""
    low, high = min(levels), max(levels)
    span = high - low
    rule = UpDown(
        start=high,
        steps=(span / 8, span / 16, span / 30),
        within=LevelRange(low=low, high=high, grain=span / _STEPS),
        stop=TrackEnd(trials=trials + 1),
        down=down,
    )
    chances, count = stream.random((people.thresholds.size, trials)), people.thresholds.size
    answers: list[list[bool]] = [[] for _ in range(count)]
    shown = np.empty((count, trials))
    for trial in range(trials):
        shown[:, trial] = [track_after(rule, own).next_level for own in answers]
        right = chances[:, trial] < people.shares(shown[:, trial])
        for own, one in zip(answers, right.tolist(), strict=True):
            own.append(one)
    return Answers(levels=shown, right=np.array(answers, dtype=float))


def _posterior(
    people: SyntheticPeople,
    levels: Sequence[float],
    trials: int,
    stream: np.random.Generator,
    own: PosteriorRule | None,
) -> Answers:
    """The design's own rule, else that of least expected variance of the threshold."""
    count, rule = people.thresholds.size, _vague_rule(people, levels) if own is None else own.rule
    known, stimuli = rule.known, np.linspace(min(levels), max(levels), _STEPS + 1) if own is None else np.array(levels)
    posterior = np.repeat(known.start()[None], count, axis=0)
    shown, right = np.empty((count, trials)), np.empty((count, trials))
    for trial in range(trials):
        place = best_stimulus(rule.gains(posterior))
        shown[:, trial] = stimuli[place]
        right[:, trial] = stream.random(count) < people.shares(shown[:, trial])
        posterior = posterior_after(known, posterior, place, right[:, trial] > 0)
    return Answers(levels=shown, right=right)


def _vague_rule(people: SyntheticPeople, levels: Sequence[float]) -> VarianceRule:
    """Guess rates are known of right answers alone."""
    low, high = min(levels), max(levels)
    span = high - low
    known = parameter_grid(
        stimuli=np.linspace(low, high, _STEPS + 1),
        thresholds=np.linspace(low - span / 4, high + span / 4, _THRESHOLDS),
        widths=np.geomspace(span / 10, 2 * span, _WIDTHS),
        lapses=np.array(_LAPSES),
        guesses=np.array([people.guess] if people.chance else _GUESSES),
    )
    return variance_rule(known)
