"""A study that is frozen: every key that differs is named with both values, an edited file is named, runs carry it."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from analysis.archive.archive_export import ArchiveRequest, export_archive
from analysis.archive.making import PREREGISTRATION, preregistration_faults
from analysis.archive.manifest import ArchiveFault
from analysis.archive.preregistration import Frozen, freeze
from analysis.logs.reading import read_logs
from analysis.predict.check import check, check_text
from analysis.summary.analyze import Request, analyze, result_files
from analysis.summary.announced import names_of_tests, sentences_of_tests
from analysis.summary.designs import summarise
from analysis.summary.deviations import AnalysisFiles, Deviation, StudyDeviations, deviations, frozen_tests
from analysis.summary.participation import participation
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.preregistration import deviations_sections
from experiments.clock import RealClock, VirtualClock
from experiments.config.door import ConfigError
from experiments.load import load_setup
from experiments.record.journal import head
from experiments.record.rebuild import rebuild
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.console.people import changed_text
from experiments.screens.synthetic import synthetic_screen
from experiments.study import register
from experiments.study.changes import plain_value, setup_changes, setup_key
from experiments.study.folders import PlaceError, freeze_status, open_study, overview
from experiments.study.new_study import new_study
from experiments.study.preregistration import PreregistrationError, run_warnings
from experiments.study.study import Facts
from tests.conftest import Recoil, refused
from tests.designs import changed
from tests.log_files import rating_rows, ratings_path, write_rows
from tests.tables_of_designs import loaded, simulated

KEYS: dict[str, tuple[tuple[str, str, object, object], ...]] = {
    "study.toml": (
        ("participants", "14", 14, 16),
        ("code_prefix", '"P"', "P", "Q"),
        ("replications", "2000", 2000, 100),
        ("eligibility.age_years_min", "21", 21, 18),
        ("eligibility.age_years_max", "29", 29, 35),
    ),
    "direction.toml": (
        ("order.sets", "4", 4, 2),
        ("order.sessions", '"random"', "random", "williams"),
        ("order.balance", '"session"', "session", "set"),
        ("questions.response.text", '"Which way did the gun shoot?"', "Which way did the gun shoot?", "Which way?"),
        ("practice.repetitions", "1", 1, 2),
        ("breaks.between_sets_s", "20.0", 20.0, 30.0),
        ("breaks.between_sessions_s", "300.0", 300.0, 240.0),
        ("fatigue.max_trials_without_break", "10", 10, 20),
        ("fatigue.max_planned_s", "2700.0", 2700.0, 3600.0),
        ("timing.hand_over_s", "15.8", 15.8, 14.0),
        ("timing.answer_s", "1.2", 1.2, 1.5),
        ("timing.planned_s", "1800.0", 1800.0, 1700.0),
        ("console.guard_s", "0.25", 0.25, 0.5),
        ("console.response_times", "false", False, True),
    ),
    "gun.toml": (
        ("voice_coil.magnet_mass_kg", "0.114", 0.114, 0.12),
        ("voice_coil.resistance_ohm", "2.9", 2.9, 3.0),
        ("voice_coil.stiffness_N_m", "14.0", 14.0, 13.0),
        ("voice_coil.friction_N", "0.21", 0.21, 0.22),
        ("voice_coil.voltage_V", "16.0", 16.0, 15.0),
        ("voice_coil.pulse_s", "0.010", 0.010, 0.011),
        ("voice_coil.emf", '"printed"', "printed", "reciprocal"),
        ("voice_coil.drive_off", '"shorted"', "shorted", "open"),
    ),
    "rules.toml": (
        ("trials.response_time_min_s", "0.15", 0.15, 0.2),
        ("trials.drop_unanswered", "true", True, False),
        ("participants.min_kept_share", "0.8", 0.8, 0.9),
    ),
}
"""Thirty keys: file, key, how its value is written there, what it is and what it becomes."""
RULES = "[trials]\nresponse_time_min_s = 0.15\ndrop_unanswered = true\n[participants]\nmin_kept_share = 0.8\n"
COUNTED = "participants who finished {}, given to this analysis and not excluded by hand"
REQUEST = '[[requests]]\nkind = "bayes-factor"\nof = "direction"\nscale = 0.5\n'


def made(folder: Path) -> Path:
    """A new study with rules, a further test, a hypothesis and a stop rule of its own."""
    new_study(folder)
    (folder / "rules.toml").write_text(RULES)
    (folder / "requests.toml").write_text(REQUEST)
    with (folder / "study.toml").open("a") as file:
        file.write('\n[preregistration]\nhypotheses = ["More force is felt better."]\nstop_rule = "After the term."\n')
        file.write('rules = "rules.toml"\nrequests = "requests.toml"\n')
    return folder


def edited(folder: Path, file: str, key: str, old: str, new: object) -> None:
    """A value of a file as its owner changes it: on the first line with that name and value."""
    path = folder / file
    text, name = path.read_text(), key.rpartition(".")[2]
    changed, count = re.subn(
        rf"^(# )?{name} += {re.escape(old)}(?![\w.])",
        f"{name} = {plain_value(new)}",
        text,
        count=1,
        flags=re.MULTILINE,
    )
    assert count, f"{file} has no {name} = {old} any more"
    path.write_text(changed)


def do(folder: Path, code: str, *, person: bool = True) -> Path:
    """A run as a person does it, typed by the screen of a synthetic participant; its journal."""
    setup, results = load_setup(folder / "preference.toml"), folder / "results"
    request = RunRequest(
        setup=setup, participant_id=code, results=results, seed=1, screen="terminal" if person else "synthetic"
    )
    return run(request, synthetic_screen, VirtualClock()).place.journal


def told(folder: Path, **used: object) -> StudyDeviations:
    """The deviations of a study whose analysis used its own rules and tests, unless it says otherwise."""
    files = AnalysisFiles(rules=folder / "rules.toml", requests=folder / "requests.toml")
    found, _ = deviations(read_logs([folder / "results"]), replace(files, **used))
    assert len(found) == 1
    return found[0]


def of_preference_alone(study: Path, participants: int) -> Path:
    """The study frozen with one experiment and so many people."""
    edited(study, "study.toml", "participants", "14", participants)
    text = (study / "study.toml").read_text()
    (study / "study.toml").write_text(text.replace('["direction.toml", "preference.toml"]', '["preference.toml"]'))
    (study / "requests.toml").write_text(REQUEST.replace("direction", "preference"))
    freeze(study, "", RealClock())
    return study


def broken_off(path: Path) -> Path:
    """A journal whose run was stopped in the middle, without its table."""
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[: len(lines) // 2]))
    table_of(path).unlink()
    return path


def table_of(path: Path) -> Path:
    return path.with_name(path.name.replace("journal.jsonl", "ratings.csv"))


def of_kind(found: StudyDeviations, kind: str) -> list[Deviation]:
    return [one for one in found.deviations if one.kind == kind]


def report(found: StudyDeviations) -> str:
    section = next(deviations_sections(ReportData(title="", statistics=StudyStatistics(preregistration=(found,)))))
    return "\n".join([*section.paragraphs, *(" | ".join(row) for table in section.tables for row in table.rows)])


@pytest.fixture(scope="module")
def templates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new study, the same when it is frozen, and with a run of a person after that."""
    folder = tmp_path_factory.mktemp("templates")
    made(folder / "new")
    copytree(folder / "new", folder / "frozen")
    freeze(folder / "frozen", "", RealClock())
    copytree(folder / "frozen", folder / "begun")
    do(folder / "begun", "P01")
    return folder


