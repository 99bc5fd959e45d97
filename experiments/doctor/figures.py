"""The raw figures of each check, and what a check found: its verdict, in words and raw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Percentiles:
    """Median, 95th and 99th percentile and the largest of `n` values, in the unit of the values."""

    n: int
    median: float
    p95: float
    p99: float
    worst: float


def percentile(values: Sequence[float], percent: float) -> float:
    """The smallest value that at least `percent` of 100 of the values do not exceed. `ValueError` if there is none.

    The inverse of the empirical distribution function, so always a value that was measured: definition 1 of Hyndman
    and Fan (1996), The American Statistician 50, 361-365.

    >>> percentile([3.0, 1.0, 2.0], 50)
    2.0
    """
    if not values or not 0 < percent <= 100:
        raise ValueError(f"percentile {percent} of {len(values)} values: needs a value, and 0 < percentile <= 100")
    return float(np.percentile(values, percent, method="inverted_cdf"))


def spread(values: Sequence[float]) -> Percentiles:
    """Middle and tail of some values. `ValueError` if there are none."""
    return Percentiles(
        n=len(values),
        median=percentile(values, 50),
        p95=percentile(values, 95),
        p99=percentile(values, 99),
        worst=max(values),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """The machine and the versions on it; a version is `None` where the package is not installed."""

    system: str
    python: str
    cores: int
    versions: dict[str, str | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ticks:
    """The clock: the resolution it claims, the smallest step seen, and how much longer a sleep of 1 ms was."""

    resolution_s: float
    smallest_step_s: float
    oversleep_ms: Percentiles


@dataclass(frozen=True, slots=True, kw_only=True)
class Appends:
    """Lines appended to a file, each synced, and what is free on its disk."""

    append_ms: Percentiles
    free_bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class GunLine:
    """A gun that answered: who, how fast, and its state when asked to be disarmed."""

    gun: str
    state: str
    fault: str | None
    round_trip_ms: Percentiles
    clock_jumps: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Adapter:
    """A USB serial adapter and how long it keeps bytes back; `setting` is the file that says so."""

    name: str
    setting: str
    latency_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Display:
    """The first screen as Qt sees it, and how long a window took to be seen, `None` if it never was."""

    platform: str
    width_px: int
    height_px: int
    refresh_Hz: float
    opened_ms: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PsychoPyStage:
    """PsychoPy: the time of its import, of a window's opening, and the frames a second that it drew."""

    version: str
    import_s: float
    opened_s: float
    frames_Hz: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sound:
    """The output devices by name, and the one used unless another is named, empty if there is none."""

    outputs: list[str]
    default: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Keys:
    """Injected keys that came to a window: until Qt told of each, and until its handler had painted and returned."""

    injected: int
    to_event_ms: list[float]
    to_painted_ms: list[float]


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerStream:
    """Markers through a stream of Lab Streaming Layer: how many were sent, and how long those took that came.

    None were sent if nobody on this machine found the stream.
    """

    version: str
    sent: int
    to_reader_ms: list[float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Adapters:
    """The USB serial adapters that have a latency timer."""

    adapters: tuple[Adapter, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsoleLatency:
    """What a way through the console took, in so many trials, against its bound."""

    ms: Percentiles
    bound_ms: float
    trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class NoFigures:
    """Nothing was measured."""


ProgramFigures = Display | PsychoPyStage | Sound | Keys | MarkerStream
"""What a program of its own looks at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFigures:
    """A sensor at rest: samples a second, their noise, and how many shots it takes to see a damper slip by a tenth."""

    sensor: str
    rate_Hz: float
    noise_m_s2: float
    shots_to_see: float | None


Figures = Machine | Ticks | Appends | GunLine | Adapters | ProgramFigures | ConsoleLatency | SensorFigures | NoFigures

DoctorVerdict = Literal["good", "warning", "fails", "not there"]
"""`warning`: works, but not as it should; `fails`: a run would suffer; `not there`: this machine has no such thing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorFinding:
    """One row of the table. `figures` are the raw ones; the unit ends the name of each."""

    check: str
    verdict: DoctorVerdict
    measured: str
    advice: str = ""
    figures: Figures = NoFigures()
