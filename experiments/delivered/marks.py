"""When a shot is marked: what one run's shots of a method say against the model, shot by shot. Pure.

What is measured is taken as a part r of what the model expects, for the peak and for the friction apart. A run has its
own level of r, as its gun, sensor and hand are not the model's: level ~ N(1, between^2), and a shot r ~ N(level, s^2)
with s^2 = within^2 + u^2, u its uncertainty. From the shots so far (those without a mark) the next one is predicted,
with mean m and variance v + s^2; z is its distance from that in standard deviations.

- `outside`: |z| is beyond what one shot in very many is.
- `slipped`: a sequential test (CUSUM; Page 1954) of a lasting change by d = 10 %, either way. With e = d/sqrt(v + s^2)
  the logarithm of the likelihood ratio grows by e z - e^2/2 a shot, is never below 0, and marks at A. Without a change
  the ratio's mean is 1 whatever came before, so at least e^A shots pass on average before a false mark (Lorden 1971).

The marks of all tests together are false less than once in `1 / FALSE_MARKS` shots: that sets A and the limit of z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

from experiments.session.remarks import DeliveryMark

FALSE_MARKS = 1e-4
"""Marks a shot while nothing is wrong, at the most."""
SLIP = 0.10
"""The lasting change that is looked for, of what is expected."""
_TESTS = 4
"""Peak and friction, each up and down."""
_OF_ONE_SHOT = 0.05
"""The part of the false marks that is left to single shots."""
SUM_LIMIT = math.log(_TESTS / FALSE_MARKS / (1 - _OF_ONE_SHOT))
"""A: with e^A shots to a false mark, four tests are false less than so often."""
Z_LIMIT = -NormalDist().inv_cdf(FALSE_MARKS * _OF_ONE_SHOT / _TESTS)
"""Beyond this a single shot is not what the model allows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliverySpread:
    """How far good shots spread, as parts of what is expected: runs from each other, and shots of a run."""

    between: float
    within: float


PEAK_SPREAD = DeliverySpread(between=0.05, within=0.02)
"""Assumed: the model's peak moves by 1 % over grips half and twice as firm; a sensor's scale is known to some 3 %."""
FRICTION_SPREAD = DeliverySpread(between=0.10, within=0.015)
"""Assumed: over such grips the model's step moves by up to 10 %; within a run a hand's firmness changes by a tenth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliveryLevel:
    """What a run's shots of a method came to so far, of one quantity; as parts of what is expected."""

    spread: DeliverySpread
    mean: float = 1.0
    variance: float
    up: float = 0.0
    down: float = 0.0

    @classmethod
    def before(cls, spread: DeliverySpread) -> DeliveryLevel:
        """Before the first shot."""
        return cls(spread=spread, variance=spread.between**2)


def after_shot(level: DeliveryLevel, part: float, part_u: float) -> tuple[DeliveryLevel, DeliveryMark]:
    """The level after a shot, and its mark. `part`, `part_u`: measured over expected, with its uncertainty."""
    shot_variance = level.spread.within**2 + part_u**2
    deviation = math.sqrt(level.variance + shot_variance)
    z, change = (part - level.mean) / deviation, SLIP / deviation
    up = max(0.0, level.up + change * z - change**2 / 2)
    down = max(0.0, level.down - change * z - change**2 / 2)
    if abs(z) > Z_LIMIT or max(up, down) >= SUM_LIMIT:
        mark: DeliveryMark = "outside" if abs(z) > Z_LIMIT else "slipped"
        return replace(level, up=0.0, down=0.0), mark
    gain = level.variance / (level.variance + shot_variance)
    return replace(
        level,
        mean=level.mean + gain * (part - level.mean),
        variance=(1 - gain) * level.variance,
        up=up,
        down=down,
    ), ""


def shots_to_see(part_u: float, spread: DeliverySpread = FRICTION_SPREAD) -> float:
    """How many shots a change by `SLIP` is seen in on average, once a run's level is known: A / (e^2/2)."""
    return SUM_LIMIT / (SLIP**2 / (spread.within**2 + part_u**2) / 2)
