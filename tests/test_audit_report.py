"""`recoil audit` and its report: two sentences a finding, exit codes, what is written."""

from __future__ import annotations

import json
import re
from fractions import Fraction
from pathlib import Path

import pytest

from analysis.paper.audit.binomial import binomial_p
from analysis.paper.audit.claims import AuditFinding
from analysis.paper.audit.freedom import degrees_of_freedom
from analysis.paper.audit.means import debit, grim, grimmer, percent_of_count
from analysis.paper.audit.one_number import mean_and_sd
from analysis.paper.audit.p_values import p_against_statistic
from analysis.paper.audit.page import (
    ELSEWHERE,
    counts,
    finding_entry,
    findings_text,
    nearest_text,
    other_rows,
    predictions,
    sections,
    sentences,
)
from analysis.paper.audit.printed import CheckResult
from analysis.paper.audit.run import audit, load_paper_file
from analysis.paper.audit.variance_ratios import between_f
from analysis.report.serial import plain
from experiments.config.door import ConfigError
from tests.conftest import Recoil

pytestmark = pytest.mark.slow

CONFIGS = Path(__file__).parent.parent / "configs"


@pytest.fixture(scope="module")
def findings() -> tuple[AuditFinding, ...]:
    return audit(load_paper_file(CONFIGS / "paper.toml"))


def of(result: CheckResult) -> AuditFinding:
    return AuditFinding(place="Results", quote="as printed", note="", result=result)


def text_of(findings: tuple[AuditFinding, ...], printed: str) -> str:
    (found,) = [finding for finding in findings if finding.result.printed == printed]
    return " ".join(sentences(found))


def test_every_finding_is_told_in_two_sentences(findings: tuple[AuditFinding, ...]) -> None:
    for finding in findings:
        said = sentences(finding)
        assert len(said) == 2
        assert all(sentence.endswith(".") and not re.search(r"[.] [A-Z]", sentence) for sentence in said), said


def test_the_finding_on_f_says_what_it_would_have_to_be_and_what_rescues_it(findings: tuple[AuditFinding, ...]) -> None:
    text = text_of(findings, "F = 28.45")
    assert "28.10 and 28.51" in text
    assert "arcsine transform" in text
    assert "steps of 0.05 with other means" in text


def test_a_wrong_percentage_is_told_with_the_count_that_has_it(findings: tuple[AuditFinding, ...]) -> None:
    assert "5 of 14 people are 35.7 %, not 33.7%; no count of them has that" in text_of(findings, "5 of 14, 33.7%")
    assert "4 of 14 people are 28.6 %, not 35.7%; that is the percentage of 5" in text_of(findings, "4 of 14, 35.7%")


@pytest.mark.parametrize(
    ("result", "nearest"),
    [
        (grim("5.19", 28), "5.179 and 5.214"),
        (grimmer("5.21", "1.63", 28), "SD 1.618 and SD 1.641"),
        (debit("0.35", "0.18", 20), "SD 0.489"),
        (binomial_p(".117", 20), "0.115 and 0.263"),
        (degrees_of_freedom(["2", "39"], "repeated", [14, 3]), ""),
    ],
)
def test_neighbours_are_shown_in_the_unit_of_what_is_printed(result: CheckResult, nearest: str) -> None:
    """5.179 is 145 / 28 and 5.214 is 146 / 28; 7 of 20 ones have SD sqrt(91 / 380) = 0.489; p(6 of 20) = 0.115."""
    assert nearest_text(result) == nearest
    assert nearest.partition(" ")[0] in sentences(of(result))[0]


def test_the_page_names_all_numbers_and_is_fair(findings: tuple[AuditFinding, ...]) -> None:
    parts = sections(findings, [("file", "paper.toml")])
    assert [part.title for part in parts] == [
        "Verdicts", "Numbers to ask about", "Every number", "Proofs", "Provenance",
    ]  # fmt: skip
    assert "not how it came about" in parts[0].paragraphs[0]
    assert len(parts[1].items) == 3
    assert len(parts[2].tables[0].rows) == len(findings)
    assert "Numbers to ask about" not in [part.title for part in sections([f for f in findings if not f.note][:3], [])]


def test_json_keeps_the_exact_fractions(findings: tuple[AuditFinding, ...]) -> None:
    (found,) = [plain(finding_entry(one)) for one in findings if one.result.printed == "F = 28.45"]
    assert Fraction(found["above"]["exact"]) == Fraction(27001, 947)
    assert found["readings"] == ["arcsine transform", "scores in steps of 0.05 with other means"]
    assert json.loads(json.dumps(found)) == found


def test_the_terminal_ends_with_the_counts_and_what_to_ask_about(findings: tuple[AuditFinding, ...]) -> None:
    text = findings_text(findings)
    assert f"{len(findings)} numbers: {counts(findings)['attainable']} attainable" in text
    assert text.count("“F(2,26)=28.45") == 1


