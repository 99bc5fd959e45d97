"""What a reader meets first: whose answers these are, who was left out, the results, and words for a paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from analysis.logs.exclusions import LeftOut
from analysis.logs.reading import read_logs
from analysis.paper.paper import ComparisonRow
from analysis.stats.diagnostics import Corrected
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.experiments import effect_sentence
from analysis.summary.sections.manuscript import manuscript_section
from analysis.summary.sections.participants import left_out_lines, notices
from analysis.summary.sections.sections import sections
from analysis.summary.summary import summarize
from tests.log_files import trial_rows, trials_path, write_rows, write_study
from tests.made_scores import RIGHT, study_of


def report_of(folder: Path) -> ReportData:
    logs = read_logs([folder])
    return ReportData(title="T", statistics=summarize(logs), files=logs.files)


def answered(folder: Path, people: int, source: str, gun: str) -> ReportData:
    for i in range(1, people + 1):
        rows = [row | {"response_source": source, "gun": gun} for row in trial_rows(f"P{i:02d}", i)]
        write_rows(trials_path(folder, f"P{i:02d}"), rows)
    return report_of(folder)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("people", "source", "gun", "said"),
    [
        (2, "synthetic", "simulated", [("warning", "SYNTHETIC DATA: simulated participants answered.")]),
        (2, "experimenter", "simulated", [("warning", "SIMULATED GUN: 120 of 120 trials were rendered by no gun")]),
        (2, "participant", "VCG:007", [("note", "120 answers of people on the gun VCG:007.")]),
        (2, "participant", "pneumatic gun", [("note", "120 answers of people on pneumatic gun.")]),
        (2, "participant", "not stated", [("note", "120 answers of people on a gun that the logs do not name.")]),
        (2, "participant", "", [("note", "120 answers of people; the logs name no gun.")]),
        (1, "participant", "VCG:007", [("note", "60 answers of people"), ("warning", "ONE PARTICIPANT in direction")]),
    ],
)
def test_the_lines_on_top_say_whose_answers_these_are(
    people: int, source: str, gun: str, said: list[tuple[str, str]], tmp_path: Path
) -> None:
    found = list(notices(answered(tmp_path, people, source, gun)))
    assert [notice.kind for notice in found] == [kind for kind, _ in said]
    for notice, (_, words) in zip(found, said, strict=True):
        assert notice.text.startswith(words)


def test_people_rebuilt_from_published_numbers_are_said_to_replicate_nothing(tmp_path: Path) -> None:
    report = replace(answered(tmp_path, 2, "synthetic", "simulated"), reconstructed=True)
    (notice,) = notices(report)
    assert "it replicates nothing" in notice.text


def test_real_and_synthetic_answers_in_one_log_are_evidence_of_nothing(tmp_path: Path) -> None:
    """As of a simulated participant at the console whose answers somebody corrects."""
    rows = [row | {"gun": "simulated"} for row in trial_rows("P01")]
    rows[0] |= {"response_source": "experimenter", "response_time_valid": "0"}
    write_rows(trials_path(tmp_path, "P01"), rows)
    (notice, _) = notices(report_of(tmp_path))
    assert notice.text.startswith("SYNTHETIC AND REAL DATA TOGETHER: 59 of 60 answers")


@pytest.mark.slow
def test_sections_come_in_the_readers_order_and_the_appendix_last(tmp_path: Path) -> None:
    report = report_of(write_study(tmp_path, participants=4))
    row = ComparisonRow(experiment="direction", quantity="participants", published="4", obtained=4, verdict="agrees")
    found = sections(replace(report, comparison=(row,)))
    body = [section.title for section in found if not section.appendix]
    results = ["Who was analysed", "Results", "Direction recognition", "Preference", "For your paper", "Data quality"]
    further = ["Direction recognition: further statistics", "Preference: further statistics", "Speed and accuracy"]
    assert body == results + further
    appendix = [section.title for section in found if section.appendix]
    assert [section.title for section in found] == body + appendix
    assert appendix.index("Published and obtained") < appendix.index("Log files")
    tables = [table for section in found if not section.appendix for table in section.tables]
    assert len(tables) <= 12


@pytest.mark.slow
def test_the_paper_is_named_only_where_there_is_one(tmp_path: Path) -> None:
    report = report_of(write_study(tmp_path, participants=3))
    told = repr(sections(report))
    assert "paper's" not in told
    assert "in the paper" not in told
    row = ComparisonRow(experiment="direction", quantity="participants", published="3", obtained=3, verdict="agrees")
    assert "As in the paper's Figure 8" in repr(sections(replace(report, comparison=(row,))))


@pytest.mark.slow
def test_the_words_for_a_paper_have_n_exclusions_effect_sizes_exact_p_and_software(tmp_path: Path) -> None:
    """The data of the R tests: F(2, 26) = 36.52 by afex; p by the F distribution (scipy.stats.f.sf): 2.8e-8."""
    rule = "every trial is answered"
    gone = [LeftOut(experiment="direction", participant=f"P{i}", reason="x", rule=rule) for i in (15, 16)]
    statistics = replace(study_of(tmp_path, RIGHT, timed=False), excluded=tuple(gone))
    (section,) = manuscript_section(ReportData(title="T", statistics=statistics))
    told = "\n".join(section.quotes)
    for words in (
        "14 synthetic participants were analysed. 2 further participants were left out: 2 for unanswered trials.",
        "10 forward and 10 backward shots with each of 3 rendering methods (Vibration, Asymmetric Force I, Asymmetric",
        "F(2, 26) = 36.52, p = 2.8 × 10⁻⁸, partial η² = .74, 90 % CI [.54, .81], generalised η² = .64.",
        "Asymmetric Force II was above Vibration, by ",
        ", d_z = ",
        "Software. The data were analysed with Recoil ",
    ):
        assert words in told
    assert "p < .001" not in told


def test_an_F_of_two_people_is_not_printed_without_a_caution(tmp_path: Path) -> None:
    found = report_of(write_study(tmp_path, participants=2)).statistics.preference
    assert found is not None
    assert "partial η² = .73. Two people are too few to say anything of others" in effect_sentence(found, "preference")


def test_an_effect_that_the_corrected_test_does_not_have_is_told_with_its_corrected_p(tmp_path: Path) -> None:
    """p and the corrected p on both sides of .05: who copies the sentence copies the warning."""
    found = report_of(write_study(tmp_path, participants=3)).statistics.preference
    assert found is not None
    assert found.anova is not None
    assert found.supplement is not None
    assert "sphericity" not in effect_sentence(found, "preference", full=True)
    corrected = Corrected(epsilon=0.6, df=(1.2, 2.4), p=0.072)
    spherical = replace(found.supplement.sphericity, greenhouse_geisser=corrected)
    changed = replace(
        found, anova=replace(found.anova, p=0.031), supplement=replace(found.supplement, sphericity=spherical)
    )
    said = (
        "on the rating (not significant once corrected for sphericity: Greenhouse–Geisser ε = .60, p = .072), F(2, 4)"
    )
    assert said in effect_sentence(changed, "preference")


def test_who_was_left_out_stands_under_one_rule_with_the_remedy(tmp_path: Path) -> None:
    report = report_of(write_study(tmp_path, participants=2))
    rule, remedy = "every trial is answered", "ask again"
    gone = [
        LeftOut(experiment="direction", participant=f"P{i}", reason=f"{i} of 60", rule=rule, remedy=remedy)
        for i in (3, 4)
    ]
    (line,) = left_out_lines(replace(report, statistics=replace(report.statistics, excluded=tuple(gone))))
    people = "2 participants left out: P3 (3 of 60), P4 (4 of 60)."
    assert line == f"Direction recognition: {people} Rule: {rule}. Remedy: {remedy}."


def test_the_interval_of_a_mean_rate_stays_on_its_scale(tmp_path: Path) -> None:
    """By Cousineau and Morey's formula alone the upper end is at 101 %: 13 of 14 at 10 of 10, and one at 9."""
    right = RIGHT.copy()
    right[:, 2] = 10
    right[0, 2] = 9
    found = study_of(tmp_path, right, timed=False).direction
    assert found is not None
    assert found.within_ci is not None
    ends = found.within_ci["asymmetric-2"]
    assert found.means["asymmetric-2"] < 1.0 == ends.ci_high
    assert 0.0 <= ends.ci_low < found.means["asymmetric-2"]
