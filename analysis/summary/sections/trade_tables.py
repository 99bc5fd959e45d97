"""The tables of speed and accuracy, in finished text: scores, effects of instructions, EZ-diffusion, fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from analysis.report import apa
from analysis.report.figures.names import display_name, named
from analysis.report.section import Table

Statistics = Mapping[str, Any]

_UNITS = {"drift": "1/√s", "boundary": "√s", "start": "0 to 1", "non_decision_s": "s"}
_WORDS = {"start": "start (towards forward)", "non_decision_s": "non-decision time"}
_EZ = {"drift": 2, "boundary": 2, "non_decision_s": 3}
_LEFT_OUT = {"few_correct": "few correct", "equal_times": "equal times", "non_decision_below_0": "time below 0"}


def cells_of(trade: Statistics) -> Iterator[tuple[str, Statistics]]:
    """Each cell under its method's name in print, with the instruction where there are several."""
    several = len(trade["instructions"]) > 1
    for method, cells in trade["methods"].items():
        for instruction, cell in cells.items():
            yield display_name(method) + (f", {instruction}" if several else ""), cell


def trade_tables(trade: Statistics) -> Iterator[Table]:
    """Every table; one without rows has nothing to say."""
    yield _accuracy(trade)
    yield _scores(trade)
    yield _effects(trade)
    yield _ez(trade)
    if not trade["diffusion"]["reason"]:
        yield _diffusion(trade)


def _accuracy(trade: Statistics) -> Table:
    return Table(
        caption="Accuracy and response time: means over participants with 95 % intervals",
        header=("Condition", "Trials", "Correct [%]", "Mean time [s]", "Median time [s]"),
        rows=tuple(
            (
                name,
                f"{cell['n']:,}",
                _mean(cell["accuracy"], 1, 100.0),
                _mean(cell["mean_s"], 3),
                _mean(cell["median_s"], 3),
            )
            for name, cell in cells_of(trade)
        ),
    )


def _scores(trade: Statistics) -> Table:
    return Table(
        caption="Scores that join speed and accuracy: means over participants with 95 % intervals, inverse efficiency "
        "(participants with a correct answer) and balanced integration (with one in every condition)",
        header=("Condition", "Participants", "IES [s]", "Participants", "BIS"),
        rows=tuple(
            (name, *_counted(cell["inverse_efficiency_s"], 3), *_counted(cell["balanced_integration"], 2))
            for name, cell in cells_of(trade)
        ),
    )


def _counted(one: Statistics, digits: int) -> tuple[str, str]:
    return f"{one['people']:,}", _mean(one, digits)


def _mean(one: Statistics, digits: int, scale: float = 1.0) -> str:
    """`mean [low, high]`; a dash for what is undefined, and no interval from one participant."""
    if one["mean"] is None:
        return apa.NONE
    mean = apa.number(scale * one["mean"], digits)
    return mean if one["ci_low"] is None else f"{mean} {_ends(one, digits, scale)}"


def _ends(one: Statistics, digits: int, scale: float = 1.0) -> str:
    low, high = (None if one[end] is None else scale * one[end] for end in ("ci_low", "ci_high"))
    return apa.interval(low, high, digits)


def _effects(trade: Statistics) -> Table:
    return Table(
        caption="Effect of the instruction, paired by participant: mean difference with 95 % interval, not corrected "
        "for the number of pairs; positive where the first has more",
        header=("Instructions", "Method", "Participants", "Correct [percentage points]", "Mean time [s]"),
        rows=tuple(
            (
                f"{one['a']} − {one['b']}",
                "all methods" if one["method"] is None else display_name(one["method"]),
                f"{one['accuracy']['people']:,}",
                _mean(one["accuracy"], 1, 100.0),
                _mean(one["mean_s"], 3),
            )
            for one in trade["instruction_effects"]
            if one["accuracy"]["people"]
        ),
    )


def _ez(trade: Statistics) -> Table:
    return Table(
        caption="EZ-diffusion by participant: means with 95 % intervals over participants",
        header=("Condition", "Participants", "Drift [1/√s]", "Boundary [√s]", "Non-decision time [s]", "Left out"),
        rows=tuple(
            (
                name,
                f"{cell['ez']['drift']['people']:,}",
                *(_mean(cell["ez"][parameter], digits) for parameter, digits in _EZ.items()),
                _left_out(cell["ez"]["left_out"]),
            )
            for name, cell in cells_of(trade)
        ),
    )


def _left_out(counts: Statistics) -> str:
    return ", ".join(f"{count:,} ({_LEFT_OUT[why]})" for why, count in counts.items() if count) or "none"


def _diffusion(trade: Statistics) -> Table:
    fits = trade["diffusion"]
    each, together = fits["each"]["estimates"], fits["together"]["estimates"]
    order = [*(f"drift {m}" for m in trade["methods"]), *(f"boundary {i}" for i in trade["instructions"]), *_WORDS]
    return Table(
        caption="Diffusion model by maximum likelihood: mean over participants' own fits, SD of these, and the fit of "
        "all trials together, which is biased where people differ; 95 % intervals",
        header=("Parameter", "Unit", "Participants", "Mean of own fits", "95 % CI", "SD", "Together", "95 % CI"),
        rows=tuple(
            (
                _parameter(name),
                _UNITS[name.partition(" ")[0]],
                *_of_each(each.get(name), _digits(name)),
                *_of_all(together.get(name), _digits(name)),
            )
            for name in order
            if name in each or name in together
        ),
    )


def _digits(name: str) -> int:
    return 3 if name in ("start", "non_decision_s") else 2


def _of_each(one: Statistics | None, digits: int) -> tuple[str, str, str, str]:
    if one is None:
        return "0", apa.NONE, apa.NONE, apa.NONE
    return f"{one['people']:,}", apa.number(one["mean"], digits), _ends(one, digits), apa.number(one["sd"], digits)


def _of_all(one: Statistics | None, digits: int) -> tuple[str, str]:
    return (apa.NONE, apa.NONE) if one is None else (apa.number(one["value"], digits), _ends(one, digits))


def _parameter(name: str) -> str:
    """A parameter's name in print.

    >>> _parameter("drift asymmetric-1"), _parameter("start")
    ('drift Asymmetric Force I', 'start (towards forward)')
    """
    return _WORDS.get(name, named(name))
