"""`recoil twin`: a gun that is none, on a pseudo-terminal or a TCP port, for training and for tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from device.serial_gun.gun import MAX_SPEED
from device.twin.core import IDENTITY
from device.twin.twin import Make, Pty, Socket, Tcp, Troubles, Twin
from experiments.load import find, load_gun
from experiments.study.folders import PlaceError


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinRequest:
    """What was asked for on the command line."""

    gun: str
    link: Path | None
    tcp: int | None
    speed: float
    drift_ppm: float
    wire: int | None
    troubles: Sequence[str]
    seed: int


def serve(asked: TwinRequest, tell: Callable[[dict[str, Any]], None]) -> None:
    """Be a gun until interrupted. `tell` is called once it can be opened. `PlaceError`: it cannot be so."""
    gun = load_gun(find(asked.gun))
    methods = {name: gun.rendering(name) for name in gun.methods}
    socket = _socket(asked)
    twin = Twin(socket, methods, _make(asked))
    try:
        socket.plug()
    except (OSError, ImportError, AttributeError) as error:  # the latter two: a system without pseudo-terminals
        raise PlaceError(f"the twin cannot be plugged in here: {error}; try --tcp PORT, or another --link") from error
    with closing(_Plugged(socket)):
        tell({"address": socket.address, "gun": _gun_option(socket.address, asked.speed)})
        twin.serve()


class _Plugged:
    """A socket that is pulled out when all is over."""

    def __init__(self, socket: Socket) -> None:
        self._socket = socket

    def close(self) -> None:
        self._socket.unplug()


def _socket(asked: TwinRequest) -> Socket:
    if asked.tcp is not None and asked.link is not None:
        raise PlaceError("--tcp and --link: give one of them")
    return Pty(asked.link) if asked.tcp is None else Tcp(asked.tcp)


def _gun_option(address: str, speed: float) -> str:
    return f"serial:{address}" + (f"?speed={speed:g}" if speed != 1 else "")


def _make(asked: TwinRequest) -> Make:
    if not 0 < asked.speed <= MAX_SPEED:
        raise PlaceError(f"--speed is {asked.speed:g}; it must be above 0 and at most {MAX_SPEED:g}")
    troubles = troubles_of(asked.troubles)
    if troubles.unplugs and asked.tcp is None and asked.link is None:
        raise PlaceError("--trouble unplug...: a new pseudo-terminal has a new name; give --link PATH that stays")
    identity = IDENTITY if asked.wire is None else replace(IDENTITY, wire=asked.wire)
    return Make(identity=identity, speed=asked.speed, drift_ppm=asked.drift_ppm, troubles=troubles, seed=asked.seed)


def troubles_of(words: Sequence[str]) -> Troubles:
    """Troubles from `name=value`. `PlaceError` names the word and what may stand there.

    >>> troubles_of(["lose=0.01", "jitter_s=0.005"]).jitter_s
    0.005
    """
    known, found = [field.name for field in fields(Troubles)], dict[str, float]()
    for word in words:
        name, _, value = word.partition("=")
        try:
            if name not in known:
                raise ValueError(f"unknown; known are {', '.join(known)}")
            found[name] = float(value)
            Troubles(**{name: found[name]})
        except ValueError as error:
            raise PlaceError(f"--trouble {word}: {error}") from error
    return Troubles(**found)
