"""What a hand can do by accident at each state of the console, by real events, and what the table says comes of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.load import shipped_folder
from experiments.session import events
from experiments.session.events import ACTS, Event
from experiments.session.states import TABLE, No, State
from tests.at_display import AtConsole, middle, records, remarks
from tests.at_runs import shorten
from tests.waiting import wait_for
from tests.watched_console import Watch

S = State
HELD_S, DOUBLE_S = 3.0, 0.06
STATES = tuple(state for state in State if state is not State.SAVING)  # there for the time of a sync
TYPED = (S.RATING, S.DESCRIBING)
"""Where letters and blanks are text."""
IN_PREFERENCE = (S.TRAIN, *TYPED)

STEM = "results/sub-P01/sub-P01_task-"
NEXT_STATE = {S.FIRING: ("asking", "train"), S.SAVING: ("setting", "preparing"), S.STOPPED: ("stopped",)}
"""Where the run stands once it has gone on from a state by itself."""


def short_configs(folder: Path) -> Path:
    """The shipped configs, experiment 1 with two methods of two sets of two trials, the guard as it is."""
    configs = folder / "configs"
    (configs / "synthetic").mkdir(parents=True, exist_ok=True)
    for source in [*shipped_folder().glob("*.toml"), *shipped_folder().glob("synthetic/*.toml")]:
        (configs / source.relative_to(shipped_folder())).write_text(source.read_text())
    shorten(configs)
    config = configs / "direction.toml"
    config.write_text(config.read_text().replace("between_sets_s = 20.0", "between_sets_s = 600.0"))
    return configs


def words(configs: Path, experiment: str, *more: object) -> list[object]:
    run = ["run", configs / f"{experiment}.toml", "--screen", "console", "--results", "results"]
    return [*run, "--seed", 1, "--participant", "P01", *more]


# what a hand does


@dataclass(frozen=True)
class Action:
    """Something that a hand does, how often that is a press of Space, and which event it is at a state, if any."""

    name: str
    do: Callable[[AtConsole, tuple[int, int]], None]
    meant: Callable[[State], type[Event] | None]
    presses: int = 1


def _space(state: State) -> type[Event] | None:
    return None if state in TYPED else events.Next if state is S.TRAIN else events.Fire


def _pause(state: State) -> type[Event] | None:
    return None if state in TYPED else events.GoOn if state is S.PAUSED else events.Pause


_MIDDLE: dict[State, type[Event]] = {
    S.PREPARING: events.Fire,
    S.TRAIN: events.Next,
    S.PAUSED: events.GoOn,
    S.INFORMING: events.Told,
    S.CLOSING: events.Finish,
}
"""The buttons in Fire's place that do something at a click."""


def _hold_space(screen: AtConsole, _: tuple[int, int]) -> None:
    screen.keys.key_down("space")
    time.sleep(HELD_S)  # this is what the hand does
    screen.keys.key_up("space")


def _double_space(screen: AtConsole, _: tuple[int, int]) -> None:
    screen.keys.press("space")
    time.sleep(DOUBLE_S)
    screen.keys.press("space")


def _double_click(screen: AtConsole, place: tuple[int, int]) -> None:
    screen.keys.click(*place)
    time.sleep(DOUBLE_S)
    screen.keys.click(*place)


def _tab_tab_space(screen: AtConsole, _: tuple[int, int]) -> None:
    for key in ("Tab", "Tab", "space"):
        screen.keys.press(key)


ACTIONS = {
    action.name: action
    for action in (
        Action("F12", lambda screen, _: screen.keys.press("F12") and None, lambda _: events.EmergencyStop),
        Action(
            "Esc",
            lambda screen, _: screen.keys.press("Escape") and None,
            lambda state: events.Leave if state is S.CORRECTING else None,
        ),
        Action("P", lambda screen, _: screen.keys.press("p") and None, _pause),
        Action("Space held 3 s", _hold_space, _space),
        Action("double Space", _double_space, _space, presses=2),
        Action("double click on Fire", _double_click, _MIDDLE.get),
        Action("Tab Tab Space", _tab_tab_space, _space),
    )
}


# how a state is reached


