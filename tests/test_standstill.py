"""When the participant's program stood still, by a clock that the test moves."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import pytest

from experiments.screens.participant import app, messages
from experiments.screens.participant.standstill import LONGEST_STANDSTILL_S, Standstills


class Clock:
    """A clock that moves when it is told to."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def now(self) -> float:
        return self.now_s


def looked_at(*moments_s: float) -> tuple[Standstills, Clock]:
    """A watch that looked at some moments, after 0 s."""
    clock = Clock()
    found = Standstills(clock.now)
    for clock.now_s in moments_s:
        found.look()
    return found, clock


@pytest.mark.parametrize("stamped_s", [0.02, 0.5, 1.02, 1.02 + LONGEST_STANDSTILL_S])
def test_a_key_in_a_standstill_or_right_after_it_tells_how_long_it_was(stamped_s: float) -> None:
    found, clock = looked_at(0.01, 1.02, 1.03, 1.1)
    clock.now_s = 1.15
    assert found.around_s(stamped_s) == pytest.approx(1.01)


@pytest.mark.parametrize("stamped_s", [0.005, 1.3])
def test_a_key_long_before_or_after_a_standstill_is_good(stamped_s: float) -> None:
    found, _ = looked_at(0.01, 1.02, 1.1, 1.15, 1.2, 1.25, 1.3)
    assert found.around_s(stamped_s) == 0.0


@pytest.mark.parametrize(
    ("from_s", "to_s", "stood_s"), [(0.5, 1.3, 0.52), (0.0, 0.6, 0.59), (0.6, 1.3, 0.0), (1.02, 1.3, 0.0)]
)
def test_of_a_standstill_that_part_counts_that_lies_between_two_moments(
    from_s: float, to_s: float, stood_s: float
) -> None:
    found, _ = looked_at(0.01, 1.02, 1.1, 1.15, 1.2, 1.25, 1.3)
    assert found.within_s(from_s, to_s) == pytest.approx(stood_s)


def test_a_standstill_that_nobody_has_seen_the_end_of_counts() -> None:
    found, clock = looked_at(0.01)
    clock.now_s = 0.8
    assert found.around_s(0.79) == pytest.approx(0.79)


def test_who_looks_often_enough_missed_nothing() -> None:
    found, _ = looked_at(*(0.05 * count for count in range(1, 20)))
    assert {found.around_s(0.1 * count) for count in range(10)} == {0.0}


class Playing:
    """Noise that takes two seconds to begin, and plays from then on."""

    def __init__(self, clock: Clock) -> None:
        self._clock, self.plays = clock, False

    def turn(self, asked: messages.Noise) -> messages.NoiseIs:
        self._clock.now_s, self.plays = self._clock.now_s + 2.0, asked.on
        return messages.NoiseIs(on=asked.on, message="", ask=asked.ask)

    def ended(self) -> None:
        return None

    def stop(self) -> None:
        self.plays = False


@pytest.mark.parametrize(("on", "said"), [(True, [1.5]), (False, [])])
def test_a_standstill_while_noise_plays_is_said_once_and_what_it_took_to_begin_is_none(
    on: bool, said: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    heard = list[object]()
    words = iter([messages.Noise(on=on, level=0.3), *[None] * 10, messages.CloseScreen()])
    found, clock = looked_at(0.01)
    passed_s = itertools.chain([[0.1] * 15] * 2, [[1.5]], itertools.repeat([0.1] * 15))  # in the third nobody looks

    def step() -> None:
        for some_s in next(passed_s):
            clock.now_s += some_s
            found.look()

    page = SimpleNamespace(draft=lambda: None, outcome=lambda: None)
    toolkit = SimpleNamespace(now=clock.now, key_epoch_s=0.0, keyboard=SimpleNamespace(Keyboard=SimpleNamespace))
    stage = SimpleNamespace(toolkit=toolkit, step=step, unasked=[], page=page, close=lambda: None)
    monkeypatch.setattr(app, "Standstills", lambda _: found)
    monkeypatch.setattr(app, "MaskingNoise", lambda: Playing(clock))
    monkeypatch.setattr(app.KeyPresses, "poll", lambda _: None)
    app.App(stage, SimpleNamespace(word=lambda: next(words), say=heard.append)).serve()  # type: ignore[arg-type]
    broken = [round(word.stood_still_s, 6) for word in heard if isinstance(word, messages.NoiseBroken)]
    assert broken == said
