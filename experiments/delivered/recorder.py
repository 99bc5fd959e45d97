"""A run's shots handed to a sensor, and its word on each put into the journal: beside the run, which waits for nothing.

The gun and the screen are wrapped: the gun's reports tell of shots, the screen's positions when a trial can come again.
A run without a sensor has neither wrapper.
"""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace

import numpy as np

from device import Gun, GunStatus, Shot, ShotReport
from device.methods import Method
from device.parameters import GunParameters
from device.sensor.door import check_address
from device.sensor.expected import NO_COURSE
from device.sensor.link import SensorEnd, SensorLink
from device.sensor.measuring import DeliveredShot, ExpectedShot
from device.sensor.process import ShotReply
from device.sensor.simulated import SimulatedSensor, measures_by_model
from device.sensor.streams import SensorError
from device.words import DeviceError, Identity, Pulse
from experiments.clock import Clock
from experiments.delivered.marks import MethodLevels, ShotParts, ShotVerdict, judged_shot
from experiments.live_run import LiveRun, Screen
from experiments.session import events, judging
from experiments.session.remarks import NOT_DELIVERED, Noted, Remark, ShotMeasured
from experiments.session.states import ARMED, Position, State
from experiments.session.steps import FireShot, Outcome, Present, Repeated, Step

