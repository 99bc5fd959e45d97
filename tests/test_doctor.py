"""The rig's self-test: its sums, its bounds, and the command where a display, a gun, a disk or a folder is missing."""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.report.serial import plain
from device import LinkError
from device.parameters import GunParameters
from device.plugin.conformance import ConformanceFinding
from device.serial_gun.lines import IN_USE
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.config.setup import sha256
from experiments.design.plan import Trial, condition
from experiments.doctor import verdicts
from experiments.doctor.checks import (
    APPENDS,
    Check,
    adapters,
    appends,
    carry_out_check,
    checks,
    ticks,
    within_seconds,
)
from experiments.doctor.child import ProgramReply, cause, run_child
from experiments.doctor.figures import (
    Adapter,
    Appends,
    Display,
    DoctorFinding,
    DoctorVerdict,
    GunLine,
    Keys,
    Machine,
    MarkerStream,
    Percentiles,
    PsychoPyStage,
    SensorFigures,
    Sound,
    Ticks,
    percentile,
    spread,
)
from experiments.doctor.verdicts import Latencies, latencies, pooled
from experiments.load import find, load_gun
from experiments.record.journal import Journal, Record
from experiments.screens.display import no_display
from experiments.session.steps import (
    Answered,
    Fired,
    FireShot,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Presented,
    Step,
    step_record,
)
from experiments.study.folders import PlaceError
from recoil.rig import examination_text
from tests.asked import ask
from tests.conftest import RECOIL, Recoil
from tests.kills import can_mount, in_small_disk
from tests.waiting import PATIENCE_S
from tests.warm_start import warm

pytestmark = pytest.mark.slow

milliseconds = st.floats(min_value=0, max_value=1e4)

FAST = Percentiles(n=200, median=0.2, p95=0.3, p99=0.4, worst=0.5)
SLOW = Percentiles(n=25, median=190.0, p95=210.0, p99=220.0, worst=230.0)


# sums


@given(st.lists(milliseconds, min_size=1), st.integers(1, 100))
def test_a_percentile_is_that_of_numpys_inverted_distribution_function(values: list[float], percent: int) -> None:
    assert percentile(values, percent) == np.percentile(values, percent, method="inverted_cdf")


@given(st.lists(milliseconds, min_size=1))
def test_a_spread_goes_from_the_middle_to_the_worst_and_all_of_it_was_measured(values: list[float]) -> None:
    found = spread(values)
    assert found.n == len(values)
    assert found.median <= found.p95 <= found.p99 <= found.worst == max(values)
    assert {found.median, found.p95, found.p99} <= set(values)


@pytest.mark.parametrize(("values", "percent"), [([], 50), ([1.0], 0), ([1.0], 101), ([1.0], math.nan)])
def test_no_percentile_of_nothing_and_none_beyond_a_hundred(values: list[float], percent: float) -> None:
    with pytest.raises(ValueError, match="percentile"):
        percentile(values, percent)


# console latencies


TRIAL = Trial(session=1, set=1, trial=1, levels=condition(method="vibration", direction="forward"))
FIRED = Fired(
    gun="a", onset_utc="", requested_s=0.0, pulse_start_s=0.0, pulse_end_s=0.0, home_predicted_s=0.0, motion="home"
)
ANSWERED = Answered(value="forward", by="experimenter", response_time_s=1.5, response_time_valid=False)
ASK = ask(TRIAL)
HEAD = Record(n=0, kind="run", utc="", monotonic_s=0.0, clock="real")


def line(kind: Any, word: Step | Outcome | None = None, *, at_s: float = 0.0, **more: Any) -> Record:
    return Record(n=1, kind=kind, utc="", monotonic_s=at_s, body=word and step_record(word), **more)


def recorded(trials: list[tuple[float, float]]) -> list[Record]:
    """The records of trials at a console, one every 10 s: how long a paint took, and how long a key to the disk."""
    records = [HEAD]
    for number, (paint_ms, key_ms) in enumerate(trials):
        start_s = 10.0 * number
        done: list[tuple[Step, Outcome, float, float]] = [
            (Prepare(trial=TRIAL, attempt=1), Prepared(), start_s, start_s + paint_ms / 1000),
            (
                FireShot(trial=TRIAL, attempt=1),
                replace(FIRED, pulse_start_s=start_s + 2),
                start_s + 1.9,
                start_s + 0.02,
            ),
            (ASK, ANSWERED, start_s + 2.1, start_s + 2.1 + paint_ms / 1000),
        ]
        for step, outcome, at_s, shown_s in done:
            records += [line("step", step, at_s=at_s), line("outcome", outcome, shown_s=shown_s)]
        records.append(line("remark", synced_s=start_s + 3.5 + key_ms / 1000))
    return records


