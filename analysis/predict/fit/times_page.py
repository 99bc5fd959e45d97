"""What `recoil fit times` says, on a terminal and as a page: estimates, times beside the fit, EZ-diffusion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.predict.fit.figures import TimesPanel, figure_times
from analysis.predict.fit.words import NO_TIMES
from analysis.report import apa
from analysis.report.section import Picture, Section, Table
from analysis.stats.arrays import FloatArray
from analysis.times.fit import AnsweredBy, DiffusionFit, answered_by
from analysis.times.likelihood import Range, Trials
from analysis.times.own_trials import OwnTrials
from analysis.times.people import PeopleFit

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


SHOWN_PEOPLE = 60
"""A table of more people is read by nobody; `fit.json` has all."""
_LIKELY = 0.995
_POINTS = 200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """The trials and their fits: of all together, and of each person where there are several."""

    own: OwnTrials
    trials: Trials
    lapse_range_s: Range | None
    together: DiffusionFit
    each: PeopleFit | None


def sections(found: Facts, fitted: Fitted, figures: Path) -> tuple[Section, ...]:
    """The page's sections; their figure is written."""
    parts = [_estimates(found), _against(fitted, figures), _ez(found)]
    parts += [_people(found)] if found["each"] else []
    return (*parts, _origin(found))


def _estimates(found: Facts) -> Section:
    together = {one["name"]: one for one in found["together"]["estimates"]}
    header = ["Parameter", "Unit", "All together", "95 % CI"]
    rows = [[name, unit(name), apa.number(one["value"], 3), interval(one)] for name, one in together.items()]
    if found["mean_of_people"] is not None:
        header[2:2] = ["Mean over people", "95 % CI", "SD of people"]
        means = {one["name"]: one for one in found["mean_of_people"]}
        for row in rows:
            mean = means.get(row[0])
            row[2:2] = ["–"] * 3 if mean is None else _mean_cells(mean)
    return Section(
        title="Estimates",
        paragraphs=(
            f"{found['trials']} trials of {people_count(found)} with times of their own; lapses: {found['lapses']}; "
            f"start {'fitted' if found['bias'] else 'held at one half'}.",
            *(f"Not identified by these data: {name}." for name in found["together"]["unidentified"]),
        ),
        tables=(
            Table(caption="The diffusion by maximum likelihood", header=tuple(header), rows=tuple(map(tuple, rows))),
            *_profiles(found["together"]["profiles"]),
        ),
        items=tuple(left_out(found)),
    )


def _profiles(profiles: Facts) -> list[Table]:
    """Of all together, where they were asked for; an end that is never reached is a dash."""
    rows = tuple((name, apa.interval(low, high, 3)) for name, (low, high) in profiles.items())
    caption = "Likelihood intervals of all together, 95 %; as if people were alike"
    return [Table(caption=caption, header=("Parameter", "95 % CI"), rows=rows)] if rows else []


def _mean_cells(mean: Facts) -> list[str]:
    return [apa.number(mean["value"], 3), interval(mean), apa.number(mean["sd"], 3)]


def unit(name: str) -> str:
    """The unit of a parameter."""
    units = {"drift": "1/√s", "boundary": "√s", "start": "z/a", "non_decision_s": "s", "lapse": "share"}
    return units[name.split(" ", maxsplit=1)[0]]


def _against(fitted: Fitted, figures: Path) -> Section:
    panels = [
        [_panel(fitted, method, instruction) for method in fitted.own.methods]
        for instruction in fitted.own.instructions
    ]
    figure_times(panels, figures / "times")
    return Section(
        title="Times against the fit",
        paragraphs=(
            "The share of all trials answered rightly, and wrongly, by each time: what was observed, and what the fit "
            "predicts. Where a line leaves the points, the model misses the data.",
        ),
        pictures=(
            Picture(
                stem="times",
                caption="Right and wrong answers by time: observed (points) and fitted (lines)",
                alt="Rising curves of right and wrong answers over time by method and instruction, with points",
            ),
        ),
    )


