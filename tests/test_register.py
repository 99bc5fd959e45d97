"""The register of participants: what is acknowledged stays, what was changed is noticed, no name gets in."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.clock import VirtualClock
from experiments.record import storage
from experiments.study import register
from experiments.study.folders import PlaceError, known_codes, place
from experiments.study.register import (
    REGISTER_FILE,
    Register,
    RegisterEntry,
    RegisterError,
    append,
    entry,
    read_register,
)
from tests.waiting import PATIENCE_S

ROOT = Path(__file__).parent.parent
FACTS = {"age_years": 25, "sex": "female", "handedness": "right"}


def joined(code: str, **changes: object) -> RegisterEntry:
    return entry("joined", code, facts=FACTS | changes)


ENTRIES = (
    joined("P01"),
    entry("excluded", "P02", reason="felt ill – “stopped”"),
    joined("P02", age_years=29, sex="undisclosed"),
    entry("left", "P02", reason="moved away"),
    entry("readmitted", "P02", reason="came back"),
    joined("P01", age_years=26),
)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    for one in ENTRIES:
        append(tmp_path / "results", one, VirtualClock())
    return tmp_path / "results"


def lines_of(results: Path) -> list[bytes]:
    return (results / REGISTER_FILE).read_bytes().splitlines(keepends=True)


# what is written is read


def test_what_was_appended_is_read_in_its_order(results: Path) -> None:
    found = read_register(results)
    assert tuple(one for _, one in found.entries) == ENTRIES
    assert found.problem == ""
    assert all(utc.endswith("Z") for utc, _ in found.entries)


def test_a_folder_without_a_register_has_nobody(tmp_path: Path) -> None:
    assert read_register(tmp_path).members == {}
    assert read_register(tmp_path).excluded() == {}
    assert not list(tmp_path.iterdir())


def test_the_register_is_for_its_owner_alone(results: Path) -> None:
    assert stat.S_IMODE((results / REGISTER_FILE).stat().st_mode) == 0o600
    assert stat.S_IMODE(results.stat().st_mode) == 0o700


def test_a_later_joined_record_corrects_the_facts_and_keeps_the_day(results: Path) -> None:
    found = read_register(results)
    assert found.members["P01"].facts == joined("P01", age_years=26).facts  # type: ignore[union-attr]
    assert found.members["P01"].joined_utc == found.entries[0][0]


def test_who_joins_with_the_facts_on_record_is_not_written_again(results: Path) -> None:
    before = lines_of(results)
    append(results, joined("P01", age_years=26), VirtualClock())
    assert lines_of(results) == before
    append(results, joined("P01"), VirtualClock())  # a correction back is one
    assert len(lines_of(results)) == len(before) + 1


def test_the_last_exclusion_or_readmission_counts(results: Path) -> None:
    assert read_register(results).excluded() == {}
    append(results, entry("excluded", "P02", reason="left for good"), VirtualClock())
    assert read_register(results).excluded() == {"P02": "left for good"}


codes = st.sampled_from(["P01", "P02", "P03"])
any_entry = st.one_of(
    st.builds(lambda code, age: joined(code, age_years=age), codes, st.integers(1, 120)),
    st.builds(lambda code: entry("excluded", code, reason="r"), codes),
    st.builds(lambda code: entry("left", code, reason="r"), codes),
    st.builds(lambda code: entry("readmitted", code, reason="r"), codes),
    st.builds(lambda code: entry("set-aside", code, experiment="direction", reason="r"), codes),
)


@pytest.mark.slow
@given(st.lists(any_entry))
def test_the_state_of_a_code_is_what_its_own_last_records_say(entries: list[RegisterEntry]) -> None:
    found = Register(path=Path(REGISTER_FILE), entries=tuple(("2026-01-01T00:00:00Z", one) for one in entries)).members
    assert set(found) == {one.participant_id for one in entries}
    for code, member in found.items():
        facts = [one.facts for one in entries if one.participant_id == code and isinstance(one, register.Joined)]
        kinds = [one.kind for one in entries if one.participant_id == code and one.kind not in ("joined", "set-aside")]
        assert member.facts == (facts[-1] if facts else None)
        for said, kind in ((member.excluded, "excluded"), (member.left, "left")):
            assert (said is not None) == ([one for one in kinds if one in (kind, "readmitted")][-1:] == [kind])


# what breaks a rule is refused


@pytest.mark.parametrize("reason", ["", "  ", "two\nlines", "bell\x07", "\x1b[31mred", "x" * 201, "\udc80", None, 7])
def test_a_reason_is_one_short_line(reason: object) -> None:
    with pytest.raises(RegisterError, match="reason = ") as refused:
        entry("excluded", "P01", reason=reason)
    assert len(str(refused.value)) < 250


@pytest.mark.parametrize("code", ["", "x" * 33, "Jane Doe", "a/b", "..", "P01\n", "É", None])
def test_a_code_is_letters_and_digits(code: str) -> None:
    with pytest.raises(RegisterError, match="participant_id = "):
        entry("joined", code, facts={})


@pytest.mark.parametrize(
    ("fact", "value"),
    [("age_years", 0), ("age_years", 121), ("age_years", 25.5), ("age_years", "25"), ("age_years", True),
     ("sex", "Female"), ("sex", ""), ("handedness", "ambidextrous"), ("name", "Jane")],
)  # fmt: skip
def test_a_fact_outside_its_levels_or_unknown_is_refused(fact: str, value: object) -> None:
    with pytest.raises(RegisterError, match=f"facts.{fact} = "):
        joined("P01", **{fact: value})


def test_an_unknown_kind_or_key_is_refused() -> None:
    with pytest.raises(RegisterError, match="kind"):
        entry("renamed", "P01")
    with pytest.raises(RegisterError, match="name = 'Jane'"):
        entry("excluded", "P01", reason="ill", name="Jane")


def test_a_code_that_differs_from_a_registered_one_in_case_alone_is_refused(results: Path) -> None:
    before = lines_of(results)
    with pytest.raises(RegisterError, match=r"'p01' differs from 'P01' .* in case alone"):
        append(results, joined("p01"), VirtualClock())
    assert lines_of(results) == before
    assert known_codes(results, read_register(results)) == ["P01", "P02"]
    with pytest.raises(PlaceError, match="in case alone"):
        place(results, "p02", "direction")


# what was cut off or changed


@pytest.mark.slow
def test_a_register_cut_off_at_any_byte_holds_its_whole_records_and_can_be_gone_on_with(results: Path) -> None:
    data = (results / REGISTER_FILE).read_bytes()
    for length in range(len(data)):
        (results / REGISTER_FILE).write_bytes(data[:length])
        found = read_register(results)
        assert found.problem == ""
        assert tuple(one for _, one in found.entries) == ENTRIES[: data[:length].count(b"\n")]
    append(results, joined("P09"), VirtualClock())
    assert [one.participant_id for _, one in read_register(results).entries] == ["P01", *["P02"] * 4, "P09"]


@pytest.mark.slow
@settings(max_examples=200)
@given(st.data())
def test_a_byte_changed_before_the_last_record_is_noticed_and_named(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for one in ENTRIES:
            append(Path(folder), one, VirtualClock())
        file = Path(folder) / REGISTER_FILE
        content = bytearray(file.read_bytes())
        place_in_file = data.draw(st.integers(0, content.rindex(b"\n", 0, -1) - 1))
        content[place_in_file] = data.draw(st.integers(0, 255).filter(lambda byte: byte != content[place_in_file]))
        file.write_bytes(content)
        found = read_register(Path(folder))
        assert f"{REGISTER_FILE}: line " in found.problem
        assert len(found.entries) < len(ENTRIES)
        with pytest.raises(RegisterError, match="restore it from a copy"):
            read_register(Path(folder)).excluded()
        with pytest.raises(RegisterError, match="restore it from a copy"):
            append(Path(folder), joined("P09"), VirtualClock())
        assert file.read_bytes() == content


@pytest.mark.parametrize("line", [b"{}", b"[]", b"7", b"\xff", b"[" * 100_000, b'{"n":0,"link":"","kind":"joined"}'])
def test_a_line_that_is_no_record_is_a_problem_with_its_place(tmp_path: Path, line: bytes) -> None:
    (tmp_path / REGISTER_FILE).write_bytes(line + b"\n")
    assert read_register(tmp_path).problem.startswith(f"{tmp_path / REGISTER_FILE}: line 1: ")


def test_a_damaged_register_still_gives_the_codes_before_the_damage(results: Path) -> None:
    (results / REGISTER_FILE).write_bytes(b"".join([*lines_of(results)[:2], b"damage\n"]))
    assert known_codes(results, read_register(results)) == ["P01", "P02"]


# the disk and other programs


def test_a_register_that_cannot_be_read_or_made_is_one_message(tmp_path: Path) -> None:
    (tmp_path / REGISTER_FILE).mkdir()
    assert "cannot be read" in read_register(tmp_path).problem
    with pytest.raises(RegisterError, match="nothing was added"):
        append(tmp_path, joined("P01"), VirtualClock())
    (tmp_path / "file").touch()
    with pytest.raises(RegisterError, match="nothing was added"):
        append(tmp_path / "file" / "results", joined("P01"), VirtualClock())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_that_is_called_a_register_keeps_nobody_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / REGISTER_FILE)
    assert "cannot be read (it is a pipe or a device, not a file)" in read_register(tmp_path).problem


def test_a_register_held_by_another_program_is_waited_for_and_then_left(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(register, "_PATIENCE_S", 0.1)
    holder = storage.reopen(results / REGISTER_FILE)
    assert storage.hold(holder)
    before = lines_of(results)
    with pytest.raises(RegisterError, match="another program has held it"):
        append(results, joined("P09"), VirtualClock())
    assert len(read_register(results).entries) == len(ENTRIES)  # reading never waits
    os.close(holder)
    append(results, joined("P09"), VirtualClock())
    assert lines_of(results)[:-1] == before


APPEND = """
import resource, signal, sys
from pathlib import Path
from experiments.clock import RealClock
from experiments.study.register import append, entry
console, count, limit = sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
if limit:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
for number in range(count):
    append(Path(sys.argv[1]), entry("joined", f"{console}{number:02d}", facts={}), RealClock())
