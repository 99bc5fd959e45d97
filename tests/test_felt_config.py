"""Participants who feel the gun, and instructions, as configs: defaults, records, and refusals that name the place."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from analysis.predict.check import check, check_text
from analysis.predict.check_design import DesignCheck
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.design.planning import plan_of
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import read_journal
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.synthetic.laws import AppealLaw, DiffusionLaw, SyntheticAnswers
from experiments.synthetic.model_based import ModelParameters
from experiments.synthetic.percept import PerceptConfig
from experiments.synthetic.preference import Appeal
from tests.refusals import Broken, check_refused, edit

DIRECTION, PREFERENCE, HURRY = "direction.toml", "preference.toml", "examples/hurry.toml"
DECIDING, LIKING, HURRIED = (f"synthetic/{name}-felt.toml" for name in ("direction", "preference", "hurry"))
METHODS = ("vibration", "asymmetric-1", "asymmetric-2")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The shipped configs; those of the paper are answered by people who feel the gun."""
    shutil.copytree(shipped_folder(), tmp_path / "configs")
    for name in ("direction", "preference"):
        edit(tmp_path / "configs" / f"{name}.toml", f'"synthetic/{name}.toml"', f'"synthetic/{name}-felt.toml"')
    return tmp_path / "configs"


def people(config: Path | str) -> SyntheticAnswers:
    laws = load_setup(str(config)).laws
    assert isinstance(laws, SyntheticAnswers)
    return laws


def deciding(config: Path | str) -> DiffusionLaw:
    law = people(config).questions["response"]
    assert isinstance(law, DiffusionLaw)
    return law


def liking(config: Path | str) -> AppealLaw:
    law = people(config).questions["rating"]
    assert isinstance(law, AppealLaw)
    return law


def test_sections_that_are_left_out_are_the_models_own_numbers(folder: Path) -> None:
    (folder / DECIDING).write_text('[questions.response]\nlaw = "diffusion"\n')
    (folder / LIKING).write_text('[questions.rating]\nlaw = "appeal"\n[questions.comment]\nlaw = "words"\n')
    assert deciding(folder / DIRECTION).own == ModelParameters()
    law = liking(folder / PREFERENCE)
    assert law.percept.own == ModelParameters().percept
    assert law.appeal == Appeal()


def test_the_shipped_sections_say_the_same_numbers(folder: Path) -> None:
    direction, preference = deciding(folder / DIRECTION), liking(folder / PREFERENCE)
    assert direction.own == ModelParameters()
    assert preference.percept == direction.percept == PerceptConfig()
    assert preference.appeal == Appeal()
    hurried = deciding(folder / HURRY)
    assert hurried.percept == direction.percept
    assert hurried.diffusion.boundaries == direction.diffusion.boundaries


@pytest.mark.slow
@pytest.mark.parametrize(
    ("config", "question", "key", "numbers"),
    [(DIRECTION, "response", "diffusion", "boundaries"), (PREFERENCE, "rating", "appeal", "gain")],
)
def test_who_feels_the_gun_is_recorded_with_all_their_numbers(
    folder: Path, config: str, question: str, key: str, numbers: str
) -> None:
    (folder / DECIDING).write_text('[questions.response]\nlaw = "diffusion"\n')
    (folder / LIKING).write_text('[questions.rating]\nlaw = "appeal"\n[questions.comment]\nlaw = "words"\n')
    request = RunRequest(setup=load_setup(str(folder / config)), participant_id="P01", results=folder, seed=1)
    recorded = read_journal(run(request, synthetic_screen, VirtualClock()).place.journal).head.laws_json
    assert isinstance(recorded, dict)
    law = recorded["questions"][question]
    assert law["percept"]["sensitivity"] == ModelParameters().percept.sensitivity
    assert numbers in law[key]
    assert SyntheticAnswers.model_validate_json(people(folder / config).model_dump_json()).model_dump(mode="json") == (
        recorded
    )


