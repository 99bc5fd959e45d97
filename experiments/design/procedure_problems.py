"""What a procedure's table and the rest of a design do not agree on, in words: what it adapts, asks and can reach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, product
from math import log, log2
from typing import TYPE_CHECKING

from experiments.design.language import (
    DRIVEN,
    METHOD_FACTOR,
    FactorConfig,
    OrderConfig,
    QuestionConfig,
    TrialConfig,
    shown_level,
)
from experiments.design.plan import CHOSEN
from experiments.design.procedures.config import (
    AdaptiveConfig,
    KestenConfig,
    NumericConfig,
    PairingConfig,
    PosteriorConfig,
    UpDownConfig,
    starts_of,
)
from experiments.design.procedures.walks import NumericLevels, are_even, level_range, walk_rule

if TYPE_CHECKING:
    from experiments.design.procedures.psychometric import Shares

_LARGEST_GRID = 6_000_000
"""Stimuli times places of the parameters' grid: so much is gone through in 20 ms (measured)."""
_LEAST_AMONG = 0.001
"""Of a prior so much at least lies among the levels."""
_MUCH, _ROUNDED = 100, 1e-9
"""Widths so many times smaller than the distance of levels, or larger than their range, no answer tells apart."""
_EITHER_WAY = 1
"""So many answers at least that are not right, and so many beyond chance that are, a track meets at what it goes to."""
_FEWEST_ITEMS, _MOST_ITEMS = 3, 30
"""Two items are one pair; the next pair of more items takes longer than a hand-over, by the fourth power (measured)."""


def followed_question(table: AdaptiveConfig, questions: Mapping[str, QuestionConfig]) -> str | None:
    """The question whose answers a procedure follows: the one that is named, else the first that it can follow."""
    follows = chooses_of_pair if isinstance(table, PairingConfig) else has_success
    able = [name for name, one in questions.items() if one.when == "trial" and follows(one)]
    return next((name for name in able if table.question in (None, name)), None)


def chooses_of_pair(question: QuestionConfig) -> bool:
    """Whether an answer says which of a pair was chosen: the first answer the first, the second the other."""
    return question.kind == "choice" and len(question.answers) in (2, 3) and question.correct in (None, "larger")


def has_success(question: QuestionConfig) -> bool:
    """Whether an answer can be a success: a yes, or what is right."""
    return question.kind == "yes-no" or question.correct is not None


def guess_of(question: QuestionConfig) -> float:
    """How often who feels nothing succeeds: 0 of yes, and of “larger”, which goes from never to always."""
    yes = question.kind == "yes-no" and question.correct in (None, "stimulus")
    return 0.0 if yes or question.correct == "larger" else 1.0 / len(question.named_answers)


def procedure_problems(
    table: AdaptiveConfig,
    factors: Mapping[str, FactorConfig],
    order: OrderConfig,
    trial: TrialConfig,
    questions: Mapping[str, QuestionConfig],
) -> Iterator[str]:
    """Each disagreement, with key, value and what would do."""
    own = [
        *_kind_problems(table, trial),
        *_factor_problems(table, factors, order),
        *_order_problems(order),
        *_comparison_problems(table, trial),
    ]
    yield from own
    name = followed_question(table, questions)
    if name is None:
        yield from _question_problems(table, questions)
    later = [one for one, question in questions.items() if question.when == "block"]
    if later:
        yield f"questions.{later[0]}: when = 'block': a track has no fixed number of trials to ask about; ask at once"
    if own or name is None:
        return
    if isinstance(table, PairingConfig):
        yield from _pairing_problems(table, factors[table.of[0]])
    else:
        yield from _numeric_problems(table, factors, guess_of(questions[name]))


def _numeric_problems(table: NumericConfig, factors: Mapping[str, FactorConfig], guess: float) -> Iterator[str]:
    levels = [tuple(float(one) for one in factors[one].all_levels) for one in table.of]
    yield from _start_problems(table, levels[0])
    match table:
        case PosteriorConfig():
            yield from _posterior_problems(table, levels, guess)
        case UpDownConfig() | KestenConfig():
            yield from _walk_problems(table, levels[0], guess)


def _factor_problems(table: AdaptiveConfig, factors: Mapping[str, FactorConfig], order: OrderConfig) -> Iterator[str]:
    unknown = [name for name in (*table.of, *table.mixed) if name not in factors]
    if unknown:
        yield f"procedure names {unknown[0]!r}, which is no factor; the factors are {', '.join(factors)}"
        return
    for name in table.of:
        what = _item_problems if isinstance(table, PairingConfig) else _chosen_problems
        yield from what(name, factors[name])
    for name in (*table.of, *table.mixed):
        factor = factors[name]
        if factor.within is not None or factor.between or name in (*order.session, *order.set):
            yield f"procedure: {name} must vary from trial to trial: not nested, between people, or in order"
    both = [name for name in table.mixed if name in table.of]
    if both:
        yield f"procedure.mixed: {both[0]} is what is chosen, so it cannot be mixed as well; remove it"


