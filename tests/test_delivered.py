"""Was it delivered? What is measured of a shot, when it is marked, and what a sensor beside a run leaves and may do."""

from __future__ import annotations

import csv
import io
import math
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.methods import paper_methods
from device.physics.hand import HandMechanics, held_acceleration, simulate_held
from device.plugin.guard import PluginError
from device.sensor.door import open_sensor
from device.sensor.expected import expected_shot
from device.sensor.link import SensorEnd, SensorLink
from device.sensor.measuring import ExpectedShot, SensorTrace, measured
from device.sensor.process import SampleBuffer, ShotAsked, ShotReply
from device.sensor.streams import CsvSensor, SensorClock, SensorError, checked_samples
from experiments.clock import RealClock, VirtualClock
from experiments.config.setup import Setup
from experiments.delivered.marks import FRICTION_SPREAD, PEAK_SPREAD, SUM_LIMIT, Z_LIMIT, DeliveryLevel, after_shot
from experiments.design.config import DesignConfig
from experiments.rebuild import shots_table, table
from experiments.record.journal import Contents, read_journal
from experiments.run import Finished, RunRequest, run
from experiments.screens.synthetic import synthetic_screen
from experiments.watch.runs import RunSoFar
from tests.at_controls import short_direction
from tests.delivered_chain import DAMPED, RATE_HZ, course, marks_of, measured_shot, parts_of, slipped
from tests.gun_plugins import ACCELEROMETER, install_sensor
from tests.waiting import wait_for

MASS_KG = 0.2262


# what is measured


def drawn_trace(friction_N: float, slopes: tuple[float, float], offset: float, at_s: float) -> SensorTrace:
    """A pulse of 100 m/s2, then two straight lines with the step that a friction makes at 40 ms."""
    times = np.arange(-0.06, 0.2, 1 / RATE_HZ)
    values = np.where(np.abs(times - at_s) < 0.002, 100 * np.cos((times - at_s) * math.pi / 0.004), 0.0)
    step = 2 * friction_N / MASS_KG
    late = times > 0.012
    values = values + late * np.where(times < 0.04, -step / 2 + slopes[0] * (times - 0.04), 0.0)
    values = values + np.where(times >= 0.04, step / 2 + slopes[1] * (times - 0.04), 0.0)
    return SensorTrace(time_s=times, acceleration_m_s2=values + offset)


@given(
    friction_N=st.floats(0.3, 3.0),
    slopes=st.tuples(st.floats(-200, 200), st.floats(-200, 200)),
    offset=st.floats(-20, 20),
    at_s=st.floats(0.002, 0.004),
)
def test_a_step_between_two_lines_is_the_friction_whatever_their_slopes(
    friction_N: float, slopes: tuple[float, float], offset: float, at_s: float
):
    expected = ExpectedShot(peak_m_s2=100.0, rise_s=0.0, mass_kg=MASS_KG, turn_s=0.04, friction_N=friction_N)
    found = measured(drawn_trace(friction_N, slopes, offset, at_s), 0.0, expected)
    assert found is not None
    assert found.friction_N == pytest.approx(friction_N, rel=1e-6, abs=0.02)
    assert found.peak_m_s2 == pytest.approx(100.0, rel=2e-3)  # a parabola for a cosine, 0.3 ms from sample to sample
    assert found.onset_s == pytest.approx(at_s - 0.004 / 3, abs=2e-4)  # where a cosine of 4 ms is at its half


def test_where_the_magnet_turns_the_acceleration_leaps_by_twice_the_friction_over_the_mass():
    for method in ("asymmetric-1", "asymmetric-2"):
        gun = paper_methods()[method]
        turn_s = simulate_held(gun, until_s=0.1).turn_s
        assert turn_s is not None
        before, after = held_acceleration(gun, np.array([turn_s - 1e-6, turn_s + 1e-6]), until_s=0.1)
        assert (after - before) * MASS_KG / 2 == pytest.approx(gun.friction_N, rel=1e-3)


