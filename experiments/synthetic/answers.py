"""Who answers a design's questions when nobody sits there: people who differ, each by the law of each question. Pure.

Every answer has a random stream of its own, so it does not depend on what was answered before, and a trial that is
presented again is answered as it was.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig, Setup
from experiments.design.config import DesignConfig
from experiments.design.language import EMPTY, INTERVAL_NAMES, NO, YES, Level, NumberScale, QuestionConfig, shown_level
from experiments.design.plan import Condition, Plan, Trial
from experiments.design.stimuli import stimulus
from experiments.design.streams import Stream
from experiments.synthetic.diffusion import Diffusion, person
from experiments.synthetic.laws import (
    AppealLaw,
    DiffusionLaw,
    LogNormalTimes,
    PowerLaw,
    PsychometricLaw,
    RatesLaw,
    RatingsLaw,
    SharesLaw,
    SyntheticAnswers,
    TableLaw,
    WordsLaw,
    WorthLaw,
    cell_of,
    check_laws,
    of_condition,
)
from experiments.synthetic.model_based import NEUTRAL, own_diffusion
from experiments.synthetic.percept import Percept, evidence, percept_of
from experiments.synthetic.preference import felt_ratings
from experiments.tasks.questions import AnswerValue, on_scale, right_answer

_NORMAL = NormalDist()
EXPOSURE_SIGMA = 0.3
"""Spread of how long people ask for a stimulus (log-normal); assumed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenAnswer:
    """An answer, and how long it took."""

    value: AnswerValue
    response_time_s: float

    @property
    def response(self) -> str:
        """The answer that was chosen."""
        return str(self.value)


