"""`recoil fit times`: known parameters found again in logs, and times that are not the participant's own refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.predict.fit.times import TimesRequest, in_short, lapse_range, times
from analysis.report.terminal import unseen
from analysis.times.first_passage import distribution
from analysis.times.fit import answered_by, fit
from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.design.streams import generator
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests import figure_files
from tests.conftest import Recoil
from tests.decisions import decide_all, made
from tests.log_files import METHODS, TextRow, by_hand, trial_rows, trials_path, write_rows

DRIFTS = {"vibration": 0.0, "asymmetric-1": 1.0, "asymmetric-2": 1.8}
BOUNDARIES = {"speed": 1.2, "accuracy": 1.8}
START, T0_S = 0.55, 0.35
TRUTH = {f"drift {name}": value for name, value in DRIFTS.items()}
TRUTH |= {f"boundary {name}": value for name, value in BOUNDARIES.items()} | {"start": START, "non_decision_s": T0_S}


def decided(code: str, seed: int) -> list[TextRow]:
    """A participant's log whose answers and times are decided by the diffusion, every other set under speed."""
    rows = trial_rows(code, seed)
    told = ["speed" if int(row["set"]) % 2 else "accuracy" for row in rows]
    towards = np.array([1.0 if row["direction"] == "forward" else -1.0 for row in rows])
    drift = towards * np.array([DRIFTS[row["method"]] for row in rows])
    found = decide_all(drift, [BOUNDARIES[name] for name in told], START, T0_S, generator=generator(seed, "logs"))
    for i, row in enumerate(rows):
        row["response"] = "forward" if found.upper[i] else "backward"
        row["correct"] = str(int(row["response"] == row["direction"]))
        row |= {"response_time_s": f"{found.time_s[i]:.6f}", "instruction": told[i]}
    return rows


def study(folder: Path, people: int = 14) -> Path:
    for i in range(1, people + 1):
        write_rows(trials_path(folder, f"P{i:02d}"), decided(f"P{i:02d}", i))
    return folder


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return study(tmp_path_factory.mktemp("study"))


def estimates(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in rows}


