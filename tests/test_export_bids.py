"""`recoil export bids` as its users call it, judged by the official validator without a network and an empty home."""

from __future__ import annotations

import csv
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from analysis.archive import bids
from analysis.archive import bids_export as feature
from analysis.logs.reading import read_logs
from analysis.report import placing
from experiments.clock import RealClock, VirtualClock
from experiments.load import load_setup, shipped_folder
from experiments.record import tables
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.folders import PlaceError
from experiments.study.new_study import new_study
from experiments.study.register import append, entry
from tests.bids_validator import validated
from tests.conftest import RECOIL, Recoil, refused
from tests.log_files import rating_rows, ratings_path, tree, trial_rows, trials_path, write_rows, write_study
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

KNOWN_TO_PEOPLE_ALONE = {
    "Authors",
    "License",
    "HEDVersion",
    "SourceDatasets",
    "Instructions",
    "CogAtlasID",
    "CogPOID",
    "InstitutionName",
    "InstitutionAddress",
    "InstitutionalDepartmentName",
}
"""What BIDS recommends and no program knows; nothing of it is invented."""
NASTY = '=1+1\t"open\r\nsecond line, Müller'


BREAKS = {
    "sub-P01/beh/sub-P01_task-direction_beh.tsv": ("\tcorrect\t", "\tright\t", "TSV_ADDITIONAL_COLUMNS_UNDEFINED"),
    "sub-P02/beh/sub-P02_task-direction_beh.tsv": ("\tsynthetic\t", "\trobot\t", "TSV_VALUE_INCORRECT_TYPE"),
    "sub-Z9/beh/sub-Z9_task-direction_beh.tsv": ("n/a", "", "TSV_VALUE_INCORRECT_TYPE"),
    "sub-Z9/beh/sub-Z9_task-preference_beh.tsv": ("\t0.0\t", "\t10.5\t", "TSV_VALUE_INCORRECT_TYPE"),
    "participants.tsv": ("\t89\t", "\t94\t", "TSV_VALUE_INCORRECT_TYPE"),
}
"""What is changed by hand in which file, and what the validator calls it: a wrong column, level, blank, range, age."""


def beyond_people(issues: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The issues that are not about facts which people alone know."""
    return [
        issue
        for issue in issues
        if issue["severity"] == "error"
        or not (issue["code"] == "TOO_FEW_AUTHORS" or issue.get("subCode") in KNOWN_TO_PEOPLE_ALONE)
    ]


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both experiments by two synthetic participants, as a reproduction has them, and by one person with a free pen."""
    results = tmp_path_factory.mktemp("real") / "results"
    for name in ("direction", "preference"):
        setup = load_setup(str(shipped_folder() / f"{name}.toml"))
        for code in ("P01", "P02"):
            sensor = "simulated" if (name, code) == ("direction", "P01") else ""
            request = RunRequest(setup=setup, participant_id=code, results=results, sensor=sensor)
            run(request, synthetic_screen, VirtualClock())
    trials = [row | {"response_source": "participant", "flags": "late"} for row in trial_rows("Z9")]
    trials[0] |= {"response": "", "correct": "", "response_time_s": "", "response_source": "", "attempts": ""}
    trials[1] |= {"note": NASTY, "onset_utc": "2026-03-01T09:30:00.250000Z"}
    trials[2] |= {"onset_utc": "2026-03-01T09:30:17.500000Z", "gun": "RG-2 0007", "instruction": "speed"}
    ratings = [row | {"rating_by": "participant"} for row in rating_rows("Z9")]
    ratings[0] |= {"rating": "0", "comment": NASTY}
    write_rows(trials_path(results, "Z9"), trials)
    write_rows(ratings_path(results, "Z9"), ratings)
    facts = {
        "P01": {"age_years": 25, "sex": "female", "handedness": "right"},
        "P02": {"age_years": 30, "sex": "undisclosed", "handedness": "left"},
        "Z9": {"age_years": 94, "sex": "male", "handedness": "both"},
    }
    for code, known in facts.items():
        append(results, entry("joined", code, facts=known), RealClock())
    return results


@pytest.fixture(scope="module")
def exported(real: Path) -> Path:
    """The data set made of it, to look at."""
    feature.export(real, real.parent / "bids", include_synthetic=True)
    return real.parent / "bids"


def table(folder: Path, path: str) -> list[dict[str, str]]:
    with (folder / path).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream, delimiter="\t", quoting=csv.QUOTE_NONE, lineterminator="\n"))


