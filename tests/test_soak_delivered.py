"""Was it delivered? How often a good shot is marked, and how soon a damper that slips by a tenth is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from experiments.delivered.marks import FRICTION_SPREAD, PEAK_SPREAD, SUM_LIMIT
from tests.delivered_chain import DAMPED, Parts, course, marks_of, measured_shot, parts_of, people, slipped

pytestmark = pytest.mark.soak

RUNS, SHOTS, GOOD = 1_000, 60, 10
PEOPLE, GRIPS = 20, 8


@pytest.fixture(scope="module")
def courses() -> dict[float, list[list[np.ndarray]]]:
    """By how far the damper slipped: of each person several grips."""
    hands = people(PEOPLE, GRIPS, np.random.default_rng(1))
    return {
        part: [[course(slipped(DAMPED, part), hand) for hand in one] for one in hands] for part in (0.0, 0.05, 0.1, 0.2)
    }


def run_of(courses: dict[float, list[list[np.ndarray]]], slips: list[float], random: np.random.Generator) -> list[str]:
    """The marks of one person's run, whose damper has slipped by so much at each shot."""
    who = random.integers(PEOPLE)
    grips = random.integers(GRIPS, size=len(slips))
    shots = (courses[slip][who][grip] for slip, grip in zip(slips, grips, strict=True))
    return marks_of([parts_of(measured_shot(one, random)) for one in shots])


def test_a_good_shot_is_marked_less_than_once_in_10000_through_the_whole_chain(courses: Any, soak: Any) -> None:
    random = np.random.default_rng(2)
    marks = sum(sum(map(bool, run_of(courses, [0.0] * SHOTS, random))) for _ in range(RUNS))
    how = f"{RUNS * SHOTS:,} shots of {PEOPLE} people by the physics, grips SD 10 % within and 25 % between, 0.1 m/s²"
    soak("false marks a shot, by physics and noise", f"{marks / RUNS / SHOTS:.1e}", "< 1e-4", f"{marks} in {how}")
    assert marks / RUNS / SHOTS < 1e-4


def test_the_derived_rate_holds_where_shots_spread_as_assumed(soak: Any) -> None:
    random, runs, u = np.random.default_rng(3), 6_000, 0.01
    marks = 0
    for _ in range(runs):
        levels = [1 + one.between * random.standard_normal() for one in (PEAK_SPREAD, FRICTION_SPREAD)]
        spreads = [np.hypot(one.within, u) for one in (PEAK_SPREAD, FRICTION_SPREAD)]
        values = levels + spreads * random.standard_normal((SHOTS, 2))
        marks += sum(map(bool, marks_of([Parts(peak=(peak, u), friction=(friction, u)) for peak, friction in values])))
    rate, how = marks / runs / SHOTS, f"{marks} in {runs * SHOTS:,} shots; derived: at most 1e-4 (A = {SUM_LIMIT:.2f})"
    soak("false marks a shot, spread as assumed", f"{rate:.1e}", "< 1e-4", how)
    assert rate < 1e-4


@pytest.mark.parametrize(("slip", "bound"), [(0.05, None), (0.1, 0.99), (0.2, 0.99)])
def test_a_damper_that_slips_is_seen_within_three_shots(
    courses: Any, soak: Any, slip: float, bound: float | None
) -> None:
    random, runs = np.random.default_rng(4), 1_000
    found = [run_of(courses, [0.0] * GOOD + [slip] * 3, random)[GOOD:] for _ in range(runs)]
    within = [float(np.mean([any(marks[:n]) for marks in found])) for n in (1, 2, 3)]
    shown = ", ".join(f"{100 * share:.1f} %" for share in within)
    how = f"within 1, 2, 3 shots: {shown}; {runs} runs, after {GOOD} good shots"
    soak(
        f"damper slips by {100 * slip:.0f} %: seen within 3 shots",
        f"{within[2]:.3f}",
        f"> {bound}" if bound else "none",
        how,
    )
    assert within[2] > (bound or 0.0)


def test_the_peak_alone_does_not_tell_of_a_damper(courses: Any, soak: Any) -> None:
    good, bad = (float(np.abs(courses[part][0][0]).max()) for part in (0.0, 0.1))
    change = 100 * (bad / good - 1)
    soak("the recoil's peak, as a damper slips by 10 %", f"{change:+.2f} %", "none", "why friction is measured too")
    assert abs(change) < 1
