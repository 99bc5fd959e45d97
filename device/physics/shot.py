"""One shot from rest, by the chain of its segments, and its summary: interpreted in about half a millisecond."""

# ruff: noqa: PLR0124 - NaN is what does not equal itself, and summaries are made by the million

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from device.limits import TICKS
from device.parameters import GunParameters
from device.physics.equations import (
    BALLISTIC,
    BREAK_AWAY,
    COIL,
    COIL_EDGE,
    DRIVE_CHANGE,
    FARTHEST,
    FORCE_ZERO,
    GIVEN_UP,
    HOME,
    HORIZON_S,
    MAX_SEGMENTS,
    MAX_WORK,
    NO_BREAK_AWAY,
    NOT_HOME,
    ORDER,
    OVER,
    RECOILING,
    SETTLED,
    STATUSES,
    STOP,
    STUCK,
    TURN,
    WAITING,
    Constants,
    ShotResult,
    ShotState,
    Status,
    StepSeries,
    force_on_hand,
    model_number,
    pack,
    spring_force,
)
from device.physics.polynomial import (
    bernstein_over,
    bracketed_root,
    falling_crossing,
    falls,
    halve,
    least_sum,
    next_piece,
    sign_changes,
    value_at,
)
from device.physics.segments import advance, enter, pulse_off, pulse_on
from device.physics.slips import slip_on

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

SAME_FORCE = 1e-14  # relative: forces closer than this are one
_NARROWEST = 1e-6  # of a step: no two peaks of the force lie closer


def shoot(p: Constants, s: ShotState, w: StepSeries, out: ShotResult) -> None:
    """One shot from rest into `out`."""
    rest_at_stop(s)
    shoot_on(p, s, w, out)


def rest_at_stop(s: ShotState) -> None:
    """The state before the first shot."""
    s.x, s.v, s.i, s.until, s.farthest = 0.0, 0.0, 0.0, HORIZON_S, FARTHEST


def shoot_on(p: Constants, s: ShotState, w: StepSeries, out: ShotResult) -> None:
    """One shot into `out`, from the motion and current in `s` to the end that `s` gives it, where it leaves `s`."""
    w.work = 0
    begin(p, s, out)
    event = GIVEN_UP
    for _ in range(MAX_SEGMENTS):
        event = advance(p, s, w)
        w.work += 1
        note(p, s, w, event, out)
        if p.model == BALLISTIC and out.stage == OVER:
            event = coast(p, s, out)
            break
        if w.work > MAX_WORK or not goes_on(p, s, event):
            break
        if event == BREAK_AWAY:
            slip_on(p, s, w, out)
    conclude(p, s, event, out)


def begin(p: Constants, s: ShotState, out: ShotResult) -> None:
    """The first segment of a shot."""
    forget(out)
    out.max_displacement_m, s.heading, s.slips = s.x, 0.0, 0
    pulse_on(p, s)
    enter(p, s, BREAK_AWAY)


def goes_on(p: Constants, s: ShotState, event: int) -> bool:
    """Whether a segment follows on the event, which `s` then is at the beginning of."""
    if event in (SETTLED, GIVEN_UP) or (event == DRIVE_CHANGE and s.drive_until == s.until):
        return False
    if event == DRIVE_CHANGE:
        pulse_off(p, s)
    enter(p, s, event)
    return True


def forget(out: ShotResult) -> None:
    """Nothing is reached yet."""
    out.status, out.stage = NOT_HOME, WAITING
    out.peak_force_N, out.recoil_end_s, out.recoil_impulse_Ns = math.nan, math.nan, math.nan
    out.firing_end_s, out.max_displacement_m = math.nan, math.nan
    out.reset_end_s, out.impact_speed_m_s, out.collision_force_N = math.nan, math.nan, math.nan
    out.last_landing_s, out.last_impact_m_s = math.nan, math.nan


def note(p: Constants, s: ShotState, w: StepSeries, event: int, out: ShotResult) -> None:
    """What a segment adds to the results."""
    if s.kind == COIL and out.stage != OVER and event != GIVEN_UP and (s.heading > 0.0 or s.u > 0.0):
        note_peak(p, s, w, out)
    note_end(p, s, event, out)


def note_peak(p: Constants, s: ShotState, w: StepSeries, out: ShotResult) -> None:
    """The recoil stage's peak. A pulse that meets the magnet on its way home is part of it."""
    start = out.peak_force_N if out.stage == RECOILING else force_on_hand(p, s.heading, w.x[0], w.i[0])
    out.stage = RECOILING
    out.peak_force_N = peak_force(p, s, w, max(start, force_on_hand(p, s.heading, s.x, s.i)))


