"""The report page of `recoil design`: the best design, the trade, the maps, the critical contour, what it rests on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from analysis.predict.design_search.choice import Designs
from analysis.predict.design_search.critical_page import critical_section
from analysis.predict.design_search.figures import Trade, figure_trade
from analysis.predict.design_search.maps import figure_maps
from analysis.predict.design_search.marks import best_mark, felt_methods, field_of, mark_of, own_marks, with_pulse
from analysis.predict.design_search.words import best_sentences, none_sentence, share_cell, swept
from analysis.report import apa
from analysis.report.section import Picture, Section, Table

Facts = dict[str, Any]

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
