"""The gun over a serial line, against its twin on a real pseudo-terminal: each shot once, or said what may be so."""

import threading
import time

import pytest

from device import Effect, LimitError, LinkError, Pulse, open_gun
from device.limits import AMBIENT_C, DriveHistory
from device.methods import paper_methods
from device.parameters import GunParameters, VibrationParameters
from device.serial_gun.reports import FLOORS_US, asked
from device.simulated import SimulatedGun
from device.twin import machine
from tests.twins import PULSE, SLOW, Troubles, a_pair, a_shot, said
from tests.waiting import wait_for


@pytest.fixture
def pair(tmp_path):
    with a_pair(tmp_path) as pair:
        yield pair


@pytest.fixture
def slow_pair(tmp_path):
    """A twin that lives slower than the world: the magnet is still out when a slow machine asks again."""
    with a_pair(tmp_path, speed=SLOW, rested=True) as pair:
        yield pair


def test_it_is_born_disarmed_and_says_who_it_is(pair):
    identity = pair.gun.identify()
    assert (identity.model, identity.serial, identity.version) == ("haptic-gun", "TWIN-1", "1.1.0")
    status = pair.gun.status()
    assert (status.state, status.shots, status.fault) == ("disarmed", 0, None)
    assert status.coil_temperature_C == AMBIENT_C
    with pytest.raises(LimitError, match="disarmed"):
        pair.gun.fire(a_shot())


@pytest.mark.slow
@pytest.mark.parametrize("tcp", [False, True])
def test_a_shot_is_reported_on_the_hosts_clock_to_within_its_bound(tmp_path, tcp):
    with a_pair(tmp_path, Troubles(jitter_s=0.005), speed=1.0, tcp=tcp, drift_ppm=80.0) as pair:
        wait_for(lambda: len(pair.commands) >= 10)
        for _ in range(40):
            with_jitter = pair.gun.link.ask("TIME?")
            assert with_jitter.received_s > with_jitter.written_s
        pair.ready()
        report = pair.gun.fire(a_shot())
        (true,) = pair.twin.body.ledger
        timing = report.timing
        assert abs(report.pulse_start_s - true.start_s) <= timing.uncertainty_s + 5e-6
        assert report.pulse_end_s - report.pulse_start_s == pytest.approx(0.010, abs=1e-4)
        assert timing.requested_s <= timing.written_s <= timing.accepted_s + timing.uncertainty_s
        assert timing.pulse_end_s <= timing.acknowledged_s + timing.uncertainty_s
        assert timing.gun_end_us - timing.gun_start_us == 10_000


def test_all_methods_and_ways_are_rendered_as_the_simulated_gun_says(pair):
    simulated = SimulatedGun(paper_methods(), lambda: 0.0)
    for method, direction in (("vibration", "backward"), ("asymmetric-1", "forward"), ("asymmetric-2", "backward")):
        shot = a_shot(method, direction, Effect(effect=1) if method == "vibration" else PULSE)
        pair.ready()
        report = pair.gun.fire(shot)
        simulated = SimulatedGun(paper_methods(), lambda: 0.0)
        simulated.arm()
        wanted = simulated.fire(shot)
        assert (report.shot, report.motion) == (wanted.shot, wanted.motion)
        home_s = report.home_predicted_s - report.pulse_start_s
        assert home_s == pytest.approx(wanted.home_predicted_s, abs=1e-5)
        driven_s = report.pulse_end_s - report.pulse_start_s
        assert driven_s == pytest.approx(wanted.pulse_end_s, abs=1e-4)
        true = pair.twin.body.ledger[-1]
        assert (true.method, true.way) == (method, "FORW" if direction == "forward" else "BACK")


@pytest.mark.slow
def test_a_trains_shots_are_whole_ticks_of_the_guns_clock_apart_and_never_too_soon(tmp_path):
    with a_pair(tmp_path, Troubles(jitter_s=0.003), speed=0.25, rested=True, drift_ppm=80.0) as pair:
        pair.ready()
        first = pair.gun.fire(a_shot())
        ticks = []
        for shot in range(1, 6):
            report = pair.gun.fire(a_shot(), first.pulse_start_s + shot * 0.75)
            ticks.append(report.timing.gun_start_us - first.timing.gun_start_us)
        assert ticks == [750_000 * shot for shot in range(1, 6)]
        assert not any(true.too_soon for true in pair.twin.body.ledger)
        pair.gun.clock = lambda: report.pulse_end_s
        with pytest.raises(LimitError, match="not home yet"):
            pair.gun.fire(a_shot(), report.pulse_start_s + 0.2)


@pytest.mark.parametrize(
    ("ahead_s", "rule"),
    [(2.001, "at most 2 s ahead"), (float("nan"), "a finite time"), (float("inf"), "a finite time")],
)
def test_a_shot_too_far_ahead_is_refused_before_a_byte_is_written(slow_pair, ahead_s, rule):
    pair = slow_pair
    pair.ready()
    pair.commands.clear()
    with pytest.raises(LimitError, match=rule):
        pair.gun.fire(a_shot(), pair.clock() + ahead_s + 0.5)  # five seconds of the world
    assert said(pair, "CONF", "TRIG") == []


