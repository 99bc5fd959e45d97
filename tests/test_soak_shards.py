"""`recoil power` in 64 jobs against one run, kept as a table: `make soak`."""

from __future__ import annotations

import random
import signal
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from analysis.report.copies import cores
from tests.conftest import RECOIL, Soak
from tests.power_files import files
from tests.waiting import wait_for

pytestmark = pytest.mark.soak

WORDS = ("direction", "--participants", "8,14,20,40", "--effect", "0.5,0.75,1", "--studies", "20000")
JOBS = 64


def power(*words: object) -> None:
    subprocess.run([RECOIL, "power", *map(str, words)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One run on one process."""
    folder = tmp_path_factory.mktemp("one")
    power(*WORDS, "--workers", 1, "--out", folder)
    return folder


@pytest.fixture(scope="module")
def shards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run as 64 jobs, as many at once as there are cores, in any order."""
    folder = tmp_path_factory.mktemp("shards")
    with ThreadPoolExecutor(cores()) as jobs:
        list(jobs.map(lambda number: job(number, folder), random.Random(1).sample(range(1, JOBS + 1), JOBS)))
    return folder


def job(number: int, folder: Path, *words: object) -> None:
    power(*WORDS, "--workers", 1, "--shard", f"{number}/{JOBS}", "--out", folder, *words)


def test_64_shards_and_one_run(one: Path, shards: Path, tmp_path: Path, soak: Soak) -> None:
    power("--merge", shards, "--out", tmp_path / "merged")
    merged, whole = files(tmp_path / "merged"), files(one)
    same = sum(merged.get(name) == content for name, content in whole.items())
    how = f"240,000 studies of 8 to 40 people; {JOBS} jobs in any order, {cores()} at once, then --merge"
    soak("64 shards against one run on one process", f"{same} of {len(whole)} files equal", "byte for byte", how)
    assert merged == whole


def test_jobs_that_are_killed_and_started_again(shards: Path, tmp_path: Path, soak: Soak) -> None:
    for number in range(1, 9):
        words = (*WORDS, "--workers", "1", "--shard", f"{number}/8", "--out", str(tmp_path))
        with subprocess.Popen([RECOIL, "power", *words], stderr=subprocess.DEVNULL) as running:
            wait_for(lambda: [kept for kept in tmp_path.glob("unfinished*") if kept.stat().st_size])
            running.send_signal(signal.SIGKILL)
        assert not (tmp_path / f"shard-{number}-of-8.json").exists()
        power(*words)
    for folder in (tmp_path, shards):
        power("--merge", folder, "--out", folder / "merged")
    equal = files(tmp_path / "merged") == files(shards / "merged")
    how = "each of 8 jobs killed (SIGKILL) after its first piece and started again; against the 64 shards"
    soak("jobs killed in the middle", "all files equal" if equal else "other files", "byte for byte", how)
    assert equal


def test_a_shard_worked_out_on_dask(shards: Path, tmp_path: Path, soak: Soak) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="CRITICAL"
    ) as cluster:
        job(1, tmp_path, "--scheduler", cluster.scheduler_address)
    equal = files(tmp_path)["shard-1-of-64.json"] == (shards / "shard-1-of-64.json").read_bytes()
    soak("a shard on 2 Dask workers against 1 process", "equal" if equal else "other", "byte for byte", "1 of 64")
    assert equal
