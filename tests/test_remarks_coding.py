"""Free descriptions coded with a codebook: counts and percentages come from the codes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import recoil as api
from analysis.logs.reading import read_logs
from analysis.summary.analyze import Request, result_files
from analysis.summary.remarks_coding import Codebook, WrittenRemark, code_remarks, coding_section, load_codebook
from experiments.config.door import ConfigError
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.laws import WordsLaw
from tests.conftest import Recoil
from tests.log_files import write_study

BOOK = """
[[codes]]
code = "toy"
label = "It feels like a toy for children."
method = "vibration"
words = ["toy", "children"]

[[codes]]
code = "stable"
label = "Shooting becomes more stable."
pattern = "stab(le|ility)"

[[codes]]
code = "stuck"
label = "The bullet is stuck."
participants = ["P04"]
"""
PEOPLE = [f"P{number:02d}" for number in range(1, 15)]


def remark(participant: str, text: str, method: str = "vibration") -> WrittenRemark:
    return WrittenRemark(participant=participant, method=method, text=text)


@pytest.fixture
def book(tmp_path: Path) -> Codebook:
    (tmp_path / "codes.toml").write_text(BOOK, encoding="utf-8")
    return load_codebook(tmp_path / "codes.toml")


def test_counts_are_of_participants_and_shares_of_all(book: Codebook) -> None:
    remarks = [
        remark("P01", "A TOY."),
        remark("P01", "a toy, for children"),
        remark("P02", "toys"),
        remark("P03", "like a toy", "asymmetric-1"),
        remark("P05", "more stability", "asymmetric-2"),
        remark("P06", ""),
        remark("P99", "a toy"),
    ]
    coded = code_remarks(remarks, PEOPLE, book)
    assert [(one.code, one.participants, one.count) for one in coded.codes] == [
        ("toy", ("P01",), 1),
        ("stable", ("P05",), 1),
        ("stuck", ("P04",), 1),
    ]
    assert coded.codes[0].share == pytest.approx(1 / 14)
    assert (coded.n, coded.described, coded.remarks, coded.uncoded) == (14, 4, 5, 2)


def test_the_papers_own_counts_get_the_percentages_that_they_have() -> None:
    """5 of 14 are 35.7 %, not 33.7 %; 4 of 14 are 28.6 %, not 35.7 %."""
    codes = [
        {"code": name, "label": name, "participants": tuple(PEOPLE[:count])} for name, count in (("a", 5), ("b", 4))
    ]
    coded = code_remarks([], PEOPLE, Codebook.model_validate({"codes": tuple(codes)}))
    assert [row[-1] for row in coding_section(coded).tables[0].rows] == ["35.7 %", "28.6 %"]


def test_codes_given_by_hand_come_from_a_table(tmp_path: Path) -> None:
    (tmp_path / "codes.toml").write_text('hand_coded = "by_hand.csv"\n' + BOOK, encoding="utf-8")
    (tmp_path / "by_hand.csv").write_text("participant_id,code\nP07,stable\nP08,stable\nP07,stuck\n", encoding="utf-8")
    coded = code_remarks([], PEOPLE, load_codebook(tmp_path / "codes.toml"))
    assert {one.code: one.participants for one in coded.codes} == {
        "toy": (),
        "stable": ("P07", "P08"),
        "stuck": ("P04", "P07"),
    }


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('pattern = "stab(le|ility)"', 'pattern = "stab("', "no regular expression"),
        ('code = "stuck"', 'code = "toy"', "more than once"),
        ('code = "stuck"', 'code = "two words"', "letters, digits, _ or -"),
        ('words = ["toy", "children"]', 'words = "toy"', "words"),
        ('label = "The bullet is stuck."\n', "", "missing"),
        ("[[codes]]", 'hand_coded = "none.csv"\n[[codes]]', "none.csv"),
    ],
)
def test_a_faulty_codebook_is_refused_with_file_and_rule(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "codes.toml"
    path.write_text(BOOK.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=words):
        load_codebook(path)


@pytest.mark.parametrize(
    ("table", "words"),
    [("who,code\nP01,toy\n", "line 1"), ("participant_id,code\nP01,unknown\n", "line 2: code 'unknown'")],
)
def test_a_faulty_table_of_codes_is_refused_with_its_line(tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "codes.toml").write_text('hand_coded = "by_hand.csv"\n' + BOOK, encoding="utf-8")
    (tmp_path / "by_hand.csv").write_text(table, encoding="utf-8")
    with pytest.raises(ConfigError, match=words):
        load_codebook(tmp_path / "codes.toml")


def test_a_code_for_somebody_who_was_not_analysed_is_refused(book: Codebook) -> None:
    with pytest.raises(ValueError, match="P04"):
        code_remarks([], ["P01"], book)


@pytest.mark.slow
def test_analyze_counts_the_codes_of_logs(recoil: Recoil, tmp_path: Path) -> None:
    write_study(tmp_path / "logs", participants=4, seed=1)
    for trials in (tmp_path / "logs").rglob("*_trials.csv"):
        trials.unlink()  # remarks are the ratings' alone
    (tmp_path / "codes.toml").write_text(BOOK, encoding="utf-8")
    done = recoil("analyze", "logs", "--out", "out", "--codebook", "codes.toml")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "statistics.json").read_text(encoding="utf-8"))["remarks"]
    comments = read_logs([tmp_path / "logs"]).ratings["comment"].fillna("")
    assert found["n"] == 4
    assert found["remarks"] == (comments != "").sum()
    assert found["codes"][2]["participants"] == ["P04"]
    assert "Coded remarks" in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    (tmp_path / "codes.toml").write_text(BOOK.replace("P04", "P77"), encoding="utf-8")
    refused = recoil("analyze", "logs", "--out", "other", "--codebook", "codes.toml")
    assert (refused.returncode, "P77" in refused.stderr) == (2, True)


@pytest.mark.slow
def test_the_example_counts_what_was_said_to_any_question_in_words(tmp_path: Path) -> None:
    setup = load_setup("preference")
    assert setup.laws is not None
    words = WordsLaw(law="words", texts=("like a real gun", "a toy"))
    laws = setup.laws.model_copy(update={"questions": setup.laws.questions | {"comment": words}})
    own = replace(setup, config=setup.config.model_copy(update={"design": "liking"}), laws=laws)
    api.run_synthetic(own, ["P01", "P02"], tmp_path / "results", seed=1)
    table = api.read_logs(tmp_path / "results").designs[0].table
    said = table[table["comment"].str.contains("real", case=False, na=False)]
    request = Request(
        paths=(tmp_path / "results",), out=tmp_path / "out", codebook=shipped_folder() / "examples" / "codes.toml"
    )
    found = json.loads(result_files(request)["statistics.json"])["remarks"]
    assert found["n"] == 2
    assert found["remarks"] == (table["comment"].fillna("") != "").sum() > 0
    real = next(one for one in found["codes"] if one["code"] == "real")
    assert set(said["participant_id"]) <= set(real["participants"])


@pytest.mark.slow
def test_only_who_is_analysed_is_counted_and_coded(tmp_path: Path) -> None:
    write_study(tmp_path / "logs", participants=4, seed=1)
    ratings = next((tmp_path / "logs").rglob("*P02*_ratings.csv"))
    lines = ratings.read_text(encoding="utf-8").splitlines()
    cells = lines[1].split(",")
    cells[lines[0].split(",").index("rating")] = ""
    ratings.write_text("\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n", encoding="utf-8")
    example = shipped_folder() / "examples" / "codes.toml"
    found = json.loads(
        result_files(Request(paths=(tmp_path / "logs",), out=tmp_path / "out", codebook=example))["statistics.json"]
    )
    assert "P02" in [one["participant"] for one in found["excluded"]]
    assert found["remarks"]["n"] == found["preference"]["n"] == 3
