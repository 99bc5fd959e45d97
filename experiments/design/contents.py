"""What the trials of a session hold, before their order is known: cells, intervals, catch trials. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from experiments.config.door import ConfigError
from experiments.design.config import DesignConfig
from experiments.design.language import MAX_TRIALS, Level, TrialConfig
from experiments.design.plan import Condition
from experiments.design.streams import Stream


def cells(design: DesignConfig, names: Sequence[str], given: Condition = ()) -> list[Condition]:
    """Every combination of the factors' levels, nested ones by the level that they are nested in.

    `given` are levels that hold already; a factor that is nested in one of them has the levels that it has there.
    """
    found: list[Condition] = [()]
    for name in _outer_first(design, names):
        factor = design.factors[name]
        found = [
            (*cell, (name, level))
            for cell in found
            for level in factor.levels_within(dict((*given, *cell)).get(factor.within or ""))
        ]
    return [in_order(design, cell) for cell in found]


def _outer_first(design: DesignConfig, names: Sequence[str]) -> list[str]:
    return sorted(names, key=lambda name: design.factors[name].within is not None)


def in_order(design: DesignConfig, levels: Condition) -> Condition:
    """Levels in the order of the file."""
    order = {name: at for at, name in enumerate(design.factors)}
    return tuple(sorted(levels, key=lambda pair: order[pair[0]]))


def session_cells(design: DesignConfig, given: Condition) -> list[Condition]:
    """The cells that vary from trial to trial, but for what the intervals of a pair differ in."""
    names = [name for name in design.varying if name != design.trial.compare or design.trial.kind != "pair"]
    return cells(design, names, given)


@dataclass(frozen=True, slots=True)
class Streams:
    """The random streams of one session: one a purpose."""

    seed: int
    session: tuple[str, ...]

    def of(self, purpose: str, *more: str) -> Stream:
        """The stream of a purpose."""
        return Stream(self.seed, purpose, *self.session, *more)


@dataclass(frozen=True, slots=True)
class Content:
    """What a trial holds, before its place is known."""

    levels: Condition
    intervals: tuple[Level, ...] = ()
    odd: int | None = None
    catch: bool = False
    track: int = 0


def trial_contents(design: DesignConfig, given: Condition, streams: Streams) -> list[Content]:
    """What the trials of a session hold: each cell as often as it is repeated, and the catch trials."""
    found = session_cells(design, given)
    count = len(found) * design.order.repetitions + design.trial.catch
    if count > MAX_TRIALS:
        raise ConfigError(
            f"order.repetitions = {design.order.repetitions}: a session of {count:,} trials is more than the "
            f"{MAX_TRIALS:,} that are planned; repeat less"
        )
    if design.trial.intervals > 1:
        contents = [
            one for at, cell in enumerate(found) for one in _compared(design, cell, streams.of("intervals", str(at)))
        ]
    else:
        contents = [Content(cell) for cell in found for _ in range(design.order.repetitions)]
    return contents + catch_contents(design, found)


def catch_contents(design: DesignConfig, found: Sequence[Condition]) -> list[Content]:
    """The catch trials of a session, with the levels that all of its cells share."""
    blank = tuple(pair for pair in found[0] if len(design.factors[pair[0]].all_levels) == 1) if found else ()
    return [Content(blank, catch=True)] * design.trial.catch


def _compared(design: DesignConfig, cell: Condition, stream: Stream) -> list[Content]:
    """The repetitions of a cell, with every arrangement of its intervals as equally often as it gets."""
    trial, repetitions = design.trial, design.order.repetitions
    name = trial.compare or ""
    if trial.kind == "pair":
        pairs = list(combinations(design.factors[name].levels_within(None), 2))
        return [
            Content(cell, pair if first else pair[::-1], odd=None)
            for pair in pairs
            for first in stream.shuffled([place % 2 == 0 for place in some_places(repetitions, stream)])
        ]
    level, standard = dict(cell)[name], trial.standard
    if standard is None:
        raise ConfigError(f"trial.standard is missing: kind {trial.kind!r} compares with it")
    forms = arrangements(trial, level, standard)
    chosen = [forms[place % len(forms)] for place in some_places(repetitions, stream, len(forms))]
    return [Content(cell, held, odd) for held, odd in stream.shuffled(chosen)]


def some_places(count: int, stream: Stream, forms: int = 2) -> range:
    """So many places in a row, from a random one on: which form comes once more is chance."""
    start = stream.below(forms)
    return range(start, start + count)


def arrangements(trial: TrialConfig, level: Level, standard: Level) -> list[tuple[tuple[Level, ...], int]]:
    """What the intervals hold, and the place of the comparison: in ABX of the one that X repeats."""
    if trial.kind == "two-interval":
        forms = {"second": ((level, standard), 0), "first": ((standard, level), 1)}
        return [form for place, form in forms.items() if trial.standard_interval in {place, "random"}]
    if trial.kind == "abx":
        return [((*pair, pair[x]), x) for pair in ((level, standard), (standard, level)) for x in (0, 1)]
    return [(tuple(level if at == odd else standard for at in range(3)), odd) for odd in range(3)]
