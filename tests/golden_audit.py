"""What other programs said of published numbers, for the checks of the audit."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from analysis.paper.audit.printed import CheckResult, Rounding

GOLDEN = Path(__file__).parent / "golden" / "audit"
SCRUTINY: dict[str, Any] = tomllib.loads((GOLDEN / "scrutiny.toml").read_text(encoding="utf-8"))
STATCHECK: dict[str, Any] = tomllib.loads((GOLDEN / "statcheck.toml").read_text(encoding="utf-8"))
TIES = {Rounding.HALF_UP.value, Rounding.HALF_EVEN.value, Rounding.HALF_DOWN.value}


def rounded_either_way(result: CheckResult) -> bool:
    """Attainable when a tie may fall either way: scrutiny's default."""
    return result.verdict == "attainable" or bool(TIES & set(result.judged.readings))


def rows(kind: str, *columns: str) -> list[Any]:
    return list(_rows(kind, *columns))


def _rows(kind: str, *columns: str) -> Iterator[Any]:
    for block in SCRUTINY[kind]:
        for row in zip(*(block[column] for column in columns), strict=True):
            yield pytest.param(block, *row, id=f"{block['source']}: {row[0]}")


def statcheck_cases() -> Iterator[Any]:
    for block in STATCHECK["cases"]:
        sides = block.get("sides", "two-sided")
        for row in zip(*(block[key] for key in ("statistic", "value", "df", "p", "error")), strict=True):
            yield pytest.param(sides, *row, id=f"{block['source']}: {row[0]} = {row[1]}, p {row[3]}")
