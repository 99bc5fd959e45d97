"""The rows of the log table that a design makes, from what was done. Pure; its columns are in `design_columns`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from experiments.design.config import DesignConfig
from experiments.design.language import EMPTY, QuestionConfig
from experiments.design.plan import CHOSEN, Plan, Trial, in_interval
from experiments.design.procedure_problems import followed_question
from experiments.record import tables
from experiments.record.tables import ANTICIPATION_S, Row, went_back
from experiments.session import remarks
from experiments.session.history import History, TrialHistory, by_trial, is_attempt
from experiments.session.remarks import EntryCorrected
from experiments.session.steps import NO_MOTION, Answered, Failed, Fired, Interrupted, Presented
from experiments.session.tracks import adaptive_tracks
from experiments.tasks.questions import correct_columns, is_right


def design_rows(plan: Plan, history: History, design: DesignConfig) -> list[Row]:
    """One row a planned trial, in order; what was not reached is empty."""
    rows = [_row(plan, design, trial, events) for trial, events in by_trial(plan.trials, history).items()]
    for place in went_back(rows, lambda text: text or None):  # of one length, all UTC: earlier sorts first
        _flag(rows[place], tables.CLOCK_SET_BACK)
    for row in _over(plan, history, design, rows):
        _flag(row, tables.TRACK_OVER)
    return rows


def _over(plan: Plan, history: History, design: DesignConfig, rows: Iterable[Row]) -> Iterator[Row]:
    """The rows without an answer that the track had ended before."""
    question = followed_question(design.adaptive, design.questions) if design.adaptive is not None else None
    left = [row for row in rows if row["track"] and row.get(question or "") is None]
    tracks = adaptive_tracks(design, plan, history) if left else None
    return (row for row in left if tracks is not None and row["track"] in tracks.over)


def _flag(row: Row, flag: str) -> None:
    row["flags"] = " ".join(filter(None, (str(row["flags"]), flag)))


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
        **_shown(events),
    }


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
    shown = events.last(Presented)
    others = [word for word in events.words if isinstance(word, Presented | Failed | Interrupted) and word is not shown]
    felt = [word.exposure_s for word in others if word.exposure_s is not None]
    row: Row = {} if shown is None else {"shots": shown.shots, "exposure_s": shown.exposure_s}
    return row | ({"earlier_exposure_s": round(sum(felt), 6)} if felt else {})


def _presentation(events: TrialHistory) -> Row:
    """How a trial was presented: attempts, flags, note, onset of the last stimulus, gun. Empty if it never was."""
    attempts = sum(is_attempt(step, word) for step, word in events.items)
    notes = "; ".join(remark.text for remark in events.all(remarks.Noted))
    row: Row = {"attempts": attempts or None, "flags": " ".join(_flags(events)), "note": notes}
    first = next(iter(events.stimulus), None)
    return row | ({"onset_utc": first.onset_utc, "gun": first.gun} if first else {})


def _flags(events: TrialHistory) -> list[str]:
    """What went wrong with the stimulus on the way, what was changed afterwards, and the experimenter's own marks."""
    found = {
        "device-error": bool(events.all(Failed)),
        "interrupted": any(one.presented and one.cause == "break-off" for one in events.all(Interrupted)),
        "paused": any(one.presented and one.cause == "pause" for one in events.all(Interrupted)),
        tables.REPEATED: events.repeated,
        "corrected": any(_is_corrected(events.entered(name)) for name in events.questions),
        "not-delivered": any(one.mark in remarks.NOT_DELIVERED for one in _last_measured(events)),
    }
    own = [remark.flag for remark in events.all(remarks.Flagged)]
    return list(dict.fromkeys([flag for flag, there in found.items() if there] + own))


def _last_measured(events: TrialHistory) -> list[remarks.ShotMeasured]:
    """What a sensor measured of the last presentation."""
    found = events.all(remarks.ShotMeasured)
    return [one for one in found if one.attempt == found[-1].attempt]


def _is_corrected(entered: list[Answered | EntryCorrected]) -> bool:
    """Whether what counts is a correction: what was entered anew, because its trial was presented again, is none."""
    return bool(entered) and isinstance(entered[-1], EntryCorrected)


def _motions(events: TrialHistory) -> str:
    """What the model says of each shot of the last presentation; an empty interval has none."""
    return " ".join(one.motion for one in events.stimulus if isinstance(one, Fired) and one.motion != NO_MOTION)


def _shown(events: TrialHistory) -> Row:
    """How the trial was presented. A first answer that came sooner than anybody reacts is marked."""
    row = _presentation(events) | {"status": _motions(events)}
    if events.at_edge:
        _flag(row, tables.AT_EDGE)
    given = next((word for _, word in reversed(events.counting) if isinstance(word, Answered)), None)
    if given is None or given.by != "participant" or given.response_time_s is None:
        return row
    if given.response_time_s >= ANTICIPATION_S:
        return row
    _flag(row, "anticipation")
    return row
