"""The reference of tests/test_physics_reference.py: `python tests/golden/make_physics.py`, some seconds.

`python tests/golden/make_physics.py far` makes that of the guns in physics_far.json, some minutes: guns of three
decades about the paper's, whose magnet creeps home, and one whose magnet sticks and slips 1,773 times in its pulse.
`python tests/golden/make_physics.py random` draws 200 guns that shoot as the paper's does and makes physics_random.csv,
some minutes.

Equations (1) to (3) in 60-digit arithmetic (mpmath), by another method than the product's: Taylor series of order 70
in plain time over every motion, the free flight included (the product has it in closed form), one half of the radius
a step, events by bisection of sign changes and secant steps. Nothing of the product is imported.
"""

from __future__ import annotations

import csv
import json
import random
import sys
from pathlib import Path
from typing import NamedTuple

from mpmath import exp, fdot, log, mp, mpf

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
        motor = K_M * fdot(hold, i[::-1]) if now.inside and now.live else mpf(0)
        emf = v[n]
        if now.reciprocal:
            emf = fdot(hold, v[::-1]) if now.inside else mpf(0)
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


def crossing(c, span):
    """The first change of sign from that just after 0, looked for in 64 parts; None if there is none."""
    if abs(c[0]) > at([abs(a) for a in c[1:]], span) * span:
        return None  # the first coefficient outweighs all others

    def function(t):
        return at(c, t)

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
        watched = {"turn": s[1]}
        if now.way < 0 or (now.inside and now.live):
            watched["arrival"] = [s[0][0] - target, *s[0][1:]]
        for event, c in watched.items():
            h = crossing(c, span)
            if h is not None and h < span:
                span, name = h, event
        if "recoil_end_s" not in found:
            note_peak(now, s, span, found)
        t, state = t + span, [at(c, span) for c in s]
        if name:
            return name, t, state


def note_peak(now, s, span, found):
    slope = [(n + 1) * (n + 2) * s[1][n + 2] for n in range(ORDER - 1)]
    top = crossing(slope, span)
    for t in (span, *([top] if top else [])):
        x, i = at(s[0], t), at(s[2], t)
        force = K_M * (1 - x / X_C) * i - K * (x + X_0) - now.friction
        found["peak_force_N"] = max(found.get("peak_force_N", mpf(0)), force)


def shot(now, order=()):
    """The numbers of a shot; None if its events are not those of `order`, where one is given."""
    threshold = (K * X_0 + now.friction) / K_M
    if threshold * R >= VOLTAGE:
        return None
    t = -L / R * log(1 - threshold * R / VOLTAGE)
    assert abs(VOLTAGE / R * (1 - exp(-t * R / L)) - threshold) < mpf(10) ** -55
    state, found, names = [mpf(0), mpf(0), threshold], {}, []
    while "reset_end_s" not in found:
        name, t, state = fly(now, t, state, found)
        names.append(name)
        if order and names != list(order[: len(names)]):
            return None
        if name == "turn" and sticks(now, state):
            note_turn(t, state, found)
            t = rest(now, t, state)
            continue
        now = after(now, name, t, state, found)
    return {name: mp.nstr(number, DIGITS) for name, number in found.items()}


def sticks(now, state):
    """Whether friction holds the magnet where it turned."""
    x, _, i = state
    push = K_M * (1 - x / X_C) * i if now.inside and now.live else mpf(0)
    return abs(push - K * (x + X_0)) <= now.friction


def rest(now, t, state):
    """Until the current lets the magnet go outwards again: when that is. It is within the pulse."""
    state[1], before = mpf(0), state[2]
    state[2] = (K * (state[0] + X_0) + now.friction) / (K_M * (1 - state[0] / X_C))
    t += L / R * log((now.u / R - before) / (now.u / R - state[2]))
    assert t < now.limit
    return t


def note_turn(t, state, found):
    """The first turn ends the firing stage, and the recoil stage where the coil still pushes."""
    found.setdefault("recoil_end_s", t)
    found.setdefault("recoil_impulse_Ns", mpf(0))
    found.setdefault("firing_end_s", t)
    found["max_displacement_m"] = max(found.get("max_displacement_m", mpf(0)), state[0])


def after(now, name, t, state, found):
    """What holds after an event; its time goes to the summary."""
    if name == "limit":
        state[2] = state[2] if now.shorted else mpf(0)
        return now._replace(u=mpf(0), live=now.shorted, limit=mpf(10))
    if name == "turn":
        state[1] = mpf(0)
        note_turn(t, state, found)
        return now._replace(way=-1)
    if now.way > 0:
        found |= {"recoil_end_s": t, "recoil_impulse_Ns": M * state[1]}
        return now._replace(inside=False)
    if now.live and not now.inside:
        return now._replace(inside=True)
    found |= {"reset_end_s": t, "impact_speed_m_s": -state[1], "collision_force_N": M * state[1] ** 2 / X_K}
    return now


NAMES = {
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
PAPER = {key: float(globals()[name]) for name, key in NAMES.items()}


def use(gun):
    """The gun's own numbers, exact as doubles, in place of the paper's."""
    globals().update({name: mpf(gun[key]) for name, key in NAMES.items()})


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


COUNT, SEED = 200, 18
AS_THE_PAPERS = {
    "open": ("arrival", "limit", "turn", "arrival"),
    "shorted": ("arrival", "limit", "turn", "arrival", "arrival"),
}
"""Events of the paper's gun: out of the coil within the pulse, its end, the turn, (the coil's edge), the stop."""


def random_guns():
    """Each number half to twice the paper's, friction a tenth to four fifths of the spring's pre-load."""
    rng = random.Random(SEED)
    while True:
        gun = {key: float(f"{value * 2 ** rng.uniform(-1, 1):.4g}") for key, value in PAPER.items()}
        share = rng.uniform(0.1, 0.8)
        yield gun | {"friction_N": float(f"{share * gun['stiffness_N_m'] * gun['preload_length_m']:.4g}")}


def one_row(gun):
    """The gun and its numbers, those of the landing by the coil's off-state; None if it shoots otherwise."""
    use(gun)
    row = gun
    for drive_off, order in AS_THE_PAPERS.items():
        found = shot(Motion(mpf(gun["friction_N"]), drive_off == "shorted", False, u=VOLTAGE, limit=PULSE), order)
        if found is None:
            return None
        landing = ("reset_end_s", "impact_speed_m_s")
        named = {f"{drive_off}_{name}" if name in landing else name: found[name] for name in found}
        del named["collision_force_N"]
        digits = {name: mp.nstr(mpf(number), 20) for name, number in named.items()}
        assert all(row.get(name, number) == number for name, number in digits.items())
        row = row | digits
    return row


def at_random():
    rows = []
    for gun in random_guns():
        row = one_row(gun)
        rows += [row] if row else []
        if len(rows) == COUNT:
            break
    with Path(__file__).with_name("physics_random.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


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
    {"": main, "far": far, "random": at_random}["".join(sys.argv[1:])]()
