"""Which experiment somebody comes to, and what may begin: rules without a window, and what a Start leaves on record."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.clock import VirtualClock
from experiments.config.door import EligibilityConfig
from experiments.record.journal import JournalError, hold_journal
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study import register
from experiments.study.enrolment import (
    Entered,
    admit,
    enrolment_refusal,
    exclude,
    facts_of,
    is_news,
    join,
    left_to_do,
    next_experiment,
    order_broken,
    passed_over,
    read_back_refusal,
    readmit,
    typed_facts,
)
from experiments.study.folders import PlaceError, StudyFolder, open_study
from experiments.study.study import Facts, Participant, RunState
from tests.people import ORDER, someone

RULES = EligibilityConfig(ask=("age_years", "handedness"), handedness=("right",), age_years_max=29)
RIGHT = {"age_years": "25", "sex": "female", "handedness": "right"}
FACTS = Facts(age_years=25, sex="female", handedness="right")


def entered(code: str = "P01", experiment: str = "direction", facts: dict[str, str] | None = None) -> Entered:
    return Entered(participant_id=code, read_back=code, experiment=experiment, facts=RIGHT if facts is None else facts)


# which experiment


@pytest.mark.parametrize(
    ("states", "coming"),
    [
        (("not begun", "not begun"), "direction"),
        (("in progress", "not begun"), "direction"),
        (("done", "not begun"), "preference"),
        (("done", "in progress"), "preference"),
        (("not begun", "done"), "direction"),
        (("open elsewhere", "not begun"), "direction"),
        (("unreadable", "not begun"), "direction"),
        (("done", "done"), "direction"),
    ],
)
def test_the_first_experiment_of_the_study_that_somebody_has_not_done_comes_next(
    states: tuple[RunState, RunState], coming: str
) -> None:
    assert next_experiment(someone(*states), ORDER) == coming


def test_a_new_code_begins_with_the_first_experiment() -> None:
    assert next_experiment(None, ORDER) == "direction"
    assert left_to_do(None, ORDER) == ["direction", "preference"]


@given(st.tuples(st.sampled_from(["done", "not begun"]), st.sampled_from(["done", "not begun"])))
def test_the_experiment_that_comes_next_never_breaks_the_order(states: Any) -> None:
    person = someone(*states)
    assert passed_over(person, next_experiment(person, ORDER), ORDER) == []


def test_an_experiment_breaks_the_order_if_an_earlier_one_is_not_done() -> None:
    assert passed_over(None, "preference", ORDER) == ["direction"]
    assert passed_over(someone("in progress", "not begun"), "preference", ORDER) == ["direction"]
    assert passed_over(someone("done", "not begun"), "preference", ORDER) == []


def at(*began: str) -> Participant:
    """Somebody who is done with everything, each begun at its time and an hour long."""
    person = someone("done", "done")
    hours = ((f"2026-11-28T{hour}:00:00Z", f"2026-11-28T{int(hour) + 1}:00:00Z") for hour in began)
    runs = zip(person.runs, hours, strict=True)
    return replace(person, runs=tuple(replace(run, began_utc=first, last_utc=last) for run, (first, last) in runs))


def test_runs_that_were_done_in_another_order_than_the_studys_are_named() -> None:
    broken = ("preference was begun before direction was done",)
    for first in ("not begun", "in progress", "synthetic"):
        assert order_broken(someone(first, "done")) == order_broken(someone(first, "in progress")) == broken
    assert order_broken(at("12", "10")) == order_broken(at("12", "12")) == broken
    for kept in (someone("done", "open elsewhere"), someone("in progress", "synthetic"), someone("done", "not begun")):
        assert order_broken(kept) == ()
    assert order_broken(at("10", "11")) == order_broken(at("10", "12")) == ()


# what may begin


@pytest.mark.parametrize(("code", "again", "may"), [("P01", "P01", True), ("P01", "P1", False), ("P01", "", False)])
def test_a_code_has_to_be_read_back_as_it_stands(code: str, again: str, may: bool) -> None:
    assert (read_back_refusal(replace(entered(code), read_back=again)) == "") is may
    assert read_back_refusal(entered("")).startswith("Type the participant's code")


@pytest.mark.parametrize(
    ("person", "facts", "practice", "said"),
    [
        (someone("not begun", "not begun"), FACTS, False, ""),
        (someone("in progress", "not begun"), FACTS, False, ""),
        (
            someone("done", "not begun"),
            FACTS,
            False,
            "P01 has finished direction; one finished run a participant and experiment: choose another "
            "experiment; a retest is a copy of the config",
        ),
        (someone("done", "not begun"), FACTS, True, ""),
        (someone("open elsewhere", "not begun"), FACTS, False, "P01 sits at another console, where direction is open"),
        (someone("not begun", "open elsewhere"), FACTS, False, "P01 sits at another console, where preference is open"),
        (someone("open elsewhere", "not begun"), FACTS, True, "P01 sits at another console"),
        (someone("in progress", "not begun", excluded="fell ill"), FACTS, False, "P01 is excluded (fell ill): readmit"),
        (someone("not begun", "not begun", excluded="fell ill"), FACTS, True, "P01 is excluded (fell ill): readmit"),
        (
            someone("not begun", "not begun"),
            Facts(handedness="right"),
            False,
            "The study asks for what was not given",
        ),
        (
            someone("in progress", "not begun", facts=FACTS),
            Facts(age_years=31, handedness="left"),
            False,
            "P01 is not eligible: age_years = 31: must be at most 29; handedness = left: must be right.",
        ),
    ],
)
def test_what_stands_in_the_way_is_said_in_one_sentence(
    person: Participant, facts: Facts, practice: bool, said: str
) -> None:
    found = enrolment_refusal(person, entered(), facts, RULES, practice=practice)
    assert found.startswith(said)
    assert bool(found) is bool(said)


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ({"age_years": "twenty"}, "age_years = 'twenty': must be whole years from 1 to 120"),
        ({"age_years": "25.5"}, "age_years = '25.5': must be whole years from 1 to 120"),
        ({"age_years": "-5"}, "age_years = '-5': must be whole years from 1 to 120"),
        ({"age_years": "0"}, "age_years = 0: must be whole years from 1 to 120"),
        ({"age_years": "121"}, "age_years = 121: must be whole years from 1 to 120"),
        ({"age_years": "9" * 5000}, "must be whole years from 1 to 120"),
        ({"sex": "right"}, "sex = 'right': must be one of the levels that are offered"),
    ],
)
def test_a_fact_that_is_none_is_refused_with_fact_value_and_rule(typed: dict[str, str], said: str) -> None:
    with pytest.raises(ValueError, match="must be") as refused:
        facts_of(typed)
    assert said in str(refused.value)


@given(
    st.builds(
        Facts,
        age_years=st.none() | st.integers(1, 120),
        sex=st.none() | st.sampled_from(["female", "male", "other", "undisclosed"]),
        handedness=st.none() | st.sampled_from(["right", "left", "both"]),
    )
)
def test_facts_on_record_can_be_shown_as_typed_and_mean_the_same(facts: Facts) -> None:
    assert facts_of(typed_facts(facts)) == facts


def test_only_a_change_of_what_is_asked_is_news() -> None:
    known = someone("not begun", "not begun", facts=FACTS)
    assert is_news(someone("not begun", "not begun"), Facts(), ())
    assert not is_news(known, FACTS, ("age_years", "sex"))
    assert not is_news(known, Facts(age_years=25), ("age_years",))
    assert is_news(known, Facts(age_years=26), ("age_years",))


# what a Start leaves on record


@pytest.fixture
def study(tmp_path: Path) -> StudyFolder:
    from experiments.study.new_study import new_study

    new_study(tmp_path / "pilot")
    return open_study(tmp_path / "pilot")


def broken_off(study: StudyFolder, code: str = "P01") -> Path:
    """A run of experiment 1 that was broken off; its journal."""
    journal = run(
        RunRequest(setup=study.setups[0], participant_id=code, results=study.results, screen="terminal"),
        synthetic_screen,
        VirtualClock(),
    ).place.journal
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:40]))
    return journal


def records(study: StudyFolder) -> list[str]:
    return [one.kind for _, one in register.read_register(study.results).entries]


def test_who_is_new_joins_with_their_facts_and_once(study: StudyFolder) -> None:
    for _ in range(2):
        assert admit(study, entered(), VirtualClock()).state == "not begun"
    assert register.read_register(study.results).members["P01"].facts == FACTS
    assert records(study) == ["joined"]


def test_a_fact_that_was_corrected_is_on_record(study: StudyFolder) -> None:
    admit(study, entered(), VirtualClock())
    admit(study, entered(facts=RIGHT | {"age_years": "26"}), VirtualClock())
    found = register.read_register(study.results).members["P01"].facts
    assert found is not None
    assert found.age_years == 26


def test_how_an_unfinished_run_stands_is_given_back(study: StudyFolder) -> None:
    broken_off(study)
    found = admit(study, entered(), VirtualClock())
    assert (found.state, found.planned) == ("in progress", 60)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "said"),
    [
        (entered(""), "Type the participant's code"),
        (replace(entered(), read_back="P1"), "The two codes differ"),
        (entered("P 1"), "participant code 'P 1'"),
        (entered("p01"), "differs from 'P01' .* in case alone"),
        (entered(facts=RIGHT | {"age_years": "old"}), "age_years = 'old': must be whole years"),
        (entered(facts=RIGHT | {"age_years": "31"}), "P01 is not eligible: age_years = 31"),
        (entered(facts=RIGHT | {"sex": ""}), "was not given: sex"),
    ],
)
def test_who_may_not_begin_is_refused_and_nothing_is_recorded(what: Entered, said: str, study: StudyFolder) -> None:
    broken_off(study)
    with pytest.raises(PlaceError, match=said):
        admit(study, what, VirtualClock())
    assert records(study) == []


@pytest.mark.slow
def test_nobody_is_excluded_while_they_sit_at_a_run(study: StudyFolder) -> None:
    descriptor = hold_journal(broken_off(study))
    with pytest.raises(PlaceError, match=r"P01 sits at another console, where sub-P01_task-.* is open: close it there"):
        exclude(study.results, "P01", "fell ill", VirtualClock())
    assert records(study) == []
    os.close(descriptor)
    exclude(study.results, "P01", "fell ill", VirtualClock())


@pytest.mark.slow
def test_who_is_excluded_may_not_go_on_until_they_are_readmitted(study: StudyFolder) -> None:
    broken_off(study)
    join(study, "P01", FACTS, VirtualClock())
    exclude(study.results, "P01", "fell ill", VirtualClock())
    with pytest.raises(PlaceError, match="excluded"):
        admit(study, entered(), VirtualClock())
    readmit(study.results, "P01", "well again", VirtualClock())
    assert admit(study, entered(), VirtualClock()).state == "in progress"


@pytest.mark.slow
def test_a_practice_of_an_experiment_that_has_none_is_refused_before_anything_is_on_record(study: StudyFolder) -> None:
    with pytest.raises(PlaceError, match=r"preference\.toml: there is no practice .*; begin the run itself"):
        admit(study, entered(experiment="preference"), VirtualClock(), practice=True)
    assert not register.read_register(study.results).entries


@pytest.mark.slow
@pytest.mark.parametrize("practice", [False, True])
def test_a_run_that_is_open_elsewhere_is_neither_gone_on_with_nor_practised_for(
    practice: bool, study: StudyFolder
) -> None:
    descriptor = hold_journal(broken_off(study))
    with pytest.raises(PlaceError, match="sits at another console"):
        admit(study, entered(), VirtualClock(), practice=practice)
    os.close(descriptor)
    assert admit(study, entered(), VirtualClock(), practice=practice).state == "in progress"


@pytest.mark.slow
def test_a_damaged_journal_stands_in_the_way_of_its_own_experiment_alone(study: StudyFolder) -> None:
    journal = broken_off(study)
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*lines[:5], b"damage\n", *lines[6:]]))
    with pytest.raises(JournalError, match="line 6: not a JSON record"):
        admit(study, entered(), VirtualClock())
    assert records(study) == []
    assert admit(study, entered(experiment="preference"), VirtualClock()).state == "not begun"


def test_nobody_begins_by_a_register_that_cannot_be_trusted(study: StudyFolder) -> None:
    (study.results / register.REGISTER_FILE).write_text("damage\n")
    with pytest.raises(JournalError, match=r"participants\.jsonl: line 1"):
        admit(study, entered(), VirtualClock())
    assert (study.results / register.REGISTER_FILE).read_text() == "damage\n"
