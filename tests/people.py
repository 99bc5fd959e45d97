"""Participants as they stand in a study."""

from __future__ import annotations

from typing import Any

from experiments.study.study import Participant, RunProgress, RunState

ORDER = ("direction", "preference")


def someone(*states: RunState, **more: Any) -> Participant:
    runs = tuple(RunProgress(experiment=name, state=state) for name, state in zip(ORDER, states, strict=True))
    return Participant(participant_id="P01", runs=runs, **more)
