"""A design at the real console, by real keys: every kind of question and trial that the paper's two do not have."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.load import load_setup, shipped_folder
from experiments.screens.console.participant_opening import check_own_keys
from experiments.study.folders import PlaceError
from tests.at_display import AtConsole, needs_display, virtual_display
from tests.at_runs import words
from tests.designs import changed, design

pytest.importorskip("PyQt6")
pytestmark = [pytest.mark.slow, needs_display]

DESIGN = """
design = "tiny"
title = "Which of two, how real, and why"
gun = "gun.toml"

[factors.method]
levels = ["asymmetric-1"]

[factors.voltage_V]
levels = [12.0, 18.0]

[factors.posture]
levels = ["sitting"]

[trial]
kind = "two-interval"
compare = "voltage_V"
standard = 15.0
gap_s = 0.5
feedback = true

[questions.stronger]
kind = "choice"
text = "Welcher Schuss war stärker?"
answers = ["first", "second"]
correct = "larger"
keys = { first = "left", second = "right" }
labels = { first = "der erste", second = "rechts, der zweite" }

[questions.sure]
kind = "rating"
text = "How sure are you?"
minimum = 1.0
maximum = 5.0
grain = 1.0

[questions.why]
kind = "text"
when = "block"
text = "What told them apart?"

[[opening]]
kind = "consent"
text = "Do you agree to take part?"

[console]
guard_s = 0.0

[fatigue]
max_trials_without_break = 10
max_planned_s = 600.0

