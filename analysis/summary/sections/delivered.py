"""Was it delivered? By run and method: marks, how the level lay beside the model's, and how far it drifted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from analysis.report.labels import display_name
from analysis.report.section import Picture, Section, Table
from analysis.summary.delivered import DeliveredCourse, drift
from analysis.summary.figures.delivered import MOST_RUN_PANELS
from analysis.summary.sections.content import ReportData
from experiments.delivered.marks import START_SHOTS

DELIVERED_FIGURE = "figure-delivered"
_HEADER = (
    *("Participant", "Experiment", "Method", "Shots", "Not delivered", "Not measured"),
    *("Peak, % of model", "its drift", "Friction, % of model", "its drift"),
)


def delivered_section(report: ReportData) -> Iterator[Section]:
    """What a sensor beside the gun said, where there was one."""
    courses = report.delivered
    if not courses:
        return
    shots = sum(len(one.marks) for one in courses)
    bad, unknown = sum(one.undelivered for one in courses), sum(one.unmeasured for one in courses)
    said = (
        f"Of {shots:,} shots that were fired while a sensor was on the gun, it measured {shots - unknown:,}; {bad:,} "
        "of them were not delivered as the model of their method says, and are marked. No trial is left out for that; "
        "a rule may do so (flag not-delivered)."
    )
    rows = tuple(tuple(_row(one)) for one in courses)
    table = Table(
        caption="Shots as they were delivered; drift from the first shot to the last, ± SE", header=_HEADER, rows=rows
    )
    paragraphs = (said, *_start_unknown(courses))
    yield Section(title="Was it delivered?", paragraphs=paragraphs, pictures=(_picture(courses),), tables=(table,))


def _start_unknown(courses: Sequence[DeliveredCourse]) -> Iterator[str]:
    """Where a slip from the first shot on would not have been seen."""
    hidden = [one for one in courses if one.start_unknown]
    if hidden:
        named = "; ".join(
            f"{one.participant}, {one.experiment}, {display_name(one.method)} "
            f"({one.known_frictions} of {len(one.marks)} shots)"
            for one in hidden
        )
        yield (
            f"A damper that had slipped by 10 % before a method's first shot could not be told in: {named}. For that "
            f"{START_SHOTS} shots are needed whose friction is known. Compare the levels below."
        )


def _row(one: DeliveredCourse) -> Iterator[str]:
    yield from (one.participant, one.experiment, display_name(one.method))
    yield from (f"{len(one.marks)}", f"{one.undelivered}", f"{one.unmeasured}")
    for parts in (one.peaks, one.frictions):
        known = [part for part in parts if math.isfinite(part)]
        change, error = drift(parts)
        yield f"{100 * float(np.mean(known)):.1f}" if known else "–"
        yield "–" if math.isnan(change) else f"{100 * change:+.1f} ± {100 * error:.1f}"


def _picture(courses: Sequence[DeliveredCourse]) -> Picture:
    runs = len({(one.participant, one.experiment) for one in courses})
    some = f" Of {runs} runs the first {MOST_RUN_PANELS} are drawn." if runs > MOST_RUN_PANELS else ""
    caption = (
        "Peak (filled) and friction of the magnet (open) of each shot, in % of what the model expects, over the shots "
        f"of a run; a ring: not delivered as it should be.{some}"
    )
    worst = max(courses, key=lambda one: one.undelivered)
    most = f"{worst.participant}, {display_name(worst.method)}, {worst.undelivered}"
    alt = f"Dot plots over shots, a panel a run. Most marks: {most}."
    return Picture(stem=DELIVERED_FIGURE, caption=caption, alt=alt)
