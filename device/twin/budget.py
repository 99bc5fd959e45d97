"""The firmware's own limits, in whole microseconds, millivolts and nanojoules, so that C without floats agrees.

They are those of `device.limits`, which judges first, on the host; the numbers are written here again on purpose: the
firmware knows nothing of the host's.
"""

from __future__ import annotations

from typing import Final

from device.wire import errors
from device.wire.records import Setting

MAX_MILLIVOLTS: Final = 24_000
MAX_PULSE_US: Final = 20_000
MAX_EFFECT: Final = 123
MAX_EFFECT_US: Final = 1_000_000
MAX_REST_US: Final = 10_000_000
FLOOR_US: Final = {"PULS": 50_000, "EFF": 10_000}
"""Least time from onset to onset, whatever the host says. Assumed."""
SECOND_US: Final = 1_000_000
MINUTE_US: Final = 60 * SECOND_US
DUTY_US: Final = 100_000
"""Driven in any second: 10 %."""
MAX_SHOTS: Final = 300
"""In any minute."""
COIL_MILLIOHMS: Final = 2_900
COIL_NJ_MK: Final = 20_000_000
"""Heat capacity: 20 J/K, assumed as in `device.limits`."""
MAX_WARMTH_NJ: Final = 55_000 * COIL_NJ_MK
"""80 degC in a room of 25 degC."""
ROOM_MC: Final = 25_000
COOLING_US: Final = 100_000
COOLING_PARTS: Final = 2_001
"""Each 100 ms a 2001st part of the warmth goes: 200 s time constant, erring on the warm side."""
COLD_STEPS: Final = 60_000
"""After so many steps, 100 min, the coil is taken for cold."""


def out_of_range(setting: Setting) -> bool:
    """Whether a setting is beyond what any shot may be made of."""
    if setting.kind == "PULS":
        amount, length = setting.amount <= MAX_MILLIVOLTS, setting.length_us <= MAX_PULSE_US
    else:
        amount, length = 1 <= setting.amount <= MAX_EFFECT, setting.length_us <= MAX_EFFECT_US
    least = max(setting.length_us, FLOOR_US[setting.kind])
    return not (amount and length and least <= setting.rest_us <= MAX_REST_US)


class Budget:
    """The shots of the last minute and the coil's warmth since the start of the clock."""

    def __init__(self) -> None:
        self._pulses: list[tuple[int, int]] = []  # start and driven time of the last MAX_SHOTS, oldest first
        self._warmth_nJ = 0
        self._cooled_step = 0

    def refusal(self, setting: Setting, start_us: int) -> int:
        """The error that forbids a shot at `start_us`, or 0."""
        if len(self._pulses) == MAX_SHOTS and start_us < self._pulses[0][0] + MINUTE_US:
            return errors.RATE
        if self._driven_too_long(_driven_us(setting), start_us):
            return errors.DUTY
        if self._warmth_at(start_us) + _heat_nanojoules(setting) > MAX_WARMTH_NJ:
            return errors.HOT
        return errors.NONE

    def spend(self, setting: Setting, start_us: int) -> None:
        """Take a shot into account. A pulse that is cut short counts in full."""
        self._warmth_nJ = self._warmth_at(start_us) + _heat_nanojoules(setting)
        self._cooled_step = start_us // COOLING_US
        self._pulses = [*self._pulses[-MAX_SHOTS + 1 :], (start_us, _driven_us(setting))]

    def coil_millicelsius(self, now_us: int) -> int:
        """The coil's estimated temperature in thousandths of a degree."""
        return ROOM_MC + self._warmth_at(now_us) // COIL_NJ_MK

    def _driven_too_long(self, on_us: int, start_us: int) -> bool:
        """A second is fullest when it ends with the new pulse; what of older pulses lies in it counts."""
        begin_us = start_us + on_us - SECOND_US
        inside_us = (min(start + driven - begin_us, driven) for start, driven in self._pulses)
        return on_us + sum(max(0, inside) for inside in inside_us) > DUTY_US

    def _warmth_at(self, now_us: int) -> int:
        warmth = self._warmth_nJ
        steps = now_us // COOLING_US - self._cooled_step
        if steps > COLD_STEPS:
            return 0
        for _ in range(steps):
            warmth -= warmth // COOLING_PARTS
        return warmth


def _driven_us(setting: Setting) -> int:
    """How long the coil is driven; a vibration does not use it."""
    return setting.length_us if setting.kind == "PULS" else 0


def _heat_nanojoules(setting: Setting) -> int:
    """V^2/R t, rounded up: mV^2 us / mOhm is nJ."""
    if setting.kind == "EFF":
        return 0
    return -(-setting.amount * setting.amount * setting.length_us // COIL_MILLIOHMS)
