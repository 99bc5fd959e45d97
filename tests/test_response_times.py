from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.logs.reading import read_logs
from analysis.summary.summary import summarize
from analysis.times.own_trials import ResponseTimes, response_times
from tests.log_files import METHODS, TextRow, trial_rows, trials_path, write_rows


def _study(folder: Path, rows: list[TextRow]) -> ResponseTimes:
    write_rows(trials_path(folder, "P01"), rows)
    return response_times(read_logs([folder]).trials, METHODS)


def test_medians_and_percentiles_are_those_of_the_log(tmp_path: Path) -> None:
    rows = trial_rows("P01")
    found = _study(tmp_path, rows)
    own = [
        float(row["response_time_s"]) for row in rows if (row["method"], row["direction"]) == ("vibration", "forward")
    ]
    assert found.n == 60
    assert found.left_out == 0
    assert found.participants["P01"]["vibration"]["forward"] == pytest.approx(float(np.median(own)))
    spread = found.directions["vibration"]["forward"]
    assert spread.n == len(own)
    assert [spread.percentiles[at] for at in (0, 50, 100)] == pytest.approx([min(own), np.median(own), max(own)])


def test_corrected_and_missing_times_are_counted_and_left_out(tmp_path: Path) -> None:
    rows = trial_rows("P01")
    rows[0]["response_time_valid"] = "0"
    rows[1] |= {"response_time_s": "", "response_time_valid": "0"}
    found = _study(tmp_path, rows)
    assert (found.n, found.left_out) == (58, 2)


def test_without_any_time_every_spread_is_absent(tmp_path: Path) -> None:
    rows = [row | {"response_time_valid": "0"} for row in trial_rows("P01")]
    found = _study(tmp_path, rows)
    assert found.methods == dict.fromkeys(METHODS)
    assert found.directions == {method: {} for method in METHODS}
    assert found.participants == {}


def test_one_rule_says_which_times_are_valid_for_the_counts_and_for_the_fits(tmp_path: Path) -> None:
    spoilt = [
        {"response_time_valid": "0"},
        {"response_source": "experimenter"},
        {"response_source": ""},
        {"response_time_s": ""},
        {"response_time_s": "0"},
        {"response_time_s": "0.0"},
    ]
    rows = trial_rows("P01")
    rows[:6] = [row | cells for row, cells in zip(rows, spoilt, strict=False)]
    write_rows(trials_path(tmp_path, "P01"), rows)
    found = summarize(read_logs([tmp_path])).to_dict()["direction"]
    assert (found["response_times"]["n"], found["response_times"]["left_out"]) == (54, 6)
    assert sum(one["n"] for one in found["response_time"].values()) == 54
    assert (found["speed_accuracy"]["n"], found["speed_accuracy"]["answered"]) == (54, 60)