# what the validator says


def test_the_official_validator_finds_only_what_people_must_fill_in(recoil: Recoil, real: Path, tmp_path: Path) -> None:
    for more in (["--include-synthetic"], ["--include-synthetic", "--free-text"]):
        done = recoil("export", "bids", real, "--out", "bids", *more)
        assert done.returncode == 1, done
        assert "2 of 6 logs have no journal beside them, as the others have, so nothing proves them: Z9" in done.stderr
        assert beyond_people(validated(tmp_path / "bids")) == []


def test_what_breaks_a_data_set_is_noticed_by_the_validator(exported: Path, tmp_path: Path) -> None:
    shutil.copytree(exported, tmp_path / "bids")
    for path, (old, new, _) in BREAKS.items():
        file = tmp_path / "bids" / path
        assert old in file.read_text()
        file.write_text(file.read_text().replace(old, new))
    found = beyond_people(validated(tmp_path / "bids"))
    for path, (_, _, code) in BREAKS.items():
        assert code in {issue["code"] for issue in found if issue["location"] == f"/{path}"}, path
    assert len({issue["location"] for issue in found}) >= len(BREAKS)


# what stands in it


def test_the_tables_hold_what_the_logs_hold(exported: Path, real: Path) -> None:
    for code in ("P01", "Z9"):
        for experiment, log in (("direction", trials_path(real, code)), ("preference", ratings_path(real, code))):
            path = exported / f"sub-{code}" / "beh" / f"sub-{code}_task-{experiment}_beh.tsv"
            found = pd.read_csv(path, sep="\t", na_values=["n/a"], keep_default_na=False)
            found = found.rename(columns={"response_time": "response_time_s"}).drop(columns="onset")
            expected = pd.read_csv(log, na_values=[""], keep_default_na=False)
            assert set(expected) - set(found) == {"participant_id", "experiment", "onset_utc"} | (
                {"note", "comment"} & set(expected)
            )
            lacking = [name for name in found if name not in expected]
            assert set(lacking) <= set(tables.MAY_LACK)
            assert found[lacking].isna().all(axis=None)
            found = found.drop(columns=lacking)
            pd.testing.assert_frame_equal(found, expected[list(found)], check_dtype=False)


def test_what_a_sensor_measured_is_one_event_a_shot(exported: Path, real: Path) -> None:
    (path,) = exported.rglob("*_events.tsv")
    found = table(exported, f"sub-P01/beh/{path.name}")
    trials = table(exported, "sub-P01/beh/sub-P01_task-direction_beh.tsv")
    assert [row["onset"] for row in found] == [row["onset"] for row in trials]
    with (real / "sub-P01" / "sub-P01_task-direction_shots.csv").open(encoding="utf-8", newline="") as stream:
        shots = list(csv.DictReader(stream))
    peaks = [float(row["delivered_peak_m_s2"]) for row in shots]
    assert [float(row["delivered_peak_m_s2"]) for row in found] == peaks
    assert "sensor" not in found[0]  # it may name a folder of somebody's


def test_missing_is_na_and_zero_is_a_value(exported: Path) -> None:
    first = table(exported, "sub-Z9/beh/sub-Z9_task-direction_beh.tsv")[0]
    assert (first["response"], first["correct"], first["response_time"], first["attempts"]) == ("n/a",) * 4
    assert table(exported, "sub-Z9/beh/sub-Z9_task-preference_beh.tsv")[0]["rating"] == "0.0"


