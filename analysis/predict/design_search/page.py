"""The report page of `recoil design`: the best design, the trade, the maps, the critical conditions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.predict.design_search.choice import ABOVE, BELOW, REACHED, Designs
from analysis.predict.design_search.figures import BOTH, figure_critical, figure_maps, figure_trade, shown_up_to_Hz
from analysis.predict.design_search.results import (
    BestDesign,
    Critical,
    DesignSearch,
    DrivePrediction,
    PerceptBehind,
    SweptDesign,
)
from analysis.report import apa
from analysis.report.section import Picture, Section, Table, origin_table


def critical_section(found: DesignSearch, figures: Path) -> Section:
    """The section; its figure is written."""
    critical, band = found.critical, found.critical.band
    figure_critical(found, figures / "critical")
    level = apa.percent(critical.level, 0)
    return Section(
        title=f"Critical conditions of a directional percept: {level} right",
        paragraphs=tuple(_said(critical, level)),
        pictures=(
            Picture(
                stem="critical",
                caption=(
                    f"The voltage from which {level} of the answers to a forward shot are right, over friction; "
                    f"band: {apa.percent(band.inside, 0)} of {band.draws:,} contours drawn from the fit "
                    "lie wholly within it; other lines: the fit under other assumed numbers, and forward and "
                    "backward shots counted alike"
                ),
                alt="A falling line of voltage over friction with its band, and the lines under other assumptions",
            ),
        ),
        tables=(_contour_table(found),),
    )


def _said(critical: Critical, level: str) -> Iterator[str]:
    yield (
        f"Below the line the model has fewer than {level} of the answers right; the pulse is the gun's own, "
        f"{_ms(critical.pulse_s)}. The band is of the three fitted numbers alone: under other assumed "
        "numbers the line lies elsewhere, as the other lines show, each refitted to the same rates. Where forward and "
        "backward shots count alike the fitted bias towards forward does not help, and it takes more."
    )
    reached = [last for last, word in zip(critical.lasting, critical.reached, strict=True) if word == REACHED]
    if reached and not all(reached):
        yield f"At {reached.count(False)} frictions a higher voltage of the sweep falls below {level} again."
    if critical.interpolation_error_V is not None:
        yield f"Band and other lines are interpolated on the grid, the line is solved: {_apart(critical)}."


def _apart(critical: Critical) -> str:
    return f"at most {critical.interpolation_error_V:.2g} V apart"


_SEEN_V = 0.05
"""Voltages are shown to a tenth."""


def _contour_table(found: DesignSearch) -> Table:
    critical = found.critical
    frictions = sorted({one.friction_N for one in found.own if one.swept})
    rows = [
        (f"{friction:g} N", _at_friction(critical, friction), *_others(critical, friction)) for friction in frictions
    ]
    names = (*(one.name for one in critical.alternatives), BOTH)
    return Table(
        caption="The contour's voltage at the frictions of the gun's own methods [band]; and under other assumptions",
        header=("Friction", "Voltage", *names),
        rows=tuple(rows),
    )


def _others(critical: Critical, friction_N: float) -> Iterator[str]:
    place = critical.friction_N.index(friction_N) if friction_N in critical.friction_N else None
    for volts in (*(one.voltage_V for one in critical.alternatives), critical.both_directions_V):
        known = place is not None and np.isfinite(volts[place])
        yield f"{apa.number(float(volts[place]), 1)} V" if known else apa.NO_NUMBER


FRONT_ROWS = 12

STATUS_WORDS = {
    "no-break-away": "do not move the magnet (no percept)",
    "stuck": "stick",
    "not-home": "are not home within the model's horizon",
}


def sections(found: DesignSearch, designs: Designs, figures: Path) -> tuple[Section, ...]:
    """The page's sections; their figures are written."""
    return (
        replace(in_short(found), title="In short"),
        _best(found),
        _trade(found, designs, figures),
        _maps(found, figures),
        critical_section(found, figures),
        _rest(found),
    )


def in_short(found: DesignSearch) -> Section:
    """What a reader looks for, in a few lines."""
    return Section(title=f"Design search: {found.title}", items=tuple(_lines(found)))