def test_the_acceleration_adds_up_to_the_velocity_that_the_shot_ends_with():
    """The momentum of enclosure and magnet is what the hand's force took, so its integral is the hand's impulse."""
    hand = HandMechanics(stiffness_N_m=0.0, damping_N_s_m=0.0)  # nobody holds it: the momentum stays 0
    times = np.arange(0.0, 0.03, 1e-6)
    gun = paper_methods()["asymmetric-2"]
    velocity = np.cumsum(held_acceleration(gun, times, hand, 0.03)) * 1e-6
    height = np.cumsum(velocity) * 1e-6  # both masses' centre rests: m (x - X) = M X, as x is along the barrel
    shot = simulate_held(gun, hand, 0.03)
    assert height[-1] == pytest.approx(shot.peak_kick_m, rel=1e-3)
    share = gun.magnet_mass_kg / (gun.magnet_mass_kg + hand.enclosure_mass_kg)
    assert height[-1] == pytest.approx(share * shot.max_displacement_m, rel=1e-3)


def test_the_uncertainty_is_how_far_measurements_lie_apart():
    random, of = np.random.default_rng(5), course(DAMPED)
    shots = [measured_shot(of, random) for _ in range(120)]
    for values, uncertain in (
        ([one.friction_N for one in shots], [one.friction_u_N for one in shots]),
        ([one.peak_m_s2 for one in shots], [one.peak_u_m_s2 for one in shots]),
    ):
        ratio = float(np.std(np.array(values, dtype=float)) / np.mean(np.array(uncertain, dtype=float)))
        assert 0.7 < ratio < 1.3


def test_rest_is_no_shot_and_too_few_samples_are_refused():
    expected = expected_shot(DAMPED, RATE_HZ)
    assert expected is not None
    times = np.arange(-0.06, 0.2, 1 / RATE_HZ)
    rest = SensorTrace(time_s=times, acceleration_m_s2=0.1 * np.random.default_rng(1).standard_normal(len(times)))
    assert measured(rest, 0.0, expected) is None
    with pytest.raises(ValueError, match=r"at least 10 are needed to know the noise by"):
        measured(rest, -0.05, expected)


# the marks


def test_without_a_change_the_ratio_of_likelihoods_is_1_on_average():
    """Which the bound of false marks rests on: by Gauss and Hermite, for small and large changes."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(80)
    for change in (0.3, 1.0, 4.6):
        ratio = float(weights @ np.exp(change * nodes - change**2 / 2)) / math.sqrt(2 * math.pi)
        assert ratio == pytest.approx(1.0, rel=1e-9)
    assert 4 * math.exp(-SUM_LIMIT) + 4 * 0.5 * math.erfc(Z_LIMIT / math.sqrt(2)) <= 1e-4 + 1e-12


def test_a_damper_that_slips_is_seen_within_three_shots_and_a_good_one_is_not_marked():
    random, good, bad = np.random.default_rng(6), course(DAMPED), course(slipped(DAMPED, 0.1))
    for _ in range(8):
        shots = [parts_of(measured_shot(of, random)) for of in [good] * 12 + [bad] * 3]
        marks = marks_of(shots)
        assert marks[:12] == [""] * 12
        assert any(marks[12:])


def test_one_shot_far_off_is_marked_at_once_and_teaches_nothing():
    level = DeliveryLevel.before(PEAK_SPREAD)
    for _ in range(5):
        level, mark = after_shot(level, 1.03, 0.01)
        assert mark == ""
    after, mark = after_shot(level, 0.5, 0.01)
    assert mark != ""
    assert (after.mean, after.variance) == (level.mean, level.variance)


def test_a_run_has_its_own_level():
    level = DeliveryLevel.before(FRICTION_SPREAD)
    for _ in range(20):
        level, mark = after_shot(level, 1.12, 0.01)
        assert mark == ""
    assert level.mean == pytest.approx(1.12, abs=0.002)


# what samples may be


@pytest.mark.parametrize(
    ("said", "rule"),
    [
        (3, "it must be a sequence"),
        ([(0.0,)], "two finite numbers"),
        ([(0.0, math.nan)], "two finite numbers"),
        ([("0", 1.0)], "two finite numbers"),
        ([(2.0, 1.0), (1.0, 1.0)], "its time went back from 2.000000 s to 1.000000 s"),
    ],
)
def test_samples_that_cannot_be_are_refused(said: object, rule: str):
    with pytest.raises(SensorError, match=rule):
        checked_samples("read", said, 0.0)


def test_a_sensor_s_clock_is_put_on_the_host_s_by_what_came_soonest():
    now = 0.0
    clock = SensorClock(lambda: now)
    late = np.random.default_rng(7).exponential(0.004, 4000)
    errors = []
    for i, delay in enumerate(late.tolist()):
        true_s = i / 1000
        now = true_s + delay
        (host_s,) = clock.host_times([500.0 + true_s * 1.00005])  # 50 ppm fast
        errors.append(host_s - true_s)
    assert max(map(abs, errors[2000:])) < 0.001


def test_lines_of_a_csv_are_samples_and_others_are_named(tmp_path: Path):
    path = tmp_path / "stream.csv"
    path.write_text("0.0,9.9\n")
    sensor = CsvSensor(str(path), lambda: 100.0)
    with path.open("a") as file:
        file.write("time_s,acceleration\n1.0,2.5\n1.001,")
        file.flush()
        assert sensor.read() == [(100.0, 2.5)]
        file.write("-2.5\n1.002;3\n")
    with pytest.raises(SensorError, match=r"'1.002;3' is no line `time_s,acceleration_m_s2`"):
        sensor.read()
    sensor.close()
    with pytest.raises(SensorError, match="cannot be opened"):
        CsvSensor(str(tmp_path / "none"), time.monotonic)


def test_a_trace_with_a_gap_or_without_an_end_is_not_measured():
    buffer, times = SampleBuffer(), np.arange(0.0, 2.0, 1 / RATE_HZ)
    buffer.take([(t, 0.0) for t in times.tolist() if not 0.99 < t < 1.01])
    asked = ShotAsked(number=1, pulse_start_s=1.0, actuator=DAMPED)
    reply = buffer.reply_to(asked, 2.0)
    assert reply is not None
    assert "gap of 0.02" in reply.because
    late = replace(asked, pulse_start_s=1.99)
    assert buffer.reply_to(late, 2.0) is None
    reply = buffer.reply_to(late, 4.0)
    assert reply is not None
    assert reply.because == "the sensor gave no samples of it"


# plug-ins

SENSOR = """
class Sensor:
    def read(self): ...
    def close(self): ...
    {more}