@pytest.fixture
def study(templates: Path, tmp_path: Path) -> Path:
    """A study that nobody has frozen yet."""
    return copytree(templates / "new", tmp_path / "pilot")


@pytest.fixture
def frozen(templates: Path, tmp_path: Path) -> Path:
    return copytree(templates / "frozen", tmp_path / "pilot")


@pytest.fixture
def begun(templates: Path, tmp_path: Path) -> Path:
    """A frozen study with the run of a person."""
    return copytree(templates / "begun", tmp_path / "pilot")


# what is written


def test_the_page_says_in_words_what_was_planned(study: Path) -> None:
    done = freeze(study, "", RealClock())
    page = done.page.read_text()
    for words in (
        "More force is felt better.",
        "After the term.",
        "14 participants do",
        "at least 21 years and at most 29 years",
        "20 trials in 4 sets of 5",
        "Trials whose response time is below 0.15 s are dropped.",
        "one-way repeated-measures ANOVA",
        "direction, the Bayes factor of the repeated-measures ANOVA (scale 0.5)",
        "No run of a person had begun.",
        done.preregistration.sha256,
    ):
        assert words in page


def test_a_second_freeze_writes_an_amendment_where_something_has_changed_and_else_nothing(
    begun: Path,
) -> None:
    first = (begun / "preregistration-1.json").read_bytes()
    again = freeze(begun, "", RealClock())
    assert (again.is_new, again.preregistration.number) == (False, 1)
    edited(begun, "study.toml", "participants", "14", 16)
    second = freeze(begun, "a grant", RealClock())
    assert second.preregistration.previous == again.preregistration.sha256
    assert [str(one) for one in second.preregistration.changes] == ["study.toml: participants: frozen 14, now 16"]
    assert "a grant" in second.page.read_text()
    assert (begun / "preregistration-1.json").read_bytes() == first
    found = told(begun)
    assert [(one.frozen, one.instead) for one in of_kind(found, "amended")] == [(14, 16)]
    assert "when 1 run of people had begun: preregistration 2" in report(found)
    assert "Reason: a grant." in report(found)


@pytest.mark.slow
def test_a_file_that_an_amendment_adds_or_removes_is_one_deviation_and_not_one_a_key(study: Path) -> None:
    own, both = (study / "study.toml").read_text(), '["direction.toml", "preference.toml"]'
    (study / "study.toml").write_text(own.replace(both, '["direction.toml"]'))
    freeze(study, "", RealClock())
    do(study, "P01")
    (study / "study.toml").write_text(own)
    added = [str(one) for one in freeze_status(study).changes]
    assert added == [
        'study.toml: experiments: frozen ["direction.toml"], now ["direction.toml", "preference.toml"]',
        "preference.toml: added",
    ]
    assert "2 keys or files have changed since" in freeze_status(study).lines()[0]
    assert "\n- `preference.toml` added\n" in freeze(study, "a second question", RealClock()).page.read_text()
    assert "amended | preference.toml: added, by preregistration 2 | – | – | " in report(told(study)).splitlines()
    (study / "study.toml").write_text(own.replace(both, '["direction.toml"]'))
    assert "changed since | preference.toml: removed | – | – | " in report(told(study)).splitlines()


