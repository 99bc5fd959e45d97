"""What every gun keeps, as checks that any gun can be put through: ours, and those of plug-ins by their own tests.

    def test_it_is_a_gun():
        assert broken(conformance(rig_at("sound-card:null"))) == []

The checks fire shots: nobody is to hold the gun. `recoil doctor --gun ADDRESS --fire TRIALS` does the same.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import cycle, islice

from device import open_gun
from device.interrupts import answer_within, interrupts_held, start_aside
from device.machine_clock import machine_s
from device.messages import said_by
from device.methods import Method, drive_of, paper_methods
from device.plugin.guard import GunLeftOpen, PluginSilent
from device.plugin.reports import CLOCK_SLACK_S, LENGTH_SLACK_PART, LENGTH_SLACK_S
from device.serial_gun.gun import speed_of
from device.words import DIRECTIONS, DeviceError, Effect, Gun, GunStatus, LimitError, LinkError, Pulse, Shot, ShotReport

FEW_TRIALS = 20
EVERY_S = 0.205
"""From shot to shot at least, so that 300 a minute are never reached."""
SOON_S, AHEAD_S = 0.045, 1.5
"""So long ahead is every third shot of the trials asked for, and the one that is called off."""
MAX_FAILED = 0.05
"""Of the trials: a gun may fail, and say so; one that fails more often is of no use. Assumed."""
RECOVERED_S = 30.0


class RuleBroken(Exception):  # noqa: N818 - a finding
    """A rule that a gun does not keep."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConformanceRig:
    """A gun to be tried: how it is opened, on which clock, and how so many seconds of that clock are waited for.

    `break_it` makes the open gun fail, as a plug that is pulled does; without it that is not tried.
    """

    open_gun: Callable[[], Gun]
    clock: Callable[[], float]
    wait: Callable[[float], None]
    methods: Mapping[str, Method]
    trials: int = FEW_TRIALS
    speed: float = 1.0
    break_it: Callable[[], None] | None = None

    @property
    def slack_s(self) -> float:
        """So much times may lie outside of what the clock allows."""
        return CLOCK_SLACK_S * self.speed


@dataclass(frozen=True, slots=True, kw_only=True)
class ConformanceFinding:
    """What one check found: whether its rules were kept, and what was seen or which rule was broken."""

    check: str
    kept: bool
    said: str


