"""At the extremes every shot has a right answer or a named status."""

import math

import pytest

from device.physics import GunParameters, simulate, trace
from device.physics.equations import HORIZON_S
from device.physics.traces import energy_balance
from tests.extreme_guns import BREAK_AWAY_V, numbers, shoot
from tests.shot_trains import repeated

OFF = ["shorted", "open"]


@pytest.mark.parametrize("drive_off", OFF)
def test_the_error_of_leaving_the_inductance_out_falls_in_proportion_to_it(drive_off):
    without = simulate(GunParameters(drive_off=drive_off), "no-inductance")
    errors = {
        L: abs(shoot(inductance_H=L, drive_off=drive_off).recoil_end_s / without.recoil_end_s - 1)
        for L in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    }
    for L, error in errors.items():
        assert error == pytest.approx(20.4 * L, rel=0.05)  # 2e-3 at 1e-4 H, an independent program's figure


@pytest.mark.parametrize("drive_off", OFF)
@pytest.mark.parametrize("L", [1e-10, 1e-11, 1e-12])
def test_hardly_any_inductance_is_no_inductance(L, drive_off):
    small, without = (
        shoot(inductance_H=L, drive_off=drive_off),
        simulate(GunParameters(drive_off=drive_off), "no-inductance"),
    )
    for name, value in numbers(without).items():
        assert numbers(small)[name] == pytest.approx(value, rel=1e-6), name


@pytest.mark.slow
@pytest.mark.parametrize("friction_N", [1.3999, 1.4, 1.4001, 1e3])
@pytest.mark.parametrize("drive_off", OFF)
def test_friction_about_the_pre_load_and_far_above_it(friction_N, drive_off):
    summary = shoot(friction_N=friction_N, drive_off=drive_off)
    if friction_N == 1e3:
        assert summary.status == "no-break-away"
    elif drive_off == "open":
        assert summary.status == "home"
    else:
        assert summary.status in ("home", "not-home", "stuck")


@pytest.mark.parametrize(
    ("voltage_V", "status"),
    [(0.0, "no-break-away"), (0.999 * BREAK_AWAY_V, "no-break-away"), (1.001 * BREAK_AWAY_V, "home"), (1e4, "home")],
)
@pytest.mark.parametrize("drive_off", OFF)
def test_voltages_from_none_to_ten_thousand(voltage_V, status, drive_off):
    assert shoot(voltage_V=voltage_V, drive_off=drive_off).status == status


@pytest.mark.parametrize("drive_off", OFF)
def test_pulses_from_a_nanosecond_to_a_second(drive_off):
    assert shoot(pulse_s=1e-9, drive_off=drive_off).status == "no-break-away"
    for pulse_s in (1e-4, 1e-3, 0.1, 1.0):
        assert shoot(pulse_s=pulse_s, drive_off=drive_off).status == "home"


@pytest.mark.parametrize("drive_off", OFF)
def test_a_magnet_of_a_milligram_creeps_out_at_its_terminal_speed(drive_off):
    summary = shoot(magnet_mass_kg=1e-6, drive_off=drive_off)
    assert summary.status in ("home", "not-home")


@pytest.mark.parametrize("drive_off", OFF)
def test_a_magnet_of_a_ton_hardly_moves_and_comes_home(drive_off):
    summary = shoot(magnet_mass_kg=1e3, drive_off=drive_off)
    assert summary.status == "home"
    # a = F/m for 10 ms with F the mean force of the pulse, then F_spring alone: less than a tenth of a millimetre
    assert summary.max_displacement_m < 1e-4


@pytest.mark.parametrize("drive_off", OFF)
def test_a_spring_that_fades_away_ends_where_there_is_none(drive_off):
    without = shoot(stiffness_N_m=0.0, drive_off=drive_off)
    assert without.status == "stuck"
    for stiffness_N_m in (1e-6, 1e-9, 1e-15, 1e-300):
        soft = shoot(stiffness_N_m=stiffness_N_m, drive_off=drive_off)
        assert soft.status == "stuck"
        assert soft.max_displacement_m == pytest.approx(without.max_displacement_m, rel=10 * stiffness_N_m + 1e-12)


def test_a_contact_of_a_nanometre_is_a_hard_one():
    assert shoot(contact_depth_m=1e-9).collision_force_N == pytest.approx(0.5e6 * shoot().collision_force_N)


@pytest.mark.parametrize("rate_Hz", [1, 5, 6.6, 10, 30, 100])
@pytest.mark.parametrize("drive_off", OFF)
@pytest.mark.parametrize("friction_N", [0.21, 1.12])
def test_re_firing_from_one_to_a_hundred_hertz(rate_Hz, drive_off, friction_N):
    shots = repeated(GunParameters(friction_N=friction_N, drive_off=drive_off), rate_Hz, 8)
    for shot in shots:
        assert all(math.isfinite(value) for value in numbers(shot.summary).values())
        assert shot.summary.status in ("home", "not-home", "stuck", "no-break-away")
        assert shot.start.displacement_m >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("mass_kg", "resistance_ohm"), [(1e-6, 0.03), (1e-9, 2.9)])
def test_a_trace_that_is_more_work_than_its_summary_ends_where_it_is_given_up(mass_kg, resistance_ohm):
    """It follows the ring of a light magnet, which the summary leaves early, or each of its slips."""
    gun = GunParameters(magnet_mass_kg=mass_kg, resistance_ohm=resistance_ohm)
    shot, balance = trace(gun), energy_balance(gun)
    assert shot.summary.status == "home"
    assert shot.given_up_s == balance.given_up_s == shot.time_s[-1] < shot.summary.reset_end_s
    assert (shot.displacement_m >= 0.0).all()
    assert shot.displacement_m.max() <= shot.summary.max_displacement_m * (1.0 + 1e-9)
    assert abs(shot.force_N).max() < 1.1 * shot.summary.peak_force_N
    assert abs(balance.residual_J) < 1e-12 * balance.supplied_J


@pytest.mark.parametrize("gun", [GunParameters(), GunParameters(pulse_s=100.0), GunParameters(friction_N=1.7)])
def test_a_shot_that_comes_to_rest_or_takes_all_its_time_is_not_given_up(gun):
    shot = trace(gun)
    assert shot.given_up_s is energy_balance(gun).given_up_s is None
    assert shot.time_s[-1] <= HORIZON_S


@pytest.mark.parametrize("number", [5e-324, 1e-310, 1e300])
@pytest.mark.parametrize(
    "name", ["magnet_mass_kg", "resistance_ohm", "inductance_H", "coil_reach_m", "stiffness_N_m", "voltage_V"]
)
def test_the_course_of_a_shot_beyond_floats_is_refused_in_words_or_in_floats(name, number):
    gun = GunParameters(**{name: number})
    simulate(gun)
    for look, sum_of in ((trace, lambda shot: shot.time_s.sum()), (energy_balance, lambda found: found.residual_J)):
        try:
            said = math.isfinite(sum_of(look(gun)))
        except ValueError as error:
            said = "beyond what numbers can express" in str(error)
        assert said
