"""Speed and accuracy from logs: the numbers of `statistics.json` against direct calls, closed forms and by hand."""

from __future__ import annotations

import csv
import itertools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis.logs.reading import read_logs
from analysis.report.page import write_page
from analysis.report.section import Section
from analysis.summary.figures.trade import (
    draws_curve,
    draws_points,
    figure_conditional_accuracy,
    figure_quantile_probability,
    has_curve,
    has_points,
)
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.pictures import write_figures
from analysis.summary.sections.shown_trades import shown_trades
from analysis.summary.sections.trade import trade_details, trade_sections
from analysis.summary.summary import summarize
from analysis.times import trade
from analysis.times.first_passage import moments
from analysis.times.fit import fit
from analysis.times.likelihood import trials_of
from analysis.times.own_trials import ordered, own_trials, quantiles
from analysis.times.people import MOST_PEOPLE, as_trials, fit_people
from analysis.times.speed_accuracy import SpeedAccuracy
from analysis.times.trade import ez, ez_people
from experiments.design.streams import generator
from experiments.record import tables
from tests.decisions import decide_all
from tests.log_files import METHODS, TextRow, by_hand, trial_rows, trials_path, write_many, write_rows

pytestmark = pytest.mark.slow

DRIFTS = {"vibration": 0.0, "asymmetric-1": 1.2, "asymmetric-2": 2.0}
BOUNDARIES = {"speed": 1.0, "": 1.5, "accuracy": 2.0}
T0_S = 0.35


def diffused(code: str, trials: int, instructions: tuple[str, ...] = ("",), start: float = 0.5) -> list[TextRow]:
    """A person's log with `trials` of each method, its answers and times drawn from the diffusion."""
    rows = []
    for session, (method, drift) in enumerate(DRIFTS.items(), start=1):
        k = np.arange(trials)
        forward, told = k % 2 == 0, k // 2 % len(instructions)
        boundary = np.array([BOUNDARIES[name] for name in instructions])[told]
        draws = generator(5, "log", code, method)
        drawn = decide_all(np.where(forward, drift, -drift), boundary, start, T0_S, generator=draws)
        for i in range(trials):
            direction, response = (("backward", "forward")[int(flag)] for flag in (forward[i], drawn.upper[i]))
            rows.append(
                {
                    "participant_id": code,
                    "experiment": "direction",
                    "session": str(session),
                    "method": method,
                    "set": "1",
                    "trial": str(i + 1),
                    "direction": direction,
                    "response": response,
                    "correct": str(int(response == direction)),
                    "response_time_s": repr(float(drawn.time_s[i])),
                    "response_source": "participant",
                    "response_time_valid": "1",
                    "instruction": instructions[told[i]],
                }
            )
    return rows


def study(
    folder: Path, people: int = 6, trials: int = 60, instructions: tuple[str, ...] = ("speed", "accuracy")
) -> Path:
    for i in range(people):
        write_rows(trials_path(folder, f"P{i:02d}"), diffused(f"P{i:02d}", trials, instructions))
    return folder


def found_in(folder: Path) -> Any:
    return summarize(read_logs([folder]), fits=True).to_dict()["direction"]["speed_accuracy"]


def rows_of(folder: Path) -> list[dict[str, str]]:
    """All rows, read with Python's own reader."""
    rows: list[dict[str, str]] = []
    for path in sorted(folder.rglob("*_trials.csv")):
        with path.open(encoding="utf-8", newline="") as stream:
            rows += csv.DictReader(stream)
    return rows