def test_instructions_are_recorded_with_their_texts(folder: Path) -> None:
    setup = load_setup(str(folder / HURRY))
    told = setup.config.factors["instruction"]
    assert setup.record()["experiment"]["factors"]["instruction"] == told.model_dump(mode="json")  # type: ignore[index]
    assert told.levels == ("speed", "neutral", "accuracy")
    assert told.texts["neutral"] == "Answer fast and well."


def of_a_law(old: str, new: str, *said: str, at: str = "") -> Broken:
    return Broken(DIRECTION, DECIDING, old, new, said, at or new)


PERCEPT, DIFFUSION, PEOPLE = (f"questions.response.{key}" for key in ("percept", "diffusion", "people"))
ALL_BOUNDARIES = "speed = 1.0, neutral = 1.5, accuracy = 2.2"
REFUSED = {
    "no power law": of_a_law("exponent = 1.7", "exponent = 0.0", f"{PERCEPT}.exponent = 0.0", "must be above 0"),
    "no leak": of_a_law("leak_s = 0.02", "leak_s = -0.02", f"{PERCEPT}.leak_s = -0.02", "must be above 0"),
    "endless leak": of_a_law("leak_s = 0.02", "leak_s = inf", f"{PERCEPT}.leak_s = inf", "finite"),
    "backward evidence": of_a_law("sensitivity = 0.213", "sensitivity = -1.0", f"{PERCEPT}.sensitivity = -1.0"),
    "no confusion number": of_a_law("confusion = 2.44", 'confusion = "much"', f"{PERCEPT}.confusion = 'much'"),
    "start at the end": of_a_law("start = 0.557", "start = 1.0", f"{PERCEPT}.start = 1.0", "must be below 1"),
    "misspelt": of_a_law("\nleak_s =", "\nleaks_s =", f"{PERCEPT}.leaks_s = 0.02", "unknown key", at="leaks_s ="),
    "no boundary": of_a_law(
        ALL_BOUNDARIES, "neutral = 0.0", f"{DIFFUSION}.boundaries.neutral = 0.0", "must be above 0", at="boundaries ="
    ),
    "no neutral boundary": of_a_law(
        ALL_BOUNDARIES, "speed = 1.0", f"{DIFFUSION}.boundaries has no value for neutral", "give one",
        at="boundaries = ",
    ),
    "negative time": of_a_law(
        "non_decision_s = 0.35", "non_decision_s = -0.1", f"{DIFFUSION}.non_decision_s = -0.1", "must be at least 0"
    ),
    "lapses beyond all": of_a_law(
        "rate = 0.0", "rate = 1.5", f"{DIFFUSION}.lapses.rate = 1.5", "must be at most 1", at="lapses ="
    ),
    "lapses backward": of_a_law(
        "earliest_s = 0.2, latest_s = 3.0", "earliest_s = 3.0, latest_s = 0.2",
        f"{DIFFUSION}.lapses.earliest_s = 3 must be below latest_s = 0.2",
    ),
    "people of no spread": of_a_law(
        "log_boundary_sd = 0.0", "log_boundary_sd = -0.1", f"{PEOPLE}.log_boundary_sd = -0.1", "must be at least 0"
    ),
    "an appeal without a difference": Broken(
        PREFERENCE, LIKING, "jnd = 0.33", "jnd = -0.1", ("questions.rating.appeal.jnd = -0.1", "at least 0"), "jnd ="
    ),
    "who decides on no direction": Broken(
        PREFERENCE, LIKING, 'law = "words"', 'law = "diffusion"', ("questions.comment.law = 'diffusion'", "has words")
    ),
    "sets that cannot be shared": Broken(
        HURRY, HURRY, "sets = 6", "sets = 4",
        ("order.sets = 4 cannot be shared equally among the 3 combinations of order.set", "nearest: 3 or 6"),
    ),
    "sets that share out the instructions and not the trials": Broken(
        HURRY, HURRY, "sets = 6", "sets = 9",
        ("order.sets = 9: the 30 trials of a session cannot be shared equally", "nearest: 6 or 15"),
    ),
    "trials that no number of sets can share": Broken(
        HURRY, HURRY, "repetitions = 15", "repetitions = 4",
        ("order.sets = 6: the 8 trials", "no number can, as 8 trials are no multiple of 3: change order.repetitions"),
        "sets = 6",
    ),
    "neither the instructions nor the trials": Broken(
        HURRY, HURRY, "sets = 6", "sets = 20",
        ("order.sets = 20 cannot be shared equally among the 3 combinations", "nearest: 15 or 30"),
    ),
    "instructions that are in no set": Broken(
        HURRY, HURRY, 'set = ["instruction"]', "", ("order.set: instructions are read out before a set", "name it in"),
    ),
    "an instruction without words": Broken(
        HURRY, HURRY, "texts.accuracy", "# ", ("factors.instruction: texts has no words for accuracy", "give what is")
    ),
    "words of no instruction": Broken(
        HURRY, HURRY, "texts.accuracy", "texts.care",
        ("factors.instruction.texts has 'care', which is no level", "accuracy, neutral, speed"),
        "[factors.instruction]",
    ),
    "an empty text": Broken(
        HURRY, HURRY, '"Answer fast and well."', '""',
        ("factors.instruction.texts.neutral = ''", "must not be empty"), 'texts.neutral = ""',
    ),
    "an instruction twice": Broken(
        HURRY, HURRY, '"accuracy"]', '"speed"]', ("factors.instruction.levels", "speed stands there more than once"),
        'levels = ["speed"',
    ),
    "an instruction without a boundary": Broken(
        HURRY, HURRIED, ", accuracy = 2.2", "",
        ("questions.response.diffusion.boundaries has no value for accuracy", "one for each instruction"),
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("broken", [pytest.param(broken, id=name) for name, broken in REFUSED.items()])
def test_one_refusal_names_file_place_key_value_and_rule(folder: Path, broken: Broken) -> None:
    check_refused(folder, broken)


def test_observers_who_do_not_heed_instructions_need_no_boundary(folder: Path) -> None:
    edit(folder / HURRY, "hurry-felt.toml", "direction.toml")
    edit(folder / HURRIED, ", accuracy = 2.2", "")
    assert load_setup(str(folder / HURRY)).config.factors["instruction"].levels == ("speed", "neutral", "accuracy")


def test_numbers_that_make_nobody_are_refused_with_their_file(folder: Path) -> None:
    edit(folder / DECIDING, "sensitivity = 0.213", "sensitivity = 1e6")
    setup = load_setup(str(folder / DIRECTION))
    with pytest.raises(ConfigError, match=rf"{folder / DECIDING}: .* make nobody: drift is .* within 1e\+06"):
        synthetic_screen(setup, plan_of(setup.config, "P01", 1), VirtualClock())


@pytest.mark.parametrize(
    ("config", "instructions"),
    [(DIRECTION, ("neutral",)), (HURRY, ("speed", "neutral", "accuracy")), (PREFERENCE, ())],
)
def test_a_check_tells_of_who_feels_the_gun(folder: Path, config: str, instructions: tuple[str, ...]) -> None:
    found = check(str(folder / config), None, 2)
    assert isinstance(found, DesignCheck)
    told = {method: set(rates) for method, rates in found.felt_forward_rates.items()}
    assert told == ({method: set(instructions) for method in METHODS} if instructions else {})
    assert ("Felt: right answers" in check_text(found)) == bool(instructions)


def test_a_check_refuses_numbers_that_make_nobody(folder: Path) -> None:
    edit(folder / DECIDING, "sensitivity = 0.213", "sensitivity = 1e6")
    with pytest.raises(ConfigError, match="make nobody"):
        check(str(folder / DIRECTION), None, 2)
