"""Participants of this paper, rebuilt: data that meet every published number that can be met, by seed.

Where the published F is not attainable from the published means, the nearest one that is takes its place. What the
paper does not print (backward rates of the asymmetric methods, means and spreads of ratings) is an argument, assumed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from analysis.paper.audit.binomial import binomial_p
from analysis.paper.audit.claims import STARS
from analysis.paper.audit.lattices import Rows, effect
from analysis.paper.audit.means import AnswerScale, scale_of
from analysis.paper.audit.printed import CheckResult, Interval, Rounding, read_printed
from analysis.paper.audit.reconstruct import (
    ColumnOrder,
    ColumnSums,
    ConditionColumn,
    Constraints,
    Reconstruction,
    reconstruct,
)
from analysis.paper.audit.variance_ratios import repeated_f
from analysis.paper.paper import PublishedDirection, PublishedExperiment, PublishedPreference, PublishedTukeyTest
from analysis.stats.studentized_range import studentized_range_isf

MEAN_SLACK = Fraction(3, 10)
"""How far an assumed mean rating may be off in a data set, in units of the scale; assumed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RebuiltAnswers:
    """Rows of whole numbers, a column a method in the paper's order; `F` as text of what they give; `search` how."""

    rows: Rows
    F: str
    nearest_only: bool
    search: Reconstruction


def forward_counts(paper: PublishedDirection, seed: int) -> RebuiltAnswers:
    """Correct answers on forward trials: published means, F (or the nearest), Tukey pattern and binomial p.

    `ValueError` if no such data were found.
    """
    trials = paper.protocol.forward_trials_per_session
    scale = scale_of(_decimal(trials), "0", "1")
    means = [f"{paper.means[method]}%" for method in paper.methods]
    found = repeated_f(paper.anova.F, paper.n, len(means), means, grain=_decimal(trials), low="0", high="1")
    wanted, shown = attainable_f(paper.anova.F, found)
    sums = [scale.sums(read_printed(mean).interval(Rounding.HALF_UP), paper.n) for mean in means]
    columns = [_with_binomial(paper, "forward", place, allowed) for place, allowed in enumerate(sums)]
    return _rebuilt(_constraints(paper, scale, columns, wanted), shown, shown != paper.anova.F, seed)


def backward_counts(paper: PublishedDirection, rates: Mapping[str, float], seed: int) -> Reconstruction:
    """Correct answers on backward trials: the published binomial p; else the assumed rates, to the nearest count.

    `ValueError` if no such data were found.
    """
    trials = paper.protocol.backward_trials_per_session
    nearest = [round(rates[method] * trials * paper.n) for method in paper.methods]
    columns = [_with_binomial(paper, "backward", place, [total]) for place, total in enumerate(nearest)]
    wanted = Constraints(n=paper.n, top=trials, columns=tuple(ConditionColumn(sums=sums) for sums in columns))
    return _found(reconstruct(wanted, seed))


def rating_grains(
    paper: PublishedPreference, means: Mapping[str, float], grain: str, person_sd: float, seed: int
) -> RebuiltAnswers:
    """Ratings in grains above the scale's lower end: published F, Tukey pattern, who is lowest, who gave one score.

    `means` and `person_sd` are assumed: no mean is published. `ValueError` if no such data were found.
    """
    scale = scale_of(grain, str(paper.scale_min), str(paper.scale_max))
    slack = int(MEAN_SLACK / scale.grain * paper.n)
    centres = [round((Fraction(str(means[method])) - scale.origin) / scale.grain * paper.n) for method in paper.methods]
    columns = [range(centre - slack, centre + slack + 1) for centre in centres]
    F = read_printed(paper.anova.F).interval(Rounding.HALF_UP)
    spread = person_sd / float(scale.grain)
    wanted = _constraints(paper, scale, columns, F, orders=_orders(paper), person_sd=spread)
    return _rebuilt(wanted, paper.anova.F, False, seed)


