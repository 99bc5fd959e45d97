"""What a part of the bench is asked for and what it finds: rows, words, and its panel of the figure of trades."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.predict.bench.figure import TradePanel
from analysis.report.section import Section
from analysis.report.terminal import Progress


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRequest:
    """What to measure with: shots of a batch, synthetic people a procedure and a caution, studies of a size."""

    seed: int
    repeats: int
    batch: int
    progress: Progress
    people: int = 100
    studies: int = 2_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Bought:
    """One more of something, in words: where, what it costs, and what it buys."""

    more: str
    where: str
    costs: str
    buys: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What a part found: its rows, the section that tells them, and its trade with the panel that shows it."""

    rows: Sequence[object]
    section: Section
    bought: tuple[Bought, ...] = ()
    panel: TradePanel | None = None
