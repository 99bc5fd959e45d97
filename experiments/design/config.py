"""A whole design, and what its tables must agree on: each disagreement in words, with place, value and what would do.

What only the gun can tell (its methods, its limits) is checked when both are loaded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from device.parameters import GunParameters
from device.words import Direction
from experiments.config.door import ConsoleConfig, Model, Text, leaves
from experiments.config.findings import DESIGN_NAME, LANGUAGE_CODE
from experiments.config.lines import LineText
from experiments.design.answer_problems import answer_problems
from experiments.design.around_trials import (
    BreaksConfig,
    FatigueConfig,
    OpeningConfig,
    PracticeConfig,
    TimingConfig,
)
from experiments.design.language import (
    DIRECTION_FACTOR,
    DRIVEN,
    EMPTY,
    INSTRUCTION_FACTOR,
    METHOD_FACTOR,
    TRAIN_INTERVAL,
    ColumnName,
    FactorConfig,
    OrderConfig,
    QuestionConfig,
    TrialConfig,
    shown_level,
)
from experiments.design.plan import Condition, in_interval
from experiments.design.procedure_problems import procedure_problems
from experiments.design.procedures.config import AdaptiveConfig, ConstantConfig, PairingConfig, ProcedureConfig
from experiments.design.units import parted

GUN_NUMBERS = tuple(
    field.name for field in fields(GunParameters) if isinstance(field.default, float) or field.default is None
)
"""The numbers of a gun that a factor may change."""
_OWN_NAMES = (*GUN_NUMBERS, TRAIN_INTERVAL, METHOD_FACTOR, DIRECTION_FACTOR, INSTRUCTION_FACTOR)
"""The names by which a factor does more than have a hand set something."""


def _is_english(code: str) -> bool:
    return code == "en"


class DesignConfig(Model):
    """A design: `docs/design-language.md`. `language` is that of its texts, in no record where it is English."""

    design: Annotated[str, Field(pattern=DESIGN_NAME)]
    title: LineText
    gun: Text
    language: Annotated[str, Field(pattern=LANGUAGE_CODE, exclude_if=_is_english)] = "en"
    synthetic: Text | None = None
    table: Literal["trials", "ratings"] = "trials"
    below_break_away: bool = False
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] | None = None
    assumed: tuple[Text, ...] = ()
    factors: dict[ColumnName, FactorConfig] = Field(min_length=1, max_length=20)
    order: OrderConfig = OrderConfig()
    trial: TrialConfig = TrialConfig()
    procedure: ProcedureConfig = ConstantConfig(kind="constant")
    questions: dict[ColumnName, QuestionConfig] = Field(min_length=1, max_length=20)
    opening: tuple[OpeningConfig, ...] = ()
    practice: PracticeConfig = PracticeConfig()
    breaks: BreaksConfig = BreaksConfig()
    fatigue: FatigueConfig
    timing: TimingConfig
    console: ConsoleConfig = ConsoleConfig()

    @property
    def experiment(self) -> str:
        """The design's name, as journals and tables have it."""
        return self.design

    @property
    def methods(self) -> tuple[str, ...]:
        """The rendering methods that are met."""
        return tuple(str(level) for level in self.factors[METHOD_FACTOR].all_levels)

    @property
    def hand_over_s(self) -> float:
        """Planned time of a hand-over."""
        return self.timing.hand_over_s

    @property
    def question_s(self) -> float:
        """Planned time of one question: `timing.answer_s` is that of all that are asked about a trial."""
        return self.timing.answer_s / len(self.questions)

    @property
    def trial_s(self) -> float:
        """Planned time of a trial, without what is asked after its block."""
        return self.timing.hand_over_s + self.timing.stimulus_s + self.timing.answer_s - self.rating_s

    @property
    def rating_s(self) -> float:
        """Planned time of what is asked about a trial after its block."""
        return self.question_s * len(self.asked_later)

    @property
    def asked_at_once(self) -> tuple[str, ...]:
        """The questions about a trial when it was felt."""
        return tuple(name for name, question in self.questions.items() if question.when == "trial")

    @property
    def asked_later(self) -> tuple[str, ...]:
        """The questions about each trial after its block."""
        return tuple(name for name, question in self.questions.items() if question.when == "block")

    @property
    def judged_later(self) -> tuple[str, ...]:
        """Those after the block that take more than words."""
        return tuple(name for name in self.asked_later if self.questions[name].kind != "text")

    @property
    def judgements(self) -> tuple[str, ...]:
        """The questions that make a trial an answered one: words alone are no judgement, unless only they are asked."""
        return tuple(name for name, one in self.questions.items() if one.kind != "text") or tuple(self.questions)

    @property
    def between(self) -> tuple[str, ...]:
        """The factors that vary between participants."""
        return tuple(name for name, factor in self.factors.items() if factor.between)

    @property
    def varying(self) -> tuple[str, ...]:
        """The factors that vary from trial to trial, the compared one included."""
        blocked = {*self.order.session, *self.order.set, *self.between}
        return tuple(name for name in self.factors if name not in blocked)

    @property
    def adaptive(self) -> AdaptiveConfig | None:
        """How levels are chosen from the answers so far; `None` where all are planned beforehand."""
        return None if isinstance(self.procedure, ConstantConfig) else self.procedure

    @property
    def adapted(self) -> tuple[str, ...]:
        """The factors whose levels are chosen from the answers so far."""
        return self.adaptive.of if self.adaptive else ()

    @property
    def chosen_names(self) -> tuple[str, ...]:
        """By what names the levels are known that are chosen for a trial: of a pair one an interval."""
        if isinstance(self.procedure, PairingConfig):
            return tuple(in_interval(name, place) for name in self.adapted for place in (1, 2))
        return self.adapted

    @property
    def last_choice(self) -> Condition:
        """What could be chosen for a trial: the last level of each factor, the highest of numbers; of a pair two."""
        last = [self.factors[name].all_levels[::-1] for name in self.adapted]
        pair = isinstance(self.procedure, PairingConfig)
        return tuple(zip(self.chosen_names, last[0] if pair else [one[0] for one in last], strict=False))

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for problem in _problems(self):
            raise ValueError(problem)
        return self


