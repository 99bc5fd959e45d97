"""Logs that Recoil did not write, read by a map: the same rules, the same tables."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from analysis.archive.bids_export import export
from analysis.logs.column_map import ColumnMap
from analysis.logs.reading import Logs, read_logs
from analysis.summary.analyze import Request, analyze
from analysis.summary.summary import summarize
from experiments.config.door import ConfigError, load
from tests import figure_files
from tests.log_files import TextRow, trial_rows, write_study

EXAMPLE = Path(__file__).parent.parent / "configs" / "examples" / "columns.toml"
CONDITIONS = {"vibration": "vib", "asymmetric-1": "weak", "asymmetric-2": "strong"}
HEADER = ("participant", "phase", "condition", "shot_direction", "key_resp.keys", "key_resp.rt", "date")


def _psychopy(rows: list[TextRow]) -> list[list[str]]:
    """Recoil's rows as PsychoPy would have written them, with a row of practice and one of no trial."""
    keys = {"forward": "up", "backward": "down", "": "None"}
    found = [[rows[0]["participant_id"], "practice", "vib", "f", "up", "9.9", "d"], ["", "", "", "", "", "", "d"]]
    return found + [
        [r["participant_id"], "main", CONDITIONS[r["method"]], r["direction"][0], keys[r["response"]],
         r["response_time_s"], "d"]
        for r in rows
    ]  # fmt: skip


def _write(path: Path, rows: list[list[str]], header: tuple[str, ...] = HEADER, delimiter: str = ",") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(delimiter.join(row) for row in [list(header), *rows]) + "\n", encoding="utf-8-sig")
    return path


def _read(path: Path, text: str | None = None) -> Logs:
    toml = path.parent / "map.toml"
    toml.write_text(EXAMPLE.read_text(encoding="utf-8") if text is None else text, encoding="utf-8")
    return read_logs([path], mapping=load(ColumnMap, toml))


@pytest.mark.slow
def test_psychopys_files_give_the_statistics_of_the_same_answers_in_recoils_own(tmp_path: Path) -> None:
    for i in range(1, 4):
        _write(tmp_path / "old" / f"P{i:02d}_gun_2024.csv", _psychopy(trial_rows(f"P{i:02d}", 1000 + i)))
    mapped = _read(tmp_path / "old")
    assert mapped.problems == ()
    own = read_logs([write_study(tmp_path / "own", participants=3)])
    keys = ("n", "means", "sds", "anova", "binomial", "response_time")
    found, expected = (summarize(logs).to_dict()["direction"] for logs in (mapped, own))
    assert [found[key] for key in keys] == [expected[key] for key in keys]
    assert found["origin"]["guns"] == {"not stated": 180}


def test_what_was_told_is_read_by_the_map_and_kept_where_it_does_not_say(tmp_path: Path) -> None:
    told = ("fast", "exact", "as you like")
    rows = [[*row, told[k % 3]] for k, row in enumerate(_psychopy(trial_rows("P01")))]
    text = EXAMPLE.read_text(encoding="utf-8")
    for line in ('instruction = "told"', "[values.instruction]", 'fast = "speed"', 'exact = "accuracy"'):
        text = text.replace(f"# {line}", line)
    logs = _read(_write(tmp_path / "all.csv", rows, (*HEADER, "told")), text)
    assert logs.problems == ()
    assert logs.trials["instruction"].value_counts().to_dict() == {"speed": 20, "accuracy": 20, "as you like": 20}
    found = summarize(logs).to_dict()["direction"]["speed_accuracy"]
    assert found["instructions"] == ["accuracy", "as you like", "speed"]


def test_times_that_the_map_says_are_the_experimenters_are_nobodys_own(tmp_path: Path) -> None:
    text = EXAMPLE.read_text(encoding="utf-8").replace(
        'response_source = "participant"', 'response_source = "experimenter"'
    )
    found = summarize(_read(_write(tmp_path / "all.csv", _psychopy(trial_rows("P01"))), text)).to_dict()["direction"]
    assert (found["response_times"]["n"], found["speed_accuracy"]["n"]) == (0, 0)
    assert found["speed_accuracy"]["refused"]["experimenter"]["trials"] == 60


