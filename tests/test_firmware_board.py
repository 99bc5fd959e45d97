"""The firmware for the F446, to the register, on a fake chip that keeps the manual's rules and a time of its own.

`device/firmware/fake` is the chip with its bus and vibration driver; `script.c` there is the language. All of it is
deterministic: only register accesses take time, 0.1 us each.
"""

from __future__ import annotations

import re
import subprocess

import pytest

from device.wire.errors import message
from tests.firmware import (
    BUSES,
    EFFECT,
    LEAST_WATCHDOG_US,
    MOST_WATCHDOG_US,
    PULSE,
    Run,
    built,
    chances,
    check_records,
    dead_bus,
    say,
    well,
)

pytestmark = pytest.mark.slow  # the firmware has to be built


def test_a_pulse_lasts_as_long_as_it_should_and_the_record_says_when_it_was():
    run = Run(*say(1_100_000, PULSE, "ARM", "TRIG 5"), *say(1_200_000, "TIME?", "SHOT?"))
    assert well(run)
    (on_us,), (off_us,) = run.times("coil on 16000 mV"), run.times("coil off")
    assert off_us - on_us == pytest.approx(10_000, abs=2)
    boot_us = run.times("says TIME")[0] - int(run.said("TIME ")[0].split()[1])  # 12 bytes later: 260 us
    assert run.shots[0].ending == "DONE"
    assert run.shots[0].start_us + boot_us == pytest.approx(on_us, abs=500)


def test_a_vibration_is_begun_and_stopped_by_its_driver():
    run = Run(*say(1_100_000, EFFECT, "ARM", "TRIG 5"), *say(1_200_000, "SHOT?", "STAT?"))
    assert well(run)
    assert run.seen == ["is still", "vibrates 47", "is still"]
    assert run.times("is still")[1] - run.times("vibrates")[0] == pytest.approx(24_000, abs=200)
    assert (run.shots[0].ending, run.standing.fault) == ("DONE", 0)


def test_the_start_of_the_clocks_keeps_the_manuals_order():
    """HSEBYP before HSEON; VOS and the source before the PLL; wait states, dividers and lock before the switch."""
    run = Run(*say(1_100_000, "TIME?"))
    assert well(run)
    assert run.times("says TIME")[0] - int(run.said("TIME ")[0].split()[1]) < 5_000


def test_without_the_outside_clock_it_lives_by_the_chips_own():
    run = Run("0 no-outside-clock 1", *say(1_100_000, PULSE, "ARM", "TRIG 5"), *say(1_200_000, "SHOT?"))
    assert well(run)
    assert run.times("coil off")[0] - run.times("coil on")[0] == pytest.approx(10_000, abs=2)
    assert run.shots[0].ending == "DONE"


def test_without_the_pll_it_drives_nothing_and_resets_itself():
    run = Run("0 no-pll 1", *say(1_100_000, PULSE, "ARM", "TRIG 5"))
    assert run.seen == []
    assert run.lines[-2][1] == "reset by itself"


@pytest.mark.parametrize("lsi_kHz", [17, 47])
@pytest.mark.parametrize("armed", [False, True])
def test_a_clock_that_stands_still_ends_in_a_reset(lsi_kHz, armed):
    """In mid-pulse, and at rest. The coil is off by then: its timer is another."""
    shot = say(1_090_000, PULSE, "ARM", "TRIG 5") if armed else []
    run = Run(f"0 watchdog {lsi_kHz}", *shot, "1097000 clock-stands-still 1")
    reset_us, words = run.lines[-2]
    assert words == "reset by the watchdog"
    assert reset_us - 1_097_000 < MOST_WATCHDOG_US
    assert len(run.times("coil off")) == armed
    assert all(time_us - run.times("coil on")[0] < 10_002 for time_us in run.times("coil off"))


def test_while_the_clock_runs_the_watchdog_is_fed_at_rest_and_at_work():
    train = [
        line for shot in range(20) for line in say(1_100_000 + 211_000 * shot, f"TRIG {shot + 1}", "STAT?", "SHOT?")
    ]
    run = Run(*say(1_090_000, PULSE, "ARM"), *train)
    assert well(run)
    assert len(run.times("coil on")) == 20
    assert run.longest_unfed_us < LEAST_WATCHDOG_US / 10


@pytest.mark.parametrize("access_ns", [100, 1_000])
@pytest.mark.parametrize("bus", BUSES)
def test_a_dead_bus_holds_the_main_loop_less_than_the_watchdogs_time_and_the_next_effect_works_again(bus, access_ns):
    run = Run(f"0 access {access_ns}", *dead_bus(bus))
    assert well(run)
    assert run.longest_unfed_us < LEAST_WATCHDOG_US / 10
    failed, again = run.shots
    assert (failed.ending, failed.count, run.standing.state, run.standing.fault) == ("NONE", 0, "FAULT", 2)
    assert run.said()[2:4] == [message(110)] * 2  # what became of the trigger, and of the gun
    assert (again.ending, again.count) == ("DONE", 1)
    assert [words for words in run.seen if words.startswith("vibrates")] == ["vibrates 48"]


def test_a_driver_that_is_not_there_is_noticed_by_its_missing_acknowledge_and_not_by_the_time():
    answered = {
        bus: Run(f"1000000 bus {bus}", *say(1_100_000, EFFECT, "ARM", "TRIG 5"), "1102300 say TIME?").times("says TIME")
        for bus in ("absent", "addr")
    }
    assert answered["addr"][0] - answered["absent"][0] > 500