def _problems(design: DesignConfig) -> Iterator[str]:
    """What two tables of a design do not agree on, in words."""
    yield from _name_problems(design)
    yield from _factor_problems(design)
    yield from _blocking_problems(design)
    yield from _trial_problems(design)
    yield from _feedback_problems(design)
    if design.adaptive is not None:
        yield from procedure_problems(design.adaptive, design.factors, design.order, design.trial, design.questions)
    for name, question in design.questions.items():
        found = answer_problems(question, design.trial, design.factors)
        yield from (f"questions.{name}: {problem}" for problem in found)
    unknown = sorted(set(design.assumed) - set(leaves(design)))
    if unknown:
        yield f"assumed names {', '.join(unknown)}, which this design does not have; name existing keys"


_COMMON_COLUMNS = frozenset(
    [
        "participant_id",
        "experiment",
        "session",
        "set",
        "trial",
        "track",
        "stimulus",
        "attempts",
        "flags",
        "note",
        "onset_utc",
        "gun",
        "shots",
        "exposure_s",
        "earlier_exposure_s",
        "status",
        "correct",
    ]
)


_TAKEN = (
    *("excluded", "labels", "participation", "preregistration", "remarks", "requested", "rules", "studies"),
    *("versions", "warnings"),
)
"""What `statistics.json` has beside the designs by their names."""


def _name_problems(design: DesignConfig) -> Iterator[str]:
    if design.design in _TAKEN:
        yield f"design = {design.design!r}: the statistics have another part of that name; choose another"
    named = list(dict.fromkeys((*design.factors, *design.questions)))
    alike = [name for name in named if sum(one.casefold() == name.casefold() for one in named) > 1]
    if alike:
        yield f"{', '.join(alike)} differ in case alone; rename one"
    taken = [name for name in (*design.factors, *design.questions) if name in _COMMON_COLUMNS]
    for name in taken:
        where = "factors" if name in design.factors else "questions"
        yield f"{where}.{name}: {name} is the name of a column that every table has; choose another name"
    yield from _column_problems(design)
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


def _column_problems(design: DesignConfig) -> Iterator[str]:
    columns = [*_columns_of_factors(design), *_columns_of_questions(design)]
    names = [column for _, column in columns]
    for place, column in columns[::-1]:  # of two alike the later one is named
        if names.count(column) > 1:
            yield f"{place}: {column} would be two columns of the table, of a factor or question each; rename one"


