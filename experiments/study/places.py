"""Where a participant's files lie, and what is there already. Codes can never lead out of the results folder."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.words import RecoilError
from experiments.config.models import CODE
from experiments.config.setup import Setup
from experiments.design import plan
from experiments.record import columns, journal
from experiments.record.journal import Head
from experiments.study import register
from experiments.study.register import Register

_CODE = re.compile(CODE)


class PlaceError(RecoilError):
    """A participant or folder that cannot be used; the message names value and rule."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """The files of one participant in one experiment."""

    results: Path
    participant_id: str
    experiment: str
    practice: bool = False

    @property
    def folder(self) -> Path:
        """The participant's folder."""
        return self.results / f"sub-{self.participant_id}"

    @property
    def stem(self) -> str:
        """How the names of the files begin."""
        practice = "_practice" if self.practice else ""
        return f"sub-{self.participant_id}_task-{self.experiment}{practice}"

    @property
    def journal(self) -> Path:
        """The journal: the truth."""
        return self.folder / f"{self.stem}_journal.jsonl"

    @property
    def table(self) -> Path:
        """The table made from it."""
        return self.folder / f"{self.stem}_{columns.FILE_SUFFIX[self.experiment]}.csv"


def is_code(text: str) -> bool:
    """Whether a text can be a participant's code."""
    return _CODE.fullmatch(text) is not None


def check_code(participant_id: str) -> None:
    """`PlaceError`, if it is no participant's code."""
    if not is_code(participant_id):
        shown = participant_id if len(participant_id) <= 40 else f"{participant_id[:40]}..."
        raise PlaceError(
            f"participant code {shown!r} ({len(participant_id)} characters): must be 1 to 32 letters and digits "
            "(A-Z, a-z, 0-9), no blanks, dots or slashes; use a code, not a name"
        )


def place(results: Path, participant_id: str, experiment: str, registered: Register | None = None) -> Place:
    """The place of a run. `PlaceError` if the code breaks a rule or differs from a known one in case alone.

    `registered` is the folder's register, where it has been read.
    """
    check_code(participant_id)
    check_case(results, participant_id, known_codes(results, registered or register.read_register(results)))
    return Place(results=results, participant_id=participant_id, experiment=experiment)


def check_case(results: Path, participant_id: str, known: Iterable[str]) -> None:
    """`PlaceError`, if a code differs from a known one in case alone."""
    for code in known:
        if code != participant_id and code.lower() == participant_id.lower():
            raise PlaceError(
                f"participant code {participant_id!r} differs from {code!r} in {results} in case alone; "
                f"use {code!r} or another code"
            )


def known_codes(results: Path, registered: Register) -> list[str]:
    """The participants who have a folder, or stand in the register as far as it can be trusted."""
    folders = {path.name.removeprefix("sub-") for path in results.glob("sub-*") if path.is_dir()}
    return sorted(folders | set(registered.members))


def journals(results: Path, experiment: str) -> Iterator[Path]:
    """The journals of an experiment in a results folder."""
    yield from sorted(results.glob(f"sub-*/sub-*_task-{experiment}_journal.jsonl"))


HeadOf = Callable[[Path], Head | None]
"""Gives the head of a journal; `None` where nothing in it was acknowledged."""


def row_of_next_run(
    setup: Setup[Any], results: Path, registered: Register, head_of: HeadOf = journal.head
) -> int | None:
    """The row of the balancing square that the next run takes; `None` for a random order.

    The least used row over the runs of participants who are not excluded, the first such row. So rows are used equally
    often, to within one, whenever everyone who was excluded has been replaced.
    """
    design = setup.config.design
    if design.order == "random":
        return None
    used = used_rows(results, setup.config.experiment, registered, head_of)
    return plan.next_row(design.order, len(design.methods), used)


def used_rows(results: Path, experiment: str, registered: Register, head_of: HeadOf = journal.head) -> list[int]:
    """The rows that runs in this folder have taken; who is excluded gives theirs back."""
    left_out = registered.excluded()
    heads = [head_of(path) for path in journals(results, experiment) if _code(path) not in left_out]
    rows = [one.plan.order_row for one in heads if one is not None]
    return [row for row in rows if row is not None]


def _code(journal_path: Path) -> str:
    return journal_path.parent.name.removeprefix("sub-")


def set_aside(run: Place) -> list[Path]:
    """Rename a run's files so that a fresh one can begin; nothing is lost. Returns the new names."""
    return [set_aside_file(path) for path in (run.journal, run.table) if path.exists()]


def set_aside_file(path: Path) -> Path:
    """Rename a file, or a folder, to the first free `NAME.aside-N`. Returns the new name."""
    number = 1
    while _aside(path, number).exists():
        number += 1
    return path.rename(_aside(path, number))


def _aside(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}.aside-{number}{path.suffix}")
