"""The serial gun's full figures: 10,000 trials on a bad line, as many with a gun that lies, and its clock."""

import statistics
import time
from collections import Counter
from random import Random

import pytest

from device.serial_gun.gun import MAX_SPEED
from device.serial_gun.link import WATCHDOG_S
from experiments.record.journal import read_journal
from tests.forger import ShotLiar, a_lying_twin
from tests.serial_runs import SPEED, TROUBLES, check, hasty, long_trains, of_trains, one_run, run_all
from tests.twins import Troubles, a_pair, a_twin

pytestmark = pytest.mark.soak

PEOPLE = 167
"""Of 60 trials each."""


def test_ten_thousand_trials_on_a_bad_line(tmp_path, quick_configs, soak):
    start_s = time.monotonic()
    with a_twin(tmp_path, TROUBLES, speed=SPEED, drift_ppm=60.0, watchdog_s=WATCHDOG_S) as (twin, socket):
        gun = f"serial:{socket.address}?speed={SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, PEOPLE + 1))
        figures = check(tally, twin, slack_s=1e-4)
    taken_s = time.monotonic() - start_s
    assert figures["trials"] == 60 * PEOPLE
    detail = ", ".join(f"{name} {count}" for name, count in figures.items())
    soak("each trial done once, or marked and offered again", f"{figures['trials']} trials", "10,000", detail)
    soak("wrong methods, directions or times in the log", 0, 0, f"{taken_s:.0f} s at {SPEED:g} times the world's speed")


def test_the_clock_after_fifty_exchanges_with_jitter(tmp_path, soak):
    errors_ms, bounds_ms = [], []
    for seed in range(20):
        with a_pair(tmp_path, Troubles(jitter_s=0.005), speed=1.0, drift_ppm=80.0, seed=seed) as pair:
            for _ in range(50):
                pair.gun.link.ask("TIME?")
            (found,) = pair.gun.link.host(pair.twin.clock_us())
            errors_ms.append(1000 * abs(found.time_s - pair.clock()))
            bounds_ms.append(1000 * found.uncertainty_s)
    how = f"stated bound: median {statistics.median(bounds_ms):.2f} ms, worst {max(bounds_ms):.2f} ms; 20 twins, 80 ppm"
    soak("error of the gun's clock, 5 ms jitter each way", f"worst {max(errors_ms):.2f} ms", "1 ms", how)
    assert max(errors_ms) < 1


def test_the_shots_of_trains_in_real_time(tmp_path, quick_configs, soak):
    config = long_trains(quick_configs, exposure_s=20.0)
    line = Troubles(latency_s=0.001, jitter_s=0.004)
    with a_twin(tmp_path, line, speed=1.0, drift_ppm=80.0) as (twin, socket):
        done = one_run(config, tmp_path / "results", f"serial:{socket.address}", "P01", "ask")
        assert not any(true.too_soon for true in twin.body.ledger)
    trains = [[shot["timing"]["gun_start_us"] for shot in shots] for shots, _ in of_trains(read_journal(done.journal))]
    off_us = [start - train[0] - 1_000_000 * n for train in trains for n, start in enumerate(train)]
    exact = sum(off == 0 for off in off_us) / len(off_us)
    detail = f"{len(off_us)} shots at 1 Hz, worst {max(off_us) / 1000:.3f} ms late; line of 1 to 5 ms each way, 80 ppm"
    soak("shots of trains at their tick of the gun's clock, to the microsecond", f"{exact:.1%}", "95 %", detail)
    assert min(off_us) == 0
    assert exact >= 0.95


def test_ten_thousand_trials_with_forged_records(tmp_path, quick_configs, soak):
    start_s = time.monotonic()
    with a_lying_twin(tmp_path, speed=MAX_SPEED, drift_ppm=60.0, watchdog_s=WATCHDOG_S) as (twin, forger):
        forger.lie = liar = ShotLiar(0.2, far_us=round(2e6 * MAX_SPEED))  # 2 s of the world
        gun = f"serial:{forger.address}?speed={MAX_SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, PEOPLE + 1))
        figures = check(tally, twin, slack_s=1e-4)
    taken_s = time.monotonic() - start_s
    disbelieved = sum(count for cause, count in tally.causes.items() if "not believed" in cause)
    accepted = liar.accepted(fired.timing for _, fired in tally.done)
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(Counter(liar.told).items()))
    how = (
        f"{figures['trials']} trials, each with one valid shot in the end, {taken_s:.0f} s at {MAX_SPEED:g} times the "
        f"world's speed; {disbelieved} not believed, {figures['marked'] - disbelieved} marked for other causes, "
        f"{figures['stops']} stops; {kinds}"
    )
    soak("forged, well framed records of shots accepted", f"{accepted} of {len(liar.told)}", "0", how)
    assert figures["trials"] == figures["done"] == 60 * PEOPLE
    assert accepted == 0
    assert len(liar.told) > 1000


def test_a_thousand_trials_whose_answers_are_lost(tmp_path, quick_configs, soak):
    lost = set()

    def lose(body):
        if body.startswith("SHOT ") and body.split(",")[1] not in lost:
            lost.add(body.split(",")[1])
            return None
        return body

    with a_lying_twin(tmp_path, speed=SPEED, drift_ppm=60.0) as (twin, forger):
        forger.lie = lose
        gun = f"serial:{forger.address}?speed={SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, 18))
        figures = check(tally, twin, slack_s=1e-4)
    recovered = figures["done"] - figures["marked"]
    how = f"the record of every shot is lost once, {len(lost)} in all, and found by SHOT?; marked {figures['marked']}"
    soak("trials recovered whose answer was lost", f"{recovered} of {figures['trials']}", "all of 1,000", how)
    assert figures["trials"] == figures["done"] == 1020
    assert figures["marked"] == figures["rendered and marked"] == 0


def test_two_thousand_trials_with_a_clock_that_is_misread(tmp_path, quick_configs, soak):
    draw, told = Random(1), []

    def lie(body):
        if not body.startswith("TIME ") or draw.random() > 0.2:
            return body
        told.append(body)
        off_us = round(draw.choice((-1, 1)) * 10 ** draw.uniform(6, 9))
        return f"TIME {max(0, int(body.split()[1]) + off_us)}"

    with a_lying_twin(tmp_path, speed=SPEED, drift_ppm=60.0) as (twin, forger):
        forger.lie = lie
        gun = f"serial:{forger.address}?speed={SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, 35))
        figures = check(tally, twin, slack_s=1e-4)
    detail = ", ".join(f"{name} {count}" for name, count in figures.items())
    how = f"{len(told)} answers to TIME? off by 1 to 1000 s; {detail}"
    soak("onsets beyond their uncertainty, with a clock that is misread", f"0 of {figures['done']}", "0", how)
    assert figures["trials"] == figures["done"] == 2040
