"""What a design's levels come to on the shipped gun."""

from __future__ import annotations

import pytest

from device.words import Effect, Pulse
from experiments.config.door import ConfigError
from experiments.design import stimuli
from experiments.design.limits import limits
from experiments.design.planning import plan_of
from experiments.load import load_gun, shipped_folder
from tests.designs import design

STRONG = {"levels": ["asymmetric-2"]}


@pytest.fixture(scope="module")
def gun():
    return load_gun(shipped_folder() / "gun.toml")


def of_intervals(config, gun, trial):
    held = [trial.levels_at(place) for place in range(max(1, len(trial.intervals)))]
    return tuple(levels and stimuli.stimulus(config, gun, levels) for levels in held)


def shots(config, gun):
    return [of_intervals(config, gun, trial) for trial in plan_of(config, "P01", 1).trials]


def test_a_method_is_the_guns_own(gun):
    config = design(factors={"method": {"levels": ["vibration", "asymmetric-1", "asymmetric-2"]}})
    found = {one.method: one for (one,) in shots(config, gun)}
    assert {name: one.parameters for name, one in found.items()} == gun.renderings((*found,))
    assert found["vibration"].drive == Effect(effect=1)
    assert found["asymmetric-2"].drive == Pulse(voltage_V=16.0, pulse_s=0.010)
    assert all(one.direction == "forward" for one in found.values())


def test_a_number_of_the_drive_goes_with_the_command(gun):
    config = design(factors={"method": STRONG, "voltage_V": {"levels": [12.0, 20.0]}, "pulse_s": {"levels": [0.008]}})
    drives = {one.drive for (one,) in shots(config, gun)}
    assert drives == {Pulse(voltage_V=volts, pulse_s=0.008) for volts in (12.0, 20.0)}
    assert stimuli.by_hand(config) == ()


def test_what_a_hand_sets_is_told_to_the_model_and_to_the_experimenter(gun):
    config = design(
        factors={
            "method": {"levels": ["asymmetric-1"]},
            "damper": {
                "levels": ["off", "on"],
                "labels": {"on": "strips on"},
                "sets": {"off": {"friction_N": 0.21}, "on": {"friction_N": 1.12}},
            },
        }
    )
    plan = plan_of(config, "P01", 1)
    found = {
        stimuli.settings(config, gun, trial.levels): of_intervals(config, gun, trial)[0].parameters.friction_N
        for trial in plan.trials
    }
    assert found == {(("damper", "off"),): 0.21, (("damper", "strips on"),): 1.12}


def test_an_interval_without_a_stimulus_is_empty(gun):
    choice = {"kind": "choice", "text": "When?", "answers": ["first", "second"], "correct": "interval"}
    config = design(
        factors={"method": STRONG, "voltage_V": {"levels": [12.0]}},
        order={"repetitions": 4},
        trial={"kind": "two-interval", "compare": "voltage_V", "standard": "none"},
        questions={"when": choice},
    )
    volts = [tuple(one and one.drive.voltage_V for one in held) for held in shots(config, gun)]
    assert sorted(volts, key=str) == [(12.0, None)] * 2 + [(None, 12.0)] * 2
    caught = design(factors={"method": STRONG}, trial={"catch": 1})
    assert (None,) in shots(caught, gun)


