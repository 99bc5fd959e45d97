"""What is said about a run beside its steps: corrections, flags, notes, pauses. They change no step, only the table.

The old value of a correction stays in the journal; the table shows the last one.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from device.words import Direction
from experiments.plan import Trial, where_given


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerCorrected:
    """The answer to a trial was entered wrongly; this is what the participant had said."""

    trial: Trial
    response: Direction
    kind: Literal["answer-corrected"] = "answer-corrected"


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingCorrected:
    """A rating was entered wrongly; `None` is no answer."""

    trial: Trial
    rating: float | None
    kind: Literal["rating-corrected"] = "rating-corrected"


@dataclass(frozen=True, slots=True, kw_only=True)
class Flagged:
    """A trial is marked, with a word such as `noise` or `late`."""

    trial: Trial
    flag: Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]{0,31}$")]
    kind: Literal["flagged"] = "flagged"


@dataclass(frozen=True, slots=True, kw_only=True)
class Noted:
    """The experimenter's words on a trial, or on the run if no trial is named."""

    trial: Trial | None
    text: str
    kind: Literal["noted"] = "noted"


@dataclass(frozen=True, slots=True, kw_only=True)
class Paused:
    """The experimenter paused the run."""

    kind: Literal["paused"] = "paused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Continued:
    """The run went on after a pause of so many seconds."""

    paused_s: float
    kind: Literal["continued"] = "continued"


Remark = AnswerCorrected | RatingCorrected | Flagged | Noted | Paused | Continued

_REMARK: TypeAdapter[Remark] = TypeAdapter(Annotated[Remark, Field(discriminator="kind")])


def record(remark: Remark) -> dict[str, Any]:
    """A remark as plain JSON values."""
    return asdict(remark, dict_factory=where_given)


def remark_from(body: object) -> Remark:
    """The remark that a record holds; `pydantic.ValidationError` if it holds none."""
    return _REMARK.validate_python(body)
