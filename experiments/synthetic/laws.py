"""How synthetic people answer each question of a design: a law each, in a file that only simulation reads. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Literal, Self, TypeVar

from pydantic import AfterValidator, Field, model_validator

from device.words import DIRECTIONS
from experiments.config.door import (
    ConfigError,
    InnerShare,
    Model,
    PositiveSeconds,
    Seconds,
    Share,
    Spread,
    Text,
    leaves,
    printable,
)
from experiments.design.config import DesignConfig
from experiments.design.language import (
    DIRECTION_FACTOR,
    EMPTY,
    INSTRUCTION_FACTOR,
    ColumnName,
    Level,
    QuestionConfig,
    shown_level,
)
from experiments.design.plan import Condition, Plan
from experiments.synthetic.model_based import DiffusionConfig, ModelParameters, PeopleConfig
from experiments.synthetic.percept import PerceptConfig
from experiments.synthetic.preference import Appeal

Positive = Annotated[float, Field(gt=0, le=1e9)]

EVERYWHERE = "all"
"""The cell of a law that does not say by what it differs."""


class LogNormalTimes(Model):
    """A response time: shift + median exp(sigma z), z standard normal."""

    shift_s: Seconds = 0.35
    median_s: PositiveSeconds = 0.75
    sigma: Spread = 0.45


class Bias(Model):
    """A leaning towards an answer, in probit units: in the mean over people, and how people differ."""

    answer: ColumnName
    mean: Annotated[float, Field(ge=-10, le=10)] = 0.0
    sd: Spread = 0.0


class RatesLaw(Model):
    """Right answers at a rate by the levels of the factors `by`, as `share`'s keys name them, joined by `/`.

    Probit of a person's rate: S z(share) + ability, and + or - bias where the answer that is leant to is right or not;
    S = sqrt(1 + ability_sd^2 + bias.sd^2), so without a mean bias `share` is the mean over people.
    """

    law: Literal["rates"]
    by: tuple[ColumnName, ...] = ()
    share: dict[str, InnerShare]
    ability_sd: Spread = 0.0
    bias: Bias | None = None

    @property
    def bias_sd(self) -> float:
        """How people differ in their leaning."""
        return self.bias.sd if self.bias else 0.0

    @property
    def spread(self) -> float:
        """S: by how much the probits of one person lie further apart than those of the mean over people."""
        return math.sqrt(1 + self.ability_sd**2 + self.bias_sd**2)


class SharesLaw(Model):
    """How often each answer is given, by the levels of the factors `by`; of a choice in which nothing need be right."""

    law: Literal["shares"]
    by: tuple[ColumnName, ...] = ()
    share: dict[str, dict[str, Share]]

    @model_validator(mode="after")
    def _shares_make_one(self) -> Self:
        for cell, shares in self.share.items():
            if abs(math.fsum(shares.values()) - 1.0) > 1e-6:
                raise ValueError(f"share.{cell}: {', '.join(f'{one:g}' for one in shares.values())} must sum to 1")
        return self


class PsychometricLaw(Model):
    """A right answer, or yes, with g + (1 - g - lapse) F(ln(x / threshold) / spread), F the standard normal.

    x is the level of `factor`; 0 is not felt. g is chance for a scored choice, `guess` for yes-no. For a question about
    the larger of two the threshold is the other interval's level: the larger is chosen with
    lapse / 2 + (1 - lapse) F(...).
    """

    law: Literal["psychometric"]
    factor: ColumnName
    threshold: Positive
    spread: Positive
    guess: Share = 0.05
    lapse: Share = 0.02
    log_threshold_sd: Spread = 0.0


class RatingsLaw(Model):
    """Means by the levels of the factors `by`, a person's own leaning, and noise from rating to rating.

    Two habits, of ratings by one factor: the level `lowest` is kept at least one grain below all others, and with the
    share `same_share` the two levels of `same` get one rating. With a habit a person rates a level the same each time.
    """

    law: Literal["ratings"]
    by: tuple[ColumnName, ...] = ()
    mean: dict[str, Annotated[float, Field(ge=-1e6, le=1e6)]]
    person_sd: Spread = 0.0
    noise_sd: Spread = 0.0
    lowest: Text | None = None
    same: tuple[Text, Text] | None = None
    same_share: Share = 0.0

    @property
    def habitual(self) -> tuple[str, ...]:
        """The levels that the habits speak of."""
        return (*((self.lowest,) if self.lowest else ()), *(self.same or ()))


class PowerLaw(Model):
    """Stevens: scale x^exponent, times log-normal factors of the person (modulus) and of the answer.

    Of a catch trial, in which nothing is felt, the least number.
    """

    law: Literal["power"]
    factor: ColumnName
    exponent: Annotated[float, Field(ge=-10, le=10)]
    scale: Positive = 1.0
    person_sd: Spread = 0.0
    noise_sd: Spread = 0.0


class WorthLaw(Model):
    """Bradley and Terry: the first of a pair is chosen with w1 / (w1 + w2); ranks are drawn one after another.

    Of three answers the third is a tie, as likely as `tie` sqrt(w1 w2) beside w1 and w2 (Davidson 1970).
    """

    law: Literal["worth"]
    factor: ColumnName
    worth: dict[str, Positive]
    log_worth_sd: Spread = 0.0
    tie: Annotated[float, Field(ge=0, le=1e3)] = 0.0


class WordsLaw(Model):
    """One of some texts, at random; an empty one is none."""

    law: Literal["words"]
    texts: Annotated[
        tuple[Annotated[str, Field(max_length=2_000), AfterValidator(printable)], ...], Field(min_length=1)
    ] = ("",)


class DiffusionLaw(Model):
    """Which way it shot, from what the gun does: each shot's percept, then a diffusion, hurried by instructions."""

    law: Literal["diffusion"]
    percept: PerceptConfig = PerceptConfig()
    diffusion: DiffusionConfig = DiffusionConfig()
    people: PeopleConfig = PeopleConfig()

    @property
    def own(self) -> ModelParameters:
        """The model's own type."""
        return ModelParameters(
            percept=self.percept.own,
            boundaries=self.diffusion.boundaries,
            non_decision_s=self.diffusion.non_decision_s,
            lapses=self.diffusion.lapses.own,
            people=self.people.own,
        )


