"""Broken configs: the shipped ones, each with one edit. Every refusal names file, line, key, value and rule."""

import os
import shutil
from pathlib import Path

import pytest

from analysis.predict.check import check
from device.words import Pulse
from experiments.config.door import ConfigError, read_toml
from experiments.config.findings import line_of
from experiments.design.limits import limits
from experiments.load import find, load_gun, load_setup, load_study, shipped_folder
from experiments.synthetic.laws import SyntheticAnswers, TableLaw
from tests.designs import OF_THE_PAPER, SHIPPED
from tests.refusals import Broken, check_refused, edit, line, refusal

DIRECTION, PREFERENCE, GUN = "direction.toml", "preference.toml", "gun.toml"
ANSWERING, RATING = "synthetic/direction.toml", "synthetic/preference.toml"
"""Who answers the two."""
TABLE = """
[questions.response]
law = "table"
file = "answers.csv"
by = ["method", "direction"]
"""
HEADER = "participant_id,method,direction,correct\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for source in [*shipped_folder().glob("*.toml"), shipped_folder() / ANSWERING, shipped_folder() / RATING]:
        target = tmp_path / source.relative_to(shipped_folder())
        target.parent.mkdir(exist_ok=True)
        shutil.copy(source, target)
    return tmp_path


# what is shipped


@pytest.mark.parametrize("name", OF_THE_PAPER)
@pytest.mark.parametrize("ending", ["", ".toml"])
def test_a_shipped_config_loads_by_its_name_and_is_within_the_limits(name: str, ending: str) -> None:
    setup = load_setup(f"{name}{ending}")
    assert setup.config.experiment == name
    assert setup.source.parent == shipped_folder()


def test_every_shipped_config_loads() -> None:
    known = {*SHIPPED, "gun", "gun-five", "study", "paper"}
    assert {path.stem for path in shipped_folder().glob("*.toml")} == known
    assert list(load_gun(shipped_folder() / GUN).methods) == ["vibration", "asymmetric-1", "asymmetric-2"]
    study, folder = load_study("study")
    assert [load_setup(str(folder / name)).config.experiment for name in study.experiments] == list(OF_THE_PAPER)


def test_the_shipped_gun_keeps_the_drive_within_a_tenth_of_the_time() -> None:
    setup = load_setup("direction")
    driven = limits(setup.config, setup.gun)
    duties = [one.drive.pulse_s / one.settle_s for one in driven if isinstance(one.drive, Pulse)]
    assert [one.levels for one in driven if not isinstance(one.drive, Pulse)] == [(("method", "vibration"),)]
    assert 0 < max(duties) <= 0.10


