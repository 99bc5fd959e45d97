"""`recoil power` of a design with a threshold: trials against the width of its interval, by procedure, and the bias."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from analysis.predict.power.grid import whole_numbers
from analysis.predict.threshold_plan.people import Answers, SyntheticPeople, answers_by, procedures
from analysis.psychometric.people import PersonFit, ShareAtLevel, person_fit
from analysis.psychometric.priors import Priors
from analysis.report.serial import UNWRITTEN, NotebookResult, plain
from analysis.report.terminal import untold
from analysis.stats.arrays import FloatArray
from analysis.summary.thresholds import FittedShare, fitted_share, has_own_priors, numeric_factor, priors_of
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.procedure_problems import guess_of
from experiments.design.procedures.choosing import PosteriorRule, posterior_rule
from experiments.design.procedures.config import PosteriorConfig
from experiments.design.streams import generator
from experiments.load import find, load_setup
from experiments.record.provenance import provenance
from experiments.synthetic.laws import PsychometricLaw, SyntheticAnswers
from experiments.tasks.questions import chance

PEOPLE, TRACK_TRIALS = 200, "20,40,80"
_FEWEST, _MOST = 10, 400


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdRequest:
    """What is asked for: the config, lists of trials, how many synthetic people a procedure, the seed."""

    config: str
    trials: str = TRACK_TRIALS
    people: int = PEOPLE
    seed: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcedurePower:
    """So many trials of a procedure: how well the threshold is known after them, in the unit of the level.

    `width`: of the 95 % credible interval, the median over people; `bias`: the mean of the estimate less the truth,
    with its standard error; `rms_error`: the root of the mean squared error; `coverage`: how often the interval holds
    the truth; `without`: the share of people without a threshold within the levels; `minutes` of a run.
    """

    procedure: str
    trials: int
    minutes: float
    width: float
    bias: float
    bias_se: float
    rms_error: float
    coverage: float
    without: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdPower(NotebookResult):
    """The content of `power.json` for a design with a threshold. `best`: by trials, the procedure of least error.

    `own_rule`: the posterior rule is the design's.
    """

    experiment: str
    title: str
    question: str
    factor: str
    share: FittedShare
    seed: int
    people: int
    levels: tuple[float, ...]
    threshold: float
    spread: float
    lapse: float
    guess: float
    log_threshold_sd: float
    procedures: tuple[ProcedurePower, ...]
    best: dict[str, str]
    provenance: dict[str, str]
    own_rule: bool = field(default=False, metadata=UNWRITTEN)

    def rows(self) -> list[dict[str, object]]:
        """A row a procedure and number of trials."""
        return [plain(one) for one in self.procedures]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Planned:
    """What of a design is planned, and how its people answer."""

    design: DesignConfig
    question: str
    factor: str
    share: FittedShare
    levels: tuple[float, ...]
    law: PsychometricLaw
    threshold: float
    guess: float
    lapse: float


def procedures_of(config: str) -> tuple[str, ...]:
    """What is compared for a config; nothing unless its people answer by a psychometric function of a threshold."""
    planned = _planned(load_setup(find(config)))
    return () if planned is None else procedures(planned.share)


def people_fitted(request: ThresholdRequest) -> int:
    """How many people `threshold_power` will fit, and tell of one by one. `ConfigError` as there."""
    return len(procedures_of(request.config)) * len(_trials(request)) * request.people


_AROUND_S, _FIT_S, _TRIAL_S = 2.0, 4e-3, 1e-4  # start and report, a person's fit, and each trial that they did


def plan_time_s(request: ThresholdRequest) -> float:
    """About how long `threshold_power` takes with its page. `ConfigError` as there."""
    fits = len(procedures_of(request.config)) * request.people
    return _AROUND_S + sum(fits * (_FIT_S + _TRIAL_S * count) for count in _trials(request))


def threshold_power(request: ThresholdRequest, tell: Callable[[str], None] = untold) -> ThresholdPower:
    """Simulate people at each procedure, and fit them as the analysis will. `ConfigError`: nothing to be planned."""
    planned = _planned(load_setup(find(request.config)))
    if planned is None:
        raise ConfigError(
            f'{request.config}: no question with a success over numbers is answered by law "psychometric"'
        )
    trials = _trials(request)
    found = []
    for procedure in procedures(planned.share):
        found += list(_of_procedure(procedure, planned, request, tell))
    law = planned.law
    return ThresholdPower(
        experiment=planned.design.design,
        title=planned.design.title,
        question=planned.question,
        factor=planned.factor,
        share=planned.share,
        seed=request.seed,
        people=request.people,
        levels=planned.levels,
        threshold=planned.threshold,
        spread=law.spread,
        lapse=planned.lapse,
        guess=planned.guess,
        log_threshold_sd=_own_sd(planned),
        procedures=tuple(found),
        best={str(count): _best(found, count) for count in trials},
        provenance=provenance(),
        own_rule=_own_rule(planned) is not None,
    )


def _trials(request: ThresholdRequest) -> list[int]:
    return whole_numbers(request.trials, "--trials", _FEWEST, _MOST)


def _best(found: Sequence[ProcedurePower], trials: int) -> str:
    return min((one for one in found if one.trials == trials), key=lambda one: one.rms_error).procedure


def _planned(setup: Setup[DesignConfig]) -> _Planned | None:
    design, factor = setup.config, numeric_factor(setup.config)
    if not isinstance(setup.laws, SyntheticAnswers) or factor is None:
        return None
    for name, question in design.questions.items():
        law, share = setup.laws.questions.get(name), fitted_share(design, question)
        if isinstance(law, PsychometricLaw) and law.factor == factor and share is not None:
            levels = tuple(float(level) for level in design.factors[factor].all_levels)
            standard = design.trial.standard
            compared = share == "chosen" and isinstance(standard, float)
            return _Planned(
                design=design,
                question=name,
                factor=factor,
                share=share,
                levels=levels,
                law=law,
                threshold=float(standard) if compared and standard is not None else law.threshold,
                guess=law.lapse / 2 if compared else chance(question) or 0.0 if share == "right" else law.guess,
                lapse=law.lapse / 2 if compared else law.lapse,
            )
    return None


def _own_sd(planned: _Planned) -> float:
    """How people differ in the logarithm of their threshold; a point of subjective equality is everybody's."""
    return 0.0 if planned.share == "chosen" else planned.law.log_threshold_sd