class AppealLaw(Model):
    """Ratings from what the gun does: how strongly each method's shot is felt, and how that appeals."""

    law: Literal["appeal"]
    percept: PerceptConfig = PerceptConfig()
    appeal: Appeal = Appeal()


class TableLaw(Model):
    """Answers that are given beforehand: `file` has a line a participant and cell of the factors `by`.

    Its columns: participant_id, the factors, and `correct` (how many of the cell's trials are right) of a scored choice
    or the question's own name. `rows` are its lines, once they are read.
    """

    law: Literal["table"]
    file: Text
    by: Annotated[tuple[ColumnName, ...], Field(min_length=1)] = ("method",)
    rows: tuple[dict[str, str], ...] = ()

    def columns(self, question: str, *, scored: bool) -> tuple[str, ...]:
        """The columns that the file must have."""
        return ("participant_id", *self.by, "correct" if scored else question)


Law = Annotated[
    RatesLaw
    | SharesLaw
    | PsychometricLaw
    | RatingsLaw
    | PowerLaw
    | WorthLaw
    | WordsLaw
    | DiffusionLaw
    | AppealLaw
    | TableLaw,
    Field(discriminator="law"),
]


class SyntheticAnswers(Model):
    """A file of `configs/synthetic/`: the law of each question, and how fast people answer."""

    questions: dict[ColumnName, Law]
    times: LogNormalTimes = LogNormalTimes()
    exposure_s: PositiveSeconds = 5.0
    assumed: tuple[Text, ...] = ()

    @model_validator(mode="after")
    def _assumed_exists(self) -> Self:
        unknown = sorted(set(self.assumed) - set(leaves(self)))
        if unknown:
            raise ValueError(f"assumed names {', '.join(unknown)}, which this file does not have; name existing keys")
        return self


_LAWS_OF: Mapping[str, tuple[str, ...]] = {
    "choice": ("rates", "shares", "psychometric", "worth", "diffusion", "table"),
    "yes-no": ("rates", "shares", "psychometric", "table"),
    "rating": ("ratings", "appeal", "table"),
    "number": ("power", "ratings", "table"),
    "ranking": ("worth",),
    "text": ("words",),
}
_OF_A_RIGHT_ANSWER = ("rates", "psychometric", "diffusion")


