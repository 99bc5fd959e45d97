from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.logs.exclusions import LeftOut
from analysis.logs.files import Problem
from analysis.logs.reading import Logs, read_logs
from analysis.paper.paper import Paper, load_paper
from analysis.paper.recurrence import odds_of
from analysis.summary.comparison import compare
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.sections import write_report
from analysis.summary.summary import summarize
from tests import figure_files
from tests.log_files import rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study
from tests.made_scores import crowd_of
from tests.shown_panels import shot_panel

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    return read_logs([write_study(tmp_path_factory.mktemp("study"))])


@pytest.fixture(scope="module")
def paper() -> Paper:
    return load_paper(Path(__file__).parent.parent / "configs" / "paper.toml")


@pytest.fixture(scope="module")
def report(logs: Logs, paper: Paper) -> ReportData:
    left_out = LeftOut(experiment="direction", participant="P15", reason="3 of 60 trials unanswered")
    statistics = replace(summarize(logs), excluded=(left_out,))
    problem = Problem(file=Path("sub-<b>_trials.csv"), line=7, column="response", message="'left' is not allowed")
    return ReportData(
        title="Recoil & co: a <study>",
        statistics=statistics,
        problems=(problem,),
        comparison=compare(statistics, paper),
        odds=(odds_of("direction", {"all below": np.arange(100) < 33}, "Assumed: no spread."),),
        panels=(shot_panel(), shot_panel(0.05)),
        files=logs.files,
        provenance={"seed": "1"},
        notes=("The coil is shorted after the pulse.",),
    )


@pytest.fixture(scope="module")
def full(report: ReportData, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report") / "out"
    with figure_files.drawn():
        write_report(out, report)
    return out


def _text(page: str) -> str:
    """What a reader sees, in one line."""
    body = re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL)
    return html.unescape(" ".join(re.sub(r"<[^>]+>", " ", body).split()))


def test_everything_that_the_contract_names_is_written(full: Path) -> None:
    names = sorted(str(path.relative_to(full)) for path in full.rglob("*") if path.is_file())
    stems = ("conditional-accuracy", "directions", "quantile-probability", "response-times", "results", "shot")
    figures = [f"figures/figure-{stem}.{kind}" for stem in stems for kind in ("pdf", "png", "svg")]
    assert names == [*figures, "report.html", "report.md", "statistics.json"]


@pytest.mark.parametrize(
    "words",
    [
        "Participants, answers and trials of 28 log files",
        "Vibration",
        "percentage points, 95 % CI [",
        "partial η² = .",
        "There are 840 valid response times.",
        "The correct rate on forward shots of 14 synthetic participants: Vibration: M = ",
        "SYNTHETIC DATA: simulated participants answered.",
        "Planned comparisons (Tukey's HSD): Asymmetric Force I was above Vibration, p",
        "The 95 % CI is within-subject (Cousineau–Morey)",
        "pooled error term of the repeated-measures ANOVA",
        "ignores that trials come in people",
        "One replication is luck",
        "33.0 % [24.6, 42.7]",
        "Assumed: no spread.",
        "Direction recognition: 1 participant left out: P15 (3 of 60 trials unanswered).",
        "line 7, column response: 'left' is not allowed",
        "The coil is shorted after the pulse.",
        "28.45",
        "not published",
    ],
)
def test_the_html_says(words: str, full: Path) -> None:
    assert words in _text((full / "report.html").read_text(encoding="utf-8"))


def test_F_is_written_in_the_style_of_the_apa(full: Path) -> None:
    statistics = json.loads((full / "statistics.json").read_text(encoding="utf-8"))
    F = f"F(2, 26) = {statistics['direction']['anova']['F']:.2f}, p < .001"
    assert F in (full / "report.md").read_text(encoding="utf-8")


def test_the_html_stands_alone(full: Path) -> None:
    page = (full / "report.html").read_text(encoding="utf-8")
    assert "<script" not in page
    addresses = re.findall(r'(?:src|href)="([^"]*)"', page)
    beside = [address for address in addresses if not address.startswith(("data:image/png;base64,", "#"))]
    assert beside == ["statistics.json"]
    assert (full / "statistics.json").is_file()
    assert "url(" not in page
    assert "@import" not in page
    assert len(re.findall(r'<img [^>]*alt="[^"]{40,}"', page)) == 6
    for words in ("prefers-color-scheme: dark", "@media print", 'name="viewport"', 'class="scroll'):
        assert words in page


