"""Troubles to order for the twin: how often, and what they do to bytes. Pure: chance is an argument."""

from __future__ import annotations

from dataclasses import dataclass, fields
from random import Random


@dataclass(frozen=True, slots=True, kw_only=True)
class Troubles:
    """Probabilities from 0 to 1, and times in seconds. `ValueError` names what is out of range.

    A damage is drawn for each piece of bytes, either way; an accident for each shot (in mid-pulse) or answer.
    """

    latency_s: float = 0.0  # each way
    jitter_s: float = 0.0  # at most so much more, each way
    lose: float = 0.0  # a byte
    double: float = 0.0  # a byte
    corrupt: float = 0.0  # a bit
    partial: float = 0.0  # the rest of a piece
    reset: float = 0.0  # of the gun, in mid-shot
    busy: float = 0.0  # the pulse does not end for 2 s
    late: float = 0.0  # the board begins the shot late, at most half its length after its end
    hang: float = 0.0  # the gun reads nothing for `hang_s` from a shot's start on
    unplug: float = 0.0  # in mid-shot
    unplug_reply: float = 0.0  # in mid-answer
    unplug_idle: float = 0.0  # after an answer
    hang_s: float = 0.5
    replug_s: float = 0.3

    def __post_init__(self) -> None:
        for field in fields(self):
            value, most = getattr(self, field.name), 60.0 if field.name.endswith("_s") else 1.0
            if not 0 <= value <= most:
                raise ValueError(f"{field.name} is {value}; it must be 0 to {most:g}")

    @property
    def unplugs(self) -> bool:
        """Whether the gun may be unplugged."""
        return max(self.unplug, self.unplug_reply, self.unplug_idle) > 0

    def delay_s(self, draw: Random) -> float:
        """How long a piece is on its way."""
        return self.latency_s + (draw.random() * self.jitter_s if self.jitter_s else 0.0)

    def damaged(self, data: bytes, draw: Random) -> bytes:
        """What becomes of a piece of bytes on its way."""
        for name, damage in _DAMAGES.items():
            rate = getattr(self, name)
            if data and rate and draw.random() < rate:
                data = damage(data, draw.randrange(len(data)), draw)
        return data


def _lose(data: bytes, place: int, _: Random) -> bytes:
    return data[:place] + data[place + 1 :]


def _double(data: bytes, place: int, _: Random) -> bytes:
    return data[: place + 1] + data[place:]


def _corrupt(data: bytes, place: int, draw: Random) -> bytes:
    return data[:place] + bytes([data[place] ^ 1 << draw.randrange(8)]) + data[place + 1 :]


def _partial(data: bytes, place: int, _: Random) -> bytes:
    return data[:place]


_DAMAGES = {"lose": _lose, "double": _double, "corrupt": _corrupt, "partial": _partial}
