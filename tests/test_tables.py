import csv
import io

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from experiments.design.plan import Plan
from experiments.design.planning import plan_of
from experiments.load import load_setup
from experiments.record import tables
from experiments.record.design_columns import columns
from experiments.record.design_table import design_rows
from experiments.record.tables import Row, guard, table_bytes, unguard
from experiments.session.remarks import EntryCorrected
from experiments.session.steps import (
    Answered,
    FireShot,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Presented,
    Rest,
    Rested,
    Step,
)
from tests.asked import ask, describe, rate
from tests.driven_designs import FAILED, FELT, FIRED, UNFELT

FORMULA_STARTS = tuple("=+-@\t\r")
DESIGNS = {name: load_setup(name).config for name in ("direction", "preference")}
DIRECTION: Plan = plan_of(DESIGNS["direction"], "P01", 1)
PREFERENCE: Plan = plan_of(DESIGNS["preference"], "P01", 1)
anything = st.text(st.characters(codec="utf-8"))
awkward = st.text(st.sampled_from("=+-@\t\r\n'\"; ,aé\0"), max_size=8)


def read(data: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(data.decode("utf-8"), newline=""), strict=True))


# text that no spreadsheet takes for a formula


@settings(deadline=None)
@given(anything | awkward)
@example("'")
@example("''=1")
def test_any_text_is_read_back_and_never_starts_like_a_formula(text: str) -> None:
    assert unguard(guard(text)) == text
    assert not guard(text).startswith(FORMULA_STARTS)


@pytest.mark.slow
@settings(deadline=None)
@given(st.lists(st.tuples(anything | awkward, anything | awkward), max_size=5))
def test_any_comment_and_note_survive_the_table(texts: list[tuple[str, str]]) -> None:
    rows = [{"participant_id": "P01", "comment": comment, "note": note} for comment, note in texts]
    cells = read(table_bytes(columns(DESIGNS["preference"]), rows))
    assert [(unguard(row["comment"]), unguard(row["note"])) for row in cells] == texts
    assert not any(cell.startswith(FORMULA_STARTS) for row in cells for cell in row.values())


@settings(deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False), st.integers())
def test_numbers_are_written_as_they_are_negative_ones_too(number: float, count: int) -> None:
    [row] = read(table_bytes(tables.TABLES["preference"], [{"rating": number, "shots": count}]))
    assert float(row["rating"]) == number
    assert row["shots"] == str(count)


def test_a_negative_number_gets_no_apostrophe() -> None:
    [row] = read(table_bytes(tables.TABLES["direction"], [{"response_time_s": -0.25, "trial": -1}]))
    assert (row["response_time_s"], row["trial"]) == ("-0.25", "-1")


def test_text_is_guarded_in_every_column_of_words_and_levels_and_in_no_other() -> None:
    for experiment, table in tables.TABLES.items():
        [row] = read(table_bytes(tables.TABLES[experiment], [{column.name: "=1" for column in table}]))
        words = {column.name for column in table if column.type in ("text", "level")}
        assert {name for name, cell in row.items() if cell == "'=1"} == words
        assert {name for name, cell in row.items() if cell == "=1"} == {column.name for column in table} - words


# RFC 4180


@pytest.mark.parametrize("experiment", ["direction", "preference"])
def test_lines_end_with_cr_lf_and_the_first_one_names_the_columns(experiment: str) -> None:
    data = table_bytes(tables.TABLES[experiment], [{}, {}])
    assert data.endswith(b"\r\n")
    assert data.count(b"\r\n") == data.count(b"\n") == 3
    assert data.split(b"\r\n")[0].decode() == ",".join(tables.names(experiment))


def test_quotes_are_doubled_and_line_ends_stay_within_quotes() -> None:
    data = table_bytes(tables.TABLES["preference"], [{"comment": 'so "soft",\nnice'}])
    assert b'"so ""soft"",\nnice"' in data


def test_text_is_utf_8_without_a_byte_order_mark() -> None:
    data = table_bytes(tables.TABLES["preference"], [{"comment": "weich – schön"}])
    assert "weich – schön".encode() in data
    assert data.startswith(b"participant_id")


def test_missing_is_empty_and_0_stays_0() -> None:
    [row] = read(table_bytes(tables.TABLES["preference"], [{"rating": None, "shots": 0, "exposure_s": 0.0}]))
    assert (row["rating"], row["shots"], row["exposure_s"], row["comment"]) == ("", "0", "0.0", "")


def test_the_columns_of_the_contract_come_in_its_order() -> None:
    assert tables.names("direction")[:13] == [
        "participant_id", "experiment", "session", "method", "set", "trial", "direction", "response", "correct",
        "response_time_s", "response_source", "response_time_valid", "attempts",
    ]  # fmt: skip
    assert tables.names("preference")[:7] == [
        "participant_id", "experiment", "trial", "method", "rating", "rating_by", "comment"
    ]  # fmt: skip


# rows from what was done

PLANNED = ("participant_id", "experiment", "session", "method", "set", "trial", "direction")