def cell_of(folder: Path, method: str, instruction: str) -> tuple[list[int], list[float], list[str], list[str]]:
    """Correct, times, sources and people of a cell."""
    rows = rows_of(folder)
    mine = [row for row in rows if (row["method"], row["instruction"]) == (method, instruction)]
    return (
        [int(row["correct"]) for row in mine],
        [float(row["response_time_s"]) for row in mine],
        [row["response_source"] for row in mine],
        [row["participant_id"] for row in mine],
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return study(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="module")
def statistics(folder: Path) -> StudyStatistics:
    return summarize(read_logs([folder]), fits=True)


@pytest.fixture(scope="module")
def found(statistics: StudyStatistics) -> Any:
    return statistics.to_dict()["direction"]["speed_accuracy"]


def sections_of(statistics: StudyStatistics) -> list[Section]:
    """What was measured, then the appendix with scores and models."""
    report = ReportData(title="Trade", statistics=statistics)
    return [*trade_sections(report), *trade_details(report)]


def page_of(sections: list[Section], out: Path) -> str:
    write_page(out, "Trade", tuple(sections))
    return (out / "report.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("instruction", ["speed", "accuracy"])
def test_each_cell_equals_direct_calls_on_its_rows(folder: Path, found: Any, method: str, instruction: str) -> None:
    cell, rows = found["methods"][method][instruction], cell_of(folder, method, instruction)
    assert cell["n"] == len(rows[0]) == 180
    curve, points = trade.conditional_accuracy(*rows), trade.quantile_probability(*rows)
    assert cell["conditional_accuracy"]["accuracy"] == pytest.approx(curve.accuracy.tolist())
    assert cell["conditional_accuracy"]["mean_time_s"] == pytest.approx(curve.mean_time_s.tolist())
    assert cell["quantile_probability"]["probability"] == pytest.approx(points.probability.tolist())
    for own, direct in zip(cell["quantile_probability"]["quantiles_s"], points.quantiles_s, strict=True):
        assert own == (pytest.approx(direct.tolist()) if np.isfinite(direct).all() else [None] * 5)


@pytest.mark.parametrize("instruction", ["speed", "accuracy"])
def test_means_over_people_are_those_of_their_own_values(folder: Path, found: Any, instruction: str) -> None:
    correct, times, sources, people = map(np.array, cell_of(folder, "asymmetric-1", instruction))
    cell = found["methods"]["asymmetric-1"][instruction]
    each = [people == code for code in sorted(set(people))]
    rates = np.array([correct[rows].mean() for rows in each])
    right_s = np.array([times[rows & (correct == 1)].mean() for rows in each])
    half = stats.t.ppf(0.975, 5) * rates.std(ddof=1) / np.sqrt(6)
    assert cell["accuracy"]["mean"] == pytest.approx(rates.mean())
    assert cell["accuracy"]["ci_low"] == pytest.approx(rates.mean() - half)
    assert cell["median_s"]["mean"] == pytest.approx(np.mean([np.median(times[rows]) for rows in each]))
    assert cell["mean_s"]["mean"] == pytest.approx(np.mean([times[rows].mean() for rows in each]))
    efficiency = trade.inverse_efficiency(rates, right_s)
    assert cell["inverse_efficiency_s"]["mean"] == pytest.approx(efficiency.mean())
    single = [ez(correct[rows], times[rows], sources[rows]) for rows in each]
    assert not any(one.reason for one in single)
    for name in ("drift", "boundary", "non_decision_s"):
        assert cell["ez"][name]["mean"] == pytest.approx(np.mean([getattr(one, name) for one in single]))


def test_balanced_integration_is_over_all_cells_together(folder: Path, found: Any) -> None:
    cells = list(itertools.product(METHODS, ("speed", "accuracy")))
    rates, times = [], []
    for method, instruction in cells:
        correct, seconds, _, people = map(np.array, cell_of(folder, method, instruction))
        each = [people == code for code in sorted(set(people))]
        rates.append([correct[rows].mean() for rows in each])
        times.append([seconds[rows & (correct == 1)].mean() for rows in each])
    scores = trade.balanced_integration(np.transpose(rates), np.transpose(times)).mean(axis=0)
    shown = [found["methods"][method][told]["balanced_integration"]["mean"] for method, told in cells]
    assert shown == pytest.approx(scores.tolist())
    assert sum(shown) == pytest.approx(0.0, abs=1e-12)


def test_the_diffusion_fits_are_those_of_the_same_rows(folder: Path, found: Any) -> None:
    rows = rows_of(folder)
    trials = trials_of(
        upper=[row["response"] == "forward" for row in rows],
        time_s=[float(row["response_time_s"]) for row in rows],
        sources=[row["response_source"] for row in rows],
        towards_upper=[row["direction"] == "forward" for row in rows],
        condition=[row["method"] for row in rows],
        instruction=[row["instruction"] for row in rows],
        person=[row["participant_id"] for row in rows],
    )
    each, together = fit_people(trials), fit(trials, by_person=True)
    shown = found["diffusion"]
    assert (shown["people"], shown["fitted"], shown["trials"]) == (6, 6, 1080)
    means = {mean.name: mean for mean in each.means}
    assert set(shown["each"]["estimates"]) == set(means)
    for name, one in shown["each"]["estimates"].items():
        assert [one["mean"], one["ci_low"]] == pytest.approx([means[name].value, means[name].ci_low], abs=1e-4)
    for name, one in shown["together"]["estimates"].items():
        assert [one["value"], one["ci_high"]] == pytest.approx([together[name].value, together[name].ci_high], abs=1e-4)


def test_estimates_lie_around_what_the_answers_were_drawn_with(found: Any) -> None:
    """Everybody is alike here, so the fit of all trials is right: within 4 standard errors."""
    truth = {f"drift {method}": drift for method, drift in DRIFTS.items()}
    truth |= {"boundary speed": 1.0, "boundary accuracy": 2.0, "start": 0.5, "non_decision_s": T0_S}
    estimates = found["diffusion"]["together"]["estimates"]
    assert set(estimates) == set(truth)
    for name, one in estimates.items():
        assert abs(one["value"] - truth[name]) < 4 * one["se"]


def test_accuracy_times_and_ez_are_the_closed_forms_of_the_diffusion(tmp_path: Path) -> None:
    found = found_in(study(tmp_path, people=4, trials=800, instructions=("",)))
    assert found["instructions"] == ["neutral"]
    assert found["instruction_effects"] == []
    for method in ("asymmetric-1", "asymmetric-2"):
        exact, cell = moments(DRIFTS[method], 1.5), found["methods"][method]["neutral"]
        p, n = float(exact.upper), cell["n"]
        assert abs(cell["accuracy"]["mean"] - p) < 4.5 * np.sqrt(p * (1 - p) / n)
        assert abs(cell["mean_s"]["mean"] - T0_S - exact.mean_s) < 4.5 * np.sqrt(float(exact.variance_s2) / n)
        shown = [cell["ez"][name]["mean"] for name in ("drift", "boundary", "non_decision_s")]
        assert shown == pytest.approx([DRIFTS[method], 1.5, T0_S], rel=0.06)


# What is refused


def test_times_from_the_experimenters_hand_are_refused_with_the_reason(tmp_path: Path) -> None:
    for seed, code in enumerate(("P01", "P02")):
        write_rows(trials_path(tmp_path / "study", code), by_hand(trial_rows(code, seed)))
    statistics = summarize(read_logs([tmp_path / "study"]))
    found = statistics.to_dict()["direction"]["speed_accuracy"]
    assert (found["n"], found["answered"], found["methods"]) == (0, 120, {})
    assert "the experimenter's hand" in found["reason"]
    assert found["refused"]["experimenter"]["trials"] == 120
    assert "reaction to it" in found["refused"]["experimenter"]["why"]
    (section,) = sections_of(statistics)
    text = page_of([section], tmp_path)
    assert "all times came from the experimenter's hand" in text
    assert "Refused of 120 answered trials: 120 because the time came from the experimenter's hand" in text
    assert not section.pictures
    (shown,) = shown_trades(statistics)
    for figure in (figure_conditional_accuracy, figure_quantile_probability):
        with pytest.raises(ValueError, match="needs 20"):
            figure(shown.trade, shown.names, tmp_path / "none")


def test_single_times_that_are_nobodys_own_are_counted_by_reason(tmp_path: Path) -> None:
    rows = trial_rows("P01")
    rows[0] |= {"response_source": "experimenter", "response_time_valid": "0"}
    rows[1] |= {"response_time_valid": "0"}
    rows[2] |= {"response_time_s": ""}
    rows[3] |= {"response_time_s": "0"}
    rows[4] |= {"response_time_s": "0.0"}
    rows[5] |= {"response_source": ""}
    rows[6] |= {"response_source": "experimenter"}
    write_rows(trials_path(tmp_path, "P01"), rows)
    found = found_in(tmp_path)
    counts = {reason: one["trials"] for reason, one in found["refused"].items()}
    assert counts == {"experimenter": 2, "no_source": 1, "no_time": 1, "not_valid": 1, "not_above_0": 2}
    assert found["n"] == found["answered"] - sum(counts.values()) == 53
    assert sum(cell["neutral"]["n"] for cell in found["methods"].values()) == 53


# The column of instructions


def test_a_log_without_the_column_is_one_without_instructions(tmp_path: Path) -> None:
    header = [name for name in tables.names("direction") if name != "instruction"]
    for code in ("P01", "P02", "P03"):
        write_rows(trials_path(tmp_path / "old", code), trial_rows(code), header)
        told = [row | {"instruction": ("neutral", "")[k % 2]} for k, row in enumerate(trial_rows(code))]
        write_rows(trials_path(tmp_path / "new", code), told)
    old, new = (found_in(tmp_path / name) for name in ("old", "new"))
    assert json.dumps(old) == json.dumps(new)
    assert old["instructions"] == ["neutral"]


def test_instructions_nobody_knows_are_kept_as_they_are(tmp_path: Path) -> None:
    for seed, code in enumerate(("P01", "P02")):
        told = enumerate(trial_rows(code, seed))
        rows = [row | {"instruction": ("speed", "be brave, 100 %")[k % 2]} for k, row in told]
        write_rows(trials_path(tmp_path, code), rows)
    logs = read_logs([tmp_path])
    assert not logs.problems
    assert summarize(logs).to_dict()["direction"]["speed_accuracy"]["instructions"] == ["be brave, 100 %", "speed"]


def test_the_effect_of_an_instruction_is_paired_by_person(tmp_path: Path) -> None:
    """By hand: in haste each takes 0.2 s less, P01 errs in half of the trials and P02 in a quarter of them."""
    for code, step in (("P01", 2), ("P02", 4)):
        rows = trial_rows(code)
        for k, row in enumerate(rows):
            hasty = k % 20 < 12
            wrong = hasty and k % 20 % step == 0
            other = {"forward": "backward", "backward": "forward"}[row["direction"]]
            row |= {"response": other if wrong else row["direction"], "correct": str(int(not wrong))}
            row |= {"instruction": "speed" if hasty else "accuracy", "response_time_s": "0.5" if hasty else "0.7"}
        write_rows(trials_path(tmp_path, code), rows)
    effects = found_in(tmp_path)["instruction_effects"]
    assert [(one["a"], one["b"], one["method"]) for one in effects] == [
        ("speed", "accuracy", method) for method in (None, *METHODS)
    ]
    half = stats.t.ppf(0.975, 1) * np.std([-0.5, -0.25], ddof=1) / np.sqrt(2)
    for one in effects:
        assert one["accuracy"]["mean"] == pytest.approx(-0.375)
        assert one["accuracy"]["ci_low"] == pytest.approx(-0.375 - half)
        assert one["mean_s"]["mean"] == pytest.approx(-0.2)
        assert one["mean_s"]["people"] == 2


def test_people_who_were_told_different_things_count_each_for_their_own(tmp_path: Path) -> None:
    """Between people: no pairs, and each boundary is the mean over those who were told so."""
    for i, told in enumerate(("speed", "speed", "accuracy", "accuracy", "accuracy")):
        write_rows(trials_path(tmp_path, f"P{i}"), diffused(f"P{i}", 60, (told,)))
    found = found_in(tmp_path)
    assert {one["accuracy"]["people"] for one in found["instruction_effects"]} == {0}
    section, _ = sections_of(summarize(read_logs([tmp_path])))
    assert any("No participant was told two things" in text for text in section.paragraphs)
    assert not [table for table in section.tables if "Effect of the instruction" in table.caption]
    estimates = found["diffusion"]["each"]["estimates"]
    counts = {name: estimates[f"boundary {name}"]["people"] for name in ("speed", "accuracy")}
    assert counts == {"speed": 2, "accuracy": 3}
    assert estimates["boundary speed"]["mean"] == pytest.approx(1.0, rel=0.15)
    assert estimates["boundary accuracy"]["mean"] == pytest.approx(2.0, rel=0.15)
    assert found["methods"]["vibration"]["speed"]["balanced_integration"] == {
        **dict.fromkeys(("mean", "sd", "ci_low", "ci_high")),
        "people": 0,
    }


# Data that tell little


def changed(rows: list[TextRow], kind: str) -> list[TextRow]:
    if kind == "all correct":
        return [row | {"response": row["direction"], "correct": "1"} for row in rows]
    if kind == "all wrong":
        other = {"forward": "backward", "backward": "forward"}
        return [row | {"response": other[row["direction"]], "correct": "0"} for row in rows]
    if kind == "no times":
        return [row | {"response_time_s": "", "response_time_valid": ""} for row in rows]
    if kind == "one trial":
        return [row for row in rows if row["trial"] == "1"]
    if kind == "one time":
        return [row if k == 0 else row | {"response_time_valid": "0"} for k, row in enumerate(rows)]
    return [row | {"instruction": f"told ${row['session']}_$ {'at length ' * 9}"} for row in rows]


KINDS = ["all correct", "all wrong", "no times", "one trial", "one time", "told by method"]


OF_TWO = ("all correct", "no times", "one trial", "one time", "told by method")


@pytest.mark.parametrize(("kind", "people"), [*((kind, 1) for kind in KINDS), *((kind, 2) for kind in OF_TWO)])
def test_whatever_the_log_there_is_a_section_and_no_nan(kind: str, people: int, tmp_path: Path) -> None:
    for i in range(people):
        rows = trial_rows(f"P{i}", i, sets=2)
        for row in rows if kind == "one trial" else ():
            row |= {"direction": "forward", "correct": str(int(row["response"] == "forward"))}
        write_rows(trials_path(tmp_path / "study", f"P{i}"), changed(rows, kind))
    statistics = summarize(read_logs([tmp_path / "study"]), fits=True)
    found = statistics.direction
    assert found.n == people
    json.dumps(statistics.to_dict(), allow_nan=False)
    assert not [warning for warning in statistics.warnings if "speed_accuracy" in warning]
    sections = sections_of(statistics)
    told = [text for section in sections for text in section.paragraphs]
    cells = [*told, *(cell for one in sections for table in one.tables for row in table.rows for cell in row)]
    assert not [cell for cell in cells if re.search(r"\b(nan|None|inf)\b", cell)]
    (trade_of,) = shown_trades(statistics)
    drawn = zip(trade_of.stems, (has_curve(found.speed_accuracy), has_points(found.speed_accuracy)), strict=True)
    shown = {picture.stem for section in sections for picture in section.pictures}
    assert shown - {"figure-response-times"} == {stem for stem, there in drawn if there}
    fits = statistics.to_dict()["direction"]["speed_accuracy"].get("diffusion") or {"together": None}
    clear = fits["together"] is not None and fits["together"]["reason"] is None
    one_fit = any("With one participant" in text for text in told)
    assert one_fit == (people == 1 and clear)
    assert any("trials behind a point" in text for text in told) == isinstance(trade_of.trade, SpeedAccuracy)


def test_what_rests_on_fewer_than_twenty_trials_is_not_drawn_and_the_report_says_so(tmp_path: Path) -> None:
    """100 trials of one method are five bins of 20; of the others 95 are five of 19, and 19 errors are not 20."""
    rows = trial_rows("P1", sets=20)
    rows = [row for row in rows if row["method"] == METHODS[0] or int(row["trial"]) <= 95]
    for row in rows:
        wrong = int(row["trial"]) <= (20 if row["method"] == METHODS[0] else 19)
        other = "backward" if row["direction"] == "forward" else "forward"
        row |= {"response": other if wrong else row["direction"], "correct": str(int(not wrong))}
    write_rows(trials_path(tmp_path / "study", "P1"), rows)
    section = sections_of(statistics := summarize(read_logs([tmp_path / "study"])))[0]
    assert [text for text in section.paragraphs if text.startswith("No ")] == [
        "No conditional accuracy function is drawn with fewer than 20 trials behind a point: Asymmetric Force I (19), "
        "Asymmetric Force II (19).",
        "No time quantiles are drawn of fewer than 20 answers by participants with 5 of the kind: errors of Asymmetric "
        "Force I (19), Asymmetric Force II (19).",
    ]
    (shown,) = shown_trades(statistics)
    cells = [cell for of_method in shown.trade.methods.values() for cell in of_method.values()]
    assert [draws_curve(cell) for cell in cells] == [True, False, False]
    assert [draws_points(cell) for cell in cells] == [(True, True), (False, True), (False, True)]
    alts = {picture.stem: picture.alt for picture in section.pictures}
    assert "Asymmetric" not in alts["figure-conditional-accuracy"]
    assert "median of errors" not in alts["figure-quantile-probability"].partition("Asymmetric")[2]


@pytest.mark.parametrize("kind", ["all correct", "told by method"])
def test_figures_are_drawn_where_there_is_little_to_draw(kind: str, tmp_path: Path) -> None:
    write_rows(trials_path(tmp_path, "P1"), changed(trial_rows("P1", sets=20), kind))
    (found,) = shown_trades(summarize(read_logs([tmp_path])))
    figure_conditional_accuracy(found.trade, found.names, tmp_path / "curve")
    figure_quantile_probability(found.trade, found.names, tmp_path / "points")
    assert all((tmp_path / f"{name}.png").is_file() for name in ("curve", "points"))


def test_the_order_of_the_files_changes_nothing(folder: Path, found: Any, tmp_path: Path) -> None:
    for i in range(6):
        rows = rows_of(folder / f"sub-P{i:02d}")
        write_rows(tmp_path / f"{9 - i}_trials.csv", rows)
    assert json.dumps(found_in(tmp_path)) == json.dumps(found)


# At the speed of arrays


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 7))
def test_bins_and_quantiles_are_those_of_numpy_person_by_person(seed: int, people: int, bins: int) -> None:
    draws = np.random.default_rng(seed)
    n = int(draws.integers(1, 40))
    person, right = draws.integers(0, people, n), draws.integers(0, 2, n)
    times = np.round(0.2 + draws.random(n), 1 + seed % 2)
    found = trade.conditional_accuracy(right, times, ["participant"] * n, person, bins)
    parts = []
    for code in np.unique(person):
        rows = np.flatnonzero(person == code)
        rows = rows[np.argsort(times[rows], kind="stable")]
        if rows.size >= bins:
            parts.append([[v[part].mean() for part in np.array_split(rows, bins)] for v in (times, right)])
    assert found.people == len(parts)
    if parts:
        assert np.array([found.mean_time_s, found.accuracy]) == pytest.approx(np.mean(parts, axis=0))
    each = quantiles(times, ordered(person, times), trade.QUANTILES)
    expected = [np.quantile(times[person == code], trade.QUANTILES) for code in np.unique(person)]
    assert each == pytest.approx(np.array(expected))


