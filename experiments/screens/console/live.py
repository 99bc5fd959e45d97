"""Runs at the console with what belongs to them: the start window, the participant's own screen, a synthetic one."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments.clock import RealClock
from experiments.load import load_setup, load_study
from experiments.places import PlaceError
from experiments.run import Finished, Request
from experiments.runner import RunStopped
from experiments.screens.console.app import Console, application, run_console
from experiments.screens.console.beside import ParticipantSide
from experiments.screens.console.screen import Hand
from experiments.screens.console.start import Choice, choose
from experiments.screens.console.visual import VisualParticipant
from experiments.screens.participant.link import ParticipantLink
from experiments.screens.participant.mailbox import ParticipantError
from experiments.setup import Setup
from experiments.standings import StudyFolder


@dataclass(frozen=True, slots=True, kw_only=True)
class Sides:
    """Who works the console, and what the participant has beside it."""

    visual: bool = False
    screen: bool = False
    own_keys: bool = False


def run_live(request: Request, sides: Sides) -> Finished:
    """Carry out a run at the console. `PlaceError` without a display, or if the participant's screen does not open."""
    application()
    driver: list[VisualParticipant] = []

    def watch(console: Console) -> None:
        if sides.visual:
            driver.append(VisualParticipant(request.setup, console))

    with ExitStack() as stack:
        beside = _participant(stack, own_keys=sides.own_keys) if sides.screen or sides.own_keys else None
        hand: Hand = "synthetic" if sides.visual else "experimenter"
        return run_console(request, RealClock(), hand=hand, beside=beside, watch=watch)


def lab_day(request: Request) -> None:
    """One run after the other from the start window, until it is closed. `request` says what all have in common."""
    application()
    study = _study(request)
    while (choice := choose(study, request.setup.config.experiment, request.gun, RealClock())) is not None:
        with ExitStack() as stack:
            results = Path(stack.enter_context(tempfile.TemporaryDirectory())) if choice.training else request.results
            try:
                run_live(_chosen(request, choice, results), _sides(choice))
            except RunStopped:
                continue  # the window has said so; the run can be gone on with from the start window


def _study(request: Request) -> StudyFolder:
    """The study that the config lies in with all its experiments, else the shipped one with this experiment alone."""
    own = request.setup.source.parent / "study.toml"
    if not own.is_file():
        config, folder = load_study("study")
        setups: tuple[Setup[Any], ...] = (request.setup,)
    else:
        config, folder = load_study(str(own))
        setups = tuple(load_setup(str(folder / name)) for name in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=request.results)


def _chosen(request: Request, choice: Choice, results: Path) -> Request:
    gun = "simulated" if choice.training else request.gun
    return replace(
        request,
        setup=choice.setup,
        participant_id=choice.participant_id,
        results=results,
        gun=gun,
        again=choice.again,
        practice=choice.practice,
    )


def _sides(choice: Choice) -> Sides:
    return Sides(screen=choice.participant_screen, own_keys=choice.participant_keys)


def _participant(stack: ExitStack, *, own_keys: bool) -> ParticipantSide:
    """The participant's screen, once it is open: PsychoPy takes its time."""
    try:
        link = stack.enter_context(ParticipantLink.start())
        link.wait_ready()
        link.show("Please wait.")
    except ParticipantError as error:
        raise PlaceError(f"--participant-screen: {error}; look at `recoil doctor`, or run without it") from error
    return ParticipantSide(link, own_keys=own_keys)
