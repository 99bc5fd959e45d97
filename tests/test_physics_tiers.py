"""The reduced models stay within the errors that are stated for them, over random guns near the paper's."""

import dataclasses

import numpy as np
import pytest

from device.physics import FIDELITIES, GunParameters, simulate
from device.physics.batch import simulate_batch
from device.physics.scenes import FRICTION_N, NEAR, OUTPUTS, stated_error

OPTIONS = [(off, emf) for off in ("shorted", "open") for emf in ("printed", "reciprocal")]
FIXED = ("friction_N", "return_friction_N", "pulse_s", "contact_depth_m", "drive_off", "emf")
VARIED = [field.name for field in dataclasses.fields(GunParameters) if field.name not in FIXED]
PLAIN = GunParameters()


def guns(seed, count):
    rng = np.random.default_rng(seed)
    changes = {name: getattr(PLAIN, name) * rng.uniform(1 - NEAR, 1 + NEAR, count) for name in VARIED}
    return {**changes, "friction_N": rng.uniform(*FRICTION_N, count)}


@pytest.mark.slow
@pytest.mark.parametrize(("drive_off", "emf"), OPTIONS)
def test_each_model_is_within_its_stated_error(drive_off, emf):
    gun, arrays = GunParameters(drive_off=drive_off, emf=emf), guns(11, 60)
    found = {
        fidelity: [
            simulate(dataclasses.replace(gun, **dict(zip(arrays, row, strict=True))), fidelity)
            for row in zip(*(column.tolist() for column in arrays.values()), strict=True)
        ]
        for fidelity in FIDELITIES
    }
    for fidelity, shots in found.items():
        for shot, full in zip(shots, found["full"], strict=True):
            assert shot.status == full.status == "home"
            for output in OUTPUTS:
                error = abs(getattr(shot, output) / getattr(full, output) - 1)
                assert error <= stated_error(fidelity, output, drive_off, emf), (fidelity, output)


@pytest.mark.soak
@pytest.mark.parametrize(("drive_off", "emf"), OPTIONS)
def test_each_model_is_within_its_stated_error_a_hundred_thousand_times(drive_off, emf):
    gun, arrays = GunParameters(drive_off=drive_off, emf=emf), guns(12, 100_000)
    full = simulate_batch(gun, **arrays)
    for fidelity in FIDELITIES:
        shots = simulate_batch(gun, fidelity=fidelity, **arrays)
        for output in OUTPUTS:
            error = np.abs(getattr(shots, output) / getattr(full, output) - 1).max()
            assert error <= stated_error(fidelity, output, drive_off, emf), (fidelity, output)


@pytest.mark.parametrize(
    ("friction_N", "errors"), [(0.21, (0.15, -0.18, 0.33, 0.15, 0.54)), (1.12, (0.15, -0.19, 0.35))]
)
def test_leaving_the_back_emf_out_costs_what_an_independent_program_found(friction_N, errors):
    gun = GunParameters(friction_N=friction_N, drive_off="open")
    full, reduced = simulate(gun), simulate(gun, "closed-form")
    for output, error in list(zip(OUTPUTS, errors, strict=False))[1:]:
        assert getattr(reduced, output) / getattr(full, output) - 1 == pytest.approx(error, abs=0.01)


def test_without_inductance_the_peak_is_the_force_at_once():
    found = simulate(GunParameters(), "no-inductance")
    assert found.peak_force_N == pytest.approx(7.6 * 16 / 2.9 - 1.4 - 0.21, rel=1e-12)


def test_the_closed_form_is_the_harmonic_arc_of_a_constant_current():
    force, k = 7.6 * 16 / 2.9, 14 + 7.6 * 16 / 2.9 / 0.0075  # at x = 0; spring and fading coil together
    work = (force - 1.4 - 0.21) * 0.0075 - k * 0.0075**2 / 2
    found = simulate(GunParameters(), "closed-form")
    assert found.recoil_impulse_Ns == pytest.approx(np.sqrt(2 * 0.114 * work), rel=1e-12)


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("change", [{"voltage_V": 0.0}, {"friction_N": 1.7}, {"pulse_s": 0.3}, {"stiffness_N_m": 0.0}])
def test_every_model_has_a_status_where_the_shot_is_not_as_usual(fidelity, change):
    found = simulate(GunParameters(**change, drive_off="open"), fidelity)
    full = simulate(GunParameters(**change, drive_off="open"))
    thrown_further = fidelity == "closed-form" and full.status == "stuck"  # far enough for the spring to win
    assert found.status == full.status or (thrown_further and found.status == "home")


def test_no_error_is_stated_for_what_no_model_gives():
    with pytest.raises(ValueError, match="errors are stated for"):
        stated_error("full", "status", "open", "printed")
    with pytest.raises(ValueError, match="fidelity is 'best'"):
        stated_error("best", "peak_force_N", "open", "printed")
    assert stated_error("full", "peak_force_N", "open", "printed") == 1e-12
