"""`recoil export archive` and `recoil verify`: what is published, what is not, and that no change goes unnoticed."""

from __future__ import annotations

import csv
import json
import os
import random
import re
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, get_args

import pytest

from analysis.archive import archive_export, manifest
from analysis.archive.archive_export import Archived, ArchiveRequest
from analysis.archive.redaction import FIRST_MOMENT, REDACTED, moment_of, redacted, redacted_config
from analysis.archive.verify import verify
from analysis.report import placing
from analysis.report.serial import plain
from experiments.record.journal import contents_of, read_journal
from experiments.record.lines import ending_of
from experiments.session import remarks, steps
from experiments.study.folders import PlaceError
from experiments.study.register import RegisterError
from tests.archived_studies import NAME, SECRET_PLACES, WORDS, sealed, small_study
from tests.conftest import Recoil, refused
from tests.journals import forged, raw
from tests.log_files import tree, write_study

pytestmark = pytest.mark.slow

TRIALS = "results/sub-P01/sub-P01_task-direction_trials.csv"
JOURNAL = "results/sub-P01/sub-P01_task-direction_journal.jsonl"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Archived]:
    """The study, its archive, and what was said of it."""
    folder = tmp_path_factory.mktemp("archived")
    study = small_study(folder / "study")
    done = archive_export.export_archive(ArchiveRequest(folder=study, out=folder / "archive"))
    return study, folder / "archive", done


@pytest.fixture
def copy(made: tuple[Path, Path, Archived], tmp_path: Path) -> Path:
    """The archive, to be changed."""
    shutil.copytree(made[1], tmp_path / "copy")
    return tmp_path / "copy"


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


# what is in it


def test_an_archive_is_whole_and_its_journals_make_its_tables_and_statistics(
    made: tuple[Path, Path, Archived],
) -> None:
    _, archive, done = made
    found = verify(archive)
    assert (found.faults, found.remarks) == ((), ())
    assert found.manifest_sha256 == done.manifest_sha256
    assert found.files == done.files == len(tree(archive)) - 1
    assert (
        found.rebuilt == len([path for path in tree(archive) if re.search(r"\.csv$|(beh|events)\.tsv$", path)]) - 1 + 2
    )


def test_every_run_of_the_study_is_named_with_what_became_of_it(made: tuple[Path, Path, Archived]) -> None:
    _, archive, done = made
    found = {(row["participant_id"], row["experiment"], row["state"]) for row in rows(archive / "contents.csv")}
    assert found == {
        ("P01", "direction", "not finished"),
        ("P01", "direction", "practice"),
        ("P01", "preference", "finished"),
        ("P02", "direction", "finished"),
        ("P02", "preference", "finished"),
        ("P02", "preference", "set aside"),
        ("P03", "direction", "not finished"),
        ("P03", "preference", "finished"),
        ("P04", "direction", "begun"),
        ("P04", "preference", "broken"),
        ("P05", "direction", "excluded"),
        ("P05", "preference", "excluded"),
        ("P06", "", "no run"),
    }
    page = (archive / "README.md").read_text()
    assert "3 participants." in page
    why = "left out: table or journal is missing, breaks a rule, or was changed since the run"
    assert f"| preference | broken | 1 | {why} |" in page
    assert "All participants are synthetic" in page
    assert "preregistrations, with their dates, the reasons of amendments" in page
    assert "Runs in the archive, and left out" in (archive / "analysis" / "report.md").read_text()
    assert {path.parts[0] for path in (Path(one) for one in tree(archive / "results"))} == {
        *("sub-P01", "sub-P02", "sub-P03", "participants.jsonl"),
        *("task-direction_columns.md", "task-preference_columns.md", "shots_columns.md"),
    }
    said = " ".join((*done.left_out, *done.remarks))
    for words in ("P05 is excluded", "P04 has begun direction", "sub-P04_task-preference_ratings.csv"):
        assert words in said


