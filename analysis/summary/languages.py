"""In which language participants were spoken to, where nobody who speaks it has checked the catalogue."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from analysis.logs.journals import RunFile
from device.messages import first_few
from experiments.record import journal, storage
from experiments.record.journal import JournalError, ShownLanguage

_MARK = b'"language":{"code":'
_NAMED = 10


def unchecked_languages(runs: Iterable[RunFile]) -> Iterator[str]:
    """A line for each experiment and language that was used unchecked, with who was spoken to in it."""
    found: dict[tuple[str, str], list[str]] = {}
    for run in runs:
        shown = _shown(Path(run.path))
        if shown is not None and not shown.checked_by:
            found.setdefault((run.experiment, f"{shown.code} ({shown.name})"), []).append(run.participant)
    for (experiment, said), codes in sorted(found.items()):
        people = first_few(sorted(set(codes)), _NAMED)
        yield (f"{experiment}: {people} saw and heard {said}, in texts that no native speaker had checked")


def _shown(path: Path) -> ShownLanguage | None:
    """The language that a journal names, if any: a look that is cheap enough for ten thousand of them."""
    try:
        if _MARK not in storage.first_line(path):
            return None
        head = journal.head(path)
    except (OSError, JournalError):  # whose journal cannot be read is said elsewhere
        return None
    return None if head is None else head.language
