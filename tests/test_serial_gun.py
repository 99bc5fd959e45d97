"""The gun over a serial line, against its twin on a real pseudo-terminal: each shot once, or said what may be so."""

import os
import threading
import time
import tty
from contextlib import suppress
from dataclasses import replace

import pytest

from device import Effect, LimitError, LinkError, Pulse, open_gun
from device.limits import AMBIENT_C, DriveHistory
from device.methods import paper_methods
from device.parameters import GunParameters, VibrationParameters
from device.serial_gun.address import parse
from device.serial_gun.asked import FLOORS_US, asked
from device.serial_gun.find import find
from device.serial_gun.gun import open_serial
from device.serial_gun.link import Link
from device.serial_gun.outcomes import Disconnected
from device.serial_gun.port import SerialPort
from device.simulated import SimulatedGun
from device.twin import budget
from tests.twins import IDENTITY, PULSE, Troubles, a_pair, a_shot, a_twin

ALL = Troubles(lose=0.02, double=0.02, corrupt=0.02, partial=0.02, jitter_s=0.002)


@pytest.fixture
def pair(tmp_path):
    with a_pair(tmp_path) as pair:
        yield pair


def said(gun, *headers):
    """What was written since, but for the exchanges that keep the line alive."""
    return [command.body for command in gun.link.commands if command.body.split()[0] in headers]


def test_it_is_born_disarmed_and_says_who_it_is(pair):
    identity = pair.gun.identify()
    assert (identity.model, identity.serial, identity.version) == ("haptic-gun", "TWIN-1", "1.0.0")
    status = pair.gun.status()
    assert (status.state, status.shots, status.fault) == ("disarmed", 0, None)
    assert status.coil_temperature_C == AMBIENT_C
    with pytest.raises(LimitError, match="disarmed"):
        pair.gun.fire(a_shot())


@pytest.mark.parametrize("tcp", [False, True])
def test_a_shot_is_reported_on_the_hosts_clock_to_a_millisecond(tmp_path, tcp):
    with a_pair(tmp_path, Troubles(jitter_s=0.005), speed=1.0, tcp=tcp, drift_ppm=80.0) as pair:
        pair.wait(lambda: len(pair.gun.link.commands) >= 10)
        for _ in range(40):
            with_jitter = pair.gun.link.ask("TIME?")
            assert with_jitter.received_s > with_jitter.written_s
        pair.ready()
        report = pair.gun.fire(a_shot())
        (true,) = pair.twin.body.ledger
        timing = report.timing
        assert abs(report.pulse_start_s - true.start_s) < 0.001
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


def test_a_train_is_fired_at_its_ticks_and_never_too_soon(pair):
    pair.ready()
    first = pair.gun.fire(a_shot())
    for shot in range(1, 6):
        report = pair.gun.fire(a_shot(), at_s=first.pulse_start_s + shot * 2.0)
        assert report.pulse_start_s - first.pulse_start_s == pytest.approx(shot * 2.0, abs=0.02)
    assert not any(true.too_soon for true in pair.twin.body.ledger)
    with pytest.raises(LimitError, match="not home yet"):
        pair.gun.fire(a_shot())


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
    pair.gun.link.commands.clear()
    with pytest.raises(LimitError, match=message):
        pair.gun.fire(shot())
    assert said(pair.gun, "CONF", "TRIG") == []
    assert pair.twin.body.ledger == []


def test_too_soon_and_too_hot_are_refused_before_a_byte_is_written(pair):
    pair.ready()
    pair.gun.fire(a_shot("asymmetric-1"))
    pair.gun.link.commands.clear()
    with pytest.raises(LimitError, match="not home yet"):
        pair.gun.fire(a_shot("asymmetric-2"))
    pair.gun._history = DriveHistory(warmth_K=60.0, warmth_tick=round(pair.clock() * 1e6))
    assert pair.gun.status().coil_temperature_C == pytest.approx(85.0, abs=1.0)
    with pytest.raises(LimitError, match="limit 80 degC"):
        pair.gun.fire(a_shot("asymmetric-2", drive=Pulse(voltage_V=24.0, pulse_s=0.020)))
    assert said(pair.gun, "CONF", "TRIG") == []
    assert len(pair.twin.body.ledger) == 1


