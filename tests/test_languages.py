"""The participant's language: what is in the catalogues, which are refused, and what a run in one of them records."""

import ast
import io
import json
import os
import re
import runpy
from dataclasses import asdict, fields, replace
from gettext import NullTranslations
from io import StringIO
from pathlib import Path

import pytest
from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po
from hypothesis import given
from hypothesis import strategies as st

from analysis.archive.pages import ArchivedDesign, methods
from analysis.logs.journals import RunFile
from analysis.summary.languages import unchecked_languages
from experiments.catalogues import catalogue
from experiments.catalogues.catalogue import (
    CHECKED_BY,
    DIRECTION,
    DOMAIN,
    ENGLISH,
    FONTS,
    SHIPPED,
    check_allowed,
    language,
    languages,
)
from experiments.catalogues.fonts import font_for
from experiments.catalogues.messages import ParticipantMessages, notes, placeholders
from experiments.catalogues.po import texts_of_po
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.design.config import DesignConfig
from experiments.design.planning import plan_of
from experiments.design.shown_texts import letters_of, setup_in, shown_texts, texts_in
from experiments.doctor.checks import LanguageAsked, carry_out_check, checks
from experiments.earlier_run import NotAsItBegan, gone_on_with
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import ShownLanguage, read_journal
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens import phrases as phrases_of_the_console
from experiments.screens import texts
from experiments.screens.participant import messages as wire
from experiments.screens.synthetic import synthetic_screen
from experiments.screens.terminal import TerminalScreen
from experiments.session.states import Position, State
from experiments.session.steps import Rate
from experiments.study.folders import PlaceError
from experiments.study.new_study import designs
from recoil.session import LanguageOptions, run_session
from tests.journals import forged, raw
from tests.pseudo_languages import HEADS, LONG, RIGHT_TO_LEFT, SAID, compiled, write_catalogue, write_pseudo_languages