def test_a_long_table_of_several_people_and_sites_is_taken_apart(tmp_path: Path) -> None:
    rows = [[*row, site] for site in ("kyoto", "oslo") for row in _psychopy(trial_rows("P01", len(site)))]
    text = EXAMPLE.read_text(encoding="utf-8").replace('# study = "site"', 'study = "site"')
    logs = _read(_write(tmp_path / "all.csv", rows, (*HEADER, "site")), text)
    assert logs.problems == ()
    assert set(logs.trials["participant_id"]) == {"kyoto/P01", "oslo/P01"}


def test_one_bad_participant_of_a_long_table_leaves_the_others(tmp_path: Path) -> None:
    bad = trial_rows("P02", 2)
    rows = _psychopy(trial_rows("P01")) + _psychopy(bad)
    rows[64 + 5][4] = "left"
    logs = _read(_write(tmp_path / "all.csv", rows))
    assert set(logs.trials["participant_id"]) == {"P01"}
    (problem,) = logs.problems
    assert (problem.line, problem.column) == (71, "key_resp.keys")
    assert "'left' is not allowed (rule: one of up, down, forward, backward" in problem.message


def test_a_decimal_comma_that_the_map_does_not_know_names_its_key(tmp_path: Path) -> None:
    rows = [[c.replace(".", ",") if i == 5 else c for i, c in enumerate(row)] for row in _psychopy(trial_rows())]
    text = EXAMPLE.read_text(encoding="utf-8").replace('delimiter = ","', 'delimiter = ";"')
    (problem,) = _read(_write(tmp_path / "P01.csv", rows, delimiter=";"), text).problems
    assert problem.column == "key_resp.rt"
    assert 'has a decimal comma (rule: text.decimal, a point); write decimal = "," under [text]' in problem.message


def test_semicolons_decimal_commas_milliseconds_and_another_encoding(tmp_path: Path) -> None:
    rows = [
        [f"{1000 * float(c):.1f}".replace(".", ",") if i == 5 else c for i, c in enumerate(row)]
        for row in _psychopy(trial_rows()) if row[0]
    ]  # fmt: skip
    text = EXAMPLE.read_text(encoding="utf-8")
    for old, new in (('delimiter = ","', 'delimiter = ";"'), ('decimal = "."', 'decimal = ","'),
                     ('"utf-8-sig"  ', '"cp1252"'), ('unit = "s"', 'unit = "ms"')):  # fmt: skip
        text = text.replace(old, new)
    path = _write(tmp_path / "P01.csv", [[*row, "müde"] for row in rows], (*HEADER, "mood"), ";")
    path.write_bytes(path.read_bytes().decode("utf-8-sig").encode("cp1252"))
    logs = _read(path, text)
    assert logs.problems == ()
    expected = [float(row["response_time_s"]) for row in trial_rows()]
    assert logs.trials["response_time_s"].tolist() == pytest.approx(expected)


NO_NUMBERS = ["5_04", "nan", "NaN", "inf", "1e999", "٥"]
"""What Python reads as a number and no log means by one."""


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["s", "ms"])
@pytest.mark.parametrize("cell", NO_NUMBERS)
def test_a_time_that_python_alone_reads_as_a_number_is_refused(tmp_path: Path, cell: str, unit: str) -> None:
    rows = _psychopy(trial_rows())
    rows[5][HEADER.index("key_resp.rt")] = cell
    text = EXAMPLE.read_text(encoding="utf-8").replace('unit = "s"', f'unit = "{unit}"')
    (problem,) = _read(_write(tmp_path / "old.csv", rows), text).problems
    assert f"{cell!r} is not a finite number with a decimal point" in problem.message
    assert problem.line == 7


