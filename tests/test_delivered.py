"""Was it delivered? What is measured of a shot, when it is marked, and what a sensor beside a run leaves and may do."""

from __future__ import annotations

import csv
import io
import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.methods import paper_methods
from device.parameters import GunParameters
from device.physics import hand as physics_of_hand
from device.physics.hand import HandMechanics, held_acceleration, simulate_held
from device.sensor.expected import NO_COURSE, expected_shot
from device.sensor.link import SensorEnd
from device.sensor.measuring import ExpectedShot, SensorTrace, measured
from device.sensor.process import ShotReply
from device.sensor.simulated import SimulatedSensor
from device.sensor.streams import SensorError
from device.sensor.turn import ExpectedTurn
from experiments.clock import Clock, RealClock, VirtualClock
from experiments.config.setup import Setup
from experiments.delivered import recorder
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.earlier_run import UNMEASURED
from experiments.load import load_setup
from experiments.record import storage
from experiments.record.journal import Contents, read_journal
from experiments.record.lines import ending_of
from experiments.record.rebuild import shots_table, table
from experiments.record.replay import history
from experiments.run import Finished, run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session import events
from experiments.session.states import Position, State
from experiments.session.steps import Fired, Repeated
from experiments.synthetic.answers import synthetic_participant_of
from experiments.watch.runs import RunSoFar
from tests.at_controls import short_direction
from tests.delivered_chain import DAMPED, RATE_HZ, course, measured_shot, seen

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


@pytest.mark.slow
@given(
    friction_N=st.floats(0.3, 3.0),
    slopes=st.tuples(st.floats(-200, 200), st.floats(-200, 200)),
    offset=st.floats(-20, 20),
    at_s=st.floats(0.002, 0.004),
)
def test_a_step_between_two_lines_is_the_friction_whatever_their_slopes(
    friction_N: float, slopes: tuple[float, float], offset: float, at_s: float
):
    turn = ExpectedTurn(turn_s=0.04, free_s=0.03, enclosure_kg=MASS_KG, magnet_kg=0.114, pull_N=100.0, friction_N=1.0)
    found = measured(drawn_trace(friction_N, slopes, offset, at_s), 0.0, expected_turning(turn))
    assert found is not None
    assert found.friction is not None
    assert found.friction.at_scale()[0] == pytest.approx(friction_N, rel=1e-6, abs=0.02)
    assert found.peak_m_s2 == pytest.approx(100.0, rel=2e-3)  # a parabola for a cosine, 0.3 ms from sample to sample
    assert found.onset_s == pytest.approx(at_s - 0.004 / 3, abs=2e-4)  # where a cosine of 4 ms is at its half


@pytest.mark.slow
@given(
    friction_N=st.floats(0.3, 3.0),
    held=st.floats(0.1, 0.9),
    slope=st.floats(-200, 200),
    outward=st.floats(0.3, 1.7),
    scale=st.floats(0.9, 1.1),
)
def test_where_the_magnet_rests_the_friction_is_the_leap_s_and_what_the_spring_pulls(
    friction_N: float, held: float, slope: float, outward: float, scale: float
):
    """By the two equations of motion, with a hand's force that is drawn: before the turn, and in the rest after it."""
    out_N, held_N, magnet_kg, pull_N = outward * friction_N, held * (2 - outward) * friction_N, 0.114, 1.7
    after = (pull_N - held_N) / magnet_kg
    before = after - (out_N + held_N) / MASS_KG
    trace = drawn_trace(0.0, (slope, slope), 0.0, 0.002)
    late = trace.time_s > 0.012
    values = trace.acceleration_m_s2 + late * np.where(trace.time_s < 0.04, before, after)
    turn = ExpectedTurn(
        turn_s=0.04,
        free_s=0.03,
        enclosure_kg=MASS_KG,
        magnet_kg=magnet_kg,
        pull_N=pull_N,
        friction_N=1.0,
        outward=outward,
    )
    found = measured(SensorTrace(time_s=trace.time_s, acceleration_m_s2=scale * values), 0.0, expected_turning(turn))
    assert found is not None
    assert found.friction is not None
    assert found.friction.at_scale(scale)[0] == pytest.approx(friction_N, abs=0.05 / outward)


