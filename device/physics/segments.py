"""The closed forms: the magnet at rest, and the magnet beyond the coil's force.

At rest i(t) = u/R + (i_0 - u/R) exp(-t R/L). Free, x'' = a - w^2 (x - x_start), in forms that lose no digits and stay
finite for k = 0.

Friction opposes the way of its segment, so no equation holds a sign function; rest is a state of its own. What comes
next is a function of the state alone.
"""

from __future__ import annotations

import math

from device.physics.coil import begin_coil, coil_step
from device.physics.kernel import (
    BACK_EMF,
    BEGAN,
    BREAK_AWAY,
    CLOSED_FORM,
    COIL,
    COIL_EDGE,
    CONTINUES,
    DRIVE,
    DRIVE_CHANGE,
    END,
    FREE,
    FRICTION_BACK,
    FRICTION_OUT,
    GIVEN_UP,
    HEADING,
    INDUCTANCE,
    IS,
    KIND,
    LIMIT,
    LIVE,
    MASS,
    MODEL,
    MOTOR,
    OPEN,
    PRELOAD,
    PULSE,
    REACH,
    RECIPROCAL,
    RESISTANCE,
    REST,
    SETTLED,
    STEP,
    STIFFNESS,
    STOP,
    TIME,
    TURN,
    USED,
    VOLTAGE,
    WORK_SIZE,
    XS,
    Floats,
    I,
    V,
    X,
    clear,
    kernel,
)
from device.physics.series import friction

_SLACK = 1e-12  # relative: the magnet breaks away this far beyond the threshold, so that it does accelerate
_SLACK_FLOOR_N = 1e-15  # the same for a gun with neither spring nor friction


@kernel
def spring_force(p: Floats, x: float) -> float:
    """The spring's push towards the stop in N, k (x + x_0)."""
    return p[STIFFNESS] * (x + p[PRELOAD])


@kernel
def grip(p: Floats, x: float) -> float:
    """The coil's hold on the magnet, (x_c - x)/x_c inside the coil and 0 outside (equation 2)."""
    return max(0.0, (p[REACH] - x) / p[REACH])


@kernel
def slack(p: Floats, x: float) -> float:
    """How far beyond friction, in N, a force must go before the model lets the magnet move (rounding only)."""
    return _SLACK * (spring_force(p, x) + max(p[FRICTION_OUT], p[FRICTION_BACK])) + _SLACK_FLOOR_N


@kernel
def resting_current(p: Floats, u: float, i: float, t: float) -> float:
    """The current at rest after t seconds."""
    if p[INDUCTANCE] == 0.0:
        return u / p[RESISTANCE]
    return i + (i - u / p[RESISTANCE]) * math.expm1(-p[RESISTANCE] / p[INDUCTANCE] * t)


@kernel
def instant_current(p: Floats, u: float, x: float, v: float) -> float:
    """The current without inductance, (u - emf)/R."""
    seen = grip(p, x) if p[RECIPROCAL] != 0.0 else 1.0
    return (u - p[BACK_EMF] * seen * v) / p[RESISTANCE]


@kernel
def time_constants(way: float, start: float, threshold: float, steady: float) -> float:
    """How long an exponential from `start` to `steady` takes past the threshold, upwards (1) or downwards (-1).

    In time constants; infinite if it never gets there or comes back from there.
    """
    if way * (steady - threshold) <= 0.0:
        return math.inf
    ahead = way * (threshold - start)
    return math.log1p(ahead / (way * (steady - threshold))) if ahead > 0.0 else 0.0


@kernel
def outward_threshold(p: Floats, x: float) -> float:
    """The current in A beyond which the coil pushes the resting magnet out."""
    return (spring_force(p, x) + p[FRICTION_OUT] + slack(p, x)) / (p[MOTOR] * grip(p, x))


@kernel
def homeward_threshold(p: Floats, x: float) -> float:
    """The current in A below which the spring pushes the resting magnet home."""
    return (spring_force(p, x) - p[FRICTION_BACK] - slack(p, x)) / (p[MOTOR] * grip(p, x))


@kernel
def sine(omega: float, t: float) -> float:
    """The integral of cos(wt): sin(wt)/w, or t without a spring."""
    return math.sin(omega * t) / omega if omega > 0.0 else t


@kernel
def free_position(omega: float, x: float, v: float, a: float, t: float) -> float:
    """The position, x + v sin(wt)/w + a (1 - cos wt)/w^2."""
    half = sine(omega, 0.5 * t)
    return x + v * sine(omega, t) + 2.0 * a * half * half


