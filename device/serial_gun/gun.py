"""The real gun, or its twin: the `Gun` over a serial line. A shot is fired once, or the error says what may be so.

The port is named in the address, or found by what answers.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from device.limits import DriveHistory, planned_start_s
from device.machine_clock import machine_s
from device.methods import Method
from device.serial_gun.lines import CommandRefused, Disconnected, SerialPort, TimedOut, Unsure, WrongVersion
from device.serial_gun.link import PLAIN_NAME, Link
from device.serial_gun.reports import MAX_UNCERTAINTY_S, ShotOrder, ShotRequest, asked, ready_s, report
from device.serial_gun.triggering import TRIES, Arming, Triggering, ask_again, standing
from device.wire.records import Named, Splitter, StatusRecord
from device.words import GunState, GunStatus, Identity, LimitError, LinkError, Shot, ShotReport

_STATES: dict[str, GunState] = {
    "DISARMED": "disarmed",
    "ARMED": "armed",
    "RESETTING": "resetting",
    "WAITING": "resetting",
    "FIRING": "resetting",
    "FAULT": "fault",
}


class SerialGun:
    """A `Gun` on a link that is up. It is born disarmed; `clock` gives seconds, as fast as the gun lives.

    Commands may come from any thread. Those that arm or fire are carried out one after the other; `disarm` comes at
    once, and nothing that was asked for before it arms or fires after it; `status` waits for nobody.
    """

    def __init__(self, link: Link, methods: Mapping[str, Method], clock: Callable[[], float], speed: float) -> None:
        self.link = link
        self._methods, self.clock, self._speed = dict(methods), clock, speed
        self.turn = threading.Lock()
        self.arming = Arming(link)
        self._triggering = Triggering(link, self.arming, clock, speed)
        self.history = DriveHistory()
        self._mark = time.time_ns() // 1_000_000 % 2**31 + 1
        self._counted: tuple[int, int] | None = None  # the gun's boot, and its count of shots; None if it is not known
        self._last_said = 0  # the count that the gun said last
        self._first: tuple[int, float] | None = None  # onset of the first shot since `arm`, on the gun's clock and ours
        self._set = (0, "")  # the session and the setting that the gun has
        self._closed = False

    def identify(self) -> Identity:
        """Who answered. `LinkError` after `close`."""
        self._is_open()
        if (named := self.link.named) is None:
            raise Disconnected("the gun never said who it is")
        return Identity(model=named.model, version=named.firmware, serial=named.serial)

    def arm(self) -> None:
        """Allow the next shots. `LinkError`: the gun does not answer, has a fault, or was disarmed meanwhile."""
        disarms = self.arming.disarms
        self._is_open()
        with self.turn:
            self.arming.arm(disarms)
            self._first = None

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once, at once or at a time on the host's clock, and report when the pulse has ended.

        From the second shot since `arm` on, the time counts from the first one by the gun's own clock, so that the
        shots of a train are whole ticks apart; the two clocks drift apart by less than 0.1 ms a second.
        `LimitError`: refused, nothing was rendered; beyond the host's own limits nothing was written either.
        `LinkError` says whether the shot was fired, was not, or may have been: what the gun says of it is believed only
        if it contradicts neither its order nor the clocks (`checks`). It is never fired later.
        """
        try:
            return self._ordered(shot, at_s)
        except Unsure:
            raise
        except LinkError as error:
            error.may_have_fired = False
            raise

    def _ordered(self, shot: Shot, at_s: float | None) -> ShotReport:
        """The same, of which each error but `Unsure` says that nothing was fired."""
        disarms = self.arming.disarms
        self._is_open()
        with self.turn:
            session = self.arming.session
            if not session or self.arming.disarms != disarms:
                raise LimitError("the gun is disarmed; arm it before it may fire")
            wanted = asked(shot, self._methods)
            now_s = self.clock()
            self.history.check(wanted.rendering.load, planned_start_s(now_s, at_s))
            self._know_the_clock()
            boot, count = self._count()
            self._configure(wanted)
            self._mark = self._mark % (2**32 - 1) + 1
            order = ShotOrder(
                mark=self._mark,
                wanted=wanted,
                requested_s=now_s,
                written_s=self.clock(),
                at_s=at_s,
                at_us=0 if at_s is None else self._tick(at_s),
                count=count,
                boot=boot,
                session=session,
                disarms=disarms,
            )
            return self._fire(order)

    def disarm(self) -> None:
        """Forbid shots, from every state and thread. If the gun cannot be told, wait until its watchdog has done it."""
        self.arming.disarm()

    def status(self) -> GunStatus:
        """The gun at this moment. After `close` what is known without it. `LinkError`: it does not answer."""
        if self._closed:
            return self._status("disarmed", self._last_said, 0.0, self.history.ready_s, None)
        reply, said = standing(self.link)
        self._last_said = said.count
        (ready,) = self.link.host(said.ready_us)
        next_s = max(self.history.ready_s, ready_s(said, reply, ready))
        return self._status(_STATES[said.state], said.count, said.coil_mC / 1000, next_s, self._fault(said))

    @property
    def clock_jumps(self) -> int:
        """How often the gun's clock contradicted what was known of it: always, where its speed is another one."""
        return self.link.clock_jumps

    def close(self) -> None:
        """Disarm, and let go of the line."""
        if self._closed:
            return
        self._closed = True
        self.disarm()
        self.link.close()

    def _status(self, state: GunState, shots: int, coil_C: float, ready_s: float, fault: str | None) -> GunStatus:
        return GunStatus(
            state=state,
            shots=shots,
            coil_temperature_C=max(coil_C, self.history.coil_celsius(self.clock())),
            ready_at_s=ready_s,
            fault=fault,
        )

    def _fault(self, said: StatusRecord) -> str | None:
        """What is wrong with the gun: its driver, or that it disarmed itself while it was to be armed."""
        if said.fault:
            return f"the driver reports fault {said.fault}"
        return self.link.why_lost if self.arming.lapsed else None

    def _is_open(self) -> None:
        if self._closed:
            raise Disconnected("the gun is closed; open it again")

    def _know_the_clock(self) -> None:
        """Nothing, if a shot's time would be known well enough; none is fired at a person only to be thrown away."""
        for _ in range(TRIES):
            (now,) = self.link.host(self.link.gun_us(self.clock()))
            if now.uncertainty_s <= MAX_UNCERTAINTY_S * self._speed:
                return
            ask_again(self.link, "TIME?")
        raise TimedOut(
            f"not fired: the gun's clock is known to {now.uncertainty_s / self._speed:.3g} s only, and it must be "
            f"{MAX_UNCERTAINTY_S:g} s or less for a shot's time to count; the line is too slow (see recoil doctor)"
        )

    def _count(self) -> tuple[int, int]:
        """The gun's boot and count of shots; read where it is not known: at first, after a reset or a lost outcome."""
        boot = self.link.boot
        if self._counted is None or self._counted[0] != boot:
            self._counted = boot, standing(self.link)[1].count
        return self._counted

    def _configure(self, wanted: ShotRequest) -> None:
        text = wanted.setting.text()
        if self._set != (self.link.session, text):
            self._set = (0, "")
            try:
                self._set = (ask_again(self.link, f"CONF {text}").session, text)
            except CommandRefused as error:
                raise LimitError(f"{error}; nothing was fired") from error

    def _tick(self, at_s: float) -> int:
        """A time on the gun's clock: from the first shot since `arm`, where there was one."""
        if self._first is None:
            return max(0, self.link.gun_us(at_s))
        first_us, first_s = self._first
        return max(0, first_us + round((at_s - first_s) * 1e6))

    def _fire(self, order: ShotOrder) -> ShotReport:
        """Have it fired. A shot of unknown time is taken into account as if it had begun now: nothing begins later.

        Its own word on the time is not asked, and the gun's count is read anew before the next.
        """
        try:
            told = self._triggering.fire(order)
        except Unsure:
            self._counted = None
            self._spend(order.wanted, self.clock())
            raise
        self._counted = order.boot, told.record.count
        self._last_said = told.record.count
        self._first = self._first or (told.record.start_us, told.start.time_s)
        self._spend(order.wanted, max(told.start.time_s + told.start.uncertainty_s, order.requested_s))
        return report(order, told)

    def _spend(self, wanted: ShotRequest, start_s: float) -> None:
        """Take a shot into account that was fired, or may have been."""
        start_s = max(start_s, self.history.earliest_s(wanted.rendering.load))
        self.history = self.history.record(wanted.rendering.load, start_s, start_s + wanted.rest_s)


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
    """How many times faster than the world a gun's clock goes; None of the simulated one, whose shots take no time."""
    if address == "simulated":
        return None
    return parse(address).speed if address.startswith(SCHEME) else 1.0


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


