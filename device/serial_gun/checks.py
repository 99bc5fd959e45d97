"""What must hold of a gun's word before it is believed: against the order, itself, and this machine's clock. Pure.

Whatever a gun says, a shot that passes began between the writing of its trigger and the reading of its record, give or
take the uncertainty: a faulty gun, firmware or line cannot put it elsewhere.
"""

from __future__ import annotations

from typing import Final

from device.serial_gun.commands import Contradiction, CutShort
from device.serial_gun.reports import BelievedShot, ShotOrder
from device.wire.records import ShotRecord, StatusRecord

MAX_UNCERTAINTY_S: Final = 0.05
"""The most by which the two clocks may disagree for a shot to count, in seconds of the real world. Assumed: it lets
through a line whose quickest round trip takes 0.1 s, three times that of an adapter that keeps bytes back for 16 ms
each way; `recoil doctor` warns from 0.01 s on. A response time that is off by more is none."""
MAX_REST_US: Final = 10_000_000
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
    if left_us > MAX_REST_US:
        raise Contradiction(f"READY is {left_us} microseconds after CLOCK; it must be {MAX_REST_US} or less")
