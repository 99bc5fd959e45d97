"""Log tables into the statistics of the paper and what stands around them, as typed results. Nothing is rounded here.

The supplement cannot fail on data that the core takes: what is undefined is None, and a `reason` beside it says why.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np
import pandas as pd

from analysis.logs.exclusion_rules import anticipations
from analysis.logs.exclusions import IN_NO_TEST, LeftOut, complete_rows, shared_methods
from analysis.logs.measures import MEASURES
from analysis.logs.names import MethodNames
from analysis.logs.reading import Logs
from analysis.report.serial import undefined
from analysis.report.terminal import Tell, untold
from analysis.stats.anova import Comparison, rm_anova, rm_tukey_hsd, rm_tukey_hsd_paired
from analysis.stats.arrays import FloatArray
from analysis.stats.binomial import binomial_test
from analysis.stats.cells import ByParticipant, TrialCells, coded, trial_cells
from analysis.stats.diagnostics import (
    EFFECT_SIZE_NOTE,
    NORMALITY_NOTE,
    OUTLIER_RULE,
    cousineau_morey,
    effect_size,
    ends,
    normality,
    outliers,
    sphericity,
)
from analysis.stats.discrimination import yes_no
from analysis.stats.logit_model import METHOD as CLUSTERING_NOTE
from analysis.stats.logit_model import MODEL_NAME, MODEL_NOTE, LogitModel, clustering, logit_model
from analysis.stats.paired import (
    CONSTANT,
    EQUAL,
    SCALE,
    PairedT,
    friedman,
    jzs_paired,
    paired_t_tests,
    signed_rank_tests,
)
from analysis.summary import results
from analysis.summary.assumptions import assumptions, not_spherical
from analysis.summary.origins import origin_of
from analysis.times.own_trials import INSTRUCTION, response_times, timed
from analysis.times.speed_accuracy import speed_accuracy
from device.messages import first_few
from device.words import DIRECTIONS

METHOD_ORDER = ("vibration", "asymmetric-1", "asymmetric-2")
TUKEY_ERROR_TERM = (
    "Tukey's HSD with the pooled error term of the repeated-measures ANOVA (MS_error of participant × method), "
    "on its (n − 1)(k − 1) degrees of freedom; it assumes sphericity."
)
BINOMIAL_NOTE = (
    "Trials are pooled over participants. The test takes them as independent and ignores that trials come in people; "
    "if people differ, its p-values are not exact."
)
UNDEFINED = "written as null"
"""What the warning about an undefined number says."""


def summarize(logs: Logs, *, trade: bool = True, fits: bool = False, tell: Tell = untold) -> results.StudyStatistics:
    """The statistics of `logs`: rates 0 to 1, SD with n - 1; `tell` of "statistics" and of "fits".

    `trade`: with the measures of speed and accuracy; `fits`: with diffusion fits among them, and psychometric
    functions of everybody. An experiment without a log is left out. Participants who miss an answer or a method are
    left out of that experiment and listed in `excluded`. Numbers that are NaN or infinite are named in
    `warnings`. What stands apart in the logs is kept apart.
    """
    names = logs.methods
    direction, left_out = _direction(logs.trials, names) if len(logs.trials) else (None, [])
    preference, also_out = _preference(logs.ratings, names) if len(logs.ratings) else (None, [])
    designs: Mapping[str, results.DesignSummary] = {}
    if logs.designs:
        from analysis.summary.designs import summarise_each  # noqa: PLC0415 - slow, and of no use without a design

        designs = summarise_each(logs.designs, fits=fits)
    lacking = (out for name, one in designs.items() for out in _lacking(name, one))
    found = results.StudyStatistics(
        direction=direction,
        preference=preference,
        designs=designs,
        excluded=(*left_out, *also_out, *lacking),
        data_kind=logs.kind,
        labels=_labels((direction, preference), names),
    )
    tell("statistics")
    if trade:
        found = _timed(found, logs, fits=fits)
    tell("fits")
    apart = {part.kind: replace(summarize(part, trade=trade, fits=fits), versions=None) for part in logs.apart}
    said = (*anticipations(logs), *_repeated(logs.ratings), *_warnings(found))
    return replace(found, warnings=said, versions=statistics_versions(), kept_apart=apart or None)


def _repeated(table: pd.DataFrame) -> Iterator[str]:
    """Methods that somebody rated more than once: their mean counts."""
    keys = table[["participant_id", "method"]].astype(str)
    doubled = keys[keys.duplicated()].drop_duplicates().itertuples(index=False)
    shown = [f"{who} {method}" for who, method in doubled]
    if shown:
        yield f"preference: rated more than once, so that the mean counts: {first_few(shown, _NAMED)}"


_NAMED = 20
"""So many people are named in a sentence."""


def _lacking(name: str, design: results.DesignSummary) -> Iterator[LeftOut]:
    """Who is in no test of some questions of a design."""
    lacking: dict[str, dict[str, list[str]]] = {}
    for question, found in design.questions.items():
        for who in found.left_out:
            lacking.setdefault(who, {}).setdefault(found.lacked, []).append(question)
    for who, kinds in lacking.items():
        answers = " and ".join(f"no {answer} to {', '.join(questions)}" for answer, questions in kinds.items())
        yield LeftOut(
            experiment=name,
            participant=who,
            reason=f"{answers} in some condition",
            rule=IN_NO_TEST,
            remedy="none here; means, counts and other questions hold what they answered",
        )


def statistics_versions() -> dict[str, str]:
    """What computed the statistics."""
    return {"python": platform.python_version()} | {
        name: _version(name) for name in ("numpy", "scipy", "pandas", "pingouin", "recoil")
    }


def methods_in(table: pd.DataFrame, names: MethodNames) -> list[str]:
    """The methods that people share in the order that is known of them, then the paper's, then as people count."""
    return names.and_then(MethodNames(order=METHOD_ORDER)).ordered(shared_methods(table))


