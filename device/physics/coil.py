"""One Taylor step with the magnet moving inside a live coil, ended by the first event in it."""

from __future__ import annotations

import math

from device.physics.kernel import (
    BACK_EMF,
    COIL_EDGE,
    CONTINUES,
    DRIVE,
    DRIVE_CHANGE,
    FORCE_ZERO,
    GIVEN_UP,
    HEADING,
    INDUCTANCE,
    IS,
    LIMIT,
    MASS,
    MOTOR,
    ORDER,
    QS,
    REACH,
    RESISTANCE,
    SPAN,
    STEP,
    STIFFNESS,
    STOP,
    TIME,
    TRANSIENT_END,
    TURN,
    USED,
    VS,
    XS,
    Floats,
    I,
    V,
    X,
    kernel,
)
from device.physics.polynomial import first_crossing, lowest, value, value_at_end
from device.physics.series import expand, expand_slaved, fit, follow, rescale

_TRANSIENT = 40.0  # time constants of the current, after which exp(-40) of it is left
_SLAVED = 0.005  # the current follows the motion if L/R is at most this part of the motion's own time


@kernel
def motion_rate(p: Floats, s: Floats) -> float:
    """How fast the motion itself changes, in 1/s: braking by the back-EMF, the force's fading along x, the spring."""
    current = abs(s[DRIVE]) / p[RESISTANCE] + abs(s[I])
    braking = p[BACK_EMF] * p[MOTOR] / (p[MASS] * p[RESISTANCE])
    fading = math.sqrt(p[MOTOR] * current / (p[REACH] * p[MASS])) + abs(s[V]) / p[REACH]
    return braking + fading + math.sqrt(p[STIFFNESS] / p[MASS])


@kernel
def is_slaved(p: Floats, s: Floats) -> bool:
    """Whether the current has come to follow the motion."""
    if s[TIME] < s[TRANSIENT_END]:
        return False
    return motion_rate(p, s) * p[INDUCTANCE] / p[RESISTANCE] <= _SLAVED


@kernel
def begin_coil(p: Floats, s: Floats) -> None:
    """A first guess at the step, and when the current's transient will be over."""
    if p[INDUCTANCE] == 0.0:
        s[SPAN] = 2.0 / motion_rate(p, s)
        return
    rate = p[RESISTANCE] / p[INDUCTANCE]
    swing = math.sqrt(p[BACK_EMF] * p[MOTOR] / (p[MASS] * p[INDUCTANCE]))
    current = abs(s[DRIVE]) / p[RESISTANCE] + abs(s[I])
    fading = math.sqrt(p[MOTOR] * current / (p[REACH] * p[MASS]))
    s[SPAN] = 2.0 / (rate + swing + fading + math.sqrt(p[STIFFNESS] / p[MASS]))
    s[TRANSIENT_END] = s[TIME] + _TRANSIENT / rate


@kernel
def coil_step(p: Floats, s: Floats, w: Floats) -> int:
    """One step; `s` moves on to its end, the series over it stay in `w`, and how much of them was used in `s`."""
    left, u = s[LIMIT] - s[TIME], s[DRIVE]
    w[XS], w[VS], w[IS] = s[X], s[V], s[I]
    if p[INDUCTANCE] == 0.0:
        follow(p, u, s[HEADING], s[SPAN], w, True)
    elif is_slaved(p, s):
        expand_slaved(p, u, s[HEADING], s[SPAN], w)
    else:
        expand(p, u, s[HEADING], s[SPAN], w)
    span = fit(p, u, s[SPAN], w)
    if not 0.0 < span < math.inf:
        return GIVEN_UP
    s[SPAN] = span
    event = CONTINUES
    if span >= left:
        rescale(w, left / span)
        span, event = left, DRIVE_CHANGE
    return finish_step(p, s, w, span, event)


@kernel
def finish_step(p: Floats, s: Floats, w: Floats, span: float, event: int) -> int:
    """The first event of the step of `span` seconds, `event` if there is none; `s` moves on to it."""
    used = 1.0
    at = first_turn(w, s[HEADING])
    if at <= used:
        used, event = at, TURN
    at = first_arrival(p, w, s[HEADING])
    if at <= used:
        used, event = at, COIL_EDGE if s[HEADING] > 0.0 else STOP
    if s[HEADING] > 0.0 and w[IS] > 0.0 and w[IS] + lowest(w, IS, 1.0) <= 0.0:
        at = first_crossing(w, IS)
        if at < used:
            used, event = at, FORCE_ZERO
    land(p, s, w, used, event)
    s[STEP], s[USED] = span, used
    s[TIME] = s[LIMIT] if event == DRIVE_CHANGE else s[TIME] + used * span
    if event == CONTINUES and s[TIME] >= s[LIMIT]:
        s[TIME], event = s[LIMIT], DRIVE_CHANGE
    return event


@kernel
def first_turn(w: Floats, heading: float) -> float:
    """Where the velocity first falls to 0, 2 if it does not. From rest v/s is looked at."""
    shift = 1 if w[VS] == 0.0 else 0
    begins = heading * w[VS + shift]
    if begins + lowest(w, VS, heading) - min(shift * begins, 0.0) > 0.0:
        return 2.0
    for n in range(ORDER + 1 - shift):
        w[QS + n] = heading * w[VS + n + shift]
    if shift == 1:
        w[QS + ORDER] = 0.0
    return first_crossing(w, QS) if w[QS] > 0.0 else 0.0


@kernel
def first_arrival(p: Floats, w: Floats, heading: float) -> float:
    """Where the magnet first meets the coil's edge (outwards) or the stop (homewards), 2 if it does not."""
    ahead = (p[REACH] if heading > 0.0 else 0.0) - w[XS]
    if heading * ahead + lowest(w, XS, -heading) > 0.0:
        return 2.0
    for n in range(1, ORDER + 1):
        w[QS + n] = -heading * w[XS + n]
    w[QS] = heading * ahead
    return first_crossing(w, QS) if w[QS] > 0.0 else 0.0


@kernel
def land(p: Floats, s: Floats, w: Floats, used: float, event: int) -> None:
    """The state at the end of a step; the quantity that defines the event is exact."""
    if event in (CONTINUES, DRIVE_CHANGE):
        s[X], s[V], s[I] = value_at_end(w, XS), value_at_end(w, VS), value_at_end(w, IS)
        return
    s[X], s[V], s[I] = value(w, XS, used), value(w, VS, used), value(w, IS, used)
    if event == TURN:
        s[V] = 0.0
    elif event == COIL_EDGE:
        s[X] = p[REACH]
    elif event == STOP:
        s[X] = 0.0
    elif event == FORCE_ZERO:
        s[I] = 0.0
