"""Every accident of a hand at every state of the console, kept as a table: `make soak`."""

from __future__ import annotations

import importlib.util
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from experiments.session.states import TABLE, No, State
from tests.at_display import needs_display, virtual_display
from tests.at_hand import ACTIONS, STATES, Action, Cell, check_cell, check_gun, check_participants_keys
from tests.conftest import Soak
from tests.random_hands import MOVES, check_random_hands

pytest.importorskip("PyQt6")
pytestmark = [pytest.mark.soak, needs_display]

HANDS, AT_ONCE = 100, 2


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def said(state: State, action: Action) -> str:
    """What the table of states says to the action."""
    meant = action.meant(state)
    if meant is None:
        return "nothing is meant by it"
    change = TABLE[meant][state]
    return f"{meant.__name__}: {change.because if isinstance(change, No) else change}"


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("state", STATES)
def test_every_accident_at_every_state(tmp_path: Path, display: str, soak: Soak, state: State, action: str) -> None:
    happened = check_cell(Cell(tmp_path, display, state), ACTIONS[action])
    soak(f"{state} × {action}", happened.told, said(state, ACTIONS[action]), "real keys or clicks, with openbox")


@pytest.mark.parametrize("action", ["Space held 3 s", "double Space", "double click on Fire", "Tab Tab Space"])
def test_every_accident_that_fires_a_train(tmp_path: Path, display: str, soak: Soak, action: str) -> None:
    cell = Cell(tmp_path, display, State.PREPARING, experiment="preference")
    told = check_cell(cell, ACTIONS[action]).told
    soak(f"preparing, before a train × {action}", told, said(State.PREPARING, ACTIONS[action]), "the same")


@pytest.mark.skipif(importlib.util.find_spec("psychopy") is None, reason="PsychoPy is not installed: extra `gui`")
@pytest.mark.parametrize("state", [State.PREPARING, State.TRAIN, State.RATING, State.PAUSED, State.CORRECTING])
def test_keys_on_the_participants_window(tmp_path: Path, display: str, soak: Soak, state: State) -> None:
    cell = Cell(
        tmp_path,
        display,
        state,
        "--participant-screen",
        experiment="preference" if state is not State.CORRECTING else "",
    )
    with cell.reach() as screen:
        check_participants_keys(screen, cell, "p", "Escape", "space")
    check_gun(cell.watch, cell.journal)
    how = "the participant's window has the keys"
    soak(f"{state} × P, Esc, Space there, then F12 there", "nothing; then halted", "nothing; then halted", how)


def test_random_hands(tmp_path: Path, soak: Soak) -> None:
    def some(seeds: range) -> Counter[str]:
        seen: Counter[str] = Counter()
        with virtual_display() as display:
            for seed in seeds:
                folder = tmp_path / str(seed)
                folder.mkdir()
                seen.update(check_random_hands(folder, display, seed))
        return seen

    with ThreadPoolExecutor(AT_ONCE) as pool:
        seen = sum(pool.map(some, (range(first, HANDS, AT_ONCE) for first in range(AT_ONCE))), Counter[str]())
    of = ", ".join(f"{count} {kind}" for kind, count in sorted(seen.items()))
    how = f"{MOVES} moves a run, then worked to its end; {of}"
    soak(f"rules broken in {HANDS} runs by random hands", 0, "0", how)
