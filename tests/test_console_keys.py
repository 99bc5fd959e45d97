"""Which command a key is, and which press counts: the console's keys without a window."""

from __future__ import annotations

from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.design.language import QuestionConfig
from experiments.design.plan import Trial, condition
from experiments.screens.console.keys import (
    ANSWERS,
    BOUNCE_S,
    KEY_COMMANDS,
    STRANGE_S,
    EventClock,
    Hold,
    Name,
    Presses,
    Typing,
    choices_at,
    command_for,
    field_at,
    shown_key,
    why_not,
)
from experiments.session import events
from experiments.session.events import Press
from experiments.session.states import TABLE, No, Position, State
from experiments.session.steps import Asking, what
from experiments.tasks.questions import choices
from tests.asked import WAYS, ask, describe, rate

S = State
LETTERS = sorted({command.key for command in KEY_COMMANDS if len(command.key) == 1})
TRIAL = Trial(session=1, set=1, trial=1, levels=condition(method="vibration", direction="forward"))
CORRECTED: tuple[Asking, ...] = (ask(TRIAL), rate(TRIAL), describe(TRIAL))


def at(state: State, entry: Asking = CORRECTED[0]) -> Position:
    """A position in a state; a pause and a correction lie over the question of a trial."""
    if state is S.CORRECTING:
        return Position(states=(S.ASKING, state), correcting=entry)
    return Position(states=(S.ASKING, state) if state is S.PAUSED else (state,))


POSITIONS = [*(at(state) for state in State), *(at(S.CORRECTING, entry) for entry in CORRECTED[1:])]
NO_FIELD = [position for position in POSITIONS if field_at(position) is None]
FIELD = [position for position in POSITIONS if field_at(position) is not None]
NOTHING = Typing()


def command(key: str, position: Position, *, ctrl: bool = False, line: bool = False) -> Name | None:
    typing = Typing(line=line, field=field_at(position) is not None)
    return command_for(key, ctrl=ctrl, typing=typing, position=position, choices=WAYS)


# which command a key is


def test_a_number_is_typed_at_a_rating_words_at_a_description_and_nothing_elsewhere() -> None:
    assert {(position.state, position.correcting and what(position.correcting)) for position in FIELD} == {
        (S.RATING, None),
        (S.DESCRIBING, None),
        (S.CORRECTING, "rating"),
        (S.CORRECTING, "description"),
    }


@pytest.mark.slow
@pytest.mark.parametrize("line", [False, True])
@pytest.mark.parametrize("ctrl", [False, True])
@pytest.mark.parametrize("position", POSITIONS, ids=lambda position: position.state)
def test_the_emergency_stop_and_the_keys_of_the_window_are_the_same_everywhere(
    position: Position, ctrl: bool, line: bool
) -> None:
    for key, name in (("F12", "emergency"), ("F1", "help"), ("F2", "theme"), ("Esc", "leave"), ("Enter", "enter")):
        assert command(key, position, ctrl=ctrl, line=line) == name


@pytest.mark.parametrize("position", NO_FIELD, ids=lambda position: position.state)
def test_where_nothing_is_typed_a_letter_is_a_command_and_with_ctrl_as_well_but_no_answer(position: Position) -> None:
    pause = "go on" if position.state is S.PAUSED else "pause"
    assert [command(key, position) for key in "FBMEUGNRQLYTSP"] == [
        *("answer 1", "answer 2", "damper", "end break", "undo", "flag", "note", "repeat", "stop", "list"),
        *("reason", "rearm", "restart", pause),
    ]
    for key in LETTERS:
        assert command(key, position, ctrl=True) == (None if key in "FB" else command(key, position))


