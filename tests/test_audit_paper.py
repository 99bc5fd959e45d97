"""The audit of whole files: this paper's numbers, the example from another field, and the messages of the door."""

from __future__ import annotations

import inspect
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from analysis.paper.audit.claims import CHECKS, AnyClaim, AuditFinding, Claim
from analysis.paper.audit.run import audit, audit_file, load_paper_file
from analysis.paper.audit.variance_ratios import repeated_f
from experiments.config.door import ConfigError
from tests.exact import exact_rm_F

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent
EXAMPLE = ROOT.parent / "configs" / "examples" / "audit.toml"
RATES = ["55.7%", "79.3%", "92.9%"]


@pytest.fixture(scope="module")
def findings() -> tuple[AuditFinding, ...]:
    return audit(load_paper_file(ROOT.parent / "configs" / "paper.toml"))


def one(findings: tuple[AuditFinding, ...], check: str, quote: str) -> AuditFinding:
    found = [f for f in findings if f.result.check == check and quote in f.quote]
    assert len(found) == 1, [f.quote for f in found]
    return found[0]


def test_f_of_experiment_1_is_off_the_lattice_and_rescued_by_readings_only(findings: tuple[AuditFinding, ...]) -> None:
    """By hand: A = 3 (78^2 + 111^2 + 130^2) - 319^2 = 4154, F = 13 A / (14 W - A), W even: 434 and 432 are next."""
    result = one(findings, "repeated-measures F", "28.45").result
    assert result.verdict == "only under a reading"
    assert result.judged.readings == ("arcsine transform", "scores in steps of 0.05 with other means")
    assert result.below == Fraction(13 * 4154, 14 * 434 - 4154)  # 28.10
    assert result.above == Fraction(13 * 4154, 14 * 432 - 4154)  # 28.51
    assert dict(result.numbers)["A"] == "4154"


def test_no_scores_in_tenths_give_f_of_experiment_1() -> None:
    assert repeated_f("28.45", 14, 3, RATES, grain="0.1", low="0", high="1").verdict == "not attainable"
    assert repeated_f("28.45", 14, 3, RATES, grain="0.1").verdict == "not attainable"


@pytest.mark.parametrize("F", ["28.51", "28.10"])
def test_the_neighbours_of_f_have_data_that_give_them(F: str) -> None:
    result = repeated_f(F, 14, 3, RATES, grain="0.1", low="0", high="1")
    rows = np.array([[int(10 * value) for value in row] for row in result.judged.witness])
    assert result.verdict == "attainable"
    assert rows.sum(axis=0).tolist() == [78, 111, 130]
    assert rows.min() >= 0
    assert rows.max() <= 10
    assert f"{float(exact_rm_F(rows.astype(float))):.2f}" == F


def test_two_percentages_contradict_their_counts(findings: tuple[AuditFinding, ...]) -> None:
    wrong = {f.result.printed: dict(f.result.numbers) for f in findings if f.result.verdict == "not attainable"}
    assert wrong == {
        "5 of 14, 33.7%": {"counts of 14 that print 33.7%": "none"},
        "4 of 14, 35.7%": {"counts of 14 that print 35.7%": "5"},
    }


def test_the_binomial_p_say_which_counts_gave_them(findings: tuple[AuditFinding, ...]) -> None:
    forward = one(findings, "binomial p", "0.205").result
    backward = one(findings, "binomial p", "0.673").result
    assert (forward.verdict, dict(forward.numbers)["counts of 140 that give p"]) == ("attainable", "62, 78")
    assert (backward.verdict, dict(backward.numbers)["counts of 140 that give p"]) == ("attainable", "67, 73")


def test_all_else_stands_or_is_left_open(findings: tuple[AuditFinding, ...]) -> None:
    others = {f.result.check for f in findings if f.result.verdict in {"not attainable", "only under a reading"}}
    assert others == {"repeated-measures F", "percent of count"}
    assert {f.result.check for f in findings if f.result.verdict == "undecided"} == {"stated"}
    assert {f.result.check for f in findings if f.result.verdict == "not published"} == {"unpublished"}
    assert len(findings) > 55


def test_every_attainable_f_has_its_data(findings: tuple[AuditFinding, ...]) -> None:
    second = one(findings, "repeated-measures F", "33.810").result
    assert second.verdict == "attainable"
    table = [[int(10 * value) for value in row] for row in second.judged.witness]
    assert f"{float(exact_rm_F(np.array(table, dtype=float))):.3f}" == "33.810"


def test_the_shipped_file_loads_as_it_is() -> None:
    assert load_paper_file(ROOT.parent / "configs" / "paper.toml").direction is not None


def test_an_example_from_another_field_gets_the_verdicts_its_notes_announce() -> None:
    for finding in audit(load_paper_file(EXAMPLE)):
        assert finding.note.startswith(finding.result.verdict), finding


def test_the_example_has_every_kind_of_claim() -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    missing = [kind for kind in [*CHECKS, "stated", "unpublished"] if f'kind = "{kind}"' not in text]
    assert not missing


def test_a_claim_has_the_arguments_of_its_check_and_no_others() -> None:
    union = AnyClaim.__args__[0].__args__
    for model in union:
        kind = model.model_fields["kind"].annotation.__args__[0]
        if kind in CHECKS:
            names = set(model.model_fields) - set(Claim.model_fields) - {"kind"}
            assert names == set(inspect.signature(CHECKS[kind]).parameters), kind


