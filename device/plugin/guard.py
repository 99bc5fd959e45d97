"""The guard before a gun that is not ours: the limits and the latch are here, whatever the plug-in says or does.

A command that breaks a limit, or comes while the gun is disarmed, never reaches the plug-in. What the plug-in answers
is believed only if it fits the command and the clock, and each of its calls has a deadline.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar

from device.interrupts import AWAKE_S, answer_within, interrupts_held, wait_awake
from device.limits import DriveHistory, planned_start_s
from device.messages import error_line, said_by
from device.methods import Method, rendering_of
from device.plugin.reports import HANDED_OVER_S, PluginOrder, broken_rule, broken_status, is_line, plain_report
from device.words import DeviceError, Gun, GunStatus, Identity, LimitError, LinkError, Shot, ShotReport, judged

ANSWER_S, DISARM_S = 5.0, 2.0
"""So long a plug-in may take for anything but a shot's own time, and to disarm; a busy machine stands still for some
of it. Assumed."""

_Answer = TypeVar("_Answer")


class PluginError(LinkError):
    """A plug-in that is refused, that broke off, or says what cannot be."""


class GunLeftOpen(PluginError):  # noqa: N818 - what is so
    """A plug-in's gun that was not disarmed and let go of: it may be armed. Its text says to switch off its power."""


class PluginSilent(PluginError):  # noqa: N818 - what is so
    """A plug-in that did not answer in time, and is asked for nothing more but to disarm."""