@given(st.lists(st.tuples(milliseconds, milliseconds), max_size=20))
def test_what_the_console_took_is_read_back_from_the_records(trials: list[tuple[float, float]]) -> None:
    found = latencies(recorded(trials))
    paints = [paint for paint, _ in trials for _ in ("prepare", "ask")]
    assert found.trials == len(trials)
    assert found.step_to_screen_ms == pytest.approx(paints, abs=1e-6)
    assert found.key_to_disk_ms == pytest.approx([key for _, key in trials], abs=1e-6)


@pytest.mark.parametrize("left_out", ["shown_s", "clock"])
def test_a_run_without_a_console_or_on_a_virtual_clock_tells_nothing(left_out: str) -> None:
    records = recorded([(20, 3)])
    if left_out == "shown_s":
        records = [replace(one, shown_s=None) for one in records]
    else:
        records[0] = replace(HEAD, clock="virtual")
    assert latencies(records) == Latencies()
    assert latencies([]) == Latencies()


def test_a_step_or_shot_before_a_crash_is_not_paired_with_an_outcome_after_it() -> None:
    resumed = line("resumed", at_s=1e6, clock="real")
    records = recorded([(20, 3)])
    for place in (2, 6):  # between a step and its outcome; between shot and answer
        assert latencies([*records[:place], resumed, *records[place:]]).trials == 1
    assert len(latencies([*records[:2], resumed, *records[2:]]).step_to_screen_ms) == 1
    assert latencies([*records[:6], resumed, *records[6:]]).key_to_disk_ms == ()


def test_a_presentation_is_left_out_since_every_shot_paints_it_anew() -> None:
    presented = Presented(gun="a", onset_utc="", shots=1, exposure_s=1.0, ended_by="next")
    present = Present(trial=TRIAL, attempt=1, repeat_every_s=1.0, max_shots=9, least_exposure_s=1.0)
    records = [HEAD, line("step", present, at_s=1.0), line("outcome", presented, shown_s=9.0, synced_s=1.1)]
    assert latencies(records) == Latencies()


def test_latencies_of_several_journals_are_counted_together() -> None:
    found = pooled(latencies(recorded([(paint, 1.0)])) for paint in (10.0, 20.0))
    assert (found.trials, len(found.step_to_screen_ms), len(found.key_to_disk_ms)) == (2, 4, 2)
    assert pooled([]) == Latencies()


# verdicts

SENSOR = SensorFigures(sensor="csv:x", rate_Hz=3200.0, noise_m_s2=0.05, shots_to_see=1.0)
STREAMS = MarkerStream(version="1.18", sent=2, to_reader_ms=[0.1, 0.2])
MACHINE = Machine(system="Linux", python="3.11.7", cores=2, versions={"numpy": "2.4", "psychopy": "2026.2.5"})
TICKS = Ticks(resolution_s=1e-9, smallest_step_s=4e-8, oversleep_ms=FAST)
DISK = Appends(append_ms=FAST, free_bytes=10**10)
LINK = GunLine(gun="RG-1:7", state="disarmed", fault=None, round_trip_ms=FAST)
TWICE = replace(LINK, state="fault", fault="coil open", clock_jumps=2)
BROKEN = ConformanceFinding(check="trials", kept=False, said="a pulse of 0.01 s lasted 0.02 s")
ADAPTER = Adapter(name="ttyUSB0", setting="sys/ttyUSB0/latency_timer", latency_ms=1)
DISPLAY = Display(platform="xcb", width_px=1280, height_px=800, refresh_Hz=60.0, opened_ms=20.0)
STAGE = PsychoPyStage(version="2026.2.5", import_s=8.0, opened_s=0.6, frames_Hz=444.0)
SOUND = Sound(outputs=["Headphones"], default="Headphones")
KEYS = Keys(injected=2, to_event_ms=[0.4, 0.5], to_painted_ms=[0.8, 0.9])


