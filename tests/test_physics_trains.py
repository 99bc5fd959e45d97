"""Trains and rates. The expected rows are those of an independent hybrid integrator (event-clamped, numba)."""

import math

import pytest

from device.physics import GunParameters, simulate
from device.physics.shot import highest_rate_Hz
from tests.shot_trains import State, gentlest_friction_N, repeated, train

OPEN, DAMPED = GunParameters(drive_off="open"), GunParameters(friction_N=1.12)


def test_shots_that_wait_for_the_magnet_are_all_the_first_one():
    first, *others = repeated(OPEN, 6.5, 6)
    assert first.summary == simulate(OPEN)
    assert all(shot.summary == first.summary for shot in others)


def test_a_pulse_that_meets_the_returning_magnet_pushes_harder():
    shots = repeated(OPEN, 6.6, 4)
    assert shots[1].start.displacement_m == pytest.approx(1.96e-3, abs=0.02e-3)
    assert shots[1].summary.peak_force_N > 1.35 * shots[0].summary.peak_force_N


@pytest.mark.parametrize("rate_Hz", [8, 10])
def test_too_fast_a_train_loses_every_second_shot(rate_Hz):
    shots = repeated(OPEN, rate_Hz, 6)
    assert [shot.summary.peak_force_N is None for shot in shots] == [False, True] * 3


def test_five_a_second_starts_a_little_out_with_the_damper():
    shots = repeated(DAMPED, 5, 6)
    assert shots[-1].start.displacement_m == pytest.approx(0.21e-3, abs=0.01e-3)
    assert shots[-1].summary.max_displacement_m == pytest.approx(33.3e-3, abs=0.05e-3)


def test_whole_ticks_drop_no_shot():
    assert [shot.onset_tick for shot in repeated(DAMPED, 4, 6)] == [0, 250_000, 500_000, 750_000, 1_000_000, 1_250_000]


@pytest.mark.parametrize(
    ("friction_N", "drive_off", "emf", "rate_Hz"),
    [
        (0.21, "shorted", "printed", 6.44),
        (0.8, "shorted", "printed", 6.29),
        (1.0, "shorted", "printed", 5.71),
        (1.12, "shorted", "printed", 4.74),
        (1.3, "shorted", "printed", 2.37),
        (0.21, "open", "printed", 6.53),
        (1.12, "open", "printed", 6.15),
        (1.12, "shorted", "reciprocal", 5.73),
    ],
)
def test_the_highest_rate_by_friction(friction_N, drive_off, emf, rate_Hz):
    gun = GunParameters(friction_N=friction_N, drive_off=drive_off, emf=emf)
    assert highest_rate_Hz(gun) == pytest.approx(rate_Hz, abs=0.006)


def test_a_gun_whose_magnet_sticks_has_no_rate():
    assert highest_rate_Hz(GunParameters(friction_N=1.7)) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("emf", "friction_N"), [("printed", 1.094), ("reciprocal", 1.341)])
def test_the_gentlest_friction_at_five_a_second(emf, friction_N):
    gun = GunParameters(emf=emf)
    found = gentlest_friction_N(gun, 5.0)
    assert found == pytest.approx(friction_N, abs=1e-3)
    at = {f: simulate(GunParameters(emf=emf, friction_N=f)) for f in (found - 0.05, found, found + 1e-3)}
    before, here, beyond = at.values()
    assert here.reset_end_s <= 0.2 < beyond.reset_end_s
    assert here.impact_speed_m_s < before.impact_speed_m_s


def test_no_friction_allows_twenty_shots_a_second():
    assert gentlest_friction_N(GunParameters(), 20.0) is None


def test_a_shot_from_a_state_goes_on_from_there():
    (shot,) = train(OPEN, [0], State(displacement_m=0.03))
    assert shot.summary.peak_force_N is None  # beyond the coil: the pulse does nothing
    fall = math.acos((14 * 0.1 - 0.21) / (14 * 0.13 - 0.21)) * math.sqrt(0.114 / 14)  # a quarter swing to x = 0
    assert shot.summary.reset_end_s == pytest.approx(fall, rel=1e-12)


@pytest.mark.parametrize("ticks", [[0, 0], [5, 3]])
def test_ticks_that_do_not_rise_are_refused(ticks):
    with pytest.raises(ValueError, match="must rise"):
        train(OPEN, ticks)


def test_a_state_that_no_magnet_has_is_refused():
    with pytest.raises(ValueError, match="displacement_m at least 0"):
        train(OPEN, [0], State(displacement_m=-1.0))
    with pytest.raises(ValueError, match="rate_Hz is 0"):
        repeated(OPEN, 0, 2)
    with pytest.raises(ValueError, match="rate_Hz is nan"):
        gentlest_friction_N(OPEN, math.nan)
