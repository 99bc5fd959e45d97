"""Arrow and the csv module read the same; and the checks over arrays say what checks row after row say."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.logs import reading
from analysis.logs.files import BadLogError, find_logs
from analysis.logs.reading import read_logs
from analysis.logs.rules import check_logs
from analysis.logs.texts import TEXT, TextTable, arrow_tables, csv_tables, decimals, joined, records, text_tables
from experiments.record import tables
from tests.log_files import TextRow, rating_rows, trial_rows, trials_path, write_rows, write_study
from tests.plain_rules import Table, check_table

Rows = list[TextRow]
Fault = tuple[str, int | None, str | None]
"""Message, line and column."""

ODD_CELLS = (
    "", " ", "0", "00", "01", "1", "2", "3", "61", "-1", "+1", "1.5", "1e3", "1e-05", ".5", "5.", ".", "..",
    "1.2.3", "1_0", "nan", "inf", "10", "10.0", "10.1", "1e999", "0.12345678901234567890123456789",
    "999999999999999", "9999999999999999", "forward", "backward", "left", "vibration", "asymmetric-1",
    "asymmetric-2", "P01", "P02", "'P01", "p01", "P 1", "'=1", "''", "'", "a,b", "a\"b", "a\nb", "a\r\nb", "Übung",
    "振動", "synthetic", "participant", "x" * 600, "x" * 511, "x" * 17, "\t", "\x00", "\ufeff", "direction",
    "preference", "１", "2026-11-21T09:00:00.000001Z",
    "\x01",
)  # fmt: skip


def _bytes(rows: Rows, header: list[str], line_end: str = "\r\n") -> bytes:
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, header, restval="", extrasaction="ignore", lineterminator=line_end)
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode()


@st.composite
def _spoilt(draw: st.DrawFn) -> bytes:
    """A valid file of either experiment, changed in a few cells, rows, columns or bytes."""
    seed = draw(st.integers(1, 3))
    rows = trial_rows("P01", seed, sets=2) if draw(st.booleans()) else rating_rows("P01", seed)
    header = tables.names(rows[0]["experiment"])
    for _ in range(draw(st.integers(0, 3))):
        row, name = draw(st.sampled_from(rows)), draw(st.sampled_from(header))
        row[name] = draw(st.sampled_from(ODD_CELLS))
    if draw(st.booleans()):
        place, other = draw(st.integers(0, len(rows) - 1)), draw(st.integers(0, len(rows) - 1))
        change: Callable[[], object] = draw(
            st.sampled_from(
                [
                    lambda: rows.insert(place, dict(rows[other])),
                    lambda: rows.pop(place),
                    lambda: rows.insert(other, rows.pop(place)),
                    lambda: header.remove(header[place % len(header)]),
                    header.reverse,
                    lambda: header.insert(0, draw(st.sampled_from(["mood", "x y", "Stimmung ä", header[0]]))),
                ]
            )
        )
        change()
    content = _bytes(rows, header, draw(st.sampled_from(["\r\n", "\r\n", "\n", "\r"])))
    if draw(st.booleans()):
        place = draw(st.integers(0, len(content)))
        end = draw(st.integers(place, min(len(content), place + 3)))
        pieces = [b"", b",", b"\n", b"\r", b'"', b"\xff", b"\x00", b"0", b"\xef\xbb\xbf", b"\r\n", b";", b" "]
        content = content[:place] + draw(st.sampled_from(pieces)) + content[end:]
    return content


def _row_by_row(content: bytes) -> Table | Fault:
    """A file's rows as plain values, or what is wrong with it."""
    try:
        return check_table(records(content), "P01")
    except BadLogError as bad:
        return bad.message, bad.line, bad.column


def _over_arrays(tables: list[TextTable]) -> tuple[dict[int, pd.DataFrame], dict[int, Fault]]:
    """Each good file's rows, and what is wrong with each bad one, by their numbers."""
    frames, faults = dict[int, pd.DataFrame](), dict[int, Fault]()
    for table in tables:
        try:
            block, logs = check_logs(table, dict.fromkeys(table.logs, "P01"))
        except BadLogError as bad:
            faults |= dict.fromkeys(table.logs, (bad.message, bad.line, bad.column))
            continue
        for number, log in logs.items():
            if isinstance(log, BadLogError):
                faults[number] = log.message, log.line, log.column
            else:
                frames[number] = joined(log.experiment, [block], {number: "study"})
    return frames, faults


@pytest.mark.slow
@settings(max_examples=60)
@given(st.lists(_spoilt(), min_size=1, max_size=5))
def test_checks_over_arrays_say_and_read_what_checks_row_after_row_do(contents: list[bytes]) -> None:
    tables, no_text = text_tables(dict(enumerate(contents)))
    frames, faults = _over_arrays(tables)
    faults |= {number: (bad.message, bad.line, bad.column) for number, bad in no_text.items()}
    for number, content in enumerate(contents):
        expected = _row_by_row(content)
        if not isinstance(expected, Table):
            assert faults[number] == expected, content
            continue
        rows = frames[number].astype(object).where(frames[number].notna(), None)
        assert rows.drop(columns="study").to_dict("records") == list(expected.rows), content