@pytest.mark.slow
@pytest.mark.parametrize("scale", ["", "[rating]\nscale_min = 1\nscale_max = 7"])
@pytest.mark.parametrize("cell", NO_NUMBERS)
def test_a_rating_that_python_alone_reads_as_a_number_is_refused(tmp_path: Path, cell: str, scale: str) -> None:
    text = f'experiment = "preference"\n[text]\nmissing = [""]\n[participant]\nfile_name = "^(P07)_"\n{scale}\n'
    _write(tmp_path / "old" / "P07_x.csv", [["vibration", "1"], ["asymmetric-1", cell]], ("method", "slider"))
    (problem,) = _read(tmp_path / "old", f'{text}[columns]\nmethod = "method"\nrating = "slider"').problems
    assert f"{cell!r} is not a finite number with a decimal point" in problem.message


def test_ratings_on_another_scale_and_a_code_from_the_files_name(tmp_path: Path) -> None:
    text = """
experiment = "preference"
[participant]
file_name = "^([A-Za-z0-9]+)_"
[columns]
method = "method"
rating = "slider"
[rating]
scale_min = 1
scale_max = 7
"""
    _write(
        tmp_path / "old" / "P07_x.csv",
        [["vibration", "1"], ["asymmetric-1", "4"], ["asymmetric-2", "7"]],
        ("method", "slider"),
    )
    _write(tmp_path / "old" / "P08_x.csv", [["vibration", "8"]], ("method", "slider"))
    logs = _read(tmp_path / "old", text)
    assert logs.ratings["rating"].tolist() == [0.0, 5.0, 10.0]
    assert logs.ratings["trial"].tolist() == [1, 2, 3]
    assert set(logs.ratings["participant_id"]) == {"P07"}
    assert "line 2, column slider: rating 8 is out of range (rule: 1 to 7" in str(logs.problems[0])


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "kept"), [("scale_min = 1\nscale_max = 7", False), ("", True)])
def test_of_ratings_of_another_program_no_question_and_no_anchors_are_invented(
    tmp_path: Path, scale: str, kept: bool
) -> None:
    columns = tmp_path / "map.toml"
    columns.write_text(
        'experiment = "preference"\n[participant]\nfile_name = "^([A-Za-z0-9]+)_"\n'
        f'[columns]\nmethod = "method"\nrating = "slider"\n{f"[rating]{chr(10)}{scale}" if scale else ""}\n'
    )
    for code, ratings in (("P07", "147"), ("P08", "256"), ("P09", "346")):
        rows = [[method, rating] for method, rating in zip(CONDITIONS, ratings, strict=True)]
        _write(tmp_path / "old" / f"{code}_x.csv", rows, ("method", "slider"))
    with figure_files.drawn("svg"):
        analyze(Request(paths=[tmp_path / "old"], out=tmp_path / "out", columns=columns))
    export(tmp_path / "old", tmp_path / "bids", columns=columns)
    report, sidecar = (tmp_path / "out/report.md").read_text(), (tmp_path / "bids/task-preference_beh.json").read_text()
    drawing = (tmp_path / "out/figures/figure-results.svg").read_text()
    said = "Ratings went from 0 to 10;" if kept else "Ratings from 1 to 7 were rescaled linearly to 0 to 10;"
    assert said in report
    assert said in json.loads(sidecar)["TaskDescription"]
    assert said in json.loads(sidecar)["rating"]["Description"]
    assert ("rating, 0 to 10" if kept else "rating, 1 to 7 as 0 to 10") in drawing
    assert not any("like" in text.replace("likelihood", "") for text in (sidecar, drawing))
    assert "like very much" not in report


def test_recoils_own_logs_may_lie_beside_them(tmp_path: Path) -> None:
    write_study(tmp_path / "both", participants=1)
    _write(tmp_path / "both" / "P02_old.csv", _psychopy(trial_rows("P02", 2)))
    synthetic = EXAMPLE.read_text(encoding="utf-8").replace(
        'response_source = "participant"', 'response_source = "synthetic"'
    )
    logs = _read(tmp_path / "both", synthetic)
    assert (logs.problems, len(logs.trials), len(logs.ratings)) == ((), 120, 3)


def _by_pattern(pattern: str, *more: str) -> str:
    """The example's map with a pattern for the code, and more lines."""
    text = EXAMPLE.read_text(encoding="utf-8")
    named = text.replace('column = "participant"', f'column = "participant"\npattern = {json.dumps(pattern)}', 1)
    return "\n".join([named, *more])


