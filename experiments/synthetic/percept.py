"""From the force on the hand to what it says of the direction: a percept of few parameters.

    x(t) = 1/leak int F(s) exp(-(t - s)/leak) ds        leaky integration of the force, in N; a blow J adds J/leak
    first, reaction: largest x and -x until the magnet turns or lands; second: largest x after that
    S = first^n - reaction^n                            Stevens' power law: the sharp pulse against the long weak ones
    evidence = sensitivity S / (1 + confusion (second / first)^n)

The hand's force sums to nothing over a shot (no outside force), so what says a direction is the non-linearity: the leak
lets a pulse grow that the slow reaction does not reach, the exponent makes more of the difference. The collision of
the returning magnet is a second pulse; by equation (1) it points the same way as the recoil, yet the paper holds that
it "could distort the perceived direction", so it counts as confusion that divides the evidence, without a sign.
A vibration has no force that is published and no direction that could be felt: its evidence is 0.
The evidence is the log odds of a right answer by an unbiased diffusion: drift times boundary. All of this is a model's
guess: only `exponent` has a source, three numbers are fitted to three rates (`recoil fit percept`), the rest is
assumed.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from device.methods import Method
from device.parameters import GunParameters
from experiments.config.door import InnerShare, Model
from experiments.synthetic.diffusion import Diffusion, Lapses

if TYPE_CHECKING:
    from device.physics import ShotSummary, ShotTrace


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptParameters:
    """The percept's numbers. `ValueError` names a value that is not finite or below its bound."""

    exponent: float = 1.7  # n; Stevens 1975, Psychophysics, p. 15: muscle force (1.1: static force on the palm's skin)
    leak_s: float = 0.02  # assumed: between the pulse (9 ms) and the reaction (50 to 150 ms)
    sensitivity: float = 0.213  # log odds per N^n, fitted to the paper's forward rates
    confusion: float = 2.44  # fitted
    start: float = 0.557  # w of the diffusion towards "forward", fitted: the vibration's forward rate

    def __post_init__(self) -> None:
        for name in ("exponent", "leak_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be a finite number above 0")
        for name in ("sensitivity", "confusion"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be a finite number of at least 0")
        if not 0.0 < self.start < 1.0:
            raise ValueError(f"start is {self.start}; it must lie strictly between 0 and 1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Percept:
    """The three intensities of a shot, leaky means of the force in N, at least 0."""

    first: float
    reaction: float
    second: float


SAME_S = 1e-9  # a shot's times and its course come from two runs of the model, compiled or not

SILENT = Percept(first=0.0, reaction=0.0, second=0.0)
"""What a vibration gives."""


def leaky_mean(x: float, before_N: float, after_N: float, step_s: float, leak_s: float) -> float:
    """The leaky mean that was `x`, after a step (not none) over which the force went evenly from one to the other."""
    slope, fall = (after_N - before_N) / step_s, -math.expm1(-step_s / leak_s)
    return x + (before_N - x) * fall + slope * (step_s - leak_s * fall)


def felt_course(time_s: list[float], force_N: list[float], leak_s: float) -> list[float]:
    """The leaky mean x at each time, exact for a force that is linear in between; 0 at the first time."""
    x, course = 0.0, [0.0]
    for i in range(1, len(time_s)):
        step_s = time_s[i] - time_s[i - 1]
        if step_s > 0.0:
            x = leaky_mean(x, force_N[i - 1], force_N[i], step_s, leak_s)
        course.append(x)
    return course


def percept_of_trace(trace: ShotTrace, magnet_mass_kg: float, leak_s: float) -> Percept:
    """The percept of a shot's full course; the collision is a blow of m v at the landing, far shorter than the leak."""
    return percept_of_course(trace.time_s.tolist(), trace.force_N.tolist(), trace.summary, magnet_mass_kg, leak_s)


def percept_of_course(
    times: list[float], force_N: list[float], shot: ShotSummary, magnet_mass_kg: float, leak_s: float
) -> Percept:
    """As `percept_of_trace`, of the force at any times; a time that comes twice is a jump of the force."""
    course = felt_course(times, force_N, leak_s)
    parts = [shot.firing_end_s, shot.reset_end_s]
    border_s = min((part for part in parts if part is not None), default=math.inf)
    cut = bisect_right(times, border_s + SAME_S)
    early, late = course[:cut], course[cut:]
    if shot.reset_end_s is not None and shot.impact_speed_m_s is not None:
        before = max(0, bisect_right(times, shot.reset_end_s + SAME_S) - 1)
        late.append(course[before] + magnet_mass_kg * shot.impact_speed_m_s / leak_s)
    reaction = -min([*early, *late])
    return Percept(first=max(0.0, *early), reaction=max(0.0, reaction), second=max([0.0, *late]))


def percept_of_summary(shot: ShotSummary, magnet_mass_kg: float, leak_s: float) -> Percept:
    """The percept from the summary alone: rectangles of the stages' impulses, and the collision's blow.

    For the paper's two shots and the default leak `first` is within 2 % of the full course's and `reaction` within 8 %;
    `second` leaves out the coil's braking before the landing, so it is too small where a shorted coil brakes.
    A shot without a stage of bullet firing gives `SILENT`.
    """
    if shot.recoil_impulse_Ns is None or not shot.recoil_end_s or shot.firing_end_s is None:
        return SILENT
    pulse_s, firing_s = shot.recoil_end_s, shot.firing_end_s - shot.recoil_end_s
    first = shot.recoil_impulse_Ns / pulse_s * -math.expm1(-pulse_s / leak_s)
    if firing_s <= 0.0:  # the magnet turned while the coil still pushed: the rectangles have nothing to say
        return SILENT
    pull = shot.recoil_impulse_Ns / firing_s * -math.expm1(-firing_s / leak_s)
    blow = magnet_mass_kg * (shot.impact_speed_m_s or 0.0) / leak_s
    reaction = max(0.0, pull - first * math.exp(-firing_s / leak_s))
    return Percept(first=first, reaction=reaction, second=blow)


@lru_cache(maxsize=512)
def percept_of(method: Method, leak_s: float) -> Percept:
    """The percept of a method's shot by the full model; `SILENT` for a vibration, and a shot that is given up."""
    if not isinstance(method, GunParameters) or (shot := _trace(method)).given_up_s is not None:
        return SILENT
    return percept_of_trace(shot, method.magnet_mass_kg, leak_s)


@lru_cache(maxsize=64)
def _trace(gun: GunParameters) -> ShotTrace:
    from device.physics import trace  # noqa: PLC0415 - the heavy import waits until the physics is used

    return trace(gun)


def evidence(percept: Percept, parameters: PerceptParameters) -> float:
    """The evidence of a forward shot: log odds of "forward" without bias; a backward shot gives its negative."""
    n = parameters.exponent
    first, reaction, second = (math.pow(x, n) for x in (percept.first, percept.reaction, percept.second))
    strongest = max(first, reaction)
    if strongest == 0.0:
        return 0.0
    return parameters.sensitivity * (first - reaction) * (strongest / (strongest + parameters.confusion * second))


def diffusion_of(
    log_odds: float, parameters: PerceptParameters, *, boundary: float, non_decision_s: float, lapses: Lapses
) -> Diffusion:
    """The diffusion of a shot of this evidence (negative for a backward one); "upper" is "forward"."""
    return Diffusion(
        drift=log_odds / boundary,
        boundary=boundary,
        start=parameters.start,
        non_decision_s=non_decision_s,
        lapses=lapses,
    )


def percepts_of(methods: Mapping[str, Method], leak_s: float) -> dict[str, Percept]:
    """The percept of each method."""
    return {name: percept_of(method, leak_s) for name, method in methods.items()}


_DEFAULT = PerceptParameters()


class PerceptConfig(Model):
    """The numbers of `experiments.synthetic.percept`, where each has its source; those defaults."""

    exponent: Annotated[float, Field(gt=0, le=10)] = _DEFAULT.exponent
    leak_s: Annotated[float, Field(gt=0, le=10)] = _DEFAULT.leak_s
    sensitivity: Annotated[float, Field(ge=0, le=1e6)] = _DEFAULT.sensitivity
    confusion: Annotated[float, Field(ge=0, le=1e6)] = _DEFAULT.confusion
    start: InnerShare = _DEFAULT.start

    @property
    def own(self) -> PerceptParameters:
        """The percept's own type."""
        return PerceptParameters(**self.model_dump())
