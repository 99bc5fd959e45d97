"""Output that survives: streams, file names, fonts, long and strange names, narrow terminals, formulas, full disks."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
import unicodedata
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.logs.column_map import ColumnMap
from analysis.logs.reading import read_logs
from analysis.report.figures import glyphs, style
from analysis.report.figures.style import drawn_name, method_line, method_marker
from analysis.report.labels import cut_names, display_name, labelled, lines_of, text_columns
from analysis.report.section import Section, Table
from analysis.report.streams import plain_letter
from analysis.report.terminal import with_tables
from analysis.summary.designs import summarise
from analysis.summary.figures.results import figure_8, figure_directions
from analysis.summary.figures.trade import figure_conditional_accuracy, figure_response_times
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.pictures import write_figures
from analysis.summary.sections.sections import sections
from analysis.summary.sections.shown_trades import shown_trades
from analysis.summary.summary import summarize
from analysis.summary.tables_out import result_tables
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError, checked_table, load
from experiments.config.setup import GunConfig
from experiments.load import load_setup, shipped_folder
from experiments.record import storage
from experiments.record.tables import guard
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests import figure_files
from tests.conftest import RECOIL, Recoil
from tests.designs import design
from tests.log_files import rating_rows, ratings_path, trial_rows, trials_path, write_rows
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

CHINESE, ARABIC = "不对称力（强）", "القوة غير المتماثلة"
LONG = "a name that says all of the drive, the damper and the day, as people write them " + "x" * 120
TEN = tuple(f"v{number}" for number in (1, 2, 3, 4, 5, 6, 7, 8, 9, 12))

# streams


@pytest.mark.parametrize(
    ("encoding", "words"),
    [
        ("ascii", ["check", "direction"]),
        ("ascii", ["study", "."]),
        ("cp1252", ["study", "."]),
        ("latin-1", ["check", "direction"]),
    ],
)
def test_a_stream_that_cannot_encode_a_letter_gets_another_and_no_traceback(
    encoding: str, words: list[str], tmp_path: Path
) -> None:
    environment = os.environ | {"PYTHONIOENCODING": encoding, "COLUMNS": "120"}
    (tmp_path / "sub-P01").mkdir()
    done = subprocess.run(
        [RECOIL, *words], env=environment, capture_output=True, check=True, timeout=PATIENCE_S, cwd=tmp_path
    )
    assert done.stdout.decode(encoding)
    assert b"Traceback" not in done.stderr


def test_results_for_programs_stay_json_whatever_the_stream_takes(tmp_path: Path) -> None:
    (tmp_path / "研究-é").mkdir()
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "1"}
    done = subprocess.run(
        [RECOIL, "run", "direction", "--participant", "P01", "--screen", "synthetic", "--results", "研究-é", "--json"],
        env=environment,
        capture_output=True,
        check=True,
        timeout=PATIENCE_S,
        cwd=tmp_path,
    )
    assert Path(json.loads(done.stdout)["table"]).parts[0] == "研究-é"


@given(st.characters(min_codepoint=0x80))
def test_every_letter_has_something_in_ascii(letter: str) -> None:
    assert plain_letter(letter).isascii()
    assert plain_letter(letter)


def test_signs_of_numbers_and_lines_of_tables_stay_readable() -> None:
    assert "".join(map(plain_letter, "−0.5 ± 2 ≤ 3 × η² → “a”…")) == '-0.5 +- 2 <= 3 x eta2 -> "a"...'
    assert "".join(map(plain_letter, "┏━┳┃│╇")) == "+-+||+"


# names: their order, labels, and the folder they lie in


@pytest.fixture(scope="module")
def oddly_named(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two people's runs of both experiments in a folder that is no UTF-8, with a gun whose methods have odd labels."""
    folder = tmp_path_factory.mktemp("odd") / os.fsdecode(b"r\xff")
    labels = {"v2": CHINESE, "v12": LONG[:200], "v1": ARABIC, "=1+1": "Sum"}
    for source in (path for kind in ("*.toml", "synthetic/*.toml") for path in shipped_folder().glob(kind)):
        (folder / "configs" / source.relative_to(shipped_folder())).parent.mkdir(parents=True, exist_ok=True)
        text = source.read_text(encoding="utf-8").replace(
            'levels = ["vibration", "asymmetric-1", "asymmetric-2"]', f"levels = {json.dumps(list(labels))}"
        )
        for old, new in zip(("vibration", "asymmetric-1", "asymmetric-2"), ("v2", "v12", "v1"), strict=True):
            text = (
                text.replace(f'"{old}/', f'"{new}/').replace(f"{old} =", f"{new} =").replace(f'= "{old}"', f'= "{new}"')
            )
        text = re.sub(r"(?m)^(lowest|same|same_share) = .*\n|^assumed = \[[^\]]*\]\n", "", text)
        text = text.replace(
            "[questions.response.share]", '[questions.response.share]\n"=1+1/forward" = 0.6\n"=1+1/backward" = 0.6'
        )
        text = text.replace("v1 = 7.8 }", 'v1 = 7.8, "=1+1" = 5.0 }').replace(
            "planned_s = 1800.0", "planned_s = 2600.0"
        )
        (folder / "configs" / source.relative_to(shipped_folder())).write_text(text, encoding="utf-8")
    methods = "".join(
        f'[methods."{code}"]\nlabel = "{label}"\nactuator = "vibration"\n' for code, label in labels.items()
    )
    (folder / "configs" / "gun.toml").write_text(f'title = "A gun"\n{methods}', encoding="utf-8")
    for experiment in ("direction", "preference"):
        setup = load_setup(str(folder / "configs" / f"{experiment}.toml"))
        for code in ("P01", "P02"):
            request = RunRequest(setup=setup, participant_id=code, results=folder / "results", seed=1)
            run(request, synthetic_screen, VirtualClock())
    return folder


