"""What the percept is fitted to, and where the published numbers that were not fitted lie among simulated studies.

The fit knows the mean forward rates alone. What the same people would give for F, for Tukey's pattern and for backward
shots is the model's own, so those are what it can fail by.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from analysis.paper.paper import PublishedDirection, load_paper, rounds_to
from analysis.paper.recurrence import WHOLE_PATTERN, Recurrence, answers_recur, recurs, share_of, wilson_interval
from analysis.predict.fit.percept_model import FITTED, PAPER_TRIALS, PerceptPeak, best_percept
from analysis.predict.synthetic_studies import Counts, Felt, felt_counts, piece_sizes
from analysis.stats.anova import rm_anova
from analysis.stats.arrays import FloatArray
from analysis.stats.binomial import binomial_test_p
from device.methods import Method
from device.words import DIRECTIONS
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.design.streams import generator
from experiments.load import find, load_gun
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, percepts_of

ASSUMED_SPREAD = People(drift_factor_sd=0.2, log_boundary_sd=0.1, log_non_decision_sd=0.1, logit_start_sd=0.2)
"""How people are taken to differ; assumed: the paper prints no spread."""
_LARGEST_SPREAD = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptRequest:
    """What is to be fitted. `rates`, such as `vibration=0.557,...`, stand in for the paper's.

    `spread`: factor on the assumed differences between people whose mean rates these are.
    """

    paper: str = "paper"
    rates: str | None = None
    trials: int | None = None
    gun: str = "gun"
    spread: float = 0.0
    studies: int | None = None
    seed: int = 1


STUDIES = 10_000
"""To judge a fit to a paper by, where nothing else is asked for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptTask:
    """A request with all that it names: forward rates, the trials behind each, methods, people, and what is published.

    `source` says in words where the rates come from; without a paper there is nothing to judge by. `labels`: what the
    gun calls its methods.
    """

    source: str
    rates: Mapping[str, float]
    trials: int
    methods: Mapping[str, Method]
    people: People
    published: PublishedDirection | None
    studies: int
    labels: Mapping[str, str] = field(default_factory=dict)


def read_request(request: PerceptRequest) -> PerceptTask:
    """The task of a request. `ConfigError`: rates, trials, a paper or a gun that cannot be used."""
    if not 0.0 <= request.spread <= _LARGEST_SPREAD:
        raise ConfigError(f"--spread {request.spread:g}: must be a factor from 0 (people alike) to {_LARGEST_SPREAD:g}")
    studies = STUDIES if request.studies is None else request.studies
    if request.rates is not None and request.studies:
        raise ConfigError(f"--studies {studies}: with --rates nothing is published to judge by; leave one of them out")
    if request.rates is not None:
        published, source = None, "the given rates"
        rates, trials = given_rates(request.rates), PAPER_TRIALS if request.trials is None else request.trials
    else:
        published, source = _published(request), "the published rates"
        rates, trials = published_rates(published)
    if len(rates) < len(FITTED):
        option = f"--rates {request.rates}" if request.rates is not None else str(find(request.paper))
        raise ConfigError(f"{option}: {len(rates)} rates; three numbers are fitted, so there must be at least 3")
    gun = load_gun(find(request.gun))
    return PerceptTask(
        source=source,
        rates=rates,
        trials=trials,
        methods=_methods(find(request.gun), gun, rates),
        people=assumed_spread(request.spread),
        published=published,
        studies=studies,
        labels=gun.labels,
    )


def given_rates(text: str) -> dict[str, float]:
    """Rates by method. `ConfigError` for what is no name with a share from 0 to 1, or a name that comes twice.

    >>> given_rates("vibration=0.557, asymmetric-1=0.793")
    {'vibration': 0.557, 'asymmetric-1': 0.793}
    """
    found: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        try:
            rate = float(value)
        except ValueError:
            rate = math.nan
        if not name or not 0.0 <= rate <= 1.0:
            raise ConfigError(f"--rates {text}: {part.strip()!r} must be a method and a share, such as vibration=0.557")
        if name in found:
            raise ConfigError(f"--rates {text}: {name} stands there twice; name each method once")
        found[name] = rate
    return found


def published_rates(published: PublishedDirection) -> tuple[dict[str, float], int]:
    """The paper's mean forward rates as shares, in its order of methods, and the forward trials behind each."""
    rates = {name: float(published.means[name]) / 100.0 for name in published.methods}
    return rates, published.n * published.protocol.forward_trials_per_session


def assumed_spread(factor: float) -> People:
    """People who differ so many times as much as is assumed."""
    return People(**{name: factor * sd for name, sd in asdict(ASSUMED_SPREAD).items()})


def _published(request: PerceptRequest) -> PublishedDirection:
    if request.trials is not None:
        raise ConfigError(f"--trials {request.trials}: the paper has its own; give the option with --rates alone")
    path = find(request.paper)
    published = load_paper(path).direction
    missing = [name for name in published.methods if name not in published.means]
    if missing:
        raise ConfigError(f"{path}: direction.means has no rate of {', '.join(missing)}; give one for each method")
    return published