def _columns_of_factors(design: DesignConfig) -> Iterator[tuple[str, str]]:
    """The columns with the table that each is of."""
    for name in design.factors:
        compared = range(1, design.trial.intervals + 1) if name == design.trial.compare else ()
        yield from ((f"factors.{name}", one) for one in (name, *(in_interval(name, place) for place in compared)))


def _columns_of_questions(design: DesignConfig) -> Iterator[tuple[str, str]]:
    """The columns with the table that each is of."""
    for name, question in design.questions.items():
        parts = ("correct", "time_s", "source", "time_valid") if question.named_answers else ("by",)
        more = () if question.kind == "text" else parts
        yield from ((f"questions.{name}", one) for one in (name, *(f"{name}_{part}" for part in more)))


def _factor_problems(design: DesignConfig) -> Iterator[str]:
    if METHOD_FACTOR not in design.factors:
        yield f"factors.{METHOD_FACTOR} is missing: name the rendering method, one level if there is only one"
    for name, factor in design.factors.items():
        found = (*_level_problems(name, factor), *_hand_problems(name, factor), *_nesting_problems(design, factor))
        yield from (f"factors.{name}: {problem}" for problem in found)
        if factor.between and name in (*design.order.session, *design.order.set, design.trial.compare):
            yield f"factors.{name}: between = true: it varies between people; take it out of order and trial"
    told = design.factors.get(INSTRUCTION_FACTOR)
    if told is not None and INSTRUCTION_FACTOR in design.varying and len(told.all_levels) > 1:
        yield "order.set: instructions are read out before a set; name it in order.set or order.session"


def _level_problems(name: str, factor: FactorConfig) -> Iterator[str]:
    shown, unit = [shown_level(level) for level in factor.all_levels], parted(name).unit
    words = isinstance(factor.all_levels[0], str)
    strangers = [level for level in shown if level not in get_args(Direction)]
    if name == DIRECTION_FACTOR and strangers:
        yield f"levels {', '.join(map(repr, strangers))}: directions are {', '.join(get_args(Direction))}"
    if name in {METHOD_FACTOR, INSTRUCTION_FACTOR} and not words:
        yield "levels are numbers; name them in words"
    if unit and words:
        yield f"levels are words, but the name ends with the unit {unit}; give numbers"
    missing = [level for level in shown if level not in factor.texts]
    if name == INSTRUCTION_FACTOR and missing:
        yield f"texts has no words for {', '.join(missing)}; give what is read out"
    if name != INSTRUCTION_FACTOR and factor.texts:
        yield "texts are of the factor `instruction`; use labels here"


def _hand_problems(name: str, factor: FactorConfig) -> Iterator[str]:
    """What a hand sets changes no shot: under a misspelt name of the gun's every trial would fire the same one."""
    if name in _OWN_NAMES or {*map(shown_level, factor.all_levels)} <= {*factor.sets}:
        return
    words = isinstance(factor.all_levels[0], str)
    if meant := [own for own in _OWN_NAMES if _is_meant(name, own, words=words)]:
        yield f"did you mean {meant[0]}? What a hand sets needs `sets` for each of its levels, or another name"
    elif not (words or factor.between) and parted(name).unit in {parted(number).unit for number in DRIVEN}:
        yield (
            f"the gun has no such number; it has {', '.join(GUN_NUMBERS)}; what a hand sets needs `sets` for each "
            "of its levels, or a name with another unit"
        )


def _is_meant(name: str, own: str, *, words: bool) -> bool:
    """Whether a name differs from one of the language's own in case, plural, or in what follows a number's words."""
    said = parted(name).words.lower()
    if words:
        return said.removesuffix("s") == own
    return f"{said} ".startswith(f"{parted(own).words} ")


def _nesting_problems(design: DesignConfig, factor: FactorConfig) -> Iterator[str]:
    if factor.within is None:
        return
    outer = design.factors.get(factor.within)
    if outer is None or outer is factor:
        yield f"within = {factor.within!r} is no other factor; the factors are {', '.join(design.factors)}"
        return
    if outer.within is not None:
        yield f"within = {factor.within!r} is nested itself; one level of nesting is enough"
    have = set(factor.levels) if isinstance(factor.levels, dict) else set()
    off = have ^ {shown_level(level) for level in outer.all_levels}
    if off:
        yield f"levels must have one list for each level of {factor.within}; check {', '.join(sorted(off))}"


