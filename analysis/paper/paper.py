"""The published numbers of a paper, read from TOML, their names, and what is said of each beside the obtained one.

A printed number stays text: its digits are part of the claim.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from experiments.config.door import Model, load

Printed = Annotated[str, StringConstraints(pattern=r"^[0-9]+(\.[0-9]+)?$")]
"""A number as the paper prints it, such as "28.45": decimal digits in quotes."""


def _is_share(text: str) -> str:
    if Decimal(text) > 1:
        raise ValueError("must not be above 1")
    return text


PrintedP = Annotated[Printed, AfterValidator(_is_share)]
"""A printed p-value or its bound."""
MOST_COUNTED = 1_000_000
"""Of people, trials or values: up to so many every count is checked within a second."""
AtLeastOne = Annotated[int, Field(ge=1, le=MOST_COUNTED)]


class PaperHead(Model):
    """Which paper it is."""

    title: str = ""
    source: str = ""
    field: str = ""


class Participants(Model):
    """Who took part."""

    n: AtLeastOne
    female: int
    male: int
    age_min: int
    age_max: int
    handedness: str


class PublishedAnova(Model):
    """F with its degrees of freedom, and the bound that p is said to be below."""

    F: Printed
    df: Annotated[list[AtLeastOne], Field(min_length=2, max_length=2)]
    p_below: PrintedP


class PublishedTukeyTest(Model):
    """`higher` is said to be significantly above `lower`, with p below the bound."""

    higher: str
    lower: str
    p_below: PrintedP


class PublishedBinomialTest(Model):
    """The p of the binomial test of a method and direction against one half."""

    method: str
    direction: Literal["forward", "backward"]
    p: PrintedP


class DirectionProtocol(Model):
    """How the trials of experiment 1 were laid out."""

    sessions: AtLeastOne
    sets_per_session: AtLeastOne
    trials_per_set: AtLeastOne
    forward_trials_per_session: int
    backward_trials_per_session: int
    set_break_s: int
    session_break_s: int
    duration_min: Printed


class PreferenceProtocol(Model):
    """How the trials of experiment 2 were laid out."""

    trials: AtLeastOne
    duration_min: Printed


class Lowest(Model):
    """So many participants rated `method` lowest."""

    method: str
    participants: int


class SameScore(Model):
    """So many participants gave two methods the same score."""

    methods: Annotated[list[str], Field(min_length=2, max_length=2)]
    participants: int


class PublishedExperiment(Model):
    """What both experiments print: n, the methods in order, F, and the pattern of the post-hoc tests."""

    n: AtLeastOne
    methods: Annotated[list[str], Field(min_length=2)]
    anova: PublishedAnova
    tukey: list[PublishedTukeyTest]

    @model_validator(mode="after")
    def _pairs_are_of_known_methods(self) -> PublishedExperiment:
        for claim in self.tukey:
            if claim.higher == claim.lower or not {claim.higher, claim.lower} <= set(self.methods):
                raise ValueError(f"tukey: {claim.higher} above {claim.lower} must be two of {', '.join(self.methods)}")
        return self


class PublishedDirection(PublishedExperiment):
    """Experiment 1; `means` are correct rates on forward trials in percent."""

    protocol: DirectionProtocol
    means: dict[str, Printed]
    binomial: list[PublishedBinomialTest]


class PublishedPreference(PublishedExperiment):
    """Experiment 2; its means are not printed."""

    protocol: PreferenceProtocol
    scale_min: int
    scale_max: int
    lowest: Lowest
    same_score: SameScore


class Paper(Model):
    """All published numbers. `claims` are for the audit, which checks them (`analysis.paper.audit.run`)."""

    paper: PaperHead = PaperHead()
    participants: Participants
    direction: PublishedDirection
    preference: PublishedPreference
    claims: list[dict[str, Any]] = Field(default_factory=list)


def load_paper(path: str | Path) -> Paper:
    """The paper's numbers from a TOML file. `ConfigError` with file, key, value and rule."""
    return load(Paper, Path(path))


ANOVA_F, ANOVA_P, PARTICIPANTS = "ANOVA F", "ANOVA p", "participants"


def anova_df(kind: str) -> str:
    """Degrees of freedom of the effect or of the error."""
    return f"ANOVA df of the {kind}"


def tukey_p(claim: PublishedTukeyTest) -> str:
    """The p of a post-hoc comparison."""
    return f"Tukey p, {claim.higher} above {claim.lower}"


def mean_rate(method: str) -> str:
    """A mean correct rate on forward shots."""
    return f"mean correct rate forward, {method}"


def one_half_p(claim: PublishedBinomialTest) -> str:
    """The p of a test against one half."""
    return f"binomial p, {claim.method} {claim.direction}"


def rated_lowest(claim: Lowest) -> str:
    """How many rated a method lowest."""
    return f"participants who rated {claim.method} lowest"


def one_score(claim: SameScore) -> str:
    """How many gave two methods one score."""
    return f"participants with one score for {' and '.join(claim.methods)}"


def named_in(experiment: str, quantity: str) -> str:
    """A quantity of an experiment.

    >>> named_in("direction", ANOVA_F)
    'direction: ANOVA F'
    """
    return f"{experiment}: {quantity}"


ComparisonVerdict = Literal[
    "agrees",
    "differs",
    "differs as predicted",
    "not published",
    "not obtained",
    "attainable",
    "only under a reading",
    "not attainable",
    "undecided",
    "refused",
]
AUDITED: tuple[ComparisonVerdict, ...] = (
    "attainable",
    "only under a reading",
    "not attainable",
    "undecided",
    "refused",
)
"""The audit's verdicts, of numbers that no log holds; the others are of numbers that were obtained or could be."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonRow:
    """One quantity: `published` as the paper prints it, `obtained` unrounded in the same unit.

    `audit`: what the audit says of the published number; empty if it was not asked.
    """

    experiment: str
    quantity: str
    published: str
    obtained: float | None
    verdict: ComparisonVerdict
    note: str = ""
    audit: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What the audit says of a published number: its verdict, the nearest attainable values, and that in words."""

    verdict: str
    nearest: tuple[float, ...] = ()
    note: str = ""


def rounds_to(value: float, printed: str) -> bool:
    """Does `value` round to `printed`, a tie either way?

    >>> rounds_to(55.714, "55.7"), rounds_to(55.65, "55.7"), rounds_to(55.64, "55.7")
    (True, True, False)
    """
    half_a_digit = Decimal(5).scaleb(int(Decimal(printed).as_tuple().exponent) - 1)
    return abs(Decimal(repr(value)) - Decimal(printed)) <= half_a_digit + Decimal("1e-12")
