"""The serial gun's full figures: 10,000 trials through the twin on a bad line, and how well its clock is known."""

import re
import statistics
import time

import pytest

from experiments.journal import read
from tests.serial_runs import check, hasty, of_trains, one_run, run_all
from tests.test_serial_run import SPEED, TROUBLES
from tests.twins import Troubles, a_pair, a_twin

pytestmark = pytest.mark.soak

PEOPLE = 167
"""Of 60 trials each."""


def test_ten_thousand_trials_on_a_bad_line(tmp_path, quick_configs, soak):
    start_s = time.monotonic()
    with a_twin(tmp_path, TROUBLES, speed=SPEED, drift_ppm=60.0) as (twin, socket):
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
    config = quick_configs / "preference.toml"
    text = re.sub(r"exposure_s = [\d.]+", "exposure_s = 20.0", config.read_text())
    config.write_text(re.sub(r"\b(instruction|hand_over|rating|description)_s = [\d.]+", r"\1_s = 1.0", text))
    line = Troubles(latency_s=0.001, jitter_s=0.004)
    with a_twin(tmp_path, line, speed=1.0, drift_ppm=80.0) as (twin, socket):
        done = one_run(config, tmp_path / "results", f"serial:{socket.address}", "P01", "ask")
        assert not any(true.too_soon for true in twin.body.ledger)
    trains = [[shot["timing"]["gun_start_us"] for shot in shots] for shots, _ in of_trains(read(done.journal))]
    off_us = [start - train[0] - 1_000_000 * n for train in trains for n, start in enumerate(train)]
    exact = sum(off == 0 for off in off_us) / len(off_us)
    detail = f"{len(off_us)} shots at 1 Hz, worst {max(off_us) / 1000:.3f} ms late; line of 1 to 5 ms each way, 80 ppm"
    soak("shots of trains at their tick of the gun's clock, to the microsecond", f"{exact:.1%}", "95 %", detail)
    assert min(off_us) == 0
    assert exact >= 0.95
