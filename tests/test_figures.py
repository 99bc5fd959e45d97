from __future__ import annotations

import math
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.logs.reading import read_logs
from analysis.paper.recurrence import ShareOfStudies
from analysis.predict.power.figures import Curve, Panel, figure_power
from analysis.report.figures import style
from analysis.report.figures.shot import ShotPanel, figure_5
from analysis.report.figures.style import stars
from analysis.report.labels import display_name
from analysis.stats.cells import ByParticipant
from analysis.summary.figures.results import figure_8, figure_directions
from analysis.summary.figures.trade import figure_response_times
from analysis.summary.results import Scores, StudyStatistics
from analysis.summary.summary import summarize
from tests import figure_files
from tests.log_files import rating_rows, ratings_path, write_rows, write_study
from tests.made_scores import crowd_of
from tests.shown_panels import saved_as, shot_panel

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _full_size() -> Iterator[None]:
    with figure_files.full_size():
        yield


@pytest.fixture(scope="module")
def statistics(tmp_path_factory: pytest.TempPathFactory) -> StudyStatistics:
    return summarize(read_logs([write_study(tmp_path_factory.mktemp("study"), participants=6)]))


def _png_size(path: Path) -> tuple[int, int]:
    header = path.read_bytes()[:24]
    assert header.startswith(b"\x89PNG")
    return int.from_bytes(header[16:20], "big"), int.from_bytes(header[20:24], "big")


