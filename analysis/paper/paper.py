"""The published numbers of a paper, read from TOML. A printed number stays text: its digits are part of the claim."""

from __future__ import annotations

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
AtLeastOne = Annotated[int, Field(ge=1)]


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
    """All published numbers. `claims` are for the audit, which checks them (`analysis.paper.audit.paper_file`)."""

    paper: PaperHead = PaperHead()
    participants: Participants
    direction: PublishedDirection
    preference: PublishedPreference
    claims: list[dict[str, Any]] = Field(default_factory=list)


def load_paper(path: str | Path) -> Paper:
    """The paper's numbers from a TOML file. `ConfigError` with file, key, value and rule."""
    return load(Paper, Path(path))
