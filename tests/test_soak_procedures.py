"""The full figures of the procedures: efficiency against the bound, beside other rules; convergence; speed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri

from experiments.design.procedures.posterior import (
    AnswerGrid,
    EntropyRule,
    ParameterGrid,
    VarianceRule,
    best_stimulus,
    entropy_rule,
    parameter_grid,
    posterior_after,
    variance_rule,
)
from experiments.design.procedures.psychometric import share_felt
from experiments.design.procedures.surface import SurfaceGrid, surface_grid
from experiments.design.procedures.up_down import Kesten, LevelRange, TrackEnd, TrackState, UpDown, track_of
from tests.conftest import Soak
from tests.threshold_bound import threshold_bound, width_of

pytestmark = pytest.mark.soak

SD, LAPSE = 2.0, 0.02
LAPSES = np.array([0.0, 0.02, 0.04, 0.06, 0.08])
LEVELS = np.linspace(-10, 10, 61)
OBSERVERS, AT_ONCE, BY_QUESTPLUS = 4000, 20, 40
STEP = float(LEVELS[1] - LEVELS[0])
RANGE = LevelRange(low=-10.0, high=10.0, grain=STEP)


@dataclass(frozen=True)
class Task:
    """Who answers: a cumulative normal of sd 2 that is not known, thresholds even from -3 to 3, lapses of 2 %."""

    name: str
    trials: int
    guess: float
    promised: float

    @property
    def bound(self) -> float:
        return threshold_bound(self.trials, width=width_of(SD), guess=self.guess, lapse=LAPSE)

    def share(self, level: np.ndarray, threshold: np.ndarray) -> np.ndarray:
        return np.asarray(self.guess + (1 - self.guess - LAPSE) * share_felt(level, threshold, width_of(SD)))

    def thresholds(self) -> np.ndarray:
        return np.random.default_rng(1999).uniform(-3, 3, OBSERVERS)


FORCED = Task("2AFC, 80 trials", 80, 0.5, 0.60)
YES_NO = Task("yes or no, 40 trials", 40, 0.0, 0.77)
EITHER_WAY = Task("yes or no, lapses either way, 40 trials", 40, LAPSE, 0.77)
VAGUE, VAGUER = (0.8, 6.0), (0.5, 8.0)
TASKS = pytest.mark.parametrize("task", [FORCED, YES_NO], ids=["2AFC", "yes-no"])


def grid_of(task: Task, sds: tuple[float, float] = VAGUE) -> ParameterGrid:
    """60 thresholds within ± 8, 20 sds; high lapse rates are less likely. A lapse may go either way: then g is l."""
    return parameter_grid(
        stimuli=LEVELS,
        thresholds=np.linspace(-8, 8, 60),
        widths=width_of(1.0) * np.geomspace(*sds, 20),
        lapses=LAPSES,
        guesses=np.array([0.0 if task is EITHER_WAY else task.guess]),
        prior=np.ones((60, 20, LAPSES.size, 1)) * np.exp(-LAPSES / 0.03)[:, None],
        either_way=task is EITHER_WAY,
    )


def efficiency(task: Task, errors: np.ndarray) -> tuple[str, float, float]:
    """The bound's square by the mean square error with its 95 % interval, in words; its low end; the bias in sd."""
    squares, bias = errors**2, float(errors.mean()) / SD
    half = 1.96 * squares.std() / math.sqrt(len(errors))
    low, found = task.bound**2 / (squares.mean() + half), task.bound**2 / squares.mean()
    high = task.bound**2 / max(squares.mean() - half, 1e-12)
    words = (
        f"{found:.2f} [{low:.2f}, {high:.2f}], bias {bias:+.3f} sd, root mean square {math.sqrt(squares.mean()):.3f}"
    )
    return words, float(low), bias


