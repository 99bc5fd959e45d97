"""The raw figures of each check. The child programs send some of them as JSON, so only plain values stand in those."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.doctor.spread import Spread


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
    oversleep_ms: Spread


@dataclass(frozen=True, slots=True, kw_only=True)
class Appends:
    """Lines appended to a file, each synced, and what is free on its disk."""

    append_ms: Spread
    free_bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A gun that answered: who, how fast, and its state when asked to be disarmed."""

    gun: str
    state: str
    fault: str | None
    round_trip_ms: Spread


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
class Stage:
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
