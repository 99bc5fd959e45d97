"""`recoil fit times`: the diffusion model fitted to the response times of logs, and what was found, in words."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.logs.column_map import ColumnMap
from analysis.logs.files import Problem, below
from analysis.logs.kinds import OF_KIND, folder_of
from analysis.logs.names import MethodNames
from analysis.logs.reading import Logs, Track, read_logs
from analysis.predict.fit.figures import TimesPanel, figure_times
from analysis.predict.fit.percept import NO_OWN_TIMES
from analysis.predict.fit.times_results import EZCell, FittedTimes, TimesFit, times_fit
from analysis.report import apa, placing
from analysis.report.labels import display_name, labelled
from analysis.report.page import write_page
from analysis.report.section import PageHead, PageNotice, Picture, Section, Table, origin_table
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from analysis.stats.arrays import FloatArray
from analysis.summary.design_times import has_times
from analysis.summary.summary import METHOD_ORDER
from analysis.times.fit import EDGE, AnsweredBy, DiffusionFit, Estimate, answered_by, fit, profile
from analysis.times.likelihood import LapseRange, Trials
from analysis.times.own_trials import REFUSALS, OwnTrials, own_trials
from analysis.times.people import FEWEST_TRIALS, MeanEstimate, as_trials, fit_people
from device.messages import how_many
from experiments.config.door import ConfigError, load
from experiments.record import storage
from experiments.study.folders import PlaceError

__all__ = ["TimesRequest", "in_short", "left_out", "times"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TimesRequest:
    """The logs; lapses `none`, over the `data`'s range of times, or over one in s such as `0.2-3`.

    `bias`: is the start fitted, or one half? `profiled`: likelihood intervals beside the others. `columns`: a map of
    logs that Recoil did not write. With `include_synthetic` data of other kinds than the first are fitted apart.
    """

    paths: Sequence[Path]
    columns: Path | None = None
    include_synthetic: bool = False
    lapses: str = "none"
    bias: bool = True
    profiled: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundTimes:
    """What was found, the logs that were left out, and what there is to say of logs that were used.

    `labels`: what the methods are called in print.
    """

    fit: TimesFit
    labels: Mapping[str, str]
    problems: tuple[Problem, ...]
    remarks: tuple[Problem, ...]


def times(request: TimesRequest, out: Path, track: Track, progress: Progress) -> FoundTimes:
    """Fit, and write `fit.json`, report and figure into `out`.

    The fits of data that are kept apart go to folders of their own in `out`.
    `ConfigError`: a range of lapses that is none. `PlaceError`: no usable log, or none of its times is the
    participant's own; with the reasons.
    """
    lapses = lapse_range(request.lapses)
    mapping = load(ColumnMap, request.columns) if request.columns else None
    with placing.results_in(out, placing.FIT_FILE) as folder:
        logs = read_logs(request.paths, track, mapping, include_synthetic=request.include_synthetic)
        found, problems = _fit_of(logs, lapses, request, folder, progress), list(logs.problems)
        for part in logs.apart:
            try:
                _fit_of(part, lapses, request, folder / folder_of(part.kind), progress)
            except PlaceError as error:
                problems.append(Problem(file=part.files[0].parent, line=None, column=None, message=str(error)))
    return FoundTimes(fit=found, labels=logs.methods.labels, problems=tuple(problems), remarks=logs.remarks)


def _fit_of(logs: Logs, lapses: bool | LapseRange, request: TimesRequest, out: Path, progress: Progress) -> TimesFit:
    """The fit of one kind of data, with its files."""
    own = _own(request.paths, logs)
    trials = as_trials(own)
    try:
        with progress("fit", np.unique(trials.person).size) as tell:
            fitted = _fitted(own, trials, lapses, request, tell)
    except ValueError as error:
        raise PlaceError(f"--lapses {request.lapses}: {error}") from error
    found = times_fit(fitted, logs, request.lapses, bias=request.bias)
    storage.make_folder(out)
    storage.write_whole(out / placing.FIT_FILE, as_json(found))
    whose = "" if logs.kind == "real" else f" of {OF_KIND[logs.kind]}"
    title, head = f"The diffusion model fitted to response times{whose}", PageHead(notices=tuple(_notices(logs)))
    with labelled(logs.methods.labels):
        write_page(out, title, sections(found, fitted, out / "figures", logs.remarks), head)
    return found


def _notices(logs: Logs) -> Iterator[PageNotice]:
    """The line on top of a page that is not about people at a gun."""
    if logs.kind != "real":
        text = f"{'SYNTHETIC DATA' if logs.kind == 'synthetic' else 'SIMULATED GUN'}: the times are of"
        yield PageNotice(text=f"{text} {OF_KIND[logs.kind]}, and no evidence about people at a gun.", kind="warning")


def lapse_range(text: str) -> bool | LapseRange:
    """Lapses as `fit` takes them. `ConfigError` for what is neither `none`, `data` nor two rising times in s.

    >>> lapse_range("none"), lapse_range("0.2-3")
    (False, (0.2, 3.0))
    """
    if text in ("none", "data"):
        return text == "data"
    match = re.fullmatch(r"([0-9.]+)-([0-9.]+)", text)
    try:
        earliest, latest = (float(part) for part in match.groups()) if match else (math.nan, math.nan)
    except ValueError:
        earliest = latest = math.nan
    if not earliest < latest:
        raise ConfigError(f"--lapses {text}: must be none, data (the range of the times) or a range in s such as 0.2-3")
    return earliest, latest


def _own(paths: Sequence[Path], logs: Logs) -> OwnTrials:
    """The trials with the participants' own times. `PlaceError` without enough of them."""
    where = ", ".join(map(str, paths))
    if not len(logs.trials):
        reasons = [str(one) for one in (*logs.problems, *logs.begun)]
        designs = [one.design for one in logs.designs]
        others = ", ".join(one.design for one in designs if any(has_times(one, name) for name in one.questions))
        instead = f"; of other designs ({others}) `recoil analyze --fits` fits the model" if others else ""
        raise PlaceError("\n".join([f"no usable log of experiment 1 in {where}{instead}", *reasons]))
    names = logs.methods.and_then(MethodNames(order=METHOD_ORDER))
    methods = names.ordered(map(str, logs.trials["method"].cat.categories))
    own = own_trials(logs.trials, methods)
    if not own.time_s.size:
        reasons = [f"{how_many(count, 'trial')}: {REFUSALS[name]}" for name, count in own.refused.items()]
        raise PlaceError("\n".join([f"no response time in {where} is the participant's own", *reasons, NO_OWN_TIMES]))
    if own.time_s.size < FEWEST_TRIALS:
        raise PlaceError(
            f"{how_many(own.time_s.size, 'response time')} in {where}; the fit needs at least {FEWEST_TRIALS}"
        )
    return own


