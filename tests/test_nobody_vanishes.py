"""Whoever is left out is named, with the rule and the remedy: on the terminal, in the report and in the statistics."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from analysis.archive.archive_export import ArchiveRequest, export_archive
from analysis.logs.exclusions import IN_NO_TEST, LeftOut
from analysis.logs.journals import gone
from analysis.logs.reading import read_logs
from analysis.logs.setups import SetupOfLog, changed_setups
from analysis.summary.analyze import Request, analyze, with_everybody
from analysis.summary.participation import PersonInExperiment, exclusion_lines
from analysis.summary.summary import summarize
from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.record.rebuild import rebuild_table
from experiments.record.tables import DataKind
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study import register
from experiments.study.folders import place, set_aside
from tests.conftest import Recoil, refused
from tests.lies import journal, lines, table
from tests.log_files import rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study


class LaterClock(VirtualClock):
    """A virtual clock whose date and time go back by ten days when it is told so."""

    def __init__(self, back: timedelta = timedelta()) -> None:
        super().__init__()
        self._start = datetime(2026, 3, 11, 9, tzinfo=UTC) - back

    def go_on_after(self, utc: str) -> None:
        pass


def ran(folder: Path, code: str = "P01", config: str = "preference", **how: object) -> None:
    asked = RunRequest(setup=load_setup(config), participant_id=code, results=folder, seed=1, **how)  # type: ignore[arg-type]
    run(asked, synthetic_screen, LaterClock())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("experiment", "heading"),
    [("direction", "Direction recognition"), ("realism", "Realism and comfort by damper and voltage")],
)
def test_a_gun_that_was_changed_within_a_study_is_told_on_top_and_beside_the_numbers(
    experiment: str, heading: str, quick_configs: Path, recoil: Recoil, tmp_path: Path
) -> None:
    config = quick_configs / f"{experiment}.toml"
    for code in ("P01", "P02", "P03"):
        ran(tmp_path / "results", code, str(config))
    assert [one for one in read_logs([tmp_path / "results"]).remarks if "setups" in one.message] == []
    gun = quick_configs / "gun.toml"
    gun.write_text(gun.read_text().replace("voltage_V = 16.0", "voltage_V = 12.0"))
    ran(tmp_path / "results", "P04", str(config))
    (told,) = (one for one in read_logs([tmp_path / "results"]).remarks if "setups" in one.message)
    assert (
        f"4 runs of {experiment} were made with 2 setups {WHAT} and count together: P01, P02, P03 with one, "
        "P04 with gun voice_coil.voltage_V = 12.0, not 16.0;" in told.message
    )
    done = recoil("analyze", "results", "--out", "out")
    assert (done.returncode, "were made with 2 setups" in done.stderr) == (1, True)
    page = (tmp_path / "out" / "report.md").read_text()
    said = f"4 runs of {experiment} were made with 2 setups {WHAT} and count together: P01, P02, P03 with one"
    results, section, paper = "\n## Results\n", f"\n## {heading}\n", "\n## For your paper\n"
    for part in (results, section, paper):
        assert said in page.partition(part)[2].partition("\n## ")[0], part


WHAT = "(config, gun and synthetic participants)"


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["direction", "realism"])
def test_runs_of_other_synthetic_participants_are_made_with_another_setup(
    experiment: str, quick_configs: Path, tmp_path: Path
) -> None:
    config, laws = quick_configs / f"{experiment}.toml", quick_configs / "synthetic" / f"{experiment}.toml"
    for code in ("P01", "P02"):
        ran(tmp_path / "results", code, str(config))
    laws.write_text(f"exposure_s = 4.25\n{laws.read_text()}")
    ran(tmp_path / "results", "P03", str(config))
    (told,) = (one for one in read_logs([tmp_path / "results"]).remarks if "setups" in one.message)
    assert told.message.startswith(
        f"3 runs of {experiment} were made with 2 setups {WHAT} and count together: P01, P02 with one, P03 with "
        "synthetic exposure_s = 4.25, not 5.0; "
    )


def test_of_very_many_setups_a_few_are_told_and_where_the_others_are() -> None:
    logs = [
        SetupOfLog(study="a", kind="real", experiment="direction", code=f"P{n:03}", path=f"P{n}.csv", setup=f"{n}")
        for n in range(1, 121)
    ]
    (told,) = changed_setups(logs)
    assert "120 runs of direction were made with 120 setups" in told.message
    assert "and 116 runs with 116 other setups, which the first line of each journal holds" in told.message
    assert len(told.message) < 600


def test_data_of_two_kinds_do_not_count_together_whatever_their_setups() -> None:
    kinds: tuple[DataKind, ...] = ("real", "real", "synthetic")
    logs = [
        SetupOfLog(study="a", kind=kind, experiment="direction", code=f"P{n}", path=f"P{n}.csv", setup=f"{n // 2}")
        for n, kind in enumerate(kinds)
    ]
    assert changed_setups(logs) == []
    (told,) = changed_setups([*logs, replace(logs[0], setup="2", code="P9")])
    assert (
        "3 runs of direction were made with 2 setups (config and gun) and count together: P0, P1 with one, P9 with"
        in (told.message)
    )


def broken_off(folder: Path, code: str, records: int) -> Path:
    """A run that has begun: the head and so many records more of a finished one, and no table."""
    ran(folder, code)
    path = journal(folder, "preference", code)
    lines(path, lambda found: found.__delitem__(slice(records, None)))
    table(folder, "preference", code).unlink()
    return path


@pytest.mark.slow
def test_unanswered_trials_are_told_with_everybody_and_the_remedy(recoil: Recoil, tmp_path: Path) -> None:
    results = write_study(tmp_path / "results", participants=4)
    for code, missing in (("P02", 1), ("P04", 2)):
        rows = trial_rows(code, missing)
        for row in rows[:missing]:
            row.update(response="", correct="")
        write_rows(trials_path(results, code), rows)
    done = recoil("analyze", results, "--out", tmp_path / "out")
    assert done.returncode == 1
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("recoil: left out"))
    assert "left out of direction: 2 participants (rule: every trial is answered): P02 (1 of 60 trials" in line
    assert "P04 (2 of 60 trials unanswered); `drop_unanswered = true` under [trials]" in line
    found = json.loads((tmp_path / "out" / "statistics.json").read_text(encoding="utf-8"))
    assert [one["participant"] for one in found["excluded"]] == ["P02", "P04"]
    assert all(one["rule"] and "drop_unanswered" in one["remedy"] for one in found["excluded"])
    report = (tmp_path / "out" / "report.md").read_text(encoding="utf-8").replace("\\", "")
    assert "P02" in report
    assert "drop_unanswered" in report


@pytest.mark.slow
def test_who_is_excluded_by_hand_and_has_no_run_is_not_waited_for(tmp_path: Path) -> None:
    results = write_study(tmp_path, participants=2)
    for code in ("P03", "P04"):
        register.append(results, register.entry("joined", code, facts={}), VirtualClock())
    register.append(results, register.entry("excluded", "P03", reason="came by mistake"), VirtualClock())
    logs = read_logs([results])
    found = with_everybody(summarize(logs), logs).participation
    assert found is not None
    assert [one.not_done for one in found.experiments.values()] == [1, 1]
    assert {one.participant: one.state for one in found.absent} == {
        "P03": "excluded by hand, and not done",
        "P04": "not done",
    }


@pytest.mark.slow
def test_everybody_is_counted_in_every_experiment(tmp_path: Path) -> None:
    results = write_study(tmp_path, participants=2)
    trials_path(results, "P02").write_bytes(b"participant_id\r\n")
    broken_off(results, "P03", 9)
    ran(results, "P04", "direction", practice=True)
    register.append(results, register.entry("joined", "P05", facts={}), VirtualClock())
    logs = read_logs([results])
    found = with_everybody(summarize(logs), logs).participation
    assert found is not None
    direction, preference = found.experiments["direction"], found.experiments["preference"]
    assert (direction.analysed, direction.left_out, direction.not_done, direction.practices) == (1, 1, 3, 1)
    assert (preference.analysed, preference.begun, preference.not_done, preference.set_aside) == (2, 1, 2, 0)
    assert PersonInExperiment(participant="P05", experiment="preference", state="not done") in found.absent
    assert any(one.participant == "P03" and one.state.startswith("begun: ") for one in found.absent)
    assert sum(one.participant == "P01" for one in found.absent) == 0


@pytest.mark.slow
def test_a_finished_run_without_its_table_is_analysed_exported_and_named(recoil: Recoil, tmp_path: Path) -> None:
    results = tmp_path / "results"
    for code in ("P01", "P02"):
        ran(results, code)
    whole = summarize(read_logs([results])).to_dict()
    table(results, "preference").unlink()
    assert summarize(read_logs([results])).to_dict() == whole
    said = "its table is missing, so it was made again from this journal; `recoil rebuild"
    for words in (("analyze", results, "--out", tmp_path / "out"), ("export", "bids", results)):
        done = recoil(*words)
        assert (done.returncode, said in done.stderr) == (1, True)
    assert (results / "bids" / "sub-P01" / "beh" / "sub-P01_task-preference_beh.tsv").exists()
    study = recoil("study", results)
    assert study.returncode == 1
    assert "is missing, though the run is finished; `recoil rebuild" in study.stderr


@pytest.mark.slow
@pytest.mark.parametrize("named", ["grip", "preference"])
@pytest.mark.parametrize("with_journal", [True, False])
def test_a_log_that_is_named_for_another_experiment_is_told_and_makes_no_row(
    named: str, with_journal: bool, quick_configs: Path, tmp_path: Path
) -> None:
    for code in ("P01", "P02", "P03"):
        ran(tmp_path / "results", code, str(quick_configs / "direction.toml"))
    for path in [*(tmp_path / "results" / "sub-P02").iterdir()]:
        if with_journal or path.suffix == ".csv":
            path.rename(path.with_name(path.name.replace("direction", named)))
    statistics, exceptions, _ = analyze(Request(paths=[tmp_path / "results"], out=tmp_path / "out"))
    (left_out,) = [one for one in exceptions if one.startswith("left out: ")]
    assert f"sub-P02_task-{named}_trials.csv: " in left_out
    assert "was it renamed? (rule: a " in left_out
    assert f"- Left out: sub-P02/sub-P02_task-{named}_trials.csv: " in (tmp_path / "out" / "report.md").read_text()
    found = statistics.participation
    assert found is not None
    assert {name: one.analysed for name, one in found.experiments.items()} == {"direction": 2 if with_journal else 3}


def test_an_unfinished_synthetic_run_beside_people_is_kept_out_and_nobody_has_begun(tmp_path: Path) -> None:
    broken_off(tmp_path, "S01", 9)
    for code in ("P01", "P02"):
        rows = [row | {"rating_by": "participant", "gun": "RG-2:0007"} for row in rating_rows(code, int(code[1:]))]
        write_rows(ratings_path(tmp_path, code), rows)
    logs = read_logs([tmp_path])
    assert (logs.kind, logs.begun) == ("real", ())
    (problem,) = logs.problems
    assert "is of synthetic participants, beside logs of people at a gun (rule: never together)" in str(problem)
    found = with_everybody(summarize(logs), logs).participation
    assert found is not None
    assert (found.experiments["preference"].begun, found.experiments["preference"].left_out) == (0, 0)


@pytest.mark.slow
def test_the_same_code_that_has_begun_at_another_lab_is_another_person(tmp_path: Path) -> None:
    write_study(tmp_path / "kyoto", participants=2)
    broken_off(tmp_path / "oslo", "P01", 9)
    logs = read_logs([tmp_path / "kyoto", tmp_path / "oslo"])
    found = with_everybody(summarize(logs), logs).participation
    assert found is not None
    assert (found.experiments["preference"].analysed, found.experiments["preference"].begun) == (2, 1)
    assert [one.participant for one in found.absent if one.state.startswith("begun")] == ["oslo/P01"]


def test_synthetic_participants_beside_people_are_in_no_count(tmp_path: Path) -> None:
    ran(tmp_path, "S01")
    register.append(tmp_path, register.entry("joined", "S01", facts={}), VirtualClock())
    for code in ("P01", "P02"):
        rows = [row | {"rating_by": "participant", "gun": "RG-2:0007"} for row in rating_rows(code, int(code[1:]))]
        write_rows(ratings_path(tmp_path, code), rows)
    logs = read_logs([tmp_path])
    found = with_everybody(summarize(logs), logs)
    assert [one.participant for one in found.excluded] == ["S01"]
    assert found.participation is not None
    counts = found.participation.experiments["preference"]
    assert (counts.analysed, counts.left_out, counts.not_done) == (2, 0, 0)
    assert found.participation.absent == ()


@pytest.mark.slow
@pytest.mark.parametrize("command", ["analyze", "export"])
def test_of_unfinished_runs_alone_it_is_said_how_to_go_on(recoil: Recoil, tmp_path: Path, command: str) -> None:
    path = broken_off(tmp_path / "results", "P01", 9)
    words = ["bids", tmp_path / "results"] if command == "export" else [tmp_path / "results", "--out", "out"]
    refused(recoil(command, *words), "P01 has begun preference", "--participant P01 --resume", f"recoil rebuild {path}")


@pytest.mark.slow
def test_somebody_elses_unreadable_journal_stops_no_run_of_a_balanced_order(recoil: Recoil, tmp_path: Path) -> None:
    assert recoil("configs", "--copy", tmp_path / "configs").returncode == 0
    config = tmp_path / "configs" / "preference.toml"
    config.write_text(config.read_text().replace('trials = "random"', 'trials = "williams"'))
    words = ["run", config, "--screen", "synthetic", "--results", "results", "--seed", 1, "--participant"]
    assert recoil(*words, "P01").returncode == 0
    broken = journal(tmp_path / "results", "preference")
    lines(broken, lambda found: found.__setitem__(0, found[0].replace(b'"order_row":0', b'"order_row":NaN')))
    done = recoil(*words, "P02")
    assert done.returncode == 0, done
    assert "NaN is no number of JSON" in done.stderr
    assert "its order does not count in the balance" in done.stderr
    assert table(tmp_path / "results", "preference", "P02").exists()


@pytest.mark.slow
def test_a_clock_that_ran_backwards_is_flagged_and_bids_counts_no_onset_after_it(
    recoil: Recoil, tmp_path: Path
) -> None:
    path = broken_off(tmp_path / "results", "P01", 100)
    head = json.loads(path.read_bytes().splitlines()[0])
    assert head["utc"].startswith("2026-03-11")
    asked = RunRequest(
        setup=load_setup("preference"), participant_id="P01", results=tmp_path / "results", again="resume"
    )
    run(asked, synthetic_screen, LaterClock(timedelta(days=10)))
    logs = read_logs([tmp_path / "results"])
    flags = logs.ratings["flags"].fillna("").tolist()
    (at,) = (place for place, text in enumerate(flags) if "clock-set-back" in text.split())
    assert (at > 0, logs.problems) == (True, ())
    assert recoil("export", "bids", "results").returncode == 0
    rows = (tmp_path / "results/bids/sub-P01/beh/sub-P01_task-preference_beh.tsv").read_text().splitlines()
    column = rows[0].split("\t").index("onset")
    onsets = [row.split("\t")[column] for row in rows[1:]]
    assert onsets[at:] == ["n/a"] * (3 - at)
    assert all(0.0 <= float(onset) < 3600.0 for onset in onsets[:at])


def test_of_several_questions_without_an_answer_each_person_is_told_once() -> None:
    gone = [
        LeftOut(experiment="odd", participant=who, reason="no answer to a, b in some condition", rule=IN_NO_TEST)
        for who in ("P02", "P04")
    ]
    (line,) = exclusion_lines(gone)
    assert line.startswith("left out of tests of odd: 2 participants (rule: a test takes who answered")


@pytest.mark.parametrize(
    ("people", "said"), [(100, "P100 (?); "), (101, "P100 (?) and 1 more, all in statistics.json; ")]
)
def test_a_long_list_of_people_is_cut_as_any_other(people: int, said: str) -> None:
    gone = [LeftOut(experiment="odd", participant=f"P{who}", reason="?", rule="r") for who in range(1, people + 1)]
    assert said in next(exclusion_lines(gone))


def test_a_copy_of_a_folder_leaves_out_nobody_and_the_original_stays(tmp_path: Path) -> None:
    results = tmp_path / "results"
    for code in ("P01", "P02"):
        ran(results, code)
    shutil.copytree(results / "sub-P01", results / "backup" / "sub-P01")
    logs = read_logs([results])
    assert [file.parent.parent.name for file in logs.files] == ["results", "results"]
    (problem,) = logs.problems
    assert problem.file.parent.parent.name == "backup"
    assert "byte for byte" in problem.message
    statistics = with_everybody(summarize(logs), logs)
    assert [(one.participant, Path(one.file).parts[0]) for one in statistics.excluded] == [("", "backup")]
    assert statistics.participation is not None
    counts = statistics.participation.experiments["preference"]
    assert (counts.analysed, counts.left_out, counts.not_done) == (2, 0, 0)
    assert statistics.participation.absent == ()


@pytest.mark.slow
def test_the_archive_of_a_study_beside_it_is_nobody_else(quick_configs: Path, tmp_path: Path) -> None:
    results, archive = tmp_path / "study" / "results", tmp_path / "archive"
    for code in ("P01", "P02", "P03"):
        for config in ("preference.toml", "realism.toml"):
            ran(results, code, str(quick_configs / config))
    alone = read_logs([results])
    export_archive(ArchiveRequest(folder=tmp_path / "study", out=archive, include_synthetic=True))
    export_archive(ArchiveRequest(folder=tmp_path / "study", out=tmp_path / "again", include_synthetic=True))
    register.append(results, register.entry("excluded", "P03", reason="asked to be"), VirtualClock())
    for paths in ([tmp_path], [archive, results], [*sorted(archive.rglob("sub-*.csv")), *alone.files]):
        logs = read_logs(paths)
        assert {file.parent.parent for file in logs.files} == {results}
        found = with_everybody(summarize(logs), logs)
        assert found.preference is not None
        assert found.preference.participants.codes == ("P01", "P02")
        assert {one.participant for one in found.excluded} == {"P03", ""}
        said = [one.message for one in logs.problems if archive in one.file.parents]
        assert len(said) == 6
        original = "study/results/sub-P01/sub-P01_task-preference_journal.jsonl"
        assert f"is a redacted copy of the run in {original} (rule: a run counts once); read one of both" in said
        assert found.participation is not None
        assert {one.participant for one in found.participation.absent} == {"P03"}


@pytest.mark.slow
def test_of_two_archives_of_a_study_each_run_counts_once(quick_configs: Path, tmp_path: Path) -> None:
    people = quick_configs / "synthetic" / "preference.toml"
    people.write_text(people.read_text().replace('law = "words"', 'law = "words"\ntexts = ["like a mule"]'))
    ran(tmp_path / "study" / "results", "P01", str(quick_configs / "preference.toml"))
    for name, free_text in (("open", True), ("hidden", False)):
        export_archive(ArchiveRequest(folder=tmp_path / "study", out=tmp_path / name, free_text=free_text))
    said = table(tmp_path / "open" / "results", "preference")
    assert said.read_bytes() != table(tmp_path / "hidden" / "results", "preference").read_bytes()
    logs = read_logs([tmp_path / "open", tmp_path / "hidden"])
    assert logs.files == (said,)


@pytest.mark.slow
def test_a_run_that_went_on_since_it_was_archived_counts_once(tmp_path: Path) -> None:
    results = tmp_path / "study" / "results"
    path = broken_off(results, "P01", 40)
    whole = path.read_bytes()
    rebuild_table(path)
    export_archive(ArchiveRequest(folder=tmp_path / "study", out=tmp_path / "archive"))
    table(results, "preference").unlink()
    ran(results, again="resume")
    assert path.read_bytes().startswith(whole)
    assert read_logs([tmp_path]).files == (table(results, "preference"),)


@pytest.mark.slow
def test_of_archives_of_different_dates_and_of_an_archive_of_an_archive_each_run_counts_once(tmp_path: Path) -> None:
    study, results = tmp_path / "study", tmp_path / "study" / "results"
    rebuild_table(broken_off(results, "P01", 40))
    export_archive(ArchiveRequest(folder=study, out=tmp_path / "half"))
    table(results, "preference").unlink()
    ran(results, again="resume")
    export_archive(ArchiveRequest(folder=study, out=tmp_path / "whole"))
    export_archive(ArchiveRequest(folder=tmp_path / "whole", out=tmp_path / "twice"))
    whole = table(tmp_path / "whole" / "results", "preference")
    for paths in ([tmp_path / "half", tmp_path / "whole"], [tmp_path / "whole", tmp_path / "half"]):
        assert read_logs(paths).files == (whole,)
    assert read_logs([study, tmp_path / "twice"]).files == (table(results, "preference"),)


@pytest.mark.slow
def test_a_run_that_was_set_aside_does_not_come_back_by_an_older_archive(tmp_path: Path) -> None:
    results = tmp_path / "study" / "results"
    path = broken_off(results, "P01", 40)
    rebuild_table(path)
    export_archive(ArchiveRequest(folder=tmp_path / "study", out=tmp_path / "archive"))
    set_aside(place(results, "P01", "preference"))
    ran(results)
    assert path.with_name(f"{path.stem}.aside-1.jsonl").exists()
    assert read_logs([tmp_path]).files == (table(results, "preference"),)


@pytest.mark.slow
def test_what_is_said_of_logs_that_were_used_stands_in_the_statistics(tmp_path: Path) -> None:
    results = tmp_path / "results"
    for code in ("P01", "P02"):
        ran(results, code)
    journal(results, "preference").unlink()
    (results / "sub-P02" / "sub-P02_task-preference_ratings.csv").unlink()
    analyze(Request(paths=(results,), out=tmp_path / "out"))
    found = json.loads((tmp_path / "out" / "statistics.json").read_text(encoding="utf-8"))
    assert any("has no journal" in one or "have no journal" in one for one in found["log_remarks"])
    assert any("its table is missing, so it was made again" in one for one in found["log_remarks"])
    assert str(tmp_path) not in json.dumps(found["log_remarks"])


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["direction", "preference", "realism"])
def test_a_table_that_holds_more_than_its_cut_journal_is_not_to_be_rebuilt(experiment: str, tmp_path: Path) -> None:
    ran(tmp_path, "P01", experiment)
    (path,) = tmp_path.glob(f"sub-P01/*{experiment}_journal.jsonl")
    records = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(records[: len(records) // 2]) + records[len(records) // 2][:20])
    (problem,) = read_logs([tmp_path]).problems
    assert "holds more than its journal, which is cut short: " in problem.message
    assert "do not rebuild the table" in problem.message
    assert "`recoil rebuild" not in problem.message
    made = rebuild_table(path)
    rows = problem.message.partition("nothing proves ")[2].partition(" of it")[0]
    assert f"it holds more than the journal in {rows}, which" in "".join(made.messages)


def test_an_answer_that_a_journal_says_otherwise_is_edited_though_the_journal_is_cut(tmp_path: Path) -> None:
    ran(tmp_path, "P01")
    path = journal(tmp_path, "preference")
    records = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(records[:-1]))
    of_run = table(tmp_path, "preference")
    first, second, *rest = of_run.read_bytes().split(b"\r\n")
    of_run.write_bytes(b"\r\n".join([first, second.replace(b",1,,", b",2,,"), *rest]))
    (problem,) = read_logs([tmp_path]).problems
    assert "is not what its journal says: edited" in problem.message
    assert not any("holds more" in one for one in rebuild_table(path).messages)


def test_whoever_has_several_logs_without_a_journal_is_named_once() -> None:
    logs = [("a", code, has) for code, has in (("P01", False), ("P01", False), ("P02", False), ("P03", True))]
    (told,) = gone(logs)
    assert "3 of 4 logs have no journal beside them" in told.message
    assert "nothing proves them: P01, P02;" in told.message