def _panel(fitted: Fitted, method: str, instruction: str) -> TimesPanel:
    cell = fitted.own.cell(method, instruction)
    told = fitted.own.instruction == fitted.own.instructions.index(instruction)
    end_s = float(np.quantile(fitted.own.time_s[told], _LIKELY))
    grid = np.linspace(0.0, end_s, _POINTS)
    one = _predicted([fitted.together], fitted, grid, method, instruction)
    each = _predicted(fitted.each.fits if fitted.each else (), fitted, grid, method, instruction)
    right, wrong = (np.sort(cell.time_s[cell.correct == kind]) for kind in (1.0, 0.0))
    return TimesPanel(
        method=method,
        instruction=instruction,
        trials=cell.time_s.size,
        right_s=right.tolist(),
        wrong_s=wrong.tolist(),
        grid_s=grid.tolist(),
        together=_as_lists(one),
        each=_as_lists(each),
    )


def _predicted(
    fits: Sequence[DiffusionFit], fitted: Fitted, grid: FloatArray, method: str, instruction: str
) -> AnsweredBy | None:
    """The mean prediction of the fits that know the cell."""
    cell = fitted.own.cell(method, instruction)
    if not cell.time_s.size:
        return None
    found = []
    for one in fits:
        names = {estimate.name for estimate in one.estimates}
        if {f"drift {method}", f"boundary {instruction}"} <= names and one.reason is None:
            towards = float(cell.forward.mean())
            found.append(
                answered_by(
                    one,
                    grid,
                    condition=method,
                    instruction=instruction,
                    towards_upper=towards,
                    lapse_range_s=fitted.lapse_range_s,
                )
            )
    if not found:
        return None
    right, wrong = (np.mean([getattr(one, kind) for one in found], axis=0) for kind in ("right", "wrong"))
    return AnsweredBy(right=right, wrong=wrong)


def _as_lists(found: AnsweredBy | None) -> tuple[list[float], list[float]]:
    return ([], []) if found is None else (found.right.tolist(), found.wrong.tolist())


def _ez(found: Facts) -> Section:
    rows = tuple(
        (one["method"], one["instruction"], *(_mean_ez(one, name, digits) for name, digits in _EZ), _whose(one))
        for one in found["ez"]
    )
    pooled = tuple(
        (one["method"], one["instruction"], *(apa.number(one["pooled"][name], digits) for name, digits in _EZ))
        for one in found["ez"]
    )
    header = ("Method", "Instruction", "Drift [1/√s]", "Boundary [√s]", "Non-decision time [s]")
    return Section(
        title="EZ-diffusion beside it",
        paragraphs=(
            "In closed form, without bias or lapses. Of each person and cell, then the mean over people; left out are "
            "people with fewer than 10 right answers in the cell, and those whose non-decision time would be below 0. "
            "Of everybody's trials together it mixes people's differences into the times.",
        ),
        tables=(
            Table(caption="EZ-diffusion, mean over people [95 % CI]", header=(*header, "People"), rows=rows),
            Table(caption="EZ-diffusion of everybody's trials together", header=header, rows=pooled),
        ),
    )


_EZ = (("drift", 2), ("boundary", 2), ("non_decision_s", 3))


def _mean_ez(one: Facts, name: str, digits: int) -> str:
    return f"{apa.number(one[name]['value'], digits)} {_short(one[name], digits)}".rstrip()


def _whose(one: Facts) -> str:
    had = one["drift"]["people"]
    return f"{had} of {had + one['few'] + one['flat'] + one['impossible']}"


def _short(one: Facts, digits: int = 2) -> str:
    return "" if one["ci_low"] is None else apa.interval(one["ci_low"], one["ci_high"], digits)


def _people(found: Facts) -> Section:
    names = [one["name"] for one in found["together"]["estimates"]]
    shown = list(found["each"].items())[:SHOWN_PEOPLE]
    rows = []
    for who, one in shown:
        own = {estimate["name"]: estimate for estimate in one["estimates"]}
        cells = (f"{apa.number(own[n]['value'], 2)} {_short(own[n])}" if n in own else apa.NONE for n in names)
        rows.append((who, str(one["trials"]), *cells))
    more = len(found["each"]) - len(shown)
    return Section(
        title="Person by person",
        paragraphs=("Each person's own fit [95 % CI]" + (f"; {more} more people are in fit.json." if more else "."),),
        tables=(Table(caption="Own fits", header=("Participant", "Trials", *names), rows=tuple(rows)),),
    )


def _origin(found: Facts) -> Section:
    rows = tuple((name, str(value)) for name, value in found["provenance"].items())
    return Section(
        title="What this rests on",
        items=CAVEATS,
        tables=(Table(caption="Where the numbers come from", header=("What", "Value"), rows=rows),),
    )