def told(place: int, *outcomes: tuple[str, Outcome]) -> list[tuple[Step, Outcome]]:
    """What happened to the trial at a place of the plan of experiment 1."""
    trial = DIRECTION.trials[place]
    steps = {
        "prepare": Prepare(trial=trial, attempt=1),
        "fire": FireShot(trial=trial, attempt=1),
        "ask": ask(trial),
    }
    return [(steps[name], outcome) for name, outcome in outcomes]


def answer(response: str) -> Answered:
    return Answered(value=response, by="experimenter", response_time_s=0.0, response_time_valid=False)


def written(history: list[tuple[Step, Outcome]]) -> list[dict[str, str]]:
    return read(table_bytes(columns(DESIGNS["direction"]), design_rows(DIRECTION, history, DESIGNS["direction"])))


def test_trials_that_were_not_reached_have_a_row_with_the_plan_and_no_more() -> None:
    rows = written([])
    assert len(rows) == 60
    assert all(row[name] for row in rows for name in PLANNED)
    assert not any(cell for row in rows for name, cell in row.items() if name not in PLANNED)


def test_rows_come_in_the_order_of_the_plan() -> None:
    keys = [(int(row["session"]), int(row["set"]), int(row["trial"])) for row in written([])]
    assert keys == sorted(keys)
    assert [row["direction"] for row in written([])] == [trial.direction for trial in DIRECTION.trials]


@pytest.mark.parametrize("response", ["forward", "backward"])
def test_an_answer_is_correct_if_it_is_the_direction(response: str) -> None:
    row = written(told(3, ("prepare", Prepared()), ("fire", FIRED), ("ask", answer(response))))[3]
    assert row["response"] == response
    assert row["correct"] == ("1" if response == DIRECTION.trials[3].direction else "0")
    assert (row["response_time_s"], row["response_time_valid"], row["response_source"]) == ("0.0", "0", "experimenter")
    assert (row["attempts"], row["flags"], row["gun"]) == ("1", "", "simulated")


@pytest.mark.parametrize(
    ("outcomes", "attempts", "flags"),
    [
        ((("prepare", UNFELT),), "", ""),
        ((("prepare", Prepared()), ("fire", UNFELT)), "", ""),
        ((("prepare", Prepared()), ("fire", FELT)), "1", "interrupted"),
        ((("fire", FAILED), ("fire", FIRED), ("ask", answer("forward"))), "2", "device-error"),
        ((("fire", FIRED), ("ask", FELT), ("fire", FIRED), ("ask", answer("forward"))), "2", "interrupted"),
        ((("fire", FAILED), ("fire", FAILED), ("fire", FELT), ("fire", FIRED)), "4", "device-error interrupted"),
        ((("fire", UNFELT), ("fire", FIRED), ("ask", answer("backward"))), "1", ""),
    ],
)
def test_attempts_count_stimuli_that_may_have_been_felt_and_flags_say_why_there_were_more(
    outcomes: tuple[tuple[str, Outcome], ...], attempts: str, flags: str
) -> None:
    row = written(told(0, *outcomes))[0]
    assert (row["attempts"], row["flags"]) == (attempts, flags)


def test_an_answer_is_flagged_corrected_only_if_what_counts_is_a_correction() -> None:
    given = told(0, ("fire", FIRED), ("ask", answer("forward")))
    corrected = (None, EntryCorrected(trial=DIRECTION.trials[0], question="response", value="backward"))
    assert written([*given, corrected])[0]["flags"] == "corrected"
    assert written([*given, corrected, *given])[0]["flags"] == ""


def test_what_happens_to_one_trial_or_in_a_break_shows_in_no_other_row() -> None:
    rest = (Rest(between="sets", duration_s=20.0), Rested(rested_s=1.0, cut_reason="=skip"))
    rows = written([*told(4, ("fire", FIRED), ("ask", answer("forward"))), rest])
    assert [number for number, row in enumerate(rows) if row["response"] or row["attempts"]] == [4]


@pytest.mark.parametrize(("rating", "cell"), [(0.0, "0.0"), (7.3, "7.3"), (10, "10"), (None, "")])
def test_a_rating_of_0_is_written_and_none_leaves_the_cell_empty(rating: float | None, cell: str) -> None:
    trial = PREFERENCE.trials[1]
    shown = Presented(gun="simulated", onset_utc="t", shots=12, exposure_s=11.5, ended_by="next")
    history = [
        (Present(trial=trial, attempt=1, repeat_every_s=1.0, max_shots=120, least_exposure_s=1.0), shown),
        (rate(trial), Answered(value=rating, by="participant")),
        (describe(trial), Answered(value="-soft", by="experimenter")),
    ]
    rows: list[Row] = design_rows(PREFERENCE, history, DESIGNS["preference"])
    first, row, last = read(table_bytes(columns(DESIGNS["preference"]), rows))
    assert (row["rating"], row["rating_by"], row["comment"]) == (cell, "participant", "'-soft")
    assert (row["shots"], row["exposure_s"], row["attempts"]) == ("12", "11.5", "1")
    planned = ("participant_id", "experiment", "trial", "method")
    assert not any(other[name] for other in (first, last) for name in other if name not in planned)
