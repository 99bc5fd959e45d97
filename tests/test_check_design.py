"""`recoil check` of designs: the plan in words, the cells on the gun, exposure, and what is most likely not meant."""

from __future__ import annotations

import json
import math
import re

import pytest

from analysis.predict.check import check, check_text
from analysis.predict.exposure import DAY_S, GUN_MASS_KG, exposure
from analysis.report.serial import as_json
from device.parameters import GunParameters, VibrationParameters
from device.physics import simulate
from experiments.config.door import ConfigError
from experiments.design.planning import practice_of
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.answers import synthetic_participant_of
from tests.designs import SHIPPED, path_of


def found(name, people=14):
    return check(str(path_of(name)), None, people)


def written(tmp_path, name, *changes):
    text = (path_of(name)).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    for file in ("gun.toml", "gun-five.toml", "synthetic"):
        (tmp_path / file).symlink_to(shipped_folder() / file)
    (tmp_path / f"{name}.toml").write_text(text)
    return str(tmp_path / f"{name}.toml")


def test_a_design_is_told_as_a_methods_section_with_cells_orders_exposure_and_assumptions():
    text = check_text(found("realism", 4))
    for said in (
        "varied within participants",
        "P01        off > on",
        "P02        on > off",
        "A(8)",
        "26.7 N",
        "factors.voltage_V.levels",
        "12 trials",
    ):
        assert said in text


def test_the_cells_are_what_the_physics_says():
    cells = found("voltages").cells
    assert len(cells) == 9
    for cell in cells:
        shot = simulate(GunParameters(voltage_V=cell.voltage_V, pulse_s=cell.pulse_s))
        assert (cell.peak_force_N, cell.status) == (shot.peak_force_N, shot.status)


def test_it_is_written_as_json():
    told = json.loads(as_json(found("grip")))
    assert told["experiment"] == "grip"
    assert len(told["orders"]) == 14
    assert told["exposure"]["limit_m_s2"] == 5.0


def test_exposure_adds_energies_shot_by_shot():
    vibration = VibrationParameters()
    one = exposure([(vibration, 1)]).a8_m_s2
    assert one == pytest.approx(math.sqrt(257.54**2 * 0.024 / DAY_S), rel=1e-12)
    assert exposure([(vibration, 400)]).a8_m_s2 == pytest.approx(20 * one, rel=1e-12)


def test_exposure_of_the_voice_coil_is_above_what_the_force_alone_gives():
    gun = GunParameters()
    shot = simulate(gun)
    mean_force_N = shot.recoil_impulse_Ns / shot.recoil_end_s
    least = mean_force_N**2 * shot.recoil_end_s / GUN_MASS_KG**2
    assert exposure([(gun, 1)]).a8_m_s2 ** 2 * DAY_S > least


def test_hands_that_set_something_anew_at_nearly_every_trial_are_a_warning(tmp_path):
    often = check(
        written(
            tmp_path, "realism", ('session = ["damper"]\nsessions = "latin-square"\n', "longest_run = { damper = 1 }\n")
        ),
        None,
        2,
    )
    assert any("hands set something anew" in one for one in often.warnings)
    assert not found("realism").warnings
    assert "(method)" in found("grip").warnings[0]  # whose dampers are set by hand


def test_first_sessions_that_chance_left_uneven_are_a_warning():
    assert any("chance leaves the first session uneven" in one for one in found("direction").warnings)
    assert not any("uneven" in one for one in found("realism").warnings)


def test_a_cell_beyond_a_limit_is_refused_with_its_levels(tmp_path):
    with pytest.raises(ConfigError, match=r"voltages\.toml:13: factors\.voltage_V\.levels: .*voltage_V = 30.*24"):
        check(written(tmp_path, "voltages", ("18.0]", "30.0]")), None, 1)


def test_a_stated_duration_far_from_the_plan_is_a_warning_either_way(tmp_path):
    for number, stated in enumerate(("60.0", "36000.0")):
        place = tmp_path / str(number)
        place.mkdir()
        told = check(written(place, "voltages", ("planned_s = 1800.0", f"planned_s = {stated}")), None, 1)
        assert any("which is what participants are told" in one for one in told.warnings)


def test_a_language_without_a_catalogue_is_a_warning_with_its_line_before_anybody_comes_to_the_lab(tmp_path):
    design = written(tmp_path, "voltages", ('gun = "gun.toml"', 'gun = "gun.toml"\nlanguage = "German"'))
    (said,) = [one for one in check(design, None, 1).warnings if "language" in one]
    assert re.search(r"voltages\.toml:\d+: language = 'German': no catalogue of that name; there are en, zh; ", said)
    assert said.endswith("docs/howto/languages.md says how to make one, and how it is found")


def test_what_synthetic_people_are_given_for_nothing_that_there_is_is_a_warning_with_its_line(tmp_path):
    told = check(written(tmp_path, "direction", (', "asymmetric-2"]', "]")), None, 1)
    forward, backward = [one for one in told.warnings if "nobody meets that" in one]
    assert "direction.toml:" in forward
    assert 'questions.response.share."asymmetric-2/forward": nobody meets that; direction has vibration/' in forward
    assert "asymmetric-2/backward" in backward


