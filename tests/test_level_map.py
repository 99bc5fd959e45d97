"""Another program's answers at levels, read by a map: the same functions as of the numbers themselves."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from analysis.logs.level_map import LevelMap, read_levels
from analysis.psychometric.fit import psychometric_fit
from analysis.summary.mapped_thresholds import mapped_thresholds, thresholds_in_short
from experiments.config.door import ConfigError, load
from experiments.load import shipped_folder
from experiments.study.folders import PlaceError

MAP = """
name = "voltage_V"
share = "right"
answers = 2
[text]
delimiter = ";"
decimal = ","
[participant]
column = "VP"
pattern = 'VP_(\\d+)'
[columns]
level = "Reiz"
success = "Treffer"
condition = "Hand"
[values.success]
ja = true
nein = false
"""
RIGHT = {6.5: 10, 8.5: 12, 10.5: 15, 12.5: 19, 14.5: 20}
HANDS = ("links", "rechts")


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Two people with the same answers at both hands, the levels in no order, and a trial nobody answered."""
    rows = [
        f"VP_0{who};{str(level).replace('.', ',')};{'ja' if trial < right else 'nein'};{hand}"
        for trial in range(20)
        for level, right in RIGHT.items()
        for who in (1, 2)
        for hand in HANDS
    ]
    (tmp_path / "lab.csv").write_text("\n".join(["VP;Reiz;Treffer;Hand", *rows, "VP_01;6,5;;links"]) + "\n")
    (tmp_path / "map.toml").write_text(MAP)
    return tmp_path


@pytest.mark.slow
def test_a_map_gives_the_fits_of_the_counts_themselves(lab: Path) -> None:
    found = mapped_thresholds([lab / "lab.csv"], lab / "map.toml", lab / "out")
    own = psychometric_fit([*RIGHT], [*RIGHT.values()], [20] * 5, guess=0.5)
    assert [one.levels for one in found.thresholds.conditions] == [{"condition": hand} for hand in HANDS]
    people = [one for condition in found.thresholds.conditions for one in condition.people]
    assert [one.participant for one in people] == ["01", "02", "01", "02"]
    assert {one.fit.threshold.median for one in people if one.fit is not None} == {own.threshold.median}
    assert {path.name for path in (lab / "out").iterdir()} >= {"fit.json", "report.html", "figures"}
    assert found.to_frame()["threshold"].nunique() == 1


@pytest.mark.slow
def test_conditions_stand_as_people_count(lab: Path) -> None:
    text = (lab / "lab.csv").read_text()
    (lab / "lab.csv").write_text(text.replace("links", "v12").replace("rechts", "v2"))
    found = mapped_thresholds([lab / "lab.csv"], lab / "map.toml", lab / "out").thresholds
    assert [one.levels["condition"] for one in found.conditions] == ["v2", "v12"]
    assert [(one.a["condition"], one.b["condition"]) for one in found.differences] == [("v2", "v12")]


