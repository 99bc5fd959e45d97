"""The lines that are typed for a command: what is asked, and which event comes of it."""

from __future__ import annotations

from experiments.design.plan import Trial
from experiments.live_run import LiveRun
from experiments.screens.console import keys
from experiments.screens.phrases import phrase
from experiments.screens.texts import short_place
from experiments.session import events
from experiments.session.events import Event
from experiments.session.history import trial_at
from experiments.session.remarks import flag_word
from experiments.session.steps import is_begun

LINE_QUESTIONS: dict[keys.Name, str] = {
    "end break": phrase("Why does the break end early?"),
    "repeat": phrase("Why is trial {trial} to be presented again?"),
    "flag": phrase("Flag {place} as (a word such as noise or late)"),
    "note": phrase("Note on {place}"),
    "reason": phrase("Why was there an emergency stop?"),
    "stop": phrase("Why does the run stop here? It can be resumed."),
}
BUT_REASON: tuple[keys.Name, ...] = tuple(name for name in LINE_QUESTIONS if name != "reason")
"""The lines that an emergency stop takes away."""


def line_question(name: keys.Name, trial: Trial, live: LiveRun, *, kept: bool) -> str:
    """What is asked above the line that a command needs; `kept`: the run is no practice and no training."""
    if name == "stop" and not kept:
        return phrase("Why does it stop here? It is begun anew each time.")
    if name == "stop" and is_begun(live.position.step):
        return phrase(
            "Why does the run stop here? Resumed, it presents trial {trial} again: answers of it so far do not count.",
            trial=trial.trial,
        )
    place = short_place(trial, trial_at(live.plan, live.history, live.position.step))
    return LINE_QUESTIONS[name].format(trial=trial.trial, place=place)


def line_event(name: keys.Name, trial: Trial, text: str) -> Event | None:
    """What a typed text comes to; `None` if it is to be a flag and is none."""
    match name:
        case "end break":
            return events.EndBreak(reason=text)
        case "repeat":
            return events.Repeat(reason=text, trial=trial)
        case "flag":
            flag = flag_word(text)
            return None if flag is None else events.Flag(flag=flag, trial=trial)
        case "note":
            return events.Note(text=text, trial=trial)
        case "reason":
            return events.Reason(text=text)
        case _:
            return events.Stop(reason=text)


def line_as_note(name: keys.Name, trial: Trial, text: str) -> events.Note:
    """What was typed for something that is not done any more."""
    return events.Note(text=f"{'break' if name == 'end break' else name}: {text}", trial=trial)
