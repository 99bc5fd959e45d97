"""The words for a paper count people, not entries; what stands in them of exclusions, ages and plans."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

import analysis.summary.analyze as feature
import recoil
from analysis.logs.reading import read_logs
from analysis.summary.participation import participation
from analysis.summary.sections import sections
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.exclusion_words import people_left_out
from analysis.summary.sections.experiments import direction_section
from analysis.summary.sections.manuscript import manuscript_section
from analysis.summary.sections.pictures import directions_picture
from analysis.summary.sections.quality import quality_section
from analysis.summary.sections.supplement import supplement_sections
from analysis.summary.summary import summarize
from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.record.rebuild import rebuild
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study import register
from tests.log_files import TextRow, rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study

Reported = Callable[..., ReportData]


@pytest.fixture
def reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Reported:
    """What `recoil analyze` would put on a page; no page is made."""
    numbers = count()

    def run(*paths: Path, **asked: object) -> ReportData:
        found: list[ReportData] = []
        monkeypatch.setattr(sections, "write_report", lambda _, report, *__, **___: found.append(report))
        feature.analyze(feature.Request(paths=paths, out=tmp_path / f"out-{next(numbers)}", **asked))  # type: ignore[arg-type]
        return found[0]

    return run


def quotes(report: ReportData) -> str:
    (section,) = manuscript_section(report)
    return "\n".join(section.quotes)


def of_person(rows: list[TextRow], hand: str = "participant") -> list[TextRow]:
    """Rows as a person answers them at a gun."""
    by = "rating_by" if "rating" in rows[0] else "response_source"
    return [row | {by: hand, "gun": "RG-2:0007"} for row in rows]


def person(folder: Path, code: str, *, unanswered: int = 0, ratings: bool = False) -> None:
    seed = int(code[1:]) + 100 * len(folder.name)
    rows = of_person(trial_rows(code, seed))
    for row in rows[:unanswered]:
        row.update(response="", correct="", response_time_s="")
    write_rows(trials_path(folder, code), rows)
    if ratings:
        write_rows(ratings_path(folder, code), of_person(rating_rows(code, seed)))


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Three people who are analysed; two who miss answers, one listed by hand, one excluded, and what is nobody."""
    results = tmp_path / "results"
    for code in ("P01", "P02", "P03", "P07", "P08"):
        person(results, code)
    person(results, "P04", unanswered=2)
    person(results, "P05", unanswered=55)
    person(results, "P06", unanswered=55)
    write_rows(trials_path(results, "S01"), of_person(trial_rows("S01", 9), "synthetic"))
    for code in ("P01", "P09"):  # a second log of somebody who is analysed, and one of somebody who is not
        link = results / f"sub-{code}" / f"sub-{code}_task-direction_run-2_trials.csv"
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(results / "nowhere.csv")
    facts = ({"age_years": 20, "sex": "female", "handedness": "right"}, {"age_years": 25, "sex": "male"})
    for code, known in zip(("P01", "P02"), facts, strict=True):
        register.append(results, register.entry("joined", code, facts=known), VirtualClock())
    register.append(results, register.entry("excluded", "P08", reason="fell ill"), VirtualClock())
    return results


RULES = """
[trials]
drop_unanswered = true
response_time_min_s = 0.7
[participants]
min_kept_share = 0.5
[[excluded]]
code = "P06"
reason = "left-handed"
"""


@pytest.mark.slow
def test_each_person_is_left_out_once_in_plain_words_with_the_dropped_trials(
    study: Path, reported: Reported, tmp_path: Path
) -> None:
    (tmp_path / "rules.toml").write_text(RULES)
    report = reported(study, rules=tmp_path / "rules.toml")
    said = quotes(report)
    assert (
        "5 participants (age of 2 of them: M = 22.5, SD = 3.5, 20 to 25 years; 1 female, 1 male, 3 of unknown " in said
    )
    assert "4 further participants were left out: " in said
    for reason in (
        "1 by hand (left-handed)",
        "1 by hand (fell ill)",
        "1 for too few trials kept (fewer than 50 % of them)",
        "1 for a log that could not be used",
    ):
        assert reason in said
    assert "Of 420 recorded trials " in said
    assert "112 without an answer" in said
    assert "with a response time below 0.7 s" in said
    assert not any(word in said for word in ("min_kept_share", "drop_", "never together", "trusted", "synthetic"))


