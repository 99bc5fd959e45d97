"""A lab day: runs chosen in the start window, one after the other, and what it says of each."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from pathlib import Path

from device.messages import RecoilError
from experiments.catalogues.catalogue import Language
from experiments.clock import RealClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.earlier_run import NotAsItBegan, UnfinishedRun, gone_on_with
from experiments.live_run import RunStopped
from experiments.load import load_setup, load_study
from experiments.record.names import participant_folder
from experiments.run_request import RunRequest
from experiments.screens.console.app import application
from experiments.screens.console.form import SENDS_MARKERS, Opening
from experiments.screens.console.live import check_monitor, run_live, unfinished_text, while_shown
from experiments.screens.console.start import SIMULATED, choose_run
from experiments.screens.console.view import THANK_PARTICIPANT
from experiments.screens.console.widgets import SET_ASIDE
from experiments.screens.console.windows import signals_to
from experiments.screens.phrases import phrase
from experiments.study.enrolment import left_to_do
from experiments.study.folders import StudyFolder, look_at

OpenMarkers = Callable[[Path, Callable[[str], None]], AbstractContextManager[None]]
"""Has the runs of a results folder sent to Lab Streaming Layer meanwhile; what is in the way is said."""


def lab_day(request: RunRequest, languages: tuple[Language, ...], markers: OpenMarkers) -> None:
    """One run after the other from the start window, until it is closed.

    `request` says what all have in common, and what is ticked at first; `languages` which there are to choose from.
    `KeyboardInterrupt` if a signal ended it.
    """
    application()
    check_monitor(request.options.monitor)
    study, named = study_of(request), request.setup.config.experiment
    opening = Opening(
        gun=request.gun,
        named=named,
        languages=languages,
        language=request.language.code,
        options=request.options,
        sensor=request.sensor,
        markers=request.markers,
    )
    with signals_to() as signalled:
        while not signalled and (choice := choose_run(study, opening, RealClock())) is not None:
            said = _of_the_day(request, study, replace(choice, catalogues=request.catalogues), markers, opening.had)
            code = "" if choice.training else choice.participant_id
            opening = replace(opening, named="", options=choice.options, language=choice.language.code)
            opening = replace(opening, sensor=choice.sensor, markers=choice.markers, participant_id=code, said=said)
    if signalled:
        raise KeyboardInterrupt(signalled[0])


def _what_is_next(study: StudyFolder, choice: RunRequest) -> str:
    """What somebody has still to do after a run. `PlaceError`, `JournalError` as of `look_at`."""
    if choice.training:
        return THANK_PARTICIPANT
    person, _ = look_at(study, choice.participant_id)
    left = [one for one in left_to_do(person, study.experiments) if one != choice.setup.config.experiment]
    return phrase("Next: {later}.", later=left[0]) if left else THANK_PARTICIPANT


def _of_the_day(
    request: RunRequest, study: StudyFolder, choice: RunRequest, markers: OpenMarkers, had: set[Path]
) -> str:
    """Carry out what was chosen; what went wrong, for the start window, which it must not end.

    `had` gains the folder of whoever began.
    """
    said, halts = list[str](), threading.Event()
    with ExitStack() as stack:
        if choice.training:
            results = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            choice = replace(choice, results=results, sensor="", markers=False)
        if choice.markers:
            beside = markers(choice.results, said.append)
            while_shown(phrase("Starting the markers …"), lambda: stack.enter_context(beside), halts.set)
        chosen = replace(choice, seed=request.seed)
        went_wrong = WITHOUT_MARKERS if said else _carried_out(chosen, study, had, halts=halts.is_set())
    return "\n".join(filter(None, (*said, went_wrong)))


WITHOUT_MARKERS = phrase("The run was not begun: mend that, or untick “{sends_markers}”.", sends_markers=SENDS_MARKERS)


def _carried_out(choice: RunRequest, study: StudyFolder, had: set[Path], *, halts: bool) -> str:
    own = set[Path]() if choice.training else {participant_folder(choice.results, choice.participant_id)}
    try:
        run_live(gone_on_with(choice), last=_what_is_next(study, choice), halts=halts)
        had |= own
    except RunStopped as stop:
        had |= own
        return _stopped(choice, str(stop), halted=stop.halted)
    except NotAsItBegan as other:
        return phrase("{refusal}, or press Start and choose “{set_aside}”.", refusal=other.refusal, set_aside=SET_ASIDE)
    except UnfinishedRun as left:
        return phrase("{stopped} Start asks whether to go on there or to start anew.", stopped=unfinished_text(left))
    except RecoilError as error:
        return str(error)
    return ""


def _stopped(choice: RunRequest, reason: str, *, halted: bool) -> str:
    if choice.training:
        return phrase("The training stopped: {reason}.", reason=reason)
    if not halted:
        return _stopped_at(choice, reason)
    owed = phrase("Whatever they do next begins with a test shot, and so does the next run on that gun.")
    if choice.gun == SIMULATED:  # what one person stopped on it is nobody else's
        owed = phrase("Whatever they do next begins with a test shot.")
    return f"{_stopped_at(choice, reason)} {owed}"


def _stopped_at(choice: RunRequest, reason: str) -> str:
    if choice.practice:
        return phrase(
            "The practice of {participant_id} stopped: {reason}. It can be done again.",
            participant_id=choice.participant_id,
            reason=reason,
        )
    return phrase(
        "{participant_id} stopped: {reason}. Start asks whether to go on there or to start anew.",
        participant_id=choice.participant_id,
        reason=reason,
    )


def study_of(request: RunRequest) -> StudyFolder:
    """The study that the config lies in, if the study names it; else this experiment alone, by the rules of that study.

    Where there is no study beside the config, they are those of the shipped one.
    """
    own = request.setup.source.parent / "study.toml"
    config, folder = load_study(str(own) if own.is_file() else "study")
    setups: tuple[Setup[DesignConfig], ...] = (request.setup,)
    if request.setup.source.resolve() in [(folder / name).resolve() for name in config.experiments]:
        setups = tuple(load_setup(folder / name) for name in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=request.results)
