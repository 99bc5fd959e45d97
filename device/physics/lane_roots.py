"""The roots of `device.physics.polynomial` in lanes, with `where` in place of branches. Compiled, never interpreted."""

from __future__ import annotations

import math
from typing import Any

from device.physics.equations import ORDER
from device.physics.polynomial import NEAR_ROOT, NO_DIGIT, value_and_slope
from device.physics.vectors import alike, bits, where


def sign_changes_of(b: Any) -> Any:
    """`sign_changes` in lanes, all of them."""
    last = where(b[0] > 0.0, 1.0, where(b[0] < 0.0, -1.0, 0.0))
    changes = alike(0.0)
    for j in range(1, ORDER + 1):
        changes += where(b[j] * last < 0.0, 1.0, 0.0)
        last = where(b[j] > 0.0, 1.0, where(b[j] < 0.0, -1.0, last))
    return changes


def polygon_roots(b: Any) -> Any:
    """`polygon_root` in lanes."""
    at, one, two = alike(-1.0), b[0], b[1]
    for j in range(ORDER):
        here = (at < 0.0) & ((b[j] > 0.0) ^ (b[j + 1] > 0.0))
        at, one, two = where(here, float(j), at), where(here, b[j], one), where(here, b[j + 1], two)
    return where(at < 0.0, 0.5, (at + one / (one - two)) / ORDER)


def roots_of(w: Any, high: Any, needed: Any) -> Any:
    """`bracketed_root` from 0 to `high` in lanes."""
    b = w.bernstein
    sign = where((b[0] > 0.0) | ((b[0] == 0.0) & (b[ORDER] < 0.0)), 1.0, -1.0)
    return newton_roots(w.other, sign, high, high * polygon_roots(b), needed)


def falling_roots(w: Any, end: Any, high: Any, needed: Any) -> Any:
    """`falling_crossing` in lanes, of which those that are needed have one."""
    c = w.other
    bent = (end - c[0] - c[1] * high) / (high * high)
    s = 2.0 * c[0] / (math.sqrt(max(c[1] * c[1] - 4.0 * bent * c[0], 0.0)) - c[1])
    s = where((s > 0.0) & (s < high), s, 0.5 * high)
    return newton_roots(c, alike(1.0), high, s, needed)


def newton_roots(c: Any, sign: Any, high: Any, s: Any, needed: Any) -> Any:
    """`newton_root` from 0 to `high` in lanes."""
    low, before, found = alike(0.0), alike(0.0), s
    for _ in range(80):
        y, slope = value_and_slope(c, s)
        above, there = y * sign > 0.0, y == 0.0
        low, high = where(above, s, low), where(above, high, s)
        step_s = y / slope
        inside = (low < s - step_s) & (s - step_s < high)
        nearer = where(inside, s - step_s, 0.5 * (low + high))
        by, before = where(inside, abs(step_s), 0.0), where(inside, before, 0.0)
        settled = (by * by * by <= NO_DIGIT * s * before * before) & (before > 0.0) & (by <= NEAR_ROOT * s)
        found = where(needed, where(there, s, nearer), found)
        ends = there | settled | (abs(nearer - s) <= 2.3e-16 * s) | (nearer == low) | (nearer == high)
        needed = needed & ~ends
        if bits(needed) == 0:
            break
        s, before = nearer, by
    return found
