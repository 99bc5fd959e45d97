"""The report page of `recoil design`: the best design, the trade, the maps, the critical conditions."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from analysis.predict.design_search.choice import Designs
from analysis.predict.design_search.figures import (
    Lines,
    Trade,
    best_mark,
    felt_methods,
    field_of,
    figure_critical,
    figure_maps,
    figure_trade,
    mark_of,
    own_marks,
    with_pulse,
)
from analysis.predict.design_search.words import at_friction, best_sentences, none_sentence, share_cell, swept
from analysis.report import apa
from analysis.report.section import Picture, Section, Table

Facts = dict[str, Any]

BOTH = "both directions alike"


def critical_section(found: Facts, figures: Path) -> Section:
    """The section; its figure is written."""
    critical = found["critical"]
    others = {one["name"]: np.array(one["voltage_V"], dtype=np.float64) for one in critical["alternatives"]}
    others[BOTH] = np.array(critical["both_directions_V"], dtype=np.float64)
    band = critical["band"]
    lines = Lines(
        voltage_V=np.array(critical["voltage_V"], dtype=np.float64),
        low_V=_ends(band["low_V"], band["reached_low"]),
        high_V=_ends(band["high_V"], band["reached_high"]),
        others=others,
    )
    plane = critical | {
        "shooting_rate_Hz": critical["predicted"],
        "limit_of_voltage": [None] * len(critical["status"][0]),
    }
    figure_critical(
        field_of(found, plane), lines, critical["level"], own_marks(found, swept=True), figures / "critical"
    )
    level = apa.percent(critical["level"], 0)
    return Section(
        title=f"Critical conditions of a directional percept: {level} right",
        paragraphs=tuple(_said(critical, level)),
        pictures=(
            Picture(
                stem="critical",
                caption=(
                    f"The voltage from which {level} of the answers to a forward shot are right, over friction; "
                    f"band: {apa.percent(band['inside'], 0)} of {band['draws']:,} contours drawn from the fit "
                    "lie wholly within it; other lines: the fit under other assumed numbers, and forward and "
                    "backward shots counted alike"
                ),
                alt="A falling line of voltage over friction with its band and five other lines",
            ),
        ),
        tables=(_contour_table(found),),
    )


def _said(critical: Facts, level: str) -> Iterator[str]:
    yield (
        f"Below the line the model has fewer than {level} of the answers right; the pulse is the gun's own, "
        f"{1e3 * critical['pulse_s']:.3g} ms. The band is of the three fitted numbers alone: under other assumed "
        "numbers the line lies elsewhere, as the other lines show, each refitted to the same rates. Where forward and "
        "backward shots count alike the fitted bias towards forward does not help, and it takes more."
    )
    reached = [last for last, word in zip(critical["lasting"], critical["reached"], strict=True) if word == _AT]
    if reached and not all(reached):
        yield f"At {reached.count(False)} frictions a higher voltage of the sweep falls below {level} again."
    if (error := critical["interpolation_error_V"]) is not None:
        yield f"Band and other lines are interpolated on the grid, the line is solved: at most {error:.2g} V apart."


_AT = "at this voltage"


def _contour_table(found: Facts) -> Table:
    critical = found["critical"]
    frictions = sorted({one["friction_N"] for one in found["own"] if one["swept"]})
    rows = [
        (f"{friction:g} N", at_friction(critical, friction), *_others(critical, friction)) for friction in frictions
    ]
    names = (*(one["name"] for one in critical["alternatives"]), BOTH)
    return Table(
        caption="The contour's voltage at the frictions of the gun's own methods [band]; and under other assumptions",
        header=("Friction", "Voltage", *names),
        rows=tuple(rows),
    )


def _others(critical: Facts, friction_N: float) -> Iterator[str]:
    place = critical["friction_N"].index(friction_N) if friction_N in critical["friction_N"] else None
    for volts in (*(one["voltage_V"] for one in critical["alternatives"]), critical["both_directions_V"]):
        value = None if place is None else volts[place]
        yield apa.NONE if value is None else f"{apa.number(value, 1)} V"


def _ends(values: list[float | None], reached: list[str]) -> Any:
    """A band's end, infinite where it lies above or below the range."""
    outside = {"not within the range": np.inf, "from the lowest voltage on": -np.inf}
    return np.array([outside.get(word, np.nan) if v is None else v for v, word in zip(values, reached, strict=True)])


FRONT_ROWS = 12
FASTEST = 3.0
"""Times the bound: what is faster is in `design.json` alone."""


def sections(found: Facts, designs: Designs, figures: Path) -> tuple[Section, ...]:
    """The page's sections; their figures are written."""
    return (
        _best(found),
        _trade(found, designs, figures),
        _maps(found, figures),
        critical_section(found, figures),
        _rest(found),
    )


