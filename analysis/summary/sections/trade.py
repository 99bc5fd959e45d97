"""Speed and accuracy as a section of a report: what was used or refused, the caveats, and the two figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from analysis.report import apa
from analysis.report.figures.names import people
from analysis.report.section import Picture, Section
from analysis.summary.figures.trade import has_curve, has_points
from analysis.summary.sections.trade_tables import cells_of, trade_tables

Statistics = Mapping[str, Any]

TITLE = "Speed and accuracy"
CONDITIONAL_ACCURACY, QUANTILE_PROBABILITY = "figure-conditional-accuracy", "figure-quantile-probability"


def trade_section(found: Statistics) -> Section | None:
    """The section, or the sentence why there is nothing to show; `found` is `direction` of `statistics.json`."""
    trade = found.get("speed_accuracy")
    if trade is None:
        return None
    if trade["reason"]:
        return Section(title=TITLE, paragraphs=(trade["reason"], *_refused(trade)))
    caveats = trade["caveats"]
    return Section(
        title=TITLE,
        paragraphs=(
            _used(found, trade),
            f"{caveats['means']} Inverse efficiency score (IES): {_lower(caveats['inverse_efficiency_s'])} Balanced "
            f"integration score (BIS): {caveats['balanced_integration']}",
            *_unpaired(trade),
            caveats["ez"],
            *_fitted(trade),
        ),
        pictures=trade_pictures(found),
        tables=tuple(table for table in trade_tables(trade) if table.rows),
    )


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]


def _used(found: Statistics, trade: Statistics) -> str:
    """How many trials count, and whose they are."""
    used = f"{trade['n']:,} of {trade['answered']:,} answered trials have a time of the answerer's own hand"
    synthetic = set(found.get("origin", {}).get("answers", ())) == {"synthetic"}
    model = " All times are synthetic: they show the observer's model, and nothing of people." if synthetic else ""
    return " ".join([f"{used} ({_count(trade['people'])}).{model}", *_refused(trade)])


def _refused(trade: Statistics) -> tuple[str, ...]:
    """How many trials are refused, and why; nothing if none is."""
    refused = "; ".join(f"{one['trials']:,} because {one['why']}" for one in trade["refused"].values())
    return (f"Refused of {trade['answered']:,} answered trials: {refused}.",) if refused else ()


def _unpaired(trade: Statistics) -> tuple[str, ...]:
    """That there is no effect to tell where nobody was told two things."""
    effects = trade["instruction_effects"]
    if not effects or any(one["accuracy"]["people"] for one in effects):
        return ()
    return ("No participant was told two things, so no effect of an instruction is paired: compare the means below.",)


def _count(number: int) -> str:
    return f"{number:,} participant{'' if number == 1 else 's'}"


def _fitted(trade: Statistics) -> Iterator[str]:
    """What the fits are of, and what they can tell."""
    fits, caveats = trade["diffusion"], trade["caveats"]
    if fits["reason"]:
        yield f"The diffusion model was not fitted: {fits['reason']}."
        return
    if fits["fitted"] < fits["people"]:
        whom = f"{fits['fitted']} of the {fits['people']:,} participants, evenly spaced in the order of their codes"
    else:
        whom = _count(fits["fitted"])
    left_out = fits["each"]["left_out"]
    gone = f" {left_out} of their own fits have no clear peak and are left out." if left_out else ""
    yield f"Diffusion model by maximum likelihood, {whom}, {fits['trials']:,} trials.{gone} {caveats['diffusion']}"
    failed = fits["together"]["reason"]
    if failed:
        yield f"All trials in one fit: {failed}."
    elif fits["fitted"] == 1:
        yield "With one participant both columns are the same fit; its intervals come from the likelihood alone."
    else:
        yield caveats["together"]


def trade_pictures(found: Statistics) -> tuple[Picture, ...]:
    """The two figures, as far as there is something to draw."""
    pictures = []
    panels = "; one panel an instruction" if len(found["speed_accuracy"]["instructions"]) > 1 else ""
    if has_curve(found):
        caption = (
            f"Conditional accuracy functions of {people(found)}{panels}: each one's trials in order of time, cut into "
            "five bins, then averaged over participants. A rising line: fast answers are guesses more often."
        )
        alt = f"Line chart of accuracy over response time. {'; '.join(_curve_words(found))}."
        pictures.append(Picture(stem=CONDITIONAL_ACCURACY, caption=caption, alt=alt))
    if has_points(found):
        caption = (
            f"Quantile-probability plot of {people(found)}{panels}: the 10, 30, 50, 70 and 90 % quantiles of the times "
            "of errors (empty) and correct answers (filled) over how often they are given, averaged over the "
            "participants who gave at least 5 of the kind; lines join equal quantiles."
        )
        alt = f"Plot of response time quantiles over answer probabilities. {'; '.join(_points_words(found))}."
        pictures.append(Picture(stem=QUANTILE_PROBABILITY, caption=caption, alt=alt))
    return tuple(pictures)


def _curve_words(found: Statistics) -> Iterator[str]:
    for name, cell in cells_of(found["speed_accuracy"]):
        curve = cell["conditional_accuracy"]
        if curve["people"]:
            ends = [f"{apa.percent(curve['accuracy'][k])} at {apa.number(curve['mean_time_s'][k])} s" for k in (0, -1)]
            yield f"{name} from {ends[0]} to {ends[1]}"


def _points_words(found: Statistics) -> Iterator[str]:
    for name, cell in cells_of(found["speed_accuracy"]):
        points = cell["quantile_probability"]
        kinds = zip(("errors", "correct answers"), points["quantiles_s"], points["people"], strict=True)
        medians = [f"median of {kind} {apa.number(row[2])} s" for kind, row, count in kinds if count]
        yield ", ".join([f"{name} {apa.percent(points['probability'][1])} correct", *medians])
