"""Guns that other packages bring: what is let in, what the guard believes, and what every gun keeps."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import astuple, dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from device import Gun, GunStatus, LimitError, LinkError, Pulse, Shot, ShotReport, interrupts, open_gun
from device.methods import drive_of, paper_methods
from device.parameters import GunParameters
from device.plugin import door, guard
from device.plugin.conformance import (
    GUN_CHECKS,
    ConformanceFinding,
    ConformanceRig,
    OpenedGuns,
    StillClock,
    broken,
    conformance,
    rig_at,
)
from device.plugin.guard import GuardedGun, PluginError
from device.simulated import SimulatedGun
from device.words import DIRECTIONS, ShotTiming
from experiments import run as runs
from experiments.clock import RealClock
from experiments.doctor import checks
from experiments.live_run import RunStopped
from experiments.load import load_setup
from experiments.record.journal import JournalError, Record, read_journal
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session import events
from experiments.session.states import EMERGENCY
from tests.conftest import RECOIL
from tests.firmware import emulated
from tests.gun_plugins import ROOT, install, install_sound_card
from tests.stolen_signal import Told, stolen_signal
from tests.twins import a_shot, a_twin
from tests.waiting import PATIENCE_S, wait_for

TRIALS = 8


@pytest.fixture(scope="module")
def sound_card(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch:
        install_sound_card(patch, tmp_path_factory.mktemp("plugins"))
        yield "sound-card:null"


# the kit


def test_the_simulated_gun_keeps_what_every_gun_keeps():
    assert broken(conformance(rig_at("simulated", trials=TRIALS))) == []


@pytest.mark.slow
def test_the_twin_keeps_it(tmp_path):
    with a_twin(tmp_path, speed=20.0) as (twin, socket):
        rig = rig_at(
            f"serial:{socket.address}?speed=20", trials=TRIALS, break_it=lambda: twin.core.fail(1, twin.clock_us())
        )
        assert broken(conformance(rig)) == []


@pytest.mark.slow
def test_the_firmware_keeps_it(tmp_path):
    with emulated(tmp_path, "gun-qemu-10.elf") as chip:
        rig = rig_at(f"serial:{chip.port}?speed=10", trials=TRIALS, break_it=lambda: chip.fail(1))
        assert broken(conformance(rig)) == []


@pytest.mark.slow
def test_a_plug_in_keeps_it(sound_card):
    import sound_card_gun

    with pytest.MonkeyPatch.context() as patch:

        def pull_the_plug() -> None:
            patch.setattr(sound_card_gun.Null, "play", lambda *_: 1 / 0)

        rig = rig_at(sound_card, trials=TRIALS, speed=10.0, break_it=pull_the_plug)
        assert broken(conformance(rig)) == []


TAPE = """
</usr/share/alsa/alsa.conf>
pcm.tape {{ type file slave.pcm "null" file "{file}" format "raw" }}
"""
ON_TAPE = """
import threading, time
import numpy as np
from device.methods import paper_methods
from sound_card_gun import Card, SoundCardGun
from tests.test_gun_plugins import each_shot

card = Card("tape", time.monotonic)
gun = SoundCardGun(card, paper_methods(), time.monotonic)
gun.arm()
for shot in each_shot():
    gun.fire(shot)
off = threading.Event()
off.set()
card.play(np.ones(480_000, np.float32), off)
gun.close()
"""
"""Every shot on a card that writes down what it is given, then ten seconds that are called off."""


def each_shot() -> list[Shot]:
    """A shot of each method to each side."""
    methods = paper_methods().items()
    return [
        Shot(method=name, direction=direction, drive=drive_of(method))
        for name, method in methods
        for direction in DIRECTIONS
    ]


@pytest.mark.soak  # a busy machine hands the card its samples too late, and the tape has gaps
@pytest.mark.skipif(not Path("/usr/share/alsa/alsa.conf").exists(), reason="needs ALSA's configuration")
def test_a_sound_card_is_given_each_shot_whole_and_little_of_what_is_called_off(
    tmp_path: Path, sound_card: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through PortAudio, on a device of ALSA's that nobody hears and that writes a file."""
    import sound_card_gun as example

    pytest.importorskip("sounddevice", reason="needs the extra `gui`")
    (tmp_path / "asound.conf").write_text(TAPE.format(file=tmp_path / "tape.raw"))
    monkeypatch.setenv("ALSA_CONFIG_PATH", str(tmp_path / "asound.conf"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(Path(example.__file__).parent), str(ROOT)]))
    subprocess.run([sys.executable, "-c", ON_TAPE], check=True)
    tape = np.fromfile(tmp_path / "tape.raw", np.float32)
    for shot in each_shot():
        wave = example.waveform(shot, paper_methods()[shot.method])
        at = np.flatnonzero(tape)[0] - np.flatnonzero(wave)[0]
        assert np.array_equal(tape[at : at + len(wave)], wave)
        tape = tape[at + len(wave) :]
    assert 0 < np.count_nonzero(tape) < 240_000


# what is let in

HANGS = "import time\ntime.sleep(3600)\n"
GUN = """
class Gun:
    def identify(self): ...
    def arm(self): ...
    def fire(self, shot, at_s=None): ...
    def disarm(self): ...
    def status(self): ...
    def close(self): ...
    {more}

def open_gun(address, methods, clock):
    return {made}
"""


