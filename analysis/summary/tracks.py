"""The tracks of a procedure as they went: the levels that answers chose, and what was answered at each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from experiments.design.config import DesignConfig
from experiments.design.plan import Condition
from experiments.design.procedures.config import KestenConfig, UpDownConfig
from experiments.design.procedures.up_down import track_after
from experiments.design.procedures.walks import walk_rule

if TYPE_CHECKING:
    import pandas as pd

TRACK = "track"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackAnswers:
    """One person's track in one condition: its levels in the order they were felt, and whether each was a success.

    `condition`: each factor with its level. `reversals`: the places of the trials at which an up-down track turned, the
    first trial's is 0; none of a track whose levels are not those that its answers call for.
    """

    participant: str
    condition: Condition
    track: int
    levels: tuple[float, ...]
    successes: tuple[bool, ...]
    reversals: tuple[int, ...] = ()


def tracks_in(design: DesignConfig, conditions: list[str], rows: pd.DataFrame) -> Iterator[TrackAnswers]:
    """The tracks among answered rows with a `level` and a `success`, which stand in the order they were felt.

    None of a design whose levels were fixed beforehand, or of a table without tracks.
    """
    if not design.adapted or TRACK not in rows:
        return
    of = [name for name in conditions if name not in design.adapted]
    for key, some in rows.groupby(["participant_id", *of, TRACK], sort=True, observed=True, dropna=False):
        who, *levels, number = key
        track = TrackAnswers(
            participant=str(who),
            condition=tuple(zip(of, (one if isinstance(one, str) else float(str(one)) for one in levels), strict=True)),
            track=int(float(str(number))),
            levels=tuple(some["level"].astype(float)),
            successes=tuple(some["success"].astype(bool)),
        )
        yield replace(track, reversals=tuple(_reversals(design, track.levels, track.successes)))


def _reversals(design: DesignConfig, levels: Sequence[float], successes: Sequence[bool]) -> Iterator[int]:
    table = design.adaptive
    if not isinstance(table, UpDownConfig | KestenConfig):
        return
    there = tuple(float(level) for level in design.factors[table.of[0]].all_levels)
    rules = (walk_rule(table, there, start) for start in table.starts)
    rule = next((one for one in rules if track_after(one, successes).levels == tuple(levels)), None)
    if rule is not None:
        turned = [len(track_after(rule, successes[:trials]).reversals) for trials in range(len(levels) + 1)]
        yield from (place for place in range(len(levels)) if turned[place + 1] > turned[place])
