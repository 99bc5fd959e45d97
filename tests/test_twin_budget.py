from __future__ import annotations

from device.twin.budget import DUTY_US, Budget
from device.wire import errors
from device.wire.records import Setting

PULSE = Setting(method="M", way="FORW", kind="PULS", amount=16_000, length_us=20_000, rest_us=50_000)
EFFECT = Setting(method="M", way="FORW", kind="EFF", amount=1, length_us=24_000, rest_us=50_000)


def spent(*settings: Setting) -> Budget:
    budget = Budget()
    for number, setting in enumerate(settings):
        budget.spend(setting, 50_000 * number)
    return budget


def test_five_pulses_of_20_ms_fill_a_second() -> None:
    assert 5 * PULSE.length_us == DUTY_US
    assert spent(*[PULSE] * 4).refusal(PULSE, 200_000) == errors.NONE
    assert spent(*[PULSE] * 5).refusal(PULSE, 250_000) == errors.DUTY


def test_a_vibration_in_between_hides_no_earlier_pulse() -> None:
    assert spent(*[PULSE] * 4, EFFECT).refusal(PULSE, 250_000) == errors.NONE
    assert spent(*[PULSE] * 4, EFFECT, PULSE).refusal(PULSE, 300_000) == errors.DUTY


def test_what_lies_a_second_back_counts_no_more() -> None:
    assert spent(*[PULSE] * 5).refusal(PULSE, 1_000_000) == errors.NONE
