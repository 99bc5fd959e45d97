"""Results go to their folder all at once or not at all; what is not theirs there is refused, or kept and named."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from analysis.report import placing
from analysis.summary import analyze as feature
from analysis.summary.analyze import Request, analyze
from analysis.summary.sections import sections
from device.messages import RecoilError
from tests.log_files import tree, write_study

RECORD = "statistics.json"


def put(out: Path, files: dict[str, str], *patterns: str) -> None:
    with placing.results_in(out, RECORD, patterns) as part:
        for name, text in files.items():
            placing.write_file(part, name, text.encode())


FIRST = {RECORD: "1", "report.html": "one", "report.md": "one", "figures/a.png": "one", "a_long.csv": "one"}


def test_results_replace_those_before_them_and_what_is_left_of_these_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "out"
    put(out, FIRST, "*_long.csv")
    assert tree(out) == {name: text.encode() for name, text in FIRST.items()}
    assert capsys.readouterr().err == ""
    (out / "my notes.txt").write_text("kept")
    put(out, {RECORD: "2", "report.html": "two", "report.md": "two", "figures/b.png": "two"}, "*_long.csv")
    assert (out / "report.md").read_text() == "two"
    assert (out / "a_long.csv").read_text() == (out / "figures/a.png").read_text() == "one"
    assert capsys.readouterr().err == (
        f"recoil: {out}: of results before these, and left there: a_long.csv, figures/a.png\n"
    )
    put(out, FIRST, "*_long.csv")
    assert "left there: figures/b.png\n" in capsys.readouterr().err
    assert [path.name for path in out.iterdir() if path.name.startswith(".")] == []


@pytest.mark.parametrize("name", placing.REPORT_FILES)
def test_a_report_of_something_else_is_not_replaced_and_that_is_said_before_any_work(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(RecoilError, match=rf"has a {re.escape(name)} of something else \(there is no statistics.json"):
        put(tmp_path, FIRST)
    assert tree(tmp_path) == {name: b"mine"}


def test_a_record_without_a_report_is_of_something_else_and_not_replaced(tmp_path: Path) -> None:
    placing.write_file(tmp_path, RECORD, b"mine")
    with pytest.raises(RecoilError, match=rf"has a {re.escape(RECORD)} of something else"):
        put(tmp_path, FIRST)
    assert tree(tmp_path) == {RECORD: b"mine"}


@pytest.mark.parametrize("name", ["a_long.csv", "figures/a.png"])
def test_a_file_of_something_else_is_set_aside(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    placing.write_file(tmp_path, name, b"mine")
    placing.write_file(tmp_path, "other.txt", b"mine as well")
    put(tmp_path, FIRST)
    aside = name.replace(".", ".aside-1.")
    assert tree(tmp_path) == {
        **{name: text.encode() for name, text in FIRST.items()},
        aside: b"mine",
        "other.txt": b"mine as well",
    }
    said = f"recoil: {tmp_path / name}: is of something else, and was set aside as {tmp_path / aside}\n"
    assert capsys.readouterr().err == said


def test_a_report_that_comes_while_results_are_worked_out_is_not_replaced(tmp_path: Path) -> None:
    out = tmp_path / "out"

    def two_at_once() -> None:
        with placing.results_in(out, RECORD) as part:
            placing.write_file(part, RECORD, b"2")
            (out / "report.md").write_text("mine")

    with pytest.raises(RecoilError, match=r"report.md of something else"):
        two_at_once()
    assert tree(out) == {"report.md": b"mine"}


def test_an_unusable_place_is_met_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with pytest.raises(NotADirectoryError) as caught, placing.results_in(tmp_path / "file", RECORD):
        pytest.fail("the work was begun")
    assert caught.value.filename == str(tmp_path / "file")


@pytest.mark.parametrize(("place", "named"), [("report.html", "report.html"), ("figures/a.png", "figures/a.png")])
def test_where_one_file_cannot_be_put_none_is(tmp_path: Path, place: str, named: str) -> None:
    put(tmp_path, FIRST)
    (tmp_path / place).unlink()
    (tmp_path / place).mkdir()
    before = tree(tmp_path)
    with pytest.raises(IsADirectoryError) as caught:
        put(tmp_path, dict.fromkeys(FIRST, "2"))
    assert caught.value.filename == str(tmp_path / named)
    assert tree(tmp_path) == before


def test_an_error_speaks_of_the_place_that_was_asked_for_and_folders_that_were_made_for_nothing_are_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match=r"No space") as caught, placing.results_in(Path("a/b"), RECORD) as part:
        raise OSError(28, "No space left on device", str(part / "figures" / "a.png"))
    assert caught.value.filename == "a/b/figures/a.png"
    assert not (tmp_path / "a").exists()


KILLED = """
import os, signal, sys
from pathlib import Path
from analysis.report import placing
with placing.results_in(Path(sys.argv[1]), "statistics.json") as part:
    placing.write_file(part, "report.md", b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_command_left_is_no_result_and_is_taken_away_by_the_next_one(tmp_path: Path) -> None:
    put(tmp_path, FIRST)
    done = subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False, env=os.environ)
    assert done.returncode == -signal.SIGKILL
    assert (tmp_path / "report.md").read_text() == "one"
    assert len([*tmp_path.glob(".part-*")]) == 1
    put(tmp_path, FIRST)
    assert not [*tmp_path.glob(".part-*")]


def test_two_at_work_in_one_folder_leave_each_other_alone(tmp_path: Path) -> None:
    with placing.results_in(tmp_path, RECORD) as one:
        placing.write_file(one, RECORD, b"one")
        placing.write_file(one, "report.md", b"one")
        with placing.results_in(tmp_path, RECORD) as other:
            placing.write_file(other, RECORD, b"other")
            placing.write_file(other, "report.md", b"other")
        assert (tmp_path / RECORD).read_bytes() == b"other"
    assert tree(tmp_path) == {RECORD: b"one", "report.md": b"one"}


def stops(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize(("where", "what"), [(sections, "write_page"), (feature, "_tables"), (feature, "_analysis")])
def test_an_interrupted_analysis_leaves_the_one_before_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: object, what: str
) -> None:
    write_study(tmp_path / "results", participants=3, seed=1)
    request = Request(paths=[tmp_path / "results"], out=tmp_path / "out")
    analyze(request)
    before = tree(tmp_path / "out")
    assert {RECORD, "report.html", "direction_long.csv", "figures/figure-results.png"} <= before.keys()
    monkeypatch.setattr(where, what, stops)
    with pytest.raises(KeyboardInterrupt):
        analyze(request)
    assert tree(tmp_path / "out") == before
