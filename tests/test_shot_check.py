"""A test shot is driven as a run drives it, and nothing of it fires after an emergency stop, wherever that falls."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from device import Gun, GunStatus, LinkError, Pulse, Shot, ShotReport, ShotTiming, open_gun
from device.methods import drive_of
from device.words import Effect
from experiments.clock import RealClock, VirtualClock
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.console import shot_check
from experiments.screens.console.shot_check import HUNG, ShotCheck, ShotProgress, report_text, state_text
from experiments.screens.synthetic import synthetic_screen
from experiments.session.judging import Beats

pytestmark = pytest.mark.slow

SETUP = load_setup("direction")
PATIENCE_S = 60.0


class Spied:
    """A simulated gun that notes what it is told, and has something done just before and after each word."""

    def __init__(self, gun: Gun, at: dict[str, Callable[[], None]]) -> None:
        self._gun, self._at = gun, at
        self.words: list[str] = []
        self.shots: list[Shot] = []
        self.dead = False

    def _note(self, word: str, act: Callable[[], Any]) -> Any:
        self._at.get(f"before {word}", lambda: None)()
        self.words.append(word)
        if self.dead:
            raise LinkError("the line is dead")
        done = act()
        self._at.get(f"after {word}", lambda: None)()
        return done

    def arm(self) -> None:
        self._note("arm", self._gun.arm)

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self.shots.append(shot)
        report: ShotReport = self._note("fire", lambda: self._gun.fire(shot, at_s))
        self.words.append("fired")
        return report

    def disarm(self) -> None:
        self._note("disarm", self._gun.disarm)

    def status(self) -> GunStatus:
        found: GunStatus = self._note("status", self._gun.status)
        return found

    def close(self) -> None:
        self.words.append("close")
        self._gun.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


class Bench:
    """A test shot with a spied gun, carried out in this thread."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, method: str = "asymmetric-1", countdown_s: int = 0) -> None:
        self.told: list[ShotProgress] = []
        self.at: dict[str, Callable[[], None]] = {}
        self.guns: list[Spied] = []
        self.clock = RealClock()

        def opened(address: str, methods: Any, *, clock: Callable[[], float]) -> Spied:
            self.address, self.methods = address, methods
            self.at.get("opening", lambda: None)()
            self.guns.append(Spied(open_gun(address, methods, clock=clock), self.at))
            return self.guns[-1]

        monkeypatch.setattr(shot_check, "open_gun", opened)
        monkeypatch.setattr(shot_check, "COUNTDOWN_S", countdown_s)
        self.check = ShotCheck(SETUP, method, "simulated", self.clock, self._tell)

    def _tell(self, told: ShotProgress) -> None:
        self.told.append(told)
        self.at.get(told.phase, lambda: None)()

    def carry_out(self) -> ShotProgress:
        self.check.carry_out()
        assert self.told[-1].phase == "over"
        assert [one.phase for one in self.told].count("over") == 1
        return self.told[-1]

    @property
    def words(self) -> list[str]:
        return self.guns[0].words


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(monkeypatch)


def test_a_countdown_in_which_the_console_stood_still_fires_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    bench, stood_s = Bench(monkeypatch, countdown_s=1), [0.0]
    now = bench.clock.now
    monkeypatch.setattr(bench.clock, "now", lambda: now() + stood_s[0])
    bench.at["counting"] = lambda: stood_s.__setitem__(0, 9.0)
    over = bench.carry_out()
    assert over.text == f"{HUNG} The gun reports: disarmed."
    assert (over.fired, bench.words) == (False, ["disarm", "status", "close"])


