"""`recoil run` and `recoil rebuild`: which screen and clock a run gets, and tables made again."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments import storage
from experiments.clock import Clock, RealClock, VirtualClock
from experiments.load import load_setup
from experiments.places import Place, PlaceError, set_aside_file
from experiments.plan import Plan
from experiments.run import Again, Request, rebuild, run
from experiments.runner import RunStopped, Screen
from experiments.screens.synthetic import synthetic_screen
from experiments.screens.terminal import TerminalScreen
from experiments.setup import Setup


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What was asked for on the command line."""

    config: str
    participant_id: str
    gun: str
    screen: str
    results: Path
    seed: int | None
    resume: bool
    fresh: bool


def run_session(asked: Asked) -> Place:
    """Carry out what was asked for. `PlaceError` for what cannot be done here; a stop raises `KeyboardInterrupt`."""
    _check_screen(asked)
    clock: Clock = VirtualClock() if asked.screen == "synthetic" else RealClock()
    request = Request(
        setup=load_setup(asked.config),
        participant_id=asked.participant_id,
        results=asked.results,
        gun=asked.gun,
        seed=asked.seed,
        again=_again(asked),
    )
    try:
        return run(request, synthetic_screen if asked.screen == "synthetic" else _terminal, clock).place
    except RunStopped as stop:
        with suppress(OSError):  # where the terminal is gone, nobody reads it
            sys.stderr.write(f"recoil: stopped: {stop}. Go on with --resume.\n")
        raise KeyboardInterrupt from stop


def _check_screen(asked: Asked) -> None:
    if asked.screen == "console":
        raise PlaceError("--screen console: this version has no console; use --screen terminal")
    if asked.screen == "terminal" and not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise PlaceError("--screen terminal: standard input and output are no terminal; use --screen synthetic")


def _again(asked: Asked) -> Again:
    if asked.resume and asked.fresh:
        raise PlaceError("--resume and --fresh: give one of them; the first goes on with a run, the second starts anew")
    return "resume" if asked.resume else "fresh" if asked.fresh else "ask"


def _terminal(setup: Setup[Any], plan: Plan, clock: Clock) -> Screen:
    del setup
    return TerminalScreen(plan, clock)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rebuilt:
    """A table made again: whether it had to be written, and what there is to say."""

    table: Path
    rebuilt: bool
    messages: tuple[str, ...]


def rebuild_tables(journals: list[Path]) -> list[Rebuilt]:
    """The tables of journals. A table that differs from its journal is set aside, not overwritten."""
    return [_rebuild(path) for path in journals]


def _rebuild(path: Path) -> Rebuilt:
    table, data, contents = rebuild(path)
    messages = [contents.cut_message] if contents.cut_message else []
    same = table.exists() and table.read_bytes() == data
    if table.exists() and not same:
        messages.append(f"{table}: differed from its journal and was set aside as {set_aside_file(table)}")
    if not same:
        storage.write_whole(table, data)
    return Rebuilt(table=table, rebuilt=not same, messages=tuple(messages))
