"""Hands that do what was drawn on the real window: keys down, up, held and doubled, clicks, the focus elsewhere.

Then the run is worked to its end, and what must be true of every run is looked at in its journal, table and gun.
"""

from __future__ import annotations

import csv
import random
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.at_display import HAND_S, OTHER, PATIENCE_S, AtConsole, another_window, records, remarks, wait_for
from tests.at_hand import STEM, check_gun, short_configs, words
from tests.watched_console import Look, Watch

RUN = "Recoil – P01"
MOVES = 40
KEYS = (
    "space",
    "f",
    "b",
    "m",
    "p",
    "u",
    "e",
    "t",
    "r",
    "g",
    "n",
    "y",
    "l",
    "s",
    "Return",
    "Escape",
    "Tab",
    "F1",
    "F2",
    "7",
)
GUARD_S = 0.25
PLANNED = {"direction": 8, "preference": 3}
TABLE = {"direction": "trials", "preference": "ratings"}


@dataclass
class RandomHands:
    """Somebody at the console of an experiment who does `MOVES` things at random, and then only what is due."""

    folder: Path
    display: str
    experiment: str
    draw: random.Random
    down: set[str] = field(default_factory=set)
    sittings: int = 0
    said: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        configs = short_configs(self.folder)
        self._words = words(configs, self.experiment)
        self.watch = Watch(str(self.folder))
        self.journal = self.folder / f"{STEM}{self.experiment}_journal.jsonl"

    def work(self) -> None:
        """From the first hand-over to the end, through every stop."""
        left = MOVES
        while not self._finished():
            with self._console() as screen:
                left = self._play(screen, left)
                self._finish(screen)
                self._hear(screen)
            self.sittings += 1

    def _finished(self) -> bool:
        return any(record["kind"] == "finished" for record in records(self.journal))

    def _console(self) -> AtConsole:
        screen = AtConsole(
            [*self._words, *(["--resume"] if self.sittings else [])], self.folder, self.display, self.watch
        )
        screen.stands(RUN)
        screen.ready()
        return screen

    def _play(self, screen: AtConsole, left: int) -> int:
        while left and not screen.look().ended and screen.process.poll() is None:
            self._move(screen)
            left -= 1
        for key in sorted(self.down):
            screen.keys.key_up(key)
        self.down.clear()
        time.sleep(HAND_S)  # the next press of a key that was down is no bounce of it
        return left

    def _move(self, screen: AtConsole) -> None:
        weighted: list[tuple[int, Callable[[AtConsole], None]]] = [
            (12, self._due),
            (8, self._key),
            (4, self._down),
            (4, self._up),
            (3, self._double),
            (2, self._hold),
            (4, self._click),
            (2, self._line),
            (1, self._elsewhere),
            (1, self._halt),
            (1, self._stop),
        ]
        weights, moves = zip(*weighted, strict=True)
        (move,) = self.draw.choices(moves, weights)
        move(screen)
        time.sleep(self.draw.choice((0.0, 0.0, 0.05, 0.3)))  # hands have their own time

    def _due(self, screen: AtConsole) -> None:
        look = screen.look()
        if look.page or look.line:
            screen.keys.press("Escape")
        elif look.state in ("setting", "preparing", "train", "asking", "rating", "describing", "paused") and look.ready:
            screen.due(look)

    def _key(self, screen: AtConsole) -> None:
        screen.keys.press(self.draw.choice(KEYS), *self.draw.choice(((), (), (), ("Control_L",))))

    def _down(self, screen: AtConsole) -> None:
        key = self.draw.choice(KEYS)
        screen.keys.key_down(key)
        self.down.add(key)

    def _up(self, screen: AtConsole) -> None:
        if self.down:
            key = self.draw.choice(sorted(self.down))
            screen.keys.key_up(key)
            self.down.discard(key)

    def _double(self, screen: AtConsole) -> None:
        key = self.draw.choice(KEYS)
        screen.keys.press(key)
        time.sleep(self.draw.choice((0.03, 0.08)))
        screen.keys.press(key)

    def _hold(self, screen: AtConsole) -> None:
        key = self.draw.choice(("space", "f", "Return", "t", "p", "u"))
        screen.keys.key_down(key)
        time.sleep(self.draw.uniform(0.3, 1.3))
        screen.keys.key_up(key)

    def _click(self, screen: AtConsole) -> None:
        places = sorted(name for name in screen.look().places if name not in ("emergency", "stop"))
        if not places:
            return
        look = screen.look()
        place = look.places.get(self.draw.choice(places))
        if place is None:
            return
        left, top, width, height = place
        for _ in range(self.draw.choice((1, 1, 2, 3))):
            screen.keys.click(left + self.draw.randrange(width), top + self.draw.randrange(height))

    def _line(self, screen: AtConsole) -> None:
        """A note, a flag or a reason, whole or left."""
        letters = screen.look().state in ("rating", "describing")
        screen.keys.press(self.draw.choice(("n", "g", "r", "e")), *(("Control_L",) if letters else ()))
        time.sleep(0.1)
        screen.keys.type("noise" + self.draw.choice(("\n", "\n", "")))

    def _elsewhere(self, screen: AtConsole) -> None:
        """The keys go to another window for a while."""
        screen.keys.focus_on(OTHER)
        screen.keys.press(self.draw.choice(KEYS))
        time.sleep(0.1)
        screen.keys.focus_on(RUN)

    def _halt(self, screen: AtConsole) -> None:
        if self.draw.random() < 0.5:
            screen.keys.press("F12")

    def _stop(self, screen: AtConsole) -> None:
        if self.draw.random() < 0.3 and not screen.look().line:
            screen.keys.press("q")
            screen.keys.type("lunch\n")

    # to the end

    def _finish(self, screen: AtConsole) -> None:
        """Leave what is open, do what is due, and close the window; but first let it hear all that was pressed."""
        screen.focus_on(RUN)
        screen.heard()
        end_s = time.monotonic() + 2 * PATIENCE_S
        while screen.process.poll() is None and not (look := screen.look()).ended:
            if time.monotonic() > end_s:
                raise AssertionError(f"the run does not end: {look}")
            self._leave_or_do(screen, look)
        if screen.process.poll() is None:
            self._leave(screen, screen.heard())
            screen.keys.press("q")
        screen.end()

    def _leave_or_do(self, screen: AtConsole, look: Look) -> None:
        if look.page or look.line:
            self._leave(screen, look)
        elif look.state in ("rating", "describing") and look.ready:
            screen.keys.press("a", "Control_L")
            screen.keys.press("BackSpace")
            screen.due(look)
            _moved(screen, look)
        elif look.state == "rearming" and look.ready:
            screen.hold("t", until=lambda now: now.serial != look.serial)
        elif look.ready and look.state not in ("saving", "firing", "stopped"):
            screen.due(look)
            _moved(screen, look)
        else:
            time.sleep(0.01)

    def _leave(self, screen: AtConsole, look: Look) -> None:
        while look.page or look.line:
            screen.keys.press("Escape")
            look = screen.heard()

    def _hear(self, screen: AtConsole) -> None:
        texts = {text for look in screen.watch.looks() for text in look.texts}
        self.said |= {text for text in texts if text.startswith("Saved. ")}