def attainable_f(printed: str, found: CheckResult) -> tuple[Interval, str]:
    """The F to give: what prints so where it is attainable, else the nearest that is; and its text.

    `ValueError` if there is neither.
    """
    number = read_printed(printed)
    if found.verdict in {"attainable", "undecided"}:
        return number.interval(Rounding.HALF_UP), printed
    sides = [value for value in (found.below, found.above) if value is not None]
    if not sides:
        raise ValueError(f"F = {printed} is not attainable, and no F near it was found to be")
    nearest = min(sides, key=lambda value: abs(value - number.value))
    digits = len(number.text.partition(".")[2])
    return Interval(nearest, nearest), f"{float(nearest):.{digits}f}"


def pattern_holds(paper: PublishedExperiment) -> Callable[[ColumnSums], bool]:
    """Says of column sums whether they, with the printed F, give the published Tukey pattern, stars included.

    q^2 = k (k - 1) F d^2 / A for a difference d of column sums, A as in `lattices`.
    """
    k, F = len(paper.methods), float(read_printed(paper.anova.F).value)
    df = (paper.n - 1) * (k - 1)
    places = [(paper.methods.index(claim.higher), paper.methods.index(claim.lower)) for claim in paper.tukey]
    bounds = [_q_bounds(claim, k, df) for claim in paper.tukey]

    def holds(sums: ColumnSums) -> bool:
        a = effect(sums)
        for (higher, lower), (least, most) in zip(places, bounds, strict=True):
            apart = sums[higher] - sums[lower]
            if apart <= 0 or not least < (k * (k - 1) * F / a) ** 0.5 * apart <= most:
                return False
        return True

    return holds


def _q_bounds(claim: PublishedTukeyTest, k: int, df: int) -> tuple[float, float]:
    """The q that p must exceed, and the next level's, which a single star says it does not."""
    next_level = STARS.get(claim.p_below)
    least = float(studentized_range_isf(float(claim.p_below), k, df))
    return least, float(studentized_range_isf(float(next_level), k, df)) if next_level else float("inf")


def _with_binomial(paper: PublishedDirection, direction: str, place: int, allowed: Sequence[int]) -> Sequence[int]:
    """The counts that also give the published binomial p; for a direction without published means, the nearest."""
    protocol = paper.protocol
    forward, method = direction == "forward", paper.methods[place]
    n = paper.n * (protocol.forward_trials_per_session if forward else protocol.backward_trials_per_session)
    claims = [claim for claim in paper.binomial if (claim.method, claim.direction) == (method, direction)]
    for claim in claims:
        counts = dict(binomial_p(claim.p, n).numbers)[f"counts of {n} that give p"]
        fitting = [int(text) for text in counts.split(", ") if text.isdigit()]
        if forward:
            return [count for count in fitting if count in allowed]
        return [min(fitting, key=lambda count: abs(count - allowed[0]))] if fitting else allowed
    return allowed


def _orders(paper: PublishedPreference) -> tuple[ColumnOrder, ...]:
    """Who is lowest, and who gave one score."""
    index = {method: place for place, method in enumerate(paper.methods)}
    lowest = paper.lowest
    below = [method for method in paper.methods if method != lowest.method]
    one, other = (index[method] for method in paper.same_score.methods)
    orders = [ColumnOrder(one=index[method], other=index[lowest.method], above=lowest.participants) for method in below]
    return (*orders, ColumnOrder(one=one, other=other, tied=paper.same_score.participants))


def _constraints(
    paper: PublishedExperiment,
    scale: AnswerScale,
    columns: Sequence[Sequence[int]],
    F: Interval,
    **more: Any,
) -> Constraints:
    return Constraints(
        n=paper.n,
        top=scale.high or 0,
        columns=tuple(ConditionColumn(sums=sums) for sums in columns),
        F=F,
        accepts=pattern_holds(paper),
        **more,
    )


def _rebuilt(wanted: Constraints, F: str, nearest_only: bool, seed: int) -> RebuiltAnswers:
    search = _found(reconstruct(wanted, seed))
    return RebuiltAnswers(rows=search.data[0], F=F, nearest_only=nearest_only, search=search)


def _found(search: Reconstruction) -> Reconstruction:
    if not search.data:
        how = "none exist" if search.exists is False else f"none were found in {search.starts} starts"
        raise ValueError(f"no participants meet the published numbers together: {how}")
    return search


def _decimal(trials: int) -> str:
    """One of so many trials as decimal text."""
    return f"{1 / trials:.12f}".rstrip("0")