def test_labels_and_order_are_the_guns_and_the_designs_in_a_folder_that_is_no_text(
    oddly_named: Path, recoil: Recoil, tmp_path: Path
) -> None:
    done = recoil("analyze", oddly_named / "results", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert not re.search("Warning|Glyph|Traceback", done.stderr)
    found = json.loads((tmp_path / "out" / "statistics.json").read_text(encoding="utf-8"))
    for experiment in ("direction", "preference"):
        assert found[experiment]["methods"] == ["v2", "v12", "v1", "=1+1"]
    assert found["labels"] == {"v2": CHINESE, "v12": LONG[:200], "v1": ARABIC, "=1+1": "Sum"}
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert CHINESE in text
    assert ARABIC in text
    assert text.count(LONG[:200]) == 1
    assert max(map(len, text.splitlines())) < 2_000


def test_what_a_level_begins_with_is_guarded_and_read_back(oddly_named: Path) -> None:
    logs = read_logs([oddly_named / "results"])
    assert (logs.problems, set(logs.trials["method"])) == ((), {"v2", "v12", "v1", "=1+1"})
    (table, *_) = sorted((oddly_named / "results").rglob("*_trials.csv"))
    tables = {table.name: table.read_bytes(), **result_tables(logs, summarize(logs).analysed)}
    for name in (table.name, "direction_long.csv", "preference_long.csv"):
        cells = {row["method"] for row in csv.DictReader(io.StringIO(tables[name].decode(), newline=""))}
        assert cells == {"v2", "v12", "v1", "'=1+1"}, name


def test_every_command_that_reads_takes_such_a_folder(oddly_named: Path, recoil: Recoil) -> None:
    journals = sorted((oddly_named / "results").rglob("*journal.jsonl"))
    for words in (
        ["study", oddly_named / "results"],
        ["rebuild", *journals],
        ["export", "bids", oddly_named / "results"],
    ):
        done = recoil(*words)
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr


def _logs_of(folder: Path, methods: tuple[str, ...], people: int = 2, sets: int = 2) -> Path:
    for number in range(1, people + 1):
        code = f"P{number:02d}"
        write_rows(trials_path(folder, code), trial_rows(code, number, methods, sets))
        write_rows(ratings_path(folder, code), rating_rows(code, number, methods))
    return folder


def test_without_a_journal_methods_stand_as_people_count(tmp_path: Path) -> None:
    found = summarize(read_logs([_logs_of(tmp_path, ("v12", "v1", "v2"))])).direction
    assert found is not None
    assert found.methods == ("v1", "v2", "v12")


def test_a_map_gives_order_and_labels(tmp_path: Path) -> None:
    rows = ["who,method,liked", *(f"P0{who},{method},{5 + who}" for who in (1, 2, 3) for method in ("a", "b", "c"))]
    (tmp_path / "old.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "map.toml").write_text(
        'experiment = "preference"\n'
        'participant = { column = "who" }\ncolumns = { method = "method", rating = "liked" }\n'
        '[method]\nlevels = ["c", "a"]\nlabels = { a = "Ohne" }\n'
    )
    found = summarize(read_logs([tmp_path], mapping=load(ColumnMap, tmp_path / "map.toml")))
    assert found.preference is not None
    assert (found.preference.methods, found.labels) == (("c", "a", "b"), {"a": "Ohne"})


@pytest.mark.parametrize(
    ("name", "said"),
    [("a\nb", "U+000A"), ("a\u202eb", "U+202E"), ("a\x1b[31m", "U+001B"), ("x" * 201, "201 characters")],
)
def test_names_that_nobody_can_read_are_refused_at_the_door(name: str, said: str, tmp_path: Path) -> None:
    for methods in ({name: {"label": "A"}}, {"a": {"label": name}}):
        gun = {"title": "A gun", "methods": {code: {**one, "actuator": "vibration"} for code, one in methods.items()}}
        with pytest.raises(ConfigError) as raised:
            checked_table(GunConfig, gun, "gun.toml")
        assert len(str(raised.value)) < 600
    write_rows(trials_path(tmp_path, "P01"), trial_rows("P01", 1, ("a", name)))
    (problem,) = read_logs([tmp_path]).problems
    assert said in problem.message
    assert problem.column == "method"


@given(st.text(min_size=1, max_size=80), st.integers(4, 30))
def test_lines_hold_every_letter_and_are_no_wider_than_asked(text: str, width: int) -> None:
    lines = lines_of(text, width)
    assert re.sub(r"\s", "", "".join(lines)) == re.sub(r"\s", "", text)
    opens = {"Ps", "Pe", "Po", "Pf"}
    if not any(unicodedata.category(letter) in opens for letter in text):  # which are kept with their neighbours
        assert all(text_columns(line) <= width for line in lines)


def test_long_names_that_begin_alike_stay_apart_and_their_whole_is_kept() -> None:
    names = [f"{LONG}{number}" for number in range(12)]
    with labelled({}):
        shown = [display_name(name) for name in names]
        assert len(set(shown)) == 12
        assert max(map(text_columns, shown)) <= 33
        assert list(cut_names().values()) == names


# figures


@pytest.fixture(scope="module")
def ten(tmp_path_factory: pytest.TempPathFactory) -> StudyStatistics:
    return summarize(read_logs([_logs_of(tmp_path_factory.mktemp("ten"), TEN, people=10)]))


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Figure]]:
    """The figures that are made, laid out as for users and not written."""
    figures: list[Figure] = []

    def keep(figure: Figure, _: Path) -> None:
        style.lay_out(figure)
        figures.append(figure)

    monkeypatch.setattr(style, "save", keep)
    with figure_files.full_size():
        yield figures


