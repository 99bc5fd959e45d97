"""Each study's logs alone, of logs that were read together."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from analysis.logs.completeness import tidied
from analysis.logs.frames import STUDY
from analysis.logs.reading import Logs


def by_study(logs: Logs) -> dict[str, Logs]:
    """The logs of each study with plain codes, by the study's name; nothing if there is one study only."""
    names = sorted({str(name) for table in (logs.trials, logs.ratings) for name in table[STUDY].unique()})
    if len(names) < 2:
        return {}
    return {name: replace(logs, trials=_alone(logs.trials, name), ratings=_alone(logs.ratings, name)) for name in names}


def _alone(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = tidied(table[table[STUDY] == study]).reset_index(drop=True)
    codes = rows["participant_id"].cat.rename_categories(lambda code: str(code).removeprefix(f"{study}/"))
    return rows.assign(participant_id=codes)
