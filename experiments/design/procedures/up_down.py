"""Up-down tracks: the next level follows from the answers so far alone, so a corrected answer counts from the first.

Transformed (n up, m down; Levitt 1971), weighted (Kaernbach 1991), and accelerated stochastic approximation (Kesten
1958). Each moves towards the level at which a share of the answers, `target`, is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

_HALVINGS = 60
_EARLY = 2
"""So many steps of Kesten's rule shrink by themselves, later ones with the reversals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelRange:
    """The levels that a track may take: from `low` to `high`, on a grid of `grain` from `low` (0: any).

    With `factors` a step multiplies the level, else it is added. `easier` is 1 where a higher level is easier, else -1.
    """

    low: float
    high: float
    grain: float = 0.0
    factors: bool = False
    easier: int = 1

    def kept(self, level: float) -> float:
        """The nearest level that may be taken."""
        if self.grain:
            level = round(self.low + round((level - self.low) / self.grain) * self.grain, 12)
            level -= self.grain if level > self.high + 1e-9 * self.grain else 0.0
        return min(max(level, self.low), self.high)

    def moved(self, level: float, step: float) -> float:
        """A level so many steps easier, or harder where that is below 0, wherever it may lead."""
        return level * step**self.easier if self.factors else level + self.easier * step


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackEnd:
    """When a track is over: after so many trials or reversals, whichever comes first; 0 is no limit.

    Reversals end it after the `least` trials at the earliest.
    """

    trials: int = 0
    reversals: int = 0
    least: int = 0

    def reached(self, trials: int, reversals: int) -> bool:
        """Whether it is over."""
        return 0 < self.trials <= trials or (0 < self.reversals <= reversals and self.least <= trials)


@dataclass(frozen=True, slots=True, kw_only=True)
class UpDown:
    """`up` wrong answers in a row make it easier, `down` right ones harder.

    `steps` are the sizes of a step by the number of reversals so far, the last for all further ones: what is added, or
    the factor. A step towards easier is `ratio` times as large (of a factor: its power).
    """

    start: float
    steps: tuple[float, ...]
    within: LevelRange
    stop: TrackEnd
    up: int = 1
    down: int = 1
    ratio: float = 1.0

    @property
    def target(self) -> float:
        """The share of right answers at which steps up and down balance: between 0 and 1.

        >>> rule = dict(start=8.0, steps=(1.0,), within=LevelRange(low=0, high=9), stop=TrackEnd(trials=40))
        >>> round(UpDown(down=3, **rule).target, 4), round(UpDown(ratio=3.0, **rule).target, 4)
        (0.7937, 0.75)
        """
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            harder = _harder_first(middle, self.down, self.up)
            low, high = (low, middle) if harder > self.ratio * (1 - harder) else (middle, high)
        return (low + high) / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Kesten:
    """Steps that shrink with each change of direction: x - c (right - target) / (2 + changes) from the third trial on.

    The first two steps are c (right - target) / n. `first_step` is c (Treutwein 1995, equation 12). On a grid the level
    nearest to x is taken, while x goes on by steps of any size: rounded off, the smaller one of the two would be lost.
    """

    start: float
    first_step: float
    target: float
    within: LevelRange
    stop: TrackEnd


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackState:
    """Where a track stands: the level of the next trial, `None` when it is over.

    `levels` are those that the answers so far called for, and `reversals` those at which the direction changed.
    `at_edge`: the rule would have gone farther than the range.
    """

    next_level: float | None
    levels: tuple[float, ...] = ()
    reversals: tuple[float, ...] = ()
    at_edge: bool = False


def track_after(rule: UpDown | Kesten, answers: Iterable[bool]) -> TrackState:
    """Where a track stands after these answers, right or not.

    >>> rule = UpDown(start=8.0, steps=(2.0, 1.0), within=LevelRange(low=0, high=9), stop=TrackEnd(reversals=2))
    >>> track_after(rule, [True, True, False])
    TrackState(next_level=5.0, levels=(8.0, 6.0, 4.0), reversals=(4.0,), at_edge=False)
    """
    given = iter(answers)
    return track_of(rule, lambda _: next(given, None))


def track_of(rule: UpDown | Kesten, answer: Callable[[float], bool | None]) -> TrackState:
    """The track of somebody who answers each level so: right or not, `None` when there is no answer yet.

    >>> rule = UpDown(start=8.0, steps=(1.0,), within=LevelRange(low=0, high=9), stop=TrackEnd(trials=6))
    >>> track_of(rule, lambda level: level > 5).levels
    (8.0, 7.0, 6.0, 5.0, 6.0, 5.0)
    """
    walk = _Walk(rule.within.kept(rule.start))
    while not (over := rule.stop.reached(len(walk.levels), len(walk.reversals))):
        if (right := answer(walk.level)) is None:
            break
        walk.levels.append(walk.level)
        step = walk.up_down(rule, right=right) if isinstance(rule, UpDown) else walk.kesten(rule, right=right)
        walk.go(rule, step)
    return TrackState(
        next_level=None if over else walk.level,
        levels=tuple(walk.levels),
        reversals=tuple(walk.reversals),
        at_edge=walk.at_edge,
    )


class _Walk:
    """A track on its way through its answers."""

    def __init__(self, level: float) -> None:
        self.level, self.at_edge = level, False
        self._exact = level
        self.levels: list[float] = []
        self.reversals: list[float] = []
        self._right = self._wrong = 0
        self._heading = 0

    def up_down(self, rule: UpDown, *, right: bool) -> tuple[int, float]:
        """The heading (1 easier, -1 harder, 0 none) and the step."""
        self._right, self._wrong = (self._right + 1, 0) if right else (0, self._wrong + 1)
        heading = -1 if self._right == rule.down else 1 if self._wrong == rule.up else 0
        if not heading:
            return 0, 0.0
        self._right = self._wrong = 0
        self._turn(heading)
        size = rule.steps[min(len(self.reversals), len(rule.steps) - 1)]
        if rule.within.factors:
            return heading, size**rule.ratio if heading > 0 else 1 / size
        return heading, size * rule.ratio if heading > 0 else -size

    def kesten(self, rule: Kesten, *, right: bool) -> tuple[int, float]:
        """The heading and the step."""
        self._turn(-1 if right else 1)
        trials = len(self.levels)
        shrunk = trials if trials <= _EARLY else 2 + len(self.reversals)
        step = -rule.first_step * (right - rule.target) / shrunk
        return (-1 if right else 1), 2.0**step if rule.within.factors else step

    def _turn(self, heading: int) -> None:
        if self._heading and heading != self._heading:
            self.reversals.append(self.level)
        self._heading = heading

    def go(self, rule: UpDown | Kesten, taken: tuple[int, float]) -> None:
        """Take a step, as far as the range lets it; without one the track stays where it is, at the edge too."""
        (heading, step), within = taken, rule.within
        if not heading:
            return
        wanted = within.moved(self._exact, step)
        self.at_edge = not within.low <= wanted <= within.high
        self.level = within.kept(wanted)
        self._exact = self.level if isinstance(rule, UpDown) else min(max(wanted, within.low), within.high)


def _harder_first(right: float, down: int, up: int) -> float:
    """How often `down` right answers in a row come before `up` wrong ones in a row (Feller 1968, section XIII.8)."""
    wrong = 1 - right
    one, other = right ** (down - 1) * (1 - wrong**up), wrong ** (up - 1) * (1 - right**down)
    return one / (one + other) if one + other else right