WORDS = dict(
    zip(
        TEN,
        ["Vibration", *(f"Asymmetric Force {i}" for i in ("I", "II", "III", "VIII")), "Saturated", "Double pulse, weak",
         "Double pulse, strong", "Vibration at 200 Hz", "Pneumatic recoil reference"],
        strict=True,
    )
)  # fmt: skip
MIXED = {"v1": CHINESE, "v2": ARABIC, **{method: f"{LONG[:180]} {method}" for method in TEN[4:]}}


@pytest.mark.parametrize("labels", [WORDS, MIXED], ids=["words", "labels"])
def test_ten_methods_make_figures_in_which_nothing_that_is_written_touches(
    ten: StudyStatistics, drawn: list[Figure], labels: dict[str, str], tmp_path: Path
) -> None:
    if labels is MIXED and not glyphs.is_drawable(CHINESE):
        pytest.skip("needs a font with Chinese letters")
    assert ten.direction is not None
    with labelled(labels, TEN):
        figure_8(ten, tmp_path / "never")
        for draw in (figure_directions, figure_response_times):
            draw(ten.direction, tmp_path / "never")
        (shown,) = shown_trades(ten, drawn_name)
        figure_conditional_accuracy(shown.trade, shown.names, tmp_path / "never")
    for figure in drawn:
        assert figure_files.touching(figure) == []
        assert any(text.get_text().startswith("[1] a name") for text in figure.texts) is (labels is MIXED)
    assert len([axes for axes in drawn[0].axes if len(axes.patches) == 45]) == 2


