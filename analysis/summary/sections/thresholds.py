"""Psychometric functions in a report: what was fitted, the group's thresholds, differences, and everybody's own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from analysis.psychometric.fit import Credible
from analysis.psychometric.people import FEWEST_ANSWERS, GroupFit, PersonFit
from analysis.report import apa
from analysis.report.labels import display_name
from analysis.report.section import LISTED, SHOWN, Picture, Section, Table
from analysis.summary.figures.functions import MOST_PANELS, caught_of
from analysis.summary.figures.tracks import MOST_TRACK_PANELS
from analysis.summary.question_results import QuestionSummary
from analysis.summary.results import DesignSummary
from analysis.summary.sections.pictures import functions_figure_of, tracks_figure_of
from analysis.summary.thresholds import ConditionFit, Thresholds
from device.messages import first_few, how_many
from experiments.design.language import Level, shown_level
from experiments.design.methods_section import factor_words

_SHARES = {"right": "right answers", "yes": "yes", "chosen": "choices of the level over the standard"}
_SUCCESS = {"right": "right", "yes": "yes", "chosen": "chosen over the standard"}
_TOLD = 4
"""So many conditions are told in a sentence; more are in the table."""


def threshold_sections(name: str, found: DesignSummary) -> Iterator[Section]:
    """A section for each question that has psychometric functions."""
    for asked, question in found.questions.items():
        if question.thresholds is not None:
            yield _section(name, asked, found, question.thresholds)


def threshold_sentences(found: DesignSummary, question: QuestionSummary) -> Iterator[str]:
    """The group's threshold in each condition, in a sentence; why there is none."""
    of = question.thresholds
    if of is None:
        return
    if of.reason:
        yield f"No psychometric function: {of.reason}."
    told = [one for one in of.conditions if one.group is not None]
    if told:
        said = [f"{_condition(found, one.levels)}{_group_words(of, one)}" for one in told]
        shown = first_few(said, _TOLD, "condition", apart="; ")
        over = "people" if of.fitted == of.people else f"{of.fitted:,} of {of.people:,} people"
        interval = " with its 95 % credible interval" if any(map(_has_threshold, told[:_TOLD])) else ""
        yield f"{_measure(of).capitalize()} in {factor_words(of.factor)}, mean over {over}{interval}: {shown}."


def _group_words(of: Thresholds, one: ConditionFit) -> str:
    if one.group is None:
        return ""
    if not _has_threshold(one):
        return "nobody has one within the levels"
    digits, threshold = _digits(of), one.group.threshold
    jnd = (
        f"JND {_number(one.group.jnd.median, digits)}"
        if of.told_from is None
        else _noticed(of.told_from, threshold, digits)
    )
    some = f" (of {one.group.people} of {len(one.people)} people)" if one.group.people < len(one.people) else ""
    return f"{_number(threshold.median, digits)} {_ends(threshold, digits)}, {jnd}{some}"


def _noticed(standard: float, threshold: Credible, digits: int | None) -> str:
    """How far a threshold is from the standard, and the Weber fraction: what others call the JND of such trials."""
    way, sign = ("below", -1.0) if threshold.median < standard else ("above", 1.0)
    far, *ends = (_number(sign * (end - standard), digits) for end in (threshold.median, threshold.low, threshold.high))
    weber = f" (Weber fraction {apa.number(abs(threshold.median / standard - 1.0))})" if standard > 0 else ""
    return f"{far} [{', '.join(ends[:: int(sign)])}] {way} the standard of {shown_level(standard)}{weber}"


def _has_threshold(one: ConditionFit) -> bool:
    """Whether the group's mean rests on anybody's threshold, and not on the prior alone."""
    return one.group is not None and one.group.without < one.group.people


def _spread(of: Thresholds) -> str:
    """What half the distance between the quarters is called: no JND where levels were told from a standard."""
    return "JND" if of.told_from is None else "Spread"


def _measure(of: Thresholds) -> str:
    return "point of subjective equality" if of.share == "chosen" else "threshold"


def _section(name: str, asked: str, found: DesignSummary, of: Thresholds) -> Section:
    title = f"{(found.title or name.capitalize()).rstrip('.?!')}: psychometric functions of {asked}"
    if of.reason:
        return Section(title=title, paragraphs=(f"None was fitted: {of.reason}.",))
    return Section(
        title=title,
        paragraphs=(_what(of), *(words for part in _REMARKS for words in part(of))),
        pictures=(_picture(name, asked, found, of), *_picture_of_tracks(name, asked, found, of)),
        tables=tuple(_tables(asked, found, of)),
    )


