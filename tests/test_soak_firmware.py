"""The firmware's full figures: 1,000 random scripts through three cores, whole sessions on the emulated chip."""

from __future__ import annotations

import statistics
import time
from itertools import zip_longest

import pytest

from tests.firmware import (
    BUSES,
    CORES,
    FAST,
    Hand,
    Run,
    as_on_the_simulated_gun,
    chances,
    check_records,
    dead_bus,
    emulated,
    one_after_the_other,
    play_all,
    told,
)
from tests.serial_runs import hasty
from tests.twin_scripts import transcript

pytestmark = pytest.mark.soak

SCRIPTS = 1000
LIVE_SCRIPTS = 200
BOARD_SCRIPTS, BOARD_SHOTS = 300, 15


def test_a_thousand_random_scripts_agree_to_the_byte_with_their_times(soak):
    script = list(one_after_the_other(range(SCRIPTS)))
    expected = list(transcript(script))
    for core in CORES:
        start_s = time.monotonic()
        found = told(core, script)
        wrong = sum(one != other for one, other in zip_longest(expected, found))
        detail = f"{len(script)} calls, {len(expected)} lines of transcript, {time.monotonic() - start_s:.1f} s"
        soak(f"lines in which the {core}'s core differs from the twin, {SCRIPTS} random scripts", wrong, 0, detail)
        assert found == expected


def test_whatever_befalls_shots_on_the_fake_board_their_records_are_what_the_coil_saw(soak):
    start_s, unfed_us, less = time.monotonic(), [], 0
    for seed in range(BOARD_SCRIPTS):
        run = Run(*chances(seed, shots=BOARD_SHOTS))
        less += check_records(run)
        unfed_us.append(run.longest_unfed_us)
    detail = f"stalls to 30 ms, dead buses, faults, ABOR; {less} not whole; {time.monotonic() - start_s:.0f} s"
    soak(f"records that differ from the fake board's coil, {BOARD_SCRIPTS * BOARD_SHOTS} shots", 0, 0, detail)
    how = "of which up to 30 ms are the stalls themselves; the watchdog's least time is 36 ms"
    soak("longest between two feeds of the watchdog in these", f"{max(unfed_us) / 1000:.1f} ms", "36 ms", how)


def test_a_dead_bus_holds_the_main_loop(soak):
    unfed_us = {bus: Run(*dead_bus(bus)).longest_unfed_us for bus in BUSES}
    worst = max(unfed_us, key=lambda bus: unfed_us[bus])
    how = f"of {len(unfed_us)} ways to be dead, {worst}; the watchdog's least time is 36 ms"
    soak("longest wait of the main loop on a dead I2C bus", f"{unfed_us[worst] / 1000:.2f} ms", "36 ms", how)


def test_random_scripts_in_real_time_on_the_emulated_chip_are_replayed_exactly_by_the_twin(tmp_path, soak):
    with emulated(tmp_path) as chip:
        hand = Hand(chip)
        hand.wait_for_rest()
        start_s = time.monotonic()
        said = play_all(hand, range(LIVE_SCRIPTS))
        detail = f"{len(chip.calls())} lines to it, {said} bytes from it, {time.monotonic() - start_s:.0f} s, own clock"
        late_us = [call.done_us - call.due_us for call in chip.drives()]
        hand.close()
    soak(f"bytes and drives in which chip and twin differ, {LIVE_SCRIPTS} scripts in real time", 0, 0, detail)
    how = f"median {statistics.median(late_us)} us, worst {max(late_us)} us of {len(late_us)}; the emulator's figure"
    soak("drives later than they were due", f"{statistics.median(late_us) / 1000:.2f} ms", "-", how)


def test_the_way_to_the_chip_and_back(tmp_path, soak):
    with emulated(tmp_path) as chip:
        hand, times_ms = Hand(chip), []
        for _ in range(1000):
            start_s = time.perf_counter()
            hand.ask("TIME?")
            times_ms.append(1000 * (time.perf_counter() - start_s))
        hand.close()
    times_ms.sort()
    how = f"95th {times_ms[950]:.2f} ms, worst {times_ms[-1]:.2f} ms of 1000, pyserial on a pseudo-terminal"
    soak("round trip of a question by hand", f"median {statistics.median(times_ms):.2f} ms", "-", how)


@pytest.mark.parametrize(("name", "speed"), [("direction", 1), ("preference", FAST)])
def test_a_whole_session_on_the_chip(recoil, quick_configs, soak, name, speed):
    hasty(quick_configs)
    start_s = time.monotonic()
    shots = as_on_the_simulated_gun(recoil, quick_configs / f"{name}.toml", speed)
    detail = f"{shots} shots, each driven once and when the journal says; {time.monotonic() - start_s:.0f} s"
    pace = "in real time" if speed == 1 else f"{speed} times as fast"
    soak(f"rows of a session ({name}, {pace}) that differ from the simulated gun's but for times", 0, 0, detail)
