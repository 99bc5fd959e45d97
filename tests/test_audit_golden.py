"""Agreement with documented examples of R's scrutiny and statcheck; the golden files name their source."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from analysis.paper.audit.means import debit, grim, grimmer, scale_of
from analysis.paper.audit.p_values import p_against_statistic
from analysis.paper.audit.printed import CheckResult, Rounding, read_printed

GOLDEN = Path(__file__).parent / "golden" / "audit"
SCRUTINY: dict[str, Any] = tomllib.loads((GOLDEN / "scrutiny.toml").read_text(encoding="utf-8"))
STATCHECK: dict[str, Any] = tomllib.loads((GOLDEN / "statcheck.toml").read_text(encoding="utf-8"))
TIES = {Rounding.HALF_UP.value, Rounding.HALF_EVEN.value, Rounding.HALF_DOWN.value}


def rounded_either_way(result: CheckResult) -> bool:
    """Attainable when a tie may fall either way: scrutiny's default."""
    return result.verdict == "attainable" or bool(TIES & set(result.readings))


def rows(kind: str, *columns: str) -> list[Any]:
    return list(_rows(kind, *columns))


def _rows(kind: str, *columns: str) -> Iterator[Any]:
    for block in SCRUTINY[kind]:
        for row in zip(*(block[column] for column in columns), strict=True):
            yield pytest.param(block, *row, id=f"{block['source']}: {row[0]}")


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


def statcheck_cases() -> Iterator[Any]:
    for block in STATCHECK["cases"]:
        sides = block.get("sides", "two-sided")
        for row in zip(*(block[key] for key in ("statistic", "value", "df", "p", "error")), strict=True):
            yield pytest.param(sides, *row, id=f"{block['source']}: {row[0]} = {row[1]}, p {row[3]}")


@pytest.mark.parametrize(("sides", "statistic", "value", "df", "p", "error"), list(statcheck_cases()))
def test_p_agrees_with_statcheck(*, sides: Any, statistic: Any, value: str, df: list[str], p: str, error: bool) -> None:
    assert (p_against_statistic(statistic, value, df, p, sides=sides).verdict != "attainable") == error
