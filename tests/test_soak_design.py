"""The full figures behind `recoil design`, kept as a table: `make soak`."""

from __future__ import annotations

import json
import os
import subprocess
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from analysis.predict.design_search.choice import THRESHOLD_SHARE, rate_at
from analysis.report.copies import cores
from device.parameters import GunParameters
from device.physics.shot import highest_rate_Hz
from experiments.synthetic.percept import PerceptParameters
from tests.conftest import RECOIL, Soak
from tests.power_files import files

pytestmark = pytest.mark.soak

PAPER = GunParameters()


def design(out: Path, *words: object) -> tuple[Any, float]:
    start = time.perf_counter()
    done = subprocess.run([RECOIL, "design", *map(str, words), "--out", out], check=True, capture_output=True)
    seconds = time.perf_counter() - start
    assert done.returncode == 0
    return json.loads((out / "design.json").read_text(encoding="utf-8")), seconds


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, float]:
    """The default search."""
    return design(tmp_path_factory.mktemp("design") / "out")


def test_the_default_search_ends_in_three_minutes(whole: tuple[Any, float], soak: Soak) -> None:
    found, seconds = whole
    compiled = "summaries compiled" if find_spec("numba") else "all interpreted"
    how = (
        f"{found['designs']['total']:,} designs with report, {cores()} cores, {compiled}, load {os.getloadavg()[0]:.1f}"
    )
    soak("the default search, 40 frictions by 40 voltages by 8 pulses", f"{seconds:.0f} s", "180 s", how)
    assert seconds < 180


def test_how_far_the_summary_alone_would_mislead(whole: tuple[Any, float], soak: Soak) -> None:
    apart = whole[0]["percept"]["summary_differs_in_predicted_rate"]
    points = {name: f"{100 * value:.2f} points" for name, value in apart.items()}
    how = "predicted rate by the summary's rectangles against the full course, over all designs that come home"
    for name, words in (("median", "median"), ("of_95_percent", "95 % are below"), ("largest", "largest")):
        soak(f"difference between the two percept routes, {words}", points[name], "stated", how)
    assert apart["largest"] > 0.05  # or the shorter route would do


def test_the_paper_stands_where_it_was_fitted(whole: tuple[Any, float], soak: Soak) -> None:
    own = {one["name"]: one["predicted"] for one in whole[0]["own"]}
    figure = ", ".join(f"{100 * share:.2f} %" for share in own.values())
    soak("the paper's I and II as predicted", figure, "79.3 %, 92.9 %", "fitted to them")
    assert list(own.values()) == pytest.approx([0.793, 0.929], abs=1e-6)


def test_the_best_design_holds_when_simulated_alone(whole: tuple[Any, float], soak: Soak) -> None:
    best = whole[0]["best"]
    gun = replace(PAPER, **{key: best[key] for key in ("friction_N", "voltage_V", "pulse_s")})
    figure = f"{100 * best['predicted']:.1f} % [{100 * best['ci_low']:.1f}, {100 * best['ci_high']:.1f}]"
    how = f"{best['friction_N']:.3g} N, {best['voltage_V']:.3g} V, {1e3 * best['pulse_s']:.3g} ms; predicted, not felt"
    soak("the best design at 5 Hz or faster, predicted right", figure, "stated", how)
    soak("its highest rate, simulated alone", f"{highest_rate_Hz(gun):.3f} Hz", "5 Hz or more", how)
    assert highest_rate_Hz(gun) >= 5.0


def test_the_contour_holds_when_simulated_alone(whole: tuple[Any, float], soak: Soak) -> None:
    found = whole[0]
    critical, parameters = found["critical"], PerceptParameters(**found["percept"]["parameters"])
    points = [
        (friction, voltage)
        for friction, voltage in zip(critical["friction_N"], critical["voltage_V"], strict=True)
        if voltage is not None
    ]
    worst = max(
        abs(rate_at(replace(PAPER, friction_N=f, voltage_V=v), parameters) - THRESHOLD_SHARE) for f, v in points
    )
    soak("the contour's points, simulated alone: off 75 %", f"{100 * worst:.3f} points", "0.1 points", f"{len(points)}")
    for friction in (0.21, 1.12):
        place = critical["friction_N"].index(friction)
        band = [critical["band"][f"{end}_V"][place] for end in ("low", "high")]
        figure = f"{critical['voltage_V'][place]:.1f} V [{band[0]:.1f}, {band[1]:.1f}]"
        soak(f"75 % right at {friction} N and 10 ms from", figure, "stated", "95 % of 2,000 drawn contours, as a whole")
    assert worst < 1e-3


def test_one_process_and_two_give_the_same_bytes(tmp_path: Path, soak: Soak) -> None:
    for number in (1, 2):
        design(tmp_path / str(number), "--grid", 8, "--workers", number)
    one = files(tmp_path / "1")
    same = one == files(tmp_path / "2")
    soak("2 processes against 1", "equal" if same else "differ", "byte for byte", f"{len(one)} files, grid of 8")
    assert same