@kernel
def free_velocity(omega: float, v: float, a: float, t: float) -> float:
    """The velocity, v cos(wt) + a sin(wt)/w."""
    return v * math.cos(omega * t) + a * sine(omega, t)


@kernel
def turn_time(omega: float, v: float, a: float, heading: float) -> float:
    """When the velocity v cos(wt) + a sin(wt)/w falls to 0; infinite if it never does."""
    braking = -heading * a
    if omega > 0.0:
        return math.atan2(abs(v) * omega, braking) / omega
    return abs(v) / braking if braking > 0.0 else math.inf


@kernel
def fall_time(omega: float, v: float, a: float, distance: float) -> float:
    """When the magnet has moved by `distance` (at most 0); infinite if it turns before.

    The mean speed over an arc of harmonic motion gives tan(wt/2)/w = distance/(v + v_end).
    """
    v_squared = v * v + (2.0 * a - omega * omega * distance) * distance
    if distance == 0.0 or v_squared <= 0.0:
        return 0.0 if distance == 0.0 else math.inf
    part = distance / (v - math.sqrt(v_squared))
    return 2.0 * math.atan(omega * part) / omega if omega > 0.0 else 2.0 * part


@kernel
def free_current(p: Floats, u: float, i: float, v: float, a: float, t: float) -> float:
    """The current of equation (3) under the free motion's back-EMF (none if reciprocal: the magnet is outside).

    i(t) = u/R + P cos(wt) + Q sin(wt)/w + (i_0 - u/R - P) exp(-rt), with r = R/L.
    """
    R, L = p[RESISTANCE], p[INDUCTANCE]
    if L == 0.0:
        return instant_current(p, u, p[REACH], free_velocity(math.sqrt(p[STIFFNESS] / p[MASS]), v, a, t))
    omega, rate = math.sqrt(p[STIFFNESS] / p[MASS]), R / L
    emf = 0.0 if p[RECIPROCAL] != 0.0 else p[BACK_EMF]
    coupling = emf / (R + L * omega * omega / rate)
    cosine, sines = -coupling * (v - a / rate), -coupling * (a + omega * omega / rate * v)
    fading = (i - u / R - cosine) * math.exp(-rate * t)
    return u / R + cosine * math.cos(omega * t) + sines * sine(omega, t) + fading


@kernel
def pulse_on(p: Floats, s: Floats) -> None:
    """The drive from the onset of a pulse at time 0 on."""
    s[TIME], s[DRIVE], s[LIVE], s[LIMIT] = 0.0, p[VOLTAGE], 1.0, min(p[PULSE], s[END])
    if p[PULSE] <= 0.0:
        pulse_off(p, s)


@kernel
def pulse_off(p: Floats, s: Floats) -> None:
    """The drive after the pulse: u = 0 through a shorted coil, or no current at all."""
    s[DRIVE], s[LIVE], s[LIMIT] = 0.0, 0.0 if p[OPEN] != 0.0 else 1.0, s[END]


@kernel
def heading_of(p: Floats, s: Floats) -> float:
    """Which way the magnet goes on; at v = 0 the forces decide, and friction or the stop may hold it."""
    if s[V] != 0.0:
        return math.copysign(1.0, s[V])
    motor = p[MOTOR] * grip(p, s[X]) * s[I] if s[LIVE] != 0.0 else 0.0
    net, spare = motor - spring_force(p, s[X]), 0.5 * slack(p, s[X])
    if net > p[FRICTION_OUT] + spare:
        return 1.0
    return -1.0 if net < -p[FRICTION_BACK] - spare and s[X] > 0.0 else 0.0


@kernel
def enter(p: Floats, s: Floats, event: int) -> None:
    """What the last event does to the state, and the segment that follows.

    The inelastic stop takes the velocity, an open drive the current. A magnet that set out and got nowhere, a hop
    below what floats resolve, rests.
    """
    if event == CONTINUES:
        return
    halted = s[HEADING] != 0.0 and s[TIME] == s[BEGAN]
    if event == STOP:
        s[V] = 0.0
    if s[LIVE] == 0.0:
        s[I] = 0.0
    elif p[INDUCTANCE] == 0.0:
        s[I] = instant_current(p, s[DRIVE], s[X], s[V])
    s[BEGAN] = s[TIME]
    s[HEADING] = 0.0 if halted and s[V] == 0.0 else heading_of(p, s)
    inside = s[X] < p[REACH] or (s[X] == p[REACH] and s[HEADING] < 0.0)
    if s[HEADING] == 0.0:
        s[KIND] = REST
    elif inside and s[LIVE] != 0.0:
        s[KIND] = COIL
        begin_coil(p, s)
    else:
        s[KIND] = FREE