def _fitted(
    own: OwnTrials, trials: Trials, lapses: bool | LapseRange, request: TimesRequest, tell: Callable[[str], None]
) -> FittedTimes:
    names = np.unique(np.array(own.people)[own.person]).tolist()

    def told(places: Iterable[int]) -> Iterator[int]:
        for place in places:
            yield place
            tell(names[place])

    several, bias = len(names) > 1, request.bias
    range_s = (float(trials.time_s.min()), float(trials.time_s.max())) if lapses is True else lapses or None
    with_lapses = range_s or False
    together = fit(trials, bias=bias, lapses=with_lapses, by_person=several)
    each = fit_people(trials, bias=bias, lapses=with_lapses, track=told, together=together) if several else None
    profiled = [one.name for one in together.estimates] if request.profiled else []
    profiles = {name: profile(trials, name, bias=bias, lapses=with_lapses) for name in profiled}
    return FittedTimes(own=own, trials=trials, lapse_range_s=range_s, together=together, profiles=profiles, each=each)


TIMES_CAVEATS = (
    "Decisions are taken to be a simple diffusion: one drift a method (its sign that of the shot), one boundary an "
    "instruction, one start and one non-decision time; nothing varies from trial to trial but the noise.",
    "Where people differ, the fit of all together is that of a compromise person (non-decision time towards the "
    "fastest, drifts towards 0, boundaries up); the mean over people of their own fits is the one to report.",
    "A person's own fit rests on few trials: with 60 of them its non-decision time is about 10 ms too long, and its "
    "drifts are some percent too large.",
    "EZ-diffusion knows no bias and no lapses, and takes forward and backward shots together.",
    NO_OWN_TIMES,
)


