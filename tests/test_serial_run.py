"""Whole runs on a gun over a serial line: as on the simulated gun but for times; on a bad line nothing goes wrong."""

import json
import re
import signal
import subprocess
from dataclasses import replace

import pytest

from device.wire.errors import WireError
from experiments.config.door import ConfigError
from experiments.record.journal import read_journal
from experiments.record.replay import history
from experiments.session.steps import Failed
from recoil.rig import troubles_of
from recoil.session import check_pace
from tests.at_runs import shorten
from tests.at_terminal import AtTerminal
from tests.serial_runs import SPEED, TROUBLES, check, hasty, of_trains, one_run, resumed, rows, run_all, timings_of
from tests.twins import Troubles, a_twin
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

pytestmark = pytest.mark.slow


def test_trials_on_a_bad_line_are_each_done_once_or_marked_and_offered_again(tmp_path, quick_configs):
    often = replace(TROUBLES, reset=0.05, busy=0.05, hang=0.05)  # so few trials see each of them
    with a_twin(tmp_path, often, speed=SPEED, drift_ppm=60.0) as (twin, socket):
        gun = f"serial:{socket.address}?speed={SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, 3))
        figures = check(tally, twin, slack_s=1e-4)
    assert figures["trials"] == 120
    assert len(set(twin.accidents)) >= 3
    assert figures["marked"] > 0


def test_trains_on_a_bad_line_are_whole_and_never_too_soon(tmp_path, quick_configs):
    """A train that was broken is presented again; of both, each shot that was done is in the journal as it was."""
    noise = Troubles(jitter_s=0.001, lose=0.003, double=0.003, corrupt=0.003, partial=0.003, unplug=0.01, replug_s=0.05)
    config = quick_configs / "preference.toml"
    config.write_text(re.sub(r"hand_over_s = [\d.]+", "hand_over_s = 0.3", config.read_text()))
    with a_twin(tmp_path, noise, speed=SPEED) as (twin, socket):
        gun = f"serial:{socket.address}?speed={SPEED:g}"
        done = resumed(lambda again: one_run(config, tmp_path / "results", gun, "P01", again))
    contents = read_journal(done.journal)
    whole = [(shots, body) for shots, body in of_trains(contents) if body and body["kind"] == "presented"]
    assert [len(shots) for shots, _ in whole] == [body["shots"] for _, body in whole]
    assert len(whole) == 3
    for timing in timings_of(contents):
        true = min(twin.body.ledger, key=lambda one: abs(one.start_s - timing["pulse_start_s"]))
        assert abs(true.start_s - timing["pulse_start_s"]) <= timing["uncertainty_s"] + 1e-4
    assert not any(true.too_soon for true in twin.body.ledger)


@pytest.fixture
def plugged(tmp_path):
    """The command `recoil twin` in a process of its own; gives what to say to --gun."""
    command = warm("twin", "--json", "--link", tmp_path / "port", "--speed", 40)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        text = ""
        while not text.rstrip().endswith("}"):
            line = program.stdout.readline()
            assert line, program.stderr.read()
            text += line
        yield json.loads(text)["gun"]
        program.send_signal(signal.SIGINT)
        assert program.wait(PATIENCE_S) == 130
    assert not (tmp_path / "port").is_symlink()


def test_a_twin_takes_no_link_from_one_that_runs(recoil, tmp_path, plugged):
    port = tmp_path / "port"
    before = port.readlink()
    done = recoil("twin", "--link", port)
    assert done.returncode == 2
    assert f"{port}: leads to a twin that still runs; try --tcp PORT, or another --link" in done.stderr
    assert port.readlink() == before


def told(row):
    """A row but for how many shots a train had time for, which on the twin is real time."""
    return {column: cell for column, cell in row.items() if column != "shots"}


@pytest.mark.parametrize("name", ["direction", "preference"])
def test_a_run_on_the_twin_logs_what_one_on_the_simulated_gun_does_but_for_times(
    recoil, tmp_path, quick_configs, plugged, name
):
    hasty(quick_configs)
    shorten(quick_configs)
    words = (
        "run",
        quick_configs / f"{name}.toml",
        "--participant",
        "P01",
        "--screen",
        "synthetic",
        "--seed",
        3,
        "--json",
    )
    logs = []
    for folder, gun in (("simulated", "simulated"), ("twin", plugged)):
        done = recoil(*words, "--gun", gun, "--results", folder)
        assert done.returncode == 0, done.stderr
        logs.append({key: tmp_path / path for key, path in json.loads(done.stdout).items()})
    simulated, twin = (rows(log["table"]) for log in logs)
    assert [told(row) for row in twin] == [told(row) for row in simulated]
    contents = read_journal(logs[1]["journal"])
    causes = [outcome.cause for _, outcome in history(contents) if isinstance(outcome, Failed)]
    assert [cause for cause in causes if "watchdog" not in cause] == []
    timings = timings_of(contents)
    assert len(timings) == sum(int(row.get("shots", 1)) for row in twin) or causes
    assert all(one["requested_s"] <= one["written_s"] <= one["acknowledged_s"] for one in timings)
    assert all("timing" not in str(record.body) for record in read_journal(logs[0]["journal"]).records)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_run_that_is_killed_leaves_the_gun_disarmed(tmp_path, quick_configs, number):
    words = ("run", quick_configs / "preference.toml", "--participant", "P01", "--screen", "synthetic", "--seed", "3")
    quick = re.sub(
        r"(hand_over|instruction)_s = [\d.]+", r"\1_s = 0.3", (quick_configs / "preference.toml").read_text()
    )
    (quick_configs / "preference.toml").write_text(quick)
    with a_twin(tmp_path, speed=1.0) as (twin, socket):
        command = warm(*words, "--gun", f"serial:{socket.address}")
        program = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: len(twin.body.ledger) >= 2 and twin.core.machine.state != "DISARMED")
            twin.core.errors.clear()
            program.send_signal(number)
            program.wait(PATIENCE_S)
        finally:
            program.kill()
            program.wait()
        wait_for(lambda: twin.core.machine.state == "DISARMED")
        left_to_the_watchdog = WireError.WATCHDOG in twin.core.errors
        assert left_to_the_watchdog == (number == signal.SIGKILL)
        assert twin.core.machine.due_us() is None  # nothing comes any more


