"""What tells the conditions of a design apart, and the answers in them as numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.stats.arrays import FloatArray
from experiments.design.config import DesignConfig
from experiments.design.language import QuestionConfig


def varied(design: DesignConfig) -> list[str]:
    """The columns by which conditions differ: factors with several levels; of pairs both intervals."""
    own = {name: one for name, one in design.factors.items() if name not in design.adapted}
    names = [name for name, factor in own.items() if len(factor.all_levels) > 1]
    if design.trial.kind != "pair":
        return names
    compared = design.trial.compare
    return [one for name in names for one in ([f"{name}_1", f"{name}_2"] if name == compared else [name])]


def answer_scores(question: QuestionConfig, column: pd.Series, *, of_pair: bool = False) -> FloatArray:
    """The answers as numbers; NaN for none. An unscored choice: 1 for the first answer, 0.5 for a tie of a pair."""
    if question.kind in {"rating", "ranking"} or question.correct is not None:
        return pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
    if question.kind == "number":
        numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(numbers > 0, np.log(numbers), np.nan)
    given = column.isin(question.named_answers)
    first = (column == question.named_answers[0]).to_numpy(dtype=np.float64)
    tied = of_pair & ~column.isin(question.named_answers[:2])
    return np.where(given, np.where(tied, 0.5, first), np.nan)
