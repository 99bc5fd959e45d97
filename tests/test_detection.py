from __future__ import annotations

import pytest

from analysis import yes_no


def test_hand_worked_values_of_eight_hits_and_three_false_alarms() -> None:
    # H = 8.5 / 11 = .7727, z = .7479; F = 3.5 / 11 = .3182, z = -.4728 (normal table)
    found = yes_no(8, 10, 3, 10)
    assert (found.hit_rate, found.false_alarm_rate) == pytest.approx((8.5 / 11, 3.5 / 11))
    assert found.d_prime == pytest.approx(1.2207, abs=2e-4)
    assert found.criterion == pytest.approx(-0.1375, abs=2e-4)


def test_the_correction_is_a_half_to_counts_and_one_to_totals() -> None:
    # Hautus 1995; 1.5 to the totals (psycho.R #113, neuropsychology.R #10): 8.5 / 11.5 and 3.5 / 11.5
    found = yes_no(8, 10, 3, 10)
    assert found.hit_rate == 8.5 / 11
    assert found.false_alarm_rate == 3.5 / 11
    assert abs(found.d_prime - 1.1526) > 0.05


def test_d_prime_is_hits_against_false_alarms_and_not_hits_against_hits() -> None:
    # NeuroKit.py #76 took z(H) - z(H); with 18 of 20 and 6 of 40: z(18.5 / 21) = 1.1798, z(6.5 / 41) = -1.0005
    found = yes_no(18, 20, 6, 40)
    assert found.d_prime == pytest.approx(2.1803, abs=1e-4)
    assert found.criterion == pytest.approx(-0.0896, abs=1e-4)


def test_the_correction_is_made_within_the_range_too() -> None:
    # 15 of 20 and 5 of 20: H = 15.5 / 21, z = .6375; uncorrected d' would be 2 x .6745 (normal table)
    assert yes_no(15, 20, 5, 20).d_prime == pytest.approx(1.2750, abs=3e-4)


def test_no_difference_is_no_sensitivity_at_any_bias() -> None:
    found = yes_no([0, 3, 10], 10, [0, 3, 10], 10)
    assert found.d_prime.tolist() == [0.0, 0.0, 0.0]
    assert found.criterion[0] == -found.criterion[2]


def test_perfect_answers_stay_finite_and_unbiased() -> None:
    # H = 10.5 / 11, F = 0.5 / 11, z = +-1.6906 (normal table)
    found = yes_no(10, 10, 0, 10)
    assert found.d_prime == pytest.approx(2 * 1.6906, abs=2e-4)
    assert found.criterion == 0.0


def test_always_saying_forward_is_bias_without_sensitivity() -> None:
    found = yes_no(10, 10, 10, 10)
    assert found.d_prime == 0.0
    assert found.criterion == pytest.approx(-1.6906, abs=1e-4)


def test_swapping_the_two_words_turns_the_criterion_and_keeps_d_prime() -> None:
    found, swapped = yes_no(7, 10, 2, 10), yes_no(8, 10, 3, 10)
    assert swapped.d_prime == pytest.approx(found.d_prime)
    assert swapped.criterion == pytest.approx(-found.criterion)


def test_participants_go_in_as_arrays() -> None:
    found = yes_no([8, 10], 10, [3, 0], 10)
    assert found.d_prime == pytest.approx([1.2207, 3.3812], abs=2e-4)


@pytest.mark.parametrize(
    ("counts", "reason"),
    [
        ((11, 10, 0, 10), "hits"),
        ((1, 10, -1, 10), "false_alarms"),
        ((0, 0, 0, 10), "signal_trials must be at least 1, not 0"),
        ((0.8, 10, 0, 10), "whole"),
    ],
)
def test_impossible_counts_are_refused(counts: tuple[float, int, int, int], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        yes_no(*counts)
