"""The part of the percept's report that judges the fit: published numbers among those of simulated studies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from analysis.predict.fit.figures import Spread, figure_places
from analysis.predict.fit.studies import Judged
from analysis.predict.fit.words import percents, place_sentence, spread_sentence, verdict_sentence
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