def test_the_archives_own_report_knows_whom_the_study_left_out(
    made: tuple[Path, Path, Archived], tmp_path: Path
) -> None:
    from analysis.summary.analyze import Request, result_files

    study, archive, _ = made
    statistics = json.loads((archive / "analysis" / "statistics.json").read_bytes())
    of_study = result_files(Request(paths=[study / "results"], out=tmp_path))["statistics.json"]
    ours, theirs = (one["participation"]["experiments"] for one in (statistics, json.loads(of_study)))
    assert (ours["direction"]["left_out"], ours["direction"]["begun"], ours["preference"]["left_out"]) == (2, 1, 2)
    for experiment, counts in theirs.items():
        assert {key: ours[experiment][key] for key in ("left_out", "begun")} == {
            key: counts[key] for key in ("left_out", "begun")
        }
    reasons = {one["reason"] for one in statistics["excluded"] if one["participant"] == "P05"}
    assert reasons == {"the participant was excluded; the reason stands in the study's register alone"}
    report = (archive / "analysis" / "report.md").read_text()
    assert "2 further participants were left out: 1 by hand, 1 for a log that could not be used." in report
    assert "Preference: 1 participant left out: P05 (the participant was excluded; the reason" in report
    assert "Nobody was left out" not in report


def test_the_methods_section_says_who_was_simulated_and_what_other_setups_have_otherwise(
    made: tuple[Path, Path, Archived],
) -> None:
    page = (made[1] / "METHODS.md").read_text()
    assert "3 participants, all of them synthetic (a simulation answered, not a person); gun:" in page
    sections = [part for part in re.split(r"(?m)^# ", page) if part]
    assert len(set(sections)) == len(sections)
    (other,) = (part for part in sections if "What differs" in part)
    assert "differs from the first setup of this experiment: experiment assumed = " in other
    assert not any(place in page for place in SECRET_PLACES)


def test_the_methods_section_says_how_many_runs_were_stopped(made: tuple[Path, Path, Archived]) -> None:
    page = (made[1] / "METHODS.md").read_text()
    direction = [part for part in re.split(r"(?m)^# ", page) if "Experiment `direction`" in part]
    counts = [re.findall(r"(\d) runs? w\w+ stopped before", part) for part in direction]
    assert sum(int(count) for found in counts for count in found) == 2
    assert page.count("the archive has what was answered up to there") == len([*filter(None, counts)])


def test_what_a_sensor_measured_is_in_it_without_the_place_of_the_sensor(made: tuple[Path, Path, Archived]) -> None:
    study, archive, _ = made
    name = "results/sub-P03/sub-P03_task-preference_shots.csv"
    ours, theirs = rows(archive / name), rows(study / name)
    assert [row["delivered_peak_m_s2"] for row in ours] == [row["delivered_peak_m_s2"] for row in theirs]
    assert {row["sensor"] for row in ours} == {"[redacted]"}
    resources = json.loads((archive / "datapackage.json").read_text())["resources"]
    assert {one["schema"] for one in resources if one["path"] == name} == {"schemas/shots.json"}
    assert (archive / "bids" / "sub-P03" / "beh" / "sub-P03_task-preference_events.tsv").is_file()


def test_the_statistics_are_those_of_the_study(made: tuple[Path, Path, Archived], tmp_path: Path) -> None:
    from analysis.summary.analyze import Request, result_files

    study, archive, _ = made
    ours = json.loads((archive / "analysis" / "statistics.json").read_bytes())
    files = result_files(Request(paths=[study / "results"], out=tmp_path))
    theirs = json.loads(files["statistics.json"])
    for experiment in ("direction", "preference"):
        assert ours[experiment] == theirs[experiment]
    assert {name: data for name, data in files.items() if name.endswith(".csv")} == {
        path.name: path.read_bytes() for path in (archive / "analysis").glob("*.csv")
    }


# what is redacted


def test_nothing_that_is_published_names_a_person_a_place_or_a_day(made: tuple[Path, Path, Archived]) -> None:
    study, archive, _ = made
    today = {str(datetime.now(UTC).date()), read_journal(study / JOURNAL).head.utc[:10]}
    for path, whole in tree(archive).items():
        data = re.sub(rb"data:image/png;base64,[^\"]*", b"", whole)  # whose letters may spell anything
        for words in (NAME, "Ohm", "ohm/", *SECRET_PLACES, *today, str(study)):
            assert words.encode() not in data, (path, words)


