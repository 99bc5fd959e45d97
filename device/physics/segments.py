"""The closed forms: the magnet at rest, and the magnet beyond the coil's force.

At rest i(t) = u/R + (i_0 - u/R) exp(-t R/L). Free, x'' = a - w^2 (x - x_start), in forms that lose no digits and stay
finite for k = 0.

Friction opposes the way of its segment, so no equation holds a sign function; rest is a state of its own. What comes
next is a function of the state alone.
"""

from __future__ import annotations

import math

from device.physics.coil import begin_coil, coil_step
from device.physics.equations import (
    BREAK_AWAY,
    CLOSED_FORM,
    COIL,
    COIL_EDGE,
    CONTINUES,
    DRIVE_CHANGE,
    FREE,
    GIVEN_UP,
    ORDER,
    REST,
    SETTLED,
    STOP,
    TURN,
    Constants,
    ShotState,
    StepSeries,
    friction,
    grip,
    motor_force,
    spring_force,
)

_SLACK = 1e-12  # relative: the magnet breaks away this far beyond the threshold, so that it does accelerate
_SLACK_FLOOR_N = 1e-15  # the same for a gun with neither spring nor friction
_HALF_SWING = 1e150  # tan(pi/2) for all that floats can tell, and small enough for its square


def slack(p: Constants, x: float) -> float:
    """How far beyond friction, in N, a force must go before the model lets the magnet move (rounding only)."""
    return _SLACK * (spring_force(p, x) + max(p.friction_out, p.friction_back)) + _SLACK_FLOOR_N


def resting_current(p: Constants, u: float, i: float, t: float) -> float:
    """The current at rest after t seconds."""
    if p.inductance == 0.0:
        return u / p.resistance
    return i + (i - u / p.resistance) * math.expm1(-p.resistance / p.inductance * t)


def instant_current(p: Constants, u: float, x: float, v: float) -> float:
    """The current without inductance, (u - emf)/R."""
    seen = grip(p, x) if p.reciprocal else 1.0
    return (u - p.back_emf * seen * v) / p.resistance


def time_constants(way: float, start: float, threshold: float, steady: float) -> float:
    """How long an exponential from `start` to `steady` takes past the threshold, upwards (1) or downwards (-1).

    In time constants; infinite if it never gets there or comes back from there.
    """
    if way * (steady - threshold) <= 0.0:
        return math.inf
    ahead = way * (threshold - start)
    return math.log1p(ahead / (way * (steady - threshold))) if ahead > 0.0 else 0.0


def outward_threshold(p: Constants, x: float) -> float:
    """The current in A beyond which the coil pushes the resting magnet out."""
    return (spring_force(p, x) + p.friction_out + slack(p, x)) / (p.motor_constant * grip(p, x))


def homeward_threshold(p: Constants, x: float) -> float:
    """The current in A below which the spring pushes the resting magnet home."""
    return (spring_force(p, x) - p.friction_back - slack(p, x)) / (p.motor_constant * grip(p, x))


def swing(omega: float, half: float) -> tuple[float, float, float]:
    """cos(wt), sin(wt)/w and (1 - cos(wt))/w^2 by `half`, which is tan(wt/2)/w: 1, t and t^2/2 without a spring.

    By the end of an arc as algebra gives it, without the sine of an arctangent.
    """
    root = omega * half
    part = 1.0 / (1.0 + root * root)
    sine = 2.0 * half * part
    return (1.0 - root * root) * part, sine, half * sine


def half_of(omega: float, t: float) -> float:
    """tan(wt/2)/w, or t/2 without a spring, of t before the magnet turns: wt is at most pi."""
    return math.tan(0.5 * omega * t) / omega if omega > 0.0 else 0.5 * t


def time_of(omega: float, half: float) -> float:
    """The time by its `half`."""
    return 2.0 * math.atan(omega * half) / omega if omega > 0.0 else 2.0 * half


def at_most(omega: float, half: float) -> float:
    """A `half` whose square is no more than floats can express: half a swing, where it is infinite."""
    return min(half, _HALF_SWING / omega) if omega > 0.0 else half


def turn_half(omega: float, v: float, a: float, heading: float) -> float:
    """When the velocity v cos(wt) + a sin(wt)/w falls to 0, as tan(wt/2)/w; infinite if it never does."""
    speed, braking = abs(v), -heading * a
    root = math.hypot(omega * speed, braking)
    if braking > 0.0:
        return speed / (root + braking)
    if omega == 0.0:
        return math.inf
    return at_most(omega, (root - braking) / (omega * speed) / omega if omega * speed > 0.0 else math.inf)


