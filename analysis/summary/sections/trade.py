"""Speed and accuracy as sections of a report, with their tables."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.report import apa
from analysis.report.section import Picture, Section, Table
from analysis.summary.figures.trade import (
    FEWEST_A_POINT,
    TradeNames,
    draws_curve,
    draws_points,
    has_curve,
    has_points,
)
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.pictures import response_times_picture
from analysis.summary.sections.shown_trades import ShownTrade, shown_trades
from analysis.times.cells import Mean
from analysis.times.speed_accuracy import CellTrade, EZLeftOut, NoSpeedAccuracy, Parameter, SpeedAccuracy
from device.messages import first_few, how_many

_UNITS = {"drift": "1/√s", "boundary": "√s", "start": "0 to 1", "non_decision_s": "s"}


def cells_of(trade: SpeedAccuracy, names: TradeNames) -> Iterator[tuple[str, CellTrade]]:
    """Each cell under its condition's name in print, with the instruction where there are several."""
    several = len(trade.instructions) > 1
    for condition, cells in trade.methods.items():
        for instruction, cell in cells.items():
            yield names.conditions[condition] + (f", {names.instructions[instruction]}" if several else ""), cell


def trade_tables(trade: SpeedAccuracy, names: TradeNames) -> Iterator[Table]:
    """What was measured; a table without rows has nothing to say."""
    yield _accuracy(trade, names)
    yield _effects(trade, names)


def _model_tables(shown: ShownTrade, trade: SpeedAccuracy) -> Iterator[Table]:
    """What scores and models make of it."""
    yield _scores(trade, shown.names)
    yield _ez(trade, shown.names)
    if not trade.diffusion.reason:
        yield _diffusion(trade, shown)


def _accuracy(trade: SpeedAccuracy, names: TradeNames) -> Table:
    return Table(
        caption="Accuracy and response time: means over participants with 95 % intervals",
        header=("Condition", "Trials", "Correct [%]", "Mean time [s]", "Median time [s]"),
        rows=tuple(
            (
                name,
                f"{cell.n:,}",
                _mean(cell.accuracy, 1, 100.0),
                _mean(cell.mean_s, 3),
                _mean(cell.median_s, 3),
            )
            for name, cell in cells_of(trade, names)
        ),
    )


def _scores(trade: SpeedAccuracy, names: TradeNames) -> Table:
    return Table(
        caption="Scores that join speed and accuracy: means over participants with 95 % intervals, inverse efficiency "
        "(participants with a correct answer) and balanced integration (with one in every condition)",
        header=("Condition", "Participants", "IES [s]", "Participants", "BIS"),
        rows=tuple(
            (name, *_counted(cell.inverse_efficiency_s, 3), *_counted(cell.balanced_integration, 2))
            for name, cell in cells_of(trade, names)
        ),
    )


def _counted(one: Mean, digits: int) -> tuple[str, str]:
    return f"{one.people:,}", _mean(one, digits)


def _mean(one: Mean, digits: int, scale: float = 1.0) -> str:
    """`mean [low, high]`; a dash for what is undefined, and no interval from one participant."""
    if one.mean is None:
        return apa.NO_NUMBER
    mean = apa.number(scale * one.mean, digits)
    return mean if one.ci_low is None else f"{mean} {_ends(one, digits, scale)}"


def _ends(one: Mean | Parameter, digits: int, scale: float = 1.0) -> str:
    low, high = (None if end is None else scale * end for end in (one.ci_low, one.ci_high))
    return apa.interval(low, high, digits)


def _effects(trade: SpeedAccuracy, names: TradeNames) -> Table:
    return Table(
        caption="Effect of the instruction, paired by participant: mean difference with 95 % interval, not corrected "
        "for the number of pairs; positive where the first has more",
        header=("Instructions", "Condition", "Participants", "Correct [percentage points]", "Mean time [s]"),
        rows=tuple(
            (
                f"{names.instructions[one.a]} − {names.instructions[one.b]}",
                "all conditions" if one.method is None else names.conditions[one.method],
                f"{one.accuracy.people:,}",
                _mean(one.accuracy, 1, 100.0),
                _mean(one.mean_s, 3),
            )
            for one in trade.instruction_effects
            if one.accuracy.people
        ),
    )


def _ez(trade: SpeedAccuracy, names: TradeNames) -> Table:
    return Table(
        caption="EZ-diffusion by participant: means with 95 % intervals over participants",
        header=("Condition", "Participants", "Drift [1/√s]", "Boundary [√s]", "Non-decision time [s]", "Left out"),
        rows=tuple(
            (
                name,
                f"{cell.ez.drift.people:,}",
                _mean(cell.ez.drift, 2),
                _mean(cell.ez.boundary, 2),
                _mean(cell.ez.non_decision_s, 3),
                _left_out(cell.ez.left_out),
            )
            for name, cell in cells_of(trade, names)
        ),
    )