@pytest.mark.slow
def test_where_nobody_has_a_threshold_among_the_levels_no_mean_is_told(lab: Path) -> None:
    rows = [f"VP_0{who};{level};{'ja' if who == 1 else 'nein'};links" for who in (1, 2) for level in (6, 10, 14) * 20]
    (lab / "lab.csv").write_text("\n".join(["VP;Reiz;Treffer;Hand", *rows]) + "\n")
    (told,) = thresholds_in_short(mapped_thresholds([lab / "lab.csv"], lab / "map.toml", lab / "out")).items
    assert told == "Threshold in voltage in V, mean over people: links: nobody has one within the levels."
    (row,) = (line for line in (lab / "out" / "report.md").read_text().splitlines() if line.startswith("| links | 2 |"))
    assert row == "| links | 2 | – | – | – | – | – | 2 |"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("exponent", "shown"),
    [("E-12", r"\d\.\d\de−11 \["), ("E+20", r"\d\.\d\de\+21 \["), ("", r"\b1?\d\.\d\d \[")],
)
def test_levels_of_every_size_are_told_in_three_figures(lab: Path, exponent: str, shown: str) -> None:
    text = (lab / "lab.csv").read_text()
    (lab / "lab.csv").write_text(re.sub(r"(\d+,5);", rf"\g<1>{exponent};", text))
    (told,) = thresholds_in_short(mapped_thresholds([lab / "lab.csv"], lab / "map.toml", lab / "out")).items
    assert re.search(f"mean over people with its 95 % credible interval: links: {shown}", told)
    rows = [
        line for line in (lab / "out" / "report.md").read_text().splitlines() if line.startswith(("| 0", "| links"))
    ]
    assert rows
    assert not any("0.000000000" in row or re.search(r"\d{13}", row) for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ({"VP_01;links": 20}, "One participant: see the report."),
        (
            {"VP_01;links": 20, "VP_02;links": 3, "VP_03;rechts": 3},
            "1 of 3 participants could be fitted, so there is no mean over people; 2 had too few answers: below 10, or "
            "at one level.",
        ),
        (
            {"VP_01;links": 20, "VP_02;rechts": 20},
            "2 of 2 participants could be fitted, no two of them in one condition, so there is no mean over people.",
        ),
        (
            {"VP_01;links": 3, "VP_02;links": 3},
            "None of 2 participants could be fitted, so there is no mean over people; 2 had too few answers: below 10, "
            "or at one level.",
        ),
    ],
)
def test_where_no_two_could_be_fitted_it_says_so_and_who_lacks_answers(
    lab: Path, rows: dict[str, int], said: str
) -> None:
    cells = [
        f"{who};{6 + 2 * (trial % 5)};{'ja' if trial % 3 else 'nein'};{hand}"
        for one, trials in rows.items()
        for who, hand in [one.split(";")]
        for trial in range(trials)
    ]
    (lab / "lab.csv").write_text("\n".join(["VP;Reiz;Treffer;Hand", *cells]) + "\n")
    (told,) = thresholds_in_short(mapped_thresholds([lab / "lab.csv"], lab / "map.toml", lab / "out")).items
    assert told == said


def test_a_file_with_bad_rows_says_in_one_message_how_many_and_where(lab: Path) -> None:
    cells = ["VP_01;6,5;ja;links", "VP_01;x;ja;links"] + ["VP_01;6,5;vielleicht;links"] * 1200
    (lab / "lab.csv").write_text("\n".join(["VP;Reiz;Treffer;Hand", *cells]) + "\n")
    (problem,) = read_levels([lab / "lab.csv"], load(LevelMap, lab / "map.toml")).problems
    assert (problem.line, problem.column) == (3, "Reiz")
    assert problem.message.startswith("'x' is no level (rule: ")
    assert problem.message.endswith(
        "; 1,201 rows are bad, on lines 3, 4, 5, 6, 7 and 1,196 more; the whole file is left out"
    )


def test_a_level_that_is_not_there_is_a_trial_without_a_stimulus(lab: Path) -> None:
    (lab / "lab.csv").write_text("VP;Reiz;Treffer;Hand\nVP_01;;nein;links\nVP_01;6,5;ja;links\n")
    read = read_levels([lab / "lab.csv"], load(LevelMap, lab / "map.toml"))
    assert read.table["level"].isna().tolist() == [True, False]
    assert read.table["success"].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("cell", ["5_04", "nan", "inf", "1e999", "-1e51", "٥"])
def test_a_level_that_is_no_number_or_too_large_to_square_is_refused(lab: Path, cell: str) -> None:
    (lab / "map.toml").write_text(MAP.replace('decimal = ","', 'decimal = ","\nmissing = [""]'))
    (lab / "lab.csv").write_text(f"VP;Reiz;Treffer;Hand\nVP_01;6,5;ja;links\nVP_01;{cell};ja;links\n")
    (problem,) = read_levels([lab / "lab.csv"], load(LevelMap, lab / "map.toml")).problems
    assert problem.line == 3
    assert f"{cell!r} is no level (rule: a number" in problem.message


