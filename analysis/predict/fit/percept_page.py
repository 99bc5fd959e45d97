"""The report page of `recoil fit percept`: the fit, its predictions, its judgement by numbers that were not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from analysis.paper.odds import wilson_interval
from analysis.predict.fit.figures import RateCurve, RatePoint, Spread, figure_percept, figure_places
from analysis.predict.fit.studies import Judged
from analysis.predict.fit.words import (
    NO_TIMES,
    UNITS,
    limits,
    percents,
    place_sentence,
    spread_sentence,
    verdict_sentence,
)
from analysis.report import apa
from analysis.report.section import Picture, Section, Table

Facts = dict[str, Any]


def judgement(found: Facts, judged: Sequence[Judged], figures: Path) -> Section:
    """The section; its figure is written."""
    told = found["judged"]
    cases, main = told["cases"], told["cases"][told["main"]]
    _draw_places(judged, figures / "places")
    return Section(
        title="Judged by what was not fitted",
        paragraphs=(
            f"{told['studies']:,} studies at the paper's design were simulated from the fit, with seed {told['seed']}, "
            "for people alike, for an assumed spread of people and twice it (the percept fitted anew for each, so that "
            "the mean forward rates are the published ones), and with the fit's own error drawn anew for each study. "
            "A percentile is the share of the studies below the published number plus half of those that print alike; "
            "near 0 or 100 the model would be at odds with the paper.",
            f"{main['name'].capitalize()}: "
            + "; ".join(place_sentence(place) for place in main["places"] if not place["fitted"])
            + ".",
            verdict_sentence(main),
        ),
        pictures=(
            Picture(
                stem="places",
                caption="Simulated distributions of what was not fitted; black: the published numbers",
                alt="Distributions of F and of the correct backward answers, with the published numbers as lines",
            ),
        ),
        tables=(_places_table(cases), _claims_table(cases), _cases_table(cases)),
    )


def _draw_places(judged: Sequence[Judged], path_stem: Path) -> None:
    spreads = []
    quantities = [place for place in judged[0].places if not place.fitted and "binomial p" not in place.quantity]
    for quantity in dict.fromkeys(place.quantity for place in quantities):
        alike = [place for place in quantities if place.quantity == quantity]
        title, _, label = quantity.partition(": ")
        spreads.append(
            Spread(
                title=title,
                x_label=label or "F",
                cases={one.case.name: _plain(one, quantity) for one in judged},
                published={f" {place.published.split(',')[0]}": _value(place.published) for place in alike},
            )
        )
    figure_places(spreads, path_stem)


def _plain(judged: Judged, quantity: str) -> tuple[list[float], list[float]]:
    edges, counts = judged.histograms[quantity]
    return edges.tolist(), [float(count) for count in counts]


def _value(published: str) -> float:
    return float(published.split(",", maxsplit=1)[0])


def _places_table(cases: Sequence[Facts]) -> Table:
    rows = [
        (
            f"{place['quantity']} = {place['published']}" + (" (fitted)" if place["fitted"] else ""),
            *(f"{apa.number(100.0 * one['percentile'], 1)} {percents(one)}" for one in alike),
        )
        for place, *alike in (
            (cases[0]["places"][i], *(case["places"][i] for case in cases)) for i in range(len(cases[0]["places"]))
        )
    ]
    return Table(
        caption="Percentile of each published number among the simulated ones [95 % Monte Carlo interval]",
        header=("Published", *(case["name"] for case in cases)),
        rows=tuple(rows),
    )


def _claims_table(cases: Sequence[Facts]) -> Table:
    rows = [
        (
            claim["claim"] + (" (fitted)" if claim["fitted"] else ""),
            *(f"{apa.number(100.0 * case['claims'][i]['share'], 1)} {percents(case['claims'][i])}" for case in cases),
        )
        for i, claim in enumerate(cases[0]["claims"])
    ]
    return Table(
        caption="Share of the studies in which a published claim holds, % [95 % Monte Carlo interval]",
        header=("Published claim", *(case["name"] for case in cases)),
        rows=tuple(rows),
    )


def _cases_table(cases: Sequence[Facts]) -> Table:
    names = ("sensitivity", "confusion", "start")
    rows = tuple(
        (case["name"], spread_sentence(case["people"]), *(apa.number(case["parameters"][name], 3) for name in names))
        for case in cases
    )
    return Table(caption="The people of each case, and their fit", header=("Case", "People", *names), rows=rows)


def sections(found: Facts, judged: Sequence[Judged], figures: Path) -> tuple[Section, ...]:
    """The page's sections; their figures are written."""
    parts = [_fitted(found), _predictions(found, figures), _unknown(found)]
    parts += [judgement(found, judged, figures)] if judged else []
    return (*parts, _origin(found))