def test_what_a_participant_said_is_hidden_and_what_was_not_said_is_empty(made: tuple[Path, Path, Archived]) -> None:
    study, archive, _ = made
    for code in ("P01", "P02", "P03"):
        table = f"results/sub-{code}/sub-{code}_task-preference_ratings.csv"
        before, after = (rows(folder / table) for folder in (study, archive))
        assert [row["comment"] for row in after] == [REDACTED if row["comment"] == WORDS else "" for row in before]
        assert [row["rating"] for row in after] == [row["rating"] for row in before]
    spoken = [path for path, data in tree(study / "results").items() if f",{WORDS},".encode() in data]
    assert spoken


def test_a_redacted_journal_follows_from_its_own_lines_and_names_the_original(
    made: tuple[Path, Path, Archived],
) -> None:
    import hashlib

    study, archive, _ = made
    for path in sorted(archive.rglob("*_journal.jsonl")):
        original = study / path.relative_to(archive)
        head, lines = raw(path)[0], original.read_bytes().splitlines()
        assert head["redacted_from"] == {
            "format": 1,
            "first_line_sha256": hashlib.sha256(lines[0]).hexdigest(),
            "last_line_sha256": hashlib.sha256(lines[-1]).hexdigest(),
        }
        assert len(raw(path)) == len(lines)
        if read_journal(path).finished:
            of_table, itself, _ = ending_of(path.read_bytes())
            assert of_table
            assert itself
            assert head["plan_sha256"] == raw(original)[0]["plan_sha256"]


def test_times_between_two_moments_of_a_participant_stay(made: tuple[Path, Path, Archived]) -> None:
    study, archive, _ = made
    names = [f"sub-P02_task-{experiment}_journal.jsonl" for experiment in ("direction", "preference")]
    moved = set()
    for name in names:
        before, after = (raw(folder / "results" / "sub-P02" / name) for folder in (study, archive))
        moved |= {moment_of(b["utc"]) - moment_of(a["utc"]) for b, a in zip(before, after, strict=True)}
        assert after[0]["monotonic_s"] == 0.0
    assert len(moved) == 1
    firsts = [raw(archive / "results" / "sub-P02" / name)[0]["utc"] for name in names]
    assert min(map(moment_of, firsts)) == FIRST_MOMENT


def test_free_text_stays_where_it_is_asked_for_but_causes_of_faults_never(
    made: tuple[Path, Path, Archived],
) -> None:
    study, *_ = made
    path = study / JOURNAL
    told = redacted(path, path.read_bytes(), moment_of(raw(path)[0]["utc"]), free_text=True).decode()
    assert f"{NAME} came in" in told
    assert SECRET_PLACES[0] not in told


def test_rules_say_neither_in_a_comment_nor_in_a_reason_who_someone_is(tmp_path: Path) -> None:
    file = tmp_path / "rules.toml"
    person = f'[[excluded]]\ncode = "P02"\nreason = "{NAME} fell ill"  # {NAME}\n'
    file.write_text(f"# {NAME} wrote this\n[trials]\nresponse_time_min_s = 0.2\n{person}")
    before, after = tomllib.loads(file.read_text()), redacted_config(file).decode()
    assert NAME not in after
    before["excluded"][0]["reason"] = REDACTED
    assert tomllib.loads(after) == before


def test_the_clocks_of_computer_and_gun_begin_anew_in_each_stretch_of_a_run(made: tuple[Path, Path, Archived]) -> None:
    path = made[0] / JOURNAL
    head = raw(path)[0] | {"monotonic_s": 48086.25}
    timing = {
        "written_s": 48090.5,
        "gun_accepted_us": 7_000_000,
        "gun_start_us": 7_000_900,
        "gun_count": 41,
        "asked": 1,
    }
    fired = {"kind": "outcome", "utc": head["utc"], "monotonic_s": 48091.0, "synced_s": 48090.0}
    fired |= {"body": {"kind": "fired", "pulse_start_s": 48090.75, "timing": timing}}
    again = {"kind": "resumed", "utc": head["utc"], "monotonic_s": 12.5, "synced_s": None}
    later = fired | {"monotonic_s": 13.5, "synced_s": 13.0}
    found = redacted(path, forged([head, fired, fired, again, later]), moment_of(head["utc"]))
    first, second, _, third = [json.loads(line) for line in found.splitlines()][1:]
    assert first == second | {"n": 1, "link": first["link"]}
    assert (first["monotonic_s"], first["synced_s"], first["body"]["pulse_start_s"]) == (4.75, 3.75, 4.5)
    shown = {"written_s": 4.25, "gun_accepted_us": 0, "gun_start_us": 900, "gun_count": 1, "asked": 1}
    assert first["body"]["timing"] == shown
    assert third["monotonic_s"] == 1.0
    assert third["body"]["timing"]["gun_count"] == 1