@pytest.mark.slow
@settings(max_examples=60)
@given(st.lists(_spoilt(), min_size=1, max_size=5))
def test_what_arrow_reads_the_csv_module_reads_alike(contents: list[bytes]) -> None:
    tables = arrow_tables(dict(enumerate(contents)))
    frames, faults = _over_arrays(tables)
    taken = [number for table in tables for number in table.logs]
    others, no_text = csv_tables({number: contents[number] for number in taken})
    expected_frames, expected_faults = _over_arrays(others)
    assert (no_text, faults) == ({}, expected_faults)
    assert set(frames) == set(expected_frames)
    for number, frame in frames.items():
        pd.testing.assert_frame_equal(frame, expected_frames[number])


@pytest.mark.slow
@settings(max_examples=15)
@given(contents=st.lists(_spoilt(), min_size=1, max_size=4))
def test_a_folder_read_by_the_csv_module_alone_gives_equal_tables_and_problems(
    tmp_path_factory: pytest.TempPathFactory, contents: list[bytes]
) -> None:
    folder = write_study(tmp_path_factory.mktemp("both"), participants=2, seed=9)
    for number, content in enumerate(contents):
        path = folder / f"sub-P{number:02d}x" / f"sub-P{number:02d}x_task-direction_trials.csv"
        path.parent.mkdir()
        path.write_bytes(content.replace(b"P01", f"P{number:02d}x".encode()))
    quick = read_logs([folder])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reading, "text_tables", csv_tables)
        careful = read_logs([folder])
    assert quick.problems == careful.problems
    assert quick.files == careful.files
    pd.testing.assert_frame_equal(quick.trials, careful.trials)
    pd.testing.assert_frame_equal(quick.ratings, careful.ratings)


def _file(rows: Rows, line_end: str = "\r\n") -> bytes:
    return _bytes(rows, tables.names(rows[0]["experiment"]), line_end)


def _taken(contents: list[bytes]) -> set[int]:
    """The files that Arrow reads."""
    return {number for table in arrow_tables(dict(enumerate(contents))) for number in table.logs}


@pytest.mark.parametrize("line_end", ["\r\n", "\n"])
def test_logs_as_recoil_writes_them_are_read_by_arrow(line_end: str) -> None:
    rows = trial_rows()
    rows[3].update(note="ünruhig, gähnt".replace(",", ""), flags="interrupted repeated", response="", correct="")
    assert _taken([_file(rows, line_end=line_end), _file(rating_rows(), line_end=line_end)]) == {0, 1}


def test_quoted_notes_are_read_by_arrow_and_come_back_as_they_were() -> None:
    rows = trial_rows()
    said = 'he said "no",\r\nthen left; \'=1'
    rows[3]["note"] = tables.guard(said)
    rows[9]["response"] = "left"
    good, bad = _file([row | {"response": row["direction"], "correct": "1"} for row in rows]), _file(rows)
    assert _taken([good, bad, _file(trial_rows())]) == {0, 1, 2}
    frames, faults = _over_arrays(arrow_tables({0: good, 1: bad, 2: _file(trial_rows())}))
    assert set(frames) == {0, 2}
    assert frames[0]["note"][3] == said
    assert faults[1][1:] == (12, "response")


def test_a_guarded_code_is_the_code(tmp_path: Path) -> None:
    rows = trial_rows()
    rows[0]["participant_id"] = "'P01"
    write_rows(trials_path(tmp_path, "P01"), rows)
    assert read_logs([tmp_path]).trials["participant_id"].unique().tolist() == ["P01"]


def test_bad_values_and_orders_are_found_without_the_csv_module() -> None:
    rows = trial_rows()
    rows[5]["response"] = "left"
    cut = _file(trial_rows())
    sources = [_file(trial_rows()), _file(rows), cut[:-40], cut, _file(trial_rows()[::-1])]
    assert _taken(sources) == {0, 1, 3, 4}


def test_a_file_with_bad_rows_leaves_the_others_to_arrow() -> None:
    good, ragged = _file(trial_rows()), _file(trial_rows()).replace(b",forward,", b",forward,,", 1)
    not_text, cr = good.replace(b"synthetic", b"synth\xe9tic", 1), good.replace(b"\r\n", b"\r", 3)
    assert _taken([ragged, good, not_text, good, good, cr]) == {1, 3, 4}


def test_a_byte_order_mark_is_left_to_the_csv_module() -> None:
    content = _file(trial_rows())
    assert _taken([b"\xef\xbb\xbf" + content, content]) == {1}


def test_a_byte_order_mark_in_a_row_is_no_code(tmp_path: Path) -> None:
    path = write_rows(trials_path(tmp_path, "P01"), trial_rows())
    path.write_bytes(path.read_bytes().replace(b"\nP01", b"\n\xef\xbb\xbfP01", 1))
    (problem,) = read_logs([tmp_path]).problems
    assert "is not a code" in problem.message


