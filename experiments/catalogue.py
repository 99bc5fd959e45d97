"""What Recoil can run, and the table that each makes of a journal: the two experiments that are code, and any design.

A design is a file (`docs/design-language.md`) and needs nothing here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from experiments.config.door import ConfigError, ExperimentConfig, checked_table
from experiments.config.setup import Setup
from experiments.design import planning
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.stimuli import Stimuli, stimuli_of, stimuli_of_methods
from experiments.direction import synthetic as direction_synthetic
from experiments.direction.config import DirectionConfig
from experiments.direction.session import make_plan as direction_plan
from experiments.direction.session import make_practice as direction_practice
from experiments.direction.session import rows as direction_rows
from experiments.direction.session import session as direction_session
from experiments.direction.session import ways
from experiments.preference import synthetic as preference_synthetic
from experiments.preference.config import PreferenceConfig
from experiments.preference.session import make_plan as preference_plan
from experiments.preference.session import rows as preference_rows
from experiments.preference.session import session as preference_session
from experiments.record import design_table, replay
from experiments.record.journal import Contents, Head, JournalError, read_journal
from experiments.record.tables import FILE_SUFFIX, TABLES, Column, Row, table_bytes
from experiments.session.design_session import design_session
from experiments.session.history import History
from experiments.session.steps import Session
from experiments.synthetic.answers import DesignParticipant, SyntheticAnswers
from experiments.tasks.questions import Choice, choices

AnyConfig = ExperimentConfig | DesignConfig


class MakePlan(Protocol):
    """Makes the plan of a config, a participant, a seed, a row of the square, and a group."""

    def __call__(self, config: Any, participant_id: str, seed: int, order_row: int | None, group: int = 0, /) -> Plan:
        """The plan; the same for the same."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """What makes an experiment: config, plan and practice, session, table, choices and synthetic participants."""

    config: type[AnyConfig]
    make_plan: MakePlan
    make_practice: Callable[[Any, str, int, int], Plan | None]
    session: Callable[[Plan, Setup[Any]], Session]
    columns: Callable[[Any], tuple[Column, ...]]
    suffix: Callable[[Any], str]
    rows: Callable[[Plan, History, Any], list[Row]]
    choices: Callable[[Setup[Any]], tuple[Choice, ...]]
    stimuli: Callable[[Setup[Any]], Stimuli]
    synthetic_participant: Callable[[Setup[Any], Plan], Any]
    answer_columns: tuple[str, ...] = ()


CATALOGUE: dict[str, Experiment] = {
    "direction": Experiment(
        config=DirectionConfig,
        make_plan=lambda config, code, seed, row, _=0: direction_plan(config, code, seed, row),
        make_practice=lambda config, code, seed, _: direction_practice(config, code, seed),
        session=direction_session,
        columns=lambda _: TABLES["direction"],
        suffix=lambda _: FILE_SUFFIX["direction"],
        rows=lambda plan, history, _: direction_rows(plan, history),
        choices=ways,
        stimuli=lambda setup: stimuli_of_methods(setup.gun, setup.config.methods),
        synthetic_participant=direction_synthetic.synthetic_participant,
        answer_columns=direction_synthetic.TABLE_COLUMNS,
    ),
    "preference": Experiment(
        config=PreferenceConfig,
        make_plan=lambda config, code, seed, row, _=0: preference_plan(config, code, seed, row),
        make_practice=lambda *_: None,
        session=preference_session,
        columns=lambda _: TABLES["preference"],
        suffix=lambda _: FILE_SUFFIX["preference"],
        rows=lambda plan, history, _: preference_rows(plan, history),
        choices=lambda _: (),
        stimuli=lambda setup: stimuli_of_methods(setup.gun, setup.config.methods),
        synthetic_participant=preference_synthetic.synthetic_participant,
        answer_columns=preference_synthetic.TABLE_COLUMNS,
    ),
}


def _choices(setup: Setup[DesignConfig]) -> tuple[Choice, ...]:
    """The answers of the first question that has some."""
    return next(filter(None, map(choices, setup.config.questions.values())), ())


def _participant(setup: Setup[DesignConfig], plan: Plan) -> DesignParticipant:
    if not isinstance(setup.laws, SyntheticAnswers):
        raise ConfigError(f"{setup.source}: synthetic is missing; it names the file that says how people answer")
    return DesignParticipant(setup.config, setup.laws, plan)


DESIGN = Experiment(
    config=DesignConfig,
    make_plan=lambda design, code, seed, row, group=0: planning.plan_of(design, code, seed, row=row, group=group),
    make_practice=lambda design, code, seed, group: planning.practice_of(design, code, seed, group=group),
    session=design_session,
    columns=design_table.columns,
    suffix=lambda design: design.table,
    rows=design_table.design_rows,
    choices=_choices,
    stimuli=lambda setup: stimuli_of(setup.config, setup.gun),
    synthetic_participant=_participant,
)
"""What makes any design."""


def experiment(setup: Setup[Any]) -> Experiment:
    """The experiment that a setup is of."""
    return DESIGN if isinstance(setup.config, DesignConfig) else CATALOGUE[setup.config.experiment]


def of_head(head: Head) -> tuple[Experiment, DesignConfig | None]:
    """The experiment that a journal is of, with its design if it is one. `JournalError`: this version knows none."""
    name, setup = head.plan.experiment, head.setup_json if isinstance(head.setup_json, dict) else {}
    design = setup.get("experiment")
    if isinstance(design, dict) and "factors" in design:
        try:
            return DESIGN, checked_table(DesignConfig, design, f"{head.path}: line 1")
        except ConfigError as error:
            raise JournalError(f"{error}; the journal was changed, or another version of Recoil wrote it") from error
    if name not in CATALOGUE:
        raise JournalError(f"{head.path}: line 1: experiment {name!r} is not known to this version of Recoil")
    return CATALOGUE[name], None


def table(contents: Contents) -> bytes:
    """The CSV that a journal makes. `JournalError` if this version does not know its plan."""
    known, config = of_head(contents.head)
    return table_bytes(known.columns(config), known.rows(contents.plan, replay.history(contents), config))


def rebuild(path: Path) -> tuple[Path, bytes, Contents]:
    """The table of a journal: where it belongs, its bytes, and what the journal holds."""
    contents = read_journal(path)
    data = table(contents)
    known, config = of_head(contents.head)
    name = path.name.replace("_journal", f"_{known.suffix(config)}")
    return path.with_name(name).with_suffix(".csv"), data, contents