ROOM = Path(catalogue.__file__).parents[1]
SOURCES = sorted(SHIPPED.glob(f"*/LC_MESSAGES/{DOMAIN}.po"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_pseudo_languages(tmp_path_factory.mktemp("catalogues"))


def every_text():
    """All that a participant of a shipped design sees or is read."""
    shown = {one.text for name in designs() for one in shown_texts(load_setup(name).config)}
    return {*notes(), *(text for text in shown if any(map(str.isalpha, text)))}


def test_the_template_and_every_catalogue_have_every_text_with_the_same_names_in_braces():
    assert SOURCES
    for path in (SHIPPED / f"{DOMAIN}.pot", *SOURCES):
        with path.open("rb") as file:
            found = {one.id: one.string for one in read_po(file) if one.id}
        assert set(found) == every_text(), f"{path}: run scripts/catalogues"
        if path in SOURCES:
            assert [text for text, said in found.items() if not said] == []
            assert [text for text, said in found.items() if placeholders(text) != placeholders(said)] == []


@pytest.mark.slow
def test_the_template_of_the_consoles_captions_is_as_the_console_has_them():
    made = runpy.run_path(str(ROOM.parent / "scripts" / "catalogues"))["console_template"]()
    with (SHIPPED / "console.pot").open("rb") as file:
        assert [one.id for one in read_po(file)] == [one.id for one in made], "run scripts/catalogues"


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.parts[-3])
def test_a_catalogue_that_comes_along_is_read_as_babel_reads_it(source):
    with source.open("rb") as file:
        texts = {one.id: one.string for one in read_po(file) if one.id}
    found = language(source.parts[-3])
    assert {text: found.look_up(text) for text in texts} == texts
    head = source.read_text(encoding="utf-8").partition("\n\n")[0]
    assert f'"{FONTS}: {", ".join(found.fonts)}\\n"' in head
    assert f'"{CHECKED_BY}: {found.checked_by or "nobody"}\\n"' in head


def test_no_sentence_of_the_participants_pages_stands_outside_the_messages():
    """Two words in a row are a sentence; what only errors and the window's own name say is not for participants."""
    apart = {"Recoil: participant", "far left", "far right", "top left", "\\n\\n"}
    found = set()
    for name in ("pages.py", "lettering.py"):
        tree = ast.parse((ROOM / "screens" / "participant" / name).read_text(encoding="utf-8"))
        documents = {ast.get_docstring(node, clean=False) for node in ast.walk(tree) if isinstance(node, _DOCUMENTED)}
        after_names = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in after_names:
                found |= {node.value} - documents
    assert {text for text in found if re.search(r"[A-Za-z]{2,} [A-Za-z]{2,}", text)} <= apart


_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef
COMMANDS_AND_STATES = {"go on", "end break", "no answer", "in progress", "not begun", "emergency stop", "test shot"}
NOT_SHOWN = {
    *COMMANDS_AND_STATES,
    *("participant again", "line of text", "correction of the {}", "nothing is asked before the run has begun"),
    *("Recoil – please wait", "Recoil – unfinished run"),
    "{} QLabel { font-size: 26px; padding: 40px; }",
}
"""Names of commands, states, threads, fields and windows; what a journal has, or an error in the code says; looks."""
OF_THE_PROGRAM = ("app.py", "windows.py", "visual_participant.py")
"""What these say is for the terminal or the journal."""
CONSOLE = [*sorted((ROOM / "screens" / "console").glob("*.py")), ROOM / "screens" / "texts.py"]


def phrases(tree):
    """The calls that a catalogue could translate."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    return [call for call in calls if call.func.id == "phrase"]


def sentences(tree):
    """What two words in a row say, a value counting as one, outside of phrases and of documentation."""
    apart = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    parts = [*phrases(tree), *(node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr))]
    apart |= {id(inner) for one in parts for inner in ast.iter_child_nodes(one)}
    for node in ast.walk(tree):
        said = node.values if isinstance(node, ast.JoinedStr) else [node]
        if id(node) not in apart and all(isinstance(one, ast.FormattedValue | ast.Constant) for one in said):
            text = "".join(str(one.value) if isinstance(one, ast.Constant) else "{}" for one in said)
            if re.search(r"[A-Za-z]{2,} ([A-Za-z]{2,}|{})|{} [A-Za-z]{2,}", text) and not text.startswith("--"):
                yield text


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", [path for path in CONSOLE if path.name not in OF_THE_PROGRAM], ids=lambda path: path.stem
)
def test_every_sentence_of_the_console_is_a_phrase_with_its_values_by_name(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert set(sentences(tree)) <= NOT_SHOWN
    for call in phrases(tree):
        given, (text,) = sorted(one.arg for one in call.keywords), call.args
        names = sorted({name.split(":")[0] for name in placeholders(text.value)})
        assert given in ([], names), text.value  # without any, they are filled in later


class Pseudo(NullTranslations):
    """Says that it was asked."""

    def gettext(self, message):
        return f"[{message}]"


def test_a_catalogue_would_translate_what_the_console_says_and_leave_its_values(monkeypatch):
    plan = plan_of(load_setup("direction").config, "P01", 1)
    plain = texts.place_text(plan, plan.trials[0])
    monkeypatch.setattr(phrases_of_the_console, "CATALOGUE", Pseudo())
    assert texts.place_text(plan, plan.trials[0]) == "[Trial 1 of 20] · [set 1 of 4 · session 1 of 3]"
    assert texts.shots_text(2) == "[2 shots]"
    assert plain == "Trial 1 of 20 · set 1 of 4 · session 1 of 3"


def test_a_message_that_a_page_does_not_use_is_in_no_catalogue():
    code = "".join(path.read_text(encoding="utf-8") for path in sorted((ROOM / "screens").rglob("*.py")))
    code += (ROOM / "session" / "design_session.py").read_text(encoding="utf-8")
    named = {one.name for one in fields(ParticipantMessages) if not one.name.startswith("key_")}
    assert {name for name in named if not re.search(rf"\.{name}\b", code)} == set()


@pytest.mark.parametrize("code", [LONG, RIGHT_TO_LEFT])
def test_a_labs_own_folder_has_a_language_with_every_message(folder, code):
    found = language(code, folder)
    assert found.messages.wait == SAID[code]("Please wait.")
    assert found.messages.place.format(number=2, of=3) == SAID[code]("Trial {number} of {of}").format(number=2, of=3)
    assert found.right_to_left == (code == RIGHT_TO_LEFT)
    assert found.checked_by


def test_a_language_without_a_catalogue_is_refused_with_those_that_there_are(folder):
    with pytest.raises(ConfigError, match=r"--language tlh: no catalogue .* there are ar-XB, en, en-XA, zh;"):
        language("tlh", folder)
    with pytest.raises(ConfigError, match="no such folder"):
        language("zh", folder / "none")


@pytest.mark.parametrize(("code", "why"), [("ar", "no catalogue of that name"), ("zh", "no native speaker has")])
def test_a_run_whose_design_names_the_language_is_refused_with_the_designs_file_and_line(tmp_path, code, why):
    path = tmp_path / "direction.toml"
    text = (shipped_folder() / "direction.toml").read_text()
    path.write_text(text.replace('gun = "gun.toml"', f'gun = "gun.toml"\nlanguage = "{code}"'))
    for name in ("gun.toml", "synthetic"):
        (tmp_path / name).symlink_to(shipped_folder() / name)
    asked = RunRequest(setup=load_setup(str(path)), participant_id="S01", results=tmp_path, screen="synthetic")
    with pytest.raises(ConfigError, match=rf"direction\.toml:\d+: language = '{code}': {why}"):
        run_session(asked)
    with pytest.raises(ConfigError, match=r"^--language tlh: no catalogue"):
        run_session(asked, LanguageOptions(code="tlh"))


def test_chinese_is_not_checked_and_says_so():
    chinese = language("zh")
    assert chinese.checked_by == ""
    with pytest.raises(ConfigError, match=r"no native speaker has checked it .* add --unchecked"):
        check_allowed(chinese, unchecked=False)
    check_allowed(chinese, unchecked=True)


@pytest.mark.parametrize("nobody", ["nobody", "Nobody", ""])
def test_a_catalogue_that_nobody_checked_says_so(tmp_path, nobody):
    write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG] | {CHECKED_BY: nobody})
    with pytest.raises(ConfigError, match="no native speaker has checked it"):
        check_allowed(language(LONG, tmp_path), unchecked=False)


NO_CHECKS = (
    *("-", "?", "no one", "niemand", "none yet", "n/a", "TODO", "<initials>", "machine", "A. B.", "2026-02-28"),
    *("?, 2026-02-28", "nobody, 2026-02-28", "A. B., 2026-02-30", "A. B., 28 February 2026"),
    *("Nobody., 2026-01-01", "nobody yet, 2026-02-28", "no one 2026-02-28", "None, 2026-02-28", "n/a, 2026-02-28"),
    *("TODO, 2026-02-28", "machine translation, 2026-02-28", "\u202eA. B., 2026-02-28"),
)


@pytest.mark.parametrize("said", NO_CHECKS)
def test_what_is_no_word_on_who_checked_and_when_is_refused(tmp_path, said):
    write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG] | {CHECKED_BY: said})
    with pytest.raises(ConfigError, match=r"X-Checked-By: .*; it must be nobody, or the initials or role"):
        language(LONG, tmp_path)


@pytest.mark.parametrize(
    "said",
    [
        "张, 2026-02-28",
        "Ö. 2026-02-28",
        "Na Li, 2026-02-28",
        "Todorova, 2026-02-28",
        "J. T. and N. A., both speakers, 2026-02-28",
    ],
)
def test_a_check_is_one_in_any_writing(tmp_path, said):
    write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG] | {CHECKED_BY: said})
    assert language(LONG, tmp_path).checked_by == said


def test_a_head_that_says_a_thing_twice_is_refused(tmp_path):
    write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG] | {FONTS.lower(): "Two"})
    with pytest.raises(ConfigError, match=f"its head says {FONTS.lower()} twice; mend it there"):
        language(LONG, tmp_path)


def test_a_catalogue_whose_lines_end_as_on_an_old_mac_is_read(tmp_path):
    path = write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG])
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r"))
    assert language(LONG, tmp_path).code == LONG


def test_a_catalogue_that_is_no_file_and_one_for_english_are_refused_by_name(tmp_path):
    path = write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG])
    path.unlink()
    path.symlink_to(path.name)
    with pytest.raises(ConfigError, match=r"recoil\.po: is no file"):
        language(LONG, tmp_path)
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(ConfigError, match=r"recoil\.po: is no file"):
        language(LONG, tmp_path)
    path.unlink()
    path.touch()
    os.truncate(path, 1 << 40)
    with pytest.raises(ConfigError, match="is longer than 4 MiB"):
        language(LONG, tmp_path)
    path.unlink()
    write_catalogue(tmp_path, "en", SAID[LONG], HEADS[LONG] | {"Language": "en"})
    with pytest.raises(ConfigError, match="en is what the others are made from; give it a code of its own"):
        language("en", tmp_path)


DAMAGED = {
    "a message that lacks": (SAID[LONG], HEADS[LONG], ("Confirm",), "lacks 'Confirm'"),
    "a name in braces that is gone": (lambda _: "x", HEADS[LONG], (), "must have the names in braces"),
    "a mark that turns the text": (lambda text: f"{text}\u202e", HEADS[LONG], (), "U+202E, which is not printed"),
    "no fonts": (SAID[LONG], HEADS[LONG] | {FONTS: ""}, (), "X-Fonts is missing"),
    "a direction that is none": (SAID[LONG], HEADS[LONG] | {DIRECTION: "up"}, (), "must be ltr or rtl"),
    "another language's": (SAID[LONG], HEADS[LONG] | {"Language": "de"}, (), "says Language: de, and its folder en-XA"),
}


@pytest.mark.parametrize(("say", "head", "but", "said"), DAMAGED.values(), ids=DAMAGED)
def test_a_catalogue_with(say, head, but, said, tmp_path):
    write_catalogue(tmp_path, LONG, say, head, but)
    with pytest.raises(ConfigError, match=re.escape(said)) as refused:
        language(LONG, tmp_path)
    assert str(refused.value).startswith(str(tmp_path))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (b"<<<<<<< HEAD\n", r"recoil\.po: line \d+: '<<<<<<< HEAD' is no line of a \.po"),
        (b'msgid "again"\n', r"recoil\.po: line \d+: an entry without its msgstr"),
        (
            b'msgid "x"\nmsgstr[0] "y"\n',
            r"recoil\.po: line \d+: 'x' has a msgstr of plurals and no msgid_plural; mend it",
        ),
        (b'msgstr "alone"\n', r"recoil\.po: line \d+: an entry without its msgid"),
        (b'msgid "Done"\nmsgstr "twice"\n', r"recoil\.po: line \d+: 'Done' stands there a second time"),
        (b'msgid "x"\nmsgstr "\\q"\n', r"recoil\.po: line \d+: \\q is none of "),
        (b"# \xd6\n", r"recoil\.po: line \d+: is not UTF-8 \(byte \d+\); save it as UTF-8"),
    ],
)
def test_a_source_with_what_cannot_be_read_is_refused_by_file_and_line(more, said, tmp_path):
    path = write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG])
    path.write_bytes(path.read_bytes() + b"\n" + more)
    with pytest.raises(ConfigError, match=said):
        language(LONG, tmp_path)


@pytest.mark.parametrize("cut", range(40, 4_000, 397))
def test_a_catalogue_that_is_cut_off_is_refused(cut, tmp_path):
    path = write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG])
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(ConfigError, match=r"recoil\.po"):
        language(LONG, tmp_path)


def compiled_alone(path):
    """The catalogue of a source as a `.mo`; the source is gone."""
    path.with_suffix(".mo").write_bytes(compiled(texts_of_po(path.read_text(encoding="utf-8"))))
    path.unlink()
    return path.with_suffix(".mo")


def test_a_compiled_catalogue_counts_where_it_has_no_source_and_never_before_it(tmp_path):
    path = write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG])
    of_source = language(LONG, tmp_path)
    of_compiled = compiled_alone(path)
    alone = language(LONG, tmp_path)
    assert (alone.messages, alone.fonts, alone.name) == (of_source.messages, of_source.fonts, of_source.name)
    of_compiled.write_bytes(b"no catalogue")
    with pytest.raises(ConfigError, match=r"recoil\.mo: is no compiled catalogue .* put the \.po"):
        language(LONG, tmp_path)
    write_catalogue(tmp_path, LONG, lambda text: f"{text} now", HEADS[LONG])
    assert language(LONG, tmp_path).messages.wait == "Please wait. now"


def test_a_labs_catalogue_without_anything_compiled_is_used_and_one_of_a_shipped_language_comes_first(tmp_path):
    own = write_catalogue(tmp_path, "zh", SAID[LONG], HEADS[LONG])
    assert languages(tmp_path) == {"en": None, "zh": own}
    assert language("zh", tmp_path).messages.wait == SAID[LONG]("Please wait.")


@pytest.mark.parametrize("code", ["", " ", "../zh", "中"])
def test_a_code_that_is_none_is_refused_by_name(code):
    with pytest.raises(ConfigError, match=re.escape(f"--language {code!r}: must be a language's code, such as zh")):
        language(code)
    with pytest.raises(ConfigError, match=re.escape(f"--language {code!r}")):
        run_session(
            RunRequest(setup=load_setup("preference"), participant_id="P01", results=Path("none")),
            LanguageOptions(code=code),
        )


SHOWN = st.text(
    st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]) | st.sampled_from('\n\t\r"\\'), min_size=1
)


@pytest.mark.slow
@given(st.dictionaries(SHOWN, SHOWN, max_size=5), st.sampled_from([0, 20]))
def test_a_source_is_read_as_babel_writes_it(said, width):
    made = Catalog()
    for text, other in said.items():
        made.add(text, other)
    out = io.BytesIO()
    write_po(out, made, width=width)
    assert {text: found for text, found in texts_of_po(out.getvalue().decode()).items() if text} == said


def test_what_is_fuzzy_has_a_context_or_plurals_or_is_obsolete_is_not_translated():
    source = """#, fuzzy
msgid ""
msgstr "Language: de\\n"

#, fuzzy, python-format
msgid "one"
msgstr "eins"
msgctxt "menu"
msgid "two"
msgstr "zwei"
msgid "{n} thing"
msgid_plural "{n} things"
msgstr[0] "ein Ding"
msgstr[1] "Dinge"
msgid "four"
msgstr ""
"vi"
"er"
#~ msgid "five"
#~ msgstr "fünf"
"""
    assert texts_of_po(source) == {"": "Language: de\n", "four": "vier"}
    assert texts_of_po(source.replace("\n", "\r\n")) == texts_of_po(source)


# a design's texts


@pytest.mark.parametrize("name", designs())
def test_every_shipped_design_is_in_chinese(name):
    setup = load_setup(name)
    shown, texts = setup_in(language("zh"), setup)
    assert [
        one.place for one in shown_texts(shown.config) if one.text.isascii() and any(map(str.isalpha, one.text))
    ] == []
    assert set(texts.values()).isdisjoint(texts)
    assert (
        shown.config.model_copy(
            update={
                "questions": setup.config.questions,
                "factors": setup.config.factors,
                "opening": setup.config.opening,
            }
        )
        == setup.config
    )


def test_english_changes_nothing():
    setup = load_setup("preference")
    assert setup_in(ENGLISH, setup) == (setup, {})
    assert "language" not in setup.config.model_dump(mode="json")


def test_a_text_that_the_catalogue_lacks_is_named_with_its_key(folder):
    setup = load_setup("direction")
    question = setup.config.questions["response"].model_copy(update={"text": "Where to?"})
    own = replace(setup, config=setup.config.model_copy(update={"questions": {"response": question}}))
    with pytest.raises(
        ConfigError, match=r"lacks .* questions\.response\.text = 'Where to\?'; add it .* language = 'en-XA'"
    ):
        setup_in(language(LONG, folder), own)


def test_a_design_in_the_language_itself_keeps_its_texts_but_for_the_answers_that_recoil_names(folder):
    long, design = language(LONG, folder), load_setup("direction").config
    own = DesignConfig.model_validate(design.model_dump() | {"language": LONG})
    assert own.model_dump(mode="json")["language"] == LONG
    assert texts_in(own, LONG, long.look_up) == {one: SAID[LONG](one) for one in ("forward", "backward")}
    with pytest.raises(ConfigError, match="the catalogue en "):  # in English it would be half one, half the other
        setup_in(ENGLISH, replace(load_setup("direction"), config=own))


def test_two_answers_of_one_name_are_refused(tmp_path):
    write_catalogue(tmp_path, LONG, lambda text: "ward" if text.endswith("ward") else SAID[LONG](text), HEADS[LONG])
    with pytest.raises(ConfigError, match=r"gives two answers of questions\.response one label: ward, ward"):
        setup_in(language(LONG, tmp_path), load_setup("direction"))


# fonts


def test_a_font_without_a_letter_is_refused_with_the_letter():
    lacking = replace(language("zh"), fonts=("Nowhere Sans", "DejaVu Sans"))
    with pytest.raises(ConfigError, match=r"Nowhere Sans is not installed; DejaVu Sans lacks U\+\w+ .* and \d+ more"):
        font_for(lacking, letters_of(lacking, load_setup("preference")))


def test_english_looks_for_no_font_and_arabic_is_looked_for_in_the_forms_that_are_drawn(folder):
    assert font_for(ENGLISH, "abc").path is None
    turned = language(RIGHT_TO_LEFT, folder)
    found = font_for(turned, letters_of(turned, load_setup("preference")))
    assert found.family == "DejaVu Sans"
    assert found.path is not None


@pytest.mark.slow
def test_what_counts_as_english_is_shown_in_any_font_that_has_its_letters():
    assert font_for(ENGLISH, "Wie fühlte es sich an?").family == "Noto Sans"
    found = font_for(ENGLISH, "ʘ ⅓ ☺ ⠿")  # of which Noto Sans has not all
    assert (found.family[:6], found.path is None) == ("DejaVu", False)
    with pytest.raises(ConfigError, match=r"Noto Sans lacks U\+67AA .*: fonts-noto-cjk has .* needs a catalogue"):
        font_for(ENGLISH, "枪 😀 𒀀")  # which no font has together


# runs


def head_of(place):
    return json.loads(place.journal.read_text(encoding="utf-8").splitlines()[0])


def carried_out(results, said, **named):
    setup = load_setup(named.pop("design", "preference"))
    request = RunRequest(setup=setup, participant_id="P01", results=results, seed=1, language=said, **named)
    return run(request, synthetic_screen, VirtualClock()).place


def test_a_run_in_english_records_no_language(tmp_path):
    place = carried_out(tmp_path, ENGLISH)
    assert "language" not in head_of(place)
    assert read_journal(place.journal).head.language is None


@pytest.mark.slow
def test_a_run_records_its_language_and_what_was_shown_and_its_table_is_the_same(tmp_path, folder):
    place = carried_out(tmp_path / "long", language(LONG, folder), design="detection")
    head = head_of(place)
    shown = read_journal(place.journal).head.language
    assert (shown.code, shown.name, shown.checked_by) == (LONG, "long", "a test, 2026-01-31")
    assert shown.messages["right"] == SAID[LONG]("That was right.")
    assert head["setup"]["experiment"]["questions"]["felt"]["text"] == "Did you feel a shot?"  # the design as it is
    steps = [json.loads(line)["body"] for line in place.journal.read_text().splitlines() if '"kind":"step"' in line]
    asked = next(one for one in steps if one["kind"] == "ask")
    assert asked["text"] == SAID[LONG]("Did you feel a shot?")
    assert [one["label"] for one in asked["choices"]] == [SAID[LONG]("yes"), SAID[LONG]("no")]
    answers = re.compile(rb"\d{4}-\d\d-\d\dT[^,]*")
    plain = carried_out(tmp_path / "english", ENGLISH, design="detection")
    assert answers.sub(b"", place.table.read_bytes()) == answers.sub(b"", plain.table.read_bytes())


@pytest.mark.slow
def test_what_is_told_after_an_answer_is_in_the_language(tmp_path, folder):
    setup = load_setup("detection")
    trial = setup.config.trial.model_copy(update={"feedback": True})
    told = replace(setup, config=setup.config.model_copy(update={"trial": trial}))
    request = RunRequest(setup=told, participant_id="P01", results=tmp_path, seed=1, language=language(LONG, folder))
    lines = run(request, synthetic_screen, VirtualClock()).place.journal.read_text().splitlines()
    said = {body["text"] for line in lines if (body := json.loads(line).get("body")) and body.get("what") == "feedback"}
    assert said <= {SAID[LONG]("That was right."), SAID[LONG]("That was wrong.")}
    assert said


def cut(place, lines=30):
    """The journal as if the run had broken off."""
    place.journal.write_bytes(b"".join(place.journal.read_bytes().splitlines(keepends=True)[:lines]))


def test_a_run_goes_on_where_recoil_has_a_message_that_it_did_not_have_when_the_run_began(tmp_path, folder):
    place = carried_out(tmp_path, language(LONG, folder))
    cut(place)
    head, *rest = raw(place.journal)
    del head["language"]["messages"]["wait"]
    head["language"]["messages"]["farewell"] = "one that it had then"
    place.journal.write_bytes(forged([head, *rest]))
    assert read_journal(carried_out(tmp_path, language(LONG, folder), again="resume").journal).finished


def test_a_run_goes_on_in_the_words_that_it_began_in(tmp_path, folder):
    long = language(LONG, folder)
    cut(carried_out(tmp_path, long))
    with pytest.raises(PlaceError, match=r"began in en-XA, not in en; resume with --language en-XA"):
        carried_out(tmp_path, ENGLISH, again="resume")
    other = replace(long, messages=replace(long.messages, wait="Hold on."))
    with pytest.raises(PlaceError, match="began with another catalogue en-XA than there is now"):
        carried_out(tmp_path, other, again="resume")
    checked = replace(long, checked_by="somebody else")  # the words are what counts
    assert read_journal(carried_out(tmp_path, checked, again="resume").journal).finished


def test_a_run_goes_on_in_its_own_words_though_its_catalogue_has_others_by_now(tmp_path, folder):
    """As after an update that words a message anew, or where somebody mended the catalogue."""
    place = carried_out(tmp_path, language(LONG, folder))
    cut(place)
    began = read_journal(place.journal).head.language
    text = next(iter(began.texts))
    changed = {ENGLISH.messages.wait: "Hold on.", text: "Something else"}
    own = tmp_path / "own"
    write_catalogue(own, LONG, lambda one: changed.get(one) or SAID[LONG](one), HEADS[LONG])
    assert language(LONG, own).messages.wait == "Hold on."
    going_on = gone_on_with(replace(resuming(tmp_path), catalogues=own))
    assert asdict(going_on.language.messages) == began.messages
    assert going_on.language.look_up(text) == began.texts[text]
    assert going_on.language.look_up("Somebody else's text") == language(LONG, own).look_up("Somebody else's text")
    run_session(resuming(tmp_path), LanguageOptions(folder=own))
    assert read_journal(place.journal).finished


def test_a_message_that_names_something_new_is_said_as_it_is_now(tmp_path, folder):
    place = carried_out(tmp_path, language(LONG, folder))
    cut(place)
    head, *rest = raw(place.journal)
    head["language"]["messages"]["place"] = "Item {number}"  # it names the number of trials by now
    place.journal.write_bytes(forged([head, *rest]))
    going_on = gone_on_with(replace(resuming(tmp_path), catalogues=folder))
    assert going_on.language.messages.place == language(LONG, folder).messages.place


def test_a_look_crosses_the_wire_with_its_messages(folder):
    look = wire.Look(right_to_left=True, messages=language(RIGHT_TO_LEFT, folder).messages)
    assert wire.look_from(wire.arguments(look)) == look


def test_an_empty_catalogue_is_compiled_as_babel_does():
    assert compiled({"": "Language: de\n"})[:4] == b"\xde\x12\x04\x95"


# what is said of it


def test_the_report_names_who_saw_unchecked_texts_and_nobody_else(tmp_path, folder):
    runs = []
    for name, said in (("a", language("zh")), ("b", language(LONG, folder)), ("c", ENGLISH)):
        place = carried_out(tmp_path / name, said)
        runs.append(run_file(place, name.upper()))
    runs.append(replace(runs[0], path=str(tmp_path / "gone.jsonl")))
    assert list(unchecked_languages(runs)) == [
        "preference: A saw and heard zh (中文), in texts that no native speaker had checked"
    ]


def test_the_methods_section_of_an_archive_says_who_was_spoken_to_in_a_translation():
    setup = load_setup("preference")
    shown = ShownLanguage(code="zh", name="中文", checked_by="", messages={}, texts={})
    spoken = (shown, shown, replace(shown, code="de", name="Deutsch", checked_by="somebody"))
    done = ArchivedDesign(design=setup.config, gun=setup.gun, participants=tuple("ABCD"), spoken=spoken)
    assert methods([done]).decode().split("\n")[-4::2] == [
        "1 of 4 saw and heard all of it in a translation, de (Deutsch), checked by a native speaker.",
        "2 of 4 saw and heard all of it in a translation, zh (中文), which no native speaker had checked.",
    ]
    assert "translation" not in methods([replace(done, spoken=())]).decode()


def run_file(place, code):
    return RunFile(path=str(place.journal), participant=code, experiment="preference", kind="synthetic", study="")


@pytest.mark.slow
def test_the_doctor_names_the_font_and_what_is_amiss(folder):
    def verdict(code):
        wanted = checks(Path("results"), "simulated", 0.01, asked=LanguageAsked(code=code, folder=folder))
        (found,) = carry_out_check(next(one for one in wanted if one.name == "language"))
        return found.verdict, found.measured, found.advice

    assert verdict(LONG) == ("good", "en-XA (long): every message is there; Noto Sans has all letters", "")
    assert verdict("zh")[0] == "warning"
    assert "have a native speaker check it" in verdict("zh")[2]
    refused = verdict("tlh")
    assert (refused[0], refused[2]) == ("fails", "mend that, and look again; docs/howto/languages.md says how")
    assert refused[1].startswith("--language tlh: no catalogue of that name")
    assert "language" not in [one.name for one in checks(Path("results"), "simulated", 0.01)]


def test_at_a_terminal_what_is_read_out_is_in_the_language_and_what_is_saved_in_english(folder):
    long = language(LONG, folder)
    setup, _ = setup_in(long, load_setup("preference"))
    plan = plan_of(setup.config, "P01", 1)
    screen = TerminalScreen(plan, VirtualClock(), StringIO(), StringIO(), messages=long.messages)
    step = Rate(
        trial=plan.trials[1],
        question="rating",
        text=setup.config.questions["rating"].text,
        minimum=0.0,
        maximum=10.0,
        minimum_text="a",
        maximum_text="b",
        grain=0.1,
        later=True,
    )
    text = screen.text(Position(states=(State.RATING,), step=step))
    assert long.messages.place.format(number=2, of=3) in text
    assert step.text in text
    assert texts.about_text(plan, step) == "Trial 2 of 3"


def test_the_languages_to_choose_from_are_the_checked_ones_unless_it_is_said_otherwise(folder):
    def offered(unchecked):
        return {one.code for one in LanguageOptions(folder=folder, unchecked=unchecked).usable(left_out.append)}

    left_out = list[str]()
    assert offered(False) == {"en", LONG, RIGHT_TO_LEFT}
    assert offered(True) == {"en", LONG, RIGHT_TO_LEFT, "zh"}
    assert left_out == []


def test_a_catalogue_that_cannot_be_read_is_told_and_hides_no_other(tmp_path):
    broken = write_catalogue(tmp_path, LONG, SAID[LONG], HEADS[LONG])
    broken.write_text("no catalogue")
    left_out = list[str]()
    assert [one.code for one in LanguageOptions(folder=tmp_path).usable(left_out.append)] == ["en"]
    (line,) = left_out
    assert line.startswith(f"left out: {broken}: line 1")


@pytest.mark.slow
@pytest.mark.parametrize("code", [None, "zh"])
def test_that_nobody_has_checked_a_language_is_accepted_once_a_run(code, tmp_path):
    begun = carried_out(tmp_path, language("zh"))
    cut(begun)
    request = resuming(tmp_path)
    with pytest.raises(ConfigError, match="no native speaker"):  # another run of theirs is to be accepted anew
        run_session(replace(request, again="fresh"), LanguageOptions(code="zh"))
    place = run_session(request, LanguageOptions(code=code))
    assert read_journal(place.journal).finished
    assert list(unchecked_languages([run_file(place, "P01")]))


def test_a_run_that_began_in_a_checked_language_is_asked_about_once_nobody_vouches_for_it(tmp_path, folder):
    own = write_pseudo_languages(tmp_path / "own")
    cut(carried_out(tmp_path, language(LONG, own)))
    write_catalogue(own, LONG, SAID[LONG], HEADS[LONG] | {CHECKED_BY: "nobody"})
    with pytest.raises(ConfigError, match="no native speaker"):
        run_session(resuming(tmp_path), LanguageOptions(folder=own))


@pytest.mark.slow
def test_at_the_console_a_run_is_gone_on_with_in_its_own_language_whatever_stands_in_the_window(tmp_path, folder):
    cut(carried_out(tmp_path, language("zh")))
    assert gone_on_with(replace(resuming(tmp_path), language=language(LONG, folder))).language.code == "zh"
    cut(carried_out(tmp_path / "own", language(LONG, folder)))
    own = replace(resuming(tmp_path / "own"), catalogues=folder)
    assert gone_on_with(own).language.messages == language(LONG, folder).messages
    with pytest.raises(NotAsItBegan, match=r"began with \(--catalogues DIR\), or start anew \(--fresh\)") as refused:
        gone_on_with(replace(own, catalogues=None))
    assert f"the run began in {LONG}: no catalogue of that name" in refused.value.refusal
    assert " --" not in refused.value.refusal  # which a window says, where there is no command line
    cut(carried_out(tmp_path / "english", ENGLISH))
    assert gone_on_with(replace(resuming(tmp_path / "english"), language=language("zh"))).language is ENGLISH


def resuming(results):
    return RunRequest(setup=load_setup("preference"), participant_id="P01", results=results, again="resume")


def test_a_resumed_run_goes_on_in_its_own_language_without_being_told(tmp_path, folder):
    cut(carried_out(tmp_path, language(LONG, folder)))
    request = resuming(tmp_path)
    with pytest.raises(NotAsItBegan, match=rf"the run began in {LONG}: no catalogue .* \(--catalogues DIR\)"):
        run_session(request)
    place = run_session(request, LanguageOptions(folder=folder))
    assert read_journal(place.journal).finished
    with pytest.raises(ConfigError, match="no catalogue of that name"):
        run_session(replace(request, again="fresh"), LanguageOptions(code="tlh"))
