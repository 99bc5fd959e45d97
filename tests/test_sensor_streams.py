"""Samples of a sensor: what they may be, its clock on ours, plug-ins, and its own process beside a run."""

from __future__ import annotations

import math
import os
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.own_process import own_environment, own_program
from device.plugin.guard import PluginError
from device.sensor.door import open_sensor
from device.sensor.link import SensorLink
from device.sensor.measuring import DeliveredShot
from device.sensor.process import LOOK_EVERY_S, UNHEARD_S, SampleBuffer, SensorSilence, ShotAsked
from device.sensor.streams import BAD_LINES, CsvSensor, SensorClock, SensorError, checked_samples
from tests.delivered_chain import DAMPED, RATE_HZ, stream_written
from tests.gun_plugins import ACCELEROMETER, install_sensor
from tests.waiting import PATIENCE_S, wait_for

FRICTION_N = 1.12
"""Of the paper's damper."""

# what samples may be


@pytest.mark.parametrize(
    ("said", "rule"),
    [
        (3, "it must be a sequence"),
        ([(0.0,)], "two finite numbers"),
        ([(0.0, math.nan)], "two finite numbers"),
        ([("0", 1.0)], "two finite numbers"),
        ([(2.0, 1.0), (2.0, 1.0), (1.0, 1.0)], "its time went back from 2.000000 s to 1.000000 s"),
    ],
)
def test_samples_that_cannot_be_are_refused(said: object, rule: str):
    with pytest.raises(SensorError, match=rule):
        checked_samples("read", said, 0.0)


def clock_heard(delays: list[float], lines_s: float, drift: float) -> tuple[float, float]:
    """How far the clock is off after lines that come every so often and so late, and its own uncertainty."""
    clock = SensorClock()
    for i, delay in enumerate(delays, start=1):
        clock.heard(500.0 + i * lines_s * (1 + drift), i * lines_s + delay)
    now_s, line = len(delays) * lines_s, clock.line()
    return float(line.host_s(np.array([500.0 + now_s * (1 + drift)]))[0]) - now_s, line.u_s


@pytest.mark.slow
@pytest.mark.parametrize("drift", [0.0, 5e-5, -4e-3])
@pytest.mark.parametrize("batch_s", [0.005, 0.02, 0.2])
def test_a_sensor_s_clock_is_known_by_what_came_soonest_in_batches_of_any_length(batch_s: float, drift: float):
    random = np.random.default_rng(7)
    found = np.array(
        [clock_heard(random.uniform(0, 0.015, round(12 / batch_s)).tolist(), batch_s, drift) for _ in range(20)]
    )
    off_s, u_s = float(np.sqrt((found[:, 0] ** 2).mean())), float(found[:, 1].mean())
    assert off_s < 0.003
    assert 0.2 * off_s < u_s < 5 * off_s


@given(st.lists(st.floats(0.0, 3.0), min_size=2, max_size=40))
def test_no_delay_moves_times_that_the_sensor_gave_out_of_their_order(delays: list[float]):
    clock, stamps = SensorClock(), np.arange(len(delays)) / 10
    for stamp, delay in zip(stamps.tolist(), delays, strict=True):
        clock.heard(stamp, 7.0 + stamp + delay)
    line = clock.line()
    assert (np.diff(line.host_s(stamps)) > 0).all()
    assert (line.host_s(stamps) <= 7.0 + stamps + delays + 1e-9).all()  # nothing came before it was measured


