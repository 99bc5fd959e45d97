"""The participant's program: words in through a thread that answers pings at once, pages on the window, answers out."""

from __future__ import annotations

import math
import queue
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import BinaryIO

from pydantic import ValidationError

from device.machine_clock import machine_s
from experiments.screens.participant import messages
from experiments.screens.participant.messages import line
from experiments.screens.participant.noise import MaskingNoise
from experiments.screens.participant.pages import ChoicePage, DescriptionPage, Drafts, MessagePage, RatingPage
from experiments.screens.participant.stage import KeyPresses, Stage, load_toolkit
from experiments.screens.participant.standstill import Standstills


class Wire:
    """Says words to the console and hears its own. `now` is this side's clock."""

    def __init__(self, heard: BinaryIO, said: BinaryIO, now: Callable[[], float]) -> None:
        self._heard, self._said, self._now = heard, said, now
        self._lock = threading.Lock()
        self._words: queue.SimpleQueue[messages.ToParticipant] = queue.SimpleQueue()

    def listen(self) -> None:
        """Begin to hear."""
        threading.Thread(target=self._listen, name="console's words", daemon=True).start()

    def say(self, word: messages.FromParticipant) -> None:
        """Say a word; a console that is gone hears nothing, and its silence ends the program."""
        with self._lock, suppress(OSError):
            self._said.write(line(word))
            self._said.flush()

    def word(self) -> messages.ToParticipant | None:
        """The next word that was heard, if there is one. A console that is gone said `CloseScreen`.

        A question to type on with a word behind it was called off: put up, it would take a key that is meant for the
        console.
        """
        word: messages.ToParticipant | None = None
        with suppress(queue.Empty):
            word = self._words.get_nowait()
            while isinstance(word, messages.AskRating | messages.AskDescription):
                word = self._words.get_nowait()
        return word

    def _listen(self) -> None:
        for wire in self._heard:
            there_s = self._now()
            try:
                word = messages.to_participant_from(wire)
            except ValidationError:
                self.say(messages.ScreenFailed(message=f"the console said what is no word: {wire[:200]!r}"))
                break
            if isinstance(word, messages.Ping):
                self.say(messages.Pong(sent_s=word.sent_s, there_s=there_s))
            else:
                self._words.put(word)
        self._words.put(messages.CloseScreen())


_STEP_S = 0.004
"""How long the program rests between two looks at words, mouse and keys."""
_BEAT_S = 1.0
"""And between two beats, with a look whether the noise plays still."""
_LATE_S = 0.25
"""For so long after a question was called off its keys are heard: one that stood still has them only then."""


def run_program(look: messages.Look, heard: BinaryIO, said: BinaryIO) -> int:
    """Run the program; whatever ends it but the console is said as `ScreenFailed`. Gives back the exit code."""
    wire = Wire(heard, said, machine_s)
    try:
        toolkit = load_toolkit()
        wire = Wire(heard, said, toolkit.now)
        app = App(Stage(toolkit, look), wire)
        app.begin()
        app.serve()
    except KeyboardInterrupt:
        wire.say(messages.ScreenFailed(message="it was interrupted from the keyboard (Ctrl-C)"))
        return 130
    except ModuleNotFoundError as error:
        needs = "the extra `gui`, on Python 3.11 or 3.12, as PsychoPy allows no later one"
        wire.say(messages.ScreenFailed(message=f"{error.name} is not installed: this screen needs {needs}"))
        return 1
    except SystemExit as error:  # PsychoPy ends the program where others raise
        wire.say(messages.ScreenFailed(message=f"PsychoPy ended the program ({error.code})"))
        return 1
    except BaseException as error:  # noqa: BLE001 - some of PsychoPy's errors derive from BaseException alone
        traceback.print_exc()
        wire.say(messages.ScreenFailed(message=f"{type(error).__name__}: {error}"))
        return 1
    return 0


