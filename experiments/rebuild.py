"""The table that a journal makes, by the design in its first line."""

from __future__ import annotations

from pathlib import Path

from experiments.config.door import ConfigError, checked_table
from experiments.design.config import DesignConfig
from experiments.record import design_table, replay
from experiments.record.journal import Contents, Head, JournalError, read_journal
from experiments.record.tables import table_bytes


def began_with(head: Head) -> DesignConfig:
    """The design that a run began with. `JournalError`: the journal's head holds none of this version."""
    setup = head.setup_json if isinstance(head.setup_json, dict) else {}
    design = setup.get("experiment")
    if not isinstance(design, dict):
        raise JournalError(f"{head.path}: line 1: no design of this version of Recoil ({head.plan.experiment!r})")
    try:
        return checked_table(DesignConfig, design, f"{head.path}: line 1")
    except ConfigError as error:
        raise JournalError(f"{error}; the journal was changed, or another version of Recoil wrote it") from error


def table(contents: Contents) -> bytes:
    """The CSV that a journal makes. `JournalError` as `began_with`."""
    design = began_with(contents.head)
    rows = design_table.design_rows(contents.plan, replay.history(contents), design)
    return table_bytes(design_table.columns(design), rows)


def rebuild(path: Path) -> tuple[Path, bytes, Contents]:
    """The table of a journal: where it belongs, its bytes, and what the journal holds."""
    contents = read_journal(path)
    name = path.name.replace("_journal", f"_{began_with(contents.head).table}")
    return path.with_name(name).with_suffix(".csv"), table(contents), contents
