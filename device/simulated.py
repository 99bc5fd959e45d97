"""The simulated gun: the same words as a real one, answered by the model. It never waits."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from device.limits import DriveHistory, planned_start_s
from device.methods import Method, Rendering, rendering_of
from device.words import Drive, GunState, GunStatus, Identity, LimitError, LinkError, Shot, ShotReport, judged

MODEL_VERSION = "1"
"""Counts up whenever the same shot would be predicted otherwise."""


class SimulatedGun:
    """A `Gun` that renders by the model. It is born disarmed; `clock` gives seconds and never runs back."""

    def __init__(self, methods: Mapping[str, Method], clock: Callable[[], float]) -> None:
        self._methods = dict(methods)
        self._rendered: dict[tuple[str, Drive], Rendering] = {}
        self._clock = clock
        self._history = DriveHistory()
        self._born_s = clock()
        self._shots = 0
        self._armed = False
        self._closed = False

    def identify(self) -> Identity:
        """The simulated gun and the version of its model. `LinkError` after `close`."""
        self._is_open()
        return Identity(model="simulated", version=MODEL_VERSION, serial="simulated")

    def arm(self) -> None:
        """Allow the next shots. `LinkError` after `close`."""
        self._is_open()
        self._armed = True

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once, now or at a time that comes, and report at once, the return of the magnet included.

        `LimitError`: disarmed, no such method, a drive of another kind, or beyond a limit; nothing was rendered.
        `LinkError` after `close`.
        """
        self._is_open()
        if not self._armed:
            raise LimitError("the gun is disarmed; arm it before it may fire")
        shot = judged(shot)
        rendering = self._render(shot)
        now_s = self._clock()
        onset_s = planned_start_s(now_s, at_s)
        self._history = self._history.record(rendering.load, onset_s, onset_s + rendering.settle_s)
        self._shots += 1
        return ShotReport(
            shot=shot,
            requested_s=now_s,
            pulse_start_s=onset_s,
            pulse_end_s=onset_s + (rendering.load.on_s or rendering.settle_s),
            home_predicted_s=onset_s + rendering.settle_s,
            motion=rendering.motion,
        )

    def disarm(self) -> None:
        """Forbid shots, from every state."""
        self._armed = False

    def status(self) -> GunStatus:
        """The gun at this moment; `resetting` while an armed gun's magnet is on its way home."""
        now_s = self._clock()
        return GunStatus(
            state=self._state(now_s),
            shots=self._shots,
            coil_temperature_C=self._history.coil_celsius(now_s),
            ready_at_s=max(self._history.ready_s, self._born_s),
        )

    def close(self) -> None:
        """Disarm, and answer no more than `status`, `disarm` and `close`."""
        self.disarm()
        self._closed = True

    def _state(self, now_s: float) -> GunState:
        if not self._armed:
            return "disarmed"
        return "armed" if self._history.is_ready(now_s) else "resetting"

    def _render(self, shot: Shot) -> Rendering:
        """What the model says of a shot: the same for every shot of a method and drive."""
        if shot.method not in self._methods:
            raise LimitError(f"method is {shot.method!r}; this gun renders {', '.join(self._methods)}")
        kind = (shot.method, shot.drive)
        if kind not in self._rendered:
            self._rendered[kind] = rendering_of(self._methods[shot.method], shot.drive)
        return self._rendered[kind]

    def _is_open(self) -> None:
        if self._closed:
            raise LinkError("the gun is closed; open it again")
