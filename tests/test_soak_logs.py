"""The full figures behind "tens of thousands of logs", kept as a table: `make soak`."""

from __future__ import annotations

import hashlib
import json
import statistics as st
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests.conftest import RECOIL, Soak
from tests.log_files import trials_path, write_many

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parent.parent
LOGS = 10_000

BOTH_WAYS = """
import json, sys, time
from pathlib import Path
import pandas as pd
from analysis.logs.reading import read_logs
from analysis.summary.summary import summarize
folder = Path(sys.argv[1])
files = sorted(folder.rglob("*_trials.csv"))
times = {"loop": [], "read": [], "summarize": [], "trade": []}
def timed(name, work):
    start = time.perf_counter()
    done = work()
    times[name].append(time.perf_counter() - start)
    return done
for _ in range(4):
    timed("loop", lambda: [pd.read_csv(file).shape for file in files])
    logs = timed("read", lambda: read_logs([folder]))
    timed("summarize", lambda: summarize(logs, trade=False))
    timed("trade", lambda: summarize(logs, fits=True))
assert len(logs.trials) == 60 * len(files) and not logs.problems and not logs.remarks
print(json.dumps({name: found[1:] for name, found in times.items()}))
"""
"""The first round of each only warms up."""

ALONE = """
import resource, sys
from pathlib import Path
from analysis.logs.reading import read_logs
from analysis.summary.summary import summarize
summarize(read_logs([Path(sys.argv[1])]), fits=True)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""

WHAT_FOLLOWS = """
import json, statistics, sys, time
from pathlib import Path
from analysis.logs.reading import read_logs
from analysis.summary.analyze import Request, analyze
from analysis.summary.summary import summarize
folder, out = map(Path, sys.argv[1:])
def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
found = []
for _ in range(4):
    whole = seconds(lambda: analyze(Request(paths=[folder], out=out)))
    found.append(whole - seconds(lambda: summarize(read_logs([folder]))))
print(json.dumps(statistics.median(found[1:])))
"""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_many(tmp_path_factory.mktemp("many"), LOGS)


def _child(program: str, *folders: Path) -> Any:
    words = [sys.executable, "-c", program, *folders]
    return json.loads(subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def test_reading_checking_and_analysing_against_a_loop_that_merely_reads(logs: Path, soak: Soak) -> None:
    found = _child(BOTH_WAYS, logs)
    loop, read, summarize, trade = (st.median(found[name]) for name in ("loop", "read", "summarize", "trade"))
    rounds = list(zip(*found.values(), strict=True))
    ratio = st.median(a / (b + c) for a, b, c, _ in rounds)
    statistics, fits = st.median(c / a for a, _, c, _ in rounds), st.median((d - c) / a for a, _, c, d in rounds)
    how = "600,000 rows, warm cache, median of 3, one process"
    soak(f"a loop of `pandas.read_csv` over {LOGS} logs", f"{loop:.2f} s", "stated", how)
    soak("the same logs read and checked", f"{read:.2f} s", "stated", how)
    soak("the statistics of these", f"{summarize:.2f} s", "stated", how)
    soak("the same with speed and accuracy, 40 people fitted", f"{trade:.2f} s", "stated", how)
    by_turns = "in the same process, by turns"
    soak("read, checked and analysed, times faster than the loop", f"{ratio:.1f}", "5", by_turns)
    soak("the statistics, of the loop's time", f"{statistics:.0%}", "25 %", by_turns)
    soak("speed and accuracy, 40 people fitted, of the loop's time", f"{fits:.0%}", "25 %", by_turns)
    assert ratio >= 5
    assert max(statistics, fits) < 0.25


SEALED = 2_000


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs with the journal of one real run beside each, finished with the hash of the log."""
    folder = write_many(tmp_path_factory.mktemp("sealed"), SEALED)
    asked = RunRequest(
        setup=load_setup("direction"), participant_id="P1", results=tmp_path_factory.mktemp("one"), seed=1
    )
    data = run(asked, synthetic_screen, VirtualClock()).place.journal.read_bytes()
    end = data.rfind(b"\n", 0, -1) + 1
    last = json.loads(data[end:])
    for path in folder.rglob("*_trials.csv"):
        last["table_sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
        name = path.name.replace("_trials.csv", "_journal.jsonl")
        path.with_name(name).write_bytes(data[:end] + json.dumps(last, separators=(",", ":")).encode() + b"\n")
    return folder


def test_holding_every_log_against_its_journal_against_the_same_loop(sealed: Path, soak: Soak) -> None:
    found = _child(BOTH_WAYS, sealed)
    rounds = list(zip(*found.values(), strict=True))
    ratio = st.median(a / (b + c) for a, b, c, _ in rounds)
    read = st.median(b / a for a, b, _, _ in rounds)
    how = f"{SEALED} logs, a journal of 130 kB beside each, hashed whole; in one process, by turns"
    soak("read, checked against journals and analysed, times faster than the loop", f"{ratio:.1f}", "2", how)
    soak("the reading and checking of these, of the loop's time", f"{read:.0%}", "stated", how)
    assert ratio >= 2


def test_what_follows_reading_and_statistics(logs: Path, tmp_path: Path, soak: Soak) -> None:
    write_many(tmp_path / "one", 1)
    one, many = (_child(WHAT_FOLLOWS, folder, tmp_path / "out") for folder in (tmp_path / "one", logs))
    how = f"tables, figures and pages of {LOGS} people {many:.1f} s, of one {one:.1f} s; medians of 3"
    soak("what follows reading and statistics costs more", f"{many - one:.1f} s", "2 s", how)
    assert many - one < 2.0


def test_memory(logs: Path, soak: Soak) -> None:
    peak = _child(ALONE, logs)
    soak(f"peak memory, {LOGS} logs read and analysed", f"{peak:.0f} MB", "1000 MB", "resident, of its own process")
    assert peak < 1000


def test_the_whole_command_with_broken_files(logs: Path, tmp_path: Path, soak: Soak) -> None:
    broken = [trials_path(logs, f"P{number:05d}") for number in range(100, LOGS + 1, 100)]
    kept = [path.read_bytes() for path in broken]
    for path, data in zip(broken, kept, strict=True):
        path.write_bytes(data.replace(b",forward,", b",left,", 1))
    try:
        start = time.perf_counter()
        words = [RECOIL, "analyze", logs, "--out", tmp_path]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        elapsed = time.perf_counter() - start
    finally:
        for path, data in zip(broken, kept, strict=True):
            path.write_bytes(data)
    loop = _loop_s(logs)
    found = json.loads((tmp_path / "statistics.json").read_text(encoding="utf-8"))
    named, n = sum("'left' is not allowed" in str(one) for one in found["excluded"]), found["direction"]["n"]
    report = (tmp_path / "report.md").read_text(encoding="utf-8").count("'left' is not allowed")
    how = f"in `statistics.json`, and in the report {report}; {n} others analysed"
    soak("broken logs named with line and reason", f"{named} of {len(broken)}", "all", how)
    how = f"{elapsed:.1f} s, one run; the loop {loop:.1f} s, right after it"
    soak("`recoil analyze` of these, with report and figures", f"{elapsed / loop:.1f} loops", "4", how)
    assert (done.returncode, named, n) == (1, len(broken), LOGS - len(broken))
    assert report >= len(broken)
    assert elapsed < 4 * loop


def _loop_s(folder: Path) -> float:
    """How long the loop that merely reads takes, once."""
    start = time.perf_counter()
    for file in sorted(folder.rglob("*_trials.csv")):
        pd.read_csv(file)
    return time.perf_counter() - start