@pytest.mark.parametrize("name", ["note", "mood"])
def test_cells_too_long_for_the_csv_module_are_refused(name: str) -> None:
    rows = trial_rows()
    rows[3][name] = "x" * (csv.field_size_limit() + 1)
    header = [*tables.names("direction"), "mood"]
    contents = [_bytes(rows, header), _bytes(trial_rows(), header)]
    assert _taken(contents) == {1}
    assert "field limit" in text_tables(dict(enumerate(contents)))[1][0].message


_DECIMALS = st.one_of(
    st.floats(0, 1e6).map(repr),
    st.decimals(0, 99, places=6).map(str),
    st.from_regex("[0-9.]{0,26}", fullmatch=True),
    st.sampled_from(["1" * 400, "nan", "inf", "-1", " 1", "1e00005", "+1"]),
)


@pytest.mark.slow
@settings(max_examples=120)
@given(st.lists(_DECIMALS, min_size=1))
def test_decimals_are_read_to_the_last_bit_or_doubted(texts: list[str]) -> None:
    numbers, odd = decimals(pa.array([text or None for text in texts], TEXT))
    for row, (text, number) in enumerate(zip(texts, numbers.tolist(), strict=True)):
        assert row in odd or (number == float(text) if text else number != number)  # noqa: PLR0124 - NaN


def test_files_are_found_in_the_order_of_their_paths_and_links_once(tmp_path: Path) -> None:
    write_study(tmp_path / "a", participants=3)
    (tmp_path / "a-b").mkdir()
    write_rows(trials_path(tmp_path / "a-b", "P09"), trial_rows("P09"))
    linked = tmp_path / "a" / "zz_trials.csv"
    linked.symlink_to(trials_path(tmp_path / "a", "P02"))
    found = find_logs([tmp_path])
    expected = sorted([*tmp_path.rglob("*_trials.csv"), *tmp_path.rglob("*_ratings.csv")])
    assert found.problems == ()
    assert [Path(log) for log in found.logs] == [path for path in expected if path != linked]


@pytest.mark.parametrize("name", ["_trials (1).csv", "_trials - Copy.csv", "_trials.CSV", "_ratings_old.csv"])
def test_a_log_with_the_name_of_a_copy_is_named_and_not_read(name: str, tmp_path: Path) -> None:
    write_study(tmp_path / "a", participants=2)
    before = find_logs([tmp_path])
    assert before.problems == ()
    there = trials_path(tmp_path / "a", "P02")
    there.rename(there.with_name(f"sub-P02_task-direction{name}"))
    found = find_logs([tmp_path])
    (said,) = found.problems
    assert said.participant == "P02"
    assert "that of a copy (rule: sub-CODE_task-EXPERIMENT_trials.csv" in said.message
    assert len(found.logs) == len(before.logs) - 1


def test_a_participants_folder_without_a_log_and_a_file_in_its_place_are_named(tmp_path: Path) -> None:
    write_study(tmp_path / "a", participants=1)
    for name in ("sub-P02", "sub-P03", "sub-P04", "sub-P05/beh", "photos"):
        (tmp_path / "a" / name).mkdir(parents=True)
    (tmp_path / "a" / "sub-P03" / "sub-P03_task-direction_trials.csv.gz").write_text("x")
    (tmp_path / "a" / "sub-P04" / "sub-P04_task-direction_practice_trials.csv").write_text("x")
    write_rows(tmp_path / "a" / "sub-P05" / "beh" / "sub-P05_task-direction_trials.csv", trial_rows("P05"))
    for name in ("sub-P06", "sub-P07.zip", "sub-P08_task-direction_shots.csv"):
        (tmp_path / "a" / name).write_text("x")
    found = {one.file.name: one.message for one in find_logs([tmp_path]).problems}
    assert sorted(found) == ["sub-P02", "sub-P03", "sub-P06", "sub-P07.zip"]
    assert "without a log or a journal; in it: nothing; put back what is missing" in found["sub-P02"]
    assert "in it: sub-P03_task-direction_trials.csv.gz;" in found["sub-P03"]
    assert all("a file where a participant's folder belongs" in found[name] for name in ("sub-P06", "sub-P07.zip"))


def test_what_was_set_aside_or_practised_is_no_copy(tmp_path: Path) -> None:
    write_study(tmp_path / "a", participants=1)
    for name in ("_trials.aside-1.csv", "_practice_trials (1).csv", "_shots.csv"):
        (tmp_path / "a" / "sub-P01" / f"sub-P01_task-direction{name}").write_text("x")
    assert find_logs([tmp_path]).problems == ()


def test_a_participant_whose_folder_is_a_link_is_named_and_not_read(tmp_path: Path) -> None:
    write_study(tmp_path / "a", participants=1)
    (tmp_path / "a" / "sub-P07").symlink_to(tmp_path / "a" / "sub-P01")
    (said,) = find_logs([tmp_path]).problems
    assert (said.participant, "linked folders are not read" in said.message) == ("P07", True)