def test_a_method_whose_name_cannot_be_said_is_refused(tmp_path):
    with pytest.raises(LimitError, match="on the wire"):
        asked(a_shot("Vibration", drive=Effect(effect=1)), {"Vibration": VibrationParameters()})
    weak = asked(a_shot("weak", drive=Pulse(voltage_V=0.00012, pulse_s=0.001)), {"weak": GunParameters()})
    assert (weak.setting.amount, weak.setting.rest_us) == (0, 50_000)
    assert FLOORS_US == budget.FLOOR_US


def test_a_gun_of_another_version_is_refused_by_name(tmp_path):
    message = r"haptic-gun TWIN-1 .*version 3 .*version 1"
    with a_twin(tmp_path, identity=replace(IDENTITY, wire=3)) as (_, socket), pytest.raises(LinkError, match=message):
        open_gun(f"serial:{socket.address}")


def test_a_gun_is_found_by_what_answers_not_by_the_order_of_ports(tmp_path):
    for name in ("a", "b", "c"):
        (tmp_path / name).mkdir()
    silent, deaf = os.openpty()
    tty.setraw(deaf)
    ports = [os.ttyname(deaf), "/dev/no-such-port"]
    other = replace(IDENTITY, serial="TWIN-2")
    with a_twin(tmp_path / "a") as (_, one), a_twin(tmp_path / "b", identity=other) as (_, two):
        for order in ([*ports, one.address], [one.address, *ports]):
            assert find(order) == one.address
        assert find([one.address, two.address], serial="TWIN-2") == two.address
        with pytest.raises(LinkError, match=r"more than one.*TWIN-1 at .*TWIN-2 at "):
            find([one.address, two.address])
    with pytest.raises(LinkError, match="no gun answers; looked at /dev/pts"):
        find(ports)
    with pytest.raises(LinkError, match="the system shows none"):
        find([])
    os.close(silent)
    os.close(deaf)


@pytest.mark.parametrize(
    "babble", [b"\x00\xff<0001 \n", b"Recoil,a,b,wire 1\n", b"<0001 OK~00000000\n" * 50, b"A" * 3000]
)
def test_a_port_that_babbles_is_a_link_error_in_bounded_time(babble, monkeypatch):
    monkeypatch.setattr("device.serial_gun.gun.OPEN_S", 1.5)
    peer, port = os.openpty()
    tty.setraw(port)
    os.set_blocking(peer, False)
    over = threading.Event()

    def talk():
        while not over.wait(0.001):
            with suppress(BlockingIOError):
                os.write(peer, babble)

    thread = threading.Thread(target=talk)
    thread.start()
    start_s = time.monotonic()
    with pytest.raises(LinkError, match=os.ttyname(port)):
        open_gun(f"serial:{os.ttyname(port)}")
    assert time.monotonic() - start_s < 3
    over.set()
    thread.join()
    os.close(peer)
    os.close(port)


@pytest.mark.parametrize("address", ["serial:/dev/x?speed=0", "serial:/dev/x?speed=nan", "serial:/dev/x?speed=fast"])
def test_an_impossible_speed_is_refused(address):
    with pytest.raises(ValueError, match="speed is"):
        parse(address)
    assert parse("serial:auto").port == parse("serial:").port == ""


def test_disarming_from_another_thread_cuts_a_shot_that_waits(pair):
    pair.ready()
    outcome = []

    def fire():
        try:
            pair.gun.fire(a_shot(), at_s=pair.clock() + 1.9)
        except LinkError as error:
            outcome.append(str(error))

    thread = threading.Thread(target=fire)
    thread.start()
    time.sleep(0.02)
    pair.gun.disarm()
    thread.join()
    assert outcome == ["the gun refused TRIG: Cancelled"]
    assert pair.twin.body.ledger == []
    assert pair.gun.status().state == "disarmed"