def chunks() -> Iterator[np.ndarray]:
    yield from np.array_split(np.arange(OBSERVERS), OBSERVERS // AT_ONCE)


def posterior_of(known: ParameterGrid, levels: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The posteriors of observers (n,) after trials (n, trials), all of which they had."""
    posterior = np.broadcast_to(known.start(), (len(levels), *known.shape))
    for trial in range(levels.shape[1]):
        posterior = posterior_after(known, posterior, levels[:, trial], right[:, trial])
    return np.asarray(posterior)


def quantiles_of(known: ParameterGrid, posterior: np.ndarray, shares: tuple[float, ...]) -> np.ndarray:
    """The thresholds below which each observer's lies so surely; a value's weight lies all over its cell."""
    values, weights = known.axes["threshold"], known.marginal(posterior, "threshold")
    middles = (values[1:] + values[:-1]) / 2
    edges = [2 * values[0] - middles[0], *middles, 2 * values[-1] - middles[-1]]
    return np.array([np.interp(shares, [0.0, *np.cumsum(own)], edges) for own in weights])


@pytest.mark.parametrize("task", [FORCED, YES_NO, EITHER_WAY], ids=["2AFC", "yes-no", "either-way"])
@pytest.mark.parametrize(
    ("make", "sds"),
    [(variance_rule, VAGUE), (variance_rule, VAGUER), (entropy_rule, VAGUE)],
    ids=["variance", "variance-vaguer", "entropy"],
)
def test_the_posterior_rules_are_efficient(
    task: Task,
    make: Callable[[ParameterGrid], VarianceRule | EntropyRule],
    sds: tuple[float, float],
    soak: Soak,
) -> None:
    known, true = grid_of(task, sds), task.thresholds()
    rule, draws = make(known), np.random.default_rng(2)
    found = np.empty((OBSERVERS, 3))
    for who in chunks():
        posterior = np.broadcast_to(known.start(), (len(who), *known.shape))
        for _ in range(task.trials):
            stimulus = best_stimulus(rule.gains(posterior))
            right = draws.random(len(who)) < task.share(known.stimuli[stimulus], true[who])
            posterior = posterior_after(known, posterior, stimulus, right)
        found[who] = quantiles_of(known, posterior, (0.025, 0.5, 0.975))
    errors = found[:, 1] - true
    words, low, bias = efficiency(task, errors)
    held = np.mean((found[:, 0] <= true) & (true <= found[:, 2]))
    parts = [errors[(true >= start) & (true < start + 2)].mean() / SD for start in (-3, -1, 1)]
    promised = task.promised if make is variance_rule and sds == VAGUE else None
    kind = "entropy" if make is entropy_rule else "variance of the threshold"
    soak(
        f"{task.name}: posterior rule, {kind}, sds {sds[0]:g} to {sds[1]:g}: efficiency",
        words,
        f"low end {promised}, bias below .1 sd" if promised else "stated",
        f"{OBSERVERS:,} observers, bound {task.bound:.3f}; slope and lapses unknown; median;"
        f" bias by thirds of the thresholds {', '.join(f'{part:+.3f}' for part in parts)};"
        f" 95 % interval holds {100 * held:.1f} %",
    )
    assert not promised or (low >= promised and abs(bias) < 0.1)


def questplus_next(questplus: ModuleType, known: ParameterGrid, task: Task) -> Any:
    """One observer's QUEST+ on the same grid."""
    params = {"mean": known.axes["threshold"], "sd": known.axes["width"] / width_of(1.0)}
    return questplus.QuestPlus(
        stim_domain={"intensity": known.stimuli},
        param_domain=params | {"lower_asymptote": [task.guess], "lapse_rate": LAPSES},
        prior={"lapse_rate": np.exp(-LAPSES / 0.03)},
        outcome_domain={"response": ["right", "wrong"]},
        func="norm_cdf",
        stim_scale="linear",
    )


@TASKS
def test_questplus_on_like_observers(task: Task, soak: Soak) -> None:
    questplus = pytest.importorskip("questplus", reason="comes with `make full`")
    known, true, draws = grid_of(task), task.thresholds()[:BY_QUESTPLUS], np.random.default_rng(3)
    errors = np.empty(BY_QUESTPLUS)
    for person, threshold in enumerate(true):
        quest = questplus_next(questplus, known, task)
        for _ in range(task.trials):
            stimulus = quest.next_stim
            right = draws.random() < task.share(stimulus["intensity"], threshold)
            quest.update(stim=stimulus, outcome={"response": "right" if right else "wrong"})
        errors[person] = quest.param_estimate["mean"] - threshold
    how = f"{BY_QUESTPLUS} observers only, for its time; mean, on the same grid and prior"
    soak(f"{task.name}: questplus 2023.1: efficiency", efficiency(task, errors)[0], "stated", how)


def tracks(task: Task) -> dict[str, UpDown | Kesten]:
    """Tracks as they are commonly set: from an easy level, 6, with steps that go from 2 to 2/3."""
    stop = TrackEnd(trials=task.trials)
    plain = UpDown(start=6.0, steps=(2.0, 4 / 3, 2 / 3), within=RANGE, stop=stop)
    slow = Kesten(start=6.0, first_step=10.0, target=0.75, within=replace(RANGE, grain=0.0), stop=stop)
    if task is YES_NO:
        return {"1-down-1-up": plain, "Kesten, target .5": replace(slow, target=0.5)}
    return {
        "2-down-1-up": replace(plain, down=2),
        "3-down-1-up": replace(plain, down=3),
        "weighted up-down, target .75": replace(plain, ratio=3.0, steps=(4 / 3, 2 / 3, 1 / 3)),
        "Kesten, target .75": slow,
    }


def mean_of_reversals(state: TrackState) -> float | None:
    """The mean of an even number of reversals, of six or more without the first two; `None` before there are two."""
    skipped = 2 if len(state.reversals) >= 6 else 0
    counted = state.reversals[skipped + (len(state.reversals) - skipped) % 2 :]
    return sum(counted) / len(counted) if counted else None


@TASKS
def test_tracks_and_constant_stimuli_on_like_observers(task: Task, soak: Soak) -> None:
    known, true, draws = grid_of(task), task.thresholds(), np.random.default_rng(4)
    for name, rule in tracks(task).items():
        walks = [walk(task, rule, threshold, draws) for threshold in true]
        target = rule.target
        offset = SD * ndtri((target - task.guess) / (1 - task.guess - LAPSE))
        ends = [state.levels[-1] if isinstance(rule, Kesten) else mean_of_reversals(state) for state, _ in walks]
        errors = np.array([end for end in ends if end is not None]) - true[[end is not None for end in ends]] - offset
        how = "last level" if isinstance(rule, Kesten) else "mean of reversals"
        lost = sum(end is None for end in ends)
        detail = f"{how} against the level with {target:.3f} right; {OBSERVERS:,} observers, {lost} without reversals"
        soak(f"{task.name}: {name}: efficiency", efficiency(task, errors)[0], "stated", detail)
        if isinstance(rule, UpDown):
            levels = np.array([np.rint((np.array(state.levels) + 10) / STEP) for state, _ in walks]).astype(np.intp)
            again = fitted(known, levels, np.array([right for _, right in walks])) - true
            detail = "threshold, the median of the posterior on the same grid and prior"
            soak(f"{task.name}: {name}, fitted: efficiency", efficiency(task, again)[0], "stated", detail)
    levels = np.broadcast_to(np.rint(np.linspace(6, 54, 9)).astype(np.intp), (task.trials // 9 + 1, 9)).ravel()
    levels = np.broadcast_to(levels[: task.trials], (OBSERVERS, task.trials))
    right = draws.random(levels.shape) < task.share(LEVELS[levels], true[:, None])
    errors = fitted(known, levels, right) - true
    detail = "9 levels within ± 8; the median of the posterior on the same grid and prior"
    soak(f"{task.name}: constant stimuli, fitted: efficiency", efficiency(task, errors)[0], "stated", detail)


def walk(
    task: Task, rule: UpDown | Kesten, threshold: float, draws: np.random.Generator
) -> tuple[TrackState, list[bool]]:
    answers = list[bool]()

    def answer(level: float) -> bool:
        felt = math.erfc((threshold - level) / SD / math.sqrt(2)) / 2
        answers.append(bool(draws.random() < task.guess + (1 - task.guess - LAPSE) * felt))
        return answers[-1]

    return track_of(rule, answer), answers


def fitted(known: ParameterGrid, levels: np.ndarray, right: np.ndarray) -> np.ndarray:
    found = [quantiles_of(known, posterior_of(known, levels[who], right[who]), (0.5,)) for who in chunks()]
    return np.concatenate(found)[:, 0]


# convergence

WIDE = LevelRange(low=-1e6, high=1e6)
TRACKS, LONG, BEFORE = 200, 3000, 500


@pytest.mark.parametrize(
    ("down", "up", "ratio", "source"),
    [
        (1, 1, 1.0, "Levitt 1971"),
        (2, 1, 1.0, "Levitt 1971"),
        (3, 1, 1.0, "Levitt 1971"),
        (4, 1, 1.0, "Levitt 1971"),
        (1, 2, 1.0, "Levitt 1971"),
        (1, 3, 1.0, "Levitt 1971"),
        (1, 1, 3.0, "Kaernbach 1991"),
        (1, 1, 9.0, "Kaernbach 1991"),
    ],
)
def test_tracks_converge_where_theory_says(down: int, up: int, ratio: float, source: str, soak: Soak) -> None:
    """The mean level of small steps is off by an amount that is linear in the step: two steps extrapolate to none."""
    rule = UpDown(start=0.0, steps=(0.1,), within=WIDE, stop=TrackEnd(trials=LONG), down=down, up=up, ratio=ratio)
    size = 0.1 / max(ratio, 1)
    rule = replace(rule, start=float(ndtri(rule.target)))
    means = [mean_levels(replace(rule, steps=(step,)), seed) for seed, step in enumerate((size, 2 * size))]
    level = 2 * means[0] - means[1]
    error, off = level.std() / math.sqrt(TRACKS), level.mean() - rule.start
    kind = f"weighted, a step up {ratio:g} times as large" if ratio > 1 else f"{down} down, {up} up"
    soak(
        f"converges ({kind})",
        f"share {0.5 * math.erfc(-level.mean() / math.sqrt(2)):.4f}, {off / error:+.1f} standard errors from theory",
        f"{rule.target:.4f} ± 3 standard errors",
        f"{source}; {TRACKS} tracks of {LONG:,} trials, steps of {size:.3g} and {2 * size:.3g} sd extrapolated to none",
    )
    assert abs(off) < 3 * error


def test_kesten_converges_to_its_target(soak: Soak) -> None:
    rule = Kesten(start=3.0, first_step=6.0, target=0.75, within=WIDE, stop=TrackEnd(trials=LONG))
    levels = np.array([walked(rule, seed).levels[-1] for seed in range(TRACKS)])
    error, off = levels.std() / math.sqrt(TRACKS), levels.mean() - ndtri(0.75)
    soak(
        "converges (Kesten, target .75)",
        f"share {0.5 * math.erfc(-levels.mean() / math.sqrt(2)):.4f}, {off / error:+.1f} standard errors from theory",
        "0.75 ± 3 standard errors",
        f"Kesten 1958; last levels of {TRACKS} tracks of {LONG:,} trials from 3 sd, their spread {levels.std():.3f} sd",
    )
    assert abs(off) < 3 * error


def mean_levels(rule: UpDown, seed: int) -> np.ndarray:
    return np.array([np.mean(walked(rule, 1000 * seed + track).levels[BEFORE:]) for track in range(TRACKS)])


def walked(rule: UpDown | Kesten, seed: int) -> TrackState:
    draws = iter(np.random.default_rng(seed).random(LONG).tolist())
    return track_of(rule, lambda level: next(draws) < math.erfc(-level / math.sqrt(2)) / 2)


# speed


def times_of(known: AnswerGrid, rule: VarianceRule | EntropyRule, trials: int) -> np.ndarray:
    """From answer to next stimulus, milliseconds of the processor."""
    posterior, draws, taken = known.start(), np.random.default_rng(5), []
    stimulus = int(best_stimulus(rule.gains(posterior)))
    for right in draws.random(trials) < 0.75:
        begun = time.process_time()
        posterior = posterior_after(known, posterior, stimulus, bool(right))
        stimulus = int(best_stimulus(rule.gains(posterior)))
        taken.append(1000 * (time.process_time() - begun))
    return np.array(taken)


def test_from_answer_to_next_stimulus_in_one_dimension(soak: Soak) -> None:
    known = grid_of(FORCED)
    for name, rule in (("variance", variance_rule(known)), ("entropy", entropy_rule(known))):
        taken = times_of(known, rule, 2000)
        middle, late = np.quantile(taken, [0.5, 0.99])
        how = f"{len(LEVELS)} levels, 60 x 20 x 5 nodes; median {middle:.3f} ms, 2,000 trials, processor's time"
        soak(f"from answer to next stimulus, {name} rule, 99th percentile", f"{late:.3f} ms", "1 ms", how)
        assert late < 1


def test_beside_questplus_on_the_same_grid(soak: Soak) -> None:
    questplus = pytest.importorskip("questplus", reason="comes with `make full`")
    line, surface = grid_of(FORCED), two_dimensions()
    quests = {
        "one dimension": (line, questplus_next(questplus, line, FORCED), 30),
        "two dimensions": (surface, questplus_surface(questplus, surface), 5),
    }
    for name, (known, quest, trials) in quests.items():
        theirs, ours = (
            np.median(times_of_questplus(quest, trials)),
            np.median(times_of(known, entropy_rule(known), 300)),
        )
        how = f"{known.prior.size:,} nodes, {len(known.felt)} stimuli; medians {theirs:.1f} and {ours:.3f} ms"
        soak(f"entropy rule in {name}, times as fast as questplus 2023.1", f"{theirs / ours:.0f}", "100", how)
        assert theirs / ours >= 100


def times_of_questplus(quest: Any, trials: int) -> np.ndarray:
    stimulus, taken = quest.next_stim, []
    for right in np.random.default_rng(5).random(trials) < 0.75:
        begun = time.process_time()
        quest.update(stim=stimulus, outcome={"response": "right" if right else "wrong"})
        stimulus = quest.next_stim
        taken.append(1000 * (time.process_time() - begun))
    return np.array(taken)


def questplus_surface(questplus: ModuleType, known: SurfaceGrid) -> Any:
    """Its contrast sensitivity function without a temporal frequency: the same surface, with a Weibull function."""
    axes = dict(
        zip(("c0", "cf", "min_thresh"), (known.axes[name] for name in ("intercept", "rise", "floor")), strict=True)
    )
    return questplus.QuestPlus(
        stim_domain={"contrast": STRENGTHS, "spatial_freq": DURATIONS, "temporal_freq": [0.0]},
        param_domain=axes
        | {"cw": [0.0], "slope": [2.0, 4.0], "lower_asymptote": [0.5], "lapse_rate": known.axes["lapse"]},
        outcome_domain={"response": ["right", "wrong"]},
        func="csf",
        stim_scale="log10",
    )


STRENGTHS, DURATIONS = np.linspace(0, 3, 30), np.linspace(0, 2, 30)


def two_dimensions() -> SurfaceGrid:
    return surface_grid(
        stimuli=np.stack(np.meshgrid(STRENGTHS, DURATIONS, indexing="ij"), axis=-1).reshape(-1, 2),
        intercepts=np.linspace(1, 3, 15),
        rises=np.linspace(-2, 0, 10),
        floors=np.linspace(0.2, 1, 4),
        widths=np.array([0.3, 0.6]),
        lapses=LAPSES,
        guesses=np.array([0.5]),
    )


def test_from_answer_to_next_stimulus_in_two_dimensions(soak: Soak) -> None:
    known, begun = two_dimensions(), time.process_time()
    rule = entropy_rule(known)
    made = time.process_time() - begun
    middle, late = np.quantile(times_of(known, rule, 300), [0.5, 0.99])
    how = (
        f"{len(known.felt)} stimuli, {known.prior.size:,} nodes; median {middle:.2f} ms, 300 trials, processor's time;"
    )
    soak(
        "from answer to next stimulus in two dimensions, entropy rule, 99th percentile",
        f"{late:.2f} ms",
        "20 ms",
        f"{how} the rule itself is made once, in {made:.2f} s",
    )
    assert late < 20
