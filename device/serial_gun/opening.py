"""From an address to the gun that answers there: a port that is named, or found by what answers."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from device.methods import Method
from device.serial_gun.gun import SerialGun
from device.serial_gun.line import OpenPort, SerialPort
from device.serial_gun.link import Link
from device.wire.records import Named, Splitter
from device.words import LinkError

SCHEME = "serial:"
MAX_SPEED = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """A port by path, name or pyserial's URL; empty means: look for the gun. `speed` is that of a twin in a hurry."""

    port: str
    speed: float = 1.0


def parse(address: str) -> Address:
    """The address behind `serial:`, `serial:auto`, `serial:PORT` or `serial:PORT?speed=50`. `ValueError`: another form.

    >>> parse("serial:/dev/ttyACM0")
    Address(port='/dev/ttyACM0', speed=1.0)
    """
    if not address.startswith(SCHEME):
        raise ValueError(f"address is {address!r}; it must begin with {SCHEME}")
    port, mark, speed = address.removeprefix(SCHEME).partition("?speed=")
    return Address(port="" if port == "auto" else port, speed=_speed(speed) if mark else 1.0)


def speed_of(address: str) -> float | None:
    """How many times faster than the world a serial gun's clock goes; None if the address is no serial gun's."""
    return parse(address).speed if address.startswith(SCHEME) else None


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0 < speed <= MAX_SPEED:
        raise ValueError(f"speed is {text!r}; it must be a number above 0 and at most {MAX_SPEED:g}")
    return speed


PROBE_S = 0.4


def system_ports() -> list[str]:
    """The serial ports that the system knows."""
    from serial.tools import list_ports  # noqa: PLC0415 - wanted only where a gun is looked for

    return sorted(port.device for port in list_ports.comports())


def find_gun(ports: Iterable[str], serial: str | None = None, open_port: OpenPort = SerialPort) -> str:
    """The port at which a gun answers, the one with this serial number if it is given.

    `LinkError` names what was found if that is no gun or more than one. Each port is sent `*IDN?` and nothing else.
    """
    looked = list(ports)
    found = {port: named for port in looked if (named := probe(port, open_port)) and serial in {None, named.serial}}
    if len(found) == 1:
        return next(iter(found))
    if found:
        guns = ", ".join(f"{named.serial} at {port}" for port, named in found.items())
        raise LinkError(f"more than one gun answers: {guns}; choose one with --gun serial:PORT")
    wanted = f"gun {serial}" if serial else "gun"
    raise LinkError(
        f"no {wanted} answers; looked at {', '.join(looked) or 'no port: the system shows none'}; "
        "check power and cable, or name its port with --gun serial:PORT (a twin's is never looked for)"
    )


def probe(port: str, open_port: OpenPort = SerialPort) -> Named | None:
    """Who answers at a port, if it is a gun."""
    try:
        line = open_port(port)
    except LinkError:  # in use, or not ours to open
        return None
    try:
        line.write(b"\n*IDN?\n")
        splitter, end_s = Splitter(), time.monotonic() + PROBE_S
        while time.monotonic() < end_s:
            for answer in splitter.feed(line.read()):
                if answer and answer.startswith(b"Recoil,"):
                    return Named.parse(answer.decode("latin-1"))
    except LinkError:
        return None
    finally:
        line.close()
    return None


OPEN_S = 5.0


def open_serial(address: str, methods: Mapping[str, Method], clock: Callable[[], float]) -> SerialGun:
    """The gun at an address of the form `serial:...`. `ValueError`: another form; `LinkError`: no gun there."""
    where = parse(address)
    known: list[str] = []  # the serial number, once a gun was found

    def look() -> str:
        return where.port or find_gun(system_ports(), known[0] if known else None)

    link = Link(look, clock, where.speed)
    try:
        link.start(OPEN_S)
    except LinkError as error:
        raise LinkError(f"{address}: {error}") from error
    gun = SerialGun(link, methods, clock, where.speed)
    known.append(gun.identify().serial)
    return gun