def test_a_path_goes_before_a_shipped_name(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert find(DIRECTION) == Path(DIRECTION)
    assert find("direction") == shipped_folder() / DIRECTION


@pytest.mark.parametrize("name", ["nothing", "", ".", "../configs/direction", "direction.toml.toml", "a\0b"])
def test_a_name_that_means_no_file_is_refused_with_what_is_shipped(name: str) -> None:
    with pytest.raises(ConfigError, match=r"(no such file|a folder).*direction.*gun.*paper, preference.*study"):
        load_setup(name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_is_refused_as_what_it_is_wherever_a_config_belongs(folder: Path) -> None:
    os.mkfifo(pipe := folder / "pipe.toml")
    for place in (pipe, str(pipe)):
        with pytest.raises(ConfigError, match=r"pipe\.toml: it is a pipe or a device, not a file"):
            load_setup(place)
    edit(folder / DIRECTION, 'gun = "gun.toml"', 'gun = "pipe.toml"')
    assert "pipe.toml: it is a pipe or a device, not a file; the config's key `gun`" in refusal(folder / DIRECTION)


# one edit each


BROKEN = {
    "unknown key": Broken(
        DIRECTION, DIRECTION, "between_sets_s", "between_set_s", ("breaks.between_set_s = 20.0: unknown key",),
        "between_set_s",
    ),
    "keys of another law": Broken(
        DIRECTION, ANSWERING, 'law = "rates"', 'law = "psychometric"',
        ("questions.response.by: unknown key", "known are law, factor, threshold, spread, guess"), "by =",
    ),
    "missing key": Broken(
        DIRECTION, DIRECTION, "hand_over_s = 15.8 ", "# ", ("timing.hand_over_s: is missing",), "[timing]"
    ),
    "unknown table": Broken(DIRECTION, DIRECTION, "[breaks]", "[brakes]", ("brakes: unknown key",), "[brakes]"),
    "missing table": Broken(PREFERENCE, PREFERENCE, "[timing]", "[questions.comment.timing]", ("timing: is missing",)),
    "text for a number": Broken(
        DIRECTION, DIRECTION, "= 20.0", '= "20"', ("breaks.between_sets_s = '20'", "must be a number"), 'sets_s = "20"'
    ),
    "number for a text": Broken(PREFERENCE, PREFERENCE, '"like very much"', "10", ("maximum_text = 10", "must be text"),
        "maximum_text"),
    "text for a switch": Broken(
        DIRECTION, DIRECTION, "response_times = false", 'response_times = "no"', ("must be true or false",), '"no"'
    ),
    "name of a question with a blank": Broken(
        DIRECTION, DIRECTION, "[questions.response]", '[questions."which way"]', ("must be a letter and up to 31",),
        '[questions."which way"]',
    ),
    "true for a number": Broken(
        DIRECTION, DIRECTION, "= 20.0", "= true", ("breaks.between_sets_s = true", "must be a number"), "sets_s = true"
    ),
    "fraction for a count": Broken(
        DIRECTION, DIRECTION, "sets = 4", "sets = 4.5", ("order.sets = 4.5", "whole number"), "sets = 4.5"
    ),
    "date for a text": Broken(
        DIRECTION, DIRECTION, 'title = "Direction recognition of a shot"', "title = 1979-05-27",
        ("title: must be text",), "title",
    ),
    "negative break": Broken(
        DIRECTION, DIRECTION, "between_sessions_s = 300.0", "between_sessions_s = -300.0",
        ("breaks.between_sessions_s = -300.0", "must be at least 0"), "between_sessions_s",
    ),
    "break that is no number": Broken(
        DIRECTION, DIRECTION, "= 20.0", "= nan", ("breaks.between_sets_s = nan", "finite"), "sets_s = nan"
    ),
    "endless break": Broken(
        DIRECTION, DIRECTION, "= 20.0", "= inf", ("breaks.between_sets_s = inf", "finite"), "sets_s = inf"
    ),
    "number beyond all doubles": Broken(
        DIRECTION, DIRECTION, "= 20.0", "= 1e999", ("breaks.between_sets_s = inf", "finite"), "sets_s = 1e999"
    ),
    "mean rating that is no number": Broken(
        PREFERENCE, RATING, "vibration = 2.4", "vibration = nan", ("questions.rating.mean.vibration = nan", "finite"),
        "mean =",
    ),
    "no trials": Broken(
        DIRECTION, DIRECTION, "repetitions = 10", "repetitions = 0",
        ("order.repetitions = 0", "must be at least 1"), "repetitions = 0",
    ),
    "no sets": Broken(
        DIRECTION, DIRECTION, "sets = 4", "sets = 0", ("order.sets = 0", "must be at least 1"), "sets = 0"
    ),
    "no methods": Broken(
        PREFERENCE, PREFERENCE, '["vibration", "asymmetric-1", "asymmetric-2"]', "[]",
        ("factors.method.levels", "holds too few; give at least 1"), "levels = []",
    ),
    "unknown order": Broken(
        DIRECTION, DIRECTION, 'sessions = "random"', 'sessions = "reversed"',
        ("order.sessions = 'reversed'", "'random', 'fixed', 'latin-square' or 'williams'"), 'sessions = "reversed"',
    ),
    "unknown direction": Broken(
        PREFERENCE, PREFERENCE, "[order]", '[factors.direction]\nlevels = ["up"]\n\n[order]',
        ("factors.direction: levels 'up': directions are forward, backward",), "[factors.direction]",
    ),
    "a blank behind a direction": Broken(
        DIRECTION, DIRECTION, '"backward"]', '"backward "]',
        ("factors.direction: levels 'backward '",), "[factors.direction]",
    ),
    "a session too long": Broken(
        DIRECTION, DIRECTION, "repetitions = 10", "repetitions = 9000",
        ("order.repetitions = 9000: a session of 18,000 trials is more than the 10,000",), "repetitions = 9000",
    ),
    "a question called as a column of another": Broken(
        DIRECTION, DIRECTION, "[breaks]", '[questions.response_time_s]\nkind = "text"\ntext = "Why?"\n\n[breaks]',
        ("questions.response_time_s: response_time_s would be two columns",), "[questions.response_time_s]",
    ),
    "a run without a name": Broken(
        DIRECTION, DIRECTION, "repetitions = 10", "repetitions = 10\nlongest_run = 2",
        ("order.longest_run = 2: must be a table, such as { NAME = 2 }",), "longest_run",
    ),
    "even levels with a step": Broken(
        PREFERENCE, PREFERENCE,
        "[order]", "[factors.voltage_V]\nlevels = { minimum = 8, maximum = 9, step = 1 }\n\n[order]",
        ("levels.step = 1: unknown key", "known are minimum, maximum, grain", "levels.grain: is missing"), "levels = {",
    ),
    "not TOML": Broken(DIRECTION, DIRECTION, "[breaks]", "[breaks", ("not TOML",), "[breaks"),
    "key twice": Broken(DIRECTION, DIRECTION, "[timing]", "[timing]\nanswer_s = 1.0", ("not TOML", "overwrite")),
    "number of 5000 digits": Broken(
        DIRECTION, DIRECTION, "= 20.0", "= " + "9" * 5000, ("not TOML: a whole number has thousands of digits",)
    ),
    "unknown table of a question": Broken(
        DIRECTION, DIRECTION, "[questions.response]", "[question.response]",
        ("question: unknown key; did you mean questions?",), "[question.",
    ),
    "a page break in a title": Broken(
        PREFERENCE, GUN, 'label = "Asymmetric Force I"', 'label = "Force\\fI"', ("U+000C, which is not printed",),
        "\\fI",
    ),
    "name of two words": Broken(
        DIRECTION, DIRECTION, 'design = "direction"', 'design = "two words"',
        ("design = 'two words'", "must be 1 to 32 letters a to z"),
        "design =",
    ),
    "no name": Broken(DIRECTION, DIRECTION, 'design = "direction"', "", ("design: is missing",)),
    "list for the name": Broken(
        DIRECTION, DIRECTION, 'design = "direction"', 'design = ["direction"]', ("design: ", "must be text"), "design ="
    ),
    "table for the name": Broken(
        DIRECTION, DIRECTION, 'design = "direction"', 'design = { name = "direction" }', ("design: ", "must be text"),
        "design =",
    ),
    "name of other columns": Broken(
        PREFERENCE, PREFERENCE, 'table = "ratings"', "",
        ("design = 'preference': logs of this name have columns of their own", "choose another name"),
    ),
    "method twice": Broken(
        DIRECTION, DIRECTION, '"asymmetric-2"]', '"asymmetric-1"]',
        ("factors.method.levels", "asymmetric-1 stands there more than once", "name each once"), "levels =",
    ),
    "method without a rate": Broken(
        DIRECTION, ANSWERING, '"asymmetric-2/forward"', '"laser/forward"',
        ("questions.response.share has no value for 'asymmetric-2/forward'", "it has vibration/forward"),
    ),
    "method without a mean rating": Broken(
        PREFERENCE, RATING, "asymmetric-2 = 7.8 }", "laser = 7.8 }",
        ("questions.rating.mean has no value for 'asymmetric-2'", "it has vibration"),
    ),
    "rate of 1": Broken(
        DIRECTION, ANSWERING, "= 0.557", "= 1.0",
        ("questions.response.share.vibration/forward = 1.0", "must be below 1"), '"vibration/forward" =',
    ),
    "habit of a method that is not there": Broken(
        PREFERENCE, RATING, 'lowest = "vibration"', 'lowest = "laser"',
        ("questions.rating names 'laser'", "no level of method"),
    ),
    "bias to an answer that is not there": Broken(
        DIRECTION, ANSWERING, 'bias = { answer = "forward"', 'bias = { answer = "upward"',
        ("questions.response.bias.answer = 'upward'", "one of two answers; there are forward, backward"),
    ),
    "trials that do not add up": Broken(
        DIRECTION, DIRECTION, "repetitions = 10", "repetitions = 11",
        ("order.sets = 4: the 22 trials of a session cannot be shared equally", "nearest: 2 or 11"),
    ),
    "impossible set-exact": Broken(
        DIRECTION, DIRECTION, 'balance = "session"', 'balance = "set-exact"',
        ('order.balance = "set-exact" is impossible', "10 repetitions", "4 sets", "8 or 12", 'balance = "set"'),
    ),
    "too many trials without a break": Broken(
        DIRECTION, DIRECTION, "between_sets_s = 20.0", "between_sets_s = 0.0",
        ("20 trials without a break", "fatigue.max_trials_without_break = 10"),
    ),
    "sets that are too long": Broken(
        DIRECTION, DIRECTION, "max_trials_without_break = 10", "max_trials_without_break = 4",
        ("5 trials without a break", "fatigue.max_trials_without_break = 4"),
    ),
    "too long": Broken(
        DIRECTION, DIRECTION, "hand_over_s = 15.8 ", "hand_over_s = 168.8 ",
        ("10980 s", "fatigue.max_planned_s = 2700 s"),
    ),
    "too long to rate": Broken(
        PREFERENCE, PREFERENCE, "stimulus_s = 40.0", "stimulus_s = 400.0", ("1560 s", "fatigue.max_planned_s = 1200 s")
    ),
    "assumed key that is not there": Broken(
        DIRECTION, DIRECTION, '"questions.response.text"', '"questions.response.texts"',
        ("assumed names questions.response.texts", "existing keys"),
    ),
    "grain that does not divide": Broken(
        PREFERENCE, PREFERENCE, "grain = 0.1 ", "grain = 0.3 ",
        ("questions.rating.grain 0.3 does not divide the scale",), "grain = ",
    ),
    "a choice that may be skipped": Broken(
        DIRECTION, DIRECTION, 'correct = "direction"', 'correct = "direction"\nmay_be_skipped = true',
        ("may_be_skipped: a question of kind 'choice' always has an answer; remove the key",),
    ),
    "grain beyond all doubles": Broken(
        PREFERENCE, PREFERENCE, "grain = 0.1 ", "grain = 1e-320 ", ("questions.rating.grain = 1e-320",), "grain = "
    ),
    "scale upside down": Broken(
        PREFERENCE, PREFERENCE, "minimum = 0.0", "minimum = 11.0",
        ("questions.rating.minimum 11 and maximum 10: need -1e6 <= minimum < maximum <= 1e6",), "minimum = ",
    ),
    "repeat faster than the magnet is home": Broken(
        PREFERENCE, PREFERENCE, "repeat_every_s = 1.0", "repeat_every_s = 0.2",
        ("trial.repeat_every_s = 0.2: method = asymmetric-2 needs 0.211 s",),
    ),
    "table of answers without a file": Broken(
        PREFERENCE, RATING, 'law = "words"', 'law = "table"', ("questions.comment.file: is missing",),
        "[questions.comment]",
    ),
    "unknown law": Broken(
        DIRECTION, ANSWERING, 'law = "rates"', 'law = "rating"',
        ("questions.response", "'rating'", "is none of rates, shares"),
        "law = ",
    ),
    "law of another kind of question": Broken(
        PREFERENCE, RATING, 'law = "words"', 'law = "worth"\nfactor = "method"\nworth = { vibration = 1.0 }',
        ("questions.comment.law = 'worth': a question of kind 'text' has words",),
    ),
}  # fmt: skip

BROKEN_GUNS = {
    "unknown key of the coil": Broken(
        DIRECTION, GUN, "magnet_mass_kg", "magnet_mass", ("voice_coil.magnet_mass is an unknown key", "magnet_mass_kg")
    ),
    "unknown key of a method": Broken(
        DIRECTION, GUN, "voice_coil.friction_N = 1.12", "voice_coil.friction = 1.12",
        ("methods.asymmetric-2.voice_coil.friction is an unknown key", "friction_N"),
    ),
    "unknown key beside the label": Broken(
        DIRECTION, GUN, 'damper = "on"', 'dampr = "on"', ("methods.asymmetric-2.dampr = 'on': unknown key",), "dampr"
    ),
    "negative mass": Broken(
        DIRECTION, GUN, "magnet_mass_kg = 0.114", "magnet_mass_kg = -0.114",
        ("voice_coil.magnet_mass_kg is -0.114", "above 0"),
    ),
    "mass that is no number": Broken(
        DIRECTION, GUN, "magnet_mass_kg = 0.114", "magnet_mass_kg = nan", ("voice_coil.magnet_mass_kg is nan", "finite")
    ),
    "text for a mass": Broken(
        DIRECTION, GUN, "magnet_mass_kg = 0.114", 'magnet_mass_kg = "heavy"', ("magnet_mass_kg", "heavy", "number")
    ),
    "number for an option": Broken(
        DIRECTION, GUN, 'drive_off = "shorted"', "drive_off = 1", ("voice_coil.drive_off is 1", "must be text")
    ),
    "unknown option": Broken(
        DIRECTION, GUN, 'emf = "printed"', 'emf = "none"', ("emf is 'none'", "printed, reciprocal")
    ),
    "effect that the driver does not have": Broken(
        DIRECTION, GUN, "effect = 1 ", "effect = 124 ", ("vibration.effect is 124", "1 to 123")
    ),
    "effect between two": Broken(
        DIRECTION, GUN, "effect = 1 ", "effect = 1.5 ", ("vibration.effect is 1.5", "must be a whole number")
    ),
    "unknown actuator": Broken(
        DIRECTION, GUN, 'actuator = "vibration"', 'actuator = "voice"',
        ("methods.vibration.actuator = 'voice'", "'voice-coil' or 'vibration'"), 'actuator = "voice"',
    ),
    "method that the gun has not": Broken(
        PREFERENCE, GUN, "[methods.asymmetric-2]", "[methods.asymmetric-3]",
        ("factors.method: the gun has no method 'asymmetric-2'", "vibration, asymmetric-1, asymmetric-3"),
        named=PREFERENCE,  # both files are at odds there
    ),
    "30 V": Broken(
        DIRECTION, GUN, "voltage_V = 16.0", "voltage_V = 30.0",
        ("methods.asymmetric-1: voltage_V is 30", "between 0 and 24"),
    ),
    "a pulse of 21 ms": Broken(
        PREFERENCE, GUN, "pulse_s = 0.010", "pulse_s = 0.021",
        ("methods.asymmetric-1: pulse_s is 0.021", "between 0 and 0.02"),
    ),
    "a magnet that never comes home": Broken(
        DIRECTION, GUN, "voice_coil.friction_N = 1.12", "voice_coil.friction_N = 1.7",
        ("methods.asymmetric-2: ", "friction_N 1.7", "does not come home (stuck)"),
    ),
    "a friction that no shot overcomes": Broken(
        DIRECTION, GUN, "voice_coil.friction_N = 1.12", "voice_coil.friction_N = 200.0",
        ("methods.asymmetric-2: no shot ever moves the magnet, by the model", "hold it with 201.4 N (friction_N 200)",
         "pulls with 41.93 N at the most (voltage_V 16 for pulse_s 0.01)", "lower the friction, or raise the voltage"),
    ),
    "a voltage that moves nothing": Broken(
        PREFERENCE, GUN, "voltage_V = 16.0", "voltage_V = 0.1",
        ("methods.asymmetric-1: no shot ever moves the magnet", "hold it with 1.61 N", "pulls with 0.2621 N at the"),
    ),
    "a pulse too short to move anything": Broken(
        DIRECTION, GUN, "pulse_s = 0.010", "pulse_s = 0.000005",
        ("methods.asymmetric-1: no shot ever moves the magnet", "pulls with 0.836 N at the most", "pulse_s 5e-06"),
    ),
    "not TOML": Broken(DIRECTION, GUN, "[methods.vibration]", "[methods.vibration",
        ("not TOML",), "[methods.vibration"),
}  # fmt: skip


def broken_cases() -> list:
    cases = [*BROKEN.items(), *((f"gun: {name}", broken) for name, broken in BROKEN_GUNS.items())]
    return [pytest.param(broken, id=name) for name, broken in cases]


@pytest.mark.slow
@pytest.mark.parametrize("broken", broken_cases())
def test_one_refusal_names_file_place_key_value_and_rule(folder: Path, broken: Broken) -> None:
    check_refused(folder, broken)


def test_a_gun_file_by_itself_is_refused_for_a_method_that_never_moves(folder: Path) -> None:
    edit(folder / GUN, "voice_coil.friction_N = 1.12", "voice_coil.friction_N = 200.0")
    with pytest.raises(ConfigError, match=r"methods\.asymmetric-2: no shot ever moves the magnet, by the model"):
        check(str(folder / GUN), None, 1)


@pytest.mark.slow
@pytest.mark.parametrize("words", [("check",), ("run", "--participant", "P01", "--screen", "synthetic")])
def test_check_and_run_refuse_a_method_that_never_moves_with_the_same_words(folder: Path, recoil, words) -> None:
    edit(folder / GUN, "voice_coil.friction_N = 1.12", "voice_coil.friction_N = 200.0")
    command, *options = words
    done = recoil(command, folder / DIRECTION, *options)
    assert done.returncode == 2
    assert f"{folder / GUN}:43: methods.asymmetric-2: no shot ever moves the magnet" in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert not (folder / "results").exists()


@pytest.mark.parametrize(
    ("levels", "said"),
    [
        ("[]", "factors.method.levels: "),
        ('["vibration", "vibration"]', "factors.method.levels: vibration stands there more than once; name each once"),
    ],
)
def test_levels_that_will_not_do_are_one_finding_of_the_key_in_the_file(folder: Path, levels: str, said: str) -> None:
    edit(folder / PREFERENCE, '["vibration", "asymmetric-1", "asymmetric-2"]', levels)
    message = refusal(folder / PREFERENCE)
    assert message.startswith(f"{folder / PREFERENCE}:{line(folder / PREFERENCE, 'levels =')}: {said}")
    assert len(message.splitlines()) == 1


def test_several_findings_are_told_at_once_a_line_each(folder: Path) -> None:
    edit(folder / DIRECTION, "between_sets_s = 20.0", "between_sets_s = -1.0")
    edit(folder / DIRECTION, "hand_over_s = 15.8", 'hand_over_s = "15"')
    findings = refusal(folder / DIRECTION).splitlines()
    assert len(findings) == 2
    assert f"{DIRECTION}:{line(folder / DIRECTION, 'between_sets_s')}: breaks.between_sets_s = -1.0: " in findings[0]
    assert f"{DIRECTION}:{line(folder / DIRECTION, 'hand_over_s =')}: timing.hand_over_s = '15': " in findings[1]


def test_a_wrong_type_in_the_gun_is_one_finding(folder: Path) -> None:
    edit(folder / GUN, "magnet_mass_kg = 0.114", "magnet_mass_kg = true")
    assert len(refusal(folder / DIRECTION).splitlines()) == 1


def test_shots_that_would_exceed_300_a_minute_are_refused_before_any_device_is_opened(folder: Path) -> None:
    edit(folder / PREFERENCE, '["vibration", "asymmetric-1", "asymmetric-2"]', '["vibration"]')
    edit(folder / RATING, 'same = ["asymmetric-1", "asymmetric-2"]', "")
    edit(folder / PREFERENCE, "max_shots = 120", "max_shots = 1000")
    edit(folder / PREFERENCE, "repeat_every_s = 1.0", "repeat_every_s = 0.1")
    assert "300 shots" in refusal(folder / PREFERENCE)


# files


@pytest.mark.parametrize("name", [DIRECTION, GUN, ANSWERING])
def test_a_file_that_is_not_utf_8_is_refused_with_the_byte(folder: Path, name: str) -> None:
    with (folder / name).open("ab") as file:
        size = file.tell()
        file.write(b"# M\xfcnchen\n")
    message = refusal(folder / DIRECTION)
    assert message == f"{folder / name}: byte {size + 3}: not UTF-8; save the file as UTF-8"


@pytest.mark.parametrize("name", ["gnu.toml", ".", "sub/gun.toml"])
def test_a_gun_file_that_is_not_there_is_refused_with_the_key_that_names_it(folder: Path, name: str) -> None:
    edit(folder / DIRECTION, 'gun = "gun.toml"', f'gun = "{name}"')
    message = refusal(folder / DIRECTION)
    what = "a folder, not a file" if name == "." else "no such file"
    assert f"{what}; the config's key `gun` names it" in message
    assert str(folder) in message


@pytest.mark.parametrize("name", ["nobody.toml", ".", "sub/nobody.toml"])
def test_synthetic_people_who_are_not_there_are_refused_with_the_key_that_names_them(folder: Path, name: str) -> None:
    edit(folder / DIRECTION, f'synthetic = "{ANSWERING}"', f'synthetic = "{name}"')
    message = refusal(folder / DIRECTION)
    assert "the config's key `synthetic` names it" in message
    assert str(folder) in message


def test_a_gun_file_may_lie_in_another_folder(folder: Path) -> None:
    (folder / "guns").mkdir()
    (folder / GUN).rename(folder / "guns" / GUN)
    edit(folder / DIRECTION, 'gun = "gun.toml"', 'gun = "guns/gun.toml"')
    assert load_setup(str(folder / DIRECTION)).gun == load_setup("direction").gun


def test_a_folder_is_no_config(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="a folder, not a config"):
        load_setup(str(tmp_path))
    with pytest.raises(ConfigError, match="cannot be read"):
        read_toml(tmp_path)


@pytest.mark.parametrize("name", ["gun", "study", "paper"])
def test_a_shipped_file_that_is_no_experiment_is_refused_as_a_run(name: str) -> None:
    with pytest.raises(ConfigError, match=rf"^.*{name}\.toml: no design: it has neither the key design nor [^\n]*$"):
        load_setup(name)


def test_arrays_within_arrays_beyond_all_reason_are_refused(folder: Path) -> None:
    edit(folder / DIRECTION, 'levels = ["vibration"', "levels = [" + "[" * 3000 + "]" * 3000 + ', "vibration"')
    assert str(folder / DIRECTION) in refusal(folder / DIRECTION)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("participants = 14", "participants = 0", "study.toml:4: participants = 0"),
        ("participants = 14", "participants = 1000", "study.toml:4: participants = 1000"),
        ('code_prefix = "P"', 'code_prefix = "../"', "study.toml:5: code_prefix = '../'"),
        ('experiments = ["direction.toml", "preference.toml"]', "experiments = []", "study.toml:6: experiments"),
        ("replications = 2000", "repetitions = 2000", "study.toml:8: repetitions = 2000: unknown key"),
    ],
)
def test_a_broken_study_is_refused_with_its_line(folder: Path, old: str, new: str, said: str) -> None:
    edit(folder / "study.toml", old, new)
    with pytest.raises(ConfigError) as refused:
        load_study(str(folder / "study.toml"))
    assert said in str(refused.value)