def fall_half(omega: float, v: float, a: float, distance: float) -> float:
    """When the magnet has moved by `distance` (at most 0), as tan(wt/2)/w; infinite if it turns before.

    It is distance/(v + v_end): the mean speed over an arc of harmonic motion.
    """
    v_squared = v * v + (2.0 * a - omega * omega * distance) * distance
    if distance == 0.0 or v_squared <= 0.0:
        return 0.0 if distance == 0.0 else math.inf
    return at_most(omega, distance / (v - math.sqrt(v_squared)))


def free_position(omega: float, half: float, x: float, v: float, a: float) -> float:
    """The position, x + v sin(wt)/w + a (1 - cos wt)/w^2."""
    _, sine, rise = swing(omega, half)
    return x + v * sine + a * rise


def free_velocity(omega: float, half: float, v: float, a: float) -> float:
    """The velocity, v cos(wt) + a sin(wt)/w."""
    cosine, sine, _ = swing(omega, half)
    return v * cosine + a * sine


def free_current(p: Constants, u: float, i: float, half: float, v: float, a: float, t: float) -> float:
    """The current of equation (3) under the free motion's back-EMF (none if reciprocal: the magnet is outside).

    i(t) = u/R + P cos(wt) + Q sin(wt)/w + (i_0 - u/R - P) exp(-rt), with r = R/L.
    """
    R, L = p.resistance, p.inductance
    omega = math.sqrt(p.stiffness / p.mass)
    if L == 0.0:
        return instant_current(p, u, p.coil_reach, free_velocity(omega, half, v, a))
    rate = R / L
    emf = 0.0 if p.reciprocal else p.back_emf
    coupling = emf / (R + L * omega * omega / rate)
    first, second = -coupling * (v - a / rate), -coupling * (a + omega * omega / rate * v)
    cosine, sine, _ = swing(omega, half)
    return u / R + first * cosine + second * sine + (i - u / R - first) * math.exp(-rate * t)


def pulse_on(p: Constants, s: ShotState) -> None:
    """The drive from the onset of a pulse at time 0 on."""
    s.time, s.u, s.live, s.drive_until, s.recoiling = 0.0, p.voltage, True, min(p.pulse_s, s.until), True
    if p.pulse_s <= 0.0:
        pulse_off(p, s)


def pulse_off(p: Constants, s: ShotState) -> None:
    """The drive after the pulse: u = 0 through a shorted coil, or no current at all."""
    s.u, s.live, s.drive_until = 0.0, not p.opens, s.until


def heading_of(p: Constants, s: ShotState) -> float:
    """Which way the magnet goes on; at v = 0 the forces decide, and friction or the stop may hold it."""
    if s.v != 0.0:
        return math.copysign(1.0, s.v)
    motor = motor_force(p, s.x, s.i) if s.live else 0.0
    net, spare = motor - spring_force(p, s.x), 0.5 * slack(p, s.x)
    if net > p.friction_out + spare:
        return 1.0
    return -1.0 if net < -p.friction_back - spare and s.x > 0.0 else 0.0


def enter(p: Constants, s: ShotState, event: int) -> None:
    """What the last event does to the state, and the segment that follows.

    The inelastic stop takes the velocity, an open drive the current. A magnet that set out and got nowhere, a hop
    below what floats resolve, rests until the current lets it go; without one, the spring does so at once.
    """
    if event == CONTINUES:
        return
    halted = s.live and s.heading != 0.0 and s.time == s.began
    if event == STOP:
        s.v = 0.0
    if not s.live:
        s.i = 0.0
    elif p.inductance == 0.0:
        s.i = instant_current(p, s.u, s.x, s.v)
    s.began = s.time
    s.heading = 0.0 if halted and s.v == 0.0 else heading_of(p, s)
    inside = s.x < p.coil_reach or (s.x == p.coil_reach and s.heading < 0.0)
    if s.heading == 0.0:
        s.kind = REST
    elif inside and s.live:
        s.kind = COIL
        begin_coil(p, s)
    else:
        s.kind = FREE


