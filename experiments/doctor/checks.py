"""The checks in their order, and what they measure in this process. Each has a deadline; none stops another.

Work that may hang is waited for no longer than its deadline. What could crash runs in a child program (`child`).
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import metadata
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

from device import DeviceError, Gun, open_gun
from device.interrupts import begin_aside, interrupts_held, wait_awake
from device.machine_clock import MACHINE_CLOCK, machine_s
from device.methods import Method
from device.parameters import GunParameters
from device.plugin.conformance import ConformanceFinding, OpenedGuns, conformance, rig_at
from device.plugin.door import IMPORT_S, PLUGIN_OPEN_S
from device.plugin.guard import GunLeftOpen, PluginError
from device.serial_gun.gun import SCHEME, speed_of
from device.serial_gun.lines import WrongVersion
from experiments.catalogues.catalogue import language
from experiments.catalogues.fonts import font_for
from experiments.catalogues.messages import NAMED_ANSWERS
from experiments.clock import RealClock
from experiments.config.door import ConfigError
from experiments.doctor import verdicts
from experiments.doctor.child import ProgramReply, ask
from experiments.doctor.figures import (
    Adapter,
    Appends,
    DoctorFinding,
    GunLine,
    Machine,
    SensorFigures,
    Ticks,
    spread,
)
from experiments.doctor.verdicts import Latencies, latencies, pooled
from experiments.record import journal, storage
from experiments.record.journal import JournalError
from experiments.record.names import journals
from experiments.record.provenance import recoil_version
from experiments.screens.display import unset_display
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
    readings = [machine_s() for _ in range(READINGS)]
    return Ticks(
        resolution_s=time.get_clock_info(MACHINE_CLOCK).resolution,
        smallest_step_s=min(later - sooner for sooner, later in pairwise(readings) if later > sooner),
        oversleep_ms=spread([ms - 1.0 for ms in timed_ms(SLEEPS, lambda: time.sleep(0.001))]),
    )


def timed_ms(count: int, act: Callable[[], object]) -> list[float]:
    """How long an act takes each time, in milliseconds; fewer times if it is slow."""
    times, end_s = list[float](), machine_s() + ENOUGH_S
    while len(times) < count and (not times or machine_s() < end_s):
        start_s = machine_s()
        act()
        times.append(1000 * (machine_s() - start_s))
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


def gun_line(opened: Callable[[], Gun]) -> GunLine:
    """Ask a gun who it is and how it stands, many times. `DeviceError` if it does not answer."""
    with closing(opened()) as gun:
        name = gun.identify().name
        gun.disarm()
        times = timed_ms(ROUND_TRIPS, gun.status)
        status = gun.status()
        jumps: int = getattr(gun, "clock_jumps", 0)
    return GunLine(gun=name, state=status.state, fault=status.fault, round_trip_ms=spread(times), clock_jumps=jumps)


def adapters(folder: Path = ADAPTERS) -> list[Adapter]:
    """The USB serial adapters that have a latency timer."""
    return list(_adapters(folder))


def _adapters(folder: Path) -> Iterator[Adapter]:
    for setting in sorted(folder.glob("*/latency_timer")):
        with suppress(OSError, ValueError):  # pulled out just now
            latency_ms = int(setting.read_text(encoding="ascii"))
            yield Adapter(name=setting.parent.name, setting=str(setting), latency_ms=latency_ms)


DEADLINE_S = 20.0
PSYCHOPY_DEADLINE_S = 60.0
"""Its import alone takes 6 to 9 s on a disk that has it in memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing to look at."""

    name: str
    look: Callable[[], tuple[DoctorFinding, ...]]


class GunLeftArmed(PlaceError):  # noqa: N818 - what is so
    """A gun may be armed still: nothing that could be looked at besides is as urgent. `found` is what was till then."""

    def __init__(self, address: str, why: str) -> None:
        super().__init__(f"--gun {address}: {why}")
        self.why = why
        self.found: tuple[DoctorFinding, ...] = (verdicts.of_failure("gun", why),)


@dataclass(frozen=True, slots=True, kw_only=True)
class LanguageAsked:
    """A participant's language to look at, and where else there are catalogues."""

    code: str
    folder: Path | None = None