def expected_turning(turn: ExpectedTurn) -> ExpectedShot:
    return ExpectedShot(peak_m_s2=100.0, rise_s=0.0, turn=turn, friction_N=1.0)


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
        tuple(zip(*[one.friction.at_scale() for one in shots if one.friction is not None], strict=True)),
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


@pytest.mark.slow
@pytest.mark.parametrize("rate_Hz", [1500.0, RATE_HZ, 8000.0])
@pytest.mark.parametrize("drive", [{}, {"voltage_V": 6.0}, {"voltage_V": 2.0}, {"pulse_s": 0.003}, {"pulse_s": 0.06}])
def test_a_friction_is_measured_where_the_model_s_own_course_gives_it_and_nowhere_else(
    rate_Hz: float, drive: dict[str, float]
):
    """Of a weak or a short pulse the turn lies among other steps; the peak is measured all the same."""
    random = np.random.default_rng(3)
    for method in ("asymmetric-1", "asymmetric-2"):
        gun = replace(paper_methods()[method], **drive)
        expected = expected_shot(gun, rate_Hz)
        assert expected is not None
        assert (expected.turn is None) == (expected.friction_N is None)
        if expected.friction_N is not None:
            assert expected.friction_N == pytest.approx(gun.friction_N, rel=0.15)
        for _ in range(5):
            assert measured(seen(course(gun), random, 0.5), 0.0, expected) is not None


@pytest.mark.slow
def test_a_shot_that_moves_nothing_or_is_not_followed_to_its_end_is_not_measured_and_ends_no_run(
    monkeypatch: pytest.MonkeyPatch,
):
    sensor = SimulatedSensor("simulated", "simulated", np.random.default_rng(1))
    assert sensor.ask(0.0, GunParameters(friction_N=60.0)).because == NO_COURSE
    monkeypatch.setattr(physics_of_hand, "_MAX_WORK", 1000)
    assert sensor.ask(1.0, GunParameters(friction_N=0.22)).because == NO_COURSE


@pytest.mark.slow
@pytest.mark.parametrize(
    "gun",
    [
        GunParameters(friction_N=0.02),
        GunParameters(friction_N=0.1, voltage_V=18.0),
        GunParameters(friction_N=1.12, stiffness_N_m=100.0),
    ],
)
def test_a_shot_whose_magnet_hops_after_its_landing_is_measured(gun: GunParameters):
    sensor = SimulatedSensor("simulated", "simulated", np.random.default_rng(1))
    assert sensor.ask(0.0, gun).because == ""


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


SLIPPING = "simulated:slip=0.3,after=10"


@pytest.fixture(scope="module")
def drilled(tmp_path_factory: pytest.TempPathFactory) -> Contents:
    """A run whose damper slips by three tenths after ten shots; trials that were not delivered come again."""
    done = run_with(tmp_path_factory.mktemp("drill"), SLIPPING, repeat=True)
    assert done.place.shots.read_bytes() == shots_table(read_journal(done.place.journal))
    return read_journal(done.place.journal)


@pytest.mark.slow
def test_every_shot_of_a_run_is_measured_and_stands_in_the_journal_and_a_table(drilled: Contents):
    kinds = Counter(record.kind for record in drilled.records)
    shots = rows_of(shots_table(drilled))
    fired = [
        record for record in drilled.records if isinstance(record.body, dict) and record.body.get("kind") == "fired"
    ]
    assert len(shots) == kinds["measured"] == len(fired)
    assert all(row["delivered_peak_m_s2"] and row["sensor"] == SLIPPING for row in shots)
    onsets = [float(row["delivered_onset_s"]) for row in shots]
    assert max(map(abs, onsets)) < 5e-4


