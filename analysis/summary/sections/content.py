"""What a report is made of."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.logs.files import Problem
from analysis.report.labels import display_name, named
from analysis.report.section import Section
from analysis.summary.results import DesignSummary, StudyStatistics, WithinStatistics
from experiments.design.language import shown_level
from experiments.design.methods_section import factor_words
from experiments.study.study import Member

if TYPE_CHECKING:
    from analysis.paper.paper import ComparisonRow
    from analysis.paper.recurrence import PatternOdds
    from analysis.report.figures.shot import ShotPanel
    from analysis.summary.delivered import DeliveredCourse

EXPERIMENTS = {"direction": "direction recognition", "preference": "preference"}

TWO_PEOPLE = (
    "Two people are too few to say anything of others: the error is what these two differ by, and no assumption of the "
    "test can be checked."
)
"""Said behind an F of two."""
NOT_CORRECTED = "not significant once corrected for sphericity"
"""Said of an effect whose own p is below .05, but not the one that Greenhouse and Geisser's epsilon corrects."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """What a report tells. `comparison` is None without a paper.

    `files` are the logs used, `remarks` what there is to say of some, `beside` the names of the tables beside the page;
    `provenance` is label -> text; `notes` are the assumptions behind the numbers, `dropped` what rules left out of
    trials; `extra` are finished sections that follow the results; the participants may be `reconstructed` from the
    published numbers. `planned`: the logs come with their plans, as those of other programs do not. `members` is what
    the register says of people, `analysed` by experiment whose answers count, `stopped` whose run was stopped before
    its end. `apart`: the same of data of other kinds, which are kept apart. `rated_from`: the ends of the scale of
    other programs' ratings, which became 0 and 10; `None`: question and scale are Recoil's own. `delivered`: what
    sensors measured of the shots.
    """

    title: str
    statistics: StudyStatistics
    problems: tuple[Problem, ...] = ()
    remarks: tuple[Problem, ...] = ()
    comparison: tuple[ComparisonRow, ...] | None = None
    odds: tuple[PatternOdds, ...] = ()
    panels: tuple[ShotPanel, ...] = ()
    files: tuple[Path, ...] = ()
    beside: tuple[str, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    extra: tuple[Section, ...] = ()
    reconstructed: bool = False
    planned: bool = True
    rated_from: tuple[float, float] | None = None
    members: Mapping[str, Member] = field(default_factory=dict)
    analysed: Mapping[str, Sequence[str]] = field(default_factory=dict)
    stopped: Mapping[str, frozenset[str]] = field(default_factory=dict)
    apart: tuple[ReportData, ...] = ()
    delivered: tuple[DeliveredCourse, ...] = ()


_SPELLED_OUT = 4
"""Of more methods sentences give counts and ends; all of them stand in tables."""


def has_many(found: WithinStatistics) -> bool:
    """Whether there are too many methods to name each of them, and each pair, in a sentence."""
    return len(found.methods) > _SPELLED_OUT


_WITH_UNIT = re.compile(r"[A-Za-z]\w*_(?:V|s|N|A|ohm|m|kg|Hz)\b")


def effect_words(effect: str) -> str:
    """What a test is of, in words.

    >>> effect_words("voltage_V × method"), effect_words("vibration – asymmetric-1")
    ('voltage in V × method', 'Vibration – Asymmetric Force I')
    """
    return _WITH_UNIT.sub(lambda found: factor_words(found[0]), named(effect))


def condition_words(found: DesignSummary, condition: str, word: Callable[[str], str] = display_name) -> str:
    """A condition, as results name it, with each level by what that is called; else in words, as an effect.

    A level may have commas of its own: a part begins with a factor.
    """
    factors = "|".join(map(re.escape, found.factors))
    parts = re.split(rf", (?=(?:{factors})(?:_[12])? )", condition)
    return ", ".join(_part_words(found, part, word) for part in parts)


def _part_words(found: DesignSummary, part: str, word: Callable[[str], str]) -> str:
    name, _, shown = part.partition(" ")
    factor = name if name in found.factors else name.removesuffix("_1").removesuffix("_2")
    levels = {shown_level(level): level for level in found.factors.get(factor, ())}
    return word(found.label(name, levels[shown])) if shown in levels else effect_words(part)
