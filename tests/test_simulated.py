import math

import pytest

from device import Effect, Identity, LimitError, LinkError, Pulse, Shot, open_gun
from device.physics import GunParameters
from device.simulated import MODEL_VERSION
from device.vibration import VibrationParameters

PULSE = Pulse(voltage_V=16.0, pulse_s=0.010)


class Clock:
    """A clock that stands where it is set."""

    def __init__(self, now_s=100.0):
        self.now_s = now_s

    def __call__(self):
        return self.now_s


def a_shot(method="asymmetric-2", drive=PULSE, direction="forward"):
    return Shot(method=method, direction=direction, drive=drive)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def gun(clock):
    gun = open_gun("simulated", clock=clock)
    gun.arm()
    return gun


def test_a_gun_is_born_disarmed_and_refuses_to_fire(clock):
    gun = open_gun("simulated", clock=clock)
    assert gun.status().state == "disarmed"
    with pytest.raises(LimitError, match="disarmed"):
        gun.fire(a_shot())
    assert gun.status().shots == 0


def test_it_says_that_it_is_simulated(gun):
    assert gun.identify() == Identity(model="simulated", version=MODEL_VERSION, serial="simulated")


def test_a_shot_is_reported_at_once_with_the_predicted_return(gun):
    report = gun.fire(a_shot())
    assert report.shot == a_shot()
    assert (report.requested_s, report.pulse_start_s, report.pulse_end_s) == (100.0, 100.0, 100.010)
    assert report.home_predicted_s == pytest.approx(100.21100, abs=1e-5)
    assert report.motion == "home"


def test_a_vibration_is_rendered_for_its_duration(gun):
    report = gun.fire(a_shot("vibration", Effect(effect=1)))
    assert report.motion == "rendered"
    assert report.pulse_end_s == report.home_predicted_s == 100.024


def test_it_is_resetting_until_the_magnet_is_home_and_then_fires_again(gun, clock):
    report = gun.fire(a_shot())
    assert gun.status().state == "resetting"
    assert gun.status().ready_at_s == pytest.approx(report.home_predicted_s, abs=1e-6)
    clock.now_s = 100.2
    with pytest.raises(LimitError, match="not home yet"):
        gun.fire(a_shot())
    clock.now_s = report.home_predicted_s
    assert gun.status().state == "armed"
    gun.fire(a_shot())
    assert gun.status().shots == 2


def test_ten_hertz_is_refused_but_the_trains_earliest_times_are_not(gun, clock):
    for _ in range(20):
        clock.now_s = gun.fire(a_shot("asymmetric-1")).home_predicted_s
    with pytest.raises(LimitError):
        [gun.fire(a_shot("asymmetric-1")) for clock.now_s in (110.0, 110.1)]


def test_what_was_refused_leaves_no_trace(gun):
    before = gun.status()
    for shot in (a_shot("recoil"), a_shot("vibration"), a_shot(drive=Effect(effect=1))):
        with pytest.raises(LimitError):
            gun.fire(shot)
    assert gun.status() == before


def test_an_unknown_method_is_refused_with_the_known_ones(gun):
    with pytest.raises(LimitError, match=r"'recoil'.*vibration, asymmetric-1, asymmetric-2"):
        gun.fire(a_shot("recoil"))


def test_a_method_that_would_not_bring_the_magnet_home_is_refused(clock):
    gun = open_gun("simulated", {"sticky": GunParameters(friction_N=1.7)}, clock=clock)
    gun.arm()
    with pytest.raises(LimitError, match="stuck"):
        gun.fire(a_shot("sticky"))


def test_the_coil_warms_with_each_shot_and_cools_after_it(gun, clock):
    cold = gun.status().coil_temperature_C
    gun.fire(a_shot())
    warm = gun.status().coil_temperature_C
    clock.now_s += 600.0
    assert cold == 25.0
    assert warm == pytest.approx(25.0 + 16.0**2 / 2.9 * 0.010 / 20.0)
    assert cold < gun.status().coil_temperature_C < warm


def test_disarming_works_from_every_state(gun, clock):
    gun.fire(a_shot())
    for prepare in (gun.disarm, gun.arm, gun.close):
        prepare()
        gun.disarm()
        assert gun.status().state == "disarmed"


def test_a_closed_gun_is_disarmed_and_answers_only_its_status(gun):
    gun.close()
    gun.close()
    for ask in (gun.identify, gun.arm, lambda: gun.fire(a_shot())):
        with pytest.raises(LinkError, match="closed"):
            ask()
    assert gun.status().state == "disarmed"


def test_a_clock_that_is_no_number_refuses_the_shot(gun, clock):
    clock.now_s = math.nan
    with pytest.raises(LimitError, match="now_s"):
        gun.fire(a_shot())


def test_a_gun_takes_the_papers_methods_from_a_gun_or_methods_by_name(clock):
    opened = open_gun("simulated", GunParameters(drive_off="open"), clock=clock)
    opened.arm()
    assert opened.fire(a_shot()).home_predicted_s == pytest.approx(100.162476, abs=1e-6)
    own = open_gun("simulated", {"buzz": VibrationParameters(duration_s=0.1)}, clock=clock)
    own.arm()
    assert own.fire(a_shot("buzz", Effect(effect=1))).home_predicted_s == 100.1


def test_a_serial_port_that_is_not_there_is_a_link_error_that_names_it():
    with pytest.raises(LinkError, match=r"cannot open /dev/no-such-port"):
        open_gun("serial:/dev/no-such-port")


@pytest.mark.slow
@pytest.mark.parametrize("address", ["", "usb", "Simulated", "COM3"])
def test_an_address_of_another_form_is_refused_with_the_forms(address):
    with pytest.raises(ValueError, match=r'"simulated" or "serial:PORT"'):
        open_gun(address)
