"""The words of the gun: what can be asked of it, what it answers, and how it can fail.

Nothing here opens, waits or computes. A command beyond a limit cannot be built: the constructor refuses it,
and no config can lift the limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import Literal, Protocol, TypeGuard, get_args

from device.messages import RecoilError

Direction = Literal["forward", "backward"]
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)

MAX_VOLTAGE_V = 24.0
"""The bench supply of the paper; nothing above it exists."""
MAX_PULSE_S = 0.020
"""Longest pulse, assumed: twice the paper's 10 ms."""
MAX_EFFECT = 123
"""Waveforms in the library of the vibration driver (DRV2605)."""


class DeviceError(RecoilError):
    """Anything that goes wrong with a gun. `may_have_fired`: of a shot that was asked for nothing else is known."""

    may_have_fired = True


class LimitError(DeviceError, ValueError):
    """A command beyond a limit that no config can lift. Nothing was sent."""

    may_have_fired = False


class LinkError(DeviceError):
    """The gun did not answer, or not in its language."""


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a real number: of Python or numpy, whole or not, but neither true nor false, nor text.

    >>> is_number(1), is_number(True), is_number("1")
    (True, False, False)
    """
    return type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))


def is_finite(value: object) -> TypeGuard[float]:
    """Whether a value is a number within a float's range.

    >>> is_finite(1), is_finite(float("nan")), is_finite(10**400), is_finite(None)
    (True, False, False, False)
    """
    try:
        return is_number(value) and math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def is_whole_number(value: object) -> TypeGuard[int]:
    """Whether a value is a whole number by its type: 1 is, 1.0 and true are not."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def shown(value: object) -> str:
    """A value as an error names it: a number as it is, anything else so that text is told from a number."""
    return f"{value}" if is_number(value) else f"{value!r}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulse:
    """One drive pulse of the voice coil; refused with `LimitError` beyond 24 V or 20 ms, or if it is no number."""

    voltage_V: float
    pulse_s: float

    def __post_init__(self) -> None:
        _within("voltage_V", self.voltage_V, 0.0, MAX_VOLTAGE_V)
        _within("pulse_s", self.pulse_s, 0.0, MAX_PULSE_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One waveform of the vibration driver's library (DRV2605), 1 to 123."""

    effect: int

    def __post_init__(self) -> None:
        if not (is_whole_number(self.effect) and 1 <= self.effect <= MAX_EFFECT):
            raise LimitError(f"effect is {shown(self.effect)}; it must be a whole number from 1 to {MAX_EFFECT}")


Drive = Pulse | Effect


def _is_name(value: object) -> bool:
    return isinstance(value, str) and value != ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shot:
    """The command to fire once: which rendering method, which way the gun points, and how it is driven."""

    method: str
    direction: Direction
    drive: Drive

    def __post_init__(self) -> None:
        if not _is_name(self.method):
            raise LimitError(f"shot: method is {self.method!r}; it must name a rendering method")
        if self.direction not in DIRECTIONS:
            raise LimitError(f"shot: direction is {self.direction!r}; it must be one of {', '.join(DIRECTIONS)}")
        if not isinstance(self.drive, Pulse | Effect):
            raise LimitError(f"shot: drive is {self.drive!r}; it must be a Pulse or an Effect")


def judged(shot: object) -> Shot:
    """A shot judged again, as each gun does before it fires: a frozen value can be forced. `LimitError`: it is none."""
    if not isinstance(shot, Shot):
        raise LimitError(f"shot is {shot!r}; it must be a Shot")
    once = replace(shot)
    return replace(once, drive=replace(once.drive))


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotTiming:
    """How a shot over a line came about: host's times in seconds, the gun's in whole microseconds of its own clock.

    `written_s` is when the trigger was first written, `acknowledged_s` when the record of the shot was read.
    `accepted_s` and the pulse's times are the gun's put on the host's clock, true to within `uncertainty_s`, and lie
    between these two. `gun_count` is the gun's own count of shots since it was switched on, this one included: a gap
    tells of a shot of unknown outcome that was fired, a smaller one that the gun was reset. `asked` is how often the
    trigger was written until its outcome was known.
    """

    requested_s: float
    written_s: float
    acknowledged_s: float
    accepted_s: float
    pulse_start_s: float
    pulse_end_s: float
    uncertainty_s: float
    gun_accepted_us: int
    gun_start_us: int
    gun_end_us: int
    gun_count: int
    asked: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotReport:
    """What was rendered and when. Times are seconds on the host's monotonic clock.

    `timing`: how it came about, where that takes time at all.
    `home_predicted_s` is when the magnet is back at its stop by the model (there is no position sensor).
    `motion` is the model's status of the shot (`home`, `stuck`, ...), `rendered` for a vibration.
    """

    shot: Shot
    requested_s: float
    pulse_start_s: float
    pulse_end_s: float
    home_predicted_s: float
    motion: str
    timing: ShotTiming | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Who answers: model, firmware version, serial number or `simulated`."""

    model: str
    version: str
    serial: str

    @property
    def name(self) -> str:
        """Who renders, as the tables say it: `simulated`, or model and serial number."""
        return self.model if self.model == self.serial else f"{self.model}:{self.serial}"


GunState = Literal["disarmed", "armed", "resetting", "fault"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GunStatus:
    """The gun at this moment. `ready_at_s` is the earliest time of the next shot on the host's clock."""

    state: GunState
    shots: int
    coil_temperature_C: float
    ready_at_s: float
    fault: str | None = None


class Gun(Protocol):
    """What every gun does, real or simulated. It is born disarmed."""

    def identify(self) -> Identity:
        """Who answers."""

    def arm(self) -> None:
        """Allow the next shots."""

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once: now, or at a time on the host's clock, at most 2 s ahead; `disarm` calls a shot off that waits.

        `LimitError`: refused, nothing was sent. `LinkError`: the outcome is unknown.
        """

    def disarm(self) -> None:
        """Forbid shots, from every state."""

    def status(self) -> GunStatus:
        """The gun at this moment."""

    def close(self) -> None:
        """Disarm and let go of the gun."""


def _within(name: str, value: object, low: float, high: float) -> None:
    if not (is_number(value) and low <= value <= high):  # NaN compares false, so it is refused as well
        raise LimitError(f"{name} is {shown(value)}; it must be a number between {low:g} and {high:g}")