@pytest.mark.parametrize(
    ("finding", "verdict", "advice"),
    [
        (verdicts.of_machine(MACHINE), "good", ""),
        (verdicts.of_machine(replace(MACHINE, versions={"PyQt6": None})), "warning", "PyQt6 not found; install"),
        (verdicts.of_clock(TICKS), "good", ""),
        (verdicts.of_clock(replace(TICKS, smallest_step_s=0.0156)), "warning", "coarser than 1 ms"),
        (verdicts.of_clock(replace(TICKS, oversleep_ms=SLOW)), "warning", "close other programs"),
        (verdicts.of_disk(DISK), "good", ""),
        (verdicts.of_disk(replace(DISK, append_ms=SLOW)), "warning", "local disk"),
        (verdicts.of_disk(replace(DISK, free_bytes=10**6)), "warning", "make room"),
        (verdicts.of_disk_failure("results", "Read-only file system"), "fails", "--results"),
        (verdicts.of_link(LINK, 0.010), "good", ""),
        (verdicts.of_link(LINK, 0.0002), "warning", "above the limit of 0.2 ms"),
        (verdicts.of_link(replace(LINK, round_trip_ms=SLOW), 0.010), "warning", "latency timer"),
        (verdicts.of_link(replace(LINK, round_trip_ms=SLOW), 0.5), "good", ""),
        (verdicts.of_link(replace(LINK, state="armed"), 0.010), "fails", "switch off"),
        (verdicts.of_link(replace(LINK, fault="coil open"), 0.010), "fails", "switch off"),
        (verdicts.of_link(replace(LINK, clock_jumps=1), 0.010), "good", ""),
        (verdicts.of_link(replace(LINK, clock_jumps=2), 0.010), "fails", "leave ?speed out"),
        (verdicts.of_link(TWICE, 0.010), "fails", "anybody holds it; its clock does not go as the address says"),
        (verdicts.not_fired(), "fails", "see to what “gun” says"),
        (verdicts.of_conformance([BROKEN]), "fails", "nobody may hold this gun"),
        (verdicts.of_link_failure("no answer"), "fails", "cable"),
        (verdicts.of_link_failure(f"cannot open /dev/gun: {IN_USE}"), "fails", "close what has it open"),
        (verdicts.of_wrong_version("speaks version 3"), "fails", "its firmware is that of this Recoil"),
        (verdicts.of_failure("gun", "gun plug-in bad: its import failed"), "fails", "uninstall it"),
        (verdicts.of_sensor(SENSOR), "good", ""),
        (verdicts.of_sensor(replace(SENSOR, shots_to_see=3.1)), "warning", "less noise"),
        (verdicts.of_sensor(replace(SENSOR, noise_m_s2=0.0)), "fails", "its value never changes"),
        (verdicts.of_adapters([]), "not there", "nothing"),
        (verdicts.of_adapters([ADAPTER]), "good", ""),
        (
            verdicts.of_adapters([replace(ADAPTER, latency_ms=16)]),
            "warning",
            "echo 1 | sudo tee sys/ttyUSB0/latency_timer",
        ),
        (verdicts.of_display(DISPLAY), "good", ""),
        (verdicts.of_display(replace(DISPLAY, opened_ms=None)), "fails", "look again"),
        (verdicts.of_display(replace(DISPLAY, height_px=600)), "warning", "larger"),
        (verdicts.of_display(replace(DISPLAY, platform="offscreen")), "warning", "QT_QPA_PLATFORM"),
        (verdicts.of_stage(STAGE), "good", ""),
        (verdicts.of_stage(replace(STAGE, frames_Hz=3.0)), "good", ""),
        (verdicts.of_sound(SOUND), "good", ""),
        (verdicts.of_sound(replace(SOUND, default="")), "warning", "choose one"),
        (verdicts.of_sound(Sound(outputs=[], default="")), "not there", "stay silent: connect"),
        (verdicts.of_keys(KEYS), "good", ""),
        (verdicts.of_keys(replace(KEYS, injected=30)), "warning", "some keys went elsewhere"),
        (verdicts.of_keys(replace(KEYS, to_event_ms=[0.4, 40.0])), "warning", "more than 10 ms"),
        (verdicts.of_keys(Keys(injected=30, to_event_ms=[], to_painted_ms=[])), "warning", "in front"),
        (verdicts.of_streams(STREAMS), "good", ""),
        (verdicts.of_streams(replace(STREAMS, to_reader_ms=[0.1])), "warning", "multicast"),
        (verdicts.of_streams(replace(STREAMS, sent=0, to_reader_ms=[])), "warning", "multicast"),
        (verdicts.no_streams("pylsl is not installed"), "not there", "the extra `lsl`"),
        (verdicts.of_absent("display", "neither is set"), "not there", "DISPLAY"),
        (verdicts.of_absent("PsychoPy", "psychopy is not installed"), "not there", "make full"),
        (verdicts.of_failure("display", "was killed by signal 6"), "fails", "libxcb-icccm4"),
        (verdicts.of_failure("clock", "did not end within 20 s"), "fails", "look again"),
    ],
)
def test_every_figure_has_its_verdict_and_all_but_good_ones_advice(
    finding: DoctorFinding, verdict: str, advice: str
) -> None:
    assert finding.verdict == verdict
    assert advice in finding.advice
    assert bool(finding.advice) == (verdict != "good")
    json.dumps(plain(finding.figures), allow_nan=False)