@pytest.mark.slow
def test_a_shot_that_waits_and_whose_answer_is_lost_is_looked_for_until_it_has_ended(slow_pair):
    pair = slow_pair
    pair.ready()
    write, lost = pair.socket.write, []

    def lose(data):
        if data.startswith(b"<") and b" SHOT " in data and not lost:
            lost.append(data)
        else:
            write(data)

    pair.socket.write = lose
    at_s, (now,) = pair.clock() + 0.2, pair.gun.link.host(pair.twin.clock_us())
    report = pair.gun.fire(a_shot(), at_s)
    (true,) = pair.twin.body.ledger
    assert len(lost) == 1
    assert abs(true.start_s - at_s) <= now.uncertainty_s + 1e-4
    assert abs(report.pulse_start_s - true.start_s) <= report.timing.uncertainty_s + 5e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shot", "message"),
    [
        (lambda: a_shot("recoil"), "renders"),
        (lambda: a_shot("vibration"), "driven by"),
        (lambda: a_shot(drive=Effect(effect=1)), "driven by"),
        (lambda: a_shot(drive=Pulse(voltage_V=24.5, pulse_s=0.010)), "24"),
        (lambda: a_shot(drive=Pulse(voltage_V=16.0, pulse_s=0.021)), r"0\.02"),
    ],
)
def test_what_is_beyond_a_limit_is_refused_before_a_byte_is_written(pair, shot, message):
    pair.ready()
    pair.commands.clear()
    with pytest.raises(LimitError, match=message):
        pair.gun.fire(shot())
    assert said(pair, "CONF", "TRIG") == []
    assert pair.twin.body.ledger == []


def test_too_soon_and_too_hot_are_refused_before_a_byte_is_written(slow_pair):
    slow_pair.ready()
    report = slow_pair.gun.fire(a_shot("asymmetric-1"))
    slow_pair.commands.clear()
    slow_pair.gun.clock = lambda: report.pulse_end_s
    with pytest.raises(LimitError, match="not home yet"):
        slow_pair.gun.fire(a_shot("asymmetric-2"))
    slow_pair.gun.history = DriveHistory(warmth_K=60.0, warmth_tick=round(report.pulse_end_s * 1e6))
    assert slow_pair.gun.status().coil_temperature_C == pytest.approx(85.0, abs=1.0)
    with pytest.raises(LimitError, match="limit 80 degC"):
        slow_pair.gun.fire(a_shot("asymmetric-2", drive=Pulse(voltage_V=24.0, pulse_s=0.020)))
    assert said(slow_pair, "CONF", "TRIG") == []
    assert len(slow_pair.twin.body.ledger) == 1


def test_a_method_whose_name_cannot_be_said_is_refused(tmp_path):
    with pytest.raises(LimitError, match="on the wire"):
        asked(a_shot("Vibration", drive=Effect(effect=1)), {"Vibration": VibrationParameters()})
    weak = asked(a_shot("weak", drive=Pulse(voltage_V=0.00012, pulse_s=0.001)), {"weak": GunParameters()})
    assert (weak.setting.amount, weak.setting.rest_us) == (0, 50_000)
    assert FLOORS_US == machine.FLOOR_US


def test_disarming_from_another_thread_cuts_a_shot_that_waits(slow_pair):
    pair = slow_pair
    pair.ready()
    outcome = []

    def fire():
        try:
            pair.gun.fire(a_shot(), at_s=pair.clock() + 1.9)
        except LinkError as error:
            outcome.append(str(error))

    thread = threading.Thread(target=fire)
    thread.start()
    wait_for(lambda: pair.twin.core.machine.state == "WAITING")
    pair.gun.disarm()
    thread.join()
    assert outcome == ["not fired: the gun was disarmed meanwhile"]
    assert pair.twin.body.ledger == []
    assert pair.gun.status().state == "disarmed"


def test_every_command_has_its_outcome_and_its_time(pair):
    pair.ready()
    pair.gun.fire(a_shot())
    for command in pair.commands:
        assert command.outcome == "done"
        assert command.received_s >= command.written_s
    assert said(pair, "CONF") == ["CONF asymmetric-2,FORW,PULS,16000,10000,211005"]


def test_a_closed_gun_is_disarmed_and_its_port_free(pair):
    pair.ready()
    pair.gun.fire(a_shot())
    pair.gun.close()
    pair.gun.close()
    for ask in (pair.gun.identify, pair.gun.arm, lambda: pair.gun.fire(a_shot())):
        with pytest.raises(LinkError, match="closed"):
            ask()
    assert (pair.gun.status().state, pair.gun.status().shots) == ("disarmed", 1)
    assert not pair.twin.core.strict
    again = open_gun(f"serial:{pair.socket.address}", clock=time.monotonic)
    assert again.status().shots == 1
    again.close()
    assert again.status().shots == 1
