"""A page over the run (F1 the keys, L the marks): what is done from it, and what takes it away."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.session.states import State
from tests.at_controls import Sitting, sat_at

PRESS_AGAIN = "Here is the run again: press again."
S = State


def under_a_page(sitting: Sitting, key: str = "F1") -> None:
    sitting.press(key)
    assert sitting.controls.page


@pytest.mark.parametrize("key", ["F1", "L"])
def test_the_key_that_opened_a_page_and_esc_close_it(key: str, tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        for closing in (key, "Esc"):
            under_a_page(sitting, key)
            sitting.press(closing)
            assert sitting.controls.page is None
            assert PRESS_AGAIN not in sitting.window.heard


def test_one_page_takes_the_place_of_the_other(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        under_a_page(sitting, "F1")
        under_a_page(sitting, "L")
        assert sitting.controls.page == "list"


@pytest.mark.parametrize(
    ("state", "key"),
    [(S.ASKING, "F"), (S.PREPARING, "Space"), (S.ASKING, "N"), (S.CLOSING, "Enter"), (S.REARMING, "T")],
)
def test_what_would_be_done_unseen_takes_the_page_away_and_is_done_by_the_next_press(
    state: State, key: str, tmp_path: Path
) -> None:
    with sat_at(state, tmp_path) as sitting:
        under_a_page(sitting)
        before = sitting.position
        sitting.press(key)
        assert sitting.controls.page is None
        assert PRESS_AGAIN in sitting.window.heard
        assert sitting.position == before
        if state is S.REARMING:
            sitting.go_on()
        else:
            sitting.press(key)
        assert sitting.position != before or sitting.controls.typing.line


@pytest.mark.parametrize("keys", [["F1"], ["P"], ["N"], ["F1", "Esc"]], ids="+".join)
def test_a_test_shot_that_is_held_for_is_called_off_by_whatever_else_is_pressed(
    keys: list[str], tmp_path: Path
) -> None:
    with sat_at(S.REARMING, tmp_path) as sitting:
        sitting.ready()
        sitting.window.down("T")
        sitting.look_for(0.3)
        for key in keys:
            sitting.press(key)
        sitting.look_for(2.0)
        sitting.settle()
        assert sitting.position.base is S.REARMING
        assert "rendered" not in sitting.gun.words


def test_a_pause_is_taken_from_a_page_which_goes(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        under_a_page(sitting)
        sitting.press("P")
        assert sitting.state is S.PAUSED
        assert sitting.controls.page is None


def test_next_ends_a_train_from_a_page(tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        under_a_page(sitting)
        sitting.clock.skip(2.0)
        sitting.press("Space")
        assert sitting.state is not S.TRAIN


@pytest.mark.parametrize("key", ["F1", "L"])
def test_a_stop_in_a_train_is_taken_from_a_page_and_pauses_first(key: str, tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        under_a_page(sitting, key)
        sitting.press("Q")
        assert sitting.state is S.PAUSED
        assert sitting.controls.page is None
        assert sitting.controls.typing.line


def test_a_window_that_is_closed_under_a_page_asks_why_where_that_is_seen(tmp_path: Path) -> None:
    with sat_at(S.PREPARING, tmp_path) as sitting:
        under_a_page(sitting)
        sitting.controls.ask_why_it_stops()
        assert sitting.controls.page is None
        assert sitting.controls.typing.line


def test_the_emergency_stop_is_taken_from_a_page_which_goes(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        under_a_page(sitting)
        sitting.press("F12")
        sitting.paint()
        assert sitting.state is S.HALTED
        assert sitting.controls.page is None


def test_a_page_goes_when_there_is_something_new_to_do(tmp_path: Path) -> None:
    with sat_at(S.RESTING, tmp_path) as sitting:
        under_a_page(sitting, "L")
        sitting.clock.skip(400.0)
        sitting.settle()
        sitting.paint()
        assert sitting.state is not S.RESTING
        assert sitting.controls.page is None