def _what(of: Thresholds) -> str:
    way = "falls" if of.falling else "rises"
    guess = (
        f"guess rate {apa.number(of.guess)}, one in so many answers"
        if of.guess is not None
        else "guess rate fitted, with the answers to catch trials where there were some"
    )
    halfway = "the level that is chosen as often as the standard, but for guesses and lapses"
    if of.share != "chosen":
        right = "" if of.guess is None else f", {apa.percent((1 + of.guess) / 2, 0)} where nobody lapses"
        halfway = f"the level halfway between guess and lapse rate{right}"
    noticed = "" if of.told_from is None else "; what is just noticed is how far the threshold is from the standard"
    return (
        f"The share of {_SHARES[of.share]} {way} with {factor_words(of.factor)} as a cumulative normal, fitted person "
        f"by person on a grid of threshold, width and rates ({guess}; lapse rate fitted; {_PRIORS[of.own_priors]}). "
        f"{_measure(of).capitalize()}: {halfway}. {_spread(of)}: half the distance between the levels at a quarter and "
        f"three quarters of the way{noticed}. Numbers are medians with 95 % credible intervals; the means over people "
        "and the pooled values draw people towards each other, the more the less their own answers tell."
    )


def _in_one_order(of: Thresholds) -> Iterator[str]:
    if of.standard_interval != "random" and isinstance(of.standard, float):
        yield (
            f"The standard was always in the {of.standard_interval} interval, so the {_measure(of)} holds what the "
            "order does to a comparison (the time-order error) and any lean to an answer: a distance from the standard "
            "is not of the levels alone."
        )


def _of_a_walk(of: Thresholds) -> Iterator[str]:
    """What a fit of an up-down track rests on; a posterior procedure has priors of its own."""
    if of.tracks and not of.own_priors:
        yield (
            "A staircase chose the levels: nearly all trials are at the threshold and tell little of width and lapse "
            "rate, so that the priors of these decide, and thresholds of few trials are biased. `recoil power` of this "
            "design says by how much."
        )


_PRIORS = {
    False: "priors of psignifit 4",
    True: "priors of width and lapse rate those of the design's procedure, of the threshold psignifit 4's",
}


def _who(of: Thresholds) -> Iterator[str]:
    if of.fitted < of.people:
        yield (
            f"Fitted were {of.fitted:,} of {of.people:,} people, evenly spaced in the order of their codes; "
            "`recoil analyze --fits` fits everybody. The points of the group are of all people."
        )
    if of.even:
        yield f"{how_many(of.even, 'trial')} had the same level in both intervals, and tell nothing of a choice."


def _without(of: Thresholds) -> Iterator[str]:
    people = [one for condition in of.conditions for one in condition.people]
    unfitted = sum(one.fit is None for one in people)
    lacking = sum(one.reason is not None for one in people) - unfitted
    if lacking:
        yield (
            f"{lacking} of {len(people)} fits found no threshold within the levels: their numbers rest on the prior, "
            "are no measurement, and count in the group by how little they say. The table tells which."
        )
    if beyond := sum(bool(one.beyond) for one in people):
        lie = "threshold lies" if beyond == 1 else "thresholds lie"
        yield (
            f"{beyond} of {len(people)} {lie} beyond every level that was presented: drawn on from there, as the "
            "priors have it. The table tells which."
        )
    if unfitted:
        yield f"{unfitted} of {len(people)} had too few answers for a fit: below {FEWEST_ANSWERS}, or at one level."


def _below_zero(of: Thresholds) -> Iterator[str]:
    """What an interval says that reaches below 0 though every level is above."""
    if min(point.level for one in of.conditions for point in one.points) <= 0:
        return
    fits = [one.fit for condition in of.conditions for one in condition.people if one.fit is not None]
    below = sum(fit.threshold.low < 0 for fit in fits)
    below += sum(one.group is not None and one.group.threshold.low < 0 for one in of.conditions)
    if below:
        yield (
            f"{below} interval{'s' * (below > 1)} of the {_measure(of)} reach{'es' * (below == 1)} below 0, where no "
            "level is: the answers do not tell the lower end there, the prior does, which begins half the levels' span "
            "below the lowest. More trials at low levels would tell."
        )


def _at_edge(of: Thresholds) -> Iterator[str]:
    """What tracks say that came to the end of the levels."""
    if of.at_edge:
        trials = sum(len(track.levels) for track in of.tracks)
        yield (
            f"{of.at_edge:,} of {how_many(trials, 'trial')} had a level at an end of those that there were, beyond "
            "which the procedure may have gone (flag at-edge): if that is often, the levels end too soon."
        )


