"""A liar between a gun and its host: it rewrites what the twin says, well framed and with the right checksum."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

from device.methods import paper_methods
from device.serial_gun.gun import open_serial
from device.twin.sockets import Pty
from device.twin.twin import Make, Twin
from device.wire.records import Frame, Garbled, Setting, ShotRecord, Splitter, decode, encode
from device.words import ShotTiming
from tests.twins import PATIENT_S, Pair, host_clock, plugged_in

HUGE_US = 9_000_000_000_000_000
"""285 years; the most that the wire can say has one digit more."""

Forgery = Callable[[ShotRecord, int], ShotRecord]


def moved(record: ShotRecord, by_us: int) -> ShotRecord:
    by_us = max(by_us, -record.accepted_us)  # the wire knows no times before the boot
    return replace(
        record,
        accepted_us=record.accepted_us + by_us,
        start_us=record.start_us + by_us,
        end_us=record.end_us + by_us,
        home_predicted_us=record.home_predicted_us + by_us,
    )


def turned(setting: Setting) -> Setting:
    return replace(setting, way="BACK" if setting.way == "FORW" else "FORW")


FORGERIES: dict[str, tuple[Forgery, str]] = {
    "long ago": (lambda shot, far_us: moved(shot, -far_us), "earlier than its trigger was written"),
    "still to come": (moved, "later than its record was read"),
    "in 285 years": (lambda shot, _: moved(shot, HUGE_US), "its times are known to .* s only"),
    "begun before it was accepted": (
        lambda shot, far_us: replace(moved(shot, -far_us), accepted_us=shot.accepted_us),
        r"START is \d+; it must be \d+, the later of its tick",
    ),
    "accepted after its end": (lambda shot, _: replace(shot, accepted_us=shot.end_us + 1), "START is .* the later of"),
    "begun a tick late": (
        lambda shot, _: replace(moved(shot, 1), accepted_us=shot.accepted_us),
        "START is .* the later of",
    ),
    "over a tick early": (lambda shot, _: replace(shot, end_us=shot.end_us - 1), "driven for .* it must be DONE"),
    "over before it began": (lambda shot, _: replace(shot, end_us=shot.start_us - 1), "END is .*, before START"),
    "driven for long": (lambda shot, far_us: replace(shot, end_us=shot.end_us + far_us), "driven for .* it must be"),
    "never counted": (lambda shot, _: replace(shot, count=shot.count - 1), r"COUNT is \d+; it must be \d+"),
    "counted twice": (lambda shot, _: replace(shot, count=shot.count + 1), r"COUNT is \d+; it must be \d+"),
    "another shot": (lambda shot, _: replace(shot, mark=shot.mark + 1), "asked for .* the gun rendered"),
    "the other way": (lambda shot, _: replace(shot, setting=turned(shot.setting)), "asked for .* the gun rendered"),
    "still being driven": (lambda shot, _: replace(shot, ending="DRIV"), "DRIV, driven for .* it must be DONE"),
}
"""What is made of a record, by a time that is far for the clocks; and what the host must say of it."""


class Forger(Pty):
    """The gun's end of the line. `lie` makes of each answer what the host is to hear, None for nothing; what `swallow`
    is true for never reaches the gun.
    """

    def __init__(self, link: Path) -> None:
        super().__init__(link)
        self.lie: Callable[[str], str | None] = lambda body: body
        self.swallow: Callable[[str], bool] = lambda _: False
        self._lines, self._orders = Splitter(), Splitter()

    def read(self, timeout_s: float) -> bytes:
        lines = self._orders.feed(super().read(timeout_s))
        return b"".join(line + b"\n" for line in lines if line is not None and not self._swallowed(line))

    def _swallowed(self, line: bytes) -> bool:
        try:
            return self.swallow(decode(line, "host").body)
        except Garbled:
            return False

    def write(self, data: bytes) -> None:
        for line in self._lines.feed(data):
            if line is not None:
                super().write(self._said(line))

    def _said(self, line: bytes) -> bytes:
        try:
            frame = decode(line, "gun")
        except Garbled:
            return line + b"\n"
        body = self.lie(frame.body)
        return b"" if body is None else encode(Frame(number=frame.number, body=body), "gun")


class ShotLiar:
    """Makes of a share of the records of shots that were done what each forgery makes of them, in turn.

    `told` keeps the name of each lie, `spoiled` the shots that were lied about, as they were and as it was told.
    """

    def __init__(self, share: float, far_us: int, seed: int = 1, kinds: tuple[str, ...] = tuple(FORGERIES)) -> None:
        self.told: list[str] = []
        self.spoiled: set[tuple[int, ...]] = set()
        self._share, self._far_us, self._draw, self._kinds = share, far_us, Random(seed), kinds

    def __call__(self, body: str) -> str:
        if not body.startswith("SHOT ") or ",DONE," not in body or self._draw.random() >= self._share:
            return body
        kind = self._kinds[len(self.told) % len(self._kinds)]
        self.told.append(kind)
        true = ShotRecord.parse(body)
        forged = FORGERIES[kind][0](true, self._far_us)
        self.spoiled |= {(one.count, one.accepted_us, one.start_us, one.end_us) for one in (true, forged)}
        return forged.text()

    def accepted(self, timings: Iterable[ShotTiming]) -> int:
        """How many of these shots were lied about."""
        told = ((one.gun_count, one.gun_accepted_us, one.gun_start_us, one.gun_end_us) for one in timings)
        return len(self.spoiled.intersection(told))


@contextmanager
def a_lying_twin(
    folder: Path, *, speed: float = 20.0, watchdog_s: float = PATIENT_S, **make: Any
) -> Iterator[tuple[Twin, Forger]]:
    forger = Forger(folder / "gun")
    with plugged_in(forger, Make(speed=speed, **make), watchdog_s) as twin:
        yield twin, forger


@contextmanager
def a_lying_pair(folder: Path, *, speed: float = 20.0, **make: Any) -> Iterator[tuple[Pair, Forger]]:
    with a_lying_twin(folder, speed=speed, **make) as (twin, forger):
        gun = open_serial(f"serial:{forger.address}?speed={speed:g}", paper_methods(), host_clock(speed))
        try:
            yield Pair(twin=twin, gun=gun, socket=forger, speed=speed), forger
        finally:
            gun.close()
