"""What is measured in the two tables that have names of their own: trials of `direction`, ratings of `preference`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from device.words import Direction


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """The columns of a table by what they hold, and the words for its scores.

    `asked` is what was presented, `answer` what was said of it, by whose `hand`. Tests take `score`, which lies on the
    `scale`, of all rows or of one direction's alone; `unit` says what a score is.
    """

    asked: tuple[str, ...]
    answer: str
    hand: str
    score: str
    scale: tuple[float, float]
    unit: str
    direction: Direction | None = None
    missing: str
    absent: str
    rule: str
    remedy: str
    """Of who has answers too few: what is `missing`, or a method `absent`, by which rule, and what to do."""

    @property
    def named(self) -> tuple[str, ...]:
        """The columns that a map of another program's log has to name."""
        return (*self.asked, self.answer)

    @property
    def held(self) -> tuple[str, ...]:
        """The columns without which a table has nothing to analyse, though a cell of them may be empty."""
        return tuple(dict.fromkeys((self.answer, self.score)))


MEASURES: Mapping[str, Measure] = {
    "direction": Measure(
        asked=("method", "direction"),
        answer="response",
        hand="response_source",
        score="correct",
        scale=(0.0, 1.0),
        unit="right answers to forward shots",
        direction="forward",
        missing="trials unanswered",
        absent="no forward trials with",
        rule="every trial is answered",
        remedy="`drop_unanswered = true` under [trials] in a file for --rules leaves out the trials, not the person",
    ),
    "preference": Measure(
        asked=("method",),
        answer="rating",
        hand="rating_by",
        score="rating",
        scale=(0.0, 10.0),
        unit="ratings",
        missing="ratings missing",
        absent="no rating of",
        rule="every method is rated",
        remedy=(
            "a test of all methods needs every rating; `drop_unanswered = true` under [trials] in a file for --rules "
            "keeps whoever rated the method another time"
        ),
    ),
}
"""By experiment; other designs say by themselves what they measure."""

NOT_STATED = "not stated"
"""The gun of logs whose map names none."""


def scale_of_others(ends: tuple[float, float]) -> str:
    """What there is to say of another program's ratings: their question and what the ends mean are in no log.

    >>> scale_of_others((1.0, 7.0)).partition(";")[0]
    'Ratings from 1 to 7 were rescaled linearly to 0 to 10'
    """
    low, high = ends
    as_they_are = (low, high) == (0.0, 10.0)
    came = "went from 0 to 10" if as_they_are else f"from {low:g} to {high:g} were rescaled linearly to 0 to 10"
    return f"Ratings {came}; the logs are another program's and tell neither the question nor what the ends mean."
