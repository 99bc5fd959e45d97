"""The command line as its users call it: real processes, their exit codes and what they say."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Literal

import pytest

from experiments.config.setup import canonical_json
from experiments.earlier_run import check_resumable
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import link_of
from experiments.run_request import RunRequest
from experiments.study.folders import PlaceError
from tests.conftest import Recoil, refused
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

TABLE = "results/sub-P01/sub-P01_task-direction_trials.csv"
JOURNAL = "results/sub-P01/sub-P01_task-direction_journal.jsonl"


def synthetic(
    recoil: Recoil, *more: object, config: object = "direction", participant: str = "P01"
) -> subprocess.CompletedProcess[str]:
    return recoil("run", config, "--participant", participant, "--screen", "synthetic", *more)


@pytest.mark.parametrize("command", ["reproduce", "check", "run", "rebuild", "analyze", "simulate", "configs", "new"])
def test_every_command_has_help(recoil: Recoil, command: str) -> None:
    done = recoil(command, "--help")
    assert done.returncode == 0
    assert "Usage: recoil" in done.stdout


@pytest.mark.parametrize("command", [(), ("export",), ("fit",)])
def test_no_summary_of_a_command_is_cut_at_80_columns(recoil: Recoil, command: tuple[str, ...]) -> None:
    listed = recoil(*command, "--help").stdout.partition("Commands:\n")[2]
    assert "  " in listed
    assert not [line for line in listed.splitlines() if line.endswith(("...", "…")) or len(line) > 80]


def test_analyze_without_a_folder_for_its_results_says_what_to_give(recoil: Recoil) -> None:
    refused(recoil("analyze", "results"), "give --out DIR", "recoil analyze results --out analysis")


def test_the_module_is_the_command_line() -> None:
    command = [sys.executable, "-m", "recoil", "check", "direction"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    assert (done.returncode, done.stderr) == (0, "")
    assert "60 trials" in done.stdout


def test_wrong_usage_is_2(recoil: Recoil) -> None:
    refused(recoil("run", "direction"), "--participant")
    refused(recoil("unknown"), "unknown")


def test_check_prints_design_orders_duration_and_limits_and_runs_nothing(recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("check", "direction", "preference")
    assert done.returncode == 0
    assert "30.0 min planned" in done.stdout
    assert "of which breaks 780 s" in done.stdout
    assert "8.0 min planned" in done.stdout
    assert done.stdout.count("P14") == 2
    assert "24 V, pulse 20 ms, duty 10 % over any second, 300 shots a minute, coil 80 °C" in done.stdout
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("config", ["study", "gun", "gun-five", "paper"])
def test_every_shipped_config_can_be_checked(recoil: Recoil, config: str) -> None:
    assert recoil("check", config).returncode == 0


def test_the_orders_that_check_shows_are_those_that_runs_get(recoil: Recoil, tmp_path: Path) -> None:
    shown = json.loads(recoil("check", "direction", "--seed", 5, "--json").stdout)["orders"]["P01"]
    synthetic(recoil, "--seed", 5)
    with (tmp_path / TABLE).open(newline="") as table:
        methods = [row["method"] for row in csv.DictReader(table)]
    assert list(dict.fromkeys(methods)) == shown


def test_a_synthetic_run_leaves_a_journal_and_a_table_for_their_owner_alone(recoil: Recoil, tmp_path: Path) -> None:
    done = synthetic(recoil)
    assert done.returncode == 0
    for name in (TABLE, JOURNAL):
        assert (tmp_path / name).stat().st_mode & 0o077 == 0
    assert (tmp_path / TABLE).parent.stat().st_mode & 0o077 == 0


def test_without_a_seed_one_is_drawn_and_stored(recoil: Recoil, tmp_path: Path) -> None:
    seeds = []
    for code in ("P01", "P02"):
        synthetic(recoil, participant=code)
        head = (tmp_path / JOURNAL.replace("P01", code)).read_text().splitlines()[0]
        seeds.append(json.loads(head)["plan"]["seed"])
    assert all(isinstance(seed, int) for seed in seeds)
    assert seeds[0] != seeds[1]


def test_a_code_that_has_no_run_has_none_to_resume(recoil: Recoil, tmp_path: Path) -> None:
    refused(synthetic(recoil, "--resume"), "there is no run of direction by P01 to resume here", "leave out --resume")
    assert not (tmp_path / JOURNAL).exists()


def test_nobody_goes_on_for_a_person_whom_a_simulation_would_replace(recoil: Recoil, tmp_path: Path) -> None:
    synthetic(recoil)
    journal = tmp_path / JOURNAL
    lines = journal.read_bytes().splitlines(keepends=True)
    begun = b"".join(lines[:8]).replace(b'"by":"synthetic"', b'"by":"participant"')
    journal.write_bytes(_relinked(begun))
    refused(synthetic(recoil, "--resume"), "this run is a person's so far", "or another participant")


@pytest.mark.parametrize("began", ["synthetic", "person"])
def test_nobody_goes_on_for_another_kind_of_participant_who_has_answered_nothing_yet(
    recoil: Recoil, tmp_path: Path, began: Literal["person", "synthetic"]
) -> None:
    """Else a person's run would count as a synthetic one, and give way to the next person's."""
    synthetic(recoil)
    journal = tmp_path / JOURNAL
    head = journal.read_bytes().splitlines(keepends=True)[0]
    journal.write_bytes(_relinked(head.replace(b'"participant":"synthetic"', f'"participant":"{began}"'.encode())))
    screen, whose = ("synthetic", "a person's") if began == "person" else ("terminal", "a synthetic participant's")
    request = RunRequest(
        setup=load_setup("direction"), participant_id="P01", results=tmp_path / "results", screen=screen
    )
    with pytest.raises(PlaceError, match=f"this run is {whose} so far"):
        check_resumable(request)


def _relinked(journal: bytes) -> bytes:
    """A journal with each record linked to the one before it."""
    found = list[bytes]()
    for line in journal.splitlines():
        record = json.loads(line)
        found.append(canonical_json(record | {"link": link_of(found[-1]) if found else ""}) + b"\n")
    return b"".join(found)


def test_a_participant_who_has_finished_is_refused_and_nothing_changes(recoil: Recoil, tmp_path: Path) -> None:
    synthetic(recoil)
    before = {name: (tmp_path / name).read_bytes() for name in (TABLE, JOURNAL)}
    for again in ((), ("--resume",), ("--fresh",)):
        refused(synthetic(recoil, *again), "P01 has finished direction", "a retest is a copy of the config")
    assert before == {name: (tmp_path / name).read_bytes() for name in (TABLE, JOURNAL)}


@pytest.mark.parametrize("code", ["P" * 33, "../P01", "a/b", "P 01", "P.01", "P-01", "Ä1", "P01\n"])
def test_a_code_that_breaks_the_rule_is_refused_and_leaves_no_folder(recoil: Recoil, tmp_path: Path, code: str) -> None:
    before = sorted(tmp_path.rglob("*"))
    refused(synthetic(recoil, participant=code), "must be 1 to 32 letters and digits")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_code_that_differs_in_case_alone_is_refused(recoil: Recoil) -> None:
    synthetic(recoil)
    refused(synthetic(recoil, participant="p01"), "'p01' differs from 'P01'")


def test_a_results_folder_that_cannot_be_made_is_refused(recoil: Recoil, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    refused(synthetic(recoil, "--results", "file/results"), "file/results/sub-P01: cannot be made")


def test_a_broken_config_is_refused_with_file_line_key_value_and_rule(recoil: Recoil, tmp_path: Path) -> None:
    recoil("configs", "--copy", "mine")
    config = tmp_path / "mine" / "direction.toml"
    config.write_text(config.read_text().replace("between_sets_s = 20.0", "between_sets_s = -20.0"))
    line = 1 + config.read_text()[: config.read_text().index("between_sets_s")].count("\n")
    done = recoil("check", "mine/direction.toml")
    refused(done, f"mine/direction.toml:{line}: breaks.between_sets_s = -20.0", "must be at least 0")
    assert done.stderr.count("\n") == 1


def test_a_terminal_run_without_a_terminal_prompts_nothing(recoil: Recoil) -> None:
    refused(recoil("run", "direction", "--participant", "P01"), "no terminal")


def test_a_gun_that_is_not_there_is_refused(recoil: Recoil) -> None:
    refused(synthetic(recoil, "--gun", "serial:/dev/none"), "serial:/dev/none")
    refused(synthetic(recoil, "--gun", "water"), "water", "simulated")


def test_rebuild_finds_a_table_as_its_journal_says(recoil: Recoil) -> None:
    synthetic(recoil)
    done = recoil("rebuild", JOURNAL)
    assert (done.returncode, done.stderr) == (0, "")
    assert "is as its journal says" in done.stdout


def test_rebuild_makes_a_lost_table_again_byte_for_byte(recoil: Recoil, tmp_path: Path) -> None:
    synthetic(recoil)
    before = (tmp_path / TABLE).read_bytes()
    (tmp_path / TABLE).unlink()
    assert recoil("rebuild", JOURNAL).returncode == 0
    assert (tmp_path / TABLE).read_bytes() == before


def test_rebuild_sets_an_edited_table_aside(recoil: Recoil, tmp_path: Path) -> None:
    synthetic(recoil)
    before = (tmp_path / TABLE).read_bytes()
    edited = before.replace(b"forward,forward,1", b"forward,backward,0", 1)
    (tmp_path / TABLE).write_bytes(edited)
    done = recoil("rebuild", JOURNAL)
    assert done.returncode == 1
    assert "set aside" in done.stderr
    assert (tmp_path / TABLE).read_bytes() == before
    assert (tmp_path / TABLE).with_name("sub-P01_task-direction_trials.aside-1.csv").read_bytes() == edited


def test_a_journal_or_config_that_is_none_hinders_no_other(recoil: Recoil, tmp_path: Path) -> None:
    recoil("run", "preference", "--participant", "P01", "--screen", "synthetic")
    (journal,) = tmp_path.glob("results/sub-P01/*_journal.jsonl")
    (tmp_path / "junk.jsonl").write_text("junk")
    journal.with_name(journal.name.replace("_journal.jsonl", "_ratings.csv")).unlink()
    rebuilt = recoil("rebuild", "junk.jsonl", journal)
    assert (rebuilt.returncode, "rebuilt" in rebuilt.stdout, "junk.jsonl" in rebuilt.stderr) == (1, True, True)
    checked = recoil("check", "nowhere.toml", "preference")
    assert (checked.returncode, "Subjective" in checked.stdout, "nowhere.toml" in checked.stderr) == (1, True, True)


def test_rebuild_of_something_else_is_refused(recoil: Recoil, tmp_path: Path) -> None:
    (tmp_path / "notes.jsonl").write_text('{"n": 0, "kind": "note"}\n')
    refused(recoil("rebuild", "notes.jsonl"), "notes.jsonl: line 1", "kind must be one of")
    refused(recoil("rebuild", "none.jsonl"), "none.jsonl: cannot be read")


def test_analyze_leaves_out_what_was_edited_and_says_so(recoil: Recoil, tmp_path: Path) -> None:
    for code in ("P01", "P02", "P03"):
        synthetic(recoil, config="preference", participant=code)
    table = tmp_path / "results/sub-P01/sub-P01_task-preference_ratings.csv"
    edited, cells = re.subn(rb"(?m)^(P01,preference,1,[^,]+),[^,]+", rb"\1,10", table.read_bytes())
    assert cells == 1
    table.write_bytes(edited)
    done = recoil("analyze", "results", "--out", "analysis")
    assert done.returncode == 1
    assert "edited since the run" in done.stderr
    text = (tmp_path / "analysis" / "report.html").read_text(encoding="utf-8")
    assert "edited since the run" in text
    assert str(tmp_path) not in text  # a report says nothing of the machine it was made on
    assert json.loads((tmp_path / "analysis" / "statistics.json").read_text())["preference"]["n"] == 2


def test_analyze_without_any_usable_log_is_2_and_lists_the_reasons(recoil: Recoil, tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "sub-P01_task-direction_trials.csv").write_text("subject,answer\n1,left\n")
    refused(recoil("analyze", "old", "--out", "analysis"), "no usable log", "sub-P01_task-direction_trials.csv")
    refused(recoil("analyze", "nowhere", "--out", "analysis"), "nowhere")
    assert not (tmp_path / "analysis").exists()


def test_simulate_tells_of_a_shot_and_draws_it(recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("simulate", "--method", "asymmetric-2", "--json", "--trace", "shot.csv", "--plot", "shot.png")
    summary = json.loads(done.stdout)["summary"]
    assert summary["status"] == "home"
    assert summary["peak_force_N"] == pytest.approx(35.14, abs=0.01)
    assert (tmp_path / "shot.png").stat().st_size > 10_000
    assert (tmp_path / "shot.csv").read_text().startswith("time_s,displacement_m,velocity_m_s")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--set", "mass=1"), "magnet_mass_kg"),
        (("--set", "voltage_V"), "key=value"),
        (("--set", "voltage_V=high"), "'high' is not a number"),
        (("--set", "magnet_mass_kg=-1"), "magnet_mass_kg"),
        (("--method", "vibration", "--audit"), "no force"),
        (("--method", "laser"), "laser"),
        (("--fidelity", "perfect"), "perfect"),
        (("--gun", "none.toml"), "none.toml"),
    ],
)
def test_simulate_refuses_what_it_cannot_do(recoil: Recoil, words: tuple[str, ...], said: str) -> None:
    refused(recoil("simulate", *words), said)


def test_configs_are_copied_once_and_never_over_others(recoil: Recoil, tmp_path: Path) -> None:
    assert recoil("configs", "--copy", "mine").returncode == 0
    copied = {path.relative_to(tmp_path / "mine") for path in (tmp_path / "mine").rglob("*.toml")}
    assert copied == {path.relative_to(shipped_folder()) for path in shipped_folder().rglob("*.toml")}
    assert Path("examples/columns.toml") in copied
    refused(recoil("configs", "--copy", "mine"), "already there")


def test_files_that_are_made_are_listed_for_programs(recoil: Recoil, tmp_path: Path) -> None:
    for words in (("configs",), ("configs", "--copy", "mine"), ("configs", "--schema", "schemas"), ("new", "pilot")):
        files = json.loads(recoil(*words, "--json").stdout)["files"]
        assert files
        assert all((tmp_path / file).exists() for file in files)


def test_a_new_study_can_be_changed_and_run(recoil: Recoil, tmp_path: Path) -> None:
    assert recoil("new", "pilot").returncode == 0
    config = tmp_path / "pilot" / "direction.toml"
    config.write_text(config.read_text().replace('balance = "session"', 'balance = "set"'))
    assert synthetic(recoil, "--results", "pilot/results", config="pilot/direction.toml").returncode == 0
    refused(recoil("new", "pilot"), "has something in it")


def test_balanced_orders_take_each_row_of_the_square_in_turn(recoil: Recoil, tmp_path: Path) -> None:
    recoil("configs", "--copy", "mine")
    config = tmp_path / "mine" / "preference.toml"
    config.write_text(config.read_text().replace('trials = "random"', 'trials = "latin-square"'))
    rows = []
    for number in range(1, 7):
        synthetic(recoil, config="mine/preference.toml", participant=f"P{number}")
        journal = tmp_path / f"results/sub-P{number}/sub-P{number}_task-preference_journal.jsonl"
        rows.append(json.loads(journal.read_text().splitlines()[0])["plan"]["order_row"])
    assert rows == [0, 1, 2, 0, 1, 2]


_A_LIBRARY_MAKES_AN_ERROR_OF_AN_INTERRUPT = """
import signal
from recoil import cli