def _chosen_problems(name: str, factor: FactorConfig) -> Iterator[str]:
    if isinstance(factor.all_levels[0], str):
        yield f"procedure.of: the levels of {name} are words; a procedure chooses numbers"
    elif name not in DRIVEN:
        yield (
            f"procedure.of: {name} is set by hand, before the answers are known; a procedure chooses what the "
            f"command of a shot carries: {' or '.join(DRIVEN)}"
        )
    elif len(factor.all_levels) < 2:
        yield f"factors.{name}.levels: one level leaves nothing to choose; give several"
    elif list(factor.all_levels) != sorted(factor.all_levels):
        yield f"factors.{name}.levels: a procedure needs them in order, lowest first"


def _item_problems(name: str, factor: FactorConfig) -> Iterator[str]:
    items = len(factor.all_levels)
    if name not in (METHOD_FACTOR, *DRIVEN):
        yield (
            f"procedure.of: {name} is set by hand, before the answers are known; pairs are chosen of what the command "
            f"of a shot carries: {', '.join((METHOD_FACTOR, *DRIVEN))}"
        )
    elif not _FEWEST_ITEMS <= items <= _MOST_ITEMS:
        yield (
            f"factors.{name}.levels: {items} items; pairs are chosen of {_FEWEST_ITEMS} to {_MOST_ITEMS}: of fewer "
            "leave [procedure] out, of more take some away"
        )
    elif CHOSEN in factor.all_levels:
        yield f"factors.{name}.levels: {CHOSEN!r} stands for what is not chosen yet; give that level another name"


def _pairing_problems(table: PairingConfig, factor: FactorConfig) -> Iterator[str]:
    items = len(factor.all_levels)
    if table.trials < items - 1:
        yield (
            f"procedure.trials = {table.trials} cannot connect the {items} levels of {table.of[0]}, which takes "
            f"{items - 1} at least; allow more trials, or compare fewer levels"
        )


def _order_problems(order: OrderConfig) -> Iterator[str]:
    said = {
        "repetitions": order.repetitions != 1,
        "trials": order.trials != "random",
        "balance": order.balance != "session",
        "longest_run": bool(order.longest_run),
    }
    for key in (key for key, wrong in said.items() if wrong):
        yield f"order.{key} is of constant stimuli; procedure.trials and procedure.interleave say it here: remove it"


def _kind_problems(table: AdaptiveConfig, trial: TrialConfig) -> Iterator[str]:
    pairs = isinstance(table, PairingConfig)
    if pairs and trial.kind != "pair":
        yield f"trial.kind = {trial.kind!r}: the procedure chooses pairs; say kind = 'pair', or take another procedure"
    if pairs and len(table.of) > 1:
        yield f"procedure.of = {', '.join(table.of)}: a pair differs in one factor; name the one of trial.compare"
    if not pairs and trial.kind == "pair":
        yield (
            "trial.kind = 'pair': all levels are compared with each other; a procedure needs a standard, or is of the "
            "kind pairing"
        )


def _comparison_problems(table: AdaptiveConfig, trial: TrialConfig) -> Iterator[str]:
    if trial.compare in table.mixed:
        yield f"procedure.mixed: {trial.compare} is what intervals differ in; take it out"
    if trial.intervals > 1 and trial.compare not in table.of:
        yield f"trial.compare = {trial.compare!r}: compare what the procedure chooses, {' or '.join(table.of)}"


def _question_problems(table: AdaptiveConfig, questions: Mapping[str, QuestionConfig]) -> Iterator[str]:
    rule = "a procedure follows a yes-no, or a choice of which one is right (`correct`), asked after each trial"
    lacks = "no answer is a success"
    if isinstance(table, PairingConfig):
        rule = (
            "it follows a choice asked after each trial whose first answer is the first of the pair, the second the "
            "other, a third neither"
        )
        lacks = "no answer says which of the pair it is"
    if table.question is None:
        yield f"procedure: {lacks} ({', '.join(questions)}): {rule}"
    elif table.question in questions:
        yield f"procedure.question = {table.question!r}: {lacks}: {rule}"
    else:
        yield f"procedure.question = {table.question!r} is no question; they are {', '.join(questions)}"


