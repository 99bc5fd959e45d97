"""`recoil fit percept`: the percept fitted to a paper's forward rates, judged by what else the paper prints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from analysis.predict.fit.percept_model import PerceptFit, PerceptPeak, best_percept, fit_percept
from analysis.predict.fit.percept_request import PerceptRequest, PerceptTask, read_request
from analysis.predict.fit.percept_results import FittedPercept, fitted_percept
from analysis.predict.fit.percept_sections import config_text, fit_assumptions, in_short, sections
from analysis.predict.fit.studies import MAIN, PERCENTILES, Histograms, Judgement, cases_of, judge, pieces_of
from analysis.report.page import write_page
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from experiments.record import storage

__all__ = ["PerceptRequest", "in_short", "percept"]

OTHERS: tuple[dict[str, float], ...] = ({"exponent": 1.1}, {"exponent": 2.0}, {"leak_s": 0.01}, {"leak_s": 0.04})
"""Other values of what is assumed: Stevens' exponent for static force, one above, half and twice the leak."""
CASES = 4


def percept(request: PerceptRequest, out: Path, progress: Progress) -> FittedPercept:
    """Fit and judge; write `fit.json`, `percept.toml`, report and figures into `out`; what was found is returned.

    `ConfigError`: rates or files that cannot be used.
    """
    task = read_request(request)
    pieces = pieces_of(request.studies, task.published) if task.published else 0
    with progress("fit", 2 + len(OTHERS) + CASES * pieces) as tell:
        fit = fit_percept(task.rates, task.methods, trials=task.trials, people=task.people)
        tell("percept")
        others = [_other(task, fit, changed, tell) for changed in OTHERS]
        found = fitted_percept(task, fit, others, fit_assumptions(fit.parameters, task.people))
        tell("predictions")
        judged, histograms = _judged(task, request, fit, tell) if pieces else (None, [])
    found = replace(found, judged=judged)
    storage.make_folder(out)
    storage.write_whole(out / "fit.json", as_json(found))
    storage.write_whole(out / "percept.toml", config_text(found).encode())
    write_page(out, f"The percept fitted to {found.source}", sections(found, histograms, out / "figures"))
    return found


def _other(task: PerceptTask, fit: PerceptFit, changed: dict[str, float], tell: Callable[[str], None]) -> PerceptPeak:
    """The fit under another assumption."""
    base = replace(fit.parameters, **changed)
    found = best_percept(task.rates, task.methods, trials=task.trials, people=task.people, base=base)
    tell(", ".join(f"{name} {value:g}" for name, value in changed.items()))
    return found


def _judged(
    task: PerceptTask, request: PerceptRequest, fit: PerceptFit, tell: Callable[[str], None]
) -> tuple[Judgement | None, list[Histograms]]:
    """Each kind of people's studies against what is published."""
    if task.published is None:
        return None, []
    cases = cases_of(task.rates, task.methods, task.trials, fit.parameters)
    judged = [
        judge(case, task.methods, task.published, studies=request.studies, seed=request.seed, tell=tell)
        for case in cases
    ]
    judgement = Judgement(
        studies=request.studies,
        seed=request.seed,
        main=[case.name for case in cases].index(MAIN),
        percentiles=PERCENTILES,
        cases=tuple(one for one, _ in judged),
    )
    return judgement, [histograms for _, histograms in judged]