@pytest.mark.slow
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


class RepeatingScreen(SyntheticScreen):
    """An experimenter who has the trial of a shot again, by its number in the run, and says why as a sensor would."""

    shot = 10

    def act(self, position: Position, until_s: float | None) -> None:
        live = self._live
        fired = 0 if live is None else sum(isinstance(word, Fired) for _, word in live.history)
        if live is not None and position.state is State.ASKING and fired == self.shot:
            self.shot = 0
            assert live.offer(events.Repeat(reason="not delivered: they say"))
        else:
            super().act(position, until_s)


def test_what_an_experimenter_says_of_a_repeat_keeps_none_from_coming_that_the_sensor_asks_for(tmp_path: Path):
    def screen(setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> RepeatingScreen:
        return RepeatingScreen(setup.config, synthetic_participant_of(setup, plan), clock)

    request = RunRequest(
        setup=short_design(repeat=True), participant_id="P01", results=tmp_path, sensor=SLIPPING, seed=3
    )
    done = read_journal(run(request, screen, VirtualClock()).place.journal)
    again = [word for _, word in history(done) if isinstance(word, Repeated)]
    assert [one.by for one in again if one.trial == again[0].trial] == ["experimenter", "sensor"]


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
            "goes with a simulated gun; it would measure nothing of serial:",
        ),
        ("csv:/dev/null", "simulated", VirtualClock(), "measures in real time, and this run's clock is virtual"),
        ("csv:/none/such", "simulated", VirtualClock(), "csv:/none/such: cannot be opened"),
        ("csv:", "simulated", VirtualClock(), "csv:: names no file"),
        ("nope:1", "simulated", VirtualClock(), "address is 'nope'; it must be .simulated. or .csv:PATH."),
        ("simulated:slip=2", "simulated", VirtualClock(), "slip is 2; it must be from 0 to 1"),
        ("simulated:after=-3", "simulated", VirtualClock(), "after is -3; it must be a number of shots, from 0"),
        ("simulated:slip=nan", "simulated", VirtualClock(), "slip is nan; it must be from 0 to 1"),
        ("simulated:slip=x", "simulated", VirtualClock(), "'x' is no number"),
        ("simulated:slips=1", "simulated", VirtualClock(), "there is no 'slips'; give slip, after, noise"),
        ("simulated:slip=0.1,slip=0.2", "simulated", VirtualClock(), "slip is given twice"),
    ],
)
def test_a_sensor_that_can_measure_nothing_is_refused(sensor: str, gun: str, clock: Any, said: str):
    with (
        pytest.raises(SensorError, match=said),
        recorder.open_recorder(sensor, gun, {}, clock, again=False, random=np.random.default_rng(1)),
    ):
        pass


class Falters:
    """A sensor's end that sees no peak (`p`), is silent (`s`), has wrong times (`t`), and is over after the last."""

    address, silent, dropped, ended = "short:1", False, 3, ""

    def __init__(self, answers: str) -> None:
        self._answers = iter(answers)

    def ask(self, _: float, actuator: Any) -> ShotReply:
        answer = next(self._answers, "")
        self.silent = answer == "s"
        if not answer:
            raise SensorError("short:1: it broke off: EOFError")
        if answer in "st":
            return ShotReply(number=1, because="the sensor gave no samples of it")
        return ShotReply(number=1, expected=expected_shot(actuator, RATE_HZ))

    def close(self) -> None: ...


