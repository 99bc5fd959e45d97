from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from experiments.config.door import StudyConfig, leaves, participant_codes
from experiments.direction.config import Design, DirectionConfig
from experiments.load import load_setup, load_study, shipped_folder
from experiments.preference.config import PreferenceConfig

DIRECTION, PREFERENCE = load_setup("direction").config, load_setup("preference").config


def rebuilt(config: Any, **tables: dict[str, object]) -> Any:
    """The config with some values of its tables changed, checked again."""
    values = config.model_dump()
    for table, changes in tables.items():
        values[table] |= changes
    return type(config).model_validate(values)


def a_design(**changes: object) -> Design:
    values = DIRECTION.design.model_dump() | changes
    return Design.model_validate(values)


# what the paper fixes (section III)


def test_experiment_1_has_three_sessions_of_four_sets_of_five_trials() -> None:
    design = DIRECTION.design
    assert design.methods == ("vibration", "asymmetric-1", "asymmetric-2")
    assert (design.sets_per_session, design.trials_per_set, design.trials_per_session, design.trials) == (4, 5, 20, 60)
    assert (design.forward_per_session, design.backward_per_session) == (10, 10)
    assert (design.order, design.balance) == ("random", "session")


def test_its_breaks_are_nine_of_20_s_and_two_of_300_s() -> None:
    assert DIRECTION.breaks.between_sets_s == 20
    assert DIRECTION.breaks.between_sessions_s == 300
    assert DIRECTION.break_s == 9 * 20 + 2 * 300 == 780


def test_it_takes_30_minutes_which_leaves_17_s_a_trial() -> None:
    assert DIRECTION.duration_s == DIRECTION.timing.planned_s == 30 * 60
    assert DIRECTION.timing.trial_s == (30 * 60 - 780) / 60 == 17


def test_experiment_2_takes_8_minutes() -> None:
    assert PREFERENCE.duration_s == PREFERENCE.timing.planned_s == 8 * 60
    assert PREFERENCE.break_s == 0


def test_experiment_2_has_one_forward_trial_a_method_and_the_papers_question() -> None:
    assert PREFERENCE.design.trials == 3
    assert PREFERENCE.design.direction == "forward"
    scale = PREFERENCE.rating
    assert (scale.minimum, scale.maximum) == (0, 10)
    assert (scale.minimum_text, scale.maximum_text) == ("dislike very much", "like very much")
    assert scale.question == (
        "How much do you like such haptic feedback for simulating shooting recoil in a first-person shooting game "
        "in virtual reality?"
    )


def test_synthetic_participants_answer_forward_trials_at_the_published_rates() -> None:
    rates = DIRECTION.synthetic.rates.forward
    assert rates == {"vibration": 0.557, "asymmetric-1": 0.793, "asymmetric-2": 0.929}


@pytest.mark.parametrize("config", [DIRECTION, PREFERENCE], ids=["direction", "preference"])
def test_what_the_paper_does_not_give_is_marked_assumed(config: Any) -> None:
    synthetic = {key for key in config.assumed if key.startswith("synthetic.")}
    assert synthetic
    assert set(config.assumed) <= set(leaves(config))
    assert {key for key in config.assumed if key.startswith("fatigue.")} == {
        key for key in leaves(config) if key.startswith("fatigue.")
    }


def test_the_study_is_of_fourteen_people_with_codes_of_one_length() -> None:
    study, folder = load_study("study")
    assert folder == shipped_folder()
    assert study.codes() == [f"P{number:02d}" for number in range(1, 15)]


@pytest.mark.parametrize(("count", "last"), [(1, "P01"), (99, "P99"), (100, "P100"), (999, "P999")])
def test_codes_are_unique_sort_as_they_count_and_have_one_length(count: int, last: str) -> None:
    codes = participant_codes(count)
    assert codes[-1] == last
    assert codes == sorted(set(codes))
    assert len({len(code) for code in codes}) == 1


# rules


def test_a_config_is_never_changed() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        DIRECTION.breaks.between_sets_s = 0.0


def test_leaves_are_the_dotted_keys_of_tables_and_values() -> None:
    keys = list(leaves(DIRECTION))
    assert {"title", "design", "breaks.between_sets_s", "synthetic.rates.forward.asymmetric-1"} <= set(keys)
    assert len(keys) == len(set(keys))