def test_no_line_and_no_mark_comes_twice() -> None:
    assert len({str(method_line(i)) for i in range(100)}) == len({method_marker(i) for i in range(100)}) == 100


def test_letters_that_no_font_has_are_said_once_and_the_code_is_drawn(
    ten: StudyStatistics,
    drawn: list[Figure],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(glyphs, "_installed", list)
    monkeypatch.setattr(glyphs, "_chosen", [])
    monkeypatch.setattr(glyphs, "_said", set())
    assert ten.direction is not None
    with labelled({"v1": "𓀀 鳥", "v2": "plain"}):
        figure_directions(ten.direction, tmp_path / "never")
        figure_8(ten, tmp_path / "never")
    written = {text.get_text() for figure in drawn for text in figure.findobj(Text)}
    assert {"v1", "plain"} <= written
    assert not any("鳥" in text for text in written)
    assert capsys.readouterr().err.count("no font on this machine has the letters 鳥 𓀀") == 1


def test_ticks_have_no_boxes_for_letters_that_no_font_has_and_no_gaps_in_words(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(glyphs, "_installed", list)
    monkeypatch.setattr(glyphs, "_chosen", [])
    names = ["Donaudampfschifffahrt", "ramp-up-slowly", "𓀀"]
    with figure_files.full_size():
        for width, shown in (
            (2.0, [*names[:2], r"\U00013000"]),
            (7.0, ["Donaudampf\nschifffahr\nt", "ramp-up-\nslowly"]),
        ):
            with style.drawn(tmp_path / "figure", width, 2.0) as figure:
                axes = figure.subplots()
                style.name_ticks(axes, names)
            assert [tick.get_text() for tick in axes.get_xticklabels()][: len(shown)] == shown


def test_designs_levels_go_by_their_codes_in_figures_where_no_font_has_their_labels(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(glyphs, "_installed", list)
    monkeypatch.setattr(glyphs, "_chosen", [])
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: shown.append(figure))
    factors = {"method": {"levels": ["strong", "weak"], "labels": {"strong": "𓀀 鳥", "weak": "Weak"}}}
    rating = {"kind": "rating", "text": "?", "minimum": 0, "maximum": 10, "grain": 1}
    table = pd.DataFrame({"participant_id": ["P1", "P1"], "method": ["strong", "weak"], "real": [3, 4]})
    found = summarise(design(factors=factors, questions={"real": rating}), table)
    write_figures(tmp_path, ReportData(title="T", statistics=StudyStatistics(designs={"test": found})))
    assert [tick.get_text() for tick in shown[0].axes[0].get_xticklabels()] == ["strong", "Weak"]


def test_a_report_of_ten_methods_has_tables_instead_of_long_paragraphs(ten: StudyStatistics) -> None:
    found = sections(ReportData(title="Ten", statistics=ten))
    assert max(len(text) for section in found for text in section.paragraphs) < 900
    assert max(len(picture.alt) for section in found for picture in section.pictures) < 900
    pairs = [table for section in found for table in section.tables if len(table.rows) == 45]
    assert len([table for table in pairs if "Tukey" in table.caption]) >= 2


# terminals


@pytest.mark.parametrize("columns", [20, 40, 60, 80, 120, 200])
def test_a_table_is_readable_at_any_width(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    state = "in progress, 3 of 60 trials, last record Mon 2 Nov 2026, 12:10\nvibration > asymmetric-1 > asymmetric-2"
    row = ("P01", "25", "female", "right", state, "not begun", "excluded: withdrew")
    header = ("code", "age", "sex", "hand", "direction", "preference", "remark")
    text = with_tables(Section(title="A study", tables=(Table(caption="", header=header, rows=(row,)),)))
    assert all(text_columns(line) <= columns for line in text.splitlines())
    if columns >= 40:
        words = set(re.split(r"[\s│┃]+", text))
        assert {word for cell in row for word in cell.split()} <= words | {word.rstrip(":") for word in words}


def test_nothing_in_a_table_is_taken_for_a_picture() -> None:
    text = with_tables(Section(title="", tables=(Table(caption="", header=("a :cat:",), rows=((":dog: [b]",),)),)))
    assert "a :cat:" in text
    assert ":dog: [b]" in text


# messages


def test_a_full_disk_names_the_file_that_did_not_fit(tmp_path: Path) -> None:
    descriptor = os.open("/dev/full", os.O_WRONLY)
    try:
        with pytest.raises(OSError, match="No space left") as raised, storage.errors_name(tmp_path / "table.csv"):
            storage.write_all(descriptor, b"data")
    finally:
        os.close(descriptor)
    assert raised.value.filename == str(tmp_path / "table.csv")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", ["simulate", "simulate --json"])
def test_a_full_disk_behind_the_output_is_told(words: str) -> None:
    done = subprocess.run(f"{RECOIL} {words} > /dev/full", shell=True, capture_output=True, text=True, check=False)  # noqa: S602
    assert (done.returncode, done.stderr) == (2, "recoil: the output: No space left on device\n")


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (["analyze", "", "--out", "out"], "what stands after analyze"),
        (["simulate", "--plot="], "--plot="),
        (["run", "direction", "--participant", "P01", "--results", ""], "what stands after --results"),
    ],
)
def test_an_empty_word_is_not_the_folder_where_one_is(
    recoil: Recoil, tmp_path: Path, words: list[str], where: str
) -> None:
    done = recoil(*words)
    assert (done.returncode, done.stderr.startswith(f"recoil: {where}: is empty; give a value")) == (2, True)
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == []


def test_a_number_that_is_just_beyond_its_range_is_told_with_all_its_digits(tmp_path: Path) -> None:
    rows = rating_rows("P01")
    path = write_rows(ratings_path(tmp_path, "P01"), [row | {"rating": "10.0000001"} for row in rows])
    (problem,) = read_logs([path]).problems
    assert "rating 10.0000001 is out of range (rule: 0 to 10)" in problem.message


def test_the_guard_is_on_what_programs_read_as_formulas_alone() -> None:
    assert [guard(text) for text in ("=1", "@x", "-3", "+4", "'a", "plain", "1=2")] == [
        *("'=1", "'@x", "'-3", "'+4", "''a"),
        *("plain", "1=2"),
    ]


def test_a_closed_standard_output_is_no_error() -> None:
    done = subprocess.run(f"{RECOIL} simulate >&-", shell=True, capture_output=True, text=True, check=False)  # noqa: S602
    assert (done.returncode, done.stderr) == (0, "")


def test_nothing_takes_the_place_of_a_journal(tmp_path: Path) -> None:
    journal = tmp_path / "sub-P01_task-direction_journal.jsonl"
    journal.write_text("what was said")
    with pytest.raises(FileExistsError, match="is the journal of a run, which nothing replaces"):
        storage.write_whole(journal, b"a table")
    assert journal.read_text() == "what was said"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("sub-P01_task-direction_trials.csv", ["--trace"]),
        ("gun.toml", ["--trace"]),
        ("other.csv", ["--trace"]),
        ("other.csv", ["--method", "vibration", "--trace"]),
        ("other.csv", ["--vary", "voltage_V=10:20:3", "--table"]),
        ("other.parquet", ["--vary", "voltage_V=10:20:3", "--table"]),
    ],
)
def test_tables_of_shots_replace_each_other_and_nothing_else(
    recoil: Recoil, tmp_path: Path, name: str, words: list[str]
) -> None:
    file = tmp_path / name
    file.write_text("name,age\nsomebody's,7\n")
    done = recoil("simulate", *words, file)
    option = words[-1]
    said = f"recoil: {option} {file}: holds something else, which is not replaced; name another file\n"
    assert (done.returncode, done.stderr) == (2, said)
    assert file.read_text() == "name,age\nsomebody's,7\n"
    file.write_bytes(b"")  # as a program that gives out names leaves it
    assert recoil("simulate", *words, file).returncode == 0
    assert recoil("simulate", "--set", "pulse_s=0.02", *words, file).returncode == (2 if "vibration" in words else 0)
    if "--table" in words:
        assert recoil("simulate", "--vary", "pulse_s=0.01,0.02", "--table", file).returncode == 0
