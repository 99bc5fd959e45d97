"""Synthetic data are never put together with real ones: in what is read, analysed, shown of a study, and run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import recoil as public
from analysis.logs.reading import read_logs
from analysis.stats.anova import rm_anova
from analysis.summary.analyze import Request, analyze, result_files
from analysis.summary.summary import summarize
from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.record.tables import DataKind
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.folders import PlaceError, open_study, overview
from experiments.study.new_study import new_study
from tests.conftest import Recoil, refused
from tests.log_files import rating_rows, ratings_path, trial_rows, trials_path, write_rows

pytestmark = pytest.mark.slow

HANDS: dict[DataKind, tuple[str, str]] = {
    "real": ("participant", "RG-2:0007"),
    "simulated gun": ("participant", "simulated"),
    "synthetic": ("synthetic", "simulated"),
}
"""Who answers, and on which gun, in data of each kind."""


def log_of(folder: Path, code: str, kind: DataKind, seed: int) -> Path:
    """A participant's trials and ratings, as data of a kind are logged."""
    hand, gun = HANDS[kind]
    rows = [row | {"response_source": hand, "gun": gun} for row in trial_rows(code, seed)]
    write_rows(ratings_path(folder, code), [row | {"rating_by": hand, "gun": gun} for row in rating_rows(code, seed)])
    return write_rows(trials_path(folder, code), rows)


@pytest.fixture
def mixed(tmp_path: Path) -> Path:
    """Two people at a gun, three synthetic participants, and one person at a simulated gun, in one folder."""
    kinds: list[DataKind] = ["real", "synthetic", "synthetic", "real", "simulated gun", "synthetic"]
    for number, kind in enumerate(kinds, start=1):
        log_of(tmp_path / "results", f"P{number:02d}", kind, number)
    return tmp_path / "results"


def people(found: Any) -> list[str]:
    return sorted(found.trials["participant_id"].unique())


# reading


def test_beside_people_at_a_gun_all_others_are_left_out_with_the_remedy(mixed: Path) -> None:
    logs = read_logs([mixed])
    assert (people(logs), logs.kind, logs.apart, len(logs.files)) == (["P01", "P04"], "real", (), 4)
    said = [str(problem) for problem in logs.problems]
    assert len(said) == 8
    assert all("--include-synthetic" in one for one in said)
    assert sum("sub-P05" in one and "is of people at a simulated gun, beside" in one for one in said) == 2


def test_asked_for_each_kind_stands_by_itself(mixed: Path) -> None:
    logs = read_logs([mixed], include_synthetic=True)
    assert [(part.kind, people(part)) for part in (logs, *logs.apart)] == [
        ("real", ["P01", "P04"]),
        ("simulated gun", ["P05"]),
        ("synthetic", ["P02", "P03", "P06"]),
    ]
    assert logs.problems == ()


@pytest.mark.parametrize("kind", HANDS)
def test_data_of_one_kind_are_read_as_they_are(kind: DataKind, tmp_path: Path) -> None:
    for number in (1, 2):
        log_of(tmp_path, f"P{number:02d}", kind, number)
    logs = read_logs([tmp_path])
    assert (people(logs), logs.kind, logs.problems) == (["P01", "P02"], kind, ())


def test_people_at_a_simulated_gun_go_before_synthetic_participants(tmp_path: Path) -> None:
    log_of(tmp_path, "P01", "synthetic", 1)
    log_of(tmp_path, "P02", "simulated gun", 2)
    assert (people(read_logs([tmp_path])), read_logs([tmp_path]).kind) == (["P02"], "simulated gun")


def test_the_guns_twin_on_a_line_is_a_simulated_gun(tmp_path: Path) -> None:
    rows = [row | {"response_source": "participant", "gun": "haptic-gun:TWIN-1"} for row in trial_rows()]
    write_rows(trials_path(tmp_path, "P01"), rows)
    assert read_logs([tmp_path]).kind == "simulated gun"


def test_who_answered_nothing_is_of_the_kind_of_the_others(tmp_path: Path) -> None:
    log_of(tmp_path, "P01", "synthetic", 1)
    none = {"response": "", "correct": "", "response_time_s": "", "response_source": "", "response_time_valid": ""}
    write_rows(trials_path(tmp_path, "P02"), [row | none for row in trial_rows("P02")])
    logs = read_logs([tmp_path])
    assert (people(logs), logs.kind) == (["P01", "P02"], "synthetic")