# tables of answers


@pytest.fixture
def answers(folder: Path) -> Path:
    (folder / ANSWERING).write_text(TABLE)
    return folder / "answers.csv"


def test_a_table_of_answers_is_read_with_a_byte_order_mark_and_either_line_end(answers: Path) -> None:
    rows = []
    for ends in ("\n", "\r\n"):
        text = f"{HEADER}P01,vibration,forward,6\nP02,vibration,backward,10\n".replace("\n", ends)
        answers.write_bytes(text.encode("utf-8-sig"))
        laws = load_setup(str(answers.parent / DIRECTION)).laws
        assert isinstance(laws, SyntheticAnswers)
        law = laws.questions["response"]
        assert isinstance(law, TableLaw)
        rows.append(law.rows)
    assert rows[0] == rows[1]
    assert [row["correct"] for row in rows[0]] == ["6", "10"]


def test_a_table_that_is_not_there_is_refused_with_the_key_that_names_it(answers: Path) -> None:
    message = refusal(answers.parent / DIRECTION)
    assert message.startswith(f"{answers}: cannot be read")
    assert "the law's key `file` names it" in message


def test_a_table_that_is_not_there_is_refused(answers: Path) -> None:
    edit(answers.parent / ANSWERING, "answers.csv", "nowhere/answers.csv")
    said = "cannot be read (No such file or directory); the law's key `file` names it"
    assert said in refusal(answers.parent / DIRECTION)