def _blocking_problems(design: DesignConfig) -> Iterator[str]:
    """A nested factor can be constant only where the one that it is nested in is constant as well."""
    blocks = ("order.session", "order.set", "the trials")
    for name, factor in design.factors.items():
        if factor.within is None or factor.within not in design.factors or factor.within in design.between:
            continue
        inner, outer = _block(design, name), _block(design, factor.within)
        if inner < outer or (outer == 1 and inner > outer):
            where = f"{name} varies in {blocks[inner]} and {factor.within} in {blocks[outer]}"
            yield (
                f"factors.{name} is nested in {factor.within}, but {where}; block both in order.session, both in "
                f"order.set, or {factor.within} alone in order.session"
            )


def _block(design: DesignConfig, name: str) -> int:
    """In what a factor is constant: 0 a session, 1 a set, 2 a trial."""
    return 0 if name in design.order.session else 1 if name in design.order.set else 2


def _trial_problems(design: DesignConfig) -> Iterator[str]:
    trial = design.trial
    if trial.catch and design.order.trials != "random":
        shown = f"catch trials in an order.trials of {design.order.trials!r} would be known; use random"
        yield f"trial.catch = {trial.catch}: {shown}"
    for name in _by_hand_between_trials(design) if trial.catch else ():
        yield (
            f"trial.catch = {trial.catch}: {name} is set by hand from trial to trial, and catch trials, which have "
            f"none, would be known; name {name} in order.session or order.set, or take it out"
        )
    if TRAIN_INTERVAL in design.factors and trial.kind != "train":
        yield f"factors.{TRAIN_INTERVAL} is the interval of a train, but trial.kind is {trial.kind!r}"
    if trial.compare is not None and trial.compare in design.factors:
        yield from _comparison_problems(design, trial.compare, design.factors[trial.compare])


def _by_hand_between_trials(design: DesignConfig) -> Iterator[str]:
    """What the experimenter's hands do otherwise from one trial to the next, dampers of methods apart."""
    for name in design.varying:
        by_hand = name not in (*DRIVEN, METHOD_FACTOR, INSTRUCTION_FACTOR, TRAIN_INTERVAL)
        if by_hand and len(design.factors[name].all_levels) > 1:
            yield name


def _comparison_problems(design: DesignConfig, compare: str, factor: FactorConfig) -> Iterator[str]:
    trial = design.trial
    if compare not in design.varying:
        yield f"trial.compare = {compare!r} is constant in a block or person; compare one that varies between trials"
    if factor.within is not None:
        yield f"trial.compare = {compare!r} is nested; compare one that is not"
    inner = [name for name, one in design.factors.items() if one.within == compare]
    if inner:
        yield f"trial.compare = {compare!r}: factors.{inner[0]} is nested in it; cross them, or compare another"
    if trial.kind == "pair" and len(factor.all_levels) < 2:
        yield f"trial.kind = 'pair': {compare} has one level, which makes no pair"
    if trial.standard is None:
        return
    shown = shown_level(trial.standard)
    blank = shown == EMPTY and trial.kind == "two-interval"
    if not blank and isinstance(trial.standard, str) != isinstance(factor.all_levels[0], str):
        yield f"trial.standard = {trial.standard!r} is not of the kind of {compare}'s levels"
    if trial.standard in factor.all_levels and trial.kind in {"abx", "oddity"}:
        yield f"trial.standard = {shown} is a level of {compare} as well: nothing would differ; take it out"


def _feedback_problems(design: DesignConfig) -> Iterator[str]:
    scored = any(question.correct and question.when == "trial" for question in design.questions.values())
    told = {"trial.feedback": design.trial.feedback, "practice.feedback": design.practice.feedback}
    for key, asked in told.items():
        if asked and not scored:
            yield f"{key} = true: nothing is right or wrong; give a question `correct`, or remove {key}"
    if design.practice.until_right is not None and not scored:
        key = f"practice.until_right = {design.practice.until_right:g}"
        yield f"{key}: nothing is right or wrong; give a question `correct`, or remove until_right and rounds"