def test_an_abandoned_gun_is_disarmed_by_its_watchdog(tmp_path):
    with a_twin(tmp_path, speed=1.0) as (twin, socket):
        gun = open_serial(f"serial:{socket.address}", paper_methods(), time.monotonic)
        gun.arm()
        gun.link._closing.set()  # the host dies: nothing is said any more, and nothing is said about it
        gun.link._thread.join()
        start_s = time.monotonic()
        assert twin._core.machine.state == "ARMED"
        while twin._core.machine.state == "ARMED":
            assert time.monotonic() < start_s + gun.link.watchdog_s + 0.1
            time.sleep(0.005)
        assert twin._core.machine.state == "DISARMED"


def test_disarming_a_gun_that_is_gone_takes_no_longer_than_its_watchdog(tmp_path):
    with a_pair(tmp_path, Troubles(replug_s=30.0), speed=1.0) as pair:
        pair.gun.arm()
        pair.twin.order(pair.twin.unplug)
        start_s = time.monotonic()
        pair.gun.disarm()
        assert 0.5 < time.monotonic() - start_s < pair.gun.link.watchdog_s + 0.3
        assert pair.twin._core.machine.state == "DISARMED"


@pytest.mark.parametrize("tcp", [False, True])
def test_unplugged_between_shots_it_goes_on_after_replugging(tmp_path, tcp):
    with a_pair(tmp_path, Troubles(replug_s=0.1), tcp=tcp) as pair:
        pair.ready()
        pair.gun.fire(a_shot())
        pair.twin.order(pair.twin.unplug)
        pair.wait(lambda: not pair.gun.link.is_up)
        time.sleep(0.3 / pair.speed)  # the magnet is home
        with pytest.raises(Disconnected, match="not fired"):
            pair.gun.fire(a_shot())
        pair.ready()
        pair.gun.fire(a_shot())
        assert len(pair.twin.body.ledger) == 2


def test_unplugged_in_mid_shot_the_shot_is_found_done(tmp_path):
    with a_pair(tmp_path, Troubles(unplug=1.0, replug_s=0.1), speed=1.0) as pair:
        pair.ready()
        report = pair.gun.fire(a_shot())
        (true,) = pair.twin.body.ledger
        assert pair.twin.accidents == ["unplug"]
        assert abs(report.pulse_start_s - true.start_s) < 0.001
        assert report.timing.acknowledged_s - report.pulse_end_s > 0.05


def test_unplugged_in_mid_answer_nothing_is_lost_and_nothing_done_twice(tmp_path):
    with a_pair(tmp_path, Troubles(replug_s=0.05)) as pair:
        object.__setattr__(pair.twin._make, "troubles", Troubles(replug_s=0.05, unplug_reply=0.1))
        done, troubles = 0, []
        for _ in range(20):
            try:
                pair.ready()
                pair.gun.fire(a_shot())
                done += 1
            except LinkError as error:
                troubles.append(str(error))
        unsure = [trouble for trouble in troubles if "may have been fired" in trouble]
        assert pair.twin.accidents
        assert 5 < done <= len(pair.twin.body.ledger) <= done + len(unsure)


def test_a_gun_that_is_reset_in_mid_shot_cannot_tell_and_the_error_says_so(tmp_path):
    with a_pair(tmp_path, Troubles(reset=1.0), speed=1.0) as pair:
        pair.ready()
        with pytest.raises(LinkError, match="may have been fired"):
            pair.gun.fire(a_shot())
        pair.gun.disarm()
        pair.wait(lambda: pair.gun.link.is_up)
        assert pair.gun.status().shots == 0
        assert len(pair.twin.body.ledger) == 1
        pair.gun.arm()
        with pytest.raises(LimitError, match="not home yet"):  # the host remembers what the gun forgot
            pair.gun.fire(a_shot())


