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
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.live_run import RunStopped
from experiments.load import load_setup, load_study
from experiments.record.journal import JournalError
from experiments.run import Finished, RunRequest, UnfinishedRun
from experiments.screens.console.app import Console, application, run_console
from experiments.screens.console.beside import WAIT, ParticipantSide
from experiments.screens.console.form import Opening, monitors
from experiments.screens.console.start import choose
from experiments.screens.console.unfinished import ask, while_shown
from experiments.screens.console.visual import Rater, VisualParticipant
from experiments.screens.console.windows import signals_to
from experiments.screens.participant.link import ParticipantLink
from experiments.screens.participant.process import ParticipantError
from experiments.screens.participant.words import Look, NoiseIs
from experiments.study.places import PlaceError
from experiments.study.progress import StudyFolder


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """What the window says of a run: the band of a practice or a training, and the last sentence."""

    band: str = ""
    last: str = "Thank the participant."


_NO_HANDS = "--visual --participant-screen rates by synthetic events, which only an X display takes"


def run_live(request: RunRequest, words: Words | None = None) -> Finished:
    """Carry out a run at the console. An unfinished one is shown and asked about, but for a synthetic participant.

    `PlaceError` without a display, or if the participant's screen does not open.
    """
    application()
    try:
        return _carry_out(request, words or Words())
    except UnfinishedRun as found:
        decided = None if request.visual else ask(request, found)
        if decided is None:
            raise
        return _carry_out(decided, words or Words())


def _carry_out(request: RunRequest, words: Words) -> Finished:
    driver: list[VisualParticipant] = []
    clock = RealClock()

    with ExitStack() as stack:
        rater = _rater(stack) if request.visual and request.options.screen else None
        beside = _participant(stack, request) if request.options.any else None

        def watch(console: Console) -> None:
            if request.visual:
                driver.append(VisualParticipant(console, clock, rater, beside))

        return run_console(request, clock, beside=beside, band=words.band, last=words.last, watch=watch)


def lab_day(request: RunRequest) -> None:
    """One run after the other from the start window, until it is closed.

    `request` says what all have in common, and what is ticked at first. `KeyboardInterrupt` if a signal ended it.
    """
    application()
    check_monitor(request.options.monitor)
    study, named = _study(request), request.setup.config.experiment
    opening = Opening(gun=request.gun, named=named, options=request.options)
    with signals_to() as signalled:
        while not signalled and (choice := choose(study, opening, RealClock())) is not None:
            said = _of_the_day(request, study, choice)
            opening = Opening(gun=request.gun, options=choice.options, participant_id=_seated(choice), said=said)
    if signalled:
        raise KeyboardInterrupt(signalled[0])


def check_monitor(monitor: int | None) -> None:
    """`PlaceError` if there is no such screen."""
    known = monitors()
    if monitor is not None and monitor >= len(known):
        raise PlaceError(f"--participant-monitor {monitor}: there is no such screen; known are {'; '.join(known)}")


def _seated(choice: RunRequest) -> str:
    """Who was there; nobody in a training."""
    return "" if choice.training else choice.participant_id


def _words(study: StudyFolder, choice: RunRequest) -> Words:
    """What the window of a chosen run is to say of it."""
    if choice.training:
        return Words(band="TRAINING – nothing of it is kept", last="The training is over.")
    if choice.practice:
        return Words(band="PRACTICE – never analysed", last="The practice is over: the run itself comes next.")
    names = [setup.config.experiment for setup in study.setups]
    later = names[names.index(choice.setup.config.experiment) + 1 :]
    return Words(last=f"Next: {later[0]}.") if later else Words()


def _of_the_day(request: RunRequest, study: StudyFolder, choice: RunRequest) -> str:
    """Carry out what was chosen; what went wrong, for the start window, which it must not end."""
    with ExitStack() as stack:
        results = Path(stack.enter_context(tempfile.TemporaryDirectory())) if choice.training else request.results
        try:
            run_live(replace(choice, seed=request.seed, results=results), _words(study, choice))
        except RunStopped as stop:
            return _stopped(choice, str(stop))
        except (PlaceError, JournalError, ConfigError, DeviceError) as error:
            return str(error)
    return ""


def _stopped(choice: RunRequest, reason: str) -> str:
    if choice.training:
        return f"The training stopped: {reason}."
    if choice.practice:
        return f"The practice of {choice.participant_id} stopped: {reason}. It can be done again."
    return f"{choice.participant_id} stopped: {reason}. Start asks whether to go on there or to start anew."


def _study(request: RunRequest) -> StudyFolder:
    """The study that the config lies in, if the study names it; else this experiment alone, by the rules of that study.

    Where there is no study beside the config, they are those of the shipped one.
    """
    own = request.setup.source.parent / "study.toml"
    config, folder = load_study(str(own) if own.is_file() else "study")
    setups: tuple[Setup[Any], ...] = (request.setup,)
    if request.setup.source.resolve() in [(folder / name).resolve() for name in config.experiments]:
        setups = tuple(load_setup(str(folder / name)) for name in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=request.results)


def _participant(stack: ExitStack, request: RunRequest) -> ParticipantSide:
    """The participant's screen, once it is open: PsychoPy takes its time, and a window says so meanwhile."""
    options = request.options
    check_monitor(options.monitor)
    look = _look(options.monitor)

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
        rates=options.screen,
        own_keys=options.keys,
        noise=_noise(link) if options.noise else None,
        hand="synthetic" if request.visual else "participant",
    )


def _look(monitor: int | None) -> Look:
    """The screen that was chosen, else the last of several, all of it; of one screen a part, to leave the console."""
    screens = len(QGuiApplication.screens())
    return Look(screen=screens - 1 if monitor is None else monitor, full_screen=screens > 1)


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