def _lines(found: DesignSearch) -> Iterator[str]:
    yield "Predictions of a model fitted to three rates; only the paper's own designs were ever felt."
    yield from _swept(found)
    if found.best is not None:
        yield f"Best at {found.rate_above_Hz:g} Hz or faster: {', '.join(_cells(found.best))} at most."
        yield from _best_sentences(found.best)
    else:
        yield _none_sentence(found)
    for one in found.own:
        yield f"{one.name}: {', '.join(_cells(one))} at most."
    critical = found.critical
    right = f"{apa.percent(critical.level, 0)} are right, at a pulse of {_ms(critical.pulse_s)}"
    for one in (own for own in found.own if own.swept):
        yield f"{right}: {_at_friction(critical, one.friction_N, 'from ')} at {one.friction_N:g} N ({one.name})."
    if (critical.interpolation_error_V or 0.0) >= _SEEN_V:
        yield f"Bands are interpolated on the grid, voltages are solved: {_apart(critical)}; less with more of --grid."


def _best(found: DesignSearch) -> Section:
    rows = [] if found.best is None else [("best of the sweep", *_cells(found.best))]
    rows += [(one.name, *_cells(one)) for one in found.own]
    said = (_none_sentence(found),) if found.best is None else tuple(_best_sentences(found.best))
    return Section(
        title=f"Felt best while it shoots at {found.rate_above_Hz:g} Hz or faster",
        paragraphs=(
            "All of this is predicted by a model that was fitted to three rates of the paper. Of the designs only the "
            "paper's own were ever felt by anyone; the intervals are the fit's alone.",
            " ".join(said),
            f"{'; '.join(_swept(found))}.",
        ),
        tables=(Table(caption="The best design beside the gun's own methods", header=_HEADER, rows=tuple(rows)),),
    )


def _swept(found: DesignSearch) -> Iterator[str]:
    """What was looked at, and what of it is not proposed."""
    axes, counts = found.axes, found.designs
    yield (
        f"{counts.total:,} designs: friction {axes.friction_N[0]:.3g} to {axes.friction_N[-1]:.3g} N, "
        f"voltage {axes.voltage_V[0]:.3g} to {axes.voltage_V[-1]:.3g} V, "
        f"pulse {1e3 * axes.pulse_s[0]:.3g} to {_ms(axes.pulse_s[-1])}"
    )
    for status, words in STATUS_WORDS.items():
        if count := counts.by_status.get(status):
            yield f"{count:,} {words}"
    if counts.beyond_limits:
        parts = ", ".join(f"{words} ({count:,})" for words, count in counts.beyond_limits.items())
        yield f"beyond the device's limits at {found.rate_above_Hz:g} Hz, so not proposed: {parts}"


def _best_sentences(best: BestDesign) -> Iterator[str]:
    """How far the best design hangs on what is assumed, and on where the sweep ends."""
    shares = [share for share in best.under_other_assumptions.values() if np.isfinite(share)]
    if shares:
        ends = f"{apa.number(100.0 * min(shares), 1)} to {apa.percent(max(shares))}"
        yield f"Under other assumed exponents and leaks the best design is predicted at {ends}."
    names = {"friction_N": "friction", "voltage_V": "voltage", "pulse_s": "pulse"}
    if best.at_an_end_of:
        words = " and ".join(names[key] for key in best.at_an_end_of)
        yield f"It lies at the end of the sweep in {words}: what is beyond is not known."


def _none_sentence(found: DesignSearch) -> str:
    """Said where no design may be proposed."""
    return (
        f"No design of this sweep can be proposed: none both keeps the device's limits and shoots at "
        f"{found.rate_above_Hz:g} Hz. Lower --rate-above or widen the ranges."
    )


def _share_cell(one: DrivePrediction) -> str:
    """A predicted share with its limits, in percent, or why there is none."""
    if one.predicted is None:
        return f"no prediction: {one.status}"
    if one.ci_low is None or one.ci_high is None:
        return apa.percent(one.predicted)
    return f"{apa.percent(one.predicted)} {apa.interval(100.0 * one.ci_low, 100.0 * one.ci_high, 1)}"


def _at_friction(critical: Critical, friction_N: float, before: str = "") -> str:
    """The contour's voltage at a friction, with its band and what stands before it, or why there is none."""
    if friction_N not in critical.friction_N:
        return "outside the swept frictions"
    place = critical.friction_N.index(friction_N)
    voltage_V, band = float(critical.voltage_V[place]), critical.band
    if not np.isfinite(voltage_V):
        return critical.reached[place]
    low, high = _end(band.low_V[place], band.reached_low[place]), _end(band.high_V[place], band.reached_high[place])
    return f"{before}{apa.number(voltage_V, 1)} V [{low}, {high}]"


