"""What is felt of many shots, each over its full course: in one pass over its segments, in machine code or interpreted.

What stands here for the compiler is written as all of `device.physics`: numbers in records, which either a class or an
array of numbers holds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np

from device.parameters import GunParameters
from device.physics import ShotSummary
from device.physics.batch import array_kind, call, compiled, no_compiler
from device.physics.equations import (
    BREAK_AWAY,
    COIL,
    FREE,
    MAX_SEGMENTS,
    MAX_WORK,
    SETTLED,
    Constants,
    ShotState,
    StepSeries,
    force_on_hand,
    friction,
    pack,
    spring_force,
)
from device.physics.polynomial import value_at
from device.physics.segments import advance, enter, free_position, half_of, pulse_on
from device.physics.shot import goes_on, rest_at_stop
from device.physics.traces import FARTHEST_IN_TRACE
from experiments.synthetic.percept import SAME_S, Percept, leaky_mean

COIL_POINTS, FREE_POINTS = 8, 32
"""Points of the force in each stretch of a shot, within and outside the coil.

With four times as many the predicted rates change by less than 0.0005 (`tests/test_design_shots.py`).
"""


@dataclass(slots=True)
class Feeling:
    """The leaky mean of the force on the hand, as far as a shot has come, and the farthest that it went."""

    leak_s: float
    recoil_until_s: float  # the end of what the first intensity is of
    landing_s: float
    time_s: float = 0.0
    force_N: float = 0.0
    mean_N: float = 0.0
    first_N: float = 0.0  # the most until the recoil ends
    least_N: float = 0.0
    late_N: float = 0.0  # the most after it
    landing_N: float = 0.0  # as the magnet lands


def feel(p: Constants, s: ShotState, w: StepSeries, felt: Sequence[Feeling], points: tuple[int, int]) -> None:
    """One shot from rest, felt under each leak. No point falls between two segments: the force jumps."""
    rest_at_stop(s)
    s.heading, s.farthest, w.work = 0.0, FARTHEST_IN_TRACE, 0
    pulse_on(p, s)
    enter(p, s, BREAK_AWAY)
    for _ in range(MAX_SEGMENTS):
        start_s, x, v = s.time, s.x, s.v
        event = advance(p, s, w)
        if s.kind == COIL:
            feel_in_coil(p, s, w, felt, (start_s, points[0]))
        elif s.kind == FREE:
            feel_free(p, s, felt, (start_s, x, v), points[1])
        else:
            feel_at(felt, start_s, 0.0)
            if event != SETTLED:
                feel_at(felt, s.time, 0.0)
        w.work += 1
        if w.work > MAX_WORK or not goes_on(p, s, event):
            break


def feel_in_coil(p: Constants, s: ShotState, w: StepSeries, felt: Sequence[Feeling], way: tuple[float, int]) -> None:
    """A step in the coil from its start on, in so many even parts."""
    start_s, points = way
    for n in range(points + 1):
        time_s = start_s + (s.time - start_s) * n / points
        place = (time_s - start_s) / s.span if s.span > 0.0 else 0.0  # a step may be too short for a number
        feel_at(felt, time_s, force_on_hand(p, s.heading, value_at(w.x, place), value_at(w.i, place)))


def feel_free(
    p: Constants, s: ShotState, felt: Sequence[Feeling], start: tuple[float, float, float], points: int
) -> None:
    """A free arc from its start (time, position, speed), at both its ends and evenly in it."""
    start_s, x, v = start
    omega, held_N = math.sqrt(p.stiffness / p.mass), friction(p, s.heading)
    a = (held_N - spring_force(p, x)) / p.mass
    for n in range(points + 1):
        time_s = start_s + (s.time - start_s) * n / points
        now = free_position(omega, half_of(omega, time_s - start_s), x, v, a)
        feel_at(felt, time_s, held_N - spring_force(p, now))


def feel_at(felt: Sequence[Feeling], time_s: float, force_N: float) -> None:
    """On to a time and the force at it; a time that comes twice is a jump of the force."""
    for k in range(len(felt)):
        feel_on(felt[k], time_s, force_N)


def feel_on(one: Feeling, time_s: float, force_N: float) -> None:
    """The same, under one leak."""
    if time_s > one.time_s:
        one.mean_N = leaky_mean(one.mean_N, one.force_N, force_N, time_s - one.time_s, one.leak_s)
    one.time_s, one.force_N = time_s, force_N
    if time_s <= one.recoil_until_s:
        one.first_N = max(one.first_N, one.mean_N)
    else:
        one.late_N = max(one.late_N, one.mean_N)
    one.least_N = min(one.least_N, one.mean_N)
    if time_s <= one.landing_s:
        one.landing_N = one.mean_N


def feel_each(guns: Any, felt: Any, states: Any, series: Any, points: Any) -> None:
    """Each gun's shot, felt under each leak."""
    for n in range(len(guns)):
        feel(guns[n], states[0], series[0], felt[n], points)


def percepts_of_shots(
    guns: Sequence[GunParameters],
    summaries: Sequence[ShotSummary],
    leaks_s: Sequence[float],
    points: tuple[int, int] = (COIL_POINTS, FREE_POINTS),
) -> list[tuple[Percept, ...]]:
    """The percepts of the full courses of shots that come home, under each leak."""
    felt = [[_nothing_yet(summary, leak_s) for leak_s in leaks_s] for summary in summaries]
    if guns and leaks_s:
        felt = _felt(list(map(pack, guns)), felt, points)
    return [
        tuple(_percept(one, gun.magnet_mass_kg, summary) for one in some)
        for gun, summary, some in zip(guns, summaries, felt, strict=True)
    ]


def _nothing_yet(shot: ShotSummary, leak_s: float) -> Feeling:
    ends = (end_s for end_s in (shot.firing_end_s, shot.reset_end_s) if end_s is not None)
    landing_s = math.inf if shot.reset_end_s is None else shot.reset_end_s
    return Feeling(leak_s, min(ends, default=math.inf) + SAME_S, landing_s + SAME_S)


def _felt(guns: list[Constants], felt: list[list[Feeling]], points: tuple[int, int]) -> list[list[Feeling]]:
    if no_compiler():
        feel_each(guns, felt, [ShotState()], [StepSeries()], points)
        return felt
    gun, feeling, state, series = _records()
    found = np.array([list(map(astuple, some)) for some in felt], feeling)
    code = compiled(cast("Any", feel_each))
    call(code, np.array(guns, gun), found, np.empty(1, state), np.empty(1, series), points)
    return [[Feeling(*one) for one in some] for some in found.tolist()]


@lru_cache(maxsize=1)
def _records() -> tuple[np.dtype[Any], ...]:
    return tuple(map(array_kind, (Constants, Feeling, ShotState, StepSeries)))


def _percept(felt: Feeling, magnet_mass_kg: float, shot: ShotSummary) -> Percept:
    """As `percept_of_course`: the collision is a blow of m v at the landing."""
    second_N = felt.late_N
    if shot.reset_end_s is not None and shot.impact_speed_m_s is not None:
        second_N = max(second_N, felt.landing_N + magnet_mass_kg * shot.impact_speed_m_s / felt.leak_s)
    return Percept(first=felt.first_N, reaction=-felt.least_N, second=second_N)