def test_in_print_everything_is_measured_by_one_size_of_letters(full: Path) -> None:
    """Tables and captions are in rem, which are of the root: a size of the body alone made paragraphs the smallest."""
    page = (full / "report.html").read_text(encoding="utf-8")
    printed = page[page.index("@media print") : page.index("</style>")]
    assert re.findall(r"([\w, :]+) \{[^{}]*font-size", printed) == ["  :root"]


def test_what_was_typed_is_never_markup(full: Path) -> None:
    page = (full / "report.html").read_text(encoding="utf-8")
    assert "<title>Recoil &amp; co: a &lt;study&gt;</title>" in page
    assert "sub-&lt;b&gt;_trials.csv" in page


def test_the_markdown_links_its_figures_and_keeps_its_tables_whole(full: Path) -> None:
    text = (full / "report.md").read_text(encoding="utf-8")
    for target in re.findall(r"\((figures/[^)]+)\)", text):
        assert (full / target).is_file()
    blocks = re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE)
    assert len(blocks) >= 9
    for block in blocks:
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}) == 1


def test_statistics_json_is_unrounded_and_complete(full: Path, logs: Logs) -> None:
    found = json.loads((full / "statistics.json").read_text(encoding="utf-8"))
    expected = summarize(logs).to_dict()
    assert {key: found[key] for key in ("direction", "preference")} == {
        key: expected[key] for key in ("direction", "preference")
    }


def test_the_same_report_is_the_same_bytes_without_dates_and_versions(
    full: Path, report: ReportData, tmp_path: Path
) -> None:
    with figure_files.drawn("svg"):
        write_report(tmp_path, report)
    names = [path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()]
    assert {name.suffix for name in names} == {".html", ".md", ".json", ".png", ".svg"}
    for name in names:
        content = (full / name).read_bytes()
        assert content == (tmp_path / name).read_bytes(), name
        assert not re.search(rb"CreationDate|<dc:date>|Producer|matplotlib v", content), name


def _titles(out: Path) -> list[str]:
    """Of all sections, those of the appendix last."""
    text = html.unescape((out / "report.html").read_text(encoding="utf-8"))
    return re.findall(r"<h[23]>(.*?)</h[23]>", text)


_ENDS = ("Provenance and assumptions",)


def test_sections_without_data_are_left_out(tmp_path: Path) -> None:
    write_study(tmp_path / "study", participants=3)
    logs = read_logs(sorted((tmp_path / "study").rglob("*_ratings.csv")))
    write_report(tmp_path / "out", ReportData(title="Ratings", statistics=summarize(logs)))
    titles = _titles(tmp_path / "out")
    further = ("Data quality", "Preference: further statistics", "Every participant's values")
    assert titles == ["Who was analysed", "Results", "Preference", "For your paper", *further, *_ENDS]
    assert {path.stem for path in (tmp_path / "out" / "figures").iterdir()} == {"figure-results"}


def test_a_report_of_nothing_says_so(tmp_path: Path) -> None:
    statistics = summarize(read_logs([tmp_path]))
    write_report(tmp_path / "out", ReportData(title="Nothing", statistics=statistics))
    assert "There was nothing to analyse." in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert not (tmp_path / "out" / "figures").exists()


def test_one_participant_gets_means_and_no_tests(tmp_path: Path) -> None:
    statistics = summarize(read_logs([write_study(tmp_path / "study", participants=1)]))
    write_report(tmp_path / "out", ReportData(title="One", statistics=statistics))
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "There were too few participants or methods for a test." in text
    assert "> **ONE PARTICIPANT in direction recognition and preference: " in text
    assert "(SD)" not in text.split("## Results")[1].split("## Direction")[0]


def test_where_all_scores_are_equal_the_page_says_in_words_that_nothing_differs(tmp_path: Path) -> None:
    for i in range(1, 4):
        rows = [row | {"rating": "5.0"} for row in rating_rows(f"P{i:02d}", i)]
        write_rows(ratings_path(tmp_path, f"P{i:02d}"), rows)
    write_report(tmp_path / "out", ReportData(title="Equal", statistics=summarize(read_logs([tmp_path]))))
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "Nothing differs: all scores are equal" in text
    assert "no pair of methods differs at all" in text
    assert "p undefined" not in text


