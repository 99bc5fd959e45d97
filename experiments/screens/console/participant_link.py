"""The participant's own screen beside the console: what it is to show follows the run; what is done there is offered.

Nobody waits for it: every question is asked in a thread of its own, and the experimenter can answer instead.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.live_run import LiveRun
from experiments.screens.console.keys import choices_at
from experiments.screens.console.view import Message, ParticipantSeen, Trouble, has_a_page
from experiments.screens.participant import messages
from experiments.screens.participant.link import ParticipantError, ParticipantLink
from experiments.screens.phrases import phrase
from experiments.screens.texts import kept_text, place_in_session, place_in_set
from experiments.session import events
from experiments.session.events import OwnHand, OwnHandEvent
from experiments.session.history import ranks_of_others
from experiments.session.judging import MINIMISED
from experiments.session.remarks import Noted
from experiments.session.states import Position, State
from experiments.session.steps import Ask, Asking, Describe, Inform, Rate, Step
from experiments.tasks.questions import first_choices

WAIT, PAUSED, THANKS = ENGLISH_MESSAGES.wait, ENGLISH_MESSAGES.paused, ENGLISH_MESSAGES.thanks

Shows = str | tuple[int, tuple[float, ...]]
"""What is to stand there: a text, or a question by the number of its step, with the ranks that others have."""
Wanted = Callable[[], bool]
"""Whether a question is still to be asked."""

NOT_LOST = phrase("The participant's screen is not lost.")

_SIDES = {"left": -1, "right": 1}
"""Where an answer lies among the others by its key; in the order of the design between them."""


def noise_of(link: ParticipantLink) -> messages.NoiseIs:
    """Masking noise, which ends with the participant's process; why it stays off, if it does."""
    try:
        return link.noise(on=True)
    except ParticipantError as error:
        return messages.NoiseIs(on=False, message=phrase("Masking noise stays off: {error}", error=error))


