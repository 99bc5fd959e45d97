"""The experiments that Recoil knows, and the table that each makes of a journal.

A new experiment is a folder beside `direction/` and a line in `CATALOGUE`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.config.door import ExperimentConfig
from experiments.config.setup import Setup
from experiments.design.plan import Plan
from experiments.direction import synthetic as direction_synthetic
from experiments.direction.config import DirectionConfig
from experiments.direction.session import choices as direction_choices
from experiments.direction.session import make_plan as direction_plan
from experiments.direction.session import make_practice as direction_practice
from experiments.direction.session import rows as direction_rows
from experiments.direction.session import session as direction_session
from experiments.preference import synthetic as preference_synthetic
from experiments.preference.config import PreferenceConfig
from experiments.preference.session import make_plan as preference_plan
from experiments.preference.session import rows as preference_rows
from experiments.preference.session import session as preference_session
from experiments.record import replay
from experiments.record.journal import Contents, JournalError, read_journal
from experiments.record.tables import FILE_SUFFIX, Row, table_bytes
from experiments.session.history import History
from experiments.session.steps import Session
from experiments.tasks.questions import Choice


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """What makes an experiment: config, plan and practice, session, table, choices and synthetic participants."""

    config: type[ExperimentConfig]
    make_plan: Callable[[Any, str, int, int | None], Plan]
    make_practice: Callable[[Any, str, int], Plan | None]
    session: Callable[[Plan, Setup[Any]], Session]
    rows: Callable[[Plan, History], list[Row]]
    choices: Callable[[Setup[Any]], tuple[Choice, ...]]
    synthetic_participant: Callable[[Setup[Any], Plan], Any]
    answer_columns: tuple[str, ...]


CATALOGUE: dict[str, Experiment] = {
    "direction": Experiment(
        config=DirectionConfig,
        make_plan=direction_plan,
        make_practice=direction_practice,
        session=direction_session,
        rows=direction_rows,
        choices=direction_choices,
        synthetic_participant=direction_synthetic.synthetic_participant,
        answer_columns=direction_synthetic.TABLE_COLUMNS,
    ),
    "preference": Experiment(
        config=PreferenceConfig,
        make_plan=preference_plan,
        make_practice=lambda *_: None,
        session=preference_session,
        rows=preference_rows,
        choices=lambda _: (),
        synthetic_participant=preference_synthetic.synthetic_participant,
        answer_columns=preference_synthetic.TABLE_COLUMNS,
    ),
}


def experiment(setup: Setup[Any]) -> Experiment:
    """The experiment that a setup is of."""
    return CATALOGUE[setup.config.experiment]


def table(contents: Contents) -> bytes:
    """The CSV that a journal makes. `JournalError` if this version does not know its plan."""
    plan = contents.plan
    if plan.experiment not in CATALOGUE:
        raise JournalError(
            f"{contents.path}: line 1: experiment {plan.experiment!r} is not known to this version of Recoil"
        )
    return table_bytes(plan.experiment, CATALOGUE[plan.experiment].rows(plan, replay.history(contents)))


def rebuild(path: Path) -> tuple[Path, bytes, Contents]:
    """The table of a journal: where it belongs, its bytes, and what the journal holds."""
    contents = read_journal(path)
    data = table(contents)
    name = path.name.replace("_journal", f"_{FILE_SUFFIX[contents.plan.experiment]}")
    return path.with_name(name).with_suffix(".csv"), data, contents
