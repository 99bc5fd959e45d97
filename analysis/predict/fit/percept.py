"""`recoil fit percept`: the percept fitted to a paper's forward rates, judged by what else the paper prints."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.predict.fit.percept_model import PerceptFit, PerceptPeak, best_percept, fit_percept, predicted_rate
from analysis.predict.fit.percept_page import sections
from analysis.predict.fit.request import Request, Task, read
from analysis.predict.fit.studies import MAIN, PERCENTILES, Judged, cases_of, judge, pieces_of
from analysis.predict.fit.words import as_text, assumptions, fragment, plain
from analysis.report.page import write_page
from analysis.report.terminal import Progress
from device.parameters import GunParameters
from device.words import DIRECTIONS
from experiments.record import storage
from experiments.record.provenance import provenance
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, forward_rates, percept_of, percepts_of

__all__ = ["Request", "as_text", "percept"]

Facts = dict[str, Any]
Tell = Callable[[str], None]

OTHERS: tuple[dict[str, float], ...] = ({"exponent": 1.1}, {"exponent": 2.0}, {"leak_s": 0.01}, {"leak_s": 0.04})
"""Other values of what is assumed: Stevens' exponent for static force, one above, half and twice the leak."""
FRICTIONS = 41
CASES = 4


def percept(request: Request, out: Path, progress: Progress) -> Facts:
    """Fit and judge; write `fit.json`, `percept.toml`, report and figures into `out`; `fit.json` is returned.

    `ConfigError`: rates or files that cannot be used.
    """
    task = read(request)
    pieces = pieces_of(request.studies, task.published) if task.published else 0
    with progress("fit", 2 + len(OTHERS) + CASES * pieces) as tell:
        fit = fit_percept(task.rates, task.methods, trials=task.trials, people=task.people)
        tell("percept")
        others = [_other(task, fit, changed, tell) for changed in OTHERS]
        found = _facts(task, fit, others)
        tell("predictions")
        judged = _judged(task, request, fit, tell) if pieces else ()
    found["judged"] = plain(_judged_facts(judged, request)) if judged else None
    found["assumptions"] = assumptions(found)
    _write(out, found, judged)
    return found


def _write(out: Path, found: Facts, judged: Sequence[Judged]) -> None:
    storage.make_folder(out)
    data = json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    storage.write_whole(out / "fit.json", data.encode())
    storage.write_whole(out / "percept.toml", fragment(found).encode())
    write_page(out, f"The percept fitted to {found['source']}", sections(found, judged, out / "figures"))


def _other(task: Task, fit: PerceptFit, changed: Mapping[str, float], tell: Tell) -> PerceptPeak:
    """The fit under another assumption."""
    base = replace(fit.parameters, **changed)
    found = best_percept(task.rates, task.methods, trials=task.trials, people=task.people, base=base)
    tell(", ".join(f"{name} {value:g}" for name, value in changed.items()))
    return found


def _judged(task: Task, request: Request, fit: PerceptFit, tell: Tell) -> tuple[Judged, ...]:
    """Each kind of people's studies against what is published."""
    if task.published is None:
        return ()
    cases = cases_of(task.rates, task.methods, task.trials, fit.parameters)
    asked = {"studies": request.studies, "seed": request.seed}
    return tuple(judge(case, task.methods, task.published, tell=tell, **asked) for case in cases)


def _facts(task: Task, fit: PerceptFit, others: Sequence[PerceptPeak]) -> Facts:
    """The content of `fit.json`, without the judgement."""
    p = fit.parameters
    found = {
        "source": task.source,
        "trials": task.trials,
        "rates": _rates(task, fit),
        "people": asdict(task.people),
        "fitted": {name: asdict(one) for name, one in fit.fitted.items()},
        "assumed": {"exponent": p.exponent, "leak_s": p.leak_s},
        "deviance": fit.deviance,
        "freedom": fit.freedom,
        "rank": fit.rank,
        "untold": fit.untold,
        "unknown": [*fit.unknown],
        "percepts": _percepts(task, p),
        "other_assumptions": [{**asdict(one.parameters), "deviance": one.deviance} for one in others],
        "friction": _friction(task, fit, others),
        "provenance": provenance(),
    }
    return dict(plain(found))


def _rates(task: Task, fit: PerceptFit) -> Facts:
    """Of each method what was observed, the fit's rate, and the rates that it predicts with their intervals."""
    felt = percepts_of(task.methods, fit.parameters.leak_s)
    return {
        name: {"observed": rate, "predicted": fit.predicted[name]}
        | {way: asdict(predicted_rate(fit, felt[name], direction=way, people=task.people)) for way in DIRECTIONS}
        for name, rate in task.rates.items()
    }


def _percepts(task: Task, parameters: PerceptParameters) -> Facts:
    felt = percepts_of(task.methods, parameters.leak_s)
    return {name: asdict(one) | {"log_odds": evidence(one, parameters)} for name, one in felt.items()}


def _friction(task: Task, fit: PerceptFit, others: Sequence[PerceptPeak]) -> list[Facts]:
    """The predicted forward rate over the damper's friction, a curve for each gun that differs in more than that."""
    guns: dict[GunParameters, list[str]] = {}
    for name, method in task.methods.items():
        if isinstance(method, GunParameters):
            guns.setdefault(replace(method, friction_N=0.0), []).append(name)
    return [_curve(task, gun, names, fit, others) for gun, names in guns.items()]


def _curve(
    task: Task, gun: GunParameters, names: Sequence[str], fit: PerceptFit, others: Sequence[PerceptPeak]
) -> Facts:
    """Up to the friction that holds the magnet against the spring's pre-load."""
    frictions = np.linspace(0.0, gun.stiffness_N_m * gun.preload_length_m, FRICTIONS).tolist()
    points = {name: method.friction_N for name in names if isinstance(method := task.methods[name], GunParameters)}
    found = [predicted_rate(fit, one, people=task.people) for one in _felt(gun, frictions, fit.parameters.leak_s)]
    return {
        "methods": points,
        "friction_N": frictions,
        "fit": {key: [getattr(one, key) for one in found] for key in ("value", "ci_low", "ci_high")},
        "other_assumptions": [_rates_along(task, gun, frictions, one.parameters) for one in others],
    }


def _felt(gun: GunParameters, frictions: Sequence[float], leak_s: float) -> list[Percept]:
    return [percept_of(replace(gun, friction_N=friction), leak_s) for friction in frictions]


def _rates_along(
    task: Task, gun: GunParameters, frictions: Sequence[float], parameters: PerceptParameters
) -> list[float]:
    log_odds = [evidence(one, parameters) for one in _felt(gun, frictions, parameters.leak_s)]
    return list(forward_rates(log_odds, parameters.start, task.people).tolist())


def _judged_facts(judged: Sequence[Judged], request: Request) -> Facts:
    names = [one.case.name for one in judged]
    return {
        "studies": request.studies,
        "seed": request.seed,
        "main": names.index(MAIN),
        "percentiles": PERCENTILES,
        "cases": [
            {
                "name": one.case.name,
                "people": asdict(one.case.people),
                "parameters": asdict(one.case.fit.parameters),
                "places": [asdict(place) for place in one.places],
                "claims": [asdict(claim) for claim in one.claims],
            }
            for one in judged
        ],
    }