@kernel
def advance(p: Floats, s: Floats, w: Floats) -> int:
    """The segment that begins at `s`: moves `s` on to its end and says what ended it."""
    if s[KIND] == COIL:
        return powered_arc(p, s, w) if p[MODEL] == CLOSED_FORM else coil_step(p, s, w)
    if s[KIND] == FREE:
        return free_arc(p, s)
    return rest(p, s)


@kernel
def rest(p: Floats, s: Floats) -> int:
    """At rest until the current breaks the magnet away, the drive changes, or for good."""
    u, x, i, left = s[DRIVE], s[X], s[I], s[LIMIT] - s[TIME]
    if s[LIVE] == 0.0 or p[MOTOR] * grip(p, x) == 0.0:
        out, back = math.inf, math.inf
    else:
        lag, steady = p[INDUCTANCE] / p[RESISTANCE], u / p[RESISTANCE]
        out = scaled(lag, time_constants(1.0, i, outward_threshold(p, x), steady))
        back = scaled(lag, time_constants(-1.0, i, homeward_threshold(p, x), steady)) if x > 0.0 else math.inf
    wait = min(out, back)
    if wait < left:
        s[I] = outward_threshold(p, x) if out <= back else homeward_threshold(p, x)
        s[TIME] += wait
        return BREAK_AWAY
    s[I] = resting_current(p, u, i, left)
    if wait == math.inf and u == 0.0:
        return SETTLED
    s[TIME] = s[LIMIT]
    return DRIVE_CHANGE


@kernel
def scaled(lag: float, constants: float) -> float:
    """So many time constants in seconds; never is never, also without inductance."""
    return lag * constants if constants < math.inf else math.inf


@kernel
def powered_arc(p: Floats, s: Floats, w: Floats) -> int:
    """Inside the coil at a constant current, whose force fades along x as a spring's: k' = k + k_m i/x_c."""
    x, v, heading, left = s[X], s[V], s[HEADING], s[LIMIT] - s[TIME]
    clear(w, WORK_SIZE, 0.0)
    w[XS], w[IS] = x, s[I]
    omega = math.sqrt((p[STIFFNESS] + p[MOTOR] * s[I] / p[REACH]) / p[MASS])
    a = (p[MOTOR] * grip(p, x) * s[I] + friction(p, heading) - spring_force(p, x)) / p[MASS]
    t, event = turn_time(omega, v, a, heading), TURN
    way = (p[REACH] if heading > 0.0 else 0.0) - x
    arrival = fall_time(omega, -heading * v, -heading * a, -heading * way)
    if arrival <= t:
        t, event = arrival, COIL_EDGE if heading > 0.0 else STOP
    if not t < left:
        t, event = left, DRIVE_CHANGE
    s[TIME] = s[LIMIT] if event == DRIVE_CHANGE else s[TIME] + t
    s[X], s[V] = free_position(omega, x, v, a, t), free_velocity(omega, v, a, t)
    s[STEP], s[USED] = t, 1.0
    return exact_arc(p, s, event)


@kernel
def free_arc(p: Floats, s: Floats) -> int:
    """Beyond the coil, or with a dead coil, until the magnet turns, meets the coil again or hits the stop."""
    x, v, heading, left = s[X], s[V], s[HEADING], s[LIMIT] - s[TIME]
    omega = math.sqrt(p[STIFFNESS] / p[MASS])
    a = (friction(p, heading) - spring_force(p, x)) / p[MASS]
    t, event = turn_time(omega, v, a, heading), TURN
    if heading < 0.0:
        target = p[REACH] if s[LIVE] != 0.0 else 0.0
        fall = fall_time(omega, v, a, target - x)
        if fall < math.inf:
            t, event = fall, COIL_EDGE if s[LIVE] != 0.0 else STOP
    if not t < left:
        t, event = left, DRIVE_CHANGE
    s[TIME] = s[LIMIT] if event == DRIVE_CHANGE else s[TIME] + t
    if s[LIVE] != 0.0:
        s[I] = free_current(p, s[DRIVE], s[I], v, a, t)
    s[X], s[V] = free_position(omega, x, v, a, t), free_velocity(omega, v, a, t)
    return exact_arc(p, s, event)


@kernel
def exact_arc(p: Floats, s: Floats, event: int) -> int:
    """The quantity that defines the event is exact; what left the range of floats is given up."""
    if event == TURN:
        s[V] = 0.0
    elif event == COIL_EDGE:
        s[X] = p[REACH]
    elif event == STOP:
        s[X] = 0.0
    return event if math.isfinite(s[X] + s[V] + s[I]) else GIVEN_UP
