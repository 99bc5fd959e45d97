"""What every screen says in the same words: where a run is, what was saved, how a value reads. Pure.

Neither correctness nor a score is in here, nor a method's name.
"""

from __future__ import annotations

import unicodedata

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages
from experiments.design.language import LARGEST_NUMBER, shown_level
from experiments.design.plan import Plan, Trial
from experiments.session import remarks, steps
from experiments.session.history import History, answered, asked_before, entered_value, is_attempt, of_one_set
from experiments.session.remarks import MAX_FLAG, Remark
from experiments.session.steps import Ask, Asking, Describe, Outcome, Prepare, Rate, Step, trial_of, what
from experiments.tasks.questions import AnswerValue

FLAG_RULE = f"A flag is a word of at most {MAX_FLAG} letters, digits and hyphens."


def ordinal(plan: Plan, trial: Trial, messages: ParticipantMessages = ENGLISH_MESSAGES) -> str:
    """How a stimulus is named that is rated after all were felt: by its order, not by its method.

    Where it is read out, by the participant's `messages`.
    """
    number, of = place_in_set(plan, trial)
    return messages.place.format(number=number, of=of)


def place_in_set(plan: Plan, trial: Trial) -> tuple[int, int]:
    """The number of a trial in its set, from 1, and how many the set has."""
    block = [other for other in plan.trials if of_one_set(other, trial)]
    return block.index(trial) + 1, len(block)


def place_text(plan: Plan, trial: Trial) -> str:
    """Where a trial stands: in its session, set and run."""
    in_session = [other for other in plan.trials if other.session == trial.session]
    where = f"Trial {trial.trial} of {_at_most(plan)}{len(in_session)}"
    sessions, sets = plan.trials[-1].session, in_session[-1].set
    return (
        where
        if sessions == sets == 1
        else f"{where} · set {trial.set} of {sets} · session {trial.session} of {sessions}"
    )


def track_text(plan: Plan, told: History, trial: Trial) -> str:
    """How far the adaptive track of a trial is; empty of a trial without one."""
    if not trial.track:
        return ""
    own = {other for other in plan.trials if other.track == trial.track}
    return f"Track {trial.track}: {len(answered(told) & own)} of {_at_most(plan)}{len(own)} trials"


def _at_most(plan: Plan) -> str:
    return "at most " if plan.may_end_early else ""


def chosen_text(told: History, trial: Trial) -> str:
    """The levels that a procedure chose for a trial, once they were felt, if the experimenter may know them."""
    felt = next((step for step, _ in reversed(told) if isinstance(step, steps.FireShot | steps.Present)), None)
    known = felt.chosen if felt is not None and felt.shown and felt.trial == trial else ()
    return ", ".join(f"{name} = {shown_level(level)}" for name, level in known)


def short_place(trial: Trial, here: Trial) -> str:
    """Where a trial stands that is looked at from another: its set and session are named where they differ."""
    if of_one_set(trial, here):
        return f"trial {trial.trial}"
    session = "" if trial.session == here.session else f", session {trial.session}"
    return f"trial {trial.trial} of set {trial.set}{session}"


def again_text(told: History, step: Prepare) -> str:
    """How often a trial was felt before this attempt, as the table counts attempts; empty if never."""
    felt = sum(is_attempt(one, word) for one, word in told if trial_of(one) == step.trial)
    before = felt - (step.interval > 0)  # the first shot of this one is among them
    return f"Presented again, for the {_nth(before + 1)} time." if before else ""


def _nth(number: int) -> str:
    return {1: "first", 2: "second", 3: "third"}.get(number, f"{number}th")


def settings_text(step: Prepare) -> str:
    """What is set by hand, and how, as in “damper ON, posture KNEELING”."""
    return ", ".join(f"{name} {value.upper()}" for name, value in step.settings)


def turn_text(step: Prepare) -> str:
    """Which way the gun is turned, and for which of several shots."""
    count = len(step.trial.intervals)
    which = f" for shot {step.interval + 1} of {count}" if count and step.interval else ""
    return f"Turn the gun to {step.trial.direction_at(step.interval).upper()}{which}"


def read_out_text(plan: Plan, step: Prepare) -> str:
    """What the participant is told: to be read out before a set, and as a reminder at its other trials."""
    if not step.instruction:
        return ""
    how = "READ OUT" if plan.opens_set(step.trial) else "Instruction of this set"
    return f"\n  {how}: “{step.instruction}”"


def value_text(asked: Asking, said: AnswerValue) -> str:
    """What was entered, as text."""
    if said is None:
        return "no answer"
    if isinstance(said, float):
        return f"{said:g}"
    return asked.label(said).upper() if isinstance(asked, Ask) else f"“{said}”"


