"""The gun's clock on the host's: within 1 ms after 50 exchanges with 5 ms of jitter, and never beyond its bound."""

from random import Random

import pytest

from device.serial_gun.lines import Clocks, Exchange

GUN_BOOT_S = 1234.5


def exchanges(draw, count, drift_ppm=0.0, *, jitter_s=0.005, every_s=0.25, start_s=2000.0):
    """Questions to a gun whose clock is `drift_ppm` fast, each way late by up to `jitter_s`."""
    for number in range(count):
        sent_s = start_s + every_s * number
        read_s = sent_s + draw.random() * jitter_s
        yield Exchange(sent_s=sent_s, gun_us=gun_us(read_s, drift_ppm), received_s=read_s + draw.random() * jitter_s)


def gun_us(host_s, drift_ppm):
    return int((host_s - GUN_BOOT_S) * (1e6 + drift_ppm))


@pytest.mark.slow
@pytest.mark.parametrize("drift_ppm", [-100.0, 0.0, 30.0, 100.0])
@pytest.mark.parametrize("every_s", [0.011, 0.25])
def test_after_fifty_exchanges_with_jitter_a_tick_is_known_below_a_millisecond(drift_ppm, every_s):
    for seed in range(20):
        clocks = Clocks()
        for exchange in exchanges(Random(seed), 50, drift_ppm, every_s=every_s):
            clocks.add(exchange)
        at_s = exchange.received_s + 0.010
        found = clocks.host(gun_us(at_s, drift_ppm))
        assert abs(found.time_s - at_s) < 0.001
        assert abs(found.time_s - at_s) <= found.uncertainty_s + 2e-6
        assert found.uncertainty_s < 0.0015


@pytest.mark.slow
def test_the_bound_holds_at_every_moment_of_an_hour_and_the_drift_is_found():
    clocks, draw = Clocks(), Random(3)
    for number, exchange in enumerate(exchanges(draw, 3_600, 42.0, every_s=1.0)):
        clocks.add(exchange)
        if number > 5:
            at_s = exchange.received_s + draw.random() * 0.3
            found = clocks.host(gun_us(at_s, 42.0))
            assert abs(found.time_s - at_s) <= found.uncertainty_s + 2e-6
    ticks = clocks.gun_us(3_000.0) - clocks.gun_us(2_000.0)
    assert 1e15 / ticks - 1e6 == pytest.approx(-42.0, abs=5.0)


def test_a_lopsided_line_does_not_deceive_the_bound():
    clocks = Clocks()
    for exchange in exchanges(Random(1), 50):
        late = Exchange(sent_s=exchange.sent_s, gun_us=exchange.gun_us, received_s=exchange.received_s + 0.016)
        clocks.add(late)
    at_s = late.received_s
    found = clocks.host(gun_us(at_s, 0.0))
    assert 0.006 < abs(found.time_s - at_s) <= found.uncertainty_s + 2e-6  # what is on the way back cannot be known


def test_a_clock_that_was_set_is_learnt_anew():
    clocks = Clocks()
    for exchange in exchanges(Random(1), 50):
        clocks.add(exchange)
    for exchange in exchanges(Random(2), 10, start_s=2100.0):
        clocks.add(
            Exchange(sent_s=exchange.sent_s, gun_us=exchange.gun_us - 90_000_000, received_s=exchange.received_s)
        )
    at_s = exchange.received_s
    found = clocks.host(gun_us(at_s, 0.0) - 90_000_000)
    assert abs(found.time_s - at_s) <= found.uncertainty_s + 2e-6


def test_there_and_back_is_the_same_tick():
    clocks = Clocks()
    for exchange in exchanges(Random(1), 80, 50.0):
        clocks.add(exchange)
    for ahead_s in (0.0, 0.5, 2.0):
        at_s = exchange.received_s + ahead_s
        assert clocks.host(clocks.gun_us(at_s)).time_s == pytest.approx(at_s, abs=1e-4)


def test_before_any_exchange_nothing_is_known():
    assert not Clocks().known
    for ask in (Clocks().host, Clocks().gun_us):
        with pytest.raises(ValueError, match="no exchange yet"):
            ask(1)