NOTICED_S = 0.25
"""So often it is looked whether the sensor is still heard, and what is to be told of a presentation that is over."""
SETTLED_S = 8.0
"""So long the end of a run waits for what was measured last."""
UNMEASURED_SHOTS = 3
"""So many shots in a row that were not measured are told of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotFired:
    """A shot that the gun reported, and of which presentation it was."""

    step: FireShot | Present
    shot: int
    report: ShotReport


@contextmanager
def open_recorder(
    address: str, gun: str, methods: Mapping[str, Method], clock: Clock, *, again: bool, random: np.random.Generator
) -> Iterator[ShotRecorder]:
    """The recorder of a run. `SensorError`: the sensor is refused, or can measure no such gun on no such clock."""
    simulated = measures_by_model(address)
    if not simulated and clock.name != "real":
        raise _out_of_time(address, clock)
    try:
        end: SensorEnd = SimulatedSensor(address, gun, random) if simulated else SensorLink(address)
    except SensorError as error:
        raise SensorError(f"sensor {error}") from error
    recorder = ShotRecorder(end, methods, beside=clock.name != "virtual", again=again)
    try:
        yield recorder
    finally:
        recorder.settle()
        recorder.close()


def _out_of_time(address: str, clock: Clock) -> SensorError:
    """Why such a sensor measures nothing on such a clock; first, that there is none of that name or path."""
    try:
        check_address(address)
    except (DeviceError, ValueError) as error:
        return SensorError(f"sensor {address}: {error}")
    return SensorError(
        f"--sensor {address}: measures in real time, and this run's clock is {clock.name}; give --sensor simulated, or "
        "--screen terminal or console with a gun that takes its time (with --screen synthetic none passes)"
    )


class ShotRecorder:
    """What a sensor says of a run's shots. `beside`: in a thread of its own; else at once, where no time passes."""

    def __init__(self, end: SensorEnd, methods: Mapping[str, Method], *, beside: bool, again: bool) -> None:
        self._end, self._methods, self._beside, self._again = end, methods, beside, again
        self._live: LiveRun | None = None
        self._trouble: Callable[[str], None] = lambda _: None
        self._fired: queue.SimpleQueue[ShotFired | None] = queue.SimpleQueue()
        self._levels: dict[str, MethodLevels] = {}
        self._step: Step | None = None
        self._shots = 0
        self._ended = self._silent = False
        self._unmeasured = 0
        self._undelivered: list[ShotMeasured] = []
        self._latest: ShotFired | None = None
        self._spoiled: Repeated | None = None
        self._thread = threading.Thread(target=self._work, daemon=True, name="delivered")

    def gun(self, gun: Gun) -> Gun:
        """The gun, whose shots are measured."""
        return MeasuredGun(gun, self)

    def screen(self, screen: Screen) -> Screen:
        """The screen of the run that is measured."""
        return MeasuredScreen(screen, self)

    def begin(self, live: LiveRun, trouble: Callable[[str], None]) -> None:
        """Measure for this run; troubles are told to the experimenter."""
        self._live, self._trouble = live, trouble
        if self._beside:
            self._thread.start()

    def fired(self, report: ShotReport) -> None:
        """Take a shot; those that belong to no trial, such as a test shot, are let go."""
        step = self._live.position.step if self._live is not None else None
        if not isinstance(step, FireShot | Present):
            return
        self._shots = self._shots + 1 if step is self._step else 1
        self._step = step
        shot = ShotFired(step=step, shot=self._shots, report=report)
        if self._beside:
            self._fired.put(shot)
        else:
            self._record(shot)

    def settle(self) -> None:
        """Have everything in the journal that was fired so far, or `SETTLED_S` gone by."""
        if self._thread.is_alive():
            self._fired.put(None)
            self._thread.join(SETTLED_S)
        self._tell_undelivered()
        if self._end.dropped and self._live is not None:
            self._note(_DROPPED.format(self._end.dropped))
        self._live = None

    def close(self) -> None:
        """Let go of the sensor."""
        self._end.close()

    def shown(self) -> None:
        """The run stands somewhere else: what waited for that is done."""
        self.offer_again()
        if not self._beside:
            self._look()

    def offer_again(self) -> None:
        """Ask for a spoiled trial again, if it can be presented now; let it go when it cannot any more."""
        live, wanted = self._live, self._spoiled
        if live is None or wanted is None:
            return
        event, moment = events.Repeat(reason=wanted.reason, trial=wanted.trial, by=wanted.by), live.moment
        if not judging.event_refusal(moment, event, None):
            self._spoiled = None
            live.offer(event)
        elif moment.position.base not in (*ARMED, State.SAVING) and moment.repeatable != wanted.trial:
            self._spoiled = None

    # in the thread beside

    def _work(self) -> None:
        while (shot := self._next()) is not None:
            self._record(shot)
            self._look()

    def _next(self) -> ShotFired | None:
        while True:
            with suppress(queue.Empty):
                return self._fired.get(timeout=NOTICED_S)
            self._look()

    def _look(self) -> None:
        """Tell what there is to tell, once."""
        if self._end.ended and not self._ended:
            self._end_of_sensor(self._end.ended)
        if self._end.silent != self._silent and not self._ended:
            self._silent = self._end.silent
            self._note(_SILENT if self._silent else _HEARD)
        self._tell_if_over()

    def _tell_if_over(self) -> None:
        """Tell of the presentation that was measured last, once its last shot was."""
        live = self._live
        over = live is None or self._latest is None or live.position.step is not self._latest.step
        if over and self._fired.empty():
            self._tell_undelivered()

    def _record(self, shot: ShotFired) -> None:
        live = self._live
        if live is None:
            return
        if self._latest is not None and shot.step is not self._latest.step:
            self._tell_undelivered()
        self._latest, found = shot, self._measured(shot)
        live.remark(found)
        self._count_unmeasured(found)
        if found.mark in NOT_DELIVERED:
            self._undelivered.append(found)
            self._want_again(live, found)
            self._tell_if_over()  # first, as a trial that comes again moves the run on
            self.offer_again()

    def _measured(self, shot: ShotFired) -> ShotMeasured:
        method, step = shot.report.shot.method, shot.step
        blank = ShotMeasured(
            trial=step.trial,
            attempt=step.attempt,
            interval=step.interval if isinstance(step, FireShot) else 0,
            shot=shot.shot,
            method=method,
            sensor=self._end.address,
            pulse_start_s=shot.report.pulse_start_s,
            mark="not-measured",
            because="the sensor had ended",
        )
        if self._ended:
            return blank
        try:
            reply = self._end.ask(shot.report.pulse_start_s, driven(self._methods[method], shot.report.shot))
        except SensorError as error:
            self._end_of_sensor(str(error))
            return blank
        return self._judged(blank, reply)

    def _judged(self, blank: ShotMeasured, reply: ShotReply) -> ShotMeasured:
        """What was seen of a shot, with its mark."""
        seen, expected = reply.seen, reply.expected
        if reply.because or expected is None:
            return replace(blank, because=reply.because)
        blank = replace(
            blank,
            expected_peak_m_s2=round(expected.peak_m_s2, 3),
            expected_friction_N=None if expected.friction_N is None else round(expected.friction_N, 5),
            because="",
            mark="",
        )
        if seen is None:
            return replace(blank, mark="no-peak", because="no peak showed after the pulse")
        found = replace(
            blank,
            onset_s=round(seen.onset_s - blank.pulse_start_s, 7),
            onset_u_s=round(seen.onset_u_s, 7),
            peak_m_s2=round(seen.peak_m_s2, 3),
            peak_u_m_s2=round(seen.peak_u_m_s2, 3),
        )
        levels, verdict = judged_shot(self._levels.get(found.method, MethodLevels()), parts_of(seen, expected))
        self._levels[found.method] = levels
        if seen.friction is not None:
            friction_N, friction_u_N = seen.friction.at_scale(levels.scale, math.sqrt(levels.peak.variance))
            found = replace(found, friction_N=round(friction_N, 5), friction_u_N=round(friction_u_N, 5))
        return replace(found, mark=verdict.mark, because=reason_of(verdict, found))

    def _count_unmeasured(self, found: ShotMeasured) -> None:
        """Tell once of shots that one after another were not measured, though the sensor is heard."""
        heard = not (self._ended or self._silent or self._end.silent or found.because == NO_COURSE)
        self._unmeasured = self._unmeasured + 1 if heard and found.mark == "not-measured" else 0
        if self._unmeasured == UNMEASURED_SHOTS:
            self._note(_UNMEASURED.format(found.because))

    def _want_again(self, live: LiveRun, found: ShotMeasured) -> None:
        """Where the design says so, the trial is to come again, once."""
        before = (word for _, word in live.history if isinstance(word, Repeated) and word.trial == found.trial)
        if self._again and not any(word.by == "sensor" for word in before):
            self._spoiled = Repeated(trial=found.trial, reason=f"not delivered: {found.because}", by="sensor")

    def _tell_undelivered(self) -> None:
        """Tell the experimenter of a presentation's shots that were not delivered, in one line."""
        told, self._undelivered = self._undelivered, []
        if not told or self._latest is None:
            return
        first, fired = told[0], self._latest.shot
        some = "the shot was" if fired == 1 else f"{len(told)} of {fired} shots were"
        self._trouble(
            f"Trial {first.trial.trial}: {some} not delivered as {first.method} should be: {first.because}. "
            "Look at the damper, the coil and the sensor."
        )

    def _end_of_sensor(self, why: str) -> None:
        """Said once; the run goes on without it."""
        self._ended = True
        self._note(f"The sensor ended ({why}). The run goes on; its shots are marked “not-measured”.")

    def _note(self, text: str) -> None:
        """Tell the experimenter, and have it on record."""
        self._trouble(text)
        if self._live is not None:
            self._live.remark(Noted(trial=None, text=text))


