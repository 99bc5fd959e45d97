"""What a gun's hardware would do: it takes drive events, knows the physics, and keeps a ledger of what was rendered."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from device.methods import Method, rendering_of
from device.twin.machine import Drive
from device.wire.records import ShotRecord
from device.words import Effect, LimitError, Pulse


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendered:
    """One shot as it was, on the twin's own clock of the world in seconds; `end_s` is None while it lasts.

    `too_soon`: it began before the magnet was home, by the physics. `home_s` is None where the model knows no return.
    """

    mark: int
    method: str
    way: str
    kind: str
    amount: int
    start_s: float
    end_s: float | None
    home_s: float | None
    too_soon: bool


class Body:
    """The magnet and the vibrator of one gun, which a reset of its firmware does not stop."""

    def __init__(self, methods: Mapping[str, Method]) -> None:
        self._methods = dict(methods)
        self.ledger: list[Rendered] = []
        for method in methods.values():  # the first use takes long, and a gun has no time
            with suppress(LimitError):
                rendering_of(method)

    def drive(self, event: Drive, shot: ShotRecord, time_s: float) -> None:
        """The board was told to drive, or to stop."""
        if event.kind == "OFF":
            self.stop(time_s)
            return
        before = self.ledger[-1].home_s if self.ledger else None
        settle_s = self._settle_s(shot)
        self.ledger.append(
            Rendered(
                mark=shot.mark,
                method=shot.setting.method,
                way=shot.setting.way,
                kind=event.kind,
                amount=event.amount,
                start_s=time_s,
                end_s=None,
                home_s=None if settle_s is None else time_s + settle_s,
                too_soon=before is not None and time_s < before - 1e-6,
            )
        )

    def stop(self, time_s: float) -> None:
        """Nothing drives any more."""
        if self.ledger and self.ledger[-1].end_s is None:
            self.ledger[-1] = replace(self.ledger[-1], end_s=time_s)

    def _settle_s(self, shot: ShotRecord) -> float | None:
        setting = shot.setting
        method = self._methods.get(setting.method)
        if method is None:
            return None
        length_s = setting.length_us / 1e6
        pulse = setting.kind == "PULS"
        drive = Pulse(voltage_V=setting.amount / 1000, pulse_s=length_s) if pulse else Effect(effect=setting.amount)
        try:
            return rendering_of(method, drive).settle_s
        except LimitError:  # by the model it stays out; the next shot is not judged
            return None
