"""The limits that no config can lift, judged on the history of shots. Pure: time is an argument.

Height and length of a pulse are limited where it is built (`device.words`). Here: 10 % duty over any second, 300
shots over any minute, no shot before the magnet is home, and an estimated coil temperature of at most 80 degC.
Times are whole microseconds inside, so that ten pulses of 10 ms are exactly 10 % of a second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain, dropwhile

from device import words

MAX_DUTY = 0.10
"""Of any second: the paper's drive, 10 ms in 100 ms."""
MAX_SHOTS_PER_MINUTE = 300
"""Assumed: the paper's 5 Hz."""
MAX_COIL_C = 80.0
"""Assumed: well below what enamelled wire and adhesives of such coils stand."""
MAX_AHEAD_S = 2.0
"""So long ahead a shot may be asked for: a gun that waits is one that will fire. Assumed."""
AMBIENT_C = 25.0
"""Assumed."""
HEAT_CAPACITY_J_K = 20.0
"""Of the coil and what it is wound on, assumed."""
THERMAL_RESISTANCE_K_W = 10.0
"""From the coil to the room, assumed."""

TICKS = 1_000_000
"""A second: all times are counted in whole microseconds."""
_SECOND, _MINUTE = TICKS, 60 * TICKS
_DUTY_TICKS = round(MAX_DUTY * _SECOND)
_TIME_CONSTANT_S = HEAT_CAPACITY_J_K * THERMAL_RESISTANCE_K_W


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """What one shot asks of the coil: the time that it is driven, and the heat that it takes at most."""

    on_s: float
    heat_J: float

    def __post_init__(self) -> None:
        for name, value in (("on_s", self.on_s), ("heat_J", self.heat_J)):
            if not (words.is_finite(value) and value >= 0):
                raise words.LimitError(f"{name} is {words.shown(value)}; it must be a finite number of at least 0")


def planned_start_s(now_s: float, at_s: float | None) -> float:
    """When a shot starts that is asked for now: at a time, or at once. `LimitError`: a time too far ahead, or none."""
    _tick("now_s", now_s)
    if at_s is None:
        return now_s
    _tick("at_s", at_s)
    if at_s - now_s > MAX_AHEAD_S:
        raise words.LimitError(f"at_s is {at_s - now_s:.6f} s ahead; it must be at most {MAX_AHEAD_S:g} s ahead")
    return max(now_s, at_s)


