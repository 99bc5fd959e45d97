import math
import re
import subprocess
import sys

import numpy as np
import pytest

from device import DeviceError, Effect, LimitError, LinkError, Pulse, Shot
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V

PULSE = Pulse(voltage_V=16.0, pulse_s=0.010)


def test_the_limits_themselves_are_allowed():
    assert Pulse(voltage_V=MAX_VOLTAGE_V, pulse_s=MAX_PULSE_S).voltage_V == 24.0
    assert Pulse(voltage_V=0.0, pulse_s=0.0).pulse_s == 0.0


@pytest.mark.parametrize("voltage_V", [math.nextafter(24.0, 25.0), -1e-9, math.inf, math.nan])
def test_a_pulse_beyond_24_volts_cannot_be_built(voltage_V):
    with pytest.raises(LimitError, match=r"voltage_V is .* between 0 and 24"):
        Pulse(voltage_V=voltage_V, pulse_s=0.010)


@pytest.mark.parametrize("pulse_s", [math.nextafter(0.020, 1.0), -1e-9, math.inf, math.nan])
def test_a_pulse_beyond_20_milliseconds_cannot_be_built(pulse_s):
    with pytest.raises(LimitError, match=r"pulse_s is .* between 0 and 0.02"):
        Pulse(voltage_V=16.0, pulse_s=pulse_s)


@pytest.mark.parametrize("wrong", [None, "16", True, [0.01], 1j])
def test_a_pulse_of_the_wrong_kind_is_refused_by_field_value_and_rule(wrong):
    for field, rule in (("voltage_V", "between 0 and 24"), ("pulse_s", r"between 0 and 0\.02")):
        numbers = {"voltage_V": 16.0, "pulse_s": 0.010, field: wrong}
        with pytest.raises(ValueError, match=re.escape(f"{field} is {wrong!r}; it must be a number ") + rule):
            Pulse(**numbers)


def test_whole_numbers_and_numpys_make_a_pulse():
    assert Pulse(voltage_V=16, pulse_s=np.float64(0.010)) == PULSE


@pytest.mark.parametrize("effect", [None, "1", True, 1.0, 1.5])
def test_an_effect_of_the_wrong_kind_is_refused_by_value_and_rule(effect):
    with pytest.raises(ValueError, match=re.escape(f"effect is {effect!r}; it must be a whole number from 1 to 123")):
        Effect(effect=effect)


@pytest.mark.parametrize("effect", [0, 124, -1])
def test_an_effect_that_the_driver_does_not_have_cannot_be_built(effect):
    with pytest.raises(LimitError, match="effect"):
        Effect(effect=effect)


def test_a_shot_names_its_method_and_one_of_two_directions():
    with pytest.raises(LimitError, match="method"):
        Shot(method="", direction="forward", drive=PULSE)
    with pytest.raises(LimitError, match=r"'up'.*forward, backward"):
        Shot(method="vibration", direction="up", drive=PULSE)  # type: ignore[arg-type]


@pytest.mark.parametrize(("field", "wrong"), [("method", None), ("method", 1), ("direction", 1), ("drive", 16.0)])
def test_a_shot_of_the_wrong_kind_is_refused_by_field_and_value(field, wrong):
    with pytest.raises(ValueError, match=f"{field} is {wrong!r}; it must"):
        Shot(**{"method": "vibration", "direction": "forward", "drive": PULSE, field: wrong})


def test_a_limit_error_is_a_value_error_and_both_errors_are_device_errors():
    assert issubclass(LimitError, ValueError)
    assert issubclass(LimitError, DeviceError)
    assert issubclass(LinkError, DeviceError)


def test_importing_the_room_brings_in_no_numerics():
    code = "import sys, device, device.methods, device.limits; sys.exit(bool({'numpy', 'scipy'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
