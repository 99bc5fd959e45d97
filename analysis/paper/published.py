"""The published numbers beside the obtained ones, row by row, under one name each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any, Literal

from analysis.paper.paper import (
    BinomialClaim,
    Lowest,
    Paper,
    PublishedDirection,
    PublishedExperiment,
    PublishedPreference,
    SameScore,
    TukeyClaim,
)

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


Verdict = Literal[
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
AUDITED: tuple[Verdict, ...] = ("attainable", "only under a reading", "not attainable", "undecided")
"""The audit's verdicts, of numbers that no log holds; the others are of numbers that were obtained or could be."""
Statistics = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One quantity: `published` as the paper prints it, `obtained` unrounded in the same unit.

    `audit`: what the audit says of the published number; empty if it was not asked.
    """

    experiment: str
    quantity: str
    published: str
    obtained: float | None
    verdict: Verdict
    note: str = ""
    audit: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What the audit says of a published number: its verdict, the nearest attainable values, and that in words."""

    verdict: str
    nearest: tuple[float, ...] = ()
    note: str = ""


def compare(statistics: Statistics, paper: Paper, predicted: Mapping[str, Prediction] | None = None) -> tuple[Row, ...]:
    """Every published number against `statistics` (the content of `statistics.json`).

    A number agrees if it rounds to the printed digits; a bound or an order, if it is true of the obtained numbers. What
    the paper draws but does not print is listed as not published. `predicted`: by `named_in`, what the audit
    says; a difference to one of the nearest attainable values is the one that it predicts.
    """
    direction, preference = statistics.get("direction"), statistics.get("preference")
    rows = [*_common("direction", paper.direction, direction), *_direction(paper.direction, direction)]
    rows += [*_common("preference", paper.preference, preference), *_preference(paper.preference, preference)]
    known = predicted or {}
    return tuple(_beside(row, known.get(named_in(row.experiment, row.quantity))) for row in rows)


def _beside(row: Row, prediction: Prediction | None) -> Row:
    """The row with what the audit says of its number."""
    if prediction is None or row.verdict == "not published":
        return row
    printed = row.published.split(" ", maxsplit=1)[0]
    obtained = row.obtained
    nearest = obtained is not None and any(_alike(obtained, value, printed) for value in prediction.nearest)
    verdict: Verdict = "differs as predicted" if row.verdict == "differs" and nearest else row.verdict
    note = "; ".join(text for text in (row.note, prediction.note) if text)
    return replace(row, verdict=verdict, note=note, audit=prediction.verdict)


def _alike(one: float, other: float, printed: str) -> bool:
    """Do both print alike, with the digits of `printed`?"""
    digits = len(printed.partition(".")[2])
    return abs(one - other) < 1e-9 or f"{one:.{digits}f}" == f"{other:.{digits}f}"


def rounds_to(value: float, printed: str) -> bool:
    """Does `value` round to `printed`, a tie either way?

    >>> rounds_to(55.714, "55.7"), rounds_to(55.65, "55.7"), rounds_to(55.64, "55.7")
    (True, True, False)
    """
    half_a_digit = Decimal(5).scaleb(int(Decimal(printed).as_tuple().exponent) - 1)
    return abs(Decimal(repr(value)) - Decimal(printed)) <= half_a_digit + Decimal("1e-12")


def _found(statistics: Statistics | None, *keys: str | int) -> Any:
    """What stands under `keys`, None where the way ends."""
    here: Any = statistics
    for key in keys:
        try:
            here = here[key]
        except (KeyError, IndexError, TypeError):
            return None
    return here


def _number(experiment: str, quantity: str, printed: str, obtained: float | None, unit: str = "") -> Row:
    verdict: Verdict = "not obtained"
    if obtained is not None:
        verdict = "agrees" if rounds_to(obtained, printed) else "differs"
    published = f"{printed} {unit}".strip()
    return Row(
        experiment=experiment, quantity=quantity, published=published, obtained=_float(obtained), verdict=verdict
    )