def _start_problems(table: NumericConfig, levels: NumericLevels) -> Iterator[str]:
    for start in starts_of(table):
        if start is not None and start not in levels:
            near = sorted(levels, key=lambda level: abs(level - start))[:2]
            shown = " or ".join(map(shown_level, sorted(near)))
            key = "start" if isinstance(table, PosteriorConfig) else "starts"
            yield (
                f"procedure.{key}: {start:g} is none of the levels of {table.of[0]}, {levels[0]:g} to "
                f"{levels[-1]:g}; nearest: {shown}"
            )


def _walk_problems(table: UpDownConfig | KestenConfig, levels: NumericLevels, guess: float) -> Iterator[str]:
    name = table.of[0]
    if len(table.of) > 1:
        yield f"procedure.of = {', '.join(table.of)}: {table.kind} chooses one factor; two take the kind posterior"
        return
    backwards = [size for size in getattr(table, "steps", ()) if table.step_as == "factor" and size <= 1]
    if backwards:
        yield (
            f"procedure.steps: {backwards[0]:g} is a factor that right answers divide by, so it must be above 1; "
            "the track would go the wrong way"
        )
        return
    if not are_even(levels):
        yield f"factors.{name}.levels: steps up and down need them at even distances; give minimum, maximum and grain"
        return
    yield from [*_size_problems(table, levels)] or _settling_problems(table, levels, guess)


def _settling_problems(table: UpDownConfig | KestenConfig, levels: NumericLevels, guess: float) -> Iterator[str]:
    """A rule that settles where who feels nothing is right as often, and steps that get nowhere."""
    if isinstance(table, KestenConfig):
        yield from _target_problems(table, guess)
        return
    rule = walk_rule(table, levels, levels[0])
    if rule.target <= guess:
        key = f"down = {table.down}" if table.ratio == 1 else f"ratio = {table.ratio:g}"
        yield (
            f"procedure.{key}: the rule settles where {rule.target:.3g} are right, and who feels nothing is right in "
            f"{guess:.3g}: it would never settle; more right answers in a row (down), or a larger ratio"
        )
    yield from _step_problems(table, levels)


def _target_problems(table: KestenConfig, guess: float) -> Iterator[str]:
    """Steps shrink where answers turn: a track that meets answers of one kind alone ends where it happens to be."""
    low, high = guess + _EITHER_WAY / table.trials, 1 - _EITHER_WAY / table.trials
    if low >= high:
        yield (
            f"procedure.trials = {table.trials} are too few for any target, where who feels nothing is right in "
            f"{guess:.3g}; allow more"
        )
    elif not low <= table.target <= high:
        yield (
            f"procedure.target = {table.target:g}: a track of {table.trials} trials would hardly ever turn there; "
            f"from {low:.3g} to {high:.3g} it does (who feels nothing is right in {guess:.3g}), or allow more trials"
        )


def _size_problems(table: UpDownConfig | KestenConfig, levels: NumericLevels) -> Iterator[str]:
    """Steps that lead to an end from everywhere, and such as never leave a level; of factors, their logarithms."""
    low, high, grain = levels[0], levels[-1], levels[1] - levels[0]
    factors = table.step_as == "factor"
    if factors and low <= 0:
        yield f"procedure.step_as = 'factor': {table.of[0]} has the level {low:g}; factors need levels above 0"
        return
    where = f"all of {table.of[0]}, {low:g} to {high:g}"
    if isinstance(table, KestenConfig):
        size, widest = table.first_step, log2(high / low) if factors else high - low
        if size * max(table.target, 1 - table.target) > widest:
            yield f"procedure.first_step = {size:g} goes through {where}, in the first step; make it smaller"
        if size < (log2(high / (high - grain)) if factors else (1 - _ROUNDED) * grain):
            yield (
                f"procedure.first_step = {size:g} is smaller than the grain of {table.of[0]}, {grain:.4g}, and steps "
                "only shrink; make it several times as large"
            )
        return
    size, widest = max(table.steps), log(high / low) if factors else high - low
    step = log(size) if factors else size
    if step > (1 + _ROUNDED) * widest:
        yield f"procedure.steps: {size:g} goes through {where}, in one step; make it smaller"
    elif step * table.ratio > (1 + _ROUNDED) * widest:
        yield f"procedure.ratio = {table.ratio:g}: a step up of {size:g} goes through {where}; make it smaller"


def _step_problems(table: UpDownConfig, levels: NumericLevels) -> Iterator[str]:
    """A step that is lost in the grain would hold a track where it is for ever."""
    within = level_range(levels, table.step_as)
    for size in table.steps:
        ways = (size**table.ratio, 1 / size) if within.factors else (size * table.ratio, -size)
        for level, step in product(levels, ways):
            goal = within.moved(level, step)
            if within.low <= goal <= within.high and within.kept(goal) == level:
                yield (
                    f"procedure.steps: {size:g} does not leave the level {level:g} of {table.of[0]} (grain "
                    f"{within.grain:.4g}): the track would stay there; make steps larger, or the grain finer"
                )
                return


