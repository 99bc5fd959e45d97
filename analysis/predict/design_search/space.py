"""The designs that are looked at: damper friction by voltage by pulse, each axis through the gun's own values."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from device.limits import MAX_SHOTS_PER_MINUTE
from device.parameters import GunParameters
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.load import find, load_gun, load_setup

LEAST_GRID, MOST_GRID = 4, 200
LEAST_PULSE_S = 0.002
"""Where the sweep of the pulse begins unless told otherwise; a shorter one hardly moves the magnet."""
MOST = {"--friction": 1000.0, "--voltage": 1000.0, "--pulse": 1.0}
"""Newton, volt and seconds: beyond, nothing is a gun for a hand."""
BEYOND_PRELOAD = 1.1
"""The sweep of the friction ends so far above what the pre-load can return, to show where that is."""

_NUMBER = r"(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRequest:
    """What is asked for; ranges as typed, None for the whole sweep."""

    config: str | None = None
    gun: str | None = None
    friction: str | None = None
    voltage: str | None = None
    pulse: str | None = None
    rate_above_Hz: float = 5.0
    grid: int = 40
    seed: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Space:
    """The axes, and the gun that stands behind them.

    `own` are the gun's methods with a force by their label; `gun` is the first of them, whose other numbers all
    designs share. The critical conditions are looked for at its pulse.
    """

    source: Path
    title: str
    gun: GunParameters
    own: dict[str, GunParameters]
    friction_N: tuple[float, ...]
    voltage_V: tuple[float, ...]
    pulse_s: tuple[float, ...]

    @property
    def pulses_s(self) -> tuple[float, ...]:
        """The pulses to simulate: those to choose from, and the gun's own."""
        return tuple(sorted({*self.pulse_s, self.gun.pulse_s}))


def make_space(request: DesignRequest) -> Space:
    """The space of a request. `ConfigError` names the option, its value and the rule."""
    check_rate(request.rate_above_Hz)
    if not LEAST_GRID <= request.grid <= MOST_GRID:
        raise ConfigError(f"--grid {request.grid}: must be {LEAST_GRID} to {MOST_GRID} values an axis")
    source, config, names = _gun(request)
    own = _force_methods(source, config, names)
    gun = next(iter(own.values()))
    frictions = span("--friction", request.friction, _frictions(own))
    voltages = span("--voltage", request.voltage, (0.0, MAX_VOLTAGE_V))
    pulses = span("--pulse", request.pulse, (LEAST_PULSE_S, MAX_PULSE_S), single=True)
    few = max(4, request.grid // 5) if pulses[0] < pulses[1] else 1
    return Space(
        source=source,
        title=config.title,
        gun=gun,
        own=own,
        friction_N=axis(*frictions, request.grid, [one.friction_N for one in own.values()]),
        voltage_V=axis(*voltages, request.grid, [one.voltage_V for one in own.values()]),
        pulse_s=axis(*pulses, few, [one.pulse_s for one in own.values()], by_ratio=True),
    )


def check_rate(rate_Hz: float) -> None:
    """`ConfigError`: a bound that is none, or one at which the device never shoots for long."""
    most = MAX_SHOTS_PER_MINUTE / 60.0
    if not 0.0 < rate_Hz <= most:
        raise ConfigError(
            f"--rate-above {rate_Hz:g}: must be above 0 and at most {most:g} Hz, since the device allows "
            f"{MAX_SHOTS_PER_MINUTE} shots a minute"
        )


def span(option: str, text: str | None, default: tuple[float, float], *, single: bool = False) -> tuple[float, float]:
    """The ends of a typed range. `ConfigError`: not FROM-TO, beyond `MOST`, or the wrong way round.

    >>> span("--voltage", "8-24", (0.0, 24.0)), span("--pulse", "1e-2", (0.002, 0.02), single=True)
    ((8.0, 24.0), (0.01, 0.01))
    """
    if text is None:
        return default
    form = "FROM-TO, or one value" if single else "FROM-TO"
    found = re.fullmatch(rf"\s*{_NUMBER}\s*(?:-\s*{_NUMBER}\s*)?", text)
    if not found or not (single or found[2]):
        example = f"{default[0]:g}-{default[1]:g}"
        raise ConfigError(f"{option} {text}: must be {form}, numbers of at least 0 such as {example}")
    low, high = float(found[1]), float(found[2] or found[1])
    if high > MOST[option] or low > MOST[option]:
        raise ConfigError(f"{option} {text}: must be at most {MOST[option]:g}")
    if low > high or (low == high and not single):
        raise ConfigError(f"{option} {text}: FROM must be below TO")
    return low, high


def axis(low: float, high: float, count: int, through: list[float], *, by_ratio: bool = False) -> tuple[float, ...]:
    """So many values from `low` to `high`, at even distances or ratios; `through` take the nearest ones' places.

    >>> axis(0.0, 1.0, 5, [0.3, 7.0]), axis(1.0, 8.0, 4, [], by_ratio=True)
    ((0.0, 0.3, 0.5, 0.75, 1.0), (1.0, 2.0, 4.0, 8.0))
    """
    if count == 1:
        return (low,)
    shares = [n / (count - 1) for n in range(1, count - 1)]
    ratios = by_ratio and low > 0.0
    inner = [round(low * (high / low) ** s, 12) if ratios else low + (high - low) * s for s in shares]
    values = [low, *inner, high]
    for x in through:
        nearest = min(range(count), key=lambda n: abs(values[n] - x))
        if low <= x <= high and 0 < nearest < count - 1:
            values[nearest] = x
    return tuple(values)


def _gun(request: DesignRequest) -> tuple[Path, GunConfig, tuple[str, ...] | None]:
    """The gun's file, its config, and the methods that count (None: all)."""
    if request.config is not None and request.gun is not None:
        raise ConfigError(f"--gun {request.gun}: the config {request.config} names its gun; give one of the two")
    if request.config is None:
        source = find(request.gun or "gun")
        return source, load_gun(source), None
    setup = load_setup(request.config)
    return setup.source.parent / setup.config.gun, setup.gun, tuple(setup.config.design.methods)


def _force_methods(source: Path, gun: GunConfig, names: tuple[str, ...] | None) -> dict[str, GunParameters]:
    rendered = {gun.methods[name].label: gun.rendering(name) for name in names or gun.methods}
    own = {label: one for label, one in rendered.items() if isinstance(one, GunParameters)}
    if not own:
        raise ConfigError(f"{source}: methods: none has the actuator voice-coil; a vibration has no force to design")
    return own


def _frictions(own: dict[str, GunParameters]) -> tuple[float, float]:
    """From the least that the gun has: a damper only adds."""
    low = min(one.friction_N for one in own.values())
    gun = next(iter(own.values()))
    return low, max(BEYOND_PRELOAD * gun.stiffness_N_m * gun.preload_length_m, low + 1.0)