@pytest.mark.slow
def test_known_parameters_are_found_again_within_their_intervals(logs: Path, recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("fit", "times", logs, "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found == json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))
    together = estimates(found["together"]["estimates"])
    assert set(together) == set(TRUTH)
    inside = [together[name]["ci_low"] <= true <= together[name]["ci_high"] for name, true in TRUTH.items()]
    assert sum(inside) >= len(TRUTH) - 1  # of seven intervals of 95 % one may miss
    for name, true in TRUTH.items():
        assert abs(together[name]["value"] - true) < 4 * together[name]["se"], name
    means = estimates(found["mean_of_people"])
    assert all(means[name]["people"] == 14 for name in TRUTH)
    assert means["boundary speed"]["value"] < means["boundary accuracy"]["value"]
    assert len(found["each"]) == 14
    assert {row["instruction"] for row in found["ez"]} == {"speed", "accuracy"}
    page = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "drift and boundary cannot be told apart" in page.replace("\N{NO-BREAK SPACE}", " ")
    assert "SYNTHETIC DATA: the times are of synthetic participants" in page.partition("\n## ")[0]
    assert (tmp_path / "out" / "figures" / "times.png").exists()


@pytest.mark.slow
def test_methods_of_a_map_stand_in_its_order_under_its_labels_wherever_they_are_told(tmp_path: Path) -> None:
    codes = {"vibration": "weak", "asymmetric-1": "mid", "asymmetric-2": "strong"}
    rows = [row | {"method": codes[row["method"]]} for seed in (1, 2) for row in decided(f"P{seed:02d}", seed)]
    names = ("participant_id", "method", "direction", "response", "response_time_s")
    lines = [",".join(row[name] for name in names) for row in rows]
    (tmp_path / "lab.csv").write_text("\n".join(["who,condition,shot,key,rt", *lines]) + "\n")
    (tmp_path / "map.toml").write_text(
        'experiment = "direction"\n[participant]\ncolumn = "who"\n[response_time]\nunit = "s"\n[columns]\n'
        'method = "condition"\ndirection = "shot"\nresponse = "key"\nresponse_time = "rt"\n[method]\n'
        'levels = ["weak", "mid", "strong"]\nlabels = {weak = "Zephyr", mid = "Breeze", strong = "Gale"}\n'
    )
    request = TimesRequest(paths=[tmp_path / "lab.csv"], columns=tmp_path / "map.toml", profiled=True)
    with figure_files.drawn("svg"):
        found = times(request, tmp_path / "out", iter, unseen)
    assert found.fit.methods == ("weak", "mid", "strong")
    for estimates_of in (found.fit.main_estimates, found.fit.together.estimates, found.fit.each["P01"].estimates):
        assert [one.name for one in estimates_of][:3] == ["drift weak", "drift mid", "drift strong"]
    told = "\n".join(in_short(found.fit, found.labels).items)
    drawing = (tmp_path / "out/figures/times.svg").read_text()
    page = (tmp_path / "out/report.md").read_text()
    for text in (told, drawing, page):
        places = [text.index(label) for label in ("Zephyr", "Breeze", "Gale")]
        assert places == sorted(places)
        assert not re.search(r"\b(weak|mid|strong)\b", text)


@pytest.mark.slow
@pytest.mark.parametrize("profiled", [False, True])
def test_that_the_best_share_of_lapses_is_none_is_no_want_of_data(tmp_path: Path, profiled: bool) -> None:
    request = TimesRequest(paths=[study(tmp_path / "logs", people=3)], lapses="0.2-60", profiled=profiled)
    found = times(request, tmp_path / "out", iter, unseen)
    (said,) = (line for line in in_short(found.fit, found.labels).items if "lapses" in line)
    assert said.startswith(
        "The share of lapses that fits best is none, the end of its range, so that it has no standard"
    )
    limit = f"is {found.fit.together.profiles['lapse'][1]:.3f}." if profiled else "; --profile gives its upper limit."
    assert said.endswith(limit)
    assert "do not determine lapse" not in (tmp_path / "out/report.md").read_text()


@pytest.mark.slow
def test_a_log_without_instructions_has_one_boundary(tmp_path: Path, recoil: Recoil) -> None:
    rows = [{key: value for key, value in row.items() if key != "instruction"} for row in decided("P01", 1)]
    write_rows(trials_path(tmp_path / "logs", "P01"), rows, header=list(rows[0]))
    done = recoil("fit", "times", "logs", "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["instructions"] == ["neutral"]
    assert [one["name"] for one in found["together"]["estimates"] if "boundary" in one["name"]] == ["boundary neutral"]
    assert (found["mean_of_people"], found["each"]) == (None, {})


@pytest.mark.slow
def test_a_table_that_was_rebuilt_is_used_and_named(tmp_path: Path) -> None:
    setup = load_setup("direction")
    request = RunRequest(setup=setup, participant_id="P01", results=tmp_path / "results", seed=1)
    run(request, synthetic_screen, VirtualClock()).place.table.unlink()
    done = times(TimesRequest(paths=[tmp_path / "results"]), tmp_path / "out", iter, unseen)
    (remark,) = done.remarks
    assert "its table is missing, so it was made again from this journal" in str(remark)
    page = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert "Used, but: sub-P01" in page
    assert "made again from this journal" in page


def test_times_by_the_experimenter_s_hand_are_refused_with_the_reason(tmp_path: Path, recoil: Recoil) -> None:
    write_rows(trials_path(tmp_path / "logs", "P01"), by_hand(decided("P01", 1)))
    done = recoil("fit", "times", "logs", "--out", "out")
    assert done.returncode == 2
    assert "experimenter's hand" in done.stderr
    assert "drift and boundary cannot be told apart" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_single_answers_by_the_experimenter_are_left_out_and_listed(tmp_path: Path, recoil: Recoil) -> None:
    rows = decided("P01", 1)
    write_rows(trials_path(tmp_path / "logs", "P01"), [*by_hand(rows[:3]), *rows[3:]])
    done = recoil("fit", "times", "logs", "--out", "out", "--json")
    assert done.returncode == 1, done.stderr
    assert "left out: 3 of 60 answered trials: the time came from the experimenter's hand" in done.stderr
    assert json.loads(done.stdout)["trials"] == 57


def test_no_log_at_all_is_said(tmp_path: Path, recoil: Recoil) -> None:
    done = recoil("fit", "times", tmp_path, "--out", "out")
    assert done.returncode == 2
    assert "no usable log of experiment 1" in done.stderr


@pytest.mark.slow
def test_of_another_design_it_is_said_who_fits_it_if_anybody_does(tmp_path: Path, recoil: Recoil) -> None:
    recoil("run", "magnitude", "--participant", "S1", "--screen", "synthetic", "--seed", "1", "--results", "logs")
    done = recoil("fit", "times", "logs", "--out", "out")
    assert "no usable log of experiment 1" in done.stderr
    assert "analyze --fits" not in done.stderr
    recoil("run", "hurry", "--participant", "S1", "--screen", "synthetic", "--seed", "1", "--results", "logs")
    done = recoil("fit", "times", "logs", "--out", "out")
    assert done.returncode == 2
    assert "of other designs (hurry) `recoil analyze --fits` fits the model" in done.stderr


@pytest.mark.parametrize("text", ["some", "3-0.2", "1", "1..2-3"])
def test_lapses_that_are_no_range_are_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="--lapses"):
        lapse_range(text)


def test_the_prediction_is_the_distribution_of_both_answers_and_ends_at_one() -> None:
    found = fit(made(1, people=4))
    values = {one.name: one.value for one in found.estimates}
    times = np.array([0.5, 1.0, 60.0])
    predicted = answered_by(found, times, condition=METHODS[1], instruction="speed", towards_upper=1.0)
    expected = distribution(
        times - values["non_decision_s"], True, values["drift asymmetric-1"], values["boundary speed"], values["start"]
    )
    assert predicted.right == pytest.approx(expected)
    assert predicted.right[-1] + predicted.wrong[-1] == pytest.approx(1.0)


@pytest.mark.slow
def test_predicted_lapses_are_coins_over_their_range() -> None:
    data = made(1, people=6, times=4, lapse=0.2)
    found = fit(data, lapses=(0.3, 3.0))
    late = answered_by(
        found, [100.0], condition=METHODS[2], instruction="speed", towards_upper=0.5, lapse_range_s=(0.3, 3.0)
    )
    assert late.right + late.wrong == pytest.approx([1.0])
    rate = found["lapse"].value
    plain = answered_by(found, [100.0], condition=METHODS[2], instruction="speed", lapse_range_s=None)
    assert plain.right + plain.wrong == pytest.approx([1.0 - rate])
