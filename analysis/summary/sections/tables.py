"""The tables of the two experiments, in finished text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from analysis.report import apa
from analysis.report.figures.names import display_name
from analysis.report.section import LISTED, SHOWN, Table

Statistics = Mapping[str, Any]

_WITHIN = (
    ". The CI is within-subject (Cousineau–Morey): it tells of differences between methods, not between people, and is "
    "not cut at the ends of the scale"
)


def tukey_table(found: Statistics, measure: str, scale: float, digits: int) -> Table:
    """The pairs with their simultaneous intervals."""
    df = found["anova"]["df"][1]
    rows = (
        (
            f"{display_name(c['a'])} − {display_name(c['b'])}",
            apa.number(scaled(c["difference"], scale), digits),
            _interval_cell(c, scale, digits),
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


def means_table(found: Statistics, scale: float, digits: int, unit: str) -> Table:
    """Mean, SD and within-subject interval; the interval is left out where there is none."""
    intervals = found["within_ci"]
    rows = (
        (
            display_name(m),
            f"{found['n']:,}",
            apa.number(scaled(found["means"][m], scale), digits),
            apa.number(scaled(found["sds"][m], scale), digits),
            *((_interval_cell(intervals[m], scale, digits),) if intervals else ()),
        )
        for m in found["methods"]
    )
    measure = "Correct rate on forward shots" if unit else "Rating"
    return Table(
        caption=f"{measure}, mean and SD over participants{_WITHIN if intervals else ''}",
        header=("Method", "n", f"Mean{unit}", f"SD{unit}", *((f"95 % CI{unit}",) if intervals else ())),
        rows=tuple(rows),
    )


def _interval_cell(ends: Statistics, scale: float, digits: int) -> str:
    return apa.interval(scaled(ends["ci_low"], scale), scaled(ends["ci_high"], scale), digits)


def scaled(value: float | None, scale: float) -> float | None:
    """`value` in another unit, nothing if there is none."""
    return None if value is None else scale * value


def direction_means(found: Statistics) -> Table:
    """Rates of both directions, d′, criterion and response time."""
    return Table(
        caption="Both directions: mean (SD) over participants of rates, sensitivity and criterion; pooled median of "
        "the valid response times",
        header=("Method", "Forward", "Backward", "d′", "Criterion", "Response time [s]"),
        rows=tuple(_direction_row(found, method) for method in found["methods"]),
    )


def _direction_row(found: Statistics, method: str) -> tuple[str, ...]:
    backward, sensitivity = found["backward"], found["sensitivity"][method]
    time = found["response_time"][method]
    return (
        display_name(method),
        mean_sd(found["means"][method], found["sds"][method], 100.0, 1, " %"),
        mean_sd(backward["means"].get(method), backward["sds"].get(method), 100.0, 1, " %"),
        *(_sensitivity(sensitivity, key) for key in ("d_prime", "criterion")),
        f"{apa.number(time['median'])} (n = {time['n']:,})" if time["n"] else apa.NONE,
    )


def _sensitivity(sensitivity: Statistics | None, key: str) -> str:
    return apa.NONE if sensitivity is None else mean_sd(sensitivity[key]["mean"], sensitivity[key]["sd"], 1.0, 2, "")


def mean_sd(mean: float | None, sd: float | None, scale: float, digits: int, unit: str) -> str:
    """`mean unit (SD)`; a dash for what is undefined."""
    if mean is None:
        return apa.NONE
    spread = apa.NONE if sd is None else apa.number(scale * sd, digits)
    return f"{apa.number(scale * mean, digits)}{unit} ({spread})"


def binomial_table(found: Statistics) -> Table:
    """Each method and direction against guessing."""
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


def direction_people(found: Statistics) -> Table:
    """Forward and backward rate of each participant in one cell a method."""
    backward = found["backward"]["participants"]
    rows = tuple(
        (code, *(_both(row[m], backward.get(code, {}).get(m)) for m in found["methods"])) for code, row in _few(found)
    )
    return _people_table(found, rows, "Correct rate of each participant, forward / backward", "direction_wide.csv")


def _both(forward: float | None, backward: float | None) -> str:
    return f"{apa.percent(forward, 0)} / {apa.percent(backward, 0)}"


def preference_people(found: Statistics) -> Table:
    """The rating of each participant."""
    rows = tuple((code, *(apa.number(row[m], 1) for m in found["methods"])) for code, row in _few(found))
    return _people_table(found, rows, "Rating of each participant", "preference_wide.csv")


def _few(found: Statistics) -> Iterator[tuple[str, Mapping[str, float | None]]]:
    """Everybody, or the first 50 of more than 100."""
    people: Mapping[str, Mapping[str, float | None]] = found["participants"]
    return islice(people.items(), SHOWN if len(people) > LISTED else None)


def _people_table(found: Statistics, rows: tuple[tuple[str, ...], ...], caption: str, file: str) -> Table:
    rest = f": the first {len(rows)} of {found['n']:,}; everybody is in {file}" if len(rows) < found["n"] else ""
    header = ("Participant", *(display_name(method) for method in found["methods"]))
    return Table(caption=caption + rest, header=header, rows=rows)
