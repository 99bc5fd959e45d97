"""What is said of a gun and of a shot that was done: the gun's own times put beside the host's. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from device.serial_gun.asked import Order
from device.serial_gun.clocks import MAX_DRIFT, HostTime
from device.serial_gun.pending import Reply
from device.wire.records import ShotRecord, Standing
from device.words import ShotReport, ShotTiming


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """A reply, the record that it holds, how often the shot was triggered until then; its times by the host's clock."""

    reply: Reply
    record: ShotRecord
    tries: int
    accepted: HostTime
    start: HostTime
    end: HostTime


def report(order: Order, told: Told) -> ShotReport:
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


def ready_s(standing: Standing, reply: Reply, ready: HostTime) -> float:
    """When the next shot may start, by the clocks, but within what the exchange by itself makes certain.

    A clock that was misread cannot put it off.
    """
    left_s = (standing.ready_us - standing.clock_us) / 1e6
    earliest_s, latest_s = reply.written_s + left_s, reply.received_s + left_s + abs(left_s) * MAX_DRIFT
    return min(max(ready.time_s + ready.uncertainty_s, earliest_s), latest_s)
