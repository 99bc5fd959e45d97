"""The reference of tests/test_physics_reference.py: `python tests/golden/make_physics.py`, about a minute.

`python tests/golden/make_physics.py far` makes that of the guns in physics_far.json, ten minutes: guns of
three decades about the paper's, whose magnet creeps home.

Equations (1) to (3) in 60-digit arithmetic (mpmath), by another method than the product's: Taylor series of order 70
in plain time over every motion, the free flight included (the product has it in closed form), one half of the radius
a step, events by bisection of sign changes and secant steps. Nothing of the product is imported.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import NamedTuple

from mpmath import exp, log, mp, mpf

mp.dps = 60
ORDER = 70
DIGITS = 50
M, K_E, R, L, K_M = mpf("0.114"), mpf("7.6"), mpf("2.9"), mpf("0.72e-3"), mpf("7.6")
X_C, K, X_0, VOLTAGE, PULSE, X_K = mpf("0.0075"), mpf(14), mpf("0.1"), mpf(16), mpf("0.01"), mpf("0.0005")


class Motion(NamedTuple):
    """What holds between two events: which way the magnet goes, where, and what the coil does."""

    friction: mpf
    shorted: bool
    reciprocal: bool
    way: int = 1
    u: mpf = VOLTAGE
    inside: bool = True
    live: bool = True
    limit: mpf = PULSE


def series(now, state):
    """Coefficients of x, v and i in time."""
    x, v, i = ([c] for c in state)
    hold = [1 - x[0] / X_C]
    for n in range(ORDER):
        motor = K_M * sum(hold[j] * i[n - j] for j in range(n + 1)) if now.inside and now.live else mpf(0)
        emf = v[n]
        if now.reciprocal:
            emf = sum(hold[j] * v[n - j] for j in range(n + 1)) if now.inside else mpf(0)
        first = n == 0
        x.append(v[n] / (n + 1))
        hold.append(-x[-1] / X_C)
        v.append((motor - K * x[n] - (K * X_0 + now.way * now.friction if first else 0)) / M / (n + 1))
        i.append(((now.u if first else 0) - R * i[n] - K_E * emf) / L / (n + 1) if now.live else mpf(0))
    return x, v, i


def at(c, t):
    total = mpf(0)
    for a in reversed(c):
        total = total * t + a
    return total


def span_of(all_series):
    """Half of where the last coefficients come down to 10^-58 of the first ones."""
    spans = []
    for c in all_series:
        size = max(abs(a) for a in c[:4])
        last = [n for n in (ORDER - 1, ORDER) if c[n] != 0 and size != 0]
        spans.extend((mpf(10) ** -58 * size / abs(c[n])) ** (mpf(1) / n) for n in last)
    return min(spans) / 2


def crossing(function, span):
    """The first change of sign from that just after 0, looked for in 64 parts; None if there is none."""
    times = [span * n / 64 for n in range(65)]
    times[0] = span / mpf(10) ** 12
    values = [function(t) for t in times]
    for a, b, ya, yb in zip(times, times[1:], values, values[1:], strict=False):
        if ya * yb <= 0:
            return bisect(function, a, b, ya)
    return None


def bisect(function, a, b, ya):
    for _ in range(20):
        middle = (a + b) / 2
        y = function(middle)
        a, b = (middle, b) if y * ya > 0 else (a, middle)
    for _ in range(8):  # secant steps from a bracket of 1e-6 of the span
        fa, fb = function(a), function(b)
        if fa == fb:
            break
        a, b = b, b - fb * (b - a) / (fb - fa)
    return b


def fly(now, t, state, found):
    """Moves on until the first event: turn, arrival or limit. Returns its name, the time and the state."""
    target = mpf(0) if now.way < 0 and (now.inside or not now.live) else X_C
    while True:
        s = series(now, state)
        span, name = span_of(s), None
        if t + span > now.limit:
            span, name = now.limit - t, "limit"
        watched = {"turn": lambda h, v=s[1]: at(v, h)}
        if now.way < 0 or (now.inside and now.live):
            watched["arrival"] = lambda h, x=s[0]: at(x, h) - target
        for event, function in watched.items():
            h = crossing(function, span)
            if h is not None and h < span:
                span, name = h, event
        if "recoil_end_s" not in found:
            note_peak(now, s, span, found)
        t, state = t + span, [at(c, span) for c in s]
        if name:
            return name, t, state


def note_peak(now, s, span, found):
    slope = [(n + 1) * (n + 2) * s[1][n + 2] for n in range(ORDER - 1)]
    top = crossing(lambda t: at(slope, t), span)
    for t in (span, *([top] if top else [])):
        x, i = at(s[0], t), at(s[2], t)
        force = K_M * (1 - x / X_C) * i - K * (x + X_0) - now.friction
        found["peak_force_N"] = max(found.get("peak_force_N", mpf(0)), force)


def shot(now):
    threshold = (K * X_0 + now.friction) / K_M
    t = -L / R * log(1 - threshold * R / VOLTAGE)
    assert abs(VOLTAGE / R * (1 - exp(-t * R / L)) - threshold) < mpf(10) ** -55
    state, found = [mpf(0), mpf(0), threshold], {}
    while "reset_end_s" not in found:
        name, t, state = fly(now, t, state, found)
        now = after(now, name, t, state, found)
    return {name: mp.nstr(number, DIGITS) for name, number in found.items()}


def after(now, name, t, state, found):
    """What holds after an event; its time goes to the summary."""
    if name == "limit":
        state[2] = state[2] if now.shorted else mpf(0)
        return now._replace(u=mpf(0), live=now.shorted, limit=mpf(10))
    if name == "turn":
        state[1] = mpf(0)
        found |= {"firing_end_s": t, "max_displacement_m": state[0]}
        return now._replace(way=-1)
    if now.way > 0:
        found |= {"recoil_end_s": t, "recoil_impulse_Ns": M * state[1]}
        return now._replace(inside=False)
    if now.live and not now.inside:
        return now._replace(inside=True)
    found |= {"reset_end_s": t, "impact_speed_m_s": -state[1], "collision_force_N": M * state[1] ** 2 / X_K}
    return now


def use(gun):
    """The gun's own numbers, exact as doubles, in place of the paper's."""
    names = {
        "M": "magnet_mass_kg",
        "K_E": "back_emf_V_s_m",
        "R": "resistance_ohm",
        "L": "inductance_H",
        "K_M": "motor_constant_N_A",
        "X_C": "coil_reach_m",
        "K": "stiffness_N_m",
        "X_0": "preload_length_m",
        "VOLTAGE": "voltage_V",
        "PULSE": "pulse_s",
        "X_K": "contact_depth_m",
    }
    globals().update({name: mpf(gun[key]) for name, key in names.items()})


def far():
    file = Path(__file__).with_name("physics_far.json")
    page = json.loads(file.read_text(encoding="utf-8"))
    for row in page["shots"]:
        gun = row["gun"]
        use(gun)
        start = Motion(
            mpf(gun["friction_N"]), gun["drive_off"] == "shorted", gun["emf"] == "reciprocal", u=VOLTAGE, limit=PULSE
        )
        row["summary"] = {name: mp.nstr(mpf(digits), 25) for name, digits in shot(start).items()}
    file.write_text(json.dumps(page, indent=1) + "\n", encoding="utf-8")


def main():
    shots = []
    for friction in ("0.21", "1.12"):
        for drive_off in ("shorted", "open"):
            for emf in ("printed", "reciprocal"):
                gun = Motion(mpf(friction), drive_off == "shorted", emf == "reciprocal")
                options = {"friction_N": float(friction), "drive_off": drive_off, "emf": emf}
                shots.append({**options, "summary": shot(gun)})
    page = {"made_by": "tests/golden/make_physics.py", "digits": DIGITS, "shots": shots}
    Path(__file__).with_name("physics.json").write_text(json.dumps(page, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    far() if sys.argv[1:] == ["far"] else main()