def test_what_cannot_be_frozen_is_refused_with_its_place(study: Path, tmp_path: Path) -> None:
    with pytest.raises(PlaceError, match="no study's folder"):
        freeze(tmp_path, "", RealClock())
    (study / "requests.toml").write_text(REQUEST.replace("direction", "directions"))
    with pytest.raises(ConfigError, match="of = 'directions': no experiment of this study"):
        freeze(study, "", RealClock())
    (study / "requests.toml").unlink()
    with pytest.raises(ConfigError, match=r"study.toml:\d+: preregistration.requests = 'requests.toml': no such file"):
        freeze(study, "", RealClock())
    assert not [*study.glob("preregistration-*")]


WEIGHTS = 'kind = "contrasts"\nof = "direction"\nweights.x = { asymmetric-9 = 1, asymmetric-1 = -1 }'


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        (WEIGHTS, "there is no condition 'asymmetric-9'; there are vibration, asymmetric-1, asymmetric-2"),
        ('kind = "equivalence"\nof = "preference"\na = "nope"\nlow = -1.0\nhigh = 1.0', "there is no condition 'nope'"),
        ('kind = "mixed-model"\nof = "direction"\nterms = ["bogus"]', "terms: there is no factor 'bogus' that varies"),
        ('kind = "bayes-factor"\nof = "direction"\nquestion = "response"', "question: direction has one measure"),
    ],
)
def test_a_test_that_cannot_be_made_is_refused_before_it_is_frozen(study: Path, request_: str, said: str) -> None:
    (study / "requests.toml").write_text(f"{REQUEST}\n[[requests]]\n{request_}\n")
    with pytest.raises(ConfigError, match=rf"requests\.toml:6: requests\.1: {re.escape(said)}"):
        freeze(study, "", RealClock())
    with pytest.raises(ConfigError, match=re.escape(said)):
        check(str(study / "study.toml"), None, 14)


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ('kind = "bayes-factor"\nof = "realism"', "question: say which one; realism has realism, comfort"),
        ('kind = "bayes-factor"\nof = "realism"\nquestion = "whatever"', "question = 'whatever': realism has realism"),
        ('kind = "bayes-factor"\nof = "realism"\nquestion = "comfort"', "a Bayes factor is of one factor"),
        (
            'kind = "equivalence"\nof = "realism"\nquestion = "comfort"\na = "off/1"\nlow = -1.0\nhigh = 1.0',
            "there is no condition 'off/1'; there are off/",
        ),
    ],
)
def test_tests_of_a_design_are_held_against_its_questions_and_conditions(
    tmp_path: Path, request_: str, said: str
) -> None:
    new_study(tmp_path / "own", "realism")
    (tmp_path / "own" / "requests.toml").write_text(f"[[requests]]\n{request_}\n")
    with (tmp_path / "own" / "study.toml").open("a") as file:
        file.write('\n[preregistration]\nrequests = "requests.toml"\n')
    with pytest.raises(ConfigError, match=re.escape(said)):
        freeze(tmp_path / "own", "", RealClock())


def test_a_rule_about_a_method_that_no_design_has_is_refused_before_it_is_frozen(study: Path) -> None:
    (study / "rules.toml").write_text(f'{RULES}[[accuracy]]\nmethod = "asymmetric-9"\nmin_share = 0.6\n')
    with pytest.raises(
        ConfigError, match=r"rules\.toml:7: accuracy\.0\.method = 'asymmetric-9': no design of this study"
    ):
        freeze(study, "", RealClock())


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["detection", "grip", "hurry", "magnitude", "pairs", "preference", "realism", "stronger", "voltages"]
)
def test_the_tests_that_are_announced_are_those_that_are_made(name: str) -> None:
    design, laws = loaded(name)
    found = summarise(design, simulated(design, laws, 4)).questions
    assert {asked: {one.name for one in summary.tests} for asked, summary in found.items()} == {
        asked: set(names_of_tests(design, question))
        for asked, question in design.questions.items()
        if question.kind != "text"
    }


# what differs


@pytest.mark.slow
def test_thirty_changed_keys_are_each_named_with_both_values(begun: Path) -> None:
    cases = [(file, *one) for file, keys in KEYS.items() for one in keys]
    assert len(cases) == 30
    for file, key, old, _, new in cases:
        edited(begun, file, key, old, new)
    found = told(begun)
    rows = report(found).splitlines()
    for file, key, _, before, after in cases:
        assert f"changed since | {file}: {key} | {plain_value(before)} | {plain_value(after)} | " in rows
    assert len(of_kind(found, "changed since")) == 30
    said = check_text(check(str(begun / "study.toml"), None, 14))
    assert said.count(": frozen ") == 30
    assert all(f"{file}: {key}: frozen {plain_value(one)}" in said for file, key, _, one, _ in cases)
    assert len(overview(open_study(begun)).frozen.changes) == 30


