"""`recoil design` as a user calls it: the best design, what it keeps to, what is never guessed, and the refusals."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from analysis.predict.design_search import run as feature
from analysis.predict.design_search.choice import rate_at
from analysis.predict.design_search.figures import AREA_NAMES, figure_critical, shown_up_to_Hz
from analysis.predict.design_search.results import DesignSearch
from analysis.predict.design_search.space import axis, make_space, span
from analysis.predict.fit.percept_model import PAPER_RATES
from analysis.report.figures import style
from analysis.report.serial import plain
from analysis.report.terminal import in_text
from device.limits import DriveHistory, load_of
from device.parameters import GunParameters
from device.physics.shot import highest_rate_Hz
from device.words import Pulse
from experiments.config.door import ConfigError
from experiments.synthetic.percept import PerceptParameters
from tests.conftest import Recoil
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

PAPER = GunParameters()


@contextmanager
def silent(_what: str, _total: int) -> Iterator[Callable[[str], None]]:
    yield lambda _done: None


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, DesignSearch]:
    """A small search beyond the voltage that the device allows, with the gun's own values on its axes."""
    out = tmp_path_factory.mktemp("design")
    return out, feature.design(feature.DesignRequest(grid=6, voltage="0-30"), 1, out, silent)


@pytest.fixture(scope="module")
def done(result: tuple[Path, DesignSearch]) -> tuple[Path, Any]:
    return result[0], plain(result[1])


@pytest.fixture
def found(done: tuple[Path, Any]) -> Any:
    return done[1]


