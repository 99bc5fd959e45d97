from __future__ import annotations

import json
from pathlib import Path

import pytest

from device.physics import FIDELITIES
from tests.conftest import Recoil

pytestmark = pytest.mark.slow


def test_the_bench_tells_error_rates_and_power_of_every_post_hoc_test(recoil: Recoil, tmp_path: Path) -> None:
    out = tmp_path / "bench"
    done = recoil("bench", "post-hocs", "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found == json.loads((out / "bench.json").read_text(encoding="utf-8"))
    assert len(found["post-hocs"]) == 12
    assert all(row["data_sets"] == 20_000 for row in found["post-hocs"])
    page = (out / "report.md").read_text(encoding="utf-8")
    assert all(row["post_hoc"] in page for row in found["post-hocs"])
    pooled = next(row for row in found["post-hocs"] if row["claimed"] == 0.05)
    assert f"{pooled['null_error']:.4f}" in page
    assert (out / "report.html").stat().st_mode & 0o077 == 0


def test_an_unknown_part_is_named_with_those_there_are(recoil: Recoil) -> None:
    done = recoil("bench", "horoscope")
    assert done.returncode == 2
    assert "horoscope" in done.stderr
    assert "post-hocs" in done.stderr


def test_the_bench_tells_error_and_time_of_every_model(recoil: Recoil, tmp_path: Path) -> None:
    out = tmp_path / "bench"
    done = recoil("bench", "physics", "--repeats", 1, "--batch", 100, "--out", out)
    assert done.returncode == 0, done.stderr
    rows = json.loads((out / "bench.json").read_text(encoding="utf-8"))["physics"]
    assert [(row["drive_off"], row["fidelity"]) for row in rows] == [
        (drive_off, fidelity) for drive_off in ("open", "shorted") for fidelity in FIDELITIES
    ]
    assert all(row["single_us"] > 0 for row in rows)
    assert all(row["error"] <= row["stated"] for row in rows if row["stated"] is not None)  # null: nothing is promised
    assert {row["error"] for row in rows if row["fidelity"] == "full"} == {0.0}
    page = (out / "report.md").read_text(encoding="utf-8")
    assert all(fidelity in page and fidelity in done.stdout for fidelity in FIDELITIES)
