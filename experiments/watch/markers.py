"""What the records of a journal say to the room's other recordings: a marker for each shot, answer, pause and fault.

A record gives one marker or none. What people typed is in no marker. Pure.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields, replace
from typing import Literal

from pydantic import TypeAdapter

from experiments.design.plan import Condition, Trial
from experiments.record.journal import Head, Record, read_as
from experiments.session import remarks, steps
from experiments.study.folders import data_of
from experiments.tasks.questions import AnswerValue

TimeSource = Literal["gun", "key", "record"]
"""Who says when an event was: the gun, the key that went down, or the journal, when it took the event down."""

KEY_S = 0.01
"""How late a key may be seen. Assumed: what the doctor lets pass for a key, the keyboard's own delay not counted."""
RECORD_S = 0.01
"""How late an event may be taken down that has no time of its own. Assumed: what the doctor lets pass for a key on its
way to the disk, of which this is a part.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Marker:
    """An event of a run: when it was, give or take the uncertainty, and what it belongs to.

    `name` says what it was, with factors and their levels between slashes. `record` is the number of its record in the
    journal. `shot` counts the shots of a presentation from 1, `attempt` the presentations of a trial. `value`: an
    answer, the cause of a fault or pause, whose data a run gives.
    """

    name: str
    at_s: float
    participant_id: str
    experiment: str
    practice: bool
    record: int
    session: int | None = None
    set: int | None = None
    trial: int | None = None
    attempt: int | None = None
    shot: int | None = None
    value: str = ""
    time_from: TimeSource = "record"
    uncertainty_s: float = RECORD_S

    @property
    def details(self) -> tuple[str, ...]:
        """All of it but its time, as `DETAIL_COLUMNS` names it; empty is what there is not."""
        return tuple(_text(value) for name, value in zip(_FIELDS, astuple(self), strict=True) if name != "at_s")


_FIELDS = tuple(field.name for field in fields(Marker))
DETAIL_COLUMNS = tuple(name for name in _FIELDS if name != "at_s")


def _text(value: object) -> str:
    """A value as a column of text has it.

    >>> _text(None), _text(True), _text(0.00001)
    ('', '1', '1e-05')
    """
    return "" if value is None else str(int(value)) if isinstance(value, bool) else str(value)


def tagged(name: str, levels: Condition) -> str:
    """A marker's name with levels, in the form whose parts MNE selects by.

    >>> tagged("shot", (("method", "vibration"), ("voltage_V", 12.5)))
    'shot/method=vibration/voltage_V=12.5'
    """
    return "/".join([name, *(f"{factor}={level}" for factor, level in levels)])


_SHOT = TypeAdapter(steps.TrainShot)


class RunMarkers:
    """The markers of one run, record by record. `JournalError` for a record that is none of this version of Recoil."""

    def __init__(self, head: Head) -> None:
        self._head, plan = head, head.plan
        self._blank = Marker(
            name="",
            at_s=math.nan,
            participant_id=plan.participant_id,
            experiment=plan.experiment,
            practice=plan.practice,
            record=0,
        )
        self._step: steps.Step | None = None
        self._since_s = self._onset_s = math.nan
        self._described = set[str]()
        """The questions that are answered in people's own words."""

    def of(self, record: Record) -> Marker | None:
        """The marker of the next record, if it is an event."""
        self._blank = replace(self._blank, record=record.n, at_s=record.monotonic_s)
        match record.kind:
            case "step":
                self._enter(read_as(steps.STEP, record.body, self._place(record)), record)
                return None
            case "outcome":
                return self._of_outcome(read_as(steps.OUTCOME, record.body, self._place(record)), record)
            case "shot":
                shot = read_as(_SHOT, record.body, self._place(record))
                self._since_s = record.monotonic_s
                return self._shot(shot, record, shot.shot)
            case "remark":
                return self._of_remark(read_as(remarks.REMARK, record.body, self._place(record)), record)
            case "run" | "resumed":
                name = "begin" if record.kind == "run" else "resume"
                self._step, self._since_s, self._onset_s = None, record.monotonic_s, math.nan
                return replace(self._blank, name=name, value=data_of(self._head))
            case "stopped" | "finished":
                return replace(self._blank, name="stop" if record.kind == "stopped" else "finish")
            case "measured":  # a sensor's word comes later than its shot, which has a marker
                return None

    def _enter(self, step: steps.Step, record: Record) -> None:
        self._step, self._since_s = step, record.monotonic_s
        if isinstance(step, steps.Describe):
            self._described.add(step.question)

    def _place(self, record: Record) -> str:
        return f"{self._head.path}: line {record.n + 1}"

    def _of_outcome(self, outcome: steps.Outcome, record: Record) -> Marker | None:
        match outcome:
            case steps.Fired():
                self._onset_s = outcome.pulse_start_s
                return self._shot(outcome, record, getattr(self._step, "interval", 0) + 1)
            case steps.Answered() if isinstance(self._step, steps.Asking):
                return self._answer(self._step, outcome)
            case steps.Failed():
                within_s = record.monotonic_s - self._since_s
                return replace(self._of_trial(), name="fault", value=outcome.cause, uncertainty_s=within_s)
            case steps.Repeated():
                return replace(self._of_trial(outcome.trial), name="repeat")
            case _:
                return None

    def _of_remark(self, remark: remarks.Remark, record: Record) -> Marker | None:
        match remark:
            case remarks.Paused():
                return replace(self._of_trial(), name="pause", value=remark.cause)
            case remarks.Continued():
                return replace(self._of_trial(), name="continue")
            case remarks.Halted():
                return replace(self._of_trial(), name="emergency-stop", value=remark.by)
            case remarks.TestShot():
                return self._test_shot(remark, record)
            case remarks.EntryCorrected():
                return self._said("correction", self._of_trial(remark.trial), remark.question, remark.value)
            case _:
                return None

    def _of_trial(self, trial: Trial | None = None) -> Marker:
        """What is known of a marker by its trial, or else by the step at hand."""
        own = steps.trial_of(self._step)
        trial = trial or own
        if trial is None:
            return self._blank
        attempt = getattr(self._step, "attempt", None) if trial == own else None
        return replace(self._blank, session=trial.session, set=trial.set, trial=trial.trial, attempt=attempt)

    def _shot(self, shot: steps.Fired | steps.TrainShot, record: Record, number: int) -> Marker:
        """A shot by its own time: of a gun that states none of its uncertainty, between its request and its record."""
        within_s = max(shot.pulse_start_s - shot.requested_s, record.monotonic_s - shot.pulse_start_s, 0.0)
        return replace(
            self._of_trial(),
            name=self._shot_name(),
            at_s=shot.pulse_start_s,
            shot=number,
            time_from="gun",
            uncertainty_s=within_s if shot.timing is None else shot.timing.uncertainty_s,
        )

    def _shot_name(self) -> str:
        """What was felt; a catch trial, or an empty interval, is none."""
        match self._step:
            case steps.FireShot() | steps.Present() as step:
                felt = step.trial.with_chosen(step.chosen).levels_at(getattr(step, "interval", 0))
                return "no-shot" if felt is None else tagged("shot", felt)
            case _:
                return "shot"

    def _test_shot(self, shot: remarks.TestShot, record: Record) -> Marker:
        at_s = shot.pulse_start_s
        if at_s is None:
            return replace(self._of_trial(), name="fault", value=shot.cause)
        name, within_s = tagged("test-shot", (("method", shot.method),)), max(0.0, record.monotonic_s - at_s)
        return replace(self._blank, name=name, at_s=at_s, time_from="gun", uncertainty_s=within_s)

    def _answer(self, asked: steps.Asking, answer: steps.Answered) -> Marker:
        """An answer by its key, where that has a time, which counts from the onset of the last shot."""
        given = self._said("answer", self._of_trial(), asked.question, answer.value)
        key_s = answer.response_time_s if answer.key_time_s is None else answer.key_time_s
        if key_s is None or math.isnan(self._onset_s):
            return given
        return replace(given, at_s=self._onset_s + key_s, time_from="key", uncertainty_s=KEY_S)

    def _said(self, what: str, blank: Marker, question: str, value: AnswerValue) -> Marker:
        """What was answered to a question, but for people's own words."""
        told = None if question in self._described else value
        name = f"{what}/{question}" if told is None else f"{what}/{question}={told}"
        return replace(blank, name=name, value=_text(told))
