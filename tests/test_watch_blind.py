"""Whoever watches a run reads no answer, whatever is damaged in its journal: also not in what is said of the damage."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from experiments.config.setup import sha256
from experiments.record.journal import JournalError
from experiments.watch.feed import MarkerFeed
from experiments.watch.folder import FolderWatch
from experiments.watch.page import page_parts
from tests.journals import forged, raw

pytestmark = pytest.mark.slow

Entry = dict[str, Any]
Way = tuple[str | int, ...]
"""The keys and numbers that lead to a field."""

WORDS = "secret" + '反冲很自然，像真枪一样；it\'s "like" 真的，' * 12
"""A comment that messages cut, with quotes of both kinds."""
NUMBER = 8.765432
TELLTALES = ("secret", "反冲", str(NUMBER))
SHOWN = ("cause", "reason", "because", "by")
"""What the page shows as it stands: who did it, and the reasons for a stop or a fault."""
CHANGES = (None, "sideways", WORDS, [WORDS], NUMBER)


@pytest.fixture(scope="module")
def answered(reproduction: Path) -> list[Entry]:
    """A run of ratings and comments, each of them recognisable, with notes and corrections; of its shots the first."""
    kept = list[Entry]()
    for entry in raw(reproduction / "logs" / "sub-P01" / "sub-P01_task-preference_journal.jsonl"):
        body = entry.get("body", {})
        if entry["kind"] == "shot" and body["shot"] > 2:
            continue
        kept.append(entry)
        if body.get("kind") == "answered":
            body["value"] = WORDS if isinstance(body["value"], str) else NUMBER
            kept += [entry | {"kind": "remark", "body": remark} for remark in _remarks(kept[-2]["body"], body["value"])]
    return kept


def _remarks(asked: Entry, value: object) -> Iterator[Entry]:
    """What else may hold an answer."""
    yield {"kind": "corrected", "trial": asked["trial"], "question": asked["question"], "value": value}
    yield {"kind": "noted", "trial": asked["trial"], "text": WORDS}
    refused = {"event": "rating", "state": "rating", "because": "", "by": "participant"}
    yield {"kind": "refused", **refused, "answer": value}


def ways(value: object, way: Way = ()) -> Iterator[Way]:
    """The ways to all fields, in tables and lists inside too."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inner:
        yield (*way, key)
        yield from ways(one, (*way, key))


def damaged(entry: Entry, way: Way) -> Iterator[Entry]:
    """A record in which one field is another, is missing, or has another name."""
    for change in CHANGES:
        if way[-1] not in SHOWN or not isinstance(change, str):
            found, table = _copied(entry, way)
            table[way[-1]] = change
            yield found
    found, table = _copied(entry, way)
    before = table.pop(way[-1])
    yield found
    if isinstance(table, dict):
        renamed, table = _copied(entry, way)
        del table[way[-1]]
        table[WORDS] = before
        yield renamed


def _copied(entry: Entry, way: Way) -> tuple[Entry, Any]:
    """A record of its own, and what in it holds the field."""
    found = deepcopy(entry)
    table: Any = found
    for key in way[:-1]:
        table = table[key]
    return found, table


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    folder = tmp_path / "results" / "sub-P01"
    folder.mkdir(parents=True)
    return folder / "sub-P01_task-preference_journal.jsonl"


def page(journal: Path, data: bytes) -> str:
    """All that the page has of a journal."""
    journal.write_bytes(data)
    seen = FolderWatch(journal.parent.parent).look()
    assert seen is not None
    return " ".join(page_parts(seen))


def check_blind(journal: Path, data: bytes, what: object) -> None:
    shown = page(journal, data)
    assert not [one for one in TELLTALES if one in shown], (what, shown)


def kind_of(entry: Entry) -> object:
    body = entry.get("body", {})
    return entry["kind"], body.get("kind"), type(body.get("value", body.get("answer")))


def test_no_answer_is_shown_whichever_field_of_a_record_is_damaged(answered: list[Entry], journal: Path) -> None:
    assert "finished" in page(journal, forged(answered))
    for n in {kind_of(entry): n for n, entry in enumerate(answered)}.values():  # one record of each kind
        fields = {key: value for key, value in answered[n].items() if key not in ("n", "link", "plan", "setup")}
        for way in ways(fields):
            for entry in damaged(answered[n], way):
                check_blind(journal, forged([*answered[:n], entry, *answered[n + 1 : n + 5]]), (n, way))


def test_no_answer_is_shown_whichever_key_of_the_design_in_it_is_damaged(answered: list[Entry], journal: Path) -> None:
    head = answered[0]
    for way in ways({"setup": {"experiment": head["setup"]["experiment"]}}):
        for entry in damaged(head, way):
            whole = entry | {"setup_sha256": sha256(entry.get("setup"))}
            check_blind(journal, forged([whole]), way)


@pytest.mark.parametrize(
    "value", ["NaN", "1e999", "8.765432e999", '"secret', '"secret\\x"', '"secret\\ud83d"', '"secret" 1']
)
def test_no_answer_is_shown_of_a_line_that_is_no_json(value: str, answered: list[Entry], journal: Path) -> None:
    n = max(n for n, entry in enumerate(answered) if entry.get("body", {}).get("kind") == "answered")
    lines = forged(answered[: n + 1]).splitlines(keepends=True)
    lines[-1] = lines[-1].replace(json.dumps(WORDS, ensure_ascii=False).encode(), value.encode())
    check_blind(journal, b"".join(lines), value)
    expected = f"line {n + 1}: not a JSON record (…); it was changed or damaged"
    assert expected in page(journal, b"".join(lines))
    assert terminal(journal, b"".join(lines)) == f"{journal}: {expected}; no more markers of this run"


def terminal(journal: Path, data: bytes) -> str:
    """What is said on the terminal of the markers of a run."""
    said = list[str]()
    journal.unlink()
    feed = MarkerFeed(journal.parent.parent, said.append)
    journal.write_bytes(data)
    feed.find()
    feed.look()
    return "\n".join(said)


def test_no_answer_stands_on_the_terminal_of_the_markers(answered: list[Entry], journal: Path) -> None:
    journal.touch()
    for n in {kind_of(entry): n for n, entry in enumerate(answered)}.values():
        for entry in [one for way in ways(answered[n].get("body", {})) for one in damaged(answered[n], ("body", *way))]:
            said = terminal(journal, forged([*answered[:n], entry, *answered[n + 1 : n + 5]]))
            assert not [one for one in TELLTALES if one in said], (n, said)


def test_the_watch_shows_place_and_rule_without_the_value_and_of_other_errors_nothing() -> None:
    error = JournalError("value … is no answer; it was changed", at="a.jsonl: line 7", value="'secret'")
    assert str(error) == "a.jsonl: line 7: value 'secret' is no answer; it was changed"
    assert error.shown == "a.jsonl: line 7: value … is no answer; it was changed"
    assert JournalError("a.jsonl: line 7: value 'secret' is no answer").shown == ""