def test_what_the_participant_was_told_is_in_the_data_set(exported: Path) -> None:
    told = [row["instruction"] for row in table(exported, "sub-Z9/beh/sub-Z9_task-direction_beh.tsv")]
    assert told[:4] == ["n/a", "n/a", "speed", "n/a"]


def test_onset_counts_from_the_first_pulse_and_no_date_is_told(exported: Path) -> None:
    rows = table(exported, "sub-Z9/beh/sub-Z9_task-direction_beh.tsv")
    assert [row["onset"] for row in rows[:4]] == ["n/a", "0.0", "17.25", "n/a"]
    dated = [path for path, data in tree(exported).items() if re.search(rb"\d{4}-\d\d-\d\d|\d\d:\d\d", data)]
    assert dated == []


def test_participants_have_the_facts_of_the_register_in_the_words_of_bids(exported: Path) -> None:
    assert (exported / "participants.tsv").read_text() == (
        "participant_id\tspecies\tage\tsex\thandedness\tsynthetic\n"
        "sub-P01\tn/a\t25\tfemale\tright\ttrue\n"
        "sub-P02\tn/a\t30\tn/a\tleft\ttrue\n"
        "sub-Z9\thomo sapiens\t89\tmale\tambidextrous\tfalse\n"
    )
    assert "3 participants, 2 of them synthetic" in (exported / "README").read_text()


def test_without_a_register_the_facts_are_missing(tmp_path: Path) -> None:
    write_rows(ratings_path(tmp_path / "logs", "P01"), rating_rows())
    feature.export(tmp_path / "logs", tmp_path / "logs" / "bids")
    only = table(tmp_path / "logs" / "bids", "participants.tsv")
    assert [(row["age"], row["sex"], row["handedness"]) for row in only] == [("n/a", "n/a", "n/a")]
    assert not (tmp_path / "logs" / "bids" / "task-direction_beh.json").exists()


def test_free_text_is_left_out_unless_asked_for(exported: Path, real: Path, tmp_path: Path) -> None:
    assert not [path for path, data in tree(exported).items() if "Müller".encode() in data]
    feature.export(real, tmp_path / "bids", free_text=True)
    cell = "'=1+1 'open second line, Müller"
    assert table(tmp_path / "bids", "sub-Z9/beh/sub-Z9_task-preference_beh.tsv")[0]["comment"] == cell
    assert table(tmp_path / "bids", "sub-Z9/beh/sub-Z9_task-direction_beh.tsv")[1]["note"] == cell
    assert "comment" in json.loads((tmp_path / "bids" / "task-preference_beh.json").read_text())


def test_the_description_invents_no_people(exported: Path) -> None:
    description = json.loads((exported / "dataset_description.json").read_text())
    assert set(description) == {"Name", "BIDSVersion", "DatasetType", "GeneratedBy"}
    assert description["DatasetType"] == "raw"
    assert description["GeneratedBy"][0]["Name"] == "Recoil"


def test_a_studys_title_is_the_data_sets_name(tmp_path: Path) -> None:
    new_study(tmp_path / "pilot")
    write_rows(ratings_path(tmp_path / "pilot" / "results", "P01"), rating_rows())
    for folder in ("pilot", "pilot/results"):
        feature.export(tmp_path / folder, tmp_path / folder / "set")
        description = json.loads((tmp_path / folder / "set" / "dataset_description.json").read_text())
        assert description["Name"] == "Recoil by asymmetric force: direction and preference"


def test_every_column_and_level_of_the_logs_has_its_words() -> None:
    assert set(bids.TASKS) == set(tables.TABLES)
    for column in (column for table in tables.TABLES.values() for column in table):
        described = bids.described(column, column.name)
        assert described["LongName"]
        assert described["Description"]
        assert list(described.get("Levels", {})) == list(column.levels)
        assert not re.search(r"\bempty\b|`", described["Description"])


