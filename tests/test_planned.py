"""What a design's plan asks of people: durations, rests and hands, worked out by hand for the shipped designs."""

from __future__ import annotations

import pytest

from experiments.config.door import ConfigError, load
from experiments.design import planned
from experiments.design.config import DesignConfig
from experiments.design.planning import plan_of
from tests.designs import design, path_of

WAYS = {"levels": ["forward", "backward"]}


def of(config):
    return planned.planned_run(config, plan_of(config, "P01", 1, row=0 if "square" in str(config.order) else None))


def test_the_papers_first_experiment_takes_its_half_hour():
    found = of(load(DesignConfig, path_of("direction")))
    assert (found.sessions, found.sets, found.trials) == (3, 12, 60)
    assert found.break_s == 3 * 3 * 20.0 + 2 * 300.0
    assert found.duration_s == pytest.approx(1800.0)
    assert found.trials_without_break == 5


def test_the_papers_second_experiment_takes_its_eight_minutes():
    found = of(load(DesignConfig, path_of("preference")))
    assert (found.trials, found.duration_s) == (3, 480.0)


def test_without_rests_all_trials_are_one_stretch():
    config = design(factors={"method": {"levels": ["a", "b"]}, "direction": WAYS}, order={"sets": 2, "repetitions": 4})
    assert of(config).trials_without_break == 16


@pytest.mark.parametrize(
    ("fatigue", "said"),
    [
        ({"max_trials_without_break": 3, "max_planned_s": 600.0}, "4 trials without a break exceed"),
        ({"max_trials_without_break": 9, "max_planned_s": 10.0}, "the planned duration of 12 s exceeds"),
    ],
)
def test_more_than_the_design_allows_is_refused(fatigue, said):
    config = design(
        factors={"method": {"levels": ["a"]}, "direction": WAYS},
        order={"sets": 2, "repetitions": 4},
        breaks={"between_sets_s": 4.0},
        fatigue=fatigue,
    )
    with pytest.raises(ConfigError, match=said):
        of(config)


def test_what_is_most_likely_not_meant_is_said():
    damper = {"levels": ["off", "on"]}
    often = design(
        factors={"method": {"levels": ["a"]}, "damper": damper},
        order={"repetitions": 20, "longest_run": {"damper": 1}},
        timing={"hand_over_s": 1.0, "planned_s": 30.0},
    )
    said = list(planned.warnings(often, of(often)))
    assert said == [
        "the plan takes 40 s, longer than timing.planned_s = 30 s, which is what participants are told",
        "hands set something anew 39 times in 40 trials (damper); name the factor in order.session to set it once a "
        "session",
    ]
    once = design(
        factors={"method": {"levels": ["a"]}, "damper": damper},
        order={"repetitions": 20, "session": ["damper"]},
    )
    assert list(planned.warnings(once, of(once))) == []
    assert of(once).hand_changes == 1