def _best(found: Facts) -> Section:
    rows = [("best of the sweep", *_cells(found["best"]))] if found["best"] else []
    rows += [(one["name"], *_cells(one)) for one in found["own"]]
    said = tuple(best_sentences(found["best"])) if found["best"] else (none_sentence(found),)
    return Section(
        title=f"Felt best while it shoots at {found['rate_above_Hz']:g} Hz or faster",
        paragraphs=(
            "All of this is predicted by a model that was fitted to three rates of the paper. Of the designs only the "
            "paper's own were ever felt by anyone; the intervals are the fit's alone.",
            " ".join(said),
            f"{'; '.join(swept(found))}.",
        ),
        tables=(Table(caption="The best design beside the gun's own methods", header=_HEADER, rows=tuple(rows)),),
    )


_HEADER = ("Design", "Friction", "Voltage", "Pulse", "Right about a forward shot, predicted [95 % CI]", "Highest rate")


def _cells(one: Facts) -> tuple[str, ...]:
    return (
        f"{apa.number(one['friction_N'])} N",
        f"{apa.number(one['voltage_V'], 1)} V",
        f"{apa.number(1e3 * one['pulse_s'], 1)} ms",
        share_cell(one),
        f"{apa.number(one['shooting_rate_Hz'])} Hz",
    )


def _trade(found: Facts, designs: Designs, figures: Path) -> Section:
    front = found["front"]
    known = np.isfinite(designs.predicted)
    trade = Trade(
        rate_Hz=designs.shooting_rate_Hz[known],
        predicted=designs.predicted[known],
        allowed=designs.proposable[known],
        front_rate_Hz=_column(front, "shooting_rate_Hz"),
        front=_column(front, "predicted"),
        front_low=_column(front, "ci_low"),
        front_high=_column(front, "ci_high"),
    )
    figure_trade(trade, found["rate_above_Hz"], best_mark(found), own_marks(found), figures / "trade")
    rows = tuple(_cells(one) for one in _spread(front, FASTEST * found["rate_above_Hz"]))
    return Section(
        title="The trade: felt against fast",
        paragraphs=(
            "A design is on the front if no other within the limits is both faster and felt better. More friction "
            "takes the landing's blow away and the speed with it. designs.csv has every design with its status, the "
            "limit that it breaks, its rate and its prediction.",
        ),
        pictures=(
            Picture(
                stem="trade",
                caption="Predicted share of right answers over the highest shooting rate; 95 % limits of the fit",
                alt="Cloud of designs with their Pareto front, the gun's own methods and the best design",
            ),
        ),
        tables=(Table(caption=f"From the front; all {len(front)} are in design.json", header=_HEADER[1:], rows=rows),),
    )


def _spread(front: list[Facts], fastest_Hz: float) -> list[Facts]:
    """Some designs of the front up to a rate, at about even distances in it."""
    slow_first = [one for one in front[::-1] if one["shooting_rate_Hz"] <= fastest_Hz]
    if len(slow_first) <= FRONT_ROWS:
        return slow_first
    reached = np.array([one["shooting_rate_Hz"] for one in slow_first])
    wanted = np.linspace(reached[0], reached[-1], FRONT_ROWS)
    places = {int(np.argmin(np.abs(reached - rate))) for rate in wanted}
    return [slow_first[place] for place in sorted(places)]


def _maps(found: Facts, figures: Path) -> Section:
    plane = found["map"]
    own = [mark_of(with_pulse(one, plane["pulse_s"]), one) for one in felt_methods(found, swept=True)]
    lines = (found["critical"]["level"], found["rate_above_Hz"])
    figure_maps(field_of(found, plane), lines, own, best_mark(found), figures / "maps")
    pulse = f"{1e3 * plane['pulse_s']:.3g} ms"
    return Section(
        title=f"Over friction and voltage, at the pulse of the best design ({pulse})",
        paragraphs=("Where there is no prediction the map says why: no break-away is no percept.",),
        pictures=(
            Picture(
                stem="maps",
                caption="Predicted share of right answers, and highest shooting rate; dashed: the bound",
                alt="Two coloured maps over damper friction and voltage",
            ),
        ),
    )


def _rest(found: Facts) -> Section:
    percept = found["percept"]
    facts = {"seed": found["seed"], "gun": found["gun"], **found["provenance"]}
    numbers = tuple(
        (name, apa.number(one["value"], 3), apa.interval(one["ci_low"], one["ci_high"], 3))
        for name, one in percept["fitted"].items()
    )
    return Section(
        title="What this rests on",
        paragraphs=(f"The percept is that of the {percept['route']}.{_other_route(percept)}",),
        tables=(
            Table(caption="The fitted numbers of the percept", header=("Number", "Value", "95 % CI"), rows=numbers),
            Table(
                caption="Where the numbers come from",
                header=("What", "Value"),
                rows=tuple((name, str(value)) for name, value in facts.items()),
            ),
        ),
        items=(*found["assumptions"], *percept["unknown"]),
    )


def _other_route(percept: Facts) -> str:
    """What the shot's summary would have cost; nothing where no design is felt."""
    error = {name: apa.number(100.0 * value, 1) for name, value in percept["summary_differs_in_predicted_rate"].items()}
    if not error:
        return ""
    return (
        f" From the shot's summary alone the predicted rate would differ by {error['median']} percentage points in the "
        f"median and {error['largest']} at most, since it leaves out the coil's braking before the landing."
    )


def _column(designs: list[Facts], key: str) -> Any:
    return np.array([one[key] for one in designs], dtype=np.float64)
