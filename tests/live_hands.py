"""What the tests of a live run do at it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.live_run import EventVerdict
from experiments.session import events
from experiments.session.events import Event, Press
from experiments.session.states import State
from experiments.session.steps import Prepare
from tests.at_controls import PREFERENCE, Sitting, kept
from tests.designs import design

S = State
LEAST_S: float = PREFERENCE.config.trial.least_exposure_s
DUE: dict[State, Event] = {
    S.REARMING: events.Rearm(held_s=1.0),
    S.SETTING: events.DamperSet(),
    S.PREPARING: events.Fire(),
    S.TRAIN: events.Next(),
    S.ASKING: events.Answer(response="forward", at_s=2000.0),
    S.RATING: events.Rating(rating=7.0),
    S.DESCRIBING: events.Description(text="like a toy"),
    S.RESTING: events.EndBreak(reason="cold"),
    S.CLOSING: events.Finish(),
    S.PAUSED: events.GoOn(),
    S.CORRECTING: events.Correct(value="backward"),
}
"""What carries a run on at each state."""
LIVE = [state for state in State if state is not S.STOPPED]


def own_key(sitting: Sitting, **changes: Any) -> events.ParticipantKey:
    """The participant's own key for the question at hand, pressed now."""
    position = sitting.position
    known = {"response": "backward", "at_s": sitting.clock.now(), "step": position.number}
    return events.ParticipantKey(**known | changes)


def by_hand(sitting: Sitting, event: Event) -> EventVerdict:
    """What somebody does who looks first and takes their time."""
    sitting.ready()
    verdict = sitting.live.offer(event, Press(at_s=sitting.clock.now(), serial=sitting.position.serial))
    sitting.settle()
    return verdict


def experiment_of(sitting: Sitting) -> str:
    return str(sitting.setup.config.experiment)


def to_the_end(sitting: Sitting) -> tuple[Any, list[dict[str, str]]]:
    """Work on to the end: the journal and the table."""
    while not sitting.ended.is_set():
        sitting.go_on()
    sitting.finish()
    assert sitting.error is None
    _, contents, rows = kept(sitting.results, experiment_of(sitting))
    return contents, rows


def of_journal(sitting: Sitting) -> Any:
    """The journal of a run that was left."""
    if not sitting.ended.is_set():
        sitting.stop()
    sitting.finish()
    return kept(sitting.results, experiment_of(sitting))[1]


def presses(sitting: Sitting) -> tuple[float, int]:
    """The position at hand, painted at a time of which the guard's is no rounded multiple."""
    sitting.settle()
    position = sitting.position
    sitting.live.painted(position.serial, 4096.0)
    return 4096.0, position.serial


def own_rating(sitting: Sitting) -> EventVerdict:
    """A rating of 3 on the participant's own screen."""
    verdict = sitting.live.offer(events.ParticipantRated(rating=3.0, step=sitting.position.number))
    sitting.settle()
    return verdict


def own_words(sitting: Sitting, text: str = "soft") -> EventVerdict:
    """A description on the participant's own screen."""
    verdict = sitting.live.offer(events.ParticipantDescribed(text=text, step=sitting.position.number))
    sitting.settle()
    return verdict


def rate_and_describe(sitting: Sitting) -> None:
    assert own_rating(sitting)
    assert own_words(sitting)


def ranked(sitting: Sitting, rank: float) -> str:
    """A rank given on the participant's own screen; why it is not taken."""
    verdict = sitting.live.offer(events.ParticipantRated(rating=rank, step=sitting.position.number))
    sitting.settle()
    return verdict.text


def three_ranks() -> Setup[DesignConfig]:
    rank = {"kind": "ranking", "when": "block", "text": "Which place?", "minimum_text": "best"}
    factors = {"method": {"levels": ["vibration", "asymmetric-1", "asymmetric-2"]}}
    return replace(PREFERENCE, config=design(design="places", factors=factors, questions={"rank": rank}))


@contextmanager
def at_one_instant(sitting: Sitting) -> Iterator[None]:
    """What happens in here comes before the run looks."""
    with sitting.live.news:
        yield


def prepare(sitting: Sitting) -> Prepare:
    step = sitting.position.step
    assert isinstance(step, Prepare)
    return step
