"""What stands around the core tests of an experiment, as sections of a report: corrections, sizes, other tests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from analysis.report import apa
from analysis.report.figures.style import display_name, named
from analysis.report.section import Section, Table

Statistics = Mapping[str, Any]

TITLES = {
    "direction": "Direction recognition: further statistics",
    "preference": "Preference: further statistics",
}
_LARGE = 1000.0


def supplement_sections(statistics: Statistics) -> tuple[Section, ...]:
    """A section for each experiment that was tested."""
    tested = [name for name in TITLES if statistics.get(name, {}).get("anova") is not None]
    return tuple(_section(TITLES[name], statistics[name]) for name in tested)


def _section(title: str, found: Statistics) -> Section:
    binary = "model" in found
    tables = [_pairs(found), *([_model_table(found), _clustering_table(found)] if binary else []), _ends(found)]
    return Section(
        title=title,
        paragraphs=(
            _corrected(found),
            _sizes(found["effect_size"]),
            _friedman(found["friedman"]),
            _pairs_words(found),
            *((_model_words(found["model"]), named(found["clustering_note"])) if binary else ()),
            _residuals(found["diagnostics"]["normality"]),
        ),
        tables=tuple(table for table in tables if table.rows),
        items=tuple(_assumption(entry) for entry in found["assumptions"]),
    )


def _corrected(found: Statistics) -> str:
    """The F test with Mauchly's test and both corrections.

    >>> _corrected({"anova": {"F": 9.0}, "sphericity": {"p": None, "greenhouse_geisser": None, "huynh_feldt": None,
    ...     "reason": "There is no error variance."}})
    'Sphericity: There is no error variance.'
    """
    sphericity = found["sphericity"]
    parts = [_mauchly(sphericity)] if sphericity["p"] is not None else []
    for name, key in (("Greenhouse-Geisser", "greenhouse_geisser"), ("Huynh-Feldt", "huynh_feldt")):
        if sphericity[key] is not None:
            test = _f(found["anova"]["F"], sphericity[key])
            parts.append(f"{name} corrected (ε = {apa.below_one(sphericity[key]['epsilon'])}): {test}")
    told = "; ".join(parts)
    return f"Sphericity: {' '.join(filter(None, [told and told + '.', sphericity['reason']]))}"


def _mauchly(sphericity: Statistics) -> str:
    W, chi2 = apa.below_one(sphericity["W"]), apa.number(sphericity["chi2"])
    return f"Mauchly's W = {W}, χ²({sphericity['df']}) = {chi2}, {apa.p_value(sphericity['p'])}"


def _f(F: float | None, corrected: Statistics) -> str:
    return apa.f_test({"F": F, "df": [apa.number(df) for df in corrected["df"]], "p": corrected["p"]})


def _sizes(effect: Statistics) -> str:
    partial = f"Partial η² = {apa.below_one(effect['partial_eta_squared'])}"
    for level in (90, 95):
        if effect[f"ci_{level}"] is not None:
            partial += f", {level} % CI {apa.interval(*effect[f'ci_{level}'])}"
    told = f"{partial}; generalised η² = {apa.below_one(effect['generalized_eta_squared'])}."
    return " ".join(filter(None, [told, effect["reason"] or effect["note"]]))


def _friedman(test: Statistics) -> str:
    if test["reason"]:
        return f"Friedman test: {test['reason']}"
    told = f"χ²({test['df']}) = {apa.number(test['chi2'])}, {apa.p_value(test['p'])}"
    return f"Friedman test: {told}, Kendall's W = {apa.below_one(test['kendall_w'])}. {test['post_hoc']['name']}"


def _residuals(test: Statistics) -> str:
    if test["reason"]:
        return f"Residuals: {test['reason']}"
    shape = f"skewness {apa.number(test['skewness'])}, excess kurtosis {apa.number(test['excess_kurtosis'])}"
    return f"Residuals: W = {apa.below_one(test['W'])}, {apa.p_value(test['p'])}, {shape}. {test['note']}"


def _pairs_words(found: Statistics) -> str:
    factors = found["bayes_factors"]
    return (
        "The pairs in several ways. Tukey with the pooled error is the test of the main text. Tukey with a pair's own "
        f"error: {found['tukey_paired_note']} t: paired t-tests with Holm's correction, a check on both. "
        f"{factors['note']} Here r = {apa.number(factors['r'], 3)}."
    )


def _pairs(found: Statistics) -> Table:
    columns = (
        (pooled, own, t, ranks, factor)
        for pooled, own, t, ranks, factor in zip(
            found["tukey"],
            found["tukey_paired"],
            found["paired_t"],
            found["friedman"]["post_hoc"]["pairs"],
            found["bayes_factors"]["pairs"],
            strict=True,
        )
    )
    return Table(
        caption="p-values of the pairs by four tests, effect size and Bayes factor",
        header=("Pair", "Tukey, pooled error", "Tukey, own error", "t, Holm", "Signed ranks, Holm", "d_z", "BF10"),
        rows=tuple(
            (
                _pair(pooled),
                apa.p_cell(pooled["p"]),
                apa.p_cell(own["p"]),
                apa.p_cell(t["p_holm"]),
                apa.p_cell(ranks["p_holm"]),
                apa.number(t["d_z"]),
                bayes_cell(factor["bf10"]),
            )
            for pooled, own, t, ranks, factor in columns
        ),
    )


def bayes_cell(factor: float | None) -> str:
    """A Bayes factor for a table.

    >>> bayes_cell(12.8037), bayes_cell(4030.7), bayes_cell(0.0004), bayes_cell(None)
    ('12.80', '> 1000', '< 0.001', '–')
    """
    if factor is None:
        return apa.NONE
    if factor > _LARGE:
        return f"> {_LARGE:.0f}"
    return f"< {1.0 / _LARGE:g}" if factor < 1.0 / _LARGE else apa.number(factor, 2 if factor >= 0.1 else 3)


def _pair(comparison: Statistics) -> str:
    return f"{display_name(comparison['a'])} − {display_name(comparison['b'])}"


def _model_words(model: Statistics) -> str:
    if model["reason"]:
        return f"No logistic model of the forward answers. {named(model['reason'])}"
    test = f"Equal odds of all methods: {apa.f_test(model['test'])}. " if model["test"] else ""
    return f"Model of the forward answers: {model['name']}. {test}{model['note']}"


def _model_table(found: Statistics) -> Table:
    return Table(
        caption="Odds ratios of a right forward answer, logistic model; 95 % interval of each pair for itself",
        header=("Pair", "Odds ratio", "95 % CI", "t", "df", "p, Holm"),
        rows=tuple(
            (
                _pair(contrast),
                apa.number(contrast["odds_ratio"]),
                apa.interval(contrast["ci_low"], contrast["ci_high"]),
                apa.number(contrast["t"]),
                str(contrast["df"]),
                apa.p_cell(contrast["p_holm"]),
            )
            for contrast in found["model"]["contrasts"]
        ),
    )


def _clustering_table(found: Statistics) -> Table:
    return Table(
        caption="Binomial tests against 50 % and what the clustering of the answers in people leaves of them",
        header=("Method", "Direction", "Intraclass correlation", "Design effect", "p pooled", "p adjusted"),
        rows=tuple(
            (
                display_name(method),
                direction,
                apa.number(test["clustering"]["icc"]),
                apa.number(test["clustering"]["design_effect"]),
                apa.p_cell(test["p"]),
                apa.p_cell(test["clustering"]["p_adjusted"]),
            )
            for method, tests in found["binomial"].items()
            for direction, test in tests.items()
        ),
    )


def _ends(found: Statistics) -> Table:
    diagnostics = found["diagnostics"]
    return Table(
        caption=f"Scores at the ends of the scale, and outliers. {diagnostics['outliers']['rule']}",
        header=("Method", "At the floor", "At the ceiling", "Outliers"),
        rows=tuple(
            (
                display_name(method),
                str(diagnostics["floor"][method]),
                str(diagnostics["ceiling"][method]),
                _some(o["participant"] for o in diagnostics["outliers"]["found"] if o["method"] == method),
            )
            for method in found["methods"]
        ),
    )


def _some(codes: Iterable[str], shown: int = 10) -> str:
    """The first few codes, and how many more there are."""
    people = list(codes)
    more = f" and {len(people) - shown:,} more" if len(people) > shown else ""
    return ", ".join(people[:shown]) + more if people else "none"


def _assumption(entry: Statistics) -> str:
    warning = f" Warning: {named(entry['warning'])}." if entry["warning"] else ""
    return f"Assumed: {entry['assumption']}{warning}"
