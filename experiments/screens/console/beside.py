"""The participant's own screen beside the console: its answers come as replies, its failures as troubles."""

from __future__ import annotations

import threading
from collections.abc import Callable

from experiments.screens.console.messages import Message, ParticipantAnswered, ParticipantRated, Reply, Trouble
from experiments.screens.participant.link import ParticipantLink
from experiments.screens.participant.mailbox import ParticipantError
from experiments.screens.participant.words import AskDirection, AskRating, NoiseIs
from experiments.steps import Ask, Rate


class ParticipantSide:
    """Asks on the participant's screen without making anyone wait: the experimenter can always answer instead.

    `rates` and `own_keys` say what is asked there; `noise` whether masking noise plays, and why not, if it was wanted.
    """

    def __init__(self, link: ParticipantLink, *, rates: bool, own_keys: bool, noise: NoiseIs | None = None) -> None:
        self._link = link
        self.rates, self.own_keys, self._noise = rates, own_keys, noise
        self._called_off = threading.Event()
        self._reply: Callable[[Reply], None] = lambda _: None
        self._tell: Callable[[Message], None] = lambda _: None

    def sit(self, reply: Callable[[Reply], None], tell: Callable[[Message], None]) -> None:
        """Take the place beside a console."""
        self._reply, self._tell = reply, tell

    def begin(self) -> str:
        """Tell what did not start. Gives back what the record of the run is to say of the noise, if anything."""
        if self._noise is None:
            return ""
        if self._noise.on:
            return "Masking noise plays."
        self._tell(Trouble(text=self._noise.message))
        return self._noise.message

    @property
    def asking(self) -> bool:
        """Whether the participant is asked something at this moment."""
        return self._link.asking

    def rate(self, step: Rate, of: int, describe: str) -> None:
        """Have a stimulus rated and described, if the participant does so on their own screen."""
        if not self.rates:
            return
        question = AskRating(
            number=step.trial.trial,
            of=of,
            question=step.question,
            minimum=step.minimum,
            maximum=step.maximum,
            minimum_text=step.minimum_text,
            maximum_text=step.maximum_text,
            grain=step.grain,
            describe=describe,
        )
        self._beside(lambda: self._rated(question))

    def judge(self, step: Ask, onset_s: float) -> None:
        """Have a direction judged, if the participant has keys of their own."""
        if not self.own_keys:
            return
        question = AskDirection(
            question=step.question,
            forward=step.forward,
            backward=step.backward,
            forward_key="up",
            backward_key="down",
            onset_s=onset_s,
        )
        self._beside(lambda: self._judged(question))

    def _rated(self, question: AskRating) -> None:
        given = self._link.ask_rating(question)
        self._reply(ParticipantRated(rating=given.rating, comment=given.comment))

    def _judged(self, question: AskDirection) -> None:
        given = self._link.ask_direction(question)
        self._reply(ParticipantAnswered(response=given.response, at_s=given.pressed_s))

    def call_off(self) -> None:
        """Ask no longer: somebody else answered, or the run stopped."""
        self._called_off.set()
        self._link.cancel()

    def close(self) -> None:
        """Close the participant's screen."""
        self._link.close()

    def _beside(self, ask: Callable[[], None]) -> None:
        self._called_off.clear()

        def carry() -> None:
            try:
                ask()
            except ParticipantError as error:
                if not self._called_off.is_set():
                    self._tell(Trouble(text=f"Enter the answer here: {error}."))

        threading.Thread(target=carry, daemon=True, name="participant").start()
