"""What the experimenter's hands do: keys and buttons become events. Knows nothing of Qt, and decides nothing.

What a press means depends on what is on the screen: a page over it, a line that is being typed, the position drawn.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal, Protocol

from experiments.clock import Clock
from experiments.design.plan import Trial
from experiments.live_run import EventVerdict, LiveRun
from experiments.screens.console import keys
from experiments.screens.console.participant_link import NOT_LOST, ParticipantSide
from experiments.screens.console.typed_lines import BUT_REASON, LINE_QUESTIONS, line_as_note, line_event, line_question
from experiments.screens.phrases import phrase
from experiments.screens.texts import FLAG_RULE, kept_text, typed_line, typed_rating
from experiments.session import events
from experiments.session.events import Event, Hand, Press
from experiments.session.history import chosen_levels, entered_value
from experiments.session.judging import NOTHING_TO_REPEAT, NOTHING_TO_UNDO, REARM_HELD_S
from experiments.session.states import ARMED, EMERGENCY, Position, State
from experiments.session.steps import Ask, Asking, Rate
from experiments.synthetic.answers import SyntheticParticipant
from experiments.tasks.questions import AnswerValue, Choice

TextField = Literal["line", "number", "words"]
"""What can be typed into."""


class View(Protocol):
    """What the controls need of the window."""

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer, for a few seconds."""

    def open_line(self, question: str) -> None:
        """Let a line be typed."""

    def close_line(self) -> None:
        """Take the line away."""

    def typed(self, field: TextField) -> str:
        """What is typed in a field."""

    def take_typed(self) -> str:
        """What was typed for the step at hand, its corrections apart, also before a pause; it is taken away."""

    def show_page(self, title: str, lines: list[str]) -> None:
        """Cover the run with a page of text."""

    def close_page(self) -> None:
        """Show the run again."""

    def show_list(self) -> None:
        """Cover the run with the marks of the set."""

    def other_theme(self) -> None:
        """Change the colours."""

    def close(self) -> bool:
        """Close the window of a run that has ended."""