def open_sensor(rest, clock):
    return {made}
"""


@pytest.mark.parametrize(
    ("source", "said"),
    [
        (
            SENSOR.format(more="read = None", made="Sensor()"),
            "sensor plug-in bad: Sensor has no read; a sensor has read",
        ),
        (SENSOR.format(more="def read(self, n): ...", made="Sensor()"), r"it cannot be called as read\(\)"),
        (SENSOR.format(more="", made="1 / 0"), "sensor plug-in bad did not open 'x': ZeroDivisionError"),
        ("", "sensor plug-in bad did not open 'x': AttributeError"),
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
        ("import time\ntime.sleep(3600)\n", "sleeper:x: was not ready within 1 s; did its import or its device hang"),
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
    now = 50.0
    sensor = open_sensor(f"serial-accelerometer:{os.ttyname(theirs)}", lambda: now)
    os.write(ours, b"999,1\n4294967000,1000\n704,-500\nrub")
    found = list[tuple[float, float]]()
    wait_for(lambda: found.extend(sensor.read()) or len(found) == 3)
    sensor.close()
    os.close(ours)
    os.close(theirs)
    assert [value for _, value in found] == pytest.approx([0.00980665, 9.80665, -4.903325])
    assert found[2][0] - found[1][0] == pytest.approx(0.001)  # over the end of its counter


# beside a run


def short_design(*, repeat: bool = False) -> Setup[DesignConfig]:
    setup = short_direction(sets=1, trials=14, set_break_s=0.0)
    trial = setup.config.trial.model_copy(update={"repeat_undelivered": repeat})
    fatigue = setup.config.fatigue.model_copy(update={"max_trials_without_break": 60})
    return replace(setup, config=setup.config.model_copy(update={"trial": trial, "fatigue": fatigue}))


def run_with(results: Path, sensor: str, *, repeat: bool = False, code: str = "P01") -> Finished:
    request = RunRequest(setup=short_design(repeat=repeat), participant_id=code, results=results, sensor=sensor, seed=3)
    return run(request, synthetic_screen, VirtualClock())


def rows_of(data: bytes | None) -> list[dict[str, str]]:
    assert data is not None
    return list(csv.DictReader(io.StringIO(data.decode(), newline="")))


@pytest.fixture(scope="module")
def drilled(tmp_path_factory: pytest.TempPathFactory) -> Contents:
    """A run whose damper slips by three tenths after ten shots; trials that were not delivered come again."""
    done = run_with(tmp_path_factory.mktemp("drill"), "simulated:slip=0.3,after=10", repeat=True)
    assert done.place.shots.read_bytes() == shots_table(read_journal(done.place.journal))
    return read_journal(done.place.journal)


def test_every_shot_of_a_run_is_measured_and_stands_in_the_journal_and_a_table(drilled: Contents):
    kinds = Counter(record.kind for record in drilled.records)
    shots = rows_of(shots_table(drilled))
    fired = [
        record for record in drilled.records if isinstance(record.body, dict) and record.body.get("kind") == "fired"
    ]
    assert len(shots) == kinds["measured"] == len(fired)
    assert all(row["delivered_peak_m_s2"] and row["sensor"] == "simulated:slip=0.3,after=10" for row in shots)
    onsets = [float(row["delivered_onset_s"]) for row in shots]
    assert max(map(abs, onsets)) < 5e-4


def test_what_was_not_delivered_is_marked_and_comes_again_once(drilled: Contents):
    trials, shots = rows_of(table(drilled)), rows_of(shots_table(drilled))
    bad = {
        (row["session"], row["trial"])
        for row in shots
        if row["mark"] in {"outside", "slipped"} and row["attempt"] == "1"
    }
    again = {(row["session"], row["trial"]) for row in trials if row["attempts"] == "2"}
    assert bad
    assert again == bad
    assert {row["attempts"] for row in trials} <= {"1", "2"}
    last = [row for row in shots if row["attempt"] == "2" and row["mark"]]
    assert all(
        "not-delivered" in row["flags"]
        for row in trials
        if (row["session"], row["trial"]) in {(s["session"], s["trial"]) for s in last}
    )
    assert all(row["method"] != "vibration" for row in shots if row["mark"])


def test_whoever_watches_reads_of_it(drilled: Contents):
    so_far = RunSoFar(drilled.head)
    so_far.add(drilled.records[1:])
    assert any("not delivered: " in str(fault) for fault in so_far.faults)


def test_a_run_without_a_sensor_has_no_table_of_shots(tmp_path: Path):
    done = run_with(tmp_path, "")
    assert not done.place.shots.exists()
    assert shots_table(read_journal(done.place.journal)) is None


@pytest.mark.parametrize(
    ("sensor", "gun", "clock", "said"),
    [
        (
            "simulated",
            "serial:/dev/none",
            RealClock(),
            "goes with --gun simulated; it would measure nothing of serial:",
        ),
        ("csv:x", "simulated", VirtualClock(), "measures in real time, and this run's clock is virtual"),
        ("simulated:slip=2", "simulated", VirtualClock(), "give slip, after, noise as a number"),
    ],
)
def test_a_sensor_that_can_measure_nothing_is_refused(sensor: str, gun: str, clock: Any, said: str):
    from experiments.delivered.recorder import open_recorder

    with (
        pytest.raises(SensorError, match=said),
        open_recorder(sensor, gun, {}, clock, again=False, random=np.random.default_rng(1)),
    ):
        pass


class EndsAfter:
    """A sensor's end that answers so many shots, then is over."""

    address, immediate = "short:1", True

    def __init__(self, shots: int) -> None:
        self._left = shots

    def ask(self, _: float, actuator: Any) -> ShotReply:
        self._left -= 1
        if self._left < 0:
            raise SensorError("short:1: it broke off: EOFError")
        return ShotReply(number=1, expected=expected_shot(actuator, RATE_HZ))

    def close(self) -> None: ...


def test_a_run_goes_on_when_its_sensor_ends_which_is_said_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from experiments.delivered import recorder

    make: Callable[..., SensorEnd] = lambda *_: EndsAfter(5)  # noqa: E731
    monkeypatch.setattr(recorder, "SimulatedSensor", make)
    done = run_with(tmp_path, "simulated")
    contents = read_journal(done.place.journal)
    shots = rows_of(shots_table(contents))
    assert contents.finished
    assert Counter(row["mark"] for row in shots) == {"no-peak": 5, "not-measured": len(shots) - 5}
    notes = [record.body for record in contents.records if record.kind == "remark"]
    assert sum("The sensor ended (short:1: it broke off: EOFError)" in str(note) for note in notes) == 1


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
