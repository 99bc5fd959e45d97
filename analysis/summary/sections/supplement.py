"""What stands around the core tests of an experiment, as sections of a report: corrections, sizes, other tests."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from analysis.report import apa
from analysis.report.figures.style import display_name, named
from analysis.report.section import Section, Table
from analysis.stats.diagnostics import Sphericity
from analysis.stats.logit_model import Contrast
from analysis.summary.results import (
    Assumption,
    Diagnostics,
    DirectionStatistics,
    FriedmanTest,
    NamedModel,
    NotedEffectSize,
    NotedNormality,
    Pair,
    StudyStatistics,
    Supplement,
    WithinStatistics,
)

TITLES = {
    "direction": "Direction recognition: further statistics",
    "preference": "Preference: further statistics",
}
_LARGE = 1000.0


def supplement_sections(statistics: StudyStatistics) -> Iterator[Section]:
    """A section for each experiment that was tested."""
    for name, title in TITLES.items():
        found = statistics.of(name)
        if found is not None and found.supplement is not None and found.anova is not None:
            yield _section(title, found, found.supplement, found.anova.F)


def _section(title: str, found: WithinStatistics, beside: Supplement, F: float) -> Section:
    answers = found if isinstance(found, DirectionStatistics) else None
    tables = [_pairs(found, beside), *((_model_table(answers), _clustering_table(answers)) if answers else ())]
    tables.append(_ends(found, beside.diagnostics))
    return Section(
        title=title,
        paragraphs=(
            _corrected(F, beside.sphericity),
            _sizes(beside.effect_size),
            _friedman(beside.friedman),
            _pairs_words(beside),
            *((_model_words(answers.model), named(answers.clustering_note)) if answers else ()),
            _residuals(beside.diagnostics.normality),
        ),
        tables=tuple(table for table in tables if table.rows),
        items=tuple(_assumption(entry) for entry in found.assumptions),
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


def _sizes(effect: NotedEffectSize) -> str:
    size = effect.size
    partial = f"Partial η² = {apa.below_one(size.partial_eta_squared)}"
    for level, ends in ((90, size.ci_90), (95, size.ci_95)):
        if ends is not None:
            partial += f", {level} % CI {apa.interval(*ends)}"
    told = f"{partial}; generalised η² = {apa.below_one(size.generalized_eta_squared)}."
    return f"{told} {size.reason or effect.note}"


def _friedman(test: FriedmanTest) -> str:
    if test.reason:
        return f"Friedman test: {test.reason}"
    told = f"χ²({test.df}) = {apa.number(test.chi2)}, {apa.p_value(test.p)}"
    return f"Friedman test: {told}, Kendall's W = {apa.below_one(test.kendall_w)}. {test.post_hoc.name}"


def _residuals(noted: NotedNormality) -> str:
    test = noted.test
    if test.reason:
        return f"Residuals: {test.reason}"
    shape = f"skewness {apa.number(test.skewness)}, excess kurtosis {apa.number(test.excess_kurtosis)}"
    return f"Residuals: W = {apa.below_one(test.W)}, {apa.p_value(test.p)}, {shape}. {noted.note}"


def _pairs_words(found: Supplement) -> str:
    factors = found.bayes_factors
    return (
        "The pairs in several ways. Tukey with the pooled error is the test of the main text. Tukey with a pair's own "
        f"error: {found.tukey_paired_note} t: paired t-tests with Holm's correction, a check on both. "
        f"{factors.note} Here r = {apa.number(factors.r, 3)}."
    )


def _pairs(found: WithinStatistics, beside: Supplement) -> Table:
    ranks, factors = beside.friedman.post_hoc.pairs, beside.bayes_factors.pairs
    pairs = zip(found.tukey or (), beside.tukey_paired, beside.paired_t, ranks, factors, strict=True)
    return Table(
        caption="p-values of the pairs by four tests, effect size and Bayes factor",
        header=("Pair", "Tukey, pooled error", "Tukey, own error", "t, Holm", "Signed ranks, Holm", "d_z", "BF10"),
        rows=tuple(
            (
                _pair(pooled),
                apa.p_cell(pooled.p),
                apa.p_cell(own.p),
                apa.p_cell(t.p_holm),
                apa.p_cell(rank.p_holm),
                apa.number(t.d_z),
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
    test = f"Equal odds of all methods: {apa.f_test(equal.F, equal.df, equal.p)}. " if equal else ""
    return f"Model of the forward answers: {model.name}. {test}{model.note}"


def _model_table(found: DirectionStatistics) -> Table:
    return Table(
        caption="Odds ratios of a right forward answer, logistic model; 95 % interval of each pair for itself",
        header=("Pair", "Odds ratio", "95 % CI", "t", "df", "p, Holm"),
        rows=tuple(
            (
                _pair(contrast),
                apa.number(contrast.odds_ratio),
                apa.interval(contrast.ci_low, contrast.ci_high),
                apa.number(contrast.t),
                str(contrast.df),
                apa.p_cell(contrast.p_holm),
            )
            for contrast in found.model.fit.contrasts
        ),
    )


def _clustering_table(found: DirectionStatistics) -> Table:
    return Table(
        caption="Binomial tests against 50 % and what the clustering of the answers in people leaves of them",
        header=("Method", "Direction", "Intraclass correlation", "Design effect", "p pooled", "p adjusted"),
        rows=tuple(
            (
                display_name(method),
                direction,
                apa.number(test.clustering.icc),
                apa.number(test.clustering.design_effect),
                apa.p_cell(test.p),
                apa.p_cell(test.clustering.p_adjusted),
            )
            for method, tests in found.binomial.items()
            for direction, test in tests.items()
        ),
    )


def _ends(found: WithinStatistics, diagnostics: Diagnostics) -> Table:
    return Table(
        caption=f"Scores at the ends of the scale, and outliers. {diagnostics.outliers.rule}",
        header=("Method", "At the floor", "At the ceiling", "Outliers"),
        rows=tuple(
            (
                display_name(method),
                str(diagnostics.floor[method]),
                str(diagnostics.ceiling[method]),
                _some(o.participant for o in diagnostics.outliers.found if o.method == method),
            )
            for method in found.methods
        ),
    )


def _some(codes: Iterable[str], shown: int = 10) -> str:
    """The first few codes, and how many more there are."""
    people = list(codes)
    more = f" and {len(people) - shown:,} more" if len(people) > shown else ""
    return ", ".join(people[:shown]) + more if people else "none"


def _assumption(entry: Assumption) -> str:
    warning = f" Warning: {named(entry.warning)}." if entry.warning else ""
    return f"Assumed: {entry.assumption}{warning}"