SAFE = {"gun", "motion", "method", "question", "event", "state", "because", "flag", "kind"}
"""Fields of outcomes and remarks whose text is of the design or the program."""


@pytest.mark.parametrize("word", [*get_args(steps.Outcome), *get_args(remarks.Remark)], ids=lambda word: word.__name__)
def test_every_text_of_an_outcome_or_remark_is_hidden_but_those_that_are_named_here(
    made: tuple[Path, Path, Archived], word: type[Any]
) -> None:
    head = raw(made[0] / JOURNAL)[0]
    texts = [one.name for one in fields(word) if one.type == "str" and not one.name.endswith("utc")]
    body = dict.fromkeys(texts, NAME) | {"kind": "x", "not_known_yet": NAME, "deep": [{"er": NAME}]}
    kind = "outcome" if word in get_args(steps.Outcome) else "remark"
    times = {"utc": head["utc"], "monotonic_s": 0.0}
    data = forged([head, {"kind": kind, "body": body, "host": NAME, **times}])
    path = made[0] / JOURNAL
    found = redacted(path, data, moment_of(head["utc"]))
    _, record = [json.loads(line) for line in found.splitlines()]
    assert record["host"] == record["body"]["not_known_yet"] == record["body"]["deep"][0]["er"] == REDACTED
    assert {name for name in texts if record["body"][name] == NAME} <= SAFE
    assert contents_of(path, found) is not None


def test_a_register_says_no_age_above_89_and_nobody_who_is_not_here(made: tuple[Path, Path, Archived]) -> None:
    found = raw(made[1] / "results" / "participants.jsonl")
    assert [(one["participant_id"], one["facts"]["age_years"]) for one in found] == [("P01", 89), ("P02", 25)]
    assert {one["utc"] for one in found} == {"2000-01-01T00:00:00.000000Z"}


# what verify finds


def test_a_changed_byte_anywhere_is_found_and_its_file_named(copy: Path) -> None:
    draw = random.Random(1)
    files = sorted(tree(copy))
    for path in [manifest.MANIFEST_FILE, *draw.sample(files, 24)]:
        before = (copy / path).read_bytes()
        place = draw.randrange(len(before))
        other = draw.choice([byte for byte in range(256) if byte != before[place]])
        (copy / path).write_bytes(before[:place] + bytes([other]) + before[place + 1 :])
        found = verify(copy)
        assert not found.whole
        assert path == manifest.MANIFEST_FILE or any(
            str(fault).startswith(f"{path}: changed") for fault in found.faults
        )
        (copy / path).write_bytes(before)
    assert manifest.read_manifest(copy).faults == ()


def _link(copy: Path) -> None:
    (copy / TRIALS).unlink()
    (copy / TRIALS).symlink_to(copy / "README.md")


def _link_of_a_folder(copy: Path) -> None:
    (copy / "bids").rename(copy.parent / "elsewhere")
    (copy / "bids").symlink_to(copy.parent / "elsewhere")


FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing file": (lambda copy: (copy / TRIALS).unlink(), f"{TRIALS}: missing"),
    "missing folder": (lambda copy: shutil.rmtree(copy / "bids"), "bids/README: missing"),
    "foreign file": (lambda copy: (copy / "results" / "notes.txt").write_text(""), "results/notes.txt: a foreign file"),
    "foreign folder": (lambda copy: (copy / "results" / "more").mkdir(), "results/more: a foreign folder"),
    "foreign name that is no text": (lambda copy: Path(os.fsdecode(os.fsencode(copy) + b"/\xff")).touch(), "a foreign"),
    "link": (_link, f"{TRIALS}: a link"),
    "link of a folder": (_link_of_a_folder, "bids: a link"),
    "special file": (lambda copy: os.mkfifo(copy / "pipe"), "pipe: a special file"),
    "folder for a file": (
        lambda copy: [(copy / TRIALS).unlink(), (copy / TRIALS).mkdir()],
        f"{TRIALS}: a foreign folder",
    ),
}


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("a\nb", r"a\nb"),
        ("a\r\tb", r"a\r\tb"),
        ("\x1b[2J", r"\x1b[2J"),
        ("a\u2028b", r"a\u2028b"),
        ("a\x85b", r"a\x85b"),
    ],
)
def test_a_foreign_name_of_several_lines_is_one_line_of_what_is_said(copy: Path, name: str, shown: str) -> None:
    (copy / "results" / name).touch()
    (fault,) = verify(copy).faults
    assert str(fault) == f"results/{shown}: a foreign file: the manifest does not list it"


