"""The ten designs by real keys at the console, each to its end; then their statistics, report, figures and BIDS."""

from __future__ import annotations

import csv
import statistics
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from experiments.config.door import read_toml, toml_text
from experiments.design.planning import plan_of
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import read_journal
from experiments.tasks.questions import choices
from tests.at_display import AtConsole, needs_display, virtual_display
from tests.at_runs import RUN, words
from tests.conftest import Soak
from tests.designs import design
from tests.warm_start import warm

pytest.importorskip("PyQt6")
pytestmark = [pytest.mark.soak, needs_display]

TEN = ("direction", "preference", "voltages", "detection", "stronger", "magnitude", "realism", "pairs", "grip", "hurry")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the ten designs, each condition once and without breaks; results go beside them."""
    place = tmp_path_factory.mktemp("ten")
    configs = place / "configs"
    (configs / "synthetic").mkdir(parents=True)
    for source in [*shipped_folder().glob("gun*.toml"), *shipped_folder().glob("synthetic/*.toml")]:
        (configs / source.relative_to(shipped_folder())).write_bytes(source.read_bytes())
    for name in TEN:
        (configs / f"{name}.toml").write_text(toml_text(shortened(read_toml(shipped_folder() / f"{name}.toml"))))
    return place


def shortened(design: dict[str, Any]) -> dict[str, Any]:
    order, trial = design.get("order", {}), design.get("trial", {})
    told = design["factors"].get("instruction", {"levels": ["none"]})
    short = {"repetitions": 1, "sets": len(told["levels"]), "balance": "session"}
    more = {"catch": min(trial.get("catch", 0), 3)} if trial.get("catch") else {}
    return design | {
        "order": {key: value for key, value in order.items() if key != "longest_run"} | short,
        "trial": trial | more,
        "breaks": {},
        "fatigue": {"max_trials_without_break": 1000, "max_planned_s": 86_400.0},
        "console": {"guard_s": 0.0},
    }


def keys_of(name: str, place: Path) -> Callable[[int], str]:
    """What is pressed for a trial: each answer of the design's choice in turn."""
    config = load_setup(str(place / "configs" / f"{name}.toml")).config
    keys = [one.key for question in config.questions.values() for one in choices(question)] or ["space"]
    return lambda trial: keys[trial % len(keys)]


@pytest.mark.parametrize("name", TEN)
def test_each_design_is_run_by_real_keys_to_its_end(name: str, place: Path, soak: Soak) -> None:
    began_s = time.monotonic()
    run = words(place / "configs", name, "--participant", "P01")
    with virtual_display() as display, AtConsole(run, place, display) as screen:
        screen.answer, screen.rating = keys_of(name, place), lambda trial: str(2 + trial % 4)
        screen.stands(RUN)
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    journal = next((place / "results" / "sub-P01").glob(f"*task-{name}_journal.jsonl"))
    contents = read_journal(journal)
    assert contents.finished
    with next(journal.parent.glob(f"*task-{name}_[tr]*.csv")).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(contents.plan.trials)
    for question in load_setup(str(place / "configs" / f"{name}.toml")).config.questions:
        assert all(row[question] for row in rows), f"{question} has an empty answer"
    took = f"{time.monotonic() - began_s:.0f} s"
    soak(f"{name} at the console, by real keys", f"{len(rows)} trials, all answered", "all", took)


def test_what_they_leave_is_analysed_drawn_and_exported(place: Path, soak: Soak) -> None:
    for command in (["analyze", "results", "--out", "analysis"], ["export", "bids", "results"]):
        done = subprocess.run(warm(*command), cwd=place, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    report = (place / "analysis" / "report.md").read_text(encoding="utf-8")
    drawn = [name for name in TEN if (place / "analysis" / "figures" / f"figure-{name}.png").exists()]
    assert set(drawn) == set(TEN) - {"direction", "preference"}  # their own figures stand under other names
    assert all(load_setup(name).config.title.rstrip("?") in report for name in drawn)
    exported = {path.name.split("_task-")[1].split("_")[0] for path in (place / "results" / "bids").rglob("*_beh.tsv")}
    assert exported == set(TEN)
    soak("report, figures and BIDS of the ten", f"{len(exported)} tasks exported, {len(drawn)} own figures", "all", "")


@pytest.mark.parametrize(
    "order",
    [
        {"repetitions": 2500},
        {"session": ["method"], "sets": 50, "repetitions": 2500, "balance": "set"},
        {"repetitions": 2500, "longest_run": {"direction": 3}},
    ],
    ids=["at random", "sessions of balanced sets", "no direction more than three times"],
)
def test_ten_thousand_trials_are_planned_in_time(
    order: dict[str, Any], soak: Soak, request: pytest.FixtureRequest
) -> None:
    factors = {"method": {"levels": ["a", "b"]}, "direction": {"levels": ["forward", "backward"]}}
    config, times = design(factors=factors, order=order), []
    for seed in range(5):
        began_s = time.perf_counter()
        plan = plan_of(config, "P01", seed)
        times.append(time.perf_counter() - began_s)
    assert len(plan.trials) == 10_000
    how = request.node.callspec.id
    soak(f"10,000 trials planned, {how}", f"{statistics.median(times):.2f} s", "0.5 s", "median of 5")
    assert statistics.median(times) < 0.5
