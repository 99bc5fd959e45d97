"""Who answers a design's questions when nobody sits there: a law for each question, and people who differ. Pure.

Every answer has a random stream of its own, so it does not depend on what was answered before, and a trial that is
presented again is answered as it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Annotated, Literal

from pydantic import Field

from experiments.config.door import ConfigError, InnerShare, Model, PositiveSeconds, Seconds, Share, Spread, Text
from experiments.design.config import DesignConfig
from experiments.design.language import EMPTY, NO, YES, ColumnName, Level, QuestionConfig, shown_level
from experiments.design.plan import Condition, Plan, Trial
from experiments.design.streams import Stream
from experiments.tasks.questions import AnswerValue, on_scale, right_answer

_NORMAL = NormalDist()
EXPOSURE_SIGMA = 0.3
"""Spread of how long people ask for a stimulus (log-normal); assumed."""
Positive = Annotated[float, Field(gt=0, le=1e9)]


class LogNormalTimes(Model):
    """A response time: shift + median exp(sigma z), z standard normal."""

    shift_s: Seconds = 0.35
    median_s: PositiveSeconds = 0.75
    sigma: Spread = 0.45


class RatesLaw(Model):
    """Right answers at a rate by the levels of the factors `by`, as `share`'s keys name them, joined by `/`.

    Probit of a person's rate: S z(share) + ability, S = sqrt(1 + ability_sd^2), so `share` is the mean over people.
    """

    law: Literal["rates"]
    by: tuple[ColumnName, ...] = ()
    share: dict[str, InnerShare]
    ability_sd: Spread = 0.0


class PsychometricLaw(Model):
    """A right answer, or yes, with g + (1 - g - lapse) F(ln(x / threshold) / spread), F the standard normal.

    x is the level of `factor`. g is chance for a scored choice, `guess` for yes-no. For a question about the larger of
    two the threshold is the other interval's level: the larger is chosen with lapse / 2 + (1 - lapse) F(...).
    """

    law: Literal["psychometric"]
    factor: ColumnName
    threshold: Positive
    spread: Positive
    guess: Share = 0.05
    lapse: Share = 0.02
    log_threshold_sd: Spread = 0.0


class RatingsLaw(Model):
    """Means by the levels of the factors `by`, a person's own leaning, and noise from rating to rating."""

    law: Literal["ratings"]
    by: tuple[ColumnName, ...] = ()
    mean: dict[str, Annotated[float, Field(ge=-1e6, le=1e6)]]
    person_sd: Spread = 0.0
    noise_sd: Spread = 0.0


class PowerLaw(Model):
    """Stevens: scale x^exponent, times log-normal factors of the person (modulus) and of the answer."""

    law: Literal["power"]
    factor: ColumnName
    exponent: Annotated[float, Field(ge=-10, le=10)]
    scale: Positive = 1.0
    person_sd: Spread = 0.0
    noise_sd: Spread = 0.0


class WorthLaw(Model):
    """Bradley and Terry: the first of a pair is chosen with w1 / (w1 + w2); ranks are drawn one after another."""

    law: Literal["worth"]
    factor: ColumnName
    worth: dict[str, Positive]
    log_worth_sd: Spread = 0.0


class WordsLaw(Model):
    """One of some texts, at random."""

    law: Literal["words"]
    texts: Annotated[tuple[Text, ...], Field(min_length=1)]


Law = Annotated[RatesLaw | PsychometricLaw | RatingsLaw | PowerLaw | WorthLaw | WordsLaw, Field(discriminator="law")]


class SyntheticAnswers(Model):
    """A file of `configs/synthetic/`: the law of each question, and how fast people answer."""

    questions: dict[ColumnName, Law]
    times: LogNormalTimes = LogNormalTimes()
    exposure_s: PositiveSeconds = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenAnswer:
    """An answer, and how long it took."""

    value: AnswerValue
    response_time_s: float

    @property
    def response(self) -> str:
        """The answer that was chosen."""
        return str(self.value)


