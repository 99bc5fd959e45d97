"""What a run's files are called, and where they lie in a results folder."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from experiments.config.findings import CODE
from experiments.design.plan import Plan
from experiments.record.storage import JOURNAL_ENDING
from experiments.record.tables import FILE_SUFFIX

_CODE = re.compile(CODE)
JOURNAL_NAME = re.compile(rf"sub-({CODE})_task-([a-z]+)(_practice)?_journal(\.aside-[0-9]+)?\.jsonl$")
"""The name of a run's journal: code, experiment, whether it is a practice's, whether it was set aside."""


def is_code(text: str) -> bool:
    """Whether a text can be a participant's code."""
    return _CODE.fullmatch(text) is not None


def is_practice(name: str) -> bool:
    """Whether a file is of a practice, by its name; of one that is not named as runs are, if the word is in it.

    >>> is_practice("sub-P01_task-direction_practice_trials.csv"), is_practice("Practice of P01.csv")
    (True, True)
    >>> is_practice("sub-practice1_task-practice_trials.csv")
    False
    """
    ours = _RUN_FILE.match(name)
    return bool(ours[1]) if ours else "practice" in name.lower()


_RUN_FILE = re.compile(rf"sub-{CODE}_task-[a-z]+(_practice)?_")


def twin_text(code: str, known: Iterable[str], where: Path) -> str:
    """What to do about a code that differs from a known one in case alone; empty if it does not."""
    for other in known:
        if other != code and other.lower() == code.lower():
            return (
                f"participant code {code!r} differs from {other!r} in {where} in case alone; "
                f"use {other!r} if it is the same person, else another code"
            )
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """The files of one participant in one experiment."""

    results: Path
    participant_id: str
    experiment: str
    practice: bool = False
    suffix: str = ""

    @property
    def folder(self) -> Path:
        """The participant's folder."""
        return participant_folder(self.results, self.participant_id)

    @property
    def stem(self) -> str:
        """How the names of the files begin."""
        practice = "_practice" if self.practice else ""
        return f"sub-{self.participant_id}_task-{self.experiment}{practice}"

    @property
    def journal(self) -> Path:
        """The journal: the truth."""
        return self.folder / f"{self.stem}{JOURNAL_ENDING}"

    @property
    def table(self) -> Path:
        """The table made from it."""
        return table_beside(self.journal, self.suffix or FILE_SUFFIX.get(self.experiment, "trials"))

    @property
    def shots(self) -> Path:
        """What a sensor measured of each shot; only where there was one."""
        return shots_path(self.journal)


def participant_folder(results: Path, participant_id: str) -> Path:
    """The folder of a participant."""
    return results / f"sub-{participant_id}"


def journals(results: Path, experiment: str = "", *, aside: bool = False) -> list[Path]:
    """The journals in a results folder in order, of all experiments or of one; `aside`: those set aside too.

    Practices are among those of all.
    """
    task, number = f"_task-{experiment}" if experiment else "", "*" if aside else ""
    return sorted(results.glob(f"sub-*/sub-*{task}_journal{number}.jsonl"))


def table_beside(journal: Path, suffix: str) -> Path:
    """Where a table made from a journal lies, also from one that was set aside.

    >>> table_beside(Path("sub-P01_task-direction_journal.aside-2.jsonl"), "trials").name
    'sub-P01_task-direction_trials.aside-2.csv'
    """
    return journal.with_name(journal.name.replace("_journal", f"_{suffix}")).with_suffix(".csv")


def shots_path(journal: Path) -> Path:
    """Where the table of what a sensor measured lies, beside its journal."""
    return table_beside(journal, "shots")


def misnamed(path: Path, plan: Plan) -> str:
    """Whose a journal is that lies under another run's name; empty if it is where it belongs, or says no name."""
    name = JOURNAL_NAME.search(path.name)
    if name is None or (name[1], name[2]) == (plan.participant_id, plan.experiment):
        return ""
    back = f"sub-{plan.participant_id}_task-{plan.experiment}{JOURNAL_ENDING}"
    return (
        f"is of participant {plan.participant_id}, experiment {plan.experiment}; was it renamed? (rule: a journal is "
        f"called as its run, {back}); put it back there, and the right one here"
    )