def test_every_single_key_is_found_alone(frozen: Path) -> None:
    for file, keys in KEYS.items():
        whole = (frozen / file).read_bytes()
        for key, old, before, after in keys[:2]:
            edited(frozen, file, key, old, after)
            (only,) = freeze_status(frozen).changes
            assert (only.file, only.key, only.frozen, only.now) == (file, key, before, after)
            (frozen / file).write_bytes(whole)
    assert freeze_status(frozen).changes == ()


def test_another_order_of_questions_or_factors_is_a_change(tmp_path: Path) -> None:
    """Questions are asked in it, and conditions planned."""
    new_study(tmp_path / "study", "realism")
    config = tmp_path / "study" / "realism.toml"
    freeze(config.parent, "", RealClock())
    before, whole = load_setup(config), config.read_text()
    top, first, second, rest = re.split(r"(?=\[questions|\[fatigue)", whole)
    config.write_text(top + second + first + rest)
    (only,) = freeze_status(config.parent).changes
    assert str(only) == 'realism.toml: questions: frozen ["realism", "comfort"], now ["comfort", "realism"]'
    assert [change.key for change in setup_changes(before.record(), load_setup(config).record())] == ["questions"]
    assert setup_key(before.record()) != setup_key(load_setup(config).record())
    assert freeze(config.parent, "asked the other way round", RealClock()).is_new


def test_a_comment_and_a_default_that_is_spelled_out_change_nothing(frozen: Path) -> None:
    with (frozen / "direction.toml").open("a") as file:
        file.write("# nothing\n")
    text = (frozen / "study.toml").read_text()
    (frozen / "study.toml").write_text(text.replace("[preregistration]", "[preregistration]\nfits = false", 1))
    assert "nothing has changed" in freeze_status(frozen).lines()[0]


@pytest.mark.slow
def test_a_run_names_what_was_frozen_and_warns_of_what_has_changed(frozen: Path) -> None:
    sha256 = freeze_status(frozen).chain.every[0].sha256
    kept = [do(frozen, "P01"), do(frozen, "S01", person=False)]
    assert [one.preregistration_sha256 for path in kept if (one := head(path)) is not None] == [sha256, sha256]
    edited(frozen, "gun.toml", "voice_coil.voltage_V", "16.0", 15.0)
    said = [*run_warnings(load_setup(frozen / "preference.toml"), frozen / "results", [])]
    assert "the run goes on" in said[0]
    assert said[1:] == ["gun.toml: voice_coil.voltage_V: frozen 16.0, now 15.0"]
    assert "1 key or file has changed since preregistration 1" in changed_text(overview(open_study(frozen)))
    do(frozen, "P02")
    differing = of_kind(told(frozen), "run")
    assert [(one.what, one.frozen, one.instead, one.who) for one in differing] == [
        ("run of preference, gun.toml: voice_coil.voltage_V", 16.0, 15.0, ("P02",))
    ]


@pytest.mark.slow
def test_runs_before_the_freeze_and_the_people_are_told(study: Path) -> None:
    do(study, "P01")
    done = freeze(study, "", RealClock())
    assert done.preregistration.begun == ("P01 preference",)
    do(study, "P02")
    results, clock = study / "results", RealClock()
    old = Facts(age_years=40, sex="female", handedness="right")
    register.append(results, register.entry("joined", "P02", facts=old), clock)
    register.append(results, register.entry("excluded", "P01", reason="fell ill"), clock)
    found = told(study)
    assert [one.who for one in of_kind(found, "run")] == [("P01",)]
    assert "begun before the freeze" in of_kind(found, "run")[0].what
    assert {(one.what, one.frozen, one.instead) for one in of_kind(found, "participants")} == {
        (COUNTED.format("direction"), 14, 0),
        (COUNTED.format("preference"), 14, 1),
        ("took part, not eligible: age_years = 40: must be at most 29", None, None),
    }
    assert [(one.what, one.who) for one in of_kind(found, "exclusion")] == [("excluded by hand: fell ill", ("P01",))]


@pytest.mark.slow
def test_who_came_beyond_the_planned_number_is_named_and_all_as_planned_is_no_deviation(study: Path) -> None:
    of_preference_alone(study, 1)
    do(study, "P01")
    assert "No deviation." in report(told(study))
    do(study, "P02")
    (beyond,) = told(study).deviations
    assert (beyond.frozen, beyond.instead, beyond.who) == (1, 2, ("P02",))


@pytest.mark.slow
def test_who_did_the_experiments_in_another_order_is_named_and_who_is_excluded_is_not(study: Path) -> None:
    freeze(study, "", RealClock())
    for code in ("P01", "P02", "P03"):
        do(study, code)
    register.append(study / "results", register.entry("excluded", "P03", reason="fell ill"), RealClock())
    (order,) = of_kind(told(study), "order")
    how = "preference was begun before direction was done, which comes first"
    assert (order.what, order.who) == (how, ("P01", "P02"))
    assert f"order | {how} | – | – | P01, P02" in report(told(study))


