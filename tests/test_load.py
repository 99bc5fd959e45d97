"""Broken configs: the shipped ones, each with one edit. Every refusal names file, line, key, value and rule."""

import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

from analysis.predict.check import check
from device.words import Pulse
from experiments.config.door import ConfigError, line_of, read_toml
from experiments.load import check_limits, find, load_gun, load_setup, load_study, shipped_folder

DESIGNS = ("voltages", "detection", "stronger", "magnitude", "realism", "pairs", "grip", "hurry")
EXPERIMENTS = ("direction", "preference")
DIRECTION, PREFERENCE, GUN = "direction.toml", "preference.toml", "gun.toml"
TABLE = 'observer = "table"\ntable = "answers.csv"'
DIRECTION_HEADER = "participant_id,method,forward_correct,backward_correct\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for source in shipped_folder().glob("*.toml"):
        shutil.copy(source, tmp_path)
    return tmp_path


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path.name} no longer holds {old!r}"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def line(path: Path, words: str) -> int:
    return next(n for n, row in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1) if words in row)


def refusal(path: Path) -> str:
    with pytest.raises(ConfigError) as refused:
        check_limits(load_setup(str(path)))
    return str(refused.value)


# what is shipped


@pytest.mark.parametrize("name", EXPERIMENTS)
@pytest.mark.parametrize("ending", ["", ".toml"])
def test_a_shipped_config_loads_by_its_name_and_is_within_the_limits(name: str, ending: str) -> None:
    setup = load_setup(f"{name}{ending}")
    assert setup.config.experiment == name
    assert setup.source.parent == shipped_folder()
    assert [limits.method for limits in check_limits(setup)] == ["vibration", "asymmetric-1", "asymmetric-2"]


def test_every_shipped_config_loads() -> None:
    known = {*EXPERIMENTS, *DESIGNS, "gun", "gun-five", "study", "paper"}
    assert {path.stem for path in shipped_folder().glob("*.toml")} == known
    assert list(load_gun(shipped_folder() / GUN).methods) == ["vibration", "asymmetric-1", "asymmetric-2"]
    study, folder = load_study("study")
    assert [load_setup(str(folder / name)).config.experiment for name in study.experiments] == list(EXPERIMENTS)


def test_the_shipped_gun_keeps_the_drive_within_a_tenth_of_the_time() -> None:
    driven = check_limits(load_setup("direction"))
    duties = [one.drive.pulse_s / one.settle_s for one in driven if isinstance(one.drive, Pulse)]
    assert [one.method for one in driven if not isinstance(one.drive, Pulse)] == ["vibration"]
    assert 0 < max(duties) <= 0.10