def _fitted(found: Facts) -> Section:
    rows = tuple(
        (name, UNITS[name], apa.number(one["value"], 3), apa.number(one["se"], 3), limits(one))
        for name, one in found["fitted"].items()
    )
    rates = tuple(
        (
            name,
            apa.percent(one["observed"]),
            apa.percent(one["predicted"]),
            f"{apa.percent(one['backward']['value'])} {percents(one['backward'])}",
            apa.number(found["percepts"][name]["log_odds"], 2),
        )
        for name, one in found["rates"].items()
    )
    return Section(
        title="The fit",
        paragraphs=(
            f"Three numbers from {len(found['rates'])} mean forward rates of {found['trials']} trials each: deviance "
            f"{apa.number(found['deviance'], 3)} on {found['freedom']} degrees of freedom. {_exactly(found)}",
        ),
        tables=(
            Table(
                caption="Fitted numbers, with 95 % intervals from the profile likelihood",
                header=("Number", "Unit", "Estimate", "SE", "95 % CI"),
                rows=rows,
            ),
            Table(
                caption="Rates; the backward ones were not fitted, they are predictions [95 % CI of the fit]",
                header=("Method", "Forward, observed", "Forward, fit", "Backward, predicted", "Evidence (log odds)"),
                rows=rates,
            ),
        ),
    )


def _exactly(found: Facts) -> str:
    return "As many numbers as rates: that they are met is no evidence for the model." if not found["freedom"] else ""


def _predictions(found: Facts, figures: Path) -> Section:
    curves, points = [], [_point(found, name, None) for name in found["rates"]]
    for one in found["friction"]:
        points = [_point(found, point.name, one["methods"].get(point.name, point.friction_N)) for point in points]
        curves += _curves(found, one)
    figure_percept(curves, points, figures / "percept")
    return Section(
        title="Predicted over the damper's friction",
        paragraphs=(
            "A prediction, not a measurement: only the marked points were felt by anybody. The band is the fitted "
            "numbers' uncertainty alone; the thin lines are fits under other assumptions, which meet the same rates.",
        ),
        pictures=(
            Picture(
                stem="percept",
                caption=(
                    "Forward rate predicted by the fit over the damper's friction (band: 95 %), with the observed "
                    "rates (bars: Wilson's 95 % interval, trials taken as independent)"
                ),
                alt="A falling and rising curve of the forward rate over friction with the observed points on it",
            ),
        ),
    )


def _point(found: Facts, name: str, friction_N: float | None) -> RatePoint:
    rate = found["rates"][name]["observed"]
    low, high = wilson_interval(round(rate * found["trials"]), found["trials"])
    return RatePoint(name=name, friction_N=friction_N, rate=rate, low=min(low, rate), high=max(high, rate))


def _curves(found: Facts, one: Facts) -> list[RateCurve]:
    main, frictions = one["fit"], one["friction_N"]
    known = None not in (*main["ci_low"], *main["ci_high"])
    first = RateCurve(
        name=f"fit: {_assumed(found['assumed'])}",
        friction_N=frictions,
        rate=main["value"],
        low=main["ci_low"] if known else (),
        high=main["ci_high"] if known else (),
    )
    others = [
        RateCurve(name=_assumed(parameters), friction_N=frictions, rate=along)
        for parameters, along in zip(found["other_assumptions"], one["other_assumptions"], strict=True)
    ]
    return [first, *others]


def _assumed(parameters: Facts) -> str:
    return f"exponent {parameters['exponent']:g}, leak {1000.0 * parameters['leak_s']:g} ms"


def _unknown(found: Facts) -> Section:
    fitted = list(found["fitted"])
    rows = tuple(
        (_assumed(one), *(apa.number(one[name], 3) for name in fitted), apa.number(one["deviance"], 3))
        for one in ({**found["assumed"], **_values(found), "deviance": found["deviance"]}, *found["other_assumptions"])
    )
    untold = tuple((name, apa.number(value, 2)) for name, value in found["untold"].items())
    return Section(
        title="What these rates cannot tell",
        items=(
            *found["unknown"],
            NO_TIMES,
            "Each number is left open (below) from 0, if the rates fix it alone, to 1, if they do not bear on it: its "
            "part in the directions in which the rates have no information.",
        ),
        tables=(
            Table(
                caption="The same rates under other assumptions",
                header=("Assumed", *fitted, "Deviance"),
                rows=rows,
            ),
            Table(
                caption="How far each is left open",
                header=("Number", "Left open"),
                rows=untold,
            ),
        ),
    )


def _values(found: Facts) -> Facts:
    return {name: one["value"] for name, one in found["fitted"].items()}


def _origin(found: Facts) -> Section:
    rows = tuple((name, str(value)) for name, value in found["provenance"].items())
    return Section(
        title="What this rests on",
        items=tuple(found["assumptions"]),
        tables=(Table(caption="Where the numbers come from", header=("What", "Value"), rows=rows),),
    )