@pytest.mark.slow
def test_who_left_is_named_with_the_reason_and_a_code_that_was_nobodys_took_no_part(study: Path) -> None:
    results, clock = study / "results", RealClock()
    freeze(study, "", clock)
    do(study, "P01")
    old = Facts(age_years=40, sex="female", handedness="right")
    for code, reason in {"P01": "moved away", "X99": "mistyped; is P01"}.items():
        register.append(results, register.entry("joined", code, facts=old), clock)
        register.append(results, register.entry("left", code, reason=reason), clock)
    of_people = [(one.what, one.who) for one in of_kind(told(study), "participants")[2:]]
    assert of_people == [
        ("comes no more: moved away", ("P01",)),
        ("took part, not eligible: age_years = 40: must be at most 29", ("P01",)),
        ("comes no more: mistyped; is P01", ("X99",)),
    ]
    absent = participation(read_logs([results]), {"preference": ["P01"]}, ()).absent
    assert [(one.participant, one.state) for one in absent] == [("X99", "not done: comes no more (mistyped; is P01)")]


@pytest.mark.slow
def test_who_broke_off_has_not_finished_with_a_table_or_without(study: Path) -> None:
    of_preference_alone(study, 3)
    with_table, without, blank, _ = (do(study, code, person=False) for code in ("P01", "P02", "P03", "P04"))
    table, content, _ = rebuild(broken_off(with_table))
    table.write_bytes(content)
    broken_off(without)
    broken_off(blank).write_bytes(b'{"n":0')
    assert [(one.what, one.frozen, one.instead, one.who) for one in told(study).deviations] == [
        (COUNTED.format("preference"), 3, 1, ()),
        ("began preference and did not finish it", None, None, ("P01", "P02", "P03")),
    ]


@pytest.mark.slow
def test_a_run_whose_journal_cannot_be_read_is_named_and_so_is_its_log(study: Path) -> None:
    of_preference_alone(study, 3)
    used, not_used, _, _ = (do(study, code, person=False) for code in ("P01", "P02", "P03", "P04"))
    for path in (used, not_used):
        path.write_text("garbage\n")
    table_of(not_used).write_text("garbage\n")
    found = told(study)
    unread = (
        "there is no journal that can be read: under which preregistration, "
        "and whether it was finished, cannot be known"
    )
    assert of_kind(found, "run") == [Deviation(kind="run", what=f"run of preference: {unread}", who=("P01", "P02"))]
    ((log, who),) = [(one.what, one.who) for one in of_kind(found, "exclusion")]
    assert (log.partition(":")[0], who) == ("log of preference not used", ("P02",))
    assert str(study) not in report(found)


def test_a_log_of_people_that_cannot_be_used_is_named_without_a_journal_too_and_no_synthetic_one(study: Path) -> None:
    of_preference_alone(study, 1)
    do(study, "S01", person=False)
    of_people = [one | {"rating_by": "participant"} for one in rating_rows("P01")]
    for code in ("P01", "P02"):
        write_rows(ratings_path(study / "results", code), of_people)
    assert [one.who for one in of_kind(told(study), "exclusion")] == [("P02",)]


@pytest.mark.slow
def test_who_finished_and_was_not_given_to_the_analysis_is_named(study: Path) -> None:
    of_preference_alone(study, 4)
    journals = [do(study, code, person=False) for code in ("P01", "P02", "P03", "P04")]
    do(study, "P05")  # of another kind than these: not compared
    folders, tables = [path.parent for path in journals], [*map(table_of, journals)]
    used = AnalysisFiles(rules=study / "rules.toml", requests=study / "requests.toml")
    for paths in (folders[:2], tables[:2]):
        ((found,), _) = deviations(read_logs(paths), used)
        assert [(one.what, one.frozen, one.instead, one.who) for one in found.deviations] == [
            (COUNTED.format("preference"), 4, 2, ()),
            ("finished preference and not given to this analysis", None, None, ("P03", "P04")),
        ]
    for paths in (folders, tables):
        ((found,), _) = deviations(read_logs(paths), used)
        assert found.deviations == ()
    journals[3].write_text("garbage\n")
    ((found,), _) = deviations(read_logs(folders[:3]), used)
    (one,) = of_kind(found, "run")
    assert one.what.startswith("run of preference, not given to this analysis: there is no journal that can be read")
    assert one.who == ("P04",)


@pytest.mark.slow
def test_where_the_results_are_a_link_to_another_disk_the_freeze_is_the_one_beside_the_link(
    study: Path, tmp_path: Path
) -> None:
    of_preference_alone(study, 2)
    do(study, "P01")
    elsewhere = tmp_path / "disk" / "of-pilot"
    elsewhere.parent.mkdir()
    (study / "results").rename(elsewhere)
    (study / "results").symlink_to(elsewhere)
    assert [(one.what, one.instead) for one in told(study).deviations] == [(COUNTED.format("preference"), 1)]
    assert frozen_tests(read_logs([study / "results"])) == [TEST | {"of": "preference"}]
    (tmp_path / "shortcut").symlink_to(elsewhere)  # beside which no study lies
    (elsewhere.parent / "preregistration-1.json").write_bytes((study / "preregistration-1.json").read_bytes())
    ((found,), _) = deviations(read_logs([tmp_path / "shortcut"]), AnalysisFiles())
    assert [one.number for one in found.preregistrations] == [1]