@pytest.mark.parametrize("position", NO_FIELD, ids=lambda position: position.state)
def test_a_letter_of_answer_and_command_is_the_command_but_for_where_it_is_asked_for(position: Position) -> None:
    asked = choices(QuestionConfig(kind="choice", text="?", answers=("note", "pleasant", "much", "young")))
    assert [one.key for one in asked] == ["n", "p", "u", "y"]  # no answer says that the damper is set
    found = [
        command_for(key, ctrl=False, typing=NOTHING, position=position, choices=asked) for key in ("N", "P", "U", "Y")
    ]
    answers = ["answer 1", "answer 2", "answer 3", "answer 4"]
    pause = "go on" if position.state is S.PAUSED else "pause"
    if choices_at(position):
        assert found == answers
    elif position.state in (S.FIRING, S.SAVING):  # too soon, or twice; the gun can be held all the same
        assert found == [answers[0], pause, *answers[2:]]
    else:
        assert found == ["note", pause, "undo", "reason"]


@pytest.mark.parametrize("line", [False, True])
@pytest.mark.parametrize("position", FIELD, ids=lambda position: position.state)
def test_beside_a_field_letters_are_text_and_with_ctrl_they_are_commands(position: Position, line: bool) -> None:
    assert [command(key, position, line=line) for key in LETTERS] == [None] * len(LETTERS)
    assert [command(key, position, ctrl=True, line=line) for key in "UNP"] == ["undo", "note", "pause"]


@pytest.mark.parametrize("position", POSITIONS, ids=lambda position: position.state)
def test_in_a_line_letters_and_space_are_text_and_with_ctrl_letters_are_commands(position: Position) -> None:
    assert [command(key, position, line=True) for key in ("Space", *LETTERS)] == [None] * (1 + len(LETTERS))
    assert command("U", position, line=True, ctrl=True) == "undo"


@pytest.mark.parametrize("line", [False, True])
@pytest.mark.parametrize("position", POSITIONS, ids=lambda position: position.state)
def test_ctrl_and_space_which_changes_the_input_method_never_fires(position: Position, line: bool) -> None:
    assert command("Space", position, ctrl=True, line=line) is None


def test_space_is_next_in_a_train_and_fire_wherever_else_it_is_a_command() -> None:
    for position in NO_FIELD:
        assert command("Space", position) == ("next" if position.state is S.TRAIN else "fire")
    for position in FIELD:
        assert command("Space", position) is None


def test_ctrl_x_is_no_answer_beside_a_number_and_cuts_text_everywhere_else() -> None:
    for position in POSITIONS:
        number = field_at(position) == "number"
        assert command("X", position, ctrl=True) == ("no answer" if number else None)
        assert command("X", position, ctrl=True, line=True) is None
        assert command("X", position) is None


@pytest.mark.parametrize("position", POSITIONS, ids=lambda position: position.state)
def test_a_key_that_stands_on_no_button_is_no_command(position: Position) -> None:
    for key in ("A", "Z", "7", "Tab", "F5", "#16777217"):
        assert command(key, position) is None
        assert command(key, position, ctrl=True) is None


def test_every_command_that_does_something_somewhere_is_had_by_its_key_there() -> None:
    for one in KEY_COMMANDS:
        ctrl = one.key.startswith("Ctrl+")
        for position in POSITIONS:
            if one.name in ANSWERS[len(WAYS) :]:
                continue
            key = shown_key(one.name, letters=False, choices=WAYS)
            letters = field_at(position) is not None and len(key) == 1
            found = command(key.removeprefix("Ctrl+"), position, ctrl=ctrl or letters)
            if one.kind is not None and not why_not(one.name, position) and not does_more(one.name, position):
                assert found == one.name, (one, position)


def does_more(name: Name, position: Position) -> bool:
    """Whether the table takes an event for more than the command's own field: no answer is a rating, never words."""
    return name == "no answer" and field_at(position) != "number"


