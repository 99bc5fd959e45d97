"""When a shot is marked: what one run's shots of a method say against the model, shot by shot. Pure.

What is measured is taken as a part r of what the model expects, for the peak and for the friction apart. A run has its
own level of r, as its gun, sensor and hand are not the model's: level ~ N(1, between^2), and a shot r ~ N(level, s^2)
with s^2 = within^2 + u^2, u its uncertainty. From the shots so far (those without a mark) the next one is predicted,
with mean m and variance v + s^2; z is its distance from that in standard deviations.

- `outside`: |z| is beyond what one shot in very many is.
- `slipped`: a lasting change by d = 10 %, either way, since any shot k. Under each such hypothesis the level is
  reckoned as well, with the shots since k taken back by d, and the likelihood of all shots is set against that without
  a change. The sum of these ratios over k (Shiryaev and Roberts; Pollak 1985) grows by 1 a shot on average while
  nothing has changed, so at least e^A shots pass on average until it is e^A, which marks. As long as a change lasts,
  its shots are marked; they teach nothing, and the level is that of the hypothesis.
- `slipped`, too: the friction beside the peak, which knows no scale of the sensor, is not what the model says from a
  method's first shot on. That mean is looked at after 10 shots, and whenever they have doubled, and is said once.

The friction goes with the sensor's scale, in a firm hand two and a half times (`device.sensor.turn`). What the peaks
are beside the model's is taken for that scale: the first ones for a run's level, all so far for a method's mean.

The marks of all tests together are false less than once in `1 / FALSE_MARKS` shots: that sets A and the limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from experiments.session.remarks import DeliveryMark

if TYPE_CHECKING:
    from device.physics.hand import Vector
    from device.sensor.turn import MeasuredFriction

FALSE_MARKS = 1e-4
"""Marks a shot while nothing is wrong, at the most."""
SLIP = 0.10
"""The lasting change that is looked for, of what is expected."""
_OF_ONE_SHOT, _OF_START = 0.05, 0.25
"""The parts of the false marks that are left to single shots, and to a method's mean against the model."""
_MARKS = 3
"""A change that is none, but seems to be one, leaves so many marks at the most on average (by trial)."""
SUM_LIMIT = math.log(2 * _MARKS / FALSE_MARKS / (1 - _OF_ONE_SHOT - _OF_START))
"""A: with e^A shots to a change that is none, peak and friction are marked falsely less than so often."""
Z_LIMIT = -NormalDist().inv_cdf(FALSE_MARKS * _OF_ONE_SHOT / 4)
"""Beyond this a single shot is not what the model allows: peak and friction, each up and down."""
SCALE_SHOTS = 4
"""So many peaks tell the scale of the sensor; a friction is not learnt from before, as it goes with the scale."""
START_SHOTS = 10
"""After so many shots a method's mean is first held against the model."""
MODEL_SPREAD, MODEL_SPREAD_N = 0.02, 0.008
"""Assumed, of friction beside the peak, as a part and in N: with hands that differ by a quarter the model's goes by
1.4 % (SD) where friction is much, and by 0.007 N where it is little."""
_FEW = 3
"""Of so few shots a level is not sure: none is taken for a change, and it is learnt anew if more than taught it lie
outside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliverySpread:
    """How far good shots spread, as parts of what is expected: runs from each other, and shots of a run."""

    between: float
    within: float


PEAK_SPREAD = DeliverySpread(between=0.05, within=0.015)
"""Assumed: the model's peak moves by 1 % over grips half and twice as firm; a sensor's scale is known to some 3 %."""
FRICTION_SPREAD = DeliverySpread(between=0.10, within=0.010)
"""Assumed: by the model, grips that scatter by a tenth move it by 0.3 %, and people by 1.4 % beside their peak."""


def _none() -> Vector:
    return np.empty(0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DeliveryLevel:
    """What a run's shots of a method came to so far, of one quantity; as parts of what is expected.

    `taught`: by so many shots; `outside`: so many lay outside since. For each shot since which there may have been a
    change up: how far the level then lies from `mean`, and the logarithms of the likelihood ratios of a change up, and
    of one down, where that lies on the other side.
    """

    spread: DeliverySpread
    mean: float = 1.0
    variance: float
    taught: int = 0
    outside: int = 0
    offsets: Vector = field(default_factory=_none)
    ups: Vector = field(default_factory=_none)
    downs: Vector = field(default_factory=_none)

    @classmethod
    def before(cls, spread: DeliverySpread) -> DeliveryLevel:
        """Before the first shot."""
        return cls(spread=spread, variance=spread.between**2)


def after_shot(level: DeliveryLevel, part: float, part_u: float) -> tuple[DeliveryLevel, DeliveryMark]:
    """The level after a shot, and its mark. `part`, `part_u`: measured over expected, with its uncertainty."""
    variance, off = level.variance + level.spread.within**2 + part_u**2, part - level.mean
    if abs(off) > Z_LIMIT * math.sqrt(variance):
        outside = replace(level, outside=level.outside + 1)
        return (DeliveryLevel.before(level.spread) if level.taught < outside.outside <= _FEW else outside), "outside"
    since_now = [0.0] if level.taught >= _FEW else []
    shifts = SLIP + np.append(level.offsets, since_now)
    ups = np.append(level.ups, since_now) + (off * shifts - shifts**2 / 2) / variance
    downs = np.append(level.downs, since_now) + (-off * shifts - shifts**2 / 2) / variance
    if np.logaddexp.reduce(np.concatenate([ups, downs])) - math.log(2) >= SUM_LIMIT:
        return _slipped(level, shifts - SLIP, ups, downs), "slipped"
    gain = level.variance / variance
    return replace(
        level,
        mean=level.mean + gain * off,
        variance=(1 - gain) * level.variance,
        taught=level.taught + 1,
        outside=0,
        offsets=shifts - SLIP - gain * shifts,
        ups=ups,
        downs=downs,
    ), ""


def _slipped(level: DeliveryLevel, offsets: Vector, ups: Vector, downs: Vector) -> DeliveryLevel:
    """The level by the likeliest change, which is the one that is left; a shot without it takes its mark away."""
    up = ups.max() >= downs.max()
    k = int((ups if up else downs).argmax())
    mean = level.mean + (offsets[k] if up else -offsets[k])
    full, none = np.array([SUM_LIMIT + math.log(2)]), np.array([-math.inf])
    return replace(level, mean=float(mean), offsets=np.zeros(1), ups=full if up else none, downs=none if up else full)


@dataclass(frozen=True, slots=True, kw_only=True)
class StartLevel:
    """The mean of friction beside the peak since a method's first shot, and its weight; `said`: it was marked."""

    shots: int = 0
    mean: float = 1.0
    weight: float = 0.0
    said: bool = False


