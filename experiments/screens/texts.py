"""What every screen says in the same words: where a run is, what was saved, how a value reads. Pure.

Neither correctness nor a score is in here, nor a method's name.
"""

from __future__ import annotations

import math
import re
import unicodedata

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages
from experiments.design.language import LARGEST_NUMBER, shown_level
from experiments.design.plan import Plan, Trial
from experiments.screens.phrases import isolated, phrase
from experiments.session import remarks, steps
from experiments.session.history import (
    History,
    answered,
    asked_before,
    entered_value,
    exchanged_for,
    is_attempt,
    of_one_set,
)
from experiments.session.remarks import MAX_FLAG, Remark
from experiments.session.steps import Ask, Asking, Describe, Outcome, Prepare, Rate, Step, trial_of, what
from experiments.study.enrolment import CodeDoubt
from experiments.tasks.questions import AnswerValue, on_scale

FLAG_RULE = phrase("A flag is a word of at most {max_flag} letters, digits and hyphens.", max_flag=MAX_FLAG)


def ordinal(plan: Plan, trial: Trial, messages: ParticipantMessages = ENGLISH_MESSAGES) -> str:
    """How a stimulus is named that is rated after all were felt: by its order, not by its method.

    Where it is read out, by the participant's `messages`.
    """
    number, of = place_in_set(plan, trial)
    return messages.place.format(number=number, of=of)


def place_in_set(plan: Plan, trial: Trial) -> tuple[int, int]:
    """The number of a trial in its set, from 1, and how many the set has."""
    block = plan.set_of(trial)
    return block.index(trial) + 1, len(block)


def place_in_session(plan: Plan, trial: Trial) -> tuple[int, int]:
    """The number of a trial in its session, and how many the session has."""
    return trial.trial, sum(other.session == trial.session for other in plan.trials)


def place_text(plan: Plan, trial: Trial) -> str:
    """Where a trial stands: in its session, set and run."""
    number, count = place_in_session(plan, trial)
    where = phrase("Trial {trial} of {at_most}{count}", trial=number, at_most=_at_most(plan), count=count)
    return " · ".join(filter(None, (where, set_text(plan, trial))))


def set_text(plan: Plan, trial: Trial) -> str:
    """Where the set of a trial stands, in its session and run; empty if it is the only one."""
    sessions = plan.trials[-1].session
    sets = [other.set for other in plan.trials if other.session == trial.session][-1]
    if sessions == sets == 1:
        return ""
    return phrase(
        "set {set} of {sets} · session {session} of {sessions}",
        set=trial.set,
        sets=sets,
        session=trial.session,
        sessions=sessions,
    )


def track_text(plan: Plan, told: History, trial: Trial) -> str:
    """How far the adaptive track of a trial is; empty without one, or beside catch trials, which have none."""
    if not trial.track or any(other.catch for other in plan.trials):
        return ""
    own = {other for other in plan.trials if other.track == trial.track}
    return phrase(
        "Track {track}: {answered} of {at_most}{own} trials",
        track=trial.track,
        answered=len(answered(told, ()) & own),
        at_most=_at_most(plan),
        own=len(own),
    )


def _at_most(plan: Plan) -> str:
    return phrase("at most ") if plan.may_end_early else ""


def chosen_text(told: History, trial: Trial) -> str:
    """The levels that a procedure chose for a trial, once they were felt, if the experimenter may know them."""
    felt = next((step for step, _ in reversed(told) if isinstance(step, steps.FireShot | steps.Present)), None)
    known = felt.chosen if felt is not None and felt.shown and felt.trial == trial else ()
    return ", ".join(f"{name} = {shown_level(level)}" for name, level in known)


def short_place(trial: Trial, here: Trial) -> str:
    """Where a trial stands that is looked at from another: its set and session are named where they differ."""
    if of_one_set(trial, here):
        return phrase("trial {trial}", trial=trial.trial)
    session = "" if trial.session == here.session else phrase(", session {session}", session=trial.session)
    return phrase("trial {trial} of set {set}{session}", trial=trial.trial, set=trial.set, session=session)


def again_text(told: History, step: Prepare) -> str:
    """How often a trial was felt before this attempt, as the table counts attempts; empty if never.

    What was answered of it, and said to be saved, counts no more: that is told as well.
    """
    own = [(one, word) for one, word in told if trial_of(one) == step.trial]
    before = sum(is_attempt(one, word) for one, word in own) - (step.interval > 0)  # the first shot is of this attempt
    if not before:
        return ""
    again = phrase("Presented again, for the {nth} time.", nth=_nth(before + 1))
    if not any(isinstance(one, Asking) and isinstance(word, steps.Answered) for one, word in own):
        return again
    return phrase("{again} Its answers so far stay in the journal and do not count.", again=again)


def _nth(number: int) -> str:
    named = {1: phrase("first"), 2: phrase("second"), 3: phrase("third")}
    return named.get(number, phrase("{number}th", number=number))


def settings_text(step: Prepare) -> str:
    """What is set by hand, and how, as in “damper ON, posture KNEELING”."""
    return ", ".join(f"{name} {value.upper()}" for name, value in step.settings)


