"""The report's section on the critical conditions: the contour's figure, its table, what it is and is not."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from analysis.predict.design_search.maps import Lines, figure_critical
from analysis.predict.design_search.marks import field_of, own_marks
from analysis.predict.design_search.words import at_friction
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
