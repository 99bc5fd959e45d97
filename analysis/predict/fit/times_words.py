"""What `recoil fit times` says in words: its findings on a terminal, what was left out, and what to keep in mind."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from analysis.predict.fit.words import NO_TIMES
from analysis.report import apa

Facts = dict[str, Any]

CAVEATS = (
    "Decisions are taken to be a simple diffusion: one drift a method (its sign that of the shot), one boundary an "
    "instruction, one start and one non-decision time; nothing varies from trial to trial but the noise.",
    "Where people differ, the fit of all together is that of a compromise person (non-decision time towards the "
    "fastest, drifts towards 0, boundaries up); the mean over people of their own fits is the one to report.",
    "A person's own fit rests on few trials: see results/soak/decision.md for its bias and spread at 60 trials.",
    "EZ-diffusion knows no bias and no lapses, and takes forward and backward shots together.",
    NO_TIMES,
)


def as_text(found: Facts) -> str:
    """The findings for a terminal."""
    return "\n".join(_lines(found))


def main_estimates(found: Facts) -> list[Facts]:
    """The estimates to report: means over people where there are several, else the one person's."""
    return list(found["mean_of_people"] or found["together"]["estimates"])


def left_out(found: Facts) -> Iterator[str]:
    """What was left out, in words."""
    for one in found["refused"].values():
        yield f"{one['trials']} of {found['answered']} answered trials: {one['reason']}"
    if found["together"]["reason"]:
        yield f"intervals of all trials together: {found['together']['reason']}"
    for who in found["left_out"]:
        yield f"participant {who}, of the mean over people: a method or instruction is missing, or the fit has no peak"


def _lines(found: Facts) -> Iterator[str]:
    several = found["mean_of_people"] is not None
    yield f"The diffusion model fitted to {found['trials']} trials of {people_count(found)}"
    yield f"  95 % CI of {'the mean over people of their own fits' if several else 'the one fit'}"
    for one in main_estimates(found):
        yield f"  {one['name']:26} {apa.number(one['value'], 3):>7} {interval(one)}"
    if several:
        yield "  one fit of all together (a compromise person, intervals by person)"
        for one in found["together"]["estimates"]:
            yield f"  {one['name']:26} {apa.number(one['value'], 3):>7} {interval(one)}"
    yield from (f"  not identified: {name}" for name in found["together"]["unidentified"])
    yield f"  {NO_TIMES}"


def people_count(found: Facts) -> str:
    """How many took part.

    >>> people_count({"people": ["P01"]})
    '1 participant'
    """
    n = len(found["people"])
    return f"{n} participant{'' if n == 1 else 's'}"


def interval(one: Facts) -> str:
    """An estimate's interval, or that there is none."""
    if one["ci_low"] is None:
        return "[not identified]"
    return apa.interval(one["ci_low"], one["ci_high"], 3)
