"""Agreement with documented examples of R's scrutiny and statcheck; the golden files name their source."""

from __future__ import annotations

from typing import Any

import pytest

from analysis.paper.audit.means import debit, grim, grimmer, scale_of
from analysis.paper.audit.p_values import p_against_statistic
from analysis.paper.audit.printed import Rounding, read_printed
from tests.golden_audit import rounded_either_way, rows, statcheck_cases


@pytest.mark.slow
@pytest.mark.parametrize(("block", "mean", "n", "consistent"), rows("grim", "mean", "n", "consistent"))
def test_grim_agrees_with_scrutiny(block: dict[str, Any], mean: str, n: int, consistent: bool) -> None:
    assert rounded_either_way(grim(mean, n, items=block.get("items", 1))) == consistent


@pytest.mark.parametrize(("block", "mean", "up", "down"), rows("rounding", "mean", "up", "down"))
def test_each_rounding_agrees_with_scrutiny(block: dict[str, Any], mean: str, up: bool, down: bool) -> None:
    roundings = (Rounding.HALF_UP, Rounding.HALF_DOWN)
    sums = [scale_of("1").sums(read_printed(mean).interval(rounding), block["n"]) for rounding in roundings]
    assert [len(found) > 0 for found in sums] == [up, down]


@pytest.mark.parametrize(("_", "mean", "sd", "n", "consistent"), rows("grimmer", "mean", "sd", "n", "consistent"))
def test_grimmer_agrees_with_scrutiny(_: object, mean: str, sd: str, n: int, consistent: bool) -> None:
    assert rounded_either_way(grimmer(mean, sd, n)) == consistent


@pytest.mark.parametrize(("_", "mean", "sd", "n", "consistent"), rows("debit", "mean", "sd", "n", "consistent"))
def test_debit_agrees_with_scrutiny(_: object, mean: str, sd: str, n: int, consistent: bool) -> None:
    assert rounded_either_way(debit(mean, sd, n)) == consistent


@pytest.mark.parametrize(("sides", "statistic", "value", "df", "p", "error"), list(statcheck_cases()))
def test_p_agrees_with_statcheck(*, sides: Any, statistic: Any, value: str, df: list[str], p: str, error: bool) -> None:
    assert (p_against_statistic(statistic, value, df, p, sides=sides).verdict != "attainable") == error
