"""A scene gets the cheapest model that it can bear, and the error it was promised holds."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from device.physics import FIDELITIES, SCENES, GunParameters, Scene, choose_model, simulate
from device.physics.hand import compliant_collision, rigid_collision
from device.physics.scenes import COSTS, FRICTION_N, NEAR, NEEDED, choose_contact, stated_error
from tests.benchmarks.flops import operations
from tests.benchmarks.problem import guns
from tests.conftest import Recoil
from tests.extreme_guns import NUMBERS, OPTIONS, PAPER


@st.composite
def guns_near_the_paper(draw: st.DrawFn) -> GunParameters:
    numbers: dict[str, Any] = {name: getattr(PAPER, name) * draw(st.floats(1.0 - NEAR, 1.0 + NEAR)) for name in NUMBERS}
    friction, (off, emf) = draw(st.floats(*FRICTION_N)), draw(st.sampled_from(OPTIONS))
    return GunParameters(**numbers, friction_N=friction, drive_off=off, emf=emf)


def scenes() -> st.SearchStrategy[Scene]:
    bounds = st.floats(-3.0, 0.3).map(lambda power: 10.0**power)
    needs = st.dictionaries(st.sampled_from(NEEDED), bounds, min_size=1, max_size=3)
    own = needs.map(lambda errors: Scene(name="own", needs=errors))
    return st.one_of(own, st.sampled_from(list(SCENES.values())))


@pytest.mark.slow
@settings(max_examples=150)
@given(guns_near_the_paper(), scenes())
def test_the_picked_model_is_as_near_to_full_as_was_promised_and_as_the_scene_bears(
    gun: GunParameters, scene: Scene
) -> None:
    choice = choose_model(scene, gun)
    full, found = simulate(gun), simulate(gun, choice.fidelity)
    assert found.status == full.status
    for output, borne in scene.needs.items():
        error = abs(getattr(found, output) / getattr(full, output) - 1)
        assert error <= choice.errors[output] <= borne, (choice.fidelity, output)


@pytest.mark.slow
@settings(max_examples=150)
@given(guns_near_the_paper(), scenes())
def test_every_cheaper_model_would_be_beyond_what_the_scene_bears(gun: GunParameters, scene: Scene) -> None:
    choice = choose_model(scene, gun)
    if scene.curves:
        assert choice.fidelity == "full"
        return
    for fidelity in COSTS[: COSTS.index(choice.fidelity)]:
        assert fidelity in choice.reason
        assert any(stated(fidelity, output, gun) > borne for output, borne in scene.needs.items())


def stated(fidelity: str, output: str, gun: GunParameters) -> float:
    """As `scenes` has it; an error e of the speed is (1 + e)^2 - 1 of the collision."""
    if output == "collision_force_N":
        return (1.0 + stated_error(fidelity, "impact_speed_m_s", gun.drive_off, gun.emf)) ** 2 - 1.0
    return stated_error(fidelity, output, gun.drive_off, gun.emf)


@given(st.sampled_from([*NUMBERS, "friction_N"]), st.sampled_from([0.5, 1.2, 6.0]), st.sampled_from(list(SCENES)))
def test_far_from_the_papers_gun_the_pick_is_full_and_says_which_number_is_far(
    name: str, factor: float, scene: str
) -> None:
    far = 0.05 if name == "friction_N" and factor == 0.5 else getattr(PAPER, name) * factor
    if name == "friction_N" and factor == 1.2:
        far = 1.12 * factor
    change: dict[str, Any] = {name: far}
    choice = choose_model(SCENES[scene], dataclasses.replace(PAPER, **change))
    assert choice.fidelity == "full"
    assert name in choice.reason


def test_a_damper_that_brakes_one_way_more_gets_the_full_model() -> None:
    gun = GunParameters(friction_N=0.21, return_friction_N=1.12)
    assert choose_model(SCENES["sweep"], gun).fidelity == "full"
    assert choose_model(SCENES["sweep"], dataclasses.replace(gun, return_friction_N=0.21)).fidelity == "ballistic"


def test_a_table_of_guns_gets_a_model_that_serves_the_worst_of_them() -> None:
    percept = SCENES["percept"]
    assert choose_model(percept, drive_off=["open"]).fidelity == "no-inductance"
    assert choose_model(percept, drive_off=["open", "shorted"]).fidelity == "full"
    assert "friction_N is 2" in choose_model(percept, drive_off=["open"], friction_N=np.array([0.5, 2.0])).reason


@pytest.mark.parametrize(("needs", "named"), [({"colour": 0.1}, "colour"), ({"reset_end_s": 0.0}, "reset_end_s")])
def test_an_output_or_error_that_makes_no_sense_is_named(needs: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        Scene(name="own", needs=needs)


def test_the_order_of_costs_is_that_of_the_operations_counted_over_both_states_of_the_coil() -> None:
    assert sorted(COSTS) == sorted(FIDELITIES)
    both = [*guns("open"), *guns("shorted")]
    counts = [sum(operations(both, fidelity).values()) for fidelity in COSTS]
    assert counts == sorted(counts)


@given(guns_near_the_paper(), st.floats(1e-3, 3.0), st.floats(1e-5, 2e-3))
def test_the_collision_is_as_near_to_a_stop_that_gives_way_as_was_promised(
    gun: GunParameters, speed: float, depth: float
) -> None:
    gun = dataclasses.replace(gun, contact_depth_m=depth)
    contact, error = choose_contact(Scene(name="own", needs={}), gun, speed)
    true = abs(compliant_collision(gun, speed).peak_force_N / rigid_collision(gun, speed).peak_force_N - 1)
    assert contact == "impulse"
    assert true <= error * (1 + 1e-9) + 1e-12
    assert choose_contact(Scene(name="own", needs={}, contact_error=error / 2), gun, speed)[0] == "compliant"


def test_simulate_says_what_it_picked_for_a_scene_and_what_it_stands_for(recoil: Recoil) -> None:
    done = recoil("simulate", "--scene", "sweep", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["fidelity"] == found["scene"]["fidelity"] == "ballistic"
    assert found["scene"]["errors"]["peak_force_N"] <= found["scene"]["needs"]["peak_force_N"]
    said = recoil("simulate", "--need", "reset_end_s=0.02", "--set", "drive_off=open").stdout
    assert "model no-inductance, stated errors reset_end_s 0.014" in said
    assert "not promised: peak_force_N" in said
    alone = recoil("simulate", "--fidelity", "ballistic").stdout
    assert "drive_off shorted until the recoil is over (then no coil)" in alone


def test_in_a_table_no_model_is_picked_that_takes_longer_there_than_the_full_one(recoil: Recoil) -> None:
    """By `recoil bench`; one shot of this scene gets `ballistic`."""
    done = recoil("simulate", "--scene", "sweep", "--vary", "friction_N=0.2,0.3", "--table", "shots.csv", "--json")
    assert json.loads(done.stdout)["scene"]["fidelity"] == "full"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--scene", "opera"), "percept"),
        (("--need", "colour=0.1"), "impact_speed_m_s"),
        (("--need", "reset_end_s=small"), "above 0"),
        (("--scene", "sweep", "--fidelity", "full"), "give one"),
    ],
)
def test_a_scene_that_there_is_not_is_told_with_what_there_is(
    recoil: Recoil, words: tuple[str, ...], named: str
) -> None:
    done = recoil("simulate", *words)
    assert done.returncode == 2
    assert named in done.stderr
    assert "Traceback" not in done.stderr
