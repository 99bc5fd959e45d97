"""The gun's link and the USB adapters, measured in this process. Nothing is armed, nothing is fired."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

from device import open_gun
from device.serial_gun.opening import speed_of
from experiments.clock import RealClock
from experiments.doctor.figures import Adapter, Link
from experiments.doctor.measures import timed_ms
from experiments.doctor.spread import spread
from experiments.runner import gun_name
from experiments.study.places import PlaceError

ROUND_TRIPS = 200
ADAPTERS = Path("/sys/bus/usb-serial/devices")
"""Where Linux shows them; nowhere else."""


def link(address: str) -> Link:
    """Ask the gun who it is and how it stands, many times.

    `DeviceError` if it does not answer; `PlaceError` if there is no such form of address.
    """
    try:
        gun = open_gun(address, clock=RealClock(speed_of(address) or 1.0).now)
    except ValueError as error:
        raise PlaceError(f"--gun {address}: {error}") from error
    with closing(gun):
        name = gun_name(gun.identify())
        gun.disarm()
        times = timed_ms(ROUND_TRIPS, gun.status)
        status = gun.status()
    return Link(gun=name, state=status.state, fault=status.fault, round_trip_ms=spread(times))


def adapters(folder: Path = ADAPTERS) -> list[Adapter]:
    """The USB serial adapters that have a latency timer."""
    return list(_adapters(folder))


def _adapters(folder: Path) -> Iterator[Adapter]:
    for setting in sorted(folder.glob("*/latency_timer")):
        with suppress(OSError, ValueError):  # pulled out just now
            latency_ms = int(setting.read_text(encoding="ascii"))
            yield Adapter(name=setting.parent.name, setting=str(setting), latency_ms=latency_ms)
