"""The real gun, or its twin: the `Gun` over a serial line. A shot is fired once, or the error says what may be so."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress

from device.limits import DriveHistory
from device.methods import Method
from device.serial_gun.address import parse
from device.serial_gun.asked import Asked, asked, check_record
from device.serial_gun.find import find, system_ports
from device.serial_gun.link import PATIENCE_S, Link, Reply
from device.serial_gun.outcomes import Disconnected, Refused, TimedOut
from device.wire import errors
from device.wire.frame import Garbled
from device.wire.records import ShotRecord, Standing
from device.words import GunState, GunStatus, Identity, LimitError, LinkError, Shot, ShotReport, ShotTiming

OPEN_S = 5.0
RECONNECT_S = 5.0
"""So long a command waits for a gun that was unplugged."""
TRIES = 4
LATEST_S = 0.15
"""A trigger that is so late does not fire any more."""
MARGIN_S = 0.1
"""Beyond the watchdog's time, until a gun that says nothing is taken for disarmed."""

_LIMITS = {errors.NOT_HOME, errors.DUTY, errors.RATE, errors.HOT, errors.OUT_OF_RANGE}
_STATES: dict[str, GunState] = {
    "DISARMED": "disarmed",
    "ARMED": "armed",
    "RESETTING": "resetting",
    "WAITING": "resetting",
    "FIRING": "resetting",
    "FAULT": "fault",
}


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


