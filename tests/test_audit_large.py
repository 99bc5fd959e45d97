"""The audit on a million people or trials: closed forms and halving, held against other ways to the same numbers."""

from __future__ import annotations

from fractions import Fraction
from math import floor

import numpy as np
import pytest

from analysis import binomial_test
from analysis.paper.audit.binomial import binomial_p
from analysis.paper.audit.freedom import degrees_of_freedom
from analysis.paper.audit.means import debit, grim, grimmer, percent_of_count
from analysis.paper.audit.printed import CheckResult
from analysis.paper.audit.run import PaperFile, audit
from experiments.config.door import ConfigError, checked_table

MANY = 1_000_000


@pytest.mark.slow
@pytest.mark.parametrize(("n", "chance"), [(997, "1/2"), (1_501, "1/2"), (MANY, "1/2"), (MANY, "1/3"), (3_001, "0.07")])
def test_the_nearest_p_are_those_of_the_exact_test(n: int, chance: str) -> None:
    """`binomial_test` sums in long doubles, to 13 digits."""
    expected = floor(n * Fraction(chance))
    for count in (expected - int(2 * n**0.5), expected - 3, expected + int(n**0.5)):
        result = binomial_p("0.5", n, chance=chance, counts=[count])
        found = [float(side) for side in (result.below, result.above) if side is not None]
        assert found == [pytest.approx(binomial_test(count, n, float(Fraction(chance))).p, rel=1e-8)]


def test_the_counts_of_a_million_that_give_a_p_are_found() -> None:
    """The neighbours of those named give other p-values, by `binomial_test`."""
    result = binomial_p("0.205", MANY)
    told = "499366, 500634, or 499367, 500633 by truncation"
    assert dict(result.numbers)[f"counts of {MANY} that give p"] == told
    p = binomial_test(np.arange(500_632, 500_636), MANY).p
    assert [0.2045 <= one < 0.2055 for one in p] == [False, False, True, False]
    assert [0.205 <= one < 0.206 for one in p] == [False, True, True, False]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("result", "verdict"),
    [
        (lambda: binomial_p("0.205", MANY, counts=[500_635]), "not attainable"),
        (lambda: binomial_p("< .001", MANY, chance="0.3"), "attainable"),
        (lambda: grim("3.47", MANY, low="1", high="5"), "attainable"),
        (lambda: grim("3.4700005", MANY, low="1", high="5"), "not attainable"),
        (lambda: grimmer("3.47", "1.12", MANY, low="1", high="5"), "attainable"),
        (lambda: debit("0.5", "0.5", MANY), "attainable"),
        (lambda: debit("0.50", "0.40", MANY), "not attainable"),
        (lambda: percent_of_count("10.0%", 100_000, MANY), "attainable"),
        (lambda: percent_of_count("12%", 100_000, MANY), "only under a reading"),
        (lambda: degrees_of_freedom(["2", "1000009"], "between", [6, MANY, 6]), "attainable"),
        (lambda: degrees_of_freedom(["2", "1998"], "repeated", [MANY, 3]), "only under a reading"),
    ],
)
def test_a_million_is_judged(result: object, verdict: str) -> None:
    assert result().verdict == verdict  # type: ignore[operator]


def test_many_readings_of_one_kind_are_named_as_one() -> None:
    assert percent_of_count("12%", 100_000, MANY).judged.readings == ("out of 800001 to 869565 instead of 1000000",)


@pytest.mark.parametrize(
    ("result", "shown"),
    [(percent_of_count("13%", 1, 8), "half up"), (percent_of_count("12%", 1, 8), "half to even"),
     (grim("0.13", 8), "half up"), (debit("0.12", "0.35", 8), "half to even")],
)  # fmt: skip
def test_a_tie_is_attainable_by_either_convention_which_is_named(result: CheckResult, shown: str) -> None:
    """1 / 8 is 0.125: 0.13 half up, 0.12 half to even."""
    assert (result.verdict, result.judged.rounding) == ("attainable", f"rounding {shown}")


def test_the_mean_is_judged_before_the_sd() -> None:
    """80 / 23 = 3.478 and 79 / 23 = 3.435: no mean prints 3.47."""
    result = grimmer("3.47", "1.12", 23, low="1", high="5")
    assert "the nearest are 3.435 and 3.478" in result.reason
    assert (result.below, result.above) == (None, None)


@pytest.mark.parametrize(
    ("claim", "said"),
    [
        ({"kind": "binomial", "p": ".2", "n": 10**9}, "n = 1000000000: must be at most"),
        ({"kind": "grim", "mean": 5.19, "n": 28}, 'without quotes.*"5.19"'),
        ({"kind": "grim", "mean": "5,19", "n": 28}, "a comma. write '5.19'"),
    ],
)
def test_what_cannot_be_judged_is_refused_with_the_rule(claim: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        audit(checked_table(PaperFile, {"claims": [{"place": "I", "quote": "x", **claim}]}, "paper.toml"))
