"""`recoil doctor`: the rig's self-test as a table for people and as JSON, kept beside the data if asked for."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.clock import RealClock
from experiments.doctor.checks import carry_out, checks
from experiments.doctor.figures import Finding
from experiments.doctor.verdicts import overall
from experiments.load import find, load_gun
from experiments.record import storage

_WIDTH = 160
"""Columns of the table where it does not go to a terminal."""


Progress = Callable[[str, int], AbstractContextManager[Callable[[str], None]]]
"""Given what is done and in how many parts, takes the name of each part that is done."""


def examine(results: Path, gun: str, config: str, progress: Progress) -> list[Finding]:
    """What every check found; `config` is the gun's, with the limit of its line.

    `PlaceError`: the gun's address has no such form; `ConfigError`: the config cannot be used.
    """
    findings, planned = list[Finding](), checks(results, gun, load_gun(find(config)).serial.round_trip_limit_s)
    with progress("doctor", len(planned)) as tell:
        for check in planned:
            findings += carry_out(check)
            tell(check.name)
    return findings


def fails(findings: list[Finding]) -> bool:
    """Whether a check fails."""
    return _verdict(findings) == "fails"


def as_json(findings: list[Finding]) -> dict[str, Any]:
    """The findings as plain JSON values, with when they were found and the worst verdict."""
    return {"utc": RealClock().utc(), "verdict": _verdict(findings), "checks": [asdict(one) for one in findings]}


def _verdict(findings: list[Finding]) -> str:
    return overall([finding.verdict for finding in findings])


def keep(found: dict[str, Any], path: Path) -> None:
    """Put the machine-readable result into a file, in place of an older one."""
    storage.make_folder(path.parent)
    storage.write_whole(path, (json.dumps(found, indent=1, ensure_ascii=False) + "\n").encode())


def as_text(findings: list[Finding]) -> str:
    """The findings as a table for people."""
    text = io.StringIO()
    console = Console(file=text, width=shutil.get_terminal_size((_WIDTH, 24)).columns, highlight=False, markup=False)
    console.print(_table(findings))
    return text.getvalue().rstrip("\n")


def _table(findings: list[Finding]) -> Table:
    table = Table(show_lines=True)
    table.add_column("check", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for heading in ("measured", "what to do"):
        table.add_column(heading, overflow="fold")
    for finding in findings:
        cells = (finding.check, finding.verdict, finding.measured, finding.advice)
        table.add_row(*map(Text, cells))  # as text: a name in brackets is no mark-up
    return table