def _labels(found: Sequence[results.WithinStatistics | None], names: MethodNames) -> dict[str, str] | None:
    """The labels of the methods that were analysed; None if each is called by its code."""
    methods = dict.fromkeys(method for one in found if one is not None for method in one.methods)
    return {method: names.labels[method] for method in methods if names.labels.get(method, method) != method} or None


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _warnings(found: results.StudyStatistics) -> Iterator[str]:
    """Why there is no test, the violated assumptions that change which number to read, and what is written as null."""
    for experiment in MEASURES:
        one = found.of(experiment)
        if one is not None and one.anova is None:
            there = f"complete participants: {one.n}, methods: {len(one.methods)}"
            yield f"{experiment}: no ANOVA and no Tukey test, which need 2 of each; {there}"
        elif one is not None:
            yield from (f"{experiment}: {entry.warning}" for entry in one.assumptions if entry.serious)
    for name, design in found.designs.items():
        yield from not_spherical(name, design)
    for place, value in undefined(found):
        why = "undefined (no variance to divide by, or one value only)"
        if math.isinf(value):
            why = "infinite (an effect without any error variance)"
        yield f"{place} is {why}; {UNDEFINED}"


def _complete(
    table: pd.DataFrame, experiment: str, names: MethodNames
) -> tuple[pd.DataFrame, list[str], list[LeftOut]]:
    """The complete participants' coded rows, with the instructions if there are some; the methods; who is left out."""
    methods, rows = methods_in(table, names), coded(table)
    if INSTRUCTION in table:
        rows[INSTRUCTION] = table[INSTRUCTION]
    complete, left_out = complete_rows(rows, experiment, methods)
    return complete, methods, left_out


