import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from device.limits import AMBIENT_C, MAX_COIL_C, DriveHistory, Load, load_of
from device.words import Effect, LimitError, Pulse

COLD_10_MS = Load(on_s=0.010, heat_J=0.0)
loads = st.builds(Load, on_s=st.floats(0.0, 0.020), heat_J=st.floats(0.0, 40.0))


def fired(load, times, settle_s=0.0):
    history = DriveHistory()
    for at_s in times:
        history = history.record(load, at_s, at_s + settle_s)
    return history


def test_ten_pulses_of_ten_milliseconds_in_a_second_are_exactly_ten_percent_and_allowed():
    fired(COLD_10_MS, [n / 10 for n in range(100)])
    fired(COLD_10_MS, [1e6 + n * 0.1 for n in range(100)])


def test_an_eleventh_pulse_in_the_second_is_refused_with_the_earliest_time():
    history = fired(COLD_10_MS, [n * 0.05 for n in range(10)])
    with pytest.raises(LimitError, match=r"10% of a second.*1\.000000 s"):
        history.check(COLD_10_MS, 0.5)
    assert history.earliest_s(COLD_10_MS) == 1.0
    history.check(COLD_10_MS, 1.0)


def test_a_shot_at_exactly_the_ready_time_is_allowed_and_one_before_it_is_not():
    settle_s = 0.15534673586477385
    history = DriveHistory().record(COLD_10_MS, 12345.678, 12345.678 + settle_s)
    history.check(COLD_10_MS, 12345.678 + settle_s)
    history.check(COLD_10_MS, history.earliest_s(COLD_10_MS))
    with pytest.raises(LimitError, match="not home yet"):
        history.check(COLD_10_MS, 12345.678 + settle_s - 1e-4)


def test_the_301st_shot_waits_for_the_minute():
    blip = Load(on_s=0.001, heat_J=0.0)
    history = fired(blip, [n * 0.1 for n in range(300)])
    with pytest.raises(LimitError, match=r"limit 300.*60\.000000 s"):
        history.check(blip, 30.0)
    assert history.earliest_s(blip) == 60.0
    assert history.record(blip, 60.0, 60.0).earliest_s(blip) == pytest.approx(60.1)


def test_the_first_shot_may_come_at_any_time():
    assert DriveHistory().earliest_s(COLD_10_MS) == -math.inf
    DriveHistory().check(COLD_10_MS, 0.0)


def test_the_next_shot_waits_for_the_end_of_the_pulse_even_if_the_magnet_were_home_before_it():
    history = DriveHistory().record(COLD_10_MS, 5.0, 5.004)
    assert history.ready_s == 5.010
    with pytest.raises(LimitError, match=r"not home yet.*5\.010000 s"):
        history.check(COLD_10_MS, 5.006)
    history.check(COLD_10_MS, 5.010)


@pytest.mark.parametrize("at_s", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_no_number_is_refused(at_s):
    with pytest.raises(LimitError, match="at_s"):
        DriveHistory().check(COLD_10_MS, at_s)
    with pytest.raises(LimitError, match="ready_s"):
        DriveHistory().record(COLD_10_MS, 0.0, math.nan)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0])
def test_a_load_that_is_no_number_is_refused(value):
    with pytest.raises(LimitError, match="on_s"):
        Load(on_s=value, heat_J=0.0)
    with pytest.raises(LimitError, match="heat_J"):
        Load(on_s=0.0, heat_J=value)
    with pytest.raises(LimitError, match="resistance_ohm"):
        load_of(Pulse(voltage_V=16.0, pulse_s=0.010), min(value, 0.0))


def test_the_heat_of_a_pulse_is_that_of_its_full_voltage_on_the_resistance():
    load = load_of(Pulse(voltage_V=16.0, pulse_s=0.010), 2.9)
    assert load.on_s == 0.010
    assert load.heat_J == pytest.approx(16.0**2 / 2.9 * 0.010)
    assert load_of(Effect(effect=1), 2.9) == Load(on_s=0.0, heat_J=0.0)


@pytest.mark.slow
def test_the_papers_drive_at_five_hertz_stays_below_the_temperature_limit():
    load = load_of(Pulse(voltage_V=16.0, pulse_s=0.010), 2.9)
    history = fired(load, [n / 5 for n in range(10_000)])  # ten time constants
    steady_C = AMBIENT_C + load.heat_J * 5 * 10.0  # power times the thermal resistance
    assert history.coil_celsius(2000.0) == pytest.approx(steady_C, abs=0.1)
    assert history.coil_celsius(1e6) == AMBIENT_C


def test_a_coil_at_80_degrees_waits_until_it_has_cooled():
    hot = Load(on_s=0.010, heat_J=600.0)  # 30 K at once
    history = DriveHistory().record(hot, 0.0, 0.2)
    with pytest.raises(LimitError, match=r"limit 80 degC"):
        history.check(hot, 1.0)
    wait_s = 200.0 * math.log(30.0 / 25.0)  # first-order cooling, 20 J/K times 10 K/W
    assert history.earliest_s(hot) == pytest.approx(wait_s, abs=2e-6)


def test_a_pulse_that_alone_overheats_the_coil_is_never_allowed():
    for load in (Load(on_s=0.010, heat_J=1101.0), Load(on_s=0.2, heat_J=0.0)):
        assert DriveHistory().earliest_s(load) == math.inf
        with pytest.raises(LimitError, match="never allowed"):
            DriveHistory().check(load, 0.0)


@given(shots=st.lists(st.tuples(loads, st.floats(0.0, 0.3), st.floats(0.0, 0.3)), min_size=1, max_size=40))
@settings(max_examples=60, deadline=None)
def test_a_shot_is_allowed_at_its_earliest_time_and_at_any_later_one(shots):
    history, now_s = DriveHistory(), 0.0
    for load, gap_s, settle_s in shots:
        now_s = max(now_s, history.earliest_s(load))
        history.check(load, now_s)
        history.check(load, now_s + gap_s)
        history = history.record(load, now_s, now_s + settle_s)


def warmest_C(fired_shots):
    """The coil's temperature after each shot, by its own cooling law, heat given at once."""
    warmth, last_s, highest = 0.0, 0.0, 0.0
    for at_s, load in fired_shots:
        warmth = warmth * math.exp(-(at_s - last_s) / 200.0) + load.heat_J / 20.0
        last_s, highest = at_s, max(highest, warmth)
    return AMBIENT_C + highest


def on_time_within(fired_shots, start_s, end_s):
    return sum(max(0.0, min(at_s + load.on_s, end_s) - max(at_s, start_s)) for at_s, load in fired_shots)


@given(requests=st.lists(st.tuples(loads, st.floats(0.0, 0.06)), max_size=150))
@settings(max_examples=60, deadline=None)
def test_no_sequence_of_requests_exceeds_the_limits_by_an_independent_count(requests):
    history, now_s, accepted = DriveHistory(), 0.0, []
    for load, gap_s in requests:
        now_s += gap_s
        try:
            history = history.record(load, now_s, now_s + 0.005)
            accepted.append((now_s, load))
        except LimitError:
            assert now_s < history.earliest_s(load)
    edges = [edge for at_s, load in accepted for edge in (at_s, at_s + load.on_s - 1.0)]
    assert all(on_time_within(accepted, edge, edge + 1.0) <= 0.1 + 5e-6 for edge in edges)
    assert all(sum(at_s <= other < at_s + 60.0 for other, _ in accepted) <= 300 for at_s, _ in accepted)
    assert warmest_C(accepted) <= MAX_COIL_C + 1e-3
