"""`recoil analyze`: logs to statistics, figures and report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from analysis.logs import Problem, Track, read_logs
from analysis.paper import load_paper
from analysis.published import compare
from analysis.report import ReportData, write_report
from analysis.summary import summarize
from experiments import storage
from experiments.load import ConfigError
from experiments.places import PlaceError
from experiments.provenance import provenance


def analyze(
    paths: Sequence[Path], out: Path, paper: Path | None, track: Track = iter
) -> tuple[dict[str, Any], tuple[Problem, ...]]:
    """Write statistics and report of all usable logs; returns the statistics and what was left out.

    `PlaceError` if there is no usable log at all, with every reason.
    """
    published = _paper(paper)
    logs = read_logs(paths, track)
    if not logs.files:
        reasons = "\n".join(str(problem) for problem in logs.problems)
        raise PlaceError("\n".join(filter(None, ["no usable log in " + ", ".join(map(str, paths)), reasons])))
    statistics = summarize(logs)
    storage.make_folder(out)
    report = ReportData(
        title="Statistics of " + ", ".join(path.name or str(path) for path in paths),
        statistics=statistics,
        problems=logs.problems,
        comparison=compare(statistics, published) if published else None,
        files=logs.files,
        provenance=provenance(),
    )
    write_report(out, report)
    return statistics, logs.problems


def _paper(paper: Path | None) -> Any:
    try:
        return load_paper(paper) if paper else None
    except ValueError as error:
        raise ConfigError(str(error)) from error
