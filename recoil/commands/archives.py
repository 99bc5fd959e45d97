"""Commands around what is published: a BIDS data set, an archive, and whether one is whole."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import (
    AsJsonOption,
    ColumnsOption,
    IncludeSyntheticOption,
    RequestsOption,
    RulesOption,
    end,
    progress,
    say,
    show,
    tracked,
)
from device.messages import few_of_each

FreeTextOption = Annotated[
    bool, typer.Option("--free-text", help="With comments and notes; they might say who someone is.")
]


def bids(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder that holds the logs.")],
    out: Annotated[
        Path | None, typer.Option(metavar="BIDS", help="Folder for the data set; DIR/bids unless given.")
    ] = None,
    free_text: FreeTextOption = False,
    columns: ColumnsOption = None,
    include_synthetic: IncludeSyntheticOption = False,
    as_json: AsJsonOption = False,
) -> None:
    """The logs as a BIDS data set of behavioural runs; an earlier export is replaced."""
    from analysis.archive.bids_export import export as feature

    done = feature(
        folder,
        out or folder / "bids",
        free_text=free_text,
        columns=columns,
        include_synthetic=include_synthetic,
        track=tracked,
    )
    for line in few_of_each(f"left out: {problem}" for problem in done.left_out):
        say(f"recoil: {line}")
    for remark in (*done.remarks, *done.begun):
        say(f"recoil: {remark}")
    counts = f"participants: {done.participants}, runs: {sum(done.runs.values())}, files: {done.files}"
    show(done, f"BIDS data set: {done.out} ({counts})", as_json)
    raise end(exceptions=bool(done.left_out or done.remarks or done.begun))


def archive(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="The study's folder, or its results.")],
    out: Annotated[
        Path | None, typer.Option(metavar="ARCHIVE", help="Folder for the archive; STUDY-archive unless given.")
    ] = None,
    rules: RulesOption = None,
    requests: RequestsOption = None,
    free_text: FreeTextOption = False,
    include_synthetic: IncludeSyntheticOption = False,
    as_json: AsJsonOption = False,
) -> None:
    """One folder to publish: redacted journals, and tables, statistics, figures, report and BIDS made from them."""
    from analysis.archive import archive_export as feature

    asked = feature.ArchiveRequest(
        folder=study,
        out=out,
        free_text=free_text,
        include_synthetic=include_synthetic,
        rules=rules,
        requests=requests,
    )
    done = feature.export_archive(asked, tracked, progress)
    for line in few_of_each(f"left out: {problem}" for problem in done.left_out):
        say(f"recoil: {line}")
    for remark in done.remarks:
        say(f"recoil: {remark}")
    counts = f"participants: {done.participants}, runs: {done.runs}, files: {done.files}"
    text = f"Archive: {done.out} ({counts})\nsha256 of its manifest: {done.manifest_sha256}"
    show(done, text, as_json)
    raise end(exceptions=bool(done.left_out or done.remarks))


def verify(
    folder: Annotated[Path, typer.Argument(metavar="ARCHIVE", help="A folder that `recoil export archive` wrote.")],
    as_json: AsJsonOption = False,
) -> None:
    """Is an archive whole, and do its journals make its tables and statistics? Exit code 1 if not, each part named."""
    from analysis.archive import verify as feature

    found = feature.verify(folder, tracked)
    for fault in (*found.faults, *found.remarks):
        say(f"recoil: {fault}")
    show(found, found.as_text(), as_json)
    raise end(exceptions=not found.whole)