@pytest.fixture
def vectors_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each figure the SVG, whose text is read here."""
    monkeypatch.setattr(style, "save", saved_as("svg"))


def files_of(draw: Callable[..., None], what: object, stem: Path) -> list[Path]:
    """The files of a figure, drawn."""
    draw(what, stem)
    return [stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg", "pdf")]


def test_figure_5_is_written_as_png_svg_and_pdf_and_names_the_stages(tmp_path: Path) -> None:
    with figure_files.drawn():
        png, svg, pdf = files_of(figure_5, [shot_panel(), shot_panel(0.05)], tmp_path / "new" / "figure-5")
    assert not re.search(rb"CreationDate|Producer|matplotlib v", pdf.read_bytes())
    assert _png_size(png) == (1800, 1480)  # 9.0 x 7.4 inches at 200 dpi
    assert pdf.read_bytes().startswith(b"%PDF-")
    text = svg.read_text(encoding="utf-8")
    for words in ("bullet firing", "resetting", "ready", "dx/dt [m/s]", "x [mm]", "53.7 N (off scale)"):
        assert words in text


@pytest.mark.usefixtures("vectors_alone")
def test_several_shots_have_letters_and_one_has_its_options(tmp_path: Path) -> None:
    one = replace(shot_panel(), options="full model: " + " ".join(f"number_{n}_m=0.5" for n in range(12)))
    alone, both = (
        files_of(figure_5, panels, tmp_path / str(len(panels)))[1].read_text(encoding="utf-8")
        for panels in ([one], [one, one])
    )
    assert "(a)" not in alone
    assert all(f"number_{n}_m=0.5" in alone for n in range(12))
    assert "(a)" in both
    assert "(b)" in both
    assert "number_" not in both


@pytest.mark.usefixtures("vectors_alone")
@pytest.mark.parametrize("landing_s", [0.15, np.nan])
def test_a_shot_that_does_not_come_home_is_drawn_without_a_collision(landing_s: float, tmp_path: Path) -> None:
    _, svg, _ = files_of(figure_5, [shot_panel(np.nan if np.isnan(landing_s) else 1.0, landing_s)], tmp_path / "shot")
    assert ("collision" in svg.read_text(encoding="utf-8")) is not np.isnan(landing_s)


def still_panel() -> ShotPanel:
    time, still = np.linspace(0.0, 0.02, 100), np.zeros(100)
    return ShotPanel(
        title="0.3 V",
        time_s=time,
        force_N=still,
        displacement_m=still,
        velocity_m_s=still,
        drive_V=np.where(time < 0.01, 0.3, 0.0),
        stage_ends_s=(np.nan, np.nan, np.nan),
        collision_force_N=np.nan,
        status="no-break-away",
    )


@pytest.mark.usefixtures("vectors_alone")
def test_a_magnet_that_never_moved_is_at_rest_and_the_figure_says_why(tmp_path: Path) -> None:
    _, svg, _ = files_of(figure_5, [still_panel()], tmp_path / "shot")
    text = svg.read_text(encoding="utf-8")
    assert "at rest" in text
    assert "no break away" in text
    assert "recoil" not in text


@pytest.mark.usefixtures("vectors_alone")
def test_a_shot_that_stuck_ends_in_its_resetting_stage(tmp_path: Path) -> None:
    _, svg, _ = files_of(figure_5, [replace(shot_panel(np.nan, np.nan), status="stuck")], tmp_path / "shot")
    text = svg.read_text(encoding="utf-8")
    assert "stuck" in text
    assert "resetting" in text
    assert "ready" not in text


@pytest.mark.usefixtures("vectors_alone")
@pytest.mark.parametrize(("last_s", "logarithmic"), [(0.25, False), (10.0, True)])
def test_time_is_logarithmic_where_a_stage_would_be_too_narrow_to_see(
    last_s: float, logarithmic: bool, tmp_path: Path
) -> None:
    panel = shot_panel()
    _, svg, _ = files_of(figure_5, [replace(panel, time_s=panel.time_s * last_s / 0.25)], tmp_path / "shot")
    assert ("$\\mathdefault{10^{2}}$" in svg.read_text(encoding="utf-8")) is logarithmic


def test_figure_8_shows_both_experiments_or_the_one_there_is(statistics: StudyStatistics, tmp_path: Path) -> None:
    with figure_files.drawn("svg"):
        both, both_svg, _ = files_of(figure_8, statistics, tmp_path / "both")
    one, *_ = files_of(figure_8, replace(statistics, direction=None), tmp_path / "one")
    assert _png_size(both)[0] > 1.7 * _png_size(one)[0]
    text = both_svg.read_text(encoding="utf-8")
    for words in ("correct rate, forward [%]", "rating (0 dislike", "Force II", "6 synthetic participants", "chance"):
        assert words in text
    assert "(b) Preference" in text
    assert "mean and SD" not in text  # its caption says it


def test_nothing_that_is_written_in_a_figure_touches_its_neighbour(
    statistics: StudyStatistics, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for draw, found in ((figure_8, statistics), (figure_directions, statistics.direction)):
        drawn: list[Figure] = []
        monkeypatch.setattr(style, "save", lambda figure, _, drawn=drawn: drawn.append(figure))
        draw(found, tmp_path / "never")
        (figure,) = drawn
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        boxes = [
            text.get_window_extent(canvas.get_renderer()).padded(2.0)
            for text in figure.findobj(Text)
            if text.get_visible() and text.get_text().strip()
        ]
        assert len(boxes) > 20
        assert not [one for i, one in enumerate(boxes) for other in boxes[:i] if one.overlaps(other)]


@pytest.mark.usefixtures("vectors_alone")
def test_the_directions_are_shown_against_chance_with_sensitivity_and_criterion(
    statistics: StudyStatistics, tmp_path: Path
) -> None:
    _, svg, _ = files_of(figure_directions, statistics.direction, tmp_path / "directions")
    text = svg.read_text(encoding="utf-8")
    for words in ("forward shots", "backward shots", "chance", "d′", "possible", "(c) Criterion", "no bias"):
        assert f"<!-- {words}" in text or words in text


@pytest.mark.usefixtures("vectors_alone")
def test_without_backward_shots_there_is_no_sensitivity_to_draw(statistics: StudyStatistics, tmp_path: Path) -> None:
    found = statistics.direction
    assert found is not None
    bare = replace(
        found,
        backward=Scores(means={}, sds={}, participants=ByParticipant((), (), np.empty((0, 0)))),
        sensitivity=dict.fromkeys(found.methods),
        binomial={method: {"forward": tests["forward"]} for method, tests in found.binomial.items()},
    )
    _, svg, _ = files_of(figure_directions, bare, tmp_path / "forward")
    assert "(b)" not in svg.read_text(encoding="utf-8")


@pytest.mark.usefixtures("vectors_alone")
def test_no_whisker_reaches_a_title_and_no_legend_lies_over_curves(
    statistics: StudyStatistics, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With an SD of 40 points at a mean of 90, the whisker ends at 130 %."""
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: (style.lay_out(figure), shown.append(figure)))
    assert statistics.direction is not None
    wide = dict.fromkeys(statistics.direction.methods, 0.4)
    high = dict.fromkeys(statistics.direction.methods, 0.9)
    figure_directions(replace(statistics.direction, means=high, sds=wide), tmp_path / "never")
    figure_response_times(statistics.direction, tmp_path / "never")
    assert shown[0].axes[0].get_ylim()[1] > 130.0
    curves = shown[1].axes[0]
    assert curves.get_legend() is None
    assert not any(legend.get_window_extent().overlaps(curves.get_window_extent()) for legend in shown[1].legends)


@pytest.mark.parametrize("n", [999, 1_000, 10_000, 250_000])
def test_panels_of_response_times_keep_their_height_however_many_trials_there_are(
    n: int, statistics: StudyStatistics, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: (style.lay_out(figure), shown.append(figure)))
    assert statistics.direction is not None
    times = statistics.direction.response_times
    counted = {
        method: {way: spread and replace(spread, n=n) for way, spread in of.items()}
        for method, of in times.directions.items()
    }
    many = replace(statistics.direction, response_times=replace(times, directions=counted))
    figure_response_times(many, tmp_path / "never")
    assert figure_files.touching(shown[0]) == []
    assert all(axes.get_window_extent().height > 0.55 * shown[0].bbox.height for axes in shown[0].axes)