def checks(
    results: Path,
    gun: str,
    limit_s: float,
    *,
    shots: int = 0,
    sensor: str = "",
    methods: Mapping[str, Method] | None = None,
    asked: LanguageAsked | None = None,
) -> tuple[Check, ...]:
    """What there is to look at, for a results folder and a gun's address; `limit_s` is its line's, there and back.

    With `shots` the gun is fired by each of its `methods` (the paper's, unless they are given), in so many trials:
    nobody is to hold it. Of a `sensor` it is looked at how soon it would see a change of the friction of the method
    that is damped most.
    """
    looks: dict[str, Callable[[], tuple[DoctorFinding, ...]]] = {
        "machine": lambda: (verdicts.of_machine(machine()),),
        "clock": lambda: (verdicts.of_clock(ticks()),),
        "disk": partial(_disk, results),
        "gun": partial(_gun, gun, limit_s, methods),
        **({"shots": partial(_shots, gun, shots, methods)} if shots else {}),
        **({"sensor": partial(_sensor, sensor, gun, methods)} if sensor else {}),
        "USB adapter": lambda: (verdicts.of_adapters(adapters()),),
        "display": partial(_on_display, "display", "display"),
        "PsychoPy": partial(_on_display, "PsychoPy", "stage", PSYCHOPY_DEADLINE_S),
        "sound": _sound,
        "keyboard": partial(_on_display, "keyboard", "keys"),
        "streams": _streams,
        "console": partial(_console, results),
        **({"language": partial(_language, asked)} if asked is not None else {}),
    }
    return tuple(Check(name=name, look=look) for name, look in looks.items())


def carry_out_check(check: Check) -> tuple[DoctorFinding, ...]:
    """What a check found; that it broke off is a finding too.

    `PlaceError` if it was asked for the impossible; `GunLeftArmed` ends all checks.
    """
    try:
        return check.look()
    except PlaceError:
        raise
    except Exception as error:  # noqa: BLE001 - a rig in trouble is what this is for: the other checks go on
        return (verdicts.of_failure(check.name, _reason(error)),)


def _reason(error: Exception) -> str:
    return (
        str(error)
        if isinstance(error, TimeoutError | DeviceError | ConfigError)
        else f"{type(error).__name__}: {error}"
    )


def _disk(results: Path) -> tuple[DoctorFinding, ...]:
    try:
        return (verdicts.of_disk(within_seconds(DEADLINE_S, partial(appends, results))),)
    except OSError as error:  # a deadline that passed is one as well
        return (verdicts.of_disk_failure(str(results), error.strerror or str(error)),)


def _gun(address: str, limit_s: float, methods: Mapping[str, Method] | None) -> tuple[DoctorFinding, ...]:
    ours = address == "simulated" or address.startswith(SCHEME)
    seconds = DEADLINE_S if ours else DEADLINE_S + IMPORT_S + PLUGIN_OPEN_S
    guns = OpenedGuns(lambda: open_gun(address, methods, clock=RealClock(speed_of(address) or 1.0).now))
    try:
        return (verdicts.of_link(_tried(address, seconds, guns, partial(gun_line, guns.open)), limit_s),)
    except PluginError as error:
        return (verdicts.of_failure("gun", str(error)),)
    except WrongVersion as error:
        return (verdicts.of_wrong_version(str(error)),)
    except (DeviceError, OSError) as error:
        return (verdicts.of_link_failure(str(error)),)


SHOT_S = 1.0
"""A trial takes no longer, and the other checks of the kit no longer than twenty."""


def _shots(address: str, trials: int, methods: Mapping[str, Method] | None) -> tuple[DoctorFinding, ...]:
    """What every gun keeps, tried on this one."""
    try:
        rig = rig_at(address, methods, trials)
    except ValueError as error:
        raise PlaceError(f"--gun {address}: {error}") from error
    guns, found = OpenedGuns(rig.open_gun), list[ConformanceFinding]()
    rig = replace(rig, open_gun=guns.open)
    try:
        _tried(address, (trials + 20) * SHOT_S + DEADLINE_S, guns, lambda: conformance(rig, found.append))
    except TimeoutError as error:
        found.append(ConformanceFinding(check="time", kept=False, said=str(error)))
    except GunLeftArmed as left:
        found.append(ConformanceFinding(check="letting go", kept=False, said=left.why))
        left.found = (verdicts.of_conformance(found),)
        raise
    return (verdicts.of_conformance(found),)