@pytest.mark.parametrize("was_elsewhere", [False, True])
def test_nothing_is_fired_where_the_keys_were_elsewhere_in_the_countdown(
    monkeypatch: pytest.MonkeyPatch, was_elsewhere: bool
) -> None:
    """They are here again at its end; F12 was pressed before and not heard."""
    bench, later_s = Bench(monkeypatch, countdown_s=1), [0.0]
    now = bench.clock.now
    bench.check.beats = Beats(lambda: now() + later_s[0])

    def counting() -> None:
        for _ in range(7):
            bench.check.beats.beat(heard=not was_elsewhere)
            later_s[0] += 0.1
        threading.Thread(target=beat, args=[bench], daemon=True).start()

    bench.at["counting"] = counting
    over = bench.carry_out()
    assert over.fired is not was_elsewhere
    assert over.text.startswith(HUNG) is was_elsewhere


def beat(bench: Bench, *, heard: bool = True) -> None:
    """The window looks at its keys until the end."""
    while bench.told[-1].phase != "over":
        bench.check.beats.beat(heard=heard)
        threading.Event().wait(0.02)


@pytest.mark.parametrize(("blocked_s", "heard", "fires"), [(0.0, True, True), (0.7, True, False), (0.0, False, False)])
def test_nothing_is_fired_while_the_window_does_not_look_at_its_keys(
    monkeypatch: pytest.MonkeyPatch, blocked_s: float, heard: bool, fires: bool
) -> None:
    """A stop that was pressed waits to be heard there; what is blocked for good fires nothing for good."""
    bench = Bench(monkeypatch, countdown_s=1)
    now, later_s = bench.clock.now, [0.0]
    monkeypatch.setattr(bench.clock, "now", lambda: now() + later_s[0])

    def counting() -> None:
        bench.check.beats.beat()
        later_s[0] = blocked_s  # and no beat comes any more
        if not blocked_s:
            threading.Thread(target=beat, args=[bench], kwargs={"heard": heard}, daemon=True).start()

    bench.at["counting"] = counting
    over = bench.carry_out()
    assert (over.fired, "fire" in bench.words) == (fires, fires)
    assert fires or over.text.startswith(HUNG)


# as the run drives it


