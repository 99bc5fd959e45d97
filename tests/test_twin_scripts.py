"""Whatever is said to the gun's core: it stays in bounds, each pulse ends, and the same script says the same."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.twin.machine import LATE_EFFECT_US
from device.wire.errors import WireError, message
from device.wire.records import MAX_LINE
from tests.twin_hosts import Hand, Strict
from tests.twin_scripts import MAX_LATE_US, TELLING_SEEDS, random_script, transcript


def test_the_error_queue_is_bounded_and_says_so():
    hand = Hand()
    for _ in range(100):
        hand.say("FOO")
    found = [hand.error() for _ in range(17)]
    assert found == ['-113,"Undefined header"'] * 15 + ['-350,"Queue overflow"', '0,"No error"']
    hand.say("FOO")
    hand.say("*CLS")
    assert hand.error() == '0,"No error"'


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(25))
def test_whatever_is_said_each_pulse_ends_in_time_and_none_comes_too_soon(seed):
    starts, on = [], None
    for line in transcript(random_script(seed)):
        word, time, *rest = line.split()
        on = None if word == "boot" else on
        if word != "drive":
            continue
        if rest[0] == "OFF":
            assert on is not None
            assert int(time) - on[0] <= (20_000 if on[1] == "PULS" else 1_000_000) + MAX_LATE_US
            on = None
        else:
            assert on is None
            on = (int(time), rest[0])
            starts.append(on[0])
    assert all(later - sooner >= 10_000 - LATE_EFFECT_US for sooner, later in pairwise(starts))


@pytest.mark.slow
def test_a_script_gives_the_same_transcript_again_and_reaches_every_error():
    seen = set()
    for seed in TELLING_SEEDS:
        lines = list(transcript(random_script(seed)))
        assert seed > 3 or lines == list(transcript(random_script(seed)))
        for out in (bytes.fromhex(line.split()[2]) for line in lines if line.startswith("out")):
            seen |= {code for code in WireError if message(code).encode() in out}
    assert seen >= set(WireError) - {WireError.QUEUE_OVERFLOW}


@pytest.mark.slow
@given(st.lists(st.tuples(st.binary(max_size=400), st.integers(0, 3_000_000)), max_size=8), st.booleans())
def test_whatever_bytes_come_the_core_answers_in_bounds_and_still_knows_its_name(pieces, strict):
    gun = Strict() if strict else Hand()
    now_us = gun.now_us
    for data, after_us in pieces:
        now_us += after_us
        out, _ = gun.core.step(data, now_us)
        assert len(out) <= (MAX_LINE + 1) * (data.count(b"\n") + 1)
    out, _ = gun.core.step(b"\n*IDN?\n", now_us)
    assert out.endswith(b"Recoil,haptic-gun,TWIN-1,wire 1 firmware 1.1.0\n")
