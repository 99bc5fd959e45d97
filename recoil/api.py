"""What a notebook calls. Each function does what the command of its name does, and gives back what it found.

`RecoilError`, the root of all errors here, says in one message what is wrong, where, and what to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.paper.audit.claims import AuditFinding
    from analysis.predict.power.results import Power
    from analysis.summary.results import StudyStatistics
    from experiments.config.setup import Setup
    from experiments.design.plan import Plan


def load_config(name: str | Path) -> Setup[Any]:
    """An experiment with its gun, from a file or the name of a shipped config.

    >>> load_config("direction").config.design.methods
    ('vibration', 'asymmetric-1', 'asymmetric-2')
    """
    from experiments.load import load_setup

    return load_setup(str(name))


def plan(setup: Setup[Any], participant: str = "P01", seed: int = 1, order_row: int | None = None) -> Plan:
    """The trials of one participant in their order; the same seed gives the same plan.

    `order_row`: the row of a Latin square or Williams design, which a run takes from the register of the study.

    >>> found = plan(load_config("direction"), seed=1)
    >>> len(found.trials), found.trials[0].direction
    (60, 'forward')
    """
    from experiments.catalogue import experiment

    return experiment(setup).make_plan(setup.config, participant, seed, order_row)


def run_synthetic(
    setup: Setup[Any], participants: Sequence[str], results: str | Path, seed: int | None = None
) -> list[Path]:
    """Runs of synthetic participants on the simulated gun, in a clock of their own; gives their tables.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     [table.name for table in run_synthetic(load_config("preference"), ["P01"], folder, seed=1)]
    ['sub-P01_task-preference_ratings.csv']
    """
    from experiments.clock import VirtualClock
    from experiments.run import RunRequest, run
    from experiments.screens.synthetic import synthetic_screen

    requests = (RunRequest(setup=setup, participant_id=code, results=Path(results), seed=seed) for code in participants)
    return [run(request, synthetic_screen, VirtualClock()).place.table for request in requests]


def analyze(*paths: str | Path) -> StudyStatistics:
    """The statistics of all logs in files and folders; `to_frame()`, `to_dict()`, and a table in a notebook.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     tables = run_synthetic(load_config("direction"), ["P01", "P02", "P03"], folder, seed=1)
    ...     found = analyze(folder)
    >>> found.direction.anova.df
    (2, 4)
    """
    from analysis.logs.reading import read_logs
    from analysis.summary.summary import summarize

    return summarize(read_logs(paths))


def audit(paper: str | Path = "paper") -> tuple[AuditFinding, ...]:
    """Whether data could give the published numbers: of a paper's file, or of a shipped one.

    >>> findings = audit()
    >>> findings[0].quote, findings[0].result.verdict
    ('14 participants (7 males and 7 females)', 'attainable')
    """
    from analysis.paper.audit.run import audit as audited
    from analysis.paper.audit.run import load_paper_file
    from experiments.load import find

    return audited(load_paper_file(find(str(paper))))


def power(config: str | Path, *, studies: int = 10_000, seed: int = 1, **options: Any) -> Power:
    """Simulated power of a config's design, in this process; the options are those of `recoil power`, as text.

    >>> found = power("preference", participants="14", studies=50)
    >>> {design.participants for design in found.designs}
    {14}
    """
    from analysis.predict.power.grid import PowerRequest
    from analysis.predict.power.run import simulated_power

    return simulated_power(PowerRequest(config=str(config), studies=studies, seed=seed, **options))
