"""Shipped designs by real keys at the console and at a terminal, each to its end; then statistics, figures and BIDS."""

from __future__ import annotations

import csv
import re
import statistics
import subprocess
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from experiments.config.door import read_toml
from experiments.config.toml_text import toml_text
from experiments.design.planning import plan_of
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import read_journal
from experiments.tasks.questions import choices
from tests.at_display import AtConsole, needs_display, virtual_display
from tests.at_runs import RUN, answers, words
from tests.at_terminal import AtTerminal
from tests.conftest import Soak
from tests.designs import OF_THE_PAPER, SHIPPED, design
from tests.warm_start import warm

pytest.importorskip("PyQt6")
pytestmark = [pytest.mark.soak, needs_display]

DESIGNS = (*SHIPPED, "ranked")
"""The shipped ones, and pairs that are chosen by the answers."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the shipped designs, each condition once and without breaks; results go beside them."""
    place = tmp_path_factory.mktemp("shipped")
    configs = place / "configs"
    (configs / "synthetic").mkdir(parents=True)
    for source in [*shipped_folder().glob("gun*.toml"), *shipped_folder().glob("synthetic/*.toml")]:
        (configs / source.relative_to(shipped_folder())).write_bytes(source.read_bytes())
    for name in SHIPPED:
        (configs / f"{name}.toml").write_text(toml_text(shortened(read_toml(shipped_folder() / f"{name}.toml"))))
    pairs = shortened(read_toml(shipped_folder() / "pairs.toml"))
    ranked = pairs | {"design": "ranked", "procedure": {"kind": "pairing", "of": ["method"], "trials": 8}}
    (configs / "ranked.toml").write_text(toml_text(ranked))
    return place


def shortened(design: dict[str, Any]) -> dict[str, Any]:
    order, trial = design.get("order", {}), design.get("trial", {})
    told = design["factors"].get("instruction", {"levels": ["none"]})
    short = {"repetitions": 1, "sets": len(told["levels"]), "balance": "session"}
    more: dict[str, Any] = {"catch": min(trial.get("catch", 0), 3)} if trial.get("catch") else {}
    more |= {"least_exposure_s": 0.0} if trial.get("kind") == "train" else {}
    return design | {
        **_short_tracks(design),
        "order": {key: value for key, value in order.items() if key != "longest_run"} | short,
        "trial": trial | more,
        "breaks": {},
        "fatigue": {"max_trials_without_break": 1000, "max_planned_s": 86_400.0},
        "console": {"guard_s": 0.0},
    }


def _short_tracks(design: dict[str, Any]) -> dict[str, Any]:
    """A procedure whose tracks are short, and end with their last trial alone."""
    ends = {key: 0 for key in ("reversals", "least_trials") if key in design.get("procedure", {})}
    return {"procedure": design["procedure"] | {"trials": 4} | ends} if "procedure" in design else {}


def keys_of(name: str, place: Path) -> Callable[[int], str]:
    """What is pressed for a trial: each answer of the design's choice in turn."""
    config = load_setup(str(place / "configs" / f"{name}.toml")).config
    keys = [one.key for question in config.questions.values() for one in choices(question)] or ["space"]
    return lambda trial: keys[trial % len(keys)]


@pytest.mark.parametrize("name", DESIGNS)
def test_each_design_is_run_by_real_keys_to_its_end(name: str, place: Path, soak: Soak) -> None:
    began_s = time.monotonic()
    run = words(place / "configs", name, "--participant", "P01")
    with virtual_display() as display, AtConsole(run, place, display) as screen:
        screen.answer, screen.rating = keys_of(name, place), lambda trial: str(2 + trial % 4)
        screen.stands(RUN)
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    trials = all_answered(name, place, "results")
    took = f"{time.monotonic() - began_s:.0f} s"
    soak(f"{name} at the console, by real keys", f"{trials} trials, all answered", "all", took)


def all_answered(name: str, place: Path, results: str) -> int:
    """How many trials the table of a finished run has; every one with an answer to every question."""
    contents = read_journal(journal_of(name, place, results))
    assert contents.finished
    with next((place / results / "sub-P01").glob(f"*task-{name}_[tr]*.csv")).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(contents.plan.trials)
    for question in load_setup(str(place / "configs" / f"{name}.toml")).config.questions:
        assert all(row[question] for row in rows), f"{question} has an empty answer"
    return len(rows)


def journal_of(name: str, place: Path, results: str) -> Path:
    return place / results / "sub-P01" / f"sub-P01_task-{name}_journal.jsonl"


def typed() -> Callable[[str, int], str]:
    """What a person types: what is asked for, numbers and answers in turn."""
    turns = count()

    def reply(asked: str, _: int) -> str:
        line = asked.rsplit("\n", 1)[-1].strip()
        if "type d and Enter" in line:
            return "d"
        if line.startswith("a number") or "     " in line:  # a rating's two ends
            return str(2 + next(turns) % 4)
        if keys := re.findall(r"(\w) = ", line):
            return keys[next(turns) % len(keys)]
        return "like a toy" if "words" in line else ""

    return reply


@pytest.mark.parametrize("name", DESIGNS)
def test_each_design_is_typed_at_a_terminal_killed_halfway_and_gone_on_with(name: str, place: Path, soak: Soak) -> None:
    began_s = time.monotonic()
    config = place / "configs" / f"{name}.toml"
    run = ["run", config, "--participant", "P01", "--screen", "terminal", "--results", "typed", "--seed", 1]
    reply, halfway = typed(), 1 + 3 * len(plan_of(load_setup(str(config)).config, "P01", 1).trials) // 2
    with AtTerminal(warm(*run), place) as screen:
        assert screen.work(reply, halfway) == halfway
        screen.kill()
        acknowledged = screen.seen.count("Saved.")
    kept = answers(journal_of(name, place, "typed"))
    assert len(kept) - acknowledged in (0, 1)  # the last one's word may not have come any more
    with AtTerminal(warm(*run, "--resume"), place) as screen:
        screen.work(reply)
        assert screen.end() == 0, screen.seen
    trials = all_answered(name, place, "typed")
    assert answers(journal_of(name, place, "typed"))[: len(kept)] == kept
    took = f"killed after {len(kept)} answers, {time.monotonic() - began_s:.0f} s"
    soak(f"{name} at a terminal, killed and resumed", f"{trials} trials, all answered", "all", took)


def test_what_they_leave_is_analysed_drawn_and_exported(place: Path, soak: Soak) -> None:
    for command in (["analyze", "results", "--out", "analysis"], ["export", "bids", "results"]):
        done = subprocess.run(warm(*command), cwd=place, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    report = (place / "analysis" / "report.md").read_text(encoding="utf-8")
    figures = {path.stem for path in (place / "analysis" / "figures").glob("*.png")}
    drawn = [name for name in DESIGNS if any(f"{one}-".startswith(f"figure-{name}-") for one in figures)]
    of_answers = {*OF_THE_PAPER, "ranked"}  # figures under other names; none without scores, as of who is never chosen
    assert {*drawn} - of_answers == {*DESIGNS} - of_answers
    titles = {load_setup(str(place / "configs" / f"{name}.toml")).config.title for name in drawn}
    assert all(title.rstrip("?") in report for title in titles)
    exported = {path.name.split("_task-")[1].split("_")[0] for path in (place / "results" / "bids").rglob("*_beh.tsv")}
    assert exported == set(DESIGNS)
    soak(
        "report, figures and BIDS of them all",
        f"{len(exported)} tasks exported, {len(drawn)} own figures",
        "all",
        "",
    )


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