def test_a_reset_is_not_forgotten_when_the_first_greeting_after_it_breaks_off(tmp_path):
    breaks = threading.Event()

    class BreakingPort(SerialPort):
        def write(self, data):
            if breaks.is_set() and b"TIME?" in data:
                breaks.clear()
                raise Disconnected("broken off in mid-greeting")
            super().write(data)

    with a_twin(tmp_path, speed=1.0) as (twin, socket):
        link = Link(lambda: socket.address, time.monotonic, open_port=BreakingPort)
        link.start(5.0)
        session = link.session
        twin.order(twin.reset)
        link.drop("to see the greeting break off")
        breaks.set()
        link.wait_up(5.0)
        while link.session == session:
            time.sleep(0.005)
        assert not breaks.is_set()
        assert not link.remembers
        link.close()


def test_a_pulse_that_does_not_end_is_cut_and_marked(tmp_path):
    with a_pair(tmp_path, Troubles(busy=1.0), speed=1.0) as pair:
        pair.ready()
        with pytest.raises(LinkError, match="fired and cut short"):
            pair.gun.fire(a_shot())
        (true,) = pair.twin.body.ledger
        assert true.end_s - true.start_s < 1.0
        assert pair.gun.status().state == "disarmed"


def test_a_trigger_that_was_held_up_does_not_fire_late(tmp_path):
    with a_pair(tmp_path, speed=1.0) as pair:
        pair.ready()
        pair.gun.fire(a_shot())  # so that it is set already
        pair.ready()
        pair.twin._hangs_until_s = time.monotonic() + 0.4
        try:
            report = pair.gun.fire(a_shot())
        except LinkError as error:
            assert "not fired" in str(error)  # noqa: PT017 - either is right
            assert len(pair.twin.body.ledger) == 1
        else:
            _, true = pair.twin.body.ledger
            assert abs(report.pulse_start_s - true.start_s) < 0.01
            assert report.timing.asked > 1
        late = [c for c in pair.gun.link.commands if c.body.startswith("TRIG")]
        assert late[1].outcome == "timed out"


def test_on_a_bad_line_every_shot_is_done_once_or_marked(tmp_path):
    with a_pair(tmp_path) as pair:
        object.__setattr__(pair.twin._make, "troubles", ALL)
        done, marked = [], 0
        for number in range(60):
            way = ("forward", "backward")[number % 2]
            try:
                pair.ready()
                done.append((way, pair.gun.fire(a_shot(direction=way))))
            except LinkError:
                marked += 1
        assert len(pair.twin.body.ledger) <= len(done) + marked
        for way, report in done:
            (true,) = [t for t in pair.twin.body.ledger if abs(t.start_s - report.pulse_start_s) < 0.1]
            assert true.way == {"forward": "FORW", "backward": "BACK"}[way]
        assert len(done) > 40
        assert {command.outcome for command in pair.gun.link.commands} >= {"done", "timed out", "garbled"}


def test_every_command_has_its_outcome_and_its_time(pair):
    pair.ready()
    pair.gun.fire(a_shot())
    for command in pair.gun.link.commands:
        assert command.outcome == "done"
        assert command.ended_s >= command.written_s
    assert said(pair.gun, "CONF") == ["CONF asymmetric-2,FORW,PULS,16000,10000,211005"]


def test_a_closed_gun_is_disarmed_and_its_port_free(pair):
    pair.gun.close()
    pair.gun.close()
    for ask in (pair.gun.identify, pair.gun.arm, lambda: pair.gun.fire(a_shot())):
        with pytest.raises(LinkError, match="closed"):
            ask()
    assert pair.gun.status().state == "disarmed"
    assert not pair.twin._core.strict
    again = open_gun(f"serial:{pair.socket.address}", clock=time.monotonic)
    again.close()