class SyntheticParticipant:
    """A person drawn once, by the seed of the plan, who answers every question of a design by its law.

    `ConfigError`: laws that do not cover the plan, a table without this person, or numbers that make nobody.
    """

    def __init__(self, design: DesignConfig, laws: SyntheticAnswers, plan: Plan, gun: GunConfig) -> None:
        check_laws(design, laws, [plan])
        self._design, self._laws, self._plan, self._gun = design, laws, plan, gun
        self._who = (plan.experiment, plan.participant_id)
        self._own = {name: Stream(plan.seed, "person", *self._who, name).normal() for name in design.questions}
        self._leaning = {name: Stream(plan.seed, "bias", *self._who, name).normal() for name in design.questions}
        self._diffusions = {
            name: self._decisions(name, law) for name, law in laws.questions.items() if isinstance(law, DiffusionLaw)
        }
        self._given = {name: given for name in design.questions if (given := self._beforehand(name)) is not None}

    def rate(self, trial: Trial, question: str, chosen: Condition = ()) -> float | None:
        """The rating, number or rank that a question gets."""
        if self._design.questions[question].kind == "ranking":
            block = [one for one in self._plan.trials if (one.session, one.set) == (trial.session, trial.set)]
            return float(self.rank(question, block)[block.index(trial)])
        value = self.answer(trial, question, chosen).value
        return float(value) if isinstance(value, int | float) else None

    def describe(self, trial: Trial, question: str) -> str:
        """The words that a question gets."""
        return self.answer(trial, question).response

    def exposure_s(self, trial: Trial) -> float:
        """How long the participant asks for a train before saying next."""
        draws = Stream(self._plan.seed, "exposure", *self._who, str(trial.session), str(trial.trial))
        return self._laws.exposure_s * math.exp(EXPOSURE_SIGMA * draws.normal() - EXPOSURE_SIGMA**2 / 2)

    def answer(self, trial: Trial, name: str, chosen: Condition = ()) -> GivenAnswer:
        """The answer to a question about a trial, and its time in whole milliseconds, as a response box gives it.

        `chosen` are the levels at which a procedure had it felt.
        """
        draws = Stream(self._plan.seed, "answer", *self._who, name, str(trial.session), str(trial.trial))
        if name in self._diffusions:
            from experiments.synthetic.decision import decide  # noqa: PLC0415 - slow, and not for a design's check

            decision = decide(self._decision(name, trial.with_chosen(chosen)), draws)
            way = "forward" if decision.upper else "backward"
            return GivenAnswer(value=way, response_time_s=_as_boxed(decision.time_s))
        value = self._given[name][trial] if name in self._given else self._value(name, trial.with_chosen(chosen), draws)
        return GivenAnswer(value=value, response_time_s=_time_s(self._laws.times, draws))

    def rank(self, name: str, trials: Sequence[Trial]) -> tuple[int, ...]:
        """The rank of each trial of a block, from 1: drawn one after another, each with its worth among those left."""
        law = self._laws.questions[name]
        if not isinstance(law, WorthLaw):
            raise ConfigError(f"questions.{name}.law = {law.law!r}: a ranking has the law worth")
        draws = Stream(self._plan.seed, "ranking", *self._who, name, str(trials[0].session), str(trials[0].set))
        left, ranks = list(range(len(trials))), [0] * len(trials)
        for rank in range(1, len(trials) + 1):
            worths = [self._worth(law, trials[at].level(law.factor), name) for at in left]
            chosen = left[_drawn(worths, draws)]
            ranks[chosen] = rank
            left.remove(chosen)
        return tuple(ranks)

    def _beforehand(self, name: str) -> dict[Trial, AnswerValue] | None:
        """The answers that are settled before the first trial: those of a table, and those of habit; `None` if none."""
        question, law = self._design.questions[name], self._laws.questions[name]
        if isinstance(law, TableLaw):
            try:
                return self._from_table(name, question, law)
            except ValueError as error:
                raise ConfigError(f"questions.{name}: {law.file}: {error}") from error
        if isinstance(law, AppealLaw):
            cells = {trial: "/".join(shown_level(level) for _, level in trial.levels) for trial in self._plan.trials}
            strengths = {
                cell: abs(evidence(self._percept(trial.levels, law), law.percept.own)) for trial, cell in cells.items()
            }
            stream = Stream(self._plan.seed, "ratings", *self._who, name)
            felt = felt_ratings(law.appeal, question.scale, strengths, stream)
            return {trial: felt[cell] for trial, cell in cells.items()}
        if isinstance(law, RatingsLaw) and law.habitual:
            cells = {trial: cell_of(law.by, trial.levels) for trial in self._plan.trials}
            stream = Stream(self._plan.seed, "ratings", *self._who, name)
            drawn = draw_ratings(law, question.scale, [*dict.fromkeys(cells.values())], stream)
            return {trial: drawn[cell] for trial, cell in cells.items()}
        return None

    def _from_table(self, name: str, question: QuestionConfig, law: TableLaw) -> dict[Trial, AnswerValue]:
        """The table's number of a cell, or so many of its trials right, at random ones."""
        scored, found = question.correct is not None, dict[Trial, AnswerValue]()
        for cell in dict.fromkeys(cell_of(law.by, trial.levels) for trial in self._plan.trials):
            trials = [trial for trial in self._plan.trials if cell_of(law.by, trial.levels) == cell]
            text = table_cell(law, name, self._plan.participant_id, cell, scored=scored)
            if not scored:
                where = f"participant {self._who[1]}, {cell}, {name}"
                if not text and not question.may_be_skipped:
                    raise ValueError(f"{where} is empty, but the question may not be skipped (may_be_skipped)")
                found |= dict.fromkeys(trials, _number_in(text, question.scale, where))
                continue
            correct = _count_in(text, len(trials), f"participant {self._who[1]}, {cell}, correct")
            marks = [True] * correct + [False] * (len(trials) - correct)
            stream = Stream(self._plan.seed, "correct", *self._who, name, cell)
            for trial, mark in zip(trials, stream.shuffled(marks), strict=True):
                found[trial] = self._right_or_wrong(question, trial, stream, right=mark)
        return found

    def _right_or_wrong(self, question: QuestionConfig, trial: Trial, draws: Stream, *, right: bool) -> str:
        """The right answer or one of the others; where none is right, any."""
        known, answers = right_answer(self._design, question, trial), question.named_answers
        if right and known is not None:
            return known
        others = [answer for answer in answers if answer != known]
        return others[draws.below(len(others))]

    def _decisions(self, name: str, law: DiffusionLaw) -> dict[Condition, Diffusion]:
        """This person's decision in each cell; where levels are chosen, at the highest, and at others when felt."""
        last = self._design.last_choice
        cells = {(own := trial.with_chosen(last)).levels: own for trial in self._plan.trials if not trial.catch}
        try:
            return {levels: self._made(law, trial) for levels, trial in cells.items()}
        except ValueError as error:
            raise ConfigError(f"questions.{name}: the numbers make nobody: {error}") from error

    def _decision(self, name: str, trial: Trial) -> Diffusion:
        """This person's decision on what is felt in a trial."""
        known, law = self._diffusions[name], self._laws.questions[name]
        if trial.levels not in known and isinstance(law, DiffusionLaw):
            known[trial.levels] = self._made(law, trial)
        return known[trial.levels]

    def _made(self, law: DiffusionLaw, trial: Trial) -> Diffusion:
        someone = person(law.own.people, Stream(self._plan.seed, "person", *self._who))
        percept = self._percept(trial.levels, law)
        return own_diffusion(law.own, someone, percept, trial.direction, trial.instruction or NEUTRAL)

    def _percept(self, levels: Condition, law: DiffusionLaw | AppealLaw) -> Percept:
        """What the shot of a cell gives to feel."""
        return percept_of(stimulus(self._design, self._gun, levels).parameters, law.percept.leak_s)

    def _value(self, name: str, trial: Trial, draws: Stream) -> AnswerValue:
        question, law = self._design.questions[name], self._laws.questions[name]
        match law:
            case RatesLaw() | PsychometricLaw():
                return self._scored(name, question, law, trial, draws)
            case SharesLaw():
                shares = of_condition(law.share, law.by, trial.levels, f"questions.{name}.share")
                return question.named_answers[_drawn([shares[one] for one in question.named_answers], draws)]
            case RatingsLaw():
                mean = of_condition(law.mean, law.by, trial.levels, f"questions.{name}.mean")
                return on_scale(mean + law.person_sd * self._own[name] + law.noise_sd * draws.normal(), question.scale)
            case PowerLaw():
                spread = law.person_sd * self._own[name] + law.noise_sd * draws.normal()
                felt = 0.0 if trial.catch else law.scale * _number(trial, law.factor) ** law.exponent
                return on_scale(float(f"{felt * math.exp(spread):.3g}"), question.scale)
            case WorthLaw():
                worths = [self._worth(law, level, name) for level in trial.intervals]
                tie = law.tie * math.sqrt(math.prod(worths))
                return _by_place(question.named_answers)[_drawn([*worths, *([tie] if tie else [])], draws)]
            case WordsLaw():
                return law.texts[draws.below(len(law.texts))]
            case _:
                raise ConfigError(f"questions.{name}.law = {law.law!r} has no answer to this trial")

    def _scored(
        self, name: str, question: QuestionConfig, law: RatesLaw | PsychometricLaw, trial: Trial, draws: Stream
    ) -> str:
        """The right answer at its rate, else one of the others; where none is right, any."""
        right, answers = right_answer(self._design, question, trial), question.named_answers
        if right is None:
            return answers[draws.below(len(answers))]
        share = self._rate(name, law, trial, right) if isinstance(law, RatesLaw) else self._felt(name, law, trial)
        return self._right_or_wrong(question, trial, draws, right=draws.uniform() < share)

    def _rate(self, name: str, law: RatesLaw, trial: Trial, right: str) -> float:
        """How often the right answer is given by this person."""
        rate = of_condition(law.share, law.by, trial.levels, f"questions.{name}.share")
        probit = law.spread * _NORMAL.inv_cdf(rate) + law.ability_sd * self._own[name]
        if law.bias is not None:
            leaning = law.bias.mean + law.bias.sd * self._leaning[name]
            probit += leaning if right == law.bias.answer else -leaning
        return _NORMAL.cdf(probit)

    def _felt(self, name: str, law: PsychometricLaw, trial: Trial) -> float:
        """How often the right answer is given."""
        question = self._design.questions[name]
        if trial.catch:
            return 1.0 - law.guess
        level, threshold = _number(trial, law.factor), law.threshold * math.exp(law.log_threshold_sd * self._own[name])
        if question.correct == "larger":
            others = [one for one in trial.intervals if isinstance(one, float) and one != level] or [level]
            return law.lapse / 2 + (1 - law.lapse) * _NORMAL.cdf(abs(_log_ratio(level, others[0])) / law.spread)
        guess = law.guess if question.named_answers == (YES, NO) else 1.0 / len(question.named_answers)
        return guess + max(0.0, 1.0 - guess - law.lapse) * _NORMAL.cdf(_log_ratio(level, threshold) / law.spread)

    def _worth(self, law: WorthLaw, level: Level | None, name: str) -> float:
        shown = EMPTY if level is None else shown_level(level)
        if shown not in law.worth:
            raise ConfigError(f"questions.{name}.worth has no value for {shown}; give one for each level")
        own = Stream(self._plan.seed, "worth", *self._who, name, shown).normal()
        return law.worth[shown] * math.exp(law.log_worth_sd * own)