def _posterior_problems(table: PosteriorConfig, levels: Sequence[NumericLevels], guess: float) -> Iterator[str]:
    first, name = levels[0], table.of[0]
    if table.guess is not None and guess:
        yield f"procedure.guess: who feels nothing is right in {guess:.3g} here, by the design; remove the table"
    if table.lapse_either_way and guess:
        yield f"procedure.lapse_either_way: of {guess:.3g} right by chance lapses go either way anyway; remove the key"
    if guess + table.lapse.maximum >= 1:
        yield f"procedure.lapse.maximum = {table.lapse.maximum:g} and the guess rate {guess:.3g} leave nothing to feel"
    places, parts = 1, (table.threshold, table.width, table.lapse, table.guess, table.rise, table.floor)
    for points in (*(part.points for part in parts if part), *map(len, levels)):
        places *= points
    if places > _LARGEST_GRID:
        yield (
            f"procedure: {places:,} stimuli times values of the parameters are more than {_LARGEST_GRID:,}, which can "
            "be gone through between two trials; take fewer points or levels"
        )
    elif table.scale == "log" and min(one[0] for one in levels) <= 0:
        yield f"procedure.scale = 'log': levels must be above 0; {name} begins at {first[0]:g}"
    else:
        yield from _threshold_problems(table, levels)
        yield from _width_problems(table, first)


def _threshold_problems(table: PosteriorConfig, levels: Sequence[NumericLevels]) -> Iterator[str]:
    """A prior is held against the levels: of two factors at two levels of the second at least."""
    first, name, prior = levels[0], table.of[0], table.threshold
    below = {key: one.minimum for key, one in (("threshold", prior), ("floor", table.floor)) if one and one.minimum < 0}
    for key, minimum in below.items():
        yield f"procedure.{key}.minimum = {minimum:g}: no {name} is below 0; begin at 0 or above"
    if below:
        return
    thresholds, weights = _thresholds(table, levels)
    low, high = (x - 1e-9 * sign for sign, x in ((1, first[0]), (-1, first[-1])))
    if table.scale == "log":
        low, high = log(low), log(high)
    among = ((thresholds >= low) & (thresholds <= high)).sum(axis=-1) >= len(table.of)
    share = float((weights * among).sum() / weights.sum())
    shown = f"the prior, {prior.minimum:g} to {prior.maximum:g},"
    if len(table.of) == 2:
        shown += f" with rise and floor, at two levels of {table.of[1]}"
    if share < _LEAST_AMONG:
        yield f"procedure.threshold: {shown} holds none of the levels of {name}, {first[0]:g} to {first[-1]:g}"
    elif among.sum() < min(2, among.size):
        yield (
            f"procedure.threshold: {shown} has one value only among the levels of {name}, {first[0]:g} to "
            f"{first[-1]:g}; give it more points there"
        )


def _thresholds(table: PosteriorConfig, levels: Sequence[NumericLevels]) -> tuple[Shares, Shares]:
    """The thresholds of the prior (places, levels of the second factor, or 1), and the places' weights."""
    import numpy as np  # noqa: PLC0415 - slow, and a design without such a procedure needs none of it

    from experiments.design.procedures.surface import threshold_along  # noqa: PLC0415 - as above

    values = table.scaled(table.threshold)
    if table.rise is None:
        return values[:, None], table.threshold.weights
    other = np.log(levels[1]) if table.scale == "log" else np.asarray(levels[1], float)
    floors = np.array([-np.inf]) if table.floor is None else table.scaled(table.floor)
    floor_weights = np.ones(1) if table.floor is None else table.floor.weights
    held = threshold_along(
        other - other.mean(), values[:, None, None, None], table.rise.values[:, None, None], floors[:, None]
    )
    weights = table.threshold.weights[:, None, None] * table.rise.weights[:, None] * floor_weights
    return held.reshape(-1, len(other)), weights.ravel()


def _width_problems(table: PosteriorConfig, levels: NumericLevels) -> Iterator[str]:
    x = [log(level) for level in levels] if table.scale == "log" else levels
    apart, span, name = min(after - before for before, after in pairwise(x)), x[-1] - x[0], table.of[0]
    if table.width.minimum < apart / _MUCH:
        yield (
            f"procedure.width.minimum = {table.width.minimum:g} is less than a {_MUCH}th of the distance of levels of "
            f"{name}, {apart:.4g}: no answers tell that from a step; make it larger"
        )
    if table.width.maximum > _MUCH * span:
        yield (
            f"procedure.width.maximum = {table.width.maximum:g} is more than {_MUCH} times the range of {name}, "
            f"{span:.4g}: no answers tell that from chance; make it smaller"
        )
