"""What the experimenter is told to do now, from what is seen of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from experiments.live_run import HALT_UNSAVED
from experiments.screens import texts
from experiments.screens.console.keys import is_on_buttons
from experiments.screens.console.view import UNANSWERED_S, Ended, Seen, has_a_page, method_text
from experiments.screens.phrases import isolated, phrase
from experiments.screens.practice_text import practice_text, round_before_text
from experiments.session.history import counting, entered_value
from experiments.session.practice_rounds import is_to_be_repeated
from experiments.session.states import State
from experiments.session.steps import Answered, Ask, Asking, Describe, Inform, Prepare, Present, Rate, Rest, what

DISARMING = phrase("Disarming. If the gun does not fall silent: SWITCH OFF ITS POWER.")
"""What is shown from a stop until the gun has answered."""
NOT_DISARMED = phrase("The gun does not say that it is disarmed: SWITCH OFF ITS POWER.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruction:
    """What to do now: a line in the largest type, the damper in large type, what belongs to it, and a mood.

    The mood chooses the colour; the words say it as well.
    """

    title: str
    damper: str = ""
    detail: str = ""
    mood: str = "act"


def instruction(seen: Seen) -> Instruction:
    """What to do now."""
    if seen.ended is not None:
        return _end(seen, seen.ended)
    if seen.position.state in (State.SETTING, State.PREPARING) and (trouble := seen.gun_trouble or seen.gun_silence):
        return _see_to_the_gun(trouble)
    shown = _OF_STATE.get(seen.position.state, _MOMENT)
    return shown if isinstance(shown, Instruction) else shown(seen)


def _see_to_the_gun(trouble: str) -> Instruction:
    """Nobody is to take a gun in an unknown state."""
    detail = phrase(
        "{trouble}.\nLook at its cable and its power before anybody takes it. When it answers, the run goes on here.",
        trouble=trouble[:1].upper() + trouble[1:].rstrip("."),
    )
    return Instruction(title=phrase("See to the gun first"), detail=detail, mood="bad")


def _end(seen: Seen, ended: Ended) -> Instruction:
    about = seen.about
    kept = ended.saved if not about.band else None  # of a practice or training nothing is gone on with
    safe = "" if kept is None else _read_back(seen, kept)
    close = phrase("Q closes this window.")
    if ended.reason is None:
        again = is_to_be_repeated(about.setup.config, about.plan, seen.told)
        last = _practised(seen, over=True) if again else about.last  # the run itself does not come next
        return Instruction(title=phrase("Finished"), detail=f"{safe}{last}\n{close}", mood="good")
    resumed = "" if kept is None else phrase("{safe}The run can be resumed.", safe=safe)
    detail = "\n".join(filter(None, (_sentence(ended.reason), resumed, close)))
    return Instruction(title=phrase("Stopped"), detail=detail, mood="bad")


def _read_back(seen: Seen, kept: int) -> str:
    """How many answers are on the disk, and, where a trial was presented again, how many of them count."""
    given, count = (sum(isinstance(word, Answered) for _, word in told) for told in (seen.told, counting(seen.told)))
    if given == count:
        return phrase("Read back from the disk: {answers}, all that were given. ", answers=_answers(kept))
    return phrase(
        "Read back from the disk: {answers}, all that were given; without those before a trial was presented again: "
        "{count}. ",
        answers=_answers(kept),
        count=count,
    )


def _sentence(why: str) -> str:
    """A reason as a sentence of its own; a path at its beginning stays as it is.

    >>> _sentence("the gun is gone"), _sentence("results/a.jsonl: the journal was deleted")
    ('The gun is gone.', 'results/a.jsonl: the journal was deleted.')
    """
    first = why if "/" in why.split(" ", 1)[0] else f"{why[:1].upper()}{why[1:]}"
    return first if first.endswith((".", "!", "?")) else f"{first}."


def _answers(count: int) -> str:
    return phrase("1 answer") if count == 1 else phrase("{count} answers", count=count)


_MOMENT = Instruction(title=phrase("One moment"), mood="wait")


def _turned(seen: Seen, *, damper: str, then: str) -> Instruction:
    step = seen.position.step
    if not isinstance(step, Prepare):
        return _MOMENT
    before = round_before_text(seen.about.setup.config, seen.about.plan, seen.told, step.trial)
    again = texts.again_text(seen.told, step)
    told = texts.read_out_text(seen.about.plan, step).strip()
    return Instruction(
        title=phrase("{turn}\nand hand it over", turn=texts.turn_text(step)),
        damper=damper.format(settings=texts.settings_text(step), method=method_text(seen.about, step.trial)),
        detail="\n".join(filter(None, (before, told, again, then))),
    )


def _setting(seen: Seen) -> Instruction:
    step = seen.position.step
    names = " and ".join(name for name, _ in step.settings) if isinstance(step, Prepare) else ""
    then = phrase("Confirm the {names} with {damper_key}.", names=names, damper_key=seen.key("damper"))
    return _turned(seen, damper=phrase("Set the {settings}{method}"), then=then)


def _preparing(seen: Seen) -> Instruction:
    step = seen.position.step
    damper = phrase("The {settings}{method}") if isinstance(step, Prepare) and step.settings else ""
    return _turned(seen, damper=damper, then=phrase("Then fire with {fire_key}.", fire_key=seen.key("fire")))


def _train(seen: Seen) -> Instruction:
    least_s = seen.position.step.least_exposure_s if isinstance(seen.position.step, Present) else 0.0
    after = phrase(", not before {least_s:g}\N{NO-BREAK SPACE}s", least_s=least_s) if least_s else ""
    silent = seen.gun_silent_s or seen.gun_trouble
    fires = phrase("The gun does not answer.") if silent else phrase("The gun goes on firing until then.")
    then = phrase("Press Space when the participant says it{after}.", after=after)
    return Instruction(title=phrase("Wait for “next”"), detail=f"{fires} {then}", mood="ask")


def _asking(seen: Seen) -> Instruction:
    step = seen.position.step
    if not isinstance(step, Ask):
        return _MOMENT
    own_keys = either(
        phrase("{own_key} for {label}", own_key=one.own_key.upper(), label=one.told) for one in step.choices
    )
    own = phrase(
        "Awaited: the participant's own key, {own_keys}.\n{keys} enters it for them.",
        own_keys=own_keys,
        keys=_keys(step),
    )
    listed = "" if is_on_buttons(step.choices) else "".join(f"\n{one.key.upper()}  {one.told}" for one in step.choices)
    told = phrase("Enter what the participant says: {keys}.", keys=_keys(step))
    there = (_asked_there(seen, own, told) if seen.about.participant_keys else told) + listed
    about = _order_told(seen, step) if step.later else ""
    return Instruction(title=isolated(step.text), detail="\n".join(filter(None, (about, there))), mood="ask")


def _keys(asked: Ask) -> str:
    return either(one.key.upper() for one in asked.choices)


def either(words: Iterable[str]) -> str:
    """Words, one of which is meant.

    >>> either(["F", "B"]), either("123")
    ('F or B', '1, 2 or 3')
    """
    *before, last = words
    return phrase("{before} or {last}", before=", ".join(before), last=last) if before else last


def _asked_there(seen: Seen, awaited: str, here: str) -> str:
    """What is awaited from the participant's screen, or that there is none any more, or none yet."""
    if not seen.participant_gone:
        return awaited
    if seen.participant_starting:
        return phrase("Their screen is being started again. Until it is there: {here}", here=here)
    return phrase("Their screen is gone. {here} To start it again, pause first.", here=here)