def run_faltering(
    patch: pytest.MonkeyPatch, results: Path, setup: Setup[DesignConfig], answers: str
) -> tuple[Contents, list[str]]:
    """A run with such a sensor, and what the experimenter was told of it."""
    make: Callable[..., SensorEnd] = lambda *_: Falters(answers)  # noqa: E731
    patch.setattr(recorder, "SimulatedSensor", make)
    told = list[str]()

    def screen(*given: Any) -> Any:
        made = synthetic_screen(*given)
        made.trouble = told.append
        return made

    request = RunRequest(setup=setup, participant_id="P01", results=results, sensor="simulated", seed=3)
    return read_journal(run(request, screen, VirtualClock()).place.journal), told


def test_a_run_goes_on_when_its_sensor_is_silent_or_ends_which_is_said_once(tmp_path, monkeypatch):
    contents, told = run_faltering(monkeypatch, tmp_path, short_design(), "pssssp")
    marks = [(row["mark"], row["because"]) for row in rows_of(shots_table(contents))]
    assert contents.finished
    assert [mark for mark, _ in marks[:7]] == ["no-peak", *["not-measured"] * 4, "no-peak", "not-measured"]
    assert {because for _, because in marks[6:]} == {"the sensor had ended"}
    notes = [record.body["text"] for record in contents.records if "noted" in str(record.body)]
    assert [note[:26] for note in notes] == [
        "The sensor is silent: no s",
        "The sensor is heard again.",
        "The sensor ended (short:1:",
        "Lines of the sensor that w",
    ]
    assert set(notes) <= set(told)
    assert len(told) == len(notes) + 2  # a line for each shot without a peak


def test_shots_that_are_not_measured_though_the_sensor_is_heard_are_told_of_once(tmp_path, monkeypatch):
    contents, told = run_faltering(monkeypatch, tmp_path, short_design(), "ttpttttt")
    notes = [record.body["text"] for record in contents.records if "noted" in str(record.body)]
    (one,) = [note for note in notes if note.startswith("The last 3 shots were not measured (the sensor gave no")]
    assert one in told


@pytest.mark.slow
def test_the_last_word_of_a_sensor_is_in_the_table_and_in_the_hash_however_slow_the_disk(tmp_path, monkeypatch):
    write_all = storage.write_all

    def slow(descriptor: int, data: bytes) -> None:
        time.sleep(0.02)
        write_all(descriptor, data)

    monkeypatch.setattr(storage, "write_all", slow)
    contents, _ = run_faltering(monkeypatch, tmp_path, short_design(), "p")  # it notes something at the end
    assert "Lines of the sensor" in str(contents.records[-2].body)
    of_table, of_journal, _ = ending_of(contents.path.read_bytes())
    assert of_table
    assert of_journal == sha256(b"".join(contents.path.read_bytes().splitlines(keepends=True)[:-1])).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "notes"), [("", [UNMEASURED]), ("simulated", [])])
def test_a_run_that_was_measured_says_so_when_it_goes_on_without_its_sensor(
    tmp_path: Path, sensor: str, notes: list[str]
):
    journal = run_with(tmp_path, "simulated").place.journal
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:20]))
    told = list[str]()

    def screen(*given: Any) -> Any:
        made = synthetic_screen(*given)
        made.trouble = told.append
        return made

    request = RunRequest(
        setup=short_design(), participant_id="P01", results=tmp_path, sensor=sensor, seed=3, again="resume"
    )
    contents = read_journal(run(request, screen, VirtualClock()).place.journal)
    assert contents.finished
    assert [record.body["text"] for record in contents.records if "noted" in str(record.body)] == told == notes


def test_shots_of_a_train_that_were_not_delivered_are_told_in_one_line(tmp_path, monkeypatch):
    contents, told = run_faltering(monkeypatch, tmp_path, load_setup("preference"), "p" * 1000)
    shots = Counter(row["trial"] for row in rows_of(shots_table(contents)))
    *undelivered, dropped = told
    assert dropped.startswith("Lines of the sensor")
    assert [one.partition(" not delivered")[0] for one in undelivered] == [
        f"Trial {trial}: {count} of {count} shots were" for trial, count in shots.items()
    ]
