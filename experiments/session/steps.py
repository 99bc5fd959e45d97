"""The words between a session and the world: steps say what should happen, outcomes what did.

Both are frozen facts. `kind` names them in the journal, from which they are read back and checked by pydantic.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter

from device.words import ShotTiming
from experiments.design.plan import Condition, Trial, plain_fields
from experiments.tasks.questions import AnswerValue, Choice


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepare:
    """Take the gun, turn it to the direction of the interval, set by hand what is named, hand it over.

    `settings` are names and values, such as the damper's. `instruction` is the text of what the participant is told for
    this set, empty if nothing. `interval` counts from 0.
    """

    trial: Trial
    attempt: int
    settings: tuple[tuple[str, str], ...] = ()
    instruction: str = ""
    interval: int = 0
    kind: Literal["prepare"] = "prepare"


@dataclass(frozen=True, slots=True, kw_only=True)
class FireShot:
    """Fire the shot of one of the trial's intervals, counted from 0; of a catch trial, nothing.

    `gap_s`: not sooner than so long after the onset of the interval before. `chosen` are the levels that a procedure
    chose, `at_edge` at the end of what there is; `shown`: the experimenter may know them.
    """

    trial: Trial
    attempt: int
    interval: int = 0
    gap_s: float = 0.0
    chosen: Condition = ()
    at_edge: bool = False
    shown: bool = False
    kind: Literal["fire"] = "fire"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ask:
    """Ask for one of several answers. `question` is its name, `text` its words.

    `later`: all of the block were felt, and the stimulus is named by its order of presentation.
    """

    trial: Trial
    question: str
    text: str
    choices: tuple[Choice, ...]
    later: bool = False
    kind: Literal["ask"] = "ask"

    @property
    def answers(self) -> tuple[str, ...]:
        """What can be answered."""
        return tuple(choice.answer for choice in self.choices)

    def label(self, answer: AnswerValue) -> str:
        """What an answer is called."""
        return next((choice.told for choice in self.choices if choice.answer == answer), str(answer))


@dataclass(frozen=True, slots=True, kw_only=True)
class Inform:
    """Tell the participant something, and go on when that is done. `trial`: whose answer it is about, if any."""

    text: str
    what: Literal["instruction", "consent", "feedback"]
    trial: Trial | None = None
    kind: Literal["inform"] = "inform"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rest:
    """A break that cannot be cut short without a recorded reason."""

    between: Literal["sets", "sessions"]
    duration_s: float
    kind: Literal["rest"] = "rest"


@dataclass(frozen=True, slots=True, kw_only=True)
class Present:
    """Fire a shot every so often until the participant says next, which counts after the least exposure.

    `chosen`, `at_edge` and `shown`: as in `FireShot`.
    """

    trial: Trial
    attempt: int
    repeat_every_s: float
    max_shots: int
    least_exposure_s: float
    chosen: Condition = ()
    at_edge: bool = False
    shown: bool = False
    kind: Literal["present"] = "present"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """Ask for a rating of the trial's stimulus, or for a number. `question`, `text`, `later`: as in `Ask`.

    `grain` is 0 where any number will do. `may_be_skipped`: no answer is one. `distinct`: each trial of the set has a
    number of its own, as ranks are. `is_number`: a number is asked for, no rating, also where it has a grain.
    """

    trial: Trial
    question: str
    text: str
    minimum: float
    maximum: float
    minimum_text: str
    maximum_text: str
    grain: float
    later: bool = False
    may_be_skipped: bool = True
    distinct: bool = False
    is_number: bool = False
    kind: Literal["rate"] = "rate"


@dataclass(frozen=True, slots=True, kw_only=True)
class Describe:
    """Ask for a free description of the trial's stimulus. `question`, `text`, `later`: as in `Ask`."""

    trial: Trial
    question: str
    text: str
    later: bool = False
    kind: Literal["describe"] = "describe"


@dataclass(frozen=True, slots=True, kw_only=True)
class Close:
    """Everything is answered: correct, note and flag what is left, then end the run."""

    kind: Literal["close"] = "close"


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """The gun is in the participant's hand, set by hand as it was asked for: whoever fires confirms it."""

    settings: tuple[tuple[str, str], ...] = ()
    kind: Literal["prepared"] = "prepared"


