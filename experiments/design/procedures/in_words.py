"""An adaptive procedure as the Methods section of a paper says it. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from device.messages import how_many
from experiments.design.procedures.config import (
    AdaptiveConfig,
    KestenConfig,
    NumericConfig,
    PairingConfig,
    PosteriorConfig,
    PriorConfig,
    UpDownConfig,
)
from experiments.design.procedures.walks import NumericLevels, walk_rule

_SHAPES = {
    "normal": "a cumulative normal",
    "logistic": "a logistic",
    "gumbel": "a Gumbel",
    "reversed-gumbel": "a reversed Gumbel",
}
_TARGETS = {"threshold": "its threshold", "width": "its width", "both": "its threshold and width"}


def pairing_words(table: PairingConfig) -> str:
    """How the next pair follows from the answers: a sentence's end, after “it was chosen after each answer”."""
    return (
        "so that the order of all was expected to be known best by the answer (active pairing by Bradley and Terry; "
        f"scores about 0, SD {table.spread:g} logits)"
    )


def rule_words(table: NumericConfig, levels: Sequence[NumericLevels]) -> str:
    """How the next level follows from the answers: a sentence's end, after “it was chosen after each answer”."""
    match table:
        case UpDownConfig():
            return _up_down(table, levels[0])
        case KestenConfig():
            return (
                f"by accelerated stochastic approximation towards {_percent(table.target)} (first step "
                f"{table.first_step:g}, from {_either(table.starts)})"
            )
        case PosteriorConfig():
            return _posterior(table)


def _up_down(table: UpDownConfig, levels: NumericLevels) -> str:
    rule = walk_rule(table, levels, levels[0])
    target = getattr(rule, "target", 0.0)
    weighed = "" if table.ratio == 1 else f", steps up {table.ratio:g} times as large"
    as_factor = " as factors" if table.step_as == "factor" else ""
    return (
        f"{table.down} down, {table.up} up, towards {_percent(target)} (steps{as_factor} of "
        f"{', '.join(f'{step:g}' for step in table.steps)} by the reversals so far{weighed}, from "
        f"{_either(table.starts)})"
    )


def _posterior(table: PosteriorConfig) -> str:
    shape = _SHAPES[table.shape] + (" of its logarithm" if table.scale == "log" else "")
    if table.rule == "entropy":
        how = "so that the answer was expected to tell most of a psychometric function"
    else:
        how = (
            f"so that the expected posterior variance of a psychometric function was least in {_TARGETS[table.target]}"
        )
    parts = {"threshold": table.threshold, "width": table.width, "lapse rate": table.lapse}
    further = {"guess rate": table.guess, "rise": table.rise, "floor": table.floor}
    parts |= {name: one for name, one in further.items() if one is not None}
    lapses = ", lapses either way" if table.lapse_either_way else ""
    return f"{how} ({shape}; {', '.join(f'{name} {_prior(one)}' for name, one in parts.items())}{lapses})"


def _prior(prior: PriorConfig) -> str:
    about = "" if prior.mean is None else f" about {prior.mean:g}, SD {prior.sd:g}"
    return f"{prior.minimum:g}" if prior.points == 1 else f"{prior.minimum:g} to {prior.maximum:g}{about}"


def end_words(table: AdaptiveConfig) -> str:
    """When a track ends, as part of a sentence: `of 40 trials`, or at the most so many and until what."""
    if isinstance(table, PairingConfig) or not (until := [*_ends(table)]):
        return f"of {how_many(table.trials, 'trial')}"
    least = f", after {how_many(table.least_trials, 'trial')} at the earliest" if table.least_trials else ""
    return f"of at most {how_many(table.trials, 'trial')}, which ended {until[0]}{least}"


def _ends(table: NumericConfig) -> Iterator[str]:
    if isinstance(table, PosteriorConfig):
        if table.credible_width is not None:
            yield f"when the 95 % credible interval of the threshold was narrower than {table.credible_width:g}"
    elif table.reversals:
        yield f"with reversal {table.reversals}"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _either(numbers: Sequence[float]) -> str:
    """Numbers as a sentence lists them; the same ones once.

    >>> _either([8.0, 6.0]), _either([8.0, 8.0])
    ('8 or 6', '8')
    """
    return " or ".join(dict.fromkeys(f"{number:g}" for number in numbers))
