"""What the published numbers are called: one name for the table of published and obtained, and for the audit."""

from __future__ import annotations

from analysis.paper.paper import BinomialClaim, Lowest, SameScore, TukeyClaim

ANOVA_F, ANOVA_P, PARTICIPANTS = "ANOVA F", "ANOVA p", "participants"


def anova_df(kind: str) -> str:
    """Degrees of freedom of the effect or of the error."""
    return f"ANOVA df of the {kind}"


def tukey_p(claim: TukeyClaim) -> str:
    """The p of a post-hoc comparison."""
    return f"Tukey p, {claim.higher} above {claim.lower}"


def mean_rate(method: str) -> str:
    """A mean correct rate on forward shots."""
    return f"mean correct rate forward, {method}"


def binomial_p(claim: BinomialClaim) -> str:
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