@pytest.mark.slow
def test_a_plug_in_that_hangs_at_import_is_refused_by_name(tmp_path, monkeypatch):
    install(monkeypatch, tmp_path, HANGS, name="sleeper", module="sleeper_gun")
    with pytest.raises(PluginError, match=r"gun plug-in sleeper: its import did not end within 1 s; .* uninstall it"):
        door.try_import("sleeper", 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n", "its import was killed by signal 9"),
        ("import sys\nsys.exit('no card')\n", "its import failed: no card"),
        ("import os\nos._exit(0)\n", "its import ended the process: it said nothing"),
        ("import sys\nprint('imported')\nsys.exit()\n", "its import ended the process: imported"),
        ("raise OSError('no\\ncard')\n", "its import failed: OSError: no card"),
        ("1 / 0\n", "its import failed: ZeroDivisionError: division by zero"),
        ("", "its import failed: AttributeError: .*open_gun"),
        ("open_gun = 3\n", "its import failed: TypeError: the entry point is 3; it must be a function of"),
        ("def open_gun(address): ...\n", "its import failed: TypeError: too many positional arguments"),
    ],
)
def test_a_plug_in_that_cannot_be_imported_is_refused_by_name(tmp_path, monkeypatch, source, said):
    install(monkeypatch, tmp_path, source, name="bad", module="bad_gun")
    with pytest.raises(PluginError, match=f"gun plug-in bad: {said}"):
        open_gun("bad:1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "said"),
    [
        (GUN.format(more="arm = None", made="Gun()"), "Gun has no arm; a gun has identify, arm, fire"),
        (GUN.format(more="def fire(self, shot): ...", made="Gun()"), r"it cannot be called as fire\(shot, at_s\)"),
        (GUN.format(more="", made="None"), "NoneType has no identify, arm, fire, disarm, status, close"),
        (GUN.format(more="", made="1 / 0"), "did not open '1': ZeroDivisionError"),
        (GUN.format(more="", made="Gun()"), "gives as its status None; it must be a GunStatus"),
    ],
)
def test_what_a_plug_in_opens_must_be_a_gun(tmp_path, monkeypatch, source, said):
    install(monkeypatch, tmp_path, source, name="bad", module="bad_gun")
    monkeypatch.setattr(door, "try_import", lambda _: None)
    with pytest.raises(PluginError, match=f"gun plug-in bad:? ?{said}"):
        open_gun("bad:1")


@pytest.mark.slow
@pytest.mark.parametrize("made", ["1 / 0", "exit()", "Gun(disarm=None)"])
@pytest.mark.parametrize("shots", [0, 5])
def test_a_doctor_whose_gun_breaks_off_while_it_is_opened_says_that_it_may_be_armed(tmp_path, monkeypatch, made, shots):
    install(monkeypatch, tmp_path, GUN.format(more="", made=made), name="bad", module="bad_gun")
    monkeypatch.setattr(door, "try_import", lambda _: None)
    looks = {one.name: one for one in checks.checks(tmp_path, "bad:1", 0.1, shots=shots)}
    with pytest.raises(checks.GunLeftArmed, match=r"--gun bad:1: .*switch off its power"):
        checks.carry_out_check(looks["shots" if shots else "gun"])


def test_a_gun_that_lacks_something_is_disarmed_and_closed_as_far_as_it_can_be(tmp_path, monkeypatch):
    more = "status = None; disarm = lambda self: 1 / 0; close = lambda self: open('closed', 'w').close()"
    install(monkeypatch, tmp_path, GUN.format(more=more, made="Gun()"), name="bad", module="bad_gun")
    monkeypatch.setattr(door, "try_import", lambda _: None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PluginError, match=r"Gun has no status; .* could not be disarmed and closed: switch"):
        open_gun("bad:1")
    assert (tmp_path / "closed").exists()


def test_an_interrupt_does_not_hide_that_what_lacks_something_may_be_armed(tmp_path, monkeypatch, hangups):
    more = "status = None; disarm = lambda self: __import__('os').kill(__import__('os').getpid(), 1) or 1 / 0"
    install(monkeypatch, tmp_path, GUN.format(more=more, made="Gun()"), name="bad", module="bad_gun")
    monkeypatch.setattr(door, "try_import", lambda _: None)
    with pytest.raises(PluginError, match=r"Gun has no status; .* switch off its power"):
        open_gun("bad:1")


def test_two_packages_with_one_name_are_both_named(tmp_path, monkeypatch):
    for package in ("one", "two"):
        install(monkeypatch, tmp_path, "", name="same", module=f"{package}_gun", package=package)
    with pytest.raises(PluginError, match="several packages bring it: one, two; uninstall all but one"):
        open_gun("same:")


