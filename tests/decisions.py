"""Decisions of a diffusion whose parameters are known."""

from __future__ import annotations

from dataclasses import dataclass

import mpmath
import numpy as np
from numpy.typing import ArrayLike

from analysis.times.first_passage import with_slopes
from analysis.times.likelihood import Trials, trials_of
from experiments.design.streams import Stream, generator
from experiments.synthetic.decision import Bools, Floats, crossing_times, decide, upper_probabilities
from experiments.synthetic.diffusion import Decision, Diffusion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Decisions:
    """Answers and times, arrays of one shape."""

    upper: Bools
    time_s: Floats


def decide_all(
    drift: ArrayLike,
    boundary: ArrayLike,
    start: ArrayLike,
    non_decision_s: ArrayLike,
    *,
    generator: np.random.Generator,
    shape: tuple[int, ...] | None = None,
) -> Decisions:
    """One decision each of the broadcast parameters (or of `shape`), without lapses."""
    values = (np.asarray(value, dtype=np.float64) for value in (drift, boundary, start, non_decision_s))
    v, a, w, t0 = (np.array(x) for x in np.broadcast_arrays(*values))
    shape = v.shape if shape is None else shape
    v, a, w, t0 = (np.broadcast_to(x, shape).ravel() for x in (v, a, w, t0))
    upper = uniforms(generator, v.size) < upper_probabilities(v, a, w)
    gap, back = np.where(upper, 1.0 - w, w) * a, np.where(upper, w, 1.0 - w) * a
    time_s = t0 + crossing_times(np.abs(v), gap, back, lambda count: uniforms(generator, count))
    return Decisions(upper=upper.reshape(shape), time_s=time_s.reshape(shape))


def uniforms(generator: np.random.Generator, count: int) -> Floats:
    """Numbers strictly between 0 and 1, as `Stream.uniform` makes them."""
    raw = np.asarray(generator.bit_generator.random_raw(count), dtype=np.uint64)
    return ((raw >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52


METHODS = ("asymmetric-1", "asymmetric-2", "vibration")
DRIFTS = (1.0, 1.8, 0.0)
BOUNDARIES = (1.8, 1.2)
INSTRUCTIONS = ("accuracy", "speed")
START, T0_S = 0.53, 0.35
RANGE_S = (0.3, 3.0)
TRUTH = dict(
    zip(
        (*(f"drift {m}" for m in METHODS), *(f"boundary {i}" for i in INSTRUCTIONS), "start", "non_decision_s"),
        (*DRIFTS, *BOUNDARIES, START, T0_S),
        strict=True,
    )
)


def made(seed: int, *, times: int = 1, people: int = 14, lapse: float = 0.0, spread: float = 0.0) -> Trials:
    """A study of experiment 1's size, or `times` as many trials a person, half of them under each instruction.

    `spread`: SD of each person's factor on the drifts, and of their log boundary, log t0 (half) and logit start.
    """
    draws, n = generator(seed, "recovery", str(times)), people * 60 * times
    order = np.arange(n)
    condition, sign, instruction = order % 3, 1.0 - 2.0 * (order // 3 % 2), order // 6 % 2
    person = order // (60 * times)
    own = spread * draws.standard_normal((4, people))[:, person]
    w = 1.0 / (1.0 + (1.0 - START) / START * np.exp(-own[2]))
    drawn = decide_all(
        np.array(DRIFTS)[condition] * sign * (1.0 + own[0]),
        np.array(BOUNDARIES)[instruction] * np.exp(own[1] / 2.0),
        w,
        T0_S * np.exp(own[3] / 2.0),
        generator=draws,
    )
    lapsed = draws.random(n) < lapse
    return trials_of(
        upper=np.where(lapsed, draws.random(n) < 0.5, drawn.upper),
        time_s=np.where(lapsed, draws.uniform(*RANGE_S, n), drawn.time_s),
        sources=np.full(n, "synthetic"),
        towards_upper=sign > 0,
        condition=np.array(METHODS)[condition],
        instruction=np.array(INSTRUCTIONS)[instruction],
        person=person.astype(np.str_),
    )


def reference(t: float, upper: bool, v: float, a: float, w: float) -> mpmath.mpf:
    """The logarithm of the density by Feller's series of images, with 200 digits and 400 terms."""
    with mpmath.workdps(200):
        t_, v_, a_, w_ = map(mpmath.mpf, (t, v, a, w))
        if upper:
            v_, w_ = -v_, 1 - w_
        tau = t_ / a_**2
        total = mpmath.fsum((w_ + 2 * k) * mpmath.exp(-((w_ + 2 * k) ** 2) / (2 * tau)) for k in range(-200, 200))
        return mpmath.log(total / mpmath.sqrt(2 * mpmath.pi * tau**3) / a_**2) - v_ * a_ * w_ - v_**2 * t_ / 2


def log_density(time_s: ArrayLike, upper: ArrayLike, drift: ArrayLike, boundary: ArrayLike, start: ArrayLike) -> Floats:
    """The same of many, as likelihoods have it: from `with_slopes`."""
    t, up, v, a, w = np.broadcast_arrays(time_s, upper, drift, boundary, start)
    v, near = np.where(up, -v, v), np.where(up, 1.0 - w, w)
    found = with_slopes((t / a**2).ravel(), near.ravel()).value.reshape(t.shape)
    return np.asarray(found - 2.0 * np.log(a) - v * a * near - v * v * t / 2.0)


def law(drift: float, boundary: float, start: float, t0: float = 0.0) -> Diffusion:
    return Diffusion(drift=drift, boundary=boundary, start=start, non_decision_s=t0)


def scalar(diffusion: Diffusion, count: int, seed: int = 1) -> list[Decision]:
    return [decide(diffusion, Stream(seed, "trial", str(i))) for i in range(count)]


EXTREMES = [
    law(0.0, 1.0, 0.5, 0.0),  # no drift, no non-decision time
    law(0.0, 1e6, 0.5),  # huge caution
    law(1e6, 1e6, 0.5),
    law(1e6, 1e-6, 0.5, 1e-9),
    law(-1e6, 1e6, 1e-12),
    law(1e-320, 1.0, 0.5),  # a drift beyond the smallest normal number
    law(1.0, 1e-300, 0.5),
    law(1.0, 1.0, 1e-300),
    law(2.0, 1.0, 1.0 - 1e-16),
    law(1.0, 1.0, 0.0),  # starts at a boundary
    law(1.0, 1.0, 1.0),
]
