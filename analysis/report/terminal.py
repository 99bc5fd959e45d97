"""What all commands share: exit codes, common options, and how they speak to people and to programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from analysis.report.section import Section
from analysis.report.serial import as_json as in_json

DONE, EXCEPTIONS, UNUSABLE, INTERRUPTED = 0, 1, 2, 130

AsJson = Annotated[bool, typer.Option("--json", help="Print the machine-readable result.")]
Seed = Annotated[int | None, typer.Option(min=0, max=2**63 - 1, help="Seed of the random streams.")]
FixedSeed = Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random streams.")]
GunConfig = Annotated[str, typer.Option(help="Config of a gun, or the name of a shipped one.")]
Config = Annotated[str, typer.Argument(help="File or name of a shipped config.")]


Progress = Callable[[str, int], AbstractContextManager[Callable[[str], None]]]
"""From what is done and of how many parts: a bar, told of each part."""


def say(text: str) -> None:
    """A line on stderr."""
    sys.stderr.write(f"{text}\n")


def in_text(section: Section) -> str:
    """A section's words for a terminal: its title, then what it says, set in."""
    return "\n".join([section.title, *(f"  {line}" for line in (*section.paragraphs, *section.items))])


def show(result: Any, text: str, as_json: bool) -> None:
    """The result on stdout: for programs, or the text for people."""
    sys.stdout.write(in_json(result).decode() if as_json else f"{text}\n")


def end(*, exceptions: bool) -> typer.Exit:
    """The end of a command that did all, or all but what it listed."""
    return typer.Exit(EXCEPTIONS if exceptions else DONE)


def tracked(files: Sequence[Path]) -> Iterable[Path]:
    """The files one by one, with a progress bar on stderr."""
    from rich.console import Console
    from rich.progress import track

    return track(files, description="read logs", console=Console(stderr=True), disable=not files)


@contextmanager
def progress(what: str, total: int) -> Iterator[Callable[[str], None]]:
    """A progress bar on stderr; one line at the end where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=False) as shown:
        task = shown.add_task(what, total=total)
        yield lambda done: shown.update(task, advance=1, description=f"{what}: {done}")