def test_lines_of_a_csv_are_samples_and_others_are_named(tmp_path: Path):
    path = tmp_path / "stream.csv"
    path.write_text("0.0,9.9\n")
    sensor = CsvSensor(str(path))
    with path.open("a") as file:
        file.write("time_s,acceleration\n1.0,2.5\n1.001,")
        file.flush()
        assert sensor.read() == [(1.0, 2.5)]
        file.write("-2.5\n1.00\x00;3\n0.5,1\n,,\n1.003,nan\n1.004,4\n")
        file.flush()
        assert sensor.read() == [(1.001, -2.5), (1.004, 4.0)]  # what was garbled, or goes back, is left out
        assert sensor.dropped == 4
    sensor.close()
    with pytest.raises(SensorError, match="names no file"):
        CsvSensor("")
    with pytest.raises(SensorError, match="is a folder"):
        CsvSensor(str(tmp_path))
    with pytest.raises(SensorError, match="cannot be opened"):
        CsvSensor(str(tmp_path / "none"))


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("0,001;9,81\n" * BAD_LINES, r"'0,001;9,81' is no sample: a line is `time_s,acceleration_m_s2`, two numbers"),
        ("1.0,2.5,3.5\n" * BAD_LINES, "'1.0,2.5,3.5' is no sample"),
        ("1.0\t2.5\n" * BAD_LINES, "is no sample"),
        ("1.0,2.5\r" * 200, "goes on for 1000 bytes; .* and ends with LF"),
        ("5.0,1\n" + "1.0,1\n" * BAD_LINES, "'1.0,1' lies before 5.000000 s, as others do"),
    ],
)
@pytest.mark.parametrize("begun", [True, False])
def test_a_stream_of_other_lines_is_named(lines: str, said: str, begun: bool, tmp_path: Path):
    path = tmp_path / "stream.csv"
    path.touch()
    sensor = CsvSensor(str(path))
    path.write_text("0.5,9.9\n" * begun + lines)
    with pytest.raises(SensorError, match=said):
        sensor.read()
    sensor.close()


def test_a_trace_with_a_gap_or_without_an_end_is_not_measured():
    buffer, times = SampleBuffer(), np.arange(0.0, 2.0, 1 / RATE_HZ)
    buffer.take([(t, 0.0) for t in times.tolist() if not 0.99 < t < 1.01], 2.0)
    asked = ShotAsked(number=1, pulse_start_s=1.0, actuator=DAMPED)
    reply = buffer.reply_to(asked, 2.0)
    assert reply is not None
    assert "gap of 0.02" in reply.because
    late = replace(asked, pulse_start_s=1.99)
    assert buffer.reply_to(late, 2.0) is None
    assert buffer.reply_to(late, 4.0) is None  # not yet two seconds after its end
    reply = buffer.reply_to(late, 5.0)
    assert reply is not None
    assert reply.because == "the sensor gave no samples of it"


# silence


def looked(spans: list[tuple[str, float]]) -> list[bool]:
    """What looks at even times say of a sensor that gives batches or nothing, hangs, or is not asked, in turn."""
    silence, now_s, said = SensorSilence(), 0.0, list[bool]()
    silence.answered(1)
    said.append(silence.look(now_s))
    for what, span_s in spans:
        if what == "late":  # this process stands still: nothing is looked at either
            now_s += span_s
        for _ in range(1 if what == "late" else round(span_s / LOOK_EVERY_S)):
            if what in ("gives", "nothing"):
                silence.ask()
                silence.answered(what == "gives")
            elif what == "hangs":
                silence.ask()
            now_s += LOOK_EVERY_S
            said.append(silence.look(now_s))
        if what == "hangs":
            silence.answered(0)
    return said


@pytest.mark.parametrize("what", ["nothing", "hangs"])
def test_a_sensor_that_was_asked_in_vain_or_hangs_is_silent_after_the_limit_and_no_sooner(what: str):
    assert not any(looked([(what, UNHEARD_S)]))
    said = looked([("gives", 1.0), (what, UNHEARD_S + 2 * LOOK_EVERY_S), ("gives", LOOK_EVERY_S)])
    assert said[-2:] == [True, False]


@pytest.mark.parametrize(
    "spans",
    [
        [("nothing", 0.8), ("gives", LOOK_EVERY_S)] * 5,  # batches
        [("hangs", 1.0), ("gives", LOOK_EVERY_S)] * 5,  # each read takes a second
        [("measures", 30.0), ("gives", LOOK_EVERY_S)],  # it is not asked meanwhile
        [("nothing", 1.0), ("late", 30.0), ("nothing", LOOK_EVERY_S), ("gives", LOOK_EVERY_S)],
        [("hangs", 1.0), ("late", 30.0), ("gives", LOOK_EVERY_S)],
    ],
)
def test_batches_slow_reads_and_our_own_lateness_are_no_silence(spans: list[tuple[str, float]]):
    assert not any(looked(spans))