SHOWN_PEOPLE = 60
"""A table of more people is read by nobody; `fit.json` has all."""
_LIKELY = 0.995
_POINTS = 200


def in_short(found: TimesFit, labels: Mapping[str, str]) -> Section:
    """What a reader looks for, in a few lines, the methods under their labels."""
    with labelled(labels):
        return Section(
            title=f"The diffusion model fitted to {_counted(found)}",
            items=tuple(_lines(found)),
        )


def _lines(found: TimesFit) -> Iterator[str]:
    several = found.mean_of_people is not None
    yield f"95 % CI of {'the mean over people of their own fits' if several else 'the one fit'}"
    yield from map(_estimate_line, found.main_estimates)
    if several:
        yield "one fit of all together (a compromise person, intervals by person)"
        yield from map(_estimate_line, found.together.estimates)
    yield from _undetermined(found)


def _estimate_line(one: MeanEstimate | Estimate) -> str:
    return f"{_parameter(one.name):26} {apa.number(one.value, 3):>7} {_interval(one)}"


def _undetermined(found: TimesFit) -> Iterator[str]:
    """Parameters whose likelihood is flat, and lapses whose best share is none."""
    for name in found.together.unidentified:
        if name == "lapse" and found.together[name].value < EDGE:
            yield _without_lapses(found.together.profiles)
        else:
            what = _parameter(name)
            yield f"The data do not determine {what}: other values of it fit as well, so that it has no interval."


def _without_lapses(profiles: Mapping[str, tuple[float, float]]) -> str:
    """What there is to say of a share of lapses at 0, the end of its range: its likelihood falls on one side alone."""
    best = "The share of lapses that fits best is none, the end of its range, so that it has no standard error"
    if "lapse" not in profiles:
        return f"{best}; --profile gives its upper limit."
    return f"{best}; the upper limit by its likelihood is {apa.number(profiles['lapse'][1], 3)}."


def left_out(found: TimesFit) -> Iterator[str]:
    """What was left out, in words."""
    for one in found.refused.values():
        yield f"{one.trials} of {how_many(found.answered, 'answered trial')}: {one.reason}"
    if found.together.reason:
        yield f"intervals of all trials together: {found.together.reason}"
    for who in found.left_out:
        yield f"participant {who}, of the mean over people: a method or instruction is missing, or the fit has no peak"


def _counted(found: TimesFit) -> str:
    return f"{how_many(found.trials, 'trial')} of {how_many(len(found.people), 'participant')}"


def _interval(one: MeanEstimate | Estimate, digits: int = 3) -> str:
    """An estimate's interval, or that there is none."""
    return apa.interval(one.ci_low, one.ci_high, digits) if math.isfinite(one.ci_low) else "[no interval]"


def sections(
    found: TimesFit, fitted: FittedTimes, figures: Path, remarks: Sequence[Problem] = ()
) -> tuple[Section, ...]:
    """The page's sections, with what there is to say of logs that were used; their figure is written."""
    parts = [_estimates(found, remarks), _against(fitted, figures), _ez(found)]
    parts += [_people(found)] if found.each else []
    return (*parts, _origin(found))


