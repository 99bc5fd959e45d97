"""What a plug-in may say of a shot and of itself: what cannot be is not believed, and what is believed is plain.

A report is written into a journal that has to be read again: so its times are floats, its counts whole numbers, and its
words a line of text, whatever the plug-in made them of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, get_args

from device.methods import Rendering
from device.words import GunState, GunStatus, Pulse, Shot, ShotReport, ShotTiming, is_finite, is_whole_number

HANDED_OVER_S = 0.05
"""So long before its time a shot is handed to the plug-in; until then the guard alone waits. Assumed: a train's shots
are asked for 30 ms ahead, so none of a run waits here."""
CLOCK_SLACK_S = 0.001
"""So much a plug-in's times may lie outside of what this machine's clock allows. Assumed."""
LENGTH_SLACK_S, LENGTH_SLACK_PART = 0.0002, 0.02
"""So much a pulse may be longer or shorter than ordered: as on the wire, where more is told as late or cut."""
MOST_SHOTS = 10**12
"""No gun counts so many."""
LONGEST_READY_S = 60.0
"""So far ahead a plug-in may put its next shot: as long as the limit of shots a minute can make one wait."""
MOST_UNCERTAIN_S = 1.0
"""A time that is not known any better is none."""
_LONGEST_LINE = 200
"""A line of text that a plug-in says has no more characters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginOrder:
    """One shot as it was handed over: when it was asked for, when it is due, and what the model says of it."""

    shot: Shot
    requested_s: float
    start_s: float
    rendering: Rendering

    @property
    def longest_s(self) -> float:
        """How long it may be driven: a pulse's length, a vibration's duration."""
        drive = self.shot.drive
        return drive.pulse_s if isinstance(drive, Pulse) else self.rendering.settle_s


def broken_rule(order: PluginOrder, report: object, now_s: float) -> str:
    """The first rule that a plug-in's report breaks, with its values; empty if there is none."""
    if not isinstance(report, ShotReport):
        return f"fire gave back {report!r}; it must be a ShotReport"
    if report.shot != order.shot:
        return f"it reports {report.shot}; ordered was {order.shot}"
    times = tuple(getattr(report, name) for name in _TIMES)
    if not all(map(is_finite, times)):
        return f"its times are {', '.join(map(repr, times))}; they must be finite seconds of the host's clock"
    early_s, late_s = order.start_s - CLOCK_SLACK_S, max(order.start_s, now_s) + HANDED_OVER_S
    if not early_s <= report.pulse_start_s <= late_s:
        return (
            f"it reports an onset at {report.pulse_start_s:.6f} s; it must lie between {early_s:.6f} s, when the shot "
            f"was due, and {late_s:.6f} s, when it was reported"
        )
    return _broken_length(order, report)


def _broken_length(order: PluginOrder, report: ShotReport) -> str:
    length_s, longest_s = report.pulse_end_s - report.pulse_start_s, order.longest_s
    slack_s = max(LENGTH_SLACK_S, LENGTH_SLACK_PART * longest_s)
    shortest_s = longest_s if isinstance(order.shot.drive, Pulse) else 0.0
    if not shortest_s - slack_s <= length_s <= longest_s + slack_s:
        return f"it reports a drive of {length_s:.6f} s; ordered was {longest_s:.6f} s"
    if report.home_predicted_s < report.pulse_end_s:
        return f"it is home at {report.home_predicted_s:.6f} s, before its drive ends at {report.pulse_end_s:.6f} s"
    if report.home_predicted_s > report.pulse_end_s + LONGEST_READY_S:
        return f"it is home {report.home_predicted_s - report.pulse_end_s:.6g} s later; at most {LONGEST_READY_S:g} s"
    if not is_line(report.motion):
        return f"its motion is {report.motion!r}; it must be a line of text"
    return "" if report.timing is None else _broken_timing(report, report.timing)


_WHOLE = ("gun_accepted_us", "gun_start_us", "gun_end_us", "gun_count", "asked")


def _broken_timing(report: ShotReport, timing: object) -> str:
    """The first rule that the account of how a shot came about breaks."""
    if not isinstance(timing, ShotTiming):
        return f"its timing is {timing!r}; it must be a ShotTiming, or None"
    for one in fields(ShotTiming):
        value = getattr(timing, one.name)
        if one.name in _WHOLE and not (is_whole_number(value) and 0 <= value < MOST_SHOTS):
            return f"its timing.{one.name} is {value!r}; it must be a whole number of at least 0"
        if not is_finite(value):
            return f"its timing.{one.name} is {value!r}; it must be finite seconds of the host's clock"
    if not 0 <= timing.uncertainty_s <= MOST_UNCERTAIN_S:
        return f"its timing.uncertainty_s is {timing.uncertainty_s:g}; it must lie between 0 and {MOST_UNCERTAIN_S:g}"
    slack_s = timing.uncertainty_s + CLOCK_SLACK_S
    for name in ("pulse_start_s", "pulse_end_s"):
        said, told = getattr(report, name), getattr(timing, name)
        if abs(said - told) > slack_s:
            return f"its timing.{name} is {told:.6f} s; its report has {said:.6f} s"
    return ""


def plain_report(report: ShotReport) -> ShotReport:
    """A report that was believed, in Python's own numbers."""
    times: dict[str, Any] = {name: float(getattr(report, name)) for name in _TIMES}
    return replace(report, **times, motion=str(report.motion), timing=report.timing and _plain_timing(report.timing))


_TIMES = ("pulse_start_s", "pulse_end_s", "home_predicted_s")


def _plain_timing(timing: ShotTiming) -> ShotTiming:
    numbers: dict[str, Any] = {
        one.name: (int if one.name in _WHOLE else float)(getattr(timing, one.name)) for one in fields(ShotTiming)
    }
    return ShotTiming(**numbers)


def is_line(value: object) -> bool:
    """Whether it is a line of text, which can be shown and written down."""
    return isinstance(value, str) and 0 < len(value) <= _LONGEST_LINE and value.isprintable()


def broken_status(said: object, now_s: float) -> str:
    """The first rule that a plug-in's status breaks, with its value; empty if there is none."""
    broken = ""
    if not isinstance(said, GunStatus):
        broken = f"{said!r}; it must be a GunStatus"
    elif said.state not in get_args(GunState):
        broken = f"state {said.state!r}; it must be one of {', '.join(get_args(GunState))}"
    elif not (is_whole_number(said.shots) and 0 <= said.shots < MOST_SHOTS):
        broken = f"shots {said.shots!s:.20}; it must be a whole number of at least 0"
    elif not (said.fault is None or (is_line(said.fault) and said.state == "fault")):
        broken = f"fault {said.fault!r} in state {said.state}; it must be None, or a line of text in state fault"
    elif not is_finite(said.coil_temperature_C):
        broken = f"coil_temperature_C {said.coil_temperature_C!r}; it must be finite"
    elif not (said.ready_at_s == -math.inf or is_finite(said.ready_at_s)) or said.ready_at_s > now_s + LONGEST_READY_S:
        broken = f"ready_at_s {said.ready_at_s!r}; it must be at most {LONGEST_READY_S:g} s ahead of {now_s:.3f}"
    return broken
