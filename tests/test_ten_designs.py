"""The ten designs that a lab is likeliest to want: each loads, fits the gun, plans, and is answered by its people."""

from __future__ import annotations

import statistics
from collections import defaultdict

import pytest

from experiments.config.door import ConfigError, checked_table, load
from experiments.design.config import DesignConfig
from experiments.design.limits import limits
from experiments.design.planning import groups, plan_of, square_size
from experiments.load import load_gun
from experiments.record import design_columns
from experiments.session.steps import Asking, is_answer
from experiments.synthetic.answers import SyntheticParticipant
from experiments.synthetic.laws import SyntheticAnswers, check_laws
from experiments.tasks.questions import is_right
from tests.designs import changed, laws_of, path_of
from tests.driven_designs import driven, session_of

TRIALS = {
    "direction": 60, "preference": 3, "voltages": 90, "detection": 120, "stronger": 120, "magnitude": 18,
    "realism": 12, "pairs": 20, "grip": 9, "hurry": 60,
}  # fmt: skip
"""Worked out by hand from each file."""


def loaded(name):
    design = load(DesignConfig, path_of(name))
    folder = path_of(name).parent
    return design, load_gun(folder / design.gun), load(SyntheticAnswers, folder / str(design.synthetic))


def people(name, count=1):
    design, gun, laws = loaded(name)
    rows, kinds = square_size(design), len(groups(design))
    for number in range(count):
        plan = plan_of(design, f"P{number:02d}", 1, row=number % rows if rows else None, group=number % kinds)
        yield design, plan, SyntheticParticipant(design, laws, plan, gun)


@pytest.mark.slow
@pytest.mark.parametrize("name", TRIALS)
def test_it_fits_its_gun_and_its_people_answer_every_question(name):
    design, gun, laws = loaded(name)
    assert design.design == name
    check_laws(design, laws)
    assert all(one.status in {"home", "rendered"} for one in limits(design, gun))
    assert len(design_columns.columns(design)) > 8
    for _, plan, person in people(name, 2):
        assert len(plan.trials) == TRIALS[name]
        steps = [step for step, _ in driven(session_of(design, gun, plan)) if isinstance(step, Asking)]
        asked_for = {(step.trial, step.question): step for step in steps}
        for trial in plan.trials:
            assert max(1, len(trial.intervals)) == design.trial.intervals
            for asked in design.questions:
                given = person.answer(trial, asked)
                assert is_answer(asked_for[trial, asked], given.value)
                assert given == person.answer(trial, asked)
                assert given.response_time_s > 0


def means(name, question, key, count=60):
    found = defaultdict(list)
    for design, plan, person in people(name, count):
        for trial in plan.trials:
            value = person.answer(trial, question).value
            right = is_right(design, design.questions[question], trial, value)
            found[key(trial)].append(value if right is None else right)
    return {level: statistics.fmean(values) for level, values in found.items()}


@pytest.mark.slow
@pytest.mark.parametrize("count", [250, pytest.param(1000, marks=pytest.mark.soak)])
def test_rates_are_met_in_the_mean_over_people(count):
    found = means("direction", "response", lambda trial: (trial.level("method"), trial.level("direction")), count)
    assert found["vibration", "forward"] == pytest.approx(0.557, abs=0.03)
    assert found["asymmetric-2", "backward"] == pytest.approx(0.929, abs=0.02)


@pytest.mark.slow
def test_a_psychometric_function_rises_from_chance_to_its_lapses():
    found = means("voltages", "response", lambda trial: trial.level("voltage_V"))
    assert found[6.0] == pytest.approx(0.5 + 0.48 * 0.041, abs=0.06)
    assert found[18.0] == pytest.approx(0.98, abs=0.03)


def test_a_law_without_a_value_for_catch_trials_is_refused_with_what_they_are_called():
    question = {"kind": "rating", "text": "How sure?", "minimum": 1.0, "maximum": 4.0, "grain": 1.0}
    law = {"law": "ratings", "by": ("pulse_s",), "mean": {"0.003": 2.0, "0.004": 3.0, "0.005": 4.0}}
    setup = changed("detection", {"questions": {"sure": law}}, questions={"sure": question})
    with pytest.raises(
        ConfigError, match=r"'all': so is called a trial without one pulse_s, such as a catch trial; it has 0\.003"
    ):
        check_laws(setup.config, laws_of(setup), [plan_of(setup.config, "P01", 1)])


def test_a_number_for_a_catch_trial_is_the_least_that_may_be_said():
    setup = changed("magnitude", trial={"catch": 3})
    plan = plan_of(setup.config, "P01", 1)
    person = SyntheticParticipant(setup.config, laws_of(setup), plan, setup.gun)
    said = {trial.catch: person.answer(trial, "strength").value for trial in plan.trials}
    assert said[True] == 0.000001 < said[False]


ONE_SHOT = {"kind": "single", "repeat_every_s": 1.0}


@pytest.mark.parametrize(
    ("name", "law", "trial", "blocked"),
    [("preference", "appeal", ONE_SHOT, ()), ("hurry", "diffusion", {}, ("instruction", "direction"))],
)
def test_a_law_of_what_a_shot_does_is_refused_where_there_is_none(name, law, trial, blocked):
    felt = load(SyntheticAnswers, path_of(name).parent / f"synthetic/{name}-felt.toml")
    design = changed(name, design="own", trial={"catch": 4} | trial, order={"sets": 1, "set": blocked}).config
    with pytest.raises(ConfigError, match=rf"law = '{law}': it says what a shot does, and a catch trial"):
        check_laws(design, felt)