@pytest.mark.parametrize(("slowest", "verdict"), [(50.0, "good"), (50.1, "warning")])
def test_a_console_is_good_up_to_its_bounds(slowest: float, verdict: str) -> None:
    found = Latencies(step_to_screen_ms=(slowest,), key_to_disk_ms=(slowest / 5,), trials=1)
    assert [finding.verdict for finding in verdicts.of_latencies(found)] == [verdict, verdict]


def test_without_console_runs_it_says_so() -> None:
    assert {finding.measured for finding in verdicts.of_latencies(Latencies())} == {"no console runs here"}


@given(st.lists(st.sampled_from(get_args(DoctorVerdict))))
def test_the_worst_verdict_counts_and_what_is_not_there_does_no_harm(found: list[Any]) -> None:
    there = [("good", "warning", "fails").index(verdict) for verdict in found if verdict != "not there"]
    assert verdicts.overall(found) == ("good", "warning", "fails")[max(there, default=0)]


@pytest.mark.parametrize(
    ("environment", "platform", "missing"),
    [
        ({}, "linux", True),
        ({"DISPLAY": ""}, "linux", True),
        ({"DISPLAY": ":nowhere"}, "linux", True),
        ({"DISPLAY": ":65432"}, "linux", True),
        ({"QT_QPA_PLATFORM": "xcb"}, "linux", True),
        ({"QT_QPA_PLATFORM": "offscreen"}, "linux", False),
        ({"WAYLAND_DISPLAY": "wayland-0"}, "linux", False),
        ({}, "darwin", False),
        ({}, "win32", False),
    ],
)
def test_a_display_is_asked_for_on_linux_before_a_window_is_tried(
    environment: dict[str, str], platform: str, missing: bool
) -> None:
    assert bool(no_display(environment, platform)) == missing


def test_a_dead_child_is_explained_by_the_library_it_missed_or_by_its_first_words() -> None:
    search = 'qt.core.plugin.factoryloader: looking at "libqxcb.so"\n'
    lacking = f"{search}cannot load: libxcb-icccm.so.4: cannot open shared object file: No such file\nqt.qpa: sorry\n"
    assert cause(lacking) == "libxcb-icccm.so.4: cannot open shared object file"
    assert cause(f"{search}\nqt.qpa.xcb: could not connect to display :9\nmore\n").endswith("display :9")
    assert cause("") == "it said nothing"


def test_the_table_shows_names_in_brackets_as_they_are() -> None:
    text = examination_text((DoctorFinding(check="sound", verdict="good", measured="[red]Headphones[/red]"),))
    assert "[red]Headphones[/red]" in text


# measuring


def test_the_clock_of_this_machine_has_steps_and_sleeps_overrun() -> None:
    found = ticks()
    assert 0 < found.smallest_step_s < 1
    assert found.oversleep_ms.worst > 0


