"""Participants who feel the gun, and instructions, as configs: defaults, hashes, and refusals that name the place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from experiments.direction.synthetic import model_parameters

from analysis.predict.check import ExperimentCheck, check, check_text
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.load import load_setup
from experiments.screens.synthetic import synthetic_screen
from experiments.synthetic.model_based import ModelParameters
from experiments.synthetic.percept import PerceptConfig
from experiments.synthetic.preference import Appeal
from tests.felt_configs import BALANCE, changed, felt_text, shipped_text, written

FELT = re.compile(r"\n\[synthetic\.(percept|diffusion|people|appeal)\].*", re.DOTALL)
"""The sections of what is felt, which come last."""


def without_sections(name: str) -> str:
    """A config from before anybody could feel the gun."""
    text = FELT.sub("\n", shipped_text(name))
    return re.sub(r'    "synthetic\.(percept|diffusion|people|appeal)[^\n]*\n', "", text)


def test_sections_that_are_left_out_are_the_models_own_numbers(tmp_path: Path) -> None:
    direction = load_setup(str(written(tmp_path, without_sections("direction")))).config
    preference = load_setup(str(written(tmp_path, without_sections("preference"), "preference"))).config
    assert model_parameters(direction) == ModelParameters()
    assert preference.synthetic.percept.own == ModelParameters().percept
    assert preference.synthetic.appeal == Appeal()


def test_the_shipped_sections_say_the_same_numbers() -> None:
    direction, preference = load_setup("direction").config, load_setup("preference").config
    assert model_parameters(direction) == ModelParameters()
    assert preference.synthetic.percept == direction.synthetic.percept == PerceptConfig()
    assert preference.synthetic.appeal == Appeal()


@pytest.mark.parametrize(("name", "observer"), [("direction", "rates"), ("preference", "ratings")])
def test_who_feels_the_gun_is_recorded_with_all_their_numbers(tmp_path: Path, name: str, observer: str) -> None:
    text = changed(without_sections(name), (f'observer = "{observer}"', 'observer = "felt"'))
    record = load_setup(str(written(tmp_path, text, name))).record()["experiment"]["synthetic"]
    assert record["percept"]["sensitivity"] == ModelParameters().percept.sensitivity
    assert ("boundaries" in record["diffusion"]) if name == "direction" else ("gain" in record["appeal"])


def test_instructions_are_recorded_with_their_texts(tmp_path: Path) -> None:
    setup = load_setup(str(written(tmp_path, felt_text(("speed", "accuracy")))))
    record = setup.record()["experiment"]
    assert record["design"]["instructions"] == ["speed", "accuracy"]
    assert record["instructions"]["speed"] == {"text": "Answer as fast as you can."}
    assert setup.config.instruction_text("speed") == "Answer as fast as you can."
    assert setup.config.instruction_text("") == ""


BOTH = ("speed", "accuracy")
REFUSED = {
    "no power law": (felt_text(exponent=0.0), "exponent =", ("synthetic.percept.exponent = 0.0", "greater than 0")),
    "no leak": (felt_text(leak_s=-0.02), "leak_s =", ("synthetic.percept.leak_s = -0.02", "greater than 0")),
    "endless leak": (felt_text(leak_s="inf"), "leak_s =", ("synthetic.percept.leak_s = inf", "finite")),
    "backward evidence": (felt_text(sensitivity=-1.0), "sensitivity =", ("synthetic.percept.sensitivity = -1.0",)),
    "no confusion number": (felt_text(confusion='"much"'), "confusion =", ("synthetic.percept.confusion = 'much'",)),
    "start at the end": (felt_text(start=1.0), "start =", ("synthetic.percept.start = 1.0", "less than 1")),
    "misspelt": (changed(felt_text(), ("\nleak_s =", "\nleaks_s =")), "leaks_s =", ("unknown key",)),
    "no boundary": (
        felt_text(boundaries="{ neutral = 0.0 }"), "boundaries =",
        ("synthetic.diffusion.boundaries.neutral = 0.0", "greater than 0"),
    ),
    "no neutral boundary": (
        felt_text(boundaries="{ speed = 1.0 }"), "[synthetic.diffusion]",
        ("synthetic.diffusion: boundaries has no value for neutral", "give one"),
    ),
    "negative time": (felt_text(non_decision_s=-0.1), "non_decision_s =", ("non_decision_s = -0.1", "equal to 0")),
    "lapses beyond all": (
        felt_text(lapses="{ rate = 1.5 }"), "lapses =", ("synthetic.diffusion.lapses.rate = 1.5", "equal to 1")
    ),
    "lapses backward": (
        felt_text(lapses="{ earliest_s = 3.0, latest_s = 0.2 }"), "lapses =",
        ("synthetic.diffusion.lapses: earliest_s = 3 must be below latest_s = 0.2",),
    ),
    "people of no spread": (
        felt_text(log_boundary_sd=-0.1), "log_boundary_sd =", ("synthetic.people.log_boundary_sd = -0.1", "equal to 0")
    ),
    "sets that cannot be shared": (
        felt_text(("speed", "neutral", "accuracy")), "[design]",
        ("design: sets_per_session = 4 cannot be shared equally among 3 instructions", "make it a multiple of 3"),
    ),
    "an instruction without words": (
        changed(felt_text(BOTH), ("\n[instructions.accuracy]", "\n[instructions.care]")), "",
        ("design.instructions names accuracy, but there is no table [instructions.accuracy]", "add it"),
    ),
    "an empty text": (
        changed(felt_text(BOTH), ('"Be sure."', '""')), 'text = ""',
        ("instructions.accuracy.text = ''", "at least 1 character"),
    ),
    "an instruction twice": (
        changed(felt_text(BOTH), ('"accuracy"]', '"speed"]')), "instructions =",
        ("design.instructions: speed stands there more than once",),
    ),
    "a name with a comma": (
        changed(felt_text(BOTH), ('"accuracy"]', '"fast, please"]')), "instructions =",
        ("design.instructions.1 = 'fast, please'", "match pattern"),
    ),
    "an instruction without a boundary": (
        felt_text(BOTH, boundaries="{ neutral = 1.5, speed = 1.0 }"), "",
        ("synthetic.diffusion.boundaries has no value for accuracy", "one for each of design.instructions"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_one_refusal_names_file_place_key_value_and_rule(tmp_path: Path, case: str) -> None:
    text, at, said = REFUSED[case]
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as refused:
        load_setup(str(path))
    place = next((n for n, line in enumerate(text.splitlines(), start=1) if at and line.startswith(at)), None)
    assert f"{path}{f':{place}' if place else ''}: " in str(refused.value)
    for words in said:
        assert words in str(refused.value)


def test_an_appeal_without_a_difference_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, changed(shipped_text("preference"), ("jnd = 0.33", "jnd = -0.1")), "preference")
    with pytest.raises(ConfigError, match=r"synthetic\.appeal\.jnd = -0\.1: .*equal to 0"):
        load_setup(str(path))


def test_observers_who_do_not_heed_instructions_need_no_boundary(tmp_path: Path) -> None:
    text = felt_text(BOTH, boundaries="{ neutral = 1.5 }", observer='"rates"')
    assert load_setup(str(written(tmp_path, text))).config.design.instructions == BOTH


def test_a_text_that_no_set_uses_is_no_fault(tmp_path: Path) -> None:
    text = changed(felt_text(("speed", "accuracy")), (f'{BALANCE}\ninstructions = ["speed", "accuracy"]', BALANCE))
    assert load_setup(str(written(tmp_path, text))).config.design.instructions == ()


def test_numbers_that_make_nobody_are_refused_with_the_config(tmp_path: Path) -> None:
    path = written(tmp_path, felt_text(sensitivity=1e6))
    setup = load_setup(str(path))
    with pytest.raises(ConfigError, match=rf"{path}: .* make nobody: drift is .* within 1e\+06"):
        synthetic_screen(setup, make_plan(setup.config, "P01", 1, None), VirtualClock())


@pytest.mark.parametrize("name", ["direction", "preference"])
def test_a_check_tells_of_who_feels_the_gun(tmp_path: Path, name: str) -> None:
    text = changed(shipped_text(name), ('"rates"' if name == "direction" else '"ratings"', '"felt"'))
    found = check(str(written(tmp_path, text, name)), None, 2)
    assert isinstance(found, ExperimentCheck)
    told = {method: set(rates) for method, rates in found.felt_forward_rates.items()}
    methods = ("vibration", "asymmetric-1", "asymmetric-2")
    assert told == ({method: {"neutral"} for method in methods} if name == "direction" else {})
    assert ("Felt  " in check_text(found)) == (name == "direction")


def test_a_check_refuses_numbers_that_make_nobody(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="make nobody"):
        check(str(written(tmp_path, felt_text(sensitivity=1e6))), None, 2)