def _claim(
    experiment: str, quantity: str, published: str, obtained: float | None, *, truth: bool, note: str = ""
) -> Row:
    verdict: Verdict = "not obtained" if obtained is None else "agrees" if truth else "differs"
    return Row(
        experiment=experiment,
        quantity=quantity,
        published=published,
        obtained=_float(obtained),
        verdict=verdict,
        note=note,
    )


def _unpublished(experiment: str, quantity: str, obtained: float | None, note: str) -> Row:
    return Row(
        experiment=experiment,
        quantity=quantity,
        published="",
        obtained=_float(obtained),
        verdict="not published",
        note=note,
    )


def _float(value: float | None) -> float | None:
    return None if value is None else float(value)


def _common(name: str, published: PublishedExperiment, statistics: Statistics | None) -> Iterator[Row]:
    yield _number(name, PARTICIPANTS, str(published.n), _found(statistics, "n"))
    for i, (df, kind) in enumerate(zip(published.anova.df, ("effect", "error"), strict=True)):
        yield _number(name, anova_df(kind), str(df), _found(statistics, "anova", "df", i))
    yield _number(name, ANOVA_F, published.anova.F, _found(statistics, "anova", "F"))
    p = _found(statistics, "anova", "p")
    bound = published.anova.p_below
    yield _claim(name, ANOVA_P, f"< {bound}", p, truth=p is not None and p < float(bound))
    for claim in published.tukey:
        yield _tukey(name, claim, statistics)


def _tukey(name: str, claim: TukeyClaim, statistics: Statistics | None) -> Row:
    quantity = tukey_p(claim)
    pair = {claim.higher, claim.lower}
    comparisons = _found(statistics, "tukey") or []
    found = next((c for c in comparisons if {c["a"], c["b"]} == pair), None)
    p = _found(found, "p")
    if found is None or p is None:
        return _claim(name, quantity, f"< {claim.p_below}", None, truth=False)
    above = found["difference"] > 0 if found["a"] == claim.higher else found["difference"] < 0
    note = "" if above else f"{claim.higher} is not above {claim.lower}"
    return _claim(name, quantity, f"< {claim.p_below}", p, truth=above and p < float(claim.p_below), note=note)


def _direction(published: PublishedDirection, statistics: Statistics | None) -> Iterator[Row]:
    name = "direction"
    for method, printed in published.means.items():
        mean = _found(statistics, "means", method)
        percent = None if mean is None else 100.0 * mean
        yield _number(name, mean_rate(method), printed, percent, "%")
    for claim in published.binomial:
        p = _found(statistics, "binomial", claim.method, claim.direction, "p")
        yield _number(name, binomial_p(claim), claim.p, p)
    for method in published.methods:
        sd = _found(statistics, "sds", method)
        yield _unpublished(name, f"SD of the correct rate, {method} (%)", _percent(sd), "drawn in Fig. 8 (a) only")
    for method in published.methods:
        mean = _found(statistics, "backward", "means", method)
        note = "not printed; its binomial p is" if method == "vibration" else "not printed"
        yield _unpublished(name, f"mean correct rate backward, {method} (%)", _percent(mean), note)


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _preference(published: PublishedPreference, statistics: Statistics | None) -> Iterator[Row]:
    name = "preference"
    ratings: Mapping[str, Mapping[str, float]] | None = _found(statistics, "participants")
    lowest, same = published.lowest, published.same_score
    yield _number(
        name,
        rated_lowest(lowest),
        str(lowest.participants),
        None if ratings is None else sum(_is_lowest(row, lowest.method) for row in ratings.values()),
    )
    yield _number(
        name,
        one_score(same),
        str(same.participants),
        None if ratings is None else sum(_is_same(row, same.methods) for row in ratings.values()),
    )
    for kind, key in (("mean", "means"), ("SD", "sds")):
        for method in published.methods:
            obtained = _found(statistics, key, method)
            yield _unpublished(name, f"{kind} rating, {method}", obtained, "drawn in Fig. 8 (b) only")


def _is_lowest(row: Mapping[str, float], method: str) -> bool:
    """Strictly below every other method."""
    return method in row and all(row[method] < score for other, score in row.items() if other != method)


def _is_same(row: Mapping[str, float], methods: list[str]) -> bool:
    return all(method in row for method in methods) and row[methods[0]] == row[methods[1]]