def _timed(found: results.StudyStatistics, logs: Logs, *, fits: bool) -> results.StudyStatistics:
    """With the measures of speed and accuracy."""
    direction = found.direction
    if direction is not None:
        complete, methods, _ = _complete(logs.trials, "direction", logs.methods)
        direction = replace(direction, speed_accuracy=speed_accuracy(complete, methods, fits=fits))
    found = replace(found, direction=direction)
    if not logs.designs:
        return found
    from analysis.summary.design_times import timed_designs  # noqa: PLC0415 - slow, and of no use without a design

    return replace(found, designs=timed_designs(found.designs, logs.designs, fits=fits))


def _direction(table: pd.DataFrame, names: MethodNames) -> tuple[results.DirectionStatistics, list[LeftOut]]:
    complete, methods, left_out = _complete(table, "direction", names)
    cells = trial_cells(complete, methods)
    within = _within(cells.rates("forward"), "direction", origin_of(complete, "response_source"))
    found = results.DirectionStatistics(
        **{field.name: getattr(within, field.name) for field in fields(within)},
        backward=_scores(cells.rates("backward")),
        binomial={method: _binomials(cells, method) for method in methods},
        binomial_note=BINOMIAL_NOTE,
        clustering_note=CLUSTERING_NOTE,
        model=model(cells),
        sensitivity={method: _sensitivity(cells, method) for method in methods},
        response_time=_median_times(complete, methods),
        response_times=response_times(complete, methods),
        speed_accuracy=None,
    )
    return replace(found, assumptions=assumptions(found)), left_out


def _preference(table: pd.DataFrame, names: MethodNames) -> tuple[results.WithinStatistics, list[LeftOut]]:
    complete, methods, left_out = _complete(table, "preference", names)
    scores = _table(complete, "rating", methods)
    found = _within(scores, "preference", origin_of(complete, "rating_by"))
    return replace(found, assumptions=assumptions(found)), left_out


def _table(rows: pd.DataFrame, measure: str, methods: Sequence[str]) -> pd.DataFrame:
    """Means of `measure`, participants (in the order of their codes) by methods."""
    if not len(rows):
        return pd.DataFrame(columns=list(methods), dtype="float64")
    cells = rows.groupby(["participant_id", "method"], observed=True)[measure].mean().astype("float64")
    return cells.unstack("method").reindex(columns=list(methods))


def _within(scores: pd.DataFrame, experiment: str, origin: results.Origin) -> results.WithinStatistics:
    """What every experiment has: scores, tests on them, supplement."""
    shown, tested = _scores(scores), min(scores.shape) >= 2
    return results.WithinStatistics(
        n=len(scores),
        methods=shown.participants.names,
        means=shown.means,
        sds=shown.sds,
        participants=shown.participants,
        within_ci=_within_ci(scores, MEASURES[experiment].scale) if tested else None,
        anova=_anova(scores.to_numpy()) if tested else None,
        tukey=_tukey(scores) if tested else None,
        tukey_error_term=TUKEY_ERROR_TERM,
        supplement=within_supplement(scores, MEASURES[experiment].scale),
        origin=origin,
    )


def _scores(scores: pd.DataFrame) -> results.Scores:
    people, methods = map(str, scores.index), map(str, scores.columns)
    return results.Scores(
        means=_by_method(scores.mean()),
        sds=_by_method(scores.std(ddof=1)),
        participants=ByParticipant(tuple(people), tuple(methods), scores.to_numpy(dtype="float64")),
    )


def _by_method(row: pd.Series) -> dict[str, float]:
    return {str(method): float(value) for method, value in row.items()}


def _within_ci(scores: pd.DataFrame, scale: tuple[float, float]) -> dict[str, results.ConfidenceInterval]:
    """Cousineau-Morey intervals of the means, cut at the ends of the scale.

    A mean lies on its scale, so what is cut off never held it: the interval covers it as often as before. What is left
    is as long as other programs have it, on the scale of the differences; an interval on the logit would be neither,
    and has no standard error to start from where everybody is at the ceiling.
    """
    found = cousineau_morey(scores.to_numpy())
    rows = zip(scores.columns, np.clip(found.ci_low, *scale), np.clip(found.ci_high, *scale), strict=True)
    return {
        str(method): results.ConfidenceInterval(ci_low=float(low), ci_high=float(high)) for method, low, high in rows
    }