class StillClock:
    """A clock that moves only when it is waited for: the simulated gun's."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def __call__(self) -> float:
        """The time in seconds."""
        return self._now_s

    def wait(self, seconds: float) -> None:
        """Move on at once."""
        self._now_s += max(0.0, seconds)


def rig_at(
    address: str,
    methods: Mapping[str, Method] | None = None,
    trials: int = FEW_TRIALS,
    break_it: Callable[[], None] | None = None,
    speed: float | None = None,
) -> ConformanceRig:
    """The gun at an address, as `--gun` has it. `ValueError`: no such form of address.

    `speed`: the clock of a gun that is none, such as `sound-card:null`, may go so many times faster than the world.
    """
    methods, speed = methods or paper_methods(), speed or speed_of(address)
    clock: Callable[[], float] = StillClock()
    wait = clock.wait if isinstance(clock, StillClock) else time.sleep
    if speed is not None:
        clock, wait = (lambda: machine_s() * speed), (lambda seconds: time.sleep(max(0.0, seconds) / speed))
    return ConformanceRig(
        open_gun=lambda: open_gun(address, methods, clock=clock),
        clock=clock,
        wait=wait,
        methods=methods,
        trials=trials,
        speed=speed or 1.0,
        break_it=break_it,
    )


class OpenedGuns:
    """The guns that are opened one after another: broken off from another thread, none stays armed."""

    def __init__(self, open_gun: Callable[[], Gun]) -> None:
        self._open_gun = open_gun
        self._guns: list[Gun] = []
        self._over = self._opening = False
        self._failed = ""

    @property
    def problem(self) -> str:
        """Why a gun may be armed still; empty if none is."""
        return "it was being opened: switch off its power" if self._opening else self._failed

    def open(self) -> Gun:
        """The next gun. `LinkError`: it is over."""
        self._opening = not self._over
        try:
            if self._opening:
                gun = self._open_gun()
                self._guns.append(gun)  # first: then it is closed here or where it is let go of
                if not self._over:
                    return gun
                self._close(gun)
        except DeviceError as error:
            if self._over or isinstance(error, GunLeftOpen):  # after the end nobody else hears of it
                self._failed = self._failed or str(error)
            raise
        finally:
            self._opening = False
        raise LinkError("the tries were broken off")

    def let_go(self) -> None:
        """Disarm and close what is open; none is opened any more."""
        with interrupts_held():
            self._over = True
            for gun in self._guns:
                self._close(gun)

    def _close(self, gun: Gun) -> None:
        try:
            gun.close()
        except DeviceError as error:
            self._failed = f"{error}: switch off its power"


def _untold(_: ConformanceFinding) -> None:
    """Nobody waits."""


def conformance(
    rig: ConformanceRig, tell: Callable[[ConformanceFinding], None] = _untold
) -> tuple[ConformanceFinding, ...]:
    """Every check on a gun that is opened anew for each, and closed; a check that is broken off is one not kept.

    Of a gun that does not open that alone is said. `tell` is called with each finding.
    """
    try:
        rig.open_gun().close()
    except DeviceError as error:
        tell(finding := ConformanceFinding(check="opening", kept=False, said=str(error)))
        return (finding,)
    found = list[ConformanceFinding]()
    for name, check in GUN_CHECKS.items():
        found.append(_found(name, check, rig))
        tell(found[-1])
    return tuple(found)


def broken(findings: Iterable[ConformanceFinding]) -> list[str]:
    """The findings that are none to be glad of, as text."""
    return [f"{one.check}: {one.said}" for one in findings if not one.kept]


KitCheck = Callable[[ConformanceRig, Gun], str]


def _found(name: str, check: KitCheck, rig: ConformanceRig) -> ConformanceFinding:
    try:
        gun = rig.open_gun()
        try:
            return ConformanceFinding(check=name, kept=True, said=check(rig, gun))
        finally:
            with suppress(DeviceError):  # one that was broken on purpose may say so again
                gun.close()
    except RuleBroken as error:
        return ConformanceFinding(check=name, kept=False, said=str(error))
    except Exception as error:  # noqa: BLE001 - whatever a gun raises that no gun may
        return ConformanceFinding(check=name, kept=False, said=f"broke off: {said_by(error)}")


def _expect(kept: bool, rule: str) -> None:
    if not kept:
        raise RuleBroken(rule)


def _birth(rig: ConformanceRig, gun: Gun) -> str:
    """Born disarmed, with a name, and firing nothing."""
    who, status = gun.identify(), gun.status()
    _expect(status.state == "disarmed", f"it is {status.state} when it is opened; a gun is born disarmed")
    _refuses(gun, next(_shots(rig)), "a shot before it was armed")
    _expect(gun.status().shots == status.shots, "a shot that was refused is counted")
    return f"{who.model} {who.version}, serial {who.serial}"


def _limits(rig: ConformanceRig, gun: Gun) -> str:
    """What is beyond a limit is refused with `LimitError`, and nothing is fired."""
    shot = next((one for one in islice(_shots(rig), 2 * len(rig.methods)) if isinstance(one.drive, Pulse)), None)
    if shot is None:
        return "not tried: the gun has no method that is driven by a pulse"
    _ready(rig, gun)
    before = gun.status().shots
    for forged, name in ((30.0, "30 V"), (math.nan, "NaN V")):
        _refuses(gun, _forged(shot, forged), f"a shot forged to {name}")
    _refuses(gun, Shot(method="no-such-method", direction="forward", drive=shot.drive), "a method that it has not")
    _refuses(gun, Shot(method=shot.method, direction="forward", drive=Effect(effect=1)), "a drive of another kind")
    for at_s, name in ((math.nan, "NaN"), (math.inf, "no end"), (rig.clock() + 1e6, "11 days ahead")):
        _refuses(gun, shot, f"a shot at {name}", at_s)
    _expect(gun.status().shots == before, "a shot that was refused is counted")
    fired = 1 + _fired_again(gun, gun.fire(shot), rig)
    _expect(gun.status().shots == before + fired, "a shot that was refused is counted, or one that was fired is not")
    return "30 V and NaN by force, other methods and drives, times that are none, too soon: all refused"


def _fired_again(gun: Gun, before: ShotReport, rig: ConformanceRig) -> bool:
    """Whether a second shot at once was fired; it may be, if the first took so long that the magnet is home again."""
    try:
        again = gun.fire(before.shot)
    except LimitError:
        return False
    too_soon_s = before.home_predicted_s - again.pulse_start_s - _slack_s(rig, again)
    _expect(too_soon_s <= 0, f"it fired {too_soon_s:.6f} s before the magnet was home; a LimitError must refuse that")
    return True


def _trials(rig: ConformanceRig, gun: Gun) -> str:
    """Shots as a run fires them: each armed for itself, each reported as it was, none too soon, each counted."""
    failed, last, before = list[str](), None, gun.status().shots
    for number, shot in enumerate(islice(_shots(rig), rig.trials)):
        least = 1
        try:
            last = _trial(rig, gun, shot, last, ahead=number % 3 == 2)
            gun.disarm()
            status = gun.status()
        except LinkError as error:
            failed.append(str(error))
            least, status = 0, _recovered(gun)
        _expect(status.state == "disarmed", f"it is {status.state} after it was disarmed")
        went_back = f"its count of shots went from {before} back to {status.shots}, as after a reset"
        _expect(status.shots >= before, went_back)
        fired, before = status.shots - before, status.shots
        _expect(least <= fired <= 1, f"{fired} shots are counted for one that was ordered")
    allowed = max(1, MAX_FAILED * rig.trials)
    _expect(len(failed) <= allowed, f"{len(failed)} of {rig.trials} trials failed, the first: {''.join(failed[:1])}")
    return f"{rig.trials} trials, {len(failed)} failed and said so"


def _recovered(gun: Gun) -> GunStatus:
    """How a gun stands that failed in a trial: as a run does, it is disarmed and asked until it answers again."""
    end_s = machine_s() + RECOVERED_S
    while True:
        try:
            gun.disarm()
            return gun.status()
        except PluginSilent:
            raise
        except LinkError as error:
            _expect(machine_s() < end_s, f"after a failure it does not answer for {RECOVERED_S:g} s: {error}")
            time.sleep(0.1)


def _trial(rig: ConformanceRig, gun: Gun, shot: Shot, last: ShotReport | None, *, ahead: bool) -> ShotReport:
    if last is not None:
        rig.wait(last.pulse_start_s + EVERY_S - rig.clock())
    _ready(rig, gun)
    asked_s = rig.clock()
    at_s = asked_s + SOON_S if ahead else None
    report = gun.fire(shot, at_s)
    _judge(rig, report, shot, (asked_s if at_s is None else at_s, rig.clock()))
    if last is not None:
        too_soon_s = last.home_predicted_s - report.pulse_start_s - _slack_s(rig, report)
        _expect(too_soon_s <= 0, f"a shot began {too_soon_s:.6f} s before the magnet was home")
    return report


def _judge(rig: ConformanceRig, report: ShotReport, shot: Shot, asked: tuple[float, float]) -> None:
    slack_s, (due_s, told_s) = _slack_s(rig, report), asked
    _expect(report.shot == shot, f"it reports {report.shot}; ordered was {shot}")
    _expect(
        due_s - slack_s <= report.pulse_start_s <= max(due_s, told_s) + slack_s,
        f"it reports an onset at {report.pulse_start_s:.6f} s of a shot due at {due_s:.6f} s, told at {told_s:.6f} s",
    )
    length_s = report.pulse_end_s - report.pulse_start_s
    if isinstance(shot.drive, Pulse):
        allowed_s = max(LENGTH_SLACK_S, LENGTH_SLACK_PART * shot.drive.pulse_s) + slack_s
        _expect(
            abs(length_s - shot.drive.pulse_s) <= allowed_s,
            f"a pulse of {shot.drive.pulse_s} s lasted {length_s:.6f} s",
        )
    _expect(
        0 <= length_s <= report.home_predicted_s - report.pulse_start_s + slack_s, "it is home before its drive ends"
    )


def _latch(rig: ConformanceRig, gun: Gun) -> str:
    """Disarmed from another thread, a gun calls off the shot that waits, and fires none until it is armed again."""
    shot = next(_shots(rig))
    _ready(rig, gun)
    before = gun.status().shots
    waited = _called_off(rig, gun, shot)
    rig.wait(AHEAD_S)
    for _ in range(20):
        _refuses(gun, shot, "a shot after it was disarmed")
    fired, state = gun.status().shots - before, gun.status().state
    _expect(fired == (0 if waited else 1), f"{fired} shots are counted after the one that waited was called off")
    _expect(state == "disarmed", f"it is {state} after it was disarmed")
    gun.disarm()
    _ready(rig, gun)
    gun.fire(shot)
    return "a waiting shot was called off; " * waited + "20 shots after the disarming refused; armed again it fires"


def _called_off(rig: ConformanceRig, gun: Gun, shot: Shot) -> bool:
    """Whether a shot waited for its time until it was called off; false if it was fired before it could be."""
    ended, outcome = threading.Event(), list[ShotReport | DeviceError]()

    def fire() -> None:
        try:
            outcome.append(gun.fire(shot, rig.clock() + AHEAD_S))
        except DeviceError as error:
            outcome.append(error)
        finally:
            ended.set()

    start_aside(fire, "waiting shot")
    over = ended.wait(AHEAD_S / 3 / rig.speed)
    disarmed_s = rig.clock()
    gun.disarm()
    _expect(ended.wait(RECOVERED_S) and bool(outcome), "a shot that waits neither ends nor is called off")
    (end,) = outcome
    if isinstance(end, DeviceError):
        return True
    _expect(over or end.pulse_start_s <= disarmed_s + rig.slack_s, "a shot that waited was fired after the disarming")
    return False


def _faults(rig: ConformanceRig, gun: Gun) -> str:
    """A gun that fails says so with a `DeviceError`, soon, and counts nothing as fired."""
    if rig.break_it is None:
        return "not tried: no way to break it was given"
    shot = next(_shots(rig))
    _ready(rig, gun)
    rig.break_it()
    try:
        report = answer_within(RECOVERED_S, lambda: gun.fire(shot))
    except DeviceError as error:
        said = str(error)
    else:
        raise RuleBroken(f"broken, it reports a shot at {report.pulse_start_s:.6f} s")
    with suppress(DeviceError):
        answer_within(RECOVERED_S, gun.disarm)
    return said


def _end(rig: ConformanceRig, gun: Gun) -> str:
    """Closed, a gun answers no command, and can be closed again."""
    shot = next(_shots(rig))
    _ready(rig, gun)
    gun.close()
    commands: tuple[tuple[str, Callable[[], object]], ...] = (
        ("identify", gun.identify),
        ("arm", gun.arm),
        ("fire", lambda: gun.fire(shot)),
    )
    for name, command in commands:
        try:
            command()
        except LinkError:
            continue
        raise RuleBroken(f"closed, it still takes {name}")
    gun.close()
    return "closed, it takes no command"


GUN_CHECKS: Mapping[str, KitCheck] = {
    "birth": _birth,
    "limits": _limits,
    "trials": _trials,
    "latch": _latch,
    "end": _end,
    "faults": _faults,
}
"""Every check by its name; the last may leave the gun broken."""


def _shots(rig: ConformanceRig) -> cycle[Shot]:
    return cycle(
        Shot(method=name, direction=direction, drive=drive_of(method))
        for name, method in rig.methods.items()
        for direction in DIRECTIONS
    )


def _forged(shot: Shot, voltage_V: float) -> Shot:
    """A shot that no constructor gives: beyond the limits by force."""
    pulse = Pulse(voltage_V=1.0, pulse_s=0.01)
    object.__setattr__(pulse, "voltage_V", voltage_V)
    return Shot(method=shot.method, direction=shot.direction, drive=pulse)


def _ready(rig: ConformanceRig, gun: Gun) -> None:
    """Armed, and the magnet home."""
    gun.arm()
    rig.wait(gun.status().ready_at_s - rig.clock())


def _refuses(gun: Gun, shot: Shot, what: str, at_s: float | None = None) -> None:
    try:
        gun.fire(shot, at_s)
    except LimitError:
        return
    raise RuleBroken(f"it fired {what}; it must be refused with a LimitError")


def _slack_s(rig: ConformanceRig, report: ShotReport) -> float:
    return rig.slack_s + (0.0 if report.timing is None else report.timing.uncertainty_s)
