"""Machine, clock, disk and the gun's link, measured in this process."""

from __future__ import annotations

import os
import platform
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from importlib import metadata
from itertools import pairwise
from pathlib import Path

from device import open_gun
from device.serial_gun.gun import speed_of
from experiments.clock import RealClock
from experiments.doctor.figures import Adapter, Appends, GunLine, Machine, Ticks, spread
from experiments.record import storage
from experiments.record.provenance import recoil_version
from experiments.runner import gun_name
from experiments.study.folders import PlaceError

PACKAGES = ("numpy", "scipy", "PyQt6", "psychopy")
READINGS = 20_000
SLEEPS = 200
APPENDS = 200
ENOUGH_S = 5.0
"""Repeating something slow ends then, with fewer repetitions."""

_LINE = b"x" * 499 + b"\n"
"""About as long as a record of a journal."""


def machine() -> Machine:
    """This machine. Packages are looked up, not imported."""
    versions = {name: _version(name) for name in PACKAGES}
    return Machine(
        system=f"{platform.system()} {platform.release()} {platform.machine()}",
        python=platform.python_version(),
        cores=os.cpu_count() or 1,
        versions={"recoil": recoil_version(), **versions},
    )


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def ticks() -> Ticks:
    """The monotonic clock, and how much longer a sleep of 1 ms is."""
    readings = [time.monotonic() for _ in range(READINGS)]
    return Ticks(
        resolution_s=time.get_clock_info("monotonic").resolution,
        smallest_step_s=min(later - sooner for sooner, later in pairwise(readings) if later > sooner),
        oversleep_ms=spread([ms - 1.0 for ms in timed_ms(SLEEPS, lambda: time.sleep(0.001))]),
    )


def timed_ms(count: int, act: Callable[[], object]) -> list[float]:
    """How long an act takes each time, in milliseconds; fewer times if it is slow."""
    times, end_s = list[float](), time.monotonic() + ENOUGH_S
    while len(times) < count and (not times or time.monotonic() < end_s):
        start_s = time.monotonic()
        act()
        times.append(1000 * (time.monotonic() - start_s))
    return times


def appends(folder: Path) -> Appends:
    """Lines appended and synced in a folder, which is made if need be. Leaves nothing. `OSError` if it takes none."""
    with _folder(folder), _file(folder / f".doctor-{os.getpid()}") as descriptor:
        times = timed_ms(APPENDS, lambda: _append(descriptor))
        return Appends(append_ms=spread(times), free_bytes=shutil.disk_usage(folder).free)


def _append(descriptor: int) -> None:
    storage.write_all(descriptor, _LINE)
    storage.sync(descriptor)


@contextmanager
def _folder(folder: Path) -> Iterator[None]:
    """A folder that is there meanwhile; what had to be made for it is taken away again."""
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        storage.make_folder(folder)
        yield
    finally:
        for path in made:
            with suppress(OSError):  # never made, or somebody put something in it by now
                path.rmdir()


@contextmanager
def _file(path: Path) -> Iterator[int]:
    """A new file to append to, gone afterwards."""
    descriptor = storage.create(path)
    try:
        yield descriptor
    finally:
        os.close(descriptor)
        path.unlink(missing_ok=True)


ROUND_TRIPS = 200
ADAPTERS = Path("/sys/bus/usb-serial/devices")
"""Where Linux shows them; nowhere else."""


def gun_line(address: str) -> GunLine:
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
    return GunLine(gun=name, state=status.state, fault=status.fault, round_trip_ms=spread(times))


def adapters(folder: Path = ADAPTERS) -> list[Adapter]:
    """The USB serial adapters that have a latency timer."""
    return list(_adapters(folder))


def _adapters(folder: Path) -> Iterator[Adapter]:
    for setting in sorted(folder.glob("*/latency_timer")):
        with suppress(OSError, ValueError):  # pulled out just now
            latency_ms = int(setting.read_text(encoding="ascii"))
            yield Adapter(name=setting.parent.name, setting=str(setting), latency_ms=latency_ms)
