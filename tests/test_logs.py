from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from analysis.logs.reading import read_logs
from experiments.clock import RealClock
from experiments.record import tables
from experiments.study import register
from tests.log_files import TextRow, rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study

TRIALS_FILE = "sub-P01_task-direction_trials.csv"


def _change(line: int, **cells: str) -> Callable[[list[TextRow]], None]:
    """Set cells of the row that stands on `line` of the file."""
    return lambda rows: rows[line - 2].update(cells)


def _problem(folder: Path) -> str:
    """The one problem of the logs in `folder`, of which nothing is used."""
    logs = read_logs([folder])
    assert logs.files == ()
    assert len(logs.trials) == len(logs.ratings) == 0
    (problem,) = logs.problems
    return str(problem)


def test_a_study_is_read_whole_with_numbers_as_numbers(tmp_path: Path) -> None:
    logs = read_logs([write_study(tmp_path, participants=3)])
    assert logs.problems == ()
    assert len(logs.files) == 6
    assert (len(logs.trials), len(logs.ratings)) == (180, 9)
    assert list(logs.trials.columns) == [*tables.names("direction"), "study"]
    assert logs.trials["correct"].isin([0, 1]).all()
    assert logs.ratings["rating"].between(0.0, 10.0).all()


def test_files_and_folders_may_be_mixed_and_named_twice(tmp_path: Path) -> None:
    write_study(tmp_path, participants=2)
    logs = read_logs([trials_path(tmp_path, "P01"), tmp_path, tmp_path / "sub-P01"])
    assert (len(logs.files), logs.problems) == (4, ())


def test_practice_is_not_data(tmp_path: Path) -> None:
    write_study(tmp_path, participants=1)
    write_rows(tmp_path / "sub-P01" / "sub-P01_task-direction_practice_trials.csv", trial_rows())
    assert len(read_logs([tmp_path]).files) == 2


def test_unknown_columns_are_kept_out_and_missing_optional_ones_are_empty(tmp_path: Path) -> None:
    header = [name for name in tables.names("direction") if name != "gun"]
    rows = [{**row, "mood": "good"} for row in trial_rows()]
    write_rows(trials_path(tmp_path, "P01"), rows, [*header, "mood"])
    logs = read_logs([tmp_path])
    assert logs.problems == ()
    assert "mood" not in logs.trials
    assert logs.trials["gun"].isna().all()


def test_a_rating_of_zero_is_a_rating_and_an_empty_one_is_missing(tmp_path: Path) -> None:
    rows = rating_rows()
    rows[0]["rating"], rows[1]["rating"] = "0", ""
    write_rows(ratings_path(tmp_path, "P01"), rows)
    ratings = read_logs([tmp_path]).ratings["rating"]
    assert ratings[0] == 0.0
    assert ratings.isna().tolist() == [False, True, False]


def test_text_comes_back_as_it_was_said(tmp_path: Path) -> None:
    said = '=SUM("a",1)\nsecond line, with a comma'
    rows = rating_rows()
    rows[0]["comment"] = tables.guard(said)
    write_rows(ratings_path(tmp_path, "P01"), rows)
    assert read_logs([tmp_path]).ratings["comment"][0] == said


def test_a_byte_order_mark_and_plain_line_feeds_are_tolerated(tmp_path: Path) -> None:
    path = write_rows(trials_path(tmp_path, "P01"), trial_rows())
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\r\n", b"\n"))
    assert read_logs([tmp_path]).problems == ()


