"""What all commands share: exit codes, common options, and how they speak to people and to programs."""

from __future__ import annotations

import io
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from analysis.report.labels import text_columns
from analysis.report.section import Section, Table
from analysis.report.serial import as_json as in_json
from analysis.report.streams import results, takes_all, visible
from device.messages import RecoilError
from experiments.record import storage

if TYPE_CHECKING:
    from rich.table import Table as RichTable

DONE, EXCEPTIONS, UNUSABLE, INTERRUPTED = 0, 1, 2, 130

WIDTH = 160
"""Columns of a table where it does not go to a terminal."""

AsJsonOption = Annotated[bool, typer.Option("--json", help="Print the machine-readable result.")]
SeedOption = Annotated[int | None, typer.Option(min=0, max=2**63 - 1, help="Seed of the random streams.")]
FixedSeedOption = Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random streams.")]
GunConfigOption = Annotated[str, typer.Option(help="Config of a gun, or the name of a shipped one.")]
ColumnsOption = Annotated[
    Path | None, typer.Option(metavar="MAP.toml", help="Which columns mean what in logs that Recoil did not write.")
]
IncludeSyntheticOption = Annotated[
    bool, typer.Option("--include-synthetic", help="Synthetic data beside real ones too; the two are kept apart.")
]
RulesOption = Annotated[
    Path | None, typer.Option(metavar="RULES.toml", help="Which trials and participants to leave out.")
]
RequestsOption = Annotated[
    Path | None, typer.Option(metavar="REQUESTS.toml", help="Further tests and models, such as planned contrasts.")
]
WorkersOption = Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores unless given.")]


_Name = TypeVar("_Name")
_Found = TypeVar("_Found")

Tell = Callable[[str], None]
"""Is told of each part that is done."""
Progress = Callable[[str, int], AbstractContextManager[Tell]]
"""From what is done and of how many parts: a bar, told of each part."""


def say(text: str) -> None:
    """A line on stderr."""
    sys.stderr.write(f"{visible(text)}\n")


_LONG_S = 10.0


def takes_about(seconds: float) -> str:
    """Of what takes over ten seconds on a usual machine, about how long that is; empty for less."""
    about = f"{seconds / 60:.0f} minutes" if seconds > 100 else f"{10 * round(seconds / 10)} s"
    return f"this takes about {about}" if seconds > _LONG_S else ""


def say_how_long(seconds: float) -> None:
    """Say it beforehand."""
    if words := takes_about(seconds):
        say(f"recoil: {words}")


def in_text(section: Section) -> str:
    """A section's words for a terminal: its title, then what it says, set in."""
    return "\n".join([section.title, *(f"  {line}" for line in (*section.paragraphs, *section.items))])


def with_tables(section: Section, *, ruled: bool = False, unfolded: int = 0) -> str:
    """A section as it stands on a terminal, as wide as that: its title, its tables, then what it says, line by line.

    `ruled`: a line between rows; so many columns from the left are `unfolded`. Nothing in it is taken for mark-up. A
    table that would have to break words is told row by row, a line a cell.
    """
    from rich.console import Console

    text = io.StringIO()
    width = shutil.get_terminal_size((WIDTH, 24)).columns
    console = Console(file=text, width=width, highlight=False, markup=False, emoji=False)
    for table in section.tables:
        if not table.rows or _least_width(table) <= console.width:
            console.print(_drawn(table, ruled=ruled, unfolded=unfolded))
        else:
            text.write("\n".join(_row_by_row(table, console.width)) + "\n")
    lines = [text.getvalue().rstrip("\n"), *section.paragraphs, *section.items]
    return "\n".join([section.title, *lines] if section.title else lines)


_LONG_WORD = 24
"""A word that is longer, as a path may be, is broken."""


def _least_width(table: Table) -> int:
    """How wide a table is at least, in which no word is broken."""
    columns = zip(table.header, *table.rows, strict=True)
    words = ([word for cell in column for word in cell.split()] for column in columns)
    return 1 + sum(3 + min(max(map(text_columns, some), default=0), _LONG_WORD) for some in words)


def _row_by_row(table: Table, width: int) -> Iterator[str]:
    """The rows below each other: the first cell, then the others that hold something, under their headings."""
    for first, *others in table.rows:
        yield first
        for heading, cell in zip(table.header[1:], others, strict=True):
            for place, line in enumerate(cell.splitlines()):
                began = f"  {heading}: " if place == 0 else "    "
                yield from textwrap.wrap(line, width, initial_indent=began, subsequent_indent="    ")


def _drawn(table: Table, *, ruled: bool, unfolded: int) -> RichTable:
    from rich.table import Table as RichTable
    from rich.text import Text

    drawn = RichTable(show_lines=ruled)
    for place, heading in enumerate(table.header):
        drawn.add_column(heading, overflow="fold", no_wrap=place < unfolded)
    for row in table.rows:
        drawn.add_row(*map(Text, row))
    return drawn


def show(result: Any, text: str, as_json: bool) -> None:
    """The result on stdout, at once: for programs, or the text for people."""
    out = results()
    with storage.errors_name("the output"):
        out.write(in_json(result, in_ascii=not takes_all(out)).decode() if as_json else f"{visible(text)}\n")
        out.flush()


def each_of(names: Sequence[_Name], do: Callable[[_Name], _Found]) -> tuple[list[_Found], int]:
    """What came of each, and how many were refused: that is said, and the others are done all the same.

    `RecoilError` if nothing came of any.
    """
    found: list[_Found] = []
    refused: list[RecoilError] = []
    for name in names:
        try:
            found.append(do(name))
        except RecoilError as error:
            refused.append(error)
    if not found:
        raise RecoilError("\n".join(map(str, refused)))
    for refusal in refused:
        say(f"recoil: {refusal}")
    return found, len(refused)


def end(*, exceptions: bool) -> typer.Exit:
    """The end of a command that did all, or all but what it listed."""
    return typer.Exit(EXCEPTIONS if exceptions else DONE)


def tracked(files: Sequence[str]) -> Iterable[str]:
    """The files' paths one by one, with a progress bar on stderr."""
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


def untold(part: str) -> None:
    """Nobody waits."""


@contextmanager
def unseen(what: str, total: int) -> Iterator[Callable[[str], None]]:  # noqa: ARG001 - as `progress`
    """No bar at all."""
    yield untold
