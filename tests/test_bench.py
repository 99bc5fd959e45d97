from __future__ import annotations

import json
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import pytest

from analysis.predict.bench import run as feature
from analysis.predict.synthetic_studies import percepts_of_methods
from analysis.report import apa
from analysis.report.terminal import unseen
from device.physics import FIDELITIES
from device.physics.scenes import SCENES
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.laws import DiffusionLaw, SyntheticAnswers
from experiments.synthetic.model_based import rates_by_instruction
from tests.conftest import Recoil

pytestmark = pytest.mark.slow

TRADES = ("physics", "procedures", "tests", "caution")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the bench."""
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="module")
def found(out: Path) -> feature.Bench:
    """All trades, measured with few shots, people and studies."""
    request = feature.BenchRequest(seed=1, repeats=1, batch=20, people=12, studies=100, progress=unseen)
    return feature.bench(out, TRADES, request)


@pytest.fixture(scope="module")
def rows(out: Path, found: feature.Bench) -> Any:
    assert tuple(found.parts) == TRADES
    return json.loads((out / "bench.json").read_text(encoding="utf-8"))


def test_the_page_begins_with_one_figure_of_all_trades_and_what_one_more_costs_and_buys(
    out: Path, found: feature.Bench
) -> None:
    first, second = (out / "report.md").read_text(encoding="utf-8").split("\n## ")[1:3]
    assert first.startswith("What one more costs, and what it buys")
    assert "figures/figure-trade.png" in first
    assert {line.split()[0] for line in feature.trade_lines(found)} == {"digit", "trial", "person", "100"}
    assert all(one.costs in first and one.buys in first for one in found.bought)
    assert second.startswith("Error against time")
    assert (out / "figures" / "figure-trade.png").stat().st_size > 10_000


def test_the_lines_of_the_first_panel_are_what_the_uses_ask_for(found: feature.Bench) -> None:
    panel = found.parts["physics"].panel
    assert panel is not None
    assert {one.name.split()[0]: one.height for one in panel.demands} == {
        name: min(scene.needs.values()) for name, scene in SCENES.items()
    }


def test_the_bench_tells_error_and_time_of_every_model(out: Path, rows: Any) -> None:
    models = rows["physics"]
    assert [(row["drive_off"], row["fidelity"]) for row in models] == [
        (drive_off, fidelity) for drive_off in ("open", "shorted") for fidelity in FIDELITIES
    ]
    assert all(row["single_us"] > 0 for row in models)
    assert all(row["least"] <= row["error"] for row in models)
    assert all(row["error"] <= row["stated"] for row in models if row["stated"] is not None)  # null: nothing promised
    assert {row["error"] for row in models if row["fidelity"] == "full"} == {0.0}
    page = (out / "report.md").read_text(encoding="utf-8")
    assert all(fidelity in page for fidelity in FIDELITIES)


def test_more_people_miss_less(rows: Any) -> None:
    missed = [1 - next(claim["share"] for claim in one["claims"] if claim["claim"] == "ANOVA") for one in rows["tests"]]
    assert [one["participants"] for one in rows["tests"]] == [4, 6, 8, 10, 14, 20, 28, 40]
    assert missed[0] > 0.4
    assert missed[-1] < 0.1
    assert [one["trials"] for one in rows["procedures"]] == [10, 20, 40, 80] * 4


def test_more_caution_takes_longer_and_is_right_more_often_where_anything_is_felt(rows: Any) -> None:
    curves = {method: list(own) for method, own in groupby(rows["caution"], lambda one: one["method"])}
    for method, own in curves.items():
        assert all(one["time_s"] < other["time_s"] for one, other in pairwise(own))
        assert method == "vibration" or all(one["right"] < other["right"] for one, other in pairwise(own))


def test_the_people_of_the_trade_are_right_as_often_as_the_model_says(rows: Any) -> None:
    setup = load_setup(shipped_folder() / "examples" / "hurry.toml")
    assert isinstance(setup.laws, SyntheticAnswers)
    law = setup.laws.questions["response"]
    assert isinstance(law, DiffusionLaw)
    percept = percepts_of_methods(setup.gun, ("asymmetric-2",), law)["asymmetric-2"]
    found = {one["instruction"]: one["right"] for one in rows["caution"] if one["method"] == "asymmetric-2"}
    for instruction, forward in rates_by_instruction(law.own, percept).items():  # who lean forward
        assert found[instruction] == pytest.approx(forward, abs=0.08)


def test_parts_without_a_trade_have_no_figure(recoil: Recoil, tmp_path: Path) -> None:
    out = tmp_path / "bench"
    done = recoil("bench", "post-hocs", "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found == json.loads((out / "bench.json").read_text(encoding="utf-8"))
    assert len(found["post-hocs"]) == 12
    assert all(row["data_sets"] == 20_000 for row in found["post-hocs"])
    page = (out / "report.md").read_text(encoding="utf-8")
    assert all(row["post_hoc"] in page for row in found["post-hocs"])
    pooled = next(row for row in found["post-hocs"] if row["claimed"] == 0.05)
    assert apa.number(pooled["null_error"], 4) in page
    assert (out / "report.html").stat().st_mode & 0o077 == 0
    assert not (out / "figures").exists()


def test_an_unknown_part_is_named_with_those_there_are(recoil: Recoil) -> None:
    done = recoil("bench", "horoscope")
    assert done.returncode == 2
    assert "horoscope" in done.stderr
    assert "post-hocs" in done.stderr
