"""What a threshold's plan found, as sections, with the picture of the trade."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from matplotlib.axes import Axes

from analysis.predict.threshold_plan.run import (
    ProcedurePower,
    ThresholdPower,
    ThresholdRequest,
    people_fitted,
    threshold_power,
)
from analysis.report import apa, placing
from analysis.report.figures.style import (
    drawn,
    legend_below,
    light_grid,
    method_look,
    reference_line,
)
from analysis.report.labels import labelled
from analysis.report.page import write_page
from analysis.report.section import Picture, Section, Table, origin_table
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from experiments.design.methods_section import factor_words
from experiments.record import storage

_FIGURE = "figure-thresholds"


def threshold_plan(request: ThresholdRequest, out: Path, progress: Progress) -> ThresholdPower:
    """Simulate, write `power.json`, report and figure into `out`; what was found is returned."""
    with placing.results_in(out, placing.POWER_FILE) as part, labelled({}):
        with progress("power", people_fitted(request)) as tell:
            found = threshold_power(request, tell)
        storage.write_whole(part / placing.POWER_FILE, as_json(found))
        write_page(part, f"Planned threshold: {found.title}", sections_of_plan(found, part / "figures"))
    return found


def sections_of_plan(found: ThresholdPower, figures: Path) -> tuple[Section, ...]:
    """The page's sections; the figure is written."""
    figure_procedures(found, figures / _FIGURE)
    caption = (
        "Trials against what is known of the threshold: (a) median width of the 95 % interval, (b) root mean squared "
        "error, (c) bias, the mean of the estimates less the truth, with two standard errors."
    )
    picture = Picture(stem=_FIGURE, caption=caption, alt=f"Line charts by number of trials. {' '.join(_lines(found))}")
    return (
        plan_in_short(found),
        Section(title="The trade", pictures=(picture,), tables=(procedure_table(found),)),
        Section(title="What was assumed", items=tuple(_assumed(found))),
        Section(title="Provenance", tables=(origin_table(found.provenance),)),
    )


def plan_in_short(found: ThresholdPower) -> Section:
    """Which procedure to take, by number of trials."""
    of = f"{found.question}, {factor_words(found.factor)}"
    title = f"{found.title}: threshold of {of}, {found.people} simulated people a procedure"
    return Section(title=title, items=tuple(_lines(found)))


def _lines(found: ThresholdPower) -> Iterator[str]:
    digits = _digits(found)
    for trials, best in found.best.items():
        some = {one.procedure: one for one in found.procedures if one.trials == int(trials)}
        least, rest = some.pop(best), "; ".join(_words(one, digits) for one in some.values())
        alike = [name for name, one in some.items() if _alike(least, one, found.people)]
        told = f" Not told apart from it by {found.people} people: {', '.join(alike)}." if alike else ""
        yield f"{trials} trials ({least.minutes:.0f} min): take {_words(least, digits)}.{told} Others: {rest}."


def _alike(one: ProcedurePower, other: ProcedurePower, people: int) -> bool:
    """Whether two root mean square errors are within two standard errors, each a share 1/sqrt(2 n) of itself."""
    return other.rms_error - one.rms_error < 2 * math.hypot(one.rms_error, other.rms_error) / math.sqrt(2 * people)


def _words(one: ProcedurePower, digits: int) -> str:
    error, bias = apa.number(one.rms_error, digits), apa.number(one.bias, digits)
    return f"{one.procedure} (interval {apa.number(one.width, digits)}, error {error}, bias {bias})"


def procedure_table(found: ThresholdPower) -> Table:
    """Every procedure and number of trials."""
    digits = _digits(found)
    return Table(
        caption=f"The threshold in {factor_words(found.factor)}, by procedure and trials; best: least error",
        header=(
            *("Procedure", "Trials", "Minutes", "Width of 95 % interval", "Bias", "its SE", "Root mean squared error"),
            *("Interval holds it", "None within the levels", ""),
        ),
        rows=tuple(
            (
                one.procedure,
                str(one.trials),
                apa.number(one.minutes, 1),
                *(apa.number(value, digits) for value in (one.width, one.bias, one.bias_se, one.rms_error)),
                apa.percent(one.coverage, 0),
                apa.percent(one.without, 0),
                "best" if found.best[str(one.trials)] == one.procedure else "",
            )
            for one in sorted(found.procedures, key=lambda one: one.trials)
        ),
    )


def _assumed(found: ThresholdPower) -> Iterator[str]:
    yield (
        f"People answer as the config's synthetic ones: threshold {found.threshold:g}, spread {found.spread:g} of the "
        f"logarithm, lapse rate {found.lapse:g}, guess rate {found.guess:g}; thresholds differ between people with an "
        f"SD of {found.log_threshold_sd:g} of their logarithm."
    )
    low, high = min(found.levels), max(found.levels)
    sixtieths = f"from {low:g} to {high:g} in sixtieths"
    rule = f"goes {sixtieths} and minimises the expected variance of the threshold; width and lapses are unknown"
    yield (
        f"Constant stimuli are the design's {len(found.levels)} levels, each once before one comes again. Tracks go "
        f"{sixtieths}; they begin at {high:g}, in steps of an eighth, a sixteenth and a thirtieth of the range. The "
        f"posterior rule {'is that of the design, at its levels' if found.own_rule else rule}."
    )
    yield (
        "Each run is fitted as the report fits it: cumulative normal of the level, lapse rate unknown, the same "
        "priors. The people's own curve rises with the logarithm of the level, so a small bias stays with many trials."
    )
    yield "Trials are those of one condition, without practice, catch trials and breaks."


def figure_procedures(found: ThresholdPower, path_stem: Path) -> None:
    """Width, error and bias over trials, a line a procedure; PNG, SVG and PDF are written."""
    unit = factor_words(found.factor)
    with drawn(path_stem, 9.6, 3.4) as figure:
        panels: list[Axes] = list(figure.subplots(1, 3))
        for axes, title in zip(panels, ("(a) width of interval", "(b) error", "(c) bias"), strict=True):
            light_grid(axes)
            axes.set_title(title, loc="left")
            axes.set_xlabel("trials")
            axes.set_xticks(sorted({one.trials for one in found.procedures}))
        for i, name in enumerate(dict.fromkeys(one.procedure for one in found.procedures)):
            own = [one for one in found.procedures if one.procedure == name]
            for axes, measure in zip(panels, ("width", "rms_error", "bias"), strict=True):
                axes.errorbar(
                    [one.trials for one in own],
                    [getattr(one, measure) for one in own],
                    yerr=[2 * one.bias_se for one in own] if measure == "bias" else None,
                    **method_look(i),
                    markersize=4.5,
                    capsize=2.0,
                    linewidth=1.2,
                    label=name,
                )
        for axes in panels[:2]:
            axes.set_ylim(bottom=0.0)
        reference_line(panels[2], 0.0, "")
        panels[0].set_ylabel(f"threshold in {unit}" if "in" not in unit.split() else unit)
        legend_below(figure, panels[0], 5)


def _digits(found: ThresholdPower) -> int:
    """So many decimals that the span of the levels has four figures."""
    return min(max(3 - math.floor(math.log10(max(found.levels) - min(found.levels))), 0), 9)
