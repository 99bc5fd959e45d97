"""A damper in a gun's config: rubber strips instead of a measured friction, and a way back of its own."""

import pytest

from device.methods import rendering_of
from device.parameters import GunParameters
from device.physics import simulate, trace
from device.physics.hand import HandMechanics, compliant_collision, rigid_collision, simulate_held
from device.physics.shot import highest_rate_Hz
from device.physics.traces import energy_balance
from device.simulated import SimulatedGun
from device.words import Pulse, Shot
from experiments.config.setup import GunConfig
from tests.shot_trains import train

BACK = GunParameters(return_friction_N=1.12)
STRIPS = {"coefficient": 0.7, "stiffness_N_m": 1300.0, "deformation_m": 0.0005}  # 0.91 N, equation (5)


def a_gun(**method):
    return GunConfig(title="a gun", methods={"soft": {"label": "Soft", "actuator": "voice-coil"} | method})


def test_strips_add_their_friction_to_the_guns_own():
    assert a_gun(strips=STRIPS).rendering("soft").friction_N == pytest.approx(0.21 + 0.91)
    assert a_gun(strips=STRIPS).rendering("soft").return_friction_N is None


def test_strips_may_brake_the_return_alone():
    gun = a_gun(strips=STRIPS | {"brakes": "return"}).rendering("soft")
    assert gun.friction_N == 0.21
    assert gun.return_friction_N == pytest.approx(1.12)


def test_a_friction_of_the_return_is_a_number_of_the_config():
    assert a_gun(voice_coil={"return_friction_N": 1.12}).rendering("soft") == BACK


@pytest.mark.parametrize(
    ("method", "said"),
    [
        ({"strips": STRIPS | {"coefficient": -0.1}}, r"methods.soft.strips.coefficient is -0.1"),
        ({"strips": STRIPS | {"brakes": "never"}}, "brakes"),
        ({"strips": {"coefficient": 0.7}}, "stiffness_N_m"),
        ({"strips": STRIPS, "voice_coil": {"friction_N": 1.0}}, "friction_N stands beside methods.soft.strips"),
        ({"strips": STRIPS, "actuator": "vibration"}, "no magnet to brake"),
        ({"voice_coil": {"return_friction_N": -1.0}}, "return_friction_N is -1.0"),
        ({"voice_coil": {"return_friction_N": "much"}}, "must be a number"),
    ],
)
def test_a_damper_that_makes_no_sense_is_refused(method, said):
    with pytest.raises(ValueError, match=said):
        a_gun(**method)


def test_a_recorded_gun_reads_back_as_itself():
    gun = a_gun(strips=STRIPS)
    assert GunConfig.model_validate(gun.model_dump(mode="python")) == gun


def test_the_simulated_gun_waits_for_the_braked_magnet():
    expected = simulate(GunParameters(return_friction_N=1.12))
    assert rendering_of(BACK).settle_s == expected.reset_end_s
    gun = SimulatedGun({"soft": BACK}, lambda: 0.0)
    gun.arm()
    report = gun.fire(Shot(method="soft", direction="forward", drive=Pulse(voltage_V=16.0, pulse_s=0.010)))
    assert report.home_predicted_s == expected.reset_end_s


def test_trains_and_rates_know_the_braked_return():
    expected = simulate(GunParameters(return_friction_N=1.12))
    assert train(BACK, [0])[0].summary == expected
    assert highest_rate_Hz(BACK) == pytest.approx(1 / expected.reset_end_s, rel=1e-4)
    assert highest_rate_Hz(BACK) < highest_rate_Hz(GunParameters())


def test_trace_and_audit_know_the_braked_return():
    expected = simulate(GunParameters(return_friction_N=1.12))
    shot = trace(BACK)
    home = shot.time_s[(shot.displacement_m <= 0.0) & (shot.time_s > 0.1)][0]
    assert home == pytest.approx(expected.reset_end_s, abs=2e-4)
    found = energy_balance(BACK)
    assert abs(found.residual_J) < 1e-12
    assert abs(found.residual_impulse_Ns) < 1e-12
    assert found.friction_J > (0.21 + 1.12) * expected.max_displacement_m - 1e-9


def test_a_gun_too_heavy_to_move_is_the_fixed_gun_with_its_braked_return():
    held, fixed = (
        simulate_held(BACK, HandMechanics(enclosure_mass_kg=1e7)),
        simulate(GunParameters(return_friction_N=1.12)),
    )
    assert held.reset_end_s == pytest.approx(fixed.reset_end_s, rel=2e-7)
    assert held.impact_speed_m_s == pytest.approx(fixed.impact_speed_m_s, rel=2e-7)


def test_a_stop_of_its_own_stiffness_takes_the_energy_of_the_impact():
    gun, speed, stiff = GunParameters(friction_N=1.4), 0.5, 1e6  # friction and pre-load cancel at x = 0
    soft = compliant_collision(gun, speed, stiff)
    assert soft.peak_force_N == pytest.approx(speed * (0.114 * stiff) ** 0.5, rel=1e-4)  # k y^2/2 = m v^2/2
    assert soft.impulse_Ns == pytest.approx(rigid_collision(gun, speed).impulse_Ns, rel=1e-4)
    with pytest.raises(ValueError, match="stop_N_m is 0"):
        compliant_collision(gun, speed, 0.0)
