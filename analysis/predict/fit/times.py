"""`recoil fit times`: the diffusion model fitted to the response times of logs, together and person by person."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.logs.reading import Logs, Problem, Track, read_logs
from analysis.predict.fit.percept_sections import NO_OWN_TIMES
from analysis.predict.fit.times_results import FittedTimes, TimesFit, times_fit
from analysis.predict.fit.times_sections import in_short, left_out, sections
from analysis.report.page import write_page
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from analysis.times.fit import fit, profile
from analysis.times.likelihood import LapseRange, Trials
from analysis.times.own_trials import REFUSALS, OwnTrials, own_trials
from analysis.times.people import FEWEST_TRIALS, as_trials, fit_people
from experiments.config.door import ConfigError
from experiments.record import storage
from experiments.study.folders import PlaceError

__all__ = ["TimesRequest", "in_short", "left_out", "times"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TimesRequest:
    """The logs; lapses `none`, over the `data`'s range of times, or over one in s such as `0.2-3`.

    `bias`: is the start fitted, or one half? `profiled`: likelihood intervals beside the others.
    """

    paths: Sequence[Path]
    lapses: str = "none"
    bias: bool = True
    profiled: bool = False


def times(request: TimesRequest, out: Path, track: Track, progress: Progress) -> tuple[TimesFit, tuple[Problem, ...]]:
    """Fit, and write `fit.json`, report and figure into `out`; what was found and the logs left out are returned.

    `ConfigError`: a range of lapses that is none. `PlaceError`: no usable log, or none of its times is the
    participant's own; with the reasons.
    """
    lapses = lapse_range(request.lapses)
    logs = read_logs(request.paths, track)
    own = _own(request.paths, logs)
    trials = as_trials(own)
    try:
        with progress("fit", np.unique(trials.person).size) as tell:
            fitted = _fitted(own, trials, lapses, request, tell)
    except ValueError as error:
        raise PlaceError(f"--lapses {request.lapses}: {error}") from error
    found = times_fit(fitted, logs, request.lapses, bias=request.bias)
    storage.make_folder(out)
    storage.write_whole(out / "fit.json", as_json(found))
    write_page(out, "The diffusion model fitted to response times", sections(found, fitted, out / "figures"))
    return found, logs.problems


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
        reasons = [str(problem) for problem in logs.problems]
        raise PlaceError("\n".join([f"no usable log of experiment 1 in {where}", *reasons]))
    methods = [str(name) for name in logs.trials["method"].cat.categories]
    own = own_trials(logs.trials, methods)
    if not own.time_s.size:
        reasons = [f"{count} trials: {REFUSALS[name]}" for name, count in own.refused.items()]
        raise PlaceError("\n".join([f"no response time in {where} is the participant's own", *reasons, NO_OWN_TIMES]))
    if own.time_s.size < FEWEST_TRIALS:
        raise PlaceError(f"{own.time_s.size} response times in {where}; the fit needs at least {FEWEST_TRIALS}")
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
