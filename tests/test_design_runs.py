"""Whole runs of designs from files: each is worked to its end, broken off anywhere and gone on with, and rebuilt."""

from __future__ import annotations

import csv
import io
from collections import Counter

import pytest

from experiments.clock import VirtualClock
from experiments.design.planned import order_shown
from experiments.design.planning import groups, plan_of, practice_of, square_size
from experiments.load import load_setup
from experiments.record.design_columns import columns
from experiments.record.journal import read_journal
from experiments.record.rebuild import rebuild
from experiments.record.replay import history
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.practice_text import practice_text
from experiments.screens.synthetic import synthetic_screen
from experiments.session.design_session import design_session
from experiments.session.practice_rounds import RoundScore, is_needed, scores
from experiments.session.remarks import EntryCorrected
from experiments.session.steps import Answered, Ask, FireShot, Inform, Prepare, Rate, Rest, step_after
from experiments.study.files_begun_with import copy_began_with
from experiments.study.folders import open_study, overview, place
from experiments.tasks.questions import right_answer
from tests.designs import SHIPPED, changed, laws_of
from tests.driven_designs import done

SETUPS = {name: load_setup(name) for name in SHIPPED}
SETUPS["preference"] = changed("preference", laws={"questions": {"comment": {"texts": ("soft",)}}})
"""Whose people say something, so every question has an answer."""
SETUPS["threshold"] = changed("threshold", procedure={"trials": 6})
SETUPS["staircase"] = changed("staircase", procedure={"trials": 6, "reversals": 0})
"""Short tracks, which end with their last trial: every planned trial is felt."""


def carried_out(name, results, code="P01", again="ask", **more):
    request = RunRequest(setup=SETUPS[name], participant_id=code, results=results, seed=1, again=again, **more)
    return run(request, synthetic_screen, VirtualClock())


def rows_of(data):
    return list(csv.DictReader(io.StringIO(data.decode(), newline="")))


def answers(name, rows):
    asked = [*SETUPS[name].config.questions, "correct"]
    return [{key: row[key] for key in asked if key in row} for row in rows]


@pytest.fixture(scope="module", params=SETUPS)
def whole(request, tmp_path_factory):
    results = tmp_path_factory.mktemp(request.param)
    finished = carried_out(request.param, results)
    return request.param, finished, finished.place.journal.read_bytes().splitlines(keepends=True)


@pytest.mark.slow
def test_every_planned_trial_has_a_row_with_every_answer(whole):
    name, finished, _ = whole
    design = SETUPS[name].config
    rows = rows_of(finished.place.table.read_bytes())
    assert finished.place.table.name.endswith(f"_{design.table}.csv")
    assert [*rows[0]] == [column.name for column in columns(design)]
    assert len(rows) == len(finished.plan.trials)
    for row, trial in zip(rows, finished.plan.trials, strict=True):
        assert all(row[question] for question in design.questions)
        assert {row[factor] for factor, level in trial.levels if factor in row and not isinstance(level, float)} == {
            str(level) for factor, level in trial.levels if factor in row and not isinstance(level, float)
        }
        assert row["attempts"] == "1"


@pytest.mark.slow
def test_its_table_is_made_again_from_the_journal_byte_for_byte(whole):
    _, finished, _ = whole
    path, data, contents = rebuild(finished.place.journal)
    assert (path, data) == (finished.place.table, finished.place.table.read_bytes())
    assert contents.plan == finished.plan


@pytest.mark.slow
def test_broken_off_anywhere_and_gone_on_with_it_has_the_same_answers(whole, tmp_path):
    name, finished, lines = whole
    expected = answers(name, rows_of(finished.place.table.read_bytes()))
    for part in (0.02, 0.31, 0.5, 0.77, 0.99):
        results = tmp_path / str(part)
        where = place(results, "P01", name)
        where.folder.mkdir(parents=True)
        where.journal.write_bytes(b"".join(lines[: max(1, int(part * len(lines)))]))
        again = carried_out(name, results, again="resume")
        assert again.plan == finished.plan
        assert answers(name, rows_of(again.place.table.read_bytes())) == expected