def _end(voltage_V: float, reached: str) -> str:
    words = {REACHED: apa.number(float(voltage_V), 1), ABOVE: "above the range", BELOW: "below the range"}
    return words.get(reached, "unknown")


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"


_HEADER = ("Design", "Friction", "Voltage", "Pulse", "Right about a forward shot, predicted [95 % CI]", "Highest rate")


def _cells(one: DrivePrediction) -> tuple[str, ...]:
    return (
        f"{apa.number(one.friction_N)} N",
        f"{apa.number(one.voltage_V, 1)} V",
        f"{apa.number(1e3 * one.pulse_s, 1)} ms",
        _share_cell(one),
        f"{apa.number(one.shooting_rate_Hz)} Hz",
    )


def _trade(found: DesignSearch, designs: Designs, figures: Path) -> Section:
    front = found.front
    figure_trade(found, designs, figures / "trade")
    fastest_Hz = shown_up_to_Hz(found)
    rows = tuple(_cells(one) for one in _spread(front, fastest_Hz))
    beyond = any(one.shooting_rate_Hz > fastest_Hz for one in front)
    up_to = f" up to {apa.number(fastest_Hz)} Hz" if beyond else ""
    level = apa.percent(found.critical.level, 0)
    faster = f" Shown is what shoots at{up_to}: what is faster on the front is predicted below {level}."
    return Section(
        title="The trade: felt against fast",
        paragraphs=(
            "A design is on the front if no other within the limits is both faster and felt better. More friction "
            "takes the landing's blow away and the speed with it. designs.csv has every design with its status, the "
            f"limit that it breaks, its rate and its prediction.{faster if beyond else ''}",
        ),
        pictures=(
            Picture(
                stem="trade",
                caption=f"Predicted share of right answers over the highest rate{up_to}; band: 95 % limits of the fit",
                alt="Cloud of designs with their Pareto front, the gun's own methods and the best design",
            ),
        ),
        tables=(
            Table(caption=f"From the front{up_to}; all {len(front)} are in design.json", header=_HEADER[1:], rows=rows),
        ),
    )


def _spread(front: Sequence[SweptDesign], fastest_Hz: float) -> list[SweptDesign]:
    """Some designs of the front up to a rate, at about even distances in it."""
    slow_first = [one for one in front[::-1] if one.shooting_rate_Hz <= fastest_Hz]
    if len(slow_first) <= FRONT_ROWS:
        return slow_first
    reached = np.array([one.shooting_rate_Hz for one in slow_first])
    wanted = np.linspace(reached[0], reached[-1], FRONT_ROWS)
    places = {int(np.argmin(np.abs(reached - rate))) for rate in wanted}
    return [slow_first[place] for place in sorted(places)]


def _maps(found: DesignSearch, figures: Path) -> Section:
    figure_maps(found, figures / "maps")
    return Section(
        title=f"Over friction and voltage, at the pulse of the best design ({_ms(found.map.pulse_s)})",
        paragraphs=("Where there is no prediction the map says why: no break-away is no percept.",),
        pictures=(
            Picture(
                stem="maps",
                caption="Predicted share of right answers, and highest shooting rate; dashed: the bound",
                alt="Two coloured maps over damper friction and voltage",
            ),
        ),
    )


def _rest(found: DesignSearch) -> Section:
    percept = found.percept
    facts = {"seed": found.seed, "gun": found.gun, **found.provenance}
    numbers = tuple(
        (name, apa.number(one.value, 3), apa.interval(one.ci_low, one.ci_high, 3))
        for name, one in percept.fitted.items()
    )
    return Section(
        title="What this rests on",
        paragraphs=(f"The percept is that of the {percept.route}.{_other_route(percept)}",),
        tables=(
            Table(caption="The fitted numbers of the percept", header=("Number", "Value", "95 % CI"), rows=numbers),
            origin_table(facts),
        ),
        items=(*found.assumptions, *percept.unknown),
    )


def _other_route(percept: PerceptBehind) -> str:
    """What the shot's summary would have cost; nothing where no design is felt."""
    error = {name: apa.number(100.0 * value, 1) for name, value in percept.summary_differs_in_predicted_rate.items()}
    if not error:
        return ""
    return (
        f" From the shot's summary alone the predicted rate would differ by {error['median']} percentage points in the "
        f"median and {error['largest']} at most, since it leaves out the coil's braking before the landing."
    )