def _rating(seen: Seen) -> Instruction:
    step = seen.position.step
    if not isinstance(step, Rate | Describe):
        return _MOMENT
    there = _typed_where(seen, step) if seen.about.participant_rates else ""
    question = isolated(step.text)
    title, *more = (_order_told(seen, step), question) if step.later else (question,)
    return Instruction(title=title, detail="\n".join(filter(None, (*more, there))), mood="ask")


def _typed_where(seen: Seen, step: Rate | Describe) -> str:
    """Where that is entered, beside a participant's screen for ratings and words."""
    if not has_a_page(step):
        return phrase("Type here what they say: it has no page on their screen.")
    kind = phrase("words") if isinstance(step, Describe) else what(step)
    own = phrase("Awaited: the participant's {kind} on their own screen, or typed here.", kind=kind)
    return _asked_there(seen, own, phrase("Type here what they say."))


def _order_told(seen: Seen, step: Asking) -> str:
    """Which stimulus it is about, in the participant's words: it is read out."""
    return isolated(texts.ordinal(seen.about.plan, step.trial, seen.about.messages))


def _telling(seen: Seen) -> Instruction:
    step = seen.position.step
    if not isinstance(step, Inform):
        return _MOMENT
    title = {
        "instruction": phrase("Tell the participant"),
        "consent": phrase("Ask the participant for their consent"),
        "feedback": phrase("Tell the participant"),
    }[step.what]
    return Instruction(
        title=title,
        detail=phrase("“{text}”\n{enter_key} when that is done.", text=step.text, enter_key=seen.key("enter")),
        mood="act",
    )


def _resting(seen: Seen) -> Instruction:
    until_s, step = seen.position.until_s, seen.position.step
    left_s = 0 if until_s is None else max(0, round(until_s - seen.now_s))
    between = step.between if isinstance(step, Rest) else ""
    told = phrase("Between {between}. It ends by itself with a tone.", between=between)
    return Instruction(
        title=phrase("Break: {duration}", duration=texts.duration_text(left_s)),
        detail="\n".join(filter(None, [_practised(seen, over=False), told])),
        mood="rest",
    )


def _practised(seen: Seen, *, over: bool) -> str:
    return practice_text(seen.about.setup.config, seen.about.plan, seen.told, over=over)


