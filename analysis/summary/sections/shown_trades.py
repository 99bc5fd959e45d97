"""Whose speed and accuracy a report tells of, and by which names: of experiment 1 and of designs' questions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from analysis.report import apa
from analysis.report.labels import display_name
from analysis.summary.figures.trade import Trade, TradeNames
from analysis.summary.results import DesignSummary, StudyStatistics
from analysis.summary.sections.content import condition_words
from analysis.times.cells import Mean
from analysis.times.own_trials import INSTRUCTION
from analysis.times.speed_accuracy import SpeedAccuracy
from device.messages import how_many
from device.words import DIRECTIONS

if TYPE_CHECKING:
    from analysis.summary.question_results import QuestionSummary


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownTrade:
    """Speed and accuracy of experiment 1, or of a question of a design, with what it takes to tell of them.

    `of`: which question it is, empty of experiment 1; `people`: who, in words; `first`: the answer that the start of
    the diffusion leans to; `stems`: of the figures of conditional accuracy and quantile probabilities.
    """

    trade: Trade
    of: str
    people: str
    synthetic: bool
    first: str
    names: TradeNames
    stems: tuple[str, str]


def shown_trades(statistics: StudyStatistics, word: Callable[[str], str] = display_name) -> Iterator[ShownTrade]:
    """All measures of speed and accuracy; `word` makes names of codes."""
    if (direction := statistics.direction) is not None:
        yield ShownTrade(
            trade=direction.speed_accuracy,
            of="",
            people=direction.people,
            synthetic=direction.origin.synthetic,
            first=DIRECTIONS[0],
            names=_names(direction.speed_accuracy, {method: word(method) for method in direction.methods}, str),
            stems=("figure-conditional-accuracy", "figure-quantile-probability"),
        )
    for name, design in statistics.designs.items():
        yield from _of_design(name, design, word)


def _of_design(name: str, design: DesignSummary, word: Callable[[str], str]) -> Iterator[ShownTrade]:
    for asked, question in design.questions.items():
        if (trade := question.speed_accuracy) is not None:
            yield ShownTrade(
                trade=trade,
                of=f"{design.title or name.capitalize()}, {asked}",
                people=how_many(design.n, "synthetic participant" if design.origin.synthetic else "participant"),
                synthetic=design.origin.synthetic,
                first=next((question.label(one) for cell in question.cells[:1] for one in cell.answers or ()), ""),
                names=_names_of_design(design, trade, word),
                stems=(f"figure-{name}-{asked}-conditional-accuracy", f"figure-{name}-{asked}-quantile-probability"),
            )


def _names_of_design(design: DesignSummary, trade: Trade, word: Callable[[str], str]) -> TradeNames:
    def instruction(level: str) -> str:
        return condition_words(design, f"{INSTRUCTION} {level}", word) if INSTRUCTION in design.factors else level

    conditions = () if trade is None else trade.methods
    return _names(trade, {one: condition_words(design, one, word) for one in conditions}, instruction)


def instruction_sentences(design: DesignSummary, question: QuestionSummary) -> Iterator[str]:
    """What each instruction gave in time and accuracy beside another, in the mean over conditions."""
    trade = question.speed_accuracy
    effects = trade.instruction_effects if isinstance(trade, SpeedAccuracy) else ()
    names = _names_of_design(design, trade, display_name).instructions
    over = {None} if any(one.method is None for one in effects) else {one.method for one in effects}
    for one in effects:
        if one.method in over and one.mean_s.people > 1:
            whose = f"paired by participant, n = {one.mean_s.people:,}"
            time, right = _more(one.mean_s, 1.0, 3), _more(one.accuracy, 100.0, 1)
            yield (
                f"Told “{names[one.a]}” instead of “{names[one.b]}” ({whose}): mean time {time} s, right answers "
                f"{right} percentage points (95 % intervals)."
            )


def _more(one: Mean, scale: float, digits: int) -> str:
    mean, low, high = (None if value is None else scale * value for value in (one.mean, one.ci_low, one.ci_high))
    sign = "+" if mean is not None and mean > 0.0 else ""
    return f"{sign}{apa.number(mean, digits)} {apa.interval(low, high, digits)}"


def _names(trade: Trade, conditions: Mapping[str, str], instruction: Callable[[str], str]) -> TradeNames:
    told = () if trade is None else trade.instructions
    return TradeNames(conditions=conditions, instructions={one: instruction(one) for one in told})
