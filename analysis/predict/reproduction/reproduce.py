"""`recoil reproduce`: a study with synthetic participants, from their runs to the report against the paper."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.paper.audit.run import audit
from analysis.predict.reproduction.study import ReproducedStudy, claim_folder, do_runs
from analysis.report.copies import in_copy, process_copies
from analysis.report.terminal import Tell
from analysis.stats.arrays import pingouin

if TYPE_CHECKING:
    from analysis.predict.reproduction.results import Reproduced

_RUN_S, _REPORT_S = 0.08, 5.0


def reproduction_time_s(study: ReproducedStudy) -> float:
    """About how long a reproduction takes."""
    return _REPORT_S + _RUN_S * len(study.runs)


def reproduce(study: ReproducedStudy, out: Path, tell: Tell) -> Reproduced:
    """Run, log, analyse and report a study into `out`.

    An unfinished reproduction of the same study is gone on with; another one in `out` is set aside. While a copy of the
    process does the runs, what the report needs is imported, and the published numbers are audited.
    """
    claim_folder(study, out)
    with process_copies():
        in_copy(partial(do_runs, study, out / "logs"), tell)
        from analysis.predict.reproduction.results import report_of_runs  # noqa: PLC0415 - it has time until here

        pingouin("epsilon")  # the statistics ask it, and its import takes as long as the audit
        findings = audit(study.claims) if study.claims else ()
    return report_of_runs(study, findings, out, tell)
