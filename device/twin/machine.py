"""The firmware's own limits, in whole microseconds, millivolts and nanojoules, so that C without floats agrees.

They are those of `device.limits`, which judges first, on the host; the numbers are written here again on purpose: the
firmware knows nothing of the host's.

States and what each command may do in them stand in `REFUSED`; everything timed happens at its own microsecond.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

from device.wire.errors import WireError
from device.wire.records import Setting, ShotRecord, StatusRecord, WireState

MAX_MILLIVOLTS: Final = 24_000
MAX_PULSE_US: Final = 20_000
_MAX_EFFECT: Final = 123
MAX_EFFECT_US: Final = 1_000_000
MAX_REST_US: Final = 10_000_000
FLOOR_US: Final = {"PULS": 50_000, "EFF": 10_000}
"""Least time from onset to onset, whatever the host says. Assumed."""
SECOND_US: Final = 1_000_000
MINUTE_US: Final = 60 * SECOND_US
DUTY_US: Final = 100_000
"""Driven in any second: 10 %."""
MAX_SHOTS: Final = 300
"""In any minute."""
COIL_MILLIOHMS: Final = 2_900
COIL_NJ_MK: Final = 20_000_000
"""Heat capacity: 20 J/K, assumed as in `device.limits`."""
MAX_WARMTH_NJ: Final = 55_000 * COIL_NJ_MK
"""80 degC in a room of 25 degC."""
ROOM_MC: Final = 25_000
COOLING_US: Final = 100_000
COOLING_PARTS: Final = 2_001
"""Each 100 ms a 2001st part of the warmth goes: 200 s time constant, erring on the warm side."""
COLD_STEPS: Final = 60_000
"""After so many steps, 100 min, the coil is taken for cold."""


def out_of_range(setting: Setting) -> bool:
    """Whether a setting is beyond what any shot may be made of."""
    if setting.kind == "PULS":
        amount, length = setting.amount <= MAX_MILLIVOLTS, setting.length_us <= MAX_PULSE_US
    else:
        amount, length = 1 <= setting.amount <= _MAX_EFFECT, setting.length_us <= MAX_EFFECT_US
    least = max(setting.length_us, FLOOR_US[setting.kind])
    return not (amount and length and least <= setting.rest_us <= MAX_REST_US)


class Budget:
    """The shots of the last minute and the coil's warmth since the start of the clock."""

    def __init__(self) -> None:
        self._pulses: list[tuple[int, int]] = []  # start and driven time of the last MAX_SHOTS, oldest first
        self._warmth_nJ = 0
        self._cooled_step = 0

    def refusal(self, setting: Setting, start_us: int) -> int:
        """The error that forbids a shot at `start_us`, or 0."""
        if len(self._pulses) == MAX_SHOTS and start_us < self._pulses[0][0] + MINUTE_US:
            return WireError.RATE
        if self._driven_too_long(_driven_us(setting), start_us):
            return WireError.DUTY
        if self._warmth_at(start_us) + _heat_nanojoules(setting) > MAX_WARMTH_NJ:
            return WireError.HOT
        return WireError.NO_DEVICE_ERROR

    def spend(self, setting: Setting, start_us: int) -> None:
        """Take a shot into account. A pulse that is cut short counts in full."""
        self._warmth_nJ = self._warmth_at(start_us) + _heat_nanojoules(setting)
        self._cooled_step = start_us // COOLING_US
        self._pulses = [*self._pulses[-MAX_SHOTS + 1 :], (start_us, _driven_us(setting))]

    def coil_millicelsius(self, now_us: int) -> int:
        """The coil's estimated temperature in thousandths of a degree."""
        return ROOM_MC + self._warmth_at(now_us) // COIL_NJ_MK

    def _driven_too_long(self, on_us: int, start_us: int) -> bool:
        """A second is fullest when it ends with the new pulse; what of older pulses lies in it counts."""
        begin_us = start_us + on_us - SECOND_US
        inside_us = (min(start + driven - begin_us, driven) for start, driven in self._pulses)
        return on_us + sum(max(0, inside) for inside in inside_us) > DUTY_US

    def _warmth_at(self, now_us: int) -> int:
        warmth = self._warmth_nJ
        steps = now_us // COOLING_US - self._cooled_step
        if steps > COLD_STEPS:
            return 0
        for _ in range(steps):
            warmth -= warmth // COOLING_PARTS
        return warmth


def _driven_us(setting: Setting) -> int:
    """How long the coil is driven; a vibration does not use it."""
    return setting.length_us if setting.kind == "PULS" else 0


