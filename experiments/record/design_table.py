"""The log table that a design makes: which columns there are, what each means, whose values it may hold, and its rows.

Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from experiments.design.config import DesignConfig
from experiments.design.language import (
    DIRECTION_FACTOR,
    EMPTY,
    METHOD_FACTOR,
    FactorConfig,
    QuestionConfig,
    shown_level,
)
from experiments.design.plan import CHOSEN, Plan, Trial, in_interval
from experiments.record import tables
from experiments.record.tables import Column, Row, presentation
from experiments.session.history import History, TrialHistory, by_trial
from experiments.session.remarks import EntryCorrected
from experiments.session.steps import Answered, Fired, Interrupted, Presented
from experiments.session.tracks import adaptive_tracks
from experiments.tasks.questions import correct_columns, is_right

ANTICIPATION_S = 0.1
"""A key that comes sooner was not pressed for what was felt: simple reactions to touch take longer (assumed)."""
HANDS = ("participant", "experimenter", "synthetic")


def columns(design: DesignConfig) -> tuple[Column, ...]:
    """The columns of a design's table: who and where, factors, questions, and how the trial was presented.

    A factor stands where it is constant: beside the session, beside the set, or beside the trial.
    """
    return (*_places(design), *_questions(design), *_presentation(design))


def _places(design: DesignConfig) -> Iterator[Column]:
    yield tables.PARTICIPANT
    yield tables.level_column("experiment", (design.design,), "which design", required=True)
    in_session, in_set = (*design.between, *design.order.session), design.order.set
    if design.table == "trials":
        yield tables.integer_column("session", "session, from 1, in order of presentation", required=True)
    yield from _factors(design, in_session)
    if design.table == "trials":
        yield tables.integer_column("set", "set within the session, from 1", required=True)
    yield from _factors(design, in_set)
    yield tables.integer_column("trial", "trial within the session, from 1, in order of presentation", required=True)
    if design.adaptive is not None:
        yield tables.integer_column("track", "adaptive track, from 1; empty of a catch trial")
    if design.trial.catch:
        yield tables.flag_column("stimulus", "1 if there was a stimulus, 0 in a catch trial")
    yield from _factors(design, design.varying)


def _factors(design: DesignConfig, names: Iterable[str]) -> Iterator[Column]:
    for name in names:
        factor, compared = design.factors[name], name == design.trial.compare
        chosen = _CHOSEN if name in design.adapted else ""
        if not (compared and design.trial.kind == "pair"):
            what = "level that was compared" if compared else _MEANINGS.get(name, "level of this factor")
            yield _factor(name, factor, what + chosen)
        if compared:
            for place in range(1, design.trial.intervals + 1):
                own = chosen if in_interval(name, place) in design.chosen_names else "; empty if there was no stimulus"
                yield _factor(in_interval(name, place), factor, f"level in interval {place}{own}")


_CHOSEN = ", chosen by the answers before; empty if it was not felt"
_MEANINGS = {
    METHOD_FACTOR: "rendering method, as the config names it",
    DIRECTION_FACTOR: "which way the gun pointed and shot",
}


def _factor(name: str, factor: FactorConfig, description: str) -> Column:
    if isinstance(factor.all_levels[0], float):
        return tables.number_column(name, name.rsplit("_", 1)[-1] if "_" in name else "", description)
    return tables.level_column(name, tuple(map(shown_level, factor.all_levels)), description)


def _questions(design: DesignConfig) -> Iterator[Column]:
    scored = correct_columns(design.questions)
    for name, question in design.questions.items():
        yield _answer(name, question)
        if name in scored:
            yield tables.flag_column(scored[name], "1 if the answer was right, 0 if not; empty without one")
        if question.named_answers:
            yield tables.seconds_column(
                f"{name}_time_s", "time from the onset of the last stimulus to the answer; empty if there is none"
            )
            yield tables.level_column(f"{name}_source", HANDS, "whose hand gave the answer")
            yield tables.flag_column(
                f"{name}_time_valid",
                "1 if the time is the participant's own; 0 if corrected or by the experimenter's hand",
            )
        elif question.kind != "text":
            yield tables.level_column(f"{name}_by", HANDS, "whose hand entered it")


def _answer(name: str, question: QuestionConfig) -> Column:
    match question.kind:
        case "choice" | "yes-no":
            return tables.level_column(
                name, question.named_answers, "what the participant said; empty if never answered"
            )
        case "rating":
            low, high = question.minimum_text or "lower end", question.maximum_text or "upper end"
            ends = f"{question.minimum:g} ({low}) to {question.maximum:g} ({high})"
            return tables.bounded_column(name, f"{ends}; empty means none was given", *question.scale)
        case "number":
            said = "the number that the participant said; empty means none was given"
            return tables.bounded_column(name, said, *question.scale)
        case "ranking":
            meaning = f"rank among the trials of the block, 1 = {question.minimum_text}; empty means none was given"
            return tables.integer_column(name, meaning, most=tables.MOST_OFTEN)
        case "text":
            return tables.text_column(name, "the participant's own words")


def _presentation(design: DesignConfig) -> Iterator[Column]:
    if design.trial.kind == "train":
        shots = "shots presented until the participant said next"
        yield tables.integer_column("shots", shots, least=0, most=tables.MOST_OFTEN)
        yield tables.seconds_column(
            "exposure_s", "from the first pulse until the participant said next, at the last presentation"
        )
        yield tables.EARLIER_EXPOSURE
    if design.below_break_away:
        yield tables.text_column("status", "what the model says of the shot: `home`, `no-break-away` or `rendered`")
    yield from tables.PRESENTATION


def design_rows(plan: Plan, history: History, design: DesignConfig) -> list[Row]:
    """One row a planned trial, in order; what was not reached is empty."""
    rows = [_row(plan, design, trial, events) for trial, events in by_trial(plan.trials, history).items()]
    for row in went_back(rows):
        row["flags"] = " ".join(filter(None, (str(row["flags"]), tables.CLOCK_SET_BACK)))
    left = [row for row in rows if row["track"] and row["attempts"] is None]
    tracks = adaptive_tracks(design, plan, history) if left else None
    for row in left:
        if tracks is not None and row["track"] in tracks.over:
            row["flags"] = " ".join(filter(None, (str(row["flags"]), tables.TRACK_OVER)))
    return rows


def _row(plan: Plan, design: DesignConfig, planned: Trial, events: TrialHistory) -> Row:
    trial = planned.with_chosen(events.chosen)
    return {
        "participant_id": plan.participant_id,
        "experiment": plan.experiment,
        "session": trial.session,
        "set": trial.set,
        "trial": trial.trial,
        "track": trial.track or None,
        "stimulus": int(not trial.catch),
        **dict(trial.levels),
        **_compared(trial),
        **_answers(design, trial, events),
        **exposure_row(events),
        **_shown(design, events),
    }


def went_back(rows: Iterable[Row]) -> Iterator[Row]:
    """The rows whose stimulus has an earlier date and time than the last one before: the clock was set back.

    Of adaptive tracks the last one before in the track, as one that goes on after a correction comes late in its set.
    """
    before: dict[object, str] = {}
    for row in rows:
        onset = str(row.get("onset_utc") or "")  # of one length, all UTC: earlier sorts first
        if onset and onset < before.get(row.get("track"), ""):
            yield row
        before |= {row.get("track"): onset} if onset else {}


def _compared(trial: Trial) -> Row:
    """The level of each interval, and the one that was compared."""
    held = {in_interval(trial.compare, place): level for place, level in enumerate(trial.intervals, start=1)}
    felt: Row = {name: None if level in (EMPTY, CHOSEN) else level for name, level in held.items()}
    return felt


def _answers(design: DesignConfig, trial: Trial, events: TrialHistory) -> Row:
    scored, row = correct_columns(design.questions), Row()
    for name, question in design.questions.items():
        if entered := events.entered(name):
            row |= _answered(name, question, entered)
            right = is_right(design, question, trial, entered[-1].value) if name in scored else None
            row |= {scored[name]: int(right)} if right is not None else {}
    return row


def _answered(name: str, question: QuestionConfig, entered: list[Answered | EntryCorrected]) -> Row:
    """The answer that counts: the last one given, or what it was corrected to, whose time is not the participant's."""
    counts = entered[-1]
    given = next(one for one in reversed(entered) if isinstance(one, Answered))
    by = counts.by if isinstance(counts, Answered) else "experimenter"
    if question.kind == "text":
        return {name: counts.value}
    if not question.named_answers:
        whole = question.kind == "ranking" and isinstance(counts.value, float)
        return {name: int(counts.value) if whole else counts.value, f"{name}_by": by}  # type: ignore[arg-type] # a float
    valid = None if given.response_time_s is None else int(bool(given.response_time_valid) and counts is given)
    return {
        name: counts.value,
        f"{name}_time_s": given.response_time_s,
        f"{name}_source": by,
        f"{name}_time_valid": valid,
    }


