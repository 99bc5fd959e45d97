"""`recoil run`: which screen and clock a run gets, and what is said of it."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.report.terminal import say
from device.messages import few_of_each, said_by
from device.serial_gun.gun import speed_of
from experiments.catalogues.catalogue import ENGLISH, Language, check_allowed, language, languages
from experiments.clock import Clock, RealClock, VirtualClock
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.shown_texts import letters_of
from experiments.earlier_run import begun_language, check_resumable, language_begun_in, way_back_to_gun
from experiments.live_run import RunStopped, Screen
from experiments.load import language_key
from experiments.record.names import Place, journals
from experiments.run import Finished, run
from experiments.run_request import Again, ParticipantOptions, RunRequest, ScreenName
from experiments.screens.synthetic import synthetic_screen
from experiments.screens.terminal import TerminalScreen
from experiments.screens.texts import doubt_text
from experiments.study.balance import unread
from experiments.study.enrolment import code_doubt, code_prefix_of, not_on_record
from experiments.study.folders import check_code, known_codes, place
from experiments.study.preregistration import run_warnings
from experiments.study.register import read_register


@dataclass(frozen=True, slots=True, kw_only=True)
class LanguageOptions:
    """Which language was asked for, if any, where else there are catalogues, and whether one may be unchecked."""

    code: str | None = None
    folder: Path | None = None
    unchecked: bool = False

    def language(self, setup: Setup[DesignConfig]) -> Language:
        """That which was asked for, else that of a design. `ConfigError`: there is none, or nobody has checked it."""
        code, asked = (setup.config.language, language_key(setup)) if self.code is None else (self.code, "")
        found = language(code, self.folder, asked)
        check_allowed(found, asked, unchecked=self.unchecked)
        return found

    def usable(self, say: Callable[[str], None]) -> tuple[Language, ...]:
        """Every language that may be used; a catalogue that cannot be read is told, and hides no other."""
        found = list[Language]()
        for code in languages(self.folder):
            try:
                found.append(language(code, self.folder))
            except ConfigError as error:
                say(f"left out: {error}")
        return tuple(one for one in found if one.checked_by or self.unchecked)


def run_session(request: RunRequest, wanted: LanguageOptions = LanguageOptions()) -> Place:
    """Carry out a run. `ConfigError` and `PlaceError`: it cannot be done here; a stop raises `KeyboardInterrupt`."""
    check_code(request.participant_id)
    _check_screen(request)
    check_pace(request.screen, request.gun)
    if request.practice and request.again == "resume":
        raise ConfigError("--resume: a practice is begun anew each time; leave --resume or --practice out")
    if request.again == "resume":
        check_resumable(request)
    request = replace(request, language=_language(request, wanted), catalogues=wanted.folder)
    _check_terminal(request)
    _say_beforehand(request)
    try:
        with _markers(request.results, _say) if request.markers else nullcontext():
            return _SCREENS[request.screen](request).place
    except RunStopped as stop:
        _say(f"stopped: {stop}. {_how_to_go_on(request)}")
        raise KeyboardInterrupt from stop
    except KeyboardInterrupt:
        _say(_how_to_go_on(request))
        raise


def _how_to_go_on(request: RunRequest) -> str:
    """What to do about a run that was stopped."""
    if request.practice:
        return "A practice is begun anew each time: --practice."
    journal = place(request.results, request.participant_id, request.setup.config.experiment).journal
    if not journal.exists():
        return "Nothing of the run had begun."
    options = "".join(f" --{name.replace('_', '-')}" for name, has in request.options.named if has)
    options += f" --sensor {shlex.quote(request.sensor)}" if request.sensor else ""
    return f"Go on with --resume{options}{way_back_to_gun(journal, request.gun)}."


def _markers(results: Path, say: Callable[[str], None]) -> AbstractContextManager[None]:
    """Have what happens in a results folder sent to Lab Streaming Layer meanwhile. Never an error: it is said."""
    from experiments.watch.markers_process import markers_beside  # noqa: PLC0415 - most runs need none of it

    return markers_beside(results, say)


def _say(text: str) -> None:
    with suppress(OSError):  # where the terminal is gone, nobody reads it
        say(f"recoil: {text}")


def _say_beforehand(request: RunRequest) -> None:
    """Whose journals cannot be read, what is not as it was frozen, and what of the participant is not on record.

    All of it is no reason to send this participant home.
    """
    setup, results = request.setup, request.results
    there = journals(results, setup.config.experiment)
    for message in (
        *unread(setup, results, read_register(results)),
        *few_of_each(run_warnings(setup, results, there)),
        *_not_on_record(request),
    ):
        _say(message)


def _not_on_record(request: RunRequest) -> Iterator[str]:
    """The start window asks by itself, and nobody is asked about synthetic people."""
    code, results = request.participant_id, request.results
    if code and not request.simulated:
        if doubt := code_doubt(code, known_codes(results, read_register(results)), code_prefix_of(results)):
            go_on = "The run goes on all the same; if the code is wrong, stop and use the right one"
            yield f"participant {doubt_text(doubt)} {go_on}"
        yield from filter(None, [not_on_record(results, code)])


def _language(request: RunRequest, wanted: LanguageOptions) -> Language:
    """That which was asked for, else that which the run began in, else that of its design. `ConfigError`: not allowed.

    That nobody has checked it was accepted when the run began, if its journal says so.
    """
    began = language_begun_in(request) if request.again == "resume" else None
    if began is None or wanted.code not in (None, began.code):
        return wanted.language(request.setup)
    found = begun_language(replace(request, catalogues=wanted.folder), began)
    if began.checked_by:
        check_allowed(found, unchecked=wanted.unchecked)
    return found


def _check_terminal(request: RunRequest) -> None:
    """`ConfigError` if a terminal cannot write what is to be read out: it would put a question mark for each letter."""
    if request.screen != "terminal" or request.language is ENGLISH:
        return
    encoding = sys.stdout.encoding
    try:
        letters_of(request.language, request.setup).encode(encoding)
    except UnicodeEncodeError as error:
        raise ConfigError(
            f"--language {request.language.code}: this terminal writes {encoding}, which has no "
            f"{error.object[error.start]!r}; set it to UTF-8 (LANG=C.UTF-8), or use --screen console"
        ) from error


def _check_screen(request: RunRequest) -> None:
    if request.screen == "terminal" and not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise ConfigError(
            "--screen terminal: standard input and output are no terminal: start it without a pipe, or use --screen "
            "console, which has a window; --screen synthetic is answered by a synthetic participant"
        )
    if request.screen != "console" and (request.visual or request.options != ParticipantOptions()):
        raise ConfigError(
            "--visual, --participant-screen, --participant-keys, --participant-monitor and --noise go with "
            "--screen console"
        )


def check_pace(screen: str, gun: str) -> None:
    """`ConfigError`, if people were to answer on a clock that goes faster than they live: a twin's in a hurry."""
    if screen != "synthetic" and (_speed(gun) or 1.0) != 1.0:
        raise ConfigError(
            f"--gun {gun}: --screen {screen} is for people, who live no faster than the world; start `recoil twin` "
            "without --speed and leave out ?speed, or use --screen synthetic"
        )


