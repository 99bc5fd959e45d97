"""Ranks: each trial of a set has one of its own, whoever enters it."""

from __future__ import annotations

from experiments.design.planning import plan_of
from experiments.load import load_gun, shipped_folder
from experiments.session import events
from experiments.session.judging import Moment, event_refusal
from experiments.session.remarks import EntryCorrected
from experiments.session.states import Position, State
from experiments.session.steps import Answered, Rate
from tests.designs import design
from tests.driven_designs import driven, session_of

RANKED = {
    "kind": "ranking",
    "when": "block",
    "text": "Which place does this one take?",
    "minimum_text": "most comfortable",
}
SETTINGS = design(
    factors={"method": {"levels": ["vibration", "asymmetric-1", "asymmetric-2"]}},
    order={"repetitions": 2, "sets": 2},
    questions={"rank": RANKED},
)
PLAN = plan_of(SETTINGS, "P01", 1)
ASKED = [
    step
    for step, _ in driven(session_of(SETTINGS, load_gun(shipped_folder() / "gun.toml"), PLAN))
    if isinstance(step, Rate)
]


def said(rank: float, step: Rate) -> tuple[Rate, Answered]:
    return step, Answered(value=rank, by="experimenter")


def refused(rank: float, step: Rate, *history: object) -> str:
    position = Position(states=(State.RATING,), step=step)
    moment = Moment(plan=PLAN, history=history, position=position, now_s=1.0, painted_s=0.0, guard_s=0.0)  # type: ignore[arg-type] # tuples
    return event_refusal(moment, events.Rating(rating=rank, by="experimenter"), None)


def test_every_trial_of_a_set_is_asked_for_its_place_and_told_what_the_first_means() -> None:
    assert [(step.minimum, step.maximum, step.grain, step.distinct) for step in ASKED] == [(1.0, 3.0, 1.0, True)] * 6
    assert {step.minimum_text for step in ASKED} == {"most comfortable"}


def test_a_rank_is_given_once_in_a_set() -> None:
    first, second, third, *next_set = ASKED
    assert refused(2.0, first) == ""
    assert "2 was given to another one of this set" in refused(2.0, second, said(2.0, first))
    assert refused(1.0, third, said(2.0, first), said(3.0, second)) == ""
    assert refused(2.0, next_set[0], said(2.0, first)) == ""


def test_a_rank_that_was_corrected_is_free_again() -> None:
    first, second, *_ = ASKED
    corrected = None, EntryCorrected(trial=first.trial, question="rank", value=3.0)
    assert refused(2.0, second, said(2.0, first), corrected) == ""
    assert refused(3.0, second, said(2.0, first), corrected) != ""