class Cell:
    """A console at a state, and what a hand does there."""

    def __init__(self, folder: Path, display: str, state: State, *more: object, experiment: str = "") -> None:
        self._folder, self._display, self.state = folder, display, state
        self.experiment = experiment or ("preference" if state in IN_PREFERENCE else "direction")
        self.journal = folder / f"{STEM}{self.experiment}_journal.jsonl"
        configs = short_configs(folder)
        if state is S.INFORMING:
            config = configs / f"{self.experiment}.toml"
            config.write_text(f'{config.read_text()}\n[[opening]]\ntext = "The gun shoots once."\n')
        self._words = words(configs, self.experiment, *more)
        self.watch = Watch(str(folder), hangs=(2,) if state is S.FIRING else ())

    def reach(self) -> AtConsole:
        """A console that stands at the state, and waits."""
        if self.state is S.REARMING:
            with self._console() as screen:
                screen.to("preparing")
                screen.keys.press("F12")
                screen.at("halted")
                screen.keys.press("q")
                screen.close()
        screen = self._console("--resume" if self.state is S.REARMING else "--fresh")
        try:
            self.bring(screen)
        except BaseException:
            screen.__exit__()
            raise
        return screen

    def _console(self, *more: object) -> AtConsole:
        screen = AtConsole([*self._words, *more], self._folder, self._display, self.watch)
        screen.stands("Recoil – P01")
        return screen

    def bring(self, screen: AtConsole) -> None:
        """Bring a console to the state; where a trial has to be before it, to the second of a session."""
        match self.state:
            case S.FIRING:
                screen.to("preparing", trial=2)
                screen.keys.press("space")
                screen.until(lambda look: look.state == "firing" and self.watch.calls("hangs"))
            case S.PAUSED | S.CORRECTING | S.HALTED:
                screen.to("preparing", trial=2)
                screen.keys.press({S.PAUSED: "p", S.CORRECTING: "u", S.HALTED: "F12"}[self.state])
            case S.STOPPED:
                screen.to("preparing", trial=2)
                screen.line("q", "enough")
            case state:
                screen.to(str(state))
        if self.state is S.STOPPED:
            screen.until(lambda look: look.ended)
        elif self.state is not S.FIRING:
            screen.at(str(self.state))


@dataclass(frozen=True)
class Happened:
    """What came of an action: where the run stood before and stands now, shots fired, answers and remarks written."""

    before: str
    now: str
    ended: bool
    shots: int
    answers: int
    remarks: tuple[dict[str, Any], ...]

    @property
    def told(self) -> str:
        """In one line."""
        written = ", ".join(
            f"{body['kind']} ({body['event']}: {body['because']})" if body["kind"] == "refused" else body["kind"]
            for body in self.remarks
        )
        shots = f"{self.shots} shot{'' if self.shots == 1 else 's'}"
        return f"{self.now}{', ended' if self.ended else ''}; {shots}; {written or 'nothing written'}"


def fire_place(screen: AtConsole) -> tuple[int, int]:
    """Where Fire's button is, whatever stands there now: where it was seen, or another of its place, or beside it."""
    for name, right in (("fire", 0), ("rearm", 0), ("damper", 1), ("enter", 0)):
        looks = [look for look in screen.watch.looks() if name in look.places]
        if looks:
            x_px, y_px = middle(looks[-1], name)
            return x_px + right * looks[-1].places[name][2], y_px
    raise AssertionError("Fire's place is not known")


def shots_so_far(cell: Cell) -> int:
    """The shots so far; of a train none, as it fires by itself."""
    return 0 if cell.experiment == "preference" else len(cell.watch.calls("fired"))


def carry_out(cell: Cell, action: Action, screen: AtConsole) -> Happened:
    """Do it, wait until the window has heard of it and the run waits again, and look at what happened."""
    place = fire_place(screen) if action.name == "double click on Fire" else (0, 0)
    before, shots = screen.look(), shots_so_far(cell)
    answers, written = _answers(cell.journal), len(remarks(cell.journal))
    action.do(screen, place)
    now = screen.heard()
    if cell.state is S.FIRING:
        cell.watch.go_on.touch()
    now = screen.ready() if not now.ended else now
    now = screen.heard()
    due = written + len(expected_remarks(cell.state, action))  # the run may be slower to write than the window to show
    wait_for(lambda: len(remarks(cell.journal)) >= due, lambda: f"only {remarks(cell.journal)[written:]} are written")
    after = remarks(cell.journal)[written:]
    return Happened(
        before=before.state,
        now=now.state,
        ended=now.ended,
        shots=shots_so_far(cell) - shots,
        answers=_answers(cell.journal) - answers,
        remarks=tuple(after),
    )


def _answers(journal: Path) -> int:
    kinds = ("answered", "corrected")
    return sum(record.get("body", {}).get("kind") in kinds for record in records(journal))


# what the table says


def check(cell: Cell, action: Action, happened: Happened) -> None:
    """What happened is what the table says, and nothing else."""
    state = cell.state
    meant = action.meant(state)
    change = None if meant is None else TABLE[meant][state]
    assert happened.answers == 0
    assert happened.now in expected_states(state, meant), happened
    assert happened.shots == (0 if cell.experiment == "preference" else expected_shots(state, meant)), happened
    assert [body["kind"] for body in happened.remarks] == expected_remarks(state, action), happened
    refused = [body["because"] for body in happened.remarks if body["kind"] == "refused"]
    if isinstance(change, No):
        assert refused == [change.because] * len(refused)


