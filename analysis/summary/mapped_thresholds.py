"""Psychometric functions of another program's answers: what a map names, fitted and shown as in a report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from analysis.logs.files import Problem, shown_name
from analysis.logs.level_map import LevelMap, MappedLevels, read_levels
from analysis.psychometric.people import FEWEST_ANSWERS
from analysis.report import placing
from analysis.report.labels import labelled
from analysis.report.page import write_page
from analysis.report.section import Section, origin_table
from analysis.report.serial import UNWRITTEN, NotebookResult, as_json, plain
from analysis.summary.figures.functions import figure_functions
from analysis.summary.question_results import QuestionSummary
from analysis.summary.results import DesignSummary, Origin
from analysis.summary.sections.pictures import functions_figure_of
from analysis.summary.sections.thresholds import threshold_sections, threshold_sentences
from analysis.summary.thresholds import LevelledAnswers, Thresholds, fitted_thresholds
from device.messages import how_many
from experiments.config.door import load
from experiments.config.setup import sha256
from experiments.record import storage
from experiments.record.provenance import provenance
from experiments.study.folders import PlaceError
from experiments.study.study import by_code

_NAME, _ASKED = "thresholds", "success"


@dataclass(frozen=True, slots=True, kw_only=True)
class MappedThresholds(NotebookResult):
    """The content of `fit.json`: the functions, from which files, read by which map; and what was left out."""

    files: tuple[str, ...]
    thresholds: Thresholds
    provenance: dict[str, str]
    problems: tuple[Problem, ...] = field(default=(), metadata=UNWRITTEN)

    def rows(self) -> list[dict[str, object]]:
        """A row a person and condition."""
        return [
            {**condition.levels, "participant": one.participant, "trials": one.trials, "reason": one.reason}
            | ({} if one.fit is None else {"threshold": plain(one.fit.threshold)["median"]})
            for condition in self.thresholds.conditions
            for one in condition.people
        ]

    @property
    def summary(self) -> DesignSummary:
        """The same as the report's sections take it."""
        asked = QuestionSummary(kind="choice", cells=(), tests=(), thresholds=self.thresholds)
        people = self.thresholds.people
        origin = Origin(answers={}, guns={})
        return DesignSummary(
            title="Another program's answers", n=people, factors={}, questions={_ASKED: asked}, origin=origin
        )


def mapped_thresholds(paths: list[Path], columns: Path, out: Path) -> MappedThresholds:
    """Fit, and write `fit.json`, report and figure into `out`.

    `ConfigError`: a map that is none. `PlaceError`: no usable file, or no function; with the reasons.
    """
    mapping = load(LevelMap, columns)
    read = read_levels(paths, mapping)
    if not read.files:
        raise PlaceError("\n".join([f"no usable file in {', '.join(map(str, paths))}", *map(str, read.problems)]))
    found = MappedThresholds(
        files=tuple(map(shown_name, read.files)),
        thresholds=_fitted(read, mapping),
        provenance=provenance() | {"read by": f"{columns.name}, sha256 {sha256(mapping.model_dump(mode='json'))}"},
        problems=read.problems,
    )
    if found.thresholds.reason:
        raise PlaceError(f"no psychometric function: {found.thresholds.reason}")
    title = "Psychometric functions of another program's answers"
    with placing.results_in(out, placing.FIT_FILE) as part, labelled({}):
        storage.write_whole(part / placing.FIT_FILE, as_json(found))
        write_page(part, title, tuple(_sections(found, part / "figures")))
    return found


def _fitted(read: MappedLevels, mapping: LevelMap) -> Thresholds:
    named = mapping.columns.condition is not None
    as_counted = pd.CategoricalDtype(sorted(read.table["condition"].dropna().unique(), key=by_code), ordered=True)
    rows = read.table.astype({"condition": as_counted}) if named else read.table
    return fitted_thresholds(
        LevelledAnswers(rows=rows, conditions=("condition",) if named else ()),
        Thresholds(factor=mapping.name, share=mapping.share, guess=1 / mapping.answers if mapping.answers else None),
        falls=mapping.falling,
        everybody=True,
    )


def thresholds_in_short(found: MappedThresholds) -> Section:
    """The group's threshold, or why there is none."""
    summary = found.summary
    items = tuple(threshold_sentences(summary, summary.questions[_ASKED]))
    people = how_many(found.thresholds.people, "participant")
    return Section(title=people, items=items or (_without_mean(found.thresholds, people),))


def _without_mean(of: Thresholds, people: str) -> str:
    """How many were fitted where no condition has two."""
    fits = [one for condition in of.conditions for one in condition.people if one.fit is not None]
    fitted = len({one.participant for one in fits})
    if fitted == of.people == 1:
        return "One participant: see the report."
    apart = ", no two of them in one condition" if fitted > 1 else ""
    few = f"; {of.people - fitted} had too few answers: below {FEWEST_ANSWERS}, or at one level"
    lacking = few if fitted < of.people else ""
    return f"{fitted or 'None'} of {people} could be fitted{apart}, so there is no mean over people{lacking}."


def _sections(found: MappedThresholds, figures: Path) -> Iterator[Section]:
    figure_functions(found.summary, found.thresholds, figures / functions_figure_of(_NAME, _ASKED))
    yield thresholds_in_short(found)
    yield from threshold_sections(_NAME, found.summary)
    if found.problems:
        yield Section(title="Left out", items=tuple(map(str, found.problems)))
    yield Section(title="Files", items=found.files)
    yield Section(title="Provenance", tables=(origin_table(found.provenance),))
