"""The tables of a design: factors, order, trial, questions. `docs/design-language.md` explains them.

What a table can tell by itself is checked here; what two must agree on, where the whole design is (`config`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from experiments.config.door import Model, once
from experiments.config.findings import COLUMN_NAME, OWN_KEY
from experiments.config.lines import LineText, PageText, name_fault

MAX_TRIALS = 10_000
"""More trials than this are refused."""


ColumnName = Annotated[str, Field(pattern=COLUMN_NAME)]
"""A factor's or question's name: it becomes a column."""
Level = str | float
Levels = tuple[Level, ...]
DurationSeconds = Annotated[float, Field(gt=0, le=86_400)]
PauseSeconds = Annotated[float, Field(ge=0, le=86_400)]
ShotCount = Annotated[int, Field(ge=1, le=10_000)]
Shape = Literal["normal", "logistic", "gumbel", "reversed-gumbel"]
"""Of a psychometric function."""

METHOD_FACTOR, DIRECTION_FACTOR, INSTRUCTION_FACTOR, TRAIN_INTERVAL = (
    "method",
    "direction",
    "instruction",
    "repeat_every_s",
)

DRIVEN = ("voltage_V", "pulse_s")
"""What the command of a shot carries."""


def shown_level(level: Level) -> str:
    """A level as it stands in tables and messages.

    >>> shown_level(12.0), shown_level("off")
    ('12', 'off')
    """
    return level if isinstance(level, str) else f"{level:.15g}"


def _levels(levels: Levels) -> Levels:
    shown = tuple(shown_level(level) for level in levels)
    once(shown)
    if len({isinstance(level, str) for level in levels}) > 1:
        raise ValueError(f"{', '.join(shown)} mixes words and numbers; use one kind")
    for level in levels:
        if isinstance(level, str) and (fault := name_fault(level)):
            raise ValueError(f"a level {fault}")
    return levels


MAX_LEVELS = 100
SomeLevels = Annotated[Levels, Field(min_length=1, max_length=MAX_LEVELS), AfterValidator(_levels)]


class EvenLevels(Model):
    """Levels at even distances, from the minimum to the maximum."""

    minimum: float
    maximum: float
    grain: Annotated[float, Field(gt=0)]

    @model_validator(mode="after")
    def _grain_divides(self) -> Self:
        if self.minimum >= self.maximum:
            raise ValueError(f"minimum = {self.minimum:g} is not below maximum = {self.maximum:g}; change one of them")
        steps = (self.maximum - self.minimum) / self.grain
        if not 1 - _OFF <= steps < MAX_LEVELS - 0.5:
            made = f"{math.floor(steps + _OFF) + 1:,}" if steps < _COUNTED else "far too many"
            raise ValueError(
                f"minimum {self.minimum:g}, maximum {self.maximum:g} and grain {self.grain:g} make {made} levels; they "
                f"must make 2 to {MAX_LEVELS}"
            )
        if abs(steps - round(steps)) > _OFF * steps:
            near = self.minimum + math.floor(steps) * self.grain
            raise ValueError(
                f"grain {self.grain:g} does not divide {self.minimum:g} to {self.maximum:g}; nearest: maximum = "
                f"{near:g} or {near + self.grain:g}"
            )
        return self

    @property
    def levels(self) -> tuple[float, ...]:
        """The levels, with the decimals that a person would write."""
        count = round((self.maximum - self.minimum) / self.grain) + 1
        return tuple(round(self.minimum + place * self.grain, 12) for place in range(count))


_COUNTED = 1e6
"""So many levels are told in figures."""
_OFF = 1e-9
"""So much a division may be off, as a share."""


def _levels_kind(levels: object) -> str:
    """Which way a factor's levels are written: as a list, at even distances, or by another factor's levels."""
    if not isinstance(levels, dict):
        return "even" if isinstance(levels, EvenLevels) else "list"
    return "nested" if any(isinstance(one, list | tuple) for one in levels.values()) or not levels else "even"


FactorLevels = Annotated[
    Annotated[SomeLevels, Tag("list")]
    | Annotated[EvenLevels, Tag("even")]
    | Annotated[dict[str, SomeLevels], Tag("nested")],
    Discriminator(_levels_kind),
]


class FactorConfig(Model):
    """What varies. `levels` by the level of the factor `within`, if it is nested in one.

    `sets`: what a level set by hand means for the model of the gun; `texts`: what is read out under an instruction.
    """

    levels: FactorLevels
    within: ColumnName | None = None
    between: bool = False
    labels: dict[str, LineText] = Field(default_factory=dict)
    texts: dict[str, PageText] = Field(default_factory=dict)
    sets: dict[str, dict[str, float]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _nested_or_not(self) -> Self:
        if isinstance(self.levels, dict) and self.within is None:
            raise ValueError("levels is a table, by the levels of another factor: name that one with `within`")
        if not isinstance(self.levels, dict) and self.within is not None:
            raise ValueError(f"within = {self.within!r} needs levels as a table: one list for each of its levels")
        if self.between and self.within is not None:
            raise ValueError("between = true: what varies between people cannot be nested; remove `within`")
        if self.between and len(self.all_levels) == 1:
            raise ValueError("between = true with one level: nothing varies between people; remove `between`")
        return self

    @model_validator(mode="after")
    def _names_are_of_levels(self) -> Self:
        known = {shown_level(level) for level in self.all_levels}
        named = {"labels": tuple(self.labels), "texts": tuple(self.texts), "sets": tuple(self.sets)}
        for key, names in named.items():
            for name in names:
                if name not in known:
                    raise ValueError(
                        f"{key} has {name!r}, which is no level; the levels are {', '.join(sorted(known))}"
                    )
        for levels in self._lists:
            for problem in _doubled("labels", [self.label(level) for level in levels], "level"):
                raise ValueError(problem)
        return self

    @property
    def _lists(self) -> list[Levels]:
        """The levels, a list for each level of the factor that this one is nested in."""
        if isinstance(self.levels, EvenLevels):
            return [self.levels.levels]
        return [*self.levels.values()] if isinstance(self.levels, dict) else [self.levels]

    @property
    def all_levels(self) -> Levels:
        """Every level once, in the order of the file."""
        return tuple(dict.fromkeys(level for one in self._lists for level in one))

    def levels_within(self, outer: Level | None) -> Levels:
        """The levels that there are, in the outer factor's level if it is nested."""
        if isinstance(self.levels, dict):
            return self.levels.get(shown_level("" if outer is None else outer), ())
        return self.all_levels

    def label(self, level: Level) -> str:
        """What a level is called."""
        return self.labels.get(shown_level(level), shown_level(level))


