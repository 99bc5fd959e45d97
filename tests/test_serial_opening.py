"""How a gun on a line is found and greeted: by its identity and version, whatever else is on the ports."""

import os
import threading
import tty
from contextlib import suppress
from dataclasses import replace

import pytest
import serial

from device import LinkError, open_gun
from device.serial_gun.gun import find_gun, parse
from device.twin.core import IDENTITY
from tests.twins import a_twin


def test_a_gun_of_another_version_is_refused_by_name(tmp_path):
    message = r"haptic-gun TWIN-1 .*version 3 .*version 1"
    with a_twin(tmp_path, identity=replace(IDENTITY, wire=3)) as (_, socket), pytest.raises(LinkError, match=message):
        open_gun(f"serial:{socket.address}")


@pytest.mark.slow
def test_a_gun_is_found_by_what_answers_not_by_the_order_of_ports(tmp_path, monkeypatch):
    monkeypatch.setattr("device.serial_gun.gun.PROBE_S", 1.5)  # a busy machine is no silent gun
    for name in ("a", "b", "c"):
        (tmp_path / name).mkdir()
    silent, deaf = os.openpty()
    tty.setraw(deaf)
    ports = [os.ttyname(deaf), "/dev/no-such-port"]
    other = replace(IDENTITY, serial="TWIN-2")
    with a_twin(tmp_path / "a") as (_, one), a_twin(tmp_path / "b", identity=other) as (_, two):
        for order in ([*ports, one.address], [one.address, *ports]):
            assert find_gun(order) == one.address
        assert find_gun([one.address, two.address], serial="TWIN-2") == two.address
        with pytest.raises(LinkError, match=r"more than one.*TWIN-1 at .*TWIN-2 at "):
            find_gun([one.address, two.address])
    with pytest.raises(LinkError, match="no gun answers; looked at /dev/pts"):
        find_gun(ports)
    with pytest.raises(LinkError, match="the system shows none"):
        find_gun([])
    os.close(silent)
    os.close(deaf)


@pytest.mark.slow
@pytest.mark.parametrize(
    "babble", [b"\x00\xff<0001 \n", b"Recoil,a,b,wire 1\n", b"<0001 OK~00000000\n" * 50, b"A" * 3000]
)
def test_a_port_that_babbles_is_a_link_error_in_the_end(babble, monkeypatch):
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
    with pytest.raises(LinkError, match=os.ttyname(port)):
        open_gun(f"serial:{os.ttyname(port)}")
    assert thread.is_alive()  # it babbles on, and was not waited for
    over.set()
    thread.join()
    os.close(peer)
    os.close(port)


@pytest.mark.parametrize("address", ["serial:/dev/x?speed=0", "serial:/dev/x?speed=nan", "serial:/dev/x?speed=fast"])
def test_an_impossible_speed_is_refused(address):
    with pytest.raises(ValueError, match="speed is"):
        parse(address)
    assert parse("serial:auto").port == parse("serial:").port == ""


def test_a_port_that_is_not_there_is_named_once_with_the_systems_reason(tmp_path):
    with pytest.raises(LinkError) as refused:
        open_gun(f"serial:{tmp_path}/gun")
    assert str(refused.value) == f"serial:{tmp_path}/gun: cannot open {tmp_path}/gun: No such file or directory"


def test_a_port_that_another_program_has_open_is_said_to_be_so():
    peer, port = os.openpty()
    with serial.Serial(os.ttyname(port), exclusive=True), pytest.raises(LinkError) as refused:
        open_gun(f"serial:{os.ttyname(port)}")
    assert "another program, or another run, has it open: close that first" in str(refused.value)
    os.close(peer)
    os.close(port)