@pytest.mark.parametrize("bus", BUSES)
def test_a_bus_that_dies_in_mid_effect_is_a_fault_and_no_reset(bus):
    run = Run(
        *say(1_100_000, EFFECT, "ARM", "TRIG 5"),
        f"1110000 bus {bus}",
        *say(1_200_000, "SHOT?", "STAT?"),
        "1300000 bus good",
        *say(1_400_000, "*RST", EFFECT, "ARM", "TRIG 6"),
        *say(1_500_000, "SHOT?"),
    )
    assert well(run)
    assert run.longest_unfed_us < LEAST_WATCHDOG_US / 10
    assert (run.standing.state, run.standing.fault) == ("FAULT", 2)
    assert run.seen.count("vibrates 47") == 2
    assert [shot.ending for shot in run.shots] == ["DONE", "DONE"]


def test_a_gun_without_a_vibration_driver_fires_pulses_once_the_fault_is_cleared():
    run = Run(
        "0 bus absent",
        *say(1_100_000, "STAT?", "*RST", PULSE, "ARM", "TRIG 5"),
        *say(1_200_000, "SHOT?"),
    )
    assert well(run)
    assert (run.standing.state, run.standing.fault) == ("FAULT", 2)
    assert run.shots[0].ending == "DONE"
    assert len(run.times("coil on")) == 1


def test_a_driver_that_was_left_in_the_middle_of_a_byte_is_clocked_free_at_the_start():
    """As a reset in mid-transfer leaves it: it holds the data line low until it has seen the rest of the byte."""
    run = Run("0 held 7", *say(1_100_000, EFFECT, "ARM", "TRIG 5"), *say(1_200_000, "SHOT?", "STAT?"))
    assert well(run)
    assert run.times("vibrates 47")
    assert (run.shots[0].ending, run.standing.fault) == ("DONE", 0)


def test_a_driver_that_never_lets_go_of_the_line_is_a_fault_and_no_reset():
    run = Run("0 held 1000000", *say(1_100_000, "STAT?"))
    assert well(run)
    assert (run.standing.state, run.standing.fault) == ("FAULT", 2)


AT_US = 1_150_000


def held_up(stall_us: int, *more: str) -> Run:
    """A pulse for a time of the gun's clock before which the main loop stands still for a while; and how it was."""
    when = f"TRIG 5,{AT_US}"
    return Run(
        *say(1_100_000, PULSE, "ARM", when, "TIME?"),
        f"{AT_US} stall {stall_us}",
        *more,
        *say(1_300_000, "SHOT?", "SYST:ERR?"),
    )


def test_a_pulse_that_the_main_loop_begins_late_is_cut_and_the_record_is_what_the_coil_saw():
    run = held_up(8_000)
    assert well(run)
    (shot,), (on_us,), (off_us,) = run.shots, run.times("coil on"), run.times("coil off")
    assert shot.ending == "CUT"
    assert AT_US + 1_000 < shot.start_us < shot.end_us == AT_US + 10_000
    assert off_us - on_us == pytest.approx(shot.end_us - shot.start_us, abs=5)
    assert run.said()[-1] == message(0)


def test_a_pulse_that_was_begun_late_ends_in_time_though_the_main_loop_stands_still_again():
    (on_us,), (off_us,) = (held_up(8_000).times(f"coil {word}") for word in ("on", "off"))
    run = held_up(8_000, f"{on_us + 500} stall 20000")
    assert well(run)
    assert run.times("coil off") == [pytest.approx(off_us, abs=5)]


def test_a_pulse_that_would_begin_after_its_end_drives_nothing_and_is_told_as_never_begun():
    run = held_up(20_000)
    assert well(run)
    assert run.times("coil") == []
    assert (run.shots[0].ending, run.shots[0].count, run.said()[-1]) == ("NONE", 0, message(107))


@pytest.mark.parametrize("seed", range(20))
def test_whatever_befalls_a_shot_its_record_is_what_the_coil_saw_and_the_watchdog_sleeps(seed):
    assert check_records(Run(*chances(seed, shots=15))) > 0


def test_a_fault_of_the_coil_driver_in_mid_pulse_switches_off_at_once():
    run = Run(
        *say(1_100_000, PULSE, "ARM", "TRIG 5"),
        "1107000 coil-fault 1",
        "1150000 coil-fault 0",
        *say(1_200_000, "SHOT?", "STAT?"),
    )
    assert well(run)
    assert run.times("coil off")[0] - 1_107_000 < 100
    assert (run.shots[0].ending, run.standing.state, run.standing.fault) == ("CUT", "FAULT", 1)


def test_the_serial_port_shares_nothing_with_its_interrupt_without_order():
    """The thread sanitizer, which sees two threads at one place without an order of C11's, ends the program with 66."""
    done = subprocess.run([built("host") / "port-race"], check=False, capture_output=True, text=True, timeout=600)
    if "unexpected memory mapping" in done.stderr:
        pytest.skip("this kernel's addresses are too random for this compiler's thread sanitizer (vm.mmap_rnd_bits)")
    assert (done.returncode, done.stderr) == (0, "")
    right, of = map(int, re.fullmatch(r"(\d+) of (\d+)\n", done.stdout).groups())
    assert 1_000 < right <= of