def test_what_stands_in_a_changed_file_is_one_line_of_what_is_said(copy: Path) -> None:
    _edited(copy, "analysis/statistics.json", '"preference": {', '"a\\nforged: line": "x\\ny", "preference": {')
    (fault,) = verify(copy).faults
    assert r"a\nforged: line is x\ny in the archive" in str(fault)


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_not_as_it_was_archived_is_named(copy: Path, fault: str) -> None:
    change, said = FAULTS[fault]
    change(copy)
    found = verify(copy)
    assert any(str(one).startswith(said) for one in found.faults) or said in " ".join(map(str, found.faults))
    assert found.rebuilt == 0


def _edited(copy: Path, path: str, old: str, new: str) -> None:
    text = (copy / path).read_text()
    assert old in text
    (copy / path).write_text(text.replace(old, new, 1))
    sealed(copy)


def test_a_forger_who_writes_the_manifest_anew_is_found_by_the_journals(copy: Path) -> None:
    (table,) = [path for path in tree(copy) if path.endswith("sub-P02_task-direction_trials.csv")]
    text = (copy / table).read_text()
    answer = re.search(r",(\d\.\d+),synthetic", text)
    assert answer
    _edited(copy, table, answer[0], ",0.123,synthetic")
    _edited(copy, "analysis/preference_long.csv", "P03", "P99")
    statistics = json.loads((copy / "analysis/statistics.json").read_bytes())
    mean = statistics["preference"]["means"]["vibration"]
    _edited(copy, "analysis/statistics.json", f"{mean!r}", f"{mean + 1}")
    _edited(copy, "contents.csv", "P02,direction,1", "P02,direction,0")
    _edited(copy, "contents.csv", "P02,preference,1,finished", "P02,preference,1,not finished")
    placing.write_file(copy, "preregistration/preregistration-2.md", b"14 participants")
    sealed(copy)
    found = verify(copy)
    said = "\n".join(map(str, found.faults))
    assert "preregistration/preregistration-2.json: is missing" in said
    assert "contents.csv: P02, direction, finished: there is a journal, and no row" in said
    assert "contents.csv: P02, preference, not finished: there is a row, and no such journal" in said
    assert f"{table}: line " in said
    assert "analysis/preference_long.csv: line " in said
    assert f" is {mean + 1} in the archive, its journals make {mean!r}" in said


def test_a_journal_that_was_changed_is_named_with_its_line(copy: Path) -> None:
    _edited(copy, JOURNAL, '"kind":"outcome"', '"kind":"remark"')
    (fault,) = verify(copy).faults
    assert f"{JOURNAL}: line " in str(fault)


def test_a_table_that_no_journal_makes_is_named(copy: Path) -> None:
    shutil.copy(copy / "analysis" / "preference_long.csv", copy / "analysis" / "other.csv")
    sealed(copy)
    (fault,) = verify(copy).faults
    assert str(fault) == "analysis/other.csv: no journal of the archive makes it"


def test_the_verdict_names_the_files_and_which_recoil_made_them(copy: Path) -> None:
    statistics = json.loads((copy / "analysis" / "statistics.json").read_bytes())
    for method in ("asymmetric-1", "asymmetric-2"):
        mean = statistics["preference"]["means"][method]
        _edited(copy, "analysis/statistics.json", f"{mean!r}", f"{mean + 1}")
    found = verify(copy)
    assert len(found.faults) == 2
    but = "but 1 file is not what this Recoil makes of its journals: analysis/statistics.json"
    assert f"every file has the hash of the manifest, {but}; if another state of Recoil" in found.as_text()
    ours = statistics["versions"]["recoil"]
    _edited(copy, "analysis/statistics.json", f'"recoil": "{ours}"', '"recoil": "0.0.1"')
    assert f"Recoil 0.0.1 made the archive, and this is {ours}: verify it with that one" in verify(copy).as_text()


