"""From a shot to what is said of it on the wire and back, and what must hold of an answer to be believed. Pure.

An answer is held against the order, against itself, and against this machine's clock. Whatever a gun says, a shot that
passes began between the writing of its trigger and the reading of its record, give or take the uncertainty: a faulty
gun, firmware or line cannot put it elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from device.methods import Method, Rendering, rendering_of
from device.serial_gun.lines import MAX_DRIFT, Contradiction, CutShort, HostTime, Reply
from device.wire.records import METHOD_NAME, Setting, ShotRecord, StatusRecord, Way
from device.words import Direction, Drive, Effect, LimitError, Pulse, Shot, ShotReport, ShotTiming, judged

FLOORS_US: Final = {"PULS": 50_000, "EFF": 10_000}
"""The firmware's least time from onset to onset (`PROTOCOL.md`)."""
WAYS: Final[dict[Direction, Way]] = {"forward": "FORW", "backward": "BACK"}
_MILLI, _MICRO = 1e3, 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotRequest:
    """A shot in whole millivolts and microseconds, and what the model says of it."""

    shot: Shot
    setting: Setting
    rendering: Rendering

    @property
    def rest_s(self) -> float:
        """Least time from its onset to the next."""
        return self.setting.rest_us / _MICRO


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotOrder:
    """A shot that was asked for, once: the mark that names it on the wire, and what the gun's word is held against.

    `written_s`: when its trigger was first written; `at_us`: its tick on the gun's clock, 0 if it is to fire at once;
    `count`: the shots that the gun had counted before it, since its `boot`; `session` and `disarms`: of the link and
    the gun, for which alone it may be triggered.
    """

    mark: int
    wanted: ShotRequest
    requested_s: float
    written_s: float
    at_s: float | None
    at_us: int
    count: int
    boot: int
    session: int
    disarms: int


def asked(shot: Shot, methods: Mapping[str, Method]) -> ShotRequest:
    """A shot as it can be said. `LimitError`: no such method, a drive of another kind, or no way home by the model."""
    shot = judged(shot)
    if shot.method not in methods:
        raise LimitError(f"method is {shot.method!r}; this gun renders {', '.join(methods)}")
    if METHOD_NAME.fullmatch(shot.method) is None:
        raise LimitError(f"method is {shot.method!r}; on the wire it must be 1 to 24 of a-z, 0-9 and -")
    drive = _sayable(shot.drive)
    rendering = rendering_of(methods[shot.method], drive)
    return ShotRequest(
        shot=Shot(method=shot.method, direction=shot.direction, drive=drive),
        setting=_setting(shot, drive, rendering),
        rendering=rendering,
    )


def _sayable(drive: Drive) -> Drive:
    """The nearest drive of whole millivolts and microseconds."""
    if isinstance(drive, Effect):
        return drive
    return Pulse(voltage_V=round(drive.voltage_V * _MILLI) / _MILLI, pulse_s=round(drive.pulse_s * _MICRO) / _MICRO)