def _methods(path: Path, config: GunConfig, rates: Mapping[str, float]) -> dict[str, Method]:
    strangers = [name for name in rates if name not in config.methods]
    if strangers:
        raise ConfigError(
            f"{path}: there is a rate of {', '.join(strangers)}, but no such method; there are "
            f"{', '.join(config.methods)}"
        )
    return config.renderings(tuple(rates))


PERCENTILES = (2.5, 25.0, 50.0, 75.0, 97.5)
HISTOGRAM_BINS = 40
LARGEST_VARIANCE = 2.0
"""Of a fitted number's logarithm: beyond, the normal approximation describes nothing that could be drawn (assumed)."""
MAIN = "assumed spread"
PEOPLE_KINDS = {"people alike": People(), MAIN: ASSUMED_SPREAD, "twice the spread": assumed_spread(2.0)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Studies of one kind of people. `fit` meets the published means with them; with `drawn` its error is drawn too."""

    name: str
    people: People
    fit: PerceptPeak
    drawn: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedPlace:
    """Where a published number lies among the simulated ones.

    `percentile`: share below it plus half of those that print alike, 0 to 1, with its 95 % Monte Carlo interval.
    `outside`: twice the smaller tail. `fitted`: the fit has seen this number, so its place says nothing.
    """

    quantity: str
    published: str
    percentile: float
    ci_low: float
    ci_high: float
    outside: float
    quantiles: tuple[float, ...]  # at `PERCENTILES`
    fitted: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RecurringClaim:
    """The share of studies in which a published claim holds, with its 95 % Wilson interval; has the fit seen it?"""

    claim: str
    share: float
    ci_low: float
    ci_high: float
    fitted: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """What the studies of a case say: the people and their percept, the published numbers' places, the claims."""

    name: str
    people: People
    parameters: PerceptParameters
    places: tuple[PublishedPlace, ...]
    claims: tuple[RecurringClaim, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """All cases' studies against what is published; `main` is the place of the case to report."""

    studies: int
    seed: int
    main: int
    percentiles: tuple[float, ...]
    cases: tuple[Judged, ...]

    @property
    def main_case(self) -> Judged:
        """The case to report."""
        return self.cases[self.main]


Histograms = dict[str, tuple[tuple[float, ...], tuple[float, ...]]]
"""Of each quantity the simulated values: edges and counts."""


def cases_of(
    rates: Mapping[str, float], methods: Mapping[str, Method], trials: int, assumed: PerceptParameters
) -> list[Case]:
    """The kinds of people that are judged, the percept fitted anew for each; `assumed` has what is not fitted."""
    cases = [
        Case(name=name, people=people, fit=best_percept(rates, methods, trials=trials, people=people, base=assumed))
        for name, people in PEOPLE_KINDS.items()
    ]
    if (np.diag(cases[1].fit.covariance) < LARGEST_VARIANCE).all():  # not so if it is NaN
        cases.append(replace(cases[1], name=f"{MAIN}, fit's error drawn", drawn=True))
    return cases


def judge(
    case: Case,
    methods: Mapping[str, Method],
    published: PublishedDirection,
    *,
    studies: int,
    seed: int,
    tell: Callable[[str], None],
) -> tuple[Judged, Histograms]:
    """Draw the studies of a case at the paper's design, and find the published numbers' places.

    They are drawn in pieces, each with a stream of its own; `tell` is told of each.
    """
    percepts = percepts_of({name: methods[name] for name in published.methods}, case.fit.parameters.leak_s)
    pieces = []
    for number, count in enumerate(piece_sizes(studies, published.n)):
        draws = generator(seed, "fit", case.name, str(number))
        pieces.append(_counts(case, percepts, published, count, draws))
        tell(case.name)
    correct = np.concatenate(pieces)
    quantities = _quantities(correct, published)
    judged = Judged(
        name=case.name,
        people=case.people,
        parameters=case.fit.parameters,
        places=tuple(place_of(*one) for one in quantities),
        claims=tuple(_claims(correct, published)),
    )
    return judged, {name: _histogram(values) for name, _, values, _ in quantities}


def _counts(
    case: Case,
    percepts: Mapping[str, Percept],
    published: PublishedDirection,
    studies: int,
    draws: np.random.Generator,
) -> Counts:
    """Correct answers, (studies, n, methods, 2), methods in the published order."""
    fitted = _drawn(case.fit, studies, draws) if case.drawn else [case.fit.parameters]
    log_odds = np.array([[[evidence(percepts[name], one) for name in published.methods]] for one in fitted])
    start = np.array([[one.start] for one in fitted])
    felt = Felt(log_odds=log_odds, start=start, people=case.people)
    return felt_counts(felt, _trials(published), published.n, studies, draws)


def _drawn(fit: PerceptPeak, studies: int, draws: np.random.Generator) -> list[PerceptParameters]:
    """Parameters from the fit's normal approximation: their logarithms with its covariance."""
    p = fit.parameters
    centre = np.log([p.sensitivity, p.confusion, p.start])
    factor = np.linalg.cholesky(np.array(fit.covariance))
    values = np.exp(centre + draws.standard_normal((studies, len(FITTED))) @ factor.T)
    values[:, 2] = np.minimum(values[:, 2], 1.0 - 1e-9)
    return [replace(p, **dict(zip(FITTED, row, strict=True))) for row in values.tolist()]


def _trials(published: PublishedDirection) -> tuple[int, int]:
    protocol = published.protocol
    return protocol.forward_trials_per_session, protocol.backward_trials_per_session


_Quantity = tuple[str, tuple[str, float, float], FloatArray, bool]
"""Name; the published number as text with the bounds of what prints alike; simulated values; whether it was fitted."""


def _quantities(correct: Counts, published: PublishedDirection) -> list[_Quantity]:
    scores = correct[..., 0] / _trials(published)[0]
    F, (df1, df2) = published.anova.F, published.anova.df
    found: list[_Quantity] = [
        (f"F({df1}, {df2}), correct rates on forward shots", _printed(F), np.asarray(rm_anova(scores).F), False)
    ]
    for claim in published.binomial:
        method, way = published.methods.index(claim.method), DIRECTIONS.index(claim.direction)
        trials, pooled = published.n * _trials(published)[way], correct[..., method, way].sum(axis=-1)
        of_count = np.asarray(binomial_test_p(np.arange(trials + 1), trials))
        name, fitted = f"{claim.method}, {claim.direction} shots", claim.direction == "forward"
        found.append((f"{name}: binomial p", _printed(claim.p), of_count[pooled], fitted))
        for count in (k for k in range(trials + 1) if not fitted and rounds_to(float(of_count[k]), claim.p)):
            alike = (f"{count}, if p = {claim.p} is of it", float(count), float(count))
            found.append((f"{name}: correct of {trials}", alike, pooled.astype(np.float64), fitted))
    return found


def _printed(text: str) -> tuple[str, float, float]:
    half = 0.5 * 10.0 ** -len(text.partition(".")[2])
    return text, float(text) - half, float(text) + half


def place_of(quantity: str, published: tuple[str, float, float], values: FloatArray, fitted: bool) -> PublishedPlace:
    """The place of a published number among simulated values; it is text with the bounds of what prints alike.

    A value that is undefined or infinite (nothing varies within people) counts as above.
    """
    text, low, high = published
    known = np.where(np.isnan(values), np.inf, values)
    below, above = float((known < low).mean()), float((known > high).mean())
    percentile = (below + 1.0 - above) / 2.0
    ci_low, ci_high = wilson_interval(round(percentile * values.size), values.size)
    return PublishedPlace(
        quantity=quantity,
        published=text,
        percentile=percentile,
        ci_low=ci_low,
        ci_high=ci_high,
        outside=2.0 * min(percentile, 1.0 - percentile),
        quantiles=tuple(float(value) for value in np.percentile(known, PERCENTILES, method="inverted_cdf")),
        fitted=fitted,
    )


def _claims(correct: Counts, published: PublishedDirection) -> Iterator[RecurringClaim]:
    held = answers_recur(correct, _trials(published), published)
    fitted = {name: name.startswith("binomial") and " forward" in name for name in held}
    tukey = {name: flags for name, flags in held.items() if " above " in name}
    yield from (_recurs(name, flags, fitted[name]) for name, flags in held.items())
    yield _recurs("Tukey, all pairs as published", np.logical_and.reduce(list(tukey.values())), False)
    stars = np.logical_and.reduce([*tukey.values(), *_not_further(correct, published)])
    yield _recurs("Tukey, all pairs as published and no p below the next printed bound", stars, False)
    yield _recurs(WHOLE_PATTERN, np.logical_and.reduce(list(held.values())), False)


def _not_further(correct: Counts, published: PublishedDirection) -> Iterator[Recurrence]:
    """Of each pair whose bound is not the smallest that the paper prints: is it not below the next smaller one?"""
    bounds = sorted({claim.p_below for claim in published.tukey}, key=float)
    for claim in published.tukey:
        if smaller := bounds[: bounds.index(claim.p_below)]:
            bold = published.model_copy(update={"tukey": [claim.model_copy(update={"p_below": smaller[-1]})]})
            held = recurs(correct[..., 0] / _trials(published)[0], bold)
            yield from (~flags for name, flags in held.items() if " above " in name)


def _recurs(claim: str, held: Recurrence, fitted: bool) -> RecurringClaim:
    found = share_of(claim, int(held.sum()), held.size)
    return RecurringClaim(claim=claim, share=found.share, ci_low=found.ci_low, ci_high=found.ci_high, fitted=fitted)


def _histogram(values: FloatArray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Of whole numbers one bin each, of others so many between the 0.1 and 99.9 percent points."""
    finite = values[np.isfinite(values)]
    if (finite == np.rint(finite)).all():
        edges = np.arange(finite.min() - 0.5, finite.max() + 1.0)
    else:
        low, high = np.percentile(finite, (0.1, 99.9))
        if low == high:  # one study, or all alike
            low, high = low - 0.5, high + 0.5
        edges = np.linspace(low, high, HISTOGRAM_BINS + 1)
    counts, edges = np.histogram(finite, edges)
    return tuple(edges.tolist()), tuple(counts.astype(np.float64).tolist())