def test_the_same_code_may_be_a_persons_and_a_synthetic_ones_but_only_once_each(tmp_path: Path) -> None:
    logs = [
        log_of(tmp_path / name, "P01", kind, seed)
        for seed, (name, kind) in enumerate((("a", "synthetic"), ("b", "real"), ("c", "real")))
    ]
    moved = [path.rename(tmp_path / f"{number}.csv") for number, path in enumerate(logs)]
    found = read_logs(moved, include_synthetic=True)
    assert [part.kind for part in (found, *found.apart)] == ["real", "synthetic"]
    (problem,) = found.problems
    assert "has a direction log already in" in str(problem)


# statistics


def test_each_kinds_f_is_that_of_its_own_people(mixed: Path) -> None:
    found = summarize(read_logs([mixed], include_synthetic=True))
    assert found.direction is not None
    assert (found.data_kind, found.direction.n, set(found.kept_apart or {})) == (
        "real",
        2,
        {"simulated gun", "synthetic"},
    )
    synthetic = (found.kept_apart or {})["synthetic"].direction
    assert synthetic is not None
    assert synthetic.anova is not None
    scores = np.array(
        [
            [
                np.mean([int(row["correct"]) for row in trial_rows(f"P{n:02d}", n) if is_forward(row, method)])
                for method in synthetic.methods
            ]
            for n in (2, 3, 6)
        ]
    )
    np.testing.assert_allclose(synthetic.anova.F, rm_anova(scores).F, rtol=1e-12)
    assert sorted({str(row["data"]) for row in found.rows()}) == ["real", "simulated gun", "synthetic"]


def test_a_notebook_is_told_the_argument(mixed: Path) -> None:
    found = public.analyze(mixed)
    assert {one.remedy for one in found.excluded} == {"`include_synthetic=True`"}
    assert (found.data_kind, found.kept_apart) == ("real", None)
    assert sum("include_synthetic=True" in warning for warning in found.warnings) == 7
    assert set(public.analyze(mixed, include_synthetic=True).kept_apart or {}) == {"simulated gun", "synthetic"}


def is_forward(row: dict[str, str], method: str) -> bool:
    return row["direction"] == "forward" and row["method"] == method


def test_the_command_keeps_them_apart_in_tables_and_figures(recoil: Recoil, mixed: Path, tmp_path: Path) -> None:
    done = recoil("analyze", "results", "--out", "out")
    alone = json.loads((tmp_path / "out" / "statistics.json").read_text())
    assert (done.returncode, alone["direction"]["n"], alone["data_kind"]) == (1, 2, "real")
    assert "kept_apart" not in alone
    assert done.stderr.count("--include-synthetic") == 7
    assert not (tmp_path / "out" / "synthetic").exists()
    done = recoil("analyze", "results", "--out", "both", "--include-synthetic")
    assert done.returncode == 0, done.stderr
    both = json.loads((tmp_path / "both" / "statistics.json").read_text())
    assert both["direction"] == alone["direction"]
    assert both["kept_apart"]["synthetic"]["direction"]["n"] == 3
    rows = (tmp_path / "both" / "synthetic" / "direction_wide.csv").read_text().splitlines()
    assert [row.split(",")[1] for row in rows[1:]] == ["P02", "P03", "P06"]
    assert (tmp_path / "both" / "figures" / "synthetic" / "figure-results.png").exists()
    page = (tmp_path / "both" / "report.md").read_text()
    assert page.index("\n## People at a simulated gun\n") < page.index("\n## Synthetic participants\n")
    assert page.count("(figures/synthetic/figure-results.png)") == 1
    top = page.partition("\n## ")[0]
    assert "DATA OF PEOPLE AT A SIMULATED GUN AND OF SYNTHETIC PARTICIPANTS are shown as well" in top


def test_times_are_fitted_to_one_kind_alone(recoil: Recoil, mixed: Path, tmp_path: Path) -> None:
    done = recoil("fit", "times", "results", "--out", "fit")
    assert done.returncode == 1
    # of six synthetic ones five and how many more, and two of the other kind
    assert done.stderr.count("beside logs of people at a gun") == 8
    assert "... and 1 more like it" in done.stderr
    assert json.loads((tmp_path / "fit" / "fit.json").read_text())["people"] == ["P01", "P04"]


# a study


@pytest.fixture
def pilot(tmp_path: Path) -> Path:
    """A new study whose orders are balanced."""
    new_study(tmp_path / "pilot")
    config = tmp_path / "pilot" / "direction.toml"
    config.write_text(config.read_text().replace('sessions = "random"', 'sessions = "latin-square"'))
    return tmp_path / "pilot"