def test_a_shot_is_not_given_up_while_only_this_machine_was_late():
    buffer, asked = SampleBuffer(), ShotAsked(number=1, pulse_start_s=1.0, actuator=DAMPED)
    buffer.take([(t, 0.0) for t in np.arange(0.0, 1.0, 1 / RATE_HZ).tolist()], 1.0)
    assert buffer.reply_to(asked, 1.0) is None  # however late it is now, it was asked last before the shot was over
    buffer.take([(t, 0.0) for t in np.arange(1.0, 4.0, 1 / RATE_HZ).tolist()], 9.0)
    reply = buffer.reply_to(asked, 9.0)
    assert reply is not None
    assert reply.because == ""


# plug-ins

SENSOR = """
class Sensor:
    def read(self): ...
    def close(self): ...
    {more}
def open_sensor(rest, clock):
    return {made}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "said"),
    [
        (
            SENSOR.format(more="read = None", made="Sensor()"),
            "sensor plug-in bad: Sensor has no read; a sensor has read",
        ),
        (SENSOR.format(more="def read(self, n): ...", made="Sensor()"), r"it cannot be called as read\(\)"),
        (SENSOR.format(more="", made="1 / 0"), "sensor plug-in bad did not open 'x': ZeroDivisionError"),
        ("", "sensor plug-in bad: its import failed: AttributeError"),
        ("raise SystemExit('no chip')", "sensor plug-in bad: its import failed: SystemExit: no chip"),
    ],
)
def test_a_plug_in_that_lacks_something_is_refused_by_name(tmp_path, monkeypatch, source: str, said: str):
    install_sensor(monkeypatch, tmp_path, source, name="bad", module="bad_sensor")
    with pytest.raises((SensorError, PluginError), match=said):
        open_sensor("bad:x", time.monotonic)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "said"),
    [
        (
            "import time\ntime.sleep(3600)\n",
            "sleeper:x: was not ready within 1 s; did its import, its device or a read",
        ),
        ("import os\nos._exit(3)\n", "sleeper:x: its process ended with exit code 3"),
    ],
)
def test_a_plug_in_that_hangs_or_dies_at_import_is_refused_by_name(tmp_path, monkeypatch, source: str, said: str):
    install_sensor(monkeypatch, tmp_path, source, name="sleeper", module="sleeper_sensor")
    with pytest.raises(SensorError, match=said):
        SensorLink("sleeper:x", start_s=1.0 if "sleep" in source else 30.0)


def test_no_such_sensor_is_told_with_those_there_are():
    with pytest.raises(
        ValueError, match=r"must be .simulated. or .csv:PATH., or begin with the name of a sensor plug-in"
    ):
        open_sensor("nosuch:1", time.monotonic)


def test_the_accelerometer_of_the_docs_reads_a_serial_line(tmp_path, monkeypatch):
    install_sensor(monkeypatch, tmp_path, ACCELEROMETER.read_text(), name="serial-accelerometer", module="serial_acc")
    ours, theirs = os.openpty()
    sensor = open_sensor(f"serial-accelerometer:{os.ttyname(theirs)}", time.monotonic)
    os.write(ours, b"999,1\n4294967000,1000\n704,-500\nrub")
    found = list[tuple[float, float]]()
    wait_for(lambda: found.extend(sensor.read()) or len(found) == 3)
    sensor.close()
    os.close(ours)
    os.close(theirs)
    assert [value for _, value in found] == pytest.approx([0.00980665, 9.80665, -4.903325])
    assert found[2][0] - found[1][0] == pytest.approx(0.001)  # over the end of its counter


STOPS = """
import os
class Sensor:
    def __init__(self, rest, clock):
        self.plug, self.clock = rest, clock
        self.last_s = clock()
    def read(self):
        now_s, found = self.clock(), []
        if not os.path.exists(self.plug):
            raise EOFError("the plug was pulled")
        while self.last_s < now_s:
            found.append((self.last_s, 0.01 * len(found)))
            self.last_s += 1 / 2000
        return found
    def close(self): ...