def test_the_matrix_of_comparisons_has_its_last_edge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: shown.append(figure))
    methods = tuple(f"m{number}" for number in range(6))
    for seed in (1, 2, 3):
        write_rows(ratings_path(tmp_path, f"P{seed}"), rating_rows(f"P{seed}", seed, methods))
    figure_8(summarize(read_logs([tmp_path])), tmp_path / "never")
    matrix = shown[0].axes[1]
    lowest = max(patch.get_y() + patch.get_height() for patch in matrix.patches)  # the axis goes down
    assert matrix.get_ylim()[0] > lowest
    assert matrix.get_ylim()[1] < min(patch.get_y() for patch in matrix.patches)


def test_response_times_say_how_many_and_cut_a_single_slow_one(statistics: StudyStatistics, tmp_path: Path) -> None:
    assert statistics.direction is not None
    times = statistics.direction.response_times
    one = times.methods["vibration"]
    assert one is not None
    slow = replace(one, percentiles=(*one.percentiles[:100], 41.3))
    times = replace(times, methods={**times.methods, "vibration": slow})
    found = replace(statistics.direction, response_times=times)
    with figure_files.drawn("svg"):
        _, svg, _ = files_of(figure_response_times, found, tmp_path / "times")
    text = svg.read_text(encoding="utf-8")
    for words in ("n = 60 / 60", "Vibration (n = 120)", "the slowest took 41.3 s"):
        assert words in text


def test_no_valid_response_time_makes_no_figure(statistics: StudyStatistics, tmp_path: Path) -> None:
    assert statistics.direction is not None
    found = replace(statistics.direction, response_times=replace(statistics.direction.response_times, n=0))
    with pytest.raises(ValueError, match="at least one valid time"):
        figure_response_times(found, tmp_path / "times")


@pytest.mark.usefixtures("vectors_alone")
@pytest.mark.parametrize("people", [200, 201])
def test_beyond_200_people_their_distribution_is_drawn_instead_of_each(
    people: int, statistics: StudyStatistics, tmp_path: Path
) -> None:
    one = statistics.preference
    assert one is not None
    crowd = replace(one, n=people, participants=crowd_of(one.participants, people))
    _, svg, _ = files_of(figure_8, StudyStatistics(preference=crowd), tmp_path / "crowd")
    text = svg.read_text(encoding="utf-8")
    assert (text.count("<use ") > 3 * 200) is (people <= 200)


@pytest.mark.usefixtures("vectors_alone")
def test_an_undefined_comparison_gets_no_bracket(statistics: StudyStatistics, tmp_path: Path) -> None:
    one = statistics.preference
    assert one is not None
    assert one.tukey is not None
    undefined = replace(one, tukey=tuple(replace(pair, p=math.nan) for pair in one.tukey))
    _, svg, _ = files_of(figure_8, StudyStatistics(preference=undefined), tmp_path / "undefined")
    assert "n.s." not in svg.read_text(encoding="utf-8")


@pytest.mark.usefixtures("vectors_alone")
def test_a_figure_of_one_participant_and_four_unknown_methods_is_drawn(tmp_path: Path) -> None:
    rows = rating_rows("P01", methods=("a", "b", "c", "d"))
    write_rows(ratings_path(tmp_path, "P01"), [row | {"rating": "5"} for row in rows])
    found = summarize(read_logs([tmp_path]))
    assert found.preference is not None
    assert len(found.preference.methods) == 4
    _, svg, _ = files_of(figure_8, found, tmp_path / "few")
    text = svg.read_text(encoding="utf-8")
    assert "Preference" in text
    assert "(a)" not in text  # there is no other panel


@pytest.mark.parametrize(
    ("sizes", "shown"), [((8, 12, 16, 20), [8, 12, 16, 20]), (range(8, 49), [8, 16, 24, 32, 40, 48])]
)
def test_ticks_of_power_stand_at_the_designs_that_were_simulated_where_these_are_few(
    sizes: Sequence[int], shown: list[int], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    figures: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: figures.append(figure))
    share = ShareOfStudies(claim="F", held=1, share=0.5, ci_low=0.4, ci_high=0.6)
    panel = Panel(title="effect × 1", curves=[Curve(name="ANOVA", points=[(size, share) for size in sizes])])
    figure_power([[panel]], "participants", 0.8, tmp_path / "never")
    (axes,) = figures[0].axes
    low, high = axes.get_xlim()
    assert [tick for tick in axes.get_xticks() if low <= tick <= high] == shown


def test_without_data_there_is_no_figure(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least one shot"):
        figure_5([], tmp_path / "x")
    with pytest.raises(ValueError, match="complete participant"):
        figure_8(StudyStatistics(), tmp_path / "x")


def test_names_and_stars_are_the_papers() -> None:
    assert display_name("asymmetric-1") == "Asymmetric Force I"
    assert [stars(p) for p in (0.001, 0.01, 0.05, math.nan)] == ["**", "*", "n.s.", "n.s."]


def test_importing_analysis_loads_nothing_and_drawing_leaves_pyplot_alone() -> None:
    code = """
import sys, analysis
assert not {"numpy", "scipy", "matplotlib", "pandas", "jinja2", "pydantic", "experiments", "device"} & set(sys.modules)
import analysis.report.figures
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)
