"""What configs are made of: the types, tables and rules that the experiments' own models share.

Unknown keys, wrong types, infinities and contradictions are refused here, at the door; inside, a config is trusted.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, Field, model_validator

from experiments.config.door import Model

Order = Literal["random", "williams", "latin-square"]
Fact = Literal["age_years", "sex", "handedness"]
"""What may be asked of a participant before a run."""
Sex = Literal["female", "male", "other", "undisclosed"]
Handedness = Literal["right", "left", "both"]

CODE = r"[A-Za-z0-9]{1,32}"
"""A participant's code, as a pattern."""


def _distinct(methods: tuple[str, ...]) -> tuple[str, ...]:
    doubled = sorted({name for name in methods if methods.count(name) > 1})
    if doubled:
        raise ValueError(f"{', '.join(doubled)} stands there more than once; name each method once")
    return methods


Count = Annotated[int, Field(ge=1, le=10_000)]
Seconds = Annotated[float, Field(ge=0, le=86_400)]
Share = Annotated[float, Field(ge=0, le=1)]
InnerShare = Annotated[float, Field(gt=0, lt=1)]
Spread = Annotated[float, Field(ge=0, le=100)]
Text = Annotated[str, Field(min_length=1, max_length=2_000)]
Methods = Annotated[tuple[Text, ...], Field(min_length=1, max_length=26), AfterValidator(_distinct)]


class SyntheticConfig(Model):
    """Who answers when nobody sits there: an observer, or the answers of a table."""

    observer: str
    table: Text | None = None

    @model_validator(mode="after")
    def _table_is_named(self) -> Self:
        if self.observer == "table" and self.table is None:
            raise ValueError('observer = "table" needs the key `table`: the CSV file with the answers')
        return self


class ConsoleConfig(Model):
    """What the experimenter's screen does.

    `guard_s`: for so long after a change of what is on the screen nothing is taken that answers, fires or goes on; 0
    switches the guard off. `response_times`: a strip of the participant's own response times, never of correctness.
    """

    guard_s: Annotated[float, Field(ge=0, le=5)] = 0.25
    response_times: bool = False


class ExperimentConfig(Model):
    """What every experiment's config says."""

    experiment: str
    title: Text
    gun: Text
    console: ConsoleConfig = ConsoleConfig()
    assumed: tuple[Text, ...] = ()
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] | None = None

    @property
    def trial_s(self) -> float:
        """Planned time of a trial; 0 where none is planned."""
        return 0.0

    @property
    def break_s(self) -> float:
        """All planned breaks together; there are none unless an experiment has them."""
        return 0.0

    @property
    def rating_s(self) -> float:
        """Planned time of what is asked of a trial after all were felt."""
        return 0.0

    @model_validator(mode="after")
    def _assumed_exists(self) -> Self:
        unknown = sorted(set(self.assumed) - set(leaves(self)))
        if unknown:
            raise ValueError(f"assumed names {', '.join(unknown)}, which this config does not have; name existing keys")
        return self


AgeYears = Annotated[int, Field(ge=1, le=120)]
Some = TypeVar("Some", bound=str)


def once(levels: tuple[Some, ...]) -> tuple[Some, ...]:
    """The levels; `ValueError` if one stands there twice."""
    doubled = sorted({level for level in levels if levels.count(level) > 1})
    if doubled:
        raise ValueError(f"{', '.join(doubled)} stands there more than once; name each once")
    return levels


class EligibilityConfig(Model):
    """What is asked of a participant before a run, and who may take part. Empty levels and missing ages: any."""

    ask: Annotated[tuple[Fact, ...], AfterValidator(once)] = ()
    handedness: Annotated[tuple[Handedness, ...], AfterValidator(once)] = ()
    sex: Annotated[tuple[Sex, ...], AfterValidator(once)] = ()
    age_years_min: AgeYears | None = None
    age_years_max: AgeYears | None = None

    @model_validator(mode="after")
    def _ages_are_possible(self) -> Self:
        low, high = self.age_years_min, self.age_years_max
        if low is not None and high is not None and low > high:
            raise ValueError(f"age_years_min = {low} is above age_years_max = {high}, so nobody could take part")
        return self

    @model_validator(mode="after")
    def _rules_are_about_what_is_asked(self) -> Self:
        for key, fact in _RULES.items():
            value = getattr(self, key)
            if value not in ((), None) and fact not in self.ask:
                shown = list(value) if isinstance(value, tuple) else value
                raise ValueError(f'{key} = {shown} is a rule about {fact}, which is not asked; add "{fact}" to ask')
        return self


_RULES: dict[str, Fact] = {
    "handedness": "handedness",
    "sex": "sex",
    "age_years_min": "age_years",
    "age_years_max": "age_years",
}
"""Which fact each rule is about."""


class StudyConfig(Model):
    """A study: how many people, which experiments, who may take part, and what to compare with."""

    title: Text
    participants: Annotated[int, Field(ge=1, le=999)]
    code_prefix: Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,29}$")] = "P"
    experiments: Annotated[tuple[Text, ...], Field(min_length=1)]
    paper: Text | None = None
    replications: Annotated[int, Field(ge=0, le=1_000_000)] = 2000
    eligibility: EligibilityConfig = EligibilityConfig()

    def codes(self) -> list[str]:
        """The participants' codes, P01 onwards."""
        return participant_codes(self.participants, self.code_prefix)


def participant_codes(count: int, prefix: str = "P") -> list[str]:
    """Codes for so many participants, all of one length.

    >>> participant_codes(2)
    ['P01', 'P02']
    """
    width = max(2, len(str(count)))
    return [f"{prefix}{number:0{width}d}" for number in range(1, count + 1)]


def leaves(model: BaseModel, prefix: str = "") -> Iterator[str]:
    """The dotted keys of a config, tables and values alike."""
    for name in type(model).model_fields:
        yield f"{prefix}{name}"
        yield from _inner_leaves(getattr(model, name), f"{prefix}{name}.")


def _inner_leaves(value: object, prefix: str) -> Iterator[str]:
    if isinstance(value, BaseModel):
        yield from leaves(value, prefix)
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield f"{prefix}{key}"
            yield from _inner_leaves(inner, f"{prefix}{key}.")


def check_covered(where: str, values: dict[str, float], methods: tuple[str, ...]) -> None:
    """Refuse a table that lacks one of the design's methods."""
    missing = [name for name in methods if name not in values]
    if missing:
        raise ValueError(f"{where} has no value for {', '.join(missing)}; give one for each of design.methods")


def check_duration(duration_s: float, max_planned_s: float) -> None:
    """Refuse a plan that takes longer than a participant is to be kept."""
    if duration_s > max_planned_s:
        raise ValueError(
            f"the planned duration of {duration_s:g} s exceeds fatigue.max_planned_s = {max_planned_s:g} s; "
            "plan fewer or shorter trials and breaks"
        )
