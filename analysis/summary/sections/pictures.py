"""The pictures of a report with their captions, and their files."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.report import apa
from analysis.report.figures.glyphs import is_drawable
from analysis.report.figures.style import drawn_name
from analysis.report.labels import display_name
from analysis.report.section import Picture
from analysis.stats.corrections import SIGNIFICANT
from analysis.summary.figures.results import figure_8, figure_directions, has_matrix, largest_d_prime
from analysis.summary.figures.trade import (
    figure_conditional_accuracy,
    figure_quantile_probability,
    figure_response_times,
    has_curve,
    has_points,
)
from analysis.summary.results import DesignSummary, DirectionStatistics, Sensitivity, StudyStatistics, WithinStatistics
from analysis.summary.sections.content import EXPERIMENTS, ReportData, has_many
from analysis.summary.sections.shown_trades import ShownTrade, shown_trades
from analysis.times.own_trials import TimeSpread
from device.messages import first_few
from experiments.record.tables import is_rated

if TYPE_CHECKING:
    from analysis.report.figures.shot import ShotPanel

_SHOT_FIGURE, _RESULTS_FIGURE = "figure-shot", "figure-results"
_DIRECTIONS_FIGURE, _TIMES_FIGURE = "figure-directions", "figure-response-times"

_PANELS = " (a), sensitivity d′ (b) and criterion c (c)"
_ALWAYS_RIGHT = ", the absence of bias, and the d′ of somebody who is always right (log-linear correction)"
_MARKS = "* p < .05, ** p < .01, *** p < .001, n.s. not significant"


def write_figures(folder: Path, report: ReportData) -> None:
    """Every figure that has data, under the stem that its picture names; the one that takes longest first."""
    statistics, direction = report.statistics, report.statistics.direction
    if report.panels:
        from analysis.report.figures.shot import figure_5  # noqa: PLC0415 - of no use without a shot

        figure_5(report.panels, folder / _SHOT_FIGURE)
    if statistics.analysed:
        figure_8(statistics, folder / _RESULTS_FIGURE, report.rated_from)
    if direction is not None and direction.n:
        _write_direction(folder, direction)
    designs = {name: _drawable(found) for name, found in statistics.designs.items()}
    for name, one in designs.items():
        _write_design(folder, name, one)
        _write_models(folder, name, one)
    for shown in shown_trades(replace(statistics, designs=designs), drawn_name):
        _write_trade(folder, shown)
    if report.delivered:
        from analysis.summary.figures.delivered import figure_delivered  # noqa: PLC0415 - of no use without a sensor
        from analysis.summary.sections.delivered import DELIVERED_FIGURE  # noqa: PLC0415 - the same

        figure_delivered(report.delivered, folder / DELIVERED_FIGURE)


def _drawable(design: DesignSummary) -> DesignSummary:
    """A design whose levels go by their codes where no font here has the letters of their labels."""
    labels = {
        factor: {level: label for level, label in some.items() if is_drawable(label)}
        for factor, some in design.labels.items()
    }
    return replace(design, labels=labels)


def _write_design(folder: Path, name: str, design: DesignSummary) -> None:
    from analysis.summary.figures.designs import figure_design  # noqa: PLC0415 - slow, and of no use without a design

    if any(question.drawn for question in design.questions.values()):
        figure_design(design, folder / figure_of(name))


def _write_direction(folder: Path, direction: DirectionStatistics) -> None:
    figure_directions(direction, folder / _DIRECTIONS_FIGURE)
    if direction.response_times.n:
        figure_response_times(direction, folder / _TIMES_FIGURE)


def _write_trade(folder: Path, shown: ShownTrade) -> None:
    curve, points = shown.stems
    if has_curve(shown.trade):
        figure_conditional_accuracy(shown.trade, shown.names, folder / curve)
    if has_points(shown.trade):
        figure_quantile_probability(shown.trade, shown.names, folder / points)


def _write_models(folder: Path, name: str, design: DesignSummary) -> None:
    from analysis.summary.figures.functions import figure_functions  # noqa: PLC0415 - slow, and of no use without a design
    from analysis.summary.figures.pairs import figure_pairs, has_scores  # noqa: PLC0415 - the same
    from analysis.summary.figures.tracks import figure_tracks  # noqa: PLC0415 - the same

    for asked, question in design.questions.items():
        if question.thresholds is not None and question.thresholds.conditions:
            figure_functions(design, question.thresholds, folder / functions_figure_of(name, asked))
            if question.thresholds.tracks:
                figure_tracks(design, question.thresholds, folder / tracks_figure_of(name, asked))
        if question.pairs is not None and has_scores(question.pairs):
            figure_pairs(design, question.pairs, folder / pairs_figure_of(name, asked))


def figure_of(name: str) -> str:
    """The stem of a design's figure."""
    return f"figure-{name}"


