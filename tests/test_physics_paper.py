"""The paper's claims, with the default options; where another option gives another answer, that is said."""

import pytest

from device.physics import GunParameters, simulate
from device.physics.shot import highest_rate_Hz
from tests.physics_claims import BARE, DAMPED, VARIANTS, motor_peak_N, share_after_turn, slide_mm


@pytest.mark.parametrize("gun", [BARE, DAMPED])
def test_the_force_on_the_hand_peaks_near_35_to_36_newtons(gun):
    assert 35.0 < simulate(gun).peak_force_N < 36.0
    assert motor_peak_N(gun) == pytest.approx(37.6, abs=0.1)


def test_the_collision_is_hard_without_the_damper_and_gentle_with_it():
    assert simulate(BARE).collision_force_N == pytest.approx(54, abs=0.5)
    assert simulate(DAMPED).collision_force_N == pytest.approx(0.05, abs=0.005)


def test_about_five_shots_a_second_with_the_damper():
    assert highest_rate_Hz(DAMPED) == pytest.approx(4.74, abs=0.01)


def test_after_the_turning_point_the_damped_gun_stays_below_a_ninth_of_the_peak_and_the_bare_one_passes_a_quarter():
    shares = [share_after_turn(gun) for gun in (BARE, DAMPED)]
    assert shares[0] > 0.25
    assert shares[1] < 0.11


@pytest.mark.parametrize(("drive_off", "emf"), VARIANTS)
def test_the_slide_on_the_table_by_option(drive_off, emf):
    expected = {
        ("shorted", "printed"): 4.5,
        ("shorted", "reciprocal"): 13.9,
        ("open", "printed"): 24.6,
        ("open", "reciprocal"): 30.7,
    }  # "more than a dozen millimetres": every option but the default
    assert slide_mm(GunParameters(drive_off=drive_off, emf=emf)) == pytest.approx(expected[drive_off, emf], abs=0.1)