@pytest.mark.parametrize("text", [NASTY, "\x00\x1b[31m\u2028x", '"', "\t\r\n", "a\x85b\x0bc"])
def test_text_stays_in_its_cell(text: str) -> None:
    assert not set(bids.one_line(text)) & set('\t\r\n\x0b\x85\u2028\x00\x1b"')


def test_json_gives_the_counts(recoil: Recoil, real: Path) -> None:
    done = recoil("export", "bids", real, "--out", "bids", "--include-synthetic", "--json")
    counts = json.loads(done.stdout)
    assert "2 of 6 logs have no journal" in counts.pop("remarks")[0]
    assert counts == {
        "out": "bids",
        "bids_version": "1.11.1",
        "participants": 3,
        "synthetic": 2,
        "runs": {"direction": 3, "preference": 3},
        "rows": {"direction": 180, "preference": 9},
        "files": 14,
        "left_out": [],
        "begun": [],
    }


def test_the_data_set_is_for_its_owner_alone(recoil: Recoil, real: Path, tmp_path: Path) -> None:
    recoil("export", "bids", real, "--out", "new/bids", "--include-synthetic")
    made = [tmp_path / "new", *(tmp_path / "new").rglob("*")]
    assert len(made) > 12
    assert all(path.stat().st_mode & 0o077 == 0 for path in made)


# what is left out


def test_synthetic_logs_beside_a_persons_are_left_out_unless_asked_for(
    recoil: Recoil, real: Path, tmp_path: Path
) -> None:
    done = recoil("export", "bids", real, "--out", "bids")
    assert (done.returncode, done.stderr.count("is of synthetic participants, beside logs of people at a gun")) == (
        1,
        4,
    )
    assert [row["participant_id"] for row in table(tmp_path / "bids", "participants.tsv")] == ["sub-Z9"]


def test_broken_logs_are_listed_and_the_rest_is_exported(recoil: Recoil, tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 3)
    trials_path(logs, "P02").write_text("not a log\n")
    write_rows(ratings_path(logs, "p01"), rating_rows("p01"))
    write_rows(trials_path(logs, "p03"), trial_rows("p03"))
    trials_path(logs, "P03").unlink()
    rows = [row | {"onset_utc": "soon"} for row in rating_rows("P02")]
    write_rows(ratings_path(logs, "P02"), rows)
    done = recoil("export", "bids", "logs", "--json")
    assert done.returncode == 1
    assert "sub-P02_task-direction_trials.csv, line 1" in done.stderr
    assert "'P01'" in done.stderr
    assert "sub-P02_task-preference_ratings.csv, line 2, column onset_utc: 'soon' is no date and time" in done.stderr
    counts = json.loads(done.stdout)
    assert len(counts["left_out"]) == 4
    assert (counts["participants"], counts["runs"]) == (2, {"direction": 2, "preference": 1})
    assert beyond_people(validated(logs / "bids")) == []


def test_who_is_excluded_is_left_out_and_their_reason_too(recoil: Recoil, tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 2)
    append(logs, entry("excluded", "P02", reason="fell asleep"), RealClock())
    done = recoil("export", "bids", "logs")
    assert done.returncode == 1
    assert done.stderr.count("participant P02 is excluded: fell asleep") == 2
    assert not any(b"P02" in data or "P02" in path or b"asleep" in data for path, data in tree(logs / "bids").items())


def test_nothing_is_exported_while_a_register_cannot_be_trusted(recoil: Recoil, tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 1)
    (logs / "participants.jsonl").write_text("damage\n")
    refused(recoil("export", "bids", "logs"), "participants.jsonl: line 1", "someone might be excluded")
    assert not (logs / "bids").exists()


