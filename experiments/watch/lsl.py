"""Markers on the network as streams of Lab Streaming Layer, from a process of its own: no run ever waits for it."""

from __future__ import annotations

import hashlib
import math
import os
import platform
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from device.machine_clock import machine_s
from device.messages import RecoilError, error_line, said_by
from experiments.clock import ClockMap, RoundTrip, clock_map
from experiments.watch.feed import MarkerFeed
from experiments.watch.markers import DETAIL_COLUMNS, Marker
from experiments.watch.server import NICE

if TYPE_CHECKING:
    from pylsl import StreamInfo

MARKERS_NAME, DETAILS_NAME = "Recoil", "Recoil details"
_LOOK_S = 0.1
"""How long after a look the next one comes. A marker has the time of its event, however late it is sent."""
CLOCK_S = 1.0
"""How often the two clocks are read beside each other."""
_READINGS = 20
"""Readings of which the quickest counts."""
FOUND_S = 2.0
"""How long it is looked for our own streams; on a network that works they are there within a few milliseconds."""
_LATE_S = 10.0
LINGER_S = 0.5
"""So long the streams stay for those who still read."""
_INSTALL = (
    "install the extra `lsl` (`make setup` in Recoil's folder does; without make: docs/install.md); on a system for "
    "which pylsl brings no library, install liblsl too"
)


class NoStreams(RecoilError):  # noqa: N818 - what is not there
    """There can be no streams here; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerStreams:
    """What a recorder finds: two streams, by their names and their source."""

    folder: str
    streams: tuple[str, ...]
    source: str
    problem: str = ""


def source_of(folder: Path) -> str:
    """What tells the streams of a folder's runs from others', and is the same after a new start.

    A recorder that lost them finds them again by it.
    """
    return "recoil-" + hashlib.sha256(f"{platform.node()}\0{folder.absolute()}".encode()).hexdigest()[:16]


class MarkerOutlets:
    """Two outlets of the same events: a marker in one channel for every program, and its details by column.

    `NoStreams`: there is no library, or it makes no streams.
    """

    def __init__(self, source: str) -> None:
        try:
            import pylsl  # noqa: PLC0415 - an extra, used here alone
        except (ImportError, OSError, RuntimeError) as error:  # no package, or a package without its library
            raise NoStreams(f"no Lab Streaming Layer here ({error_line(error)}): {_INSTALL}") from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # something else by its name
            raise NoStreams(f"the package pylsl is broken ({said_by(error)}): {_INSTALL}") from error
        self._lsl, self._source = pylsl, source
        try:
            self._outlets = [
                pylsl.StreamOutlet(self._info(MARKERS_NAME, "Markers", ("marker",))),
                pylsl.StreamOutlet(self._info(DETAILS_NAME, "Details", DETAIL_COLUMNS)),
            ]
            self._clock, self._next_s = self._mapped(), 0.0
        except RuntimeError as error:
            raise NoStreams(
                f"Lab Streaming Layer makes no stream ({error_line(error)}): look at this machine's network"
            ) from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # something else by its name
            where = getattr(pylsl, "__file__", None) or "pylsl"
            raise NoStreams(f"{where}: is not what it should be ({said_by(error)}): {_INSTALL}") from error

    def _info(self, name: str, kind: str, columns: Sequence[str]) -> StreamInfo:
        lsl = self._lsl
        source = f"{self._source}-{kind.lower()}"
        info = lsl.StreamInfo(name, kind, len(columns), lsl.IRREGULAR_RATE, "string", source)
        channels = info.desc().append_child("channels")
        for column in columns:
            channels.append_child("channel").append_child_value("label", column)
        return info

    def found(self) -> bool:
        """Whether the streams are found by who looks for them on the network."""
        predicate = f"starts-with(source_id,'{self._source}')"
        with _of_library():
            return len(self._lsl.resolve_bypred(predicate, len(self._outlets), FOUND_S)) == len(self._outlets)

    def send(self, marker: Marker) -> None:
        """Send a marker with its time on the clock of the streams, whose own uncertainty is added. Never waits."""
        with _of_library():
            there = self._clock_now()
            told = replace(marker, uncertainty_s=marker.uncertainty_s + there.uncertainty_s)
            at_s = there.there(marker.at_s)
            for outlet, sample in zip(self._outlets, ((told.name,), told.details), strict=True):
                outlet.push_sample(sample, at_s)

    def close(self) -> None:
        """Let go of the streams, when those who read had their time."""
        with _of_library():
            if any(outlet.have_consumers() for outlet in self._outlets):
                time.sleep(LINGER_S)
            self._outlets.clear()

    def _clock_now(self) -> ClockMap:
        now_s = machine_s()
        if now_s >= self._next_s:
            before, new = self._clock, self._mapped()
            self._clock = replace(new, uncertainty_s=new.uncertainty_s + abs(new.offset_s - before.offset_s))
            self._next_s = now_s + CLOCK_S
        return self._clock

    def _mapped(self) -> ClockMap:
        """The clock of the streams beside that of the journals, which are the same on some systems."""
        read, there = machine_s, self._lsl.local_clock
        found = clock_map(RoundTrip(sent_s=read(), there_s=there(), back_s=read()) for _ in range(_READINGS))
        if not math.isfinite(found.offset_s):
            raise ValueError(f"its clock gives {there()!r}")
        return found


@contextmanager
def _of_library() -> Iterator[None]:
    """`NoStreams` for whatever the library raises."""
    try:
        yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise NoStreams(
            f"Lab Streaming Layer broke off ({said_by(error)}): what follows is not sent; the journals are whole"
        ) from error


@contextmanager
def quiet_library() -> Iterator[None]:
    """What the library itself writes to standard error is not seen meanwhile; what we say is."""
    said, sys_stderr = os.dup(2), sys.stderr
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    os.close(nowhere)
    sys.stderr = os.fdopen(said, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)
    try:
        yield
    finally:
        with suppress(OSError):  # nobody reads it any more
            sys.stderr.flush()
        sys.stderr = sys_stderr
        os.dup2(said, 2)
        os.close(said)


def send_markers(
    folder: Path, tell: Callable[[MarkerStreams], None], say: Callable[[str], None], over: threading.Event
) -> None:
    """Send the markers of a results folder's runs until it is over. `tell` is called once the streams are there.

    `NoStreams`: there can be none.
    """
    if hasattr(os, "nice"):
        os.nice(NICE)
    with quiet_library():
        late = threading.Timer(_LATE_S, say, ("pylsl does not answer yet; if it hangs, install it anew",))
        late.daemon = True
        late.start()
        streams = MarkerOutlets(source_of(folder))
        late.cancel()
        try:
            feed = MarkerFeed(folder, say)
            problem = "" if streams.found() else _NOT_FOUND
            names = (MARKERS_NAME, DETAILS_NAME)
            tell(MarkerStreams(folder=str(folder), streams=names, source=source_of(folder), problem=problem))
            while not over.wait(_LOOK_S):
                _send(streams, feed)
            feed.find()
            _send(streams, feed)
        finally:
            streams.close()


_NOT_FOUND = (
    "the streams are not found on this machine's own network; a recorder may not find them either: look at network and "
    "firewall (multicast, ports 16571 to 16604)"
)


def _send(streams: MarkerOutlets, feed: MarkerFeed) -> None:
    for marker in feed.look():
        streams.send(marker)
