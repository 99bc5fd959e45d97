"""Would the device allow a steady train of a design's pulses for ever? By the rules of `device.limits`, in one step."""

from __future__ import annotations

import math

from device.limits import (
    AMBIENT_C,
    HEAT_CAPACITY_J_K,
    MAX_COIL_C,
    MAX_DUTY,
    THERMAL_RESISTANCE_K_W,
    Load,
    load_of,
)
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse

_TICKS = 1_000_000  # a second, as the limits count it


VOLTAGE = f"voltage above {MAX_VOLTAGE_V:g} V"
PULSE = f"pulse above {1e3 * MAX_PULSE_S:g} ms"
DUTY = f"driven for more than {100 * MAX_DUTY:g} % of a second"
HEAT = f"coil above {MAX_COIL_C:g} °C in the end"
LIMITS = (VOLTAGE, PULSE, DUTY, HEAT)


def broken_limit(voltage_V: float, pulse_s: float, resistance_ohm: float, rate_Hz: float) -> str | None:
    """The first of `LIMITS` that a steady train of such pulses would break; None if it may go on for ever."""
    if voltage_V > MAX_VOLTAGE_V:
        return VOLTAGE
    if pulse_s > MAX_PULSE_S:
        return PULSE
    load = load_of(Pulse(voltage_V=voltage_V, pulse_s=pulse_s), resistance_ohm)
    if fullest_second_s(load, rate_Hz) > MAX_DUTY + 1e-9:
        return DUTY
    return HEAT if steady_coil_C(load, rate_Hz) > MAX_COIL_C else None


def fullest_second_s(load: Load, rate_Hz: float) -> float:
    """The time driven in the fullest second of a steady train: one that begins with a pulse."""
    on, period = math.ceil(load.on_s * _TICKS - 1e-6), round(_TICKS / rate_Hz)
    whole, rest = divmod(_TICKS, period)
    return (whole * on + min(on, rest)) / _TICKS


def steady_coil_C(load: Load, rate_Hz: float) -> float:  # noqa: N802 - the unit ends the name
    """The coil's temperature just after a shot of an endless train: T_room + (Q/C) / (1 - exp(-1/(f R C)))."""
    fall = -math.expm1(-1.0 / (rate_Hz * THERMAL_RESISTANCE_K_W * HEAT_CAPACITY_J_K))
    return AMBIENT_C + load.heat_J / HEAT_CAPACITY_J_K / fall