@pytest.fixture(scope="module")
def rows(done: tuple[Path, Any]) -> list[dict[str, str]]:
    with (done[0] / "designs.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_papers_methods_are_predicted_at_the_rates_they_were_fitted_to(found: Any) -> None:
    own = {one["name"]: one["predicted"] for one in found["own"]}
    assert own["Asymmetric Force I"] == pytest.approx(PAPER_RATES["asymmetric-1"], abs=1e-6)
    assert own["Asymmetric Force II"] == pytest.approx(PAPER_RATES["asymmetric-2"], abs=1e-6)


@pytest.mark.slow
def test_the_sweep_predicts_them_so_as_well(rows: list[dict[str, str]]) -> None:
    """The fit samples the force evenly in time, the sweep stretch by stretch: 0.0005 apart."""
    here = {row["friction_N"]: row for row in rows if (row["voltage_V"], row["pulse_s"]) == ("16.0", "0.01")}
    assert float(here["0.21"]["predicted"]) == pytest.approx(PAPER_RATES["asymmetric-1"], abs=1e-3)
    assert float(here["1.12"]["predicted"]) == pytest.approx(PAPER_RATES["asymmetric-2"], abs=1e-3)


@pytest.mark.slow
def test_every_other_assumption_is_refitted_to_the_same_rates(found: Any) -> None:
    others = found["critical"]["alternatives"]
    assert [one["name"] for one in others] == ["exponent 1.1", "exponent 2.3", "leak 10 ms", "leak 40 ms"]
    for one in others:
        parameters = PerceptParameters(**one["parameters"])
        shares = [rate_at(replace(PAPER, friction_N=friction_N), parameters) for friction_N in (0.21, 1.12)]
        assert shares == pytest.approx([0.793, 0.929], abs=2e-3)


@pytest.mark.slow
def test_the_best_design_is_told_under_every_other_assumption(found: Any) -> None:
    best, others = found["best"], found["critical"]["alternatives"]
    gun = replace(PAPER, **{key: best[key] for key in ("friction_N", "voltage_V", "pulse_s")})
    shares = [rate_at(gun, PerceptParameters(**one["parameters"])) for one in others]
    assert list(best["under_other_assumptions"].values()) == pytest.approx(shares)
    assert len(set(shares)) == 4


@pytest.mark.slow
def test_the_best_design_shoots_as_fast_as_is_asked_when_simulated_alone(found: Any) -> None:
    best = found["best"]
    gun = replace(PAPER, **{key: best[key] for key in ("friction_N", "voltage_V", "pulse_s")})
    assert highest_rate_Hz(gun) == pytest.approx(best["shooting_rate_Hz"], rel=1e-9)
    assert highest_rate_Hz(gun) >= found["rate_above_Hz"] == 5.0


@pytest.mark.slow
def test_the_device_would_allow_the_best_design_for_as_long_as_one_likes(found: Any) -> None:
    """1000 s of shots at the bound, five time constants of the coil, by the device's own rules."""
    best = found["best"]
    load = load_of(Pulse(voltage_V=best["voltage_V"], pulse_s=best["pulse_s"]), PAPER.resistance_ohm)
    history = DriveHistory()
    for shot in range(5000):
        history = history.record(load, shot * 0.2, shot * 0.2 + 1.0 / best["shooting_rate_Hz"])
    assert history.coil_celsius(999.8) == pytest.approx(best["coil_C_at_bound"], abs=0.5)


@pytest.mark.slow
def test_no_design_that_may_be_proposed_is_felt_better_and_fast_enough(found: Any, rows: list[dict[str, str]]) -> None:
    allowed = [row for row in rows if row["status"] == "home" and not row["limit"]]
    fast = [float(row["evidence"]) for row in allowed if float(row["shooting_rate_Hz"]) >= 5.0]
    assert found["designs"]["fast_enough"] == len(fast) > 10
    assert found["best"]["evidence"] >= max(fast) - 1e-3


@pytest.mark.slow
def test_the_front_is_beaten_by_no_design(found: Any, rows: list[dict[str, str]]) -> None:
    allowed = [row for row in rows if row["status"] == "home" and not row["limit"]]
    points = [(float(row["shooting_rate_Hz"]), float(row["evidence"])) for row in allowed]
    front = [(one["shooting_rate_Hz"], one["evidence"]) for one in found["front"]]
    assert 3 < len(front) < len(points)
    for rate, evidence in front:
        assert not [p for p in points if p[0] >= rate and p[1] >= evidence and p != (rate, evidence)]


@pytest.mark.slow
def test_a_shot_that_does_not_break_away_is_named_and_never_counted_as_guessing(
    done: tuple[Path, Any], rows: list[dict[str, str]]
) -> None:
    out, found = done
    unmoved = [row for row in rows if row["status"] != "home"]
    assert {"no-break-away", "stuck"} <= {row["status"] for row in unmoved}
    assert {row[key] for row in unmoved for key in ("predicted", "evidence", "ci_low", "shooting_rate_Hz")} == {""}
    for plane in (found["map"], found["critical"]):
        for words, shares in zip(plane["status"], plane["predicted"], strict=True):
            assert [word == "home" for word in words] == [share is not None for share in shares]
    assert "do not move the magnet (no percept)" in (out / "report.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_says_that_it_predicts_and_what_it_assumes(done: tuple[Path, Any]) -> None:
    out, found = done
    page = (out / "report.md").read_text(encoding="utf-8")
    assert page.count("Design search") == 1
    assert "predicted by a model" in page
    assert "exponent" in page
    assert "leak" in page
    assert {path.name for path in (out / "figures").iterdir()} == {"critical.png", "maps.png", "trade.png"}
    assert json.loads((out / "design.json").read_text(encoding="utf-8")) == found
    assert all(path.stat().st_mode & 0o077 == 0 for path in out.glob("*.json"))


@pytest.mark.slow
@pytest.mark.parametrize("bound_Hz", [5.0, 1.0])
def test_the_front_is_shown_to_where_it_falls_below_the_criterion_with_the_own_methods_in_the_picture(
    result: tuple[Path, DesignSearch], bound_Hz: float
) -> None:
    found = replace(result[1], rate_above_Hz=bound_Hz)
    end_Hz = shown_up_to_Hz(found)
    faster = [one.predicted for one in found.front if one.shooting_rate_Hz > end_Hz]
    assert faster
    assert all(share is not None and share < found.critical.level for share in faster)
    assert end_Hz >= max(bound_Hz, *(one.shooting_rate_Hz for one in found.own if one.predicted is not None))
    if bound_Hz == result[1].rate_above_Hz:
        page = (result[0] / "report.md").read_text(encoding="utf-8")
        said = f"Shown is what shoots at up to {end_Hz:.2f} Hz: what is faster on the front is predicted below 75 %."
        assert said in page
        assert f"From the front up to {end_Hz:.2f} Hz; all" in page


@pytest.mark.slow
def test_beyond_the_devices_limits_nothing_is_proposed(result: tuple[Path, DesignSearch], found: Any) -> None:
    assert found["designs"]["beyond_limits"]["voltage above 24 V"] >= 4
    assert found["best"]["voltage_V"] <= 24
    assert found["best"]["limit"] is None
    assert all(one["limit"] is None for one in found["front"])
    assert "voltage above 24 V" in in_text(feature.in_short(result[1]))


@pytest.mark.slow
@pytest.mark.parametrize(("error_V", "is_said"), [(0.06, True), (0.04, False)])
def test_bands_that_are_seen_to_lie_elsewhere_than_their_voltages_say_so(
    error_V: float, is_said: bool, result: tuple[Path, DesignSearch]
) -> None:
    found = replace(result[1], critical=replace(result[1].critical, interpolation_error_V=error_V))
    assert ("Bands are interpolated on the grid" in in_text(feature.in_short(found))) == is_said


@pytest.mark.slow
def test_the_legend_of_the_contours_names_what_is_drawn_and_a_point_alone_is_marked(
    result: tuple[Path, DesignSearch], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    critical = result[1].critical
    line = np.linspace(20.0, 10.0, len(critical.friction_N))
    below, alone = np.full_like(line, -np.inf), np.where(line == line[0], line, -np.inf)
    contours = {"nowhere": below, "at one friction": alone, "everywhere": line}
    first = critical.alternatives[0]
    changed = replace(
        critical,
        voltage_V=line,
        band=replace(critical.band, low_V=below, high_V=below),
        alternatives=tuple(replace(first, name=name, voltage_V=volts) for name, volts in contours.items()),
        both_directions_V=below,
    )
    figures: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: figures.append(figure))
    figure_critical(replace(result[1], critical=changed, own=()), tmp_path / "critical")
    named = {text.get_text() for text in figures[0].legends[0].get_texts()} - {*AREA_NAMES.values()}
    assert named == {"at one friction", "everywhere", "75 % right"}
    marked = [one.get_label() for one in figures[0].axes[0].lines if one.get_marker() not in ("None", None)]
    assert marked == ["at one friction"]


@pytest.mark.soak
def test_without_a_design_to_propose_it_says_so_and_ends_with_1(recoil: Recoil, tmp_path: Path) -> None:
    words = ("--friction", "1.3-1.38", "--voltage", "10-12", "--pulse", "0.01", "--grid", 4, "--workers", 1)
    ended = recoil("design", *words, "--out", "out", "--json")
    assert ended.returncode == 1, ended.stderr
    assert json.loads(ended.stdout) == json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    assert json.loads(ended.stdout)["best"] is None
    assert "No design of this sweep can be proposed" in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (feature.DesignRequest(friction="1.2-0.2"), "--friction 1.2-0.2: FROM must be below TO"),
        (feature.DesignRequest(friction="0.5"), "--friction 0.5: must be FROM-TO"),
        (feature.DesignRequest(voltage="a-b"), "--voltage a-b: must be FROM-TO"),
        (feature.DesignRequest(voltage="-3-4"), "--voltage -3-4: must be FROM-TO"),
        (feature.DesignRequest(voltage="1-1e999"), "--voltage 1-1e999: must be at most 1000 V"),
        (feature.DesignRequest(pulse="10"), "--pulse 10: must be at most 1 s"),
        (feature.DesignRequest(pulse="0.02-0.01"), "--pulse 0.02-0.01: FROM must be below TO"),
        (feature.DesignRequest(rate_above_Hz=5.1), "--rate-above 5.1: must be above 0 and at most 5 Hz"),
        (feature.DesignRequest(rate_above_Hz=float("nan")), "--rate-above nan"),
        (feature.DesignRequest(grid=3), "--grid 3: must be 4 to 200"),
        (feature.DesignRequest(config="direction", gun="gun"), "--gun gun: the config direction names its gun"),
        (feature.DesignRequest(gun="nothing"), "nothing: no such file"),
    ],
)
def test_what_cannot_be_swept_is_refused_with_option_and_rule(request_: feature.DesignRequest, words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        make_space(request_)
    assert str(refused.value).startswith(words)


def test_a_gun_without_a_voice_coil_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "buzz.toml"
    path.write_text('title = "Buzz"\n[methods.buzz]\nlabel = "Buzz"\nactuator = "vibration"\n', encoding="utf-8")
    with pytest.raises(ConfigError, match=r"buzz\.toml: methods: none has the actuator voice-coil"):
        make_space(feature.DesignRequest(gun=str(path)))


def test_a_config_brings_its_gun() -> None:
    assert make_space(feature.DesignRequest(config="direction")) == make_space(feature.DesignRequest())


def test_an_axis_goes_through_the_guns_own_values() -> None:
    space = make_space(feature.DesignRequest(grid=11))
    assert {0.21, 1.12} <= set(space.friction_N)
    assert 16.0 in space.voltage_V
    assert 0.01 in space.pulse_s
    assert len(space.friction_N) == len(space.voltage_V) == 11
    assert axis(0.0, 2.0, 3, [0.1, 1.9]) == (0.0, 1.0, 2.0)


def test_a_range_is_read_as_typed() -> None:
    assert span("--pulse", "1e-3-2e-2", (0.0, 1.0)) == (0.001, 0.02)
    assert span("--friction", " .2 - 1.5 ", (0.0, 1.0)) == (0.2, 1.5)


@pytest.mark.slow
def test_an_interrupted_search_ends_with_130_and_without_a_traceback(tmp_path: Path) -> None:
    words = warm("design", "--grid", 60, "--workers", 1, "--out", tmp_path / "out")
    with subprocess.Popen(words, stderr=subprocess.PIPE) as running:
        wait_for((tmp_path / "out").exists)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 130, errors
    assert b"interrupted" in errors
    assert b"Traceback" not in errors
