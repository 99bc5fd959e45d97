"""The one loop that carries steps out: it tells the journal, lets gun, person or clock do it, and acknowledges.

Console, terminal and synthetic participant differ only in the `Screen` they hand over.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from device import DeviceError, Gun, LimitError, LinkError, Shot, ShotReport
from device.words import Drive, Identity
from experiments.clock import Clock
from experiments.journal import Journal
from experiments.plan import Trial
from experiments.steps import (
    Answered,
    Ask,
    Describe,
    Described,
    Failed,
    Fire,
    Fired,
    History,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Presented,
    Rate,
    Rated,
    Repeat,
    Rest,
    Rested,
    Session,
    Standing,
    Step,
    record,
)

MAX_FAILURES = 3
"""Failures of the gun in a row after which a run stops and can be resumed."""


class RunStopped(Exception):  # noqa: N818 - a stop is not an error
    """The run stops here on purpose or for want of a gun; it can be resumed."""


class Screen(Protocol):
    """Where a step meets a person, real or synthetic. `shown_s` is when the step that waits was painted, if known."""

    shown_s: float | None

    def begin(self, desk: Desk, standing: Standing) -> None:
        """Take the place at the desk, where the run stands so."""

    def prepare(self, step: Prepare) -> Prepared | Repeat:
        """Have the gun turned, set and handed over; or ask for an earlier trial of the set again."""

    def ask(self, step: Ask, onset_s: float) -> Answered | Repeat:
        """Have the direction judged; `onset_s` is when the pulse began. Or ask for the stimulus again."""

    def rest(self, step: Rest) -> Rested:
        """Have the break taken."""

    def said_next(self, step: Present, until_s: float) -> bool:
        """Wait until the participant says next or until a time; true if they said it."""

    def rate(self, step: Rate) -> Rated:
        """Have a stimulus rated."""

    def describe(self, step: Describe) -> Described:
        """Have a stimulus described."""

    def acknowledge(self, step: Step, outcome: Outcome) -> None:
        """Show that an outcome is safe: its record is on the disk."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """All that carries steps out: gun and how each method drives it, screen, journal and clock."""

    gun: Gun
    gun_name: str
    drives: Mapping[str, Drive]
    screen: Screen
    journal: Journal
    clock: Clock


def gun_name(identity: Identity) -> str:
    """Who renders, as the tables say it: `simulated`, or model and serial number."""
    return identity.model if identity.model == identity.serial else f"{identity.model}:{identity.serial}"


def disarm(gun: Gun) -> None:
    """Disarm, or stop the run: nobody is to hold a gun that may fire. `RunStopped` says what to do."""
    try:
        gun.disarm()
    except DeviceError as error:
        raise RunStopped(f"the gun cannot be disarmed ({error}): switch off its power") from error


def carry_out(session: Session, desk: Desk, standing: Standing) -> History:
    """Carry out a session from where it stands to its end, and return all that was done.

    `RunStopped`, `JournalError` and interrupts pass through; whatever happens, the gun is disarmed.
    """
    step, done, failures, onset_s = standing.step, list(standing.history), 0, math.nan
    desk.screen.begin(desk, standing)
    try:
        while step is not None:
            desk.journal.append("step", body=record(step))
            desk.screen.shown_s = None
            outcome = _do(step, desk, onset_s)
            desk.journal.append("outcome", body=record(outcome), **_shown(desk.screen))
            desk.screen.acknowledge(step, outcome)
            done.append((step, outcome))
            failures = _count(failures, outcome)
            onset_s = outcome.pulse_start_s if isinstance(outcome, Fired) else onset_s
            step = _next(session, outcome)
    finally:
        session.close()
        disarm(desk.gun)
    return done


def _shown(screen: Screen) -> dict[str, float]:
    """When the step was painted, where that is known."""
    return {} if screen.shown_s is None else {"shown_s": screen.shown_s}


def _next(session: Session, outcome: Outcome) -> Step | None:
    try:
        return session.send(outcome)
    except StopIteration:
        return None


def _count(failures: int, outcome: Outcome) -> int:
    if isinstance(outcome, Prepared):
        return failures
    if not isinstance(outcome, Failed):
        return 0
    if failures + 1 == MAX_FAILURES:
        raise RunStopped(f"the gun failed {MAX_FAILURES} times in a row, last: {outcome.cause}")
    return failures + 1


def _do(step: Step, desk: Desk, onset_s: float) -> Outcome:
    match step:
        case Prepare():
            return desk.screen.prepare(step)
        case Fire():
            return _fire(step, desk)
        case Ask():
            return desk.screen.ask(step, onset_s)
        case Rest():
            return desk.screen.rest(step)
        case Present():
            return _present(step, desk)
        case Rate():
            return desk.screen.rate(step)
        case Describe():
            return desk.screen.describe(step)


def _fire(step: Fire, desk: Desk) -> Fired | Failed:
    """One shot, armed for it alone."""
    try:
        desk.gun.arm()
        onset_utc, report = _shoot(step.trial, desk)
    except (LimitError, LinkError) as error:
        return Failed(cause=str(error))
    finally:
        disarm(desk.gun)
    return Fired(
        gun=desk.gun_name,
        onset_utc=onset_utc,
        requested_s=report.requested_s,
        pulse_start_s=report.pulse_start_s,
        pulse_end_s=report.pulse_end_s,
        home_predicted_s=report.home_predicted_s,
        motion=report.motion,
        timing=report.timing,
    )


def _shoot(trial: Trial, desk: Desk) -> tuple[str, ShotReport]:
    desk.clock.sleep(desk.gun.status().ready_at_s - desk.clock.now())
    shot = Shot(method=trial.method, direction=trial.direction, drive=desk.drives[trial.method])
    onset_utc = desk.clock.utc()
    return onset_utc, desk.gun.fire(shot)


def _present(step: Present, desk: Desk) -> Presented | Failed:
    """Shots at whole multiples of the interval since the first, until next is said."""
    try:
        desk.gun.arm()
        onset_utc, first = _shoot(step.trial, desk)
        reports = [first]
        while not desk.screen.said_next(step, first.pulse_start_s + len(reports) * step.repeat_every_s):
            if len(reports) == step.max_shots:
                return _presented(desk, onset_utc, reports, "limit")
            reports.append(_shoot(step.trial, desk)[1])
    except DeviceError as error:
        return Failed(cause=str(error))
    finally:
        disarm(desk.gun)
    return _presented(desk, onset_utc, reports, "next")


def _presented(desk: Desk, onset_utc: str, reports: list[ShotReport], ended_by: str) -> Presented:
    return Presented(
        gun=desk.gun_name,
        onset_utc=onset_utc,
        shots=len(reports),
        exposure_s=desk.clock.now() - reports[0].pulse_start_s,
        ended_by="next" if ended_by == "next" else "limit",
        timings=tuple(report.timing for report in reports if report.timing),
    )
