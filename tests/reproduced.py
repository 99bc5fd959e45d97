"""What a reproduction left: its statistics, and scores from its logs."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from analysis.logs.reading import read_logs

EXPERIMENTS = ("direction", "preference")


def statistics(folder: Path) -> dict[str, dict[str, object]]:
    return json.loads((folder / "statistics.json").read_text())


def scores(reproduction: Path, experiment: str) -> pd.DataFrame:
    """One score a participant and method, long."""
    logs = read_logs([reproduction / "logs"])
    if experiment == "preference":
        return logs.ratings.rename(columns={"rating": "score"})[["participant_id", "method", "score"]]
    forward = logs.trials[logs.trials.direction == "forward"]
    means = forward.groupby(["participant_id", "method"]).correct.mean().astype(float)
    return means.rename("score").reset_index()