[timing]
hand_over_s = 1.0
planned_s = 60.0
"""
RUN = "Recoil – P01"


@pytest.fixture
def configs(tmp_path: Path) -> Path:
    folder = tmp_path / "configs"
    folder.mkdir()
    (folder / "gun.toml").write_bytes((shipped_folder() / "gun.toml").read_bytes())
    (folder / "tiny.toml").write_text(DESIGN)
    return folder


def table(folder: Path, name: str = "tiny") -> list[dict[str, str]]:
    path = folder / "results" / "sub-P01" / f"sub-P01_task-{name}_trials.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_design_is_run_by_real_keys_from_consent_to_its_last_words(configs: Path, tmp_path: Path) -> None:
    run = words(configs, "tiny", "--participant", "P01")
    with virtual_display() as display, AtConsole(run, tmp_path, display) as screen:
        screen.answer, screen.rating = (lambda trial: "e" if trial == 1 else "r"), (lambda trial: str(3 + trial))
        screen.stands(RUN)
        look = screen.at("informing")
        assert any("consent" in text for text in look.texts), look.texts
        look = screen.to("setting")
        assert any("posture SITTING" in text for text in look.texts), look.texts
        look = screen.to("asking", 1)
        assert "Welcher Schuss war stärker?" in look.texts
        assert {name for name in look.places if name.startswith("answer")} == {"answer 1", "answer 2"}
        screen.keys.press("f")  # no key of this question
        assert screen.heard().state == "asking"
        screen.keys.press("u")  # nothing to undo yet
        assert screen.heard().state == "asking"
        screen.keys.press("r", "Control_L")  # R alone is an answer here
        screen.until(lambda look: look.line)
        screen.keys.type("a cough\n")
        look = screen.to("rating", 1)
        assert any(text == "How sure are you?" for text in look.texts)
        screen.keys.type("7\n")
        assert screen.heard().state == "rating"
        screen.keys.press("BackSpace")  # 7 is off the scale
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    first, second = table(tmp_path)
    assert (first["stronger"], second["stronger"]) == ("first", "second")
    assert (first["sure"], second["sure"]) == ("4.0", "5.0")
    assert first["why"] == second["why"] == "like a toy"
    assert (first["attempts"], first["flags"], second["attempts"]) == ("2", "repeated", "1")
    for row in (first, second):
        larger = "first" if float(row["voltage_V_1"]) > float(row["voltage_V_2"]) else "second"
        assert row["correct"] == str(int(row["stronger"] == larger))
        assert row["stronger_source"] == "experimenter"


@pytest.mark.soak
def test_a_design_on_the_participants_own_screen_and_keys(configs: Path, tmp_path: Path) -> None:
    pytest.importorskip("psychopy")
    run = words(configs, "tiny", "--participant", "P01", "--participant-screen", "--participant-keys")
    with virtual_display() as display, AtConsole(run, tmp_path, display) as screen:
        screen.rating = lambda trial: str(2 + trial)
        screen.stands(RUN)
        screen.at("informing")
        screen.participant_shows("Do you agree to take part?")
        asking = screen.to("asking", 1)
        screen.participant_shows("ChoicePage")
        screen.keys.press("Left")
        screen.until(lambda look: look.serial != asking.serial)
        screen.answer = lambda _: "r"
        pages = [("rating", "RatingPage"), ("describing", "DescriptionPage")]
        for state, page, trial in [(state, page, trial) for state, page in pages for trial in (1, 2)]:
            screen.to(state, trial)
            screen.participant_shows(page, trial)  # it has taken the keys
            screen.focus_on(RUN)  # the experimenter types what is said
            screen.until(lambda look: look.active)
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    first, second = table(tmp_path)
    assert (first["stronger"], first["stronger_source"], first["stronger_time_valid"]) == ("first", "participant", "1")
    assert (second["stronger"], second["stronger_source"]) == ("second", "experimenter")


def test_keys_of_the_participants_own_that_are_the_consoles_are_refused(configs: Path) -> None:
    design = configs / "tiny.toml"
    check_own_keys(load_setup(str(design)))
    design.write_text(design.read_text().replace('keys = { first = "left", second = "right" }', ""))
    with pytest.raises(PlaceError, match=r"tiny.toml: questions.stronger: e, r would .* keys = \{ first = \"left"):
        check_own_keys(load_setup(str(design)))


@pytest.mark.parametrize(
    ("keys", "others", "rates", "why"),
    [
        ("1 2", {"how": ("choice", "left right")}, False, ""),
        ("left right", {"how": ("choice", "f b")}, False, r"questions.how: f, b would be a key at the console"),
        ("1 2", {"much": ("rating", "")}, False, r"1, 2 would be typed at the console as well .questions.much"),
        ("1 2", {"much": ("rating", "")}, True, ""),
        ("1 2", {"much": ("number", "")}, True, r"1, 2 would be typed at the console as well .questions.much"),
        ("j k", {"words": ("text", "")}, False, r"questions.response: j, k would be typed"),
        ("left right", {"much": ("rating", ""), "words": ("text", "")}, False, ""),
    ],
)
def test_own_keys_are_held_against_all_that_the_console_takes(
    keys: str, others: dict[str, tuple[str, str]], rates: bool, why: str
) -> None:
    def asked(kind: str, keys: str) -> dict[str, object]:
        shared = {"kind": kind, "text": "How was it?"}
        if kind == "rating":
            return shared | {"minimum": 0, "maximum": 10, "grain": 1}
        named = dict(zip(("hard", "weak"), keys.split(), strict=False))
        return shared | ({"answers": ("hard", "weak"), "keys": named} if named else {})

    response = {"keys": dict(zip(("forward", "backward"), keys.split(), strict=True))}
    more = {name: asked(*about) for name, about in others.items()}
    setup = changed("direction", questions={"response": response, **more})
    if not why:
        check_own_keys(setup, rates=rates)
        return
    with pytest.raises(PlaceError, match=why):
        check_own_keys(setup, rates=rates)


@pytest.mark.parametrize("count", [4, 5])
def test_where_the_console_has_a_field_arrows_alone_are_advised(count: int) -> None:
    answers = list("abcde"[:count])
    keys = dict(zip(answers, "12345", strict=False))
    choice = {"kind": "choice", "text": "Which?", "answers": answers, "keys": keys}
    config = design(questions={"response": choice, "much": {"kind": "number", "text": "How much?"}})
    with pytest.raises(
        PlaceError, match=r'free are left, right, up, down, as in keys = \{ a = "left", .* d = "down" \}$'
    ):
        check_own_keys(replace(load_setup("direction"), config=config))


RANKED = """
design = "places"
title = "Which is the more comfortable"
gun = "gun.toml"

