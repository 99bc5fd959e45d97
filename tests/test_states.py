"""The table of states, as rules that hold at every position which a run can come to."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.session import events
from experiments.session.events import ACTS, KINDS, Event
from experiments.session.states import (
    ARMED,
    BACK,
    BENEATH,
    TABLE,
    WHY_NOT,
    Change,
    No,
    Position,
    State,
    To,
    after,
    change_of,
    entered,
)
from experiments.session.steps import Rest
from tests.states_page import page

S = State
Stack = tuple[State, ...]
Kind = type[Event]

ENDS = (events.EmergencyStop, events.Stop, events.DisplayLost, events.ResultsGone)
"""What may end a run from wherever it is."""
CARRY_ON = (
    *(events.DamperSet, events.Fire, events.Answer, events.Next, events.Rating, events.Description, events.EndBreak),
    *(events.Told, events.Finish, events.Rearm, events.Repeat, events.BreakOver, *events.OWN_HAND_EVENTS),
)
"""What takes a run to its next step."""
OWN = {S.ASKING: events.ParticipantKey, S.RATING: events.ParticipantRated, S.DESCRIBING: events.ParticipantDescribed}
"""What the participant says by their own hand, and when."""
STEPS = (S.REARMING, S.SETTING, S.PREPARING, S.ASKING, S.RATING, S.DESCRIBING, S.INFORMING, S.RESTING, S.CLOSING)
"""The states that a run enters by itself, apart from those in which it fires."""


def after_on(stack: Stack, kind: Kind) -> Stack | No:
    """The stack of states after an event."""
    position = after(Position(states=stack), kind, 1.0)
    return position if isinstance(position, No) else position.states


def entered_from(stack: Stack) -> Iterator[Stack]:
    """Where the run goes from a stack of states by itself: on from what is over, to the shot from the key for it."""
    if stack[0] in (S.SAVING, *ARMED):
        yield from ((state, *stack[1:]) for state in STEPS)
    if stack[0] is S.FIRING:
        yield from ((state, *stack[1:]) for state in ARMED)


def all_reached() -> set[Stack]:
    """Every stack of states that a run can come to."""
    found: set[Stack] = set()
    ahead: list[Stack] = [(S.SAVING,)]
    while ahead:
        stack = ahead.pop()
        if stack in found:
            continue
        found.add(stack)
        ahead += [later for kind in KINDS if not isinstance(later := after_on(stack, kind), No)]
        ahead += entered_from(stack)
    return found


REACHED = sorted(all_reached())
MOVES = [
    (stack, kind, later) for stack in REACHED for kind in KINDS if not isinstance(later := after_on(stack, kind), No)
]
"""Every event that is taken, at every stack at which it is, with the stack that it leads to."""


# the table


def test_every_event_has_a_change_or_a_sentence_in_every_state() -> None:
    defined = {one for one in vars(events).values() if isinstance(one, type) and issubclass(one, Event)} - {Event}
    assert set(TABLE) == set(KINDS) == defined
    for changes in TABLE.values():
        assert set(changes) == set(State)
        assert all(isinstance(change, Change) for change in changes.values())


def test_every_state_is_reached_and_a_pause_lies_beneath_a_correction_and_never_over_one() -> None:
    assert {state for stack in REACHED for state in stack} == set(State)
    assert {stack[1:] for stack in REACHED} == {(), (S.PAUSED,), (S.CORRECTING,), (S.PAUSED, S.CORRECTING)}


def test_what_is_handed_down_is_so_from_a_correction_alone() -> None:
    assert {state for changes in TABLE.values() for state in changes if changes[state] == BENEATH} == {S.CORRECTING}


def test_what_is_awaited_is_called_an_answer_whatever_is_asked_for() -> None:
    assert {WHY_NOT[state] for state in (S.ASKING, S.RATING, S.DESCRIBING)} == {"The answer is awaited."}


def test_the_committed_page_says_what_the_table_says() -> None:
    assert (Path(__file__).parent.parent / "docs" / "states.md").read_text(encoding="utf-8") == page()


# sentences

REFUSALS = [(kind, state, no.because) for kind in KINDS for state, no in TABLE[kind].items() if isinstance(no, No)]
SENTENCES = sorted({because for _, _, because in REFUSALS})


def keys_in(sentence: str) -> set[str]:
    """The keys that a sentence names: capitals that begin no word, and keys with names."""
    return set(re.findall(r"\b(?:F\d+|Esc|Enter|Space|Tab|Ctrl\S*|[A-Z])\b", sentence.removeprefix("A ")))


@pytest.mark.parametrize("sentence", SENTENCES)
def test_why_not_is_said_in_one_sentence(sentence: str) -> None:
    assert re.fullmatch(r"[A-Z][^.!?\n]*[a-z]\.", sentence)
    assert "  " not in sentence


def test_no_sentence_names_a_key_as_each_screen_has_its_own() -> None:
    assert not [because for because in SENTENCES if keys_in(because)]


# the emergency stop


@pytest.mark.parametrize("stack", REACHED)
def test_the_emergency_stop_halts_from_every_state_but_the_last_whatever_lies_over_it(stack: Stack) -> None:
    halted = after_on(stack, events.EmergencyStop)
    if stack[0] is S.STOPPED:
        assert isinstance(halted, No)
    elif stack == (S.HALTED,):
        assert halted == stack
    else:
        assert halted == (S.HALTED,)


def test_from_a_halt_a_run_comes_to_nothing_but_its_end_and_corrections() -> None:
    later = {(stack, after) for stack, _, after in MOVES if stack[0] is S.HALTED}
    assert later == {
        ((S.HALTED,), (S.HALTED,)),
        ((S.HALTED,), (S.HALTED, S.CORRECTING)),
        ((S.HALTED,), (S.STOPPED,)),
        ((S.HALTED, S.CORRECTING), (S.HALTED,)),
        ((S.HALTED, S.CORRECTING), (S.HALTED, S.CORRECTING)),
        ((S.HALTED, S.CORRECTING), (S.STOPPED,)),
    }


def test_a_run_that_has_ended_takes_nothing() -> None:
    assert not [kind for stack, kind, _ in MOVES if stack[0] is S.STOPPED]


def test_a_stop_a_lost_display_and_lost_results_end_a_run_from_everywhere() -> None:
    for stack in REACHED:
        for kind in (events.Stop, events.DisplayLost, events.ResultsGone):
            later = after_on(stack, kind)
            if kind is events.ResultsGone and stack == (S.HALTED,):  # that there was an emergency stop stays to be seen
                assert later == stack
                continue
            assert isinstance(later, No) if stack == (S.STOPPED,) else later == (S.STOPPED,)


# shots


def test_nothing_but_fire_and_the_test_shot_leads_to_firing_and_only_from_where_they_are_due() -> None:
    into = {(stack, kind) for stack, kind, later in MOVES if set(later) & set(ARMED) and stack != later}
    assert into == {((S.PREPARING,), events.Fire), ((S.REARMING,), events.Rearm)}


def test_whatever_lies_over_a_step_no_armed_state_is_beneath() -> None:
    assert [stack for stack in REACHED if set(stack) & set(ARMED)] == [(S.FIRING,), (S.TRAIN,)]


@pytest.mark.parametrize("kind", [events.Pause, events.ParticipantLost])
@pytest.mark.parametrize("state", ARMED)
def test_what_holds_a_shot_on_its_way_gives_the_shot_up(kind: Kind, state: State) -> None:
    assert after_on((state,), kind) == (S.SAVING, S.PAUSED)


# holding


@pytest.mark.parametrize("stack", [stack for stack in REACHED if S.PAUSED in stack])
def test_in_a_pause_nothing_moves_the_step_but_an_end(stack: Stack) -> None:
    taken = {kind for at, kind, later in MOVES if at == stack and later[0] is not stack[0]}
    assert taken == set(ENDS)


@pytest.mark.parametrize("stack", [stack for stack in REACHED if stack[-1] is S.CORRECTING and S.PAUSED not in stack])
def test_while_a_correction_is_open_nothing_moves_the_step_but_the_participants_own_answer_to_it_and_an_end(
    stack: Stack,
) -> None:
    taken = {kind for at, kind, later in MOVES if at == stack and later[0] is not stack[0]}
    own = {OWN[stack[0]]} if stack[0] in OWN else set()
    assert taken == own | {end for end in ENDS if stack[0] is not S.HALTED or end is not events.EmergencyStop}
    assert all(after_on(stack, kind) == (S.SAVING, S.CORRECTING) for kind in own)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*ACTS, *CARRY_ON])
@pytest.mark.parametrize("state", [S.PAUSED, S.CORRECTING, S.SAVING, S.FIRING, S.HALTED, S.STOPPED])
def test_what_carries_a_run_on_is_not_taken_where_it_is_held_or_busy(kind: Kind, state: State) -> None:
    change = TABLE[kind][state]
    exceptions = {(events.GoOn, S.PAUSED): BACK, (events.Correct, S.CORRECTING): BACK}
    exceptions |= {(own, S.CORRECTING): BENEATH for own in OWN.values()}
    if (kind, state) in exceptions:
        assert change == exceptions[kind, state]
    else:
        assert isinstance(change, No)


def test_each_state_takes_what_is_asked_for_there_and_nothing_else_of_the_kind() -> None:
    due = {(kind, state) for kind in CARRY_ON for state in State if isinstance(TABLE[kind][state], To)}
    repeats = {(events.Repeat, state) for state in STEPS if state not in (S.REARMING, S.DESCRIBING)}
    assert due - repeats == {
        (events.Rearm, S.REARMING),
        (events.DamperSet, S.SETTING),
        (events.Fire, S.PREPARING),
        (events.Next, S.TRAIN),
        (events.Answer, S.ASKING),
        (events.ParticipantKey, S.ASKING),
        (events.Rating, S.RATING),
        (events.ParticipantRated, S.RATING),
        (events.Description, S.DESCRIBING),
        (events.ParticipantDescribed, S.DESCRIBING),
        (events.Told, S.INFORMING),
        (events.EndBreak, S.RESTING),
        (events.BreakOver, S.RESTING),
        (events.Finish, S.CLOSING),
    }
    assert repeats <= due


def test_going_on_and_leaving_a_correction_come_back_to_what_was_beneath() -> None:
    for stack in REACHED:
        for over, kinds in ((S.PAUSED, (events.GoOn,)), (S.CORRECTING, (events.Leave, events.Correct))):
            if stack[-1] is over:
                assert {after_on(stack, kind) for kind in kinds} == {stack[:-1]}


def test_flags_and_notes_are_taken_in_every_state_of_a_live_run_and_change_nothing() -> None:
    for stack in REACHED:
        if stack != (S.STOPPED,):
            assert after_on(stack, events.Flag) == after_on(stack, events.Note) == stack


def test_a_lost_participants_screen_holds_what_can_be_held_also_beneath_a_correction() -> None:
    for state in STEPS:
        held = (state,) if state is S.CLOSING else (state, S.PAUSED)  # there is nothing left to show there
        assert after_on((state,), events.ParticipantLost) == held
    assert after_on((S.ASKING, S.CORRECTING), events.ParticipantLost) == (S.ASKING, S.PAUSED, S.CORRECTING)
    assert after_on((S.ASKING, S.PAUSED), events.ParticipantLost) == (S.ASKING, S.PAUSED)


def test_an_event_is_taken_exactly_where_the_table_does_not_say_no() -> None:
    for stack in REACHED:
        for kind in KINDS:
            assert isinstance(change_of(Position(states=stack), kind), No) == isinstance(after_on(stack, kind), No)


# positions

TIMES = st.floats(0, 1e6)


@pytest.mark.slow
@given(now_s=TIMES)
def test_a_position_gets_a_new_number_if_and_only_if_its_states_change(now_s: float) -> None:
    for stack, kind, later in MOVES:
        before = Position(states=stack, serial=7, since_s=-1.0)
        position = after(before, kind, now_s)
        assert isinstance(position, Position)
        assert (position.serial, position.since_s) == ((7, -1.0) if later == stack else (8, now_s))
        assert (position.paused_s is not None) == (S.PAUSED in later)


BREAK = Rest(between="sets", duration_s=30.0)
STEP_S = st.integers(0, 10_000).map(lambda ms: ms / 1000)
PAUSES = st.lists(st.tuples(STEP_S, STEP_S, STEP_S), max_size=4)


@pytest.mark.slow
@given(began_s=st.integers(0, 1000).map(float), pauses=PAUSES, corrected=st.lists(st.booleans(), min_size=4))
def test_the_end_of_a_break_is_put_off_by_the_time_of_its_pauses_also_with_a_correction_opened_there(
    began_s: float, pauses: list[tuple[float, float, float]], corrected: list[bool]
) -> None:
    now_s, end_s = began_s, began_s + BREAK.duration_s
    position = entered(Position(), S.RESTING, now_s, BREAK, end_s)
    for (rested_s, in_pause_s, in_correction_s), corrects in zip(pauses, corrected, strict=False):
        now_s += rested_s
        position = taken(position, events.Pause, now_s)
        now_s += in_pause_s
        if corrects:
            position = taken(position, events.Undo, now_s)
            now_s += in_correction_s
            position = taken(position, events.Leave, now_s)
        position = taken(position, events.GoOn, now_s)
        end_s += in_pause_s + (in_correction_s if corrects else 0.0)
    assert position.until_s == pytest.approx(end_s)


@given(in_correction_s=STEP_S)
def test_a_correction_alone_puts_no_break_off(in_correction_s: float) -> None:
    position = entered(Position(), S.RESTING, 5.0, BREAK, 35.0)
    position = taken(position, events.Undo, 6.0)
    position = taken(position, events.Leave, 6.0 + in_correction_s)
    assert position.until_s == 35.0


@given(paused_s=st.integers(0, 1000).map(float), saving_s=STEP_S, rest_s=STEP_S)
def test_a_break_that_comes_in_a_pause_is_whole_when_the_run_goes_on(
    paused_s: float, saving_s: float, rest_s: float
) -> None:
    position = taken(Position(), events.Pause, paused_s)
    began_s = paused_s + saving_s
    position = entered(position, S.RESTING, began_s, BREAK, began_s + BREAK.duration_s)
    position = taken(position, events.GoOn, began_s + rest_s)
    assert position.until_s == pytest.approx(began_s + rest_s + BREAK.duration_s)


@given(began_s=TIMES, later_s=TIMES)
def test_a_pause_counts_from_its_beginning_however_much_happens_in_it(began_s: float, later_s: float) -> None:
    position = taken(Position(states=(S.ASKING,)), events.Pause, began_s)
    for kind in (events.Undo, events.Leave, events.Note):
        position = taken(position, kind, began_s + later_s)
    assert position.paused_s == began_s


def taken(position: Position, kind: Kind, now_s: float) -> Position:
    later = after(position, kind, now_s)
    assert isinstance(later, Position), later
    return later