def functions_figure_of(name: str, question: str) -> str:
    """The stem of the figure of a question's psychometric functions."""
    return f"figure-{name}-{question}-functions"


def tracks_figure_of(name: str, question: str) -> str:
    """The stem of the figure of a procedure's tracks."""
    return f"figure-{name}-{question}-tracks"


def pairs_figure_of(name: str, question: str) -> str:
    """The stem of the figure of a question's scores from paired comparison."""
    return f"figure-{name}-{question}-scores"


def results_picture(statistics: StudyStatistics, *, compared: bool) -> Picture:
    """Means, SDs and everybody, of the experiments that have people; `compared`: with the paper's Figure 8."""
    shown = statistics.analysed
    counts = "; ".join(f"{EXPERIMENTS[name]}, {found.people}" for name, found in shown.items())
    largest = max(found.n for found in shown.values())
    tested = any(found.tukey for found in shown.values())
    matrix = any(map(has_matrix, shown.values()))
    shown_by = "Matrix, + where the row's mean is above the column's" if matrix else "Brackets"
    brackets = f" {shown_by}: Tukey's HSD with the repeated-measures error term ({_MARKS})." if tested else ""
    opening = f"As in the paper's Figure 8: {counts}" if compared else f"{counts[:1].upper()}{counts[1:]}"
    caption = (
        f"{opening}. Bars{_SPREAD if largest > 1 else ': the values of the one participant'}. "
        f"{_crowd_words(largest)}{brackets}"
    )
    means = ". ".join(f"{EXPERIMENTS[name].capitalize()}: {_means_words(one, name)}" for name, one in shown.items())
    tests = " ".join(_tests_words(one, name) for name, one in shown.items())
    alt = f"Bar chart with one bar a rendering method and everybody's values. {means}. {tests}".strip()
    return Picture(stem=_RESULTS_FIGURE, caption=caption, alt=alt)


_SPREAD = " and whiskers: mean and SD between participants; an SD may reach beyond the scale"


def _crowd_words(largest: int) -> str:
    if largest == 1:
        return "Thin lines join them."
    if largest > 200:
        return "Beyond 200 participants their distribution is shaded instead of drawn person by person."
    return "Points: participants, each at the same place in every bar; thin lines join the values of one."


_SPELLED_OUT = 4


def _means_words(found: WithinStatistics, experiment: str) -> str:
    shown = apa.number if is_rated(experiment) else apa.percent
    told = {method: f"{display_name(method)} {shown(mean)}" for method, mean in found.means.items()}
    if not has_many(found):
        return ", ".join(told.values())
    lowest, highest = (told[end(found.methods, key=found.means.__getitem__)] for end in (min, max))
    return f"{len(told)} methods, from {lowest} to {highest}"


def _tests_words(found: WithinStatistics, experiment: str) -> str:
    if has_many(found):
        differing = sum(pair.p < SIGNIFICANT for pair in found.tukey or ())
        return f"Tukey's tests, {EXPERIMENTS[experiment]}: {differing} of {len(found.tukey or ())} pairs differ."
    pairs = "; ".join(f"{display_name(c.a)} against {display_name(c.b)} {_p_words(c.p)}" for c in found.tukey or ())
    return f"Tukey's tests, {EXPERIMENTS[experiment]}: {pairs}." if pairs else ""


def _p_words(p: float) -> str:
    return "no difference at all" if math.isnan(p) else apa.p_value(p)


def directions_picture(found: DirectionStatistics) -> Picture:
    """Correct rates by direction beside d′ and criterion."""
    sensitive = any(found.sensitivity.values())
    caption = (
        f"Correct rate on forward and backward shots{_PANELS if sensitive else ''} of {found.people}. "
        f"{_without_backward(found)}{_direction_crowd(found.n)} Dashed lines: guessing{_other_lines(found)}."
    )
    most = _SPELLED_OUT if has_many(found) else len(found.methods)
    rates = first_few([_rates_words(found, method) for method in found.methods], most, "method", apart="; ")
    what = "mean correct rates" if found.n > 1 else "correct rates"
    alt = f"Dot plot of the {what} with everybody's values and a line at chance, 50 %. {rates}."
    return Picture(stem=_DIRECTIONS_FIGURE, caption=caption, alt=alt)


