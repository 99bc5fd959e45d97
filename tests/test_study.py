"""Who may take part, how far everyone is, who comes next, and rows that stay balanced whoever drops out."""

from __future__ import annotations

import tempfile
import threading
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.clock import VirtualClock
from experiments.config.door import ConfigError, EligibilityConfig, Handedness, Sex, StudyConfig
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.live_run import Screen
from experiments.load import load_setup, load_study, shipped_folder
from experiments.run import Finished, MakeScreen, run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.balance import row_of_next_run, used_rows
from experiments.study.folders import place
from experiments.study.register import append, entry, read_register
from experiments.study.study import (
    Facts,
    Participant,
    RunProgress,
    RunState,
    by_code,
    eligible,
    free_code,
    unanswered,
    unasked,
    who_is_next,
)
from tests.designs import changed, direction_with
from tests.journals import write_head

PAPER = load_study("study")[0].eligibility
STUDY = StudyConfig(title="T", participants=3, experiments=("direction.toml", "preference.toml"))
EXPERIMENTS = ("direction", "preference")

# eligibility


def test_the_rules_are_those_of_the_papers_sample() -> None:
    # "Fourteen right-handed participants whose ages ranged from 21 to 29 years", section III
    assert set(PAPER.ask) == {"age_years", "sex", "handedness"}
    for age in (21, 29):
        assert eligible(Facts(age_years=age, sex="male", handedness="right"), PAPER) == ()


@pytest.mark.parametrize(
    ("facts", "reasons"),
    [
        (Facts(age_years=20, handedness="right"), ("age_years = 20: must be at least 21",)),
        (Facts(age_years=30, handedness="right"), ("age_years = 30: must be at most 29",)),
        (Facts(age_years=25, handedness="left"), ("handedness = left: must be right",)),
        (Facts(age_years=25, handedness="both"), ("handedness = both: must be right",)),
        (
            Facts(),
            (
                "age_years is not known: must be at least 21",
                "age_years is not known: must be at most 29",
                "handedness is not known: must be right",
            ),
        ),
    ],
)
def test_each_reason_names_fact_value_and_rule(facts: Facts, reasons: tuple[str, ...]) -> None:
    assert eligible(facts, PAPER) == reasons


ages = st.none() | st.integers(1, 120)
all_facts = st.builds(
    Facts,
    age_years=ages,
    sex=st.none() | st.sampled_from(get_args(Sex)),
    handedness=st.none() | st.sampled_from(get_args(Handedness)),
)


def levels(kind: Any) -> st.SearchStrategy[tuple[str, ...]]:
    return st.lists(st.sampled_from(get_args(kind)), unique=True).map(tuple)


@pytest.mark.slow
@given(all_facts, ages, ages, levels(Sex), levels(Handedness))
def test_someone_is_eligible_exactly_if_every_rule_holds(
    facts: Facts, low: int | None, high: int | None, sex: Any, handedness: Any
) -> None:
    if low is not None and high is not None:
        low, high = min(low, high), max(low, high)
    rules = EligibilityConfig(
        ask=("age_years", "sex", "handedness"),
        age_years_min=low,
        age_years_max=high,
        sex=sex,
        handedness=handedness,
    )
    holds = [
        low is None or (facts.age_years is not None and facts.age_years >= low),
        high is None or (facts.age_years is not None and facts.age_years <= high),
        not sex or facts.sex in sex,
        not handedness or facts.handedness in handedness,
    ]
    assert len(eligible(facts, rules)) == holds.count(False)


@given(all_facts)
def test_without_rules_everyone_is_eligible_and_nothing_is_asked(facts: Facts) -> None:
    assert eligible(facts, STUDY.eligibility) == ()
    assert unanswered(facts, STUDY.eligibility) == ()
    assert unasked(facts, STUDY.eligibility) == facts.known()


