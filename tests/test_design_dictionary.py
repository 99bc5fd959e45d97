"""Beside the logs of a design lies what their columns mean."""

from __future__ import annotations

import stat

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
