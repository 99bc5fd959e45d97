"""The table `[procedure]` of a design: how the levels of a factor are chosen, from the answers so far.

What a table can tell by itself is checked here; what it must agree on with the rest of the design, in
`procedure_problems`.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import log
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from experiments.config.door import InnerShare, Model, once
from experiments.design.language import ColumnName, Shape

if TYPE_CHECKING:
    from experiments.design.procedures.psychometric import Shares

MAX_TRACK = 1_000
"""More trials than this are in no track."""
PositiveNumber = Annotated[float, Field(gt=0, le=1e6)]
InARow = Annotated[int, Field(ge=1, le=20)]
StartLevels = Annotated[tuple[float, ...], Field(min_length=1, max_length=20)]
StepAs = Literal["difference", "factor"]


class ConstantConfig(Model):
    """Constant stimuli: every level is planned beforehand. The default."""

    kind: Literal["constant"]


class TracksConfig(Model):
    """What every adaptive procedure says of its tracks: one for each cell of the other factors that vary."""

    of: Annotated[tuple[ColumnName, ...], Field(min_length=1, max_length=2), AfterValidator(once)]
    question: ColumnName | None = None
    trials: Annotated[int, Field(ge=1, le=MAX_TRACK)]
    mixed: Annotated[tuple[ColumnName, ...], AfterValidator(once)] = ()
    interleave: bool = True
    show_level: bool = False


class NumericTracksConfig(TracksConfig):
    """What every procedure says that chooses numbers: it may end a track before its last trial."""

    least_trials: Annotated[int, Field(ge=0, le=MAX_TRACK)] = 0

    @model_validator(mode="after")
    def _least_within_most(self) -> Self:
        if self.least_trials > self.trials:
            raise ValueError(f"least_trials = {self.least_trials} is more than trials = {self.trials}: it never stops")
        return self


class UpDownConfig(NumericTracksConfig):
    """Up-down: so many wrong answers in a row make it easier, so many right ones harder."""

    kind: Literal["up-down"]
    starts: StartLevels
    up: InARow = 1
    down: InARow = 1
    steps: Annotated[tuple[PositiveNumber, ...], Field(min_length=1, max_length=100)]
    step_as: StepAs = "difference"
    ratio: PositiveNumber = 1.0
    reversals: Annotated[int, Field(ge=0, le=MAX_TRACK)] = 0

    @model_validator(mode="after")
    def _can_turn_so_often(self) -> Self:
        if self.least_reversal_trials > self.trials:
            raise ValueError(
                f"reversals = {self.reversals} takes {self.least_reversal_trials} trials or more, and trials = "
                f"{self.trials} end a track before: it would never stop there; ask for fewer, or allow more trials"
            )
        return self

    @model_validator(mode="after")
    def _can_move(self) -> Self:
        for name, in_a_row in (("up", self.up), ("down", self.down)):
            if in_a_row >= self.trials:
                raise ValueError(
                    f"{name} = {in_a_row} moves the level after {in_a_row} answers, and trials = {self.trials} end a "
                    "track before its next: it would never move; ask for fewer, or allow more trials"
                )
        return self

    @property
    def least_reversal_trials(self) -> int:
        """The fewest trials in which a track can turn so often: it goes either way first, and then turns."""
        one, other = sorted((self.up, self.down))
        moves = self.reversals + 1 if self.reversals else 0
        return -(-moves // 2) * one + moves // 2 * other


class KestenConfig(NumericTracksConfig):
    """Accelerated stochastic approximation: steps that shrink with each change of direction."""

    kind: Literal["kesten"]
    starts: StartLevels
    first_step: PositiveNumber
    step_as: StepAs = "difference"
    target: InnerShare
    reversals: Annotated[int, Field(ge=0, le=MAX_TRACK)] = 0

    @model_validator(mode="after")
    def _can_turn_so_often(self) -> Self:
        if self.reversals >= self.trials:
            raise ValueError(
                f"reversals = {self.reversals} takes {self.reversals + 1} trials or more, and trials = {self.trials} "
                "end a track before: it would never stop there; ask for fewer, or allow more trials"
            )
        return self

    @property
    def least_reversal_trials(self) -> int:
        """The fewest trials in which a track can turn so often."""
        return self.reversals + 1 if self.reversals else 0


class PriorConfig(Model):
    """What is thought of a parameter beforehand: values between two ends, alike, or normal about a mean."""

    minimum: float
    maximum: float
    points: Annotated[int, Field(ge=1, le=200)]
    spacing: Literal["even", "log"] = "even"
    mean: float | None = None
    sd: PositiveNumber | None = None

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        for problem in _prior_problems(self):
            raise ValueError(problem)
        return self

    @property
    def values(self) -> Shares:
        """The values."""
        import numpy as np  # noqa: PLC0415 - slow, and a design without such a procedure needs none of it

        if self.spacing == "log":
            return np.geomspace(self.minimum, self.maximum, self.points)
        return np.linspace(self.minimum, self.maximum, self.points)

    @property
    def weights(self) -> Shares:
        """How likely each value is beforehand, up to a factor: log-normal where the values are spaced so."""
        import numpy as np  # noqa: PLC0415 - as above

        if self.mean is None or self.sd is None:
            return np.ones(self.points)
        off = np.log(self.values / self.mean) if self.spacing == "log" else self.values - self.mean
        return np.asarray(np.exp(-0.5 * (off / self.sd) ** 2))


def _prior_problems(prior: PriorConfig) -> Iterator[str]:
    low, high = prior.minimum, prior.maximum
    if low > high:
        yield f"minimum = {low:g} is above maximum = {high:g}; exchange them"
    if prior.points == 1 and low != high:
        yield f"points = 1 is one value, which has minimum = maximum, not {low:g} and {high:g}"
    if prior.points > 1 and low == high:
        yield f"points = {prior.points}, but minimum = maximum = {low:g} is one value; write points = 1"
    if prior.spacing == "log" and low <= 0:
        yield f'minimum = {low:g} must be above 0 where spacing = "log"'
    if (prior.mean is None) != (prior.sd is None):
        yield "mean and sd go together; give both for a normal prior, or neither for an even one"
    if prior.mean is not None and not low <= prior.mean <= high:
        yield f"mean = {prior.mean:g} is outside of {low:g} to {high:g}, so the prior excludes it"
    elif prior.sd is not None and prior.sd < (apart := _distance(prior)) / 2:
        yield (
            f"sd = {prior.sd:g} is less than half the distance of the values, {apart:.4g}: one of them or none would "
            "be likely; make it larger, or give more points"
        )


def _distance(prior: PriorConfig) -> float:
    """How far apart the values stand, of their logarithms where they are spaced so; 0 of one value."""
    low, high = prior.minimum, prior.maximum
    return (log(high) - log(low) if prior.spacing == "log" else high - low) / max(prior.points - 1, 1)


class PosteriorConfig(NumericTracksConfig):
    """The posterior of a psychometric function: the next level is the one whose answer tells most."""

    kind: Literal["posterior"]
    rule: Literal["variance", "entropy"] = "variance"
    target: Literal["threshold", "width", "both"] = "threshold"
    shape: Shape = "normal"
    scale: Literal["linear", "log"] = "linear"
    threshold: PriorConfig
    width: PriorConfig
    lapse: PriorConfig = PriorConfig(minimum=0.0, maximum=0.08, points=5)
    lapse_either_way: bool = False
    guess: PriorConfig | None = None
    rise: PriorConfig | None = None
    floor: PriorConfig | None = None
    start: float | None = None
    tracks: Annotated[int, Field(ge=1, le=20)] = 1
    credible_width: PositiveNumber | None = None

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for problem in _posterior_problems(self):
            raise ValueError(problem)
        return self

    def scaled(self, prior: PriorConfig) -> Shares:
        """The values of a level, as the function takes them."""
        import numpy as np  # noqa: PLC0415 - as above

        return prior.values if self.scale == "linear" else np.asarray(np.log(prior.values))


def _posterior_problems(table: PosteriorConfig) -> Iterator[str]:
    if table.width.minimum <= 0:
        yield f"width.minimum = {table.width.minimum:g} must be above 0"
    if table.scale == "log" and table.threshold.minimum <= 0:
        yield f'threshold.minimum = {table.threshold.minimum:g} must be above 0 where scale = "log"'
    else:
        yield from _credible_width_problems(table)
    yield from _share_problems(table)
    yield from _target_problems(table)
    yield from _two_factor_problems(table)
    low, high = table.threshold.minimum, table.threshold.maximum
    if table.start is not None and not low <= table.start <= high:
        yield f"start = {table.start:g} is excluded by the prior of the threshold, {low:g} to {high:g}; widen that"


def _credible_width_problems(table: PosteriorConfig) -> Iterator[str]:
    """A width that the prior has already ends a track at once; one that its values cannot show, never."""
    import numpy as np  # noqa: PLC0415 - as above

    from experiments.design.procedures.posterior import credible_span  # noqa: PLC0415 - as above

    asked, values = table.credible_width, table.scaled(table.threshold)
    if asked is None:
        return
    before = float(credible_span(values, table.threshold.weights, log=table.scale == "log"))
    if asked >= before:
        yield (
            f"credible_width = {asked:g}: the interval of the prior is {before:.4g} wide, so that a track would end at "
            "once; ask for less, or widen the prior"
        )
    least = float(credible_span(values, np.eye(len(values)), log=table.scale == "log").min())
    if asked < least:
        yield (
            f"credible_width = {asked:g}: the values of the threshold stand too far apart for an interval narrower "
            f"than {least:.4g}, so that it would end no track; ask for more, or give threshold more points"
        )


def _share_problems(table: PosteriorConfig) -> Iterator[str]:
    for name, prior in {"lapse": table.lapse, "guess": table.guess}.items():
        if prior is not None and not 0 <= prior.minimum <= prior.maximum < 1:
            yield f"{name}: {prior.minimum:g} to {prior.maximum:g} must be shares, from 0, below 1"
    if table.guess is not None and table.lapse_either_way:
        yield "lapse_either_way = true: the guess rate is the lapse rate; remove the table guess, or the key"
    lapses = table.lapse.maximum * (2 if table.lapse_either_way else 1)
    if lapses + (table.guess.maximum if table.guess else 0.0) >= 1:
        yield "lapse and guess leave nothing to feel; make their maxima less than 1 together"


def _target_problems(table: PosteriorConfig) -> Iterator[str]:
    wanted = {"threshold": table.target != "width", "width": table.target != "threshold"}
    for name, asked in wanted.items():
        if asked and table.rule == "variance" and getattr(table, name).points == 1:
            yield f"target = {table.target!r}: {name} has one value, so nothing of it can be learnt; give it points"
    if table.rule == "entropy" and table.target != "threshold":
        yield f"target = {table.target!r}: the rule entropy asks for all parameters; remove the key"


def _two_factor_problems(table: PosteriorConfig) -> Iterator[str]:
    two = len(table.of) == 2
    if two and table.rule != "entropy":
        yield f'rule = {table.rule!r} is of one factor, not of {" and ".join(table.of)}; write rule = "entropy"'
    if two and table.rise is None:
        yield "rise is missing: of two factors the threshold of the first changes along the second; give its values"
    for name in (key for key in ("rise", "floor") if not two and getattr(table, key) is not None):
        yield f"{name} is of two factors; remove it"
    if two and table.scale == "log" and table.floor is not None and table.floor.minimum <= 0:
        yield f'floor.minimum = {table.floor.minimum:g} must be above 0 where scale = "log"'
    if two and table.start is not None:
        yield "start is of one factor; remove it"


class PairingConfig(TracksConfig):
    """Active pairing: the next pair is the one after which the order of all items is expected to be known best."""

    kind: Literal["pairing"]
    spread: Annotated[float, Field(ge=0.1, le=20)] = 2.0


NumericConfig = UpDownConfig | KestenConfig | PosteriorConfig
AdaptiveConfig = NumericConfig | PairingConfig
ProcedureConfig = Annotated[
    ConstantConfig | UpDownConfig | KestenConfig | PosteriorConfig | PairingConfig, Field(discriminator="kind")
]


def least_of_track(table: AdaptiveConfig) -> int:
    """The fewest trials that a track can take; as many as the most where only those end it."""
    if isinstance(table, PairingConfig):
        return table.trials
    if isinstance(table, PosteriorConfig):
        ends = table.credible_width is not None
        return max(table.least_trials, 1) if ends else table.trials
    return max(table.least_trials, table.least_reversal_trials) if table.reversals else table.trials


def starts_of(table: AdaptiveConfig) -> tuple[float | None, ...]:
    """The level at which each track of a cell begins; `None` where the rule chooses."""
    match table:
        case PosteriorConfig():
            return (table.start,) * table.tracks
        case PairingConfig():
            return (None,)
        case _:
            return table.starts