@pytest.mark.slow
def test_of_a_design_dropped_trials_and_stopped_runs_are_told_with_who_was_analysed(
    tmp_path: Path, reported: Reported
) -> None:
    setup, results = load_setup("realism"), tmp_path / "study" / "results"
    for code in ("P01", "P02", "P03"):
        asked = RunRequest(setup=setup, participant_id=code, results=results, seed=1, screen="synthetic")
        journal = run(asked, synthetic_screen, VirtualClock()).place.journal
    assert "stopped" not in quotes(reported(results))
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[: len(lines) // 2]))
    table, content, _ = rebuild(journal)
    table.write_bytes(content)
    (tmp_path / "rules.toml").write_text("[trials]\ndrop_unanswered = true\n")
    said = quotes(reported(results, rules=tmp_path / "rules.toml"))
    assert "The run of 1 of the 3 was stopped before its end; what was answered up to there is analysed." in said
    assert "Of 36 planned trials 6 (16.7 %) were dropped: 6 without an answer." in said


@pytest.mark.slow
def test_who_is_listed_by_hand_is_told_so_though_a_rule_would_leave_them_out(
    study: Path, reported: Reported, tmp_path: Path
) -> None:
    (tmp_path / "rules.toml").write_text(RULES)
    excluded = reported(study, rules=tmp_path / "rules.toml").statistics.excluded
    assert {(one.rule, one.reason) for one in excluded if one.participant == "P06"} == {("excluded", "left-handed")}
    assert next(one.rule for one in excluded if one.participant == "P05") == "min_kept_share"


@pytest.mark.slow
def test_a_title_is_alike_for_a_folder_and_for_its_files(study: Path, reported: Reported) -> None:
    files = sorted(study.rglob("*_trials.csv"))
    assert reported(study).title == reported(*files[::-1]).title == "Statistics of results"


def test_a_lab_without_an_experiment_has_nobody_who_has_not_done_it(tmp_path: Path) -> None:
    for code in ("P01", "P02"):
        person(tmp_path / "kyoto", code, ratings=code == "P01")
        person(tmp_path / "oslo", code)
    logs = read_logs([tmp_path / "kyoto", tmp_path / "oslo"])
    who = tuple(logs.trials["participant_id"].unique())
    found = participation(logs, {"direction": who, "preference": ("kyoto/P01",)}, ())
    assert [one.participant for one in found.absent] == ["kyoto/P02"]
    assert (found.experiments["direction"].not_done, found.experiments["preference"].not_done) == (0, 1)


COLUMNS = ("participant_id", "method", "direction", "response")
MAP = """
experiment = "direction"
[participant]
column = "who"
[columns]
method = "what"
direction = "way"
response = "said"
[values.direction]
forward = "forward"
backward = "backward"
[values.response]
forward = "forward"
backward = "backward"
"""


def test_of_logs_that_came_without_a_plan_nothing_is_called_planned(tmp_path: Path, reported: Reported) -> None:
    (tmp_path / "map.toml").write_text(MAP)
    rows = [trial_rows(code, seed) for seed, code in enumerate(("P01", "P02", "P03"))]
    theirs = [[row[name] for name in COLUMNS] for some in rows for row in some]
    text = "\n".join(",".join(row) for row in [["who", "what", "way", "said"], *theirs])
    (tmp_path / "lab.csv").write_text(text)
    report = reported(tmp_path / "lab.csv", columns=tmp_path / "map.toml")
    words = repr([*manuscript_section(report), *direction_section(report), *supplement_sections(report)])
    assert "Comparisons of all pairs" in words
    assert "lanned" not in words


def test_the_scale_of_a_paper_is_the_one_that_people_rated_on(tmp_path: Path, reported: Reported) -> None:
    (tmp_path / "map.toml").write_text(
        'experiment = "preference"\nparticipant.column = "who"\ncolumns = { method = "what", rating = "liked" }\n'
        "rating = { scale_min = 1, scale_max = 7, grain = 1 }\n"
    )
    (tmp_path / "lab.csv").write_text("who,what,liked\nA,x,1\nA,y,3\nA,z,5\nB,x,2\nB,y,5\nB,z,7\n")
    said = quotes(reported(tmp_path / "lab.csv", columns=tmp_path / "map.toml"))
    assert "was rated from 1 to 7. Ratings were rescaled linearly to 0 to 10." in said


@pytest.fixture
def careless(tmp_path: Path, reported: Reported) -> ReportData:
    """Two who say the same to everything, one who is always wrong, one without times, and one who has fewer trials."""
    flipped = {"forward": "backward", "backward": "forward"}
    for code, seed in (("P01", 1), ("P02", 2), ("P03", 3), ("P04", 4), ("P05", 5)):
        rows = of_person(trial_rows(code, seed))
        for row in rows:
            said = {"P01": "forward", "P02": "forward", "P03": flipped[row["direction"]]}.get(code, row["response"])
            row.update(response=said, correct=str(int(said == row["direction"])))
            row.update({"response_time_s": "", "response_time_valid": ""} if code == "P04" else {})
        kept = [row for row in rows if code != "P05" or int(row["trial"]) <= 15]
        write_rows(trials_path(tmp_path / "results", code), kept)
    return reported(tmp_path / "results")


def test_people_who_say_the_same_to_everything_are_named_and_kept(careless: ReportData) -> None:
    (section,) = quality_section(careless)
    told = "\n".join(section.items)
    assert "participants who said forward in every trial (kept): P01, P02." in told
    assert "participants who were wrong in every trial (kept): P03." in told
    assert "said backward" not in told


@pytest.mark.slow
@pytest.mark.parametrize("codes", [("P02",), ("P01", "P02", "P03")])
def test_people_without_backward_trials_are_reported_with_what_they_have(
    tmp_path: Path, reported: Reported, codes: tuple[str, ...]
) -> None:
    for code, seed in (("P01", 1), ("P02", 2), ("P03", 3)):
        rows = trial_rows(code, seed)
        for row in rows:
            felt = "forward" if code in codes else row["direction"]
            row.update(direction=felt, response="forward", correct=str(int(felt == "forward")))
        write_rows(trials_path(tmp_path / "results", code), rows)
    report = reported(tmp_path / "results")
    assert report.statistics.direction is not None
    caption = directions_picture(report.statistics.direction).caption
    assert f"Of {3 - len(codes)} of them there are backward shots by every method. " in caption
    (section,) = quality_section(report)
    named = [code for code in ("P01", "P02", "P03") if code not in codes]
    told = "\n".join(section.items)
    assert (f"said forward in every trial (kept): {', '.join(named)}." in told) is bool(named)


def test_numbers_of_trials_that_differ_are_said_as_they_are(careless: ReportData) -> None:
    said = quotes(careless)
    assert "the direction of shots with each of 3 rendering methods" in said
    assert re.search(
        r"; \d to 10 forward and \d to 10 backward trials of a participant with a method were analysed", said
    )
    (section,) = quality_section(careless)
    assert any("not everybody has as many trials" in item for item in section.items)


@pytest.mark.slow
def test_only_lines_that_are_drawn_are_promised(careless: ReportData, tmp_path: Path, reported: Reported) -> None:
    assert careless.statistics.direction is not None
    caption = directions_picture(careless.statistics.direction).caption
    assert "Dashed lines: guessing and the absence of bias." in caption
    whole = reported(write_study(tmp_path / "whole", participants=3)).statistics.direction
    assert whole is not None
    assert "the absence of bias, and the d′ of somebody who is always right" in directions_picture(whole).caption


@pytest.mark.slow
@pytest.mark.parametrize("way", ["forward", "backward"])
def test_of_trials_in_one_direction_nothing_is_promised_of_the_other(
    tmp_path: Path, reported: Reported, way: str
) -> None:
    for code, seed in (("P01", 1), ("P02", 2), ("P03", 3)):
        rows = [row | {"direction": way, "correct": str(int(row["response"] == way))} for row in trial_rows(code, seed)]
        write_rows(trials_path(tmp_path / "results", code), rows)
    write_rows(ratings_path(tmp_path / "results", "P01"), rating_rows("P01"))
    report = reported(tmp_path / "results")
    if way == "forward":
        (section,) = direction_section(report)
        assert "there is neither d′ nor criterion" in section.paragraphs[0]
        return
    (one, *_) = (entry for entry in report.statistics.excluded if entry.experiment == "direction")
    assert one.rule == "the measure is of forward trials"
    assert "apart" not in one.remedy
    said = people_left_out(report, "direction", frozenset())
    assert said == "3 further participants were left out: 3 for lack of forward trials."


def test_a_time_of_exactly_0_is_told_as_a_reason_for_having_none(tmp_path: Path, reported: Reported) -> None:
    for seed, code in enumerate(("P01", "P02")):
        rows = trial_rows(code, seed)
        rows[3]["response_time_s"] = "0.0"
        write_rows(trials_path(tmp_path / "results", code), rows)
    report = reported(tmp_path / "results")
    assert report.statistics.direction is not None
    assert report.statistics.direction.response_times.left_out == 2
    (section,) = quality_section(report)
    assert "None in 2 answered trials: there is no time in the log, or it is 0, or the" in section.paragraphs[0]


@pytest.mark.slow
def test_beside_designs_it_is_said_of_what_the_response_times_are(careless: ReportData, tmp_path: Path) -> None:
    (alone,) = quality_section(careless)
    assert "valid response times. None in" in alone.paragraphs[0]
    recoil.run_synthetic(recoil.load_config("stronger"), ["P01", "P02"], tmp_path / "beside", seed=1)
    designs = summarize(read_logs([tmp_path / "beside"])).designs
    (beside,) = quality_section(replace(careless, statistics=replace(careless.statistics, designs=designs)))
    assert "valid response times of direction recognition. None in" in beside.paragraphs[0]


def test_times_that_are_not_there_are_not_laid_on_the_experimenter(careless: ReportData) -> None:
    (section,) = quality_section(careless)
    assert "None in 60 answered trials: there is no time in the log, or it is 0, or " in section.paragraphs[0]
    assert careless.statistics.direction is not None
    found = careless.statistics.direction.speed_accuracy
    assert found is not None
    assert [*found.refused] == ["no_time"]
