"""What the file of a design may say: factors, order, trial and questions. `docs/design-language.md` explains it.

What one table can tell by itself is checked where it stands; what two must agree on, in `DesignConfig`. What only the
gun can tell (its methods, its limits) is checked when both are loaded.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal, Self, get_args

from pydantic import AfterValidator, Field, model_validator

from device.words import Direction
from experiments.config.door import ConsoleConfig, Model, Text, leaves, once

MAX_TRIALS = 10_000
"""More trials than this are refused."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,31}$")]
"""A factor's or question's name: it becomes a column."""
Level = str | float
Levels = tuple[Level, ...]
Duration = Annotated[float, Field(gt=0, le=86_400)]
Pause = Annotated[float, Field(ge=0, le=86_400)]
ShotCount = Annotated[int, Field(ge=1, le=10_000)]
ShortText = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(lambda text: _printable(text))]
LongText = Annotated[Text, AfterValidator(lambda text: _printable(text))]

METHOD, DIRECTION, INSTRUCTION, TRAIN_INTERVAL = "method", "direction", "instruction", "repeat_every_s"


def _printable(text: str) -> str:
    """The text; `ValueError` for control characters, marks that turn the direction of writing, and blanks alone."""
    for letter in text:
        if unicodedata.category(letter) in {"Cc", "Cf", "Cs", "Zl", "Zp"}:
            raise ValueError(f"holds the character U+{ord(letter):04X}, which is not printed; remove it")
    if not text.strip():
        raise ValueError("is blank; give it words or leave the key out")
    return text


def shown_level(level: Level) -> str:
    """A level as it stands in tables and messages.

    >>> shown_level(12.0), shown_level("off")
    ('12', 'off')
    """
    return level if isinstance(level, str) else f"{level:.15g}"


def _levels(levels: Levels) -> Levels:
    shown = [shown_level(level) for level in levels]
    once(tuple(shown))
    if len({isinstance(level, str) for level in levels}) > 1:
        raise ValueError(f"{', '.join(shown)} mixes words and numbers; use one kind")
    for level in levels:
        if isinstance(level, str):
            _printable(level)
    return levels


SomeLevels = Annotated[Levels, Field(min_length=1, max_length=100), AfterValidator(_levels)]