@pytest.mark.slow
def test_what_the_participant_is_told_first_is_in_the_journal(tmp_path):
    finished = carried_out("voltages", tmp_path)
    told = [step.what for step, _ in history(read_journal(finished.place.journal)) if isinstance(step, Inform)]
    assert told == ["consent", "instruction"]


@pytest.mark.slow
def test_groups_are_filled_in_turn_and_rows_of_the_square_as_well(tmp_path):
    count = len(groups(SETUPS["grip"].config))
    found = [carried_out("grip", tmp_path, f"P0{number}").plan for number in range(1, 2 * count + 1)]
    assert [plan.group for plan in found] == [*range(count)] * 2
    orders = [carried_out("realism", tmp_path, f"P0{number}").plan.order_row for number in (1, 2, 3)]
    assert orders == [0, 1, 0]


@pytest.mark.slow
def test_in_each_group_every_row_of_the_square_comes_equally_often(tmp_path):
    config = SETUPS["grip"].config
    count, rows = len(groups(config)), square_size(config)
    assert (count, rows) == (2, 3)
    plans = [carried_out("grip", tmp_path, f"P{number:02d}").plan for number in range(1, 2 * count * rows + 1)]
    met = Counter((plan.group, plan.order_row) for plan in plans)
    assert set(met.values()) == {2}
    assert len(met) == count * rows


def test_the_order_that_is_shown_is_that_of_sessions_and_group():
    realism, grip = SETUPS["realism"].config, SETUPS["grip"].config
    assert order_shown(realism, plan_of(realism, "P01", 1, row=1)) == ("on", "off")
    assert order_shown(grip, plan_of(grip, "P01", 1, row=0, group=1)) == ("two hands",)
    short = changed("grip", order={"repetitions": 1}).config
    assert order_shown(short, plan_of(short, "P01", 1, row=0))[0].startswith("one hand: ")


def test_a_practice_is_of_the_gun_and_told_no_instruction():
    practised = practice_of(changed("hurry", practice={"repetitions": 2, "of": ("method",)}).config, "P01", 1)
    assert {trial.instruction for trial in practised.trials} == {""}


def test_a_hand_sets_the_damper_once_a_session_where_the_design_says_so(tmp_path):
    finished = carried_out("realism", tmp_path)
    told = history(read_journal(finished.place.journal))
    settings = [dict(step.settings)["damper"] for step, _ in told if isinstance(step, Prepare)]
    assert len(set(settings[:6])) == len(set(settings[6:])) == 1
    assert settings[0] != settings[-1]
    assert not any(isinstance(step, Rest) for step, _ in told) or SETUPS["realism"].config.breaks.between_sessions_s


@pytest.mark.slow
def test_what_hands_do_tells_nobody_which_interval_is_empty(tmp_path):
    request = RunRequest(setup=load_setup("staircase"), participant_id="P01", results=tmp_path, seed=5)
    done = run(request, synthetic_screen, VirtualClock())
    told = [step for step, _ in history(read_journal(done.place.journal)) if isinstance(step, Prepare | FireShot)]
    seen = {
        trial.intervals: [
            (type(step), step.interval, step.settings if isinstance(step, Prepare) else step.gap_s)
            for step in told
            if step.trial == trial and step.attempt == 1
        ]
        for trial in done.plan.trials
        if any(step.trial == trial for step in told)
    }
    first, second = seen.values()
    assert first == second
    assert [kind for kind, _, _ in first] == [Prepare, FireShot, FireShot]


def test_a_practice_has_some_of_each_cell_and_is_kept_apart(tmp_path):
    shipped = SETUPS["direction"].config
    practice = shipped.practice.model_copy(update={"repetitions": 2, "of": ("method",)})
    design = shipped.model_copy(update={"practice": practice})
    plan = practice_of(design, "P01", 1)
    assert plan.practice
    assert sorted(trial.method for trial in plan.trials) == sorted([*design.methods] * 2)