def turn_text(step: Prepare) -> str:
    """Which way the gun is turned, and for which of several shots."""
    count = len(step.trial.intervals)
    which = (
        phrase(" for shot {interval} of {count}", interval=step.interval + 1, count=count)
        if count and step.interval
        else ""
    )
    return phrase(
        "Turn the gun to {direction}{which}", direction=step.trial.direction_at(step.interval).upper(), which=which
    )


def read_out_text(plan: Plan, step: Prepare) -> str:
    """What the participant is told: to be read out before a set, and as a reminder at its other trials."""
    if not step.instruction:
        return ""
    how = phrase("READ OUT") if plan.opens_set(step.trial) else phrase("Instruction of this set")
    return f"\n  {how}: “{isolated(step.instruction)}”"


def value_text(asked: Asking, said: AnswerValue) -> str:
    """What was entered, as text."""
    if said is None:
        return phrase("no answer")
    if isinstance(said, float):
        return f"{said:.15g}"
    return asked.label(said).upper() if isinstance(asked, Ask) else f"“{said}”"


def ends_text(asked: Rate) -> str:
    """The ends of a scale in words, or which numbers may be said."""
    if asked.minimum_text or asked.maximum_text:
        ends = ((asked.minimum, asked.minimum_text), (asked.maximum, asked.maximum_text))
        return "     ".join(f"{end:g} = {isolated(text)}" if text else f"{end:g}" for end, text in ends)
    low = "above 0" if 0 < asked.minimum <= _TINY else phrase("from {minimum:g}", minimum=asked.minimum)
    low = "" if asked.minimum <= -LARGEST_NUMBER else low
    high = "" if asked.maximum >= LARGEST_NUMBER else phrase("to {maximum:g}", maximum=asked.maximum)
    return " ".join(filter(None, ("a number", low, high)))


_TINY = 1e-6
"""A least number as small as this says that 0 is none."""


def about_text(plan: Plan, asked: Asking, messages: ParticipantMessages = ENGLISH_MESSAGES) -> str:
    """What was asked about: the trial, or a stimulus by its order of presentation."""
    return ordinal(plan, asked.trial, messages) if asked.later else phrase("Trial {trial}", trial=asked.trial.trial)


def entry_name(told: History, entry: Asking) -> str:
    """What an entry is called: with its question's name where several of its kind are asked, words always by that."""
    kind = what(entry)
    if isinstance(entry, Describe):
        return f"“{entry.question}”"
    alike = {step.question for step, _ in told if isinstance(step, Asking) and what(step) == kind}
    return f"{kind} “{entry.question}”" if len(alike) > 1 else kind


def kept_text(asked: Asking, given: AnswerValue) -> str:
    """A note of what was set or typed for a question and not entered: by its name, whatever else was asked."""
    kind = what(asked)
    name = kind if asked.question == kind else f"{kind} “{asked.question}”"
    return f"{name}: {given:g}" if isinstance(given, float) else f"{name}: {given}"


def _which(plan: Plan, told: History, entry: Asking) -> str:
    """What an entry is about, and its name where that does not tell it from others of its kind."""
    about, name = about_text(plan, entry), entry_name(told, entry)
    return about if name == what(entry) else f"{about}, {name}"


def entry_text(plan: Plan, told: History, entry: Asking) -> str:
    """An entry with what it says."""
    about, name = about_text(plan, entry), entry_name(told, entry)
    about = about if name == "answer" else f"{about}, {name}"
    return f"{about}: {isolated(value_text(entry, entered_value(told, entry)))}"


def corrected_text(told: History, remark: remarks.EntryCorrected) -> str:
    """That something was corrected, and to what; of words only that they were."""
    entry = asked_before(told, remark)
    if entry is None:
        return phrase("corrected")
    value, name = value_text(entry, remark.value), entry_name(told, entry)
    if isinstance(entry, Describe):
        return phrase("{entry} corrected", entry=name)
    if name == "answer":
        return phrase("corrected to {value}", value=value)
    return phrase("{entry} corrected to {value}", entry=name, value=value)


def saved_text(plan: Plan, told: History, step: Step | None, word: Outcome | Remark) -> str:
    """That something is on the disk, as it was entered; empty for what needs no answer."""
    trial = trial_of(step)
    match word:
        case steps.Repeated():
            return phrase(
                "Saved. Trial {trial} is presented again ({reason}).", trial=word.trial.trial, reason=word.reason
            )
        case steps.Rested():
            return phrase("The break is over.")
        case _ if trial is None:
            return _remark_text(plan, told, word)
        case steps.Answered() if isinstance(step, Asking):
            return phrase("Saved. {entered}.", entered=_entered_text(plan, told, step, word.value))
        case steps.Presented():
            return phrase(
                "Presented and saved. {shots}, {exposure_s:.1f} s.",
                shots=shots_text(word.shots),
                exposure_s=word.exposure_s,
            )
        case steps.Failed():
            return phrase("The gun failed: {cause}. The trial is marked and presented again.", cause=word.cause)
        case steps.Interrupted():
            return phrase("The pause ended the stimulus: its trial is presented again.") if word.presented else ""
        case _:
            return ""


