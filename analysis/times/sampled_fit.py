"""The diffusion model's maximum-likelihood fits of a log, with bounded work however many people there are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.times.fit import DiffusionFit, fit
from analysis.times.likelihood import Trials, trials_of
from analysis.times.own_trials import OwnTrials
from analysis.times.people import PeopleFit, fit_people

MOST_PEOPLE = 40
MOST_TRIALS = 20_000
FEWEST_TRIALS = 10
"""Fewer trials than this are not fitted (assumed): there are about as many parameters."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledFit:
    """Person by person, and all trials together, of `fitted` of the `people`; no fits, but a reason, if too few."""

    people: int
    fitted: int
    trials: int
    each: PeopleFit | None
    together: DiffusionFit | None
    reason: str | None = None


def sampled_fit(own: OwnTrials) -> SampledFit:
    """Both fits: of everybody, or of people evenly spaced in the order of their codes, at most 40 and 20,000 trials.

    A person's fit takes about 10 ms and grows with their trials, so all takes half a second. "Upper" is
    the answer "forward".
    """
    codes = np.unique(own.person)
    share = MOST_TRIALS / max(own.time_s.size, 1)
    count = max(1, min(codes.size, MOST_PEOPLE, int(share * codes.size)))
    chosen = codes[np.round(np.linspace(0.0, codes.size - 1, count)).astype(np.intp)] if codes.size else codes
    some = own.of(np.isin(own.person, chosen)) if count < codes.size else own
    n = some.time_s.size
    if n < FEWEST_TRIALS:
        reason = f"{n} trials with a time of the answerer's own; the fit needs at least {FEWEST_TRIALS}"
        return SampledFit(people=codes.size, fitted=0, trials=n, each=None, together=None, reason=reason)
    trials = as_trials(some)
    together = fit(trials, by_person=count > 1)
    each = fit_people(trials, together=together)
    return SampledFit(people=codes.size, fitted=count, trials=n, each=each, together=together)


def as_trials(own: OwnTrials) -> Trials:
    """The trials as the fit takes them."""
    return trials_of(
        upper=own.forward == (own.correct == 1.0),
        time_s=own.time_s,
        sources=own.source,
        towards_upper=own.forward,
        condition=np.array(own.methods)[own.method],
        instruction=np.array(own.instructions)[own.instruction],
        person=np.array(own.people)[own.person],
    )
