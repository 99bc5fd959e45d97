"""How far a run is, and what comes next, as the console says it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise

from device import GunStatus
from experiments.design.plan import Trial
from experiments.design.stimuli import settings
from experiments.screens import texts
from experiments.screens.console.view import About, GunSeen, ParticipantSeen, Seen
from experiments.screens.phrases import phrase
from experiments.session import steps
from experiments.session.duration import break_s
from experiments.session.history import History, about_trials, answered, done, entries, felt, of_one_set
from experiments.session.practice_rounds import is_needed
from experiments.session.remarks import EntryCorrected, Flagged, Noted, Remark
from experiments.session.states import State
from experiments.session.steps import Asking, Outcome, Step


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialCount:
    """How many trials are done of those planned, and of what; `at_most`: it may be over sooner."""

    what: str
    count: int
    planned: int
    at_most: bool = False


def trials_done(seen: Seen) -> list[TrialCount]:
    """How far the run is, seen from the current trial.

    Trials of the set, of the session and of the experiment; where all are rated after all were felt, felt and rated.
    """
    design, plan, here = seen.about.setup.config, seen.about.plan, seen.here
    trials = plan.trials
    if seen.about.rated_last:
        rated = answered(seen.told, design.judged_later)
        found = [_count("felt", trials, felt(seen.told)), _count("rated", trials, rated)]
        return [replace(one, at_most=plan.may_end_early) for one in found]
    finished = done(seen.told, design)
    session = [trial for trial in trials if trial.session == here.session]
    parts = {"set": plan.set_of(here), "session": session, "experiment": trials}
    whole = ("set",) if plan.practice else ()  # a round is always done to its end
    return [
        replace(_count(what, part, finished), at_most=plan.may_end_early and what not in whole)
        for what, part in parts.items()
    ]


def _count(what: str, trials: Sequence[Trial], finished: Collection[Trial | None]) -> TrialCount:
    return TrialCount(what=what, count=sum(trial in finished for trial in trials), planned=len(trials))


STRIP = 40
"""So many response times are shown at most."""


def coming(seen: Seen, count: int = 3) -> list[str]:
    """The next few things to do after the trial at hand; after an emergency stop, or at the end, nothing is."""
    step = seen.position.step
    if seen.ended is not None or seen.position.base is State.HALTED:
        return []
    answers = answered(seen.told, seen.about.setup.config.questions)
    is_over = isinstance(step, steps.Close) or answers.issuperset(seen.about.plan.trials)
    return [phrase("the end")] if is_over else [*islice(_to_come(seen), count)]


def _to_come(seen: Seen) -> Iterator[str]:
    """All that is to do after the trial at hand."""
    about, step, here = seen.about, seen.position.step, seen.here
    resting, later = isinstance(step, steps.Rest), isinstance(step, Asking) and step.later
    if isinstance(step, Asking) and step.later:
        yield from _still_asked(about, step)
        here = about.plan.set_of(here)[-1]
    trials = about.plan.trials
    after = [trial for trial in trials[trials.index(here) + 1 :] if trial.track not in seen.over]
    if resting and not is_needed(about.setup.config, about.plan, seen.told, here.set + 1):
        after = []  # of a practice, whose score is told in a break and nowhere before
    for before, trial in pairwise([here, *after]):
        at_hand = before == here
        if not (of_one_set(before, trial) or (at_hand and (resting or later))):
            yield from _asked_of_all(about)
        if not (at_hand and resting):  # a break that is taken now is not still to come
            yield from _break_between(about, before, trial)
        yield from _to_do(about, before, trial)
    if after or not (later or resting):
        yield from _asked_of_all(about)
    yield phrase("the end")


def _still_asked(about: About, step: Asking) -> Iterator[str]:
    """What is still asked about the trials of a set that were felt."""
    design = about.setup.config
    asked = [(trial, name) for trial in about.plan.set_of(step.trial) for name in design.asked_later]
    for trial, name in asked[asked.index((step.trial, step.question)) + 1 :]:
        place, kind = texts.ordinal(about.plan, trial), design.questions[name].kind
        if kind == "text":
            same = trial == step.trial
            yield phrase("its “{name}”", name=name) if same else phrase("“{name}”: {ordinal}", name=name, ordinal=place)
        else:
            called = {"rating": phrase("rating"), "number": phrase("number"), "ranking": phrase("rank")}
            yield phrase("{kind}: {ordinal}", kind=called.get(kind, phrase("answer")), ordinal=place)


def _asked_of_all(about: About) -> Iterator[str]:
    """What is asked about all trials of a set, once they were felt."""
    kinds = {about.setup.config.questions[name].kind for name in about.setup.config.asked_later}
    judged = phrase("ratings") if kinds <= {"rating", "text"} else phrase("answers")
    if kinds == {"text"}:
        yield phrase("words")
    elif kinds:
        yield phrase("{judged} and words", judged=judged) if "text" in kinds else judged


def _to_do(about: About, before: Trial, trial: Trial) -> list[str]:
    wanted, was = _set_by_hand(about, trial), _set_by_hand(about, before)
    told = (
        [phrase("instruction: {instruction}", instruction=trial.instruction)]
        if trial.instruction and about.plan.opens_set(trial)
        else []
    )
    changed = "".join(f", {name.upper()} {value.upper()}" for name, value in wanted.items() if was.get(name) != value)
    return [*told, f"{trial.direction.upper()}{changed}"]


def _set_by_hand(about: About, trial: Trial) -> dict[str, str]:
    """What is set by hand for a trial, or for its first interval."""
    return dict(settings(about.setup.config, about.setup.gun, trial.levels_at(0) or trial.levels))


def _break_between(about: About, before: Trial, trial: Trial) -> list[str]:
    seconds = break_s(about.setup.config, before, trial)
    return [phrase("break of {duration}", duration=texts.duration_text(seconds))] if seconds else []


def answer_lines(seen: Seen) -> list[str]:
    """What was entered in the set at hand, as it counts now."""
    told = about_trials(seen.told, seen.about.plan.set_of(seen.here))
    return [texts.entry_text(seen.about.plan, told, entry) for entry in entries(told, seen.here)]


def marks(seen: Seen) -> list[str]:
    """Flags, notes, corrections and repeats of the set at hand, in order."""
    here = seen.here
    found = [
        _mark(seen.told, word) for step, word in seen.told if (trial := _about(step, word)) and of_one_set(trial, here)
    ]
    return list(filter(None, found)) or [phrase("Nothing was flagged, noted, corrected or repeated in this set.")]


def _about(step: Step | None, word: Outcome | Remark) -> Trial | None:
    return word.trial if isinstance(word, steps.Repeated) or (step is None and hasattr(word, "trial")) else None


def _mark(told: History, word: Outcome | Remark) -> str:
    match word:
        case Flagged():
            return phrase("Trial {trial}: flagged {flag}", trial=word.trial.trial, flag=word.flag)
        case Noted(trial=Trial() as trial):
            return phrase("Trial {trial}: “{text}”", trial=trial.trial, text=word.text)
        case EntryCorrected():
            return phrase(
                "Trial {trial}: {corrected}", trial=word.trial.trial, corrected=texts.corrected_text(told, word)
            )
        case steps.Repeated():
            return phrase("Trial {trial}: to be presented again ({reason})", trial=word.trial.trial, reason=word.reason)
        case _:
            return ""


def gun_text(seen: Seen) -> tuple[str, str]:
    """The gun's state in words, and a word that chooses the colour."""
    said = seen.gun
    if said is None:
        return phrase("Gun: not seen yet"), "wait"
    status: GunStatus | None = said.status
    if status is None or status.fault:
        return phrase("Gun: FAULT – {fault}", fault=seen.gun_trouble), "bad"
    if seen.ended is not None and status.state != "disarmed":
        return phrase("Gun: not looked at any more"), "wait"
    if seen.gun_silent_s:
        return phrase("Gun: no answer for {silent_s:.0f} s", silent_s=seen.gun_silent_s), "wait"
    blanks = seen.about.setup.config.trial.has_blanks  # nothing here gives one away: no count, no coil that gets warm
    coil = phrase("coil {coil_temperature_C:.0f} °C", coil_temperature_C=status.coil_temperature_C)
    beside = [] if blanks else [texts.shots_text(status.shots), coil]
    mood = {"armed": "act", "resetting": "wait", "disarmed": "good", "fault": "bad"}[status.state]
    state, mood = (phrase("one moment"), "wait") if blanks and _may_have_fired(seen, said) else (status.state, mood)
    return "\n".join(filter(None, (phrase("Gun: {state}", state=state), " · ".join(beside)))), mood