def test_files_are_named_below_their_common_folder_not_by_the_machine(tmp_path: Path) -> None:
    write_study(tmp_path / "study", participants=2)
    broken = tmp_path / "study" / "sub-P03_task-direction_trials.csv"
    broken.write_bytes(b"")
    logs = read_logs([tmp_path])
    data = ReportData(title="Files", statistics=summarize(logs), files=logs.files, problems=logs.problems)
    write_report(tmp_path / "out", data)
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert str(tmp_path) not in text
    assert "\n- sub-P01/sub-P01_task-direction_trials.csv\n" in text
    assert "\n- Left out: sub-P03_task-direction_trials.csv: is empty" in text


def test_no_p_is_zero_and_none_has_a_leading_zero_in_the_sentences(full: Path) -> None:
    text = (full / "report.md").read_text(encoding="utf-8")
    sentences = "\n".join(line for line in text.splitlines() if not line.startswith("|"))
    assert not re.search(r"p = \.000|p = 0", sentences)


def test_figures_and_tables_are_numbered_from_one(full: Path) -> None:
    """Those of the appendix apart: A1, A2, ..."""
    for name, mark in (("report.md", r"\*\*{} {}(\d+)\.\*\*"), ("report.html", r"<b>{} {}(\d+)\.</b>")):
        text = (full / name).read_text(encoding="utf-8")
        for kind, letter, count in (("Figure", "", 5), ("Figure", "A", 1), ("Table", "", 12), ("Table", "A", 8)):
            numbers = [int(number) for number in re.findall(mark.format(kind, letter), text)]
            assert numbers == list(range(1, count + 1)), (name, kind, letter)


def test_times_by_the_experimenters_hand_are_no_response_times(tmp_path: Path) -> None:
    for seed, code in enumerate(("P01", "P02")):
        rows = [row | {"response_source": "experimenter", "response_time_valid": "0"} for row in trial_rows(code, seed)]
        write_rows(trials_path(tmp_path / "study", code), rows)
    write_report(tmp_path / "out", ReportData(title="Hand", statistics=summarize(read_logs([tmp_path / "study"]))))
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "There is no valid response time, and so no figure of them. None in 120 answered trials" in text
    assert "figure-response-times" not in text
    assert not list((tmp_path / "out" / "figures").glob("figure-response-times.*"))


@pytest.fixture(scope="module")
def crowded(logs: Logs) -> ReportData:
    """Two thousand people: those of the study again and again."""
    statistics, n = summarize(logs), 2_000
    direction, preference = statistics.direction, statistics.preference
    assert direction is not None
    assert preference is not None
    medians = list(direction.response_times.participants.values())
    times = {f"P{i:05d}": medians[i % len(medians)] for i in range(n)}
    direction = replace(
        direction,
        n=n,
        participants=crowd_of(direction.participants, n),
        backward=replace(direction.backward, participants=crowd_of(direction.backward.participants, n)),
        response_times=replace(direction.response_times, participants=times),
        sensitivity={
            method: one and replace(one, participants=crowd_of(one.participants, n))
            for method, one in direction.sensitivity.items()
        },
    )
    preference = replace(preference, n=n, participants=crowd_of(preference.participants, n))
    statistics = replace(statistics, direction=direction, preference=preference)
    files = tuple(Path(f"/logs/sub-P{i:05d}_task-direction_trials.csv") for i in range(n))
    bad = tuple(Problem(file=file, line=1, column=None, message="is empty") for file in files)
    return ReportData(title="Two thousand", statistics=statistics, files=files, problems=bad)


def test_a_report_of_two_thousand_stays_short(crowded: ReportData, tmp_path: Path) -> None:
    with figure_files.drawn("svg"):  # a PDF is smaller
        write_report(tmp_path, crowded)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    for words in (
        "the first 50 of 2,000; everybody is in direction_wide.csv",
        "the first 50 of 2,000; everybody is in preference_wide.csv",
        "\n- and 1,950 more log files\n",
        "\n- and 1,988 more, listed in the appendix\n",
        "\n- and 1,950 more, all in statistics.json: who was left out under “excluded”, the rest under “log",
        "2,000 synthetic participants",
    ):
        assert words in text
    assert len(text.splitlines()) < 700
    assert max(path.stat().st_size for path in (tmp_path / "figures").iterdir()) < 1_000_000
    assert (tmp_path / "report.html").stat().st_size < 2_000_000