@pytest.mark.slow
@pytest.mark.parametrize("elsewhere", [False, True])
def test_a_design_is_found_in_the_freeze_however_the_study_names_its_file(
    study: Path, tmp_path: Path, *, elsewhere: bool
) -> None:
    named = str(tmp_path / "designs" / "preference.toml") if elsewhere else "./preference.toml"
    copytree(study, tmp_path / "designs")
    text = (study / "study.toml").read_text()
    (study / "study.toml").write_text(text.replace('["direction.toml", "preference.toml"]', f'["{named}"]'))
    (study / "requests.toml").write_text(REQUEST.replace("direction", "preference"))
    freeze(study, "", RealClock())
    do(study, "P01")
    assert [(one.what, one.instead) for one in told(study).deviations] == [(COUNTED.format("preference"), 1)]
    design = Path(os.path.normpath(study / named))
    edited(design.parent, design.name, "fatigue.max_planned_s", "1200.0", 1300.0)
    file = design.as_posix() if elsewhere else "preference.toml"
    assert [(one.file, one.key) for one in freeze_status(study).changes] == [(file, "fatigue.max_planned_s")]


TEST = {"kind": "bayes-factor", "of": "direction", "scale": 0.5}


def test_other_rules_and_tests_than_were_frozen_are_told(begun: Path, tmp_path: Path) -> None:
    assert of_kind(told(begun), "analysis") == []
    rules, tests = tmp_path / "other.toml", tmp_path / "more.toml"
    rules.write_text(RULES.replace("0.15", "0.3"))
    tests.write_text(REQUEST.replace("0.5", "0.7"))
    other = of_kind(told(begun, rules=rules, requests=tests, fits=True), "analysis")
    assert [(one.what, one.frozen, one.instead) for one in other] == [
        ("--rules other.toml: trials.response_time_min_s", 0.15, 0.3),
        ("a test that was not frozen: exploratory", None, TEST | {"scale": 0.7}),
        (
            "a frozen test that was not made (--requests)",
            {"kind": "bayes-factor", "of": "direction", "scale": 0.5},
            None,
        ),
        ("--fits: the diffusion model", False, True),
    ]
    none = of_kind(told(begun, rules=None, requests=None), "analysis")
    assert [one.what for one in none] == ["--rules was not given", "a frozen test that was not made"]


@pytest.mark.slow
def test_why_the_rules_leave_somebody_out_is_not_frozen_and_no_deviation(study: Path) -> None:
    person = '[[excluded]]\ncode = "P02"\nreason = "a seizure"\n'
    (study / "rules.toml").write_text(RULES + person)
    done = freeze(study, "", RealClock())
    assert "seizure" not in done.file.read_text() + done.page.read_text()
    assert "P02 is left out, for a reason that is not published here." in done.page.read_text()
    (study / "rules.toml").write_text(RULES + person.replace("seizure", "fit"))
    assert freeze_status(study).changes == ()
    do(study, "P01")
    assert of_kind(told(study), "analysis") == []
    (study / "rules.toml").write_text(RULES + person.replace("P02", "P03"))
    assert [(one.key, one.frozen, one.now) for one in freeze_status(study).changes] == [
        ("excluded.0.code", "P02", "P03")
    ]
    again = freeze(study, "a slip", RealClock())
    assert "seizure" not in again.file.read_text() + again.page.read_text()


@pytest.mark.slow
def test_frozen_tests_are_made_unless_a_file_asks_for_others(study: Path) -> None:
    of_ratings = REQUEST.replace("direction", "preference")
    (study / "requests.toml").write_text(of_ratings + REQUEST)
    freeze(study, "", RealClock())
    for code in ("P01", "P02"):
        do(study, code)
    asked = Request(paths=[study / "results"], out=study / "out", rules=study / "rules.toml")

    def made(request: Request) -> tuple[list[str], list[str], list[str]]:
        found = json.loads(result_files(request)["statistics.json"])
        tests = [one["what"] for one in found["preregistration"][0]["deviations"] if "test" in one["what"]]
        warned = [one for one in found["warnings"] if "frozen test" in one]
        return [f"{one['of']}: {one['note'][:35]}" for one in found.get("requested", [])], tests, warned

    answered, tests, (warned,) = made(asked)
    assert answered == ["preference: Asked for by the preregistration. B"]
    assert tests == ["a frozen test that was not made"]
    assert warned.startswith("a frozen test is not made: requests.1: of = 'direction': there are no logs of it")
    _, said, _ = analyze(asked)
    assert f"{study}: 1 frozen test not made; the report names each, and its warnings why" in said
    (study / "requests.toml").write_text(of_ratings)
    answered, tests, warnings = made(replace(asked, requests=study / "requests.toml"))
    assert answered == ["preference: Bayes factor of the repeated-measur"]
    assert (tests, warnings) == (["a frozen test that was not made (--requests)"], [])


# what was edited, or is missing


