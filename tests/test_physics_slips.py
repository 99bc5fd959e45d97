"""A magnet that sticks and slips thousands of times: the slips that are read off are those that would be made.

The numbers of one such gun in fifty digits are in golden/physics_far.json (tests/test_physics_slow.py).
"""

import dataclasses
import math

import numpy as np
import pytest

from device.physics import GunParameters, ShotSummary, shot, simulate, simulate_batch, slips
from device.physics.equations import OVER, ShotResult, ShotState, StepSeries, pack
from tests.extreme_guns import SLIPPING, work

LONG = GunParameters(
    magnet_mass_kg=6.734e-4,
    back_emf_V_s_m=1.125,
    resistance_ohm=0.2159,
    inductance_H=0.579,
    motor_constant_N_A=0.1178,
    coil_reach_m=0.04211,
    stiffness_N_m=0.9622,
    preload_length_m=0.004056,
    friction_N=0.01809,
    voltage_V=11390.0,
    pulse_s=5.638,
    contact_depth_m=3.934e-6,
    drive_off="open",
)
"""So many that, one by one, they are more work than is done for a shot."""
NUMBERS = [one.name for one in dataclasses.fields(ShotSummary) if one.name != "status"]


def assert_alike(found, expected, rel=2e-12):
    assert found.status == expected.status
    for name in NUMBERS:
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=rel, abs=0.0), name


@pytest.fixture
def one_by_one(monkeypatch):
    """The summary of a gun whose slips are all made, however many."""

    def shoot(gun):
        with monkeypatch.context() as patched:
            patched.setattr(slips, "MANY_SLIPS", math.inf)
            patched.setattr(shot, "MAX_WORK", math.inf)
            patched.setattr(shot, "MAX_SEGMENTS", 10**7)
            return simulate(gun), work(gun)[1]

    return shoot


@pytest.mark.slow
def test_slips_that_are_read_off_are_those_that_would_be_made(one_by_one):
    plain, plain_units = one_by_one(SLIPPING)
    assert_alike(simulate(SLIPPING), plain)
    assert work(SLIPPING)[1] < 0.1 * plain_units


@pytest.mark.slow
def test_a_shot_of_more_slips_than_can_be_made_comes_home(one_by_one):
    plain, plain_units = one_by_one(LONG)
    assert plain_units > shot.MAX_WORK
    assert plain.status == "home"
    assert_alike(simulate(LONG), plain)


@pytest.mark.slow
@pytest.mark.parametrize("pulse_s", np.random.default_rng(4).uniform(0.106, 0.115, 8).tolist())
def test_a_pulse_may_end_in_any_slip(pulse_s, one_by_one):
    """Of 20 to 200 slips: the last ones before it ends are made, wherever in a slip or between two it ends."""
    gun = dataclasses.replace(SLIPPING, pulse_s=pulse_s)
    assert_alike(simulate(gun), one_by_one(gun)[0])


@pytest.mark.slow
@pytest.mark.parametrize("gun", [SLIPPING, LONG], ids=["1,773", "many"])
def test_compiled_they_are_the_same(gun):
    pytest.importorskip("numba")
    (found,) = simulate_batch(gun).summaries()
    assert_alike(found, simulate(gun))


@pytest.mark.slow
def test_slips_that_would_have_to_be_more_exact_are_made(monkeypatch, one_by_one):
    monkeypatch.setattr(slips, "_EXACT", 0.0)
    gun = dataclasses.replace(SLIPPING, pulse_s=0.112)
    found, (plain, plain_units) = simulate(gun), one_by_one(gun)
    assert found == plain
    assert work(gun)[1] > plain_units  # those at the nodes were made besides


@pytest.mark.parametrize("left", [1e-9, -1e-9, 1e-4])
def test_where_no_slip_follows_another_there_is_none(left):
    """So near the limit that a slip goes past it, past the limit, or where the drive's change comes first."""
    gun, s, w = pack(SLIPPING), ShotState(live=True, u=2560.0, drive_until=1e-5), StepSeries()
    w.limit = slips.limit_of_slips(gun, s.u)
    assert slips.slip(gun, s, w, left) == (0.0, 0.0)
    assert (s.time, s.drive_until) == (0.0, 1e-5)


def test_a_slip_of_the_recoil_stage_is_made():
    """Its force counts."""
    gun, s, w = pack(SLIPPING), ShotState(live=True, heading=1.0, slips=1000), StepSeries()
    slips.slip_on(gun, s, w, ShotResult(stage=OVER - 1))
    assert w.work == 0