def _moved(screen: AtConsole, look: Look) -> None:
    """A moment for what was pressed; a line that a key opened meanwhile is left in the next round."""
    end_s = time.monotonic() + 1.0
    while time.monotonic() < end_s and (now := screen.look()).serial == look.serial and not now.line:
        time.sleep(0.01)


# what must be true of every run


def check_run(hands: RandomHands) -> dict[str, int]:
    """The rules; how much there was of what they are about."""
    check_gun(hands.watch, hands.journal)
    written = records(hands.journal)
    assert written[-1]["kind"] == "finished"
    _check_guard(written)
    _check_rows(hands)
    _check_said(hands, written)
    kinds = [body["kind"] for body in remarks(hands.journal)]
    return {kind: kinds.count(kind) for kind in ("refused", "halted", "paused")} | {"sittings": hands.sittings}


def _check_guard(written: list[dict[str, Any]]) -> None:
    """Nothing of the hand's was taken before its question had been painted for the guard's time."""
    for record in written:
        body = record.get("body", {})
        if record["kind"] == "outcome" and body["kind"] in ("prepared", "answered"):
            assert record["monotonic_s"] - record["shown_s"] >= GUARD_S, record
        if body.get("kind") == "presented":
            assert body["exposure_s"] >= 1.0, record


def _check_rows(hands: RandomHands) -> None:
    """One row a planned trial, each with its answer."""
    table = hands.folder / f"{STEM}{hands.experiment}_{TABLE[hands.experiment]}.csv"
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    places = {(row.get("session"), row["trial"]) for row in rows}
    assert len(rows) == len(places) == PLANNED[hands.experiment]
    if hands.experiment == "direction":
        assert all(row["response"] for row in rows)


def _check_said(hands: RandomHands, written: list[dict[str, Any]]) -> None:
    """Every answer that the window acknowledged is in the journal, with its value."""
    found = {(body["trial"]["trial"], body["value"]) for body in _answers(written)}
    for text in hands.said:
        match = re.fullmatch(r"Saved\. Trial (\d+)(?: corrected to|:) (FORWARD|BACKWARD)\.", text)
        if match:
            assert (int(match[1]), match[2].lower()) in found, text


def _answers(written: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Every answer and correction, with its trial."""
    step: dict[str, Any] = {}
    for record in written:
        body = record.get("body", {})
        if record["kind"] == "step":
            step = body
        elif body.get("kind") == "answered":
            yield {"trial": step["trial"], **body}
        elif body.get("kind") == "corrected":
            yield body


def check_random_hands(folder: Path, display: str, seed: int) -> dict[str, int]:
    """One run by random hands."""
    experiment = ("direction", "preference")[seed % 2]
    hands = RandomHands(folder, display, experiment, random.Random(seed))
    with another_window(display):
        hands.work()
    wait_for(lambda: hands.watch.calls("disarm"))
    return check_run(hands)
