"""`recoil analyze` with several studies, maps and rules, and the tables it writes for other programs."""

from __future__ import annotations

import csv
import json
import os
import signal
import stat
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from analysis.logs.files import study_names
from analysis.logs.reading import read_logs
from analysis.summary.summary import summarize
from analysis.summary.tables_out import MAX_NAME, short_names
from experiments.record.storage import NO_FILE
from experiments.study.register import REGISTER_FILE
from tests.conftest import Recoil
from tests.log_files import METHODS, trial_rows, trials_path, write_rows, write_study
from tests.waiting import PATIENCE_S, wait_for

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parent.parent / "configs" / "examples"


def _statistics(out: Path) -> Any:
    return json.loads((out / "statistics.json").read_text(encoding="utf-8"))


def _table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream, strict=True))


@pytest.fixture
def sites(tmp_path: Path) -> Path:
    """Two sites with the same codes, of different people."""
    write_study(tmp_path / "data" / "kyoto" / "results", participants=3, seed=1)
    write_study(tmp_path / "data" / "oslo" / "results", participants=2, seed=2)
    return tmp_path / "data"


def test_the_same_code_at_two_sites_is_two_people(recoil: Recoil, sites: Path, tmp_path: Path) -> None:
    done = recoil("analyze", sites, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "read logs" in done.stderr
    assert "analyze: pages" in done.stderr
    found = _statistics(tmp_path / "out")
    people = ["kyoto/P01", "kyoto/P02", "kyoto/P03", "oslo/P01", "oslo/P02"]
    assert list(found["direction"]["participants"]) == people
    alone = summarize(read_logs([sites / "oslo"])).to_dict()
    for key in ("n", "means", "sds", "participants"):
        assert found["studies"]["oslo"]["direction"][key] == alone["direction"][key]
    assert {name: one["preference"]["n"] for name, one in found["studies"].items()} == {"kyoto": 3, "oslo": 2}


def test_a_register_that_cannot_be_read_is_a_problem_for_someone_may_be_excluded(sites: Path) -> None:
    results = sites / "oslo" / "results"
    (results / "participants.jsonl").write_text("junk\n")
    (problem,) = read_logs([sites]).problems
    assert (problem.file, "whom it excludes there is not known" in problem.message) == (
        results / "participants.jsonl",
        True,
    )


def test_a_link_to_no_log_is_a_problem(sites: Path) -> None:
    (sites / "oslo" / "results" / "sub-P09_trials.csv").symlink_to("nowhere.csv")
    (problem,) = read_logs([sites]).problems
    assert "a link that leads to no file; fetch what it stands for" in problem.message


def test_a_second_log_within_a_study_is_a_problem_and_across_studies_none(sites: Path) -> None:
    copy = sites / "oslo" / "results" / "sub-P01" / "sub-P01_task-direction_run-2_trials.csv"
    write_rows(copy, trial_rows("P01", 99))
    (problem,) = read_logs([sites]).problems
    assert "has a direction log already in" in problem.message


def test_tables_for_other_programs_hold_the_statistics_scores(recoil: Recoil, sites: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    recoil("analyze", sites / "kyoto", "--out", out)
    found = _statistics(out)
    assert list(found["direction"]["participants"]) == ["P01", "P02", "P03"]  # one study needs no name
    assert not {"studies", "rules"} & found.keys()
    wide = _table(out / "direction_wide.csv")
    for row in wide:
        for method in METHODS:
            name = method.replace("-", "_")
            scores = found["direction"]["participants"][row["participant_id"]]
            assert float(row[f"{name}_rate_forward"]) == scores[method]
    assert [len(wide), len(_table(out / "direction_long.csv"))] == [3, 9]
    ratings = {
        (row["participant_id"], row["method"]): float(row["rating"]) for row in _table(out / "preference_long.csv")
    }
    scores = found["preference"]["participants"]
    assert ratings == {(code, method): scores[code][method] for code in scores for method in METHODS}
    assert b"\r\n" in (out / "preference_wide.csv").read_bytes()
    assert stat.S_IMODE((out / "preference_wide.csv").stat().st_mode) == 0o600


def test_rules_and_what_they_left_out_stand_in_the_statistics_and_the_report(recoil: Recoil, tmp_path: Path) -> None:
    write_study(tmp_path / "study", participants=4)
    rows = trial_rows("P02", 7)
    rows[0]["flags"] = "interrupted"
    write_rows(trials_path(tmp_path / "study", "P02"), rows)
    rules = tmp_path / "rules.toml"
    rules.write_text((EXAMPLES / "rules.toml").read_text() + '\n[[excluded]]\ncode = "P04"\nreason = "fell ill"\n')
    with rules.open("a") as file:
        file.write('\n[[excluded]]\ncode = "P40"\nreason = "fell ill"\n')
    done = recoil("analyze", tmp_path / "study", "--out", tmp_path / "out", "--rules", rules)
    assert done.returncode == 1, done.stderr
    assert "recoil: the rules exclude P40, who has no log here\n" in done.stderr  # it may be a slip of the pen
    found = _statistics(tmp_path / "out")
    assert found["rules"]["dropped"]["direction"] == {"P02": {"drop_flags": 1}}
    assert found["rules"]["trials"]["direction"] == {"recorded": 240, "kept": 239}
    excluded = [tuple(one.values())[:4] for one in found["excluded"]]
    assert ("direction", "P04", "fell ill", "excluded") in excluded
    report = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "- Direction recognition: 1 participant left out: P04 (fell ill)." in report
    assert "drop_flags 1" in report.replace("\\", "")


def test_a_map_reads_other_programs_logs_and_the_report_says_so(recoil: Recoil, tmp_path: Path) -> None:
    for i in (1, 2):
        lines = ["participant,phase,condition,shot_direction,key_resp.keys,key_resp.rt"]
        keys = {"forward": "up", "backward": "down"}
        lines += [
            f"P0{i},main,{r['method']},{r['direction'][0]},{keys[r['response']]},{r['response_time_s']}"
            for r in trial_rows(f"P0{i}", i)
        ]
        (tmp_path / f"P0{i}.csv").write_text("\n".join(lines) + "\n")
    words = ("analyze", *sorted(tmp_path.glob("P*.csv")), "--out", tmp_path / "out")
    done = recoil(*words, "--columns", EXAMPLES / "columns.toml")
    assert done.returncode == 0, done.stderr
    assert _statistics(tmp_path / "out")["direction"]["n"] == 2
    assert "columns.toml, sha256" in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("option", ["--columns", "--rules"])
def test_a_bad_map_or_bad_rules_end_with_one_message_and_2(recoil: Recoil, tmp_path: Path, option: str) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text("speed = 9\n")
    done = recoil("analyze", tmp_path, "--out", tmp_path / "out", option, bad)
    assert done.returncode == 2
    assert "bad.toml:1: speed = 9: unknown key" in done.stderr
    assert "Traceback" not in done.stderr


ON_A_DISK_THAT_HANGS = """
import sys, time
from pathlib import Path
from experiments.record import storage
from recoil.cli import main

whole = storage.read_whole

def hangs(path):
    if "hangs" not in str(path):
        return whole(path)
    Path("is read").touch()
    time.sleep(3600)

storage.read_whole = hangs
main()
"""


def test_an_interrupt_among_the_logs_ends_with_130_and_leaves_nothing(tmp_path: Path) -> None:
    lines = b"participant_id,experiment\n" + b"P01,direction\n" * 200
    for name in (*map(str, range(400)), "hangs"):
        (tmp_path / f"{name}_trials.csv").write_bytes(lines)
    words = [sys.executable, "-c", ON_A_DISK_THAT_HANGS, "analyze", tmp_path, "--out", tmp_path / "out"]
    with subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as running:
        wait_for((tmp_path / "is read").exists)
        for _ in range(10):  # Linux may give it to a thread that just begins, and the first one sleeps on
            running.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                running.wait(PATIENCE_S / 10)
                break
        assert running.returncode == 130
    assert not (tmp_path / "out").exists()


def without_end(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize("make", [os.mkfifo, without_end], ids=["a pipe", "a device"])
def test_what_is_no_file_keeps_nobody_waiting_and_is_named(
    recoil: Recoil, sites: Path, tmp_path: Path, make: Callable[[Path], None]
) -> None:
    make(bad := sites / "oslo" / "results" / "sub-P09_trials.csv")
    make(sites / "oslo" / "results" / "sub-P01" / "sub-P01_task-direction_journal.jsonl")
    make(register := sites / "kyoto" / "results" / REGISTER_FILE)
    done = recoil("analyze", sites, "--out", tmp_path / "out")
    assert done.returncode == 1, done.stderr
    assert f"{bad}: {NO_FILE if make is os.mkfifo else 'a link that leads to no file'}" in done.stderr
    assert f"{register}: cannot be read ({NO_FILE})" in done.stderr
    assert "sub-P01_task-direction_" in done.stderr
    done = recoil("fit", "times", bad, "--out", tmp_path / "fit")
    assert (done.returncode, f"{bad}: cannot be read: {NO_FILE}" in done.stderr) == (2, True)


def test_names_of_studies_are_what_tells_them_apart() -> None:
    assert study_names(["/d/a/results", "/d/b/results"]) == {"/d/a/results": "a", "/d/b/results": "b"}
    assert study_names(["/d/a", "/d/a/b"]) == {"/d/a": "a", "/d/a/b": "a/b"}
    assert study_names(["/d/a/x", "/d/b"]) == {"/d/a/x": "a/x", "/d/b": "b"}
    assert study_names([]) == {}


def test_long_names_stay_apart_and_within_the_limit() -> None:
    names = short_names([f"{'a very long method name ' * 5}{i}_rate_forward" for i in range(12)] + ["A", "a"])
    assert max(map(len, names)) <= MAX_NAME
    assert len({name.lower() for name in names}) == 14
