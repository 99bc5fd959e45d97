"""`recoil fit times`: the diffusion model fitted to the response times of logs, together and person by person."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.logs.reading import Logs, Problem, Track, read_logs
from analysis.predict.fit.times_page import Fitted, as_text, left_out, sections
from analysis.predict.fit.words import NO_TIMES, plain
from analysis.report.page import write_page
from analysis.report.terminal import Progress
from analysis.times.ez import ez, ez_people
from analysis.times.fit import DiffusionFit, fit, profile
from analysis.times.likelihood import Range, Trials
from analysis.times.own_trials import REFUSALS, OwnTrials, own_trials
from analysis.times.people import FEWEST_TRIALS, as_trials, fit_people, mean_estimate
from experiments.config.door import ConfigError
from experiments.record import storage
from experiments.record.provenance import provenance
from experiments.study.places import PlaceError

__all__ = ["Request", "as_text", "left_out", "times"]

Facts = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """The logs; lapses `none`, over the `data`'s range of times, or over one in s such as `0.2-3`.

    `bias`: is the start fitted, or one half? `profiled`: likelihood intervals beside the others.
    """

    paths: Sequence[Path]
    lapses: str = "none"
    bias: bool = True
    profiled: bool = False


def times(request: Request, out: Path, track: Track, progress: Progress) -> tuple[Facts, tuple[Problem, ...]]:
    """Fit, and write `fit.json`, report and figure into `out`; `fit.json` and what was left out are returned.

    `ConfigError`: a range of lapses that is none. `PlaceError`: no usable log, or none of its times is the
    participant's own; with the reasons.
    """
    lapses = lapse_range(request.lapses)
    logs = read_logs(request.paths, track)
    own = _own(request.paths, logs)
    trials = as_trials(own)
    try:
        with progress("fit", np.unique(trials.person).size) as tell:
            fitted = _fitted(own, trials, lapses, bias=request.bias, tell=tell)
    except ValueError as error:
        raise PlaceError(f"--lapses {request.lapses}: {error}") from error
    found = _facts(request, fitted, logs)
    storage.make_folder(out)
    data = json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    storage.write_whole(out / "fit.json", data.encode())
    write_page(out, "The diffusion model fitted to response times", sections(found, fitted, out / "figures"))
    return found, logs.problems


def lapse_range(text: str) -> bool | Range:
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
        raise PlaceError("\n".join([f"no response time in {where} is the participant's own", *reasons, NO_TIMES]))
    if own.time_s.size < FEWEST_TRIALS:
        raise PlaceError(f"{own.time_s.size} response times in {where}; the fit needs at least {FEWEST_TRIALS}")
    return own


def _fitted(own: OwnTrials, trials: Trials, lapses: bool | Range, *, bias: bool, tell: Callable[[str], None]) -> Fitted:
    names = np.unique(np.array(own.people)[own.person]).tolist()

    def told(places: Iterable[int]) -> Iterator[int]:
        for place in places:
            yield place
            tell(names[place])

    several = len(names) > 1
    range_s = (float(trials.time_s.min()), float(trials.time_s.max())) if lapses is True else lapses or None
    asked = range_s or False
    together = fit(trials, bias=bias, lapses=asked, by_person=several)
    each = fit_people(trials, bias=bias, lapses=asked, track=told, together=together) if several else None
    return Fitted(own=own, trials=trials, lapse_range_s=range_s, together=together, each=each)


def _facts(request: Request, fitted: Fitted, logs: Logs) -> Facts:
    """The content of `fit.json`."""
    own, together, each = fitted.own, fitted.together, fitted.each
    people = sorted({own.people[code] for code in own.person.tolist()})
    profiles = _profiles(request, fitted) if request.profiled else {}
    found = {
        "files": [str(file) for file in logs.files],
        "people": people,
        "methods": sorted({own.methods[place] for place in own.method.tolist()}),
        "instructions": [*fitted.trials.instructions],
        "trials": int(own.time_s.size),
        "answered": own.answered,
        "refused": {name: {"trials": count, "reason": REFUSALS[name]} for name, count in own.refused.items()},
        "lapses": request.lapses,
        "bias": request.bias,
        "together": _of_fit(together) | {"profiles": profiles},
        "mean_of_people": None if each is None else [asdict(one) for one in each.means],
        "each": {} if each is None else {who: _of_fit(one) for who, one in zip(people, each.fits, strict=True)},
        "left_out": [] if each is None else [people[place] for place in each.left_out],
        "ez": _ez(own),
        "provenance": provenance(),
    }
    return dict(plain(found))


def _of_fit(found: DiffusionFit) -> Facts:
    return {
        "estimates": [asdict(one) for one in found.estimates],
        "log_likelihood": found.log_likelihood,
        "trials": found.trials,
        "clusters": found.clusters,
        "unidentified": [*found.unidentified],
        "reason": found.reason,
    }


def _profiles(request: Request, fitted: Fitted) -> Facts:
    lapses, names = fitted.lapse_range_s or False, [one.name for one in fitted.together.estimates]
    return {name: [*profile(fitted.trials, name, bias=request.bias, lapses=lapses)] for name in names}


def _ez(own: OwnTrials) -> list[Facts]:
    """EZ-diffusion in each cell: of each person, as means over those who have one; and of all trials together."""
    rows = []
    for instruction in own.instructions:
        for method in own.methods:
            cell = own.cell(method, instruction)
            if not cell.time_s.size:
                continue
            found = ez_people(cell.correct, cell.time_s, cell.source, cell.person)
            measured = {"drift": found.drift, "boundary": found.boundary, "non_decision_s": found.non_decision_s}
            means = {name: asdict(mean_estimate(name, v[np.isfinite(v)])) for name, v in measured.items()}
            refused = {name: int(getattr(found, name).sum()) for name in ("few", "flat", "impossible", "corrected")}
            pooled = asdict(ez(cell.correct, cell.time_s, cell.source))
            rows.append({"method": method, "instruction": instruction, **means, **refused, "pooled": pooled})
    return rows
