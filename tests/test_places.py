import string
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.design.plan import Plan
from experiments.record import storage
from experiments.record.names import journals
from experiments.study.balance import used_rows
from experiments.study.folders import (
    Place,
    PlaceError,
    known_codes,
    place,
    set_aside,
)
from experiments.study.register import read_register
from tests.journals import write_head

RESULTS = Path("/nowhere/results")
EXPERIMENTS = ("direction", "preference")
LETTERS_AND_DIGITS = string.ascii_letters + string.digits
near_codes = st.text(st.sampled_from(LETTERS_AND_DIGITS + "./\\-_ \n\0éÄ٣²K"), max_size=34)


@pytest.mark.parametrize("code", ["P", "0", "P01", "p01", "x" * 32, LETTERS_AND_DIGITS[:32]])
def test_one_to_32_letters_and_digits_are_a_code(code: str) -> None:
    where = place(RESULTS, code, "direction")
    assert where.folder == RESULTS / f"sub-{code}"
    assert where.journal == where.folder / f"sub-{code}_task-direction_journal.jsonl"
    assert where.table == where.folder / f"sub-{code}_task-direction_trials.csv"


def test_experiments_have_files_of_their_own() -> None:
    assert place(RESULTS, "P01", "preference").table.name == "sub-P01_task-preference_ratings.csv"
    assert place(RESULTS, "P01", "preference").journal.name == "sub-P01_task-preference_journal.jsonl"


@pytest.mark.parametrize(
    "code",
    ["", "x" * 33, "x" * 5000, "../x", "..", ".", "a/b", "a\\b", "/etc", "a.b", "a b", " P01", "P01 ", "P-01", "P_01",
     "Ä", "٣", "²", "\u212a", "Ｐ01", "P01\n", "\nP01", "P01\r", "P01\0", "P\t1", "~", "$HOME", "*", "P01;", "'"],
)  # fmt: skip
def test_anything_else_is_refused_with_value_and_rule(code: str) -> None:
    with pytest.raises(PlaceError, match="must be 1 to 32 letters and digits") as refused:
        place(RESULTS, code, "direction")
    message = str(refused.value)
    assert repr(code[:40])[:-1] in message
    assert f"({len(code)} characters)" in message
    assert "\n" not in message
    assert len(message) < 300


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(st.text() | near_codes, st.sampled_from(EXPERIMENTS))
def test_no_text_leads_out_of_the_results_folder(code: str, experiment: str) -> None:
    try:
        where = place(RESULTS, code, experiment)
    except PlaceError:
        return
    assert where.folder.parent == RESULTS
    assert ".." not in where.folder.parts
    for file in (where.journal, where.table):
        assert file.parent == where.folder
        assert file.name.startswith(f"sub-{code}_task-{experiment}_")
        assert len(file.name) <= 255


@pytest.mark.parametrize(("known", "code"), [("P01", "p01"), ("abc", "ABC"), ("aBc", "AbC"), ("p1", "P1")])
def test_a_code_that_differs_from_a_known_one_in_case_alone_is_refused(tmp_path: Path, known: str, code: str) -> None:
    (tmp_path / f"sub-{known}").mkdir()
    with pytest.raises(PlaceError, match=f"'{code}' differs from '{known}' .* in case alone"):
        place(tmp_path, code, "direction")
    assert place(tmp_path, known, "preference").participant_id == known


def test_a_collision_is_found_beside_the_code_itself(tmp_path: Path) -> None:
    # a folder made by another program, or copied together from two machines
    (tmp_path / "sub-P01").mkdir()
    (tmp_path / "sub-p01").mkdir()
    with pytest.raises(PlaceError, match="in case alone"):
        place(tmp_path, "P01", "direction")


def test_known_codes_are_those_of_folders(tmp_path: Path) -> None:
    assert known_codes(tmp_path / "none", read_register(tmp_path / "none")) == []
    for name in ("sub-P02", "sub-P01", "other"):
        (tmp_path / name).mkdir()
    (tmp_path / "sub-P03").touch()
    assert known_codes(tmp_path, read_register(tmp_path)) == ["P01", "P02"]


# setting aside


def a_run(results: Path, text: str) -> Place:
    where = place(results, "P01", "direction")
    where.folder.mkdir(parents=True, exist_ok=True)
    where.journal.write_text(f"journal {text}")
    where.table.write_text(f"table {text}")
    return where


def test_set_aside_files_are_renamed_and_never_written_over(tmp_path: Path) -> None:
    for number in range(1, 13):
        aside = set_aside(a_run(tmp_path, str(number)))
        assert [file.name for file in aside] == [
            f"sub-P01_task-direction_journal.aside-{number}.jsonl",
            f"sub-P01_task-direction_trials.aside-{number}.csv",
        ]
    folder = place(tmp_path, "P01", "direction").folder
    assert sorted(file.read_text() for file in folder.iterdir()) == sorted(
        f"{kind} {number}" for kind in ("journal", "table") for number in range(1, 13)
    )


def test_the_files_of_one_run_get_one_number(tmp_path: Path) -> None:
    a_run(tmp_path, "without a table").table.unlink()
    set_aside(place(tmp_path, "P01", "direction"))
    assert [file.name.split(".")[1] for file in set_aside(a_run(tmp_path, "2"))] == ["aside-2", "aside-2"]


def test_setting_aside_what_is_not_there_does_nothing(tmp_path: Path) -> None:
    assert set_aside(place(tmp_path, "P01", "direction")) == []
    where = a_run(tmp_path, "1")
    where.table.unlink()
    assert [file.suffix for file in set_aside(where)] == [".jsonl"]


def test_set_aside_leaves_the_other_experiment_alone(tmp_path: Path) -> None:
    where = a_run(tmp_path, "1")
    other = place(tmp_path, "P01", "preference")
    other.journal.write_text("other")
    set_aside(where)
    assert other.journal.read_text() == "other"


def test_a_folder_is_set_aside_as_a_whole(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / "study").mkdir()
        (tmp_path / "study" / "file").write_text(str(number))
        assert (storage.set_aside_file(tmp_path / "study") / "file").read_text() == str(number)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["study.aside-1", "study.aside-2"]


# rows that are taken


def a_head(results: Path, code: str, row: int | None, experiment: str = "direction") -> Place:
    where = place(results, code, experiment)
    where.folder.mkdir(parents=True, exist_ok=True)
    write_head(where.journal, Plan(experiment=experiment, participant_id=code, seed=1, order_row=row, trials=()))
    with where.journal.open("ab") as file:
        file.write(b'{"n":1,"ki')
    return where


def test_rows_are_taken_by_runs_that_began_even_if_their_journal_is_cut(tmp_path: Path) -> None:
    for code, row in (("P01", 0), ("P02", 3), ("P03", None)):
        a_head(tmp_path, code, row)
    a_head(tmp_path, "P01", 5, "preference")
    assert used_rows(tmp_path, "direction", read_register(tmp_path)) == [0, 3]
    assert used_rows(tmp_path, "preference", read_register(tmp_path)) == [5]
    assert used_rows(tmp_path / "none", "direction", read_register(tmp_path / "none")) == []


def test_a_run_that_was_set_aside_gives_its_row_back(tmp_path: Path) -> None:
    where = a_head(tmp_path, "P01", 0)
    a_head(tmp_path, "P02", 1)
    set_aside(where)
    assert used_rows(tmp_path, "direction", read_register(tmp_path)) == [1]
    assert [file.parent.name for file in journals(tmp_path, "direction")] == ["sub-P02"]
