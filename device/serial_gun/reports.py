"""What is said of a shot that was done: the gun's own times put beside the host's. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from device.serial_gun.asked import Order
from device.serial_gun.clocks import HostTime
from device.serial_gun.link import Reply
from device.wire.records import ShotRecord
from device.words import ShotReport, ShotTiming


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """The reply that told of a shot, how often it was triggered until then, and its times on the host's clock."""

    reply: Reply
    tries: int
    accepted: HostTime
    start: HostTime
    end: HostTime


def report(record: ShotRecord, order: Order, told: Told) -> ShotReport:
    """The report of a shot, from the gun's record of it."""
    return ShotReport(
        shot=order.wanted.shot,
        requested_s=order.requested_s,
        pulse_start_s=told.start.time_s,
        pulse_end_s=told.end.time_s,
        home_predicted_s=told.start.time_s + order.wanted.rendering.settle_s,
        motion=order.wanted.rendering.motion,
        timing=ShotTiming(
            requested_s=order.requested_s,
            written_s=told.reply.written_s,
            acknowledged_s=told.reply.received_s,
            accepted_s=told.accepted.time_s,
            pulse_start_s=told.start.time_s,
            pulse_end_s=told.end.time_s,
            uncertainty_s=told.start.uncertainty_s,
            gun_accepted_us=record.accepted_us,
            gun_start_us=record.start_us,
            gun_end_us=record.end_us,
            asked=told.tries,
        ),
    )