def test_ez_of_many_people_is_each_ones_own() -> None:
    draws = generator(4, "many")
    person = np.repeat(np.arange(40), 25)
    drawn = decide_all(np.where(person % 2, 0.0, 1.6), 2.2, 0.5, 0.05, generator=draws)
    right = (drawn.upper | (person == 7)) & (person != 9)
    times = np.select([person == 8, person == 7], [0.5, 1.0 + drawn.time_s / 5.0], drawn.time_s)
    sources = np.full(1000, "participant")
    found = ez_people(right, times, sources, person)
    for code in range(40):
        rows = person == code
        one = ez(right[rows], times[rows], sources[rows])
        assert (one.reason is not None) == bool(found.few[code] | found.flat[code] | found.impossible[code])
        if one.reason is None:
            mine = found.drift[code], found.boundary[code], found.non_decision_s[code]
            assert mine == pytest.approx((one.drift, one.boundary, one.non_decision_s))
            assert bool(found.corrected[code]) == one.corrected
    assert found.few.any()
    assert found.impossible.any()
    assert (found.corrected[7], found.flat[8]) == (True, True)
    with pytest.raises(ValueError, match="at least 2"):
        ez_people(right, times, sources, person, 1)


def test_a_high_bar_of_correct_answers_keeps_the_lucky_guessers() -> None:
    """Of 20 trials without any drift: 10 correct answers asked for give a drift of 0.2, and 5 none."""
    person = np.repeat(np.arange(3_000), 20)
    drawn = decide_all(0.0, 1.5, 0.5, 0.35, generator=generator(6, "luck"), shape=(60_000,))
    sources = np.full(60_000, "synthetic")
    low, high = (ez_people(drawn.upper, drawn.time_s, sources, person, fewest) for fewest in (5, 10))
    assert abs(np.nanmean(low.drift)) < 0.03
    assert 0.15 < np.nanmean(high.drift) < 0.3
    assert 0.92 < np.nanmean(low.boundary) / 1.5 < 1.0
    assert 0.01 < np.nanmean(low.non_decision_s) - 0.35 < 0.06


