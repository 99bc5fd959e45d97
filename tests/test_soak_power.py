"""The full figures behind `recoil power`, kept as a table: `make soak`."""

from __future__ import annotations

import json
import os
import shutil
import statistics as st
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from analysis.paper.paper import load_paper
from analysis.paper.recurrence import WHOLE_PATTERN, wilson_interval
from analysis.predict.drawn import studies_of
from analysis.predict.jobs import on_processes
from analysis.predict.power.planned import ANOVA, ANY_PAIR
from analysis.predict.synthetic_studies import pattern_odds
from analysis.report.copies import cores
from experiments.load import find, load_setup
from tests.conftest import RECOIL, Soak
from tests.power_chain import counted, null_setup, said, through_the_chain
from tests.power_files import files

pytestmark = pytest.mark.soak

STUDIES = 100_000


def power(out: Path, *words: object) -> dict[str, Any]:
    done = subprocess.run([RECOIL, "power", *map(str, words), "--out", out], check=True, capture_output=True)
    assert done.returncode == 0
    found: dict[str, Any] = json.loads((out / "power.json").read_text(encoding="utf-8"))
    return found


def interval(share: dict[str, Any]) -> str:
    return f"{100 * share['share']:.2f} % [{100 * share['ci_low']:.2f}, {100 * share['ci_high']:.2f}]"


def test_100_000_studies_of_experiment_1_in_a_minute(tmp_path: Path, soak: Soak) -> None:
    times = []
    for number in range(3):
        start = time.perf_counter()
        power(tmp_path / str(number), "direction", "--participants", 14, "--effect", 1, "--studies", STUDIES)
        times.append(time.perf_counter() - start)
    load = os.getloadavg()[0]
    how = f"median of 3, with report, {cores()} cores, load {load:.1f}"
    soak("100,000 studies of experiment 1, drawn and analysed", f"{st.median(times):.1f} s", "60 s", how)
    assert st.median(times) < 60


@pytest.mark.parametrize("experiment", ["direction", "preference"])
def test_null_participants_at_large_n(tmp_path: Path, soak: Soak, experiment: str) -> None:
    found = power(tmp_path / "null", experiment, "--null", "--participants", 14, "--studies", STUDIES)
    for design in found["designs"]:
        shares = {share["claim"]: share for share in design["claims"]}
        for claim in (name for name in shares if "other than" not in name):
            share = shares[claim]
            holds = share["ci_low"] <= 0.05 <= share["ci_high"]
            how = f"{STUDIES:,} studies of 14 {design['people']}; 5 % {'inside' if holds else 'outside'} the interval"
            soak(f"{experiment}: false positives, {claim}", interval(share), "5 %", how)
        for claim in (ANOVA, ANY_PAIR):
            assert abs(shares[claim]["share"] - 0.05) < 0.003


def one_study(folder: str, experiment: str, seed: int) -> dict[str, tuple[bool, bool]]:
    """Of each claim: what the logs' statistics say, and what the power analysis says of the same answers."""
    where = Path(tempfile.mkdtemp(dir=folder))
    try:
        found = through_the_chain(null_setup(experiment), 14, seed, where)
        counts = counted(found).claims
        return {claim: (bool(held), bool(counts[claim][0])) for claim, held in said(found).items()}
    finally:
        shutil.rmtree(where)


@pytest.mark.parametrize("experiment", ["direction", "preference"])
def test_null_participants_through_real_logs(tmp_path: Path, soak: Soak, experiment: str) -> None:
    """100 studies of 14 people: 1400 runs with journal and table, read and summarised as `recoil analyze` does."""
    studies: dict[int, dict[str, tuple[bool, bool]]] = {}
    with on_processes(cores()) as run:
        run(partial(one_study, str(tmp_path), experiment), range(1, 101), studies.__setitem__)
    differing = sum(said_so != counted_so for one in studies.values() for said_so, counted_so in one.values())
    soak(f"{experiment}: claims that logs and power analysis judge differently", differing, "0", "100 studies of 14")
    assert (differing, len(studies)) == (0, 100)
    for claim in (ANOVA, ANY_PAIR):
        held = sum(one[claim][0] for one in studies.values())
        low, high = wilson_interval(held, 100)
        figure = f"{held} % [{100 * low:.1f}, {100 * high:.1f}]"
        soak(f"{experiment}: false positives through real logs, {claim}", figure, "5 % inside", "100 studies of 14")
        assert low <= 0.05 <= high


@pytest.mark.parametrize("experiment", ["direction", "preference"])
def test_the_pattern_recurs_as_the_odds_say(tmp_path: Path, soak: Soak, experiment: str) -> None:
    found = power(tmp_path / "out", experiment, "--participants", 14, "--effect", 1, "--studies", STUDIES)
    theirs = pattern_odds(studies_of(load_setup(experiment)), getattr(load_paper(find("paper")), experiment), 2000, 1)
    row = next(row for row in theirs.rows if row.claim == WHOLE_PATTERN)
    pattern = found["published_pattern"]
    how = f"{STUDIES:,} studies; `recoil reproduce` says {100 * row.share:.1f} % of 2000"
    soak(f"{experiment}: the whole pattern recurs with n = 14", interval(pattern), "stated", how)
    error = (row.share * (1 - row.share) * (1 / 2000 + 1 / STUDIES)) ** 0.5
    assert abs(pattern["share"] - row.share) < 4 * error


def test_dask_and_processes_give_the_same_bytes(tmp_path: Path, soak: Soak) -> None:
    import distributed

    words = ("direction", "--participants", "8,14,20", "--effect", "0.75,1", "--studies", 20_000)
    for number in (1, 2, 3):
        power(tmp_path / str(number), *words, "--workers", number)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="CRITICAL"
    ) as cluster:
        power(tmp_path / "dask", *words, "--scheduler", cluster.scheduler_address)
    one = files(tmp_path / "1")
    same = [name for name in ("2", "3", "dask") if files(tmp_path / name) == one]
    how = f"{len(one)} files, 120,000 studies"
    soak("2 and 3 processes and 2 Dask workers against 1 process", f"{len(same)} of 3 equal", "byte for byte", how)
    assert len(same) == 3