def _paused(seen: Seen) -> Instruction:
    if seen.participant_starting:
        detail = phrase(
            "Their screen is being started again. {go_on_key} goes on; until it is there you enter the answers.",
            go_on_key=seen.key("go on"),
        )
    elif seen.position.why and seen.participant_gone:
        again = phrase(
            "{restart_key} starts it again. {go_on_key} goes on without it: you enter the answers.",
            restart_key=seen.key("restart"),
            go_on_key=seen.key("go on"),
        )
        detail = f"{_sentence(seen.position.why)}\n{again}"
    else:
        detail = phrase("Nothing happens meanwhile. {go_on_key} goes on.", go_on_key=seen.key("go on"))
        if seen.position.why:
            detail = f"{_sentence(seen.position.why)}\n{detail}"
        if seen.participant_gone:
            gone = phrase("Their screen is gone: {restart_key} starts it again.", restart_key=seen.key("restart"))
            detail = f"{detail}\n{gone}"
    gun, mood = _since_pause(seen)
    return Instruction(title=phrase("Paused"), damper=gun, detail=detail, mood=mood)


def _since_pause(seen: Seen) -> tuple[str, str]:
    """What the gun said since the pause, and a word that chooses the colour; a gun that answers does so at once."""
    paused_s = seen.position.since_s if seen.position.paused_s is None else seen.position.paused_s
    match _says_disarmed(seen, paused_s):
        case True:
            return phrase("The gun is disarmed."), "wait"
        case _ if seen.now_s - paused_s <= UNANSWERED_S:
            return "", "wait"
        case _:
            return NOT_DISARMED, "bad"


def _correcting(seen: Seen) -> Instruction:
    entry = seen.position.correcting
    if entry is None:
        return _MOMENT
    return Instruction(
        title=phrase("Correct the {what}", what=texts.entry_name(seen.told, entry)),
        damper=texts.place_text(seen.about.plan, entry.trial),
        detail=phrase(
            "It was entered as {value}. {entered_how}\n{undo_key} goes further back, Esc leaves it.",
            value=texts.value_text(entry, entered_value(seen.told, entry)),
            entered_how=_entered_how(entry),
            undo_key=seen.key("undo"),
        ),
        mood="ask",
    )


def _entered_how(entry: Asking) -> str:
    match entry:
        case Ask():
            return phrase("Enter what the participant said: {keys}.", keys=_keys(entry))
        case Rate(may_be_skipped=True):
            return phrase("Type what the participant said, Enter saves; Ctrl+X for no answer.")
        case Rate():
            return phrase("Type what the participant said, Enter saves.")
        case Describe():
            return phrase("Type the participant's words; Enter saves.")


def _halted(seen: Seen) -> Instruction:
    closes = phrase(
        "Nothing fires in this run any more. {reason_key} says why, {stop_key} closes it.",
        reason_key=seen.key("reason"),
        stop_key=seen.key("stop"),
    )
    resumed = HALT_UNSAVED if seen.halt_unsaved else phrase("Resumed, it begins with a test shot.")
    resumed = "" if seen.about.band else resumed
    return Instruction(
        title=phrase("EMERGENCY STOP"), damper=_since_halt(seen), detail=f"{closes} {resumed}".strip(), mood="bad"
    )


def _since_halt(seen: Seen) -> str:
    """What the gun said since the emergency stop: what it said before says nothing of now."""
    match _says_disarmed(seen, seen.position.since_s):
        case None:
            return DISARMING
        case True:
            return phrase("The gun itself says that it is disarmed.")
        case _:
            return NOT_DISARMED


def _says_disarmed(seen: Seen, since_s: float) -> bool | None:
    """Whether the gun says that it is disarmed; `None` if it was not asked since then.

    What it said before it fell silent says nothing of now.
    """
    gun = seen.gun
    if gun is None or gun.asked_s < since_s:
        return None
    return not seen.gun_silent_s and gun.status is not None and gun.status.state == "disarmed"


def _closing(seen: Seen) -> Instruction:
    asked = phrase("Is there anything to correct, to note or to flag? Enter ends the run.")
    detail = "\n".join(filter(None, [_practised(seen, over=True), asked]))
    return Instruction(title=phrase("Everything is answered"), detail=detail, mood="good")


_OF_STATE: dict[State, Instruction | Callable[[Seen], Instruction]] = {
    State.REARMING: Instruction(
        title=phrase("There was an emergency stop.\nStand clear."),
        detail=phrase(
            "Put the gun where it hurts nobody, then hold T for a second: a test shot, then the run goes on."
        ),
        mood="bad",
    ),
    State.SETTING: _setting,
    State.PREPARING: _preparing,
    State.FIRING: Instruction(title=phrase("Firing"), detail=phrase("F12 stops it at once."), mood="wait"),
    State.TRAIN: _train,
    State.ASKING: _asking,
    State.RATING: _rating,
    State.DESCRIBING: _rating,
    State.INFORMING: _telling,
    State.RESTING: _resting,
    State.CLOSING: _closing,
    State.PAUSED: _paused,
    State.CORRECTING: _correcting,
    State.HALTED: _halted,
}