"""


def appending(results: Path, console: str, count: int, limit: int = 0) -> subprocess.Popen[str]:
    words = [sys.executable, "-c", APPEND, str(results), console, str(count), str(limit)]
    return subprocess.Popen(words, cwd=ROOT, stderr=subprocess.PIPE, text=True)


@pytest.mark.slow
def test_consoles_that_write_at_once_neither_lose_nor_tear_a_record(tmp_path: Path) -> None:
    consoles = [appending(tmp_path / "results", name, 20) for name in "ABCD"]
    for console in consoles:
        _, said = console.communicate(timeout=PATIENCE_S)
        assert (console.returncode, said) == (0, "")
    found = read_register(tmp_path / "results")
    assert found.problem == ""
    for name in "ABCD":
        own = [one.participant_id for _, one in found.entries if one.participant_id.startswith(name)]
        assert own == [f"{name}{number:02d}" for number in range(20)]


@pytest.mark.slow
def test_somebody_who_joins_at_several_consoles_at_once_is_on_record_once(tmp_path: Path) -> None:
    consoles = [appending(tmp_path / "results", "A", 20) for _ in range(3)]
    for console in consoles:
        _, said = console.communicate(timeout=PATIENCE_S)
        assert (console.returncode, said) == (0, "")
    found = read_register(tmp_path / "results")
    assert [one.participant_id for _, one in found.entries] == [f"A{number:02d}" for number in range(20)]


@pytest.mark.slow
def test_a_full_disk_is_said_and_leaves_whole_records(results: Path) -> None:
    before = (results / REGISTER_FILE).read_bytes()
    full = appending(results, "A", 1, limit=len(before) + 40)
    _, said = full.communicate(timeout=PATIENCE_S)
    assert full.returncode == 1
    assert "cannot be written" in said
    assert (results / REGISTER_FILE).read_bytes() == before