def open_sensor(rest, clock):
    print("what a plug-in prints harms nobody")
    return Sensor(rest, clock)
"""


@pytest.mark.slow
def test_a_real_process_measures_and_says_why_it_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    install_sensor(monkeypatch, tmp_path, STOPS, name="stops", module="stops_sensor")
    plug = tmp_path / "plug"
    plug.touch()
    link = SensorLink(f"stops:{plug}")
    try:
        assert 1900 < link.ready.rate_Hz < 2100
        reply = link.ask(time.monotonic() - 0.3, DAMPED)
        assert (reply.because, reply.seen) == ("", None)
        plug.unlink()
        with pytest.raises(SensorError, match="it broke off: EOFError: the plug was pulled"):
            link.ask(time.monotonic(), DAMPED)
    finally:
        link.close()


HANGS = STOPS.replace(
    'raise EOFError("the plug was pulled")', "while not os.path.exists(self.plug): __import__('time').sleep(0.01)"
)


@pytest.mark.slow
def test_a_sensor_whose_read_hangs_is_silent_until_it_goes_on_and_no_shot_is_mistaken_for_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    install_sensor(monkeypatch, tmp_path, HANGS, name="hangs", module="hanging_sensor")
    plug = tmp_path / "plug"
    plug.touch()
    link = SensorLink(f"hangs:{plug}")
    try:
        plug.unlink()
        for _ in range(2):
            assert link.ask(time.monotonic(), DAMPED).because == "the sensor was silent"
        plug.touch()
        wait_for(lambda: not link.silent)
        reply = link.ask(time.monotonic() + 0.5, DAMPED)
        assert (reply.number, link.ended) == (3, "")
        assert reply.because in ("", "the sensor gave no samples of it") or "gap" in reply.because  # a busy machine
    finally:
        link.close()


OPENS = """
import os, pathlib, time
def open_sensor(address, clock):
    pathlib.Path(address).write_text(str(os.getpid()))
    time.sleep(3600)
"""


@pytest.mark.slow
def test_a_sensor_that_hangs_while_it_opens_ends_with_who_started_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_sensor(monkeypatch, tmp_path, OPENS, name="opens", module="opening_sensor")
    command = own_program("device.sensor", f"opens:{tmp_path / 'there'}")
    with subprocess.Popen(command, env=own_environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        wait_for((tmp_path / "there").exists)
        assert child.stdin is not None
        child.stdin.close()
        assert child.wait(PATIENCE_S) == 0


def shot_of(link: SensorLink) -> DeliveredShot | None:
    """What was measured of the shot at the next full second; `None` where this machine stood still."""
    return link.ask(math.floor(time.monotonic()) + 1.0, DAMPED).seen


@pytest.mark.slow
def test_a_file_that_grows_in_batches_bursts_and_pauses_is_measured_and_its_silence_is_said(tmp_path: Path):
    with stream_written(tmp_path / "stream.csv", "0.005,0.2,0.05,0.6,0.02,0.1,0.005") as (writer, path):
        link = SensorLink(f"csv:{path}")
        try:
            seen = [wait_for(lambda: shot_of(link)) for _ in range(2)]
            assert [one.friction.at_scale()[0] for one in seen if one.friction is not None] == pytest.approx(
                [FRICTION_N] * 2, rel=0.1
            )
            assert all(one.onset_u_s > 0 for one in seen)
            writer.kill()
            wait_for(lambda: link.silent)
            assert link.ask(time.monotonic(), DAMPED).because == "the sensor gave no samples of it"
            assert not link.ended
        finally:
            link.close()
    wait_for(lambda: link.ended)