@settings(deadline=None)
@given(st.integers(1, 6), st.integers(1, 8), st.integers(0, 48), st.integers(0, 48))
def test_a_design_is_taken_exactly_if_its_directions_fill_its_sets(
    sets: int, trials: int, forward: int, backward: int
) -> None:
    changes = {
        "sets_per_session": sets,
        "trials_per_set": trials,
        "forward_per_session": forward,
        "backward_per_session": backward,
    }
    if forward + backward == sets * trials:
        assert a_design(**changes).trials_per_session == forward + backward
    else:
        with pytest.raises(ValidationError, match=f"{forward} forward and {backward} backward"):
            a_design(**changes)


@pytest.mark.parametrize(("forward", "possible"), [(10, False), (8, True), (12, True), (0, True), (20, True)])
def test_set_exact_is_possible_only_if_every_set_can_hold_as_many(forward: int, possible: bool) -> None:
    changes = {"balance": "set-exact", "forward_per_session": forward, "backward_per_session": 20 - forward}
    if possible:
        a_design(**changes)
    else:
        with pytest.raises(ValidationError, match=r"set-exact.*impossible"):
            a_design(**changes)


@pytest.mark.parametrize(
    ("between_sets_s", "between_sessions_s", "longest"),
    [(20.0, 300.0, 5), (0.0, 300.0, 20), (0.0, 0.0, 60)],
)
def test_the_longest_stretch_of_trials_ends_at_the_next_break(
    between_sets_s: float, between_sessions_s: float, longest: int
) -> None:
    breaks = {"between_sets_s": between_sets_s, "between_sessions_s": between_sessions_s}
    config = rebuilt(DIRECTION, breaks=breaks, fatigue={"max_trials_without_break": 60})
    assert config.trials_without_break == longest


def test_without_breaks_between_sessions_the_last_set_of_one_runs_into_the_first_of_the_next() -> None:
    config = rebuilt(DIRECTION, breaks={"between_sessions_s": 0.0})
    assert config.trials_without_break == 10


def test_breaks_between_sets_spare_nobody_if_a_session_is_one_set() -> None:
    with pytest.raises(ValidationError, match="30 trials without a break"):
        rebuilt(
            DIRECTION,
            design={"sets_per_session": 1, "trials_per_set": 10, "forward_per_session": 5, "backward_per_session": 5},
            breaks={"between_sessions_s": 0.0},
        )


@pytest.mark.parametrize("config", [DIRECTION, PREFERENCE], ids=["direction", "preference"])
def test_a_plan_may_take_exactly_as_long_as_the_limit(config: Any) -> None:
    assert rebuilt(config, fatigue={"max_planned_s": config.duration_s}) is not None
    with pytest.raises(ValidationError, match="planned duration"):
        rebuilt(config, fatigue={"max_planned_s": config.duration_s - 0.5})


@pytest.mark.parametrize("grain", [0.1, 0.5, 1.0, 0.01, 10.0, 2.5, 10 / 3])
def test_a_grain_that_divides_the_scale_is_taken(grain: float) -> None:
    assert rebuilt(PREFERENCE, rating={"grain": grain}).rating.grain == grain


@pytest.mark.parametrize("grain", [0.3, 3.0, 11.0, 0.0, -0.1, 1e300])
def test_another_grain_is_refused(grain: float) -> None:
    with pytest.raises(ValidationError, match="grain"):
        rebuilt(PREFERENCE, rating={"grain": grain})


@pytest.mark.parametrize(("minimum", "maximum"), [(10.0, 0.0), (5.0, 5.0), (-1.0, 10.0), (0.0, 10.5)])
def test_a_scale_runs_upwards_within_0_and_10(minimum: float, maximum: float) -> None:
    with pytest.raises(ValidationError, match="need 0 <= minimum < maximum <= 10"):
        rebuilt(PREFERENCE, rating={"minimum": minimum, "maximum": maximum})


@pytest.mark.parametrize("seed", [0, 1, 2**63 - 1])
def test_a_config_may_hold_a_seed(seed: int) -> None:
    assert DirectionConfig.model_validate(DIRECTION.model_dump() | {"seed": seed}).seed == seed


@pytest.mark.parametrize("seed", [-1, 2**63, 1.0, "1", True])
def test_a_seed_that_is_none_is_refused(seed: object) -> None:
    with pytest.raises(ValidationError, match="seed"):
        PreferenceConfig.model_validate(PREFERENCE.model_dump() | {"seed": seed})


@pytest.mark.parametrize("prefix", ["", "P-", "sub P", "../", "Ä", "P" * 30, "P\n"])
def test_a_prefix_that_makes_no_code_is_refused(prefix: str) -> None:
    with pytest.raises(ValidationError, match="code_prefix"):
        StudyConfig(title="t", participants=1, experiments=("direction.toml",), code_prefix=prefix)