def ends_text(asked: Rate) -> str:
    """The ends of a scale in words, or which numbers may be said."""
    if asked.minimum_text or asked.maximum_text:
        return f"{asked.minimum:g} = {asked.minimum_text}     {asked.maximum:g} = {asked.maximum_text}"
    low = "above 0" if 0 < asked.minimum <= _TINY else f"from {asked.minimum:g}"
    low = "" if asked.minimum <= -LARGEST_NUMBER else low
    high = "" if asked.maximum >= LARGEST_NUMBER else f"to {asked.maximum:g}"
    return " ".join(filter(None, ("a number", low, high)))


_TINY = 1e-6
"""A least number as small as this says that 0 is none."""


def about_text(plan: Plan, asked: Asking, messages: ParticipantMessages = ENGLISH_MESSAGES) -> str:
    """What was asked about: the trial, or a stimulus by its order of presentation."""
    return ordinal(plan, asked.trial, messages) if asked.later else f"Trial {asked.trial.trial}"


def entry_text(plan: Plan, told: History, entry: Asking) -> str:
    """An entry with what it says."""
    about = about_text(plan, entry)
    name = about if isinstance(entry, Ask) else f"{about}, {what(entry)}"
    return f"{name}: {value_text(entry, entered_value(told, entry))}"


def corrected_text(told: History, remark: remarks.EntryCorrected) -> str:
    """That something was corrected, and to what; of words only that they were."""
    entry = asked_before(told, remark)
    if entry is None or isinstance(entry, Describe):
        return "description corrected"
    return f"{'' if isinstance(entry, Ask) else f'{what(entry)} '}corrected to {value_text(entry, remark.value)}"


def saved_text(plan: Plan, told: History, step: Step | None, word: Outcome | Remark) -> str:
    """That something is on the disk, as it was entered; empty for what needs no answer."""
    trial = trial_of(step)
    match word:
        case steps.Repeated():
            return f"Saved. Trial {word.trial.trial} is presented again ({word.reason})."
        case steps.Rested():
            return "The break is over."
        case _ if trial is None:
            return _remark_text(plan, told, word)
        case steps.Answered() if isinstance(step, Asking):
            return f"Saved. {_entered_text(plan, step, word.value)}."
        case steps.Presented():
            return f"Presented and saved. {shots_text(word.shots)}, {word.exposure_s:.1f} s."
        case steps.Failed():
            return f"The gun failed: {word.cause}. The trial is marked and presented again."
        case steps.Interrupted():
            return "The pause ended the stimulus: its trial is presented again." if word.presented else ""
        case _:
            return ""


def _entered_text(plan: Plan, step: Asking, value: AnswerValue) -> str:
    said = "description" if isinstance(step, Describe) else value_text(step, value)
    return f"{about_text(plan, step)}: {said}"


def _remark_text(plan: Plan, told: History, remark: Outcome | Remark) -> str:
    match remark:
        case remarks.EntryCorrected():
            return _corrected_text(plan, told, remark)
        case remarks.Flagged():
            return f"Saved. Trial {remark.trial.trial} flagged {remark.flag}."
        case remarks.Noted(trial=Trial()):  # one without a trial is the program's own
            return "Saved. Note."
        case remarks.HaltReason():
            return "Saved. Reason of the emergency stop."
        case remarks.TestShot():
            return f"Test shot failed: {remark.cause}." if remark.cause else "The test shot was fired; the run goes on."
        case _:
            return ""


def _corrected_text(plan: Plan, told: History, remark: remarks.EntryCorrected) -> str:
    entry = asked_before(told, remark)
    if entry is None:
        return ""
    about = about_text(plan, entry)
    if isinstance(entry, Describe):
        return f"Saved. {about}: description corrected."
    return f"Saved. {about} corrected to {value_text(entry, remark.value)}."


def shots_text(count: int) -> str:
    """A number of shots.

    >>> shots_text(1), shots_text(2)
    ('1 shot', '2 shots')
    """
    return f"{count} shot{'' if count == 1 else 's'}"


def duration_text(seconds: float) -> str:
    """A duration as people say it.

    >>> duration_text(45), duration_text(600), duration_text(90)
    ('45 s', '10 min', '1 min 30 s')
    """
    minutes, rest = divmod(round(seconds), 60)
    parts = [f"{minutes} min"] * (minutes > 0) + [f"{rest} s"] * (rest > 0 or not minutes)
    return " ".join(parts)


def typed_line(text: str) -> str:
    r"""What was typed or pasted into a line, without what no line holds: control characters become blanks.

    >>> typed_line("a\x00b\nc  ")
    'a b c'
    """
    return "".join(" " if unicodedata.category(letter) == "Cc" else letter for letter in text).strip()


def typed_number(text: str, minimum: float, maximum: float) -> float | None:
    """A number as people type it, comma or point, if it lies on the scale.

    >>> typed_number("7,5", 0, 10), typed_number("11", 0, 10), typed_number("nan", 0, 10)
    (7.5, None, None)
    """
    try:
        number = float(text.strip().replace(",", "."))
    except ValueError:
        return None
    return number if minimum <= number <= maximum else None