NO_MOTION = "none"
"""The motion in an interval, or a catch trial, in which nothing is fired."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fired:
    """One shot was fired. Times are on the host's monotonic clock; home is predicted by the model.

    `timing` tells how it came about, where a gun on a line was asked.
    """

    gun: str
    onset_utc: str
    requested_s: float
    pulse_start_s: float
    pulse_end_s: float
    home_predicted_s: float
    motion: str
    timing: ShotTiming | None = None
    kind: Literal["fired"] = "fired"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answered:
    """What the participant said, and whose hand entered it. The time is valid if it came from the participant's own.

    `key_time_s` is when the key for it went down, since the onset, where the response time is not that of the key: a
    synthetic participant's is drawn. Ratings and descriptions have no times.
    """

    value: AnswerValue
    by: Literal["participant", "experimenter", "synthetic"]
    response_time_s: float | None = None
    response_time_valid: bool | None = None
    key_time_s: float | None = None
    kind: Literal["answered"] = "answered"


@dataclass(frozen=True, slots=True, kw_only=True)
class Informed:
    """The participant was told."""

    kind: Literal["informed"] = "informed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rested:
    """The break is over; `cut_reason` says why it was shorter than planned, empty if it was not."""

    rested_s: float
    cut_reason: str = ""
    kind: Literal["rested"] = "rested"


@dataclass(frozen=True, slots=True, kw_only=True)
class Presented:
    """The stimulus was felt until next was said, or until the most shots were fired."""

    gun: str
    onset_utc: str
    shots: int
    exposure_s: float
    ended_by: Literal["next", "limit"]
    kind: Literal["presented"] = "presented"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainShot:
    """One shot of a train, recorded as soon as it was fired: of a train that breaks off it is known what was felt.

    `shot` counts from 1; times and `timing` as in `Fired`.
    """

    shot: int
    requested_s: float
    pulse_start_s: float
    pulse_end_s: float
    home_predicted_s: float
    motion: str
    timing: ShotTiming | None = None
    kind: Literal["train-shot"] = "train-shot"


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """There was nothing left to correct."""

    kind: Literal["closed"] = "closed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Failed:
    """The gun did not do it, or may not have: the trial is presented again.

    `presented` tells whether its stimulus may have been felt: a shot that was refused was not. Of a train it is known
    from its shots how long that was.
    """

    cause: str
    presented: bool = True
    shots: int | None = None
    exposure_s: float | None = None
    kind: Literal["failed"] = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interrupted:
    """The run broke off, or was paused, before this step was done: the trial is presented again.

    `presented` tells whether its stimulus was, or may have been, felt. Of a train that a pause ended it is known how
    long and with how many shots. A correction ends what is told of the answer that it changes: it is told anew.
    """

    presented: bool
    cause: Literal["break-off", "pause", "correction"] = "break-off"
    shots: int | None = None
    exposure_s: float | None = None
    kind: Literal["interrupted"] = "interrupted"


RepeatedBy = Literal["experimenter", "sensor"]
"""Who had a trial presented again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeated:
    """A trial was spoiled, this one or an earlier one of its set, and is to be presented again."""

    trial: Trial
    reason: str
    by: RepeatedBy = "experimenter"
    kind: Literal["repeat"] = "repeat"


Step = Prepare | FireShot | Ask | Inform | Rest | Present | Rate | Describe | Close
Outcome = Prepared | Fired | Answered | Informed | Rested | Presented | Closed | Failed | Interrupted | Repeated
TrialStep = Prepare | FireShot | Ask | Inform | Present | Rate | Describe
"""A step that is about one trial."""
Session = Generator[Step, Outcome, None]
"""Yields what should happen and is sent what did happen. It opens nothing, waits for nothing and knows no clock."""


Asking = Ask | Rate | Describe
"""A step that asks; it says as well what was entered for its trial and question, where that is looked at again."""
What = Literal["answer", "rating", "number", "rank", "description"]


def what(asked: Asking) -> What:
    """What kind of answer is asked for."""
    match asked:
        case Ask():
            return "answer"
        case Rate():
            return "rank" if asked.distinct else "number" if asked.is_number else "rating"
        case Describe():
            return "description"


def is_answer(asked: Asking, value: AnswerValue) -> bool:
    """Whether a value is an answer to what was asked."""
    match asked:
        case Ask():
            return value in asked.answers
        case Rate():
            if value is None:
                return asked.may_be_skipped
            return isinstance(value, float) and asked.minimum <= value <= asked.maximum
        case Describe():
            return isinstance(value, str)