def _entered_text(plan: Plan, told: History, step: Asking, value: AnswerValue) -> str:
    if isinstance(step, Describe):
        return f"{about_text(plan, step)}: {entry_name(told, step)}"
    return f"{_which(plan, told, step)}: {isolated(value_text(step, value))}"


def _remark_text(plan: Plan, told: History, remark: Outcome | Remark) -> str:
    match remark:
        case remarks.EntryCorrected():
            return _corrected_text(plan, told, remark)
        case remarks.Flagged():
            return phrase("Saved. Trial {trial} flagged {flag}.", trial=remark.trial.trial, flag=remark.flag)
        case remarks.Noted(trial=Trial()):  # one without a trial is the program's own
            return phrase("Saved. Note.")
        case remarks.HaltReason():
            return phrase("Saved. Reason of the emergency stop.")
        case remarks.TestShot():
            return (
                phrase("Test shot failed: {cause}.", cause=remark.cause)
                if remark.cause
                else phrase("The test shot was fired; the run goes on.")
            )
        case _:
            return ""


def _corrected_text(plan: Plan, told: History, remark: remarks.EntryCorrected) -> str:
    entry = asked_before(told, remark)
    if entry is None:
        return ""
    if isinstance(entry, Describe):
        name = entry_name(told, entry)
        return phrase("Saved. {about}: {entry} corrected.", about=about_text(plan, entry), entry=name)
    about, value = _which(plan, told, entry), value_text(entry, remark.value)
    if (first := exchanged_for(told, remark)) is not None and (given := asked_before(told, first)) is not None:
        return phrase(
            "Saved. The two ranks were exchanged: {one} has {rank} now, {other} has {was}.",
            one=_which(plan, told, given),
            rank=value_text(given, first.value),
            other=about,
            was=value,
        )
    return phrase("Saved. {about} corrected to {value}.", about=about, value=value)


def shots_text(count: int) -> str:
    """A number of shots.

    >>> shots_text(1), shots_text(2)
    ('1 shot', '2 shots')
    """
    return phrase("1 shot") if count == 1 else phrase("{count} shots", count=count)


def duration_text(seconds: float) -> str:
    """A duration as people say it.

    >>> duration_text(45), duration_text(600), duration_text(90)
    ('45 s', '10 min', '1 min 30 s')
    """
    minutes, rest = divmod(round(seconds), 60)
    parts = [phrase("{minutes} min", minutes=minutes)] * (minutes > 0) + [f"{rest} s"] * (rest > 0 or not minutes)
    return " ".join(parts)


def typed_line(text: str) -> str:
    r"""What was typed or pasted into a line, without what no line holds: control characters become blanks.

    >>> typed_line("a\x00b\nc  ")
    'a b c'
    """
    return "".join(" " if unicodedata.category(letter) == "Cc" else letter for letter in text).strip()


_THOUSANDS = re.compile(r"[+-]?\d{1,3}(,\d{3})+")


def _with_thousands(text: str) -> float:
    """The number that a text says if its commas part thousands; NaN of any other."""
    return float(text.replace(",", "")) if _THOUSANDS.fullmatch(text) else math.nan


def _number_kind(asked: Rate) -> str:
    """What a number that is asked for is called."""
    return phrase("rank") if asked.distinct else phrase("number") if asked.is_number else phrase("rating")


def doubt_text(doubt: CodeDoubt) -> str:
    """Why a new code may be mistyped."""
    if doubt.other:
        return phrase("{code} is new, and {other} is there: is it the same person?", code=doubt.code, other=doubt.other)
    return phrase(
        "{code} is new, and the codes of this study begin with {prefix}: is it right?",
        code=doubt.code,
        prefix=doubt.prefix,
    )


_POINTS = str.maketrans("\uff0e\uff0c\u066b\u066c", ".,,,")
"""Points and commas of other alphabets: those as wide as a Chinese letter, and the Arabic ones."""


def typed_rating(text: str, scale: Rate) -> float | str:
    """A number as people type it, comma or point, if it lies on the scale; else what to say.

    Nothing is rounded: what is kept is what was said.
    """
    text = text.translate(_POINTS)
    try:
        number = float("nan" if "_" in text else text.strip().replace(",", "."))
    except ValueError:
        number = math.nan
    thousands = _with_thousands(text.strip())
    if not math.isnan(number) and scale.minimum <= thousands <= scale.maximum:
        return phrase(
            "{text} may be {number:g} or {thousands:.15g}: type it without a comma.",
            text=text.strip(),
            number=number,
            thousands=thousands,
        )
    if not scale.minimum <= number <= scale.maximum:
        return phrase(
            "Not a {kind}: type a number from {low:,.15g} to {high:,.15g}.",
            kind=_number_kind(scale),
            low=scale.minimum,
            high=scale.maximum,
        )
    if number == (nearest := on_scale(number, scale)):
        return nearest
    other = on_scale(nearest + math.copysign(scale.grain, number - nearest), scale)
    low, high = sorted((nearest, other))
    return phrase("It goes in steps of {grain:g}: type {low:g} or {high:g}.", grain=scale.grain, low=low, high=high)