def test_a_path_goes_before_a_shipped_name(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert find(DIRECTION) == Path(DIRECTION)
    assert find("direction") == shipped_folder() / DIRECTION


@pytest.mark.parametrize("name", ["nothing", "", ".", "../configs/direction", "direction.toml.toml", "a\0b"])
def test_a_name_that_means_no_file_is_refused_with_what_is_shipped(name: str) -> None:
    with pytest.raises(ConfigError, match=r"(no such file|a folder).*direction.*gun.*paper, preference.*study"):
        load_setup(name)


# one edit each


class Broken(NamedTuple):
    """An edit of a file that makes `config` unusable, and what the refusal must say.

    `named` is the file that must be named, `at` words on the line that must be named, if there is one.
    """

    config: str
    file: str
    old: str
    new: str
    said: tuple[str, ...]
    at: str | None = None


BROKEN = {
    "unknown key": Broken(
        DIRECTION, DIRECTION, "between_sets_s", "between_set_s", ("breaks.between_set_s = 20.0: unknown key",),
        "between_set_s",
    ),
    "missing key": Broken(
        DIRECTION, DIRECTION, "trial_s = 17.0 ", "# ", ("timing.trial_s: is missing",), "[timing]"
    ),
    "unknown table": Broken(DIRECTION, DIRECTION, "[breaks]", "[brakes]", ("brakes: unknown key",), "[brakes]"),
    "missing table": Broken(
        PREFERENCE, PREFERENCE, "[description]\ntext", "[rating.description]\ntext", ("description: is missing",)
    ),
    "text for a number": Broken(
        DIRECTION, DIRECTION, "= 20.0", '= "20"', ("breaks.between_sets_s = '20'", "valid number"), 'sets_s = "20"'
    ),
    "number for a text": Broken(PREFERENCE, PREFERENCE, '"like very much"', "10", ("maximum_text = 10", "valid string"),
        "maximum_text"),
    "true for a number": Broken(
        DIRECTION, DIRECTION, "= 20.0", "= true", ("breaks.between_sets_s = True", "valid number"), "sets_s = true"
    ),
    "fraction for a count": Broken(
        DIRECTION, DIRECTION, "sets_per_session = 4", "sets_per_session = 4.5",
        ("design.sets_per_session = 4.5", "integer"), "sets_per_session",
    ),
    "date for a text": Broken(
        DIRECTION, DIRECTION, 'title = "Direction recognition of a shot"', "title = 1979-05-27", ("title", "string"),
        "title",
    ),
    "negative break": Broken(
        DIRECTION, DIRECTION, "between_sessions_s = 300.0", "between_sessions_s = -300.0",
        ("breaks.between_sessions_s = -300.0", "greater than or equal to 0"), "between_sessions_s",
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
        PREFERENCE, PREFERENCE, "vibration = 2.4", "vibration = nan", ("synthetic.ratings.mean.vibration = nan",
        "finite"), "mean =",
    ),
    "no trials": Broken(
        DIRECTION, DIRECTION, "sets_per_session = 4", "sets_per_session = 0",
        ("design.sets_per_session = 0", "greater than or equal to 1"), "sets_per_session",
    ),
    "no methods": Broken(
        PREFERENCE, PREFERENCE, '["vibration", "asymmetric-1", "asymmetric-2"]', "[]",
        ("design.methods", "at least 1 item"), "methods = []",
    ),
    "unknown order": Broken(
        DIRECTION, DIRECTION, 'session_order = "random"', 'session_order = "reversed"',
        ("design.session_order = 'reversed'", "'random', 'williams' or 'latin-square'"), "session_order",
    ),
    "unknown direction": Broken(
        PREFERENCE, PREFERENCE, 'direction = "forward"', 'direction = "up"',
        ("design.direction = 'up'", "'forward' or 'backward'"), "direction =",
    ),
    "not TOML": Broken(DIRECTION, DIRECTION, "[breaks]", "[breaks", ("not TOML", "(at line ")),
    "key twice": Broken(DIRECTION, DIRECTION, "[timing]", "[timing]\ntrial_s = 1.0", ("not TOML", "overwrite")),
    "number of 5000 digits": Broken(DIRECTION, DIRECTION, "= 20.0", "= " + "9" * 5000, ()),
    "unknown experiment": Broken(
        DIRECTION, DIRECTION, 'experiment = "direction"', 'experiment = "directions"',
        ("experiment = 'directions'", "one of direction, preference"),
    ),
    "no experiment": Broken(
        DIRECTION, DIRECTION, 'experiment = "direction"', "", ("experiment = None", "one of direction, preference")
    ),
    "list for the experiment": Broken(
        DIRECTION, DIRECTION, 'experiment = "direction"', 'experiment = ["direction"]',
        ("experiment", "one of direction, preference"),
    ),
    "table for the experiment": Broken(
        DIRECTION, DIRECTION, 'experiment = "direction"', 'experiment = { name = "direction" }',
        ("experiment", "one of direction, preference"),
    ),
    "method twice": Broken(
        DIRECTION, DIRECTION, '"asymmetric-2"]', '"asymmetric-1"]',
        ("design.methods", "asymmetric-1 stands there more than once", "each method once"), "methods =",
    ),
    "method without a rate": Broken(
        DIRECTION, DIRECTION, "asymmetric-2 = 0.929 }", "laser = 0.929 }",
        ("synthetic.rates.forward has no value for asymmetric-2", "each of design.methods"),
    ),
    "method without a mean rating": Broken(
        PREFERENCE, PREFERENCE, "asymmetric-2 = 7.8 }", "laser = 7.8 }",
        ("synthetic.ratings.mean has no value for asymmetric-2", "each of design.methods"),
    ),
    "rate of 1": Broken(
        DIRECTION, DIRECTION, "vibration = 0.557", "vibration = 1.0",
        ("synthetic.rates.forward.vibration = 1.0", "less than 1"), "forward = {",
    ),
    "habit of a method that is not there": Broken(
        PREFERENCE, PREFERENCE, 'lowest = "vibration"', 'lowest = "laser"',
        ("synthetic.ratings names 'laser'", "not among design.methods"),
    ),
    "trials that do not add up": Broken(
        DIRECTION, DIRECTION, "forward_per_session = 10", "forward_per_session = 11",
        ("design: 11 forward and 10 backward make 21 trials, but 4 sets of 5 make 20", "make them equal"), "[design]",
    ),
    "impossible set-exact": Broken(
        DIRECTION, DIRECTION, 'balance = "session"', 'balance = "set-exact"',
        ('design: balance = "set-exact" is impossible', "10 forward trials", "4 sets of 5", 'use "set"'), "[design]",
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
        DIRECTION, DIRECTION, "trial_s = 17.0", "trial_s = 170.0", ("10980 s", "fatigue.max_planned_s = 2700 s")
    ),
    "too long to rate": Broken(
        PREFERENCE, PREFERENCE, "exposure_s = 40.0", "exposure_s = 400.0", ("1560 s", "fatigue.max_planned_s = 1200 s")
    ),
    "assumed key that is not there": Broken(
        DIRECTION, DIRECTION, '"question.text",', '"question.texts",', ("assumed names question.texts", "existing keys")
    ),
    "grain that does not divide": Broken(
        PREFERENCE, PREFERENCE, "grain = 0.1 ", "grain = 0.3 ", ("rating: grain 0.3 does not divide the scale",),
        "[rating]",
    ),
    "grain beyond all doubles": Broken(
        PREFERENCE, PREFERENCE, "grain = 0.1 ", "grain = 1e-320 ", ("rating.grain = 1e-320",), "grain = "
    ),
    "scale upside down": Broken(
        PREFERENCE, PREFERENCE, "minimum = 0.0", "minimum = 11.0",
        ("rating: minimum 11 and maximum 10: need 0 <= minimum < maximum <= 10",), "[rating]",
    ),
    "repeat faster than the magnet is home": Broken(
        PREFERENCE, PREFERENCE, "repeat_every_s = 1.0", "repeat_every_s = 0.2",
        ("stimulus.repeat_every_s = 0.2: asymmetric-2 needs 0.211 s",),
    ),
    "table observer without table": Broken(
        DIRECTION, DIRECTION, 'observer = "rates"', 'observer = "table"',
        ('synthetic: observer = "table" needs the key `table`',), "[synthetic]",
    ),
    "unknown observer": Broken(
        DIRECTION, DIRECTION, 'observer = "rates"', 'observer = "ratings"',
        ("synthetic.observer = 'ratings'", "'rates', 'table' or 'felt'"), 'observer = "ratings"',
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
        ("design.methods: the gun has no method asymmetric-2", "vibration, asymmetric-1, asymmetric-3"),
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
        ("not TOML", f"line {line(shipped_folder() / GUN, '[methods.vibration]')}")),
}  # fmt: skip


def broken_cases() -> list:
    cases = [*BROKEN.items(), *((f"gun: {name}", broken) for name, broken in BROKEN_GUNS.items())]
    return [pytest.param(broken, id=name) for name, broken in cases]


@pytest.mark.parametrize("broken", broken_cases())
def test_one_refusal_names_file_place_key_value_and_rule(folder: Path, broken: Broken) -> None:
    edit(folder / broken.file, broken.old, broken.new)
    message = refusal(folder / broken.config)
    for words in broken.said:
        assert words in message
    named = broken.file if "the gun has no method" not in message else broken.config  # both files are at odds there
    place = f":{line(folder / broken.file, broken.at)}: " if broken.at else ": "
    assert f"{folder / named}{place}" in message


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
    assert f"{folder / GUN}: methods.asymmetric-2: no shot ever moves the magnet" in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert not (folder / "results").exists()


def test_several_findings_are_told_at_once_a_line_each(folder: Path) -> None:
    edit(folder / DIRECTION, "between_sets_s = 20.0", "between_sets_s = -1.0")
    edit(folder / DIRECTION, "trial_s = 17.0", 'trial_s = "17"')
    findings = refusal(folder / DIRECTION).splitlines()
    assert len(findings) == 2
    assert f"{DIRECTION}:{line(folder / DIRECTION, 'between_sets_s')}: breaks.between_sets_s = -1.0: " in findings[0]
    assert f"{DIRECTION}:{line(folder / DIRECTION, 'trial_s =')}: timing.trial_s = '17': " in findings[1]


def test_a_wrong_type_in_the_gun_is_one_finding(folder: Path) -> None:
    edit(folder / GUN, "magnet_mass_kg = 0.114", "magnet_mass_kg = true")
    assert len(refusal(folder / DIRECTION).splitlines()) == 1


def test_shots_that_would_exceed_300_a_minute_are_refused_before_any_device_is_opened(folder: Path) -> None:
    edit(folder / PREFERENCE, '["vibration", "asymmetric-1", "asymmetric-2"]', '["vibration"]')
    edit(folder / PREFERENCE, 'same = ["asymmetric-1", "asymmetric-2"]', "")
    edit(folder / PREFERENCE, "max_shots_per_trial = 120", "max_shots_per_trial = 1000")
    edit(folder / PREFERENCE, "repeat_every_s = 1.0", "repeat_every_s = 0.1")
    assert "300 shots" in refusal(folder / PREFERENCE)


# files


@pytest.mark.parametrize("name", [DIRECTION, GUN])
def test_a_file_that_is_not_utf_8_is_refused_with_the_byte(folder: Path, name: str) -> None:
    with (folder / name).open("ab") as file:
        size = file.tell()
        file.write(b"# M\xfcnchen\n")
    message = refusal(folder / DIRECTION)
    assert message == f"{folder / name}: byte {size + 3}: not UTF-8; save the file as UTF-8"


@pytest.mark.parametrize("name", ["gnu.toml", ".", "sub/gun.toml", "a\\u0000b"])
def test_a_gun_file_that_is_not_there_is_refused_with_the_key_that_names_it(folder: Path, name: str) -> None:
    edit(folder / DIRECTION, 'gun = "gun.toml"', f'gun = "{name}"')
    message = refusal(folder / DIRECTION)
    what = "a folder, not a file" if name == "." else "no such file"
    assert f"{what}; the config's key `gun` names it" in message
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
    with pytest.raises(ConfigError, match=r"is it the config of a run\?"):
        load_setup(name)


def test_arrays_within_arrays_beyond_all_reason_are_refused(folder: Path) -> None:
    edit(folder / DIRECTION, 'methods = ["vibration"', "methods = [" + "[" * 3000 + "]" * 3000 + ', "vibration"')
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
    edit(folder / DIRECTION, 'observer = "rates"', TABLE)
    return folder / "answers.csv"


def test_a_table_of_answers_is_read_with_a_byte_order_mark_and_either_line_end(answers: Path) -> None:
    rows = []
    for ends in ("\n", "\r\n"):
        text = f"{DIRECTION_HEADER}P01,vibration,6,5\nP02,vibration,10,0\n".replace("\n", ends)
        answers.write_bytes(text.encode("utf-8-sig"))
        rows.append(load_setup(str(answers.parent / DIRECTION)).answers)
    assert rows[0] == rows[1]
    assert [row["forward_correct"] for row in rows[0]] == ["6", "10"]


def test_a_table_that_is_not_there_is_refused_with_the_key_that_names_it(answers: Path) -> None:
    message = refusal(answers.parent / DIRECTION)
    assert message.startswith(f"{answers}: cannot be read")
    assert "synthetic.table" in message


def test_a_table_whose_name_no_file_can_have_is_refused(folder: Path) -> None:
    edit(folder / DIRECTION, 'observer = "rates"', 'observer = "table"\ntable = "a\\u0000.csv"')
    assert "synthetic.table" in refusal(folder / DIRECTION)


@pytest.mark.parametrize(
    "header",
    [
        "participant_id,method,forward_correct",
        "participant_id,method,forward_correct,backward_correct,note",
        "participant_id,method,backward_correct,forward_correct",
        "participant,method,forward_correct,backward_correct",
        "participant_id;method;forward_correct;backward_correct",
        "",
    ],
)
def test_a_table_with_another_header_is_refused_with_the_columns_it_must_have(answers: Path, header: str) -> None:
    answers.write_text(f"{header}\nP01,vibration,6,5\n")
    message = refusal(answers.parent / DIRECTION)
    assert f"{answers}: line 1: columns are" in message
    assert "they must be participant_id, method, forward_correct, backward_correct" in message


@pytest.mark.parametrize("row", ["P01,vibration,6", "P01", "P01,vibration,6,5,4"])
def test_a_row_with_too_few_or_too_many_fields_is_refused_with_its_line(answers: Path, row: str) -> None:
    answers.write_text(f"{DIRECTION_HEADER}P01,asymmetric-1,6,5\n{row}\n")
    assert refusal(answers.parent / DIRECTION) == f"{answers}: line 3: {1 + row.count(',')} fields; there must be 4"


def test_the_line_of_a_short_row_is_right_behind_an_empty_line(answers: Path) -> None:
    answers.write_text(f"{DIRECTION_HEADER}\nP01,asymmetric-1,6,5\n\nP01,vibration,6\n")
    assert "line 5: 3 fields; there must be 4" in refusal(answers.parent / DIRECTION)


@pytest.mark.parametrize(
    "data", [b"participant_id,method\xff\n", b'"participant_id\n', DIRECTION_HEADER.encode("utf-16")]
)
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