_SILENT = "The sensor is silent: no sample comes. The run goes on; its shots are marked “not-measured” until one does."
_HEARD = "The sensor is heard again."
_UNMEASURED = (
    f"The last {UNMEASURED_SHOTS} shots were not measured ({{}}), though the sensor is heard. The run goes on. "
    "Look at the sensor's times: they must go as seconds do."
)
_DROPPED = "Lines of the sensor that were no samples and were left out: {}. Look at its cable."


def parts_of(seen: DeliveredShot, expected: ExpectedShot) -> ShotParts:
    """A shot as parts of what is expected of it."""
    peak = ShotParts(peak=seen.peak_m_s2 / expected.peak_m_s2, peak_u=seen.peak_u_m_s2 / expected.peak_m_s2)
    found, usual_N = seen.friction, expected.friction_N
    if found is None or not usual_N:
        return peak
    return replace(peak, friction=found, usual_N=usual_N)


def reason_of(verdict: ShotVerdict, shot: ShotMeasured) -> str:
    """Why a shot is marked; empty if it is not."""
    far = f"{100 * verdict.change:+.0f} %"
    match verdict.quantity:
        case "peak":
            return f"peak {shot.peak_m_s2:.3g} m/s², {far} from the shots before"
        case "friction":
            return f"friction {shot.friction_N:.3g} N, {far} from the shots before"
        case "friction beside the peak":
            return f"friction beside the peak, {far} from the model since the method's first shot"
    return ""


def driven(actuator: Method, shot: Shot) -> Method:
    """A method's actuator with the drive that a shot asked for."""
    if isinstance(actuator, GunParameters) and isinstance(shot.drive, Pulse):
        return replace(actuator, voltage_V=shot.drive.voltage_V, pulse_s=shot.drive.pulse_s)
    return actuator


class MeasuredGun:
    """A gun whose shots a recorder is told of; all else is the gun's own."""

    def __init__(self, gun: Gun, recorder: ShotRecorder) -> None:
        self._gun, self._recorder = gun, recorder

    def identify(self) -> Identity:
        """Who answers."""
        return self._gun.identify()

    def arm(self) -> None:
        """Allow the next shots."""
        self._gun.arm()

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        """Fire once, and have it measured."""
        report = self._gun.fire(shot, at_s)
        self._recorder.fired(report)
        return report

    def disarm(self) -> None:
        """Forbid shots."""
        self._gun.disarm()

    def status(self) -> GunStatus:
        """The gun at this moment."""
        return self._gun.status()

    def close(self) -> None:
        """Disarm and let go of the gun."""
        self._gun.close()


class MeasuredScreen:
    """A run's screen; at each position that it is shown, a trial that was not delivered may come again."""

    def __init__(self, screen: Screen, recorder: ShotRecorder) -> None:
        self._screen, self._recorder = screen, recorder

    def begin(self, live: LiveRun) -> None:
        """Take the place before a run, which is measured from now on."""
        self._recorder.begin(live, self._screen.trouble)
        self._screen.begin(live)

    def show(self, position: Position) -> None:
        """Show a position."""
        self._screen.show(position)
        self._recorder.shown()

    def act(self, position: Position, until_s: float | None) -> None:
        """The run waits now."""
        self._screen.act(position, until_s)

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Show that something is safe."""
        self._screen.acknowledge(step, word)

    def trouble(self, text: str) -> None:
        """Show what went wrong."""
        self._screen.trouble(text)

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Show what the gun itself says of its state."""
        self._screen.gun_seen(status, fault)