def _anova(scores: FloatArray) -> results.AnovaTest:
    found = rm_anova(scores)
    return results.AnovaTest(
        F=float(found.F),
        df=(found.df_effect, found.df_error),
        p=float(found.p),
        ss_effect=float(found.ss_effect),
        ss_error=float(found.ss_error),
        ms_error=float(found.ms_error),
        ss_participants=float(found.ss_participants),
    )


def _tukey(scores: pd.DataFrame) -> tuple[results.Pair, ...]:
    return tuple(
        results.Pair(
            a=str(pair.a),
            b=str(pair.b),
            **{name: float(getattr(pair, name)) for name in ("difference", "q", "p", "ci_low", "ci_high")},
        )
        for pair in rm_tukey_hsd(scores.to_numpy(), list(scores.columns))
    )


def _binomials(cells: TrialCells, method: str) -> dict[str, results.PooledBinomial]:
    """The test of each direction that was presented; empty without complete participants."""
    result: dict[str, results.PooledBinomial] = {}
    for place, direction in enumerate(DIRECTIONS):
        column = cells.methods.index(method), place
        each = cells.trials[:, *column]
        successes, trials = int(cells.correct[:, *column].sum()), int(each.sum())
        if trials:
            test = binomial_test(successes, trials)
            result[direction] = results.PooledBinomial(
                successes=successes,
                trials=trials,
                **{field.name: float(getattr(test, field.name)) for field in fields(test)},
                clustering=clustering(cells.correct[:, *column], each),
                fewest_and_most=None if (each == each[0]).all() else (int(each.min()), int(each.max())),
            )
    return result


def _sensitivity(cells: TrialCells, method: str) -> results.Sensitivity | None:
    """D' and criterion of those who were presented with both directions; None where nobody was."""
    column = cells.methods.index(method)
    both = np.flatnonzero(cells.trials[:, column].min(axis=1, initial=np.inf))
    if not both.size:
        return None
    (hits, rejections), (signals, noises) = cells.correct[both, column].T, cells.trials[both, column].T
    found = yes_no(hits, signals, noises - rejections, noises)
    d_prime, criterion = np.atleast_1d(found.d_prime), np.atleast_1d(found.criterion)
    people = tuple(cells.participants[i] for i in both)
    return results.Sensitivity(
        d_prime=_mean_sd(d_prime),
        criterion=_mean_sd(criterion),
        participants=ByParticipant(people, ("d_prime", "criterion"), np.column_stack([d_prime, criterion])),
    )


def _mean_sd(values: FloatArray) -> results.MeanSd:
    return results.MeanSd(mean=float(values.mean()), sd=float(values.std(ddof=1)) if values.size > 1 else math.nan)


def _median_times(trials: pd.DataFrame, methods: list[str]) -> dict[str, results.MedianTime]:
    """Median over the times that are the participant's own, by method."""
    valid = timed(trials).own
    times = {method: trials["response_time_s"][valid & (trials["method"] == method)] for method in methods}
    return {
        method: results.MedianTime(median=float(own.median()) if len(own) else None, n=len(own))
        for method, own in times.items()
    }


SIGNED_RANKS = (
    "Wilcoxon's signed-rank test of each pair, Holm's correction. Chosen over Conover's and Nemenyi's because these "
    "compare mean ranks, which makes a pair's result depend on the other methods (Benavoli, Corani & Mangili 2016)."
)
TUKEY_PAIRED_NOTE = (
    "studentized range with each pair's own standard error and n − 1 degrees of freedom: needs no sphericity."
)
BAYES_NOTE = (
    "BF10 of the paired t-test: a Cauchy prior of scale r on the standardised mean difference against none at all "
    "(Rouder et al. 2009), each pair by itself, not adjusted for their number."
)
BEYOND = "The Bayes factor cannot be computed: it is above 1.8e308, or |t| is above 100."


