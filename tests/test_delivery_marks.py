"""When a shot is marked: false marks, a damper that slips, and what a firm hand hides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from device.physics.hand import HandMechanics
from experiments.delivered.marks import (
    FRICTION_SPREAD,
    PEAK_SPREAD,
    SCALE_SHOTS,
    START_SHOTS,
    SUM_LIMIT,
    Z_LIMIT,
    DeliveryLevel,
    after_shot,
    start_limit,
)
from tests.delivered_chain import DAMPED, LIGHT, course, marks_of, measured_parts, parts_with, slipped


def test_the_limits_leave_one_false_mark_in_10000():
    """Shiryaev and Roberts: e^A shots to a change that is none, of three marks; a mean after n shots counts n/2."""
    tails = 4 * 0.5 * math.erfc(Z_LIMIT / math.sqrt(2))
    looks = [START_SHOTS * 2**i for i in range(5)]
    starts = sum(math.erfc(start_limit(shots) / math.sqrt(2)) for shots in looks) / looks[-1]
    assert 2 * 3 * math.exp(-SUM_LIMIT) + tails + starts <= 1e-4 + 1e-12


def test_without_a_change_each_hypothesis_has_a_ratio_of_1_on_average():
    """Which the bound of false marks rests on: over what the next shot may be, by Gauss and Hermite."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    level = DeliveryLevel.before(FRICTION_SPREAD)
    for part in (1.01, 0.97, 1.02, 0.99, 1.0, 1.01):
        level, _ = after_shot(level, part, 0.05)
    deviation = math.sqrt(level.variance + FRICTION_SPREAD.within**2 + 0.05**2)
    ratios = []
    for node in nodes:
        after, _ = after_shot(level, level.mean + deviation * float(np.clip(node, -4.5, 4.5)), 0.05)
        ratios.append(np.exp(after.ups - np.append(level.ups, 0.0)))
    assert weights @ np.array(ratios) / math.sqrt(2 * math.pi) == pytest.approx(
        np.ones(4), abs=2e-3
    )  # less what lies beyond 4.5


@pytest.mark.slow
def test_a_damper_that_slips_is_seen_within_three_shots_and_a_good_one_is_not_marked():
    random, good, bad = np.random.default_rng(6), course(DAMPED), course(slipped(DAMPED, 0.1))
    for _ in range(4):
        marks = marks_of(measured_parts(random, DAMPED, [good] * 12 + [bad] * 5))
        assert marks[:12] == [""] * 12
        assert any(marks[12:15])
        assert marks[15:] == [marks[15]] * 2 != ["", ""]  # as long as it lasts


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("start", [12, 20, 40])
def test_a_lasting_change_is_seen_whenever_it_comes_and_until_it_is_mended(start: int, sign: int):
    shots = [parts_with(1.0, 0.05)] * start
    bad = [parts_with(1.0 + 0.1 * sign, 0.05)] * 60
    marks = marks_of([*shots, *bad, *shots[:3]])
    assert not any(marks[:start])
    assert marks[start + 59] == "slipped"
    assert marks[-3:] == ["", "", ""]


@pytest.mark.slow
def test_a_slip_from_a_method_s_first_shot_on_is_seen_against_the_model_and_said_once():
    random = np.random.default_rng(8)
    for actuator, slip in ((DAMPED, 0.1), (LIGHT, 0.25)):
        marks = marks_of(measured_parts(random, actuator, [course(slipped(actuator, slip))] * 48))
        assert [mark for mark in marks if mark] == ["slipped"]
        assert not any(marks_of(measured_parts(random, actuator, [course(actuator)] * 24)))


def test_a_firm_hand_holds_the_magnet_at_its_turn_and_its_friction_is_known_all_the_same():
    random, firm = np.random.default_rng(9), HandMechanics(stiffness_N_m=500.0, damping_N_s_m=20.0)
    good, bad = (measured_parts(random, DAMPED, [course(slipped(DAMPED, slip), firm)] * 24) for slip in (0.0, 0.1))
    for shots, friction in ((good, 1.0), (bad, 0.9)):
        leaps = [one.friction.moves_N / one.usual_N for one in shots if one.friction is not None]
        parts = [one.friction.at_scale()[0] / one.usual_N for one in shots if one.friction is not None]
        assert max(leaps) < 0.88  # half of the leap alone says much less
        assert np.mean(parts) == pytest.approx(friction, abs=0.02)
    assert not any(marks_of(good))
    marks = marks_of([*good[:12], *bad[:5]])
    assert not any(marks[:12])
    assert any(marks[12:])


def test_a_damper_that_was_forgotten_is_seen_at_the_first_shot():
    random = np.random.default_rng(11)
    assert marks_of(measured_parts(random, DAMPED, [course(LIGHT)] * 3)) == ["outside"] * 3


def test_a_sensor_of_another_scale_is_known_by_the_peaks_and_no_shot_is_marked_for_it():
    random, hand = (
        np.random.default_rng(10),
        HandMechanics(stiffness_N_m=435.0, damping_N_s_m=13.2),
    )  # rests, now and then
    for scale in (0.95, 1.05):
        assert not any(marks_of(measured_parts(random, DAMPED, [scale * course(DAMPED, hand)] * 24)))


def test_one_shot_far_off_is_marked_at_once_and_teaches_nothing():
    level = DeliveryLevel.before(PEAK_SPREAD)
    for _ in range(5):
        level, mark = after_shot(level, 1.03, 0.01)
        assert mark == ""
    after, mark = after_shot(level, 0.5, 0.01)
    assert mark != ""
    assert (after.mean, after.variance) == (level.mean, level.variance)


@pytest.mark.parametrize("first", [0.6, 0.75, 0.85, 0.9, 1.1, 1.2, 1.4])
def test_a_first_shot_that_was_odd_does_not_mark_all_that_follow(first: float):
    good = [parts_with(1.0, 0.01)] * 60
    assert sum(map(bool, marks_of([parts_with(1.0, 0.01, peak=first), *good]))) <= 3
    assert sum(map(bool, marks_of([*good[:SCALE_SHOTS], parts_with(first, 0.01), *good]))) <= 3


def test_a_run_has_its_own_level():
    level = DeliveryLevel.before(FRICTION_SPREAD)
    for _ in range(20):
        level, mark = after_shot(level, 1.12, 0.01)
        assert mark == ""
    assert level.mean == pytest.approx(1.12, abs=0.002)
