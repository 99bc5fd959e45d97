"""Guns far from the paper's: a magnet that creeps costs no more steps the stiffer the gun is, and loses no digit."""

import dataclasses
import json
from pathlib import Path

import pytest

from device.physics import GunParameters, shot, simulate
from device.physics.equations import HOME, NOT_HOME, ShotResult, ShotState, StepSeries, pack

SHOTS = json.loads((Path(__file__).parent / "golden" / "physics_far.json").read_text(encoding="utf-8"))["shots"]


def work(gun):
    """How the shot ended, and the work that it took, which does not depend on the machine."""
    series, result = StepSeries(), ShotResult()
    shot.shoot(pack(gun), ShotState(), series, result)
    return result.status, series.work


@pytest.mark.parametrize("row", SHOTS, ids=lambda row: str(row["gun"]["magnet_mass_kg"]))
def test_a_creeping_magnet_agrees_with_fifty_digits(row):
    found = simulate(GunParameters(**row["gun"]))
    assert found.status == "home"
    for name, digits in row["summary"].items():
        assert getattr(found, name) == pytest.approx(float(digits), rel=1e-12, abs=0.0), name


@pytest.mark.parametrize("row", SHOTS, ids=lambda row: str(row["gun"]["magnet_mass_kg"]))
@pytest.mark.parametrize("name", ["magnet_mass_kg", "inductance_H"])
def test_the_work_does_not_grow_with_the_stiffness(row, name):
    gun = GunParameters(**row["gun"])
    for part in (1.0, 1e-2, 1e-4):
        status, units = work(dataclasses.replace(gun, **{name: part * getattr(gun, name)}))
        assert status == HOME
        assert units < 2000  # in plain steps, thousands of the gun as it is and the more the lighter


def test_a_plain_shot_is_no_work():
    assert all(work(GunParameters(friction_N=friction))[1] < 60 for friction in (0.21, 1.12))


def test_a_shot_that_is_too_much_work_is_given_up_as_not_home(monkeypatch):
    monkeypatch.setattr(shot, "MAX_WORK", 12)
    assert work(GunParameters())[0] == NOT_HOME
