"""The results of the two experiments as sections of a report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from analysis import apa
from analysis.figures import display_name
from analysis.report_parts import Section, Table

Statistics = Mapping[str, Any]

_DIRECTION_NOTE = (
    "The measure is the paper's: correct answers on forward shots over forward shots. Forward trials alone mix "
    "sensitivity with the readiness to say forward, so d′ and criterion over both directions stand beside it "
    "(log-linear correction; a criterion below 0 leans towards forward)."
)


def direction_section(found: Statistics) -> Section:
    """Experiment 1: correct rates, sensitivity, response times, tests."""
    tables = [_direction_means(found), _direction_people(found)]
    if found["tukey"]:
        tables.insert(1, _tukey_table(found, "correct rate, forward (percentage points)", 100.0, 1))
    tables.insert(-1, _binomial_table(found))
    return Section(
        title="Direction recognition",
        paragraphs=(
            _effect_sentence(found, "the correct rate on forward shots", apa.percent),
            *_post_hoc_sentences(found),
            _DIRECTION_NOTE,
            f"Binomial tests: {found['binomial_note']}",
        ),
        tables=tuple(tables),
    )


def preference_section(found: Statistics) -> Section:
    """Experiment 2: ratings and tests."""
    means = Table(
        caption="Ratings from 0 (dislike very much) to 10 (like very much), mean and SD over participants",
        header=("Method", "n", "Mean", "SD"),
        rows=tuple(
            (display_name(m), str(found["n"]), apa.number(found["means"][m]), apa.number(found["sds"][m]))
            for m in found["methods"]
        ),
    )
    tests = (_tukey_table(found, "rating", 1.0, 2),) if found["tukey"] else ()
    people = _people_table(found["participants"], found["methods"], "Rating of each participant", _rating)
    return Section(
        title="Preference",
        paragraphs=(
            _effect_sentence(found, "the rating", lambda mean: apa.number(mean, 2)),
            *_post_hoc_sentences(found),
        ),
        tables=(means, *tests, people),
    )


def _effect_sentence(found: Statistics, measure: str, shown: Callable[[float | None], str]) -> str:
    means = ", ".join(f"{display_name(m)} {shown(found['means'][m])}" for m in found["methods"])
    means = f"Means of {measure} over {found['n']} participants: {means}."
    anova = found["anova"]
    if anova is None:
        return f"{means} There are too few participants or methods for a test."
    if anova["p"] is None:
        return f"{means} The {anova['name']} is undefined: all scores are equal."
    verb = "changed" if anova["p"] < 0.05 else "did not significantly change"
    return f"{means} The rendering method {verb} {measure}, {apa.f_test(anova)} ({anova['name']})."


def _post_hoc_sentences(found: Statistics) -> tuple[str, ...]:
    if not found["tukey"]:
        return ()
    pairs = "; ".join(_pair_words(comparison) for comparison in found["tukey"])
    return (f"Post-hoc comparisons: {pairs}. {found['tukey_error_term']}",)


def _pair_words(comparison: Statistics) -> str:
    a, b = display_name(comparison["a"]), display_name(comparison["b"])
    p = comparison["p"]
    if p is None or p >= 0.05:
        return f"{a} and {b} do not differ significantly ({apa.p_value(p)})"
    return f"{a} is {'above' if comparison['difference'] > 0 else 'below'} {b} ({apa.p_value(p)})"


def _tukey_table(found: Statistics, measure: str, scale: float, digits: int) -> Table:
    df = found["anova"]["df"][1]
    rows = (
        (
            f"{display_name(c['a'])} − {display_name(c['b'])}",
            apa.number(scale * c["difference"], digits),
            apa.interval(scale * c["ci_low"], scale * c["ci_high"], digits),
            apa.number(c["q"]),
            apa.p_cell(c["p"]),
        )
        for c in found["tukey"]
    )
    return Table(
        caption=f"Tukey's HSD of the {measure}, repeated-measures error term, {df} degrees of freedom",
        header=("Pair", "Difference", "95 % CI, simultaneous", "q", "p"),
        rows=tuple(rows),
    )


def _direction_means(found: Statistics) -> Table:
    return Table(
        caption="Correct rates, sensitivity and response time, mean (SD) over participants",
        header=("Method", "Forward", "Backward", "d′", "Criterion", "Response time, median [s]"),
        rows=tuple(_direction_row(found, method) for method in found["methods"]),
    )


def _direction_row(found: Statistics, method: str) -> tuple[str, ...]:
    backward, sensitivity = found["backward"], found["sensitivity"][method]
    time = found["response_time"][method]
    return (
        display_name(method),
        _mean_sd(found["means"][method], found["sds"][method], 100.0, 1, " %"),
        _mean_sd(backward["means"].get(method), backward["sds"].get(method), 100.0, 1, " %"),
        *(_sensitivity(sensitivity, key) for key in ("d_prime", "criterion")),
        f"{apa.number(time['median'])} (n = {time['n']})",
    )


def _sensitivity(sensitivity: Statistics | None, key: str) -> str:
    return apa.NONE if sensitivity is None else _mean_sd(sensitivity[key]["mean"], sensitivity[key]["sd"], 1.0, 2, "")


def _mean_sd(mean: float | None, sd: float | None, scale: float, digits: int, unit: str) -> str:
    if mean is None:
        return apa.NONE
    spread = apa.NONE if sd is None else apa.number(scale * sd, digits)
    return f"{apa.number(scale * mean, digits)}{unit} ({spread})"


def _binomial_table(found: Statistics) -> Table:
    rows = (
        (
            display_name(method),
            direction,
            f"{test['successes']} of {test['trials']}",
            apa.percent(test["estimate"]),
            apa.interval(100.0 * test["ci_low"], 100.0 * test["ci_high"], 1),
            apa.p_cell(test["p"]),
        )
        for method, tests in found["binomial"].items()
        for direction, test in tests.items()
    )
    return Table(
        caption="Exact binomial tests against 50 %, trials pooled over participants (their clustering is ignored)",
        header=("Method", "Direction", "Correct", "Rate", "95 % CI [%]", "p"),
        rows=tuple(rows),
    )


def _direction_people(found: Statistics) -> Table:
    """Forward and backward rate of each participant in one cell a method."""
    backward = found["backward"]["participants"]
    cells = {
        code: {
            m: f"{apa.percent(rate, 0)} / {apa.percent(backward.get(code, {}).get(m), 0)}" for m, rate in row.items()
        }
        for code, row in found["participants"].items()
    }
    return _people_table(cells, found["methods"], "Correct rate of each participant, forward / backward", str)


def _rating(value: float | None) -> str:
    return apa.number(value, 1)


def _people_table(
    people: Mapping[str, Mapping[str, Any]], methods: Sequence[str], caption: str, shown: Callable[[Any], str]
) -> Table:
    return Table(
        caption=caption,
        header=("Participant", *(display_name(method) for method in methods)),
        rows=tuple((code, *(shown(row[method]) for method in methods)) for code, row in people.items()),
    )