def _left_out(people: EZLeftOut) -> str:
    counts = {
        "few correct": people.few_correct,
        "equal times": people.equal_times,
        "time below 0": people.non_decision_below_0,
    }
    return ", ".join(f"{count:,} ({why})" for why, count in counts.items() if count) or "none"


def _diffusion(trade: SpeedAccuracy, shown: ShownTrade) -> Table:
    each = trade.diffusion.each.estimates if trade.diffusion.each else {}
    together = trade.diffusion.together.estimates if trade.diffusion.together else {}
    drifts, boundaries = (f"drift {one}" for one in trade.methods), (f"boundary {one}" for one in trade.instructions)
    order = (*drifts, *boundaries, "start", "non_decision_s")
    return Table(
        caption="Diffusion model by maximum likelihood: mean over participants' own fits, SD of these, and the fit of "
        "all trials together, which is biased where people differ; 95 % intervals",
        header=("Parameter", "Unit", "Participants", "Mean of own fits", "95 % CI", "SD", "Together", "95 % CI"),
        rows=tuple(
            (
                _parameter(name, shown),
                _UNITS[name.partition(" ")[0]],
                *_of_each(each.get(name), _digits(name)),
                *_of_all(together.get(name), _digits(name)),
            )
            for name in order
            if name in each or name in together
        ),
    )


def _digits(name: str) -> int:
    return 3 if name in ("start", "non_decision_s") else 2


def _of_each(one: Mean | None, digits: int) -> tuple[str, str, str, str]:
    if one is None:
        return "0", apa.NO_NUMBER, apa.NO_NUMBER, apa.NO_NUMBER
    return f"{one.people:,}", apa.number(one.mean, digits), _ends(one, digits), apa.number(one.sd, digits)


def _of_all(one: Parameter | None, digits: int) -> tuple[str, str]:
    return (apa.NO_NUMBER, apa.NO_NUMBER) if one is None else (apa.number(one.value, digits), _ends(one, digits))


def _parameter(name: str, shown: ShownTrade) -> str:
    """A parameter's name in print."""
    kind, _, of = name.partition(" ")
    if kind == "drift":
        return f"drift {shown.names.conditions[of]}"
    if kind == "boundary":
        return f"boundary {shown.names.instructions[of]}"
    return {"start": f"start (towards {shown.first})"}.get(name, "non-decision time")


TITLE = "Speed and accuracy"
DETAILS = "Speed and accuracy: scores and models"


def trade_sections(report: ReportData) -> Iterator[Section]:
    """Accuracy and times, or the sentence why there is nothing to show."""
    for shown in shown_trades(report.statistics):
        title, trade = _titled(TITLE, shown), shown.trade
        if isinstance(trade, NoSpeedAccuracy):
            yield Section(title=title, paragraphs=(trade.reason or "", *_refused(trade)))
        elif trade is not None:
            times = _times_picture(report) if not shown.of else ()
            yield Section(
                title=title,
                paragraphs=(_used(shown, trade), trade.caveats["means"], *_unpaired(trade), *_not_drawn(shown, trade)),
                pictures=(*times, *trade_pictures(shown, trade)),
                tables=tuple(table for table in trade_tables(trade, shown.names) if table.rows),
            )


def _titled(title: str, shown: ShownTrade) -> str:
    return f"{title} ({shown.of})" if shown.of else title


def _times_picture(report: ReportData) -> tuple[Picture, ...]:
    direction = report.statistics.direction
    times = None if direction is None else response_times_picture(direction)
    return (times,) if times else ()


def trade_details(report: ReportData) -> Iterator[Section]:
    """The appendix' scores and models of the same trials."""
    for shown in shown_trades(report.statistics):
        trade = shown.trade
        if isinstance(trade, SpeedAccuracy):
            caveats = trade.caveats
            yield Section(
                title=_titled(DETAILS, shown),
                paragraphs=(
                    f"Inverse efficiency score (IES): {_lower(caveats['inverse_efficiency_s'])} Balanced integration "
                    f"score (BIS): {caveats['balanced_integration']}",
                    caveats["ez"],
                    *_fitted(trade),
                ),
                tables=tuple(table for table in _model_tables(shown, trade) if table.rows),
                appendix=True,
                folded=True,
            )


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]


def _used(shown: ShownTrade, trade: SpeedAccuracy) -> str:
    """How many trials count, and whose they are."""
    used = f"{trade.n:,} of {how_many(trade.answered, 'answered trial')} have a time of the answerer's own hand"
    model = " All times are synthetic: they show the model that made them, and nothing of people."
    said = f"{used} ({how_many(trade.people, 'participant')}).{model if shown.synthetic else ''}"
    return " ".join([said, *_refused(trade)])


def _refused(trade: SpeedAccuracy | NoSpeedAccuracy) -> tuple[str, ...]:
    """How many trials are refused, and why; nothing if none is."""
    refused = "; ".join(f"{one.trials:,} because {one.why}" for one in trade.refused.values())
    return (f"Refused of {how_many(trade.answered, 'answered trial')}: {refused}.",) if refused else ()


