"""A study whose design was changed between its runs: which is analysed, who is left out, why, and where that stands."""

from __future__ import annotations

import csv
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from analysis.archive.archive_export import ArchiveRequest, export_archive
from analysis.archive.contents import left_out_in
from analysis.archive.preregistration import freeze
from analysis.logs.design_logs import APART, ONE_DESIGN
from analysis.logs.exclusions import left_out_by_files
from analysis.logs.reading import read_logs
from analysis.summary.deviations import AnalysisFiles, deviations
from analysis.summary.participation import participation
from analysis.summary.summary import summarize
from experiments.clock import Clock, RealClock, VirtualClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.live_run import EventVerdict, LiveRun
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session.events import Event, Press, Rating
from experiments.study.new_study import new_study
from experiments.synthetic.answers import synthetic_participant_of

pytestmark = pytest.mark.slow

SHORT, LONG = "[0.004, 0.018]", "[0.006, 0.018]"


class TypedIn(LiveRun):
    """A run in which the experimenter types what is answered."""

    def __init__(self, live: LiveRun) -> None:
        self.__dict__ = live.__dict__

    def offer(self, event: Event, press: Press | None = None) -> EventVerdict:
        return super().offer(replace(event, by="experimenter") if isinstance(event, Rating) else event, press)


class PersonScreen(SyntheticScreen):
    """Answers as an experimenter types them."""

    def begin(self, live: LiveRun) -> None:
        super().begin(TypedIn(live))


def person_screen(setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> PersonScreen:
    return PersonScreen(setup.config, synthetic_participant_of(setup, plan), clock)


def do(study: Path, *codes: str, person: bool = True) -> None:
    """Runs as people do them, or synthetic participants."""
    for code in codes:
        request = RunRequest(
            setup=load_setup(study / "magnitude.toml"),
            participant_id=code,
            results=study / "results",
            seed=int(code[1:]),
            screen="terminal" if person else "synthetic",
        )
        run(request, person_screen if person else synthetic_screen, VirtualClock())


def set_aside(study: Path, code: str) -> None:
    """As a synthetic run gives way to a person."""
    folder = study / "results" / f"sub-{code}"
    for path in [*folder.glob("*_journal.jsonl"), *folder.glob("*_trials.csv")]:
        path.rename(path.with_name(f"{path.stem}.aside-1{path.suffix}"))


def with_levels(study: Path, levels: str) -> None:
    path = study / "magnitude.toml"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(f"levels = {levels}\n" if line.startswith("levels = [0.") else line for line in lines))


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study of one short design."""
    new_study(tmp_path / "study", "magnitude")
    path = tmp_path / "study" / "magnitude.toml"
    path.write_text(path.read_text().replace("sets = 3", "sets = 1").replace("repetitions = 3", "repetitions = 1"))
    with_levels(path.parent, SHORT)
    return path.parent


def test_without_a_freeze_the_design_of_most_logs_is_analysed_and_the_keys_that_differ_are_named(study: Path) -> None:
    do(study, "P01", "P02")
    with_levels(study, LONG)
    do(study, "P03")
    logs = read_logs([study / "results"])
    assert sorted(logs.designs[0].table["participant_id"].unique()) == ["P01", "P02"]
    (one,) = left_out_by_files(logs)
    assert (one.participant, one.rule, one.remedy) == ("P03", ONE_DESIGN, APART)
    said = f"another design 'magnitude' than most logs of that name: factors.pulse_s.levels = {LONG}, not {SHORT} (rule"
    assert said in one.reason


def test_the_frozen_design_is_analysed_though_most_logs_have_the_one_that_was_amended(study: Path) -> None:
    freeze(study, "", RealClock())
    do(study, "P01", "P02")
    with_levels(study, LONG)
    freeze(study, "too weak", RealClock())
    do(study, "P03")
    logs = read_logs([study / "results"])
    assert logs.designs[0].table["participant_id"].unique().tolist() == ["P03"]
    assert [one.participant for one in left_out_by_files(logs)] == ["P01", "P02"]
    said = f"than preregistration 2 freezes: factors.pulse_s.levels = {SHORT}, not {LONG} (rule: {ONE_DESIGN})"
    assert all(said in one.message for one in logs.problems)


def test_each_study_is_there_with_what_it_froze_itself_beside_one_that_froze_another_design(study: Path) -> None:
    """What a study's amendment left behind is not taken up again because another study froze the same."""
    study, other = study.rename(study.with_name("study (2)")), study.with_name("other")
    shutil.copytree(study, other)
    freeze(study, "", RealClock())
    do(study, "P01", "P02")
    with_levels(study, LONG)
    freeze(study, "too weak", RealClock())
    do(study, "P03")
    freeze(other, "", RealClock())
    do(other, "P01", "P02")
    logs = read_logs([study / "results", other / "results"])
    assert logs.designs[0].table["participant_id"].unique().tolist() == ["other/P01", "other/P02"]
    assert {one.rule for one in logs.problems} == {ONE_DESIGN}
    first, second, third = sorted((one.message for one in logs.problems), key=lambda one: "1 of 'other'" in one)
    for left in (first, second):
        assert f"than preregistration 2 of 'study (2)' freezes: factors.pulse_s.levels = {SHORT}, not {LONG}" in left
    assert f"than preregistration 1 of 'other' freezes: factors.pulse_s.levels = {LONG}, not {SHORT}" in third
    assert f"(rule: {ONE_DESIGN}), though it is as preregistration 2 of 'study (2)' freezes it; {APART}" in third


