"""What a design may not say: each is refused with its place, the value, the rule and what would do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from experiments.config.door import ConfigError, tables
from experiments.design.language import QuestionConfig
from experiments.design.planning import plan_of
from tests.designs import QUESTION, design

ONE = {"method": {"levels": ["a"]}}
VOLTS = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [12.0, 20.0]}}
INTERVALS = {"kind": "two-interval", "compare": "voltage_V", "standard": 16.0}
FIRST = INTERVALS | {"standard_interval": "first"}
WAYS = {"levels": ["forward", "backward"]}


def asked(**keys):
    return {"q": {"kind": "choice", "text": "?", "answers": ["first", "second"], **keys}}


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"design": "Two words"}, "design = 'Two words'"),
        ({"factors": {"voltage_V": {"levels": [1.0]}}}, "factors.method is missing"),
        ({"factors": {"method": {"levels": ["a", "a"]}}}, "a stands there more than once"),
        ({"factors": {"method": {"levels": []}}}, "factors.method.levels"),
        ({"factors": {"method": {"levels": ["a", 1.0]}}}, "mixes words and numbers"),
        ({"factors": {"method": {"levels": ["a\nb"]}}}, "U+000A"),
        ({"factors": {"method": {"levels": ["a\u202eb"]}}}, "U+202E"),
        ({"factors": {"method": {"levels": [" "]}}}, "is blank"),
        ({"title": "two\nlines"}, "U+000A"),
        ({"factors": {"method": {"levels": [1.0]}}}, "factors.method: levels are numbers"),
        ({"factors": ONE | {"direction": {"levels": ["up"]}}}, "directions are forward, backward"),
        ({"factors": ONE | {"voltage_V": {"levels": ["high"]}}}, "ends with the unit V"),
        ({"factors": ONE | {"grip": {"levels": ["x"], "labels": {"y": "Y"}}}}, "labels has 'y', which is no level"),
        (
            {"factors": ONE | {"grip": {"levels": ["x"], "texts": {"x": "Hold."}}}},
            "texts are of the factor `instruction`",
        ),
        ({"factors": ONE | {"instruction": {"levels": ["fast"]}}}, "texts has no words for fast"),
        (
            {"factors": ONE | {"instruction": {"levels": ["s", "a"], "texts": {"s": "S.", "a": "A."}}}},
            "instructions are read out before a set",
        ),
        ({"factors": ONE | {"voltage_V": {"levels": {"a": [1.0]}}}}, "name that one with `within`"),
        ({"factors": ONE | {"voltage_V": {"levels": [1.0], "within": "method"}}}, "needs levels as a table"),
        (
            {"factors": ONE | {"voltage_V": {"levels": {"b": [1.0]}, "within": "method"}}},
            "one list for each level of method",
        ),
        (
            {"factors": ONE | {"voltage_V": {"levels": {"a": [1.0]}, "within": "grip"}}},
            "within = 'grip' is no other factor",
        ),
        ({"factors": ONE | {"grip": {"levels": ["x"], "between": True}}, "order": {"set": ["grip"]}}, "between = true"),
        ({"factors": ONE | {"repeat_every_s": {"levels": [1.0]}}}, "is the interval of a train"),
        ({"order": {"session": ["damper"]}}, "order.session names 'damper', which is no factor"),
        ({"order": {"session": ["method"], "set": ["method"]}}, "name it in `session` only"),
        ({"order": {"longest_run": {"damper": 2}}}, "order.longest_run names 'damper'"),
        ({"order": {"sessions": "williams", "trials": "williams"}}, "one row of one square"),
        ({"order": {"trials": "fixed", "longest_run": {"method": 2}}}, "has its own order"),
        ({"order": {"trials": "fixed"}, "trial": {"catch": 2}}, "would be known"),
        (
            {"factors": ONE | {"grip": {"levels": ["x", "y"]}}, "trial": {"catch": 2}},
            "trial.catch = 2: grip is set by hand from trial to trial, and catch trials, which have none, would be",
        ),
        (
            {
                "factors": ONE | {"voltage_V": {"levels": {"a": [1.0]}, "within": "method"}},
                "order": {"set": ["method"]},
            },
            "voltage_V is nested in method",
        ),
        (
            {
                "factors": ONE | {"voltage_V": {"levels": {"a": [1.0]}, "within": "method"}},
                "order": {"set": ["voltage_V"]},
            },
            "voltage_V is nested in method",
        ),
        ({"order": {"repetitions": 10**9}}, "order.repetitions = 1000000000"),
        ({"trial": {"kind": "two-interval"}}, "needs `compare`"),
        ({"trial": {"kind": "single", "compare": "method"}}, "compares nothing"),
        ({"factors": VOLTS, "trial": {"kind": "two-interval", "compare": "voltage_V"}}, "needs `standard`"),
        ({"factors": VOLTS, "trial": INTERVALS | {"standard": "low"}}, "is not of the kind of voltage_V's levels"),
        ({"factors": VOLTS, "trial": INTERVALS | {"kind": "oddity", "standard": 12.0}}, "nothing would differ"),
        ({"factors": VOLTS, "trial": INTERVALS | {"catch": 3}}, "catch = 3: a catch trial is a single shot"),
        ({"trial": {"kind": "train", "catch": 3}}, "catch = 3: a catch trial is a single shot that is left out"),
        ({"factors": ONE, "trial": {"kind": "pair", "compare": "method"}}, "makes no pair"),
        (
            {
                "factors": VOLTS,
                "trial": {"kind": "pair", "compare": "voltage_V"},
                "questions": asked(answers=["first", "same", "second"]),
            },
            "questions.q: answers: second is not in its place; of a pair the first answer chooses the first interval, "
            "the second the other, and any more is a tie: write first, second, same",
        ),
        (
            {"factors": VOLTS, "trial": INTERVALS, "order": {"session": ["voltage_V"]}},
            "is constant in a block or person",
        ),
        ({"questions": asked(answers=["one"])}, "a choice is among at least two"),
        ({"questions": asked(kind="text")}, "a question of kind 'text' has none"),
        (
            {"questions": {"q": {"kind": "text", "text": "?", "correct": "method"}}},
            "only a choice or yes-no can be right",
        ),
        ({"questions": asked(keys={"third": "t"})}, "keys has third, which is no answer"),
        (
            {"questions": {"q": {"kind": "text", "text": "?", "keys": {"one": "x"}}}},
            "keys has one, which is no answer; a question of kind 'text' has none; remove the key",
        ),
        ({"questions": asked(keys={"first": "x", "second": "x"})}, "'x' stands for more than one answer"),
        ({"questions": asked(keys={"first": "F1"})}, "questions.q.keys.first = 'F1'"),
        ({"questions": asked(labels={"first": "one", "second": "one"})}, "'one' stands for more than one answer"),
        ({"questions": asked(labels={"first": "second"})}, "'second' stands for more than one answer"),
        ({"questions": asked(labels={"first": "Same", "second": "same"})}, "'Same', 'same' stands for more than one"),
        (
            {"factors": ONE | {"grip": {"levels": ["one", "two"], "labels": {"one": "firm", "two": "firm"}}}},
            "factors.grip.labels: 'firm' stands for more than one level",
        ),
        (
            {"factors": ONE | {"grip": {"levels": ["one", "two"], "labels": {"one": "two"}}}},
            "'two' stands for more than one level",
        ),
        (
            {"factors": VOLTS | {"voltage_V": {"levels": [12.0, 20.0], "labels": {"12": "20"}}}},
            "'20' stands for more than one level",
        ),
        ({"questions": asked(text="")}, "questions.q.text"),
        ({"questions": asked(correct="weather")}, "correct = 'weather' is no factor"),
        ({"questions": asked(correct="method")}, "its levels a are not all among the answers"),
        ({"questions": asked(correct="interval")}, "has one interval"),
        ({"questions": asked(correct="stimulus")}, "is for yes-no with catch trials"),
        (
            {"factors": VOLTS, "trial": INTERVALS, "questions": asked(answers=["a", "b"], correct="larger")},
            "must be first, second",
        ),
        (
            {"factors": VOLTS, "trial": INTERVALS | {"standard": "none"}, "questions": asked(correct="larger")},
            "the standard is no number",
        ),
        (
            {
                "factors": ONE | {"direction": WAYS},
                "questions": {"q": QUESTION | {"correct": "direction", "when": "block"}},
            },
            "is not scored",
        ),
        ({"questions": {"q": {"kind": "rating", "text": "?"}}}, "a rating needs minimum, maximum and grain"),
        (
            {"questions": {"q": {"kind": "rating", "text": "?", "minimum": 5.0, "maximum": 1.0, "grain": 1.0}}},
            "minimum 5 and",
        ),
        (
            {"questions": {"q": {"kind": "rating", "text": "?", "minimum": 0.0, "maximum": 1.0, "grain": 0.3}}},
            "grain 0.3 does",
        ),
        (
            {"questions": {"q": {"kind": "number", "text": "?", "minimum": 2.0, "maximum": 1.0}}},
            "need minimum < maximum",
        ),
        ({"questions": {"q": {"kind": "ranking", "text": "?"}}}, "a ranking is of a block's trials"),
        (
            {"questions": {"q": {"kind": "ranking", "when": "block", "text": "?"}}},
            "a ranking needs minimum_text: what rank 1 means",
        ),
        ({"trial": {"feedback": True}}, "trial.feedback = true: nothing is right or wrong"),
        ({"trial": {"max_shots": 7}}, "max_shots: a trial of kind 'single' has none"),
        ({"trial": {"kind": "train", "least_exposure_s": 5.0, "max_shots": 3}}, "longer than the longest train"),
        ({"practice": {"repetitions": 2}}, "a practice needs of"),
        ({"practice": {"of": ["method"]}}, "a practice needs repetitions"),
        ({"factors": ONE | {"grip": {"levels": ["one"], "between": True}}}, "between = true with one level"),
        ({"factors": ONE | {"grip": {"levels": ["one\ntwo", "two"]}}}, "a level holds the character U+000A"),
        ({"factors": ONE | {"grip": {"levels": ["\u202eone", "two"]}}}, "a level holds the character U+202E"),
        ({"factors": ONE | {"grip": {"levels": ["x" * 201, "two"]}}}, "a level has 201 characters; a name has at most"),
        ({"design": "excluded"}, "design = 'excluded': the statistics have another part of that name; choose another"),
        ({"factors": ONE | {"Method": {"levels": ["x", "y"]}}}, "method, Method differ in case alone"),
        (
            {
                "factors": VOLTS,
                "trial": {"kind": "oddity", "compare": "voltage_V", "standard": 7.0},
                "questions": asked(answers=["first", "second", "third"], correct="larger"),
            },
            "correct = 'larger' is of two intervals",
        ),
        (
            {"factors": VOLTS, "trial": FIRST | {"kind": "abx"}},
            "trial.standard_interval: a trial of kind 'abx' has none; remove it",
        ),
        (
            {
                "factors": {
                    "method": {"levels": ["a", "b"]},
                    "voltage_V": {"within": "method", "levels": {"a": [8.0], "b": [9.0]}},
                },
                "trial": {"kind": "pair", "compare": "method"},
            },
            "trial.compare = 'method': factors.voltage_V is nested in it",
        ),
        (
            {"factors": VOLTS, "trial": FIRST, "questions": asked(correct="interval")},
            "correct = 'interval': with trial.standard_interval = 'first' the same answer is right in every trial",
        ),
        (
            {"factors": VOLTS, "trial": FIRST | {"standard": 12.0}, "questions": asked(correct="larger")},
            "correct = 'larger': with trial.standard_interval = 'first' the same answer is right in every trial",
        ),
        ({"timing": {"hand_over_s": 1.0, "planned_s": 0.0}}, "timing.planned_s = 0.0"),
        ({"assumed": ["timing.speed"]}, "assumed names timing.speed"),
        ({"colour": "red"}, "colour = 'red': unknown key"),
    ],
)
def test_it_is_refused_in_words(tables, said):
    with pytest.raises(ConfigError) as raised:
        design(**tables)
    assert said in str(raised.value)
    assert str(raised.value).startswith("design.toml: ")


def test_the_designs_on_the_page_of_the_language_are_designs():
    page = Path(__file__).parent.parent / "docs" / "design-language.md"
    shown = re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    factors = {
        "method": {"levels": ["a"]},
        "direction": {"levels": ["forward", "backward"]},
        "voltage_V": {"levels": [12.0, 20.0]},
    }
    shared = {"factors": factors, "questions": {"response": QUESTION | {"correct": "direction"}}}
    assert shown
    for text in shown:
        config = design(**(shared | tables(text, page)))
        assert plan_of(config, "P01", 1).trials


def test_the_steps_of_a_number_are_held_against_its_ends_where_it_has_two() -> None:
    QuestionConfig(kind="number", text="How strong?", minimum=0.0, grain=3.0)
    with pytest.raises(ValidationError, match="grain 3 does not divide the scale 0 to 10"):
        QuestionConfig(kind="number", text="How strong?", minimum=0.0, maximum=10.0, grain=3.0)


def test_levels_of_different_methods_may_be_called_alike() -> None:
    nested = {"levels": {"a": [12.0, 14.0], "b": [16.0, 18.0]}, "within": "method"}
    called = {"12": "low", "14": "high", "16": "low", "18": "high"}
    config = design(factors={"method": {"levels": ["a", "b"]}, "voltage_V": nested | {"labels": called}})
    voltage = config.factors["voltage_V"]
    assert [voltage.label(level) for level in voltage.all_levels] == ["low", "high"] * 2