def test_a_level_is_missing_where_the_map_says_so(lab: Path) -> None:
    (lab / "lab.csv").write_text("VP;Reiz;Treffer;Hand\nVP_01;nan;ja;links\nVP_01;6,5;ja;links\n")
    (lab / "map.toml").write_text(MAP.replace('decimal = ","', 'decimal = ","\nmissing = ["", "nan"]'))
    read = read_levels([lab / "lab.csv"], load(LevelMap, lab / "map.toml"))
    assert read.table["level"].isna().tolist() == [True, False]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ja = true", "", "lab.csv, line 2, column Treffer: 'ja' is no success and no failure"),
        ('"Reiz"', '"Hand"', "lab.csv, line 2, column Hand: 'links' is no level"),
        ('"Reiz"', '"Pegel"', "column 'Pegel' is missing (rule: the map names it)"),
        ("VP_(", "P-(", "'VP_01' has no participant's code"),
    ],
)
def test_what_a_map_does_not_fit_is_said_with_file_line_and_column(lab: Path, old: str, new: str, words: str) -> None:
    (lab / "map.toml").write_text(MAP.replace(old, new))
    with pytest.raises(PlaceError) as refused:
        mapped_thresholds([lab / "lab.csv"], lab / "map.toml", lab / "out")
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("answers = 2", "", "answers is missing: of right answers say among how many"),
        ('share = "right"', 'share = "yes"', 'answers is of share = "right"'),
        ('name = "voltage_V"', 'name = "voltage V"', "name = 'voltage V': must be a letter and up to 31 letters"),
        ('delimiter = ";"', 'delimiter = ","', "decimal = ',' is also the delimiter"),
    ],
)
def test_a_map_that_is_none_is_refused(lab: Path, old: str, new: str, words: str) -> None:
    (lab / "map.toml").write_text(MAP.replace(old, new))
    with pytest.raises(ConfigError) as refused:
        load(LevelMap, lab / "map.toml")
    assert words in str(refused.value)


def test_the_shipped_example_is_a_map() -> None:
    assert load(LevelMap, shipped_folder() / "examples" / "levels.toml").values.success == {"hit": True, "miss": False}


@pytest.mark.parametrize(
    ("codes", "by", "code"),
    [
        ("pattern = '([0-9]+)'", "participant.pattern = '([0-9]+)'", "01"),
        ("[values.participant]\nVP_01 = 'XY01'", "[values.participant]", "XY01"),
    ],
)
def test_two_people_of_a_file_who_come_to_one_code_are_refused(lab: Path, codes: str, by: str, code: str) -> None:
    other = "XY_01" if code == "01" else "XY01"
    (lab / "lab.csv").write_text(f"VP;Reiz;Treffer;Hand\nVP_01;6,5;ja;links\n{other};6,5;ja;links\n")
    (problem,) = read_levels([lab / "lab.csv"], _with_codes(lab, codes)).problems
    assert f"'VP_01' and '{other}' are both code '{code}' by {by}" in str(problem)


def test_two_names_that_a_map_lists_under_one_code_are_one_person(lab: Path) -> None:
    (lab / "lab.csv").write_text("VP;Reiz;Treffer;Hand\nVP_01;6,5;ja;links\nXY_01;6,5;ja;links\n")
    codes = "[values.participant]\nVP_01 = 'P01'\nXY_01 = 'P01'"
    assert read_levels([lab / "lab.csv"], _with_codes(lab, codes)).problems == ()


def _with_codes(lab: Path, codes: str) -> LevelMap:
    text, pattern = (lab / "map.toml").read_text(), "pattern = 'VP_(\\d+)'\n"
    kept = text.replace(pattern, f"{codes}\n" if codes.startswith("pattern") else "")
    (lab / "map.toml").write_text(kept if codes.startswith("pattern") else f"{kept}{codes}\n")
    return load(LevelMap, lab / "map.toml")
