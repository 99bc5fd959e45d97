"""The results of the two experiments as sections of a report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analysis.report import apa
from analysis.report.figures.names import display_name, people
from analysis.report.section import Section
from analysis.summary.sections.pictures import directions_picture, response_times_picture
from analysis.summary.sections.tables import (
    binomial_table,
    direction_means,
    direction_people,
    mean_sd,
    means_table,
    preference_people,
    scaled,
    tukey_table,
)

Statistics = Mapping[str, Any]

_DIRECTION_NOTE = (
    "The measure is the paper's: correct answers on forward shots over forward shots. Forward trials alone mix "
    "sensitivity with the readiness to say forward, so d′ and criterion over both directions stand beside it "
    "(log-linear correction; a criterion below 0 leans towards forward)."
)


def direction_section(found: Statistics) -> Section:
    """Experiment 1: correct rates, sensitivity, response times, tests."""
    tests = (tukey_table(found, "correct rate, forward (percentage points)", 100.0, 1),) if found["tukey"] else ()
    times = response_times_picture(found)
    return Section(
        title="Direction recognition",
        paragraphs=(
            _effect_sentence(found, "the correct rate on forward shots", 100.0, 1, " %"),
            *_post_hoc_sentences(found, 100.0, 1, " percentage points"),
            _DIRECTION_NOTE,
            _binomial_sentence(found),
            _times_sentence(found["response_times"]),
        ),
        pictures=(directions_picture(found), *((times,) if times else ())),
        tables=(
            means_table(found, 100.0, 1, " [%]"),
            direction_means(found),
            *tests,
            binomial_table(found),
            direction_people(found),
        ),
    )


def preference_section(found: Statistics) -> Section:
    """Experiment 2: ratings and tests."""
    tests = (tukey_table(found, "rating", 1.0, 2),) if found["tukey"] else ()
    return Section(
        title="Preference",
        paragraphs=(
            "Ratings go from 0 (dislike very much) to 10 (like very much).",
            _effect_sentence(found, "the rating", 1.0, 2, ""),
            *_post_hoc_sentences(found, 1.0, 2, ""),
        ),
        tables=(means_table(found, 1.0, 2, ""), *tests, preference_people(found)),
    )


def _effect_sentence(found: Statistics, measure: str, scale: float, digits: int, unit: str) -> str:
    means = ", ".join(
        f"{display_name(m)} {mean_sd(found['means'][m], found['sds'][m], scale, digits, unit)}"
        for m in found["methods"]
    )
    means = f"Means (SD) of {measure} over {people(found)}: {means}."
    anova = found["anova"]
    if anova is None:
        return f"{means} There are too few participants or methods for a test."
    if anova["p"] is None:
        return f"{means} The {anova['name']} is undefined: all scores are equal."
    effect = "had a significant effect" if anova["p"] < 0.05 else "had no significant effect"
    return f"{means} The rendering method {effect} on {measure}, {apa.f_test(anova)}{_size(found)} ({anova['name']})."


def _size(found: Statistics) -> str:
    """The partial eta squared, if there is one."""
    partial = (found.get("effect_size") or {}).get("partial_eta_squared")
    return "" if partial is None else f", partial η² = {apa.below_one(partial)}"


def _post_hoc_sentences(found: Statistics, scale: float, digits: int, unit: str) -> tuple[str, ...]:
    if not found["tukey"]:
        return ()
    pairs = "; ".join(_pair_words(comparison, scale, digits, unit) for comparison in found["tukey"])
    return (f"Post-hoc comparisons (95 % CIs are simultaneous): {pairs}. {found['tukey_error_term']}",)


def _pair_words(comparison: Statistics, scale: float, digits: int, unit: str) -> str:
    """The larger mean first."""
    a, b = display_name(comparison["a"]), display_name(comparison["b"])
    low, high, p = comparison["ci_low"], comparison["ci_high"], comparison["p"]
    if comparison["difference"] < 0.0:
        a, b, low, high = b, a, scaled(high, -1.0), scaled(low, -1.0)
    amount = f"{apa.number(scale * abs(comparison['difference']), digits)}{unit}"
    tested = f"95 % CI {apa.interval(scaled(low, scale), scaled(high, scale), digits)}, {apa.p_value(p)}"
    if p is None or p >= 0.05:
        return f"{a} and {b} do not differ significantly (by {amount}, {tested})"
    return f"{a} is above {b} by {amount}, {tested}"


def _binomial_sentence(found: Statistics) -> str:
    """Which rates differ from guessing; the reservation about pooling with it."""
    tests = [
        (
            test["p"] < 0.05,
            f"{display_name(method)} {direction} {test['successes']} of {test['trials']}, {apa.p_value(test['p'])}",
        )
        for method, directions in found["binomial"].items()
        for direction, test in directions.items()
    ]
    parts = []
    for differs, words in (
        (False, "no significant difference from 50 %"),
        (True, "a significant difference from 50 %"),
    ):
        named = "; ".join(text for significant, text in tests if significant is differs)
        parts += [f"{words} ({named})"] if named else []
    return f"Exact binomial tests of the correct rate: {', and '.join(parts)}. {found['binomial_note']}"


def _times_sentence(times: Statistics) -> str:
    """How many response times there are, and which are none."""
    left_out = (
        f"{times['left_out']:,} answered trials have none: it was entered or corrected by the experimenter, whose hand "
        "tells nothing of the participant's time."
    )
    if not times["n"]:
        return f"There is no valid response time, and so no figure of them. {left_out}"
    return f"Response times: {times['n']:,} valid ones.{' ' + left_out if times['left_out'] else ''}"
