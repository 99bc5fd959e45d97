"""Ranks: each trial of a set has one of its own, whoever enters it."""

from __future__ import annotations

from experiments.design.planning import plan_of
from experiments.load import load_gun, shipped_folder
from experiments.screens.texts import saved_text
from experiments.session import events
from experiments.session.judging import Moment, event_refusal, exchanged, meant
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


def moment_of(position: Position, *history: object) -> Moment:
    return Moment(plan=PLAN, history=history, position=position, now_s=1.0, painted_s=0.0, guard_s=0.0)  # type: ignore[arg-type] # tuples


def refused(rank: float, step: Rate, *history: object) -> str:
    """Why the experimenter cannot enter a rank; the participant's own hand cannot give it either, in the same words."""
    moment = moment_of(Position(states=(State.RATING,), number=7, step=step), *history)
    theirs = event_refusal(moment, events.ParticipantRated(rating=rank, step=7), None)
    assert theirs == event_refusal(moment, events.Rating(rating=rank, by="experimenter"), None)
    return theirs


def test_every_trial_of_a_set_is_asked_for_its_place_and_told_what_the_first_means() -> None:
    assert [(step.minimum, step.maximum, step.grain, step.distinct) for step in ASKED] == [(1.0, 3.0, 1.0, True)] * 6
    assert {step.minimum_text for step in ASKED} == {"most comfortable"}


def test_a_rank_is_given_once_in_a_set() -> None:
    first, second, third, *next_set = ASKED
    assert refused(2.0, first) == ""
    refusal = refused(2.0, second, said(2.0, first))
    assert "2 was given to another one of this set" in refusal
    assert refusal.endswith("; undo corrects that one first.")
    assert refused(1.0, third, said(2.0, first), said(3.0, second)) == ""
    assert refused(2.0, next_set[0], said(2.0, first)) == ""


def test_a_rank_between_two_is_the_nearest_and_no_way_round_that() -> None:
    first, second, *_ = ASKED
    assert "2 was given to another one" in refused(2.4, second, said(2.0, first))


def test_a_rank_that_was_corrected_is_free_again() -> None:
    first, second, *_ = ASKED
    corrected = None, EntryCorrected(trial=first.trial, question="rank", value=3.0)
    assert refused(2.0, second, said(2.0, first), corrected) == ""
    assert refused(3.0, second, said(2.0, first), corrected) != ""


def corrected(rank: float, step: Rate, *history: object) -> tuple[object, EntryCorrected | None]:
    """What a correction of a rank is meant as, and what is corrected along with it."""
    position = Position(states=(State.PREPARING, State.CORRECTING), correcting=step)
    moment = moment_of(position, *history)
    event, _ = meant(moment, events.Correct(value=rank))
    assert event_refusal(moment, event, None) == ""
    return event, exchanged(moment, event)


def test_a_rank_that_is_corrected_to_another_trials_exchanges_the_two() -> None:
    first, second, third, *_ = ASKED
    all_three = said(1.0, first), said(2.0, second), said(3.0, third)
    taken = EntryCorrected(trial=third.trial, question="rank", value=1.0)
    assert corrected(3.0, first, *all_three) == (events.Correct(value=3.0), taken)
    assert corrected(3.0, first, *all_three[:2]) == (events.Correct(value=3.0), None)


def test_that_two_ranks_were_exchanged_is_said_of_both_in_one_line() -> None:
    """The console keeps the last line alone, which named the other trial only."""
    first, second, third, *_ = ASKED
    asked = EntryCorrected(trial=first.trial, question="rank", value=3.0)
    taken = EntryCorrected(trial=third.trial, question="rank", value=1.0)
    all_three = said(1.0, first), said(2.0, second), said(3.0, third)
    exchange = saved_text(PLAN, (*all_three, (None, asked), (None, taken)), None, taken)
    assert exchange == "Saved. The two ranks were exchanged: Trial 1 of 3 has 3 now, Trial 3 of 3 has 1."
    again = EntryCorrected(trial=second.trial, question="rank", value=1.0)
    told = (*all_three[:2], (None, asked), (None, again))
    assert saved_text(PLAN, told, None, again) == "Saved. Trial 2 of 3 corrected to 1."


def test_a_correction_is_kept_to_the_grain_as_what_was_entered() -> None:
    first, second, *_ = ASKED
    assert corrected(2.6, first, said(1.0, first), said(2.0, second))[0] == events.Correct(value=3.0)
    assert corrected(1.3, first, said(1.0, first), said(2.0, second))[0] == events.Leave()
