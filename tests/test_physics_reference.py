"""The full model against 50 digits by another method: tests/golden/make_physics.py, which imports nothing of ours."""

import pytest

from device.physics import GunParameters, simulate, simulate_batch
from device.physics.scenes import OUTPUTS
from tests.golden_shots import RANDOM, SHOTS


def name_of(shot):
    return f"{shot['friction_N']}-{shot['drive_off']}-{shot['emf']}"


@pytest.mark.parametrize("shot", SHOTS, ids=name_of)
def test_every_number_of_the_summary_agrees_with_fifty_digits_to_a_part_in_a_million_million(shot):
    gun = GunParameters(friction_N=shot["friction_N"], drive_off=shot["drive_off"], emf=shot["emf"])
    found = simulate(gun)
    assert found.status == "home"
    for name, digits in shot["summary"].items():
        assert getattr(found, name) == pytest.approx(float(digits), rel=1e-12, abs=0.0), name


@pytest.mark.slow
@pytest.mark.parametrize("drive_off", ["open", "shorted"])
@pytest.mark.parametrize("engine", ["interpreted", "compiled"])
def test_a_batch_of_two_hundred_random_guns_agrees_with_fifty_digits(engine, drive_off):
    if engine == "compiled":
        pytest.importorskip("numba")
    arrays = {name: [shot.numbers[name] for shot in RANDOM] for name in RANDOM[0].numbers}
    found = simulate_batch(GunParameters(drive_off=drive_off), interpreted=engine == "interpreted", **arrays)
    assert set(found.names()) == {"home"}
    for name in OUTPUTS:
        exact = [float(getattr(shot, drive_off)[name]) for shot in RANDOM]
        assert getattr(found, name).tolist() == pytest.approx(exact, rel=1e-11, abs=0.0), name
