"""The full figures behind "both experiments run end to end", kept as a table: `make soak`."""

from __future__ import annotations

import json
import os
import random
import statistics as st
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import studentized_range
from statsmodels.stats.anova import AnovaRM

from experiments.design.planned import PlannedRun, planned_run
from experiments.design.planning import plan_of
from experiments.load import load_setup
from experiments.record.journal import JournalError, read_journal
from tests import kills, reproduced
from tests.conftest import RECOIL, Soak

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory, soak: Soak) -> Path:
    folder = tmp_path_factory.mktemp("soak")
    times = []
    for number in range(3):
        start = time.perf_counter()
        subprocess.run([RECOIL, "reproduce", "--out", folder / str(number)], check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    soak("`recoil reproduce` ends with the report", f"{st.median(times):.1f} s", "60 s", "median of 3, without set-up")
    assert st.median(times) < 60
    return folder / "0"


def test_28_logs_rebuilt_and_analysed_alike(out: Path, tmp_path: Path, soak: Soak) -> None:
    tables = {path: path.read_bytes() for path in out.glob("logs/*/*.csv")}
    subprocess.run([RECOIL, "rebuild", *sorted(out.glob("logs/*/*_journal.jsonl"))], check=True, capture_output=True)
    same = sum(path.read_bytes() == data for path, data in tables.items())
    soak(
        "tables equal to their rebuilt ones, byte for byte", f"{same} of {len(tables)}", "28 of 28", "`recoil rebuild`"
    )
    for path, data in tables.items():
        (tmp_path / path.name).write_bytes(data)
    words = [RECOIL, "analyze", tmp_path, "--fits", "--out", tmp_path / "again"]  # a reproduction asks for the fits
    subprocess.run(words, check=True, capture_output=True)
    found, again = (reproduced.statistics(folder) for folder in (out, tmp_path / "again"))
    equal = all(again[experiment] == found[experiment] for experiment in reproduced.EXPERIMENTS)
    how = "all keys of both experiments, the fits included"
    soak("`recoil analyze` on the tables alone: statistics.json", "equal" if equal else "differs", "equal", how)
    assert (same, len(tables), equal) == (28, 28, True)


@pytest.mark.parametrize("experiment", reproduced.EXPERIMENTS)
def test_statistics_against_other_programs(out: Path, soak: Soak, experiment: str) -> None:
    table = reproduced.scores(out, experiment)
    ours = reproduced.statistics(out)[experiment]
    theirs = AnovaRM(table, "score", "participant_id", within=["method"]).fit().anova_table["F Value"].iloc[0]
    error = abs(ours["anova"]["F"] / theirs - 1)
    soak(f"{experiment}: F(2, 26), relative difference from AnovaRM", f"{error:.1e}", "1e-10", "statsmodels")
    ms, n = ours["anova"]["ms_error"], ours["n"]
    worst = 0.0
    for pair in ours["tukey"]:
        p = float(studentized_range.sf(abs(pair["difference"]) / np.sqrt(ms / n), 3, 26))
        worst = max(worst, abs(pair["p"] - p) / max(p, 1e-12))
    soak(f"{experiment}: Tukey's p, largest relative difference", f"{worst:.1e}", "1e-6", "scipy, same error term")
    assert ours["anova"]["df"] == [2, 26]
    assert error < 1e-10
    assert worst < 1e-6


def test_plans_over_10_000_seeds(soak: Soak) -> None:
    config, broken = load_setup("direction").config, 0
    for seed in range(10_000):
        trials = plan_of(config, "P01", seed).trials
        sessions = [[t for t in trials if t.session == number] for number in (1, 2, 3)]
        kept = all(
            len(session) == 20
            and len({t.method for t in session}) == 1
            and sum(t.direction == "forward" for t in session) == 10
            and [t.set for t in session] == [1 + place // 5 for place in range(20)]
            for session in sessions
        )
        broken += not (kept and len({session[0].method for session in sessions}) == 3)
    soak("plans that break a balance, over 10,000 seeds", broken, "0", "a plain loop")
    assert broken == 0


@pytest.mark.parametrize(("python", "numpy"), [("3.12", "2.0.2"), ("3.11", "2.2.6")])
def test_golden_plan_hashes_hold_elsewhere(tmp_path: Path, soak: Soak, python: str, numpy: str) -> None:
    count = len(json.loads((ROOT / "tests" / "golden_plans.json").read_text(encoding="utf-8")))
    all_hold = f"{count} of {count}"
    uv = ROOT / "scripts" / "uv"
    environment = tmp_path / "venv"
    if subprocess.run([uv, "venv", "-q", "--python", python, environment], check=False).returncode:
        soak(f"golden plan hashes on Python {python}, numpy {numpy}", "not tried", all_hold, "no such Python here")
        pytest.skip(f"no Python {python} here, and none to be fetched")
    needs = [f"numpy=={numpy}", "scipy", "pydantic", "pytest", "hypothesis"]
    there = environment / "bin" / "python"
    subprocess.run([uv, "pip", "install", "-q", "--python", there, *needs], check=True)
    # without the suite's own configuration: what that needs is not there
    alone = ("-c", os.devnull, "--rootdir", ROOT, "-p", "no:cacheprovider", "--noconftest")
    words = [there, "-m", "pytest", "-q", *alone, "tests/test_plan.py", "-k", "first_release"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    held = done.returncode == 0 and done.stdout.startswith("." * count)
    soak(f"golden plan hashes on Python {python}, numpy {numpy}", all_hold if held else "differ", all_hold, "pytest")
    assert held, done.stdout


def planned(name: str) -> PlannedRun:
    """What a run of a shipped design comes to."""
    design = load_setup(name).config
    return planned_run(design, plan_of(design, "P01", 1))


def test_planned_breaks_and_durations(soak: Soak) -> None:
    direction, preference = planned("direction"), planned("preference")
    trial_s = (1800 - direction.break_s) / direction.trials
    soak("planned breaks of experiment 1", f"{direction.break_s:g} s", "780 s", "9 x 20 s + 2 x 300 s")
    soak("a trial of experiment 1, fitted to 30 minutes", f"{trial_s:g} s", "about 17 s", "(1800 s - breaks) / 60")
    soak("planned duration of experiment 2", f"{preference.duration_s / 60:g} min", "about 8 min", "`recoil check`")
    assert (direction.break_s, trial_s, preference.duration_s) == (780, 17, 480)


def test_200_kills(quick_configs: Path, tmp_path: Path, soak: Soak) -> None:
    moments, acknowledged = random.Random(200), 0
    for kill in range(200):
        folder = tmp_path / str(kill)
        folder.mkdir()
        begun = kill % 5 > 0
        acknowledged += kills.check_killed_run(quick_configs, folder, moments.uniform(0, 4), begun=begun)
    soak("acknowledged answers lost over 200 `kill -9`", 0, "0", f"{acknowledged} were acknowledged, random moments")


def test_the_trace_of_a_run(quick_configs: Path, tmp_path: Path, soak: Soak) -> None:
    kills.check_syncs(kills.traced_run(quick_configs, tmp_path))
    soak("acknowledgements without a sync before them", 0, "0", "strace; the folder's sync at creation as well")


def test_a_journal_cut_at_every_byte(out: Path, tmp_path: Path, soak: Soak) -> None:
    data = next(out.glob("logs/*/*_task-preference_journal.jsonl")).read_bytes()
    cut, wrong = tmp_path / "cut.jsonl", 0
    for length in range(len(data) + 1):
        cut.write_bytes(data[:length])
        whole = data[:length].count(b"\n")
        try:
            contents = read_journal(cut)
            wrong += len(contents.records) != whole or bool(contents.cut_message) != (data[length - 1] != 0x0A)
        except JournalError:
            wrong += whole > 0
    soak("cuts read wrongly, a journal cut at every byte", wrong, "0", f"{len(data) + 1} cuts")
    assert wrong == 0


def test_a_full_disk(quick_configs: Path, tmp_path: Path, soak: Soak) -> None:
    kills.check_full_disk(quick_configs, tmp_path)
    soak("answers lost on a full disk", 0, "0", "64 KiB tmpfs, then resumed")


def test_help_is_quick(soak: Soak) -> None:
    times = []
    for _ in range(21):
        start = time.perf_counter()
        subprocess.run([RECOIL, "--help"], check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    soak("`recoil --help`", f"{st.median(times):.2f} s", "0.3 s", "median of 21")
    assert st.median(times) < 0.3


def test_the_pattern_recurs_as_often_as_said(out: Path, soak: Soak) -> None:
    page = (out / "report.md").read_text()
    rows = [
        line.split("|")
        for line in page.splitlines()
        if "whole pattern" in line or "II above Asymmetric Force I" in line
    ]
    for experiment, row in zip(("direction", "direction", "preference", "preference"), rows[-4:], strict=True):
        soak(
            f"{experiment}: recurs, {row[1].strip()}", row[2].strip(), "stated", f"2000 studies, CI {row[3].strip()} %"
        )
    assert json.loads((out / "statistics.json").read_text())["direction"]["n"] == 14
