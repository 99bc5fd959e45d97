"""The names of the published numbers, and what is said of each beside the obtained one."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Literal

from analysis.paper.paper import (
    Lowest,
    PublishedBinomialTest,
    PublishedTukeyTest,
    SameScore,
)

ANOVA_F, ANOVA_P, PARTICIPANTS = "ANOVA F", "ANOVA p", "participants"


def anova_df(kind: str) -> str:
    """Degrees of freedom of the effect or of the error."""
    return f"ANOVA df of the {kind}"


def tukey_p(claim: PublishedTukeyTest) -> str:
    """The p of a post-hoc comparison."""
    return f"Tukey p, {claim.higher} above {claim.lower}"


def mean_rate(method: str) -> str:
    """A mean correct rate on forward shots."""
    return f"mean correct rate forward, {method}"


def one_half_p(claim: PublishedBinomialTest) -> str:
    """The p of a test against one half."""
    return f"binomial p, {claim.method} {claim.direction}"


def rated_lowest(claim: Lowest) -> str:
    """How many rated a method lowest."""
    return f"participants who rated {claim.method} lowest"


def one_score(claim: SameScore) -> str:
    """How many gave two methods one score."""
    return f"participants with one score for {' and '.join(claim.methods)}"


def named_in(experiment: str, quantity: str) -> str:
    """A quantity of an experiment.

    >>> named_in("direction", ANOVA_F)
    'direction: ANOVA F'
    """
    return f"{experiment}: {quantity}"


ComparisonVerdict = Literal[
    "agrees",
    "differs",
    "differs as predicted",
    "not published",
    "not obtained",
    "attainable",
    "only under a reading",
    "not attainable",
    "undecided",
]
AUDITED: tuple[ComparisonVerdict, ...] = ("attainable", "only under a reading", "not attainable", "undecided")
"""The audit's verdicts, of numbers that no log holds; the others are of numbers that were obtained or could be."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonRow:
    """One quantity: `published` as the paper prints it, `obtained` unrounded in the same unit.

    `audit`: what the audit says of the published number; empty if it was not asked.
    """

    experiment: str
    quantity: str
    published: str
    obtained: float | None
    verdict: ComparisonVerdict
    note: str = ""
    audit: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What the audit says of a published number: its verdict, the nearest attainable values, and that in words."""

    verdict: str
    nearest: tuple[float, ...] = ()
    note: str = ""


def rounds_to(value: float, printed: str) -> bool:
    """Does `value` round to `printed`, a tie either way?

    >>> rounds_to(55.714, "55.7"), rounds_to(55.65, "55.7"), rounds_to(55.64, "55.7")
    (True, True, False)
    """
    half_a_digit = Decimal(5).scaleb(int(Decimal(printed).as_tuple().exponent) - 1)
    return abs(Decimal(repr(value)) - Decimal(printed)) <= half_a_digit + Decimal("1e-12")