def test_predictions_are_named_as_the_comparison_names_its_rows(findings: tuple[AuditFinding, ...]) -> None:
    known = predictions(findings)
    assert known["direction: ANOVA F"].nearest == pytest.approx((28.0968, 28.5121), abs=1e-4)
    assert known["direction: mean correct rate forward, vibration"].verdict == "attainable"
    others = list(other_rows(findings))
    assert {row.experiment for row in others} == {ELSEWHERE}
    assert [row.quantity for row in others if row.verdict == "not attainable"] == [
        "III.B, Results: does not like shooting with a gun (5 people, 33.7%)",
        "III.B, Results: Shooting becomes more stable (4 people, 35.7%)",
    ]


def test_the_command_writes_report_and_json_and_ends_with_1_for_this_paper(recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("audit", "--out", tmp_path / "out")
    found = json.loads((tmp_path / "out" / "audit.json").read_text(encoding="utf-8"))
    claims = len(found["findings"])
    assert done.returncode == 1
    assert re.fullmatch(rf"audit: .* {claims}/{claims} \S+\n", done.stderr), "how far it is"
    assert "2 not attainable" in done.stdout
    assert found["verdicts"]["not attainable"] == 2
    assert "33.7%" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "## Proofs" in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    shown = recoil("audit", "paper", "--json", "--out", tmp_path / "again")
    assert json.loads(shown.stdout)["findings"] == found["findings"]


def test_a_sound_paper_ends_with_0_and_an_example_of_another_field_is_told(recoil: Recoil, tmp_path: Path) -> None:
    text = (CONFIGS / "examples" / "audit.toml").read_text(encoding="utf-8")
    sound = tmp_path / "sound.toml"
    sound.write_text(text.replace('mean = "7.19"', 'mean = "7.18"'), encoding="utf-8")
    assert recoil("audit", sound).returncode == 0
    done = recoil("audit", CONFIGS / "examples" / "audit.toml")
    assert done.returncode == 1
    assert "7.19 is not attainable" in done.stdout


def test_a_tie_is_told_with_its_last_digit_and_the_convention() -> None:
    text = " ".join(sentences(of(percent_of_count("13%", 1, 8))))
    assert text.startswith("1 of 8, 13% is attainable: 1 of 8 is 12.5 %, printed half up.")
    assert sentences(of(percent_of_count("14%", 1, 8)))[0].startswith("1 of 8 people are 12.5 %, not 14%")


def test_of_a_statistic_that_cannot_be_the_rule_is_told() -> None:
    first, second = sentences(of(p_against_statistic("r", "1.2", ["10"], "< .001")))
    assert first == "r(10) = 1.2, p < .001 is not attainable: a correlation lies between -1 and 1."
    assert second.endswith("so it is misprinted, or rests on something that the paper does not state.")


@pytest.mark.parametrize(
    ("mean", "sd", "n", "ones"),
    [
        (".86", ".348", 150, "ones among the 150: 129, or 130 by truncation."),
        ("0.5", "0.51", 20, ": 10, or 9 by rounding half up, or 11 by rounding half down or truncation."),
        ("0.35", "0.49", 20, "ones among the 20: 7."),
    ],
)
def test_the_ones_that_print_a_mean_are_told_with_the_rounding_they_need(mean: str, sd: str, n: int, ones: str) -> None:
    """129 / 150 = 0.86 and 130 / 150 = 0.8667; 9, 10 and 11 of 20 are 0.45, 0.5 and 0.55."""
    assert sentences(of(debit(mean, sd, n)))[0].endswith(ones)


def test_the_nearest_sd_is_that_of_ones_that_print_the_mean_as_ordinarily_rounded() -> None:
    """sqrt(129 * 21 / (150 * 149)) = 0.3481; 130 ones, which print as .87, would have 0.3411."""
    assert nearest_text(debit(".86", ".100", 150)) == "SD 0.3481"


def test_the_counts_that_print_a_percentage_are_told_with_the_rounding_they_need() -> None:
    first = sentences(of(percent_of_count("86%", 100, 150)))[0]
    assert first == "100 of 150 people are 67 %, not 86%; that is the percentage of 129, or 130 by truncation."


def test_the_counts_that_give_a_p_are_told_with_the_rounding_they_need() -> None:
    """By scipy, binomtest(15, 40) has p = 0.154 and binomtest(16, 40) p = 0.268."""
    assert "The counts of 40 that give p: 15, 25, or 16, 24 by truncation." in sentences(of(binomial_p(".2", 40)))


def test_of_a_mean_beyond_its_scale_that_is_said_first() -> None:
    found = mean_and_sd("7.2", 20, "1.1", "1-5")
    assert found.exceptions
    assert found.as_text().startswith("mean: not attainable. 7.2 lies beyond the scale of 1 to 5: no scores on it")
    assert mean_and_sd("5.0", 20, None, "1-5").off_scale is None


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("3.2", 20, "1.1", "5-1"), "--scale: 5-1 begins with its upper end"),
        (("3.2", 20, "1.1", "1-1"), r"--scale: 1-1 has the same end twice \(rule: two ends that differ, the lower"),
        (("3.2", 20, "-1.1", "1-5"), "--sd: -1.1 is below 0"),
        (("3", 1, "0.5", "1-5"), "--sd: one score has no standard deviation"),
    ],
)
def test_what_no_data_can_have_is_refused_by_its_option(given: tuple[str, int, str, str], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        mean_and_sd(*given)


def test_of_one_mean_no_file_is_named() -> None:
    """Its JSON goes to the screen, with the data that give it."""
    found = plain(mean_and_sd("3.48", 23).mean)
    assert found["sentences"][1].endswith("data that give it are in the JSON, as `data`.")
    assert found["data"]


def test_one_number_is_one_number() -> None:
    assert "\n1 number: 1 attainable." in findings_text([of(grim("5.21", 28))])


def test_of_an_f_whose_means_cannot_be_these_are_named() -> None:
    """49/12 = 4.08 and 50/12 = 4.17; 63/12 = 5.25 and 64/12 = 5.33; 75/12 = 6.25."""
    said = sentences(of(between_f("8.50", (12, 12, 12), ("4.10", "5.30", "6.25"))))[0]
    assert "6.25 (no 12 of them have the mean 4.10, no 12 of them have the mean 5.30): no such data give it" in said


def test_a_small_step_is_shown_and_not_rounded_to_none() -> None:
    said = mean_and_sd("3.2", 1_000_000, grain="0.01").as_text()
    assert "means of 1000000 scores in steps of 0.01 lie 0.00000001 apart" in said


def test_a_single_score_is_no_mean_of_scores() -> None:
    assert "a single score comes in steps of 1" in mean_and_sd("3.2", 1).as_text()


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--mean", "3.48", "--sd", "1.12", "--n", "23", "--scale", "1-5"], 0, "mean: attainable"),
        (["--mean", "5.19", "--sd", "1.1", "--n", "28"], 1, "SD = 1.1 is not judged, since no data have that mean"),
        (["--mean", "0.35", "--sd", "0.18", "--n", "20", "--scale", "0-1"], 1, "it would have to be SD 0.489"),
        (["--mean", "3,47", "--n", "23"], 2, "--mean: '3,47' is no printed number (a comma? write '3.47')"),
        (["--mean", "3.47", "--n", "23", "--scale", "five"], 2, "--scale: 'five' is no scale"),
        (["--mean", "3.45", "--n", "20", "--items", "0"], 2, "items at least 1, not 1 and 0"),
        (["--mean", "3.45", "--n", "20", "--items", "-2"], 2, "items at least 1, not 1 and -2"),
        (["--mean", "3.45", "--n", "20", "--grain", "0"], 2, "grain must be above 0 and items at least 1, not 0 and 1"),
        (["--mean", "3.45", "--n", "20", "--items", "9" * 50], 2, "items must be at most 1,000,000"),
        (["--mean", "3.45", "--n", "0"], 2, "n must be at least 1, not 0"),
    ],
)
def test_one_line_judges_one_mean(recoil: Recoil, options: list[str], code: int, said: str) -> None:
    done = recoil("grim", *options)
    assert (done.returncode, said in done.stdout + done.stderr) == (code, True), done


def test_the_line_for_programs_has_both_findings(recoil: Recoil) -> None:
    done = recoil("grim", "--mean", "3.48", "--sd", "1.12", "--n", "23", "--scale", "1-5", "--json")
    found = json.loads(done.stdout)
    assert [found[key]["verdict"] for key in ("mean", "sd")] == ["attainable", "attainable"]
    assert sum(map(Fraction, found["sd"]["data"][0])) == 80


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('[[claims]]\nplace = "I"\nquote = "x"\nkind = "grim"\nmean = "5.2x"\nn = 28', "claims.0"),
        ('[[claims]]\nplace = "I"\nquote = "x"\nkind = "percent"\npercent = "5%"\ncount = 3\nn = 2', "I, “x”"),
        ("", "makes no claims"),
    ],
)
def test_bad_input_is_one_message_and_exit_code_2(recoil: Recoil, tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "bad.toml").write_text(content, encoding="utf-8")
    done = recoil("audit", "bad.toml")
    assert done.returncode == 2
    assert words in done.stderr
    assert "bad.toml" in done.stderr
    assert "Traceback" not in done.stderr