def test_a_twin_at_a_terminal_is_called_simulated(tmp_path, quick_configs):
    with a_twin(tmp_path, speed=1.0) as (_, socket):
        words = ("run", quick_configs / "direction.toml", "--participant", "P01", "--gun", f"serial:{socket.address}")
        with AtTerminal(warm(*words), tmp_path) as sitting:
            sitting.wait_for("Trial 1 of 20")
            assert "SIMULATED GUN – nothing is felt.\nParticipant P01" in sitting.seen


def test_the_doctor_measures_the_way_to_a_gun_on_a_line(recoil, plugged, quick_configs):
    patient = quick_configs / "gun.toml"
    patient.write_text(f"{patient.read_text()}\n[serial]\nround_trip_limit_s = 1.0\n")
    done = recoil("doctor", "--json", "--gun", plugged, "--gun-config", patient)
    (gun,) = [row for row in json.loads(done.stdout)["checks"] if row["check"] == "gun"]
    assert gun["verdict"] in {"good", "warning"}  # a busy machine makes the way longer
    assert gun["measured"].startswith("haptic-gun:TWIN-1, disarmed; round trip median")
    trip = gun["figures"]["round_trip_ms"]
    assert trip["n"] == 200
    assert 0 < trip["median"] <= trip["p95"] <= trip["worst"]


def test_the_twin_refuses_what_it_cannot_be(recoil):
    for words, part in (
        (("--trouble", "rain=1"), "known are"),
        (("--trouble", "lose=2"), "lose is 2"),
        (("--trouble", "unplug=1"), "--link"),
        (("--speed", "0"), "--speed"),
        (("--tcp", "1", "--link", "x"), "give one"),
        (("--link", "no/such/folder/gun"), "cannot be plugged in"),
    ):
        done = recoil("twin", *words)
        assert done.returncode == 2
        assert part in done.stderr
    with pytest.raises(ConfigError, match="it must be a number"):
        troubles_of(["lose=much"])


def test_the_twin_on_a_tcp_port_is_opened_by_url_and_measured_against_its_own_limit(recoil, tmp_path, quick_configs):
    strict = quick_configs / "gun.toml"
    strict.write_text(f"{strict.read_text()}\n[serial]\nround_trip_limit_s = 1e-6\n")
    with a_twin(tmp_path, tcp=True, speed=1.0) as (_, socket):
        done = recoil("doctor", "--json", "--gun", f"serial:{socket.address}", "--gun-config", strict)
    (gun,) = [row for row in json.loads(done.stdout)["checks"] if row["check"] == "gun"]
    assert gun["verdict"] == "warning"
    assert "above the limit of 0.001 ms (the gun's serial.round_trip_limit_s)" in gun["advice"]


@pytest.mark.parametrize("who", [("--participant", "P01"), ()], ids=["run", "lab day"])
def test_a_twin_in_a_hurry_is_refused_where_people_answer(recoil, who):
    done = recoil("run", "direction", *who, "--screen", "console", "--gun", "serial:/dev/pts/9?speed=20")
    assert done.returncode == 2
    assert "--screen console is for people, who live no faster than the world" in done.stderr
    assert "Traceback" not in done.stderr
    with pytest.raises(ConfigError, match="--screen terminal is for people"):
        check_pace("terminal", "serial:/dev/pts/9?speed=20")
    check_pace("terminal", "serial:/dev/pts/9")
    check_pace("synthetic", "serial:/dev/pts/9?speed=20")


def test_a_doctor_does_not_fire_a_gun_whose_clock_is_not_that_of_its_address(recoil, tmp_path):
    with a_twin(tmp_path, speed=1.0) as (twin, socket):
        done = recoil("doctor", "--gun", f"serial:{socket.address}?speed=50", "--fire", "3", "--json")
        found = {one["check"]: one for one in json.loads(done.stdout)["checks"]}
        assert "leave ?speed out" in found["gun"]["advice"]
        assert found["shots"]["measured"] == "nothing was fired: the gun fails"
        assert twin.body.ledger == []