def load_of(drive: words.Drive, resistance_ohm: float) -> Load:
    """The load of a drive. Heat is V^2/R over the pulse, an upper bound; a vibration does not use the coil."""
    if not isinstance(drive, words.Pulse | words.Effect):
        raise words.LimitError(f"drive is {drive!r}; it must be a Pulse or an Effect")
    if isinstance(drive, words.Effect):
        return Load(on_s=0.0, heat_J=0.0)
    if not (words.is_finite(resistance_ohm) and resistance_ohm > 0):
        shown_ohm = words.shown(resistance_ohm)
        raise words.LimitError(
            f"resistance_ohm is {shown_ohm}; it must be finite and above 0 to estimate the coil's heat"
        )
    return Load(on_s=drive.pulse_s, heat_J=drive.voltage_V**2 / resistance_ohm * drive.pulse_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveHistory:
    """The shots of the last minute, the magnet's return and the coil's warmth. `record` gives the next history.

    The coil is one body, C dT/dt = P - (T - T_ambient)/R_thermal, that takes a pulse's heat at once at its onset.
    `warmth_K` is its temperature above the room just after the last onset, at `warmth_tick`.
    """

    pulses: tuple[tuple[int, int], ...] = ()  # start and end of each, ticks, oldest first
    ready_tick: int | None = None
    warmth_K: float = 0.0
    warmth_tick: int = 0

    def __post_init__(self) -> None:
        ticks = (self.warmth_tick, *(() if self.ready_tick is None else (self.ready_tick,)), *chain(*self.pulses))
        one_of_each_type = {type(tick): tick for tick in ticks}.values()  # a train's hundreds are judged at every shot
        if not all(map(words.is_whole_number, one_of_each_type)):
            raise words.LimitError("a history of shots counts in whole microseconds")
        if not (words.is_finite(self.warmth_K) and self.warmth_K >= 0):
            raise words.LimitError(
                f"warmth_K is {words.shown(self.warmth_K)}; it must be a finite number of at least 0"
            )

    def earliest_s(self, load: Load) -> float:
        """The earliest time at which `load` may start, -inf if nothing was fired yet, inf if never.

        It may then start at any later time as well, as long as nothing else is recorded.
        """
        return max((time for time, _ in self._earliest(load)), default=-math.inf)

    def check(self, load: Load, at_s: float) -> None:
        """Nothing if `load` may start at `at_s`. `LimitError` names the limit and the earliest allowed time."""
        at = _tick("at_s", at_s) / TICKS
        broken = [(time, limit) for time, limit in self._earliest(load) if at < time]
        if not broken:
            return
        time, limit = max(broken)
        allowed = f"the earliest allowed time is {time:.6f} s" if time < math.inf else "it is never allowed"
        raise words.LimitError(f"shot at {at_s:.6f} s of {load.on_s:g} s and {load.heat_J:.3g} J: {limit}; {allowed}")

    def record(self, load: Load, at_s: float, ready_s: float) -> DriveHistory:
        """The history after `load` started at `at_s`, with the magnet home at `ready_s`. `LimitError` as `check`."""
        self.check(load, at_s)
        start, ready = _tick("at_s", at_s), _tick("ready_s", ready_s)
        end = start + _on_ticks(load)
        recent = dropwhile(lambda pulse: pulse[0] <= start - _MINUTE, self.pulses)
        return DriveHistory(
            pulses=(*recent, (start, end)),
            ready_tick=max(ready, end),
            warmth_K=self._warmth(start) + load.heat_J / HEAT_CAPACITY_J_K,
            warmth_tick=start,
        )

    @property
    def ready_s(self) -> float:
        """When the magnet is home; -inf if nothing was fired yet."""
        return -math.inf if self.ready_tick is None else self.ready_tick / TICKS

    def is_ready(self, at_s: float) -> bool:
        """Whether the magnet is home at `at_s`, to the microsecond."""
        return self.ready_tick is None or _tick("at_s", at_s) >= self.ready_tick

    def coil_celsius(self, at_s: float) -> float:
        """The estimated temperature of the coil in degC."""
        return AMBIENT_C + self._warmth(_tick("at_s", at_s))

    def _warmth(self, tick: int) -> float:
        return self.warmth_K * math.exp(-max(0, tick - self.warmth_tick) / TICKS / _TIME_CONSTANT_S)

    def _earliest(self, load: Load) -> list[tuple[float, str]]:
        """The earliest time that each limit allows, and the limit's name."""
        count = f"{len(self.pulses)} shots in a minute, limit {MAX_SHOTS_PER_MINUTE}"
        warm = f"coil at {AMBIENT_C + self.warmth_K:.1f} degC before it, limit {MAX_COIL_C:g} degC after it"
        return [
            (self.ready_s, "the magnet is not home yet, by the model"),
            (self._by_count(), count),
            (self._by_duty(_on_ticks(load)), f"driven for more than {MAX_DUTY:.0%} of a second"),
            (self._by_heat(load), warm),
        ]

    def _by_count(self) -> float:
        if len(self.pulses) < MAX_SHOTS_PER_MINUTE:
            return -math.inf
        return (self.pulses[-MAX_SHOTS_PER_MINUTE][0] + _MINUTE) / TICKS

    def _by_duty(self, on: int) -> float:
        """A second is fullest when it ends with the new pulse; it must not begin before the budget is used up."""
        budget = _DUTY_TICKS - on
        if budget < 0:
            return math.inf
        for start, end in reversed(self.pulses):
            if end - start > budget:
                return (end - budget + _SECOND - on) / TICKS
            budget -= end - start
        return -math.inf

    def _by_heat(self, load: Load) -> float:
        room_K = MAX_COIL_C - AMBIENT_C - load.heat_J / HEAT_CAPACITY_J_K
        if room_K >= self.warmth_K:
            return -math.inf
        if room_K <= 0:
            return math.inf
        cooling_s = _TIME_CONSTANT_S * math.log(self.warmth_K / room_K)
        return (self.warmth_tick + math.ceil(cooling_s * TICKS)) / TICKS


def _tick(name: str, time_s: float) -> int:
    if not words.is_finite(time_s):
        raise words.LimitError(f"{name} is {words.shown(time_s)}; it must be a finite time in seconds")
    return round(time_s * TICKS)


def _on_ticks(load: Load) -> int:
    """The driven time, rounded up; a rounding error of the product does not count as a tick."""
    return math.ceil(load.on_s * TICKS - 1e-6)


BEYOND_VOLTAGE = f"voltage above {words.MAX_VOLTAGE_V:g} V"
BEYOND_PULSE = f"pulse above {1e3 * words.MAX_PULSE_S:g} ms"
BEYOND_DUTY = f"driven for more than {100 * MAX_DUTY:g} % of a second"
BEYOND_HEAT = f"coil above {MAX_COIL_C:g} °C in the end"
TRAIN_LIMITS = (BEYOND_VOLTAGE, BEYOND_PULSE, BEYOND_DUTY, BEYOND_HEAT)
"""What a steady train may break, in the order in which it is judged."""


def broken_limit(voltage_V: float, pulse_s: float, resistance_ohm: float, rate_Hz: float) -> str | None:
    """The first of `TRAIN_LIMITS` that a steady train of such pulses would break; None if it may go on for ever."""
    if voltage_V > words.MAX_VOLTAGE_V:
        return BEYOND_VOLTAGE
    if pulse_s > words.MAX_PULSE_S:
        return BEYOND_PULSE
    load = load_of(words.Pulse(voltage_V=voltage_V, pulse_s=pulse_s), resistance_ohm)
    if _fullest_second(load, rate_Hz) > _DUTY_TICKS:
        return BEYOND_DUTY
    return BEYOND_HEAT if steady_coil_C(load, rate_Hz) > MAX_COIL_C else None


def steady_coil_C(load: Load, rate_Hz: float) -> float:  # noqa: N802 - the unit ends the name
    """The coil's temperature just after a shot of an endless train: T_room + (Q/C) / (1 - exp(-1/(f R C)))."""
    fall = -math.expm1(-1.0 / (rate_Hz * THERMAL_RESISTANCE_K_W * HEAT_CAPACITY_J_K))
    return AMBIENT_C + load.heat_J / HEAT_CAPACITY_J_K / fall


def _fullest_second(load: Load, rate_Hz: float) -> int:
    """The ticks driven in the fullest second of a steady train: one that begins with a pulse."""
    on, period = _on_ticks(load), round(TICKS / rate_Hz)
    whole, rest = divmod(_SECOND, period)
    return whole * on + min(on, rest)
