"""Beside the logs of a design lies what their columns mean."""

from __future__ import annotations

import stat

from analysis.archive.bids import described
from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.record.design_columns import columns
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen


def test_every_column_is_described_beside_the_logs_and_only_their_owner_reads_it(tmp_path):
    setup = load_setup("stronger")
    request = RunRequest(setup=setup, participant_id="P01", results=tmp_path, seed=1)
    finished = run(request, synthetic_screen, VirtualClock())
    page = tmp_path / "task-stronger_columns.md"
    text = page.read_text()
    header = finished.place.table.read_text().splitlines()[0].split(",")
    assert all(f"| `{name}` |" in text for name in header)
    assert [column.name for column in columns(setup.config)] == header
    assert stat.S_IMODE(page.stat().st_mode) == 0o600


def test_levels_in_intervals_have_the_unit_of_their_factor():
    made = {column.name: column for column in columns(load_setup("staircase").config)}
    for name, unit, words in (("pulse_s_1", "s", "Pulse 1"), ("pulse_s_2", "s", "Pulse 2")):
        assert made[name].unit == unit
        assert described(made[name], name)["Units"] == unit
        assert described(made[name], name)["LongName"] == words
