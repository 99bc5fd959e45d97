"""The one loop that carries steps out: it tells the journal, lets gun, person or clock do it, and acknowledges.

Console, terminal and synthetic participant differ only in the `Screen` they hand over.
A train's shots are asked for a little ahead, each for its own tick, and the gun waits for it by its own clock: neither
the line nor this machine delays them. Each is in the journal before the next is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, Protocol

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
    TrainShot,
    record,
)

MAX_FAILURES = 3
"""Failures of the gun in a row after which a run stops and can be resumed."""


LEAD_S = 0.03
"""How long before its tick a shot of a train is asked for; a `next` within that time comes too late for it.

Assumed: twice what the doctor lets pass, 5 ms that a sleep overruns and 10 ms to the gun and back.
"""


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

    def said_next(self, step: Present, onset_s: float, until_s: float) -> bool:
        """Wait until the participant says next or until a time; true if they said it. `onset_s`: the first pulse."""

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
            return _confirmed(step, desk.screen.prepare(step))
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


def _confirmed(step: Prepare, outcome: Prepared | Repeat) -> Prepared | Repeat:
    """The outcome of a hand-over, with the damper that was asked for and so confirmed."""
    return replace(outcome, damper=step.damper or None) if isinstance(outcome, Prepared) else outcome


def _fire(step: Fire, desk: Desk) -> Fired | Failed:
    """One shot, armed for it alone."""
    try:
        onset_utc, report = _first(step.trial, desk)
    except (LimitError, LinkError) as error:
        return Failed(cause=str(error))
    finally:
        disarm(desk.gun)
    return Fired(gun=desk.gun_name, onset_utc=onset_utc, **_times(report))


def _times(report: ShotReport) -> dict[str, Any]:
    """What the journal keeps of a shot's report, beside what was asked for."""
    return {field.name: getattr(report, field.name) for field in fields(report) if field.name != "shot"}


def _first(trial: Trial, desk: Desk) -> tuple[str, ShotReport]:
    """The first shot of a stimulus, as soon as the magnet is home, and its date and time."""
    desk.gun.arm()
    desk.clock.sleep(desk.gun.status().ready_at_s - desk.clock.now())
    return desk.clock.utc(), _shoot(trial, desk)


def _shoot(trial: Trial, desk: Desk, at_s: float | None = None) -> ShotReport:
    shot = Shot(method=trial.method, direction=trial.direction, drive=desk.drives[trial.method])
    return desk.gun.fire(shot, at_s)


def _present(step: Present, desk: Desk) -> Presented | Failed:
    """Shots at whole multiples of the interval since the first, until next is said."""
    try:
        onset_utc, first = _first(step.trial, desk)
        shots = _journal(1, first, desk)
        while not desk.screen.said_next(step, first.pulse_start_s, (at_s := _due_s(step, first, shots, desk)) - LEAD_S):
            if shots == step.max_shots:
                return _presented(desk, onset_utc, first, shots, "limit")
            shots = _journal(shots + 1, _shoot(step.trial, desk, at_s), desk)
    except DeviceError as error:
        return Failed(cause=str(error))
    finally:
        disarm(desk.gun)
    return _presented(desk, onset_utc, first, shots, "next")


def _due_s(step: Present, first: ShotReport, shots: int, desk: Desk) -> float:
    """The next shot's tick, whole microseconds after the first; later if the magnet is not home by then."""
    tick_s = first.pulse_start_s + shots * round(step.repeat_every_s * 1e6) / 1e6
    return max(tick_s, desk.gun.status().ready_at_s)


def _journal(shot: int, report: ShotReport, desk: Desk) -> int:
    """Have a train's shot on the disk before the next is asked for; its number."""
    desk.journal.append("shot", body=record(TrainShot(shot=shot, **_times(report))))
    return shot


def _presented(
    desk: Desk, onset_utc: str, first: ShotReport, shots: int, ended_by: Literal["next", "limit"]
) -> Presented:
    return Presented(
        gun=desk.gun_name,
        onset_utc=onset_utc,
        shots=shots,
        exposure_s=desk.clock.now() - first.pulse_start_s,
        ended_by=ended_by,
    )