_REMARKS: tuple[Callable[[Thresholds], Iterator[str]], ...] = (
    _in_one_order,
    _who,
    _without,
    _below_zero,
    _at_edge,
    _of_a_walk,
)
"""What is to be said of some functions, in this order; most has nothing to say."""


def _picture(name: str, asked: str, found: DesignSummary, of: Thresholds) -> Picture:
    people = list(dict.fromkeys(one.participant for condition in of.conditions for one in condition.people))
    more = len(people) - MOST_PANELS
    rest = f" {more:,} more people have no panel; their numbers are in the table." if more > 0 else ""
    alarms = [
        f"{_condition(found, one.levels)}{apa.percent(caught[0] / caught[1])}"
        for one in of.conditions[:_TOLD]
        if (caught := caught_of(one.people)) is not None
    ]
    unknown = "Hollow, in one size, at none: false alarms in catch trials" if alarms else ""
    chosen = of.share == "chosen" and isinstance(of.standard, float)
    line = "Dashed: the standard" if chosen else "Dashed: chance" if of.guess is not None else unknown
    group = "first all people with the mean of their curves, then " if len(people) > 1 else ""
    aside = ", those of one level side by side" if len(of.conditions) > 1 else ""
    caption = (
        f"{found.title.rstrip('.?!')}, {asked}: {group}a panel a participant. Points: shares with exact 95 % "
        f"intervals, their area the number of trials{aside}; of many levels neighbours are joined. Lines and bands: "
        f"fitted curves with 95 % credible bands; bars at the foot: {_measure(of)} with its interval, left out where "
        f"it is not within the levels.{f' {line}.' if line else ''}{rest}"
    )
    said = "; ".join(threshold_words(found, of)) or "nobody's fit"
    said += f". False alarms: {'; '.join(alarms)}" if alarms else ""
    return Picture(
        stem=functions_figure_of(name, asked), caption=caption, alt=f"Psychometric functions. {_measure(of)}: {said}."
    )


def _picture_of_tracks(name: str, asked: str, found: DesignSummary, of: Thresholds) -> Iterator[Picture]:
    """Where a procedure chose the levels: how it went."""
    if not of.tracks:
        return
    people = len({track.participant for track in of.tracks})
    more = people - MOST_TRACK_PANELS
    rest = f" {more:,} more people have no panel." if more > 0 else ""
    turned = any(track.reversals for track in of.tracks)
    rings = ". Ringed: reversals; the threshold is fitted to all trials, no mean of these" if turned else ""
    ends = "; dashed, with a band: the participant's threshold and its interval" if len(of.conditions) == 1 else ""
    yield Picture(
        stem=tracks_figure_of(name, asked),
        caption=(
            f"{found.title.rstrip('.?!')}, {asked}: the levels that the answers chose, trial by trial, a panel a "
            f"participant and a line a track. Filled: {_SUCCESS[of.share]}; empty: not{ends}{rings}.{rest}"
        ),
        alt=f"Levels by trial of {how_many(len(of.tracks), 'track')} of {how_many(people, 'participant')}.",
    )


def threshold_words(found: DesignSummary, of: Thresholds) -> Iterator[str]:
    """Each condition's threshold in the group, or one person's."""
    for one in of.conditions[:_TOLD]:
        if one.group is not None:
            yield f"{_condition(found, one.levels)}{_group_words(of, one)}"
        elif one.people and (fit := one.people[0].fit) is not None:
            beyond = f" ({one.people[0].beyond})" if one.people[0].beyond else ""
            shown = one.people[0].reason or f"{_number(fit.threshold.median, _digits(of))}{beyond}"
            yield f"{_condition(found, one.levels)}{shown}"


def _condition(found: DesignSummary, levels: Mapping[str, Level]) -> str:
    return f"{found.condition(levels, display_name)}: " if levels else ""


def _cells(found: DesignSummary, levels: Mapping[str, Level]) -> tuple[str, ...]:
    return (found.condition(levels, display_name),) if levels else ()


def _tables(asked: str, found: DesignSummary, of: Thresholds) -> Iterator[Table]:
    digits = _digits(of)
    if any(one.group is not None for one in of.conditions):
        yield _groups(asked, found, of, digits)
    if of.differences:
        yield _differences(asked, found, of, digits)
    yield _people(asked, found, of, digits)