@pytest.mark.parametrize(("threshold", "said"), [(4.0, True), (4e-6, True), (0.04, False), (0.004, False)])
def test_a_threshold_of_synthetic_people_in_another_unit_is_a_warning_with_its_line(tmp_path, threshold, said):
    path = written(tmp_path, "detection", ('"synthetic/detection.toml"', '"own.toml"'))
    law = f'law = "psychometric"\nfactor = "pulse_s"\nspread = 0.2\nthreshold = {threshold}\n'
    (tmp_path / "own.toml").write_text(f"[questions.felt]\n{law}")
    told = f"{tmp_path / 'own.toml'}:5: questions.felt.threshold = {threshold:g}: the levels of pulse_s are 0.003 to "
    warned = [one for one in check(path, None, 1).warnings if "give the threshold in the unit of the levels" in one]
    assert [one.startswith(told) for one in warned] == [True] * said


@pytest.mark.slow
def test_what_synthetic_people_do_in_a_practice_without_instructions_is_given_for_something(tmp_path):
    """Of `by` with the instruction a practice has the method alone: without a value nobody could practise."""
    practised = '[practice]\nrepetitions = 1\nof = ["method"]\n\n[questions.response]'
    methods = ('["vibration", "asymmetric-1", "asymmetric-2"]', '["asymmetric-1"]')
    path = written(
        tmp_path, "hurry", ("[questions.response]", practised), methods, ('"synthetic/hurry-felt.toml"', '"own.toml"')
    )
    told = 'share = { "asymmetric-1/speed" = 0.6, "asymmetric-1/accuracy" = 0.8'
    laws = f'[questions.response]\nlaw = "rates"\nby = ["method", "instruction"]\n{told}'
    (tmp_path / "own.toml").write_text(laws + ', "asymmetric-1" = 0.7 }\n')
    assert not [one for one in check(path, None, 1).warnings if "nobody meets that" in one]
    (tmp_path / "own.toml").write_text(laws + " }\n")
    setup = load_setup(path)
    plan = practice_of(setup.config, "P01", 1)
    with pytest.raises(ConfigError, match="a trial without one instruction, such as one of a practice"):
        synthetic_participant_of(setup, plan).answer(plan.trials[0], "response")


@pytest.mark.slow
def test_the_comparison_being_right_on_both_sides_of_the_standard_is_a_warning(tmp_path):
    """Asked for the stronger shot, everybody who feels it would be wrong wherever the standard is the stronger one."""
    larger, interval = 'correct = "larger"', 'correct = "interval"'
    (told,) = check(written(tmp_path, "stronger", (larger, interval)), None, 1).warnings
    assert "questions.stronger.correct = 'interval'" in told
    assert "below the standard of 14; if the larger one is asked for, say larger" in told
    above = ("levels = [11.0, 12.0, 13.0, 15.0, 16.0, 17.0]", "levels = [15.0, 16.0, 17.0]")
    (tmp_path / "above").mkdir()
    one_side = check(written(tmp_path / "above", "stronger", (larger, interval), above), None, 1)
    assert not [one for one in one_side.warnings if "interval" in one]


@pytest.mark.slow
def test_answers_about_a_pair_that_are_not_called_first_and_second_are_told_with_what_they_count_as(tmp_path):
    """“left, equal, right” would count each “equal” as a choice of the second shot, and each “right” as a tie."""
    own = ('answers = ["first", "second"]\n', 'answers = ["left", "equal", "right"]\n')
    keys = ('keys = { first = "left", second = "right" }', "")
    answering = 'law = "shares"\nshare.all = { left = 0.4, equal = 0.2, right = 0.4 }\n'
    path = written(tmp_path, "pairs", own, keys, ('"synthetic/pairs.toml"', '"own.toml"'))
    (tmp_path / "own.toml").write_text(f"[questions.rather]\n{answering}")
    (told,) = [one for one in check(path, None, 1).warnings if one.startswith("questions.")]
    assert "of a pair “left” counts as a choice of the first interval, “equal” of the second, and “right” as a" in told
    assert not found("pairs", 1).warnings


@pytest.mark.slow
def test_a_level_that_is_no_shot_and_counts_as_a_stimulus_is_a_warning(tmp_path):
    levels = ("[factors.pulse_s]\nlevels = [", "[factors.pulse_s]\nlevels = [0.0, ")
    moving = ('design = "detection"', 'design = "detection"\nbelow_break_away = true')
    told = check(written(tmp_path, "detection", levels, moving), None, 1).warnings
    (warning,) = [one for one in told if "factors" in one]
    assert warning.startswith("factors.pulse_s: its level 0 is no shot, and “no” is wrong there all the same")
    assert not [one for one in found("detection").warnings if "is no shot" in one]


def test_a_key_that_begins_a_word_of_another_answer_is_a_warning(tmp_path):
    keys = 'answers = ["forward", "backward"]'
    alike = 'labels = { forward = "a kick", backward = "a knock" }'
    told = check(written(tmp_path, "voltages", (keys, f"{keys}\n{alike}")), None, 1).warnings
    (warning,) = [one for one in told if one.startswith("questions.")]
    assert "K is the key of “a kick”, and “a knock” has a word with K as well" in warning
    assert not [one for name in SHIPPED for one in found(name).warnings if "is the key of" in one]


def test_a_study_whose_papers_numbers_are_not_there_is_refused_with_the_line(tmp_path):
    study = tmp_path / "study.toml"
    text = (shipped_folder() / "study.toml").read_text()
    study.write_text(text.replace('paper = "paper.toml"', 'paper = "papers.toml"'))
    for name in ("direction.toml", "preference.toml", "gun.toml", "synthetic"):
        (tmp_path / name).symlink_to(shipped_folder() / name)
    with pytest.raises(ConfigError, match=r"study\.toml:\d+: paper = 'papers\.toml': no such file beside the study"):
        check(str(study), None, 1)