def _setting(shot: Shot, drive: Drive, rendering: Rendering) -> Setting:
    pulse = isinstance(drive, Pulse)
    kind = "PULS" if pulse else "EFF"
    length_us = round((drive.pulse_s if isinstance(drive, Pulse) else rendering.settle_s) * _MICRO)
    settle_us = -int(-rendering.settle_s * _MICRO // 1)
    return Setting(
        method=shot.method,
        way=WAYS[shot.direction],
        kind="PULS" if pulse else "EFF",
        amount=round(drive.voltage_V * _MILLI) if isinstance(drive, Pulse) else drive.effect,
        length_us=length_us,
        rest_us=max(settle_us, length_us, FLOORS_US[kind]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class BelievedShot:
    """A reply, the record that it holds, how often the shot was triggered until then; its times by the host's clock."""

    reply: Reply
    record: ShotRecord
    tries: int
    accepted: HostTime
    start: HostTime
    end: HostTime


def report(order: ShotOrder, told: BelievedShot) -> ShotReport:
    """The report of a shot, from the gun's record of it."""
    record = told.record
    return ShotReport(
        shot=order.wanted.shot,
        requested_s=order.requested_s,
        pulse_start_s=told.start.time_s,
        pulse_end_s=told.end.time_s,
        home_predicted_s=told.start.time_s + order.wanted.rendering.settle_s,
        motion=order.wanted.rendering.motion,
        timing=ShotTiming(
            requested_s=order.requested_s,
            written_s=order.written_s,
            acknowledged_s=told.reply.received_s,
            accepted_s=told.accepted.time_s,
            pulse_start_s=told.start.time_s,
            pulse_end_s=told.end.time_s,
            uncertainty_s=told.start.uncertainty_s,
            gun_accepted_us=record.accepted_us,
            gun_start_us=record.start_us,
            gun_end_us=record.end_us,
            gun_count=record.count,
            asked=told.tries,
        ),
    )


def ready_s(standing: StatusRecord, reply: Reply, ready: HostTime) -> float:
    """When the next shot may start, by the clocks, but within what the exchange by itself makes certain.

    A clock that was misread cannot put it off.
    """
    left_s = (standing.ready_us - standing.clock_us) / 1e6
    earliest_s, latest_s = reply.written_s + left_s, reply.received_s + left_s + abs(left_s) * MAX_DRIFT
    return min(max(ready.time_s + ready.uncertainty_s, earliest_s), latest_s)


MAX_UNCERTAINTY_S: Final = 0.05
"""The most by which the two clocks may disagree for a shot to count, in seconds of the real world. Assumed: it lets
through a line whose quickest round trip takes 0.1 s, three times that of an adapter that keeps bytes back for 16 ms
each way; `recoil doctor` warns from 0.01 s on. A response time that is off by more is none."""
_MAX_REST_US: Final = 10_000_000
"""No magnet takes longer to come home, by the wire's own bound of REST."""
ROUNDING_S: Final = 2e-6
"""Times on the wire are whole microseconds, rounded down."""


def check_record(record: ShotRecord, order: ShotOrder) -> None:
    """Nothing, if the record tells of just the shot that was asked for, once, driven to its end.

    `Contradiction` names the broken rule and its values; `CutShort`: it was switched off early.
    """
    _check_shot(record, order)
    due_us = max(order.at_us, record.accepted_us)
    if record.start_us != due_us:
        raise Contradiction(
            f"START is {record.start_us}; it must be {due_us}, the later of its tick {order.at_us} and ACCEPTED "
            f"{record.accepted_us}"
        )
    driven_us, length_us = record.end_us - record.start_us, order.wanted.setting.length_us
    if driven_us < 0:
        raise Contradiction(f"END is {record.end_us}, before START {record.start_us}")
    if record.ending == "CUT":
        raise CutShort(f"the shot was fired and cut short: driven for {driven_us} of {length_us} microseconds")
    if record.ending != "DONE" or driven_us != length_us:
        raise Contradiction(f"{record.ending}, driven for {driven_us} microseconds; it must be DONE, {length_us}")


def _check_shot(record: ShotRecord, order: ShotOrder) -> None:
    """Whether the record is of this shot, and of no more than this one since the count before it."""
    setting = order.wanted.setting
    if record.mark != order.mark or record.setting != setting:
        asked_for, rendered = f"{order.mark} {setting.text()}", f"{record.mark} {record.setting.text()}"
        raise Contradiction(f"asked for {asked_for}, the gun rendered {rendered}")
    if record.count != order.count + 1:
        raise Contradiction(f"COUNT is {record.count}; it must be {order.count + 1}, one more than before the shot")


def check_not_fired(record: ShotRecord, order: ShotOrder) -> None:
    """Nothing, if a record that tells of no such shot leaves the count as it was. `Contradiction`: it does not."""
    fired = record.mark == order.mark and record.ending != "NONE"
    if not fired and record.count != order.count:
        raise Contradiction(
            f"the last shot is {record.mark}, {record.ending}, so {order.mark} was not fired, but COUNT is "
            f"{record.count}; it must be {order.count}, as before"
        )


def check_times(told: BelievedShot, order: ShotOrder, speed: float) -> None:
    """Nothing, if the shot lies between its trigger and its record on the host's clock. `Contradiction`: it does not.

    `speed`: how many times faster than the world's both clocks are.
    """
    bound_s = max(told.accepted.uncertainty_s, told.end.uncertainty_s)
    if not bound_s <= MAX_UNCERTAINTY_S * speed:
        raise Contradiction(
            f"its times are known to {bound_s / speed:.3g} s only; it must be {MAX_UNCERTAINTY_S:g} s or less"
        )
    early_s = order.written_s - (told.accepted.time_s + told.accepted.uncertainty_s + ROUNDING_S)
    if early_s > 0:
        raise Contradiction(f"ACCEPTED is {early_s:.6f} s earlier than its trigger was written")
    late_s = (told.end.time_s - told.end.uncertainty_s - ROUNDING_S) - told.reply.received_s
    if late_s > 0:
        raise Contradiction(f"END is {late_s:.6f} s later than its record was read")


def check_standing(standing: StatusRecord) -> None:
    """Nothing, if the magnet will be home in a time that the wire allows. `Contradiction`: never, as good as."""
    left_us = standing.ready_us - standing.clock_us
    if left_us > _MAX_REST_US:
        raise Contradiction(f"READY is {left_us} microseconds after CLOCK; it must be {_MAX_REST_US} or less")