@pytest.mark.parametrize("method", SETUP.config.methods)
def test_a_method_is_driven_as_the_run_drives_it(method: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    bench = Bench(monkeypatch, method)
    over = bench.carry_out()
    assert over.fired
    assert bench.methods == SETUP.gun.renderings(SETUP.config.methods)
    (shot,) = bench.guns[0].shots
    spied: list[Spied] = []

    def for_the_run(address: str, methods: Any, *, clock: Callable[[], float]) -> Spied:
        assert methods == bench.methods
        spied.append(Spied(open_gun(address, methods, clock=clock), {}))
        return spied[0]

    monkeypatch.setattr("experiments.run.open_gun", for_the_run)
    request = RunRequest(setup=SETUP, participant_id="P01", results=tmp_path, seed=1)
    run(request, synthetic_screen, VirtualClock())
    assert shot in spied[0].shots
    assert shot.drive == drive_of(SETUP.gun.rendering(method))


def test_the_gun_is_armed_for_the_shot_alone_and_its_state_is_read_back_before_it_is_closed(bench: Bench) -> None:
    over = bench.carry_out()
    assert bench.words == ["arm", "status", "fire", "fired", "disarm", "status", "close"]
    assert over.mood == "good"
    assert over.text.endswith("The gun reports: disarmed.")


def test_keys_that_are_elsewhere_as_a_beat_comes_late_went_when_it_was_due() -> None:
    now_s = [0.0]
    beats = Beats(lambda: now_s[0])
    for now_s[0], heard in ((0.0, True), (0.1, True), (0.35, False), (0.45, False), (0.55, False)):
        beats.beat(heard=heard)
    assert not beats.is_deaf
    now_s[0] = 0.61
    assert beats.is_deaf


def test_a_countdown_says_each_second_and_then_fires(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, countdown_s=1)
    assert bench.carry_out().fired
    assert [one.phase for one in bench.told] == ["opening", "counting", "arming", "firing", "over"]
    assert bench.told[1].seconds == 1


def test_while_a_gun_does_not_answer_nothing_says_that_it_fires(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, countdown_s=1)
    bench.at["before arm"] = lambda: setattr(bench.guns[0], "dead", True)
    assert not bench.carry_out().fired
    assert [one.phase for one in bench.told] == ["opening", "counting", "arming", "over"]


# called off


@pytest.mark.parametrize("phase", ["opening", "counting", "arming", "firing", "after arm", "after status"])
def test_a_test_shot_that_is_called_off_before_it_fires_does_not_fire(
    phase: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch, countdown_s=1)
    bench.at[phase] = bench.check.call_off
    over = bench.carry_out()
    assert not over.fired
    assert not bench.guns[0].shots
    assert bench.words[-3:] == ["disarm", "status", "close"]
    assert over.text == "Nothing was fired. The gun reports: disarmed."


# the emergency stop


def stopping(bench: Bench, at: str) -> None:
    """Have the emergency stop fall at a moment, once, and go on only when its disarm is through."""
    once = iter([bench.check.emergency_stop])

    def stop() -> None:
        next(once, lambda: None)()
        for disarming in list(bench.check.disarming):
            disarming.join(PATIENCE_S)

    bench.at[at] = stop


@pytest.mark.parametrize("at", ["opening", "counting", "arming", "firing", "before arm", "after arm", "after status"])
def test_nothing_fires_after_an_emergency_stop(at: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, countdown_s=1)
    stopping(bench, at)
    over = bench.carry_out()
    assert not over.fired
    assert not bench.guns[0].shots
    assert over.mood == "bad"
    assert over.text.endswith("The gun reports: disarmed.")
    assert not any(thread.name == "emergency stop" for thread in threading.enumerate())


def test_a_stop_between_the_last_look_and_the_shot_finds_the_gun_disarmed(bench: Bench) -> None:
    stopping(bench, "before fire")
    over = bench.carry_out()
    assert "fired" not in bench.words
    assert not over.fired
    assert "the gun is disarmed; arm it before it may fire" in over.text


def test_a_stop_after_the_shot_disarms_and_says_what_the_gun_reports(bench: Bench) -> None:
    stopping(bench, "after fire")
    over = bench.carry_out()
    assert over.fired
    assert bench.words.count("disarm") == 2
    assert over.mood == "bad"


def test_the_gun_is_not_closed_while_the_emergency_stop_still_speaks_to_it(bench: Bench) -> None:
    go_on = threading.Event()
    disarms: list[str] = []

    def slow() -> None:
        if threading.current_thread().name == "emergency stop":
            assert go_on.wait(PATIENCE_S)
            disarms.append("through")

    bench.at["after fire"] = bench.check.emergency_stop
    bench.at["before disarm"] = slow
    bench.at["before status"] = lambda: disarms.append("read") if "fired" in bench.words else None
    threading.Timer(0.05, go_on.set).start()
    bench.carry_out()
    assert disarms == ["through", "read"]


# when the gun fails


def test_a_gun_that_cannot_be_read_is_to_be_switched_off(bench: Bench) -> None:
    def die() -> None:
        bench.guns[0].dead = True

    bench.at["after fire"] = die
    over = bench.carry_out()
    assert over.fired
    assert over.mood == "bad"
    assert over.text.endswith("The gun's state cannot be read: SWITCH OFF ITS POWER.")


def test_a_gun_that_is_not_there_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[ShotProgress] = []
    monkeypatch.setattr(shot_check, "COUNTDOWN_S", 0)
    ShotCheck(SETUP, "vibration", "serial:/dev/nowhere", RealClock(), told.append).carry_out()
    assert told[-1].phase == "over"
    assert told[-1].text.startswith("Test shot of Vibration: ")
    assert not told[-1].fired


def test_a_gun_that_fails_at_the_shot_is_disarmed_and_its_word_is_told(bench: Bench) -> None:
    def fail() -> None:
        raise LinkError("no answer within 1 s")

    bench.at["before fire"] = fail
    over = bench.carry_out()
    assert over.text == "Test shot of Asymmetric Force I: no answer within 1 s. The gun reports: disarmed."
    assert bench.words[-3:] == ["disarm", "status", "close"]


# words


PULSE, EFFECT = Pulse(voltage_V=16.0, pulse_s=0.01), Effect(effect=1)


def report(motion: str, timing: ShotTiming | None = None, end_s: float = 10.01) -> ShotReport:
    return ShotReport(
        shot=Shot(method="m", direction="forward", drive=PULSE),
        requested_s=9.99,
        pulse_start_s=10.0,
        pulse_end_s=end_s,
        home_predicted_s=10.155,
        motion=motion,
        timing=timing,
    )


TIMING = ShotTiming(
    requested_s=9.998,
    written_s=9.999,
    acknowledged_s=10.02,
    accepted_s=9.9995,
    pulse_start_s=10.0,
    pulse_end_s=10.01,
    uncertainty_s=0.0004,
    gun_accepted_us=1,
    gun_start_us=2,
    gun_end_us=3,
    gun_count=1,
    asked=1,
)


@pytest.mark.parametrize(
    ("told", "drive", "text"),
    [
        (
            report("home"),
            PULSE,
            "M: the coil was driven at 16 V for 10.0 ms. By the model the magnet moved, and was home after 155 ms.",
        ),
        (
            report("no-break-away"),
            PULSE,
            "M: the coil was driven at 16 V for 10.0 ms. By the model the magnet did not move.",
        ),
        (report("rendered", end_s=10.024), EFFECT, "M: the gun vibrated for 24 ms."),
        (
            report("rendered", TIMING, end_s=10.024),
            EFFECT,
            "M: the gun vibrated for 24 ms. The pulse began 2.0 ms after the request, by the gun's clock (to within "
            "0.4 ms).",
        ),
    ],
)
def test_what_the_gun_reported_is_told_in_words(told: ShotReport, drive: Any, text: str) -> None:
    assert report_text("M", told, drive) == text


@pytest.mark.parametrize(
    ("state", "fault", "safe"),
    [
        ("disarmed", None, True),
        ("armed", None, False),
        ("resetting", None, False),
        ("fault", "over-current", False),
        ("disarmed", "over-current", False),
    ],
)
def test_only_a_gun_that_reports_itself_disarmed_and_without_a_fault_is_safe(
    state: Any, fault: Any, safe: bool
) -> None:
    status = GunStatus(state=state, shots=1, coil_temperature_C=20.0, ready_at_s=0.0, fault=fault)
    text, is_safe = state_text(status)
    assert is_safe is safe
    assert ("SWITCH OFF ITS POWER" in text) is not safe
    assert state_text(None)[1] is False


# on a line


def test_on_a_line_the_shot_that_was_asked_for_is_rendered_and_its_timing_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.twins import a_twin

    monkeypatch.setattr(shot_check, "COUNTDOWN_S", 0)
    told: list[ShotProgress] = []
    with a_twin(tmp_path, speed=1.0) as (twin, socket):
        ShotCheck(SETUP, "asymmetric-2", f"serial:{socket.address}", RealClock(), told.append).carry_out()
        (rendered,) = twin.body.ledger
    assert told[-1].fired
    assert (rendered.method, rendered.too_soon) == ("asymmetric-2", False)
    assert "after the request, by the gun's clock (to within " in told[-1].text
    assert told[-1].text.endswith("The gun reports: disarmed.")


def test_on_a_line_nothing_is_rendered_after_an_emergency_stop(tmp_path: Path) -> None:
    from tests.twins import a_twin

    told: list[ShotProgress] = []

    def tell(one: ShotProgress) -> None:
        told.append(one)
        if one.phase == "counting":
            check.emergency_stop()

    with a_twin(tmp_path, speed=1.0) as (twin, socket):
        check = ShotCheck(SETUP, "asymmetric-2", f"serial:{socket.address}", RealClock(), tell)
        check.carry_out()
        assert not list(twin.body.ledger)
    assert told[-1].text == "Nothing was fired. The gun reports: disarmed."