class FactorConfig(Model):
    """What varies. `levels` by the level of the factor `within`, if it is nested in one.

    `sets`: what a level set by hand means for the model of the gun; `texts`: what is read out under an instruction.
    """

    levels: SomeLevels | dict[str, SomeLevels]
    within: Name | None = None
    between: bool = False
    labels: dict[str, ShortText] = Field(default_factory=dict)
    texts: dict[str, LongText] = Field(default_factory=dict)
    sets: dict[str, dict[str, float]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _nested_or_not(self) -> Self:
        if isinstance(self.levels, dict) and self.within is None:
            raise ValueError("levels is a table, by the levels of another factor: name that one with `within`")
        if not isinstance(self.levels, dict) and self.within is not None:
            raise ValueError(f"within = {self.within!r} needs levels as a table: one list for each of its levels")
        if self.between and self.within is not None:
            raise ValueError("between = true: what varies between people cannot be nested; remove `within`")
        return self

    @model_validator(mode="after")
    def _tables_are_of_levels(self) -> Self:
        known = {shown_level(level) for level in self.all_levels}
        for key, table in {"labels": self.labels, "texts": self.texts, "sets": self.sets}.items():
            for level in table:
                if level not in known:
                    raise ValueError(f"{key} has {level!r}, which is no level; the levels are {', '.join(sorted(known))}")
        return self

    @property
    def all_levels(self) -> Levels:
        """Every level once, in the order of the file."""
        lists = self.levels.values() if isinstance(self.levels, dict) else [self.levels]
        return tuple(dict.fromkeys(level for one in lists for level in one))

    def levels_within(self, outer: Level | None) -> Levels:
        """The levels that there are, in the outer factor's level if it is nested."""
        if isinstance(self.levels, dict):
            return self.levels.get(shown_level("" if outer is None else outer), ())
        return self.levels

    def label(self, level: Level) -> str:
        """What a level is called."""
        return self.labels.get(shown_level(level), shown_level(level))


BlockOrder = Literal["random", "fixed", "latin-square", "williams"]
Balance = Literal["session", "set", "set-exact"]


class OrderConfig(Model):
    """What is blocked into sessions and sets, and how often and in which order everything comes."""

    session: Annotated[tuple[Name, ...], AfterValidator(once)] = ()
    set: Annotated[tuple[Name, ...], AfterValidator(once)] = ()
    sessions: BlockOrder = "random"
    trials: BlockOrder = "random"
    sets: Annotated[int, Field(ge=1, le=MAX_TRIALS)] = 1
    repetitions: Annotated[int, Field(ge=1, le=MAX_TRIALS)] = 1
    balance: Balance = "session"
    longest_run: dict[Name, Annotated[int, Field(ge=1, le=MAX_TRIALS)]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _blocked_once(self) -> Self:
        both = [name for name in self.set if name in self.session]
        if both:
            raise ValueError(f"{', '.join(both)} is constant in a session and so in its sets; name it in `session` only")
        return self


TrialKind = Literal["single", "train", "two-interval", "pair", "abx", "oddity"]
INTERVALS: dict[TrialKind, int] = {"single": 1, "train": 1, "two-interval": 2, "pair": 2, "abx": 3, "oddity": 3}
"""How many intervals a trial of each kind has."""


class TrialConfig(Model):
    """One presentation: a shot, a train until “next”, or several intervals that are compared."""

    kind: TrialKind = "single"
    compare: Name | None = None
    standard: Level | None = None
    gap_s: Annotated[float, Field(gt=0, le=60)] = 1.5
    repeat_every_s: Annotated[float, Field(gt=0, le=3_600)] = 1.0
    least_exposure_s: Annotated[float, Field(ge=0, le=3_600)] = 1.0
    max_shots: ShotCount = 120
    catch: Annotated[int, Field(ge=0, le=MAX_TRIALS)] = 0
    feedback: bool = False

    @property
    def intervals(self) -> int:
        """How many intervals a trial has."""
        return INTERVALS[self.kind]

    @model_validator(mode="after")
    def _says_what_is_compared(self) -> Self:
        several = self.intervals > 1
        if several != (self.compare is not None):
            what = "needs `compare`: the factor that differs between its intervals" if several else "compares nothing"
            raise ValueError(f"kind = {self.kind!r} {what}")
        needs_standard = self.kind in {"two-interval", "abx", "oddity"}
        if needs_standard != (self.standard is not None):
            what = "needs `standard`: the level that the others are compared with" if needs_standard else "has no standard"
            raise ValueError(f"kind = {self.kind!r} {what}")
        if self.catch and several:
            raise ValueError(f"catch = {self.catch}: catch trials are of one interval; kind {self.kind!r} has {self.intervals}")
        return self


QuestionKind = Literal["choice", "yes-no", "rating", "number", "ranking", "text"]
YES, NO = "yes", "no"


class QuestionConfig(Model):
    """What is asked. `correct`: the factor whose level is right, or `interval`, `larger` or `stimulus`."""

    kind: QuestionKind
    text: LongText
    when: Literal["trial", "block"] = "trial"
    answers: Annotated[tuple[Name, ...], Field(max_length=26), AfterValidator(once)] = ()
    labels: dict[str, ShortText] = Field(default_factory=dict)
    keys: dict[str, Annotated[str, Field(pattern=r"^[a-z0-9]$|^(left|right|up|down)$")]] = Field(default_factory=dict)
    correct: Name | None = None
    minimum: float | None = None
    maximum: float | None = None
    grain: Annotated[float, Field(ge=1e-6)] | None = None
    minimum_text: ShortText | None = None
    maximum_text: ShortText | None = None
    may_be_skipped: bool = False

    @property
    def named_answers(self) -> tuple[str, ...]:
        """The answers to choose among; none of a question without them."""
        return (YES, NO) if self.kind == "yes-no" else self.answers

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> Self:
        for problem in _question_problems(self):
            raise ValueError(problem)
        return self

    def label(self, answer: str) -> str:
        """What an answer is called to the participant."""
        return self.labels.get(answer, answer)


def _question_problems(question: QuestionConfig) -> Iterator[str]:
    kind, chosen = question.kind, question.kind in {"choice", "yes-no"}
    if kind == "choice" and len(question.answers) < 2:
        yield "answers: a choice is among at least two; name them, or use another kind"
    if kind != "choice" and question.answers:
        yield f"answers: a question of kind {kind!r} has none; remove the key"
    if question.correct is not None and not chosen:
        yield f"correct = {question.correct!r}: only a choice or yes-no can be right; remove the key"
    for key in ("labels", "keys"):
        unknown = [name for name in getattr(question, key) if name not in question.named_answers]
        if unknown:
            yield f"{key} has {', '.join(unknown)}, which is no answer; the answers are {', '.join(question.named_answers)}"
    yield from _doubled("keys", question.keys)
    yield from _doubled("labels", question.labels)
    ends = (question.minimum, question.maximum, question.grain)
    if kind == "rating":
        yield from _scale_problems(*ends)
    elif any(end is not None for end in ends) and kind != "number":
        yield f"minimum, maximum and grain are of a rating or a number, not of kind {kind!r}"
    elif kind == "number" and question.minimum is not None and question.maximum is not None:
        if question.minimum >= question.maximum:
            yield f"minimum {question.minimum:g} and maximum {question.maximum:g}: need minimum < maximum"


def _doubled(key: str, table: Mapping[str, str]) -> Iterator[str]:
    doubled = sorted({value for value in table.values() if list(table.values()).count(value) > 1})
    if doubled:
        yield f"{key}: {', '.join(map(repr, doubled))} stands for more than one answer; give each its own"


def _scale_problems(minimum: float | None, maximum: float | None, grain: float | None) -> Iterator[str]:
    if minimum is None or maximum is None or grain is None:
        yield "a rating needs minimum, maximum and grain (1 for points, such as 0.1 for a continuous scale)"
        return
    if not -1e6 <= minimum < maximum <= 1e6:
        yield f"minimum {minimum:g} and maximum {maximum:g}: need -1e6 <= minimum < maximum <= 1e6"
        return
    steps = (maximum - minimum) / grain
    if abs(steps - round(steps)) > 1e-9 * steps:
        yield f"grain {grain:g} does not divide the scale from {minimum:g} to {maximum:g}; use a part of it, such as 1 or 0.5"


class OpeningConfig(Model):
    """A text for the participant before the first trial, which the experimenter confirms."""

    kind: Literal["instruction", "consent"] = "instruction"
    text: LongText


class PracticeConfig(Model):
    """Trials before the first session, in files of their own, never analysed: so many of each cell of `of`."""

    repetitions: Annotated[int, Field(ge=0, le=100)] = 0
    of: Annotated[tuple[Name, ...], AfterValidator(once)] = ()
    feedback: bool = False


class BreaksConfig(Model):
    """Rests between sets and between sessions."""

    between_sets_s: Pause = 0.0
    between_sessions_s: Pause = 0.0


class FatigueConfig(Model):
    """What a participant is spared: a design beyond it is refused."""

    max_trials_without_break: Annotated[int, Field(ge=1, le=MAX_TRIALS)]
    max_planned_s: Duration


class TimingConfig(Model):
    """How long the parts of a run take, and how long the whole is said to take."""

    hand_over_s: Pause
    stimulus_s: Pause = 0.0
    answer_s: Pause = 0.0
    opening_s: Pause = 0.0
    planned_s: Duration


class DesignConfig(Model):
    """A design: `docs/design-language.md`."""

    design: Annotated[str, Field(pattern=r"^[a-z]{1,32}$")]
    title: ShortText
    gun: Text
    synthetic: Text | None = None
    table: Literal["trials", "ratings"] = "trials"
    below_break_away: bool = False
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] | None = None
    assumed: tuple[Text, ...] = ()
    factors: dict[Name, FactorConfig] = Field(min_length=1, max_length=20)
    order: OrderConfig = OrderConfig()
    trial: TrialConfig = TrialConfig()
    questions: dict[Name, QuestionConfig] = Field(min_length=1, max_length=20)
    opening: tuple[OpeningConfig, ...] = ()
    practice: PracticeConfig = PracticeConfig()
    breaks: BreaksConfig = BreaksConfig()
    fatigue: FatigueConfig
    timing: TimingConfig
    console: ConsoleConfig = ConsoleConfig()

    @property
    def between(self) -> tuple[str, ...]:
        """The factors that vary between participants."""
        return tuple(name for name, factor in self.factors.items() if factor.between)

    @property
    def varying(self) -> tuple[str, ...]:
        """The factors that vary from trial to trial, the compared one included."""
        blocked = {*self.order.session, *self.order.set, *self.between}
        return tuple(name for name in self.factors if name not in blocked)

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for problem in _problems(self):
            raise ValueError(problem)
        return self


def _problems(design: DesignConfig) -> Iterator[str]:
    """What two tables of a design do not agree on, in words."""
    yield from _name_problems(design)
    yield from _factor_problems(design)
    yield from _trial_problems(design)
    for name, question in design.questions.items():
        yield from (f"questions.{name}: {problem}" for problem in _right_answer_problems(design, question))
    unknown = sorted(set(design.assumed) - set(leaves(design)))
    if unknown:
        yield f"assumed names {', '.join(unknown)}, which this design does not have; name existing keys"


_COMMON_COLUMNS = frozenset(
    "participant_id experiment session set trial stimulus attempts flags note onset_utc gun shots exposure_s "
    "earlier_exposure_s status correct".split()
)


def _name_problems(design: DesignConfig) -> Iterator[str]:
    taken = [name for name in (*design.factors, *design.questions) if name in _COMMON_COLUMNS]
    if taken:
        yield f"{', '.join(taken)} is the name of a column that every table has; choose another name"
    both = [name for name in design.questions if name in design.factors]
    if both:
        yield f"{', '.join(both)} names a factor and a question; each is a column, so give them two names"
    places = {
        "order.session": design.order.session,
        "order.set": design.order.set,
        "order.longest_run": tuple(design.order.longest_run),
        "practice.of": design.practice.of,
        "trial.compare": (design.trial.compare,) if design.trial.compare else (),
    }
    for place, names in places.items():
        for name in names:
            if name not in design.factors:
                yield f"{place} names {name!r}, which is no factor; the factors are {', '.join(design.factors)}"


def _factor_problems(design: DesignConfig) -> Iterator[str]:
    if METHOD not in design.factors:
        yield f"factors.{METHOD} is missing: name the rendering method, one level if there is only one"
    for name, factor in design.factors.items():
        yield from (f"factors.{name}: {problem}" for problem in _levels_problems(design, name, factor))
        blocked = name in (*design.order.session, *design.order.set)
        if factor.between and (blocked or name == design.trial.compare):
            yield f"factors.{name}: between = true: it does not vary within a participant; take it out of order and trial"
    instruction = design.factors.get(INSTRUCTION)
    if instruction is not None and INSTRUCTION in design.varying and len(instruction.all_levels) > 1:
        yield f"order.set: instructions are read out before a set; name {INSTRUCTION!r} in order.set, order.session or between"


def _levels_problems(design: DesignConfig, name: str, factor: FactorConfig) -> Iterator[str]:
    words = all(isinstance(level, str) for level in factor.all_levels)
    if name == DIRECTION and not set(factor.all_levels) <= set(get_args(Direction)):
        yield f"levels {', '.join(map(shown_level, factor.all_levels))}: directions are {', '.join(get_args(Direction))}"
    if name in {METHOD, INSTRUCTION} and not words:
        yield "levels are numbers; name them in words"
    if name.rsplit("_", 1)[-1] in _UNITS and words:
        yield f"levels are words, but the name ends with the unit {name.rsplit('_', 1)[-1]}; give numbers"
    if name == INSTRUCTION:
        missing = [level for level in map(shown_level, factor.all_levels) if level not in factor.texts]
        if missing:
            yield f"texts has no words for {', '.join(missing)}; give what is read out"
    elif factor.texts:
        yield "texts are of the factor `instruction`; use labels here"
    if any(not math.isfinite(level) for level in factor.all_levels if isinstance(level, float)):
        yield "levels must be finite"
    if factor.within is not None:
        yield from _nesting_problems(design, factor, factor.within)


_UNITS = frozenset("V s N A ohm H kg m Hz N_m".split())


def _nesting_problems(design: DesignConfig, factor: FactorConfig, within: str) -> Iterator[str]:
    outer = design.factors.get(within)
    if outer is None or outer is factor:
        yield f"within = {within!r} is no other factor; the factors are {', '.join(design.factors)}"
        return
    if outer.within is not None:
        yield f"within = {within!r} is nested itself; one level of nesting is enough"
    have = set(factor.levels) if isinstance(factor.levels, dict) else set()
    asked = {shown_level(level) for level in outer.all_levels}
    if have != asked:
        off = ", ".join(sorted(have ^ asked))
        yield f"levels must have one list for each level of {within}; check {off}"


def _trial_problems(design: DesignConfig) -> Iterator[str]:
    trial, compare = design.trial, design.trial.compare
    if compare is not None and compare in design.factors:
        factor = design.factors[compare]
        if compare not in design.varying:
            yield f"trial.compare = {compare!r} is constant in a block or person; compare one that varies from trial to trial"
        if factor.within is not None:
            yield f"trial.compare = {compare!r} is nested; compare one that is not"
        if trial.kind == "pair" and len(factor.all_levels) < 2:
            yield f"trial.kind = 'pair': {compare} has one level, which makes no pair"
        blank = trial.standard == "none" and trial.kind == "two-interval"
        words = isinstance(factor.all_levels[0], str)
        if trial.standard is not None and not blank and isinstance(trial.standard, str) != words:
            yield f"trial.standard = {trial.standard!r} is not of the kind of {compare}'s levels"
        if trial.standard in factor.all_levels and trial.kind in {"abx", "oddity"}:
            yield f"trial.standard = {shown_level(trial.standard)} is a level of {compare} as well: nothing would differ; take it out"
    if TRAIN_INTERVAL in design.factors and trial.kind != "train":
        yield f"factors.{TRAIN_INTERVAL} is the interval of a train, but trial.kind is {trial.kind!r}"


def _right_answer_problems(design: DesignConfig, question: QuestionConfig) -> Iterator[str]:
    intervals, answers = design.trial.intervals, question.named_answers
    places = tuple(INTERVAL_NAMES[:intervals])
    match question.correct:
        case None:
            return
        case "interval" | "larger" if intervals == 1:
            yield f"correct = {question.correct!r}: a trial of kind {design.trial.kind!r} has one interval"
        case "larger" if not _numeric(design, design.trial.compare):
            yield f"correct = 'larger': the levels of {design.trial.compare} are no numbers, so none is larger"
        case "interval" | "larger" if design.trial.kind != "abx" and set(answers) != set(places):
            yield f"correct = {question.correct!r}: the answers must be {', '.join(places)}, not {', '.join(answers)}"
        case "interval" if design.trial.kind == "abx" and set(answers) != {"a", "b"}:
            yield f"correct = 'interval': the answers of an ABX trial must be a, b, not {', '.join(answers)}"
        case "interval" | "larger":
            return
        case "stimulus":
            if question.kind != "yes-no" or not design.trial.catch:
                yield "correct = 'stimulus' is for yes-no with catch trials; set trial.catch, or remove the key"
        case name if name not in design.factors:
            yield f"correct = {name!r} is no factor; name a factor, or interval, larger or stimulus"
        case name:
            levels = {shown_level(level) for level in design.factors[name].all_levels}
            if not levels <= set(answers):
                yield f"correct = {name!r}: its levels {', '.join(sorted(levels))} are not all among the answers {', '.join(answers)}"
    if question.when == "block" and question.correct is not None:
        yield "when = 'block': a question about remembered trials is not scored; remove `correct`"


INTERVAL_NAMES = ("first", "second", "third")
"""What the intervals of a trial are called."""


def _numeric(design: DesignConfig, name: str | None) -> bool:
    factor = design.factors.get(name or "")
    return factor is not None and not isinstance(factor.all_levels[0], str)


def shown_levels(levels: Sequence[Level]) -> str:
    """Levels as they stand in messages."""
    return ", ".join(map(shown_level, levels))
