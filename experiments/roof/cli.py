"""The command line. Each command imports what it needs when it is called, so that `recoil --help` answers at once."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

DONE, EXCEPTIONS, UNUSABLE, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    name="recoil",
    help="Psychophysics experiments on haptic guns: plan, run, log, analyse, report.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    add_completion=False,
)

AsJson = Annotated[bool, typer.Option("--json", help="Print the machine-readable result.")]
Seed = Annotated[int | None, typer.Option(min=0, max=2**63 - 1, help="Seed of the random streams.")]


class ScreenName(StrEnum):
    """Where a run takes place."""

    terminal = "terminal"
    synthetic = "synthetic"
    console = "console"


def main() -> None:
    """Run a command. Whatever goes wrong is one message on stderr and an exit code, never a traceback."""
    os.umask(0o077)  # what is written here is about people: for its owner alone
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):  # not every system knows all three
            signal.signal(getattr(signal, name), _interrupt)
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except OSError as error:
        _say(f"recoil: {error.filename or 'system'}: {error.strerror or error}")
        sys.exit(UNUSABLE)
    except Exception as error:
        if not isinstance(error, _expected()):
            raise
        _say("\n".join(f"recoil: {line}" for line in str(error).splitlines()))
        sys.exit(UNUSABLE)


def _expected() -> tuple[type[Exception], ...]:
    """The errors that have a message for people. Looked up only when something was raised."""
    from device import DeviceError
    from experiments.journal import JournalError
    from experiments.load import ConfigError
    from experiments.places import PlaceError

    return ConfigError, PlaceError, JournalError, DeviceError


def _interrupt(number: int, _: object) -> None:
    """Say so here, since the command line's library catches the exception on its way, and ends with 130."""
    _say("\nrecoil: interrupted; what was acknowledged is on the disk")
    raise KeyboardInterrupt(signal.Signals(number).name)


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")


def _show(result: Any, text: str, as_json: bool) -> None:
    sys.stdout.write(json.dumps(result, indent=1, ensure_ascii=False) + "\n" if as_json else f"{text}\n")


@app.command()
def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for logs, statistics, figures and report.")] = Path(
        "results/reproduction"
    ),
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the study.")] = 1,
    study: Annotated[str, typer.Option(help="Config of a study, or the name of a shipped one.")] = "study",
    as_json: AsJson = False,
) -> None:
    """Both experiments with synthetic participants on the simulated gun: logs, statistics, figures, report."""
    from experiments.roof import reproduce as roof

    loaded = roof.load(study, seed)
    with _progress("reproduce", len(loaded.runs) + 3) as tell:
        statistics = roof.reproduce(loaded, out, tell)
    _show(statistics, f"Report: {out / 'report.html'}", as_json)


@app.command()
def check(
    configs: Annotated[list[str], typer.Argument(metavar="CONFIG...", help="Files or names of shipped configs.")],
    seed: Seed = None,
    participants: Annotated[int, typer.Option(min=1, max=999, help="Show the orders of so many.")] = 14,
    as_json: AsJson = False,
) -> None:
    """Validate configs; print design, orders, duration, drive and limits. Nothing is run."""
    from experiments.roof import check as roof

    found = [roof.check(name, seed, participants) for name in configs]
    _show(found if len(found) > 1 else found[0], "\n\n".join(map(roof.as_text, found)), as_json)