def find_gun(ports: Iterable[str], serial: str | None = None) -> str:
    """The port at which a gun answers, the one with this serial number if it is given.

    `LinkError` names what was found if that is no gun or more than one. Each port is sent `*IDN?` and nothing else.
    """
    looked = list(ports)
    found = {port: named for port in looked if (named := probe(port)) and serial in {None, named.serial}}
    if len(found) == 1:
        return next(iter(found))
    if found:
        guns = ", ".join(f"{named.serial} at {port}" for port, named in found.items())
        raise LinkError(f"more than one gun answers: {guns}; name the port of one, as serial:PORT")
    wanted = f"gun {serial}" if serial else "gun"
    raise LinkError(
        f"no {wanted} answers; looked at {', '.join(looked) or 'no port: the system shows none'}; "
        "check power and cable, or name its port, as serial:PORT (a twin's is never looked for)"
    )


def probe(port: str) -> Named | None:
    """Who answers at a port, if it is a gun."""
    try:
        line = SerialPort(port)
    except LinkError:  # in use, or not ours to open
        return None
    try:
        line.write(b"\n*IDN?\n")
        splitter, end_s = Splitter(), machine_s() + PROBE_S
        while machine_s() < end_s:
            for answer in splitter.feed(line.read()):
                if answer and answer.startswith(PLAIN_NAME):
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
        named = WrongVersion if isinstance(error, WrongVersion) else LinkError  # of which somebody can do something
        raise named(f"{address}: {error}") from error
    gun = SerialGun(link, methods, clock, where.speed)
    known.append(gun.identify().serial)
    return gun