def within_supplement(scores: pd.DataFrame, scale: tuple[float, float]) -> results.Supplement | None:
    """Further statistics of scores, participants by methods, on a `scale` from lowest to highest.

    None for fewer than two participants or methods, as the ANOVA is.
    """
    if min(scores.shape) < 2:
        return None
    array, methods = scores.to_numpy(dtype="float64"), [str(method) for method in scores.columns]
    pairs = paired_t_tests(array, methods)
    return results.Supplement(
        sphericity=sphericity(array),
        effect_size=results.NotedEffectSize(size=effect_size(rm_anova(array)), note=EFFECT_SIZE_NOTE),
        friedman=_friedman(array, methods),
        paired_t=pairs,
        tukey_paired=tuple(_finite(pair) for pair in rm_tukey_hsd_paired(array, methods)),
        tukey_paired_note=TUKEY_PAIRED_NOTE,
        bayes_factors=results.BayesFactors(
            r=SCALE, note=BAYES_NOTE, pairs=tuple(_bayes_factor(pair, len(array)) for pair in pairs)
        ),
        diagnostics=_diagnostics(scores, scale),
    )


def model(cells: TrialCells) -> results.NamedModel:
    """The logistic model of the forward answers."""
    place, methods = DIRECTIONS.index("forward"), cells.methods
    if min(len(cells.participants), len(methods)) < 2:
        found = LogitModel(reason="A model needs two participants and two methods.")
    else:
        found = logit_model(cells.correct[..., place], cells.trials[..., place], methods)
    return results.NamedModel(name=MODEL_NAME, note=MODEL_NOTE, fit=found)


def _friedman(scores: FloatArray, methods: Sequence[str]) -> results.FriedmanTest:
    found = friedman(scores)
    return results.FriedmanTest(
        chi2=found.chi2,
        df=found.df,
        p=found.p,
        kendall_w=found.kendall_w,
        reason=found.reason,
        mean_ranks=dict(zip(methods, found.mean_ranks, strict=True)),
        post_hoc=results.PostHoc(name=SIGNED_RANKS, pairs=signed_rank_tests(scores, methods)),
    )


def _finite(pair: Comparison) -> results.OwnErrorPair:
    """A Tukey comparison with None for q, p and interval where the differences have no variance."""
    a, b, difference, q = str(pair.a), str(pair.b), float(pair.difference), float(pair.q)
    if not math.isfinite(q):
        return results.OwnErrorPair(a=a, b=b, difference=difference, reason=CONSTANT if difference else EQUAL)
    p, low, high = float(pair.p), float(pair.ci_low), float(pair.ci_high)
    return results.OwnErrorPair(a=a, b=b, difference=difference, q=q, p=p, ci_low=low, ci_high=high)


def _bayes_factor(pair: PairedT, n: int) -> results.BayesFactor:
    factor = None if pair.t is None else jzs_paired(pair.t, n)
    reason = pair.reason if factor is not None or pair.t is None else BEYOND
    return results.BayesFactor(a=str(pair.a), b=str(pair.b), bf10=factor, reason=reason)


def _diagnostics(scores: pd.DataFrame, scale: tuple[float, float]) -> results.Diagnostics:
    array, people, methods = scores.to_numpy(dtype="float64"), scores.index, list(map(str, scores.columns))
    at_ends = ends(array, scale)
    far = tuple(
        results.FarScore(participant=str(people[o.row]), method=methods[o.column], score=o.score, fence=o.fence)
        for o in outliers(array)
    )
    return results.Diagnostics(
        normality=results.NotedNormality(test=normality(array), note=NORMALITY_NOTE),
        outliers=results.Outliers(rule=OUTLIER_RULE, found=far),
        scale=scale,
        floor=dict(zip(methods, at_ends.floor, strict=True)),
        ceiling=dict(zip(methods, at_ends.ceiling, strict=True)),
    )