@app.command()
def run(
    config: Annotated[str, typer.Argument(help="File or name of a shipped config.")],
    participant: Annotated[
        str | None, typer.Option(help="Participant's code, 1 to 32 letters and digits; without: the start window.")
    ] = None,
    gun: Annotated[str, typer.Option(help="`simulated` or `serial:PORT`.")] = "simulated",
    screen: Annotated[ScreenName, typer.Option(help="Where the run takes place.")] = ScreenName.terminal,
    results: Annotated[Path, typer.Option(help="Folder for the logs.")] = Path("results"),
    seed: Seed = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an unfinished run.")] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Set an unfinished run aside and start anew.")] = False,
    visual: Annotated[bool, typer.Option("--visual", help="A synthetic participant works the console.")] = False,
    participant_screen: Annotated[
        bool, typer.Option("--participant-screen", help="The participant rates on a screen of their own (PsychoPy).")
    ] = False,
    participant_keys: Annotated[
        bool, typer.Option("--participant-keys", help="The participant answers with keys of their own (PsychoPy).")
    ] = False,
    noise: Annotated[
        bool, typer.Option("--noise", help="Masking white noise through the participant's headphones (PsychoPy).")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """One run: a participant doing one experiment."""
    from experiments.roof import session

    if participant is None:
        if screen is not ScreenName.console:
            raise typer.BadParameter("give --participant CODE, or --screen console for its start window")
        session.run_lab_day(config, results, gun, seed)
        return
    finished = session.run_session(
        session.Asked(
            config=config,
            participant_id=participant,
            gun=gun,
            screen=screen.value,
            results=results,
            seed=seed,
            resume=resume,
            fresh=fresh,
            visual=visual,
            participant_screen=participant_screen,
            participant_keys=participant_keys,
            noise=noise,
        )
    )
    _show({"journal": str(finished.journal), "table": str(finished.table)}, f"Done: {finished.table}", as_json)


@app.command()
def study(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A study's folder, or a results folder.")],
    join: Annotated[str | None, typer.Option(metavar="CODE", help="Take someone in, or correct their facts.")] = None,
    age: Annotated[int | None, typer.Option(min=1, max=120, help="With --join: age in years.")] = None,
    sex: Annotated[str | None, typer.Option(help="With --join: female, male, other or undisclosed.")] = None,
    handedness: Annotated[str | None, typer.Option(help="With --join: right, left or both.")] = None,
    exclude: Annotated[str | None, typer.Option(metavar="CODE", help="Exclude a participant; needs --reason.")] = None,
    readmit: Annotated[str | None, typer.Option(metavar="CODE", help="Take an exclusion back; needs --reason.")] = None,
    reason: Annotated[str | None, typer.Option(help="Why; never a name.")] = None,
    as_json: AsJson = False,
) -> None:
    """The participants of a study: done, in progress, excluded, and who comes next in which orders."""
    from experiments.roof import study as roof

    facts = {"age_years": age, "sex": sex, "handedness": handedness}
    asked = {"join": join, "exclude": exclude, "readmit": readmit}
    found, notes = roof.study(folder, roof.change(asked, facts, reason))
    for message in (*notes, *found.overview.problems):
        _say(f"recoil: {message}")
    _show(roof.as_json(found), roof.as_text(found), as_json)
    raise typer.Exit(EXCEPTIONS if found.overview.problems else DONE)


@app.command()
def rebuild(journals: Annotated[list[Path], typer.Argument(metavar="JOURNAL...")], as_json: AsJson = False) -> None:
    """Make the CSV again from its journal, byte for byte."""
    from experiments.roof.session import rebuild_tables

    built = rebuild_tables(journals)
    for message in (message for one in built for message in one.messages):
        _say(f"recoil: {message}")
    shown = [{"table": str(one.table), "rebuilt": one.rebuilt} for one in built]
    text = "\n".join(f"{one.table}: {'rebuilt' if one.rebuilt else 'is as its journal says'}" for one in built)
    _show(shown, text, as_json)
    raise typer.Exit(EXCEPTIONS if any(one.messages for one in built) else DONE)


@app.command()
def analyze(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Logs, or folders with logs.")],
    out: Annotated[Path, typer.Option(help="Folder for statistics, figures and report.")],
    paper: Annotated[Path | None, typer.Option(help="Published numbers to compare with.")] = None,
    as_json: AsJson = False,
) -> None:
    """Statistics, figures and report of any number of logs."""
    from experiments.roof.analyze import analyze as roof

    statistics, problems = roof(paths, out, paper, _tracked)
    for problem in problems:
        _say(f"recoil: left out: {problem}")
    _show(statistics, f"Report: {out / 'report.html'}", as_json)
    raise typer.Exit(EXCEPTIONS if problems or statistics["excluded"] else DONE)


@app.command()
def simulate(
    method: Annotated[str | None, typer.Option(help="Rendering method of the gun.")] = None,
    gun: Annotated[str, typer.Option(help="Config of a gun, or the name of a shipped one.")] = "gun",
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a parameter.")] = None,
    fidelity: Annotated[str, typer.Option(help="Model to use.")] = "full",
    trace: Annotated[Path | None, typer.Option(help="Write the shot over time as CSV.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write Figure 5's panels as PNG and SVG.")] = None,
    as_json: AsJson = False,
) -> None:
    """One shot by the model: summary, trace, figure."""
    from experiments.load import find
    from experiments.roof import shot

    parameters = shot.parameters_of(find(gun), method, changes or [])
    found = shot.summary_of(parameters, fidelity)
    if trace:
        shot.write_trace(parameters, trace)
    if plot:
        shot.write_plot(parameters, plot)
    _show(found, shot.as_text(found), as_json)


@app.command()
def configs(
    copy: Annotated[Path | None, typer.Option(help="Copy the shipped configs into this folder.")] = None,
) -> None:
    """List the shipped configs, or copy them to edit."""
    from experiments.load import shipped_folder
    from experiments.roof.folders import copy_configs

    paths = copy_configs(copy) if copy else sorted(shipped_folder().glob("*.toml"))
    sys.stdout.write("".join(f"{path}\n" for path in paths))


@app.command()
def new(study: Annotated[Path, typer.Argument(metavar="STUDY", help="The folder to make.")]) -> None:
    """Make a study's folder from a template."""
    from experiments.roof.folders import new_study

    sys.stdout.write("".join(f"{path}\n" for path in new_study(study)))


@app.command()
def doctor(
    results: Annotated[Path, typer.Option(help="Folder for the logs, and its console runs.")] = Path("results"),
    gun: Annotated[str, typer.Option(help="`simulated` or `serial:PORT`. It is not fired.")] = "simulated",
    out: Annotated[Path | None, typer.Option(metavar="FILE.json", help="Keep the result.")] = None,
    as_json: AsJson = False,
) -> None:
    """The rig's self-test: what was measured, and what to do about what is not good."""
    from experiments.roof import doctor as roof

    findings = roof.examine(results, gun, _progress)
    found = roof.as_json(findings)
    _show(found, roof.as_text(findings), as_json)
    if out:
        roof.keep(found, out)
    raise typer.Exit(EXCEPTIONS if roof.fails(findings) else DONE)


def _tracked(files: Sequence[Path]) -> Iterable[Path]:
    """The files one by one, with a progress bar on stderr."""
    from rich.console import Console
    from rich.progress import track

    return track(files, description="read logs", console=Console(stderr=True), disable=not files)


@contextmanager
def _progress(what: str, total: int) -> Iterator[Callable[[str], None]]:
    """A progress bar on stderr; one line at the end where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=False) as progress:
        task = progress.add_task(what, total=total)
        yield lambda done: progress.update(task, advance=1, description=f"{what}: {done}")
