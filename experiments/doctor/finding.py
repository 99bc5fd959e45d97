"""What a check found: its verdict, the measured figure in words and raw, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

Verdict = Literal["good", "warning", "fails", "not there"]
"""`warning`: works, but not as it should; `fails`: a run would suffer; `not there`: this machine has no such thing."""

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One row of the table. `figures` are the raw ones, plain JSON values; the unit ends the name of each."""

    check: str
    verdict: Verdict
    measured: str
    advice: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