def in_rounds(share, until_right=0.8, rounds=3):
    """Experiment 1 whose people are right so often, with a practice in rounds of six trials."""
    rates = dict.fromkeys(laws_of(SETUPS["direction"]).questions["response"].share, share)
    people = {"questions": {"response": {"share": rates, "ability_sd": 0.0}}}
    practice = {"repetitions": 1, "of": ("method", "direction"), "until_right": until_right, "rounds": rounds}
    return changed("direction", laws=people, practice=practice)


def practised(setup, results, screen=synthetic_screen, by="synthetic"):
    request = RunRequest(setup=setup, participant_id="P01", results=results, seed=1, practice=True, screen=by)
    return run(request, screen, VirtualClock())


@pytest.mark.slow
@pytest.mark.parametrize(("share", "rounds", "reached"), [(1 - 1e-9, 1, True), (1e-9, 3, False)])
def test_a_practice_in_rounds_is_over_once_enough_of_one_are_right(share, rounds, reached, tmp_path):
    setup = in_rounds(share)
    finished = practised(setup, tmp_path)
    told = history(read_journal(finished.place.journal))
    felt = [step.trial.set for step, _ in told if isinstance(step, FireShot)]
    assert Counter(felt) == dict.fromkeys(range(1, rounds + 1), 6)
    last = scores(setup.config, finished.plan, told)[-1]
    assert (last.trials, last.reaches(0.8)) == (6, reached)
    assert ("That was not reached" in practice_text(setup.config, finished.plan, told, over=True)) is not reached
    assert finished.plan.may_end_early
    rows = rows_of(finished.place.table.read_bytes())
    assert [row["set"] for row in rows if row["response"]] == [str(one) for one in felt]
    assert rebuild(finished.place.journal)[1] == finished.place.table.read_bytes()


@pytest.mark.slow
def test_the_study_says_that_a_practice_was_done_but_not_reached_until_one_is(tmp_path):
    for share, missed in ((1e-9, True), (1 - 1e-9, False), (1e-9, False)):
        practised(in_rounds(share, rounds=2), tmp_path, by="terminal")
        found = overview(open_study(tmp_path)).participants[0].runs[0]
        assert (found.practised, found.practice_missed) == (True, missed)


@pytest.mark.slow
def test_a_rounds_answers_count_as_they_were_corrected(tmp_path):
    setup = in_rounds(1e-9, rounds=2)
    finished = practised(setup, tmp_path)
    told = [*history(read_journal(finished.place.journal))]
    first = [trial for trial in finished.plan.trials if trial.set == 1]
    assert is_needed(setup.config, finished.plan, told, 2)
    told += [(None, EntryCorrected(trial=one, question="response", value=one.direction)) for one in first[:4]]
    assert is_needed(setup.config, finished.plan, told, 2)  # 4 of 6 are not 80 %
    told += [(None, EntryCorrected(trial=first[4], question="response", value=first[4].direction))]
    assert not is_needed(setup.config, finished.plan, told, 2)


def practised_by(setup, answer, in_break=None):
    """What a practice asks and tells, step by step, where each trial is answered so."""
    plan, told = practice_of(setup.config, "P01", 1), []
    session = design_session(plan, setup, told)
    step = next(session)
    while step is not None:
        if isinstance(step, Rest) and in_break is not None:
            in_break(told, plan)
        asked = isinstance(step, Ask)
        outcome = Answered(value=answer(step.trial), by="participant") if asked else done(step, len(told))
        told.append((step, outcome))
        step = step_after(session, outcome)
    return plan, told


