"""What the percept is fitted to, checked at the door: rates, trials, methods and people."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from analysis.paper.paper import PublishedDirection, load_paper
from analysis.predict.fit.percept_model import FITTED, PAPER_TRIALS
from device.methods import Method
from experiments.config.door import ConfigError
from experiments.load import find, load_gun
from experiments.synthetic.diffusion import People

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
    studies: int = 10_000
    seed: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptTask:
    """A request with all that it names: forward rates, the trials behind each, methods, people, and what is published.

    `source` says in words where the rates come from; without a paper there is nothing to judge by.
    """

    source: str
    rates: Mapping[str, float]
    trials: int
    methods: Mapping[str, Method]
    people: People
    published: PublishedDirection | None


def read_request(request: PerceptRequest) -> PerceptTask:
    """The task of a request. `ConfigError`: rates, trials, a paper or a gun that cannot be used."""
    if not 0.0 <= request.spread <= _LARGEST_SPREAD:
        raise ConfigError(f"--spread {request.spread:g}: must be a factor from 0 (people alike) to {_LARGEST_SPREAD:g}")
    if request.rates is not None:
        published, source = None, "the given rates"
        rates, trials = given_rates(request.rates), PAPER_TRIALS if request.trials is None else request.trials
    else:
        published, source = _published(request), "the published rates"
        rates, trials = published_rates(published)
    if len(rates) < len(FITTED):
        option = f"--rates {request.rates}" if request.rates is not None else str(find(request.paper))
        raise ConfigError(f"{option}: {len(rates)} rates; three numbers are fitted, so there must be at least 3")
    return PerceptTask(
        source=source,
        rates=rates,
        trials=trials,
        methods=_methods(request.gun, rates),
        people=scaled_spread(ASSUMED_SPREAD, request.spread),
        published=published,
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


def scaled_spread(people: People, factor: float) -> People:
    """People who differ so many times as much."""
    return People(
        drift_factor_sd=factor * people.drift_factor_sd,
        log_boundary_sd=factor * people.log_boundary_sd,
        log_non_decision_sd=factor * people.log_non_decision_sd,
        logit_start_sd=factor * people.logit_start_sd,
    )


def _published(request: PerceptRequest) -> PublishedDirection:
    if request.trials is not None:
        raise ConfigError(f"--trials {request.trials}: the paper has its own; give the option with --rates alone")
    path = find(request.paper)
    published = load_paper(path).direction
    missing = [name for name in published.methods if name not in published.means]
    if missing:
        raise ConfigError(f"{path}: direction.means has no rate of {', '.join(missing)}; give one for each method")
    return published


def _methods(gun: str, rates: Mapping[str, float]) -> dict[str, Method]:
    path = find(gun)
    config = load_gun(path)
    strangers = [name for name in rates if name not in config.methods]
    if strangers:
        raise ConfigError(
            f"{path}: there is a rate of {', '.join(strangers)}, but no such method; there are "
            f"{', '.join(config.methods)}"
        )
    return config.renderings(tuple(rates))