def exposure_row(events: TrialHistory) -> Row:
    """The last exposure to a train, and how long earlier ones of the same trial were felt before it."""
    felt = [word.exposure_s for word in events.words if isinstance(word, Presented | Interrupted) and word.exposure_s]
    shown = events.last(Presented)
    if shown is None:
        return {"earlier_exposure_s": round(sum(felt), 6)} if felt else {}
    row: Row = {"shots": shown.shots, "exposure_s": shown.exposure_s}
    return row | ({"earlier_exposure_s": round(sum(felt[:-1]), 6)} if felt[:-1] else {})


def _shown(design: DesignConfig, events: TrialHistory) -> Row:
    """How the trial was presented. A first answer that came sooner than anybody reacts is marked."""
    row = presentation(events, Presented if design.trial.kind == "train" else Fired)
    if (fired := events.last(Fired)) is not None:
        row |= {"status": fired.motion}
    if events.at_edge:
        row |= {"flags": " ".join(filter(None, (str(row["flags"]), tables.AT_EDGE)))}
    given = events.last(Answered)
    if given is None or given.by != "participant" or given.response_time_s is None:
        return row
    if given.response_time_s >= ANTICIPATION_S:
        return row
    return row | {"flags": " ".join(filter(None, (str(row["flags"]), "anticipation")))}