def test_appending_measures_and_leaves_nothing_neither_file_nor_folder(tmp_path: Path) -> None:
    found = appends(tmp_path / "new" / "results")
    assert 0 < found.append_ms.n <= APPENDS
    assert found.free_bytes > 0
    assert list(tmp_path.iterdir()) == []


def test_latency_timers_are_read_and_an_adapter_pulled_out_is_passed_over(tmp_path: Path) -> None:
    for name, text in (("ttyUSB0", "16\n"), ("ttyUSB1", "")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "latency_timer").write_text(text)
    setting = str(tmp_path / "ttyUSB0" / "latency_timer")
    assert adapters(tmp_path) == [Adapter(name="ttyUSB0", setting=setting, latency_ms=16)]
    assert adapters(tmp_path / "none") == []


def test_work_that_hangs_is_left_to_itself_and_errors_come_through() -> None:
    assert within_seconds(PATIENCE_S, lambda: 3) == 3
    hangs = threading.Event()
    with pytest.raises(TimeoutError, match=r"did not end within 0\.05 s"):
        within_seconds(0.05, hangs.wait)
    hangs.set()
    with pytest.raises(LinkError, match="gone"):
        within_seconds(PATIENCE_S, lose_the_gun)


def test_work_that_is_interrupted_may_put_away_what_it_holds(tmp_path: Path) -> None:
    program = (
        "import os, signal, threading\n"
        "from pathlib import Path\n"
        "from experiments.doctor import checks\n"
        "interrupted = threading.Event()\n"
        "def interrupt(*_):\n    interrupted.set()\n    raise KeyboardInterrupt\n"
        "signal.signal(signal.SIGINT, interrupt)\n"
        "def work():\n    os.kill(os.getpid(), signal.SIGINT)\n    interrupted.wait()\n    Path({!r}).touch()\n"
        "checks.PUT_AWAY_S = {}\n"
        "checks.within_seconds({}, work)"
    )
    program = program.format(str(tmp_path / "put away"), PATIENCE_S, PATIENCE_S)
    answer = run_child([sys.executable, "-c", program], PATIENCE_S)
    assert "signal 2" in answer.error
    assert (tmp_path / "put away").exists()


def lose_the_gun() -> NoReturn:
    raise LinkError("gone")


@pytest.mark.parametrize(
    ("program", "seconds", "error"),
    [
        ("import time; time.sleep(600)", 0.5, "did not end within 0.5 s"),
        (
            "import os; os.write(2, b'no plug-in'); os.kill(os.getpid(), 6)",
            PATIENCE_S,
            "was killed by signal 6: no plug-in",
        ),
        ("raise SystemExit(3)", PATIENCE_S, "ended with exit code 3: it said nothing"),
    ],
)
def test_a_child_that_hangs_or_dies_is_an_answer(program: str, seconds: float, error: str) -> None:
    assert run_child([sys.executable, "-S", "-c", program], seconds).error == error


def test_what_the_libraries_of_a_child_print_and_raise_does_not_spoil_its_answer() -> None:
    program = (
        "from experiments.doctor.programs import answer, Absent\n"
        "def look():\n    print('noise')\n    raise {}\n"
        "answer(look)"
    )
    for error, said in (
        ("SystemExit(0)", ProgramReply(error="SystemExit: 0")),
        ("Absent('no screen')", ProgramReply(absent="no screen")),
        ("ModuleNotFoundError(name='Xlib')", ProgramReply(absent="Xlib is not installed")),
        ("ModuleNotFoundError('no wx', name='wx')", ProgramReply(error="ModuleNotFoundError: no wx")),
    ):
        assert run_child([sys.executable, "-c", program.format(error)], PATIENCE_S) == said


def test_a_check_that_breaks_off_is_a_finding_and_an_impossible_wish_is_refused() -> None:
    (finding,) = carry_out_check(Check(name="gun", look=lose_the_gun))
    assert (finding.verdict, finding.check, finding.measured) == ("fails", "gun", "gone")
    gun = next(check for check in checks(Path("results"), "water", 0.01) if check.name == "gun")
    with pytest.raises(PlaceError, match="water"):
        carry_out_check(gun)