def test_why_a_command_does_nothing_is_what_the_table_says() -> None:
    for one in KEY_COMMANDS:
        for position in POSITIONS:
            corrects = position.state is S.CORRECTING and (
                one.name == "no answer" or (one.name in ANSWERS and field_at(position) is None)
            )
            tells = one.name == "enter" and position.state is S.INFORMING
            kind = events.Correct if corrects else events.Told if tells else one.kind
            if kind is None:
                assert why_not(one.name, position) == ""
                continue
            change = TABLE[kind][position.state]
            assert why_not(one.name, position) == (change.because if isinstance(change, No) else "")


# which press counts

How = Literal["flagged", "flagged pairs", "pairs"]
"""How systems tell that a key is held: more presses, more presses and releases, both with or without a mark."""


def repeat(presses: Presses, key: str, at_s: float, how: How) -> bool:
    """What the system makes of a key that is held; whether anything acts."""
    if how == "flagged":
        return presses.down(key, at_s, repeated=True)
    presses.up(key, at_s, repeated=how == "flagged pairs")
    return presses.down(key, at_s, repeated=how == "flagged pairs")


HANDS = st.lists(
    st.tuples(
        st.sampled_from(["Space", "F"]), st.integers(0, 40), st.sampled_from(["flagged", "flagged pairs", "pairs"])
    ),
    max_size=12,
)


@pytest.mark.slow
@given(hands=HANDS)
def test_however_long_a_key_is_held_and_however_that_is_told_a_press_acts_once(
    hands: list[tuple[str, int, How]],
) -> None:
    presses, now_s, acted = Presses(), 100.0, []
    for key, repeats, how in hands:
        now_s += 0.03
        acted.append(presses.down(key, now_s, repeated=False))
        for _ in range(repeats):
            now_s += 0.033
            acted.append(repeat(presses, key, now_s, how))
        now_s += 0.033
        presses.up(key, now_s, repeated=False)
    assert sum(acted) == len(hands)


def test_a_press_acts_when_the_key_goes_down_and_not_when_it_comes_up() -> None:
    presses = Presses()
    assert presses.down("F", 1.0, repeated=False)
    presses.up("F", 5.0, repeated=False)
    assert presses.down("F", 5.1, repeated=False)


def test_two_keys_that_overlap_act_both() -> None:
    presses = Presses()
    assert presses.down("F", 1.0, repeated=False)
    assert presses.down("B", 1.05, repeated=False)
    presses.up("F", 1.1, repeated=False)
    presses.up("B", 1.15, repeated=False)
    assert presses.down("F", 1.2, repeated=False)


@given(gap_ms=st.integers(0, 60))
def test_a_contact_that_bounces_does_not_act_twice_and_a_quick_hand_does(gap_ms: int) -> None:
    presses = Presses()
    presses.down("Space", 1.0, repeated=False)
    presses.up("Space", 2.0, repeated=False)
    assert presses.down("Space", 2.0 + gap_ms / 1000, repeated=False) == (gap_ms >= 20)
    assert BOUNCE_S == 0.02


def test_after_a_bounce_the_next_press_acts() -> None:
    presses = Presses()
    presses.down("Space", 1.0, repeated=False)
    presses.up("Space", 1.1, repeated=False)
    assert not presses.down("Space", 1.105, repeated=False)
    presses.up("Space", 1.2, repeated=False)
    assert presses.down("Space", 1.3, repeated=False)


def test_a_press_after_the_stamps_have_begun_anew_acts() -> None:
    presses = Presses()
    presses.down("Space", 4_294_966.0, repeated=False)
    presses.up("Space", 4_294_967.0, repeated=False)
    assert presses.down("Space", 0.3, repeated=False)


def test_a_key_that_was_let_go_unseen_acts_when_it_is_pressed_again() -> None:
    presses = Presses()
    assert presses.down("F12", 1.0, repeated=False)
    presses.lost()
    assert presses.down("F12", 1.5, repeated=False)