def _other_lines(found: DirectionStatistics) -> str:
    """The dashed lines of d′ and criterion, as far as they are drawn."""
    if not any(found.sensitivity.values()):
        return ""
    return " and the absence of bias" if largest_d_prime(found) is None else _ALWAYS_RIGHT


def _without_backward(found: DirectionStatistics) -> str:
    """How many have backward shots by every method, where that is not everybody."""
    backward = found.backward.participants
    own = np.array([backward.column(method, found.participants.codes) for method in found.methods])
    whole = int(np.isfinite(own).all(axis=0).sum())
    return "" if whole == found.n else f"Of {whole} of them there are backward shots by every method. "


def _direction_crowd(n: int) -> str:
    if n == 1:
        return "Marks: the participant's values, which thin lines join."
    means = "Large marks and whiskers: mean and SD."
    if n > 200:
        return f"{means} Shaded: histograms over participants; in (a) forward to the left, backward to the right."
    return f"{means} Small marks: participants; thin lines join the values of one."


def _rates_words(found: DirectionStatistics, method: str) -> str:
    forward, backward = found.means[method], found.backward.means.get(method)
    rates = f"{display_name(method)} {apa.percent(forward)} forward, {apa.percent(backward)} backward"
    return rates + _sensitivity_words(found.sensitivity[method])


def _sensitivity_words(one: Sensitivity | None) -> str:
    if one is None:
        return ""
    return f", d′ {apa.number(one.d_prime.mean)}, criterion {apa.number(one.criterion.mean)}"


def response_times_picture(found: DirectionStatistics) -> Picture | None:
    """Response times, if there is a valid one."""
    times = found.response_times
    if not times.n:
        return None
    medians = " Points: medians of the participants." if 1 < len(times.participants) <= 200 else ""
    medians = " Points: the participant's medians." if len(times.participants) == 1 else medians
    caption = (
        f"Response times from the onset of the pulse, {times.n:,} valid times of {found.people}. "
        f"(a) Share of the trials answered by then. (b) By direction, n forward / backward; boxes: quartiles, "
        f"whiskers: 5 and 95 %.{medians}"
    )
    known = [(method, spread) for method, spread in times.methods.items() if spread]
    spreads = first_few([_spread_words(*one) for one in known], _SPELLED_OUT, "method", apart="; ")
    alt = f"Cumulative distributions and box plots of the response times. {spreads}."
    return Picture(stem=_TIMES_FIGURE, caption=caption, alt=alt)


def _spread_words(method: str, spread: TimeSpread) -> str:
    low, median, high = (apa.number(spread.percentiles[at]) for at in (25, 50, 75))
    return f"{display_name(method)} median {median} s, quartiles {low} and {high} s"


def shot_picture(panels: tuple[ShotPanel, ...], *, compared: bool) -> Picture:
    """One shot's course; `compared`: with the paper's Figure 5."""
    as_there = ", as in the paper's Figure 5" if compared else ""
    caption = (
        "Force on the hand F (positive in the direction of recoil), displacement x, velocity dx/dt and drive u of one "
        f"simulated shot{as_there}. Dashed lines and circles: ends of the stages. Arrow: estimated force of the "
        "collision with the rear stop, apart from F."
    )
    columns = [f"column {chr(ord('a') + i)}, " if len(panels) > 1 else "" for i in range(len(panels))]
    landings = "; ".join(
        f"{column}{panel.title}: {_landing_words(panel)}" for column, panel in zip(columns, panels, strict=True)
    )
    alt = f"Line charts of F, x, dx/dt and u over time, one column a friction. {landings}."
    return Picture(stem=_SHOT_FIGURE, caption=caption, alt=alt)


def _landing_words(panel: ShotPanel) -> str:
    peaks = f"F up to {apa.number(float(panel.force_N.max()), 1)} N, x up to "
    peaks += f"{apa.number(float(panel.displacement_m.max()) * 1e3, 1)} mm"
    if not panel.collision_force_N >= 0.0:
        return f"{peaks}, no landing"
    return f"{peaks}, collision with {apa.number(panel.collision_force_N, 1 if panel.collision_force_N >= 1 else 2)} N"