def _of_procedure(
    procedure: str, planned: _Planned, request: ThresholdRequest, tell: Callable[[str], None]
) -> Iterator[ProcedurePower]:
    trials = _trials(request)
    own = generator(request.seed, "threshold power", "people").normal(size=request.people) * _own_sd(planned)
    people = SyntheticPeople(
        thresholds=planned.threshold * np.exp(own),
        spread=planned.law.spread,
        lapse=planned.lapse,
        guess=planned.guess,
        chance=planned.share == "right",
    )
    stream = generator(request.seed, "threshold power", procedure)
    answers = answers_by(procedure, people, planned.levels, max(trials), stream, own=_own_rule(planned))
    priors = priors_of(planned.design, np.array(planned.levels))
    known = planned.guess if planned.share == "right" else None
    for count in trials:
        fits = []
        for place in range(request.people):
            fits.append(_fit(answers, place, count, known, priors))
            tell(f"{procedure}, {count} trials")
        yield _power(procedure, planned, count, fits, people.thresholds)


def _own_rule(planned: _Planned) -> PosteriorRule | None:
    """The posterior rule of the design, if it has one."""
    table = planned.design.adaptive
    if not isinstance(table, PosteriorConfig) or not has_own_priors(planned.design):
        return None
    return posterior_rule(table, [planned.levels], guess_of(planned.design.questions[planned.question]))


def _fit(answers: Answers, place: int, count: int, guess: float | None, priors: Priors) -> PersonFit:
    span = priors.threshold.flat_from, priors.threshold.flat_to
    levels, right = answers.levels[place, :count], answers.right[place, :count]
    points = tuple(
        ShareAtLevel(level=float(level), right=int(right[levels == level].sum()), trials=int((levels == level).sum()))
        for level in np.unique(levels)
    )
    return person_fit(
        PersonFit(participant=str(place), points=points), guess=guess, falling=False, span=span, priors=priors
    )


def _power(
    procedure: str, planned: _Planned, count: int, people: Sequence[PersonFit], truths: FloatArray
) -> ProcedurePower:
    fitted = [(one.fit, truth) for one, truth in zip(people, truths.tolist(), strict=True) if one.fit is not None]
    off = np.array([fit.threshold.median - truth for fit, truth in fitted])
    widths = [fit.threshold.high - fit.threshold.low for fit, _ in fitted]
    return ProcedurePower(
        procedure=procedure,
        trials=count,
        minutes=count * planned.design.trial_s / 60,
        width=float(np.median(widths)),
        bias=float(off.mean()),
        bias_se=float(off.std(ddof=1) / np.sqrt(off.size)),
        rms_error=float(np.sqrt(np.mean(off**2))),
        coverage=float(np.mean([fit.threshold.low <= truth <= fit.threshold.high for fit, truth in fitted])),
        without=float(np.mean([fit.where != "within" for fit, _ in fitted])),
    )
