"""The sections of what was requested: for each request what was done, and its table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from analysis.report import apa
from analysis.report.labels import named
from analysis.report.section import Section, Table
from analysis.stats.anova_bayes import AnovaBayesFactor
from analysis.stats.contrasts import PlannedContrast
from analysis.stats.equivalence import Equivalence
from analysis.stats.fixed_effects import Coefficient
from analysis.stats.mixed_model import LinearMixedModel
from analysis.stats.random_intercept import RandomInterceptLogit
from analysis.summary.requests import Requested, RequestKind
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.supplement import bayes_cell
from device.messages import how_many


@dataclass(frozen=True, slots=True, kw_only=True)
class _Printed:
    """How scores, their differences and what a model says of them are printed: so many times what is stored."""

    scale: float
    digits: int
    unit: str

    def number(self, value: float | None) -> str:
        return apa.number(None if value is None else self.scale * value, self.digits)

    def interval(self, one: PlannedContrast | Equivalence | Coefficient) -> str:
        return f"[{self.number(one.ci_low)}, {self.number(one.ci_high)}]"


_AS_STORED = _Printed(scale=1.0, digits=3, unit="")
_IN_POINTS = _Printed(scale=100.0, digits=1, unit=" in percentage points")


def _printed(one: Requested) -> _Printed:
    """Shares are printed as the rest of the report prints them; log odds are none."""
    return _IN_POINTS if one.shares and one.kind != "logistic" else _AS_STORED


def requested_sections(report: ReportData) -> Iterator[Section]:
    """A section a request, in their order."""
    for one in report.statistics.requested or ():
        table = _table(one)
        yield Section(
            title=f"Requested: {_NAMES[one.kind]}, {_data(one)}",
            paragraphs=(named(f"{how_many(one.people, 'participant')}. {one.note} {_told(one)}".strip()),),
            tables=(table,) if table else (),
        )


_NAMES: dict[RequestKind, str] = {
    "contrasts": "planned contrasts",
    "equivalence": "equivalence",
    "bayes-factor": "Bayes factor",
    "mixed-model": "linear mixed model",
    "logistic": "logistic mixed model",
}


def _data(one: Requested) -> str:
    return one.of if one.question is None else f"{one.of}, {one.question}"


def _told(one: Requested) -> str:
    """What is not in a table: a Bayes factor, how people differ, or why there is no result."""
    result, printed = one.result, _printed(one)
    if isinstance(result, tuple):
        return ""
    if result.reason is not None:
        return result.reason
    match result:
        case AnovaBayesFactor():
            factor = bayes_cell(result.bf10)
            return f"BF10 {factor}." if factor[0] in "<>" else f"BF10 = {factor}."
        case LinearMixedModel():
            number, unit = printed.number, printed.unit
            spread = (
                f"SD between people {number(result.person_sd)}, of single trials {number(result.residual_sd)}{unit}"
            )
            return f"{spread}; {how_many(result.trials, 'trial')}."
        case RandomInterceptLogit():
            return f"SD of people's log odds {printed.number(result.person_sd)}; {how_many(result.trials, 'trial')}."
        case Equivalence():
            return _equivalence_words(result, printed)


def _equivalence_words(found: Equivalence, printed: _Printed) -> str:
    """What the two tests say: an absence of proof is no proof of a difference."""
    level = apa.number(100.0 * (1.0 - 2.0 * found.alpha), 0)
    told = f"The mean was {printed.number(found.difference)}, {level} % CI {printed.interval(found)}{printed.unit}"
    p = apa.p_value(found.p)
    if found.p is not None and found.p < found.alpha:
        return f"{told}, which lies within the bounds: equivalence was shown, {p}."
    if (side := _outside(found)) is not None:
        told += f", which lies wholly {side} the bounds"
        return f"{told}: equivalence was not shown, {p}; the mean lies outside them."
    return (
        f"{told}, which reaches beyond the bounds: equivalence was not shown, {p}, which is no proof of a difference."
    )


def _outside(found: Equivalence) -> str | None:
    """On which side of the bounds the whole interval lies; `None` if some of it lies within."""
    if found.ci_low is None or found.ci_high is None:
        return None
    return "above" if found.ci_low >= found.high else "below" if found.ci_high <= found.low else None


def _table(one: Requested) -> Table | None:
    printed = _printed(one)
    of = f"{_data(one)}{printed.unit}"
    match one.result:
        case tuple():
            return _contrasts(f"Planned contrasts of {of}", one.result, printed)
        case Equivalence(reason=None):
            return _equivalence(f"Two one-sided tests of {of}; p is the larger of both", one.result, printed)
        case LinearMixedModel(reason=None):
            return _coefficients(f"Fixed effects on {of}", one.result.coefficients, printed)
        case RandomInterceptLogit(reason=None, coefficients=found):
            return _with_odds(_coefficients(f"Fixed effects on the log odds of {of}", found, printed), found)
    return None


def _contrasts(caption: str, found: Sequence[PlannedContrast], printed: _Printed) -> Table:
    return Table(
        caption=caption,
        header=("Contrast", "Estimate", "95 % CI", "t", "df", "p", "p corrected", "d_z"),
        rows=tuple(
            (
                one.name if one.reason is None else f"{one.name}. {one.reason}",
                printed.number(one.estimate),
                printed.interval(one),
                apa.number(one.t),
                str(one.df),
                apa.p_cell(one.p),
                apa.p_cell(one.p_adjusted),
                apa.number(one.d_z),
            )
            for one in found
        ),
    )


def _equivalence(caption: str, found: Equivalence, printed: _Printed) -> Table:
    level = apa.number(100.0 * (1.0 - 2.0 * found.alpha), 0)
    return Table(
        caption=caption,
        header=("Difference", "Bounds", f"{level} % CI", "t, low", "t, high", "df", "p"),
        rows=(
            (
                printed.number(found.difference),
                f"[{printed.number(found.low)}, {printed.number(found.high)}]",
                printed.interval(found),
                apa.number(found.t_low),
                apa.number(found.t_high),
                f"{found.df:g}",
                apa.p_cell(found.p),
            ),
        ),
    )


def _coefficients(caption: str, found: Sequence[Coefficient], printed: _Printed) -> Table:
    return Table(
        caption=caption,
        header=("Coefficient", "Estimate", "95 % CI", "SE", "z", "p"),
        rows=tuple(
            (
                named(one.name),
                printed.number(one.estimate),
                printed.interval(one),
                printed.number(one.se),
                apa.number(one.z),
                apa.p_cell(one.p),
            )
            for one in found
        ),
    )


def _with_odds(table: Table, found: Sequence[Coefficient]) -> Table:
    """With the odds, which a coefficient multiplies; the intercept's are those of the references themselves."""
    odds = tuple(apa.odds_cell(math.exp(min(one.estimate, 700.0))) for one in found)
    rows = tuple((*row, cell) for row, cell in zip(table.rows, odds, strict=True))
    return replace(table, header=(*table.header, "Odds ratio"), rows=rows)