def note_end(p: Constants, s: ShotState, event: int, out: ShotResult) -> None:
    """What the end of a segment adds: how far the magnet is, the recoil stage's end, the turn, the landing."""
    out.max_displacement_m = max(out.max_displacement_m, s.x)
    if out.stage != OVER and s.heading > 0.0:
        cut = event == DRIVE_CHANGE and (p.opens or p.inductance == 0.0) and s.drive_until != s.until
        if cut or event in (COIL_EDGE, FORCE_ZERO, TURN):
            out.stage, out.recoil_end_s, out.recoil_impulse_Ns = OVER, s.time, p.mass * s.v
    if event == TURN and s.heading > 0.0 and math.isnan(out.firing_end_s):
        out.firing_end_s = s.time
    elif event == STOP:
        out.last_landing_s, out.last_impact_m_s = s.time, s.v
        if s.time >= p.pulse_s and math.isnan(out.reset_end_s):
            out.reset_end_s, out.impact_speed_m_s = s.time, -s.v


def peak_force(p: Constants, s: ShotState, w: StepSeries, best: float) -> float:
    """The largest force of a step, if above `best`, which is at least that of its ends: a top is a root of dF/dt."""
    if not rises_above(p, s, w, best):
        return best
    for n in range(ORDER - 1):
        w.other[n] = (n + 1) * (n + 2) * w.v[n + 2]
    w.other[ORDER - 1], w.other[ORDER] = 0.0, 0.0
    if falls(w.other) > 0.0:
        w.work += 1
        top = falling_crossing(w.other, s.used)
        return max(best, force_on_hand(p, s.heading, value_at(w.x, top), value_at(w.i, top))) if top < 2.0 else best
    low, width, halved, used = 0.0, s.used, False, s.used
    bernstein_over(w, low, used)
    while low < used:
        high, changes = min(low + width, used), sign_changes(w.bernstein)
        if changes > 1 and width > _NARROWEST:
            w.work += 1
            halve(w)
            width, halved = 0.5 * width, True
            continue
        if changes > 0 or high < used:
            top = bracketed_root(w, low, high) if changes == 1 else high
            best = max(best, force_on_hand(p, s.heading, value_at(w.x, top), value_at(w.i, top)))
        width = next_piece(w, high, used, width, halved)
        low, halved = high, False
    return best


def rises_above(p: Constants, s: ShotState, w: StepSeries, best: float) -> bool:
    """Whether the force may rise above `best` within the step, by its series, m (n + 1) v[n + 1]/span."""
    for n in range(ORDER):
        w.other[n] = (n + 1) * w.v[n + 1]
    w.other[ORDER] = 0.0
    return -least_sum(w.other, -1.0) > (best + SAME_FORCE * abs(best)) * s.span / p.mass


def coast(p: Constants, s: ShotState, out: ShotResult) -> int:
    """The rest of a shot without coil, by energy, and its times under the mean of the spring's force."""
    k, energy = p.stiffness, 0.5 * p.mass * s.v * s.v
    held = spring_force(p, s.x) + p.friction_out
    rise = 2.0 * energy / (held + math.sqrt(held * held + 2.0 * k * energy)) if energy > 0.0 else 0.0
    s.x += rise
    out.max_displacement_m, out.firing_end_s = s.x, s.time + (2.0 * rise / s.v if rise > 0.0 else 0.0)
    pull = spring_force(p, 0.5 * s.x) - p.friction_back
    if pull <= 0.0 or spring_force(p, s.x) <= p.friction_back:
        return SETTLED
    speed = math.sqrt(2.0 * pull * s.x / p.mass)
    out.reset_end_s, out.impact_speed_m_s = out.firing_end_s + 2.0 * s.x / speed, speed
    s.x = 0.0
    return SETTLED


def conclude(p: Constants, s: ShotState, event: int, out: ShotResult) -> None:
    """The status, and the landing that counts: the first after the pulse, else the last of all."""
    out.status = status_of(s, event, out)
    if out.status != HOME:
        out.reset_end_s, out.impact_speed_m_s = math.nan, math.nan
    elif math.isnan(out.reset_end_s) and not math.isnan(out.last_landing_s):
        out.reset_end_s, out.impact_speed_m_s = out.last_landing_s, -out.last_impact_m_s
    out.collision_force_N = p.mass * out.impact_speed_m_s * out.impact_speed_m_s / p.contact_depth