def _may_have_fired(seen: Seen, said: GunSeen) -> bool:
    """Whether a shot is due, or what the gun said is of the time when one was."""
    here = seen.position
    return here.state is State.FIRING or (said.asked_s < here.since_s and not isinstance(here.step, steps.Prepare))


def focus_text(seen: Seen, *, here: bool) -> tuple[str, str]:
    """Whose the keys are, and that noise does not play that should; and a word that chooses the colour."""
    text, mood = _keys_text(seen, here=here)
    if seen.participant is None or not seen.participant.noise_off:
        return text, mood
    return phrase("{keys}\nMasking noise: OFF", keys=text), "bad"


def are_keys_heard(participant: ParticipantSeen | None, *, here: bool) -> bool:
    """Whether F12 is heard wherever the keys are: in this window, or in the participant's."""
    return here or (participant is not None and participant.focused)


def _keys_text(seen: Seen, *, here: bool) -> tuple[str, str]:
    """Empty where nothing else could have them."""
    if here:
        return (phrase("Keys: this window"), "good") if seen.participant is not None else ("", "good")
    if are_keys_heard(seen.participant, here=here):
        return phrase("Keys: the participant's screen (F12 works there)"), "wait"
    return phrase("Keys: ANOTHER WINDOW – click here"), "bad"


def own_times_s(seen: Seen) -> list[float]:
    """The participant's own response times of this session, in order: by their own hand alone."""
    times = [
        (step.trial, word.response_time_s)
        for step, word in seen.told
        if isinstance(step, steps.Ask) and isinstance(word, steps.Answered)
        if word.response_time_valid and word.response_time_s is not None
    ]
    return [time_s for trial, time_s in times if trial.session == seen.here.session][-STRIP:]
