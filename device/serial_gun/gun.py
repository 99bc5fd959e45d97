"""The real gun, or its twin: the `Gun` over a serial line. A shot is fired once, or the error says what may be so."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress

from device.limits import DriveHistory, planned_start_s
from device.methods import Method
from device.serial_gun.asked import Asked, Order, asked, check_record
from device.serial_gun.link import PATIENCE_S, Link, Reply
from device.serial_gun.outcomes import Disconnected, Refused, TimedOut
from device.serial_gun.reports import Told, report
from device.wire import errors
from device.wire.frame import Garbled
from device.wire.records import ShotRecord, Standing
from device.words import GunState, GunStatus, Identity, LimitError, LinkError, Shot, ShotReport

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
        self._first: tuple[int, float] | None = None  # onset of the first shot since `arm`, on the gun's clock and ours
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
            self._armed_in, self._first = self.link.session, None

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once, at once or at a time on the host's clock, and report when the pulse has ended.

        From the second shot since `arm` on, the time counts from the first one by the gun's own clock, so that the
        shots of a train are whole ticks apart; the two clocks drift apart by less than 0.1 ms a second.
        `LimitError`: refused, nothing was rendered; beyond the host's own limits nothing was written either.
        `LinkError` says whether the shot was fired, was not, or may have been. It is never fired later.
        """
        self._is_open()
        with self._turn:
            if not self._armed_in:
                raise LimitError("the gun is disarmed; arm it before it may fire")
            wanted = asked(shot, self._methods)
            now_s = self._clock()
            self._history.check(wanted.load, planned_start_s(now_s, at_s))
            self._configure(wanted)
            self._mark = self._mark % (2**32 - 1) + 1
            return self._fire(Order(mark=self._mark, wanted=wanted, requested_s=now_s, at_s=at_s))

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

    def _fire(self, order: Order) -> ShotReport:
        """Trigger until the outcome is known. Only a shot that was surely not fired is triggered again."""
        session, trouble = self._set[0], LinkError()
        for tries in range(1, TRIES + 1):
            if not session == self._armed_in == self.link.session:
                why = f" ({trouble})" if str(trouble) else ""
                raise Disconnected(f"not fired: the line was lost, so the gun has disarmed itself{why}")
            try:
                reply = self._trigger(order)
                return self._report(ShotRecord.parse(reply.body), order, reply, tries)
            except Refused as error:
                if error.code != errors.TOO_LATE:
                    raise self._refusal(error, order.wanted) from error
                trouble = error
            except (TimedOut, Garbled, Disconnected) as error:
                trouble = error
                found = self._look(order, session, error)
                if found is not None:
                    return self._report(*found, tries)
        self.disarm()
        raise TimedOut(f"not fired: {trouble}, {TRIES} times")

    def _trigger(self, order: Order) -> Reply:
        start_us = 0 if order.at_s is None else self._tick(order.at_s)
        before_us = max(start_us, self.link.gun_us(self._clock())) + round(LATEST_S * self._speed * 1e6)
        return self.link.ask(f"TRIG {order.mark},{start_us},{before_us}", self._patience_s(order))

    def _patience_s(self, order: Order) -> float:
        """How long from now on a shot may take to end, in seconds of the real world."""
        ahead_s = 0.0 if order.at_s is None else max(order.at_s - self._clock(), 0.0)
        return PATIENCE_S + (ahead_s + order.wanted.setting.length_us / 1e6) / self._speed

    def _tick(self, at_s: float) -> int:
        """A time on the gun's clock: from the first shot since `arm`, where there was one."""
        if self._first is None:
            return max(0, self.link.gun_us(at_s))
        first_us, first_s = self._first
        return max(0, first_us + round((at_s - first_s) * 1e6))

    def _look(self, order: Order, session: int, trouble: LinkError) -> tuple[ShotRecord, Order, Reply] | None:
        """What became of a shot of a session whose answer was lost: its record; None if it was surely not fired.

        `LinkError`: it may have been fired, or was cut short.
        """
        end_s = time.monotonic() + self._patience_s(order)
        try:
            while True:
                reply = self._ask("SHOT?")
                if self.link.session != session and not self._remembers(session):
                    break
                record = ShotRecord.parse(reply.body)
                if record.mark != order.mark or record.ending == "NONE":
                    return None
                if record.ending in {"DONE", "CUT"}:
                    return record, order, reply
                if time.monotonic() > end_s:
                    self.disarm()
        except LinkError as error:
            trouble = error
        self._spend(order.wanted, self._clock())
        raise Disconnected(f"the shot may have been fired: {trouble}, and the gun cannot tell any more") from trouble

    def _remembers(self, session: int) -> bool:
        """Whether the gun that is there now knows what it did in an earlier session."""
        return self.link.session == session + 1 and self.link.remembers

    def _refusal(self, error: Refused, wanted: Asked) -> LinkError | LimitError:
        if error.code == errors.ALREADY_FIRED:  # the line doubled it: it was fired, and its answer was lost
            self._spend(wanted, self._clock())
            return Disconnected("the shot was fired, and its answer was lost")
        return LimitError(f"{error}; not fired") if error.code in _LIMITS else error

    def _report(self, record: ShotRecord, order: Order, reply: Reply, tries: int) -> ShotReport:
        accepted, start, end = self.link.host(record.accepted_us, record.start_us, record.end_us)
        if record.mark == order.mark:
            self._first = self._first or (record.start_us, start.time_s)
            self._spend(order.wanted, max(start.time_s + start.uncertainty_s, order.requested_s))
        check_record(record, order)
        return report(record, order, Told(reply=reply, tries=tries, accepted=accepted, start=start, end=end))

    def _spend(self, wanted: Asked, start_s: float) -> None:
        """Take a shot into account that was fired, or may have been."""
        start_s = max(start_s, self._history.earliest_s(wanted.load))
        self._history = self._history.record(wanted.load, start_s, start_s + wanted.rest_s)