class Controls:
    """The experimenter's hands on a live run. `synthetic` is the synthetic participant, where it answers.

    `choices` are the answers whose keys are known before any is asked for: what comes too soon is told so.

    `drawn` is the position on the screen: a press counts for it. `kept`: the run is no practice and no training.
    """

    def __init__(
        self,
        live: LiveRun,
        clock: Clock,
        view: View,
        *,
        choices: tuple[Choice, ...] = (),
        hand: Hand = "experimenter",
        participant: ParticipantSide | None = None,
        synthetic: SyntheticParticipant | None = None,
        kept: bool = True,
    ) -> None:
        self._live, self._clock, self._view = live, clock, view
        self._choices, self._hand, self._participant = choices, hand, participant
        self._synthetic, self._kept = synthetic, kept
        self._open: tuple[keys.Name, Trial] | None = None
        self._held: keys.Hold | None = None
        self.drawn = live.position
        self.page: keys.Name | None = None
        self.ended = False

    def draw(self, position: Position) -> None:
        """Another position is on the screen; a page that covers it goes when there is something new to do."""
        if position.state is not self.drawn.state:
            self.uncover()
        if position.number != self.drawn.number or position.base is State.HALTED:
            self._keep_typed()
        if position.base is State.HALTED and self.drawn.base is not State.HALTED:
            self._set_aside(BUT_REASON)
        self.drawn = position

    # keys and buttons

    @property
    def typing(self) -> keys.Typing:
        """What is being typed."""
        return keys.Typing(line=self._open is not None, field=keys.field_at(self.drawn) is not None)

    @property
    def covered(self) -> bool:
        """Whether something that is open takes what is typed: a line, or a page."""
        return self._open is not None or self.page is not None

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The answers that are asked for, else those of which it is told that they come too soon."""
        return keys.choices_at(self.drawn) or self._choices

    def command(self, key: str, *, ctrl: bool) -> keys.Name | None:
        """The command that a key is now; `None` if it is none, and so may be text."""
        if key.startswith("#"):
            return None
        return keys.command_for(key, ctrl=ctrl, typing=self.typing, position=self.drawn, choices=self.choices)

    def press(self, at_s: float | None = None) -> Press:
        """A press at this moment, or at an earlier one, for what is on the screen now."""
        return Press(at_s=self._clock.now() if at_s is None else at_s, serial=self.drawn.serial)

    def down(self, name: keys.Name, at_s: float) -> None:
        """The key of a command went down."""
        self._live.beats.hear()
        press = self.press(at_s)
        if name == "rearm":
            self.hold(press, by_key=True)
        else:
            self.do(name, press)

    def up(self, key: str) -> None:
        """A key was let go."""
        if key == keys.BY_NAME["rearm"].key:
            self.let_go()

    def hold(self, press: Press, *, by_key: bool = False) -> None:
        """The key or button of the test shot went down: it has to be held."""
        if self.page:
            self._run_again()
        elif self.drawn.state is State.REARMING and self._held is None:
            self._held = keys.Hold(press, self._clock.now(), by_key=by_key)
            self._view.say(phrase("Hold it …"), "wait")

    def let_go(self, *, by_hand: bool = True) -> None:
        """It was let go, or something else was pressed."""
        if self._held is not None:
            self._held = None
            self._view.say(keys.not_held_text(REARM_HELD_S, by_hand=by_hand), "wait")

    def tick(self, *, here: bool = True, down: bool = True) -> None:
        """Look whether it was held for long enough, its key still `down`, and what takes what is typed `here`."""
        if self._participant is not None:
            self._participant.covered = here and self.covered
        held_s = 0.0 if self._held is None else self._held.held_s(self._clock.now(), down=down)
        if self._held is not None and held_s >= REARM_HELD_S:
            press, self._held = self._held.press, None
            self._offer(events.Rearm(held_s=held_s), press)

    def clicked(self, name: keys.Name, press: Press, *, heard: bool) -> None:
        """The button of a command was clicked; `heard`: a key comes here as well."""
        if heard:
            self._live.beats.hear()
        self.do(name, press)

    def do(self, name: keys.Name, press: Press) -> None:
        """Carry out a command; a test shot that is held for meanwhile is not what was meant."""
        self.let_go(by_hand=False)
        match name:
            case "emergency":
                self._offer(events.EmergencyStop())
                self._set_aside(BUT_REASON)
            case _ if self.page and not keys.is_for_pages(name, self._live.position):
                self._run_again()
            case "help" | "list":
                self._open_or_close(name)
            case "theme":
                self._view.other_theme()
            case "leave":
                self._leave(press)
            case "enter":
                self._entered(press)
            case _ if self.ended:
                self._after_end(name)
            case _:
                self._run(name, press)

    def _run_again(self) -> None:
        """A key that is not for a page takes it away, and does nothing else: what it does was not to be seen."""
        self.uncover()
        self._view.say(phrase("Here is the run again: press again."), "wait")

    def _after_end(self, name: keys.Name) -> None:
        if name == "stop":
            self._view.close()
        else:
            self._view.say(phrase("The run has ended: Q closes the window."), "wait")

    def _run(self, name: keys.Name, press: Press) -> None:
        self.uncover()
        if name in LINE_QUESTIONS:
            self.ask_why_it_stops() if name == "stop" else self._ask_for(name)
        elif name in keys.ANSWERS:
            self._choose(keys.ANSWERS.index(name), press)
        elif name == "no answer":
            self._rate(None, press)
        elif name == "restart":
            self._restart()
        else:
            self._offer(keys.EVENTS[name], press)

    def _offer(self, event: Event, press: Press | None = None) -> None:
        """Have an event judged, and say what there is to say of it."""
        self._say(self._live.offer(event, press))

    def _say(self, verdict: EventVerdict) -> None:
        if verdict.text:
            self._view.say(verdict.text, "wait" if verdict.taken else "bad")

    def idle(self, name: keys.Name) -> str:
        """Why a command does nothing now; empty if it does something."""
        if name in ("help", "list", "theme"):
            return ""
        if self.ended:
            return "" if name == "stop" else phrase("The run has ended.")
        if name == "enter":
            return "" if self.typing.letters else keys.why_not(name, self.drawn)
        if name == "leave" and (self._open is not None or self.page):
            return ""
        if name == "restart":
            return self._no_restart()
        return keys.why_not(name, self.drawn) or self._nothing_to(name)

    def _no_restart(self) -> str:
        refused = NOT_LOST if self._participant is None else self._participant.not_lost
        here = "" if self.drawn.state is State.PAUSED else phrase("Pause first: a new window takes the keys.")
        return refused or here

    def _restart(self) -> None:
        if (refused := self._no_restart()) or self._participant is None:
            self._view.say(refused, "bad")
        else:
            self._participant.restart()

    def _nothing_to(self, name: keys.Name) -> str:
        if name == "repeat" and self._live.moment.repeatable is None:
            return NOTHING_TO_REPEAT
        if name == "fire" and self._live.gun_silence:
            return phrase("See to the gun first.")
        if name == "undo" and self._live.moment.further_back is None:
            return NOTHING_TO_UNDO
        return ""

    # what is entered

    def _choose(self, place: int, press: Press) -> None:
        """Enter the answer at a place among the choices."""
        if place < len(self.choices):
            self._answer(self.choices[place].answer, press)

    def _answer(self, response: str, press: Press) -> None:
        drawn_s = self._drawn_s(response)
        answer = events.Answer(response=response, at_s=press.at_s, by=self._hand, response_time_s=drawn_s)
        self._give(answer, response, press)

    def _give(self, event: Event, said: AnswerValue, press: Press) -> bool:
        """Offer what was entered, or the same as a correction; whether it was taken as an answer."""
        correcting = self.drawn.state is State.CORRECTING
        verdict = self._live.offer(events.Correct(value=said) if correcting else event, press)
        self._say(verdict)
        return bool(verdict.taken) and not correcting

    def _keep_typed(self) -> None:
        """What was typed for goes, a question or a correction: what was not entered is kept as a note."""
        entry, field = self.drawn.correcting, keys.field_at(self.drawn)
        if entry is not None and field is not None:
            typed = typed_line(self._view.typed(field))
            if typed not in ("", self.entered_so_far()):
                self._live.offer(events.Note(text=f"correction of the {kept_text(entry, typed)}", trial=entry.trial))
        if self._participant is not None:
            self._participant.keep_draft(self.drawn)
        step, typed = self.drawn.step, typed_line(self._view.take_typed())
        if typed and isinstance(step, Asking):
            self._live.offer(events.Note(text=kept_text(step, typed), trial=step.trial))

    def _drawn_s(self, response: str) -> float | None:
        """The synthetic participant's response time, if it is its answer that was entered."""
        step = self.drawn.step
        if self._synthetic is None or not isinstance(step, Ask):
            return None
        chosen = chosen_levels(self._live.history, step.trial)
        answer = self._synthetic.answer(step.trial, step.question, chosen)
        return answer.response_time_s if answer.response == response else None

    def _entered(self, press: Press) -> None:
        """Enter: the line, the field, or the end of the run."""
        if self._open is not None:
            self._enter_line(*self._open, press)
            return
        match keys.field_at(self.drawn):
            case "number":
                self._number(self._view.typed("number"), press)
            case "words":
                text = typed_line(self._view.typed("words"))  # none is an answer as well
                if self._give(events.Description(text=text), text, press):
                    self._view.take_typed()
            case None if self.drawn.state is State.INFORMING:
                self._offer(events.Told(), press)
            case None if self.drawn.state is State.CLOSING:
                self._offer(events.Finish(), press)
            case _:
                pass

    def _number(self, typed: str, press: Press) -> None:
        """A rating as it was typed."""
        scale = self.drawn.correcting or self.drawn.step
        if not isinstance(scale, Rate):
            return
        rating = typed_rating(typed, scale)
        if isinstance(rating, str):
            self._view.say(rating, "bad")
        elif self._rate(rating, press):
            self._view.take_typed()

    def _rate(self, rating: float | None, press: Press) -> bool:
        return self._give(events.Rating(rating=rating, by=self._hand), rating, press)

    def entered_so_far(self) -> str:
        """What the open correction says now, to be typed over."""
        entry = self.drawn.correcting
        said = None if entry is None else entered_value(self._live.history, entry)
        return "" if said is None else f"{said:g}" if isinstance(said, float) else said

    # lines

    def _ask_for(self, name: keys.Name) -> None:
        """Ask for the line that a command needs, if it can do anything with it now."""
        refused = self.idle(name)
        if refused:
            self._view.say(refused, "bad")
        elif name == "stop" and self.drawn.base is State.HALTED:
            self._set_aside()
            self._offer(events.Stop(reason=EMERGENCY))
        elif self._open is None or self._open[0] != name:
            self._set_aside()
            moment = self._live.moment
            trial = (moment.repeatable if name == "repeat" else None) or moment.trial
            self._open = name, trial
            question = line_question(name, trial, self._live, kept=self._kept)
            self._view.open_line(phrase("{question}  (Enter saves, Esc leaves it)", question=question))

    def ask_why_it_stops(self) -> None:
        """Somebody wants to end a live run, or close its window: a gun that may fire is disarmed first."""
        self.let_go(by_hand=False)
        if self._live.position.base in ARMED:
            self._offer(events.Pause())
        self.uncover()
        self._ask_for("stop")

    def end(self) -> None:
        """The run is over: what is open or held now is for nothing any more."""
        self.ended, self._open, self._held = True, None, None

    def keep_typed(self) -> None:
        """The run ends without asking: what is half typed, for a line or a question, is kept as notes."""
        self._set_aside()
        self._keep_typed()

    def _enter_line(self, name: keys.Name, trial: Trial, press: Press) -> None:
        text = typed_line(self._view.typed("line"))
        if not text:
            self._view.say(phrase("Type a word or two, or leave it with Esc."), "bad")
        elif self._line(name, trial, text, press):
            self._close_line()

    def _set_aside(self, names: Collection[keys.Name] = tuple(LINE_QUESTIONS)) -> None:
        """Another command takes the place of an open line, for one of some: what is typed there is kept as a note."""
        if self._open is None or self._open[0] not in names:
            return
        if text := typed_line(self._view.typed("line")):
            self._live.offer(line_as_note(*self._open, text))
        self._close_line()

    def _close_line(self) -> None:
        self._open = None
        self._view.close_line()

    def _line(self, name: keys.Name, trial: Trial, text: str, press: Press) -> bool:
        """Do what a line was typed for; what comes too late is kept as a note. Whether the line is done with."""
        event = line_event(name, trial, text)
        if event is None:
            self._view.say(FLAG_RULE, "bad")
            return False
        if isinstance(event, events.Stop):
            self._keep_typed()  # behind it nothing is written any more
        verdict = self._live.offer(event, press if isinstance(event, events.EndBreak | events.Repeat) else None)
        if verdict.taken:
            self._say(verdict)
            return True
        kept = self._live.offer(line_as_note(name, trial, text))
        self._view.say(
            phrase("{text} What you typed is kept as a note.", text=verdict.text) if kept else verdict.text, "wait"
        )
        return bool(kept)

    # what belongs to the window

    def _leave(self, press: Press) -> None:
        """Leave a page, a line or a correction. It never stops anything."""
        if self.page:
            self.uncover()
        elif self._open is not None:
            self._close_line()
        elif self.drawn.state is State.CORRECTING:
            self._offer(events.Leave(), press)

    def uncover(self) -> None:
        """Show the run."""
        if self.page:
            self.page = None
            self._view.close_page()

    def _open_or_close(self, page: keys.Name) -> None:
        """Show a page; the key that opened it closes it."""
        if self.page == page:
            self.uncover()
            return
        self.page = page
        if page == "list":
            self._view.show_list()
        else:
            self._view.show_page(phrase("Keys, and what each does now. Esc leaves this page."), self.help_lines())

    def help_lines(self) -> list[str]:
        """Every key, what it does, and why it does nothing now."""
        unused = keys.ANSWERS[len(self.choices) :]
        return [self._help_line(one.name) for one in keys.KEY_COMMANDS if one.name not in unused]

    def _help_line(self, name: keys.Name) -> str:
        not_now, choices = self.idle(name), self.choices if name in keys.ANSWERS else keys.choices_at(self.drawn)
        key = keys.shown_key(name, letters=self.typing.letters, choices=choices)
        does = keys.BY_NAME[name].does
        if name in keys.ANSWERS:
            does = phrase("enters {label}", label=self.choices[keys.ANSWERS.index(name)].told)
        return f"{key:<15} {does}" + (phrase("   – not now: {because}", because=not_now) if not_now else "")
