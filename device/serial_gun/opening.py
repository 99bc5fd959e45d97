"""From an address to the gun that answers there."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from device.methods import Method
from device.serial_gun.address import parse
from device.serial_gun.find import find, system_ports
from device.serial_gun.gun import SerialGun
from device.serial_gun.link import Link
from device.words import LinkError

OPEN_S = 5.0


def open_serial(address: str, methods: Mapping[str, Method], clock: Callable[[], float]) -> SerialGun:
    """The gun at an address of the form `serial:...`. `ValueError`: another form; `LinkError`: no gun there."""
    where = parse(address)
    known: list[str] = []  # the serial number, once a gun was found

    def look() -> str:
        return where.port or find(system_ports(), known[0] if known else None)

    link = Link(look, clock, where.speed)
    try:
        link.start(OPEN_S)
    except LinkError as error:
        raise LinkError(f"{address}: {error}") from error
    gun = SerialGun(link, methods, clock, where.speed)
    known.append(gun.identify().serial)
    return gun