def synthetic_participant_of(setup: Setup[DesignConfig], plan: Plan) -> SyntheticParticipant:
    """The synthetic participant that a setup asks for, the same in data mode and in visual mode.

    `ConfigError` if there is none, if a table does not fit, or if the numbers make nobody.
    """
    if not isinstance(setup.laws, SyntheticAnswers):
        raise ConfigError(f"{setup.source}: synthetic is missing; it names the file that says how people answer")
    try:
        return SyntheticParticipant(setup.config, setup.laws, plan, setup.gun)
    except ConfigError as error:
        raise ConfigError(f"{setup.source.parent / (setup.config.synthetic or '')}: {error}") from error


def _log_ratio(a: float, b: float) -> float:
    """The logarithm of a / b for numbers from 0; 0 if they are equal.

    >>> _log_ratio(0.0, 2.0), _log_ratio(0.0, 0.0)
    (-inf, 0.0)
    """
    if a == b:
        return 0.0
    return math.log(a / b) if a and b else math.copysign(math.inf, a - b)


def draw_ratings(law: RatingsLaw, scale: NumberScale, cells: Sequence[str], stream: Stream) -> dict[str, float]:
    """One person's ratings: mean + person + noise, kept to the scale and its grain; then the habits.

    With the share `same_share` the two cells of `same` get the first one's rating; the cell named `lowest` is kept
    at least one grain below all others (all that the scale's lower end leaves).
    """
    person = law.person_sd * stream.normal()
    noise = {cell: law.noise_sd * stream.normal() for cell in sorted(cells)}
    ratings = {cell: on_scale(law.mean[cell] + person + noise[cell], scale) for cell in cells}
    if law.same and set(law.same) <= set(cells) and stream.uniform() < law.same_share:
        ratings[law.same[1]] = ratings[law.same[0]]
    others = min((rating for cell, rating in ratings.items() if cell != law.lowest), default=scale.maximum)
    if law.lowest in ratings:
        ratings[law.lowest] = min(ratings[law.lowest], on_scale(others - scale.grain, scale))
    return ratings