def check_laws(design: DesignConfig, laws: SyntheticAnswers) -> None:
    """`ConfigError`: a question without a law, or a law that does not cover it."""
    for name, question in design.questions.items():
        if name not in laws.questions:
            raise ConfigError(f"questions.{name} is missing; each question of {design.design} needs a law")
        _check_law(design, name, question, laws.questions[name])


_LAWS_OF: Mapping[str, tuple[str, ...]] = {
    "choice": ("rates", "psychometric", "worth"),
    "yes-no": ("rates", "psychometric"),
    "rating": ("ratings",),
    "number": ("power", "ratings"),
    "ranking": ("worth",),
    "text": ("words",),
}


def _check_law(design: DesignConfig, name: str, question: QuestionConfig, law: Law) -> None:
    known, where = _LAWS_OF[question.kind], f"questions.{name}"
    if law.law not in known:
        raise ConfigError(f"{where}.law = {law.law!r}: a question of kind {question.kind!r} has {', '.join(known)}")
    if law.law in {"rates", "psychometric"} and question.correct is None:
        raise ConfigError(f"{where}.law = {law.law!r}: nothing is right for {name}; give the question `correct`")
    names = law.by if isinstance(law, RatesLaw | RatingsLaw) else () if isinstance(law, WordsLaw) else (law.factor,)
    for factor in names:
        if factor not in design.factors:
            raise ConfigError(f"{where} names {factor!r}, which is no factor; they are {', '.join(design.factors)}")
    if isinstance(law, WorthLaw):
        missing = [one for one in map(shown_level, design.factors[law.factor].all_levels) if one not in law.worth]
        if missing:
            raise ConfigError(f"{where}.worth has no value for {', '.join(missing)}; give one for each level")