class App:
    """The window and who speaks to it."""

    def __init__(self, stage: Stage, wire: Wire) -> None:
        self._stage, self._wire = stage, wire
        self._keys = KeyPresses(stage.toolkit)
        self._standstills = Standstills(stage.toolkit.now)
        self._noise = MaskingNoise()
        self._beat_s = 0.0
        self._told: tuple[str, ...] = ()
        self._told_s = 0.0
        self._drafts: Drafts = {}
        """What was set or written and not taken, until something else is asked for."""
        self._asked_for = ("", 0)
        self._draft: messages.Draft | None = None
        self._called_off: tuple[ChoicePage, float] | None = None
        """A question without an answer, and when it was taken off."""

    def begin(self) -> None:
        """Show an empty window and say that it is ready."""
        refresh_Hz = self._stage.measure_refresh()
        self._stage.put(MessagePage(self._stage, ""))
        self._stage.step()
        self._wire.say(messages.Beat())
        size = f"{self._stage.width_px}x{self._stage.height_px}"
        self._wire.say(messages.Ready(psychopy=self._stage.toolkit.version, window=size, refresh_Hz=refresh_Hz))
        self._standstills.watch()
        self._wire.listen()

    def serve(self) -> None:
        """Do as the words say until they say close."""
        while not isinstance(word := self._wire.word(), messages.CloseScreen):
            if word is not None:
                self._obey(word)
            self._stage.step()
            self._tell_draft()  # before an emergency stop, behind which nobody listens to it any more
            while self._stage.unasked:
                self._wire.say(self._stage.unasked.popleft())
            self._keys.poll()
            self._tell_keys()
            self._beat()
            self._answer()
            self._answer_late()
            time.sleep(_STEP_S)
        self._stage.close()  # the noise ends with the program: to close its stream may wait for a device for ever

    def _tell_keys(self) -> None:
        """Say which of the keys to be told went down since the last look."""
        if not self._told:
            return
        for press in self._keys.since(self._told_s):
            self._told_s = math.nextafter(press.pressed_s, math.inf)
            if press.name in self._told:
                self._wire.say(messages.KeyPressed(name=press.name))

    def _tell_draft(self) -> None:
        """Say what stands on the page whenever that has changed: the run may stop before it is given."""
        draft = self._stage.page.draft()
        if draft not in (None, self._draft):
            self._draft = draft
            self._wire.say(draft)

    def _beat(self) -> None:
        """Say each second that the window works, and of the noise if it has ended, or may have broken off meanwhile."""
        since_s, now_s = self._beat_s, self._stage.toolkit.now()
        if now_s - since_s >= _BEAT_S:
            self._beat_s = now_s
            self._wire.say(messages.Beat())
            if (ended := self._noise.ended()) is not None:
                self._wire.say(ended)
            elif self._noise.plays and (stood_s := self._standstills.within_s(since_s, now_s)):
                self._wire.say(messages.NoiseBroken(stood_still_s=stood_s))

    def _obey(self, word: messages.ToParticipant) -> None:
        self._told = word.tell if isinstance(word, messages.Show) else ()
        self._told_s = self._stage.toolkit.now()
        match word:
            case messages.Show():
                if isinstance(page := self._stage.page, ChoicePage):
                    self._called_off = page, self._told_s
                self._stage.put(MessagePage(self._stage, word.text), keep_keys=word.keep_keys)
            case messages.AskRating():
                self._stage.put(RatingPage(self._stage, word, self._drafts_of(word)), keep_keys=word.keep_keys)
            case messages.AskDescription():
                self._stage.put(DescriptionPage(self._stage, word, self._drafts_of(word)), keep_keys=word.keep_keys)
            case messages.AskChoice():
                self._stage.put(ChoicePage(self._stage, word, self._keys), keep_keys=word.keep_keys)
            case messages.Noise():
                self._wire.say(messages.Beat(within_s=messages.NOISE_S))
                self._wire.say(self._noise.turn(word))
                self._beat_s = self._stage.toolkit.now()  # to begin took its time, in which nothing played yet

    def _drafts_of(self, word: messages.AskRating | messages.AskDescription) -> Drafts:
        """What is given as a pause begins is not taken, and asked for again: it is there still."""
        if (word.kind, word.draft) != self._asked_for:
            self._drafts, self._asked_for = {}, (word.kind, word.draft)
        return self._drafts

    def _answer(self) -> None:
        """Say what the page came to, if it did, and thank for it. After a page to type on another is likely to come."""
        page = self._stage.page
        if (given := page.outcome()) is not None:
            if isinstance(given, messages.ChoiceGiven) and isinstance(page, ChoicePage):
                asked_s, seen_s = page.unseen_s
                unseen_s = self._standstills.within_s(asked_s, min(seen_s, given.pressed_s))
                given = replace(given, stood_still_s=max(unseen_s, self._standstills.around_s(given.pressed_s)))
            self._wire.say(given)
            self._draft = None  # not taken in a pause, it stands there again, and is told again
            self._stage.put(MessagePage(self._stage, self._stage.look.messages.between), keep_keys=page.typed)

    def _answer_late(self) -> None:
        """Say what was pressed for a question that is called off: nobody waits for it, but it is put on record."""
        if self._called_off is None:
            return
        page, since_s = self._called_off
        if (given := page.outcome()) is not None:
            self._wire.say(given)
        if given is not None or self._stage.toolkit.now() - since_s > _LATE_S:
            self._called_off = None
