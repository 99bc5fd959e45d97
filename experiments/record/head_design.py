"""The design in the first line of a journal."""

from __future__ import annotations

from experiments.config.door import ConfigError, checked_table
from experiments.design.config import DesignConfig
from experiments.record.journal import Head, JournalError
from experiments.record.provenance import recoil_version


def began_with(head: Head) -> DesignConfig:
    """The design that a run began with. `JournalError`: the journal's head holds none of this version."""
    at, setup = f"{head.path}: line 1", head.setup_json if isinstance(head.setup_json, dict) else {}
    design = setup.get("experiment")
    if not isinstance(design, dict):
        raise JournalError(f"no design of this version of Recoil ({head.plan.experiment!r})", at=at)
    try:
        return checked_table(DesignConfig, design, at)
    except ConfigError as error:  # to be corrected as a config the journal is not
        said = (
            "…; but correct nothing in a journal: it was changed, or another version of Recoil wrote it (it names "
            f"{head.provenance.get('recoil', 'unknown')}, this is {recoil_version()}), which reads and rebuilds it"
        )
        raise JournalError(said, at=at, value=str(error).removeprefix(f"{at}: ")) from error