def _estimates(found: TimesFit, remarks: Sequence[Problem]) -> Section:
    header = ["Parameter", "Unit", "All together", "95 % CI"]
    rows = [
        [_parameter(one.name), _unit(one.name), apa.number(one.value, 3), _interval(one)]
        for one in found.together.estimates
    ]
    if found.mean_of_people is not None:
        header[2:2] = ["Mean over people", "95 % CI", "SD of people"]
        means = {_parameter(one.name): one for one in found.mean_of_people}
        for row in rows:
            row[2:2] = _mean_cells(means.get(row[0]))
    return Section(
        title="Estimates",
        paragraphs=(
            f"{_counted(found)} with times of their own; lapses: {found.lapses}; "
            f"start {'fitted' if found.bias else 'held at one half'}.",
            *_undetermined(found),
            *(f"Used, but: {below(remark, Path())}." for remark in remarks),
        ),
        tables=(
            Table(caption="The diffusion by maximum likelihood", header=tuple(header), rows=tuple(map(tuple, rows))),
            *_profiles(found.together.profiles),
        ),
        items=tuple(left_out(found)),
    )


def _profiles(profiles: dict[str, tuple[float, float]]) -> list[Table]:
    """Of all together, where they were asked for; an end that is never reached is a dash."""
    rows = tuple((_parameter(name), apa.interval(low, high, 3)) for name, (low, high) in profiles.items())
    caption = "Likelihood intervals of all together, 95 %; as if people were alike"
    return [Table(caption=caption, header=("Parameter", "95 % CI"), rows=rows)] if rows else []


def _parameter(name: str) -> str:
    """A parameter with its method by its label."""
    kind, _, of = name.partition(" ")
    return f"{kind} {display_name(of)}" if of and kind == "drift" else name


def _mean_cells(mean: MeanEstimate | None) -> list[str]:
    return [apa.NO_NUMBER] * 3 if mean is None else [apa.number(mean.value, 3), _interval(mean), apa.number(mean.sd, 3)]


def _unit(name: str) -> str:
    units = {"drift": "1/√s", "boundary": "√s", "start": "z/a", "non_decision_s": "s", "lapse": "share"}
    return units[name.split(" ", maxsplit=1)[0]]


def _against(fitted: FittedTimes, figures: Path) -> Section:
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


def _panel(fitted: FittedTimes, method: str, instruction: str) -> TimesPanel:
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
    fits: Sequence[DiffusionFit], fitted: FittedTimes, grid: FloatArray, method: str, instruction: str
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


def _ez(found: TimesFit) -> Section:
    rows = tuple((display_name(one.method), one.instruction, *_mean_ez(one), _whose(one)) for one in found.ez)
    pooled = tuple((display_name(one.method), one.instruction, *_pooled_ez(one)) for one in found.ez)
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


def _mean_ez(cell: EZCell) -> tuple[str, ...]:
    return _with_interval(cell.drift, 2), _with_interval(cell.boundary, 2), _with_interval(cell.non_decision_s, 3)


def _pooled_ez(cell: EZCell) -> tuple[str, ...]:
    found = cell.pooled
    return apa.number(found.drift, 2), apa.number(found.boundary, 2), apa.number(found.non_decision_s, 3)


def _whose(cell: EZCell) -> str:
    had = cell.drift.people
    return f"{had} of {had + cell.few + cell.flat + cell.impossible}"


def _with_interval(one: MeanEstimate | Estimate, digits: int) -> str:
    """A value with its interval, if it has one."""
    value = apa.number(one.value, digits)
    return f"{value} {_interval(one, digits)}" if math.isfinite(one.ci_low) else value


def _people(found: TimesFit) -> Section:
    names = [one.name for one in found.together.estimates]
    header, rows = ("Participant", "Trials", *map(_parameter, names)), []
    for who, one in list(found.each.items())[:SHOWN_PEOPLE]:
        own = {estimate.name: _with_interval(estimate, 2) for estimate in one.estimates}
        rows.append((who, str(one.trials), *(own.get(name, apa.NO_NUMBER) for name in names)))
    more = len(found.each) - len(rows)
    return Section(
        title="Person by person",
        paragraphs=("Each person's own fit [95 % CI]" + (f"; {more} more people are in fit.json." if more else "."),),
        tables=(Table(caption="Own fits", header=header, rows=tuple(rows)),),
    )


def _origin(found: TimesFit) -> Section:
    return Section(title="What this rests on", items=TIMES_CAVEATS, tables=(origin_table(found.provenance),))
