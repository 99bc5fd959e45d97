"""Arming the gun, and firing a shot from its order to its outcome: fired once, its record checked.

Questions whose answers only tell are asked again until there is an answer; what was lost on the way is looked for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

from device.machine_clock import machine_s
from device.serial_gun import lines, reports
from device.serial_gun.link import PATIENCE_S, Link
from device.wire.errors import WireError
from device.wire.records import Garbled, ShotRecord, StatusRecord
from device.words import LimitError, LinkError

TRIES = 4
RECONNECT_S = 5.0
"""So long a command waits for a gun that was unplugged."""
ARM_WITHIN_S = 1.0
"""A gun that comes back later than this is not armed: whoever plugged it in has their hands at it."""

_T = TypeVar("_T")


def ask_again(link: Link, body: str, allowed: Callable[[], bool] = lambda: True) -> lines.Reply:
    """Ask what may be asked again, until there is an answer; the last trouble if there is none."""
    trouble: LinkError = lines.TimedOut("no answer")
    for _ in range(TRIES):
        link.wait_up(RECONNECT_S)
        try:
            return link.ask(body, allowed=allowed)
        except (lines.TimedOut, Garbled, lines.Disconnected) as error:
            trouble = error
    raise trouble


def standing(link: Link) -> tuple[lines.Reply, StatusRecord]:
    """How the gun stands. `Contradiction`: as it cannot stand."""
    reply, found = _read(link, "STAT?", StatusRecord.parse)
    try:
        reports.check_standing(found)
    except lines.Contradiction as error:
        raise lines.Contradiction(f"the gun's answer to STAT? is not believed: {error}") from error
    return reply, found


def last_shot(link: Link) -> tuple[lines.Reply, ShotRecord]:
    """What the gun says of the last shot that it accepted."""
    return _read(link, "SHOT?", ShotRecord.parse)


def _read(link: Link, question: str, parse: Callable[[str], _T]) -> tuple[lines.Reply, _T]:
    """An answer as the record that it is. One that cannot be read is asked for again."""
    trouble = Garbled()
    for _ in range(TRIES):
        reply = ask_again(link, question)
        try:
            return reply, parse(reply.body)
        except Garbled as error:
            trouble = error
    raise Garbled(f"the gun's answer to {question} cannot be read: {trouble}")


MARGIN_S = 0.1
"""Beyond the watchdog's time, until a gun that says nothing is taken for disarmed."""


class Arming:
    """The arming of the gun on a link, from any thread.

    `disarms` counts the disarmings. Who wants to arm or fire notes it first: once it has changed, no more is written
    for them. The link asks while nobody else can write, so that what was written before is followed by `ABOR`.
    """

    def __init__(self, link: Link) -> None:
        self.disarms = 0
        self.session = 0  # the link's, in which the gun was armed; 0 if it is disarmed
        self._link = link
        self.lock = threading.Lock()

    @property
    def lapsed(self) -> bool:
        """Whether the gun was armed, and has disarmed itself since, as it does when the line is lost."""
        return self.session not in {0, self._link.session}

    def stands(self, disarms: int, session: int) -> bool:
        """Whether the gun is still armed for what was asked for after so many disarmings, in this session."""
        return (self.disarms, self._link.session) == (disarms, session)

    def arm(self, disarms: int) -> None:
        """Arm at once, unless it was disarmed since. `LinkError`: it was, or the gun is silent, or has a fault."""
        latest_s = machine_s() + ARM_WITHIN_S
        try:
            session = ask_again(self._link, "ARM", lambda: self.disarms == disarms and machine_s() <= latest_s).session
        except lines.CalledOff as error:
            if self.disarms != disarms:
                raise
            self.disarm()  # an ARM before may have reached it
            raise lines.Disconnected(f"not armed: the gun was gone for more than {ARM_WITHIN_S:g} s") from error
        except lines.CommandRefused:
            raise
        except LinkError:  # it may be armed, and its answer lost
            self.disarm()
            raise
        with self.lock:
            if self.disarms != disarms:
                raise lines.CalledOff("ARM was called off: the gun was disarmed meanwhile")
            self.session = session

    def disarm(self) -> None:
        """Forbid shots. If the gun cannot be told, wait until its watchdog has done it."""
        with self.lock:
            self.disarms += 1
            self.session = 0
        session = self._link.session
        for _ in range(TRIES):
            try:
                self._link.ask("ABOR")
            except (lines.TimedOut, Garbled):
                continue
            except LinkError:
                break
            return
        self._link.drop("the gun did not say that it is disarmed")
        end_s = machine_s() + self._link.watchdog_s + MARGIN_S - self._link.silent_for_s
        while self._link.session == session and machine_s() < end_s:
            time.sleep(0.005)


