"""When a shot is marked: false marks, a damper that slips, and what a firm hand hides."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from device.physics.hand import HandMechanics
from experiments.delivered.marks import (
    FRICTION_SPREAD,
    PEAK_SPREAD,
    START_SHOTS,
    SUM_LIMIT,
    Z_LIMIT,
    DeliveryLevel,
    ShotParts,
    after_shot,
    start_limit,
)
from tests.delivered_chain import DAMPED, LIGHT, course, marks_of, measured_parts, slipped


def test_the_limits_leave_one_false_mark_in_10000():
    """Shiryaev and Roberts: e^A shots to a false mark; a mean that is looked at after n shots has a share of n/2."""
    tails = 4 * 0.5 * math.erfc(Z_LIMIT / math.sqrt(2))
    looks = [START_SHOTS * 2**i for i in range(5)]
    starts = sum(math.erfc(start_limit(shots) / math.sqrt(2)) for shots in looks) / looks[-1]
    assert 2 * math.exp(-SUM_LIMIT) + tails + starts <= 1e-4 + 1e-12


def test_without_a_change_each_hypothesis_has_a_ratio_of_1_on_average():
    """Which the bound of false marks rests on: over what the next shot may be, by Gauss and Hermite."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    level = DeliveryLevel.before(FRICTION_SPREAD)
    for part in (1.01, 0.97, 1.02):
        level, _ = after_shot(level, part, 0.05)
    deviation = math.sqrt(level.variance + FRICTION_SPREAD.within**2 + 0.05**2)
    ratios = []
    for node in nodes:
        after, _ = after_shot(level, level.mean + deviation * float(np.clip(node, -4.5, 4.5)), 0.05)
        ratios.append(np.exp(after.ups - np.append(level.ups, 0.0)))
    assert weights @ np.array(ratios) / math.sqrt(2 * math.pi) == pytest.approx(np.ones(4), abs=1e-3)


def test_a_damper_that_slips_is_seen_within_three_shots_and_a_good_one_is_not_marked():
    random, good, bad = np.random.default_rng(6), course(DAMPED), course(slipped(DAMPED, 0.1))
    for _ in range(4):
        marks = marks_of(measured_parts(random, DAMPED, [good] * 12 + [bad] * 5))
        assert marks[:12] == [""] * 12
        assert any(marks[12:15])
        assert marks[15:] == [marks[15]] * 2 != ["", ""]  # as long as it lasts


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("start", [8, 15, 40])
def test_a_lasting_change_is_seen_whenever_it_comes_and_until_it_is_mended(start: int, sign: int):
    shots = [ShotParts(peak=1.0, peak_u=0.01, friction=1.0, friction_u=0.05)] * start
    bad = [replace(shots[0], friction=1.0 + 0.1 * sign)] * 60
    marks = marks_of([*shots, *bad, *shots[:3]])
    assert not any(marks[:start])
    assert marks[start + 59] == "slipped"
    assert marks[-3:] == ["", "", ""]


def test_a_slip_from_a_method_s_first_shot_on_is_seen_against_the_model_and_said_once():
    random = np.random.default_rng(8)
    for actuator in (DAMPED, LIGHT):
        marks = marks_of(measured_parts(random, actuator, [course(slipped(actuator, 0.1))] * 48))
        assert [mark for mark in marks if mark] == ["slipped"]
        assert not any(marks_of(measured_parts(random, actuator, [course(actuator)] * 24)))


def test_where_the_magnet_rests_at_its_turn_its_step_is_less_and_no_mean_is_held_against_the_model():
    random = np.random.default_rng(9)
    firm = course(DAMPED, HandMechanics(stiffness_N_m=500.0, damping_N_s_m=20.0))
    shots = measured_parts(random, DAMPED, [firm] * 24)
    assert all(one.rests for one in shots)
    assert all(one.friction < 0.9 for one in shots)
    assert not any(marks_of(shots))
    assert not any(one.rests for one in measured_parts(random, DAMPED, [course(DAMPED)] * 12))


def test_one_shot_far_off_is_marked_at_once_and_teaches_nothing():
    level = DeliveryLevel.before(PEAK_SPREAD)
    for _ in range(5):
        level, mark = after_shot(level, 1.03, 0.01)
        assert mark == ""
    after, mark = after_shot(level, 0.5, 0.01)
    assert mark != ""
    assert (after.mean, after.variance) == (level.mean, level.variance)


def test_a_run_has_its_own_level():
    level = DeliveryLevel.before(FRICTION_SPREAD)
    for _ in range(20):
        level, mark = after_shot(level, 1.12, 0.01)
        assert mark == ""
    assert level.mean == pytest.approx(1.12, abs=0.002)
