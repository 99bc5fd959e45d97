"""What is said about a run beside its steps: corrections, flags, notes, pauses. They change no step, only the table.

The old value of a correction stays in the journal; the table shows the last one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter

from experiments.design.plan import Trial, plain_fields
from experiments.tasks.questions import AnswerValue


@dataclass(frozen=True, slots=True, kw_only=True)
class EntryCorrected:
    """What was entered for a trial's question was wrong; this is what the participant had said."""

    trial: Trial
    question: str
    value: AnswerValue
    kind: Literal["corrected"] = "corrected"


HALTED_BEFORE = "What this participant, or this gun, did before ended by an emergency stop: a test shot comes first."
"""What is noted of a run that begins so."""
KEY_TIME_LOST = "key-time-lost"
"""The flag of a trial whose key counts and whose response time does not: what stamps keys had stood still."""


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
    """The run was paused by the experimenter, or for the cause that is named."""

    cause: str = ""
    kind: Literal["paused"] = "paused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Continued:
    """The run went on after a pause of so many seconds."""

    paused_s: float
    kind: Literal["continued"] = "continued"


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """Something was pressed that would have carried the run on, and was not taken; why, and what it would have said."""

    event: str
    state: str
    because: str
    by: Literal["experimenter", "participant"]
    answer: AnswerValue = None
    kind: Literal["refused"] = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Halted:
    """The emergency stop: from here on this run arms and fires no more. `by` is at whose screen."""

    by: Literal["experimenter", "participant"]
    kind: Literal["halted"] = "halted"


@dataclass(frozen=True, slots=True, kw_only=True)
class HaltReason:
    """Why there was an emergency stop."""

    text: str
    kind: Literal["halt-reason"] = "halt-reason"


OF_HALT = (Halted, HaltReason)
"""Each has an emergency stop on record: of one that the disk refused, the reason that was typed for it does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TestShot:
    """A shot that nobody judged, after a key was held for so long: the gun may be armed again after an emergency stop.

    `held_s` is `None` where words were typed instead. Empty `cause`: it was fired, at a time on the host's monotonic
    clock.
    """

    method: str
    held_s: float | None
    cause: str = ""
    pulse_start_s: float | None = None
    motion: str = ""
    kind: Literal["test-shot"] = "test-shot"


DeliveryMark = Literal["", "no-peak", "outside", "slipped", "not-measured"]
"""What a sensor says against a shot: nothing, or that none came, that this one is not what the model allows, that the
last ones together are not, or that it was not measured."""
NOT_DELIVERED: tuple[DeliveryMark, ...] = ("no-peak", "outside", "slipped")
"""The marks of a shot that was not delivered as the model says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotMeasured:
    """What a sensor beside the gun measured of one shot, with standard uncertainties (`_u_`), and what was expected.

    `shot` counts from 1 in a presentation, `interval` from 0. `pulse_start_s` is the gun's own word, `onset_s` the
    measured onset after it. What was not measured is `None`; `because` says why there is a mark.
    """

    trial: Trial
    attempt: int
    interval: int = 0
    shot: int
    method: str
    sensor: str
    pulse_start_s: float
    mark: DeliveryMark = ""
    because: str = ""
    onset_s: float | None = None
    onset_u_s: float | None = None
    peak_m_s2: float | None = None
    peak_u_m_s2: float | None = None
    expected_peak_m_s2: float | None = None
    friction_N: float | None = None
    friction_u_N: float | None = None
    expected_friction_N: float | None = None
    kind: Literal["measured"] = "measured"


Remark = EntryCorrected | Flagged | Noted | Paused | Continued | Refused | Halted | HaltReason | TestShot | ShotMeasured

MAX_FLAG = 32


def flag_word(typed: str) -> str | None:
    """The flag that was typed, as it is kept; `None` if it is no word.

    >>> flag_word("Door slam"), flag_word("9 lives"), flag_word("-")
    ('door-slam', None, None)
    """
    flag = "-".join(typed.lower().split())
    plain = flag.isascii() and flag.replace("-", "").isalnum() and flag[0].isalpha()
    return flag if plain and len(flag) <= MAX_FLAG else None


REMARK: TypeAdapter[Remark] = TypeAdapter(
    Annotated[Remark, Field(discriminator="kind")], config=ConfigDict(defer_build=True)
)
"""Reads the remark that a record holds."""


def remark_record(remark: Remark) -> dict[str, object]:
    """A remark as plain JSON values."""
    return plain_fields(remark)


def remark_kind(remark: Remark) -> Literal["remark", "measured"]:
    """The kind of a remark's record: a sensor's word has one of its own."""
    return "measured" if isinstance(remark, ShotMeasured) else "remark"