def _tried(address: str, seconds: float, guns: OpenedGuns, work: Callable[[], _Result]) -> _Result:
    """What comes of work with guns, let go of where it is broken off. `GunLeftArmed` names one that is not."""
    try:
        result = within_seconds(seconds, work, guns.let_go)
    except ValueError as error:
        raise PlaceError(f"--gun {address}: {error}") from error
    except GunLeftOpen as error:
        raise GunLeftArmed(address, str(error)) from error
    except KeyboardInterrupt:
        if guns.problem:
            raise GunLeftArmed(address, f"interrupted; {guns.problem}") from None
        raise
    except TimeoutError as error:
        if guns.problem:
            raise GunLeftArmed(address, f"{error}; {guns.problem}") from error
        raise TimeoutError(f"{error}; it was let go of") from error
    guns.let_go()
    if guns.problem:
        raise GunLeftArmed(address, guns.problem)
    return result


def _sensor(address: str, gun: str, methods: Mapping[str, Method] | None) -> tuple[DoctorFinding, ...]:
    """A sensor at rest; of the simulated one, what it says of itself. `DeviceError`: it is refused."""
    from device.physics.hand import HandMechanics  # noqa: PLC0415 - as below
    from device.sensor import link, simulated, turn  # noqa: PLC0415 - what few rigs have, and slow to import
    from experiments.delivered.marks import shots_to_see  # noqa: PLC0415

    if simulated.measures_by_model(address):
        ready = simulated.ready_of(address, gun)
    else:
        with closing(link.SensorLink(address)) as sensor:
            ready = sensor.ready
    seen = None
    coils = (one for one in (methods or {}).values() if isinstance(one, GunParameters))
    damped = max(coils, key=lambda one: one.friction_N, default=None)
    if damped is not None and damped.friction_N > 0:
        masses = HandMechanics().enclosure_mass_kg, damped.magnet_mass_kg
        seen = shots_to_see(turn.friction_uncertainty_N(ready.noise_m_s2, ready.rate_Hz, *masses) / damped.friction_N)
    found = SensorFigures(sensor=address, rate_Hz=ready.rate_Hz, noise_m_s2=ready.noise_m_s2, shots_to_see=seen)
    return (verdicts.of_sensor(found),)


def _on_display(name: str, program: str, seconds: float = DEADLINE_S) -> tuple[DoctorFinding, ...]:
    missing = unset_display(os.environ, sys.platform)
    answer = ProgramReply(absent=missing) if missing else ask(program, seconds)
    if answer.figures is not None:
        return (verdicts.of_seen(answer.figures),)
    return (verdicts.of_absent(name, answer.absent) if answer.absent else verdicts.of_failure(name, answer.error),)


def _sound() -> tuple[DoctorFinding, ...]:
    answer = ask("sound", DEADLINE_S)
    seen = answer.figures
    return (verdicts.no_sound(answer.absent or answer.error) if seen is None else verdicts.of_seen(seen),)


def _streams() -> tuple[DoctorFinding, ...]:
    answer = ask("streams", DEADLINE_S)
    if answer.figures is None:
        return (verdicts.no_streams(answer.absent) if answer.absent else verdicts.of_failure("streams", answer.error),)
    return (verdicts.of_seen(answer.figures),)


def _console(results: Path) -> tuple[DoctorFinding, ...]:
    return within_seconds(DEADLINE_S, lambda: verdicts.of_latencies(pooled(_latencies(results))))


def _language(asked: LanguageAsked) -> tuple[DoctorFinding, ...]:
    found = language(asked.code, asked.folder)
    font = font_for(found, "".join((*found.messages.every, *map(found.look_up, NAMED_ANSWERS))))
    return (verdicts.of_language(found, font),)


def _latencies(results: Path) -> Iterator[Latencies]:
    for path in journals(results):
        try:
            yield latencies(journal.read_journal(path).records)
        except JournalError:
            continue  # `recoil study` tells of journals that cannot be read; here they have no stamps to give


_Result = TypeVar("_Result")

PUT_AWAY_S = 2.0


def _nothing() -> None:
    """There is nothing to stop."""


def within_seconds(seconds: float, work: Callable[[], _Result], stop: Callable[[], None] = _nothing) -> _Result:
    """The result of some work, or what it raises. `TimeoutError` if it takes longer; it is then left to itself.

    `stop` is called first where it is given up, also by an interrupt.
    """
    done: Future[_Result] = Future()
    try:
        begin_aside(done, work, "check")
        wait_awake(done, seconds)
    except KeyboardInterrupt:
        with interrupts_held():
            stop()
            wait_awake(done, PUT_AWAY_S)  # so that it can close and remove what it opened
        raise
    if not done.done():
        stop()
        raise TimeoutError(f"did not end within {seconds:g} s")
    return done.result()
