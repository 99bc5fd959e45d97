from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.logs.exclusions import complete_rows
from analysis.logs.reading import read_logs
from analysis.stats.cells import coded, trial_cells
from tests.log_files import METHODS, trial_rows, trials_path, write_rows, write_study


def test_a_left_out_participant_leaves_no_empty_cell(tmp_path: Path) -> None:
    write_study(tmp_path, participants=3)
    write_rows(trials_path(tmp_path, "P02"), trial_rows("P02", methods=METHODS[:2]))
    rows, left_out = complete_rows(coded(read_logs([tmp_path]).trials), "direction", METHODS)
    cells = trial_cells(rows, METHODS)
    assert [one.participant for one in left_out] == ["P02"]
    assert cells.participants == ("P01", "P03")
    assert (cells.trials == 10).all()


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_cells_count_what_a_group_by_counts(direction: str, tmp_path: Path) -> None:
    write_study(tmp_path, participants=4)
    table = read_logs([tmp_path]).trials
    rates = trial_cells(coded(table), METHODS).rates(direction)
    chosen = table[table["direction"] == direction]
    expected = chosen.groupby(["participant_id", "method"])["correct"].mean().unstack("method")
    assert rates.to_numpy() == pytest.approx(expected[list(METHODS)].to_numpy(dtype=np.float64))
    assert list(rates.index) == list(expected.index)


def test_keys_are_in_the_order_of_their_names_however_they_come() -> None:
    for dtype in ("string", "category", object):
        column = pd.Series(["P10", "P2", None, "P10", "P1"], dtype=dtype)
        if dtype == "category":
            column = column.cat.set_categories(["P2", "unused", "P10", "P1"])
        found = coded(pd.DataFrame({"participant_id": column}))["participant_id"]
        assert list(found.cat.categories) == ["P1", "P10", "P2"]
        assert found.cat.codes.tolist() == [1, 2, -1, 1, 0]


def test_a_direction_nobody_was_shown_has_no_rates(tmp_path: Path) -> None:
    table = read_logs([write_study(tmp_path, participants=3)]).trials
    cells = trial_cells(coded(table[table["direction"] == "forward"]), METHODS)
    assert cells.rates("backward").shape == (0, 3)
    assert cells.rates("forward").shape == (3, 3)


def test_an_empty_table_has_empty_cells(tmp_path: Path) -> None:
    table = read_logs([write_study(tmp_path, participants=1)]).trials
    cells = trial_cells(coded(table.iloc[:0]), METHODS)
    assert cells.trials.shape == (0, 3, 2)
    assert cells.rates("forward").shape == (0, 3)