def test_a_pattern_takes_the_code_out_of_the_column(tmp_path: Path) -> None:
    rows = [row for number in (1, 12) for row in _psychopy(trial_rows(f"VP_{number:02d}", number))]
    logs = _read(_write(tmp_path / "all.csv", rows), _by_pattern(r"VP_(\d+)"))
    assert (logs.problems, set(logs.trials["participant_id"])) == ((), {"01", "12"})


def test_who_does_not_fit_the_pattern_is_named_in_the_map(tmp_path: Path) -> None:
    rows = [row for seed, code in enumerate(("VP_01", "guest")) for row in _psychopy(trial_rows(code, seed))]
    path = _write(tmp_path / "all.csv", rows)
    (problem,) = _read(path, _by_pattern(r"VP_(\d+)")).problems
    assert "'guest' has no participant's code" in str(problem)
    assert "[values.participant]" in str(problem)
    logs = _read(path, _by_pattern(r"VP_(\d+)", "[values.participant]", 'guest = "G1"'))
    assert (logs.problems, set(logs.trials["participant_id"])) == ((), {"01", "G1"})


def test_a_pattern_that_makes_one_code_of_two_people_is_refused(tmp_path: Path) -> None:
    rows = [row for code in ("A_01", "B_01", "A_02") for row in _psychopy(trial_rows(code))]
    logs = _read(_write(tmp_path / "all.csv", rows), _by_pattern(r"_(\d+)"))
    assert set(logs.trials["participant_id"]) == {"02"}
    assert "'A_01' and 'B_01' are both code '01'" in str(logs.problems[0])


@pytest.mark.parametrize(
    ("code", "pattern", "own"),
    [("VP_01", r"VP_(\d+)", "VP01"), ("S-3", r"S\-(\d+)", "S3"), ("anna.b", r"anna\.([A-Za-z0-9]+)", "annab")],
)
def test_a_code_that_is_none_is_refused_with_both_remedies_and_both_help(
    code: str, pattern: str, own: str, tmp_path: Path
) -> None:
    path = _write(tmp_path / "all.csv", _psychopy(trial_rows(code)))
    (problem,) = _read(path).problems
    assert f"{code!r} is not a code" in str(problem)
    assert f"[participant] pattern = '{pattern}'" in str(problem)
    listed = f'{code!r} = "{own}"'
    assert f"[values.participant] {listed} gives {code!r} a code of their own" in str(problem)
    for text in (_by_pattern(pattern), _by_pattern(r"^(\w+)$", "[values.participant]", listed)):
        assert _read(path, text).problems == ()


CODES = ("A-1", "A_1", "a1", "张伟", "李娜", "Jürgen", "Jrgen", "Ж" * 40, "P" * 40, "P" * 41)


def test_no_two_people_become_one_by_the_codes_that_are_proposed(tmp_path: Path) -> None:
    rows = {code: _psychopy(trial_rows(code, seed)) for seed, code in enumerate(CODES)}
    proposed = dict[str, str]()
    alone = [_read(_write(tmp_path / f"{n}.csv", some)) for n, some in enumerate(rows.values())]  # a file each
    for logs in (_read(_write(tmp_path / "all.csv", [row for some in rows.values() for row in some])), *alone[3:]):
        for problem in logs.problems:
            (key, own), *others = re.findall(r"\[values\.participant\] '(.*)' = \"([A-Za-z0-9]{1,32})\"", str(problem))
            assert not others
            assert str(problem).endswith(f"gives '{key}' a code of their own")
            assert f"participant {key} of" in str(problem)
            assert proposed.setdefault(key, own) == own
    listed = [f'{key!r} = "{own}"' for key, own in proposed.items()]
    logs = _read(
        tmp_path / "all.csv", "\n".join([EXAMPLE.read_text(encoding="utf-8"), "[values.participant]", *listed])
    )
    assert logs.problems == ()
    assert logs.trials["participant_id"].nunique() == len(CODES)


def test_a_code_without_a_letter_or_digit_has_no_part_that_could_be_one(tmp_path: Path) -> None:
    (problem,) = _read(_write(tmp_path / "all.csv", _psychopy(trial_rows("张伟")))).problems
    assert "[participant] pattern" not in str(problem)


