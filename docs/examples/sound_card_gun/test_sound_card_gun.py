"""The gun keeps what every gun keeps: `pytest`, after `python -m pip install .` in the environment that has Recoil."""

from device.plugin.conformance import broken, conformance, rig_at


def test_without_a_card_it_keeps_what_every_gun_keeps() -> None:
    assert broken(conformance(rig_at("sound-card:null"))) == []
