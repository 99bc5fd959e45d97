"""The tracks of a procedure as they went: the levels that answers chose, and what was answered at each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

from experiments.design.config import DesignConfig
from experiments.design.plan import Condition

TRACK = "track"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackAnswers:
    """One person's track in one condition: its levels in the order they were felt, and whether each was a success.

    `condition`: each factor with its level.
    """

    participant: str
    condition: Condition
    track: int
    levels: tuple[float, ...]
    successes: tuple[bool, ...]


def tracks_in(design: DesignConfig, conditions: list[str], rows: pd.DataFrame) -> Iterator[TrackAnswers]:
    """The tracks among answered rows with a `level` and a `success`, which stand in the order they were felt.

    None of a design whose levels were fixed beforehand, or of a table without tracks.
    """
    if not design.adapted or TRACK not in rows:
        return
    of = [name for name in conditions if name not in design.adapted]
    for key, some in rows.groupby(["participant_id", *of, TRACK], sort=True, observed=True, dropna=False):
        who, *levels, number = key
        yield TrackAnswers(
            participant=str(who),
            condition=tuple(zip(of, (one if isinstance(one, str) else float(str(one)) for one in levels), strict=True)),
            track=int(float(str(number))),
            levels=tuple(some["level"].astype(float)),
            successes=tuple(some["success"].astype(bool)),
        )