BlockOrder = Literal["random", "fixed", "latin-square", "williams"]
BalancedIn = Literal["session", "set", "set-exact"]


class OrderConfig(Model):
    """What is blocked into sessions and sets, and how often and in which order everything comes."""

    session: Annotated[tuple[ColumnName, ...], AfterValidator(once)] = ()
    set: Annotated[tuple[ColumnName, ...], AfterValidator(once)] = ()
    sessions: BlockOrder = "random"
    trials: BlockOrder = "random"
    sets: Annotated[int, Field(ge=1, le=MAX_TRIALS)] = 1
    repetitions: Annotated[int, Field(ge=1, le=MAX_TRIALS)] = 1
    balance: BalancedIn = "session"
    longest_run: dict[ColumnName, Annotated[int, Field(ge=1, le=MAX_TRIALS)]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _blocked_once(self) -> Self:
        both = [name for name in self.set if name in self.session]
        if both:
            raise ValueError(
                f"{', '.join(both)} is constant in a session and so in its sets; name it in `session` only"
            )
        return self

    @model_validator(mode="after")
    def _one_thing_orders(self) -> Self:
        squares = {"latin-square", "williams"}
        if self.sessions in squares and self.trials in squares:
            raise ValueError(
                f"sessions = {self.sessions!r} and trials = {self.trials!r}: a participant has one row of one square; "
                'make one of them "random" or "fixed"'
            )
        if self.longest_run and self.trials != "random":
            raise ValueError(f"longest_run: trials = {self.trials!r} has its own order; remove one of them")
        return self


EMPTY = "none"
"""The standard of a comparison with nothing: that interval has no stimulus."""
INTERVAL_NAMES = ("first", "second", "third")
"""What the intervals of a trial are called."""
StandardInterval = Literal["random", "first", "second"]
"""In which of two intervals the standard is."""
TrialKind = Literal["single", "train", "two-interval", "pair", "abx", "oddity"]
INTERVALS: dict[TrialKind, int] = {"single": 1, "train": 1, "two-interval": 2, "pair": 2, "abx": 3, "oddity": 3}
"""How many intervals a trial of each kind has."""


_OF_A_TRAIN, _OF_SEVERAL = ("repeat_every_s", "least_exposure_s", "max_shots"), ("gap_s",)
_OF_TWO = ("standard_interval",)
_UNUSED: dict[TrialKind, tuple[str, ...]] = {
    "single": (*_OF_A_TRAIN, *_OF_SEVERAL, *_OF_TWO),
    "train": (*_OF_SEVERAL, *_OF_TWO),
    "two-interval": _OF_A_TRAIN,
    "pair": (*_OF_A_TRAIN, *_OF_TWO),
    "abx": (*_OF_A_TRAIN, *_OF_TWO),
    "oddity": (*_OF_A_TRAIN, *_OF_TWO),
}


class TrialConfig(Model):
    """One presentation: a shot, a train until “next”, or several intervals that are compared."""

    kind: TrialKind = "single"
    compare: ColumnName | None = None
    standard: Level | None = None
    standard_interval: StandardInterval = "random"
    gap_s: Annotated[float, Field(gt=0, le=60)] = 1.5
    repeat_every_s: Annotated[float, Field(gt=0, le=3_600)] = 1.0
    least_exposure_s: Annotated[float, Field(ge=0, le=3_600)] = 1.0
    max_shots: ShotCount = 120
    catch: Annotated[int, Field(ge=0, le=MAX_TRIALS)] = 0
    feedback: bool = False
    repeat_undelivered: bool = False

    @property
    def intervals(self) -> int:
        """How many intervals a trial has."""
        return INTERVALS[self.kind]

    @property
    def has_blanks(self) -> bool:
        """Whether there are trials, or intervals, in which nothing is fired."""
        return self.catch > 0 or self.standard == EMPTY

    @model_validator(mode="after")
    def _says_what_is_compared(self) -> Self:
        several = self.intervals > 1
        if several != (self.compare is not None):
            what = "needs `compare`: the factor that differs between its intervals" if several else "compares nothing"
            raise ValueError(f"kind = {self.kind!r} {what}")
        needs_standard = self.kind in {"two-interval", "abx", "oddity"}
        if needs_standard != (self.standard is not None):
            what = (
                "needs `standard`: the level that the others are compared with" if needs_standard else "has no standard"
            )
            raise ValueError(f"kind = {self.kind!r} {what}")
        unused = [key for key in _UNUSED[self.kind] if getattr(self, key) != type(self).model_fields[key].default]
        if unused:
            raise ValueError(f"{', '.join(unused)}: a trial of kind {self.kind!r} has none; remove it")
        longest_s = self.max_shots * self.repeat_every_s
        if self.kind == "train" and self.least_exposure_s > longest_s:
            raise ValueError(
                f"least_exposure_s = {self.least_exposure_s:g} is longer than the longest train, max_shots = "
                f"{self.max_shots} shots every {self.repeat_every_s:g} s ({longest_s:g} s)"
            )
        if self.catch and self.kind != "single":
            raise ValueError(
                f"catch = {self.catch}: a catch trial is a single shot that is left out; kind {self.kind!r} has none"
            )
        return self


MAX_ANSWERS = 9
"""So many answers have a button on the console."""
QuestionKind = Literal["choice", "yes-no", "rating", "number", "ranking", "text"]
YES, NO = "yes", "no"


LARGEST_NUMBER = 1e9
"""No number that is asked for is larger."""


class NumberScale(NamedTuple):
    """The ends of a scale, and the distance of two of its numbers; 0 where any number will do."""

    minimum: float
    maximum: float
    grain: float


class QuestionConfig(Model):
    """What is asked. `correct`: the factor whose level is right, or `interval`, `larger` or `stimulus`."""

    kind: QuestionKind
    text: PageText
    when: Literal["trial", "block"] = "trial"
    answers: Annotated[tuple[ColumnName, ...], Field(max_length=MAX_ANSWERS), AfterValidator(once)] = ()
    labels: dict[str, LineText] = Field(default_factory=dict)
    keys: dict[str, Annotated[str, Field(pattern=OWN_KEY)]] = Field(default_factory=dict)
    correct: ColumnName | None = None
    minimum: float | None = None
    maximum: float | None = None
    grain: Annotated[float, Field(ge=1e-6)] | None = None
    minimum_text: LineText | None = None
    maximum_text: LineText | None = None
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

    @property
    def scale(self) -> NumberScale:
        """What numbers may be answered, and how fine they are kept."""
        low = -LARGEST_NUMBER if self.minimum is None else self.minimum
        high = LARGEST_NUMBER if self.maximum is None else self.maximum
        return NumberScale(minimum=low, maximum=high, grain=self.grain or 0.0)

    def label(self, answer: str) -> str:
        """What an answer is called to the participant."""
        return self.labels.get(answer, answer)


def _question_problems(question: QuestionConfig) -> Iterator[str]:
    kind, chosen = question.kind, question.kind in {"choice", "yes-no"}
    if question.correct is not None and not chosen:
        yield f"correct = {question.correct!r}: only a choice or yes-no can be right; remove the key"
    if kind == "ranking" and question.when != "block":
        yield 'a ranking is of a block\'s trials; say when = "block"'
    if kind == "ranking" and question.minimum_text is None:
        yield 'a ranking needs minimum_text: what rank 1 means, such as "most comfortable"'
    if question.may_be_skipped and chosen:
        yield f"may_be_skipped: a question of kind {kind!r} always has an answer; remove the key"
    yield from _answer_problems(question)
    yield from _number_problems(question)


def _answer_problems(question: QuestionConfig) -> Iterator[str]:
    kind, named = question.kind, question.named_answers
    if kind == "choice" and len(question.answers) < 2:
        yield "answers: a choice is among at least two; name them, or use another kind"
    if kind != "choice" and question.answers:
        yield f"answers: a question of kind {kind!r} has none; remove the key"
    known = f"the answers are {', '.join(named)}" if named else f"a question of kind {kind!r} has none; remove the key"
    for key, table in {"labels": question.labels, "keys": question.keys}.items():
        unknown = [name for name in table if name not in named]
        if unknown:
            yield f"{key} has {', '.join(unknown)}, which is no answer; {known}"
    yield from _doubled("labels", [question.label(name) for name in named], "answer")
    yield from _doubled("keys", [*question.keys.values()], "answer")


def _number_problems(question: QuestionConfig) -> Iterator[str]:
    low, high, grain = question.minimum, question.maximum, question.grain
    if question.kind == "rating":
        yield from _scale_problems(low, high, grain)
    elif question.kind != "number" and (low, high, grain) != (None, None, None):
        yield f"minimum, maximum and grain are of a rating or a number, not of kind {question.kind!r}"
    elif low is not None and high is not None and low >= high:
        yield f"minimum {low:g} and maximum {high:g}: need minimum < maximum"
    elif low is not None and high is not None and grain is not None:
        yield from _grain_problems(low, high, grain)


def _doubled(key: str, values: Sequence[str], of: str) -> Iterator[str]:
    alike = [value.casefold() for value in values]
    doubled = sorted({value for value in values if alike.count(value.casefold()) > 1})
    if doubled:
        yield f"{key}: {', '.join(map(repr, doubled))} stands for more than one {of}; give each its own"


def _scale_problems(minimum: float | None, maximum: float | None, grain: float | None) -> Iterator[str]:
    if minimum is None or maximum is None or grain is None:
        yield "a rating needs minimum, maximum and grain (1 for points, such as 0.1 for a continuous scale)"
        return
    if not -1e6 <= minimum < maximum <= 1e6:
        yield f"minimum {minimum:g} and maximum {maximum:g}: need -1e6 <= minimum < maximum <= 1e6"
        return
    yield from _grain_problems(minimum, maximum, grain)


def _grain_problems(minimum: float, maximum: float, grain: float) -> Iterator[str]:
    steps = (maximum - minimum) / grain
    if abs(steps - round(steps)) > 1e-9 * steps:
        yield f"grain {grain:g} does not divide the scale {minimum:g} to {maximum:g}; use a part, such as 1 or 0.5"
