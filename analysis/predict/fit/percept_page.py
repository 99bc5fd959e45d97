"""The report page of `recoil fit percept`: the fit, its predictions, and what the rates do not tell."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from analysis.paper.odds import wilson_interval
from analysis.predict.fit.figures import RateCurve, RatePoint, figure_percept
from analysis.predict.fit.judgement_page import judgement
from analysis.predict.fit.studies import Judged
from analysis.predict.fit.words import NO_TIMES, UNITS, limits, percents
from analysis.report import apa
from analysis.report.section import Picture, Section, Table

Facts = dict[str, Any]


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