def check_laws(design: DesignConfig, laws: SyntheticAnswers, plans: Iterable[Plan] = ()) -> None:
    """`ConfigError`: a question without a law, a law without a question, or one that does not cover what is planned."""
    for name, question in design.questions.items():
        if name not in laws.questions:
            raise ConfigError(f"questions.{name} is missing; each question of {design.design} needs a law")
        for problem in _problems(design, question, laws.questions[name]):
            raise ConfigError(f"questions.{name}{problem}")
    strangers = [name for name in laws.questions if name not in design.questions]
    if strangers:
        known = ", ".join(design.questions)
        raise ConfigError(f"questions.{strangers[0]}: {design.design} asks no such question; it asks {known}")
    met = dict.fromkeys(trial.levels for plan in plans for trial in plan.trials)
    for name, law in laws.questions.items():
        for place, values in {"share": getattr(law, "share", {}), "mean": getattr(law, "mean", {})}.items():
            for levels in met if values else ():
                of_condition(values, getattr(law, "by", ()), levels, f"questions.{name}.{place}")


def superfluous(design: DesignConfig, laws: SyntheticAnswers, plans: Iterable[Plan]) -> Iterator[str]:
    """The cells and levels that a law has a value for, and nobody meets. `plans`: one of each group, with practices."""
    met = list(dict.fromkeys(trial.levels for plan in plans for trial in plan.trials))
    for name, law in laws.questions.items():
        for place in ("share", "mean", "worth"):
            values = getattr(law, place, {})
            if isinstance(law, WorthLaw):
                known = [*map(shown_level, design.factors[law.factor].all_levels), EMPTY]
            else:
                known = list(dict.fromkeys(cell_of(getattr(law, "by", ()), levels) for levels in met))
            for cell in values:
                if cell not in known:
                    there = ", ".join(known)
                    yield f'questions.{name}.{place}."{cell}": nobody meets that; {design.design} has {there}'


_FAR = 10.0
"""A threshold so many times beyond all levels is most likely in another unit (assumed)."""


def far_thresholds(design: DesignConfig, laws: SyntheticAnswers) -> Iterator[str]:
    """The thresholds that no level is near."""
    for name, law in laws.questions.items():
        if not isinstance(law, PsychometricLaw) or design.questions[name].correct == "larger":
            continue
        levels = [level for level in design.factors[law.factor].all_levels if isinstance(level, float) and level > 0]
        if levels and not min(levels) / _FAR <= law.threshold <= max(levels) * _FAR:
            yield (
                f"questions.{name}.threshold = {law.threshold:g}: the levels of {law.factor} are {min(levels):g} to "
                f"{max(levels):g}, all of them far from it; give the threshold in the unit of the levels"
            )


def _problems(design: DesignConfig, question: QuestionConfig, law: Law) -> Iterator[str]:
    common = [*_common_problems(design, question, law)]
    if common:
        yield from common
        return
    match law:
        case PsychometricLaw():
            yield from _psychometric_problems(question, law)
        case RatesLaw():
            yield from _bias_problems(question, law.bias)
        case SharesLaw():
            yield from _share_problems(question, law)
        case RatingsLaw():
            yield from _mean_problems(question, law)
            yield from _habit_problems(design, law)
        case WorthLaw():
            yield from _worth_problems(design, question, law)
        case AppealLaw() | DiffusionLaw():
            yield from _felt_problems(design, question, law)


def _common_problems(design: DesignConfig, question: QuestionConfig, law: Law) -> Iterator[str]:
    known = _LAWS_OF[question.kind]
    if law.law not in known:
        yield f".law = {law.law!r}: a question of kind {question.kind!r} has {', '.join(known)}"
    if law.law in _OF_A_RIGHT_ANSWER and question.correct is None:
        yield f".law = {law.law!r}: nothing is right here; give the question `correct`, or use the law shares"
    chosen = [name for name in getattr(law, "by", ()) if name in design.adapted]
    if chosen or (design.adapted and isinstance(law, AppealLaw | TableLaw)):
        what = f"by {chosen[0]}" if chosen else "beforehand"
        yield f".law = {law.law!r}: levels of {', '.join(design.adapted)} are chosen by the answers, so none is {what}"
    for factor in (*getattr(law, "by", ()), *filter(None, (getattr(law, "factor", None),))):
        if factor not in design.factors:
            yield f" names {factor!r}, which is no factor; they are {', '.join(design.factors)}"
            return
    if isinstance(law, PsychometricLaw | PowerLaw):
        least, rule = (0.0, "from 0") if isinstance(law, PsychometricLaw) else (5e-324, "above 0")
        levels = design.factors[law.factor].all_levels
        bad = [shown_level(level) for level in levels if not isinstance(level, float) or level < least]
        if bad:
            yield f".factor = {law.factor!r}: this law needs numbers {rule}; its levels are {', '.join(bad)}"