def test_the_limit_of_the_line_is_the_guns_and_no_part_of_a_run(tmp_path: Path) -> None:
    shipped = find("gun").read_text(encoding="utf-8")
    own = tmp_path / "gun.toml"
    own.write_text(f"{shipped}\n[serial]\nround_trip_limit_s = 0.004\n", encoding="utf-8")
    assert load_gun(find("gun")).serial.round_trip_limit_s == 0.010
    assert load_gun(own).serial.round_trip_limit_s == 0.004
    assert load_gun(own).model_dump() == load_gun(find("gun")).model_dump()
    own.write_text(f"{shipped}\n[serial]\nround_trip_limit_s = 0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"gun\.toml:\d+: serial\.round_trip_limit_s = 0.*must be above 0"):
        load_gun(own)


# the command


def rows(done: subprocess.CompletedProcess[str]) -> dict[str, dict[str, Any]]:
    """The checks of a `--json` result by their names."""
    assert "Traceback" not in done.stderr
    return {row["check"]: row for row in json.loads(done.stdout)["checks"]}


def test_without_a_display_the_rest_is_looked_at_and_nothing_fails(recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("doctor", "--json")
    found = rows(done)
    assert done.returncode == 0
    assert {name for name, row in found.items() if row["verdict"] == "fails"} == set()
    for name in ("display", "PsychoPy", "keyboard", "step to screen", "key to disk"):
        assert found[name]["verdict"] == "not there"
    assert len(found["streams"]["figures"]["to_reader_ms"]) == found["streams"]["figures"]["sent"] > 0
    assert found["disk"]["figures"]["append_ms"]["n"] > 0
    assert found["gun"]["figures"]["state"] == "disarmed"
    assert found["gun"]["figures"]["round_trip_ms"]["n"] == 200
    assert sorted(path.name for path in tmp_path.iterdir()) == ["home"]


def test_the_table_has_a_row_a_check_and_the_result_can_be_kept(recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("doctor", "--out", "kept/doctor.json")
    kept = json.loads((tmp_path / "kept" / "doctor.json").read_text())
    assert done.returncode == 0
    assert all(row["check"] in done.stdout for row in kept["checks"])
    assert kept["verdict"] in ("good", "warning")
    assert (tmp_path / "kept" / "doctor.json").stat().st_mode & 0o077 == 0


def test_what_cannot_be_kept_is_said_after_the_table(recoil: Recoil, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    done = recoil("doctor", "--out", "file/doctor.json")
    assert done.returncode == 2
    assert "disk" in done.stdout
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("words", [("--gun", "water"), ("--guns", "simulated"), ("direction",)])
def test_wrong_usage_is_2(recoil: Recoil, words: tuple[str, ...]) -> None:
    done = recoil("doctor", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr


def test_a_results_folder_under_a_file_and_a_gun_that_is_not_there_fail_with_what_to_do(
    recoil: Recoil, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("no folder")
    done = recoil("doctor", "--json", "--results", "file/results", "--gun", "serial:/dev/no-such-port")
    found = rows(done)
    assert done.returncode == 1
    assert (found["disk"]["verdict"], found["disk"]["measured"]) == ("fails", "file/results: Not a directory")
    assert "--results" in found["disk"]["advice"]
    assert found["gun"]["verdict"] == "fails"
    assert "/dev/no-such-port" in found["gun"]["measured"]
    assert "cable" in found["gun"]["advice"]
    assert found["clock"]["figures"]


def test_a_full_disk_fails_and_nothing_is_left_on_it(tmp_path: Path) -> None:
    if not can_mount(tmp_path):
        pytest.skip("no private mounts here")
    done = in_small_disk(
        "mkdir results && mount -t tmpfs -o size=64k none results && head -c 64k /dev/zero > results/full;"
        f"unset DISPLAY WAYLAND_DISPLAY QT_QPA_PLATFORM; {shlex.quote(str(RECOIL))} doctor --json; code=$?;"
        "ls -A results >&2; exit $code",
        tmp_path,
    )
    found = rows(done)
    assert done.returncode == 1
    assert (found["disk"]["verdict"], found["disk"]["measured"]) == ("fails", "results: No space left on device")
    assert done.stderr.split()[-1] == "full"


def console_run(results: Path) -> None:
    """A journal as a console leaves it: 20 ms to the screen, 4 ms from the key to the disk, 25 trials."""
    parts: dict[str, object] = {"plan": {}, "setup": {}}
    hashes = {f"{name}_sha256": sha256(part) for name, part in parts.items()}
    folder = results / "sub-P01"
    folder.mkdir(parents=True)
    clock = VirtualClock()
    with Journal.create(folder / "sub-P01_task-direction_journal.jsonl", clock) as journal:
        journal.append("run", **parts, **hashes, clock="real")
        for _ in range(25):
            journal.append("step", body=step_record(FireShot(trial=TRIAL, attempt=1)))
            fired_s = clock.now()
            journal.append("outcome", body=step_record(replace(FIRED, pulse_start_s=fired_s)))
            journal.append("step", body=step_record(ASK))
            clock.sleep(1)
            answered = replace(ANSWERED, response_time_s=1 - 0.004)
            journal.append("outcome", body=step_record(answered), shown_s=fired_s + 0.020)
        journal.append("finished")


def test_a_folder_with_console_runs_shows_how_fast_the_console_was(recoil: Recoil, tmp_path: Path) -> None:
    console_run(tmp_path / "results")
    found = rows(recoil("doctor", "--json"))
    for name, ms, bound_ms in (("step to screen", 20, 50), ("key to disk", 4, 10)):
        figures = found[name]["figures"]
        assert found[name]["verdict"] == "good"
        assert "25 trials" in found[name]["measured"]
        assert (figures["ms"]["n"], figures["trials"], figures["bound_ms"]) == (25, 25, bound_ms)
        assert figures["ms"]["p99"] == pytest.approx(ms)


@pytest.fixture
def display() -> Iterator[str]:
    """A display of its own without a window manager."""
    if shutil.which("Xvfb") is None:
        pytest.skip("needs Xvfb")
    words = ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        assert server.stdout is not None
        try:
            yield f":{int(server.stdout.readline())}"
        finally:
            server.terminate()


def on_display(name: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("QT_", "WAYLAND"))}
    return subprocess.run(
        warm("doctor", "--json"),
        env=environment | {"DISPLAY": name, "HOME": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def test_on_a_display_windows_open_and_injected_keys_come_to_them(display: str, tmp_path: Path) -> None:
    done = on_display(display, tmp_path)
    found = rows(done)
    for name in ("display", "keyboard", "PsychoPy"):
        if "not installed" in found[name]["measured"] or "shared object file" in found[name]["measured"]:
            pytest.skip(f"{name}: {found[name]['measured']}")
    assert done.returncode == 0
    figures = found["display"]["figures"]
    assert (figures["platform"], figures["width_px"], figures["height_px"]) == ("xcb", 1280, 800)
    assert found["PsychoPy"]["verdict"] == "good"
    assert found["PsychoPy"]["figures"]["frames_Hz"] > 0
    keys = found["keyboard"]["figures"]
    assert len(keys["to_event_ms"]) == keys["injected"] == 30
    assert all(0 < event < painted for event, painted in zip(keys["to_event_ms"], keys["to_painted_ms"], strict=True))


def test_a_display_that_nobody_serves_fails_with_what_to_do_and_stops_nothing(tmp_path: Path) -> None:
    done = on_display(":32000", tmp_path)
    found = rows(done)
    for name in ("display", "PsychoPy", "keyboard"):
        if "not installed" in found[name]["measured"]:
            pytest.skip(f"{name}: {found[name]['measured']}")
        assert found[name]["verdict"] == "fails"
        assert "DISPLAY" in found[name]["advice"] or "display" in found[name]["advice"]
    assert done.returncode == 1
    assert found["disk"]["verdict"] != "fails"
    assert "key to disk" in found


@pytest.mark.parametrize(
    ("sensor", "verdict", "said"),
    [
        ("simulated", "good", "3200 samples/s, noise 0.100"),
        ("simulated:slip=2", "fails", "slip is 2; it must be from 0 to 1"),
    ],
)
def test_a_simulated_sensor_is_one_check_among_all(tmp_path: Path, sensor: str, verdict: str, said: str) -> None:
    planned = checks(tmp_path, "simulated", 0.01, sensor=sensor, methods={"damped": GunParameters(friction_N=1.12)})
    assert len(planned) == len(checks(tmp_path, "simulated", 0.01)) + 1
    (finding,) = next(carry_out_check(one) for one in planned if one.name == "sensor")
    assert finding.verdict == verdict
    assert said in finding.measured
