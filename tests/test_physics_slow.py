"""Guns far from the paper's: a magnet that creeps costs no more steps the stiffer the gun is, and loses no digit.

Nor does one whose speed and current ring first, or that is held; and none is held that the spring pushes.
"""

import dataclasses

import pytest

from device.physics import GunParameters, coil, segments, shot, simulate
from device.physics.equations import DRIVE_CHANGE, FREE, HOME, NOT_HOME, TURN, ShotState, StepSeries, pack
from device.physics.traces import energy_balance
from tests.extreme_guns import FAR_SHOTS, work

RINGING = {
    "printed": GunParameters(
        magnet_mass_kg=0.02364,
        back_emf_V_s_m=178.2,
        resistance_ohm=0.1006,
        inductance_H=3.205e-4,
        motor_constant_N_A=75.19,
        coil_reach_m=0.08788,
        stiffness_N_m=29.86,
        preload_length_m=1.056,
        friction_N=6.274,
        voltage_V=0.6935,
        pulse_s=0.0395,
        contact_depth_m=2.978e-4,
    ),
    "reciprocal": GunParameters(
        magnet_mass_kg=0.04709,
        back_emf_V_s_m=141.6,
        resistance_ohm=1.527,
        inductance_H=2.513e-5,
        motor_constant_N_A=17.61,
        coil_reach_m=0.03705,
        stiffness_N_m=356.3,
        preload_length_m=0.04492,
        friction_N=0.4777,
        voltage_V=247.5,
        pulse_s=0.2667,
        contact_depth_m=2.096e-3,
        emf="reciprocal",
    ),
}
HELD = GunParameters(
    magnet_mass_kg=0.02753,
    back_emf_V_s_m=175.9,
    resistance_ohm=16.49,
    inductance_H=2.427e-5,
    motor_constant_N_A=31.72,
    coil_reach_m=0.02491,
    stiffness_N_m=2.629,
    preload_length_m=0.1347,
    friction_N=0.2879,
    voltage_V=17.6,
    pulse_s=0.2932,
    contact_depth_m=2.046e-4,
    drive_off="open",
    emf="reciprocal",
)


@pytest.mark.parametrize("row", FAR_SHOTS, ids=lambda row: str(row["gun"]["magnet_mass_kg"]))
def test_it_agrees_with_fifty_digits(row):
    gun = GunParameters(**row["gun"])
    found, least = simulate(gun), 1e-15 * gun.stiffness_N_m * gun.preload_length_m  # of what cancels in a force
    assert found.status == "home"
    for name, digits in row["summary"].items():
        cancels = least if name == "peak_force_N" else 0.0
        assert getattr(found, name) == pytest.approx(float(digits), rel=1e-12, abs=cancels), name


@pytest.mark.slow
@pytest.mark.parametrize("row", FAR_SHOTS[:3], ids=lambda row: str(row["gun"]["magnet_mass_kg"]))
@pytest.mark.parametrize("name", ["magnet_mass_kg", "inductance_H"])
def test_the_work_does_not_grow_with_the_stiffness(row, name):
    gun = GunParameters(**row["gun"])
    for part in (1.0, 1e-2, 1e-4):
        status, units = work(dataclasses.replace(gun, **{name: part * getattr(gun, name)}))
        assert status == HOME
        assert units < 2000  # in plain steps, thousands of the gun as it is and the more the lighter


@pytest.mark.slow
@pytest.mark.parametrize("emf", RINGING)
def test_a_magnet_that_rings_before_it_creeps_agrees_with_the_plain_series(emf, monkeypatch):
    gun = RINGING[emf]
    found, (_, units) = simulate(gun), work(gun)
    monkeypatch.setattr(coil, "_CREEPING", 0.0)  # speed and current are never taken to follow the position
    plain, (_, plain_units) = simulate(gun), work(gun)
    assert found.status == plain.status == "home"
    for name in ("reset_end_s", "impact_speed_m_s", "firing_end_s", "max_displacement_m"):
        assert getattr(found, name) == pytest.approx(getattr(plain, name), rel=2e-12, abs=0.0), name
    assert units < 0.4 * plain_units


@pytest.mark.slow
@pytest.mark.parametrize("emf", RINGING)
def test_energy_and_momentum_of_a_magnet_that_rings_add_up(emf):
    audit = energy_balance(RINGING[emf])
    assert abs(audit.residual_J) < 1e-12 * audit.supplied_J
    assert abs(audit.residual_impulse_Ns) < 1e-10


def test_a_magnet_that_the_coil_holds_at_the_end_of_its_force_is_little_work():
    assert work(HELD)[1] < 1000  # 5,000 as long as the current's settling was held against the coil's best hold


def test_without_a_current_no_magnet_rests_that_the_spring_pushes():
    gun = pack(GunParameters(drive_off="open"))
    hardly = ShotState(time=0.01, x=0.005, v=1e-300)  # outwards: it turns in the moment it sets out
    segments.pulse_off(gun, hardly)
    segments.enter(gun, hardly, DRIVE_CHANGE)
    assert segments.advance(gun, hardly, StepSeries()) == TURN
    segments.enter(gun, hardly, TURN)
    assert (hardly.kind, hardly.heading) == (FREE, -1.0)


def test_a_plain_shot_is_no_work():
    assert all(work(GunParameters(friction_N=friction))[1] < 60 for friction in (0.21, 1.12))


def test_a_shot_that_is_too_much_work_is_given_up_as_not_home(monkeypatch):
    monkeypatch.setattr(shot, "MAX_WORK", 12)
    assert work(GunParameters())[0] == NOT_HOME