def _psychometric_problems(question: QuestionConfig, law: PsychometricLaw) -> Iterator[str]:
    if question.kind != "yes-no" and law.guess != PsychometricLaw.model_fields["guess"].default:
        yield f".guess = {law.guess:g} is of yes-no; who does not feel it guesses among the answers here: remove it"
    if question.kind == "yes-no" and law.guess + law.lapse >= 1.0:
        yield f": guess {law.guess:g} and lapse {law.lapse:g} leave nothing to feel; make them less than 1 together"


def _bias_problems(question: QuestionConfig, bias: Bias | None) -> Iterator[str]:
    if bias is not None and (bias.answer not in question.named_answers or len(question.named_answers) != 2):
        yield f".bias.answer = {bias.answer!r}: must be one of two answers; there are {_listed(question)}"


def _share_problems(question: QuestionConfig, law: SharesLaw) -> Iterator[str]:
    for cell, shares in law.share.items():
        if set(shares) != set(question.named_answers):
            yield f".share.{cell} has {', '.join(shares)}; it must have each of {_listed(question)}"


def _listed(question: QuestionConfig) -> str:
    return ", ".join(question.named_answers)


def _mean_problems(question: QuestionConfig, law: RatingsLaw) -> Iterator[str]:
    scale = question.scale
    for cell, mean in law.mean.items():
        if not scale.minimum <= mean <= scale.maximum:
            yield f".mean.{cell} = {mean:g} is off the scale, {scale.minimum:g} to {scale.maximum:g}"


def _habit_problems(design: DesignConfig, law: RatingsLaw) -> Iterator[str]:
    if law.habitual and len(law.by) != 1:
        yield ": lowest and same are levels of one factor; name it alone in `by`"
        return
    known = [shown_level(level) for name in law.by for level in design.factors[name].all_levels]
    for level in law.habitual:
        if level not in known and level not in law.mean:  # a design may do without a method that others have
            yield f" names {level!r}, which is no level of {law.by[0]}; they are {', '.join(known)}"


def _worth_problems(design: DesignConfig, question: QuestionConfig, law: WorthLaw) -> Iterator[str]:
    missing = [one for one in map(shown_level, design.factors[law.factor].all_levels) if one not in law.worth]
    if missing:
        yield f".worth has no value for {', '.join(missing)}; give one for each level"
    answers = question.named_answers
    if question.kind == "choice" and (law.factor != design.trial.compare or len(answers) not in (2, 3)):
        yield (
            ".law = 'worth': of a choice it says which of the two intervals is chosen, or with a third answer that "
            "neither is, so its factor is trial.compare; here use the law shares"
        )
    elif law.tie and len(answers) != 3:
        yield f".tie = {law.tie:g}: no third answer is a tie; name one, or remove the key"


def _felt_problems(design: DesignConfig, question: QuestionConfig, law: AppealLaw | DiffusionLaw) -> Iterator[str]:
    if design.trial.catch:
        yield f".law = {law.law!r}: it says what a shot does, and a catch trial (trial.catch) has none; use another law"
    if not isinstance(law, DiffusionLaw):
        return
    if question.correct != DIRECTION_FACTOR or set(question.named_answers) != set(DIRECTIONS):
        yield f".law = 'diffusion': it decides on a direction; correct must be {DIRECTION_FACTOR!r}"
    told = design.factors.get(INSTRUCTION_FACTOR)
    missing = [str(level) for level in told.all_levels if level not in law.diffusion.boundaries] if told else []
    if missing:
        yield f".diffusion.boundaries has no value for {', '.join(missing)}; give one for each instruction"


def cell_of(by: Sequence[str], levels: Condition) -> str:
    """The key of a cell in a law's table.

    >>> cell_of(("method", "direction"), (("direction", "forward"), ("method", "vibration")))
    'vibration/forward'
    """
    held: dict[str, Level] = dict(levels)
    return "/".join(shown_level(held[name]) for name in by if name in held) or EVERYWHERE


OfCell = TypeVar("OfCell")


def of_condition(values: Mapping[str, OfCell], by: Sequence[str], levels: Condition, where: str) -> OfCell:
    """What a law's table has for the levels of a trial. `ConfigError`: nothing."""
    cell = cell_of(by, levels)
    if cell not in values:
        lacking = [name for name in by if name not in dict(levels)]
        such = "one of a practice" if INSTRUCTION_FACTOR in lacking else "a catch trial"
        why = f": so is called a trial without one {' or '.join(lacking)}, such as {such}" if lacking else ""
        raise ConfigError(f"{where} has no value for {cell!r}{why}; it has {', '.join(values)}")
    return values[cell]
