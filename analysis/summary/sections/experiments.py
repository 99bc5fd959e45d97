"""The results of the two experiments as sections of a report, with their tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import islice

from analysis.report import apa
from analysis.report.figures.style import display_name
from analysis.report.section import LISTED, SHOWN, Section, Table
from analysis.summary.results import ConfidenceInterval, DirectionStatistics, Pair, WithinStatistics
from analysis.summary.sections.content import directions_picture, response_times_picture
from analysis.times.own_trials import ResponseTimes

_WITHIN = (
    ". The CI is within-subject (Cousineau–Morey): it tells of differences between methods, not between people, and is "
    "not cut at the ends of the scale"
)


def tukey_tables(found: WithinStatistics, measure: str, scale: float, digits: int) -> tuple[Table, ...]:
    """The pairs with their simultaneous intervals; no table where nothing was tested."""
    if found.anova is None or not found.tukey:
        return ()
    rows = (
        (
            f"{display_name(c.a)} − {display_name(c.b)}",
            apa.number(scale * c.difference, digits),
            _interval_cell(c, scale, digits),
            apa.number(c.q),
            apa.p_cell(c.p),
        )
        for c in found.tukey
    )
    df = found.anova.df[1]
    table = Table(
        caption=f"Tukey's HSD of the {measure}, repeated-measures error term, {df} degrees of freedom",
        header=("Pair", "Difference", "95 % CI, simultaneous", "q", "p"),
        rows=tuple(rows),
    )
    return (table,)


def means_table(found: WithinStatistics, scale: float, digits: int, unit: str) -> Table:
    """Mean, SD and within-subject interval; the interval is left out where there is none."""
    intervals = found.within_ci
    rows = (
        (
            display_name(m),
            f"{found.n:,}",
            apa.number(scale * found.means[m], digits),
            apa.number(scale * found.sds[m], digits),
            *((_interval_cell(intervals[m], scale, digits),) if intervals else ()),
        )
        for m in found.methods
    )
    measure = "Correct rate on forward shots" if unit else "Rating"
    return Table(
        caption=f"{measure}, mean and SD over participants{_WITHIN if intervals else ''}",
        header=("Method", "n", f"Mean{unit}", f"SD{unit}", *((f"95 % CI{unit}",) if intervals else ())),
        rows=tuple(rows),
    )


def _interval_cell(ends: Pair | ConfidenceInterval, scale: float, digits: int) -> str:
    return apa.interval(scale * ends.ci_low, scale * ends.ci_high, digits)


def direction_means(found: DirectionStatistics) -> Table:
    """Rates of both directions, d′, criterion and response time."""
    return Table(
        caption="Both directions: mean (SD) over participants of rates, sensitivity and criterion; pooled median of "
        "the valid response times",
        header=("Method", "Forward", "Backward", "d′", "Criterion", "Response time [s]"),
        rows=tuple(_direction_row(found, method) for method in found.methods),
    )


def _direction_row(found: DirectionStatistics, method: str) -> tuple[str, ...]:
    backward, sensitivity = found.backward, found.sensitivity[method]
    time = found.response_time[method]
    measures = () if sensitivity is None else (sensitivity.d_prime, sensitivity.criterion)
    return (
        display_name(method),
        mean_sd(found.means[method], found.sds[method], 100.0, 1, " %"),
        mean_sd(backward.means.get(method), backward.sds.get(method), 100.0, 1, " %"),
        *((mean_sd(one.mean, one.sd, 1.0, 2, "") for one in measures) if measures else (apa.NO_NUMBER, apa.NO_NUMBER)),
        f"{apa.number(time.median)} (n = {time.n:,})" if time.n else apa.NO_NUMBER,
    )


def mean_sd(mean: float | None, sd: float | None, scale: float, digits: int, unit: str) -> str:
    """`mean unit (SD)`; a dash for what is undefined."""
    if mean is None or math.isnan(mean):
        return apa.NO_NUMBER
    spread = apa.NO_NUMBER if sd is None else apa.number(scale * sd, digits)
    return f"{apa.number(scale * mean, digits)}{unit} ({spread})"


def binomial_table(found: DirectionStatistics) -> Table:
    """Each method and direction against guessing."""
    rows = (
        (
            display_name(method),
            direction,
            f"{test.successes} of {test.trials}",
            apa.percent(test.estimate),
            apa.interval(100.0 * test.ci_low, 100.0 * test.ci_high, 1),
            apa.p_cell(test.p),
        )
        for method, tests in found.binomial.items()
        for direction, test in tests.items()
    )
    return Table(
        caption="Exact binomial tests against 50 %, trials pooled over participants (their clustering is ignored)",
        header=("Method", "Direction", "Correct", "Rate", "95 % CI [%]", "p"),
        rows=tuple(rows),
    )


def direction_people(found: DirectionStatistics) -> Table:
    """Forward and backward rate of each participant in one cell a method."""
    backward = found.backward.participants
    rows = tuple(
        (code, *(_both(row[m], backward.get(code, {}).get(m)) for m in found.methods)) for code, row in _few(found)
    )
    return _people_table(found, rows, "Correct rate of each participant, forward / backward", "direction_wide.csv")


def _both(forward: float | None, backward: float | None) -> str:
    return f"{apa.percent(forward, 0)} / {apa.percent(backward, 0)}"


def preference_people(found: WithinStatistics) -> Table:
    """The rating of each participant."""
    rows = tuple((code, *(apa.number(row[m], 1) for m in found.methods)) for code, row in _few(found))
    return _people_table(found, rows, "Rating of each participant", "preference_wide.csv")


def _few(found: WithinStatistics) -> Iterator[tuple[str, Mapping[str, float]]]:
    """Everybody, or the first 50 of more than 100."""
    return islice(found.participants.items(), SHOWN if len(found.participants) > LISTED else None)


def _people_table(found: WithinStatistics, rows: tuple[tuple[str, ...], ...], caption: str, file: str) -> Table:
    rest = f": the first {len(rows)} of {found.n:,}; everybody is in {file}" if len(rows) < found.n else ""
    header = ("Participant", *(display_name(method) for method in found.methods))
    return Table(caption=caption + rest, header=header, rows=rows)


_DIRECTION_NOTE = (
    "The measure is the paper's: correct answers on forward shots over forward shots. Forward trials alone mix "
    "sensitivity with the readiness to say forward, so d′ and criterion over both directions stand beside it "
    "(log-linear correction; a criterion below 0 leans towards forward)."
)


def direction_section(found: DirectionStatistics) -> Section:
    """Experiment 1: correct rates, sensitivity, response times, tests."""
    tests = tukey_tables(found, "correct rate, forward (percentage points)", 100.0, 1)
    times = response_times_picture(found)
    return Section(
        title="Direction recognition",
        paragraphs=(
            _effect_sentence(found, "the correct rate on forward shots", 100.0, 1, " %"),
            *_post_hoc_sentences(found, 100.0, 1, " percentage points"),
            _DIRECTION_NOTE,
            _binomial_sentence(found),
            _times_sentence(found.response_times),
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


def preference_section(found: WithinStatistics) -> Section:
    """Experiment 2: ratings and tests."""
    tests = tukey_tables(found, "rating", 1.0, 2)
    return Section(
        title="Preference",
        paragraphs=(
            "Ratings go from 0 (dislike very much) to 10 (like very much).",
            _effect_sentence(found, "the rating", 1.0, 2, ""),
            *_post_hoc_sentences(found, 1.0, 2, ""),
        ),
        tables=(means_table(found, 1.0, 2, ""), *tests, preference_people(found)),
    )


def _effect_sentence(found: WithinStatistics, measure: str, scale: float, digits: int, unit: str) -> str:
    means = ", ".join(
        f"{display_name(m)} {mean_sd(found.means[m], found.sds[m], scale, digits, unit)}" for m in found.methods
    )
    means = f"Means (SD) of {measure} over {found.people}: {means}."
    anova = found.anova
    if anova is None:
        return f"{means} There are too few participants or methods for a test."
    if math.isnan(anova.p):
        return f"{means} The {anova.name} is undefined: all scores are equal."
    effect = "had a significant effect" if anova.p < 0.05 else "had no significant effect"
    test = f"{apa.f_test(anova.F, anova.df, anova.p)}{_size(found)} ({anova.name})"
    return f"{means} The rendering method {effect} on {measure}, {test}."


def _size(found: WithinStatistics) -> str:
    """The partial eta squared, if there is one."""
    partial = found.supplement.effect_size.size.partial_eta_squared if found.supplement else None
    return "" if partial is None else f", partial η² = {apa.below_one(partial)}"


def _post_hoc_sentences(found: WithinStatistics, scale: float, digits: int, unit: str) -> tuple[str, ...]:
    if not found.tukey:
        return ()
    pairs = "; ".join(_pair_words(comparison, scale, digits, unit) for comparison in found.tukey)
    return (f"Post-hoc comparisons (95 % CIs are simultaneous): {pairs}. {found.tukey_error_term}",)


def _pair_words(comparison: Pair, scale: float, digits: int, unit: str) -> str:
    """The larger mean first."""
    a, b = display_name(comparison.a), display_name(comparison.b)
    low, high, p = comparison.ci_low, comparison.ci_high, comparison.p
    if comparison.difference < 0.0:
        a, b, low, high = b, a, -high, -low
    amount = f"{apa.number(scale * abs(comparison.difference), digits)}{unit}"
    tested = f"95 % CI {apa.interval(scale * low, scale * high, digits)}, {apa.p_value(p)}"
    if not p < 0.05:
        return f"{a} and {b} do not differ significantly (by {amount}, {tested})"
    return f"{a} is above {b} by {amount}, {tested}"


def _binomial_sentence(found: DirectionStatistics) -> str:
    """Which rates differ from guessing; the reservation about pooling with it."""
    tests = [
        (
            test.p < 0.05,
            f"{display_name(method)} {direction} {test.successes} of {test.trials}, {apa.p_value(test.p)}",
        )
        for method, directions in found.binomial.items()
        for direction, test in directions.items()
    ]
    parts = []
    for differs, words in (
        (False, "no significant difference from 50 %"),
        (True, "a significant difference from 50 %"),
    ):
        named = "; ".join(text for significant, text in tests if significant is differs)
        parts += [f"{words} ({named})"] if named else []
    return f"Exact binomial tests of the correct rate: {', and '.join(parts)}. {found.binomial_note}"


def _times_sentence(times: ResponseTimes) -> str:
    """How many response times there are, and which are none."""
    left_out = (
        f"{times.left_out:,} answered trials have none: it was entered or corrected by the experimenter, whose hand "
        "tells nothing of the participant's time."
    )
    if not times.n:
        return f"There is no valid response time, and so no figure of them. {left_out}"
    return f"Response times: {times.n:,} valid ones.{' ' + left_out if times.left_out else ''}"