def forged(path: Path, how: str) -> None:
    """An edit of a preregistration."""
    text = path.read_text()
    record = json.loads(text)
    match how:
        case "value":
            record["files"]["study.toml"]["participants"] = 16
        case "words":
            record["words"] = record["words"].replace("14 participants", "16 participants")
        case "hash":
            record["sha256"] = "0" * 64
        case "time":
            record["written_utc"] = "2020-01-01T00:00:00Z"
        case "stranger":
            record["note"] = "mine"
        case "cut":
            path.write_text(text[:-20])
            return
        case "twice":
            path.write_text(text.replace('"number": 1', '"number": 2, "number": 1', 1))
            return
    path.write_text(json.dumps(record))


@pytest.mark.parametrize("how", ["value", "words", "hash", "time", "stranger", "cut", "twice"])
def test_an_edited_freeze_is_named_with_what_to_do(frozen: Path, how: str) -> None:
    path = frozen / "preregistration-1.json"
    forged(path, how)
    (said,) = freeze_status(frozen).problems
    assert said.startswith(f"{path}: was edited")
    assert "put the original back, from a copy" in said


@pytest.mark.parametrize("name", ["preregistration-1.json", "preregistration-1.md"])
def test_a_pipe_in_the_place_of_a_freeze_keeps_nobody_waiting(frozen: Path, name: str) -> None:
    (frozen / name).unlink()
    os.mkfifo(frozen / name)
    (said,) = freeze_status(frozen).problems
    assert said.startswith(f"{frozen / name}: ")


def test_a_page_whose_lines_another_system_ends_is_not_edited(frozen: Path) -> None:
    page = frozen / "preregistration-1.md"
    page.write_bytes(page.read_bytes().replace(b"\n", b"\r\n"))
    assert freeze_status(frozen).problems == ()


def test_an_edited_freeze_is_named_wherever_the_study_is_looked_at(begun: Path) -> None:
    path = begun / "preregistration-1.json"
    forged(path, "value")
    setup, named = load_setup(begun / "preference.toml"), f"{path}: was edited"
    assert next(run_warnings(setup, begun / "results", [])).startswith(named)
    assert any(one.startswith(named) for one in overview(open_study(begun)).problems)
    assert named in check_text(check(str(begun / "direction.toml"), None, 14))
    with pytest.raises(PreregistrationError, match="was edited"):
        freeze(begun, "", RealClock())
    found, said = deviations(read_logs([begun / "results"]), AnalysisFiles())
    assert any(one.startswith(named) for one in said)
    assert of_kind(found[0], "preregistration")[0].what.startswith("preregistration-1.json: was edited")
    assert str(begun) not in report(found[0])


def test_a_freeze_that_is_laid_out_anew_is_not_edited(frozen: Path) -> None:
    path = frozen / "preregistration-1.json"
    path.write_text(json.dumps(json.loads(path.read_text())))
    assert freeze_status(frozen).problems == ()


def test_an_edited_page_is_named_and_a_missing_one_written_again(frozen: Path) -> None:
    page = frozen / "preregistration-1.md"
    whole = page.read_text()
    page.write_text(whole.replace("14 participants", "16 participants"))
    assert "was edited: it is not the page of preregistration-1.json" in freeze_status(frozen).problems[0]
    page.unlink()
    freeze(frozen, "", RealClock())
    assert page.read_text() == whole


def test_a_forger_who_makes_a_new_hash_is_found_by_the_journals_and_by_the_amendment(begun: Path) -> None:
    edited(begun, "study.toml", "participants", "14", 16)
    second = freeze(begun, "", RealClock()).preregistration
    first = freeze_status(begun).chain.every[0]
    other = first.model_copy(update={"written_utc": "2020-01-01T00:00:00Z"})
    (begun / "preregistration-1.json").write_text(json.dumps(dict(other.record())))
    (begun / "preregistration-1.md").write_text(other.page())
    problems = overview(open_study(begun)).problems
    assert second.previous == first.sha256
    assert any("is not the preregistration that preregistration-2.json amends" in one for one in problems)
    assert any(f"no preregistration {first.short} that can be trusted" in one and "P01" in one for one in problems)


def faults_in_archive(study: Path) -> list[ArchiveFault]:
    """What is wrong with the preregistrations of a folder that has them where an archive does."""
    (study / "preregistration").mkdir()
    for path in study.glob("preregistration-*"):
        path.rename(study / "preregistration" / path.name)
    return preregistration_faults(study)


def test_a_freeze_in_an_archive_is_held_against_the_journals_there(begun: Path) -> None:
    (gone,) = preregistration_faults(begun)
    assert (gone.file, gone.said.endswith(" that can be trusted, which the journals of P01 name")) == (
        PREREGISTRATION,
        True,
    )
    assert faults_in_archive(begun) == []
    forged(begun / "preregistration" / "preregistration-1.json", "value")
    edited_one, _ = preregistration_faults(begun)
    assert edited_one.file == "preregistration/preregistration-1.json"
    assert re.fullmatch("was edited: its content has the hash [0-9a-f]{12}, and it says [0-9a-f]{12}", edited_one.said)


