"""The table of a journal: what a run writes at its end, and what can be made again at any time."""

from __future__ import annotations

import hashlib
from pathlib import Path

from pydantic import ValidationError

from experiments import catalogue
from experiments.design.plan import Plan
from experiments.record import replay
from experiments.record.columns import FILE_SUFFIX
from experiments.record.journal import Contents, JournalError
from experiments.record.journal import read as read_journal
from experiments.record.tables import table_bytes


def table(contents: Contents) -> bytes:
    """The CSV that a journal makes. `JournalError` if this version does not know its plan."""
    plan = plan_of(contents)
    if plan.experiment not in catalogue.CATALOGUE:
        raise JournalError(
            f"{contents.path}: line 1: experiment {plan.experiment!r} is not known to this version of Recoil"
        )
    rows = catalogue.CATALOGUE[plan.experiment].rows(plan, replay.told(contents))
    return table_bytes(plan.experiment, rows)


def sha256(data: bytes) -> str:
    """The checksum of a table."""
    return hashlib.sha256(data).hexdigest()


def plan_of(contents: Contents) -> Plan:
    """The plan at the head of a journal."""
    try:
        return Plan.from_record(contents.header["plan"])
    except ValidationError as error:
        raise JournalError(f"{contents.path}: line 1: no plan of this version of Recoil") from error


def rebuild(path: Path) -> tuple[Path, bytes, Contents]:
    """The table of a journal: where it belongs, its bytes, and what the journal holds."""
    contents = read_journal(path)
    data = table(contents)
    name = path.name.replace("_journal", f"_{FILE_SUFFIX[plan_of(contents).experiment]}")
    return path.with_name(name).with_suffix(".csv"), data, contents