class ParticipantSide:
    """The participant's screen. `open_link` starts its program, again if need be.

    `rates` and `own_keys` say what is asked there; `noise` whether masking noise is wanted; `hand` whose hand it is.
    `setup` and `said` are in the participant's language.
    """

    def __init__(
        self,
        link: ParticipantLink,
        open_link: Callable[[], ParticipantLink],
        setup: Setup[DesignConfig],
        *,
        rates: bool,
        own_keys: bool,
        noise: messages.NoiseIs | None = None,
        hand: OwnHand = "participant",
        said: ParticipantMessages = ENGLISH_MESSAGES,
    ) -> None:
        self._link, self._open_link, self._messages = link, open_link, said
        self._shown = {WAIT: said.wait, PAUSED: said.paused, THANKS: said.thanks, messages.BETWEEN: said.between}
        self._choices = first_choices(setup.config)
        self.rates, self.own_keys = rates, own_keys
        self.plan: Plan | None = None
        """Known once the run has begun."""
        self._noise, self._hand = noise, hand
        self._lock = threading.RLock()
        self._live: LiveRun | None = None
        self._tell: Callable[[Message], None] = lambda _: None
        self._shows: Shows = WAIT
        self._serial = -1
        self._closed = self._starting = False
        self._draft: messages.Draft | None = None
        """What stands on the participant's page and was not given yet."""
        self._typed_on = set[int]()
        """The steps that had a page to type on."""
        self.covered = False
        """Whether a line or a page of the console takes what is typed: the participant's keys are not told from it."""

    def begin(self, live: LiveRun, tell: Callable[[Message], None]) -> None:
        """Take the place beside a console."""
        self._live, self._tell, self.plan = live, tell, live.plan
        if self._noise is not None:
            self._noise_is(self._noise)
        self._link.listen(self._heard, self._gone)
        self._see()

    def _see(self) -> None:
        """Tell the console how the participant's screen stands."""
        focused, failure = self._link.focused, self._link.failure or ""
        has_keys = focused is not None and focused.on and not failure
        noise_off = self._noise is not None and not self._noise.on
        seen = ParticipantSeen(focused=has_keys, failure=failure, starting=self._starting, noise_off=noise_off)
        self._tell(seen)

    def _noise_is(self, noise: messages.NoiseIs) -> None:
        """How the noise stands from now on: seen and on record, and said if it is off."""
        self._noise = noise
        self._see()
        if not noise.on:
            self._tell(Trouble(text=noise.message))
        if self._live is not None:
            self._live.remark(Noted(trial=None, text=noise.message or phrase("Masking noise plays.")))

    def _noise_ends(self, why: str) -> None:
        """Noise plays no more, if it did."""
        if self._noise is not None and self._noise.on:
            self._noise_is(messages.NoiseIs(on=False, message=why))

    def _noise_changes(self, word: messages.NoiseEnded | messages.NoiseBroken) -> None:
        """Noise has ended, or may have been silent for a while: said, and on record."""
        if isinstance(word, messages.NoiseEnded):
            self._noise_ends(word.message)
            return
        text = phrase(
            "Masking noise may have broken off for {seconds} s: the program that plays it stood still.",
            seconds=f"{word.stood_still_s:.1f}",
        )
        self._tell(Trouble(text=text))
        if self._live is not None:
            self._live.remark(Noted(trial=None, text=text))

    @property
    def asking(self) -> bool:
        """Whether the participant is asked something at this moment."""
        return self._link.asking

    def follow(self, position: Position) -> None:
        """Have what belongs to a position on the participant's screen; one that is told late is out of date."""
        with self._lock:
            if position.serial < self._serial:
                return
            self._serial = position.serial
            shows = self._to_be_shown(position)
            if shows == self._shows or self._closed:
                return
            self._shows = shows
            if isinstance(shows, str):
                told = tuple(self._said(position)) if self.own_keys and shows == PAUSED else ()
                self._link.show(self._shown.get(shows, shows), tell=told, keep_keys=shows == messages.BETWEEN)
            else:
                self._link.cancel()
                threading.Thread(target=self._ask, args=(position, shows), daemon=True, name="participant").start()

    def _said(self, position: Position) -> dict[str, str]:
        """The participant's keys, by PsychoPy's names, and what they say: also before anything is asked."""
        return {one.own_key: one.answer for one in choices_at(position) or self._choices}

    def _to_be_shown(self, position: Position) -> Shows:
        base, by_screen = position.base, self.rates and has_a_page(position.step)
        if State.PAUSED in position.states:
            return PAUSED
        if (base is State.ASKING and self.own_keys) or (base in (State.RATING, State.DESCRIBING) and by_screen):
            return position.number, self._taken(position.step)
        if base is State.INFORMING and isinstance(position.step, Inform):
            return position.step.text
        if base is State.SAVING and by_screen:
            return messages.BETWEEN
        return THANKS if base in (State.CLOSING, State.STOPPED) else WAIT

    def _ask(self, position: Position, shows: Shows) -> None:
        """Ask; a question that was called off is over, one that fails otherwise leaves the answer to the console."""

        def wanted() -> bool:
            return self._shows == shows

        try:
            match position.step:
                case Ask() as step:
                    self._judged(step, position, wanted)
                case Rate() as step:
                    self._rated(step, position, wanted)
                case Describe() as step:
                    self._described(step, position, wanted)
        except ParticipantError as error:
            if wanted() and self._link.failure is None:
                self._tell(Trouble(text=phrase("Enter the answer here: {error}.", error=error)))

    def _judged(self, step: Ask, position: Position, wanted: Wanted) -> None:
        from_s = position.since_s if self._live is None else self._live.moment.keys_from_s
        paused = self._live is not None and self._live.moment.paused_between(from_s, position.since_s)
        question = messages.AskChoice(
            question=self._numbered(step) if step.later else step.text,
            answers=tuple(
                messages.KeyedAnswer(answer=one.answer, label=one.label, key=one.own_key)
                for one in sorted(step.choices, key=lambda one: _SIDES.get(one.own_key, 0))
            ),
            onset_s=position.since_s if paused else from_s,  # a key in a pause is no answer
            once_seen=paused or not position.asked_at_onset,  # nor one while their screen still says something else
            step=position.number,
        )
        while wanted() and not self._keyed(step, question, position, wanted):
            # it was refused: the next key counts, and what is open at the console stays in front
            question = replace(question, once_seen=True, keep_keys=True)

    def _numbered(self, step: Ask) -> str:
        return self._messages.numbered.format(number=self._place(step)[0], question=step.text)

    def _keyed(self, step: Ask, question: messages.AskChoice, position: Position, wanted: Wanted) -> bool:
        """Have the participant press a key; whether it was taken for the answer."""
        given = self._link.ask_choice(question, wanted=wanted)
        key = events.ParticipantKey(
            response=given.response,
            at_s=given.pressed_s,
            step=position.number,
            by=self._hand,
            typed=self.covered,
            timed=step.later or not given.stood_still_s,
        )
        taken = self._offered(key, step.trial)
        if taken and not key.timed:
            lost = phrase(
                "The participant’s screen stood still for {seconds} s: the answer counts, its time does not. Close "
                "what else runs on this computer.",
                seconds=f"{given.stood_still_s:.1f}",
            )
            self._tell(Trouble(text=lost, trial=step.trial))
        return taken

    def _rated(self, step: Rate, position: Position, wanted: Wanted) -> None:
        number, of = self._place(step)
        while wanted():
            given = self._link.ask_rating(
                messages.AskRating(
                    number=number,
                    of=of,
                    question=step.text,
                    minimum=step.minimum,
                    maximum=step.maximum,
                    minimum_text=step.minimum_text,
                    maximum_text=step.maximum_text,
                    grain=step.grain,
                    distinct=step.distinct,
                    taken=self._taken(step),
                    keep_keys=self._leaves_keys(position),
                    draft=position.number,
                ),
                wanted=wanted,
            )
            event = events.ParticipantRated(rating=given.rating, step=position.number, by=self._hand)
            if self._offered(event, step.trial):
                return  # else a correction gave that rank to another one meanwhile

    def _leaves_keys(self, position: Position) -> bool:
        """Whether a page leaves keys and front to the console, as the one before was answered at the console.

        Who did so may still be typing: a page that took the keys would have the rest as the participant's own words.
        """
        self._typed_on.add(position.number)
        before = position.number - 1
        return before in self._typed_on and position.entered_for(before) is not None

    def _taken(self, step: Step | None) -> tuple[float, ...]:
        """The ranks that are no longer free."""
        others = ranks_of_others(self._live.history, step) if self._live is not None and isinstance(step, Rate) else {}
        return tuple(rank for rank in others if isinstance(rank, float))

    def _place(self, step: Asking) -> tuple[int, int]:
        """By which number a stimulus is named, and of how many, as at the console: after a block that in its set."""
        if self.plan is None:
            raise TypeError("nothing is asked before the run has begun")
        return (place_in_set if step.later else place_in_session)(self.plan, step.trial)

    def _described(self, step: Describe, position: Position, wanted: Wanted) -> None:
        number, of = self._place(step)
        keep_keys = self._leaves_keys(position)
        question = messages.AskDescription(
            number=number, of=of, question=step.text, keep_keys=keep_keys, draft=position.number
        )
        given = self._link.ask_description(question, wanted=wanted)
        self._offered(events.ParticipantDescribed(text=given.comment, step=position.number, by=self._hand), step.trial)

    def _offered(self, event: OwnHandEvent, trial: Trial | None) -> bool:
        """Offer what the participant did; whether it was taken. If not, the console says why.

        Until the next trial is answered, if another answer had been entered there: it may have to be corrected.
        """
        if self._live is None:
            return True
        self._draft = None
        verdict = self._live.offer(event)
        if verdict.text:
            entered = self._live.position.entered_for(event.step)
            differs = entered is not None and events.answer_said(entered) != events.answer_said(event)
            text = phrase("The participant’s answer was not taken. {text}", text=verdict.text)
            self._tell(Trouble(text=text, trial=trial if differs else None))
        return verdict.taken

    def keep_draft(self, position: Position) -> None:
        """Their question, program or run goes: what they had set or written and not given is kept as a note."""
        draft, step = self._draft, position.step
        if draft is None or draft.draft != position.number or not isinstance(step, Asking):
            return
        self._draft = None
        if draft.value != "":
            self._offer(events.Note(text=f"participant's {kept_text(step, draft.value)}", trial=step.trial))

    def _offer(self, event: events.Event) -> None:
        if self._live is not None:
            self._live.offer(event)

    def _heard(self, word: messages.Heard) -> None:
        """What comes from there without a question: emergency stop, whose the keys are, keys in a pause, no noise.

        Also a key for a question that the experimenter has answered: it is on record as refused.
        """
        match word:
            case messages.EmergencyPressed():
                self._offer(events.EmergencyStop(by="participant"))
            case messages.Focused():
                self._see()
            case messages.Minimised():
                self._minimised(word.on)
            case messages.Draft():
                self._draft = word
            case messages.NoiseEnded() | messages.NoiseBroken():
                self._noise_changes(word)
            case messages.ChoiceGiven() if self._live is not None and self._live.position.entered_for(word.step):
                at_s = self._live.clock.now()
                late = events.ParticipantKey(
                    response=word.response, at_s=at_s, step=word.step, timed=False, by=self._hand
                )
                self._offered(late, None)
            case messages.KeyPressed() if self._live is not None:
                self._pressed(word.name, self._live.position, self._live.clock.now())

    def _pressed(self, name: str, position: Position, at_s: float) -> None:
        """A key of theirs in a pause is on record as refused."""
        if (said := self._said(position).get(name)) is not None:
            self._offer(events.ParticipantKey(response=said, at_s=at_s, step=position.number))

    def _minimised(self, on: bool) -> None:
        """Their window is minimised, or seen again: until it is, the run is paused, where they are asked on it."""
        if self._live is None or not (self.rates or self.own_keys) or self._live.minimised is on:
            return
        self._live.minimised, seen = on, phrase("The participant's window is seen again.")
        self._offer(events.ParticipantLost(cause=MINIMISED) if on else events.ParticipantBack(how=seen))
        self._tell(Trouble(text=MINIMISED) if on else Trouble(text=seen, mood="good"))

    def _gone(self, cause: str) -> None:
        """The program has ended, and was not told to."""
        if not self._closed:
            self._see()
            if self._live is not None:
                self._live.minimised = False
                self.keep_draft(self._live.position)  # their next page begins empty
            self._offer(events.ParticipantLost(cause=cause))
            self._noise_ends(phrase("Masking noise has ended with the participant's screen, and begins again with it."))

    @property
    def not_lost(self) -> str:
        """Why the program is not to be started again; empty if it has ended."""
        if self._starting:
            return phrase("The participant's screen is being started already.")
        return NOT_LOST if self._link.failure is None or self._closed else ""

    def restart(self) -> None:
        """Start the program again, beside everything else; if that fails the run goes on without it."""
        with self._lock:
            if self.not_lost:
                return
            self._starting = True
        self._see()
        threading.Thread(target=self._restart, daemon=True, name="participant again").start()

    def _restart(self) -> None:
        self._tell(Trouble(text=phrase("Starting the participant's screen … it takes some seconds."), mood="wait"))
        try:
            link = self._open_link()
        except ParticipantError as error:
            self._starting = False
            self._not_again(error)
            return
        link.listen(self._heard, lambda _: None)  # F12 there counts from now on
        noise = None if self._noise is None else noise_of(link)  # before the run, which may go on, asks anything there
        with self._lock:
            self._link, self._shows, self._starting = link, "", False
        self._tell(Trouble(text=phrase("The participant's screen is there again."), mood="good"))
        if noise is not None:
            self._noise_is(noise)
        self._see()
        link.listen(self._heard, self._gone)
        self._offer(events.ParticipantBack())
        if self._live is not None:
            self.follow(self._live.position)

    def _not_again(self, error: ParticipantError) -> None:
        """It did not start: said and on record, unless the run has ended meanwhile."""
        text = phrase(
            "The participant's screen did not start again: {error}. The run goes on without it; in a pause it can be "
            "started once more.",
            error=error,
        )
        if not self._closed and self._live is not None:
            self._see()
            self._tell(Trouble(text=text))
            self._live.remark(Noted(trial=None, text=text))

    def close(self) -> None:
        """Close the participant's screen."""
        self._closed = True
        self._link.close()