def table_cell(law: TableLaw, question: str, participant: str, cell: str, *, scored: bool) -> str:
    """What the table has for a participant and cell. `ValueError` unless there is exactly one line."""
    mine = (row for row in law.rows if row["participant_id"] == participant)
    rows = [row for row in mine if "/".join(row[name] for name in law.by) == cell]
    if len(rows) != 1:
        raise ValueError(f"{len(rows)} rows for participant {participant}, {cell}; there must be one")
    return rows[0]["correct" if scored else question]


def _count_in(text: str, most: int, where: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 6):
        raise ValueError(f"{where} is {text!r}; not a whole number")
    if int(text) > most:
        raise ValueError(f"{where} is {text}; the plan has {most} such trials, so it must be 0 to {most}")
    return int(text)


def _number_in(text: str, scale: NumberScale, where: str) -> float | None:
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not scale.minimum <= value <= scale.maximum:
        raise ValueError(
            f"{where} is {text!r}; it must be a number from {scale.minimum:g} to {scale.maximum:g}, or "
            "empty for no answer"
        )
    return value


def _drawn(weights: Sequence[float], draws: Stream) -> int:
    """A place with a probability in proportion to its weight."""
    left = draws.uniform() * math.fsum(weights)
    for place, weight in enumerate(weights):
        left -= weight
        if left < 0:
            return place
    return max(place for place, weight in enumerate(weights) if weight > 0)


def _by_place(answers: tuple[str, ...]) -> tuple[str, ...]:
    """The answers in the order of the intervals that they choose, ties behind: by name where they say the interval.

    >>> _by_place(("second", "first")), _by_place(("this", "that", "neither"))
    (('first', 'second'), ('this', 'that', 'neither'))
    """
    named = INTERVAL_NAMES[:2]
    return (*named, *(one for one in answers if one not in named)) if {*named} <= {*answers} else answers


def _number(trial: Trial, factor: str) -> float:
    level = trial.level(factor)
    if not isinstance(level, float) or level < 0:
        raise ConfigError(f"{factor} = {level!r}: this law needs a number from 0")
    return level


def _time_s(law: LogNormalTimes, draws: Stream) -> float:
    """A shifted log-normal time."""
    return _as_boxed(law.shift_s + law.median_s * math.exp(law.sigma * draws.normal()))


def _as_boxed(time_s: float) -> float:
    """A time in whole milliseconds as a response box gives it, at least one."""
    return max(round(time_s, 3), 0.001)