def test_the_verdict_counts_files_whatever_they_are_called(copy: Path) -> None:
    for name in ("a: b.csv", "a: c.csv"):
        shutil.copy(copy / "analysis" / "preference_long.csv", copy / "analysis" / name)
    sealed(copy)
    said = verify(copy).as_text()
    assert "but 2 files are not what this Recoil makes of its journals: analysis/a: b.csv, analysis/a: c.csv; " in said


def test_the_verdict_on_what_was_frozen_names_no_other_recoil(copy: Path) -> None:
    placing.write_file(copy, "preregistration/preregistration-2.md", b"14 participants")
    sealed(copy)
    found = verify(copy)
    faults = [*map(str, found.faults)]
    assert all(": is missing" in fault and fault.startswith("preregistration/") for fault in faults)
    assert found.as_text().endswith("but its preregistrations are not all there as they were frozen")
    assert plain(found)["faults"] == faults


@pytest.mark.parametrize(("by", "whole"), [(1e-13, True), (1e-6, False)])
def test_other_versions_may_differ_by_a_millionth_of_a_millionth(copy: Path, by: float, whole: bool) -> None:
    place = copy / "analysis" / "statistics.json"
    statistics = json.loads(place.read_bytes())
    mean = statistics["preference"]["means"]["asymmetric-2"]
    _edited(copy, "analysis/statistics.json", f"{mean!r}", f"{mean * (1 + by)!r}")
    assert not verify(copy).whole  # of the same versions every byte counts
    _edited(copy, "analysis/statistics.json", f'"numpy": "{statistics["versions"]["numpy"]}"', '"numpy": "1.0"')
    found = verify(copy)
    assert found.whole == whole
    said = "\n".join(map(str, found.remarks or found.faults))
    assert said.count("\n") == 0
    assert "preference.means.asymmetric-2 is" in said
    assert ("other versions" in said) == whole


def test_of_an_emptied_manifest_that_is_said_and_no_file_called_foreign(copy: Path) -> None:
    (copy / manifest.MANIFEST_FILE).write_text("")
    with pytest.raises(PlaceError, match=f"{manifest.MANIFEST_FILE} is empty, so nothing vouches"):
        verify(copy)


def test_an_archive_without_its_manifest_is_none(copy: Path) -> None:
    (copy / manifest.MANIFEST_FILE).rename(copy / "other.txt")
    with pytest.raises(
        PlaceError, match=rf"no archive of Recoil, or not a whole one: {manifest.MANIFEST_FILE} is not there"
    ):
        verify(copy)
    (copy / manifest.MANIFEST_FILE).symlink_to("other.txt")
    with pytest.raises(PlaceError, match="is no plain file"):
        verify(copy)


@pytest.mark.parametrize("content", ["[]", "NaN", '{"sha256": 1e999}', '"text"'])
@pytest.mark.parametrize("path", ["preregistration/preregistration-1.json", "archive.json", "analysis/statistics.json"])
def test_a_file_that_is_no_json_object_is_a_fault_of_the_archive(copy: Path, path: str, content: str) -> None:
    placing.write_file(copy, path, content.encode())
    sealed(copy)
    assert any(f"{path}: " in str(fault) for fault in verify(copy).faults)


@pytest.mark.parametrize("version", ["NaN", "1e999"])
def test_versions_that_are_no_numbers_are_a_fault_of_the_archive(copy: Path, version: str) -> None:
    _edited(copy, "analysis/statistics.json", '"versions": {', f'"versions": {{"numpy-like": {version},')
    (fault,) = verify(copy).faults
    assert f"{version} is no number of JSON" in str(fault)


def test_settings_that_say_nothing_are_named(copy: Path) -> None:
    (copy / "archive.json").write_text("[]")
    sealed(copy)
    (fault, *_) = verify(copy).faults
    assert "archive.json" in str(fault)


# where it is put


