"""Runs at the console with what belongs to them: the start window, the participant's own screen, a synthetic one."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from PyQt6.QtGui import QGuiApplication

from device import DeviceError
from experiments.clock import RealClock
from experiments.events import Hand
from experiments.journal import JournalError
from experiments.live_run import RunStopped
from experiments.load import ConfigError, load_setup, load_study
from experiments.places import PlaceError
from experiments.run import Finished, Request, UnfinishedRun
from experiments.screens.console.app import Console, application, run_console
from experiments.screens.console.beside import WAIT, ParticipantSide
from experiments.screens.console.rater import Rater
from experiments.screens.console.start import Choice, choose
from experiments.screens.console.unfinished import ask
from experiments.screens.console.visual import VisualParticipant
from experiments.screens.console.waiting import while_shown
from experiments.screens.participant.link import ParticipantLink
from experiments.screens.participant.look import Look
from experiments.screens.participant.mailbox import ParticipantError
from experiments.screens.participant.words import NoiseIs
from experiments.setup import Setup
from experiments.standings import StudyFolder

_NO_HANDS = "--visual --participant-screen rates by synthetic events, which only an X display takes"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sides:
    """Who works the console, and what the participant has beside it."""

    visual: bool = False
    screen: bool = False
    own_keys: bool = False
    noise: bool = False

    @property
    def beside(self) -> bool:
        """Whether the participant's own process runs at all."""
        return self.screen or self.own_keys or self.noise


def run_live(request: Request, sides: Sides) -> Finished:
    """Carry out a run at the console. An unfinished one is shown and asked about, but for a synthetic participant.

    `PlaceError` without a display, or if the participant's screen does not open.
    """
    application()
    try:
        return _carry_out(request, sides)
    except UnfinishedRun as found:
        again = None if sides.visual else ask(found)
        if again is None:
            raise
        return _carry_out(replace(request, again=again), sides)


def _carry_out(request: Request, sides: Sides) -> Finished:
    driver: list[VisualParticipant] = []
    clock = RealClock()

    with ExitStack() as stack:
        rater = _rater(stack) if sides.visual and sides.screen else None
        beside = _participant(stack, request, sides) if sides.beside else None

        def watch(console: Console) -> None:
            if sides.visual:
                driver.append(VisualParticipant(console, clock, rater, beside))

        hand: Hand = "synthetic" if sides.visual else "experimenter"
        return run_console(request, clock, hand=hand, beside=beside, watch=watch)


def lab_day(request: Request) -> None:
    """One run after the other from the start window, until it is closed. `request` says what all have in common."""
    application()
    study, said = _study(request), ""
    while (choice := choose(study, request.setup.config.experiment, request.gun, RealClock(), said)) is not None:
        with ExitStack() as stack:
            results = Path(stack.enter_context(tempfile.TemporaryDirectory())) if choice.training else request.results
            said = _what_became(_chosen(request, choice, results), _sides(choice))


def _what_became(request: Request, sides: Sides) -> str:
    """Carry out a run of a lab day; what went wrong, for the start window, which it must not end."""
    try:
        run_live(request, sides)
    except RunStopped as stop:
        return f"{request.participant_id} stopped: {stop}. Choose them again to go on."
    except (PlaceError, JournalError, ConfigError, DeviceError) as error:
        return str(error)
    return ""


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
    return Sides(screen=choice.participant_screen, own_keys=choice.participant_keys, noise=choice.noise)


def _participant(stack: ExitStack, request: Request, sides: Sides) -> ParticipantSide:
    """The participant's screen, once it is open: PsychoPy takes its time, and a window says so meanwhile."""
    look = _look()

    def open_link() -> ParticipantLink:
        link = stack.enter_context(ParticipantLink.start(look))
        link.wait_ready()
        link.show(WAIT)
        return link

    try:
        link = while_shown("Starting the participant's screen …", open_link)
    except ParticipantError as error:
        raise PlaceError(f"--participant-screen: {error}; look at `recoil doctor`, or run without it") from error
    return ParticipantSide(
        link,
        open_link,
        request.setup,
        rates=sides.screen,
        own_keys=sides.own_keys,
        noise=_noise(link) if sides.noise else None,
        hand="synthetic" if sides.visual else "participant",
    )


def _look() -> Look:
    """The last of several screens, all of it; where there is one, a window that leaves the console in reach."""
    screens = len(QGuiApplication.screens())
    return Look(screen=screens - 1, full_screen=screens > 1)


def _noise(link: ParticipantLink) -> NoiseIs:
    """Masking noise, which ends with the participant's process; why it stays off, if it does."""
    try:
        return link.noise(on=True)
    except ParticipantError as error:
        return NoiseIs(on=False, message=f"Masking noise stays off: {error}")


def _rater(stack: ExitStack) -> Rater:
    """The hands that rate on the participant's screen. `PlaceError` where nothing gives them."""
    try:
        from experiments.screens.xkeys import Hands, NoDisplay  # noqa: PLC0415 - Linux alone has it
    except ModuleNotFoundError as error:
        raise PlaceError(f"{_NO_HANDS} ({error.name} is missing)") from error
    try:
        hands = Hands()
    except NoDisplay as error:
        raise PlaceError(f"{_NO_HANDS}: {error}") from error
    stack.callback(hands.close)
    return Rater(hands)