def _taken(state: State, meant: type[Event] | None) -> bool:
    return meant is not None and not isinstance(TABLE[meant][state], No)


def expected_states(state: State, meant: type[Event] | None) -> tuple[str, ...]:
    """Where the run may stand afterwards."""
    if meant is None or not _taken(state, meant):
        return NEXT_STATE.get(state, (str(state),))  # a shot that hung goes on
    change: Any = TABLE[meant][state]
    if meant is events.Finish:
        return ("stopped",)
    if meant in (events.GoOn, events.Leave):
        return ("setting", "preparing")  # what lay under it in these tests
    target = getattr(change, "state", state)
    return NEXT_STATE.get(target, (str(target),))


def expected_shots(state: State, meant: type[Event] | None) -> int:
    """Shots that are fired: by Fire, and the one that hung, unless it was disarmed."""
    if state is S.FIRING:
        return int(not _taken(state, meant))
    return int(meant is events.Fire and _taken(state, meant))


def expected_remarks(state: State, action: Action) -> list[str]:
    """What is written beside the steps: what was taken, and each press that was refused and would have gone on."""
    meant = action.meant(state)
    kinds = {events.EmergencyStop: "halted", events.Pause: "paused", events.GoOn: "continued"}
    if meant is None or (meant is events.EmergencyStop and state is S.HALTED):
        return []
    if _taken(state, meant):
        again = ["refused"] * (action.presses - 1)  # the second press came for what stood there before
        return [kinds[meant]] if meant in kinds else again
    return [] if state is S.STOPPED or meant not in ACTS else ["refused"] * action.presses


def check_gun(watch: Watch, journal: Path) -> None:
    """From an emergency stop or a pause until the run goes on nothing is armed, and nothing fires once disarmed."""
    told = [record for record in records(journal) if record["kind"] in ("remark", "resumed")]
    for place, record in enumerate(told):
        if record.get("body", {}).get("kind") not in ("halted", "paused"):
            continue
        until_s = next((later["monotonic_s"] for later in told[place + 1 :] if _goes_on(later)), float("inf"))
        within = [call for call in watch.calls() if record["monotonic_s"] <= call["s"] < until_s]
        assert not [call for call in within if call["call"] == "armed"], within
        disarmed = next((at for at, call in enumerate(within) if call["call"] == "disarm"), len(within))
        assert not [call for call in within[disarmed:] if call["call"] == "fired"], within


def _goes_on(record: dict[str, Any]) -> bool:
    return record["kind"] == "resumed" or record["body"]["kind"] in ("continued", "test-shot")


def check_cell(cell: Cell, action: Action) -> Happened:
    """Bring a console to a state, do it, and check what came of it."""
    with cell.reach() as screen:
        happened = carry_out(cell, action, screen)
    check(cell, action, happened)
    check_gun(cell.watch, cell.journal)
    return happened


def check_in_one_run(cell: Cell, *accidents: tuple[State, str]) -> None:
    """The same of several in one run, in an order in which it comes to them."""
    cell.state = accidents[0][0]
    with cell.reach() as screen:
        for state, name in accidents:
            cell.state = state
            cell.bring(screen)
            check(cell, ACTIONS[name], carry_out(cell, ACTIONS[name], screen))
    check_gun(cell.watch, cell.journal)


PARTICIPANT = "Recoil: participant"


def check_participants_keys(screen: AtConsole, cell: Cell, *keys: str) -> None:
    """Keys on the participant's window do nothing to the run; F12 there halts it."""
    before = len(remarks(cell.journal))
    screen.focus_on(PARTICIPANT)
    screen.until(lambda look: not look.active and look.says("Keys: the participant's screen (F12 works there)"))
    for key in keys:
        screen.keys.press(key)
    screen.focus_on("Recoil – P01")
    screen.until(lambda look: look.active)
    look = screen.heard()
    assert look.state == str(cell.state)
    assert len(remarks(cell.journal)) == before
    screen.focus_on(PARTICIPANT)
    screen.until(lambda look: not look.active)
    screen.keys.press("F12")
    screen.until(lambda look: look.state == "halted" and look.says("The gun itself says that it is disarmed."))
    wait_for(lambda: len(remarks(cell.journal)) > before)  # the gun is stopped before that is on the disk
    assert remarks(cell.journal)[before:] == [{"by": "participant", "kind": "halted"}]