@pytest.mark.parametrize(
    "header",
    [
        "participant_id,method,direction",
        "participant_id,method,direction,correct,note",
        "participant_id,direction,method,correct",
        "participant,method,direction,correct",
        "participant_id;method;direction;correct",
        "",
    ],
)
def test_a_table_with_another_header_is_refused_with_the_columns_it_must_have(answers: Path, header: str) -> None:
    answers.write_text(f"{header}\nP01,vibration,forward,6\n")
    message = refusal(answers.parent / DIRECTION)
    assert f"{answers}: line 1: columns are" in message
    assert "they must be participant_id, method, direction, correct" in message


@pytest.mark.parametrize("row", ["P01,vibration,forward", "P01", "P01,vibration,forward,6,5"])
def test_a_row_with_too_few_or_too_many_fields_is_refused_with_its_line(answers: Path, row: str) -> None:
    answers.write_text(f"{HEADER}P01,asymmetric-1,forward,6\n{row}\n")
    assert refusal(answers.parent / DIRECTION) == f"{answers}: line 3: {1 + row.count(',')} fields; there must be 4"


def test_the_line_of_a_short_row_is_right_behind_an_empty_line(answers: Path) -> None:
    answers.write_text(f"{HEADER}\nP01,asymmetric-1,forward,6\n\nP01,vibration,forward\n")
    assert "line 5: 3 fields; there must be 4" in refusal(answers.parent / DIRECTION)