@pytest.mark.slow
def test_catch_trials_are_falsely_felt_as_often_as_is_said():
    found = means("detection", "felt", lambda trial: trial.catch, 40)
    assert 1 - found[True] == pytest.approx(0.1, abs=0.02)


@pytest.mark.slow
def test_who_is_worth_more_is_chosen_more_often():
    chosen = defaultdict(int)
    for _, plan, person in people("pairs", 60):
        for trial in plan.trials:
            chosen[trial.intervals[("first", "second").index(person.answer(trial, "rather").value)]] += 1
    assert sorted(chosen, key=chosen.get) == ["vibration", "soft", "short", "paper", "strong"]


@pytest.mark.slow
def test_a_third_answer_is_a_tie_as_often_as_davidson_has_it():
    """Of two that are worth the same, a tie has the share tie / (2 + tie)."""
    pairs, gun, _ = loaded("pairs")
    tables = pairs.model_dump()
    tables["questions"]["rather"] |= {"answers": ("first", "second", "same")}
    three = DesignConfig.model_validate(tables)
    alike = dict.fromkeys(three.factors["method"].all_levels, 1.7)
    laws = {"rather": {"law": "worth", "factor": "method", "worth": alike, "tie": 0.5}}
    plans = [plan_of(three, f"P{at}", 1) for at in range(60)]
    given = [one.value for plan in plans for one in answered_by(three, gun, laws, plan)]
    assert given.count("same") / len(given) == pytest.approx(0.2, abs=0.035)  # 1,200 answers: three standard errors
    assert given.count("first") / len(given) == pytest.approx(0.4, abs=0.045)


def test_a_group_keeps_its_level():
    assert {next(iter(plan.trials)).level("grip") for _, plan, _ in people("grip", 2)} == {"one hand", "two hands"}


def answered_by(design, gun, laws, plan):
    person = SyntheticParticipant(design, checked_table(SyntheticAnswers, {"questions": laws}, "laws.toml"), plan, gun)
    return [person.answer(trial, next(iter(design.questions))) for trial in plan.trials]


@pytest.mark.parametrize(
    ("name", "laws", "said"),
    [
        (
            "pairs",
            {
                "rather": {
                    "law": "worth",
                    "factor": "method",
                    "worth": dict.fromkeys(("vibration", "soft", "short", "paper", "strong"), 1.0),
                    "tie": 0.5,
                }
            },
            "questions.rather.tie = 0.5: no third answer is a tie; name one, or remove the key",
        ),
        (
            "pairs",
            {"rather": {"law": "rates", "share": {"all": 0.5}}},
            "questions.rather.law = 'rates': nothing is right here",
        ),
        ("pairs", {"rather": {"law": "worth", "factor": "method", "worth": {"soft": 1.0}}}, "no value for vibration"),
        ("direction", {"response": {"law": "guesses"}}, "guesses"),
        (
            "direction",
            {"response": {"law": "rates", "by": ["method"], "share": {"vibration": 0.5}}},
            "for 'asymmetric-",
        ),
        ("direction", {"response": {"law": "rates", "share": {"all": 1.0}}}, "must be below 1"),
        ("direction", {"answer": {"law": "rates", "share": {"all": 0.5}}}, "questions.response is missing"),
        (
            "voltages",
            {"response": {"law": "psychometric", "factor": "voltage", "threshold": 9.0, "spread": 0.1}},
            "names 'voltage', which is no factor",
        ),
        (
            "voltages",
            {"response": {"law": "psychometric", "factor": "method", "threshold": 9.0, "spread": 0.1}},
            "this law needs numbers from 0; its levels are asymmetric-1",
        ),
        (
            "voltages",
            {"response": {"law": "psychometric", "factor": "voltage_V", "threshold": 9.0, "spread": 0.1, "guess": 0.3}},
            "guess = 0.3 is of yes-no",
        ),
        ("preference", {"rating": {"law": "ratings", "mean": {"all": 11.0}}}, "is off the scale, 0 to 10"),
        (
            "direction",
            {"response": {"law": "worth", "factor": "method", "worth": {"vibration": 1.0}}},
            "worth has no value for asymmetric-1",
        ),
        ("grip", {"realism": {"law": "words", "texts": ["x"]}}, "a question of kind 'rating' has ratings"),
        (
            "direction",
            {"response": {"law": "rates", "share": {"all": 0.5}, "bias": {"answer": "up"}}},
            "questions.response.bias.answer = 'up': must be one of two answers; there are forward, backward",
        ),
        (
            "pairs",
            {"rather": {"law": "shares", "share": {"all": {"first": 1.0}}}},
            "questions.rather.share.all has first; it must have each of first, second",
        ),
        (
            "pairs",
            {"rather": {"law": "shares", "share": {"all": {"first": 0.5, "second": 0.6}}}},
            "share.all: 0.5, 0.6 must sum to 1",
        ),
        (
            "preference",
            {"rating": {"law": "ratings", "by": ["method"], "mean": {"all": 5.0}, "lowest": "hammer"}},
            "questions.rating names 'hammer', which is no level of method",
        ),
        (
            "preference",
            {"rating": {"law": "ratings", "mean": {"all": 5.0}, "lowest": "vibration"}},
            "lowest and same are levels of one factor; name it alone in `by`",
        ),
    ],
)
def test_laws_that_do_not_fit_are_refused_by_name(name, laws, said):
    design, gun, _ = loaded(name)
    plan = plan_of(design, "P01", 1)
    with pytest.raises(ConfigError) as raised:
        answered_by(design, gun, laws, plan)
    assert said in str(raised.value)
