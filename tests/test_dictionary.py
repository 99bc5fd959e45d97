from pathlib import Path

from experiments.record import tables
from experiments.record.dictionary import dictionary

PAGE = Path(__file__).parent.parent / "DATA_DICTIONARY.md"


def test_the_committed_page_is_what_the_columns_say() -> None:
    assert PAGE.read_text(encoding="utf-8") == dictionary()


def test_every_column_has_a_meaning() -> None:
    assert all(column.description for table in tables.TABLES.values() for column in table)


def test_the_columns_of_the_contract_come_first_and_in_order() -> None:
    contract = (
        "participant_id, experiment, session, method, set, trial, direction, response, correct, response_time_s, "
        "response_source, response_time_valid, attempts, flags, note"
    )
    assert ", ".join(tables.names("direction")).startswith(contract)
    assert ", ".join(tables.names("preference")).startswith(
        "participant_id, experiment, trial, method, rating, rating_by, comment"
    )