def _heat_nanojoules(setting: Setting) -> int:
    """V^2/R t, rounded up: mV^2 us / mOhm is nJ."""
    if setting.kind == "EFF":
        return 0
    return -(-setting.amount * setting.amount * setting.length_us // COIL_MILLIOHMS)


BOOT_REST_US: Final = 1_000_000
"""No shot in the first second: what was driven before a reset is not known."""
MAX_AHEAD_US: Final = 2_000_000
"""A shot can be asked for so long ahead."""
MAX_MARK: Final = 0xFFFF_FFFF

Guarded = Literal["CONF", "ARM", "TRIG"]
REFUSED: Final[dict[tuple[Guarded, WireState], int]] = {
    ("CONF", "WAITING"): WireError.BUSY,
    ("CONF", "FIRING"): WireError.BUSY,
    ("ARM", "WAITING"): WireError.BUSY,
    ("ARM", "FIRING"): WireError.BUSY,
    ("ARM", "FAULT"): WireError.FAULT,
    ("TRIG", "DISARMED"): WireError.DISARMED,
    ("TRIG", "WAITING"): WireError.BUSY,
    ("TRIG", "FIRING"): WireError.BUSY,
    ("TRIG", "FAULT"): WireError.FAULT,
}
"""What is refused in which state; everything else is taken. ABOR, *RST and questions are taken in every state."""

UNSET: Final = Setting(method="none", way="FORW", kind="EFF", amount=1, length_us=0, rest_us=0)
NO_SHOT: Final = ShotRecord(
    count=0, mark=0, ending="NONE", accepted_us=0, start_us=0, end_us=0, home_predicted_us=0, setting=UNSET
)


LATE_PULSE_US: Final = 200
LATE_PULSE_PARTS: Final = 50
"""A pulse is on time if it loses at most 2 % of its length, and at most 0.2 ms, a long turn of the main loop: the chip
takes fewer than 20,000 instructions to answer a line (counted on the emulator), 0.12 ms at one a cycle. Assumed."""
LATE_EFFECT_US: Final = 1_000
"""A vibration waits for its driver to be told: 0.16 ms, 0.55 ms if that has to be set up anew. Assumed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEvent:
    """What the board is told, and when: a pulse of so many mV, an effect by its number, or off.

    `end_us`: when a pulse or an effect is to be over; of an OFF its own time.
    """

    time_us: int
    kind: Literal["PULS", "EFF", "OFF"]
    amount: int = 0
    end_us: int

    def is_over(self, now_us: int) -> bool:
        """Whether it is too late to begin it: nothing would be driven."""
        return self.end_us > self.time_us and now_us >= self.end_us


@dataclass(frozen=True, slots=True, kw_only=True)
class Carried:
    """How the board carried a drive out: when, or the error for which it did not."""

    at_us: int
    error: int = WireError.NO_DEVICE_ERROR


@dataclass(slots=True, kw_only=True)
class Board:
    """The board under a gun, as a script has it: so late with everything, and its driver may be dead."""

    late_us: int = 0
    dead: bool = False

    def __call__(self, drive: DriveEvent) -> Carried:
        """What becomes of a drive."""
        at_us = drive.time_us + self.late_us
        if self.dead:
            return Carried(at_us=at_us, error=WireError.FAULT)
        return Carried(at_us=at_us, error=WireError.TOO_LATE if drive.is_over(at_us) else WireError.NO_DEVICE_ERROR)


class StateMachine:
    """One gun from its boot on. Times never run back.

    `drives` is what the board has carried out, and when, as far as nobody has taken it yet; `never` is the error for
    which the last shot was never begun, if it was not.
    """

    def __init__(self, boot_us: int = 0, board: Callable[[DriveEvent], Carried] | None = None) -> None:
        self.state: WireState = "DISARMED"
        self.setting: Setting | None = None
        self.shot: ShotRecord = NO_SHOT
        self.drives: list[DriveEvent] = []
        self.never: int = WireError.NO_DEVICE_ERROR
        self._board = board or Board()
        self._fault = 0
        self.ready_us = boot_us + BOOT_REST_US
        self._budget = Budget()

    def due_us(self) -> int | None:
        """When the next thing happens by itself: a pulse begins or ends."""
        return {"WAITING": self.shot.start_us, "FIRING": self.shot.end_us}.get(self.state)

    def run_due(self) -> bool:
        """Let the next thing happen; true if a shot ended by it."""
        if self.state == "WAITING":
            return not self._begin()
        self._end(self.shot.end_us)
        self.state = "ARMED"
        return True

    def configure(self, setting: Setting) -> int:
        """Make the next shots of this. The error, or 0."""
        error = REFUSED.get(("CONF", self.state), WireError.NO_DEVICE_ERROR)
        if not error and out_of_range(setting):
            error = WireError.OUT_OF_RANGE
        if not error:
            self.setting = setting
        return error

    def arm(self) -> int:
        """Allow shots. The error, or 0."""
        error = REFUSED.get(("ARM", self.state), WireError.NO_DEVICE_ERROR)
        if not error:
            self.state = "ARMED"
        return error

    def trigger(self, mark: int, at_us: int, before_us: int, now_us: int) -> int:
        """Accept a shot: now if `at_us` is over, else then; never after `before_us`, unless that is 0. Error, or 0."""
        start_us = max(at_us, now_us)
        error = self._forbidden(mark, start_us, before_us, now_us)
        if error or self.setting is None:
            return error
        self.shot = ShotRecord(
            count=self.shot.count,
            mark=mark,
            ending="WAIT",
            accepted_us=now_us,
            start_us=start_us,
            end_us=start_us + self.setting.length_us,
            home_predicted_us=start_us + self.setting.rest_us,
            setting=self.setting,
        )
        self.state = "WAITING"
        return WireError.NO_DEVICE_ERROR

    def _forbidden(self, mark: int, start_us: int, before_us: int, now_us: int) -> int:
        """The first rule that a trigger breaks, in this order; or 0."""
        error = REFUSED.get(("TRIG", self.state), WireError.NO_DEVICE_ERROR)
        if error:
            return error
        if self.setting is None:
            return WireError.NOT_CONFIGURED
        if mark > MAX_MARK or start_us - now_us > MAX_AHEAD_US:
            return WireError.OUT_OF_RANGE
        if mark != 0 and mark == self.shot.mark and self.shot.ending != "NONE":
            return WireError.ALREADY_FIRED
        if before_us != 0 and start_us > before_us:
            return WireError.TOO_LATE
        if start_us < self.ready_us:
            return WireError.MAGNET_NOT_HOME if self.shot.count else WireError.JUST_BOOTED
        return self._budget.refusal(self.setting, start_us)

    def abort(self, now_us: int) -> bool:
        """Switch off and disarm, from every state; true if a shot ended by it."""
        ended = self.state in {"WAITING", "FIRING"}
        if self.state == "FIRING":
            self._end(now_us)
        elif self.state == "WAITING":
            self._call_off(WireError.CANCELLED)
        if self.state != "FAULT":
            self.state = "DISARMED"
        return ended

    def clear(self) -> None:
        """Forget the setting and the fault of a gun that was aborted; limits and shots stay."""
        self.setting, self._fault, self.state = None, 0, "DISARMED"

    def fail(self, fault: int, now_us: int) -> bool:
        """The driver reports a fault; true if a shot ended by it."""
        ended = self.abort(now_us)
        self._fault, self.state = fault, "FAULT"
        return ended

    def standing(self, now_us: int) -> StatusRecord:
        """How the gun stands; an armed one is resetting while its magnet is on its way home, by prediction."""
        resetting = self.state == "ARMED" and now_us < self.ready_us
        return StatusRecord(
            state="RESETTING" if resetting else self.state,
            count=self.shot.count,
            clock_us=now_us,
            ready_us=self.ready_us,
            coil_mC=self._budget.coil_millicelsius(now_us),
            fault=self._fault,
        )

    def _begin(self) -> bool:
        """Whether the board could begin the shot; how late it was is told by START, if that is too late."""
        setting, start_us = self.shot.setting, self.shot.start_us
        drive = DriveEvent(time_us=start_us, kind=setting.kind, amount=setting.amount, end_us=self.shot.end_us)
        carried = self._tell(drive)
        if carried.error:
            self._call_off(carried.error)
            self.state = "ARMED"
            return False
        if carried.at_us - start_us > _allowed_us(setting):
            start_us = carried.at_us
        self.state = "FIRING"
        self.ready_us = start_us + setting.rest_us
        self.shot = replace(
            self.shot,
            count=self.shot.count + 1,
            ending="DRIV",
            start_us=start_us,
            home_predicted_us=self.ready_us,
        )
        self._budget.spend(setting, start_us)
        return True

    def _end(self, time_us: int) -> None:
        """It is over, whole or cut short. Off is told by END, if that is too late; a pulse never outlasts its END."""
        shot = self.shot
        carried = self._tell(DriveEvent(time_us=time_us, kind="OFF", end_us=time_us))
        off_us = time_us if carried.error else carried.at_us
        if shot.setting.kind == "PULS":
            off_us = min(off_us, shot.end_us)
        if off_us - time_us <= _allowed_us(shot.setting):
            off_us = time_us
        off_us = max(off_us, shot.start_us)
        whole = off_us >= max(shot.end_us, shot.start_us + shot.setting.length_us)
        self.shot = replace(shot, ending="DONE" if whole else "CUT", end_us=off_us)

    def _call_off(self, error: int) -> None:
        """The shot that waits is never begun."""
        self.never = error
        self.shot = replace(self.shot, ending="NONE")

    def _tell(self, drive: DriveEvent) -> Carried:
        carried = self._board(drive)
        if not carried.error:
            self.drives.append(replace(drive, time_us=carried.at_us))
        return carried


def _allowed_us(setting: Setting) -> int:
    """How late a drive may be, and still be told as on time."""
    if setting.kind == "EFF":
        return LATE_EFFECT_US
    return min(LATE_PULSE_US, setting.length_us // LATE_PULSE_PARTS)