class GuardedGun:
    """A plug-in's `Gun` behind the guard; `name` is what `--gun` calls it.

    Commands may come from any thread. `disarm` overtakes: nothing that was asked for before it arms or fires after it.
    """

    def __init__(self, name: str, gun: Gun, methods: Mapping[str, Method], clock: Callable[[], float]) -> None:
        self.name = name
        self._gun, self._methods, self._clock = gun, MappingProxyType(dict(methods)), clock
        self._turn = threading.Lock()  # of arm and fire
        self._told = threading.Condition()  # guards the four below
        self._armed = self._closed = False
        self._disarms = 0
        self._silent = ""  # the call that it never answered
        self._disarm_s = DISARM_S
        self._gone = Future[None]()  # what became of its closing
        self._history = DriveHistory()
        try:
            self._check_disarmed("when it is opened; a gun is born disarmed")
        except BaseException as why:  # an interrupt too
            self._refuse(why)
            raise

    def identify(self) -> Identity:
        """Who answers. `LinkError` after `close`."""
        self._is_open()
        return self._identity(self._ask("identify", self._gun.identify))

    def arm(self) -> None:
        """Allow the next shots. `LinkError`: it does not answer, or was disarmed meanwhile."""
        with self._told:
            disarms = self._disarms
        self._is_open()
        with self._turn:
            self._ask("arm", self._gun.arm)
            with self._told:
                self._armed = self._disarms == disarms and not self._closed
            if not self._armed:
                self._disarm_it()
                raise PluginError(f"gun plug-in {self.name} was disarmed while it was to be armed")

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once, now or at a time on the host's clock, at most 2 s ahead.

        `LimitError`: refused by the guard, of which the plug-in hears nothing, or by the plug-in. `LinkError`: the
        outcome is unknown, or what the plug-in says of it cannot be; the gun is then disarmed.
        """
        with self._told:
            disarms = self._disarms
        self._is_open()
        with self._turn:
            self._is_armed(disarms)
            order = self._order(shot, at_s)
            self._wait_for(order, disarms)
            return self._fire(order, at_s)

    def disarm(self) -> None:
        """Forbid shots, from every state and thread. `LinkError`: the plug-in does not do it; the guard fires none."""
        with self._told:
            self._armed = False
            self._disarms += 1
            self._told.notify_all()
        self._disarm_it()
        if not self._turn.locked():  # else an arming or a shot is under way, whose end is disarmed as well
            self._check_disarmed("after it was disarmed; switch off its power")

    def status(self) -> GunStatus:
        """The gun at this moment, never readier or cooler than by the guard's own count.

        `LinkError`: it does not answer, or was closed and may be armed still.
        """
        if self._closed:
            self._check_gone()
            return self._status(GunStatus(state="disarmed", shots=0, coil_temperature_C=0.0, ready_at_s=0.0))
        found = self._status(self._checked_status())
        if found.state in {"armed", "resetting"} and not self._armed:
            return replace(found, state="fault", fault="it says that it is armed, and it was not told so")
        return found

    def close(self) -> None:
        """Disarm, and let go of the gun: at once, whatever another thread asks of it."""
        with interrupts_held():
            with self._told:
                again, self._closed = self._closed, True
            if again:
                self._check_gone()
                return
            try:
                self._let_go()
            except BaseException as error:
                self._gone.set_exception(error)
                raise
            self._gone.set_result(None)

    def _let_go(self) -> None:
        try:
            self.disarm()
        finally:
            self._ask("close", self._gun.close)

    def _check_gone(self) -> None:
        """What became of a closing, which may be under way."""
        wait_awake(self._gone, DISARM_S)
        if not self._gone.done():
            raise PluginError(f"gun plug-in {self.name} was not disarmed and closed within {DISARM_S:g} s")
        error = self._gone.exception()
        if error:
            raise PluginError(f"{error_line(error) or said_by(error)}; it was not disarmed and closed") from error

    # what is asked of the plug-in

    def _ask(self, what: str, act: Callable[[], _Answer], seconds: float = ANSWER_S) -> _Answer:
        """One call, with its deadline. `PluginError`: it broke off or is silent; then it is asked no more."""
        if self._silent and what != "disarm":
            raise PluginSilent(f"gun plug-in {self.name} never answered {self._silent}; switch off the gun, start anew")
        try:
            return answer_within(seconds, act)
        except LimitError as error:
            raise LimitError(f"gun plug-in {self.name}: {error_line(error)}") from error
        except LinkError as error:
            raise PluginError(f"gun plug-in {self.name}: {error_line(error)}") from error
        except TimeoutError as error:
            self._silent = self._silent or what
            raise PluginSilent(f"gun plug-in {self.name}: {what}: {error}") from error
        except Exception as error:
            raise PluginError(f"gun plug-in {self.name} broke off in {what}: {said_by(error)}") from error

    def _read(self, look: Callable[[], _Answer]) -> _Answer:
        """What is to be made of an object of the plug-in's, whose own code may break off."""
        try:
            return look()
        except DeviceError:
            raise
        except Exception as error:
            raise PluginError(f"gun plug-in {self.name} says what cannot be read ({said_by(error)})") from error

    def _disarm_it(self) -> None:
        """Have it disarm; one that did not answer is told again, and not waited for so long again."""
        try:
            self._ask("disarm", self._gun.disarm, self._disarm_s)
        except PluginSilent:
            self._disarm_s = AWAKE_S
            raise

    def _refuse(self, why: BaseException) -> None:
        """Let go of a gun that is not taken. `GunLeftOpen`: it may be armed still."""
        try:
            self.close()
        except LinkError as error:
            said = error_line(why) if isinstance(why, LinkError) else f"gun plug-in {self.name}: interrupted"
            raise GunLeftOpen(f"{said}; it was not let go of ({error_line(error)}): switch off its power") from why

    def _checked_status(self) -> GunStatus:
        """What the plug-in says of itself, if it can be."""
        said = self._ask("status", self._gun.status)
        broken = self._read(lambda: broken_status(said, self._clock()))
        if broken:
            raise PluginError(f"gun plug-in {self.name} gives as its status {broken}")
        return said

    def _check_disarmed(self, when: str) -> None:
        state = self._checked_status().state
        if state in {"armed", "resetting"} and not self._armed:
            raise PluginError(f"gun plug-in {self.name} says that it is {state} {when}")

    def _identity(self, said: object) -> Identity:
        if isinstance(said, Identity) and all(map(is_line, (said.model, said.version, said.serial))):
            return said
        shown = self._read(lambda: repr(said))
        raise PluginError(f"gun plug-in {self.name} identifies as {shown}; it must be an Identity of lines of text")

    # a shot

    def _order(self, shot: Shot, at_s: float | None) -> PluginOrder:
        """The shot as it may be handed over. `LimitError` as every gun's."""
        shot = judged(shot)
        if shot.method not in self._methods:
            raise LimitError(f"method is {shot.method!r}; this gun renders {', '.join(self._methods)}")
        rendering = rendering_of(self._methods[shot.method], shot.drive)
        now_s = self._clock()
        start_s = planned_start_s(now_s, at_s)
        self._history.check(rendering.load, start_s)
        return PluginOrder(shot=shot, requested_s=now_s, start_s=start_s, rendering=rendering)

    def _wait_for(self, order: PluginOrder, disarms: int) -> None:
        """Until the shot is to be handed over. `LimitError`: disarmed meanwhile."""
        with self._told:
            wait_s = order.start_s - order.requested_s - HANDED_OVER_S
            self._told.wait_for(lambda: not self._armed or self._disarms != disarms, max(0.0, wait_s))
        self._is_armed(disarms)

    def _fire(self, order: PluginOrder, at_s: float | None) -> ShotReport:
        """Hand it over. Whatever becomes of it, but a refusal, is taken for a shot."""
        seconds = max(0.0, order.start_s - self._clock()) + order.longest_s + ANSWER_S
        try:
            report = self._ask("fire", lambda: self._gun.fire(order.shot, at_s), seconds)
            report = self._read(lambda: self._believed(order, report))
        except LimitError:
            raise
        except BaseException:  # an interrupt too
            self._spend(order, self._clock())
            self.disarm()
            raise
        self._spend(order, report.pulse_start_s)
        home_s = max(report.home_predicted_s, report.pulse_start_s + order.rendering.settle_s)
        return replace(report, requested_s=order.requested_s, home_predicted_s=home_s)

    def _believed(self, order: PluginOrder, report: object) -> ShotReport:
        broken = broken_rule(order, report, self._clock())
        if broken or not isinstance(report, ShotReport):
            raise PluginError(f"gun plug-in {self.name}: {broken}; the shot does not count")
        return plain_report(report)

    def _spend(self, order: PluginOrder, start_s: float) -> None:
        load = order.rendering.load
        start_s = max(start_s, order.start_s, self._history.earliest_s(load))
        self._history = self._history.record(load, start_s, start_s + order.rendering.settle_s)

    def _status(self, said: GunStatus) -> GunStatus:
        return replace(
            said,
            coil_temperature_C=max(said.coil_temperature_C, self._history.coil_celsius(self._clock())),
            ready_at_s=max(said.ready_at_s, self._history.ready_s),
        )

    def _is_open(self) -> None:
        if self._closed:
            raise PluginError(f"gun plug-in {self.name} is closed; open it again")

    def _is_armed(self, disarms: int) -> None:
        with self._told:
            if not self._armed or self._disarms != disarms:
                raise LimitError("the gun is disarmed; arm it before it may fire")