def _at_terminal(request: RunRequest) -> Finished:
    def screen(setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> Screen:
        messages = request.language.messages
        return TerminalScreen(plan, clock, messages=messages, design=setup.config)

    return run(request, screen, RealClock())


def _synthetic(request: RunRequest) -> Finished:
    """On a virtual clock; with a gun on a line, whose shots take their time, on the real one."""
    speed = _speed(request.gun)
    return run(request, synthetic_screen, VirtualClock() if speed is None else RealClock(speed))


def _speed(gun: str) -> float | None:
    try:
        return speed_of(gun)
    except ValueError as error:
        raise ConfigError(f"--gun {gun}: {error}") from error


def _at_console(request: RunRequest) -> Finished:
    with _needs_gui():
        from experiments.screens.console import live  # noqa: PLC0415 - Qt is an extra, and slow
    return live.run_live(request)


_SCREENS: dict[ScreenName, Callable[[RunRequest], Finished]] = {
    "terminal": _at_terminal,
    "synthetic": _synthetic,
    "console": _at_console,
}


def run_lab_day(request: RunRequest, wanted: LanguageOptions = LanguageOptions()) -> None:
    """The start window at the console, and one run after the other from it; `request` is without a participant."""
    if request.screen != "console":
        code = "S01, or another code of a synthetic participant" if request.screen == "synthetic" else "CODE"
        raise ConfigError(f"who runs? Add --participant {code}; --screen console has a start window that asks")
    if request.again != "ask" or request.visual or request.practice:
        raise ConfigError(
            "--resume, --fresh, --practice and --visual go with --participant CODE; the start window asks by itself"
        )
    check_pace("console", request.gun)
    request = replace(request, language=wanted.language(request.setup), catalogues=wanted.folder)
    _say_beforehand(request)
    with _needs_gui():
        from experiments.screens.console import lab_day  # noqa: PLC0415 - Qt is an extra, and slow
    try:
        lab_day.lab_day(request, wanted.usable(_say), _markers)
    except KeyboardInterrupt as signalled:
        _say(f"ended by {signalled}")
        raise


@contextmanager
def _needs_gui() -> Iterator[None]:
    """`ConfigError`, with what to install, where the import of the console fails."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise _no_console(f"{error.name} is missing") from error
    except Exception as error:  # whatever a broken library raises, or one that lacks another of the system
        raise _no_console(f"they cannot be loaded: {said_by(error)}") from error


def _no_console(why: str) -> ConfigError:
    return ConfigError(
        f"--screen console needs the screens ({why}): run `make full` in Recoil's folder (without make: "
        "docs/install.md), or use --screen terminal; `recoil doctor` says what else is missing"
    )


def again(*, resume: bool, fresh: bool, reason: str) -> Again:
    """What to do with an unfinished run. `ConfigError` for options that do not go together."""
    if resume and fresh:
        raise ConfigError(
            "--resume and --fresh: give one of them; the first goes on with a run, the second starts anew"
        )
    if reason and not fresh:
        raise ConfigError("--reason: goes with --fresh, and says why the unfinished run is set aside")
    return "resume" if resume else "fresh" if fresh else "ask"