[factors.method]
levels = ["asymmetric-1"]

[factors.voltage_V]
levels = [12.0, 18.0]

[questions.place]
kind = "ranking"
when = "block"
text = "Which place does this one take?"
minimum_text = "most comfortable"

[console]
guard_s = 0.0

[fatigue]
max_trials_without_break = 10
max_planned_s = 600.0

[timing]
hand_over_s = 1.0
planned_s = 60.0
"""


@pytest.mark.soak
def test_ranks_on_the_participants_own_screen_do_not_tie(configs: Path, tmp_path: Path) -> None:
    pytest.importorskip("psychopy")
    (configs / "places.toml").write_text(RANKED)
    run = words(configs, "places", "--participant", "P01", "--participant-screen")
    with virtual_display("1400x900") as display, AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        for count, keys in enumerate((("Home", "Return"), ("Home", "Return", "End", "Return")), start=1):
            screen.participant_shows("RatingPage", count)  # of the second one, the first place is taken
            screen.focus_on("Recoil: participant")
            for name in keys:
                screen.keys.press(name)
            if count == 1:
                screen.until(lambda look: look.state == "rating" and look.trial == 2)
        screen.until(lambda look: look.state == "closing" and look.active)
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    assert [(row["place"], row["place_by"]) for row in table(tmp_path, "places")] == [
        ("1", "participant"), ("2", "participant")
    ]  # fmt: skip


def test_a_place_that_a_correction_sets_free_is_free_on_the_participants_page_at_once(
    configs: Path, tmp_path: Path
) -> None:
    pytest.importorskip("psychopy")
    (configs / "places.toml").write_text(RANKED.replace("[12.0, 18.0]", "[12.0, 15.0, 18.0]"))
    run = words(configs, "places", "--participant", "P01", "--participant-screen")
    with virtual_display("1400x900") as display, AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        screen.participant_shows("RatingPage")
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        screen.keys.type("2\n")
        screen.until(lambda look: look.state == "rating" and look.trial == 2)
        screen.participant_shows("RatingPage", 2)
        screen.focus_on("Recoil: participant")
        screen.keys.press("Right")  # the middle, which the first one has
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        screen.keys.press("u", "Control_L")
        screen.at("correcting")
        screen.keys.type("3\n")
        screen.participant_shows("RatingPage", 3)
        screen.focus_on("Recoil: participant")
        screen.keys.press("Return")
        screen.until(lambda look: look.state == "rating" and look.trial == 3)
        screen.participant_shows("RatingPage", 4)
        for name in ("Home", "Return"):
            screen.keys.press(name)
        screen.until(lambda look: look.state == "closing" and look.active)
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    assert [row["place"] for row in table(tmp_path, "places")] == ["3", "2", "1"]


def test_what_is_told_of_an_answer_follows_its_correction_but_for_an_emergency_stop(
    configs: Path, tmp_path: Path
) -> None:
    plain = DESIGN[: DESIGN.index("[questions.sure]")] + DESIGN[DESIGN.index("[console]") :]
    (configs / "tiny.toml").write_text(plain)
    run = words(configs, "tiny", "--participant", "P01")
    with virtual_display() as display, AtConsole(run, tmp_path, display) as screen:
        screen.answer = lambda _: "e"
        screen.stands(RUN)
        screen.to("asking", 1)
        screen.keys.press("e")
        first = screen.until(lambda look: look.state == "informing" and look.ready)
        other = "That was wrong." if first.says("That was right.") else "That was right."
        screen.keys.press("u")
        screen.at("correcting")
        screen.keys.press("r")
        second = screen.until(lambda look: look.state == "informing" and look.serial > first.serial and look.ready)
        assert second.says(other), second.texts
        screen.keys.press("F12")
        halted = screen.at("halted")
        screen.keys.press("u", "Control_L")
        screen.at("correcting")
        screen.keys.press("e")
        screen.until(lambda look: look.state == "halted" and look.serial > halted.serial)
        assert screen.process.poll() is None
        screen.kill()