def test_no_usable_log_is_2(recoil: Recoil, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    trials_path(tmp_path / "bad", "P01").parent.mkdir(parents=True)
    trials_path(tmp_path / "bad", "P01").write_text("not a log\n")
    refused(recoil("export", "bids", "bad"), "no usable log in bad", "sub-P01_task-direction_trials.csv, line 1")
    for folder, said in (("empty", "no usable log in .*empty"), ("nowhere", "nowhere: no such folder")):
        with pytest.raises(PlaceError, match=said):
            feature.export(tmp_path / folder, tmp_path / folder / "bids")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad", "empty", "home"]
    assert list((tmp_path / "empty").iterdir()) == []


def test_several_studies_are_not_mixed(tmp_path: Path) -> None:
    for site in ("kyoto", "oslo"):
        write_study(tmp_path / site / "results", 1)
    with pytest.raises(PlaceError, match=r"several studies \(.*kyoto/results, .*oslo/results\); export each by itself"):
        feature.export(tmp_path, tmp_path / "bids")
    feature.export(tmp_path / "oslo", tmp_path / "bids")
    assert table(tmp_path / "bids", "participants.tsv")[0]["participant_id"] == "sub-P01"


def test_practice_is_not_exported(tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 1)
    log = trials_path(logs, "P01")
    log.with_name("sub-P01_task-direction_practice_trials.csv").write_bytes(log.read_bytes())
    assert feature.export(logs, logs / "bids").left_out == ()


# where it goes


def test_an_earlier_export_is_replaced_and_is_no_log(tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 2)
    for _ in range(2):
        assert feature.export(logs, logs / "bids").left_out == ()
    trials_path(logs, "P02").unlink()
    ratings_path(logs, "P02").unlink()
    assert feature.export(logs, logs / "bids").participants == 1
    assert not (logs / "bids" / "sub-P02").exists()
    assert not [path for path in logs.iterdir() if path.name.startswith(".")]
    assert len(read_logs([logs]).files) == 2


def test_what_people_filled_in_stays(real: Path, tmp_path: Path) -> None:
    feature.export(real, tmp_path / "bids", free_text=True)
    given = {
        "dataset_description.json": {"Name": "Kicks", "Authors": ["A. Person", "B. Person"], "BIDSVersion": "0"},
        "task-direction_beh.json": {"Instructions": "Say where it kicked.", "note": {"Description": "old"}},
    }
    for path, values in given.items():
        file = tmp_path / "bids" / path
        file.write_text(json.dumps(json.loads(file.read_text()) | values))
    feature.export(real, tmp_path / "bids")
    description = json.loads((tmp_path / "bids" / "dataset_description.json").read_text())
    assert (description["Name"], description["Authors"]) == ("Kicks", ["A. Person", "B. Person"])
    assert description["BIDSVersion"] == "1.11.1"
    sidecar = json.loads((tmp_path / "bids" / "task-direction_beh.json").read_text())
    assert sidecar["Instructions"] == "Say where it kicked."
    assert "note" not in sidecar


@pytest.mark.parametrize("path", ["derivatives/model.tsv", ".git/HEAD", "sub-P01/beh/notes.txt", "LICENSE"])
def test_an_export_that_others_have_added_to_is_refused(tmp_path: Path, path: str) -> None:
    logs = write_study(tmp_path / "logs", 1)
    feature.export(logs, logs / "bids")
    added = logs / "bids" / path
    added.parent.mkdir(parents=True, exist_ok=True)
    added.write_text("theirs")
    before = tree(logs / "bids")
    with pytest.raises(PlaceError, match=f"holds what no export wrote.*{path.split('/', maxsplit=1)[0]}"):
        feature.export(logs, logs / "bids")
    assert tree(logs / "bids") == before


@pytest.mark.parametrize("description", ["{}", '{"GeneratedBy": [{"Name": "fMRIPrep"}]}', "[1]", "damage"])
def test_a_folder_that_is_no_export_is_refused(tmp_path: Path, description: str) -> None:
    logs = write_study(tmp_path / "logs", 1)
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "dataset_description.json").write_text(description)
    for out in (tmp_path / "theirs", logs, logs / "sub-P01", trials_path(logs, "P01")):
        with pytest.raises(PlaceError, match="exists and is no data set"):
            feature.export(logs, out)
    assert (tmp_path / "theirs" / "dataset_description.json").read_text() == description
    assert len(tree(logs)) == 2


