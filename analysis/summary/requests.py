"""What a revision of a paper asks for beyond the report's own statistics: a file of requests, and what answers them.

    [[requests]]
    kind = "contrasts"                         # planned contrasts of the conditions, each on its own error
    of = "direction"                           # an experiment or a design whose logs are analysed
    weights."force against vibration" = { vibration = -1.0, asymmetric-1 = 0.5, asymmetric-2 = 0.5 }

`configs/examples/requests.toml` has every kind. Scores are those of the report: a participant's mean in a condition, in
direction the share of right answers to forward shots. A condition of several factors is called by its levels, joined by
`/`; a condition without a weight has weight 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from analysis.logs.mapped_people import ShortText
from analysis.stats.anova_bayes import FIXED_SCALE, RANDOM_SCALE, AnovaBayesFactor, rm_anova_bayes_factor
from analysis.stats.arrays import FloatArray
from analysis.stats.contrasts import PlannedContrast, planned_contrasts
from analysis.stats.corrections import Correction
from analysis.stats.equivalence import Equivalence, tost_one_sample, tost_paired
from analysis.stats.fixed_effects import indicators
from analysis.stats.mixed_model import LinearMixedModel, linear_mixed_model
from analysis.stats.random_intercept import NODES, RandomInterceptLogit, random_intercept_logit
from experiments.config.door import Model
from experiments.design.language import Level

RequestKind = Literal["contrasts", "equivalence", "bayes-factor", "mixed-model", "logistic"]
AnyResult = tuple[PlannedContrast, ...] | Equivalence | AnovaBayesFactor | LinearMixedModel | RandomInterceptLogit


class _OfData(Model):
    """Whose data: an experiment or a design, and of several questions which one."""

    of: ShortText
    question: ShortText | None = None


class ContrastsRequest(_OfData):
    """Weights of the conditions by the name of each contrast."""

    kind: Literal["contrasts"]
    weights: dict[ShortText, dict[ShortText, float]] = Field(min_length=1)
    correction: Correction = "holm"


class EquivalenceRequest(_OfData):
    """Is the mean of condition `a`, less that of `b` if it is given, between `low` and `high`?"""

    kind: Literal["equivalence"]
    a: ShortText
    b: ShortText | None = None
    low: float
    high: float
    alpha: Annotated[float, Field(gt=0.0, lt=0.5)] = 0.05


class BayesFactorRequest(_OfData):
    """The Bayes factor of the conditions; `scale` is that of the prior on their effects."""

    kind: Literal["bayes-factor"]
    scale: Annotated[float, Field(gt=0.0, le=10.0)] = FIXED_SCALE


class MixedModelRequest(_OfData):
    """A linear mixed model of single trials. `terms` are factors, or several joined by `:`; all unless given."""

    kind: Literal["mixed-model"]
    terms: tuple[ShortText, ...] = ()


class LogisticRequest(_OfData):
    """A logistic mixed model of single answers; `terms` as in a linear one."""

    kind: Literal["logistic"]
    terms: tuple[ShortText, ...] = ()


AnyRequest = ContrastsRequest | EquivalenceRequest | BayesFactorRequest | MixedModelRequest | LogisticRequest


class Requests(Model):
    """All requests of a file."""

    requests: tuple[Annotated[AnyRequest, Field(discriminator="kind")], ...] = Field(min_length=1, max_length=100)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requested:
    """The answer to one request: from how many people, what was done in words, and the result.

    `shares`: scores are shares of answers, 0 to 1, which a report shows in percentage points.
    """

    kind: RequestKind
    of: str
    question: str | None
    people: int
    shares: bool
    note: str
    result: AnyResult


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestNames:
    """What a request may name: conditions, and factors with their levels in the order of the design.

    `grouped`: some factor varies between people. `parted`: factors of which each such group has levels of its own.
    """

    conditions: tuple[str, ...]
    factors: Mapping[str, tuple[Level, ...]]
    grouped: bool = False
    parted: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RequestData:
    """What requests are answered from.

    `scores`: participants by conditions, no cell empty; `trials`: a row a trial, with `participant_id`, `score` and the
    factors. `unit`: what a score is; `shares`: those are shares of answers, 0 to 1.
    """

    scores: pd.DataFrame
    trials: pd.DataFrame
    unit: str
    shares: bool
    names: RequestNames


LOGARITHMS = "natural logarithms of the numbers"
"""What scores of numbers are."""


def bounds_in(unit: str, *, shares: bool) -> str:
    """What the bounds of an equivalence test are of, by what a score is."""
    return f"shares of {unit}, 0 to 1" if shares else unit


def ratios(request: EquivalenceRequest) -> str:
    """What bounds in natural logarithms are as ratios: between two conditions, or of the mean itself."""
    what = "the geometric mean" if request.b is None else f"the ratio of {request.a} to {request.b}"
    return f"{what} between {_factor(request.low)} and {_factor(request.high)}"


def _factor(bound: float) -> str:
    """The factor that a natural logarithm stands for.

    >>> _factor(0.0), _factor(-5.0), _factor(1e6)
    ('1', '0.00674', 'e^1e+06')
    """
    return f"{math.exp(bound):.3g}" if abs(bound) < _MOST_LOG else f"e^{bound:g}"


_MOST_LOG = 50.0


def check_names(request: AnyRequest, names: RequestNames) -> None:
    """`ValueError` if a request names what is not there, or asks what such a design cannot answer."""
    match request:
        case ContrastsRequest():
            _check_conditions((name for weights in request.weights.values() for name in weights), names)
        case EquivalenceRequest():
            _check_conditions((request.a, *(() if request.b is None else (request.b,))), names)
        case BayesFactorRequest():
            if names.grouped or len(names.factors) > 1:
                raise ValueError("a Bayes factor is of one factor within people, and there are more")
        case MixedModelRequest() | LogisticRequest():
            for name in _named_factors(request.terms, names):
                if name not in names.factors:
                    there = ", ".join(names.factors)
                    raise ValueError(f"terms: there is no factor {name!r} that varies; there are {there}")


def _check_conditions(asked: Iterable[str], names: RequestNames) -> None:
    if names.parted:
        parted = f"each group of people has levels of {' and '.join(names.parted)} of its own"
        raise ValueError(f"{parted}, so nobody has all conditions, which such a test needs; take mixed-model")
    if len(names.conditions) < 2:
        raise ValueError("such a test needs two conditions within people, and there is one; take mixed-model")
    for name in asked:
        if name not in names.conditions:
            raise ValueError(f"there is no condition {name!r}; there are {', '.join(names.conditions)}")


_CORRECTED = {
    "none": "not corrected for their number",
    "holm": "p corrected by Holm (1979)",
    "benjamini-hochberg": "p corrected by Benjamini and Hochberg (1995)",
}


def answer_to(request: AnyRequest, data: RequestData) -> Requested:
    """The answer to a request. `ValueError` if the data have not what it names, with what they have."""
    check_names(request, data.names)
    match request:
        case ContrastsRequest():
            note, result = _contrasts(request, data)
        case EquivalenceRequest():
            note, result = _equivalence(request, data)
        case BayesFactorRequest():
            note, result = _bayes_factor(request, data)
        case MixedModelRequest():
            note, result = _mixed_model(request, data)
        case LogisticRequest():
            note, result = _logistic(request, data)
    of_trials = isinstance(result, LinearMixedModel | RandomInterceptLogit)
    together = ", people of all groups together" if data.names.grouped else ""
    said = f"The trials: {data.unit}" if of_trials else f"Scores: participants' means of {data.unit}{together}"
    return Requested(
        kind=request.kind,
        of=request.of,
        question=request.question,
        people=data.trials["participant_id"].nunique() if of_trials else len(data.scores),
        shares=data.shares,
        note=f"{note} {said}.",
        result=result,
    )


def _contrasts(request: ContrastsRequest, data: RequestData) -> tuple[str, AnyResult]:
    wide = {name: [weights.get(one, 0.0) for one in data.names.conditions] for name, weights in request.weights.items()}
    note = (
        "Contrasts of the participants' scores, each on its own error (t on n − 1 degrees of freedom), which needs no "
        f"sphericity; {_CORRECTED[request.correction]}; intervals of each contrast by itself."
    )
    return note, planned_contrasts(_table(data), wide, request.correction)


def _equivalence(request: EquivalenceRequest, data: RequestData) -> tuple[str, AnyResult]:
    _table(data)
    first, bounds = _column(data, request.a), (request.low, request.high, request.alpha)
    what = request.a if request.b is None else f"{request.a} − {request.b}"
    scale, unit = (100.0, " percentage points") if data.shares else (1.0, "")
    shown = " and ".join(f"{scale * bound:g}".replace("-", "−") for bound in bounds[:2])
    unit = f" in {data.unit} ({ratios(request)})" if data.unit == LOGARITHMS else unit
    note = (
        f"Whether the mean of {what} lies between {shown}{unit}, by two one-sided t-tests (TOST, Schuirmann 1987), "
        f"α = {request.alpha:g}: one test that it is above the lower bound, one that it is below the upper. p is the "
        "larger of the two."
    )
    if request.b is None:
        return note, tost_one_sample(first, *bounds)
    return note, tost_paired(first, _column(data, request.b), *bounds)


def _bayes_factor(request: BayesFactorRequest, data: RequestData) -> tuple[str, AnyResult]:
    note = (
        "Bayes factor of the repeated-measures ANOVA: conditions and participants against participants alone (Rouder "
        f"et al. 2012), of the participants' scores; effects Cauchy, r = {request.scale:g} for the conditions and "
        f"{RANDOM_SCALE:g} for the participants."
    )
    return note, rm_anova_bayes_factor(_table(data), request.scale)


_BINARY = (
    " Caution: the answers are 0 or 1, which a linear model takes for numbers that may lie anywhere: its errors are "
    'neither normal nor alike, and what it predicts may pass 0 or 1. `kind = "logistic"` is the model of such answers.'
)


def _mixed_model(request: MixedModelRequest, data: RequestData) -> tuple[str, AnyResult]:
    binary = data.trials["score"].isin((0.0, 1.0)).all()
    note = (
        "Linear mixed model of single trials with a random intercept a person, fitted by REML (statsmodels "
        f"{version('statsmodels')}); Wald tests on the normal distribution.{_references(request.terms, data)}"
        f"{_BINARY if binary else ''}"
    )
    trials = data.trials
    return note, linear_mixed_model(trials["score"], list(trials["participant_id"]), _predictors(request.terms, data))


def _logistic(request: LogisticRequest, data: RequestData) -> tuple[str, AnyResult]:
    trials = data.trials
    if not trials["score"].isin((0.0, 1.0)).all():
        raise ValueError("a logistic model is of answers that are right or wrong, or one of two; take mixed-model")
    note = (
        "Logistic regression of single answers with a random intercept a person, by maximum likelihood (adaptive "
        f"Gauss-Hermite quadrature, {NODES} nodes); odds are one person's; Wald tests."
        f"{_references(request.terms, data)}"
    )
    predictors = _predictors(request.terms, data)
    return note, random_intercept_logit(trials["score"], list(trials["participant_id"]), predictors)


def _table(data: RequestData) -> FloatArray:
    n, k = data.scores.shape
    if n < 2 or k < 2:
        raise ValueError(f"two people with all of two conditions are needed; there are {n} and {k}")
    return data.scores.to_numpy(dtype=np.float64)


def _column(data: RequestData, name: str) -> FloatArray:
    return data.scores[name].to_numpy(dtype=np.float64)


def _terms(terms: tuple[str, ...], names: RequestNames) -> tuple[str, ...]:
    return terms or tuple(names.factors)


def _named_factors(terms: tuple[str, ...], names: RequestNames) -> tuple[str, ...]:
    """The factors of all terms, each once."""
    return tuple(dict.fromkeys(name for term in _terms(terms, names) for name in term.split(":")))


def _predictors(terms: tuple[str, ...], data: RequestData) -> dict[str, FloatArray]:
    """The columns of all terms by name; those of several factors are products."""
    found: dict[str, FloatArray] = {}
    for term in _terms(terms, data.names):
        columns: dict[str, FloatArray] = {}
        for name in term.split(":"):
            own = _factor_columns(name, data)
            columns = {f"{a}:{b}": x * y for a, x in columns.items() for b, y in own.items()} if columns else own
        found |= columns
    return found


def _factor_columns(name: str, data: RequestData) -> dict[str, FloatArray]:
    """A factor of numbers as it is, one of words as indicators against its first level."""
    column, levels = data.trials[name], data.names.factors[name]
    if not isinstance(levels[0], str):
        return {name: column.to_numpy(dtype=np.float64)}
    given = [str(level) for level in column]
    there = [level for level in map(str, levels) if level in given]
    found = indicators(given, there[0])
    return {level: found[level] for level in there[1:]}


def _references(terms: tuple[str, ...], data: RequestData) -> str:
    """What words are compared with, and where a factor's own coefficients are beside an interaction."""
    compared = "".join(f" Levels of {name} are compared with {first}." for name, first in _first_levels(terms, data))
    return f"{compared}{_ALONE if any(':' in term for term in terms) else ''}"


_ALONE = (
    " Beside their interaction, what stands of a factor alone is its effect at the first level of the other, and where "
    "that is a number, at 0, which may lie far from all levels."
)


def _first_levels(terms: tuple[str, ...], data: RequestData) -> Iterator[tuple[str, str]]:
    for name in _named_factors(terms, data.names):
        levels = data.names.factors[name]
        if levels and isinstance(levels[0], str):
            yield name, levels[0]