@pytest.mark.parametrize("data", [b"participant_id,method\xff\n", b'"participant_id\n', HEADER.encode("utf-16")])
def test_a_table_that_is_no_csv_in_utf_8_is_refused(answers: Path, data: bytes) -> None:
    answers.write_bytes(data)
    assert f"{answers}: cannot be read" in refusal(answers.parent / DIRECTION)


# lines


def test_the_line_of_a_key_is_found_in_every_way_that_toml_has_to_write_it() -> None:
    text = "\n".join(
        [
            "title = 'a'",
            "",
            "[a.b]",
            "c = 1",
            "  d.e = 2",
            '"f" = 3',
            "g = { h = 1 }",
            "[ a . k ]",
            "# c = 5",
            "l=[",
            "1]",
        ]
    )
    found = {
        "title": 1, "a.b": 3, "a.b.c": 4, "a.b.d.e": 5, "a.b.f": 6, "a.b.g.h": 7, "a.k": 8, "a.k.l": 10, "a.k.l.0": 10,
    }  # fmt: skip
    assert {keys: line_of(text, keys.split(".")) for keys in found} == found
    assert line_of(text, ["nothing"]) is None


def test_a_rare_line_separator_in_a_comment_is_no_line_end() -> None:
    # TOML knows LF and CR LF only; editors count lines the same way
    assert line_of("# one\u2028still one\x85still one\na = 1", ["a"]) == 2


def test_a_file_that_is_not_there_is_none_of_the_shipped() -> None:
    assert load_setup("direction").config.design == "direction"
    with pytest.raises(ConfigError, match=r"direction\.toml: no such file"):
        load_setup(Path("direction.toml"))