class SerialGun:
    """A `Gun` on a link that is up. It is born disarmed; `clock` gives seconds, as fast as the gun lives.

    Commands may come from any thread; they are carried out one after the other, but `disarm` comes at once.
    """

    def __init__(self, link: Link, methods: Mapping[str, Method], clock: Callable[[], float], speed: float) -> None:
        self.link = link
        self._methods, self._clock, self._speed = dict(methods), clock, speed
        self._turn = threading.RLock()
        self._history = DriveHistory()
        self._mark = time.time_ns() // 1_000_000 % 2**31 + 1
        self._armed_in = 0  # the link's session; 0 if disarmed
        self._set = (0, "")  # the session and the setting that the gun has
        self._closed = False

    def identify(self) -> Identity:
        """Who answered. `LinkError` after `close`."""
        self._is_open()
        named = self.link.named
        if named is None:
            raise Disconnected("the gun never said who it is")
        return Identity(model=named.model, version=named.firmware, serial=named.serial)

    def arm(self) -> None:
        """Allow the next shots. `LinkError`: the gun does not answer, or has a fault."""
        self._is_open()
        with self._turn:
            self._ask("ARM")
            self._armed_in = self.link.session

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once, at once or at a time on the host's clock, and report when the pulse has ended.

        `LimitError`: refused, nothing was rendered; beyond the host's own limits nothing was written either.
        `LinkError` says whether the shot was fired, was not, or may have been. It is never fired later.
        """
        self._is_open()
        with self._turn:
            if not self._armed_in:
                raise LimitError("the gun is disarmed; arm it before it may fire")
            wanted = asked(shot, self._methods)
            requested_s = self._clock()
            self._history.check(wanted.load, max(requested_s, at_s or requested_s))
            self._configure(wanted)
            return self._fire(wanted, requested_s, at_s)

    def disarm(self) -> None:
        """Forbid shots, from every state and thread. If the gun cannot be told, wait until its watchdog has done it."""
        self._armed_in = 0
        session = self.link.session
        for _ in range(TRIES):
            try:
                self.link.ask("ABOR")
            except (TimedOut, Garbled):
                continue
            except LinkError:
                break
            return
        self.link.drop("the gun did not say that it is disarmed")
        end_s = time.monotonic() + self.link.watchdog_s + MARGIN_S - self.link.silent_for_s
        while self.link.session == session and time.monotonic() < end_s:
            time.sleep(0.005)

    def status(self) -> GunStatus:
        """The gun at this moment. After `close` what is known without it. `LinkError`: it does not answer."""
        if self._closed:
            return self._status("disarmed", 0, 0.0, self._history.ready_s, None)
        with self._turn:
            said = Standing.parse(self._ask("STAT?").body)
            (ready,) = self.link.host(said.ready_us)
            ready_s = max(self._history.ready_s, ready.time_s + ready.uncertainty_s)
            fault = f"the driver reports fault {said.fault}" if said.fault else None
            return self._status(_STATES[said.state], said.count, said.coil_mC / 1000, ready_s, fault)

    def close(self) -> None:
        """Disarm, and let go of the line."""
        if self._closed:
            return
        self._closed = True
        self.disarm()
        with suppress(LinkError):
            self.link.ask("SYST:PLAI")
        self.link.close()

    def _status(self, state: GunState, shots: int, coil_C: float, ready_s: float, fault: str | None) -> GunStatus:
        return GunStatus(
            state=state,
            shots=shots,
            coil_temperature_C=max(coil_C, self._history.coil_celsius(self._clock())),
            ready_at_s=ready_s,
            fault=fault,
        )

    def _is_open(self) -> None:
        if self._closed:
            raise Disconnected("the gun is closed; open it again")

    def _ask(self, body: str) -> Reply:
        """Ask what may be asked again, until there is an answer; the last trouble if there is none."""
        trouble: LinkError = TimedOut("no answer")
        for _ in range(TRIES):
            self.link.wait_up(RECONNECT_S)
            try:
                return self.link.ask(body)
            except Refused:
                raise
            except (TimedOut, Garbled, Disconnected) as error:
                trouble = error
        raise trouble

    def _configure(self, wanted: Asked) -> None:
        text = wanted.setting.text()
        if self._set != (self.link.session, text):
            self._set = (0, "")
            try:
                self._ask(f"CONF {text}")
            except Refused as error:
                raise LimitError(f"{error}; nothing was fired") from error
            self._set = (self.link.session, text)

    def _fire(self, wanted: Asked, requested_s: float, at_s: float | None) -> ShotReport:
        """Trigger until the outcome is known. Only a shot that was surely not fired is triggered again."""
        self._mark = mark = self._mark % (2**32 - 1) + 1
        session, trouble = self._set[0], LinkError("no answer")
        for tries in range(1, TRIES + 1):
            if not session == self._armed_in == self.link.session:
                raise Disconnected(f"not fired: the line was lost, so the gun has disarmed itself ({trouble})")
            try:
                reply = self._trigger(mark, wanted, at_s)
                return self._report(ShotRecord.parse(reply.body), mark, wanted, (requested_s, reply, tries))
            except Refused as error:
                if error.code != errors.TOO_LATE:
                    raise self._refusal(error, wanted) from error
                trouble = error
            except (TimedOut, Garbled, Disconnected) as error:
                trouble = error
                found = self._look(mark, wanted, session, error)
                if found is not None:
                    return self._report(found[0], mark, wanted, (requested_s, found[1], tries))
        self.disarm()
        raise TimedOut(f"not fired: {trouble}, {TRIES} times")

    def _trigger(self, mark: int, wanted: Asked, at_s: float | None) -> Reply:
        now_s = self._clock()
        start_us = 0 if at_s is None else self.link.gun_us(at_s)
        before_us = self.link.gun_us(max(now_s, at_s or now_s) + LATEST_S * self._speed)
        ahead_s = 0.0 if at_s is None else max(at_s - now_s, 0.0)
        patience_s = PATIENCE_S + (ahead_s + wanted.setting.length_us / 1e6) / self._speed
        return self.link.ask(f"TRIG {mark},{start_us},{before_us}", patience_s)

    def _look(self, mark: int, wanted: Asked, session: int, trouble: LinkError) -> tuple[ShotRecord, Reply] | None:
        """What became of a shot of a session whose answer was lost: its record; None if it was surely not fired.

        `LinkError`: it may have been fired, or was cut short.
        """
        end_s = time.monotonic() + PATIENCE_S + wanted.setting.length_us / 1e6 / self._speed
        try:
            while True:
                reply = self._ask("SHOT?")
                if self.link.session != session and not self._remembers(session):
                    break
                record = ShotRecord.parse(reply.body)
                if record.mark != mark or record.ending == "NONE":
                    return None
                if record.ending in {"DONE", "CUT"}:
                    return record, reply
                if time.monotonic() > end_s:
                    self.disarm()
        except LinkError as error:
            trouble = error
        self._spend(wanted, self._clock())
        raise Disconnected(f"the shot may have been fired: {trouble}, and the gun cannot tell any more") from trouble

    def _remembers(self, session: int) -> bool:
        """Whether the gun that is there now knows what it did in an earlier session."""
        return self.link.session == session + 1 and self.link.remembers

    def _refusal(self, error: Refused, wanted: Asked) -> LinkError | LimitError:
        if error.code == errors.ALREADY_FIRED:  # the line doubled it: it was fired, and its answer was lost
            self._spend(wanted, self._clock())
            return Disconnected("the shot was fired, and its answer was lost")
        return LimitError(f"{error}; not fired") if error.code in _LIMITS else error

    def _report(self, record: ShotRecord, mark: int, wanted: Asked, asked_how: tuple[float, Reply, int]) -> ShotReport:
        requested_s, reply, tries = asked_how
        start, end, accepted = self.link.host(record.start_us, record.end_us, record.accepted_us)
        if record.mark == mark:
            self._spend(wanted, max(start.time_s + start.uncertainty_s, requested_s))
        check_record(record, mark, wanted)
        return ShotReport(
            shot=wanted.shot,
            requested_s=requested_s,
            pulse_start_s=start.time_s,
            pulse_end_s=end.time_s,
            home_predicted_s=start.time_s + wanted.rendering.settle_s,
            motion=wanted.rendering.motion,
            timing=ShotTiming(
                requested_s=requested_s,
                written_s=reply.written_s,
                acknowledged_s=reply.received_s,
                accepted_s=accepted.time_s,
                pulse_start_s=start.time_s,
                pulse_end_s=end.time_s,
                uncertainty_s=start.uncertainty_s,
                gun_accepted_us=record.accepted_us,
                gun_start_us=record.start_us,
                gun_end_us=record.end_us,
                asked=tries,
            ),
        )

    def _spend(self, wanted: Asked, start_s: float) -> None:
        """Take a shot into account that was fired, or may have been."""
        start_s = max(start_s, self._history.earliest_s(wanted.load))
        self._history = self._history.record(wanted.load, start_s, start_s + wanted.rest_s)
