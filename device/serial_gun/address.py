"""What stands behind `serial:` in a gun's address."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
