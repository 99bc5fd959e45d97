"""Words of the audit: the verdict on a number, its proof, and how verdicts follow from attempts.

"not attainable" is said only where no attempt under any reading could succeed, "attainable" only with a witness.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

from analysis.paper.audit.printed import Rounding

AuditVerdict = Literal["attainable", "only under a reading", "not attainable", "not published", "undecided"]
Witness = tuple[tuple[Fraction, ...], ...]
"""Data that give the printed numbers: rows of values in the unit of the data."""
ORDINARY = (Rounding.HALF_UP, Rounding.HALF_EVEN)
OTHER = (Rounding.HALF_DOWN, Rounding.TRUNCATION)
ROUNDINGS = tuple(rounding.value for rounding in Rounding)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckResult:
    """What a check found of one printed number.

    `step` is the distance of neighbouring attainable values, `below` and `above` the nearest ones on both sides of the
    printed value (None where there is none or none was proved), `readings` the readings that rescue it, `tried` all
    that were tried besides the plain one, `contradicts` the other numbers it cannot stand beside, `numbers` what else
    the proof rests on, `witness` data that give it.
    """

    check: str
    printed: str
    verdict: AuditVerdict
    reason: str
    source: str
    step: Fraction | None = None
    below: Fraction | None = None
    above: Fraction | None = None
    readings: tuple[str, ...] = ()
    tried: tuple[str, ...] = ()
    contradicts: tuple[str, ...] = ()
    numbers: tuple[tuple[str, str], ...] = ()
    witness: Witness = ()


@dataclass(frozen=True, slots=True)
class DataExistence:
    """Do such data exist? `None` if neither a witness nor a proof was found."""

    exists: bool | None
    witness: Witness = ()


NONE_EXISTS, UNKNOWN = DataExistence(False), DataExistence(None)
Attempt = Callable[[Rounding], DataExistence]
"""Tries one reading: are there data that print so under this rounding?"""


@dataclass(frozen=True, slots=True)
class JudgedReadings:
    """A verdict with the readings that rescue, and data for the first of them."""

    verdict: AuditVerdict
    readings: tuple[str, ...] = ()
    witness: Witness = ()
    tried: tuple[str, ...] = ()


def judge_readings(plain: Attempt, others: Sequence[tuple[str, Attempt]] = ()) -> JudgedReadings:
    """Attainable if `plain` succeeds under both ordinary roundings; else the readings that rescue are named.

    A rounding alone is named if only some of them rescue; of `others`, (name, attempt), all that rescue are named.
    Where `plain` could not be settled the verdict is "undecided", whatever the readings give.
    """
    first = _under_roundings(plain, "") or JudgedReadings("undecided")
    if first.verdict != "not attainable":
        return replace(first, tried=ROUNDINGS)
    names = (*ROUNDINGS, *(name for name, _ in others))
    found = [_under_roundings(attempt, name) or JudgedReadings("undecided") for name, attempt in others]
    rescued = [decision for decision in found if decision.readings]
    if rescued:
        readings = tuple(reading for decision in rescued for reading in decision.readings)
        return JudgedReadings("only under a reading", readings, rescued[0].witness, names)
    unsure = any(decision.verdict == "undecided" for decision in found)
    return JudgedReadings("undecided" if unsure else "not attainable", (), (), names)


def _under_roundings(attempt: Attempt, name: str) -> JudgedReadings | None:
    """The decision on one reading; None if nothing was found or proved."""
    widest = attempt(Rounding.ANY)
    if widest.exists is not True:
        return JudgedReadings("not attainable") if widest.exists is False else None
    ordinary = {rounding: attempt(rounding) for rounding in ORDINARY}
    if all(found.exists for found in ordinary.values()):
        witness = ordinary[Rounding.HALF_UP].witness
        return (
            JudgedReadings("only under a reading", (name,), witness)
            if name
            else JudgedReadings("attainable", (), witness)
        )
    tried = ordinary | {rounding: attempt(rounding) for rounding in OTHER}
    names = [rounding for rounding, found in tried.items() if found.exists]
    if not names and not any(found.exists is None for found in tried.values()):
        names = [Rounding.ANY]
    unsure = any(found.exists is None for found in ordinary.values())
    rescued = tuple(f"{name}, {rounding.value}" if name else rounding.value for rounding in names)
    witness = tried[names[0]].witness if names and names[0] in tried else widest.witness
    return JudgedReadings("undecided" if unsure else "only under a reading", rescued, witness)


def listed(values: Sequence[object], most: int = 12) -> str:
    """Values for a report, the first `most` of them."""
    text = ", ".join(map(str, values[:most]))
    return text + (f" and {len(values) - most} more" if len(values) > most else "")
