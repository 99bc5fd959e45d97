"""From a shot to what is said of it on the wire, and back: times of the gun on the host's clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from device.limits import Load, load_of
from device.methods import Method, Rendering, rendering_of
from device.parameters import GunParameters
from device.serial_gun.clocks import MAX_DRIFT, HostTime
from device.serial_gun.commands import Reply
from device.wire.records import METHOD_NAME, Setting, ShotRecord, StatusRecord, Way
from device.words import Direction, Drive, Effect, LimitError, Pulse, Shot, ShotReport, ShotTiming

FLOORS_US: Final = {"PULS": 50_000, "EFF": 10_000}
"""The firmware's least time from onset to onset (`PROTOCOL.md`)."""
WAYS: Final[dict[Direction, Way]] = {"forward": "FORW", "backward": "BACK"}
_MILLI, _MICRO = 1e3, 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotRequest:
    """A shot in whole millivolts and microseconds, what the model says of it, and what it asks of the coil."""

    shot: Shot
    setting: Setting
    rendering: Rendering
    load: Load

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
    if shot.method not in methods:
        raise LimitError(f"method is {shot.method!r}; this gun renders {', '.join(methods)}")
    if METHOD_NAME.fullmatch(shot.method) is None:
        raise LimitError(f"method is {shot.method!r}; on the wire it must be 1 to 24 of a-z, 0-9 and -")
    method = methods[shot.method]
    drive = _sayable(shot.drive)
    rendering = rendering_of(method, drive)
    return ShotRequest(
        shot=Shot(method=shot.method, direction=shot.direction, drive=drive),
        setting=_setting(shot, drive, rendering),
        rendering=rendering,
        load=load_of(drive, method.resistance_ohm if isinstance(method, GunParameters) else 0.0),
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
