"""The designs that are looked at (friction by voltage by pulse, through the gun's own values), and their shots."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.predict.design_search.felt import percepts_of_shots
from analysis.predict.jobs import RunPieces, one_by_one
from analysis.stats.arrays import FloatArray
from device.limits import MAX_SHOTS_PER_MINUTE
from device.parameters import GunParameters
from device.physics import ShotSummary, simulate_batch
from device.physics.batch import no_compiler, simulator
from device.physics.equations import HOME, STATUSES
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.load import find, load_gun, load_setup
from experiments.synthetic.percept import Percept, percept_of_summary

LEAST_GRID, MOST_GRID = 4, 200
LEAST_PULSE_S = 0.002
"""Where the sweep of the pulse begins unless told otherwise; a shorter one hardly moves the magnet."""
MOST = {"--friction": (1000.0, "N"), "--voltage": (1000.0, "V"), "--pulse": (1.0, "s")}
"""Beyond, nothing is a gun for a hand."""
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
    most, unit = MOST[option]
    if high > most or low > most:
        raise ConfigError(f"{option} {text}: must be at most {most:g} {unit}")
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
    return setup.source.parent / setup.config.gun, setup.gun, tuple(setup.config.methods)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionRow:
    """Shots that differ in their voltage alone, and the leaks under which they are felt."""

    gun: GunParameters
    voltage_V: tuple[float, ...]
    leaks_s: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """The shots of one pulse, arrays (frictions, voltages). Without a status `home` all but the status is NaN.

    `felt` of each leak and `by_summary` (of the first leak) have a last axis of first, reaction, second.
    """

    pulse_s: float
    status: NDArray[np.int8]
    period_s: FloatArray  # from one shot to the next: the magnet is home and the pulse over
    felt: dict[float, FloatArray]
    by_summary: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotPercepts:
    """One shot. `felt` for each leak in their order; nothing is said of what is felt if the magnet is not home."""

    status: int
    period_s: float = math.nan
    felt: tuple[Percept, ...] = ()
    by_summary: Percept | None = None


def shots(row: FrictionRow) -> list[ShotPercepts]:
    """The shots of a row."""
    guns = [replace(row.gun, voltage_V=voltage_V) for voltage_V in row.voltage_V]
    return shots_of(guns, simulate_batch(row.gun, voltage_V=row.voltage_V).summaries(), row.leaks_s)


def shot_of(gun: GunParameters, leaks_s: Sequence[float]) -> ShotPercepts:
    """One shot from rest and what is felt of it."""
    return shots_of([gun], [simulator()(gun)], leaks_s)[0]


def shots_of(
    guns: Sequence[GunParameters], summaries: Sequence[ShotSummary], leaks_s: Sequence[float]
) -> list[ShotPercepts]:
    """Shots from rest and what is felt of those that come home."""
    home = [place for place, summary in enumerate(summaries) if _is_home(summary)]
    felt = percepts_of_shots([guns[place] for place in home], [summaries[place] for place in home], leaks_s)
    found = [ShotPercepts(status=STATUSES.index(summary.status)) for summary in summaries]
    for place, percepts in zip(home, felt, strict=True):
        found[place] = _at_home(guns[place], summaries[place], percepts, leaks_s[0])
    return found


def _is_home(summary: ShotSummary) -> bool:
    return STATUSES.index(summary.status) == HOME and summary.reset_end_s is not None


def _at_home(
    gun: GunParameters, summary: ShotSummary, felt: tuple[Percept, ...], summary_leak_s: float
) -> ShotPercepts:
    return ShotPercepts(
        status=HOME,
        period_s=max(summary.reset_end_s or 0.0, gun.pulse_s),
        felt=felt,
        by_summary=percept_of_summary(summary, gun.magnet_mass_kg, summary_leak_s),
    )


def rows_of(space: Space, pulses_s: Sequence[float], leaks_s: tuple[float, ...]) -> list[FrictionRow]:
    """The work: a row for each pulse and friction. Only the gun's own pulse is felt under more than the first leak."""
    return [
        FrictionRow(
            gun=replace(space.gun, friction_N=friction_N, pulse_s=pulse_s),
            voltage_V=space.voltage_V,
            leaks_s=leaks_s if pulse_s == space.gun.pulse_s else leaks_s[:1],
        )
        for pulse_s in pulses_s
        for friction_N in space.friction_N
    ]


def simulate_rows(rows: Sequence[FrictionRow], run: RunPieces, tell: Callable[[str], None]) -> list[list[ShotPercepts]]:
    """The shots of each row, in their order, wherever they are worked out; `tell` is told of each row's pulse.

    In machine code they are worked out here: a process would load the compiler for longer than it works.
    """
    found: dict[int, list[ShotPercepts]] = {}

    def done(number: int, what: list[ShotPercepts]) -> None:
        found[number] = what
        tell(f"{1e3 * rows[number].gun.pulse_s:.3g} ms, {rows[number].gun.friction_N:.3g} N")

    (run if no_compiler() else one_by_one)(shots, rows, done)
    return [found[number] for number in range(len(rows))]


def layers(space: Space, rows: Sequence[FrictionRow], found: Sequence[Sequence[ShotPercepts]]) -> dict[float, Layer]:
    """The shots by their pulse."""
    size = len(space.friction_N)
    starts = range(0, len(rows), size)
    return {
        rows[at].gun.pulse_s: _layer(rows[at].gun.pulse_s, rows[at].leaks_s, found[at : at + size]) for at in starts
    }


def _layer(pulse_s: float, leaks_s: Sequence[float], grid: Sequence[Sequence[ShotPercepts]]) -> Layer:
    return Layer(
        pulse_s=pulse_s,
        status=np.array([[shot.status for shot in row] for row in grid], dtype=np.int8),
        period_s=np.array([[shot.period_s for shot in row] for row in grid]),
        felt={
            leak_s: np.array([[_numbers(shot.felt[n] if shot.felt else None) for shot in row] for row in grid])
            for n, leak_s in enumerate(leaks_s)
        },
        by_summary=np.array([[_numbers(shot.by_summary) for shot in row] for row in grid]),
    )


def _numbers(percept: Percept | None) -> tuple[float, float, float]:
    return (math.nan,) * 3 if percept is None else (percept.first, percept.reaction, percept.second)


def one_more(space: Space, layer: Layer, leak_s: float, more_V: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A layer's percepts and voltages with one more voltage of each friction; the lowest again where it is none."""
    felt, volts = [], []
    for friction_N, row, voltage_V in zip(space.friction_N, layer.felt[leak_s], more_V.tolist(), strict=True):
        more = voltage_V if math.isfinite(voltage_V) else space.voltage_V[0]
        gun = replace(space.gun, pulse_s=layer.pulse_s, friction_N=friction_N, voltage_V=more)
        shot, place = shot_of(gun, (leak_s,)), int(np.searchsorted(space.voltage_V, more))
        felt.append(np.insert(row, place, _numbers(shot.felt[0] if shot.felt else None), axis=0))
        volts.append(np.insert(space.voltage_V, place, more))
    return np.array(felt), np.array(volts)