def status_of(s: ShotState, event: int, out: ShotResult) -> int:
    """How the shot ended, as a number of `STATUSES`."""
    if event != SETTLED:
        return NOT_HOME
    if s.x > 0.0:
        return STUCK
    return NO_BREAK_AWAY if out.stage == WAITING and math.isnan(out.last_landing_s) else HOME


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotSummary:
    """What one shot comes to. What was not reached is None.

    The recoil stage lasts from the first rise of F_m until F_m falls to 0 (or, if that is earlier, until the magnet
    turns while the coil still pushes: there is no bullet firing stage then). Firing ends at the first dx/dt = 0,
    resetting when the magnet meets its stop at x = 0. The current that a shorted coil still carries may then lift it
    off once more, by micrometres; the summary leaves that hop out, the trace shows it. `max_displacement_m` is 0 if
    the magnet never broke away.

    Status: `home`; `no-break-away`; `stuck` (friction holds the magnet off its stop); `not-home` (still moving or
    held by the coil after 10 s, more work than `MAX_WORK`, or beyond what floats can express).
    """

    status: Status
    peak_force_N: float | None  # largest F in the recoil stage
    recoil_end_s: float | None
    recoil_impulse_Ns: float | None  # integral of F over the recoil stage = m v at its end
    firing_end_s: float | None
    max_displacement_m: float | None
    reset_end_s: float | None
    impact_speed_m_s: float | None  # at the landing that ends the resetting stage
    collision_force_N: float | None  # equation (4): m v^2 / x_k


def summary_from(row: Sequence[Any]) -> ShotSummary:
    """A summary from its numbers in their order; NaN, which equals nothing, is what was not reached.

    The slots are filled one by one: the frozen dataclass's own constructor, or a loop, takes a third of the time of a
    compiled shot.
    """
    status, peak, recoil, impulse, firing, top, reset, impact, collision = row
    summary = object.__new__(ShotSummary)
    _fill_status(summary, STATUSES[status])
    _fill_peak(summary, peak if peak == peak else None)
    _fill_recoil(summary, recoil if recoil == recoil else None)
    _fill_impulse(summary, impulse if impulse == impulse else None)
    _fill_firing(summary, firing if firing == firing else None)
    _fill_top(summary, top if top == top else None)
    _fill_reset(summary, reset if reset == reset else None)
    _fill_impact(summary, impact if impact == impact else None)
    _fill_collision(summary, collision if collision == collision else None)
    return summary


_NAMES = tuple(one.name for one in fields(ShotSummary))
_numbers = attrgetter(*_NAMES)
(
    _fill_status,
    _fill_peak,
    _fill_recoil,
    _fill_impulse,
    _fill_firing,
    _fill_top,
    _fill_reset,
    _fill_impact,
    _fill_collision,
) = (getattr(ShotSummary, name).__set__ for name in _NAMES)


def simulate(parameters: GunParameters, fidelity: str = "full") -> ShotSummary:
    """The summary of one shot from rest. `ValueError`: no such fidelity; `TypeError`: no parameters of a gun.

    >>> shot = simulate(GunParameters(friction_N=1.12))
    >>> shot.status, round(shot.peak_force_N, 2), round(shot.reset_end_s, 3)
    ('home', 35.14, 0.211)
    """
    if not isinstance(parameters, GunParameters):
        raise TypeError(f"parameters is {parameters!r}; it must be GunParameters, such as GunParameters(voltage_V=20)")
    return summary_from(_numbers(interpret(pack(parameters, model_number(fidelity)))))


def interpret(constants: Constants) -> ShotResult:
    """The result of one shot, by Python alone. Numbers beyond floats make it `not-home`."""
    state, result = ShotState(), ShotResult()
    try:
        shoot(constants, state, StepSeries(), result)
    except (ArithmeticError, ValueError):  # what Python raises where compiled code goes on with inf and NaN
        conclude(constants, state, GIVEN_UP, result)
    return result


def highest_rate_Hz(gun: GunParameters) -> float:  # noqa: N802 - the unit ends the name
    """The highest rate at which every shot starts from home; 0 if the magnet does not come home."""
    summary = simulate(gun)
    if summary.status != "home" or summary.reset_end_s is None:
        return 0.0
    return float(rates_of_periods_Hz(max(summary.reset_end_s, gun.pulse_s)))


def rates_of_periods_Hz(period_s: ArrayLike) -> NDArray[Any]:  # noqa: N802 - the unit ends the name
    """The rates of shots that far apart or, as onsets are whole microseconds, a little further."""
    import numpy as np  # noqa: PLC0415 - slow, and one shot needs none of it

    return np.asarray(TICKS / np.ceil(np.asarray(period_s) * TICKS))
