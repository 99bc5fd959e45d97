"""Beside the logs of a design lies what their columns mean."""

from __future__ import annotations

import stat

import pytest

from analysis.archive.bids import described
from experiments.clock import VirtualClock
from experiments.design.methods_section import factor_words
from experiments.load import load_setup
from experiments.record.design_columns import columns
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests.designs import design


@pytest.mark.slow
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


@pytest.mark.parametrize(
    ("name", "unit", "title", "words"),
    [
        ("stiffness_N_m", "N/m", "Stiffness", "stiffness in N/m"),
        ("spring_ohm", "ohm", "Spring", "spring in Ω"),
        ("pad_count", "count", "Pad count", "pad count"),
        ("angle_deg", "deg", "Angle deg", "angle deg"),
        ("distance", "", "Distance", "distance"),
    ],
)
def test_the_unit_that_ends_a_name_is_the_same_everywhere(name: str, unit: str, title: str, words: str) -> None:
    config = design(factors={"method": {"levels": ["a"]}, name: {"levels": [1.0, 2.0]}})
    (column,) = (one for one in columns(config) if one.name == name)
    assert (column.unit, described(column, name)["LongName"], factor_words(name)) == (unit, title, words)