def test_a_catch_trial_beside_methods_that_vary_is_not_known_by_its_damper(gun):
    def caught(*methods, **order):
        return design(factors={"method": {"levels": [*methods]}}, trial={"catch": 2}, order=order)

    with pytest.raises(ConfigError, match="asymmetric-1 has damper off, asymmetric-2 damper on, and catch trials"):
        limits(caught("asymmetric-1", "asymmetric-2"), gun)
    limits(caught("asymmetric-1", "asymmetric-2", session=["method"]), gun)
    methods = dict.fromkeys(("asymmetric-1", "another"), gun.methods["asymmetric-1"])
    alike = type(gun).model_validate(gun.model_copy(update={"methods": methods}).model_dump())
    config = caught("asymmetric-1", "another")
    limits(config, alike)
    held = {trial.catch: stimuli.settings(config, alike, trial.levels) for trial in plan_of(config, "P01", 1).trials}
    assert held == dict.fromkeys((False, True), (("damper", "off"),))


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ({"method": {"levels": ["asymmetric-3"]}}, "no method 'asymmetric-3'; it has vibration"),
        ({"method": STRONG, "voltage_V": {"levels": [25.0]}}, "voltage_V"),
        ({"method": STRONG, "pulse_s": {"levels": [0.5]}}, "pulse_s"),
        (
            {"method": STRONG, "voltage_V": {"levels": [0.5]}},
            "write `below_break_away = true` on top of the design's file, above its first [table]",
        ),
        ({"method": STRONG, "tension_V": {"levels": [1.0]}}, "factors.tension_V: the gun has no such number"),
        (
            {"method": {"levels": ["vibration"]}, "voltage_V": {"levels": [12.0]}},
            "is a vibration, which has no voltage_V: take it out of factors.method, or make a method of each level",
        ),
        (
            {"method": {"levels": ["vibration"]}, "peak_m_s2": {"levels": [100.0, 200.0]}},
            "factors.peak_m_s2: method 'vibration' is a vibration of effect 1, with the numbers of that effect",
        ),
        ({"method": {"levels": ["vibration"]}, "effect": {"levels": [1.0, 2.0]}}, "and let `method` vary"),
        ({"method": STRONG, "damper": {"levels": ["on"], "sets": {"on": {"frction_N": 1.0}}}}, "frction_N"),
        ({"method": STRONG, "damper": {"levels": ["on"], "sets": {"on": {"friction_N": -1.0}}}}, "friction_N is -1.0"),
        (
            {
                "method": STRONG,
                "damper": {"levels": ["on"], "sets": {"on": {"voltage_V": 9.0}}},
                "voltage_V": {"levels": [9.0]},
            },
            "factors.damper sets as well",
        ),
    ],
)
def test_what_the_gun_cannot_do_is_refused_by_name(gun, factors, said):
    with pytest.raises(ConfigError) as raised:
        limits(design(factors=factors), gun)
    assert said in str(raised.value)


@pytest.mark.parametrize(
    ("name", "levels", "meant"),
    [
        ("voltage", [10.0, 12.0], "voltage_V"),
        ("voltage_v", [10.0, 12.0], "voltage_V"),
        ("Voltage_mV", [10.0, 12.0], "voltage_V"),
        ("pulse_ms", [6.0, 10.0], "pulse_s"),
        ("friction", [0.2, 1.1], "friction_N"),
        ("return_friction", [0.2, 1.1], "return_friction_N"),
        ("repeat_every", [1.0, 2.0], "repeat_every_s"),
        ("Directions", ["forward", "backward"], "direction"),
    ],
)
def test_a_number_of_the_gun_without_its_unit_is_no_factor_of_the_hand_which_would_fire_every_shot_alike(
    name, levels, meant
):
    with pytest.raises(ConfigError, match=rf"factors\.{name}: did you mean {meant}\?"):
        design(factors={"method": STRONG, name: {"levels": levels}})


def test_a_hand_sets_numbers_that_the_model_is_told_or_that_are_called_otherwise(gun):
    told = {"8": {"voltage_V": 8.0}, "12": {"voltage_V": 12.0}}
    config = design(
        factors={
            "method": STRONG,
            "voltage_dial": {"levels": [8.0, 12.0], "sets": told},
            "pads": {"levels": [1.0, 2.0]},
            "direction_of_gaze": {"levels": ["ahead", "down"]},
        }
    )
    assert stimuli.by_hand(config) == ("voltage_dial", "pads", "direction_of_gaze")
    assert {cell.drive.voltage_V for cell in limits(config, gun)} == {8.0, 12.0}


def test_below_break_away_is_listed_where_the_design_asks_for_it(gun):
    config = design(below_break_away=True, factors={"method": STRONG, "voltage_V": {"levels": [0.5, 16.0]}})
    assert [one.status for one in limits(config, gun)] == ["no-break-away", "home"]


@pytest.mark.parametrize(("standard", "shown"), [(12.0, [8.0, 16.0, 12.0]), (16.0, [8.0, 16.0])])
def test_a_standard_stands_once_behind_the_levels_that_are_told_from_it(gun, standard, shown):
    factors = {"voltage_V": {"levels": [8.0, 16.0]}, "method": STRONG}
    trial = {"kind": "two-interval", "compare": "voltage_V", "standard": standard}
    asked = {"kind": "choice", "text": "?", "answers": ["first", "second"], "correct": "larger"}
    config = design(factors=factors, trial=trial, questions={"q": asked})
    assert [cell.drive.voltage_V for cell in limits(config, gun)] == shown