def command() -> None:
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt as interrupt:
        raise ValueError("the library's own") from interrupt

cli._line_of = lambda words: command
cli.main()
"""


_A_SECOND_INTERRUPT_COMES_AT_ONCE = """
import signal
from recoil import cli

def command() -> None:
    try:
        signal.raise_signal(signal.SIGINT)
    finally:
        signal.raise_signal(signal.SIGTERM)
        print("cleared up")

cli._line_of = lambda words: command
cli.main()
"""


def test_a_second_interrupt_at_once_cuts_short_no_clearing_up() -> None:
    command = [sys.executable, "-c", _A_SECOND_INTERRUPT_COMES_AT_ONCE]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr.strip()) == (130, "cleared up\n", "recoil: interrupted")


@pytest.mark.parametrize(("command", "said"), [("run", "; what was acknowledged is on the disk"), ("audit", "")])
def test_only_where_answers_are_acknowledged_is_it_said_that_they_are_on_the_disk(command: str, said: str) -> None:
    words = [sys.executable, "-c", _A_LIBRARY_MAKES_AN_ERROR_OF_AN_INTERRUPT, command]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ended.stderr.strip() == f"recoil: interrupted{said}"


def test_an_error_that_a_library_makes_of_an_interrupt_ends_a_command_as_the_interrupt_does() -> None:
    command = [sys.executable, "-c", _A_LIBRARY_MAKES_AN_ERROR_OF_AN_INTERRUPT]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr.strip() == "recoil: interrupted"


_AN_INTERRUPT_COMES_WHERE_PYTHON_IGNORES_ERRORS = """
import signal, time
from recoil import cli

class Leaving:
    def __del__(self) -> None:
        signal.raise_signal(signal.SIGTERM)

def command() -> None:
    Leaving()
    while True:
        time.sleep(0.01)

cli._line_of = lambda words: command
cli.main()
"""


def test_an_interrupt_that_python_ignores_ends_a_command_all_the_same() -> None:
    command = [sys.executable, "-c", _AN_INTERRUPT_COMES_WHERE_PYTHON_IGNORES_ERRORS]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    assert ended.returncode == 130
    assert ended.stderr.strip() == "recoil: interrupted"


@pytest.mark.parametrize("kind", ["device", "pipe", "folder"])
def test_rebuild_sets_aside_what_stands_at_the_place_of_a_table_and_is_none(
    kind: str, recoil: Recoil, tmp_path: Path
) -> None:
    synthetic(recoil)
    table = tmp_path / TABLE
    kept = table.read_bytes()
    table.unlink()
    {"device": lambda: table.symlink_to("/dev/zero"), "pipe": lambda: os.mkfifo(table), "folder": table.mkdir}[kind]()
    done = recoil("rebuild", JOURNAL)
    assert (done.returncode, "set aside" in done.stderr) == (1, True)
    assert table.read_bytes() == kept
