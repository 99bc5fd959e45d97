"""Neighbouring guns shoot alike: halving the distance of two guns halves the difference of every number.

A jump is allowed only where the order of events changes; within one status and one order it is a defect.
"""

import math

import pytest

from tests.extreme_guns import defects, distance

SOME = 100


@pytest.mark.slow
def test_neighbouring_guns_shoot_alike():
    assert not defects(1, SOME)


def test_a_jump_would_be_noticed():
    assert distance([1.0, 2.0], [1.0, 2.2]) == pytest.approx(0.2 / 2.2)
    assert math.isclose(distance([], []), 0.0)