def test_what_is_asked_and_not_given_is_named() -> None:
    assert unanswered(Facts(age_years=25), PAPER) == ("sex", "handedness")
    assert unasked(Facts(age_years=25, sex="male"), EligibilityConfig(ask=("sex",))) == ("age_years",)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("age_years_min = 21", "age_years_min = 31", "age_years_min = 31 is above age_years_max = 29"),
        ('"sex", "handedness"]', '"sex"]', r"handedness = \['right'\] is a rule about handedness, which is not asked"),
        ('ask = ["age_years", ', "ask = [", "age_years_min = 21 is a rule about age_years, which is not asked"),
        ('handedness = ["right"]', 'handedness = ["Right"]', "handedness.0 = 'Right'"),
        ('handedness = ["right"]', 'handedness = "right"', "handedness = 'right'"),
        ('handedness = ["right"]', 'handedness = ["right", "right"]', "right stands there more than once"),
        ('"sex", "handedness"]', '"sex", "handedness", "name"]', "ask.3 = 'name'"),
        ("age_years_max = 29", "age_years_max = 29.0", "age_years_max = 29.0"),
        ("age_years_max = 29", "age_years_max = 121", "age_years_max = 121"),
        ("age_years_max = 29", "age_max = 29", "age_max = 29: unknown key"),
    ],
)
def test_a_contradiction_is_refused_with_file_line_key_value_and_rule(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    text = (shipped_folder() / "study.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "study.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=rf"study\.toml:\d+: eligibility.*{said}"):
        load_study(str(tmp_path / "study.toml"))


# who comes next


def someone(code: str, *states: RunState, excluded: str | None = None) -> Participant:
    runs = tuple(RunProgress(experiment=name, state=state) for name, state in zip(EXPERIMENTS, states, strict=True))
    return Participant(participant_id=code, runs=runs, excluded=excluded)


def next_code(*people: Participant) -> str | None:
    coming = who_is_next(people, STUDY, EXPERIMENTS)
    return coming.participant_id if coming else None


def test_the_first_of_a_study_gets_its_first_code_and_all_experiments() -> None:
    coming = who_is_next([], STUDY, EXPERIMENTS)
    assert coming is not None
    assert (coming.participant_id, coming.new) == ("P01", True)
    assert [(run.experiment, run.state) for run in coming.runs] == [(name, "not begun") for name in EXPERIMENTS]


def test_who_is_in_progress_comes_before_who_has_not_begun_and_those_before_new_ones() -> None:
    waiting, half = someone("P01", "done", "not begun"), someone("P02", "in progress", "not begun")
    assert next_code(waiting, half) == "P02"
    assert next_code(waiting) == "P01"
    assert next_code(someone("P01", "done", "done")) == "P02"


def test_codes_are_taken_in_the_order_in_which_people_count() -> None:
    assert next_code(someone("P10", "not begun", "done"), someone("P9", "not begun", "done")) == "P9"
    assert sorted(["P10", "P2a10", "P2a9", "P2"], key=by_code) == ["P2", "P2a9", "P2a10", "P10"]


def test_only_what_is_not_done_is_open() -> None:
    coming = who_is_next([someone("P01", "done", "in progress")], STUDY, EXPERIMENTS)
    assert coming is not None
    assert [run.experiment for run in coming.runs] == ["preference"]


def test_a_run_that_cannot_be_read_is_not_done_again() -> None:
    assert next_code(someone("P01", "done", "unreadable")) == "P02"


def test_who_sits_at_another_console_is_not_called_to_this_one() -> None:
    busy = someone("P01", "open elsewhere", "not begun")
    assert next_code(busy) == "P02"
    assert next_code(busy, someone("P02", "not begun", "not begun")) == "P02"
    assert next_code(busy, *(someone(f"P0{number}", "done", "done") for number in (2, 3))) is None


def test_who_is_excluded_never_comes_and_is_replaced_by_a_new_code() -> None:
    people = [someone(f"P0{number}", "done", "done") for number in (1, 2)]
    gone = someone("P03", "in progress", "not begun", excluded="left")
    assert next_code(*people, gone) == "P04"
    assert next_code(*people, gone, someone("P04", "done", "done")) is None


@pytest.mark.slow
@given(st.lists(st.from_regex(r"[Pp]0[0-9]|[A-Za-z0-9]{1,4}", fullmatch=True)))
def test_a_free_code_is_nobodys_whatever_the_case(taken: list[str]) -> None:
    assert free_code(STUDY, taken).lower() not in {code.lower() for code in taken}


everyone = st.lists(
    st.tuples(
        st.integers(1, 30), st.sampled_from(get_args(RunState)), st.sampled_from(get_args(RunState)), st.booleans()
    ),
    unique_by=lambda drawn: drawn[0],
)


@pytest.mark.slow
@given(everyone)
def test_nobody_comes_before_someone_in_progress_and_no_more_come_than_planned(drawn: list[Any]) -> None:
    people = [someone(f"P{n:02d}", a, b, excluded="left" if out else None) for n, a, b, out in drawn]
    taking_part = {one.participant_id: one for one in people if one.excluded is None and not one.is_synthetic}
    coming = who_is_next(people, STUDY, EXPERIMENTS)
    if coming is None:
        assert len(taking_part) >= STUDY.participants
        assert not any(one.open_runs and not one.is_elsewhere for one in taking_part.values())
    elif coming.new:
        assert coming.participant_id not in {one.participant_id for one in people if not one.is_synthetic}
        assert len(taking_part) < STUDY.participants
    else:
        chosen = taking_part[coming.participant_id]
        assert coming.runs == chosen.open_runs != ()
        assert not chosen.is_elsewhere
        waiting = [one for one in taking_part.values() if not one.is_elsewhere]
        assert chosen.in_progress or not any(one.in_progress for one in waiting)


# balance


SQUARES = [
    (changed("preference", order={"trials": "latin-square"}), 3),
    (changed("direction", order={"sessions": "williams"}), 6),
]


def begin(results: Path, code: str, setup: Setup[DesignConfig]) -> None:
    """The head of a run that takes the next row, as the program would write it."""
    where = place(results, code, setup.config.experiment)
    where.folder.mkdir(parents=True)
    row = row_of_next_run(setup, results, read_register(results))
    plan = Plan(experiment=where.experiment, participant_id=code, seed=1, order_row=row, trials=())
    write_head(where.journal, plan)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.sampled_from(SQUARES), st.integers(1, 13), st.lists(st.none() | st.integers(0, 12), max_size=25))