@pytest.mark.parametrize("how", ["flagged", "flagged pairs", "pairs"])
def test_a_key_that_is_still_held_when_the_window_gets_the_keys_back_does_not_act(how: How) -> None:
    presses = Presses()
    presses.down("Space", 1.0, repeated=False)
    presses.lost()
    assert not any(repeat(presses, "Space", 1.5 + 0.033 * count, how) for count in range(10))


def test_a_key_that_goes_down_twice_without_having_come_up_acts_once() -> None:
    presses = Presses()
    assert presses.down("Space", 1.0, repeated=False)
    assert not presses.down("Space", 2.0, repeated=False)


def test_a_release_without_a_press_is_none() -> None:
    presses = Presses()
    presses.up("Space", 1.0, repeated=False)
    assert presses.down("Space", 1.1, repeated=False)


# when a press was

DELAYS = st.lists(st.tuples(st.integers(0, 60_000), st.integers(0, 1_900)), min_size=1, max_size=30)


@pytest.mark.slow
@given(zero_s=st.integers(-4_000_000, 4_000_000), presses=DELAYS)
def test_a_press_is_never_dated_before_it_was_nor_after_it_was_seen(
    zero_s: int, presses: list[tuple[int, int]]
) -> None:
    clock, now_ms = EventClock(), 10_000_000
    for after_ms, late_ms in presses:
        now_ms += after_ms
        seen_s = (now_ms + late_ms) / 1000
        dated_s = clock.at(now_ms / 1000 - zero_s, seen_s)
        assert now_ms / 1000 - 1e-6 <= dated_s <= seen_s + 1e-6


def test_once_a_press_was_seen_at_once_a_late_one_is_dated_when_it_went_down() -> None:
    clock = EventClock()
    assert clock.at(5.0, 100.0) == 100.0
    assert clock.at(6.0, 101.4) == pytest.approx(101.0)


@given(jump_s=st.integers(3, 4_294_967))
def test_a_stamp_whose_zero_has_jumped_is_not_believed(jump_s: int) -> None:
    clock = EventClock()
    clock.at(4_294_967.0, 100.0)  # X counts milliseconds in 32 bits: after 49.7 days it begins anew
    assert clock.at(4_294_967.0 - jump_s, 101.0) == 101.0
    assert STRANGE_S == 2.0


def test_a_key_that_nobody_looked_at_for_a_while_is_held_anew() -> None:
    hold = Hold(Press(at_s=10.0, serial=1), 10.0, by_key=True)
    assert [hold.held_s(at_s, down=True) for at_s in (10.1, 10.25, 10.5)] == pytest.approx([0.1, 0.25, 0.5])
    assert hold.held_s(13.5, down=True) == 0.0  # stopped, starved or swapped out: it may have been let go
    assert hold.held_s(13.6, down=True) == pytest.approx(0.1)


def test_a_key_that_may_have_been_let_go_counts_as_held_only_once_it_is_down_again() -> None:
    by_key, by_mouse = (Hold(Press(at_s=10.0, serial=1), 10.0, by_key=by_key) for by_key in (True, False))
    assert [hold.held_s(10.2, down=False) for hold in (by_key, by_mouse)] == pytest.approx([0.0, 0.2])
    assert by_key.held_s(10.3, down=True) == pytest.approx(0.3)


def test_a_key_that_is_held_is_not_let_go_by_repeats_that_come_as_releases_and_presses_apart() -> None:
    presses = Presses()
    presses.down("T", 0.0, repeated=False)
    for at_s in (0.5, 0.54, 0.58):
        number = presses.up("T", at_s, repeated=False)
        assert presses.was_let_go("T", number)
        presses.down("T", at_s + 0.02, repeated=False)
        assert not presses.was_let_go("T", number)
        presses.up("T", at_s + 0.04, repeated=False)
        assert not presses.was_let_go("T", number)  # it is the release after it that may have been a hand's
        presses.down("T", at_s + 0.04, repeated=False)
