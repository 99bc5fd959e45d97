"""Shots side by side, in lanes, come to what each of them comes to alone."""

import itertools

import numpy as np
import pytest

from device.physics import GunParameters, simulate_batch
from tests.benchmarks.lanes import numbers_of
from tests.benchmarks.problem import random_shots
from tests.extreme_guns import EXTREMES, SPREAD
from tests.physics_claims import VARIANTS
from tests.random_guns import ALONE, NUMBERS, differences, drawn, shot_alone

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _compiler():
    pytest.importorskip("numba")


def same_bits(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in (*NUMBERS, "status")
    )


@pytest.mark.parametrize("emf", ["printed", "reciprocal"])
def test_lanes_give_the_bits_of_a_gun_alone(emf):
    gun, arrays = GunParameters(drive_off="open", emf=emf), drawn(np.random.default_rng(1), 1000, factor=2.0)
    assert same_bits(simulate_batch(gun, **arrays), shot_alone(gun, arrays))


@pytest.mark.parametrize(("drive_off", "emf"), VARIANTS)
@pytest.mark.parametrize("decades", [0.6, 3, 12])
def test_lanes_keep_status_and_eleven_digits_however_far_from_the_papers_gun(drive_off, emf, decades):
    gun = GunParameters(drive_off=drive_off, emf=emf)
    arrays = drawn(np.random.default_rng(2), 1500, factor=10 ** (decades / 2))
    found, alone = simulate_batch(gun, **arrays), shot_alone(gun, arrays)
    assert np.array_equal(found.status, alone.status)
    assert differences(found, alone).max() < 1e-11


@pytest.mark.parametrize(("drive_off", "emf"), VARIANTS)
def test_every_extreme_and_pair_of_extremes_is_in_lanes_what_it_is_alone(drive_off, emf):
    gun = GunParameters(drive_off=drive_off, emf=emf)
    changes = [dict(EXTREMES[one]) | EXTREMES[other] for one, other in itertools.product(EXTREMES, repeat=2)]
    arrays = {name: np.array([change.get(name, getattr(gun, name)) for change in changes]) for name in SPREAD}
    found, alone = simulate_batch(gun, **arrays), shot_alone(gun, arrays)
    assert np.array_equal(found.status, alone.status)
    assert differences(found, alone).max() < 1e-11


def test_the_neighbours_of_a_gun_change_nothing():
    rng = np.random.default_rng(3)
    arrays = drawn(rng, 400, factor=30.0)
    order = rng.permutation(400)
    straight, mixed = (
        simulate_batch(GunParameters(), emf=emf, drive_off=off, **each)
        for each, emf, off in (
            (arrays, OPTIONS["emf"], OPTIONS["drive_off"]),
            (
                {name: column[order] for name, column in arrays.items()},
                OPTIONS["emf"][order],
                OPTIONS["drive_off"][order],
            ),
        )
    )
    for name in (*NUMBERS, "status"):
        assert np.array_equal(getattr(straight, name)[order], getattr(mixed, name), equal_nan=True)


OPTIONS = {
    "emf": np.resize(["printed", "printed", "reciprocal"], 400),
    "drive_off": np.resize(["open", "shorted"], 400),
}


@pytest.mark.parametrize("count", [1, ALONE, ALONE + 1, 17, 4096 + 3])
def test_any_number_of_guns_has_a_result_each(count):
    found = simulate_batch(GunParameters(drive_off="open"), friction_N=np.linspace(0.1, 1.2, count))
    assert len(found.status) == count
    assert (found.status == 0).all()
    assert np.isfinite(found.reset_end_s).all()


def test_a_bad_gun_among_many_spoils_no_other():
    friction_N = np.linspace(0.1, 1.2, 50)
    bad = friction_N.copy()
    bad[[3, 20]] = np.nan, -1.0
    found, good = simulate_batch(friction_N=bad), simulate_batch(friction_N=friction_N)
    assert [n for n, name in enumerate(found.names()) if name == "invalid"] == [3, 20]
    kept = np.delete(np.arange(50), [3, 20])
    assert np.array_equal(found.reset_end_s[kept], good.reset_end_s[kept])


@pytest.mark.parametrize("drive_off", ["open", "shorted"])
def test_the_guns_of_fifty_digits_are_as_right_in_lanes_as_alone(drive_off):
    arrays = numbers_of(random_shots(drive_off).guns)
    gun = GunParameters(drive_off=drive_off)
    assert differences(simulate_batch(gun, **arrays), shot_alone(gun, arrays)).max() < 1e-12


def test_a_series_that_leaves_the_range_of_floats_leaves_its_lane():
    gun = GunParameters(resistance_ohm=1e-308, inductance_H=2.5e-312, voltage_V=1.8e-301, back_emf_V_s_m=0.0)
    depths_m = {"contact_depth_m": np.full(16, 5e-4)}
    found = simulate_batch(gun, **depths_m)
    assert same_bits(found, shot_alone(gun, depths_m))
    assert found.names().tolist() == ["not-home"] * 16
