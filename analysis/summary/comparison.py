"""The published numbers beside the obtained ones, row by row."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from analysis.paper import paper as publication
from analysis.report.apa import known
from analysis.summary.results import DirectionStatistics, Pair, StudyStatistics, WithinStatistics


def compare(
    statistics: StudyStatistics, paper: publication.Paper, predicted: Mapping[str, publication.Prediction] | None = None
) -> tuple[publication.ComparisonRow, ...]:
    """Every published number against the statistics of a study.

    A number agrees if it rounds to the printed digits; a bound or an order, if it is true of the obtained numbers. What
    the paper draws but does not print is listed as not published. `predicted`: by `named_in`, what the audit
    says; a difference to one of the nearest attainable values is the one that it predicts.
    """
    direction, preference = statistics.direction, statistics.preference
    rows = [*_common("direction", paper.direction, direction), *_direction(paper.direction, direction)]
    rows += [*_common("preference", paper.preference, preference), *_preference(paper.preference, preference)]
    audited = predicted or {}
    return tuple(_with_audit(row, audited.get(publication.named_in(row.experiment, row.quantity))) for row in rows)


def _with_audit(row: publication.ComparisonRow, prediction: publication.Prediction | None) -> publication.ComparisonRow:
    """The row with what the audit says of its number."""
    if prediction is None or row.verdict == "not published":
        return row
    printed = row.published.split(" ", maxsplit=1)[0]
    obtained = row.obtained
    nearest = obtained is not None and any(_alike(obtained, value, printed) for value in prediction.nearest)
    verdict: publication.ComparisonVerdict = (
        "differs as predicted" if row.verdict == "differs" and nearest else row.verdict
    )
    note = "; ".join(text for text in (row.note, prediction.note) if text)
    return replace(row, verdict=verdict, note=note, audit=prediction.verdict)


def _alike(one: float, other: float, printed: str) -> bool:
    """Do both print alike, with the digits of `printed`?"""
    digits = len(printed.partition(".")[2])
    return abs(one - other) < 1e-9 or f"{one:.{digits}f}" == f"{other:.{digits}f}"


def _number(
    experiment: str, quantity: str, printed: str, obtained: float | None, unit: str = ""
) -> publication.ComparisonRow:
    verdict: publication.ComparisonVerdict = "not obtained"
    if obtained is not None:
        verdict = "agrees" if publication.rounds_to(obtained, printed) else "differs"
    return _row(experiment, quantity, f"{printed} {unit}".strip(), obtained, verdict=verdict)


def _claim(
    experiment: str, quantity: str, published: str, obtained: float | None, *, truth: bool, note: str = ""
) -> publication.ComparisonRow:
    verdict: publication.ComparisonVerdict = "not obtained" if obtained is None else "agrees" if truth else "differs"
    return _row(experiment, quantity, published, obtained, verdict=verdict, note=note)


def _unpublished(experiment: str, quantity: str, obtained: float | None, note: str) -> publication.ComparisonRow:
    return _row(experiment, quantity, "", obtained, verdict="not published", note=note)


def _row(
    experiment: str,
    quantity: str,
    published: str,
    obtained: float | None,
    *,
    verdict: publication.ComparisonVerdict,
    note: str = "",
) -> publication.ComparisonRow:
    return publication.ComparisonRow(
        experiment=experiment,
        quantity=quantity,
        published=published,
        obtained=None if obtained is None else float(obtained),
        verdict=verdict,
        note=note,
    )


def _common(
    name: str, published: publication.PublishedExperiment, found: WithinStatistics | None
) -> Iterator[publication.ComparisonRow]:
    anova = found.anova if found is not None else None
    yield _number(name, publication.PARTICIPANTS, str(published.n), found.n if found is not None else None)
    for i, (df, kind) in enumerate(zip(published.anova.df, ("effect", "error"), strict=True)):
        yield _number(name, publication.anova_df(kind), str(df), anova.df[i] if anova is not None else None)
    yield _number(name, publication.ANOVA_F, published.anova.F, known(anova.F if anova is not None else None))
    p, bound = known(anova.p if anova is not None else None), published.anova.p_below
    yield _claim(name, publication.ANOVA_P, f"< {bound}", p, truth=p is not None and p < float(bound))
    for claim in published.tukey:
        yield _tukey(name, claim, (found.tukey if found is not None else None) or ())


def _tukey(name: str, claim: publication.PublishedTukeyTest, pairs: Sequence[Pair]) -> publication.ComparisonRow:
    quantity, published = publication.tukey_p(claim), f"< {claim.p_below}"
    found = next((pair for pair in pairs if {pair.a, pair.b} == {claim.higher, claim.lower}), None)
    if found is None or math.isnan(found.p):
        return _claim(name, quantity, published, None, truth=False)
    above = found.difference > 0 if found.a == claim.higher else found.difference < 0
    note = "" if above else f"{claim.higher} is not above {claim.lower}"
    return _claim(name, quantity, published, found.p, truth=above and found.p < float(claim.p_below), note=note)


def _direction(
    published: publication.PublishedDirection, found: DirectionStatistics | None
) -> Iterator[publication.ComparisonRow]:
    name = "direction"
    means, sds, backward = (found.means, found.sds, found.backward.means) if found is not None else ({}, {}, {})
    for method, printed in published.means.items():
        yield _number(name, publication.mean_rate(method), printed, _percent(means.get(method)), "%")
    for claim in published.binomial:
        tests = found.binomial.get(claim.method, {}) if found is not None else {}
        test = tests.get(claim.direction)
        yield _number(name, publication.one_half_p(claim), claim.p, test.p if test is not None else None)
    for method in published.methods:
        sd = _percent(sds.get(method))
        yield _unpublished(name, f"SD of the correct rate, {method} (%)", sd, "drawn in Fig. 8 (a) only")
    for method in published.methods:
        note = "not printed; its binomial p is" if method == "vibration" else "not printed"
        mean = _percent(backward.get(method))
        yield _unpublished(name, f"mean correct rate backward, {method} (%)", mean, note)


def _percent(share: float | None) -> float | None:
    value = known(share)
    return None if value is None else 100.0 * value


def _preference(
    published: publication.PublishedPreference, found: WithinStatistics | None
) -> Iterator[publication.ComparisonRow]:
    name, lowest, same = "preference", published.lowest, published.same_score
    methods = () if found is None else found.methods
    ratings = () if found is None else found.participants.values()
    yield _number(
        name,
        publication.rated_lowest(lowest),
        str(lowest.participants),
        sum(_is_lowest(row, lowest.method) for row in ratings) if lowest.method in methods else None,
    )
    yield _number(
        name,
        publication.one_score(same),
        str(same.participants),
        sum(_is_same(row, same.methods) for row in ratings) if set(same.methods) <= set(methods) else None,
    )
    means, sds = (found.means, found.sds) if found is not None else ({}, {})
    for kind, values in (("mean", means), ("SD", sds)):
        for method in published.methods:
            obtained = known(values.get(method))
            yield _unpublished(name, f"{kind} rating, {method}", obtained, "drawn in Fig. 8 (b) only")


def _is_lowest(row: Mapping[str, float], method: str) -> bool:
    """Strictly below every other method."""
    return all(row[method] < score for other, score in row.items() if other != method)


def _is_same(row: Mapping[str, float], methods: list[str]) -> bool:
    return row[methods[0]] == row[methods[1]]
