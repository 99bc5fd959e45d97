"""Which port the gun is at: by what answers there, never by the order of ports."""

from __future__ import annotations

import time
from collections.abc import Iterable

from device.serial_gun.port import OpenPort, SerialPort
from device.wire.frame import Splitter
from device.wire.records import Named
from device.words import LinkError

PROBE_S = 0.4


def system_ports() -> list[str]:
    """The serial ports that the system knows."""
    from serial.tools import list_ports  # noqa: PLC0415 - wanted only where a gun is looked for

    return sorted(port.device for port in list_ports.comports())


def find(ports: Iterable[str], serial: str | None = None, open_port: OpenPort = SerialPort) -> str:
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