def test_a_target_that_is_no_export_is_2(recoil: Recoil, tmp_path: Path) -> None:
    write_study(tmp_path / "logs", 1)
    refused(recoil("export", "bids", "logs", "--out", "logs"), "logs: exists and is no data set", "--out")


def test_an_empty_folder_and_a_link_to_one_are_filled(tmp_path: Path) -> None:
    logs = write_study(tmp_path / "logs", 1)
    (tmp_path / "disk" / "bids").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "disk" / "bids")
    for _ in range(2):
        feature.export(logs, tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "disk" / "bids" / "participants.tsv").exists()


def test_where_two_names_cannot_be_exchanged_the_old_one_is_set_aside_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = write_study(tmp_path / "logs", 1)
    monkeypatch.setattr(placing, "_exchange", lambda *_: False)
    for _ in range(2):
        feature.export(logs, logs / "bids")
    assert sorted(path.name for path in logs.iterdir()) == ["bids", "sub-P01"]
    assert "sub-P01" in (logs / "bids" / "participants.tsv").read_text()


def test_a_disk_that_fills_leaves_the_earlier_export(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    logs = write_study(tmp_path / "logs", 1)
    feature.export(logs, logs / "bids")
    before = tree(logs)
    write_study(logs, 2)
    request.getfixturevalue("disk_that_fills")
    with pytest.raises(OSError, match="No space left"):
        feature.export(logs, logs / "bids")
    assert {path: data for path, data in tree(logs).items() if path.startswith(("bids", "."))} == {
        path: data for path, data in before.items() if path.startswith("bids")
    }


@pytest.mark.skipif(shutil.which("strace") is None, reason="needs strace")
@pytest.mark.parametrize(
    ("call", "when", "there"),
    [
        pytest.param("fsync", 20, "old", marks=pytest.mark.soak),
        ("renameat2", 1, "old"),
        pytest.param("unlinkat", 1, "new", marks=pytest.mark.soak),
    ],
)
def test_a_kill_leaves_the_old_data_set_or_the_new_one(
    recoil: Recoil, tmp_path: Path, call: str, when: int, there: str
) -> None:
    """Killed in the middle of writing, at the exchange of the two, and before the old one is deleted."""
    logs = write_study(tmp_path / "logs", 3)
    wholes = {}
    for name, free_text in (("new", True), ("old", False)):
        feature.export(logs, logs / "bids", free_text=free_text)
        wholes[name] = tree(logs / "bids")
    assert wholes["old"] != wholes["new"]
    kill = ["strace", "-qq", "-f", "-e", f"trace={call}", "-e", f"inject={call}:signal=KILL:when={when}"]
    words = [*kill, "-o", "trace", RECOIL, "export", "bids", "logs", "--free-text"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == -9, done
    assert tree(logs / "bids") == wholes[there]
    assert parts(logs)
    assert recoil("export", "bids", "logs", "--free-text").returncode == 0
    assert tree(logs / "bids") == wholes["new"]
    assert not parts(logs)


def parts(folder: Path) -> list[Path]:
    """What exports write before it is put in its place."""
    return [path for path in folder.iterdir() if path.name.startswith(".bids.part-")]


def test_help_says_what_the_folder_and_the_target_are(recoil: Recoil) -> None:
    assert "bids" in recoil("export", "--help").stdout
    text = recoil("export", "bids", "--help").stdout
    assert "DIR/bids" in text
    assert "--free-text" in text
