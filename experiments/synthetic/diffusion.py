"""The simple drift-diffusion of a two-alternative choice: its numbers, and what people make of them.

    dX = v dt + dW,  X(0) = z = w a,  answered when X meets a ("upper") or 0 ("lower"),  time = t0 + first passage

with s = 1, so that X and the boundary a are in sqrt(s) and the drift v in 1/sqrt(s). How it is drawn: `decision`.
Source: Ratcliff 1978, Psychol. Rev. 85, 59.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from experiments.design.streams import Stream

_LARGEST = 1e6
"""Drift and boundary above this are refused: nobody is that cautious, and squares stay far from overflow."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lapses:
    """Answers that are not decided: a fair coin after a time uniform from `earliest_s` to `latest_s`.

    Source: Ratcliff & Tuerlinckx 2002, Psychon. Bull. Rev. 9, 438 (uniform contaminants); the range is assumed.
    """

    rate: float = 0.0
    earliest_s: float = 0.2
    latest_s: float = 3.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.rate <= 1.0:
            raise ValueError(f"lapse rate is {self.rate}; it must be 0 to 1")
        if not 0.0 <= self.earliest_s < self.latest_s <= 3_600.0:
            raise ValueError(f"lapses last {self.earliest_s} to {self.latest_s} s; 0 <= earliest < latest <= 3600")


@dataclass(frozen=True, slots=True, kw_only=True)
class Diffusion:
    """One decision's parameters. `start` is z / a, 0 to 1; at 0 or 1 the answer is given at once."""

    drift: float  # v, 1/sqrt(s), towards the upper boundary
    boundary: float  # a, sqrt(s): the caution
    start: float = 0.5  # w = z / a: above 0.5 leans towards the upper answer
    non_decision_s: float = 0.3  # t0
    lapses: Lapses = Lapses()

    def __post_init__(self) -> None:
        if not abs(self.drift) <= _LARGEST:
            raise ValueError(f"drift is {self.drift}; it must be within {_LARGEST:g} 1/sqrt(s)")
        if not 0.0 < self.boundary <= _LARGEST:
            raise ValueError(f"boundary is {self.boundary}; it must be above 0 and at most {_LARGEST:g} sqrt(s)")
        if not 0.0 <= self.start <= 1.0:
            raise ValueError(f"start is {self.start}; it must be 0 to 1")
        if not 0.0 <= self.non_decision_s <= 3_600.0:
            raise ValueError(f"non_decision_s is {self.non_decision_s}; it must be 0 to 3600")


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """One answer and the time from the stimulus to it."""

    upper: bool
    time_s: float
    lapse: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class People:
    """How people differ from the mean person; 0 for not at all. All assumed: the paper gives no spread."""

    drift_factor_sd: float = 0.0  # of the factor on every drift, normal around 1
    log_boundary_sd: float = 0.0
    log_non_decision_sd: float = 0.0
    logit_start_sd: float = 0.0

    def __post_init__(self) -> None:
        for name in ("drift_factor_sd", "log_boundary_sd", "log_non_decision_sd", "logit_start_sd"):
            if not 0.0 <= getattr(self, name) <= 5.0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 to 5")


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """What one person makes of the mean person's parameters."""

    drift_factor: float
    boundary_factor: float
    non_decision_factor: float
    logit_start: float

    def own(self, mean: Diffusion) -> Diffusion:
        """The person's own diffusion; the median person is the mean one."""
        start = mean.start
        if 0.0 < start < 1.0:
            start = 1.0 / (1.0 + (1.0 - start) / start * math.exp(-self.logit_start))
        return Diffusion(
            drift=mean.drift * self.drift_factor,
            boundary=mean.boundary * self.boundary_factor,
            start=start,
            non_decision_s=mean.non_decision_s * self.non_decision_factor,
            lapses=mean.lapses,
        )


def person(people: People, draws: Stream) -> Person:
    """Somebody, drawn once. The four draws are always made, so one spread's change moves no other value."""
    drift, boundary, non_decision, start = (draws.normal() for _ in range(4))
    return Person(
        drift_factor=1.0 + people.drift_factor_sd * drift,
        boundary_factor=math.exp(people.log_boundary_sd * boundary),
        non_decision_factor=math.exp(people.log_non_decision_sd * non_decision),
        logit_start=people.logit_start_sd * start,
    )
