"""Batches give the digits of single shots, compiled or not, and one bad gun spoils no other."""

import dataclasses
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from device.messages import RecoilError
from device.physics import FIDELITIES, GunParameters, ShotBatch, batch, compiled_simulator, simulate, simulate_batch

ROOT = Path(__file__).parent.parent
NUMBERS = [field.name for field in dataclasses.fields(ShotBatch) if field.name != "status"]


@pytest.fixture(params=["compiled", "interpreted"])
def engine(request, monkeypatch):
    if request.param == "interpreted":
        monkeypatch.setattr(batch, "find_spec", lambda _name: None)
    else:
        pytest.importorskip("numba")
    return request.param


@pytest.mark.slow
@pytest.mark.parametrize("drive_off", ["shorted", "open"])
def test_a_batch_gives_the_digits_of_single_shots(engine, drive_off):
    rng = np.random.default_rng(3)
    arrays = {
        "friction_N": rng.uniform(0, 2, 20),
        "voltage_V": rng.uniform(0, 24, 20),
        "pulse_s": rng.uniform(0, 0.03, 20),
    }
    found = simulate_batch(GunParameters(drive_off=drive_off), **arrays)
    for n, values in enumerate(zip(*(column.tolist() for column in arrays.values()), strict=True)):
        alone = simulate(GunParameters(drive_off=drive_off, **dict(zip(arrays, values, strict=True))))
        assert found.names()[n] == alone.status
        for name in NUMBERS:
            expected = getattr(alone, name)
            assert getattr(found, name)[n] == pytest.approx(
                math.nan if expected is None else expected, rel=1e-13, abs=0, nan_ok=True
            )


@pytest.mark.slow
def test_what_is_no_gun_is_invalid_and_spoils_no_other(engine):
    found = simulate_batch(magnet_mass_kg=[0.114, 0.0, math.nan, -1.0, math.inf], friction_N=0.21)
    assert found.names().tolist() == ["home", *["invalid"] * 4]
    assert all(np.isnan(getattr(found, name)[1:]).all() for name in NUMBERS)


@pytest.mark.slow
def test_options_and_models_may_differ_within_a_batch(engine):
    found = simulate_batch(drive_off=["open", "shorted", "ajar"], emf="reciprocal", fidelity="no-inductance")
    assert found.names().tolist() == ["home", "home", "invalid"]
    alone = simulate(GunParameters(drive_off="open", emf="reciprocal"), "no-inductance")
    assert found.impact_speed_m_s[0] == pytest.approx(alone.impact_speed_m_s, rel=1e-13)


def test_arrays_are_broadcast_and_progress_is_told():
    told = []
    found = simulate_batch(friction_N=np.linspace(0.2, 1.0, 3)[:, None], voltage_V=[15.0, 16.0], progress=told.append)
    assert len(found.status) == sum(told) == 6
    with pytest.raises(ValueError, match="no such parameter: colour"):
        simulate_batch(colour=[1.0])
    with pytest.raises(ValueError, match="fidelity is 'best'"):
        simulate_batch(fidelity="best")


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_a_compiled_shot_has_the_digits_of_an_interpreted_one(fidelity):
    pytest.importorskip("numba")
    guns = [GunParameters(friction_N=f, drive_off=off) for f in (0.21, 1.12, 1.7) for off in ("open", "shorted")]
    guns += [GunParameters(emf="reciprocal", return_friction_N=1.12)]
    compiled = compiled_simulator()
    for gun in guns:
        expected, found = simulate(gun, fidelity), compiled(gun, fidelity)
        assert found.status == expected.status
        for name in NUMBERS:
            ours, theirs = (getattr(summary, name) for summary in (found, expected))
            assert (ours is None and theirs is None) or ours == pytest.approx(theirs, rel=1e-13)


@pytest.mark.parametrize(
    "change",
    [
        {"back_emf_V_s_m": 1e308, "emf": "reciprocal"},
        {"magnet_mass_kg": 5e-324},
        {"resistance_ohm": 5e-324},
        {"motor_constant_N_A": 1.797e308},
    ],
)
def test_what_leaves_the_range_of_floats_ends_alike_compiled_or_interpreted(change):
    pytest.importorskip("numba")
    expected, found = simulate(GunParameters(**change)), compiled_simulator()(GunParameters(**change))
    assert dataclasses.asdict(found) == dataclasses.asdict(expected)
    assert expected.max_displacement_m is not None


