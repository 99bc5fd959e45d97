"""The trials of a log whose times are the answerer's own, ready for the measures of the trade-off; and the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray
from analysis.stats.cells import codes_of, places_among
from analysis.times.by_person import ordered
from analysis.times.own_times import OWN, REASON

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

INSTRUCTION = "instruction"
"""The optional column that says what the participant was told."""
NEUTRAL = "neutral"
"""The instruction of a trial that has none."""
INSTRUCTION_ORDER = ("speed", NEUTRAL, "accuracy")

REFUSALS = {
    "experimenter": f"the time came from the experimenter's hand: {REASON}",
    "no_source": "response_source is empty: nobody knows whose hand the time came from",
    "not_valid": "response_time_valid is not 1: the time is not said to be the participant's own",
    "no_time": "there is no time",
    "not_above_0": "the time is not above 0",
}
"""Why an answered trial is refused; of several reasons the first counts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnTrials:
    """Trials, one axis, each person's in order of time; persons, methods and instructions as places in their names."""

    person: Places
    method: Places
    instruction: Places
    forward: Flags  # which way the shot went
    correct: FloatArray
    time_s: FloatArray
    source: NDArray[np.str_]
    people: tuple[str, ...]
    methods: tuple[str, ...]
    instructions: tuple[str, ...]
    answered: int
    refused: dict[str, int]  # reason in `REFUSALS` -> trials

    def of(self, rows: Flags) -> OwnTrials:
        """Some of the trials, under the same names."""
        names = ("person", "method", "instruction", "forward", "correct", "time_s", "source")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def cell(self, method: str, instruction: str) -> OwnTrials:
        """The trials of a method under an instruction."""
        mine = self.method == self.methods.index(method)
        return self.of(mine & (self.instruction == self.instructions.index(instruction)))


def own_trials(trials: pd.DataFrame, methods: Sequence[str]) -> OwnTrials:
    """The answered trials of a coded table whose times are the answerer's own; an optional column `instruction`."""
    instructions, instruction = _instructions(trials)
    sources, source = _names(trials["response_source"])
    time_s = trials["response_time_s"].to_numpy(dtype=np.float64)
    answered = trials["correct"].notna().to_numpy(dtype=np.bool_)
    refused, used = _refused(trials, answered, time_s, sources[source])
    rows = np.flatnonzero(used)
    person = codes_of(trials["participant_id"])
    rows = rows[ordered(person[rows], time_s[rows]).rows]
    return OwnTrials(
        person=person[rows],
        method=places_among(trials["method"], methods)[rows],
        instruction=instruction[rows],
        forward=np.asarray(trials["direction"] == "forward", dtype=np.bool_)[rows],
        correct=trials["correct"].to_numpy(dtype=np.float64, na_value=np.nan)[rows],
        time_s=time_s[rows],
        source=sources[source[rows]],
        people=tuple(map(str, trials["participant_id"].cat.categories)),
        methods=tuple(methods),
        instructions=instructions,
        answered=int(np.count_nonzero(answered)),
        refused=refused,
    )


def _refused(
    trials: pd.DataFrame, answered: Flags, time_s: FloatArray, source: NDArray[np.str_]
) -> tuple[dict[str, int], Flags]:
    """How many answered trials are refused for which reason, and which are left."""
    valid = (trials["response_time_valid"] == 1).fillna(value=False).to_numpy(dtype=np.bool_)
    faults = {
        "experimenter": source == "experimenter",
        "no_source": ~np.isin(source, (*OWN, "experimenter")),
        "not_valid": ~valid,
        "no_time": np.isnan(time_s),
        "not_above_0": time_s <= 0.0,
    }
    left, counts = answered, dict[str, int]()
    for reason, fault in faults.items():
        counts[reason] = int(np.count_nonzero(left & fault))
        left = left & ~fault
    return {reason: count for reason, count in counts.items() if count}, left


def _instructions(trials: pd.DataFrame) -> tuple[tuple[str, ...], Places]:
    """The instructions that occur, from speed to accuracy if they are those, else sorted; and each trial's place."""
    if INSTRUCTION not in trials:
        return (NEUTRAL,), np.zeros(len(trials), dtype=np.intp)
    names, places = _names(trials[INSTRUCTION])
    labels = np.where(names == "", NEUTRAL, names)
    found = {str(labels[place]) for place in np.flatnonzero(np.bincount(places, minlength=len(labels)))}
    order = [name for name in INSTRUCTION_ORDER if name in found] if found <= {*INSTRUCTION_ORDER} else sorted(found)
    where = np.array([order.index(label) if label in found else 0 for label in labels.tolist()], dtype=np.intp)
    return tuple(order), where[places]


def _names(column: pd.Series) -> tuple[NDArray[np.str_], Places]:
    """The names in a column and each row's place among them; the last is empty and stands for a missing one."""
    found = column.astype("category").cat
    names = np.array([*map(str, found.categories), ""], dtype=np.str_)
    places = found.codes.to_numpy().astype(np.intp)
    return names, np.where(places < 0, len(names) - 1, places)