LATEST_S = 0.15
"""A trigger that is so late does not fire any more."""
CLOCK_TRIES = 3
"""So often are a shot's times judged, the clock learnt again in between."""

_LIMITS = {WireError.DUTY, WireError.RATE, WireError.HOT, WireError.OUT_OF_RANGE}
_STOPPED = {WireError.CANCELLED, WireError.DISARMED, WireError.FAULT}
_DOUBLED = {WireError.ALREADY_FIRED, WireError.BUSY}
"""The line doubled the trigger: it was fired, or is being fired, and what came of it is lost."""


class Triggering:
    """Triggers shots on a link; `clock` is the host's, at `speed` times the world's pace."""

    def __init__(self, link: Link, arming: Arming, clock: Callable[[], float], speed: float) -> None:
        self._link, self._arming, self._clock, self._speed = link, arming, clock, speed

    def fire(self, order: reports.ShotOrder) -> reports.BelievedShot:
        """The shot as it was told of and is believed. Only one that was surely not fired is triggered again.

        `LimitError`, `LinkError`: it was not fired. `Unsure`: it was, or may have been.
        """
        trouble = LinkError()
        for tries in range(1, TRIES + 1):
            try:
                reply = self._trigger(order)
                record = ShotRecord.parse(reply.body)
            except lines.CalledOff as error:
                raise lines.Disconnected(f"not fired: {self._why_not(order)}") from error
            except lines.CommandRefused as error:
                trouble = self._refused(error, order)
                ask_again(self._link, "TIME?")  # too late by a clock that may have been misread
            except (lines.TimedOut, Garbled, lines.Disconnected) as error:
                trouble = error
                found = self._look(order, error)
                if found is not None:
                    return self._believed(*found, order, tries)
            else:
                return self._believed(reply, record, order, tries)
        self._arming.disarm()
        raise lines.TimedOut(f"not fired: {trouble}, {TRIES} times")

    def _trigger(self, order: reports.ShotOrder) -> lines.Reply:
        before_us = max(order.at_us, self._link.gun_us(self._clock())) + round(LATEST_S * self._speed * 1e6)
        trigger = f"TRIG {order.mark},{order.at_us},{before_us}"
        return self._link.ask(
            trigger, self._patience_s(order), lambda: self._arming.stands(order.disarms, order.session)
        )

    def _patience_s(self, order: reports.ShotOrder) -> float:
        """How long from now on a shot may take to end, in seconds of the real world."""
        ahead_s = 0.0 if order.at_s is None else max(order.at_s - self._clock(), 0.0)
        return PATIENCE_S + (ahead_s + order.wanted.setting.length_us / 1e6) / self._speed

    def _look(self, order: reports.ShotOrder, trouble: LinkError) -> tuple[lines.Reply, ShotRecord] | None:
        """The record of a shot whose answer was lost, when it has ended; None if it was surely not fired."""
        end_s, stopped = machine_s() + self._patience_s(order), False
        while True:
            reply, record = self._last_shot(order, trouble)
            if record.mark != order.mark or record.ending == "NONE":
                return None
            if record.ending in {"DONE", "CUT"} or stopped:
                return reply, record
            if machine_s() > end_s:
                self._arming.disarm()
                stopped = True

    def _last_shot(self, order: reports.ShotOrder, trouble: LinkError) -> tuple[lines.Reply, ShotRecord]:
        """What the gun says of its last shot, if it still knows. `Unsure`: it does not, or it contradicts itself."""
        try:
            reply, record = last_shot(self._link)
            if self._link.boot == order.boot:
                reports.check_not_fired(record, order)
                return reply, record
        except lines.Contradiction as error:
            raise self._disbelieved(order, error) from error
        except LinkError as error:
            trouble = error
        raise self._lost(order, trouble)

    def _refused(self, error: lines.CommandRefused, order: reports.ShotOrder) -> LinkError:
        """A trigger that came too late, and may be written again. Raises what any other refusal means."""
        if error.code == WireError.TOO_LATE:
            return error
        if error.code in _DOUBLED:
            raise self._unsure(order, f"the shot was fired, and its answer was lost ({error})") from error
        if error.code in _STOPPED:
            raise lines.Disconnected(f"not fired: {self._why_not(order)}") from error
        if error.code in _LIMITS:
            raise LimitError(f"{error}; not fired") from error
        raise self._too_soon(error) from error

    def _too_soon(self, error: lines.CommandRefused) -> LinkError | LimitError:
        """A gun that was switched on just now fires nothing in its first second, and none before its magnet is home."""
        found = standing(self._link)[1]
        left_s = (found.ready_us - found.clock_us) / 1e6
        if found.count == 0 and left_s > 0:
            return LimitError(
                f"not fired: the gun was switched on or reset {found.clock_us / 1e6:.1f} s ago, and fires nothing in "
                "its first second, because what was driven before is not known"
            )
        if error.code == WireError.MAGNET_NOT_HOME:
            return LimitError(
                f"not fired: its magnet was not home, by the gun's own clock ({max(left_s, 0):.3f} s to go)"
            )
        return lines.Disconnected(f"not fired: {error}")

    def _why_not(self, order: reports.ShotOrder) -> str:
        """Why a shot was called off, or cut short: a disarming, a fault of the driver, the line, or the watchdog."""
        if self._arming.disarms != order.disarms:
            return "the gun was disarmed meanwhile"
        try:
            _, found = standing(self._link)
        except LinkError as error:
            return str(error)
        if self._link.session != order.session:
            return self._link.why_lost
        return f"the driver reports fault {found.fault}" if found.fault else "the gun does not say why"

    def _believed(
        self, reply: lines.Reply, record: ShotRecord, order: reports.ShotOrder, tries: int
    ) -> reports.BelievedShot:
        """What is told of a shot, if it is believed."""
        try:
            reports.check_record(record, order)
            return self._told(reply, record, order, tries)
        except lines.Contradiction as error:
            raise self._disbelieved(order, error) from error
        except lines.CutShort as error:
            raise self._unsure(order, f"{error} ({self._why_not(order)})") from error
        except LinkError as error:
            raise self._lost(order, error) from error

    def _told(
        self, reply: lines.Reply, record: ShotRecord, order: reports.ShotOrder, tries: int
    ) -> reports.BelievedShot:
        """A record's times on the host's clock. A clock that was misread is learnt anew before they are disbelieved."""
        trouble = lines.Contradiction()
        for _ in range(CLOCK_TRIES):
            accepted, start, end = self._link.host(record.accepted_us, record.start_us, record.end_us)
            told = reports.BelievedShot(
                reply=reply, record=record, tries=tries, accepted=accepted, start=start, end=end
            )
            try:
                reports.check_times(told, order, self._speed)
            except lines.Contradiction as error:
                trouble = error
                ask_again(self._link, "TIME?")
            else:
                return told
        raise trouble

    def _disbelieved(self, order: reports.ShotOrder, why: lines.Contradiction) -> lines.Unsure:
        return self._unsure(order, f"the shot may have been fired, and the gun's record is not believed: {why}")

    def _lost(self, order: reports.ShotOrder, why: LinkError) -> lines.Unsure:
        return self._unsure(order, f"the shot may have been fired: {why}, and the gun cannot tell any more")

    def _unsure(self, order: reports.ShotOrder, what: str) -> lines.Unsure:
        """The error of a shot that was, or may have been, fired. The gun is disarmed, lest it still be."""
        self._arming.disarm()
        return lines.Unsure(f"{what}; the gun's COUNT was {order.count} before it")
