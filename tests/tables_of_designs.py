"""Tables of the ten designs as their synthetic participants fill them, without a session."""

from __future__ import annotations

import pandas as pd

from experiments.config.door import load
from experiments.design.config import DesignConfig
from experiments.design.planning import groups, plan_of, square_size
from experiments.load import load_gun, shipped_folder
from experiments.synthetic.answers import SyntheticParticipant
from experiments.synthetic.laws import SyntheticAnswers
from experiments.tasks.questions import correct_columns, is_right
from tests.designs import path_of


def loaded(name: str) -> tuple[DesignConfig, SyntheticAnswers]:
    design = load(DesignConfig, path_of(name))
    return design, load(SyntheticAnswers, path_of(name).parent / str(design.synthetic))


def simulated(design: DesignConfig, laws: SyntheticAnswers, count: int) -> pd.DataFrame:
    """The answers of so many people: a row a trial, the columns of the design that hold answers and levels."""
    gun = load_gun(shipped_folder() / design.gun)
    rows, square, kinds = [], square_size(design), len(groups(design))
    scored = correct_columns(design.questions)
    for number in range(count):
        plan = plan_of(design, f"P{number:02d}", 1, row=number % square if square else None, group=number % kinds)
        person = SyntheticParticipant(design, laws, plan, gun)
        for trial in plan.trials:
            row = {"participant_id": plan.participant_id, **dict(trial.levels)}
            row |= {f"{design.trial.compare}_{place}": level for place, level in enumerate(trial.intervals, start=1)}
            row |= {"stimulus": int(not trial.catch)} if design.trial.catch else {}
            for name, question in design.questions.items():
                row[name] = person.answer(trial, name).value
                if name in scored:
                    right = is_right(design, question, trial, row[name])
                    row[scored[name]] = None if right is None else int(right)
            rows.append(row)
    return pd.DataFrame(rows)
