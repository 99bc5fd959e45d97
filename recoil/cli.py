"""The command line: which commands there are, and what becomes of whatever goes wrong in them."""

from __future__ import annotations

import gc
import math
import os
import re
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from typing import Annotated

import typer

import recoil
from analysis.report.streams import drop_unreadable, forgive_streams, keep_results_apart
from analysis.report.terminal import INTERRUPTED, UNUSABLE, say
from device.interrupts import INTERRUPTS
from device.machine_clock import machine_s
from device.messages import RecoilError, few_of_each
from recoil.commands import archives, guns, numbers, predictions, sessions

app = typer.Typer(
    name="recoil",
    help="Psychophysics experiments on haptic guns: plan, run, log, analyse, report.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    add_completion=False,
)
export_commands = typer.Typer(help="Data sets for other programs.", rich_markup_mode=None, no_args_is_help=True)

COMMANDS = (
    numbers.reproduce,
    sessions.check,
    sessions.run,
    sessions.study,
    sessions.watch,
    sessions.markers,
    sessions.freeze,
    sessions.rebuild,
    numbers.analyze,
    numbers.audit,
    numbers.grim,
    archives.verify,
    predictions.power,
    predictions.design,
    guns.simulate,
    sessions.configs,
    sessions.new,
    guns.twin,
    guns.doctor,
    guns.bench,
)


def _say_version(asked: bool) -> None:
    if asked:
        typer.echo(recoil.__version__)
        raise typer.Exit


@app.callback()
def _about(
    version: Annotated[
        bool, typer.Option("--version", help="Say which version this is.", callback=_say_version, is_eager=True)
    ] = False,
) -> None:
    """Psychophysics experiments on haptic guns: plan, run, log, analyse, report."""


for command in COMMANDS:
    app.command()(command)
export_commands.command()(archives.bids)
export_commands.command()(archives.archive)
for commands in (app, export_commands, predictions.app):
    for one in commands.registered_commands:  # a summary that is given is wrapped; left to the library, it is cut
        one.short_help = ((one.callback and one.callback.__doc__) or "").partition("\n\n")[0]
app.add_typer(export_commands, name="export")
app.add_typer(predictions.app, name="fit", short_help="Fit a model to a paper's rates, to times or to answers.")


_OF_LIBRARIES = {
    "PYDANTIC_DISABLE_PLUGINS": "__all__",  # else it asks every installed package whether it is one
    "OPENBLAS_NUM_THREADS": "1",  # arrays are small here: threads for them wait for work, which costs time
}
"""Read by libraries from the environment when they are imported; what is set there already stays."""


def main() -> None:
    """Run a command. Whatever goes wrong is one message on stderr and an exit code, never a traceback."""
    gc.set_threshold(1_000_000, 20, 50)  # a report's imports make 350,000 objects and drop none: not looked through
    forgive_streams()
    if "--json" in sys.argv[1:]:
        keep_results_apart()
    for name, value in _OF_LIBRARIES.items():
        os.environ.setdefault(name, value)
    os.umask(0o077)  # what is written here is about people: for its owner alone
    for number in INTERRUPTS:
        signal.signal(number, _interrupt)
    sys.unraisablehook = _interrupt_again
    try:
        _carry_out(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except OSError as error:
        say(f"recoil: {error.filename or 'system'}: {error.strerror or error}")
        sys.exit(UNUSABLE)
    except RecoilError as error:
        say("\n".join(f"recoil: {line}" for line in few_of_each(str(error).splitlines())))
        sys.exit(UNUSABLE)
    finally:
        _leave_signals()
        if _INTERRUPTED_BY:
            drop_unreadable()
        gc.freeze()  # what is left goes with the process; looking through it at the end took a sixth of `check`


def _carry_out(words: Sequence[str]) -> None:
    _refuse_empty(words)
    try:
        _line_of(words)()
    except (OSError, RecoilError):
        raise
    except Exception as error:
        if _INTERRUPTED_BY:  # which a library made an error of its own of
            raise KeyboardInterrupt from error
        raise


def _refuse_empty(words: Sequence[str]) -> None:
    """`RecoilError` for a word that is empty: as a path it would be the folder where one is."""
    for before, word in zip(["recoil", *words], words, strict=False):
        if not word or re.fullmatch("--[a-z-]+=", word):
            where = word or f"what stands after {before}"
            raise RecoilError(f"{where}: is empty; give a value (is a variable of the shell not set?), or leave it out")


def _line_of(words: Sequence[str]) -> typer.Typer:
    """The command line that some words need: where they begin with a command, that alone.

    The library makes the options of each command ready that it is given.
    """
    asked = [one for one in app.registered_commands if one.callback and [one.callback.__name__] == words[:1]]
    if not asked:
        return app
    line = copy(app)
    line.registered_commands, line.registered_groups = asked, []
    return line


def _leave_signals() -> None:
    """The rest is Python's own end, which an interrupt may cut short without a word."""
    for number in INTERRUPTS:
        signal.signal(number, signal.SIG_DFL)


_INTERRUPTED_BY: list[int] = []
"""The signals that came, in their order."""

_AGAIN_S = 0.05
_AT_ONCE_S = 0.1
"""What comes so soon after an interrupt is the same one, such as the SIGTERM of a program that sent SIGINT before."""
_RAISED_S = [-math.inf]


def _interrupt(number: int, _: object) -> None:
    """Say so here, since the command line's library catches the exception on its way, and ends with 130.

    What comes at once after it cuts short no clearing up.
    """
    now_s = machine_s()
    if now_s - _RAISED_S[0] < _AT_ONCE_S:
        return
    _RAISED_S[0] = now_s
    if not _INTERRUPTED_BY:
        acknowledged = "; what was acknowledged is on the disk" if sys.argv[1:2] == ["run"] else ""
        with suppress(OSError):  # the terminal is gone: nobody reads it, and what was begun is to end in order
            say(f"\nrecoil: interrupted{acknowledged}")
    _INTERRUPTED_BY.append(number)
    raise KeyboardInterrupt(signal.Signals(number).name)


def _interrupt_again(ignored: sys.UnraisableHookArgs) -> None:
    """Let an interrupt come once more that came where Python ignores errors, as while an object is let go of."""
    if not isinstance(ignored.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(ignored)
        return
    _RAISED_S[0] = -math.inf
    again = threading.Timer(_AGAIN_S, interrupt_main, _INTERRUPTED_BY[-1:])
    again.daemon = True
    again.start()