def test_who_is_left_out_stands_among_the_deviations_though_a_synthetic_run_was_set_aside_for_them(study: Path) -> None:
    freeze(study, "", RealClock())
    do(study, "P01", person=False)
    set_aside(study, "P01")
    do(study, "P01")
    with_levels(study, LONG)
    freeze(study, "too weak", RealClock())
    do(study, "P03")
    ((found,), _) = deviations(read_logs([study / "results"]), AnalysisFiles())
    unused = [one for one in found.deviations if one.kind == "exclusion" and "not used" in one.what]
    assert [one.who for one in unused] == [("P01",)]
    assert "levels = [0.004, 0.018], not [0.006, 0.018]" in unused[0].what


def test_a_value_with_a_semicolon_stands_whole_among_the_deviations(study: Path) -> None:
    path, asked = study / "magnitude.toml", 'text = "How strong; as a number?"'
    path.write_text(re.sub(r"(?<=\[questions.strength\]\n)(.*\n)text = .*", rf"\1{asked}", path.read_text()))
    assert asked in path.read_text()
    freeze(study, "", RealClock())
    do(study, "P01")
    path.write_text(path.read_text().replace("; as", ": as"))
    freeze(study, "plainer", RealClock())
    do(study, "P02")
    ((found,), _) = deviations(read_logs([study / "results"]), AnalysisFiles())
    (unused,) = (one.what for one in found.deviations if one.kind == "exclusion")
    assert unused.endswith(
        f'questions.strength.text = "How strong; as a number?", not "How strong: as a number?" (rule: {ONE_DESIGN})'
    )


def test_an_archive_calls_the_run_one_of_another_design_and_not_a_broken_one(study: Path, tmp_path: Path) -> None:
    do(study, "P01", "P02", person=False)
    with_levels(study, LONG)
    do(study, "P03", person=False)
    export_archive(ArchiveRequest(folder=study, out=tmp_path / "archive", include_synthetic=True))
    rows = csv.DictReader((tmp_path / "archive" / "contents.csv").read_text().splitlines())
    assert {row["participant_id"]: (row["state"], row["data"]) for row in rows} == {
        "P01": ("finished", "synthetic"), "P02": ("finished", "synthetic"), "P03": ("other design", "synthetic")
    }  # fmt: skip
    (one,) = left_out_in(tmp_path / "archive")
    assert (one.participant, one.rule, one.file) == ("P03", ONE_DESIGN, "")


def test_designs_of_two_names_that_are_alike_otherwise_stay_apart(study: Path) -> None:
    do(study, "P01")
    path = study / "magnitude.toml"
    path.write_text(path.read_text().replace('design = "magnitude"', 'design = "again"'))
    do(study, "P01", "P02")
    logs = read_logs([study / "results"])
    found = {one.design.design: one.table["participant_id"].nunique() for one in logs.designs}
    assert found == {"magnitude": 1, "again": 2}
    (title,) = {one.design.title for one in logs.designs}
    told = {name: one.title for name, one in summarize(logs).designs.items()}
    assert told == {"magnitude": f"{title} (magnitude)", "again": f"{title} (again)"}


@pytest.mark.parametrize("person", [True, False])
def test_how_synthetic_people_answer_is_of_the_setup_of_their_runs_alone(person: bool, study: Path) -> None:
    do(study, "P01", "P02", person=person)
    laws = study / "synthetic" / "magnitude.toml"
    laws.write_text(f"exposure_s = 4.25\n{laws.read_text()}")
    do(study, "P03", person=person)
    told = [one.message for one in read_logs([study / "results"]).remarks if "setups" in one.message]
    assert ["P03 with synthetic exposure_s = 4.25, not 5.0" in one for one in told] == [True] * (not person)


@pytest.mark.parametrize("ending", ["", ".csv", "_journal.jsonl"])
def test_a_log_that_is_named_for_another_experiment_is_left_out_and_that_is_none(ending: str, study: Path) -> None:
    do(study, "P01")
    do(study, "P02")
    renamed = [path for path in (study / "results" / "sub-P01").iterdir() if path.name.endswith(ending)]
    for path in renamed:
        path.rename(path.with_name(path.name.replace("magnitude", "loudness")))
    logs = read_logs([study / "results"])
    (problem,) = [one for one in logs.problems if "was it renamed?" in one.message]
    assert (problem.participant, problem.experiment) == ("P01", "magnitude")
    assert "loudness" in problem.file.name
    assert ("is a table of 'magnitude', named for 'loudness'" in problem.message) is (ending == ".csv")
    assert [*participation(logs, {"magnitude": ["P02"]}, left_out_by_files(logs)).experiments] == ["magnitude"]
    assert ("P01" in logs.designs[0].table["participant_id"].to_numpy()) is (ending == ".csv")  # its journal makes it


def test_a_synthetic_run_that_gave_way_is_none_of_the_peoples_that_were_set_aside(study: Path, tmp_path: Path) -> None:
    do(study, "P01", person=False)
    set_aside(study, "P01")
    do(study, "P01")
    do(study, "P02", person=False)
    logs = read_logs([study / "results"])
    assert logs.kind == "simulated gun"
    assert participation(logs, {"magnitude": ["P01"]}, ()).experiments["magnitude"].set_aside == 0
    export_archive(ArchiveRequest(folder=study, out=tmp_path / "archive"))
    rows = csv.DictReader((tmp_path / "archive" / "contents.csv").read_text().splitlines())
    assert [(row["participant_id"], row["state"], row["data"]) for row in rows] == [
        ("P01", "finished", "simulated gun"),
        ("P01", "set aside", "synthetic"),
        ("P02", "kept out", "synthetic"),
    ]
    (apart,) = read_logs([study / "results"], include_synthetic=True).apart
    assert [(run.participant, run.kind) for run in apart.runs] == [("P01", "set aside"), ("P02", "run")]