def _unpaired(trade: SpeedAccuracy) -> tuple[str, ...]:
    """That there is no effect to tell where nobody was told two things."""
    effects = trade.instruction_effects
    if not effects or any(one.accuracy.people for one in effects):
        return ()
    return ("No participant was told two things, so no effect of an instruction is paired: compare the means below.",)


def _fitted(trade: SpeedAccuracy) -> Iterator[str]:
    """What the fits are of, and what they can tell."""
    fits, caveats = trade.diffusion, trade.caveats
    if fits.reason:
        yield f"The diffusion model was not fitted: {fits.reason}."
        return
    if fits.fitted < fits.people:
        whom = f"{fits.fitted} of the {fits.people:,} participants, evenly spaced in the order of their codes"
    else:
        whom = how_many(fits.fitted, "participant")
    left_out = fits.each.left_out if fits.each else 0
    gone = f" {left_out} of their own fits have no clear peak and are left out." if left_out else ""
    of_trials = how_many(fits.trials, "trial")
    yield f"Diffusion model by maximum likelihood, {whom}, {of_trials}.{gone} {caveats['diffusion']}"
    failed = fits.together.reason if fits.together else None
    if failed:
        yield f"All trials in one fit: {failed}."
    elif fits.fitted == 1:
        yield "With one participant both columns are the same fit; its intervals come from the likelihood alone."
    else:
        yield caveats["together"]


def trade_pictures(shown: ShownTrade, trade: SpeedAccuracy) -> tuple[Picture, ...]:
    """The two figures, as far as there is something to draw."""
    pictures = []
    panels = "; one panel an instruction" if len(trade.instructions) > 1 else ""
    curve, points = shown.stems
    if has_curve(trade):
        caption = (
            f"Conditional accuracy functions of {shown.people}{panels}: each one's trials in order of time, cut into "
            "five bins, then averaged over participants. A rising line: fast answers are guesses more often."
        )
        alt = f"Line chart of accuracy over response time. {'; '.join(_curve_words(trade, shown.names))}."
        pictures.append(Picture(stem=curve, caption=caption, alt=alt))
    if has_points(trade):
        caption = (
            f"Quantile-probability plot of {shown.people}{panels}: the 10, 30, 50, 70 and 90 % quantiles of the times "
            "of errors (empty) and correct answers (filled) over how often they are given, averaged over the "
            "participants who gave at least 5 of the kind; lines join equal quantiles."
        )
        told = "; ".join(_points_words(trade, shown.names))
        alt = f"Plot of response time quantiles over answer probabilities. {told}."
        pictures.append(Picture(stem=points, caption=caption, alt=alt))
    return tuple(pictures)


_FEW_NAMED = 6


def _not_drawn(shown: ShownTrade, trade: SpeedAccuracy) -> Iterator[str]:
    """What the two figures leave out for want of trials, or that there is no such figure for it."""
    cells = tuple(cells_of(trade, shown.names))
    curves = [f"{name} ({cell.conditional_accuracy.trials:,})" for name, cell in cells if not draws_curve(cell)]
    if curves:
        yield (
            f"No conditional accuracy function is drawn with fewer than {FEWEST_A_POINT} trials behind a point: "
            f"{first_few(curves, _FEW_NAMED)}."
        )
    kinds = []
    for k, kind in enumerate(("errors", "correct answers")):
        given = [(name, cell.quantile_probability.answers[k]) for name, cell in cells if not draws_points(cell)[k]]
        if given:
            kinds.append(f"{kind} of {first_few([f'{name} ({count:,})' for name, count in given], _FEW_NAMED)}")
    if kinds:
        yield (
            f"No time quantiles are drawn of fewer than {FEWEST_A_POINT} answers by participants with 5 of the kind: "
            f"{'; '.join(kinds)}."
        )


def _curve_words(trade: SpeedAccuracy, names: TradeNames) -> Iterator[str]:
    for name, cell in cells_of(trade, names):
        curve = cell.conditional_accuracy
        if draws_curve(cell):
            ends = [f"{apa.percent(curve.accuracy[k])} at {apa.number(curve.mean_time_s[k])} s" for k in (0, -1)]
            yield f"{name} from {ends[0]} to {ends[1]}"


def _points_words(trade: SpeedAccuracy, names: TradeNames) -> Iterator[str]:
    for name, cell in cells_of(trade, names):
        points = cell.quantile_probability
        kinds = zip(("errors", "correct answers"), points.quantiles_s, draws_points(cell), strict=True)
        medians = [f"median of {kind} {apa.number(row[2])} s" for kind, row, is_drawn in kinds if is_drawn]
        if medians:
            yield ", ".join([f"{name} {apa.percent(points.probability[1])} correct", *medians])