BAD_TRIALS = {
    "level": (_change(3, response="left", correct="0"), ["line 3", "response", "'left'", "forward, backward"]),
    "experiment": (_change(3, experiment="preference"), ["line 3", "experiment", "'preference'", "direction"]),
    "integer": (_change(4, trial="three"), ["line 4", "trial", "'three'", "whole number"]),
    "decimal integer": (_change(4, attempts="1.5"), ["line 4", "attempts", "'1.5'", "whole number"]),
    "number": (_change(5, response_time_s="0,8"), ["line 5", "response_time_s", "'0,8'", "finite number"]),
    "not finite": (_change(5, response_time_s="nan"), ["line 5", "response_time_s", "'nan'", "finite number"]),
    "too large": (_change(5, response_time_s="1e999"), ["line 5", "response_time_s", "'1e999'", "finite number"]),
    "flag": (_change(6, correct="yes"), ["line 6", "correct", "'yes'", "0, 1"]),
    "required": (_change(6, method=""), ["line 6", "method", "empty", "required"]),
    "correct": (
        _change(7, direction="forward", response="forward", correct="0"),
        ["line 7", "correct", "correct is 0", "forward", "1 if they are the same"],
    ),
    "correct alone": (_change(8, response=""), ["line 8", "correct", "response empty", "both or neither"]),
    "response alone": (_change(8, correct=""), ["line 8", "correct", "correct empty", "both or neither"]),
    "twice": (_change(9, trial="7"), ["line 9", "trial", "trial 7", "session 1", "once each"]),
    "gap": (_change(21, trial="21"), ["trial 20", "missing", "session 1", "without a gap"]),
    "session gap": (
        lambda rows: [row.update(session="4") for row in rows if row["session"] == "3"],
        ["session 3", "missing", "without a gap"],
    ),
    "two methods": (_change(10, method="ramp"), ["line 10", "method", "'ramp'", "one method a session"]),
    "two people": (_change(11, participant_id="P02"), ["line 11", "participant_id", "'P02'", "one participant a file"]),
    "code": (lambda rows: [row.update(participant_id="P 1") for row in rows], ["'P 1'", "letters or digits"]),
    "name": (lambda rows: [row.update(participant_id="P02") for row in rows], ["'P02'", "sub-P01", "in its name"]),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", BAD_TRIALS)
def test_a_trials_file_that_breaks_a_rule_is_left_out_with_place_value_and_rule(case: str, tmp_path: Path) -> None:
    spoil, words = BAD_TRIALS[case]
    rows = trial_rows()
    spoil(rows)
    write_rows(trials_path(tmp_path, "P01"), rows)
    message = _problem(tmp_path)
    assert [word for word in [TRIALS_FILE, *words] if word not in message] == [], message


@pytest.mark.parametrize("rating", ["10.1", "-0.5"])
def test_a_rating_off_the_scale_is_refused(rating: str, tmp_path: Path) -> None:
    rows = rating_rows()
    rows[1]["rating"] = rating
    write_rows(ratings_path(tmp_path, "P01"), rows)
    message = _problem(tmp_path)
    assert all(word in message for word in ("line 3", "column rating", rating, "0 to 10"))


def test_a_repeated_rating_trial_is_refused(tmp_path: Path) -> None:
    rows = rating_rows()
    rows[2]["trial"] = "1"
    write_rows(ratings_path(tmp_path, "P01"), rows)
    assert "trial 1 stands twice in the run" in _problem(tmp_path)


def _without_last_line_end(content: bytes) -> bytes:
    return content[:-2]


BAD_BYTES = {
    "not UTF-8": (lambda content: content.replace(b"synthetic", b"\xff", 1), ["line 2", "0xff", "UTF-8"]),
    "empty": (lambda _: b"", ["is empty", "header"]),
    "only a mark": (lambda _: b"\xef\xbb\xbf", ["is empty", "header"]),
    "header only": (lambda content: content.split(b"\n")[0] + b"\n", ["line 1", "no rows"]),
    "foreign": (lambda _: b"time,force\r\n0.1,3\r\n", ["line 1", "time,force", "neither"]),
    "semicolons": (lambda content: content.replace(b",", b";"), ["line 1", "neither", "comma-separated"]),
    "missing field": (lambda content: content.replace(b"P01,direction", b"P01", 1), ["line 2", "fields", "header"]),
    "no last end": (_without_last_line_end, ["line 61", "line end"]),
    "cut in a row": (lambda content: content[:2000], ["line end"]),
    "open quote": (lambda content: content.replace(b"synthetic", b'"synthetic', 1), ["line 2", "RFC 4180"]),
    "column missing": (lambda content: content.replace(b",method,", b",how,", 1), ["line 1", "'method'", "missing"]),
    "measure missing": (lambda content: content.replace(b",response,", b",said,", 1), ["'response'", "missing"]),
    "column twice": (lambda content: content.replace(b",note,", b",flags,", 1), ["line 1", "'flags'", "2 times"]),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", BAD_BYTES)
def test_a_file_that_is_no_table_is_left_out_with_place_and_rule(case: str, tmp_path: Path) -> None:
    spoil, words = BAD_BYTES[case]
    path = write_rows(trials_path(tmp_path, "P01"), trial_rows())
    path.write_bytes(spoil(path.read_bytes()))
    message = _problem(tmp_path)
    assert [word for word in [TRIALS_FILE, *words] if word not in message] == [], message


def test_a_second_log_of_a_participant_is_a_problem_whatever_the_case_of_the_code(tmp_path: Path) -> None:
    first = write_rows(tmp_path / "a" / "sub-P01_task-direction_trials.csv", trial_rows("P01"))
    second = write_rows(tmp_path / "b" / "sub-p01_task-direction_trials.csv", trial_rows("p01"))
    logs = read_logs([tmp_path])
    assert logs.files == (first,)
    (problem,) = logs.problems
    assert problem.file == second
    assert str(first) in problem.message
    assert "'p01'" in problem.message


def test_missing_paths_and_folders_without_logs_are_problems(tmp_path: Path) -> None:
    problems = {
        problem.file.name: problem.message for problem in read_logs([tmp_path / "nowhere.csv", tmp_path]).problems
    }
    assert problems["nowhere.csv"] == "no such file or folder"
    assert problems[tmp_path.name].endswith("in this folder")


def _journal(table: Path, record: str) -> Path:
    journal = table.with_name("sub-P01_task-direction_journal.jsonl")
    journal.write_text(json.dumps({"kind": "plan"}) + "\n" + record, encoding="utf-8")
    return journal


def test_a_table_edited_after_its_run_finished_is_refused(tmp_path: Path) -> None:
    path = write_rows(trials_path(tmp_path, "P01"), trial_rows())
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    journal = _journal(path, json.dumps({"kind": "finished", "table_sha256": digest}) + "\n")
    assert read_logs([tmp_path]).problems == ()
    path.write_bytes(path.read_bytes().replace(b",1\r\n", b",1 \r\n") + b"\r\n")
    message = _problem(tmp_path)
    assert "edited since the run" in message
    assert f"recoil rebuild {journal}" in message


@pytest.mark.parametrize("record", ['{"kind": "answer"}\n', '{"kind": "finished", "table_sh', "[1]\n", ""])
def test_the_table_of_an_unfinished_run_is_read_as_it_is(record: str, tmp_path: Path) -> None:
    path = write_rows(trials_path(tmp_path, "P01"), trial_rows())
    _journal(path, record)
    assert read_logs([tmp_path]).problems == ()


def test_the_logs_of_an_excluded_participant_are_left_out_with_the_reason(tmp_path: Path) -> None:
    for code in ("P01", "P02"):
        (tmp_path / f"sub-{code}").mkdir()
        write_rows(tmp_path / f"sub-{code}" / f"sub-{code}_task-direction_trials.csv", trial_rows(code))
    register.append(tmp_path, register.entry("excluded", "P02", reason="fell ill"), RealClock())
    logs = read_logs([tmp_path])
    assert set(logs.trials["participant_id"]) == {"P01"}
    assert "participant P02 is excluded: fell ill" in str(logs.problems[0])


def _onset(row: dict[str, str], second: int) -> dict[str, str]:
    return row | {"onset_utc": f"2024-11-21T09:{second // 60:02d}:{second % 60:02d}.123456Z"}


@pytest.mark.parametrize("first", ["lab", "copy"])
def test_of_two_folders_with_the_same_logs_the_one_that_was_named_first_stays(first: str, tmp_path: Path) -> None:
    rows = [_onset(row, second) for second, row in enumerate(trial_rows())]
    other = "copy" if first == "lab" else "lab"
    for name in (first, other):
        write_rows(trials_path(tmp_path / name, "P01"), rows)
    logs = read_logs([tmp_path / first, tmp_path / other])
    assert logs.files == (trials_path(tmp_path / first, "P01"),)
    (problem,) = logs.problems
    assert problem.file == trials_path(tmp_path / other, "P01")
    assert f"holds what {first}/sub-P01/sub-P01_task-direction_trials.csv holds, byte for byte" in problem.message


@pytest.mark.parametrize("first", ["lab", "copy"])
def test_of_two_logs_with_the_same_answers_the_one_that_was_named_first_stays(first: str, tmp_path: Path) -> None:
    other = "copy" if first == "lab" else "lab"
    for name, code in ((first, "P02"), (other, "P01")):
        write_rows(trials_path(tmp_path / name, code), trial_rows(code))
    logs = read_logs([tmp_path / first, tmp_path / other])
    assert logs.files == (trials_path(tmp_path / first, "P02"),)
