import pytest

from device.methods import drive_of, paper_methods, rendering_of
from device.physics import GunParameters, simulate
from device.vibration import VibrationParameters
from device.words import Effect, LimitError, Pulse

METHODS = paper_methods()


def test_the_paper_has_three_methods_which_differ_in_friction():
    assert list(METHODS) == ["vibration", "asymmetric-1", "asymmetric-2"]
    assert METHODS["vibration"] == VibrationParameters()
    assert METHODS["asymmetric-1"] == GunParameters(friction_N=0.21)
    assert METHODS["asymmetric-2"] == GunParameters(friction_N=1.12)


def test_everything_but_friction_comes_from_the_given_gun():
    methods = paper_methods(GunParameters(drive_off="open", voltage_V=12.0, friction_N=0.5))
    assert methods["asymmetric-2"] == GunParameters(drive_off="open", voltage_V=12.0, friction_N=1.12)


def test_a_method_is_driven_by_its_own_numbers():
    assert drive_of(METHODS["asymmetric-1"]) == Pulse(voltage_V=16.0, pulse_s=0.010)
    assert drive_of(METHODS["vibration"]) == Effect(effect=1)


def test_a_method_beyond_the_supply_can_be_simulated_but_not_commanded():
    strong = GunParameters(voltage_V=30.0)
    assert simulate(strong).status == "home"
    with pytest.raises(LimitError, match="voltage_V is 30"):
        drive_of(strong)


def test_the_next_shot_waits_for_the_magnet_and_a_vibration_for_its_end():
    assert rendering_of(METHODS["asymmetric-2"]).settle_s == simulate(GunParameters(friction_N=1.12)).reset_end_s
    assert rendering_of(METHODS["vibration"]).settle_s == 0.024


def test_another_drive_has_another_settling_time():
    weak = Pulse(voltage_V=8.0, pulse_s=0.010)
    expected = simulate(GunParameters(friction_N=1.12, voltage_V=8.0)).reset_end_s
    assert rendering_of(METHODS["asymmetric-2"], weak).settle_s == expected


def test_a_pulse_that_moves_nothing_settles_with_its_end():
    rendering = rendering_of(METHODS["asymmetric-1"], Pulse(voltage_V=0.1, pulse_s=0.010))
    assert rendering.motion == "no-break-away"
    assert rendering.settle_s == 0.010


def test_a_shot_that_leaves_the_magnet_out_is_refused():
    with pytest.raises(LimitError, match=r"friction_N 1.7.*stuck"):
        rendering_of(GunParameters(friction_N=1.7))


def test_a_drive_of_the_other_kind_is_refused():
    with pytest.raises(LimitError, match="driven by an Effect"):
        rendering_of(METHODS["vibration"], Pulse(voltage_V=16.0, pulse_s=0.010))
    with pytest.raises(LimitError, match="driven by a Pulse"):
        rendering_of(METHODS["asymmetric-1"], Effect(effect=1))
