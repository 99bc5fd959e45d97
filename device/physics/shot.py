"""One shot from rest as a row of results, by the chain of segments."""

from __future__ import annotations

import math

from device.physics.kernel import (
    BALLISTIC,
    BREAK_AWAY,
    COIL,
    COIL_EDGE,
    COLLISION,
    CONTACT,
    DRIVE,
    DRIVE_CHANGE,
    END,
    FIRING_END,
    FORCE_ZERO,
    FRICTION_BACK,
    FRICTION_OUT,
    GIVEN_UP,
    HEADING,
    HOME,
    HORIZON_S,
    IMPACT,
    IMPULSE,
    INDUCTANCE,
    IS,
    KIND,
    LAST_IMPACT,
    LAST_LANDING,
    LIMIT,
    MASS,
    MAX_SEGMENTS,
    MODEL,
    MOTOR,
    NO_BREAK_AWAY,
    NOT_HOME,
    OPEN,
    ORDER,
    PEAK,
    PULSE,
    QS,
    RECOIL_END,
    RESET_END,
    RESULT_SIZE,
    SEGMENTS,
    SETTLED,
    STAGE,
    STATE_SIZE,
    STATUS,
    STEP,
    STIFFNESS,
    STOP,
    STUCK,
    TIME,
    TOP,
    TURN,
    USED,
    VS,
    XS,
    Floats,
    I,
    V,
    X,
    clear,
    kernel,
)
from device.physics.polynomial import bracketed_root, changes_between, lowest, value
from device.physics.segments import advance, enter, grip, pulse_off, pulse_on, spring_force
from device.physics.series import friction

_EQUAL = 1e-14  # relative: forces closer than this are one
_NARROWEST = 1e-6  # of a step: no two peaks of the force lie closer
_WAITING, _OPEN_STAGE, _OVER = 0.0, 1.0, 2.0  # the recoil stage


@kernel
def shoot(p: Floats, s: Floats, w: Floats, out: Floats) -> None:
    """One shot from rest into `out`."""
    clear(s, STATE_SIZE, 0.0)
    s[END] = HORIZON_S
    shoot_on(p, s, w, out)


@kernel
def shoot_on(p: Floats, s: Floats, w: Floats, out: Floats) -> None:
    """One shot into `out`, from the motion and current in `s` to the end that `s` gives it, where it leaves `s`."""
    clear(out, RESULT_SIZE, math.nan)
    out[TOP], out[STAGE], s[HEADING] = s[X], _WAITING, 0.0
    pulse_on(p, s)
    enter(p, s, BREAK_AWAY)
    event = GIVEN_UP
    for n in range(MAX_SEGMENTS):
        out[SEGMENTS] = float(n + 1)
        event = advance(p, s, w)
        note(p, s, w, event, out)
        if p[MODEL] == BALLISTIC and out[STAGE] == _OVER:
            event = coast(p, s, out)
            break
        if event in (SETTLED, GIVEN_UP) or (event == DRIVE_CHANGE and s[LIMIT] == s[END]):
            break
        if event == DRIVE_CHANGE:
            pulse_off(p, s)
        enter(p, s, event)
    conclude(p, s, event, out)


@kernel
def note(p: Floats, s: Floats, w: Floats, event: int, out: Floats) -> None:
    """What a segment adds to the results."""
    out[TOP] = max(out[TOP], s[X])
    if out[STAGE] != _OVER and s[HEADING] != 0.0:
        note_recoil(p, s, w, event, out)
    if event == TURN and s[HEADING] > 0.0 and math.isnan(out[FIRING_END]):
        out[FIRING_END] = s[TIME]
    elif event == STOP:
        out[LAST_LANDING], out[LAST_IMPACT] = s[TIME], s[V]
        if s[TIME] >= p[PULSE] and math.isnan(out[RESET_END]):
            out[RESET_END], out[IMPACT] = s[TIME], -s[V]


@kernel
def note_recoil(p: Floats, s: Floats, w: Floats, event: int, out: Floats) -> None:
    """The recoil stage's peak, and its end. A pulse that meets the magnet on its way home is part of it."""
    if s[KIND] == COIL and event != GIVEN_UP and (s[HEADING] > 0.0 or s[DRIVE] > 0.0):
        start = out[PEAK] if out[STAGE] == _OPEN_STAGE else force_on_hand(p, s[HEADING], w[XS], w[IS])
        out[STAGE] = _OPEN_STAGE
        out[PEAK] = peak_force(p, s, w, max(start, force_on_hand(p, s[HEADING], s[X], s[I])))
    cut = event == DRIVE_CHANGE and (p[OPEN] != 0.0 or p[INDUCTANCE] == 0.0) and s[LIMIT] != s[END]
    if s[HEADING] > 0.0 and (cut or event in (COIL_EDGE, FORCE_ZERO, TURN)):
        out[STAGE], out[RECOIL_END], out[IMPULSE] = _OVER, s[TIME], p[MASS] * s[V]