def do(pilot: Path, code: str, *, person: bool, **more: Any) -> Path:
    """A run by a synthetic participant, or one that is typed at a terminal as a person does it."""
    request = RunRequest(
        setup=load_setup(str(pilot / "direction.toml")),
        participant_id=code,
        results=pilot / "results",
        screen="terminal" if person else "synthetic",
        **more,
    )
    return run(request, synthetic_screen, VirtualClock()).place.journal


def test_a_synthetic_run_does_not_use_up_a_participant(recoil: Recoil, pilot: Path) -> None:
    do(pilot, "P01", person=False)
    do(pilot, "S01", person=False)
    found = json.loads(recoil("study", "pilot", "--json").stdout)
    runs = [one["experiments"]["direction"] for one in found["participants"]]
    assert [(run["state"], run["answered"], run["data"]) for run in runs] == [("synthetic", 60, "synthetic")] * 2
    assert (found["next"]["participant_id"], found["next"]["new"]) == ("P01", True)
    shown = recoil("study", "pilot").stdout
    assert "0 of 14 participants done, 0 excluded" in shown
    assert "2 runs of synthetic participants: not counted" in shown
    assert "last record" not in shown  # whose clock is that of a simulation


def test_it_gives_way_to_the_persons_run_and_is_kept(recoil: Recoil, pilot: Path) -> None:
    journal = do(pilot, "P01", person=False)
    made = journal.read_bytes()
    assert do(pilot, "P01", person=True) == journal
    assert journal.with_name(f"{journal.stem}.aside-1.jsonl").read_bytes() == made
    found = json.loads(recoil("study", "pilot", "--json").stdout)
    assert found["participants"][0]["experiments"]["direction"]["state"] == "done"
    assert "gave way to a person" in (pilot / "results" / "participants.jsonl").read_text()


def test_a_synthetic_run_never_takes_the_place_of_a_persons(pilot: Path) -> None:
    journal = do(pilot, "P01", person=True)
    made = journal.read_bytes()
    with pytest.raises(PlaceError, match="has finished direction"):
        do(pilot, "P01", person=False)
    assert journal.read_bytes() == made


def test_orders_are_balanced_among_people_and_among_synthetic_participants_apart(pilot: Path) -> None:
    for code in ("S01", "S02", "S03", "S04"):
        do(pilot, code, person=False)
    rows = [json.loads(line)["plan"]["order_row"] for line in heads(pilot)]
    assert rows == [0, 1, 2, 0]
    do(pilot, "P01", person=True)
    assert json.loads(heads(pilot)[0])["plan"]["order_row"] == 0


def heads(pilot: Path) -> list[str]:
    return [path.read_text().splitlines()[0] for path in sorted((pilot / "results").glob("sub-*/*_journal.jsonl"))]


def test_a_synthetic_practice_is_nobodys(pilot: Path) -> None:
    do(pilot, "P01", person=False, practice=True)
    (person,) = overview(open_study(pilot)).participants
    assert not person.runs[0].practised


def test_a_run_without_a_code_says_what_to_add(recoil: Recoil, tmp_path: Path) -> None:
    refused(recoil("run", "direction", "--screen", "synthetic"), "--participant S01")
    assert not (tmp_path / "results").exists()


def test_an_entry_of_the_rules_that_means_somebody_in_data_of_one_kind_is_not_called_idle(
    mixed: Path, tmp_path: Path
) -> None:
    listed = [(code, f'[[excluded]]\ncode = "{code}"\nreason = "a try"\n') for code in ("P02", "P77")]
    of_study = '[[excluded]]\ncode = "P02"\nstudy = "oslo"\nreason = "a try"\n'
    (tmp_path / "rules.toml").write_text("".join(text for _, text in listed) + of_study, encoding="utf-8")
    request = Request(paths=(mixed,), out=tmp_path / "out", rules=tmp_path / "rules.toml", include_synthetic=True)
    found = json.loads(result_files(request)["statistics.json"])
    nobody, nowhere = (one for one in found["warnings"] if "no log here" in one)
    assert nobody == "the rules exclude P77, who has no log here"
    assert nowhere.startswith("the rules exclude P02 of study 'oslo', who has no log here; studies here are ")
    assert "P02" in [one["participant"] for one in found["kept_apart"]["synthetic"]["excluded"]]


def test_tables_of_data_that_were_kept_apart_before_are_named_as_left_there(
    mixed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    (out / "synthetic").mkdir(parents=True)
    for name in ("statistics.json", "report.md", "synthetic/preference_long.csv", "synthetic/direction_wide.csv"):
        (out / name).write_text("of before", encoding="utf-8")
    analyze(Request(paths=(mixed,), out=out))
    assert "left there: synthetic/direction_wide.csv, synthetic/preference_long.csv" in capsys.readouterr().err
