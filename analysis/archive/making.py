"""What the redacted journals of an archive make: written when it is exported, made again when it is verified."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from analysis.archive import bids_export
from analysis.archive.contents import left_out_in
from analysis.archive.manifest import ArchiveFault
from analysis.logs.files import ARCHIVE_FILE
from analysis.logs.reading import read_logs
from analysis.summary.analyze import Request
from experiments.config.door import Model, Text, checked_table, read_text
from experiments.record import journal
from experiments.study import preregistration

RESULTS, ANALYSIS, BIDS = "results", "analysis", "bids"
PREREGISTRATION = "preregistration"
RULES_FILE, REQUESTS_FILE = f"{ANALYSIS}/rules.toml", f"{ANALYSIS}/requests.toml"


class ArchiveSettings(Model):
    """How an archive was made: what has to be known to make its tables and statistics again."""

    format: Literal[1] = 1
    title: Text
    free_text: bool
    include_synthetic: bool


def read_settings(folder: Path) -> ArchiveSettings:
    """How an archive was made. `ConfigError` if its file does not say so."""
    path = folder / ARCHIVE_FILE
    return checked_table(ArchiveSettings, bids_export.read_json(path), path, read_text(path))


def analysis_of(folder: Path, settings: ArchiveSettings) -> Request:
    """The analysis that an archive holds, of the journals and tables in it.

    Whom the study left out it knows from the list of runs. Deviations from a preregistration need the study's files,
    dates and register: its own report lists them.
    """
    rules, requests = folder / RULES_FILE, folder / REQUESTS_FILE
    return Request(
        paths=[folder / RESULTS],
        out=folder / ANALYSIS,
        title=settings.title,
        include_synthetic=settings.include_synthetic,
        rules=rules if rules.is_file() else None,
        requests=requests if requests.is_file() else None,
        against_frozen=False,
        left_out=left_out_in(folder),
    )


def preregistration_faults(folder: Path) -> list[ArchiveFault]:
    """What of an archive's preregistrations was edited or is missing, also what its journals name."""
    chain = preregistration.read_chain(folder / PREREGISTRATION)
    journals = sorted((folder / RESULTS).glob(f"sub-*/*{journal.ENDING}"))
    gone = preregistration.missing(chain, preregistration.carried_by(journals))
    return [ArchiveFault(file=os.path.relpath(one.at, folder), said=one.said) for one in (*chain.problems, *gone)]


def bids_files(folder: Path, settings: ArchiveSettings) -> dict[str, bytes]:
    """The files of the BIDS data set that an archive's journals and tables make."""
    logs = read_logs([folder / RESULTS], include_synthetic=settings.include_synthetic)
    members = bids_export.members_of(folder / RESULTS)
    return bids_export.data_set_of(logs, members, settings.title, free_text=settings.free_text)[1]