@kernel
def force_on_hand(p: Floats, heading: float, x: float, i: float) -> float:
    """The force on the hand F = m d2x/dt2 (equation 1) of a moving magnet."""
    return p[MOTOR] * grip(p, x) * i - spring_force(p, x) + friction(p, heading)


@kernel
def peak_force(p: Floats, s: Floats, w: Floats, best: float) -> float:
    """The largest force of a step, if above `best`, which is at least that of its ends: a top is a root of dF/dt."""
    used = s[USED]
    if not rises_above(p, s, w, best):
        return best
    for n in range(ORDER - 1):
        w[QS + n] = (n + 1) * (n + 2) * w[VS + n + 2]
    w[QS + ORDER - 1], w[QS + ORDER] = 0.0, 0.0
    if abs(w[QS]) + lowest(w, QS, math.copysign(1.0, w[QS])) > 0.0:
        return best  # the force only rises or only falls
    low, width = 0.0, used
    while low < used:
        high = min(low + width, used)
        changes = changes_between(w, QS, low, high)
        if changes > 1 and width > _NARROWEST:
            width *= 0.5
            continue
        if changes > 0 or high < used:
            top = bracketed_root(w, QS, low, high) if changes == 1 else high
            best = max(best, force_on_hand(p, s[HEADING], value(w, XS, top), value(w, IS, top)))
        low, width = high, 2.0 * width
    return best


@kernel
def rises_above(p: Floats, s: Floats, w: Floats, best: float) -> bool:
    """Whether the force may rise above `best` within the step, by the bound of its series, m (n + 1) v[n + 1]/span."""
    even, odd = w[VS + 1], 0.0
    for n in range(2, ORDER, 2):
        even += n * max(w[VS + n], 0.0)
        odd += (n + 1) * max(w[VS + n + 1], 0.0)
    high = even + odd + ORDER * max(w[VS + ORDER], 0.0)
    return high * p[MASS] / s[STEP] > best + _EQUAL * abs(best)


@kernel
def coast(p: Floats, s: Floats, out: Floats) -> int:
    """The rest of a shot without coil, by energy, and its times under the mean of the spring's force."""
    k, energy = p[STIFFNESS], 0.5 * p[MASS] * s[V] * s[V]
    held = spring_force(p, s[X]) + p[FRICTION_OUT]
    rise = 2.0 * energy / (held + math.sqrt(held * held + 2.0 * k * energy)) if energy > 0.0 else 0.0
    s[X] += rise
    out[TOP], out[FIRING_END] = s[X], s[TIME] + (2.0 * rise / s[V] if rise > 0.0 else 0.0)
    pull = spring_force(p, 0.5 * s[X]) - p[FRICTION_BACK]
    if pull <= 0.0 or spring_force(p, s[X]) <= p[FRICTION_BACK]:
        return SETTLED
    speed = math.sqrt(2.0 * pull * s[X] / p[MASS])
    out[RESET_END], out[IMPACT] = out[FIRING_END] + 2.0 * s[X] / speed, speed
    s[X] = 0.0
    return SETTLED


@kernel
def conclude(p: Floats, s: Floats, event: int, out: Floats) -> None:
    """The status, and the landing that counts: the first after the pulse, else the last of all."""
    out[STATUS] = float(status_of(s, event, out))
    if out[STATUS] != HOME:
        out[RESET_END], out[IMPACT] = math.nan, math.nan
    elif math.isnan(out[RESET_END]) and not math.isnan(out[LAST_LANDING]):
        out[RESET_END], out[IMPACT] = out[LAST_LANDING], -out[LAST_IMPACT]
    out[COLLISION] = p[MASS] * out[IMPACT] * out[IMPACT] / p[CONTACT]


@kernel
def status_of(s: Floats, event: int, out: Floats) -> int:
    """How the shot ended, as a number of `STATUSES`."""
    if event != SETTLED:
        return NOT_HOME
    if s[X] > 0.0:
        return STUCK
    return NO_BREAK_AWAY if out[STAGE] == _WAITING and math.isnan(out[LAST_LANDING]) else HOME
