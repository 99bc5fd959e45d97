"""A study as its README says, edited: with a method fewer than the paper's, and with a level of 0 V."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from analysis.predict.check import check
from analysis.predict.reproduction.reproduce import reproduce
from analysis.predict.reproduction.study import prepared
from analysis.summary.analyze import Request, analyze
from experiments.study.new_study import new_study

pytestmark = pytest.mark.slow


def edited(path: Path, *changes: tuple[str, str]) -> Path:
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_study_with_a_method_fewer_is_checked_reproduced_and_analysed(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    new_study(folder)
    for name in ("direction.toml", "preference.toml"):
        edited(folder / name, ('"vibration", "asymmetric-1", "asymmetric-2"', '"vibration", "asymmetric-2"'))
    edited(folder / "study.toml", ("participants = 14", "participants = 3"), ("= 2000", "= 20"))
    check(str(folder / "study.toml"), 1, 3)
    done = reproduce(prepared(str(folder / "study.toml"), 1), folder / "simulated", lambda _: None)
    assert done.statistics.direction is not None
    assert done.statistics.direction.methods == ("vibration", "asymmetric-2")
    verdicts = {row.quantity: row.verdict for row in done.comparison}
    assert verdicts["participants with one score for asymmetric-1 and asymmetric-2"] == "not obtained"
    page = (folder / "simulated" / "report.md").read_text(encoding="utf-8")
    assert "No odds of the published pattern of direction: the study has no asymmetric-1" in page
    request = Request(paths=[folder / "simulated" / "logs"], out=folder / "analysis")
    statistics, problems, _ = analyze(request)
    assert not problems
    assert statistics.preference is not None
    assert [(pair.a, pair.b) for pair in statistics.preference.tukey or ()] == [("asymmetric-2", "vibration")]


def test_a_design_with_a_level_of_0_volts_is_checked_reproduced_and_analysed(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    new_study(folder, "voltages")
    edited(folder / "voltages.toml", ("[6.0, 7.0,", "[0.0, 7.0,"), ("gun =", "below_break_away = true\ngun ="))
    edited(folder / "study.toml", ("participants = 12", "participants = 2"))
    check(str(folder / "study.toml"), 1, 2)
    done = reproduce(prepared(str(folder / "study.toml"), 1), folder / "simulated", lambda _: None)
    cells = done.statistics.designs["voltages"].questions["response"].cells
    assert [cell.levels["voltage_V"] for cell in cells[:3]] == [0.0, 0.0, 7.0]
    statistics, problems, _ = analyze(Request(paths=[folder / "simulated" / "logs"], out=folder / "analysis"))
    assert not problems
    found = json.loads((folder / "analysis" / "statistics.json").read_text(encoding="utf-8"))
    assert found["voltages"]["n"] == statistics.designs["voltages"].n == 2
    assert "the paper" not in (folder / "analysis" / "report.md").read_text(encoding="utf-8")
