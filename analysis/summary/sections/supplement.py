"""What stands around the core tests of an experiment, as sections of a report: corrections, sizes, other tests."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.report import apa
from analysis.report.labels import display_name, named
from analysis.report.section import Section, Table
from analysis.stats.diagnostics import Sphericity
from analysis.stats.logit_model import Contrast
from analysis.summary.results import (
    Assumption,
    DirectionStatistics,
    FriedmanTest,
    NamedModel,
    NotedEffectSize,
    NotedNormality,
    Pair,
    Supplement,
    WithinStatistics,
)
from analysis.summary.sections.content import ReportData

TITLES = {
    "direction": "Direction recognition: further statistics",
    "preference": "Preference: further statistics",
}
_LARGE = 1000.0


def supplement_sections(report: ReportData) -> Iterator[Section]:
    """A section for each experiment that was tested; the first says how to read them."""
    found = {name: one for name in TITLES if (one := report.statistics.of(name)) is not None and one.supplement}
    for place, (name, one) in enumerate(found.items()):
        if one.supplement is not None and one.anova is not None:
            yield _section(TITLES[name], one, one.supplement, one.anova.F, noted=not place, planned=report.planned)


def _section(
    title: str, found: WithinStatistics, beside: Supplement, F: float, *, noted: bool, planned: bool
) -> Section:
    answers = found if isinstance(found, DirectionStatistics) else None
    tables = [
        _pairs(found, beside, planned=planned),
        *((_model_table(answers), _clustering_table(answers)) if answers else ()),
    ]
    return Section(
        title=title,
        paragraphs=(
            _corrected(F, beside.sphericity),
            _sizes(beside.effect_size, noted=noted),
            _friedman(beside.friedman, noted=noted),
            *((_pairs_words(found.tukey_error_term, beside, planned=planned),) if noted else ()),
            *((_model_words(answers.model), named(answers.clustering_note)) if answers else ()),
            _residuals(beside.diagnostics.normality, noted=noted),
            *(_assumed(found.assumptions) if noted else ("How to read them, and what they assume: as above.",)),
        ),
        tables=tuple(table for table in tables if table.rows),
    )


def _corrected(F: float, sphericity: Sphericity) -> str:
    """The F test with Mauchly's test and both corrections.

    >>> _corrected(9.0, Sphericity(reason="There is no error variance."))
    'Sphericity: There is no error variance.'
    """
    parts = [_mauchly(sphericity)] if sphericity.p is not None else []
    corrections = {"Greenhouse-Geisser": sphericity.greenhouse_geisser, "Huynh-Feldt": sphericity.huynh_feldt}
    for name, one in corrections.items():
        if one is not None:
            parts.append(f"{name} corrected (ε = {apa.below_one(one.epsilon)}): {apa.f_test(F, one.df, one.p)}")
    told = "; ".join(parts)
    return f"Sphericity: {' '.join(filter(None, [told and told + '.', sphericity.reason]))}"


def _mauchly(sphericity: Sphericity) -> str:
    W, chi2 = apa.below_one(sphericity.W), apa.number(sphericity.chi2)
    return f"Mauchly's W = {W}, χ²({sphericity.df}) = {chi2}, {apa.p_value(sphericity.p)}"


def _sizes(effect: NotedEffectSize, *, noted: bool) -> str:
    size = effect.size
    partial = f"Partial η² = {apa.below_one(size.partial_eta_squared)}"
    for level, ends in ((90, size.ci_90), (95, size.ci_95)):
        if ends is not None:
            partial += f", {level} % CI {apa.interval(*ends)}"
    told = f"{partial}; generalised η² = {apa.below_one(size.generalized_eta_squared)}."
    return f"{told} {size.reason or (effect.note if noted else '')}".rstrip()


def _friedman(test: FriedmanTest, *, noted: bool) -> str:
    if test.reason:
        return f"Friedman test: {test.reason}"
    told = f"χ²({test.df}) = {apa.number(test.chi2)}, {apa.p_value(test.p)}"
    note = f" {test.post_hoc.name}" if noted else ""
    return f"Friedman test: {told}, Kendall's W = {apa.below_one(test.kendall_w)}.{note}"


def _residuals(found: NotedNormality, *, noted: bool) -> str:
    test = found.test
    if test.reason:
        return f"Residuals: {test.reason}"
    shape = f"skewness {apa.number(test.skewness)}, excess kurtosis {apa.number(test.excess_kurtosis)}"
    return f"Residuals: W = {apa.below_one(test.W)}, {apa.p_value(test.p)}, {shape}.{f' {found.note}' if noted else ''}"


_PLANNED = (
    "The pairs in several ways. Planned, that is fixed by the analysis before it sees any data, is the first alone; "
    "the others are checks on it. Whoever registered another test reports that."
)


def _pairs_words(error_term: str, found: Supplement, *, planned: bool) -> str:
    factors = found.bayes_factors
    opening = f"{_PLANNED} Planned: {error_term}" if planned else f"The pairs in several ways. {error_term}"
    return (
        f"{opening} Tukey with a pair's own error: {found.tukey_paired_note} t: paired t-tests "
        f"with Holm's correction. {factors.note} Here r = {apa.number(factors.r, 3)}."
    )


def _pairs(found: WithinStatistics, beside: Supplement, *, planned: bool) -> Table:
    ranks, factors = beside.friedman.post_hoc.pairs, beside.bayes_factors.pairs
    pairs = zip(found.tukey or (), beside.tukey_paired, beside.paired_t, ranks, factors, strict=True)
    tests = "the planned test and by three others" if planned else "four tests"
    return Table(
        caption=f"p-values of the pairs by {tests}, and the Bayes factor",
        header=(
            *(
                "Pair",
                f"{'Planned: ' if planned else ''}Tukey, pooled error",
                "Tukey, own error",
                "t, Holm",
                "Signed ranks, Holm",
            ),
            "BF10",
        ),
        rows=tuple(
            (
                _pair(pooled),
                apa.p_cell(pooled.p),
                apa.p_cell(own.p),
                apa.p_cell(t.p_holm),
                apa.p_cell(rank.p_holm),
                bayes_cell(factor.bf10),
            )
            for pooled, own, t, rank, factor in pairs
        ),
    )


def bayes_cell(factor: float | None) -> str:
    """A Bayes factor for a table.

    >>> bayes_cell(12.8037), bayes_cell(4030.7), bayes_cell(0.0004), bayes_cell(None)
    ('12.80', '> 1000', '< 0.001', '–')
    """
    if factor is None:
        return apa.NO_NUMBER
    if factor > _LARGE:
        return f"> {_LARGE:.0f}"
    return f"< {1.0 / _LARGE:g}" if factor < 1.0 / _LARGE else apa.number(factor, 2 if factor >= 0.1 else 3)


def _pair(pair: Pair | Contrast) -> str:
    return f"{display_name(str(pair.a))} − {display_name(str(pair.b))}"


def _model_words(model: NamedModel) -> str:
    equal = model.fit.test
    if model.fit.reason:
        return f"No logistic model of the forward answers. {named(model.fit.reason)}"
    test = (
        f"Equal odds of all methods: {apa.f_test(equal.F, equal.df, equal.p)}. "
        if equal
        else "No joint test of equal odds: it takes as many people as methods. "
    )
    return f"Model of the forward answers: {model.name}. {test}{model.note}"


def _model_table(found: DirectionStatistics) -> Table:
    return Table(
        caption="Odds ratios of a right forward answer, logistic model; 95 % interval of each pair for itself",
        header=("Pair", "Odds ratio", "95 % CI", "t", "df", "p, Holm"),
        rows=tuple(
            (
                _pair(contrast),
                apa.odds_cell(contrast.odds_ratio),
                f"[{apa.odds_cell(contrast.ci_low)}, {apa.odds_cell(contrast.ci_high)}]",
                apa.number(contrast.t),
                str(contrast.df),
                apa.p_cell(contrast.p_holm),
            )
            for contrast in found.model.fit.contrasts
        ),
    )


def _clustering_table(found: DirectionStatistics) -> Table:
    return Table(
        caption="How the answers cluster in people",
        header=("Method", "Direction", "Intraclass correlation", "Design effect"),
        rows=tuple(
            (
                display_name(method),
                direction,
                apa.number(test.clustering.icc),
                apa.number(test.clustering.design_effect),
            )
            for method, tests in found.binomial.items()
            for direction, test in tests.items()
        ),
    )


def _assumed(assumptions: tuple[Assumption, ...]) -> tuple[str, ...]:
    """What was taken for granted; where it does not hold, the quality of the data says so."""
    return (f"Assumed: {' '.join(entry.assumption for entry in assumptions)}",) if assumptions else ()