def test_no_plug_in_takes_the_name_of_a_gun_of_ours_and_those_that_are_there_are_told(
    tmp_path, monkeypatch, sound_card
):
    install(monkeypatch, tmp_path, "1 / 0\n", name="simulated", module="false_gun")
    assert open_gun("simulated").identify().model == "simulated"
    assert "simulated" not in door.installed_plugins().names
    with pytest.raises(ValueError, match=r"address is 'usb'; .*plug-in that is installed beside Recoil .sound-card."):
        open_gun("usb:1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (b"[recoil.guns]\nother\n", "broken: its entry_points.txt cannot be read (.+): mend or uninstall it"),
        (b"[recoil.guns]\n\xff = x:y\n", "broken: its entry_points.txt cannot be read (.+): mend or uninstall it"),
        (b"[recoil.guns]\nbad = no such syntax!!\n", None),
    ],
)
def test_broken_entry_points_are_named_with_their_package_and_lock_out_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sound_card: str, broken: bytes, said: str | None
) -> None:
    install(monkeypatch, tmp_path, "", name="x", module="broken_gun", package="broken")
    (tmp_path / "broken-0.1.0.dist-info" / "entry_points.txt").write_bytes(broken)
    open_gun(sound_card).close()
    if said is None:
        with pytest.raises(PluginError, match="gun plug-in bad: the package broken gives it as `bad = no such syntax"):
            open_gun("bad:")
    else:
        with pytest.raises(ValueError, match=rf"installed beside Recoil \(sound-card\); {said}"):
            open_gun("other:")


def test_a_plug_in_that_never_opens_is_refused(tmp_path, monkeypatch):
    install(
        monkeypatch, tmp_path, GUN.format(more="", made="__import__('time').sleep(9)"), name="slow", module="slow_gun"
    )
    monkeypatch.setattr(door, "try_import", lambda _: None)
    monkeypatch.setattr(door, "PLUGIN_OPEN_S", 0.05)
    with pytest.raises(PluginError, match=r"slow did not open '': TimeoutError: no answer within 0.05 s; it may be"):
        open_gun("slow")


CHATTY = """
import os
from device.simulated import SimulatedGun
print("said at import")
def open_gun(address, methods, clock):
    os.write(1, b"written by a library\\n")
    print("said when it was opened\\x1b[2J")
    return SimulatedGun(methods, clock)
"""


@pytest.mark.slow
def test_what_a_plug_in_prints_is_no_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, tmp_path, CHATTY, name="chatty", module="chatty_gun")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    words = [RECOIL, "doctor", "--gun", "chatty:", "--json"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    (gun,) = [one for one in json.loads(done.stdout)["checks"] if one["check"] == "gun"]
    assert "simulated" in gun["measured"], gun
    for said in ("said at import", "written by a library", "said when it was opened"):
        assert said in done.stderr


@pytest.mark.slow
def test_a_gun_that_does_not_open_is_said_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, tmp_path, "1 / 0\n", name="bad", module="bad_gun")
    (only,) = conformance(rig_at("bad:"))
    assert (only.check, only.kept) == ("opening", False)
    assert "ZeroDivisionError" in only.said


@pytest.mark.slow
def test_a_kit_that_is_broken_off_lets_go_of_its_gun_at_once_and_opens_no_other(sound_card: str) -> None:
    rig, guns, found = rig_at(sound_card, trials=10_000, speed=10.0), list[Gun](), list[ConformanceFinding]()

    def open_one() -> Gun:
        guns.append(rig.open_gun())
        return guns[-1]

    opened = OpenedGuns(open_one)
    kit = threading.Thread(target=lambda: conformance(replace(rig, open_gun=opened.open), found.append), daemon=True)
    kit.start()
    wait_for(lambda: guns and guns[-1].status().shots > 5)  # the trials have begun
    gun = guns[-1]
    opened.let_go()
    with pytest.raises(LinkError, match="closed"):
        gun.arm()
    kit.join(PATIENCE_S)
    assert not kit.is_alive()
    assert [one.kept for one in found[-4:]] == [False] * 4
    assert all("broken off" in one.said for one in found[-3:])


class DeadGun(SimulatedGun):
    """One that cannot be disarmed any more."""

    def close(self) -> None:
        super().close()
        raise LinkError("the gun does not answer")


def test_a_gun_that_could_not_be_let_go_of_stays_named_and_no_other_is_opened() -> None:
    made: list[Gun] = []

    def open_one() -> Gun:
        if made:
            raise LinkError("the port is gone")
        made.append(DeadGun(paper_methods(), lambda: 0.0))
        return made[-1]

    guns = OpenedGuns(open_one)
    guns.open()
    guns.let_go()
    with pytest.raises(LinkError, match="broken off"):
        guns.open()
    assert guns.problem == "the gun does not answer: switch off its power"
    assert len(made) == 1


NOTES = """
import time
from device import LinkError
from device.simulated import SimulatedGun
class Noting(SimulatedGun):
    deaf = slow = stuck = False
    def arm(self): note("arm"); super().arm()
    def fire(self, shot, at_s=None): note("fire"); return super().fire(shot, at_s)
    def disarm(self):
        note("disarm")
        if self.deaf and self.status().shots: time.sleep(60)
        if self.slow: time.sleep(1)
        if self.stuck and self.status().shots: raise LinkError("the relay sticks")
        super().disarm()
        note("disarmed")
    def close(self): note("close"); super().close()
class Remote(Noting):
    def __getattribute__(self, name):
        if name == "fire": note("looked-up"); time.sleep(1)
        return super().__getattribute__(name)
def note(what):
    with open("heard.txt", "a") as file: file.write(what + "\\n")
def open_gun(address, methods, clock):
    gun = (Remote if address == "remote" else Noting)(methods, clock)
    gun.deaf, gun.slow, gun.stuck = address == "deaf", address == "slow", address == "stuck"
    if gun.slow or address == "remote" or address.isdigit(): gun.arm()
    if address.isdigit(): time.sleep(int(address))
    return gun
"""


