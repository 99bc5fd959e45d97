"""Stimuli of two dimensions: the surface is the one that is said, and what comes next is what questplus takes."""

from __future__ import annotations

from math import log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from experiments.design.procedures.posterior import best_stimulus, entropy_rule, parameter_grid, posterior_after
from experiments.design.procedures.surface import SurfaceGrid, surface_grid, threshold_along

LEVELS, OTHERS = np.linspace(-2.0, 0.0, 13), np.linspace(0.0, 1.5, 6)
STEEPNESS = 3.5

GOLDEN_STIMULI = (
    *(41, 39, 54, 40, 29, 29, 28, 40, 39, 29, 29, 29, 29, 66, 29, 39, 44, 39, 35, 35),
    *(35, 29, 29, 29, 29, 29, 34, 34, 35, 29, 29, 34, 34, 34, 34, 34, 34, 34, 66, 34),
)
"""What questplus 2023.1 took (`csf`, log10, min_entropy, cw = 0), places in LEVELS × OTHERS, after these answers."""
GOLDEN_ANSWERS = "rrwrrrwrrrrrrrwrwwrrrrrrrrrwrrrrrrrrrrrr"
GOLDEN_MEANS = {"intercept": -0.23011965726491035, "rise": -0.8241956999245909, "lapse": 0.026016339322074544}
GOLDEN_FLOOR = -1.6334251767708814


def test_what_comes_next_is_what_questplus_takes() -> None:
    """Its Weibull function is 1 - 1/e at its threshold, ours is 1/2: all thresholds are lower by the same."""
    gumbel = log(-log(0.05)) - log(-log(0.95))
    lower = log(log(2)) / (STEEPNESS * log(10))
    known = surface_grid(
        stimuli=np.stack(np.meshgrid(LEVELS, OTHERS, indexing="ij"), axis=-1).reshape(-1, 2),
        intercepts=np.linspace(-1.0, 0.0, 7) + lower,
        rises=np.linspace(-1.2, 0.0, 4),
        floors=np.array([-1.8, -1.5, -1.2]) + lower,
        widths=np.array([gumbel / (STEEPNESS * log(10))]),
        lapses=np.array([0.01, 0.04]),
        guesses=np.array([0.5]),
        shape="gumbel",
    )
    rule, posterior, taken = entropy_rule(known), known.start(), []
    for answer in GOLDEN_ANSWERS:
        taken.append(int(best_stimulus(rule.gains(posterior))))
        posterior = posterior_after(known, posterior, taken[-1], answer == "r")
    assert tuple(taken) == GOLDEN_STIMULI
    means = {name: float(known.marginal(posterior, name) @ values) for name, values in known.axes.items()}
    assert means["intercept"] - lower == pytest.approx(GOLDEN_MEANS["intercept"], rel=1e-9)
    assert means["floor"] - lower == pytest.approx(GOLDEN_FLOOR, rel=1e-9)
    assert means["rise"] == pytest.approx(GOLDEN_MEANS["rise"], rel=1e-9)
    assert means["lapse"] == pytest.approx(GOLDEN_MEANS["lapse"], rel=1e-9)


def small(**other: np.ndarray) -> SurfaceGrid:
    axes = {
        "stimuli": np.array([[x, y] for x in (-1.0, 0.0, 1.0) for y in (0.0, 1.0)]),
        "intercepts": np.array([0.0, 1.0]),
        "rises": np.array([-1.0, 0.0]),
        "floors": np.array([-0.5, 0.5]),
        "widths": np.array([1.0, 2.0]),
        "lapses": np.array([0.0, 0.1]),
        "guesses": np.array([0.5]),
    }
    return surface_grid(**(axes | other))


@given(some.floats(-5, 5), some.floats(-5, 5), some.floats(-3, 3), some.floats(-5, 5), some.floats(0, 5))
def test_a_threshold_follows_a_line_and_stays_above_its_floor(
    y: float, intercept: float, rise: float, floor: float, farther: float
) -> None:
    here, there = threshold_along([y, y + farther], intercept, rise, floor)
    assert min(here, there) >= floor
    assert here == pytest.approx(intercept + rise * y) or here == floor
    assert (there - here) * rise >= 0


@pytest.mark.slow
@given(some.lists(some.tuples(some.integers(0, 5), some.booleans()), max_size=8))
def test_without_a_rise_it_is_the_grid_of_one_dimension(trials: list[tuple[int, bool]]) -> None:
    """The other dimension then changes nothing: stimuli with the same level are told apart by nothing."""
    surface = small(rises=np.zeros(1), floors=np.array([-9.0]))
    line = parameter_grid(
        stimuli=surface.stimuli[:, 0],
        thresholds=surface.axes["intercept"],
        widths=surface.axes["width"],
        lapses=surface.axes["lapse"],
        guesses=surface.axes["guess"],
    )
    both = [surface.start(), line.start()]
    for stimulus, right in trials:
        both = [posterior_after(known, one, stimulus, right) for known, one in zip((surface, line), both, strict=True)]
    assert both[0] == pytest.approx(both[1], rel=1e-12)
    gains = entropy_rule(surface).gains(both[0])
    assert gains == pytest.approx(entropy_rule(line).gains(both[1]), rel=1e-9, abs=1e-12)
    assert gains[::2] == pytest.approx(gains[1::2], rel=1e-9, abs=1e-12)


def test_marginals_of_a_surface_sum_to_one_and_the_answers_move_them() -> None:
    known = small()
    after = posterior_after(known, known.start(), 5, False)
    for name, values in known.axes.items():
        weights = known.marginal(after, name)
        assert weights.shape == values.shape
        assert weights.sum() == pytest.approx(1)
    assert known.marginal(after, "intercept")[1] > 0.5
    assert known.marginal(after, "lapse")[1] > 0.5


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ({"stimuli": np.zeros(4)}, r"stimuli: a row each, of two numbers, not of the shape \(4,\)"),
        ({"prior": np.ones((2, 2))}, r"prior: it must have the shape \(2, 2, 2, 2, 2, 1\)"),
    ],
)
def test_what_is_no_surface_is_refused(what: dict[str, np.ndarray], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        small(**what)
