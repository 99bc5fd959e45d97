"""The published numbers of a paper, read from TOML. A printed number stays text: its digits are part of the claim."""

from __future__ import annotations

import tomllib
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, ValidationError, model_validator

Printed = Annotated[str, StringConstraints(pattern=r"^[0-9]+(\.[0-9]+)?$")]
"""A number as the paper prints it, such as "28.45": decimal digits in quotes."""


def _is_share(text: str) -> str:
    if Decimal(text) > 1:
        raise ValueError("must not be above 1")
    return text


PrintedP = Annotated[Printed, AfterValidator(_is_share)]
"""A printed p-value or its bound."""
Count = Annotated[int, Field(ge=1)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class PaperHead(_Section):
    """Which paper it is."""

    title: str = ""
    source: str = ""
    field: str = ""


class Participants(_Section):
    """Who took part."""

    n: Count
    female: int
    male: int
    age_min: int
    age_max: int
    handedness: str


class PublishedAnova(_Section):
    """F with its degrees of freedom, and the bound that p is said to be below."""

    F: Printed
    df: Annotated[list[Count], Field(min_length=2, max_length=2)]
    p_below: PrintedP


class TukeyClaim(_Section):
    """`higher` is said to be significantly above `lower`, with p below the bound."""

    higher: str
    lower: str
    p_below: PrintedP


class BinomialClaim(_Section):
    """The p of the binomial test of a method and direction against one half."""

    method: str
    direction: Literal["forward", "backward"]
    p: PrintedP


class DirectionProtocol(_Section):
    """How the trials of experiment 1 were laid out."""

    sessions: Count
    sets_per_session: Count
    trials_per_set: Count
    forward_trials_per_session: int
    backward_trials_per_session: int
    set_break_s: int
    session_break_s: int
    duration_min: Printed


class PreferenceProtocol(_Section):
    """How the trials of experiment 2 were laid out."""

    trials: Count
    duration_min: Printed


class Lowest(_Section):
    """So many participants rated `method` lowest."""

    method: str
    participants: int


class SameScore(_Section):
    """So many participants gave two methods the same score."""

    methods: Annotated[list[str], Field(min_length=2, max_length=2)]
    participants: int


class PublishedExperiment(_Section):
    """What both experiments print: n, the methods in order, F, and the pattern of the post-hoc tests."""

    n: Count
    methods: Annotated[list[str], Field(min_length=2)]
    anova: PublishedAnova
    tukey: list[TukeyClaim]

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
    binomial: list[BinomialClaim]


class PublishedPreference(PublishedExperiment):
    """Experiment 2; its means are not printed."""

    protocol: PreferenceProtocol
    scale_min: int
    scale_max: int
    lowest: Lowest
    same_score: SameScore


class Paper(_Section):
    """All published numbers. `claims` are for the audit, which checks them (`analysis.paper.audit.paper_file`)."""

    paper: PaperHead = PaperHead()
    participants: Participants
    direction: PublishedDirection
    preference: PublishedPreference
    claims: list[dict[str, Any]] = []


def load_paper(path: str | Path) -> Paper:
    """The paper's numbers from a TOML file.

    `ValueError` with the file and, of the first fault, the key, the value and the rule.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:  # not UTF-8, or not TOML
        raise ValueError(f"{path}: not a TOML file: {error}") from error
    try:
        return Paper.model_validate(content)
    except ValidationError as error:
        raise ValueError(f"{path}: {_first_fault(error)}") from error


def _first_fault(error: ValidationError) -> str:
    fault = error.errors()[0]
    key = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "missing":
        return f"key {key} is missing (rule: it is required)"
    if fault["type"] == "extra_forbidden":
        return f"key {key} = {fault['input']!r} is unknown (rule: no other keys)"
    if isinstance(fault["input"], dict):
        return f"key {key}: {fault['msg']}"
    return f"key {key} = {fault['input']!r}: {fault['msg']}"