TELLING = """
from device.simulated import SimulatedGun
class Telling(SimulatedGun):
    def fire(self, shot, at_s=None):
        with open("fired.txt", "a") as file: file.write(f"{shot.method} {shot.drive.voltage_V:g} V\\n")
        return super().fire(shot, at_s)
def open_gun(address, methods, clock):
    return Telling(methods, clock)
"""


@pytest.mark.slow
def test_a_doctor_fires_the_methods_of_the_gun_that_it_is_given_and_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(monkeypatch, tmp_path, TELLING, name="telling", module="telling_gun")
    monkeypatch.chdir(tmp_path)
    methods = {"gentle": GunParameters(voltage_V=12.0)}
    looks = {one.name: one for one in checks.checks(tmp_path, "telling:", 0.1, shots=3, methods=methods)}
    (found,) = looks["shots"].look()
    assert found.verdict == "good", found.measured
    assert set((tmp_path / "fired.txt").read_text().splitlines()) == {"gentle 12 V"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Interrupted:
    """How it ended, what it wrote on its two streams, and what the gun heard."""

    code: int
    shown: str
    said: str
    heard: list[str]


RUN = "run direction --participant P01 --screen synthetic --results results"


def interrupted(
    patch: pytest.MonkeyPatch,
    folder: Path,
    rest: str,
    command: str = "doctor --fire 1000",
    *,
    word: str,
    times: int = 1,
    presses: int = 1,
) -> Interrupted:
    """A command that is interrupted so often once its gun has heard a word so many times."""
    install(patch, folder, NOTES, name="notes", module="noting_gun")
    patch.setenv("PYTHONPATH", str(folder))
    heard, words = folder / "heard.txt", [RECOIL, *command.split(), "--gun", f"notes:{rest}"]
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        wait_for(lambda: heard.exists() and heard.read_text().split().count(word) >= times)
        for _ in range(presses):
            program.send_signal(signal.SIGINT)
            time.sleep(0.1)
        shown, said = program.communicate(timeout=PATIENCE_S)
    return Interrupted(code=program.returncode, shown=shown, said=said, heard=heard.read_text().split())


@pytest.mark.slow
def test_an_interrupted_doctor_fires_no_more_and_leaves_no_gun_armed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    doctor = interrupted(monkeypatch, tmp_path, "", word="fire", times=6)
    assert (doctor.code, doctor.said.count("interrupted")) == (130, 1)
    told = doctor.heard
    last_fire = len(told) - 1 - told[::-1].index("fire")
    assert {"disarm", "close"} <= set(told[last_fire:])
    assert "arm" not in told[len(told) - 1 - told[::-1].index("disarm") :]


@pytest.mark.slow
def test_a_doctor_that_is_interrupted_again_and_again_says_that_its_gun_may_be_armed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    doctor = interrupted(monkeypatch, tmp_path, "deaf", word="fire", presses=3)
    assert doctor.code == 2
    assert "switch off its power" in doctor.said
    assert "Traceback" not in doctor.said


@pytest.mark.slow
def test_a_doctor_that_is_interrupted_while_it_refuses_an_armed_gun_disarms_and_closes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    doctor = interrupted(monkeypatch, tmp_path, "slow", word="disarm", presses=2)
    assert "close" in doctor.heard
    assert "disarmed" in doctor.heard or "switch off its power" in doctor.said  # on a machine too busy to wait for it
    assert "Traceback" not in doctor.said


@pytest.mark.slow
@pytest.mark.parametrize("opens_s", [1, 600])
def test_a_gun_whose_opening_is_interrupted_is_disarmed_or_named(
    opens_s: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = interrupted(monkeypatch, tmp_path, str(opens_s), RUN, word="arm", presses=2)
    disarmed, named = "disarmed" in run.heard, "switch off its power" in run.said
    assert disarmed or named
    assert named or opens_s == 1
    assert "Traceback" not in run.said


@pytest.mark.slow
@pytest.mark.parametrize("command", [RUN, "doctor"])
def test_a_gun_that_is_interrupted_between_its_opening_and_its_guard_is_disarmed(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = interrupted(monkeypatch, tmp_path, "remote", command, word="looked-up")
    assert "disarmed" in ended.heard or "switch off its power" in ended.said
    assert "Traceback" not in ended.said


@pytest.mark.slow
def test_a_doctor_that_cannot_disarm_its_gun_says_so_whatever_else_it_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = f"doctor --fire 5 --out {tmp_path / 'found.json'} --json"
    doctor = interrupted(monkeypatch, tmp_path, "stuck", words, word="fire", presses=0)
    assert doctor.code == 2
    assert "relay sticks" in doctor.said
    assert "switch off its power" in doctor.said
    assert "Traceback" not in doctor.said
    found = json.loads(doctor.shown)
    assert [one["check"] for one in found["checks"]] == ["machine", "clock", "disk", "gun", "shots"]
    assert found["checks"][-1]["verdict"] == found["verdict"] == "fails"
    assert found["left_armed"] in doctor.said
    assert json.loads((tmp_path / "found.json").read_text()) == found


@pytest.mark.slow
def test_a_check_whose_time_is_over_and_whose_gun_cannot_be_disarmed_ends_all_checks(tmp_path, monkeypatch):
    more = "disarm = lambda self: 1 / 0; status = lambda self: __import__('time').sleep(3)"
    install(monkeypatch, tmp_path, GUN.format(more=more, made="Gun()"), name="dead", module="dead_gun")
    monkeypatch.setattr(door, "try_import", lambda _: None)
    monkeypatch.setattr(checks, "DEADLINE_S", 0.2 - checks.IMPORT_S - checks.PLUGIN_OPEN_S)
    (gun,) = (one for one in checks.checks(tmp_path, "dead:", 0.1) if one.name == "gun")
    with pytest.raises(checks.GunLeftArmed, match=r"--gun dead:: did not end within 0.2 s; .*switch off its power"):
        checks.carry_out_check(gun)


# what the guard believes, and what it lets through


class Liar(SimulatedGun):
    """A gun that does not do as it says, in one way; it notes what it hears, and knows no limit at all."""

    def __init__(self, clock: Any, **lie: Any) -> None:
        super().__init__(paper_methods(), clock)
        self.lie, self.heard, self.is_armed = lie, list[Shot](), False

    def arm(self) -> None:
        self.is_armed = True

    def disarm(self) -> None:
        self.lie.get("disarms", lambda: None)()
        self.is_armed = self.lie.get("stays_armed", False)

    def close(self) -> None:
        self.lie.get("closes", lambda: None)()

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self.heard.append(shot)
        if "acts" in self.lie:
            return self.lie["acts"]()
        start_s = self._clock() if at_s is None else at_s
        true = ShotReport(
            shot=shot,
            requested_s=start_s,
            pulse_start_s=start_s,
            pulse_end_s=start_s + 0.01,
            home_predicted_s=start_s + 0.3,
            motion="home",
        )
        return replace(true, **self.lie.get("report", {}))

    def status(self) -> GunStatus:
        state = "armed" if self.is_armed else "disarmed"
        true = GunStatus(state=state, shots=len(self.heard), coil_temperature_C=25.0, ready_at_s=0.0)
        return replace(true, **self.lie.get("status", {}))


def timing(**lie: Any) -> ShotTiming:
    """How a shot at 100 s came about, told truly but for a lie."""
    true: dict[str, Any] = dict.fromkeys(("requested_s", "written_s", "accepted_s", "pulse_start_s"), 100.0)
    true |= {"pulse_end_s": 100.01, "acknowledged_s": 100.02, "uncertainty_s": 0.001, "gun_count": 1, "asked": 1}
    true |= dict.fromkeys(("gun_accepted_us", "gun_start_us", "gun_end_us"), 5)
    return ShotTiming(**true | lie)


@pytest.fixture
def clock():
    clock = StillClock()
    clock.wait(100.0)
    return clock


def guarded(clock: Any, **lie: Any) -> tuple[GuardedGun, Liar]:
    liar = Liar(clock, **lie)
    gun = GuardedGun("liar", liar, paper_methods(), clock)
    gun.arm()
    return gun, liar


@pytest.mark.parametrize(
    ("report", "said"),
    [
        ({"pulse_end_s": 100.05}, "it reports a drive of 0.050000 s; ordered was 0.010000 s"),
        ({"pulse_end_s": 100.001}, "it reports a drive of 0.001000 s"),
        ({"pulse_start_s": 40.0, "pulse_end_s": 40.01}, "it reports an onset at 40.000000 s"),
        ({"pulse_start_s": 9e15, "pulse_end_s": 9e15}, "it reports an onset at 9"),
        ({"pulse_start_s": float("nan")}, "they must be finite"),
        ({"home_predicted_s": 99.0}, "it is home at 99.000000 s, before its drive ends"),
        ({"motion": None}, "its motion is None"),
        ({"motion": "up\ndown"}, "it must be a line of text"),
        ({"motion": "m" * 100_000}, "it must be a line of text"),
        ({"home_predicted_s": 1e9}, r"it is home 1e\+09 s later; at most 60 s"),
        ({"timing": "soon"}, "its timing is 'soon'; it must be a ShotTiming, or None"),
        ({"timing": timing(gun_start_us=100e6)}, "its timing.gun_start_us is 100000000.0; it must be a whole number"),
        ({"timing": timing(gun_count=None)}, "its timing.gun_count is None"),
        ({"timing": timing(gun_count=-5)}, "its timing.gun_count is -5"),
        ({"timing": timing(written_s=float("nan"))}, "its timing.written_s is nan; it must be finite"),
        ({"timing": timing(uncertainty_s=-99.0)}, "its timing.uncertainty_s is -99; it must lie between 0 and 1"),
        ({"timing": timing(pulse_start_s=-900.0)}, "its timing.pulse_start_s is -900.000000 s; its report has 100"),
        ({"shot": a_shot("vibration")}, "ordered was Shot"),
    ],
)
def test_a_report_that_cannot_be_is_not_believed_and_the_gun_is_disarmed(clock, report, said):
    gun, liar = guarded(clock, report=report)
    with pytest.raises(LinkError, match=f"gun plug-in liar: .*{said}.*does not count"):
        gun.fire(a_shot())
    assert not liar.is_armed
    gun.arm()
    with pytest.raises(LimitError, match="not home yet"):  # it may have been fired
        gun.fire(a_shot())


def test_a_report_is_written_in_plain_numbers_whatever_the_plug_in_made_it_of(clock):
    told = timing(gun_count=np.int64(3), gun_start_us=np.int64(7), pulse_start_s=np.float32(100.0))
    odd = {"timing": told, "pulse_start_s": Fraction(100), "pulse_end_s": np.longdouble("100.01")}
    gun, _ = guarded(clock, report=odd)
    report = gun.fire(a_shot())
    numbers = [report.pulse_start_s, report.pulse_end_s, *astuple(report.timing)]
    assert {type(one) for one in numbers} == {float, int}
    assert report.timing.gun_count == 3
    json.dumps(numbers, allow_nan=False)


class Mute:
    """An object whose own code breaks off."""

    def __repr__(self) -> str:
        raise RuntimeError("repr")


def test_an_object_that_cannot_be_shown_is_told_of_with_the_plug_ins_name(clock):
    gun, liar = guarded(clock, acts=Mute)
    with pytest.raises(PluginError, match=r"gun plug-in liar says what cannot be read .*repr"):
        gun.fire(a_shot())
    assert not liar.is_armed


@pytest.mark.parametrize("acts", [lambda: None, lambda: 1 / 0, lambda: (_ for _ in ()).throw(SystemExit(3))])
def test_a_plug_in_that_breaks_off_is_a_link_that_failed(clock, acts):
    gun, liar = guarded(clock, acts=acts)
    with pytest.raises(PluginError, match="gun plug-in liar"):
        gun.fire(a_shot())
    assert not liar.is_armed


@pytest.mark.slow
def test_a_signal_that_another_thread_takes_wakes_who_waits_for_a_plug_in():
    with stolen_signal(), pytest.raises(Told):
        interrupts.answer_within(PATIENCE_S, threading.Event().wait)


def test_a_plug_in_that_is_silent_is_asked_no_more_but_still_disarmed(clock, monkeypatch):
    monkeypatch.setattr(guard, "ANSWER_S", 0.05)
    gun, liar = guarded(clock, acts=threading.Event().wait)
    with pytest.raises(PluginError, match="liar"):
        gun.fire(a_shot())
    assert not liar.is_armed
    with pytest.raises(PluginError, match="never answered fire"):
        gun.arm()


def test_what_is_beyond_a_limit_is_never_heard_by_the_plug_in(clock):
    gun, liar = guarded(clock)
    forged = Pulse(voltage_V=1.0, pulse_s=0.01)
    object.__setattr__(forged, "voltage_V", 30.0)
    for shot in (a_shot(drive=forged), a_shot("recoil"), a_shot("vibration"), "bang"):
        with pytest.raises(LimitError):
            gun.fire(shot)
    assert liar.heard == []
    for _ in range(300):
        gun.fire(a_shot("asymmetric-1"))
        with pytest.raises(LimitError, match=r"not home yet|300 shots"):
            gun.fire(a_shot("asymmetric-1"))
        clock.wait(0.1999)
    with pytest.raises(LimitError, match="300 shots in a minute"):
        gun.fire(a_shot("asymmetric-1"))
    assert len(liar.heard) == 300


def test_after_a_disarming_a_plug_in_that_heeds_none_hears_of_no_shot_not_even_of_one_that_waits():
    gun, liar = guarded(time.monotonic, stays_armed=False)
    ended = list[Exception]()

    def wait_for_its_time() -> None:
        try:
            gun.fire(a_shot(), time.monotonic() + 1.9)
        except LimitError as error:
            ended.append(error)

    waiting = threading.Thread(target=wait_for_its_time)
    waiting.start()
    gun.disarm()
    waiting.join()
    for _ in range(20):
        with pytest.raises(LimitError, match="disarmed"):
            gun.fire(a_shot())
    assert (len(ended), liar.heard) == (1, [])


def test_a_plug_in_that_stays_armed_is_told_of(clock):
    gun, _ = guarded(clock, stays_armed=True)
    with pytest.raises(PluginError, match="says that it is armed after it was disarmed; switch off its power"):
        gun.disarm()
    assert gun.status().state == "fault"


def test_a_plug_in_that_is_born_armed_is_refused(clock):
    with pytest.raises(PluginError, match="is armed when it is opened; a gun is born disarmed"):
        GuardedGun("eager", Liar(clock, status={"state": "armed"}), paper_methods(), clock)


def test_a_plug_in_that_is_born_armed_is_disarmed_and_one_that_cannot_be_let_go_of_is_told_of(clock):
    calls = list[str]()
    eager = Liar(clock, disarms=lambda: calls.append("disarm"), closes=lambda: calls.append("close"))
    eager.is_armed = True
    with pytest.raises(PluginError, match=r"is armed when it is opened; a gun is born disarmed$"):
        GuardedGun("eager", eager, paper_methods(), clock)
    assert (calls, eager.is_armed) == (["disarm", "close"], False)
    stuck = Liar(clock, closes=lambda: 1 / 0)
    stuck.is_armed = True
    with pytest.raises(PluginError, match=r"when it is opened; .*not let go of \(.*broke off in close.*switch off"):
        GuardedGun("stuck", stuck, paper_methods(), clock)


class Hangups:
    """Interrupts again and again, from the thread of the plug-in, which then goes on for a while."""

    def __init__(self) -> None:
        self.pressing = threading.Lock()

    def press(self, *_: object) -> None:
        with self.pressing:
            for _ in range(3):
                os.kill(os.getpid(), signal.SIGHUP)
                time.sleep(0.1)


@pytest.fixture
def hangups() -> Iterator[Hangups]:
    def tell(*_: object) -> None:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        raise KeyboardInterrupt

    pressed, before = Hangups(), signal.signal(signal.SIGHUP, tell)
    yield pressed
    with pressed.pressing:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.slow
def test_no_interrupt_keeps_a_gun_from_being_disarmed_and_closed(clock, hangups):
    closed = threading.Event()
    gun, liar = guarded(clock, disarms=hangups.press, closes=closed.set)
    with pytest.raises(KeyboardInterrupt):
        gun.close()
    assert closed.is_set()
    assert not liar.is_armed


@pytest.mark.slow
def test_a_gun_that_is_not_disarmed_is_told_of_whatever_interrupts(clock, hangups):
    gun, _ = guarded(clock, disarms=hangups.press, stays_armed=True)
    with pytest.raises(PluginError, match="is armed after it was disarmed; switch off its power"):
        gun.close()
    with pytest.raises(PluginError, match="was not disarmed and closed"):
        gun.status()  # which a window shows


@pytest.mark.slow
def test_who_closes_a_gun_that_another_is_closing_learns_what_became_of_it(clock, monkeypatch):
    monkeypatch.setattr(guard, "DISARM_S", 0.3)
    begun, on = threading.Event(), threading.Event()
    gun, _ = guarded(clock, disarms=lambda: (begun.set(), on.wait(PATIENCE_S)))
    closing: Future[None] = Future()
    interrupts.begin_aside(closing, gun.close, "closing")
    begun.wait(PATIENCE_S)
    with pytest.raises(PluginError, match=r"gun plug-in liar .*was not disarmed and closed"):
        gun.close()
    assert isinstance(closing.exception(PATIENCE_S), PluginError)
    on.set()


@pytest.mark.slow
def test_an_interrupt_while_a_plug_in_is_first_asked_leaves_it_disarmed(clock, hangups):
    liar, first = Liar(clock), iter([hangups.press])
    liar.is_armed = True
    liar.status = lambda: (next(first, time.monotonic)(), Liar.status(liar))[1]  # type: ignore[assignment, method-assign]
    with pytest.raises(KeyboardInterrupt):
        GuardedGun("liar", liar, paper_methods(), clock)
    assert not liar.is_armed


@pytest.mark.parametrize(
    ("status", "said"),
    [
        ({"state": "ready"}, "state 'ready'"),
        ({"shots": 1.5}, "shots 1.5"),
        ({"coil_temperature_C": float("nan")}, "coil_temperature_C nan"),
        ({"ready_at_s": 1e9}, "ready_at_s 1000000000.0; it must be at most 60 s ahead"),
    ],
)
def test_a_status_that_cannot_be_is_refused_with_its_field(clock, status, said):
    with pytest.raises(PluginError, match=said):
        GuardedGun("liar", Liar(clock, status=status), paper_methods(), clock)


def test_a_plug_in_is_never_readier_than_the_model(clock):
    gun, _ = guarded(clock, report={"home_predicted_s": 100.02})
    home_s = gun.fire(a_shot()).home_predicted_s
    assert [home_s, gun.status().ready_at_s] == pytest.approx([100.211, 100.211], abs=1e-5)  # as of a simulated gun


@pytest.mark.parametrize(
    ("lie", "check"),
    [
        ({"report": {"pulse_end_s": 0.05}}, "trials"),
        ({"stays_armed": True}, "trials"),
        ({}, "limits"),
        ({"status": {"state": "armed"}}, "birth"),
    ],
)
def test_the_kit_finds_a_gun_that_lies_where_no_guard_stands(lie, check):
    clock = StillClock()
    rig = ConformanceRig(
        open_gun=lambda: Liar(clock, **lie), clock=clock, wait=clock.wait, methods=paper_methods(), trials=2
    )
    assert [one.check for one in conformance(rig) if not one.kept and one.check == check] == [check]
    assert set(GUN_CHECKS) >= {check}


# a run


@pytest.mark.slow
def test_a_run_is_carried_out_on_a_plug_in(tmp_path: Path, sound_card: str) -> None:
    """On a clock that goes fifty times faster: nobody is to wait for the breaks."""
    request = runs.RunRequest(setup=load_setup("preference"), participant_id="P01", results=tmp_path, gun=sound_card)
    finished = runs.run(request, synthetic_screen, RealClock(50.0))
    journal = read_journal(finished.place.journal)
    assert journal.finished
    assert "sound-card:null" in finished.place.journal.read_text()


@pytest.mark.slow
def test_a_plug_in_that_cannot_be_closed_leaves_a_finished_run_and_says_to_switch_off_its_power(
    tmp_path: Path, sound_card: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sound_card_gun

    def jammed(_: object) -> None:
        raise OSError("the card is jammed")

    monkeypatch.setattr(sound_card_gun.SoundCardGun, "close", jammed)
    request = runs.RunRequest(setup=load_setup("preference"), participant_id="P01", results=tmp_path, gun=sound_card)
    with pytest.raises(runs.GunNotClosed, match=r"run is finished .* \(.*card is jammed.*\): .* switch off its power"):
        runs.run(request, synthetic_screen, RealClock(50.0))
    assert read_journal(next(tmp_path.glob("sub-P01/*_journal.jsonl"))).finished


@pytest.mark.slow
@pytest.mark.parametrize(
    ("broken_off", "before", "last"),
    [(KeyboardInterrupt(), "", "stopped"), (JournalError("the disk is full"), "the disk is full; ", "step")],
)
def test_a_run_that_is_broken_off_says_that_its_gun_could_not_be_closed(  # noqa: PLR0917
    broken_off: BaseException,
    before: str,
    last: str,
    tmp_path: Path,
    sound_card: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import sound_card_gun

    def jammed(_: object) -> None:
        raise OSError("the card is jammed")

    def break_off(*_: object) -> None:
        raise broken_off

    monkeypatch.setattr(sound_card_gun.SoundCardGun, "close", jammed)
    monkeypatch.setattr(SyntheticScreen, "act", break_off)
    request = runs.RunRequest(setup=load_setup("preference"), participant_id="P01", results=tmp_path, gun=sound_card)
    with pytest.raises(RunStopped, match=rf"^{before}the gun did not close \(.*jammed\): switch off its power$"):
        runs.run(request, synthetic_screen, RealClock(50.0))
    assert read_journal(next(tmp_path.glob("sub-P01/*_journal.jsonl"))).records[-1].kind == last


@pytest.mark.slow
def test_a_plug_in_that_hangs_in_a_shot_stops_the_run_which_says_to_switch_off_its_power(
    tmp_path: Path, sound_card: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sound_card_gun

    monkeypatch.setattr(guard, "ANSWER_S", 0.3)
    monkeypatch.setattr(sound_card_gun.Null, "play", lambda *_: threading.Event().wait())
    request = runs.RunRequest(setup=load_setup("preference"), participant_id="P01", results=tmp_path, gun=sound_card)
    with pytest.raises(RunStopped, match=r"cannot be disarmed \(.* never answered fire.*\): switch off its power"):
        runs.run(request, synthetic_screen, RealClock(50.0))


@pytest.mark.slow
@pytest.mark.parametrize("heeds", [True, False], ids=["disarms", "plays-on"])
def test_the_stop_key_in_mid_pulse_of_a_plug_in_is_its_last_shot_until_a_test_shot(
    heeds: bool, tmp_path: Path, sound_card: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pressed while the third shot plays; a plug-in that plays on is disarmed by the guard all the same."""
    import sound_card_gun

    plays, screens = [], []
    play = sound_card_gun.Null.play

    def playing(self: Any, samples: Any, off: threading.Event) -> float:
        plays.append(len(samples))
        if len(plays) == 3:
            assert screens[0].live.offer(events.EmergencyStop())
        return play(self, samples, off if heeds else threading.Event())

    def make_screen(*of_run: Any) -> SyntheticScreen:
        screens.append(AtLive(*of_run))
        return screens[-1].screen

    monkeypatch.setattr(sound_card_gun.Null, "play", playing)
    request = runs.RunRequest(setup=load_setup("preference"), participant_id="P01", results=tmp_path, gun=sound_card)
    with pytest.raises(RunStopped, match=EMERGENCY):
        runs.run(request, make_screen, RealClock(50.0))
    assert len(plays) == 3
    (journal,) = tmp_path.glob("sub-P01/*_journal.jsonl")
    kinds = [body_kind(record) for record in read_journal(journal).records]
    assert kinds.count("train-shot") == 2
    assert "train-shot" not in kinds[kinds.index("halted") :]

    finished = runs.run(replace(request, again="resume"), make_screen, RealClock(50.0))
    kinds = [body_kind(record) for record in read_journal(finished.place.journal).records]
    after = kinds[kinds.index("halted") :]
    assert after.index("test-shot") < after.index("train-shot")
    assert len(plays) - 3 == after.count("test-shot") + after.count("train-shot")


class AtLive:
    """The synthetic participant's screen, and the live run that it was shown."""

    def __init__(self, *of_run: Any) -> None:
        self.screen = synthetic_screen(*of_run)
        self.live: Any = None
        self._begin = self.screen.begin
        self.screen.begin = self._shown  # type: ignore[method-assign]

    def _shown(self, live: Any) -> None:
        self.live = live
        self._begin(live)


def body_kind(record: Record) -> str:
    return str(record.body["kind"]) if isinstance(record.body, dict) else record.kind