def test_a_crowd_is_fitted_by_a_sample_of_people_whose_codes_are_evenly_spaced(tmp_path: Path) -> None:
    people = 3 * MOST_PEOPLE // 2
    logs = read_logs([write_many(tmp_path, people)])
    shown = summarize(logs, fits=True).to_dict()["direction"]["speed_accuracy"]
    sample = shown["diffusion"]
    assert shown["people"] == people
    assert (sample["people"], sample["fitted"], sample["trials"]) == (people, MOST_PEOPLE, 60 * MOST_PEOPLE)
    own = own_trials(logs.trials, METHODS)
    chosen = np.round(np.linspace(0, people - 1, MOST_PEOPLE)).astype(int)
    direct = fit(as_trials(own.of(np.isin(own.person, chosen))), by_person=True)
    for name, one in sample["together"]["estimates"].items():
        assert [one["value"], one["se"]] == pytest.approx([direct[name].value, direct[name].se], abs=1e-4)


# The report


def test_the_section_shows_figures_tables_and_caveats(statistics: StudyStatistics, tmp_path: Path) -> None:
    measured, made_of_it = sections_of(statistics)
    stems = ["figure-response-times", "figure-conditional-accuracy", "figure-quantile-probability"]
    assert [picture.stem for picture in measured.pictures] == stems
    assert made_of_it.appendix
    assert made_of_it.folded
    write_figures(tmp_path / "figures", ReportData(title="Trade", statistics=statistics))
    text = page_of([measured, made_of_it], tmp_path)
    for words in (
        "## Speed and accuracy",
        "1,080 of 1,080 answered trials have a time of the answerer's own hand (6 participants).",
        "| Vibration, speed | 180 |",
        "| speed − accuracy | all conditions | 6 |",
        "Not to be trusted above about 10 % errors",
        "cannot be compared between studies",
        "| drift Asymmetric Force II | 1/√s |",
        "Where people differ it is biased",
    ):
        assert words in text
    for stem in ("conditional-accuracy", "quantile-probability"):
        assert f"figures/figure-{stem}.png" in text
        assert (tmp_path / "figures" / f"figure-{stem}.png").stat().st_size > 5_000


def test_the_diffusion_is_fitted_only_where_that_was_asked_for(folder: Path) -> None:
    statistics = summarize(read_logs([folder]))
    fits = statistics.to_dict()["direction"]["speed_accuracy"]["diffusion"]
    assert (fits["fitted"], fits["each"], fits["together"]) == (0, None, None)
    assert "recoil analyze --fits" in fits["reason"]
    _, made_of_it = sections_of(statistics)
    assert not [table for table in made_of_it.tables if "Diffusion model" in table.caption]


def test_the_interval_of_a_mean_rate_stays_within_0_and_1(tmp_path: Path) -> None:
    """By Student's t alone one miss of three people reaches 113 %."""
    for i in range(3):
        rows = changed(trial_rows(f"P{i}", i), "all correct")
        if i == 0:
            rows[0] |= {"response": "forward" if rows[0]["direction"] == "backward" else "backward", "correct": "0"}
        write_rows(trials_path(tmp_path, f"P{i}"), rows)
    cell = found_in(tmp_path)["methods"][rows[0]["method"]]["neutral"]["accuracy"]
    assert cell["mean"] < 1.0 == cell["ci_high"]
    assert 0.0 < cell["ci_low"] < cell["mean"]