def test_the_page_on_papers_has_every_check_with_its_arguments() -> None:
    page = (ROOT.parent / "docs" / "howto" / "check-a-paper.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z-]+)` \|.*\|(.*)\|(.*)\|$", page, re.MULTILINE)
    told = {kind: [set(re.findall(r"`(\w+)`", cell)) for cell in cells] for kind, *cells in rows}
    own: dict[str, list[set[str]]] = {}
    for model in AnyClaim.__args__[0].__args__:
        some = {name: one for name, one in model.model_fields.items() if name not in {*Claim.model_fields, "kind"}}
        needed = {name for name, one in some.items() if one.is_required()}
        own[model.model_fields["kind"].annotation.__args__[0]] = [needed, set(some) - needed]
    assert told == own


def test_every_check_names_its_source() -> None:
    assert all("Source" in (check.__doc__ or "") for check in CHECKS.values())


def written(folder: Path, text: str) -> Path:
    path = folder / "some.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("claim", "line", "message"),
    [
        ('kind = "grim"\nmean = "5.2x"\nn = 28', 5, "no printed number"),
        ('kind = "grim"\nmean = 5.2\nn = 28', 5, "mean"),
        ('kind = "grim"\nmean = "5.2"\nn = 0', 6, "n"),
        ('kind = "grim"\nmean = "5.2"', 1, "n"),
        ('kind = "guess"', 4, "kind"),
        ('kind = "grim"\nmean = "5.2"\nn = 28\nextra = 1', 7, "extra"),
    ],
)
def test_a_fault_is_named_with_its_key(claim: str, line: int, message: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=message) as error:
        load_paper_file(written(tmp_path, f'[[claims]]\nplace = "I"\nquote = "x"\n{claim}'))
    assert str(error.value).startswith(f"{tmp_path / 'some.toml'}:{line}: claims.0")


@pytest.mark.parametrize(
    ("claim", "said"),
    [
        ('kind = "percent"\npercent = "50%"\ncount = -1\nn = 2', "6: claims.0.count = -1: must be at least 0"),
        ('kind = "percent"\npercent = "x%"\ncount = 1\nn = 2', "5: claims.0.percent = 'x%': 'x%' is no printed"),
        ('kind = "percent"\ncount = 1\nn = 2', "1: claims.0.percent: is missing"),
        ('kind = "percent"\npercent = "50%"\ncount = 1', "1: claims.0.n: is missing"),
        ('kind = "df"\ndf = ["26"]\ncounts = [14]\ndesign = "within"', "7: claims.0.design = 'within': must be"),
        ('kind = "p"\nstatistic = "t"\nvalue = "2"\ndf = ["1e400"]\np = ".1"', "7: claims.0.df.0 = '1e400'"),
        ('kind = "df"\ndf = ["26"]\ncounts = [14]\ndesign = "paired"\nsize = 1', "8: claims.0.size = 1: unknown key"),
    ],
)
def test_a_kind_that_is_called_like_one_of_its_keys_does_not_stand_for_it(
    claim: str, said: str, tmp_path: Path
) -> None:
    path = written(tmp_path, f'[[claims]]\nplace = "I"\nquote = "x"\n{claim}')
    with pytest.raises(ConfigError) as error:
        load_paper_file(path)
    assert str(error.value).startswith(f"{path}:{said}")


@pytest.mark.parametrize(("df", "said"), [("< 28", "'< 28' is a bound"), ("28%", "'28%' is a percentage")])
@pytest.mark.parametrize("kind", ["p", "df"])
def test_degrees_of_freedom_are_numbers_alone(kind: str, df: str, said: str, tmp_path: Path) -> None:
    others = {"p": 'statistic = "t"\nvalue = "2.20"\np = ".036"', "df": 'design = "paired"\ncounts = [29]'}
    path = written(tmp_path, f'[[claims]]\nplace = "I"\nquote = "x"\nkind = "{kind}"\ndf = ["{df}"]\n{others[kind]}')
    with pytest.raises(ConfigError) as error:
        load_paper_file(path)
    assert str(error.value) == f"{path}:5: claims.0.df.0 = '{df}': {said} (rule: a number alone, as in '28')"


NO_CLAIM = '[[claims]]\nplace = "II"\nquote = "x"\nkind = "percent"\npercent = "50%"\ncount = 3\nn = 2\n'
TOO_LARGE = '[[claims]]\nplace = "III"\nquote = "y"\nkind = "repeated-f"\nF = "4.1"\nn = 1000000\nk = 3\n'
A_CLAIM = '[[claims]]\nplace = "IV"\nquote = "z"\nkind = "grim"\nmean = "5.21"\nn = 28\n'


def test_a_claim_that_cannot_be_judged_is_refused_and_the_others_are_judged(tmp_path: Path) -> None:
    audited = audit_file(str(written(tmp_path, NO_CLAIM + TOO_LARGE + A_CLAIM)))
    assert [one.result.verdict for one in audited.findings] == ["refused", "refused", "attainable"]
    assert audited.findings[0].result.reason.startswith("count must lie in 0..2")
    assert audited.exceptions
    assert "III, “y”: The claim is refused: values must be at most 20,000 in all for an F" in audited.as_text()
    assert audited.to_dict()["verdicts"]["refused"] == 2


def test_a_file_of_nothing_but_such_claims_is_refused_with_each_ones_place(tmp_path: Path) -> None:
    with pytest.raises(
        ConfigError, match=r"II, “x”: count must lie in 0\.\.2[^\n]*\n.*III, “y”: values must be at most"
    ):
        audit_file(str(written(tmp_path, NO_CLAIM + TOO_LARGE)))


def test_what_is_no_toml_or_no_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not TOML"):
        load_paper_file(written(tmp_path, "a = "))
    with pytest.raises(ConfigError, match="cannot be read"):
        load_paper_file("nowhere.toml")
