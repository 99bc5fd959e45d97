"""The quick way of reading takes a file only if the careful one does, and then with the same values."""

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

from analysis.logs import frames as log_cells
from analysis.logs import reading as logs
from analysis.logs.batch import read_batch
from analysis.logs.files import find_logs
from analysis.logs.frames import Block, joined
from analysis.logs.reading import read_logs
from analysis.logs.rules import BadLogError, records
from experiments.record import columns
from tests.log_files import TextRow, rating_rows, trial_rows, trials_path, write_rows, write_study

Rows = list[TextRow]

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
    make = draw(st.sampled_from([trial_rows, rating_rows]))
    rows = make("P01", draw(st.integers(1, 3)))
    header = columns.names(rows[0]["experiment"])
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


def _carefully(content: bytes) -> pd.DataFrame | None:
    """The one file's rows by the careful reader alone; None if it refuses."""
    try:
        table = logs.check_table(records(content), "P01")
    except BadLogError:
        return None
    block = logs.block_of_rows(table.experiment, table.rows, 0)
    return joined(table.experiment, [block], {0: "study"})


def _quickly(block: Block, number: int) -> pd.DataFrame:
    return joined(block.experiment, [block], {number: "study"})


def _read(contents: list[bytes]) -> tuple[list[Block], dict[int, str]]:
    return read_batch(contents, ["P01"] * len(contents))


@settings(max_examples=300)
@given(st.lists(_spoilt(), min_size=1, max_size=5))
def test_what_the_quick_reader_takes_the_careful_one_takes_with_equal_values(contents: list[bytes]) -> None:
    blocks, codes = _read(contents)
    taken = {number: block for block in blocks for number in set(block.log.tolist())}
    assert set(taken) == set(codes)
    for number, block in taken.items():
        expected = _carefully(contents[number])
        assert expected is not None, contents[number]
        pd.testing.assert_frame_equal(_quickly(block, number), expected)


@settings(max_examples=40)
@given(contents=st.lists(_spoilt(), min_size=1, max_size=4))
def test_both_ways_of_reading_a_folder_give_equal_tables_and_problems(
    tmp_path_factory: pytest.TempPathFactory, contents: list[bytes]
) -> None:
    folder = write_study(tmp_path_factory.mktemp("both"), participants=2, seed=9)
    for number, content in enumerate(contents):
        path = folder / f"sub-P{number:02d}x" / f"sub-P{number:02d}x_task-direction_trials.csv"
        path.parent.mkdir()
        path.write_bytes(content.replace(b"P01", f"P{number:02d}x".encode()))
    quick = read_logs([folder])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(logs, "read_batch", lambda *_: ([], {}))
        careful = read_logs([folder])
    assert quick.problems == careful.problems
    assert quick.files == careful.files
    pd.testing.assert_frame_equal(quick.trials, careful.trials)
    pd.testing.assert_frame_equal(quick.ratings, careful.ratings)


def _file(rows: Rows, line_end: str = "\r\n") -> bytes:
    return _bytes(rows, columns.names(rows[0]["experiment"]), line_end)


@pytest.mark.parametrize("line_end", ["\r\n", "\n"])
def test_logs_as_recoil_writes_them_take_the_quick_way(line_end: str) -> None:
    rows = trial_rows()
    rows[3].update(note="ünruhig, gähnt".replace(",", ""), flags="interrupted repeated", response="", correct="")
    _, codes = _read([_file(rows, line_end=line_end), _file(rating_rows(), line_end=line_end)])
    assert codes == {0: "P01", 1: "P01"}


def test_quoted_notes_take_the_quick_way_and_come_back_as_they_were() -> None:
    rows = trial_rows()
    said = 'he said "no",\r\nthen left; \'=1'
    rows[3]["note"] = columns.guard(said)
    blocks, codes = _read([_file(rows), _file(trial_rows())])
    assert codes == {0: "P01", 1: "P01"}
    assert _quickly(blocks[0], 0)["note"][3] == said


def test_a_guarded_code_is_left_to_the_careful_reader() -> None:
    rows = trial_rows()
    rows[0]["participant_id"] = "'P01"
    assert set(_read([_file(trial_rows()), _file(rows)])[1]) == {0}


def test_a_bad_file_among_many_leaves_the_others_on_the_quick_way() -> None:
    rows = trial_rows()
    rows[5]["response"] = "left"
    cut = _file(trial_rows())
    sources = [_file(trial_rows()), _file(rows), cut[:-40], cut]
    assert set(_read(sources)[1]) == {0, 3}


def test_files_with_bad_rows_among_many_leave_the_others_on_the_quick_way() -> None:
    good, ragged = _file(trial_rows()), _file(trial_rows()).replace(b",forward,", b",forward,,", 1)
    not_text, cr = good.replace(b"synthetic", b"synth\xe9tic", 1), good.replace(b"\r\n", b"\r", 3)
    assert set(_read([ragged, good, not_text, good, good, cr])[1]) == {1, 3, 4}


@pytest.mark.parametrize("bom_at", ["content", "first row"])
def test_a_byte_order_mark_is_left_to_the_careful_reader(bom_at: str) -> None:
    content = _file(trial_rows())
    bad = b"\xef\xbb\xbf" + content if bom_at == "content" else content.replace(b"\nP01", b"\n\xef\xbb\xbfP01", 1)
    assert set(_read([bad, content])[1]) == {1}


@pytest.mark.parametrize("name", ["note", "mood"])
def test_cells_too_long_for_the_careful_reader_are_left_to_it(name: str) -> None:
    rows = trial_rows()
    rows[3][name] = "x" * (csv.field_size_limit() + 1)
    header = [*columns.names("direction"), "mood"]
    assert set(_read([_bytes(rows, header), _bytes(trial_rows(), header)])[1]) == {1}


_DECIMALS = st.one_of(
    st.floats(0, 1e6).map(repr),
    st.decimals(0, 99, places=6).map(str),
    st.from_regex("[0-9.]{0,26}", fullmatch=True),
    st.sampled_from(["1" * 400, "nan", "inf", "-1", " 1", "1e00005", "+1"]),
)


@settings(max_examples=300)
@given(st.lists(_DECIMALS, min_size=1))
def test_decimals_are_read_to_the_last_bit_or_doubted(texts: list[str]) -> None:
    numbers, odd = log_cells.decimals(pa.array([text or None for text in texts], log_cells.TEXT))
    for row, (text, number) in enumerate(zip(texts, numbers.tolist(), strict=True)):
        assert row in odd or (number == float(text) if text else number != number)  # noqa: PLR0124 - NaN


def test_files_are_found_in_the_order_of_their_paths_and_links_once(tmp_path: Path) -> None:
    write_study(tmp_path / "a", participants=3)
    (tmp_path / "a-b").mkdir()
    write_rows(trials_path(tmp_path / "a-b", "P09"), trial_rows("P09"))
    linked = tmp_path / "a" / "zz_trials.csv"
    linked.symlink_to(trials_path(tmp_path / "a", "P02"))
    found, problems = find_logs([tmp_path])
    expected = sorted([*tmp_path.rglob("*_trials.csv"), *tmp_path.rglob("*_ratings.csv")])
    assert problems == []
    assert [Path(log) for log in found] == [path for path in expected if path != linked]