def test_a_person_who_is_given_anothers_code_is_refused(tmp_path: Path) -> None:
    path = _write(tmp_path / "all.csv", [row for code in ("张伟", "P01") for row in _psychopy(trial_rows(code))])
    given = ["[values.participant]", '"张伟" = "P01"']
    (problem,) = _read(path, "\n".join([EXAMPLE.read_text(encoding="utf-8"), *given])).problems
    assert "'张伟' and 'P01' are both code 'P01' by [values.participant] (rule: one code a participant" in str(problem)


def test_two_names_that_a_map_lists_under_one_code_are_one_person(tmp_path: Path) -> None:
    rows = _psychopy(trial_rows("VP 01"))
    half = len(rows) // 2
    spelt = [["vp-1", *row[1:]] if n >= half else row for n, row in enumerate(rows)]
    both = ["[values.participant]", "'VP 01' = 'VP01'", "'vp-1' = 'VP01'"]
    logs = _read(_write(tmp_path / "all.csv", spelt), "\n".join([EXAMPLE.read_text(encoding="utf-8"), *both]))
    assert logs.problems == ()
    assert set(logs.trials["participant_id"]) == {"VP01"}


FAULTS: dict[str, tuple[Callable[[str], str], str]] = {
    "unknown key": (lambda t: t.replace("delimiter =", "separator ="), "text.separator = ',': unknown key"),
    "no experiment": (lambda t: t.replace('experiment = "direction"', ""), "experiment: is missing"),
    "no response": (lambda t: t.replace('response = "key', '# "'), "columns.response is missing"),
    "level": (lambda t: t.replace('up = "forward"', 'up = "left"'), "values.response.up = 'left'"),
    "unit": (lambda t: t.replace('unit = "s"', 'unit = "min"'), "response_time.unit = 'min'"),
    "no unit": (lambda t: t.replace('[response_time]\nunit = "s"', ""), "response_time.unit is missing"),
    "decimal": (lambda t: t.replace('decimal = "."', 'decimal = ","'), "is also the delimiter"),
    "both": (lambda t: t.replace("# file_name", "file_name"), "either `column` or `file_name`"),
    "pattern": (lambda t: t.replace('column = "participant"', 'file_name = "P.."'), "has 0 groups"),
    "pattern of a name": (lambda t: t.replace('column = "participant"', 'file_name = "P(..)"\npattern = "P(..)"'),
                          "`pattern` goes with `column`"),
    "skip": (lambda t: t.replace("empty = true", ""), "give `values`, or `empty = true`"),
    "not TOML": (lambda t: t + "[", "not TOML"),
}  # fmt: skip


@pytest.mark.parametrize("case", FAULTS)
def test_a_bad_map_is_refused_with_file_key_value_and_rule(case: str, tmp_path: Path) -> None:
    spoil, words = FAULTS[case]
    path = tmp_path / "map.toml"
    path.write_text(spoil(EXAMPLE.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"map[.]toml:(\d+:)? ") as refused:
        load(ColumnMap, path)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("condition", "cond"), "column condition: column 'condition' is missing"),
        (lambda text: text.replace("date", "phase"), "stands 2 times"),
        (lambda text: text.replace(",up,", ',"up,', 1), "is not separated text"),
        (lambda text: text.replace(",d\n", "\n", 1), "line 2: has 6 fields (rule: 7"),
        (lambda text: text.replace("0.", "zero."), "column key_resp.rt: 'zero."),
        (lambda text: text.replace("0.", "-0.", 1), "column key_resp.rt: response_time_s -0."),
        (lambda text: text.replace("P01", "P-1"), "is not a code"),
        (lambda text: text.replace("main", "practice"), "has no row left"),
    ],
)  # fmt: skip
def test_a_file_that_the_map_does_not_fit_is_a_problem(
    change: Callable[[str], str], words: str, tmp_path: Path
) -> None:
    path = _write(tmp_path / "P01.csv", _psychopy(trial_rows()))
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")
    logs = _read(path)
    assert logs.files == ()
    assert words in str(logs.problems[0])