class DesignParticipant:
    """A person drawn once, by the seed of the plan, who answers every question of a design by its law."""

    def __init__(self, design: DesignConfig, laws: SyntheticAnswers, plan: Plan) -> None:
        check_laws(design, laws)
        self._design, self._laws, self._seed = design, laws, plan.seed
        self._who = (plan.experiment, plan.participant_id)
        self._trials = plan.trials
        self._own = {name: Stream(plan.seed, "person", *self._who, name).normal() for name in design.questions}

    def rate(self, trial: Trial, question: str) -> float | None:
        """The rating, number or rank that a question gets."""
        if self._design.questions[question].kind == "ranking":
            block = [one for one in self._trials if (one.session, one.set) == (trial.session, trial.set)]
            return float(self.rank(question, block)[block.index(trial)])
        value = self.answer(trial, question).value
        return float(value) if isinstance(value, int | float) else None

    def describe(self, trial: Trial, question: str) -> str:
        """The words that a question gets."""
        return self.answer(trial, question).response

    def exposure_s(self, trial: Trial) -> float:
        """How long the participant asks for a train before saying next."""
        draws = Stream(self._seed, "exposure", *self._who, str(trial.session), str(trial.trial))
        return self._laws.exposure_s * math.exp(EXPOSURE_SIGMA * draws.normal() - EXPOSURE_SIGMA**2 / 2)

    def answer(self, trial: Trial, name: str) -> GivenAnswer:
        """The answer to a question about a trial. `ConfigError`: the law has no value for the trial's levels."""
        draws = Stream(self._seed, "answer", *self._who, name, str(trial.session), str(trial.trial))
        value = self._value(name, trial, draws)
        times = self._laws.times
        time_s = times.shift_s + times.median_s * math.exp(times.sigma * draws.normal())
        return GivenAnswer(value=value, response_time_s=max(round(time_s, 3), 0.001))

    def rank(self, name: str, trials: Sequence[Trial]) -> tuple[int, ...]:
        """The rank of each trial of a block, from 1: drawn one after another, each with its worth among those left."""
        law = self._laws.questions[name]
        if not isinstance(law, WorthLaw):
            raise ConfigError(f"questions.{name}.law = {law.law!r}: a ranking has the law worth")
        draws = Stream(self._seed, "ranking", *self._who, name, str(trials[0].session), str(trials[0].set))
        left, ranks = list(range(len(trials))), [0] * len(trials)
        for rank in range(1, len(trials) + 1):
            worths = [self._worth(law, trials[at].level(law.factor), name) for at in left]
            chosen = left[_drawn(worths, draws)]
            ranks[chosen] = rank
            left.remove(chosen)
        return tuple(ranks)

    def _value(self, name: str, trial: Trial, draws: Stream) -> AnswerValue:
        question, law = self._design.questions[name], self._laws.questions[name]
        match law:
            case RatesLaw() | PsychometricLaw():
                return self._chosen(name, question, law, trial, draws)
            case RatingsLaw():
                mean = _by_condition(law.mean, law.by, trial.levels, f"questions.{name}.mean")
                return on_scale(mean + law.person_sd * self._own[name] + law.noise_sd * draws.normal(), question.scale)
            case PowerLaw():
                spread = law.person_sd * self._own[name] + law.noise_sd * draws.normal()
                number = law.scale * _number(trial, law.factor) ** law.exponent * math.exp(spread)
                return on_scale(float(f"{number:.3g}"), question.scale)
            case WorthLaw():
                worths = [self._worth(law, level, name) for level in trial.intervals]
                return question.named_answers[_drawn(worths, draws)]
            case WordsLaw():
                return law.texts[draws.below(len(law.texts))]

    def _chosen(
        self, name: str, question: QuestionConfig, law: RatesLaw | PsychometricLaw, trial: Trial, draws: Stream
    ) -> str:
        """The right answer at its rate, else one of the others; where none is right, any."""
        right, answers = right_answer(self._design, question, trial), question.named_answers
        if right is None:
            return answers[draws.below(len(answers))]
        if isinstance(law, RatesLaw):
            rate = _by_condition(law.share, law.by, trial.levels, f"questions.{name}.share")
            probit = math.hypot(1.0, law.ability_sd) * _NORMAL.inv_cdf(rate) + law.ability_sd * self._own[name]
            share = _NORMAL.cdf(probit)
        else:
            share = self._felt(name, question, law, trial)
        if draws.uniform() < share:
            return right
        others = [answer for answer in answers if answer != right]
        return others[draws.below(len(others))]

    def _felt(self, name: str, question: QuestionConfig, law: PsychometricLaw, trial: Trial) -> float:
        """How often the right answer is given."""
        if trial.catch:
            return 1.0 - law.guess
        level, threshold = _number(trial, law.factor), law.threshold * math.exp(law.log_threshold_sd * self._own[name])
        if question.correct == "larger":
            others = [one for one in trial.intervals if isinstance(one, float) and one != level] or [level]
            return law.lapse / 2 + (1 - law.lapse) * _NORMAL.cdf(abs(math.log(level / others[0])) / law.spread)
        guess = law.guess if question.named_answers == (YES, NO) else 1.0 / len(question.named_answers)
        return guess + max(0.0, 1.0 - guess - law.lapse) * _NORMAL.cdf(math.log(level / threshold) / law.spread)

    def _worth(self, law: WorthLaw, level: Level | None, name: str) -> float:
        shown = EMPTY if level is None else shown_level(level)
        if shown not in law.worth:
            raise ConfigError(f"questions.{name}.worth has no value for {shown}; give one for each level")
        own = Stream(self._seed, "worth", *self._who, name, shown).normal()
        return law.worth[shown] * math.exp(law.log_worth_sd * own)


def _drawn(weights: Sequence[float], draws: Stream) -> int:
    """A place with a probability in proportion to its weight."""
    left = draws.uniform() * sum(weights)
    for place, weight in enumerate(weights):
        left -= weight
        if left < 0:
            return place
    return len(weights) - 1


def _by_condition(values: Mapping[str, float], by: Sequence[str], levels: Condition, where: str) -> float:
    held = dict(levels)
    key = "/".join(shown_level(held[name]) for name in by if name in held) or "all"
    if key not in values:
        raise ConfigError(f"{where} has no value for {key!r}; it has {', '.join(values)}")
    return values[key]


def _number(trial: Trial, factor: str) -> float:
    level = trial.level(factor)
    if not isinstance(level, float) or level <= 0:
        raise ConfigError(f"{factor} = {level!r}: this law needs a number above 0")
    return level