def after_start(level: StartLevel, part: float, part_u: float, model_u: float) -> tuple[StartLevel, DeliveryMark]:
    """The mean with one more shot, and its mark. `part`: friction beside the peak, as a part of what is expected.

    `model_u`: to what that is known, in every hand.
    """
    one, shots = 1 / (FRICTION_SPREAD.within**2 + part_u**2), level.shots + 1
    weight = level.weight + one
    mean = level.mean + (part - level.mean) * one / weight
    looks = not level.said and shots % START_SHOTS == 0 and (shots // START_SHOTS).bit_count() == 1
    far = looks and abs(mean - 1) > start_limit(shots) * math.hypot(model_u, weight**-0.5)
    return StartLevel(shots=shots, mean=mean, weight=weight, said=level.said or far), "slipped" if far else ""


def start_limit(shots: int) -> float:
    """So many standard deviations off, a mean after so many shots is marked: as they double, so does its share."""
    return -NormalDist().inv_cdf(FALSE_MARKS * _OF_START * shots / 4)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotParts:
    """A shot as parts of what is expected, with uncertainties; friction is `None` where it is not known.

    `usual_N`: the friction that is expected.
    """

    peak: float
    peak_u: float
    friction: MeasuredFriction | None = None
    usual_N: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodLevels:
    """What a run's shots of a method came to so far. `scale`: the sensor's, by the first of so many `peaks`."""

    peak: DeliveryLevel = field(default_factory=lambda: DeliveryLevel.before(PEAK_SPREAD))
    friction: DeliveryLevel = field(default_factory=lambda: DeliveryLevel.before(FRICTION_SPREAD))
    start: StartLevel = StartLevel()
    scale: float = 1.0
    peaks: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotVerdict:
    """A mark, of what, and how far that is from what it is held against, as a part. Empty where there is none."""

    mark: DeliveryMark = ""
    quantity: str = ""
    change: float = 0.0


def judged_shot(levels: MethodLevels, shot: ShotParts) -> tuple[MethodLevels, ShotVerdict]:
    """The levels after a shot, and what is said of it: of the peak before the friction, of this before the mean."""
    peak, mark = after_shot(levels.peak, shot.peak, shot.peak_u)
    found = ShotVerdict(mark=mark, quantity="peak", change=shot.peak / levels.peak.mean - 1)
    scale = peak.mean if levels.peaks < SCALE_SHOTS else levels.scale
    levels = replace(levels, peak=peak, scale=scale, peaks=levels.peaks + 1)
    if shot.friction is None:
        return levels, found if found.mark else ShotVerdict()
    return _judged_friction(levels, shot, shot.friction, found)


def _judged_friction(
    levels: MethodLevels, shot: ShotParts, seen: MeasuredFriction, peak: ShotVerdict
) -> tuple[MethodLevels, ShotVerdict]:
    """A friction is held against its level from the first shot on, but it is learnt only once the scale is known."""
    known = levels.peaks > SCALE_SHOTS
    so_far = [of_N / shot.usual_N for of_N in seen.at_scale(levels.peak.mean, math.sqrt(levels.peak.variance))]
    part, part_u = [of_N / shot.usual_N for of_N in seen.at_scale(levels.scale)] if known else so_far
    friction, mark = after_shot(levels.friction, part, part_u)
    found = [peak, ShotVerdict(mark=mark, quantity="friction", change=part / levels.friction.mean - 1)]
    levels = replace(levels, friction=friction if known else levels.friction)
    if not any(one.mark for one in found):
        model_u = math.hypot(MODEL_SPREAD, MODEL_SPREAD_N / shot.usual_N)
        start, mark = after_start(levels.start, so_far[0], so_far[1], model_u)
        found.append(ShotVerdict(mark=mark, quantity="friction beside the peak", change=start.mean - 1))
        levels = replace(levels, start=start)
    return levels, next((one for one in found if one.mark), ShotVerdict())


def shots_to_see(part_u: float) -> float:
    """How many shots a change by `SLIP` is seen in on average, once a run's level is known: A / (e^2/2)."""
    return SUM_LIMIT / (SLIP**2 / (FRICTION_SPREAD.within**2 + part_u**2) / 2)