def test_what_is_there_is_never_overwritten(made: tuple[Path, Path, Archived], tmp_path: Path) -> None:
    study, archive, _ = made
    before = tree(archive)
    with pytest.raises(PlaceError, match="is there already, and no archive is overwritten"):
        archive_export.export_archive(ArchiveRequest(folder=study, out=archive))
    with pytest.raises(PlaceError, match="whose logs would then be read twice"):
        archive_export.export_archive(ArchiveRequest(folder=study, out=study / "results" / "archive"))
    with pytest.raises(PlaceError, match="whose logs would then be read twice"):
        archive_export.export_archive(ArchiveRequest(folder=study / "results", out=study / "archive"))
    with pytest.raises(PlaceError, match="lies in the archive"):
        archive_export.export_archive(ArchiveRequest(folder=study, out=archive / "inner"))
    assert tree(archive) == before


@pytest.mark.usefixtures("disk_that_fills")
def test_a_disk_that_fills_leaves_nothing(made: tuple[Path, Path, Archived], tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No space left"):
        archive_export.export_archive(ArchiveRequest(folder=made[0], out=tmp_path / "archive"))
    assert list(tmp_path.iterdir()) == []


def test_a_register_that_cannot_be_trusted_ends_it(made: tuple[Path, Path, Archived], tmp_path: Path) -> None:
    shutil.copytree(made[0], tmp_path / "study")
    (tmp_path / "study" / "results" / "participants.jsonl").write_text("{}\n")
    with pytest.raises(RegisterError, match="someone might be excluded"):
        archive_export.export_archive(ArchiveRequest(folder=tmp_path / "study", out=tmp_path / "archive"))
    assert not (tmp_path / "archive").exists()


def test_logs_that_no_journal_proves_are_no_archive(tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 2)
    with pytest.raises(PlaceError, match="no run has a journal that proves its table"):
        archive_export.export_archive(ArchiveRequest(folder=logs, out=tmp_path / "archive"))


# as its users call it


def test_the_commands(recoil: Recoil, made: tuple[Path, Path, Archived], tmp_path: Path) -> None:
    study = made[0]
    shutil.copytree(study, tmp_path / "study", ignore=shutil.ignore_patterns("sub-P0[345]", "*direction*"))
    for name in ("direction.toml", "study.toml"):
        shutil.copy(study / name, tmp_path / "study")
    (tmp_path / "study" / "CITATION.cff").write_text("cff-version: 1.2.0\n")
    done = recoil("export", "archive", "study", "--json")
    assert done.returncode == 0, done
    told = json.loads(done.stdout)
    assert (told["participants"], told["runs"]) == (2, 2)
    assert (tmp_path / "study-archive" / "CITATION.cff").read_text() == "cff-version: 1.2.0\n"
    refused(recoil("export", "archive", "study"), "study-archive: is there already")
    done = recoil("verify", "study-archive", "--json")
    assert done.returncode == 0, done
    assert json.loads(done.stdout)["manifest_sha256"] == told["manifest_sha256"]
    (tmp_path / "study-archive" / "README.md").unlink()
    done = recoil("verify", "study-archive")
    assert done.returncode == 1, done
    assert "recoil: README.md: missing" in done.stderr
    refused(recoil("verify", "study"), "is no archive of Recoil")


def test_what_came_to_the_place_of_an_archive_meanwhile_stays_there(tmp_path: Path) -> None:
    target = tmp_path / "archive"

    def check() -> None:
        if not placing.is_free(target):
            raise PlaceError("is there already")

    def fill() -> None:
        with placing.in_place(target, check) as part:
            placing.write_file(part, "README.md", b"ours")
            placing.write_file(target, "thesis.txt", b"theirs")

    with pytest.raises(PlaceError, match="is there already"):
        fill()
    assert [path.name for path in tmp_path.rglob("*")] == ["archive", "thesis.txt"]


def test_an_export_keeps_the_unfinished_folder_of_another_that_is_at_work(tmp_path: Path) -> None:
    one, left_over = tmp_path / "one", tmp_path / ".one.part-killed"
    left_over.mkdir()
    with placing.in_place(one, list) as first:
        placing.write_file(first, "first", b"")
        with placing.in_place(one, list) as second:
            placing.write_file(second, "second", b"")
            assert (first / "first").exists()
        assert not left_over.exists()
    assert [path.name for path in one.iterdir()] == ["first"]