def asks_at_once(step: Step | None) -> bool:
    """Whether a step asks about what was felt just now: where that breaks off, it has to be felt again."""
    return isinstance(step, Asking) and not step.later


def nothing_fired(gun: str, onset_utc: str, at_s: float) -> Fired:
    """What is said of an interval, or a catch trial, in which nothing is fired."""
    return Fired(
        gun=gun,
        onset_utc=onset_utc,
        requested_s=at_s,
        pulse_start_s=at_s,
        pulse_end_s=at_s,
        home_predicted_s=at_s,
        motion=NO_MOTION,
    )


def is_begun(step: Step | None) -> bool:
    """Whether a trial was felt, or a part of it, when this step is due: if that breaks off, it is presented again."""
    return (isinstance(step, Prepare | FireShot) and step.interval > 0) or asks_at_once(step)


def breaks_off(step: Step | None, word: object) -> bool:
    """Whether a step ends so that its trial is presented again; one that is only told or asked later goes on."""
    return isinstance(word, Failed | Interrupted) and (isinstance(step, FireShot | Present) or is_begun(step))


def trial_of(step: Step | None) -> Trial | None:
    """The trial that a step is about, if it is about one."""
    return step.trial if isinstance(step, TrialStep) else None


_OPTIONAL_FIELDS = (
    "timing",
    "response_time_s",
    "response_time_valid",
    "key_time_s",
    "shots",
    "exposure_s",
)
STEP: TypeAdapter[Step] = TypeAdapter(Annotated[Step, Field(discriminator="kind")], config=ConfigDict(defer_build=True))
"""Reads the step that a record holds."""
OUTCOME: TypeAdapter[Outcome] = TypeAdapter(
    Annotated[Outcome, Field(discriminator="kind")], config=ConfigDict(defer_build=True)
)
"""Reads the outcome that a record holds."""
TRAIN_SHOTS: TypeAdapter[list[TrainShot]] = TypeAdapter(list[TrainShot], config=ConfigDict(defer_build=True))
"""Reads the shots of a train that records hold."""


def step_record(word: Step | Outcome | TrainShot) -> dict[str, object]:
    """A step, outcome or shot as plain JSON values; an instruction, and what is not always known, only where it is."""
    named = plain_fields(word).items()
    return {key: value for key, value in named if key not in _OPTIONAL_FIELDS or value is not None}


def step_after(session: Session, outcome: Outcome) -> Step | None:
    """The step of a session after an outcome; None at its end."""
    try:
        return session.send(outcome)
    except StopIteration:
        return None


Presentation = Callable[[Trial, int], Session]
"""The steps of one presentation of a trial, by its number; none where it is not needed any more."""


class Presenter:
    """Presents trials and counts how often. `presentation` says what one is made of."""

    def __init__(self, presentation: Presentation) -> None:
        self._presentation = presentation
        self._presented: Counter[Trial] = Counter()

    def present(self, trial: Trial) -> Session:
        """Present a trial until it is done; an earlier one that is to be repeated comes in between."""
        while True:
            outcome = yield from self._attempt(self._presentation(trial, self._presented[trial] + 1))
            if isinstance(outcome, Repeated) and outcome.trial != trial:
                yield from self.present(outcome.trial)
                continue
            self._presented[trial] += 1
            if not isinstance(outcome, Failed | Interrupted | Repeated):
                return

    def until_done(self, step: Step) -> Session:
        """A step that a break-off only delays, and before which a trial can be presented again."""
        while isinstance(outcome := (yield step), Interrupted | Repeated):
            if isinstance(outcome, Repeated):
                yield from self.present(outcome.trial)

    def close(self) -> Session:
        """The end of a run, at which the last trials can still be corrected or presented again."""
        yield from self.until_done(Close())

    def _attempt(self, presentation: Session) -> Generator[Step, Outcome, Outcome | None]:
        """One presentation: its last outcome, or the first that breaks it off. What is told is only delayed by that."""
        step, outcome = next(presentation, None), None
        while step is not None:
            outcome = yield step
            if isinstance(outcome, Failed | Repeated) or (isinstance(outcome, Interrupted) and not _is_told(step)):
                break
            step = step_after(presentation, outcome)
        return outcome


def _is_told(step: Step) -> bool:
    return isinstance(step, Inform)