def test_rows_differ_by_one_at_most_once_drop_outs_are_replaced(
    square: tuple[Setup[DesignConfig], int], planned: int, happenings: list[int | None]
) -> None:
    """`None`: the next one comes, if there is a place; a number: one of those taking part drops out."""
    setup, rows = square
    with tempfile.TemporaryDirectory() as folder:
        results, taking_part, begun = Path(folder), list[str](), 0
        for happening in [*happenings, *[None] * planned]:
            if happening is not None and taking_part:
                gone = taking_part.pop(happening % len(taking_part))
                append(results, entry("excluded", gone, reason="dropped out"), VirtualClock())
            elif happening is None and len(taking_part) < planned:
                begun += 1
                taking_part.append(f"P{begun:02d}")
                begin(results, taking_part[-1], setup)
            counts = Counter(used_rows(results, setup.config.experiment, read_register(results)))
            assert counts.total() == len(taking_part)
            full = len(taking_part) == planned or begun == len(taking_part)
            assert not full or max(counts[row] for row in range(rows)) - min(counts[row] for row in range(rows)) <= 1


def test_a_drop_out_gives_the_row_back_and_a_readmitted_one_takes_it_again(tmp_path: Path) -> None:
    setup, _ = SQUARES[0]
    for code in ("P01", "P02", "P03"):
        begin(tmp_path, code, setup)
    assert row_of_next_run(setup, tmp_path, read_register(tmp_path)) == 0
    append(tmp_path, entry("excluded", "P02", reason="left"), VirtualClock())
    assert used_rows(tmp_path, "preference", read_register(tmp_path)) == [0, 2]
    assert row_of_next_run(setup, tmp_path, read_register(tmp_path)) == 1
    append(tmp_path, entry("readmitted", "P02", reason="came back"), VirtualClock())
    assert used_rows(tmp_path, "preference", read_register(tmp_path)) == [0, 1, 2]


@pytest.mark.slow
def test_two_consoles_that_begin_at_once_get_rows_of_their_own(tmp_path: Path) -> None:
    setup, other_stands = direction_with(order={"sessions": "williams"}), threading.Event()

    def begun(code: str, make_screen: MakeScreen) -> Finished:
        asked = RunRequest(setup=setup, participant_id=code, results=tmp_path, seed=1)
        return run(asked, make_screen, VirtualClock())

    def stands(*about: Any) -> Screen:
        other_stands.set()
        return synthetic_screen(*about)

    def second_begins_meanwhile(*about: Any) -> Screen:
        other.start()
        other_stands.wait(0.5)  # it does not, as its row hangs on ours
        return synthetic_screen(*about)

    found: list[Finished] = []
    other = threading.Thread(target=lambda: found.append(begun("P02", stands)))
    found.append(begun("P01", second_begins_meanwhile))
    other.join()
    assert {one.plan.participant_id: one.plan.order_row for one in found} == {"P01": 0, "P02": 1}


def test_a_random_order_has_no_rows(tmp_path: Path) -> None:
    assert row_of_next_run(load_setup("direction"), tmp_path, read_register(tmp_path)) is None


def test_facts_and_standings_cannot_be_changed() -> None:
    one = someone("P01", "done", "done")
    assert replace(one, excluded="left") != one
    with pytest.raises(AttributeError):
        one.excluded = "left"  # type: ignore[misc]
