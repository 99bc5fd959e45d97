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

from experiments.roof import audit_command, power_command

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


class ObserverName(StrEnum):
    """Who answers in a reproduction."""

    reconstructed = "reconstructed"
    rates = "rates"


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
    observer: Annotated[
        ObserverName | None,
        typer.Option(help="Who answers: rebuilt from the published numbers where they fit, or drawn by the configs."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Both experiments with synthetic participants on the simulated gun: logs, statistics, figures, report."""
    from experiments.roof import reproduce as roof

    loaded = roof.load(study, seed, observer.value if observer else None)
    with _progress("reproduce", len(loaded.runs) + 3) as tell:
        done = roof.reproduce(loaded, out, tell)
    _show(done.statistics, f"{roof.as_text(done.comparison)}\n\nReport: {out / 'report.html'}", as_json)


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


export = typer.Typer(help="Data sets for other programs.", rich_markup_mode=None, no_args_is_help=True)
app.add_typer(export, name="export")


@export.command()
def bids(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder that holds the logs.")],
    out: Annotated[
        Path | None, typer.Option(metavar="BIDS", help="Folder for the data set; DIR/bids unless given.")
    ] = None,
    free_text: Annotated[
        bool, typer.Option("--free-text", help="With comments and notes; they might say who someone is.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """The logs as a BIDS data set of behavioural runs; an earlier export is replaced."""
    from experiments.roof.bids import export as roof

    done = roof(folder, out or folder / "bids", free_text=free_text, track=_tracked)
    for problem in done.problems:
        _say(f"recoil: left out: {problem}")
    _show(done.as_json(), done.as_text(), as_json)
    raise typer.Exit(EXCEPTIONS if done.problems else DONE)


@app.command()
def analyze(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Logs, or folders with logs.")],
    out: Annotated[Path, typer.Option(help="Folder for statistics, figures and report.")],
    columns: Annotated[
        Path | None, typer.Option(metavar="MAP.toml", help="Which columns mean what in logs that Recoil did not write.")
    ] = None,
    rules: Annotated[
        Path | None, typer.Option(metavar="RULES.toml", help="Which trials and participants to leave out.")
    ] = None,
    paper: Annotated[Path | None, typer.Option(help="Published numbers to compare with.")] = None,
    codebook: Annotated[Path | None, typer.Option(metavar="CODES.toml", help="Codes of free descriptions.")] = None,
    as_json: AsJson = False,
) -> None:
    """Statistics, tables, figures and report of any number of logs."""
    from experiments.roof import analyze as roof

    asked = roof.Request(paths=paths, out=out, paper=paper, columns=columns, rules=rules, codebook=codebook)
    statistics, problems = roof.analyze(asked, _tracked)
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
    from experiments.roof.folders import copy_configs, shipped

    paths = copy_configs(copy) if copy else shipped()
    sys.stdout.write("".join(f"{path}\n" for path in paths))


@app.command()
def new(study: Annotated[Path, typer.Argument(metavar="STUDY", help="The folder to make.")]) -> None:
    """Make a study's folder from a template."""
    from experiments.roof.folders import new_study

    sys.stdout.write("".join(f"{path}\n" for path in new_study(study)))


@app.command()
def twin(
    gun: Annotated[str, typer.Option(help="Config of a gun, or the name of a shipped one.")] = "gun",
    link: Annotated[Path | None, typer.Option(help="A path that leads to its pseudo-terminal and stays.")] = None,
    tcp: Annotated[int | None, typer.Option(min=0, max=65535, help="A TCP port of this machine instead.")] = None,
    speed: Annotated[float, typer.Option(help="So many times faster than the world.")] = 1.0,
    drift_ppm: Annotated[float, typer.Option(min=-900, max=900, help="Error of its clock, in millionths.")] = 0.0,
    wire: Annotated[int | None, typer.Option(min=0, max=9999, help="Speak another version of the wire.")] = None,
    trouble: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="latency_s=0.005, lose=0.01, unplug=0.1, ...")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the troubles.")] = 1,
    as_json: AsJson = False,
) -> None:
    """The gun's twin on a pseudo-terminal, until interrupted: prints its port, to be given to --gun."""
    from experiments.roof import twin as roof

    asked = roof.Asked(
        gun=gun, link=link, tcp=tcp, speed=speed, drift_ppm=drift_ppm, wire=wire, troubles=trouble or [], seed=seed
    )

    def tell(found: dict[str, Any]) -> None:
        _show(found, f"{found['address']}\nTry: recoil doctor --gun {found['gun']}", as_json)
        sys.stdout.flush()

    roof.serve(asked, tell)


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


@app.command()
def bench(
    parts: Annotated[list[str] | None, typer.Argument(metavar="PART...", help="What to measure; else all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for bench.json and the report.")] = Path("results/bench"),
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the simulations.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Measure our own methods: error rates of the post-hoc tests."""
    from experiments.roof import bench as roof

    unknown = set(parts or []) - set(roof.PARTS)
    if unknown:
        raise typer.BadParameter(f"no part {', '.join(sorted(unknown))}; there are {', '.join(roof.PARTS)}")
    found = roof.bench(out, seed, parts or [], _progress)
    _show(found, f"Report: {out / 'report.html'}", as_json)


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


app.command("audit")(audit_command.command(_show, lambda wrong: typer.Exit(EXCEPTIONS if wrong else DONE)))
app.command("power")(power_command.command(_show, _progress))