def test_a_block_is_asked_about_once_also_if_a_correction_in_the_break_ends_the_practice():
    felt = {"kind": "rating", "when": "block", "text": "How strong?", "minimum": 0.0, "maximum": 10.0, "grain": 1.0}
    rounds = {"repetitions": 1, "of": ("method", "direction"), "until_right": 0.8, "rounds": 3}
    asked = {"strong": felt | {"minimum_text": "not", "maximum_text": "very"}}
    setup = changed("direction", questions=asked, breaks={"between_sets_s": 5.0}, practice=rounds)

    def all_right(told, plan):
        right = [trial for trial in plan.trials if trial.set == 1]
        told += [(None, EntryCorrected(trial=one, question="response", value=one.direction)) for one in right]

    _, told = practised_by(setup, lambda trial: {"forward": "backward"}.get(trial.direction, "forward"), all_right)
    assert Counter(step.kind for step, _ in told if isinstance(step, Ask | Rate | Rest)) == {
        "ask": 6,
        "rate": 6,
        "rest": 1,
    }


def test_trials_in_which_nothing_is_right_keep_nobody_practising():
    levels = {"voltage_V": {"levels": (12.0, 14.0, 16.0)}}  # the standard has 14 V
    rounds = {"repetitions": 1, "of": ("voltage_V",), "until_right": 1.0, "rounds": 3}
    setup = changed("stronger", factors=levels, practice=rounds)
    question = setup.config.questions["stronger"]
    plan, told = practised_by(setup, lambda trial: right_answer(setup.config, question, trial) or "first")
    assert scores(setup.config, plan, told) == [RoundScore(2, 2)]


def test_each_round_has_the_same_trials_in_an_order_of_its_own_and_the_first_is_as_without_rounds():
    plan = practice_of(in_rounds(0.5).config, "P01", 1)
    rounds = [[trial.levels for trial in plan.trials if trial.set == number] for number in (1, 2, 3)]
    assert sorted(rounds[0]) == sorted(rounds[1]) == sorted(rounds[2])
    assert rounds[0] != rounds[1]
    once = changed("direction", practice={"repetitions": 1, "of": ("method", "direction")}).config
    assert [trial.levels for trial in practice_of(once, "P01", 1).trials] == rounds[0]
    assert not practice_of(once, "P01", 1).may_end_early


@pytest.mark.parametrize(
    ("practice", "said"),
    [
        ({"until_right": 0.8}, "until_right needs rounds"),
        ({"rounds": 3}, "rounds needs until_right"),
        ({"until_right": 0.8, "rounds": 3, "repetitions": 0, "of": ()}, "a practice needs repetitions"),
    ],
)
def test_a_criterion_and_rounds_go_together(practice, said):
    whole = {"repetitions": 1, "of": ("method",)} | practice
    with pytest.raises(ValueError, match=said):
        changed("direction", practice=whole)


def test_a_criterion_needs_something_that_is_right():
    practice = {"repetitions": 1, "of": ("method",), "until_right": 0.8, "rounds": 3}
    with pytest.raises(ValueError, match=r"practice\.until_right = 0\.8: nothing is right or wrong"):
        changed("preference", practice=practice)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["voltages", "pairs", "realism"])
def test_the_files_that_a_run_began_with_are_given_back_and_it_goes_on_with_them(name, tmp_path):
    finished = carried_out(name, tmp_path / "r")
    lines = finished.place.journal.read_bytes().splitlines(keepends=True)
    copies = copy_began_with(finished.place.journal, tmp_path / "began")
    assert copies[0].name == f"{name}.toml"
    assert load_setup(str(copies[0])).sha256() == SETUPS[name].sha256()
    finished.place.journal.write_bytes(b"".join(lines[: len(lines) // 2]))
    request = RunRequest(setup=load_setup(str(copies[0])), participant_id="P01", results=tmp_path / "r", again="resume")
    again = run(request, synthetic_screen, VirtualClock())
    assert answers(name, rows_of(again.place.table.read_bytes())) == answers(
        name, rows_of(finished.place.table.read_bytes())
    )
