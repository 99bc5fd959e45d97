"""Nothing runs away at the door: files, keys, nestings, patterns and messages have bounds, and say so."""

from __future__ import annotations

from pathlib import Path

import pytest

from analysis.logs.column_map import ColumnMap
from analysis.logs.patterns import group_in, holding
from analysis.logs.reading import read_logs
from analysis.paper.audit.run import PaperFile, load_paper_file
from analysis.summary.remarks_coding import Codebook
from device.messages import RecoilError, few_of_each
from experiments.config.door import ConfigError, checked_table, tables

BOMB, CAMEL = "(a+)+$", "a" * 5_000 + "!"


def test_keys_and_text_with_points_are_taken() -> None:
    found = tables('[a.b."c.d"]\ne.f = "www.' + ". ".join(["some text"] * 50) + '"', "some.toml")
    assert list(found["a"]["b"]["c.d"]["e"]) == ["f"]


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        ("a{99999999999}", "multiply to at most 100"),
        ("((a{5}){5}){5}", "multiply to at most 100"),
        ("(" * 600, "rule: at most 500"),
        ("(" * 21 + ")" * 21, "21 groups"),
        ("stab(", "no regular expression"),
        ("(?=a)", "no regular expression"),
        (r"(a)\\1", "no regular expression"),
    ],
)
def test_patterns_beyond_reason_are_refused(pattern: str, said: str) -> None:
    book = {"codes": [{"code": "a", "label": "A", "pattern": pattern.replace("\\\\", "\\")}]}
    with pytest.raises(ConfigError, match=said):
        checked_table(Codebook, book, "codes.toml")


def test_a_map_refuses_such_patterns_too() -> None:
    table = {
        "experiment": "preference",
        "participant": {"file_name": "(a{99999999999})"},
        "columns": {"method": "m", "rating": "r"},
    }
    with pytest.raises(ConfigError, match="multiply to at most 100"):
        checked_table(ColumnMap, table, "map.toml")


def test_a_pattern_that_would_go_back_for_ever_does_not() -> None:
    """Python's `re` takes 2^5000 steps for these."""
    assert not holding(CAMEL, BOMB)
    assert group_in(CAMEL, "(?:a+)+(b)") is None
    assert holding("Die Äpfel", "äpfel|birnen")


def test_a_value_in_a_message_is_cut_at_200_characters() -> None:
    said = str(RecoilError(f"a.csv: {'9' * 5_000!r} is no trial, nor is {'7' * 5_000}; it's a long way"))
    assert "(5000 characters)" in said
    assert len(said) < 520
    assert said.endswith("it's a long way")
    name = "x" * 255
    assert name in str(RecoilError(f"/somewhere/{name}: cannot be read"))


def test_of_like_findings_five_are_said_and_the_rest_counted(tmp_path: Path) -> None:
    path = tmp_path / "paper.toml"
    path.write_text('[[claims]]\nplace = "I"\nquote = "x"\nkind = "grim"\nmean = 5.2\nn = 28\n' * 200, encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        load_paper_file(path)
    lines = str(refused.value).splitlines()
    assert len(lines) == 6
    assert lines[4].startswith(f"{path}:29: claims.4.mean = 5.2")
    assert lines[5] == "... and 195 more like them"


@pytest.mark.slow
def test_a_hundred_thousand_findings_are_soon_said() -> None:
    with pytest.raises(ConfigError) as refused:
        checked_table(PaperFile, {"claims": [1] * 100_000}, "paper.toml")
    assert str(refused.value).splitlines()[5:] == ["... and 1995 more like them", "... and 98000 more"]


def test_a_log_of_a_million_rows_is_refused_with_the_bound(tmp_path: Path) -> None:
    (tmp_path / "sub-P01_task-direction_trials.csv").write_bytes(b"participant_id,trial\n" + b"P01,1\n" * 1_000_000)
    (tmp_path / "sub-P01_task-grip_trials.csv").write_bytes(b"participant_id,trial\n" + b"P01,1\n" * 1_000_000)
    said = [problem.message for problem in read_logs([tmp_path]).problems]
    assert len(said) == 2
    assert all("more than 100,000 rows" in one for one in said)


@pytest.mark.slow
@pytest.mark.parametrize(("rows", "said"), [(1_000_000, "more than 400,000 rows"), (100_001, "100,001 rows")])
def test_so_is_one_that_a_map_reads(tmp_path: Path, rows: int, said: str) -> None:
    (tmp_path / "a.csv").write_bytes(b"who,m,r\n" + b"P01,a,5\n" * rows)
    mapping = checked_table(
        ColumnMap,
        {"experiment": "preference", "participant": {"column": "who"}, "columns": {"method": "m", "rating": "r"}},
        "map.toml",
    )
    assert said in read_logs([tmp_path / "a.csv"], mapping=mapping).problems[0].message


def test_like_problems_of_files_are_counted_by_what_is_wrong() -> None:
    said = [f"logs/sub-P{n}/a.csv, line {n}, column set: '{n}' is not allowed" for n in range(200)]
    assert list(few_of_each([*said, "b.csv: is empty"]))[5:7] == [
        "b.csv: is empty",
        "... and 195 more like it (is not allowed)",
    ]


def test_of_like_problems_only_a_clause_without_holes_is_repeated() -> None:
    def last(*said: str) -> str:
        return [*few_of_each(["b.csv: is empty", *said])][-1]

    copies = (f"left out: /x/{n}.csv: holds what y/{n}.csv holds (rule: a run counts once); read one" for n in range(9))
    assert last(*copies) == "... and 4 more like it (read one)"
    kinds = (f"left out: /x/{n}.csv: is of synthetic people (rule: never together); read it apart" for n in range(9))
    assert last(*kinds) == "... and 4 more like it (is of synthetic people)"
    begun = (f"P{n} has begun preference and not finished it ({n} of 3); go on as P{n} (or {n})" for n in range(9))
    assert last(*begun) == "... and 4 more like it"