@pytest.mark.slow
def test_a_compiled_shot_changes_nothing_for_the_next_interpreted_one():
    code = (
        "import sys; from device.physics import *; gun = GunParameters(); first = simulate(gun);"
        "compiled_simulator()(gun); run = []; sys.setprofile(lambda frame, *_: run.append(frame.f_code.co_name));"
        "second = simulate(gun); sys.setprofile(None); sys.exit(first != second or 'shoot' not in run)"
    )
    pytest.importorskip("numba")
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_without_the_compiler_a_compiled_shot_is_refused(monkeypatch):
    monkeypatch.setattr(batch, "find_spec", lambda _name: None)
    batch.compiled.cache_clear()
    with pytest.raises(RecoilError, match=r"recoil\[fast\]"):
        compiled_simulator()


@pytest.mark.slow
def test_a_batch_as_summaries_is_its_single_shots():
    found = simulate_batch(friction_N=[0.21, 1.12, 1.7]).summaries()
    assert [shot.status for shot in found] == ["home", "home", "stuck"]
    assert found[2].reset_end_s is None
    assert found[0].reset_end_s == pytest.approx(simulate(GunParameters()).reset_end_s, rel=1e-13)


@pytest.mark.slow
def test_a_session_never_loads_the_compiler():
    code = "import sys; from device.physics import *; simulate(GunParameters()); sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_what_one_process_compiled_is_found_by_the_next():
    pytest.importorskip("numba")
    code = "import sys; from device.physics.batch import machine_code; sys.stdout.write(machine_code().__qualname__)"
    names = {subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout for _ in range(2)}
    assert len(names) == 1


KEPT = """
import resource, sys, numpy as np
from device.physics.batch import call, compiled
def twice(numbers):
    for n in range(len(numbers)):
        numbers[n] *= 2.0
numbers = np.ones(3)
if "full" in sys.argv:
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
call(compiled(twice), numbers)
sys.stdout.write(f"{numbers.sum():g}")
"""
"""What the compiler keeps has a file of its own: it keeps nothing of what was typed."""


@pytest.fixture
def twice(tmp_path):
    """A process that has a function compiled, and calls it once; the folder of what the compiler keeps."""
    pytest.importorskip("numba")
    file, kept = tmp_path / "kept.py", tmp_path / "cache"
    file.write_text(KEPT, encoding="utf-8")
    kept.mkdir()

    def run(*words):
        variables = os.environ | {"NUMBA_CACHE_DIR": str(kept), "PYTHONPATH": str(ROOT)}
        return subprocess.run(
            [sys.executable, file, *words], capture_output=True, text=True, check=False, env=variables
        )

    return run, kept


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("size", [0, 40])
def test_what_is_damaged_in_the_compilers_cache_is_made_anew(twice, ending, size):
    run, kept = twice
    assert run().stdout == "6"
    (file,) = kept.rglob(f"*.{ending}")
    whole = file.read_bytes()
    file.write_bytes(whole[:size])
    done = run()
    assert (done.returncode, done.stdout) == (0, "6"), done.stderr
    (file,) = kept.rglob(f"*.{ending}")
    assert len(file.read_bytes()) == len(whole)


@pytest.mark.slow
def test_a_compilers_cache_without_room_stands_in_no_way(twice):
    run, kept = twice
    done = run("full")
    assert (done.returncode, done.stdout) == (0, "6"), done.stderr
    assert not [*kept.rglob("*.nbc")]


@pytest.mark.slow
def test_a_return_friction_of_its_own_is_the_guns_and_an_arrays():
    alone = [simulate(GunParameters(friction_N=f, return_friction_N=r)) for f in (0.21, 0.5) for r in (0.3, 1.12)]
    out, back = [0.21, 0.21, 0.5, 0.5], [0.3, 1.12, 0.3, 1.12]
    expected = [shot.reset_end_s for shot in alone]
    assert simulate_batch(friction_N=out, return_friction_N=back).reset_end_s.tolist() == expected
    assert simulate_batch(return_friction_N=back, friction_N=out).reset_end_s.tolist() == expected
    kept = simulate_batch(GunParameters(return_friction_N=1.12), friction_N=[0.21, 0.5])
    assert kept.reset_end_s.tolist() == expected[1::2]
    assert simulate_batch(return_friction_N=[math.nan, 1.0]).names().tolist() == ["invalid", "home"]