def advance(p: Constants, s: ShotState, w: StepSeries) -> int:
    """The segment that begins at `s`: moves `s` on to its end and says what ended it."""
    if s.kind == COIL:
        return powered_arc(p, s, w) if p.model == CLOSED_FORM else coil_step(p, s, w)
    if s.kind == FREE:
        return free_arc(p, s)
    return rest(p, s)


def rest(p: Constants, s: ShotState) -> int:
    """At rest until the current breaks the magnet away, the drive changes, or for good."""
    u, x, i, left = s.u, s.x, s.i, s.drive_until - s.time
    if not s.live or p.motor_constant * grip(p, x) == 0.0:
        out, back = math.inf, math.inf
    else:
        lag, steady = p.inductance / p.resistance, u / p.resistance
        out = in_seconds(lag, time_constants(1.0, i, outward_threshold(p, x), steady))
        back = in_seconds(lag, time_constants(-1.0, i, homeward_threshold(p, x), steady)) if x > 0.0 else math.inf
    wait = min(out, back)
    if wait < left:
        s.i = outward_threshold(p, x) if out <= back else homeward_threshold(p, x)
        s.time += wait
        return BREAK_AWAY
    s.i = resting_current(p, u, i, left)
    if wait == math.inf and u == 0.0:
        return SETTLED
    s.time = s.drive_until
    return DRIVE_CHANGE


def in_seconds(lag: float, constants: float) -> float:
    """So many time constants in seconds; what never happens, never happens without inductance (lag 0) either."""
    return lag * constants if constants < math.inf else math.inf


def powered_arc(p: Constants, s: ShotState, w: StepSeries) -> int:
    """Inside the coil at a constant current, whose force fades along x as a spring's: k' = k + k_m i/x_c."""
    x, v, heading, left = s.x, s.v, s.heading, s.drive_until - s.time
    for n in range(ORDER + 1):
        w.x[n], w.v[n], w.i[n] = 0.0, 0.0, 0.0
    w.x[0], w.i[0] = x, s.i
    omega = math.sqrt((p.stiffness + p.motor_constant * s.i / p.coil_reach) / p.mass)
    a = (motor_force(p, x, s.i) + friction(p, heading) - spring_force(p, x)) / p.mass
    half, event = turn_half(omega, v, a, heading), TURN
    way = (p.coil_reach if heading > 0.0 else 0.0) - x
    arrival = fall_half(omega, -heading * v, -heading * a, -heading * way)
    if arrival <= half:
        half, event = arrival, COIL_EDGE if heading > 0.0 else STOP
    t = time_of(omega, half)
    if not t < left:
        t, half, event = left, half_of(omega, left), DRIVE_CHANGE
    s.time = s.drive_until if event == DRIVE_CHANGE else s.time + t
    s.x, s.v = free_position(omega, half, x, v, a), free_velocity(omega, half, v, a)
    s.span, s.used = t, 1.0
    return exact_arc(p, s, event)


def free_arc(p: Constants, s: ShotState) -> int:
    """Beyond the coil, or with a dead coil, until the magnet turns, meets the coil again or hits the stop."""
    x, v, heading, left = s.x, s.v, s.heading, s.drive_until - s.time
    omega = math.sqrt(p.stiffness / p.mass)
    a = (friction(p, heading) - spring_force(p, x)) / p.mass
    half, event = math.inf, TURN
    if heading < 0.0:
        target = p.coil_reach if s.live else 0.0
        half, event = fall_half(omega, v, a, target - x), COIL_EDGE if s.live else STOP
    if not half < math.inf:
        half, event = turn_half(omega, v, a, heading), TURN
    t = time_of(omega, half)
    if not t < left:
        t, half, event = left, half_of(omega, left), DRIVE_CHANGE
    s.time = s.drive_until if event == DRIVE_CHANGE else s.time + t
    if s.live:
        s.i = free_current(p, s.u, s.i, half, v, a, t)
    s.x, s.v = free_position(omega, half, x, v, a), free_velocity(omega, half, v, a)
    return exact_arc(p, s, event)


def exact_arc(p: Constants, s: ShotState, event: int) -> int:
    """The quantity that defines the event is exact; what left the range of floats is given up."""
    if event == TURN:
        s.v = 0.0
    elif event == COIL_EDGE:
        s.x = p.coil_reach
    elif event == STOP:
        s.x = 0.0
    return event if math.isfinite(s.x + s.v + s.i) else GIVEN_UP
