from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from analysis.report.section import Section
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.quality import quality_section
from analysis.summary.sections.supplement import TITLES, supplement_sections
from tests.made_scores import CEILING, ONE_AT_CEILING, RIGHT, ratings_of, study_of


@pytest.fixture(scope="module")
def direction(tmp_path_factory: pytest.TempPathFactory) -> Section:
    statistics = study_of(tmp_path_factory.mktemp("study"), RIGHT)
    (section,) = supplement_sections(ReportData(title="T", statistics=statistics))
    return section


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        "Mauchly's W = .54, χ²(2) = 7.34, p = .025",
        "Greenhouse-Geisser corrected (ε = .69): F(1.37, 17.84) = 36.52, p < .001",
        "Huynh-Feldt corrected (ε = .74): F(1.48, 19.24) = 36.52, p < .001",
        "Partial η² = .74, 90 % CI [0.54, 0.81], 95 % CI [0.50, 0.82]; generalised η² = .64",
        "χ²(2) = 25.53, p < .001, Kendall's W = .91",
        "Mancl & DeRouen",
        "r = 0.707",
        "W = .95, p = .059",
    ],
)
def test_the_section_says_in_the_style_of_the_apa(words: str, direction: Section) -> None:
    assert words in "\n".join(direction.paragraphs)


def test_the_pairs_stand_side_by_side_with_every_test(direction: Section) -> None:
    pairs = direction.tables[0]
    assert pairs.rows[0][:3] == ("Asymmetric Force I − Vibration", "< .001", ".001")
    assert pairs.rows[2][0] == "Asymmetric Force II − Asymmetric Force I"
    assert all(len(row) == len(table.header) for table in direction.tables for row in table.rows)


def test_the_planned_test_is_marked_among_the_pairs(direction: Section) -> None:
    assert [name for name in direction.tables[0].header if "Planned" in name] == ["Planned: Tukey, pooled error"]
    assert any("Whoever registered another test reports that" in text for text in direction.paragraphs)


def test_assumptions_are_said_and_those_that_do_not_hold_stand_with_the_data(tmp_path: Path) -> None:
    report = ReportData(title="T", statistics=study_of(tmp_path, RIGHT))
    (further,), (quality,) = supplement_sections(report), quality_section(report)
    assert "Assumed: Participants are independent of each other" in further.paragraphs[-1]
    told = "\n".join(quality.items)
    assert told.count("sphericity does not hold") == 1
    assert "Direction recognition: participants score at an end of the scale" in told
    assert "Asymmetric Force II (ceiling 10 of 14)" in told
    assert "asymmetric-2" not in told


def test_ratings_have_no_model_of_answers(tmp_path: Path) -> None:
    (section,) = supplement_sections(ReportData(title="T", statistics=ratings_of(tmp_path, RIGHT)))
    assert section.title == TITLES["preference"]
    assert len(section.tables) == 1
    assert "odds" not in " ".join(section.paragraphs)


@pytest.mark.slow
def test_separation_is_told_instead_of_a_table(tmp_path: Path) -> None:
    (section,) = supplement_sections(ReportData(title="T", statistics=study_of(tmp_path, ONE_AT_CEILING)))
    assert any(
        "Asymmetric Force II (every answer right); no contrast is given" in words for words in section.paragraphs
    )
    assert not any("Odds ratios" in table.caption for table in section.tables)


@pytest.mark.slow
def test_reasons_stand_where_there_are_no_numbers(tmp_path: Path) -> None:
    (section,) = supplement_sections(ReportData(title="T", statistics=study_of(tmp_path, CEILING)))
    told = "\n".join(section.paragraphs)
    assert "Sphericity: There is no error variance" in told
    assert "Friedman test: Every participant scores all conditions alike" in told
    assert "None" not in told
    assert "nan" not in told


def test_odds_that_nobody_reads_to_the_last_digit_are_printed_as_bounds(tmp_path: Path) -> None:
    statistics = study_of(tmp_path, RIGHT)
    assert statistics.direction is not None
    model = statistics.direction.model
    first, *rest = model.fit.contrasts
    wide = replace(model.fit, contrasts=(replace(first, ci_low=3e-9, ci_high=7.4e16), *rest))
    direction = replace(statistics.direction, model=replace(model, fit=wide))
    (section,) = supplement_sections(ReportData(title="T", statistics=replace(statistics, direction=direction)))
    (table,) = (table for table in section.tables if "Odds ratios" in table.caption)
    assert table.rows[0][2] == "[< 0.01, > 1000]"