def _groups(asked: str, found: DesignSummary, of: Thresholds, digits: int | None) -> Table:
    conditions = ("Condition",) if of.conditions[0].levels else ()
    measured = f"{_measure(of).capitalize()}, mean", "95 % interval", "SD", _spread(of), "95 % interval"
    return Table(
        caption=f"{asked}: {_measure(of)} over people, in {factor_words(of.factor)}",
        header=(*conditions, "People", *measured, "Without"),
        rows=tuple(
            (
                *_cells(found, one.levels),
                str(one.group.people),
                *(_group_cells(one.group, digits) if _has_threshold(one) else (apa.NO_NUMBER,) * 5),
                str(one.group.without),
            )
            for one in of.conditions
            if one.group is not None
        ),
    )


def _group_cells(one: GroupFit, digits: int | None) -> tuple[str, ...]:
    return *_estimate(one.threshold, digits), _number(one.sd.median, digits), *_estimate(one.jnd, digits)


def _differences(asked: str, found: DesignSummary, of: Thresholds, digits: int | None) -> Table:
    measured = [one.levels for one in of.conditions if _has_threshold(one)]
    paired = any(one.threshold.within and one.threshold.people > 1 for one in of.differences)
    own = ". Paired: the mean of everybody's own difference, which need not be that of the two means" if paired else ""
    return Table(
        caption=f"{asked}: differences of the {_measure(of)}; without correction for their number{own}",
        header=("Conditions", "People", "Paired", "Difference", "95 % interval"),
        rows=tuple(
            (
                " − ".join(found.condition(side, display_name) for side in (one.a, one.b)),
                str(one.threshold.people),
                "yes" if one.threshold.within else "no",
                *(
                    _estimate(one.threshold.difference, digits)
                    if one.a in measured and one.b in measured
                    else (apa.NO_NUMBER,) * 2
                ),
            )
            for one in of.differences
        ),
    )


def _people(asked: str, found: DesignSummary, of: Thresholds, digits: int | None) -> Table:
    guessed = of.guess is None
    rows = tuple(
        (one.participant, *_cells(found, condition.levels), f"{one.trials:,}", *_own(one, digits, guessed=guessed))
        for condition in of.conditions
        for one in condition.people
    )
    cut = len(rows) > LISTED
    kept = f" (the first {SHOWN} of {len(rows):,}; all are in statistics.json)" if cut else ""
    return Table(
        caption=f"{asked}: each participant's own fit{kept}; p: how often data of such a function deviate as much",
        header=(
            "Participant",
            *(("Condition",) if of.conditions[0].levels else ()),
            *("Trials", _measure(of).capitalize(), "95 % interval", "Pooled", _spread(of), "95 % interval"),
            *("Slope", "Lapse"),
            *(("Guess",) if guessed else ()),
            *("p", "Remark"),
        ),
        rows=rows[:SHOWN] if cut else rows,
    )


def _own(one: PersonFit, digits: int | None, *, guessed: bool) -> tuple[str, ...]:
    fit = one.fit
    if fit is None:
        return (*(apa.NO_NUMBER,) * (8 + guessed), one.reason or "")
    return (
        *_estimate(fit.threshold, digits),
        _number(None if one.pooled is None else one.pooled.median, digits),
        *_estimate(fit.jnd, digits),
        f"{fit.slope.median:.3g}".replace("-", "−"),
        apa.below_one(fit.lapse.median),
        *((apa.below_one(fit.guess.median),) if guessed else ()),
        apa.p_cell(fit.goodness.p),
        one.reason or one.beyond,
    )


def _estimate(found: Credible, digits: int | None) -> tuple[str, str]:
    return _number(found.median, digits), _ends(found, digits)


def _ends(found: Credible, digits: int | None) -> str:
    return f"[{_number(found.low, digits)}, {_number(found.high, digits)}]"


def _number(value: float | None, digits: int | None) -> str:
    return apa.figures(value) if digits is None else apa.number(value, digits)


_SMALL, _LARGE = 1e-4, 1e6
"""Levels that span less or more than this have decimals that nobody reads."""


def _digits(of: Thresholds) -> int | None:
    """So many decimals that the span of the levels has three figures; `None`: three figures, with an exponent.

    Of a narrow span far from 0 three figures would be the same at every level: there decimals stay.
    """
    levels = [point.level for one in of.conditions for point in one.points]
    span, largest = max(levels) - min(levels), max(map(abs, levels))
    if span > _LARGE or (0 < span < _SMALL and largest < 10 * span):
        return None
    return min(max(2 - math.floor(math.log10(span)), 0), 9) if span > 0 else 2