@pytest.mark.slow
def test_an_archive_is_not_held_against_a_freeze_that_stands_elsewhere_in_it(begun: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    export_archive(ArchiveRequest(folder=begun, out=archive, include_synthetic=True))
    assert deviations(read_logs([archive / "results"]), AnalysisFiles()) == ((), ())


@pytest.mark.parametrize("whole", ["[]", "5", "NaN", '"text"'])
def test_a_freeze_that_is_no_json_object_is_named(frozen: Path, whole: str) -> None:
    (frozen / "preregistration-2.json").write_text(whole)
    (said,) = freeze_status(frozen).problems
    assert said.startswith(f"{frozen / 'preregistration-2.json'}: was edited, or is of another version")


@pytest.mark.slow
@pytest.mark.parametrize("number", ["NaN", "-Infinity", "1e999"])
def test_a_freeze_with_what_is_no_number_ends_no_command(begun: Path, number: str) -> None:
    path = begun / "preregistration-1.json"
    path.write_text(path.read_text().replace('"participants": 14', f'"participants": {number}', 1))
    setup, named = load_setup(begun / "preference.toml"), f"{path}: was edited, or is of another version"
    assert next(run_warnings(setup, begun / "results", [])).startswith(named)
    assert any(one.startswith(named) for one in overview(open_study(begun)).problems)
    assert named in check_text(check(str(begun / "direction.toml"), None, 14))
    with pytest.raises(PreregistrationError, match="was edited"):
        freeze(begun, "", RealClock())
    assert any(one.startswith(named) for one in deviations(read_logs([begun / "results"]), AnalysisFiles())[1])
    assert any("was edited" in one.said for one in faults_in_archive(begun))


def test_a_freeze_with_a_hash_of_its_own_whose_study_is_none_is_named(frozen: Path) -> None:
    path = frozen / "preregistration-1.json"
    first = freeze_status(frozen).chain.every[0]
    other = first.model_copy(update={"files": first.files | {"study.toml": {}}})
    path.write_text(json.dumps(dict(other.record())))
    assert f"{path}: was edited, or is of another version" in freeze_status(frozen).problems[0]


def test_a_freeze_that_was_renamed_is_named_so(frozen: Path) -> None:
    (frozen / "preregistration-1.json").rename(frozen / "preregistration-7.json")
    assert any("preregistration-7.json: was renamed" in one for one in freeze_status(frozen).problems)


def test_a_freeze_that_is_gone_is_named_and_not_written_anew(begun: Path) -> None:
    for path in begun.glob("preregistration-*"):
        path.unlink()
    setup, results = load_setup(begun / "preference.toml"), begun / "results"
    assert "the journals of P01 name" in next(run_warnings(setup, results, results.glob("*/*_journal.jsonl")))
    assert any("the journals of P01 name" in one for one in overview(open_study(begun)).problems)
    with pytest.raises(PreregistrationError, match="the journals of P01 name"):
        freeze(begun, "", RealClock())
    found, said = deviations(read_logs([results]), AnalysisFiles())
    assert any("the journals of P01 name" in one for one in said)
    assert "no preregistration that can be trusted" in report(found[0])


def test_a_study_that_nobody_froze_hears_nothing_of_it(study: Path) -> None:
    kept = do(study, "P01")
    assert b"preregistration_sha256" not in kept.read_bytes()
    assert deviations(read_logs([study / "results"]), AnalysisFiles()) == ((), ())
    assert freeze_status(study).lines() == ()
    assert isinstance(freeze(study, "", RealClock()), Frozen)


# as a user calls it


@pytest.mark.slow
def test_the_commands_freeze_warn_and_report(recoil: Recoil, study: Path) -> None:
    done = recoil("freeze", study)
    assert (done.returncode, done.stderr) == (0, "")
    assert "SHA-256" in done.stdout
    edited(study, "gun.toml", "voice_coil.voltage_V", "16.0", 15.0)
    words = ("--participant", "S01", "--screen", "synthetic", "--results", study / "results")
    ran = recoil("run", study / "preference.toml", *words)
    assert ran.returncode == 0
    assert "recoil: gun.toml: voice_coil.voltage_V: frozen 16.0, now 15.0" in ran.stderr
    looked = recoil("study", study, "--json")
    assert json.loads(looked.stdout)["preregistration"]["changes"] == [
        {"file": "gun.toml", "key": "voice_coil.voltage_V", "frozen": 16.0, "now": 15.0}
    ]
    forged(study / "preregistration-1.json", "value")
    refused(recoil("freeze", study), "was edited", "from a copy")
    assert recoil("check", study / "study.toml").returncode == 1


def test_of_levels_that_answers_choose_thresholds_are_announced_and_not_shares_of_right_answers() -> None:
    (said,) = sentences_of_tests(load_setup("staircase").config)
    assert said.startswith("staircase, interval: a cumulative normal over pulse_s, whose levels a procedure chose")
    assert "share of right answers" not in said
    both = changed("threshold", factors={"method": {"levels": ("asymmetric-1", "asymmetric-2")}}).config
    assert names_of_tests(both, both.questions["response"]) == ()
    assert names_of_tests(load_setup("threshold").config, both.questions["response"]) == ("anova",)
